"""Stops and dry friction in lanes: members switch as single runs do, in the same bits at any width and order."""

from __future__ import annotations

import functools
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from symgen import Model, dot, link
from symgen.model.library import find
from symgen.runtime import System, load
from symgen.runtime.checks import health
from symgen.runtime.ensemble import linspace, uniform
from symgen.runtime.ensemble.batch import LaneBatch
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import make_plan
from symgen.runtime.ensemble.settling import Settled, Settling
from symgen.runtime.ensemble.switched import SwitchedBatch, _InFull, make_batch
from symgen.runtime.errors import RuntimeModelError

METHODS = ("dop853", "taylor", "radau5")
_JUDGED = ("energy", "finite", "constraint position", "stops")


def bundled(name: str) -> System:
    return load(link.module_for(Path(find(name)), {}, None).text)


@functools.cache
def stick_slip() -> System:
    return bundled("stick_slip")


@functools.cache
def door() -> System:
    return bundled("door_stop")


@functools.cache
def ball() -> System:
    m = Model("ball", gravity=(0, "-9.81 m/s^2"))
    x, y = m.coordinate("x", rate=0.5), m.coordinate("y", start=1.0)
    m.body("ball", mass=0.5, com=(x, y))
    m.stop("floor", y, restitution=m.parameter("e", 0.6))
    return m.derive()


@functools.cache
def blocks() -> System:
    """Two blocks on springs, each with dry friction, one of them with a wall."""
    m = Model("blocks")
    x, y = m.coordinate("x", start=0.3), m.coordinate("y", start=-0.5)
    m.body("a", mass=1.0, com=(x, 0))
    m.body("b", mass=2.0, com=(y, 0))
    m.potential(10 * (x - y) ** 2 + 15 * x**2)
    size = m.parameter("size", 1.0)
    m.friction("first", coordinate=x, force=size, static=1.3 * size)
    m.friction("second", coordinate=y, force=0.8, static=1.0)
    m.stop("wall", 0.25 - x, restitution=0.5)
    return m.derive()


@functools.cache
def sliding() -> System:
    """A block on a spring with Coulomb friction."""
    m = Model("sliding")
    x = m.coordinate("x", start=1.0)
    m.body("block", mass=2.0, com=(x, 0))
    m.potential(8.0 * x**2 / 2)
    m.friction("floor", coordinate=x, force=m.parameter("size", 0.5), static=0.7)
    return m.derive()


MODELS = {
    "stick_slip": (stick_slip, 6.0, {"rate": {"x": uniform(0.2, 0.25)}}),
    "door": (door, 12.0, {"rate": {"angle": uniform(2.0, 3.0)}}),
    "ball": (ball, 3.0, {"start": {"y": uniform(0.5, 1.5)}}),
    "blocks": (blocks, 4.0, {"start": {"x": uniform(0.0, 0.25)}}),
}


def plan_of(system: System, **options):
    plan = make_plan(system, EnsembleOptions(**{"n": 40, "seed": 3, **options}))
    assert plan.settings is not None, plan.notes
    parameters, values = plan.members.arrays(plan.p, 0, plan.members.n)
    starts, failures = plan.starts.of(parameters, values)
    assert not failures
    return plan, parameters, starts


def judged(solution) -> bool:
    return not any(entry.check in _JUDGED for entry in health.objections_to(solution))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", MODELS)
def test_lanes_do_not_change_members(name, method):
    make, t_end, varied = MODELS[name]
    plan, parameters, starts = plan_of(make(), t_end=t_end, method=method, frames=9, **varied)
    wide = make_batch(plan.system, plan.settings)
    result = wide.run(parameters, starts)
    assert (result.column("status") == 1).all()
    assert isinstance(wide, SwitchedBatch)
    lowest = wide.lowest_gaps.copy()
    for lanes in (1, 4):
        batch = make_batch(plan.system, replace(plan.settings, lanes=lanes))
        other = batch.run(parameters, starts)
        for part in ("end", "frames", "columns"):
            assert getattr(other, part).tobytes() == getattr(result, part).tobytes(), part
        assert batch.lowest_gaps.tobytes() == lowest.tobytes()
    order = np.random.default_rng(1).permutation(len(starts))
    spoiled = np.vstack(
        [starts[order], np.full((1, starts.shape[1]), np.nan), np.full((1, starts.shape[1]), 1e300)]
    )
    mixed = wide.run(np.vstack([parameters[order], parameters[:2]]), spoiled)
    for part in ("end", "frames", "columns"):
        assert getattr(mixed, part)[:40].tobytes() == getattr(result, part)[order].tobytes(), part


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", MODELS)
def test_switches_are_those_of_single_runs(name, method):
    make, t_end, varied = MODELS[name]
    rtol = 1e-7
    system, asked = make(), {"method": method, "rtol": rtol, "atol": rtol * 1e-2}
    e = system.ensemble(t_end, n=3, seed=5, frames=13, threads=1, **varied, **asked)
    assert not e.verdicts.singly.any()
    assert not e.n_failed
    place, own = next(iter(varied.items()))
    of = next(iter(own))
    for k in range(3):
        value = float(e.varied[of if place == "start" else f"dot({of})"][k])
        run = system.run(t_end, t_eval=e.t, **asked, **{place: {of: value}})
        again = e.member(k, e.t)
        assert [(a.name, a.action) for a in again.events] == [(a.name, a.action) for a in run.events]
        assert np.allclose(again.events.times, run.events.times, rtol=0, atol=3e3 * rtol)
        for ours, theirs in zip(again.events, run.events, strict=True):
            assert np.isclose(ours.energy_change, theirs.energy_change, rtol=1e4 * rtol, atol=1e4 * rtol)
        for x in e.names:
            assert np.allclose(run[x], e[x][k], atol=3e4 * rtol)
            assert again[x].tobytes() == e[x][k].tobytes()
        for switch in system.switches:
            # Away from switches, where forces jump.
            far = np.abs(e.t[:, None] - run.events.times).min(axis=1) > 1e-3
            force = f"force({switch['name']})"
            assert np.allclose(
                again[force][far], run[force][far], atol=3e5 * rtol * max(1.0, np.abs(run[force]).max())
            )
        assert judged(again) == judged(run) == bool(e.verdicts.ok[k])
        assert e.verdicts.steps[k] == again.stats["steps"] == len(again.step_log)
        assert np.isclose(again.energy.unscaled_error, run.energy.unscaled_error, atol=1e2 * rtol)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_two_hundred_members_are_their_single_runs(name):
    """Each of 200: its own run to the last bit, the switches and the verdict of `system.run`."""
    make, t_end, varied = MODELS[name]
    system = make()
    e = system.ensemble(t_end, n=200, seed=11, **varied)
    assert not e.verdicts.singly.any()
    place, own = next(iter(varied.items()))
    of = next(iter(own))
    for k in range(200):
        value = float(e.varied[of if place == "start" else f"dot({of})"][k])
        again, run = e.member(k), system.run(t_end, method=e.method, **{place: {of: value}})
        assert again.states[-1].tobytes() == np.array([e[x][k] for x in e.names]).tobytes()
        assert [(a.name, a.action) for a in again.events] == [(a.name, a.action) for a in run.events]
        assert judged(again) == judged(run) == bool(e.verdicts.ok[k])


def test_bounces_are_those_of_a_formula():
    """Flights shorten by the restitution each time; behind the last one the ball rests."""
    e = ball().ensemble(
        6.0, rtol=1e-9, frames=61, start={"y": linspace(0.4, 1.5, 12)}, parameters={"e": 0.6}, threads=1
    )
    assert not e.verdicts.singly.any()
    for height, y in zip(e.varied["y"], e["y"], strict=True):
        t, speed = np.sqrt(2 * height / 9.81), np.sqrt(2 * height * 9.81)
        expected = np.maximum(height - 9.81 / 2 * e.t**2, 0.0) * (e.t < t)
        for _ in range(60):
            speed *= 0.6
            flight = 2 * speed / 9.81
            here = (e.t >= t) & (e.t < t + flight)
            expected = np.where(here, speed * (e.t - t) - 9.81 / 2 * (e.t - t) ** 2, expected)
            t += flight
        assert np.allclose(y, expected, atol=1e-8)
        assert (y[e.t > t] == y[-1]).all()


def test_sliding_is_that_of_a_formula():
    """Each half turn of a block on a spring with Coulomb friction is half a cosine about F/k to one side."""
    k, mass, size, static = 8.0, 2.0, 0.5, 0.7
    starts = np.linspace(0.05, 1.4, 28)
    e = sliding().ensemble(20.0, rtol=1e-10, start={"x": starts}, frames=41, threads=1)
    assert not e.verdicts.singly.any()
    omega, half = np.sqrt(k / mass), np.pi / np.sqrt(k / mass)
    for start, x in zip(starts, e["x"], strict=True):
        turn, t, expected = start, 0.0, np.zeros_like(e.t)
        while k * abs(turn) > static:
            middle = np.sign(turn) * size / k
            here = e.t >= t
            expected[here] = middle + (turn - middle) * np.cos(omega * (e.t[here] - t))
            turn, t = 2 * middle - turn, t + half
        expected[e.t >= t] = turn
        assert np.allclose(x, expected, atol=1e-7)


@pytest.mark.parametrize("name", MODELS)
def test_closed_forms_are_what_the_full_code_finds(name, monkeypatch):
    make, t_end, varied = MODELS[name]
    plan, parameters, starts = plan_of(make(), t_end=t_end, n=8, method="taylor", frames=9, **varied)
    ours = SwitchedBatch(plan.system, plan.settings).run(parameters, starts)
    calls, settle = [], _InFull.settle
    monkeypatch.setattr(_InFull, "settle", lambda *given: calls.append(1) or settle(*given))

    def nothing(self, *given):
        p, _, y = given[-3:]
        return Settled(np.zeros(len(p), dtype=bool), p, y)

    monkeypatch.setattr(Settling, "start", nothing)
    monkeypatch.setattr(Settling, "act", nothing)
    full = SwitchedBatch(plan.system, plan.settings).run(parameters, starts)
    assert len(calls) > 8
    assert (full.column("status") == 1).all()
    assert np.array_equal(full.column("steps"), ours.column("steps"))
    assert np.allclose(full.frames, ours.frames, rtol=0, atol=1e-10)
    assert np.allclose(full.column("level"), ours.column("level"), rtol=1e-9, atol=1e-10)


def test_most_events_need_no_full_code(monkeypatch):
    settle, calls = _InFull.settle, []
    monkeypatch.setattr(_InFull, "settle", lambda *given: calls.append(1) or settle(*given))
    for name in ("stick_slip", "ball", "door"):
        make, t_end, varied = MODELS[name]
        plan, parameters, starts = plan_of(make(), t_end=t_end, **varied)
        SwitchedBatch(plan.system, plan.settings).run(parameters, starts)
        assert not calls, name
    make, t_end, varied = MODELS["blocks"]
    plan, parameters, starts = plan_of(make(), t_end=t_end, **varied)
    SwitchedBatch(plan.system, plan.settings).run(parameters, starts)
    assert calls  # one block slips while the other one is held


def test_what_is_settled_by_single_runs():
    m = Model("sole", gravity=(0, "-9.81 m/s^2"))
    x, y = m.coordinate("x", rate=1.0), m.coordinate("y", start=0.2)
    m.body("block", mass=1.0, com=(x, y))
    m.stop("floor", y)
    m.friction("rubs", speed=dot(x), coefficient=0.3, normal="floor")
    e = m.derive().ensemble(1.0, n=3, seed=1, start={"y": uniform(0.1, 0.3)})
    assert e.verdicts.singly.all()
    assert any("follow a reaction" in note for note in e.notes)
    violated = ball().ensemble(1.0, start={"y": [0.5, -0.3, 0.4]})
    assert list(violated.verdicts.singly) == [False, True, False]
    assert list(violated.failed) == [1]
    assert "violated at the start" in violated.messages[1]


def test_accelerations_are_for_members():
    """They jump where something is held, of which arrays of many members say nothing."""
    with pytest.raises(RuntimeModelError, match="depends on what stops and friction hold"):
        stick_slip().ensemble(1.0, n=2, seed=1, keep=["dot(dot(x))"], rate={"x": uniform(0.2, 0.25)})


def test_a_stop_that_was_passed_by_is_doubtful(monkeypatch):
    """As in single runs: the least gap at the ends of steps counts, too."""
    e = ball().ensemble(1.0, n=8, seed=1, start={"y": uniform(0.5, 1.5)}, threads=1)
    assert e.verdicts.ok.all()
    run = SwitchedBatch.run

    def sunk(self, *given):
        result = run(self, *given)
        self.lowest_gaps[:] = -1e-3
        self._note_sunk(result)
        return result

    monkeypatch.setattr(SwitchedBatch, "run", sunk)
    e = ball().ensemble(1.0, n=8, seed=1, start={"y": uniform(0.5, 1.5)}, threads=1)
    assert not e.verdicts.ok.any()
    assert not judged(e.member(0))


def test_threads_and_numbers_do_not_change_members():
    asked = {"t_end": 4.0, "seed": 2, "rate": {"x": uniform(0.2, 0.25)}}
    few = stick_slip().ensemble(n=40, threads=1, **asked)
    many = stick_slip().ensemble(n=700, threads=2, **asked)
    for x in few.names:
        assert few[x].tobytes() == many[x][:40].tobytes()


def test_stopping_ends_members_at_once():
    plan, parameters, starts = plan_of(stick_slip(), t_end=1e5, n=512, rate={"x": uniform(0.2, 0.25)})
    batch = SwitchedBatch(plan.system, plan.settings)
    worker = threading.Thread(target=batch.run, args=(parameters, starts))
    worker.start()
    time.sleep(0.5)
    assert worker.is_alive()
    batch.stop()
    worker.join(timeout=30.0)
    assert not worker.is_alive()


def test_models_without_switches_have_plain_lanes():
    plan, *_ = plan_of(bundled("double_pendulum"), t_end=1.0, start={"theta1": uniform(1.0, 1.2)})
    assert type(make_batch(plan.system, plan.settings)) is LaneBatch
