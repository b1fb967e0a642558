"""Semi-implicit Euler, velocity Verlet, and the symmetric compositions of Verlet steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import Method, resolve, stabilised

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System

# Of a composition, by order; measured, as what is left of the terms of h^order depends on the coefficients.
COMPOSITION_ERROR = {2: 1 / 24, 4: 9.3e-4, 6: 4.1e-4, 8: 1.3e-6}
N_PARTS = {2: 1, 4: 5, 6: 9, 8: 17}


def _semi_implicit_growth(z: np.ndarray, damping: float) -> np.ndarray:
    return resolve("symgen.runtime.integrate.growth:of_semi_implicit_euler")(z, damping)


def composition_growth(order: int, z: np.ndarray, damping: float) -> np.ndarray:
    """Return `Method.growth` of the composition of an order; of order 2 that is Verlet itself."""
    coefficients = "symgen.runtime.integrate.composition"
    parts = resolve(f"{coefficients}:parts")(order)
    return resolve("symgen.runtime.integrate.growth:of_verlet")(parts, z, damping)


def _verlet_growth(z: np.ndarray, damping: float) -> np.ndarray:
    return composition_growth(2, z, damping)


def _semi_implicit(name: str, order: int, verlet: bool, **traits: Any) -> Method:
    def scheme(system: System) -> Any:
        plain = system.nq == system.nv and not system.m
        reuse = verlet and plain and not (system.structure["velocity_dependent"] or system.nw)
        return resolve("symgen.runtime.integrate.semi_implicit:SymplecticScheme")(int(verlet), int(reuse))

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(resolve("symgen.runtime.integrate.semi_implicit:symplectic_work_size")(sizes))

    return Method(
        name=name, order=order, dense_order=3, adaptive=False,
        family="symgen.runtime.integrate.semi_implicit:advance_semi_implicit",
        coefficients=scheme, work_size=work_size, symplectic=True, **traits,
    )  # fmt: skip


def _composition(order: int) -> Method:
    def coefficients(system: System) -> Any:
        return resolve("symgen.runtime.integrate.composition:composition")(order)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(resolve("symgen.runtime.integrate.composition:composition_work_size")(sizes))

    def growth(z: np.ndarray, damping: float) -> np.ndarray:
        return composition_growth(order, z, damping)

    return Method(
        name=f"verlet{order}", order=order, dense_order=5, adaptive=False,
        family="symgen.runtime.integrate.composition:advance_composition",
        coefficients=coefficients, work_size=work_size, evaluations=N_PARTS[order],
        purpose="long conservative runs, forces that depend on positions and time, constant mass",
        growth=growth, symplectic=True, needs_plain_rates=True, refusal=_not_separable,
        oscillation_error=COMPOSITION_ERROR[order],
    )  # fmt: skip


def _not_separable(system: System) -> str:
    reasons = (
        (system.m, "has constraints"),
        (not system.structure["constant_mass"], "has a mass matrix that changes"),
        (system.structure["velocity_dependent"] and system.states, "has first-order states"),
        (system.structure["velocity_dependent"], "has forces that depend on velocities"),
    )
    why = next((text for applies, text in reasons if applies), "")
    needs = "needs accelerations that depend on positions only, but the model"
    others = "gauss8" if system.nn else "rattle4, rattle6, gauss8"
    return f"{needs} {why}: use {others} or dop853" if why else ""


_SEMI_IMPLICIT_EULER = _semi_implicit(
    "semi_implicit_euler", 1, verlet=False, evaluations=1, purpose="teaching", growth=_semi_implicit_growth,
    steps_per_period=250,  # amplitudes waver by half of step w, but nothing adds up
)  # fmt: skip
# Positions of central differences, q' = 2 q - q_before + h² a with q_before = q - h v + h² a / 2 at the start, are
# those of velocity Verlet, and so are the rates (q' - q_before) / (2 h): Hairer, Lubich, Wanner, Acta Numerica 12
# (2003) 399.
_VERLET = _semi_implicit(
    "verlet", 2, verlet=True, evaluations=2, other_names=("central_difference",),
    purpose="long conservative runs at low accuracy, cheap steps; any model", growth=_verlet_growth,
    oscillation_error=COMPOSITION_ERROR[2],
)  # fmt: skip

RECORDS = (
    _SEMI_IMPLICIT_EULER,
    stabilised(_SEMI_IMPLICIT_EULER, (1.0, 1.0)),
    _VERLET,
    stabilised(_VERLET),
    *(_composition(order) for order in (4, 6, 8)),
)
