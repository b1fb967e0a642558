"""bdf: coefficients, history, the order of every formula, tolerances, stiff problems, events, failures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from fixture_motions import MODELS, T_END, doubles, python_kernel, reference
from quaternion_models import module_text
from references import load_reference, numbers
from scipy.integrate import solve_ivp

from symgen.runtime import load
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.bdf import newton as of
from symgen.runtime.integrate.bdf.loop import history_dense, resample
from symgen.runtime.integrate.bdf.newton import ndf
from symgen.runtime.integrate.dense import evaluate_dense
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays

FIXTURES = Path(__file__).parent / "fixtures"


def fixture(name):
    return load(FIXTURES / f"{name}.py")


def python(function):
    return getattr(function, "py_func", function)


def loop(system, *, t_end, rtol=1e-8, atol=1e-10, p=None, state=None, frame_times=(), with_events=False):
    q, v, _, _ = system.initial_state()
    return LoopArrays(
        system, METHODS["bdf"], system.parameter_values(p), 0.0,
        np.concatenate([q, v]) if state is None else state, frame_times=np.asarray(frame_times, dtype=float),
        rtol=rtol, atol=atol, with_events=with_events, log_length=50_000,
    )  # fmt: skip


def finished(arrays, t_end):
    assert arrays.advance(t_end, 50_000) == at.REACHED_STOP
    assert arrays.t == t_end
    return arrays


def work_of(arrays):
    return python(of.bdf_work)(arrays.sizes, arrays.work)


# Coefficients and history


@pytest.mark.parametrize("order", range(1, 6))
def test_formulas_are_exact_for_polynomials_and_know_their_error(order):
    """Of degree order; at the next degree they miss by what the error constant says."""
    method = ndf()
    points = -np.arange(order + 1.0)  # of the history, in steps; the new one is 1
    for degree in range(order + 2):
        y, slope = points**degree, float(degree)  # of t^degree at t = 1
        differences = [np.diff(y[::-1], i)[-1] for i in range(order + 1)]
        d = 1.0 - sum(differences)
        gap = method.alpha[order] * d + method.gamma[1 : order + 1] @ differences[1:] - slope
        if degree <= order:
            assert abs(gap) < 1e-12
        else:
            # d = ∇^(k+1) y = (k+1)! for t^(k+1).
            assert d == pytest.approx(np.prod(np.arange(1.0, order + 2.0)), rel=1e-12)
            assert gap == pytest.approx(-method.error[order] * d, rel=1e-10)


def test_without_kappa_these_are_the_classical_formulas():
    """Order 5: 137/60 y - 5 y₁ + 5 y₂ - 10/3 y₃ + 5/4 y₄ - 1/5 y₅ = h f."""
    gamma = ndf().gamma
    powers = [np.polynomial.Polynomial([1.0, -1.0]) ** k for k in range(1, 6)]
    coefficients = sum(power / k for k, power in enumerate(powers, 1)).coef
    assert np.allclose(coefficients, [137 / 60, -5.0, 5.0, -10 / 3, 5 / 4, -1 / 5], rtol=1e-14)
    assert gamma[5] == pytest.approx(137 / 60, rel=1e-15)


def history(polynomials, spacing, arrays, order):
    """Make the last points of `polynomials`, one for each component, the history that ends at t = 0."""
    w = work_of(arrays)
    values = np.array([polynomial(-spacing * np.arange(8.0)) for polynomial in polynomials]).T
    for i in range(order + 1):
        w.differences[i] = np.diff(values[::-1], i, axis=0)[-1]
    w.numbers[of.SPACING] = spacing
    arrays.counters[of.ORDER] = order
    return w


@pytest.mark.parametrize("shift, factor", [(0.0, 0.37), (0.0, 4.0), (-0.6, 1.0), (-0.25, 2.0)])
def test_history_is_moved_on_its_polynomial(shift, factor):
    random = np.random.default_rng(1)
    polynomials = [np.polynomial.Polynomial(random.normal(size=6)) for _ in range(3)]
    arrays = loop(fixture("oscillator"), t_end=1.0)
    w = history(polynomials, 0.1, arrays, 5)
    python(resample)(arrays, shift, factor, w)
    points = 0.1 * (shift - factor * np.arange(6.0))
    values = np.array([polynomial(points) for polynomial in polynomials]).T
    expected = [np.diff(values[::-1], i, axis=0)[-1] for i in range(6)]
    assert np.allclose(w.differences[:6], expected, rtol=1e-11, atol=1e-14)
    assert w.numbers[of.SPACING] == pytest.approx(0.1 * factor, rel=1e-15)


@pytest.mark.parametrize("order", range(1, 6))
def test_dense_output_is_the_polynomial_of_the_history(order):
    random = np.random.default_rng(2)
    polynomials = [np.polynomial.Polynomial(random.normal(size=order + 1)) for _ in range(3)]
    arrays, out = loop(fixture("oscillator"), t_end=1.0), np.zeros(3)
    w = history(polynomials, 0.1, arrays, order)
    start = np.array([polynomial(-0.1) for polynomial in polynomials])
    w.states[of.Y_NEW] = w.differences[0]
    # Up to order 2 work follows from its power, up to t^3.
    power = polynomials[2].deriv()
    w.numbers[of.POWER_BEFORE], w.numbers[of.POWER] = power(-0.1), power(0.0)
    python(history_dense)(ndf(), arrays.sizes, order, start, w, arrays.dense)
    for theta in (0.0, 0.3, 0.8, 1.0):
        python(evaluate_dense)(theta, arrays.dense, 6, 3, out)
        assert np.allclose(out, [p(0.1 * (theta - 1.0)) for p in polynomials], rtol=0, atol=1e-13)


# Orders and tolerances


def steps_of_one_order(name, order, h, times):
    """Steps of h from an exact history, with an order that is never reconsidered."""
    system, t0 = fixture(name), order * h
    past = reference(name, t0 - h * np.arange(order + 1.0))
    arrays = loop(
        system, t_end=T_END, rtol=1e6, atol=1e6, state=past[0, : system.nq + system.nv], frame_times=times
    )
    arrays.y[:] = past[0]
    c, n = arrays.control, arrays.counters
    c[at.T], c[at.H], c[at.H_MAX], c[at.NEWTON_TOL] = t0, h, h, 1e-15
    w = work_of(arrays)
    for i in range(order + 1):
        w.differences[i] = np.diff(past[::-1], i, axis=0)[-1]
    w.numbers[of.SPACING], w.numbers[of.NEWEST] = h, t0
    n[at.F_VALID] = n[of.HAVE_HISTORY] = 1
    n[of.ORDER], n[of.N_EQUAL] = order, -(10**9)
    finished(arrays, T_END)
    assert n[at.STEPS] == round((T_END - t0) / h) and n[at.FACTORISATIONS] == 1
    return arrays


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("order", range(1, 6))
def test_observed_order_of_every_formula(order, model):
    """Constrained motion too, where only the newest point is projected; and of what lies between the points."""
    n_steps = {1: 400, 2: 200, 3: 100, 4: 80, 5: 80}[order]
    times = np.linspace(0.41, 0.79, 20)
    exact, errors, between = reference(model, [T_END])[0], [], []
    at_times = reference(model, times)
    for n in (n_steps, 2 * n_steps):
        arrays = steps_of_one_order(model, order, T_END / n, times)
        errors.append(np.abs(arrays.y - exact).max())
        between.append(np.abs(arrays.frames - at_times).max())
    assert order - 0.25 < np.log2(errors[0] / errors[1]) < order + 0.9
    assert order - 0.25 < np.log2(between[0] / between[1])


@pytest.mark.parametrize("model", MODELS)
def test_error_follows_the_tolerance(model):
    times = np.linspace(0.0, T_END, 54)[1:]
    exact, n_steps = reference(model, times), []
    for rtol in (1e-4, 1e-6, 1e-8, 1e-10):
        arrays = finished(loop(fixture(model), t_end=T_END, rtol=rtol, atol=rtol, frame_times=times), T_END)
        assert np.abs(arrays.y - exact[-1]).max() < 150.0 * rtol
        assert np.abs(arrays.frames - exact).max() < 300.0 * rtol
        assert arrays.counters[at.JACOBIANS] <= 2
        n_steps.append(arrays.counters[at.STEPS])
    # At order 5 a digit more costs 10^(1/6) as many steps.
    assert 1.3 < (n_steps[3] / n_steps[1]) ** 0.25 < 1.9
    assert arrays.counters[of.ORDER] >= 4


def test_quaternions():
    """A heavy top turns by some radians: against dop853."""
    system = load(module_text("heavy_top"))
    ours = system.run(t_end=0.5, method="bdf", rtol=1e-9, atol=1e-11, at=[0.5])
    oracle = system.run(t_end=0.5, method="dop853", rtol=1e-12, atol=1e-14, at=[0.5])
    for a, b in ((ours.samples[0].q, oracle.samples[0].q), (ours.samples[0].v, oracle.samples[0].v)):
        assert np.abs(a - b).max() < 2e-6 * np.abs(b).max()
    assert ours.method == "bdf"


def test_work_is_integrated_with_the_motion():
    system, gaps = fixture("oscillator"), []
    for rtol in (1e-7, 1e-10):
        arrays = finished(loop(system, t_end=5.0, rtol=rtol, atol=rtol), 5.0)
        gap = system.kernel("energy")(5.0, arrays.y[:2], arrays.p).sum() - 0.125 - arrays.y[2]
        gaps.append(abs(gap) / rtol)
    assert max(gaps) < 1000.0


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_bodies_that_stick_to_a_belt_keep_their_energy_balance(rtol):
    """What sticks moves evenly: nothing shortens the steps, while the spring on it changes its power."""
    from tests.trust.models import bundled

    run = bundled("stick_slip").run(t_end=8.0, method="bdf", rtol=rtol, atol=0.01 * rtol)
    assert run.ok and run.energy.max_error < max(1e3 * rtol, 1e-6)


def test_frames_and_end_are_on_the_constraints():
    system = fixture("cartesian_pendulum")
    arrays = finished(loop(system, t_end=2.0, rtol=1e-5, frame_times=np.linspace(0.01, 1.99, 77)), 2.0)
    residual = system.kernel("constraint_residual")
    assert max(np.abs(residual(0.0, y, arrays.p)).max() for y in (*arrays.frames, arrays.y)) < 1e-12


# Stiff problems


def test_stiff_bushing():
    """Eigenvalues -2e3 ± 2.4e4 i beside a swing of about 1 s; orders 3 to 5 are not stable near the imaginary axis."""
    system, expected = fixture("stiff_bushing"), load_reference("stiff_bushing_pendulum")["reference_q_v"]
    arrays = loop(system, t_end=0.1, rtol=1e-6, atol=1e-8)
    finished(arrays, 0.1)
    assert np.abs(arrays.y[:6] - numbers(expected["0.1"])).max() < 1e-4
    assert arrays.counters[at.STEPS] < 2500
    assert arrays.counters[at.JACOBIANS] < 100


@pytest.mark.parametrize("mu, t_end", [(30.0, 60.0), (1000.0, 1500.0)])
def test_stiff_van_der_pol_oscillator(mu, t_end):
    def f(t, y):
        return [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]]

    def jacobian(t, y):
        return [[0.0, 1.0], [-2 * mu * y[0] * y[1] - 1.0, mu * (1 - y[0] ** 2)]]

    oracle = solve_ivp(f, (0, t_end), [2.0, 0.0], "Radau", rtol=1e-9, atol=1e-12, jac=jacobian)
    arrays = finished(loop(fixture("van_der_pol"), t_end=t_end, rtol=1e-8, atol=1e-11, p={"mu": mu}), t_end)
    assert np.abs(arrays.y[:2] - oracle.y[:, -1]).max() < 1e-5
    assert arrays.counters[at.STEPS] < len(oracle.t)
    assert arrays.counters[at.NEWTON_ITERATIONS] < 2.4 * arrays.counters[at.STEPS]


def test_round_off_of_the_projection_is_not_fought():
    """Seven bodies in loops whose rates reach 1e3 rad/s, at a tolerance below the round-off of the slowest."""
    system = load(FIXTURES.parents[1] / "generated" / "andrews_squeezer.py")
    data = json.loads((FIXTURES.parents[1] / "models" / "references" / "andrews.json").read_text())
    arrays = loop(system, t_end=0.03, rtol=3e-13, atol=3e-15, p=data["parameters"])
    finished(arrays, 0.03)
    exact = np.array([float(x) for key in "qv" for x in data["end"][key]])
    size = np.repeat([data["size"]["q"], data["size"]["v"]], system.nq)
    assert np.max(np.abs(arrays.y[: len(exact)] - exact) / size) < 1e-9
    assert arrays.counters[at.STEPS] < 8000


# Events and calls


def test_recorded_events_cost_no_restart():
    """The history goes on, and the events are where dop853 has them."""
    p = {"x_stop": -1e9}
    run = {"t_end": 12.0, "parameters": p}
    ours = fixture("oscillator").run(method="bdf", rtol=1e-9, **run)
    oracle = fixture("oscillator").run(method="dop853", rtol=1e-12, atol=1e-14, **run)
    assert len(ours.events) == len(oracle.events) > 15
    assert max(abs(a.t - b.t) for a, b in zip(ours.events, oracle.events, strict=True)) < 1e-6
    without = finished(loop(fixture("oscillator"), t_end=12.0, rtol=1e-9, p=p), 12.0).counters[at.STEPS]
    assert ours.stats["steps"] < without + 8 * len(ours.events)


def test_resets_start_anew():
    run = {"t_end": 3.0, "at": [3.0]}
    ours = fixture("oscillator").run(method="bdf", rtol=1e-10, **run)
    oracle = fixture("oscillator").run(method="dop853", rtol=1e-12, atol=1e-14, **run)
    assert ours.status == oracle.status == "success"
    assert len(ours.events) == len(oracle.events) > 5
    assert max(abs(a.t - b.t) for a, b in zip(ours.events, oracle.events, strict=True)) < 1e-7


def test_loop_carries_its_state_from_call_to_call():
    system = fixture("stiff_bushing")
    whole = finished(loop(system, t_end=0.02), 0.02)
    parts = loop(system, t_end=0.02)
    while parts.advance(0.02, 1) == at.RUNNING:
        pass
    assert np.array_equal(parts.y, whole.y)
    assert np.array_equal(parts.counters[: at.PROJECTIONS], whole.counters[: at.PROJECTIONS])


def test_stop_times_cost_few_steps():
    system = fixture("pendulum")
    free = finished(loop(system, t_end=4.0), 4.0).counters[at.STEPS]
    arrays = loop(system, t_end=4.0)
    for stop in np.linspace(0.0, 4.0, 11)[1:]:
        finished(arrays, stop)
    assert arrays.counters[at.STEPS] < free + 12 * 10


# Failures


def test_a_jump_of_the_force_is_passed():
    """The history is no guide past it; the remedy is a new start."""

    def rhs(t, y, p, out):
        doubles(out)[0] = doubles(y)[1]
        doubles(out)[1] = 0.0 if t < 0.5 else 10.0

    def residual_jacobian(t, y, p, out):
        doubles(out)[0], doubles(out)[1], doubles(out)[2] = 0.0, 0.0, 1.0

    arrays = loop(fixture("pendulum"), t_end=1.0)
    arrays.addresses[at.RHS], keep = python_kernel(rhs)
    arrays.addresses[at.RESIDUAL_JACOBIAN], keep_too = python_kernel(residual_jacobian)
    finished(arrays, 1.0)
    assert keep is not None and keep_too is not None
    assert arrays.y[1] == pytest.approx(5.0, rel=1e-6)
    assert arrays.y[0] == pytest.approx(1.5 + 1.25, rel=1e-6)


def test_a_wall_in_the_equations_is_reported():
    def rhs(t, y, p, out):
        doubles(out)[0] = doubles(y)[1]
        doubles(out)[1] = -doubles(y)[0] if t < 0.5 else np.nan

    arrays = loop(fixture("pendulum"), t_end=1.0)
    arrays.addresses[at.RHS], keep = python_kernel(rhs)
    assert arrays.advance(1.0, 50_000) == at.NOT_FINITE and keep is not None
    assert 0.45 < arrays.t <= 0.5


def test_undetermined_accelerations_are_reported():
    def residual_jacobian(t, y, p, out):
        doubles(out)[0], doubles(out)[1], doubles(out)[2] = 1.0, 0.0, 0.0

    arrays = loop(fixture("pendulum"), t_end=1.0)
    arrays.addresses[at.RESIDUAL_JACOBIAN], keep = python_kernel(residual_jacobian)
    assert arrays.advance(1.0, 50_000) == at.SINGULAR_MATRIX and keep is not None
