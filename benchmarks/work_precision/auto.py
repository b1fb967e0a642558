"""What `method = "auto"` chooses on a scene, and how far that is from the best."""

from __future__ import annotations

import time
from collections.abc import Mapping
from itertools import groupby
from typing import TYPE_CHECKING, Any

from symgen.runtime.choose import choose_method
from symgen.runtime.options import RunOptions

from .sweep import all_levels, tolerances

if TYPE_CHECKING:
    from .case import Case, Effort
    from .sweep import Curve


def auto_choices(case: Case, effort: Effort) -> list[dict[str, Any]]:
    """Return rtol, chosen method, the reason and the seconds of choosing, for each tolerance of a sweep."""
    scene, reference = case.scene, case.reference
    choices = []
    for rtol in map(float, tolerances(effort)):
        options = RunOptions(t_end=scene.t_end, rtol=rtol, atol=rtol * scene.atol_ratio)
        arguments = case.system, reference.p, reference.start, options
        choose_method(*arguments)  # compiles what scouting needs
        began = time.perf_counter()
        method, notes = choose_method(*arguments)
        seconds = time.perf_counter() - began
        choices.append({"rtol": rtol, "method": method.name, "why": "; ".join(notes), "seconds": seconds})
    return choices


def auto_result(choices: list[dict[str, Any]], curves: Mapping[str, Curve]) -> dict[str, Any]:
    """Return the choices with the run time at each level that they amount to.

    The run time is that of the chosen method at the same tolerance, interpolated between tolerances at which the
    choice is the same; choosing itself is reported apart.
    """
    stretches = []
    for method, stretch in groupby(choices, key=lambda choice: choice["method"]):
        tolerances_taken = {choice["rtol"] for choice in stretch}
        usable = curves[method].usable() if method in curves else []
        stretches.append(all_levels([row for row in usable if row.setting in tolerances_taken]))
    times = {level: [at[level] for at in stretches if at[level] is not None] for level in all_levels([])}
    return {"choices": choices, "levels": {level: min(found, default=None) for level, found in times.items()}}
