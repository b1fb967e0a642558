"""Numba as the run time uses it: the `jit` decorator, and a disk cache that never serves stale code."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import platform
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba import config

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.bridge_numba import teach
from symgen.runtime.code.cache import cache_folder, foreign_below, prune, trusted_folder

teach(call_kernel)
DISABLE_JIT = bool(config.DISABLE_JIT)
_KEPT_CACHES = 3


def sources_hash() -> str:
    """Return the hash of all that compiled integrators depend on.

    Numba's own key is the file in which a function stands: an edit of a function that it calls, or
    `NUMBA_BOUNDSCHECK`, leaves it stale.
    """
    folder = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0")
        digest.update(path.read_bytes())
    versions = (numba.__version__, llvmlite.__version__, platform.python_version())
    flags = (DISABLE_JIT, config.BOUNDSCHECK, config.OPT, config.DEBUGINFO_DEFAULT)
    digest.update(repr((versions, flags)).encode())
    return digest.hexdigest()[:20]


@functools.lru_cache(maxsize=1)
def numba_cache_folder() -> Path:
    """Return the folder of compiled integrators, named by `sources_hash`; older ones beside it are removed.

    It lies below `NUMBA_CACHE_DIR` where the user set that, else in the cache folder. Numba unpickles and executes
    what it finds there, so the folder is closed to all others, and emptied if something in it is not the user's.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    base = trusted_folder(chosen) if chosen else cache_folder("numba")
    folder = trusted_folder(str(base / f"symgen-{sources_hash()}"))
    try:
        folder.chmod(0o700)
        if foreign_below(folder):
            shutil.rmtree(folder)
            folder.mkdir(mode=0o700)
        os.utime(folder)
    except OSError:
        return cache_folder("numba")
    prune(base, _KEPT_CACHES, "symgen-*")
    return folder


@contextlib.contextmanager
def our_cache() -> Iterator[None]:
    """Let functions decorated inside keep their compiled code in `numba_cache_folder`.

    Numba settles a function's cache when it decorates it. So the setting is changed for that moment only,
    which works whether or not Numba was imported before, and leaves the caches of the user's own functions
    alone.
    """
    before = config.CACHE_DIR
    config.CACHE_DIR = str(numba_cache_folder())
    try:
        yield
    finally:
        config.CACHE_DIR = before


def jit(function: Callable | None = None, **options: Any) -> Any:
    """Compile `function` on its first call, once for all processes (`numba.njit` with our settings).

    Division by zero gives inf or nan as in NumPy, so that kernels can report it; the interpreter's lock is
    released. Options are those of `numba.njit`. With `NUMBA_DISABLE_JIT=1` the function is returned as it is.
    """
    if function is None:
        return functools.partial(jit, **options)
    settings = {"cache": True, "error_model": "numpy", "nogil": True, **options}
    with our_cache():
        return numba.njit(**settings)(function)
