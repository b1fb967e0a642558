"""What follows from a recording of states alone: energies, and the recording that shows all there is to see.

Both are worked out by the module in the recording, which is checked as any module that is read.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs.given import InputFault
from symgen.runtime.inputs.recorded import drive_as_recorded
from symgen.runtime.lazy import Late
from symgen.runtime.module import read_module
from symgen.runtime.recording import schema
from symgen.runtime.recording.reader import (
    blamed_on,
    check_fits,
    read_checkpoint,
    read_content,
    read_recording,
)
from symgen.runtime.recording.recording import Quantities, Recording, Settings
from symgen.runtime.recording.schema import RecordingError
from symgen.runtime.system import System

if TYPE_CHECKING:
    from .run_writer import RunWriter

run_writer = Late("symgen.runtime.recording.run_writer")

_FRAMES_AT_ONCE = 4000


def with_energies(recording: Recording, system: System) -> Recording:
    """Return a recording with its energies worked out, where states alone were written and they follow from these.

    Parameters
    ----------
    recording : Recording
    system : System
        Of the recording's own module; the recording fits it.
    """
    if recording.content != schema.STATES:
        return recording
    driven, unknown = drive_as_recorded(system, recording.inputs_over_time)
    if unknown:
        return recording
    p, states = driven.with_settings(recording.p), recording.states
    energies = evaluate(driven, "energy", p, recording.t.copy(), states)
    return replace(recording, energy=np.column_stack([energies, energies.sum(axis=1)]))


@contextlib.contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """The file that shows a recording: itself or, of states alone, one that is made for as long as this lasts.

    Raises
    ------
    RecordingError
        If it cannot be read, or what it is to show does not follow from it.
    """
    path = Path(path)
    if read_content(path) != schema.STATES:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="symgen-") as folder:
        target = Path(folder) / path.with_suffix(".rrd").name
        with blamed_on(path):
            _write_whole(read_recording(path), read_checkpoint(path)[1], target)
        yield target


def _write_whole(recording: Recording, step_log: np.ndarray, target: Path) -> None:
    module = System(read_module(recording.module_text + "\n"))
    check_fits(recording, module)
    system = _driven(module, recording)
    names = ("title", "method", "constraints", "rtol", "atol", "module_text", "model_text", "options")
    settings = Settings(
        **{name: getattr(recording, name) for name in names}, mesh_folder=recording.path.resolve().parent
    )
    of, t, y = Quantities(system, system.with_settings(recording.p)), recording.t.copy(), recording.states
    first = slice(None, _FRAMES_AT_ONCE)
    try:
        writer = run_writer.RunWriter(target, of, settings, t[first], y[first])
    except RecordingError:
        raise
    except RuntimeModelError as error:
        raise RecordingError(
            f"{recording.path}: {error}. States alone were recorded, so meshes are taken from below the folder of the "
            "recording: put them there"
        ) from error
    try:
        _write_frames(writer, recording, t, y)
        if len(step_log):
            writer.steps(step_log)
        if recording.complete:
            writer.result(recording.status, recording.health, recording.stats)
    finally:
        writer.close()


def _write_frames(writer: RunWriter, recording: Recording, t: np.ndarray, y: np.ndarray) -> None:
    """Write frames, and events between them."""
    resets = np.zeros(len(t))
    for event in recording.events:
        resets[event.frame :] += event.energy_change
    for first in range(0, len(t), _FRAMES_AT_ONCE):
        rows = slice(first, first + _FRAMES_AT_ONCE)
        writer.frames(t[rows], y[rows], resets[rows], recording.settings[rows])
    if recording.events:
        writer.events([(e.frame, e.t, e.name, e.energy_change, e.whole) for e in recording.events])


def _driven(system: System, recording: Recording) -> System:
    """The system as it was driven."""
    if not recording.inputs_over_time:
        return system
    try:
        driven, unknown = drive_as_recorded(system, recording.inputs_over_time)
    except InputFault as fault:
        raise RecordingError(f"{recording.path}: {fault}") from fault
    if unknown:
        raise RecordingError(
            f"{recording.path}: the run was cut short before the values of {', '.join(unknown)} were written, so that "
            "nothing follows from its states alone: resume it (symgen run --resume), or run the model again"
        )
    return driven
