"""One function of a generated module as text: what is hoisted, then a section for each kind of subsystem."""

from __future__ import annotations

from collections.abc import Iterator

from symgen.derive.rolling import schedule

from ..derive.graph.graph import Graph
from ..derive.places import START as START_VALUES
from ..derive.places import reductions
from ..derive.program import Function, Program
from ..derive.solve import fronts
from .rolled import RolledSection
from .section import Section, Shared
from .tables import Tables

# Operations and variables of a function that loops are tried for: from here on, straight-line code takes seconds to
# compile. Where a large solve is by loops anyway, the rest need not be so long.
SMALLEST_ROLLED = 12_000
SMALLEST_WITH_FRONTS = 1000


class FunctionText(Shared):
    """The text of one function.

    Attributes
    ----------
    lines : list of str
    """

    def __init__(
        self, program: Program, name: str, names: dict[tuple[int, int], str], tables: Tables
    ) -> None:
        super().__init__(program.header, names, tables)
        if any(part.function(name) for part in program.parts):
            kinds = reductions(name, program.sizes)
            self.totals = {place: f"e{k}" for k, place in enumerate(kinds)}
            self.kinds = kinds
        self.sections = list(self._sections(program, name))
        operations = sum(program.counts(name))
        doc = max((s.function.doc for s in self.sections), key=len)
        self.lines = ['@njit(error_model="numpy")', f"def {name}(t, y, p, out):"]
        self.lines += [f'    """{doc} {operations} operation{"s" * (operations != 1)}."""']
        self.lines += [f"    {line}" for line in self._body()]

    def _sections(self, program: Program, name: str) -> Iterator[Section]:
        for part in program.parts:
            function = part.function(name)
            if function is not None:
                yield Section(self, part.graph, function, part, part.places(function, program.sizes))
        if name in program.own:
            yield self._whole_section(program.graph, program.own[name])

    def _whole_section(self, g: Graph, function: Function) -> Section:
        """A function of its own: in loops over what repeats in it, where it is large and they make it short."""
        n_nodes = len(g.reachable(node for _, node in function.written()))
        if n_nodes + len(function.outputs) >= (SMALLEST_WITH_FRONTS if g.front_plans else SMALLEST_ROLLED):
            found = schedule(g, function.written())
            if found.is_short() or any(g.op[node] in fronts.TEXT for node in found.clusters.solves):
                return RolledSection(self, g, function, found)
        return Section(self, g, function)

    def _body(self) -> Iterator[str]:
        for section in self.sections:
            section.print()
        parameters = {args: None for s in self.sections for args in s.shared_parameters()}
        yield from (f"{self.names[args]} = p[{args[1]}]" for args in sorted(parameters))
        for section in self.sections:
            yield from section.hoisted
        yield from (f"{name} = {START_VALUES[self.kinds[k]]}" for k, name in self.totals.items())
        for section in self.sections:
            yield from section.text()
        yield from (f"out[{place}] = {name}" for place, name in self.totals.items())
