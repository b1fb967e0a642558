"""A recorded run, as it was read."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.batches import (
    Solved,
    accelerations_and_multipliers,
    constraint_residuals,
    evaluate,
    outputs,
)
from symgen.runtime.lazy import Late
from symgen.runtime.recording import schema

if TYPE_CHECKING:
    from symgen.runtime.contact.forms import Forms
    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.system import System

forms = Late("symgen.runtime.contact.forms")


@dataclass(frozen=True)
class Settings:
    """What is known of a run before it begins; see `RunRecorder`."""

    title: str
    method: str
    constraints: str
    rtol: float
    atol: float
    module_text: str
    model_text: str
    options: dict[str, Any]
    mesh_folder: Path | None
    content: str = schema.ALL


class Quantities:
    """A system's functions over batches of states (q, v, w), shape (n, ny), at fixed parameters.

    Parameters
    ----------
    system : System
    p : ndarray
        Parameters, then inputs.
    """

    def __init__(self, system: System, p: np.ndarray):
        self.system = system
        self.p = np.ascontiguousarray(p, dtype=float)

    def evaluate(self, function: str, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return a function's results, shape (n, width); no columns for one that the model does not have."""
        return evaluate(self.system, function, self.p, t, y)

    def balance(self, energies: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return T + V − w, shape (n,): constant between resets."""
        work = y[:, self.system.nq + self.system.nv] if self.system.nw else 0.0
        return energies[:, 0] + energies[:, 1] - work

    def shape_sizes(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the bodies' sizes at one state [m]."""
        return self.evaluate("shapes", np.array([t]), y[None])[0]

    def residuals(self, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the largest position and velocity residual of the constraints, shape (n, 2)."""
        return np.column_stack(constraint_residuals(self.system, self.p, t, y))

    def multipliers(self, t: np.ndarray, y: np.ndarray, settings: np.ndarray) -> np.ndarray:
        """Return the multipliers, shape (n, m); `settings` of stops and frictions have shape (n, …)."""
        if not self.system.m:
            return np.zeros((len(t), 0))
        if not settings.shape[1]:
            return self.accelerations_and_multipliers(t, y)[1]
        return self.forms(settings).evaluate(self.system, self.p, t, y)[1]

    def outputs(self, t: np.ndarray, y: np.ndarray, settings: np.ndarray) -> np.ndarray:
        """Return the outputs, shape (n, number of outputs); `settings` of stops and frictions have shape (n, …)."""

        def solved() -> Solved:
            if settings.shape[1]:
                return self.forms(settings).evaluate(self.system, self.p, t, y)
            return *self.accelerations_and_multipliers(t, y), np.zeros((len(t), 0))

        return outputs(self.system, self.p, t, y, solved)

    def forms(self, settings: np.ndarray) -> Forms:
        """Return which form of the model holds at each frame, by the settings of stops and frictions."""
        distinct, index = np.unique(settings, axis=0, return_inverse=True)
        return forms.Forms(distinct, index.reshape(-1))

    def in_form(self, settings: np.ndarray) -> Quantities:
        """Return the functions of the form of the model that applies with these settings of stops and frictions."""
        if not len(settings):
            return self
        p = self.p.copy()
        p[self.system.settings_of_switches] = settings
        return Quantities(forms.form_of(self.system, settings), p)

    def accelerations_and_multipliers(self, t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return vdot, shape (n, nv), and the multipliers, shape (n, m)."""
        return accelerations_and_multipliers(self.system, self.p, t, y)


@dataclass(frozen=True)
class RecordedEvent:
    """An event of a run.

    Attributes
    ----------
    name : str
    t : float [s]
    frame : int
        Number of the first frame after it.
    energy_change : float [J]
    whole : EventRecord, optional
        As the run had it, of events that switched stops or frictions of a model whose work counts.
    """

    name: str
    t: float
    frame: int
    energy_change: float
    whole: EventRecord | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Recording:
    """What a recording holds. Arrays are read-only.

    Attributes
    ----------
    path : Path
    name, title : str
        Of the model; of the run.
    complete : bool
        False for a run that was cut short: `status` is then `incomplete`, and `health` and `stats` are empty.
    status : str
    module_text, model_text : str
    method, constraints : str
    rtol, atol : float
    options, stats : dict
    health : list of dict
    versions : dict of str
    parameters, inputs : dict of float
        By name, in the order of the model.
    inputs_over_time : dict
        What `symgen.runtime.inputs.recorded` wrote about inputs that are not constant, by name.
    content : {"all", "states"}
        Whether it holds all that is shown, or states alone, of which the rest follows.
    t : ndarray, shape (n,) [s]
    q, v, w, multipliers, settings : ndarray, shape (n, …)
        `settings` say which stops are closed and which frictions stick.
    energy : ndarray, shape (n, 3)
        T, V and T + V as they were written; of states alone, (0, 3).
    events : tuple of RecordedEvent
    sha256 : str
        Of the states, as the closing record has it; empty if there is none.
    n_frames_written : int
        As the closing record has it; -1 if there is none.
    file_bytes, file_sha256 : int, str
        Length and SHA-256 of the file before the closing record, as that has it; 0 and empty if there is none.
    lost : int
        Bytes at the end of the file that are no whole record: it was cut off there.
    """

    path: Path
    name: str
    title: str
    complete: bool
    status: str
    module_text: str
    model_text: str
    method: str
    constraints: str
    rtol: float
    atol: float
    options: dict[str, Any]
    stats: dict[str, Any]
    health: list[dict[str, Any]]
    versions: dict[str, str]
    parameters: dict[str, float]
    inputs: dict[str, float]
    inputs_over_time: dict[str, Any]
    content: str
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    w: np.ndarray
    multipliers: np.ndarray
    settings: np.ndarray
    energy: np.ndarray
    events: tuple[RecordedEvent, ...]
    sha256: str
    n_frames_written: int
    file_bytes: int
    file_sha256: str
    lost: int

    @property
    def inputs_at_frames(self) -> list[str]:
        """Inputs of which the recording has values at its frames only."""
        return [name for name, record in self.inputs_over_time.items() if "known" in record]

    @property
    def p(self) -> np.ndarray:
        """Parameters, then inputs, as kernels take them."""
        return np.array([*self.parameters.values(), *self.inputs.values()], dtype=float)

    @property
    def states(self) -> np.ndarray:
        """The states Y = (q, v, w), shape (n, nq + nv + nw)."""
        return np.ascontiguousarray(np.hstack([self.q, self.v, self.w]))

    def state_sha256(self) -> str:
        """Return the SHA-256 of the states as they were read."""
        columns = {"t": self.t, "q": self.q, "v": self.v, "w": self.w}
        columns |= {"lambda": self.multipliers, "settings": self.settings}
        return schema.state_sha256(columns)
