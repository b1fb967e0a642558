"""A robot as a model: links become bodies, joints joints, numbers parameters, mimics gears."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from ..errors import ModelError, nearest
from ..model.evaluate import quarter_turns
from ..model.joint_types import TYPES
from ..model.model import Model
from .naming import WORLD, Naming, identifier
from .pictures import Painter, Pictures
from .urdf import Link, Robot, RobotJoint, Vector, read_urdf

BASES = ("fixed", "free")
EARTH = (0, 0, "-9.81 m/s^2")
ROOT_JOINT = "root"
_TYPES = {"floating": "free"}
_REST = {"fixed": (), "free": (0, 0, 0, 1, 0, 0, 0)}  # where joints start
_INERTIA_KEYS = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
_LAST_DIGITS = 1e-10  # rad; right angles with more than ten digits are not worth a word
_ROUND_OFF = 1e-9  # of the largest moment: a negative one of this size is not worth a word


@dataclass
class Import:
    """A robot's model, and how its names and the model's belong together.

    Attributes
    ----------
    robot : Robot
        As the file has it.
    base : str
        "fixed" or "free".
    model : Model
    bodies, joints : dict of str to str
        Names in the model by those in the file.
    notes : list of str
        What was left out or is odd, a sentence each.
    """

    robot: Robot
    base: str
    model: Model
    bodies: dict[str, str] = field(default_factory=dict)
    joints: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def import_urdf(
    path: str | Path,
    base: str = "fixed",
    expose: Iterable[str] | None = None,
    motors: bool = True,
    gravity: Sequence[float | str] = EARTH,
    make: type[Model] = Model,
    pictures: Pictures | None = None,
    start: Mapping[str, float | str] = MappingProxyType({}),
) -> Import:
    """Read a robot from a URDF file, and say how names belong together and what was left out.

    Parameters
    ----------
    path, base, expose, motors, gravity, start
        See `symgen.Model.from_urdf`.
    make : type
        What the model shall be.
    pictures : Pictures, optional
        Where those of links with meshes go; without it nothing is drawn.

    Raises
    ------
    ModelError
        Names the file, the line and the element.
    """
    if base not in BASES:
        raise ModelError(f"the base is not {base!r:.60}", key="base", hint=nearest(str(base)[:60], BASES))
    builder = _Builder(read_urdf(path), base, expose, motors, gravity, make, pictures, start)
    with builder.model._reading():
        return builder.build()


class _Builder:
    def __init__(
        self,
        robot: Robot,
        base: str,
        expose: Iterable[str] | None,
        motors: bool,
        gravity: Sequence[float | str],
        make: type[Model],
        pictures: Pictures | None,
        start: Mapping[str, float | str],
    ):
        self._start, self._started = start, set()
        self._robot, self._base, self._motors = robot, base, motors
        described = f"Robot {robot.name!r:.60}, from {Path(robot.file).name!r:.60}"
        folder = Path(robot.file).parent
        if pictures is not None and pictures.folder is not None:
            folder = pictures.folder.parent
        self._model = self.model = make(identifier(robot.name), described, gravity=gravity, folder=folder)
        self._naming = Naming(self._model, robot.file, expose)
        self._name, self._number = self._naming.name, self._naming.number
        self._result = Import(robot, base, self._model, notes=list(robot.slips))
        self._painter = (
            None
            if pictures is None
            else Painter(pictures, Path(robot.file), self._result.notes.append, robot.links.values())
        )

    def build(self) -> Import:
        robot, result = self._robot, self._result
        moving = self._moving()
        if self._base == "fixed" and not moving:
            raise robot.root.place.error(
                "nothing moves: it has no joint that moves a mass", "let its base move freely (--base free)"
            )
        for joint in robot.joints:  # coordinates have the joints' names, so these come first
            result.joints[joint.name] = self._name(joint.name, _TYPES.get(joint.type, joint.type))
        self._root()
        for joint in robot.joints:
            self._body(robot.links[joint.child])
        for joint in robot.joints:
            self._joint(joint, joint.name in moving)
        for joint in robot.joints:
            if joint.mimic is not None and joint.name in moving:
                self._mimic(joint, *joint.mimic)
        self._right_angles()
        if self._painter is not None:
            self._painter.finish()
        self._naming.check_patterns()
        self._check_starts()
        return result

    def _check_starts(self) -> None:
        """Refuse starts of coordinates that there are not."""
        for name in self._start:
            if name not in self._started:
                known = [q.name for q in self._model.describe().coordinates]
                raise ModelError(
                    f"{name!r:.60} is no coordinate of the robot", file=self._robot.file, key="start",
                    hint=nearest(str(name)[:60], known, "coordinates"),
                )  # fmt: skip

    def _starts(self, joint: str, kind: str, usual: Sequence[float]) -> list[float | str] | None:
        """Where a joint's coordinates start, `usual` where it is not said of all; None where it is said of none."""
        names = TYPES[kind].coordinate_names(joint)
        given = self._start.keys() & set(names)
        self._started |= given
        return [self._start.get(name, x) for name, x in zip(names, usual, strict=True)] if given else None

    def _moving(self) -> set[str]:
        """The joints that move something that has mass, by themselves or through joints that mimic them."""
        massive = {link.name for link in self._robot.links.values() if link.mass or any(link.inertia)}
        for joint in reversed(self._robot.joints):
            if joint.child in massive:
                massive.add(joint.parent)
        found = {
            joint.name for joint in self._robot.joints if joint.type != "fixed" and joint.child in massive
        }
        followed = {joint.name: joint.mimic[0] for joint in self._robot.joints if joint.mimic is not None}
        for name in list(found):
            while (name := followed.get(name)) is not None and name not in found:
                found.add(name)
        return found

    def _body(self, link: Link) -> None:
        name = self._result.bodies[link.name] = self._name(link.name)
        more = {} if self._painter is None else {"shape": self._painter.shape(link, name)}
        if not link.mass and not any(link.inertia):
            self._model.body(name, mass=0, com=(0, 0, 0), **more)
            return
        tensor = self._possible_inertia(link)
        mass = self._number(link.name, "mass", link.mass, "kg")
        com = [
            self._number(link.name, f"com_{axis}", x, "m") for axis, x in zip("xyz", link.com, strict=True)
        ]
        inertia = [
            self._number(link.name, key, x, "kg*m^2") for key, x in zip(_INERTIA_KEYS, tensor, strict=True)
        ]
        shown = None if not any(tensor) and not self._naming.is_chosen else inertia
        self._model.body(name, mass=mass, com=com, inertia=shown, **more)

    def _right_angles(self) -> None:
        """Say what models make of angles that are right but for the digits that the file leaves out."""
        angles = [x for joint in self._robot.joints for x in joint.rpy]
        off = [abs(x - n * (math.pi / 2)) for x in angles if (n := quarter_turns(x)) is not None]
        rounded = [x for x in off if x > _LAST_DIGITS]
        if rounded:
            self._result.notes.append(
                f"{len(rounded)} angles of joints are right but for the last digits, and taken as right: "
                f"at most {max(rounded):.1e} rad"
            )

    def _possible_inertia(self, link: Link) -> tuple[float, ...]:
        """The tensor in the link's axes, without negative moments; other things that no body has are said and kept."""
        tensor, (a, b, c) = inertia_in_link(link.inertia, link.rpy)
        place = f"line {link.place.line}: the link {link.name!r:.60}"
        if a < -_ROUND_OFF * c:
            self._result.notes.append(
                f"{place} has a negative principal moment of inertia, {a:.4g} kg m^2; it is taken as 0"
            )
        elif 0 <= a and a + b < c * (1 - 1e-6):
            self._result.notes.append(
                f"{place} has principal moments that no rigid body has, and they are kept: "
                f"{a:.4g} + {b:.4g} < {c:.4g} kg m^2"
            )
        return tensor

    def _root(self) -> None:
        """The first link, fixed to the world or free; one that is called so and stays there is the world."""
        root = self._robot.root
        if self._base == "fixed" and root.name == WORLD:
            self._result.bodies[root.name] = WORLD
            return
        self._body(root)
        name = self._name(ROOT_JOINT, self._base)
        self._model.joint(
            name,
            self._base,
            self._result.bodies[root.name],
            start=self._starts(name, self._base, _REST[self._base]),
        )

    def _joint(self, joint: RobotJoint, moves: bool) -> None:
        bodies, name = self._result.bodies, self._result.joints[joint.name]
        origin = {key: value for key, value in (("xyz", joint.xyz), ("rpy", joint.rpy)) if any(value)}
        kind = _TYPES.get(joint.type, joint.type)
        if joint.type != "fixed" and not moves:
            self._result.notes.append(
                f"line {joint.place.line}: the joint {joint.name!r:.60} moves nothing that has mass, and is held fixed"
            )
            kind = "fixed"
        more: dict[str, object] = {}
        if kind not in ("fixed", "free"):
            more["axis"] = joint.axis
        if kind in ("revolute", "continuous", "prismatic"):
            linear = kind == "prismatic"
            more |= {
                key: self._number(joint.name, key, value, unit)
                for key, value, unit in (
                    ("damping", joint.damping, "N*s/m" if linear else "N*m*s"),
                    ("armature", joint.armature, "kg" if linear else "kg*m^2"),
                )
            }
            more = {key: value for key, value in more.items() if value != 0.0}
            if joint.limits:
                lower, upper = joint.limits
                more["limits"] = joint.limits
                # What mimics starts where the joint that it follows says.
                more["start" if joint.mimic is None else "guess"] = min(max(0.0, lower), upper)
        starts = self._starts(name, kind, _REST.get(kind, (0.0,) * TYPES[kind].nq))
        if starts is not None:
            more = {key: value for key, value in more.items() if key != "guess"}
            more["start"] = starts if len(starts) > 1 else starts[0]
        self._model.joint(name, kind, bodies[joint.child], bodies[joint.parent], origin or None, **more)
        if kind in ("revolute", "continuous", "prismatic"):
            self._forces(joint, name, "force" if linear else "torque")

    def _forces(self, joint: RobotJoint, name: str, what: str) -> None:
        """Dry friction, and the input of the motor."""
        level = self._number(joint.name, "friction", joint.friction, "N" if what == "force" else "N*m")
        if level != 0.0:
            self._model.friction(self._name(f"{name}_friction"), coordinate=name, **{what: level})
        if self._motors and joint.mimic is None:
            motor = self._name(f"{name}_{what}")
            self._model.input(motor, "N" if what == "force" else "N*m")
            self._model.force(name, motor)

    def _mimic(self, joint: RobotJoint, followed: str, ratio: float, offset: float) -> None:
        first, second = self._result.joints[joint.name], self._result.joints[followed]
        self._model.gear(self._name(f"{first}_mimic"), first, second, ratio, offset)


def inertia_in_link(
    inertia: Sequence[float], rpy: Vector
) -> tuple[tuple[float, ...], tuple[float, float, float]]:
    """Return a tensor in the axes of the link, and its principal moments.

    Parameters
    ----------
    inertia : sequence of 6
        Ixx, Iyy, Izz, Ixy, Ixz, Iyz in the axes of the inertial frame [kg m^2].
    rpy : tuple of 3 floats
        Roll, pitch and yaw of that frame: about the fixed axes x, y, z of the link, in this order [rad].

    Returns
    -------
    tensor : tuple of 6 floats
        R I Rᵀ; negative principal moments are taken as 0.
    moments : tuple of 3 floats
        As they are in the file, smallest first.
    """
    # Models are built without NumPy, which takes longer to load than most of them; robots are not.
    import numpy as np

    xx, yy, zz, xy, xz, yz = inertia
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(x), math.cos(x)) for x in rpy)
    turn = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    tensor = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    moments, axes = np.linalg.eigh(tensor)
    if moments[0] < 0.0:
        tensor = axes @ np.diag(np.maximum(moments, 0.0)) @ axes.T
    return tuple(tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()), tuple(moments.tolist())
