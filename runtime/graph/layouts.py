"""What each function of the ABI writes, in blocks, by which one half joins subsystems and the other cuts them apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class Lengths(NamedTuple):
    """How many values a function may read and write: an index beyond them is refused, not compiled."""

    y: int
    p: int
    out: int


# In order, as (rows, columns): an axis joins vectors over coordinates (q), rates (v), holonomic constraints (h), all
# constraints (c), entries of poses (p) and shapes (s); a vector has one column. POWER, RATIO and ENERGY are numbers
# that all subsystems make together.
POWER, RATIO, ENERGY = "power", "ratio", "energy"
LAYOUTS: dict[str, tuple] = {
    "rhs": (("q", ""), ("v", ""), POWER, ("c", ""), RATIO),
    "kinematics": (("q", "v"), ("q", "q")),
    "mass_matrix": (("v", "v"),),
    "forces": (("v", ""),),
    "energy": (ENERGY, ENERGY),
    "residual": (("vc", ""),),
    "residual_jacobian": (("vc", "qvvc"),),
    "constraint_residual": (("hc", ""),),
    "constraint_jacobian": (("c", "v"),),
    "gamma": (("c", ""),),
    "project": (("qvhc", ""),),
    "solve": (("vc", ""), ("c", "")),
    "poses": (("p", ""),),
    "shapes": (("s", ""),),
}

_SETTINGS = {"stop": ("closed",), "friction": ("stuck", "sense")}
_SETTINGS_IN_A_PLANE = {1: ("turns",), 2: ("aimed", "angle", "bound")}


def settings_of(switch: Mapping[str, Any]) -> tuple[str, ...]:
    """What `p` says of a stop or a friction, by its record in the header.

    A stop is closed (1) or open (0); a friction sticks or not, and slides forwards (1), backwards (-1) or not at all.
    Of a friction with two directions, records 1 and 2, senses are the direction of sliding. It turns with the motion,
    or is aimed: fixed while the motion begins, until the force across exceeds an angle [rad] times the friction, or the
    speed a bound; what turns is looked at again where the speed falls below that.
    """
    return _SETTINGS[switch["kind"]] + _SETTINGS_IN_A_PLANE.get(switch.get("axis"), ())


LATE = (
    "residual_jacobian",
    "closed_residual_jacobian",
)  # what a module may leave out until a run asks for it

# The function of the numbers that parameters make and that have a bound, and the key of the header that has these.
LIMITS = "limits"

# What robot programs call, in modules of their own (docs/abi.md), and the same for each frame: `pose_tool`.
ROBOT_FUNCTIONS = (
    "inverse_dynamics", "inverse_dynamics_derivatives", "forward_dynamics", "forward_dynamics_derivatives",
    "mass_matrix", "coriolis_matrix", "gravity", "energy", "centre_of_mass", "momentum", "momentum_matrix", "regressor",
    "equilibrium_torques",
)  # fmt: skip
BASE_PARAMETERS = "base_parameters"  # comes with the regressor
FRAME_FUNCTIONS = ("pose_", "jacobian_", "jacobian_rate_", "drift_")
