"""The guards as LLVM IR: trampolines with a kernel's signature, and calls of the jitted path behind them.

A guard calls the straight-line kernel, looks at the pivot ratio, and only then turns to `robust_path`, or to
`refinement` where the ratio is small but well above that. After each projection it looks whether a row of G vanishes,
which the pivot ratio does not show.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from symgen.runtime.code.llvm_text import constant
from symgen.runtime.constraints import branch
from symgen.runtime.graph.layouts import settings_of

if TYPE_CHECKING:
    from symgen.runtime.system import System

PIVOT_LIMIT = 1e-6
REFINED_BELOW = 1e-2  # of the pivot ratio: straight-line accelerations are refined
NEAR_LIMIT = 0.1  # size of a row of G, squared, in parts of what it is nearby
_SMALL_CORRECTION = 1e-6
_FLAG = branch.NEAR_SINGULAR

# What the table holds, 64 bits each: addresses of kernels, of what is called where they fail, of data.
RHS, PROJECT, RHS_PATH, PROJECT_PATH, NATIVE_RHS, NATIVE_PROJECT, JACOBIAN = range(7)
CONTEXT, WEIGHTS, ORDER, WORK, ROWS = range(7, 12)
REFINED_PATH, NATIVE_REFINED = 12, 13
N_SLOTS = 14
PATHS = {
    "rhs": (NATIVE_RHS, RHS_PATH, "call_rhs"),
    "project": (NATIVE_PROJECT, PROJECT_PATH, "call_project"),
    "refined": (NATIVE_REFINED, REFINED_PATH, "call_refined"),
}
TABLE = "guard_table"


def guard_ir(system: System, n_context: int, n_weights: int, n_work: int) -> str:
    """Return a module with `guarded_rhs`, `guarded_project`, `call_rhs` and `call_project`, and their table."""
    n = system.nq + system.nv
    lengths = {
        "context": n_context, "y": n, "p": system.n_precomputed, "weights": n_weights, "order": system.m,
        "work": n_work,
    }  # fmt: skip
    return (
        f"@{TABLE} = global [{N_SLOTS} x ptr] zeroinitializer\ndeclare double @llvm.fabs.f64(double)\n"
        + _switch_table(system)
        + _guarded_rhs(system)
        + _guarded_project(system, n_weights)
        + _call("rhs", NATIVE_RHS, {**lengths, "out": system.n_row})
        + _call("refined", NATIVE_REFINED, {**lengths, "out": system.n_row})
        + _call("project", NATIVE_PROJECT, {**lengths, "out": n + system.nh + system.m})
    )


def _slot(name: str, index: int) -> str:
    return f"%{name}.at = getelementptr inbounds ptr, ptr @{TABLE}, i64 {index}\n%{name} = load ptr, ptr %{name}.at\n"


def _define(name: str, body: str) -> str:
    return f"define void @{name}(double %t, ptr %y, ptr %p, ptr %out) nounwind {{\n{body}}}\n"


def _array(name: str, length: int) -> str:
    # Numba's flat form: owner, parent, entries, bytes of each, data, shape, stride.
    return f"ptr null, ptr null, i64 {length}, i64 8, ptr %{name}, i64 {length}, i64 8"


def _call(name: str, native: int, lengths: dict[str, int]) -> str:
    """Call the jitted path of `robust_path`, whose arguments are arrays, with a kernel's arguments."""
    slots = (("native", native), ("context", CONTEXT), ("weights", WEIGHTS), ("order", ORDER), ("work", WORK))
    before, after = _array("context", lengths["context"]), ("y", "p", "out", "weights", "order", "work")
    arrays = ", ".join(_array(key, lengths[key]) for key in after)
    body = "".join(_slot(key, index) for key, index in slots)
    body += "%result = alloca [2 x i64]\n"
    body += f"%status = call i32 %native(ptr %result, ptr %result, {before}, double %t, {arrays})\n"
    return _define(f"call_{name}", body + "ret void\n")


def _near() -> str:
    """Whether the flag in the context is set."""
    return f"""{_slot("context", CONTEXT)}%flag.at = getelementptr inbounds i64, ptr %context, i64 {_FLAG}
%flag = load i64, ptr %flag.at
%far = icmp eq i64 %flag, 0
"""


def _switch_table(system: System) -> str:
    """Where in `p` the switch of each constraint is, -1 for those that always hold; which ones are left out."""
    if system.dependent:
        sizes = ", ".join(f"double {float(row in system.dependent)}" for row in range(system.m))
        return f"@left_out = internal constant [{system.m} x double] [{sizes}]\n"
    if not system.switched:
        return ""
    places = ", ".join(f"i64 {system.switched.get(row, -1)}" for row in range(system.m))
    return f"@switches = internal constant [{system.m} x i64] [{places}]\n"


def _row_begin(system: System) -> str:
    """What is switched off has a row of zeros, what is left out may have one: no singular configuration, size 1."""
    if system.dependent:
        at_row = f"getelementptr inbounds [{system.m} x double], ptr @left_out, i64 0, i64 %r"
        return f"%left.at = {at_row}\n%begin = load double, ptr %left.at\n"
    if not system.switched:
        return "%begin = fadd double 0.0, 0.0\n"
    return f"""%place.at = getelementptr inbounds [{system.m} x i64], ptr @switches, i64 0, i64 %r
%place = load i64, ptr %place.at
%switched = icmp sge i64 %place, 0
%switch.place = select i1 %switched, i64 %place, i64 0
%switch.at = getelementptr inbounds double, ptr %p, i64 %switch.place
%switch = load double, ptr %switch.at
%off = fsub double 1.0, %switch
%begin = select i1 %switched, double %off, double 0.0
"""


def _ratio_check(system: System, row: str, sound: str) -> str:
    # Written so that nan is slow; a ratio is never above 1, so infinity is slow as well. A row of G that is all zeros
    # may leave the ratio as it is; its multiplier is then not finite, nor is the sum of all.
    return f"""%multipliers = getelementptr inbounds double, ptr %{row}, i64 {system.ny}
br label %sum.loop
sum.loop:
%k = phi i64 [0, %check], [%k.next, %sum.loop]
%total = phi double [0.0, %check], [%total.next, %sum.loop]
%multiplier.at = getelementptr inbounds double, ptr %multipliers, i64 %k
%multiplier = load double, ptr %multiplier.at
%nothing = fmul double %multiplier, 0.0
%total.next = fadd double %total, %nothing
%k.next = add i64 %k, 1
%k.last = icmp eq i64 %k.next, {system.m}
br i1 %k.last, label %sum.end, label %sum.loop
sum.end:
%ratio.at = getelementptr inbounds double, ptr %{row}, i64 {system.n_row - 1}
%bare = load double, ptr %ratio.at
%ratio = fadd double %bare, %total.next
%high = fcmp oge double %ratio, {constant(PIVOT_LIMIT)}
%low = fcmp ole double %ratio, 2.0
%sound = and i1 %high, %low
br i1 %sound, label %{sound}, label %slow
"""


def _slow(path: int, then: str, before: str = "") -> str:
    call = f"{_slot('path', path)}call void %path(double %t, ptr %y, ptr %p, ptr %out)\nbr label %{then}\n"
    return f"slow:\n{before}{call}"


def _without_reactions(system: System) -> str:
    """Reactions of dependent constraints are not unique, nor is friction in proportion to them: not a number.

    The path behind takes no notice of it, so it is only called while none slides. Smooth friction always does, if only
    the stop that it may be on is closed. Where no more is said than that a row is smaller than nearby, and constraints
    do not depend on each other, what straight-line code has written stays.
    """
    places, stops, always, place = [], {}, False, system.n_settable
    for switch in system.switches:
        if switch["kind"] == "stop":
            stops[switch["name"]] = place
        elif switch.get("normal") and not switch.get("smooth"):
            places.append(place + 1)
        elif switch.get("normal"):
            places += [stops[name] for name in switch["normal"] if name in stops]
            always = always or not any(name in stops for name in switch["normal"])
        place += len(settings_of(switch))
    if not places and not always:
        return ""
    lines, total = [], constant(float(always))
    for k, index in enumerate(places):
        lines += [
            f"%sense.{k}.at = getelementptr inbounds double, ptr %p, i64 {index}",
            f"%sense.{k} = load double, ptr %sense.{k}.at",
            f"%sense.{k}.size = call double @llvm.fabs.f64(double %sense.{k})",
            f"%sliding.{k} = fadd double {total}, %sense.{k}.size",
        ]
        total = f"%sliding.{k}"
    lines += [
        f"%slides = fcmp ogt double {total}, 0.0",
        "br i1 %slides, label %unknown, label %known",
        "unknown:",
        f"%known.ratio.at = getelementptr inbounds double, ptr %out, i64 {system.n_row - 1}",
        "%known.ratio = load double, ptr %known.ratio.at",
        f"%known.high = fcmp oge double %known.ratio, {constant(PIVOT_LIMIT)}",
        "%known.low = fcmp ole double %known.ratio, 2.0",
        "%unique = and i1 %known.high, %known.low",
        "br i1 %unique, label %done, label %lost",
        "lost:",
        f"%acceleration = getelementptr inbounds double, ptr %out, i64 {system.nq}",
        "store double 0x7FF8000000000000, ptr %acceleration",
        "ret void",
        "known:",
    ]
    return "\n".join(lines) + "\n"


def _guarded_rhs(system: System) -> str:
    return _define(
        "guarded_rhs",
        f"""{_slot("rhs", RHS)}call void %rhs(double %t, ptr %y, ptr %p, ptr %out)
{_near()}br i1 %far, label %check, label %slow
check:
{_ratio_check(system, "out", "sharp")}sharp:
{_refine(system)}{_slow(RHS_PATH, "done", _without_reactions(system))}done:
ret void
""",
    )


def _refine(system: System) -> str:
    """Refine a sound row with a small ratio; not one without some constraints, or whose forces follow reactions."""
    if system.dependent or any(switch.get("normal") for switch in system.switches):
        return "br label %done\n"
    return f"""%poor = fcmp olt double %ratio, {constant(REFINED_BELOW)}
br i1 %poor, label %refine, label %done
refine:
{_slot("refined", REFINED_PATH)}call void %refined(double %t, ptr %y, ptr %p, ptr %out)
br label %done
"""


def _guarded_project(system: System, n_weights: int) -> str:
    """Away from singular configurations a small correction is right; for a large one the pivot ratio is looked at."""
    n, limit = system.nq + system.nv, constant(_SMALL_CORRECTION)
    return _define(
        "guarded_project",
        f"""%row = alloca double, i64 {system.n_row}
{_near()}br i1 %far, label %usual, label %slow
usual:
{_slot("project", PROJECT)}call void %project(double %t, ptr %y, ptr %p, ptr %out)
br label %loop
loop:
%i = phi i64 [0, %usual], [%next, %more]
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
%last = icmp eq i64 %next, {n}
br i1 %last, label %look, label %loop
check:
{_slot("rhs", RHS)}call void %rhs(double %t, ptr %y, ptr %p, ptr %row)
{_ratio_check(system, "row", "look")}{_slow(PROJECT_PATH, "look")}look:
{_look_at_rows(system) if n_weights else ""}ret void
""",
    )


def _look_at_rows(system: System) -> str:
    """Set the flag where a row of G, at the projected state, is much smaller than nearby."""
    m, nv = system.m, system.nv
    slots = _slot("jacobian", JACOBIAN) + _slot("rows", ROWS) + _slot("weights", WEIGHTS)
    return f"""{slots}call void %jacobian(double %t, ptr %out, ptr %p, ptr %rows)
br label %row.loop
row.loop:
%r = phi i64 [0, %look], [%r.next, %row.end]
%least = phi double [1.0, %look], [%least.next, %row.end]
%first = mul i64 %r, {nv}
{_row_begin(system)}br label %entry.loop
entry.loop:
%c = phi i64 [0, %row.loop], [%c.next, %entry.loop]
%sum = phi double [%begin, %row.loop], [%sum.next, %entry.loop]
%at = add i64 %first, %c
%g.at = getelementptr inbounds double, ptr %rows, i64 %at
%w.at = getelementptr inbounds double, ptr %weights, i64 %at
%g = load double, ptr %g.at
%w = load double, ptr %w.at
%square = fmul double %g, %g
%term = fmul double %square, %w
%sum.next = fadd double %sum, %term
%c.next = add i64 %c, 1
%c.last = icmp eq i64 %c.next, {nv}
br i1 %c.last, label %row.end, label %entry.loop
row.end:
%less = fcmp olt double %sum.next, %least
%least.next = select i1 %less, double %sum.next, double %least
%r.next = add i64 %r, 1
%r.last = icmp eq i64 %r.next, {m}
br i1 %r.last, label %set, label %row.loop
set:
%near = fcmp olt double %least.next, {constant(NEAR_LIMIT)}
%near.1 = zext i1 %near to i64
%always.at = getelementptr inbounds i64, ptr %context, i64 {branch.ILL_CONDITIONED}
%always = load i64, ptr %always.at
%flag.new = or i64 %near.1, %always
store i64 %flag.new, ptr %flag.at
"""
