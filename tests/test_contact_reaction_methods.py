"""Friction in proportion to reactions, smooth and dry, by all kinds of methods, against reduced equations by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen import Model, cos, dot, sin, sqrt
from symgen.runtime.constraints.dependence import dependent_constraints

G = 9.81


def sense(speed: float, width: float | None) -> float:
    return np.sign(speed) if width is None else speed / np.hypot(speed, width)


def exact(slope, end: float, start: list[float]) -> np.ndarray:
    return solve_ivp(slope, (0.0, end), start, rtol=1e-11, atol=1e-13).y[:, -1]


def pin(smooth: float | None) -> Model:
    """A pendulum on a pin with two constraint forces, braked by a torque in proportion to their magnitude."""
    m = Model("pin", gravity=(0, -G))
    x, y = m.coordinate("x", guess=1.0), m.coordinate("y", guess=0.1)
    a = m.coordinate("a", start=1.0, rate=3.0)
    m.body("bar", mass=2.0, inertia=0.7, com=(x, y), angle=a)
    m.constraint("pin_x", x - 0.5 * sin(a))
    m.constraint("pin_y", y + 0.5 * cos(a))
    m.friction("hinge", coordinate=a, coefficient=0.05, normal=["pin_x", "pin_y"], smooth=smooth)
    return m


def swing(angle: float, w: float, width: float | None) -> float:
    """The angular acceleration of `pin`: force and torque determine each other, as a fixed point."""
    level = 0.0
    for _ in range(60):
        change = (-2.0 * G * 0.5 * np.sin(angle) - level * sense(w, width)) / (0.7 + 2.0 * 0.25)
        ax = 0.5 * (change * np.cos(angle) - w**2 * np.sin(angle))
        ay = 0.5 * (change * np.sin(angle) + w**2 * np.cos(angle))
        level = 0.05 * np.hypot(2.0 * ax, 2.0 * (ay + G))
    return change


METHODS = [
    ({"method": "dop853"}, 1e-8),
    ({"method": "taylor"}, 1e-8),
    ({"method": "radau5"}, 1e-7),
    ({"method": "bdf"}, 1e-6),
    ({"method": "radau5", "constraints": "ggl"}, 1e-6),
    ({"method": "bdf", "constraints": "ggl"}, 1e-6),
    ({"method": "dop853", "constraints": "partition"}, 1e-8),
]


def named(option: object) -> str | None:
    return "-".join(option.values()) if isinstance(option, dict) else None


@pytest.fixture(scope="module")
def smooth_pin():
    return pin(0.05).derive()


@pytest.fixture(scope="module")
def swung():
    """After 1.5 s it has come back and turned round."""
    return exact(lambda t, x: [x[1], swing(*x, 0.05)], 1.5, [1.0, 3.0])


@pytest.mark.parametrize(("options", "tolerance"), METHODS, ids=named)
def test_smooth_friction_of_a_pin(smooth_pin, swung, options, tolerance):
    solution = smooth_pin.run(t_end=1.5, rtol=1e-9, atol=1e-11, **options)
    assert solution.ok and not solution.events
    np.testing.assert_allclose(
        [solution["a"][-1], solution["dot(a)"][-1]], swung, rtol=tolerance, atol=tolerance
    )
    forces, rate = np.hypot(*solution.multipliers.T), solution["dot(a)"]
    torque = -0.05 * forces * rate / np.hypot(rate, 0.05)
    np.testing.assert_allclose(solution["force(hinge)"], torque, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("method", ["generalized_alpha", "hht"])
@pytest.mark.parametrize("form", ["projection", "index3", "ggl"])
def test_smooth_friction_by_fixed_steps_of_order_two(smooth_pin, method, form):
    end = exact(lambda t, x: [x[1], swing(*x, 0.05)], 0.4, [1.0, 3.0])
    errors = []
    for step in (2e-3, 1e-3):
        solution = smooth_pin.run(t_end=0.4, method=method, constraints=form, step=step)
        assert solution.ok
        errors.append(np.abs([solution["a"][-1], solution["dot(a)"][-1]] - end).max())
    assert errors[1] < 2e-5 and 3.0 < errors[0] / errors[1] < 5.0


def test_the_linear_model_of_smooth_friction_has_the_derivatives_of_the_motion(smooth_pin):
    linear = smooth_pin.linearise("start", start={"a": 0.3}, rate={"a": 0.2})
    h = 1e-5
    by_angle = (swing(0.3 + h, 0.2, 0.05) - swing(0.3 - h, 0.2, 0.05)) / (2.0 * h)
    by_rate = (swing(0.3, 0.2 + h, 0.05) - swing(0.3, 0.2 - h, 0.05)) / (2.0 * h)
    np.testing.assert_allclose(linear.A, [[0.0, 1.0], [by_angle, by_rate]], rtol=1e-8, atol=1e-12)
    assert not any("friction" in note for note in linear.notes)


def bump() -> Model:
    """A bead on a wire along y = cos x, so fast that the wire first pulls it down, later carries it."""
    m = Model("bump", gravity=(0, -G))
    x, y = m.coordinate("x", start=0.0, rate=3.5), m.coordinate("y", guess=1.0)
    m.body("bead", mass=0.3, com=(x, y))
    m.constraint("wire", y - cos(x))
    s = sqrt(1 + sin(x) ** 2)
    m.friction("rub", speed=(dot(x) - sin(x) * dot(y)) / s, coefficient=0.2 * s, normal="wire")
    return m


def slide(t: float, state: np.ndarray) -> list[float]:
    """Of the two signs of the force on the bead, the one that it has."""
    x, v = state
    for sign in (1.0, -1.0):
        rub = 0.2 * sign * np.sign(v)
        matrix = [[1.0, rub - np.sin(x)], [-np.sin(x), -1.0 - rub * np.sin(x)]]
        change, force = np.linalg.solve(matrix, [0.0, np.cos(x) * v**2 - G])
        if force * sign >= 0.0:
            break
    return [v, change]


@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_a_reaction_may_change_its_sign(method):
    solution = bump().derive().run(t_end=1.0, method=method, rtol=1e-9, atol=1e-11)
    assert solution.ok
    forces = solution.multipliers[:, 0]
    assert forces[0] < 0.0 < forces[-1]
    expected = solve_ivp(slide, (0.0, 1.0), [0.0, 3.5], rtol=1e-10, atol=1e-12, max_step=1e-2).y[:, -1]
    np.testing.assert_allclose([solution["x"][-1], solution["dot(x)"][-1]], expected, rtol=1e-7)


def cart(smooth: float | None) -> Model:
    """A block that slides on the floor, with a bob on a rod below it and a wall far away."""
    m = Model("cart", gravity=(0, -G))
    x, y = m.coordinate("x", start=0.0, rate=1.5), m.coordinate("y", start=0.0)
    u, z = m.coordinate("u", start=0.5, rate=1.5), m.coordinate("z", guess=-0.9)
    m.body("block", mass=2.0, com=(x, y))
    m.body("bob", mass=0.5, com=(u, z))
    m.constraint("rod", ((u - x) ** 2 + (z - y) ** 2 - 1) / 2)
    m.stop("floor", y)
    m.stop("wall", 10 - x)
    m.friction("ground", coordinate=x, coefficient=0.2, normal="floor", smooth=smooth)
    return m


def pull(t: float, state: np.ndarray, width: float | None) -> list[float]:
    """With the rod's angle: accelerations of block and angle, tension and force of the floor from four equations."""
    _, angle, speed, w = state
    s, c = np.sin(angle), np.cos(angle)
    matrix = [
        [2.0, 0.0, -s, 0.2 * sense(speed, width)],
        [0.0, 0.0, -c, 1.0],
        [0.5, 0.5 * c, s, 0.0],
        [0.0, 0.5 * s, -c, 0.0],
    ]
    right = [0.0, 2.0 * G, 0.5 * s * w**2, -0.5 * c * w**2 - 0.5 * G]
    change = np.linalg.solve(matrix, right)
    return [speed, w, change[0], change[1]]


@pytest.mark.parametrize(("options", "tolerance"), METHODS[:-1], ids=named)
@pytest.mark.parametrize("smooth", [None, 0.05])
def test_a_block_that_a_stop_and_a_rod_hold(smooth, options, tolerance):
    solution = cart(smooth).derive().run(t_end=0.4, rtol=1e-9, atol=1e-11, **options)
    assert solution.ok and not solution.events
    x, angle, speed, w = exact(lambda t, s: pull(t, s, smooth), 0.4, [0.0, np.pi / 6.0, 1.5, 0.0])
    expected = [x, x + np.sin(angle), speed, speed + np.cos(angle) * w]
    found = [solution[name][-1] for name in ("x", "u", "dot(x)", "dot(u)")]
    np.testing.assert_allclose(found, expected, rtol=tolerance)


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
def test_smooth_friction_on_a_stop_holds_up_to_creep(method):
    """A block that falls on an incline flatter than its angle of friction, slides, and creeps down."""
    angle, width = 0.1, 1e-3
    m = Model("incline", gravity=(-G * np.sin(angle), -G * np.cos(angle)))
    x, y = m.coordinate("x", start=0.0, rate=3.0), m.coordinate("y", start=0.5)
    m.body("block", mass=2.0, com=(x, y))
    m.stop("floor", y)
    m.friction("ground", coordinate=x, coefficient=0.3, normal="floor", smooth=width)
    solution = m.derive().run(t_end=2.0, method=method)
    assert solution.ok
    assert [(e.name, e.action) for e in solution.events] == [("floor", "impact")]
    fall = np.sqrt(2.0 * 0.5 / (G * np.cos(angle)))
    first = solution.events[0]
    assert first.t == pytest.approx(fall, rel=1e-10)
    # Friction has a share of the impact: 0.3 times the impulse of the floor.
    lost = 0.3 * G * np.cos(angle) * fall
    assert first.v_after[0] == pytest.approx(3.0 - G * np.sin(angle) * fall - lost, rel=1e-9)
    part = np.tan(angle) / 0.3
    assert solution["dot(x)"][-1] == pytest.approx(-width * part / np.sqrt(1.0 - part**2), rel=1e-6)
    np.testing.assert_allclose(
        solution.contact_forces[-1], [2.0 * G * np.cos(angle), 2.0 * G * np.sin(angle)], rtol=1e-6
    )


def jamming(driven: bool) -> Model:
    """The normal force is m g / (1 - 0.8 φ t), φ = s / sqrt(s² + w²), as friction has a share of 0.8 along it."""
    m = Model("jamming", gravity=(0, -G))
    x, y = m.coordinate("x", start=0.0, rate=1000.0), m.coordinate("y", start=0.0)
    m.body("b", mass=1.0, com=(x, y))
    m.constraint("floor", y)
    if driven:
        m.constraint("drive", "x - 1000*t")
    m.friction("rub", speed=dot(x) + 0.8 * dot(y), coefficient="t", normal="floor", smooth=10.0)
    return m


def test_smooth_friction_that_comes_to_the_paradox_ends_there():
    solution = jamming(driven=True).derive().run(t_end=2.0, method="dop853")
    assert solution.status == "failed" and "Painlevé" in solution.message and "rub" in solution.message
    assert solution.t[-1] == pytest.approx(1.25 * np.hypot(1000.0, 10.0) / 1000.0, abs=1e-6)


def test_smooth_friction_that_can_give_way_goes_on_past_the_paradox():
    def brake(t, state):
        part = sense(state[0], 10.0) * t
        return [-part * G / (1.0 - 0.8 * part)]

    expected = solve_ivp(brake, (0.0, 2.0), [1000.0], method="Radau", rtol=1e-9, atol=1e-9).y[0, -1]
    solution = jamming(driven=False).derive().run(t_end=2.0, method="radau5")
    assert solution.ok
    assert solution["dot(x)"][-1] == pytest.approx(expected, rel=1e-6)


def test_forces_that_are_not_unique_give_no_smooth_friction():
    m = Model("twice", gravity=(0, -G))
    x, y = m.coordinate("x", rate=1.0), m.coordinate("y", start=0.0)
    m.body("b", mass=1.0, com=(x, y))
    m.constraint("one", y)
    m.constraint("two", 2 * y)
    m.friction("rub", coordinate=x, coefficient=0.1, normal="one", smooth=1e-3)
    solution = m.derive().run(t_end=1.0, method="dop853")
    assert solution.status == "failed" and "not unique" in solution.message


def test_what_is_not_held_depends_on_nothing():
    system = cart(None).derive().closed
    p, q = system.parameter_values(), np.array([0.0, 0.0, 0.5, -np.sqrt(0.75)])
    p[system.n_settable :] = 0.0
    assert dependent_constraints(system, p, 0.0, q) == []
    p[system.n_settable :] = 1.0  # floor and wall, and friction along the wall's normal
    assert dependent_constraints(system, p, 0.0, q) == ["wall", "ground"]


def test_the_method_follows_from_what_is_held_at_the_start():
    """Friction on a stop is stiff while that is closed, which it is from the start."""
    m = Model("sled", gravity=(0, -G))
    x, y = m.coordinate("x", start=0.0, rate=0.5), m.coordinate("y", start=0.0)
    m.body("block", mass=2.0, com=(x, y))
    m.force(x, "3*sin(5*t)")
    m.stop("floor", y)
    m.friction("ground", coordinate=x, coefficient=0.3, normal="floor", smooth=1e-5)
    system = m.derive()
    solution = system.run(t_end=2.0)
    assert solution.ok and solution.method == "radau9"
    assert solution.stats["steps"] < 1000
    lifted = system.run(t_end=0.2, start={"y": 10.0})
    assert lifted.ok and lifted.method == "taylor"
