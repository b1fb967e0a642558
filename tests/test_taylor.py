"""Runs with Taylor series: reference problems, order, symmetric starts, rest, events, dense output, long runs."""

from __future__ import annotations

from pathlib import Path

import mpmath
import numpy as np
import pytest
from references import error, load_reference, numbers
from scipy.integrate import solve_ivp

from symgen import Model
from symgen.runtime import load
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.ensemble import linspace
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.integrate.methods.taylor import taylor
from symgen.runtime.integrate.taylor import TaylorSeries, order_for
from symgen.runtime.loop_arrays import LoopArrays

ROOT = Path(__file__).resolve().parents[1]
TIGHT = {"method": "taylor", "rtol": 1e-13, "atol": 1e-15}


def model(name):
    folder = "generated" if (ROOT / "generated" / f"{name}.py").exists() else "tests/fixtures"
    return load(ROOT / folder / f"{name}.py")


def arrays_for(system, method, *, rtol, frame_times=(), start=None, rate=None, atol=None, log_length=4096):
    p = system.parameter_values()
    consistent = assemble(system, p, start, rate, 0.0)
    return LoopArrays(
        system, method, p, 0.0, np.concatenate([consistent.q, consistent.v]), frame_times=np.array(frame_times),
        rtol=rtol, atol=rtol if atol is None else atol, with_events=False, log_length=log_length,
    )  # fmt: skip


def state(sample):
    return np.concatenate([sample.q, sample.v])


def run(name, expected, **options):
    times = [float(t) for t in expected]
    solution = model(name).run(t_end=max(times), at=times, fps=10, **{**TIGHT, **options})
    assert solution.status == "success", solution.message
    return solution.samples


@pytest.mark.parametrize(
    "name, reference, limit",
    [("double_pendulum", "double_pendulum", 2e-10), ("n_pendulum", "n_link_pendulum", 2e-9)],
)
def test_chains_released_exactly_horizontal(name, reference, limit):
    expected = load_reference(reference)["reference_th_then_rates"]
    for sample, digits in zip(run(name, expected), expected.values(), strict=True):
        assert error(state(sample), numbers(digits)) < limit


def test_car_axis():
    expected = numbers(load_reference("ivpts_car_axis")["reference_tf"]["recomputed"])
    (sample,) = run("car_axis", [3.0])
    assert error(state(sample), expected[:8]) < 1e-10


def test_andrews_squeezer():
    expected = numbers(load_reference("ivpts_andrews")["reference_tf"]["recomputed"])
    (sample,) = run("andrews_squeezer", [0.03])
    assert error(sample.q, expected[:7], floor=0.01) < 1e-9
    assert error(sample.v, expected[7:14]) < 1e-9


def test_rolling_disc():
    expected = load_reference("rolling_disk")["reference_q_v"]
    for sample, digits in zip(run("rolling_disc", expected), expected.values(), strict=True):
        assert error(state(sample), numbers(digits)) < 1e-10


def test_free_rigid_body_with_quaternions():
    system = model("free_rigid_body")
    ends = [system.run(t_end=2.0, **{**TIGHT, "method": method}) for method in ("taylor", "dop853")]
    np.testing.assert_allclose(ends[0].q[-1], ends[1].q[-1], rtol=0, atol=1e-11)
    place = system.quaternions[0]
    np.testing.assert_allclose(
        np.linalg.norm(ends[0].q[:, place : place + 4], axis=1), 1.0, rtol=0, atol=4e-16
    )
    assert ends[0].energy.max_error < 1e-13


def test_dependent_constraints_end_the_run_with_a_remedy():
    solution = model("redundant_pendulum").run(t_end=1.0, **TIGHT)
    assert solution.status == "failed"
    assert "depend on each other" in solution.message and "dop853" in solution.message


def test_cartesian_pendulum_keeps_its_constraint():
    solution = model("pendulum_dae").run(t_end=20.0, **TIGHT)
    assert solution.status == "success"
    assert solution.constraint_residual.max_position < 1e-14
    assert solution.energy.max_error < 1e-12


def test_pendulum_returns_after_a_period_of_the_elliptic_integral():
    system = model("pendulum")
    angle, length = 1.5, system.parameter_values()[0]
    period = float(4 * mpmath.sqrt(length / mpmath.mpf("9.81")) * mpmath.ellipk(mpmath.sin(angle / 2) ** 2))
    (sample,) = system.run(t_end=10 * period, at=[10 * period], start={"theta": angle}, **TIGHT).samples
    assert sample.q[0] == pytest.approx(angle, abs=1e-12)
    assert abs(sample.v[0]) < 1e-11


@pytest.mark.parametrize("name", ["double_pendulum", "n_pendulum", "pendulum"])
def test_rest_is_left_in_one_step(name):
    system = model(name)
    still = {entry["name"]: 0.0 for entry in system.coordinates}
    solution = system.run(t_end=50.0, start=still, rate=still, **TIGHT)
    assert solution.stats["steps"] == 1
    assert not solution.q.any() and not solution.v.any()


@pytest.mark.parametrize("name", ["pendulum", "oscillator", "cartesian_pendulum"])
@pytest.mark.parametrize("order", [6, 7, 10])
def test_observed_order(name, order):
    system, errors = model(name), []
    exact = arrays_for(system, METHODS["taylor"], rtol=1e-15)
    assert exact.advance(0.8, 4000) == at.REACHED_STOP
    # At a low order, what follows the last terms is told by them only where steps are short.
    for h in (0.16, 0.04) if order > 7 else (0.08, 0.02):
        arrays = arrays_for(system, taylor(order), rtol=1e6)
        arrays.control[at.H_MAX] = h
        assert arrays.advance(0.8, 4000) == at.REACHED_STOP
        errors.append(np.abs(arrays.y - exact.y).max())
    # Coordinates are summed to `order`, rates and work to one less.
    assert errors[1] > 1e-15 and order - 1.6 < np.log2(errors[0] / errors[1]) / 2 < order + 1.5


@pytest.mark.parametrize("name", ["pendulum", "slider_crank", "oscillator"])
def test_dense_output_is_as_good_as_the_steps(name):
    system, times = model(name), np.linspace(0.0, 0.4, 83)[1:-1]
    coarse = arrays_for(system, METHODS["taylor"], rtol=1e-10, frame_times=times)
    fine = arrays_for(system, METHODS["dop853"], rtol=3e-14, frame_times=times)
    for arrays in (coarse, fine):
        assert arrays.advance(0.4, 4000) == at.REACHED_STOP
        assert arrays.counters[at.NEXT_FRAME] == len(times)
    assert coarse.counters[at.STEPS] < 20 if name != "slider_crank" else True
    sizes = np.abs(fine.frames).max(axis=0)
    assert np.max(np.abs(coarse.frames - fine.frames) / sizes) < 1e-9


def test_events_are_where_dop853_finds_them():
    system = model("oscillator")
    solutions = [
        system.run(t_end=6.0, method=method, rtol=1e-13, atol=1e-15) for method in ("taylor", "dop853")
    ]
    first, second = ([(e.name, e.t) for e in s.events] for s in solutions)
    assert [name for name, _ in first] == [name for name, _ in second] and len(first) > 10
    np.testing.assert_allclose([t for _, t in first], [t for _, t in second], rtol=0, atol=3e-12)
    assert solutions[0].energy.max_error < 1e-13


def test_impacts_of_a_ball_are_exact_to_the_last_bits():
    ball, e, g = model("ball"), 0.8, 9.81
    first = np.sqrt(2 / g)
    exact = first + np.concatenate([[0.0], np.cumsum(2 * first * e ** np.arange(1, 6))])
    solution = ball.run(t_end=exact[-1] + 0.01, **TIGHT)
    found = [event.t for event in solution.events if event.name == "floor"]
    np.testing.assert_allclose(found, exact, rtol=0, atol=3e-15)


@pytest.mark.parametrize("gap", [1e-1, 1e-6, 1e-9])
def test_two_crossings_within_one_step(gap):
    ball, v0, g = model("ball"), 3.0, 9.81
    level = 10.0 + v0**2 / (2 * g) - gap
    solution = ball.run(t_end=0.7, start={"x": 10.0}, rate={"x": v0}, parameters={"level": level}, **TIGHT)
    half = np.sqrt(2 * gap / g)
    found = [event.t for event in solution.events if event.name == "passes"]
    np.testing.assert_allclose(found, [v0 / g - half, v0 / g + half], rtol=0, atol=1e-14 / (g * half) + 1e-14)


@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10, 1e-13])
@pytest.mark.parametrize("name", ["pendulum", "double_pendulum", "slider_crank", "spinning_top"])
def test_tolerance_is_met(name, rtol):
    system = model(name)
    exact = arrays_for(system, taylor(26), rtol=1e-15, atol=1e-17)
    arrays = arrays_for(system, METHODS["taylor"], rtol=rtol)
    for each in (exact, arrays):
        assert each.advance(0.5, 4000) == at.REACHED_STOP
    size = np.abs(exact.y).max()
    assert np.abs(arrays.y - exact.y).max() < 100 * rtol * size


@pytest.mark.parametrize("angle", [0.9, 1.9])
def test_energy_error_of_a_long_run_is_that_of_rounding(angle):
    """A random walk of a quarter of a rounding error a step; a bias of 1e-19 a step would show."""
    system = model("pendulum")
    arrays = arrays_for(
        system, METHODS["taylor"], rtol=1e-15, atol=1e-17, start={"theta": angle}, log_length=10**6
    )
    energy = system.kernel("energy")
    before = energy(0.0, arrays.y, arrays.p).sum()
    scale = np.prod(arrays.p)  # m g L
    assert arrays.advance(8e4, 10**6) == at.REACHED_STOP
    steps = arrays.counters[at.STEPS]
    assert steps > 500_000
    drift = abs(energy(arrays.t, arrays.y, arrays.p).sum() - before)
    assert drift < np.sqrt(steps) * np.finfo(float).eps / 4 * scale


def test_steps_at_the_limit_of_round_off_do_not_fall_into_step_with_a_period():
    """Chosen by the state alone, most lengths come to repeat exactly after some laps of this pendulum."""
    arrays = arrays_for(
        model("pendulum"),
        METHODS["taylor"],
        rtol=1e-15,
        atol=1e-17,
        start={"theta": 1.0},
        log_length=10**5,
    )
    assert arrays.advance(1e4, 10**5) == at.REACHED_STOP
    lengths = np.diff(arrays.step_log[: arrays.counters[at.N_LOGGED_STEPS], 0])[-4000:]
    change = [np.median(np.abs(lengths[later:] - lengths[:-later])) for later in range(1, 400)]
    assert min(change) > 1e-4 * lengths.mean()


def test_a_step_beyond_what_the_series_shows_is_halved():
    """x'' = t^20: at t = 0 every coefficient up to order 16 vanishes, so only the defect at the end of a step tells."""
    text = (ROOT / "tests" / "fixtures" / "oscillator.py").read_text(encoding="utf-8")
    power = "*".join(["pow(t, 5.0)"] * 4)
    text = text.replace("p[3] * sin(p[4] * t) + p[8] - p[1] * y[1] - p[2] * y[0]", power)
    system = load(text.replace("(w0 - p[2] * y[0]) / p[0]", power))
    arrays = arrays_for(system, taylor(16), rtol=1e-10, start={"x": 0.0})
    assert arrays.advance(1.5, 4000) == at.REACHED_STOP
    assert arrays.counters[at.REJECTED] > 0
    assert arrays.y[0] == pytest.approx(1.5**22 / (21 * 22), rel=1e-9)


def test_order_grows_as_the_tolerance_falls_and_less_where_products_of_series_cost_more():
    def orders(start, order, square):
        method = TaylorSeries(np.uint64(0), np.uint64(0), start, order, square, 0, 30, 0)
        return [order_for(method, 10.0**-digits) for digits in range(2, 16)]

    cheap, dear = orders(0.0, 30.0, 0.5), orders(0.0, 700.0, 60.0)
    assert cheap == sorted(cheap) and dear == sorted(dear)
    assert dear[0] < cheap[0] and dear[-1] < cheap[-1] == 28


def test_stops_are_landed_on_and_do_not_disturb():
    system, stops = model("double_pendulum"), list(np.linspace(0.05, 2.0, 40))
    with_stops = system.run(t_end=2.0, at=stops, **TIGHT).samples
    plain = system.run(t_end=2.0, at=[2.0], **TIGHT).samples
    assert [sample.t for sample in with_stops] == stops
    np.testing.assert_allclose(state(with_stops[-1]), state(plain[-1]), rtol=0, atol=1e-11)


def clamped(low: float, high: float, x: float) -> float:
    s = min(max((x - low) / (high - low), 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


KINKS = {
    "max(x, 0)^2": ("-30*max(x, 0)^2", lambda x, v: -30.0 * max(x, 0.0) ** 2),
    "smoothstep": ("-10*smoothstep(0, 0.1, x)", lambda x, v: -10.0 * clamped(0.0, 0.1, x)),
    "of parameters": ("-9*smoothstep(-a, a, x)", lambda x, v: -9.0 * clamped(-0.1, 0.1, x)),
    "of rates": (
        "min(dot(x), 0)^2 - 3*max(x, 0.2)^3",
        lambda x, v: min(v, 0.0) ** 2 - 3.0 * max(x, 0.2) ** 3,
    ),
    "narrow": ("-50*smoothstep(0, 1e-4, x)", lambda x, v: -50.0 * clamped(0.0, 1e-4, x)),
}


def kinked(force: str):
    m = Model("kinked")
    m.parameter("a", 0.1)
    x = m.coordinate("x", start=0.5, rate=0.3)
    m.kinetic("dot(x)^2/2")
    m.potential("2*x^2")
    m.force(x, force)
    return m.derive()


@pytest.mark.parametrize("name", KINKS)
def test_steps_look_for_kinks_that_no_branch_holds(name):
    """Against SciPy, short steps; what is not looked for would be off by as much as a whole step does."""
    text, force = KINKS[name]
    system = kinked(text)
    reference = solve_ivp(
        lambda t, u: (u[1], -4.0 * u[0] + force(*u)), (0.0, 6.0), (0.5, 0.3), "DOP853", rtol=1e-12, atol=1e-13,
        max_step=1e-3,
    ).y[:, -1]  # fmt: skip
    for rtol, off in ((1e-6, 2e-5), (1e-9, 2e-8)):
        run = system.run(t_end=6.0, method="taylor", rtol=rtol)
        assert run.ok and all(check.ok for check in run.health), run.health
        assert [run["x"][-1], run["dot(x)"][-1]] == pytest.approx(reference, abs=off)
    if name == "max(x, 0)^2":
        assert system.run(t_end=1.0).method == "dop853"  # what `auto` takes
        members = system.ensemble(1.0, method="taylor", start={"x": linspace(0.4, 0.6, 2)})
        alone = system.run(t_end=1.0, method="taylor", start={"x": 0.6})
        assert members["x"][1] == alone["x"][-1] and members.n_failed == 0


@pytest.mark.parametrize(
    "force", ["-3*max(x, 0)^1.5", "-where(x > 0, 5*sqrt(x), 0)", "-where(log(x + 2) > 0.5, 1, 0)"]
)
def test_kinks_without_a_series_are_refused_by_name(force):
    with pytest.raises(
        RuntimeModelError, match=r"a choice .* has no Taylor series where it switches; use dop853"
    ):
        kinked(force).run(t_end=1.0, method="taylor")
