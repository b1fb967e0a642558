"""Loading SymPy expressions: deep and shared ones, in time that grows with their parts and without recursion."""

from __future__ import annotations

import math

import pytest
import sympy
from derived import Generated, describe
from random_expressions import evaluate

from symgen.derive.graph.graph import Graph
from symgen.derive.graph.nodes import Q
from symgen.derive.load import Loader
from symgen.model.from_sympy import taken_over


def half_sum(a, b):
    """(a + b)/2 as it stands: SymPy would walk through deep arguments."""
    return sympy.Mul(sympy.S.Half, sympy.Add(a, b, evaluate=False), evaluate=False)


def sine(a):
    return sympy.sin(a, evaluate=False)


def test_shared_parts_are_loaded_once():
    """60 levels, each with the one below in two places: a tree of 2^60."""
    x = sympy.Symbol("x")
    deep, value = x, 0.3
    for _ in range(60):
        deep, value = half_sum(deep, sine(deep)), 0.5 * (value + math.sin(value))
    system = Generated(describe("shared", "x", {"m": 2.0}, kinetic="m/2*dot(x)**2", potential=deep))
    assert system("energy", 0.0, [0.3, 0.0])[1] == pytest.approx(value, rel=1e-13)
    assert system.model["operations"]["energy"] < 60 * 3 + 5
    assert system.model["operations"]["residual_jacobian"] < 60 * 15
    expected = -system.slope("energy", 0.0, [0.3, 0.0], [1.0, 0.0])[1]
    assert system("forces", 0.0, [0.3, 0.0])[0] == pytest.approx(expected, rel=1e-12)


def test_a_hundred_thousand_levels_are_loaded_without_recursion():
    g, symbol = Graph(), sympy.Symbol("x")
    x = g.var(Q, 0)
    loader = Loader(g, {"x": x}, {})
    deep, value = symbol, 0.3
    for _ in range(33_334):  # three levels each
        deep, value = half_sum(sine(deep), symbol), 0.5 * (math.sin(value) + 0.3)
    loaded = taken_over(deep)
    loader.count_terms([loaded])
    node = loader.load(loaded)
    assert len(g.op) > 100_000
    assert evaluate(g, [node], {x: 0.3})[0] == pytest.approx(value, rel=1e-14)


def test_prefixes_of_sums_are_shared():
    """x1, x1 + x2, x1 + x2 + x3, …: sums are flat, so nothing is shared there."""
    symbols = sympy.symbols("x1:21")
    g = Graph()
    loader = Loader(g, {s.name: g.var(Q, k) for k, s in enumerate(symbols)}, {})
    sums = [taken_over(sympy.Add(*symbols[: k + 1])) for k in range(20)]
    loader.count_terms(sums)
    assert g.count([loader.load(s) for s in sums]) == 19
