"""Go on with a recorded run of subsystems: from its start, as there are no checkpoints of each subsystem's run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.solve import solve
from symgen.runtime.subsystems.apart import ASKED

if TYPE_CHECKING:
    from symgen.runtime.recording.reader import Recording
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System


def run_again(
    recording: Recording,
    system: System,
    t_end: float | None,
    at: Sequence[float] | None,
    fps: float | None,
    recorder: Callable[..., Any] | None,
    progress: Callable[[float, int], None] | None,
    max_steps: int | None,
) -> Solution:
    """Integrate a recorded run again, to its end or a later one; the steps, and so the bits, are the same.

    Parameters
    ----------
    t_end : float, optional [s]
        These and the others are those of the run before by default, and as in `symgen.runtime.solve.solve`.
    """
    options = recording.options
    named = {"start": (system.coordinates, recording.q[0]), "rate": (system.rates, recording.v[0])}
    given = {
        key: {record["name"]: float(x) for record, x in zip(records, values, strict=True)}
        for key, (records, values) in named.items()
    }
    t_end = options["t_end"] if t_end is None else t_end
    solution = solve(
        system,
        t_end,
        **options[ASKED],
        **given,
        parameters={**recording.parameters, **recording.inputs},
        t_start=options["t_start"],
        at=[t for t in options["at"] if t <= t_end] if at is None else at,
        fps=options["fps"] if fps is None else fps,
        recorder=recorder,
        progress=progress,
        max_steps=max_steps,
    )
    note = f"resumed from the start of {recording.path.name}: runs of subsystems keep no checkpoints"
    return replace(solution, notes=[*solution.notes, note])
