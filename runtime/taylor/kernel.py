"""The kernel that computes a model's Taylor coefficients, as machine code."""

from __future__ import annotations

import ctypes
import functools
import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code import cache, engine
from symgen.runtime.lazy import Late
from symgen.runtime.taylor.refusal import Refusal
from symgen.runtime.taylor.sums import sum_kernel

if TYPE_CHECKING:
    from symgen.runtime.system import System

# What finds, plans and writes series is not imported where their code is in the cache.
loops = Late("symgen.runtime.taylor.loops")
motion = Late("symgen.runtime.taylor.motion")
planning = Late("symgen.runtime.taylor.plan")

MAX_ORDER = 28
N_ROWS = MAX_ORDER + 2  # a row of zeros behind the last order
_UNROLLED_BELOW = 5  # products of series
_KEPT_REFUSALS = 1000
_TEXTS = (
    "rhs", "residual", "mass_matrix", "constraint_jacobian", "constraint_residual", "poses", "switches",
    "closed_constraint_jacobian",
)  # fmt: skip


def taylor_addresses(system: System) -> tuple[np.uint64, np.uint64, float, float, float]:
    """Return the addresses of two kernels, compiled on first use, and what a step costs; `system` owns their code.

    The first is the model's `f(t, y, p, out)`: it reads the order wanted from out[0], 5 to MAX_ORDER. Row k of `out`
    (NY long) receives the coefficients of order k of (q, v, w), behind N_ROWS rows comes the smallest pivot ratio.
    The second sums a series, see `sums.py`. A step of order p costs as much as c0 + c1 p + c2 p^2 operations.

    Raises
    ------
    Refusal
        Something in the model has no Taylor series.
    """
    if "_taylor" not in system.__dict__:
        if system.has_feedback:
            raise Refusal(
                "what a controller that acts at every instant does has no Taylor series; sampled, it has"
            )
        symbol = "symgen_taylor"
        texts = [system.source.functions.get(name, "") for name in _TEXTS]
        polynomials = sorted(system.input_polynomials.items())
        switched = sorted(system.switched.items())
        sizes = (
            system.nq, system.nv, system.nh, system.nn, system.nw, system.n_p, polynomials, switched, system.dependent,
            system.switches,
        )  # fmt: skip
        key = engine.cache_key("\0".join((_generator(), repr((sizes, system.source.tables)), *texts)))
        code = engine.object_code(key, "taylor", symbol, functools.partial(_lower_or_refuse, system, key))
        address = system.machine_code().add(code, symbol)
        costs = (ctypes.c_double * 3).from_address(system.machine_code().address(f"{symbol}.costs"))
        system.__dict__["_taylor"] = (np.uint64(address), np.uint64(_sum_address(system)), *costs)
    return system.__dict__["_taylor"]


def taylor_refusal(system: System) -> str:
    """Return why the model has no Taylor series, and what to use instead; an empty string where it has."""
    try:
        for form in (system, system.closed) if system.switches and not system.switched else (system,):
            taylor_addresses(form)
    except Refusal as refusal:
        return f"does not fit model {system.name!r}: {refusal}; use dop853, or radau5 if the model is stiff"
    return ""


def _sum_address(system: System) -> int:
    symbol = "symgen_taylor_sum"
    ir = sum_kernel(symbol, system.ny)
    code = engine.object_code(engine.cache_key(ir), "taylor", symbol, lambda _: (ir, 0))
    return system.machine_code().add(code, symbol)


def _lower_or_refuse(system: System, key: str, symbol: str) -> tuple[str, int]:
    """As `_lower`, but a refusal is remembered like a kernel: to find it takes as long."""
    folder = cache.cache_folder("refusals")
    said = cache.fetch(folder / key)
    if said is not None:
        raise Refusal(said.decode())
    try:
        return _lower(system, symbol)
    except Refusal as refusal:
        if cache.store(folder / key, str(refusal).encode()):
            cache.prune(folder, _KEPT_REFUSALS)
        raise


def _lower(system: System, symbol: str) -> tuple[str, int]:
    for name in _TEXTS:
        if system.has(name):
            system._kernel_source(name).lower("checked")
    plan = planning.Plan(motion.read_motion(system))
    few = len(plan.convolutions) < _UNROLLED_BELOW
    return (loops.unrolled_kernel if few else loops.rolled_kernel)(plan, symbol, system.ny, MAX_ORDER, N_ROWS)


@functools.lru_cache(maxsize=1)
def _generator() -> str:
    """Hash of the sources that decide what a kernel is."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for path in (*sorted(folder.glob("*.py")), *sorted((folder.parent / "graph").glob("*.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()
