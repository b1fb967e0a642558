"""Quadruped from its URDF file: it drops onto its feet, held by springs in its joints, and crouches and rises."""

from pathlib import Path

from symgen import Model

URDF = Path(__file__).parent / "robots" / "quadruped.urdf"
LEGS = tuple(f"{end}_{side}" for end in ("front", "rear") for side in ("left", "right"))
POSTURE = {"hip": 0.0, "thigh": 0.75, "knee": -1.5}  # rad
FOOT = 0.022  # radius [m]


def build(stiffness=150.0, damping=4.0, crouch=0.2, friction=0.7) -> Model:
    """Read the robot, and give it springs, feet that touch the ground, and a wave of its posture.

    Parameters
    ----------
    stiffness, damping : float
        Of each joint [N m], [N m s], towards the posture.
    crouch : float
        How far the thighs' posture goes on, up and down [rad]; knees twice as far.
    friction : float
        Of the feet on the ground.
    """
    start = {f"{leg}_{joint}": angle for leg in LEGS for joint, angle in POSTURE.items()}
    model = Model.from_urdf(URDF, base="free", motors=False, start=start | {"root_z": 0.36}).in_text()
    model.parameters(
        k=f"{stiffness} N*m", c=f"{damping} N*m*s", crouch=f"{crouch} rad", f="1 Hz", mu=friction
    )
    model.parameters(ground="2e5 N/m^1.5", radius=f"{FOOT} m", slow="0.02 m/s")
    model.definition("wave", "crouch*sin(2*pi*f*t)")
    for leg in LEGS:
        for joint, share in (("hip", 0), ("thigh", 1), ("knee", -2)):
            name = f"{leg}_{joint}"
            model.force(name, f"k*({POSTURE[joint]} + {share}*wave - {name}) - c*dot({name})")
        _stand(model, f"{leg}_foot")
    model.output("height", "root_z")
    model.run(t_end=3.0, fps=60, method="radau5")
    return model


def _stand(model, foot):
    """A foot that the ground carries, and that slides on it against friction in both directions."""
    gap = f"{foot}.z - radius"
    model.contact(foot, gap=gap, stiffness="ground", damping="0.5 s/m")
    normal = f"ground*max(-({gap}), 0)^1.5"
    speed = f"sqrt({foot}.vx^2 + {foot}.vy^2 + slow^2)"
    friction = [f"-mu*{normal}*{foot}.v{axis}/{speed}" for axis in "xy"]
    model.point(f"{foot}_centre", body=foot, at=(0, 0, 0))
    model.load(f"{foot}_friction", point=f"{foot}_centre", force=(*friction, 0))
