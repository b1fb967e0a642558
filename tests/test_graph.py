"""The operation graph: equal operations are one node, folding keeps values, substitution rebuilds."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import assume, given, settings
from random_expressions import OPERATIONS, Direct, evaluate, follow, on_graph, points, recipes

from symgen.derive.graph.graph import FEWEST_KEPT, MOST_KEPT, Graph
from symgen.derive.graph.nodes import PARAM, FoldingError, Q, V
from symgen.runtime.graph.functions import IN_CODE


@pytest.fixture
def g() -> Graph:
    return Graph()


@given(recipes, points)
@settings(max_examples=200, deadline=None, derandomize=True)
def test_every_node_has_the_value_of_the_expression_it_was_built_from(recipe, point):
    g, variables, nodes = on_graph(recipe)
    expected = follow(recipe, Direct(math), point)
    assume(all(abs(x) < 1e6 for x in expected))
    scale = max(1.0, *(abs(x) for x in expected))
    actual = evaluate(g, nodes, dict(zip(variables, point, strict=True)))
    assert actual == pytest.approx(expected, rel=1e-9, abs=1e-9 * scale)


@pytest.mark.parametrize("operation", sorted(OPERATIONS))
def test_each_operation_folds_to_the_same_number(operation):
    recipe = [(operation, 0, 1, 2, 1)]  # on the constants alone
    g, _, nodes = on_graph(recipe)
    assert g.value(nodes[-1]) == pytest.approx(follow(recipe, Direct(math), [0.0] * 5)[-1], rel=1e-14)


@given(recipes)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_graph_invariants(recipe):
    g, _, _ = on_graph(recipe)
    keys = set(zip(g.op, g.args, strict=True))
    assert len(keys) == len(g.op), "a node is stored twice"
    for node, (op, args) in enumerate(zip(g.op, g.args, strict=True)):
        if op in ("const", "var"):
            continue
        assert all(x < node for x in args), "numeric order must be topological"
        mask = 0
        for x in args:
            mask |= g.mask[x]
        assert g.mask[node] == mask
        assert any(g.value(x) is None for x in args), f"{op} of constants was not folded"
        if op in ("mul", "div", "sub", "neg"):
            assert not any(g.op[x] == "neg" for x in args), "signs move outwards"


def test_equal_expressions_are_one_node(g):
    x, y = g.var(Q, 0), g.var(V, 0)
    assert g.add(x, y) == g.add(y, x)
    assert g.mul(x, y) == g.mul(y, x)
    assert g.sub(x, y) == g.neg(g.sub(y, x))
    assert g.mul(g.neg(x), y) == g.neg(g.mul(x, y))
    assert g.mul(g.neg(x), g.neg(y)) == g.mul(x, y)
    assert g.div(g.neg(x), y) == g.neg(g.div(x, y)) == g.div(x, g.neg(y))
    assert g.call("sin", g.neg(x)) == g.neg(g.call("sin", x))
    assert g.call("cos", g.neg(x)) == g.call("cos", x)
    assert g.mul(g.const(2.0), g.mul(g.const(3.0), x)) == g.mul(g.const(6.0), x)
    assert g.add(x, g.neg(y)) == g.sub(x, y)
    assert g.var(Q, 0) == x != g.var(V, 0) + 1


def test_neutral_elements_disappear(g):
    x = g.var(Q, 0)
    assert g.add(x, g.zero) == g.mul(x, g.one) == g.div(x, g.one) == g.sub(x, g.zero) == x
    assert g.mul(x, g.zero) == g.sub(x, x) == g.div(g.zero, x) == g.zero
    assert g.div(x, x) == g.power(x, 0.0) == g.one
    assert g.neg(g.neg(x)) == x
    assert g.const(-0.0) == g.zero
    assert math.copysign(1.0, g.value(g.const(-0.0))) == 1.0


@pytest.mark.parametrize("first", ["sin", "cos"])
@pytest.mark.parametrize("factor", ["one", "number", "parameter"])
@pytest.mark.parametrize("nested", [False, True])
def test_sine_and_cosine_squares_make_their_factor(g, first, factor, nested):
    second = "cos" if first == "sin" else "sin"
    k = {"one": g.one, "number": g.const(2.5), "parameter": g.var(PARAM, 0)}[factor]
    x, rest = g.var(Q, 0), g.var(Q, 1)
    terms = [g.mul(k, g.mul(g.call(f, x), g.call(f, x))) for f in (first, second)]
    if nested:
        assert g.add(g.add(terms[0], rest), terms[1]) == g.add(rest, k)
    else:
        assert g.add(*terms) == k


def test_unit_circle_needs_equal_factors_and_arguments(g):
    x, y, k = g.var(Q, 0), g.var(Q, 1), g.var(PARAM, 0)
    s2, c2 = (g.mul(g.call(f, x), g.call(f, x)) for f in ("sin", "cos"))
    other = g.mul(g.call("cos", y), g.call("cos", y))
    for a, b in (
        (s2, other),
        (s2, s2),
        (g.mul(k, s2), c2),
        (g.mul(g.const(2.0), s2), g.mul(g.const(3.0), c2)),
    ):
        assert g.op[g.add(a, b)] == "add" or g.add(a, b) == g.mul(g.const(2.0), a)


@pytest.mark.parametrize(
    "build",
    [
        lambda g: g.div(g.one, g.zero),
        lambda g: g.power(g.zero, -1.0),
        lambda g: g.call("sqrt", g.const(-1.0)),
        lambda g: g.call("log", g.zero),
        lambda g: g.call("asin", g.const(2.0)),
        lambda g: g.call("exp", g.const(1e4)),
        lambda g: g.pow(g.const(-2.0), g.const(0.5)),
        lambda g: g.pow(g.zero, g.const(-1.0)),
        lambda g: g.mul(g.const(1e300), g.const(1e300)),
        lambda g: g.const(math.inf),
        lambda g: g.const(math.nan),
    ],
)
def test_constants_without_a_value_are_refused(g, build):
    with pytest.raises(FoldingError):
        build(g)


@pytest.mark.parametrize("exponent", [-3.0, -1.5, 0.5, 1.0, 2.0, 2.5, 5.0, 63.0, 64.0, 65.0, 1 / 3])
def test_constant_powers(g, exponent):
    x = g.var(Q, 0)
    value = evaluate(g, [g.power(x, exponent)], {x: 1.07})[0]
    assert value == pytest.approx(1.07**exponent, rel=1e-13)
    assert g.count([g.power(x, exponent)]) <= 14


@pytest.mark.parametrize("x, expected", [(-3.0, -1.0), (0.0, 0.0), (2.0, 1.0)])
def test_sign(g, x, expected):
    a = g.var(Q, 0)
    assert evaluate(g, [g.sign(a)], {a: x}) == [expected]


@given(recipes, points, points)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_substitute_is_evaluation_at_other_values(recipe, point, other):
    g, variables, nodes = on_graph(recipe)
    moved = {x: g.add(g.mul(g.const(0.5), x), g.const(c)) for x, c in zip(variables[:2], other, strict=False)}
    new = g.substitute(nodes, moved)
    values = dict(zip(variables, point, strict=True))
    at = {**values, **{x: 0.5 * values[x] + c for x, c in zip(variables[:2], other, strict=False)}}
    expected = follow(recipe, Direct(math), list(at.values()))
    assume(all(abs(x) < 1e6 for x in expected))
    scale = max(1.0, *(abs(x) for x in expected))
    assert evaluate(g, new, values) == pytest.approx(expected, rel=1e-8, abs=1e-8 * scale)


def test_substitute_leaves_the_rest_alone(g):
    x, y = g.var(Q, 0), g.var(Q, 1)
    f = g.add(g.call("sin", x), g.mul(y, y))
    kept, changed = g.substitute([g.mul(y, y), f], {x: g.zero})
    assert kept == changed == g.mul(y, y)


@pytest.mark.parametrize("name", sorted(IN_CODE))
def test_rebuild_makes_the_same_node(g, name):
    node = g.call(name, *(g.var(Q, k) for k in range(IN_CODE[name].arity[0])))
    assert g.rebuild(node, list(g.operands(node))) == node


@given(recipes)
@settings(max_examples=30, deadline=None, derandomize=True)
def test_building_twice_gives_the_same_graph(recipe):
    first, _, nodes = on_graph(recipe)
    second, _, again = on_graph(recipe)
    assert (first.op, first.args, first.mask, nodes) == (second.op, second.args, second.mask, again)


def test_long_chains_are_walked_without_recursion(g):
    x = g.var(Q, 0)
    node = x
    for k in range(100_000):
        node = g.add(g.mul(node, node), x) if k % 2 else g.call("sin", node)
    assert g.count([node]) == 150_000
    replaced = g.substitute([node], {x: g.var(Q, 1)})
    assert g.count(replaced) == 150_000


def test_what_is_below_outputs_is_kept_apart_from_what_is_handed_out():
    g = Graph()
    x = [g.var(Q, k) for k in range(2 * FEWEST_KEPT)]
    outputs = [g.mul(a, b) for a, b in pairwise(x)]
    first = g.reachable(outputs)
    first.clear()
    g.mul(x[0], x[5])  # the graph grows meanwhile
    again = g.reachable(iter(outputs))
    assert again == sorted({*x, *outputs})
    assert g.reachable(outputs, met=set(x)) == sorted(outputs)
    for k in range(MOST_KEPT + 2):
        g.reachable([*outputs, g.const(float(k))])
    assert len(g._reached) == MOST_KEPT
    assert g.reachable(outputs) == again


def test_products_of_roots_stay_powers_of_their_base():
    g = Graph()
    x = g.var(Q, 0)
    root = g.call("sqrt", x)
    for _ in range(2):  # the second time found, not made
        assert g.root_power(g.mul(x, root)) == (x, 1.5)
        assert g.root_power(g.mul(root, g.mul(x, x))) == (x, 2.5)
        assert g.root_power(g.mul(x, x)) is None
        assert g.root_power(g.mul(root, g.var(Q, 1))) is None
