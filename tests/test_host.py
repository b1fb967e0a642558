"""What LLVM compiles for is remembered by what the operating system says of the processor."""

from __future__ import annotations

import pytest

from symgen.runtime.code import compiler, host

CPUINFO = """processor\t: 0
vendor_id\t: GenuineIntel
model name\t: Some CPU @ 2.00GHz
cpu MHz\t\t: {speed}
flags\t\t: fpu sse2 {flag}

processor\t: 1
flags\t\t: fpu sse2 avx512f
"""


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """A machine that one can change; says how often LLVM was asked."""
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(host, "_PROCESSOR", tmp_path / "cpuinfo")
    asked: list[int] = []

    def ask() -> tuple:
        asked.append(1)
        return ((20, 1, 0), "triple", f"cpu{len(asked)}", "+sse2")

    monkeypatch.setattr(host, "_ask", ask)

    def target(speed: str = "2000", flag: str = "avx") -> tuple:
        (tmp_path / "cpuinfo").write_text(CPUINFO.format(speed=speed, flag=flag))
        return host.target.__wrapped__()

    target.asked = asked
    return target


def test_llvm_is_asked_once_for_each_processor(machine):
    first = machine()
    assert first == ((20, 1, 0), "triple", "cpu1", "+sse2")
    assert machine(speed="3100") == first  # what varies does not count, nor do other cores
    assert len(machine.asked) == 1
    assert machine(flag="avx2") != first
    assert machine() == first and len(machine.asked) == 2


def test_another_build_of_llvmlite_is_another_question(machine, monkeypatch):
    machine()
    monkeypatch.setattr(host, "package_version", lambda package: "version = '99'")
    machine()
    assert len(machine.asked) == 2


def test_llvm_is_asked_where_the_system_does_not_describe_the_processor(machine, tmp_path, monkeypatch):
    monkeypatch.setattr(host, "_PROCESSOR", tmp_path / "nowhere")
    assert machine() != machine()
    (tmp_path / "empty").write_text("processor : 0\nBogoMIPS : 50\n")
    monkeypatch.setattr(host, "_PROCESSOR", tmp_path / "empty")
    machine()
    assert len(machine.asked) == 3


def test_the_answer_is_that_of_llvm():
    assert host.target() == compiler.target()
