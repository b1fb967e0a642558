"""Sines of several angles at once: which angles are taken together, and what comes out."""

from __future__ import annotations

import ctypes
import math

import numpy as np
import pytest
from lowered import assert_same_bits

from symgen.runtime.code import angles, compiler, elf, engine
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.modules import lower_function, lower_lanes

_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
_LANES = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


def sines_text(n: int) -> FunctionText:
    """A function of `n` angles: all sines, then all cosines."""
    lines = [f"out[{k}] = sin(y[{k}])\n    out[{n + k}] = cos(y[{k}])" for k in range(n)]
    return FunctionText("rhs", "def rhs(t, y, p, out):\n    " + "\n    ".join(lines), Lengths(n, 1, 2 * n))


def sines(y: np.ndarray, compile_it=compiler.compile_ir) -> np.ndarray:
    """Sines and cosines of the angles `y`, taken together: shape (2, n)."""
    code, out = engine.MachineCode(), np.zeros((2, len(y)))
    ir = lower_function(sines_text(len(y)), "kernel").ir
    _PROTOTYPE(code.add(compile_it(ir), "kernel"))(0.0, y.ctypes.data, y.ctypes.data, out.ctypes.data)
    return out


def sines_in_lanes(y: np.ndarray) -> np.ndarray:
    """The same as members of an ensemble get them, one at a time."""
    ir = lower_lanes(sines_text(1), "kernel", 0, 0, 1).ir
    ir += """
define void @one(ptr %y, ptr %out) {
  call void @kernel(<1 x double> zeroinitializer, ptr %y, ptr %y, ptr %out)
  ret void
}
"""
    code, out = engine.MachineCode(), np.zeros((len(y), 2))
    call = _LANES(code.add(compiler.compile_ir(ir), "one"))
    for k in range(len(y)):
        call(y[k:].ctypes.data, out[k].ctypes.data)
    return out.T


def groups(text: str, n_y: int = 20, n_out: int = 1) -> list[int]:
    """The sizes of the groups of a function's angles."""
    function = FunctionText("rhs", f"def rhs(t, y, p, out):\n    {text}\n", Lengths(n_y, 2, n_out))
    found = angles.side_by_side(function.form)
    assert all(angle in group for angle, group in found.items())
    return [len(group) for group in dict.fromkeys(found.values())]


@pytest.mark.parametrize("n, sizes", [(2, []), (3, [3]), (8, [8]), (9, [4, 5]), (20, [6, 7, 7])])
def test_angles_are_shared_out_evenly(n, sizes):
    assert groups("out[0] = " + " + ".join(f"sin(y[{k}])*cos(y[{k}])" for k in range(n))) == sizes


def test_angles_that_have_to_be_waited_for_are_taken_by_themselves():
    early = "cos(y[0] + p[0]*t) + sin(-y[1]) + sin(2.0*y[2])"
    assert groups(f"out[0] = {early} + sin(y[3]/y[4]) + sin(cos(y[5]))") == [4]
    assert groups("out[0] = sin(y[0]/y[1]) + sin(sqrt(y[2])) + sin(tan(y[3]))") == []


def test_angles_of_a_loop_stay_there():
    text = "for k in range(4):\n        out[k] = sin(y[k]) + sin(y[4 + 1*k]) + sin(y[8 + 1*k])"
    assert groups(text, n_out=4) == []


@pytest.mark.parametrize("n", [3, 5, 8])
def test_sines_are_those_of_members_of_an_ensemble(n):
    rng = np.random.default_rng(n)
    for size in (1e-3, 1.0, 30.0, 1e6, 1e12):
        y = rng.normal(size=n) * size
        found = sines(y)
        assert_same_bits(found, sines_in_lanes(y))
        exact = np.array([[math.sin(x) for x in y], [math.cos(x) for x in y]])
        assert np.all(np.abs(found - exact) <= np.spacing(np.abs(exact)))


def test_an_angle_that_is_no_number_leaves_the_others():
    y = np.array([0.5, math.nan, math.inf, -2.0])
    found = sines(y)
    assert np.isnan(found[:, 1:3]).all()
    assert_same_bits(found[:, [0, 3]], sines_in_lanes(y[[0, 3]]))


def test_a_draft_has_the_same_bits():
    y = np.random.default_rng(4).normal(size=13) * 5.0
    assert_same_bits(sines(y, compiler.compile_draft), sines(y))


def test_operations_are_counted_as_in_the_text():
    text = "def rhs(t, y, p, out):\n    x = y[0] + y[1]\n    out[0] = sin(x)*cos(x) + sin(2.0*y[1])*cos(t)\n"
    assert lower_function(FunctionText("rhs", text, Lengths(2, 1, 1)), "kernel").operations == 9


def test_llvm_loads_what_calls_them(monkeypatch):
    """As it does where code is not loaded by ourselves."""

    def unsupported(self, content):
        raise elf.UnsupportedError("LLVM loads it")

    y = np.array([0.3, -1.0, 2.0])
    expected = sines(y)
    monkeypatch.setattr(engine.MachineCode, "_add_image", unsupported)
    assert_same_bits(sines(y), expected)
