"""All that a run carries from one call of its step loop to the next, as bytes: another process goes on from them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checkpoint_bytes import Checkpoint
from symgen.runtime.checkpoint_check import ARRAYS_OF_CONTROLLERS, LOOP_ARRAYS, STATES_OF_EVENTS, check
from symgen.runtime.event_actions import EventLog, EventRecord
from symgen.runtime.frame_window import pieces
from symgen.runtime.integrate import layout as at
from symgen.runtime.run_state import FormLog

if TYPE_CHECKING:
    from symgen.runtime.run_state import RunState


def take(run: RunState) -> Checkpoint:
    """Return the checkpoint of a run between two calls of its step loop."""
    arrays, actions = run.arrays, run.actions
    held = {name: getattr(arrays, name).copy() for name in LOOP_ARRAYS}
    held["guard"] = arrays.guard_memory()
    held["settings"] = run.forms.array().copy()
    held["lowest_gaps"] = actions.lowest_gaps
    n_frames, held["resets_from"], held["resets"], held["forms_from"], held["forms"] = _of_frames(run)
    times, states, energies, forms = zip(*run.samples) if run.samples else ((), (), (), ())
    held["sample_states"] = np.array(states).reshape(len(times), len(arrays.y))
    told = _tell_events(actions.log, held)
    controllers = []
    for number, controller in enumerate([] if run.inputs is None else run.system.controllers):
        facts, own = controller.memory if hasattr(controller, "memory") else ({}, {})
        controllers.append({"inputs": [run.system.inputs[k]["name"] for k in controller.inputs], **facts})
        held |= {f"controller_{number}_{name}": array for name, array in own.items()}
    facts = {
        "t": arrays.t,
        "t_start": run.t_start,
        "t_end": run.t_end,
        "method": run.method.name,
        "fallback": run.fallback.name if run.fallback is not None else "",
        "module": run.system.source.functions_hash,
        "n_frames": n_frames,
        "controllers": controllers,
        "samples": [[float(t), float(energy), int(form)] for t, energy, form in zip(times, energies, forms)],
        "events": told,
        "energy_of_resets": float(actions.energy_of_resets),
        "zeno": actions.zeno.memory,
        "stiff_noted": run.stiff_noted,
        "notes": list(run.notes),
    }
    return Checkpoint(held, facts)


def _tell_events(log: EventLog, held: dict[str, np.ndarray]) -> list[list]:
    """Write the states at events to `held`; returns the rest of what is known of them.

    One after another: records are made for each look, and all of a long log at one time take much memory.
    """
    states, parts, told = np.zeros(0), [], []
    for k, event in enumerate(log):
        parts = [getattr(event, key) for key in STATES_OF_EVENTS]
        if not k:
            states = np.zeros((len(log), sum(map(len, parts))))
        np.concatenate(parts, out=states[k])
        work = event.work if math.isfinite(event.work) else None
        told.append([event.name, event.action, event.t, event.energy_change, work])
    ends = np.cumsum([len(part) for part in parts]) if told else np.zeros(len(STATES_OF_EVENTS), dtype=int)
    split = np.split(states, ends[:-1], axis=-1)
    held.update((key, part.copy()) for key, part in zip(STATES_OF_EVENTS, split, strict=True))
    return told


def put_back(checkpoint: Checkpoint, run: RunState, past: np.ndarray) -> None:
    """Bring a run that has not begun into the state of a checkpoint.

    Parameters
    ----------
    checkpoint : Checkpoint
    run : RunState
        Of the same model in the same form, with the same method; its first frames are those before the checkpoint.
    past : ndarray, shape (n_frames, ny)
        The states at these frames.

    Raises
    ------
    CheckpointError
        Arrays have other lengths than those of the run.
    """
    arrays, actions, facts, held = run.arrays, run.actions, checkpoint.facts, checkpoint.arrays
    check(checkpoint, run, len(past))
    if checkpoint.own and facts["module"] == run.system.source.functions_hash:
        for name in LOOP_ARRAYS:
            getattr(arrays, name)[...] = held[name]
        arrays.recall_guard(held["guard"])
    else:
        _take_motion(held, run)
    arrays.take_branches()
    n = len(past)
    arrays.frames[:n] = past
    arrays.counters[at.NEXT_FRAME] = run.handed = n
    run.forms = FormLog(held["settings"])
    run.reset_energy_at_frames[:n] = _held_values(held["resets_from"], held["resets"], n)
    run.form_at_frames[:n] = _held_values(held["forms_from"], held["forms"], n)
    run.samples = [
        (t, y, energy, form)
        for (t, energy, form), y in zip(facts["samples"], held["sample_states"], strict=True)
    ]
    states = zip(*(held[key] for key in STATES_OF_EVENTS), strict=True)
    actions.log = EventLog(
        EventRecord(name, action, t, *event_states, change, math.nan if work is None else work)
        for (name, action, t, change, work), event_states in zip(facts["events"], states, strict=True)
    )
    actions.energy_of_resets = facts["energy_of_resets"]
    actions.lowest_gaps = held["lowest_gaps"]
    actions.zeno.memory = facts["zeno"]
    if actions.switching is not None:
        actions.switching.settings = run.forms[-1]
    run.stiff_noted, run.notes = facts["stiff_noted"], [*facts["notes"], *run.notes]
    if run.inputs is not None:
        for number, controller in enumerate(run.system.controllers):
            if hasattr(controller, "memory"):
                own = {name: held[f"controller_{number}_{name}"] for name in ARRAYS_OF_CONTROLLERS}
                controller.memory = facts["controllers"][number], own
        run.inputs.take_new_arrays(actions.form, arrays.t)


def _take_motion(held: dict[str, np.ndarray], run: RunState) -> None:
    """Take the state, the step and the counts of a stranger's checkpoint, but nothing that machine code keeps.

    What loops keep has places of arrays in it (orders, pivots, which of two series is the current one).
    """
    arrays = run.arrays
    arrays.y[...] = held["y"]
    arrays.control[at.ERROR_OLD :] = _with_own_limits(held["control"], arrays.control)[at.ERROR_OLD :]
    arrays.control[at.T], arrays.control[at.H] = held["control"][[at.T, at.H]]
    arrays.counters[: at.NEXT_FRAME] = held["counters"][: at.NEXT_FRAME]
    if run.actions.switching is not None:
        run.actions.switching.settings = held["settings"][-1]
        arrays.limit_steps(run.method, held=run.actions.switching.any_held)
    arrays.counters[at.LAST_REJECTED] = held["counters"][at.LAST_REJECTED]
    if not run.method.adaptive:
        arrays.counters[at.GRID_STEP] = held["counters"][at.GRID_STEP]
    run.notes.append(
        "the checkpoint was not written by a run of yours on this machine: the run goes on from its state, to the "
        "tolerance, but not bit for bit"
    )


def _with_own_limits(stored: np.ndarray, mine: np.ndarray) -> np.ndarray:
    control = stored.copy()
    for index in (at.PROJECTION_TOL, at.NEWTON_TOL, at.T_WATCH, at.T_START, at.H_BASE, at.H_SHARE, at.ASIDE):
        control[index] = mine[index]
    return control


def _of_frames(run: RunState) -> tuple[int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return how many frames that were asked for the run has passed, and the pieces of resets and forms at them."""
    n = int(run.arrays.counters[at.NEXT_FRAME])
    new = slice(n) if run.window is None else run.window.untaken(n)
    shown, resets, forms = run.shown[new], run.reset_energy_at_frames[new], run.form_at_frames[new]
    if not shown.all():
        resets, forms = resets[shown], forms[shown]
    if run.window is None:
        return len(resets), *pieces(resets), *pieces(forms)
    before = run.window
    return before.resets.n + len(resets), *before.resets.with_more(resets), *before.forms.with_more(forms)


def _held_values(begins: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """Undo `_pieces`."""
    return np.repeat(values, np.diff(np.append(begins, n)))
