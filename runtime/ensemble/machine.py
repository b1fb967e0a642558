"""Machine code of ensembles: the loop of a method, for all models, and a model's functions in lanes."""

from __future__ import annotations

import ctypes
import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symgen.runtime.code import engine
from symgen.runtime.code.lower import NoLanes
from symgen.runtime.ensemble import dop853, radau, runge_kutta, taylor, verlet
from symgen.runtime.ensemble.lanes import (
    BEGIN,
    MAP,
    RUN,
    Lanes,
    function_begin,
    function_load,
    function_map,
    function_run,
    function_store,
)
from symgen.runtime.ensemble.writer import Value
from symgen.runtime.errors import Refusal
from symgen.runtime.integrate.methods.runge_kutta import rk4
from symgen.runtime.integrate.radau.coefficients import NODES
from symgen.runtime.lazy import Late
from symgen.runtime.record import record
from symgen.runtime.taylor.kernel import has_unheld_choices, series_code, taylor_refusal

if TYPE_CHECKING:
    from symgen.runtime.system import System

modules = Late("symgen.runtime.code.modules")
composition = Late("symgen.runtime.ensemble.composition")
rattle = Late("symgen.runtime.ensemble.rattle")

_READ = (
    "after_step.py",
    "composition.py",
    "explicit/dop853.py",
    "explicit/tableau.py",
    "jacobian.py",
    "linear.py",
    "newton.py",
    "plain_events.py",
    "radau/coefficients.py",
    "radau/loop.py",
    "radau/newton.py",
    "rattle/step.py",
    "taylor.py",
    "projection.py",
    "quaternions.py",
    "step_control.py",
)  # by the loops
_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_void_p)  # it lets other threads run


@record(eq=False)
class LaneLoop:
    """The loop of a method: `begin(table)`, then `run(table)`, see `lanes`."""

    begin: Callable[[int], None]
    run: Callable[[int], None]
    _code: Any


RATTLE = ("rattle", "rattle4", "rattle6")
COMPOSED = ("verlet4", "verlet6", "verlet8")
_LOOP_OF = {name: family[0] for family in (RATTLE, COMPOSED) for name in family}  # their orders are numbers
# What a method begins with, and one step.
METHODS = {
    "dop853": (dop853.begin, dop853.attempt),
    "taylor": (taylor.begin, taylor.attempt),
    "rk4": (runge_kutta.begin, runge_kutta.attempt_of(rk4)),
    "verlet": (runge_kutta.begin, verlet.attempt),
    **dict.fromkeys(COMPOSED, (runge_kutta.begin, lambda lanes, active: composition.attempt(lanes, active))),
    **dict.fromkeys(RATTLE, (runge_kutta.begin, lambda lanes, active: rattle.attempt(lanes, active))),
    **{f"radau{2 * n - 1}": (radau.begin_of(n), radau.attempt_of(n)) for n in NODES},
}
IN_LANES = tuple(METHODS)
IMPLICIT = tuple(name for name in IN_LANES if name.startswith("radau"))
MAY_LEAVE = (*IMPLICIT, *RATTLE)  # where factors cannot be trusted, members leave lanes
ON_DEVICES = tuple(name for name in IN_LANES if name not in (*MAY_LEAVE, *COMPOSED))
OVER_EVENTS = ("dop853", "taylor", *IMPLICIT)


@functools.lru_cache(maxsize=16)
def lane_loop(method: str, lanes: int, *, with_quaternions: bool = True) -> LaneLoop:
    """Return the loop of a method for so many lanes, compiled on first use on this machine.

    Of methods whose steps are long without quaternions, there is one that leaves these out.
    """
    with_quaternions = with_quaternions or method not in MAY_LEAVE
    method = _LOOP_OF.get(method, method)
    key = engine.cache_key(f"lanes {method} {lanes} {with_quaternions} {_generator()}")
    code = engine.MachineCode()
    content = engine.object_code(
        key,
        f"lanes of {method}",
        RUN,
        lambda _: (loop_ir(method, lanes, with_quaternions=with_quaternions), 0),
        kind=engine.LOOPS,
    )
    run = code.add(content, RUN)
    return LaneLoop(_PROTOTYPE(code.address(BEGIN)), _PROTOTYPE(run), code)


@functools.lru_cache(maxsize=1)
def lane_map(lanes: int) -> tuple[Callable[[int], None], Any]:
    """Return `map(table)`, see `lanes.function_map`, and what holds its code."""
    key = engine.cache_key(f"map {lanes} {_generator()}")
    code = engine.MachineCode()

    def lower(_: str) -> tuple[str, int]:
        function = function_map(lanes)
        return "\n".join([*sorted(function.declared), function.text()]), 0

    return _PROTOTYPE(
        code.add(engine.object_code(key, "map of lanes", MAP, lower, kind=engine.LOOPS), MAP)
    ), code


def loop_ir(method: str, lanes: int, *, with_quaternions: bool) -> str:
    """Return the LLVM IR of the loop of a method."""
    begin, attempt = METHODS[method]

    def attempt_one(lanes: Lanes, active: Value) -> Value:
        lanes.with_quaternions = with_quaternions
        return attempt(lanes, active)

    functions = [
        function_load(lanes), function_store(lanes), function_begin(lanes, begin), function_run(lanes, attempt_one)
    ]  # fmt: skip
    declared = sorted({line for function in functions for line in function.declared})
    return "\n".join([*declared, *(function.text() for function in functions)])


def lane_kernel(system: System, name: str, lanes: int) -> int:
    """Return the address of a model's function in lanes, of which the model owns the code.

    Raises
    ------
    symgen.runtime.code.lower.NoLanes
        It can only be had for one member at a time; says why.
    """
    known = system.__dict__.setdefault("_lane_kernels", {})
    with system.__dict__["_lock"]:  # threads ask for the same ones at the same time
        if (name, lanes) not in known:
            known[name, lanes] = _compiled(system, name, lanes)
    return known[name, lanes]


def _compiled(system: System, name: str, lanes: int) -> int:
    source, symbol = system._kernel_source(name), f"symgen_{name}_{lanes}"

    def lower(symbol: str) -> tuple[str, int]:
        lowered = modules.lower_lanes(source.code, symbol, source.n_hoisted, source.offset, lanes)
        return lowered.ir, lowered.operations

    key = engine.cache_key(f"{symbol}\0{source.key_text()}")
    return system.machine_code().add(engine.object_code(key, name, symbol, lower), symbol)


def lane_series(system: System, lanes: int) -> tuple[int, tuple[float, float, float]]:
    """Return the address of the kernel of Taylor series in lanes, and what a series costs by its order.

    Raises
    ------
    Refusal
        The model has no series.
    NoLanes
        It has, but for one member at a time.
    """
    known = system.__dict__.setdefault("_lane_kernels", {})
    with system.__dict__["_lock"]:
        if ("series", lanes) not in known:
            reason = taylor_refusal(system)
            if reason:
                raise Refusal(f"method taylor {reason}")
            if has_unheld_choices(system):
                raise NoLanes(
                    "its forces have kinks at which no step ends, and series of lanes do not look for them"
                )
            code, symbol = series_code(system, lanes)
            address = system.machine_code().add(code, symbol)
            costs = (ctypes.c_double * 3).from_address(system.machine_code().address(f"{symbol}.costs"))
            known["series", lanes] = address, tuple(costs)
    return known["series", lanes]


@functools.lru_cache(maxsize=1)
def _generator() -> str:
    """Hash of the sources that decide what a loop is."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for path in (*sorted(folder.glob("*.py")), *(folder.parent / "integrate" / name for name in _READ)):
        digest.update(path.read_bytes())
    return digest.hexdigest()
