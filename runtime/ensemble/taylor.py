"""Taylor series in lanes: the steps of `integrate/taylor.py`, one for each member.

A step's length needs no more than the size of the last terms to some percent, so logarithms are read from the bits of
numbers, and powers of two written there. Two series stand side by side, of the current states and of new ones; lanes
that reject a step copy theirs, and the two change places.
"""

from __future__ import annotations

from functools import partial

from symgen.runtime.ensemble.bits import exp2, log2
from symgen.runtime.ensemble.breaks import follow
from symgen.runtime.ensemble.events import act_on_events, arm, find_events
from symgen.runtime.ensemble.lanes import (
    Lanes,
    Reached,
    commit,
    copy_rows,
    keep_energy,
    project,
    write_frames,
)
from symgen.runtime.ensemble.slots import AT
from symgen.runtime.ensemble.writer import ADDRESS, Code, Rows, Value
from symgen.runtime.integrate.step_control import EPS
from symgen.runtime.integrate.taylor import (
    _LEAST_DECAY,
    _MOST_LEFT,
    _RIDGE,
    _TINY,
    CAUTION,
    CREEPS_FOR_LONG,
    DEFECT_LIMIT,
    FORGET,
    FORGET_FAR,
    FORGET_REACH,
    GOLDEN_RATIO,
    LARGEST_ROUND_OFF,
    MIN_PIVOT,
    MOST_VARIED,
    ROUND_OFF_GAIN,
    ROUND_OFF_RTOL,
    WINDOW,
)
from symgen.runtime.taylor.kernel import N_ROWS


def _one_by(code: Code, n: Value) -> Value:
    """The reciprocal of an integer: lanes are multiplied by it, as divisions of vectors take ten times as long."""
    return code.number(1.0) / code.to_number(n)


def _row(lanes: Lanes, series: Rows, k: int | Value) -> Rows:
    return series.behind(lanes.ny * k)


def _compute(lanes: Lanes, t: Value, y: Rows, series: Rows) -> None:
    """Compute the series at states, up to the order."""
    series.single()[0] = lanes.code.to_number(lanes.order)
    lanes.code.call_kernel(lanes.series, t, y, lanes.p, series)


def _ratio(lanes: Lanes, series: Rows) -> Value:
    return series[lanes.ny * N_ROWS]


def begin(lanes: Lanes) -> Value:
    """Write what computes the series at the start; returns a length for the sizes of rates during the first step."""
    code, s = lanes.code, lanes.k
    _compute(lanes, lanes.own("t"), lanes.y, s)
    lanes.set_own("pivot", code.smaller(lanes.own("pivot"), _ratio(lanes, s)))
    lanes.set_own("before", float("inf"))
    longest = code.variable(float("inf"))
    size = code.variable(0.0)
    with code.each(lanes.n, lanes.nq) as i:
        size.value = code.larger(size.value, code.larger(code.size(s[i]), code.size(_row(lanes, s, 1)[i])))
    for back in range(1, WINDOW + 1):
        k, largest = lanes.order - back, code.variable(0.0)
        with code.each(lanes.n, lanes.nq) as i:
            largest.value = code.larger(largest.value, code.size(_row(lanes, s, k)[i]))
        guess = exp2((log2(size.value) - log2(largest.value)) * _one_by(code, k))
        guess = code.select(
            size.value > 0.0, guess, code.all_lanes(0.0)
        )  # what begins to move has no sizes yet
        longest.value = code.select(largest.value > 0.0, code.smaller(longest.value, guess), longest.value)
    return longest.value * 0.1


def _tolerance(lanes: Lanes, s: Rows, h: Value, i: Value) -> Value:
    """As `taylor.rate_tolerance`."""
    code = lanes.code
    size = code.larger(code.size(s[i]), h * code.size(_row(lanes, s, 1)[i]))
    size = code.larger(size, h * h * code.size(_row(lanes, s, 2)[i]))
    return code.larger(lanes.atol + lanes.rtol * size, 1e-300)


def _reach(lanes: Lanes, s: Rows, h: Value, t: Value) -> Value:
    """How far series reach, as `taylor.series_step`; not a number where they are not finite."""
    code = lanes.code
    last = lanes.order - 1
    tolerance = code.larger(code.as_kind(lanes.rtol, "lanes"), 1e-17)
    terms = [code.variable(0.0) for _ in range(WINDOW)]
    sound = code.variable(0.0)
    with code.each(lanes.ny, lanes.nq) as i:
        weight = tolerance / _tolerance(lanes, s, h, i)
        for back, term in enumerate(terms):
            value = _row(lanes, s, last - back)[i]
            sound.value = sound.value + value * 0.0
            term.value = code.larger(term.value, weight * code.size(value))
    highest = code.variable(float("-inf"))
    for back, term in enumerate(terms):
        size = log2(term.value) * _one_by(code, last - back)
        highest.value = code.select(term.value > 0.0, code.larger(highest.value, size), highest.value)
    with code.when(code.any(~(highest.value > float("-inf")))):
        _look_below(lanes, s, h, tolerance, highest)
    known = highest.value > float("-inf")
    reach = exp2(lanes.log_left_out * _one_by(code, last) - highest.value)
    reach = code.select(known, reach, lanes.longest_step(t))
    reach = code.select(~(h < float("inf")), lanes.longest_step(t), reach)
    return code.smaller(reach, _quaternion_reach(lanes, s)) + sound.value


def _look_below(lanes: Lanes, s: Rows, h: Value, tolerance: Value, highest) -> None:
    """The highest term below the last ones that is not zero, as `taylor.first_term_below`."""
    code = lanes.code
    with code.down(lanes.order - 1 - WINDOW, code.quotient(lanes.order - 1, code.integer(2))) as k:
        largest = code.variable(0.0)
        with code.each(lanes.ny, lanes.nq) as i:
            size = code.size(_row(lanes, s, k)[i]) * tolerance / _tolerance(lanes, s, h, i)
            largest.value = code.larger(largest.value, size)
        found = (largest.value > 0.0) & ~(highest.value > float("-inf"))
        highest.value = code.select(found, log2(largest.value) / code.to_number(k), highest.value)


def _quaternion_reach(lanes: Lanes, s: Rows) -> Value:
    """As `taylor.quaternion_step`."""
    code = lanes.code
    highest = code.variable(float("-inf"))
    with code.each(lanes.n_quaternions) as number:
        first = lanes.quaternions[number]
        for back in (1, 0):
            k = lanes.order - back
            for j in range(4):
                size = code.size(_row(lanes, s, k)[first + j])
                power = log2(size) * _one_by(code, k)
                highest.value = code.select(size > 0.0, code.larger(highest.value, power), highest.value)
    reach = exp2(lanes.log_of_turns * _one_by(code, lanes.order) - highest.value)
    return code.select(highest.value > float("-inf"), reach, code.all_lanes(float("inf")))


def _sum(lanes: Lanes, s: Rows, h: Value) -> None:
    """Write sums, what rounding loses in them and the slopes to `y_new`, `lost` and `slope`."""
    code = lanes.code
    with code.each(lanes.ny) as i:
        mean, slope = code.variable(_row(lanes, s, lanes.order)[i]), code.variable(0.0)
        with code.down(lanes.order - 1, 1) as k:
            slope.value = code.fused(slope.value, h, mean.value)
            mean.value = code.fused(mean.value, h, _row(lanes, s, k)[i])
        rise = code.fused(mean.value, h, lanes.carry[i])
        total = s[i] + rise
        back = total - s[i]
        lanes.y_new[i] = total
        lanes.lost[i] = (s[i] - (total - back)) + (rise - back)
        lanes.slope[i] = code.fused(slope.value, h, mean.value)


def _add_tail(lanes: Lanes, s: Rows, h: Value) -> None:
    """Add what follows the last terms, as `taylor.add_tail`; `dense` keeps it."""
    code, order = lanes.code, lanes.order
    power = code.variable(1.0)
    with code.each(order - 4):
        power.value = power.value * h
    scale3 = power.value
    scale2 = scale3 * h
    scale1 = scale2 * h
    scale0 = scale1 * h
    sums = {name: code.variable(0.0) for name in ("aa", "ab", "bb", "ya", "yb", "yy")}
    with code.each(lanes.ny, lanes.nq) as i:
        y0, y1, y2, y3 = (
            scale * _row(lanes, s, order - back)[i]
            for back, scale in enumerate((scale0, scale1, scale2, scale3), 1)
        )
        for name, value in (
            ("yy", y0 * y0 + y1 * y1), ("ya", y0 * y1 + y1 * y2), ("yb", y0 * y2 + y1 * y3),
            ("aa", y1 * y1 + y2 * y2), ("ab", y1 * y2 + y2 * y3), ("bb", y2 * y2 + y3 * y3),
        ):  # fmt: skip
            sums[name].value = sums[name].value + value
    aa, bb = sums["aa"].value * (1.0 + _RIDGE), sums["bb"].value * (1.0 + _RIDGE)
    ab, ya, yb, yy = (sums[name].value for name in ("ab", "ya", "yb", "yy"))
    determinant = aa * bb - ab * ab
    scale = 1.0 / determinant
    a, b = (ya * bb - yb * ab) * scale, (yb * aa - ya * ab) * scale
    most, left = yy * _MOST_LEFT, yy - a * ya - b * yb
    told = (determinant > _TINY) & (yy > _TINY) & (left < most) & (1.0 - b - code.size(a) > _LEAST_DECAY)
    factor = (most - left) / (most * (1.0 - a - b))
    zero = code.all_lanes(0.0)
    before = code.select(told, factor * b * scale1, zero)
    last = code.select(told, factor * (a + b) * scale0, zero)
    turns = code.as_kind(code.to_number(order), "lanes") / h
    with code.each(lanes.ny, lanes.nq) as i:
        tail = before * _row(lanes, s, order - 2)[i] + last * _row(lanes, s, order - 1)[i]
        total = lanes.y_new[i]
        rounded = total + tail
        lanes.lost[i] = lanes.lost[i] + (tail - (rounded - total))
        lanes.y_new[i] = rounded
        lanes.slope[i] = code.fused(turns, tail, lanes.slope[i])
        lanes.dense[i] = tail


def _defect(lanes: Lanes, s: Rows, h: Value, following: Rows) -> Value:
    """How far accelerations are from those that the series predicts, as `taylor.defect`."""
    code = lanes.code
    worst = code.variable(0.0)
    with code.each(lanes.n, lanes.nq) as i:
        off = code.size(lanes.slope[i] - _row(lanes, following, 1)[i])
        error = off * h * _one_by(code, lanes.order) / _tolerance(lanes, s, h, i)
        worst.value = code.select(error <= worst.value, worst.value, error)
    return worst.value


def attempt(lanes: Lanes, active: Value) -> Value:
    """Write one step of all lanes; returns in which of them the member is done."""
    code = lanes.code
    arm(lanes, active)
    s, following = (Rows(code, code.slot(AT[name], ADDRESS)) for name in ("k", "k_other"))
    t, stop = lanes.own("t"), lanes.next_stop()
    again = lanes.own("last_rejected") > 0.5
    wanted, creeping = _choose_step(lanes, s, t, stop, active, again)
    too_small = ~(wanted > code.larger(code.size(t) * (16.0 * EPS), code.as_kind(lanes.h_min, "lanes")))
    t1 = code.select(t + wanted * 1.01 >= stop, stop, t + wanted)
    h = t1 - t
    _sum(lanes, s, h)
    with code.when(code.compare("ne", lanes.has_tail, 0)):
        _add_tail(lanes, s, h)
    end = _reach_end(lanes, active, t1, following)
    error = _defect(lanes, s, h, following)
    accepted = _judge(lanes, end, error, wanted, h)
    dense = (lambda: None), partial(_at, lanes, s, h)
    stopped = find_events(lanes, accepted, t, t1, *dense)
    write_frames(lanes, stopped.accepted, t, stopped.t, *dense, whole=h)

    def derive(at: Value) -> None:
        _compute(lanes, at, lanes.y_new, following)

    stopped = act_on_events(lanes, stopped, derive)
    with code.when(code.any(stopped.happened)):
        with code.each(lanes.ny) as i:
            lanes.lost[i] = code.select(stopped.happened, code.all_lanes(0.0), lanes.lost[i])
    followed = follow(lanes, stopped.accepted, stopped.t, derive)
    gone = active & ~accepted & (too_small | creeping)
    accepted = stopped.accepted
    lanes.set_own("pivot", code.smaller(lanes.own("pivot"), _ratio(lanes, following)), accepted)
    copy_rows(lanes, lanes.lost, lanes.carry, lanes.ny, accepted)
    with code.when(code.any(~accepted)):
        copy_rows(lanes, s, following, (lanes.order + 1) * lanes.ny, ~accepted)
    code.set_slot(AT["k"], following.address)
    code.set_slot(AT["k_other"], s.address)
    # Single runs see singular configurations and change points through.
    has_constraints = code.all_flags(lanes.m > 0)
    end = Reached(accepted, end.lost | (gone & has_constraints), end.infinite & ~has_constraints, end.taken)
    return commit(lanes, active, end, followed.t, stopped.t - t, gone, stopped.leaving, stopped.ended)


def _choose_step(
    lanes: Lanes, s: Rows, t: Value, stop: Value, active: Value, again: Value
) -> tuple[Value, Value]:
    """As `taylor.choose_step`: the step to try, and where steps creep towards a change point."""
    code = lanes.code
    before = lanes.own("h")
    reach = _reach(lanes, s, before, t) * (1.0 - lanes.own("shorter"))
    longest = lanes.longest_step(t)
    chosen = code.smaller(reach, longest)
    creeping = code.variable(code.flags(False))
    with code.when(lanes.m > 0):
        reached = code.larger(lanes.own("reach"), lanes.own("far") * CREEPS_FOR_LONG)
        ahead = code.smaller(code.smaller(reached, longest), stop - t)
        creeping.value = (reach < ahead * lanes.creeps) & ~again
        for memory, forget in (("reach", FORGET_REACH), ("far", FORGET_FAR)):
            lanes.set_own(memory, code.larger(lanes.own(memory) * forget, chosen), active & ~again)
    varied = lanes.own("varied") + GOLDEN_RATIO
    varied = code.select(varied >= 1.0, varied - 1.0, varied)
    fine = code.all_flags(lanes.rtol <= ROUND_OFF_RTOL)
    lanes.set_own("varied", varied, active & ~again & fine)
    chosen = code.select(fine, chosen * (1.0 - lanes.own("varied") * MOST_VARIED), chosen)
    return code.select(again, before, chosen), creeping.value


def _reach_end(lanes: Lanes, active: Value, t1: Value, following: Rows) -> Reached:
    """Project new states and compute their series, as `taylor.reach_end`."""
    code = lanes.code
    on_constraints, taken = code.variable(active), code.variable(0.0)
    with code.when(lanes.n_project > 0):
        on_constraints.value = project(lanes, t1, lanes.y_new, active, code.flags(False))
        taken.value = keep_energy(lanes, t1, lanes.y_new, on_constraints.value)
        with code.each(lanes.ny) as i:
            lanes.lost[i] = 0.0
    _compute(lanes, t1, lanes.y_new, following)
    total = code.variable(0.0)
    with code.each(lanes.ny * 2) as i:
        total.value = total.value + following[i] * 0.0
    regular = (_ratio(lanes, following) >= MIN_PIVOT) | ~code.all_flags(lanes.m > 0)
    finite = code.compare("eq", total.value, 0.0)
    accepted = on_constraints.value & finite & regular
    lost = active & ~(on_constraints.value & regular)
    return Reached(accepted, lost, on_constraints.value & ~finite, taken.value)


def _judge(lanes: Lanes, end: Reached, error: Value, wanted: Value, h: Value) -> Value:
    """Return where steps are accepted; set what the next step needs."""
    code, active = lanes.code, lanes.own("active") > 0.5
    round_off = (error > code.larger(lanes.own("before") * (1.0 / ROUND_OFF_GAIN), DEFECT_LIMIT)) & (
        error * lanes.rtol <= LARGEST_ROUND_OFF
    )
    lanes.set_own("round_off", error, end.accepted & round_off)
    accepted = end.accepted & (error <= code.larger(lanes.own("round_off") * ROUND_OFF_GAIN, DEFECT_LIMIT))
    too_far = end.accepted & ~accepted
    part = exp2(log2(DEFECT_LIMIT / error) * _one_by(code, lanes.order - 1)) * 0.85
    half = code.all_lanes(0.5)
    part = code.select(too_far & (part > 0.5), part, half)
    shorter = lanes.own("shorter")
    longer_again = code.select(accepted, shorter * FORGET, shorter)
    cautious = code.smaller(1.0 - (1.0 - shorter) * (1.0 - CAUTION), half)
    lanes.set_own("shorter", code.select(too_far, cautious, longer_again), active)
    infinity = code.all_lanes(float("inf"))
    lanes.set_own(
        "before", code.select(too_far, error, code.select(accepted, infinity, lanes.own("before"))), active
    )
    lanes.set_own("h", code.select(accepted, wanted, part * h), active)
    lanes.set_own("last_rejected", code.select(accepted, code.all_lanes(0.0), code.all_lanes(1.0)), active)
    return accepted


def _at(lanes: Lanes, s: Rows, h: Value, theta: Value, out: Rows) -> None:
    """Write the states at places of the step: the series and its tail."""
    code, here = lanes.code, theta * h
    power = code.variable(1.0)
    with code.each(lanes.order):
        power.value = power.value * theta
    with code.each(lanes.ny) as i:
        total = code.variable(_row(lanes, s, lanes.order)[i])
        with code.down(lanes.order - 1, 0) as k:
            total.value = code.fused(total.value, here, _row(lanes, s, k)[i])
        out[i] = total.value
    with code.when(code.compare("ne", lanes.has_tail, 0)):
        with code.each(lanes.ny, lanes.nq) as i:
            out[i] = code.fused(lanes.dense[i], power.value, out[i])
