"""The order of a function's clusters: those of one shape together, where what they read allows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

from ..graph.graph import Graph
from .clusters import OUT, Clusters, Sink, find
from .shapes import Instance, Shapes

FEWEST = 4  # clusters of one shape that make a loop
CLUSTERS, SUM, SOLVE = "clusters", "sum", "solve"
INTO = "into"
# What must be there before: a root, the result of a solver, or (`INTO`, a solver or sum) all that enters it.
Need = int | tuple[str, int]
FACTORS = ("factor_ldl", "factor_fronts")


@dataclass
class Group:
    """Clusters of one shape that are written to the same arrays; or one long sum; or one call of a solver.

    Attributes
    ----------
    kind : {"clusters", "sum", "solve"}
    targets : tuple
        Where each member is written: `OUT`, a solver's node, or (`SUM`, the sum's node, a sign).
    members : list of Instance
    places : list of tuple of int
        For each member, its places in the arrays among `targets`.
    needs : list of set of Need
        Of each member.
    """

    kind: str
    targets: tuple
    members: list[Instance] = field(default_factory=list)
    places: list[tuple[int, ...]] = field(default_factory=list)
    needs: list[set[Need]] = field(default_factory=list)

    def add(self, member: Instance, sinks: Sequence[Sink], needs: set[Need]) -> None:
        """Add a member."""
        self.members.append(member)
        self.places.append(tuple(place for _, place in sinks))
        self.needs.append(needs)

    def part(self, indices: list[int]) -> Group:
        """Some of the members."""
        return Group(
            self.kind,
            self.targets,
            [self.members[k] for k in indices],
            [self.places[k] for k in indices],
            [self.needs[k] for k in indices],
        )


@dataclass(frozen=True)
class Schedule:
    """Groups in stages: what one stage needs, earlier ones have made."""

    clusters: Clusters
    shapes: Shapes
    stages: list[list[Group]]

    def is_short(self) -> bool:
        """Whether loops leave at most a third of the text."""
        counts = [len(group.members) for stage in self.stages for group in stage]
        return 3 * sum(1 if count >= FEWEST else count for count in counts) <= sum(counts)


def schedule(g: Graph, written: list[tuple[int, int]]) -> Schedule:
    """Order the clusters of a function that writes `written`, pairs (place in `out`, node)."""
    clusters = find(g, written)
    shapes = Shapes(g, clusters)
    return Schedule(clusters, shapes, _staged(_groups(g, clusters, shapes)))


def _groups(g: Graph, c: Clusters, shapes: Shapes) -> list[Group]:
    summed: dict[int, list[tuple]] = defaultdict(list)
    for total, terms in c.sums.items():
        for sign, node in terms:
            summed[node].append((SUM, total, sign))
    found: dict[tuple, Group] = {}
    for root in c.roots:
        sinks, sums = c.sinks.get(root, []), summed[root]
        if root in c.sums:
            group = found[SUM, root] = Group(SUM, (*(array for array, _ in sinks), *sums))
            group.add(Instance(root, ()), sinks, {(INTO, root)})
            continue
        shape, instance = shapes.shape(root)
        needs = _needed(g, shapes, instance)
        # What no cluster computes, but for instance a 1 in many places of a matrix, is written by as many members.
        for some, more in (
            [([x], []) for x in sinks] + [([], sums)] if c.is_leaf(g, root) else [(sinks, sums)]
        ):
            targets = (*(array for array, _ in some), *more)
            if targets or root in c.shared:
                group = found.setdefault((shape, targets, root in c.shared), Group(CLUSTERS, targets))
                group.add(instance, some, needs)
    for node in c.solves:
        first = g.args[node][0]
        factors = {first} if g.op[first] in FACTORS else set()
        group = found[SOLVE, node] = Group(SOLVE, ())
        group.add(Instance(node, ()), (), {(INTO, node)} | factors)
    return [*found.values()]


def _needed(g: Graph, shapes: Shapes, instance: Instance) -> set[Need]:
    made = {g.args[x][0] for x in instance.reads if g.op[x] == "element"}
    return made.union(x for x in instance.reads if shapes.is_kept(x) and x != instance.root)


def _made(group: Group, member: Instance) -> list[Need]:
    """What others can need of a member: its number, the result of a solver, or an entry of one's array or of a sum."""
    into = [target[1] if isinstance(target, tuple) else target for target in group.targets]
    return [member.root, *((INTO, x) for x in into if x != OUT)]


def _staged(groups: list[Group]) -> list[list[Group]]:
    """Groups in stages.

    A group may need itself: its members stand in the order in which one makes what the next reads. Groups that need
    each other in a circle are taken apart.
    """
    makers: dict[Need, set[int]] = defaultdict(set)
    for k, group in enumerate(groups):
        for need in {need for member in group.members for need in _made(group, member)}:
            makers[need].add(k)
    waiting = [
        set().union(*(makers[x] for x in set().union(*group.needs))) - {k} for k, group in enumerate(groups)
    ]
    users: dict[int, list[int]] = defaultdict(list)
    for k, needed in enumerate(waiting):
        for x in sorted(needed):
            users[x].append(k)
    stages: list[list[Group]] = []
    done: set[int] = set()
    ready = [k for k, needed in enumerate(waiting) if not needed]
    while ready:
        stages.append([groups[k] for k in ready])
        done.update(ready)
        freed: set[int] = set()
        for k in ready:
            for user in users[k]:
                waiting[user].discard(k)
                if not waiting[user]:
                    freed.add(user)
        ready = sorted(freed)
    return stages + _by_height([group for k, group in enumerate(groups) if k not in done])


def _by_height(groups: list[Group]) -> list[list[Group]]:
    """Stages of groups that need each other in a circle: of each group, the members of one height together."""
    members = sorted((m.root, k, i) for k, group in enumerate(groups) for i, m in enumerate(group.members))
    height: dict[Need, int] = {}
    parts: dict[int, dict[int, list[int]]] = defaultdict(lambda: defaultdict(list))
    for _, k, i in members:
        own = 1 + max((height.get(x, -1) for x in groups[k].needs[i]), default=-1)
        for need in _made(groups[k], groups[k].members[i]):
            height[need] = max(own, height.get(need, -1))
        parts[own][k].append(i)
    return [[groups[k].part(own) for k, own in parts[level].items()] for level in sorted(parts)]
