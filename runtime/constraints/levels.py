"""A model's constraints at fixed parameters and time, with the scales that errors are held against."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

import numpy as np

from symgen.runtime.abi import ENTRIES
from symgen.runtime.positions import ANGLES, Positions
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from scipy.sparse import csc_array

    from symgen.runtime.system import System


# Without units nothing tells an angle from a length in micrometres but the constraints themselves: a coordinate that
# changes them by many times the size of their terms has been moved too far.

SMALL_CHANGE = 1e-6  # of parameters: what they make of the constraints' terms
FAR = 30.0  # terms of a constraint: a change by more says that the sizes are not those of the model
DIVIDED_BY, AT_ONCE = 4.0, 16
_DIVIDED = DIVIDED_BY ** -np.arange(float(AT_ONCE))
SMALLEST = 1e-30
_MOST_REMEMBERED = 16
LONG_AND_PARTS = (1.0, 1.0 / 16.0, 1.0 / 37.0)  # a long way, parts of it,
TURNS = 100.0  # [rad]
STRAIGHT = 0.3  # and what they may change of what all of it does


class PositionConstraints(Protocol):
    """Constraints at a time and parameters, as `levels.Constraints` has them."""

    t: float
    p: np.ndarray

    def position(self, q: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """Return the residuals of positions, perhaps with other parameters."""

    def residuals(self, places: np.ndarray) -> np.ndarray:
        """Return them at several places, shape (k, nh)."""


class Units:
    """Which coordinates, parameters and inputs of a model have one unit: what is large is large beside these.

    Attributes
    ----------
    bare : ndarray of int
        Coordinates without a unit that are no numbers of quaternions.
    """

    def __init__(self, system: System):
        records = [*system.coordinates, *system.parameters, *system.inputs]
        units = [record["unit"] for record in records]
        turned = {k for i in system.quaternions for k in range(i, i + 4)}
        self.bare = np.array([k for k in range(system.nq) if units[k] == "" and k not in turned], dtype=int)
        self._angles = np.array([unit in ANGLES for unit in units[: system.nq]], dtype=bool)
        names = list(dict.fromkeys(units))
        numbers = np.array([names.index(unit) for unit in units])
        self._of_coordinates = numbers[: system.nq]
        self._together = np.argsort(numbers, kind="stable")
        self._first = np.searchsorted(numbers[self._together], np.arange(len(names)))

    def sizes(self, q: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return 1 for angles, else the largest value with a coordinate's unit, or 1 where all are zero.

        Parameters
        ----------
        q, p : ndarray, shapes (..., nq) and (..., at least the number of parameters and inputs)

        Returns
        -------
        ndarray, shape (..., nq)
        """
        values = np.abs(np.concatenate([q, p], axis=-1)[..., self._together])
        largest = np.fmax(np.fmax.reduceat(values, self._first, axis=-1), 0.0)
        sizes = np.where(largest != 0.0, largest, 1.0)[..., self._of_coordinates]
        return np.where(self._angles, 1.0, sizes)


def units_of(system: System) -> Units:
    """Return the units of a model, which are looked for once."""
    found = vars(system).get("_units_of_sizes")
    if found is None:
        found = vars(system)["_units_of_sizes"] = Units(system)
    return found


def coordinate_sizes(
    system: System, constraints: PositionConstraints, q: np.ndarray, p: np.ndarray
) -> np.ndarray:
    """Return what counts as large for each coordinate, shape (nq,).

    1 for angles. Where there is a unit, the largest value among coordinates and parameters that have it. Without one 1,
    or the largest value of such coordinates, unless constraints are not of that size.
    """
    units = units_of(system)
    sizes, bare = units.sizes(q, p), units.bare
    if len(bare):
        sizes[bare] = max(1.0, np.abs(q[bare]).max())
        if system.nh and np.isfinite(q).all():
            sizes = _remembered(system, constraints, q, sizes, bare)
    return sizes


def _remembered(
    system: System, constraints: PositionConstraints, q: np.ndarray, sizes: np.ndarray, which: np.ndarray
) -> np.ndarray:
    """What `_fit` makes of the sizes; the start of a run is asked for several times."""
    known = vars(system).setdefault("_fitted_sizes", {})
    key = constraints.t, q.tobytes(), constraints.p.tobytes()
    if key not in known:
        if len(known) >= _MOST_REMEMBERED:
            known.clear()
        with np.errstate(over="ignore", invalid="ignore"):
            bare = np.zeros(len(q), dtype=bool)
            bare[which] = True
            _fit(constraints, q, sizes, bare)
        known[key] = sizes
    return known[key].copy()


def _fit(constraints: PositionConstraints, q: np.ndarray, sizes: np.ndarray, bare: np.ndarray) -> None:
    """Make the sizes of coordinates without units smaller, where constraints say so."""
    at = constraints.position(q)

    def changes(steps: np.ndarray) -> np.ndarray:
        """How much the constraints change by some steps of the coordinates."""
        moved = np.abs(constraints.residuals(q + steps) - at)
        return np.where(np.isfinite(moved), moved, np.inf)

    def change(where: np.ndarray) -> np.ndarray:
        """How much they change where some coordinates move by their sizes."""
        return changes((where * sizes)[None])[0]

    each = np.eye(len(q))
    for k in np.flatnonzero(bare & (sizes > 1.0)):
        if not _goes_on(constraints, q, at, np.copysign(sizes[k], q[k]) * each[k]):
            sizes[k] = 1.0
    terms = _terms(constraints, q, at, sizes)
    if (change(bare * (1.0 - 0.3 * np.abs(odd(len(q))))) <= FAR * terms).all():
        return
    # What returns is an angle, however small all of them are here.
    waiting = [k for k in np.flatnonzero(bare) if _goes_on(constraints, q, at, TURNS * each[k])]
    while waiting:
        left = [k for k in waiting if not _shrink(sizes, k, changes, terms)]
        if len(left) == len(waiting):
            return
        waiting = left
        # What is known of some coordinates says how large the others are in a constraint that has no other terms.
        known = np.where(np.isin(np.arange(len(q)), waiting), 0.0, 1.0)
        reach = change(known)
        terms = np.where(terms > 0.0, terms, np.where(np.isfinite(reach), reach, 0.0))


def _shrink(
    sizes: np.ndarray, k: int, changes: Callable[[np.ndarray], np.ndarray], terms: np.ndarray
) -> bool:
    """Make a size such that it changes a constraint by no more than its terms; False where no constraint says so."""
    steps = np.zeros((AT_ONCE, len(sizes)))
    steps[0, k] = sizes[k]
    first = changes(steps[:1])[0]
    says = (first > 0.0) & (terms > 0.0)
    if not says.any():
        return False
    if (first[says] <= FAR * terms[says]).any():
        return True
    while sizes[k] > SMALLEST:
        steps[:, k] = sizes[k] * _DIVIDED  # powers of two: as exact as one after another
        enough = (changes(steps)[:, says] <= terms[says]).any(axis=1) | ~(steps[:, k] > SMALLEST)
        if enough.any():
            sizes[k] = steps[np.argmax(enough), k]
            return True
        sizes[k] = steps[-1, k] / DIVIDED_BY
    return True


def _goes_on(constraints: PositionConstraints, q: np.ndarray, at: np.ndarray, step: np.ndarray) -> bool:
    """Whether all constraints go on changing along a step, as they do with lengths: angles of many turns return."""
    whole, *parts = np.abs(constraints.residuals(q + np.outer(LONG_AND_PARTS, step)) - at)
    return bool((np.maximum(*parts) <= STRAIGHT * whole).all())


def _terms(constraints: PositionConstraints, q: np.ndarray, at: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the size of the terms of each constraint: by what relative changes of all numbers in it change it."""
    of_p = constraints.position(q, constraints.p * (1.0 + SMALL_CHANGE * odd(len(constraints.p))))
    of_q = constraints.position(q + SMALL_CHANGE * odd(len(q)) * np.clip(q, -sizes, sizes))
    change = np.fmax(np.abs(of_p - at), np.abs(of_q - at)) / SMALL_CHANGE
    return np.fmax(np.where(np.isfinite(change), change, 0.0), np.abs(at))


def odd(n: int) -> np.ndarray:
    """Return numbers between -1 and 1 that are in no simple ratio to each other."""
    return np.cos(1.0 + np.arange(n) ** 1.5)


NEAR = 1e-2  # of the characteristic sizes: where else G is looked at, since an entry may vanish at one place
ROUND_OFF = 1e-13  # of a constraint's value: a change that is none
DIGITS = 0.03  # of what all of a coordinate's value changes: what round-off of it leaves is then no error
SLOWEST = 1e-6  # characteristic sizes per second below which rates are not told from rest


class Constraints:
    """Constraint functions as NumPy arrays.

    Parameters
    ----------
    system : System
        With constraints.
    p : ndarray
        Parameters, then inputs.
    t : float [s]
    """

    def __init__(self, system: System, p: np.ndarray, t: float):
        self._system, self.p, self.t = system, p, t
        self.positions = Positions(system)
        self.names = [record["name"] for record in system.constraints]

    def _call(self, name: str, q: np.ndarray, v: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        return self._system.kernel(name)(self.t, np.concatenate([q, v]), self.p if p is None else p)

    def position(self, q: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """Return Φ(q, t), shape (nh,), with other parameters if any are given."""
        return self._call("constraint_residual", q, np.zeros(self._system.nv), p)[: self._system.nh]

    def residuals(self, places: np.ndarray) -> np.ndarray:
        """Return Φ at several places, shape (k, nh), to the same bits."""
        system, k = self._system, len(places)
        states = np.zeros((k, system.nq + system.nv))
        states[:, : system.nq] = places
        kernel = system.kernel("constraint_residual")
        return kernel.rows(np.full(k, self.t), states, np.ascontiguousarray(self.p, dtype=float))[
            :, : system.nh
        ]

    def velocity(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the velocity residual of all constraints, shape (m,)."""
        return self._call("constraint_residual", q, v)[self._system.nh :]

    def accelerations_asked_for(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return γ of G a = γ, shape (m,)."""
        return self._call("gamma", q, v)

    def jacobian(self, q: np.ndarray, v: np.ndarray | None = None) -> np.ndarray:
        """Return G, shape (m, nv)."""
        v = np.zeros(self._system.nv) if v is None else v
        return self._call("constraint_jacobian", q, v).reshape(self._system.m, self._system.nv)

    def sparse_jacobian(self, q: np.ndarray) -> csc_array:
        """Return G of a large model, whose structural zeros take no room."""
        return self._sparse("constraint_jacobian", q, np.zeros(self._system.nv))

    def sparse_mass(self, q: np.ndarray) -> csc_array:
        """Return M of a large model, whose structural zeros take no room."""
        return self._sparse("mass_matrix", q, np.zeros(self._system.nv))

    def _sparse(self, name: str, q: np.ndarray, v: np.ndarray) -> csc_array:
        from scipy.sparse import csc_array  # heavy, and for large models only

        rows, columns = np.divmod(self._system.entry_places(name), self._system.nv)
        shape = (self._system.m if name == "constraint_jacobian" else self._system.nv, self._system.nv)
        return csc_array((self._call(f"{name}{ENTRIES}", q, v), (rows, columns)), shape=shape)

    def largest_in_rows(self, q: np.ndarray, v: np.ndarray, factors: np.ndarray) -> np.ndarray:
        """Return the largest |G_ij factors_j| of each row of G, shape (m,)."""
        values = self._call(kernel_of_jacobian(self._system), q, v)
        return largest_in_rows(self._system, values[None], factors[None])[0]

    def are_finite(self, q: np.ndarray, v: np.ndarray, name: str) -> bool:
        """Whether all entries of the matrix that the function `name` writes are finite."""
        return bool(np.isfinite(self._call(name + ENTRIES if is_large(self._system) else name, q, v)).all())

    def position_jacobian(self, q: np.ndarray) -> np.ndarray:
        """Return the derivative of Φ by what rates move, shape (nh, nv): the first rows of G."""
        return self.jacobian(q)[: self._system.nh]

    def mass(self, q: np.ndarray) -> np.ndarray:
        """Return M, shape (nv, nv)."""
        nv = self._system.nv
        return self._call("mass_matrix", q, np.zeros(nv)).reshape(nv, nv)

    def pivot_ratio(self, q: np.ndarray, v: np.ndarray) -> float:
        """Return how independent the constraints are: the smallest pivot relative to that without the others."""
        return float(self._call("rhs", q, v)[-1])

    def characteristic_sizes(self, q: np.ndarray) -> np.ndarray:
        """Return what counts as large for what each rate moves, shape (nv,); see `sizes.coordinate_sizes`."""
        return self.positions.per_rate(coordinate_sizes(self._system, self, q, self.p), 1.0)

    def position_scales(self, q: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Return by how much each position constraint changes over the characteristic sizes, shape (nh,).

        One that does not change, but for round-off, is held against its own value.
        """
        system, n = self._system, sizes.size
        states = np.zeros((3, system.nq + n))
        states[0, : system.nq] = q
        for row, step in zip(states[1:], NEAR * sizes * random_steps(n)):
            row[: system.nq] = self.positions.retract(q, step)
        kernel = system.kernel(kernel_of_jacobian(system))
        entries = kernel.rows(np.full(3, self.t), states, self.p)
        change = largest_in_rows(system, entries, sizes[None])[:, : system.nh]
        scales = np.fmax.reduce(np.where(np.isfinite(change), change, 0.0))
        at = self.positions.per_rate(q, 0.0)
        scales = np.fmax(scales, DIGITS * largest_in_rows(system, entries[:1], at[None])[0, : system.nh])
        values = np.abs(self.position(q))
        scales = np.where(scales > ROUND_OFF * values, scales, values)
        return np.where(scales > 0.0, scales, 1.0)

    def velocity_scales(self, q: np.ndarray, v: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Return the largest term of each velocity residual, shape (m,), or that of a very slow motion."""
        terms = self.largest_in_rows(q, v, v), np.abs(self.velocity(q, np.zeros_like(v)))
        slow = self.largest_in_rows(q, v, sizes) * SLOWEST
        scales = np.maximum(np.maximum(*terms), slow)
        return np.where(scales > 0.0, scales, 1.0)


@functools.lru_cache(maxsize=16)
def random_steps(n: int) -> np.ndarray:
    """Return two times n numbers between -1 and 1, the same each time."""
    return np.random.default_rng(20240229).uniform(-1.0, 1.0, (2, n))


def kernel_of_jacobian(system: System) -> str:
    """Return the function that writes G, or of large models the entries of it that are not zero everywhere."""
    return f"constraint_jacobian{ENTRIES}" if is_large(system) else "constraint_jacobian"


def largest_in_rows(system: System, values: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """Return the largest |G_ij factors_j| of each row of G at several states, shape (n, m).

    Parameters
    ----------
    values : ndarray, shape (n, m * nv) or (n, number of entries)
        What `kernel_of_jacobian` writes.
    factors : ndarray, shape (n, nv) or (1, nv)
    """
    n = len(values)
    if not is_large(system):
        return np.abs(values.reshape(n, system.m, system.nv) * factors[:, None]).max(axis=2, initial=0.0)
    largest = np.zeros((n, system.m))
    rows, columns = np.divmod(system.entry_places("constraint_jacobian"), system.nv)
    np.maximum.at(largest, (slice(None), rows), np.abs(values * factors[:, columns]))
    return largest
