"""The program of a thread, for one model and method, as LLVM IR: its loop, the model's functions, their caller."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from symgen.runtime.choose import SERIES
from symgen.runtime.code.llvm_text import VECTOR_INTRINSICS
from symgen.runtime.code.lower import NoLanes
from symgen.runtime.ensemble.batch import one_evaluation
from symgen.runtime.ensemble.gpu.thread import ARGUMENTS, MEMBER, function_member
from symgen.runtime.ensemble.lanes import N_INTERVAL
from symgen.runtime.ensemble.machine import METHODS
from symgen.runtime.ensemble.slots import COLUMNS
from symgen.runtime.errors import Refusal
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.lazy import Late
from symgen.runtime.record import record
from symgen.runtime.taylor.kernel import MAX_ORDER, N_ROWS, has_unheld_choices, taylor_refusal

if TYPE_CHECKING:
    from symgen.runtime.code.nvptx import Whole
    from symgen.runtime.system import System

modules = Late("symgen.runtime.code.modules")
nvptx = Late("symgen.runtime.code.nvptx")
loops = Late("symgen.runtime.taylor.loops")
motion = Late("symgen.runtime.taylor.motion")
planning = Late("symgen.runtime.taylor.plan")

ENTRY = "symgen_members"
_N_STAGES, _N_DENSE = {"rk4": 5, "verlet": 2, "dop853": 16}, 8
_FAR = re.compile(r"@([\w.]+\.far)\(double")  # sine and cosine of large angles: rare, and long
_LIBRARY = sorted(
    name for name in IN_CODE if name not in (*VECTOR_INTRINSICS, "sin", "cos")
)  # of the C library, to whose bits nothing else is held


@record(eq=False)
class Program:
    """What a thread does.

    Attributes
    ----------
    method : str
    parts : tuple of str
        Modules of LLVM IR: the model's functions, and the loop of a member, `thread.MEMBER`.
    kernels : tuple of str
        Names of the model's functions.
    operations : int
        Of the model's right-hand side, or of its series.
    flat : bool
        Whether the model's functions are part of the loop, and its arrays meant to be registers; otherwise they are
        called, and arrays are in memory.
    """

    method: str
    parts: tuple[str, ...]
    kernels: tuple[str, ...]
    operations: int
    flat: bool

    def whole(self, *, device: bool) -> Whole:
        """Return the program with what calls it, for a device or for this machine."""
        parts = (*self.parts, calling_loop(device))
        if not self.flat:
            return nvptx.Whole(parts, ENTRY, [MEMBER], self.kernels)
        far = [name for text in self.parts for name in _FAR.findall(text)]
        return nvptx.Whole(parts, ENTRY, apart=far, flat=True)


def make_program(
    system: System, method: str, *, scale_energy: bool, with_frames: bool, flat: bool
) -> Program:
    """Write the program of a model and method.

    Raises
    ------
    NoLanes, Refusal
        There is none; says why.
    """
    if system.events:
        raise NoLanes("it has events, which run in the lanes of this machine's processors")
    n = system.nq + system.nv
    projects = bool(system.m or system.quaternions)
    n_project = n + system.nh + system.m if projects else 0
    kernels = {"rhs": "rhs", "energy": "energy"}
    kernels |= {"project": "project"} if projects else {}
    kernels |= {"residual": "constraint_residual"} if system.m else {}
    lowered = {}
    for slot, name in kernels.items():
        source = system._kernel_source(name)
        lowered[slot] = modules.lower_lanes(source.code, f"symgen_{name}", source.n_hoisted, source.offset, 1)
    operations = lowered["rhs"].operations
    parts = {slot: found.ir for slot, found in lowered.items()}
    n_k = _N_STAGES.get(method, 0) * system.n_row
    names = {slot: f"symgen_{name}" for slot, name in kernels.items()}
    if method == SERIES:
        parts["series"], operations = _series(system)
        names["series"], n_k = "symgen_series", N_ROWS * system.ny + 1
    _refuse_library(parts)
    sizes = {
        "ny": system.ny, "n": n, "nq": system.nq, "n_row": system.n_row, "n_p": system.n_p,
        "n_precomputed": system.n_precomputed, "nh": system.nh, "m": system.m, "n_project": n_project,
        "n_quaternions": len(system.quaternions), "watch_energy": 1, "scale_energy": int(scale_energy),
        "one_evaluation": int(one_evaluation(system, method)), "has_tail": int(system.ny - system.nq > 1),
    }  # fmt: skip
    lengths = {
        "y": system.ny, "y_new": system.ny, "y_stage": system.ny, "k": n_k,
        "k_other": n_k if method == SERIES else 1, "lost": system.ny, "p": system.n_precomputed,
        "projected": n_project, "energies": 2, "residuals": system.nh + system.m,
        "dense": system.ny * (_N_DENSE if with_frames and method != SERIES else 1), "numbers": len(COLUMNS),
        "carry": system.ny, "slope": system.ny, "y_before": 1, "watched": 1, "interval": N_INTERVAL,
    }  # fmt: skip
    begin, attempt = METHODS[method]
    member = function_member(sizes, lengths, names, begin, attempt, unrolled=flat, with_frames=with_frames)
    kind = "<1 x double>"
    listed = ", ".join(f"i64 {first}" for first in system.quaternions)
    lines = [
        f"@symgen_quaternions = internal constant [{len(system.quaternions)} x i64] [{listed}], align 8",
        *(f"declare void @{name}({kind}, ptr, ptr, ptr)" for name in names.values()),
        *sorted(member.declared),
    ]
    return Program(
        method, (*parts.values(), "\n".join([*lines, member.text()])), tuple(names.values()), operations, flat
    )


def _series(system: System) -> tuple[str, int]:
    reason = taylor_refusal(system)
    if reason:
        raise Refusal(f"method taylor {reason}")
    if has_unheld_choices(system):
        raise NoLanes("its forces have kinks at which no step ends, and series of lanes do not look for them")
    plan = planning.Plan(motion.read_motion(system))
    return loops.rolled_kernel(plan, "symgen_series", system.ny, MAX_ORDER, N_ROWS, 1)


def _refuse_library(parts: dict[str, str]) -> None:
    used = [name for name in _LIBRARY if any(f"symgen.each.{name}(" in ir for ir in parts.values())]
    if used:
        raise NoLanes(
            f"its functions need {', '.join(used)} of the C library, to whose bits a graphics processor has no equal"
        )


def calling_loop(device: bool) -> str:
    """Return the IR of what runs members: those of a grid of threads, or every `stride`th one from `first` on.

    Both do the same for each member; only where its number comes from differs.
    """
    listed = ", ".join(f"{kind} %{name}" for name, kind in ARGUMENTS.items())
    declared = ", ".join(ARGUMENTS.values())
    passed = ", ".join(f"{kind} %{name}" for name, kind in ARGUMENTS.items())
    if device:
        names = {"block": "ctaid", "size": "ntid", "thread": "tid", "blocks": "nctaid"}
        lines = [f"declare i32 @llvm.nvvm.read.ptx.sreg.{name}.x()" for name in names.values()]
        head = f"define ptx_kernel void @{ENTRY}({listed}) nounwind {{"
        numbers = [f"%{to} = call i32 @llvm.nvvm.read.ptx.sreg.{name}.x()" for to, name in names.items()]
        numbers += [
            f"%{name}.long = zext i32 %{name} to i64" for name in names
        ] + [
            "%before = mul i64 %block.long, %size.long", "%first = add i64 %before, %thread.long",
            "%stride = mul i64 %blocks.long, %size.long",
        ]  # fmt: skip
    else:
        lines, numbers = [], []
        head = f"define void @{ENTRY}(i64 %first, i64 %stride, {listed}) nounwind {{"
    return "\n".join(
        [
            *lines, f"declare void @{MEMBER}(i64, {declared})", head, "entry:", *numbers, "br label %head", "head:",
            "%member = phi i64 [%first, %entry], [%next, %body]", "%more = icmp slt i64 %member, %n_members",
            "br i1 %more, label %body, label %done", "body:",
            f"call void @{MEMBER}(i64 %member, {passed})", "%next = add i64 %member, %stride", "br label %head",
            "done:", "ret void", "}", "",
        ]
    )  # fmt: skip
