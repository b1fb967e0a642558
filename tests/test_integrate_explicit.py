"""Explicit and symplectic methods: tableaus, observed orders, dense output, no allocation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fixture_motions import T_END, reference

from symgen.runtime import load
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.explicit.dop853 import dop853
from symgen.runtime.integrate.explicit.tableau import erk_tableau
from symgen.runtime.integrate.methods import METHODS, find_method
from symgen.runtime.loop_arrays import LoopArrays

FIXTURES = Path(__file__).parent / "fixtures"
EXPLICIT = [
    name
    for name, method in METHODS.items()
    if method.growth is not None and method.form == "projection" and not method.needs_plain_rates
]
RUNGE_KUTTA = [name for name in EXPLICIT if METHODS[name].family.endswith(":advance_erk")]
ADAPTIVE = [name for name in EXPLICIT if METHODS[name].adaptive]
# By order, steps from which the error is well above round-off and the method in its asymptotic range.
STEP = {1: 2e-4, 2: 2e-3, 3: 4e-3, 4: 8e-3, 5: 0.02, 6: 0.04, 7: 0.08, 8: 0.16}


@pytest.fixture(scope="module")
def systems():
    return {name: load(FIXTURES / f"{name}.py") for name in ("pendulum", "cartesian_pendulum", "oscillator")}


def fixed_steps(system, name, h, frame_times):
    """Run any method with steps of h: an adaptive one is given no reason to take others."""
    method = METHODS[name]
    q, v, _, _ = system.initial_state()
    arrays = LoopArrays(
        system, method, system.parameter_values(), 0.0, np.concatenate([q, v]), frame_times=frame_times,
        rtol=1e6, atol=1e6, step=h, with_events=False, log_length=20_000,
    )  # fmt: skip
    arrays.control[at.H_MAX] = h
    assert arrays.advance(T_END, 20_000) == at.REACHED_STOP
    assert arrays.t == T_END
    return arrays


@pytest.mark.parametrize("model", ["pendulum", "cartesian_pendulum", "oscillator"])
@pytest.mark.parametrize("name", EXPLICIT)
def test_observed_order(systems, name, model):
    exact = reference(model, np.array([T_END]))[0]
    errors = []
    for h in (STEP[METHODS[name].order], STEP[METHODS[name].order] / 4):
        arrays = fixed_steps(systems[model], name, h, np.zeros(0))
        errors.append(np.abs(arrays.y - exact).max())
    observed = np.log2(errors[0] / errors[1]) / 2
    assert errors[1] > 1e-14, "too close to round-off to observe an order"
    assert 0.92 * METHODS[name].order < observed < METHODS[name].order + 1.2


@pytest.mark.parametrize("model", ["pendulum", "oscillator"])
@pytest.mark.parametrize("name", RUNGE_KUTTA)
def test_dense_output_order(systems, name, model):
    times = np.linspace(0.0, T_END, 203)[1:-1]
    exact = reference(model, times)
    errors = []
    for h in (STEP[METHODS[name].order], STEP[METHODS[name].order] / 4):
        arrays = fixed_steps(systems[model], name, h, times)
        assert arrays.counters[at.NEXT_FRAME] == len(times)
        errors.append(np.abs(arrays.frames - exact).max())
    observed = np.log2(errors[0] / errors[1]) / 2
    assert min(METHODS[name].order, METHODS[name].dense_order + 1) - 0.5 < observed


@pytest.mark.parametrize("name", ADAPTIVE)
@pytest.mark.parametrize("model", ["pendulum", "cartesian_pendulum"])
@pytest.mark.parametrize("rtol", [1e-5, 1e-8, 1e-11])
def test_tolerance_is_met(systems, name, model, rtol):
    system = systems[model]
    q, v, _, _ = system.initial_state()
    times = np.linspace(0.0, T_END, 31)[1:-1]
    arrays = LoopArrays(
        system, METHODS[name], system.parameter_values(), 0.0, np.concatenate([q, v]), frame_times=times,
        rtol=rtol, atol=rtol, with_events=False, log_length=100_000,
    )  # fmt: skip
    assert arrays.advance(T_END, 100_000) == at.REACHED_STOP
    assert np.abs(arrays.y - reference(model, np.array([T_END]))[0]).max() < 30 * rtol
    assert np.abs(arrays.frames - reference(model, times)).max() < 100 * rtol


def test_verlet_reuses_accelerations_only_where_it_may(systems):
    assert METHODS["verlet"].coefficients(systems["pendulum"]).reuse == 1
    assert METHODS["verlet"].coefficients(systems["oscillator"]).reuse == 0
    assert METHODS["verlet"].coefficients(systems["cartesian_pendulum"]).reuse == 0
    arrays = fixed_steps(systems["pendulum"], "verlet", 0.01, np.zeros(0))
    assert arrays.counters[at.RHS_CALLS] == arrays.counters[at.STEPS] + 1


def test_fixed_steps_land_on_stops_without_drift(systems):
    system = systems["pendulum"]
    arrays = LoopArrays(
        system, METHODS["rk4"], system.parameter_values(), 0.0, np.array([1.5, 0.0]), frame_times=np.zeros(0),
        rtol=1e-8, atol=1e-8, step=0.1, log_length=1000,
    )  # fmt: skip
    assert arrays.advance(0.25, 1000) == at.REACHED_STOP
    assert arrays.t == 0.25
    assert arrays.advance(3.0, 1000) == at.REACHED_STOP
    ends = arrays.new_steps[:, 0]
    # The grid goes on from the start, not from the stop.
    np.testing.assert_array_equal(ends[:-1], [k * 0.1 for k in range(3, 30)])
    assert ends[-1] == 3.0


@pytest.mark.parametrize("name", RUNGE_KUTTA)
def test_order_conditions(name):
    """Trees up to order 4, and quadrature up to the method's order (Butcher)."""
    tableau = METHODS[name].coefficients(None)
    n = tableau.n_stages
    a, b, c = tableau.a[:n, :n], tableau.b, tableau.c[:n]
    for k in range(1, tableau.order + 1):
        assert b @ c ** (k - 1) == pytest.approx(1 / k, abs=1e-13)
    trees = {
        3: [(b @ a @ c, 1 / 6)],
        4: [(b * c @ a @ c, 1 / 8), (b @ a @ c**2, 1 / 12), (b @ a @ a @ c, 1 / 24)],
    }
    for order, conditions in trees.items():
        if tableau.order >= order:
            for value, exact in conditions:
                assert value == pytest.approx(exact, abs=1e-13)


def test_dop853_coefficients_are_scipys():
    from scipy.integrate._ivp import dop853_coefficients as scipys

    tableau = dop853()
    np.testing.assert_array_equal(tableau.a, scipys.A)
    np.testing.assert_array_equal(tableau.dense, scipys.D)
    np.testing.assert_allclose(tableau.error, [scipys.E5[:12], scipys.E3[:12]], atol=1e-17)


def test_contradicting_tableaus_are_refused():
    with pytest.raises(ValueError, match="sum to"):
        erk_tableau([[], [0.5]], [0.5, 0.6], 2)
    with pytest.raises(ValueError, match="stage 1 has 2"):
        erk_tableau([[], [0.5, 0.5]], [0.5, 0.5], 2)


def test_unknown_method_names_the_nearest():
    with pytest.raises(RuntimeModelError, match=r"'dopri8'.*did you mean 'dopri5'"):
        find_method("dopri8")


def test_non_finite_and_step_too_small_are_told_apart(systems):
    system = systems["pendulum"]
    p = system.parameter_values({"l": 0.0})
    arrays = LoopArrays(
        system, METHODS["dop853"], p, 0.0, np.array([1.5, 0.0]), frame_times=np.zeros(0), rtol=1e-8, atol=1e-8,
    )  # fmt: skip
    assert arrays.advance(1.0, 100) == at.NOT_FINITE


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("name", ADAPTIVE)
def test_first_step_from_rest_is_of_the_size_of_those_after_it(systems, name, rtol):
    # The scale of rates at rest is atol alone: a first step by that would be 1e-4 times as long.
    system = systems["pendulum"]
    p = system.parameter_values()
    start = np.array([1.5, 0.0])
    arrays = LoopArrays(
        system, METHODS[name], p, 0.0, start, frame_times=np.zeros(0), rtol=rtol, atol=1e-3 * rtol,
        with_events=False, log_length=10_000,
    )  # fmt: skip
    assert arrays.advance(1.0, 10_000) == at.REACHED_STOP
    lengths = arrays.new_steps[:, 1]
    # It aims at an error of 1 % of the tolerance, which takes off the more the lower the order is.
    least = 0.05 ** max(1.0, 5.0 / METHODS[name].order)
    assert least * np.median(lengths) < lengths[0] < 2.0 * np.median(lengths)
