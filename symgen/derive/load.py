"""Expressions onto the operation graph, iteratively and by object identity, so that shared parts stay shared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from ..errors import ModelError
from ..model import algebra
from ..model.description import Description, Table
from ..model.functions import OF_CLASS, Tabulated, branch, dot
from ..model.printing import shortened
from ..model.sensors import acting
from .graph.differentiate import Tangents, forward
from .graph.graph import Graph
from .graph.nodes import INPUT, PARAM, SENSED, FoldingError
from .tables import tabulated_node
from .variables import Variables


class Loader:
    """Turns expressions into nodes of one graph.

    Parameters
    ----------
    g : Graph
    symbols : dict of str to int
        Node of each symbol by name; definitions are added by `define`.
    rates : dict of int to int
        Time derivative of each coordinate and of `t` (a node each): what `dot` uses.
    tables : iterable of Table
    """

    def __init__(
        self, g: Graph, symbols: dict[str, int], rates: dict[int, int], tables: Iterable[Table] = ()
    ) -> None:
        self.g = g
        self.tables = {table.name: table for table in tables}
        self.symbols = symbols
        self.rates = rates
        self.exact: set[int] = set(rates.values())  # nodes that are time derivatives of functions of q and t
        self._memo: dict[algebra.Expr, int] = {}
        self._moving, self._n_rates = Tangents(g, rates), len(rates)
        self._frequency: Counter[algebra.Expr] = Counter()
        self._counted: set[algebra.Expr] = set()

    def count_terms(self, expressions: Iterable[algebra.Expr]) -> None:
        """Learn how often each term occurs in sums and products, so that common prefixes are shared.

        Sums are flat: x1, x1 + x2, x1 + x2 + x3 share nothing there. Adding the most frequent terms first
        restores the sharing.
        """
        stack = list(expressions)
        while stack:
            expression = stack.pop()
            if expression in self._counted:
                continue
            self._counted.add(expression)
            if isinstance(expression, (algebra.Add, algebra.Mul)):
                self._frequency.update(expression.args)
            stack.extend(expression.args)

    def define(self, name: str, expression: algebra.Expr) -> None:
        """Make `name` stand for an expression in what is loaded later."""
        self.symbols[name] = self.load(expression)

    def load(self, expression: algebra.Expr) -> int:
        """The node of an expression."""
        memo = self._memo
        stack = [expression]
        while stack:
            current = stack[-1]
            if current in memo:
                stack.pop()
                continue
            waiting = [x for x in self._children(current) if x not in memo]
            if waiting:
                stack.extend(reversed(waiting))
                continue
            stack.pop()
            try:
                memo[current] = self._build(current)
            except FoldingError as error:
                raise ModelError(f"{error} (in the part {_shorten(current)})") from error
        return memo[expression]

    @staticmethod
    def _children(expression: algebra.Expr) -> tuple:
        if isinstance(expression, algebra.Pow) and expression.exp.is_Number:
            return (expression.base,)
        return expression.args

    def _build(self, e: algebra.Expr) -> int:
        g, memo = self.g, self._memo
        if isinstance(e, algebra.Symbol):
            if e.name not in self.symbols:
                raise ModelError(f"the name '{e.name}' is not declared")
            return self.symbols[e.name]
        if e.is_Number or e.is_NumberSymbol:
            return g.const(float(e))
        if isinstance(e, algebra.Add):
            return self._sum(e)
        if isinstance(e, algebra.Mul):
            return self._product(e)
        if isinstance(e, algebra.Pow):
            if e.exp.is_Number:
                return g.power(memo[e.base], float(e.exp))
            return g.call("exp", memo[e.exp]) if e.base is algebra.E else g.pow(memo[e.base], memo[e.exp])
        if isinstance(e, dot):
            return self._total_derivative(memo[e.args[0]])
        if isinstance(e, branch):
            side, below, above = (memo[x] for x in e.args)
            return g.defined((side,), g.select(side, g.zero, below, above))
        if isinstance(e, Tabulated):
            return tabulated_node(g, self.tables, e.func, [memo[x] for x in e.args])
        function = OF_CLASS.get(e.func)
        if function is not None:
            args = [memo[x] for x in e.args]
            return function.build(g, *args) if function.build else g.call(function.code, *args)
        if e.func is algebra.cot:  # SymPy writes tan(x + pi/2) as -cot(x)
            return g.div(g.one, g.call("tan", memo[e.args[0]]))
        if e.func in (algebra.re, algebra.conjugate):  # and |exp(x)| as exp(re(x)); everything here is real
            return memo[e.args[0]]
        raise ModelError(
            f"{_shorten(e)} cannot be used in a model",
            hint="write it with the functions of the reference page",
        )

    def derivatives(self, nodes: list[int]) -> list[int]:
        """Total time derivatives of nodes."""
        if self.g.undivided:  # roots are differentiated in another way for now
            return forward(self.g, nodes, self.rates)
        if len(self.rates) != self._n_rates:  # marks have come; none ever goes
            self._moving, self._n_rates = Tangents(self.g, self.rates), len(self.rates)
        return self._moving.of(nodes)

    def _total_derivative(self, node: int) -> int:
        result = self.derivatives([node])[0]
        self.exact.add(result)
        return result

    def _ordered(self, args: tuple[algebra.Expr, ...]) -> list[algebra.Expr]:
        return sorted(
            args, key=self._frequency.__getitem__, reverse=True
        )  # of equal ones the first stays first

    def _sum(self, e: algebra.Add) -> int:
        return self.g.sum(self._memo[x] for x in self._ordered(e.args))

    def _product(self, e: algebra.Mul) -> int:
        """Numerator over denominator, so that a*b/(c*d) costs one division."""
        g = self.g
        top, bottom = g.one, g.one
        factors = self._ordered(e.args)
        shared = _with_roots(factors)
        if shared:  # x·sqrt(x) is one power to whoever differentiates it, k·x times sqrt(x) is not
            top = g.product(g.product(self._memo[x] for x in group) for group in shared)
            factors = [x for x in factors if not any(x in group for group in shared)]
        for x in factors:
            if isinstance(x, algebra.Pow) and x.exp.is_Number and x.exp.is_negative:
                bottom = g.mul(bottom, g.power(self._memo[x.base], -float(x.exp)))
            elif isinstance(x, algebra.Rational) and x.q != 1 and x.p in (1, -1):
                top = g.mul(top, g.const(float(x)))
            else:
                top = g.mul(top, self._memo[x])
        return g.div(top, bottom)


def make_loader(g: Graph, d: Description, x: Variables) -> Loader:
    """A loader that knows the variables, parameters, inputs and constants of a description.

    What forces follow of the solved equations are variables of their own until these are solved (`feedback.py`).
    """
    symbols = {"t": x.t}
    symbols |= {r.name: node for r, node in zip(d.rates, x.v, strict=True)}
    symbols |= {c.name: node for c, node in zip(d.coordinates, x.q, strict=True)}
    symbols |= {p.name: g.var(PARAM, k) for k, p in enumerate(d.parameters)}
    symbols |= {u.name: g.var(INPUT, k) for k, u in enumerate(d.inputs)}
    symbols |= {c.name: g.const(c.value) for c in d.constants}
    symbols |= {name: g.var(SENSED, k) for name, k in acting(d).items()}
    symbols |= {
        f"{name} balance": g.zero for name in d.balanced
    }  # where nothing else is known: forces in balance
    loader = Loader(g, symbols, dict(zip([*x.q, x.t], [*x.qdot, g.one], strict=True)), d.tables)
    loader.count_terms(_expressions(d))
    return loader


def _expressions(d: Description) -> Iterator[algebra.Expr]:
    """All expressions that end up in positions and energies."""
    for _, expression in d.definitions:
        yield expression
    for body in d.bodies:
        yield from body.com
    for expression in (d.kinetic, d.potential, d.dissipation):
        if expression is not None:
            yield expression
    for constraint in (*d.constraints, *d.velocity_constraints):
        yield constraint.expression


def _with_roots(factors: Sequence[algebra.Expr]) -> list[list[algebra.Expr]]:
    """Factors that are powers of one base, at least one of them not a whole one."""
    groups: dict[algebra.Expr, list[algebra.Expr]] = {}
    roots = set()
    for x in factors:
        base, exponent = (
            (x.base, x.exp) if isinstance(x, algebra.Pow) and x.exp.is_Number else (x, algebra.ONE)
        )
        if exponent.is_positive and not base.is_Number:
            groups.setdefault(base, []).append(x)
            if not exponent.is_Integer:
                roots.add(base)
    return [group for base, group in groups.items() if base in roots and len(group) > 1]


def _shorten(e: algebra.Expr) -> str:
    """A part of an expression for an error message; printing all of a deep one could take for ever."""
    return shortened(e, 120) if _shallow(e) else type(e).__name__


def _shallow(e: algebra.Expr, depth: int = 4) -> bool:
    return depth > 0 and len(e.args) <= 8 and all(_shallow(x, depth - 1) for x in e.args)
