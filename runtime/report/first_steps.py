"""The first numbers of a run, to be checked by hand: the state, M, f, a at the start, and two steps of a formula."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, evaluate

if TYPE_CHECKING:
    from symgen.runtime.system import System


@dataclass(frozen=True)
class Start:
    """The equations of motion M a = f + Gᵀ λ, G a = γ in one state.

    Attributes
    ----------
    t : float [s]
    q, v, a, f : ndarray, shapes (nq,), (nv,), (nv,), (nv,)
    multipliers, gamma : ndarray, shape (m,)
    mass_matrix : ndarray, shape (nv, nv)
    jacobian : ndarray, shape (m, nv)
    """

    t: float
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    f: np.ndarray
    multipliers: np.ndarray
    gamma: np.ndarray
    mass_matrix: np.ndarray
    jacobian: np.ndarray

    @property
    def imbalance(self) -> float:
        """Largest component of M a - f - Gᵀ λ and G a - γ."""
        motion = self.mass_matrix @ self.a - self.f - self.jacobian.T @ self.multipliers
        constraints = self.jacobian @ self.a - self.gamma
        return float(np.abs(np.concatenate([motion, constraints])).max(initial=0.0))


@dataclass(frozen=True)
class Step:
    """A step of semi-implicit Euler: from q, v with acceleration a to q_next, v_next."""

    t: float
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    q_next: np.ndarray
    v_next: np.ndarray


def start_values(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> Start:
    """Return the equations of motion in numbers.

    Parameters
    ----------
    p : ndarray, shape (n_p,)
    t : float [s]
    q, v : ndarray, shapes (nq,) and (nv,)
    """
    times, states = np.array([t]), np.concatenate([q, v])[None]
    m, nv = system.m, system.nv
    a, multipliers = (rows[0] for rows in accelerations_and_multipliers(system, p, times, states))

    def row(function: str) -> np.ndarray:
        return evaluate(system, function, p, times, states)[0]

    return Start(
        t=t, q=q, v=v, a=a, f=row("forces"), multipliers=multipliers,
        gamma=row("gamma") if m else np.zeros(0),
        mass_matrix=row("mass_matrix").reshape(nv, nv),
        jacobian=row("constraint_jacobian").reshape(m, nv) if m else np.zeros((0, nv)),
    )  # fmt: skip


def semi_implicit_euler(
    system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray, h: float, n: int = 2
) -> list[Step]:
    """Return steps of v' = v + h a(t, q, v), q' = q + h v'; none where these formulas are not all of the method.

    That is so with constraints, whose states are projected, and where rates are not the coordinates' derivatives.

    Parameters
    ----------
    h : float [s]
    n : int
        How many steps.
    """
    if system.m or system.nq != system.nv:
        return []
    steps = []
    for _ in range(n):
        a = accelerations_and_multipliers(system, p, np.array([t]), np.concatenate([q, v])[None])[0][0]
        v_next = v + h * a
        steps.append(Step(t, q, v, a, q + h * v_next, v_next))
        t, q, v = t + h, steps[-1].q_next, v_next
    return steps
