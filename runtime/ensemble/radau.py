"""Radau IIA methods in lanes: the steps of `integrate/radau/`, one for each member.

Lanes take a step together, each of a length of its own: Newton's iteration goes on until it has ended in all of them,
and changes nothing in those in which it has. Jacobians and factors are kept lane by lane, while they serve. What
differs from single runs are some powers, read from bits, in the choice of steps; and configurations in which
accelerations are not determined by the usual factors leave the lanes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

from symgen.runtime.ensemble import dense_lu
from symgen.runtime.ensemble.bits import cube_root, power
from symgen.runtime.ensemble.breaks import follow
from symgen.runtime.ensemble.dense_lu import Complex, Real
from symgen.runtime.ensemble.dense_output import dense_rows, nested_at
from symgen.runtime.ensemble.events import act_on_events, arm, find_events
from symgen.runtime.ensemble.first_step import choose_anew, first_step
from symgen.runtime.ensemble.lanes import (
    Lanes,
    commit,
    copy_rows,
    evaluate_start,
    finite_rows,
    note_pivots,
    reach,
    write_frames,
)
from symgen.runtime.ensemble.rotations import (
    by_rotation,
    chart_rate,
    dot,
    each_position,
    each_quaternion,
    parts,
    put,
    retract,
    rotated,
    solve_rotation,
)
from symgen.runtime.ensemble.writer import INTEGER, Rows, Value
from symgen.runtime.integrate.jacobian import TRUSTED_PIVOT_RATIO
from symgen.runtime.integrate.newton import MAX_ITERATIONS
from symgen.runtime.integrate.radau.coefficients import RadauIIA, radau
from symgen.runtime.integrate.radau.loop import GROW, GROW_RATE, KEEP_STEP, SHRINK
from symgen.runtime.integrate.radau.newton import _FADING, KEEP_JACOBIAN_RATE, ROUND_OFF
from symgen.runtime.integrate.step_control import EPS, SAFETY

# What lanes carry from step to step, zero where a member begins: whether they have a Jacobian, one of the present
# state, factors, and the last step's polynomial; its length, for which steps factors are, the last error, what
# Newton's rate of contraction leaves, and that rate.
STATE = (
    "jacobian",
    "fresh",
    "factors",
    "history",
    "h_last",
    "factored_for",
    "error_old",
    "rest",
    "last_rate",
)


def work_length(n_stages: int, nq: int, nv: int, m: int, ny: int) -> int:
    """Rows of `newton` that a method works in; see `_Work`."""
    pairs, rows = n_stages // 2, nv + m
    linear = 2 * nv * nv + 2 * (1 + 2 * pairs) * nv * nv + 2 * (1 + pairs) * nv
    stages = n_stages * ny + 4 * n_stages * nv + 4 * nv + 3 * n_stages
    equations = nq + nv + rows + rows * (nq + nv + rows) + rows * rows + rows + 2 * rows * nv
    return len(STATE) + linear + stages + equations


class _Work:
    """Work arrays, one after another; the first are kept from step to step."""

    def __init__(self, lanes: Lanes, method: RadauIIA) -> None:
        self._rest = lanes.newton
        nq, nv, rows = lanes.nq, lanes.n - lanes.nq, lanes.n - lanes.nq + lanes.m
        self.nv, self.n_rows, self.n_columns = nv, rows, lanes.n + rows
        square, pairs = nv * nv, range(len(method.nu))
        take = self._take
        self._state = take(len(STATE))
        self.jacobian = take(square * 2)  # ∂a/∂q, ∂a/∂v, row by row
        self.real, self.trial = Real(take(square)), Real(take(square))
        self.complex = [Complex(take(square), take(square)) for _ in pairs]
        self.complex_trial = [Complex(take(square), take(square)) for _ in pairs]
        self.pivots = [take(nv) for _ in (0, *pairs)]
        self.pivots_trial = [take(nv) for _ in (0, *pairs)]
        self.stages = [take(lanes.ny) for _ in method.c]
        # Transformed increments of v, and their corrections: a real row, then real and imaginary parts of each pair.
        self.x, self.dx = [take(nv) for _ in method.c], [take(nv) for _ in method.c]
        # The same of rotation vectors, which stand in `stages` in place of quaternions' increments; their derivatives.
        self.turn_x, self.turn_dx = [take(nv) for _ in method.c], [take(nv) for _ in method.c]
        self.turn_rates = take(3 * len(method.c))
        self.per_tolerance = take(nv * 2)  # of positions, then rates
        self.error = take(nv * 2)
        self.arguments = take(nq + nv + rows)
        self.derivative = take(rows * self.n_columns)
        self.block, self.block_pivots, self.right = (
            Real(take(rows * rows)),
            take(rows),
            Real(take(rows * nv * 2)),
        )

    def _take(self, n: Value | int) -> Rows:
        here, self._rest = self._rest, self._rest.behind(n)
        return here

    def own(self, name: str) -> Value:
        """What each lane carries under a name of `STATE`."""
        return self._state[STATE.index(name)]

    def set_own(self, name: str, value: Value | float, where: Value) -> None:
        place = STATE.index(name)
        self._state[place] = where.code.select(where, value, self._state[place])


@dataclass(eq=False)
class _Step:
    """A step that is being tried.

    Attributes
    ----------
    t, h, per_h : Value
        Its start, its length, and one over that.
    rows : list of Rows
        Derivatives at the start, at the end, and at the stages.
    """

    t: Value
    h: Value
    per_h: Value
    rows: list[Rows]

    @property
    def stages(self) -> list[Rows]:
        return self.rows[2:]


@dataclass(eq=False)
class _Solved:
    """How Newton's iteration has ended.

    Attributes
    ----------
    converged : Value
        Lanes in which it did.
    iterations, rate, overshoot : Value
        How many; the rate of contraction, and by how much the last one allowed would have missed, see
        `integrate/newton.py`.
    infinite : Value
        Lanes with derivatives that are not finite.
    """

    converged: Value
    iterations: Value
    rate: Value
    overshoot: Value
    infinite: Value


def begin_of(n_stages: int) -> Callable[[Lanes], Value]:
    """Return what writes how members begin: it finds the derivatives at the start, and returns the first step."""

    def begin(lanes: Lanes) -> Value:
        evaluate_start(lanes)
        return first_step(
            lanes, lanes.own("t"), lanes.k.behind(lanes.n_row), lambda a: _root(a, n_stages + 1)
        )

    return begin


def attempt_of(n_stages: int) -> Callable[[Lanes, Value], Value]:
    """Return what writes one step of all lanes with a method of so many stages; see `lanes.function_run`."""

    def attempt(lanes: Lanes, active: Value) -> Value:
        return _attempt(lanes, active, radau(n_stages))

    return attempt


def _root(a: Value, index: int) -> Value:
    """The root of index 4, 6 or 8 of numbers that are not negative."""
    code = a.code
    return cube_root(code.root(a)) if index == 6 else _root_of_two(a, {4: 2, 8: 3}[index])


def _root_of_two(a: Value, times: int) -> Value:
    for _ in range(times):
        a = a.code.root(a)
    return a


def _attempt(lanes: Lanes, active: Value, method: RadauIIA) -> Value:
    code, w, n_stages = lanes.code, _Work(lanes, method), len(method.c)
    arm(lanes, active)
    t, wanted = lanes.own("t"), lanes.own("h")
    stop = lanes.next_stop()
    step = code.smaller(wanted, lanes.longest_step(t))
    t1 = code.select(t + step * 1.01 >= stop, stop, t + step)
    h = t1 - t
    too_small = ~(wanted > code.larger(code.size(t) * (16.0 * EPS), code.as_kind(lanes.h_min, "lanes")))
    s = _Step(t, h, 1.0 / h, [lanes.k.behind(lanes.n_row * k) for k in range(2 + n_stages)])
    bound = _set_tolerances(lanes, n_stages, w)
    undetermined = _renew_jacobian(lanes, active, s, w)
    factored = _renew_factors(lanes, method, active & ~undetermined, s, w)
    _predict(lanes, method, s, w)
    solved = _solve_stages(lanes, method, factored, bound, s, w)
    error = _estimate_error(lanes, method, solved.converged, s, w)
    tried = solved.converged & (error < 1.0)
    _find_end(lanes, method, s, w)
    end = reach(lanes, tried, t1, s.rows[1], code.flags(False))
    _choose_step(lanes, n_stages, active, end.accepted, solved, error, s, w)
    infinite = end.infinite | (active & (solved.infinite | (solved.converged & ~code.finite(error))))
    _make_dense(lanes, method, end.accepted, w)
    states_at = partial(nested_at, lanes, n_stages + 1)
    stopped = find_events(lanes, end.accepted, t, t1, _nothing, states_at)
    write_frames(lanes, stopped.accepted, t, stopped.t, _nothing, states_at, whole=h)

    def derive(at: Value) -> None:
        lanes.call("rhs", at, lanes.y_new, s.rows[1])

    stopped = act_on_events(lanes, stopped, derive)
    followed = follow(lanes, stopped.accepted, stopped.t, derive)
    _forget(lanes, (end.accepted & ~stopped.accepted) | stopped.happened | followed.passed, w)
    small = active & ~end.accepted & too_small
    end = replace(end, accepted=stopped.accepted, infinite=infinite, unsolved=factored & ~solved.converged)
    copy_rows(lanes, s.rows[1], s.rows[0], lanes.ny, end.accepted)
    leaving = stopped.leaving | undetermined
    done = commit(lanes, active, end, followed.t, stopped.t - t, small & ~leaving, leaving, stopped.ended)
    choose_anew(lanes, followed, s.rows[1], lambda a: _root(a, n_stages + 1))
    return done


def _nothing() -> None:
    """Dense output is there already: the next step begins from it."""


def _set_tolerances(lanes: Lanes, n_stages: int, w: _Work) -> Value:
    """Set one over the tolerance of every component, as `radau.error.set_tolerances`; returns Newton's."""
    code, rates = lanes.code, lanes.y.behind(lanes.nq)
    rtol, atol = lanes.stage_rtol, lanes.stage_atol

    def per_tolerance(size: Value) -> Value:
        return 1.0 / code.larger(atol + rtol * size, 4.0 * EPS * size + 1e-300)

    def shift(i: Value, j: Value) -> None:
        w.per_tolerance[j] = per_tolerance(code.size(lanes.y[i]))

    def turn(_: Value, j: Value) -> None:
        put(w.per_tolerance, j, (per_tolerance(code.all_lanes(1.0)),) * 3)

    each_position(lanes, shift, turn)
    with code.each(w.nv) as i:
        w.per_tolerance[w.nv + i] = per_tolerance(code.size(rates[i]))
    return code.as_kind(lanes.newton_bound, "lanes")


def _renew_jacobian(lanes: Lanes, active: Value, s: _Step, w: _Work) -> Value:
    """Take the derivatives of accelerations in lanes that have none; returns those in which they are not determined."""
    code = lanes.code
    lost = code.variable(code.flags(False))
    needed = active & (w.own("jacobian") < 0.5)
    with code.when(code.any(needed)):
        lost.value = needed & ~_differentiate(lanes, s, w)
        copy_rows(lanes, w.right.rows, w.jacobian, w.nv * w.nv * 2, needed)
        for name, value in (("jacobian", 1.0), ("fresh", 1.0), ("factors", 0.0)):
            w.set_own(name, value, needed)
    return lost.value


def _differentiate(lanes: Lanes, s: _Step, w: _Work) -> Value:
    """Write ∂a/∂(q, v) to the first rows of `w.right`, as `jacobian.acceleration_jacobian`; returns where it could."""
    code, n, rows, f = lanes.code, lanes.n, w.n_rows, s.rows[0]
    copy_rows(lanes, lanes.y, w.arguments, n)
    copy_rows(lanes, f.behind(lanes.nq), w.arguments.behind(n), w.nv)
    copy_rows(lanes, f.behind(lanes.ny), w.arguments.behind(n + w.nv), lanes.m)
    with code.each(rows * w.n_columns) as i:  # structural zeros are not written
        w.derivative[i] = 0.0
    lanes.call("jacobian", s.t, w.arguments, w.derivative)
    width = w.nv * 2
    with code.each(rows) as i:
        row, right = w.derivative.behind(i * w.n_columns), w.right.rows.behind(i * width)

        def shift(k: Value, j: Value, row: Rows = row, right: Rows = right) -> None:
            right[j] = -row[k]

        def turn(k: Value, j: Value, row: Rows = row, right: Rows = right) -> None:
            put(right, j, tuple(-x for x in by_rotation(parts(lanes.y, k, 4), parts(row, k, 4))))

        each_position(lanes, shift, turn)
        with code.each(w.nv) as j:
            right[w.nv + j] = -row[lanes.nq + j]
        with code.each(rows) as j:
            w.block.put(i * rows + j, (row[n + j],))
    trusted = code.variable(TRUSTED_PIVOT_RATIO)
    with code.when(lanes.give > 0.0):
        dense_lu.let_constraints_give(lanes, w.block, w.nv, rows)
        trusted.value = code.all_lanes(dense_lu.LEAST_RATIO_WITH_GIVE)
    sound = dense_lu.factor(code, w.block, w.block_pivots, rows)
    sound = sound & (dense_lu.pivot_ratio(code, w.block, rows) > trusted.value)
    dense_lu.solve(code, w.block, w.block_pivots, rows, w.right, width)
    return sound & finite_rows(lanes, w.right.rows, w.nv * width)


def _renew_factors(lanes: Lanes, method: RadauIIA, active: Value, s: _Step, w: _Work) -> Value:
    """Factor Newton's matrices in lanes whose factors do not serve; returns those that have some now."""
    code = lanes.code
    sound = code.variable(active)
    off = code.size(s.h - w.own("factored_for")) > s.h * 1e-6
    needed = active & ((w.own("factors") < 0.5) | off)
    with code.when(code.any(needed)):
        found = code.variable(code.flags(True))
        _set_real_matrix(lanes, s.per_h * method.mu, w)
        found.value = dense_lu.factor(code, w.trial, w.pivots_trial[0], w.nv)
        for nu, matrix, pivots in zip(method.nu, w.complex_trial, w.pivots_trial[1:], strict=True):
            _set_complex_matrix(lanes, s.per_h * float(nu.real), s.per_h * float(nu.imag), matrix, w)
            found.value = found.value & dense_lu.factor(code, matrix, pivots, w.nv)
        kept = [(w.trial.rows, w.real.rows)]
        for trial, matrix in zip(w.complex_trial, w.complex, strict=True):
            kept += [(trial.real, matrix.real), (trial.imag, matrix.imag)]
        for trial, rows in kept:
            copy_rows(lanes, trial, rows, w.nv * w.nv, needed)
        for trial, rows in zip(w.pivots_trial, w.pivots, strict=True):
            copy_rows(lanes, trial, rows, w.nv, needed)
        sound.value = active & (~needed | found.value)
        w.set_own("factors", 1.0, needed & found.value)
        w.set_own("factors", 0.0, needed & ~found.value)
        w.set_own("factored_for", s.h, needed)
        w.set_own("rest", 1.0, needed)  # the rate of contraction of new factors is not known
    return sound.value


def _set_real_matrix(lanes: Lanes, shift: Value, w: _Work) -> None:
    """Write g - B - A/g for a real shift g."""
    code, nv, inverse = lanes.code, w.nv, 1.0 / shift
    with code.each(nv) as i:
        by_q, by_v = w.jacobian.behind(i * nv * 2), w.jacobian.behind(i * nv * 2 + nv)
        with code.each(nv) as j:
            w.trial.put(i * nv + j, (-code.fused(inverse, by_q[j], by_v[j]),))
        w.trial.put(i * nv + i, (w.trial.get(i * nv + i)[0] + shift,))
    each_quaternion(lanes, lambda _, j: _turn_columns(lanes, (shift,), j, w.trial, w))


def _set_complex_matrix(lanes: Lanes, re: Value, im: Value, matrix: Complex, w: _Work) -> None:
    """Write the same for a complex one."""
    code, nv = lanes.code, w.nv
    per_square = 1.0 / (re * re + im * im)
    inverse_re, inverse_im = re * per_square, -(im * per_square)
    with code.each(nv) as i:
        by_q, by_v = w.jacobian.behind(i * nv * 2), w.jacobian.behind(i * nv * 2 + nv)
        with code.each(nv) as j:
            matrix.put(i * nv + j, (-code.fused(inverse_re, by_q[j], by_v[j]), -(inverse_im * by_q[j])))
        diagonal = matrix.get(i * nv + i)
        matrix.put(i * nv + i, (diagonal[0] + re, diagonal[1] + im))
    each_quaternion(lanes, lambda _, j: _turn_columns(lanes, (re, im), j, matrix, w))


def _turn_columns(lanes: Lanes, g: tuple[Value, ...], j: Value, matrix: Real | Complex, w: _Work) -> None:
    """Make the columns from `j` on, of the rates of a quaternion, as `stages.factor_rotations`."""
    code, nv, inverse = lanes.code, w.nv, dense_lu.inverse(g)
    back = tuple(-rate for rate in parts(lanes.y, lanes.nq + j))
    nothing = (code.all_lanes(0.0),) * (len(g) - 1)
    with code.each(nv) as i:
        row = [(part, *nothing) for part in parts(w.jacobian, i * nv * 2 + j)]
        for k, (entry, solved) in enumerate(zip(row, solve_rotation(g, back, tuple(row)), strict=True)):
            place = i * nv + j + k
            change = zip(matrix.get(place), inverse, solved, strict=True)
            matrix.put(place, tuple(a + (entry[0] * b - c) for a, b, c in change))


def _predict(lanes: Lanes, method: RadauIIA, s: _Step, w: _Work) -> None:
    """Start Newton from the last step's polynomial, or from rates that do not change, as `stages.predict_stages`."""
    code, nq, n_stages = lanes.code, lanes.nq, len(method.c)
    known = w.own("history") > 0.5
    ratio = code.select(known, s.h / w.own("h_last"), code.all_lanes(0.0))
    dense = dense_rows(lanes, n_stages + 1)
    theta = [code.fused(ratio, float(c), 1.0) for c in method.c]
    with code.each(lanes.n, nq) as i:
        for place, stage in zip(theta, w.stages, strict=True):
            bend = dense[n_stages][i]
            for j in range(n_stages - 1, 1, -1):
                bend = code.fused(bend, place if j % 2 == 0 else 1.0 - place, dense[j][i])
            moved = (place - 1.0) * (dense[1][i] - place * bend)
            stage[i] = code.select(known, moved, code.all_lanes(0.0))
    with code.each(w.nv) as i:
        seen = [stage[nq + i] for stage in w.stages]
        for weights, transformed in zip(method.from_stages, w.x, strict=True):
            transformed[i] = _weighted(weights, seen)
    _move_positions(lanes, method, s, w)
    each_quaternion(lanes, lambda i, j: _predict_turn(lanes, method, s, i, j, w))


def _predict_turn(lanes: Lanes, method: RadauIIA, s: _Step, i: Value, j: Value, w: _Work) -> None:
    """Guess the stages' rotation vectors by sweeps of their equations, as `stages.predict_rotations`."""
    code = lanes.code
    for stage in w.stages:
        put(stage, i, (code.all_lanes(0.0),) * 3)
    with code.each(len(method.c)):  # each sweep gains one order of h
        _find_turn_rates(lanes, method, i, j, w)
        for axis in range(3):
            rates = _turn_rates_of(method, axis, w)
            for weights, stage in zip(method.a, w.stages, strict=True):
                stage[i + axis] = s.h * _weighted(weights, rates)
    for axis in range(3):
        seen = [stage[i + axis] for stage in w.stages]
        for weights, transformed in zip(method.from_stages, w.turn_x, strict=True):
            transformed[j + axis] = _weighted(weights, seen)


def _find_turn_rates(lanes: Lanes, method: RadauIIA, i: Value, j: Value, w: _Work) -> None:
    """Write the derivatives of the stages' rotation vectors, as `stages.set_rotation_rates`."""
    first = lanes.nq + j
    omega = parts(lanes.y, first)
    with lanes.code.each(len(method.c)) as k:
        stage = w.stages[0].behind(k * lanes.ny)
        moved = tuple(a + b for a, b in zip(omega, parts(stage, first), strict=True))
        put(w.turn_rates, k * 3, chart_rate(parts(stage, i), moved))


def _turn_rates_of(method: RadauIIA, axis: int, w: _Work) -> list[Value]:
    """Read these about one axis, stage by stage."""
    return [w.turn_rates[3 * k + axis] for k in range(len(method.c))]


def _weighted(weights: Iterable[float], values: list[Value]) -> Value:
    """The sum of values, each times its weight."""
    total: Value | None = None
    for weight, value in zip(map(float, weights), values, strict=True):
        if weight != 0.0:
            total = value * weight if total is None else value.code.fused(value, weight, total)
    return total


def _move_positions(lanes: Lanes, method: RadauIIA, s: _Step, w: _Work) -> None:
    """Set the stages' increments of q, but for quaternions, to the integral of v, as `stages.retract_positions`."""
    code, nq = lanes.code, lanes.nq

    def shift(i: Value, j: Value) -> None:
        rate, moved = lanes.y[nq + j], [stage[nq + j] for stage in w.stages]
        for c, weights, stage in zip(method.c, method.a, w.stages, strict=True):
            stage[i] = s.h * code.fused(rate, float(c), _weighted(weights, moved))

    each_position(lanes, shift, lambda i, j: None)


def _solve_stages(lanes: Lanes, method: RadauIIA, wanted: Value, bound: Value, s: _Step, w: _Work) -> _Solved:
    """Improve the stages by simplified Newton in the lanes of `wanted`, as `radau.newton.solve_stages`."""
    code = lanes.code
    going, infinite, converged = (code.variable(flags) for flags in (wanted, *[code.flags(False)] * 2))
    rest = code.variable(power(code.larger(w.own("rest"), EPS), 0.8))
    size_before, ratio, rate, second_rate, overshoot, iterations, size = (
        code.variable(0.0) for _ in range(7)
    )
    turn = code.variable(0, INTEGER)
    with code.forever() as leave:
        leave(~code.any(going.value))
        turn.value = turn.value + 1
        is_first, is_second = code.equal(turn.value, 1), code.equal(turn.value, 2)
        sound = _evaluate_stages(lanes, method, going.value, s, w)
        lost = going.value & ~sound
        infinite.value = infinite.value | lost
        now = going.value & sound
        found = _correct(lanes, method, now, s, w)
        size.value = code.select(now, found, size.value)
        iterations.value = code.select(now, iterations.value + 1.0, iterations.value)
        # As `integrate/newton.judge_correction`.
        ended = code.variable(lost | (now & ~code.finite(found)))
        exact = now & code.compare("eq", found, 0.0)
        settled = code.variable(exact)
        with code.when(~is_first):
            new_ratio = found / size_before.value
            new_rate = code.select(is_second, new_ratio, code.root(new_ratio * ratio.value))
            known = now & ~exact
            ratio.value = code.select(known, new_ratio, ratio.value)
            rate.value = code.select(known, new_rate, rate.value)
            second_rate.value = code.select(known & code.all_flags(is_second), new_rate, second_rate.value)
            slow = known & (new_rate >= 0.99)
            settled.value = settled.value | (slow & (found <= bound))
            ended.value = ended.value | slow
            new_rest = new_rate / (1.0 - new_rate)
            rest.value = code.select(known & ~slow, new_rest, rest.value)
            reached = code.variable(1.0)
            with code.each(MAX_ITERATIONS - 1 - turn.value):
                reached.value = reached.value * new_rate
            expected = new_rest * found * reached.value / bound
            too_slow = known & ~slow & (expected >= 1.0)
            overshoot.value = code.select(too_slow, expected, overshoot.value)
            ended.value = ended.value | too_slow
        size_before.value = code.select(now, code.larger(found, EPS), size_before.value)
        near = now & ~ended.value & (rest.value * found <= bound)
        settled.value = settled.value | near
        last = now & code.all_flags(turn.value >= MAX_ITERATIONS)
        converged.value = converged.value | settled.value
        going.value = now & ~(ended.value | settled.value | last)
    # Before round-off had a part in it, the rate of contraction was that of the second iteration.
    rounded = wanted & ~converged.value & ~infinite.value & (iterations.value > 2.5)
    rounded = rounded & (size.value <= _round_off(lanes, method, s, w) * ROUND_OFF)
    rate.value = code.select(rounded, second_rate.value, rate.value)
    found_rate = code.select(iterations.value > 1.5, rate.value, w.own("last_rate") * _FADING)
    w.set_own("last_rate", found_rate, wanted & ~infinite.value)
    w.set_own("rest", rest.value, wanted)
    return _Solved(converged.value | rounded, iterations.value, rate.value, overshoot.value, infinite.value)


def _evaluate_stages(lanes: Lanes, method: RadauIIA, where: Value, s: _Step, w: _Work) -> Value:
    """Evaluate derivatives at all stages; returns where they are finite."""
    code, sound = lanes.code, lanes.code.flags(True)
    for c, stage, row in zip(method.c, w.stages, s.stages, strict=True):
        _place(lanes, stage, lanes.y_stage)
        lanes.call("rhs", code.fused(s.h, float(c), s.t), lanes.y_stage, row)
        sound = sound & finite_rows(lanes, row, lanes.ny)
        note_pivots(lanes, row, where & sound)
    return sound


def _place(lanes: Lanes, increments: Rows, out: Rows) -> None:
    """Write the state that is `increments` away from the start of the step, as `stages.place`."""
    with lanes.code.each(lanes.ny) as i:
        out[i] = lanes.y[i] + increments[i]
    each_quaternion(lanes, lambda i, _: put(out, i, rotated(parts(lanes.y, i, 4), parts(increments, i))))


def _correct(lanes: Lanes, method: RadauIIA, where: Value, s: _Step, w: _Work) -> Value:
    """Correct the stages in the lanes of `where`, as `stages.correct_stages`; returns the sizes of corrections."""
    code, nq, nv = lanes.code, lanes.nq, w.nv
    shifts = [s.per_h * float(part) for nu in method.nu for part in (nu.real, nu.imag)]
    real_shift = s.per_h * method.mu
    with code.each(nv) as i:
        seen = [row[nq + i] for row in s.stages]
        defects = [_weighted(weights, seen) for weights in method.from_stages]
        w.dx[0][i] = defects[0] - real_shift * w.x[0][i]
        for k in range(1, len(defects), 2):
            re, im = dense_lu.minus_product(
                (defects[k], defects[k + 1]), (shifts[k - 1], shifts[k]), (w.x[k][i], w.x[k + 1][i])
            )
            w.dx[k][i], w.dx[k + 1][i] = re, im
    gs = [(real_shift,), *zip(shifts[0::2], shifts[1::2], strict=True)]
    each_quaternion(lanes, lambda i, j: _find_turn_defect(lanes, method, gs, i, j, w))
    dense_lu.solve(code, w.real, w.pivots[0], nv, Real(w.dx[0]))
    for k, (matrix, pivots) in enumerate(zip(w.complex, w.pivots[1:], strict=True)):
        dense_lu.solve(code, matrix, pivots, nv, Complex(w.dx[2 * k + 1], w.dx[2 * k + 2]))
    rates, positions, turns = (code.variable(0.0) for _ in range(3))

    def shift(_: Value, j: Value) -> None:
        per_q = w.per_tolerance[j]
        moved = _weighted(method.inverse_squares, _squares([row[j] for row in w.dx]))
        positions.value = code.fused(moved, per_q * per_q, positions.value)

    def turn(i: Value, j: Value) -> None:
        turns.value = turns.value + _correct_turn(lanes, method, gs, where, i, j, w)

    each_position(lanes, shift, turn)
    with code.each(nv) as i:
        moves = [row[i] for row in w.dx]
        squared = _squares(moves)
        per_v = w.per_tolerance[nv + i]
        rates.value = code.fused(_weighted([1.0] * len(squared), squared), per_v * per_v, rates.value)
        for row, move in zip(w.x, moves, strict=True):
            row[i] = code.select(where, row[i] + move, row[i])
        transformed = [row[i] for row in w.x]
        for weights, stage in zip(method.to_stages, w.stages, strict=True):
            stage[nq + i] = _weighted(weights, transformed)
    _move_positions(lanes, method, s, w)
    total = code.fused(s.h * s.h, positions.value, rates.value) + turns.value
    return code.root(total / (code.to_number(nv) * (2.0 * len(method.c))))


def _squares(moves: list[Value]) -> list[Value]:
    """The squares of a real number, and of the pairs behind it."""
    return [
        moves[0] * moves[0],
        *(re * re + im * im for re, im in zip(moves[1::2], moves[2::2], strict=True)),
    ]


def _fields(rows: list[Rows]) -> list[Real | Complex]:
    """The transformed components: a real row, then complex ones."""
    return [Real(rows[0]), *(Complex(re, im) for re, im in zip(rows[1::2], rows[2::2], strict=True))]


def _find_turn_defect(
    lanes: Lanes, method: RadauIIA, gs: list[tuple[Value, ...]], i: Value, j: Value, w: _Work
) -> None:
    """Write the transformed defects of a rotation vector, solved for it, and what they change of accelerations.

    As `stages.set_rotation_defect` and `loop.pass_on`.
    """
    code, nv = lanes.code, w.nv
    _find_turn_rates(lanes, method, i, j, w)
    omega = parts(lanes.y, lanes.nq + j)
    for axis in range(3):
        seen = _turn_rates_of(method, axis, w)
        for weights, row in zip(method.from_stages, w.turn_dx, strict=True):
            row[j + axis] = _weighted(weights, seen)
    for g, x, dx, rates in zip(gs, _fields(w.turn_x), _fields(w.turn_dx), _fields(w.dx), strict=True):
        defect = tuple(dense_lu.minus_product(dx.get(j + k), g, x.get(j + k)) for k in range(3))
        moved = solve_rotation(g, omega, defect)
        for k in range(3):
            dx.put(j + k, moved[k])
        with code.each(nv) as row:
            derivative = parts(w.jacobian, row * nv * 2 + j)
            total = rates.get(row)
            for weight, move in zip(derivative, moved, strict=True):
                total = tuple(code.fused(weight, part, old) for part, old in zip(move, total, strict=True))
            rates.put(row, total)


def _correct_turn(
    lanes: Lanes, method: RadauIIA, gs: list[tuple[Value, ...]], where: Value, i: Value, j: Value, w: _Work
) -> Value:  # fmt: skip
    """Correct the stages' rotation vectors after the rates, as `stages.correct_rotations`; returns the squares."""
    code, omega = lanes.code, parts(lanes.y, lanes.nq + j)
    for g, dx, rates in zip(gs, _fields(w.turn_dx), _fields(w.dx), strict=True):
        more = solve_rotation(g, omega, tuple(rates.get(j + k) for k in range(3)))
        for k in range(3):
            dx.put(j + k, tuple(a + b for a, b in zip(dx.get(j + k), more[k], strict=True)))
    total = code.all_lanes(0.0)
    for k in range(3):
        moves = [row[j + k] for row in w.turn_dx]
        squares, per_q = _squares(moves), w.per_tolerance[j + k]
        total = code.fused(_weighted([1.0] * len(squares), squares), per_q * per_q, total)
        for row, move in zip(w.turn_x, moves, strict=True):
            row[j + k] = code.select(where, row[j + k] + move, row[j + k])
        transformed = [row[j + k] for row in w.turn_x]
        for weights, stage in zip(method.to_stages, w.stages, strict=True):
            stage[i + k] = _weighted(weights, transformed)
    return total


def _round_off(lanes: Lanes, method: RadauIIA, s: _Step, w: _Work) -> Value:
    """As `radau.newton.round_off`."""
    code, total = lanes.code, lanes.code.variable(0.0)

    def add(part: Value) -> None:
        total.value = code.fused(part, part, total.value)

    def turn(_: Value, j: Value) -> None:
        for part in parts(w.per_tolerance, w.nv + j):
            add(part)

    each_position(lanes, lambda i, j: add(lanes.y[i] * w.per_tolerance[w.nv + j]), turn)
    size = code.root(total.value / (code.to_number(w.nv) * 2.0))
    return s.per_h * (EPS * method.amplification * method.mu) * size


def _estimate_error(lanes: Lanes, method: RadauIIA, solved: Value, s: _Step, w: _Work) -> Value:
    """The error of the step in units of the tolerance, as `radau.error.estimate_error`."""
    code, nq, nv = lanes.code, lanes.nq, w.nv
    error = code.variable(_filter_error(lanes, method, s.rows[0], False, s, w))
    begins = (w.own("history") < 0.5) | (lanes.own("last_rejected") > 0.5)
    again = solved & begins & (error.value >= 1.0)
    with code.when(code.any(again)):
        copy_rows(lanes, lanes.y, lanes.y_stage, lanes.ny)
        retract(lanes, 1.0, w.error, lanes.y_stage)
        with code.each(nv) as i:
            lanes.y_stage[nq + i] = lanes.y[nq + i] + w.error[nv + i]
        lanes.call("rhs", s.t, lanes.y_stage, s.rows[1])
        filtered = _filter_error(lanes, method, s.rows[1], True, s, w)
        filtered = code.select(
            finite_rows(lanes, s.rows[1], lanes.ny), filtered, code.all_lanes(float("inf"))
        )
        error.value = code.select(again, filtered, error.value)

    def at_least(i: Value, j: Value) -> None:
        error.value = code.larger(error.value, _between_places(method, i, j, w))

    each_quaternion(lanes, at_least)
    return code.larger(error.value, 1e-10)


def _between_places(method: RadauIIA, i: Value, j: Value, w: _Work) -> Value:
    """By how much dense output is off a quaternion, as `stages.error_between_places`."""
    z = parts(w.stages[-1], i)
    part = z[0].code.root(dot(z, z)) * 0.125
    error = w.per_tolerance[j] * 2.0
    for k in range(len(method.c) + 1):
        error = error * (part * (1.0 / (k + 1.0)))
    return error


def _filter_error(lanes: Lanes, method: RadauIIA, row: Rows, again: bool, s: _Step, w: _Work) -> Value:
    """Write the filtered error, and return its norm, as `radau.error.filter_accelerations`."""
    code, nq, nv = lanes.code, lanes.nq, w.nv
    shift, g = s.h * (1.0 / method.mu), s.per_h * method.mu
    by_q, by_v = w.error, w.error.behind(nv)

    def find_part(_: Value, j: Value) -> None:
        off = _weighted(method.error_a, [stage[nq + j] for stage in w.stages])
        by_q[j] = shift * (off + by_v[j] if again else off)

    def find_turn(i: Value, j: Value) -> None:
        omega = parts(lanes.y, nq + j)
        rate = omega
        if again:
            rate = chart_rate(
                parts(by_q, j), tuple(a + b for a, b in zip(omega, parts(by_v, j), strict=True))
            )
        off = [_weighted(method.error, [stage[i + k] for stage in w.stages]) for k in range(3)]
        slip = tuple((code.fused(x, s.per_h, y),) for x, y in zip(off, rate, strict=True))
        put(by_q, j, tuple(x for (x,) in solve_rotation((g,), omega, slip)))

    def add_turn(_: Value, j: Value) -> None:
        more = solve_rotation((g,), parts(lanes.y, nq + j), tuple((x,) for x in parts(by_v, j)))
        put(by_q, j, tuple(a + b for a, (b,) in zip(parts(by_q, j), more, strict=True)))

    def add_part(_: Value, j: Value) -> None:
        by_q[j] = code.fused(shift, by_v[j], by_q[j])

    each_position(lanes, find_part, find_turn)
    with code.each(nv) as i:
        total = code.variable(
            code.fused(_weighted(method.error, [stage[nq + i] for stage in w.stages]), s.per_h, row[nq + i])
        )
        derivative = w.jacobian.behind(i * nv * 2)
        with code.each(nv) as k:
            total.value = code.fused(derivative[k], by_q[k], total.value)
        by_v[i] = total.value
    dense_lu.solve(code, w.real, w.pivots[0], nv, Real(by_v))
    each_position(lanes, add_part, add_turn)
    total = code.variable(0.0)
    with code.each(nv) as i:
        for part in (by_q[i] * w.per_tolerance[i], by_v[i] * w.per_tolerance[nv + i]):
            total.value = code.fused(part, part, total.value)
    return code.root(total.value / (code.to_number(nv) * 2.0))


def _find_end(lanes: Lanes, method: RadauIIA, s: _Step, w: _Work) -> None:
    """Write the state at the last stage to `y_new`; work is a quadrature over the stages as they are in the end."""
    code = lanes.code
    with code.when(lanes.n < lanes.ny):
        _evaluate_stages(lanes, method, code.flags(False), s, w)
        power_of = [row[lanes.n] for row in s.stages]
        for weights, stage in zip(method.a, w.stages, strict=True):
            stage[lanes.n] = s.h * _weighted(weights, power_of)
    _place(lanes, w.stages[-1], lanes.y_new)


def _quotient(solved: _Solved, error: Value, n_stages: int) -> Value:
    """The present length over the next one, as `radau.loop.quotient`."""
    code = error.code
    shy = SAFETY * (1.0 + 2.0 * MAX_ITERATIONS) / (solved.iterations + 2.0 * MAX_ITERATIONS)
    return _within(_root(error, n_stages + 1) / code.smaller(shy, SAFETY))


def _within(factor: Value) -> Value:
    code = factor.code
    return code.larger(code.smaller(factor, 1.0 / SHRINK), 1.0 / GROW)


def _choose_step(
    lanes: Lanes, n_stages: int, active: Value, accepted: Value, solved: _Solved, error: Value, s: _Step, w: _Work
) -> None:  # fmt: skip
    """Set the next step and what is kept for it, as `accept_radau`, `reject_radau` and `shrink_step`."""
    code, h, wanted = lanes.code, s.h, lanes.own("h")
    known, one = w.own("history") > 0.5, code.all_lanes(1.0)
    quotient = _quotient(solved, error, n_stages)
    # After an accepted step.
    predicted = _root(error * error / w.own("error_old"), n_stages + 1) * (w.own("h_last") / h) / SAFETY
    slow = code.smaller(cube_root(w.own("last_rate") / GROW_RATE), 1.0)
    factor = code.larger(code.larger(quotient, _within(predicted)), slow)
    factor = code.select(known, factor, quotient)
    longer = code.smaller(h / factor, lanes.longest_step(s.t))
    longer = code.select(lanes.own("last_rejected") > 0.5, code.smaller(longer, h), longer)
    keeps = solved.rate <= KEEP_JACOBIAN_RATE
    longer = code.select(keeps & (h <= longer) & (longer <= h * KEEP_STEP), h, longer)
    # A step that was cut says nothing against the one that was wanted.
    longer = code.select(h < wanted, code.larger(longer, wanted), longer)
    # After one with too large an error, or after Newton failed.
    by_error = code.select(known, h / quotient, h * 0.1)
    by_error = code.select(code.finite(error) & (error >= 1.0), by_error, h * SHRINK)
    steps_left = 4.0 + MAX_ITERATIONS - 1.0 - solved.iterations
    missed = code.larger(code.smaller(solved.overshoot, 20.0), 1e-4)
    by_newton = h * code.select(solved.overshoot > 0.0, power(missed, -1.0 / steps_left) * 0.8, one * 0.5)
    shorter = code.select(solved.converged, by_error, by_newton)
    rejected = active & ~accepted
    lanes.set_own("h", code.select(accepted, longer, shorter), active)
    lanes.set_own("last_rejected", code.select(accepted, code.all_lanes(0.0), one), active)
    w.set_own("error_old", code.larger(error, 1e-2), accepted)
    w.set_own("h_last", h, accepted)
    w.set_own("history", one, accepted)
    stale = (accepted & ~keeps) | (rejected & (w.own("fresh") < 0.5))
    w.set_own("jacobian", code.all_lanes(0.0), stale)
    w.set_own("fresh", code.all_lanes(0.0), accepted)
    w.set_own("factors", code.all_lanes(0.0), active & ~solved.converged)


def _forget(lanes: Lanes, where: Value, w: _Work) -> None:
    """Begin anew where the state has changed, or the step that was looked at does not stand."""
    for name in ("jacobian", "fresh", "factors", "history", "last_rate"):
        w.set_own(name, 0.0, where)


def _make_dense(lanes: Lanes, method: RadauIIA, accepted: Value, w: _Work) -> None:
    """Write the collocation polynomial of accepted steps, as `stages.radau_dense`."""
    code, ny = lanes.code, lanes.ny
    dense = dense_rows(lanes, len(method.c) + 1)
    each_quaternion(lanes, lambda i, _: _turns_to_increments(lanes, i, w))
    with code.each(ny) as i:
        moved = [stage[i] for stage in w.stages]
        values = [lanes.y[i], lanes.y_new[i] - lanes.y[i], *(_weighted(row, moved) for row in method.rows)]
        for row, value in zip(dense, values, strict=True):
            row[i] = code.select(accepted, value, row[i])


def _turns_to_increments(lanes: Lanes, i: Value, w: _Work) -> None:
    """As `stages.rotations_to_increments`."""
    q = parts(lanes.y, i, 4)
    for stage in w.stages:
        put(stage, i, tuple(a - b for a, b in zip(rotated(q, parts(stage, i)), q, strict=True)))
