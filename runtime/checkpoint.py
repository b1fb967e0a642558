"""All that a run carries from one call of its step loop to the next, as bytes: another process goes on from them."""

from __future__ import annotations

import hashlib
import io
import json
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from runtime.errors import RuntimeModelError
from runtime.integrate import layout as at
from runtime.solution import EventRecord

if TYPE_CHECKING:
    from runtime.driver import Run

FORMAT = 1
_LOOP_ARRAYS = ("control", "counters", "y", "f", "work", "dense", "tail")
_STATES_OF_EVENTS = ("q_before", "v_before", "q_after", "v_after")
_LARGEST = 1 << 32  # bytes of a checkpoint, unpacked


class CheckpointError(RuntimeModelError):
    """A checkpoint is damaged, or of another program."""


@dataclass(frozen=True)
class Checkpoint:
    """The state of a run between two calls of its step loop.

    Attributes
    ----------
    arrays : dict of ndarray
        Those of the step loop by their names in `LoopArrays`, and what Python keeps beside them.
    facts : dict
        As JSON can say them: t, t_start, t_end [s]; method, fallback; n_frames, the frames that were shown up to here;
        controllers, inputs whose course the arrays do not hold; events, zeno, notes, redundant.
    """

    arrays: dict[str, np.ndarray]
    facts: dict[str, Any]

    def to_bytes(self) -> bytes:
        """Return the checkpoint as bytes that begin with their own SHA-256."""
        plain = io.BytesIO()
        text = np.frombuffer(json.dumps({"format": FORMAT, **self.facts}).encode(), dtype=np.uint8)
        np.savez(plain, facts=text, **self.arrays)
        packed = zlib.compress(plain.getbuffer(), 1)
        return hashlib.sha256(packed).digest() + packed

    @classmethod
    def from_bytes(cls, content: bytes) -> Checkpoint:
        """Read what `to_bytes` wrote.

        Raises
        ------
        CheckpointError
        """
        digest, packed = content[:32], content[32:]
        if hashlib.sha256(packed).digest() != digest:
            raise CheckpointError("the checkpoint is damaged: its bytes are not those that were written")
        try:
            plain = zlib.decompressobj().decompress(packed, _LARGEST)
            with np.load(io.BytesIO(plain), allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
            facts = json.loads(arrays.pop("facts").tobytes())
        except (ValueError, KeyError, OSError, EOFError, zlib.error) as error:
            raise CheckpointError(f"the checkpoint cannot be read: {error}") from error
        if facts.pop("format", None) != FORMAT:
            raise CheckpointError("the checkpoint is of another version of this program")
        return cls(arrays, facts)


def take(run: Run) -> Checkpoint:
    """Return the checkpoint of a run between two calls of its step loop."""
    arrays, actions = run.arrays, run.actions
    n = int(arrays.counters[at.NEXT_FRAME])
    shown = run.shown[:n]
    held = {name: getattr(arrays, name).copy() for name in _LOOP_ARRAYS}
    held["guard"] = arrays.guard_memory()
    held["settings"] = np.array(run.forms)
    for name, per_frame in (("resets", run.reset_energy_at_frames), ("forms", run.form_at_frames)):
        held[f"{name}_from"], held[name] = _pieces(per_frame[:n][shown])
    times, states, energies, forms = zip(*run.samples) if run.samples else ((), (), (), ())
    held["sample_states"] = np.array(states).reshape(len(times), len(arrays.y))
    for key in _STATES_OF_EVENTS:
        held[key] = np.array([getattr(event, key) for event in actions.log])
    controllers = [] if run.inputs is None else [*run.system.samplers, *run.system.feedback]
    facts = {
        "t": arrays.t,
        "t_start": run.t_start,
        "t_end": run.t_end,
        "method": run.method.name,
        "fallback": run.fallback.name if run.fallback is not None else "",
        "n_frames": int(shown.sum()),
        "controllers": [run.system.inputs[k]["name"] for x in controllers for k in x.inputs],
        "samples": [[float(t), float(energy), int(form)] for t, energy, form in zip(times, energies, forms)],
        "events": [[e.name, e.action, e.t, e.energy_change] for e in actions.log],
        "energy_of_resets": float(actions.energy_of_resets),
        "zeno": actions.zeno.memory,
        "stiff_noted": run.stiff_noted,
        "notes": list(run.notes),
    }
    return Checkpoint(held, facts)


def put_back(checkpoint: Checkpoint, run: Run, past: np.ndarray) -> None:
    """Bring a run that has not begun into the state of a checkpoint.

    Parameters
    ----------
    checkpoint : Checkpoint
    run : Run
        Of the same model in the same form, with the same method; its first frames are those before the checkpoint.
    past : ndarray, shape (n_frames, ny)
        The states at these frames.

    Raises
    ------
    CheckpointError
        Arrays have other lengths than those of the run.
    """
    arrays, actions, facts, held = run.arrays, run.actions, checkpoint.facts, checkpoint.arrays
    for name in _LOOP_ARRAYS:
        mine, stored = getattr(arrays, name), held[name]
        if mine.shape != stored.shape or mine.dtype != stored.dtype:
            raise CheckpointError(
                f"the checkpoint does not fit this program: its array {name!r} has shape {stored.shape}, "
                f"not {mine.shape}; it was written by another version"
            )
        mine[...] = stored
    arrays.recall_guard(held["guard"])
    n = len(past)
    arrays.frames[:n] = past
    arrays.counters[at.NEXT_FRAME] = run.handed = n
    run.forms = list(held["settings"])
    run.reset_energy_at_frames[:n] = _spread(held["resets_from"], held["resets"], n)
    run.form_at_frames[:n] = _spread(held["forms_from"], held["forms"], n)
    run.samples = [
        (t, y, energy, form)
        for (t, energy, form), y in zip(facts["samples"], held["sample_states"], strict=True)
    ]
    states = zip(*(held[key] for key in _STATES_OF_EVENTS), strict=True)
    actions.log = [
        EventRecord(name, action, t, *event_states, change)
        for (name, action, t, change), event_states in zip(facts["events"], states, strict=True)
    ]
    actions.energy_of_resets = facts["energy_of_resets"]
    actions.zeno.memory = facts["zeno"]
    if actions.switching is not None:
        actions.switching.settings = run.forms[-1]
    run.stiff_noted, run.notes = facts["stiff_noted"], list(facts["notes"])
    if (run.t_start, run.t_end) != (facts["t_start"], facts["t_end"]):
        run.set_step_limits()
    if run.inputs is not None:
        run.inputs.take_new_arrays(actions.form, arrays.t)


def _pieces(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where a value other than the one before begins, and these values."""
    begins = np.flatnonzero(np.append(True, values[1:] != values[:-1])) if len(values) else np.zeros(0, int)
    return begins, values[begins]


def _spread(begins: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """Undo `_pieces`."""
    return np.repeat(values, np.diff(np.append(begins, n)))
