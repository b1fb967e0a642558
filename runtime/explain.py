"""What a run did not have to do, and why: counted from what the run left behind."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from symgen.runtime.code import cache
from symgen.runtime.code.modules import lower_setup
from symgen.runtime.integrate import layout as at

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

PACKAGES = ("sympy", "numba", "llvmlite", "scipy", "rerun", "matplotlib")
_SHOWN = 6  # kernels by name


@dataclass(frozen=True)
class Saving:
    """Work that was left out.

    Attributes
    ----------
    what : str
        The work.
    gain : str
        How much of it: operations, evaluations, files.
    why : str
    """

    what: str
    gain: str
    why: str


def savings(solution: Solution, recorded: bool = False) -> list[Saving]:
    """Return what a run skipped, in the order in which a run would do it.

    Parameters
    ----------
    solution : Solution
        Of a run in this process; what the cache gave is counted from the start of the process on.
    recorded : bool
        Whether a recording was written, which evaluates outputs and multipliers at its frames.
    """
    system = getattr(solution.system, "base", solution.system)
    return [
        *_imports(),
        *_cached(),
        *_kernels(system),
        *_late(system),
        *_hoisted(system, solution),
        *_absent(system),
        *_subsystems(solution),
        *_jacobians(solution),
        *_frames(solution),
        *_observed(system, solution, recorded),
    ]


def _imports() -> Iterator[Saving]:
    without = [name for name in PACKAGES if name not in sys.modules]
    if without:
        yield Saving("imports", ", ".join(without), "nothing in this run uses them")


def _cached() -> Iterator[Saving]:
    whats = {
        "modules": ("derivation", "module", "the model and the generator are as they were"),
        "kernels": (
            "compilation of kernels",
            "kernel",
            "their text, the compiler and the processor are as they were",
        ),
        "loops": (
            "compilation of step loops",
            "loop",
            "their code, the compiler and the processor are as they were",
        ),
    }
    for folder, (what, unit, why) in whats.items():
        found, missed = cache.found[folder], cache.missed[folder]
        if found:
            yield Saving(
                what, f"{found} of {found + missed} {unit}{'s' * (found + missed > 1)} from the cache", why
            )


def _kernels(system: System) -> Iterator[Saving]:
    """Kernels that were neither compiled nor read from the cache."""
    left = [name for name in system.source.functions if system.has(name) and name not in system.compiled]
    if left:
        counts = {name: system.operations.get(name, 0) for name in left}
        listed = ", ".join(
            f"{name} {counts[name]}" for name in sorted(left, key=counts.get, reverse=True)[:_SHOWN]
        )
        more = f" and {len(left) - _SHOWN} more" if len(left) > _SHOWN else ""
        total = f"{len(left)} functions, {sum(counts.values())} operations ({listed}{more})"
        yield Saving("kernels not made", total, "neither method nor checks call them")


def _late(system: System) -> Iterator[Saving]:
    """Functions that nobody has asked for."""
    if not system.source.is_whole:
        listed = ", ".join(system.source.late)
        yield Saving("functions not derived", listed, "neither method nor checks call them")


def _hoisted(system: System, solution: Solution) -> Iterator[Saving]:
    once = _once(system) if "rhs" in system.compiled else ""
    if not (once and system.n_precomputations):
        return
    n, calls = system.n_precomputations, solution.stats["rhs"]
    times = f"{n} time{'s' * (n > 1)} for {calls} evaluations"
    yield Saving("work on parameters", f"{once} of rhs: {times}", "parameters do not change during a run")
    if system.structure["constant_mass"] and not system.m:
        yield Saving("factors of the mass matrix", f"factored {times}", "it is constant")


def _once(system: System) -> str:
    """How much of `rhs` depends on parameters only."""
    n_hoisted = system.source.header.get("hoisted", {}).get("rhs", 0)
    if not n_hoisted:
        return ""
    code = system.function_text("rhs")
    if code.form.has_loops:
        return f"{n_hoisted} values"  # lowering counts a loop once
    return (
        f"{lower_setup([(code, n_hoisted)], 'counted').operations} of {system.operations['rhs']} operations"
    )


def _absent(system: System) -> Iterator[Saving]:
    parts = {
        "constraints, multipliers, projection": system.m,
        "search for events": len(system.events) + len(system.switches),
        "inputs": len(system.inputs),
        "quaternions": len(system.quaternions),
    }
    absent = [name for name, count in parts.items() if not count]
    if absent:
        yield Saving("parts of the step", "; ".join(absent), "the model has no such thing")
    if not system.nw:
        yield Saving(
            "integral of the power", "1 of the state's numbers", "all forces have a potential: T + V stays"
        )


def _subsystems(solution: Solution) -> Iterator[Saving]:
    if solution.parts is None:
        return
    found = solution.parts.found
    twins = sum(len(subsystem.columns) - 1 for subsystem in found)
    steps = [int(subsystem.run.arrays.counters[at.STEPS]) for subsystem in found]
    if min(steps) < max(steps):
        gain = f"{min(steps)} to {max(steps)} steps of each, not at least {max(steps)} of all"
        yield Saving("steps of slow subsystems", gain, "nothing couples them")
    groups = [s for s in found if len(s.titles) > len(s.columns)]
    if groups:
        members = sum(len(s.titles) for s in groups)
        gain = f"{len(groups)} runs for {members} subsystems"
        yield Saving("steps of equal subsystems", gain, "those of like speed take common steps, side by side")
    if twins:
        yield Saving(
            "runs of equal subsystems", f"{twins} of {twins + len(found)}", "they start and move alike"
        )


def _jacobians(solution: Solution) -> Iterator[Saving]:
    stats = solution.stats
    attempts = stats["steps"] + stats["rejected"]
    if stats["jacobians"] and attempts > stats["jacobians"]:
        gain = f"{stats['jacobians']} evaluated in {attempts} steps"
        yield Saving("Jacobians", gain, "an older one serves while Newton's iterations converge fast")
    if stats["factorisations"] and stats["newton"] > stats["factorisations"]:
        gain = f"{stats['factorisations']} for {stats['newton']} iterations"
        yield Saving("factorisations", gain, "factors are kept while step and Jacobian stay")


def _frames(solution: Solution) -> Iterator[Saving]:
    frames, steps = len(solution.t), solution.stats["steps"]
    if solution.method and frames > 2:
        gain = f"{frames - 2 - len(solution.samples)} interpolated in {steps} steps"
        yield Saving("steps to frames", gain, "the method's dense output is as accurate as its steps")


def _observed(system: System, solution: Solution, recorded: bool) -> Iterator[Saving]:
    whats = [name for name, count in (("multipliers", system.m), ("outputs", len(system.outputs))) if count]
    places = f"at {len(solution.samples)} times" + (f" and {len(solution.t)} frames" if recorded else "")
    if whats:
        gain = f"evaluated {places}, not in {solution.stats['steps']} steps"
        yield Saving(" and ".join(whats), gain, "nothing else asks for them")
    gain = f"at {len(solution.t)} frames, after the run"
    yield Saving("energies and residuals", gain, "the steps do not need them")
