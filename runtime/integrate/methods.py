"""The integration methods by name: what each is, what it needs, and which compiled loop runs it."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from math import factorial
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError, nearest

if TYPE_CHECKING:
    from symgen.runtime.system import System


@dataclass(frozen=True)
class Method:
    """An integration method; the code behind it is imported when it is used.

    Attributes
    ----------
    name : str
    order : int
    dense_order : int
        Of the dense output.
    adaptive : bool
        Chooses its own steps; otherwise it takes steps of one given length.
    family : str
        `module:function` of the step loop, see docs/architecture.md.
    coefficients : callable
        System -> the named tuple that the loop takes as `method`.
    work_size : callable
        (coefficients, sizes) -> length of the array `work`.
    kernels : tuple of str
        Functions of the model that it calls, beyond `rhs`.
    needs_plain_rates : bool
        Works only where the rates are dq/dt (nq == nv).
    stiff : bool
        Its step is not limited by the stability of fast, damped motions.
    steps_per_period : int
        Of the fastest motion, where a fixed step is left open: as many at least (`steps_in_a_period`).
    oscillation_error : float
        Of methods of fixed step: what an undamped oscillation of rate w is off by, in phase or in parts of its
        amplitude, per radian and (step w)^order, for short steps.
    refusal : callable
        System -> why the method cannot integrate it, and what can; an empty string where it can.
    form : str
        In which form it treats constraints by itself: "projection", or one of `forms.FORMS`.
    versions : callable, optional
        System -> the kernels that the loop is to call instead of those of every method: index in `addresses` -> address
        and what keeps its code alive.
    tail : callable, optional
        System -> what the loop carries behind the prepared `p`.
    multistep : bool
        Its steps are made of the motion before them as well, which a jump of the accelerations makes worthless.
    far_reaching : bool
        A single step may be as long as the motion is a polynomial, whatever the steps before it were.
    """

    name: str
    order: int
    dense_order: int
    adaptive: bool
    family: str
    coefficients: Callable[[System], Any]
    work_size: Callable[[Any, np.ndarray], int]
    kernels: tuple[str, ...] = ()
    needs_plain_rates: bool = False
    stiff: bool = False
    steps_per_period: int = 50
    oscillation_error: float = 0.0
    refusal: Callable[[System], str] = lambda system: ""
    form: str = "projection"
    versions: Callable[[System], dict[int, tuple[int, Any]]] | None = None
    tail: Callable[[System], np.ndarray] | None = None
    multistep: bool = False
    far_reaching: bool = False

    def advance(self) -> Callable:
        """Return the step loop."""
        return _resolve(self.family)


def _resolve(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(importlib.import_module(module), name)


def _explicit(
    name: str, order: int, dense_order: int, adaptive: bool, oscillation_error: float = 0.0
) -> Method:
    def tableau(system: System) -> Any:
        return _resolve(f"symgen.runtime.integrate.explicit.tableaus:{name}")()

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(
            _resolve("symgen.runtime.integrate.explicit.loop:erk_work_size")(coefficients.n_rows, sizes)
        )

    family = "symgen.runtime.integrate.explicit.loop:advance_erk"
    return Method(
        name, order, dense_order, adaptive, family, tableau, work_size, oscillation_error=oscillation_error
    )


def _symplectic(name: str, order: int, verlet: bool) -> Method:
    def scheme(system: System) -> Any:
        plain = system.nq == system.nv and not system.m
        reuse = verlet and plain and not (system.structure["velocity_dependent"] or system.nw)
        return _resolve("symgen.runtime.integrate.symplectic.loop:SymplecticScheme")(int(verlet), int(reuse))

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("symgen.runtime.integrate.symplectic.loop:symplectic_work_size")(sizes))

    family = "symgen.runtime.integrate.symplectic.loop:advance_semi_implicit"
    # Of order 1, amplitudes waver by half of step w, but nothing adds up.
    given = {"oscillation_error": 1 / 24} if verlet else {"steps_per_period": 250}
    return Method(name, order, 3, False, family, scheme, work_size, **given)


def _implicit(name: str, order: int, oscillation_error: float) -> Method:
    def stage(system: System) -> Any:
        return _resolve(f"symgen.runtime.integrate.one_stage.loop:{name.upper()}")

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("symgen.runtime.integrate.one_stage.work:implicit_work_size")(sizes))

    family = "symgen.runtime.integrate.one_stage.loop:advance_implicit"
    kernels = ("residual_jacobian",)
    return Method(
        name,
        order,
        order,
        False,
        family,
        stage,
        work_size,
        kernels,
        stiff=True,
        oscillation_error=oscillation_error,
    )


# Measured, as what is left of the terms of h^order depends on the coefficients.
_COMPOSITION_ERROR = {2: 1 / 24, 4: 9.3e-4, 6: 4.1e-4, 8: 1.3e-6}


def _composition(order: int) -> Method:
    def coefficients(system: System) -> Any:
        return _resolve("symgen.runtime.integrate.symplectic.composition_coefficients:composition")(order)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("symgen.runtime.integrate.symplectic.composition:composition_work_size")(sizes))

    family = "symgen.runtime.integrate.symplectic.composition:advance_composition"
    return Method(
        f"verlet{order}", order, 5, False, family, coefficients, work_size,
        needs_plain_rates=True, refusal=_not_separable, oscillation_error=_COMPOSITION_ERROR[order],
    )  # fmt: skip


def _not_separable(system: System) -> str:
    reasons = (
        (system.m, "has constraints"),
        (not system.structure["constant_mass"], "has a mass matrix that changes"),
        (system.structure["velocity_dependent"], "has forces that depend on velocities"),
    )
    why = next((text for applies, text in reasons if applies), "")
    needs = "needs accelerations that depend on positions only, but the model"
    others = "gauss8" if system.nn else "rattle4, rattle6, gauss8"
    return f"{needs} {why}: use {others} or dop853" if why else ""


# With these a pendulum swinging to 86 degrees keeps its energy to about 1e-11, with order 12 and more to round-off.
_GAUSS_STEPS_PER_PERIOD = {4: 50, 6: 50, 8: 40, 10: 30, 12: 20, 14: 16, 16: 14}


def _gauss(order: int) -> Method:
    n_stages = order // 2

    def coefficients(system: System) -> Any:
        return _resolve("symgen.runtime.integrate.gauss.coefficients:gauss")(n_stages)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("symgen.runtime.integrate.gauss.work:gauss_work_size")(coefficients, sizes))

    family = "symgen.runtime.integrate.gauss.loop:advance_gauss"
    kernels = ("residual_jacobian",)
    return Method(
        f"gauss{order}", order, min(n_stages, 7), False, family, coefficients, work_size, kernels,
        stiff=True, steps_per_period=_GAUSS_STEPS_PER_PERIOD[order],
        # That of the Padé approximation (s, s) of exp.
        oscillation_error=factorial(n_stages) ** 2 / factorial(order) / factorial(order + 1),
    )  # fmt: skip


def _alpha(name: str, oscillation_error: float) -> Method:
    def parameters(system: System) -> Any:
        return _resolve(f"symgen.runtime.integrate.alpha.coefficients:{name}")()

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("symgen.runtime.integrate.alpha.work:alpha_work_size")(sizes))

    family = "symgen.runtime.integrate.alpha.loop:advance_generalized_alpha"
    kernels = ("residual_jacobian",)
    return Method(
        name,
        2,
        2,
        False,
        family,
        parameters,
        work_size,
        kernels,
        stiff=True,
        oscillation_error=oscillation_error,
    )


def _rattle(order: int) -> Method:
    def coefficients(system: System) -> Any:
        make = _resolve("symgen.runtime.integrate.rattle.coefficients:rattle")
        return make(order, system.structure["constant_mass"])

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("symgen.runtime.integrate.rattle.work:rattle_work_size")(sizes))

    def refusal(system: System) -> str:
        return _resolve("symgen.runtime.integrate.rattle.model:rattle_refusal")(system)

    def kernels(system: System) -> dict[int, tuple[int, Any]]:
        return _resolve("symgen.runtime.integrate.rattle.model:rattle_kernels")(system)

    family = "symgen.runtime.integrate.rattle.loop:advance_rattle"
    name = "rattle" if order == 2 else f"rattle{order}"
    return Method(
        name, order, 4 if order > 2 else 2, False, family, coefficients, work_size,
        kernels=("mass_matrix", "forces"), refusal=refusal, form="index3", versions=kernels,
        oscillation_error=_COMPOSITION_ERROR[order],
    )  # fmt: skip


def _rodas5p() -> Method:
    def coefficients(system: System) -> Any:
        make = _resolve("symgen.runtime.integrate.rosenbrock.coefficients:rodas5p")
        return make(time_dependent=system.structure["time_dependent"])

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("symgen.runtime.integrate.rosenbrock.work:rodas_work_size")(sizes))

    family = "symgen.runtime.integrate.rosenbrock.loop:advance_rodas5p"
    kernels = ("residual_jacobian",)
    return Method("rodas5p", 5, 4, True, family, coefficients, work_size, kernels, stiff=True)


def _radau(order: int) -> Method:
    n_stages = (order + 1) // 2

    def coefficients(system: System) -> Any:
        return _resolve("symgen.runtime.integrate.radau.coefficients:radau")(n_stages)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("symgen.runtime.integrate.radau.work:radau_work_size")(coefficients, sizes))

    family = "symgen.runtime.integrate.radau.loop:advance_radau"
    kernels = ("residual_jacobian",)
    return Method(
        f"radau{order}", order, n_stages, True, family, coefficients, work_size, kernels, stiff=True
    )


def _bdf() -> Method:
    def coefficients(system: System) -> Any:
        return _resolve("symgen.runtime.integrate.bdf.coefficients:ndf")()

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(_resolve("symgen.runtime.integrate.bdf.work:bdf_work_size")(sizes))

    family = "symgen.runtime.integrate.bdf.loop:advance_bdf"
    kernels = ("residual_jacobian",)
    return Method("bdf", 5, 5, True, family, coefficients, work_size, kernels, stiff=True, multistep=True)


def taylor(order: int = 0) -> Method:
    """The method `taylor`; its order is chosen by the tolerance unless one is given."""

    def coefficients(system: System) -> Any:
        addresses = _resolve("symgen.runtime.taylor.kernel:taylor_addresses")(system)
        n_rows = _resolve("symgen.runtime.taylor.kernel:N_ROWS")
        return _resolve("symgen.runtime.integrate.taylor.loop:TaylorSeries")(*addresses, n_rows, order)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(
            _resolve("symgen.runtime.integrate.taylor.loop:taylor_work_size")(coefficients.n_rows, sizes)
        )

    def refusal(system: System) -> str:
        return _resolve("symgen.runtime.taylor.kernel:taylor_refusal")(system)

    family = "symgen.runtime.integrate.taylor.loop:advance_taylor"
    return Method(
        "taylor", order or 16, (order or 16) - 1, True, family, coefficients, work_size, refusal=refusal,
        far_reaching=True,
    )  # fmt: skip


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        _explicit("euler", 1, 1, adaptive=False, oscillation_error=1 / 2),
        _symplectic("semi_implicit_euler", 1, verlet=False),
        _symplectic("verlet", 2, verlet=True),
        _composition(4),
        _composition(6),
        _composition(8),
        _explicit("rk4", 4, 3, adaptive=False, oscillation_error=1 / 120),
        _explicit("dopri5", 5, 4, adaptive=True),
        _explicit("dop853", 8, 7, adaptive=True),
        _implicit("implicit_euler", 1, 1 / 2),
        _implicit("implicit_midpoint", 2, 1 / 12),
        _alpha("generalized_alpha", 0.0844),
        _alpha("hht", 0.105),
        *(_rattle(order) for order in (2, 4, 6)),
        *(_gauss(order) for order in range(4, 17, 2)),
        _rodas5p(),
        *(_radau(order) for order in (5, 9, 13)),
        _bdf(),
        taylor(),
    )
}


def find_method(name: str) -> Method:
    """Return the method called `name`.

    Raises
    ------
    RuntimeModelError
        There is none; the message names the nearest.
    """
    if name not in METHODS:
        raise RuntimeModelError(
            f"there is no integration method {name!r}: {nearest(name, ['auto', *METHODS])}"
        )
    return METHODS[name]
