"""Which coefficient of every series is computed when: the plan of one order, for all emitters.

At order k, the accelerations' coefficient k is solved for. Other series run ahead of it by their `lead`: rates by 1
(v_{k+1} = a_k / (k+1)), positions whose second derivative is needed by 2. What is made of the unknown coefficients
in the same order is *open*: it is computed with the unknowns at zero, and corrected once they are known. All
dependence on them is linear, with factors that are coefficients of order 0.
"""

from __future__ import annotations

import functools

from symgen.runtime.taylor.graph import CONVOLUTIONS
from symgen.runtime.taylor.motion import Motion

_FEW_UNKNOWNS = 3
LINEAR = ("integral", "shift", "add", "sub", "neg", "scale", "kept")
_OUTPUT_LEAD = 2  # of coordinates whose rates are not their derivatives: they reach the order of all others


class Plan:
    """Order of computation.

    Attributes
    ----------
    motion : Motion
    order : list of int
        The series, each after those whose newest coefficient it needs.
    lead : dict of int to int
    open : set of int
        Series whose newest coefficient waits for the unknowns.
    closed_later : set of int
        Open series whose newest coefficient is read again at later orders, so that they must be corrected.
    spreading : set of int
        Of these, what products, quotients, roots and powers among them are made of, directly or by sums: their
        corrections are needed by themselves.
    kept : set of int
        Series of which older coefficients are read.
    by_weights : bool
        Whether what the equations are made of enters the solution directly, each product by a weight for each unknown,
        in place of sums along the way to the equations.
    depth : dict of int to int
        How many operations the newest coefficient has to wait for, in its step.
    """

    def __init__(self, motion: Motion) -> None:
        self.motion, self.graph = motion, motion.graph
        self.lead: dict[int, int] = {}
        self._demand()
        self.order = self._sorted()
        self.open = self._open()
        self.kept, self.closed_later = self._kept()
        self.spreading = self._spreading()
        self.depth = self._depths()
        self.by_weights = self._is_short_by_weights()

    @functools.cached_property
    def convolutions(self) -> list[int]:
        """Series that are products, quotients, roots or powers."""
        return [node for node in self.order if self.graph.op[node] in CONVOLUTIONS]

    def series_args(self, node: int) -> list[tuple[int, int]]:
        """What the coefficient of order n of `node` is made of: (node, offset): its coefficient n + offset."""
        g = self.graph
        offset = {"integral": -1, "shift": 1}.get(g.op[node], 0)
        return [(a, offset) for a in g.args[node] if not g.is_constant(a)]

    def factors(self, node: int) -> tuple[int, int]:
        """The two series whose convolution a product, quotient, root or power needs."""
        kind, args = self.graph.op[node], self.graph.args[node]
        return {"mul": args, "sqrt": (node, node)}.get(kind, (args[-1], node))

    def _demand(self) -> None:
        m, g = self.motion, self.graph
        pending = [(node, 0) for node in m.equations]
        pending += [(node, 1) for node in m.rates]
        for q in m.coordinates:
            plain = g.args[q][0] in m.rates
            pending.append((q, 0 if plain else _OUTPUT_LEAD))
        if m.power is not None:
            pending.append((m.power, 0))
        pending = [(node, lead) for node, lead in pending if not g.is_constant(node)]
        while pending:
            node, lead = pending.pop()
            if self.lead.get(node, -1) >= lead:
                continue
            self.lead[node] = lead
            pending += [(a, max(lead + offset, 0)) for a, offset in self.series_args(node)]

    def newest(self, node: int) -> list[int]:
        """The series whose newest coefficient the newest coefficient of `node` needs."""
        lead = self.lead
        return [a for a, offset in self.series_args(node) if lead[a] == lead[node] + offset]

    def _sorted(self) -> list[int]:
        done: dict[int, None] = {}
        pending = sorted(self.lead, reverse=True)
        while pending:
            node = pending[-1]
            missing = [a for a in self.newest(node) if a not in done]
            if node in done or not missing:
                done[node] = None
                pending.pop()
            else:
                pending += missing
        return list(done)

    def _open(self) -> set[int]:
        found: set[int] = set()
        unknowns = set(self.motion.unknowns)
        for node in self.order:
            if node in unknowns or any(a in found for a in self.newest(node)):
                found.add(node)
        return found

    def _depths(self) -> dict[int, int]:
        depth: dict[int, int] = {}
        for node in self.order:
            # The rates of the last step were its last result.
            late = int(node in self.motion.rates)
            depth[node] = 1 + max((depth[a] for a in self.newest(node)), default=late)
        return depth

    def _is_short_by_weights(self) -> bool:
        kinds, n = self.graph.op, len(self.motion.unknowns)
        sums = sum(kinds[node] in LINEAR for node in self.open - set(self.motion.unknowns))
        return n <= _FEW_UNKNOWNS and n * sum(kinds[node] in CONVOLUTIONS for node in self.open) < sums

    def _kept(self) -> tuple[set[int], set[int]]:
        """Series of which older coefficients are read; of these and what they are made of, the open ones."""
        kept = set()
        for node in self.order:
            if self.graph.op[node] in CONVOLUTIONS:
                kept.update(a for a in self.factors(node))
                if self.graph.op[node] != "mul":
                    kept.add(node)
            for a, offset in self.series_args(node):
                if self.lead[a] > self.lead[node] + offset:
                    kept.add(a)
        final = kept | set(self.motion.rates)
        if self.motion.power is not None:
            final.add(self.motion.power)
        final |= {q for q in self.motion.coordinates if q in self.lead}
        closed: set[int] = set()
        pending = [node for node in final if node in self.open]
        while pending:
            node = pending.pop()
            if node not in closed:
                closed.add(node)
                pending += [a for a in self.newest(node) if a in self.open]
        return kept, closed

    def _spreading(self) -> set[int]:
        found: set[int] = set()
        pending = [node for node in self.closed_later if self.graph.op[node] not in LINEAR]
        while pending:
            for a in self.newest(pending.pop()):
                if a in self.open and a not in found:
                    found.add(a)
                    pending.append(a)
        return found
