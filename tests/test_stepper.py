"""Steps for loops that live in Python, linear models for python-control, health and advice as data."""

from __future__ import annotations

import importlib.util
import json
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import symgen
from symgen import runtime
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs import Table
from symgen.runtime.result_json import to_json

FIXTURES = Path(__file__).parent / "fixtures"


@pytest.fixture(scope="module")
def cart_pole():
    return symgen.load("cart_pole")


def held(values, dt):
    return np.arange(len(values)) * dt, np.array(values)


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_steps_with_held_inputs_are_a_run_with_a_table(cart_pole, method):
    name = cart_pole.inputs[0]["name"]
    forces, dt = np.random.default_rng(3).normal(size=20), 0.05
    stepper = cart_pole.stepper(method)
    for force in forces:
        state = stepper.step(dt, [force])
    table = Table(*held(forces, dt), "hold")
    run = cart_pole.run(1.0, method="dop853", rtol=1e-12, atol=1e-13, inputs={name: table})
    np.testing.assert_allclose(state, run.states[-1], atol=1e-6)
    assert stepper.t == pytest.approx(1.0) and state is stepper.state


def test_step_writes_in_place_and_keeps_to_the_constraints():
    system = runtime.load(FIXTURES / "cartesian_pendulum.py")
    state = system.stepper().state.copy()
    same, y = state, state.copy()
    for _ in range(50):
        assert system.step(state, None, 0.02) is same
    run = system.run(1.0, method="dop853", rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(state, run.states[-1], atol=1e-6)
    assert np.abs(system.kernel("constraint_residual")(0.0, state, system.parameter_values())).max() < 1e-10
    assert not np.array_equal(state, y)


def test_a_state_from_outside_is_where_the_step_begins(cart_pole):
    """Steps from each other's states, by turns: nothing of one is left in the other."""
    n = cart_pole.nq + cart_pole.nv
    a, b = np.full(n, 0.1), np.full(n, -0.2)
    alone = [cart_pole.step(x.copy(), [0.5], 0.1) for x in (a, b)]
    by_turns = [cart_pole.step(x.copy(), [0.5], 0.1) for x in (b, a, b, a)]
    np.testing.assert_allclose(by_turns, [alone[1], alone[0], alone[1], alone[0]], atol=1e-8)


def test_inputs_that_work_is_hoisted_from_are_seen():
    model = symgen.Model("hoisted")
    x = model.coordinate("x", start=0.0)
    u = model.input("u")
    model.kinetic("dot(x)^2/2")
    model.force(x, symgen.sin(u) * symgen.exp(u))
    stepper = model.derive().stepper()
    for value in (0.0, 1.0, 0.0):
        before = stepper.state.copy()
        stepper.step(0.1, {"u": value})
        a = np.sin(value) * np.exp(value)
        expected = [before[0] + 0.1 * before[1] + 0.005 * a, before[1] + 0.1 * a]
        np.testing.assert_allclose(stepper.state, expected, rtol=1e-12, atol=1e-14)


def test_steps_allocate_nothing_that_stays(cart_pole):
    stepper = cart_pole.stepper()
    inputs = np.zeros(1)
    for _ in range(10):
        stepper.step(0.01, inputs)
    tracemalloc.start()

    def peak(n: int) -> int:
        begin = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        for k in range(n):
            inputs[0] = k % 7
            stepper.step(0.01, inputs)
        return tracemalloc.get_traced_memory()[1] - begin

    peak(100)
    few, many = peak(100), min(peak(10_100) for _ in range(3))  # faster code may come during one of them
    tracemalloc.stop()
    # A step that left anything behind would leave 24 bytes at least; tables of the interpreter may grow once.
    assert many < few + 10_000 < 30_000  # bytes


def test_what_needs_a_run_is_refused(cart_pole):
    with pytest.raises(RuntimeModelError, match="steps know no events, but model 'oscillator'"):
        runtime.load(FIXTURES / "oscillator.py").stepper()
    with pytest.raises(RuntimeModelError, match="steps of one length"):
        cart_pole.stepper("rk4")
    with pytest.raises(RuntimeModelError, match="no input 'G'"):
        cart_pole.stepper().step(0.1, {"G": 1.0})


def test_python_control_gets_matrices_and_names(cart_pole):
    control = pytest.importorskip("control")
    linear = cart_pole.linearise("start")
    given = linear.to_control()
    assert isinstance(given, control.StateSpace)
    for mine, theirs in ((linear.A, given.A), (linear.B, given.B), (linear.C, given.C), (linear.D, given.D)):
        np.testing.assert_array_equal(mine, theirs)
    assert (given.state_labels, given.input_labels) == (linear.states, linear.inputs)
    assert given.output_labels == linear.outputs


def test_python_control_is_named_where_it_is_missing(cart_pole, monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "control" else find(name))
    with pytest.raises(ImportError, match=r"pip install 'symgen\[control\]'"):
        cart_pole.linearise("start").to_control()


def test_health_and_advice_are_data(cart_pole):
    run = cart_pole.run(0.5)
    data = json.loads(to_json(run.to_dict()))
    assert [entry["check"] for entry in data["health"]] == [entry.check for entry in run.health]
    assert {"check", "ok", "value", "limit", "says", "note"} == set(data["health"][0])
    advice = cart_pole.advise("0.5 s")
    assert advice.ok and json.loads(to_json(advice.to_dict())) and advice.lines()
    assert not cart_pole.advise("0.5 s", method="euler", step=0.4).ok


def test_arrays_that_cannot_hold_a_state_are_refused(cart_pole):
    for state in (np.array([0, 1, 0, 0]), np.zeros(4, dtype=np.float32), np.zeros((1, 4))):
        with pytest.raises(RuntimeModelError, match=r"give one of float64, shape \(4,\)"):
            cart_pole.step(state, None, 0.1)


@pytest.mark.parametrize(("dt", "t"), [(np.nan, 0.0), (np.inf, 0.0), (0.1, np.nan)])
def test_steps_to_no_time_are_refused(cart_pole, dt, t):
    with pytest.raises(RuntimeModelError, match="give finite numbers"):
        cart_pole.step(np.full(4, 0.1), None, dt, t=t)


def test_threads_step_by_themselves(cart_pole):
    starts = np.random.default_rng(5).normal(size=(8, 4))
    expected = [cart_pole.step(start.copy(), [0.0], 0.3) for start in starts]

    def steps(start):
        return [cart_pole.step(start.copy(), [0.0], 0.3) for _ in range(200)]

    with ThreadPoolExecutor(4) as executor:
        for found, one in zip(executor.map(steps, starts), expected, strict=True):
            np.testing.assert_allclose(
                found, np.tile(one, (200, 1)), rtol=1e-6
            )  # steps go on as those before did
