"""Events of free motion in lanes: what `integrate/after_step.py` and `integrate/plain_events.py` do of them.

A step is looked at in the places of a single run's, part by part as there. Where an event function changes its side,
its lane's step ends there and the state is reset; where one may have touched zero in between, the step is taken again
at half its length. What needs more thought (two events at one instant, a function that goes on touching zero, resets
that pile up) makes the member leave its lane, for a run of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from symgen.runtime.ensemble.lanes import Lanes, copy_rows, evaluate_energy, finite_rows, project
from symgen.runtime.ensemble.slots import AT
from symgen.runtime.ensemble.writer import INTEGER, Code, Rows, Value, Variable
from symgen.runtime.integrate import plain_events
from symgen.runtime.integrate.after_step import (
    CHEBYSHEV,
    EPS,
    FIRST_PART,
    INWARDS,
    N_EARLY,
    SHORTEST_PART,
)
from symgen.runtime.integrate.layout import LEANING
from symgen.runtime.integrate.plain_events import AHEAD, CLEAR, RECORDS, RESETS, ROUND_OFF, TERMINATES

# Where a step is looked at: near its start while a function has no side yet, and near both ends for what dips there.
PLACES = (
    *(2.0 ** (-5.0 - 2.0 * (N_EARLY - 1 - k)) for k in range(N_EARLY)),
    INWARDS * CHEBYSHEV[1], *CHEBYSHEV[1:-1], 1.0 - INWARDS * (1.0 - CHEBYSHEV[-2]), 1.0,
)  # fmt: skip
_NOT_EARLY = 2  # places behind the early ones that take their part where all functions have a side
_SHORTEST_FLIGHT = 1e-3  # of the first one: what is left to single runs, which know how flights pile up
_MOST_TRIALS = 60
_SHORTEST_STEP = 1e-5  # of the longest one: a function that may have crossed in shorter ones touches zero
_FARTHEST = 2.0  # behind the end of a step


SWITCHES = 1 + max(RECORDS, RESETS, TERMINATES)  # of a stop or a friction: what follows is worked out outside
_PROJECTION_NOISE = 4.0  # states on constraints carry the round-off of the projection as well

_BLOCKS = (
    # Of stops and frictions: how far below zero they count as zero, and the least at the ends of steps.
    "width", "lowest",
    "side", "side_before", "band", "previous", "one_before", "two_before", "found", "low", "high", "g_low", "g_high",
    "was", "level", "root", "g", "at_event", "floor", "other",
)  # fmt: skip
N_BLOCKS = len(_BLOCKS)


class Watched:
    """Numbers of each event function in each lane: `watched.side[e]`."""

    def __init__(self, lanes: Lanes) -> None:
        self._lanes = lanes

    def __getattr__(self, name: str) -> Rows:
        return self._lanes.watched.behind(self._lanes.n_events * _BLOCKS.index(name))


@dataclass(eq=False)
class Stopped:
    """Where accepted steps end.

    Attributes
    ----------
    t : Value
        The time.
    accepted : Value
        Lanes whose step stands.
    happened : Value
        Lanes in which it ends at an event.
    leaving : Value
        Lanes whose members are for single runs.
    ended : Value
        Lanes whose runs an event has ended.
    """

    t: Value
    accepted: Value
    happened: Value
    leaving: Value
    ended: Value


def _evaluate(lanes: Lanes, t: Value, y: Rows, out: Rows) -> None:
    lanes.call("events", t, y, out)


def _sign(a: Value) -> Value:
    code = a.code
    zero = code.all_lanes(0.0)
    return code.select(a > 0.0, code.all_lanes(1.0), code.select(a < 0.0, code.all_lanes(-1.0), zero))


def _is(code: Code, a: Value, number: Value) -> Value:
    """Where numbers of lanes are an integer."""
    return code.compare("eq", a, code.as_kind(code.to_number(number), "lanes"))


def arm(lanes: Lanes, active: Value) -> None:
    """Set on which side of zero event functions are, where members begin or an event was, as `plain_events.arm`."""
    code = lanes.code
    with code.when(lanes.n_events > 0):
        where = active & (lanes.own("armed") < 0.5)
        with code.when(code.any(where)):
            _arm(lanes, where)


def _arm(lanes: Lanes, where: Value) -> None:
    code, w, t, moved = lanes.code, Watched(lanes), lanes.own("t"), lanes.y_stage
    _evaluate(lanes, t, lanes.y, w.g)
    _find_floor(lanes, t)
    size, speed = code.variable(1.0), code.variable(0.0)
    with code.each(lanes.nq) as i:
        size.value = code.larger(size.value, code.size(lanes.y[i]))
        speed.value = code.larger(speed.value, code.size(lanes.y[lanes.nq + i]))
    moves = (speed.value > 0.0) & code.finite(speed.value)
    dt = code.select(moves, size.value * AHEAD / speed.value, code.all_lanes(0.0))
    _move(lanes, dt, moved)
    _evaluate(lanes, t + dt, moved, w.other)
    begins = lanes.own("fired") < 0.5
    switches = code.all_flags(code.compare("ne", lanes.n_switches, 0))
    lost = code.variable(code.flags(False))
    with code.each(lanes.n_events) as e:
        g, floor = w.g[e], w.floor[e]
        size_g, rise = code.size(g), w.other[e] - g
        heading = code.select(code.size(rise) > floor * CLEAR, _sign(rise), code.all_lanes(0.0))
        fired = _is(code, lanes.own("fired"), e + 1)
        records = code.all_flags(code.equal(lanes.actions[e], RECORDS))
        # A reset may carry its own function away, from where it comes again.
        near = code.select(records, size_g, code.smaller(size_g, code.size(w.at_event[e])))
        band = code.select(fired, floor + near, floor)
        lean = code.select(fired & ~records, heading * LEANING, code.all_lanes(0.0))
        # What holds or slides does so until its function falls below zero; one that has just fired may have sunk.
        sunk = code.larger(-g, code.all_lanes(0.0))
        sunk = code.select(fired, sunk * 2.0, sunk)
        band = code.select(switches, code.larger(floor, w.width[e]) + sunk, band)
        lean = code.select(switches, code.all_lanes(LEANING), lean)
        clear = (size_g > band) & ~(fired & records)
        lost.value = lost.value | (where & ~begins & ~fired & ~clear & ~switches)
        w.side[e] = code.select(where, code.select(clear, _sign(g), lean), w.side[e])
        w.band[e] = code.select(where, band, w.band[e])
    lanes.set_own("leaves", 1.0, lost.value)
    lanes.set_own("armed", 1.0, where)


def _move(lanes: Lanes, dt: Value, out: Rows) -> None:
    code = lanes.code
    with code.each(lanes.nq) as i:
        out[i] = lanes.y[i] + dt * lanes.y[lanes.nq + i]
        out[lanes.nq + i] = lanes.y[lanes.nq + i]


def _find_floor(lanes: Lanes, t: Value) -> None:
    """What of event functions is round-off, as `plain_events.find_values_and_floor`."""
    code, w, moved = lanes.code, Watched(lanes), lanes.y_stage
    with code.each(lanes.n_events) as e:
        w.floor[e] = 0.0

    def add_change(at: Value) -> None:
        _evaluate(lanes, at, moved, w.other)
        with code.each(lanes.n_events) as e:
            change = w.floor[e] + code.size(w.other[e] - w.g[e])
            w.floor[e] = code.select(code.finite(change), change, code.all_lanes(0.0))

    relative = code.variable(ROUND_OFF)
    with code.when(lanes.m > 0):
        relative.value = code.all_lanes(ROUND_OFF * _PROJECTION_NOISE)
    dt = code.size(t) * relative.value
    copy_rows(lanes, lanes.y, moved, lanes.n)
    add_change(t + dt)
    with code.each(lanes.n) as k:
        moved[k] = lanes.y[k] + code.size(lanes.y[k]) * relative.value
        add_change(t)
        moved[k] = lanes.y[k]
    _move(lanes, dt, moved)
    add_change(t + dt)


def find_events(
    lanes: Lanes, accepted: Value, t: Value, t1: Value, make_dense: Callable[[], None],
    evaluate: Callable[[Value, Rows], None],
) -> Stopped:  # fmt: skip
    """Let accepted steps end at their first event, with the state there in `y_new`; arguments as of `write_frames`.

    Steps to be taken again have their new length, and count as rejected.
    """
    code = lanes.code
    nowhere = code.flags(False)
    stop, happened, leaving = code.variable(t1), code.variable(nowhere), code.variable(nowhere)
    stands = code.variable(accepted)
    with code.when(lanes.n_events > 0):
        make_dense()
        touched = _look(lanes, accepted, t, t1 - t, evaluate)
        first, several = _locate(lanes, t, t1 - t, evaluate)
        touched = accepted & touched
        half = (t1 - t) * 0.5
        short = half < lanes.own("longest") * _SHORTEST_STEP
        leaving.value = (touched & short) | (accepted & (several | (lanes.own("leaves") > 0.5)))
        again = touched & ~leaving.value
        w = Watched(lanes)
        copy_rows(lanes, w.side_before, w.side, lanes.n_events, again)
        lanes.set_own("h", half, again)
        lanes.set_own("last_rejected", 1.0, again)
        lanes.set_own("longest", code.larger(lanes.own("longest"), t1 - t), accepted)
        stands.value = accepted & ~again & ~leaving.value
        happened.value = stands.value & (first <= 1.0)
        inside = happened.value & (first < 1.0)
        with code.when(code.any(inside)):
            evaluate(code.select(inside, first, code.all_lanes(1.0)), lanes.y_stage)
            with code.when(lanes.n_project > 0):
                there = code.select(inside, t + (t1 - t) * first, t1)
                project(lanes, there, lanes.y_stage, inside, nowhere)
            copy_rows(lanes, lanes.y_stage, lanes.y_new, lanes.ny, inside)
        _note_lowest(lanes, stands.value & ~happened.value)
        stop.value = code.select(inside, t + (t1 - t) * first, t1)
        _note_eventless(lanes, stands.value, happened.value, t, stop.value)
    return Stopped(stop.value, stands.value, happened.value, leaving.value, nowhere)


def _note_eventless(lanes: Lanes, stands: Value, happened: Value, t: Value, end: Value) -> None:
    """Take note of the time between the last two events, or since then of the longest step, as `finish_step`."""
    code = lanes.code
    since = end - lanes.own("last_event")
    since = code.select(since > 0.0, since, end - t)
    longest = code.larger(lanes.own("eventless"), end - t)
    lanes.set_own("eventless", code.select(happened, since, longest), stands)
    lanes.set_own("last_event", end, happened)


def _note_lowest(lanes: Lanes, where: Value) -> None:
    """Take note of how low the functions of stops and frictions are at the ends of steps without an event."""
    code, w = lanes.code, Watched(lanes)
    with code.each(lanes.n_switches) as e:
        w.lowest[e] = code.select(where, code.smaller(w.lowest[e], w.previous[e]), w.lowest[e])


def _look(
    lanes: Lanes, accepted: Value, t: Value, h: Value, evaluate: Callable[[Value, Rows], None]
) -> Value:
    """Find where functions change their sides; returns lanes in which one may only touch zero.

    A step that is much longer than what went before is looked at part by part, as `after_step.find_event` does.
    """
    code, w = lanes.code, Watched(lanes)
    early, touched = code.variable(code.flags(False)), code.variable(code.flags(False))
    _evaluate(lanes, t, lanes.y, w.previous)
    with code.each(lanes.n_events) as e:
        early.value = early.value | (code.size(w.side[e]) < 1.0)
        w.side_before[e] = w.side[e]
        w.one_before[e] = w.two_before[e] = float("nan")  # what is compared with them is not so
        w.found[e] = 0.0
        w.root[e] = _FARTHEST
        w.low[e] = 0.0
    eventless = lanes.own("eventless")
    first_part = code.select(eventless > 0.0, eventless * 2.0 / h, code.all_lanes(FIRST_PART))
    going, start, end = code.variable(accepted), code.variable(0.0), code.variable(_end_of_part(first_part))
    with code.forever() as leave:
        leave(~code.any(going.value))
        part = _Part(t, h, start.value, end.value)
        touched.value = touched.value | _look_at_part(lanes, going.value, early.value, part, evaluate)
        going.value = going.value & (end.value < 1.0) & ~_some_found(lanes)
        early.value = code.flags(False)  # parts behind the first one begin where functions have a side
        start.value = end.value
        end.value = _end_of_part(end.value * 2.0)
    return touched.value


@dataclass(eq=False)
class _Part:
    """The part of steps from `start` to `end`, 0 to 1, which begin at `t` and are `h` long."""

    t: Value
    h: Value
    start: Value
    end: Value


def _end_of_part(wanted: Value) -> Value:
    """As `after_step.end_of_part`."""
    code = wanted.code
    return code.select(wanted >= 0.5, code.all_lanes(1.0), code.larger(wanted, code.all_lanes(SHORTEST_PART)))


def _some_found(lanes: Lanes) -> Value:
    """Lanes in which a function has changed its side."""
    code, w = lanes.code, Watched(lanes)
    found = code.variable(0.0)
    with code.each(lanes.n_events) as e:
        found.value = code.larger(found.value, w.found[e])
    return found.value > 0.5


def _look_at_part(
    lanes: Lanes, going: Value, early: Value, part: _Part, evaluate: Callable[[Value, Rows], None]
) -> Value:
    """Look at the places of a part of the steps of some lanes; returns where a function may only touch zero.

    Parameters
    ----------
    early : Value
        Where some function has no side yet, and the beginning is looked at as well.
    """
    code, w = lanes.code, Watched(lanes)
    touched = code.variable(code.flags(False))
    first = code.select(code.any(early & going), code.integer(0), code.integer(N_EARLY))
    with code.each(len(PLACES), first) as k:
        is_last = code.equal(k, len(PLACES) - 1)
        place = code.as_kind(lanes.places[k], "lanes")
        theta = code.select(
            code.all_flags(is_last), part.end, part.start + (part.end - part.start) * place
        )  # without round-off
        is_early, is_not = k < N_EARLY, (k >= N_EARLY) & (k < N_EARLY + _NOT_EARLY)
        used = (code.all_flags(is_early) & early) | (code.all_flags(is_not) & ~early)
        used = going & (used | code.all_flags(k >= N_EARLY + _NOT_EARLY))
        evaluate(theta, lanes.y_stage)
        # The end is the state that the run goes on from, not its interpolant.
        with code.when(is_last):
            copy_rows(lanes, lanes.y_new, lanes.y_stage, lanes.ny, part.end >= 1.0)
        _evaluate(lanes, part.t + part.h * theta, lanes.y_stage, w.g)
        with code.each(lanes.n_events) as e:
            touched.value = touched.value | _take_sample(lanes, e, theta, used)
    return touched.value


def _take_sample(lanes: Lanes, e: Value, theta: Value, used: Value) -> Value:
    """Follow the side of a function to the next place, as `first_root`; returns where it may only touch zero."""
    code, w = lanes.code, Watched(lanes)
    side, band, here, before = w.side[e], w.band[e], w.g[e], w.previous[e]
    goes_on = used & (w.found[e] < 0.5)
    known, far = code.size(side) >= 1.0, code.size(here) > band
    direction = code.as_kind(lanes.directions[e], "lanes")
    wanted = code.compare("eq", direction, 0.0) | (direction * side < 0.0)
    crossed = code.variable(known & (side * here <= 0.0))
    crossed.value = goes_on & wanted & (crossed.value | (~known & far & (side * here < 0.0)))
    one, minus = code.all_lanes(1.0), code.all_lanes(-1.0)
    was = code.select(side > 0.0, one, minus)
    # At zero it may come and go within round-off: what counts is where it leaves that for good.
    level = code.select(known | (was * before > 0.0), code.all_lanes(0.0), -band)
    for rows, value in (
        (w.high, theta), (w.g_low, before), (w.g_high, here), (w.was, was), (w.level, level), (w.found, one),
    ):  # fmt: skip
        rows[e] = code.select(crossed.value, value, rows[e])
    seen = [side * value for value in (w.two_before[e], w.one_before[e], before, here)]
    dips = goes_on & known & (_dips(*seen[1:], seen[0]) | _dips(*seen[:3], seen[3]))
    turned = code.select(side * here < 0.0, -side, side)
    follows = code.select(known, turned, code.select(far, _sign(here), side))
    w.side[e] = code.select(goes_on & ~crossed.value, follows, side)
    w.two_before[e] = code.select(used, w.one_before[e], w.two_before[e])
    w.one_before[e] = code.select(used, before, w.one_before[e])
    w.previous[e] = code.select(used, here, before)
    w.low[e] = code.select(goes_on & ~crossed.value, theta, w.low[e])
    return dips


def _dips(before: Value, here: Value, after: Value, beyond: Value) -> Value:
    """Whether there is a minimum at the middle one of three places, near enough to zero to hide two crossings.

    `beyond` is behind one of them: as `after_step.dips`, `first_dip` and `last_dip` have it.
    """
    code = here.code
    largest = code.larger(code.larger(before, after), beyond)
    return (here > 0.0) & (here <= before) & (here <= after) & (here <= largest * 0.5)


def _locate(lanes: Lanes, t: Value, h: Value, evaluate: Callable[[Value, Rows], None]) -> tuple[Value, Value]:
    """Find the places of crossings; returns the first one, and where several events share it."""
    code, w = lanes.code, Watched(lanes)
    with code.each(lanes.n_events) as e:
        found = w.found[e] > 0.5
        with code.when(code.any(found)):
            _find_root(lanes, e, found, t, h, evaluate)
    first, number = code.variable(_FARTHEST), code.variable(0.0)
    with code.each(lanes.n_events) as e:
        sooner = w.root[e] < first.value
        first.value = code.select(sooner, w.root[e], first.value)
        number.value = code.select(sooner, code.as_kind(code.to_number(e + 1), "lanes"), number.value)
    lanes.set_own("next_event", number.value)
    same = code.larger(code.size(t + h), h) * (8.0 * EPS)
    count = code.variable(0.0)
    with code.each(lanes.n_events) as e:
        at_once = (w.root[e] - first.value) * h <= same
        count.value = code.select(at_once, count.value + 1.0, count.value)
    return first.value, (first.value <= 1.0) & (count.value > 1.5)


def _find_root(
    lanes: Lanes, e: Value, found: Value, t: Value, h: Value, evaluate: Callable[[Value, Rows], None]
) -> None:
    """Narrow a crossing down to the resolution of time, by the ITP method; its end is just past it.

    Oliveira, Takahashi, ACM Trans. Math. Software 47 (2020) 5: as fast as secants, never slower than bisection.
    """
    code, w = lanes.code, Watched(lanes)
    was, level = w.was[e], w.level[e]
    a, b = code.variable(w.low[e]), code.variable(w.high[e])
    fa, fb = code.variable(was * w.g_low[e] - level), code.variable(was * w.g_high[e] - level)
    width = b.value - a.value
    steepness, room = 0.2 / width, code.variable(width)
    going, trial = code.variable(found), code.variable(0, INTEGER)
    with code.forever() as leave:
        width = b.value - a.value
        finest = code.larger(code.size(t) * (2.0 * EPS), h * (2.0 * EPS))
        going.value = going.value & (width * h > finest)
        leave(~code.any(going.value))
        leave(trial.value >= _MOST_TRIALS)
        trial.value = trial.value + 1
        middle = (a.value + b.value) * 0.5
        secant = (fb.value * a.value - fa.value * b.value) / (fb.value - fa.value)
        secant = code.select(code.finite(secant), secant, middle)
        off = middle - secant
        towards = code.select(off < 0.0, code.all_lanes(-1.0), code.all_lanes(1.0))
        step = steepness * width * width
        cut = code.select(step <= code.size(off), secant + towards * step, middle)
        reach = code.larger(room.value - width * 0.5, code.all_lanes(0.0))
        x = code.select(code.size(cut - middle) <= reach, cut, middle - towards * reach)
        x = code.select(found, x, code.all_lanes(1.0))
        room.value = room.value * 0.5
        evaluate(x, lanes.y_stage)
        _evaluate(lanes, t + h * x, lanes.y_stage, w.g)
        f = was * w.g[e] - level
        before = going.value & (f > 0.0)
        past = going.value & ~(f > 0.0)
        a.value, fa.value = code.select(before, x, a.value), code.select(before, f, fa.value)
        b.value, fb.value = code.select(past, x, b.value), code.select(past, f, fb.value)
    w.root[e] = code.select(found, b.value, w.root[e])


def act_on_events(lanes: Lanes, stopped: Stopped, derive: Callable[[Value], None]) -> Stopped:
    """Change the states in `y_new` that are at events, and what follows from them.

    Parameters
    ----------
    derive : callable
        Writes what works out the derivatives of `y_new` at a time, for all lanes.
    """
    code = lanes.code
    leaving, ended = code.variable(stopped.leaving), code.variable(stopped.ended)
    with code.when(code.any(stopped.happened)):
        _act(lanes, stopped, leaving, ended)
        derive(stopped.t)
    return replace(
        stopped, accepted=stopped.accepted & ~leaving.value, leaving=leaving.value, ended=ended.value
    )


def _act(lanes: Lanes, stopped: Stopped, leaving: Variable, ended: Variable) -> None:
    code, w, y, t, where = lanes.code, Watched(lanes), lanes.y_new, stopped.t, stopped.happened
    _evaluate(lanes, t, y, w.g)
    copy_rows(lanes, w.g, w.at_event, lanes.n_events, where)
    before = sum(evaluate_energy(lanes, t, y)[:2])
    copy_rows(lanes, y, lanes.y_before, lanes.n)
    is_reset = code.variable(code.flags(False))
    with code.each(lanes.n_events) as e:
        here = where & _is(code, lanes.own("next_event"), e + 1)
        ends = code.equal(lanes.actions[e], TERMINATES) | code.equal(lanes.actions[e], SWITCHES)
        ended.value = ended.value | (here & code.all_flags(ends))
        with code.when(code.any(here) & code.equal(lanes.actions[e], RESETS)):
            is_reset.value = is_reset.value | here
            with code.each(lanes.n) as i:  # structural zeros are not written
                lanes.y_stage[i] = 0.0
            code.call_kernel(lanes.resets[e], t, lanes.y_before, lanes.p, lanes.y_stage)
            copy_rows(lanes, lanes.y_stage, y, lanes.n, here)
    change = sum(evaluate_energy(lanes, t, y)[:2]) - before
    lanes.set_own("level", lanes.own("level") + change, is_reset.value)
    _log_event(lanes, where, t, change)
    flight = t - lanes.own("last_reset")
    known, counted = lanes.own("resets") > 0.5, lanes.own("resets") > 1.5
    resets = is_reset.value
    piles_up = known & (
        (counted & (flight < lanes.own("first_flight") * _SHORTEST_FLIGHT)) | (flight <= code.size(t) * 1e-13)
    )
    leaving.value = leaving.value | (where & ((resets & piles_up) | ~finite_rows(lanes, y, lanes.n)))
    lanes.set_own("first_flight", flight, resets & known & ~counted)
    lanes.set_own("last_reset", t, resets)
    lanes.count("resets", resets)
    lanes.set_own("fired", lanes.own("next_event"), where)
    lanes.set_own("armed", 0.0, where)


def _log_event(lanes: Lanes, where: Value, t: Value, change: Value) -> None:
    """Log the event of a lane that runs alone, in the order of `plain_events`."""
    code = lanes.code
    number = code.slot(AT["n_events_logged"], INTEGER)
    with code.when((number < lanes.event_log_size) & code.any(where)):
        row = lanes.event_log.behind(number * (lanes.n * 2 + plain_events.FIRST_STATE))
        for place, value in (
            (plain_events.EVENT, lanes.own("next_event") - 1.0), (plain_events.TIME, t), (plain_events.CHANGE, change),
        ):  # fmt: skip
            row[place] = code.of_lane(value, 0)
        for first, states in ((0, lanes.y_before), (lanes.n, lanes.y_new)):
            with code.each(lanes.n) as i:
                row[i + (first + plain_events.FIRST_STATE)] = code.of_lane(states[i], 0)
        code.set_slot(AT["n_events_logged"], number + 1)
