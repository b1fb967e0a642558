"""Records of explicit Runge-Kutta methods: one for each form of constraints that all of them have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import Method, resolve, stabilised

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.integrate.explicit.tableau import ErkTableau
    from symgen.runtime.system import System

_PARTITION_KERNELS = ("mass_matrix", "constraint_jacobian", "constraint_residual")


def explicit_runge_kutta(
    name: str,
    tableau: Callable[[], ErkTableau],
    *,
    adaptive: bool,
    gains: tuple[float, float] | None = None,
    partitioned: bool = True,
    suits_forms: bool = False,
    **traits: Any,
) -> tuple[Method, ...]:
    """Return the records of a method: with projection, Baumgarte's stabilisation and independent coordinates.

    Parameters
    ----------
    tableau : callable
        Makes the coefficients, when they are used.
    adaptive : bool
    gains : tuple of float, optional
        See `stabilised`.
    partitioned : bool
        Whether it integrates independent coordinates, too.
    suits_forms : bool
        Whether it is taken where only one of these forms was asked for.
    **traits
        Further ones of `Method`.
    """

    def coefficients(system: System | None) -> ErkTableau:
        return tableau()

    def work_size(coefficients: ErkTableau, sizes: np.ndarray) -> int:
        return int(
            resolve("symgen.runtime.integrate.explicit.loop:erk_work_size")(coefficients.n_rows, sizes)
        )

    def partition_work_size(coefficients: Any, sizes: np.ndarray) -> int:
        size = resolve("symgen.runtime.integrate.partition:partition_work_size")
        return int(size(coefficients.n_rows, sizes))

    def growth(z: np.ndarray, damping: float) -> np.ndarray:
        return resolve("symgen.runtime.integrate.growth:of_runge_kutta")(tableau(), z, damping)

    projected = Method(
        name=name,
        adaptive=adaptive,
        family="symgen.runtime.integrate.explicit.loop:advance_erk",
        coefficients=coefficients,
        work_size=work_size,
        growth=growth,
        scales_energy=adaptive,
        passes_dependence=adaptive,
        **traits,
    )
    held = stabilised(projected, gains) if gains else stabilised(projected)
    records = projected, replace(held, suits_form=suits_forms)
    if not partitioned:
        return records
    partition = replace(
        projected,
        form="partition",
        family="symgen.runtime.integrate.partition:advance_partition",
        work_size=partition_work_size,
        kernels=_PARTITION_KERNELS,
        passes_dependence=False,
        suits_form=suits_forms,
    )
    return *records, partition
