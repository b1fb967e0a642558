"""Methods as they run on large models: those for stiff motion with sparse matrices where they have such a form."""

from __future__ import annotations

from typing import TYPE_CHECKING

from symgen.runtime.integrate.methods import Method
from symgen.runtime.lazy import Late
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System

sparse = Late("symgen.runtime.integrate.sparse")

SMALLEST_SPARSE = 120  # rates and multipliers; in smaller models full matrices cost no more
MOST_FULL = 0.1  # entries of a factor, of n²; where there are more, full matrices are faster


def has_sparse_form(system: System) -> bool:
    """Whether the equations of a model can be solved by sparse matrices: not with continuous controllers."""
    return not system.has_feedback


def suited_to_size(method: Method, system: System) -> Method:
    """Return the method in the form that suits a model: with sparse matrices where it is large enough and sparse."""
    sparse_form = method.sparse
    has_one = sparse_form is not None and not sparse_form.refusal(system)
    return sparse_form if has_one and _is_sparse(system) else method


def _is_sparse(system: System) -> bool:
    n = system.nv + system.m
    if not has_sparse_form(system) or n < SMALLEST_SPARSE:
        return False
    return is_large(system) or sparse.newton_pattern(system).n_factor <= MOST_FULL * n * n
