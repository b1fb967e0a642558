"""Go on with a recorded run of subsystems: from its start, as there are no checkpoints of each subsystem's run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.options import RunOptions
from symgen.runtime.simulate import simulate
from symgen.runtime.subsystems.apart import ASKED

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.recording.recording import Recording
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System


def run_again(
    recording: Recording,
    system: System,
    *,
    t_end: float | None = None,
    at: Sequence[float] | None = None,
    fps: float | None = None,
    **watched: Any,
) -> Solution:
    """Integrate a recorded run again, to its end or a later one; the steps, and so the bits, are the same.

    Parameters
    ----------
    t_end, at, fps : optional
        Those of the run before by default.
    **watched
        Other options of the run: recorder, progress, max_steps.
    """
    said = recording.options
    t_end = said["t_end"] if t_end is None else t_end
    options = RunOptions(
        t_end=t_end,
        t_start=said["t_start"],
        at=[t for t in said["at"] if t <= t_end] if at is None else at,
        fps=said["fps"] if fps is None else fps,
        start=_by_name(system.coordinates, recording.q[0]),
        rate=_by_name(system.rates, recording.v[0]),
        parameters={**recording.parameters, **recording.inputs},
        **said[ASKED],
        **watched,
    )
    solution = simulate(system, options)
    note = f"resumed from the start of {recording.path.name}: runs of subsystems keep no checkpoints"
    return replace(solution, notes=[*solution.notes, note])


def _by_name(records: Sequence[dict[str, Any]], values: np.ndarray) -> dict[str, float]:
    return {record["name"]: float(x) for record, x in zip(records, values, strict=True)}
