"""The estimated error of runs: against references, where digits are lost, and where they are not."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from driven_models import oscillator
from references import load_reference

from symgen import Model, cos, dot, exp, maximum, runtime, sin, sqrt, t
from symgen.link import module_for
from symgen.model.library import find
from symgen.runtime.checks import error_estimate
from symgen.runtime.checks.amplification import Amplification, Stretch, together
from symgen.runtime.checks.companion import independent
from symgen.runtime.checks.error_estimate import Extent, _Comparison, estimate
from symgen.runtime.checks.growth import is_exponential
from symgen.runtime.inputs import Controller
from tests.stress.error_growth import draw_new


def bundled(name: str) -> runtime.System:
    return runtime.load(module_for(Path(find(name)), {}).text)


@pytest.fixture(scope="module")
def double() -> runtime.System:
    return bundled("double_pendulum")


def kepler(eccentricity: float) -> runtime.System:
    """The orbit from its far end, with a period of 2 pi."""
    model = Model("kepler")
    speed = float(np.sqrt((1.0 - eccentricity) / (1.0 + eccentricity)))
    x, y = model.coordinate("x", start=1.0 + eccentricity), model.coordinate("y", rate=speed)
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential(-1 / sqrt(x**2 + y**2))
    return model.derive()


def saddle() -> runtime.System:
    """Beside the top, which it leaves and comes back to."""
    model = Model("saddle")
    x = model.coordinate("x", start=1e-6)
    model.kinetic(dot(x) ** 2 / 2)
    model.potential(cos(x))
    return model.derive()


def entry_of(run: runtime.Solution):
    (found,) = [entry for entry in run.health if entry.check == "accuracy"]
    return found


@pytest.mark.parametrize("options", [
    {"t_end": 16.0, "method": "dop853", "rtol": 1e-7, "atol": 1e-9},
    {"t_end": 10.0, "method": "dopri5", "rtol": 1e-4},
    {"t_end": 12.0, "method": "rk4", "step": 0.02},
    {"t_end": 5.0, "method": "euler", "step": 2e-4},
], ids=lambda options: options["method"])  # fmt: skip
def test_estimate_against_80_digits(double, options):
    run = double.run(**options)
    states = load_reference("double_pendulum_60")["states"]
    right = np.array([[float(x) for x in states[second]] for second in range(int(options["t_end"]) + 1)])
    seconds = np.searchsorted(run.t, np.arange(len(right)) - 1e-9)
    true = np.abs(run.states[seconds] - right) / Extent(run.states).sizes(
        double, np.zeros(run.states.shape[1], dtype=bool)
    )
    found = estimate(run, 1e8)
    assert found.known
    estimated = found.relative[np.searchsorted(found.t, np.arange(len(right)) - 1e-9)]
    assert true[-1].max() > 1e-6
    np.testing.assert_allclose(estimated[-1], true[-1], rtol=0.2, atol=0.02 * true[-1].max())


@pytest.mark.parametrize("options", [
    {"method": "dopri5", "rtol": 1e-4, "t_end": 20.0},
    {"method": "dop853", "t_end": 60.0},
    {"method": "dop853", "t_end": 30.0},
    {"method": "bdf", "t_end": 20.0},
    {"method": "radau5", "t_end": 30.0},
    {"method": "taylor", "rtol": 1e-14, "t_end": 60.0},
    {"method": "rattle", "t_end": 20.0, "step": 0.01},
    {"method": "implicit_midpoint", "t_end": 20.0, "step": 0.01},
    {"method": "generalized_alpha", "t_end": 20.0, "step": 0.01},
], ids=lambda options: f"{options['method']} {options['t_end']:g} s")  # fmt: skip
def test_lost_digits_are_flagged(double, options):
    entry = entry_of(double.run(**options))
    assert not entry.ok
    assert "by more than 5% from t = " in entry.says


def test_growth_is_told(double):
    """About as fast as the largest exponent of this motion, some 0.9 to 1.2 per second."""
    run = double.run(t_end=30.0, method="dop853")
    assert 0.7 < estimate(run, 1e8).rate < 1.4
    assert "tenfold" in entry_of(run).says and "symgen check" in entry_of(run).says


def test_digits_that_are_left_are_not(double):
    assert double.run(t_end=10.0, method="dop853").ok
    assert double.run(t_end=20.0, method="dop853", rtol=1e-11, atol=1e-13).ok
    assert double.run(t_end=28.0, method="taylor", rtol=1e-15).ok
    assert double.run(t_end=60.0, method="dop853", start={"theta1": 0.2, "theta2": 0.2}).ok


def test_errors_that_grow_by_powers_are_flagged():
    pendulum = bundled("pendulum")
    for options in ({"method": "dop853", "t_end": 300.0}, {"method": "dopri5", "t_end": 300.0}):
        assert not entry_of(pendulum.run(rtol=1e-4, start={"theta": 1.5}, **options)).ok
        assert entry_of(pendulum.run(rtol=1e-8, start={"theta": 1.5}, **options)).ok
    orbit = kepler(0.9)
    assert not entry_of(orbit.run(t_end=1000.0, method="dop853", rtol=1e-6)).ok
    assert entry_of(orbit.run(t_end=1000.0, method="dop853", rtol=1e-11, atol=1e-13)).ok


def test_passes_next_to_a_saddle_are_flagged():
    system = saddle()
    assert not entry_of(system.run(t_end=100.0, method="dop853", rtol=1e-8)).ok
    assert entry_of(system.run(t_end=20.0, method="dop853", rtol=1e-8)).ok


def test_chaos_that_loose_companions_hardly_tell_from_a_power_of_time_is_flagged():
    """Three decades, within which they are lost, are a power of five of the time; regular motion has three at most."""
    pendulum = bundled("spring_pendulum")
    options = {"t_end": 285.0, "method": "bdf", "rtol": 1e-10, "atol": 1e-12}
    wild = entry_of(pendulum.run(start={"r": 1.2476582848037285, "theta": 1.240926109896571}, **options))
    assert not wild.ok and "tenfold every" in wild.says
    seen = float(re.search(r"from t = (\S+) s on", wild.says)[1])
    assert 40.0 < seen < 90.0  # 5 % at 64 s, by `taylor` at 1e-15
    assert entry_of(pendulum.run(start={"r": 1.05, "theta": 0.3}, **options)).ok


def test_phases_that_run_ahead_before_they_fall_back_are_carried_on():
    """`hht` loses energy; in the tenth of the run that is integrated again, both parts of the error cancel."""
    run = bundled("four_bar").run(
        t_end=121.2, method="hht", constraints="ggl", step=0.00142356, rate={"crank": -3.97203}
    )
    entry = entry_of(run)
    assert not entry.ok and entry.value == pytest.approx(0.12, rel=0.5)  # 0.12 against `taylor` at 1e-15


def test_a_part_that_ends_behind_the_place_where_both_cancel_tells_how_it_goes_on():
    """Of `hht` on a pendulum: errors that have come back by then grow by the square of the time, and fast at first."""
    start = {"x": 0.6973740595501358, "y": 0.7167073468763688}
    options = {"t_end": 448.2608854796138, "method": "hht", "step": 0.014843589514192883}
    entry = entry_of(bundled("pendulum_dae").run(start=start, **options))
    assert not entry.ok and entry.value == pytest.approx(0.219, rel=0.3)  # against `taylor` at 1e-15


def test_exponents_are_those_of_the_stretches():
    grown = Amplification((Stretch(1.0, 3.0, 2.0), Stretch(3.0, 5.0, 0.0)), elsewhere=0.5)
    assert grown.exponent(0.0, 10.0) == pytest.approx(0.5 + 4.0 + 0.0 + 2.5)
    assert grown.exponent(2.0, 4.0) == pytest.approx(2.0)
    assert grown.rate == 2.0 and grown.last(10.0) == 10.0
    once = together([Stretch(0.0, 2.0, 3.0), Stretch(2.0, 4.0, 0.0)], [Stretch(5.0, 9.0, 0.0)])
    assert once.exponent(0.0, 10.0) == pytest.approx(6.0)  # a saddle that is passed once
    assert once.last(10.0) == 2.0
    chaos = together([Stretch(0.0, 2.0, 3.0), Stretch(2.0, 6.0, 3.0)], [Stretch(5.0, 6.0, 1.0)])
    assert chaos.exponent(0.0, 10.0) == pytest.approx(5 * 3.0 + 1.0 + 4 * 1.0)
    assert together([], []).rate is None
    short = [Stretch(5.0, 6.0, 0.0, suspected=1.0)]  # too short to tell
    assert together(short, short).rate is None
    assert together([Stretch(0.0, 2.0, 3.0)], short).exponent(0.0, 10.0) == pytest.approx(6.0 + 1.0 + 7.0)


def test_what_a_run_went_over_is_told_with_the_step_that_sees_it():
    """A thin barrier that is too high to pass: the motion turns round there."""
    model = Model("barrier")
    x = model.coordinate("x", rate=1.0)
    model.kinetic(dot(x) ** 2 / 2)
    model.potential(2 * exp(-(((x - 5) / 0.001) ** 2)))
    system = model.derive()
    over = entry_of(system.run(t_end=10.0, method="dop853"))
    assert not over.ok and "went over something" in over.says
    found = re.search(r"steps of at most (\S+) s \(max_step\)", over.says)
    seen = system.run(t_end=10.0, method="dop853", max_step=float(found[1]))
    assert entry_of(seen).ok and seen.v[-1, 0] == pytest.approx(-1.0, rel=1e-6)


def test_what_errors_are_measured_by():
    """The range; of what is still the largest range, and of a speed that stays as it is its magnitude."""
    body = bundled("free_rigid_body")
    wave = np.sin(np.linspace(0.0, 7.0, 50))
    q = np.column_stack([wave, 1e-7 * wave, np.cos(wave), 0.0 * wave])
    v = np.column_stack([0.5 * wave, 150.0 + 0.0 * wave, 3000.0 + 1e-3 * wave])
    states = np.hstack([q, v])
    size = Extent(states).sizes(body, np.zeros(states.shape[1], dtype=bool))
    two = np.ptp(wave)
    np.testing.assert_allclose(
        size, [two, 1e-7 * two, np.ptp(np.cos(wave)), two, 0.5 * two, 150.0, 3.0], rtol=1e-6
    )


def dying() -> runtime.System:
    """A vibration that is gone long before the middle of its run, and a slow decay."""
    model = Model("dying")
    x, y = model.coordinate("x", start=1.0), model.coordinate("y", start=1.0)
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential((400 * x**2 + y**2) / 2)
    model.dissipation((dot(x) ** 2 + 3 * dot(y) ** 2) / 2)
    return model.derive()


def test_what_dies_out_is_measured_by_what_it_did():
    run = dying().run(t_end=100.0, method="dop853", rtol=1e-4, atol=1e-6)
    exact = np.exp(-run.t / 2) * (
        np.cos(np.sqrt(399.75) * run.t) + 0.5 / np.sqrt(399.75) * np.sin(np.sqrt(399.75) * run.t)
    )
    comparison = _Comparison(run)
    companion = independent(run, comparison.own, comparison.least_range)[0]
    part = comparison.follow(companion, 1e9, comparison.middle)
    assert part.t[-1] == run.t[-1]
    assert part.largest < 2.0 * np.abs(run.q[:, 0] - exact).max()


def test_chaos_that_no_accurate_companion_keeps_up_with_is_flagged():
    chain = bundled("spring_chain")
    start = {c["name"]: c["value"] + {"x7": 0.3, "x9": 0.5}.get(c["name"], 0.03) for c in chain.coordinates}
    run = chain.run(start=start, t_end=14.0, method="radau9", rtol=1e-13, atol=1e-15)
    found = entry_of(run)
    assert not found.ok
    assert "tenfold" in found.says


def test_turning_bodies_and_mechanisms():
    body = bundled("free_rigid_body")
    rates = {"turn_wx": 1e-7, "turn_wy": 10.0, "turn_wz": 0.0}
    for rtol in (1e-8, 1e-10):
        assert not entry_of(body.run(t_end=40.0, rtol=rtol, rate=rates)).ok
        assert entry_of(body.run(t_end=4.0, rtol=rtol, rate=rates)).ok
    crank = bundled("slider_crank")
    assert not entry_of(crank.run(t_end=10.0, method="generalized_alpha")).ok
    for form in ("ggl", "index3"):
        assert not entry_of(crank.run(t_end=10.0, method="hht", constraints=form, step=0.004)).ok


def test_a_small_coordinate_is_measured_by_itself():
    model = Model("tiny")
    x, y = model.coordinate("x", start=1.0), model.coordinate("y", start=1e-8)
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential(x**2 / 2 + 9 * y**2 / 2)
    system = model.derive()
    entry = entry_of(system.run(t_end=100.0, method="bdf", rtol=1e-6))
    assert not entry.ok and "y" in entry.says and "smaller atol" in entry.says
    assert entry_of(system.run(t_end=100.0, method="bdf", rtol=1e-6, atol=1e-15)).ok


def test_events_are_followed():
    ball = bundled("bouncing_ball")
    given = {"parameters": {"e": 1.0}, "start": {"y": 1.0}}
    assert entry_of(ball.run(t_end=12.0, method="dop853", **given)).ok
    assert not entry_of(ball.run(t_end=12.0, method="euler", step=0.01, **given)).ok


def test_long_runs_are_judged_by_parts(double):
    """With few operations allowed: errors are those of parts, and grow as there."""
    pendulum = bundled("pendulum")
    for rtol in (1e-4, 1e-7):
        run = pendulum.run(t_end=1000.0, method="dop853", rtol=rtol, start={"theta": 1.5})
        true, parts = estimate(run, 1e9), estimate(run, 1e6)
        assert true.known and not parts.known
        assert 0.1 < parts.largest / true.largest < 10.0
    assert estimate(double.run(t_end=200.0, method="dop853", rtol=1e-10), 6e6).largest > 0.5


def under_a_sampled_controller(**options) -> runtime.Solution:
    law = Controller(lambda t, x: np.sin(t) - 12.0 * x[0] - 3.5 * x[1], period=0.05)
    return oscillator().run(inputs={"u": law}, t_end=5.0, **options)


@pytest.mark.parametrize(("options", "is_right"), [
    ({"method": "dop853"}, True),
    ({"method": "rk4", "step": 0.025}, True),
    ({"method": "euler", "step": 0.01}, True),
    ({"method": "euler", "step": 0.05}, False),
], ids=["dop853", "rk4", "euler", "euler with long steps"])  # fmt: skip
def test_runs_with_sampled_controllers(options, is_right):
    """What controllers said is held as it was; where errors are large then, controllers are called again."""
    run = under_a_sampled_controller(**options)
    right = under_a_sampled_controller(method="dop853", rtol=1e-12, atol=1e-14)
    error = (np.abs(run.states - right.states) / np.ptp(right.states, axis=0)).max()
    entry = entry_of(run)
    assert (error < 0.05) == is_right == (entry.value < 0.05) == run.ok
    assert entry.ok == is_right and not entry.note and 0.5 * error < entry.value < 3.0 * error + 1e-9


def test_the_remedy_names_the_tolerance_that_matters():
    """With atol 1e-10 and motions of size 1, an rtol below that changes nothing by itself."""
    system = bundled("double_pendulum")
    run = system.run(t_end=30.0, method="dop853", rtol=1e-12)
    true = system.run(t_end=30.0, method="dop853", rtol=1e-14, atol=1e-16)
    entry = entry_of(run)
    assert not entry.ok and "a smaller atol than 1e-10" in entry.says
    of_rtol = system.run(t_end=30.0, method="dop853", rtol=1e-14)
    of_atol = system.run(t_end=30.0, method="dop853", rtol=1e-12, atol=1e-14)
    errors = [np.abs(x.q - true.q).max() for x in (run, of_rtol, of_atol)]
    assert errors[1] > 0.5 * errors[0] and errors[2] < 0.2 * errors[0]


@pytest.fixture(scope="module")
def driven_double_pendulum() -> runtime.System:
    model = Model.from_toml(find("double_pendulum").read_text())
    model.force("theta1", model.input("u"))
    return model.derive()


def test_a_chaotic_plant_under_a_sampled_controller_is_flagged(driven_double_pendulum):
    """Looked at in parts alone, errors seemed small: the dense output of so many pieces shows no growth."""
    law = Controller(lambda t, x: 0.05 * np.sin(t) - 0.01 * x[2], period=0.05)
    right, wrong, longer, tight = (
        driven_double_pendulum.run(method="dop853", inputs={"u": law}, **options)
        for options in (
            {"t_end": 10.0}, {"t_end": 20.0}, {"t_end": 40.0}, {"t_end": 20.0, "rtol": 1e-13, "atol": 1e-15},
        )
    )  # fmt: skip
    assert np.abs(wrong.q[-1] - tight.q[-1]).max() > 0.5
    assert entry_of(right).ok and entry_of(right).value < 0.05
    for run in (wrong, longer):
        assert not entry_of(run).ok and not run.ok
    until = float(re.search(r"from t = (\S+) s on", entry_of(wrong).says)[1])
    there = tight.t <= until - 1.0
    assert np.abs(wrong.q - tight.q)[there].max() < 0.2


def test_a_controller_that_remembers_elsewhere_is_noticed(driven_double_pendulum):
    """It cannot be asked again what it would have said: nothing is known, and the entry says so."""
    seen = []

    def law(t, x):
        seen.append(x[2])
        return -0.01 * np.mean(seen)

    entry = entry_of(
        driven_double_pendulum.run(t_end=40.0, method="dop853", inputs={"u": Controller(law, period=0.05)})
    )
    assert entry.note and "not estimated" in entry.says


def test_a_sampled_controller_that_holds_an_unstable_plant_is_no_reason_for_doubt():
    """With what it said held, errors of the upright pole would grow with exp(4 t); it acts against them."""
    model = Model("pole")
    theta = model.coordinate("theta", start=0.1)
    model.kinetic(dot(theta) ** 2 / 2)
    model.potential(16 * cos(theta))
    model.force("theta", model.input("u"))
    law = Controller(
        lambda t, x, memory: _integrating(x, memory), period=0.02, memory=[0.0], noise={"theta": 1e-3}
    )
    system = model.derive()
    run = system.run(t_end=20.0, method="dop853", inputs={"u": law})
    tight = system.run(t_end=20.0, method="dop853", rtol=1e-13, atol=1e-15, inputs={"u": law})
    error = np.abs(run.states - tight.states).max() / np.ptp(tight.states, axis=0).min()
    entry = entry_of(run)
    assert error < 1e-6 and run.ok and entry.ok and not entry.note and entry.value < 1e-5
    assert "held as it was" not in entry.says


def _integrating(x, memory):
    memory[0] += 0.02 * x[0]
    return -60.0 * x[0] - 10.0 * x[1] - 20.0 * memory[0]


def test_errors_of_a_run_whose_events_all_come_at_its_start_are_seen_in_its_middle():
    """More than twenty turns of a slip within milliseconds; then an oscillation that implicit Euler damps.

    What sticks bears less than what slides, which a description refuses: here is one that allows everything.
    """
    allows_all = SimpleNamespace(fault=lambda values: "", creeping=[])
    system = bundled("stick_slip").vetted_by(lambda: allows_all)
    parameters = {"mu_s": 0.3580628395677803, "v0": 0.3516770128418617, "g": 10.490903062734818}
    given = {"parameters": parameters, "start": {"x": 0.007046348945936819}}
    run = system.run(6.921132921836707, method="implicit_euler", **given)
    exact = system.run(6.921132921836707, method="dop853", rtol=1e-12, atol=1e-14, **given)
    off = np.abs(run.v[:, 0] - exact.v[:, 0]).max() / np.ptp(exact.v[:, 0])
    (entry,) = [entry for entry in run.health if entry.check == "accuracy"]
    assert not entry.ok and off / 2 < entry.value < 2 * off


def test_coming_to_rest_by_ever_shorter_bounces_is_not_chaos():
    """A ball on a table that shakes, 18 impacts in 1.35 s, and then at rest on it."""
    drawn, how, _ = draw_new(1, 606)
    run = drawn.system.run(**how, **drawn.given)
    assert len(run.events) > 15 and not run.objections


def test_drift_that_baumgarte_leaves_is_a_note_where_the_motion_is_right():
    system = bundled("pendulum_dae")
    run = system.run(10.0, method="rk4", constraints="baumgarte", step=0.1)
    drift = [entry for entry in run.health if entry.check.startswith("constraint ") and entry.value > 1e-6]
    assert drift and all(entry.ok and entry.note for entry in drift) and not run.objections
    assert any(
        entry.check.startswith("constraint ")
        for entry in system.run(10.0, method="rk4", constraints="none", step=0.1).objections
    )


def _held_by(potential, rate=0.1) -> runtime.System:
    """A mass on a line, in a potential."""
    model = Model("held")
    x = model.coordinate("x", start=0.7, rate=rate)
    model.kinetic(dot(x) ** 2 / 2)
    model.potential(potential(x))
    return model.derive()


@pytest.mark.parametrize(
    ("potential", "is_smooth"),
    [
        (lambda x: x**2 / 2 + x**4, True),
        (lambda x: -cos(x), True),
        (lambda x: sqrt(1 + x**2), True),
        (lambda x: 1 / (1 + x**2), True),
        (lambda x: sqrt(1e-6 + x**2), False),
        (lambda x: x**2 / 2 + 1e-4 / (1e-4 + x**2), False),
        (lambda x: exp(-(x**2)), False),
        (lambda x: maximum(x, 0) ** 2, False),
        (lambda x: x**2 + x * sin(3 * t), False),
    ],
)
def test_companions_look_at_many_places_unless_all_is_smooth(potential, is_smooth, monkeypatch):
    """Sums, products, sines and cosines act nowhere for a short time only: steps may be as long as they like."""
    followed = []
    whole = error_estimate.follow

    def follow(*arguments, **options):
        followed.append(whole(*arguments, **options))
        return followed[-1]

    monkeypatch.setattr(error_estimate, "follow", follow)
    solution = _held_by(potential).run(5.0)
    (accuracy,) = [entry for entry in solution.health if entry.check == "accuracy"]
    assert accuracy.ok and accuracy.value < 1e-6
    (one,) = followed
    assert (one.steps < 300) == is_smooth and (one.steps > 1000) == (not is_smooth)


@pytest.mark.parametrize("method", ["dop853", "dopri5", "taylor", "radau5"])
def test_ripples_that_a_motion_runs_over_are_not_passed_by(method):
    """A fast mass over a thousand small waves, which no step limit of a companion resolves: its error is found."""
    system = _held_by(lambda x: 0.5 * cos(150 * x), rate=20.0)
    exact = system.run(4.0, method="dop853", rtol=1e-13, atol=1e-13).states[-1]
    for rtol in (1e-2, 1e-4, 1e-6):
        solution = system.run(4.0, method=method, rtol=rtol, atol=rtol)
        extent = np.ptp(solution.states, axis=0)
        off = np.max(np.abs(solution.states[-1] - exact) / extent)
        said = [entry for entry in solution.health if entry.check == "accuracy"]
        assert said and (not solution.ok or off <= max(5.0 * said[0].value, 1e-9))


def test_what_rests_between_what_strikes_it_is_not_measured_by_its_round_off():
    """The ball in the middle of a cradle hands on what comes; open, its equation has nothing to do with the others."""
    run = bundled("newtons_cradle").run(method="gauss8")
    assert run.ok, [check.says for check in run.objections]
    assert np.ptp(run["a3"]) < 1e-10
    assert next(check.value for check in run.health if check.check == "accuracy") < 1e-6


def test_an_error_that_comes_at_one_place_is_no_growth():
    """A foot touches the ground, and the error of a run of `rk4` leaps from 1e-9 to 2e-7, where it stays."""
    t = 0.015 * np.arange(12)
    leaps = np.array([0, 4.2, 2.8, 3.9, 5.2, 6.5, 7.8, 9.1, 10.4, 2060, 1270, 2020]) * 1e-10
    assert is_exponential(t, leaps) and not is_exponential(t, leaps, but_once=True)
    assert is_exponential(t, 1e-10 * np.exp(60.0 * t), but_once=True)


def test_a_rough_companion_is_never_the_run_itself():
    """Off by a quarter at the end; beside it went `dop853` with the run's own tolerance, to the same bits: off by 0."""
    run = bundled("spring_pendulum").run(t_end=3000.0, method="dop853", rtol=1e-6, atol=1e-8)
    (entry,) = (check for check in run.health if check.check == "accuracy")
    assert not entry.ok and 0.15 < entry.value < 0.4
