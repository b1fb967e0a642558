"""Frictions and jumps that machine code acts on: what Python makes of the same events, and closed forms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from recorded import assert_same_recording, record

import symgen
from symgen import Model
from symgen.runtime import frictions_in_code, jumps_in_code, load
from symgen.runtime.constraints.levels import Constraints, coordinate_sizes
from symgen.runtime.constraints.size_code import fit_sizes, make_sizing
from symgen.runtime.contact.lone_friction import LoneFriction
from symgen.runtime.contact.settings import Layout
from symgen.runtime.contact.switching import Switching
from symgen.runtime.driver import Run
from symgen.runtime.inputs import Controller, Polynomial, Table
from symgen.runtime.recording.reader import read_recording
from symgen.runtime.recording.verify import verify

METHODS = ("taylor", "dop853", "radau5", "bdf", "gauss6", "rk4", "verlet", "generalized_alpha")
TWO = """
name = "two"
[parameters]
M = "1 kg"
k = "3 N/m"
mu = "0.1 N"
F = "0.9 N"
vb = "0.7 m/s"
far = "1.1 m"
low = "0.9 m"
[coordinates]
x = { unit = "m", start = 0.0, rate = 1.0 }
y = { unit = "m", start = 1.0, rate = -0.4 }
[energy]
kinetic = "M*(dot(x)^2/2 + dot(y)^2 + 0.3*dot(x)*dot(y))"
potential = "k/2*x^2 + k*(x - y)^2/2"
[forces]
x = "F"
[friction.a]
coordinate = "x"
force = "mu"
static = "1.5*mu"
[friction.b]
speed = "dot(y) - vb"
force = "0.8*mu"
"""
STOPS = """
[stops.wall]
gap = "far - x"
restitution = 0.95
[stops.other]
gap = "y + low + 0.1*x"
restitution = 1
[events.mark]
when = "x - y"
then = "record"
"""
RESTING = """
name = "resting"
[parameters]
M = "1 kg"
k = "30 N/m"
far = "1 m"
low = "0.1 m"
g = "9.81 m/s^2"
push = "14 N"
belt = "7 m/s"
rub = "0.02 N"
[coordinates]
x = { unit = "m", start = 0.3, rate = 1.0 }
y = { unit = "m", start = 1.0 }
[energy]
kinetic = "M*(dot(y)^2/2 + dot(x)^2/2*(1 + 0.3*sin(y/far)^2) + 0.2*dot(x)*dot(y))"
potential = "M*g*y + k/2*(x - 3*low)^2"
[forces]
y = "push*sin(1.3*t)"
[stops.floor]
gap = "y + low*sin(3*x/far)"
restitution = 0.4
[stops.wall]
gap = "6*low - x"
"""
TURNING = """
name = "turning"
[parameters]
l = 0.001
[coordinates]
a = { start = 2e5, rate = 0.2 }
b = { start = 0.0, rate = 0.2 }
[energy]
kinetic = "dot(a)^2/2 + dot(b)^2/2"
[forces]
a = "-0.5*sin(t)"
b = "-0.2 + 0.5*cos(0.7*t)"
[stops.low]
gap = "l*(cos(a) + 1.02) + 0.00003*b"
restitution = 0.3
[stops.far]
gap = "3 + b"
restitution = 0
"""
RUBBING = """
[friction.a]
speed = "dot(y) - belt"
force = "rub"
"""
OSCILLATOR = """
name = "oscillator"
[parameters]
k = 4.0
a = 0.5
[coordinates]
x = { start = 1.0, rate = 0.3 }
[energy]
kinetic = "dot(x)^2/2"
potential = "k/2*x^2"
[forces]
x = "FORCE"
"""
FORCES = ("-a*sign(x)", "-a*where(x > 0.1, 1, 0.3)", "-a*abs(x)", "-a*max(x, 0)")
ON_A_CIRCLE = """
name = "on_a_circle"
[coordinates]
x = { start = 0.6 }
y = { start = -0.8 }
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2"
potential = "9.81*y"
[constraints]
length = "x^2 + y^2 - 1"
[forces]
x = "-0.5*sign(x - 0.1) - 0.2*abs(y + 0.9)"
"""


def system(text):
    return Model.from_toml(text).derive()


def both(monkeypatch, model, t_end, **options):
    """The run by Python alone, and the run with machine code, which acts on all or all but a few of the events."""
    with monkeypatch.context() as patch:
        patch.setattr(frictions_in_code, "has_plain_frictions", lambda *_: False)
        patch.setattr(jumps_in_code, "has_plain_jumps", lambda *_: False)
        patch.setattr(jumps_in_code, "has_events_beside_jumps", lambda *_: False)
        by_python = model.run(t_end, **options)
    acted = count_acts(monkeypatch)
    return by_python, model.run(t_end, **options), acted


def count_acts(monkeypatch):
    """A list that gets an entry for each event which Python acts on."""
    acted, act = [], Run._on_event

    def on_event(self):
        acted.append(self.arrays.t)
        return act(self)

    monkeypatch.setattr(Run, "_on_event", on_event)
    return acted


def assert_same(mine, theirs):
    assert [repr(event) for event in mine.events] == [repr(event) for event in theirs.events]
    np.testing.assert_array_equal(mine.states, theirs.states)
    np.testing.assert_array_equal(mine.w, theirs.w)
    np.testing.assert_array_equal(mine.step_log, theirs.step_log)
    assert mine.energy.max_error == theirs.energy.max_error
    if mine.forms is not None:
        np.testing.assert_array_equal(mine.forms.settings, theirs.forms.settings)
        np.testing.assert_array_equal(mine.forms.index, theirs.forms.index)


@pytest.mark.parametrize("method", METHODS)
def test_stick_and_slip_have_the_same_bits(monkeypatch, method):
    by_python, in_code, acted = both(monkeypatch, symgen.load("stick_slip"), 20.0, method=method)
    assert len(in_code.events) > 40
    assert len(acted) <= 3  # the first ones, and one in the step that passes the end
    assert_same(in_code, by_python)
    assert in_code.ok == by_python.ok


@pytest.mark.parametrize(
    "given", [{"breaks": [0.3, 1.7, 1.9, 4.4, 12.0]}, {"max_step": 0.05}], ids=["breaks", "longest"]
)
@pytest.mark.parametrize("method", ("taylor", "dop853", "radau5", "bdf"))
def test_steps_that_keep_to_times_have_the_same_bits(monkeypatch, method, given):
    by_python, in_code, acted = both(monkeypatch, symgen.load("stick_slip"), 20.0, method=method, **given)
    assert len(in_code.events) > 40
    assert len(acted) <= 3
    assert_same(in_code, by_python)
    assert in_code.ok == by_python.ok


@pytest.mark.parametrize("method", METHODS)
def test_coupled_frictions_and_stops(monkeypatch, method):
    """Speeds that are taken away, and impulses, differ in the last digit: events are the same, states but for that."""
    by_python, in_code, acted = both(
        monkeypatch, system(TWO + STOPS), 60.0, method=method, rtol=1e-9, atol=1e-11
    )
    told = [(event.name, event.action) for event in in_code.events]
    assert told == [(event.name, event.action) for event in by_python.events]
    assert {action for _, action in told} == {"stick", "slip", "turn", "impact", "record"}
    assert len(acted) <= 4
    times = [[event.t for event in run.events] for run in (in_code, by_python)]
    np.testing.assert_allclose(*times, rtol=0, atol=1e-6)
    np.testing.assert_allclose(in_code.states, by_python.states, atol=1e-6)
    np.testing.assert_array_equal(in_code.forms.index, by_python.forms.index)
    np.testing.assert_allclose(in_code.forms.settings, by_python.forms.settings)
    np.testing.assert_allclose(in_code.lowest_gaps, by_python.lowest_gaps, atol=1e-4)  # at ends of steps
    np.testing.assert_allclose(
        [event.work for event in in_code.events], [event.work for event in by_python.events], atol=1e-6
    )


@pytest.mark.parametrize("text", [RESTING, RESTING + RUBBING], ids=["stops", "friction"])
def test_stops_that_stay_closed_for_a_while(monkeypatch, text):
    """A mass on a rough floor is pushed up and falls again, beside a wall: impacts, rest and release."""
    by_python, in_code, acted = both(monkeypatch, system(text), 30.0, method="dop853", rtol=1e-10, atol=1e-12)
    told = [(event.name, event.action) for event in in_code.events]
    assert told == [(event.name, event.action) for event in by_python.events]
    actions = [action for _, action in told]
    assert actions.count("release") >= 5 and actions.count("impact") > 100
    # At first, and where the wall is struck beside a floor that is closed.
    assert len(acted) < 0.07 * len(told)
    times = [[event.t for event in run.events] for run in (in_code, by_python)]
    np.testing.assert_allclose(*times, rtol=0, atol=1e-7)
    np.testing.assert_allclose(in_code.states, by_python.states, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(in_code.forms.index, by_python.forms.index)
    np.testing.assert_array_equal(in_code.forms.settings, by_python.forms.settings)
    np.testing.assert_allclose(in_code.lowest_gaps, by_python.lowest_gaps, rtol=0, atol=1e-4)
    assert in_code.ok == by_python.ok


@pytest.mark.parametrize("method", ("dop853", "radau5", "taylor"))
def test_a_pull_that_begins_in_the_last_digits_behind_an_impact_opens_the_stop(method):
    text = OSCILLATOR.replace("k/2*x^2", "9.81*x").replace("start = 1.0, rate = 0.3", "start = 1.0")
    text = text.replace("FORCE", "u") + '[inputs]\nu = {}\n[stops.floor]\ngap = "x"\nrestitution = 0\n'
    model, lands = system(text), np.sqrt(2.0 / 9.81)
    for ticks in (-4, -1, 0, 1, 4):
        begins = lands * (1.0 + 2e-16 * ticks)
        table = Table([0.0, begins, 5.0], [0.0, 20.0, 20.0], kind="hold")
        run = model.run(2.0, method=method, inputs={"u": table})
        assert run.states[-1][0] == pytest.approx(0.5 * 10.19 * (2.0 - begins) ** 2, rel=1e-9)
        assert run.ok


BESIDE_JUMPS = """
name = "beside_jumps"
[coordinates]
x = { start = 1.0, rate = 0.3 }
y = { start = 1.0 }
[inputs]
u = {}
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2"
potential = "2*x^2 + 9.81*y + 10*max(0, y - 0.8)^2"
[forces]
x = "u - sign(x)/2 - 0.01*sign(dot(y))"
y = "-0.02*sign(dot(y)) + 0.1*abs(x)"
[events.mark]
when = "x - y"
then = "record"
"""
FLOORS = {
    "stop": '[stops.floor]\ngap = "y"\nrestitution = 1.0\n',
    "reset": '[events.floor]\nwhen = "y"\ndirection = "falling"\nthen = { reset = { "dot(y)" = "-dot(y)" } }\n',
}


@pytest.mark.parametrize("method", ("taylor", "dop853", "radau5", "bdf"))
@pytest.mark.parametrize("floor", FLOORS)
def test_events_beside_jumps_have_the_same_bits(monkeypatch, floor, method):
    """An impact turns the sign of a rate around, and so forces go over to other branches with it."""
    times = np.linspace(0.0, 10.0, 60)
    given = {
        "inputs": {"u": Table(times, 0.3 * np.sin(7.0 * times), kind="hold" if method == "bdf" else "linear")}
    }
    by_python, in_code, acted = both(
        monkeypatch, system(BESIDE_JUMPS + FLOORS[floor]), 10.0, method=method, **given
    )
    assert len(in_code.events) > 20 and len(acted) <= 3
    assert_same(in_code, by_python)
    assert in_code.ok == by_python.ok


ARM = """
name = "arm"
[parameters]
f1 = 1.9
f2 = 1.0
[coordinates]
a = { start = 0.5 }
b = { start = -0.3 }
[energy]
kinetic = "1.5*dot(a)^2 + dot(b)^2/2 + 0.6*dot(a)*dot(b)*cos(a - b)"
potential = "-1.5*cos(a) - 0.5*cos(b)"
[forces]
a = "3*sin(t)"
b = "1.5*sin(1.7*t + 1)"
[friction.shoulder]
coordinate = "a"
force = "f1"
static = "1.2*f1"
[friction.elbow]
coordinate = "b"
force = "f2"
"""
HELD_TOGETHER = {
    "frictions": ARM,
    "stop": ARM + '[stops.low]\ngap = "b + 0.1*a + 0.6"\nrestitution = 0.3\n',
    "jumps": ARM.replace('"3*sin(t)"', '"min(max(5*sin(t), -3), 3) - 0.1*sign(b)"'),
    "reset": ARM
    + '[events.kick]\nwhen = "b - 0.2"\ndirection = "rising"\nthen = { reset = { "dot(b)" = "0.8*dot(b)" } }\n',
}


@pytest.mark.parametrize("kind", HELD_TOGETHER)
def test_what_is_held_and_moves_each_other(monkeypatch, kind):
    """Inertia ties the joints of an arm: what one friction takes when it sticks or slips, the other feels."""
    model = system(HELD_TOGETHER[kind])
    by_python, in_code, acted = both(monkeypatch, model, 60.0, method="dop853", rtol=1e-10, atol=1e-12)
    told = [(event.name, event.action) for event in in_code.events]
    assert told == [(event.name, event.action) for event in by_python.events]
    assert in_code.forms.settings[:, Layout(model).stuck].all(axis=1).any()  # both stick now and then
    assert len(told) > 50 and len(acted) <= 4
    times = [[event.t for event in run.events] for run in (in_code, by_python)]
    np.testing.assert_allclose(*times, rtol=0, atol=1e-8)
    np.testing.assert_allclose(in_code.states, by_python.states, rtol=0, atol=1e-8)
    np.testing.assert_array_equal(in_code.forms.index, by_python.forms.index)
    np.testing.assert_array_equal(in_code.forms.settings, by_python.forms.settings)
    assert in_code.ok == by_python.ok


def test_jumps_beside_what_is_held_far_from_letting_go_are_not_settled_in_full(monkeypatch):
    """The same as where each jump is: most leave the wall closed and the belt rough enough."""
    model, settled, settle = system(PUSHED), [], Switching.act
    monkeypatch.setattr(
        Switching, "act", lambda self, fired, **how: settled.append(len(fired)) or settle(self, fired, **how)
    )
    period = 0.05
    times = np.arange(0.0, 20.0 + period, period)
    given = {"inputs": {"u": Table(times, np.sin(3.0 * times), kind="hold")}, "method": "dop853"}
    short = model.run(20.0, **given)
    few = settled.count(0)
    settled.clear()
    monkeypatch.setattr(Switching, "is_untouched", lambda *_: False)
    full = model.run(20.0, **given)
    assert settled.count(0) >= len(times) - 2
    assert few < 0.2 * settled.count(0)
    told = [[(event.name, event.action) for event in run.events] for run in (short, full)]
    assert told[0] == told[1]
    assert len(told[0]) > 15
    assert short.forms.settings[short.forms.index].any(axis=1).mean() > 0.5
    np.testing.assert_allclose(short.states, full.states, rtol=0, atol=1e-9)


def without_units(text):
    return re.sub(r'"(-?[\d.]+) [^"]*"', r"\1", text).replace('unit = "m", ', "")


TIMES = np.linspace(0.0, 20.0, 41)
GIVEN = {
    "linear": {"inputs": {"u": Table(TIMES, np.sin(2.0 * TIMES))}},
    "steps": {"inputs": {"u": Table(TIMES, np.sin(2.0 * TIMES), kind="hold")}},
    "polynomial": {"inputs": {"u": Polynomial([0.1, 0.02])}},
    "sampled": {"inputs": {"u": Controller(lambda t, x: 0.4 * np.sin(3.0 * t) - 0.1 * x[1], period=0.3)}},
    "breaks": {"breaks": [0.3, 1.7, 1.9, 4.4, 12.0]},
}
PUSHED = """
name = "pushed"
[parameters]
M = "1 kg"
F = "1 N"
far = "0.3 m"
belt = "0.2 m/s"
rub = "0.2 N"
heavy = "0.3 N"
k = "3 N/m"
[inputs]
u = {}
[coordinates]
x = { unit = "m", start = 0.1 }
z = { unit = "m", start = 0.0, rate = 0.3 }
[energy]
kinetic = "M*dot(x)^2/2 + M*dot(z)^2"
potential = "k*z^2/2"
[forces]
x = "-F + 1.5*F*cos(t) + F*u"
z = "F*sin(1.7*t)/3 - F*u/9"
[stops.wall]
gap = "x"
[stops.other]
gap = "far - x/5 - z/100"
restitution = 0.5
[friction.a]
speed = "dot(z) - belt"
force = "rub*(1 + u/4)"
static = "heavy"
"""


@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize("method", ("taylor", "dop853", "radau5", "rk4"))
def test_stops_and_frictions_beside_inputs_over_time(monkeypatch, method, given):
    """The wall and the rough belt are held at one time, and have nothing to do with each other."""
    by_python, in_code, acted = both(monkeypatch, system(PUSHED), 20.0, method=method, **GIVEN[given])
    told = [(event.name, event.action) for event in in_code.events]
    assert told == [(event.name, event.action) for event in by_python.events]
    assert {"impact", "release", "stick", "slip"} <= {action for _, action in told}
    assert in_code.forms.settings[:, [0, 2]].all(axis=1).any()
    assert len(acted) <= 2
    times = [[event.t for event in run.events] for run in (in_code, by_python)]
    np.testing.assert_allclose(*times, rtol=0, atol=1e-8)
    np.testing.assert_allclose(in_code.states, by_python.states, rtol=0, atol=1e-8)
    np.testing.assert_array_equal(in_code.forms.settings, by_python.forms.settings)
    np.testing.assert_array_equal(in_code.forms.index, by_python.forms.index)
    np.testing.assert_allclose(in_code.w, by_python.w, rtol=0, atol=1e-8)
    assert in_code.ok == by_python.ok


@pytest.mark.parametrize("text", [without_units(RESTING), TURNING], ids=["resting", "turning"])
def test_stops_of_coordinates_without_units_have_the_same_bits(monkeypatch, text):
    by_python, in_code, acted = both(monkeypatch, system(text), 30.0, method="dop853", rtol=1e-10, atol=1e-12)
    assert len(acted) < 0.3 * len(in_code.events)
    assert_same(in_code, by_python)


RESETS = """
[events.kick]
when = "y - 8*low"
direction = "falling"
then = { reset = { "dot(y)" = "-0.9*dot(y)" } }
[events.mark]
when = "x - 3*low"
then = "record"
"""
PILING = """
name = "piling"
[coordinates]
x = { start = 0.0, rate = 30.0 }
y = { start = 1.0 }
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2"
potential = "9.81*y + x^2"
[friction.a]
coordinate = "x"
force = 1.0
[events.floor]
when = "y"
direction = "falling"
then = { reset = { "dot(y)" = "-0.6*dot(y)" } }
"""


@pytest.mark.parametrize("text", [RESTING, TWO + STOPS], ids=["stops", "frictions"])
def test_resets_beside_stops_and_frictions(monkeypatch, text):
    text += RESETS.replace("[events.mark]", "[events.mark2]") if "[events.mark]" in text else RESETS
    text = text.replace("y - 8*low", "y - 0.8*low") if text.startswith(TWO) else text
    by_python, in_code, acted = both(monkeypatch, system(text), 20.0, method="dop853", rtol=1e-10, atol=1e-12)
    told = [(event.name, event.action) for event in in_code.events]
    assert told == [(event.name, event.action) for event in by_python.events]
    assert sum(action == "reset" for _, action in told) >= 5
    assert len(acted) < 0.2 * len(told)
    times = [[event.t for event in run.events] for run in (in_code, by_python)]
    np.testing.assert_allclose(*times, rtol=0, atol=1e-7)
    np.testing.assert_allclose(in_code.states, by_python.states, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(in_code.forms.settings, by_python.forms.settings)
    changes = [[event.energy_change for event in run.events] for run in (in_code, by_python)]
    np.testing.assert_allclose(*changes, rtol=0, atol=1e-7)
    assert in_code.ok == by_python.ok


def test_resets_that_pile_up_beside_a_friction(monkeypatch):
    by_python, in_code, acted = both(monkeypatch, system(PILING), 20.0, method="dop853")
    assert in_code.status == by_python.status == "zeno"
    assert in_code.message == by_python.message
    assert len(acted) <= 1
    assert_same(in_code, by_python)


SMALL = TURNING.replace("0.00003*b", "0*b").replace("3 + b", "1e-6 + 2*b")


@pytest.mark.parametrize(
    "text", [without_units(RESTING), TURNING, SMALL], ids=["resting", "turning", "micrometres"]
)
def test_sizes_of_coordinates_without_units_are_those_of_python(text):
    model = system(text).closed
    p, random = model.parameter_values(), np.random.default_rng(1)
    p[list(model.switched.values())] = 1.0
    sizing, changed = make_sizing(model, len(p)), 0
    kernel = model.kernel("constraint_residual")
    for size in 10.0 ** np.arange(-9.0, 7.0):
        q = size * random.uniform(-1.0, 1.0, model.nq)
        expected = coordinate_sizes(model, Constraints(model, p, 0.3), q, p)
        found = np.full(model.nq, max(1.0, np.abs(q).max()))
        changed += (expected != found).any()
        fit_sizes(np.uint64(kernel.address), 0.3, q, p, found, sizing)
        np.testing.assert_array_equal(found, expected)
    assert changed > 2


@pytest.mark.parametrize("text", [RESTING, TWO + STOPS], ids=["stops", "frictions"])
def test_a_sample_in_the_step_before_an_event_changes_nothing(text):
    model, options = system(text), {"method": "dop853", "rtol": 1e-10, "atol": 1e-12}
    plain = model.run(8.0, **options)
    watched = model.run(8.0, at=[event.t - 1e-4 for event in plain.events[5:16:5]], **options)
    np.testing.assert_array_equal(watched.states[-1], plain.states[-1])
    np.testing.assert_array_equal(watched.forms.settings, plain.forms.settings)
    assert [repr(event) for event in watched.events] == [repr(event) for event in plain.events]
    whole = model.run(watched.samples[-1].t, **options)
    np.testing.assert_array_equal(watched.samples[-1].q, whole.q[-1])


def test_a_stop_lets_go_when_its_load_does():
    """Closed without a rebound where the mass comes to it, open when the push is what weighs on it."""
    text = RESTING.replace("0.4", "0").replace("low*sin(3*x/far)", "0*x").replace("0.2*dot", "0*dot")
    run = system(text).run(30.0, method="taylor", rtol=1e-12, start={"x": 0.3}, rate={"x": 0.0})
    releases = [event.t for event in run.events if event.action == "release"]
    first = np.arcsin(9.81 / 14.0) / 1.3
    turns = np.round((np.array(releases) - first) * 1.3 / (2.0 * np.pi))
    assert len(releases) >= 4
    np.testing.assert_allclose(releases, first + turns * 2.0 * np.pi / 1.3, rtol=0, atol=1e-10)


@pytest.mark.parametrize("text", [TWO, TWO + STOPS], ids=["frictions", "stops"])
def test_a_friction_alone_is_what_the_complementarity_problem_finds(monkeypatch, text):
    model = system(text)
    monkeypatch.setattr(frictions_in_code, "has_plain_frictions", lambda *_: False)
    alone = model.run(30.0, method="dop853")
    settled, settle = [], Switching._settle
    monkeypatch.setattr(LoneFriction, "_settle_alone", lambda *_: None)
    monkeypatch.setattr(Switching, "_settle", lambda *args: settled.append(1) or settle(*args))
    together = model.run(30.0, method="dop853")
    assert len(settled) > len(together.events) / 2
    assert_same(alone, together)


def test_slips_are_those_of_the_closed_form():
    """The belt carries the block until the spring pulls with all that friction can hold, and each slip is a cosine."""
    solution = symgen.load("stick_slip").run(20.0, method="taylor", rtol=1e-13)
    weight, k, speed = 9.81, 50.0, 0.3
    most, sliding, rate = 0.6 * weight / k, 0.4 * weight / k, np.sqrt(k)
    slips = [event for event in solution.events if event.action == "slip"]
    sticks = [event for event in solution.events if event.action == "stick"]
    phase = np.arctan2(speed / rate, most - sliding)
    lasts = (np.pi + 2.0 * phase) / rate
    np.testing.assert_allclose([event.q_before[0] for event in slips], most, rtol=1e-11)
    n = min(len(slips), len(sticks))
    lasted = [b.t - a.t for a, b in zip(slips[:n], sticks[-n:] if sticks[0].t > slips[0].t else sticks[1:])]
    np.testing.assert_allclose(lasted, lasts, rtol=1e-9)


def test_runs_of_frictions_do_not_depend_on_samples_or_on_where_they_are_cut():
    model = system(TWO)
    plain = model.run(20.0, method="dop853")
    watched = model.run(20.0, method="dop853", at=[0.31, 5.72, 11.5], fps=500)
    np.testing.assert_array_equal(plain.states[-1], watched.states[-1])
    longer = model.run(30.0, method="dop853")
    assert [e.t for e in plain.events] == [e.t for e in longer.events if e.t <= 20.0]


def test_recordings_have_the_same_forms_frames_and_events(monkeypatch, tmp_path):
    text = (Path(__file__).parents[1] / "generated" / "stick_slip.py").read_text(encoding="utf-8")
    paths = [tmp_path / "python.rrd", tmp_path / "code.rrd"]
    for path, in_code in zip(paths, (False, True)):
        with monkeypatch.context() as patch:
            if not in_code:
                patch.setattr(frictions_in_code, "has_plain_frictions", lambda *_: False)
            record(path, text, lambda **more: load(text).run(10.0, method="dop853", fps=30, **more))
    assert len(read_recording(paths[1]).events) > 20
    assert_same_recording(*paths)
    assert verify(paths[1]).ok


def test_series_that_fall_back_while_something_sticks_go_on_in_the_held_form(monkeypatch):
    model, advance, failed = symgen.load("stick_slip"), Run._advance, []
    expected = model.run(10.0, method="dop853", rtol=1e-10)

    def fail_once(self, *args, **options):
        if self.fallback is not None and self.actions.is_held and not failed:
            failed.append(self.arrays.t)
            return -1
        return advance(self, *args, **options)

    monkeypatch.setattr(Run, "_advance", fail_once)
    for in_code in (True, False):
        failed.clear()
        if not in_code:
            monkeypatch.setattr(frictions_in_code, "has_plain_frictions", lambda *_: False)
        found = model.run(10.0, rtol=1e-10)
        assert failed
        assert len(found.events) == len(expected.events) > 20
        np.testing.assert_allclose(found.states[-1], expected.states[-1], atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("force", FORCES)
def test_jumps_and_kinks_have_the_same_bits(monkeypatch, force, method):
    by_python, in_code, acted = both(
        monkeypatch, system(OSCILLATOR.replace("FORCE", force)), 20.0, method=method
    )
    assert len(acted) <= 3  # the first ones, and one in the step that passes the end
    assert_same(in_code, by_python)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("given", GIVEN)
def test_jumps_and_kinks_beside_inputs_have_the_same_bits(monkeypatch, given, method):
    text = OSCILLATOR.replace("FORCE", "u - a*sign(x) - a*where(x > 0.1, 1, 0.3)") + "[inputs]\nu = {}\n"
    by_python, in_code, acted = both(monkeypatch, system(text), 20.0, method=method, **GIVEN[given])
    assert len(acted) <= 6  # the first ones, and those in steps that are as long as what is left of the run
    assert_same(in_code, by_python)


@pytest.mark.parametrize("method", METHODS)
def test_jumps_on_constraints_have_the_same_bits(monkeypatch, method):
    by_python, in_code, acted = both(monkeypatch, system(ON_A_CIRCLE), 10.0, method=method)
    assert len(acted) <= 3  # the first ones, and one in the step that passes the end
    assert_same(in_code, by_python)


def test_the_period_across_a_kink_is_that_of_the_closed_form():
    """A spring of stiffness k on one side, of k + a on the other: half a period of each."""
    solution = system(OSCILLATOR.replace("FORCE", "-a*max(x, 0)")).run(
        1000.0, method="dop853", rtol=1e-12, at=[1000.0]
    )
    soft, hard, t = 2.0, np.sqrt(4.5), 1000.0
    size = np.hypot(1.0, 0.3 / hard)
    left = (np.pi / 2.0 + np.arctan2(0.3 / hard, 1.0)) / hard  # until the first time at 0
    period = np.pi / soft + np.pi / hard
    t = np.fmod(t - left, period)
    low = size * hard / soft
    x = -low * np.sin(soft * t) if t < np.pi / soft else size * np.sin(hard * (t - np.pi / soft))
    assert solution.states[-1][0] == pytest.approx(x, abs=1e-8)


def test_a_force_that_pushes_to_its_jump_from_both_sides_is_refused(monkeypatch):
    by_python, in_code, _ = both(
        monkeypatch, system(OSCILLATOR.replace("FORCE", "-5*a*sign(dot(x))")), 20.0, method="dop853"
    )
    assert in_code.status == by_python.status == "failed"
    assert in_code.message == by_python.message
    assert "from both sides" in in_code.message
