"""What `method = "auto"` chooses on a scene, and how far that is from the best."""

from __future__ import annotations

import time
from collections.abc import Mapping
from itertools import groupby
from typing import TYPE_CHECKING, Any

from symgen.runtime.choose import choose_method
from symgen.runtime.options import RunOptions

from .sweep import all_levels, at_setting, tolerances

if TYPE_CHECKING:
    from .case import Case
    from .sweep import Curve

_PER_DECADE = 4


def auto_choices(case: Case) -> list[dict[str, Any]]:
    """Return rtol, chosen method, the reason and the processor's seconds of choosing, at four tolerances a decade."""
    scene, reference = case.scene, case.reference
    choices = []
    for rtol in map(float, tolerances(_PER_DECADE)):
        options = RunOptions(t_end=scene.t_end, rtol=rtol, atol=rtol * scene.atol_ratio)
        arguments = case.system, reference.p, reference.start, options
        choose_method(*arguments)  # compiles what scouting needs
        began = time.thread_time()
        method, notes = choose_method(*arguments)
        seconds = time.thread_time() - began
        choices.append({"rtol": rtol, "method": method.name, "why": "; ".join(notes), "seconds": seconds})
    return choices


def auto_result(choices: list[dict[str, Any]], curves: Mapping[str, Curve]) -> dict[str, Any]:
    """Return the choices with the run time at each level that they amount to.

    The run time is that of the chosen method at the same tolerance, on a straight line in logarithms between measured
    ones; a level is looked for among tolerances at which the choice is the same. Choosing itself is reported apart.
    """
    stretches = []
    for method, stretch in groupby(choices, key=lambda choice: choice["method"]):
        usable = curves[method].usable() if method in curves else []
        rows = [at_setting(usable, choice["rtol"]) for choice in stretch]
        stretches.append(all_levels([row for row in rows if row is not None]))
    times = {level: [at[level] for at in stretches if at[level] is not None] for level in all_levels([])}
    return {"choices": choices, "levels": {level: min(found, default=None) for level, found in times.items()}}
