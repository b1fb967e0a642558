"""What the loops of all methods do with lanes: members enter and leave, energies, projection, frames.

A lane takes steps of its own. As soon as its member is done, the next one of the queue takes its place; lanes without
a member go on with what they hold, which nobody reads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from symgen.runtime.ensemble.slots import AT, COLUMN, COLUMNS, LEFT, NUMBERS, TOO_MANY_STEPS
from symgen.runtime.ensemble.writer import ADDRESS, INTEGER, NUMBER, Code, Rows, Value
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.projection import (
    LARGEST_ERROR,
    LARGEST_IN_PASSING,
    LEAST_KINETIC,
    LEFT_IN_PASSING,
    MAX_GAUSS_STEPS,
)
from symgen.runtime.integrate.step_control import EPS

LOAD, STORE, BEGIN, RUN, MAP = (f"symgen_lanes_{word}" for word in ("load", "store", "begin", "run", "map"))
PIVOT_LIMIT = 1e-6  # below it the accelerations are in doubt: as in `constraints/guard_code.py`


@dataclass(eq=False)
class Lanes:
    """The lanes in a function that is being written: `lanes.y[i]`, `lanes.t_end`, `lanes.own("h")`.

    Attributes of the names in `slots` are read from the table once, where the function begins.
    """

    code: Code
    _known: dict[str, Value | Rows] = field(default_factory=dict)
    with_breaks: bool = True  # else there is one interval, and inputs are constant
    with_quaternions: bool = True  # else what `rotations` would write for them is left out

    def read(self, *names: str) -> None:
        """Read slots of the table, here."""
        for name in names:
            self._known[name] = self._read(name)

    def _read(self, name: str) -> Value | Rows:
        code = self.code
        if name in NUMBERS:
            return code.slot(AT[name], NUMBER)
        if name in _ROWS:
            return Rows(code, code.slot(AT[name], ADDRESS))
        if name in _PLAIN:
            return Rows(code, code.slot(AT[name], ADDRESS), NUMBER)
        if name in _INTEGERS:
            return Rows(code, code.slot(AT[name], ADDRESS), INTEGER)
        if name == "resets":
            return Rows(code, code.slot(AT[name], ADDRESS), ADDRESS)
        return code.slot(AT[name], ADDRESS if name in CODE else INTEGER)

    def __getattr__(self, name: str) -> Value | Rows:
        try:
            return self._known[name]
        except KeyError:
            raise AttributeError(name) from None

    def own(self, column: str) -> Value:
        """What each lane carries under a name of `slots.COLUMNS`."""
        return self.numbers[COLUMN[column]]

    def set_own(self, column: str, value: Value | float, where: Value | None = None) -> None:
        """Set it, in the lanes of `where`."""
        if where is not None:
            value = self.code.select(where, value, self.own(column))
        self.numbers[COLUMN[column]] = value

    def count(self, column: str, where: Value) -> None:
        """Count one more in the lanes of `where`."""
        one = self.code.select(where, self.code.all_lanes(1.0), self.code.all_lanes(0.0))
        self.set_own(column, self.own(column) + one)

    def scale(self, a: Value, b: Value) -> Value:
        """The tolerance of a component between two values, as `step_control.error_scale`."""
        code = self.code
        size = code.larger(code.size(a), code.size(b))
        return code.larger(self.atol + self.rtol * size, 4.0 * EPS * size + 1e-300)

    def longest_step(self, t: Value) -> Value:
        """As `step_control.longest_step`."""
        code = self.code
        return code.smaller(
            code.as_kind(self.h_base, "lanes") + self.h_share * (t - self.t_start),
            self.interval[INTERVAL_LONGEST],
        )

    def next_stop(self) -> Value:
        """Where the next step has to end at the latest."""
        return self.code.smaller(self.interval[INTERVAL_END], self.code.as_kind(self.t_end, "lanes"))

    def call(self, kernel: str, t: Value, y: Rows, out: Rows) -> None:
        """Call a function of the model for all lanes, with the inputs of the instant."""
        if self.with_breaks:
            self._set_inputs(t)
        self.code.call_kernel(getattr(self, kernel), t, y, self.p, out)

    def _set_inputs(self, t: Value) -> None:
        code = self.code
        with code.each(self.n_driven) as k:
            place, knot, n = (self.driven[k * DRIVEN + j] for j in range(3))
            since, piece = t - self.p[knot], self.p.behind(knot + 1)
            total = code.variable(piece[n - 1])
            with code.down(n - 2, 0) as j:
                total.value = code.fused(total.value, since, piece[j])
            self.p[place] = total.value


CODE = (
    "rhs", "project", "energy", "residual", "setup", "series", "events", "jacobian", "mass_matrix", "forces",
    "constraint_jacobian",
)  # fmt: skip
_ROWS = (
    "y", "y_new", "y_stage", "k", "p", "projected", "energies", "residuals", "dense", "numbers", "carry", "slope",
    "k_other", "lost", "watched", "y_before", "newton", "interval",
)  # fmt: skip
_PLAIN = (
    "start",
    "parameters",
    "precomputed",
    "derivative",
    "results",
    "end",
    "frames",
    "frame_times",
    "step_log",
    "event_log",
    "directions",
    "places",
    "intervals",
    "widths",
    "lowest",
    "parts",
)
_INTEGERS = (
    "quaternions", "member_of_lane", "frame_of_lane", "actions", "first_interval", "interval_of_lane", "driven",
    "first_frame",
)  # fmt: skip
# Rows of `interval`, see `breaks`, and of `intervals`, where the polynomials of inputs come behind them.
INTERVAL_END, INTERVAL_NEXT, INTERVAL_ANEW, INTERVAL_LONGEST = range(4)
N_INTERVAL = 4
DRIVEN = (
    4  # numbers of `driven` for an input: its place in `p`, those of its knot, coefficients, place in a row
)
ALL = tuple(name for name in AT if name not in ("next", "n_logged", "stop", "n_events_logged"))


def finite_rows(lanes: Lanes, rows: Rows, n: Value) -> Value:
    """Whether the first `n` rows are finite, for each lane."""
    code = lanes.code
    total = code.variable(0.0)
    with code.each(n) as i:
        total.value = total.value + rows[i] * 0.0
    return code.compare("eq", total.value, 0.0)


def copy_rows(lanes: Lanes, source: Rows, target: Rows, n: Value, where: Value | None = None) -> None:
    """Copy rows, in the lanes of `where`."""
    code = lanes.code
    with code.each(n) as i:
        target[i] = source[i] if where is None else code.select(where, source[i], target[i])


def project(lanes: Lanes, t: Value, y: Rows, wanted: Value, in_passing: Value) -> Value:
    """Project the states in the lanes of `wanted`, as `integrate/projection.py`; returns where that went well.

    Lanes that are not wanted are left as they are, but for rounding of quaternions' lengths.
    """
    code = lanes.code
    going, broken = code.variable(wanted), code.variable(code.flags(False))
    enough = code.root(code.as_kind(lanes.projection_tol, "lanes"))
    tries = code.variable(0, INTEGER)
    with code.forever() as leave:
        leave(~code.any(going.value))
        leave(tries.value >= MAX_GAUSS_STEPS)
        tries.value = tries.value + 1
        with code.each(lanes.n_quaternions) as k:
            first = lanes.quaternions[k]
            w, a, b, c = parts = [y[first + j] for j in range(4)]
            length = code.root(w * w + a * a + b * b + c * c)
            for j, part in enumerate(parts):
                y[first + j] = code.select(going.value, part / length, part)
        lanes.call("project", t, y, lanes.projected)
        sound = finite_rows(lanes, lanes.projected, lanes.n_project)
        residual, total = code.variable(0.0), code.variable(0.0)
        with code.each(lanes.n_project, lanes.n) as i:
            residual.value = code.larger(residual.value, code.size(lanes.projected[i]))
        with code.each(lanes.n) as i:
            ratio = (lanes.projected[i] - y[i]) / lanes.scale(y[i], lanes.projected[i])
            total.value = total.value + ratio * ratio
        small = total.value * lanes.rtol <= code.as_kind(code.to_number(lanes.n), "lanes") * LEFT_IN_PASSING
        near = residual.value <= code.as_kind(lanes.rtol, "lanes") * LARGEST_IN_PASSING
        converged = (residual.value <= enough) | (in_passing & near & small)
        moved = going.value & sound
        copy_rows(lanes, lanes.projected, y, lanes.n, moved)
        broken.value = broken.value | (going.value & ~sound)
        going.value = moved & ~converged
    return wanted & ~(going.value | broken.value)


def evaluate_energy(lanes: Lanes, t: Value, y: Rows) -> tuple[Value, Value, Value]:
    """Return T, V and the work done from outside."""
    code = lanes.code
    lanes.call("energy", t, y, lanes.energies)
    work = code.variable(0.0)
    with code.when(lanes.n < lanes.ny):
        work.value = y[lanes.n]
    return lanes.energies[0], lanes.energies[1], work.value


def keep_energy(lanes: Lanes, t: Value, y: Rows, where: Value) -> Value:
    """Scale rates to the energy of the start, as `projection.scale_energy`; returns what that takes away."""
    code = lanes.code
    taken = code.variable(0.0)
    with code.when(code.compare("ne", lanes.scale_energy, 0)):
        kinetic, potential, work = evaluate_energy(lanes, t, y)
        level = lanes.own("level") + work
        error = kinetic + potential - level
        usable = (kinetic > (code.size(level) + code.size(potential)) * LEAST_KINETIC) & (
            code.size(error) <= kinetic * LARGEST_ERROR
        )
        usable = usable & where
        factor = code.root((kinetic - error) / kinetic)
        with code.each(lanes.n, lanes.nq) as i:
            y[i] = code.select(usable, y[i] * factor, y[i])
        taken.value = code.select(usable, error, code.all_lanes(0.0))
    return taken.value


def note_energy(lanes: Lanes, t: Value, y: Rows, where: Value, taken: Value) -> None:
    """Take note of the energy balance at accepted states, and of what scaling took away."""
    code = lanes.code
    with code.when(code.compare("ne", lanes.watch_energy, 0)):
        kinetic, potential, work = evaluate_energy(lanes, t, y)
        off = code.size(kinetic + potential - work - lanes.own("level"))
        for column, value in (
            ("energy_off", off), ("kinetic", code.size(kinetic)), ("most_potential", potential),
            ("work", code.size(work)),
        ):  # fmt: skip
            lanes.set_own(column, code.larger(lanes.own(column), value), where)
        lanes.set_own("least_potential", code.smaller(lanes.own("least_potential"), potential), where)
        sum_taken = lanes.own("taken") + taken
        lanes.set_own("taken", sum_taken, where)
        lanes.set_own("most_taken", code.larger(lanes.own("most_taken"), code.size(sum_taken)), where)


def note_pivots(lanes: Lanes, row: Rows, where: Value) -> None:
    """Take note of the ratio of pivots that `rhs` has written behind its row."""
    code = lanes.code
    with code.when(lanes.m > 0):
        ratio = row[lanes.n_row - 1]
        lanes.set_own("pivot", code.smaller(lanes.own("pivot"), ratio), where)


def function_load(lanes_wide: int) -> Code:
    """Return `load(table, lane, member)`: a member takes a lane."""
    code = Code(LOAD, lanes_wide, ("lane", "member"))
    lanes = Lanes(code)
    lanes.read(*ALL)
    lane, member = code.argument("lane"), code.argument("member")

    def spread(source: Rows, target: Rows, n: Value | int) -> None:
        single, own = target.single(), source.behind(member * n)
        with code.each(n) as i:
            single[i * code.lanes + lane] = own[i]

    spread(lanes.start, lanes.y, lanes.ny)
    spread(lanes.precomputed, lanes.p, lanes.n_precomputed)
    spread(lanes.derivative, lanes.k, lanes.n_record)
    spread(lanes.results, lanes.numbers, len(COLUMNS))
    carry = lanes.carry.single()
    with code.each(lanes.ny) as i:
        carry[i * code.lanes + lane] = code.number(0.0)
    newton = lanes.newton.single()
    with code.each(lanes.n_kept) as i:
        newton[i * code.lanes + lane] = code.number(0.0)
    lanes.member_of_lane[lane] = member
    go_to_frame(lanes, lane, lanes.first_frame[member])
    # Of what can be held, the first blocks of `events.Watched`.
    spread(lanes.widths, lanes.watched, lanes.n_switches)
    spread(lanes.lowest, lanes.watched.behind(lanes.n_switches), lanes.n_switches)
    take_interval(lanes, lane, lanes.first_interval[member])
    return code


def take_interval(lanes: Lanes, lane: Value, number: Value) -> None:
    """Let a lane enter an interval of its member, see `breaks`."""
    code, row = lanes.code, lanes.intervals.behind(number * lanes.n_interval)
    interval, p = lanes.interval.single(), lanes.p.single()
    for k in range(N_INTERVAL):
        interval[lane + k * code.lanes] = row[k]
    with code.each(lanes.n_driven) as k:
        knot, n, first = (lanes.driven[k * DRIVEN + j] for j in range(1, DRIVEN))
        with code.each(n + 1) as j:
            p[(knot + j) * code.lanes + lane] = row[first + j]
    lanes.interval_of_lane[lane] = number


def function_store(lanes_wide: int) -> Code:
    """Return `store(table, lane)`: what a member has come to."""
    code = Code(STORE, lanes_wide, ("lane",))
    lanes = Lanes(code)
    lanes.read(*ALL)
    lane = code.argument("lane")
    member = lanes.member_of_lane[lane]

    def gather(source: Rows, target: Rows, n: Value | int) -> None:
        single, own = source.single(), target.behind(member * n)
        with code.each(n) as i:
            own[i] = single[i * code.lanes + lane]

    gather(lanes.y, lanes.end, lanes.ny)
    gather(lanes.numbers, lanes.results, len(COLUMNS))
    gather(lanes.watched.behind(lanes.n_switches), lanes.lowest, lanes.n_switches)
    return code


def function_begin(lanes_wide: int, begin: Callable[[Lanes], Value]) -> Code:
    """Return `begin(table)`: work out what members need to enter lanes, for all in the queue.

    `begin` writes what a method needs to know of the start to `k`, and returns the length of the first step.
    """
    code = Code(BEGIN, lanes_wide)
    lanes = Lanes(code)
    lanes.read(*ALL)
    block = code.variable(0, INTEGER)
    with code.forever() as leave:
        leave(block.value >= lanes.n_members)
        with code.each(code.lanes) as lane:
            _enter(lanes, block.value + lane, lane)
        with code.when(code.equal(lanes.resumes, 0)):
            start_members(lanes, begin)
        with code.when(code.compare("ne", lanes.resumes, 0)):
            _resume_members(lanes, begin)
        with code.each(code.lanes) as lane:
            _leave(lanes, block.value + lane, lane)
        block.value = block.value + code.lanes
    return code


def start_members(lanes: Lanes, begin: Callable[[Lanes], Value]) -> None:
    """Write what members carry from their start on, in lanes where their states and parameters are."""
    code = lanes.code
    t = code.as_kind(lanes.t_start, "lanes")
    for column in COLUMNS:
        lanes.set_own(column, 0.0)
    lanes.set_own("t", t)
    lanes.set_own("last_event", t)
    lanes.set_own("pivot", float("inf"))
    lanes.set_own("active", 1.0)
    with code.when(code.compare("ne", lanes.watch_energy, 0)):
        kinetic, potential, work = evaluate_energy(lanes, t, lanes.y)
        lanes.set_own("level", kinetic + potential - work)
        lanes.set_own("kinetic", code.size(kinetic))
        lanes.set_own("least_potential", potential)
        lanes.set_own("most_potential", potential)
    lanes.set_own("h", begin(lanes))


def _resume_members(lanes: Lanes, begin: Callable[[Lanes], Value]) -> None:
    """Write the same where members go on from what they carry; their steps begin anew."""
    code, t = lanes.code, lanes.own("t")
    first = lanes.own("begun") < 0.5
    with code.when(code.any(first)):
        kinetic, potential, work = evaluate_energy(lanes, t, lanes.y)
        for column, value in (
            ("level", kinetic + potential - work), ("kinetic", code.size(kinetic)), ("least_potential", potential),
            ("most_potential", potential), ("last_event", t),
        ):  # fmt: skip
            lanes.set_own(column, value, first)
    for column in _BEGIN_ANEW:
        lanes.set_own(column, 0.0)
    lanes.set_own("begun", 1.0)
    lanes.set_own("active", 1.0)
    lanes.set_own("h", begin(lanes))


# Of the columns: what a lane knows of its steps and of its events, as far as these are other ones behind a switch.
_BEGIN_ANEW = (
    "status", "last_rejected", "round_off", "shorter", "varied", "reach", "far", "before",
    "armed", "next_event", "leaves",
)  # fmt: skip


def _enter(lanes: Lanes, number: Value, lane: Value) -> None:
    code = lanes.code
    member = code.select(number < lanes.n_members, number, lanes.n_members - 1)
    longer = precompute(lanes, member)
    start = lanes.start.behind(member * lanes.ny)
    y, p = lanes.y.single(), lanes.p.single()
    with code.each(lanes.ny) as i:
        y[i * code.lanes + lane] = start[i]
    with code.each(lanes.n_precomputed) as i:
        p[i * code.lanes + lane] = longer[i]
    take_interval(lanes, lane, lanes.first_interval[member])
    with code.when(code.compare("ne", lanes.resumes, 0)):
        numbers, carried = lanes.numbers.single(), lanes.results.behind(member * len(COLUMNS))
        with code.each(len(COLUMNS)) as i:
            numbers[i * code.lanes + lane] = carried[i]


def precompute(lanes: Lanes, member: Value) -> Rows:
    """Work out what depends on a member's parameters alone; returns its row."""
    code = lanes.code
    given, longer = (
        lanes.parameters.behind(member * lanes.n_p),
        lanes.precomputed.behind(member * lanes.n_precomputed),
    )
    with code.each(lanes.n_p) as i:
        longer[i] = given[i]
    with code.when(lanes.n_p < lanes.n_precomputed):
        code.call_plain(lanes.setup, code.number(0.0), longer, longer, longer.behind(lanes.n_p))
    return longer


def _leave(lanes: Lanes, number: Value, lane: Value) -> None:
    code = lanes.code
    with code.when(number < lanes.n_members):
        row = lanes.derivative.behind(number * lanes.n_record)
        k, numbers = lanes.k.single(), lanes.numbers.single()
        with code.each(lanes.n_record) as i:
            row[i] = k[i * code.lanes + lane]
        columns = lanes.results.behind(number * len(COLUMNS))
        with code.each(len(COLUMNS)) as i:
            columns[i] = numbers[i * code.lanes + lane]


def evaluate_start(lanes: Lanes) -> None:
    """Work out the derivatives at the start, into the first row of `k`."""
    lanes.call("rhs", lanes.own("t"), lanes.y, lanes.k)
    note_pivots(lanes, lanes.k, lanes.code.flags(True))


def refill(lanes: Lanes, done: Value) -> None:
    """Write what members in the lanes of `done` have come to, and let the next ones of the queue in."""
    code = lanes.code
    with code.when(code.any(done)):
        note_residuals(lanes, done)
        mask = code.mask(done)
        with code.each(code.lanes) as lane:
            with code.when(code.bit(mask, lane)):
                code.call(STORE, lane)
                enter(lanes, lane)


def note_residuals(lanes: Lanes, done: Value) -> None:
    """Take note of what is left of the constraints, in the lanes of `done`."""
    code = lanes.code
    with code.when(lanes.m > 0):
        lanes.call("residual", lanes.own("t"), lanes.y, lanes.residuals)
        for column, first, end in (
            ("position_residual", code.integer(0), lanes.nh),
            ("velocity_residual", lanes.nh, lanes.nh + lanes.m),
        ):
            worst = code.variable(0.0)
            with code.each(end, first) as i:
                worst.value = code.larger(worst.value, code.size(lanes.residuals[i]))
            lanes.set_own(column, worst.value, done)


def enter(lanes: Lanes, lane: Value) -> None:
    """Let the next member of the queue into a lane; without one the lane is idle."""
    code = lanes.code
    following = code.slot(AT["next"], INTEGER)
    is_there = following < lanes.n_members
    with code.when(is_there):
        code.call(LOAD, lane, following)
        code.set_slot(AT["next"], following + 1)
    with code.when(~is_there):
        lanes.numbers.single()[lane + COLUMN["active"] * code.lanes] = code.number(0.0)


def function_run(lanes_wide: int, attempt: Callable[[Lanes, Value], Value]) -> Code:
    """Return `run(table)`: take steps until the queue is empty.

    `attempt(lanes, active)` writes one step of all lanes, and returns in which the member is done; these have their
    status.
    """
    code = Code(RUN, lanes_wide)
    lanes = Lanes(code)
    lanes.read(*ALL)
    with code.each(code.lanes) as lane:
        # What is idle from the beginning holds a member's numbers, too.
        code.call(LOAD, lane, code.integer(0))
    with code.each(code.lanes) as lane:
        enter(lanes, lane)
    with code.forever() as leave:
        active = lanes.own("active") > 0.5
        leave(~code.any(active))
        leave(code.compare("ne", code.slot(AT["stop"], INTEGER), 0))  # Python has changed its mind
        refill(lanes, attempt(lanes, active))
    return code


def log_step(lanes: Lanes, accepted: Value, t1: Value, h: Value) -> None:
    """Log the step of a lane that runs alone."""
    code = lanes.code
    logged = code.slot(AT["n_logged"], INTEGER)
    with code.when((logged < lanes.log_size) & code.any(accepted)):
        for k, value in enumerate((t1, h)):
            lanes.step_log[logged * 2 + k] = code.of_lane(value, 0)
        code.set_slot(AT["n_logged"], logged + 1)


@dataclass(eq=False)
class Reached:
    """How the end of a step was reached, in the lanes that tried to.

    Attributes
    ----------
    accepted, lost, infinite : Value
        Lanes in which it was; which are away from the constraints; which have numbers that are not finite.
    taken : Value
        What energy scaling took away.
    unsolved : Value, optional
        Lanes in which Newton's method has failed.
    """

    accepted: Value
    lost: Value
    infinite: Value
    taken: Value
    unsolved: Value | None = None


def reach(
    lanes: Lanes, tried: Value, t1: Value, new: Rows, passing: Value, evaluate: Value | None = None
) -> Reached:
    """Project new states, in `y_new`, and work out their derivatives into the row `new`, as `explicit.loop.reach_end`.

    What is not on the constraints, or infinite, is taken for the end of a step that was much too long. Where the flag
    `evaluate` is not set, the row is there already.
    """
    code = lanes.code
    on_constraints, taken = code.variable(tried), code.variable(0.0)
    with code.when(lanes.n_project > 0):
        on_constraints.value = project(lanes, t1, lanes.y_new, tried, passing)
        taken.value = keep_energy(lanes, t1, lanes.y_new, on_constraints.value)
    with code.when(code.flag(True) if evaluate is None else evaluate):
        lanes.call("rhs", t1, lanes.y_new, new)
    sound = finite_rows(lanes, lanes.y_new, lanes.ny) & finite_rows(lanes, new, lanes.ny)
    accepted = on_constraints.value & sound
    note_pivots(lanes, new, accepted)
    return Reached(accepted, tried & ~on_constraints.value, on_constraints.value & ~sound, taken.value)


def commit(
    lanes: Lanes, active: Value, end: Reached, t1: Value, h: Value, give_up: Value, leaving: Value | None = None,
    ended: Value | None = None,
) -> Value:  # fmt: skip
    """Make accepted states the current ones, and count; returns in which lanes the member is done.

    Those are at the end of the run, out of steps, at a singular configuration, among `give_up`, `leaving` for runs of
    their own, or `ended` by an event, and have a status.
    """
    code = lanes.code
    lanes.set_own("t", t1, end.accepted)
    copy_rows(lanes, lanes.y_new, lanes.y, lanes.ny, end.accepted)
    note_energy(lanes, t1, lanes.y, end.accepted, end.taken)
    log_step(lanes, end.accepted, t1, h)
    lanes.count("steps", end.accepted)
    lanes.count("rejected", active & ~end.accepted)
    arrived = end.accepted & (t1 >= lanes.t_end)
    if ended is not None:
        arrived = arrived | (end.accepted & ended)
    steps = lanes.own("steps") + lanes.own("rejected")
    spent = active & (steps >= code.as_kind(code.to_number(lanes.max_steps), "lanes"))
    singular = active & (lanes.own("pivot") < PIVOT_LIMIT)
    for where, status in (
        (spent, TOO_MANY_STEPS),
        (give_up, at.STEP_TOO_SMALL),
        (give_up & end.lost, at.PROJECTION_FAILED),
        *(() if end.unsolved is None else ((give_up & end.unsolved, at.NEWTON_FAILED),)),
        (give_up & end.infinite, at.NOT_FINITE),
        (singular, at.SINGULAR_MATRIX),
        (arrived & ~singular, at.REACHED_STOP),
    ):
        lanes.set_own("status", float(status), where)
    done = arrived | give_up | spent | singular
    if leaving is None:
        return done
    lanes.set_own("status", float(LEFT), leaving)
    return done | leaving


def write_frames(
    lanes: Lanes, accepted: Value, t0: Value, t1: Value, make_dense: Callable[[], None],
    evaluate: Callable[[Value, Rows], None], whole: Value | None = None,
) -> None:  # fmt: skip
    """Write the frames that accepted steps have passed, by dense output on the constraints.

    Parameters
    ----------
    make_dense : callable
        Writes what works out the dense output of the step, for all lanes.
    evaluate : callable
        `evaluate(theta, rows)` writes the states at places of the step to `rows`.
    whole : Value, optional
        The length of the step that these describe, where `t1` is before its end.
    """
    code = lanes.code
    with code.when(lanes.n_frames > 0):
        made = code.variable(0, INTEGER)
        with code.forever() as leave:
            times = lanes.own("next_frame")
            due = accepted & (times <= t1)
            leave(~code.any(due))
            with code.when(code.equal(made.value, 0)):
                make_dense()
                made.value = code.integer(1)
            evaluate((times - t0) / (t1 - t0 if whole is None else whole), lanes.y_stage)
            at_end = code.compare("eq", times, t1)
            copy_rows(lanes, lanes.y_new, lanes.y_stage, lanes.ny, at_end)
            with code.when(lanes.n_project > 0):
                project(lanes, times, lanes.y_stage, due, code.flags(False))
            mask = code.mask(due)
            with code.each(code.lanes) as lane:
                with code.when(code.bit(mask, lane)):
                    _write_frame(lanes, lane)


def go_to_frame(lanes: Lanes, lane: Value, number: Value) -> None:
    """Let a frame be the next one of a lane."""
    code, numbers = lanes.code, lanes.numbers.single()
    place = lane + COLUMN["next_frame"] * code.lanes
    lanes.frame_of_lane[lane] = number
    numbers[place] = code.number(float("inf"))
    with code.when(number < lanes.n_frames):
        numbers[place] = lanes.frame_times[number]


def _write_frame(lanes: Lanes, lane: Value) -> None:
    code = lanes.code
    number = lanes.frame_of_lane[lane]
    row = (lanes.member_of_lane[lane] * lanes.n_frames + number) * lanes.ny
    frame, state = lanes.frames.behind(row), lanes.y_stage.single()
    with code.each(lanes.ny) as i:
        frame[i] = state[i * code.lanes + lane]
    go_to_frame(lanes, lane, number + 1)


def function_map(lanes_wide: int) -> Code:
    """Return `map(table)`: evaluate the function in the slot of `rhs`, which writes `n_row` values, at many states.

    State k has parameters k // `n_frames`; it is read from `start`, and what is written goes to `end`.
    """
    code = Code(MAP, lanes_wide)
    lanes = Lanes(code)
    lanes.read(*ALL)
    block = code.variable(0, INTEGER)
    with code.each(lanes.n_row) as i:  # structural zeros are not written
        lanes.k[i] = 0.0
    with code.each(code.lanes) as lane:
        lanes.member_of_lane[lane] = code.integer(-1)
    held = code.variable(-1, INTEGER)  # the member whose parameters all lanes have
    with code.forever() as leave:
        first = block.value
        leave(first >= lanes.n_members)
        last = code.smaller(first + code.lanes, lanes.n_members) - 1
        member, last_member = (code.quotient(state, lanes.n_frames) for state in (first, last))
        with code.when(code.compare("ne", member, held.value) | code.compare("ne", member, last_member)):
            _take_parameters(lanes, first)
            held.value = code.select(code.equal(member, last_member), member, code.integer(-1))
        states = [code.smaller(first + lane, last) for lane in range(code.lanes)]
        sources = [lanes.start.behind(state * lanes.ny) for state in states]
        with code.each(lanes.ny) as i:
            lanes.y[i] = code.lanes_of([source[i] for source in sources])
        code.call_kernel(lanes.rhs, _times(lanes, states), lanes.y, lanes.p, lanes.k)
        targets = [lanes.end.behind(state * lanes.n_row) for state in states]
        with code.each(lanes.n_row) as i:
            # Lanes without a state have the last one, and write what it has written.
            for lane, target in enumerate(targets):
                target[i] = code.of_lane(lanes.k[i], lane)
        block.value = first + code.lanes
    return code


def _take_parameters(lanes: Lanes, first: Value) -> None:
    """Let lanes have the parameters of the members that the states from `first` on belong to."""
    code = lanes.code
    with code.each(code.lanes) as lane:
        state = code.smaller(first + lane, lanes.n_members - 1)
        member = code.quotient(state, lanes.n_frames)
        with code.when(code.equal(state, member * lanes.n_frames)):
            precompute(lanes, member)
        with code.when(code.compare("ne", lanes.member_of_lane[lane], member)):
            p, longer = lanes.p.single(), lanes.precomputed.behind(member * lanes.n_precomputed)
            with code.each(lanes.n_precomputed) as i:
                p[i * code.lanes + lane] = longer[i]
            lanes.member_of_lane[lane] = member


def _times(lanes: Lanes, states: list[Value]) -> Value:
    """The times of states: members have their own ones, or all the same."""
    code, frames = lanes.code, []
    for lane, state in enumerate(states):
        frame = state - lanes.member_of_lane[lane] * lanes.n_frames
        frames.append(lanes.frame_times[code.select(code.equal(lanes.own_times, 0), frame, state)])
    return code.lanes_of(frames)
