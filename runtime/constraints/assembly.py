"""Consistent initial conditions: enforced values stay, guesses move as little as possible.

Constraints whose gradient is zero wherever they hold: they can be met, but not kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints import contradictions
from symgen.runtime.constraints.contradictions import AssemblyError, joined, listed
from symgen.runtime.constraints.dependence import Redundancy, ranks_near
from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.constraints.nearest_point import (
    RANK_TOLERANCE,
    SOLVED,
    Problem,
    least_repair,
    metric,
    position_problem,
    pseudo_solve,
    solve,
    solve_with_restarts,
    worst,
)
from symgen.runtime.constraints.start_values import Assembly, StartValues, changes, start_values
from symgen.runtime.lazy import Late
from symgen.runtime.names import rate_labels
from symgen.runtime.positions import Chart
from symgen.runtime.remembered import remembered
from symgen.runtime.size import LARGEST_DENSE, is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System

# Most models say nothing of their start.
conditions = Late("symgen.runtime.constraints.start_conditions")


# Where the rows of G depend on each other, G v = 0 leaves out what those rows ask for in the next order: G a = γ(q, v)
# has a solution only if uᵀ γ(q, v) = 0 for every u with uᵀ G = 0. The rates of each branch obey that, and rates between
# branches do not.

# Of the speed: a start that is typed in is singular to some digits only.
_ALONG_IT, _NOT_BETWEEN = 1e-6, 1e-3
_DIFFERENCE = 1e-4  # of the speed; γ is of second order in the rates, so that central differences are exact


def branch_rates(
    constraints: Constraints, q: np.ndarray, v: np.ndarray, enforced: np.ndarray, sizes: np.ndarray
) -> np.ndarray | None:
    """Return the rates nearest to `v` that lead on from a singular configuration; None where there are none.

    Parameters
    ----------
    constraints : Constraints
    q : ndarray, shape (nq,)
        The configuration, on the constraints.
    v : ndarray, shape (nv,)
        Rates that meet the constraints on the velocity level.
    enforced : ndarray of bool, shape (nv,)
        Rates that stay.
    sizes : ndarray, shape (nv,)
        Characteristic sizes of what the rates move.
    """
    speed, free = worst(v / sizes), ~enforced
    if speed == 0.0:
        return v
    scales = constraints.velocity_scales(q, v, sizes)
    left, values, _ = np.linalg.svd(constraints.jacobian(q, v) * sizes / scales[:, None] * speed)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0])) if values.size else 0
    dependent = left[:, rank:].T

    def residual(z: np.ndarray) -> np.ndarray:
        rates = v.copy()
        rates[free] = z
        second = dependent @ (constraints.accelerations_asked_for(q, rates) / scales) / speed
        return np.concatenate([constraints.velocity(q, rates) / scales, second])

    def jacobian(z: np.ndarray) -> np.ndarray:
        steps = np.diag(_DIFFERENCE * speed * sizes[free])
        columns = [(residual(z + step) - residual(z - step)) / (2.0 * step.max()) for step in steps]
        return np.array(columns).reshape(len(z), -1).T

    if worst(residual(v[free])) <= _ALONG_IT:
        return v
    if not free.any():
        return None
    mass = constraints.mass(q)[np.ix_(free, free)]
    found = v.copy()
    found[free] = solve_with_restarts(Problem(residual, jacobian, metric(mass), speed * sizes[free]), v[free])
    return found if worst(residual(found[free])) <= _NOT_BETWEEN else None


# Models of up to `LARGEST_DENSE` unknowns are assembled by full matrices and singular values (`assembly.py`), which
# also find nearest points, and name constraints that depend on others. Beyond, that would take minutes.

_INDEPENDENT = 1e-6  # smallest pivot relative to its value before other constraints were eliminated
_REPAIRED = 1e-6  # of a constraint's scale: what enforced values may be off
_MAX_STEPS = 50
_FRACTIONS = (1.0, 0.5, 0.25, 0.05)  # of a Newton step


def sparse_start(
    system: System, constraints: Constraints, given: StartValues
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and rates that satisfy the constraints, and note in `given` what was done to enforced values.

    Enforced values stay. Each Newton step moves the others by the least, measured by the mass matrix at the guesses.

    Raises
    ------
    AssemblyError
        Newton's method finds no such start, or constraints depend on each other there.
    """
    start = _Start(system, constraints, given)
    q = start.positions()
    v = start.rates(q, given.v)
    ratio = constraints.pivot_ratio(q, v)
    if not ratio >= _INDEPENDENT:
        raise AssemblyError(
            f"constraints depend on each other at the start: a pivot is {ratio:.2g} of what it is without the others; "
            f"which of them do is found in models of up to {LARGEST_DENSE} rates and constraints only: look for one "
            "that repeats others in a smaller version of the model, and leave it out, or start in another configuration"
        )
    return q, v


class _Start:
    """The start of one model while it is sought."""

    def __init__(self, system: System, constraints: Constraints, given: StartValues):
        self._system, self._constraints, self._given = system, constraints, given
        mass = constraints.sparse_mass(given.q)
        self._mass = mass if mass.diagonal().min() > 0.0 else None
        self._sizes = constraints.characteristic_sizes(given.q)
        self._coordinates = [record["name"] for record in system.coordinates]

    def positions(self) -> np.ndarray:
        """Return coordinates on the position constraints."""
        constraints, given = self._constraints, self._given
        scales = constraints.position_scales(given.q, self._sizes)

        def residual(q: np.ndarray) -> np.ndarray:
            return constraints.position(q) / scales

        def solve(enforced: np.ndarray) -> np.ndarray:
            return self._newton(given.q, constraints.positions.retract, residual, scales, enforced)

        enforced = constraints.positions.held(given.q_enforced)
        q = solve(enforced)
        return self._accepted(q, residual, lambda: solve(np.zeros_like(enforced)), q, "value")

    def rates(self, q: np.ndarray, v0: np.ndarray) -> np.ndarray:
        """Return rates on the velocity level at positions `q`."""
        constraints = self._constraints
        scales = constraints.velocity_scales(q, v0, self._sizes)

        def residual(v: np.ndarray) -> np.ndarray:
            return constraints.velocity(q, v) / scales

        def solve(enforced: np.ndarray) -> np.ndarray:
            return self._newton(v0, np.add, residual, scales, enforced, at=q)

        enforced = self._given.v_enforced
        return self._accepted(solve(enforced), residual, lambda: solve(np.zeros_like(enforced)), q, "rate")

    def _accepted(
        self,
        found: np.ndarray,
        residual: Callable[[np.ndarray], np.ndarray],
        repair: Callable[[], np.ndarray],
        q: np.ndarray,
        what: str,
    ) -> np.ndarray:
        """Return what was found, or with all values free where enforced ones fit nearly."""
        off = residual(found)
        if worst(off) <= SOLVED:
            return found
        if worst(off) <= _REPAIRED:
            found = repair()
            if worst(residual(found)) <= SOLVED:
                self._given.notes.append(
                    f"enforced {what}s fitted the constraints nearly, not to the last digit, and were repaired"
                )
                return found
        name = self._constraints.names[int(np.argmax(np.nan_to_num(np.abs(off), nan=np.inf)))]
        raise AssemblyError(
            f"no start was found on the constraints: {name!r} is the worst, off by {worst(off):.2g} of its scale, at "
            f"{listed(self._coordinates, q)}; give guesses nearer to a solution, or enforce fewer {what}s"
        )

    def _newton(self, x, move, residual, scales, enforced, at=None) -> np.ndarray:
        """Newton's method on a residual; steps are halved until it falls."""
        free = np.flatnonzero(~enforced)
        r = residual(x)
        for _ in range(_MAX_STEPS):
            if worst(r) <= _SATISFIED or not free.size:
                break
            q = x if at is None else at
            step = self._step(q, r * scales, free)
            if step is None:
                break
            for fraction in _FRACTIONS:
                trial = move(x, fraction * step)
                r_trial = residual(trial)
                if np.linalg.norm(r_trial) < np.linalg.norm(r):
                    break
            else:
                break
            x, r = trial, r_trial
        return x

    def _step(self, q: np.ndarray, right: np.ndarray, free: np.ndarray) -> np.ndarray | None:
        """The least step that zeroes the linearised residual, by the free rates; None where there is none."""
        from scipy.sparse import block_array, eye_array
        from scipy.sparse.linalg import splu

        jacobian = self._constraints.sparse_jacobian(q)[: len(right)][:, free]
        metric = eye_array(len(free)) if self._mass is None else self._mass[free][:, free]
        matrix = block_array([[metric, jacobian.T], [jacobian, None]], format="csc")
        try:
            solution = splu(matrix).solve(np.concatenate([np.zeros(len(free)), -right]))
        except RuntimeError:  # exactly singular
            return None
        step = np.zeros(self._system.nv)
        step[free] = solution[: len(free)]
        return step if np.isfinite(step).all() else None


_SPREADS = (0.05, 0.01, 0.2)  # of the characteristic sizes, for each neighbour in turn
_SMALL_HERE = 1e-3  # of the gradient's size beside the constraint: worth a closer look
# A point that is singular by itself has neighbours on the constraint with gradients like those beside it.
_SMALL_ON_IT = 1e-2


def without_gradient(
    problem: Problem, q: np.ndarray, scaled_gradients: Callable[[np.ndarray], np.ndarray]
) -> list[int]:
    """Return the position constraints whose gradient vanishes at `q` and at all projected random neighbours.

    Such a constraint has no force that could keep it: (x - 1)² + y² = 0 fixes a point as x = 1 and y = 0 do, but all
    its derivatives by the coordinates are zero there. The seed is fixed.

    Parameters
    ----------
    problem : Problem
        The position constraints over all coordinates, by which neighbours are projected.
    q : ndarray
        An assembled configuration.
    scaled_gradients : callable
        q -> rows of G of the position constraints, scaled alike at every place, shape (nh, nv).
    """
    here = _sizes(scaled_gradients(q))
    random = np.random.default_rng(20240229)
    shift = problem.sizes * random.uniform(-1.0, 1.0, q.size)
    beside = _sizes(scaled_gradients(q + _SPREADS[0] * shift))
    suspects = here <= _SMALL_HERE * beside
    suspects &= beside > 0.0
    if not suspects.any():
        return []
    n_projected = 0
    for spread in _SPREADS:
        start = q + spread * shift
        neighbour = solve(problem, start)
        if worst(problem.residual(neighbour)) > SOLVED:
            continue
        n_projected += 1
        suspects &= _sizes(scaled_gradients(neighbour)) <= _SMALL_ON_IT * _sizes(scaled_gradients(start))
        shift = problem.sizes * random.uniform(-1.0, 1.0, q.size)
    return [int(i) for i in np.flatnonzero(suspects)] if n_projected else []


def _sizes(rows: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore"):
        return np.nan_to_num(np.linalg.norm(rows, axis=1), nan=0.0, posinf=0.0)


_CONTRADICTION = 1e-6  # of a constraint's scale: what enforced values may be off
_SATISFIED = 2e-14  # of its scale: nothing to do
_TAKES_PART = 1e-3  # of the largest residual: a constraint that is named
_MAX_REPAIRS = 20
_MOST_SCALES, _MUCH_SMALLER = 3, 0.1
_NOTHING_LEFT = 1e-13  # of the sizes at the guesses: round-off
_REFINEMENTS = 3


@np.errstate(all="ignore")  # what leaves the range is seen as not finite, and said
def assemble(
    system: System,
    p: np.ndarray,
    start: Mapping[str, float] | None = None,
    rate: Mapping[str, float] | None = None,
    t: float = 0.0,
) -> Assembly:
    """Return initial conditions that satisfy the constraints, positions and velocities, and what the model says of its
    start, to round-off.

    Enforced values stay. Guesses move as little as possible, measured by the mass matrix at the guesses
    (coordinates without mass first; plainly where it is singular otherwise), and not at all when they
    already fit. Rates follow, at the
    assembled positions. Quaternions are made unit ones first; one of which a component is given or enforced is
    enforced as a whole.

    Parameters
    ----------
    system : System
    p : ndarray
        Parameters, then inputs.
    start, rate : mapping of str to float, optional
        Values of coordinates and rates, in SI; they are enforced.
    t : float [s]

    Raises
    ------
    AssemblyError
        Enforced values contradict constraints by more than 1e-6 of their scale, constraints contradict each other,
        the gradient of one is zero wherever it holds, or a quaternion is zero.
    UnknownNameError
        A name in `start` or `rate` is not a coordinate's.
    """
    given, met = start_values(system, p, start, rate), []
    if system.start is not None:
        _, given, met, _ = conditions.meet(system, p, given, t)
    if not system.m:
        return Assembly(given.q, given.v, list(met), given.notes)
    p, t = np.ascontiguousarray(p, dtype=float), float(t)
    found = remembered(
        system,
        ("assembly", t, p.tobytes(), *(values.tobytes() for values in given[:4]), *given.notes),
        lambda: _Assembler(system, p, t, given.notes).run(*given[:4]),
    )
    # What is kept is nobody's to change.
    lists = (list(values) for values in ([*met, *found.moved], found.notes, found.redundant))
    return Assembly(found.q.copy(), found.v.copy(), *lists, found.rank)


def is_consistent(system: System, p: np.ndarray, t: float, state: np.ndarray) -> bool:
    """Whether a state, shape (nq + nv,), meets the constraints so well that `assemble` would leave it as it is."""
    q, v = state[: system.nq], state[system.nq :]
    constraints = Constraints(system, np.ascontiguousarray(p, dtype=float), float(t))
    sizes = constraints.characteristic_sizes(q)
    off = (
        worst(constraints.position(q) / constraints.position_scales(q, sizes)),
        worst(constraints.velocity(q, v) / constraints.velocity_scales(q, v, sizes)),
    )
    return max(off) <= _SATISFIED


class _Assembler:
    """One assembly: the model's constraints at fixed parameters and time, and what has been noted so far."""

    def __init__(self, system: System, p: np.ndarray, t: float, notes: list[str]):
        self.system = system
        self.constraints = Constraints(system, p, t)
        self.coordinates = [record["name"] for record in system.coordinates]
        self.rates = rate_labels(system.coordinates, system.rates)
        self.notes = notes

    def run(self, q0: np.ndarray, v0: np.ndarray, q_enforced: np.ndarray, v_enforced: np.ndarray) -> Assembly:
        constraints, positions = self.constraints, self.constraints.positions
        self._check_finite(q0, v0)
        sizes = constraints.characteristic_sizes(q0)
        if is_large(self.system):
            q, v = sparse_start(
                self.system, constraints, StartValues(q0, v0, q_enforced, v_enforced, self.notes)
            )
            return Assembly(q, v, self._moved(q0, q, v0, v, sizes), self.notes, [], self.system.m)
        q, held = q0, positions.held(q_enforced)
        for left in reversed(range(_MOST_SCALES)):
            scales = constraints.position_scales(q, sizes)
            self.chart = Chart(positions, q)
            failure = None
            try:
                x = self._positions(held, sizes, scales)
            except AssemblyError as error:
                x, failure = self.reached, error
            q = self.chart.q(x)
            found = constraints.characteristic_sizes(q)
            if not failure and (found < _NOTHING_LEFT * sizes).any():
                x = self._at_zero(x, found < _NOTHING_LEFT * sizes, scales)
                q = self.chart.q(x)
                break
            if failure and not (left and (found < _MUCH_SMALLER * sizes).any()):
                raise failure
            if (found >= _MUCH_SMALLER * sizes).all():
                break
            sizes = found  # the guess was far from the size of the model
        v = self._velocities(q, v0, v_enforced, sizes)
        everything = self._problem(x, np.ones(len(x), dtype=bool), sizes, scales)
        idle = without_gradient(
            everything,
            x,
            lambda place: constraints.jacobian(self.chart.q(place), v)[: self.system.nh] * sizes,
        )
        if idle:
            raise contradictions.gradient_vanishes(self._named(idle), listed(self.coordinates, q))
        ranks = ranks_near(everything, self.constraints, self.chart, x, v, sizes)
        if ranks.rank_here < ranks.rank:
            v = self._along_a_branch(q, v, v_enforced, sizes)
        moved = self._moved(q0, q, v0, v, sizes)
        return Assembly(q, v, moved, self.notes, self._note_ranks(ranks), ranks.rank)

    def _at_zero(self, x: np.ndarray, round_off: np.ndarray, scales: np.ndarray) -> np.ndarray:
        """Return a position with zeros for the unknowns that are `round_off`, where the constraints hold there, too.

        Where all values of a unit are zero but for round-off, they do not tell the size of the model, for which they
        would be taken by whoever asks for sizes at the start: rates, projection, checks.
        """
        zeros = np.where(round_off, 0.0, x)
        return zeros if worst(self._residual(zeros) / scales) <= SOLVED else x

    def _moved(
        self, q0: np.ndarray, q: np.ndarray, v0: np.ndarray, v: np.ndarray, sizes: np.ndarray
    ) -> list[tuple[str, float, float]]:
        per_coordinate = self.constraints.positions.per_coordinate(sizes)
        moved = changes(self.coordinates, q0, q, per_coordinate)
        return moved + changes(self.rates, v0, v, np.maximum(np.abs(v0), np.abs(v)))

    def _check_finite(self, q: np.ndarray, v: np.ndarray) -> None:
        constraints, names = self.constraints, self.constraints.names
        residual = np.concatenate([constraints.position(q), constraints.velocity(q, v)])
        bad = np.flatnonzero(~np.isfinite(residual))
        if bad.size:
            name = [*names[: self.system.nh], *names][bad[0]]
            place = listed(self.coordinates, q)
            raise contradictions.not_finite(f"constraint {name!r}", place, self.system.remark(name))
        if not constraints.are_finite(q, v, "constraint_jacobian"):
            raise contradictions.not_finite("the constraints' Jacobian", listed(self.coordinates, q))
        if not constraints.are_finite(q, np.zeros_like(v), "mass_matrix"):
            raise contradictions.not_finite("the mass matrix", listed(self.coordinates, q))

    def _residual(self, x: np.ndarray) -> np.ndarray:
        return self.constraints.position(self.chart.q(x))

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self.chart.by_unknowns(x, self.constraints.position_jacobian(self.chart.q(x)))

    def _problem(self, x: np.ndarray, free: np.ndarray, sizes: np.ndarray, scales: np.ndarray) -> Problem:
        return position_problem(self.constraints, self.chart, x, free, sizes, scales)

    def _positions(self, enforced: np.ndarray, sizes: np.ndarray, scales: np.ndarray) -> np.ndarray:
        """Return the position, as unknowns of the chart."""
        x0 = self.chart.start
        if worst(self._residual(x0) / scales) <= _SATISFIED:
            return x0
        free = ~enforced
        x = x0.copy()
        if free.any():
            x[free] = solve_with_restarts(self._problem(x0, free, sizes, scales), x0[free])
        self.reached = x
        off = worst(self._residual(x) / scales)
        if off <= SOLVED:
            return x
        if off > _CONTRADICTION:
            raise self._contradiction(x, enforced, sizes, scales)
        repaired = self._repair(x, enforced, sizes, scales)
        if worst(self._residual(repaired) / scales) > SOLVED:
            raise self._contradiction(x, enforced, sizes, scales)
        per_coordinate = self.constraints.positions.per_coordinate
        repairs = changes(self.coordinates, self.chart.q(x0), self.chart.q(repaired), per_coordinate(sizes))
        self._note_repair(repairs, np.array(self.coordinates)[per_coordinate(enforced)])
        return repaired

    def _repair(
        self, x: np.ndarray, enforced: np.ndarray, sizes: np.ndarray, scales: np.ndarray
    ) -> np.ndarray:
        """Move enforced values by the least that lets the constraints hold; the others follow."""
        for _ in range(_MAX_REPAIRS):
            residual = self._residual(x) / scales
            if worst(residual) <= _SATISFIED:
                break
            jacobian = self._jacobian(x) / scales[:, None]
            x = x + least_repair(jacobian * sizes, residual, enforced) * sizes
        return x

    def _contradiction(
        self, x: np.ndarray, enforced: np.ndarray, sizes: np.ndarray, scales: np.ndarray
    ) -> AssemblyError:
        """Return what is wrong: constraints that nothing satisfies, or enforced values."""
        everywhere = self._problem(x, np.ones(len(x), dtype=bool), sizes, scales)
        nearest_x = solve_with_restarts(everywhere, x)
        left, solution = self._residual(nearest_x) / scales, self.chart.q(nearest_x)
        if worst(left) > SOLVED:
            wrong = np.flatnonzero(np.abs(left) > _TAKES_PART * worst(left))
            return contradictions.with_each_other(
                self._named(wrong), (left * scales)[wrong], self.coordinates, solution
            )
        residual = self._residual(x)
        wrong = np.flatnonzero(np.abs(residual / scales) > _TAKES_PART * worst(residual / scales))
        shown = enforced & (np.abs(self._jacobian(x)[wrong]).sum(axis=0) > 0)
        shown = self.constraints.positions.per_coordinate(shown if shown.any() else enforced)
        names = list(np.array(self.coordinates)[shown])
        given, fitting = listed(names, self.chart.q(self.chart.start)[shown]), listed(names, solution[shown])
        return contradictions.with_enforced_values(
            self._named(wrong), residual[wrong], given, fitting, "value"
        )

    def _velocities(
        self, q: np.ndarray, v0: np.ndarray, enforced: np.ndarray, sizes: np.ndarray
    ) -> np.ndarray:
        """Solve the velocity level in the metric of the free rates; of most models it is linear in them."""
        scales = self.constraints.velocity_scales(q, v0, sizes)
        matrix = self.constraints.jacobian(q, v0) / scales[:, None]

        def residual(v: np.ndarray) -> np.ndarray:
            return self.constraints.velocity(q, v) / scales

        if worst(residual(v0)) <= _SATISFIED:
            return v0
        free, v = ~enforced, v0.copy()
        if free.any():
            factor = metric(self.constraints.mass(q)[np.ix_(free, free)])
            reduced = np.linalg.solve(factor, matrix[:, free].T).T
            for _ in range(_REFINEMENTS):
                v[free] -= np.linalg.solve(factor.T, pseudo_solve(reduced, residual(v)))
            if not worst(residual(v)) <= SOLVED and self._is_curved(q, v0, v):
                v = self._rates_on_curves(q, v0, free, sizes, factor, scales)
        # What is prescribed over time may have set in motion what was at rest, by which residuals are judged.
        scales = np.fmax(scales, self.constraints.velocity_scales(q, v, sizes))
        matrix = self.constraints.jacobian(q, v0) / scales[:, None]
        off = worst(residual(v))
        if off > SOLVED:
            repaired = v.copy()
            for _ in range(_REFINEMENTS):
                repaired += least_repair(matrix * sizes, residual(repaired), enforced) * sizes
            if off > _CONTRADICTION or worst(residual(repaired)) > SOLVED:
                raise self._contradiction_of_rates(q, (v0, v, repaired), enforced, residual, scales)
            self._note_repair(changes(self.rates, v0, repaired, np.abs(v0)), np.array(self.rates)[enforced])
            v = repaired
        return v

    def _is_curved(self, q: np.ndarray, v0: np.ndarray, v: np.ndarray) -> bool:
        """Whether a constraint is not linear in the rates."""
        return not np.array_equal(self.constraints.jacobian(q, v0), self.constraints.jacobian(q, v))

    def _rates_on_curves(
        self,
        q: np.ndarray,
        v0: np.ndarray,
        free: np.ndarray,
        sizes: np.ndarray,
        factor: np.ndarray,
        scales: np.ndarray,
    ) -> np.ndarray:
        """Return the rates nearest to a guess that meet constraints which are not linear in them."""

        def at(z: np.ndarray) -> np.ndarray:
            v = v0.copy()
            v[free] = z
            return v

        problem = Problem(
            residual=lambda z: self.constraints.velocity(q, at(z)) / scales,
            jacobian=lambda z: self.constraints.jacobian(q, at(z))[:, free] / scales[:, None],
            factor=factor,
            sizes=np.full(int(free.sum()), np.inf),
        )
        return at(solve_with_restarts(problem, v0[free], sizes[free]))

    def _along_a_branch(
        self, q: np.ndarray, v: np.ndarray, enforced: np.ndarray, sizes: np.ndarray
    ) -> np.ndarray:
        found = branch_rates(self.constraints, q, v, enforced, sizes)
        if found is None:
            rates = listed([self.rates[i] for i in np.flatnonzero(enforced)], v[enforced])
            raise AssemblyError(
                f"no motion leads on from the start at {listed(self.coordinates, q)} with the rates {rates}: branches "
                "of the motion meet there, and these rates are of none of them; give fewer, the others follow"
            )
        return found

    def _contradiction_of_rates(self, q, rates, enforced, residual, scales) -> AssemblyError:
        v0, v, repaired = rates
        left = residual(repaired)
        place = listed(self.coordinates, q)
        if worst(left) > max(SOLVED, _CONTRADICTION * worst(residual(v))):
            return contradictions.of_rates(
                self._named(np.flatnonzero(np.abs(left) > _TAKES_PART * worst(left))), place
            )
        off = residual(v)
        wrong = np.flatnonzero(np.abs(off) > _TAKES_PART * worst(off))
        touched = np.abs(self.constraints.jacobian(q, v)[wrong]).sum(axis=0) > 0
        shown = np.flatnonzero(enforced & touched)
        names = [self.rates[i] for i in shown]
        given, fitting = listed(names, v0[shown]), listed(names, repaired[shown])
        return contradictions.with_enforced_values(
            self._named(wrong), (off * scales)[wrong], given, fitting, "rate", f" at {place}"
        )

    def _named(self, indices: np.ndarray | list[int]) -> list[str]:
        return [self.constraints.names[i] for i in indices]

    def _note_repair(self, repairs: list[tuple[str, float, float]], enforced: np.ndarray) -> None:
        repaired = [f"{name} by {after - before:.2e}" for name, before, after in repairs if name in enforced]
        if repaired:
            self.notes.append(
                "enforced values fitted the constraints nearly, not to the last digit, and were repaired: "
                + joined(repaired)
            )

    def _note_ranks(self, ranks: Redundancy) -> list[str]:
        redundant, involved = self._named(ranks.redundant), self._named(ranks.involved)
        if redundant:
            others = [name for name in involved if name not in redundant]
            follows = f"follows from {joined(others)}" if others else "restricts nothing"
            self.notes.append(
                f"redundant: {joined(redundant)} ({follows}); their multipliers are not unique, "
                "the minimum-norm ones are given"
            )
        if ranks.rank_here < ranks.rank:
            self.notes.append(
                f"the start is a singular configuration: the constraints have rank {ranks.rank_here} there "
                f"and {ranks.rank} nearby; the motion may branch"
            )
        return redundant
