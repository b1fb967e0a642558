"""How fast a model moves at a state: eigenvalues of its linearised motion."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers
from symgen.runtime.lazy import Late
from symgen.runtime.positions import Positions
from symgen.runtime.record import record
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System

extreme_rates = Late("symgen.runtime.checks.extreme_rates")

_DIFFERENCE = 1e-6
# What is near zero does not say how far it moves: steps of a millionth of a unit may be a thousand times the motion's.
_FINER = 1e-3 ** np.arange(5)  # steps of differences, in parts of the first
_AGREE = 1e-3  # of the terms: differences with another step that are nearer are the same
_NOISE = 16.0 * np.finfo(float).eps  # of the accelerations, in their differences
_MANY_RATES = 8  # from which on eigenvalues take longer than a bound of them
_OVERDAMPED = 0.5  # an eigenvalue with -Re above this part of its magnitude decays more than it oscillates


@record
class TimeScales:
    """Rates of the linearised motion at one state [1/s].

    Attributes
    ----------
    fastest : float
        Largest magnitude of an eigenvalue.
    decay : float
        Fastest decay of a motion that decays more than it oscillates.
    motion : float
        Fastest of the other motions, and of the change of the state itself.
    damping : float
        Decay of the eigenvalue of largest magnitude.
    eigenvalues : ndarray of complex
        All of them, of large models the extreme ones; constraints add zeros.
    turning : float
        Fastest rate of an angle or of a body with a quaternion.
    """

    fastest: float
    decay: float
    motion: float
    damping: float
    eigenvalues: np.ndarray = field(
        default_factory=lambda: np.zeros(0, dtype=complex), repr=False, compare=False
    )
    turning: float = 0.0

    @property
    def fastest_period(self) -> float:
        """Period of the fastest motion [s]; infinite where nothing moves."""
        return 2.0 * np.pi / self.fastest if self.fastest > 0.0 else np.inf


@record(eq=False)
class _Places:
    """Where in q and v of a model things are that rates of change ask for.

    Attributes
    ----------
    positions : Positions
    lengths : list of list of int
        Coordinates that are lengths, of one subsystem each.
    angles : list of int
        Rates of angles.
    states : list of int
        First-order states, among the rates: values, and no speeds of anything.
    """

    positions: Positions
    lengths: list[list[int]]
    angles: list[int]
    states: list[int]


def _places_of(system: System) -> _Places:
    """Return the places of a model, which are looked for once."""
    found = vars(system).get("_places_of_rates")
    if found is None:
        positions = Positions(system)
        pairs = zip(positions.plain_q.tolist(), positions.plain_v.tolist())
        angles = [j for i, j in pairs if system.coordinates[i].get("unit") == "rad"]
        found = _Places(positions, _lengths(system), angles, list(system.states))
        vars(system)["_places_of_rates"] = found
    return found


def change_rate(system: System, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return how fast states change [1/s], shape (...): the fastest of their rates, in radians or sizes of coordinates.

    The size of a place is the largest of its coordinates: what passes zero of one of them is no faster there.

    Parameters
    ----------
    q, v : ndarray, shapes (..., nq) and (..., nv)
    """
    places = _places_of(system)
    sizes = np.maximum(1.0, np.abs(q))
    for together in places.lengths:
        sizes[..., together] = sizes[..., together].max(axis=-1, keepdims=True)
    if places.positions.quaternions:
        sizes = places.positions.per_rate(sizes, 1.0)
    speeds = np.abs(v) / sizes
    if places.states:
        speeds[..., places.states] = 0.0
    return speeds.max(axis=-1, initial=0.0)


def _lengths(system: System) -> list[list[int]]:
    """Return which coordinates are lengths of one subsystem."""
    kinds = [member for kind in system.subsystems for member in kind["coordinates"]]
    of_subsystems = [
        [i for i in members if system.coordinates[i].get("unit") == "m"]
        for members in kinds or [range(system.nq)]
    ]
    return [lengths for lengths in of_subsystems if len(lengths) > 1]


def time_scales(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> TimeScales:
    """Return the time scales at a state; the Jacobian is taken by central differences.

    Of large models only the extreme eigenvalues are looked for.
    """
    return time_scales_at(system, p, np.array([t]), q[None], v[None])[0]


def all_slower(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray, rate: float) -> bool:
    """Return whether all eigenvalues at a state are below a rate [1/s]: what `time_scales` says of the fastest.

    No eigenvalue is larger than that of the matrix of two rows which norms of the Jacobian's blocks make (Ostrowski
    1961). Of many rates, eigenvalues take longest, and are asked for only where that does not tell.
    """
    if is_large(system):
        return time_scales(system, p, t, q, v).fastest < rate
    jacobian = motion_jacobian(system, p, t, q, v)
    if system.nv >= _MANY_RATES and _bound(jacobian, system.nv) < rate:
        return True
    return float(np.abs(_eigenvalues(system, jacobian[None])).max(initial=0.0)) < rate


def _bound(jacobian: np.ndarray, nv: int) -> float:
    """Return the least of three bounds: sums of rows, of columns, and of squares, which are above spectral norms."""
    blocks = np.abs(jacobian.reshape(2, nv, 2, nv))
    of_rows, of_columns = blocks.sum(axis=3).max(axis=1), blocks.sum(axis=1).max(axis=2)
    squares = np.sqrt((blocks**2).sum(axis=(1, 3)))
    squares[0, 1] = 1.0  # of the identity, whose spectral norm that is
    return min(
        0.5 * (w + b) + float(np.sqrt(0.25 * (w - b) ** 2 + one * a))
        for (w, one), (a, b) in (of_rows, of_columns, squares)
    )


def time_scales_at(
    system: System, p: np.ndarray, t: np.ndarray, q: np.ndarray, v: np.ndarray
) -> list[TimeScales]:
    """Return the time scales at several states, which takes hardly longer than at one.

    Parameters
    ----------
    p : ndarray
        Parameters, then inputs: of all states, or shape (n, n_p), of each. Then there are no constraints.
    t : ndarray, shape (n,) [s]
    q, v : ndarray, shapes (n, nq) and (n, nv)
    """
    if is_large(system):
        states = zip(np.broadcast_to(p, (len(t), p.shape[-1])), t, q, v)
        found = [extreme_rates.extreme_eigenvalues(system, *state)[None] for state in states]
        return [_scales_of(system, q[k : k + 1], v[k : k + 1], x)[0] for k, x in enumerate(found)]
    return _scales_of(system, q, v, _eigenvalues(system, motion_jacobians(system, p, t, q, v)))


def rates_at(system: System, p: np.ndarray, t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return `fastest`, `decay`, `motion` and `damping` at states of a model that is not large, shape (4, n)."""
    return np.array(_rates_of(system, q, v, _eigenvalues(system, motion_jacobians(system, p, t, q, v))))


def _scales_of(system: System, q: np.ndarray, v: np.ndarray, eigenvalues: np.ndarray) -> list[TimeScales]:
    """Return the time scales of states with these eigenvalues of their linearised motion, a row each."""
    columns = (*_rates_of(system, q, v, eigenvalues), _turning(system, v))
    return [
        TimeScales(*rates, eigenvalues=row, turning=turning)
        for *rates, turning, row in zip(*(x.tolist() for x in columns), eigenvalues)
    ]


def _rates_of(
    system: System, q: np.ndarray, v: np.ndarray, eigenvalues: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Return the first four attributes of `TimeScales`, shape (n,) each."""
    magnitudes, decays = np.abs(eigenvalues), -eigenvalues.real
    overdamped = decays > _OVERDAMPED * magnitudes
    motion = np.where(overdamped, 0.0, magnitudes).max(axis=1, initial=0.0)
    fastest = (np.arange(len(q)), magnitudes.argmax(axis=1)) if magnitudes.shape[1] else ()
    return (
        magnitudes.max(axis=1, initial=0.0),
        np.where(overdamped, decays, 0.0).max(axis=1, initial=0.0),
        # Swings and turns need steps even where the linearised motion is slow.
        np.maximum(motion, change_rate(system, q, v)),
        decays[fastest] if fastest else np.zeros(len(q)),
    )


def _turning(system: System, v: np.ndarray) -> np.ndarray:
    places = _places_of(system)
    fastest = np.abs(v[:, places.angles]).max(axis=1, initial=0.0)
    for _, j in places.positions.quaternions:
        fastest = np.maximum(fastest, np.linalg.norm(v[:, j : j + 3], axis=1))
    return fastest


def _eigenvalues(system: System, jacobians: np.ndarray) -> np.ndarray:
    """Return the eigenvalues of linearised motions, each subsystem's by themselves: cost is cubic in their size."""
    nv, n = system.nv, len(jacobians)
    if not system.subsystems:
        return np.linalg.eigvals(jacobians)
    kinds = [np.array(kind["rates"], dtype=int) for kind in system.subsystems]
    places = [np.hstack([rates, nv + rates]) for rates in kinds]
    blocks = [jacobians[:, rows[:, :, None], rows[:, None, :]] for rows in places]
    return np.hstack([np.linalg.eigvals(block).reshape(n, -1) for block in blocks])


def motion_jacobian(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the Jacobian of the motion of positions and rates at a state, shape (2 nv, 2 nv); see below."""
    return motion_jacobians(system, p, np.array([t]), q[None], v[None])[0]


def motion_jacobians(
    system: System, p: np.ndarray, t: np.ndarray, q: np.ndarray, v: np.ndarray
) -> np.ndarray:
    """Return the Jacobian of the motion of positions and rates at several states; zeros where it is not finite.

    Positions are what rates move: coordinates, and small rotations in body axes of quaternions. Those, turned
    along with the body, follow δ' = δω - ω × δ.

    Parameters
    ----------
    p : ndarray
        Parameters, then inputs: of all states, or shape (n, n_p), of each. Then there are no constraints.
    t : ndarray, shape (n,) [s]
    q, v : ndarray, shapes (n, nq) and (n, nv)

    Returns
    -------
    ndarray, shape (n, 2 nv, 2 nv)
    """
    positions, n, nv = _places_of(system).positions, len(t), system.nv
    sizes = positions.per_rate(np.maximum(1.0, np.abs(q)), 1.0), np.maximum(1.0, np.abs(v))
    steps = _DIFFERENCE * np.hstack(sizes)
    rows, agree = _differences(system, p, t, q, v, steps)
    if not agree.all():
        of_each = (x[~agree] for x in (t, q, v, steps))
        rows[~agree] = _best_differences(system, p if p.ndim == 1 else p[~agree], *of_each)
    jacobians = np.zeros((n, 2 * nv, 2 * nv))
    jacobians[:, :nv, nv:] = np.eye(nv)
    for _, j in positions.quaternions:
        for jacobian, (x, y, z) in zip(jacobians, v[:, j : j + 3]):
            jacobian[j : j + 3, j : j + 3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    jacobians[:, nv:] = rows.transpose(0, 2, 1)
    return np.where(np.isfinite(jacobians), jacobians, 0.0)


def _differences(
    system: System, p: np.ndarray, t: np.ndarray, q: np.ndarray, v: np.ndarray, steps: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return central differences of the accelerations by positions and rates, and where shorter ones agree with them.

    Parameters
    ----------
    steps : ndarray, shape (n, 2 nv)

    Returns
    -------
    rows : ndarray, shape (n, 2 nv, nv)
    agree : ndarray of bool, shape (n,)
        Whether a step a thousand times shorter, in one direction, says the same.
    """
    n, k = steps.shape
    nv = k // 2
    each = steps[:, :, None] * np.eye(k)
    together = _FINER[1] * steps * np.where(np.arange(k) % 3 == 1, -1.0, 1.0)
    changes = np.concatenate([each, together[:, None], -each, -together[:, None]], axis=1)
    states = np.empty((n, 2 * k + 2, system.nq + nv))
    states[:, :, : system.nq] = _places_of(system).positions.retractions(q, changes[:, :, :nv])
    states[:, :, system.nq :] = v[:, None] + changes[:, :, nv:]
    a, _ = accelerations_and_multipliers(
        system, p, np.repeat(t, 2 * k + 2), states.reshape(-1, system.nq + nv)
    )
    a = a.reshape(n, 2, k + 1, nv)
    with np.errstate(invalid="ignore", over="ignore"):
        changed = 0.5 * (a[:, 0] - a[:, 1])
        rows = changed[:, :k] / steps[:, :, None]
        terms = rows * together[:, :, None]
        off = np.abs(changed[:, k] - terms.sum(axis=1))
        allowed = _AGREE * np.abs(terms).sum(axis=1) + _NOISE * np.abs(a[:, 0, k])
        return rows, (off <= allowed).all(axis=1)


def _best_differences(
    system: System, p: np.ndarray, t: np.ndarray, q: np.ndarray, v: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Return differences of which each has the step that shorter ones and round-off change least."""
    found = np.array([_differences(system, p, t, q, v, part * steps)[0] for part in _FINER])
    a, _ = accelerations_and_multipliers(system, p, t, np.hstack([q, v]))
    with np.errstate(invalid="ignore"):
        rounding = _NOISE * np.abs(a)[:, None] / (steps[:, :, None] * _FINER[:-1, None, None, None])
        off = np.abs(np.diff(found, axis=0)) + rounding
    off[~np.isfinite(off)] = np.inf
    return np.take_along_axis(found, off.argmin(axis=0)[None], axis=0)[0]
