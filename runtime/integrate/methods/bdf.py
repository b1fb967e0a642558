"""Backward differentiation of order 1 to 5: with projection and of stabilised index 2."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import EVALUATIONS_PER_STAGE, Method, resolve

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System


def _coefficients(system: System) -> Any:
    return resolve("symgen.runtime.integrate.bdf.newton:ndf")()


def _work_size(coefficients: Any, sizes: np.ndarray) -> int:
    return int(resolve("symgen.runtime.integrate.bdf.newton:bdf_work_size")(sizes))


def _ggl_work_size(coefficients: Any, sizes: np.ndarray) -> int:
    return int(resolve("symgen.runtime.integrate.bdf.ggl:bdf_ggl_work_size")(sizes))


_PROJECTED = Method(
    name="bdf", order=5, orders=(1, 5), dense_order=5, adaptive=True,
    family="symgen.runtime.integrate.bdf.loop:advance_bdf",
    coefficients=_coefficients, work_size=_work_size, evaluations=EVALUATIONS_PER_STAGE,
    purpose="strongly damped models; not for stiff vibration that lasts",
    kernels=("residual_jacobian",), stiff=True, multistep=True,
)  # fmt: skip

RECORDS = (
    _PROJECTED,
    replace(
        _PROJECTED, form="ggl", family="symgen.runtime.integrate.bdf.loop:advance_bdf_ggl",
        work_size=_ggl_work_size, kernels=("residual_jacobian", "residual", "constraint_residual"),
    ),
)  # fmt: skip
