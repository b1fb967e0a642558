"""A linear model: small motions about a state, on independent coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.system import System


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B u, y = C x + D u: small deviations from a state, which is not part of x, u and y.

    Attributes
    ----------
    system : System
    p : ndarray, shape (n_p,)
        Parameters, then inputs.
    t : float [s]
    q, v, a, multipliers : ndarray
        The state: coordinates, rates, accelerations, constraint forces.
    kind : str
        "equilibrium"; "steady motion", along which A stays the same; or "moving state", at which A is that of an
        instant.
    A, B, C, D : ndarray, shape (n, n), (n, inputs), (outputs, n), (outputs, inputs)
    states, inputs, outputs : list of str
        What x, u and y are; in the SI units of the model. A small rotation of a quaternion about the body axis of its
        rate w is called `turn(w)`.
    motions : list of str
        What rates move, `nv` of them: all coordinates, but for quaternions, whose small rotations are here.
    shape : ndarray, shape (nv, n)
        `motions` that x brings with it, dependent ones included.
    sizes : ndarray, shape (nv,)
        What counts as large for each of `motions`.
    notes : list of str
        What a reader should know.
    """

    system: System = field(repr=False)
    p: np.ndarray
    t: float
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    multipliers: np.ndarray
    kind: str
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: list[str]
    inputs: list[str]
    outputs: list[str]
    motions: list[str]
    shape: np.ndarray = field(repr=False)
    sizes: np.ndarray = field(repr=False)
    notes: list[str]

    def to_dict(self) -> dict[str, Any]:
        """Return the model as JSON can say it."""
        system = self.system
        return {
            "model": system.name,
            "kind": self.kind,
            "t": self.t,
            "coordinates": {record["name"]: float(x) for record, x in zip(system.coordinates, self.q)},
            "rates": {record["name"]: float(x) for record, x in zip(system.rates, self.v)},
            "multipliers": {
                record["name"]: float(x) for record, x in zip(system.constraints, self.multipliers)
            },
            "states": self.states,
            "inputs": self.inputs,
            "outputs": self.outputs,
            "A": self.A,
            "B": self.B,
            "C": self.C,
            "D": self.D,
            "notes": self.notes,
        }
