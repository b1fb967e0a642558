"""Implicit methods: Jacobians, orders, stiff problems, what is carried from call to call, failures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fixture_motions import T_END, doubles, python_kernel, reference
from loops import bare_loop
from references import load_reference, numbers
from scipy.integrate import solve_ivp

from symgen.runtime import load
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.jacobian import acceleration_jacobian, jacobian_work_size
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays, loop_sizes

FIXTURES = Path(__file__).parent / "fixtures"
STEP = {"implicit_euler": 4e-4, "implicit_midpoint": 4e-3, "radau5": 0.05}


def fixture(name):
    return load(FIXTURES / f"{name}.py")


def loop(
    system, name, *, t_end, rtol=1e-8, atol=1e-10, step=0.0, p=None, state=None, frame_times=(), newton=0.0
):
    """Arrays of a run that is yet to begin."""
    q, v, _, _ = system.initial_state()
    arrays = LoopArrays(
        system, METHODS[name], system.parameter_values() if p is None else p, 0.0,
        np.concatenate([q, v]) if state is None else np.asarray(state, dtype=float),
        frame_times=np.asarray(frame_times, dtype=float), rtol=rtol, atol=atol, step=step,
        with_events=False, log_length=50_000,
    )  # fmt: skip
    arrays.control[at.NEWTON_TOL] = newton
    return arrays


def finished(arrays, t_end):
    assert arrays.advance(t_end, 50_000) == at.REACHED_STOP
    assert arrays.t == t_end
    return arrays


def fixed_steps(system, name, h, **options):
    """Steps of h with any method: an adaptive one is given no reason to take others."""
    arrays = loop(system, name, t_end=T_END, rtol=1e6, atol=1e6, step=h, newton=1e-15, **options)
    arrays.control[at.H_MAX] = h
    return finished(arrays, T_END)


# Jacobians


def jacobian_at(system, t, state, p, residual_jacobian=0, row=None):
    """[∂a/∂q, ∂a/∂v] as the integrators have it."""
    sizes = loop_sizes(system, with_events=False)
    addresses = np.zeros(at.N_KERNELS, dtype=np.uint64)
    addresses[at.RESIDUAL_JACOBIAN] = residual_jacobian or system.kernel("residual_jacobian").address
    work = np.zeros(jacobian_work_size(sizes))
    row = system.kernel("rhs")(t, state, p) if row is None else row
    out = np.zeros((system.nv, system.nq + system.nv))
    bare = bare_loop(sizes, p, addresses, np.concatenate([state, np.zeros(system.nw)]))
    status = acceleration_jacobian(bare, t, bare.y, row, work, out)
    assert bare.counters[at.JACOBIANS] == 1
    return status, out


def differences(system, t, state, p):
    """The same by central differences of order 4."""
    rhs = system.kernel("rhs")
    columns = []
    for i in range(len(state)):
        e = np.zeros(len(state))
        e[i] = 1e-3 * max(1.0, abs(state[i]))
        a = [rhs(t, state + k * e, p)[system.nq : system.nq + system.nv] for k in (-2, -1, 1, 2)]
        columns.append((a[0] - 8 * a[1] + 8 * a[2] - a[3]) / (12 * e[i]))
    return np.array(columns).T


@pytest.mark.parametrize(
    "name",
    ["pendulum", "double_pendulum", "oscillator", "cartesian_pendulum", "stiff_bushing", "van_der_pol"],
)
def test_jacobian_agrees_with_differences_of_the_accelerations(name):
    system, random = fixture(name), np.random.default_rng(7)
    for _ in range(3):
        state = random.uniform(-1.2, 1.2, system.nq + system.nv)
        p = system.parameter_values()
        status, jacobian = jacobian_at(system, 0.3, state, p)
        expected = differences(system, 0.3, state, p)
        assert status == at.RUNNING
        assert np.abs(jacobian - expected).max() < 1e-8 * max(1.0, np.abs(expected).max())


def test_jacobian_survives_redundant_constraints():
    redundant, plain = fixture("redundant_pendulum"), fixture("cartesian_pendulum")
    # On the manifold: off it, constraints that depend on each other contradict each other.
    state, p = np.array([0.3, -0.4, 0.8, 0.6]), plain.parameter_values()
    row = plain.kernel("rhs")(0.0, state, p)
    multipliers = row[4] / 10.0 * np.array([1.0, 3.0])
    status, jacobian = jacobian_at(redundant, 0.0, state, p, row=np.array([*row[:4], *multipliers, 0.0]))
    assert status == at.RUNNING
    # Differences of either constraint agree along the manifold.
    tangents = np.zeros((4, 3))
    tangents[:2, 0], tangents[2:, 0] = [0.4, 0.3], [0.6, -0.8]  # q moves, and v with it: G v = 0 goes on
    tangents[2:, 1] = [0.4, 0.3]
    expected = jacobian_at(plain, 0.0, state, p)[1]
    assert np.allclose(jacobian @ tangents, expected @ tangents, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_radau_runs_with_redundant_constraints():
    options = {"t_end": 1.0, "method": "radau5", "rtol": 1e-9, "at": [1.0]}
    redundant, plain = (fixture(name).run(**options) for name in ("redundant_pendulum", "cartesian_pendulum"))
    assert redundant.status == plain.status == "success"
    assert np.abs(redundant.samples[-1].q - plain.samples[-1].q).max() < 1e-8


def test_jacobian_of_a_coordinate_without_mass():
    """A mass on a spring, x = sin s; s has no mass: a_x = -k x / m, a_s = (a_x + sin(s) s'²) / cos(s), λ = 0."""
    k, (x, s, u, w) = 40.0, (np.sin(0.4), 0.4, 1.3 * np.cos(0.4), 1.3)
    a_x = -k * x
    a_s = (a_x + np.sin(s) * w**2) / np.cos(s)

    def residual_jacobian(t, y, p, out):
        rows = np.zeros((3, 7))  # of a_x + k x - λ, cos(s) λ, a_x - cos(s) a_s + sin(s) s'²
        rows[0, [0, 4, 6]] = k, 1.0, -1.0
        rows[1, 6] = np.cos(s)
        rows[2, [1, 3, 4, 5]] = np.sin(s) * a_s + np.cos(s) * w**2, 2.0 * np.sin(s) * w, 1.0, -np.cos(s)
        for i, value in enumerate(rows.ravel()):
            doubles(out)[i] = value

    system = fixture("cartesian_pendulum")  # of the same sizes
    address, keep = python_kernel(residual_jacobian)
    row = np.array([u, w, a_x, a_s, 0.0, 1.0])
    status, jacobian = jacobian_at(system, 0.0, np.array([x, s, u, w]), np.zeros(3), address, row)
    by_s = (np.cos(s) * w**2 + np.tan(s) * (a_x + np.sin(s) * w**2)) / np.cos(s)
    expected = [[-k, 0.0, 0.0, 0.0], [-k / np.cos(s), by_s, 0.0, 2.0 * np.tan(s) * w]]
    assert status == at.RUNNING and keep is not None
    assert np.allclose(jacobian, expected, rtol=1e-12, atol=1e-12)


# Orders


@pytest.mark.parametrize("model", ["pendulum", "cartesian_pendulum", "oscillator"])
@pytest.mark.parametrize("name", STEP)
def test_observed_order(name, model):
    exact = reference(model, np.array([T_END]))[0]
    errors = [
        np.abs(fixed_steps(fixture(model), name, h).y - exact).max() for h in (STEP[name], STEP[name] / 4)
    ]
    observed = np.log2(errors[0] / errors[1]) / 2
    assert errors[1] > 1e-12, "too close to round-off to observe an order"
    assert 0.92 * METHODS[name].order < observed < METHODS[name].order + 1.0


@pytest.mark.parametrize("model", ["pendulum", "cartesian_pendulum", "oscillator"])
@pytest.mark.parametrize("name", STEP)
def test_dense_output_order(name, model):
    """The interpolant adds an error of its own order to that of the steps."""
    times = np.linspace(0.0, T_END, 203)[1:-1]
    exact = reference(model, times)
    errors = []
    for h in (STEP[name], STEP[name] / 4):
        frames = fixed_steps(fixture(model), name, h, frame_times=times).frames
        errors.append(np.abs(frames - exact).max())
    assert np.log2(errors[0] / errors[1]) / 2 > 0.9 * METHODS[name].dense_order


def test_frames_are_on_the_constraints():
    system = fixture("cartesian_pendulum")
    arrays = finished(
        loop(system, "radau5", t_end=2.0, rtol=1e-5, frame_times=np.linspace(0.01, 1.99, 77)), 2.0
    )
    residual = system.kernel("constraint_residual")
    assert max(np.abs(residual(0.0, y, arrays.p)).max() for y in arrays.frames) < 1e-12


# radau5


@pytest.mark.parametrize("model", ["pendulum", "cartesian_pendulum", "oscillator"])
def test_radau_error_follows_the_tolerance(model):
    exact = reference(model, np.array([T_END]))[0]
    n_steps = []
    for rtol in (1e-4, 1e-6, 1e-8, 1e-10):
        arrays = finished(loop(fixture(model), "radau5", t_end=T_END, rtol=rtol, atol=0.01 * rtol), T_END)
        assert np.abs(arrays.y - exact).max() < 5.0 * rtol
        n_steps.append(arrays.counters[at.STEPS])
    # One digit more costs 10^(1/6) as many steps, since the estimate is of order 3, with tolerance rtol^(2/3).
    assert 1.4 < (n_steps[3] / n_steps[1]) ** 0.5 < 2.8


def test_radau_on_a_stiff_bushing():
    """Eigenvalues -2e3 ± 2.4e4 i beside a swing of about 1 s."""
    system, expected = fixture("stiff_bushing"), load_reference("stiff_bushing_pendulum")["reference_q_v"]
    arrays = loop(system, "radau5", t_end=1.0, rtol=1e-10, atol=1e-12)
    for t in (0.1, 1.0):
        finished(arrays, t)
        assert np.abs(arrays.y[:6] - numbers(expected[str(t)])).max() < 1e-8
    counts = arrays.counters
    assert counts[at.STEPS] < 2500, "explicit methods need 1e4"
    assert counts[at.JACOBIANS] < 0.7 * counts[at.STEPS]
    assert counts[at.REJECTED] < 0.2 * counts[at.STEPS]
    energy = system.kernel("energy")(0.0, arrays.y[:6], arrays.p).sum()
    assert abs(energy - arrays.y[6]) < 1e-8, "energy minus the damper's work stays at its start, 0"


@pytest.mark.parametrize("mu, t_end", [(30.0, 60.0), (1000.0, 1500.0)])
def test_radau_on_a_stiff_van_der_pol_oscillator(mu, t_end):
    def f(t, y):
        return [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]]

    def jacobian(t, y):
        return [[0.0, 1.0], [-2 * mu * y[0] * y[1] - 1.0, mu * (1 - y[0] ** 2)]]

    oracle = solve_ivp(f, (0, t_end), [2.0, 0.0], "Radau", rtol=1e-9, atol=1e-12, jac=jacobian)
    arrays = loop(fixture("van_der_pol"), "radau5", t_end=t_end, rtol=1e-10, atol=1e-13, p=np.array([mu]))
    finished(arrays, t_end)
    assert np.abs(arrays.y[:2] - oracle.y[:, -1]).max() < 1e-6
    assert arrays.counters[at.STEPS] < len(oracle.t)


def test_events_are_located_in_radau_steps():
    mu = 30.0

    def f(t, y):
        return [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]]

    def middle(t, y):
        return y[0]

    oracle = solve_ivp(f, (0, 120.0), [2.0, 0.0], "LSODA", rtol=1e-11, atol=1e-13, events=middle).t_events[0]
    solution = fixture("van_der_pol").run(t_end=120.0, method="radau5", rtol=1e-9, parameters={"mu": mu})
    assert solution.status == "success"
    assert len(oracle) > 3
    assert np.allclose([event.t for event in solution.events], oracle, rtol=1e-6)


def test_loop_carries_its_state_from_call_to_call():
    system = fixture("stiff_bushing")
    whole = finished(loop(system, "radau5", t_end=0.3), 0.3)
    parts = loop(system, "radau5", t_end=0.3)
    while parts.advance(0.3, 1) == at.RUNNING:
        pass
    assert np.array_equal(parts.y, whole.y)
    assert np.array_equal(parts.counters[: at.PROJECTIONS], whole.counters[: at.PROJECTIONS])


def test_stop_times_do_not_shorten_later_steps():
    system = fixture("pendulum")
    free = finished(loop(system, "radau5", t_end=4.0), 4.0).counters[at.STEPS]
    arrays = loop(system, "radau5", t_end=4.0)
    for stop in np.linspace(0.0, 4.0, 21)[1:]:
        finished(arrays, stop)
    assert arrays.counters[at.STEPS] < free + 2 * 20


# One-stage methods


def test_midpoint_conserves_quadratic_energy_with_one_factorisation():
    system = fixture("oscillator")
    p = system.parameter_values({"c": 0.0, "amplitude": 0.0})
    arrays = finished(loop(system, "implicit_midpoint", t_end=100.0, step=0.01, p=p), 100.0)
    energy = system.kernel("energy")(0.0, arrays.y[:2], p).sum()
    assert abs(energy / 0.125 - 1.0) < 1e-11
    assert abs(arrays.y[2]) < 1e-14
    assert arrays.counters[at.JACOBIANS] == 1
    assert arrays.counters[at.FACTORISATIONS] == 1
    assert arrays.counters[at.NEWTON_ITERATIONS] < 2.1 * arrays.counters[at.STEPS]


def test_euler_is_stable_at_steps_far_above_the_fastest_period():
    system = fixture("stiff_bushing")
    arrays = finished(loop(system, "implicit_euler", t_end=1.0, step=1e-3), 1.0)
    expected = numbers(load_reference("stiff_bushing_pendulum")["reference_q_v"]["1.0"])
    assert arrays.counters[at.STEPS] == 1000
    assert np.abs(arrays.y[:6] - expected).max() < 0.05


@pytest.mark.parametrize("name", ["implicit_euler", "implicit_midpoint"])
def test_work_is_integrated_with_the_motion(name):
    """Work and energy differ by the method's error, not by Newton's."""
    system = fixture("oscillator")
    gaps = []
    for h in (0.004, 0.001):
        arrays = finished(loop(system, name, t_end=2.0, step=h), 2.0)
        gaps.append(abs(system.kernel("energy")(2.0, arrays.y[:2], arrays.p).sum() - 0.125 - arrays.y[2]))
    if name == "implicit_midpoint":
        assert max(gaps) < 1e-12, "exact for linear systems: quadratic energy, and power at the midpoint"
    else:
        assert 3.0 < gaps[0] / gaps[1] < 5.0


# Failures


@pytest.mark.parametrize(
    "name, step", [("implicit_euler", 0.01), ("implicit_midpoint", 0.01), ("radau5", 0.0)]
)
def test_a_wall_in_the_equations_is_reported(name, step):
    def rhs(t, y, p, out):
        doubles(out)[0] = doubles(y)[1]
        doubles(out)[1] = -doubles(y)[0] if t < 0.5 else np.nan

    arrays = loop(fixture("pendulum"), name, t_end=1.0, step=step)
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

    arrays = loop(fixture("pendulum"), "implicit_euler", t_end=1.0, step=0.1)
    arrays.addresses[at.RHS], keep = python_kernel(rhs)
    arrays.addresses[at.RESIDUAL_JACOBIAN], keep_too = python_kernel(residual_jacobian)
    assert arrays.advance(1.0, 50_000) == at.NEWTON_FAILED and keep is not None and keep_too is not None


@pytest.mark.parametrize("name, step", [("implicit_euler", 0.01), ("radau5", 0.0)])
def test_undetermined_accelerations_are_reported(name, step):
    def residual_jacobian(t, y, p, out):
        doubles(out)[0], doubles(out)[1], doubles(out)[2] = 1.0, 0.0, 0.0

    arrays = loop(fixture("pendulum"), name, t_end=1.0, step=step)
    arrays.addresses[at.RESIDUAL_JACOBIAN], keep = python_kernel(residual_jacobian)
    assert arrays.advance(1.0, 50_000) == at.SINGULAR_MATRIX and keep is not None
