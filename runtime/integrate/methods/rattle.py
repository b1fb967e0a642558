"""RATTLE and its symmetric compositions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import EVALUATIONS_PER_STAGE, Method, resolve
from symgen.runtime.integrate.methods.verlet import COMPOSITION_ERROR, N_PARTS, composition_growth

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System


def _rattle(order: int) -> Method:
    def coefficients(system: System) -> Any:
        make = resolve("symgen.runtime.integrate.rattle.work:rattle")
        return make(order, system.structure["constant_mass"])

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(resolve("symgen.runtime.integrate.rattle.work:rattle_work_size")(sizes))

    def refusal(system: System) -> str:
        return resolve("symgen.runtime.integrate.rattle.work:rattle_refusal")(system)

    def kernels(system: System) -> dict[int, tuple[int, Any]]:
        return resolve("symgen.runtime.integrate.rattle.work:rattle_kernels")(system)

    def growth(z: np.ndarray, damping: float) -> np.ndarray:
        # Forces that depend on rates are implicit.
        return composition_growth(order, z, 0.0)

    return Method(
        name="rattle" if order == 2 else f"rattle{order}", order=order, dense_order=4 if order > 2 else 2,
        adaptive=False, family="symgen.runtime.integrate.rattle.loop:advance_rattle",
        coefficients=coefficients, work_size=work_size, evaluations=EVALUATIONS_PER_STAGE * N_PARTS[order],
        purpose="long conservative runs with holonomic constraints or a mass matrix that changes: symplectic",
        kernels=("mass_matrix", "forces"), form="index3", growth=growth, symplectic=True,
        oscillation_error=COMPOSITION_ERROR[order], refusal=refusal, versions=kernels,
    )  # fmt: skip


RECORDS = tuple(_rattle(order) for order in (2, 4, 6))
