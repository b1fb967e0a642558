"""The part of the builder that puts bodies together: joints, points and axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy

from .declarations import Declarations
from .description import Axis, Coordinate, Point, Rate, plain_rate
from .joints import make_joint
from .names import name_fault


class Assembly(Declarations):
    """Joints, points and axes, and the names that they make."""

    def joint(
        self,
        name: str,
        type: str | None = None,
        child: str | None = None,
        parent: str = "world",
        origin: Mapping[str, Sequence[Any]] | None = None,
        axis: Sequence[Any] | None = None,
        axis2: Sequence[Any] | None = None,
        coordinate: sympy.Symbol | str | Sequence[sympy.Symbol | str] | None = None,
        start: Any = None,
        rate: Any = None,
        guess: Any = None,
        rate_guess: Any = None,
        unit: str | None = None,
        stiffness: Any = None,
        damping: Any = None,
        rest: Any = None,
        armature: Any = None,
        limits: Sequence[Any] | None = None,
        restitution: Any = None,
        pitch: Any = None,
    ) -> Any:
        """Join a body to its parent, as URDF does; the body's `com` is then in the body's own frame.

        Parameters
        ----------
        name : str
        type : str
            revolute, continuous, prismatic, screw, universal, cylindrical, planar, spherical, free or fixed.
        child : str
            The body that the joint places.
        parent : str
            A body or "world".
        origin : mapping, optional
            The joint frame in the parent's frame: `{"xyz": [x, y, z], "rpy": [roll, pitch, yaw]}` [m, rad], of
            parameters and constants. The rotation is Rz(yaw) Ry(pitch) Rx(roll).
        axis, axis2 : sequence of 3, optional
            In the joint frame, of any length; x by default, z for planar bodies. `axis2` belongs to universal joints
            and turns with the first rotation; by default it is perpendicular to `axis`.
        coordinate : name or sequence of names, optional
            Of its coordinates, declared ones or new; made from the joint's name by default: NAME for one coordinate,
            NAME_1, NAME_2 (universal), NAME_angle, NAME_slide (cylindrical), NAME_x, NAME_y, NAME_angle (planar),
            NAME_qw … NAME_qz (spherical), NAME_x, NAME_y, NAME_z and the same four (free).
        start, rate, guess, rate_guess : number, or sequence of one for each coordinate (rate)
            As those of coordinates. Rates of a spherical joint are the angular velocity NAME_wx, NAME_wy, NAME_wz in
            the child's axes; a free joint has NAME_vx, NAME_vy, NAME_vz before them, in the axes of the joint frame.
        unit : str, optional
            Of numbers in `start`, `rate`, `guess`, `rate_guess` of a joint with one coordinate.
        stiffness, damping, rest, armature : expression, or sequence of one for each coordinate
            Adds stiffness*(q - rest)^2/2 to the potential, damping*qdot^2/2 to the dissipation and
            armature*qdot^2/2 to the kinetic energy. Spherical and free joints have damping only, of their rates.
        limits : sequence of 2, optional
            Recorded as the events NAME_lower and NAME_upper. Nothing holds the joint there without a restitution.
        restitution : expression, optional
            Makes the limits the stops NAME_lower and NAME_upper, with this coefficient (0 to 1).
        pitch : expression
            Of a screw joint only: how far the child slides along the axis by a whole turn [m], as a right-handed thread
            does; negative for a left-handed one.

        Returns
        -------
        sympy.Symbol or tuple of them
            Its coordinates; one symbol where it has one.
        """
        self._new_element(name, "joints", self._joints)
        options = dict(
            origin=origin, axis=axis, axis2=axis2, coordinate=coordinate, start=start, rate=rate, guess=guess,
            rate_guess=rate_guess, unit=unit, stiffness=stiffness, damping=damping, rest=rest, armature=armature,
            limits=limits, restitution=restitution, pitch=pitch,
        )  # fmt: skip
        made = make_joint(self, name, type, parent, child, options)
        self._joints[name] = made
        symbols = tuple(map(sympy.Symbol, made.coordinates))
        return symbols[0] if len(symbols) == 1 else symbols

    def point(
        self, name: str, body: str = "world", at: Sequence[Any] = (0, 0, 0)
    ) -> tuple[sympy.Symbol, ...]:
        """Name a point that is fixed in a body; expressions use its world coordinates NAME_x, NAME_y, NAME_z.

        Parameters
        ----------
        name : str
        body : str
            A body or "world".
        at : sequence of 2 or 3
            In the body's frame [m], of parameters and constants. The frame of a body that no joint places stands at
            its centre of mass and turns with `angle` or `rotation`.

        Returns
        -------
        tuple of sympy.Symbol
            NAME_x, NAME_y, NAME_z.
        """
        place = self._fixed_vector("points", "point", name, body, self._points, at, "at")
        self._points[name] = Point(name, body, place)
        return self._world_components(name)

    def axis(self, name: str, body: str = "world", direction: Sequence[Any] = ()) -> tuple[sympy.Symbol, ...]:
        """Name a vector that is fixed in a body; expressions use its world components NAME_x, NAME_y, NAME_z.

        Parameters
        ----------
        name : str
        body : str
            A body or "world".
        direction : sequence of 2 or 3
            Its components in the body's axes, of parameters and constants; the length is kept.

        Returns
        -------
        tuple of sympy.Symbol
            NAME_x, NAME_y, NAME_z.
        """
        vector = self._fixed_vector("axes", "axis", name, body, self._axes, direction, "direction")
        self._axes[name] = Axis(name, body, vector)
        return self._world_components(name)

    def _fixed_vector(
        self, table: str, what: str, name: Any, body: Any, taken: Mapping[str, Any], values: Any, key: str
    ) -> tuple[sympy.Expr, ...]:
        self._new_element(name, table, taken)
        place = f"{table}.{name}"
        if name_fault(body, element=True) is not None:
            raise self._sources.error(
                place,
                "body",
                f"'body' is a body's name or \"world\", not {body!r:.60}",
                hint="write it in quotes",
            )
        for component in "xyz":
            self._declare_made(f"{name}_{component}", f"{what} component", place, what)
        return self._components(values, place, key)

    @staticmethod
    def _world_components(name: str) -> tuple[sympy.Symbol, ...]:
        return tuple(sympy.Symbol(f"{name}_{component}") for component in "xyz")

    def _all_coordinates(self) -> tuple[Coordinate, ...]:
        """The order of q: coordinates as they are declared, then those that joints made."""
        return (*self._coordinates, *self._made)

    def _all_rates(self) -> tuple[Rate, ...]:
        """The order of v: that of q, with a joint's angular velocities where its quaternion stands."""
        rates: list[Rate] = []
        for c in self._all_coordinates():
            own = self._made_rates.get(c.joint, ())
            if c.quaternion is None:
                named = [r for r in own if r.coordinate == c.name]
                rates += named or [plain_rate(c)]
            elif c.name == self._joints[c.joint].coordinates[-4]:
                rates += [r for r in own if r.coordinate is None]
        return tuple(rates)
