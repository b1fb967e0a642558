"""Symmetric compositions of Verlet: order conditions, observed orders, dense output, long runs, refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen.runtime import load
from symgen.runtime.checks.stability import stable_radius
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.composition import HALVES, composition
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays

FIXTURES = Path(__file__).parent / "fixtures"
ORDERS = (4, 6, 8)
T_END = 0.8
STEP = {4: 0.02, 6: 0.04, 8: 0.16}
NO_DAMPING = {"c": 0.0}


def fixture(name):
    return load(FIXTURES / f"{name}.py")


def fixed_steps(model, order, h, t_end=T_END, frame_times=(), parameters=None):
    system = fixture(model)
    q, v, _, _ = system.initial_state()
    arrays = LoopArrays(
        system, METHODS[f"verlet{order}"], system.parameter_values(parameters), 0.0, np.concatenate([q, v]),
        frame_times=np.asarray(frame_times, dtype=float), rtol=1e-8, atol=1e-8, step=h,
        with_events=False, log_length=1 << 20,
    )  # fmt: skip
    assert arrays.advance(t_end, 1 << 20) == at.REACHED_STOP
    assert arrays.t == t_end
    return arrays


def reference(model, times):
    def pendulum(t, y):
        return [y[1], -9.81 / 0.5 * np.sin(y[0])]

    def oscillator(t, y):
        force = 0.5 * np.sin(3.0 * t)
        return [y[1], force - 25.0 * y[0], force * y[1]]

    f, start = {"pendulum": (pendulum, [1.5, 0.0]), "oscillator": (oscillator, [0.1, 0.0, 0.0])}[model]
    return solve_ivp(f, (0, T_END), start, "DOP853", rtol=1e-13, atol=1e-15, dense_output=True).sol(times).T


def exponential(terms, order):
    """exp(Σ terms[w] Y_w) in the free algebra of Y_1, Y_3, …, up to words of weight `order`."""
    power, total = {(): 1.0}, {(): 1.0}
    for n in range(1, order + 1):
        power = multiply(power, {(w,): value / n for w, value in terms.items()}, order)
        total = add(total, power)
    return total


def multiply(a, b, order):
    product = {}
    for left, x in a.items():
        for right, y in b.items():
            if sum(left) + sum(right) <= order:
                product[left + right] = product.get(left + right, 0.0) + x * y
    return product


def add(a, b):
    return {word: a.get(word, 0.0) + b.get(word, 0.0) for word in {**a, **b}}


@pytest.mark.parametrize("order", ORDERS)
def test_order_conditions(order):
    """A symmetric step is exp(h Y1 + h³ Y3 + …) (Hairer, Lubich, Wanner, III.5); the composition must be exp(h Y1)."""
    drifts = composition(order).drifts
    assert np.array_equal(drifts, drifts[::-1])
    product = {(): 1.0}
    for step in drifts:
        product = multiply(product, exponential({w: step**w for w in (1, 3, 5, 7)}, order), order)
    exact = exponential({1: 1.0}, order)
    defect = add(product, {word: -value for word, value in exact.items()})
    assert max(map(abs, defect.values())) < 1e-14
    assert len(defect) == {4: 8, 6: 21, 8: 55}[order], "the words of odd letters: Fibonacci numbers"


@pytest.mark.parametrize("order", ORDERS)
def test_stability_limit_is_that_of_an_oscillator(order):
    def trace(step):
        matrix = np.eye(2)
        for drift in composition(order).drifts * step:
            kick = np.array([[1.0, 0.0], [-drift / 2, 1.0]])
            matrix = kick @ [[1.0, drift], [0.0, 1.0]] @ kick @ matrix
        return np.trace(matrix)

    limit = stable_radius(METHODS[f"verlet{order}"])
    assert max(abs(trace(step)) for step in np.linspace(0.01, limit, 60)) <= 2.0 + 1e-12
    assert abs(trace(limit + 0.01)) > 2.0


def test_steps_that_do_not_sum_to_one_are_refused(monkeypatch):
    monkeypatch.setitem(HALVES, 4, (0.4, 0.4, -0.5))
    with pytest.raises(ValueError, match="sum to 1"):
        composition(4)


@pytest.mark.parametrize("model", ["pendulum", "oscillator"])
@pytest.mark.parametrize("order", ORDERS)
def test_observed_order(order, model):
    exact = reference(model, np.array([T_END]))[0]
    errors = [
        np.abs(
            fixed_steps(model, order, h, parameters=NO_DAMPING if model == "oscillator" else None).y - exact
        ).max()
        for h in (STEP[order], STEP[order] / 2, STEP[order] / 4)
    ]
    observed = np.log2(errors[0] / errors[2]) / 2
    assert errors[2] > 1e-14, "too close to round-off to observe an order"
    assert order - 0.4 < observed < order + 1.5, (errors, observed)


@pytest.mark.parametrize("model", ["pendulum", "oscillator"])
def test_dense_output_order(model):
    """Positions with an error of h^8, rates of h^7, work of h^6."""
    times = np.linspace(0.0, T_END, 203)[1:-1]
    exact = reference(model, times)
    parameters = NO_DAMPING if model == "oscillator" else None
    errors = [
        np.abs(fixed_steps(model, 8, h, frame_times=times, parameters=parameters).frames - exact).max(axis=0)
        for h in (0.08, 0.04)
    ]
    observed = np.log2(errors[0] / errors[1])
    assert observed[0] > 7.2 and observed[1] > 6.3
    assert model == "pendulum" or observed[2] > 5.2
    assert METHODS["verlet8"].dense_order + 1 <= 6


def test_one_evaluation_per_stage():
    for order, stages in ((4, 5), (6, 9), (8, 17)):
        arrays = fixed_steps("pendulum", order, 0.05)
        assert arrays.counters[at.RHS_CALLS] == stages * arrays.counters[at.STEPS] + 1


def test_energy_of_a_long_run_stays():
    """2000 periods: the energy error of order 8 does not drift, and rounding adds up to less than 1e-14."""
    arrays = fixed_steps("pendulum", 8, 0.05, t_end=3300.0, frame_times=np.linspace(0, 3300, 331)[1:])
    energy = fixture("pendulum").kernel("energy")
    start = energy(0.0, np.array([1.5, 0.0]), arrays.p).sum()
    errors = [abs(energy(0.0, y, arrays.p).sum() - start) for y in arrays.frames]
    assert max(errors[-100:]) < 2.0 * max(errors[:100])
    assert max(errors) < 1e-9


def test_samples_are_those_of_another_method():
    solution = fixture("pendulum").run(t_end=2.0, method="verlet8", step=0.02, at=[0.7313, 2.0])
    oracle = fixture("pendulum").run(t_end=2.0, method="dop853", rtol=1e-12, atol=1e-13, at=[0.7313, 2.0])
    assert solution.status == "success"
    for ours, theirs in zip(solution.samples, oracle.samples, strict=True):
        assert np.abs(ours.q - theirs.q).max() < 1e-9


@pytest.mark.parametrize(
    "model, why",
    [
        ("double_pendulum", "mass matrix that changes"),
        ("oscillator", "depend on velocities"),
        ("cartesian_pendulum", "constraints"),
    ],
)
def test_models_that_do_not_separate_are_refused(model, why):
    with pytest.raises(RuntimeModelError, match=rf"'verlet6' .*{why}.*gauss8"):
        fixture(model).run(t_end=1.0, method="verlet6", step=0.01)
