"""The part of the builder that closes loops: ready-made constraints between points, bodies and coordinates."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Sequence
from typing import Any

import sympy

from .assembly import Assembly
from .description import Constraint, Loop
from .joints import direction
from .names import name_fault
from .sources import Sources


class Closures(Assembly):
    """Constraints: plain expressions and ready-made ones. `symgen.model.ready_made` writes the latter out."""

    def __init__(self, sources: Sources) -> None:
        super().__init__(sources)
        self._constraints: dict[str, Constraint] = {}
        self._loops: dict[str, Loop] = {}

    def constraint(self, name: str, expression: Any) -> None:
        """Hold an expression of the coordinates and `t` at zero."""
        self._constrain("constraints", name, expression, "holonomic")

    def velocity_constraint(self, name: str, expression: Any) -> None:
        """Hold an expression that is linear in the rates at zero."""
        self._constrain("velocity_constraints", name, expression, "velocity")

    def coincident(self, name: str, a: Any, b: Any) -> None:
        """Hold two points at one place: the constraints NAME_x, NAME_y and, unless both bodies are planar, NAME_z."""
        points = tuple(self._named(name, f"coincident[{k}]", x) for k, x in enumerate((a, b)))
        self._close(name, "coincident", points=points)

    def distance(self, name: str, a: Any, b: Any, length: Any) -> None:
        """Hold two points at a distance [m]: the constraint NAME, (|a - b|^2 - length^2)/(2 length) = 0."""
        points = tuple(self._named(name, f"distance.points[{k}]", x) for k, x in enumerate((a, b)))
        self._close(name, "distance", points=points, length=self._argument(name, "distance.length", length))

    def point_on_line(
        self, name: str, point: Any, line: Any, direction: Sequence[Any], body: str | None = None
    ) -> None:
        """Hold a point on a line.

        Makes the constraints NAME_1 and, unless all is planar, NAME_2.

        Parameters
        ----------
        name : str
        point : str
            A point's name.
        line : str
            The name of a point on the line.
        direction : sequence of 2 or 3 numbers
            Of the line, fixed in `body`.
        body : str, optional
            A body or "world"; the body of the point `line` by default.
        """
        self._guide(name, "point_on_line", point, "line", line, "direction", direction, body)

    def point_in_plane(
        self, name: str, point: Any, plane: Any, normal: Sequence[Any], body: str | None = None
    ) -> None:
        """Hold a point in the plane through the point `plane` with a `normal` fixed in `body`: the constraint NAME."""
        self._guide(name, "point_in_plane", point, "plane", plane, "normal", normal, body)

    def parallel(self, name: str, bodies: Sequence[str], axes: Sequence[Sequence[Any]]) -> None:
        """Hold two axes parallel, each fixed in its body: NAME_1 and, unless both bodies are planar, NAME_2."""
        place = f"constraints.{name!s:.60}"
        pairs = [
            self._vector(x, place, f"parallel.{key}", (2,)) for key, x in (("bodies", bodies), ("axes", axes))
        ]
        named = tuple(self._named(name, f"parallel.bodies[{k}]", x) for k, x in enumerate(pairs[0]))
        units = tuple(direction(self, place, f"parallel.axes[{k}]", x) for k, x in enumerate(pairs[1]))
        self._close(name, "parallel", bodies=named, axes=units)

    def gear(self, name: str, first: Any, second: Any, ratio: Any, offset: Any = 0) -> None:
        """Couple two coordinates: the constraint NAME, first - ratio*second - offset = 0."""
        coordinates = tuple(
            self._named(name, f"gear.coordinates[{k}]", x) for k, x in enumerate((first, second))
        )
        factor = self._argument(name, "gear.ratio", ratio)
        self._close(
            name,
            "gear",
            coordinates=coordinates,
            ratio=factor,
            offset=self._argument(name, "gear.offset", offset),
        )

    def couple(self, name: str, expression: Any) -> None:
        """Hold an expression of the coordinates and `t` at zero: the constraint NAME."""
        self._close(name, "couple", expression=self._argument(name, "couple.expression", expression))

    def motion(self, name: str, coordinate: Any, follows: Any) -> None:
        """Prescribe a coordinate: the constraint NAME, coordinate - follows = 0."""
        moved = self._named(name, "motion.coordinate", coordinate)
        self._close(name, "motion", coordinate=moved, follows=self._argument(name, "motion.follows", follows))

    def _constrain(self, table: str, name: Any, expression: Any, kind: str) -> None:
        self._new_element(name, table, ChainMap(self._constraints, self._loops))
        self._constraints[name] = Constraint(name, self._sources.expression(expression, table, name), kind)

    def _close(self, name: Any, kind: str, **arguments: Any) -> None:
        self._new_element(name, "constraints", ChainMap(self._constraints, self._loops))
        self._loops[name] = Loop(name, kind, tuple(arguments.items()))

    def _argument(self, name: Any, key: str, value: Any) -> sympy.Expr:
        return self._sources.expression(value, f"constraints.{name!s:.60}", key)

    def _named(self, name: Any, key: str, value: Any) -> str:
        """The name of a point, body or coordinate; a point also as the symbols that `point` returned."""
        if isinstance(value, tuple) and len(value) == 3 and all(isinstance(x, sympy.Symbol) for x in value):
            value = value[0].name.removesuffix("_x")
        if isinstance(value, sympy.Symbol):
            value = value.name
        fault = name_fault(value, element=True)
        if fault is not None:
            raise self._sources.error(f"constraints.{name!s:.60}", key, fault, hint="name what the model has")
        return value

    def _guide(
        self, name: Any, kind: str, point: Any, base_key: str, base: Any, key: str, values: Any, body: Any
    ) -> None:
        table = f"constraints.{name!s:.60}"
        arguments = {
            "point": self._named(name, f"{kind}.point", point),
            base_key: self._named(name, f"{kind}.{base_key}", base),
            key: direction(self, table, f"{kind}.{key}", values),
        }
        if body is not None:
            arguments["body"] = self._named(name, f"{kind}.body", body)
        self._close(name, kind, **arguments)
