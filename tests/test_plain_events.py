"""Events that machine code acts on: what Python makes of the same events, and what both know of them afterwards."""

from __future__ import annotations

import numpy as np
import pytest

import symgen
from symgen import Model
from symgen.runtime import events_in_code, frictions_in_code
from symgen.runtime.event_actions import EventActions, EventLog, ZenoDetector
from symgen.runtime.events_in_code import EventsInCode
from symgen.runtime.inputs import Controller, Polynomial, Table
from symgen.runtime.integrate import plain_events
from symgen.runtime.jumps_in_code import JumpsInCode

take_over = EventsInCode._take_over
METHODS = ("taylor", "dop853", "radau5", "bdf", "rk4")
BALL = """
name = "ball"
[parameters]
e = 0.9
g = "9.81"
[coordinates]
y = { start = 1.0 }
[energy]
kinetic = "1/2*dot(y)^2"
potential = "g*y"
"""
STOP = (
    BALL
    + """
[stops.floor]
gap = "y"
restitution = "e"
"""
)
MARKED = (
    BALL.replace("0.9", "1.0")
    + """
[events.floor]
when = "y"
direction = "falling"
then = { reset = { "dot(y)" = "-e*dot(y)" } }
[events.half]
when = "y - 1/2"
then = "record"
[events.high]
when = "y - 5"
then = "terminate"
"""
)
KICKED = (
    STOP
    + """
[events.high]
when = "y - 1/4"
direction = "rising"
then = { reset = { "dot(y)" = "0.99*dot(y)" } }
"""
)
TWO_STOPS = """
name = "two_stops"
[parameters]
k = "300"
[coordinates]
x = { start = 0.3, rate = 1.0 }
y = { start = 1.0 }
[energy]
kinetic = "1/2*dot(y)^2 + 1/2*dot(x)^2*(1 + 0.3*sin(y/0.7)^2) + 0.2*dot(x)*dot(y)*cos(x)"
potential = "9.81*y + k/2*(x - 0.3)^2"
[stops.floor]
gap = "y + 0.1*sin(3*x)"
restitution = 0.95
[stops.wall]
gap = "1.2 - x"
restitution = 1
[events.mark]
when = "x - 0.3"
then = "record"
"""

PENDULUM = """
name = "pendulum"
[coordinates]
x1 = { start = 0.6 }
y1 = { start = -0.8 }
x2 = { start = 2.0 }
y2 = { guess = -2.0 }
[energy]
kinetic = "dot(x1)^2/2 + dot(y1)^2/2 + dot(x2)^2 + dot(y2)^2"
potential = "9.81*y1 + 19.62*y2"
[constraints]
first = "x1^2 + y1^2 - 1"
second = "(x2 - x1)^2 + (y2 - y1)^2 - 2.25"
[stops.wall]
gap = "x1 + 0.1"
restitution = 0.9
[stops.other]
gap = "x2 + 0.4*y1 + 0.3"
restitution = 0.95
[events.mark]
when = "y2 + 2"
then = "record"
"""


def system(text):
    return Model.from_toml(text).derive()


def both(monkeypatch, model, t_end, **options):
    """The run by Python alone, and the run with machine code."""
    with monkeypatch.context() as patch:
        patch.setattr(events_in_code, "has_plain_events", lambda _: False)
        patch.setattr(events_in_code, "has_impacts_beside_constraints", lambda *_: False)
        patch.setattr(events_in_code, "has_own_events_on_constraints", lambda *_: False)
        patch.setattr(frictions_in_code, "has_plain_frictions", lambda *_: False)
        by_python = model.run(t_end, **options)
    return by_python, model.run(t_end, **options)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("text", [STOP, MARKED, KICKED], ids=["stop", "marked", "kicked"])
def test_one_body_has_the_same_bits(monkeypatch, text, method):
    by_python, in_code = both(monkeypatch, system(text), 4.0, method=method)
    assert_same_bits(in_code, by_python)


def assert_same_bits(in_code, by_python):
    assert len(in_code.events) == len(by_python.events) > 3
    np.testing.assert_array_equal(in_code.states, by_python.states)
    np.testing.assert_array_equal(in_code.w, by_python.w)
    np.testing.assert_array_equal(in_code.step_log, by_python.step_log)
    for mine, theirs in zip(in_code.events, by_python.events):
        assert (mine.name, mine.action, mine.t, mine.energy_change) == (
            theirs.name,
            theirs.action,
            theirs.t,
            theirs.energy_change,
        )
        for name in ("q_before", "v_before", "q_after", "v_after"):
            np.testing.assert_array_equal(getattr(mine, name), getattr(theirs, name))
    if in_code.lowest_gaps is not None:
        np.testing.assert_array_equal(in_code.lowest_gaps, by_python.lowest_gaps)
    assert in_code.ok == by_python.ok


def called(t, x):
    """What a controller gives: more often than the ball bounces, another value."""
    return 0.4 * np.sin(3.0 * t) - 0.1 * x[1]


TIMES = np.linspace(0.0, 4.0, 21)
GIVEN = {
    "linear": {"inputs": {"u": Table(TIMES, np.sin(3.0 * TIMES))}},
    "steps": {"inputs": {"u": Table(TIMES, np.sin(3.0 * TIMES), kind="hold")}},
    "polynomial": {"inputs": {"u": Polynomial([0.1, 0.2])}},
    "sampled": {"inputs": {"u": Controller(called, period=0.05)}},
    "continuous": {"inputs": {"u": Controller(called)}},
    "breaks": {"breaks": [0.3, 0.5, 1.0, 2.2]},
    "longest step": {"max_step": 0.01},
    "time": {"parameters": {"amplitude": 0.3}},
}
DRIVEN = """
[inputs]
u = {}
[forces]
y = "u + amplitude*sin(20*t)"
"""


@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("text", [STOP, MARKED], ids=["stop", "marked"])
def test_inputs_and_times_to_keep_to_leave_the_same_bits(monkeypatch, text, method, given):
    """Work and energy balance are of the same quality, too: the work at impacts is known."""
    if (given, method) in (("longest step", "rk4"), ("continuous", "taylor")):
        pytest.skip("the method refuses it")
    model = system(text.replace("[coordinates]", "amplitude = 0.0\n[coordinates]") + DRIVEN)
    by_python, in_code = both(monkeypatch, model, 4.0, method=method, **GIVEN[given])
    assert_same_bits(in_code, by_python)
    assert in_code.energy.max_error == by_python.energy.max_error
    np.testing.assert_array_equal([e.work for e in in_code.events], [e.work for e in by_python.events])


@pytest.mark.parametrize("given", ["linear", "sampled", "breaks"])
def test_events_between_inputs_are_acted_on_in_code(monkeypatch, given):
    """All but some that fall into the step which passes the end."""
    acted = []
    monkeypatch.setattr(
        EventsInCode, "_take_over", lambda self, actions, n: acted.append(n) or take_over(self, actions, n)
    )
    solution = system(STOP.replace("0.9", "1.0", 1) + DRIVEN.replace("amplitude", "0")).run(
        4.0, method="dop853", **GIVEN[given]
    )
    assert len(solution.events) - 1 <= sum(acted) <= len(solution.events)


@pytest.mark.parametrize(("text", "kind"), [(STOP, "linear"), (MARKED, "hold")], ids=["stop", "marked"])
def test_events_of_python_between_those_in_code_are_known_to_both(monkeypatch, text, kind):
    """Pieces end at every other event, on which Python acts then, and at many times without one."""
    model = system(text + DRIVEN.replace("amplitude", "0"))
    alone = model.run(4.0, method="dop853", inputs={"u": 0.0})
    at_events = [event.t for event in alone.events][::2]
    times = np.unique([*np.linspace(0.0, 4.0, 60), *at_events])
    acted, written = [], []

    def hand_over(self, actions):
        before = self._handed
        hand(self, actions)
        after, (last, *intervals) = self._after, actions.zeno.memory
        written.append(self._handed is not before)
        np.testing.assert_equal(
            after.sums[: plain_events.ACCUMULATION], [actions.energy_of_resets, last or np.nan]
        )
        np.testing.assert_array_equal(after.intervals[: after.counts[plain_events.N_INTERVALS]], intervals)
        np.testing.assert_array_equal(after.lowest, actions.lowest_gaps)

    hand = EventsInCode._hand_over
    monkeypatch.setattr(EventsInCode, "_hand_over", hand_over)
    monkeypatch.setattr(
        EventsInCode, "_take_over", lambda self, actions, n: acted.append(n) or take_over(self, actions, n)
    )
    tiny = Table(times, 1e-15 * (-1.0) ** np.arange(len(times)), kind=kind)  # moves no event by a tick
    by_python, in_code = both(monkeypatch, model, 4.0, method="dop853", inputs={"u": tiny})
    n_events, n_acted, n_calls, n_written = len(in_code.events), sum(acted), len(written), sum(written)
    assert_same_bits(in_code, by_python)  # with health, and runs of its own
    assert 0 < n_acted < n_events
    assert n_written <= n_events + 1 < n_calls


def test_pieces_of_inputs_are_not_copied_at_each_jump(monkeypatch):
    """What a jump takes does not grow with them, and each piece is the one that holds."""
    sizes, bind = [], JumpsInCode._bind
    monkeypatch.setattr(
        JumpsInCode,
        "_bind",
        lambda self: bind(self) or sizes.append((len(self._own.p), len(self._own.branched))),
    )
    model = system(
        'name = "jumps"\n[coordinates]\nx = { start = 1.0 }\n[inputs]\nu = {}\n[energy]\nkinetic = "dot(x)^2/2"\n'
        'potential = "2*x^2"\n[forces]\nx = "u - sign(x)/2"\n'
    )
    ends = []
    for n in (5, 400):  # the same line, in more pieces
        times = np.linspace(0.0, 20.0, n + 1)
        run = model.run(20.0, method="dop853", rtol=1e-10, inputs={"u": Table(times, 0.02 * times)})
        ends.append(run.states[-1])
    assert len(sizes) >= 2 and len(set(sizes)) == 1
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-8)


def test_an_impact_where_an_input_jumps_is_one(monkeypatch):
    """In the last digits of the time of the jump, as well as clearly before or behind it."""
    first = float(np.sqrt(2.0 / 9.81))
    for shift in (-1e-13, -4e-15, -1e-15, -2e-16, 0.0, 2e-16, 1e-15, 1e-13):
        table = Table(np.array([0.0, first + shift, 4.0]), np.array([0.0, 2.0, 2.0]), kind="hold")
        model = system(STOP + DRIVEN.replace("amplitude", "0"))
        by_python, in_code = both(monkeypatch, model, 4.0, method="dop853", inputs={"u": table})
        assert_same_bits(in_code, by_python)
        assert [event.action for event in in_code.events] == ["impact"] * 5
        assert in_code.events[0].t == pytest.approx(first, abs=1e-14)
        speed = 0.9 * np.sqrt(2.0 * 9.81)
        later = first + 2.0 * speed / 7.81
        assert in_code.events[1].t == pytest.approx(later, abs=1e-9)
        assert in_code.ok


@pytest.mark.parametrize("method", METHODS)
def test_several_stops_and_coupled_masses(monkeypatch, method):
    """Impulses differ in the last digit, which impacts make grow: before that, events are the same."""
    by_python, in_code = both(monkeypatch, system(TWO_STOPS), 1.5, method=method, rtol=1e-10, atol=1e-12)
    assert [e.name for e in in_code.events] == [e.name for e in by_python.events]
    assert {e.name for e in in_code.events} >= {"floor", "mark"}
    np.testing.assert_allclose(
        [e.t for e in in_code.events], [e.t for e in by_python.events], rtol=0, atol=1e-8
    )
    np.testing.assert_allclose(in_code.states, by_python.states, atol=1e-6)
    np.testing.assert_allclose(in_code.w, by_python.w, atol=1e-6)
    assert in_code.energy.max_error < 1e-5
    assert in_code.ok


def counted(monkeypatch):
    """How many events machine code acts on, a number for each call."""
    acted = []
    monkeypatch.setattr(
        EventsInCode, "_take_over", lambda self, actions, n: acted.append(n) or take_over(self, actions, n)
    )
    return acted


@pytest.mark.parametrize("method", ["taylor", "dop853"])
def test_impacts_beside_constraints(monkeypatch, method):
    """Impulses keep the lengths of both rods, as they do in Python by singular values."""
    acted = counted(monkeypatch)
    by_python, in_code = both(monkeypatch, system(PENDULUM), 3.0, method=method, rtol=1e-10, atol=1e-12)
    events = in_code.events
    assert sum(acted) == len(events) == len(by_python.events)
    assert [e.name for e in events] == [e.name for e in by_python.events]
    assert {e.name for e in events} == {"wall", "other", "mark"}
    np.testing.assert_allclose([e.t for e in events], [e.t for e in by_python.events], rtol=0, atol=1e-9)
    np.testing.assert_allclose(in_code.states, by_python.states, rtol=0, atol=1e-7)
    for event in events:
        (x1, y1, x2, y2), (u1, w1, u2, w2) = event.q_after, event.v_after
        assert abs(x1 * u1 + y1 * w1) < 1e-12
        assert abs((x2 - x1) * (u2 - u1) + (y2 - y1) * (w2 - w1)) < 1e-12
        rate = {"wall": lambda v: v[0], "other": lambda v: v[2] + 0.4 * v[1]}.get(event.name)
        if rate is not None:
            e = {"wall": 0.9, "other": 0.95}[event.name]
            assert rate(event.v_after) == pytest.approx(-e * rate(event.v_before), rel=1e-12)
    assert in_code.energy.max_error < 1e-9
    assert in_code.ok


TUMBLING = """
name = "tumbling"
[bodies.stone]
mass = 2
com = [0, 0, 0]
inertia = [1, 2, 3]
[joints.turn]
type = "spherical"
parent = "world"
child = "stone"
rate = [1, 8, 1.2]
[events.turned]
when = "turn_qy"
then = "record"
[events.spun]
when = "turn_wx"
then = { reset = { "turn_wz" = "1.01*turn_wz" } }
"""
RECORDED = (
    PENDULUM[: PENDULUM.index("[stops.wall]")]
    + PENDULUM[PENDULUM.index("[events.mark]") :]
    + """
[events.low]
when = "mod(x1, 1/2) - 1/4"
then = "record"
[events.swung]
when = "x1"
direction = "falling"
then = { reset = { "dot(x1)" = "1.02*dot(x1)" } }
"""
)


@pytest.mark.parametrize("method", ["taylor", "dop853", "radau5"])
@pytest.mark.parametrize("text", [RECORDED, TUMBLING], ids=["constraints", "quaternion"])
def test_records_on_constraints_have_the_same_bits(monkeypatch, text, method):
    """Resets of quaternions beside them are for Python, and so are records of functions that jump there."""
    acted = counted(monkeypatch)
    by_python, in_code = both(monkeypatch, system(text), 6.0, method=method)
    n_acted = sum(acted)  # the health report has runs of its own
    if text == TUMBLING:
        assert_same_bits(in_code, by_python)
    else:  # behind a reset, rates differ in their last digits
        assert [repr(e)[:40] for e in in_code.events] == [repr(e)[:40] for e in by_python.events]
        np.testing.assert_allclose(in_code.states, by_python.states, rtol=0, atol=1e-6)
    records = [event for event in in_code.events if event.action == "record"]
    assert 3 < len(records) < len(in_code.events)
    assert 0.5 * len(records) < n_acted <= len(in_code.events)


AT_ONCE = {
    "two balls": """
name = "balls"
[coordinates]
x = { start = 1.0 }
y = { start = 1.0 }
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2"
potential = "9.81*x + 19.62*y"
[stops.first]
gap = "x"
restitution = 0.9
[stops.second]
gap = "y"
restitution = 0.9
[events.low]
when = "2*x"
direction = "falling"
then = "record"
""",
    "both ends of a bar": """
name = "bar"
[coordinates]
y = { start = 1.0 }
a = {}
[energy]
kinetic = "dot(y)^2/2 + 0.15*dot(a)^2"
potential = "9.81*y"
[stops.left]
gap = "y - 0.5*a"
restitution = 0.9
[stops.right]
gap = "y + 0.5*a"
restitution = 0.9
""",
    "reset beside an impact": """
name = "knocks"
[coordinates]
y = { start = 1.0 }
x = { rate = 0.5 }
[energy]
kinetic = "dot(y)^2/2 + dot(x)^2/2"
potential = "9.81*y + x^2"
[events.knock]
when = "y/3"
direction = "falling"
then = { reset = { "dot(x)" = "-0.99*dot(x)" } }
[events.again]
when = "y/2"
direction = "falling"
then = { reset = { "dot(x)" = "dot(x)/2 + 0.1" } }
[stops.floor]
gap = "y"
restitution = 0.9
""",
}


@pytest.mark.parametrize("method", ["taylor", "dop853", "dopri5", "radau5", "radau9"])
@pytest.mark.parametrize("name", AT_ONCE)
def test_events_of_one_instant(monkeypatch, name, method):
    """Each in its turn, resets first; a bar that falls flat does not turn; bodies bounce as balls do."""
    acted = counted(monkeypatch)
    by_python, in_code = both(monkeypatch, system(AT_ONCE[name]), 2.5, method=method, rtol=1e-10, atol=1e-12)
    events = in_code.events
    assert sum(acted) == len(events) == len(by_python.events) > 5
    for mine, theirs in zip(events, by_python.events):
        assert (mine.name, mine.action) == (theirs.name, theirs.action)
        assert mine.t == pytest.approx(theirs.t, abs=1e-12)
        assert mine.energy_change == pytest.approx(theirs.energy_change, abs=1e-10)
        for part in ("q_before", "v_before", "q_after", "v_after"):
            np.testing.assert_allclose(getattr(mine, part), getattr(theirs, part), rtol=0, atol=1e-10)
    np.testing.assert_allclose(in_code.states, by_python.states, rtol=0, atol=1e-10)
    np.testing.assert_allclose(in_code.lowest_gaps, by_python.lowest_gaps, rtol=0, atol=1e-12)
    assert in_code.ok and by_python.ok
    times = sorted({round(event.t, 6) for event in events})
    first = np.sqrt(2.0 / 9.81)
    flights = first + 2.0 * first * np.cumsum([0.0, *(0.9**k for k in range(1, len(times)))])
    np.testing.assert_allclose(times, flights, rtol=0, atol=2e-6)


def test_an_end_of_a_bar_struck_first_turns_it(monkeypatch):
    """Other restitutions of the two ends: both rates are -e times what they were, whatever they do to each other."""
    acted, text = counted(monkeypatch), AT_ONCE["both ends of a bar"]
    run = system(text.replace("restitution = 0.9", "restitution = 0.6", 1)).run(0.6, method="dop853")
    left, right = run.events
    assert sum(acted) == 2 and left.t == right.t
    (down, _), (up, turn) = left.v_before, left.v_after
    assert up - 0.5 * turn == pytest.approx(-0.6 * down, rel=1e-13)
    assert up + 0.5 * turn == pytest.approx(-0.9 * down, rel=1e-13)
    assert right.energy_change == 0.0 > left.energy_change


ROCKING = """
name = "rocking"
[coordinates]
y = { start = 0.02 }
a = { start = 0.04 }
[energy]
kinetic = "dot(y)^2/2 + 0.03*dot(a)^2"
potential = "9.81*y"
[forces]
y = "3 + 4*cos(8*t)"
a = "0.5*(3 + 4*cos(8*t))"
[stops.left]
gap = "y - 0.5*a"
restitution = REST
[stops.right]
gap = "y + 0.5*a"
restitution = REST
"""


@pytest.mark.parametrize("method", ["taylor", "dop853", "dopri5", "radau5"])
@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_a_blow_that_a_closed_stop_shares(monkeypatch, restitution, method):
    """A bar with heavy ends, one of which is lifted again and again: the other bears a part of each blow."""
    by_hand, model = [], system(ROCKING.replace("REST", str(restitution)))
    act = EventActions.act
    monkeypatch.setattr(EventActions, "act", lambda self: by_hand.append(self.arrays.t) or act(self))
    by_python, in_code = both(monkeypatch, model, 6.0, method=method)
    events = in_code.events
    few = 4 if restitution else 2  # the first ones
    assert len(by_hand) <= len(by_python.events) + few < 2 * len(by_python.events)
    assert [(e.name, e.action) for e in events] == [(e.name, e.action) for e in by_python.events]
    n_shared = 0
    for mine, theirs in zip(events, by_python.events):
        assert mine.t == pytest.approx(theirs.t, abs=1e-6)
        assert mine.energy_change == pytest.approx(theirs.energy_change, abs=1e-5)
        np.testing.assert_allclose(mine.v_after, theirs.v_after, rtol=0, atol=1e-4)
        (y, a), (up, turn) = mine.q_after, mine.v_after
        stays = "left" if mine.name == "right" else "right"
        way, other = (0.5, -0.5) if mine.name == "right" else (-0.5, 0.5)
        gap, rate = y + other * a, mine.v_before[0] + other * mine.v_before[1]
        if mine.action == "impact" and abs(gap) < 1e-9 and abs(rate) < 1e-9:
            n_shared += 1
            assert up + other * turn == pytest.approx(0.0, abs=1e-9), stays
            closing = mine.v_before[0] + way * mine.v_before[1]
            landed = max(-restitution * closing, 0.0)
            assert up + way * turn in (pytest.approx(landed, abs=1e-9), pytest.approx(0.0, abs=1e-9))
    assert n_shared > 1 and in_code.ok


@pytest.mark.parametrize("method", ["taylor", "dop853", "dopri5", "radau5"])
def test_resets_of_constrained_models(monkeypatch, method):
    """Rates that are not given follow from the constraints, as they do by an angle that needs none."""
    acted = counted(monkeypatch)
    text = """
[coordinates]
COORDINATES
[energy]
kinetic = "KINETIC"
potential = "9.81*(Y) + 0.1*(X)^2"
[events.wall]
when = "X + 0.1"
direction = "falling"
then = { reset = { RESET } }
"""
    of_points = 'name = "points"' + text.replace("COORDINATES", "x = { start = 0.6 }\ny = { start = -0.8 }")
    of_points = (
        of_points.replace("KINETIC", "dot(x)^2/2 + dot(y)^2/2").replace("(X)", "x").replace("(Y)", "y")
    )
    of_points = of_points.replace('"X + 0.1"', '"x + 0.1"').replace("RESET", '"dot(x)" = "-0.9*dot(x)"')
    of_points += '[constraints]\nlength = "x^2 + y^2 - 1"\n'
    by_python, in_code = both(monkeypatch, system(of_points), 4.0, method=method, rtol=1e-10, atol=1e-12)
    assert sum(acted) == len(in_code.events) == len(by_python.events) > 3
    np.testing.assert_allclose(in_code.states, by_python.states, rtol=0, atol=1e-9)
    of_angle = 'name = "angle"' + text.replace("COORDINATES", f"a = {{ start = {np.arctan2(-0.8, 0.6)} }}")
    of_angle = of_angle.replace("KINETIC", "dot(a)^2/2").replace("(X)", "cos(a)").replace("(Y)", "sin(a)")
    of_angle = of_angle.replace('"X + 0.1"', '"cos(a) + 0.1"').replace("RESET", '"dot(a)" = "-0.9*dot(a)"')
    by_angle = system(of_angle).run(4.0, method="dop853", rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(
        [e.t for e in in_code.events], [e.t for e in by_angle.events], rtol=0, atol=1e-6
    )
    for event, other in zip(in_code.events, by_angle.events):
        (x, y), (u, w) = event.q_after, event.v_after
        assert abs(x * u + y * w) < 1e-14
        assert u == pytest.approx(-0.9 * event.v_before[0], rel=1e-13)
        assert event.energy_change == pytest.approx(other.energy_change, abs=1e-6)
    assert in_code.ok and in_code.energy.max_error < 1e-7


def test_members_of_ensembles_have_the_events_of_one_instant_of_single_runs():
    model = system(AT_ONCE["reset beside an impact"])
    members = model.ensemble(2.0, method="dop853", start={"y": [1.0, 1.2]})
    for k, y in enumerate((1.0, 1.2)):
        run = model.run(2.0, method="dop853", start={"y": y}, t_eval=(2.0,))
        np.testing.assert_array_equal(run.states[-1], [members[name][k] for name in members.names])


def test_a_rate_that_is_given_stays_at_a_dead_point(monkeypatch):
    """There one constraint moves at no speed, and the piston has no mass: scales tell nothing of what depends."""
    model = system("""
name = "crank"
[coordinates]
theta = { start = 0.233, rate = 3.33 }
phi = { guess = -0.2 }
x = { guess = 0.4 }
[energy]
kinetic = "0.005*dot(theta)^2 + 0.003*dot(phi)^2"
potential = "2.24*(x - 0.35)^2"
[constraints]
along = "0.1*cos(theta) + 0.3*cos(phi) - x"
across = "0.1*sin(theta) + 0.3*sin(phi)"
[events.dead]
when = "sin(theta)"
then = { reset = { "dot(theta)" = "0.95*dot(theta)" } }
""")
    for run in both(monkeypatch, model, 4.0, method="dop853"):
        assert len(run.events) > 1
        for event in run.events:
            assert event.v_after[0] == pytest.approx(0.95 * event.v_before[0], rel=1e-12)
            assert 0.1 * event.v_after[0] * np.cos(event.q_after[0]) == pytest.approx(
                -0.3 * event.v_after[1] * np.cos(event.q_after[1]), rel=1e-12
            )


def test_rates_of_angles_have_the_impacts_of_constrained_ones(monkeypatch):
    """The same pendulum in its angles, without constraints: another form, mass matrix and set of rates."""
    acted = counted(monkeypatch)
    of_points = system(PENDULUM).run(3.0, method="dop853", rtol=1e-11, atol=1e-13)
    assert sum(acted) == len(of_points.events)
    model = Model("pendulum_by_angles")
    a = model.coordinate("a", start=np.arctan2(-0.8, 0.6))
    b = model.coordinate("b", start=-np.arccos(1.4 / 1.5))
    x1, y1 = symgen.cos(a), symgen.sin(a)
    x2, y2 = x1 + 1.5 * symgen.cos(b), y1 + 1.5 * symgen.sin(b)
    velocity = [symgen.dot(e) for e in (x1, y1, x2, y2)]
    model.kinetic(sum(m * v**2 for m, v in zip((0.5, 0.5, 1.0, 1.0), velocity)))
    model.potential(9.81 * y1 + 19.62 * y2)
    model.stop("wall", x1 + 0.1, restitution=0.9)
    model.stop("other", x2 + 0.4 * y1 + 0.3, restitution=0.95)
    of_angles = model.derive().run(3.0, method="dop853", rtol=1e-11, atol=1e-13)
    times = [e.t for e in of_points.events if e.name != "mark"]
    np.testing.assert_allclose(times, [e.t for e in of_angles.events], rtol=0, atol=1e-8)
    assert len(times) >= 3


def test_heights_are_those_of_the_closed_form():
    e, g = 0.9, 9.81
    solution = system(STOP).run(3.0, method="taylor")
    first = np.sqrt(2.0 / g)
    times = first + 2.0 * first * np.cumsum([0.0, *(e**k for k in range(1, len(solution.events)))])
    np.testing.assert_allclose([event.t for event in solution.events], times, atol=1e-12)
    speeds = [event.v_after[0] for event in solution.events]
    np.testing.assert_allclose(speeds, np.sqrt(2.0 * g) * e ** np.arange(1, len(speeds) + 1), rtol=1e-12)


def test_an_event_that_ends_the_run():
    solution = system(MARKED.replace("y - 5", "y + dot(y)/10 - 0.9")).run(4.0, method="dop853")
    assert solution.status == "terminated"
    assert solution.events[-1].action == "terminate"


def test_runs_do_not_depend_on_samples_or_on_where_they_are_cut():
    model = system(TWO_STOPS)
    plain = model.run(2.0, method="dop853")
    watched = model.run(2.0, method="dop853", at=[0.31, 0.72, 1.5], max_steps=10**6, fps=500)
    np.testing.assert_array_equal(plain.states[-1], watched.states[-1])
    longer = model.run(3.0, method="dop853")
    assert [e.t for e in plain.events] == [e.t for e in longer.events if e.t <= 2.0]


@pytest.mark.parametrize("text", [TWO_STOPS, PENDULUM], ids=["free", "constrained"])
def test_a_sample_in_the_step_before_an_impact_changes_nothing(text):
    """The step is taken aside up to the sample; what acts on the impact behind it is what acts on it unwatched."""
    model, options = system(text), {"method": "dop853", "rtol": 1e-10, "atol": 1e-12}
    plain = model.run(3.0, **options)
    impacts = [event.t for event in plain.events if event.action == "impact"]
    watched = model.run(3.0, at=[t - 1e-4 for t in impacts], **options)
    assert len(impacts) > 2
    np.testing.assert_array_equal(watched.states[-1], plain.states[-1])
    np.testing.assert_array_equal(watched.step_log, plain.step_log)
    assert [repr(event) for event in watched.events] == [repr(event) for event in plain.events]


def test_a_run_of_many_impacts_takes_microseconds_for_each():
    """Its energy stays, and the intervals that the detector of accumulation keeps are few."""
    solution = symgen.load("bouncing_ball").run(4000.0, parameters={"e": 1.0}, method="dop853")
    assert len(solution.events) > 4000
    assert solution.status == "success"
    assert solution.energy.max_error < 1e-9
    assert solution.seconds["run"] < 2000e-6 * len(solution.events)


def test_intervals_that_are_kept_are_few():
    detector = ZenoDetector()
    for k in range(1000):
        assert detector.look(k - 1e-6 * k * k / 2.0) is None
    assert len(detector.memory) <= plain_events.MOST_INTERVALS + 1
    assert detector.memory[1] == pytest.approx(1.0, abs=1e-5)


def test_the_latest_events_are_told_without_being_kept():
    log = system(STOP).run(3.0, method="dop853").events
    log.append(log[0])
    part = log._parts[-2]
    for n in (0, 1, 3, len(log)):
        assert [repr(event) for event in log.latest(n)] == [
            repr(event) for event in list(log)[len(log) - n :]
        ]
        part._made.clear()
    log.latest(3)
    assert not part._made


def test_log_of_events_is_a_sequence():
    solution = system(STOP).run(2.0, method="dop853")
    log, events = solution.events, list(solution.events)
    assert isinstance(log, EventLog)
    assert log[0].t == events[0].t
    assert log[-1].t == events[-1].t
    assert [e.t for e in log[1:3]] == [e.t for e in events[1:3]]
    assert log[:0] == []
    with pytest.raises(IndexError, match="event 99 of"):
        log[99]
    both_kinds = EventLog(events[:1])
    both_kinds.append(events[1])
    assert len(both_kinds) == 2
    assert EventLog() == []
