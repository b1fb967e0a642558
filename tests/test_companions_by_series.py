"""Companions by series of runs by series: as good as explicit ones, which confirm them in places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import symgen
from symgen.runtime.checks import error_estimate
from symgen.runtime.checks.companion import by_series, follow_smooth, independent
from symgen.runtime.checks.smoothness import is_smooth_along


@pytest.fixture(scope="module")
def double_pendulum():
    return symgen.load("double_pendulum")


def accuracy(run):
    return next(entry for entry in run.health if entry.check == "accuracy")


def methods_of_companions(monkeypatch):
    """The methods of companions that follow smooth equations, as they are asked for."""
    asked = []

    def noted(solution, companion, *rest):
        asked.append((companion.method.name, len(rest[0])))
        return follow_smooth(solution, companion, *rest)

    monkeypatch.setattr(error_estimate, "follow_smooth", noted)
    return asked


@pytest.mark.parametrize("rtol", [1e-5, 1e-8, 1e-11])
def test_the_error_is_what_an_explicit_companion_says(rtol, double_pendulum, monkeypatch):
    asked = methods_of_companions(monkeypatch)
    run = double_pendulum.run(10.0, method="taylor", rtol=rtol, atol=rtol / 100)
    assert accuracy(run).ok
    assert asked == [("taylor", len(run.t)), ("dop853", 2), ("dop853", 2)]
    reference = double_pendulum.run(10.0, method="dop853", rtol=2e-14, atol=1e-16)
    size = np.maximum(np.ptp(run.states, axis=0), 1e-3 * np.abs(run.states).max(axis=0))
    true = float((np.abs(run.states - reference.states) / size).max())
    assert accuracy(run).value == pytest.approx(true, rel=0.2)


@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_a_root_that_stays_away_from_zero_is_smooth(rtol, monkeypatch):
    """Andrews' mechanism has a spring, whose length is a root: it is far from zero for how fast it changes."""
    asked, system = methods_of_companions(monkeypatch), symgen.load("andrews_squeezer")
    run = system.run(0.03, method="taylor", rtol=rtol, atol=rtol / 100)
    assert accuracy(run).ok
    assert [name for name, _ in asked] == ["taylor", "dop853", "dop853"]
    reference = system.run(0.03, method="dop853", rtol=2e-14, atol=1e-16)
    true = float((np.abs(run.states - reference.states) / np.ptp(run.states, axis=0)).max())
    assert accuracy(run).value == pytest.approx(true, rel=0.2)


@pytest.mark.parametrize(
    ("potential", "smooth"),
    [
        ("sqrt(1 + x^2)", True),
        ("1/(4 + x^2)", True),
        ("1/(4 + sin(x)^2) + x^2/2", True),
        ("sqrt(1e-6 + x^2)", False),  # a kink but for a thousandth of the way
        ("x^2/2 - 1e-5/(1e-5 + (x - 0.003)^2)", False),  # a well that lies between frames
        ("x^2/2 - 1e-5/(1e-5 + (dot(x) - 0.3)^2)", False),  # slopes of rates are not known
        ("sqrt(1 + x^2) + tanh(x)", False),
        ("sqrt(1 + sin(x - t)^2) + x^2/2", False),
    ],
)
def test_quotients_and_roots_are_smooth_away_from_zero(potential, smooth):
    model = symgen.Model("held")
    model.coordinate("x", start=1.0)
    model.kinetic("dot(x)^2/2")
    if "dot(x)" in potential:
        model.force("x", potential)
    else:
        model.potential(potential)
    system = model.derive()
    assert is_smooth_along(system.run(6.0, method="dop853")) == smooth
    # A frame or two in each swing do not tell.
    assert not is_smooth_along(system.run(60.0, method="dop853", fps=0.3))


def bobs(spring: str):
    """A mass in the plane, in a potential of its distance from a pivot."""
    model = symgen.Model("bob")
    model.coordinate("x", start=0.9), model.coordinate("y", start=-0.5)
    model.kinetic("(dot(x)^2 + dot(y)^2)/2")
    model.potential(f"y + {spring}")
    return model.derive()


def test_what_turns_often_between_frames_is_looked_at_beside_the_run(monkeypatch):
    """A spring of 1e7 N/m, with three steps to a vibration: frames alone do not show how its length goes."""
    asked, system = methods_of_companions(monkeypatch), bobs("1e7*(sqrt(x^2 + y^2) - 1)^2/2")
    run = system.run(4.0, method="taylor", fps=30)
    assert run.ok and run.stats["steps"] > 4 * len(run.t) and not is_smooth_along(run)
    assert asked[0][0] == "taylor" and asked[0][1] > run.stats["steps"] / 3
    assert {name for name, _ in asked[1:]} == {"dop853"}
    reference = system.run(4.0, method="taylor", rtol=1e-13, atol=1e-15, fps=30)
    true = float((np.abs(run.states - reference.states) / np.ptp(reference.states, axis=0)).max())
    assert accuracy(run).value == pytest.approx(true, rel=0.5)


def test_what_comes_near_zero_between_frames_is_left_to_explicit_companions(monkeypatch):
    """An orbit whose near end, a hundredth of its far end away, lies between frames."""
    asked, system = methods_of_companions(monkeypatch), bobs("-y - 1/sqrt(x^2 + y^2)")
    run = system.run(6.0, method="taylor", rate={"x": 0.02, "y": 0.05}, fps=2)
    assert run.stats["steps"] > 2 * len(run.t) and accuracy(run).ok
    assert "dop853" not in {name for name, _ in asked}  # none has to confirm what is not taken


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_series_that_the_choice_of_the_method_has_made_go_beside_an_explicit_run(rtol, monkeypatch):
    """They share nothing with it that would have to be confirmed; who names the method has not asked for series."""
    asked, system = methods_of_companions(monkeypatch), symgen.load("bricard")
    run = system.run(10.0, rtol=rtol, atol=rtol / 100)
    assert run.method == "dop853" and accuracy(run).ok
    assert asked == [("taylor", len(run.t))]
    reference = system.run(10.0, method="taylor", rtol=1e-14, atol=1e-16)
    true = float((np.abs(run.states - reference.states) / np.ptp(run.states, axis=0)).max())
    assert accuracy(run).value == pytest.approx(true, rel=0.2)
    named = system.run(10.0, method="dop853", rtol=rtol, atol=rtol / 100)
    assert accuracy(named).value == pytest.approx(true, rel=0.2) and len(asked) == 1


def test_series_are_not_held_to_what_guards_of_constraints_cost_others(monkeypatch):
    """They ask for accelerations once in a step: their runs count as long as they take."""
    asked, system = methods_of_companions(monkeypatch), symgen.load("chain_absolute")
    run = system.run(method="taylor")
    assert accuracy(run).ok and asked[0] == ("taylor", len(run.t))
    reference = system.run(method="taylor", rtol=1e-13, atol=1e-15)
    true = float((np.abs(run.states - reference.states) / np.ptp(run.states, axis=0)).max())
    assert accuracy(run).value == pytest.approx(true, rel=0.2)


@pytest.mark.parametrize(("name", "rtol"), [("slider_crank", 1e-7), ("four_bar", 1e-9)])
def test_beside_a_run_that_keeps_its_energy_series_do_too(name, rtol):
    """Without, they are off by 15 and 45 times as much as these runs."""
    system = symgen.load(name)
    run = system.run(10.0, method="taylor", rtol=rtol, atol=rtol / 100)
    reference = system.run(10.0, method="taylor", rtol=1e-14, atol=1e-16)
    true = float((np.abs(run.states - reference.states) / np.ptp(run.states, axis=0)).max())
    assert run.energy.taken > 0.0 and accuracy(run).value == pytest.approx(true, rel=0.3)


def test_a_fault_that_series_share_is_found(double_pendulum, monkeypatch):
    """Of a run with another weight of a bob, by what then agrees with it everywhere."""
    nominal = double_pendulum.run(10.0, method="taylor")
    other = double_pendulum.run(
        10.0, method="taylor", parameters={"m2": nominal.parameters["m2"] * (1 + 1e-6)}
    )
    wrong = replace(other, p=nominal.p)

    def alike(solution, companion, times, state, most_steps):
        if companion.method.series:
            return solution.states.copy()
        return follow_smooth(solution, companion, times, state, most_steps)

    monkeypatch.setattr(error_estimate, "follow_smooth", alike)
    off = np.abs(other.states - nominal.states) / np.ptp(nominal.states, axis=0)
    assert accuracy(wrong).value == pytest.approx(float(off.max()), rel=0.3)


def test_what_may_be_met_between_steps_is_left_to_explicit_companions(monkeypatch):
    asked = methods_of_companions(monkeypatch)
    model = symgen.Model("well")
    model.coordinate("x", start=1.0)
    model.kinetic("dot(x)^2/2")
    model.potential("x^2/2 + exp(-(x/0.1)^2)/10")
    run = model.derive().run(20.0, method="taylor")
    assert not accuracy(run).ok and asked == []  # it went over the well, as another run by series may


def test_fixed_and_explicit_runs_have_no_companion_by_series(double_pendulum):
    for options in (
        {"method": "dop853"},
        {"method": "rk4", "step": 0.01},
        {"method": "taylor", "max_step": 0.01},
    ):
        run = double_pendulum.run(2.0, **options)
        own = error_estimate.method_of(run)
        assert by_series(run, independent(run, own, 1.0)[0]) is None
