"""Subsystems integrated by themselves: the same motion as of one system, each with its own steps, method and sleep."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model, cos, dot, sin
from symgen.link import derive, derive_text
from symgen.runtime import solve
from symgen.runtime.result_json import result
from symgen.runtime.subsystems.decomposition import divide
from symgen.runtime.subsystems.subsystem import is_at_rest


def swing(m: Model, k: int, length: float, damping: float = 0.0):
    """A pendulum with parameters of its own."""
    l, c = m.parameter(f"l{k}", length), m.parameter(f"c{k}", damping)
    theta = m.coordinate(f"theta{k}", start=0.3 + 0.1 * k)
    m.body(f"bob{k}", mass=0.1, com=(l * sin(theta), -l * cos(theta)))
    m.dissipation(c * dot(theta) ** 2 / 2)
    return theta


def scene() -> Model:
    """Three pendulums, a bead on a circle, a stiff damper, a weight at rest on a spring, and a top."""
    m = Model("scene")
    m.gravity(y=-m.parameter("g", 9.81))
    swings = [swing(m, k, 0.5 + 0.2 * k, 0.01) for k in range(3)]
    x, y = m.coordinate("x", guess=0.6), m.coordinate("y", guess=-0.8)
    m.body("bead", mass=0.3, com=(x, y))
    m.constraint("circle", (x**2 + y**2) ** 0.5 - 1)
    s = m.coordinate("s", start=1.0)
    m.kinetic(dot(s) ** 2 / 2)
    m.potential(2 * s**2)
    m.dissipation(5e4 * dot(s) ** 2)
    z = m.coordinate("z", start=0.3 * 9.81 / 50)
    m.kinetic(0.3 * dot(z) ** 2 / 2)
    m.potential(50 * z**2 / 2 - 0.3 * 9.81 * z)
    m.body("top", mass=1.0, com=(0, 0, 0.3), inertia=(0.1, 0.2, 0.15))
    m.joint("tip", "spherical", child="top")
    m.output("gap", swings[0] - x)
    m.run(t_end=3.0)
    return m


def balls(action="reset", action_of_last: str | None = None) -> Model:
    """Three balls on floors of their own, which lie at different heights."""
    m = Model("balls")
    g = m.parameter("g", 9.81)
    for k in range(3):
        floor, e = m.parameter(f"floor{k}", -0.1 * k), m.parameter(f"e{k}", 0.9 - 0.1 * k)
        x = m.coordinate(f"x{k}", start=1.0)
        m.kinetic(0.5 * dot(x) ** 2)
        m.potential(g * x)
        then = action_of_last if k == 2 and action_of_last else action
        if then == "reset":
            then = {"reset": {f"dot(x{k})": -e * dot(x)}}
        m.event(f"hit{k}", x - floor, direction="falling", then=then)
    m.run(t_end=1.5)
    return m


@pytest.fixture(scope="module")
def mixed():
    return derive(scene())


def test_the_motion_of_one_system(mixed):
    """The oracle integrates everything at once, with another method and much tighter tolerances."""
    apart = solve(mixed, at=[1.0, 2.5])
    one = solve(mixed, at=[1.0, 2.5], split=False, method="dop853", rtol=1e-11, atol=1e-13)
    assert apart.parts is not None and one.parts is None
    np.testing.assert_allclose(apart.q, one.q, atol=2e-7)
    np.testing.assert_allclose(apart.v, one.v, atol=2e-6)
    np.testing.assert_allclose(apart.w, one.w, atol=2e-8)
    for a, b in zip(apart.samples, one.samples, strict=True):
        assert a.t == b.t
        np.testing.assert_allclose(a.q, b.q, atol=2e-7)
        np.testing.assert_allclose(a.multipliers, b.multipliers, atol=1e-5)
        assert a.energy == pytest.approx(b.energy, abs=1e-7)
    assert apart.ok and apart.energy.max_error < 1e-7
    assert {"subsystem energy", "subsystem steps"} <= {entry.check for entry in apart.health}
    assert result(apart)["stats"]["steps"] == sum(s.run.n_steps for s in apart.parts.found)


def test_each_has_its_own_method_and_what_rests_sleeps(mixed):
    apart = solve(mixed)
    chosen = {title: s.choice.method.name for s in apart.parts.found for title in s.titles}
    assert chosen.pop("subsystem of s").startswith("radau")
    assert set(chosen.values()) == {"taylor"}
    asleep = {s.titles[0] for s in apart.parts.found if np.isfinite(s.run.asleep_from)}
    assert asleep == {"subsystem of z"}
    (z,) = (s for s in apart.parts.found if s.titles == ["subsystem of z"])
    assert z.run.n_steps == 0 and np.ptp(apart["z"]) == 0.0
    assert any(note.startswith("asleep: 1 of 7") for note in apart.notes)


@pytest.mark.parametrize("method", ["dop853", "rk4", "radau5"])
def test_the_bits_of_one_pendulum_alone(method):
    """A member of a scene moves as a model of it alone does; so do its twins."""
    several, alone = Model("several"), Model("alone")
    for m in (several, alone):
        m.gravity(y=-m.parameter("g", 9.81))
        for k in range(3 if m is several else 1):
            swing(m, k, 0.5 + 0.1 * k)
    options = {"t_end": 2.0, "method": method, "step": 0.01 if method == "rk4" else None, "split": True}
    found, own = solve(derive(several), **options), solve(derive(alone), **options)
    assert np.array_equal(found["theta0"], own["theta0"])
    assert np.array_equal(found["dot(theta0)"], own["dot(theta0)"])
    assert found.parts.found[0].run.n_steps == own.stats["steps"]


def test_split_by_default_only_where_it_pays():
    """Pendulums of like lengths share their steps; one that is a hundred times as fast does not set those of many."""
    m = Model("lengths")
    m.gravity(y=-m.parameter("g", 9.81))
    for k in range(30):
        swing(m, k, 0.5 + 0.01 * k)
    system = derive(m)
    options = {"t_end": 60.0, "method": "dop853", "start": {f"theta{k}": 0.3 + 0.01 * k for k in range(30)}}
    alike = solve(system, **options)
    assert alike.parts is None and any("common steps cost less" in note for note in alike.notes)
    unlike = solve(system, **options, parameters={"l3": 5e-5})
    assert unlike.parts is not None and sum(len(s.titles) for s in unlike.parts.found) == 30
    one = solve(system, **options, parameters={"l3": 5e-5}, split=False)
    others = [k for k in range(30) if k != 3]
    np.testing.assert_allclose(unlike.q[:, others], one.q[:, others], atol=1e-5)


def test_twins_are_integrated_once():
    m = Model("twins")
    m.gravity(y=-m.parameter("g", 9.81))
    for k in (0, 1, 2):
        swing(m, k, 0.5)
    starts = {"theta1": 0.3}
    found = solve(derive(m), t_end=1.0, method="dop853", start=starts, split=True)
    assert [s.titles for s in found.parts.found] == [
        ["subsystem of theta0", "subsystem of theta1"],
        ["subsystem of theta2"],
    ]
    assert np.array_equal(found["theta0"], found["theta1"]) and not np.array_equal(
        found["theta0"], found["theta2"]
    )


def test_events_of_members():
    """Bounces in closed form: x = 1 - g t²/2 down to each floor, then up with e times the speed."""
    system = derive(balls())
    found = solve(system, method="dop853", rtol=1e-11, atol=1e-13, split=True)
    assert found.parts is not None and found.status == "success"
    expected = []
    for k in range(3):
        v = np.sqrt(2 * 9.81 * (1.0 + 0.1 * k))
        t = v / 9.81
        while t <= 1.5:
            expected.append((t, f"hit{k}"))
            v *= 0.9 - 0.1 * k
            t += 2 * v / 9.81
    expected.sort()
    assert [event.name for event in found.events] == [name for _, name in expected]
    np.testing.assert_allclose([event.t for event in found.events], [t for t, _ in expected], atol=1e-9)
    for event in found.events:
        k = int(event.name[-1])
        fall = event.t if event.t < 0.5 else None
        others = [j for j in range(3) if j != k]
        assert np.array_equal(event.q_before[others], event.q_after[others])
        assert np.array_equal(event.v_before[others], event.v_after[others])
        assert event.v_after[k] == -(0.9 - 0.1 * k) * event.v_before[k]
        if fall is not None and k == 0:  # nothing has bounced before
            np.testing.assert_allclose(event.q_before, 1.0 - 9.81 * event.t**2 / 2, atol=1e-9)
    assert found.energy.max_error < 1e-9
    one = solve(system, method="dop853", rtol=1e-11, atol=1e-13, split=False)
    assert np.array_equal(found.t, one.t)
    np.testing.assert_allclose(found.q, one.q, atol=1e-8)


def test_a_terminating_event_ends_all():
    found = solve(derive(balls("record", "terminate")), method="dop853", rtol=1e-10, split=True)
    t = np.sqrt(2 * 1.2 / 9.81)
    assert found.status == "terminated" and found.t[-1] == pytest.approx(t, abs=1e-9)
    np.testing.assert_allclose(found.q[-1], 1.0 - 9.81 * t**2 / 2, atol=1e-8)
    assert [event.name for event in found.events] == ["hit0", "hit1", "hit2"]
    assert "hit2" in found.message


def test_what_looks_at_several_keeps_them_together():
    m = balls()
    m.event("meet", "x0 - x1", then="record")
    found = solve(derive(m), t_end=0.2, method="dop853", split=True)
    assert found.parts is None
    assert any("integrated as one" in note and "'meet'" in note for note in found.notes)


def test_inputs_over_time_act_on_all():
    """The model was divided before; with a ramp on one mass it is one system again, and the ramp is felt."""
    m = Model("pushed")
    push = m.input("push", default=0.0)
    for k in range(2):
        x = m.coordinate(f"x{k}", start=0.0)
        m.kinetic(0.5 * dot(x) ** 2)
        m.force(x, push * m.parameter(f"share{k}", 1.0 - k))
    system = derive(m)
    assert solve(system, t_end=1.0, method="dop853", split=True).parts is not None
    found = solve(system, t_end=1.0, method="dop853", split=True, inputs={"push": ([0.0, 1.0], [0.0, 6.0])})
    assert found.parts is None and any("inputs over time" in note for note in found.notes)
    np.testing.assert_allclose(found["x0"], found.t**3, atol=1e-8)


def test_a_reset_wakes_what_would_rest():
    """At rest, with an event at a time that sets it moving: it must not sleep."""
    m = Model("kicked")
    for name in ("a", "b"):
        x = m.coordinate(name, start=0.0)
        m.kinetic(0.5 * dot(x) ** 2)
        m.potential(0.5 * m.parameter(f"k_{name}", 4.0) * x**2)
    m.event("kick", "t - 0.5", then={"reset": {"dot(b)": 1.0}})
    found = solve(derive(m), t_end=2.0, method="dop853", rtol=1e-10, atol=1e-12, split=True)
    asleep = [s.titles[0] for s in found.parts.found if np.isfinite(s.run.asleep_from)]
    assert asleep == ["subsystem of a"] and not found["a"].any()
    np.testing.assert_allclose(
        found["b"], np.where(found.t > 0.5, np.sin(2 * (found.t - 0.5)) / 2, 0.0), atol=1e-8
    )


def test_damped_motion_falls_asleep_and_an_unstable_equilibrium_does_not():
    m = Model("settling")
    m.gravity(y=-m.parameter("g", 9.81))
    for k in range(2):
        swing(m, k, 1.0, 0.4)
    system = derive(m)
    found = solve(system, t_end=600.0, method="dop853", start={"theta1": np.pi - 1e-13}, split=True)
    from_rest = {title: s.run.asleep_from for s in found.parts.found for title in s.titles}
    assert 5.0 < from_rest["subsystem of theta0"] < 500.0
    assert abs(found["theta0"][-1]) <= 1e-11  # a tenth of the absolute tolerance
    assert abs(found["theta1"][-1]) < 1e-6  # it fell over
    kinds, _ = divide(system)
    p = system.parameter_values()[kinds[0].p[0]]
    assert not is_at_rest(kinds[0].system, p, 0.0, np.array([np.pi, 0.0]))
    assert is_at_rest(kinds[0].system, p, 0.0, np.array([0.0, 0.0]))
    assert not is_at_rest(kinds[0].system, p, 0.0, np.array([1e-6, 0.0]))


def test_a_failure_names_its_subsystem():
    m = Model("failing")
    for k in range(2):
        x = m.coordinate(f"x{k}", start=1.0 + k)
        m.kinetic(0.5 * dot(x) ** 2)
        m.force(x, m.parameter(f"b{k}", 1.0 - k) * x**3)
    found = solve(derive(m), t_end=10.0, method="dop853", split=True)
    assert found.status == "failed" and found.message.startswith("subsystem of x0: ")
    assert len(found.t) == len(found.q) and found.t[-1] < 2.0


def test_steps_are_counted_together():
    m = Model("counted")
    m.gravity(y=-m.parameter("g", 9.81))
    for k in range(3):
        swing(m, k, 0.5 + 0.1 * k)
    found = solve(derive(m), t_end=50.0, method="dop853", max_steps=300, split=True)
    assert found.status == "failed" and found.stats["steps"] <= 302


def record(path, system, **options):
    from symgen.runtime.recording.recorder import RunRecorder

    made = []

    def recorder(**settings):
        made.append(RunRecorder(path, module_text=text, model_text="", **settings))
        return made[0]

    text = derive_text(balls()).text
    found = solve(system, method="dop853", recorder=recorder, split=True, **options)
    made[0].finish(found.status, [], found.stats)
    return found


def test_recorded_as_one_scene_and_resumed(tmp_path):
    from symgen.runtime.recording.reader import read_recording
    from symgen.runtime.recording.resume import Resumed

    system, path = derive(balls()), tmp_path / "balls.rrd"
    found = record(path, system, t_end=1.0, fps=100.0)
    recorded = read_recording(path)
    assert np.array_equal(recorded.t, found.t)
    assert np.array_equal(recorded.q, found.q) and np.array_equal(recorded.v, found.v)
    assert [event.name for event in recorded.events] == [event.name for event in found.events]
    whole = solve(system, 1.5, method="dop853", fps=100.0, split=True)
    resumed = Resumed(path).run(1.5)
    assert resumed.parts is not None and any("resumed" in note for note in resumed.notes)
    assert np.array_equal(resumed.t, whole.t) and np.array_equal(resumed.q, whole.q)
