"""Object code placed in memory without LLVM: what LLVM's own loader makes of it is the oracle."""

from __future__ import annotations

import ctypes
import gc
import platform
import struct
import sys

import numpy as np
import pytest

from symgen.runtime.code import compiler, elf, engine
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.modules import lower_function

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64",
    reason="only x86-64 Linux loads code without LLVM",
)
PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
TEXT = """def f(t, y, p, out):
    a = sin(y[0]) * p[0] + tan(t)
    b = atan2(a, 0.3) - cosh(y[1]) / 7.0
    out[0] = a * b + 1.25
    out[1] = pow(fabs(b), 0.37) + exp(-a * a)
"""
# A table of constants, a variable, a function that calls another one by its address.
LINKED = """
@table = internal constant [3 x double] [double 1.5, double -2.0, double 4.0], align 8
@slot = global i64 0, align 8
@counter = internal global i64 41, align 8
define internal double @entry(i64 %i) noinline {
%at = getelementptr double, ptr @table, i64 %i
%value = load double, ptr %at
ret double %value
}
define void @first(ptr %out) {
%n = load i64, ptr @counter
%more = add i64 %n, 1
store i64 %more, ptr @counter
store i64 %more, ptr @slot
%value = call double @entry(i64 2)
store double %value, ptr %out
ret void
}
define void @second(ptr %out) {
call void @first(ptr %out)
%value = load double, ptr %out
%twice = fmul double %value, 2.0
store double %twice, ptr %out
ret void
}
"""


def kernel() -> bytes:
    return compiler.compile_ir(lower_function(FunctionText("f", TEXT, Lengths(2, 1, 2)), "f").ir)


def results(address: int) -> bytes:
    random, rows = np.random.default_rng(3), []
    for _ in range(50):
        y, p, out = random.normal(size=2), random.normal(size=1), np.zeros(2)
        PROTOTYPE(address)(random.normal(), y.ctypes.data, p.ctypes.data, out.ctypes.data)
        rows.append(out.tobytes())
    return b"".join(rows)


def mapping(address: int) -> str:
    """The permissions of the memory at an address; empty where there is none."""
    with open("/proc/self/maps") as file:
        for line in file:
            begin, end = (int(part, 16) for part in line.split()[0].split("-"))
            if begin <= address < end:
                return line.split()[1]
    return ""


def test_a_kernel_gives_the_bits_that_it_gives_in_llvms_own_place():
    content = kernel()
    image, place = elf.Image(content, engine.process_symbol), compiler.Engine()
    place.add(content, {})
    assert results(image.addresses["f"]) == results(place.address("f"))


def test_functions_tables_and_variables_find_each_other():
    image = elf.Image(compiler.compile_ir(LINKED), engine.process_symbol)
    out = ctypes.c_double()
    second = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(image.addresses["second"])
    for call in (1, 2):
        second(ctypes.addressof(out))
        assert out.value == 8.0
        assert ctypes.c_int64.from_address(image.addresses["slot"]).value == 41 + call


def test_no_memory_can_be_both_written_and_executed():
    image = elf.Image(compiler.compile_ir(LINKED), engine.process_symbol)
    assert mapping(image.addresses["first"]).startswith("r-x")
    assert mapping(image.addresses["slot"]).startswith("rw-")


def test_memory_is_given_back():
    code = engine.MachineCode()
    address = code.add(kernel(), "f")
    assert mapping(address) == "r-xp"
    del code
    gc.collect()
    assert mapping(address) != "r-xp"


def patched(content: bytes, place: int, form: str, value: int) -> bytes:
    changed = bytearray(content)
    struct.pack_into(form, changed, place, value)
    return bytes(changed)


def first_relocation(content: bytes) -> int:
    (offset,) = struct.unpack_from("<Q", content, 40)
    (count,) = struct.unpack_from("<H", content, 60)
    sections = np.frombuffer(content, elf._SECTION, count, offset)
    return int(sections[sections["kind"] == elf._RELOCATIONS][0]["offset"])


@pytest.mark.parametrize(
    "change",
    [
        lambda content: b"",
        lambda content: b"\xcf\xfa\xed\xfe" + content[4:],  # another format
        lambda content: patched(content, 18, "<H", 183),  # another processor
        lambda content: patched(content, first_relocation(content) + 8, "<I", 2),  # a relative address
    ],
    ids=["empty", "format", "processor", "reference"],
)
def test_what_is_not_understood_is_refused(change):
    with pytest.raises(elf.UnsupportedError):
        elf.Image(change(kernel()), engine.process_symbol)


def test_a_symbol_that_nobody_defines_is_refused():
    with pytest.raises(elf.UnsupportedError, match="is not found"):
        elf.Image(kernel(), lambda name: 0)


def test_llvm_takes_over_what_is_refused(monkeypatch):
    content = kernel()
    place = engine.MachineCode()
    own = results(place.add(content, "f"))

    def refuse(*arguments):
        raise elf.UnsupportedError("not today")

    monkeypatch.setattr(elf, "Image", refuse)
    other = engine.MachineCode()
    assert results(other.add(content, "f")) == own
    with pytest.raises(RuntimeError, match="no symbol 'g'"):
        other.address("g")
