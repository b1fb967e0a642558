"""Radau IIA of order 5, 9 and 13: coefficients, orders, tolerances, stiff problems, round-off."""

from __future__ import annotations

import json
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from fixture_motions import MODELS, T_END, reference
from quaternion_models import module_text
from references import load_reference, numbers
from scipy.integrate import solve_ivp

from symgen.runtime import load
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.integrate.radau.coefficients import radau, validate
from symgen.runtime.integrate.radau.coupled import correct_coupled_stages
from symgen.runtime.integrate.radau.error import set_tolerances
from symgen.runtime.integrate.radau.stages import retract_positions
from symgen.runtime.integrate.radau.work import COUPLED, PATIENCE, STAGES, radau_work
from symgen.runtime.loop_arrays import LoopArrays

ROOT = Path(__file__).parents[1]
NAMES = ("radau5", "radau9", "radau13")
N_STAGES = (3, 5, 7)


def fixture(name):
    return load(ROOT / "tests" / "fixtures" / f"{name}.py")


def loop(system, name, *, t_end, rtol=1e-8, atol=1e-10, step=0.0, p=None, frame_times=()):
    q, v, _, _ = system.initial_state()
    return LoopArrays(
        system, METHODS[name], system.parameter_values(p), 0.0, np.concatenate([q, v]),
        frame_times=np.asarray(frame_times, dtype=float), rtol=rtol, atol=atol, step=step,
        with_events=False, log_length=50_000,
    )  # fmt: skip


def finished(arrays, t_end):
    assert arrays.advance(t_end, 50_000) == at.REACHED_STOP
    assert arrays.t == t_end
    return arrays


# Coefficients


def exact_method(s):
    """Nodes, a, T, its inverse, μ and ν from the definition, with 50 digits."""
    with mp.workdps(50):
        # The derivative of order s-1 of x^(s-1) (x-1)^s.
        powers = [(2 * s - 1 - k, mp.binomial(s, k) * (-1) ** k) for k in range(s + 1)]
        polynomial = [factor * mp.factorial(n) / mp.factorial(n - s + 1) for n, factor in powers]
        c = sorted(mp.re(x) for x in mp.polyroots(polynomial, maxsteps=200, extraprec=300))
        moments = mp.matrix(s, s)
        integrals = mp.matrix(s, s)
        for i in range(s):
            for k in range(s):
                moments[i, k], integrals[i, k] = c[i] ** k, c[i] ** (k + 1) / (k + 1)
        a = integrals * moments**-1
        values, vectors = mp.eig(a**-1)
        order = sorted(range(s), key=lambda i: mp.im(values[i]))
        columns, nu, mu = [], [], None
        for i in order:
            vector = [vectors[j, i] / vectors[s - 1, i] for j in range(s)]
            if abs(mp.im(values[i])) < mp.mpf(10) ** -30:
                mu = mp.re(values[i])
                columns.insert(0, [mp.re(x) for x in vector])
            elif mp.im(values[i]) > 0:
                nu.append(complex(mp.conj(values[i])))
                columns += [[mp.re(x) for x in vector], [mp.im(x) for x in vector]]
        transformation = mp.matrix(columns).T

        def floats(matrix):
            return np.array(matrix.tolist(), dtype=float)

        return (
            np.array(c, dtype=float), floats(a), floats(transformation), floats(transformation**-1), float(mu),
            np.array(nu),
        )  # fmt: skip


@pytest.mark.parametrize("s", N_STAGES)
def test_coefficients_are_those_of_the_definition(s):
    c, a, to_stages, from_stages, mu, nu = exact_method(s)
    method = radau(s)
    assert np.abs(np.array(method.c) - c).max() < 1e-16
    assert np.abs(method.a - a).max() < 1e-15
    assert np.abs(method.to_stages - to_stages).max() < 1e-16
    assert np.abs(method.from_stages / from_stages - 1.0).max() < 1e-15
    assert abs(method.mu / mu - 1.0) < 1e-15 and np.abs(method.nu / nu - 1.0).max() < 1e-15


def test_order_5_has_the_published_numbers():
    """Hairer, Wanner 1996, IV.8: table 5.6, the eigenvalues below (8.13), the error weights of (8.18)."""
    r, method = np.sqrt(6.0), radau(3)
    assert np.allclose(
        method.a[0], [(88 - 7 * r) / 360, (296 - 169 * r) / 1800, (-2 + 3 * r) / 225], atol=1e-15
    )
    assert method.mu == pytest.approx(3 + 3 ** (2 / 3) - 3 ** (1 / 3), rel=1e-15)
    assert np.allclose(method.error, [(-13 - 7 * r) / 3, (-13 + 7 * r) / 3, -1 / 3], rtol=1e-14)


@pytest.mark.parametrize("s", N_STAGES)
def test_coefficients_are_checked(s):
    method = radau(s)
    with pytest.raises(ValueError, match="uncouple"):
        validate(method._replace(mu=method.mu + 1e-8))
    with pytest.raises(ValueError, match="inverse"):
        validate(method._replace(to_stages=method.to_stages * (1 + 1e-8)))
    with pytest.raises(ValueError, match="error estimate"):
        validate(method._replace(error=method.error * (1 + 1e-8)))


# Orders and tolerances

# Steps at which errors are far from round-off, and from those of large steps.
STEP = {"radau5": (0.05, 0.0125), "radau9": (0.2, 0.1), "radau13": (0.4, 0.2)}


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", NAMES)
def test_observed_order_of_steps_and_frames(name, model):
    times = np.linspace(0.0, T_END, 54)[1:]
    exact, errors, between = reference(model, times), [], []
    steps = (0.8, 0.4) if (name, model) == ("radau13", "oscillator") else STEP[name]
    for h in steps:
        arrays = loop(fixture(model), name, t_end=T_END, rtol=1e6, atol=1e6, step=h, frame_times=times[:-1])
        arrays.control[at.H_MAX], arrays.control[at.NEWTON_TOL] = h, 1e-15
        finished(arrays, T_END)
        errors.append(np.abs(arrays.y - exact[-1]).max())
        between.append(np.abs(arrays.frames - exact[:-1]).max())
    doublings, order = np.log2(steps[0] / steps[1]), METHODS[name].order
    assert errors[1] > 1e-12, "too close to round-off to observe an order"
    assert 0.85 * order < np.log2(errors[0] / errors[1]) / doublings < order + 1.5
    assert np.log2(between[0] / between[1]) / doublings > 0.8 * METHODS[name].dense_order


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", NAMES[1:])
def test_error_follows_the_tolerance(name, model):
    exact, n_steps = reference(model, [T_END])[0], []
    for rtol in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        arrays = finished(loop(fixture(model), name, t_end=T_END, rtol=rtol, atol=0.01 * rtol), T_END)
        assert np.abs(arrays.y - exact).max() < 5.0 * rtol + 2e-14
        n_steps.append(arrays.counters[at.STEPS])
    # The estimate is of order s, and its tolerance rtol^((s+1)/(2s)): a digit costs 10^(1/(2s)) as many steps.
    assert n_steps[0] < n_steps[4] < 3.0 * 10 ** (8 / (2 * METHODS[name].dense_order)) * n_steps[0]


@pytest.mark.parametrize("name", NAMES[1:])
def test_high_order_pays(name):
    """Of the work of radau5 at a tight tolerance, a third or less."""
    calls = {}
    for each in ("radau5", name):
        arrays = finished(loop(fixture("pendulum"), each, t_end=T_END, rtol=1e-11, atol=1e-13), T_END)
        calls[each] = arrays.counters[at.RHS_CALLS]
    assert calls[name] < calls["radau5"] / 3


@pytest.mark.parametrize("name", NAMES[1:])
def test_quaternions(name):
    system = load(module_text("heavy_top"))
    ours = system.run(t_end=0.5, method=name, rtol=1e-10, atol=1e-12, at=[0.5])
    oracle = system.run(t_end=0.5, method="dop853", rtol=1e-13, atol=1e-15, at=[0.5])
    for a, b in ((ours.samples[0].q, oracle.samples[0].q), (ours.samples[0].v, oracle.samples[0].v)):
        assert np.abs(a - b).max() < 1e-8 * np.abs(b).max()


# Stiff problems


@pytest.mark.parametrize("name", NAMES[1:])
def test_stiff_bushing(name):
    """Eigenvalues -2e3 ± 2.4e4 i beside a swing of about 1 s."""
    system, expected = fixture("stiff_bushing"), load_reference("stiff_bushing_pendulum")["reference_q_v"]
    arrays = loop(system, name, t_end=1.0, rtol=1e-10, atol=1e-12)
    for t in (0.1, 1.0):
        finished(arrays, t)
        assert np.abs(arrays.y[:6] - numbers(expected[str(t)])).max() < 1e-8
    assert arrays.counters[at.STEPS] < 300, "radau5 needs 600"
    energy = system.kernel("energy")(0.0, arrays.y[:6], arrays.p).sum()
    assert abs(energy - arrays.y[6]) < 1e-8, "energy minus the damper's work stays at its start, 0"


@pytest.mark.parametrize("name", NAMES)
def test_round_off_of_a_stiff_spring_is_recognised(name):
    """k = 1e9, damped: at this tolerance the round-off of positions is what Newton's corrections end in."""
    system = load(ROOT / "generated" / "damped_spring_pendulum.py")
    data = json.loads((ROOT / "models" / "references" / "damped_spring.json").read_text())
    arrays = loop(system, name, t_end=data["t_end"], rtol=1e-11, atol=1e-13, p=data["parameters"])
    finished(arrays, data["t_end"])
    exact = np.array([float(x) for key in "qv" for x in data["end"][key]])
    size = np.repeat([data["size"]["q"], data["size"]["v"]], 2)
    assert np.max(np.abs(arrays.y[:4] - exact) / size) < 3e-9
    assert arrays.counters[at.STEPS] < 6000, "fighting round-off takes tens of thousands"
    assert arrays.counters[at.REJECTED] < 0.3 * arrays.counters[at.STEPS]


@pytest.mark.parametrize("name", NAMES[1:])
def test_stiff_van_der_pol_oscillator(name):
    mu, t_end = 1000.0, 1500.0

    def f(t, y):
        return [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]]

    def jacobian(t, y):
        return [[0.0, 1.0], [-2 * mu * y[0] * y[1] - 1.0, mu * (1 - y[0] ** 2)]]

    oracle = solve_ivp(f, (0, t_end), [2.0, 0.0], "Radau", rtol=1e-9, atol=1e-12, jac=jacobian)
    arrays = finished(
        loop(fixture("van_der_pol"), name, t_end=t_end, rtol=1e-9, atol=1e-12, p={"mu": mu}), t_end
    )
    assert np.abs(arrays.y[:2] - oracle.y[:, -1]).max() < 1e-6
    assert arrays.counters[at.STEPS] < len(oracle.t) / 3


@pytest.mark.parametrize(("name", "rtol"), [("radau9", 1e-6), ("radau13", 1e-8)])
@pytest.mark.parametrize(("k", "damping"), [(1e7, 0.7), (3e8, 0.3), (2e9, 1.0)])
def test_steps_of_a_turning_stiff_spring_are_those_of_its_swing(name, rtol, k, damping):
    """With the matrix of the start of a step for all stages, Newton needs up to 900 steps, the stiffer the more."""
    system = load(ROOT / "generated" / "damped_spring_pendulum.py")
    p = {"k": k, "c": 2.0 * damping * np.sqrt(k)}
    oracle = finished(loop(system, "taylor", t_end=2.0, rtol=1e-12, atol=1e-14, p=p), 2.0)
    arrays = finished(loop(system, name, t_end=2.0, rtol=rtol, atol=1e-2 * rtol, p=p), 2.0)
    assert np.abs(arrays.y[:4] - oracle.y[:4]).max() < 3e-5
    assert arrays.counters[at.STEPS] < 200
    assert arrays.counters[COUPLED] or arrays.counters[PATIENCE]


@pytest.mark.parametrize("name", NAMES)
def test_stages_stay_uncoupled_where_that_gains_nothing(name):
    """Van der Pol's coordinate is one, and the oscillator's force a straight line: nothing turns."""
    for fixed, t_end in (("van_der_pol", 20.0), ("oscillator", 20.0)):
        arrays = finished(loop(fixture(fixed), name, t_end=t_end, rtol=1e-6), t_end)
        assert not arrays.counters[COUPLED] and not arrays.counters[PATIENCE], fixed


@pytest.mark.parametrize("n_stages", N_STAGES)
def test_newton_of_coupled_stages_is_quadratic(n_stages):
    """Each correction leaves the square of the last, which holds for the right derivatives only."""
    arrays = loop(fixture("stiff_bushing"), f"radau{2 * n_stages - 1}", t_end=1.0)
    method, record, h = arrays.coefficients, arrays.loop(), 0.01
    w = radau_work.py_func(method, record.sizes, record.work)
    record.y[3:6] = 0.5, -0.3, 2.0
    w.states[STAGES:] = 0.0
    set_tolerances(method, record, w)
    retract_positions(method, h, record.sizes, record.y, w)
    sizes = []
    for _ in range(8):
        status, size = correct_coupled_stages(method, h, record, 0.0, w)
        assert status == at.RUNNING
        sizes.append(size)
    assert sizes[-1] < 1e-6 * sizes[0]


# Events and calls


@pytest.mark.parametrize("name", NAMES[1:])
def test_events_are_located(name):
    run = {"t_end": 3.0, "at": [3.0]}
    ours = fixture("oscillator").run(method=name, rtol=1e-12, atol=1e-14, **run)
    oracle = fixture("oscillator").run(method="dop853", rtol=1e-12, atol=1e-14, **run)
    assert ours.status == oracle.status == "success"
    assert len(ours.events) == len(oracle.events) > 5
    # Within a step the collocation polynomial counts, whose order is that of the estimate.
    assert max(abs(a.t - b.t) for a, b in zip(ours.events, oracle.events, strict=True)) < 3e-7


@pytest.mark.parametrize("name", NAMES[1:])
def test_loop_carries_its_state_from_call_to_call(name):
    system = fixture("stiff_bushing")
    whole = finished(loop(system, name, t_end=0.1), 0.1)
    parts = loop(system, name, t_end=0.1)
    while parts.advance(0.1, 1) == at.RUNNING:
        pass
    assert np.array_equal(parts.y, whole.y)
    assert np.array_equal(parts.counters[: at.PROJECTIONS], whole.counters[: at.PROJECTIONS])
