"""Stops and dry friction: the equations with all stops open, and those with each stop and friction on a switch.

A stop that is closed, or a friction that sticks, is a constraint w a = γ with a force λ; else λ = 0. With a switch s
the two are one equation, s (w a - γ) + (1 - s) λ = 0. So one set of functions serves whatever is closed at a time, and
integrators see a model with more constraints.

Smooth friction in proportion to a reaction never sticks, and its switch stays off. It is among the others since what is
closed depends on it, and since it, too, can come to have no solution.

Dry friction in proportion to reactions: its levels and the multipliers determine each other.

M a = f - Σ s_j ℓ_j t_j + Gᵀ λ, G a = γ and ℓ_j = μ_j N_j(λ), with N the multiplier of a stop, or the magnitude of some
constraints' multipliers, and s the sense of sliding; u / sqrt(u² + w²), with the sliding speed u, where friction is
smooth. The matrix of a and λ stays symmetric if the levels ℓ are taken as given: then a and λ are affine in them, and
what is left are as many equations as there are such frictions,

    ℓ = μ N(λ_0 + Λ ℓ),

which Newton's method solves. It ends at once where all N are multipliers. Pivots of 1 - μ ∂N/∂ℓ that are not positive
are Painlevé's paradox: no solution, or several (Génot, Brogliato: New results on Painlevé paradoxes, Eur. J. Mech. A 18
(1999)). A magnitude gives a function that is convex in ℓ, so that Newton's method comes from below and cannot miss.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import sympy

from ..model.contact_laws import smooth_friction
from ..model.description import Constraint, Description, Event, Friction, Input, Stop
from ..model.expression_tree import uses
from ..model.functions import minimum
from .graph.differentiate import forward, jacobian
from .graph.graph import Graph
from .graph.nodes import LAM, SparseRows
from .load import Loader
from .solve import factorise as ldl
from .variables import Variables

_PASSES = 8  # of Newton's method where a normal force is a magnitude
_NO_FORCE = 1e-200  # squared: keeps the derivative of a magnitude finite at zero


@dataclass(frozen=True)
class Reaction:
    """One friction: the variable that stands for its level, its coefficient μ, the numbers of the multipliers in N."""

    level: int
    coefficient: int
    rows: tuple[int, ...]
    is_magnitude: bool

    def normal(self, g: Graph, multipliers: list[int]) -> int:
        """N(λ)."""
        own = [multipliers[k] for k in self.rows]
        return g.call("sqrt", g.add(g.dot(own, own), g.const(_NO_FORCE))) if self.is_magnitude else own[0]

    def weights(self, g: Graph, multipliers: list[int]) -> dict[int, int]:
        """∂N/∂λ, by the numbers of the multipliers."""
        if not self.is_magnitude:
            return {self.rows[0]: g.one}
        normal = self.normal(g, multipliers)
        return {k: g.div(multipliers[k], normal) for k in self.rows}


@dataclass(frozen=True)
class Levels:
    """All such frictions of one form of a model; there may be none."""

    g: Graph
    reactions: tuple[Reaction, ...]

    def without(self, nodes: list[int]) -> list[int]:
        """Nodes without the forces of these frictions."""
        return self.g.substitute(nodes, {r.level: self.g.zero for r in self.reactions})

    def at(self, nodes: list[int], multipliers: list[int]) -> list[int]:
        """Nodes with the levels that follow from some multipliers."""
        g = self.g
        levels = {r.level: g.mul(r.coefficient, r.normal(g, multipliers)) for r in self.reactions}
        return g.substitute(nodes, levels)

    def solve(self, factors: ldl.Factors, forces: list[int], gamma: list[int]) -> tuple[list[int], list[int]]:
        """Accelerations and minus the multipliers, and of each level how far it is from a paradox (1)."""
        g, n = self.g, len(forces)
        if not self.reactions:
            return ldl.solve(g, factors, [*forces, *gamma]), []
        solution = ldl.solve(g, factors, [*self.without(forces), *gamma])
        columns = []
        for r in self.reactions:
            along = forward(g, forces, {r.level: g.one})
            columns.append(ldl.solve(g, factors, [*along, *[g.zero] * len(gamma)]))
        levels = [g.zero] * len(columns)
        margins = [g.one] * len(columns)
        passes = _PASSES if any(r.is_magnitude for r in self.reactions) else 1
        for _ in range(passes):
            levels, margins = self._newton(solution, columns, n, levels)
        for column, level in zip(columns, levels, strict=True):
            solution = [g.add(x, g.mul(level, y)) for x, y in zip(solution, column, strict=True)]
        return solution, margins

    def _newton(
        self, solution: list[int], columns: list[list[int]], n: int, levels: list[int]
    ) -> tuple[list[int], list[int]]:
        """One step for ℓ - μ N(λ(ℓ)) = 0, and how regular it is."""
        g, k = self.g, len(columns)
        multipliers = []
        for i in range(n, len(solution)):
            moved = g.dot(levels, [column[i] for column in columns])
            multipliers.append(g.neg(g.add(solution[i], moved)))
        rows, right, widest = [], [], []
        for j, r in enumerate(self.reactions):
            weights = r.weights(g, multipliers)
            # Minus the multipliers stand in the columns.
            slopes = [g.dot(weights.values(), [column[n + i] for i in weights]) for column in columns]
            row = [g.mul(r.coefficient, slope) for slope in slopes]
            row[j] = g.add(g.one, row[j])
            rows.append(row)
            right.append(g.sub(g.mul(r.coefficient, r.normal(g, multipliers)), levels[j]))
            own = [columns[j][n + i] for i in r.rows]
            steepest = g.mul(r.coefficient, g.call("sqrt", g.dot(own, own))) if r.is_magnitude else g.zero
            widest.append(g.sub(g.one, steepest))
        pivots = _eliminate(g, rows, right)
        change = [g.zero] * k
        for i in reversed(range(k)):
            rest = g.sub(right[i], g.dot(rows[i][i + 1 :], change[i + 1 :]))
            change[i] = g.div(rest, pivots[i])
        margins = [g.minimum(p, w) if w != g.one else p for p, w in zip(pivots, widest, strict=True)]
        return [g.add(x, y) for x, y in zip(levels, change, strict=True)], margins

    def differentiate(self, rows: SparseRows, residual: list[int], state: list[int], x: Variables) -> None:
        """Add to the residual's derivatives what they owe to the levels, and put the levels in."""
        g, first = self.g, len(state) + len(x.v)
        for r in self.reactions:
            along = forward(g, residual, {r.level: g.one})
            normal = r.normal(g, x.lam)
            slopes = dict(enumerate(g.mul(normal, s) for s in jacobian(g, [r.coefficient], state)[0]))
            for i, weight in r.weights(g, x.lam).items():
                slopes[first + i] = g.mul(r.coefficient, weight)
            for i, factor in enumerate(along):
                for column, slope in slopes.items():
                    if g.zero not in (factor, slope):
                        rows[i][column] = g.add(rows[i].get(column, g.zero), g.mul(factor, slope))
        for i, row in enumerate(rows):
            rows[i] = dict(zip(row, self.at(list(row.values()), x.lam), strict=True))


def _eliminate(g: Graph, rows: list[list[int]], right: list[int]) -> list[int]:
    """Gaussian elimination in place, without exchanges: the pivots tell whether the solution is the only one."""
    for i, row in enumerate(rows):
        for j in range(i + 1, len(rows)):
            factor = g.div(rows[j][i], row[i])
            if factor == g.zero:
                continue
            rows[j] = [g.sub(a, g.mul(factor, b)) for a, b in zip(rows[j], row, strict=True)]
            right[j] = g.sub(right[j], g.mul(factor, right[i]))
    return [row[i] for i, row in enumerate(rows)]


# The functions that differ while something is closed.
SWITCHED = (
    "rhs", "residual", "residual_jacobian", "constraint_residual", "constraint_jacobian", "gamma", "project", "events",
)  # fmt: skip
# A stop is closed (1) or open (0); friction sticks (1) or not, and slides forwards (1), backwards (-1) or not at all.
SETTINGS = {"stop": ("closed",), "friction": ("stuck", "sense")}


def has_switches(d: Description) -> bool:
    """Whether a description has stops, or friction that sticks and slips or follows reactions."""
    return bool(d.stops or d.frictions)


def _symbol(name: str, key: str) -> sympy.Symbol:
    return sympy.Symbol(f"{key} {name}")  # no name of a model has a space in it


@dataclass(frozen=True)
class Switches:
    """The stops and frictions of a description, in the form with all stops open or in that with switches (`held`)."""

    description: Description | None = None
    stops: tuple[Stop, ...] = ()
    frictions: tuple[Friction, ...] = ()
    held: bool = False

    @classmethod
    def of(cls, d: Description) -> Switches:
        """Those of a finished description."""
        return cls(d, d.stops, d.frictions)

    @property
    def closed(self) -> Switches:
        """The same in the form with switches."""
        return replace(self, held=True)

    def records(self) -> list[dict[str, Any]]:
        """What the module's header says about them."""
        stops = [{"name": s.name, "kind": "stop"} for s in self.stops]
        frictions = [{"name": f.name, "kind": "friction"} for f in self.frictions]
        for f, record in zip(self.frictions, frictions, strict=True):
            if f.normal:
                record["normal"] = list(f.normal)
            if f.smooth is not None:
                record["smooth"] = True
        return stops + frictions

    def is_by_speed(self, f: Friction) -> bool:
        """Whether a friction that is no reaction's share changes with rates."""
        d = self.description
        rates = {r.name for r in d.rates if not r.state}
        definitions, waiting, seen = dict(d.definitions), [] if f.normal else [f.level], set()
        while waiting:
            found = uses(waiting.pop())
            if found.has_dot or found.names & rates:
                return True
            waiting += [definitions[name] for name in found.names & definitions.keys() - seen]
            seen |= found.names
        return False

    def form(self) -> Description:
        """The description in this form."""
        return self._closed_form() if self.held else self._open_form()

    def _on_stop(self, f: Friction) -> bool:
        return any(s.name in f.normal for s in self.stops)

    def _acting(self) -> list[Friction]:
        """Those whose normal force there is in this form."""
        return [f for f in self.frictions if self.held or not self._on_stop(f)]

    def _open_form(self) -> Description:
        """With all stops open, and sliding friction."""
        d = self.description
        settings = [
            Input(_symbol(r["name"], key).name) for r in self.records() for key in SETTINGS[r["kind"]]
        ]
        # The derivative of a Rayleigh function is its force only where the level knows no rates.
        losses = [_loss(f) for f in self._acting() if not self.is_by_speed(f)]
        dissipation = [*([] if d.dissipation is None else [d.dissipation]), *losses]
        return replace(
            d,
            inputs=(*d.inputs, *settings),
            dissipation=sympy.Add(*dissipation) if dissipation else None,
            rubbing=tuple((f.speed, -self.sliding(f)) for f in self._acting() if self.is_by_speed(f)),
            events=(*d.events, *self._opening()),
        )

    def _closed_form(self) -> Description:
        """With a constraint for each, multiplied by its switch."""
        d = self._open_form()
        held = [Constraint(s.name, _symbol(s.name, "closed") * s.gap) for s in self.stops]
        stuck = [Constraint(f.name, _symbol(f.name, "stuck") * f.speed, "velocity") for f in self.frictions]
        return replace(
            d,
            constraints=(*d.constraints, *held),
            velocity_constraints=(*d.velocity_constraints, *stuck),
            events=(*self.description.events, *self._switching()),
        )

    def _opening(self) -> Iterator[Event]:
        """A stop is hit, a sliding motion comes to its end or has no solution."""
        for s in self.stops:
            yield Event(s.name, s.gap, "falling", "stop")
        for f in self.frictions:
            yield Event(f.name, self._going_on(f), "falling", "friction")

    def _going_on(self, f: Friction) -> sympy.Expr:
        """What falls to zero where sliding ends, or where it comes to have no solution."""
        sliding, margin = _symbol(f.name, "sense") * f.speed, _symbol(f.name, "margin")
        if not f.normal:
            return sliding
        if f not in self._acting():
            return sympy.S.One
        return minimum(sliding, margin) if f.smooth is None else margin

    def _switching(self) -> Iterator[Event]:
        """The same, or: a closed stop would pull, a sticking friction would have to be larger than it can."""
        for event, s in zip(self._opening(), self.stops, strict=False):
            yield replace(
                event, when=_either(_symbol(s.name, "closed"), _symbol(s.name, "force"), event.when)
            )
        for event, f in zip([*self._opening()][len(self.stops) :], self.frictions, strict=True):
            when = event.when
            if f.smooth is None:
                margin = self._most(f) - sympy.Abs(_symbol(f.name, "force"))
                when = _either(_symbol(f.name, "stuck"), margin, when)
            if self._on_stop(f):  # nothing happens to it while that is open
                when = _either(_symbol(f.normal[0], "closed"), when, sympy.S.One)
            yield replace(event, when=when)

    def _most(self, f: Friction) -> sympy.Expr:
        """What a friction can take while it sticks."""
        forces = [_symbol(name, "force") for name in f.normal]
        if not f.normal:
            return _static(f)
        magnitude = sympy.sqrt(sympy.Add(*(x**2 for x in forces)))
        return _static(f) * (forces[0] if self._on_stop(f) else magnitude)

    def levels(self, loader: Loader, d: Description) -> Levels:
        """The frictions in proportion to reactions, whose levels become variables."""
        names = [c.name for c in (*d.constraints, *d.velocity_constraints)]
        reactions = []
        for f in self._acting():
            if f.normal:
                level = loader.g.var(LAM, len(names) + len(reactions))
                loader.symbols[_symbol(f.name, "level").name] = level
                rows = tuple(names.index(name) for name in f.normal)
                reactions.append(Reaction(level, loader.load(f.level), rows, not self._on_stop(f)))
        return Levels(loader.g, tuple(reactions))

    def sliding(self, f: Friction) -> sympy.Expr:
        """What a friction that slides exerts against the sense of its speed."""
        if f not in self._acting():
            return sympy.S.Zero
        if f.smooth is None:
            return _symbol(f.name, "sense") * _sliding(f)
        return _sliding(f) * f.speed / sympy.sqrt(f.speed**2 + f.smooth**2)

    def corner(self, loader: Loader, d: Description) -> dict[int, int]:
        """1 - s by the row of each switched constraint; empty in the open form."""
        if not self.held:
            return {}
        g = loader.g
        nh, nn = len(d.constraints), len(d.velocity_constraints)
        stops = {nh - len(self.stops) + k: _symbol(s.name, "closed") for k, s in enumerate(self.stops)}
        first = nh + nn - len(self.frictions)
        stuck = {first + k: _symbol(f.name, "stuck") for k, f in enumerate(self.frictions)}
        return {k: g.sub(g.one, loader.load(symbol)) for k, symbol in (stops | stuck).items()}

    def name_forces(self, loader: Loader, d: Description, multipliers: list[int], margins: list[int]) -> None:
        """Let the events use the forces, and how far frictions in proportion to them are from having no solution."""
        names = [c.name for c in (*d.constraints, *d.velocity_constraints)]
        normals = [name for f in self._acting() for name in f.normal]
        held = [x.name for x in (*self.stops, *self.frictions)] if self.held else []
        for name in (*held, *normals):
            loader.symbols[_symbol(name, "force").name] = multipliers[names.index(name)]
        coupled = [f for f in self._acting() if f.normal]
        for f, margin in zip(coupled, margins, strict=True):
            loader.symbols[_symbol(f.name, "margin").name] = margin

    def watched(self, loader: Loader) -> tuple[str, tuple[int, ...]]:
        """What the function `switches` writes: its docstring and its outputs."""
        groups = [(s.gap, s.restitution) for s in self.stops]
        groups += [(f.speed, f.level, _static(f) if f.smooth is None else f.smooth) for f in self.frictions]
        doc = "Gaps and restitutions of stops; speeds, levels and largest levels of frictions."
        if any(f.smooth is not None for f in self.frictions):
            doc = doc.replace("largest levels", "largest levels, or widths,")
        return doc, tuple(loader.load(x) for group in groups for x in group)

    def closed_header(self, head: dict[str, Any]) -> dict[str, Any]:
        """The header with the sizes and constraints of the closed form."""
        stops = [{"name": s.name, "kind": "holonomic"} for s in self.stops]
        frictions = [{"name": f.name, "kind": "velocity"} for f in self.frictions]
        nh, constraints = head["nh"], head["constraints"]
        return head | {
            "nh": nh + len(stops),
            "nn": head["nn"] + len(frictions),
            "constraints": [*constraints[:nh], *stops, *constraints[nh:], *frictions],
        }


def _either(switch: sympy.Symbol, on: sympy.Expr, off: sympy.Expr) -> sympy.Expr:
    return switch * on + (1 - switch) * off


def _loss(f: Friction) -> sympy.Expr:
    """The Rayleigh function of a friction that does not stick."""
    if f.smooth is None:
        return _symbol(f.name, "sense") * _sliding(f) * f.speed
    return smooth_friction(_sliding(f), (f.speed,), f.smooth)


def _sliding(f: Friction) -> sympy.Expr:
    """How large a friction is while it slides."""
    return _symbol(f.name, "level") if f.normal else f.level


def _static(f: Friction) -> sympy.Expr:
    """The level, or coefficient, while a friction sticks."""
    return f.level if f.static is None else f.static


NONE = Switches()
