"""Many starts assembled at once, to the bits of `assembly.assemble`, where nothing stands in its way.

Most starts that parameters and enforced values leave to be assembled have nothing to choose: as many coordinates are
free as constraints hold, Newton's method with whole steps comes to where they hold, and rates follow from linear
equations. Here is done for all rows of an array what `assembly.py` then does for one, by the same operations in the
same order. A row in which something else happens (a step that has to be damped, values that do not fit, sizes that
change, ways to go on the constraints) is left to `assembly.py`, which also says what is wrong. What that looks for
behind it, constraints without gradient and dependent ones, is not looked for here: whoever takes these starts does
(`prepared/start_look.py`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints import levels, nearest_point
from symgen.runtime.constraints.nearest_point import RANK_TOLERANCE, ROUND_OFF, SOLVED, pseudo_solve
from symgen.runtime.record import record
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System

SATISFIED = 2e-14  # of a constraint's scale: `assembly._SATISFIED`
_SAME_SIZE = 0.1  # `assembly._MUCH_SMALLER`
_REFINEMENTS = 3  # `assembly._REFINEMENTS`
_MOST_STEPS = 30  # of Newton's method; who takes more is left out


@record(eq=False)
class Given:
    """What starts are before constraints are looked at.

    Attributes
    ----------
    p : ndarray, shape (n, n_p)
    states : ndarray, shape (n, nq + nv)
    q_enforced, v_enforced : ndarray of bool, shape (nq,) and (nv,)
        Of all of them.
    """

    p: np.ndarray
    states: np.ndarray
    q_enforced: np.ndarray
    v_enforced: np.ndarray


def objection(system: System, q_enforced: np.ndarray) -> str:
    """Return why starts of a model are not assembled here; an empty string where they are."""
    if is_large(system) or system.start is not None:
        return "its start is found in another way"
    if system.quaternions or system.nq != system.nv:
        return "it has quaternions"
    if np.count_nonzero(~q_enforced) > system.nh:
        return "constraints leave some of its coordinates free"
    return ""


def assemble_plain(system: System, given: Given, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Return consistent starts, shape (n, nq + nv), and which rows have one; others are as they were.

    Parameters
    ----------
    system : System
        One without `objection`.
    given : Given
    t : float [s]
    """
    found, done = given.states.copy(), np.zeros(len(given.states), dtype=bool)
    starts = _Starts(system, given, t)
    with np.errstate(all="ignore"):
        try:
            starts.assemble()
        except np.linalg.LinAlgError:  # of some row: which, the other way tells
            return found, done
    found[starts.rows], done[starts.rows] = np.hstack([starts.q, starts.v]), True
    return found, done


class _Starts:
    """Some rows while they are assembled; those that are left to others fall out.

    Attributes
    ----------
    rows : ndarray of int
        Those that are left.
    p, q, v, sizes : ndarray
        Theirs.
    """

    def __init__(self, system: System, given: Given, t: float):
        self._system, self._t = system, t
        self._free_q, self._free_v = ~given.q_enforced, ~given.v_enforced
        self.rows, self.p = np.arange(len(given.p)), given.p
        self.q, self.v = given.states[:, : system.nq].copy(), given.states[:, system.nq :].copy()
        self.sizes = np.zeros_like(self.q)

    def assemble(self) -> None:
        """Bring the rows onto the constraints."""
        self._keep(self._are_finite())
        self.sizes = self._characteristic_sizes()
        self._keep(np.isfinite(self.sizes).all(axis=1))
        self._solve_positions()
        self._keep((self._characteristic_sizes() >= _SAME_SIZE * self.sizes).all(axis=1))
        self._solve_velocities()

    def _keep(self, which: np.ndarray) -> None:
        if not which.all():
            self.rows, self.p, self.q = self.rows[which], self.p[which], self.q[which]
            self.v, self.sizes = self.v[which], self.sizes[which]

    def _evaluate(
        self, name: str, q: np.ndarray, v: np.ndarray | None, of: np.ndarray | None = None
    ) -> np.ndarray:
        """Return rows of a function, `of` some of the rows or all of them."""
        kernel = self._system.kernel(name)
        states = np.hstack([q, np.zeros_like(q) if v is None else v])
        return kernel.rows(np.full(len(q), self._t), states, self.p if of is None else self.p[of])

    def _positions(self, q: np.ndarray, of: np.ndarray | None = None) -> np.ndarray:
        return self._evaluate("constraint_residual", q, None, of)[:, : self._system.nh]

    def _velocities(self, v: np.ndarray) -> np.ndarray:
        return self._evaluate("constraint_residual", self.q, v)[:, self._system.nh :]

    def _jacobians(self, q: np.ndarray, v: np.ndarray | None, of: np.ndarray | None = None) -> np.ndarray:
        values = self._evaluate("constraint_jacobian", q, v, of)
        return values.reshape(len(q), self._system.m, self._system.nv)

    def _are_finite(self) -> np.ndarray:
        parts = (
            self._positions(self.q),
            self._velocities(self.v),
            self._evaluate("constraint_jacobian", self.q, self.v),
            self._evaluate("mass_matrix", self.q, None),
        )
        return np.all([np.isfinite(part).all(axis=1) for part in parts], axis=0)

    def _characteristic_sizes(self) -> np.ndarray:
        """As `levels.coordinate_sizes`; those of coordinates without units are found row by row."""
        units = levels.units_of(self._system)
        if not len(units.bare):
            return units.sizes(self.q, self.p)
        places = (levels.Constraints(self._system, p, self._t) for p in self.p)
        found = [place.characteristic_sizes(q) for place, q in zip(places, self.q)]
        return np.array(found).reshape(self.q.shape)

    def _position_scales(self) -> np.ndarray:
        """As `Constraints.position_scales`."""
        nh, scales = self._system.nh, np.zeros((len(self.q), self._system.nh))
        steps = (0.0, *(levels.NEAR * self.sizes * step for step in levels.random_steps(self._system.nv)))
        for k, step in enumerate(steps):
            entries = self._jacobians(self.q + step, None)[:, :nh]
            change = np.abs(entries * self.sizes[:, None]).max(axis=2, initial=0.0)
            scales = np.fmax(scales, np.where(np.isfinite(change), change, 0.0))
            if k == 0:
                of_digits = np.abs(entries * self.q[:, None]).max(axis=2, initial=0.0)
        scales = np.fmax(scales, levels.DIGITS * of_digits)
        values = np.abs(self._positions(self.q))
        scales = np.where(scales > levels.ROUND_OFF * values, scales, values)
        return np.where(scales > 0.0, scales, 1.0)

    def _solve_positions(self) -> None:
        """Do what `assembly._Assembler._positions` does where whole steps lead to the one solution."""
        scales, free = self._position_scales(), self._free_q
        r = self._positions(self.q) / scales
        active = np.flatnonzero(_worst(r) > SATISFIED)
        if not len(active):
            return
        is_left = np.zeros(len(self.q), dtype=bool)  # to others
        if not free.any():
            is_left[active] = True
            self._keep(~is_left)
            return
        of_free = np.ix_(range(len(active)), free, free)
        factors = np.zeros((len(self.q), np.count_nonzero(free), np.count_nonzero(free)))
        factors[active] = _metrics(self._masses(active)[of_free])
        moved = active
        for _ in range(_MOST_STEPS):
            active = active[_worst(r[active]) > ROUND_OFF]
            if not len(active):
                break
            trial = self.q[active]
            step, regular = self._newton_step(active, scales[active], factors[active], r[active])
            trial[:, free] += step
            r_trial = self._positions(trial, active) / scales[active]
            # What is slow is no step of Newton's method that has come near.
            falls = regular & (_norms(r_trial) < nearest_point.SLOW * _norms(r[active]))
            is_left[active[~falls]] = True
            active, trial, r_trial = active[falls], trial[falls], r_trial[falls]
            self.q[active], r[active] = trial, r_trial
        is_left[active] = True
        is_left[moved] |= ~self._are_alone(moved, scales[moved], factors[moved])
        self._keep(~is_left)

    def _masses(self, of: np.ndarray) -> np.ndarray:
        nv = self._system.nv
        return self._evaluate("mass_matrix", self.q[of], None, of).reshape(-1, nv, nv)

    def _reduced(self, of: np.ndarray, scales: np.ndarray, factors: np.ndarray) -> np.ndarray:
        """The derivatives of position residuals by free coordinates in the metric: `Problem.reduced_jacobian`."""
        jacobians = self._jacobians(self.q[of], None, of)[:, : self._system.nh][:, :, self._free_q]
        scaled = jacobians / scales[:, :, None]
        return np.linalg.solve(factors, scaled.transpose(0, 2, 1)).transpose(0, 2, 1)

    def _newton_step(
        self, of: np.ndarray, scales: np.ndarray, factors: np.ndarray, r: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return steps without damping, and in which rows these are those of regular equations."""
        reduced = self._reduced(of, scales, factors)
        regular = np.isfinite(reduced).all(axis=(1, 2))
        reduced[~regular] = 0.0
        left, values, right = np.linalg.svd(reduced, full_matrices=False)
        regular &= (values > RANK_TOLERANCE * values[:, :1]).all(axis=1)
        # Rows and columns lie in memory as they do for one start: so sums have the same order.
        turned = np.ascontiguousarray(left.transpose(0, 2, 1)) @ r[:, :, None]
        gains = values / (values**2 + (0.0 * values[:, :1]) ** 2)
        u = (-right).transpose(0, 2, 1) @ (gains[:, :, None] * turned)
        step = np.linalg.solve(factors.transpose(0, 2, 1), u)[:, :, 0]
        longest = _worst(step / self.sizes[of][:, self._free_q])
        shorter = np.minimum(1.0, nearest_point.LONGEST_STEP / np.where(longest > 0.0, longest, 1.0))
        return np.where(longest[:, None] > 0.0, step * shorter[:, None], step), regular

    def _are_alone(self, of: np.ndarray, scales: np.ndarray, factors: np.ndarray) -> np.ndarray:
        """Whether constraints leave the free coordinates nowhere to go: none of the solutions near is nearer."""
        reduced = self._reduced(of, scales, factors)
        finite = np.isfinite(reduced).all(axis=(1, 2))
        reduced[~finite] = 0.0
        values = np.linalg.svd(reduced, compute_uv=False)
        return finite & (values > RANK_TOLERANCE * values[:, :1]).all(axis=1)

    def _velocity_scales(self, v: np.ndarray) -> np.ndarray:
        """As `Constraints.velocity_scales`."""
        jacobians = self._jacobians(self.q, v)
        terms = np.abs(jacobians * v[:, None]).max(axis=2, initial=0.0)
        driven = np.abs(self._velocities(np.zeros_like(v)))
        slow = np.abs(jacobians * self.sizes[:, None]).max(axis=2, initial=0.0) * levels.SLOWEST
        scales = np.maximum(np.maximum(terms, driven), slow)
        return np.where(scales > 0.0, scales, 1.0)

    def _solve_velocities(self) -> None:
        """Do what `assembly._Assembler._velocities` does where constraints are linear in the rates."""
        if not len(self.rows):
            return
        scales, free, v = self._velocity_scales(self.v), self._free_v, self.v.copy()
        r = self._velocities(v) / scales
        moves = _worst(r) > SATISFIED
        of = np.flatnonzero(moves)
        if len(of) and free.any():
            matrices = self._jacobians(self.q, self.v)[of] / scales[of][:, :, None]
            factors = _metrics(self._masses(of)[np.ix_(range(len(of)), free, free)])
            reduced = np.linalg.solve(factors, matrices[:, :, free].transpose(0, 2, 1)).transpose(0, 2, 1)
            for _ in range(_REFINEMENTS):
                solved = np.array([pseudo_solve(one, right) for one, right in zip(reduced, r[of])])
                v[np.ix_(of, free)] -= np.linalg.solve(factors.transpose(0, 2, 1), solved[:, :, None])[
                    :, :, 0
                ]
                r = self._velocities(v) / scales
        fits = _worst(r) <= SOLVED
        later = np.fmax(scales, self._velocity_scales(v))
        fits &= ~moves | (_worst(self._velocities(v) / later) <= SOLVED)
        self.v = v
        self._keep(fits)


def _worst(rows: np.ndarray) -> np.ndarray:
    """Return `nearest_point.worst` of each row."""
    largest = np.abs(rows).max(axis=1, initial=0.0)
    return np.where(np.isfinite(largest), largest, np.inf)


def _norms(rows: np.ndarray) -> np.ndarray:
    return np.sqrt(rows[:, None] @ rows[:, :, None])[:, 0, 0]


def _metrics(masses: np.ndarray) -> np.ndarray:
    """Return `nearest_point.metric` of each matrix."""
    factors = np.tile(np.eye(masses.shape[1]), (len(masses), 1, 1))
    diagonals = np.diagonal(masses, axis1=1, axis2=2)
    massless = ~masses.any(axis=1) & ~masses.any(axis=2)
    some = massless.any(axis=1) & ~massless.all(axis=1)
    added = np.where(some[:, None] & massless, nearest_point.MASSLESS * diagonals.max(axis=1)[:, None], 0.0)
    masses = masses + added[:, :, None] * np.eye(masses.shape[1])
    diagonals = np.diagonal(masses, axis1=1, axis2=2)
    regular = np.flatnonzero(np.isfinite(masses).all(axis=(1, 2)) & (diagonals.min(axis=1) > 0.0))
    roots = np.sqrt(diagonals[regular])
    values = np.linalg.eigvalsh(masses[regular] / (roots[:, :, None] * roots[:, None]))
    regular = regular[values[:, 0] > nearest_point.SINGULAR * values[:, -1]]
    factors[regular] = np.linalg.cholesky(masses[regular])
    return factors
