"""Gauss collocation: coefficients, orders, frames, symplecticity, energy of long runs, stiff models, failures."""

from __future__ import annotations

from pathlib import Path

import mpmath
import numpy as np
import pytest
from fixture_motions import MODELS, T_END, doubles, python_kernel, reference
from references import load_reference, numbers
from scipy.special import ellipk

from symgen.runtime import load
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.gauss.coefficients import gauss
from symgen.runtime.integrate.gauss.stages import STIFF
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays

FIXTURES = Path(__file__).parent / "fixtures"
GENERATED = Path(__file__).parents[1] / "generated"
STEP = {4: 0.05, 6: 0.1, 8: 0.1, 10: 0.2}


def fixture(name):
    return load(FIXTURES / f"{name}.py")


def loop(system, order, h, *, t_end=T_END, state=None, p=None, frame_times=(), rtol=1e-8, atol=1e-10):
    q, v, _, _ = system.initial_state()
    return LoopArrays(
        system, METHODS[f"gauss{order}"], system.parameter_values() if p is None else p, 0.0,
        np.concatenate([q, v]) if state is None else np.asarray(state, dtype=float),
        frame_times=np.asarray(frame_times, dtype=float), rtol=rtol, atol=atol, step=h,
        with_events=False, log_length=1 << 17,
    )  # fmt: skip


def finished(arrays, t_end):
    assert arrays.advance(t_end, 1 << 17) == at.REACHED_STOP
    assert arrays.t == t_end
    return arrays


# Coefficients


@pytest.mark.parametrize("n_stages", range(2, 9))
def test_coefficients_are_those_of_collocation(n_stages):
    """Nodes from the roots of Legendre's polynomial, a and b by integrating Lagrange's, all with 40 digits."""
    method = gauss(n_stages)
    with mpmath.workdps(40):
        coefficients = mpmath.taylor(lambda x: mpmath.legendre(n_stages, x), 0, n_stages)[::-1]
        roots = mpmath.polyroots(coefficients, maxsteps=200, extraprec=200)
        nodes = sorted((1 + mpmath.re(x)) / 2 for x in roots)

        def lagrange(j, x):
            return mpmath.fprod((x - c) / (nodes[j] - c) for k, c in enumerate(nodes) if k != j)

        for j in range(n_stages):
            b = mpmath.quad(lambda x, j=j: lagrange(j, x), [0, 1])
            assert method.c[j] == pytest.approx(float(nodes[j]), rel=3e-16)
            assert method.b[j] == pytest.approx(float(b), rel=3e-16)
            for i in range(n_stages):
                a = mpmath.quad(lambda x, j=j: lagrange(j, x), [0, nodes[i]])
                assert method.mu[j, i] == pytest.approx(float(a / b), rel=3e-16, abs=2e-16)


@pytest.mark.parametrize("n_stages", range(2, 9))
def test_coefficients_are_symplectic_to_the_last_bit_and_symmetric(n_stages):
    method = gauss(n_stages)
    assert np.array_equal(method.mu + method.mu.T, np.ones((n_stages, n_stages)))
    assert np.abs(method.mu + method.mu[::-1, ::-1] - 1.0).max() < 3e-16
    a = method.mu.T * method.b
    uncoupled = (method.to_stages * method.eigenvalues @ method.from_stages).real
    assert np.abs(uncoupled - a).max() < 1e-11


# Orders


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("order", STEP)
def test_observed_order(order, model):
    exact = reference(model, [T_END])[0]
    # Coarse steps and high orders come down to round-off after one halving.
    steps = [STEP[order] / k for k in ((1, 2) if order > 6 else (1, 2, 4))]
    errors = [np.abs(finished(loop(fixture(model), order, h), T_END).y - exact).max() for h in steps]
    observed = np.log2(errors[0] / errors[-1]) / (len(errors) - 1)
    assert errors[-1] > 2e-14, "too close to round-off to observe an order"
    assert order - 0.6 < observed < order + 2.5, (observed, errors)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("order", [4, 8, 16])
def test_frames_are_as_accurate_as_steps(order, model):
    h = {4: 0.05, 8: 0.1, 16: 0.4}[order]
    times = np.linspace(0.0, T_END, 54)[1:-1]
    arrays = finished(loop(fixture(model), order, h, frame_times=times), T_END)
    assert arrays.counters[at.NEXT_FRAME] == len(times)
    exact = reference(model, [*times, T_END])
    end = np.abs(arrays.y - exact[-1]).max()
    assert np.abs(arrays.frames - exact[:-1]).max() < 30.0 * end + 3e-13


@pytest.mark.parametrize("order", [4, 8, 16])
def test_events_are_found_on_the_collocation_polynomial(order):
    run = {"t_end": 3.0, "at": [3.0]}
    ours = fixture("oscillator").run(method=f"gauss{order}", step=0.01, **run)
    oracle = fixture("oscillator").run(method="dop853", rtol=1e-12, atol=1e-14, **run)
    assert ours.status == oracle.status == "success"
    assert len(ours.events) == len(oracle.events) > 5
    limit = 2e-4 if order == 4 else 1e-8
    assert (
        np.abs(np.array([a.t - b.t for a, b in zip(ours.events, oracle.events, strict=True)])).max() < limit
    )


# Structure


def henon_heiles(t, y, p, out):
    x, z = doubles(y)[0], doubles(y)[1]
    doubles(out)[0], doubles(out)[1] = doubles(y)[2], doubles(y)[3]
    doubles(out)[2], doubles(out)[3] = -x - 2.0 * x * z, -z - x * x + z * z


def test_flow_of_a_constant_mass_is_symplectic_and_reversible():
    """The derivative of a large step of Hénon and Heiles' oscillators, by differences of order 4."""
    system, h = fixture("double_pendulum"), 0.7  # of the same size
    address, keep = python_kernel(henon_heiles)

    def flow(x):
        arrays = loop(system, 4, h, t_end=h, state=x)
        arrays.addresses[at.RHS] = address
        return finished(arrays, h).y

    x, columns = np.array([0.3, -0.2, 0.25, 0.35]), []
    for e in 1e-3 * np.eye(4):
        columns.append((flow(x - 2 * e) - 8 * flow(x - e) + 8 * flow(x + e) - flow(x + 2 * e)) / 12e-3)
    derivative = np.array(columns).T
    form = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])
    assert np.abs(derivative.T @ form @ derivative - form).max() < 1e-11
    mirror = np.array([1, 1, -1, -1])
    assert np.abs(mirror * flow(mirror * flow(x)) - x).max() < 1e-15 and keep is not None


def test_large_steps_of_a_changing_mass_are_reversible():
    system, h, mirror = fixture("double_pendulum"), 0.2, np.array([1, 1, -1, -1])
    start = np.array([0.9, -0.4, 0.7, 1.1])
    end = finished(loop(system, 4, h, t_end=h, state=start), h).y
    back = finished(loop(system, 4, h, t_end=h, state=mirror * end), h).y
    assert np.abs(mirror * back - start).max() < 1e-14


def test_energy_of_a_long_run_stays_at_round_off():
    """10 000 periods with order 16: errors of random sign, 2e-16 for each step, add up as the square root."""
    system = fixture("pendulum")
    period = 4.0 * np.sqrt(0.5 / 9.81) * ellipk(np.sin(0.75) ** 2)
    arrays = loop(system, 16, period / 14, t_end=1e4 * period)
    energy = system.kernel("energy")
    start = energy(0.0, arrays.y, arrays.p).sum()
    errors = []
    while arrays.advance(1e4 * period, 2000) == at.RUNNING:
        errors.append(abs(energy(0.0, arrays.y, arrays.p).sum() - start) / 9.81)
    assert max(errors) < 2e-16 * np.sqrt(14e4)
    assert arrays.counters[STIFF] == 0


def test_work_is_integrated_with_the_motion():
    system = fixture("oscillator")
    arrays = finished(loop(system, 12, 0.05, t_end=2.0), 2.0)
    gap = system.kernel("energy")(2.0, arrays.y[:2], arrays.p).sum() - 0.125 - arrays.y[2]
    assert abs(gap) < 1e-14


def test_constraints_hold_and_energy_stays_near():
    system = fixture("cartesian_pendulum")
    arrays = loop(system, 8, 0.02, t_end=200.0)
    energy = system.kernel("energy")
    start = energy(0.0, arrays.y, arrays.p).sum()
    finished(arrays, 200.0)
    assert np.abs(system.kernel("constraint_residual")(0.0, arrays.y, arrays.p)).max() < 1e-13
    assert abs(energy(0.0, arrays.y, arrays.p).sum() - start) < 1e-9


def test_projection_leaves_the_energy_of_a_mechanism_at_round_off():
    """A four-bar through 100 000 steps: what rounding drops in a step is not forgotten when the step is projected."""
    system, t_end = load(GENERATED / "four_bar.py"), 200.0
    start = assemble(system, system.parameter_values())
    arrays = loop(system, 12, 2e-3, t_end=t_end, state=np.append(start.q, start.v))
    energy = system.kernel("energy")
    kinetic, potential = energy(0.0, arrays.y, arrays.p)
    errors = []
    while arrays.advance(t_end, 2000) == at.RUNNING:
        errors.append(abs(energy(0.0, arrays.y, arrays.p).sum() - kinetic - potential) / kinetic)
    assert len(errors) == 49 and max(errors) < 1e-11


# Stiff models


def test_newton_takes_over_where_substitution_fails():
    """A bushing that vibrates with 2.4e4 rad/s: 24 radians in a step."""
    system, expected = fixture("stiff_bushing"), load_reference("stiff_bushing_pendulum")["reference_q_v"]
    arrays = finished(loop(system, 8, 1e-3, t_end=0.1), 0.1)
    assert np.abs(arrays.y[:6] - numbers(expected["0.1"])).max() < 1e-9
    assert arrays.counters[STIFF] == 1
    assert 0 < arrays.counters[at.JACOBIANS] < 50
    assert arrays.counters[at.NEWTON_ITERATIONS] < 12 * arrays.counters[at.STEPS]


def test_newton_turns_bodies_as_substitution_does():
    ends = []
    for stiff in (0, 1):
        arrays = loop(load(GENERATED / "free_rigid_body.py"), 8, 0.1)
        arrays.counters[STIFF] = stiff
        ends.append(finished(arrays, T_END).y.copy())
        # Newton's matrices, one for each eigenvalue, hold what the turns change: few iterations do.
        assert arrays.counters[at.NEWTON_ITERATIONS] <= 10 * arrays.counters[at.STEPS]
    assert ends[1] == pytest.approx(ends[0], rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("n_steps", [1, 7])
def test_loop_carries_its_state_from_call_to_call(n_steps):
    system = fixture("stiff_bushing")
    whole = finished(loop(system, 8, 1e-3, t_end=0.03), 0.03)
    parts = loop(system, 8, 1e-3, t_end=0.03)
    while parts.advance(0.03, n_steps) == at.RUNNING:
        pass
    assert np.array_equal(parts.y, whole.y)


# Failures


def test_a_wall_in_the_equations_is_reported():
    def rhs(t, y, p, out):
        doubles(out)[0] = doubles(y)[1]
        doubles(out)[1] = -doubles(y)[0] if t < 0.5 else np.nan

    arrays = loop(fixture("pendulum"), 8, 0.01, t_end=1.0)
    arrays.addresses[at.RHS], keep = python_kernel(rhs)
    assert arrays.advance(1.0, 50_000) == at.NOT_FINITE and keep is not None
    assert 0.48 < arrays.t <= 0.5


def test_newton_that_cannot_converge_is_reported():
    """The Jacobian has the wrong sign and size: iterations run away from the solution."""

    def rhs(t, y, p, out):
        doubles(out)[0] = doubles(y)[1]
        doubles(out)[1] = -1e6 * doubles(y)[0]

    def residual_jacobian(t, y, p, out):
        doubles(out)[0], doubles(out)[1], doubles(out)[2] = -9e5, 0.0, 1.0

    arrays = loop(fixture("pendulum"), 8, 0.1, t_end=1.0)
    arrays.addresses[at.RHS], keep = python_kernel(rhs)
    arrays.addresses[at.RESIDUAL_JACOBIAN], keep_too = python_kernel(residual_jacobian)
    assert arrays.advance(1.0, 50_000) == at.NEWTON_FAILED and keep is not None and keep_too is not None
