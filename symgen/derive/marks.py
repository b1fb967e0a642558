"""Marks: what a picture of the mechanism shows besides its bodies, and the expressions that say where."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ..model import algebra
from ..model.description import Description, Joint, Loop, Point, Rolling
from ..model.gravity import HERE
from ..model.joint_types import TYPES
from ..model.orientation import Matrix, rotation
from ..model.ready_made import ratio_of
from .graph.nodes import Q
from .load import Loader
from .program import Function
from .rod_ends import rod_ends
from .structure import Movement

WORLD = "world"
MOST_BODIES = 200  # with more of them, marks would hide the picture
Vector = tuple[algebra.Expr, ...]
ZERO = (algebra.ZERO,) * 3
OUT_OF_PLANE = (algebra.ZERO, algebra.ZERO, algebra.ONE)


@dataclass(frozen=True)
class Mark:
    """One mark: what the module's header says of it (docs/abi.md), and what the function `marks` writes."""

    kind: str
    name: str
    body: str
    values: Vector
    moves: bool = False
    constraints: tuple[int, ...] = ()
    signs: tuple[int, ...] = ()
    carries: tuple[str, ...] = ()
    height: algebra.Expr | None = None

    def record(self) -> dict[str, Any]:
        """The entry of the header."""
        record = {"kind": self.kind, "name": self.name, "body": self.body, "numbers": len(self.values)}
        if self.moves:
            record["moves"] = True
        if self.constraints:
            record |= {"constraints": list(self.constraints), "signs": list(self.signs)}
        if self.carries:
            record["carries"] = list(self.carries)
        return record


def marks(d: Description) -> list[Mark]:
    """The marks of a description; none where it has no bodies or too many, or says nothing that could be drawn."""
    if not 0 < len(d.bodies) <= MOST_BODIES:
        return []
    found = _Finder(d)
    return [
        *found.joints(),
        *found.bars(),
        *found.closures(),
        *found.gears(),
        *found.rotors(),
        *found.points(),
        *found.floors(),
        *rods(d),
        *_loads(d),
        *_drawings(d),
    ]


class _Finder:
    """Finds what joints, points and ready-made constraints say; places are in the axes of the body that has them."""

    def __init__(self, d: Description) -> None:
        self.d = d
        self.bodies = {b.name: b for b in d.bodies}
        self.children = {j.child for j in d.joints}
        self.point = {p.name: p for p in d.points}
        self.frame = {f.name: f for f in d.frames}
        self.index = {c.name: k for k, c in enumerate(d.constraints)}
        self.pins: dict[str, list[Vector]] = {}  # by body: where others are joined to it

    def local(self, body: str, place: Vector) -> Vector:
        """A place in a body's frame, from the origin of its pose: the centre of mass."""
        if body not in self.children:
            return place
        com = (*self.bodies[body].com, *ZERO)[:3]
        return tuple(a - b for a, b in zip(place, com, strict=True))

    def pin(self, body: str, place: Vector) -> None:
        if body != WORLD:
            self.pins.setdefault(body, []).append(self.local(body, place))

    def joints(self) -> Iterator[Mark]:
        """Hinges, guides and balls of the trees, and the ground below those that stand on the world."""
        for j in self.d.joints:
            if TYPES[j.type].nv == 6:  # it joins nothing
                continue
            place, turn = tuple(j.xyz), rotation(j.rpy)
            self.pin(j.parent, place)
            self.pin(j.child, ZERO)
            if j.parent == WORLD and self._stands(j):
                yield Mark("ground", j.name, "", place)
            home = "" if j.parent == WORLD else j.parent
            here = place if j.parent == WORLD else self.local(j.parent, place)
            for kind, on in TYPES[j.type].marks:
                if on == "axis":
                    yield Mark(kind, j.name, home, (*here, *_times(turn, j.axis)))
                elif on == "axis2":
                    second = (*self.local(j.child, ZERO), *map(algebra.Float, j.axis2))
                    yield Mark(kind, f"{j.name}_2", j.child, second)
                elif self._stands(j):
                    yield Mark(kind, j.name, home, here)

    def _stands(self, j: Joint) -> bool:
        """Whether a joint holds its child in a place: a body that turns about its centre as it likes is free."""
        turns_freely = TYPES[j.type].quaternion and not any(self.bodies[j.child].com)
        return TYPES[j.type].holds and not turns_freely

    def bars(self) -> Iterator[Mark]:
        """Bars of bodies without shape: between joints and named points, or from a lone one to the centre of mass."""
        for p in self.d.points:
            self.pin(p.body, tuple(p.at))
        for body in self.d.bodies:
            places = list(dict.fromkeys(self.pins.get(body.name, ())))
            if len(places) == 1 and places[0] != ZERO:  # to the centre of mass
                places.append(ZERO)
            if body.shape is None and len(places) > 1:
                for k, place in enumerate(places[1:], 1):
                    name = body.name if len(places) == 2 else f"{body.name}_{k}"
                    yield Mark("bar", name, body.name, (*places[0], *place))

    def closures(self) -> Iterator[Mark]:
        """Pins and links of ready-made constraints, with the multipliers that are their forces."""
        for loop in self.d.loops:
            if loop.kind not in ("coincident", "distance"):
                continue
            a, b = (self.point[name] for name in dict(loop.arguments)["points"])
            for p in (a, b):
                if p.body == WORLD:
                    yield Mark("ground", loop.name if p is a else f"{loop.name}_2", "", tuple(p.at))
            if loop.kind == "distance":
                ends = (*_symbols(a.name), *_symbols(b.name))
                yield Mark("link", loop.name, "", ends, True)
                yield Mark("tension", loop.name, "", ends, True, (self.index[loop.name],), (1,))
                for p in filter(self._shows, (a, b)):
                    yield Mark("ball", p.name, p.body, self.local(p.body, tuple(p.at)))
                continue
            sign, p = (1, a) if a.body != WORLD else (-1, b)
            place = self.local(p.body, tuple(p.at))
            held = tuple(self.index[loop.name + c] for c in ("_x", "_y", "_z") if loop.name + c in self.index)
            if self.bodies[p.body].planar:
                yield Mark("pin", loop.name, p.body, (*place, *OUT_OF_PLANE))
            else:
                yield Mark("ball", loop.name, p.body, place)
            yield Mark("reaction", loop.name, p.body, place, False, held, (sign,) * len(held))

    def _shows(self, p: Point) -> bool:
        """Whether a joint is drawn at a point: a ball around it would hide it."""
        shape = None if p.body == WORLD else self.bodies[p.body].shape
        return p.body != WORLD and not (shape is not None and shape.kind == "sphere" and not any(p.at))

    def gears(self) -> Iterator[Mark]:
        """Gears of hinges that a ready-made constraint couples, if they stand on one body with parallel axes."""
        hinge = {j.coordinates[0]: j for j in self.d.joints if TYPES[j.type].hinge}
        for loop in self.d.loops:
            if loop.kind != "gear":
                continue
            arguments = dict(loop.arguments)
            a, b = (hinge.get(name) for name in arguments["coordinates"])
            if a is None or b is None or a.parent != b.parent:
                continue
            for j, radius in zip(
                (a, b), _pitch_radii(a, b, ratio_of(arguments.get("ratio"), arguments.get("teeth")))
            ):
                axis = tuple(map(algebra.Float, j.axis))
                yield Mark("gear", j.name, j.child, (*self.local(j.child, ZERO), *axis, radius))

    def rotors(self) -> Iterator[Mark]:
        """Shafts of rotors that spin in bodies."""
        for r in self.d.rotors:
            if r.body != WORLD:
                place = self.local(r.body, tuple(r.at)) if r.at else ZERO
                yield Mark("pin", r.name, r.body, (*place, *map(algebra.Float, r.axis or (0.0, 0.0, 1.0))))

    def points(self) -> Iterator[Mark]:
        """Named points that no constraint uses."""
        used = {name for loop in self.d.loops for name in _points_of(loop)}
        for p in self.d.points:
            if p.name not in used and p.body != WORLD:
                yield Mark("point", p.name, p.body, self.local(p.body, tuple(p.at)))

    def floors(self) -> Iterator[Mark]:
        """Planes and surfaces that bodies roll on or touch; planes of bodies that have a shape are drawn by it."""
        found: dict[tuple[str, algebra.Expr | None], dict[str, str]] = {}  # by name: what is on it
        for r in (*self.d.rolling, *(pair for pair in self.d.pairs if pair.other is None)):
            if not (isinstance(r, Rolling) and r.kind == "knife" and self.bodies[r.body].planar):
                found.setdefault((r.plane, r.height), {})[r.name] = r.body
        for (plane, height), carried in found.items():
            frame = self.frame.get(plane)
            body, at, rpy = (plane, ZERO, ZERO) if frame is None else (frame.body, frame.at, frame.rpy)
            if height is None and body != WORLD and self.bodies[body].shape is not None:
                continue
            home, place = ("", at) if body == WORLD else (body, self.local(body, tuple(at)))
            turn = rotation(rpy)
            directions = (row[k] for k in (0, 1) for row in turn)
            on = tuple(dict.fromkeys(carried.values()))
            kind, name = "plane" if height is None else "surface", next(iter(carried))
            yield Mark(kind, name, home, (*_three(place), *directions), carries=on, height=height)


def _pitch_radii(a: Joint, b: Joint, ratio: algebra.Expr) -> Vector:
    """Radii of the gears of two hinges with q_a = ratio q_b; none where their axes are not parallel, or are one.

    r_b = |ratio| r_a, and the circles touch: from outside where they turn against each other, else from inside.
    """
    first, second = (_times(rotation(j.rpy), j.axis) for j in (a, b))
    if all(x == -y for x, y in zip(first, second, strict=True)):
        ratio = -ratio
    elif any(x != y for x, y in zip(first, second, strict=True)):
        return ()
    apart = [x - y for x, y in zip(a.xyz, b.xyz, strict=True)]
    along = algebra.Add(*(x * n for x, n in zip(apart, first, strict=True)))
    across = [(x - along * n) ** 2 for x, n in zip(apart, first, strict=True)]
    distance = algebra.sqrt(algebra.Add(*across))
    if distance.is_zero or (ratio - 1).is_zero:  # a float is equal to no integer
        return ()
    radius = distance / algebra.Abs(ratio - 1)
    return radius, algebra.Abs(ratio) * radius


def mark_function(loader: Loader, found: list[Mark]) -> Iterator[Function]:
    """The function `marks`, if there are any."""
    if not found:
        return
    nodes = [loader.load(x) for mark in found for x in mark.values]
    written = {k: node for k, node in enumerate(nodes) if node != loader.g.zero} or {0: nodes[0]}
    doc = "What a picture shows besides bodies, as `marks` lists it."
    yield Function("marks", doc, tuple(written.values()), tuple(written))


def height_function(loader: Loader, found: list[Mark]) -> Iterator[Function]:
    """The function `heights` of a place over the plane of each surface, if there are any; y is that place."""
    surfaces = [mark.height for mark in found if mark.height is not None]
    if not surfaces:
        return
    place = {
        algebra.Symbol(name): algebra.Symbol(f"{name} on a floor") for name in HERE[:2]
    }  # no model's name
    loader.symbols |= {symbol.name: loader.g.var(Q, k) for k, symbol in enumerate(place.values())}
    nodes = tuple(loader.load(height.xreplace(place)) for height in surfaces)
    yield Function(
        "heights", "Heights of the surfaces among `marks` at a place x, y over their planes.", nodes
    )


def mark_records(found: list[Mark]) -> dict[str, list[dict[str, Any]]]:
    """What the header says of marks: nothing where there are none."""
    return {"marks": [mark.record() for mark in found]} if found else {}


def _points_of(loop: Loop) -> list[str]:
    arguments = dict(loop.arguments)
    return [
        *arguments.get("points", ()),
        *(arguments[k] for k in ("point", "line", "plane") if k in arguments),
    ]


def _symbols(point: str) -> Vector:
    return tuple(algebra.Symbol(f"{point}_{c}") for c in "xyz")


def rods(d: Description) -> Iterator[Mark]:
    """Pins at the ends of rods that are placed by hand, as far as the description shows what they are joined to."""
    for end in rod_ends(d):
        if end.body.planar:
            yield Mark("pin", end.name, end.body.name, (*end.local, *OUT_OF_PLANE))
        else:
            yield Mark("ball", end.name, end.body.name, end.local)
        if end.fixed:
            yield Mark("ground", end.name, "", end.place)
        if end.constraints:
            yield Mark("reaction", end.name, end.body.name, end.local, False, end.constraints, end.signs)


def _loads(d: Description) -> Iterator[Mark]:
    for load in d.loads:
        if load.force:
            yield Mark("force", load.name, "", (*_three(load.point), *_three(load.force)), True)
        else:
            torque = load.torque if len(load.torque) == 3 else (*ZERO[:2], *load.torque)
            yield Mark("torque", load.name, load.body, tuple(torque), True)


def _drawings(d: Description) -> Iterator[Mark]:
    movement = Movement(d) if d.drawings else None
    for drawing in d.drawings:
        values = tuple(x for vector in drawing.vectors for x in vector)
        if drawing.kind == "pin":
            values = (*values, *(OUT_OF_PLANE if all(b.planar for b in d.bodies) else ZERO))
        kind = {"bar": "link"}.get(drawing.kind, drawing.kind)
        yield Mark(kind, drawing.name, "", values, drawing.kind == "force" or movement.of(values))


def _three(vector: Vector) -> Vector:
    return (*vector, *ZERO)[:3]


def _times(matrix: Matrix, vector: tuple[float, ...]) -> list[algebra.Expr]:
    numbers = [algebra.Integer(int(x)) if x == int(x) else algebra.Float(x) for x in vector]
    return [algebra.Add(*(a * b for a, b in zip(row, numbers, strict=True))) for row in matrix]
