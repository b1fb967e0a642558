"""The elimination of a lifted system (`lifting.py`): its order, from the pattern alone, and its steps on the graph."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..graph.graph import Graph
from .lifting import Lifted
from .rows import Factors, Rows, Substitution
from .tally import Tally

Order = list[tuple[int, ...]]  # a node to substitute, a row to eliminate, or a pair of rows


class _LiftedRows(Rows):
    """A lifted system while it is eliminated."""

    def __init__(self, g: Graph | Tally, form: Lifted) -> None:
        entries = {i: dict(row) for i, row in form.edges.items()}
        switched = {c: entries[c][c] for c in range(form.n, form.n + form.m) if c in entries[c]}
        super().__init__(g, form.n, form.m, entries, switched)
        self.inputs = form.inputs

    def substitute(self, node: int) -> None:
        """Move the second derivatives of a node to what it is made of (chain rule)."""
        g, own, inputs = self.g, self.entries.pop(node), self.inputs[node]
        self.left.discard(node)
        square = own.pop(node, g.zero)
        for other, weight in own.items():
            del self.entries[other][node]
            for x, factor in inputs.items():
                push = g.mul(factor, weight)
                self._add(x, other, g.add(push, push) if x == other else push)
        if square != g.zero:
            terms = list(inputs.items())
            for position, (x, factor) in enumerate(terms):
                push = g.mul(factor, square)
                for y, another in terms[position:]:
                    self._add(x, y, g.mul(push, another))
        self.result.pivots.append(Substitution(node, inputs))

    def _add(self, i: int, j: int, value: int) -> None:
        total = self.g.add(self.entries[i].get(j, self.g.zero), value)
        self.entries[i][j] = self.entries[j][i] = total
        if total == self.g.zero:
            self.entries[i].pop(j, None)
            self.entries[j].pop(i, None)

    def step(self, what: tuple[int, ...]) -> None:
        """One step of an order."""
        if len(what) == 2:
            self.eliminate_pair(*what)
        elif what[0] in self.inputs:
            self.substitute(what[0])
        else:
            self.eliminate(what[0])


def factorise_lifted(g: Graph, form: Lifted, order: Order) -> Factors:
    """Carry out an elimination in a given order."""
    rows = _LiftedRows(g, form)
    for what in order:
        rows.step(what)
    result = rows.result
    return Factors(result.pivots, result.conditions, n_nodes=len(form.inputs), velocities=form.number)


def order_of(form: Lifted, tally: Tally, first: Iterable[tuple[int, int]]) -> tuple[Order, Factors]:
    """Choose an order, and count what it costs.

    Pivots that are ready come first, that with the fewest entries before others; before one a node of its row is
    substituted if that row does not grow. If none is ready, the rate that the fewest nodes are made of is finished.
    A rate is ready once no node is made of it, a multiplier once the rates of its own constraint are gone.

    Parameters
    ----------
    form : Lifted
        Its numbers are those of `tally`.
    tally : Tally
    first : iterable of (int, int)
        Pairs of a rate and a constraint to begin with.

    Raises
    ------
    TooMuch
        It costs more than the limit of `tally`.
    """
    search = _Search(form, tally)
    for z, c in first:
        search.finish(z)
        search.finish_constraint(c)
        search.take((z, c))
    while search.waiting:
        row = search.next_ready()
        if row is None:
            search.finish(search.easiest())
            continue
        node = search.node_to_substitute(row)
        search.take((row,) if node is None else (node,))
    result = search.rows.result
    return search.order, Factors(result.pivots, result.conditions, n_nodes=len(form.inputs))


class _Search:
    """The state of the choice of an order; sets of nodes are bits of whole numbers."""

    def __init__(self, form: Lifted, tally: Tally) -> None:
        self.form, self.rows, self.order = form, _LiftedRows(tally, form), list[tuple[int, ...]]()
        self.waiting = set(range(form.n + form.m))
        self.users: dict[int, set[int]] = {}
        for node, inputs in form.inputs.items():
            for x in inputs:
                self.users.setdefault(x, set()).add(node)
        self.first_node = form.n + form.m
        self.above: dict[int, int] = {}  # the nodes that are made of a node or rate
        for x in (*reversed(form.inputs), *range(form.n)):
            self.above[x] = 0
            for node in self.users.get(x, ()):
                self.above[x] |= self.above[node] | 1 << (node - self.first_node)
        self.alive = (1 << len(form.inputs)) - 1
        self.support = self._supports()

    def _supports(self) -> dict[int, set[int]]:
        """The rates of each constraint's own row of G."""
        n, form = self.form.n, self.form
        below: dict[int, set[int]] = {i: {i} for i in range(n)}
        needed = {x for c in range(n, n + form.m) for x in form.edges[c] if x in form.inputs}
        stack = list(needed)
        while stack:
            node = stack[-1]
            missing = [x for x in form.inputs[node] if x not in below]
            if missing:
                stack += missing
                continue
            stack.pop()
            below[node] = set().union(*(below[x] for x in form.inputs[node]))
        return {c: set().union(*(below[x] for x in form.edges[c] if x != c)) for c in range(n, n + form.m)}

    def take(self, what: tuple[int, ...]) -> None:
        """Carry out one step."""
        self.rows.step(what)
        self.order.append(what)
        for x in what:
            if x in self.form.inputs:
                self.alive &= ~(1 << (x - self.first_node))
                for below in self.form.inputs[x]:
                    self.users[below].discard(x)
            else:
                self.waiting.discard(x)
                for support in self.support.values():
                    support.discard(x)

    def _is_ready(self, row: int) -> bool:
        return not self.users.get(row) if row < self.form.n else not self.support[row]

    def next_ready(self) -> int | None:
        """The row to eliminate next; None if none is ready."""
        entries = self.rows.entries
        ready = [i for i in self.waiting if self._is_ready(i) and i in entries[i]]
        if not ready and not any(i < self.form.n for i in self.waiting):
            return min(self.waiting)  # constraints that repeat others
        return min(ready, key=lambda i: (len(entries[i]), i), default=None)

    def node_to_substitute(self, row: int) -> int | None:
        """A node of a row whose substitution does not make that row longer."""
        entries = self.rows.entries[row]
        for node in sorted(entries, reverse=True):
            if node in self.form.inputs and not self.users.get(node):
                if len(entries.keys() | self.form.inputs[node].keys()) <= len(entries) + 1:
                    return node
        return None

    def easiest(self) -> int:
        """The rate with the fewest nodes above it."""
        rates = [i for i in self.waiting if i < self.form.n and not self._is_ready(i)]
        return min(rates, key=lambda i: ((self.above[i] & self.alive).bit_count(), i))

    def finish(self, rate: int) -> None:
        """Substitute all nodes that are made of a rate."""
        nodes = self.above[rate] & self.alive
        while nodes:
            node = nodes.bit_length() - 1
            nodes ^= 1 << node
            self.take((self.first_node + node,))

    def finish_constraint(self, c: int) -> None:
        """Substitute the nodes of a constraint's row."""
        while nodes := [x for x in self.rows.entries[c] if x in self.form.inputs]:
            node = max(nodes)
            self.finish(node)
            self.take((node,))


def tallied(form: Lifted, g: Graph, tally: Tally) -> Lifted:
    """A lifted system of what is known about its numbers."""

    def table(of: Mapping[int, Mapping[int, int]]) -> dict[int, dict[int, int]]:
        return {i: {j: tally.number(g, node) for j, node in row.items()} for i, row in of.items()}

    return Lifted(form.n, form.m, table(form.inputs), table(form.edges))
