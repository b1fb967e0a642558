"""Descriptions with their names taken away, so that equal subsystems can be told."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import sympy

from symgen.model.expression_tree import postorder

from ...model.description import Description


class Canonical:
    """Signatures of descriptions: equal where descriptions differ in names, units and start values only.

    Parameters
    ----------
    constants : mapping of str to float
        Names that stand for their values.
    """

    def __init__(self, constants: Mapping[str, float]) -> None:
        self._constants = constants
        self._numbers: dict[tuple, int] = {}  # each structure of an expression has a number
        # Those of SymPy's numbers, by identity; they are kept, lest it be reused.
        self._literals: dict[int, tuple[sympy.Basic, int]] = {}

    def signature(self, d: Description) -> tuple:
        """What a description says, its names replaced by the places where they are declared."""
        names: dict[str, str] = {name: repr(value) for name, value in self._constants.items()}
        names["t"] = "t"
        groups = {
            "u": [x.name for x in d.inputs], "p": [x.name for x in d.parameters],
            "q": [x.name for x in d.coordinates], "d": [name for name, _ in d.definitions],
        }  # fmt: skip
        for letter, members in groups.items():
            names |= {name: f"{letter}{k}" for k, name in enumerate(members)}
        rates = {r.name: f"v{k}" for k, r in enumerate(d.rates)}
        names |= {name: place for name, place in rates.items() if name not in names}
        for letter, items in (("P", d.points), ("X", d.axes)):
            names |= {f"{x.name}_{axis}": f"{letter}{k}{axis}" for k, x in enumerate(items) for axis in "xyz"}
        bodies = {"world": -1, **{b.name: k for k, b in enumerate(d.bodies)}}
        number = _Numbering(self._numbers, self._literals, names).of

        def all_of(expressions: Iterable[sympy.Expr]) -> tuple[int, ...]:
            return tuple(number(x) for x in expressions)

        def one(expression: sympy.Expr | None) -> int | None:
            return None if expression is None else number(expression)

        return (
            tuple((c.quaternion is not None) for c in d.coordinates),
            tuple(names.get(r.coordinate) for r in d.rates),
            all_of(expression for _, expression in d.definitions),
            tuple(_body(b, all_of, one) for b in d.bodies),
            tuple(
                (*_joint(j, bodies), all_of(j.xyz), all_of(j.rpy), *map(names.get, j.coordinates))
                for j in d.joints
            ),
            tuple((bodies[p.body], all_of(p.at)) for p in d.points),
            tuple((bodies[a.body], all_of(a.direction)) for a in d.axes),
            all_of(d.gravity or ()),
            one(d.kinetic),
            one(d.potential),
            one(d.dissipation),
            tuple((rates[name], number(force)) for name, force in d.forces),
            tuple((all_of(x.point), all_of(x.force), bodies.get(x.body), all_of(x.torque)) for x in d.loads),
            all_of(c.expression for c in d.constraints),
            all_of(c.expression for c in d.velocity_constraints),
        )


def _body(b: Any, all_of: Any, one: Any) -> tuple:
    steps = tuple((axis, one(angle)) for axis, angle in b.rotation)
    shape = (b.shape.kind, all_of(b.shape.sizes)) if b.shape else None
    return (all_of(b.com), one(b.mass), all_of(b.inertia), one(b.angle), steps, shape)


def _joint(j: Any, bodies: Mapping[str, int]) -> tuple:
    return (j.type, bodies[j.parent], bodies[j.child], j.axis, j.axis2)


class _Numbering:
    """Numbers of expressions, the same for two that differ in names and in the order of terms and factors only."""

    def __init__(
        self,
        numbers: dict[tuple, int],
        literals: dict[int, tuple[sympy.Basic, int]],
        names: Mapping[str, str],
    ) -> None:
        self._numbers, self._literals, self._names = numbers, literals, names
        self._memo: dict[int, int] = {}  # by identity, as the walk goes by it

    def of(self, expression: sympy.Expr) -> int:
        """The number of an expression."""
        memo = self._memo
        if id(expression) not in memo:
            for node in postorder([expression]):
                if id(node) not in memo:
                    memo[id(node)] = self._number(node)
        return memo[id(expression)]

    def _number(self, node: sympy.Basic) -> int:
        if isinstance(node, sympy.Symbol):
            return self._numbered(("name", self._names[node.name]))
        if not node.args:
            known = self._literals.get(id(node))
            if known is None:
                number = self._numbered((type(node).__name__, sympy.srepr(node)))
                known = self._literals[id(node)] = node, number
            return known[1]
        parts = [self._memo[id(x)] for x in node.args]
        if isinstance(node, (sympy.Add, sympy.Mul)):
            parts.sort()
        return self._numbered((type(node).__name__, *parts))

    def _numbered(self, key: tuple) -> int:
        return self._numbers.setdefault(key, len(self._numbers))
