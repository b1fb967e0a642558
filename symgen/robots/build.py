"""A robot as a model: links become bodies, joints joints, numbers parameters, mimics gears."""

from __future__ import annotations

import fnmatch
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import ModelError, nearest
from ..model.model import Model
from ..model.names import LONGEST_NAME, name_fault
from .urdf import Link, Robot, RobotJoint, Vector, read_urdf

BASES = ("fixed", "free")
EARTH = (0, 0, "-9.81 m/s^2")
ROOT_JOINT, WORLD = "root", "world"
_TYPES = {"floating": "free"}
_INERTIA_KEYS = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass
class Import:
    """A robot's model, and how its names and the model's belong together.

    Attributes
    ----------
    model : Model
    bodies, joints : dict of str to str
        Names in the model by those in the file.
    notes : list of str
        What was left out or is odd, a sentence each.
    """

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
) -> Import:
    """Read a robot from a URDF file, and say how names belong together and what was left out.

    Parameters
    ----------
    path, base, expose, motors, gravity
        See `symgen.Model.from_urdf`.
    make : type
        What the model shall be.

    Raises
    ------
    ModelError
        Names the file, the line and the element.
    """
    if base not in BASES:
        raise ModelError(f"the base is not {base!r:.60}", key="base", hint=nearest(str(base)[:60], BASES))
    return _Builder(read_urdf(path), base, expose, motors, gravity, make).build()


class _Builder:
    def __init__(
        self,
        robot: Robot,
        base: str,
        expose: Iterable[str] | None,
        motors: bool,
        gravity: Sequence[float | str],
        make: type[Model],
    ):
        self._robot, self._base, self._motors = robot, base, motors
        self._patterns = None if expose is None else list(expose)
        self._matched: set[str] = set()
        self._taken = {WORLD}  # in lower case
        stem = _identifier(robot.name)
        described = f"Robot {robot.name!r:.60}, from {Path(robot.file).name!r:.60}"
        self._model = make(stem, described, gravity=gravity, folder=Path(robot.file).parent)
        self._result = Import(self._model)

    def build(self) -> Import:
        robot, result = self._robot, self._result
        massive = self._with_mass_below()
        if self._base == "fixed" and not any(self._moves(joint, massive) for joint in robot.joints):
            raise robot.root.place.error(
                "nothing moves: it has no joint that moves a mass", "let its base move freely"
            )
        for joint in robot.joints:  # coordinates have the joints' names, so these come first
            result.joints[joint.name] = self._name(joint.name)
        self._root()
        for joint in robot.joints:
            self._body(robot.links[joint.child])
        for joint in robot.joints:
            self._joint(joint, self._moves(joint, massive))
        for joint in robot.joints:
            if self._moves(joint, massive):
                self._mimic(joint)
        for pattern in self._patterns or ():
            if pattern not in self._matched:
                raise ModelError(
                    f"{pattern[:60]!r} fits no number of the robot", file=robot.file, key="expose",
                    hint="numbers are LINK.mass, .com_x, .Ixx and the like, JOINT.damping, .friction, .armature",
                )  # fmt: skip
        return result

    @staticmethod
    def _moves(joint: RobotJoint, massive: set[str]) -> bool:
        return joint.type != "fixed" and joint.child in massive

    def _with_mass_below(self) -> set[str]:
        """The links below which, themselves included, something has mass."""
        found = {link.name for link in self._robot.links.values() if link.mass or any(link.inertia)}
        for joint in reversed(self._robot.joints):
            if joint.child in found:
                found.add(joint.parent)
        return found

    def _name(self, source: str) -> str:
        """A name of the model for one of the file, unique among all of them."""
        stem = _identifier(source)
        name, number = stem, 2
        while name.lower() in self._taken or name_fault(name) is not None:
            name, number = f"{stem}_{number}", number + 1
        self._taken.add(name.lower())
        return name

    def _number(self, source: str, key: str, value: float, unit: str, most: bool = True) -> float | str:
        """A number of a link or joint: a parameter's name where it is exposed, itself otherwise."""
        exposed = most and value != 0
        if self._patterns is not None:
            fitting = [p for p in self._patterns if fnmatch.fnmatchcase(f"{source}.{key}", p)]
            self._matched.update(fitting)
            exposed = bool(fitting)
        if not exposed:
            return value
        name = self._name(f"{source}_{key}")
        doc = f"{key} of {source!r:.60}"
        self._model.parameter(name, value, doc, unit)
        return name

    def _body(self, link: Link) -> None:
        name = self._result.bodies[link.name] = self._name(link.name)
        if not link.mass and not any(link.inertia):
            self._model.body(name, mass=0, com=(0, 0, 0))
            return
        tensor = self._possible_inertia(link)
        mass = self._number(link.name, "mass", link.mass, "kg")
        com = [
            self._number(link.name, f"com_{axis}", x, "m") for axis, x in zip("xyz", link.com, strict=True)
        ]
        inertia = [
            self._number(link.name, key, x, "kg*m^2") for key, x in zip(_INERTIA_KEYS, tensor, strict=True)
        ]
        shown = None if not any(tensor) and self._patterns is None else inertia
        self._model.body(name, mass=mass, com=com, inertia=shown)

    def _possible_inertia(self, link: Link) -> tuple[float, ...]:
        """The tensor in the link's axes, without negative moments; other things that no body has are said and kept."""
        tensor = _turned(link.inertia, link.rpy)
        moments, axes = _principal(tensor)
        place = f"line {link.place.line}: the link {link.name!r:.60}"
        a, b, c = moments
        if a < 0:
            if a < -1e-9 * c:
                self._result.notes.append(
                    f"{place} has a negative principal moment of inertia, {a:.4g} kg m^2; it is taken as 0"
                )
            return _tensor([max(x, 0.0) for x in moments], axes)
        if a + b < c * (1 - 1e-6):
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
        kind = "free" if self._base == "free" else "fixed"
        self._model.joint(self._name(ROOT_JOINT), kind, self._result.bodies[root.name])

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
                more["start"] = min(max(0.0, lower), upper)
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

    def _mimic(self, joint: RobotJoint) -> None:
        if joint.mimic is None:
            return
        followed, ratio, offset = joint.mimic
        first, second = self._result.joints[joint.name], self._result.joints[followed]
        self._model.gear(self._name(f"{first}_mimic"), first, second, ratio, offset)


def _identifier(source: str) -> str:
    """A name that models may have, as near to a given one as can be."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", source)[: LONGEST_NAME - 20]
    if not name[:1].isalpha():
        name = f"n{name}" if name[:1].isdigit() else f"n_{name.lstrip('_')}"
    return name if name_fault(name) is None else f"{name}_"


def rotation(rpy: Vector) -> list[list[float]]:
    """The rotation matrix of roll, pitch and yaw: about the fixed axes x, y, z, in this order."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(x), math.cos(x)) for x in rpy)
    return [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]


def _turned(inertia: Sequence[float], rpy: Vector) -> tuple[float, ...]:
    """The tensor in the axes of the link: R I Rᵀ."""
    if not any(rpy):
        return tuple(inertia)
    xx, yy, zz, xy, xz, yz = inertia
    tensor, turn = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], rotation(rpy)
    half = [[sum(turn[i][k] * tensor[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    full = [[sum(half[i][k] * turn[j][k] for k in range(3)) for j in range(3)] for i in range(3)]
    return tuple(full[i][j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def _principal(inertia: Sequence[float]) -> tuple[list[float], list[list[float]]]:
    """Principal moments, smallest first, and their axes as columns."""
    from numpy.linalg import (
        eigh,  # models are built without NumPy, which takes longer to load than most of them
    )

    xx, yy, zz, xy, xz, yz = inertia
    moments, axes = eigh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return moments.tolist(), axes.tolist()


def _tensor(moments: Sequence[float], axes: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """Ixx, Iyy, Izz, Ixy, Ixz, Iyz of principal moments and axes."""
    return tuple(
        sum(moments[k] * axes[i][k] * axes[j][k] for k in range(3))
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    )
