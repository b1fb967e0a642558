"""Friction in a plane, Coulomb's circle: against formulas, and phases that SciPy integrates in polar coordinates."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from recorded import assert_same_recording, record
from scipy.integrate import solve_ivp
from stress import plates, sliding
from stress.plate_phases import Plate, course

from symgen import Model, cos, dot, sin
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.runtime import load, solve
from symgen.runtime.contact.sharing import evened
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.recording.resume import Resumed

G = 9.81


def block(kind="given", mu=0.3, mu_s=0.4, **options):
    """A block of 2 kg in the frame of a plate that shakes along x and y."""
    m = Model(f"block_{kind}")
    x, y = m.coordinate("x", start=0.0), m.coordinate("y", start=0.0)
    m.parameters(mu=mu, mu_s=mu_s)
    m.force(x, "2*4*sin(5*t)")
    m.force(y, "2*3*cos(7*t)")
    if kind == "given":
        m.body("block", mass=2.0, com=(x, y))
        m.friction("sole", coordinates=(x, y), force=f"mu*2*{G}", static=f"mu_s*2*{G}", **options)
        return m
    z = m.coordinate("z", start=0.0)
    m.body("block", mass=2.0, com=(x, y, z))
    m.gravity(z=-G)
    if kind == "stop":
        m.stop("plate", z, m.parameter("e", 0.0))
    else:
        m.constraint("plate", z)
    m.friction("sole", speeds=(dot(x), dot(y)), coefficient="mu", static="mu_s", normal="plate", **options)
    return m


@pytest.fixture(scope="module")
def systems():
    return {kind: block(kind).derive() for kind in ("given", "stop", "constraint")}


@pytest.fixture(scope="module")
def phases():
    def pull(t):
        return np.array([4.0 * np.sin(5.0 * t), 3.0 * np.cos(7.0 * t)])

    return {mu_s: course(Plate(pull, lambda t: G, 0.3, mu_s), 3.0) for mu_s in (0.3, 0.4)}


METHODS = {
    "auto": 1e-6, "dop853": 1e-6, "dopri5": 1e-6, "bs32": 1e-5, "taylor": 1e-6, "radau5": 1e-6, "radau9": 1e-6,
    "radau13": 1e-6, "bdf": 1e-5, "rk4": 3e-3, "implicit_midpoint": 3e-3, "gauss4": 3e-3,
}  # fmt: skip


@pytest.mark.parametrize("mu_s", [0.3, pytest.param(0.4, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["given", "stop", "constraint"])
@pytest.mark.parametrize("method", METHODS)
def test_a_block_on_a_shaking_plate_slips_and_sticks_as_its_phases_say(systems, phases, method, kind, mu_s):
    fixed = METHODS[method] > 1e-4
    run = systems[kind].run(
        t_end=3.0, method=method, parameters={"mu_s": mu_s}, step=1e-3 if fixed else None, max_steps=100_000
    )
    assert run.status == "success", run.message
    if not fixed:
        assert run.ok, [check.says for check in run.objections]
    expected, off = phases[mu_s], METHODS[method]
    events = [(event.action, event.t) for event in run.events if event.t > 1e-9]
    assert [what for what, _ in events] == [what for what, _ in expected.events]
    np.testing.assert_allclose([t for _, t in events], [t for _, t in expected.events], atol=off)
    np.testing.assert_allclose(run.q[-1, :2], expected.place, atol=0.1 * off)
    np.testing.assert_allclose(run.v[-1, :2], expected.velocity, atol=off)


@pytest.mark.parametrize("kind", ["given", "stop"])
def test_it_slips_however_slowly_the_load_comes(kind):
    """Forces that change in days bring it to its limit as those that change in seconds do: with a mass in proportion.

    At rest nothing tells how fast they change but the step; it was taken to stick on, far beyond its limit.
    """
    m = Model(f"slow_{kind}")
    unit = m.parameter("T", 1.0)
    x, y = m.coordinate("x", start=0.0), m.coordinate("y", start=0.0)
    m.force(x, "5*sin(t/T)")
    if kind == "stop":
        z = m.coordinate("z", start=0.0)
        m.force(z, "-10")
        m.stop("plate", z)
        m.friction("sole", coordinates=(x, y), coefficient=0.3, static=0.4, normal="plate")
    else:
        m.friction("sole", coordinates=(x, y), force="3", static="4")
    m.body("block", mass=unit**2, com=(x, y, z if kind == "stop" else 0))
    system = m.derive()
    began = np.arcsin(0.8)  # from there on x'' = 5 sin t - 3
    end = 5.0 * (0.8 - np.sin(2.0) + 0.6 * (2.0 - began)) - 1.5 * (2.0 - began) ** 2
    for slow in (1.0, 1e5):
        run = system.run(
            t_end=2.0 * slow, method="dop853", rtol=1e-9, atol=1e-12 / slow, parameters={"T": slow}
        )
        assert run.ok, [check.says for check in run.objections]
        assert run["x"][-1] == pytest.approx(end, rel=1e-7)


def test_the_forces_lie_on_the_circle_while_it_slides_and_within_while_it_sticks(systems):
    run = systems["stop"].run(t_end=3.0)
    forces = np.hypot(run["force(sole_1)"], run["force(sole_2)"])
    speed = np.hypot(run["dot(x)"], run["dot(y)"])
    off = np.abs(forces / (0.3 * 2.0 * G) - 1.0)[speed > 1e-3]
    # Where sliding begins it is aimed for an angle φ = (6 rtol)^(1/3), and a force φ F across holds it there: together
    # they are longer than F by φ²/2. That is over within a frame of each of the two slips: then it is on the circle.
    slips = sum(event.action == "slip" for event in run.events)
    assert off.max() <= 0.5 * (6.0 * run.rtol) ** (2.0 / 3.0) < 1e-5
    assert (off > 1e-12).sum() <= slips == 2
    sticks = speed < 1e-12
    needed = 2.0 * np.hypot(4.0 * np.sin(5.0 * run.t), 3.0 * np.cos(7.0 * run.t))
    assert 10 < sticks.sum() < len(sticks)
    np.testing.assert_allclose(forces[sticks], needed[sticks], rtol=1e-9)
    assert forces.max() <= 0.4 * 2.0 * G * (1.0 + 1e-9)
    # What it does against the speed is its work.
    along = run["force(sole_1)"] * run["dot(x)"] + run["force(sole_2)"] * run["dot(y)"]
    assert along.max() < 1e-12 and run.energy.max_error < 1e-6


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5", "rk4", "implicit_midpoint", "verlet"])
def test_what_is_thrown_slides_straight_and_stays(method):
    m = Model("thrown")
    x, y = m.coordinate("x", start=0.0, rate=1.2), m.coordinate("y", start=0.0, rate=-0.5)
    m.body("puck", mass=0.3, com=(x, y))
    m.friction("ice", coordinates=("x", "y"), force=0.3 * 0.1 * G)
    fixed = method in ("rk4", "implicit_midpoint", "verlet")
    run = m.derive().run(t_end=2.0, method=method, step=0.01 if fixed else None)
    assert run.status == "success"
    assert [event.action for event in run.events] == ["stick"]
    assert run.events[0].t == pytest.approx(1.3 / (0.1 * G), rel=2e-8)
    way = 1.3**2 / (2.0 * 0.1 * G)
    np.testing.assert_allclose(run.q[-1], way * np.array([1.2, -0.5]) / 1.3, rtol=1e-7)


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
def test_across_an_incline_as_steep_as_the_friction_half_the_speed_is_left(method):
    """With μ = tan a, the speed and its part down the slope change against each other: v (1 + cos φ) stays."""
    angle = 0.3
    m = Model("incline", gravity=(0, -G * np.sin(angle), -G * np.cos(angle)))
    x, y, z = (
        m.coordinate("x", start=0.0, rate=2.0),
        m.coordinate("y", start=0.0),
        m.coordinate("z", start=0.0),
    )
    m.body("block", mass=1.5, com=(x, y, z))
    m.stop("slope", z)
    m.friction("sole", coordinates=(x, y), coefficient=np.tan(angle), normal="slope")
    run = m.derive().run(t_end=8.0, method=method)
    assert run.ok and not run.events
    speed = np.hypot(run["dot(x)"], run["dot(y)"])
    np.testing.assert_allclose(speed - run["dot(y)"], 2.0, rtol=1e-6)
    assert -run["dot(y)"][-1] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(("mu", "e"), [(0.3, 0.0), (0.3, 0.5), (2.0, 0.5)])
def test_the_impulse_in_an_impact_lies_in_the_circle(systems, mu, e):
    run = systems["stop"].run(
        t_end=0.5, parameters={"mu": mu, "mu_s": mu, "e": e}, start={"z": 1.0}, rate={"x": 3.0, "y": -4.0},
        method="dop853",
    )  # fmt: skip
    first, down = run.events[0], np.sqrt(2.0 * G)
    assert first.action == "impact"
    before = first.v_before
    speed = np.hypot(*before[:2])
    left = max(speed - mu * (1.0 + e) * down, 0.0)
    np.testing.assert_allclose(first.v_after, [*(before[:2] / speed * left), e * down], rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize(
    ("method", "kind", "number"), [("generalized_alpha", "given", 1), ("hht", "stop", 4)]
)
def test_methods_whose_accelerations_lag_come_to_rest(method, kind, number):
    """Where a direction turned in a few steps, Newton's method found no end of one."""
    assert plates.judge(plates.draw(1, number), kind, method) == ("right", "")


def test_where_a_direction_turns_too_fast_the_run_says_so():
    model = sliding.particle(np.random.default_rng([48, 20261129])).derive()
    run = model.run(t_end=0.6, method="taylor", rtol=1e-10, atol=1e-12)
    assert run.status == "failed" and "change point" not in run.message
    assert "friction in two directions (rub) is almost at rest" in run.message and "use dop853" in run.message


def test_a_box_on_four_feet_slides_from_rest_and_comes_to_rest():
    """Down an incline that is steeper than its friction for a time; four feet share what three would bear."""
    m = Model("feet")
    x, y, z = (m.coordinate(name, start=0.0) for name in "xyz")
    a, b = m.coordinate("a", start=0.0), m.coordinate("b", start=0.0)
    m.body("box", mass=2.0, inertia=[0.02, 0.03, 0.04], com=(x, y, z + 0.05), rotation=[["x", a], ["y", b]])
    m.force(z, -2.0 * G)
    m.force(x, "6*sin(t)*1.2")
    m.force(y, "6*sin(t)*0.5")
    for k, (px, py) in enumerate([(0.1, 0.15), (-0.1, 0.15), (-0.1, -0.15), (0.1, -0.15)]):
        height = z + 0.05 - 0.05 * cos(a) * cos(b) + py * sin(a) - px * sin(b) * cos(a)
        m.stop(f"foot{k}", height)
        m.friction(f"rub{k}", speeds=(dot(x), dot(y)), coefficient=0.3, normal=f"foot{k}")
    run = m.derive().run(t_end=3.0, method="dop853")
    assert run.ok, [check.says for check in run.objections]
    slips = np.arcsin(0.3 * 2.0 * G / (6.0 * 1.3))
    assert run.events[0].action == "slip" and run.events[0].t == pytest.approx(slips, rel=1e-7)

    def along(t, state):
        return [state[1], (7.8 * np.sin(t) - 0.3 * 2.0 * G) / 2.0]

    exact = solve_ivp(along, (slips, 3.0), [0.0, 0.0], rtol=1e-11, atol=1e-13)
    assert exact.y[1].min() > -1e-9
    np.testing.assert_allclose(run.q[-1, :2], exact.y[0, -1] * np.array([12.0, 5.0]) / 13.0, rtol=1e-6)


FEET = [(0.4, 0.3), (-0.4, 0.3), (-0.4, -0.3), (0.4, -0.3)]


def legs(power, **law):
    m = Model("legs")
    x, y, a = (m.coordinate(name, start=start) for name, start in (("x", 0.0), ("y", 0.0), ("a", 0.1)))
    m.body("table", mass=4.0, inertia=0.5, com=(x, y), angle=a)
    m.force(x, f"{14 * power}*sin(2*t)")
    m.force(y, f"{6 * power}*cos(3*t)")
    m.force(a, f"{2 * power}*sin(t)")
    for k, (px, py) in enumerate(FEET):
        speeds = dot(x + px * cos(a) - py * sin(a)), dot(y + px * sin(a) + py * cos(a))
        m.friction(f"leg{k}", speeds=speeds, force=0.3 * G, **law)
    return m


def legs_by_scipy(share, start, t_end, **options):
    """Friction of each leg against its velocity u: `share(u)` of the whole."""

    def motion(t, state):
        _, _, a, vx, vy, w = state
        force, torque = np.array([14.0 * np.sin(2.0 * t), 6.0 * np.cos(3.0 * t)]), 2.0 * np.sin(t)
        for px, py in FEET:
            rx, ry = px * np.cos(a) - py * np.sin(a), px * np.sin(a) + py * np.cos(a)
            u = np.array([vx - w * ry, vy + w * rx])
            rub = -0.3 * G * share(u)
            force, torque = force + rub, torque + rx * rub[1] - ry * rub[0]
        return [vx, vy, w, force[0] / 4.0, force[1] / 4.0, torque / 0.5]

    return solve_ivp(motion, (0.0, t_end), start, "Radau", rtol=1e-9, atol=1e-11, **options).y[:, -1]


def smooth(u, width=0.05):
    return u / np.sqrt(u @ u + width**2)


def creep(u, width=0.05):
    size = np.hypot(*u)
    return (1.0 - (1.0 - min(size / width, 1.0)) ** 3) * u / max(size, 1e-300)


def test_legs_that_slide_and_turn_move_as_one_body():
    start = {"x": 1.0, "y": 0.4, "a": 2.0}
    run = legs(1.0).derive().run(t_end=0.8, rate=start)
    assert run.ok
    exact = legs_by_scipy(lambda u: smooth(u, 1e-7), [0.0, 0.0, 0.1, 1.0, 0.4, 2.0], 0.8)
    np.testing.assert_allclose([*run.q[-1], *run.v[-1]], exact, rtol=1e-5, atol=1e-6)


def test_legs_that_do_not_give_way_stay():
    held = legs(0.2).derive().run(t_end=4.0)
    assert held.ok and not any(check.note for check in held.health), [check.says for check in held.health]
    assert held.energy.max_error < 1e-9
    assert np.abs(held.q - [0.0, 0.0, 0.1]).max() < 1e-12


@pytest.mark.parametrize("law", [smooth, creep])
def test_legs_that_give_way_turn_about_any_point_in_every_method(law):
    exact = legs_by_scipy(law, [0.0, 0.0, 0.1, 0.0, 0.0, 0.0], 4.0, max_step=0.02)
    system = legs(1.0, **{law.__name__: 0.05}).derive()
    for method in ("taylor", "dop853", "radau5", "bdf", "gauss8", "rk4"):
        step = 2e-3 if method in ("gauss8", "rk4") else None
        if method == "taylor" and law is creep:  # the law has a corner
            with pytest.raises(RuntimeModelError, match=r"'taylor' does not fit.*use dop853, or radau5"):
                system.run(t_end=4.0, method=method)
            continue
        run = system.run(t_end=4.0, method=method, step=step)
        assert run.ok, [check.says for check in run.objections]
        np.testing.assert_allclose([*run.q[-1], *run.v[-1]], exact, atol=5e-8)


@pytest.mark.parametrize("kind", ["given", "stop"])
@pytest.mark.parametrize("form", ["open", "closed"])
def test_the_jacobian_of_the_residual_is_its_derivative(systems, kind, form):
    system = systems[kind] if form == "open" else systems[kind].closed
    n, rows = system.nq + 2 * system.nv + system.m, system.nv + system.m
    random = np.random.default_rng(3)
    y, p = random.uniform(0.2, 1.0, n), system.parameter_values()
    p[system.n_settable :] = random.uniform(0.3, 0.8, len(p) - system.n_settable)
    jacobian = system.kernel("residual_jacobian")(0.0, y, p).reshape(rows, n)
    residual, h = system.kernel("residual"), 1e-6
    moved = [(residual(0.0, y + h * e, p) - residual(0.0, y - h * e, p)) / (2.0 * h) for e in np.eye(n)]
    np.testing.assert_allclose(jacobian, np.transpose(moved), atol=1e-7)


@pytest.mark.parametrize("kind", ["given", "stop"])
@pytest.mark.parametrize("part", [0.3, 0.8])
def test_a_run_that_is_taken_up_again_is_the_run_that_was_not_cut(tmp_path, kind, part):
    text = derive_text(block(kind)).text
    whole, first, rest = (tmp_path / f"{name}.rrd" for name in ("whole", "first", "rest"))
    a = record(whole, text, lambda **more: solve(load(text), 3.0, method="dop853", **more))
    few = int(part * a.stats["steps"])
    record(first, text, lambda **more: solve(load(text), 3.0, method="dop853", max_steps=few, **more))
    c = record(rest, text, Resumed(first).run)
    assert_same_recording(whole, rest)
    assert c.stats == a.stats and len(c.events) == len(a.events)


def test_what_is_asked_for_changes_nothing(systems):
    plain = systems["stop"].run(t_end=3.0, method="dop853")
    looked = systems["stop"].run(t_end=3.0, method="dop853", at=[0.1, 0.7282, 0.9, 1.111])
    np.testing.assert_array_equal(plain.q[-1], looked.q[-1])
    assert plain.stats["steps"] == looked.stats["steps"]


def test_its_reaction_is_the_magnitude_of_both_forces():
    m = block("stop")
    m.output("rub", 'reaction("sole")')
    run = m.derive().run(t_end=1.0)
    np.testing.assert_allclose(run["rub"], np.hypot(run["force(sole_1)"], run["force(sole_2)"]), rtol=1e-12)


@pytest.mark.parametrize("normal", [False, True])
@pytest.mark.parametrize("method", ["radau5", "dop853"])
def test_creep_begins_in_proportion_and_ends_on_the_circle(normal, method):
    """A roller that is pulled: with Kalker's slope at first, and the whole friction from `creep` on."""
    m = Model("creep")
    x, y = m.coordinate("x", start=0.0), m.coordinate("y", start=0.0, rate=0.01)
    m.force(x, "0.8*t")
    law = {"coefficient": 0.25, "normal": "rail"} if normal else {"force": 0.25 * G}
    if normal:
        z = m.coordinate("z", start=0.0)
        m.body("wheel", mass=1.0, com=(x, y, z))
        m.force(z, -G)
        m.stop("rail", z)
    else:
        m.body("wheel", mass=1.0, com=(x, y))
    m.friction("contact", coordinates=(x, y), creep=0.05, **law)
    run = m.derive().run(t_end=4.0, method=method)
    assert run.ok, [check.says for check in run.objections]

    def motion(t, state):
        v = state[2:]
        s = np.hypot(*v)
        size = 0.25 * G * (1.0 - (1.0 - min(s / 0.05, 1.0)) ** 3)
        return [*v, *(np.array([0.8 * t, 0.0]) - size * v / max(s, 1e-300))]

    exact = solve_ivp(
        motion, (0.0, 4.0), [0.0, 0.0, 0.0, 0.01], "Radau", rtol=1e-9, atol=1e-12, max_step=0.01
    )
    np.testing.assert_allclose(run.q[-1, :2], exact.y[:2, -1], rtol=1e-5, atol=1e-7)
    slow = int(np.searchsorted(run.t, 0.5))
    assert run["dot(x)"][slow] == pytest.approx(0.8 * run.t[slow] * 0.05 / (3 * 0.25 * G), rel=0.15)


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_smooth_friction_in_a_plane(method):
    m = Model("smooth")
    x, y = m.coordinate("x", start=0.0, rate=1.0), m.coordinate("y", start=0.0, rate=1.0)
    m.body("b", mass=1.0, com=(x, y))
    m.friction("f", coordinates=(x, y), force=2.0, smooth=0.1)
    m.force(x, 1.0)
    run = m.derive().run(t_end=4.0, method=method)
    assert run.ok

    def motion(t, s):
        width = np.sqrt(s[2] ** 2 + s[3] ** 2 + 0.01)
        return [s[2], s[3], 1.0 - 2.0 * s[2] / width, -2.0 * s[3] / width]

    exact = solve_ivp(motion, (0.0, 4.0), [0.0, 0.0, 1.0, 1.0], rtol=1e-10, atol=1e-12).y[:, -1]
    np.testing.assert_allclose([*run.q[-1], *run.v[-1]], exact, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("smooth", [None, 0.05])
@pytest.mark.parametrize("by", ["stop", "constraint"])
@pytest.mark.parametrize("method", ["taylor", "dop853", "radau5"])
def test_a_mass_in_a_bowl_under_a_changing_load_slides_as_its_equations_say(method, by, smooth):
    """Series took its direction for the one in which it had begun to slide."""
    m = Model("bowl", gravity=(0, 0, "-9.81 m/s^2"))
    x, y = m.coordinate("x", rate=2.0), m.coordinate("y", start=0.3, rate=1.0)
    z = m.coordinate("z", start=0.0)
    m.body("mass", mass=2.0, com=(x, y, z))
    m.potential(3 * x**2 + 5 * y**2)
    m.force(z, -(4 + 8 * x**2 + 3 * sin(2 * y)))
    getattr(m, by)("floor", z)
    given = {} if smooth is None else {"smooth": smooth}
    m.friction("rub", speeds=[dot(x), dot(y)], coefficient=0.1, normal="floor", **given)
    run = m.derive().run(t_end=0.6, method=method, rtol=1e-10)

    def slides(_, state):
        x, y, *v = state
        rub = 0.1 * (2 * 9.81 + 4 + 8 * x**2 + 3 * np.sin(2 * y)) / np.hypot(np.hypot(*v), smooth or 0.0)
        return [*v, (-6 * x - rub * v[0]) / 2, (-10 * y - rub * v[1]) / 2]

    known = solve_ivp(slides, (0, 0.6), [0, 0.3, 2, 1], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose([*run.q[-1, :2], *run.v[-1, :2]], known, rtol=0, atol=3e-8)
    assert run.ok and not run.objections and run.stats["rejected"] <= 10


@pytest.mark.parametrize("law", ["smooth", "creep"])
@pytest.mark.parametrize("in_a_plane", [False, True])
@pytest.mark.parametrize("method", ["taylor", "dop853", "radau5"])
def test_soft_friction_may_fall_with_the_speed(law, in_a_plane, method):
    if (law, method) == ("creep", "taylor"):
        pytest.skip("a law that ends at a speed has no series")
    m = Model("stribeck")
    x, y = m.coordinate("x", rate=2.0), m.coordinate("y", start=0.3, rate=1.0)
    m.body("mass", mass=2.0, com=(x, y))
    m.potential(3 * x**2 + 5 * y**2)
    squares = dot(x) ** 2 + (dot(y) ** 2 if in_a_plane else 0)
    m.definition("fast", squares)
    rubs = {"speeds": [dot(x), dot(y)]} if in_a_plane else {"speed": dot(x)}
    m.friction("rub", **rubs, force="2*(1 + 0.6*exp(-fast)) + 0.4*sqrt(fast + 0.01)", **{law: 0.05})
    run = m.derive().run(t_end=2.0, method=method, rtol=1e-10)

    def motion(_, state):
        x, y, u, v = state
        fast = u * u + in_a_plane * v * v
        part = min(np.sqrt(fast) / 0.05, 1.0)
        share = {
            "smooth": 1 / np.sqrt(fast + 0.05**2),
            "creep": (3 - 3 * part + part**2) / max(np.sqrt(fast), 0.05),
        }
        force = (2 * (1 + 0.6 * np.exp(-fast)) + 0.4 * np.sqrt(fast + 0.01)) * share[law]
        return [u, v, (-6 * x - force * u) / 2, (-10 * y - in_a_plane * force * v) / 2]

    known = solve_ivp(motion, (0, 2), [0, 0.3, 2, 1], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose([*run.q[-1], *run.v[-1]], known, rtol=0, atol=3e-8)
    assert run.ok and not run.objections


def test_a_file_round_trips():
    text = """
name = "block"
[coordinates]
x = { unit = "m", start = 0.0 }
y = { unit = "m", start = 0.0 }
z = { unit = "m", start = 0.0 }
[bodies.block]
mass = "2 kg"
com = ["x", "y", "z"]
[stops.floor]
gap = "z"
[friction.sole]
coordinates = ["x", "y"]
coefficient = 0.3
static = 0.4
normal = "floor"
[friction.belt]
speeds = ["dot(x) - 0.1", "dot(y)"]
force = "1 N"
creep = "0.01 m/s"
"""
    model = Model.from_toml(text)
    again = Model.from_toml(model.to_toml())
    assert again.to_toml() == model.to_toml()
    assert again.derive().switches == model.derive().switches
    assert [s["name"] for s in again.derive().switches] == ["floor", "sole_1", "sole_2"]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"coordinates": ("x",)}, "two 'coordinates'"),
        ({"coordinates": ("x", "y"), "coordinate": "x"}, "one 'coordinate'.*give one of these"),
        ({"speeds": ("dot(x)", "x")}, "no rate"),
        ({"coordinates": ("x", "y"), "smooth": "1 m/s", "creep": "1 m/s"}, "not by both"),
        ({"coordinates": ("x", "y"), "creep": "-1 m/s"}, "not positive"),
        ({"coordinates": ("x", "y"), "creep": "1 m/s", "static": "3 N"}, "never sticks"),
        ({"coordinates": ("x", "2*y")}, "coordinate's name"),
        ({"coordinates": ("x", "a")}, r"'ground'.* speeds: units do not match.*radius"),
        ({"speeds": ("dot(x)", "dot(a)")}, r"units do not match.*m/s.*1/s"),
        ({"speeds": ("dot(a)*0.1 + dot(a)", "dot(x)/1")}, r"units do not match"),
    ],
)
def test_what_does_not_fit_is_refused(options, says):
    m = Model("block")
    x, y, a = m.coordinate("x", unit="m"), m.coordinate("y", unit="m"), m.coordinate("a", unit="rad")
    m.body("block", mass="2 kg", inertia="1 kg*m^2", com=(x, y), angle=a)
    with pytest.raises(ModelError, match=says):
        m.friction("ground", force="2 N", **options)
        m.derive()


def test_the_names_of_both_forces_must_be_free():
    m = block("given")
    m.friction("sole_1", coordinate="x", force="1 N")
    with pytest.raises(ModelError, match="'sole_1' is taken"):
        m.derive()


@pytest.mark.parametrize("least", [1e-3, 1e-8, 1e-12, 1e-16, 1e-20])
def test_a_foot_that_bears_next_to_nothing_ends_no_search(least):
    """Two frictions hold one motion; where what the second can take is round-off, the search had begun outside."""
    here = SimpleNamespace(compliance=np.ones((2, 2)))
    levels = SimpleNamespace(fixed=np.zeros(2), linear=lambda *_: (np.array([1.0, least]), np.zeros((2, 2))))
    forces, left = evened(here, levels, np.full(2, 0.4), np.ones(2, dtype=bool), np.zeros((0, 2), dtype=int))
    if least >= 1e-8:
        np.testing.assert_allclose(forces, [0.8, 0.0], atol=max(1e-6, least))
        assert left == pytest.approx(0.2, abs=1e-3)
    else:  # of parts of nothing it knows only that this one is beyond its limit
        assert forces.sum() == pytest.approx(0.8) and left < 0.0
