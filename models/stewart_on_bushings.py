"""Stewart platform on bushings: rubber in the place of the upper joints, so that nothing has to be closed."""

from math import atan2, cos, hypot, pi, sin

from symgen import Model

BASE_RADIUS, PLATE_RADIUS, HEIGHT = 0.6, 0.35, 0.7
BASE_SPREAD, PLATE_SPREAD = 0.25, 0.85  # half the angle between neighbouring feet, heads [rad]
ALONG, ABOUT = 4e5, 60.0  # stiffness of a bushing [N/m, N m]
RUBBER = 2e-3  # damping per stiffness [s]


def build(legs: int = 6, stiffness: float = 8e4) -> Model:
    """Describe the platform.

    Parameters
    ----------
    legs : int
        3 or 6.
    stiffness : float
        Of the actuator in a leg [N/m].
    """
    about = "Stewart platform whose legs carry a plate by bushings"
    model = Model("stewart_on_bushings", description=about).in_text()
    model.parameters(k=f"{stiffness} N/m", c="900 N*s/m")
    model.parameters(amplitude="0.03 m", omega="9 rad/s")
    model.gravity(z="-9.81 m/s^2")
    model.body("plate", density="2700 kg/m^3", shape={"cylinder": [PLATE_RADIUS, 0.012]})
    model.joint("plate", type="free", child="plate", guess=[0, 0, HEIGHT, 1, 0, 0, 0])
    for leg in range(legs):
        _leg(model, leg, legs, f"amplitude*sin(omega*t + {leg * 2 * pi / legs})")
    model.start(steady=True)
    model.output("height", "plate_z")
    model.run(t_end=2.0, fps=60)
    return model


def _leg(model, leg, legs, wanted):
    """A cylinder on a universal joint, a rod that slides in it as is wanted, and a bushing at the plate."""
    foot, head = places(leg, legs)
    reach = [b - a for a, b in zip(foot, head)]
    # The z axis of these frames points from foot to head where the plate is in its middle.
    rpy = (0, atan2(hypot(reach[0], reach[1]), reach[2]), atan2(reach[1], reach[0]))
    cylinder, rod, slide = f"cylinder{leg}", f"rod{leg}", f"slide{leg}"
    model.body(
        cylinder, mass=1.5, com=(0, 0, 0.25), inertia=(0.032, 0.032, 0.001), shape={"cylinder": [0.03, 0.5]}
    )
    model.body(
        rod, mass=0.6, com=(0, 0, -0.22), inertia=(0.01, 0.01, 2e-4), shape={"cylinder": [0.015, 0.44]}
    )
    origin = {"xyz": foot, "rpy": rpy}
    model.joint(
        f"foot{leg}", type="universal", child=cylinder, origin=origin, axis=(1, 0, 0), axis2=(0, 1, 0)
    )
    moved = model.coordinate(slide, unit="m")
    model.joint(
        f"piston{leg}", type="prismatic", parent=cylinder, child=rod, origin={"xyz": (0, 0, hypot(*reach))},
        axis=(0, 0, 1), coordinate=slide,
    )  # fmt: skip
    model.frame(f"socket{leg}", body="plate", at=(head[0], head[1], 0), rpy=rpy)
    rubber = [ALONG] * 3 + [ABOUT] * 3
    lossy = [RUBBER * x for x in rubber]
    model.bushing(f"rubber{leg}", frames=(rod, f"socket{leg}"), stiffness=rubber, damping=lossy)
    model.force(slide, f"k*({wanted} - {moved}) - c*dot({moved})")


def places(leg, legs):
    """Foot on the ground and head at the plate of a leg; neighbours share a corner of the triangle by turns."""
    corner, side = divmod(leg + 1, 2) if legs == 6 else (leg, 0)
    sign = (1 if side else -1) * (legs == 6)
    foot, head = (corner * 2 * pi / 3 - sign * spread for spread in (BASE_SPREAD, PLATE_SPREAD))
    return (
        (BASE_RADIUS * cos(foot), BASE_RADIUS * sin(foot), 0.0),
        (PLATE_RADIUS * cos(head), PLATE_RADIUS * sin(head), HEIGHT),
    )
