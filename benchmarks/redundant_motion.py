"""Motion in high precision where constraints are redundant: those that follow from the others are left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg
from high_precision import PROJECTIONS, REAL, Motion

from symgen.runtime import System

_INDEPENDENT = 1e-8


class RedundantMotion(Motion):
    """M a = f + Gᵀλ, G a = γ with independent rows of G, solved by elimination with row exchanges.

    It does not call the model's `rhs`. Which rows are left out is decided anew in each evaluation, for those that are
    independent at the start need not be everywhere; their number stays. For rates qdot = v and holonomic constraints.

    Parameters
    ----------
    rank : int
        How many constraints are independent.
    """

    def __init__(self, system: System, module_text: str, p: np.ndarray, rank: int):
        super().__init__(system, module_text, p)
        self.rank = rank

    def derivative(self, t, y: np.ndarray) -> np.ndarray:
        self.calls += 1
        return np.concatenate([y[self.system.nq :], self._solved(t, y)[0]])

    def projected(self, y: np.ndarray) -> np.ndarray:
        nq, zero = self.system.nq, REAL(0)
        for _ in range(PROJECTIONS):
            residual = self._evaluate("constraint_residual", self.system.nh + self.system.m, zero, y)
            moved = self._kkt(zero, y, [zero] * nq, -residual[: self.system.nh])[0]
            y = np.concatenate([y[:nq] + moved, y[nq:]])
            residual = self._evaluate("constraint_residual", self.system.nh + self.system.m, zero, y)
            turned = self._kkt(zero, y, [zero] * nq, -residual[self.system.nh :])[0]
            y = np.concatenate([y[:nq], y[nq:] + turned])
        return y

    def multipliers(self, t, y: np.ndarray) -> np.ndarray:
        """Return those of least norm that act as the multipliers of the independent rows do.

        With G = C G_S, Cᵀλ = λ_S: λ = C (CᵀC)⁻¹ λ_S.
        """
        whole = self._jacobian(t, y)
        _, acting, rows = self._solved(t, y)
        chosen = whole[rows]
        factors = _solve(chosen @ chosen.T, chosen @ whole.T).T
        return factors @ _solve(factors.T @ factors, acting[:, None])[:, 0]

    def _solved(self, t, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[int]]:
        """Return accelerations, the multipliers of the independent rows, and which these are."""
        forces = self._evaluate("forces", self.system.nv, t, y)
        return self._kkt(t, y, forces, self._evaluate("gamma", self.system.m, t, y))

    def _kkt(
        self, t, y: np.ndarray, forces: Sequence, right: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, list]:
        nv, n = self.system.nv, self.system.nv + self.rank
        whole = self._jacobian(t, y)
        rows = strongest_rows(whole.astype(float))[: self.rank]
        matrix = np.full((n, n), REAL(0), dtype=object)
        matrix[:nv, :nv] = self._evaluate("mass_matrix", nv * nv, t, y).reshape(nv, nv)
        matrix[:nv, nv:], matrix[nv:, :nv] = -whole[rows].T, whole[rows]
        solution = _solve(matrix, np.array([[x] for x in (*forces, *right[rows])], dtype=object))
        return solution[:nv, 0], solution[nv:, 0], rows

    def _jacobian(self, t, y: np.ndarray) -> np.ndarray:
        nv, m = self.system.nv, self.system.m
        return self._evaluate("constraint_jacobian", m * nv, t, y).reshape(m, nv)

    def _evaluate(self, name: str, size: int, t, y: np.ndarray) -> np.ndarray:
        out = [REAL(0)] * size
        self._functions[name](t, list(y), self.p, out)
        return np.array(out, dtype=object)


def rank_at(system: System, p: np.ndarray, state: np.ndarray) -> int:
    """Return how many constraints are independent at a state."""
    jacobian = system.kernel("constraint_jacobian")(0.0, state, p).reshape(system.m, system.nv)
    return int(np.linalg.matrix_rank(jacobian, tol=_INDEPENDENT * np.linalg.norm(jacobian, 2)))


def strongest_rows(jacobian: np.ndarray) -> list[int]:
    """Return the rows of a matrix, each the one that adds most to those before it."""
    return scipy.linalg.qr(jacobian.T, mode="r", pivoting=True)[1].tolist()


def _solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution of a linear system."""
    a = np.concatenate([matrix, right], axis=1)
    n = len(matrix)
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(a[i, k]))
        a[[k, best]] = a[[best, k]]
        for i in range(k + 1, n):
            if a[i, k] != 0:
                a[i, k:] = a[i, k:] - a[i, k] / a[k, k] * a[k, k:]
    x = a[:, n:].copy()
    for k in reversed(range(n)):
        x[k] = (x[k] - a[k, k + 1 : n] @ x[k + 1 :]) / a[k, k] if k + 1 < n else x[k] / a[k, k]
    return x
