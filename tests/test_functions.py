"""Every elementary function of the table: value, derivative, series, machine code, and what models may call."""

from __future__ import annotations

import ctypes
import inspect
import itertools
import math
import re

import mpmath
import numba
import numpy as np
import pytest
import sympy
from random_expressions import evaluate
from test_taylor_series import EMITTERS, ORDER, coefficients, with_force

import symgen
from symgen.derive.graph.differentiate import forward, reverse, sparse_jacobian
from symgen.derive.graph.evaluate import evaluate as evaluate_arrays
from symgen.derive.graph.graph import Graph
from symgen.derive.graph.hessian import hessian
from symgen.derive.graph.nodes import Q
from symgen.derive.load import Loader
from symgen.link import derive_text
from symgen.model.evaluate import evaluate as evaluate_constant
from symgen.model.expressions import parse
from symgen.model.from_sympy import taken_over
from symgen.model.functions import CLASSES
from symgen.model.printing import to_text
from symgen.runtime.code import compiler, engine
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.modules import lower_function
from symgen.runtime.graph.functions import ENTRIES, IN_CODE, IN_MODELS, Arithmetic, slopes
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.linear.linearisation import _MATHEMATICS, Dual, derivatives

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
    own = {"pow": mpmath.power, "copysign": lambda x, y: abs(x) * mpmath.sign(y), "floor": mpmath.floor}
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
        derivatives = [forward(g, [node], {variable: g.one})[0], adjoint.get(variable, g.zero)]
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


def test_a_generated_floor_runs_in_python_and_in_numba():
    text = "def rhs(t, y, p, out):\n    out[0] = floor(y[0])\n"
    for decorate in (lambda f: f, numba.njit):
        function = FunctionText("rhs", text, Lengths(1, 0, 1)).python_function(decorate)
        for x in (-1.5, -1e-20, 2.0, 1e300, -math.inf, math.nan):
            out = np.zeros(1)
            function(0.0, np.array([x]), np.zeros(0), out)
            np.testing.assert_equal(out[0], np.floor(x))
    module = derive_text(mass_under("floor(x)")).text
    assert "from numpy import floor\n" in module
    namespace: dict = {}
    exec(module, namespace)
    out = np.zeros(1)
    namespace["forces"](0.0, np.array([-1.5, 0.0]), np.zeros(1), out)
    assert out[0] == -2.0


def test_what_has_no_derivative_raises_by_name():
    with pytest.raises(LookupError, match="'gamma'"):
        slopes(Graph(), "gamma", (0,), 0)


@pytest.mark.parametrize("name", sorted(set(IN_MODELS) - {"where"}))
def test_models_can_call_it(name):
    entry = IN_MODELS[name]
    n = entry.arity[0]
    listed = ", ".join("xyz"[:n])
    at = (arguments(entry.code) if entry.code else [(0.4, -0.3)[:n]])[0]
    assert loaded(f"{name}({listed})", at) == pytest.approx(entry.value(*at), rel=1e-14)
    constant = parse(f"{name}({', '.join(map(repr, at))})").expression
    assert float(constant) == pytest.approx(entry.value(*at), rel=1e-14)


def loaded(text: str, at: tuple[float, ...]) -> float:
    """The value of an expression of x, y, z on the graph."""
    g = Graph()
    symbols = {letter: g.var(Q, k) for k, letter in enumerate("xyz"[: len(at)])}
    node = Loader(g, symbols, {}).load(parse(text).expression)
    return evaluate(g, [node], dict(zip(symbols.values(), at, strict=True)))[0]


CONDITIONS_OF_X_Y = {
    "x < y": lambda x, y: x < y,
    "x <= y": lambda x, y: x <= y,
    "x > y": lambda x, y: x > y,
    "x >= y": lambda x, y: x >= y,
    "not x < y": lambda x, y: not x < y,
    "x < 0 and y < 0": lambda x, y: x < 0 and y < 0,
    "x < 0 or y < 0": lambda x, y: x < 0 or y < 0,
    "0 <= x < y <= 1": lambda x, y: 0 <= x < y <= 1,
    "not (x < 0 or y < 0) and not x < y or y > 0.5": lambda x, y: (
        (not (x < 0 or y < 0) and not x < y) or y > 0.5
    ),
    "(x < 0 or y < 0) and (x > -1 or y > 1)": lambda x, y: (x < 0 or y < 0) and (x > -1 or y > 1),
}
TIES = (-1.0, 0.0, 0.4, 1.0)


@pytest.mark.parametrize("condition", CONDITIONS_OF_X_Y)
def test_where_chooses(condition):
    """On the graph, in arithmetic of constants, and in text that is printed and read again."""
    text = f"where({condition}, 2*x, y - 3)"
    again = to_text(parse(text).expression)
    assert parse(again).expression == parse(text).expression
    for x, y in itertools.product(TIES, TIES):
        expected = 2 * x if CONDITIONS_OF_X_Y[condition](x, y) else y - 3
        assert loaded(text, (x, y)) == expected
        assert evaluate_constant(parse(text).expression, {"x": x, "y": y}) == expected
        numbers = re.sub("x", f"({x})", re.sub("y", f"({y})", text))
        assert float(parse(numbers).expression) == expected


def test_heaviside_is_half_at_its_step_everywhere():
    for x, expected in ((-1e-300, 0.0), (0.0, 0.5), (1e-300, 1.0)):
        assert loaded("heaviside(x)", (x,)) == IN_MODELS["heaviside"].value(x) == expected
        assert float(parse(f"heaviside({x!r})").expression) == expected
        assert float(sympy.Heaviside(sympy.Float(x))) == expected
        assert expected == 0.5 + 0.5 * float(parse(f"sign({x!r})").expression)


def test_a_long_condition_needs_no_recursion():
    text = f"where({' and '.join(f'x < {k}' for k in range(1, 900))}, 1, x)"
    assert loaded(text, (0.5,)) == 1.0 and loaded(text, (1.5,)) == 1.5


def test_what_is_not_chosen_does_not_spoil_derivatives():
    """Forwards, backwards, as a sparse Jacobian, of second order; in machine code; of duals."""
    text = "where(x < 0, x^3*y, y*sqrt(x) + log(x)/x)"
    g = Graph()
    x, y = g.var(Q, 0), g.var(Q, 1)
    node = Loader(g, {"x": x, "y": y}, {}).load(parse(text).expression)
    at = {x: -0.5, y: 2.0}
    slopes_at, bends = [1.5, -0.125], [[-6.0, 0.75], [0.75, 0.0]]
    adjoint = reverse(g, [(node, g.one)], Q)
    by_each = [forward(g, [node], {v: g.one})[0] for v in (x, y)]
    sparse = sparse_jacobian(g, [node], [x, y])[0]
    second = hessian(g, node, [x, y])
    for outputs in ([adjoint[x], adjoint[y]], by_each, [sparse[0], sparse[1]]):
        values = [float(v) for v in evaluate_arrays(g, outputs, {v: np.array(a) for v, a in at.items()})]
        assert values == pytest.approx(slopes_at, rel=1e-14)
    for row, expected in zip(second, bends, strict=True):
        found = evaluate_arrays(g, row, {v: np.array(a) for v, a in at.items()})
        assert [float(v) for v in found] == pytest.approx(expected, rel=1e-14)
    m = symgen.Model("halves")
    m.body("b", mass=1.0, com=(m.coordinate("x", start=-0.5), m.coordinate("y", start=2.0)))
    m.force("x", text)
    system = m.derive()
    p, state = system.parameter_values(), np.array([-0.5, 2.0, 0.0, 0.0])
    jacobian = system.kernel("residual_jacobian")(0.0, np.concatenate([state, np.zeros(2)]), p)
    np.testing.assert_allclose(jacobian.reshape(2, -1)[0, :2], [-1.5, 0.125], rtol=1e-14)
    along = np.eye(4)
    _, by_duals = derivatives(system, "forces", 0.0, state, p, along, np.zeros((len(p), 4)))
    np.testing.assert_allclose(by_duals[0, :2], slopes_at, rtol=1e-14)


def mass_under(force: str) -> symgen.Model:
    m = symgen.Model("mass")
    x = m.coordinate("x")
    m.body("b", mass=1.0, com=(x, 0))
    m.force(x, force)
    return m


def driven(force: str) -> symgen.runtime.System:
    """A unit mass under a force of time alone."""
    return symgen.runtime.load(derive_text(mass_under(force)).text)


@pytest.mark.parametrize("emitter", EMITTERS)
def test_what_is_not_chosen_does_not_spoil_series(emitter):
    system = driven("where(t > 2, sqrt(t - 3) + 1/(t - 1) + log(t - 5), cos(t))")
    rows, _ = coefficients(system, 1.0, np.zeros(3), emitter)
    with mpmath.workdps(60):
        exactly = mpmath.taylor(mpmath.cos, 1, ORDER - 2)
    expected = np.array([float(c) / (k + 1) for k, c in enumerate(exactly)])
    np.testing.assert_allclose(rows[1:ORDER, 1], expected, rtol=1e-11)


@pytest.mark.parametrize("emitter", EMITTERS)
def test_a_floor_of_time_is_a_number_in_a_series(emitter):
    rows, _ = coefficients(driven("t*floor(2*t)"), 1.3, np.zeros(3), emitter)
    np.testing.assert_allclose(rows[1:4, 1], [2.6, 1.0, 0.0], rtol=1e-15)


@pytest.mark.parametrize("emitter", EMITTERS)
@pytest.mark.parametrize("time", [0.5, 0.8, 2.5])
def test_choices_of_time_stand_in_choices_of_time(time, emitter):
    """What the inner one leaves out breaks where it is not chosen."""
    inner = "where(t > 2, sqrt(t - 2), where(t > 0.7, 1/t, t^2))"
    rows, _ = coefficients(driven(f"where({inner} > 1, 2*{inner}, t + {inner})"), time, np.zeros(3), emitter)

    def exact(t):
        value = mpmath.sqrt(t - 2) if time > 2 else 1 / t if time > 0.7 else t**2
        return 2 * value if time == 0.8 else t + value

    with mpmath.workdps(60):
        expected = [float(c) / (k + 1) for k, c in enumerate(mpmath.taylor(exact, time, 5))]
    np.testing.assert_allclose(rows[1:7, 1], expected, rtol=1e-10)


def test_classes_of_sympy_are_taken_over():
    x, y = sympy.symbols("x y")
    pieces = sympy.Piecewise((x, x < 0), (y**2, (x >= 1) & ~(y > 2) | (x > 5)), (3, True))
    for given, text in {
        sympy.Max(x, y, 2): "max(2, x, y)",
        sympy.Min(x, y): "min(x, y)",
        sympy.floor(x / 2): "floor(x/2)",
        sympy.ceiling(x / 2): "-floor(-x/2)",
        sympy.Heaviside(x): "heaviside(x)",
        sympy.Mod(x, y): "x - y*floor(x/y)",
        pieces: "where(x < 0, x, where(1 <= x and not y > 2 or x > 5, y^2, 3))",
        sympy.Piecewise(
            (x, sympy.ITE(x < 0, y > 1, y < 0)), (y, True)
        ): "where(x < 0 and y > 1 or not x < 0 and y < 0, x, y)",
    }.items():
        own = taken_over(given)
        assert not {node.func for node in sympy.preorder_traversal(own)} & {type(given), sympy.Piecewise}
        g = Graph()
        nodes = {"x": g.var(Q, 0), "y": g.var(Q, 1)}
        load = Loader(g, nodes, {}).load
        for at in itertools.product((-1.7, 0.4, 1.3, 2.5, 6.0), (-2.3, 0.6, 2.2)):
            values = evaluate(
                g, [load(own), load(parse(text).expression)], dict(zip(nodes.values(), at, strict=True))
            )
            expected = float(given.subs(dict(zip((x, y), at, strict=True))))
            assert values == pytest.approx([expected] * 2, abs=1e-13)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda x: sympy.Piecewise((x, x < 0)), "no value where none of its conditions holds"),
        (lambda x: sympy.Heaviside(x, 0), "not 1/2 at zero"),
        (lambda x: symgen.where(sympy.Eq(x, 0), 1, 2), "no condition"),
        (lambda x: symgen.where(x, 1, 2), "'x' is no condition"),
        (lambda x: symgen.where(x < 0, "x", 2), "not 'x'"),
    ],
)
def test_what_no_model_can_have_is_refused(make, message):
    m = symgen.Model("refused")
    x = m.coordinate("x")
    with pytest.raises(symgen.errors.ModelError, match=message):
        m.force(x, make(x))


def test_where_in_python():
    x, y = sympy.symbols("x y")
    assert symgen.where((x < 0) & (y >= 1), x, 2) == parse("where(1 <= y and x < 0, x, 2)").expression
    assert symgen.where(True, x, 2) == x and symgen.where(sympy.false, x, 2.5) == 2.5


def test_python_users_find_every_function():
    own = {"min": "minimum", "max": "maximum", "abs": None}
    for name in IN_MODELS:
        exported = own.get(name, name)
        if exported is not None:
            assert exported in symgen.__all__
            found = getattr(symgen, exported)
            arguments = sympy.symbols("a b c")[: IN_MODELS[name].arity[0]]
            if name == "sqrt":
                assert found is sympy.sqrt
            elif name != "where":
                assert taken_over(found(*arguments, evaluate=False)).func is CLASSES[name]


def test_entries_are_whole():
    for entry in ENTRIES:
        assert entry.name or entry.code
        assert bool(entry.code) == bool(entry.llvm)
        assert not (entry.smooth and entry.stepped)
        assert entry.code or entry.build
        is_of_math = entry.value is getattr(math, entry.code or "?", None)
        assert not entry.code or is_of_math or entry.numpy == entry.code
    assert {name for name, _ in inspect.getmembers(Arithmetic, inspect.isfunction)} >= {
        "const",
        "call",
        "sign",
    }


# Forces of a compliant ground by the penetration d and its rate.
_ON_THE_GROUND = {
    "k*max(0, -x)^1.5": lambda d, r: d**1.5,
    "k*max(0, -x)^1.5*(1 - c*dot(x))": lambda d, r: d**1.5 * (1.0 + 0.3 * r),
    "k*max(0, -x)*sqrt(max(0, -x))": lambda d, r: d**1.5,
    "k*max(0, -x)^p": lambda d, r: d**1.5,
    "0.1*k*(depth + depth^1.5)": lambda d, r: 0.1 * (d + d**1.5),
    "0.01*k*sqrt(max(0, -x))": lambda d, r: 0.01 * d**0.5,
}
_AT_REST = {
    "-c*sqrt(dot(x)^2)*dot(x)": lambda x, v: -0.3 * abs(v) * v,
    "-c*sqrt(dot(x)^2 + dot(x)^4)*dot(x)": lambda x, v: -0.3 * math.sqrt(v**2 + v**4) * v,
    "-10*sign(x)*abs(x)^1.5": lambda x, v: -10 * math.copysign(1, x) * abs(x) ** 1.5,
    "-10*sqrt(x^2)^3*dot(x)": lambda x, v: -10 * abs(x) ** 3 * v,
}


def under(force: str, start: float) -> symgen.runtime.System:
    """Return a unit mass that gravity pulls along x, and another force."""
    text = f"""
        name = "ground"
        [parameters]
        k = 1e4
        c = 0.3
        p = 1.5
        [coordinates]
        x = {{ start = {start} }}
        [definitions]
        depth = "max(0, -x)"
        [energy]
        kinetic = "dot(x)^2/2"
        potential = "9.81*x"
        [forces]
        x = "{force}"
        """
    return symgen.runtime.load(derive_text(symgen.Model.from_toml(text)).text)


def reference_end(acceleration, start: float) -> np.ndarray:
    from scipy.integrate import solve_ivp

    return solve_ivp(
        lambda t, y: [y[1], acceleration(*y) - 9.81], (0.0, 0.3), [start, 0.0], method="DOP853",
        rtol=1e-12, atol=1e-14, max_step=1e-4,
    ).y[:, -1]  # fmt: skip


def assert_all_methods_agree(force: str, start: float, expected: np.ndarray) -> None:
    system = under(force, start)
    for name, method in METHODS.items():
        if method.series or not (method.adaptive or "residual_jacobian" in method.kernels):
            continue
        precision = {"rtol": 1e-9, "atol": 1e-12} if method.adaptive else {"step": 2e-4}
        run = symgen.runtime.solve(system, 0.3, method=name, **precision)
        error = abs(run.q[-1, 0] - expected[0])
        assert run.status == "success" and not run.objections, (name, run.message)
        assert error < (1e-6 if method.adaptive else 1e-3), (name, error)


@pytest.mark.parametrize("force", _ON_THE_GROUND)
def test_a_ball_is_dropped_on_a_ground_that_yields(force):
    """Above the ground the derivative of the force is 0, not 0 times the infinite one of a root."""
    law = _ON_THE_GROUND[force]
    end = reference_end(lambda x, v: 1e4 * law(max(0.0, -x), -v) if x < 0.0 else 0.0, 0.01)
    assert_all_methods_agree(force, 0.01, end)


@pytest.mark.parametrize("force", _AT_REST)
def test_motion_starts_where_a_root_is_zero(force):
    """The derivative of r·u, r = sqrt(u²), is 0 where r has none: drag at rest."""
    assert_all_methods_agree(force, 0.0, reference_end(_AT_REST[force], 0.0))


@pytest.mark.parametrize(
    "force", ["sqrt(x)*x", "x^2.5", "max(0, -x)^1.5", "max(0, -x)^0.7", "abs(x)^p", "sqrt(x)^3"]
)
def test_duals_of_powers_at_zero(force):
    """The last of the products is the one that is infinite."""
    system = under(force, 0.0)
    state, p = np.zeros(2), system.parameter_values()
    _, slope = derivatives(system, "forces", 0.0, state, p, np.eye(2), np.zeros((len(p), 2)))
    np.testing.assert_array_equal(slope, [[0.0, 0.0]])
