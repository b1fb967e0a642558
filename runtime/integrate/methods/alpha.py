"""The generalized-α method and HHT: with projection, of index 3, and of stabilised index 2."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import EVALUATIONS_PER_STAGE, Method, resolve

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System

_PURPOSE = "stiff structures: damps the fastest vibrations (by 0.9 and 0.82 a step), slow ones hardly"
_CONSTRAINED_KERNELS = (
    "residual_jacobian", "residual", "constraint_residual", "constraint_jacobian", "mass_matrix",
)  # fmt: skip
_SPARSE_KERNELS = ("residual_jacobian_entries", "residual", "constraint_residual")


def _alpha(name: str, oscillation_error: float) -> Method:
    def parameters(system: System) -> Any:
        return resolve(f"symgen.runtime.integrate.generalized_alpha:{name}")()

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(resolve("symgen.runtime.integrate.generalized_alpha:alpha_work_size")(sizes))

    return Method(
        name=name, order=2, dense_order=2, adaptive=False,
        family="symgen.runtime.integrate.generalized_alpha:advance_generalized_alpha",
        coefficients=parameters, work_size=work_size, evaluations=EVALUATIONS_PER_STAGE, purpose=_PURPOSE,
        kernels=("residual_jacobian",), stiff=True, oscillation_error=oscillation_error,
        aimed_steps=4.0,
    )  # fmt: skip


def _constrained(method: Method, form: str, suits_form: bool) -> Method:
    def coefficients(system: System) -> Any:
        constrained = resolve("symgen.runtime.integrate.generalized_alpha:ConstrainedAlpha")
        return constrained(*method.coefficients(system), int(form == "ggl"))

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        size = resolve("symgen.runtime.integrate.constrained_alpha:constrained_alpha_work_size")
        return int(size(coefficients, sizes))

    def refusal(system: System) -> str:
        changing = system.constraints_of_states
        if not changing:
            return ""
        return (
            f"iterates with the derivatives of constraints by speeds, and {changing[0]!r} changes with a first-order "
            "state as well: leave constraints to 'projection', or use radau5"
        )

    full = replace(
        method, form=form, suits_form=suits_form, refusal=refusal,
        family="symgen.runtime.integrate.constrained_alpha:advance_constrained_alpha",
        coefficients=coefficients, work_size=work_size, kernels=_CONSTRAINED_KERNELS,
    )  # fmt: skip
    return full if form == "ggl" else replace(full, sparse=_sparse(full))


def _sparse(full: Method) -> Method:
    """The index-3 form with sparse matrices."""

    def coefficients(system: System) -> Any:
        pattern = resolve("symgen.runtime.integrate.sparse:newton_pattern")(system)
        spare = resolve("symgen.runtime.integrate.newton_lu:new_spare")(pattern, 0)
        sparse = resolve("symgen.runtime.integrate.sparse_alpha:SparseAlpha")
        return sparse(*full.coefficients(system), pattern, spare)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(
            resolve("symgen.runtime.integrate.sparse_alpha:sparse_alpha_work_size")(coefficients, sizes)
        )

    def refusal(system: System) -> str:
        return "turns quaternions with full matrices only" if system.quaternions else full.refusal(system)

    return replace(
        full, family="symgen.runtime.integrate.sparse_alpha:advance_sparse_alpha", refusal=refusal,
        coefficients=coefficients, work_size=work_size, kernels=_SPARSE_KERNELS,
    )  # fmt: skip


_GENERALIZED, _HHT = _alpha("generalized_alpha", 0.0844), _alpha("hht", 0.105)

RECORDS = (
    _GENERALIZED,
    _constrained(_GENERALIZED, "ggl", suits_form=False),
    _constrained(_GENERALIZED, "index3", suits_form=True),
    _HHT,
    _constrained(_HHT, "ggl", suits_form=False),
    _constrained(_HHT, "index3", suits_form=False),
)
