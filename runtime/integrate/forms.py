"""Methods that treat constraints in another form than index-1 equations with projection."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS, Method

if TYPE_CHECKING:
    from symgen.runtime.system import System

# h² and h times the gains of Baumgarte's force, which is held over a step. In a step it multiplies the drift
# (Φ, h dΦ/dt) by a matrix with the eigenvalues 0, 0, so that drift is gone after two; by one with 0.25 ± 0.19i for
# Euler's method, where the gains that do the same (1, 2) would let velocity constraints swing.
_GAINS = {
    "euler": (0.6, 1.5),
    "semi_implicit_euler": (1.0, 1.0),
    "verlet": (1.0, 1.5),
    "rk4": (1.0, 1.5),
    "dopri5": (1.0, 1.5),
    "dop853": (1.0, 1.5),
}


def _baumgarte(name: str, gains: tuple[float, float]) -> Method:
    def versions(system: System):
        from symgen.runtime.constraints.baumgarte import baumgarte_versions

        return baumgarte_versions(system)

    def tail(system: System):
        from symgen.runtime.constraints.baumgarte import baumgarte_tail

        return baumgarte_tail(system, gains)

    return replace(METHODS[name], versions=versions, tail=tail)


_INDEX_2_KERNELS = ("residual_jacobian", "residual", "constraint_residual")


def _radau_ggl(order: int) -> Method:
    def coefficients(system: System) -> Any:
        from symgen.runtime.integrate.radau.ggl_work import radau_ggl

        return radau_ggl((order + 1) // 2)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        from symgen.runtime.integrate.radau.ggl_work import ggl_work_size

        return int(ggl_work_size(coefficients, sizes))

    return replace(
        METHODS[f"radau{order}"], family="symgen.runtime.integrate.radau.ggl_loop:advance_radau_ggl",
        coefficients=coefficients, work_size=work_size, kernels=_INDEX_2_KERNELS,
    )  # fmt: skip


def _constrained_alpha(name: str, stabilised: bool) -> Method:
    def coefficients(system: System) -> Any:
        from symgen.runtime.integrate.alpha import coefficients

        return coefficients.ConstrainedAlpha(*getattr(coefficients, name)(), int(stabilised))

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        from symgen.runtime.integrate.alpha.constrained_work import constrained_alpha_work_size

        return int(constrained_alpha_work_size(coefficients, sizes))

    kernels = (*_INDEX_2_KERNELS, "constraint_jacobian", "mass_matrix")
    return replace(
        METHODS[name], family="symgen.runtime.integrate.alpha.constrained_loop:advance_constrained_alpha",
        coefficients=coefficients, work_size=work_size, kernels=kernels,
    )  # fmt: skip


def _bdf_ggl() -> Method:
    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        from symgen.runtime.integrate.bdf.ggl_work import bdf_ggl_work_size

        return int(bdf_ggl_work_size(sizes))

    family = "symgen.runtime.integrate.bdf.ggl_loop:advance_bdf_ggl"
    return replace(METHODS["bdf"], family=family, work_size=work_size, kernels=_INDEX_2_KERNELS)


def _partition(name: str) -> Method:
    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        from symgen.runtime.integrate.partition.work import partition_work_size

        return int(partition_work_size(coefficients.n_rows, sizes))

    kernels = ("mass_matrix", "constraint_jacobian", "constraint_residual")
    return replace(
        METHODS[name], family="symgen.runtime.integrate.partition.loop:advance_partition", work_size=work_size,
        kernels=kernels,
    )  # fmt: skip


_RECORDS: dict[str, dict[str, Method]] = {
    "baumgarte": {name: _baumgarte(name, gains) for name, gains in _GAINS.items()},
    "ggl": {
        **{f"radau{order}": _radau_ggl(order) for order in (5, 9, 13)},
        "bdf": _bdf_ggl(),
        **{name: _constrained_alpha(name, stabilised=True) for name in ("generalized_alpha", "hht")},
    },
    "index3": {
        **{name: _constrained_alpha(name, stabilised=False) for name in ("generalized_alpha", "hht")},
        **{name: METHODS[name] for name in ("rattle", "rattle4", "rattle6")},
    },
    "partition": {name: _partition(name) for name in ("rk4", "dopri5", "dop853")},
}

# form -> name of a method -> its record. "projection" is what the methods of METHODS do by themselves.
FORMS = {
    form: {name: replace(method, form=form) for name, method in methods.items()}
    for form, methods in _RECORDS.items()
}

# What `auto` takes where only the form was asked for.
SUITED = {"baumgarte": "dop853", "ggl": "radau5", "index3": "generalized_alpha", "partition": "dop853"}


def find_form(form: str, method_name: str) -> Method:
    """Return the record of a method that treats constraints in a form of `FORMS`.

    Raises
    ------
    RuntimeModelError
        The method does not have it; the message names those that do.
    """
    methods = FORMS[form]
    if method_name not in methods:
        those = ", ".join(methods) if methods else "no method so far"
        raise RuntimeModelError(
            f"constraints {form!r}: method {method_name!r} does not have this form, which is that of: {those}; "
            "name one of them, or leave constraints to 'projection', which every method has"
        )
    return methods[method_name]
