"""Rodas5P: order conditions by trees, observed orders, stiff problems, tolerances, work, failures."""

from __future__ import annotations

import ctypes
import functools
from pathlib import Path

import numpy as np
import pytest
from references import load_reference, numbers
from scipy.integrate import solve_ivp

from symgen.runtime import load
from symgen.runtime.code.bridge import KERNEL_PROTOTYPE
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.integrate.rosenbrock.coefficients import original_coefficients, rodas5p, validate
from symgen.runtime.loop_arrays import LoopArrays

FIXTURES = Path(__file__).parent / "fixtures"
MODELS = ("pendulum", "cartesian_pendulum", "oscillator")
T_END = 0.8


def fixture(name):
    return load(FIXTURES / f"{name}.py")


def loop(system, *, t_end, rtol=1e-8, atol=1e-10, step=0.0, p=None, frame_times=()):
    q, v, _, _ = system.initial_state()
    return LoopArrays(
        system, METHODS["rodas5p"], system.parameter_values(p), 0.0, np.concatenate([q, v]),
        frame_times=np.asarray(frame_times, dtype=float), rtol=rtol, atol=atol, step=step,
        with_events=False, log_length=50_000,
    )  # fmt: skip


def finished(arrays, t_end):
    assert arrays.advance(t_end, 50_000) == at.REACHED_STOP
    assert arrays.t == t_end
    return arrays


def fixed_steps(system, h, **options):
    """Steps of h: the method is given no reason to take others."""
    arrays = loop(system, t_end=T_END, rtol=1e6, atol=1e6, step=h, **options)
    arrays.control[at.H_MAX] = h
    return finished(arrays, T_END)


def reference(name, times):
    """Independent solution: SciPy at round-off tolerance, written from the physics and not from the module."""

    def oscillator(t, y):
        force = 0.5 * np.sin(3.0 * t) - 0.2 * y[1]
        return [y[1], force - 25.0 * y[0], force * y[1]]

    def pendulum(t, y):
        return [y[1], -9.81 / 0.5 * np.sin(y[0])]

    starts = {
        "oscillator": [0.1, 0.0, 0.0],
        "pendulum": [1.5, 0.0],
        "cartesian_pendulum": [np.arctan2(0.3, 0.4), 0.0],
    }
    f = oscillator if name == "oscillator" else pendulum
    y = solve_ivp(f, (0, T_END), starts[name], "DOP853", rtol=1e-13, atol=1e-15, t_eval=times).y.T
    if name == "cartesian_pendulum":
        s, c, w = np.sin(y[:, 0]), np.cos(y[:, 0]), y[:, 1]
        y = np.column_stack([0.5 * s, -0.5 * c, 0.5 * c * w, 0.5 * s * w])
    return y


# Coefficients: a rooted tree is the sorted tuple of its branches.


@functools.cache
def trees(order):
    if order == 1:
        return ((),)
    found = set()
    for size in range(1, order):
        for branch in trees(size):
            for rest in trees(order - size):
                found.add(tuple(sorted((*rest, branch))))
    return tuple(sorted(found))


def size(tree):
    return 1 + sum(size(branch) for branch in tree)


def density(tree):
    return size(tree) * np.prod([density(branch) for branch in tree])


def elementary_weights(tree, alpha, beta):
    """Hairer, Wanner 1996, IV.7: singly branched vertices carry β = α + Γ, the others α."""
    matrix = beta if len(tree) == 1 else alpha
    factors = [matrix @ elementary_weights(branch, alpha, beta) for branch in tree]
    return np.prod([np.ones(len(alpha)), *factors], axis=0)


def weights(method):
    """The weights of the new state, of the embedded one, and of dense output, in terms of the original increments."""
    _, gamma = original_coefficients(method)
    new = method.a[7] + np.eye(8)[7]
    return new @ gamma, method.a[7] @ gamma, lambda m: m @ gamma


def test_trees_are_all_there():
    assert [len(trees(order)) for order in range(1, 6)] == [1, 1, 2, 4, 9]


def test_order_conditions():
    method = rodas5p()
    alpha, gamma = original_coefficients(method)
    b, embedded, _ = weights(method)
    for order in range(1, 6):
        for tree in trees(order):
            phi = elementary_weights(tree, alpha, alpha + gamma)
            assert b @ phi == pytest.approx(1 / density(tree), abs=2e-13)
            if order < 5:
                assert embedded @ phi == pytest.approx(1 / density(tree), abs=2e-13)


@pytest.mark.parametrize("theta", [0.2, 0.5, 0.9])
def test_order_conditions_of_dense_output(theta):
    method = rodas5p()
    alpha, gamma = original_coefficients(method)
    new, _, transform = weights(method)
    d2, d3, d4 = method.dense
    rest = 1.0 - theta
    b = theta * (new + rest * transform(d2 + theta * (d3 + rest * d4)))
    for order in range(1, 5):
        for tree in trees(order):
            phi = elementary_weights(tree, alpha, alpha + gamma)
            assert b @ phi == pytest.approx(theta**order / density(tree), abs=1e-12)


def test_stiffly_accurate_and_damping_fast_motions():
    """R(∞) = 0 and |R(iy)| <= 1 (L-stable)."""
    method = rodas5p()
    alpha, gamma = original_coefficients(method)
    b, _, _ = weights(method)
    beta, one = alpha + gamma, np.ones(8)

    def growth(z):
        return 1.0 + z * b @ np.linalg.solve(np.eye(8) - z * beta, one)

    assert abs(growth(-1e12)) < 1e-9
    assert max(abs(growth(1j * y)) for y in np.geomspace(1e-2, 1e4, 200)) < 1.0 + 1e-12


def test_coefficients_are_checked():
    method = rodas5p()
    with pytest.raises(ValueError, match="nodes"):
        validate(method._replace(nodes=method.nodes * (1 + 1e-9)))
    with pytest.raises(ValueError, match="slope"):
        validate(method._replace(slopes=method.slopes + 1e-9))


# Orders and tolerances


@pytest.mark.parametrize("model", MODELS)
def test_observed_order_of_steps_and_frames(model):
    times = np.linspace(0.0, T_END, 54)[1:]
    exact, errors, between = reference(model, times), [], []
    for h in (0.05, 0.0125):
        arrays = fixed_steps(fixture(model), h, frame_times=times[:-1])
        errors.append(np.abs(arrays.y - exact[-1]).max())
        between.append(np.abs(arrays.frames - exact[:-1]).max())
    assert 4.8 < np.log2(errors[0] / errors[1]) / 2 < 6.3
    assert 4.5 < np.log2(between[0] / between[1]) / 2


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10])
def test_error_follows_the_tolerance(model, rtol):
    arrays = finished(loop(fixture(model), t_end=T_END, rtol=rtol, atol=rtol), T_END)
    assert np.abs(arrays.y - reference(model, [T_END])[0]).max() < 10.0 * rtol
    assert arrays.counters[at.REJECTED] < 6
    assert arrays.counters[at.JACOBIANS] == arrays.counters[at.STEPS]


def test_explicit_time_is_differentiated():
    """Without the derivative by time the order would be lost, whatever the step."""
    system, exact = fixture("oscillator"), reference("oscillator", [T_END])[0]
    arrays = loop(system, t_end=T_END, rtol=1e6, atol=1e6, step=0.0125)
    arrays.control[at.H_MAX] = 0.0125
    arrays.coefficients = rodas5p(time_dependent=False)
    blind = np.abs(finished(arrays, T_END).y - exact).max()
    assert blind > 1e3 * np.abs(fixed_steps(system, 0.0125).y - exact).max()


def test_work_is_integrated_with_the_motion():
    system = fixture("oscillator")
    arrays = finished(loop(system, t_end=5.0, rtol=1e-10, atol=1e-12), 5.0)
    gap = system.kernel("energy")(5.0, arrays.y[:2], arrays.p).sum() - 0.125 - arrays.y[2]
    assert abs(gap) < 1e-10


def test_frames_and_end_are_on_the_constraints():
    system = fixture("cartesian_pendulum")
    arrays = finished(loop(system, t_end=2.0, rtol=1e-5, frame_times=np.linspace(0.01, 1.99, 77)), 2.0)
    residual = system.kernel("constraint_residual")
    assert max(np.abs(residual(0.0, y, arrays.p)).max() for y in (*arrays.frames, arrays.y)) < 1e-12


# Stiff problems


def test_stiff_bushing():
    """Eigenvalues -2e3 ± 2.4e4 i beside a swing of about 1 s."""
    system, expected = fixture("stiff_bushing"), load_reference("stiff_bushing_pendulum")["reference_q_v"]
    arrays = loop(system, t_end=1.0, rtol=1e-6, atol=1e-8)
    for t in (0.1, 1.0):
        finished(arrays, t)
        assert np.abs(arrays.y[:6] - numbers(expected[str(t)])).max() < 3e-5
    assert arrays.counters[at.STEPS] < 2500, "dop853 needs 3500, of 12 evaluations each"


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


def test_events_are_located():
    run = {"t_end": 3.0, "at": [3.0]}
    ours = fixture("oscillator").run(method="rodas5p", rtol=1e-10, **run)
    oracle = fixture("oscillator").run(method="dop853", rtol=1e-12, atol=1e-14, **run)
    assert ours.status == oracle.status == "success"
    assert len(ours.events) == len(oracle.events) > 5
    assert max(abs(a.t - b.t) for a, b in zip(ours.events, oracle.events, strict=True)) < 1e-8


def test_loop_carries_its_state_from_call_to_call():
    system = fixture("stiff_bushing")
    whole = finished(loop(system, t_end=0.1), 0.1)
    parts = loop(system, t_end=0.1)
    while parts.advance(0.1, 1) == at.RUNNING:
        pass
    assert np.array_equal(parts.y, whole.y)
    assert np.array_equal(parts.counters[: at.PROJECTIONS], whole.counters[: at.PROJECTIONS])


# Failures


def python_kernel(function):
    """A kernel written in Python: its address, and what keeps it alive."""
    callback = KERNEL_PROTOTYPE(function)
    return ctypes.cast(callback, ctypes.c_void_p).value, callback


def doubles(address):
    return ctypes.cast(address, ctypes.POINTER(ctypes.c_double))


def test_a_wall_in_the_equations_is_reported():
    def rhs(t, y, p, out):
        doubles(out)[0] = doubles(y)[1]
        doubles(out)[1] = -doubles(y)[0] if t < 0.5 else np.nan

    arrays = loop(fixture("pendulum"), t_end=1.0)
    arrays.addresses[at.RHS], keep = python_kernel(rhs)
    assert arrays.advance(1.0, 50_000) == at.NOT_FINITE and keep is not None
    assert 0.48 < arrays.t <= 0.5


def test_undetermined_accelerations_are_reported():
    def residual_jacobian(t, y, p, out):
        doubles(out)[0], doubles(out)[1], doubles(out)[2] = 1.0, 0.0, 0.0

    arrays = loop(fixture("pendulum"), t_end=1.0)
    arrays.addresses[at.RESIDUAL_JACOBIAN], keep = python_kernel(residual_jacobian)
    assert arrays.advance(1.0, 50_000) == at.SINGULAR_MATRIX and keep is not None
