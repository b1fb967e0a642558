"""Functions for robot programs against Pinocchio (optional): random trees, and robots of example-robot-data."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest
from trees import humanoid, random_tree, seven_dof_arm

from symgen import Model
from symgen.link import robot as robot_of
from symgen.robots.build import import_urdf
from symgen.runtime.graph.layouts import ROBOT_FUNCTIONS

pin = pytest.importorskip("pinocchio", reason="pin is not installed")
pinocchio_tree = importlib.import_module("pinocchio_model").pinocchio_tree

FUNCTIONS = [name for name in ROBOT_FUNCTIONS if name != "equilibrium_torques"]
KINDS = ("revolute", "prismatic", "screw", "universal", "cylindrical", "planar", "spherical", "free")
MODELS = {
    "arm": seven_dof_arm,
    "humanoid": humanoid,
    "humanoid_fixed": lambda: humanoid(free=False),
    **{f"tree_{seed}": lambda seed=seed: random_tree(7, seed, KINDS) for seed in range(6)},
}
ROBOTS = [
    ("ur5_robot.urdf", "fixed"),
    ("panda.urdf", "fixed"),
    ("anymal.urdf", "free"),
    ("talos_reduced.urdf", "free"),
]


def agree(actual, expected, tolerance=1e-10):
    scale = max(1.0, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize("name", MODELS)
def test_dynamics_and_momentum(name):
    model = MODELS[name]()
    description = model.describe()
    frame = description.joints[-1].child
    robot, theirs = robot_of(model, FUNCTIONS, [frame]), pinocchio_tree(description, {})
    rng = np.random.default_rng(1)
    q, v, a = (rng.uniform(-1, 1, n) for n in (robot.nq, robot.nv, robot.nv))
    for first, _ in theirs.balls:
        q[first : first + 4] /= np.linalg.norm(q[first : first + 4])
    compare(robot, theirs.model, *_state(theirs, q, v), (q, v, a))


def _state(theirs, q, v):
    own_q, own_v = theirs.state(np.concatenate([q, v]))
    return own_q, own_v, *theirs.velocity_map(own_q, own_v)


def compare(robot, model, own_q, own_v, B, b, given):
    """Everything at one state; B and b of Pinocchio's velocity B u and acceleration B du/dt + b."""
    q, v, a = given
    data = model.createData()
    agree(robot.inverse_dynamics(q, v, a), B.T @ pin.rnea(model, data, own_q, own_v, B @ a + b))
    M = pin.crba(model, data, own_q)
    M = B.T @ (np.triu(M) + np.triu(M, 1).T) @ B
    agree(robot.mass_matrix(q), M)
    limit = 1e-10 + 1e-15 * np.linalg.cond(M)
    force = np.linalg.solve(B.T, a)
    agree(
        robot.forward_dynamics(q, v, a),
        np.linalg.solve(B, pin.aba(model, data, own_q, own_v, force) - b),
        limit,
    )
    agree(robot.gravity(q), B.T @ pin.computeGeneralizedGravity(model, data, own_q))
    agree(robot.energy(q, v)[0], pin.computeKineticEnergy(model, data, own_q, own_v))
    pin.ccrba(model, data, own_q, own_v)
    agree(robot.momentum_matrix(q), data.Ag @ B)
    agree(robot.momentum(q, v), data.hg.vector)
    agree(robot.centre_of_mass(q), pin.centerOfMass(model, data, own_q))
    if not b.any() and np.allclose(np.abs(B).sum(0), 1):  # free joints' velocities are in other axes there
        by_q, by_v = robot.inverse_dynamics_derivatives(q, v, a)
        pin.computeRNEADerivatives(model, data, own_q, own_v, B @ a)
        agree(by_q, B.T @ data.dtau_dq @ B)
        agree(by_v, B.T @ data.dtau_dv @ B)
        pin.computeABADerivatives(model, data, own_q, own_v, force)
        by_q, by_v, inverse = robot.forward_dynamics_derivatives(q, v, a)
        upper = np.triu(data.Minv)
        agree(by_q, B.T @ data.ddq_dq @ B, limit)
        agree(by_v, B.T @ data.ddq_dv @ B, limit)
        agree(inverse, B.T @ (upper + np.triu(upper, 1).T) @ B, limit)


def test_the_regressor_has_as_many_columns_as_pinocchios_has_rank():
    model = seven_dof_arm()
    robot, theirs = robot_of(model, "regressor"), pinocchio_tree(model.describe(), {})
    rng, data = np.random.default_rng(2), theirs.model.createData()
    rows = [
        pin.computeJointTorqueRegressor(theirs.model, data, *(rng.uniform(-2, 2, 7) for _ in range(3)))
        for _ in range(60)
    ]
    assert np.linalg.matrix_rank(np.vstack(rows), rtol=1e-9) == len(robot.base_parameters)


@pytest.mark.parametrize(("file", "base"), ROBOTS)
def test_robots_of_example_robot_data(file, base):
    found = [path for part in Path(pin.__file__).parents[3:5] for path in part.rglob(file)]
    if not found:
        pytest.skip("example-robot-data is not installed")
    imported = import_urdf(found[0], base)
    joint = (pin.JointModelFreeFlyer(),) if base == "free" else ()
    model = pin.buildModelFromUrdf(str(found[0]), *joint)
    links = [name for name in imported.bodies if model.existFrame(name, pin.FrameType.BODY)]
    names = [links[-1], links[len(links) // 2]]
    functions = [
        "inverse_dynamics",
        "mass_matrix",
        "gravity",
        "momentum",
        "momentum_matrix",
        "centre_of_mass",
    ]
    robot = robot_of(imported.model, functions, [imported.bodies[name] for name in names])
    state = _FileState(imported, model, robot)
    for seed in range(3):
        (q, v, a), own_q, B, b = state.at_random(seed)
        data, own_v = model.createData(), B @ v
        inertial = B.T @ pin.rnea(model, data, own_q, own_v, B @ a + b)
        agree(robot.inverse_dynamics(q, v, a), inertial + state.armature * a + state.damping * v)
        M = pin.crba(model, data, own_q)
        agree(robot.mass_matrix(q), B.T @ (np.triu(M) + np.triu(M, 1).T) @ B + np.diag(state.armature))
        agree(robot.gravity(q), B.T @ pin.computeGeneralizedGravity(model, data, own_q))
        pin.ccrba(model, data, own_q, own_v)
        agree(robot.momentum_matrix(q), data.Ag @ B)
        agree(robot.momentum(q, v), data.hg.vector)
        agree(robot.centre_of_mass(q), pin.centerOfMass(model, data, own_q))
        pin.computeJointJacobians(model, data, own_q)
        pin.forwardKinematics(model, data, own_q, own_v, b)
        pin.updateFramePlacements(model, data)
        for name in names:
            ours, k = imported.bodies[name], model.getFrameId(name, pin.FrameType.BODY)
            place, rotation = robot.forward_kinematics(ours, q)
            agree(place, data.oMf[k].translation)
            agree(rotation, data.oMf[k].rotation)
            agree(robot.jacobian(ours, q), pin.getFrameJacobian(model, data, k, pin.LOCAL_WORLD_ALIGNED) @ B)
            acceleration = pin.getFrameClassicalAcceleration(model, data, k, pin.LOCAL_WORLD_ALIGNED).vector
            agree(robot.drift(ours, q, v), acceleration)
            agree(robot.jacobian_rate(ours, q, v) @ v, acceleration)


class _FileState:
    """Random states of an imported robot: ours, and Pinocchio's with the map between rates."""

    def __init__(self, imported, model, robot):
        self.imported, self.model, self.robot = imported, model, robot
        self.free = imported.base == "free"
        self.armature, self.damping = np.zeros(robot.nv), np.zeros(robot.nv)
        self.joints = []
        for joint in imported.robot.joints:
            name = imported.joints[joint.name]
            if name in robot.rates:
                k = robot.rates.index(name)
                self.armature[k], self.damping[k] = joint.armature, joint.damping
                its = model.joints[model.getJointId(joint.name)]
                self.joints.append((its, robot.coordinates.index(name), k))

    def at_random(self, seed):
        rng = np.random.default_rng(seed)
        nq, nv = self.robot.nq, self.robot.nv
        q, v, a = (rng.uniform(-1, 1, n) for n in (nq, nv, nv))
        own, B, b = pin.neutral(self.model), np.zeros((self.model.nv, nv)), np.zeros(self.model.nv)
        for its, place, rate in self.joints:
            own[its.idx_q : its.idx_q + its.nq] = (
                [q[place]] if its.nq == 1 else [np.cos(q[place]), np.sin(q[place])]
            )
            B[its.idx_v, rate] = 1.0
        if self.free:
            q[3:7] /= np.linalg.norm(q[3:7])
            own[:7] = [*q[:3], *q[4:7], q[3]]
            R = pin.Quaternion(*q[3:7]).toRotationMatrix()
            B[:3, :3], B[3:6, 3:6] = R.T, np.eye(3)
            b[:3] = -np.cross(v[3:6], R.T @ v[:3])
        return (q, v, a), own, B, b


def test_a_model_and_its_robot_share_parameters():
    model = Model("one", gravity=(0, 0, -9.81))
    mass = model.parameter("m", 2.0)
    model.body("b", mass=mass, com=(0.1, 0, 0), inertia=(0.01, 0.02, 0.03))
    model.joint("j", "revolute", "b", axis=(0, 1, 0))
    robot = robot_of(model, "gravity")
    agree(robot.gravity([0.0], {"m": 4.0}), 2 * robot.gravity([0.0]))
