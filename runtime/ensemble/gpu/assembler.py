"""NVIDIA's assembler, of the extra `gpu` or of a CUDA toolkit: from PTX to machine code, and the registers it needs."""

from __future__ import annotations

import functools
import importlib.util
import os
import re
import shutil
import subprocess
import tempfile
import time
from dataclasses import field
from pathlib import Path

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.record import record

_PACKAGES = ("nvidia.cuda_nvcc", "nvidia.cu13")  # of CUDA 12, of 13
_TOOLKIT = ("CUDA_HOME", "CUDA_PATH")  # where people say that theirs is
_TIMEOUT = 600.0  # seconds
_ARCH = re.compile(r"'(sm_\d{2,3}[af]?)'")


@record
class Assembled:
    """What the assembler made of a program.

    Attributes
    ----------
    arch : str
    code : bytes
        Machine code (a cubin).
    registers : int
        Of 32 bits, for a thread: a number takes two, and there are 255.
    spill_stores, spill_loads : int
        Bytes that are moved between registers and memory for want of registers, in the program's text.
    stack : int
        Bytes of memory for a thread's arrays, and what is spilled.
    seconds : float
    """

    arch: str
    code: bytes = field(repr=False)
    registers: int
    spill_stores: int
    spill_loads: int
    stack: int
    seconds: float

    @property
    def size(self) -> int:
        """Bytes of machine code."""
        return len(self.code)


def find_assembler() -> Path | None:
    """Return where the assembler is: of NVIDIA's package, else of an installed CUDA toolkit; None without one."""
    return _of_package() or _of_toolkit()


def _of_package() -> Path | None:
    for package in _PACKAGES:
        try:
            found = importlib.util.find_spec(package)
        except ImportError:
            continue
        for folder in (found.submodule_search_locations or ()) if found else ():
            for name in ("ptxas", "ptxas.exe"):
                path = Path(folder) / "bin" / name
                if path.is_file():
                    return path
    return None


def _of_toolkit() -> Path | None:
    folders = [Path(os.environ[name]) / "bin" for name in _TOOLKIT if os.environ.get(name)]
    found = shutil.which(
        "ptxas", path=os.pathsep.join([*map(str, folders), os.environ.get("PATH", os.defpath)])
    )
    return Path(found) if found else None


def needed_assembler() -> Path:
    """Return where the assembler is.

    Raises
    ------
    RuntimeModelError
        There is none.
    """
    program = find_assembler()
    if program is None:
        raise RuntimeModelError(
            "there is no assembler for graphics processors here: it comes with pip install 'symgen[gpu]' (NVIDIA's "
            "package nvidia-cuda-nvcc-cu12), or with a CUDA toolkit whose ptxas is on PATH or below CUDA_HOME"
        )
    return program


@functools.lru_cache(maxsize=4)
def _said(program: Path, *arguments: str | Path) -> tuple[int, str]:
    """What the assembler says, and its exit status."""
    try:
        run = subprocess.run(
            [program, *arguments], capture_output=True, text=True, timeout=_TIMEOUT, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RuntimeModelError(f"the assembler {program} does not work here: {error}") from None
    return run.returncode, run.stdout + run.stderr


def assembler_version() -> str:
    """Return what the assembler calls itself, such as V12.9.86.

    Raises
    ------
    RuntimeModelError
        There is none.
    """
    found = re.search(r"V\d[\d.]*", _said(needed_assembler(), "--version")[1])
    return found[0] if found else ""


def check_arch(arch: str) -> None:
    """Refuse what names no architecture that the assembler knows.

    Raises
    ------
    RuntimeModelError
        It does not, or there is no assembler.
    """
    known = sorted(set(_ARCH.findall(_said(needed_assembler(), "--help")[1])), key=lambda a: (len(a), a))
    if arch not in known:
        raise RuntimeModelError(
            f"NVIDIA's assembler knows no architecture {arch!r}: give one of {', '.join(known)}; sm_80 is an A100, "
            "sm_89 an L4 or RTX 40, sm_90 an H100"
        )


def assemble(ptx: str, arch: str) -> Assembled:
    """Assemble PTX.

    Raises
    ------
    RuntimeModelError
        There is no assembler, no such architecture, or the assembler objects.
    """
    check_arch(arch)
    program = needed_assembler()
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "members.ptx", Path(folder) / "members.cubin"
        source.write_text(ptx, encoding="ascii")
        began = time.perf_counter()
        status, said = _said.__wrapped__(program, "-v", "-O3", f"-arch={arch}", "-o", target, source)
        seconds = time.perf_counter() - began
        if status or not target.is_file():
            first = next((line for line in said.splitlines() if line.strip()), "it says nothing")
            raise RuntimeModelError(
                f"NVIDIA's assembler has no machine code of the program for {arch}: "
                f"{first.replace(str(source), 'line')}"
            )
        return _read(said, arch, target.read_bytes(), seconds)


def _read(said: str, arch: str, code: bytes, seconds: float) -> Assembled:
    def numbers(pattern: str) -> list[int]:
        return [int(found) for found in re.findall(pattern, said)]

    frames = numbers(r"(\d+) bytes stack frame")
    return Assembled(
        arch, code, max(numbers(r"Used (\d+) registers"), default=0),
        sum(numbers(r"(\d+) bytes spill stores")), sum(numbers(r"(\d+) bytes spill loads")),
        max([*numbers(r"(\d+) bytes cumulative stack size"), *frames], default=0), seconds,
    )  # fmt: skip
