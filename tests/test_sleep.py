"""What rests in stable equilibrium sleeps, and whatever could wake it does."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model, dot, maximum, t
from symgen.link import derive
from symgen.runtime import solve
from symgen.runtime.inputs.controller import Controller
from symgen.runtime.inputs.given import Table

K, M = 4.0, 1.0  # a weight on a spring: its angular frequency is 2 rad/s
OPTIONS = {"t_end": 3.0, "method": "dop853", "rtol": 1e-10, "atol": 1e-12, "split": True}


def weights() -> Model:
    """Two weights at rest on springs of their own, in one file with whatever a test adds."""
    m = Model("weights")
    for name in ("a", "b"):
        x = m.coordinate(name, start=0.0)
        m.kinetic(M * dot(x) ** 2 / 2)
        m.potential(m.parameter(f"k_{name}", K) * x**2 / 2)
    return m


def pushed(found, since: float, force: float) -> np.ndarray:
    """The course of b where a constant force acts on it from some time on (in closed form)."""
    return np.where(found.t > since, force / K * (1.0 - np.cos(2.0 * (found.t - since))), 0.0)


def test_both_sleep_where_nothing_could_wake_them():
    found = solve(derive(weights()), **OPTIONS)
    assert {title: s.run.asleep_from for s in found.parts.found for title in s.titles} == {
        "subsystem of a": 0.0,
        "subsystem of b": 0.0,
    }
    assert found.stats["steps"] == 0 and not found.q.any()


def test_a_force_that_begins_later():
    """Time in the equations: the coordinate rests at first, without a force, and must not sleep over its begin."""
    m = weights()
    m.force("b", maximum(t - 1.0, 0.0))
    found = solve(derive(m), **OPTIONS)
    late = np.maximum(found.t - 1.0, 0.0)
    np.testing.assert_allclose(found["b"], (late - np.sin(2.0 * late) / 2.0) / K, atol=1e-8)
    asleep = {s.titles[0]: s.run.asleep_from for s in found.parts.found}
    assert asleep["subsystem of a"] == 0.0 and np.isinf(asleep["subsystem of b"])


@pytest.mark.parametrize("how", ["table", "controller"])
def test_an_input_that_changes(how):
    m = weights()
    m.force("b", m.input("push", unit="N"))
    given = (
        Table([0.0, 1.0], [0.0, 0.5], kind="hold")
        if how == "table"
        else Controller(lambda time, x: 0.5 if time >= 1.0 else 0.0, period=0.5)
    )
    found = solve(derive(m), **OPTIONS, inputs={"push": given})
    np.testing.assert_allclose(found["b"], pushed(found, 1.0, 0.5), atol=1e-7)
    assert not found["a"].any()


def test_an_input_that_is_constant_wakes_nothing_later():
    """A constant input only moves the equilibrium: at rest there it sleeps, away from it it does not."""
    m = weights()
    m.force("b", m.input("push", unit="N"))
    system = derive(m)
    resting = solve(system, **OPTIONS, inputs={"push": 2.0}, start={"b": 2.0 / K})
    assert resting.stats["steps"] == 0
    moving = solve(system, **OPTIONS, inputs={"push": 2.0})
    np.testing.assert_allclose(moving["b"], pushed(moving, -1e-300, 2.0), atol=1e-8)


def test_an_event_that_sets_it_moving():
    m = weights()
    m.event("kick", "t - 1", then={"reset": {"dot(b)": 1.0}})
    found = solve(derive(m), **OPTIONS)
    after = np.maximum(found.t - 1.0, 0.0)
    np.testing.assert_allclose(found["b"], np.sin(2.0 * after) / 2.0, atol=1e-8)
    assert not found["a"].any()
