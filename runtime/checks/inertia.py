"""Masses and inertias at run-time parameters: no negative kinetic energy, and no freedom without inertia."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.abi import ENTRIES
from symgen.runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from symgen.runtime.system import System

_ROUND_OFF = 1e-10
_TAKES_PART = 1e-6  # of the largest part in a motion
_NONE = 1e-14  # smallest eigenvalue of M, scaled to a unit diagonal, that counts as inertia
_DOUBTFUL = 1e-10  # with a smallest eigenvalue above this, a block is not looked at by itself
_LARGEST_WHOLE = 300  # rates


def refuse_negative_inertia(system: System, p: np.ndarray, t: float, state: np.ndarray) -> None:
    """Raise RuntimeModelError where the mass matrix at a state is negative, or zero for a motion that is free.

    Parameters
    ----------
    p : ndarray
        Parameters and inputs; they may differ from those that the model was checked with.
    state : ndarray, shape (nq + nv,)
    """
    for rates, mass in _blocks(system, p, t, state):
        still = _check(system, mass, rates)
        if still.shape[1]:
            _refuse_free_motion(system, p, t, state, rates, still)


def _blocks(
    system: System, p: np.ndarray, t: float, state: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Rates, and the mass matrix of these: the whole, or of a large model the doubtful blocks of those it couples."""
    nv = system.nv
    if nv <= _LARGEST_WHOLE:
        yield np.arange(nv), system.kernel("mass_matrix")(t, state, p).reshape(nv, nv)
        return
    rows, columns = np.divmod(system.entry_places("mass_matrix"), nv)
    values = system.kernel(f"mass_matrix{ENTRIES}")(t, state, p)
    labels = _coupled(nv, *(x[(rows != columns) & (values != 0.0)] for x in (rows, columns)))
    order, sizes = np.argsort(labels, kind="stable"), np.bincount(labels)
    first = np.cumsum(sizes) - sizes
    place = np.zeros(nv, dtype=int)  # of each rate in its block
    place[order] = np.arange(nv) - first[labels[order]]
    within = labels[rows] == labels[columns]
    found = []
    for size in np.unique(sizes):
        blocks, number = np.flatnonzero(sizes == size), np.zeros(len(sizes), dtype=int)
        number[blocks] = np.arange(len(blocks))
        own = within & (sizes[labels[rows]] == size)
        matrices = np.zeros((len(blocks), size, size))
        matrices[number[labels[rows[own]]], place[rows[own]], place[columns[own]]] = values[own]
        found += [(blocks[k], matrices[k]) for k in np.flatnonzero(_doubtful(matrices))]
    for block, mass in sorted(found, key=lambda pair: pair[0]):
        yield order[first[block] : first[block] + sizes[block]], mass


def _doubtful(matrices: np.ndarray) -> np.ndarray:
    """Which of many symmetric matrices, shape (n, size, size), need a closer look; those of no numbers do not."""
    finite = np.isfinite(matrices).all(axis=(1, 2))
    scaled = np.where(finite[:, None, None], matrices, 1.0)
    scale = np.sqrt(np.abs(np.diagonal(scaled, axis1=1, axis2=2)))
    scale = np.where(scale == 0.0, 1.0, scale)
    scaled = scaled / (scale[:, :, None] * scale[:, None, :])
    lowest = scaled[:, 0, 0] if scaled.shape[1] == 1 else np.linalg.eigvalsh(scaled)[:, 0]
    return finite & (lowest <= _DOUBTFUL)


def _coupled(nv: int, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """A number for each rate, equal where entries off the diagonal couple them."""
    if not len(rows):
        return np.arange(nv)  # SciPy takes longer to import than many runs take
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    graph = csr_array((np.ones(len(rows)), (rows, columns)), shape=(nv, nv))
    return connected_components(graph, directed=False)[1]


def _refuse_free_motion(
    system: System, p: np.ndarray, t: float, state: np.ndarray, rates: np.ndarray, still: np.ndarray
) -> None:
    """Refuse motions without inertia (columns of `still`) that no constraint determines."""
    jacobian = np.zeros((0, len(rates)))
    if system.m:
        whole = system.kernel("constraint_jacobian")(t, state, p).reshape(system.m, system.nv)
        jacobian = whole[:, rates]
    if not np.isfinite(jacobian).all():
        return
    held = jacobian @ still
    _, values, directions = np.linalg.svd(np.vstack([held, np.zeros((still.shape[1], still.shape[1]))]))
    if values[-1] > _ROUND_OFF * np.abs(jacobian).max(initial=0.0):
        return
    parts = np.abs(still @ directions[-1])
    name = system.rates[rates[int(np.argmax(parts))]]["name"]
    together = [system.rates[rate]["name"] for rate in rates[parts > _TAKES_PART * parts.max()]]
    if len(together) > 1:
        raise RuntimeModelError(
            f"model {system.name!r}: {' and '.join(map(repr, together[:4]))} can move together without moving anything "
            "that has inertia, and no constraint holds that, so nothing determines how they accelerate; successive "
            "rotations do so where their axes fold onto each other: start elsewhere, or take other coordinates"
        )
    raise RuntimeModelError(
        f"model {system.name!r}: nothing determines how coordinate {name!r} accelerates at these parameters: it has no "
        "inertia, and no constraint ties it to what has; give it a mass, or a constraint"
    )


def _check(system: System, mass: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Refuse negative inertia; returns the directions without any as columns."""
    if not np.all(np.isfinite(mass)):
        return np.zeros((len(mass), 0))  # the run itself says where that comes from
    # Scaled to a unit diagonal: coordinates of different units stay comparable.
    scale = np.sqrt(np.abs(np.diag(mass)))
    scale[scale == 0.0] = 1.0
    lowest, directions = np.linalg.eigh(mass / np.outer(scale, scale))
    if lowest[0] < -_ROUND_OFF:
        name = system.rates[rates[int(np.argmax(np.abs(directions[:, 0])))]]["name"]
        raise RuntimeModelError(
            f"model {system.name!r}: the inertia that acts on coordinate {name!r} is negative at these parameters: "
            "masses and inertias must not be negative; see what --set changed"
        )
    return directions[:, lowest <= _NONE] / scale[:, None]
