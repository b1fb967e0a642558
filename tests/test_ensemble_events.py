"""Events in lanes: the same ones at the same times as in single runs, and in the same bits at any width."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from symgen import Model, cos, dot, sin
from symgen.runtime import System
from symgen.runtime.ensemble import linspace, normal, uniform
from symgen.runtime.ensemble.batch import LaneBatch
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import make_plan
from symgen.runtime.ensemble.slots import LEFT
from symgen.runtime.ensemble.work import runs_alone

METHODS = ("dop853", "taylor", "radau5")


@functools.cache
def walls() -> System:
    """A damped trolley with a pendulum between two walls; where the pendulum passes and turns is taken note of."""
    m = Model("walls", gravity=(0, "-9.81 m/s^2"))
    x = m.coordinate("x", unit="m", start=0.0, rate=0.4)
    theta = m.coordinate("theta", start=1.0)
    mass = m.parameter("mass", "1.5 kg")
    m.body("trolley", mass=mass, com=(x, 0))
    m.body("load", mass="0.4 kg", com=(x + 0.8 * sin(theta), -0.8 * cos(theta)))
    m.force(x, -0.2 * dot(x))
    m.event("left", x + 0.25, direction="falling", then={"reset": {"dot(x)": "-0.9*dot(x)"}})
    m.event("right", x - 0.25, direction="rising", then={"reset": {"dot(x)": "-0.9*dot(x)"}})
    m.event("passes", theta, then="record")
    m.event("turns", dot(theta), direction="rising", then="record")
    return m.derive()


@functools.cache
def ball() -> System:
    m = Model("ball", gravity=(0, "-9.81 m/s^2"))
    x, y = m.coordinate("x", rate=0.5), m.coordinate("y", start=1.0)
    e = m.parameter("e", 0.5)
    m.body("ball", mass=0.5, com=(x, y))
    m.event("bounce", y, direction="falling", then={"reset": {"dot(y)": -e * dot(y)}})
    return m.derive()


@functools.cache
def two_balls() -> System:
    m = Model("two_balls", gravity=(0, "-9.81 m/s^2"))
    for name in "ab":
        y = m.coordinate(name, start=1.0)
        m.body(name, mass=1.0, com=(0, y))
        m.event(
            f"bounce_{name}", y, direction="falling", then={"reset": {f"dot({name})": f"-0.8*dot({name})"}}
        )
    return m.derive()


@functools.cache
def counter() -> System:
    """An oscillation of a given amplitude that a wheel counts: one turn a second more where it passes 1."""
    m = Model("counter")
    x, n = m.coordinate("x", start=0.0), m.coordinate("n")
    m.kinetic(dot(x) ** 2 / 2 + dot(n) ** 2 / 2)
    m.potential(x**2 / 2)
    m.event("passes", x - 1, direction="rising", then={"reset": {"dot(n)": dot(n) + 1}})
    return m.derive()


def plan_of(system, **options):
    plan = make_plan(system, EnsembleOptions(**{"n": 60, "seed": 3, **options}))
    assert plan.settings is not None, plan.notes
    parameters, values = plan.members.arrays(plan.p, 0, plan.members.n)
    starts, failures = plan.starts.of(parameters, values)
    assert not failures
    return plan, parameters, starts


VARIED = {"parameters": {"mass": normal(1.5, 0.1)}, "start": {"theta": uniform(0.5, 1.5)}}


@pytest.mark.parametrize("method", METHODS)
def test_lanes_do_not_change_members(method):
    plan, parameters, starts = plan_of(walls(), t_end=4.0, method=method, frames=9, **VARIED)
    wide = LaneBatch(plan.system, plan.settings).run(parameters, starts)
    assert (wide.column("status") == 1).all()
    assert (wide.column("resets") > 1).all()
    for lanes in (1, 4):
        other = LaneBatch(plan.system, replace(plan.settings, lanes=lanes)).run(parameters, starts)
        for name in ("end", "frames", "columns"):
            assert getattr(other, name).tobytes() == getattr(wide, name).tobytes(), name
    order = np.random.default_rng(1).permutation(len(starts))
    spoiled = np.vstack([starts[order], [[np.nan] * 4, [1e300, 0.0, 0.0, 0.0]]])
    mixed = LaneBatch(plan.system, plan.settings).run(np.vstack([parameters[order], parameters[:2]]), spoiled)
    assert mixed.end[:60].tobytes() == wide.end[order].tobytes()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-6, 1e-11])
def test_events_are_those_of_single_runs(method, rtol):
    system, asked = walls(), {"method": method, "rtol": rtol, "atol": rtol * 1e-2}
    e = system.ensemble(3.0, n=12, seed=5, frames=13, keep=["x", "theta", "energy"], **VARIED, **asked)
    assert not e.verdicts.singly.any()
    assert e.health.ok, e.health.lines()
    for k in range(12):
        values = {
            "parameters": {"mass": float(e.varied["mass"][k])}, "start": {"theta": float(e.varied["theta"][k])},
        }  # fmt: skip
        run = system.run(3.0, t_eval=e.t, **asked, **values)
        again = e.member(k, e.t)
        assert [event.name for event in again.events] == [event.name for event in run.events]
        times = np.array([[a.t, b.t] for a, b in zip(again.events, run.events, strict=True)])
        assert np.abs(times[:, 0] - times[:, 1]).max() < 3e3 * rtol
        for ours, theirs in zip(again.events, run.events, strict=True):
            assert np.isclose(ours.energy_change, theirs.energy_change, rtol=1e4 * rtol, atol=1e4 * rtol)
        assert np.allclose(run["x"], e["x"][k], atol=3e4 * rtol)
        assert np.allclose(run["theta"], e["theta"][k], atol=3e4 * rtol)
        assert np.array_equal(again["theta"], e["theta"][k])
        assert np.isclose(again.energy.unscaled_error, run.energy.unscaled_error, atol=1e2 * rtol)
        assert all(entry.ok for entry in again.health if entry.check in ("energy", "missed events"))


@pytest.mark.parametrize("method", METHODS)
def test_flights_that_pile_up_are_for_single_runs(method):
    """Before the end of the bounces a member is the run that a formula gives, behind it fails as single runs do."""
    system, g = ball(), 9.81
    e = system.ensemble(
        1.0, method=method, rtol=1e-10, start={"y": linspace(0.5, 1.5, 9)}, parameters={"e": 0.7}
    )
    assert not e.verdicts.singly.any()
    for height, y in zip(e.varied["y"], e["y"], strict=True):
        t, speed = np.sqrt(2 * height / g), np.sqrt(2 * height * g) * 0.7
        while t + 2 * speed / g < 1.0:
            t, speed = t + 2 * speed / g, speed * 0.7
        rest = 1.0 - t
        expected = speed * rest - g / 2 * rest**2 if rest > 0 else height - g / 2
        assert np.isclose(y, expected, atol=1e-8)
    whole = system.ensemble(4.0, method=method, start={"y": linspace(0.5, 1.5, 3)})
    assert whole.verdicts.singly.all()
    assert list(whole.failed) == [0, 1, 2]
    assert "pile up" in whole.messages[0]


@pytest.mark.parametrize("method", METHODS)
def test_events_within_a_step_are_found_one_by_one(method):
    """x = x0 + t: steps are as long as a method likes, and a wheel turns faster by one for each tooth that passes."""
    m, starts = Model("rack"), np.linspace(0.0, 0.4, 9) + 0.013
    x, n = m.coordinate("x", rate=1.0), m.coordinate("n")
    m.kinetic(dot(x) ** 2 / 2 + dot(n) ** 2 / 2)
    m.event("tooth", sin(40 * x), direction="rising", then={"reset": {"dot(n)": dot(n) + 1}})
    e = m.derive().ensemble(5.0, method=method, start={"x": list(starts)}, keep=["n"])
    assert not e.verdicts.singly.any()
    teeth = np.arange(40) * (2 * np.pi / 40)
    passed = [teeth[(teeth > start) & (teeth < start + 5.0)] - start for start in starts]
    assert np.allclose(e["n"], [(5.0 - t).sum() for t in passed], rtol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_two_events_at_one_instant_are_for_single_runs(method):
    system = two_balls()
    e = system.ensemble(2.0, method=method, start={"a": [1.0, 0.9, 1.0]})
    assert list(e.verdicts.singly) == [True, False, True]
    for k in range(3):
        run = system.run(2.0, method=method, start={"a": float(e.varied["a"][k])}, t_eval=(2.0,))
        assert np.allclose(run.states[-1], [e[name][k] for name in e.names], atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_what_hardly_passes_is_not_passed_by(method):
    """Amplitudes close to where the event is: all crossings are found, in lanes or by single runs."""
    system = counter()
    amplitudes = np.concatenate([1 + np.logspace(-9, -1, 17), 1 - np.logspace(-9, -1, 17)])
    e = system.ensemble(18.0, method=method, rtol=1e-12, atol=1e-14, rate={"x": amplitudes})
    assert np.array_equal(e["dot(n)"], np.where(amplitudes > 1, 3.0, 0.0))
    assert not e.verdicts.singly[[16, 33]].any()  # far from it


def test_only_models_with_events_leave_for_them():
    assert LEFT in runs_alone(plan_of(ball(), t_end=1.0, start={"y": uniform(1.0, 1.2)})[0])


@pytest.mark.parametrize("method", METHODS)
def test_events_that_end_runs(method):
    """Frames behind the end show where the member stays; members of others go on."""
    m = Model("thrown", gravity=(0, "-9.81 m/s^2"))
    x, y = m.coordinate("x", rate=2.0), m.coordinate("y", rate=3.0)
    m.body("stone", mass=1.0, com=(x, y))
    m.event("lands", y, direction="falling", then="terminate")
    system = m.derive()
    speeds = np.array([3.0, 5.0, 20.0])
    e = system.ensemble(2.0, method=method, rate={"y": speeds}, frames=[0.1, 0.5, 1.0, 1.5, 2.0])
    assert e.health.ok
    assert not e.verdicts.singly.any()
    flight = 2 * speeds / 9.81
    assert np.allclose(e["x"], 2.0 * np.minimum(e.t, flight[:, None]), atol=1e-9)
    assert np.allclose(e["y"][:2, -1], 0.0, atol=1e-9)
    for k, word in enumerate(("terminated", "terminated", "success")):
        again, run = e.member(k), system.run(2.0, method=method, rate={"y": speeds[k]})
        assert again.status == run.status == word
        assert np.isclose(again.t[-1], min(2.0, flight[k]), atol=1e-12)
        assert np.array_equal(again.states[-1][:2], [e["x"][k, -1], e["y"][k, -1]])


@pytest.mark.parametrize("method", METHODS)
def test_what_goes_on_touching_zero_is_for_single_runs(method):
    """At every step length it may have crossed; single runs search the minimum itself, and find that it has not."""
    m = Model("toucher")
    x, n = m.coordinate("x", start=1.0), m.coordinate("n")
    m.kinetic(dot(x) ** 2 / 2 + dot(n) ** 2 / 2)
    m.potential(x**2 / 2)
    m.event("touches", x**2, direction="falling", then={"reset": {"dot(n)": dot(n) + 1}})
    system = m.derive()
    e = system.ensemble(2.0, method=method, start={"x": [1.0, 0.5]})
    assert e.verdicts.singly.all()
    assert np.array_equal(e["dot(n)"], [0.0, 0.0])
    assert np.allclose(e["x"], np.array([1.0, 0.5]) * np.cos(2.0), atol=1e-7)
