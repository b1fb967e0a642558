"""A recorded run, as it was read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import schema


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
    """

    name: str
    t: float
    frame: int
    energy_change: float


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
    t : ndarray, shape (n,) [s]
    q, v, w, multipliers, settings : ndarray, shape (n, …)
        `settings` say which stops are closed and which frictions stick.
    energy : ndarray, shape (n, 3)
        T, V and T + V as they were written.
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
