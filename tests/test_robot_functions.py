"""What robot programs call: inverse and forward dynamics, frames, momenta, regressors, equilibria."""

from __future__ import annotations

import pickle
from pathlib import Path

import numba
import numpy as np
import pytest
import sympy
from click.testing import CliRunner
from trees import GRAVITY, humanoid, random_body, seven_dof_arm

import symgen
from symgen import Model
from symgen.cli import main
from symgen.derive.robot_request import requested
from symgen.errors import ModelError
from symgen.link import robot as robot_of
from symgen.link import robot_text
from symgen.runtime.errors import ModuleError, RuntimeModelError, UnknownNameError
from symgen.runtime.graph.layouts import ROBOT_FUNCTIONS
from symgen.runtime.robot import Robot

WITHOUT_INPUTS = tuple(name for name in ROBOT_FUNCTIONS if name != "equilibrium_torques")
STEP = 1e-6


def wandering_tree() -> Model:
    """All kinds of joints on a free base, with springs, damping and rotors."""
    model = Model("tree", gravity=GRAVITY)
    rng = np.random.default_rng(8)
    kinds = ("free", "spherical", "revolute", "prismatic", "universal", "planar", "screw", "cylindrical")
    parents = ("world", "b0", "b0", "b1", "b2", "b0", "b3", "b4")
    for k, (kind, parent) in enumerate(zip(kinds, parents, strict=True)):
        model.body(f"b{k}", **random_body(rng))
        place = {"xyz": rng.uniform(-1, 1, 3).tolist(), "rpy": rng.uniform(-3, 3, 3).tolist()}
        more = {} if kind in ("free", "spherical") else {"axis": rng.normal(size=3).tolist()}
        if kind == "screw":
            more["pitch"] = 0.3
        if kind == "revolute":
            more |= {"damping": 0.2, "stiffness": 3.0, "armature": 0.05}
        model.joint(f"j{k}", kind, f"b{k}", parent, place, **more)
    model.frame("tip", "b6", (0.1, 0.2, -0.3), rpy=(0.3, -0.2, 0.5))
    return model


def by_hand() -> Model:
    """A cart with a pendulum, placed by hand: no tree of joints."""
    m = Model("cart_pole", gravity=(0, -9.81, 0))
    x, theta = m.coordinate("x", unit="m"), m.coordinate("theta")
    length = m.parameter("l", 0.5)
    m.body("cart", mass=1.0, com=(x, 0, 0))
    com = (x + length * symgen.sin(theta), -length * symgen.cos(theta), 0)
    m.body("bob", mass=0.3, com=com, rotation=[("z", theta)], inertia=(0.01, 0.02, 0.03))
    m.force(x, m.input("F", unit="N") - 0.1 * symgen.dot(x))
    return m


MODELS = {"arm": seven_dof_arm, "humanoid": humanoid, "tree": wandering_tree, "by_hand": by_hand}
TREES = ("arm", "humanoid", "tree")
_made: dict[str, tuple] = {}


def made(name: str) -> tuple:
    """A model's robot with all functions it can have, its system, and random q, v, a."""
    if name not in _made:
        model = MODELS[name]()
        bodies = [b.name for b in model.describe().bodies]
        frames = [bodies[0], bodies[-1], *(["tip"] if name == "tree" else [])]
        functions = WITHOUT_INPUTS
        if name == "by_hand":
            functions = [f for f in functions if f not in ("regressor", "momentum_matrix")]
        robot, system = robot_of(model, functions, frames), model.derive()
        rng = np.random.default_rng(3)
        q, v, a = (rng.uniform(-1, 1, (4, n)) for n in (robot.nq, robot.nv, robot.nv))
        for k in system.quaternions:
            q[:, k : k + 4] /= np.linalg.norm(q[:, k : k + 4], axis=1)[:, None]
        _made[name] = robot, system, q, v, a
    return _made[name]


def close(actual, expected, tolerance=1e-11):
    scale = max(1.0, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance * scale)


def moved(system, q: np.ndarray, along: np.ndarray) -> np.ndarray:
    """q + N(q) w for rows of q, quaternions at unit length."""
    p = system.parameter_values()
    result = []
    for row, w in zip(q, np.broadcast_to(along, (len(q), system.nv)), strict=True):
        rates = system.kernel("rhs")(0.0, np.concatenate([row, w]), p)[: system.nq]
        row = row + rates
        for k in system.quaternions:
            row[k : k + 4] /= np.linalg.norm(row[k : k + 4])
        result.append(row)
    return np.array(result)


def difference(f, system, q, direction):
    """The derivative of f by a displacement, by central differences."""
    return (f(moved(system, q, STEP * direction)) - f(moved(system, q, -STEP * direction))) / (2 * STEP)


@pytest.mark.parametrize("name", MODELS)
def test_dynamics_are_those_of_the_module_for_runs(name):
    robot, system, q, v, a = made(name)
    p = system.parameter_values()
    tau = robot.inverse_dynamics(q, v, a)
    for k in range(len(q)):
        y = np.concatenate([q[k], v[k]])
        close(tau[k], system.kernel("residual")(0.0, np.concatenate([y, a[k]]), p))
        close(robot.mass_matrix(q[k]), system.kernel("mass_matrix")(0.0, y, p).reshape(robot.nv, robot.nv))
        close(robot.energy(q[k], v[k]), system.kernel("energy")(0.0, y, p))
    close(robot.forward_dynamics(q, v, tau), a, 1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_derivatives_of_dynamics_are_those_of_differences(name):
    robot, system, q, v, a = made(name)
    by_q, by_v = robot.inverse_dynamics_derivatives(q, v, a)
    tau = robot.inverse_dynamics(q, v, a)
    forward_q, forward_v, inverse = robot.forward_dynamics_derivatives(q, v, tau)
    close(inverse @ robot.mass_matrix(q), np.broadcast_to(np.eye(robot.nv), inverse.shape), 1e-9)
    for i in range(robot.nv):
        w = np.eye(robot.nv)[i]
        close(by_q[..., i], difference(lambda x: robot.inverse_dynamics(x, v, a), system, q, w), 1e-7)
        change = robot.inverse_dynamics(q, v + STEP * w, a) - robot.inverse_dynamics(q, v - STEP * w, a)
        close(by_v[..., i], change / (2 * STEP), 1e-7)
        found = difference(lambda x: robot.forward_dynamics(x, v, tau), system, q, w)
        close(forward_q[..., i], found, 1e-6)
        change = robot.forward_dynamics(q, v + STEP * w, tau) - robot.forward_dynamics(q, v - STEP * w, tau)
        close(forward_v[..., i], change / (2 * STEP), 1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_coriolis_matrix_and_gravity_make_up_the_bias(name):
    robot, system, q, v, _ = made(name)
    rest = np.zeros_like(v)
    damping = robot.inverse_dynamics(q, v, rest) + robot.inverse_dynamics(q, -v, rest)  # what is even in v
    quadratic = damping / 2 - robot.gravity(q)
    C = robot.coriolis(q, v)
    close(np.einsum("nij,nj->ni", C, v), quadratic)
    close(robot.gravity(q), robot.inverse_dynamics(q, rest, rest))
    rate = np.array([difference(robot.mass_matrix, system, q[k : k + 1], v[k])[0] for k in range(len(q))])
    close(C + np.swapaxes(C, 1, 2), rate, 1e-7)


@pytest.mark.parametrize("name", MODELS)
def test_momentum_is_that_of_the_bodies(name):
    robot, system, q, v, _ = made(name)
    p = system.parameter_values()
    masses = np.array([float(b.mass or 0) for b in MODELS[name]().describe().bodies])
    for k in range(len(q)):

        def places(x, k=k):
            return system.kernel("poses")(0.0, np.concatenate([x, v[k]]), p).reshape(-1, 12)[:, :3]

        centre = masses @ places(q[k]) / masses.sum()
        close(robot.centre_of_mass(q[k]), centre)
        speeds = difference(
            lambda rows, places=places: np.array([places(x) for x in rows]), system, q[k : k + 1], v[k]
        )[0]
        close(robot.momentum(q[k], v[k])[:3], masses @ speeds, 1e-7)
    if name in TREES:
        close(np.einsum("nij,nj->ni", robot.momentum_matrix(q), v), robot.momentum(q, v))


def test_angular_momentum_stays_without_gravity():
    free = symgen.Model("free")
    rng = np.random.default_rng(8)
    for k, kind in enumerate(("free", "revolute", "spherical")):
        free.body(f"b{k}", **random_body(rng))
        axis = {"axis": (0.3, -0.2, 0.9)} if kind == "revolute" else {}
        free.joint(f"j{k}", kind, f"b{k}", f"b{k - 1}" if k else "world", {"xyz": (0.1, 0.2, 0.3)}, **axis)
    robot, system = robot_of(free), free.derive()
    rates = {r["name"]: float(x) for r, x in zip(system.rates, rng.uniform(-1, 1, system.nv), strict=True)}
    found = system.run(2.0, rtol=1e-12, atol=1e-13, rate=rates)
    q, v = found.states[:, : system.nq], found.states[:, system.nq : system.nq + system.nv]
    momentum = robot.momentum(q, v)
    close(momentum, np.broadcast_to(momentum[0], momentum.shape), 1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_frames(name):
    robot, system, q, v, _ = made(name)
    for frame in robot.frames:
        _, rotation = robot.forward_kinematics(frame, q)
        J = robot.jacobian(frame, q)
        close(np.swapaxes(rotation, 1, 2) @ rotation, np.broadcast_to(np.eye(3), rotation.shape))
        for i in range(robot.nv):
            w = np.eye(robot.nv)[i]
            close(
                J[:, :3, i],
                difference(lambda x, frame=frame: robot.forward_kinematics(frame, x)[0], system, q, w),
                1e-8,
            )
            turned = difference(lambda x, frame=frame: robot.forward_kinematics(frame, x)[1], system, q, w)
            spin = turned @ np.swapaxes(rotation, 1, 2)
            close(J[:, 3:, i], np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], 1), 1e-8)
        rate = robot.jacobian_rate(frame, q, v)
        for k in range(len(q)):
            found = difference(lambda x, frame=frame: robot.jacobian(frame, x), system, q[k : k + 1], v[k])[0]
            close(rate[k], found, 1e-7)
        close(np.einsum("nij,nj->ni", rate, v), robot.drift(frame, q, v))


@pytest.mark.parametrize("name", TREES)
def test_regressor(name):
    robot, _, q, v, a = made(name)
    model = MODELS[name]()
    Y = robot.regressor(q, v, a)
    inertial = robot.inverse_dynamics(q, v, a)
    if name == "tree":  # springs, damping and rotors are no inertial parameters of links
        k = robot.rates.index("j2")
        inertial[:, k] -= 0.2 * v[:, k] + 3.0 * q[:, robot.coordinates.index("j2")] + 0.05 * a[:, k]
    close(Y @ robot.base_parameter_values(), inertial)
    rng = np.random.default_rng(5)
    more = [robot.regressor(*_random(robot, model, rng)) for _ in range(60)]
    stacked = np.vstack(more)
    values = np.linalg.svd(stacked / np.linalg.norm(stacked, axis=0), compute_uv=False)
    assert values[-1] > 1e-6 * values[0]  # no column follows from others


def _random(robot: Robot, model: Model, rng) -> tuple:
    q, v, a = (rng.uniform(-2, 2, n) for n in (robot.nq, robot.nv, robot.nv))
    first = [k for k, c in enumerate(model.describe().coordinates) if c.quaternion is not None][::4]
    for k in first:
        q[k : k + 4] /= np.linalg.norm(q[k : k + 4])
    return q, v, a


def test_a_seven_axis_arm_has_43_base_parameters():
    # Ten for each link, less 27 that no motion tells apart; as many as Pinocchio's regressor has rank.
    assert len(made("arm")[0].base_parameters) == 43


def four_bar(motors: tuple[str, ...]) -> Model:
    """A parallelogram with joints and a closing constraint."""
    m = Model("loop", gravity=(0, 0, -9.81))
    for k, (parent, at) in enumerate((("world", 0.0), ("b0", 0.4), ("b1", 0.7))):
        m.body(f"b{k}", mass=1.0 + k, com=(0.2, 0, 0), inertia=(0.01, 0.02, 0.02))
        m.joint(f"j{k}", "revolute", f"b{k}", parent, {"xyz": (at, 0, 0)}, axis=(0, -1, 0))
    m.point("end", "b2", (0.5, 0, 0))
    m.constraint("closes_x", sympy.Symbol("end_x") - 0.6)
    m.constraint("closes_z", sympy.Symbol("end_z"))
    for name in motors:
        m.force(name, m.input(f"{name}_torque", unit="N*m"))
    return m


@pytest.mark.parametrize("motors", [("j0",), ("j0", "j1"), ("j0", "j1", "j2")])
def test_equilibrium_torques_of_a_loop(motors):
    model = four_bar(motors)
    robot, system = robot_of(model, "equilibrium_torques"), model.derive()
    solution = system.run(1e-6, start={"j0": 0.9})
    q = solution.states[0, : system.nq]
    u = robot.equilibrium_torques(q)
    names = dict(zip(robot.actuators, u.tolist(), strict=True))
    p = system.parameter_values(names)
    y = np.concatenate([q, np.zeros(system.nv)])
    assert np.abs(system.kernel("rhs")(0.0, y, p)[system.nq : system.nq + system.nv]).max() < 1e-9
    # The least: no other that holds it is shorter, so u is in the row space of N^T B.
    G = system.kernel("constraint_jacobian")(0.0, y, p).reshape(system.m, system.nv)
    free = np.linalg.svd(G)[2][system.m :]
    at_rest = -system.kernel("forces")(0.0, y, system.parameter_values())
    B = np.zeros((system.nv, len(motors)))
    for j, name in enumerate(robot.actuators):
        B[:, j] = system.kernel("forces")(0.0, y, system.parameter_values({name: 1.0})) + at_rest
    close(u, np.linalg.pinv(free @ B) @ (free @ at_rest), 1e-10)


def test_forward_dynamics_closes_loops():
    model = four_bar(("j0",))
    robot = robot_of(model, ["forward_dynamics", "forward_dynamics_derivatives"])
    system = model.derive(jacobian=True)
    solution = system.run(1e-6, start={"j0": 0.9}, rate={"j0": 1.0})
    y = solution.states[0, : system.nq + system.nv]
    p = system.parameter_values({"j0_torque": 2.5})
    expected = system.kernel("rhs")(0.0, y, p)[system.nq : system.nq + system.nv]
    q, v, tau = y[: system.nq], y[system.nq :], [2.5, 0, 0]
    close(robot.forward_dynamics(q, v, tau), expected)
    by_q, by_v, by_tau = robot.forward_dynamics_derivatives(q, v, tau)
    whole = system.kernel("rhs_by_state")(0.0, y, p).reshape(6, 6)[3:]
    close(np.hstack([by_q, by_v]), whole)
    by_input = system.kernel("rhs_by_parameters")(0.0, y, p).reshape(6, -1)[3:, -1]
    close(by_tau[:, 0], by_input)


def test_calls_from_compiled_code():
    robot, _, q, v, a = made("arm")
    f, p = robot.numba("inverse_dynamics"), robot.parameter_values()

    @numba.njit
    def norms(states, p, out):
        total = np.zeros(len(states))
        for k in range(len(states)):
            f(0.0, states[k], p, out)
            total[k] = np.abs(out).max()
        return total

    found = norms(np.hstack([q, v, a]), p, np.zeros(robot.nv))
    close(found, np.abs(robot.inverse_dynamics(q, v, a)).max(axis=1))
    with pytest.raises(ValueError, match="an array is shorter"):
        norms(np.hstack([q, v]), p, np.zeros(robot.nv))


def test_arrays_of_states():
    robot, _, q, v, a = made("arm")
    one = robot.inverse_dynamics(q[0], v[0], a[0])
    assert one.shape == (7,)
    np.testing.assert_array_equal(robot.inverse_dynamics(q, v, a)[0], one)
    grid = robot.mass_matrix(q.reshape(2, 2, 7))
    assert grid.shape == (2, 2, 7, 7)
    np.testing.assert_array_equal(robot.inverse_dynamics(q, v[0], a[0])[0], one)
    assert robot.gravity(np.zeros((0, 7))).shape == (0, 7)
    with pytest.raises(ValueError, match="7 coordinates"):
        robot.gravity(np.zeros(6))
    with pytest.raises(ValueError, match="do not go together"):
        robot.inverse_dynamics(q, v[:3], a)
    with pytest.raises(TypeError, match="cannot be read as numbers"):
        robot.gravity("home")


def test_parameters():
    robot, _, q, _, _ = made("by_hand")
    assert not np.allclose(robot.gravity(q), robot.gravity(q, {"l": "60 cm"}))
    np.testing.assert_array_equal(
        robot.gravity(q, robot.parameter_values({"l": 0.6})), robot.gravity(q, {"l": 0.6})
    )
    with pytest.raises(ValueError, match="parameters and inputs"):
        robot.gravity(q, np.zeros(5))


def test_what_was_not_derived_is_named():
    robot = robot_of(seven_dof_arm(), "gravity")
    assert robot.functions == ("gravity",)
    with pytest.raises(UnknownNameError, match="without 'mass_matrix'"):
        robot.mass_matrix(np.zeros(7))
    with pytest.raises(UnknownNameError, match="without the frame 'tool'"):
        robot.jacobian("tool", np.zeros(7))
    with pytest.raises(ModelError, match="no function 'inverse_dinamics'"):
        robot_of(seven_dof_arm(), "inverse_dinamics")
    with pytest.raises(ModelError, match="no body or frame 'tool'"):
        robot_of(seven_dof_arm(), frames=["tool"])
    with pytest.raises(ModelError, match="the model has none"):
        robot_of(seven_dof_arm(), "equilibrium_torques")
    with pytest.raises(ModelError, match="trees of joints that stand on the world"):
        robot_of(by_hand(), "regressor")


def test_actuators_that_cannot_hold_it():
    with pytest.raises(ModelError, match="neither an actuator nor a loop holds 'theta'"):
        robot_of(by_hand(), "equilibrium_torques")
    model = by_hand()
    model.force("theta", 0.0 * model.input("none"))
    model.force("theta", model.input("M") * symgen.sin(sympy.Symbol("theta")))
    robot = robot_of(model, actuators=["F", "M"])
    close(robot.equilibrium_torques([0.0, 0.3]), [0.0, 0.3 * 9.81 * 0.5])
    with pytest.raises(RuntimeModelError, match="cannot hold it at rest there"):
        robot.equilibrium_torques([0.0, 0.0])


def test_from_a_file_and_from_the_cache(tmp_path, monkeypatch):
    path = tmp_path / "arm.toml"
    path.write_text(seven_dof_arm().to_toml())
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "cache"))
    first = symgen.robot(path, "gravity")
    monkeypatch.setattr("symgen.link.robot_text", None)  # may not be asked again
    again = symgen.robot(path, "gravity")
    np.testing.assert_array_equal(first.gravity(np.ones(7)), again.gravity(np.ones(7)))


def test_a_system_with_robot_functions(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(seven_dof_arm().to_toml())
    system = symgen.load(path, functions="gravity", frames=["link7"])
    q = np.full(7, 0.3)
    p = system.parameter_values()
    at_rest = np.concatenate([q, np.zeros(7)])
    close(system.gravity(q), -system.kernel("forces")(0.0, at_rest, p))
    assert system.jacobian("link7", q).shape == (6, 7)
    with pytest.raises(RuntimeModelError, match="functions='robot'"):
        symgen.load(path).inverse_dynamics(q, q, q)


def test_modules_of_robots_are_written_by_derive(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(seven_dof_arm().to_toml())
    result = CliRunner().invoke(main, ["derive", "arm.toml", "--functions", "robot", "--frame", "link7"])
    assert result.exit_code == 0, result.output
    robot = symgen.runtime.load_robot("generated/seven_dof_arm_robot.py")
    again = robot_of(seven_dof_arm(), "robot", ["link7"])
    assert robot.functions == again.functions
    q = np.full(7, 0.2)
    np.testing.assert_array_equal(robot.jacobian("link7", q), again.jacobian("link7", q))
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(robot)).gravity(q), robot.gravity(q))
    with pytest.raises(ModuleError, match="not those of a run"):
        symgen.runtime.load("generated/seven_dof_arm_robot.py")
    with pytest.raises(ModuleError, match="no functions for robot programs"):
        symgen.runtime.load_robot("generated/seven_dof_arm.py")
    result = CliRunner().invoke(main, ["derive", "arm.toml", "--functions", "rnea"])
    assert result.exit_code == 1
    assert "no function 'rnea'" in result.output


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("'functions': ['gravity']", "'functions': ['gravity', 'rhs']"),
        ("'functions': ['gravity']", "'functions': ['momentum']"),
        ("'functions': ['gravity']", "'functions': 3"),
        ("'frames': []", "'frames': ['../x']"),
    ],
)
def test_headers_that_lie(old, new):
    text = robot_text(seven_dof_arm(), requested("gravity"))
    old, new = old.replace("'", '"'), new.replace("'", '"')
    assert old in text
    with pytest.raises(ModuleError):
        symgen.runtime.load_robot(text.replace(old, new))
