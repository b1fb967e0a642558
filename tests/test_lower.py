"""Lowered kernels agree bit for bit with the text in Python and in Numba; all but the grammar is refused."""

from __future__ import annotations

import ctypes
import math
import random
import re

import numba
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from symgen.runtime.code import angles, compiler, engine
from symgen.runtime.code import lower as straight_line
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.modules import lower_function, lower_kernel, lower_lanes, lower_setup
from symgen.runtime.code.parse import MATH_FUNCTIONS
from symgen.runtime.errors import ModuleError

N_Y, N_P, N_OUT = 6, 4, 5
LENGTHS = Lengths(N_Y, N_P, N_OUT)
PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)


@pytest.fixture(autouse=True)
def sines_one_by_one(monkeypatch):
    """Sines of several angles at once are our own, not Python's: see test_angles.py."""
    monkeypatch.setattr(angles, "_FEWEST", math.inf)


def machine_function(text: str, lengths: Lengths = LENGTHS):
    """Lower and compile; return a Python callable that writes `out`."""
    code = engine.MachineCode()
    ir = lower_function(FunctionText("rhs", text, lengths), "kernel").ir
    call = PROTOTYPE(code.add(compiler.compile_ir(ir), "kernel"))

    def function(t, y, p, out):
        call(t, y.ctypes.data, p.ctypes.data, out.ctypes.data)

    function.keep = code
    return function


def python_function(text: str):
    return FunctionText("rhs", text, LENGTHS).python_function()


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
        expected = evaluate(python_function(text), t, y.tolist(), p.tolist())
    except (ValueError, OverflowError, ZeroDivisionError):
        assume(False)  # Python raises where machines have nan and inf
    assert_same_bits(evaluate(machine_function(text), t, y, p), expected)


@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_numba_bit_for_bit(seed):
    text = random_function(random.Random(seed), 25)
    fast = machine_function(text)
    oracle = numba.njit(error_model="numpy")(python_function(text))
    rng = np.random.default_rng(seed)
    for scale in (0.0, 1.0, 30.0, 1e150):
        y, p = scale * rng.normal(size=N_Y), scale * rng.normal(size=N_P)
        assert_same_bits(evaluate(fast, 0.7, y, p), evaluate(oracle, 0.7, y, p))


@pytest.mark.parametrize("piece", [40, 400])
def test_pieces_change_nothing(monkeypatch, piece):
    text = random_function(random.Random(piece), 600)
    y, p = np.linspace(-1, 1, N_Y), np.linspace(0.2, 0.9, N_P)
    whole = evaluate(machine_function(text), 0.3, y, p)
    monkeypatch.setattr(straight_line, "PIECE_LINES", piece)
    ir = lower_function(FunctionText("rhs", text, LENGTHS), "kernel").ir
    assert ir.count("define internal") > 2
    assert_same_bits(evaluate(machine_function(text), 0.3, y, p), whole)
    assert_same_bits(whole, evaluate(python_function(text), 0.3, y.tolist(), p.tolist()))


def test_scratch_places_are_used_again(monkeypatch):
    monkeypatch.setattr(straight_line, "PIECE_LINES", 10)
    lines = ["w0 = y[0] + 1.0"] + [f"w{i} = sin(w{i - 1}) + w{max(i - 12, 0)}" for i in range(1, 400)]
    text = "def rhs(t, y, p, out):\n    " + "\n    ".join([*lines, "out[0] = w399"]) + "\n"
    ir = lower_function(FunctionText("rhs", text, LENGTHS), "kernel").ir
    places = int(ir.split("alloca double, i64 ")[1].split(",")[0])
    assert places < 60  # 400 values, of which a dozen are alive at any place
    expected = evaluate(python_function(text), 0.0, [0.4] * N_Y, [])
    assert_same_bits(evaluate(machine_function(text), 0.0, np.full(N_Y, 0.4), np.zeros(N_P)), expected)


def test_long_chains_do_not_need_recursion():
    chain = " + ".join(f"y[{i % N_Y}] * {i}.0" for i in range(800))
    text = f"def rhs(t, y, p, out):\n    out[0] = {chain}\n"
    y = np.linspace(0.1, 0.7, N_Y)
    expected = evaluate(python_function(text), 0.0, y.tolist(), [])
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
        pytest.param(f"out[0] = {'9' * 5000}", id="more digits than Python reads"),
        "out[0] = \u0663",  # a digit, though none of Python's
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
        text = f"def rhs(t, y, p, out):\n    a0 = 1.0\n    {body}\n"
        lower_function(FunctionText("rhs", text, LENGTHS, file="m.py"), "kernel")
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
        lower_function(FunctionText("rhs", text, LENGTHS), "kernel")


def test_names_the_line_in_the_module():
    text = "def rhs(t, y, p, out):\n    a = t\n    out[0] = a.real\n"
    with pytest.raises(ModuleError, match="line 42, function 'rhs'"):
        lower_function(FunctionText("rhs", text, LENGTHS, first_line=40), "kernel")


def test_python_function_sees_only_the_grammar():
    function = python_function("def rhs(t, y, p, out):\n    out[0] = sin(t)\n")
    assert function.__globals__["__builtins__"] == {}
    assert MATH_FUNCTIONS < set(function.__globals__)


LOOPS = """def rhs(t, y, p, out):
    "Two loops, values that go in, come out, and change places."
    g = p[0]
    c0 = g*2.0
    e0 = 0.5
    e1 = y[0]
    two = 2.0
    w = sin(y[5])
    for k in range(3):
        l = p[1 + k]
        c1 = l*c0
        c2 = sqrt(fabs(c1))
        a = y[2*k] - y[I0[k]]*w
        b = a*c2 + two*t + e1
        e0 = e0 + b*g
        e1 = e1*0.5 + e0
        out[1 + k] = b/l
    e2 = e1
    for k in range(2):
        c3 = p[k] - p[1 + 2*k]
        swapped = e2
        e2 = e0
        e0 = swapped + c3*y[3 + k]
    for k in range(1):
        out[4 + k] = y[k]*c0
    out[0] = e0 - 3.0*e2
"""
TABLES = {"I0": (5, 1, 3)}
N_HOISTED = 1 + 2 * 3 + 2


def loops(text: str = LOOPS, **changes) -> FunctionText:
    return FunctionText("rhs", text, LENGTHS, TABLES, **changes)


def machine_code(ir: str, *symbols: str):
    code = engine.MachineCode()
    code.add(compiler.compile_ir(ir), symbols[0])
    calls = [PROTOTYPE(code.address(symbol)) for symbol in symbols]
    return code, calls


@pytest.mark.parametrize("piece", [2, 3, 5, 3000])
def test_loops_agree_with_python_and_numba(monkeypatch, piece):
    monkeypatch.setattr(straight_line, "PIECE_LINES", piece)
    source = loops()
    _keep, (call,) = machine_code(lower_function(source, "kernel").ir, "kernel")
    rng = np.random.default_rng(7)
    plain, jitted = source.python_function(), numba.njit(error_model="numpy")(source.python_function())
    for _ in range(3):
        y, p = rng.normal(size=N_Y), rng.normal(size=N_P)
        expected = evaluate(plain, 0.3, y.tolist(), p.tolist())
        out = np.zeros(N_OUT)
        call(0.3, y.ctypes.data, p.ctypes.data, out.ctypes.data)
        assert_same_bits(out, expected)
        assert_same_bits(evaluate(jitted, 0.3, y, p), expected)


@pytest.mark.parametrize("piece", [2, 3000])
def test_hoisted_work_apart_changes_nothing(monkeypatch, piece):
    monkeypatch.setattr(straight_line, "PIECE_LINES", piece)
    source, offset = loops(), N_P + 2
    ir = lower_kernel(source, "kernel", N_HOISTED, offset).ir
    _keep, (whole, precomputed) = machine_code(ir, "kernel", "kernel_precomputed")
    _keep_too, (setup,) = machine_code(lower_setup([(source, N_HOISTED)] * 2, "setup").ir, "setup")
    y, p = np.linspace(-1.0, 2.0, N_Y), np.array([9.81, 0.3, -0.2, 1.5])
    expected = evaluate(source.python_function(), 0.3, y.tolist(), p.tolist())
    values = np.zeros(2 * N_HOISTED)
    setup(0.0, None, p.ctypes.data, values.ctypes.data)
    assert_same_bits(values[:N_HOISTED], values[N_HOISTED:])
    assert values[0] == 2 * 9.81 and values[2] == math.sqrt(values[1]) and values[-1] == p[1] - p[3]
    longer = np.concatenate([p, [7.0, 7.0], values[:N_HOISTED]])
    for call, passed in ((whole, p), (precomputed, longer), (whole, longer)):
        out = np.zeros(N_OUT)
        call(0.3, y.ctypes.data, passed.ctypes.data, out.ctypes.data)
        assert_same_bits(out, expected)


def test_a_precomputed_kernel_reads_its_hoisted_values_only():
    """The values in the longer p count, not what they were computed from."""
    source = FunctionText("rhs", "def rhs(t, y, p, out):\n    c0 = p[0]*2.0\n    out[0] = c0\n", LENGTHS)
    _keep, (precomputed,) = machine_code(lower_kernel(source, "kernel", 1, N_P).ir, "kernel_precomputed")
    p, out = np.array([1.0, 0, 0, 0, 5.5]), np.zeros(N_OUT)
    precomputed(0.0, None, p.ctypes.data, out.ctypes.data)
    assert out[0] == 5.5


@pytest.mark.parametrize(
    ("statements", "cause"),
    [
        ("c0 = y[0]\n    out[0] = c0", "only p\\[i\\] can be read"),
        ("c0 = t*p[0]\n    out[0] = c0", "'t' has no value here that follows from p alone"),
        ("x0 = sin(y[0])\n    c0 = x0\n    out[0] = c0", "only p\\[i\\] can be read"),
        ("out[0] = p[0]", "0 hoisted values, but the header says 1"),
        ("c0 = p[0]\n    c1 = p[1]\n    out[0] = c0", "2 hoisted values, but the header says 1"),
    ],
)
def test_hoisted_work_depends_on_parameters_only(statements, cause):
    source = FunctionText("rhs", f"def rhs(t, y, p, out):\n    {statements}\n", LENGTHS)
    for lower in (
        lambda: lower_kernel(source, "kernel", 1, N_P),
        lambda: lower_setup([(source, 1)], "setup"),
    ):
        with pytest.raises(ModuleError, match=cause):
            lower()


@pytest.mark.parametrize(
    "loop",
    [
        "for i in range(3):\n        out[0] = t",
        "for k in range(0):\n        out[0] = t",
        "for k in range(t):\n        out[0] = t",
        "for k in range(1, 3):\n        out[0] = t",
        "for k in range(3):\n        out[k] = t\n    else:\n        out[0] = t",
        "for k in range(3):\n        for k in range(2):\n            out[0] = t",
        "for k in range(3):\n        out[0] = k",
        "for k in range(3):\n        k = 2.0",
        "k = 2.0\n    for k in range(3):\n        out[0] = t",
        "for k in range(3):\n        out[3*k] = t",
        "for k in range(3):\n        out[k*1] = t",
        "for k in range(3):\n        out[k + 1] = t",
        "for k in range(3):\n        out[0*k] = t",
        "for k in range(3):\n        out[2 - k] = t",
        "for k in range(3):\n        out[k + k] = t",
        "for k in range(3):\n        out[I0[0]] = t",
        "for k in range(3):\n        out[I0[k]] = t",
        "for k in range(3):\n        out[I1[k]] = t",
        "for k in range(4):\n        out[0] = y[I0[k]]",
        "for k in range(3):\n        x = y[k]\n    out[0] = x",
        "for k in range(3):\n        out[0] = x\n        x = t",
        "out[k] = t",
        "out[I0[k]] = t",
        "out[0] = I0",
        "while t < 1.0:\n        out[0] = t",
    ],
)
def test_refuses_all_other_loops(loop):
    with pytest.raises(ModuleError, match="line"):
        lower_function(loops(f"def rhs(t, y, p, out):\n    {loop}\n"), "kernel")


def random_columns(rng: random.Random) -> tuple[str, int]:
    """Loops over numbers that lie side by side: rows that wait for each other, overlap, or stand in their own way."""
    n_rows, count = rng.randint(2, 5), rng.choice([1, 3, 4, 7, 8, 12, 13, 29])
    size = (n_rows + 1) * count + 3
    lines = ["def rhs(t, y, p, out):", '    """Rows."""', f"    w0 = [0.0]*{size}"]
    lines += [f"    for k in range({size}):", "        w0[k] = 0.0"]
    lines += [f"    w0[{rng.randrange(size)}] = {rng.choice(['y[1]', '-p[0]*t', '0.3'])}" for _ in range(8)]

    def place() -> str:
        first = rng.choice([rng.randrange(n_rows) * count, rng.randrange(size - count)])
        return f"w0[{first} + k]" if first else "w0[k]"

    def factor() -> str:
        return rng.choice([place(), place(), f"w0[{rng.randrange(size)}]", "y[0]", "p[1]", "1.5", "a"])

    lines.append("    a = y[2]*t")
    for _ in range(rng.randint(2, 9)):
        first = rng.randrange(n_rows) * count
        target = f"w0[{first} + k]" if first else "w0[k]"
        terms = " ".join(f"{rng.choice('+-')} {factor()}*{factor()}" for _ in range(rng.randint(1, 3)))
        lines.append(f"    for k in range({count}):")
        if rng.random() < 0.3:
            lines += [
                f"        x = {place()}/(2.0 + {factor()}*{factor()}) {terms}",
                f"        {target} = -x",
            ]
        else:
            lines.append(f"        {target} = {place()}{terms}")
        if rng.random() < 0.2:
            lines.append(f"        {place()} = {factor()}*{target}")
    lines += [f"    for k in range({size}):", "        out[k] = w0[k]"]
    return "\n".join(lines) + "\n", size


@pytest.mark.parametrize("seed", range(60))
def test_loops_side_by_side_change_no_bit(seed):
    text, size = random_columns(random.Random(seed))
    lengths = Lengths(N_Y, N_P, size)
    source = FunctionText("rhs", text, lengths)
    y, p = np.random.default_rng(seed).normal(size=(2, 8))
    expected = evaluate(source.python_function(), 0.7, y.tolist(), p.tolist(), size)
    assert_same_bits(evaluate(machine_function(text, lengths), 0.7, y, p, size), expected)


def test_rows_are_done_several_passes_at_a_time():
    body = "    w0 = [0.0]*29\n    for k in range(14):\n        w0[k] = 0.5\n"
    whole = "def rhs(t, y, p, out):\n    'Rows.'\n" + body
    apart = "    for k in range(14):\n        w0[15 + k] = w0[3]*2.0 - w0[k]\n    out[0] = w0[28]\n"
    beside = "    for k in range(14):\n        w0[1 + k] = w0[3]*2.0 - w0[k]\n    out[0] = w0[14]\n"
    for text, wide in ((apart, 2), (beside, 1)):
        ir = lower_function(FunctionText("rhs", whole + text, Lengths(1, 1, 1)), "kernel").ir
        assert len(re.findall(r"define internal void @\S+\.8\(", ir)) == wide, text


@pytest.mark.parametrize("lanes, divisions", [(0, 4), (1, 2), (8, 2)])
def test_divisor_of_several_quotients_is_inverted_once_in_lanes(lanes, divisions):
    text = (
        "def rhs(t, y, p, out):\n    x0 = y[0]/y[1]\n    out[0] = x0*(y[2]/y[1])\n"
        "    out[1] = 1.0/y[1]\n    out[2] = y[1]/y[3]\n"
    )
    function = FunctionText("rhs", text, LENGTHS)
    lowered = lower_lanes(function, "kernel", 0, 0, lanes) if lanes else lower_function(function, "kernel")
    assert lowered.ir.count("fdiv") == divisions
