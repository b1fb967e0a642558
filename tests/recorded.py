"""Recordings of runs, and what two of them have to have in common where they are of the same motion."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from symgen.runtime.recording.reader import read_recording
from symgen.runtime.recording.recorder import RunRecorder
from symgen.runtime.solution import Solution


class _Forger(RunRecorder):
    """A recorder whose checkpoints are changed before they are written, as a stranger could."""

    forge: Callable[[bytes], bytes]

    def checkpoint(self, make: Callable[[], bytes], *, final: bool = False) -> None:
        super().checkpoint(lambda: self.forge(make()), final=final)


def record(
    path: Path, text: str, begin: Callable[..., Solution], forge: Callable[[bytes], bytes] | None = None
) -> Solution:
    """Run and record: `begin(recorder=…)` makes the solution of the module with this text.

    `forge`, if given, changes checkpoints before they are written.
    """
    made = []

    def recorder(**settings):
        made.append((_Forger if forge else RunRecorder)(path, module_text=text, model_text="", **settings))
        made[0].forge = forge
        return made[0]

    solution = begin(recorder=recorder)
    made[0].finish(solution.status, [check.to_dict() for check in solution.health], solution.stats)
    return solution


def assert_same_recording(path: Path, other: Path) -> None:
    """Frames, events and energies are the same, to the last bit."""
    first, second = read_recording(path), read_recording(other)
    assert first.t.tobytes() == second.t.tobytes()
    assert first.states.tobytes() == second.states.tobytes()
    assert first.sha256 == second.sha256 == second.state_sha256()
    assert first.events == second.events
    np.testing.assert_array_equal(first.energy, second.energy)
