"""Lowered kernels agree bit for bit with the text in Python and in Numba; all but the grammar is refused."""

from __future__ import annotations

import ctypes
import math
import random

import numba
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from runtime.code import engine, llvm_text
from runtime.code.lower import MATH_FUNCTIONS, Lengths, lower_function, python_function
from runtime.errors import ModuleError

N_Y, N_P, N_OUT = 6, 4, 5
LENGTHS = Lengths(N_Y, N_P, N_OUT)
PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)


def machine_function(text: str, lengths: Lengths = LENGTHS):
    """Lower and compile; return a Python callable that writes `out`."""
    code = engine.MachineCode()
    call = PROTOTYPE(code.add(engine.compile_ir(lower_function(text, "kernel", lengths).ir), "kernel"))

    def function(t, y, p, out):
        call(t, y.ctypes.data, p.ctypes.data, out.ctypes.data)

    function.keep = code
    return function


def evaluate(function, t, y, p, n_out: int = N_OUT) -> np.ndarray:
    out = np.zeros(n_out)
    function(t, y, p, out)
    return out


def assert_same_bits(a: np.ndarray, b: np.ndarray) -> None:
    numbers = ~(np.isnan(a) & np.isnan(b))
    np.testing.assert_array_equal(a[numbers].view(np.int64), b[numbers].view(np.int64))


def random_function(rng: random.Random, n_statements: int) -> str:
    """A straight-line function that uses the whole grammar; functions get arguments from their domain."""
    names: list[str] = []

    def leaf() -> str:
        choice = rng.random()
        if names and choice < 0.5:
            return rng.choice(names[-30:] if rng.random() < 0.8 else names)
        if choice < 0.7:
            return f"y[{rng.randrange(N_Y)}]"
        if choice < 0.85:
            return f"p[{rng.randrange(N_P)}]"
        return rng.choice(["t", repr(rng.uniform(-2, 2)), "3", "0.1", "1e-3"])

    def expression(depth: int) -> str:
        if depth == 0 or rng.random() < 0.15:
            return leaf()
        a, b = expression(depth - 1), expression(depth - 1)
        form = rng.choice(["+", "-", "*", "/", "neg", "call", "call", "call2", "choice", "bare"])
        if form in "+-*":
            return f"({a} {form} {b})"
        if form == "bare":
            return f"({a} - {b} * {leaf()} + {leaf()} - {leaf()})"
        if form == "/":
            return f"{a} / (1.5 + {b} * {b})"
        if form == "neg":
            return f"-({a})" if rng.random() < 0.5 else f"-{leaf()}"
        if form == "choice":
            return f"({a} if {leaf()} {rng.choice(['<', '<='])} {leaf()} else {b})"
        if form == "call2":
            return rng.choice([f"pow(fabs({a}) + 0.5, tanh({b}))", f"atan2({a}, {b})", f"copysign({a}, {b})"])
        name = rng.choice(
            [
                "sin",
                "cos",
                "tan",
                "atan",
                "tanh",
                "fabs",
                "asin",
                "acos",
                "exp",
                "log",
                "sqrt",
                "sinh",
                "cosh",
            ]
        )
        if name in ("asin", "acos"):
            return f"{name}(tanh({a}))"
        if name in ("exp", "sinh", "cosh"):
            return f"{name}(sin({a}))"
        return f"{name}(fabs({a}) + 0.25)" if name in ("log", "sqrt") else f"{name}({a})"

    lines = ["def rhs(t, y, p, out):", '    """A random function."""']
    for index in range(n_statements):
        lines.append(f"    w{index} = {expression(rng.choice([1, 1, 2, 3]))}")
        names.append(f"w{index}")
        if rng.random() < 0.1:
            lines.append(f"    {rng.choice(names)} = {expression(1)}")
    lines += [f"    out[{index}] = {expression(2)}" for index in range(N_OUT)]
    return "\n".join(lines) + "\n"


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32),
    st.integers(1, 40),
    st.lists(st.floats(-3, 3), min_size=N_Y + N_P + 1, max_size=N_Y + N_P + 1),
)
def test_agrees_with_python_bit_for_bit(seed, n_statements, values):
    text = random_function(random.Random(seed), n_statements)
    t, y, p = values[0], np.array(values[1 : N_Y + 1]), np.array(values[N_Y + 1 :])
    try:
        expected = evaluate(python_function(text, "rhs", "<text>", 1), t, y.tolist(), p.tolist())
    except (ValueError, OverflowError, ZeroDivisionError):
        assume(False)  # Python raises where machines have nan and inf
    assert_same_bits(evaluate(machine_function(text), t, y, p), expected)


@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_numba_bit_for_bit(seed):
    text = random_function(random.Random(seed), 25)
    fast = machine_function(text)
    oracle = numba.njit(error_model="numpy")(python_function(text, "rhs", "<text>", 1))
    rng = np.random.default_rng(seed)
    for scale in (0.0, 1.0, 30.0, 1e150):
        y, p = scale * rng.normal(size=N_Y), scale * rng.normal(size=N_P)
        assert_same_bits(evaluate(fast, 0.7, y, p), evaluate(oracle, 0.7, y, p))


@pytest.mark.parametrize("piece", [40, 400])
def test_pieces_change_nothing(monkeypatch, piece):
    text = random_function(random.Random(piece), 600)
    y, p = np.linspace(-1, 1, N_Y), np.linspace(0.2, 0.9, N_P)
    whole = evaluate(machine_function(text), 0.3, y, p)
    monkeypatch.setattr(llvm_text, "PIECE_OPERATIONS", piece)
    ir = lower_function(text, "kernel", LENGTHS).ir
    assert ir.count("define internal") > 2
    assert_same_bits(evaluate(machine_function(text), 0.3, y, p), whole)
    assert_same_bits(whole, evaluate(python_function(text, "rhs", "", 1), 0.3, y.tolist(), p.tolist()))


def test_scratch_places_are_used_again(monkeypatch):
    monkeypatch.setattr(llvm_text, "PIECE_OPERATIONS", 10)
    lines = ["w0 = y[0] + 1.0"] + [f"w{i} = sin(w{i - 1}) + w{max(i - 12, 0)}" for i in range(1, 400)]
    text = "def rhs(t, y, p, out):\n    " + "\n    ".join([*lines, "out[0] = w399"]) + "\n"
    ir = lower_function(text, "kernel", LENGTHS).ir
    places = int(ir.split("alloca double, i64 ")[1].split(",")[0])
    assert places < 60  # 400 values, of which a dozen are alive at any place
    expected = evaluate(python_function(text, "rhs", "", 1), 0.0, [0.4] * N_Y, [])
    assert_same_bits(evaluate(machine_function(text), 0.0, np.full(N_Y, 0.4), np.zeros(N_P)), expected)


def test_long_chains_do_not_need_recursion():
    chain = " + ".join(f"y[{i % N_Y}] * {i}.0" for i in range(800))
    text = f"def rhs(t, y, p, out):\n    out[0] = {chain}\n"
    y = np.linspace(0.1, 0.7, N_Y)
    expected = evaluate(python_function(text, "rhs", "", 1), 0.0, y.tolist(), [])
    assert_same_bits(evaluate(machine_function(text), 0.0, y, np.zeros(N_P)), expected)


@pytest.mark.parametrize(
    ("expression", "y0", "expected"),
    [
        ("-y[0]", 0.0, -0.0),
        ("0 - y[0]", 0.0, 0.0),
        ("-0.0", 1.0, -0.0),
        ("-0", 1.0, 0.0),
        ("y[0] + 0.0", -0.0, 0.0),
        ("1.0 / y[0]", 0.0, math.inf),
        ("sqrt(y[0])", -1.0, math.nan),
        ("(1.0 if y[0] < 2.0 else 3.0)", math.nan, 3.0),
        ("(y[0] if y[0] <= 2.0 else 1.0 / y[0])", 2.0, 2.0),
        ("y[0] * 3.0 - y[0] * 3.0", 0.1, 0.0),
        ("copysign(2.0, y[0])", -0.0, -2.0),
        ("5e-324 * y[0]", 1.0, 5e-324),
    ],
)
def test_special_values(expression, y0, expected):
    fast = machine_function(f"def rhs(t, y, p, out):\n    out[0] = {expression}\n")
    out = evaluate(fast, 0.0, np.full(N_Y, y0), np.zeros(N_P))
    assert_same_bits(out[:1], np.array([expected]))


def test_no_fused_multiply_add():
    x = 1.0 + 2.0**-30
    fast = machine_function("def rhs(t, y, p, out):\n    out[0] = y[0] * y[0] - p[0]\n")
    assert evaluate(fast, 0.0, np.full(N_Y, x), np.full(N_P, x * x))[0] == 0.0


@pytest.mark.parametrize(
    "body",
    [
        "import os",
        "out[0] = __import__('os').getpid()",
        "out[0] = y.ctypes.data",
        "out[0] = sin.__self__",
        "out[0] = (lambda: 1.0)()",
        "out[0] = [1.0 for i in y][0]",
        "exec('1')",
        "out[0] = eval('1')",
        "y[0] = 1.0",
        "out = y",
        "sin = y[0]",
        "t = 1.0",
        "out[0] = out[1]",
        "out[0:2] = 1.0",
        "out[0], out[1] = 1.0, 2.0",
        "a = out[0] = 1.0",
        "out[0] += 1.0",
        "a: float = 1.0",
        "for i in y:\n        out[0] = i",
        "if t < 1.0:\n        out[0] = 1.0",
        "return",
        "pass",
        "global a",
        "out[0] = y[0] ** 2.0",
        "out[0] = y[0] // 2.0",
        "out[0] = y[0] % 2.0",
        "out[0] = +y[0]",
        "out[0] = not t",
        "out[0] = (1.0 if t > 1.0 else 2.0)",
        "out[0] = (1.0 if t == 1.0 else 2.0)",
        "out[0] = (1.0 if 0.0 < t < 1.0 else 2.0)",
        "out[0] = (1.0 if t else 2.0)",
        "out[0] = t < 1.0",
        "out[0] = 1j",
        "out[0] = True",
        "out[0] = 'a'",
        "out[0] = None",
        f"out[0] = {2**60}",
        "out[0] = sin()",
        "out[0] = sin(t, t)",
        "out[0] = sin(x=t)",
        "out[0] = sin(*y)",
        "out[0] = pow(t)",
        "out[0] = gamma(t)",
        "out[0] = y",
        "out[0] = a",
        "out[0] = a\n    a = 1.0",
        "out[0] = y[-1]",
        f"out[0] = y[{N_Y}]",
        f"out[0] = p[{N_P}]",
        f"out[{N_OUT}] = 1.0",
        "out[-1] = 1.0",
        "out[True] = 1.0",
        "out[t] = 1.0",
        "out[0] = y[0:1]",
        "out[0] = (a := 1.0)",
        "out[0] = y[0",
        "out[0] = '\0'",
        "out[0] = " + "(" * 150 + "t" + ")" * 149,
        "out[0] = " + "-" * 3000 + "t",
    ],
)
def test_refuses_all_else(body):
    with pytest.raises(ModuleError) as caught:
        lower_function(
            f"def rhs(t, y, p, out):\n    a0 = 1.0\n    {body}\n", "kernel", LENGTHS, name="rhs", file="m.py"
        )
    assert "m.py" in str(caught.value) and "rhs" in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "@njit\ndef rhs(t, y, p, out):\n    out[0] = t\n",
        "def rhs(t, y, p, out=print(1)):\n    out[0] = t\n",
        "def rhs(t: print(1), y, p, out):\n    out[0] = t\n",
        "def rhs(t, y, p, out) -> print(1):\n    out[0] = t\n",
        "def rhs(t, y, p, out, *rest):\n    out[0] = t\n",
        "async def rhs(t, y, p, out):\n    out[0] = t\n",
        "def rhs(t, y, p, out):\n    out[0] = t\nprint(1)\n",
        "x = 1\n",
        "",
    ],
)
def test_refuses_other_definitions(text):
    with pytest.raises(ModuleError):
        lower_function(text, "kernel", LENGTHS)


def test_names_the_line_in_the_module():
    text = "def rhs(t, y, p, out):\n    a = t\n    out[0] = a.real\n"
    with pytest.raises(ModuleError, match="line 42, function 'rhs'"):
        lower_function(text, "kernel", LENGTHS, name="rhs", first_line=40)


def test_python_function_sees_only_the_grammar():
    function = python_function("def rhs(t, y, p, out):\n    out[0] = sin(t)\n", "rhs", "<text>", 1)
    assert function.__globals__["__builtins__"] == {}
    assert MATH_FUNCTIONS < set(function.__globals__)
