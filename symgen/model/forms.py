"""Expressions that differ in their names alone, told by one look at each: what follows from one is known of all.

A model of ten thousand equal bodies has as many expressions of each form. What they mention, their dimensions and their
values at known numbers are worked out once for each form and what its names stand for.
"""

from __future__ import annotations

from typing import Any

from . import algebra
from .functions import Tabulated

# Sums of so many arguments have no form: each may be made of others like it, and is looked through for every one.
WIDE = 8
_MOST_PARTS = 200
# So many forms are known at a time, and so many answers of each.
_MOST = 4096


class Form:
    """What expressions have in common that differ in their names alone.

    Attributes
    ----------
    uses : optional
        What `expression_tree.uses` makes of one, and which of its names stand in a `dot(…)`.
    sizes, values : dict
        What `infer` and `evaluate` found, by what the names stand for.
    """

    __slots__ = ("sizes", "uses", "values")

    def __init__(self) -> None:
        self.uses: tuple[Any, tuple[int, ...]] | None = None
        self.sizes: dict[tuple, Any] = {}
        self.values: dict[tuple, float | None] = {}


Formed = tuple[Form, tuple[str, ...]]
_forms: dict[tuple, Form] = {}


def form_of(root: algebra.Expr) -> Formed | None:
    """The form of an expression, and its names in the order in which they come.

    None for large ones, for those with tables, and for what SymPy made.
    """
    if not isinstance(root, algebra.Expr):
        return None
    kept = root.__dict__
    if "_form" not in kept:
        kept["_form"] = _looked_through(root)
    return kept["_form"]


def note(answers: dict[tuple, Any], key: tuple, answer: Any) -> None:
    """Add to what is known of a form."""
    if len(answers) >= _MOST:
        answers.clear()
    answers[key] = answer


def _looked_through(root: algebra.Expr) -> Formed | None:
    parts: list[Any] = []
    places: dict[int, int] = {}
    names: dict[str, int] = {}
    stack: list[algebra.Expr | None] = [root]
    while stack:
        node = stack.pop()
        if node is None:
            node = stack.pop()
            parts.append((type(node), *[places[id(x)] for x in node.args]))
            places[id(node)] = len(parts) - 1
        elif id(node) not in places:
            args = node.args
            if args:
                if len(args) >= WIDE or len(parts) > _MOST_PARTS or isinstance(node, Tabulated):
                    return None
                stack += (node, None, *args[::-1])
                continue
            places[id(node)] = len(parts)
            if isinstance(node, algebra.Symbol):
                parts.append(names.setdefault(node.name, len(names)))
            else:
                parts.append((type(node), node))
    key = tuple(parts)
    form = _forms.get(key)
    if form is None:
        form = Form()
        note(_forms, key, form)
    return form, tuple(names)
