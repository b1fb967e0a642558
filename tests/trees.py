"""Test support: robots and random trees of joints, made with the builder."""

from __future__ import annotations

import math

import numpy as np

from symgen import Model

GRAVITY = (0, 0, -9.81)
QUARTER = math.pi / 2
SCALAR = ("revolute", "prismatic", "continuous", "screw")
ANGLES = ("gimbal", "floating")
ALL = (*SCALAR, "universal", "cylindrical", "planar", "spherical", "free", *ANGLES, "fixed")

# Origins (xyz, rpy) of the joints of a KUKA LBR iiwa 7 in their parents' frames; each turns about its z axis.
IIWA = (
    ((0, 0, 0.1575), (0, 0, 0)),
    ((0, 0, 0.2025), (QUARTER, 0, math.pi)),
    ((0, 0.2045, 0), (QUARTER, 0, math.pi)),
    ((0, 0, 0.2155), (QUARTER, 0, 0)),
    ((0, 0.1845, 0), (-QUARTER, math.pi, 0)),
    ((0, 0, 0.2155), (QUARTER, 0, 0)),
    ((0, 0.081, 0), (-QUARTER, math.pi, 0)),
)

# Joints of a humanoid's limbs: axis, and offset from the joint before; hips and shoulders from pelvis and chest.
LEG = (
    ("z", (0, 0.09, -0.05)),
    ("x", (0, 0, 0)),
    ("y", (0, 0, 0)),
    ("y", (0, 0, -0.42)),
    ("y", (0, 0, -0.4)),
    ("x", (0, 0, 0)),
)
ARM = (
    ("y", (0, 0.2, 0.3)),
    ("x", (0, 0.05, 0)),
    ("z", (0, 0, -0.05)),
    ("y", (0, 0, -0.25)),
    ("z", (0, 0, -0.1)),
)
WAIST = (("z", (0, 0, 0.1)), ("y", (0, 0, 0)))
AXIS = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def random_body(rng: np.random.Generator, size: float = 0.2) -> dict:
    """Mass, centre of mass and inertia of a few random point masses: all ten parameters, physically consistent."""
    masses, places = rng.uniform(0.2, 1.0, 6), rng.normal(0.0, size, (6, 3))
    com = masses @ places / masses.sum()
    r = places - com
    tensor = np.einsum(
        "k,kij->ij", masses, np.einsum("k,ij->kij", (r * r).sum(1), np.eye(3)) - r[:, :, None] * r[:, None]
    )
    entries = [tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return {"mass": float(masses.sum()), "com": com.tolist(), "inertia": [float(x) for x in entries]}


def seven_dof_arm(seed: int = 1) -> Model:
    """A serial arm with the axes of an iiwa and full inertias."""
    rng = np.random.default_rng(seed)
    model = Model("seven_dof_arm", gravity=GRAVITY)
    parent = "world"
    for k, (xyz, rpy) in enumerate(IIWA, 1):
        model.body(f"link{k}", **random_body(rng, 0.1))
        model.joint(f"q{k}", "revolute", f"link{k}", parent, {"xyz": xyz, "rpy": rpy}, axis=(0, 0, 1))
        parent = f"link{k}"
    return model


def humanoid(free: bool = True, seed: int = 2) -> Model:
    """A humanoid with full inertias: 24 revolute joints in legs, arms and waist, on a free base or a fixed one."""
    rng = np.random.default_rng(seed)
    model = Model("humanoid", gravity=GRAVITY)
    model.body("pelvis", **random_body(rng))
    model.joint("base", "free" if free else "fixed", "pelvis")
    chest = _limb(model, rng, "waist", "pelvis", WAIST, 1)
    for side, sign in (("left", 1), ("right", -1)):
        _limb(model, rng, f"{side}_leg", "pelvis", LEG, sign)
        _limb(model, rng, f"{side}_arm", chest, ARM, sign)
    return model


def _limb(model: Model, rng: np.random.Generator, name: str, parent: str, joints: tuple, sign: int) -> str:
    for k, (axis, (x, y, z)) in enumerate(joints, 1):
        body = f"{name}{k}"
        model.body(body, **random_body(rng, 0.1))
        model.joint(f"q_{body}", "revolute", body, parent, {"xyz": (x, sign * y, z)}, axis=AXIS[axis])
        parent = body
    return parent


def random_tree(n: int, seed: int, kinds: tuple[str, ...] = ("revolute",), branching: float = 0.6) -> Model:
    """A tree of n joints of random kinds, placed at random, with full inertias.

    A joint continues the body before it with probability `branching`, and grows from any body otherwise.
    """
    rng = np.random.default_rng(seed)
    model = Model(f"tree_{n}_{seed}", gravity=GRAVITY)
    for k in range(n):
        continues = k > 0 and rng.random() < branching
        parent = f"b{k - 1}" if continues else ["world", *(f"b{j}" for j in range(k))][rng.integers(k + 1)]
        kind = kinds[rng.integers(len(kinds))] if k < n - 1 else "revolute"
        model.body(f"b{k}", **random_body(rng))
        placed = {"xyz": rng.normal(0, 0.4, 3).tolist(), "rpy": rng.uniform(-3, 3, 3).tolist()}
        has_axis = kind not in ("spherical", "free", *ANGLES, "fixed")
        axis = {"axis": rng.normal(0, 1, 3).tolist()} if has_axis else {}
        if kind == "screw":
            axis["pitch"] = float(rng.uniform(-1, 1))
        if kind in ANGLES:
            axis["sequence"] = str(rng.choice(["xyz", "zxz", "zyx", "yzy"]))
        model.joint(f"j{k}", kind, f"b{k}", parent, placed, **axis)
    return model
