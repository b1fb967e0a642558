"""Equal subsystems in the lanes of vector registers: each moves, rests, fails and is recorded as if by itself."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model, cos, dot, sin
from symgen.link import derive
from symgen.runtime import solve
from symgen.runtime.ensemble import batch
from symgen.runtime.ensemble.batch import BatchSettings, LaneBatch
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.run import run_ensemble
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.integrate.methods.taylor import taylor
from symgen.runtime.subsystems import groups, in_lanes
from symgen.runtime.subsystems.decomposition import divide
from symgen.runtime.subsystems.in_lanes import InLanes


def swings(n: int, damping: float = 0.0, lengths=None) -> Model:
    """Elastic pendulums of two coordinates, each with parameters and a start of its own, in one field of gravity."""
    m = Model("swings")
    g, u = m.parameter("g", 9.81), m.input("wind", default=0.02)
    for k in range(n):
        length = lengths[k] if lengths else 0.5 + 0.01 * k
        l, c = m.parameter(f"l{k}", length), m.parameter(f"c{k}", damping)
        theta = m.coordinate(f"theta{k}", start=0.5 + 0.02 * k, rate=0.1)
        r = m.coordinate(f"r{k}", start=length)
        x, y = r * sin(theta), -r * cos(theta)
        m.kinetic(0.1 * (dot(x) ** 2 + dot(y) ** 2) / 2)
        m.potential(0.1 * g * y + 20 / l * (r - l) ** 2)
        m.force(f"theta{k}", u * l)
        if damping:
            m.dissipation(c * dot(r) ** 2 / 2)
    return m


def tops(n: int) -> Model:
    """Bodies that turn about their centres: quaternions."""
    m = Model("tops")
    for k in range(n):
        m.body(f"b{k}", mass=1.0, com=(0, 0, 0.1), inertia=(0.1, 0.2, m.parameter(f"i{k}", 0.15 + 0.01 * k)))
        m.joint(f"j{k}", "spherical", child=f"b{k}")
    m.gravity(x=-m.parameter("g", 9.81))
    return m


def beads(n: int) -> Model:
    """Beads on circles of their own: constraints."""
    m = Model("beads")
    m.gravity(y=-m.parameter("g", 9.81))
    for k in range(n):
        x, y = m.coordinate(f"x{k}", guess=0.6), m.coordinate(f"y{k}", guess=-0.8)
        m.body(f"bead{k}", mass=m.parameter(f"m{k}", 0.3 + 0.01 * k), com=(x, y))
        m.constraint(f"circle{k}", x**2 + y**2 - m.parameter(f"r{k}", 1.0 + 0.05 * k) ** 2)
    return m


@pytest.fixture
def early(monkeypatch):
    """Lanes, however few steps there are."""
    monkeypatch.setattr(groups, "_WORTH", 0)
    monkeypatch.setattr(groups, "_WORTH_PER_OPERATION", 0)


def in_lanes_of(found) -> list[InLanes]:
    return [s for s in found.parts.found if isinstance(s, InLanes)]


MODELS = {
    "dop853": (lambda: swings(19), "dop853"),
    "damped": (lambda: swings(19, 0.3), "dop853"),
    "taylor": (lambda: swings(19), "taylor"),
    "quaternions": (lambda: tops(9), "dop853"),
    "constraints": (lambda: beads(9), "dop853"),
    "constraints, taylor": (lambda: beads(9), "taylor"),
}


@pytest.mark.parametrize("name", MODELS)
def test_each_moves_as_by_itself(early, monkeypatch, name):
    """The oracle integrates each by itself, in a scalar loop, at tolerances a thousand times as tight."""
    make, method = MODELS[name]
    system = derive(make())
    options = {"t_end": 4.0, "method": method, "split": True}
    found = solve(system, rtol=1e-8, atol=1e-10, **options)
    (group,) = in_lanes_of(found)
    n = len(group.titles)
    assert any(note.startswith(f"subsystems: {n} of {n} in lanes") for note in found.notes)
    assert found.ok, [h for h in found.health if not h.ok]
    monkeypatch.setattr("symgen.runtime.subsystems.simulate.grouped", lambda found, _: list(found))
    exact = solve(system, rtol=1e-11, atol=1e-13, **options)
    if method == "taylor":  # series by themselves would be of an order of their own
        lanes = BatchSettings(method, 0.0, 4.0, 1e-8, 1e-10, np.zeros(0))
        monkeypatch.setitem(METHODS, method, taylor(LaneBatch(group.system, lanes).order))
    alone = solve(system, rtol=1e-8, atol=1e-10, **options)
    assert all(len(s.titles) == 1 for s in alone.parts.found)
    errors = [np.abs(run.q - exact.q).max() for run in (found, alone)]
    assert errors[0] < 4.0 * errors[1] + 1e-11 and errors[0] < 1e-6
    np.testing.assert_allclose(found.w, exact.w, atol=1e-7)
    steps = [abs(a - b) for a, b in zip(group.steps_of_each(), (s.run.n_steps for s in alone.parts.found))]
    assert max(steps) <= 0.1 * max(group.steps_of_each()) + 2
    assert found.energy.max_error < 1e-7
    title, error = found.parts.worst_energy()
    assert error < 1e-7 and title.startswith("subsystem of ")


def test_the_bits_of_a_member_of_an_ensemble(early):
    """Whatever else is in the scene, and however long it is watched: those of the model of one in an ensemble."""
    options = {"method": "taylor", "split": True, "t_eval": np.linspace(0.0, 2.0, 21)}
    found, fewer = (solve(derive(swings(n)), t_end=2.0, **options) for n in (19, 11))
    (group,) = in_lanes_of(found)
    e = run_ensemble(group.system, EnsembleOptions(
        2.0, method="taylor", frames=21, parameters={"l0": group.p[:, 1]},
        start={"theta0": group.state[:, 0], "r0": group.state[:, 1]}, keep=["theta0", "r0"],
    ))  # fmt: skip
    assert [record["name"] for record in group.system.parameters] == ["g", "l0"]
    for k in range(19):
        assert np.array_equal(found[f"theta{k}"], e["theta0"][k])
        if k < 11:
            assert np.array_equal(found[f"r{k}"], fewer[f"r{k}"])


def test_many_small_ones_share_sixteen_lanes_to_the_same_bits(early, monkeypatch):
    system = derive(swings(19))
    options = {"t_end": 1.0, "method": "taylor", "split": True}
    few = solve(system, **options)
    monkeypatch.setattr(batch, "has_wide_registers", lambda: True)
    monkeypatch.setattr(batch, "_FEWEST_FOR_MANY", 19)
    many = solve(system, **options)
    assert [in_lanes_of(x)[0].run._lanes.lanes for x in (few, many)] == [8, 16]
    assert np.array_equal(few.states, many.states)


def test_parameters_of_members_are_worked_out_once_for_all():
    """What follows from each row of them is what follows from it alone, in one call from Python."""
    whole = derive(swings(9))
    (kind,), _ = divide(whole)
    system, p = kind.system, whole.parameter_values()[kind.p]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(system), "update_precomputed", None)  # that of one row
        rows = system.precomputed_rows(p)
    assert np.array_equal(rows, [system.precomputed(row) for row in p])


def test_legs_do_not_depend_on_frames_or_the_end(early, monkeypatch):
    monkeypatch.setattr(in_lanes, "_LEG", 0.5)
    system = derive(swings(9))
    options = {"method": "dop853", "split": True}
    long = solve(system, t_end=8.0, t_eval=np.arange(0.0, 8.5, 0.5), at=[1.25], **options)
    (group,) = in_lanes_of(long)
    assert 0.5 < group.leg < 2.0 and group.run._leg > 3
    watched = solve(system, t_end=8.0, t_eval=np.arange(0.0, 8.01, 0.05), **options)
    assert np.array_equal(long.q, watched.q[::10])
    short = solve(system, t_end=6.0, t_eval=np.arange(0.0, 6.5, 0.5), **options)
    k = int((6.0 // group.leg) * group.leg / 0.5)
    assert k >= 8 and np.array_equal(short.q[: k + 1], long.q[: k + 1])
    whole = solve(system, t_end=8.0, split=False, rtol=1e-11, atol=1e-13, t_eval=long.t)
    np.testing.assert_allclose(long.q, whole.q, atol=1e-6)
    assert long.energy.max_error < 1e-7


def test_who_joins(early):
    """Not what rests, nor twins, nor fewer than fill the lanes; nor where steps are limited."""
    lengths = [0.5 + 0.001 * k for k in range(8)] + [0.005, 0.5015, 0.5015]
    system = derive(swings(11, lengths=lengths))
    start = {"theta9": 0.7, "theta10": 0.7}
    options = {"t_end": 0.5, "method": "dop853", "split": True, "start": start}
    (group,) = in_lanes_of(found := solve(system, **options))
    assert len(group.titles) == 9 and "subsystem of theta8" in group.titles
    twins = next(s for s in found.parts.found if len(s.columns) == 2)
    assert twins.titles == ["subsystem of theta9", "subsystem of theta10"]
    for limits in ({"max_step": 0.01}, {"max_steps": 10_000}, {"method": "rk4", "step": 0.01}):
        assert not in_lanes_of(solve(system, **{**options, **limits}))
    assert not in_lanes_of(solve(derive(swings(7)), t_end=0.5, method="dop853", split=True))


def test_what_rests_is_left_alone_and_what_comes_to_rest_sleeps(early, monkeypatch):
    monkeypatch.setattr(in_lanes, "_LEG", 0.5)
    m = Model("resting")
    for k in range(10):
        x = m.coordinate(f"x{k}", start=0.0 if k == 4 else 0.1 + 0.01 * k)
        c = m.parameter(f"c{k}", 1.0 if k == 7 else 0.0)
        m.kinetic(dot(x) ** 2 / 2)
        m.potential(m.parameter(f"k{k}", 4.0) * x**2 / 2)
        m.dissipation(c * dot(x) ** 2 / 2)
    system = derive(m)
    found = solve(system, t_end=100.0, method="dop853", split=True)
    by_title = {title: s for s in found.parts.found for title in s.titles}
    assert by_title["subsystem of x4"].run.n_steps == 0
    (group,) = in_lanes_of(found)
    times = dict(zip(group.titles, group.rests_from(), strict=True))
    assert 40.0 < times.pop("subsystem of x7") < 90.0 and not np.isfinite([*times.values()]).any()
    assert any(note.startswith("asleep: 2 of 10") for note in found.notes)
    np.testing.assert_allclose(found["x5"], 0.15 * np.cos(2 * found.t), atol=1e-5)
    w = np.sqrt(4.0 - 0.25)
    exact = 0.17 * np.exp(-found.t / 2) * (np.cos(w * found.t) + 0.5 / w * np.sin(w * found.t))
    np.testing.assert_allclose(found["x7"], exact, atol=1e-8)
    assert found.ok


def test_few_steps_do_without():
    """A kernel for lanes takes longer to compile than a few steps take."""
    m = Model("slow")
    for k in range(16):
        x = m.coordinate(f"x{k}", start=1.0 + 0.01 * k)
        m.kinetic(dot(x) ** 2 / 2)
        m.potential(m.parameter(f"k{k}", 1.0) * x**2 / 2)
    found = solve(derive(m), t_end=0.2, method="dop853", split=True)
    assert len(found.parts.found) == 16


def test_samples_and_energies_of_all(early):
    """They land on times and count energies as single subsystems do."""
    system = derive(swings(17, 0.3))
    options = {"t_end": 1.0, "method": "dop853", "rtol": 1e-10, "atol": 1e-12, "at": [0.3, 0.7]}
    found, one = solve(system, split=True, **options), solve(system, split=False, **options)
    assert [len(s.titles) for s in found.parts.found] == [17]
    for ours, theirs in zip(found.samples, one.samples, strict=True):
        assert ours.t == theirs.t
        np.testing.assert_allclose(ours.q, theirs.q, atol=1e-8)
        assert ours.energy == pytest.approx(theirs.energy, rel=1e-8)
    assert found.energy.max_error < 1e-8
    assert len(found.step_log) > 5 and np.all(np.diff(found.step_log[:, 0]) > 0.0)


def test_one_that_fails_in_lanes_runs_by_itself_and_is_named(early):
    """Becoming infinite ends the run of all, by the name of the one; frames up to there are kept."""
    m = Model("failing")
    for k in range(9):
        x = m.coordinate(f"x{k}", start=1.0 + 0.01 * k)
        m.kinetic(dot(x) ** 2 / 2)
        m.force(x, m.parameter(f"b{k}", 1.0 if k == 5 else -1.0) * x**3)
    found = solve(derive(m), t_end=5.0, method="dop853", split=True)
    assert found.status == "failed" and "subsystem of x5: " in found.message
    assert len(found.t) == len(found.q) and 0.5 < found.t[-1] < 2.0 and np.isfinite(found.q).all()
    still = solve(
        derive(m), t_end=found.t[-1], t_eval=found.t, method="dop853", split=False, rtol=1e-11, atol=1e-13
    )
    np.testing.assert_allclose(found.q[:-2], still.q[:-2], rtol=1e-4)


def test_one_whose_series_fail_goes_on_with_another_method(early, monkeypatch):
    """As by itself: lanes leave it, and its own run changes the method; the others keep their bits."""
    system = derive(swings(9))
    options = {"t_end": 3.0, "split": True, "method": "auto"}
    usual = solve(system, **options)
    assert in_lanes_of(usual)
    take = in_lanes.LaneRun._take_statistics

    def failing(self, live, result):
        take(self, live, result)
        result.columns[4, 1] = -1  # status of member 4: the step became too small

    monkeypatch.setattr(in_lanes.LaneRun, "_take_statistics", failing)
    found = solve(system, **options)
    others = [k for k in range(18) if k // 2 != 4]
    assert np.array_equal(found.q[:, others], usual.q[:, others])
    np.testing.assert_allclose(found.q, usual.q, atol=1e-6)
    assert not np.array_equal(found.q, usual.q)  # sine and cosine, the last step
    assert found.status == "success" and found.ok


def test_recorded_as_one_scene_and_resumed(early, tmp_path):
    from symgen.link import derive_text
    from symgen.runtime.recording.reader import read_recording
    from symgen.runtime.recording.recorder import RunRecorder
    from symgen.runtime.recording.resume import Resumed

    model, path, made = swings(9), tmp_path / "swings.rrd", []
    system, text = derive(model), derive_text(model).text

    def recorder(**settings):
        made.append(RunRecorder(path, module_text=text, model_text="", **settings))
        return made[0]

    options = {"method": "taylor", "split": True, "fps": 50.0}
    found = solve(system, 1.0, recorder=recorder, **options)
    made[0].finish(found.status, [], found.stats)
    assert in_lanes_of(found)
    recorded = read_recording(path)
    assert np.array_equal(recorded.t, found.t) and np.array_equal(recorded.q, found.q)
    whole = solve(system, 1.5, **options)
    resumed = Resumed(path).run(1.5)
    assert np.array_equal(resumed.t, whole.t) and np.array_equal(resumed.q, whole.q)
