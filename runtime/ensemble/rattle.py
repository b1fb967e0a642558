"""RATTLE and its compositions in lanes: the steps of `integrate/rattle/`, one for each member.

Lanes take a step together; Newton's iteration goes on until it has ended in all of them, and changes nothing in those
in which it has. Configurations in which the factors of a single run are not trusted leave the lanes.
"""

from __future__ import annotations

from dataclasses import replace

from symgen.runtime.ensemble import dense_lu
from symgen.runtime.ensemble.dense_lu import LEAST_RATIO_WITH_GIVE, Real, let_constraints_give
from symgen.runtime.ensemble.lanes import ALL, Lanes, commit, copy_rows, reach, write_frames
from symgen.runtime.ensemble.rotations import (
    by_rotation,
    chart_rate,
    chart_variation,
    cross,
    each_position,
    each_quaternion,
    multiplied,
    parts,
    put,
)
from symgen.runtime.ensemble.runge_kutta import grid_step, pass_grid
from symgen.runtime.ensemble.writer import INTEGER, Code, Rows, Value, Variable
from symgen.runtime.integrate.linear import TRUSTED_PIVOT_RATIO
from symgen.runtime.integrate.rattle.step import (
    DIVERGENCE,
    MAX_ITERATIONS,
    MAX_STALLS,
    NEGLIGIBLE,
    NOISE_TOL,
    PROGRESS,
    ROUND_OFF,
    ROUND_OFF_OF_POSITIONS,
)

# What lanes carry from step to step, zero where a member begins: whether they have M, G and ∂M/∂q of their positions,
# and the length of the step from which they have guesses, 0 where they have none. Then, of a composition: its length,
# whether it got on, and whether it came to factors that cannot be trusted.
STATE = ("begun", "h_guess", "length", "went", "undetermined")
PART = 2  # numbers of `parts` for each step of a composition: its length and where it begins, in units of the whole


def work_length(nq: int, nv: int, m: int, nh: int) -> int:
    """Rows of `newton` that the method works in; see `_Work`."""
    rows = nv + m
    carried = nq + 2 * nv + m
    ends = 3 * (2 * nv * nv + m * nv)
    others = nv * nv + 3 * nv + m + nq + (nq + nv) + nh + m
    linear = (1 + rows) * (nq + nv + rows) + rows * rows + 3 * rows
    return len(STATE) + 2 * carried + ends + (2 * nv * nv + m * nv) + others + linear


class _Ends:
    """What a model's positions say, at the start or the end of a step: M and G, row by row; -∂residual/∂q, a = 0."""

    def __init__(self, mass: Rows, gradient: Rows, slope: Rows) -> None:
        self.mass, self.gradient, self.slope = mass, gradient, slope

    def copy(self, lanes: Lanes, target: _Ends, where: Value | None = None) -> None:
        square = (lanes.n - lanes.nq) * (lanes.n - lanes.nq)
        copy_rows(lanes, self.mass, target.mass, square, where)
        copy_rows(lanes, self.gradient, target.gradient, lanes.m * (lanes.n - lanes.nq), where)
        copy_rows(lanes, self.slope, target.slope, square, where)


class _Work:
    """Work arrays, one after another: those of `rattle.work.RattleWork`, by the names of its rows."""

    def __init__(self, lanes: Lanes) -> None:
        self._rest_of_work = lanes.newton
        nq, nv, m = lanes.nq, lanes.n - lanes.nq, lanes.m
        self.nv, self.n_rows, self.n_columns = nv, nv + m, lanes.n + nv + m
        square, take = nv * nv, self._take
        self._state = take(len(STATE))
        # Of what goes on from step to step, and is kept while frames are written: see `keep_guess`.
        self.n_carried = nq + nv * 2 + m
        self.carried, self.kept = take(self.n_carried), take(self.n_carried)
        self.rest, self.probe = self.carried, self.carried.behind(nq)
        self.half_change = self.probe.behind(nv)
        self.impulses = self.half_change.behind(nv)
        self.start, self.end, self.fresh, self.kept_start = (
            _Ends(take(square), take(m * nv), take(square)) for _ in range(4)
        )
        self.turn = take(square)
        self.mean, self.momentum, self.push = take(nv), take(nv), take(nv)
        self.end_impulses = take(m)
        self.travel = take(nq)
        self.trial = take(lanes.n)
        self.residual = take(lanes.nh + m)
        self.arguments = take(self.n_columns)
        self.derivative = take(self.n_rows * self.n_columns)
        self.matrix, self.pivots, self.right, self.unsolved = (
            take(self.n_rows * self.n_rows), take(self.n_rows), take(self.n_rows), take(self.n_rows)
        )  # fmt: skip

    def _take(self, n: Value | int) -> Rows:
        here, self._rest_of_work = self._rest_of_work, self._rest_of_work.behind(n)
        return here

    def trust(self, trusted: Value) -> None:
        """Take lanes out whose factors are not to be trusted."""
        self.set_own("undetermined", 1.0, (self.own("went") > 0.5) & ~trusted)
        self.set_own("went", 0.0, ~trusted)

    def own(self, name: str) -> Value:
        """What each lane carries under a name of `STATE`."""
        return self._state[STATE.index(name)]

    def set_own(self, name: str, value: Value | float, where: Value | None = None) -> None:
        place = STATE.index(name)
        if where is not None:
            value = where.code.select(where, value, self._state[place])
        self._state[place] = value


def attempt(lanes: Lanes, active: Value) -> Value:
    """Write one step of all lanes; returns in which of them the member is done."""
    code, w = lanes.code, _Work(lanes)
    t, t1, h = grid_step(lanes)
    before, after = lanes.k, lanes.k.behind(lanes.n_row)
    _begin(lanes, active, t, w)
    solved = _compose(lanes, active, h, _STEP, w)
    end = reach(
        lanes, solved, t1, new=after, passing=code.flags(False), evaluate=code.equal(lanes.n, lanes.ny)
    )
    undetermined = active & (w.own("undetermined") > 0.5)
    framed = _write_frames(lanes, end.accepted, t, t1, h, w)
    end = replace(end, accepted=end.accepted & ~framed, unsolved=active & ~solved)
    followed = pass_grid(lanes, end.accepted, t1, lambda at: lanes.call("rhs", at, lanes.y_new, after))
    w.set_own("begun", 0.0, followed.passed)
    copy_rows(lanes, after, before, lanes.ny)
    leaving = undetermined | framed
    return commit(lanes, active, end, followed.t, h, active & ~end.accepted & ~leaving, leaving)


def _begin(lanes: Lanes, active: Value, t: Value, w: _Work) -> None:
    """Evaluate what a step needs of the positions that it starts from, in lanes that begin."""
    code = lanes.code
    needed = active & (w.own("begun") < 0.5)
    with code.when(code.any(needed)):
        zero = code.all_lanes(0.0)
        with code.each(w.n_carried) as i:
            w.carried[i] = code.select(needed, zero, w.carried[i])
        copy_rows(lanes, lanes.y.behind(lanes.nq), w.probe, w.nv, needed)
        _take_start(lanes, t, w)
        for target in (w.start, w.end):
            w.fresh.copy(lanes, target, needed)
        w.set_own("begun", 1.0, needed)
        w.set_own("h_guess", 0.0, needed)


def _take_start(lanes: Lanes, t: Value, w: _Work) -> None:
    """Write what the positions of `y` say to `fresh`, as `rattle.step.take_start`."""
    code = lanes.code
    lanes.call("mass_matrix", t, lanes.y, w.fresh.mass)
    with code.when(lanes.m > 0):
        lanes.call("constraint_jacobian", t, lanes.y, w.fresh.gradient)
    with code.when(code.equal(lanes.constant_mass, 0)):
        _slope(lanes, t, lanes.y, False, w, w.fresh.slope)


def _write_frames(lanes: Lanes, accepted: Value, t: Value, t1: Value, h: Value, w: _Work) -> Value:
    """Write frames by steps from the start of the step, as `rattle.loop.refine_frames`; returns where one failed.

    The next step is not to notice.
    """
    code = lanes.code
    made, failed = code.variable(0, INTEGER), code.variable(code.flags(False))
    h_guess = code.variable(w.own("h_guess"))

    def keep() -> None:
        made.value = code.integer(1)
        copy_rows(lanes, w.carried, w.kept, w.n_carried)
        w.start.copy(lanes, w.kept_start)
        _take_start(lanes, t, w)

    def go_back() -> None:
        copy_rows(lanes, w.kept, w.carried, w.n_carried)
        w.set_own("h_guess", h_guess.value)

    def evaluate(theta: Value, out: Rows) -> None:
        between = accepted & (theta > 0.0) & (theta < 1.0)
        for target in (w.start, w.end):
            w.fresh.copy(lanes, target)
        solved = _compose(lanes, between, code.select(between, theta * h, h), _FRAME, w)
        failed.value = failed.value | (between & ~solved)
        copy_rows(lanes, lanes.y, out, lanes.ny, ~between)
        go_back()

    write_frames(lanes, accepted, t, t1, keep, evaluate)
    with code.when(code.equal(made.value, 1)):
        w.kept_start.copy(lanes, w.start)
        w.kept_start.copy(lanes, w.end)
    return failed.value


# What a composition is for: its result goes to `y_new`, or to `y_stage`; derivatives to the row of `k` behind.
_STEP, _FRAME = 0, 1
_COMPOSE = "symgen_lanes_rattle"


def _compose(lanes: Lanes, where: Value, h: Value, purpose: int, w: _Work) -> Value:
    """Take the steps of a composition of length `h` from `lanes.y`; returns in which lanes of `where` that went."""
    code = lanes.code
    w.set_own("length", h)
    w.set_own("went", code.select(where, code.all_lanes(1.0), code.all_lanes(0.0)))
    w.set_own("undetermined", 0.0)
    function = _function_compose(code.lanes, with_quaternions=lanes.with_quaternions)
    code.declared |= {function.text(), *function.declared}
    code.call(_COMPOSE, code.integer(purpose))
    return w.own("went") > 0.5


def _function_compose(lanes_wide: int, *, with_quaternions: bool) -> Code:
    """Return `rattle(table, purpose)`, as `rattle.loop.compose`: a function, as it is long and called twice."""
    code = Code(_COMPOSE, lanes_wide, ("purpose",))
    lanes = Lanes(code, with_quaternions=with_quaternions)
    lanes.read(*ALL)
    w, n, purpose = _Work(lanes), lanes.n, code.argument("purpose")
    y = Rows(code, code.select(code.equal(purpose, _STEP), lanes.y_new.address, lanes.y_stage.address))
    row = lanes.k.behind(lanes.n_row * (purpose + 1))
    t, h = lanes.own("t"), w.own("length")
    copy_rows(lanes, lanes.y, y, lanes.ny)
    has_work = n < lanes.ny
    with code.when(has_work):
        row[n] = lanes.k[n]
    with code.each(lanes.n_parts) as s:
        part, until = h * lanes.parts[s * PART], h * lanes.parts[s * PART + PART + 1] + t
        _step(lanes, h * lanes.parts[s * PART + 1] + t, part, y, w)
        with code.when(has_work):
            power = code.variable(row[n])
            lanes.call("rhs", until, y, row)
            y[n] = code.fused(part * 0.5, power.value + row[n], y[n])
    return code


def _step(lanes: Lanes, t: Value, h: Value, y: Rows, w: _Work) -> None:
    """Advance (q, v) in `y` by `h`, in place, as `rattle.step.rattle_step`; `end` becomes `start`."""
    code, nq, nv = lanes.code, lanes.nq, w.nv
    known = code.compare("ne", w.own("h_guess"), 0.0)
    stretch = code.select(known, h / w.own("h_guess"), code.all_lanes(0.0))
    with code.each(nv) as i:
        w.mean[i] = code.fused(stretch, w.half_change[i], y[nq + i])
    with code.each(lanes.m) as k:
        w.impulses[k] = w.impulses[k] * stretch
    _solve_mean(lanes, t, h, y, w)
    _travel(lanes, h, y, w)
    with code.each(nq) as i:
        _add_compensated(w.travel[i], i, y, w.rest)
    each_quaternion(lanes, lambda i, j: _keep_length(i, y, w.rest))
    _find_end_rates(lanes, t + h, h, y, w)
    with code.each(nv) as i:
        w.half_change[i] = y[nq + i] - w.mean[i]
    copy_rows(lanes, w.end_impulses, w.impulses, lanes.m)
    w.end.copy(lanes, w.start)
    w.set_own("h_guess", h)


def _add_compensated(increment: Value, i: Value, y: Rows, rest: Rows) -> None:
    """As `loop.add_compensated`."""
    term, old = rest[i] + increment, y[i]
    total = old + term
    rest[i] = (old - total) + term
    y[i] = total


def _keep_length(i: Value, y: Rows, rest: Rows) -> None:
    """As `quaternions.keep_lengths`."""
    q = parts(y, i, 4)
    excess = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1.0
    for k in range(4):
        _add_compensated(q[k] * excess * -0.5, i + k, y, rest)


def _product(w: _Work, mass: Rows, i: Value, rates: Rows) -> Value:
    """Entry `i` of M times rates."""
    code = mass.code
    total = code.variable(0.0)
    with code.each(w.nv) as j:
        total.value = code.fused(mass[i * w.nv + j], rates[j], total.value)
    return total.value


def _momentum(w: _Work, mass: Rows, j: Value, rates: Rows) -> tuple[Value, ...]:
    """The three entries of M times rates from `j` on."""
    return tuple(_product(w, mass, j + k, rates) for k in range(3))


def _mean_momentum(w: _Work, j: Value) -> tuple[Value, ...]:
    """The three entries of (M0 + M1)/2 u from `j` on."""
    ends = zip(_momentum(w, w.start.mass, j, w.mean), _momentum(w, w.end.mass, j, w.mean), strict=True)
    return tuple((a + b) * 0.5 for a, b in ends)


def _slope(lanes: Lanes, t: Value, y: Rows, moving: bool, w: _Work, out: Rows) -> None:
    """As `rattle.step.slope`."""
    code, nq, n, nv = lanes.code, lanes.nq, lanes.n, w.nv
    copy_rows(lanes, y, w.arguments, nq)
    copy_rows(lanes, w.probe, w.arguments.behind(nq), nv)
    with code.each(nv) as i:
        w.arguments[n + i] = w.mean[i] if moving else 0.0
    with code.each(lanes.m) as k:
        w.arguments[n + nv + k] = 0.0
    lanes.call("jacobian", t, w.arguments, w.derivative)
    with code.each(nv) as i:
        row, target = w.derivative.behind(i * w.n_columns), out.behind(i * nv)

        def shift(k: Value, j: Value, row: Rows = row, target: Rows = target) -> None:
            target[j] = -row[k]

        def turn(k: Value, j: Value, row: Rows = row, target: Rows = target) -> None:
            put(target, j, tuple(-x for x in by_rotation(parts(y, k, 4), parts(row, k, 4))))

        each_position(lanes, shift, turn)


def _push(lanes: Lanes, ends: _Ends, t: Value, h: Value, y: Rows, w: _Work) -> None:
    """Write h/2 (L_q + Q) at positions and the mean rate to `push`, as `rattle.step.push`."""
    code, nv = lanes.code, w.nv
    copy_rows(lanes, y, w.trial, lanes.nq)
    copy_rows(lanes, w.mean, w.trial.behind(lanes.nq), nv)
    lanes.call("forces", t, w.trial, w.push)

    def add_rotation(_: Value, j: Value) -> None:
        more = cross(parts(w.mean, j), _momentum(w, ends.mass, j, w.mean))
        put(w.push, j, tuple(a + b for a, b in zip(parts(w.push, j), more, strict=True)))

    each_quaternion(lanes, add_rotation)
    half = h * 0.5
    with code.each(nv) as i:
        w.push[i] = w.push[i] * half
    with code.when(code.equal(lanes.constant_mass, 0)):
        _slope(lanes, t, y, True, w, w.turn)
        with code.each(nv) as i:
            total = code.variable(0.0)
            with code.each(nv) as j:
                place = i * nv + j
                w.turn[place] = w.turn[place] - ends.slope[place]
                total.value = code.fused(w.turn[place], w.mean[j], total.value)
            w.push[i] = w.push[i] - half * total.value


def _travel(lanes: Lanes, h: Value, y: Rows, w: _Work) -> None:
    """Write what the mean rate changes of positions to `travel`, as `rattle.step.travel`."""
    code = lanes.code

    def shift(i: Value, j: Value) -> None:
        w.travel[i] = h * w.mean[j]

    def turn(i: Value, j: Value) -> None:
        angle = tuple(h * rate for rate in parts(w.mean, j))
        half = code.root(angle[0] * angle[0] + angle[1] * angle[1] + angle[2] * angle[2]) * 0.5
        quarter = code.sincos(half * 0.5)[0]
        fall = quarter * quarter * -2.0
        sinc = code.select(half > 0.0, code.sincos(half)[0] / half, code.all_lanes(1.0)) * 0.5
        put(w.travel, i, multiplied(parts(y, i, 4), fall, tuple(sinc * x for x in angle)))

    each_position(lanes, shift, turn)


def _add_rotated(lanes: Lanes, h: Value, w: _Work) -> None:
    """Add what R(h u) makes of the mean momenta of all that turns to `right`."""

    def turn(_: Value, j: Value) -> None:
        before = _mean_momentum(w, j)
        after = chart_rate(tuple(h * rate for rate in parts(w.mean, j)), before)
        for k in range(3):
            w.right[j + k] = w.right[j + k] + (after[k] - before[k])

    each_quaternion(lanes, turn)


def _solve_mean(lanes: Lanes, t: Value, h: Value, y: Rows, w: _Work) -> None:
    """Solve for the mean rate and the impulses at the start, as `rattle.step.solve_mean`."""
    code, nv = lanes.code, w.nv
    with code.each(nv) as i:
        w.momentum[i] = _product(w, w.start.mass, i, y.behind(lanes.nq))
    going, converged = code.variable(w.own("went") > 0.5), code.variable(code.flags(False))
    smallest, stalls = code.variable(float("inf")), code.variable(0.0)
    turn = code.variable(0, INTEGER)
    with code.forever() as leave:
        leave(~code.any(going.value))
        turn.value = turn.value + 1
        _place_residual(lanes, t, h, y, w)
        with code.when(code.equal(turn.value, 1)):
            trusted = _factor_newton(lanes, t + h, h, w)
            w.trust(trusted)
            going.value = going.value & trusted
        dense_lu.solve(code, Real(w.matrix), w.pivots, w.n_rows, Real(w.right))
        here = going.value
        settled, goes_on = _judge(lanes, h, y, turn.value, smallest, stalls, w)
        with code.each(nv) as i:
            w.mean[i] = code.select(here, w.mean[i] - w.right[i], w.mean[i])
        with code.each(lanes.m) as k:
            w.impulses[k] = code.select(here, w.impulses[k] - w.right[nv + k], w.impulses[k])
        converged.value = converged.value | (here & settled)
        going.value = here & goes_on & code.all_flags(turn.value < MAX_ITERATIONS)
    w.set_own("went", 0.0, ~converged.value)


def _place_residual(lanes: Lanes, t: Value, h: Value, y: Rows, w: _Work) -> None:
    """Write the residual of the step to `right`, and q1 to `trial`, as `rattle.step.place_residual`."""
    code, nv, t1 = lanes.code, w.nv, t + h
    _push(lanes, w.start, t, h, y, w)
    _travel(lanes, h, y, w)
    with code.each(lanes.nq) as i:
        w.trial[i] = y[i] + (w.rest[i] + w.travel[i])
    with code.when(code.equal(lanes.constant_mass, 0)):
        lanes.call("mass_matrix", t1, w.trial, w.end.mass)
    with code.each(nv) as i:
        total = code.variable(-w.momentum[i] - w.push[i])
        with code.each(nv) as j:
            mass = (w.start.mass[i * nv + j] + w.end.mass[i * nv + j]) * 0.5
            total.value = code.fused(mass, w.mean[j], total.value)
        with code.each(lanes.m) as k:
            total.value = code.fused(-w.start.gradient[k * nv + i], w.impulses[k], total.value)
        w.right[i] = total.value
    _add_rotated(lanes, h, w)
    with code.when(lanes.m > 0):
        lanes.call("residual", t1, w.trial, w.residual)
        _add_rounded(lanes, y, w)
        with code.each(lanes.m) as k:
            w.right[nv + k] = w.residual[k] / h


def _add_rounded(lanes: Lanes, y: Rows, w: _Work) -> None:
    """Add to g(q1) what the part of q1 that rounding has dropped makes of it, as `rattle.step.add_rounded`."""
    code = lanes.code

    def dropped(i: Value) -> Value:
        return (y[i] - w.trial[i]) + (w.rest[i] + w.travel[i])

    def add(move: Value, j: Value) -> None:
        with code.each(lanes.m) as k:
            w.residual[k] = code.fused(w.end.gradient[k * w.nv + j], move, w.residual[k])

    def turn(i: Value, j: Value) -> None:
        moved = by_rotation(parts(w.trial, i, 4), tuple(dropped(i + k) for k in range(4)))
        for k, move in enumerate(moved):
            add(move * 4.0, j + k)

    each_position(lanes, lambda i, j: add(dropped(i), j), turn)


def _border(lanes: Lanes, above: Rows, below: Rows, w: _Work) -> None:
    """As `linear.border`."""
    code, nv, rows = lanes.code, w.nv, w.n_rows
    with code.each(lanes.m) as k:
        with code.each(nv) as i:
            w.matrix[i * rows + nv + k] = -above[k * nv + i]
            w.matrix[(nv + k) * rows + i] = below[k * nv + i]
        with code.each(lanes.m) as j:
            w.matrix[(nv + k) * rows + nv + j] = 0.0


def _factor(lanes: Lanes, w: _Work) -> Value:
    """Factor `matrix`; returns lanes whose factors can be trusted."""
    code, trusted = lanes.code, lanes.code.variable(TRUSTED_PIVOT_RATIO)
    with code.when(lanes.give > 0.0):
        let_constraints_give(lanes, Real(w.matrix), w.nv, w.n_rows)
        trusted.value = code.all_lanes(LEAST_RATIO_WITH_GIVE)
    sound = dense_lu.factor(code, Real(w.matrix), w.pivots, w.n_rows)
    return sound & (dense_lu.pivot_ratio(code, Real(w.matrix), w.n_rows) > trusted.value)


def _factor_newton(lanes: Lanes, t1: Value, h: Value, w: _Work) -> Value:
    """Factor the derivative of the residual, as `rattle.step.factor_newton`."""
    code, nv, rows = lanes.code, w.nv, w.n_rows
    half = h * 0.5
    with code.each(nv) as i:
        with code.each(nv) as j:
            place = i * nv + j
            w.matrix[i * rows + j] = (w.start.mass[place] + w.end.mass[place]) * 0.5
    with code.when(code.equal(lanes.constant_mass, 0)):
        with code.each(nv) as i:
            with code.each(nv) as j:
                bend = w.turn[i * nv + j] - w.turn[j * nv + i]
                w.matrix[i * rows + j] = code.fused(-half, bend, w.matrix[i * rows + j])
    with code.when(lanes.m > 0):
        lanes.call("constraint_jacobian", t1, w.trial, w.end.gradient)
    _border(lanes, w.start.gradient, w.end.gradient, w)
    each_quaternion(lanes, lambda i, j: _turn_matrix(lanes, j, half, w))
    return _factor(lanes, w)


def _turn_matrix(lanes: Lanes, j: Value, half: Value, w: _Work) -> None:
    """As `rattle.step.rotation_newton`, for the quaternion whose rates begin at `j`."""
    code, nv, rows = lanes.code, w.nv, w.n_rows
    turn = tuple(half * rate for rate in parts(w.mean, j))

    def add(i: Value, column: Value, value: Value) -> None:
        w.matrix[i * rows + column] = w.matrix[i * rows + column] + value

    with code.each(nv) as i:
        column = tuple(
            (w.start.mass[(j + k) * nv + i] + w.end.mass[(j + k) * nv + i]) * 0.5 for k in range(3)
        )
        for k, value in enumerate(cross(turn, column)):
            add(j + k, i, value)
    momentum = _mean_momentum(w, j)
    for axis in range(3):
        after, last = (axis + 1) % 3, (axis + 2) % 3
        add(j + axis, j + after, half * momentum[last])
        add(j + axis, j + last, -(half * momentum[after]))
    back = tuple(part * -2.0 for part in turn)
    with code.each(rows, nv) as r:
        row = w.matrix.behind(r * rows)
        put(row, j, chart_variation(back, parts(row, j)))


def _judge(
    lanes: Lanes, h: Value, y: Rows, iteration: Value, smallest: Variable, stalls: Variable, w: _Work
) -> tuple[Value, Value]:  # fmt: skip
    """Judge the correction `right`, as `rattle.step.judge_correction`; returns what converged, and what goes on."""
    code = lanes.code
    fastest, farthest = code.variable(0.0), code.variable(0.0)
    with code.each(w.nv) as i:
        fastest.value = code.larger(fastest.value, code.size(w.mean[i]))
    with code.each(lanes.nq) as i:
        farthest.value = code.larger(farthest.value, code.size(y[i]))
    size_of, largest, in_tolerances, finite = (code.variable(0.0) for _ in range(4))
    with code.each(w.nv) as i:
        change, rate = code.size(w.right[i]), code.size(w.mean[i])
        finite.value = finite.value + change * 0.0
        largest.value = code.larger(largest.value, change)
        beside = code.larger(code.larger(rate, fastest.value * 1e-3), change)
        size_of.value = code.larger(size_of.value, change / beside)  # 0/0 is not larger
        in_tolerances.value = code.larger(in_tolerances.value, change / lanes.scale(rate, rate))
    size, least = size_of.value, smallest.value
    sound = code.compare("eq", finite.value, 0.0)
    round_off = farthest.value * ROUND_OFF_OF_POSITIONS / code.size(h)
    is_noise = (size <= ROUND_OFF) | (largest.value <= round_off)
    settled = code.compare("eq", size, 0.0) | ((least <= size) & is_noise)
    settled = settled | (code.all_flags(iteration > 1) & (size * size <= least * NEGLIGIBLE))
    is_noise = is_noise | (in_tolerances.value <= NOISE_TOL)
    zero = code.all_lanes(0.0)
    stalls.value = code.select(
        settled, stalls.value, code.select(size < least * PROGRESS, zero, stalls.value + 1.0)
    )
    diverged = (size > least * DIVERGENCE) & ~is_noise & ~settled
    settled = settled | (~diverged & (stalls.value >= float(MAX_STALLS)) & is_noise)
    smallest.value = code.smaller(least, size)
    return settled & sound, sound & ~settled & ~diverged


def _find_end_rates(lanes: Lanes, t1: Value, h: Value, y: Rows, w: _Work) -> None:
    """Replace the rates in `y`, whose positions are those at `t1`, by the end's, as `rattle.step.end_rates`."""
    code, nq, nv, rows = lanes.code, lanes.nq, w.nv, w.n_rows
    with code.when(code.equal(lanes.constant_mass, 0)):
        lanes.call("mass_matrix", t1, y, w.end.mass)
        copy_rows(lanes, w.mean, w.probe, nv)
        _slope(lanes, t1, y, False, w, w.end.slope)
    _push(lanes, w.end, t1, h, y, w)
    with code.when(lanes.m > 0):
        lanes.call("constraint_jacobian", t1, y, w.end.gradient)
        lanes.call("residual", t1, w.trial, w.residual)
    # The unknown is v1 - u: what the constraints' residual at u says includes their rate in time.
    with code.each(nv) as i:
        total = code.variable(w.push[i])
        with code.each(nv) as j:
            mass, before = w.end.mass[i * nv + j], w.start.mass[i * nv + j]
            w.matrix[i * rows + j] = mass
            total.value = code.fused((before - mass) * 0.5, w.mean[j], total.value)
        w.right[i] = total.value
    _add_rotated(lanes, -h, w)
    with code.each(lanes.m) as k:
        w.right[nv + k] = -w.residual[lanes.nh + k]
    _border(lanes, w.end.gradient, w.end.gradient, w)
    with code.when(lanes.give > 0.0):
        copy_rows(lanes, w.right, w.unsolved, rows)
    w.trust(_factor(lanes, w))
    dense_lu.solve(code, Real(w.matrix), w.pivots, rows, Real(w.right))
    with code.when(lanes.give > 0.0):
        _refine_end_rates(lanes, w)
    with code.each(nv) as i:
        y[nq + i] = w.mean[i] + w.right[i]
    copy_rows(lanes, w.right.behind(nv), w.end_impulses, lanes.m)


def _refine_end_rates(lanes: Lanes, w: _Work) -> None:
    """Solve once more for what is left where constraints gave way: the rates are to be on them to round-off."""
    code, nv, m = lanes.code, w.nv, lanes.m
    found, left = w.right, w.unsolved
    with code.each(nv) as i:
        total = code.variable(left[i])
        with code.each(nv) as j:
            total.value = code.fused(-w.end.mass[i * nv + j], found[j], total.value)
        with code.each(m) as k:
            total.value = code.fused(w.end.gradient[k * nv + i], found[nv + k], total.value)
        left[i] = total.value
    with code.each(m) as k:
        total = code.variable(left[nv + k])
        with code.each(nv) as i:
            total.value = code.fused(-w.end.gradient[k * nv + i], found[i], total.value)
        left[nv + k] = total.value
    dense_lu.solve(code, Real(w.matrix), w.pivots, w.n_rows, Real(left))
    with code.each(w.n_rows) as i:
        found[i] = found[i] + left[i]
