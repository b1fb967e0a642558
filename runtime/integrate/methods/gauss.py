"""Gauss collocation methods of order 4 to 16."""

from __future__ import annotations

from math import factorial
from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import EVALUATIONS_PER_STAGE, Method, resolve

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System

# With these a pendulum swinging to 86 degrees keeps its energy to about 1e-11, with order 12 and more to round-off.
_STEPS_PER_PERIOD = {4: 50, 6: 50, 8: 40, 10: 30, 12: 20, 14: 16, 16: 14}


def _gauss(order: int) -> Method:
    n_stages = order // 2

    def coefficients(system: System) -> Any:
        return resolve("symgen.runtime.integrate.gauss.coefficients:gauss")(n_stages)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(resolve("symgen.runtime.integrate.gauss.stages:gauss_work_size")(coefficients, sizes))

    return Method(
        name=f"gauss{order}", order=order, dense_order=min(n_stages, 7), adaptive=False,
        family="symgen.runtime.integrate.gauss.loop:advance_gauss",
        coefficients=coefficients, work_size=work_size, evaluations=EVALUATIONS_PER_STAGE * n_stages,
        purpose="long conservative runs: energy stays at round-off; also with stiff springs",
        kernels=("residual_jacobian",), stiff=True, symplectic=True, steps_per_period=_STEPS_PER_PERIOD[order],
        # That of the Padé approximation (s, s) of exp.
        oscillation_error=factorial(n_stages) ** 2 / factorial(order) / factorial(order + 1),
    )  # fmt: skip


RECORDS = tuple(_gauss(order) for order in _STEPS_PER_PERIOD)
