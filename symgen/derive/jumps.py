"""Forces that jump or have a kink on the way: each branch is smooth, and `p` says which of them holds.

The argument u of a sign, a step, an absolute value, a smaller or a larger one, or what a comparison compares with zero,
is an event function of its own. A setting b behind the inputs in `p` holds its side: 1, -1, or 0, where the expression
looks at u as it is. Every function but event functions reads u + 1e300 b in its place, so steps go on along one branch
to where u crosses zero. There the run time turns b around. So no step runs over a jump, and methods meet smooth
functions only. Of floor(u) there are three, waves as sin(pi u/4), cos(pi u/4) and cos(pi u/2) are, of which each whole
number is a zero of one. Their sides tell floor(u) modulo 8: it is held until u is 4 from the middle of its step.

What a condition chooses must have a value a little beyond: stages of a step that crosses over look at it there. Where
it may have none (a root, a logarithm), the condition is not held, but steps end where it changes all the same.

What depends on time alone is known before a run, and has no branch here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..errors import ModelError
from ..model import algebra
from ..model.description import Description, Event, Input, Load
from ..model.expression_tree import kind
from ..model.functions import (
    INTEGRAL,
    PIECE,
    PLACE,
    SLOPE,
    Tabulated,
    at_most,
    branch,
    floor,
    heaviside,
    less,
    maximum,
    minimum,
    settled,
    tabulated,
    where,
)
from ..model.printing import to_text

ACTION = "jump"
_BEYOND = algebra.Float(1e300)  # any argument
_STEPS = (algebra.sign, heaviside, floor, less, at_most)
_KINKS = (algebra.Abs, minimum, maximum)
_KINDS = (*_STEPS, *_KINKS)
_LONGEST_NAME = 80
# Kinks to powers above this one make no kink of the forces that follow from the energy.
_ENERGIES = (
    ("kinetic", "the kinetic energy", 2),
    ("potential", "the potential", 2),
    ("dissipation", "the dissipation", 1),
)


def has_jumps(d: Description) -> bool:
    """Whether forces of a description have branches."""
    return bool(_Branches(d).events)


def with_branches(d: Description, own: Description) -> Description:
    """The description with a branch for each argument, and its events before those of stops and frictions.

    Parameters
    ----------
    d : Description
        In the form that is derived.
    own : Description
        As the user has it: what comes behind its events belongs to stops and frictions.
    """
    found = _Branches(d)
    if not found.events:
        return d
    n = len(own.events)
    settings = tuple(Input(name) for name in found.settings)
    return replace(
        found.description,
        inputs=(*d.inputs, *settings),
        events=(*d.events[:n], *found.events, *d.events[n:]),
    )


class _Branches:
    """Walks through all that makes forces, and gives each argument that moves a setting."""

    def __init__(self, d: Description):
        self.events: list[Event] = []
        self.settings: list[str] = []
        self._known: dict[algebra.Expr, algebra.Symbol] = {}
        self._memo: dict[tuple[algebra.Expr, bool, bool], algebra.Expr] = {}
        self._under_root = False
        self._names = {x.name for x in (*d.events, *d.stops, *d.frictions)}
        self._definitions = dict(d.definitions)
        self._done: dict[str, algebra.Expr] = {}
        self._rooted = _under_roots(d)
        self._still = {x.name for x in (*d.parameters, *d.constants)} | {"t"}
        self._where = ""
        self.description = d
        if any(_has(x) for x in expressions_of_motion(d)):
            self.description = self._replaced(d)

    def _replaced(self, d: Description) -> Description:
        energies = {}
        for key, place, smooth_from in _ENERGIES:
            energies[key] = self._inside(getattr(d, key), place, smooth_from)
        states = {s.name for s in d.states}
        places = [f"the {'derivative of' if name in states else 'force on'} {name}" for name, _ in d.forces]
        forces = tuple(
            (name, self._inside(x, place, 1)) for place, (name, x) in zip(places, d.forces, strict=True)
        )
        loads = tuple(self._load(load) for load in d.loads)
        definitions = tuple((name, self._done.get(name, x)) for name, x in d.definitions)
        return replace(d, forces=forces, loads=loads, definitions=definitions, **energies)

    def _load(self, load: Load) -> Load:
        where = f"the load {load.name}"
        force, torque = (
            tuple(self._inside(x, where, 1) for x in vector) for vector in (load.force, load.torque)
        )
        return replace(load, force=force, torque=torque)

    def _inside(self, expression: algebra.Expr | None, where: str, smooth_from: float) -> algebra.Expr | None:
        """The expression with branches; kinks to a power above `smooth_from` leave forces smooth."""
        if expression is None:
            return None
        self._where = where
        return self._rewritten(expression, 1.0 / smooth_from)

    def _rewritten(self, e: algebra.Expr, power: float) -> algebra.Expr:
        key = (e, power > 1.0, self._under_root)
        if key not in self._memo:
            self._memo[key] = self._built(e, power)
        return self._memo[key]

    def _built(self, e: algebra.Expr, power: float) -> algebra.Expr:
        if isinstance(e, algebra.Symbol):
            self._define(e.name, power)
            return e
        if not e.args:
            return e
        if e.func is where and any(self._lacks_values(x) for x in e.args[1:]):
            return where(self._watched(e.args[0]), *(self._rewritten(x, power) for x in e.args[1:]))
        if isinstance(e, algebra.Pow):
            outside, self._under_root = self._under_root, self._under_root or not e.exp.is_Integer
            base = self._rewritten(e.base, power * (max(1.0, float(e.exp)) if e.exp.is_Number else 1.0))
            self._under_root = outside
            exponent = self._rewritten(e.exp, power)
            return e if (base, exponent) == e.args else algebra.Pow(base, exponent, evaluate=False)
        if isinstance(e, Tabulated):
            return self._piece(e, [self._rewritten(x, 1.0) for x in e.args])
        args = [self._rewritten(x, power) for x in e.args]
        same = tuple(args) == e.args
        if e.func not in _KINDS or (e.func in _KINKS and power > 1.0):
            return e if same else e.func(*args)
        argument = e.args[0] if len(e.args) == 1 else e.args[0] - e.args[1]
        if not self._has_sides(argument):
            return e if same else e.func(*args)
        return self._branch(e, args, argument)

    def _watched(self, condition: algebra.Expr) -> algebra.Expr:
        """A condition that steps end at, but that is looked at as it is: what it chooses has no value elsewhere."""
        if condition.func not in (less, at_most):
            return condition.func(*map(self._watched, condition.args))
        argument = condition.args[0] - condition.args[1]
        if self._has_sides(argument):
            self._side(-argument if argument.could_extract_minus_sign() else argument, condition)
        return condition.func(*(self._rewritten(x, 1.0) for x in condition.args))

    def _lacks_values(self, expression: algebra.Expr) -> bool:
        """Whether an expression has a root or a logarithm of what moves and may be negative."""
        stack, seen = [expression], set()
        while stack:
            e = stack.pop()
            if isinstance(e, algebra.Symbol) and e.name in self._definitions and e.name not in seen:
                seen.add(e.name)
                stack.append(self._definitions[e.name])
            is_root = isinstance(e, algebra.Pow) and not e.exp.is_Integer
            bounded = is_root or e.func in (algebra.log, algebra.asin, algebra.acos)
            if bounded and self._moves(e.args[0]) and not self._is_never_negative(e.args[0]):
                return True
            stack += e.args
        return False

    def _is_never_negative(self, e: algebra.Expr) -> bool:
        """Whether an expression is seen to be no negative number: squares, their sums, as in distances."""
        if isinstance(e, algebra.Symbol) and e.name in self._definitions:
            return self._is_never_negative(self._definitions[e.name])
        if isinstance(e, (algebra.Add, algebra.Mul)):
            return all(map(self._is_never_negative, e.args))
        if isinstance(e, algebra.Pow):
            is_even = e.exp.is_Integer and e.exp.p % 2 == 0
            return is_even or not e.exp.is_Integer or self._is_never_negative(e.base)
        return e.func in (algebra.exp, algebra.cosh) or bool(e.is_Number and e >= 0)

    def _branch(self, e: algebra.Expr, args: list[algebra.Expr], argument: algebra.Expr) -> algebra.Expr:
        if e.func is floor:
            return self._held_floor(e, e.args[0], *args)
        flipped = argument.could_extract_minus_sign()
        side = self._side(-argument if flipped else argument, e)
        if self._under_root and e.func in _KINKS and (e.func is algebra.Abs or algebra.ZERO in e.args):
            return e.func(*args)  # held, it would go on below zero
        inner = args[0] if len(args) == 1 else args[0] - args[1]
        chosen = inner + (-_BEYOND if flipped else _BEYOND) * side
        if e.func in (less, at_most):
            return e.func(chosen, algebra.ZERO)
        if e.func in _STEPS:
            return e.func(chosen, evaluate=False)
        below, above = {
            algebra.Abs: lambda: (-args[0], args[0]),
            minimum: lambda: (args[0], args[1]),
            maximum: lambda: (args[1], args[0]),
        }[e.func]()
        return branch(chosen, below, above)

    def _piece(self, e: Tabulated, args: list[algebra.Expr]) -> algebra.Expr:
        """A table whose pieces are held: the number of one is the whole part of a place in it."""
        n = len(args)
        if not any(map(self._moves, e.args)):
            return e
        if e.func.role.startswith(SLOPE):  # of a smooth surface: steps end at the knots of its values
            return e.func(*args)
        numbers = []
        for axis, (argument, inner) in enumerate(zip(e.args, args, strict=True)):
            place = tabulated(e.func.table, PLACE, 1, axis)
            u, held = place(inner), self._has_sides(argument)
            numbers.append(self._held_floor(e, place(argument), u) if held else floor(u, evaluate=False))
        role = PIECE + INTEGRAL if e.func.role == INTEGRAL else PIECE
        return tabulated(e.func.table, role, 2 * n)(*args, *numbers)

    def _held_floor(self, e: algebra.Expr, argument: algebra.Expr, u: algebra.Expr) -> algebra.Expr:
        """floor(u) where three sides hold it, of which each whole number turns one around (a Gray code of period 8)."""
        s, c, d = (
            self._side(_wave((argument + shift) / period), e) for shift, period in ((0, 4), (2, 4), (1, 2))
        )
        place = algebra.Rational(7, 2) - 2 * s - s * c - s * c * d / 2  # floor(u) modulo 8
        held = place + 8 * floor((u - place) / 8 + algebra.Rational(7, 16))
        return branch(s * c * d, held, branch(-s * c * d, held, _rounded_floor(u)))

    def _side(self, argument: algebra.Expr, e: algebra.Expr) -> algebra.Symbol:
        """The setting of an argument; its event says where it stands."""
        if argument not in self._known:
            name = f"jump_{len(self.settings)}"
            while name in self._names:
                name += "_"
            self._known[argument] = algebra.Symbol(f"branch {len(self.settings)}")
            self.settings.append(self._known[argument].name)
            self.events.append(
                Event(
                    name, _with_rounded_floors(argument), "both", ACTION, says=f"{_shown(e)} in {self._where}"
                )
            )
        return self._known[argument]

    def _define(self, name: str, power: float) -> None:
        """Take along a definition that forces use."""
        if name in self._definitions and name not in self._done:
            self._done[name] = self._definitions[name]  # definitions use those before them only
            outside, self._under_root = self._under_root, name in self._rooted
            self._done[name] = self._rewritten(self._definitions[name], min(power, 1.0))
            self._under_root = outside

    def _has_sides(self, argument: algebra.Expr) -> bool:
        """Whether an argument moves through zero by itself, not only with steps that it is made of.

        One that is made of steps, as `floor(x/d) - 3` is, stays as it is while these are held. It comes to zero by a
        jump, and may stay there: what looks at it takes it as it is.
        """
        return self._moves(argument) and self._varies(argument)

    def _varies(self, expression: algebra.Expr) -> bool:
        """Whether an expression changes with time or the state where none of its steps does."""
        stack, seen = [expression], set()
        while stack:
            e = stack.pop()
            if isinstance(e, algebra.Symbol):
                if e.name in self._definitions:
                    if e.name not in seen:
                        seen.add(e.name)
                        stack.append(self._definitions[e.name])
                elif e.name == "t" or e.name not in self._still:
                    return True
            elif e.func is where:
                stack += e.args[1:]
            elif e.func not in _STEPS:
                stack += e.args
        return False

    def _moves(self, expression: algebra.Expr) -> bool:
        """Whether an expression depends on the state or on inputs."""
        for symbol in expression.free_symbols:
            if symbol.name in self._definitions:
                if self._moves(self._definitions[symbol.name]):
                    return True
            elif symbol.name not in self._still:
                return True
        return False


def expressions_of_motion(d: Description) -> Iterator[algebra.Expr]:
    """What energies, forces, loads and definitions are."""
    yield from (x for x in (d.kinetic, d.potential, d.dissipation) if x is not None)
    yield from (x for _, x in (*d.forces, *d.definitions))
    for load in d.loads:
        yield from (*load.force, *load.torque)


def _under_roots(d: Description) -> set[str]:
    """Definitions of which a root, or a power that may be one, is taken somewhere."""
    definitions, found = dict(d.definitions), set()
    stack = [(x, False) for x in expressions_of_motion(d)]
    seen = set()
    while stack:
        e, under_root = stack.pop()
        if (e, under_root) in seen:
            continue
        seen.add((e, under_root))
        if under_root and isinstance(e, algebra.Symbol) and e.name in definitions:
            found.add(e.name)
            stack.append((definitions[e.name], True))
        is_root = isinstance(e, algebra.Pow) and not e.exp.is_Integer
        stack += ((x, under_root or is_root) for x in e.args)
    return found


def _wave(z: algebra.Expr) -> algebra.Expr:
    """A wave in parabolas, nearly sin(pi z), which is zero at whole numbers to the last bit, as the sine is not.

    What stays at such a place, with an input or a choice, is seen to be on neither side there.
    """
    n = z - 2 * settled(z / 2, evaluate=False) - 1
    return 4 * n * (algebra.Abs(n, evaluate=False) - 1)


def _rounded_floor(u: algebra.Expr) -> algebra.Expr:
    """floor(u) with the digits of its waves: to these -1e-40 is zero, as round-off of a start at rest may be."""
    return floor(u + 8, evaluate=False) - 8


def _with_rounded_floors(e: algebra.Expr) -> algebra.Expr:
    """An argument whose floors are on no side of whole numbers before the waves that hold them are."""
    if not e.args:
        return e
    args = [_with_rounded_floors(x) for x in e.args]
    if e.func is floor:
        return _rounded_floor(*args)
    return e if tuple(args) == e.args else e.func(*args)


def _has(expression: algebra.Expr) -> bool:
    """Whether a choice stands anywhere in an expression; quick, since nearly all have none."""
    seen, stack = set(), [expression]
    while stack:
        e = stack.pop()
        if e.func in _KINDS or isinstance(e, Tabulated):
            return True
        if e.args and id(e) not in seen:
            seen.add(id(e))
            stack.extend(e.args)
    return False


def _shown(e: algebra.Expr) -> str:
    """An expression as model files write it, or what kind it is where it is long."""
    try:
        return to_text(e, _LONGEST_NAME)
    except ModelError:
        return f"{kind(e)}(...)"
