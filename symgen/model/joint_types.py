"""What kinds of joints there are: their coordinates, rates and axes."""

from __future__ import annotations

from dataclasses import dataclass

ANGLE, LENGTH = "rad", "m"
QUATERNION = ("_qw", "_qx", "_qy", "_qz")
ANGULAR_VELOCITY = ("_wx", "_wy", "_wz")


@dataclass(frozen=True)
class JointType:
    """A type of joint.

    `suffixes` and `units` are those of its coordinates without the quaternion, whose names are the joint's name
    and the suffix; `velocities` are the suffixes of rates that have names of their own; `axes` counts its axes.
    """

    suffixes: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    axes: int = 0
    quaternion: bool = False
    velocities: tuple[str, ...] = ()

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

    def coordinate_names(self, joint: str) -> tuple[str, ...]:
        """The names that its coordinates have where none are given."""
        return tuple(joint + s for s in (*self.suffixes, *(QUATERNION if self.quaternion else ())))


TYPES = {
    "revolute": JointType(("",), (ANGLE,), axes=1),
    "continuous": JointType(("",), (ANGLE,), axes=1),
    "prismatic": JointType(("",), (LENGTH,), axes=1),
    "universal": JointType(("_1", "_2"), (ANGLE, ANGLE), axes=2),
    "cylindrical": JointType(("_angle", "_slide"), (ANGLE, LENGTH), axes=1),
    "planar": JointType(("_x", "_y", "_angle"), (LENGTH, LENGTH, ANGLE), axes=1),
    "spherical": JointType(quaternion=True),
    "free": JointType(("_x", "_y", "_z"), (LENGTH,) * 3, quaternion=True, velocities=("_vx", "_vy", "_vz")),
    "fixed": JointType(),
}
