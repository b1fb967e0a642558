"""Repetition along a model: blocks of coordinates, bodies and constraints that are equal but for where they stand.

A chain of N links is N such blocks, of which each mentions only itself and its neighbours. Then a shorter chain of the
same blocks says all that there is to know about the long one's equations, see `emit/stretched.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from math import gcd
from typing import Any

from symgen.model.algebra import postorder

from ...model import algebra
from ...model.algebra import Expr, Symbol
from ...model.description import Body, Coordinate, Description
from ...model.expression_tree import names_in
from ...model.forms import form_of

FURTHEST = 8  # blocks from one to another that it mentions
MOST_APART = 16  # blocks at both ends together that differ from the others
# What a description may have; in models with anything else no repetition is looked for.
_READ = frozenset(
    ("name", "description", "coordinates", "parameters", "constants", "definitions", "bodies", "gravity", "constraints",
     "run", "folder", "rates", "impacts", "units_of_outputs", "units_of_multipliers", "limits")
)  # fmt: skip


@dataclass(frozen=True)
class Repetition:
    """A description made of blocks, of which those from `first` up to `last` are equal.

    Attributes
    ----------
    places : dict of str to (str, int, int)
        Of each name that belongs to a block: "coordinate" or "definition", the block, and its place in that.
    """

    description: Description
    n_blocks: int
    first: int
    last: int
    places: dict[str, tuple[str, int, int]]

    def shortened(self, n_blocks: int) -> Description:
        """The same with fewer of the equal blocks, and with names whose order is that of the blocks.

        The order of terms in a sum is that of their names: x10 stands before x9, which makes block 10 another one.
        """
        d, gone = self.description, self.n_blocks - n_blocks
        cut = self.first + (self.last - self.first - gone) // 2
        kept = [*range(cut), *range(cut + gone, self.n_blocks)]
        prefix = self._prefix()
        coordinates, bodies, constraints, definitions = [], [], [], []
        for block, old in enumerate(kept):
            renamed = partial(self._renamed, moved=block - old, prefix=prefix)
            for k, c in enumerate(_part(d.coordinates, old, self.n_blocks)):
                coordinates.append(replace(c, name=_name(prefix, "coordinate", block, k)))
            for k, (_, expression) in enumerate(_part(d.definitions, old, self.n_blocks)):
                definitions.append((_name(prefix, "definition", block, k), renamed(expression)))
            for k, body in enumerate(_part(d.bodies, old, self.n_blocks)):
                bodies.append(_renamed_body(body, _name(prefix, "body", block, k), renamed))
            for k, c in enumerate(_part(d.constraints, old, self.n_blocks)):
                name = _name(prefix, "constraint", block, k)
                constraints.append(replace(c, name=name, expression=renamed(c.expression)))
        return replace(
            d,
            coordinates=tuple(coordinates),
            rates=(),
            definitions=tuple(definitions),
            bodies=tuple(bodies),
            constraints=tuple(constraints),
            units_of_multipliers={},
        )

    def _prefix(self) -> str:
        """What no other name begins with."""
        d, prefix = self.description, "r"
        others = [x.name for x in (*d.parameters, *d.constants)]
        while any(name.startswith(prefix) for name in others):
            prefix += "r"
        return prefix

    def _renamed(self, expression: Expr, moved: int, prefix: str) -> Expr:
        names = {}
        for x in expression.free_symbols:
            if x.name in self.places:
                kind, block, k = self.places[x.name]
                names[x] = Symbol(_name(prefix, kind, block + moved, k))
        return expression.xreplace(names)


def _name(prefix: str, kind: str, block: int, place: int) -> str:
    return f"{prefix}_{kind}_{block:09d}_{place:04d}"


def _renamed_body(body: Body, name: str, renamed: Callable[[Expr], Expr]) -> Body:
    shape = body.shape
    return replace(
        body,
        name=name,
        com=tuple(map(renamed, body.com)),
        mass=None if body.mass is None else renamed(body.mass),
        inertia=tuple(map(renamed, body.inertia)),
        angle=None if body.angle is None else renamed(body.angle),
        rotation=tuple((axis, renamed(angle)) for axis, angle in body.rotation),
        shape=None if shape is None else replace(shape, sizes=tuple(map(renamed, shape.sizes))),
    )


def repetition(d: Description, fewest: int) -> Repetition | None:
    """Find the blocks that a description is made of.

    Parameters
    ----------
    d : Description
        A checked description.
    fewest : int
        Equal blocks; where there are less, the answer is None.
    """
    if not _is_plain(d):
        return None
    n = gcd(*(len(x) for x in (d.coordinates, d.definitions, d.bodies, d.constraints) if x))
    own = {name for name, _ in d.definitions}
    if n < fewest or any(names_in(x) & own for limit in d.limits for x in limit.numbers):
        return None
    places = {
        c.name: ("coordinate", *divmod(k, len(d.coordinates) // n)) for k, c in enumerate(d.coordinates)
    }
    for k, (name, _) in enumerate(d.definitions):
        places[name] = ("definition", *divmod(k, len(d.definitions) // n))
    known = _Keys(places)
    keys = [known.of_block(d, block, n) for block in range(n)]
    _align(Repetition(d, n, 0, n, places), keys)
    if not known.is_local:
        return None
    first = n // 2
    last = first + 1
    while first and keys[first - 1] == keys[n // 2]:
        first -= 1
    while last < n and keys[last] == keys[n // 2]:
        last += 1
    if last - first < max(fewest, n - MOST_APART):
        return None
    return Repetition(d, n, first, last, places)


def _align(whole: Repetition, keys: list[tuple]) -> None:
    """Give those blocks the usual key that differ by the order of their names alone, in place.

    f(x9 - x8) stands for an odd function as it is, f(x10 - x9) as -f(x9 - x10).
    """
    usual = len(keys) // 2
    others = [block for block, key in enumerate(keys) if key != keys[usual]]
    if len(others) > 2 * MOST_APART:
        return
    prefix = whole._prefix()
    known = _Keys({_name(prefix, *place): place for place in whole.places.values()} if others else {})
    renamed = partial(whole._renamed, moved=0, prefix=prefix)
    expected = known.of_block(whole.description, usual, whole.n_blocks, renamed)
    for block in others:
        if known.of_block(whole.description, block, whole.n_blocks, renamed) == expected:
            keys[block] = keys[usual]


def _is_plain(d: Description) -> bool:
    """Whether a description has nothing but what repetition is looked for in."""
    if not d.coordinates or any(getattr(d, f.name) for f in fields(d) if f.name not in _READ):
        return False
    if any(not _is_plain_coordinate(c) for c in d.coordinates) or any(b.solids for b in d.bodies):
        return False
    rates = [r.name for r in d.rates if r.coordinate == r.name and not r.state and r.formula is None]
    return rates == [c.name for c in d.coordinates]


def _is_plain_coordinate(c: Coordinate) -> bool:
    return not (c.quaternion or c.joint or c.formula or c.rate_formula or c.integral)


def _part(items: Sequence[Any], block: int, n_blocks: int) -> Sequence[Any]:
    size = len(items) // n_blocks
    return items[block * size : (block + 1) * size]


class _Keys:
    """Numbers for expressions: equal ones where these differ only in the block that they are seen from."""

    def __init__(self, places: dict[str, tuple[str, int, int]]) -> None:
        self._places = places
        self._numbers: dict[tuple, int] = {}
        self._shared: dict[int, tuple[Expr, int]] = {}  # of what no block owns, by identity
        self._formed: dict[tuple, int] = {}  # of all, by form and what names are, seen from the block
        self.is_local = True

    def of_block(
        self, d: Description, block: int, n: int, renamed: Callable[[Expr], Expr] | None = None
    ) -> tuple:
        """What a block says, after its expressions were renamed."""

        def number(expression: Expr | None) -> int:
            return self._number(
                renamed(expression) if renamed and expression is not None else expression, block
            )

        return (
            *(number(x) for _, x in _part(d.definitions, block, n)),
            *(_body_key(body, number) for body in _part(d.bodies, block, n)),
            *((c.kind, number(c.expression)) for c in _part(d.constraints, block, n)),
        )

    def _number(self, expression: Expr | None, block: int) -> int:
        if expression is None:
            return -1
        known = self._shared.get(id(expression))
        if known is not None:
            return known[1]
        formed = form_of(expression)
        if formed is None:
            return self._looked_through(expression, block)
        form, names = formed
        key = form, *[self._seen(name, block) for name in names]
        if key not in self._formed:
            self._formed[key] = self._looked_through(expression, block)
        return self._formed[key]

    def _seen(self, name: str, block: int) -> tuple[str, int, int] | str:
        """What a name is, as seen from a block."""
        place = self._places.get(name)
        return name if place is None else (place[0], place[1] - block, place[2])

    def _looked_through(self, expression: Expr, block: int) -> int:
        numbers = self._numbers
        done: dict[int, int] = {}
        owned: set[int] = set()
        for x in postorder([expression]):
            if isinstance(x, Symbol):
                place = self._places.get(x.name)
                if place is None:
                    key: tuple = (Symbol, x.name)
                else:
                    owned.add(id(x))
                    offset = place[1] - block
                    self.is_local = self.is_local and -FURTHEST <= offset <= FURTHEST
                    key = (place[0], offset, place[2])
            elif not x.args:
                key = (type(x), x)
            else:
                below = [done[id(a)] for a in x.args]
                if not owned.isdisjoint(map(id, x.args)):
                    owned.add(id(x))
                key = (type(x), *(sorted(below) if isinstance(x, (algebra.Add, algebra.Mul)) else below))
            done[id(x)] = numbers.setdefault(key, len(numbers))
        found = done[id(expression)]
        if id(expression) not in owned:
            self._shared[id(expression)] = expression, found
        return found


def _body_key(body: Body, number: Callable[[Expr | None], int]) -> tuple:
    shape = body.shape
    return (
        body.planar,
        body.centred,
        _numbers(body.com, number),
        number(body.mass),
        _numbers(body.inertia, number),
        number(body.angle),
        tuple((axis, number(angle)) for axis, angle in body.rotation),
        None if shape is None else (shape.kind, shape.parts, _numbers(shape.sizes, number)),
    )


def _numbers(expressions: Iterable[Expr], number: Callable[[Expr | None], int]) -> tuple[int, ...]:
    return tuple(map(number, expressions))
