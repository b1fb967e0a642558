"""Common steps: whether subsystems by themselves pay, and equal ones side by side, a few at a time, in one loop."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.choose import EXPLICIT, SERIES
from symgen.runtime.graph.form import Form, Loop, Name, Place, Write, copied
from symgen.runtime.graph.layouts import ENERGY, POWER, RATIO, Lengths
from symgen.runtime.module_check import verified
from symgen.runtime.subsystems.decomposition import CUT, Places, is_total, total_name
from symgen.runtime.subsystems.subsystem import Subsystem
from symgen.runtime.system import System

if TYPE_CHECKING:
    from symgen.runtime.subsystems.subsystem import Settings

# Of what a step costs besides, half a microsecond: some ten evaluations of a nanosecond per operation, and the sums
# over stages that its results enter.
_PER_OPERATION = 0.025
STEPS_PER_RADIAN = 1.5
_PER_RUN = 300.0  # what it costs to prepare a run, in steps of a small model
_PERIODS, _VISIBLE = 10.0, 1e-4  # of the slowest motion; of the fastest rate
_PER_MEMBER = ("coordinates", "rates", "parameters", "inputs")
_MEMBERS = 8  # doubles of the widest vectors in use; the same on all machines, and so are results
# Steps of all members together that are worth a kernel of their own, for a member of no operations and for each of its
# operations: a series of eight takes 0.3 s and 6 ms per operation to compile, once, and spares each step 0.4 µs.
_WORTH = {SERIES: (300_000, 6_000), EXPLICIT: (30_000, 600)}
_LARGEST = 200  # operations of a member's rhs: larger ones fill vectors by themselves
_MOST_SPREAD = 1.2  # of a group's rates, so that the slowest takes little more steps than by itself


def usual_time(found: Sequence[Subsystem]) -> float:
    """Return the time [s] for which costs are compared: some periods of the slowest that moves, however long a run is.

    What is integrated with what decides about the last digits, and these must not depend on where a run ends.
    """
    rates = [s.choice.rate for s in found if not s.is_asleep]
    fastest = max(rates, default=0.0)
    slowest = min((rate for rate in rates if rate > _VISIBLE * fastest), default=0.0)
    return 2.0 * math.pi * _PERIODS / slowest if slowest > 0.0 else 0.0


def pays(found: Sequence[Subsystem]) -> bool:
    """Return whether runs by themselves are estimated to cost less than one run of all.

    The step of one run of all suits the fastest; what a step costs besides evaluations is paid once for all. Where
    some are stiff and others not, no common method suits them. What rests takes no steps by itself.
    """
    if len({subsystem.choice.method.stiff for subsystem in found}) > 1:
        return True
    span = usual_time(found)
    steps = [0.0 if s.is_asleep else STEPS_PER_RADIAN * s.choice.rate * span for s in found]
    work = [_PER_OPERATION * subsystem.system.operations.get("rhs", 0) for subsystem in found]
    of_all = sum(w * len(subsystem.columns) for w, subsystem in zip(work, found, strict=True))
    apart = sum(_PER_RUN + n * (1.0 + w) for n, w in zip(steps, work, strict=True))
    return apart < _PER_RUN + max(steps) * (1.0 + of_all)


def can_stand_side_by_side(member: System) -> bool:
    """Whether each statement of a model's functions makes a number: no constraints, events, loops, solves by loops."""
    plain = not (member.m or member.events or member.switches)
    forms = (member.form(name) for name in _functions(member) if plain)
    return plain and all(type(x) is Name or type(x) is Write for form in forms for x in form.body)


def side_by_side(member: System, count: int) -> System:
    """Return the model of several members whose state is all their coordinates, member by member, then all rates.

    Parameters
    ----------
    member : System
        For which `can_stand_side_by_side` is true.
    count : int
        Two or more; `p` is all their parameters, member by member, then all inputs.
    """
    known = member.__dict__.setdefault("_side_by_side", {})
    if count not in known:
        known[count] = _joined(member, count)
    return known[count]


def _joined(member: System, count: int) -> System:
    source, head = member.source, member.source.header
    kind = {
        "coordinates": np.arange(count * member.nq).reshape(count, -1),
        "rates": np.arange(count * member.nv).reshape(count, -1),
        "constraints": np.zeros((count, 0), dtype=int),
    }
    sizes = {"nq": count * member.nq, "nv": count * member.nv, "nh": 0, "nn": 0, "nw": member.nw}
    places = Places(kind, sizes)
    functions = {name: _function(name, member, places, count) for name in _functions(member)}
    header = {
        **head,
        **sizes,
        **{key: [_named(record, k) for k in range(count) for record in head[key]] for key in _PER_MEMBER},
        "quaternions": [k * member.nq + place for k in range(count) for place in member.quaternions],
        **(
            {"states": [k * member.nv + i for k in range(count) for i in member.states]}
            if member.states
            else {}
        ),
        "operations": {name: count * head["operations"].get(name, 0) for name in functions},
        "hoisted": {name: count * n for name, n in head.get("hoisted", {}).items() if name in functions},
    }
    return System(verified(source.made(header, functions)))


def _functions(member: System) -> list[str]:
    return [name for name in CUT if name in member.source.functions and member.has(name)]


def _named(record: dict[str, Any], k: int) -> dict[str, Any]:
    return {**record, "name": f"{record['name']}.{k + 1}"}


def _function(name: str, member: System, places: Places, count: int) -> Form:
    """One function: sums of all members begin before the loop and are written behind it."""
    read = places.read(name)
    written = places.written(name, {POWER: member.nw, RATIO: 0, ENERGY: 1})
    n_parameters, n_inputs = len(member.parameters), len(member.inputs)

    def parameter(k: int) -> np.ndarray:
        first, stride = (k, n_parameters) if k < n_parameters else (k - n_parameters, n_inputs)
        return first + (n_parameters * count if k >= n_parameters else 0) + stride * np.arange(count)

    source = member.form(name)
    form = Form(name, Lengths(read.size, count * source.lengths.p, int(written.max(initial=-1)) + 1))
    body = copied(
        source,
        source.body,
        form,
        y=lambda place: _along(read[:, place.first]),
        p=lambda place: _along(parameter(place.first)),
        out=lambda place: _along(written[:, place.first]),
    )
    totals = [x for x in body if is_total(form, x)]
    names = {total_name(form, x) for x in totals}
    starts = [x for x in body if type(x) is Name and x.name in names and form.nodes.op[x.node] == "const"]
    inside = tuple(x for x in body if x not in totals and x not in starts)
    form.body = [*starts, *([Loop(count, inside, inside[0].line)] if inside else []), *totals]
    return form


def _along(places: np.ndarray) -> Place:
    """The index of a loop that runs through places at equal distances."""
    return Place(int(places[0]), int(places[1] - places[0]))


class Group(Subsystem):
    """Equal subsystems with common steps, each as accurate as by itself.

    Parameters
    ----------
    members : sequence of Subsystem
        Of one system and one method, each without twins.
    """

    def __init__(self, members: Sequence[Subsystem]):
        first, n = members[0], len(members)
        n_own = len(first.system.parameters)
        fastest = max(members, key=lambda member: member.choice.rate)
        super().__init__(
            side_by_side(first.system, n),
            np.concatenate([*(m.p[:n_own] for m in members), *(m.p[n_own:] for m in members)]),
            first.t_start,
            _by_vectors(first, [m.state for m in members]),
            replace(first.choice, rate=fastest.choice.rate),
            is_asleep=False,
        )
        self.members = members
        self.titles = [title for member in members for title in member.titles]
        self.columns = [_by_vectors(first, [m.columns[0] for m in members])]
        # The error of a step is measured by the root of the mean of squares: n times tighter squares hold for each.
        # Series are measured by their largest term.
        self.tolerance = 1.0 if self.choice.method.name == SERIES else _of_each(n)

    def prepare(
        self, times: np.ndarray, shown: np.ndarray, stops: Sequence[float], settings: Settings
    ) -> None:
        """Make a run from the start, as `Subsystem.prepare` does."""
        super().prepare(times, shown, stops, settings)
        self.run.tolerance_after = _of_each(len(self.members)) / self.tolerance

    def balances(self) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
        """Yield what `Subsystem.balances` says of each member; the work of forces is known of all together only."""
        if self.system.nw:
            yield from super().balances()
            return
        run, n = self.run, self.run.n_frames
        times, rows, places = run.arrays.frame_times[:n], run.arrays.frames[:n], self._places()
        for member, columns in zip(self.members, places, strict=True):
            yield (
                member.titles[0],
                evaluate(member.system, "energy", member.p, times, np.ascontiguousarray(rows[:, columns])),
                np.zeros(n),
            )

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{len(self.members)} subsystems side by side, the first of them the {self.titles[0]}"

    def _places(self) -> np.ndarray:
        """Where each member's state is in that of the group, shape (members, nq + nv)."""
        nq, nv, n = self.members[0].system.nq, self.members[0].system.nv, len(self.members)
        q, v = np.arange(n * nq).reshape(n, nq), n * nq + np.arange(n * nv).reshape(n, nv)
        return np.hstack([q, v])


def _of_each(n: int) -> float:
    """The tolerance for the root of the mean of squares over n members that holds for each, in parts of its own."""
    return 1.0 / math.sqrt(n)


def _by_vectors(first: Subsystem, rows: Sequence[np.ndarray]) -> np.ndarray:
    """Rows over (q, v) as one over all q, then all v."""
    nq, table = first.system.nq, np.array(rows)
    return np.concatenate([table[:, :nq].ravel(), table[:, nq:].ravel()])


def grouped(found: Sequence[Subsystem]) -> list[Subsystem]:
    """Join subsystems of one kind whose steps are of like length into groups; the others stay as they are.

    Returns
    -------
    list of Subsystem
        In the order of their first members.
    """
    kinds: dict[tuple[int, str], list[Subsystem]] = {}
    for subsystem in found:
        if _has_no_twins_and_moves(subsystem):
            key = id(subsystem.system), subsystem.choice.method.name
            kinds.setdefault(key, []).append(subsystem)
    group_of: dict[int, Group] = {}
    span = usual_time(found)
    for members in kinds.values():
        if not can_stand_side_by_side(members[0].system):
            continue
        chunks = list(_chunks(members))
        for chunk in chunks if _are_worth_it(chunks, span) else ():
            group_of |= dict.fromkeys(map(id, chunk), Group(chunk))
    return list(dict.fromkeys(group_of.get(id(subsystem), subsystem) for subsystem in found))


def _has_no_twins_and_moves(subsystem: Subsystem) -> bool:
    choice = subsystem.choice
    return (
        choice.method.name in (SERIES, EXPLICIT)
        and len(subsystem.columns) == 1
        and subsystem.system.operations.get("rhs", 0) <= _LARGEST
        and not subsystem.is_asleep
    )


def _are_worth_it(chunks: Sequence[Sequence[Subsystem]], span: float) -> bool:
    """Whether groups take so many steps that they are estimated to spare the time to compile their kernel."""
    if not chunks:
        return False
    first = chunks[0][0]
    least, per_operation = _WORTH[first.choice.method.name]
    rates = sum(member.choice.rate for chunk in chunks for member in chunk)
    return STEPS_PER_RADIAN * rates * span >= least + per_operation * first.system.operations.get("rhs", 0)


def _chunks(members: Sequence[Subsystem]) -> Iterator[list[Subsystem]]:
    """Members of like rates, as many as make a group."""
    members = sorted(members, key=lambda member: member.choice.rate)
    start = 0
    while start + _MEMBERS <= len(members):
        chunk = members[start : start + _MEMBERS]
        if chunk[-1].choice.rate <= _MOST_SPREAD * chunk[0].choice.rate:
            yield chunk
            start += _MEMBERS
        else:
            start += 1
