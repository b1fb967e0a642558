"""Solids that bodies are made of: mass, centre of mass, inertia and picture of boxes, cylinders and others.

Integrals of the solids about their centres of mass are those of mechanics textbooks (Beer & Johnston, Vector mechanics
for engineers, inside back cover); hemispheres of capsules have theirs 3/8 of the radius from the flat side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import nearest
from . import algebra
from .declared import Declared
from .description import Shape, Solid
from .evaluate import X, Z, perpendicular
from .evaluate import cross_product as cross
from .given import is_listed, unpacked
from .joints import direction
from .orientation import Expressions, Matrix, roll_pitch_yaw, rotation

SHAPE_KEYS = ("axis", "rpy", "offset", "density", "cut", "color")


@dataclass(frozen=True)
class Form:
    """A kind of solid.

    Attributes
    ----------
    takes : str
        Its sizes, for people.
    count : int
        How many there are.
    volume : callable
        Of the sizes [m^3].
    gyration : callable
        Of the sizes: squared radii of gyration about its own axes x, y, z through the centre of mass [m^2].
    round : bool
        Whether it is one of revolution, whose `axis` is z of its own axes; it may be given.
    rise : callable
        Of the sizes: how far the centre of mass lies along that axis from the middle [m].
    """

    takes: str
    count: int
    volume: Callable[..., algebra.Expr]
    gyration: Callable[..., Expressions]
    round: bool = True
    rise: Callable[..., algebra.Expr] = lambda *sizes: algebra.ZERO


def _ratio(p: int, q: int) -> algebra.Rational:
    return algebra.Rational(p, q)


def _of_revolution(across: algebra.Expr, along: algebra.Expr) -> Expressions:
    return across, across, along


def _tube_gyration(outer: algebra.Expr, inner: algebra.Expr, length: algebra.Expr) -> Expressions:
    squares = outer**2 + inner**2
    return _of_revolution(squares / 4 + length**2 / 12, squares / 2)


def _capsule_gyration(r: algebra.Expr, length: algebra.Expr) -> Expressions:
    rod, caps = length, _ratio(4, 3) * r  # volumes in parts of pi r^2
    across = rod * (r**2 / 4 + length**2 / 12)
    across += caps * (_ratio(2, 5) * r**2 + length**2 / 4 + _ratio(3, 8) * r * length)
    return _of_revolution(across / (rod + caps), (rod / 2 + caps * _ratio(2, 5)) * r**2 / (rod + caps))


FORMS: dict[str, Form] = {
    "box": Form(
        "[x, y, z]", 3, lambda x, y, z: x * y * z,
        lambda x, y, z: ((y**2 + z**2) / 12, (x**2 + z**2) / 12, (x**2 + y**2) / 12), round=False,
    ),
    "ellipsoid": Form(
        "[x, y, z], half its axes", 3, lambda x, y, z: _ratio(4, 3) * algebra.pi * x * y * z,
        lambda x, y, z: ((y**2 + z**2) / 5, (x**2 + z**2) / 5, (x**2 + y**2) / 5), round=False,
    ),
    "sphere": Form(
        "[radius]", 1, lambda r: _ratio(4, 3) * algebra.pi * r**3, lambda r: (_ratio(2, 5) * r**2,) * 3,
    ),
    "cylinder": Form(
        "[radius, length]", 2, lambda r, length: algebra.pi * r**2 * length,
        lambda r, length: _of_revolution(r**2 / 4 + length**2 / 12, r**2 / 2),
    ),
    "tube": Form(
        "[outer radius, inner radius, length]", 3,
        lambda outer, inner, length: algebra.pi * (outer**2 - inner**2) * length, _tube_gyration,
    ),
    "cone": Form(
        "[radius, height]", 2, lambda r, h: algebra.pi * r**2 * h / 3,
        lambda r, h: _of_revolution(_ratio(3, 20) * r**2 + _ratio(3, 80) * h**2, _ratio(3, 10) * r**2),
        rise=lambda r, h: -h / 4,
    ),
    "capsule": Form(
        "[radius, length]", 2, lambda r, length: algebra.pi * r**2 * (length + _ratio(4, 3) * r), _capsule_gyration,
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Inertia:
    """What several solids make together: mass [kg], centre of mass [m] and tensor about it [kg m^2], in body axes."""

    mass: algebra.Expr
    centre: Expressions
    tensor: Expressions  # xx, yy, zz, xy, xz, yz


def make_solids(
    model: Declared, table: str, shapes: Any, density: Any, planar: bool, key: str = "shape"
) -> tuple[Solid, ...]:
    """Solids from what the key `shape` says, or another `key`.

    Parameters
    ----------
    model : Declared
    table : str
        Of the body.
    shapes : mapping or sequence of mappings
        One or several.
    density : expression, optional
        Of those that have none of their own.
    planar : bool
        Whether the body is known to be planar by its `com`.
    """
    given = [shapes] if isinstance(shapes, Mapping) else shapes
    several = not isinstance(shapes, Mapping)
    if isinstance(given, str) or not isinstance(given, Sequence) or not given:
        raise model._sources.error(
            table, key, "shapes are a table, or a list of tables",
            hint=f"for example {key} = [{{ box = [1, 1, 1] }}, {{ sphere = [0.5], offset = [0, 0, 1] }}]",
        )  # fmt: skip
    common = None if density is None else model._sources.expression(density, table, "density")
    offsets = [unpacked(s.get("offset", ())) if isinstance(s, Mapping) else () for s in given]
    flat = planar or all(is_listed(x) and len(x) == 2 for x in offsets)
    return tuple(
        _solid(model, table, f"{key}[{k}]" if several else key, shape, common, flat)
        for k, shape in enumerate(given)
    )


def _solid(
    model: Declared, table: str, place: str, shape: Any, common: algebra.Expr | None, planar: bool
) -> Solid:
    sources = model._sources
    if not isinstance(shape, Mapping):
        raise sources.error(table, place, f"a shape is a table, not {shape!r:.60}", hint="{ sphere = [0.1] }")
    kinds = [key for key in shape if key not in SHAPE_KEYS]
    for key in kinds:
        if key not in FORMS:
            hint = nearest(str(key)[:60], [*FORMS, *SHAPE_KEYS], "shapes and keys")
            if key == "mesh":
                hint = "a mesh stands alone: shape = { mesh = … }"
            raise sources.error(table, f"{place}.{key!s:.60}", f"unknown shape {key!r:.60}", hint=hint)
    if len(kinds) != 1:
        message = f"a shape is one of {', '.join(FORMS)}; {len(kinds)} are given"
        raise sources.error(table, place, message, hint="write several shapes as a list of tables")
    kind, form = kinds[0], FORMS[kinds[0]]
    sizes = given_sizes(model, table, f"{place}.{kind}", kind, shape[kind])
    cut = shape.get("cut", False)
    if not isinstance(cut, bool):
        raise sources.error(table, f"{place}.cut", "'cut' is true or false", hint="cut = true makes a hole")
    for key, other in (("axis", "rpy"), ("rpy", "axis")):
        if key == "axis" and key in shape and not form.round:
            message = f"a {kind} is turned by 'rpy'; 'axis' is for shapes of revolution"
            raise sources.error(table, f"{place}.axis", message, hint="rpy = [roll, pitch, yaw]")
        if key in shape and other in shape:
            raise sources.error(table, f"{place}.{other}", "'axis' and 'rpy' both turn it", hint="give one")
    offset = model._components(shape["offset"], table, f"{place}.offset") if "offset" in shape else ()
    own = common
    if shape.get("density") is not None:
        own = sources.expression(shape["density"], table, f"{place}.density")
    axis = direction(model, table, f"{place}.axis", shape["axis"]) if "axis" in shape else ()
    rpy = roll_pitch_yaw(model, table, f"{place}.rpy", shape["rpy"]) if "rpy" in shape else ()
    return Solid(
        kind=kind,
        sizes=sizes,
        planar=planar,
        place=place,
        offset=offset,
        axis=axis,
        rpy=rpy,
        density=own,
        own_density="density" in shape,
        cut=cut,
    )


def given_sizes(model: Declared, table: str, key: str, kind: str, sizes: Any) -> Expressions:
    """The sizes of a shape, as many as its kind has."""
    form, sizes = FORMS[kind], unpacked(sizes)
    if isinstance(sizes, str) or not isinstance(sizes, Sequence) or len(sizes) != form.count:
        message = f"the sizes of a {kind} are {form.takes}"
        raise model._sources.error(table, key, message, hint="give as many numbers above zero")
    return tuple(model._sources.expression(x, table, f"{key}[{k}]") for k, x in enumerate(sizes))


def turned(solid: Solid) -> Matrix:
    """The rotation from a solid's own axes to those of the body, by rows."""
    if solid.rpy:
        return rotation(solid.rpy)
    default = X if solid.planar else Z
    axis = solid.axis or (default if FORMS[solid.kind].round else Z)
    if axis == Z:
        return tuple(tuple(map(algebra.Integer, row)) for row in ((1, 0, 0), (0, 1, 0), (0, 0, 1)))
    first = perpendicular(axis)
    columns = (first, cross(axis, first), axis)
    return tuple(tuple(_exact(column[i]) for column in columns) for i in range(3))


def _exact(x: float) -> algebra.Expr:
    return algebra.Integer(int(x)) if x == int(x) else algebra.Float(x)


def together(solids: Iterable[Solid]) -> Inertia | None:
    """Mass, centre of mass and inertia of the solids that have a density; None where none has."""
    heavy = [s for s in solids if s.density is not None]
    if not heavy:
        return None
    if heavy[0].mesh:  # stands alone
        volume, *rest = map(algebra.Float, heavy[0].holds)
        return Inertia(
            heavy[0].density * volume, tuple(rest[:3]), tuple(heavy[0].density * x for x in rest[3:])
        )
    same = all(s.density == heavy[0].density for s in heavy)
    density = heavy[0].density if same else algebra.ONE  # common to all: the centre does not depend on it
    masses = [
        (algebra.ONE if same else s.density) * FORMS[s.kind].volume(*s.sizes) * (-1 if s.cut else 1)
        for s in heavy
    ]
    turns = [turned(s) for s in heavy]
    places = [_centre(s, turn) for s, turn in zip(heavy, turns, strict=True)]
    mass = algebra.Add(*masses)
    if len(heavy) == 1 or mass.is_zero:  # of no mass at all: refused, or drawn only
        centre = places[0]
    else:
        centre = tuple(
            algebra.Add(*(m * place[i] for m, place in zip(masses, places, strict=True))) / mass
            for i in range(3)
        )
    tensor = [algebra.ZERO] * 6
    for s, m, turn, place in zip(heavy, masses, turns, places, strict=True):
        away = [a - b for a, b in zip(place, centre, strict=True)]
        squares = FORMS[s.kind].gyration(*s.sizes)
        for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
            own = algebra.Add(*(turn[i][n] * turn[j][n] * squares[n] for n in range(3)))
            if FORMS[
                s.kind
            ].round:  # two equal radii: no directions across the axis, whose rounding would show
                own = (turn[i][2] * turn[j][2]) * (squares[2] - squares[0]) + (squares[0] if i == j else 0)
            apart = -away[i] * away[j]
            if i == j:
                apart += algebra.Add(*(x**2 for x in away))
            tensor[k] += m * (own + apart)
    return Inertia(
        density * _short(mass), tuple(map(_short, centre)), tuple(density * _short(x) for x in tensor)
    )


def _short(x: algebra.Expr) -> algebra.Expr:
    """An expression of numbers alone as one number."""
    return x if x.free_symbols or x.is_Integer else _exact(float(x))


def _centre(solid: Solid, turn: Matrix) -> Expressions:
    rise = FORMS[solid.kind].rise(*solid.sizes)
    middle = (*solid.offset, *(algebra.ZERO,) * 3)[:3]
    return tuple(x + row[2] * rise for x, row in zip(middle, turn, strict=True))


def picture(solids: Sequence[Solid], from_centre: Expressions) -> Shape | None:
    """The shape that is drawn for solids, without holes.

    Parameters
    ----------
    solids : sequence of Solid
    from_centre : tuple of Expr
        Where the origin that their offsets count from lies, from the body's centre of mass.
    """
    if solids[0].mesh:
        middle = (*solids[0].offset, *(algebra.ZERO,) * 3)[:3]
        place = tuple(a + b for a, b in zip(middle, from_centre, strict=True))
        return Shape("mesh", place, solids[0].mesh)
    numbers: list[algebra.Expr] = []
    shown = [s for s in solids if not s.cut]
    for s in shown:
        turn = turned(s)
        middle = (*s.offset, *(algebra.ZERO,) * 3)[:3]
        place = [a + b for a, b in zip(middle, from_centre, strict=True)]
        numbers += [*s.sizes, *place, *(row[0] for row in turn), *(row[2] for row in turn)]
    return Shape("solids", tuple(numbers), parts=tuple(s.kind for s in shown)) if shown else None
