"""Ensembles: members in lanes are the runs that they would be alone, and nothing that is asked for is left out."""

from __future__ import annotations

import concurrent.futures
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

import symgen
from symgen.runtime.ensemble import choice, grid, histogram, linspace, normal, quantiles, uniform
from symgen.runtime.ensemble.batch import LaneBatch
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import make_plan
from symgen.runtime.ensemble.reduction import Digest, Moments
from symgen.runtime.ensemble.run import chunks_between
from symgen.runtime.ensemble.sampling import read_variation
from symgen.runtime.ensemble.shipping import in_order
from symgen.runtime.ensemble.work import _prepared
from symgen.runtime.errors import RuntimeModelError, UnknownNameError
from symgen.runtime.front import load
from symgen.runtime.inputs import Table
from symgen.runtime.integrate import layout as at

GENERATED = Path(__file__).parents[1] / "generated"
# Model, end [s], what varies: with constraints that parameters change, quaternions, work, time, friction.
MODELS = {
    "double_pendulum": (5.0, {"parameters": {"L2": normal(1.0, 0.1)}, "start": {"theta1": uniform(-1, 1)}}),
    "slider_crank": (1.0, {"parameters": {"r": uniform("0.08 m", "0.12 m"), "m": normal(1.0, 0.05)}}),
    "four_bar": (1.0, {"parameters": {"g": uniform(5.0, 15.0)}}),
    "seven_dof_arm": (1.0, {"start": {"q1": uniform(-1, 1)}, "rate": {"q2": normal(0, 1)}}),
    "spinning_top": (1.0, {"parameters": {"m": uniform(0.5, 1.5)}}),
    "cart_pole": (3.0, {"start": {"theta": uniform(-1, 1)}, "rate": {"x": normal(0, 1)}}),
    "outer_solar_system": (5000.0, {"rate": {"x1": normal(0.0, 1e-4)}}),
    "bricard": (0.5, {"parameters": {"g": uniform(5.0, 15.0)}}),
    "rolling_disc": (1.0, {"parameters": {"g": uniform(5.0, 15.0)}}),
    "heavy_top_absolute": (0.3, {}),
    "n_four_bar": (0.5, {}),
    "turntable": (1.0, {}),
    "chain_absolute": (0.5, {}),
    "damped_spring_pendulum": (0.02, {}),
    "bouncing_ball": (2.0, {"start": {"y": uniform(0.6, 1.5)}}),
}


# For implicit methods; the first with times that steps land on.
STIFF = {
    "quarter_car": (1.5, {"parameters": {"bump": uniform(0.05, 0.1), "t_bump": uniform(0.6, 1.0)}}),
    "stiff_bushing_pendulum": (0.5, {"parameters": {"g": uniform(5.0, 15.0)}}),
    "stiff_spring_pendulum": (0.5, {"parameters": {"g": uniform(5.0, 15.0)}}),
}


def system_of(name):
    return load(GENERATED / f"{name}.py")


def varied(name):
    """What varies, of names that the model has."""
    system, (t_end, given) = system_of(name), {**MODELS, **STIFF}[name]
    places = {
        "parameters": [r["name"] for r in system.parameters], "start": [r["name"] for r in system.coordinates],
        "rate": [r["name"] for r in system.rates],
    }  # fmt: skip
    kept = {place: {x: y for x, y in values.items() if x in places[place]} for place, values in given.items()}
    if not any(kept.values()):
        p = system.parameters[0]
        kept = {"parameters": {p["name"]: uniform(0.95 * p["value"], 1.05 * p["value"])}}
    return system, t_end, kept


def plan_of(name, **options):
    system, t_end, kept = varied(name)
    return make_plan(
        system, EnsembleOptions(t_end=t_end, **{"n": 200, "rtol": 1e-7, "seed": 3, **kept, **options})
    )


def members_of(plan):
    parameters, values = plan.members.arrays(plan.p, 0, plan.members.n)
    return parameters, *plan.starts.of(parameters, values)


WITH_QUATERNIONS = ("heavy_top_absolute", "turntable")


def models_and_methods(*methods):
    """All models with each method; loops of Radau methods beside `radau5` without quaternions compile for long."""

    def marks(name, method):
        long = method == "radau9" or (method == "radau5" and name in WITH_QUATERNIONS)
        return [pytest.mark.slow] if long else []

    pairs = [pytest.param(name, method, marks=marks(name, method)) for name in MODELS for method in methods]
    return pytest.mark.parametrize(("name", "method"), pairs)


@models_and_methods("dop853", "taylor", "verlet", "radau5", "radau9")
def test_lanes_do_not_change_members(name, method):
    """At any width, in any order, alone or among others: the same bits."""
    if name == "bouncing_ball" and method == "verlet":
        pytest.skip("events are for methods with steps of their own choice")
    plan = plan_of(name, method=method, step=MODELS[name][0] / 200 if method == "verlet" else None)
    assert plan.settings is not None, plan.notes
    parameters, starts, failures = members_of(plan)
    assert not failures
    wide = LaneBatch(plan.system, plan.settings).run(parameters, starts)
    assert (wide.column("status") == 1).all()
    for lanes in (1,) if name in WITH_QUATERNIONS and method.startswith("radau") else (1, 4):
        other = LaneBatch(plan.system, replace(plan.settings, lanes=lanes)).run(parameters, starts)
        assert other.end.tobytes() == wide.end.tobytes()
        assert other.columns.tobytes() == wide.columns.tobytes()
    order = np.random.default_rng(1).permutation(len(starts))
    mixed = LaneBatch(plan.system, plan.settings).run(parameters[order], starts[order])
    assert mixed.end.tobytes() == wide.end[order].tobytes()


@pytest.mark.parametrize("name", STIFF)
@pytest.mark.parametrize("rtol", [1e-5, pytest.param(1e-9, marks=pytest.mark.slow)])
def test_stiff_members_do_not_depend_on_others(name, rtol):
    plan = plan_of(name, rtol=rtol, frames=9, method="radau5" if rtol > 1e-7 else "radau9")
    parameters, starts, _ = members_of(plan)
    wide = LaneBatch(plan.system, plan.settings).run(parameters, starts)
    assert (wide.column("status") == 1).all()
    alone = LaneBatch(plan.system, replace(plan.settings, lanes=1)).run(parameters, starts)
    order = np.random.default_rng(1).permutation(len(starts))
    mixed = LaneBatch(plan.system, plan.settings).run(parameters[order], starts[order])
    for name in ("end", "frames", "columns"):
        assert getattr(alone, name).tobytes() == getattr(wide, name).tobytes(), name
        assert getattr(mixed, name).tobytes() == getattr(wide, name)[order].tobytes(), name


@pytest.mark.parametrize("name", STIFF)
def test_stiff_members_are_single_runs(name):
    """To the tolerance the ends are those of runs by other methods, which land on the same times."""
    system, t_end, kept = varied(name)
    e = system.ensemble(t_end, n=3, seed=3, rtol=1e-7, atol=1e-9, method="radau5", **kept)
    assert not e.verdicts.singly.any(), e.notes
    assert e.health.ok, e.health.lines()
    for k in range(3):
        values = {x: float(e.varied[x][k]) for x in e.varied}
        run = system.run(t_end, rtol=1e-10, atol=1e-12, method="gauss8", step=2e-5, parameters=values, fps=10)
        end = np.array([e[name][k] for name in e.names])
        scale = np.maximum(np.abs(run.states).max(axis=0), 1e-3)
        assert np.abs((run.states[-1] - end) / scale).max() < 1e-5


@models_and_methods("dop853", "taylor", "radau5", "radau9")
def test_members_are_single_runs(name, method):
    """To the tolerance the ends are those of `system.run`, which knows nothing of lanes; energies are as good."""
    system, t_end, kept = varied(name)
    e = system.ensemble(t_end, n=3, seed=3, rtol=1e-10, atol=1e-12, method=method, **kept)
    assert not e.verdicts.singly.any(), e.notes
    assert e.health.ok, e.health.lines()
    for k in range(3):
        values = {place: {x: float(e.varied[x if place != "rate" else f"dot({x})"][k]) for x in given}
                  for place, given in kept.items()}  # fmt: skip
        run = system.run(t_end, rtol=1e-11, atol=1e-13, method="dop853", fps=10, **values)
        end = np.array([e[name][k] for name in e.names])
        scale = np.maximum(np.abs(run.states).max(axis=0), 1e-3)
        assert np.abs((run.states[-1] - end) / scale).max() < 1e-6
        assert np.isclose(e.member(k).energy.initial, run.energy.initial, rtol=1e-12)


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
@pytest.mark.parametrize("name", ["double_pendulum", "slider_crank", "spinning_top"])
def test_a_member_again_is_the_same(name, method):
    system, t_end, kept = varied(name)
    e = system.ensemble(t_end, n=40, seed=5, method=method, frames=7, **kept)
    ends = system.ensemble(t_end, n=40, seed=5, method=method, **kept)
    for k in (0, 17, 39):
        run = e.member(k)
        assert run.status == "success"
        assert run.states[-1].tobytes() == np.array([ends[x][k] for x in ends.names]).tobytes()
        assert len(run.step_log) == e.verdicts.steps[k] == run.stats["steps"]
        assert np.isclose(run.step_log[:, 1].sum(), t_end, rtol=1e-12)
        rows = np.searchsorted(run.t, e.t)
        assert np.array_equal(run.t[rows], e.t)
        for column in e.names:
            assert np.array_equal(run[column][rows], e[column][k]), column
    assert np.array_equal(e.member(-1).states, e.member(39).states)


@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_frames_are_those_of_single_runs(method):
    system, t_end, kept = varied("slider_crank")
    e = system.ensemble(t_end, n=4, seed=2, rtol=1e-10, atol=1e-12, method=method, frames=23,
                        keep=["x", "dot(theta)", "energy", "dot(dot(x))"], **kept)  # fmt: skip
    for k in range(4):
        values = {name: float(e.varied[name][k]) for name in e.varied}
        run = system.run(t_end, rtol=1e-11, atol=1e-13, method="dop853", t_eval=e.t, parameters=values)
        assert np.allclose(run["x"], e["x"][k], atol=1e-8)
        assert np.allclose(run["dot(dot(x))"], e["dot(dot(x))"][k], rtol=1e-4, atol=1e-5)
        assert np.allclose(run.energy.total, e["energy"][k], rtol=1e-7)


@pytest.mark.parametrize("method", ["rk4", "verlet"])
@pytest.mark.parametrize("name", ["double_pendulum", "slider_crank", "spinning_top", "outer_solar_system"])
def test_fixed_steps(name, method):
    """They are those of `system.run`, but for round-off; with quaternions, and with work that is carried."""
    system, t_end, kept = varied(name)
    asked = {"n": 5, "seed": 3, "method": method, **kept}
    e = system.ensemble(t_end, step=t_end / 500, frames=11, **asked)
    for k in range(5):
        values = {place: {x: float(e.varied[x if place != "rate" else f"dot({x})"][k]) for x in given}
                  for place, given in kept.items()}  # fmt: skip
        run = system.run(t_end, method=method, step=t_end / 500, t_eval=e.t, **values)
        for column in e.names:
            assert np.allclose(run[column], e[column][k], rtol=1e-9, atol=1e-9), column
        assert len(e.member(k).step_log) == run.stats["steps"] == 500


# Constrained by lengths that vary; with a quaternion; with a mass matrix that changes, and work; with jumps in time;
# with constraints that follow from others.
@pytest.mark.parametrize(
    ("name", "method", "steps"),
    [
        ("slider_crank", "rattle", 100), ("slider_crank", "rattle6", 100),
        pytest.param("heavy_top_absolute", "rattle4", 100, marks=pytest.mark.slow),
        ("cart_pole", "rattle", 100), ("cart_pole", "rattle6", 100), ("quarter_car", "rattle", 4000),
        ("bricard", "rattle", 200), ("bricard", "rattle4", 100),
    ],
)  # fmt: skip
@pytest.mark.slow
def test_rattle_in_lanes(name, method, steps):
    """At any width and with any frames the same bits; those of `system.run` but for round-off."""
    system, t_end, kept = varied(name)
    step = t_end / steps
    plan = plan_of(name, method=method, step=step, n=11)
    parameters, starts, _ = members_of(plan)
    wide, single = (
        LaneBatch(plan.system, replace(plan.settings, lanes=lanes)).run(parameters, starts)
        for lanes in (8, 1)
    )
    assert single.end.tobytes() == wide.end.tobytes()
    assert single.columns.tobytes() == wide.columns.tobytes()
    e = system.ensemble(t_end, n=11, seed=3, rtol=1e-7, method=method, step=step, frames=7, **kept)
    assert not e.verdicts.singly.any()
    assert np.array_equal([e[x][:, -1] for x in e.names], wide.end[:, : len(e.names)].T)
    for k in (0, 10):
        assert np.array_equal(e.member(k, e.t).states, np.array([e[x][k] for x in e.names]).T)
        values = {place: {x: float(e.varied[x if place != "rate" else f"dot({x})"][k]) for x in given}
                  for place, given in kept.items()}  # fmt: skip
        run = system.run(t_end, rtol=1e-7, method=method, step=step, t_eval=e.t, **values)
        assert np.allclose(run.states, np.array([e[x][k] for x in e.names]).T, rtol=1e-10, atol=1e-11)
        assert e.verdicts.ok[k] == all(h.ok for h in run.health if h.check in JUDGED)


# Two bodies that turn, between positions that are shifted.
TURNING = """
[parameters]
k = "200 N/m"
m = "2 kg"
[bodies]
cart = { mass = "m", com = [0, 0, 0], inertia = [0.1, 0.1, 0.1] }
a = { mass = 1.0, com = [0, 0, 0], inertia = [0.02, 0.03, 0.05] }
b = { mass = 1.0, com = [0, 0, 0], inertia = [0.05, 0.02, 0.03] }
[joints]
slide = { type = "prismatic", axis = [1, 0, 0], child = "cart" }
ball = { type = "spherical", parent = "cart", child = "a" }
move = { type = "free", child = "b", guess = [0, 0, 1, 1, 0, 0, 0] }
[frames]
above = { body = "a", at = [0, 0, 0.3] }
below = { body = "b", at = [0, 0, -0.3] }
[bushings.link]
frames = ["above", "below"]
stiffness = ["k", "k", "k", 5, 5, 5]
damping = [2, 2, 2, 0.01, 0.01, 0.01]
"""


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    path = tmp_path_factory.mktemp("turning") / "turning.toml"
    path.write_text(TURNING)
    return symgen.load(path)


@pytest.mark.parametrize(
    ("method", "step", "same", "near"),
    [
        ("dop853", None, 1e-6, 1e-6),
        # Up to half a minute of compiling.
        pytest.param("radau5", None, 1e-6, 1e-6, marks=pytest.mark.slow),
        pytest.param("rattle4", 1e-3, 1e-9, 1e-5, marks=pytest.mark.slow),
    ],
)
def test_bodies_that_turn(turning, method, step, same, near):
    """At any width the same; near single runs with the method, and runs of another one that are exact."""
    rate = {"slide": 0.3, "ball_wx": 1.0, "ball_wy": -2.0, "ball_wz": 3.0, "move_wx": 0.5, "move_wy": 2.0}
    asked = {"n": 9, "seed": 1, "rate": rate, "parameters": {"m": uniform(1, 3)}, "rtol": 1e-9, "atol": 1e-11}
    e = turning.ensemble(0.5, method=method, step=step, frames=4, **asked)
    assert not e.verdicts.singly.any(), e.notes
    assert e.health.ok
    for k in (0, 8):
        states = np.array([e[x][k] for x in e.names]).T
        assert np.array_equal(e.member(k, e.t).states, states)
        given = {"rate": rate, "parameters": {"m": float(e.varied["m"][k])}, "t_eval": e.t}
        run = turning.run(0.5, method=method, step=step, rtol=1e-9, atol=1e-11, **given)
        exact = turning.run(0.5, method="dop853", rtol=1e-12, atol=1e-14, **given)
        assert np.abs(states - run.states).max() < same
        assert np.abs(states - exact.states).max() < near


def test_rattle_that_finds_no_end_fails_as_single_runs_do():
    system, t_end, kept = varied("damped_spring_pendulum")
    e = system.ensemble(t_end, n=3, seed=3, method="rattle", step=t_end / 200, **kept)
    run = system.run(t_end, method="rattle", step=t_end / 200)
    assert len(e.failed) == 3
    assert "Newton" in run.message
    assert (e.verdicts.status == at.NEWTON_FAILED).all()


def test_frames_change_no_step():
    system, t_end, kept = varied("double_pendulum")
    asked = {"n": 9, "seed": 2, "method": "dop853", **kept}
    assert np.array_equal(
        system.ensemble(t_end, **asked)["theta1"], system.ensemble(t_end, frames=50, **asked)["theta1"][:, -1]
    )


def test_threads_and_processes_give_the_same():
    system, t_end, kept = varied("double_pendulum")
    asked = {"n": 3000, "seed": 4, "rtol": 1e-5, "method": "dop853", **kept}
    one = system.ensemble(t_end, threads=1, **asked)
    two = system.ensemble(t_end, threads=3, **asked)
    with concurrent.futures.ProcessPoolExecutor(1) as executor:
        elsewhere = system.ensemble(t_end, executor=executor, **asked)
    for name in one.names:
        assert one[name].tobytes() == two[name].tobytes() == elsewhere[name].tobytes()


def test_processes_of_loky_give_the_same():
    loky = pytest.importorskip("loky")
    system, t_end, kept = varied("double_pendulum")
    asked = {"n": 3000, "seed": 4, "rtol": 1e-5, "method": "dop853", **kept}
    here = system.ensemble(t_end, **asked)
    with loky.ProcessPoolExecutor(1) as executor:
        elsewhere = system.ensemble(t_end, executor=executor, **asked)
    for name in here.names:
        assert here[name].tobytes() == elsewhere[name].tobytes()


def test_threads_may_need_the_same_code_at_once():
    """Of a system that has compiled nothing yet; starts are assembled in threads, too."""
    system, _, kept = varied("slider_crank")
    e = system.ensemble(0.05, n=6000, seed=1, threads=4, method="dop853", **kept)
    assert e.health.ok


def test_members_that_become_infinite_leave_the_others_alone():
    plan = plan_of("double_pendulum", method="dop853")
    parameters, starts, _ = members_of(plan)
    batch = LaneBatch(plan.system, plan.settings)
    good = batch.run(parameters, starts)
    spoiled = starts.copy()
    spoiled[3, 0], spoiled[11, 2], spoiled[20, 1] = np.nan, np.inf, 1e300
    found = batch.run(parameters, spoiled)
    others = np.setdiff1d(np.arange(200), [3, 11, 20])
    assert found.end[others].tobytes() == good.end[others].tobytes()
    assert (found.column("status")[[3, 11]] < 0).all()


def test_members_of_very_many_steps_run_alone(monkeypatch):
    """Lanes would go on for ever with a motion that does not get on; a run of its own watches for that."""
    monkeypatch.setattr("symgen.runtime.ensemble.plan._MANY_STEPS", 210)
    asked = {"method": "dop853", "start": {"theta1": linspace(0.01, 3.0, 12)}, "rtol": 1e-7}
    e = system_of("double_pendulum").ensemble(10, **asked)
    assert not e.n_failed
    assert 0 < e.verdicts.singly.sum() < 12
    assert (e.verdicts.steps[e.verdicts.singly] > 150).all()
    for k in np.flatnonzero(e.verdicts.singly)[:2]:
        assert e.member(int(k)).states[-1].tobytes() == np.array([e[x][k] for x in e.names]).tobytes()


def test_failed_members_are_told_and_have_no_numbers():
    """A negative mass makes a singular matrix at some place; a limit of steps is one, too."""
    system = system_of("double_pendulum")
    e = system.ensemble(
        10, method="dop853", max_steps=210, start={"theta1": linspace(0.01, 3.0, 12)}, rtol=1e-7
    )
    assert 0 < e.n_failed < 12
    assert np.isnan(e["theta1"][e.failed]).all()
    assert np.isfinite(e["theta1"][np.setdiff1d(np.arange(12), e.failed)]).all()
    assert not e.health.ok
    assert "more steps than allowed" in " ".join(e.health.lines())
    assert e.member(int(e.failed[0])).status == "failed"
    asked = {"method": "dop853", "max_steps": 210, "start": {"theta1": linspace(0.01, 3.0, 12)}, "rtol": 1e-7}
    nothing = system.ensemble(10, keep=None, reduce={"theta1": ["count"]}, **asked)
    assert np.array_equal(nothing.failed, e.failed)
    assert nothing.health.causes == e.health.causes
    assert nothing.reduced["theta1"]["count"] == 12 - e.n_failed


def test_doubtful_members_are_found():
    """At loose tolerances the energy of a fast pendulum is off: single runs say so, members too."""
    system = system_of("double_pendulum")
    e = system.ensemble(60, method="dop853", rtol=1e-3, atol=1e-3, start={"theta1": linspace(0.05, 2.5, 16)})
    for k in range(16):
        run = system.run(
            60, method="dop853", rtol=1e-3, atol=1e-3, start={"theta1": float(e.varied["theta1"][k])}
        )
        energy = next(entry for entry in run.health if entry.check == "energy")
        if 0.3 < energy.value / energy.limit < 3.0:
            continue  # the steps are not the same
        if e.verdicts.ok[k]:
            assert energy.ok, (k, energy.value, e.verdicts.energy_error[k])
        else:  # by its energy, or by how far its motion is off
            assert not all(entry.ok for entry in run.health), k
    assert 0 < len(e.doubtful)


@pytest.mark.parametrize("frames", [None, 11])
@pytest.mark.parametrize(("model", "name", "bounds"), [("bouncing_ball", "y", (0.6, 1.5))])
def test_what_resets_do_is_judged_in_machine_code(model, name, bounds, frames):
    """Members with events of the model's own: the bits and the verdicts of `system.run`, without Python."""
    system = system_of(model)
    asked = {"method": "dopri5"}
    e = system.ensemble(3.0, n=6, seed=2, start={name: uniform(*bounds)}, frames=frames, **asked)
    assert not _prepared(e.plan).why_python
    for k in range(6):
        times = (3.0,) if frames is None else e.t
        run = system.run(3.0, start={name: float(e.varied[name][k])}, t_eval=times, **asked)
        assert len(run.events) > 1
        kept = np.array([e[x][k] for x in e.names]).T
        assert np.array_equal(kept, run.states[-1] if frames is None else run.states)
        assert e.verdicts.ok[k] == all(h.ok for h in run.health if h.check in JUDGED)


@pytest.mark.parametrize("name", MODELS)
def test_verdicts_are_those_of_single_runs(name):
    """At a loose tolerance: what the report of a single run objects to, of energy and constraints."""
    system, t_end, kept = varied(name)
    e = system.ensemble(t_end, n=4, seed=3, rtol=1e-4, atol=1e-6, method="dop853", **kept)
    for k in range(4):
        values = {place: {x: float(e.varied[x if place != "rate" else f"dot({x})"][k]) for x in given}
                  for place, given in kept.items()}  # fmt: skip
        run = system.run(t_end, rtol=1e-4, atol=1e-6, method="dop853", **values)
        judged = [h for h in run.health if h.check in ("status", "finite", "energy", "constraint position")]
        energy = next(h for h in judged if h.check == "energy")
        if not 0.5 < energy.value / energy.limit < 2.0:  # the steps are not the same
            assert e.verdicts.ok[k] == all(h.ok for h in judged), (k, energy, e.verdicts.energy_error[k])


JUDGED = ("status", "finite", "energy", "constraint position", "stops")


def close_to_a_limit(run):
    """Whether other steps than those of the run may get another verdict."""
    sized = [h for h in run.health if h.check in ("energy", "constraint position") and h.limit]
    return any(0.3 < h.value / h.limit < 3.0 for h in sized)


@pytest.mark.slow
@pytest.mark.parametrize("rtol", [1e-8, 1e-4])
@pytest.mark.parametrize("name", [*MODELS, *STIFF])
def test_two_hundred_members_are_their_single_runs(name, rtol):
    """Each of 200: its own run to the last bit, and the verdicts of its health report and of `system.run`'s."""
    system, t_end, kept = varied(name)
    e = system.ensemble(t_end, n=200, seed=11, rtol=rtol, atol=rtol * 1e-2, **kept)
    assert not e.verdicts.singly.any(), e.notes
    compared = 0
    for k in range(200):
        again = e.member(k)
        assert again.states[-1].tobytes() == np.array([e[x][k] for x in e.names]).tobytes(), k
        objections = [h.check for h in again.health if not h.ok and h.check in JUDGED]
        assert e.verdicts.ok[k] == (not objections), (k, objections, e.verdicts.energy_error[k])
        values = {place: {x: float(e.varied[x if place != "rate" else f"dot({x})"][k]) for x in given}
                  for place, given in kept.items()}  # fmt: skip
        run = system.run(t_end, rtol=rtol, atol=rtol * 1e-2, method=e.method, **values)
        if not close_to_a_limit(run):
            compared += 1
            assert e.verdicts.ok[k] == all(h.ok for h in run.health if h.check in JUDGED), (k, run.health)
    assert compared or rtol == 1e-4


# Model, method, step, what varies: no lanes for these.
ALONE = {
    "bouncing_ball": ("dopri5", None, "start", "y", (0.6, 1.5), 1.0),
    "newtons_cradle": ("auto", None, "parameters", "", (0.95, 1.05), 1.0),
    "spring_pendulum": ("dopri5", None, "parameters", "m", (0.5, 1.5), 1.0),
    "stick_slip": ("rk4", 1e-3, "rate", "x", (0.1, 0.4), 2.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ALONE)
def test_two_hundred_members_without_lanes_are_single_runs(name):
    """To the last bit those of `system.run`, and with its verdicts."""
    method, step, place, varies, bounds, t_end = ALONE[name]
    system = system_of(name)
    if place == "parameters" and varies not in {r["name"] for r in system.parameters}:
        varies = system.parameters[0]["name"]
        value = system.parameters[0]["value"]
        bounds = (0.95 * value, 1.05 * value)
    e = system.ensemble(
        t_end, n=200, seed=11, method=method, step=step, **{place: {varies: uniform(*bounds)}}
    )
    assert e.verdicts.singly.all()
    drawn = next(iter(e.varied.values()))
    for k in range(200):
        run = system.run(
            t_end, method=method, step=step, t_eval=(t_end,), **{place: {varies: float(drawn[k])}}
        )
        assert run.states[-1].tobytes() == np.array([e[x][k] for x in e.names]).tobytes(), k
        objections = [h.check for h in run.health if not h.ok and h.check in JUDGED]
        assert e.verdicts.ok[k] == (not objections), (k, objections)


def test_models_that_lanes_cannot_run_go_one_by_one():
    system = system_of("stick_slip")
    e = system.ensemble(1.0, rate={"x": linspace(0.1, 0.4, 3)}, method="rk4", step=1e-3)
    assert any("one after another" in note for note in e.notes)
    assert e.verdicts.singly.all()
    for k in range(3):
        run = system.run(1.0, rate={"x": float(e.varied["dot(x)"][k])}, method="rk4", step=1e-3)
        assert np.array_equal(run["x"][-1], e["x"][k])
        assert np.array_equal(e.member(k)["x"][-1], e["x"][k])


@pytest.mark.parametrize("method", ["dopri5", "gauss8"])
def test_other_methods_run_one_by_one_in_machine_code(method):
    system = system_of("spring_pendulum")
    names, step = [r["name"] for r in system.coordinates], 1e-3 if method == "gauss8" else None
    given = {names[0]: linspace(0.9, 1.2, 40)}
    e = system.ensemble(1.0, method=method, step=step, start=given, frames=5)
    assert e.health.ok
    assert e.verdicts.singly.all()
    for k in (0, 17, 39):
        run = system.run(
            1.0, method=method, step=step, t_eval=e.t, start={names[0]: float(e.varied[names[0]][k])}
        )
        for name in e.names:
            assert np.array_equal(run[name], e[name][k])
            assert np.array_equal(e.member(k, e.t)[name], e[name][k])


def test_starts_follow_parameters():
    """A mechanism is assembled for each member's own lengths, as single runs are."""
    system = system_of("slider_crank")
    plan = plan_of("slider_crank", n=50)
    parameters, starts, failures = members_of(plan)
    assert not failures
    names = [r["name"] for r in system.parameters]
    for k in (0, 7, 49):
        run = system.run(1e-3, parameters=dict(zip(names, parameters[k], strict=False)))
        assert np.allclose(run.states[0], starts[k], rtol=0, atol=1e-12)


def test_starts_that_contradict_constraints_fail_alone():
    system = system_of("slider_crank")
    e = system.ensemble(0.1, parameters={"l": grid(0.3, 0.02, 0.31)}, method="dop853")
    assert list(e.failed) == [1]
    assert e.messages[1]
    assert np.isfinite(e["x"][[0, 2]]).all()


def test_members_without_inertia_are_refused_one_by_one():
    """As single runs are: a negative mass swings backwards, and nothing else would tell."""
    system = system_of("double_pendulum")
    e = system.ensemble(1.0, parameters={"m2": grid(1.0, -0.5, 0.0, 2.0, np.nan)}, method="dop853", rtol=1e-6)
    assert list(e.failed) == [1, 2, 4]
    assert "bodies.bob2.mass: it is -0.5" in e.messages[1]
    assert "nothing determines" in e.messages[2]
    for k in (1, 2):
        with pytest.raises(RuntimeModelError, match=r"at the(se)? parameters"):
            system.run(1.0, parameters={"m2": float(e.varied["m2"][k])})
        with pytest.raises(RuntimeModelError, match=r"at the(se)? parameters"):
            e.member(k)
    with pytest.raises(RuntimeModelError, match="it is -1 at the parameters"):
        system.ensemble(1.0, parameters={"m2": grid(-1.0, -2.0)})


@pytest.mark.parametrize("first", [-1.0, 0.0, np.nan, np.inf])
def test_a_first_member_that_cannot_begin_fails_alone(first):
    """The end of a grid is where a mass vanishes; what is chosen for all is chosen by the next member."""
    system = system_of("double_pendulum")
    e = system.ensemble(1.0, parameters={"m2": np.array([first, 1.0, 2.0])})
    rest = system.ensemble(1.0, parameters={"m2": np.array([1.0, 2.0])})
    assert list(e.failed) == [0] and e.method == rest.method
    assert e["theta1"][1:].tobytes() == rest["theta1"].tobytes()


def test_what_is_no_number_is_no_parameter():
    """One that no equation reads at these values, or only as 1/x, would leave no other trace."""
    e = system_of("double_pendulum").ensemble(1.0, parameters={"g": np.array([9.81, np.inf, np.nan, 3.0])})
    assert list(e.failed) == [1, 2]
    assert e.messages[1] == "'g' is inf: give a finite number"


@pytest.mark.parametrize("first", [np.nan, -np.inf])
@pytest.mark.parametrize("method", ["radau5", "dop853"])
def test_no_member_ends_the_others(first, method):
    """Also where members run one after another, and whichever comes first to a thread."""
    system = symgen.load("bouncing_ball")
    values = np.array([first, 0.5, 0.6, first, 0.7])
    e = system.ensemble(1.0, parameters={"e": values}, method=method, threads=2)
    assert list(e.failed) == [0, 3]
    rest = system.ensemble(1.0, parameters={"e": values[[1, 2, 4]]}, method=method)
    assert e[e.names[0]][[1, 2, 4]].tobytes() == rest[rest.names[0]].tobytes()


def test_more_than_a_machine_holds_is_refused_before_it_is_filled():
    system = system_of("pendulum")
    with pytest.raises(RuntimeModelError, match=r"series of all members need .* GiB, .* --out runs.zarr"):
        system.ensemble(1.0, n=10**11, parameters={"L": uniform(1.0, 2.0)})
    lines = {name: linspace(1.0, 2.0, 10**5) for name in ("L", "m", "g")}
    with pytest.raises(RuntimeModelError, match=r"1e\+15 members are asked for"):
        system.ensemble(1.0, parameters=lines, keep=None)
    with pytest.raises(RuntimeModelError, match="frames is 1000000000: give 16777216 at most"):
        system.ensemble(1.0, n=2, parameters={"L": uniform(1.0, 2.0)}, frames=10**9)


def test_linkages_go_on_from_the_first_that_can_be_assembled():
    e = system_of("four_bar").ensemble(0.2, parameters={"d": np.array([3.0, 0.3])})
    assert list(e.failed) == [0]
    assert "cannot hold" in e.messages[0]


def test_grids_multiply_and_draws_repeat():
    system = system_of("double_pendulum")
    e = system.ensemble(
        0.1, n=5, seed=1, parameters={"m1": grid(1, 2), "m2": linspace(1, 3, 3), "L1": normal(1, 0.1)}
    )
    assert e.n == 30
    assert e.shape == {"m1": 2, "m2": 3, "draw": 5}
    assert np.array_equal(e["m1"].reshape(2, 3, 5)[:, 0, 0], [1, 2])
    assert np.array_equal(e["m2"].reshape(2, 3, 5)[0, :, 0], [1, 2, 3])
    assert np.array_equal(e["L1"][:5], e["L1"][25:])
    again = system.ensemble(0.1, n=2000, seed=1, parameters={"L1": normal(1, 0.1), "g": choice(9, 10)})
    assert np.array_equal(again["L1"][:5], e["L1"][:5])
    assert set(again["g"]) == {9.0, 10.0}
    assert abs(again["L1"].mean() - 1) < 0.01
    assert abs(again["L1"].std() - 0.1) < 0.01


def test_arrays_go_row_by_row():
    system = system_of("double_pendulum")
    e = system.ensemble(0.1, parameters={"m1": np.array([1.0, 2.0, 3.0])}, start={"theta1": [0.1, 0.2, 0.3]})
    assert e.n == 3
    run = system.run(0.1, method=e.method, parameters={"m1": 2.0}, start={"theta1": 0.2})
    assert np.isclose(e["theta1"][1], run["theta1"][-1], rtol=1e-7)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"parameters": {"L3": normal(1, 0.1)}, "n": 2}, "L3"),
        ({"start": {"theta3": linspace(0, 1, 2)}}, "theta3"),
        ({"parameters": {"L1": normal(1, 0.1)}}, "how many"),
        ({"n": 4}, "nothing is drawn"),
        ({"parameters": {"L1": [1.0, 2.0], "L2": [1.0, 2.0, 3.0]}}, "one length"),
        ({"parameters": {"L1": normal(1, -0.1)}, "n": 2}, "negative"),
        ({"parameters": {"L1": linspace(1, 2, 2)}, "keep": ["nothing"]}, "nothing"),
        ({"parameters": {"L1": linspace(1, 2, 2)}, "reduce": {"theta1": ["median"]}}, "median"),
        ({"parameters": {"L1": linspace(1, 2, 2)}, "frames": [3.0, 1.0]}, "rise"),
        ({"parameters": {"L1": linspace("1 kg", "2 kg", 2)}}, "L1"),
        ({"parameters": {"L1": linspace(1, 2, 2)}, "keep": "all"}, "keep"),
    ],
)
def test_what_makes_no_sense_is_refused(options, said):
    with pytest.raises((RuntimeModelError, UnknownNameError), match=said):
        system_of("double_pendulum").ensemble(0.1, **options)


def test_reductions_are_those_of_all_members():
    system = system_of("double_pendulum")
    asked = {"n": 2500, "seed": 1, "parameters": {"L1": normal(1, 0.05)}, "rtol": 1e-5, "method": "dop853"}
    wanted = ["mean", "std", "min", "max", "count", quantiles(0.05, 0.5), histogram(10)]
    e = system.ensemble(
        1.0, **asked, reduce={"theta1": wanted, "square": (lambda m: m["theta1"] ** 2, ["mean"])}
    )
    values, found = e["theta1"], e.reduced["theta1"]
    assert np.isclose(found["mean"], values.mean(), rtol=1e-12)
    assert np.isclose(found["std"], values.std(ddof=1), rtol=1e-10)
    assert (found["min"], found["max"], found["count"]) == (values.min(), values.max(), 2500)
    for share, value in found["quantiles"].items():
        assert abs((values < value).mean() - share) < 3e-3
    counts = found["histogram"]
    assert counts["counts"].sum() + counts["below"] + counts["above"] == 2500
    assert np.array_equal(counts["counts"], np.histogram(values, counts["edges"])[0])
    assert np.isclose(e.reduced["square"]["mean"], (values**2).mean(), rtol=1e-12)
    nothing = system.ensemble(1.0, **asked, keep=None, frames=3, reduce={"theta1": ["mean"]})
    assert nothing.names == []
    assert nothing.reduced["theta1"]["mean"].shape == (3,)
    assert np.isclose(nothing.reduced["theta1"]["mean"][-1], values.mean(), rtol=1e-12)


def test_moments_and_digest_merge():
    values = np.random.default_rng(0).lognormal(size=20_000)
    values[77] = np.nan
    moments, digest = Moments(), Digest()
    for part in np.array_split(values, 37):
        moments.take(part)
        digest.take(part)
    assert np.isclose(moments.get("mean"), np.nanmean(values), rtol=1e-12)
    assert np.isclose(moments.get("std"), np.nanstd(values, ddof=1), rtol=1e-10)
    assert moments.get("count") == 19_999
    for share in (0.001, 0.01, 0.5, 0.99, 0.999):
        assert abs((values < digest.quantile(share)).mean() - share) < 3e-4 + 0.02 * share * (1 - share)
    assert len(digest._means) < 500


@pytest.mark.parametrize(
    ("text", "n"),
    [("0.9:1.1:5", 5), ("grid(1, 2, 3)", 3), ("linspace(0, 1, 4)", 4), ("1 cm : 2 cm : 3", 3)],
)
def test_grids_are_read(text, n):
    found = read_variation(text).in_si("x", lambda x: float(str(x).split()[0]))
    assert len(found.values) == n


@pytest.mark.parametrize("text", ["1:2", "a:b:c", "evil(1)", "normal(1)", "normal(1,)", "1:2:3.5"])
def test_what_is_no_variation_is_refused(text):
    with pytest.raises(RuntimeModelError):
        read_variation(text).in_si("x", float)


def test_an_interrupt_keeps_what_is_done():
    system, done = system_of("double_pendulum"), []

    def progress(n, of, failed):
        done.append(n)
        if len(done) == 2:
            raise KeyboardInterrupt

    e = system.ensemble(
        1.0, n=5000, parameters={"L1": normal(1, 0.05)}, progress=progress, threads=1, method="dop853"
    )
    assert e.n_done == done[-1] < 5000
    assert np.isfinite(e["theta1"][: e.n_done]).all()
    assert np.isnan(e["theta1"][e.n_done :]).all()


def test_what_is_kept_goes_to_files(tmp_path):
    system = system_of("double_pendulum")
    e = system.ensemble(1.0, n=7, parameters={"L1": normal(1, 0.05)}, frames=3)
    e.save(tmp_path / "runs.npz")
    with np.load(tmp_path / "runs.npz") as file:
        assert np.array_equal(file["theta1"], e["theta1"])
        assert np.array_equal(file["L1"], e["L1"])
        assert np.array_equal(file["t"], e.t)
    e.to_parquet(tmp_path / "runs.parquet")
    table = parquet.read_table(tmp_path / "runs.parquet")
    assert table.num_rows == 7
    assert np.array_equal(np.array(table["theta1"].to_pylist()), e["theta1"])


# A model for each row of the table in docs/ensembles.md, what varies, and inputs; a method of each column.
FEATURES = {
    "constraints": ("slider_crank", "r", {}),
    "constraints that follow from others": ("bricard", "g", {}),
    "quaternions": ("heavy_top_absolute", "g", {}),
    "what time alone does, and its jumps": ("quarter_car", "bump", {}),
    "inputs over time: tables, functions, noise": ("cart_pole", "g", {"F": Table([0.0, 1.0], [0.0, 5.0])}),
    "events that reset, record or end motion without constraints and quaternions": ("bouncing_ball", "g", {}),
    "stops, dry friction of a given size along lines": ("stick_slip", "mu", {}),
}
COLUMNS_OF_DOCS = ("dop853", "taylor", "radau5", "rk4", "rattle")


@pytest.mark.parametrize(
    "feature", [pytest.param(f, marks=[pytest.mark.slow] if f == "quaternions" else []) for f in FEATURES]
)
def test_what_the_page_says_of_lanes_is_so(feature):
    page = (Path(__file__).parents[1] / "docs" / "ensembles.md").read_text()
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in page.splitlines()
        if line.startswith("| ")
    ]
    said = {row[0]: [cell != "no" for cell in row[1:]] for row in rows}[feature]
    name, parameter, inputs = FEATURES[feature]
    system = system_of(name)
    value = next(r["value"] for r in system.parameters if r["name"] == parameter)
    for method, runs in zip(COLUMNS_OF_DOCS, said, strict=True):
        options = EnsembleOptions(
            t_end=0.1, n=2, method=method, step=1e-3 if method in ("rk4", "rattle") else None, inputs=inputs,
            parameters={parameter: uniform(0.99 * value, 1.01 * value)},
        )  # fmt: skip
        try:
            plan = make_plan(system, options)
        except RuntimeModelError as refused:
            assert not runs, refused
            continue
        assert (plan.settings is not None) == runs, (method, plan.notes)


def test_chunks_under_way_are_given_up_with_an_executor_that_is_closed():
    """A Dask client that is closed refuses to cancel; that is no error of who stops reading."""

    class Future:
        def result(self):
            return 1

        def cancel(self):
            raise RuntimeError("Client is closed")

    running = in_order(lambda first, last: Future(), [(0, 1), (1, 2), (2, 3)], ahead=2)
    assert next(running) == 1
    running.close()


@pytest.mark.parametrize(
    "first, n, size, block, places", [(0, 1_523_712, 4, 1, 4), (3, 50, 4, 2, 2), (0, 1, 8, 8, 3)]
)
def test_chunks_are_whole_blocks_and_shorter_at_the_end(first, n, size, block, places):
    """Each member is in one of them, and the last ones are no longer than what the others have left."""
    chunks = chunks_between(first, n, size, block, places)
    assert [a for a, _ in chunks] == [first, *(b for _, b in chunks[:-1])] and chunks[-1][1] == n
    lengths = [b - a for a, b in chunks]
    assert all(length % block == 0 and length <= size for length in lengths[:-1])
    assert all(
        length <= max(block, (n - a) / (2 * places) + block) for (a, _), length in zip(chunks, lengths)
    )


@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize(("name", "method"), [("double_pendulum", "taylor"), ("slider_crank", "dop853"),
                                              ("rolling_disc", "taylor"), ("cart_pole", "rk4")])  # fmt: skip
def test_members_of_many_lanes_are_those_of_one(monkeypatch, name, method, wide):
    """Small models of many members take two registers for each number where these are wide; the same bits."""
    monkeypatch.setattr("symgen.runtime.ensemble.batch.has_wide_registers", lambda: wide)
    system, t_end, kept = varied(name)
    step = t_end / 100 if method == "rk4" else None
    e = system.ensemble(t_end, n=259, seed=3, rtol=1e-6, method=method, step=step, frames=3, **kept)
    assert e.plan.settings.lanes == (16 if wide else 8)
    assert not e.verdicts.singly.any() and not e.n_failed
    for k in (0, 17, 258):
        assert np.array_equal(e.member(k, e.t).states, np.array([e[x][k] for x in e.names]).T)


def test_ensembles_in_threads_leave_each_other_alone():
    system = system_of("double_pendulum")

    def ends(seed):
        e = system.ensemble(1.0, n=8, seed=seed, start={"theta1": uniform(-1, 1)}, method="dop853", threads=2)
        return e["theta1"]

    expected = [ends(seed) for seed in range(4)]
    with concurrent.futures.ThreadPoolExecutor(4) as executor:
        for k, found in enumerate(executor.map(lambda k: ends(k % 4), range(120))):
            np.testing.assert_array_equal(found, expected[k % 4])
