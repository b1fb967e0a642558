"""What is seen of small motions: coordinates, rates, accelerations and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.linear.duals import derivatives
from symgen.runtime.names import acceleration_labels, rate_labels

if TYPE_CHECKING:
    from symgen.runtime.linear.tangent import Tangent
    from symgen.runtime.system import System


def observation(
    system: System, p: np.ndarray, tangent: Tangent, names: Sequence[str] | None
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return C, D and the names of y: those given, or all coordinates and outputs of the model.

    Raises
    ------
    RuntimeModelError
        There is no such coordinate, rate, acceleration or output.
    """
    equations, n_u = tangent.equations, tangent.B.shape[1]
    kinematics = equations.kinematics(tangent.q)
    coordinates = [record["name"] for record in system.coordinates]
    known = dict(zip(coordinates, kinematics @ tangent.displacements))
    own: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    if system.has("outputs"):
        own = _model_outputs(system, p, tangent, kinematics)
    labels = rate_labels(system.coordinates, system.rates)
    wanted = list(names) if names is not None else [*coordinates, *own]
    moving = known | dict(zip(labels, tangent.rates))
    steered = dict(zip(acceleration_labels(system.coordinates, system.rates), range(system.nv)))
    rows = []
    for name in wanted:
        if name in own:
            rows.append(own[name])
        elif name in moving:
            rows.append((moving[name], np.zeros(n_u)))
        elif name in steered:
            k = steered[name]
            rows.append((tangent.accelerations[k], tangent.accelerations_by_inputs[k]))
        else:
            everything = [*own, *moving, *steered]
            raise RuntimeModelError(
                f"model {system.name!r} has no output {name!r}: {nearest(name, everything)}"
            )
    n = len(tangent.A)
    C, D = (np.array([row[k] for row in rows]).reshape(len(rows), width) for k, width in ((0, n), (1, n_u)))
    return C, D, wanted


def _model_outputs(
    system: System, p: np.ndarray, tangent: Tangent, kinematics: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    n, n_u = len(tangent.A), tangent.B.shape[1]
    along = np.zeros((system.nq + system.nv, n + n_u))
    along[: system.nq, :n], along[system.nq :, :n] = kinematics @ tangent.displacements, tangent.rates
    along_p = np.zeros((len(p), n + n_u))
    along_p[len(system.parameters) + np.arange(n_u), n + np.arange(n_u)] = 1.0
    y = np.concatenate([tangent.q, tangent.v])
    _, slopes = derivatives(system, "outputs", tangent.equations.t, y, p, along, along_p)
    return {record["name"]: (row[:n], row[n:]) for record, row in zip(system.outputs, slopes)}
