"""Kernels of constrained models that survive dependent constraints: the straight-line code, guarded.

The guard is a trampoline in machine code with the ABI's signature. It calls the straight-line kernel, looks
at the pivot ratio, and only then turns to `robust_path`, which is compiled when a run first needs it.
"""

from __future__ import annotations

import ctypes
import sys
import threading
import warnings
from dataclasses import replace
from typing import Any

import numpy as np

from runtime.code import engine
from runtime.code.llvm_text import constant
from runtime.system import System

PIVOT_LIMIT = 1e-6
_SMALL_CORRECTION = 1e-6
_SECONDS_TO_COMPILE = 6.0  # when it is not cached

_USED = (
    "mass_matrix",
    "forces",
    "constraint_jacobian",
    "gamma",
    "constraint_residual",
    "energy",
    "rhs",
    "project",
)
_PATH = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p
)
_lock = threading.Lock()


def robust_rhs_address(system: System) -> tuple[int, Any]:
    """Return the address of a `rhs` that survives dependent constraints, and what must be kept alive with it.

    It takes a prepared `p` (`System.prepared`) and writes the same row. Where the straight-line pivot ratio is below
    1e-6 or not a number, accelerations and multipliers come from a pivoted factorisation; multipliers that are not
    unique are those of least norm, and the pivot ratio in the row is 0. See `robust_path.robust_rhs` for the power.
    """
    return _guarded(system, "rhs")


def robust_project_address(system: System) -> tuple[int, Any]:
    """Return the address of a `project` that survives dependent constraints, and what it needs alive."""
    return _guarded(system, "project")


def _guarded(system: System, name: str) -> tuple[int, Any]:
    kernel = system.kernel(name)
    if not system.m:
        return kernel.prepared_address, kernel
    with _lock:
        # Kept with the system: the guard refers to it, so a weak dictionary would never let go of either.
        guards = vars(system).setdefault("_guards", {})
        if name not in guards:
            guards[name] = _Guard(system, name)
    return guards[name].address, guards[name]


class _Guard:
    """A trampoline, and all that it points to."""

    def __init__(self, system: System, name: str):
        from runtime.constraints import robust_path

        self._kernels = {key: system.kernel(key) for key in _USED}
        places = np.array(system.quaternions, dtype=np.int64)
        self._context = np.append(np.zeros(robust_path.N_CONTEXT, dtype=np.int64), places)
        for index, key in enumerate(_USED[: robust_path.RHS + 1]):
            self._context[index] = self._kernels[key].prepared_address
        sizes = (system.nq, system.nv, system.nh, system.m, system.nw, system.n_prepared)
        self._context[robust_path.NQ : robust_path.TIME_DEPENDENT] = sizes
        self._context[robust_path.TIME_DEPENDENT] = system.structure["time_dependent"]
        self._context[robust_path.N_QUATERNIONS] = len(places)
        self._name = name
        self._lengths = replace(self._kernels[name].source.lengths, p=system.n_prepared)
        self._first_call = _PATH(self._compile_and_call)
        ir = _rhs_ir(system) if name == "rhs" else _project_ir(system)
        symbol, table = f"guarded_{name}", f"guarded_{name}_table"
        code = engine.object_code(engine.cache_key(ir), symbol, symbol, lambda _: (ir, 0))
        self._code = engine.MachineCode()
        self.address = self._code.add(code, symbol)
        slots = ctypes.c_uint64 * 4
        self._table = slots.from_address(self._code.data_address(table))
        self._table[0] = self._kernels["rhs"].prepared_address
        self._table[1] = self._kernels["project"].prepared_address
        self._table[2] = ctypes.cast(self._first_call, ctypes.c_void_p).value
        self._table[3] = self._context.ctypes.data

    def _compile_and_call(self, context: int, t: float, y: int, p: int, out: int) -> None:
        """Stand in for the compiled path until it is first needed."""
        from runtime.code import numba_setup
        from runtime.constraints import robust_path

        n_out = self._lengths.out
        try:
            if not numba_setup.DISABLE_JIT:
                path = _compiled(self._name)
                self._table[2] = path.address
                _PATH(path.address)(context, t, y, p, out)
                return
            function = getattr(robust_path, f"robust_{self._name}")
            lengths = (self._lengths.y, self._lengths.p, n_out)
            arrays = (_array(address, length) for address, length in zip((y, p, out), lengths))
            function(self._context, t, *arrays)
        except Exception as error:
            # Nothing may be raised through machine code: not-a-number tells the integrator.
            warnings.warn(
                f"the path for dependent constraints failed: {error!r}", RuntimeWarning, stacklevel=2
            )
            _array(out, n_out)[:] = np.nan


def _array(address: int, length: int) -> np.ndarray:
    if not length:
        return np.zeros(0)
    return np.ctypeslib.as_array((ctypes.c_double * length).from_address(address))


def _compiled(name: str):
    """Return the path as a C function: the same for all models, compiled once for all processes."""
    if "runtime.constraints.guarded_calls" not in sys.modules:
        engine.announce("the path for dependent constraints", 0, _SECONDS_TO_COMPILE)
    from runtime.constraints import guarded_calls

    return getattr(guarded_calls, f"{name}_path")


_CALL = "call void %{0}(double %t, ptr %y, ptr %p, ptr %{1})"
_HEAD = """@{symbol}_table = global [4 x ptr] zeroinitializer
declare double @llvm.fabs.f64(double)
define void @{symbol}(double %t, ptr %y, ptr %p, ptr %out) nounwind {{
%rhs = load ptr, ptr @{symbol}_table
%project.at = getelementptr inbounds ptr, ptr @{symbol}_table, i64 1
%project = load ptr, ptr %project.at
"""
_SLOW = """slow:
%path.at = getelementptr inbounds ptr, ptr @{symbol}_table, i64 2
%path = load ptr, ptr %path.at
%context.at = getelementptr inbounds ptr, ptr @{symbol}_table, i64 3
%context = load ptr, ptr %context.at
call void %path(ptr %context, double %t, ptr %y, ptr %p, ptr %out)
ret void
done:
ret void
}}
"""


def _ratio_check(row: str, index: int) -> str:
    # Written so that nan is slow; a ratio is never above 1, so infinity is slow as well.
    return f"""%ratio.at = getelementptr inbounds double, ptr %{row}, i64 {index}
%ratio = load double, ptr %ratio.at
%high = fcmp oge double %ratio, {constant(PIVOT_LIMIT)}
%low = fcmp ole double %ratio, 2.0
%sound = and i1 %high, %low
br i1 %sound, label %done, label %slow
"""


def _rhs_ir(system: System) -> str:
    body = _CALL.format("rhs", "out") + "\n" + _ratio_check("out", system.n_row - 1)
    return _HEAD.format(symbol="guarded_rhs") + body + _SLOW.format(symbol="guarded_rhs")


def _project_ir(system: System) -> str:
    """A small correction is right or harmless; for a large one the pivot ratio at the state is looked at."""
    symbol, limit = "guarded_project", constant(_SMALL_CORRECTION)
    body = f"""{_CALL.format("project", "out")}
br label %loop
loop:
%i = phi i64 [0, %0], [%next, %more]
%y.at = getelementptr inbounds double, ptr %y, i64 %i
%out.at = getelementptr inbounds double, ptr %out, i64 %i
%old = load double, ptr %y.at
%new = load double, ptr %out.at
%move = fsub double %new, %old
%distance = call double @llvm.fabs.f64(double %move)
%size = call double @llvm.fabs.f64(double %old)
%size.1 = fadd double %size, 1.0
%allowed = fmul double %size.1, {limit}
%small = fcmp ole double %distance, %allowed
br i1 %small, label %more, label %check
more:
%next = add i64 %i, 1
%last = icmp eq i64 %next, {system.nq + system.nv}
br i1 %last, label %done, label %loop
check:
%row = alloca double, i64 {system.n_row}
{_CALL.format("rhs", "row")}
"""
    return (
        _HEAD.format(symbol=symbol)
        + body
        + _ratio_check("row", system.n_row - 1)
        + _SLOW.format(symbol=symbol)
    )
