"""Kernels of a constrained model for runs with Baumgarte's stabilisation: `rhs` with a force held over each step."""

from __future__ import annotations

import ctypes
import threading
from typing import Any

import numpy as np

from symgen.runtime.code import engine
from symgen.runtime.code.llvm_text import loop
from symgen.runtime.constraints.kkt import robust_project_address, robust_rhs_address
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.baumgarte import N_GAINS
from symgen.runtime.system import System

_lock = threading.Lock()


def baumgarte_versions(system: System) -> dict[int, tuple[int, Any]]:
    """Return the kernels that stabilised runs call, see `Method.versions`.

    RHS adds the accelerations that stand behind the precomputed `p` and the gains. STABILISE is the guarded `project`,
    from which `integrate.baumgarte` takes them. PROJECT leaves the state as it is: only quaternions are to be scaled,
    which `project_state` does before it.
    """
    with _lock:
        # Kept with the system, as the guarded kernels are.
        kept = vars(system).setdefault("_baumgarte", {})
        if not kept:
            kept[at.RHS] = _rhs(system)
            kept[at.PROJECT] = _unchanged(system) if system.quaternions else (0, None)
            kept[at.STABILISE] = robust_project_address(system)
    return kept


def unheld_versions(system: System) -> dict[int, tuple[int, Any]]:
    """Return the kernels of runs in which nothing brings states back onto constraints: see PROJECT above."""
    return {at.PROJECT: baumgarte_versions(system)[at.PROJECT]}


def baumgarte_tail(system: System, gains: tuple[float, float]) -> np.ndarray:
    """Return what runs carry behind the precomputed `p`: the gains, then accelerations, none so far."""
    return np.concatenate([gains, np.zeros(system.nv)])


def _rhs(system: System) -> tuple[int, Any]:
    address, owner = robust_rhs_address(system)
    add = loop(
        "add_held", {"p": "ptr", "out": "ptr"}, str(system.nv), [],
        [
            f"%i = add i64 %k, {system.nq}",
            f"%j = add i64 %k, {system.n_precomputed + N_GAINS}",
            "%to = getelementptr inbounds double, ptr %out, i64 %i",
            "%from = getelementptr inbounds double, ptr %p, i64 %j",
            "%a = load double, ptr %to",
            "%b = load double, ptr %from",
            "%sum = fadd double %a, %b",
            "store double %sum, ptr %to",
        ],
    )  # fmt: skip
    ir = f"""@baumgarte_rhs_table = global [1 x ptr] zeroinitializer
{add}
define void @baumgarte_rhs(double %t, ptr %y, ptr %p, ptr %out) nounwind {{
%rhs = load ptr, ptr @baumgarte_rhs_table
call void %rhs(double %t, ptr %y, ptr %p, ptr %out)
call void @add_held(ptr %p, ptr %out)
ret void
}}
"""
    code, own = _machine_code(ir, "baumgarte_rhs")
    ctypes.c_uint64.from_address(code.address("baumgarte_rhs_table")).value = address
    return own, (code, owner)


def _unchanged(system: System) -> tuple[int, Any]:
    """Make a `project` that hands the state through and reports no residual."""
    n = system.nq + system.nv
    copy = loop(
        "hand_through", {"y": "ptr", "out": "ptr"}, str(n), [],
        [
            "%from = getelementptr inbounds double, ptr %y, i64 %k",
            "%to = getelementptr inbounds double, ptr %out, i64 %k",
            "%a = load double, ptr %from",
            "store double %a, ptr %to",
        ],
    )  # fmt: skip
    zeros = "\n".join(
        f"%r{i} = getelementptr inbounds double, ptr %out, i64 {i}\nstore double 0.0, ptr %r{i}"
        for i in range(n, n + system.nh + system.m)
    )
    ir = f"""{copy}
define void @unchanged(double %t, ptr %y, ptr %p, ptr %out) nounwind {{
call void @hand_through(ptr %y, ptr %out)
{zeros}
ret void
}}
"""
    code, address = _machine_code(ir, "unchanged")
    return address, code


def _machine_code(ir: str, symbol: str) -> tuple[engine.MachineCode, int]:
    code = engine.MachineCode()
    return code, code.add(engine.object_code(engine.cache_key(ir), symbol, symbol, lambda _: (ir, 0)), symbol)
