"""Every elementary function of the table: value, derivative, series, machine code, and what models may call."""

from __future__ import annotations

import ctypes
import inspect
import math

import mpmath
import numpy as np
import pytest
import sympy
from random_expressions import evaluate
from test_taylor_series import EMITTERS, ORDER, coefficients, with_force

import symgen
from symgen.derive.graph.differentiate import forward, reverse
from symgen.derive.graph.evaluate import evaluate as evaluate_arrays
from symgen.derive.graph.graph import Graph
from symgen.derive.graph.kinds import Q
from symgen.derive.load import Loader
from symgen.model.expressions import parse
from symgen.model.functions import CLASSES
from symgen.runtime.code import compiler, engine
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.modules import lower_function
from symgen.runtime.graph.functions import ENTRIES, IN_CODE, IN_MODELS, Arithmetic, slopes
from symgen.runtime.linear.duals import _MATHEMATICS, Dual

POINTS = (0.31, -0.72, 0.94)
SMOOTH = sorted(name for name, entry in IN_CODE.items() if entry.smooth)


def arguments(name: str) -> list[tuple[float, ...]]:
    """Points inside a function's domain."""
    entry = IN_CODE[name]
    inside = [x for x in POINTS if entry.domain[0] < x < entry.domain[1]]
    if name == "pow":  # of what is positive
        return [(x, y) for x in (0.31, 1.7) for y in POINTS]
    return [(x,) if entry.arity[0] == 1 else (x, 0.5 - x) for x in inside]


def exact(name: str, args) -> mpmath.mpf:
    """The function in high precision."""
    own = {"pow": mpmath.power, "copysign": lambda x, y: abs(x) * mpmath.sign(y)}
    return (own.get(name) or getattr(mpmath, name))(*args)


def cases(names):
    return [(name, at) for name in names for at in arguments(name)]


@pytest.mark.parametrize("name, at", cases(sorted(IN_CODE)))
def test_value_is_that_of_other_arithmetics(name, at):
    g = Graph()
    variables = [g.var(Q, k) for k in range(len(at))]
    node = g.call(name, *variables)
    values = dict(zip(variables, at, strict=True))
    expected = float(exact(name, at))
    assert IN_CODE[name].value(*at) == pytest.approx(expected, rel=1e-14)
    (on_arrays,) = evaluate_arrays(g, [node], {v: np.array([x]) for v, x in values.items()})
    assert on_arrays == pytest.approx(expected, rel=1e-14)
    assert g.value(g.call(name, *map(g.const, at))) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("name, at", cases(sorted(IN_CODE)))
def test_machine_code_is_the_value(name, at):
    listed = ", ".join(f"y[{k}]" for k in range(len(at)))
    text = f"def rhs(t, y, p, out):\n    out[0] = {name}({listed})\n"
    ir = lower_function(FunctionText("rhs", text, Lengths(len(at), 0, 1)), "kernel").ir
    code = engine.MachineCode()
    kernel = ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 3)(
        code.add(compiler.compile_ir(ir), "kernel")
    )
    y, out = np.array(at), np.zeros(1)
    kernel(0.0, y.ctypes.data, 0, out.ctypes.data)
    assert out[0] == pytest.approx(IN_CODE[name].value(*at), rel=1e-15)


@pytest.mark.parametrize("name, at", cases(sorted(set(IN_CODE) - {"copysign"})))
def test_derivatives_on_graph_and_of_duals(name, at):
    """Against differences in 40 digits."""
    g = Graph()
    variables = [g.var(Q, k) for k in range(len(at))]
    node = g.call(name, *variables)
    values = dict(zip(variables, at, strict=True))
    adjoint = reverse(g, [(node, g.one)], Q)
    for k, variable in enumerate(variables):
        with mpmath.workdps(40):
            expected = float(mpmath.diff(lambda x, k=k: exact(name, [*at[:k], x, *at[k + 1 :]]), at[k]))
        derivatives = [forward(g, [node], {variable: g.one})[0], adjoint[variable]]
        assert evaluate(g, derivatives, values) == pytest.approx([expected] * 2, rel=1e-13)
        seeded = [Dual(x, np.array([float(i == k), 0.0])) for i, x in enumerate(at)]
        slope = _MATHEMATICS[name](*seeded).slope
        np.testing.assert_allclose(slope, [expected, 0.0], rtol=1e-13)


@pytest.mark.parametrize("emitter", EMITTERS)
@pytest.mark.parametrize("name", SMOOTH)
def test_series_of_every_smooth_function(name, emitter):
    """x'' = f(c + 0.3 t): coefficient k of the rate is that of f divided by k + 1."""
    at = arguments(name)[0]
    listed = ", ".join(f"{x!r} + 0.3*t" for x in at)
    rows, _ = coefficients(with_force(f"{name}({listed})"), 0.0, np.zeros(3), emitter)
    with mpmath.workdps(60):
        exactly = mpmath.taylor(lambda t: exact(name, [x + mpmath.mpf(0.3) * t for x in at]), 0, ORDER - 2)
    expected = np.array([float(c) / (k + 1) for k, c in enumerate(exactly)])
    np.testing.assert_allclose(rows[1:ORDER, 1], expected, rtol=1e-11, atol=1e-14 * np.abs(expected).max())


def test_what_has_no_derivative_raises_by_name():
    with pytest.raises(LookupError, match="'gamma'"):
        slopes(Graph(), "gamma", (0,), 0)


@pytest.mark.parametrize("name", sorted(IN_MODELS))
def test_models_can_call_it(name):
    entry = IN_MODELS[name]
    n = entry.arity[0]
    listed = ", ".join("xyz"[:n])
    expression = parse(f"{name}({listed})").expression
    g = Graph()
    symbols = {letter: g.var(Q, k) for k, letter in enumerate("xyz"[:n])}
    node = Loader(g, symbols, {}).load(expression)
    at = (arguments(entry.code) if entry.code else [(0.4, -0.3)[:n]])[0]
    values = dict(zip(symbols.values(), at, strict=True))
    assert evaluate(g, [node], values)[0] == pytest.approx(entry.value(*at), rel=1e-14)
    constant = parse(f"{name}({', '.join(map(repr, at))})").expression
    assert float(constant) == pytest.approx(entry.value(*at), rel=1e-14)


def test_python_users_find_every_function():
    own = {"min": "minimum", "max": "maximum", "abs": None}
    for name in IN_MODELS:
        exported = own.get(name, name)
        if exported is not None:
            assert exported in symgen.__all__
            assert getattr(symgen, exported) is (sympy.sqrt if name == "sqrt" else CLASSES[name])


def test_entries_are_whole():
    for entry in ENTRIES:
        assert entry.name or entry.code
        assert bool(entry.code) == bool(entry.llvm)
        assert entry.code or entry.build
        assert not entry.code or entry.value is getattr(math, entry.code)
    assert {name for name, _ in inspect.getmembers(Arithmetic, inspect.isfunction)} >= {
        "const",
        "call",
        "sign",
    }
