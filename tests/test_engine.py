"""The object cache: hits do no work, damage is noticed, untrusted folders are refused."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from symgen.runtime.code import cache, compiler, engine
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.modules import lower_function

ROOT = Path(__file__).parent.parent
TEXT = "def f(t, y, p, out):\n    out[0] = sin(y[0]) * p[0] + tan(t)\n"
PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)


class Lowering:
    """`lower` for `object_code`, counting its calls."""

    def __init__(self, text: str = TEXT):
        self.text, self.calls = text, 0

    def __call__(self, symbol: str) -> tuple[str, int]:
        self.calls += 1
        lowered = lower_function(FunctionText("f", self.text, Lengths(1, 1, 1)), symbol)
        return lowered.ir, lowered.operations


def value(object_code: bytes) -> float:
    code = engine.MachineCode()
    y, p, out = np.array([0.5]), np.array([2.0]), np.zeros(1)
    PROTOTYPE(code.add(object_code, "f"))(0.25, y.ctypes.data, p.ctypes.data, out.ctypes.data)
    return out[0]


EXPECTED = np.sin(0.5) * 2.0 + np.tan(0.25)


def test_second_time_neither_parses_nor_lowers(tmp_path):
    lower, key = Lowering(), engine.cache_key(TEXT)
    first = engine.object_code(key, "f", "f", lower, tmp_path)
    second = engine.object_code(key, "f", "f", lower, tmp_path)
    assert lower.calls == 1
    assert first == second
    assert value(second) == pytest.approx(EXPECTED, rel=1e-15)
    assert [path.suffix for path in tmp_path.iterdir()] == [".o"]


def test_key_follows_text_and_tools(monkeypatch):
    key = engine.cache_key(TEXT)
    assert engine.cache_key(TEXT) == key
    assert engine.cache_key(TEXT + " ") != key
    monkeypatch.setattr(engine, "tools", lambda: "another compiler")
    assert engine.cache_key(TEXT) != key


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "foreign", "bare"])
def test_damaged_object_is_compiled_again(tmp_path, damage):
    lower, key = Lowering(), engine.cache_key(TEXT)
    code = engine.object_code(key, "f", "f", lower, tmp_path)
    (path,) = tmp_path.iterdir()
    data = bytearray(path.read_bytes())
    if damage == "flip":
        data[len(data) // 2] ^= 4
    contents = {
        "flip": bytes(data),
        "cut": bytes(data[:-7]),
        "empty": b"",
        "foreign": b"\x7fELF" * 100,
        "bare": code,
    }
    path.write_bytes(contents[damage])
    again = engine.object_code(key, "f", "f", lower, tmp_path)
    assert lower.calls == 2
    assert value(again) == pytest.approx(EXPECTED, rel=1e-15)
    assert cache.fetch(path) == again


def test_unwritable_cache_still_gives_code(tmp_path):
    with pytest.warns(cache.CacheWarning, match="could not be written"):
        code = engine.object_code(engine.cache_key(TEXT), "f", "f", Lowering(), tmp_path / "absent")
    assert value(code) == pytest.approx(EXPECTED, rel=1e-15)


def test_code_stays_valid_while_more_is_added():
    code = engine.MachineCode()
    y, p, out = np.array([0.5]), np.array([2.0]), np.zeros(1)
    addresses = []
    for index in range(5):
        text = f"def f(t, y, p, out):\n    out[0] = y[0] + {index}.0\n"
        ir = lower_function(FunctionText("f", text, Lengths(1, 1, 1)), f"f{index}").ir
        addresses.append(code.add(compiler.compile_ir(ir), f"f{index}"))
    for index, address in enumerate(addresses):
        PROTOTYPE(address)(0.0, y.ctypes.data, p.ctypes.data, out.ctypes.data)
        assert out[0] == 0.5 + index
    with pytest.raises(ValueError, match="already"):
        code.add(b"", "f0")


def test_listener_hears_of_long_compilations_only(tmp_path, monkeypatch):
    heard = []
    monkeypatch.setattr(engine, "_listener", None)
    engine.set_compile_listener(lambda *what: heard.append(what))
    engine.object_code(engine.cache_key(TEXT), "f", "f", Lowering(), tmp_path)
    assert heard == []
    monkeypatch.setattr(engine, "_LONG_COMPILE", 1e-5)
    engine.object_code(engine.cache_key(TEXT + "#"), "f", "f", Lowering(), tmp_path)
    engine.object_code(engine.cache_key(TEXT + "#"), "f", "f", Lowering(), tmp_path)
    assert [(name, operations) for name, operations, _ in heard] == [("f", 4)]


def test_next_process_loads_what_this_one_compiled(tmp_path):
    script = f"""
import sys, warnings
warnings.simplefilter("error")
from symgen.runtime import kernel, load
if sys.argv[1] == "second":
    def refuse(*a, **k): raise AssertionError("lowered again")
    kernel.lower_function = kernel.lower_kernel = refuse
system = load({str(ROOT / "tests" / "fixtures" / "double_pendulum.py")!r})
out = system.kernel("rhs")(0.0, [1.0, 2.0, 3.0, 4.0], system.parameter_values())
print(out.tobytes().hex(), "numba" in sys.modules)
"""
    environment = {**os.environ, "SYMGEN_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    printed = [
        subprocess.run(
            [sys.executable, "-c", script, which], env=environment, capture_output=True, text=True, check=True
        ).stdout
        for which in ("first", "second")
    ]
    assert printed[0] == printed[1]
    assert printed[0].split()[1] == "False"  # a kernel needs no Numba


def test_folder_that_cannot_be_made_is_replaced(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "file" / "below"))
    with pytest.warns(cache.CacheWarning, match="cannot be made"):
        folder = cache.cache_folder()
    assert folder.is_dir()


def test_folder_follows_the_environment(tmp_path, monkeypatch):
    monkeypatch.delenv("SYMGEN_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache.cache_folder() == tmp_path / "symgen"
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "own"))
    assert cache.cache_folder("a", "b") == tmp_path / "own" / "a" / "b"


def test_prune_keeps_the_newest(tmp_path):
    for index in range(6):
        path = tmp_path / f"{index}.o"
        path.write_bytes(b"")
        os.utime(path, (index, index))
    cache.prune(tmp_path, 2, "*.o")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["4.o", "5.o"]


def test_prune_takes_a_tenth_more_so_that_the_next_files_need_no_look(tmp_path):
    for index in range(21):
        path = tmp_path / f"{index:02}.o"
        path.write_bytes(b"")
        os.utime(path, (index, index))
    cache.prune(tmp_path, 21)
    assert len(list(tmp_path.iterdir())) == 21
    cache.prune(tmp_path, 20)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{index:02}.o" for index in range(3, 21)]
