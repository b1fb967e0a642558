"""Ready controllers against what they promise in closed form, and trajectories through way-points."""

from __future__ import annotations

import math

import numpy as np
import pytest
from trees import random_body

import symgen
from symgen import Model
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs import (
    Trajectory,
    computed_torque,
    gravity_compensation,
    impedance,
    regulator,
)

START = (0.3, -0.5, 0.8)
PLACES = [START, (0.6, -0.2, 0.5), (0.1, 0.4, 1.1)]


def arm() -> Model:
    """Three joints with full inertias and a motor each, one through a gear that turns it around."""
    rng = np.random.default_rng(4)
    model = Model("arm", gravity=(0, 0, "-9.81"))
    load = model.parameter("load", 0.0, unit="kg")
    parent, axes = "world", ((0, 0, 1), (0, 1, 0), (0, 1, 0))
    for k, axis in enumerate(axes):
        model.body(f"link{k}", **random_body(rng, 0.1))
        place = {"xyz": (0, 0, 0.4 if k else 0.1)}
        model.joint(f"q{k}", "revolute", f"link{k}", parent, place, axis=axis, start=START[k], damping=0.2)
        model.force(f"q{k}", model.input(f"u{k}", unit="N*m") * (-3 if k == 2 else 1))
        parent = f"link{k}"
    model.frame("tip", "link2", (0.05, 0, 0.35))
    model.body("weight", mass=load)
    model.joint("held", "fixed", "weight", "link2", {"xyz": (0.05, 0, 0.35)})
    return model


@pytest.fixture(scope="module")
def system():
    model = arm()
    return model.derive().with_robot(model.robot(frames=["tip"]))


@pytest.mark.slow
def test_computed_torque_makes_errors_a_critically_damped_spring(system):
    path = Trajectory(PLACES, [0.0, 0.7, 1.5])
    inputs = computed_torque(system, path, 25.0, 10.0)
    assert list(inputs) == [("u0", "u1", "u2")]
    off = np.array([0.2, -0.1, 0.05])
    start = {f"q{k}": START[k] + off[k] for k in range(3)}
    run = system.run(t_end=2.0, inputs=inputs, start=start, rtol=1e-9, atol=1e-11, breaks=path.times[1:])
    wanted = np.array([path(t)[0] for t in run.t])
    error = off * ((1.0 + 5.0 * run.t) * np.exp(-5.0 * run.t))[:, None]  # of e'' + 10 e' + 25 e = 0
    assert np.abs(run.q - wanted - error).max() < 1e-7


@pytest.mark.slow
def test_sampled_controllers_do_as_much_as_their_period_lets_them(system):
    path = Trajectory(PLACES, [0.0, 0.7, 1.5])
    run = system.run(t_end=1.5, inputs=computed_torque(system, path, 400.0, 40.0, period=0.002))
    assert np.abs(run.q[-1] - PLACES[-1]).max() < 0.01


def test_gravity_compensation_comes_to_where_it_is_wanted(system):
    goal = np.array([0.0, 0.4, -0.3])
    run = system.run(t_end=60.0, inputs=gravity_compensation(system, goal, 30.0, 12.0), rtol=1e-9)
    assert np.abs(run.q[-1] - goal).max() < 1e-6
    held = np.array([run[f"u{k}"][-1] for k in range(3)])
    assert np.allclose(held * [1, 1, -3], system.robot.gravity(goal), atol=1e-5)


@pytest.mark.parametrize("turned", [False, True])
def test_a_frame_sags_under_a_load_as_springs_would(turned, system):
    q0 = np.array(START)
    place, rotation = system.robot.forward_kinematics("tip", q0)
    spring = np.array([400.0, 600.0, 800.0])
    turning = {"rotation": rotation, "turning_stiffness": 2.0, "turning_damping": 0.5} if turned else {}
    inputs = impedance(
        system, "tip", place, spring, 60.0, parameters={"load": 0.0}, joint_damping=3.0, **turning
    )
    run = system.run(t_end=60.0, inputs=inputs, parameters={"load": 2.0}, rtol=1e-9)
    assert np.abs(run.v[-1]).max() < 1e-6
    q = run.q[-1]
    found, attitude = system.robot.forward_kinematics("tip", q)
    error = attitude.T @ rotation
    angle = math.acos((np.trace(error) - 1.0) / 2.0)
    axis = np.array([error[2, 1] - error[1, 2], error[0, 2] - error[2, 0], error[1, 0] - error[0, 1]])
    moment = 2.0 * attitude @ (axis / (2.0 * math.sin(angle)) * angle) if turned else np.zeros(3)
    J = system.robot.jacobian("tip", q)
    left = J.T @ np.concatenate([spring * (place - found) - [0.0, 0.0, 2.0 * 9.81], moment])
    assert np.abs(left).max() < 1e-5 * 2.0 * 9.81
    if not turned:  # three joints and three directions: the sag is that of the springs
        assert np.allclose(place - found, [0.0, 0.0, 2.0 * 9.81 / 800.0], atol=1e-6)


def test_the_regulator_is_that_of_the_bundled_model():
    system = load_model(find("cart_pole_lqr")).derive()
    inputs = regulator(system, (1.0, 10.0, 1.0, 1.0), 0.1, at={"theta": 0.0})
    run = system.run(t_end=8.0, inputs=inputs, rtol=1e-9)
    assert np.abs(np.concatenate([run.q[-1], run.v[-1]])).max() < 1e-3
    slow = system.run(
        t_end=8.0, inputs=regulator(system, (1.0, 10.0, 1.0, 1.0), 1e3, at={"theta": 0.0}), rtol=1e-9
    )
    assert np.abs(slow.q[:, 0]).max() > 1.5 * np.abs(run.q[:, 0]).max()


def test_the_regulator_holds_an_arm_against_its_weight(system):
    at = {"q0": 0.1, "q1": 0.7, "q2": -0.4}
    run = system.run(
        t_end=20.0, inputs=regulator(system, (100.0,) * 3 + (1.0,) * 3, 0.1, at=at), rtol=1e-9,
        start={"q0": 0.15, "q1": 0.72, "q2": -0.45},
    )  # fmt: skip
    assert np.abs(run.q[-1] - list(at.values())).max() < 1e-5


def test_what_cannot_be_controlled_is_refused(system):
    with pytest.raises(RuntimeModelError, match=r"loaded without functions for robot programs"):
        computed_torque(arm().derive(), START, 1.0, 1.0)
    with pytest.raises(RuntimeModelError, match=r"derived without the frame 'tap'.*'tip'"):
        impedance(system, "tap", (0, 0, 1), 1.0, 1.0)
    with pytest.raises(RuntimeModelError, match=r"stiffness: give a number, or 3 finite numbers"):
        computed_torque(system, START, (1.0, 2.0), 1.0)
    with pytest.raises(RuntimeModelError, match=r"damping is negative"):
        computed_torque(system, START, 1.0, -1.0)
    with pytest.raises(RuntimeModelError, match=r"path of 2 coordinates for 3"):
        computed_torque(system, Trajectory([(0, 0), (1, 1)], [0, 1]), 1.0, 1.0)
    cart = load_model(find("cart_pole_lqr"))
    cart = cart.derive().with_robot(cart.robot())
    with pytest.raises(RuntimeModelError, match=r"do not drive every rate: nothing drives theta"):
        computed_torque(cart, (0.0, 0.0), 1.0, 1.0)
    with pytest.raises(RuntimeModelError, match=r"cannot hold it at rest there: 'theta' is pulled"):
        regulator(cart, (1.0,) * 4, 1.0, at={"theta": 0.3})
    with pytest.raises(RuntimeModelError, match=r"'thetta' is no coordinate.*'theta'"):
        regulator(cart, (1.0,) * 4, 1.0, at={"thetta": 0.3})
    ball = Model("ball")
    ball.body("b", mass=1, inertia=(1, 1, 1))
    ball.joint("j", "spherical", "b")
    with pytest.raises(RuntimeModelError, match=r"has quaternions"):
        regulator(ball.derive(), (1.0,) * 6, 1.0)
    swing = Model("swing")
    x = swing.coordinate("x")
    swing.body("b", mass=1, com=(x, 0))
    swing.force(x, swing.input("u") * symgen.cos(x))
    with pytest.raises(RuntimeModelError, match=r"what the input 'u' does depends on the state"):
        regulator(swing.derive(), (1.0, 1.0), 1.0)


@pytest.mark.parametrize("stops", [False, True])
def test_a_trajectory_goes_through_its_points_within_its_limits(stops):
    rng = np.random.default_rng(7)
    points, limits = rng.uniform(-1, 1, (6, 3)), {"speed": (1.0, 2.0, 0.5), "acceleration": 4.0}
    path = Trajectory(points, names=["a", "b", "c"], stops=stops, **limits)
    for t, point in zip(path.times, points, strict=True):
        assert np.allclose(path(t)[0], point, atol=1e-12)
    for t in (path.times[0], path.times[-1], *(path.times if stops else ())):
        assert np.allclose(path(t)[1:], 0.0, atol=1e-9)
    t = np.linspace(path.times[0], path.times[-1], 20_001)
    q, v, a = (np.array(x) for x in zip(*map(path, t), strict=True))
    assert np.allclose(np.gradient(q, t, axis=0)[1:-1], v[1:-1], atol=1e-5)
    assert np.allclose(np.gradient(v, t, axis=0)[1:-1], a[1:-1], atol=2e-2)
    use = max((np.abs(v).max(axis=0) / limits["speed"]).max(), np.abs(a).max() / 4.0)
    assert 0.999 < use <= 1.0 + 1e-9  # one of the limits is reached, none passed
    assert path["b"](t[777]) == q[777, 1]
    assert np.array_equal(path(-1.0)[0], path(0.0)[0]) and not path(1e3)[1].any()


def test_one_way_is_the_polynomial_of_degree_5():
    path = Trajectory([1.0, 3.0], [2.0, 6.0])
    s = 0.3
    assert path(2.0 + 4.0 * s)[0][0] == pytest.approx(
        1.0 + 2.0 * (10 * s**3 - 15 * s**4 + 6 * s**5), abs=1e-13
    )
    fast = Trajectory(
        [1.0, 3.0], acceleration=5.0
    )  # largest at s = (3 - sqrt(3))/6: 10/sqrt(3) of way / time^2
    assert fast.times[-1] == pytest.approx(math.sqrt(2.0 * 10.0 / math.sqrt(3.0) / 5.0), rel=1e-12)


def test_a_trajectory_is_an_input():
    model = Model("follower")
    x = model.coordinate("x", start=1.0)
    model.body("b", mass=1, com=(x, 0))
    model.force(x, 100 * (model.input("wanted") - x) - 20 * symgen.dot(x))
    path = Trajectory([1.0, 3.0, 2.0], [0.0, 2.0, 5.0], names=["x"])
    run = model.derive().run(t_end=8.0, inputs={"wanted": path["x"]}, rtol=1e-9)
    assert abs(run.q[-1, 0] - 2.0) < 1e-6


@pytest.mark.parametrize(
    ("points", "more", "says"),
    [
        ([1.0], {"times": [0.0]}, "rows of two or more"),
        ([1.0, 2.0], {}, "give times, or the largest speed"),
        ([1.0, 2.0], {"times": [0.0, 0.0]}, "each after the one before"),
        ([1.0, 2.0], {"times": [0.0, 1.0, 2.0]}, "times of 2 way-points"),
        ([1.0, 1.0], {"speed": 1.0}, "way-points 1 and 2 are the same"),
        ([1.0, math.nan], {"speed": 1.0}, "must be finite"),
        (["a", "b"], {"speed": 1.0}, "cannot be read as numbers"),
        ([1.0, 2.0], {"speed": -1.0}, "largest speed: give a positive number"),
        ([1.0, 2.0], {"speed": 1.0, "names": ["x", "y"]}, "2 names for way-points of 1"),
        ([1.0, 2.0], {"times": [0.0, 1.0], "speed": 1.0}, "times have to be 1.875 times as long"),
    ],
)
def test_what_is_no_trajectory_is_refused(points, more, says):
    with pytest.raises(RuntimeModelError, match=says):
        Trajectory(points, **more)
    with pytest.raises(KeyError, match=r"no coordinate 'z'"):
        Trajectory([1.0, 2.0], [0.0, 1.0], names=["x"])["z"]
