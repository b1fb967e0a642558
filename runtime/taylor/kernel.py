"""The kernel that computes a model's Taylor coefficients, as machine code."""

from __future__ import annotations

import ctypes
import functools
import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code import cache, engine
from symgen.runtime.code.host import has_wide_registers
from symgen.runtime.errors import Refusal
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.system import System

# What finds, plans and writes series is not imported where their code is in the cache.
coding = Late("symgen.runtime.taylor.code")
graphs = Late("symgen.runtime.taylor.graph")
loops = Late("symgen.runtime.taylor.loops")
motion = Late("symgen.runtime.taylor.motion")
planning = Late("symgen.runtime.taylor.plan")


_WIDTHS = (8, 4, 2, 1)


def sum_kernel(symbol: str, n_y: int) -> str:
    """Return the LLVM IR of `f(h, series, carry, out)`, which reads the order of the series from out[0].

    `out` receives the sum (n_y values), what rounding loses in it, and the derivative of the sum. `carry` is what
    rounding has lost before. Even and odd terms are summed apart (Horner in h²), which halves the time; a series of
    odd order must be followed by a row of zeros.
    """
    parts, start = [], 0
    while start < n_y:
        width = next(w for w in _WIDTHS if w <= n_y - start)
        parts.append(_part(start, width, n_y))
        start += width
    declarations = sorted({line for part in parts for line in part[0]})
    body = "\n".join(part[1] for part in parts)
    return f"""{chr(10).join(declarations)}
define void @{symbol}(double %h, ptr noalias %series, ptr noalias %carry, ptr noalias %out) nounwind {{
entry:
%order.at = load double, ptr %out, align 8
%order = fptosi double %order.at to i64
%up = add i64 %order, 1
%top = and i64 %up, -2
%top.at = sitofp i64 %top to double
%hh = fmul double %h, %h
br label %part0
{body}
part{n_y}:
ret void
}}
"""


def _part(start: int, width: int, n_y: int) -> tuple[list[str], str]:
    """Components from `start` on, `width` of them as a vector: declarations and code."""
    kind = f"<{width} x double>" if width > 1 else "double"
    name = f"v{width}f64" if width > 1 else "f64"
    zero = "zeroinitializer" if width > 1 else "0.0"
    s = str(start)

    def splat(value: str, to: str) -> str:
        if width == 1:
            return f"{to} = fadd double {value}, -0.0"
        zeros = ", ".join("i32 0" for _ in range(width))
        return (
            f"{to}.i = insertelement {kind} poison, double {value}, i32 0\n"
            f"{to} = shufflevector {kind} {to}.i, {kind} poison, <{width} x i32> <{zeros}>"
        )

    def fma(to: str, a: str, b: str, c: str) -> str:
        return f"{to} = call {kind} @llvm.fmuladd.{name}({kind} {a}, {kind} {b}, {kind} {c})"

    def load(to: str, array: str, offset: str) -> str:
        return (
            f"{to}.a = getelementptr inbounds double, ptr %{array}, i64 {offset}\n"
            f"{to} = load {kind}, ptr {to}.a, align 8"
        )

    def store(value: str, offset: int) -> str:
        return (
            f"{value}.to = getelementptr inbounds double, ptr %out, i64 {offset}\n"
            f"store {kind} {value}, ptr {value}.to, align 8"
        )

    lines = [
        f"part{s}:",
        splat("%h", f"%h{s}"),
        splat("%hh", f"%hh{s}"),
        f"br label %loop{s}",
        f"loop{s}:",
        f"%k{s} = phi i64 [%top, %part{s}], [%next{s}, %loop{s}]",
        f"%f{s} = phi double [%top.at, %part{s}], [%fnext{s}, %loop{s}]",
        *(f"%{x}{s} = phi {kind} [{zero}, %part{s}], [%{x}n{s}, %loop{s}]" for x in ("e", "o", "de", "do")),
        f"%row{s} = mul i64 %k{s}, {n_y}",
        f"%even{s} = add i64 %row{s}, {start}",
        f"%odd{s} = sub i64 %even{s}, {n_y}",
        load(f"%x{s}", "series", f"%even{s}"),
        load(f"%z{s}", "series", f"%odd{s}"),
        splat(f"%f{s}", f"%fe{s}"),
        f"%below{s} = fsub double %f{s}, 1.0",
        splat(f"%below{s}", f"%fo{s}"),
        fma(f"%en{s}", f"%e{s}", f"%hh{s}", f"%x{s}"),
        fma(f"%on{s}", f"%o{s}", f"%hh{s}", f"%z{s}"),
        f"%xk{s} = fmul {kind} %x{s}, %fe{s}",
        f"%zk{s} = fmul {kind} %z{s}, %fo{s}",
        fma(f"%den{s}", f"%de{s}", f"%hh{s}", f"%xk{s}"),
        fma(f"%don{s}", f"%do{s}", f"%hh{s}", f"%zk{s}"),
        f"%next{s} = sub i64 %k{s}, 2",
        f"%fnext{s} = fsub double %f{s}, 2.0",
        f"%last{s} = icmp sle i64 %next{s}, 0",
        f"br i1 %last{s}, label %end{s}, label %loop{s}",
        f"end{s}:",
        load(f"%y{s}", "series", s),
        load(f"%c{s}", "carry", s),
        fma(f"%mean{s}", f"%en{s}", f"%h{s}", f"%on{s}"),
        fma(f"%rise{s}", f"%mean{s}", f"%h{s}", f"%c{s}"),
        f"%sum{s} = fadd {kind} %y{s}, %rise{s}",
        f"%back{s} = fsub {kind} %sum{s}, %y{s}",
        f"%kept{s} = fsub {kind} %sum{s}, %back{s}",
        f"%low{s} = fsub {kind} %y{s}, %kept{s}",
        f"%high{s} = fsub {kind} %rise{s}, %back{s}",
        f"%lost{s} = fadd {kind} %low{s}, %high{s}",
        fma(f"%slope{s}", f"%den{s}", f"%h{s}", f"%don{s}"),
        store(f"%sum{s}", start),
        store(f"%lost{s}", n_y + start),
        store(f"%slope{s}", 2 * n_y + start),
        f"br label %part{start + width}",
    ]
    return [f"declare {kind} @llvm.fmuladd.{name}({kind}, {kind}, {kind})"], "\n".join(lines)


MAX_ORDER = 28
N_ROWS = MAX_ORDER + 2  # a row of zeros behind the last order
_UNROLLED_BELOW = 5  # products of series
PLACES = 4  # in which steps look for choices that are not held; the last one is the end
_KEPT_REFUSALS = 1000
_TEXTS = (
    "rhs", "residual", "mass_matrix", "constraint_jacobian", "constraint_residual", "solve", "poses", "switches",
    "closed_constraint_jacobian",
)  # fmt: skip


def taylor_addresses(system: System) -> tuple[np.uint64, np.uint64, float, float, float, int]:
    """Return the addresses of two kernels, compiled on first use, what a step costs, and in how many places it looks.

    `system` owns their code.

    The first is the model's `f(t, y, p, out)`: it reads the order wanted from out[0], 5 to MAX_ORDER. Row k of `out`
    (NY long) receives the coefficients of order k of (q, v, w), behind N_ROWS rows comes the smallest pivot ratio.
    The second sums a series. A step of order p costs as much as c0 + c1 p + c2 p^2 operations. Where choices are not
    held by a branch, steps are looked at in some places: none else.

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
        code, symbol = series_code(system)
        address = system.machine_code().add(code, symbol)
        costs = (ctypes.c_double * 3).from_address(system.machine_code().address(f"{symbol}.costs"))
        places = ctypes.c_int64.from_address(system.machine_code().address(f"{symbol}.places")).value
        system.__dict__["_taylor"] = (np.uint64(address), np.uint64(_sum_address(system)), *costs, places)
    return system.__dict__["_taylor"]


def has_unheld_choices(system: System) -> bool:
    """Whether steps of a model that has series may go over a choice, which they look for.

    Raises
    ------
    Refusal
        It has no series.
    """
    return any(taylor_addresses(form)[-1] > 0 for form in _forms(system))


def _forms(system: System) -> tuple[System, ...]:
    return (system, system.closed) if system.switches and not system.switched else (system,)


def series_code(system: System, lanes: int = 0) -> tuple[bytes, str]:
    """Return the object code of a model's kernel, and its symbol; with `lanes` for so many members at once.

    Raises
    ------
    Refusal
        Something in the model has no Taylor series.
    """
    symbol = f"symgen_taylor_{lanes}" if lanes else "symgen_taylor"
    texts = [system.source.functions.get(name, "") for name in _TEXTS]
    polynomials = sorted(system.input_polynomials.items())
    switched = sorted(system.switched.items())
    sizes = (
        system.nq, system.nv, system.nh, system.nn, system.nw, system.n_p, polynomials, switched, system.dependent,
        system.switches,
    )  # fmt: skip
    key = engine.cache_key(
        "\0".join((_generator(), repr((sizes, system.source.tables)), *texts, *[symbol] * (lanes > 0)))
    )
    lower = functools.partial(_lower_or_refuse, system, key, lanes)
    return engine.object_code(key, "taylor", symbol, lower), symbol


def taylor_refusal(system: System) -> str:
    """Return why the model has no Taylor series, and what to use instead; an empty string where it has."""
    try:
        for form in _forms(system):
            taylor_addresses(form)
    except Refusal as refusal:
        creeping = _creeping(system) if str(refusal) == graphs.NO_CHOICE else ()
        if creeping:
            names = " and ".join(map(repr, creeping))
            refusal = (
                f"friction {names} creeps, by a law that ends at the speed 'creep'; give it 'smooth' in the place of "
                "'creep' for a law that has a Taylor series, or"
            )
            return (
                f"does not fit model {system.name!r}: {refusal} use dop853, or radau5 if the model is stiff"
            )
        return f"does not fit model {system.name!r}: {refusal}; use dop853, or radau5 if the model is stiff"
    return ""


def _creeping(system: System) -> list[str]:
    """The names of frictions that creep, as far as they are known."""
    own = [
        switch.get("circle", switch["name"])
        for switch in system.switches
        if switch["kind"] == "friction" and switch.get("creeps", False)
    ]
    described = system.values_of_runs
    return list(dict.fromkeys([*own, *(described.creeping if described is not None else ())]))


def _sum_address(system: System) -> int:
    symbol = "symgen_taylor_sum"
    ir = sum_kernel(symbol, system.ny)
    code = engine.object_code(engine.cache_key(ir), "taylor", symbol, lambda _: (ir, 0))
    return system.machine_code().add(code, symbol)


def _lower_or_refuse(system: System, key: str, lanes: int, symbol: str) -> tuple[str, int]:
    """As `_lower`, but a refusal is remembered like a kernel: to find it takes as long."""
    folder = cache.cache_folder("refusals")
    said = cache.fetch(folder / key)
    if said is not None:
        raise Refusal(said.decode())
    try:
        return _lower(system, symbol, lanes)
    except Refusal as refusal:
        if cache.store(folder / key, str(refusal).encode()):
            cache.prune(folder, _KEPT_REFUSALS)
        raise


def _lower(system: System, symbol: str, lanes: int) -> tuple[str, int]:
    for name in _TEXTS:
        if system.has(name):
            system._kernel_source(name).lower("checked")
    plan = planning.Plan(motion.read_motion(system))
    if lanes:
        return loops.rolled_kernel(plan, symbol, system.ny, MAX_ORDER, N_ROWS, lanes, _registers())
    kernel = loops.unrolled_kernel if len(plan.convolutions) < _UNROLLED_BELOW else loops.rolled_kernel
    text, operations = kernel(plan, symbol, system.ny, MAX_ORDER, N_ROWS)
    places = PLACES if plan.motion.graph.has_unheld else 0
    return f"{text}\n@{symbol}.places = constant i64 {places}\n", operations


def _registers() -> coding.Registers:
    """The vector registers of this processor: of eight numbers with AVX-512, else four, or as good as that in pairs."""
    return coding.Registers(8, 32) if has_wide_registers() else coding.Registers(4, 16)


@functools.lru_cache(maxsize=1)
def _generator() -> str:
    """Hash of the sources that decide what a kernel is."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for path in (*sorted(folder.glob("*.py")), *sorted((folder.parent / "graph").glob("*.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()
