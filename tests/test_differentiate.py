"""Derivatives on the graph against the complex step: forward, reverse, Jacobians, Hessian."""

from __future__ import annotations

import math
import time

import pytest
from hypothesis import assume, given, settings
from random_expressions import (
    COMPLEX,
    OPERATIONS,
    STEP,
    VARIABLES,
    Direct,
    evaluate,
    follow,
    on_graph,
    points,
    recipes,
)

from symgen.derive.graph.differentiate import finite_at_roots, forward, jacobian, reverse
from symgen.derive.graph.elimination import eliminated_jacobian
from symgen.derive.graph.evaluate import evaluate as graph_values
from symgen.derive.graph.graph import Graph
from symgen.derive.graph.hessian import hessian, mixed_hessian
from symgen.derive.graph.nodes import PARAM, Q, V

ALL = Q | V | PARAM


def complex_step(function, point, k):
    """Derivatives of all values of `function` by component k, exact to rounding."""
    moved = list(point)
    moved[k] = complex(moved[k], STEP)
    return [complex(x).imag / STEP for x in function(moved)]


def tame(values) -> bool:
    return all(math.isfinite(abs(x)) and abs(x) < 1e5 for x in values)


def close(actual, expected):
    scale = max(1.0, *(abs(x) for x in expected))
    return actual == pytest.approx(expected, rel=1e-8, abs=1e-8 * scale)


@pytest.mark.parametrize("x", [-2.0, 0.0, 2.0])
def test_sign_and_select_do_not_move(x):
    g = Graph()
    a = g.var(Q, 0)
    assert forward(g, [g.sign(a)], {a: g.one}) == [g.zero]
    bend = g.select(a, g.one, g.mul(a, a), g.mul(g.const(3.0), a))
    assert evaluate(g, forward(g, [bend], {a: g.one}), {a: x}) == [3.0 if x >= 1.0 else 2.0 * x]


@given(recipes, points)
@settings(max_examples=80, deadline=None, derandomize=True)
def test_random_expressions(recipe, point):
    """Forward and reverse sweeps, Jacobians by columns and by elimination, against the complex step."""
    g, variables, nodes = on_graph(recipe)
    outputs = nodes[-3:]
    at = dict(zip(variables, point, strict=True))
    assume(tame(follow(recipe, Direct(math), point)))
    matrix = jacobian(g, outputs, variables)
    eliminated = eliminated_jacobian(g, outputs, variables)
    gradient = reverse(g, [(n, g.const(w)) for n, w in zip(outputs, (1.0, -2.0, 0.5), strict=True)], ALL)
    for k, x in enumerate(variables):
        expected = complex_step(lambda p: follow(recipe, Direct(COMPLEX), p)[-3:], point, k)
        assume(tame(expected))
        assert close(evaluate(g, forward(g, outputs, {x: g.one}), at), expected)
        assert close(evaluate(g, [row[k] for row in matrix], at), expected)
        assert close(evaluate(g, [row.get(k, g.zero) for row in eliminated], at), expected)
        weighted = expected[0] - 2.0 * expected[1] + 0.5 * expected[2]
        scale = max(1.0, *map(abs, expected))
        assert evaluate(g, [gradient.get(x, g.zero)], at) == [
            pytest.approx(weighted, rel=1e-8, abs=1e-8 * scale)
        ]


@given(recipes, points)
@settings(max_examples=80, deadline=None, derandomize=True)
def test_hessian_of_random_expressions(recipe, point):
    assume(tame(follow(recipe, Direct(math), point)))
    check_hessian(lambda g, variables: follow(recipe, g, variables)[-1], point)


def check_hessian(build, point):
    """Compare with the complex step through the reverse sweep's gradient."""
    g = Graph()
    variables = [g.var(*v) for v in VARIABLES]
    output = build(g, variables)
    wanted = variables[:4]
    matrix = hessian(g, output, wanted)
    gradient = reverse(g, [(output, g.one)], ALL)
    rows = [gradient.get(x, g.zero) for x in wanted]

    def slopes(p):
        return evaluate(g, rows, dict(zip(variables, p, strict=True)), COMPLEX)

    at = dict(zip(variables, point, strict=True))
    for k in range(len(wanted)):
        expected = complex_step(slopes, point, k)
        assert close(evaluate(g, [row[k] for row in matrix], at), expected), f"column {k}"
        assert [row[k] for row in matrix] == matrix[k], "not symmetric"


@given(recipes, points)
@settings(max_examples=80, deadline=None, derandomize=True)
def test_mixed_hessian_of_random_expressions(recipe, point):
    assume(tame(follow(recipe, Direct(math), point)))
    check_mixed_hessian(lambda g, variables: follow(recipe, g, variables)[-1], point)


def check_mixed_hessian(build, point):
    """Derivatives by v, then by q and the parameter, with the complex step through the reverse sweep's gradient."""
    g = Graph()
    variables = [g.var(*v) for v in VARIABLES]
    rows, columns = variables[2:4], [*variables[:2], variables[4]]
    output = build(g, variables)
    matrix = mixed_hessian(g, output, rows, columns)
    gradient = reverse(g, [(output, g.one)], V)
    slopes = [gradient.get(x, g.zero) for x in rows]
    at = dict(zip(variables, point, strict=True))

    def along(p):
        return evaluate(g, slopes, dict(zip(variables, p, strict=True)), COMPLEX)

    for k, x in enumerate(columns):
        expected = complex_step(along, point, variables.index(x))
        assert close(evaluate(g, [row.get(k, g.zero) for row in matrix], at), expected), f"column {k}"


POINT = [-0.4, -0.7, 0.6, -0.3, 0.5]


@pytest.mark.parametrize("operation", sorted(OPERATIONS))
def test_hessian_of_each_operation(operation):
    recipe = [("mul", 5, 6, 0, 0), (operation, 0, 4, 6, 7)]
    check_hessian(lambda g, variables: follow(recipe, g, variables)[-1], POINT)


# Cases in which folding or sign rules make the local derivative pass through an operand.
TRAPS = {
    "same node twice": lambda g, q: g.power(g.add(g.mul(q[0], q[1]), g.mul(q[0], q[1])), 3.0),
    "sum of equal nodes, squared": lambda g, q: g.mul(g.add(q[2], q[2]), g.add(q[2], q[2])),
    "pow of one node": lambda g, q: g.pow(g.mul(q[2], q[2]), g.mul(q[2], q[2])),
    "atan2 of one node": lambda g, q: g.mul(q[1], g.call("atan2", g.mul(q[0], q[0]), g.mul(q[0], q[0]))),
    "atan2 on the unit circle": lambda g, q: g.power(
        g.call("atan2", g.call("sin", q[0]), g.call("cos", q[0])), 2.0
    ),
    "atan2 of a negative": lambda g, q: g.call("atan2", g.neg(q[0]), q[1]),
    "atan2 over a negative": lambda g, q: g.call("atan2", q[1], g.neg(g.mul(q[0], q[0]))),
    "log of a negative": lambda g, q: g.call("log", g.neg(g.mul(q[0], q[2]))),
    "acos of a negative": lambda g, q: g.call("acos", g.neg(g.mul(q[0], q[2]))),
    "power of a negative": lambda g, q: g.power(g.neg(q[0]), 2.3),
    "negative exponent": lambda g, q: g.pow(q[2], g.neg(g.mul(q[1], q[2]))),
    "exponent minus one": lambda g, q: g.pow(q[2], g.sub(g.one, q[2])),
    "quotient of quotients": lambda g, q: g.div(g.div(q[0], q[1]), g.div(q[1], q[2])),
    "quotient of a quotient and its top": lambda g, q: g.div(g.mul(q[0], g.div(q[0], q[1])), q[1]),
    "select by a variable": lambda g, q: g.mul(q[0], g.select(q[0], q[2], g.mul(q[0], q[1]), q[3])),
    "square root": lambda g, q: g.call("sqrt", g.sub(g.one, g.mul(q[2], g.mul(q[0], q[0])))),
}


@pytest.mark.parametrize("name", sorted(TRAPS))
def test_hessian_traps(name):
    check_hessian(TRAPS[name], POINT)


@pytest.mark.parametrize("name", sorted(TRAPS))
def test_mixed_hessian_traps(name):
    check_mixed_hessian(TRAPS[name], POINT)


def test_mixed_hessian_pushes_chains_down_together():
    """Σ u_k(v) a_k(q) along two chains beside each other: a few operations for each of the n² derivatives."""
    g, n = Graph(), 30
    q, v = [g.var(Q, k) for k in range(n)], [g.var(V, k) for k in range(n)]
    angle, a, u, power = g.zero, g.zero, g.zero, g.zero
    for x, w in zip(q, v, strict=True):
        angle = g.add(angle, x)
        a = g.add(a, g.call("sin", angle))
        u = g.add(u, g.mul(g.call("cos", angle), w))
        power = g.add(power, g.mul(a, u))
    matrix = mixed_hessian(g, power, v, q)
    assert sum(map(len, matrix)) == n * n
    assert g.count([x for row in matrix for x in row.values()]) < 5 * n * n


def test_reverse_adds_seeds_of_one_output():
    g = Graph()
    x = g.var(Q, 0)
    node = g.call("sin", x)
    twice = reverse(g, [(node, g.one), (node, g.one), (x, g.const(3.0))], Q)[x]
    assert evaluate(g, [twice], {x: 0.3})[0] == pytest.approx(2.0 * math.cos(0.3) + 3.0, rel=1e-15)


def test_reverse_looks_only_at_the_kinds_asked_for():
    g = Graph()
    q, v = g.var(Q, 0), g.var(V, 0)
    result = reverse(g, [(g.mul(g.call("sin", q), v), g.one)], V)
    assert result == {v: g.call("sin", q)}


def test_jacobian_takes_the_cheaper_direction():
    g = Graph()
    q = [g.var(Q, k) for k in range(12)]
    product = g.one
    for x in q:
        product = g.mul(product, g.call("sin", x))
    wide = jacobian(g, [product], q)  # one output of many inputs: reverse
    assert g.count([product, *wide[0]]) < 12 * 6
    tall = [g.call("cos", g.mul(g.const(k + 1.0), product)) for k in range(12)]
    column = jacobian(g, tall, q[:1])
    assert (
        g.count([*tall, *(row[0] for row in column)]) < 12 * 10
    )  # by rows: 12 reverse sweeps over the product


def deep(g: Graph, x: int, depth: int) -> int:
    """Every level uses the one below twice: 2^depth paths, 3·depth operations."""
    for _ in range(depth):
        x = g.call("sin", g.add(g.mul(x, x), g.mul(g.const(0.5), x)))
    return x


def test_shared_depth_is_differentiated_once():
    g = Graph()
    x, y = g.var(Q, 0), g.var(Q, 1)
    node = deep(g, g.add(x, g.mul(x, y)), 60)
    matrix = jacobian(g, [node], [x, y])
    second = hessian(g, node, [x, y])
    assert g.count([node, *matrix[0], *second[0], *second[1]]) < 60 * 40
    z = g.var(V, 0)
    mixed = mixed_hessian(g, deep(g, g.add(node, z), 60), [z], [x, y])
    assert g.count(mixed[0].values()) < 60 * 80
    at = {x: 0.7, y: 0.4}

    def plain(p):
        z = p[0] + p[0] * p[1]
        for _ in range(60):
            z = COMPLEX.sin(z * z + 0.5 * z)
        return [z]

    for k in range(2):
        assert close(evaluate(g, [matrix[0][k]], at), complex_step(plain, [0.7, 0.4], k))


def sweeps(length: int) -> tuple[int, float]:
    """Nodes made and CPU seconds used by forward, reverse and Hessian on a chain of `length` levels."""
    g = Graph()
    x = g.var(Q, 0)
    node = deep(g, x, length)
    start = time.process_time()
    forward(g, [node], {x: g.one})
    reverse(g, [(node, g.one)], Q)
    hessian(g, node, [x])
    return len(g.op), time.process_time() - start


def test_sweeps_are_linear():
    small, quick = sweeps(800)
    large, slow = sweeps(8_000)
    assert large < 10.1 * small
    assert slow < 40 * quick + 1.0


def test_long_chains_are_differentiated_without_recursion():
    g = Graph()
    x = g.var(Q, 0)
    node = deep(g, x, 25_000)  # 100 000 operations
    assert forward(g, [node], {x: g.one})[0] != g.zero
    assert reverse(g, [(node, g.one)], Q)[x] != g.zero
    assert mixed_hessian(g, g.mul(node, g.var(V, 0)), [g.var(V, 0)], [x])[0][0] != g.zero


# Powers where their base is 0: the value, the first and the second derivative by x, at x and y = 0.
_EDGES = {
    "max(0, -x)^1.5": (lambda g, x, y: g.power(below(g, x), 1.5), (0.0, 0.0, 0.0)),
    "max(0, -x)^1.3": (lambda g, x, y: g.power(below(g, x), 1.3), (0.0, 0.0, 0.0)),
    "max(0, -x)^p": (lambda g, x, y: g.pow(below(g, x), g.var(PARAM, 0)), (0.0, 0.0, 0.0)),
    "(3*max(0, -x))^0.7": (lambda g, x, y: g.power(g.mul(g.const(3.0), below(g, x)), 0.7), (0.0, 0.0, 0.0)),
    "sqrt(max(0, -x))": (lambda g, x, y: g.call("sqrt", below(g, x)), (0.0, 0.0, 0.0)),
    "abs(x)^1.5": (lambda g, x, y: g.power(g.call("fabs", x), 1.5), (0.0, 0.0, None)),
    "abs(x)^2.5": (lambda g, x, y: g.power(g.call("fabs", x), 2.5), (0.0, 0.0, 0.0)),
    "x*sqrt(x)": (lambda g, x, y: g.mul(x, g.call("sqrt", x)), (0.0, 0.0, None)),
    "x^2.5": (lambda g, x, y: g.power(x, 2.5), (0.0, 0.0, 0.0)),
    "sqrt(x)^2": (lambda g, x, y: g.power(g.call("sqrt", x), 2), (0.0, 1.0, 0.0)),
    "sqrt(x)^3": (lambda g, x, y: g.power(g.call("sqrt", x), 3), (0.0, 0.0, None)),
    "sqrt(x)^4": (lambda g, x, y: g.power(g.call("sqrt", x), 4), (0.0, 0.0, 2.0)),
    "sqrt(x^2 + y^2)^2": (lambda g, x, y: g.power(length(g, x, y), 2), (0.0, 0.0, 2.0)),
    "sqrt(x^2 + y^2)^3": (lambda g, x, y: g.power(length(g, x, y), 3), (0.0, 0.0, 0.0)),
}


def below(g, x):
    return g.maximum(g.zero, g.neg(x))


def length(g, x, y):
    return g.call("sqrt", g.add(g.mul(x, x), g.mul(y, y)))


def second(g, output, x, y):
    """The second derivative by way of rows, of columns and of edges."""
    by_x = jacobian(g, [output], [x, y])[0][0]
    with finite_at_roots(g, [by_x]):
        return [jacobian(g, [by_x], [x, y])[0][0], forward(g, [by_x], {x: g.one})[0]]


@pytest.mark.parametrize("name", _EDGES)
@pytest.mark.parametrize("at", [-0.3, 0.0, 0.2])
def test_powers_have_the_derivatives_that_exist_at_zero(name, at):
    build, (value, slope, bend) = _EDGES[name]
    g = Graph()
    x, y = g.var(Q, 0), g.var(Q, 1)
    output = build(g, x, y)
    point = {x: at, y: 0.0, g.var(PARAM, 0): 1.5}
    firsts = [forward(g, [output], {x: g.one})[0], reverse(g, [(output, g.one)], Q)[x]]
    firsts.append(eliminated_jacobian(g, [output], [x])[0][0])
    seconds = [*second(g, output, x, y), hessian(g, output, [x, y])[0][0]]
    values = [float(k) for k in graph_values(g, [output, *firsts, *seconds], point)]
    assert values[3] == values[2] or math.isnan(values[2])
    found = values[:3] + values[4:]
    if at:  # away from 0: against differences, where there is a value at all
        h = 1e-4
        near = [float(graph_values(g, [output], point | {x: at + k * h})[0]) for k in (-1, 0, 1)]
        if math.isfinite(near[1]):
            assert found[1:3] == pytest.approx([(near[2] - near[0]) / (2 * h)] * 2, abs=1e-6)
            assert found[3:] == pytest.approx([(near[2] - 2 * near[1] + near[0]) / h**2] * 3, abs=1e-5)
        return
    assert found[:3] == [value, slope, slope]
    if bend is not None:
        # Where nothing is left of r = |x|, its second derivative is not asked for by edges of a potential energy.
        assert found[3:] == [bend] * 3 if "y^2)^3" not in name else found[3:5] == [bend] * 2


def test_elimination_differentiates_what_is_narrow_by_itself():
    """Forces that each follow from three numbers that many inputs make: swept, they are differentiated by all."""
    g, n = Graph(), 12
    q = [g.var(Q, k) for k in range(n)]
    outputs = [g.zero] * n
    for place in range(40):
        x, y, z = (
            g.sum(g.mul(g.const(0.1 * (((k + 1) * (3 * place + m + 2)) % 127)), v) for k, v in enumerate(q))
            for m in range(3)
        )
        x, y, z = g.call("sin", x), g.call("cos", y), g.call("tanh", z)
        force = deep(g, g.add(g.mul(x, y), g.mul(y, g.mul(z, z))), 20)
        for k in range(n):
            outputs[k] = g.add(outputs[k], g.mul(force, g.const(1.0 + (k + place) % 5)))
    eliminated, swept = eliminated_jacobian(g, outputs, q), jacobian(g, outputs, q)

    def cost(rows):
        return g.count([*outputs, *(x for row in rows for x in row)])

    assert 3 * cost([row.values() for row in eliminated]) < 2 * cost(swept)
    at = {v: 0.05 * k - 0.2 for k, v in enumerate(q)}
    found = numbers(g, [x for row in eliminated for x in row.values()], at)
    assert found == pytest.approx(numbers(g, [x for row in swept for x in row], at), rel=1e-9)


# Choices whose other side has no finite derivative at x = y = 0; with the derivatives by x and y there.
_CHOICES = {
    "friction": (
        lambda g, x, y: chosen(g, x, y, g.div(x, length(g, x, y)), g.mul(g.const(3.0), x)),
        (3.0, 0.0),
    ),
    "times what moves": (
        lambda g, x, y: g.mul(chosen(g, x, y, length(g, x, y), y), g.add(g.call("cos", x), y)),
        (0.0, 1.0),
    ),
    "in another": (
        lambda g, x, y: chosen(
            g, x, y, g.call("log", length(g, x, y)), chosen(g, y, x, g.div(y, length(g, x, y)), g.sub(y, x))
        ),
        (-1.0, 1.0),
    ),
    "of what is below both": (
        lambda g, x, y: chosen(
            g, x, y, g.div(g.call("sin", x), length(g, x, y)), g.mul(g.call("sin", x), g.call("exp", y))
        ),
        (1.0, 0.0),
    ),
}


def numbers(g, nodes, at):
    return [float(x) for x in graph_values(g, nodes, at)]


def chosen(g, x, y, far, near):
    return g.select(g.const(1e-6), g.add(g.mul(x, x), g.mul(y, y)), far, near)


@pytest.mark.parametrize("name", _CHOICES)
def test_what_a_choice_leaves_out_may_have_no_derivative(name):
    build, slopes = _CHOICES[name]
    g = Graph()
    x, y = g.var(Q, 0), g.var(Q, 1)
    output = build(g, x, y)
    (row,) = eliminated_jacobian(g, [output], [x, y])
    (swept,) = jacobian(g, [output], [x, y])
    wanted = [row.get(0, g.zero), row.get(1, g.zero)]
    assert numbers(g, wanted, {x: 0.0, y: 0.0}) == list(slopes)
    for at in ({x: 0.3, y: -0.2}, {x: 0.3, y: 0.4}, {x: 1e-4, y: 2e-4}):
        assert numbers(g, wanted, at) == pytest.approx(numbers(g, swept, at), rel=1e-12)


def test_elimination_of_many_choices_is_linear():
    def nodes(n: int) -> int:
        g = Graph()
        x, y = g.var(Q, 0), g.var(Q, 1)
        node = x
        for k in range(n):
            z = g.add(node, g.mul(g.const(1.0 + k), y))
            node = g.add(node, chosen(g, z, node, g.div(z, length(g, z, node)), z))
        eliminated_jacobian(g, [node], [x, y])
        return len(g.op)

    assert nodes(32) < 2.5 * nodes(16)
