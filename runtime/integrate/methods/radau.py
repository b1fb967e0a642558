"""Radau IIA methods of order 5, 9 and 13: with projection, full or sparse matrices, and of stabilised index 2."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.method import EVALUATIONS_PER_STAGE, Method, resolve

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.system import System

_PURPOSES = {
    5: "stiff springs, bushings, tyres, strong damping",
    9: "stiff models at tight tolerances; `auto` takes `radau9` below 3e-5",
    13: "stiff models at tight tolerances; `auto` takes `radau9` below 3e-5",
}


def _radau(order: int) -> tuple[Method, Method]:
    n_stages = (order + 1) // 2

    def coefficients(system: System) -> Any:
        return resolve("symgen.runtime.integrate.radau.coefficients:radau")(n_stages)

    def work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(resolve("symgen.runtime.integrate.radau.work:radau_work_size")(coefficients, sizes))

    def sparse_coefficients(system: System) -> Any:
        pattern = resolve("symgen.runtime.integrate.sparse:newton_pattern")(system)
        spare = resolve("symgen.runtime.integrate.newton_lu:new_spare")(pattern, n_stages // 2)
        sparse = resolve("symgen.runtime.integrate.radau.sparse:SparseRadauIIA")
        return sparse(*coefficients(system), pattern, spare)

    def sparse_work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(
            resolve("symgen.runtime.integrate.radau.sparse:sparse_radau_work_size")(coefficients, sizes)
        )

    def ggl_coefficients(system: System) -> Any:
        return resolve("symgen.runtime.integrate.radau.ggl:radau_ggl")(n_stages)

    def ggl_work_size(coefficients: Any, sizes: np.ndarray) -> int:
        return int(resolve("symgen.runtime.integrate.radau.ggl:ggl_work_size")(coefficients, sizes))

    full = Method(
        name=f"radau{order}", order=order, dense_order=n_stages, adaptive=True,
        family="symgen.runtime.integrate.radau.loop:advance_radau",
        coefficients=coefficients, work_size=work_size, evaluations=EVALUATIONS_PER_STAGE * n_stages,
        purpose=_PURPOSES[order], kernels=("residual_jacobian",), stiff=True, scales_energy=True,
    )  # fmt: skip
    sparse = replace(
        full, family="symgen.runtime.integrate.radau.loop:advance_radau_sparse",
        coefficients=sparse_coefficients, work_size=sparse_work_size, kernels=("residual_jacobian_entries",),
    )  # fmt: skip
    ggl = replace(
        full, form="ggl", suits_form=order == 5, scales_energy=False,
        family="symgen.runtime.integrate.radau.loop:advance_radau_ggl",
        coefficients=ggl_coefficients, work_size=ggl_work_size,
        kernels=("residual_jacobian", "residual", "constraint_residual"),
    )  # fmt: skip
    return replace(full, sparse=sparse), ggl


RECORDS = tuple(record for order in _PURPOSES for record in _radau(order))
