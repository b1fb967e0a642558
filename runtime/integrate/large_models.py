"""Methods as they run on large models: those for stiff motion with sparse matrices where they have such a form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.constraints.large import is_large
from symgen.runtime.integrate.methods import Method

if TYPE_CHECKING:
    from symgen.runtime.system import System

WITH_SPARSE_MATRICES = ("radau5", "radau9", "radau13")
SMALLEST_SPARSE = 120  # rates and multipliers; in smaller models full matrices cost no more
MOST_FULL = 0.1  # entries of a factor, of n²; where there are more, full matrices are faster


def has_sparse_form(system: System) -> bool:
    """Whether the equations of a model can be solved by sparse matrices: not with continuous controllers."""
    return not system.has_feedback


def suited_to_size(method: Method, system: System) -> Method:
    """Return the method in the form that suits a model: with sparse matrices where it is large enough and sparse."""
    if method.name not in WITH_SPARSE_MATRICES or method.form != "projection" or not _is_sparse(system):
        return method
    return replace(
        method,
        family="symgen.runtime.integrate.radau.sparse_loop:advance_radau_sparse",
        coefficients=_with_pattern(method.coefficients),
        work_size=_work_size,
        kernels=("residual_jacobian_entries",),
    )


def _is_sparse(system: System) -> bool:
    n = system.nv + system.m
    if not has_sparse_form(system) or n < SMALLEST_SPARSE:
        return False
    from symgen.runtime.integrate.sparse_pattern import newton_pattern

    return is_large(system) or newton_pattern(system).n_factor <= MOST_FULL * n * n


def _with_pattern(coefficients: Callable[[System], Any]) -> Callable[[System], Any]:
    def sparse(system: System) -> Any:
        from symgen.runtime.integrate.radau.sparse_loop import SparseRadauIIA
        from symgen.runtime.integrate.sparse_pattern import newton_pattern

        return SparseRadauIIA(*coefficients(system), newton_pattern(system))

    return sparse


def _work_size(coefficients: Any, sizes: np.ndarray) -> int:
    from symgen.runtime.integrate.radau.sparse_work import sparse_radau_work_size

    return int(sparse_radau_work_size(coefficients, sizes))
