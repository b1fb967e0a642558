"""The builder of a model description: the Python face of what a TOML file says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import sympy

from ..errors import nearest
from . import bodies, drawings, run_defaults, toml_writer
from .check import finished
from .contacts import Contacts
from .description import Body, Description, Drawing, Event, Load
from .events import make_event
from .names import name_fault
from .sources import Sources

IMPACTS = ("simultaneous", "sequential")


class Model(Contacts):
    """A mechanical system, described step by step.

    Expressions are SymPy expressions of the symbols that the methods return, numbers, quantities (`"-5 N"`),
    or text as in TOML files (`"m*g*(1 - cos(theta))"`), in which names may be declared later.

    Parameters
    ----------
    name : str
        ASCII letters, digits, underscore; the generated module's name.
    description : str
        One line for people.
    gravity : sequence of 2 or 3, optional
        Acceleration of gravity (x, y, z) [m/s^2].
    folder : path, optional
        Where the model's meshes are.
    impacts : str
        What happens where several stops touch: "simultaneous", all at once, or "sequential", one after another.

    Examples
    --------
    >>> m = Model("pendulum", gravity=(0, "-9.81 m/s^2"))
    >>> theta = m.coordinate("theta", start=0.1)
    >>> mass, l = m.parameters(m="1 kg", l="0.5 m")
    >>> m.body("bob", mass=mass, com=(l * sympy.sin(theta), -l * sympy.cos(theta)))
    """

    def __init__(
        self,
        name: str,
        description: str = "",
        gravity: Sequence[Any] | None = None,
        *,
        folder: str | Path | None = None,
        impacts: str = "simultaneous",
        _file: str | None = None,
    ) -> None:
        super().__init__(Sources(_file or str(name)[:60], _file is not None))
        fault = name_fault(name, element=True)
        if fault is not None:
            raise self._sources.error("", "name", fault, hint="choose another name")
        if not isinstance(description, str):
            raise self._sources.error(
                "",
                "description",
                f"a description is text, not {description!r:.60}",
                hint="write it in quotes",
            )
        if impacts not in IMPACTS:
            hint = nearest(str(impacts)[:60], IMPACTS)
            raise self._sources.error("", "impacts", f"impacts are not {impacts!r:.60}", hint=hint)
        self.name = name
        self.description = description
        self.impacts = impacts
        self.folder = None if folder is None else Path(folder)
        self._gravity: tuple[sympy.Expr, ...] | None = None
        self._bodies: dict[str, Body] = {}
        # Terms, added up at last: SymPy sorts a sum at each +.
        self._energies: dict[str, list[sympy.Expr]] = {}
        self._forces: dict[str, list[sympy.Expr]] = {}
        self._loads: dict[str, Load] = {}
        self._events: dict[str, Event] = {}
        self._drawings: dict[str, Drawing] = {}
        self._run: dict[str, Any] = {}
        if gravity is not None:
            self.gravity(*self._vector(gravity, "gravity", "", (2, 3)))

    def gravity(self, x: Any = 0, y: Any = 0, z: Any = 0) -> None:
        """Set the acceleration of gravity.

        Parameters
        ----------
        x, y, z : expression
            In world axes [m/s^2].
        """
        if self._gravity is not None:
            raise self._sources.error("gravity", "", "gravity is set already", hint="set it once")
        self._gravity = tuple(
            self._sources.expression(value, "gravity", axis)
            for axis, value in zip("xyz", (x, y, z), strict=True)
        )

    def body(
        self,
        name: str,
        mass: Any = None,
        com: Sequence[Any] = (),
        inertia: Any = None,
        angle: Any = None,
        rotation: Sequence[tuple[str, Any]] = (),
        shape: Mapping[str, Any] | None = None,
    ) -> None:
        """Add a rigid body or point mass.

        Parameters
        ----------
        name : str
        mass : expression, optional
            [kg]; 0 for a body that is drawn only.
        com : sequence of 2 or 3
            Centre of mass in world axes [m]; 2 components: the body moves in the x-y plane.
        inertia : expression or sequence of 3 or 6, optional
            About the centre of mass [kg m^2]. Planar: about z. 3-D: Ixx, Iyy, Izz (Ixy, Ixz, Iyz) in body
            axes, elements of the tensor as in URDF.
        angle : expression, optional
            Planar: about z [rad].
        rotation : sequence of (axis, angle)
            3-D: successive body-fixed rotations about `"x"`, `"y"`, `"z"`.
        shape : mapping, optional
            What is drawn: `{"box": [x, y, z]}`, `{"sphere": [radius]}`, `{"cylinder": [radius, length]}`,
            `{"capsule": [radius, length]}`, `{"mesh": "file.stl"}`.
        """
        self._new_element(name, "bodies", self._bodies)
        self._bodies[name] = bodies.make_body(self, name, mass, com, inertia, angle, rotation, shape)

    def kinetic(self, expression: Any) -> None:
        """Add to the kinetic energy beyond that of the bodies [J]."""
        self._add("energy", "kinetic", expression, self._energies)

    def potential(self, expression: Any) -> None:
        """Add to the potential energy beyond gravity's [J]."""
        self._add("energy", "potential", expression, self._energies)

    def dissipation(self, expression: Any) -> None:
        """Add to the Rayleigh function [W]: generalised forces are minus its derivatives by the rates."""
        self._add("energy", "dissipation", expression, self._energies)

    def force(self, coordinate: sympy.Symbol | str, expression: Any) -> None:
        """Add to the generalised force on a coordinate.

        Parameters
        ----------
        coordinate : Symbol or str
        expression : expression
            [J per unit of the coordinate]
        """
        name = coordinate.name if isinstance(coordinate, sympy.Symbol) else coordinate
        if not isinstance(name, str):
            raise self._sources.error(
                "forces",
                str(name)[:60],
                "a force acts on a coordinate's symbol or name",
                hint="name one of the model's coordinates",
            )
        self._add("forces", name, expression, self._forces)

    def load(
        self,
        name: str,
        point: Sequence[Any] = (),
        force: Sequence[Any] = (),
        body: str | None = None,
        torque: Any = (),
    ) -> None:
        """Add a force at a point, or a torque on a body, both in world axes.

        Parameters
        ----------
        name : str
        point, force : sequence of 2 or 3
            Where the force acts [m], and the force [N].
        body : str
            The body that the torque acts on.
        torque : expression or sequence of 3
            [N m]; one number for a planar body.
        """
        self._new_element(name, "loads", self._loads)
        self._loads[name] = bodies.make_load(self, name, point, force, body, torque)

    def draw(self, name: str, **what: Any) -> None:
        """Draw something besides bodies and joints in recordings; it does nothing to the motion.

        Parameters
        ----------
        name : str
        **what
            One of `spring`, `damper`, `bar`, `rail` (a line on the ground) with two places, `pin`, `ground` (a
            support) with one, `force` with a place and a force [N]. A place is a point's name, or two or three
            components in world axes [m].

        Examples
        --------
        >>> model.draw("strut", spring=[(0, z_wheel), (0, z_body)])
        >>> model.draw("push", force=[(x, 0), (F, 0)])
        """
        self._new_element(name, "draw", self._drawings)
        self._drawings[name] = drawings.make_drawing(self, name, what)

    def event(self, name: str, when: Any, direction: str = "both", then: Any = "record") -> None:
        """Act when an expression crosses zero.

        Parameters
        ----------
        name : str
        when : expression
        direction : {"both", "rising", "falling"}
        then : {"record", "terminate"} or dict
            `{"reset": {"dot(x)": -e*dot(x)}}` sets coordinates and rates from their values before.
        """
        self._new_element(name, "events", self._events)
        self._events[name] = make_event(self._sources, name, when, direction, then)

    def run(self, **defaults: Any) -> None:
        """Set defaults for runs: t_end, method, constraints, rtol, atol, step, max_step, fps, at, breaks."""
        for key, value in defaults.items():
            self._run[key] = run_defaults.checked(self._sources, key, value)

    def describe(self) -> Description:
        """The finished description, checked.

        Raises
        ------
        ModelError
            For the first thing that is wrong with the model.
        """
        return finished(self._description(), self._sources, self._kinds)

    def to_toml(self) -> str:
        """The model as the text of a TOML file."""
        self.describe()
        return toml_writer.write(self._description(), self._sources)

    def _description(self) -> Description:
        held = list(self._constraints.values())
        return Description(
            name=self.name,
            description=self.description,
            coordinates=self._all_coordinates(),
            parameters=tuple(self._parameters),
            constants=tuple(self._constants),
            inputs=tuple(self._inputs),
            definitions=tuple(self._definitions),
            bodies=tuple(self._bodies.values()),
            gravity=self._gravity,
            **{key: sympy.Add(*terms) for key, terms in self._energies.items()},
            forces=tuple((name, sympy.Add(*terms)) for name, terms in self._forces.items()),
            loads=tuple(self._loads.values()),
            constraints=tuple(c for c in held if c.kind == "holonomic"),
            velocity_constraints=tuple(c for c in held if c.kind == "velocity"),
            outputs=tuple(self._outputs),
            events=tuple(self._events.values()),
            run=MappingProxyType(dict(self._run)),
            folder=self.folder,
            rates=self._all_rates(),
            joints=tuple(self._joints.values()),
            points=tuple(self._points.values()),
            axes=tuple(self._axes.values()),
            loops=tuple(self._loops.values()),
            drawings=tuple(self._drawings.values()),
            impacts=self.impacts,
            **self._touching(),
        )

    def _add(self, table: str, key: str, expression: Any, into: dict[str, list[sympy.Expr]]) -> None:
        into.setdefault(key, []).append(self._sources.expression(expression, table, key))
