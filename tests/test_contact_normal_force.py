"""Dry friction in proportion to the force of a stop or of constraints, against formulas and reduced equations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen import Model, cos, dot, sin, sqrt
from symgen.errors import ModelError
from symgen.runtime.errors import RuntimeModelError

G = 9.81


def incline(angle: float, smooth: float | None = None) -> Model:
    m = Model("incline", gravity=(-G * np.sin(angle), -G * np.cos(angle)))
    x, y = m.coordinate("x", start=0.0, rate=1.0), m.coordinate("y", start=0.0)
    m.body("block", mass=2.0, com=(x, y))
    m.stop("floor", y, m.parameter("e", 0.0))
    m.friction("ground", coordinate=x, coefficient=m.parameter("mu", 0.3), normal="floor", smooth=smooth)
    return m


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
@pytest.mark.parametrize(("angle", "sticks"), [(0.29, True), (0.30, False)])
def test_a_block_on_an_incline(angle, sticks, method):
    mu = 0.3  # tan 0.29 = 0.298, tan 0.30 = 0.309
    solution = incline(angle).derive().run(t_end=2.0, method=method)
    assert solution.ok
    up = 1.0 / (G * (np.sin(angle) + mu * np.cos(angle)))
    assert [(e.name, e.action) for e in solution.events] == [("ground", "stick" if sticks else "turn")]
    assert solution.events[0].t == pytest.approx(up, rel=1e-10)
    down = 0.0 if sticks else -G * (np.sin(angle) - mu * np.cos(angle)) * (2.0 - up)
    assert solution["dot(x)"][-1] == pytest.approx(down, abs=1e-10)
    held = np.sin(angle) if sticks else mu * np.cos(angle)
    np.testing.assert_allclose(
        solution.contact_forces[-1], [2.0 * G * np.cos(angle), 2.0 * G * held], rtol=1e-10
    )


def test_a_push_on_a_block_must_grow_beyond_static_friction():
    m = Model("pushed", gravity=(0, -G))
    x, y = m.coordinate("x", start=0.0, rate=0.0), m.coordinate("y", start=0.0)
    m.body("block", mass=2.0, com=(x, y))
    m.force(x, "3*t")
    m.stop("floor", y)
    m.friction("ground", coordinate=x, coefficient=0.3, static=0.5, normal="floor")
    solution = m.derive().run(t_end=5.0, method="dop853", rtol=1e-10, atol=1e-12)
    assert solution.ok
    slips = 0.5 * 2.0 * G / 3.0
    assert [(e.name, e.action) for e in solution.events] == [("ground", "slip")]
    assert solution.events[0].t == pytest.approx(slips, rel=1e-10)
    s = 5.0 - slips
    assert solution["x"][-1] == pytest.approx(
        ((3.0 * slips - 0.6 * G) * s**2 / 2 + 3.0 * s**3 / 6) / 2.0, rel=1e-9
    )


@pytest.mark.parametrize(("mu", "e"), [(0.3, 0.0), (0.3, 0.5), (2.0, 0.5)])
def test_the_impulse_of_friction_is_in_proportion_to_that_of_the_impact(mu, e):
    system = incline(0.0).derive()
    solution = system.run(
        t_end=1.0, method="dop853", parameters={"mu": mu, "e": e}, start={"y": 1.0}, rate={"x": 3.0}
    )
    assert solution.ok
    first, down = solution.events[0], np.sqrt(2.0 * G)
    assert first.action == "impact"
    np.testing.assert_allclose(
        first.v_after, [max(3.0 - mu * (1.0 + e) * down, 0.0), e * down], rtol=1e-9, atol=1e-12
    )


LADDER = 0.4  # μ at both ends; slides below tan a = (1 - μ²) / (2 μ)


@pytest.fixture(scope="module")
def ladder():
    """A rod of 2 m and 5 kg between floor and wall; `a` is its angle to the floor."""
    m = Model("ladder", gravity=(0, -G))
    x, y = m.coordinate("x", guess=0.5), m.coordinate("y", guess=0.5)
    a = m.coordinate("a", start=0.6, rate=0.0)
    m.body("rod", mass=5.0, inertia=5.0 / 3.0, com=(x, y), angle=-a)
    mu = m.parameter("mu", LADDER)
    m.stop("floor", y - sin(a))
    m.stop("wall", x - cos(a))
    m.friction("foot", speed=dot(x) - sin(a) * dot(a), coefficient=mu, normal="floor")
    m.friction("top", speed=dot(y) + cos(a) * dot(a), coefficient=mu, normal="wall")
    return m.derive()


def leaning(angle: float) -> dict:
    return {"a": angle, "x": np.cos(angle), "y": np.sin(angle)}


@pytest.mark.parametrize("above", [0.01, -0.01])
def test_a_ladder_slides_below_its_angle_of_friction(ladder, above):
    angle = np.arctan((1.0 - LADDER**2) / (2.0 * LADDER)) + above
    solution = ladder.run(t_end=0.5, method="dop853", start=leaning(angle))
    assert solution.ok and not solution.events
    if above > 0.0:  # it stands on more frictions than it needs
        np.testing.assert_allclose(solution["a"], angle, rtol=1e-12)
        floor, wall, foot, top = solution.contact_forces[-1]
        assert floor + top == pytest.approx(5.0 * G, rel=1e-9) and wall == pytest.approx(-foot, rel=1e-9)
        assert abs(foot) <= LADDER * floor * (1 + 1e-9) and abs(top) <= LADDER * wall * (1 + 1e-9)
    else:
        assert solution["a"][-1] < angle - 1e-3


@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_a_sliding_ladder_moves_as_its_one_equation_says(ladder, method):
    def fall(t, state):
        a, w = state
        mass, inertia, mu = 5.0, 5.0 / 3.0, LADDER
        matrix = [
            [-mass * np.cos(a), 1.0, mu],
            [mass * np.sin(a), -mu, 1.0],
            [-inertia, mu * np.sin(a) - np.cos(a), mu * np.cos(a) + np.sin(a)],
        ]
        right = [mass * (G - np.sin(a) * w**2), -mass * np.cos(a) * w**2, 0.0]
        return [w, np.linalg.solve(matrix, right)[0]]

    exact = solve_ivp(fall, (0.0, 0.3), [0.6, 0.0], rtol=1e-11, atol=1e-13).y[:, -1]
    solution = ladder.run(t_end=0.3, method=method, start=leaning(0.6), rtol=1e-10, atol=1e-12)
    assert solution.ok
    np.testing.assert_allclose([solution["a"][-1], solution["dot(a)"][-1]], exact, rtol=1e-9)


@pytest.mark.parametrize("angle", [0.29, 0.30])
def test_two_feet_share_what_holds_a_block(angle):
    """Frictions of both feet hold the same motion: one is a constraint, the other keeps its share."""
    m = Model("feet", gravity=(-G * np.sin(angle), -G * np.cos(angle)))
    x, y, a = (
        m.coordinate("x", start=0.0, rate=1.0),
        m.coordinate("y", start=0.2),
        m.coordinate("a", start=0.0),
    )
    m.body("block", mass=3.0, inertia=0.1, com=(x, y), angle=a)
    for k, side in enumerate((-0.3, 0.3)):
        m.stop(f"foot{k}", y + side * sin(a) - 0.2 * cos(a))
        slip = dot(x) + (0.2 * cos(a) - side * sin(a)) * dot(a)
        m.friction(f"rub{k}", speed=slip, coefficient=0.3, normal=f"foot{k}")
    solution = m.derive().run(t_end=1.0, method="dop853")
    assert solution.ok
    up = 1.0 / (G * (np.sin(angle) + 0.3 * np.cos(angle)))
    sticks = angle < 0.295
    assert [(e.name, e.action) for e in solution.events] == [
        (f"rub{k}", "stick" if sticks else "turn") for k in range(2)
    ]
    np.testing.assert_allclose([e.t for e in solution.events], up, rtol=1e-10)
    down = 0.0 if sticks else -G * (np.sin(angle) - 0.3 * np.cos(angle)) * (1.0 - up)
    assert solution["dot(x)"][-1] == pytest.approx(down, abs=1e-10)
    first, second, *rubs = solution.contact_forces[-1]
    assert first + second == pytest.approx(3.0 * G * np.cos(angle), rel=1e-9)
    assert sum(rubs) == pytest.approx(3.0 * G * (np.sin(angle) if sticks else 0.3 * np.cos(angle)), rel=1e-9)
    assert np.all(np.abs(rubs) <= 0.3 * np.array([first, second]) * (1.0 + 1e-9))


def wire(smooth: float | None = None) -> Model:
    """A bead on the parabola y = x²/2; the multiplier is the normal force over sqrt(1 + x²)."""
    m = Model("wire", gravity=(0, -G))
    x, y = m.coordinate("x", start=-1.0, rate=0.0), m.coordinate("y", guess=0.5)
    m.body("bead", mass=0.3, com=(x, y))
    m.constraint("wire", y - x**2 / 2)
    s = sqrt(1 + x**2)
    slip, mu = (dot(x) + x * dot(y)) / s, m.parameter("mu", 0.2)
    m.friction("rub", speed=slip, coefficient=mu * s, normal="wire", smooth=smooth)
    return m


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
def test_a_bead_on_a_wire_rubs_with_the_force_of_its_constraint(method):
    def slide(t, state):
        x, v = state
        s = np.sqrt(1.0 + x**2)
        normal = G / s + v**2 / s
        along = -G * x / s - 0.2 * abs(normal) * np.sign(v)
        return [v, (along - x * v**2 / s) / s]

    exact = solve_ivp(slide, (0.0, 0.5), [-1.0, 1e-300], rtol=1e-11, atol=1e-13).y[:, -1]
    solution = wire().derive().run(t_end=0.5, method=method, rtol=1e-9, atol=1e-11)
    assert solution.ok and not solution.events
    np.testing.assert_allclose([solution["x"][-1], solution["dot(x)"][-1]], exact, rtol=1e-7)


@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_friction_of_a_pin_follows_the_magnitude_of_its_force(method):
    """A pendulum on a pin with two constraint forces, braked by a torque of r μ times the force."""
    m = Model("pin", gravity=(0, -G))
    x, y, a = (
        m.coordinate("x", guess=1.0),
        m.coordinate("y", guess=0.1),
        m.coordinate("a", start=1.0, rate=3.0),
    )
    m.body("bar", mass=2.0, inertia=0.7, com=(x, y), angle=a)
    m.constraint("pin_x", x - 0.5 * sin(a))
    m.constraint("pin_y", y + 0.5 * cos(a))
    m.friction("hinge", coordinate=a, coefficient=0.05, normal=["pin_x", "pin_y"])
    solution = m.derive().run(t_end=0.3, method=method, rtol=1e-10, atol=1e-12)

    def swing(t, state):
        angle, w = state
        # Force and torque depend on each other: the level is found as a fixed point.
        level = 0.0
        for _ in range(60):
            change = (-2.0 * G * 0.5 * np.sin(angle) - level * np.sign(w)) / (0.7 + 2.0 * 0.25)
            ax = 0.5 * (change * np.cos(angle) - w**2 * np.sin(angle))
            ay = 0.5 * (change * np.sin(angle) + w**2 * np.cos(angle))
            level = 0.05 * np.hypot(2.0 * ax, 2.0 * (ay + G))
        return [w, change]

    exact = solve_ivp(swing, (0.0, 0.3), [1.0, 3.0], rtol=1e-10, atol=1e-12).y[:, -1]
    assert solution.ok
    np.testing.assert_allclose([solution["a"][-1], solution["dot(a)"][-1]], exact, rtol=1e-8)
    forces = np.hypot(*solution.multipliers.T[:2])
    np.testing.assert_allclose(np.abs(solution["force(hinge)"]), 0.05 * forces, rtol=1e-9)


@pytest.mark.parametrize("smooth", [None, 0.4])
@pytest.mark.parametrize("make", [lambda smooth: incline(0.2, smooth), wire])
def test_the_jacobian_of_the_residual_is_its_derivative(make, smooth):
    system = make(smooth).derive().closed
    n, rows = system.nq + 2 * system.nv + system.m, system.nv + system.m
    random = np.random.default_rng(3)
    y, p = random.uniform(0.2, 1.0, n), system.parameter_values()
    p[system.n_settable :] = random.uniform(0.3, 0.8, len(p) - system.n_settable)
    jacobian = system.kernel("residual_jacobian")(0.0, y, p).reshape(rows, n)
    residual, h = system.kernel("residual"), 1e-6
    moved = [(residual(0.0, y + h * e, p) - residual(0.0, y - h * e, p)) / (2.0 * h) for e in np.eye(n)]
    np.testing.assert_allclose(jacobian, np.transpose(moved), atol=1e-8)


@pytest.fixture(scope="module")
def rod():
    """A rod of 2 m and 1 kg with its tip on the floor: 1/3 kg m² about its centre."""
    m = Model("rod", gravity=(0, -G))
    x, y, a = (
        m.coordinate("x", start=0.0, rate=1.0),
        m.coordinate("y", start=0.5),
        m.coordinate("a", start=0.5),
    )
    m.body("rod", mass=1.0, inertia=1.0 / 3.0, com=(x, y), angle=a)
    m.stop("floor", y - sin(a), m.parameter("e", 0.0))
    m.friction("tip", speed=dot(x) + sin(a) * dot(a), coefficient=m.parameter("mu", 0.5), normal="floor")
    return m.derive()


@pytest.mark.parametrize(
    ("mu", "speed", "has_motion"), [(1.3, -1.0, True), (1.6, -1.0, False), (1.6, 1.0, True)]
)
def test_painleves_paradox_ends_a_run_with_its_reason(rod, mu, speed, has_motion):
    angle = 1.0
    # The normal force is divided by 1 + 3 cos² a - 3 μ sin a cos a while the tip slides towards the rod.
    assert (
        1.0 + 3.0 * np.cos(angle) ** 2 + 3.0 * np.sign(speed) * mu * np.sin(angle) * np.cos(angle) > 0.0
    ) == has_motion
    solution = rod.run(
        t_end=0.01,
        method="dop853",
        parameters={"mu": mu},
        start={"a": angle, "y": np.sin(angle)},
        rate={"x": speed},
    )
    if has_motion:
        assert solution.ok
    else:
        assert solution.status == "failed" and "Painlevé" in solution.message and "tip" in solution.message


@pytest.mark.parametrize(("method", "on_stop"), [("dop853", True), ("dop853", False), ("taylor", True)])
def test_a_motion_that_comes_to_the_paradox_ends_there(method, on_stop):
    """The normal force is m g / (1 - 0.8 μ), as friction has a share of 0.8 along the normal; μ = t."""
    m = Model("jamming", gravity=(0, -G))
    x, y = m.coordinate("x", rate=0.0), m.coordinate("y", start=0.0)
    m.body("b", mass=1.0, com=(x, y))
    if on_stop:
        m.stop("floor", y)
    else:
        m.constraint("floor", y)
    m.friction("rub", speed=dot(x) + 0.8 * dot(y) + 1000.0, coefficient="t", normal="floor")
    solution = m.derive().run(t_end=2.0, method=method)
    assert solution.status == "failed" and "Painlevé" in solution.message and "rub" in solution.message
    assert solution.t[-1] == pytest.approx(1.25, abs=1e-6)
    early = solution.t < 1.0
    forces = solution.contact_forces[early, 1] if on_stop else solution.contact_forces[early, 0]
    times = solution.t[early]
    np.testing.assert_allclose(forces, -times * G / (1.0 - 0.8 * times), rtol=1e-9, atol=1e-12)


def test_forces_that_are_not_unique_give_no_friction():
    m = Model("twice", gravity=(0, -G))
    x, y = m.coordinate("x", rate=1.0), m.coordinate("y", start=0.0)
    m.body("b", mass=1.0, com=(x, y))
    m.constraint("one", y)
    m.constraint("two", 2 * y)
    m.friction("rub", coordinate=x, coefficient=0.1, normal="one")
    solution = m.derive().run(t_end=1.0, method="dop853")
    assert solution.status == "failed" and "not unique" in solution.message


@pytest.mark.parametrize("pull", [0.2, 0.4])
def test_friction_that_begins_from_nothing_takes_the_side_of_a_moment_later(pull):
    m = Model("begins")
    x, y = m.coordinate("x", start=0.0, rate=0.0), m.coordinate("y", start=0.0, rate=0.0)
    m.body("block", mass=1.0, com=(x, y))
    m.force(y, "-2*t")
    m.force(x, f"{pull}*2*t")
    m.stop("floor", y)
    m.friction("ground", coordinate=x, coefficient=0.3, normal="floor")
    solution = m.derive().run(t_end=2.0, method="dop853")
    assert solution.ok and not solution.events
    assert solution["x"][-1] == pytest.approx(max(pull - 0.3, 0.0) * 8.0 / 3.0, rel=1e-9, abs=1e-14)
    assert solution["force(ground)"][-1] == pytest.approx(-min(pull, 0.3) * 4.0, rel=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_an_impact_with_friction_never_adds_energy(rod, seed):
    random = np.random.default_rng(seed)
    angle, rates = random.uniform(0.1, 1.5), 2.0 * random.normal(size=3)
    before = 0.5 * (rates[0] ** 2 + rates[1] ** 2) + rates[2] ** 2 / 6.0
    solution = rod.run(
        t_end=1e-6,
        method="dop853",
        parameters={"mu": random.uniform(0.0, 1.5), "e": random.uniform(0.3, 1.0)},
        start={"a": angle, "y": np.sin(angle)},
        rate=dict(zip("xya", rates)),
    )
    after = solution.v[0]
    assert 0.5 * (after[0] ** 2 + after[1] ** 2) + after[2] ** 2 / 6.0 <= before * (1.0 + 1e-10)
    assert after[1] - np.cos(angle) * after[2] >= -1e-12


def test_a_file_round_trips():
    text = """
name = "block"
[coordinates]
x = { unit = "m", start = 0.0 }
y = { unit = "m", start = 0.0 }
[bodies.block]
mass = "2 kg"
com = ["x", "y"]
[stops.floor]
gap = "y"
[friction.ground]
coordinate = "x"
coefficient = 0.3
static = 0.4
normal = "floor"
[friction.guide]
speed = "dot(x) + dot(y)"
coefficient = "0.1"
normal = ["one", "other"]
smooth = "0.01"
[constraints]
one = "x - y"
other = "x + 2*y"
"""
    model = Model.from_toml(text)
    again = Model.from_toml(model.to_toml())
    assert again.to_toml() == model.to_toml()
    assert [f.normal for f in again.describe().frictions] == [("floor",), ("one", "other")]
    assert again.derive().switches[1:] == model.derive().switches[1:]
    assert again.derive().switches[2] == {
        "name": "guide", "kind": "friction", "normal": ["one", "other"], "smooth": True,
    }  # fmt: skip


@pytest.mark.parametrize("smooth", [None, 0.1])
def test_methods_that_know_reactions_as_impulses_alone_are_refused(smooth):
    with pytest.raises(RuntimeModelError, match=r"proportion to reactions \(rub\).*use implicit_midpoint"):
        wire(smooth).derive().run(t_end=1.0, method="rattle", step=0.01)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"coefficient": 0.3}, "'normal' is missing"),
        ({"force": 1.0, "normal": "floor"}, "'coefficient' is missing"),
        ({"coefficient": -0.3, "normal": "floor"}, "negative"),
        ({"coefficient": 0.3, "normal": "flor"}, "no stop and no constraint named 'flor'"),
        ({"coefficient": 0.3, "normal": ["floor", "guide"]}, "one stop"),
        ({"coefficient": 0.3, "normal": "floor", "smooth": 1e-3, "static": 0.4}, "never sticks"),
        ({"coefficient": 0.3, "normal": "floor", "smooth": -1e-3}, "not positive"),
        ({"coefficient": 0.3, "force": 1.0, "normal": "floor"}, "one 'force' or 'torque'"),
    ],
)
def test_what_does_not_fit_is_refused(options, says):
    m = Model("block")
    x, y = m.coordinate("x", start=0.0), m.coordinate("y", start=0.0)
    m.body("block", mass=2.0, com=(x, y))
    m.constraint("guide", x - y)
    m.stop("floor", y)
    with pytest.raises(ModelError, match=says):
        m.friction("ground", coordinate=x, **options)
        m.derive()
