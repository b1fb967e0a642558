"""What numbers of a description have to be: masses not negative, a tube's inner radius below the outer one.

Descriptions are checked by this at their parameters' values (`check_values.py`), and what depends on parameters goes
into modules, whose runs are checked by it at theirs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from symgen.runtime.graph.bounds import (
    BELOW,
    FROM_0_TO_1,
    NOT_BELOW,
    ONE_OR_MORE,
    POSITIVE,
    TENSOR,
    ZERO,
    ZERO_OR_MORE,
)

from . import algebra
from .algebra import postorder
from .description import Body, Bristle, Description, Joint, Limit, Solid
from .expression_tree import TABLE, kind, names_in
from .items import Item, definition_items
from .printing import shortened
from .sources import Address


class Requirement(NamedTuple):
    """What numbers at addresses of one table have to be.

    Attributes
    ----------
    table, key : str
        The address that is wrong where they are not.
    numbers : tuple of str
        Their keys.
    bound : str
        One of `symgen.runtime.graph.bounds`.
    says : str
        What is wrong then, as a format of the numbers.
    hint : str, optional
        As well.
    """

    table: str
    key: str
    numbers: tuple[str, ...]
    bound: str
    says: str
    hint: str | None = None


_LOOK = "look at the parameters in it"


def requirements(d: Description) -> Iterator[Requirement]:
    """All requirements of a description but those of its bristles, whose numbers its definitions divide by."""
    for body in d.bodies:
        yield from _of_solids(body)
        yield from _of_inertia(body)
    for joint in d.joints:
        yield from _of_joint(joint)
    for loop in d.loops:
        key, says = "distance.length", "the length is not positive at the parameters' values: {0:g} m"
        yield Requirement(f"constraints.{loop.name}", key, (key,), ZERO_OR_MORE, says)
        hint = "hold points at one place by 'coincident'"
        yield Requirement(f"constraints.{loop.name}", key, (key,), POSITIVE, says, hint)
    for s in d.springs:
        given = (("length", s.places), ("stiffness", True), ("damping", True), ("mass", True))
        yield from (_not_negative(f"springs.{s.name}", key, key) for key, counts in given if counts)
    for b in d.bushings:
        for key, values in (("stiffness", b.stiffness), ("damping", b.damping)):
            for k in range(len(values)):
                yield _not_negative(f"bushings.{b.name}", f"{key}[{k}]", key)
    for r in d.rotors:
        yield _not_negative(f"rotors.{r.name}", "inertia", "inertia", " kg m^2")
    for c in d.pairs:
        for solid in (*c.shapes, *c.other_shapes):  # a sphere of no size is a point
            for k in range(len(solid.sizes)):
                yield _not_negative(f"contacts.{c.name}", f"{solid.place}.{solid.kind}[{k}]", "size", " m")
    for r in d.rolling:
        says = "the radius is not positive at the parameters' values: {0:g} m"
        yield Requirement(f"rolling.{r.name}", r.kind, (r.kind,), POSITIVE, says, _LOOK)
    yield from _of_contacts(d)
    yield from _of_plane(d)


def is_massless(body: Body) -> bool:
    """Whether a body is drawn only: mass and inertia are zero, whatever the parameters are set to."""
    parts = [x for x in (body.mass, *body.inertia) if x is not None]
    return all(x.is_Number and x.is_zero for x in parts)  # 0.0 is equal to no integer


def of_bristles(d: Description) -> Iterator[Requirement]:
    """The requirements of bristles."""
    for b in d.bristles:
        yield from _of_bristle(b)


def limits(d: Description, looked_at: Iterable[Item], required: Iterable[Requirement]) -> tuple[Limit, ...]:
    """The requirements whose numbers depend on parameters, and on nothing that runs change; of equal ones, the first.

    Parameters
    ----------
    d : Description
        Before its elements are written out, its definitions in order.
    looked_at, required
        Its items, and its requirements with those of bristles.
    """
    made = _MadeOfParameters(d)
    expressions: dict[Address, algebra.Expr] = {(x.table, x.key): x.expression for x in looked_at}
    found: dict[
        tuple, Limit | None
    ] = {}  # None where parameters do not determine the numbers, or have no part
    for r in required:
        numbers = tuple(expressions.get((r.table, key)) for key in r.numbers)
        if (r.bound, numbers) in found:
            continue
        key = r.key if r.bound == TENSOR else r.numbers[0]
        is_limit = None not in numbers and made.are_known(numbers)
        found[r.bound, numbers] = Limit(f"{r.table}.{key}", r.bound, numbers) if is_limit else None
    made_of = [x for x in found.values() if x is not None]
    return tuple(x for x in made_of if x.bound != ZERO_OR_MORE or not found.get((POSITIVE, x.numbers)))


class _MadeOfParameters:
    """Knows of expressions whether parameters determine them, and whether any has a part in them."""

    def __init__(self, d: Description) -> None:
        self._varying = {p.name for p in d.parameters}
        self._known = self._varying | {c.name for c in d.constants}
        for item in definition_items(d):
            names = names_in(item.expression)
            if self._is_determined(item.expression, names):
                self._known.add(item.key)
                if names & self._varying:
                    self._varying.add(item.key)

    def are_known(self, numbers: Sequence[algebra.Expr]) -> bool:
        """Whether parameters determine all of these, and any of them changes with one."""
        named = [names_in(x) for x in numbers if not x.is_Number]
        if not any(names & self._varying for names in named):
            return False
        return all(map(self._is_determined, [x for x in numbers if not x.is_Number], named))

    def _is_determined(self, expression: algebra.Expr, names: frozenset[str]) -> bool:
        if not names <= self._known:
            return False
        return all(kind(node) not in ("dot", TABLE) for node in postorder([expression]))


def _not_negative(table: str, key: str, what: str, unit: str = "") -> Requirement:
    says = f"the {what} is negative at the parameters' values: {{0:g}}{unit}"
    return Requirement(table, key, (key,), ZERO_OR_MORE, says, _LOOK)


def _of_solids(body: Body) -> Iterator[Requirement]:
    table = f"bodies.{body.name}"
    for solid in body.solids:
        yield from _of_sizes(table, solid)
    for k in range(len(body.shape.sizes) if body.shape is not None else 0):  # drawn alone
        yield _not_negative(table, f"shape.{body.shape.kind}[{k}]", "size", " m")
    if any(solid.cut for solid in body.solids):
        for key in ("mass", "inertia", *(f"inertia[{k}]" for k in range(3))):
            says = "the holes of the body are larger than its shapes at the parameters' values"
            yield Requirement(table, "shape", (key,), POSITIVE, says, "look at the sizes of those with 'cut'")


def _of_sizes(table: str, solid: Solid) -> Iterator[Requirement]:
    key, n = f"{solid.place}.{solid.kind}", len(solid.sizes)
    hollow = solid.kind == "tube" and n > 1
    for k in range(n):
        bound = ZERO_OR_MORE if hollow and k == 1 else POSITIVE
        says = "the size is not positive at the parameters' values: {0:g} m"
        yield Requirement(table, f"{key}[{k}]", (f"{key}[{k}]",), bound, says, _LOOK)
    if hollow:
        says = "the inner radius {0:g} m is not below the outer one, {1:g} m"
        yield Requirement(
            table, f"{key}[1]", (f"{key}[1]", f"{key}[0]"), BELOW, says, "the outer radius comes first"
        )


def _of_inertia(body: Body) -> Iterator[Requirement]:
    table, n = f"bodies.{body.name}", len(body.inertia)
    yield _not_negative(table, "mass", "mass", " kg")
    says = "the inertia is negative at the parameters' values: {0:g} kg m^2"
    if n == 1:
        yield Requirement(table, "inertia", ("inertia",), ZERO_OR_MORE, says, _LOOK)
    elif n:
        keys = tuple(f"inertia[{k}]" for k in range(n))
        yield from (Requirement(table, key, (key,), ZERO_OR_MORE, says) for key in keys[:3])
        says = "the inertia tensor has a negative principal moment at the parameters' values"
        yield Requirement(table, "inertia", keys, TENSOR, says, "its elements are signed as in URDF")


def _of_joint(joint: Joint) -> Iterator[Requirement]:
    table = f"joints.{joint.name}"
    for what in ("armature", "stiffness", "damping"):
        n = len(getattr(joint, what))
        for key in [what] if n == 1 else [f"{what}[{k}]" for k in range(n)]:
            r = _not_negative(table, key, what)
            yield r._replace(hint=None) if what == "armature" else r
    if joint.limits:
        says = "the lower limit {0:g} is not below the upper one {1:g} at the parameters' values"
        yield Requirement(table, "limits", ("limits[0]", "limits[1]"), BELOW, says)


def _of_bristle(b: Bristle) -> Iterator[Requirement]:
    table = f"bristles.{b.name}"
    for key in ("stiffness", "damping", "viscous", "coulomb", "static"):
        least = POSITIVE if key in ("stiffness", "coulomb") else ZERO_OR_MORE
        says = f"it is {{0:g}} at the parameters' values: it is to be {least}"
        yield Requirement(table, key, (key,), ZERO_OR_MORE, says)
        if least == POSITIVE:
            force = f"-c*{shortened(b.speed)}"
            hint = f"bristles bear nothing then: write what is left as a force, such as {force}"
            yield Requirement(table, key, (key,), POSITIVE, says, hint if key == "coulomb" else None)
    says = "it is {0:g}, less than what slides, {1:g}"
    hint = "leave it out for friction without Stribeck's fall"
    yield Requirement(table, "static", ("static", "coulomb"), NOT_BELOW, says, hint)


def _static(table: str, sliding: str) -> Requirement:
    """What sticks bears no less than what slides has."""
    says = (
        "it is {0:g} at the parameters' values, less than while it slides, {1:g}: what has come to rest would slip at "
        "once"
    )
    hint = "give {1:g} or more, or leave it out: it is {1:g} then"
    return Requirement(table, "static", ("static", sliding), NOT_BELOW, says, hint)


def _of_contacts(d: Description) -> Iterator[Requirement]:
    restituting = [f"stops.{s.name}" for s in d.stops]
    restituting += [f"joints.{j.name}" for j in d.joints if j.restitution is not None]
    restituting += [f"contacts.{c.name}" for c in d.pairs]
    for table in restituting:
        says = "the restitution is {0:g} at the parameters' values, not from 0 to 1"
        yield Requirement(table, "restitution", ("restitution",), FROM_0_TO_1, says)
    for c in (*d.contacts, *d.pairs):
        table, says = f"contacts.{c.name}", "the exponent is {0:g}: it is at least 1"
        hint = "choose 1 or more; 1.5 is Hertz's"
        yield Requirement(table, "exponent", ("exponent",), ONE_OR_MORE, says, hint)
        yield from (_not_negative(table, key, key) for key in ("stiffness", "damping", "friction", "static"))
        yield _static(table, "friction")
    for f in d.frictions:
        table, sliding = f"friction.{f.name}", "coefficient" if f.normal else "force"
        what = "coefficient" if f.normal else "friction"
        yield from (_not_negative(table, key, what)._replace(hint=None) for key in (sliding, "static"))
        yield _static(table, sliding)
    smooth = [(f"friction.{f.name}", "creep" if f.creeps else "smooth") for f in d.frictions]
    for table, key in (*smooth, *((f"contacts.{c.name}", "smooth") for c in (*d.contacts, *d.pairs))):
        says = "the speed is not positive at the parameters' values: {0:g}"
        yield Requirement(table, key, (key,), POSITIVE, says, f"leave '{key}' out for friction that sticks")


def _of_plane(d: Description) -> Iterator[Requirement]:
    """Gravity along z would do nothing to bodies in the x-y plane: more likely it was meant as y."""
    if d.gravity is None:
        return
    for body in d.bodies:
        if body.planar and not is_massless(body):
            says = f"gravity along z does not move the planar body '{body.name}'"
            hint = "planar bodies move in the x-y plane: use y, or give 'com' a third component"
            yield Requirement("gravity", "z", ("z",), ZERO, says, hint)
            return
