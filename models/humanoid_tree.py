"""Diver: a tree of 25 bodies and 30 freedoms that tumbles through the air, its joints held by muscles like springs."""

from symgen import Model

# Segments (kg, m, m) and inertias (kg m^2) of an adult of 75 kg: mass, length, radius of the picture.
SEGMENTS = {
    "thigh": (10.5, 0.42, 0.07),
    "shank": (3.5, 0.42, 0.05),
    "upper_arm": (2.1, 0.30, 0.045),
    "fore_arm": (1.2, 0.26, 0.04),
}


def build(stiffness=60.0, damping=2.0) -> Model:
    """Describe the diver.

    Parameters
    ----------
    stiffness : float
        Of each joint [N m] towards the stretched posture.
    damping : float
        Of each joint [N m s].
    """
    model = Model(
        "humanoid_tree",
        description="Diver of 30 freedoms, free base, tumbling in the air with springy joints",
    )
    g, k, c = model.parameters(g="9.81 m/s^2", k=f"{stiffness} N*m", c=f"{damping} N*m*s")
    model.gravity(z=-g)
    body = _Builder(model, k, c)
    body.box("pelvis", 11.0, (0.20, 0.30, 0.16))
    model.joint(
        "base", type="free", child="pelvis",
        start=[0, 0, 3, 1, 0, 0, 0], rate=[1.2, 0, 3.5, 0.4, -4.5, 0.2],
    )  # fmt: skip
    spine = body.ball("waist", "pelvis", "chest", (0, 0, 0.12), "zyx", rest=(0.0, 0.15, 0.0))
    body.box(spine, 22.0, (0.22, 0.34, 0.36), com=(0, 0, 0.22))
    neck = body.hinge("neck", "chest", "head", (0, 0, 0.46), "y", rest=-0.1)
    body.ellipsoid(neck, 5.0, 0.11, com=(0, 0, 0.12))
    for side, sign in (("left", 1), ("right", -1)):
        _leg(body, side, sign)
        _arm(body, side, sign)
    model.run(t_end=1.2, fps=120)
    return model


def _leg(body, side, sign):
    """Hip of three hinges, knee, ankle of two."""
    thigh = body.ball(
        f"{side}_hip", "pelvis", f"{side}_thigh", (0, 0.09 * sign, -0.06), "yxz", rest=(-0.6, 0.1 * sign, 0.0)
    )
    body.limb(thigh, "thigh")
    shank = body.hinge(f"{side}_knee", thigh, f"{side}_shank", (0, 0, -0.42), "y", rest=0.9)
    body.limb(shank, "shank")
    foot = body.ball(f"{side}_ankle", shank, f"{side}_foot", (0, 0, -0.42), "yx", rest=(0.5, 0.0))
    body.box(foot, 1.1, (0.24, 0.09, 0.06), com=(0.06, 0, -0.04))


def _arm(body, side, sign):
    """Shoulder of three hinges, elbow."""
    start = (0, 0.21 * sign, 0.38)
    upper = body.ball(
        f"{side}_shoulder", "chest", f"{side}_upper_arm", start, "yxz", rest=(-1.8, 0.3 * sign, 0.0)
    )
    body.limb(upper, "upper_arm")
    fore = body.hinge(f"{side}_elbow", upper, f"{side}_fore_arm", (0, 0, -0.30), "y", rest=-0.5)
    body.limb(fore, "fore_arm")


class _Builder:
    """Bodies and springy joints of a model."""

    def __init__(self, model, stiffness, damping):
        self.model, self.stiffness, self.damping = model, stiffness, damping

    def box(self, name, mass, size, com=(0, 0, 0)):
        x, y, z = (s * s / 12 * mass for s in size)
        self.model.body(name, mass=mass, com=com, inertia=(y + z, x + z, x + y), shape={"box": size})

    def ellipsoid(self, name, mass, radius, com):
        self.model.body(
            name, mass=mass, com=com, inertia=(0.4 * mass * radius**2,) * 3, shape={"sphere": [radius]}
        )

    def limb(self, name, kind):
        mass, length, radius = SEGMENTS[kind]
        across, along = mass * (length**2 / 12 + radius**2 / 4), mass * radius**2 / 2
        self.model.body(
            name, mass=mass, com=(0, 0, -length / 2), inertia=(across, across, along),
            shape={"capsule": [radius, length - radius]},
        )  # fmt: skip

    def hinge(self, name, parent, child, xyz, axis, rest=0.0, start=None):
        """A revolute joint with a spring towards its posture; returns the child's name."""
        self.model.joint(
            name, type="revolute", parent=parent, child=child, origin={"xyz": xyz},
            axis=tuple(float(axis == a) for a in "xyz"), start=0.5 * rest if start is None else start, rest=rest,
            stiffness=self.stiffness, damping=self.damping, armature=0.01,
        )  # fmt: skip
        return child

    def ball(self, name, parent, child, xyz, axes, rest):
        """Hinges one after another in the same point, with light bodies between them; returns the child's name."""
        for k, axis in enumerate(axes):
            last = k == len(axes) - 1
            here = child if last else f"{name}_{axis}"
            self.hinge(f"{name}_{k + 1}", parent, here, xyz if k == 0 else (0, 0, 0), axis, rest[k])
            if not last:
                self.model.body(here, mass=0.05, inertia=(1e-4, 1e-4, 1e-4), shape={"sphere": [0.03]})
            parent = here
        return child
