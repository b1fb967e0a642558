"""What kinds of joints there are: one record each, which everything else about joints reads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from .evaluate import Direction, X, Y, Z, cross_product, perpendicular

if TYPE_CHECKING:
    from .description import Joint

ANGLE, LENGTH = "rad", "m"
QUATERNION = ("_qw", "_qx", "_qy", "_qz")
ANGULAR_VELOCITY = ("_wx", "_wy", "_wz")


@dataclass(frozen=True)
class Element:
    """One elementary motion of a joint; joints with several make them one after another.

    Attributes
    ----------
    motion : str
        "turn" about a direction, "slide" along it, "screw" (both, by the joint's pitch), or "ball": any turn.
    coordinate : int
        Index of its coordinate, the first one of a ball's quaternion, among those of the joint.
    direction : callable
        Of the joint: a unit vector in the frame that the elements before have left.
    """

    motion: str
    coordinate: int = 0
    direction: Callable[[Joint], Direction] = lambda joint: joint.axis


@dataclass(frozen=True)
class JointType:
    """A type of joint.

    Attributes
    ----------
    elements : tuple of Element
        Its motion, from the parent to the child; the motion subspace follows from them.
    suffixes, units : tuple of str
        Of its coordinates without the quaternion, whose names are the joint's name and the suffix.
    axes : int
        How many axes it has.
    velocities : tuple of str
        Suffixes of rates that have names of their own.
    plane : str
        Where it keeps a planar child in the x-y plane: "normal" if its axis is z, "along" if its axis is in the plane,
        "always"; empty: never.
    limited : bool
        Whether its coordinate may have limits.
    options : tuple of str
        Keys that it needs and others do not have.
    marks : tuple of (str, str)
        What pictures show: the kind of mark, and the axis that it stands on ("" for none).
    holds : bool
        Whether it holds its child in a place, so that a joint on the world stands on ground.
    """

    elements: tuple[Element, ...] = ()
    suffixes: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    axes: int = 0
    velocities: tuple[str, ...] = ()
    plane: str = ""
    limited: bool = False
    options: tuple[str, ...] = ()
    marks: tuple[tuple[str, str], ...] = ()
    holds: bool = True

    @property
    def quaternion(self) -> bool:
        """Whether the last of its coordinates are a unit quaternion."""
        return any(element.motion == "ball" for element in self.elements)

    @property
    def nq(self) -> int:
        """Number of coordinates."""
        return len(self.suffixes) + 4 * self.quaternion

    @property
    def nv(self) -> int:
        """Number of rates."""
        return len(self.suffixes) + 3 * self.quaternion

    @property
    def elastic(self) -> bool:
        """Whether its coordinates measure a displacement that a spring can act on."""
        return bool(self.suffixes) and not self.quaternion

    @property
    def hinge(self) -> bool:
        """Whether all that it does is to turn about an axis."""
        return [element.motion for element in self.elements] == ["turn"]

    def coordinate_names(self, joint: str) -> tuple[str, ...]:
        """The names that its coordinates have where none are given."""
        return tuple(joint + s for s in (*self.suffixes, *(QUATERNION if self.quaternion else ())))


def _second_in_plane(joint: Joint) -> Direction:
    return perpendicular(joint.axis)


def _first_in_plane(joint: Joint) -> Direction:
    return tuple(x + 0.0 for x in cross_product(_second_in_plane(joint), joint.axis))


def sequence_fault(given: object) -> bool:
    """Whether this names no three successive rotations, such as "zxz"."""
    if not isinstance(given, str) or len(given) != 3 or not set(given) <= set("xyz"):
        return True
    return given[0] == given[1] or given[1] == given[2]


def _of_sequence(k: int) -> Callable[[Joint], Direction]:
    """The k-th axis of successive rotations, in the frame that those before have left."""
    return lambda joint: {"x": X, "y": Y, "z": Z}[joint.sequence[k]]


def _gimbal(first: int) -> tuple[Element, ...]:
    """Three successive rotations, whose angles begin with this coordinate."""
    return tuple(Element("turn", first + k, _of_sequence(k)) for k in range(3))


_SLIDES = tuple(Element("slide", k, lambda joint, axis=axis: axis) for k, axis in enumerate((X, Y, Z)))
_HINGE = JointType((Element("turn"),), ("",), (ANGLE,), axes=1, plane="normal", marks=(("pin", "axis"),))
TYPES = {
    "revolute": replace(_HINGE, limited=True),
    "continuous": _HINGE,
    "prismatic": JointType(
        (Element("slide"),),
        ("",),
        (LENGTH,),
        axes=1,
        plane="along",
        limited=True,
        marks=(("slide", "axis"),),
    ),
    "screw": JointType(
        (Element("screw"),),
        ("",),
        (ANGLE,),
        axes=1,
        limited=True,
        options=("pitch",),
        marks=(("slide", "axis"),),
    ),
    "universal": JointType(
        (Element("turn"), Element("turn", 1, lambda joint: joint.axis2)),
        ("_1", "_2"),
        (ANGLE, ANGLE),
        axes=2,
        marks=(("pin", "axis"), ("pin", "axis2")),
    ),
    "cylindrical": JointType(
        (Element("slide", 1), Element("turn", 0)),
        ("_angle", "_slide"),
        (ANGLE, LENGTH),
        axes=1,
        marks=(("slide", "axis"),),
    ),
    "planar": JointType(
        (Element("slide", 0, _first_in_plane), Element("slide", 1, _second_in_plane), Element("turn", 2)),
        ("_x", "_y", "_angle"),
        (LENGTH, LENGTH, ANGLE),
        axes=1,
        plane="normal",
        holds=False,
    ),
    "spherical": JointType((Element("ball"),), marks=(("ball", ""),)),
    "free": JointType(
        (*_SLIDES, Element("ball", 3)),
        ("_x", "_y", "_z"),
        (LENGTH,) * 3,
        velocities=("_vx", "_vy", "_vz"),
        holds=False,
    ),
    "gimbal": JointType(
        _gimbal(0), ("_1", "_2", "_3"), (ANGLE,) * 3, options=("sequence",), marks=(("ball", ""),)
    ),
    "floating": JointType(
        (*_SLIDES, *_gimbal(3)),
        ("_x", "_y", "_z", "_1", "_2", "_3"),
        (LENGTH,) * 3 + (ANGLE,) * 3,
        options=("sequence",),
        holds=False,
    ),
    "fixed": JointType(plane="always", holds=False),
}
