"""Looks at steps of `taylor` and `dop853`, by which `auto` tells models apart that counts of operations do not."""

from __future__ import annotations

import numpy as np
import pytest

import symgen
from symgen.runtime import method_look, step_costs
from symgen.runtime.method_look import time_factor


def chosen(system, rtol):
    return system.run(1e-3, rtol=rtol, atol=1e-2 * rtol).method


@pytest.mark.parametrize(
    "name, t_end, least, most, rtol, method",
    [("heavy_top_absolute", 2.0, 0.3, 0.7, 1e-6, "taylor"), ("bricard", 10.0, 1.2, 2.0, 1e-9, "dop853")],
)
def test_models_are_told_apart_where_counts_are_the_wrong_way(
    name, t_end, least, most, rtol, method, monkeypatch
):
    """Both are near the change by counts; errors and steps of whole runs say which is ahead there."""
    system = symgen.load(name)
    assert least < time_factor(system, rtol) < most
    assert chosen(system, rtol) == method
    monkeypatch.setattr(method_look, "time_factor", lambda system, rtol: 1.0)
    assert chosen(symgen.load(name), rtol) != method
    whole = {}
    for each in ("taylor", "dop853"):
        run = system.run(t_end, method=each, rtol=rtol, atol=1e-2 * rtol)
        exact = system.run(t_end, method="dop853", rtol=3e-14, atol=3e-16)
        whole[each] = np.abs(run.states - exact.states).max() ** 0.125 * run.stats["steps"]
    own = whole["taylor"] / whole["dop853"] / step_costs.step_ratio(rtol)
    assert own < 0.8 if method == "taylor" else own > 1.1


def test_a_look_does_not_depend_on_the_runs_before():
    one, other = symgen.load("double_pendulum"), symgen.load("double_pendulum")
    other.run(0.1, start={"theta1": 3.0}, parameters={"m1": 5.0}, rtol=1e-5)
    assert time_factor(one, 1e-6) == time_factor(other, 1e-6) != 1.0


def test_without_a_start_nothing_is_said():
    model = symgen.Model("apart")
    x, y = model.coordinate("x", start=1.0), model.coordinate("y", start=2.0)
    model.body("ball", mass=1, com=(x, y))
    model.constraint("together", x - y)
    assert time_factor(model.derive(), 1e-6) == 1.0
