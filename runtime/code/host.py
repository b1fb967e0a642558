"""What LLVM compiles for on this machine, without loading LLVM where it has said so before."""

from __future__ import annotations

import ast
import functools
import hashlib
import os
from importlib.util import find_spec
from pathlib import Path

from symgen.runtime.code import cache
from symgen.runtime.lazy import Late

compiler = Late("symgen.runtime.code.compiler")

_PROCESSOR = Path("/proc/cpuinfo")
# What the kernel says of a processor that stays the same; x86, then ARM.
_FIXED = (
    "vendor_id", "cpu family", "model", "model name", "stepping", "flags",
    "Features", "CPU implementer", "CPU architecture", "CPU variant", "CPU part", "CPU revision",
)  # fmt: skip
_READ = 1 << 14  # bytes; the first processor's entry is shorter
_KEPT = 20


@functools.lru_cache(maxsize=1)
def target() -> tuple:
    """Return LLVM's version, the platform, the processor's name and features, as LLVM calls them.

    They are remembered in the cache folder by the processor as the operating system describes it and by the build of
    llvmlite; where it does not describe it, LLVM is asked each time.
    """
    machine = _machine()
    if not machine:
        return _ask()
    folder = cache.cache_folder("targets")
    path = folder / hashlib.sha256(machine.encode()).hexdigest()[:40]
    known = cache.fetch(path)
    if known is not None:
        return ast.literal_eval(known.decode())
    answer = _ask()
    if cache.store(path, repr(answer).encode()):
        cache.prune(folder, _KEPT)
    return answer


def has_wide_registers() -> bool:
    """Whether this processor's registers hold eight numbers."""
    return "+avx512f" in target()[-1]


def _ask() -> tuple:
    return compiler.target()


def _machine() -> str:
    """Return a text on which LLVM's answer depends; empty where the operating system does not give one."""
    try:
        with _PROCESSOR.open("rb") as file:
            first = file.read(_READ).decode(errors="replace").partition("\n\n")[0]
    except OSError:
        return ""
    entries = dict(line.split(":", 1) for line in first.split("\n") if ":" in line)
    said = {name.strip(): value.strip() for name, value in entries.items() if name.strip() in _FIXED}
    if "flags" not in said and "Features" not in said:
        return ""
    return repr((sorted(said.items()), tuple(os.uname())[4], package_version("llvmlite"), _library_sizes()))


@functools.lru_cache(maxsize=4)
def package_version(package: str) -> str:
    """The version of a package as it states it itself: asking `importlib.metadata` takes longer than many runs."""
    found = find_spec(package)
    return Path(found.origin).with_name("_version.py").read_text(encoding="utf-8") if found else ""


def _library_sizes() -> list[tuple[str, int]]:
    """Names and sizes of the libraries in llvmlite: the same version may be built with another LLVM."""
    found = find_spec("llvmlite")
    libraries = Path(found.origin).with_name("binding").glob("*llvmlite*") if found else ()
    return sorted((path.name, path.stat().st_size) for path in libraries)
