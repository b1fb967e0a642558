"""Times that steps of members land on, and inputs over time, in lanes.

A member goes from interval to interval. `slots` has them as rows of `intervals`: where the interval ends and where the
next one begins (neighbouring numbers at a jump), whether steps begin anew there, the longest step, and for each input
over time the knot and the coefficients of its polynomial. `interval` has of each lane the first four.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from symgen.runtime.ensemble.lanes import INTERVAL_ANEW, INTERVAL_END, INTERVAL_NEXT, Lanes, take_interval
from symgen.runtime.ensemble.writer import Value


@dataclass(eq=False)
class Followed:
    """Where accepted steps leave members.

    Attributes
    ----------
    t : Value
        The time from which they go on.
    passed : Value
        Lanes that are in another interval now.
    anew : Value
        Those of them whose steps begin anew.
    """

    t: Value
    passed: Value
    anew: Value


def follow(lanes: Lanes, accepted: Value, t1: Value, derive: Callable[[Value], None]) -> Followed:
    """Let lanes whose accepted steps end an interval enter the next one.

    Parameters
    ----------
    derive : callable
        Writes what works out the derivatives of `y_new` at a time, for all lanes.
    """
    code = lanes.code
    nowhere = code.flags(False)
    if not lanes.with_breaks:
        return Followed(t1, nowhere, nowhere)
    t, anew = code.variable(t1), code.variable(nowhere)
    passed = accepted & (t1 >= lanes.interval[INTERVAL_END])
    with code.when(code.any(passed)):
        following = code.smaller(lanes.interval[INTERVAL_NEXT], code.as_kind(lanes.t_end, "lanes"))
        t.value = code.select(passed, following, t1)
        anew.value = passed & (lanes.interval[INTERVAL_ANEW] > 0.5)
        mask = code.mask(passed)
        with code.each(code.lanes) as lane:
            with code.when(code.bit(mask, lane)):
                take_interval(lanes, lane, lanes.interval_of_lane[lane] + 1)
        derive(t.value)
    return Followed(t.value, passed, anew.value)
