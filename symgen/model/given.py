"""What users hand in: a model's own expressions, those of SymPy, names as text or as symbols.

SymPy is imported by who uses it; what is none of its objects is seen without it.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from . import algebra

if TYPE_CHECKING:
    from .from_sympy import Taken


def given_expression(value: Any, known: list[Taken] | None = None) -> algebra.Expr | None:
    """An expression of a model or of SymPy as one of a model; None for anything else.

    Parameters
    ----------
    value : Any
    known : list of Taken, optional
        Empty at first; what was taken over before, which expressions of one model share.

    Raises
    ------
    ModelError
        A function of SymPy says something that no model can have.
    """
    if isinstance(value, algebra.Expr):
        return value
    if not _is_of_sympy(value, "Expr"):
        return None
    from .from_sympy import Taken, taken_over  # with SymPy, which is there

    if known is None:
        return taken_over(value)
    if not known:
        known.append(Taken())
    return known[0].over(value)


def given_name(value: Any) -> Any:
    """The name of a symbol; anything else as it is."""
    return value.name if is_symbol(value) else value


def is_symbol(value: Any) -> bool:
    """Whether a value is a symbol, a model's or SymPy's."""
    return isinstance(value, algebra.Symbol) or _is_of_sympy(value, "Symbol")


def unpacked(value: Any) -> Any:
    """An array of NumPy as a list, one of its numbers as a number; anything else as it is."""
    return value.tolist() if hasattr(value, "tolist") and not _is_of_sympy(value, "MatrixBase") else value


def is_listed(values: Any) -> bool:
    """Whether a value is a list of others: a matrix of SymPy is, text is not."""
    return not isinstance(values, str) and (
        isinstance(values, Sequence) or _is_of_sympy(values, "MatrixBase")
    )


def _is_of_sympy(value: Any, kind: str) -> bool:
    sympy = sys.modules.get("sympy")
    return sympy is not None and isinstance(value, getattr(sympy, kind, ()))
