"""The reciprocal of a root in lanes: its error, the ends of its range, and the same bits in any number of lanes."""

import ctypes
import math
from fractions import Fraction

import numpy as np
import pytest

from symgen.runtime.code import engine
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.modules import lower_lanes
from symgen.runtime.ensemble.arrays import aligned

TEXT = "def rhs(t, y, p, out):\n    x0 = sqrt(y[0])\n    out[0] = y[1]/x0\n    out[1] = 1.0/x0\n"
_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)


def reciprocals(values: np.ndarray, lanes: int) -> np.ndarray:
    """1 / sqrt(x) as functions in lanes take it whose quotients share a root."""
    ir = lower_lanes(FunctionText("rhs", TEXT, Lengths(2, 1, 2)), "kernel", 0, 0, lanes).ir
    assert "symgen.reciprocal_root" in ir
    kind = f"<{lanes} x double>"
    ir += f"""
define void @many(ptr %x, ptr %out, i64 %n) {{
entry:
  %pair = alloca [2 x {kind}], align 64
  %both = alloca [2 x {kind}], align 64
  br label %loop
loop:
  %i = phi i64 [0, %entry], [%next, %loop]
  %from = getelementptr {kind}, ptr %x, i64 %i
  %value = load {kind}, ptr %from, align 8
  store {kind} %value, ptr %pair, align 64
  call void @kernel({kind} zeroinitializer, ptr %pair, ptr %pair, ptr %both)
  %second = getelementptr {kind}, ptr %both, i64 1
  %root = load {kind}, ptr %second, align 8
  %to = getelementptr {kind}, ptr %out, i64 %i
  store {kind} %root, ptr %to, align 8
  %next = add i64 %i, 1
  %more = icmp slt i64 %next, %n
  br i1 %more, label %loop, label %done
done:
  ret void
}}
"""
    code = engine.MachineCode()
    call = _PROTOTYPE(
        code.add(engine.object_code(engine.cache_key(ir), "root", "many", lambda _: (ir, 0)), "many")
    )
    blocks = -(-len(values) // lanes)
    x, out = aligned(blocks * lanes), aligned(blocks * lanes)
    x[:] = 1.0
    x[: len(values)] = values
    call(x.ctypes.data, out.ctypes.data, blocks)
    return out[: len(values)].copy()


def error_in_ulp(x: float, r: float) -> float:
    """How far r is from 1 / sqrt(x), in units of its last place: exact but for terms of the relative error squared."""
    off = (1 - Fraction(x) * Fraction(r) ** 2) / 2
    return abs(float(off * Fraction(r) / Fraction(math.ulp(r))))


@pytest.fixture(scope="module")
def spread() -> np.ndarray:
    rng = np.random.default_rng(5)
    mantissas, exponents = rng.uniform(1.0, 2.0, 6000), rng.integers(-900, 900, 6000)
    near_one = 1.0 + rng.integers(-2000, 2000, 1000) * 2.0**-52
    return np.concatenate([np.ldexp(mantissas, exponents), rng.uniform(1e-3, 1e3, 6000), near_one])


def test_error_is_little_more_than_half_a_unit(spread):
    found = reciprocals(spread, 8)
    worst = max(error_in_ulp(x, r) for x, r in zip(spread.tolist(), found.tolist(), strict=True))
    assert worst < 0.52


@pytest.mark.parametrize("lanes", [1, 2, 4, 16])
def test_lanes_do_not_change_bits(spread, lanes):
    assert np.array_equal(reciprocals(spread, lanes), reciprocals(spread, 8))


def test_what_is_out_of_range_is_a_root_and_a_division():
    values = np.array([0.0, -0.0, np.inf, np.nan, -1.0, 5e-324, 1e-300, 1e-281, 1e281, 1.7e308, 4.0])
    with np.errstate(all="ignore"):
        expected = 1.0 / np.sqrt(values)
    assert np.array_equal(reciprocals(values, 8), expected, equal_nan=True)
