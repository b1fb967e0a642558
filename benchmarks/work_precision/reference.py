"""End states of the scenes in high precision, and the error of a run against them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from symgen.runtime.system import System

    from .scenes import Scene


@dataclass(frozen=True)
class Reference:
    """The end state of a scene.

    Attributes
    ----------
    start, end : ndarray, shape (nq + nv,)
        Coordinates, then rates.
    p : ndarray
        Parameters, then inputs.
    size : ndarray, shape (nq + nv,)
        Largest coordinate, or rate, of the whole run.
    claimed : float
        Error of the reference itself, in parts of `size`.
    method : str
        How it was made.
    multipliers : ndarray, shape (m,)
        At the end; those of least norm where they are not unique.
    largest_multiplier : float
        Of the whole run.
    """

    start: np.ndarray
    end: np.ndarray
    p: np.ndarray
    size: np.ndarray
    claimed: float
    method: str
    multipliers: np.ndarray
    largest_multiplier: float

    def error(self, state: np.ndarray) -> float:
        """Return the largest error of a state (q, v, ...), coordinates in parts of the run's largest, rates too."""
        error = np.abs(state[: len(self.end)] - self.end) / self.size
        return float(error.max()) if np.all(np.isfinite(error)) else np.inf

    def multiplier_error(self, multipliers: np.ndarray) -> float | None:
        """Return the largest error of the multipliers at the end, in parts of the run's largest; None without any."""
        if not self.multipliers.size:
            return None
        error = np.abs(multipliers - self.multipliers).max() / self.largest_multiplier
        return float(error) if np.isfinite(error) else np.inf


def read_reference(folder: Path, scene: Scene, system: System) -> Reference:
    """Read `<scene>.json` and hold it against the model as it is now.

    Raises
    ------
    RuntimeModelError
        The file is missing, or it is of another model, start or parameters.
    """
    path = Path(folder) / f"{scene.name}.json"
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RuntimeModelError(
            f"scene {scene.name!r} has no readable reference {path.name}: {error}"
        ) from None
    p = system.parameter_values(scene.parameters)
    names = [entry["name"] for entry in (*system.parameters, *system.inputs)]
    expected = {
        "model": scene.model,
        "options": dict(scene.options),
        "t_end": scene.t_end,
        "coordinates": [entry["name"] for entry in system.coordinates],
        "rates": [entry["name"] for entry in system.rates],
        "parameters": dict(zip(names, p.tolist(), strict=True)),
    }
    for key, value in expected.items():
        if data.get(key) != value:
            raise RuntimeModelError(
                f"the reference of scene {scene.name!r} was made for other {key}: make it anew with "
                f"benchmarks/make_references.py {scene.name}"
            )
    q, v, multipliers = data["end"]["q"], data["end"]["v"], data["end"].get("multipliers", [])
    return Reference(
        start=np.array([*data["start"]["q"], *data["start"]["v"]]),
        end=np.array([float(x) for x in (*q, *v)]),
        p=p,
        size=np.repeat([data["size"]["q"], data["size"]["v"]], [len(q), len(v)]),
        claimed=data["error"],
        method=data["method"],
        multipliers=np.array([float(x) for x in multipliers]),
        largest_multiplier=data["size"].get("multipliers", 0.0),
    )
