"""Generalised-α and HHT: textbook recursion, damping of fast motions, orders, stiff models, failures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fixture_motions import MODELS, T_END, doubles, python_kernel, reference
from references import load_reference, numbers

from symgen.runtime import load
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.generalized_alpha import generalized_alpha, hht
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays

FIXTURES = Path(__file__).parent / "fixtures"
METHODS_HERE = {"generalized_alpha": generalized_alpha, "hht": hht}


def fixture(name):
    return load(FIXTURES / f"{name}.py")


def loop(system, name, h, *, t_end=T_END, p=None, frame_times=(), rtol=1e-8, atol=1e-10, state=None):
    q, v, _, _ = system.initial_state()
    return LoopArrays(
        system, METHODS[name], system.parameter_values(p), 0.0,
        np.concatenate([q, v]) if state is None else np.asarray(state, dtype=float),
        frame_times=np.asarray(frame_times, dtype=float), rtol=rtol, atol=atol, step=h,
        with_events=False, log_length=50_000,
    )  # fmt: skip


def finished(arrays, t_end):
    assert arrays.advance(t_end, 50_000) == at.REACHED_STOP
    assert arrays.t == t_end
    return arrays


@pytest.mark.parametrize("name", METHODS_HERE)
def test_linear_oscillator_follows_the_textbook_recursion(name):
    """Chung and Hulbert's own equations: (1-α_m) A₁ + α_m A₀ + c v + k x = 0, c v + k x at 1 - α_f of the step."""
    am, af, beta, gamma = METHODS_HERE[name]()
    h, c, k, x, v = 0.05, 0.2, 25.0, 0.1, 0.0
    a = -c * v - k * x
    for _ in range(40):
        x_known, v_known = x + h * v + h * h * (0.5 - beta) * a, v + h * (1 - gamma) * a
        right = am * a + c * ((1 - af) * v_known + af * v) + k * ((1 - af) * x_known + af * x)
        new = -right / (1 - am + (1 - af) * (c * h * gamma + k * h * h * beta))
        x, v, a = x_known + h * h * beta * new, v_known + h * gamma * new, new
    arrays = finished(
        loop(fixture("oscillator"), name, h, t_end=2.0, p={"amplitude": 0.0}, rtol=1e-13, atol=0.0), 2.0
    )
    assert np.abs(arrays.y[:2] - [x, v]).max() < 1e-13


@pytest.mark.parametrize("name, radius, multiplicity", [("generalized_alpha", 0.9, 3), ("hht", 0.9 / 1.1, 2)])
def test_fast_motions_are_damped_by_the_spectral_radius(name, radius, multiplicity):
    """A period of 2e-4 steps. Root -ρ of multiplicity k, so amplitudes fall as n^(k-1) ρⁿ (Chung, Hulbert, (18))."""

    def rhs(t, y, p, out):
        doubles(out)[0] = doubles(y)[1]
        doubles(out)[1] = -1e9 * doubles(y)[0]

    def residual_jacobian(t, y, p, out):
        doubles(out)[0], doubles(out)[1], doubles(out)[2] = 1e9, 0.0, 1.0

    arrays = loop(fixture("pendulum"), name, 1.0, t_end=400.0, rtol=1e-5, atol=0.0, state=[1.0, 0.0])
    arrays.addresses[at.RHS], keep = python_kernel(rhs)
    arrays.addresses[at.RESIDUAL_JACOBIAN], keep_too = python_kernel(residual_jacobian)
    halfway = abs(finished(arrays, 200.0).y[0])
    factor = abs(finished(arrays, 400.0).y[0]) / halfway
    observed = (factor / 2.0 ** (multiplicity - 1)) ** (1 / 200)
    assert observed == pytest.approx(radius, abs=5e-4) and keep is not None and keep_too is not None


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", METHODS_HERE)
def test_observed_order_of_steps_and_frames(name, model):
    times = np.linspace(0.0, T_END, 54)[1:]
    exact, errors, between = reference(model, times), [], []
    for h in (4e-3, 1e-3):
        arrays = finished(loop(fixture(model), name, h, frame_times=times[:-1]), T_END)
        errors.append(np.abs(arrays.y - exact[-1]).max())
        between.append(np.abs(arrays.frames - exact[:-1]).max())
    assert 1.9 < np.log2(errors[0] / errors[1]) / 2 < 2.3
    assert 1.9 < np.log2(between[0] / between[1]) / 2


@pytest.mark.parametrize("name", METHODS_HERE)
def test_stiff_bushing(name):
    """24 radians of the fastest vibration in a step; a second takes radau5 2000 steps, here 1000."""
    system, expected = fixture("stiff_bushing"), load_reference("stiff_bushing_pendulum")["reference_q_v"]
    arrays = finished(loop(system, name, 1e-3, t_end=0.1), 0.1)
    assert np.abs(arrays.y[:6] - numbers(expected["0.1"])).max() < 2e-5
    assert arrays.counters[at.JACOBIANS] < 20


def test_energy_of_the_damped_drive_is_balanced():
    system = fixture("oscillator")
    gaps = []
    for h in (0.004, 0.001):
        arrays = finished(loop(system, "generalized_alpha", h, t_end=2.0), 2.0)
        gaps.append(abs(system.kernel("energy")(2.0, arrays.y[:2], arrays.p).sum() - 0.125 - arrays.y[2]))
    assert 3.5 < np.log2(gaps[0] / gaps[1]) < 4.5


def test_unstable_parameters_are_refused():
    with pytest.raises(ValueError, match="unstable"):
        hht(0.7)


def test_loop_carries_its_state_from_call_to_call():
    system = fixture("stiff_bushing")
    whole = finished(loop(system, "generalized_alpha", 1e-3, t_end=0.05), 0.05)
    parts = loop(system, "generalized_alpha", 1e-3, t_end=0.05)
    while parts.advance(0.05, 1) == at.RUNNING:
        pass
    assert np.array_equal(parts.y, whole.y)


def test_a_wall_in_the_equations_is_reported():
    def rhs(t, y, p, out):
        doubles(out)[0] = doubles(y)[1]
        doubles(out)[1] = -doubles(y)[0] if t < 0.5 else np.nan

    arrays = loop(fixture("pendulum"), "hht", 0.01, t_end=1.0)
    arrays.addresses[at.RHS], keep = python_kernel(rhs)
    assert arrays.advance(1.0, 50_000) == at.NOT_FINITE and keep is not None
    assert 0.48 < arrays.t <= 0.5


def test_newton_that_cannot_converge_is_reported():
    def rhs(t, y, p, out):
        doubles(out)[0] = doubles(y)[1]
        doubles(out)[1] = -1e6 * doubles(y)[0]

    def residual_jacobian(t, y, p, out):
        doubles(out)[0], doubles(out)[1], doubles(out)[2] = -9e5, 0.0, 1.0

    arrays = loop(fixture("pendulum"), "generalized_alpha", 0.1, t_end=1.0)
    arrays.addresses[at.RHS], keep = python_kernel(rhs)
    arrays.addresses[at.RESIDUAL_JACOBIAN], keep_too = python_kernel(residual_jacobian)
    assert arrays.advance(1.0, 50_000) == at.NEWTON_FAILED and keep is not None and keep_too is not None
