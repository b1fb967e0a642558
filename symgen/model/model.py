"""The builder of a model description: the Python face of what a TOML file says."""

from __future__ import annotations

import copy
import functools
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from symgen.runtime.lazy import Late

from ..errors import nearest
from . import algebra, assemblies, parts, run_defaults, toml_writer
from .assemblies import check_uses
from .check import finished, with_definitions_in_order
from .closures import make_closure
from .contact_laws import bristle_laws
from .contact_pairs import make_pair
from .curves import TableFunction, make_table
from .declared import Declared
from .description import (
    Attractor,
    Axis,
    Body,
    Bristle,
    Bushing,
    Closure,
    Constant,
    Constraint,
    Contact,
    ContactPair,
    Coordinate,
    Description,
    Drawing,
    Event,
    Friction,
    Input,
    Load,
    Loop,
    Parameter,
    Point,
    Port,
    Rate,
    Rolling,
    Rotor,
    Spring,
    StartConditions,
    State,
    Stop,
    Use,
    plain_rate,
)
from .elements import make_bushing, make_spring, measures
from .expression_tree import names_in
from .frames import make_frame
from .functions import dot
from .given import given_name, is_symbol
from .gravity import make_attractor
from .joints import direction as unit_vector
from .joints import make_joint
from .names import integral_name, model_name_fault, reference_fault
from .over_time import read_over_time
from .rolling import make_rolling
from .rotors import make_rotor
from .shelf import Shelf
from .sources import Sources
from .starts import make_start, together
from .tyres import Tyre, add_tyre, without_made, without_pushes

if TYPE_CHECKING:
    from typing import Self

    import sympy

    from .values_of_runs import ValuesOfRuns

values_of_runs = Late("symgen.model.values_of_runs")

IMPACTS = ("simultaneous", "sequential")


class Model(Declared):
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

    # What users get of a name that they declare: SymPy's symbol in the Python interface.
    _symbol: Callable[[str], Any] = staticmethod(algebra.Symbol)

    def __init__(
        self,
        name: str,
        description: str = "",
        gravity: Sequence[Any] | None = None,
        *,
        folder: str | Path | None = None,
        impacts: str = "simultaneous",
        _file: str | None = None,
        _assembly: str = "",
    ) -> None:
        super().__init__(Sources(_file or str(name)[:60], _file is not None, _assembly))
        fault = model_name_fault(name)
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
        self._gravity: tuple[algebra.Expr, ...] | None = None
        self._field: algebra.Expr | None = None
        self._gravitation: algebra.Expr | None = None
        self._attractors: dict[str, Attractor] = {}
        self._bodies: dict[str, Body] = {}
        # Terms, added up at last: a sum is sorted at each +.
        self._energies: dict[str, list[algebra.Expr]] = {}
        self._forces: dict[str, list[algebra.Expr]] = {}
        self._loads: dict[str, Load] = {}
        self._springs: dict[str, Spring] = {}
        self._bushings: dict[str, Bushing] = {}
        self._rolling: dict[str, Rolling] = {}
        self._closures: dict[str, Closure] = {}
        self._rotors: dict[str, Rotor] = {}
        self._constraints: dict[str, Constraint] = {}
        self._loops: dict[str, Loop] = {}
        self._stops: dict[str, Stop] = {}
        self._frictions: dict[str, Friction] = {}
        self._bristles: dict[str, Bristle] = {}
        self._tyres: dict[str, Tyre] = {}
        self._contacts: dict[str, Contact] = {}
        self._pairs: dict[str, ContactPair] = {}
        self._events: dict[str, Event] = {}
        self._drawings: dict[str, Drawing] = {}
        self._run: dict[str, Any] = {}
        self._ports: dict[str, Port] = {}
        self._shelf = Shelf()
        self._aliases: dict[str, algebra.Symbol] = {}  # what uses of assemblies call the model's own names
        self._inner_uses: list[Use] = []  # those inside of assemblies
        self._used_energies: dict[str, list[algebra.Expr]] = {}
        self._used_forces: dict[str, list[algebra.Expr]] = {}
        self._used_starts: list[StartConditions] = []
        self._placed: dict[str, str] = {}  # bodies by hand that a use places
        self._start: StartConditions | None = None
        if gravity is not None:
            self.gravity(*self._vector(gravity, "gravity", "", (2, 3)))

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """While nobody but the model itself takes the symbols that its methods return, as where a file is read."""
        before = self.__dict__.get("_symbol")
        self._symbol = algebra.Symbol
        try:
            yield
        finally:
            if before is None:
                del self._symbol
            else:
                self._symbol = before

    def in_text(self) -> Self:
        """Let methods return names as text from here on, where they return symbols of SymPy else; returns the model.

        A model whose expressions are all text needs no SymPy, whose import takes longer than deriving most models.

        Examples
        --------
        >>> m = Model("pendulum", gravity=(0, "-9.81 m/s^2")).in_text()
        >>> theta = m.coordinate("theta", start=0.1)
        >>> mass, l = m.parameters(m="1 kg", l="0.5 m")
        >>> m.body("bob", mass=mass, com=(f"{l}*sin({theta})", f"-{l}*cos({theta})"))
        """
        self._symbol = str
        return self

    def coordinate(
        self,
        name: str,
        unit: str | None = None,
        start: Any = None,
        rate: Any = None,
        guess: Any = 0.0,
        rate_guess: Any = 0.0,
    ) -> sympy.Symbol:
        """Declare a generalised coordinate; the order of declaration is the order of q.

        Parameters
        ----------
        name : str
        unit : str, optional
            Numbers among the other arguments are in this unit (rates: per second); equations are in SI units.
        start, rate : float or str, optional
            Initial value and rate, which the assembly of initial conditions keeps.
        guess, rate_guess : float or str
            Initial value and rate that assembly may move; where `start` or `rate` is not given.
        """
        self._declare(name, "coordinate", "coordinates")
        size = self._sources.unit(unit, "coordinates", f"{name}.unit")
        numbers = {"start": start, "guess": guess, "rate": rate, "rate_guess": rate_guess}
        values, size = self._initial("coordinates", f"{name}.{{}}", size, numbers)
        self._coordinates.append(Coordinate(name, None if size is None else size.coherent, **values))
        return self._symbol(name)

    def state(
        self,
        name: str,
        derivative: Any = None,
        start: Any = None,
        unit: str | None = None,
        guess: Any = None,
    ) -> sympy.Symbol:
        """Declare a first-order state: of an actuator, a filter, a controller, a current, a bristle of friction.

        Parameters
        ----------
        name : str
        derivative : expression
            By time [unit/s], of coordinates, rates, inputs, parameters, `t`, other states and itself.
        start : float, str or expression of parameters
            Its value where the run begins; 0 by default.
        unit : str, optional
            Numbers for `start` and `guess` are in it.
        guess : float, str or expression of parameters, optional
            Instead of `start`: a value that what `start` of the model says may move.
        """
        self._declare(name, "state", "states")
        self._declare_made(integral_name(name), "integral", f"states.{name}", "state")
        size = self._sources.unit(unit, "states", f"{name}.unit")
        values, size = self._initial("states", f"{name}.{{}}", size, {"start": start, "guess": guess})
        expression = self._required("states", f"{name}.derivative", derivative)
        self._states.append(State(name, expression, start is not None))
        coherent = None if size is None else size.coherent
        integrated = None if coherent is None else f"({coherent})*s"
        self._integrals.append(Coordinate(integral_name(name), integrated, integral=True))
        enforced = values.get("start") if start is not None or guess is not None else 0.0
        moved, formula = values.get("guess", 0.0), values.get("formula")
        self._state_rates.append(
            Rate(name, coherent, enforced, moved, integral_name(name), formula, state=True)
        )
        return self._symbol(name)

    def table(
        self,
        name: str,
        columns: Sequence[Sequence[float]] | None = None,
        file: str | None = None,
        kind: str = "linear",
        outside: str = "refuse",
        units: Sequence[str] | None = None,
    ) -> TableFunction:
        """Declare a function that numbers make: a curve of one argument, a map of two.

        Parameters
        ----------
        name : str
            Expressions write NAME(x) or NAME(x, y), and NAME_integral(x) for the integral of a curve from its first
            argument on.
        columns : sequence of 2 or 3 sequences, optional
            Arguments, then values. Those of a curve ascend; a map has a value for each first argument with each second
            one, in any order.
        file : str, optional
            A file below the model's folder with these columns instead.
        kind : {"linear", "pchip", "cubic", "bicubic"}
            How it goes between its points: straight, by cubics that keep monotone data monotone, by a cubic spline
            (of maps: its product).
        outside : {"refuse", "hold", "extend"}
            Beyond its ends: the run ends, the last value stays, it goes on straight.
        units : sequence of str, optional
            Of the columns.

        Returns
        -------
        TableFunction
            To be called with expressions; `integral` is a method of it.
        """
        self._declare(name, "table", "tables")
        given = {"columns": columns, "file": file, "kind": kind, "outside": outside, "units": units}
        made = make_table(self, name, given)
        self._tables.append(made)
        self._sources.tables[name] = len(made.axes)
        if len(made.axes) == 1:
            self._declare_made(f"{name}_integral", "table", f"tables.{name}", "table")
            self._sources.tables[f"{name}_integral"] = 1
        return TableFunction(made)

    def parameter(self, name: str, value: Any, doc: str = "", unit: str | None = None) -> sympy.Symbol:
        """Declare a number that can be set for each run.

        Parameters
        ----------
        name : str
        value : float, str or dict
            A number, a quantity such as `"9.81 m/s^2"`, or `{"value": 9.81, "unit": "m/s^2", "doc": "…"}`.
        doc : str
            What it is.
        unit : str, optional
            Of a value that is a number.
        """
        self._declare(name, "parameter", "parameters")
        value, unit, doc = self._unpacked("parameters", name, value, unit, doc)
        si, size = self._number("parameters", name, value, unit)
        self._parameters.append(Parameter(name, si, size and size.coherent, doc))
        return self._symbol(name)

    def parameters(self, **values: Any) -> Any:
        """Declare several parameters; returns their symbols in order, or the symbol if there is only one."""
        return _one_or_all([self.parameter(name, value) for name, value in values.items()])

    def constant(self, name: str, value: Any, unit: str | None = None) -> sympy.Symbol:
        """Declare a number that is folded into the derived code: a number, a quantity or a table."""
        self._declare(name, "constant", "constants")
        value, unit, _ = self._unpacked("constants", name, value, unit, "")
        si, size = self._number("constants", name, value, unit)
        self._constants.append(Constant(name, si, size and size.coherent))
        return self._symbol(name)

    def constants(self, **values: Any) -> Any:
        """Declare several constants; returns their symbols in order, or the symbol if there is only one."""
        return _one_or_all([self.constant(name, value) for name, value in values.items()])

    def input(
        self,
        name: str,
        unit: str | None = None,
        default: Any = 0.0,
        *,
        table: Any = None,
        kind: str | None = None,
        polynomial: Any = None,
    ) -> sympy.Symbol:
        """Declare a control input: a constant, unless the model or a run says what it does over time.

        Parameters
        ----------
        name : str
        unit : str, optional
            Numbers for `default`, values of `table` and coefficients are in it.
        default : float or str
            The constant.
        table : pair of sequences, or str, optional
            Times [s] and values; or a file below the model's folder with these as columns.
        kind : {"linear", "cubic", "hold"}, optional
            What the table does between its times; linear by default.
        polynomial : sequence of float, optional
            Coefficients of powers of t, from the constant upward.
        """
        self._declare(name, "input", "inputs")
        size = self._sources.unit(unit, "inputs", f"{name}.unit")
        value, size = self._sources.number(default, size, "inputs", f"{name}.default")
        over_time = read_over_time(self, name, size, table, kind, polynomial)
        self._inputs.append(Input(name, size and size.coherent, value, **over_time))
        return self._symbol(name)

    def definition(self, name: str, expression: Any) -> sympy.Symbol:
        """Name an expression; later expressions share it through the symbol."""
        self._declare(name, "definition", "definitions")
        self._definitions.append((name, self._sources.expression(expression, "definitions", name)))
        return self._symbol(name)

    def output(self, name: str, expression: Any) -> None:
        """Declare a sensor: an expression that is computed, logged and plotted."""
        self._declare(name, "output", "outputs")
        self._outputs.append((name, self._sources.expression(expression, "outputs", name)))

    def gravity(
        self, x: Any = 0, y: Any = 0, z: Any = 0, potential: Any = None, constant: Any = None
    ) -> None:
        """Set the acceleration of gravity, or a field of it.

        Parameters
        ----------
        x, y, z : expression
            In world axes [m/s^2].
        potential : expression, optional
            Of a field: energy per mass [m^2/s^2] at the place `here_x`, `here_y`, `here_z` of a mass; of coordinates
            and `t`, too.
        constant : expression, optional
            The constant of gravitation with which all bodies attract each other [m^3/(kg s^2)].
        """
        if self._gravity is not None or self._field is not None or self._gravitation is not None:
            raise self._sources.error("gravity", "", "gravity is set already", hint="set it once")
        if potential is not None:
            self._field = self._sources.expression(potential, "gravity", "potential")
        if constant is not None:
            self._gravitation = self._sources.expression(constant, "gravity", "constant")
        if (potential is not None or constant is not None) and all(
            isinstance(value, int) and value == 0 for value in (x, y, z)
        ):
            return
        self._gravity = tuple(
            self._sources.expression(value, "gravity", axis)
            for axis, value in zip("xyz", (x, y, z), strict=True)
        )

    def attractor(self, name: str, at: Any = None, mu: Any = None, gradient: bool = False) -> None:
        """Add a centre of gravity that pulls every mass with mu/r^2 towards it.

        Parameters
        ----------
        name : str
        at : str or sequence of 2 or 3
            A point's name, or components in world axes [m]. The body of that point is not attracted by itself.
        mu : expression
            Constant of gravitation times its mass [m^3/s^2].
        gradient : bool
            Whether it turns bodies, too: to the second order of their size over its distance.
        """
        self._new_element(name, "gravity", self._attractors)
        given = {"at": at, "mu": mu, "gradient": gradient}
        self._attractors[name] = make_attractor(self, name, given)

    def body(
        self,
        name: str,
        mass: Any = None,
        com: Sequence[Any] = (),
        inertia: Any = None,
        angle: Any = None,
        rotation: Sequence[tuple[str, Any]] = (),
        shape: Mapping[str, Any] | Sequence[Mapping[str, Any]] | str | None = None,
        density: Any = None,
    ) -> None:
        """Add a rigid body or point mass.

        Parameters
        ----------
        name : str
        mass : expression, optional
            [kg]; 0 for a body that is drawn only.
        com : sequence of 2 or 3
            Centre of mass in world axes [m]; 2 components: the body moves in the x-y plane. Shapes with a density have
            theirs there.
        inertia : expression or sequence of 3 or 6, optional
            About the centre of mass [kg m^2]. Planar: about z. 3-D: Ixx, Iyy, Izz (Ixy, Ixz, Iyz) in body
            axes, elements of the tensor as in URDF.
        angle : expression, optional
            Planar: about z [rad].
        rotation : sequence of (axis, angle)
            3-D: successive body-fixed rotations about `"x"`, `"y"`, `"z"`.
        shape : mapping, sequence of mappings or "none", optional
            What is drawn, "none" for nothing: `{"box": [x, y, z]}`, `{"sphere": [radius]}`, `{"cylinder": [radius,
            length]}`, `{"capsule": [radius, length]}`, `{"tube": [outer radius, inner radius, length]}`, `{"cone":
            [radius, height]}`, `{"ellipsoid": [x, y, z]}`, `{"mesh": "file.stl"}`. All but the last may have the
            `offset` of their middle [m], an `axis` or `rpy` [rad], a `density`, and `cut`: True for a hole.
        density : expression, optional
            Of shapes that have none of their own [kg/m^3]: mass, inertia and, of a joint's child, `com` follow from it.
        """
        self._new_element(name, "bodies", self._bodies)
        self._bodies[name] = parts.make_body(self, name, mass, com, inertia, angle, rotation, shape, density)

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
        sequence: str | None = None,
    ) -> Any:
        """Join a body to its parent, as URDF does; the body's `com` is then in the body's own frame.

        Parameters
        ----------
        name : str
        type : str
            revolute, continuous, prismatic, screw, universal, cylindrical, planar, spherical, free, gimbal, floating or
            fixed.
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
            NAME_qw … NAME_qz (spherical), NAME_x, NAME_y, NAME_z and the same four (free), NAME_1, NAME_2, NAME_3
            (gimbal), NAME_x, NAME_y, NAME_z and the same three (floating).
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
        sequence : str
            Of a gimbal and what floats only: the axes of its successive rotations, each in the frame that those before
            have left: "zxz", "zyx". Their angles take the place of a quaternion; where the middle one folds the others
            onto one axis (0 for "zxz", a quarter turn for "zyx"), the equations have no solution.

        Returns
        -------
        sympy.Symbol or tuple of them
            Its coordinates; one symbol where it has one.
        """
        self._new_element(name, "joints", self._joints)
        if isinstance(child, str) and child in self._placed:
            message = f"the body '{child}' stands where '{self._placed[child]}' is placed"
            hint = "give that use no place, or join the body in its assembly"
            raise self._sources.error(f"joints.{name}", "child", message, hint=hint)
        options = dict(
            origin=origin, axis=axis, axis2=axis2, coordinate=coordinate, start=start, rate=rate, guess=guess,
            rate_guess=rate_guess, unit=unit, stiffness=stiffness, damping=damping, rest=rest, armature=armature,
            limits=limits, restitution=restitution, pitch=pitch, sequence=sequence,
        )  # fmt: skip
        made = make_joint(self, name, type, parent, child, options)
        self._joints[name] = made
        symbols = tuple(map(self._symbol, made.coordinates))
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

    def frame(
        self,
        name: str,
        body: str = "world",
        at: Sequence[Any] = (0, 0, 0),
        rpy: Sequence[Any] | None = None,
        axis: Sequence[Any] | None = None,
        angle: Any = None,
        quaternion: Sequence[Any] | None = None,
        x: str | Sequence[Any] | None = None,
        y: str | Sequence[Any] | None = None,
    ) -> tuple[sympy.Symbol, ...]:
        """Name a frame that is fixed in a body: joints, loads and bushings use it, and its origin is a point.

        Its orientation in the body is given in one way; without any it has the body's axes.

        Parameters
        ----------
        name : str
        body : str
            A body or "world".
        at : sequence of 2 or 3
            Its origin in the body's frame [m], of parameters and constants.
        rpy : sequence of 3, optional
            Roll, pitch, yaw [rad], as in joints.
        axis, angle : sequence of 3, expression
            A direction of numbers and constants, and how far it is turned about it [rad].
        quaternion : sequence of 4
            w, x, y, z of numbers and constants.
        x, y : str or sequence of 2 or 3
            Where its x axis points to, and (as nearly as can be) its y axis: a direction of numbers and constants, or
            the name of a point of the same body.

        Returns
        -------
        tuple of sympy.Symbol
            NAME_x, NAME_y, NAME_z: world coordinates of the origin.
        """
        place = self._fixed_vector("frames", "frame", name, body, self._frames, at, "at")
        given = {"rpy": rpy, "axis": axis, "angle": angle, "quaternion": quaternion, "x": x, "y": y}
        self._frames[name] = make_frame(self, name, body, place, given)
        return self._world_components(name)

    def rotor(
        self,
        name: str,
        inertia: Any = None,
        body: str = "world",
        axis: Sequence[Any] | None = None,
        angle: Any = None,
        gyroscopic: bool = True,
        at: Sequence[Any] | None = None,
        start: Any = None,
        rate: Any = None,
        guess: Any = None,
        rate_guess: Any = None,
        unit: str | None = None,
    ) -> sympy.Symbol | None:
        """Add an inertia that spins in a body, without a body and a joint of its own.

        Its mass, and its inertia across the axis, belong to the body.

        Parameters
        ----------
        name : str
        inertia : expression
            About its axis [kg m^2]; of parameters and constants.
        body : str
            A body, or "world" for drives on ground.
        axis : sequence of 3, optional
            In the body's axes, of any length; z by default.
        angle : expression, optional
            By which it is turned in the body [rad], such as "50*knee" for a motor with a gear; of coordinates and `t`.
            By default it is a coordinate of its own, which is called as the rotor is; forces on that act between the
            rotor and the body.
        gyroscopic : bool
            Whether the body's own turning adds to its spin, and so the body feels its momentum.
        at : sequence of 2 or 3, optional
            Where a picture shows it, in the body's frame [m]; the centre of mass by default.
        start, rate, guess, rate_guess, unit
            Of its coordinate, as in `coordinate`.

        Returns
        -------
        sympy.Symbol or None
            Its coordinate, if it has one.
        """
        given = {
            "inertia": inertia, "body": body, "axis": axis, "angle": angle, "gyroscopic": gyroscopic, "at": at,
            "start": start, "rate": rate, "guess": guess, "rate_guess": rate_guess, "unit": unit,
        }  # fmt: skip
        self._new_element(name, "rotors", ChainMap(self._rotors, self._closures, self._joints))
        self._rotors[name] = make_rotor(self, name, given)
        return self._symbol(name) if angle is None else None

    def spring(
        self,
        name: str,
        points: Sequence[Any] | None = None,
        angle: Any = None,
        stiffness: Any = None,
        length: Any = None,
        rest: Any = None,
        damping: Any = None,
        preload: Any = None,
        mass: Any = None,
        acts: str | None = None,
        curve: Any = None,
    ) -> tuple[sympy.Symbol, sympy.Symbol]:
        """Add a spring, a damper or both between two points, or of an angle; it is drawn where it is.

        Parameters
        ----------
        name : str
        points : sequence of 2
            Names of points, or two or three components in world axes [m].
        angle : expression
            In their place: an angle between bodies [rad], such as "phi2 - phi1".
        stiffness, damping : expression, optional
            [N/m], [N s/m]; of angles [N m], [N m s]. Of parameters and constants.
        length : expression
            At which a spring between points is at rest [m]; of coordinates and t, too.
        rest : expression, optional
            The same of an angle, 0 by default [rad].
        preload : expression, optional
            Force with which it pulls at rest [N], or torque [N m].
        mass : expression, optional
            Spread evenly between the points [kg].
        acts : {"both", "pull", "push"}, optional
            "pull" is a rope or a belt, which goes slack where it is shorter than `length`; "push" a buffer.
        curve : str or TableFunction, optional
            A table of one argument in place of a stiffness: the force [N] with which it pulls where it is longer than
            `length` by so much [m], below zero where it pushes; of an angle the torque [N m] over [rad].

        Returns
        -------
        tuple of sympy.Symbol
            NAME_length and NAME_force, with which it pulls; of an angle NAME_angle and NAME_torque.
        """
        given = dict(
            points=points, angle=angle, stiffness=stiffness, length=length, rest=rest, damping=damping,
            preload=preload, mass=mass, acts=acts, curve=curve,
        )  # fmt: skip
        self._new_element(name, "springs", self._springs)
        made = self._springs[name] = make_spring(self, name, given)
        for defined in (made.measured, made.exerted):
            self._declare_made(defined, "definition", f"springs.{name}", "spring")
        return self._symbol(made.measured), self._symbol(made.exerted)

    def bushing(
        self,
        name: str,
        frames: Sequence[str] | None = None,
        stiffness: Sequence[Any] | None = None,
        damping: Sequence[Any] | None = None,
    ) -> None:
        """Add an elastic joint between two frames, at rest where they are one.

        Parameters
        ----------
        name : str
        frames : sequence of 2
            Names of frames, of bodies (the body's frame), or "world"; displacements are along the axes of the first.
        stiffness, damping : sequence of 6 or 3
            Along x, y, z [N/m, N s/m] and about x, y, z [N m, N m s]; between planar bodies along x and y, and about z.
            Angles are those of successive rotations about x, y, z, below 90 degrees about y.
        """
        self._new_element(name, "bushings", self._bushings)
        given = {"frames": frames, "stiffness": stiffness, "damping": damping}
        self._bushings[name] = make_bushing(self, name, given)

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
        name = given_name(coordinate)
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
        frame: str | None = None,
        reaction: str | None = None,
    ) -> None:
        """Add a force at a point, or a torque on a body.

        Parameters
        ----------
        name : str
        point, force : str or sequence of 2 or 3, sequence of 2 or 3
            Where the force acts (a point's name, or components in world axes [m]), and the force [N].
        body : str
            The body that the torque acts on.
        torque : expression or sequence of 3
            [N m]; one number for a planar body.
        frame : str, optional
            A frame or body in whose axes force or torque are given; world axes without it.
        reaction : str, optional
            A body on which the opposite acts, at the same place.
        """
        self._new_element(name, "loads", self._loads)
        self._loads[name] = parts.make_load(self, name, point, force, body, torque, frame, reaction)

    def constraint(self, name: str, expression: Any) -> None:
        """Hold an expression of the coordinates and `t` at zero."""
        self._constrain("constraints", name, expression, "holonomic")

    def velocity_constraint(self, name: str, expression: Any) -> None:
        """Hold an expression of rates at zero; what it bears acts along its derivatives by the rates."""
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
        units = tuple(unit_vector(self, place, f"parallel.axes[{k}]", x) for k, x in enumerate(pairs[1]))
        self._close(name, "parallel", bodies=named, axes=units)

    def gear(
        self,
        name: str,
        first: Any,
        second: Any,
        ratio: Any = None,
        offset: Any = 0,
        teeth: Sequence[Any] | None = None,
        efficiency: Any = None,
    ) -> None:
        """Couple two coordinates: the constraint NAME, first - ratio*second - offset = 0.

        Parameters
        ----------
        name : str
        first, second : Symbol or str
            Coordinates.
        ratio, offset : expression
        teeth : sequence of 2
            In the place of `ratio`: of wheels that mesh from outside, ratio = -teeth[1]/teeth[0]; a ring has a negative
            number of them.
        efficiency : expression, optional
            What arrives where `first` drives, 0 to 1: dry friction NAME in proportion to the force of the mesh. Below
            one half, as of worms, `second` cannot drive.
        """
        if (ratio is None) == (teeth is None):
            message = "a gear has a 'ratio', or 'teeth' of both wheels"
            raise self._sources.error(
                f"constraints.{name!s:.60}", "gear", message, hint="give one of the two"
            )
        arguments: dict[str, Any] = {"coordinates": self._shafts(name, "gear.coordinates", (first, second))}
        if teeth is None:
            arguments["ratio"] = self._argument(name, "gear.ratio", ratio)
        else:
            arguments["teeth"] = self._pair(name, "gear.teeth", teeth)
        self._couple_shafts(name, "gear", arguments, offset, efficiency)

    def rack(
        self, name: str, pinion: Any, rack: Any, radius: Any, offset: Any = 0, efficiency: Any = None
    ) -> None:
        """Couple a rack to a pinion: the constraint NAME, rack - radius*pinion - offset = 0.

        Parameters
        ----------
        name : str
        pinion, rack : Symbol or str
            Coordinates, an angle and a length.
        radius : expression
            Of the pitch circle [m]; negative where the rack moves the other way.
        offset, efficiency : expression
            As in `gear`, where the pinion drives.
        """
        shafts = self._shafts(name, "rack.coordinates", (pinion, rack))
        arguments = {"coordinates": shafts, "radius": self._argument(name, "rack.radius", radius)}
        self._couple_shafts(name, "rack", arguments, offset, efficiency)

    def belt(
        self, name: str, first: Any, second: Any, radii: Sequence[Any], crossed: bool = False, offset: Any = 0
    ) -> None:
        """Couple two pulleys by a belt: the constraint NAME, radii[0]*first - radii[1]*second - offset = 0.

        Parameters
        ----------
        name : str
        first, second : Symbol or str
            Coordinates.
        radii : sequence of 2
            Of the pulleys [m].
        crossed : bool
            Whether the belt turns them against each other.
        offset : expression
            [m]
        """
        if not isinstance(crossed, bool):
            message = f"'crossed' is true or false, not {crossed!r:.60}"
            raise self._sources.error(f"constraints.{name!s:.60}", "belt.crossed", message)
        shafts = self._shafts(name, "belt.coordinates", (first, second))
        arguments = {"coordinates": shafts, "radii": self._pair(name, "belt.radii", radii)}
        self._couple_shafts(name, "belt", arguments | ({"crossed": True} if crossed else {}), offset, None)

    def planetary(self, name: str, sun: Any, ring: Any, carrier: Any, teeth: Sequence[Any]) -> None:
        """Couple a planetary gear: the constraint NAME, (sun - carrier) + teeth[1]/teeth[0]*(ring - carrier) = 0.

        Parameters
        ----------
        name : str
        sun, ring, carrier : Symbol or str
            Coordinates. The planets' inertia is that of bodies of their own, or part of the carrier's.
        teeth : sequence of 2
            Of the sun and of the ring.
        """
        keys = ("sun", "ring", "carrier")
        named = [
            self._named(name, f"planetary.{k}", x) for k, x in zip(keys, (sun, ring, carrier), strict=True)
        ]
        numbers = self._pair(name, "planetary.teeth", teeth)
        self._close(name, "planetary", **dict(zip(keys, named, strict=True)), teeth=numbers)

    def differential(self, name: str, input: Any, outputs: Sequence[Any], ratio: Any = 1) -> None:
        """Couple a differential: the constraint NAME, input - ratio*(outputs[0] + outputs[1])/2 = 0.

        Parameters
        ----------
        name : str
        input : Symbol or str
            The coordinate that drives.
        outputs : sequence of 2
            Coordinates of the two sides.
        ratio : expression
            How much faster the input turns than the cage.
        """
        sides = self._vector(outputs, f"constraints.{name!s:.60}", "differential.outputs", (2,))
        self._close(
            name,
            "differential",
            input=self._named(name, "differential.input", input),
            outputs=self._shafts(name, "differential.outputs", sides),
            ratio=self._argument(name, "differential.ratio", ratio),
        )

    def _shafts(self, name: Any, key: str, given: Sequence[Any]) -> tuple[str, ...]:
        return tuple(self._named(name, f"{key}[{k}]", x) for k, x in enumerate(given))

    def _pair(self, name: Any, key: str, values: Any) -> tuple[algebra.Expr, ...]:
        two = self._vector(values, f"constraints.{name!s:.60}", key, (2,))
        return tuple(self._argument(name, f"{key}[{k}]", x) for k, x in enumerate(two))

    def _couple_shafts(
        self, name: Any, kind: str, arguments: dict[str, Any], offset: Any, efficiency: Any
    ) -> None:
        arguments["offset"] = self._argument(name, f"{kind}.offset", offset)
        if efficiency is not None:
            arguments["efficiency"] = self._argument(name, f"{kind}.efficiency", efficiency)
        self._close(name, kind, **arguments)

    def couple(self, name: str, expression: Any) -> None:
        """Hold an expression of the coordinates and `t` at zero: the constraint NAME."""
        self._close(name, "couple", expression=self._argument(name, "couple.expression", expression))

    def motion(self, name: str, coordinate: Any, follows: Any) -> None:
        """Prescribe a coordinate: the constraint NAME, coordinate - follows = 0."""
        moved = self._named(name, "motion.coordinate", coordinate)
        self._close(name, "motion", coordinate=moved, follows=self._argument(name, "motion.follows", follows))

    def closure(
        self,
        name: str,
        type: str | None = None,
        frames: Sequence[str] | None = None,
        axis: Sequence[Any] | None = None,
        axis2: Sequence[Any] | None = None,
        pitch: Any = None,
        coordinate: str | None = None,
        guess: Any = None,
        stiffness: Any = None,
        rest: Any = None,
        damping: Any = None,
        friction: Any = None,
    ) -> None:
        """Close a loop by a joint between two frames: as many constraints as the joint takes motions.

        Makes the constraints NAME_x, NAME_y, NAME_z (the places are one), NAME_off, NAME_off_1, … (on a line or in a
        plane), and NAME_turn, NAME_turn_1, …; of them planar bodies have those in their plane.

        Parameters
        ----------
        name : str
        type : str
            revolute, continuous, prismatic, screw, universal, cylindrical, planar, spherical or fixed.
        frames : sequence of 2
            Names of frames, of bodies (the body's frame), or "world".
        axis, axis2 : sequence of 3, optional
            In both frames, of any length; x by default, z for planar bodies. `axis2` is that of universal joints in the
            second frame.
        pitch : expression
            Of a screw: how far the second frame slides by a whole turn [m].
        coordinate, guess : str, number, optional
            A name for the motion that is left, and where assembly begins to look for it; it is a coordinate then, whose
            angle counts whole turns. Screws and springs have one, which is called as the closure is.
        stiffness, rest, damping : expression, optional
            Of a spring and damper on this motion.
        friction : expression, optional
            The largest force [N] or torque [N m] of dry friction in it.
        """
        given = {
            "type": type, "frames": frames, "axis": axis, "axis2": axis2, "pitch": pitch, "coordinate": coordinate,
            "guess": guess, "stiffness": stiffness, "rest": rest, "damping": damping, "friction": friction,
        }  # fmt: skip
        self._new_element(name, "closures", ChainMap(self._closures, self._joints))
        self._closures[name] = make_closure(self, name, given)

    def rolling(
        self,
        name: str,
        body: str | None = None,
        ball: Any = None,
        wheel: Any = None,
        knife: Sequence[Any] | None = None,
        axis: Sequence[Any] | None = None,
        at: Sequence[Any] | None = None,
        plane: str | None = None,
        holds: Sequence[str] | None = None,
        height: Any = None,
    ) -> None:
        """Let a ball, a wheel or a knife edge roll (or glide along itself) on a plane or surface without slipping.

        Makes the constraint NAME_gap, which keeps it on the plane, and the velocity constraints NAME_along and
        NAME_across, which keep what touches from slipping along the way and across it. A body in the x-y plane rolls
        along a line; a knife edge is seen from above there.

        Parameters
        ----------
        name : str
        body : str
        ball, wheel : expression
            The radius [m]; of parameters and constants. One of the three.
        knife : sequence of 2 or 3
            The direction of the blade in the body's axes, of numbers and constants.
        axis : sequence of 3, optional
            A wheel's axle in the body's axes; z by default.
        at : sequence of 2 or 3, optional
            The centre of ball or wheel, or the blade's point, in the body's frame [m]; its centre of mass by default.
        plane : str, optional
            A frame, body or "world" (the default), on whose x-y plane it rolls, with z up; a planar body on its x axis,
            with y up.
        holds : sequence of str, optional
            Which of "gap", "along", "across" are held; all by default. The second wheel of an axle leaves "across" out.
        height : expression, optional
            z over the plane [m], of `here_x` and `here_y` (planar: y, of `here_x`), and of parameters, smooth: a ball
            or wheel rolls on that surface.
        """
        given = {
            "body": body, "ball": ball, "wheel": wheel, "knife": knife, "axis": axis, "at": at, "plane": plane,
            "holds": holds, "height": height,
        }  # fmt: skip
        self._new_element(name, "rolling", self._rolling)
        self._rolling[name] = make_rolling(self, name, given)

    def tyre(
        self,
        name: str,
        body: str | None = None,
        radius: Any = None,
        axis: Sequence[Any] | None = None,
        at: Sequence[Any] | None = None,
        spin: sympy.Symbol | str | None = None,
        stiffness: Any = None,
        damping: Any = None,
        load: Any = None,
        ground: Any = None,
        slip_stiffness: Any = None,
        friction: Any = None,
        magic: Sequence[float] | None = None,
        table: Any = None,
        relaxation: Any = None,
        camber_stiffness: Any = None,
        magic_camber: Sequence[Any] | None = None,
        inclination: Any = None,
    ) -> None:
        """Add a tyre: forces of a wheel that slips on the ground, along its way and across it; its slips are states.

        Parameters
        ----------
        name : str
            Makes the states NAME_kappa and NAME_alpha, and the definitions NAME_load, NAME_along and NAME_across [N].
        body : str
            The wheel, or with `spin` what carries it. Planar ones are seen from above.
        radius : expression
            [m].
        axis : sequence of 3, optional
            Of the axle in the body's axes; y by default.
        at : sequence of 2 or 3, optional
            The wheel's centre in the body's frame [m]; its centre of mass by default.
        spin : Symbol or str, optional
            The coordinate by which a wheel turns in the body that carries it, about the axle: a rotor's.
        stiffness, damping : expression, optional
            Of the tyre towards the ground [N/m, N s/m]; it never pulls.
        load : expression, optional
            In their place: the force on the ground [N], where something else holds the wheel up.
        ground : expression, optional
            Height of the ground below NAME_centre_x and NAME_centre_y [m].
        slip_stiffness, friction : expression
            Force per load and slip, and per load at most, as of a brush; without friction it is linear.
        magic : sequence of 3
            B, C, E of Pacejka's formula instead, with `friction` for D.
        table : expression
            Force per load instead, of NAME_slip, as "grip(front_slip)", and NAME_load.
        relaxation : expression
            The way after which slips follow [m].
        camber_stiffness : expression, optional
            Force per load and radian by which the wheel leans, NAME_camber, to the side that it leans to.
        magic_camber : sequence of 4, optional
            pDy3, pKy3, pHy3 and pVy3 of Pacejka's formula in its place.
        inclination : expression, optional
            By how much the wheel leans to the side that its axle points to, where that is not what its body does.
        """
        given = {key: value for key, value in locals().items() if key not in ("self", "name")}
        with self._reading():
            self._tyres[name] = add_tyre(self, name, given)

    def stop(self, name: str, gap: Any = None, restitution: Any = 0) -> None:
        """Keep an expression of the coordinates (and `t`) from falling below zero.

        At `gap` = 0 the rates jump: the gap opens as fast as it closed, times `restitution`. Stops that
        touch share one impulse. What comes to rest on a stop stays there until it is pulled away.

        Parameters
        ----------
        name : str
            Of the stop, and of the event when it is hit or let go.
        gap : expression
            Zero where it touches, positive where it is open.
        restitution : expression
            Newton's coefficient, 0 (the default) to 1; of parameters and constants.
        """
        table = f"stops.{name!s:.60}"
        self._new_element(name, "stops", self._touching_names())
        self._stops[name] = Stop(
            name,
            self._required(table, "gap", gap),
            self._sources.expression(restitution, table, "restitution"),
        )

    def limit(
        self, name: str, coordinate: Any, lower: Any = None, upper: Any = None, restitution: Any = 0
    ) -> None:
        """Keep a coordinate between limits: the stops NAME_lower and NAME_upper.

        Parameters
        ----------
        name : str
        coordinate : Symbol or expression
        lower, upper : expression, optional
        restitution : expression
            See `stop`.
        """
        q = algebra.Symbol(coordinate) if isinstance(coordinate, str) else coordinate
        for side, sign, bound in (("lower", 1, lower), ("upper", -1, upper)):
            if bound is not None:
                table = f"stops.{name!s:.60}_{side}"
                value = self._sources.expression(bound, table, "limit")
                self.stop(f"{name}_{side}", sign * (q - value), restitution)

    def friction(
        self,
        name: str,
        coordinate: Any = None,
        speed: Any = None,
        force: Any = None,
        torque: Any = None,
        smooth: Any = None,
        static: Any = None,
        coefficient: Any = None,
        normal: str | Sequence[str] | None = None,
        coordinates: Sequence[Any] | None = None,
        speeds: Sequence[Any] | None = None,
        creep: Any = None,
    ) -> None:
        """Add Coulomb friction against the rate of a coordinate, or against another relative speed, or two of them.

        Parameters
        ----------
        name : str
            Of the friction, and of the event when it begins to stick or to slip.
        coordinate : Symbol or str
            Its rate is the sliding speed.
        speed : expression
            The sliding speed itself, linear in the rates, where it is not one coordinate's: "dot(x) - belt".
        force, torque : expression
            The friction force (or torque; one of the two) while it slides, of coordinates, inputs and `t`; not
            negative. With `static` of rates as well, as in Stribeck's law.
        smooth : expression, optional
            The sliding speed below which the force gives way: force*s/sqrt(s^2 + smooth^2). Without it the friction
            sticks and slips, and the instants are located.
        static : expression, optional
            The largest force (torque) while it sticks, where that is more than while it slides. With a `normal`: the
            coefficient while it sticks.
        coefficient, normal : expression, str or sequence of str, optional
            In the place of a force: the friction is `coefficient` times the force of the stop, or the magnitude of the
            constraint forces, that `normal` names. A ready-made constraint is named as a whole. With `smooth` it is
            coefficient*N*s/sqrt(s^2 + smooth^2).
        coordinates, speeds : sequence of two
            In the place of `coordinate` or `speed`: friction in a plane, against the sliding velocity with these two
            components, at right angles and of one unit. It sticks in both directions until the force that holds them
            would be larger than `static`, and then slides where that points. Its forces are NAME_1 and NAME_2.
        creep : expression, optional
            In the place of `smooth`: the sliding speed from which on the friction is whole. Below, it is
            force*(1 - (1 - s/creep)^3), as of wheels that creep (Vermeulen and Johnson): its slope at the beginning is
            3*force/creep, Kalker's coefficient.
        """
        table, sources = f"friction.{name!s:.60}", self._sources
        self._new_element(name, "friction", self._touching_names())
        if sum(x is not None for x in (coordinate, speed, coordinates, speeds)) != 1:
            raise sources.error(
                table,
                "coordinate",
                "friction acts on one 'coordinate' or one 'speed', or in a plane on two 'coordinates' or 'speeds'",
                hint="give one of these",
            )
        if sum(x is not None for x in (force, torque, coefficient)) != 1:
            raise sources.error(
                table, "force", "friction has one 'force' or 'torque', the largest that it can take",
                hint="or a 'coefficient' of a 'normal' force",
            )  # fmt: skip
        names = self._normal(table, coefficient, normal)
        sliding, *across = self._sliding_speeds(table, coordinate, speed, coordinates, speeds)
        given_as = {"force": force, "torque": torque, "coefficient": coefficient}
        key = next(k for k, x in given_as.items() if x is not None)
        level = sources.expression(given_as[key], table, key)
        if creep is not None and smooth is not None:
            message = "friction gives way by 'smooth' or by 'creep', not by both"
            raise sources.error(table, "creep", message, hint="leave one of them out")
        soft = "smooth" if creep is None else "creep"
        given_width = smooth if creep is None else creep
        width = None if given_width is None else sources.expression(given_width, table, soft)
        most = None if static is None else sources.expression(static, table, "static")
        if most is not None and width is not None:
            message = f"friction with '{soft}' never sticks: 'static' has no effect"
            raise sources.error(table, "static", message, hint="leave one of them out")
        self._frictions[name] = Friction(
            name, sliding, level, width, most, names, across[0] if across else None, creep is not None
        )

    def _sliding_speeds(
        self, table: str, coordinate: Any, speed: Any, coordinates: Any, speeds: Any
    ) -> list[algebra.Expr]:
        """The speeds that friction acts against, one or two; one of the arguments is given."""
        sources = self._sources
        for key, several in (("coordinates", coordinates), ("speeds", speeds)):
            if several is not None and (not isinstance(several, (list, tuple)) or len(several) != 2):
                hint = 'for example ["dot(x)", "dot(y)"]' if key == "speeds" else 'for example ["x", "y"]'
                raise sources.error(table, key, f"friction in a plane has two '{key}'", hint=hint)
        if speed is not None:
            return [sources.expression(speed, table, "speed")]
        if speeds is not None:
            both = [sources.expression(x, table, f"speeds[{k}]") for k, x in enumerate(speeds)]
            return self._two_components(both, table, "speeds")
        plain = coordinate is not None
        found = []
        for k, x in enumerate([coordinate] if plain else coordinates):
            key = "coordinate" if plain else f"coordinates[{k}]"
            given = sources.expression(x, table, key)
            if not isinstance(given, algebra.Symbol):
                hint = "for others give 'speed'" if plain else "for others give 'speeds'"
                raise sources.error(table, key, "a coordinate's name is expected here", hint=hint)
            found.append(dot(given))
        return self._two_components(found, table, "coordinates")

    def _two_components(self, speeds: list[algebra.Expr], table: str, key: str) -> list[algebra.Expr]:
        """The speeds, if they are not one component twice."""
        if len(speeds) == 2 and speeds[0] == speeds[1]:
            hint = "friction along one line takes 'coordinate' or 'speed'"
            raise self._sources.error(
                table, key, "both components of the sliding velocity are the same", hint=hint
            )
        return speeds

    def bristle(
        self,
        name: str,
        coordinate: Any = None,
        speed: Any = None,
        stiffness: Any = None,
        damping: Any = 0,
        viscous: Any = 0,
        coulomb: Any = None,
        static: Any = None,
        stribeck: Any = None,
        start: Any = 0.0,
        unit: str | None = None,
    ) -> sympy.Symbol:
        """Add friction by bristles, the LuGre law: a state NAME, their deflection z, is between a speed and the force.

        dz/dt = v - stiffness |v| z/g, F = stiffness z + damping dz/dt + viscous v, with
        g = coulomb + (static - coulomb) exp(-(v/stribeck)²). NAME_force and NAME_rate are F and dz/dt.

        Parameters
        ----------
        name : str
        coordinate : Symbol or str
            Its rate is the sliding speed v.
        speed : expression
            The sliding speed itself, linear in the rates, where it is not one coordinate's.
        stiffness, damping, viscous : expression
            σ0 [N/m], σ1 and σ2 [N s/m], or with torques.
        coulomb, static : expression
            The force (torque) while it slides steadily, and the largest before; `coulomb` if that is not given.
        stribeck : expression
            The speed in which the force falls from the one to the other; needed with `static`.
        start : float, str or expression of parameters
            The deflection where the run begins.
        unit : str, optional
            Of the deflection.

        Returns
        -------
        Symbol
            The deflection.
        """
        table, sources = f"bristles.{name!s:.60}", self._sources
        if (coordinate is None) == (speed is None):
            message = "friction by bristles acts on one 'coordinate' or one 'speed'"
            raise sources.error(table, "coordinate", message, hint="give one of these")
        if (static is None) != (stribeck is None):
            missing = "static" if static is None else "stribeck"
            raise sources.error(
                table, missing, f"'static' and 'stribeck' go together; '{missing}' is missing"
            )
        (sliding,) = self._sliding_speeds(table, coordinate, speed, None, None)
        given = {"damping": damping, "viscous": viscous, "static": static, "stribeck": stribeck}
        values = {key: sources.expression(x, table, key) for key, x in given.items() if x is not None}
        needed = {"stiffness": stiffness, "coulomb": coulomb}
        values |= {key: self._required(table, key, x) for key, x in needed.items()}
        made = Bristle(name, sliding, **values)
        z = self.state(name, algebra.Symbol(made.made[0]), start, unit)
        for own, law in zip(made.made, bristle_laws(made), strict=True):
            self.definition(own, law)
        self._bristles[name] = made
        return z

    def contact(
        self,
        name: str,
        gap: Any = None,
        stiffness: Any = None,
        exponent: Any = None,
        damping: Any = None,
        friction: Any = None,
        slip: Any = None,
        smooth: Any = None,
        body: str | None = None,
        shape: Any = None,
        plane: str | None = None,
        height: Any = None,
        other: str | None = None,
        other_shape: Any = None,
        restitution: Any = None,
        static: Any = None,
    ) -> None:
        """Let the shape of a body touch a plane, a height field or another body, or add a compliant contact by its gap.

        What touches are points: the middle of a sphere, both ends of a capsule, the corners of a box or of a mesh's
        convex hull. Each is a stop NAME (where there are several, NAME_1, NAME_2, ...) with a friction
        NAME_friction; or, with a `stiffness`, a compliant contact after Hunt and Crossley. Its force is
        k δ^n (1 + 3/2 c dδ/dt) with the depth δ = -gap, and never pulls.

        Parameters
        ----------
        name : str
        gap : expression
            Of coordinates (and `t`), negative in contact [m]; in the place of a `body`.
        stiffness : expression
            k [N/m^n]; left out, what touches by its shape is rigid.
        exponent : expression
            n, 1.5 for spheres (Hertz); of parameters and constants, at least 1.
        damping : expression, optional
            c [s/m]; the restitution is 1 - c v for slow impacts at speed v.
        friction : expression, optional
            Coefficient of Coulomb friction times the elastic part of the force, against `slip`.
        slip : expression
            Sliding speed, linear in the rates.
        smooth : expression
            Speed below which the friction gives way, see `friction`. Friction of a rigid contact sticks without it.
        body : str, optional
            The body whose shape touches.
        shape, other_shape : dict or sequence of dict, optional
            Shapes in the body's frame that touch in the place of its own.
        plane : str, optional
            A frame, body or "world" (the default): its x-y plane, with z up; of planar bodies its x axis, with y up.
        height : expression, optional
            z over that plane [m], of `here_x` and `here_y` (planar: y, of `here_x`); of parameters and tables, smooth.
        other : str, optional
            In the place of a plane: another body, whose shape is touched. Spheres and capsules touch spheres,
            capsules, boxes and meshes; boxes and meshes touch each other (corners, and edges of boxes in space; where
            edges of meshes cross, NAME_edges ends a run).
        restitution : expression, optional
            Of a rigid contact, see `stop`.
        static : expression, optional
            The coefficient of friction of a rigid contact while it sticks, where it is larger than `friction`.
        """
        table = f"contacts.{name!s:.60}"
        self._new_element(name, "contacts", self._touching_names())
        by_shape = {
            "body": body, "shape": shape, "plane": plane, "height": height, "other": other,
            "other_shape": other_shape, "restitution": restitution, "static": static,
        }  # fmt: skip
        if body is not None:
            laws = {
                "gap": gap,
                "slip": slip,
                "stiffness": stiffness,
                "exponent": exponent,
                "damping": damping,
            }
            self._pairs[name] = make_pair(
                self, name, by_shape | laws | {"friction": friction, "smooth": smooth}
            )
            return
        for key, value in by_shape.items():
            if value is not None:
                hint = "give 'body', or leave it out"
                raise self._sources.error(table, key, f"'{key}' goes with the 'body' that touches", hint=hint)
        exponent = 1.5 if exponent is None else exponent
        together = {"friction": friction, "slip": slip, "smooth": smooth}
        missing = [key for key, value in together.items() if value is None]
        if missing and len(missing) < 3:
            raise self._sources.error(
                table,
                missing[0],
                f"friction of a contact needs 'friction', 'slip' and 'smooth'; '{missing[0]}' is missing",
                hint="give all three, or none",
            )
        given = {"exponent": exponent, "damping": damping, **together}
        values = {k: None if x is None else self._sources.expression(x, table, k) for k, x in given.items()}
        held = {
            "gap": self._required(table, "gap", gap),
            "stiffness": self._required(
                table, "stiffness", stiffness, "add it, or name the 'body' that touches"
            ),
        }
        self._contacts[name] = Contact(name, **held, **values)

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
        self._drawings[name] = parts.make_drawing(self, name, what)

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
        self._events[name] = parts.make_event(self._sources, name, when, direction, then)

    def port(self, name: str, kind: str = "value", unit: str | None = None) -> Any:
        """Make this model an assembly, which is given something by the models that use it.

        Parameters
        ----------
        name : str
        kind : {"value", "coordinate", "input", "body", "frame", "point"}
            A value is any expression of the model's; the others are what the model calls by a name (of frames, that of
            a body or "world" as well).
        unit : str, optional
            Of a value, coordinate or input.

        Returns
        -------
        sympy.Symbol, str or tuple of sympy.Symbol
            What stands for it: a symbol, a body's name, NAME_x, NAME_y, NAME_z of frames and points.
        """
        made = self._ports[name] = assemblies.make_port(self, name, kind, unit)
        if kind in assemblies.NAMES_OF_VALUES:
            return self._symbol(made.name)
        return name if kind == "body" else self._world_components(name)

    def assembly(self, name: str, description: str = "") -> Model:
        """Begin an assembly: a model that this one uses, as often as it likes.

        Parameters
        ----------
        name : str
        description : str

        Returns
        -------
        Model
            To be described before it is used; `port` makes what it is given. `Model.from_toml` reads one from a file.
        """
        self._new_element(name, "assemblies", self._shelf.names())
        return self._shelf.put(name, self._part_of(name, description))

    def _part_of(self, name: str, description: str = "") -> Model:
        sources = self._sources
        within = f"assemblies.{name}" if sources.is_file else f"assembly({name!r})"
        made = type(self)(
            name, description, folder=self.folder, _file=sources.name if sources.is_file else None,
            _assembly=f"{sources.assembly}.{within}" if sources.assembly else within,
        )  # fmt: skip
        made._sources.name = sources.name
        made._sources.tables |= sources.tables  # curves that it may call
        made._shelf = Shelf(self._shelf)
        return made

    def use(self, name: str, assembly: str | Model, /, **given: Any) -> assemblies.Used:
        """Use an assembly: take over all that it says, its names with NAME and a dot before them.

        Parameters
        ----------
        name : str
        assembly : str or Model
            The name of an assembly, or a model that becomes one.
        **given
            By their names what ports are connected to, and values of parameters: numbers and quantities, which runs may
            set (NAME.PARAMETER), or expressions of parameters. One that is not given is the model's own parameter or
            constant of its name; or else it keeps its value. `offset` (2 or 3 components [m]) and `angle` about z
            [rad], or in space `xyz` and `rpy`, place what the assembly says in world axes.

        Returns
        -------
        Used
            `c1.piston` or `c1["piston"]` is a symbol, or the name of a body, a joint and so on.

        Examples
        --------
        >>> c1 = model.use("c1", "cylinder", crank=theta, angle="30 deg", phase=0)
        >>> model.output("first", c1.x)
        """
        table, key, found = f"use.{name!s:.60}", assembly, assembly
        fail = functools.partial(self._sources.error, table, "assembly")
        if not isinstance(assembly, Model):
            found = self._shelf.get(assembly, fail)
        elif assembly is self:
            raise fail("a model cannot use itself")
        else:
            key = assembly.name
            if self._shelf.find(key, fail) is not assembly:
                self._new_element(key, "assemblies", self._shelf.names())
                self._shelf.put(key, assembly)
        assemblies.use(self, name, key, found, given)
        return assemblies.Used(self, name)

    def start(
        self,
        *equations: Any,
        find: sympy.Symbol | str | Sequence[sympy.Symbol | str] = (),
        steady: bool | sympy.Symbol | str | Sequence[sympy.Symbol | str] = False,
        closed: str | Sequence[str] = (),
    ) -> None:
        """Say what holds where runs begin, besides the constraints: guesses move until it does.

        Parameters
        ----------
        *equations : expression or str
            Zero at the start: of coordinates, rates, states, parameters, inputs, `t`, accelerations and reactions. Text
            may be an equation, and its last term a quantity: "tip_x = 0.3 m".
        find : str or sequence of str, optional
            Parameters that are found with them; their values are guesses. One that a run sets is not sought there.
        steady : bool, or str or sequence of str
            True: in equilibrium. Rates that are guesses are zero, and so are their accelerations and the derivatives of
            states. Or the coordinates, rates and states of which that holds.
        closed : str or sequence of str, optional
            Stops whose gap, and its rate, are zero.

        Examples
        --------
        >>> model.start("tip_x = 0.3 m", "dot(tip_x) = 0.1 m/s")
        >>> model.start(find=k, steady=True)
        """
        self._begin(list(equations), find, steady, closed)

    def _begin(self, equations: Any = (), find: Any = (), steady: Any = False, closed: Any = ()) -> None:
        given = {"equations": equations, "find": find, "steady": steady, "closed": closed}
        self._start = make_start(self, self._start, given)

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
        if self._ports:
            message = f"'{next(iter(self._ports))}' is a port: this is an assembly, which other models use"
            raise self._sources.error("ports", "", message, hint="use it in a model, by [use.NAME]")
        d, kinds = self._description(), self._kinds | dict.fromkeys(self._aliases, "definition")
        check_uses(d, self._sources, kinds)
        return finished(d, self._sources, kinds)

    def values_of_runs(self, file: str = "") -> Callable[[], ValuesOfRuns]:
        """Give, when called, what refuses values of parameters in runs, by the model as it is now.

        Parameters
        ----------
        file : str
            What errors call the model's file.
        """
        d, sources = self._description(), copy.copy(self._sources)
        sources.name = file or sources.name
        return lambda: values_of_runs.ValuesOfRuns(with_definitions_in_order(d, sources), sources)

    def to_toml(self) -> str:
        """The model as the text of a TOML file."""
        self.describe()
        return "\n\n".join(self._toml_blocks()) + "\n"

    def _toml_blocks(self, within: str = "") -> Iterator[str]:
        """The parts of the TOML text, those of an assembly `within` a table."""
        forces = without_pushes(self._forces, self._tyres.values())
        own = assemblies.without_uses(self._description(self._energies, forces))
        own = without_made(own, self._tyres.values())
        yield from toml_writer.blocks(own, self._sources, self._ports.values(), within, self._tyres.values())
        for name, assembly in self._shelf.own():
            yield from assembly._toml_blocks(f"{within}assemblies.{name}.")
        yield from toml_writer.uses(self._uses.values(), self._sources, within)

    def _description(
        self,
        energies: dict[str, list[algebra.Expr]] | None = None,
        forces: dict[str, list[algebra.Expr]] | None = None,
    ) -> Description:
        """What was said; all energies and forces, or only some of them."""
        start = self._start if energies is not None else self._whole_start()
        energies = _joined(self._energies, self._used_energies) if energies is None else energies
        forces = _joined(self._forces, self._used_forces) if forces is None else forces
        held = list(self._constraints.values())
        return Description(
            name=self.name,
            description=self.description,
            coordinates=self._all_coordinates(),
            parameters=tuple(self._parameters),
            constants=tuple(self._constants),
            inputs=tuple(self._inputs),
            definitions=(
                *self._definitions,
                *self._mentioned_aliases(),
                *(x for s in self._springs.values() for x in measures(s)),
            ),
            bodies=tuple(self._bodies.values()),
            gravity=self._gravity,
            **{key: algebra.Add(*terms) for key, terms in energies.items()},
            forces=tuple((name, algebra.Add(*terms)) for name, terms in forces.items()),
            loads=tuple(self._loads.values()),
            constraints=tuple(c for c in held if c.kind == "holonomic"),
            velocity_constraints=tuple(c for c in held if c.kind == "velocity"),
            outputs=tuple(self._outputs),
            events=tuple(self._events.values()),
            run=MappingProxyType(dict(self._run)),
            folder=self.folder,
            rates=self._all_rates(),
            joints=tuple(self._joints.values()),
            points=(*self._points.values(), *(Point(f.name, f.body, f.at) for f in self._frames.values())),
            axes=tuple(self._axes.values()),
            loops=tuple(self._loops.values()),
            drawings=tuple(self._drawings.values()),
            impacts=self.impacts,
            stops=tuple(self._stops.values()),
            frictions=tuple(self._frictions.values()),
            bristles=tuple(self._bristles.values()),
            contacts=tuple(self._contacts.values()),
            pairs=tuple(self._pairs.values()),
            frames=tuple(self._frames.values()),
            springs=tuple(self._springs.values()),
            bushings=tuple(self._bushings.values()),
            field=self._field,
            gravitation=self._gravitation,
            attractors=tuple(self._attractors.values()),
            rolling=tuple(self._rolling.values()),
            states=tuple(self._states),
            tables=tuple(self._tables),
            closures=tuple(self._closures.values()),
            rotors=tuple(self._rotors.values()),
            uses=(*self._uses.values(), *self._inner_uses),
            start=start,
        )

    def _whole_start(self) -> StartConditions | None:
        """What holds where a run begins: what the model says, and what its uses of assemblies do."""
        return together(self._start, self._used_starts)

    def _mentioned_aliases(self) -> Iterator[tuple[str, algebra.Symbol]]:
        """What the model's own expressions call by the name that it has in a use, `c1.m` for a mass that all share."""
        if self._aliases:
            given = [source.expression for _, source in self._sources.everything() if not source.use]
            mentioned = frozenset().union(*map(names_in, given))
            yield from ((name, x) for name, x in self._aliases.items() if name in mentioned)

    def _positions(self) -> list[Coordinate]:
        """The coordinates as they are declared, then those that joints made; behind both what uses brought."""
        made = (*self._coordinates, *self._made)
        return sorted(made, key=lambda c: "." in c.name) if self._uses else list(made)

    def _all_coordinates(self) -> tuple[Coordinate, ...]:
        """The order of q: positions, then the integrals of states."""
        return (*self._positions(), *self._integrals)

    def _all_rates(self) -> tuple[Rate, ...]:
        """The order of v: that of q, with a joint's angular velocities where its quaternion stands, states at last."""
        rates: list[Rate] = []
        for c in self._positions():
            own = self._made_rates.get(c.joint, ())
            if c.quaternion is None:
                named = [r for r in own if r.coordinate == c.name]
                rates += named or [plain_rate(c)]
            elif c.name == self._joints[c.joint].coordinates[-4]:
                rates += [r for r in own if r.coordinate is None]
        if self._start is None and not self._used_starts:
            return (*rates, *self._state_rates)
        return (*rates, *map(self._state_rate, self._state_rates))

    def _state_rate(self, rate: Rate) -> Rate:
        """The rate of a state; without a start of its own it is a guess where there is something that could move it."""
        if rate.start is None:
            return rate
        begins = any(state.name == rate.name and state.begins for state in self._states)
        return rate if begins else replace(rate, start=None, guess=rate.start)

    def _fixed_vector(
        self, table: str, what: str, name: Any, body: Any, taken: Mapping[str, Any], values: Any, key: str
    ) -> tuple[algebra.Expr, ...]:
        self._new_element(name, table, taken)
        place = f"{table}.{name}"
        if reference_fault(body) is not None:
            raise self._sources.error(
                place,
                "body",
                f"'body' is a body's name or \"world\", not {body!r:.60}",
                hint="write it in quotes",
            )
        for component in "xyz":
            self._declare_made(f"{name}_{component}", f"{what} component", place, what)
        return self._components(values, place, key)

    def _world_components(self, name: str) -> tuple[sympy.Symbol, ...]:
        return tuple(self._symbol(f"{name}_{component}") for component in "xyz")

    def _constrain(self, table: str, name: Any, expression: Any, kind: str) -> None:
        self._new_element(name, table, ChainMap(self._constraints, self._loops))
        self._constraints[name] = Constraint(name, self._sources.expression(expression, table, name), kind)

    def _close(self, name: Any, kind: str, **arguments: Any) -> None:
        self._new_element(name, "constraints", ChainMap(self._constraints, self._loops))
        self._loops[name] = Loop(name, kind, tuple(arguments.items()))

    def _argument(self, name: Any, key: str, value: Any) -> algebra.Expr:
        return self._sources.expression(value, f"constraints.{name!s:.60}", key)

    def _named(self, name: Any, key: str, value: Any) -> str:
        """The name of a point, body or coordinate; a point also as the symbols that `point` returned."""
        return self._named_in(value, f"constraints.{name!s:.60}", key)

    def _named_in(self, value: Any, table: str, key: str) -> str:
        if isinstance(value, tuple) and len(value) == 3 and all(map(is_symbol, value)):
            value = value[0].name.removesuffix("_x")
        value = given_name(value)
        fault = reference_fault(value)
        if fault is not None:
            raise self._sources.error(table, key, fault, hint="name what the model has")
        return value

    def _guide(
        self, name: Any, kind: str, point: Any, base_key: str, base: Any, key: str, values: Any, body: Any
    ) -> None:
        table = f"constraints.{name!s:.60}"
        arguments = {
            "point": self._named(name, f"{kind}.point", point),
            base_key: self._named(name, f"{kind}.{base_key}", base),
            key: unit_vector(self, table, f"{kind}.{key}", values),
        }
        if body is not None:
            arguments["body"] = self._named(name, f"{kind}.body", body)
        self._close(name, kind, **arguments)

    def _normal(self, table: str, coefficient: Any, normal: Any) -> tuple[str, ...]:
        """The names that `normal` gives."""
        sources = self._sources
        if (coefficient is None) != (normal is None):
            missing = "normal" if normal is None else "coefficient"
            raise sources.error(
                table,
                missing,
                f"'coefficient' and 'normal' go together; '{missing}' is missing",
                hint="give both",
            )
        if normal is None:
            return ()
        names = (normal,) if isinstance(normal, str) else normal
        if not isinstance(names, (list, tuple)) or not names or not all(isinstance(x, str) for x in names):
            message = "the name of a stop or a constraint is expected here, or a list of constraints' names"
            raise sources.error(table, "normal", message)
        return tuple(names)

    def _required(self, table: str, key: str, value: Any, hint: str = "add it") -> algebra.Expr:
        if value is None:
            raise self._sources.error(table, key, f"the key '{key}' is missing", hint=hint)
        return self._sources.expression(value, table, key)

    def _touching_names(self) -> ChainMap:
        return ChainMap(self._stops, self._frictions, self._contacts, self._pairs)

    def _add(self, table: str, key: str, expression: Any, into: dict[str, list[algebra.Expr]]) -> None:
        into.setdefault(key, []).append(self._sources.expression(expression, table, key))


def _joined(
    own: dict[str, list[algebra.Expr]], used: dict[str, list[algebra.Expr]]
) -> dict[str, list[algebra.Expr]]:
    return {key: [*own.get(key, ()), *used.get(key, ())] for key in dict.fromkeys((*own, *used))}


def _one_or_all(symbols: list[algebra.Symbol]) -> Any:
    return symbols[0] if len(symbols) == 1 else tuple(symbols)
