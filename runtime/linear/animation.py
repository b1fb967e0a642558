"""A mode as a recording that repeats: one swing about the state, slowed down or sped up so that one can watch it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.positions import Positions
from symgen.runtime.recording.recorder import RunRecorder

if TYPE_CHECKING:
    from symgen.runtime.linear.model import LinearModel
    from symgen.runtime.linear.modes import Mode

SECONDS = 2.0  # that one swing takes in the recording
_FRAMES = 120
_LARGEST = 0.15  # of what counts as large for a coordinate
_MAX_PROJECTIONS = 30
_CLOSED = 1e-12


def record_mode(
    model: LinearModel,
    mode: Mode,
    path: str | os.PathLike[str],
    *,
    module_text: str,
    model_text: str = "",
    mesh_folder: str | os.PathLike[str] | None = None,
    amplitude: float | None = None,
) -> None:
    """Write a recording of one mode, which the viewer plays in a loop.

    The motion is q0 + amplitude Re(shape exp(i φ)), with φ once around, brought onto the constraints; growth and decay
    are left out. Its time axis is stretched, see `SECONDS`; rates are those of the model's own time.

    Parameters
    ----------
    mode : Mode
        Of `model.modes()`.
    path : path-like
    module_text, model_text : str
        The generated module, and the model as its author wrote it.
    mesh_folder : path-like, optional
        The model's folder, below which its meshes lie.
    amplitude : float, optional
        Of the largest component, in its SI unit; by default what can be seen well.

    Raises
    ------
    RuntimeModelError
        The mode moves no coordinate, or nothing can be written there.
    """
    system = model.system
    largest = float(np.abs(mode.shape / model.sizes).max(initial=0.0))
    if largest <= _CLOSED:
        raise RuntimeModelError(f"mode {mode.number} moves no coordinate: there is nothing to show")
    factor = _LARGEST / largest if amplitude is None else amplitude
    times = np.linspace(0.0, SECONDS, _FRAMES + 1)
    states = np.array([_state(model, mode, factor, phase) for phase in 2.0 * np.pi * times / SECONDS])
    states = np.hstack([states, np.zeros((len(states), system.nw))])
    period = f"{mode.frequency:.6g} Hz, " if mode.frequency else ""
    recorder = RunRecorder(
        path,
        system,
        model.p,
        method=f"mode {mode.number}",
        constraints="projection" if system.m else "",
        rtol=0.0,
        atol=0.0,
        module_text=module_text,
        model_text=model_text,
        title=f"mode {mode.number} of {system.name}: {period}{mode.description()}",
        options={"mode": mode.number, "frequency": mode.frequency, "amplitude": factor, "seconds": SECONDS},
        mesh_folder=mesh_folder,
    )
    with recorder:
        recorder.start(0.0, states[0])
        recorder.frames(times, states)
        recorder.finish("success", [], {})


def _state(model: LinearModel, mode: Mode, factor: float, phase: float) -> np.ndarray:
    turned = factor * np.exp(1j * phase) * mode.shape
    rates = 1j * mode.eigenvalue.imag * turned
    positions = Positions(model.system)
    y = np.concatenate([positions.retract(model.q, turned.real), model.v + rates.real])
    return _closed(model, y) if model.system.m else y


def _closed(model: LinearModel, y: np.ndarray) -> np.ndarray:
    """Bring a state onto the constraints: a mode satisfies them to first order only."""
    system, n = model.system, model.system.nq + model.system.nv
    for _ in range(_MAX_PROJECTIONS):
        out = system.kernel("project")(model.t, y, model.p)
        if not np.isfinite(out).all():
            raise RuntimeModelError("the constraints cannot be closed at this amplitude: give a smaller one")
        y, left = out[:n], np.abs(out[n:]).max()
        if left <= _CLOSED:
            break
    return y
