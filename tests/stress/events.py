"""Events at the start, at one instant, grazing, piling up, and resets that lead nowhere."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, demand, flag
from .models import point
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_T = 2.0 * math.pi
_STEP = 5e-4  # of fixed-step methods, whose events are those of their own motion
_FINE = ("grazing", "crossed by 1e-6", "missed by 1e-6")  # asks more than methods of low order can tell
_BALL = """
[events.floor]
when = "x"
direction = "falling"
then = {{ reset = {{ "dot(x)" = "{reset}" }} }}
"""


def _event(name: str, when: str, direction: str = "both", then: str = '"record"') -> str:
    return f'[events.{name}]\nwhen = "{when}"\ndirection = "{direction}"\nthen = {then}\n'


def _times(run: Solution, name: str) -> list[float]:
    return [event.t for event in run.events if event.name == name]


def _at(*expected: float, name: str = "e", allowed: float = 1e-5) -> Callable[[Solution], str]:
    """Return a check that an event fired at these times only."""

    def check(run: Solution) -> str:
        found = _times(run, name)
        good = len(found) == len(expected) and all(
            abs(a - b) <= allowed for a, b in zip(found, expected, strict=True)
        )
        return "" if good else f"{name} fired at {found}, not at {expected}"

    return check


def _together(run: Solution) -> str:
    a, b = _times(run, "a"), _times(run, "b")
    good = len(a) == len(b) == 2 and a == b and abs(a[0] - math.pi / 2) < 1e-5
    return "" if good else f"a fired at {a}, b at {b}"


def _order(run: Solution) -> str:
    """Of two resets at one instant the first in the file acts first: v -> 2 v, then v -> v + 1."""
    before, after = run.events[0].v_before[0], run.v[-1, 0]
    return (
        ""
        if len(run.events) == 2 and abs(2 * before + 1 - after) < 1e-6
        else f"{len(run.events)} events, v = {after}"
    )


def _grazing(run: Solution) -> str:
    """cos t touches -1 at pi: crossed there or not, but never twice."""
    found = _times(run, "e")
    return "" if len(found) <= 2 and all(abs(t - math.pi) < 1e-3 for t in found) else f"fired at {found}"


def _near_miss(run: Solution) -> str:
    return _at()(run)


def _ball_end(run: Solution) -> str:
    return (
        ""
        if run.status == "zeno" and abs(run.t[-1] - 3.0 * math.sqrt(2.0)) < 0.05
        else f"{run.status} at {run.t[-1]}"
    )


def _falls_anew(run: Solution) -> str:
    """At rest where it was stopped, and pulled on: it goes on from there as if let go."""
    expected = -0.5 * (10.0 - math.sqrt(2.0)) ** 2
    return (
        ""
        if abs(run.q[-1, 0] - expected) < 1e-4 * abs(expected)
        else f"is at {run.q[-1, 0]}, not at {expected}"
    )


def _stays_up(run: Solution) -> str:
    return "" if run.q[:, 0].min() > -1e-6 else f"fell to {run.q[:, 0].min()}"


# name -> force, start, rate, events, t_end, check, verdicts
SITUATIONS: dict[str, tuple] = {
    "event at t = 0, moving away": ("-x", 0.0, 1.0, _event("e", "x", "rising"), 4.0, _at(), (RIGHT,)),
    "event at t = 0, both ways": ("-x", 0.0, 1.0, _event("e", "x"), 4.0, _at(math.pi), (RIGHT,)),
    "event that is always zero": ("-x", 1.0, 0.0, _event("e", "0*x"), 4.0, _at(), (RIGHT, REFUSED)),
    "event of time alone": ("-x", 1.0, 0.0, _event("e", "t - 1.25"), 4.0, _at(1.25, allowed=1e-12), (RIGHT,)),
    "event at the very end": ("-x", 1.0, 0.0, _event("e", "t - 4"), 4.0, None, (RIGHT,)),
    "two crossings within a step": (
        "-1e-6*x", 0.0, 0.0, _event("e", "(t - 1)*(t - 1.001)"), 4.0, _at(1.0, 1.001), (RIGHT, FLAGGED),
    ),
    "many crossings": (
        "-x", 1.0, 0.0, _event("e", "sin(50*t)"), 4.0, _at(*(k * math.pi / 50 for k in range(1, 64))), (RIGHT, FLAGGED),
    ),
    "simultaneous": ("-x", 1.0, 0.0, _event("a", "x") + _event("b", "2*x"), _T, _together, (RIGHT,)),
    "simultaneous resets": (
        "0*x", 0.0, 1.0, _event("a", "x - 1", "rising", '{ reset = { "dot(x)" = "2*dot(x)" } }')
        + _event("b", "2*x - 2", "rising", '{ reset = { "dot(x)" = "dot(x) + 1" } }'), 2.0, _order, (RIGHT,),
    ),
    "grazing": ("-x", 1.0, 0.0, _event("e", "x + 1"), _T - 0.5, _grazing, (RIGHT,)),
    "missed by 1e-6": ("-x", 1.0, 0.0, _event("e", "x + 1.000001"), _T, _near_miss, (RIGHT,)),
    "crossed by 1e-6": (
        "-x", 1.0, 0.0, _event("e", "x + 0.999999"), _T,
        _at(math.pi - math.acos(0.999999), math.pi + math.acos(0.999999), allowed=1e-3), (RIGHT, FLAGGED),
    ),
    "zeno": ("-1", 1.0, 0.0, _BALL.format(reset="-0.5*dot(x)"), 10.0, _ball_end, (FLAGGED,)),
    "elastic": ("-1", 1.0, 0.0, _BALL.format(reset="-dot(x)"), 10.0, _stays_up, (RIGHT,)),
    "reset that does not turn": ("-1", 1.0, 0.0, _BALL.format(reset="0.5*dot(x)"), 10.0, None, (RIGHT, FLAGGED)),
    "reset to rest": ("-1", 1.0, 0.0, _BALL.format(reset="0"), 10.0, _falls_anew, (RIGHT,)),
    "reset to nan": ("-1", 1.0, 0.0, _BALL.format(reset="sqrt(-1 - dot(x)^2)"), 10.0, None, (FLAGGED,)),
    "reset to infinity": ("-1", 1.0, 0.0, _BALL.format(reset="exp(1e4)"), 10.0, None, (FLAGGED, REFUSED)),
    "event function that becomes nan": ("-1", 1.0, 0.0, _event("e", "sqrt(x) - 0.5"), 2.0, None, (RIGHT, FLAGGED)),
    "terminates at the start": ("-x", 0.0, 1.0, _event("e", "x", "both", '"terminate"'), 4.0, _at(math.pi), (RIGHT,)),
}  # fmt: skip
_REASON = "zeno|pile|event|reset|finite|infinite|nan|undefined|energy|resolution|step|exp"


def situation(name: str, method: str) -> Outcome:
    """Run one situation and look at what fired."""
    force, start, rate, events, t_end, check, verdicts = SITUATIONS[name]
    try:
        system = point("with_events", force, start, rate, events)
    except Exception as error:  # a model that is refused
        from .judging import refusal

        return demand(refusal(error), verdicts, _REASON)
    fixed = method != "auto" and not METHODS[method].adaptive
    run = attempt(system, t_end, method=method, step=_STEP if fixed else None)
    outcome = flag(run)
    if outcome is not None and outcome.verdict == REFUSED:
        return outcome
    found = check(run) if check is not None else ""
    if outcome is None:
        outcome = Outcome(WRONG, found) if found else Outcome(RIGHT, f"{len(run.events)} events")
    elif found and run.status == "zeno":
        outcome = Outcome(WRONG, found)
    if outcome.verdict == FLAGGED and fixed:
        return outcome
    return demand(outcome, verdicts, _REASON)


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for name in SITUATIONS:
        for method in ("auto", *METHODS):
            low = method in ("euler", "semi_implicit_euler", "implicit_euler")
            if low or (name in _FINE and method != "auto" and METHODS[method].order <= 2):
                continue  # they find the events of their own, coarse motion
            run = functools.partial(situation, name, method)
            yield Scenario(
                "events", f"{name}: {method}", run, method, short=method in ("auto", "dop853", "radau5")
            )
