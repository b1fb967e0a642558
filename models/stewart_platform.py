"""Stewart platform: a plate on six legs that push and pull, each a closed loop of joints."""

from math import atan2, cos, hypot, pi, sin

import symgen
from symgen import Model, dot, t

BASE_RADIUS, PLATE_RADIUS, HEIGHT = 0.6, 0.35, 0.7
BASE_SPREAD, PLATE_SPREAD = 0.25, 0.85  # half the angle between neighbouring feet, heads [rad]


def build(stiffness=6000.0, damping=60.0) -> Model:
    """Describe the platform.

    Parameters
    ----------
    stiffness : float
        Of each leg [N/m].
    damping : float
        Of each leg [N s/m].
    """
    model = Model("stewart_platform", description="Stewart platform: six legs with actuators shake a plate")
    g, k, c = model.parameters(g="9.81 m/s^2", k=f"{stiffness} N/m", c=f"{damping} N*s/m")
    amplitude, omega = model.parameters(amplitude="0.04 m", omega="6 rad/s")
    model.gravity(z=-g)
    model.body("plate", mass="12 kg", inertia=(0.5, 0.5, 0.9), shape={"cylinder": [PLATE_RADIUS, 0.04]})
    model.joint("base", type="free", child="plate", guess=[0, 0, HEIGHT, 1, 0, 0, 0])
    for leg in range(6):
        _leg(model, leg, k, c, amplitude, omega)
    model.output("height", "base_z")
    model.run(t_end=4.0, fps=60)
    return model


def _leg(model, leg, k, c, amplitude, omega):
    """A cylinder on a universal joint, a rod that slides in it, and a ball at the plate that closes the loop."""
    foot, head = _places(leg)
    reach = [b - a for a, b in zip(foot, head, strict=True)]
    length = hypot(*reach)
    # The joint frame's z axis points from foot to head where the plate is in its middle.
    lean, turn = atan2(hypot(reach[0], reach[1]), reach[2]), atan2(reach[1], reach[0])
    model.body(
        f"cylinder{leg}", mass="1.5 kg", com=(0, 0, 0.25), inertia=(0.032, 0.032, 0.001),
        shape={"cylinder": [0.03, 0.5]},
    )  # fmt: skip
    model.body(
        f"rod{leg}",
        mass="0.6 kg",
        com=(0, 0, -0.22),
        inertia=(0.01, 0.01, 0.0002),
        shape={"cylinder": [0.015, 0.44]},
    )
    model.joint(
        f"foot{leg}", type="universal", child=f"cylinder{leg}", origin={"xyz": foot, "rpy": (0, lean, turn)},
        axis=(1, 0, 0), axis2=(0, 1, 0),
    )  # fmt: skip
    slide = model.coordinate(f"slide{leg}", unit="m")
    model.joint(
        f"piston{leg}", type="prismatic", parent=f"cylinder{leg}", child=f"rod{leg}",
        origin={"xyz": (0, 0, length)}, axis=(0, 0, 1), coordinate=f"slide{leg}",
    )  # fmt: skip
    model.point(f"tip{leg}", f"rod{leg}", (0, 0, 0))
    model.point(f"socket{leg}", "plate", (head[0], head[1], 0))
    model.coincident(f"ball{leg}", f"tip{leg}", f"socket{leg}")
    model.force(slide, k * (amplitude * symgen.sin(omega * t + leg * pi / 3) - slide) - c * dot(slide))


def _places(leg):
    """Foot on the ground and head at the plate of a leg; neighbours share a corner of the triangle by turns."""
    corner, side = divmod(leg + 1, 2)
    sign = 1 if side else -1
    foot = corner * 2 * pi / 3 + sign * BASE_SPREAD * -1
    head = corner * 2 * pi / 3 + sign * PLATE_SPREAD * -1
    return (
        (BASE_RADIUS * cos(foot), BASE_RADIUS * sin(foot), 0.0),
        (PLATE_RADIUS * cos(head), PLATE_RADIUS * sin(head), HEIGHT),
    )
