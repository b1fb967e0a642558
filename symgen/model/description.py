"""The frozen description of a mechanical system: what the user said, nothing derived."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field as default
from pathlib import Path
from types import MappingProxyType
from typing import Any

from .algebra import Expr


@dataclass(frozen=True)
class Parameter:
    """A run-time settable number; `unit` is None where the user gave none."""

    name: str
    value: float
    unit: str | None = None
    doc: str = ""


@dataclass(frozen=True)
class Constant:
    """A number that is folded into the code at derive time.

    One `of_place` says where a use of an assembly stands: uses that are equal but for these are derived once, and the
    numbers are parameters then.
    """

    name: str
    value: float
    unit: str | None = None
    of_place: bool = False


@dataclass(frozen=True)
class Formula:
    """A start that parameters make, and where it stands in the model file: a table and a key."""

    expression: Expr
    table: str
    key: str


@dataclass(frozen=True)
class Coordinate:
    """A generalised coordinate: `start`, `rate` are enforced, `guess`, `rate_guess` assembly may move.

    `quaternion` names the joint whose unit quaternion it is an element of; such a coordinate has no rate
    of its own. `joint` names the joint that made it; None where the user declared it. Where the start (or guess) or the
    rate has a formula, the number is its value at the parameters' values. An `integral` is that of a state over time:
    nothing depends on it.
    """

    name: str
    unit: str | None = None
    start: float | None = None
    rate: float | None = None
    guess: float = 0.0
    rate_guess: float = 0.0
    quaternion: str | None = None
    joint: str | None = None
    formula: Formula | None = None
    rate_formula: Formula | None = None
    integral: bool = False


@dataclass(frozen=True)
class Rate:
    """A generalised speed: an element of v, with an enforced `start` or a `guess`.

    `coordinate` names the coordinate whose time derivative it is; None for the angular velocities of
    spherical and free joints. Outside free joints such a rate has its coordinate's name. A `state` has its derivative
    among the forces, and its integral for a coordinate.
    """

    name: str
    unit: str | None = None
    start: float | None = None
    guess: float = 0.0
    coordinate: str | None = None
    formula: Formula | None = None
    state: bool = False


@dataclass(frozen=True)
class State:
    """A first-order state: its `derivative` may depend on all that moves; `begins` tells that a start is given."""

    name: str
    derivative: Expr
    begins: bool = default(default=True, compare=False)


@dataclass(frozen=True)
class Input:
    """A control input with its default value, or with what it does over time where nothing else is said.

    `times` and `values` are those of a table of this `kind`; `polynomial` has coefficients of powers of t. One that is
    `rate_of` another is its time derivative, which runs make.
    """

    name: str
    unit: str | None = None
    default: float = 0.0
    times: tuple[float, ...] = ()
    values: tuple[float, ...] = ()
    kind: str = ""
    polynomial: tuple[float, ...] = ()
    rate_of: str = ""


@dataclass(frozen=True)
class Table:
    """A function of the state that numbers make: a curve of one argument, a map of two.

    `axes` are the ascending arguments, `values` those at all of their combinations, the last argument fastest. `kind`
    is linear, pchip or cubic, `outside` hold, extend or refuse. `units` are of the arguments, then of the value.
    """

    name: str
    axes: tuple[tuple[float, ...], ...]
    values: tuple[float, ...]
    kind: str
    outside: str
    units: tuple[str | None, ...]


NOTHING = "none"  # the kind of a shape that is not drawn


@dataclass(frozen=True)
class Shape:
    """What is drawn for a body: box, sphere, cylinder, capsule (with sizes), mesh (with a file), solids or nothing.

    `parts` are the kinds of the solids; `sizes` are for each its sizes, then its middle [m] from the body's centre of
    mass, and the directions of its own first and third axis.
    """

    kind: str
    sizes: tuple[Expr, ...] = ()
    mesh: str = ""
    parts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Solid:
    """A solid that a body is made of, or drawn with; a `cut` is taken away.

    `offset` [m] and `axis` or `rpy` [rad] place its middle and turn it in the body's frame; empty where they are not
    given. `density` [kg/m^3] is None for one that is drawn only. `place` is its key in the body's table. A `mesh` (its
    file) has no sizes, but what it `holds` per density: volume [m^3], centre [m], second moments about it [m^5].
    """

    kind: str
    sizes: tuple[Expr, ...]
    planar: bool
    place: str
    offset: tuple[Expr, ...] = ()
    axis: tuple[float, ...] = ()
    rpy: tuple[Expr, ...] = ()
    density: Expr | None = None
    own_density: bool = False
    cut: bool = False
    mesh: str = ""
    holds: tuple[float, ...] = ()


@dataclass(frozen=True)
class Body:
    """A rigid body or point mass.

    `com` is in world axes; in the body's own frame where a joint places the body. It has 2 (planar) or
    3 components. `inertia` has 0, 1 (planar), 3 or 6 entries (Ixx, Iyy, Izz, Ixy, Ixz, Iyz: elements of the
    tensor about the centre of mass, in body axes).
    `angle` orients a planar body; `rotation` is a sequence of (axis, angle), successive and body-fixed. Where `solids`
    have a density, mass and inertia are theirs, and so is `com` where `centred` says so. `color` is `#rrggbb` or empty.
    """

    name: str
    com: tuple[Expr, ...]
    mass: Expr | None = None
    inertia: tuple[Expr, ...] = ()
    angle: Expr | None = None
    rotation: tuple[tuple[str, Expr], ...] = ()
    shape: Shape | None = None
    solids: tuple[Solid, ...] = ()
    centred: bool = False
    color: str = ""

    @property
    def planar(self) -> bool:
        """Whether the body moves in the x-y plane."""
        return len(self.com) == 2 or (not self.com and len(self.inertia) == 1)


@dataclass(frozen=True)
class Joint:
    """What a body can do relative to its parent: a body or "world".

    The joint frame stands at `xyz` [m] in the parent's frame, turned by `rpy` [rad] as in URDF:
    R = Rz(yaw) Ry(pitch) Rx(roll); both of parameters and constants only, and multiples of pi/2 in `rpy` are
    exact multiples of pi. At zero coordinates the child's frame is the joint frame. `axis` is a unit vector
    in the joint frame; `axis2`, of universal joints only, one in the frame that the first rotation has turned.

    `stiffness`, `damping`, `armature` and `rest` are empty, one for all coordinates (rates), or one for each;
    `limits` are empty, or a lower and an upper one; with a `restitution` they stop the joint, without they are only
    watched. In a finished description they are part of its energies, events and stops already. `pitch` is what a screw
    slides along its axis by a whole turn [m], `sequence` the axes of a gimbal's successive rotations: "zxz".
    """

    name: str
    type: str
    parent: str
    child: str
    xyz: tuple[Expr, ...]
    rpy: tuple[Expr, ...]
    axis: tuple[float, ...] = ()
    axis2: tuple[float, ...] = ()
    coordinates: tuple[str, ...] = ()
    rates: tuple[str, ...] = ()
    stiffness: tuple[Expr, ...] = ()
    damping: tuple[Expr, ...] = ()
    armature: tuple[Expr, ...] = ()
    rest: tuple[Expr, ...] = ()
    limits: tuple[Expr, ...] = ()
    restitution: Expr | None = None
    pitch: Expr | None = None
    sequence: str = ""


@dataclass(frozen=True)
class Point:
    """A point fixed in a body or "world", `at` in its frame [m]; its world coordinates are NAME_x, NAME_y, NAME_z."""

    name: str
    body: str
    at: tuple[Expr, ...]


@dataclass(frozen=True)
class Axis:
    """A vector fixed in a body or "world"; its world components are NAME_x, NAME_y, NAME_z."""

    name: str
    body: str
    direction: tuple[Expr, ...]


@dataclass(frozen=True)
class Frame:
    """A frame fixed in a body or "world", its origin `at` [m]; `rpy` [rad] as in joints. The origin is a point, too.

    `said` are the arguments that its orientation was given by, for who writes the model down; empty where `rpy` was.
    """

    name: str
    body: str
    at: tuple[Expr, ...]
    rpy: tuple[Expr, ...]
    said: tuple[tuple[str, Any], ...] = default(default=(), compare=False)


@dataclass(frozen=True)
class Spring:
    """A spring and damper between two `places` [m] in world axes, or of an `angle`.

    It pulls with stiffness (length - rest) + preload + damping d(length)/dt, or with a `curve` of length - rest for the
    first term; one that `acts` by "pull" only is a rope, by "push" only a buffer. `mass` is spread evenly between the
    places.
    """

    name: str
    places: tuple[tuple[Expr, ...], ...] = ()
    angle: Expr | None = None
    stiffness: Expr | None = None
    curve: Expr | None = None
    rest: Expr | None = None
    damping: Expr | None = None
    preload: Expr | None = None
    mass: Expr | None = None
    acts: str = ""

    @property
    def measured(self) -> str:
        """What its definitions are called: NAME_length, NAME_force, or NAME_angle, NAME_torque."""
        return f"{self.name}_angle" if self.angle is not None else f"{self.name}_length"

    @property
    def exerted(self) -> str:
        """The name of its force or torque."""
        return f"{self.name}_torque" if self.angle is not None else f"{self.name}_force"


@dataclass(frozen=True)
class Bushing:
    """An elastic joint between two frames, bodies or "world".

    `stiffness` and `damping` are along and about x, y, z of the first (planar: along x, y, and about z); angles are
    those of successive rotations about x, y, z.
    """

    name: str
    frames: tuple[str, str]
    stiffness: tuple[Expr, ...]
    damping: tuple[Expr, ...] = ()


@dataclass(frozen=True)
class Sensor:
    """What only the solved equations tell: a symbol `name` that was met at a `table` and `key`.

    It is the time derivative of an expression of positions and rates; or the force of constraints, stops or frictions
    (`rows`; of several, the magnitude); or a `component` (three of the force [N], three of the torque [N m], at the
    joint frame and in its axes) of what a `joint` does to its child.
    """

    name: str
    table: str
    key: str
    derivative: Expr | None = None
    rows: tuple[str, ...] = ()
    joint: str | None = None
    component: int = 0


@dataclass(frozen=True)
class Attractor:
    """A centre of gravity `at` a place [m] that pulls every mass with mu/r^2; `body` is the one that it is part of.

    With its `gradient` it turns bodies, too: their potential has the second term of the series in size over distance.
    """

    name: str
    at: tuple[Expr, ...]
    mu: Expr
    gradient: bool = False
    body: str | None = None


@dataclass(frozen=True)
class Rolling:
    """What rolls without slipping on the x-y plane of a frame (planar: on its x axis): a ball, a wheel, a knife edge.

    `axis` is a wheel's axle or a blade's direction, `at` the centre of the wheel or the point of the blade [m], both in
    the body's frame; by default its z axis and its centre of mass. `holds` names the constraints: gap, along, across.
    With a `height` of `here_x` and `here_y` [m] it is no plane but a surface over it.
    """

    name: str
    body: str
    kind: str
    radius: Expr | None
    axis: tuple[float, ...]
    at: tuple[Expr, ...]
    plane: str
    holds: tuple[str, ...]
    height: Expr | None = None


@dataclass(frozen=True)
class Closure:
    """A joint of a type that closes a loop between two frames, bodies or "world"; it is at zero where they are one.

    `axis` and `axis2` are unit vectors in both frames, empty where they are not given. Joints of one motion may have a
    `coordinate` for it, which is made by the closure, a spring, a damper, and dry `friction` of a size [N or N m].
    """

    name: str
    type: str
    frames: tuple[str, str]
    axis: tuple[float, ...] = ()
    axis2: tuple[float, ...] = ()
    coordinate: str | None = None
    pitch: Expr | None = None
    stiffness: Expr | None = None
    rest: Expr | None = None
    damping: Expr | None = None
    friction: Expr | None = None


@dataclass(frozen=True)
class Rotor:
    """An inertia [kg m^2] that spins about an `axis` of a `body` or "world", by a coordinate of its name or an `angle`.

    The axis is empty where it is z. The body feels it turn where it is `gyroscopic`. `at` [m] is for the picture.
    """

    name: str
    inertia: Expr
    body: str = "world"
    axis: tuple[float, ...] = ()
    at: tuple[Expr, ...] = ()
    angle: Expr | None = None
    gyroscopic: bool = True


@dataclass(frozen=True)
class Loop:
    """A ready-made constraint as the user asked for it: coincident, distance, gear and so on.

    A finished description has its scalar equations among the `constraints`, and what they need among the `axes`.
    """

    name: str
    kind: str
    arguments: tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class Load:
    """A force at a point, or a torque on a body; 2 or 3 components (a planar torque: 1).

    They are in the axes of `frame`, a frame or body, or else of the world; the opposite acts on the body `reaction`. A
    finished description has all in world axes, and the opposite as loads of its own.
    """

    name: str
    point: tuple[Expr, ...] = ()
    force: tuple[Expr, ...] = ()
    body: str | None = None
    torque: tuple[Expr, ...] = ()
    frame: str | None = None
    reaction: str | None = None


@dataclass(frozen=True)
class Constraint:
    """An expression that is held at zero; `kind` is "holonomic" or "velocity"."""

    name: str
    expression: Expr
    kind: str = "holonomic"


@dataclass(frozen=True)
class Stop:
    """A rigid one-sided stop: `gap` never falls below zero; `restitution` is Newton's, 0 to 1."""

    name: str
    gap: Expr
    restitution: Expr


@dataclass(frozen=True)
class Friction:
    """Coulomb friction against a relative `speed`, linear in the rates, of the size `level` [W per unit of `speed`].

    `smooth` is the speed below which the force gives way; without it the contact sticks and slips. What sticks can take
    `static`, or as much as what slides. With a `normal`, `level` and `static` are coefficients of a normal force: that
    of a stop, or the magnitude of the multipliers of one or more constraints; the names of these.

    With a speed `across` it acts against the vector of both: Coulomb's circle. Where it `creeps`, `smooth` is the speed
    from which on it is whole, see `contact_laws.creep_share`.
    """

    name: str
    speed: Expr
    level: Expr
    smooth: Expr | None = None
    static: Expr | None = None
    normal: tuple[str, ...] = ()
    across: Expr | None = None
    creeps: bool = False

    @property
    def speeds(self) -> tuple[Expr, ...]:
        """The one speed, or both."""
        return (self.speed,) if self.across is None else (self.speed, self.across)

    @property
    def rows(self) -> tuple[str, ...]:
        """The names of its forces, one for each speed."""
        return (self.name,) if self.across is None else (f"{self.name}_1", f"{self.name}_2")


@dataclass(frozen=True)
class Bristle:
    """Friction against a relative `speed` by bristles: a state of its name, the deflection, and two definitions.

    `coulomb` is the force while it slides, `static` where that begins, `stribeck` the speed in which it falls.
    """

    name: str
    speed: Expr
    stiffness: Expr
    damping: Expr
    viscous: Expr
    coulomb: Expr
    static: Expr | None = None
    stribeck: Expr | None = None

    @property
    def made(self) -> tuple[str, str]:
        """The names of its definitions: the rate of the deflection, the force."""
        return f"{self.name}_rate", f"{self.name}_force"


@dataclass(frozen=True)
class Contact:
    """A compliant contact after Hunt and Crossley where `gap` is negative: depth δ, force k δ^n (1 + 3/2 c dδ/dt) ≥ 0.

    `friction` is the coefficient of regularised Coulomb friction against `slip`, which gives way below `smooth`; in a
    plane against the vector of `slip` and `across`.
    """

    name: str
    gap: Expr
    stiffness: Expr
    exponent: Expr
    damping: Expr | None = None
    friction: Expr | None = None
    slip: Expr | None = None
    smooth: Expr | None = None
    across: Expr | None = None

    @property
    def slips(self) -> tuple[Expr, ...]:
        """The sliding speeds, one or two."""
        return tuple(x for x in (self.slip, self.across) if x is not None)


@dataclass(frozen=True)
class ContactPair:
    """A `body` whose shape touches the x-y plane of a frame (planar: its x axis), or the shape of another body.

    `shapes` are given where they are not the body's own, in its frame; so are `other_shapes`. With a `height` of
    `here_x` and `here_y` [m] it is no plane but a surface over it. With a `stiffness` it is a compliant contact, see
    `Contact`; else each point that touches makes a stop with the `restitution`, and a friction on it.
    """

    name: str
    body: str
    shapes: tuple[Solid, ...] = ()
    plane: str = "world"
    other: str | None = None
    other_shapes: tuple[Solid, ...] = ()
    height: Expr | None = None
    restitution: Expr | None = None
    friction: Expr | None = None
    static: Expr | None = None
    stiffness: Expr | None = None
    exponent: Expr | None = None
    damping: Expr | None = None
    smooth: Expr | None = None


@dataclass(frozen=True)
class Reset:
    """After an event, coordinate `target` (or its rate) becomes `value` of the state before."""

    target: str
    is_rate: bool
    value: Expr


@dataclass(frozen=True)
class Event:
    """A zero crossing of `when`; `action` is terminate, record, reset; `direction` rising, falling, both.

    Those that the derivation adds have the actions stop, friction, and jump, which `says` what jumps.
    """

    name: str
    when: Expr
    direction: str = "both"
    action: str = "record"
    resets: tuple[Reset, ...] = ()
    says: str = ""


@dataclass(frozen=True)
class StartEquation:
    """An expression that is zero where a run begins, of a `unit` if it was compared with a quantity; `text` says it.

    `key` is its place in the table `start`.
    """

    expression: Expr
    text: str
    key: str
    unit: str | None = None


@dataclass(frozen=True)
class StartConditions:
    """What holds where a run begins, besides the constraints; guesses move, and so do the parameters that are sought.

    `equations` hold there; `find` names parameters. The coordinates (or rates, or states) of `steady` are at rest and
    stay so, `everything` is all whose rates are not given. Gaps of the stops `closed` are zero, with their rates.
    """

    equations: tuple[StartEquation, ...] = ()
    find: tuple[str, ...] = ()
    steady: tuple[str, ...] = ()
    everything: bool = False
    closed: tuple[str, ...] = ()

    @property
    def is_steady(self) -> bool:
        """Whether anything is at rest."""
        return self.everything or bool(self.steady)


@dataclass(frozen=True)
class Drawing:
    """What is drawn besides bodies and joints: `kind` as in `symgen.model.parts.KINDS`, vectors in world axes.

    The vectors are places [m]; the second one of a force is the force [N].
    """

    name: str
    kind: str
    vectors: tuple[tuple[Expr, ...], ...]


@dataclass(frozen=True)
class Winding:
    """Angles that a bushing or a spring pushes back over and that jump where it is wound up too far.

    `kind` is "bushing" or "spring"; the angles of a bushing in space are those about x, y and z.
    """

    name: str
    kind: str
    angles: tuple[Expr, ...]


@dataclass(frozen=True)
class Limit:
    """Numbers that parameters make, at an address of the model, and what they have to be at all parameters.

    `bound` is one of `symgen.runtime.graph.bounds`, which says how many numbers it is about.
    """

    name: str
    bound: str
    numbers: tuple[Expr, ...]


@dataclass(frozen=True)
class Port:
    """What an assembly is given by the model that uses it: `kind` is one of `assemblies.PORT_KINDS`."""

    name: str
    kind: str
    unit: str | None = None


@dataclass(frozen=True)
class Given:
    """What a use of an assembly gives: under a `key`, an expression, a number or (of elements) a name.

    `kind` is that of a port, "parameter", "free" for a parameter that only the model has, or "place" for where the
    assembly stands; `unit` is what the assembly has it in. What is not `said` is the model's own of that name.
    """

    key: str
    kind: str
    value: Expr | str | float
    unit: str | None = None
    said: bool = True


@dataclass(frozen=True)
class Use:
    """A use of an assembly: all that it has is called `NAME.…` in the model."""

    name: str
    assembly: str
    given: tuple[Given, ...]


@dataclass(frozen=True)
class Description:
    """A mechanical system as the user described it.

    Expressions are trees (`algebra.py`) over plain `Symbol(name)` (parameters, constants, coordinates, inputs,
    definitions, `t`) and the opaque functions of `symgen.model.functions` (`dot`, `minimum`, `maximum`).
    A definition's symbol stands for its expression; definitions come in an order in which each uses
    only those before it; they may use the names of points and axes. `gravity` is an acceleration vector; `field` is a
    potential per mass of `here_x`, `here_y`, `here_z`, and `gravitation` the constant with which bodies attract each
    other.

    `coordinates` are in the order of q, `rates` in that of v: a joint's three angular velocities stand where its
    four quaternion elements stand. Every joint comes after the joint of its parent. A body that is the child of
    a joint has `com` in its own frame; the frame of any other stands at its centre of mass, with its axes.
    `forces` are by the names of rates, as are resets of rates; in a finished description those of `states` are their
    derivatives. `units_of_outputs` and `units_of_multipliers` have those names whose dimension follows from the units
    that were given; `limits`, what is required of parameters, is found with them.
    """

    name: str
    coordinates: tuple[Coordinate, ...]
    description: str = ""
    parameters: tuple[Parameter, ...] = ()
    constants: tuple[Constant, ...] = ()
    inputs: tuple[Input, ...] = ()
    definitions: tuple[tuple[str, Expr], ...] = ()
    bodies: tuple[Body, ...] = ()
    gravity: tuple[Expr, Expr, Expr] | None = None
    kinetic: Expr | None = None
    potential: Expr | None = None
    dissipation: Expr | None = None
    forces: tuple[tuple[str, Expr], ...] = ()
    loads: tuple[Load, ...] = ()
    rubbing: tuple[tuple[Expr, Expr], ...] = ()
    constraints: tuple[Constraint, ...] = ()
    velocity_constraints: tuple[Constraint, ...] = ()
    outputs: tuple[tuple[str, Expr], ...] = ()
    events: tuple[Event, ...] = ()
    run: MappingProxyType[str, Any] = default(default_factory=lambda: MappingProxyType({}))
    folder: Path | None = None
    rates: tuple[Rate, ...] = ()
    joints: tuple[Joint, ...] = ()
    points: tuple[Point, ...] = ()
    axes: tuple[Axis, ...] = ()
    loops: tuple[Loop, ...] = ()
    stops: tuple[Stop, ...] = ()
    frictions: tuple[Friction, ...] = ()
    bristles: tuple[Bristle, ...] = ()
    contacts: tuple[Contact, ...] = ()
    pairs: tuple[ContactPair, ...] = ()
    drawings: tuple[Drawing, ...] = ()
    impacts: str = "simultaneous"
    frames: tuple[Frame, ...] = ()
    springs: tuple[Spring, ...] = ()
    bushings: tuple[Bushing, ...] = ()
    field: Expr | None = None
    gravitation: Expr | None = None
    attractors: tuple[Attractor, ...] = ()
    rolling: tuple[Rolling, ...] = ()
    units_of_outputs: Mapping[str, str] = default(default_factory=lambda: MappingProxyType({}))
    units_of_multipliers: Mapping[str, str] = default(default_factory=lambda: MappingProxyType({}))
    states: tuple[State, ...] = ()
    tables: tuple[Table, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    closures: tuple[Closure, ...] = ()
    rotors: tuple[Rotor, ...] = ()
    uses: tuple[Use, ...] = ()
    start: StartConditions | None = None
    balanced: tuple[str, ...] = ()
    windings: tuple[Winding, ...] = ()
    limits: tuple[Limit, ...] = ()

    def __post_init__(self) -> None:
        if not self.rates:
            object.__setattr__(self, "rates", tuple(map(plain_rate, self.coordinates)))


def plain_rate(c: Coordinate) -> Rate:
    """The time derivative of a coordinate as an element of v."""
    return Rate(c.name, c.unit and f"{c.unit}/s", c.rate, c.rate_guess, c.name, c.rate_formula)
