"""The Rosenbrock method Rodas5P."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import EVALUATIONS_PER_STAGE, Method, resolve

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System


def _coefficients(system: System) -> Any:
    make = resolve("symgen.runtime.integrate.rosenbrock.coefficients:rodas5p")
    return make(time_dependent=system.structure["time_dependent"])


def _work_size(coefficients: Any, sizes: np.ndarray) -> int:
    return int(resolve("symgen.runtime.integrate.rosenbrock.work:rodas_work_size")(sizes))


RECORDS = (
    Method(
        name="rodas5p", order=5, dense_order=4, adaptive=True,
        family="symgen.runtime.integrate.rosenbrock.loop:advance_rodas5p",
        coefficients=_coefficients, work_size=_work_size, evaluations=2 * EVALUATIONS_PER_STAGE,
        purpose="stiff and smooth, without iterations; strong damping at moderate accuracy",
        kernels=("residual_jacobian",), stiff=True,
    ),
)  # fmt: skip
