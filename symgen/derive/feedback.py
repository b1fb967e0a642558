"""Forces and derivatives of states that follow reactions and accelerations: the equations determine both together.

What sensors tell is a variable s on the graph, on which forces f(q, v, s) depend. The equations, solved for given s,
give accelerations and multipliers that are affine in f, and sensors measure these: s = r(q, v, s). Where no s depends
on itself that way, each follows from those before it, as in all that derivatives of states follow: nothing follows
these. What does is a loop, as of a force in proportion to the acceleration of the mass that it pushes. One that is
linear, s = r0 + D s, has the solution (1 - D)⁻¹ r0 wherever the pivots of 1 - D stay positive: at zero, force and
reaction raise each other without bound, and beyond, any delay between the two is unstable. Loops that are not linear
are refused: a state that follows the reaction with a time constant opens them.

With s as a function of (q, v), forces and derivatives of states are such functions again, and nothing that comes after
needs to know.
"""

from __future__ import annotations

from dataclasses import replace

from ..errors import ModelError
from ..model import algebra
from ..model.description import Description, Event, Sensor
from ..model.sensors import acting
from .contacts import eliminate
from .graph.differentiate import forward
from .graph.graph import Graph
from .graph.nodes import SENSED
from .sensed import Equations, Sensed, Settled


def settle(d: Equations, sensed: Sensed) -> Settled:
    """Solve for what forces follow, once the equations are solved for given values of it.

    Raises
    ------
    ModelError
        Forces and reactions determine each other in a way that has no solution here.
    """
    g, by_state = d.g, sensed.solution()
    follow = acting(d.description)
    sensors = {d.loader.symbols[name]: d.description.sensors[k] for name, k in follow.items()}
    _refuse_what_is_not_unique(d, list(sensors.values()))
    _refuse_contacts(d, sensors)
    loops = _Loops(g, sensors)
    values = loops.solve(dict(zip(sensed.followed, g.substitute(list(sensed.followed.values()), by_state))))
    if loops.margins and d.own.stops + d.own.frictions:
        raise _refusal(
            loops.margins[0][0], "the force that follows it", "the model has stops or dry friction"
        )
    measured = g.substitute(list(sensed.followed.values()), values)
    return Settled(values, dict(zip(sensed.followed, measured, strict=True)), loops.margins)


class _Loops:
    """Solves s = r(s), loop by loop."""

    def __init__(self, g: Graph, sensors: dict[int, Sensor]) -> None:
        self.g, self.sensors = g, sensors
        self.margins: list[tuple[Sensor, int]] = []

    def solve(self, right: dict[int, int]) -> dict[int, int]:
        """Each variable as a function of what is no such variable; `right` has what each of them is equal to."""
        g, found = self.g, dict[int, int]()
        needs = {s: set(g.reachable([node], SENSED)) & right.keys() for s, node in right.items()}
        reach = {s: _all_below(s, needs) for s in right}
        while len(found) < len(right):
            waiting = [s for s in right if s not in found]
            first = min(waiting, key=lambda s: len(reach[s] - found.keys()))
            group = [s for s in waiting if s in reach[first]] or [first]
            nodes = g.substitute([right[s] for s in group], found)
            found |= self._loop(group, nodes) if first in reach[first] else {first: nodes[0]}
        return found

    def _loop(self, group: list[int], nodes: list[int]) -> dict[int, int]:
        """The solution of a linear loop."""
        g = self.g
        columns = [forward(g, nodes, {s: g.one}) for s in group]
        for s, column in zip(group, columns, strict=True):
            if any(g.mask[node] & SENSED for node in column):
                raise _refusal(self.sensors[s], "the force that follows it", "that is not linear")
        rest = g.substitute(nodes, dict.fromkeys(group, g.zero))
        rows = [
            [g.sub(g.one if i == j else g.zero, columns[j][i]) for j in range(len(group))]
            for i in range(len(group))
        ]
        pivots = eliminate(g, rows, rest)
        for s, pivot in zip(group, pivots, strict=True):
            number = g.value(pivot)
            if number is not None and number <= 0.0:
                raise _refusal(self.sensors[s], "the force that follows it", "each makes the other grow")
            if number is None:
                self.margins.append((self.sensors[s], pivot))
        solved = [g.zero] * len(group)
        for i in reversed(range(len(group))):
            solved[i] = g.div(g.sub(rest[i], g.dot(rows[i][i + 1 :], solved[i + 1 :])), pivots[i])
        return dict(zip(group, solved, strict=True))


def _all_below(s: int, needs: dict[int, set[int]]) -> set[int]:
    """All variables that one depends on, through others too; itself where it is in a loop."""
    found, waiting = set[int](), [s]
    while waiting:
        new = needs[waiting.pop()] - found
        found |= new
        waiting += new
    return found


def _refuse_what_is_not_unique(d: Equations, sensors: list[Sensor]) -> None:
    """Refuse reactions of which there are many, since constraints follow from others."""
    asked = next((s for s in sensors if s.derivative is None), None)
    if asked is not None and d.dependent:
        constraints = (*d.description.constraints, *d.description.velocity_constraints)
        names = ", ".join(f"'{constraints[k].name}'" for k in d.dependent)
        raise ModelError(
            f"{asked.name} is not unique, as {names} follow from other constraints, and the motion follows it",
            table=asked.table,
            key=asked.key,
            hint=f"leave {names} out, or make one of the bodies elastic",
        )


def _refuse_contacts(d: Equations, sensors: dict[int, Sensor]) -> None:
    """Refuse forces on a mechanism that follow reactions where stops and dry friction do so, too."""
    if not (d.own.stops or d.own.frictions):
        return
    kept = [node for k, node in enumerate(d.accelerations) if k not in d.x.states]
    for node in d.g.reachable([*kept, *d.multipliers], SENSED):
        if node in sensors:
            raise _refusal(
                sensors[node],
                "the force that follows it",
                "the model has stops or dry friction, which are solved for by themselves",
            )


def _refusal(s: Sensor, what: str, why: str) -> ModelError:
    return ModelError(
        f"{s.name} and {what} determine each other, and {why}",
        table=s.table,
        key=s.key,
        hint="filter it through a state, and let the force follow that: [states] "
        f"measured = {{ derivative = '({s.name} - measured)/tau' }}".replace('"', "")
        + "; friction takes a reaction as its 'normal'",
    )


def with_margins(
    description: Description, own: Description, settled: Settled
) -> tuple[Description, list[str]]:
    """The description with events that end a run where a loop comes to have no solution, and the names of their values.

    They come behind the model's own.
    """
    taken = {x.name for x in (*description.events, *description.stops, *description.frictions)}
    made: list[Event] = []
    for k, (sensor, _) in enumerate(settled.margins):
        name = f"loop_{k}"
        while name in taken:
            name += "_"
        says = f"{sensor.name} and the force that follows it make each other grow"
        symbol = algebra.Symbol(f"margin of {name}")
        made.append(Event(name, symbol, "falling", "terminate", says=says))
    n = len(own.events)
    events = (*description.events[:n], *made, *description.events[n:])
    return replace(description, events=events), [e.when.name for e in made]
