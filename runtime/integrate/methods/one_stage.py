"""Implicit Euler and the implicit midpoint rule."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import EVALUATIONS_PER_STAGE, Method, resolve

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System


def _one_stage(name: str, order: int, **traits: Any) -> Method:
    def stage(system: System) -> Any:
        return resolve(f"symgen.runtime.integrate.one_stage:{name.upper()}")

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(resolve("symgen.runtime.integrate.one_stage:implicit_work_size")(sizes))

    return Method(
        name=name, order=order, dense_order=order, adaptive=False,
        family="symgen.runtime.integrate.one_stage:advance_implicit",
        coefficients=stage, work_size=work_size, evaluations=EVALUATIONS_PER_STAGE,
        kernels=("residual_jacobian",), stiff=True, **traits,
    )  # fmt: skip


RECORDS = (
    _one_stage("implicit_euler", 1, purpose="teaching", oscillation_error=1 / 2),
    _one_stage(
        "implicit_midpoint", 2, purpose="stiff springs without damping of any motion", symplectic=True,
        oscillation_error=1 / 12,
    ),
)  # fmt: skip
