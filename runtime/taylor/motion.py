"""A model's motion as a graph of series: what is integrated, and the equations for accelerations and multipliers.

Outputs of generated functions become nodes; common factors are taken out of sums of products, as a b + a c needs one
product of series as a (b + c).
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from symgen.runtime.errors import Refusal
from symgen.runtime.graph.carry_out import NoArrays, carry_out
from symgen.runtime.graph.form import Form, Name
from symgen.runtime.taylor.graph import CONVOLUTIONS, SeriesGraph
from symgen.runtime.taylor.reactions import Reactions, read_reactions

if TYPE_CHECKING:
    from symgen.runtime.system import System


# The text of `residual` spells out accelerations such as a·cos q − v²·sin q; as a series that is the second derivative
# of sin q, whose coefficients are there already. Whether one expression is the derivative of another is decided by
# their values in the integers modulo a prime, at one random point: a false match has a probability of 1e-15.

# Numbers are fractions with powers of two below, so 2 must have no small order: here it is a primitive root (the prime
# is one more than twice another, and 3 modulo 8). Modulo 2^61 - 1, round-off of the size 2^-61 would be the number 1.
PRIME = 2**61 - 2373
_REPLACEABLE = ("add", "sub", "neg", "scale", *CONVOLUTIONS)
_NEVER = 9  # the level of what no derivative gives: multipliers, right-hand sides


class Values:
    """Values and time derivatives of nodes modulo the prime, at one random point."""

    def __init__(self, graph: SeriesGraph) -> None:
        self.graph = graph
        self._known: dict[tuple[int, int], int] = {}

    def __call__(self, node: int, order: int) -> int:
        """The derivative of `node` of this order."""
        known = self._known
        pending = [(node, order)]
        while pending:
            wanted = pending[-1]
            if wanted in known:
                pending.pop()
                continue
            missing = [need for need in self._needs(*wanted) if need not in known]
            if missing:
                pending += missing
            else:
                known[wanted] = self._value(*wanted)
        return known[node, order]

    def _needs(self, node: int, n: int) -> list[tuple[int, int]]:
        g = self.graph
        kind, args = g.op[node], g.args[node]
        if g.is_constant(node):
            return [] if n else [(a, 0) for a in args]
        if kind == "integral":
            return [(args[0], n - 1)] if n else [(a, 0) for a in g.begins_with(node)]
        if kind == "shift":
            return [(args[0], n + 1)]
        if kind == "power" and g.data[node][1] >= 0:
            args = (g.data[node][1],)
        if kind in CONVOLUTIONS:
            lower = [(node, i) for i in range(n)] if kind != "mul" else []
            return [(a, i) for a in args for i in range(n + 1)] + lower
        if kind in ("scale", "kept"):
            return [(args[0], 0), (args[1], n)]
        return [(a, n) for a in args]

    def _value(self, node: int, n: int) -> int:
        g, v = self.graph, self._known
        kind, args, data = g.op[node], g.args[node], g.data[node]
        if g.is_constant(node):
            return self._constant(node) if n == 0 else 0
        if kind == "integral":
            if n:
                return v[args[0], n - 1]
            return _random(*data) if data[0] == "state" else _random(data[0], *(v[a, 0] for a in data[1:]))
        if kind == "time":
            return (_random("time"), 1, 0)[min(n, 2)]
        if kind in ("acceleration", "multiplier", "right"):
            return _random(kind, data[0], n)
        if kind == "shift":
            return v[args[0], n + 1]
        if kind == "neg":
            return -v[args[0], n] % PRIME
        if kind in ("add", "sub"):
            right = v[args[1], n]
            return (v[args[0], n] + (right if kind == "add" else -right)) % PRIME
        if kind in ("scale", "kept"):
            return v[args[0], 0] * v[args[1], n] % PRIME
        if kind == "mul":
            return _product([v[args[0], i] for i in range(n + 1)], [v[args[1], i] for i in range(n + 1)])
        if kind == "div":
            lower = [v[node, i] for i in range(n)]
            rest = v[args[0], n] - _product([*lower, 0], [v[args[1], i] for i in range(n + 1)])
            return rest * pow(v[args[1], 0], -1, PRIME) % PRIME
        if kind == "power":
            return self._power(node, n)
        if n == 0:
            return _random("sqrt", v[args[0], 0])
        lower = [0, *(v[node, i] for i in range(1, n)), 0]
        return (v[args[0], n] - _product(lower, lower)) * pow(2 * v[node, 0], -1, PRIME) % PRIME

    def _power(self, node: int, n: int) -> int:
        """Of P = b^e, from b P' = e b' P; b is a root where e would be half an integer."""
        (base,), (exponent, root), v = self.graph.args[node], self.graph.data[node], self._known
        if root >= 0:
            base, exponent = root, 2.0 * exponent
        if n == 0:
            whole = exponent == round(exponent)
            return pow(v[base, 0], int(exponent), PRIME) if whole else _random("power", v[base, 0], exponent)
        numerator, denominator = exponent.as_integer_ratio()
        rise = _product([v[base, i + 1] for i in range(n)], [v[node, i] for i in range(n)])
        rest = _product([v[base, i] for i in range(n)], [*(v[node, i + 1] for i in range(n - 1)), 0])
        slope = rise * numerator * pow(denominator, -1, PRIME) - rest
        return slope * pow(v[base, 0], -1, PRIME) % PRIME

    def _constant(self, node: int) -> int:
        g, v = self.graph, self._known
        kind, data = g.op[node], g.data[node]
        args = [v[a, 0] for a in g.args[node]]
        if kind == "number":
            if not math.isfinite(data[0]):
                return _random("number", repr(data[0]))
            numerator, denominator = data[0].as_integer_ratio()
            return numerator * pow(denominator, -1, PRIME) % PRIME
        if kind == "fadd":
            return (args[0] + args[1]) % PRIME
        if kind == "fsub":
            return (args[0] - args[1]) % PRIME
        if kind == "fmul":
            return args[0] * args[1] % PRIME
        if kind == "fdiv" and args[1]:
            return args[0] * pow(args[1], -1, PRIME) % PRIME
        if kind == "neg":
            return -args[0] % PRIME
        return _random(kind, *data, *args)


def _product(a: list[int], b: list[int]) -> int:
    """The last derivative of a product, from all derivatives of its factors (Leibniz)."""
    n = len(a) - 1
    return sum(math.comb(n, i) * a[i] * b[n - i] for i in range(n + 1)) % PRIME


def _random(*key: object) -> int:
    return int.from_bytes(hashlib.blake2b(repr(key).encode(), digest_size=8).digest()) % PRIME


def levels(graph: SeriesGraph, nodes: list[int]) -> dict[int, int]:
    """The highest derivative of positions in each node: 0 positions, 1 rates, 2 accelerations."""
    level: dict[int, int] = {}
    for node in nodes:  # by number: what a node is made of comes first
        kind, args = graph.op[node], graph.args[node]
        if kind == "acceleration":
            level[node] = 2
        elif kind in ("multiplier", "right"):
            level[node] = _NEVER
        elif kind == "integral":
            below = graph.begins_with(node)
            level[node] = max((level[a] for a in below), default=int(node in graph.rates))
        else:
            level[node] = max((level[a] for a in args), default=0) + (kind == "shift")
    return level


def use_derivatives(graph: SeriesGraph, roots: list[int], candidates: list[int]) -> list[int]:
    """Replace operations by equal ones and by derivatives of others, in place; returns the roots.

    Parameters
    ----------
    graph : SeriesGraph
    roots : list of int
    candidates : list of int
        Nodes that need not be behind the roots, of which some may be derivatives: positions of bodies,
        constraints.
    """
    nodes = graph.reachable(roots)
    values = Values(graph)
    level = levels(graph, graph.reachable([*roots, *candidates]))
    series = [
        n
        for n in (*nodes, *sorted(level.keys() - set(nodes)))
        if not graph.is_constant(n) and level[n] < _NEVER
    ]
    equal: dict[tuple[int, int], int] = {}
    derived: dict[tuple[int, int], tuple[int, int]] = {}
    for node in series:
        equal.setdefault((values(node, 0), level[node]), node)
    for order in (2, 1):
        for node in series:
            if level[node] + order <= 2:
                derived.setdefault((values(node, order), level[node] + order), (node, order))
    replaced = {}
    for node in nodes:
        if not graph.is_constant(node) and graph.op[node] in _REPLACEABLE and level[node] < _NEVER:
            found = _found(graph, derived, equal, values(node, 0), level[node])
            if found is not None and found != node:
                replaced[node] = found
    return graph.replace(replaced, roots)


def _found(graph, derived, equal, value: int, level: int) -> int | None:
    """The node to use for one of this value and level: a derivative, or the first that is equal."""
    if value == 0:
        return None
    for sign in (1, -1):
        match = derived.get((sign * value % PRIME, level))
        if match is not None:
            source, order = match
            for _ in range(order):
                source = graph.shift(source)
            return source if sign == 1 else graph.neg(source)
    return equal.get((value, level))


_LINEAR = ("add", "sub", "neg", "scale")

Term = tuple[int, int]  # a constant factor, and a series
_POSITIONS = ("constraint_residual", "poses")


def read_outputs(
    graph: SeriesGraph,
    form: Form,
    state: Callable[[int], int],
    wanted: set[int] | None = None,
    given: Mapping[int, int] | None = None,
    moving: Mapping[int, int] | None = None,
) -> dict[int, int]:
    """Add the operations behind `out[i]` to the graph; returns the node of each index.

    Parameters
    ----------
    graph : SeriesGraph
    form : Form
    state : callable
        Gives the node for `y[i]`.
    wanted : set of int, optional
        Indices of `out` to read; all by default. What nothing wanted needs may be outside of what has series.
    given : mapping of int to int, optional
        Nodes of the form whose series are known, whatever the form says that they are.
    moving : mapping of int to int, optional
        Nodes of what stands in `p` but is not constant: inputs over time.

    Raises
    ------
    Refusal
        An operation has no series, or a statement is none on numbers.
    """
    moving = moving or {}

    def parameter(index: int) -> int:
        return moving[index] if index in moving else graph.parameter(index)

    every = range(form.lengths.out) if wanted is None else wanted
    try:
        found = carry_out(
            form, _Series(graph), state, parameter, const=graph.number, wanted=every, given=given
        )
        return dict(found)
    except NoArrays:
        raise Refusal("a function has arrays, which have no series") from None


class _Series:
    """The operations of a form, on series."""

    def __init__(self, graph: SeriesGraph) -> None:
        self.graph = graph
        for name in ("time", "neg", "add", "sub", "mul", "div", "call"):
            setattr(self, name, getattr(graph, name))

    def select(self, is_strict: bool, a: int, b: int, then: int, otherwise: int) -> int:
        return self.graph.select("olt" if is_strict else "ole", a, b, then, otherwise)


def named_outputs(form: Form) -> dict[int, tuple[int, bool]]:
    """The outputs outside of loops that are a named value or its negative: index -> node, whether negative."""
    nodes = form.nodes
    named = {x.node for x, _ in form.statements() if type(x) is Name and nodes.op[x.node] != "const"}
    found = {}
    for write, count in form.writes():
        negative = nodes.op[write.node] == "neg" and write.node not in named
        node = nodes.args[write.node][0] if negative else write.node
        if not count and node in named:
            found[write.place.first] = (node, negative)
    return found


def share_factors(graph: SeriesGraph, roots: list[int]) -> list[int]:
    """Rewrite sums in place, as long as that saves products; returns the roots."""
    while True:
        nodes = graph.reachable(roots)
        uses = Counter(a for node in nodes for a in graph.args[node])
        uses.update(roots)
        inside = {a for node in nodes if graph.op[node] in _LINEAR for a in graph.args[node] if uses[a] == 1}
        replaced = {}
        for node in nodes:
            if graph.op[node] in _LINEAR and not graph.is_constant(node) and node not in inside:
                better = _with_shared_factors(graph, node, uses)
                if better is not None:
                    replaced[node] = better
        if not replaced:
            return roots
        roots = graph.replace(replaced, roots)


def _with_shared_factors(graph: SeriesGraph, node: int, uses: Counter) -> int | None:
    terms = _terms(graph, node, uses)
    changed = False
    while True:
        single = [t for t in terms if graph.op[t[1]] == "mul" and uses[t[1]] == 1]
        counts = Counter(a for _, product in single for a in set(graph.args[product]))
        factor = min(counts, key=lambda a: (-counts[a], a), default=None)
        if factor is None or counts[factor] < 2:
            return _sum(graph, terms) if changed else None
        members = [t for t in single if factor in graph.args[t[1]]]
        rest = [(c, _other(graph.args[product], factor)) for c, product in members]
        one = graph.number(1.0)
        terms = [t for t in terms if t not in members] + [(one, graph.mul(factor, _sum(graph, rest)))]
        changed = True


def _other(args: tuple[int, ...], factor: int) -> int:
    return args[1] if args[0] == factor else args[0]


def _terms(graph: SeriesGraph, node: int, uses: Counter) -> list[Term]:
    """The terms of a sum, through those sums below that nothing else uses."""
    found: list[Term] = []
    pending = [(graph.number(1.0), node)]
    while pending:
        constant, term = pending.pop()
        kind, args = graph.op[term], graph.args[term]
        if graph.is_constant(term) or kind not in _LINEAR or (term != node and uses[term] > 1):
            found.append((constant, term))
        elif kind == "scale":
            pending.append((graph.mul(constant, args[0]), args[1]))
        elif kind == "neg":
            pending.append((graph.neg(constant), args[0]))
        else:
            pending.append((graph.neg(constant) if kind == "sub" else constant, args[1]))
            pending.append((constant, args[0]))
    return found


def _sum(graph: SeriesGraph, terms: list[Term]) -> int:
    total = None
    for constant, term in terms:
        part = graph.mul(constant, term)
        total = part if total is None else graph.add(total, part)
    return total


@dataclass(frozen=True)
class Solution:
    """Nodes of the unknowns and of ratios of pivots, in terms of nodes of the kind "right": negative equations."""

    unknowns: list[int]
    ratios: list[int]


@dataclass
class Motion:
    """The series of a model.

    Attributes
    ----------
    graph : SeriesGraph
    coordinates, rates : list of int
        Nodes of q and v.
    unknowns : list of int
        Accelerations, then multipliers of constraints that do not depend on others, which `equations` determine at
        every order; none where the accelerations are given as operations (those of `rhs`).
    equations : list of int
        Nodes of `residual`: M a - f - Gᵀλ, then G a - γ.
    mass : dict of (row, column) to int
        Entries of M that are not zero; needed at the start of a step only, as is G.
    jacobian : dict of (constraint, column) to int
    solution : Solution or None
        In the place of M and G, what the model's function `solve` makes of a right-hand side.
    corner : dict of int to int
        1 - s of each constraint with a switch s, whose multiplier is zero while it is off.
    power : int or None
        The power that the work is the integral of.
    reactions : Reactions or None
        Where friction follows reactions: what it adds to the equations, and the unknowns at the start of a step.
    """

    graph: SeriesGraph
    coordinates: list[int]
    rates: list[int]
    unknowns: list[int] = field(default_factory=list)
    equations: list[int] = field(default_factory=list)
    mass: dict[tuple[int, int], int] = field(default_factory=dict)
    jacobian: dict[tuple[int, int], int] = field(default_factory=dict)
    corner: dict[int, int] = field(default_factory=dict)
    solution: Solution | None = None
    power: int | None = None
    reactions: Reactions | None = None

    @property
    def n_convolutions(self) -> int:
        """The number of products of series, which cost most."""
        g = self.graph
        roots = [
            *self.equations,
            *self.rates,
            *self.coordinates,
            *([] if self.power is None else [self.power]),
        ]
        return sum(g.op[node] in CONVOLUTIONS for node in g.reachable(roots))


def read_motion(system: System) -> Motion:
    """Return the series of a model in the form that needs the fewest products of series.

    Either the accelerations are series of what `rhs` computes, or they are solved for from `residual`, order by
    order. The latter has fewer products, except for the smallest models.

    Raises
    ------
    Refusal
        Something in the model has no Taylor series.
    """
    forms = [_from_residual(system, positions) for positions in (False, True)]
    if not system.m:
        with contextlib.suppress(Refusal):  # its solves may be loops
            forms.insert(0, _from_rhs(system))
    best = min(forms, key=lambda form: form.n_convolutions)
    return replace(best, reactions=read_reactions(system, functools.partial(_outputs, system)))


def _outputs(
    system: System,
    graph: SeriesGraph,
    name: str,
    state: Callable[[int], int],
    wanted: set[int] | None = None,
    given: dict[int, int] | None = None,
    moving: dict[int, int] | None = None,
) -> dict[int, int]:
    moving = dict(moving or {})
    moving |= {index: _polynomial(graph, *place) for index, place in system.input_polynomials.items()}
    return read_outputs(graph, system.form(name), state, wanted, given, moving)


def _polynomial(graph: SeriesGraph, knot: int, first: int, degree: int) -> int:
    """The node of an input over time: a polynomial in t - p[knot], whose coefficients begin at p[first]."""
    value = graph.parameter(first + degree)
    if degree:
        since = graph.sub(graph.time(), graph.parameter(knot))
        for j in range(degree - 1, -1, -1):
            value = graph.add(graph.mul(value, since), graph.parameter(first + j))
    return value


def _states(graph: SeriesGraph, system: System) -> tuple[list[int], list[int], Callable[[int], int]]:
    """The nodes of q and v, their derivatives not yet known, and what reads y in functions of (q, v)."""
    q = [graph.state(i) for i in range(system.nq)]
    v = [graph.state(system.nq + i) for i in range(system.nv)]
    graph.rates.update(v)
    nodes = q + v
    return q, v, nodes.__getitem__


def _graph(system: System) -> SeriesGraph:
    """A graph without nodes: what holds choices are the last parameters."""
    return SeriesGraph(
        stops_at_choices=bool(system.source.header.get("time_terms")),
        branches=range(system.n_p - len(system.jumps), system.n_p),
    )


def _from_rhs(system: System) -> Motion:
    graph = _graph(system)
    q, v, state = _states(graph, system)
    rows = _outputs(system, graph, "rhs", state, set(range(system.ny)))
    for i, node in enumerate(q + v):
        graph.integrate(node, rows[i])
    graph.note_unheld([*q, *v, *rows.values()])
    return Motion(graph, q, v, power=rows.get(system.nq + system.nv))


def _from_residual(system: System, positions: bool) -> Motion:
    """`positions`: look for derivatives among positions of bodies and constraints as well."""
    graph = _graph(system)
    q, v, state = _states(graph, system)
    a = [graph.unknown("acceleration", i) for i in range(system.nv)]
    kept = [k for k in range(system.m) if k not in system.dependent]
    solved = [graph.unknown("multiplier", i) for i in range(len(kept))]
    multipliers = [graph.number(0.0)] * system.m
    for k, node in zip(kept, solved):
        multipliers[k] = node
    rows = _outputs(system, graph, "rhs", state, set(range(system.nq)))
    for node, derivative in zip(q + v, [rows[i] for i in range(system.nq)] + a):
        graph.integrate(node, derivative)
    nodes = q + v + a + multipliers
    residual = _outputs(system, graph, "residual", nodes.__getitem__)
    equations = [residual[i] for i in (*range(system.nv), *(system.nv + k for k in kept))]
    given = system.has("solve")
    mass = {} if given else _outputs(system, graph, "mass_matrix", state)
    entries = _jacobian(system, graph, state, kept) if kept and not given else {}
    answers = _solution(system, graph, q + v, kept) if given else Solution([], [])
    power = [_power(system, graph, state, a, multipliers)] if system.nw else []
    candidates = []
    for name in _POSITIONS:
        if positions and system.has(name):
            with contextlib.suppress(Refusal):  # they only help
                candidates += _outputs(system, graph, name, state).values()
    roots = [
        *equations,
        *power,
        *q,
        *v,
        *mass.values(),
        *entries.values(),
        *answers.unknowns,
        *answers.ratios,
    ]
    graph.note_unheld(roots)
    roots = iter(share_factors(graph, use_derivatives(graph, roots, candidates)))
    return Motion(
        graph, q, v, a + solved,
        equations=[next(roots) for _ in equations],
        power=[*(next(roots) for _ in power), None][0],
        mass=dict(zip((divmod(i, system.nv) for i in mass), _after(roots, len(q + v)))),
        jacobian={place: next(roots) for place in entries},
        solution=Solution([next(roots) for _ in answers.unknowns], list(roots)) if given else None,
        corner={row: graph.sub(graph.number(1.0), graph.parameter(k)) for row, k in system.switched.items()},
    )  # fmt: skip


def _solution(system: System, graph: SeriesGraph, state: list[int], kept: list[int]) -> Solution:
    """Accelerations and multipliers of the constraints that are solved with, from `solve`."""
    right = [graph.unknown("right", i) for i in range(system.nv)]
    held = [graph.number(0.0)] * system.m
    for i, k in enumerate(kept):
        held[k] = graph.unknown("right", system.nv + i)
    n, m = system.nv, system.m
    wanted = {*range(n), *(n + k for k in kept), *range(n + m, n + m + len(kept))}
    found = _outputs(system, graph, "solve", [*state, *right, *held].__getitem__, wanted)
    unknowns = [*range(n), *(n + k for k in kept)]
    ratios = [found[n + m + i] for i in range(len(kept))]
    return Solution([found[i] for i in unknowns], [x for x in ratios if x != graph.number(1.0)])


def _jacobian(
    system: System, graph: SeriesGraph, state: Callable[[int], int], kept: list[int]
) -> dict[tuple[int, int], int]:
    """The entries of G by their places, in the rows of the constraints that are solved with."""
    number = {k: i for i, k in enumerate(kept)}
    found = _outputs(system, graph, "constraint_jacobian", state)
    places = {divmod(i, system.nv): node for i, node in found.items()}
    return {(number[row], column): node for (row, column), node in places.items() if row in number}


def _after(values, skipped: int):
    for _ in range(skipped):
        next(values)
    return values


def _power(system: System, graph: SeriesGraph, state, a: list[int], multipliers: list[int]) -> int:
    """The power as `rhs` computes it, with the accelerations and multipliers that it solves for taken as given."""
    first = system.nq
    solved = {first + i: node for i, node in enumerate(a)}
    solved |= {system.ny + i: node for i, node in enumerate(multipliers)}
    given = {
        node: graph.neg(solved[index]) if negative else solved[index]
        for index, (node, negative) in named_outputs(system.form("rhs")).items()
        if index in solved
    }
    index = system.nq + system.nv
    return _outputs(system, graph, "rhs", state, {index}, given)[index]
