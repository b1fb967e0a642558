"""Runs through configurations where constraints lose rank, starts in them, and stops where nothing leads on."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from symgen import Model, cos, dot, sin, t
from symgen.link import derive
from symgen.model.library import find, load
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.constraints.kkt import is_ill_conditioned, lease_guard
from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.errors import RuntimeModelError

STARTS = 40


@functools.cache
def equal_slider_crank():
    """Crank and rod of one length: φ = -θ, x = 2 r cos θ, or the rod folded onto the crank, with x = 0."""
    m = Model("equal_slider_crank")
    theta = m.coordinate("theta", unit="rad", start=0.5, rate=8.0)
    phi = m.coordinate("phi", unit="rad", guess=-0.5)
    x = m.coordinate("x", unit="m", guess=0.5)
    r, M, J = m.parameters(r="0.3 m", M="1 kg", J="7.5e-3 kg*m^2")
    pin = (r * cos(theta), r * sin(theta))
    m.body("crank", mass=M, inertia=J, com=(pin[0] / 2, pin[1] / 2), angle=theta)
    m.body("rod", mass=M, inertia=J, com=(pin[0] + r / 2 * cos(phi), pin[1] + r / 2 * sin(phi)), angle=phi)
    m.body("piston", mass=M, com=(x, 0))
    m.constraint("closes_x", pin[0] + r * cos(phi) - x)
    m.constraint("closes_y", pin[1] + r * sin(phi))
    return m.derive()


@functools.cache
def parallelogram():
    """Two equal cranks and a bar as long as the ground: the bar keeps b = 0, or the cranks turn against each other."""
    m = Model("parallelogram")
    a = m.coordinate("a", unit="rad", start=1.0, rate=8.0)
    b = m.coordinate("b", unit="rad")
    c = m.coordinate("c", unit="rad", guess=1.0)
    r, l, M, J = m.parameters(r="0.2 m", l="0.5 m", M="1 kg", J="4e-3 kg*m^2")
    m.body("left", mass=M, inertia=J, com=(r / 2 * cos(a), r / 2 * sin(a)), angle=a)
    m.body(
        "bar", mass=M, inertia=10 * J, com=(r * cos(a) + l / 2 * cos(b), r * sin(a) + l / 2 * sin(b)), angle=b
    )
    m.body("right", mass=M, inertia=J, com=(l + r / 2 * cos(c), r / 2 * sin(c)), angle=c)
    m.constraint("closes_x", r * cos(a) + l * cos(b) - r * cos(c) - l)
    m.constraint("closes_y", r * sin(a) + l * sin(b) - r * sin(c))
    return m.derive()


def random_starts():
    random = np.random.default_rng(5)
    for _ in range(STARTS):
        yield random.uniform(-math.pi, math.pi), random.choice([-1.0, 1.0]) * random.uniform(3.0, 12.0)


def crank_angle(theta0: float, omega0: float, times: np.ndarray) -> np.ndarray:
    """The crank's motion from its energy: the time that each angle takes, by quadrature, inverted."""
    r, M, J = 0.3, 1.0, 7.5e-3

    def inertia(theta):
        # T = I(θ) ω² / 2 with the rod's centre at (3/2 r cos θ, r/2 sin θ) and the piston at 2 r cos θ.
        rod = (1.5 * r * np.sin(theta)) ** 2 + (0.5 * r * np.cos(theta)) ** 2
        return M * (r / 2) ** 2 + 2 * J + M * rod + M * (2 * r * np.sin(theta)) ** 2

    # Over whole turns the rule of rectangles is exact to round-off for these analytic functions: a Fourier series.
    n = 256
    grid = 2 * math.pi * np.arange(n) / n
    series = np.fft.rfft(np.sqrt(inertia(grid))) / n
    k = np.arange(1, len(series))

    def integral(theta):
        waves = series[1:] * np.exp(1j * np.outer(theta, k)) / (1j * k)
        return series[0].real * theta + 2 * waves.real.sum(axis=1)

    target = integral(np.array([theta0])) + omega0 * np.sqrt(inertia(theta0)) * times
    theta = target / series[0].real
    for _ in range(60):
        theta -= (integral(theta) - target) / np.sqrt(inertia(theta))
    return theta


@pytest.mark.parametrize("rtol, limit", [(1e-6, 3e-3), (1e-9, 1e-5), (1e-12, 1e-6)])
def test_slider_crank_passes_its_dead_points(rtol, limit):
    for theta, omega in random_starts():
        start, rate = {"theta": theta, "phi": -theta}, {"theta": omega}
        run = equal_slider_crank().run(
            t_end=2.0, method="dop853", rtol=rtol, atol=rtol, start=start, rate=rate, at=[2.0]
        )
        assert run.status == "success", run.message
        np.testing.assert_allclose(run.q[:, 1], -run.q[:, 0], rtol=0, atol=1e-9)
        assert np.abs(run.q[-1, 0] - theta) > math.pi  # through a dead point at least
        assert run.samples[0].q[0] == pytest.approx(crank_angle(theta, omega, np.array([2.0]))[0], abs=limit)


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_parallelogram_passes_its_change_points(rtol):
    """Nothing acts on it, so that it turns evenly as long as it stays a parallelogram."""
    for angle, omega in random_starts():
        start, rate = {"a": angle, "b": 0.0, "c": angle}, {"a": omega}
        run = parallelogram().run(t_end=3.0, method="dop853", rtol=rtol, atol=rtol, start=start, rate=rate)
        assert run.status == "success", run.message
        turned = angle + omega * 3.0
        np.testing.assert_allclose(run.q[-1], [turned, 0.0, turned], rtol=0, atol=max(1e-10, 10 * rtol))


def test_series_leave_change_points_to_a_method_that_steps_across():
    """Where ever shorter steps follow round-off onto the other branch, on which the bar turns; some pass it by."""
    left = 0
    for angle, omega in ((1.0, 8.0), (0.5, -6.0), (0.4, -5.0), (1.2, 8.0), (0.9, -8.0), (1.5, 7.0)):
        start, rate = {"a": angle, "b": 0.0, "c": angle}, {"a": omega}
        run = parallelogram().run(t_end=0.8, rtol=1e-12, atol=1e-14, start=start, rate=rate)
        assert run.status == "success"
        left += any("taylor cannot go on" in note for note in run.notes)
        turned = angle + omega * 0.8
        np.testing.assert_allclose(run.q[-1], [turned, 0.0, turned], rtol=0, atol=1e-10)
    assert left >= 2


@pytest.mark.parametrize("rtol", [1e-8, 1e-10])
def test_the_history_of_bdf_leads_across(rtol):
    """Rates just beside a configuration are as uncertain as the projection leaves them, which no shorter step mends."""
    for angle, omega in random_starts():
        run = parallelogram().run(
            t_end=3.0,
            method="bdf",
            rtol=rtol,
            atol=rtol,
            start={"a": angle, "b": 0.0, "c": angle},
            rate={"a": omega},
        )
        assert run.status == "success", run.message
        turned = angle + omega * 3.0
        np.testing.assert_allclose(run.q[-1], [turned, 0.0, turned], rtol=0, atol=1e4 * rtol)
        start, rate = {"theta": angle, "phi": -angle}, {"theta": omega}
        run = equal_slider_crank().run(t_end=2.0, method="bdf", rtol=rtol, atol=rtol, start=start, rate=rate)
        assert run.status == "success", run.message
        assert run.q[-1, 0] == pytest.approx(crank_angle(angle, omega, np.array([2.0]))[0], abs=1e4 * rtol)


@pytest.mark.parametrize(
    "method, options", [("dopri5", {}), ("radau5", {}), ("rk4", {"step": 2e-3}), ("auto", {})]
)
def test_other_methods_pass_dead_points(method, options):
    for theta, omega in list(random_starts())[:10]:
        start, rate = {"theta": theta, "phi": -theta}, {"theta": omega}
        run = equal_slider_crank().run(t_end=2.0, method=method, start=start, rate=rate, **options)
        assert run.status == "success", run.message
        np.testing.assert_allclose(run.q[:, 1], -run.q[:, 0], rtol=0, atol=1e-8)
        assert run.q[-1, 0] == pytest.approx(crank_angle(theta, omega, np.array([2.0]))[0], abs=1e-3)


def test_start_at_a_dead_point_goes_the_way_the_rates_say():
    start = {"theta": math.pi / 2, "phi": -math.pi / 2, "x": 0.0}
    rate = {"theta": 5.0, "phi": -5.0, "x": -3.0}
    run = equal_slider_crank().run(t_end=0.5, method="dop853", start=start, rate=rate)
    assert run.status == "success", run.message
    assert run.q[-1, 0] == pytest.approx(crank_angle(math.pi / 2, 5.0, np.array([0.5]))[0], abs=1e-6)


def test_start_flat_on_the_ground_line():
    """A row of G is all zeros there, and the straight-line solution not a number."""
    flat = dict.fromkeys("abc", 0.0)
    run = parallelogram().run(t_end=1.0, method="dop853", start=flat, rate={"a": 5.0, "b": 0.0, "c": 5.0})
    assert run.status == "success", run.message
    assert any("singular configuration" in note for note in run.notes)
    np.testing.assert_allclose(run.q[-1], [5.0, 0.0, 5.0], rtol=0, atol=1e-8)


def test_steps_grow_again_after_change_points():
    """One iteration of Newton's says nothing of its rate: what was slow there must not hold steps short ever after."""
    run = parallelogram().run(
        t_end=3.0,
        method="radau5",
        rtol=1e-9,
        atol=1e-9,
        start={"a": 1.0, "b": 0.0, "c": 1.0},
        rate={"a": -8.0},
    )
    assert run.status == "success" and run.stats["steps"] < 1000
    np.testing.assert_allclose(run.q[-1], [-23.0, 0.0, -23.0], rtol=0, atol=1e-6)


@pytest.mark.parametrize("rate", [-8.0, 5.0])
def test_rates_at_a_flat_start_are_those_of_one_branch(rate):
    """The cranks turn alike and the bar keeps its angle, or b' = 2 a' / (1 - l / r) and c' = a' + l b' / r."""
    flat = dict.fromkeys("abc", 0.0)
    assembly = assemble(parallelogram(), parallelogram().parameter_values(), flat, {"a": rate})
    branches = [(1.0, 0.0, 1.0), (1.0, -4.0 / 3.0, -7.0 / 3.0)]
    assert min(np.abs(assembly.v / rate - branch).max() for branch in branches) < 1e-9
    assert any("singular configuration" in note for note in assembly.notes)


def test_rates_of_no_branch_are_refused():
    flat = dict.fromkeys("abc", 0.0)
    system = parallelogram()
    with pytest.raises(
        RuntimeModelError, match=r"no motion leads on .* dot\(a\) = 8, dot\(b\) = -6\.4, dot\(c\) = -8"
    ):
        assemble(system, system.parameter_values(), flat, {"a": 8.0, "b": -6.4, "c": -8.0})


def test_forms_that_do_not_pass_say_so():
    """The motion leads on, so the mechanism is neither locked nor without mass; a form that gets past is right."""
    start = {"a": 1.0, "b": 0.0, "c": 1.0}
    run = parallelogram().run(
        t_end=2.0, method="radau5", constraints="ggl", rtol=1e-9, atol=1e-9, start=start, rate={"a": -8.0}
    )
    if run.status == "failed":
        assert "does not get past that" in run.message and "locked" not in run.message
    else:
        np.testing.assert_allclose(run.q[-1], [-15.0, 0.0, -15.0], rtol=0, atol=1e-6)


@pytest.mark.parametrize("part", [0.8, 0.5])
def test_long_steps_into_a_change_point_say_so(part):
    """Places that were looked at on the way ahead lay on both sides of it: half of that step said "try a smaller"."""
    windows = derive(load(find("n_four_bar"), {"N": "2"}))
    run = windows.run(1.5, method="gauss16", step=part * 0.1326612038920836)
    assert run.status == "failed" and "nearly depend on each other" in run.message


@pytest.mark.parametrize(
    ("method", "step"),
    [("rattle6", 0.0186), ("rattle6", 0.00275), ("generalized_alpha", 0.00275), ("hht", 0.02)],
)
def test_a_fixed_step_into_a_change_point_says_so(method, step):
    """Where the run stops, constraints are independent yet; where the next step leads, they are not."""
    system = derive(load(find("n_four_bar"), {"N": "2"}))
    run = system.run(t_end=1.5, method=method, constraints="index3", step=step)
    if run.status == "failed":
        assert "'loop1_x', 'loop2_x' " in run.message and "depend on each other at" in run.message, (
            run.message
        )
    else:
        assert run.q[-1, 0] == pytest.approx(-4.0879, abs=1e-3)


def bead(**constraints):
    m = Model("bead")
    x, y = m.coordinate("x"), m.coordinate("y", guess=1.0)
    m.body("bead", mass=m.parameter("m", 1.0), com=(x, y))
    for name, expression in constraints.items():
        m.constraint(name, expression(x, y))
    return m.derive()


def test_pulled_out_of_reach_stops_with_place_and_reason():
    system = bead(rod=lambda x, y: x**2 + y**2 - 1, pull=lambda x, y: x - 0.5 - 0.25 * t)
    run = system.run(t_end=3.0, method="dop853")
    assert run.status == "failed"
    assert run.t[-1] == pytest.approx(2.0, abs=1e-6)
    assert "'rod', 'pull' depend on each other at t = " in run.message


@pytest.mark.parametrize(("rtol", "noticed"), [(1e-8, 1e-6), (1e-3, 2e-2)])
def test_contradiction_that_arises_later_stops_the_run(rtol, noticed):
    system = bead(one=lambda x, y: x - t**3, two=lambda x, y: x - 2 * t**3)
    run = system.run(t_end=3.0, method="dop853", rtol=rtol)
    assert run.status == "failed"
    assert "'one', 'two' depend on each other at t = " in run.message
    assert 2 * run.t[-1] ** 3 < noticed  # not silently on


@pytest.mark.parametrize("inertia", [0.0, 1e-12, 1e-6, 1.0])
@pytest.mark.parametrize("method", ["dop853", "auto"])
def test_coordinates_with_little_or_no_mass(inertia, method):
    """The spring's end carries (nearly) nothing, and its far end nothing at all; constraints tie both to the mass."""
    oscillator = springs()
    run = oscillator.run(t_end=3.0, method=method, parameters={"e": inertia}, rtol=1e-10, atol=1e-12)
    assert run.status == "success", run.message
    assert run.stats["steps"] < 400
    expected = 0.1 * np.cos(np.sqrt(10.0 / (1.0 + inertia)) * run.t[-1])
    np.testing.assert_allclose(run.q[-1], expected, rtol=0, atol=1e-8)


@functools.cache
def springs():
    m = Model("springs")
    x, y, z = m.coordinate("x", start=0.1), m.coordinate("y"), m.coordinate("z")
    M, k, e = m.parameters(M=1.0, k=10.0, e=0.0)
    m.body("mass", mass=M, com=(x, 0))
    m.kinetic(e * dot(y) ** 2 / 2)
    m.potential(k * z**2 / 2)
    m.constraint("one", x - y)
    m.constraint("two", y - z)
    return m.derive()


@functools.cache
def windows():
    return derive(load(find("n_four_bar"), {}))


@pytest.mark.parametrize("distance", [0.1, 0.02, 1e-3, 1e-5, 0.0])
def test_accelerations_next_to_a_change_point(distance):
    """Ten loops lose rank at once; as a parallelogram the whole has one freedom, and a closed form."""
    system = windows()
    n, p = 10, system.parameter_values()
    rocker = np.array([record["name"].startswith("rocker") for record in system.coordinates])
    upright = np.where(rocker, np.pi / 2, 0.0)
    assert not is_ill_conditioned(system, p, 0.0, upright)  # forces balance there but for round-off
    guard = lease_guard(system)
    guard.expect(p, 0.0, upright)
    precomputed, row = system.precomputed(p), np.zeros(system.n_row)
    beside = np.concatenate([np.where(rocker, 0.1, 0.0), np.where(rocker, -3.5, 0.0)])
    projected = np.zeros(2 * system.nq + system.nh + system.m)
    call_kernel(
        np.uint64(guard.project), 0.0, beside, precomputed, projected
    )  # sees that a singular place is near
    y = np.concatenate([np.where(rocker, distance, 0.0), np.where(rocker, -3.5, 0.0)])
    expected = -9.81 * ((n + 1) / 2 + n) / ((n + 1) / 3 + n) * np.cos(distance)
    random = np.random.default_rng(3)
    for off in (0.0, 1e-12, 1e-9):
        stage = y + off * random.uniform(-1.0, 1.0, len(y))
        call_kernel(np.uint64(guard.rhs), 0.0, stage, precomputed, row)
        np.testing.assert_allclose(
            row[system.nq : 2 * system.nq], np.where(rocker, expected, 0.0), rtol=0, atol=1e-9 + 100 * off
        )


def beside_a_dead_point(distance: float, off: float = 0.0) -> np.ndarray:
    """The crank so far before the vertical, at 8 rad/s, on its curve but for `off`."""
    theta, w = math.pi / 2 - distance, 8.0
    q = np.array([theta, -theta, 0.6 * math.cos(theta)]) + off * np.array([0.3, -0.7, 0.5])
    return np.concatenate([q, [w, -w, -0.6 * math.sin(theta) * w]])


def closed_form(theta: float, w: float) -> np.ndarray:
    """Accelerations of crank, rod and piston by the energy in the crank's angle."""
    inertia = 0.3**2 * (0.25 + 2.25 * math.sin(theta) ** 2 + 0.25 * math.cos(theta) ** 2) + 15e-3
    inertia += (0.6 * math.sin(theta)) ** 2
    a = -(0.3**2 * 2.0 + 0.36) * math.sin(theta) * math.cos(theta) * w**2 / inertia
    return np.array([a, -a, -0.6 * (math.sin(theta) * a + math.cos(theta) * w**2)])


def rows_of(guard, states):
    system = equal_slider_crank()
    p, row = system.precomputed(system.parameter_values()), np.zeros(system.n_row)
    for y in states:
        call_kernel(np.uint64(guard.rhs), 0.0, np.ascontiguousarray(y), p, row)
        yield row.copy()


def guard_near_a_dead_point():
    system = equal_slider_crank()
    guard, p = lease_guard(system), system.parameter_values()
    guard.expect(p, 0.0, np.array([0.5, -0.5, 0.6 * math.cos(0.5)]))
    projected = np.zeros(6 + system.nh + system.m)
    call_kernel(
        np.uint64(guard.project), 0.0, beside_a_dead_point(0.05), system.precomputed(p), projected
    )  # sees that a singular place is near
    return guard


def test_a_curve_through_a_dead_point_is_as_accurate_as_round_off_lets_it_be():
    """Its places are found once; they lie so far from the pole that 1e-13 of the squared speed is left of it."""
    guard = guard_near_a_dead_point()
    distances = [0.015, 1e-2, 1e-3, 1e-5, 0.0, -1e-4, -2e-2, -3e-2]
    for off in (0.0, 1e-9):
        states = [beside_a_dead_point(d, off) for d in distances]
        for d, row in zip(distances, rows_of(guard, states)):
            expected = closed_form(math.pi / 2 - d, 8.0)
            np.testing.assert_allclose(row[3:6], expected, rtol=0, atol=64.0 * (3e-13 + 10.0 * off))


@pytest.mark.parametrize("off", [0.0, 1e-9])
def test_multipliers_along_a_curve_balance_its_accelerations(off):
    """No factor is needed for them but close to the pole, nor for the ratio of pivots, which falls as the square."""
    system, guard = equal_slider_crank(), guard_near_a_dead_point()
    p, distances = system.parameter_values(), np.array([0.015, 1e-2, 3e-3, 1e-3, -1e-3, -1e-2, -2e-2])
    rows = list(rows_of(guard, [beside_a_dead_point(d, off) for d in distances]))
    for d, row in zip(distances, rows):
        y, constraints = beside_a_dead_point(d), Constraints(system, p, 0.0)
        mass, jacobian = constraints.mass(y[:3]), constraints.jacobian(y[:3], y[3:])
        wanted = mass @ row[3:6] - system.kernel("forces")(0.0, y, p)
        multipliers = row[system.ny : system.ny + system.m]
        np.testing.assert_allclose(jacobian.T @ multipliers, wanted, rtol=0, atol=1e-8 + 1e4 * off)
        found = np.linalg.lstsq(jacobian.T, wanted, rcond=None)[0]
        np.testing.assert_allclose(multipliers, found, rtol=1e-9 + 1e4 * off / abs(d))
    ratios = np.array([row[-1] for row in rows]) / distances**2
    np.testing.assert_allclose(ratios, ratios.mean(), rtol=0.1)


def test_a_guard_goes_on_along_the_curve_of_another():
    """As a run does that is resumed: what it knows of the branch has the same bits. One that forgets lays its own."""
    one, other = guard_near_a_dead_point(), guard_near_a_dead_point()
    (first,) = rows_of(one, [beside_a_dead_point(0.01)])
    other.memory = one.memory
    onwards = [beside_a_dead_point(d) for d in (3e-3, -1e-2)]
    of_one = list(rows_of(one, onwards))
    np.testing.assert_array_equal(list(rows_of(other, onwards)), of_one)
    other.memory = guard_near_a_dead_point().memory
    own = list(rows_of(other, onwards))
    assert (np.array(own) != np.array(of_one)).any()
    np.testing.assert_allclose([row[3:6] for row in own], [row[3:6] for row in of_one], rtol=0, atol=1e-10)
    assert first[3:6] == pytest.approx(closed_form(math.pi / 2 - 0.01, 8.0), abs=1e-10)


def test_a_run_through_dead_points_does_not_depend_on_who_watches_or_prepares_it():
    system = equal_slider_crank()
    options = {"method": "dop853", "rtol": 1e-9, "atol": 1e-9}
    alone = system.run(1.5, **options)
    watched = system.run(1.5, at=list(np.linspace(0.1, 1.4, 14)), fps=300, **options)
    np.testing.assert_array_equal(watched.states[-1], alone.states[-1])
    np.testing.assert_array_equal(watched.step_log, alone.step_log)
    prepared = system.prepare(1.5, start=["theta"], output=[0.4, 0.8, 1.5], **options)
    for theta in (0.5, 0.3, 0.5):  # nothing is left of the run before
        states = prepared(y0=[theta])
        at = system.run(1.5, start={"theta": theta}, at=[0.4, 0.8], **options)
        np.testing.assert_array_equal(states[-1], at.states[-1])


def test_frames_between_steps_of_a_grid_do_not_change_them():
    """Methods of Gauss make these by steps of their own, which are projected behind the step that is the run's."""
    system, options = equal_slider_crank(), {"method": "gauss4", "step": 1e-3}
    alone, watched = system.run(1.0, fps=5, **options), system.run(1.0, fps=730, **options)
    np.testing.assert_array_equal(watched.states[-1], alone.states[-1])


def test_ten_loops_pass_their_change_points():
    """All turn over together, through two singular configurations in a turn; energy gives the speed."""
    run = windows().run(t_end=2.0, method="dop853", rtol=1e-9, atol=1e-12, fps=50)
    assert run.status == "success" and len(run.step_log) < 500
    n, theta = 10, run.q[:, 0]
    gain = 2 * 9.81 * ((n + 1) / 2 + n) / ((n + 1) / 3 + n)
    np.testing.assert_allclose(run.v[:, 0] ** 2, 1.0 + gain * (1.0 - np.sin(theta)), rtol=1e-7)
    assert theta[-1] < -np.pi and np.abs(run.q - np.where(run.q[0] > 1.0, theta[:, None], 0.0)).max() < 1e-9


def test_the_default_step_at_a_change_point_is_that_of_the_motion():
    """Linearised there, round-off alone looks like a motion of a microsecond."""
    options = {"N": "2", "rate": "-3.0", "angle": "0.0"}
    run = derive(load(find("n_four_bar"), options)).run(t_end=0.2, method="generalized_alpha")
    assert run.status == "success" and run.step > 1e-3
