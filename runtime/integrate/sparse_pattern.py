"""The pattern of a large model's Newton matrix, found once: its entries, and in which order they are eliminated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.integrate.sparse_newton import (
    BY_POSITION,
    BY_QUATERNION,
    BY_RATE,
    BY_TURN,
    BY_UNKNOWN,
    NewtonPattern,
)
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

    from symgen.runtime.system import System

# Entries of factors: pivots off the diagonal lead to more than there are with all pivots on it.
_ROOM = 3
_DOMINANT = 1e3


def newton_pattern(system: System) -> NewtonPattern:
    """Return the pattern of the Newton matrix of a model; made once."""
    key = "_newton_pattern"
    if key not in system.__dict__:
        system.__dict__[key] = _pattern(system)
    return system.__dict__[key]


def _pattern(system: System) -> NewtonPattern:
    nv, n = system.nv, system.nv + system.m
    kind, row, column, turns = _entries(system)
    # A diagonal entry that is always there lets a coordinate without inertia or force be found singular, not missing.
    diagonal = np.arange(nv)
    keys = np.concatenate([np.where(kind == BY_QUATERNION, 0, column * n + row), diagonal * n + diagonal])
    unique, slot = np.unique(keys, return_inverse=True)
    start = np.searchsorted(unique, np.arange(n + 1) * n)
    rows = unique % n
    order, n_factor = _elimination(start, rows, n)
    return NewtonPattern(
        *(np.ascontiguousarray(x, dtype=np.int64) for x in (kind, row, column, slot[: len(kind)], turns)),
        np.ascontiguousarray(start, dtype=np.int64),
        np.ascontiguousarray(rows, dtype=np.int64),
        order,
        n_factor,
        _ROOM * n_factor + n,
    )


def _entries(system: System) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Kinds, rows and columns of entries, and the table `turns`, see `NewtonPattern`."""
    nq, nv = system.nq, system.nv
    row, column = np.divmod(system.entry_places("residual_jacobian"), nq + 2 * nv + system.m)
    kind = np.where(column < nq, BY_POSITION, np.where(column < nq + nv, BY_RATE, BY_UNKNOWN))
    column = column - np.array([0, nq, nq + nv])[kind]
    positions = Positions(system)
    rate = np.zeros(nq, dtype=np.int64)
    rate[positions.plain_q] = positions.plain_v
    number = {(i, k): e for e, (i, k) in enumerate(zip(row, column)) if kind[e] == BY_POSITION}
    turns, turned = [], []
    for i, j in positions.quaternions:
        for equation in sorted({r for r, k in number if i <= k < i + 4}):
            turns.append([i, j, *(number.get((equation, k), -1) for k in range(i, i + 4))])
            turned += [(equation, j + axis) for axis in range(3)]
    for _, _, *entries in turns:
        kind[[e for e in entries if e >= 0]] = BY_QUATERNION
    plain = kind == BY_POSITION
    column[plain] = rate[column[plain]]
    more = np.array(turned, dtype=np.int64).reshape(-1, 2)
    kind = np.concatenate([kind, np.full(len(more), BY_TURN)])
    table = np.array(turns, dtype=np.int64).reshape(-1, 6)
    return kind, np.concatenate([row, more[:, 0]]), np.concatenate([column, more[:, 1]]), table


def _elimination(start: np.ndarray, rows: np.ndarray, n: int) -> tuple[np.ndarray, int]:
    """An order of minimum degree on the graph of A + Aᵀ, and the entries of L with pivots on the diagonal.

    SuperLU finds both where the diagonal is dominant (Liu, ACM TOMS 11 (1985) 141; Li, ACM TOMS 31 (2005) 302).
    """
    from scipy.sparse import csc_matrix, identity
    from scipy.sparse.linalg import splu

    pattern: csc_matrix = csc_matrix((np.ones(len(rows)), rows, start), shape=(n, n))
    dominant = (pattern + pattern.T + _DOMINANT * n * identity(n)).tocsc()
    factors = splu(dominant, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    return np.argsort(factors.perm_c).astype(np.int64), int(factors.L.nnz)
