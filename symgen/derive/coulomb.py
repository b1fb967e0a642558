"""Dry friction in proportion to reactions: its levels and the multipliers determine each other.

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

from dataclasses import dataclass

from .graph.differentiate import forward, jacobian
from .graph.graph import Graph
from .graph.nodes import SparseRows
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
