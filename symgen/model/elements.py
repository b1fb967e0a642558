"""Springs, dampers and bushings, and loads with an opposite, written out as energies, dissipation and plain loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..errors import ModelError, nearest
from . import algebra
from .declared import Declared
from .description import Axis, Bushing, Description, Drawing, Load, Point, Spring, Winding
from .functions import INTEGRAL, VALUE, dot, less, maximum, minimum, tabulated, where
from .names import reference_fault
from .orientation import rotation
from .ready_made import HALF, WORLD
from .sources import Sources
from .unevaluated import difference, negated, product, squared, total

SPRING_KEYS = (
    "points",
    "angle",
    "stiffness",
    "curve",
    "length",
    "rest",
    "damping",
    "preload",
    "mass",
    "acts",
)
BUSHING_KEYS = ("frames", "stiffness", "damping")
ACTS = ("both", "pull", "push")
SIXTH = algebra.Rational(1, 6)
Vector = list[algebra.Expr]


def make_spring(model: Declared, name: str, given: Mapping[str, Any]) -> Spring:
    """A spring from the arguments of `Model.spring`."""
    table, sources = f"springs.{name}", model._sources
    given = {key: value for key, value in given.items() if value is not None}

    def error(key: str, message: str, hint: str):
        return sources.error(table, key, message, hint=hint)

    if ("points" in given) == ("angle" in given):
        raise error("points", "a spring acts between two 'points' or on one 'angle'", "give one of the two")
    turns = "angle" in given
    rest, other = ("rest", "length") if turns else ("length", "rest")
    if other in given:
        what = "a spring of an angle" if turns else "a spring between points"
        raise error(other, f"{what} has no '{other}'", f"its rest position is called '{rest}'")
    acts = given.get("acts", "both")
    if acts not in ACTS:
        raise error("acts", f"{acts!r:.60} is not one of {', '.join(ACTS)}", nearest(str(acts)[:60], ACTS))
    if not {"stiffness", "curve", "damping", "preload", "mass"}.intersection(given):
        raise error(
            "", "a spring needs a stiffness, a curve, a damping or a preload", "for example stiffness = 100"
        )
    if "stiffness" in given and "curve" in given:
        hint = "write the straight part into the table, or make two springs"
        raise error("curve", "a spring has a 'stiffness' or a 'curve', not both", hint)
    elastic = "stiffness" in given or "curve" in given
    if elastic and rest not in given and not turns:
        raise error(
            "length",
            "the length at which the spring is at rest is missing",
            "length = 0 is one that has none",
        )
    if acts != "both":
        for key in ("preload", "mass"):
            if key in given:
                change = f"{rest} by preload/stiffness" if "stiffness" in given else f"{rest} and its curve"
                hint = f"change its {change}" if key == "preload" else "give it to bodies"
                raise error(key, f"a spring that acts one way has no '{key}'", hint)
        if not elastic:
            hint = "give one, or leave out 'acts'"
            raise error("acts", "what acts one way needs a stiffness or a curve", hint)
    if turns and "mass" in given:
        raise error(
            "mass", "a spring of an angle has no 'mass'", "inertia is that of bodies, or armature of joints"
        )
    places: tuple[tuple[algebra.Expr, ...], ...] = ()
    if not turns:
        two = model._vector(given["points"], table, "points", (2,))
        places = tuple(model._place(x, table, f"points[{k}]") for k, x in enumerate(two))
    found = {
        key: sources.expression(given[key], table, key)
        for key in ("angle", "stiffness", "damping", "preload", "mass", rest)
        if key in given
    }
    if rest in found:
        found["rest"] = found.pop(rest)
    made = Spring(name, places, acts="" if acts == "both" else acts, **found)
    if "curve" not in given:
        return made
    curve = sources.expression(_curve(made, given["curve"], error), table, "curve")
    return replace(made, curve=curve)


def _curve(spring: Spring, table: Any, error: Callable[[str, str, str], ModelError]) -> algebra.Expr:
    """The force of a table at what a spring is longer than at rest."""
    name = getattr(table, "name", table)  # what `Model.table` returns, too
    fault = reference_fault(name)
    if fault is not None:
        raise error("curve", fault, 'name one of [tables], such as curve = "bumper"')
    return tabulated(name, VALUE, 1)(_stretch(spring), evaluate=False)


def measures(spring: Spring) -> list[tuple[str, algebra.Expr]]:
    """The definitions that a spring makes: its length or angle, and the force or torque that it exerts.

    A rope that is slack is as long as at rest, and so is a buffer that nothing touches.
    """
    bound = {"pull": maximum, "push": minimum}.get(spring.acts)
    rest = algebra.ZERO if spring.rest is None else spring.rest
    if spring.angle is not None:
        length = spring.angle if bound is None else bound(spring.angle, rest, evaluate=False)
    else:
        square = _squared_distance(spring)
        square = square if bound is None else bound(square, squared(rest), evaluate=False)
        length = algebra.Pow(square, HALF, evaluate=False)
    force = total([_elastic(spring), _viscous(spring), *([] if spring.preload is None else [spring.preload])])
    if bound is not None:
        force = bound(force, algebra.ZERO, evaluate=False)
    return [(spring.measured, length), (spring.exerted, force)]


def _ends(s: Spring) -> tuple[tuple[algebra.Expr, ...], ...]:
    """Between which places it is drawn: a buffer stands at the second, and is no longer than at rest."""
    if s.acts != "push":
        return s.places
    first, second = s.places
    share = product([algebra.Symbol(s.measured), algebra.Pow(_squared_distance(s), -HALF, evaluate=False)])
    tip = tuple(total([b, product([difference(a, b), share])]) for a, b in zip(first, second, strict=True))
    return tip, second


def _squared_distance(spring: Spring) -> algebra.Expr:
    a, b = spring.places
    return total([squared(difference(x, y)) for x, y in zip(a, b, strict=True)])


def _stretch(spring: Spring) -> algebra.Expr:
    q = algebra.Symbol(spring.measured)
    return q if spring.rest is None else difference(q, spring.rest)


def _elastic(spring: Spring) -> algebra.Expr:
    if spring.curve is not None:
        return spring.curve
    return algebra.ZERO if spring.stiffness is None else product([spring.stiffness, _stretch(spring)])


def _viscous(spring: Spring) -> algebra.Expr:
    rate = dot(algebra.Symbol(spring.measured))
    return algebra.ZERO if spring.damping is None else product([spring.damping, rate])


def make_bushing(model: Declared, name: str, given: Mapping[str, Any]) -> Bushing:
    """A bushing from the arguments of `Model.bushing`."""
    table, sources = f"bushings.{name}", model._sources
    if given.get("frames") is None or given.get("stiffness") is None:
        key = "frames" if given.get("frames") is None else "stiffness"
        raise sources.error(
            table, key, f"the key '{key}' is missing", hint="a bushing has 'frames' and 'stiffness'"
        )
    frames = model._vector(given["frames"], table, "frames", (2,))
    for k, x in enumerate(frames):
        fault = reference_fault(x)
        if fault is not None:
            raise sources.error(table, f"frames[{k}]", fault, hint='name a frame, a body or "world"')
    values = {}
    for key in ("stiffness", "damping"):
        vector = () if given.get(key) is None else model._vector(given[key], table, key, (3, 6))
        values[key] = tuple(sources.expression(x, table, f"{key}[{k}]") for k, x in enumerate(vector))
    if values["damping"] and len(values["damping"]) != len(values["stiffness"]):
        message = f"{len(values['stiffness'])} stiffnesses and {len(values['damping'])} dampings are given"
        raise sources.error(table, "damping", message, hint="give as many of both")
    return Bushing(name, tuple(frames), **values)


def check_force_elements(d: Description, sources: Sources) -> None:
    """Whether frames, bodies and points that springs, bushings and loads name are there, and fit together."""
    frames = {f.name: f.body for f in d.frames} | {b.name: b.name for b in d.bodies} | {WORLD: WORLD}
    planar = {b.name: b.planar for b in d.bodies} | {WORLD: True}

    def known(table: str, key: str, name: str, among: Mapping[str, Any], what: str) -> None:
        if name not in among:
            raise sources.error(
                table, key, f"there is no {what} '{name}'", hint=nearest(name, among, f"{what}s")
            )

    for bushing in d.bushings:
        table = f"bushings.{bushing.name}"
        for k, name in enumerate(bushing.frames):
            known(table, f"frames[{k}]", name, frames, "frame or body")
        bodies = [frames[name] for name in bushing.frames]
        if bodies[0] == bodies[1]:
            message = "both frames are fixed in " + ("the world" if bodies[0] == WORLD else f"'{bodies[0]}'")
            raise sources.error(table, "frames", message, hint="choose frames of two bodies")
        flat = all(planar[b] for b in bodies)
        if flat != (len(bushing.stiffness) == 3):
            takes = "three: along x, along y, about z" if flat else "six: along and about x, y, z"
            message = f"stiffnesses between these bodies are {takes}; {len(bushing.stiffness)} are given"
            raise sources.error(table, "stiffness", message, hint="write as many")
    for load in d.loads:
        table = f"loads.{load.name}"
        if load.frame is not None:
            known(table, "frame", load.frame, frames, "frame or body")
        if load.reaction is not None:
            known(table, "reaction", load.reaction, planar, "body")
            if load.reaction == load.body:
                message = "the torque and its opposite act on one body"
                raise sources.error(table, "reaction", message, hint="name another body")


@dataclass
class Writer:
    """Writes elements out; `axes` and `points` collects what they need of bodies, under names that are free."""

    description: Description
    taken: set[str]
    axes: list[Axis] = field(default_factory=list)
    points: list[Point] = field(default_factory=list)
    terms: dict[str, Vector] = field(
        default_factory=lambda: {"kinetic": [], "potential": [], "dissipation": []}
    )
    drawings: list[Drawing] = field(default_factory=list)
    windings: list[Winding] = field(default_factory=list)

    def __post_init__(self) -> None:
        d = self.description
        self.frames = {f.name: f for f in d.frames}
        self.body = {b.name: b for b in d.bodies}
        self.children = {j.child for j in d.joints}
        self._directions: dict[str, list[Vector]] = {}

    def free(self, name: str) -> str:
        """A name that nothing else has."""
        while any(f"{name}_{c}" in self.taken for c in "xyz"):
            name += "_"
        self.taken.update(f"{name}_{c}" for c in "xyz")
        return name

    def body_of(self, frame: str) -> str:
        """The body that a frame, or body, is fixed in."""
        return self.frames[frame].body if frame in self.frames else frame

    def origin(self, frame: str) -> Vector:
        """World coordinates of the origin of a frame, or of that of a body."""
        if frame == WORLD:
            return [algebra.ZERO] * 3
        if frame in self.frames:
            return _symbols(frame)
        return self.point(frame, (algebra.ZERO,) * 3)

    def centre(self, body: str) -> Vector:
        """World coordinates of a body's centre of mass."""
        com = (*self.body[body].com, algebra.ZERO)[:3]
        return self.point(body, com) if body in self.children else list(com)

    def point(self, body: str, at: tuple[algebra.Expr, ...]) -> Vector:
        """World coordinates of a point of a body."""
        made = next((p for p in self.points if (p.body, p.at) == (body, at)), None)
        if made is None:
            made = Point(self.free(f"{body}_point{len(self.points) + 1}"), body, at)
            self.points.append(made)
        return _symbols(made.name)

    def directions(self, frame: str) -> list[Vector]:
        """World components of the three axes of a frame or body."""
        if frame not in self._directions:
            body = self.body_of(frame)
            turn = rotation(self.frames[frame].rpy if frame in self.frames else (algebra.ZERO,) * 3)
            columns = [[row[k] for row in turn] for k in range(3)]
            if body != WORLD:
                columns = [
                    column
                    if self.body[body].planar and k == 2
                    else self._axis(f"{frame}_e{k + 1}", body, column)
                    for k, column in enumerate(columns)
                ]
            self._directions[frame] = columns
        return self._directions[frame]

    def direction(self, frame: str, numbers: Sequence[float]) -> Vector:
        """World components of a direction in the axes of a frame or body."""
        exact = [algebra.Integer(int(x)) if x == int(x) else algebra.Float(x) for x in numbers]
        axes = self.directions(frame)
        return [total([product([n, e[k]]) for n, e in zip(exact, axes, strict=True)]) for k in range(3)]

    def _axis(self, name: str, body: str, column: Vector) -> Vector:
        axis = Axis(self.free(name), body, tuple(column))
        self.axes.append(axis)
        return _symbols(axis.name)

    def spring(self, s: Spring) -> None:
        """Its energies, and its picture."""
        stretch, rate = _stretch(s), dot(algebra.Symbol(s.measured))
        if s.stiffness is not None:
            bare = s.places and s.rest.is_zero and not s.acts  # no root: smooth where the places meet
            square = _squared_distance(s) if bare else squared(stretch)
            self.terms["potential"].append(product([HALF, s.stiffness, square]))
        if s.curve is not None:
            self.terms["potential"].append(tabulated(s.curve.table, INTEGRAL, 1)(stretch, evaluate=False))
        if s.preload is not None:
            self.terms["potential"].append(product([s.preload, stretch]))
        if s.damping is not None:
            plain = product([HALF, s.damping, squared(rate)])
            self.terms["dissipation"].append(_one_way(s, plain, rate) if s.acts else plain)
        if s.mass is not None:
            self._mass(s)
        if s.places:
            kind = "spring" if s.acts != "pull" else "bar"
            kind = "damper" if s.stiffness is None and s.curve is None and s.preload is None else kind
            self.drawings.append(Drawing(s.name, kind, _ends(s)))

    def _mass(self, s: Spring) -> None:
        """A mass that is spread evenly between two places: v = (1 - s) v_a + s v_b, and its weight in the middle."""
        a, b = ([x * 0 if x.is_Number else dot(x) for x in place] for place in s.places)
        pairs = zip(a, b, strict=True)
        speeds = total([x for p, q in pairs for x in (squared(p), product([p, q]), squared(q))])
        self.terms["kinetic"].append(product([SIXTH, s.mass, speeds]))
        for g, x, y in zip(self.description.gravity or (), *s.places):
            self.terms["potential"].append(negated(product([HALF, s.mass, g, total([x, y])])))

    def bushing(self, b: Bushing) -> None:
        """Its energy, of displacements in the axes of the first frame, and of Cardan angles."""
        first, second = (self.directions(name) for name in b.frames)
        origins = [self.origin(name) for name in b.frames]
        apart = [difference(y, x) for x, y in zip(*origins, strict=True)]
        self.drawings.append(Drawing(b.name, "pin", (tuple(origins[0]),)))
        along = [scalar_product(apart, axis) for axis in first]
        if len(b.stiffness) == 3:
            x, y = scalar_product(first[0], second[0]), scalar_product(first[1], second[0])
            along, turned = along[:2], [algebra.atan2(y, x, evaluate=False)]
        else:
            turned = cardan(first, second)
        measured = [*along, *turned]
        if not all(x.is_zero for x in b.stiffness[len(along) :]):
            self.windings.append(Winding(b.name, "bushing", tuple(turned)))
        for factors, key in ((b.stiffness, "potential"), (b.damping, "dissipation")):
            for factor, x in zip(factors, measured):
                value = x if key == "potential" else dot(x)
                if not factor.is_zero:
                    self.terms[key].append(product([HALF, factor, squared(value)]))

    def load(self, load: Load) -> list[Load]:
        """A load in world axes, and the loads that are its opposite."""
        plain = replace(load, frame=None, reaction=None)
        if load.frame is not None and load.frame != WORLD:
            plain = replace(
                plain, force=self._turned(load, load.force), torque=self._turned(load, load.torque)
            )
        if load.reaction in (None, WORLD):
            return [plain]
        name, body = f"{load.name}_reaction", load.reaction
        if load.torque:
            return [plain, Load(name, body=body, torque=tuple(map(negated, plain.torque)))]
        return [plain, *self._opposite(name, body, plain)]

    def _turned(self, load: Load, vector: tuple[algebra.Expr, ...]) -> tuple[algebra.Expr, ...]:
        if len(vector) < 2:  # a planar torque is about z everywhere
            return vector
        axes = self.directions(load.frame)
        return tuple(
            total([product([x, axis[i]]) for x, axis in zip(vector, axes)]) for i in range(len(vector))
        )

    def _opposite(self, name: str, body: str, load: Load) -> list[Load]:
        """The opposite of a force on the point of a body that is where the force acts."""
        b, n = self.body[body], len(load.force)
        centre, force = self.centre(body), tuple(map(negated, load.force))
        found = [Load(name, point=tuple(centre[:n]), force=force)]
        if not (body in self.children or b.angle is not None or b.rotation):
            return found
        arm = [difference(x, y) for x, y in zip(load.point, centre)]
        x, y, *z = zip(arm, force, strict=True)
        torque = [difference(product([x[0], y[1]]), product([y[0], x[1]]))]
        if not b.planar:
            (w,) = z or ((negated(centre[2]), algebra.ZERO),)
            torque = [
                difference(product([y[0], w[1]]), product([w[0], y[1]])),
                difference(product([w[0], x[1]]), product([x[0], w[1]])),
                *torque,
            ]
        return [*found, Load(f"{name}_moment", body=body, torque=tuple(torque))]


def _one_way(s: Spring, plain: algebra.Expr, rate: algebra.Expr) -> algebra.Expr:
    """The dissipation of what acts one way: its force never turns round, however fast it is let go.

    Where the damping would make a rope push, the whole force is zero: its dissipative part is then the opposite of the
    elastic one.
    """
    viscous, opposite = _viscous(s), negated(_elastic(s))
    pulls = less(opposite, viscous) if s.acts == "pull" else less(viscous, opposite)
    return where(pulls, plain, product([opposite, rate]))


def cardan(first: list[Vector], second: list[Vector]) -> Vector:
    """Angles of the rotation Rx Ry Rz from the first axes to the second ones."""

    def entry(i: int, j: int) -> algebra.Expr:
        return scalar_product(first[i], second[j])

    return [
        algebra.atan2(negated(entry(1, 2)), entry(2, 2), evaluate=False),
        algebra.asin(entry(0, 2), evaluate=False),
        algebra.atan2(negated(entry(0, 1)), entry(0, 0), evaluate=False),
    ]


def euler_angles(first: list[Vector], second: list[Vector], sequence: str) -> Vector:
    """Angles of successive rotations, each about an axis of the frame before, from the first axes to the second ones.

    The middle one is from -π/2 to π/2, and from 0 to π where the first and the last axis are the same.
    """
    i, j, k = ("xyz".index(letter) for letter in sequence)
    left = 3 - i - j  # the axis that neither of the first two turns about
    even = (j - i) % 3 == 1

    def entry(row: int, column: int) -> algebra.Expr:
        return scalar_product(first[row], second[column])

    def signed(expression: algebra.Expr, same: bool) -> algebra.Expr:
        return expression if same else negated(expression)

    def angle(y: algebra.Expr, x: algebra.Expr) -> algebra.Expr:
        return algebra.atan2(y, x, evaluate=False)

    if i != k:
        return [
            angle(signed(entry(j, k), not even), entry(k, k)),
            algebra.asin(signed(entry(i, k), even), evaluate=False),
            angle(signed(entry(i, j), not even), entry(i, i)),
        ]
    aside = algebra.Pow(total([squared(entry(j, i)), squared(entry(left, i))]), HALF, evaluate=False)
    return [
        angle(entry(j, i), signed(entry(left, i), not even)),
        angle(aside, entry(i, i)),
        angle(entry(i, j), signed(entry(i, left), even)),
    ]


def scalar_product(a: Sequence[algebra.Expr], b: Sequence[algebra.Expr]) -> algebra.Expr:
    """The scalar product of two vectors."""
    return total([product(pair) for pair in zip(a, b, strict=True)])


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return [
        difference(product([a[1], b[2]]), product([a[2], b[1]])),
        difference(product([a[2], b[0]]), product([a[0], b[2]])),
        difference(product([a[0], b[1]]), product([a[1], b[0]])),
    ]


def _symbols(name: str) -> Vector:
    return [algebra.Symbol(f"{name}_{c}") for c in "xyz"]
