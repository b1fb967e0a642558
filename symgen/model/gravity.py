"""Gravity that varies: centres that attract, bodies that attract each other, a field by its potential.

The second term of the potential of a body of finite size is MacCullagh's (Danby, Fundamentals of celestial mechanics,
1988, 5.3).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

from . import algebra
from .declared import Declared
from .description import Attractor, Body, Description
from .elements import Vector, Writer
from .ready_made import HALF
from .sources import Sources
from .unevaluated import difference, inverted, negated, product, squared, total

ATTRACTOR_KEYS = ("at", "mu", "gradient")
HERE = ("here_x", "here_y", "here_z")  # in a field's potential: the place of the mass


def make_attractor(model: Declared, name: str, given: Mapping[str, Any]) -> Attractor:
    """An attractor from the arguments of `Model.attractor`."""
    table, sources = "gravity", model._sources
    for key in ("at", "mu"):
        if given.get(key) is None:
            message = f"the key '{key}' is missing"
            raise sources.error(
                table, f"attractors.{name}.{key}", message, hint="an attractor has 'at' and 'mu'"
            )
    gradient = given.get("gradient", False)
    if not isinstance(gradient, bool):
        raise sources.error(
            table, f"attractors.{name}.gradient", "'gradient' is true or false", hint="leave it out"
        )
    at = model._place(given["at"], table, f"attractors.{name}.at")
    point = (
        (model._points.get(given["at"]) or model._frames.get(given["at"]))
        if isinstance(given["at"], str)
        else None
    )
    mu = sources.expression(given["mu"], table, f"attractors.{name}.mu")
    return Attractor(name, at, mu, gradient, point.body if point is not None else None)


def check_attractors(d: Description, sources: Sources) -> None:
    """Refuse gradients that would turn planar bodies, of which one moment of inertia is known."""
    flat = next((b for b in d.bodies if b.planar and b.inertia), None)
    for attractor in d.attractors:
        if attractor.gradient and flat is not None:
            message = (
                f"a gradient of gravity turns bodies with three moments of inertia; '{flat.name}' is planar"
            )
            hint = f"leave it out, or give 'com' of '{flat.name}' a third component"
            raise sources.error("gravity", f"attractors.{attractor.name}.gradient", message, hint=hint)


def write_gravity(writer: Writer) -> list[algebra.Expr]:
    """The potential energies of gravity that is not uniform."""
    d, terms = writer.description, []
    if d.field is None and d.gravitation is None and not d.attractors:
        return terms
    heavy = [b for b in d.bodies if b.mass is not None and not b.mass.is_zero]
    masses = [(b.mass, writer.centre(b.name), b) for b in heavy]
    masses += [
        (s.mass, [product([HALF, total([x, y])]) for x, y in zip(*s.places, strict=True)], None)
        for s in d.springs
        if s.mass is not None
    ]
    for mass, place, body in masses:
        if d.field is not None:
            here = dict(zip(map(algebra.Symbol, HERE), place, strict=True))
            terms.append(product([mass, d.field.xreplace(here)]))
        for attractor in d.attractors:
            if body is None or body.name != attractor.body:
                terms.append(negated(product([attractor.mu, mass, inverted(_distance(place, attractor.at))])))
                if body is not None and attractor.gradient and body.inertia:
                    terms += _gradient(writer, body, place, attractor)
    for (m, a, first), (n, b, second) in combinations(masses, 2) if d.gravitation is not None else ():
        if first is not None and second is not None:
            terms.append(negated(product([d.gravitation, m, n, inverted(_distance(a, b))])))
    return terms


def _distance(a: Vector, b: Vector) -> algebra.Expr:
    square = total([squared(difference(x, y)) for x, y in zip(a, b, strict=True)])
    return algebra.Pow(square, HALF, evaluate=False)


def _gradient(writer: Writer, body: Body, place: Vector, attractor: Attractor) -> list[algebra.Expr]:
    """-mu/(2 r^3) (tr I - 3 u I u), with the direction u to the attractor in the body's axes."""
    apart = [difference(x, y) for x, y in zip(place, attractor.at, strict=True)]
    axes = writer.directions(body.name)
    along = [total([product(pair) for pair in zip(apart, axis, strict=True)]) for axis in axes]
    xx, yy, zz, xy, xz, yz = (*body.inertia, *(algebra.ZERO,) * 3)[:6]
    pairs = ((xx, 0, 0, 1), (yy, 1, 1, 1), (zz, 2, 2, 1), (xy, 0, 1, 2), (xz, 0, 2, 2), (yz, 1, 2, 2))
    quadratic = total([product([algebra.Integer(k), i, along[p], along[q]]) for i, p, q, k in pairs])
    distance = _distance(place, attractor.at)
    cube, fifth = (algebra.Pow(distance, -n, evaluate=False) for n in (3, 5))
    return [
        negated(product([HALF, attractor.mu, total([xx, yy, zz]), cube])),
        product([algebra.Rational(3, 2), attractor.mu, quadratic, fifth]),
    ]
