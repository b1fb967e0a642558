"""The bundled robots against what is computed here from the files that they come from."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from importlib.util import find_spec

import numpy as np
import pytest

import symgen
from symgen import link
from symgen.model.library import bundled_folder, find, run_function
from symgen.robots.mjcf import import_mjcf

ROBOTS = bundled_folder() / "robots"
FEET = [f"{end}_{side}_foot" for end in ("front", "rear") for side in ("left", "right")]


def turns(axis, angles):
    """Rotations about an axis by Rodrigues' formula, shape (n, 3, 3)."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sin, cos = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.eye(3) + sin * cross + (1 - cos) * cross @ cross


class Chains:
    """Where the links of a URDF file are, read here and not by the importer: no turned origins, no named axes."""

    def __init__(self, file):
        root = ET.parse(file).getroot()
        self.links = {one.get("name"): one for one in root.findall("link")}
        self._joints = {one.find("child").get("link"): one for one in root.findall("joint")}

    def of(self, run, name, point=(0, 0, 0)):
        """A point of a link in the world, shape (n, 3), at all frames of a run."""
        at = np.tile(np.array(point, float), (len(run.t), 1))
        while (joint := self._joints.get(name)) is not None:
            axis, kind = joint.find("axis"), joint.get("type")
            if kind in ("revolute", "continuous"):
                at = (turns(_numbers(axis), run[joint.get("name")]) @ at[:, :, None])[:, :, 0]
            elif kind == "prismatic":
                at = at + run[joint.get("name")][:, None] * _numbers(axis)
            at = at + _numbers(joint.find("origin"))
            name = joint.find("parent").get("link")
        return at

    def mass_and_centre(self, name):
        inertial = self.links[name].find("inertial")
        if inertial is None:
            return 0.0, np.zeros(3)
        origin = inertial.find("origin")
        return float(inertial.find("mass").get("value")), (
            np.zeros(3) if origin is None else _numbers(origin)
        )


def _numbers(element):
    return np.array([float(x) for x in element.get("xyz").split()])


def in_world(run, places):
    """Places in the trunk's frame as the free joint moves it: by its quaternion, computed here."""
    w, x, y, z = (run[f"root_q{letter}"] for letter in "wxyz")
    u = np.column_stack([x, y, z])
    moved = places + 2 * np.cross(u, np.cross(u, places) + w[:, None] * places)
    return moved + np.column_stack([run[f"root_{axis}"] for axis in "xyz"])


def test_the_arm_takes_its_tool_along_the_way_points():
    arm = symgen.load("gripper_arm")
    run = arm.run(t_end=5.5, inputs=run_function(find("gripper_arm"), "control", arm, {}), fps=10)
    assert run.ok, [check.says for check in run.objections]
    tool = Chains(ROBOTS / "gripper_arm.urdf").of(run, "tool")
    np.testing.assert_allclose(run.outputs, tool, atol=1e-13)
    np.testing.assert_allclose(run["left_finger"], run["right_finger"], atol=1e-14)
    wanted = {"waist": -0.6, "shoulder": 0.3, "elbow": 1.2, "roll": 0.4, "pitch": 0.9, "turn": 0.0}
    off = {name: abs(run[name][-1] - angle) for name, angle in wanted.items()}
    assert max(off.values()) < 0.03, off  # what gravity leaves
    assert abs(run["left_finger"][-1] - 0.015) < 1e-3


def test_momentum_of_the_quadruped_changes_by_its_weight_and_its_feet():
    """The law of contact and friction is written out here; places come from the file, speeds from differences."""
    quadruped = symgen.load("quadruped")
    fps = 8000
    run = quadruped.run(t_end=0.4, method="radau5", rtol=1e-10, fps=fps)
    assert run.ok, [check.says for check in run.objections]
    chains = Chains(ROBOTS / "quadruped.urdf")
    p = {record["name"]: value for record, value in zip(quadruped.parameters, run.p.tolist(), strict=False)}
    momentum, mass = np.zeros((len(run.t), 3)), 0.0
    for name in chains.links:
        m, centre = chains.mass_and_centre(name)
        place = in_world(run, chains.of(run, name, centre))
        momentum, mass = momentum + m * np.gradient(place, run.t, axis=0, edge_order=2), mass + m
    force = np.tile([0.0, 0.0, -9.81 * mass], (len(run.t), 1))
    for foot in FEET:
        place = in_world(run, chains.of(run, foot))
        v = np.gradient(place, run.t, axis=0, edge_order=2)
        depth = np.maximum(p["radius"] - place[:, 2], 0.0)
        elastic = p["ground"] * depth**1.5
        force[:, 2] += np.maximum(elastic * (1 - 0.75 * v[:, 2]), 0.0)
        sliding = np.hypot(np.hypot(v[:, 0], v[:, 1]), p["slow"])
        force[:, :2] -= (p["mu"] * elastic / sliding)[:, None] * v[:, :2]
    impulse = np.cumsum((force[1:] + force[:-1]) / 2, axis=0) / fps
    scale = np.abs(momentum).max()
    assert force[:, 2].max() > 1.5 * 9.81 * mass  # it lands within that time
    np.testing.assert_allclose(momentum[1:] - momentum[0], impulse, atol=2e-4 * scale)


def test_the_leg_holds_its_loops_and_its_energy():
    leg = symgen.load("achilles_leg")
    run = leg.run(t_end=1.0, rtol=1e-9)
    assert run.ok, [check.says for check in run.objections]
    assert leg.m == 5 and leg.dependent == ()
    assert np.ptp(run.energy.total) < 1e-7
    q = run.states[:, : leg.nq + leg.nv]
    residual = leg.kernel("constraint_residual")
    worst = max(np.abs(residual(t, y, run.p)[: leg.nh]).max() for t, y in zip(run.t, q, strict=True))
    assert worst < 1e-13


@pytest.mark.skipif(find_spec("mujoco") is None, reason="needs mujoco")
def test_the_leg_is_what_its_file_is_imported_as():
    bundled, imported = (
        symgen.load("achilles_leg"), link.derive(import_mjcf(ROBOTS / "achilles_leg.xml").model)
    )  # fmt: skip
    assert [x["name"] for x in bundled.coordinates] == [x["name"] for x in imported.coordinates]
    rng = np.random.default_rng(3)
    for function in ("mass_matrix", "forces", "constraint_jacobian"):
        y = rng.uniform(-0.5, 0.5, bundled.nq + bundled.nv)
        values = [s.kernel(function)(0.0, y, s.parameter_values()) for s in (bundled, imported)]
        np.testing.assert_allclose(*values, rtol=1e-10, atol=1e-12)
