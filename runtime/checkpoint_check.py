"""What a checkpoint must be before anything goes on from it: it may have been written by anybody."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checkpoint_bytes import Checkpoint, CheckpointError
from symgen.runtime.contact.settings import Layout
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS

if TYPE_CHECKING:
    from symgen.runtime.inputs.samples import Sampler
    from symgen.runtime.run_state import RunState
    from symgen.runtime.system import System

LOOP_ARRAYS = ("control", "counters", "y", "f", "work", "dense", "tail")
ARRAYS_OF_CONTROLLERS = ("times", "values", "kept")
STATES_OF_EVENTS = ("q_before", "v_before", "q_after", "v_after")
_MOST_COUNTED = 2.0**53


def check_facts(facts: dict[str, Any]) -> None:
    """Refuse facts that are missing, or not what they must be.

    Raises
    ------
    CheckpointError
    """
    for name, (fits, expected) in _FACTS.items():
        if name not in facts:
            raise CheckpointError(f"the checkpoint does not say {name!r}")
        if not fits(facts[name]):
            raise CheckpointError(
                f"the checkpoint says {name!r} is {facts[name]!r:.60}, which is not {expected}"
            )
    if not facts["t_start"] <= facts["t"] or not facts["t_start"] < facts["t_end"]:
        raise CheckpointError("the checkpoint's times are not in order: t_start, t, t_end")


def check_form(checkpoint: Checkpoint, system: System) -> None:
    """Refuse arrays that say in which form a run is to be made which can go on: which stops and frictions hold.

    Raises
    ------
    CheckpointError
    """
    n_settings = system.n_settings_of_switches
    _check_array(checkpoint, "control", (None,), "<f8")
    _check_array(checkpoint, "settings", (None, n_settings) if n_settings else (0,), "<f8")
    settings = checkpoint.arrays["settings"]
    if len(checkpoint.arrays["control"]) < at.N_CONTROL or (n_settings and not len(settings)):
        raise CheckpointError("the checkpoint does not say which stops and frictions hold, or has no control")
    layout = Layout(system)
    switches = np.concatenate([layout.closed, layout.stuck, layout.turns, layout.aimed])
    if n_settings and not (np.isin(settings[:, switches], (0.0, 1.0)).all() and np.isfinite(settings).all()):
        raise CheckpointError("the checkpoint's stops and frictions are switched neither on nor off")


def check(checkpoint: Checkpoint, run: RunState, n_frames: int) -> None:
    """Refuse arrays that are not those of `run`, and values that no run arrives at.

    Raises
    ------
    CheckpointError
    """
    _check_shapes(checkpoint, run)
    _check_history(checkpoint, run, n_frames)
    if not checkpoint.own:
        _check_motion(checkpoint, run)


def _is_number(x: Any) -> bool:
    return type(x) in (int, float) and math.isfinite(x)


def _is_count(x: Any) -> bool:
    return type(x) is int and 0 <= x < _MOST_COUNTED


def _is_text(x: Any) -> bool:
    return type(x) is str


def _is_list(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda x: type(x) is list and all(map(fits, x))


def _is_controller(x: Any) -> bool:
    """What `symgen.runtime.checkpoint.take` says of a controller; what is sampled counts its calls."""
    if type(x) is not dict or not _is_list(_is_text)(x.get("inputs")):
        return False
    return len(x) == 1 or (_is_count(x.get("n_calls")) and type(x.get("random")) is dict)


def _is_row(*fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda x: type(x) is list and len(x) == len(fits) and all(fit(item) for fit, item in zip(fits, x))


def _is_event(x: Any) -> bool:
    """Whether it is an event's name, action, time, change of energy, and work, which is None where not known."""
    known = _is_row(_is_text, _is_text, _is_number, _is_number)
    return type(x) is list and known(x[:4]) and len(x) == 5 and (x[4] is None or _is_number(x[4]))


_FACTS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "t": (_is_number, "a time"),
    "t_start": (_is_number, "a time"),
    "t_end": (_is_number, "a time"),
    "method": (lambda x: _is_text(x) and x in METHODS, "a method of this version"),
    "fallback": (lambda x: _is_text(x) and (not x or x in METHODS), "a method of this version"),
    "module": (_is_text, "text"),
    "n_frames": (_is_count, "a count"),
    "controllers": (_is_list(_is_controller), "a list of controllers"),
    "samples": (
        _is_list(_is_row(_is_number, _is_number, lambda x: type(x) is int)),
        "a list of times with energies",
    ),
    "events": (_is_list(_is_event), "a list of events"),
    "energy_of_resets": (_is_number, "a number"),
    "zeno": (lambda x: _is_list(lambda y: y is None or _is_number(y))(x) and len(x) > 0, "a list of times"),
    "stiff_noted": (lambda x: type(x) is bool, "true or false"),
    "notes": (_is_list(_is_text), "a list of texts"),
}


def _check_shapes(checkpoint: Checkpoint, run: RunState) -> None:
    facts, system = checkpoint.facts, run.system
    n_events = len(facts["events"])
    wanted: dict[str, tuple[tuple[int | None, ...], str]] = {
        name: (getattr(run.arrays, name).shape, getattr(run.arrays, name).dtype.str) for name in LOOP_ARRAYS
    }
    wanted["guard"] = (run.arrays.guard_memory().shape, "<f8")
    wanted["sample_states"] = ((len(facts["samples"]), len(run.arrays.y)), "<f8")
    for name, size in zip(STATES_OF_EVENTS, (system.nq, system.nv, system.nq, system.nv)):
        wanted[name] = ((n_events, size) if n_events else (0,), "<f8")
    for name, kind in (("resets", "<f8"), ("resets_from", "<i8"), ("forms", "<i8"), ("forms_from", "<i8")):
        wanted[name] = ((None,), kind)
    for name, (shape, kind) in wanted.items():
        _check_array(checkpoint, name, shape, kind)


def _check_array(checkpoint: Checkpoint, name: str, shape: tuple[int | None, ...], kind: str) -> None:
    if name not in checkpoint.arrays:
        raise CheckpointError(f"the checkpoint has no array {name!r}")
    array = checkpoint.arrays[name]
    fits = array.ndim == len(shape) and all(n in (None, k) for n, k in zip(shape, array.shape))
    if not fits or array.dtype.str != kind:
        raise CheckpointError(
            f"the checkpoint does not fit this program: its array {name!r} is {array.dtype} of shape "
            f"{array.shape}, not of {shape}; it was written by another version, or changed"
        )


def _check_history(checkpoint: Checkpoint, run: RunState, n_frames: int) -> None:
    """Check what Python keeps beside the arrays of the loop: places that must be there."""
    held, facts = checkpoint.arrays, checkpoint.facts
    n_forms = max(1, len(held["settings"]))
    for name in ("resets", "forms"):
        begins = held[f"{name}_from"]
        in_order = len(begins) == len(held[name]) and len(begins) and begins[0] == 0
        if not in_order or (np.diff(begins) <= 0).any() or begins[-1] >= n_frames:
            raise CheckpointError(f"the checkpoint's array {name + '_from'!r} does not divide its frames")
    form_numbers = np.append(held["forms"], [form for _, _, form in facts["samples"]])
    if ((form_numbers < -1) | (form_numbers >= n_forms)).any():
        raise CheckpointError("the checkpoint numbers forms of the model that it does not hold")
    for number, controller in enumerate(getattr(run.system, "controllers", ())):
        if hasattr(controller, "next_time"):
            _check_samples(checkpoint, number, controller)
    known = {event["name"] for event in run.system.events}
    known |= {switch["circle"] for switch in run.system.switches if "circle" in switch}
    for name, *_ in facts["events"]:
        if name not in known:
            raise CheckpointError(f"the checkpoint has an event {name!r:.60}, which its model does not have")


def _check_samples(checkpoint: Checkpoint, number: int, sampler: Sampler) -> None:
    """Check what a sampled controller has said: as often as there was time for it, and in order."""
    facts = checkpoint.facts
    names = [f"controller_{number}_{name}" for name in ARRAYS_OF_CONTROLLERS]
    for name, shape in zip(names, ((None,), (None, len(sampler.inputs)), (None,))):
        _check_array(checkpoint, name, shape, "<f8")
    times, values, _ = (checkpoint.arrays[name] for name in names)
    in_order = len(times) > 0 and times[0] == facts["t_start"] and (np.diff(times) > 0.0).all()
    if len(times) != len(values) or not in_order or times[-1] > facts["t"] or not np.isfinite(values).all():
        raise CheckpointError("the checkpoint's samples of a controller are not in order, or not finite")
    n_calls = facts["controllers"][number].get("n_calls", -1)
    if not sampler.fits(n_calls, facts["t"]):
        raise CheckpointError(
            f"the checkpoint counts {n_calls} calls of a controller: its period is another one"
        )


def _check_motion(checkpoint: Checkpoint, run: RunState) -> None:
    """Check what is taken of a stranger's checkpoint: state, step, counts, and what events see."""
    facts, mine = checkpoint.facts, run.arrays
    control, counters, y = (checkpoint.arrays[name] for name in ("control", "counters", "y"))
    if not np.isfinite(y).all():
        raise CheckpointError("the checkpoint's state is not finite")
    odd = ~(np.isfinite(control) & (np.abs(control) < 1e100)) & np.isfinite(mine.control)
    if odd.any():
        raise CheckpointError(
            f"the checkpoint's number {int(np.argmax(odd))} of control is {control[odd][0]:g}: no run gets there"
        )
    t, h = control[at.T], control[at.H]
    if t != facts["t"]:
        raise CheckpointError(f"the checkpoint is of t = {facts['t']:g} s, but its step loop is at {t:g} s")
    if not all(facts["t_start"] <= control[k] <= t for k in (at.T_EVENT, at.T_GRID)):
        raise CheckpointError("the checkpoint's step loop has times outside the run")
    longest = mine.control[at.H_BASE] + mine.control[at.H_SHARE] * (t - facts["t_start"])
    if not 0.0 <= h <= 2.0 * longest:
        raise CheckpointError(f"the checkpoint's step is {h:g} s")
    if control[at.ERROR_OLD] <= 0.0:
        raise CheckpointError("the checkpoint's last error is not above zero")
    blocks = control[at.N_CONTROL :].reshape(at.N_EVENT_BLOCKS, -1)
    sides = (-1.0, -at.LEANING, 0.0, at.LEANING, 1.0)
    if not (np.isin(blocks[at.SIDE], sides).all() and np.isin(blocks[at.FIRED], (0.0, 1.0)).all()):
        raise CheckpointError("the checkpoint's event functions are on no side of zero that there is")
    if (blocks[at.FLOOR] < 0.0).any():
        raise CheckpointError("the checkpoint's event functions have a round-off below zero")
    if not ((counters[: at.NEXT_FRAME] >= 0) & (counters[: at.NEXT_FRAME] < _MOST_COUNTED)).all():
        raise CheckpointError("the checkpoint counts steps below zero, or more than there can be")
    if counters[at.LAST_REJECTED] not in (0, 1):
        raise CheckpointError("the checkpoint's flag of a rejected step is neither 0 nor 1")
    if not run.method.adaptive:
        _check_grid(h, t - control[at.T_GRID], int(counters[at.GRID_STEP]), float(mine.control[at.H]))


def _check_grid(h: float, since: float, n_steps: int, step: float) -> None:
    """A fixed-step method is at most one step behind the point of its grid where it is to go on."""
    if h != step:
        raise CheckpointError(f"the checkpoint's step is {h:g} s, the recording's {step:g} s")
    if not 0 <= n_steps < _MOST_COUNTED or not -1e-6 * h <= since - n_steps * h <= 2.0 * h:
        raise CheckpointError("the checkpoint's steps do not add up to its time")
