"""What "auto" takes for an ensemble: one method and order, by a sample of its members, the same whoever asks."""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from symgen import load
from symgen.runtime.ensemble import method_choice, noise, uniform
from symgen.runtime.ensemble.batch import LaneBatch
from symgen.runtime.ensemble.method_choice import Choice, numbers_of_sample
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import make_plan
from symgen.runtime.ensemble.run import plan_for
from symgen.runtime.ensemble.zarr_store import ZarrStore
from symgen.runtime.errors import RuntimeModelError

# Model, end, what varies, rtol, the method that measurements find the faster one by a third or more.
CLEAR = {
    "bouncing_ball": (5.0, {"start": {"y": uniform(1.0, 1.2)}}, 1e-8, "dop853"),
    "seven_dof_arm": (5.0, {"start": {"q1": uniform(-0.1, 0.1)}}, 1e-4, "dop853"),
    "bricard": (2.0, {"parameters": {"g": uniform(9.0, 10.0)}}, 1e-8, "dop853"),
    "double_pendulum": (10.0, {"start": {"theta1": uniform(1.37, 1.77)}}, 1e-12, "taylor"),
    "slider_crank": (2.0, {"start": {"theta": uniform(0.4, 0.6)}}, 1e-12, "taylor"),
    "four_bar": (2.0, {"parameters": {"g": uniform(9.0, 10.0)}}, 1e-12, "taylor"),
}
STIFF = ("radau5", "radau9", "radau13")
CLOSE = {
    "quarter_car": (2.0, {"parameters": {"bump": uniform(0.06, 0.1)}}, 1e-7, ""),
    "stiff_bushing_pendulum": (1.0, {"parameters": {"m": uniform(0.95, 1.05)}}, 1e-7, ""),
    "spring_pendulum": (10.0, {"parameters": {"m": uniform(0.5, 1.5)}}, 1e-6, ""),
    "rolling_disc": (10.0, {"parameters": {"g": uniform(9.0, 10.0)}}, 1e-8, ""),
}


def options_of(name, **more):
    t_end, varied, rtol, _ = {**CLEAR, **CLOSE}[name]
    return EnsembleOptions(
        **{"t_end": t_end, "n": 1000, "seed": 1, "rtol": rtol, "atol": rtol * 1e-2, **varied, **more}
    )


@pytest.mark.parametrize("name", CLEAR)
def test_the_faster_method_is_chosen(name):
    system = load(name)
    plan = make_plan(system, options_of(name))
    assert plan.method == CLEAR[name][3]
    assert any(f"method auto: {plan.method}" in note and "8 of 1000 members" in note for note in plan.notes)
    again = make_plan(load(name), options_of(name, threads=1))
    assert (again.choice, again.settings.order) == (plan.choice, plan.settings.order)


@pytest.mark.parametrize(
    ("rtol", "orders"),
    [(1e-4, ("radau9", "radau13")), (1e-7, ("radau9", "radau13"))],
)
@pytest.mark.slow
def test_stiff_methods_of_all_orders_are_weighed(rtol, orders):
    """Runs by themselves take radau5 at 1e-4; lanes spare what a step of a run has besides, and long steps pay."""
    varied = {"parameters": {"bump": uniform(0.06, 0.1)}}
    plan = make_plan(load("quarter_car"), EnsembleOptions(t_end=2.0, n=200, seed=1, rtol=rtol, **varied))
    assert plan.method in orders
    assert all(name in plan.notes[0] for name in ("radau5", "radau9", "radau13", "dop853", "taylor"))


@pytest.mark.slow
def test_a_stiff_method_that_fails_is_left_out(monkeypatch):
    system = load("quarter_car")
    tried = method_choice._stiff_trial

    def failing(name, *others):
        return None if name == "radau13" else tried(name, *others)

    monkeypatch.setattr(method_choice, "_stiff_trial", failing)
    varied = {"parameters": {"bump": uniform(0.06, 0.1)}}
    plan = make_plan(system, EnsembleOptions(t_end=2.0, n=200, seed=1, rtol=1e-4, **varied))
    assert plan.method in ("radau5", "radau9")
    assert "radau13" not in plan.notes[0]


def seconds(system, plan, members):
    """Least processor time of lanes for some members."""
    parameters, varied = plan.members.arrays(plan.p, 0, members)
    starts, _ = plan.starts.of(parameters, varied)
    batch, least = LaneBatch(system, plan.settings), np.inf
    for _ in range(6):
        began = time.thread_time()
        batch.run(parameters, starts)
        least = min(least, time.thread_time() - began)
    return least


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CLEAR, *CLOSE])
def test_the_choice_is_near_the_best(name):
    """Within 1.2 of the best by measured time on a quiet machine; others may be busy here."""
    system = load(name)
    plan = make_plan(system, options_of(name))
    chosen = seconds(system, plan, 256)
    methods = STIFF if plan.method in STIFF else ("dop853", "taylor")
    others = [seconds(system, make_plan(system, options_of(name, method=method)), 256) for method in methods]
    assert chosen < 1.35 * min(others)


def test_a_sample_is_spread_evenly():
    assert numbers_of_sample(3) == [0, 1, 2]
    assert numbers_of_sample(800) == [50, 150, 250, 350, 450, 550, 650, 750]


def test_trials_take_their_share(monkeypatch):
    """Steps of all trials, beside those of the ensemble."""
    system, steps = load("double_pendulum"), []
    tried = method_choice._tried

    def counted(system, settings, sample, each, t_end):
        found = tried(system, settings, sample, each, t_end)
        share = (settings.t_end - settings.t_start) / (t_end - settings.t_start)
        steps.append(found[0].steps.sum() * share)
        return found

    monkeypatch.setattr(method_choice, "_tried", counted)
    for n in (64, 200, 1000):
        steps.clear()
        e = system.ensemble(10.0, n=n, seed=1, rtol=1e-8, start={"theta1": uniform(1.37, 1.77)})
        assert len(steps) in (3, 4)  # the first is taken again where it was too short to tell
        share = 0.08 * e.verdicts.steps.sum()  # series of low order take more steps than the chosen
        short = [taken for taken in steps if taken < 1.1 * 8 * method_choice._TELLING_STEPS]
        assert sum(steps) < share or len(short) == len(steps)


def test_members_are_the_same_alone_and_in_other_processes():
    """Method and order of the choice, not those of their own."""
    system = load("double_pendulum")
    asked = {"n": 200, "seed": 1, "rtol": 1e-12, "start": {"theta1": uniform(1.37, 1.77)}}
    e = system.ensemble(2.0, **asked)
    assert e.plan.choice.order == e.plan.settings.order > 0
    for k in (0, 77, 199):
        assert e.member(k).states[-1].tobytes() == np.array([e[x][k] for x in e.names]).tobytes()
        assert e.member(k).method == e.method
    with ProcessPoolExecutor(1) as pool:
        there = system.ensemble(2.0, **asked, executor=pool)
    for name in e.names:
        assert np.array_equal(e[name], there[name])


def test_a_store_goes_on_as_it_began(tmp_path):
    """With its own choice, although this process would make another one; by a given method it is another ensemble."""
    pytest.importorskip("zarr")
    system, path = load("double_pendulum"), tmp_path / "runs.zarr"
    asked = {
        "t_end": 1.0,
        "n": 200,
        "seed": 1,
        "start": {"theta1": uniform(1.37, 1.77)},
        "out": path,
        "keep": ["theta1"],
    }
    other = Choice("dop853", 0, 12345, ("method auto: dop853, as another machine found",))
    plan = make_plan(system, EnsembleOptions(**asked), other)
    ZarrStore.create(path, plan, ["theta1"], 64)
    found = plan_for(system, EnsembleOptions(**asked, resume=True))
    assert found.choice == other
    assert make_plan(system, EnsembleOptions(**asked)).choice != other
    with pytest.raises(RuntimeModelError, match="method"):
        system.ensemble(**asked, method="taylor", resume=True)
    e = system.ensemble(**asked, resume=True)
    assert e.method == "dop853"
    assert e.member(3)["theta1"][-1] == e["theta1"][3]


@pytest.mark.parametrize(
    "stored",
    [None, 3, {}, {"method": "no", "order": 0, "most_steps": 0, "notes": []},
     {"method": "taylor", "order": 10**9, "most_steps": 0, "notes": []},
     {"method": "taylor", "order": 12, "most_steps": -1, "notes": []},
     {"method": "taylor", "order": 12, "most_steps": 1, "notes": "no"},
     {"method": ["taylor"], "order": 12, "most_steps": 1, "notes": []}],
)  # fmt: skip
def test_files_that_say_nonsense_say_nothing(stored):
    assert Choice.from_json(stored) is None


def test_members_of_another_kind_run_by_themselves():
    """A limit of steps in lanes, set low: those beyond it are runs of their own, with the method they choose."""
    system = load("double_pendulum")
    asked = {"t_end": 3.0, "n": 64, "seed": 1, "start": {"theta1": uniform(0.1, 3.0)}, "rtol": 1e-8}
    usual = make_plan(system, EnsembleOptions(**asked)).choice
    assert usual.most_steps >= 20_000
    free = system.ensemble(**asked)
    limit = int(np.median(free.verdicts.steps))

    def choose(*_):
        return replace(usual, most_steps=limit)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("symgen.runtime.ensemble.plan.choose_once", choose)
        e = system.ensemble(**asked)
    assert not e.n_failed and 0 < e.verdicts.singly.sum() < 64
    assert np.array_equal(e.verdicts.singly, free.verdicts.steps > limit)
    kept, own = ~e.verdicts.singly, np.flatnonzero(e.verdicts.singly)
    assert np.array_equal(e["theta2"][kept], free["theta2"][kept])
    np.testing.assert_allclose(e["theta2"], free["theta2"], atol=1e-4)
    k = int(own[0])
    assert e.member(k)["theta2"][-1] == e["theta2"][k]
    # A limit of the user's is one: such members have failed.
    limited = system.ensemble(**asked, max_steps=limit)
    assert np.array_equal(limited.failed, own)


def test_what_fails_in_lanes_is_tried_by_itself():
    """A member that becomes infinite does so by itself, too, and keeps its cause."""
    from symgen import Model, dot

    m = Model("escape")
    x = m.coordinate("x", start=1.0)
    m.kinetic(0.5 * dot(x) ** 2)
    m.force(x, m.parameter("b", 0.0) * x**3)
    e = m.derive().ensemble(10.0, parameters={"b": np.linspace(-1.0, 1.0, 65)})
    later = e.varied["b"] > 0.2
    assert set(e.failed) == set(np.flatnonzero(e.varied["b"] > 0.0)) or later[e.failed].sum() == later.sum()
    assert e.verdicts.singly[e.failed].all()
    k = int(e.failed[-1])
    assert "t = " in e.messages[k]
    assert e.member(k).status == "failed"


def test_trials_of_stiff_methods_have_the_noise_of_their_members(monkeypatch):
    """They are single runs: each has the course of inputs over time that its member has, not that of member 0."""
    from symgen import Model, dot

    m = Model("shaken")
    x = m.coordinate("x")
    shake = m.input("shake")
    m.kinetic(0.5 * dot(x) ** 2)
    m.force(x, -1e6 * (dot(x) - shake) - x)
    system, seen = m.derive(), []

    class Watched(method_choice.LoopArrays):
        def __init__(self, driven, *given, **how):
            seen.append(driven.all_pieces[0].coefficients.ravel()[:8])
            super().__init__(driven, *given, **how)

    monkeypatch.setattr(method_choice, "LoopArrays", Watched)
    gusts = noise(1.0, 0.05)
    asked = {"t_end": 2.0, "n": 640, "seed": 4, "rtol": 1e-5, "inputs": {"shake": gusts}}
    assert make_plan(system, EnsembleOptions(**asked)).choice.method.startswith("radau")
    for number, course in zip(numbers_of_sample(640), seen, strict=False):
        assert course[0] == gusts.table("shake", 4, number, 0.0, 2.0).values[0], number
