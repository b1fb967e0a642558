"""Write the computation of one coefficient of every series, for a given order or for any order in a loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from symgen.runtime.code.llvm_text import constant
from symgen.runtime.errors import Refusal
from symgen.runtime.taylor.code import ONE, Code, Value
from symgen.runtime.taylor.graph import CONVOLUTIONS, SOLVED, SeriesGraph
from symgen.runtime.taylor.inverse import Solutions
from symgen.runtime.taylor.motion import Motion
from symgen.runtime.taylor.plan import LINEAR, Plan
from symgen.runtime.taylor.reactions import Reactions

_MOST_PRODUCTS = 4


class Start:
    """Writes values at the start of a step, each when it is first needed.

    Attributes
    ----------
    values : dict of (node, order) to Value
        Coefficients written so far.
    """

    def __init__(self, code: Code, graph: SeriesGraph) -> None:
        self.code, self.graph = code, graph
        self.values: dict[tuple[int, int], Value] = {}
        self._inverses: dict[int, str] = {}
        self._pairs: dict[int, tuple[str, str]] = {}

    def constant(self, node: int) -> str:
        """The value of a node that does not move."""
        return self.initial(node)

    def initial(self, node: int) -> Value:
        """The value of a node at the start of the step."""
        pending = [node]
        while pending:
            wanted = pending[-1]
            if (wanted, 0) in self.values:
                pending.pop()
                continue
            kind = self.graph.op[wanted]
            below = self._below(wanted)
            missing = [a for a in below if kind != "shift" and (a, 0) not in self.values]
            if missing:
                pending += missing
            else:
                self.values[wanted, 0] = self._initial(wanted)
        return self.values[node, 0]

    def _below(self, node: int) -> tuple[int, ...]:
        """The nodes whose values give that of a node."""
        if node in self.graph.products:
            return self.graph.products[node]
        return self.graph.begins_with(node) if self.graph.op[node] == "integral" else self.graph.args[node]

    def _initial(self, node: int) -> Value:
        g, code = self.graph, self.code
        kind, args, data = g.op[node], self._below(node), g.data[node]
        if node in g.products:
            return code.mul(*(self.values[a, 0] for a in args))
        if kind == "number":
            return constant(data[0])
        if kind == "parameter":
            return code.load("p", data[0])
        if kind == "start":
            return code.load("y", data[0])
        if kind == "integral" and data[0] == "state":
            return code.load("y", data[1])
        if kind in ("time", "now"):
            return "%t"
        if kind == "shift":
            return self.values[args[0], 1]
        zero = constant(0.0)
        values = [self.values[a, 0] for a in args]
        known = [zero if value is None else value for value in values]
        if kind == "integral":
            return self._function(data[0], data[1], known)
        if kind == "call":
            return code.call(data[0], known)
        if kind == "sqrt":
            return code.call("sqrt", known)
        if kind == "power":
            return self._power(known[0], data[0])
        if kind == "select":
            return code.select(data[0], *known)
        if kind == "kept":
            return code.kept(*known)
        if kind in ("div", "fdiv"):
            return code.div(values[0], known[1])
        if kind in ("mul", "scale", "fmul"):
            return code.mul(*values)
        return getattr(code, {"fadd": "add", "fsub": "sub"}.get(kind, kind))(*values)

    def _power(self, base: str, exponent: float) -> str:
        """A power by products and at most one root and one division; by the C library where that takes many."""
        code, size = self.code, abs(exponent)
        if size > _MOST_PRODUCTS or 2.0 * size != round(2.0 * size):
            return code.call("pow", [base, constant(exponent)])
        value: Value = code.call("sqrt", [base]) if size != round(size) else ONE
        for _ in range(int(size)):
            value = code.mul(base, value)
        return value if exponent > 0.0 else code.div(ONE, value)

    def _function(self, name: str, argument: int, known: list[str]) -> str:
        if name not in ("sin", "cos"):
            return self.code.call(name, known)
        if argument not in self._pairs:
            self._pairs[argument] = self.code.sincos(known[0])
        return self._pairs[argument][name == "cos"]

    def inverse(self, node: int) -> str:
        """1 / c of a quotient b / c or a power of c, 1 / (2 u) of a root u, at the start of the step."""
        if node not in self._inverses:
            half = self.graph.op[node] == "sqrt"
            divisor = self.initial(node if half else self.graph.args[node][-1])
            self._inverses[node] = self.code.div(constant(0.5) if half else ONE, divisor or constant(0.0))
        return self._inverses[node]


# [M Gᵀ; G 0] (a; -λ) = -r. As in `symgen.derive.solve.factorise`: minimum degree, a constraint only after all
# coordinates of its own row that have inertia, and in pairs what inertia does not determine.

# Up to this size the inverse is formed: its products wait for each other less than substitutions do.
LARGEST_INVERSE = 6


@dataclass(frozen=True)
class Pivot:
    """Rows eliminated together, the inverse of their block, and L below: row -> one value for each."""

    rows: tuple[int, ...]
    inverse: list[list[Value]]
    lower: dict[int, list[Value]]


class _Changed:
    """What is solved with, once products of a column and a row were taken off its matrix."""

    def __init__(self, code: Code, n: int) -> None:
        self.code, self._n_rows = code, n
        self._taken_off: list[tuple[dict[int, Value], list[Value]]] = []

    def take_off(self, column: dict[int, Value], row: dict[int, Value]) -> None:
        """Take the product of a column and a row off the matrix (Sherman, Morrison, Ann. Math. Stat. 21 (1950) 124).

        Entries are given by their places. To be called before anything is solved for.
        """
        code = self.code
        response = self._substitute(code, [column.get(i) for i in range(self._n_rows)])
        rest: Value = ONE
        for i, value in row.items():
            rest = code.fnma(value, response[i], rest)
        inverse = code.div(ONE, rest)
        self._taken_off.append((row, [code.mul(value, inverse) for value in response]))

    def _corrected(self, code: Code, x: list[Value]) -> list[Value]:
        """A solution without what was taken off, corrected for that."""
        for taken, response in self._taken_off:
            share: Value = None
            for i, value in taken.items():
                share = code.fma(value, x[i], share)
            x = [code.fma(share, value, before) for value, before in zip(response, x)]
        return x

    def _substitute(self, code: Code, right: list[Value]) -> list[Value]:
        raise NotImplementedError


class Factors(_Changed):
    """The factors of a symmetric matrix given by its entries (both triangles) in rows below `n`, constraints above.

    Attributes
    ----------
    pivots : list of Pivot
    conditions : list of str
        The constraints' pivots, relative to their values before other constraints were eliminated.
    """

    def __init__(self, code: Code, n: int, entries: dict[int, dict[int, str]]) -> None:
        super().__init__(code, len(entries))
        self.n, self.entries = n, entries
        self.left = set(entries)
        # A pivot with a constraint that can be switched off could be zero.
        self.switched = {c for c in entries if c >= n and c in entries[c]}
        self.pivots: list[Pivot] = []
        self.conditions: list[Value] = []
        self._before: dict[int, Value] = {}
        self._inverse_matrix: list[list[Value]] | None = None
        self._solutions = Solutions(code, self._substitute)
        while (pair := self._next_pair()) is not None:
            self._eliminate(pair)
        # What a constraint waits for; inertia from constraints alone makes all of them wait.
        bare = {i for i in self.left if i < n and i not in entries[i]}
        self.own = {c: bare | {i for i in entries[c] if i < n} for c in self.left if c >= n}
        while self.left:
            self._eliminate((self._next(),))

    def solve(self, right: list[Value]) -> list[Value]:
        """Return the solution for a right-hand side."""
        if len(right) > LARGEST_INVERSE:
            # What was taken off is not symmetric.
            return self._substitute(self.code, right) if self._taken_off else self._solutions.of(right)
        if self._inverse_matrix is None:
            n = range(len(right))
            columns = [self._substitute(self.code, [ONE if i == j else None for i in n]) for j in n]
            self._inverse_matrix = [list(row) for row in zip(*columns)]
        return [self._product(row, right) for row in self._inverse_matrix]

    def _product(self, row: list[Value], right: list[Value]) -> Value:
        total: Value = None
        for factor, value in zip(row, right):
            total = self.code.fma(factor, value, total)
        return total

    def _substitute(self, code: Code, right: list[Value]) -> list[Value]:
        x = list(right)
        for pivot in self.pivots:
            for row, factors in pivot.lower.items():
                for factor, i in zip(factors, pivot.rows):
                    x[row] = code.fnma(factor, x[i], x[row])
        for pivot in self.pivots:
            own = [x[i] for i in pivot.rows]
            for i, inverse in zip(pivot.rows, pivot.inverse):
                total: Value = None
                for factor, value in zip(inverse, own):
                    total = code.fma(factor, value, total)
                x[i] = total
        for pivot in reversed(self.pivots):
            for row, factors in pivot.lower.items():
                for factor, i in zip(factors, pivot.rows):
                    x[i] = code.fnma(factor, x[row], x[i])
        return self._corrected(code, x)

    def _next_pair(self) -> tuple[int, ...] | None:
        for c in sorted(i for i in self.left - self.switched if i >= self.n):
            if len(self.entries[c]) == 1:
                return (next(iter(self.entries[c])), c)
        candidates = []
        for z in self.left:
            row = self.entries[z]
            if z < self.n and row and all(i >= self.n for i in row):
                candidates += [(len(row), len(self.entries[c]), z, c) for c in row if c not in self.switched]
        return min(candidates)[2:] if candidates else None

    def _massive(self, i: int) -> bool:
        return i < self.n and i in self.entries[i]

    def _next(self) -> int:
        rows = self.entries
        eligible = [
            i
            for i in self.left
            if i in rows[i]
            and (i < self.n or not any(self._massive(j) for j in rows[i].keys() & self.own[i]))
        ]
        if not eligible:
            raise Refusal("accelerations that neither inertia nor constraints determine")
        return min(eligible, key=lambda i: (len(rows[i]), i))

    def _eliminate(self, rows: tuple[int, ...]) -> None:
        code = self.code
        inverse = self._inverse(rows)
        below = sorted({j for i in rows for j in self.entries[i]} - set(rows))
        columns = {j: [self.entries[j].get(i) for i in rows] for j in below}
        lower: dict[int, list[Value]] = {}
        for j, column in columns.items():
            products: list[Value] = []
            for c in range(len(rows)):
                total: Value = None
                for k, value in enumerate(column):
                    total = code.fma(value, inverse[k][c], total)
                products.append(total)
            lower[j] = products
        for number, j in enumerate(below):
            for k in below[: number + 1]:
                value: Value = self.entries[j].get(k)
                for factor, other in zip(lower[j], columns[k]):
                    value = code.fnma(factor, other, value)
                if value is not None:
                    self.entries[j][k] = self.entries[k][j] = value
        self.left -= set(rows)
        for j in below:
            for i in rows:
                self.entries[j].pop(i, None)
        self.pivots.append(Pivot(rows, inverse, lower))
        if rows[0] < self.n:
            self._note_diagonals(below)

    def _note_diagonals(self, below: list[int]) -> None:
        for c in below:
            if c >= self.n and c in self.entries[c]:
                self._before[c] = self.entries[c][c]

    def _inverse(self, rows: tuple[int, ...]) -> list[list[Value]]:
        code = self.code
        if len(rows) == 1:
            i = rows[0]
            if i >= self.n and self._before.get(i) not in (None, self.entries[i][i]):
                self.conditions.append(code.div(self.entries[i][i], self._before[i]))
            return [[code.div(ONE, self.entries[i][i])]]
        z, c = rows
        coupling = code.div(ONE, self.entries[z][c])
        own = self.entries[z].get(z)
        corner = None if own is None else code.neg(code.mul(own, code.mul(coupling, coupling)))
        return [[None, coupling], [coupling, corner]]


class Solver(_Changed):
    """Carries out what the model's function `solve` does: once what does not depend on the right-hand side.

    Attributes
    ----------
    conditions : list of str
        As those of `Factors`.
    """

    def __init__(self, start: Start, motion: Motion, breathe: Callable[[], None]) -> None:
        super().__init__(start.code, len(motion.unknowns))
        self.start, self.solution, self.breathe = start, motion.solution, breathe
        self.n_rates, solution = len(motion.rates), motion.solution
        graph = start.graph
        self._dependent: list[int] = []
        for node in graph.solved_below(solution.unknowns):
            self._dependent.append(node)
            for a in graph.args[node]:
                if not graph.mask[a] & SOLVED:
                    breathe()
                    start.initial(a)
        self.conditions: list[Value] = []
        for node in solution.ratios:
            breathe()
            self.conditions.append(start.initial(node))
        self._solutions = Solutions(start.code, self._substitute)

    def solve(self, right: list[Value]) -> list[Value]:
        """Return the accelerations, and the multipliers with the opposite sign, for a right-hand side."""
        return self._substitute(self.code, right) if self._taken_off else self._solutions.of(right)

    def _substitute(self, code: Code, right: list[Value]) -> list[Value]:
        start, graph = self.start, self.start.graph
        values: dict[int, Value] = {}

        def value(node: int) -> Value:
            return values[node] if node in values else start.initial(node)

        for node in self._dependent:
            self.breathe()
            kind, args = graph.op[node], graph.args[node]
            if kind == "right":
                values[node] = right[graph.data[node][0]]
            else:  # mul, add, sub, neg
                values[node] = getattr(code, kind)(*(value(a) for a in args))
        found = [value(node) for node in self.solution.unknowns]
        n = self.n_rates
        return self._corrected(code, [*found[:n], *(code.neg(x) for x in found[n:])])


@dataclass(frozen=True)
class Leaf:
    """What the equations are made of that is known before the unknowns of an order are.

    Attributes
    ----------
    node : int
    lead : int
        It enters with its coefficient of order k + lead.
    is_open : bool
        Whether it is a product, quotient, root or power that has open factors, without what it owes to them.
    """

    node: int
    lead: int
    is_open: bool


_EXACT_RECIPROCALS = 12  # up to here 1 / n is taken in two parts; further terms are small
FIRST_STEP = -2  # series lead by 2 at most: their coefficient 0 comes at step -2


class Steps(Start):
    """Writes the steps with a fixed order: every coefficient has a value of its own."""

    def __init__(self, code: Code, plan: Plan, n_y: int, n_rows: int) -> None:
        super().__init__(code, plan.graph)
        self.plan, self.n_y, self.n_rows = plan, n_y, n_rows
        self.factors: Factors | Solver | None = None
        self._partial: dict[int, Value] = {}
        self._weights: list[tuple[Leaf, list[Value]]] | None = None
        self._frictions: list[tuple[dict[int, Value], dict[int, Value]]] = []

    # The newest coefficients of one step: order `k` + lead.

    def step(self, k: int) -> None:
        """Write the coefficients of order `k` + lead of every series."""
        self.k = k
        reactions = self.plan.motion.reactions
        if k == 0 and reactions is not None:
            self._begin_with(reactions)
        for node in self.plan.order:
            n = k + self.plan.lead[node]
            if n >= 0:
                self._breathe()
                self.values[node, n] = self._provisional(node, n)
                if k < 0 or node not in self.plan.closed_later:
                    self.settled(node)
        if k >= 0:
            if k == 0:
                if self.plan.motion.unknowns:
                    self._factorise()
                self._write_pivot_ratio()
            self._correct()
            self._write_out()
        self.finished(k)

    def settled(self, node: int) -> None:
        """What an emitter does with the newest coefficient of a series, as soon as it does not change any more."""

    def finished(self, k: int) -> None:
        """What an emitter does with the coefficients of a step."""

    def _breathe(self) -> None:
        if self.code.is_full:
            self.code.begin_piece(max(self.k, 0))

    def _provisional(self, node: int, n: int) -> Value:
        is_open = node in self.plan.open
        if n == 0 and (self.k < 0 or not is_open or self._known_at_start):
            return self.initial(node)
        known = self.k < 0 or (self.k == 0 and self._known_at_start)
        if known or not (is_open and self.plan.by_weights):
            return self._coefficient(node, n)
        if (
            self.plan.graph.op[node] in CONVOLUTIONS
        ):  # without what it owes to other open series: these are None
            self._partial[node] = self._coefficient(node, n)
        return None

    def _coefficient(self, node: int, n: int) -> Value:
        g, code = self.graph, self.code
        kind, args = g.op[node], g.args[node]
        if kind in ("acceleration", "multiplier"):
            return None
        if kind == "time":
            return ONE if n == 1 else None
        if kind == "neg":
            return code.neg(self.at(args[0], n))
        if kind in ("add", "sub"):
            return self._sum_of_two(kind == "sub", *args, n)
        if kind == "scale":
            return code.mul(*self._scaled(node, n))
        if kind == "kept":
            return code.kept(self.constant(args[0]), self.at(args[1], n))
        if kind == "integral":
            return self.divided(self.at(args[0], n - 1), n)
        if kind == "shift":
            return code.mul(self.at(args[0], n + 1), self.whole(n + 1))
        if kind == "power":
            return code.mul(self.power_sum(node, n), self.inverse(node))
        total = self.convolution(node, n)
        if kind == "mul":
            return total
        rest = code.sub(self.at(args[0], n), total)
        return code.mul(rest, self.inverse(node))

    def _scaled(self, node: int, n: int) -> tuple[Value, Value]:
        """The coefficient of order n of a multiple, as what is known long before the series, and what is not."""
        factor, inner = self.graph.args[node]
        if self.graph.op[inner] == "shift":
            known = self.code.mul(self.constant(factor), self.whole(n + 1))
            return known, self.at(self.graph.args[inner][0], n + 1)
        return self.constant(factor), self.at(inner, n)

    def _sum_of_two(self, is_difference: bool, a: int, b: int, n: int) -> Value:
        """The coefficient of order n of a + b or a - b; a multiple among them is one operation with the sum."""
        code, is_multiple = self.code, self._is_multiple
        if is_multiple(b, n):
            factor, series = self._scaled(b, n)
            return (code.fnma if is_difference else code.fma)(factor, series, self.at(a, n))
        if is_multiple(a, n):
            factor, series = self._scaled(a, n)
            other = self.at(b, n)
            return code.fma(factor, series, code.neg(other) if is_difference else other)
        return (code.sub if is_difference else code.add)(self.at(a, n), self.at(b, n))

    def _is_multiple(self, node: int, n: int) -> bool:
        """Whether a coefficient is that of a multiple, and its newest: older ones are there of kept series alone."""
        g = self.graph
        return g.op[node] == "scale" and not g.is_constant(node) and n == self.k + self.plan.lead[node]

    def at(self, node: int, n: int) -> Value:
        """The coefficient of order n; of a constant, it is there at order 0 only."""
        if self.graph.is_constant(node):
            return self.constant(node) if n == 0 else None
        return self.values[node, n]

    def divided(self, value: Value, n: int, before: Value = None) -> Value:
        """value / n + before. A rounded 1 / n would be a bias, which grows with the number of steps, not its root."""
        high = 1.0 / n
        low = float((1 - Fraction(high) * n) / n)
        if n <= _EXACT_RECIPROCALS and low:
            before = self.code.fma(value, constant(low), before)
        return self.code.fma(value, constant(high), before)

    def whole(self, n: int) -> str:
        return constant(float(n))

    def corrected(self, before: Value, change: Value, lead: int) -> Value:
        """before + change k! / (k + lead)!: how a correction of order k enters a series that leads."""
        return self.divided(change, math.perm(self.k + lead, lead), before)

    def convolution(self, node: int, n: int) -> Value:
        """The sum of products in the coefficient n of a product, quotient or root, the newest terms last."""
        x, y = self.plan.factors(node)
        kind = self.graph.op[node]
        first, last = {"mul": (0, n), "div": (1, n), "sqrt": (1, n - 1)}[kind]
        code = self.code
        if x != y:
            terms = sorted(range(first, last + 1), key=lambda j: (max(j, n - j), j))
            total, terms = self.inner_sum(node, n, terms)
            for j in terms:
                total = code.fma(self.at(x, j), self.at(y, n - j), total)
            return total
        total, terms = self.inner_sum(node, n, list(range((n - 1) // 2, first - 1, -1)))
        for j in terms:
            total = code.fma(self.at(x, j), self.at(x, n - j), total)
        total = code.add(total, total)
        middle = self.at(x, n // 2) if n % 2 == 0 and first <= n // 2 <= last else None
        return code.fma(middle, middle, total)

    def inner_sum(self, node: int, n: int, terms: list[int]) -> tuple[Value, list[int]]:
        """What an emitter sums apart of the terms of a convolution, and the terms that are left."""
        return None, terms

    def power_sum(self, node: int, n: int) -> Value:
        """The coefficient n of P = u^e times u_0: sum of (j (e + 1) / n - 1) u_j P_{n-j}, from u P' = e u' P."""
        (base,), (exponent, _) = self.graph.args[node], self.graph.data[node]
        terms = sorted(range(1, n + 1), key=lambda j: (max(j, n - j), j))
        total, terms = self.inner_sum(node, n, terms)
        for j in terms:
            weighted = self.code.mul(constant(j * (exponent + 1.0) / n - 1.0), self.at(base, j))
            total = self.code.fma(weighted, self.at(node, n - j), total)
        return total

    # The unknowns.

    @property
    def _known_at_start(self) -> bool:
        """Whether the unknowns' coefficients of order 0 are not solved for from the residual."""
        return self.plan.motion.reactions is not None

    def _begin_with(self, reactions: Reactions) -> None:
        """Take over the unknowns at the start of the step, and what friction adds to the equations."""
        start = Start(self.code, reactions.graph)
        for unknown, node in zip(self.plan.motion.unknowns, reactions.unknowns):
            self._breathe()
            self.values[unknown, 0] = start.initial(node)
        n = len(self.plan.motion.rates)
        for friction in reactions.frictions:
            along = {i: start.initial(node) for i, node in friction.along.items()}
            weights = {n + k: start.initial(node) for k, node in friction.weights.items()}
            self._frictions.append((along, weights))

    def _factorise(self) -> None:
        motion = self.plan.motion
        n = len(motion.rates)
        if motion.solution is not None:
            self.factors = Solver(self, motion, self._breathe)
            self._take_off_frictions()
            return
        entries: dict[int, dict[int, str]] = {i: {} for i in range(len(motion.unknowns))}
        for (i, j), node in motion.mass.items():
            if i <= j and (value := self.initial(node)) is not None:
                entries[i][j] = entries[j][i] = value
        for (c, j), node in motion.jacobian.items():
            if (value := self.initial(node)) is not None:
                entries[n + c][j] = entries[j][n + c] = value
        for c, node in motion.corner.items():
            entries[n + c][n + c] = self.code.neg(self.initial(node))
        self.factors = Factors(self.code, n, entries)
        self._take_off_frictions()

    def _take_off_frictions(self) -> None:
        for along, weights in self._frictions:
            self.factors.take_off(along, weights)

    def _write_pivot_ratio(self) -> None:
        ratio = ONE
        for condition in self.factors.conditions if self.factors else ():
            ratio = self.code.select("ole", condition, ratio, condition, ratio)
        self.code.store("out", self.n_rows * self.n_y, ratio)

    def _solve(self) -> list[Value]:
        """Accelerations and multipliers, from the residual at zero."""
        motion, code = self.plan.motion, self.code
        n = len(motion.rates)
        if self.plan.by_weights:
            solution = self._solve_by_weights()
        else:
            solution = self.factors.solve([code.neg(self.at(node, self.k)) for node in motion.equations])
        return [*solution[:n], *(code.neg(value) for value in solution[n:])]

    def _solve_by_weights(self) -> list[Value]:
        """The solution from what the equations are made of, the latest parts last: the shortest way to the result."""
        code = self.code
        if self._weights is None:
            self._weights = self._leaf_weights()
        values = [(self._leaf_value(leaf), weights) for leaf, weights in self._weights]
        solution: list[Value] = []
        for i in range(len(self.plan.motion.unknowns)):
            total: Value = None
            for value, weights in values:
                total = code.fma(weights[i], value, total)
            solution.append(total)
        return solution

    def _leaf_value(self, leaf: Leaf) -> Value:
        """What is known of a leaf before the unknowns are, times (k + lead)! / k!."""
        value = self._partial[leaf.node] if leaf.is_open else self.at(leaf.node, self.k + leaf.lead)
        for i in range(leaf.lead):
            value = self.code.mul(value, self.whole(self.k + i + 1))
        return value

    def _leaf_weights(self) -> list[tuple[Leaf, list[Value]]]:
        """What each leaf of the equations, where it is 1, adds to the solution; the latest leaves last.

        All that is linear in the newest coefficients has factors of order 0. So the equations' derivatives by each
        series are found once, from the equations down to the leaves.
        """
        plan, motion = self.plan, self.plan.motion
        rows = range(len(motion.equations))
        found: dict[Leaf, list[Value]] = {}
        for row, equation in enumerate(motion.equations):
            self._add_derivative(found, equation, 0, [self.code.neg(ONE) if i == row else None for i in rows])
        for node in reversed(plan.order):
            lead = plan.lead[node]
            leaf = Leaf(node, lead, is_open=True)
            if leaf not in found or node in motion.unknowns:
                continue
            self._breathe()
            kind = self.graph.op[node]
            offset = {"integral": -1, "shift": 1}.get(kind, 0)
            for a, factor in self._derivatives(node):
                self._add_derivative(found, a, lead + offset, [factor(x) for x in found[leaf]])
            if kind in LINEAR:
                del found[leaf]
        leaves = [leaf for leaf in found if leaf.node not in motion.unknowns or not leaf.is_open]
        leaves.sort(key=lambda leaf: (plan.depth.get(leaf.node, 0), leaf.node, leaf.lead))
        return [(leaf, self.factors.solve(found[leaf])) for leaf in leaves]

    def _add_derivative(
        self, found: dict[Leaf, list[Value]], node: int, lead: int, values: list[Value]
    ) -> None:
        """Add to the derivatives by a coefficient of order k + lead; of known multiples, by what is known."""
        g, code = self.graph, self.code
        while g.op[node] in ("scale", "neg") and not g.is_constant(node) and not self._is_newest(node, lead):
            *factor, node = g.args[node]
            values = [code.mul(self.constant(factor[0]), x) if factor else code.neg(x) for x in values]
        leaf = Leaf(node, lead, self._is_newest(node, lead))
        before = found.get(leaf, [None for _ in values])
        found[leaf] = [code.add(a, b) for a, b in zip(before, values)]

    def _is_newest(self, node: int, lead: int) -> bool:
        """Whether the coefficient of order k + lead waits for the unknowns."""
        return node in self.plan.open and self.plan.lead[node] == lead

    def _derivatives(self, node: int) -> list[tuple[int, Callable[[Value], Value]]]:
        """What an open series' newest coefficient is made of, and by which factor, both times (k + lead)! / k!.

        Of products, quotients, roots and powers the open ones alone: the others are part of what is known of them.
        """
        g, code = self.graph, self.code
        kind, args = g.op[node], g.args[node]
        if kind in ("integral", "shift", "neg", "add", "sub"):
            signs = {"neg": (True,), "sub": (False, True)}.get(kind, (False, False))
            return [(a, code.neg if negative else (lambda x: x)) for a, negative in zip(args, signs)]
        if kind in ("scale", "kept"):
            constant, combine = self.constant(args[0]), code.mul if kind == "scale" else code.kept
            return [(args[1], lambda x: combine(constant, x))]
        found = []
        newest = self.plan.newest(node)
        for i, a in enumerate(args):
            if a in newest and a in self.plan.open:
                unit: list[Value] = [None for _ in args]
                unit[i] = ONE
                factor = self._with_change(node, unit, None)
                found.append((a, lambda x, factor=factor: code.mul(factor, x)))
        return found

    def _correct(self) -> None:
        """Solve for the unknowns of this order, and correct the open coefficients that are read again."""
        plan = self.plan
        if not plan.motion.unknowns or (self.k == 0 and self._known_at_start):
            return
        change = dict(zip(plan.motion.unknowns, self._solve()))
        scaled: dict[tuple[int, int], Value] = {}
        for node in plan.order:
            if node not in plan.closed_later:
                continue
            self._breathe()
            if not plan.by_weights and node in plan.spreading and node not in change:
                change[node] = self._change(node, change)
            self.set(node, self._final(node, change, scaled))
            self.settled(node)

    def _final(self, node: int, change: dict[int, Value], scaled: dict[tuple[int, int], Value]) -> Value:
        """The newest coefficient of an open series, with the unknowns and all that is made of these known.

        Parameters
        ----------
        change : dict
            Of unknowns, and of series whose corrections others need, times (k + lead)! / k!.
        scaled : dict of (node, lead) to Value
            These times k! / (k + lead)!; filled here.
        """
        kind, lead = self.graph.op[node], self.plan.lead[node]
        if kind in LINEAR:  # as before, of what is corrected by now: shorter than to correct each
            return self._coefficient(node, self.k + lead)
        before = self.at(node, self.k + lead)
        if node in change:  # so are the unknowns
            return self.corrected(before, change[node], lead)
        newest, parts = self.plan.newest(node), []
        for a in self.graph.args[node]:
            if a not in newest or a not in self.plan.open:
                parts.append(None)
            elif self.plan.by_weights:
                parts.append(self.at(a, self.k + lead))
            else:
                if (a, lead) not in scaled:
                    scaled[a, lead] = self.corrected(None, change[a], lead)
                parts.append(scaled[a, lead])
        return self._with_change(node, parts, self._partial[node] if self.plan.by_weights else before)

    def set(self, node: int, value: Value) -> None:
        """Replace the newest coefficient."""
        self.values[node, self.k + self.plan.lead[node]] = value

    def _change(self, node: int, change: dict[int, Value]) -> Value:
        """The correction of a series, times (k + lead)! / k!, from those of what it is made of."""
        kind, args, code = self.graph.op[node], self.graph.args[node], self.code
        newest = self.plan.newest(node)
        parts = [change.get(a) if a in newest else None for a in args]
        if kind in ("integral", "shift"):
            return parts[0]
        if kind in ("add", "sub", "neg"):
            return getattr(code, kind)(*parts)
        if kind == "scale":
            return code.mul(self.constant(args[0]), parts[1])
        if kind == "kept":
            return code.kept(self.constant(args[0]), parts[1])
        return self._with_change(node, parts, None)

    def _with_change(self, node: int, parts: list[Value], before: Value) -> Value:
        """What a product, quotient, root or power becomes as the newest coefficients of its parts change."""
        g, code = self.graph, self.code
        kind, args = g.op[node], g.args[node]
        if kind == "mul":
            total = before
            for part, other in zip(parts, reversed(args)):
                if part is not None:
                    total = code.fma(part, self.initial(other), total)
            return total
        rest = parts[0]
        if kind == "div" and parts[1] is not None:
            rest = code.fnma(self.initial(node), parts[1], rest)
        if kind == "power":
            rest = code.mul(rest, code.mul(constant(g.data[node][0]), self.initial(node)))
        return code.fma(rest, self.inverse(node), before)

    # Results.

    def _write_out(self) -> None:
        """Write v_{k+1}, q_{k+2} and w_{k+1}, and at the start what comes before them."""
        motion = self.plan.motion
        nq, nv = len(motion.coordinates), len(motion.rates)
        if self.k == 0:
            for i, node in enumerate([*motion.coordinates, *motion.rates]):
                self.put(0, i, self.initial(node))
            if motion.power is not None:
                self.put(0, nq + nv, self.code.load("y", nq + nv))
            for i, node in enumerate(motion.coordinates):
                self.put(1, i, self._coordinate(node, 1))
        for i, node in enumerate(motion.rates):
            self.put(1, nq + i, self._newest(node, 1))
        for i, node in enumerate(motion.coordinates):
            self.put(2, i, self._coordinate(node, 2))
        if motion.power is not None:
            self.put(1, nq + nv, self.divided(self._newest(motion.power, 0), self.k + 1))

    def put(self, ahead: int, index: int, value: Value) -> None:
        """Write the coefficient of order k + ahead of component `index` of the state."""
        self.code.store("out", (self.k + ahead) * self.n_y + index, value)

    def _newest(self, node: int, ahead: int) -> Value:
        return self.at(node, self.k + ahead)

    def _coordinate(self, node: int, ahead: int) -> Value:
        """Coordinates are integrals; where their own series is not needed so far ahead, here it is made."""
        if self.plan.lead[node] >= ahead:
            return self._newest(node, ahead)
        (derivative,) = self.graph.args[node]
        return self.divided(self._newest(derivative, ahead - 1), self.k + ahead)
