"""What a model says of its start besides constraints: equations, parameters that are sought, rest, closed stops.

All of it, and the constraints, are equations r(x, v, a, λ, p) = 0 in what may move: coordinates and rates that are
guesses, parameters that are sought, and where forces are balanced accelerations and multipliers. Positions are looked
for first, then rates at these positions, as in an assembly; where neither suffices, everything at once. A start that is
found meets the constraints, so that assembly leaves it as it is.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.abi import start_sizes
from symgen.runtime.constraints.contradictions import AssemblyError, joined, listed
from symgen.runtime.constraints.levels import SLOWEST, Constraints
from symgen.runtime.constraints.nearest_point import (
    SOLVED,
    Problem,
    metric,
    null_space,
    solve_with_restarts,
    worst,
)
from symgen.runtime.constraints.start_values import StartValues, changes, start_values
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.names import rate_labels
from symgen.runtime.positions import Chart
from symgen.runtime.remembered import remembered
from symgen.runtime.size import LARGEST_DENSE, is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System

_RATES = 1  # what an equation is about, as the header says it: 0 positions, 1 rates, too, 2 forces
_PASSES = 4  # of a solution by scales that follow it
_REACH = 10.0  # of a parameter's guess: how far a step may go
_TAKES_PART = 1e-3  # of the largest residual: a condition that is named
_UNDETERMINED = 1e-6  # of a direction that changes nothing: a parameter in it is not determined
_FOLLOWS = 1e-3  # of its part in the conditions: what an acceleration or force weighs
_NO_SIZE = 1e-300
_SPREAD = 0.1  # of what is near: places at which all is told that has to do with each other
_SLOW = 1e-2  # of the fastest: rates and accelerations whose last digits are those of the others


class Met(NamedTuple):
    """A start that meets the conditions.

    Attributes
    ----------
    p : ndarray, shape (n_p,)
        With the parameters that were sought.
    values : StartValues
    moved : list of (str, float, float)
        Coordinates and rates, before and after.
    found : list of str
        What was found of parameters, in words.
    """

    p: np.ndarray
    values: StartValues
    moved: list[tuple[str, float, float]]
    found: list[str]


@np.errstate(all="ignore")  # what leaves the range is seen as not finite, and said
def with_found(
    system: System,
    p: np.ndarray,
    given: Collection[str],
    start: Mapping[str, float | str] | None = None,
    rate: Mapping[str, float | str] | None = None,
    t: float = 0.0,
) -> tuple[np.ndarray, list[str]]:
    """Return the parameters with those that the model's start determines, and notes that say so.

    Parameters
    ----------
    system : System
    p : ndarray, shape (n_p,)
        Parameters, then inputs.
    given : collection of str
        Parameters that are given: they are not sought.
    start, rate : mapping, optional
        Starts that are given.
    t : float [s]

    Raises
    ------
    AssemblyError
        There is no such start, or it leaves a parameter open.
    """
    if system.start is None:
        return p, []
    sought = tuple(k for k in system.start["find"] if system.parameters[k]["name"] not in given)
    if not sought:
        return p, []
    met = meet(system, p, start_values(system, p, start, rate), t, sought)
    return met.p, met.found


def meet(system: System, p: np.ndarray, given: StartValues, t: float, sought: tuple[int, ...] = ()) -> Met:
    """Return a start that meets the conditions of a model that has such.

    Parameters
    ----------
    system : System
    p : ndarray, shape (n_p,)
    given : StartValues
        What is enforced stays.
    t : float [s]
    sought : tuple of int
        Places of parameters that are to be found.
    """
    p = np.ascontiguousarray(p, dtype=float)

    def key(p: np.ndarray, sought: tuple[int, ...]) -> tuple:
        values = (values.tobytes() for values in given[:4])
        return "start", float(t), p.tobytes(), sought, *values, *given.notes

    if is_large(system):
        raise RuntimeModelError(
            f"model {system.name!r} has {system.nv + system.m} rates and constraints, and [start] is solved with full "
            f"matrices of up to {LARGEST_DENSE} rows: leave [start] out, or choose a smaller model"
        )
    met = remembered(system, key(p, sought), lambda: _Start(system, p, given, float(t), sought).met())
    if not sought:
        return met
    # The start is that of a run with these parameters given. While they are sought, places are left where they come
    # nearest to the conditions from anywhere, those too that have no part in these.
    own = remembered(system, key(met.p, ()), lambda: _Start(system, met.p, given, float(t), ()).met())
    return met._replace(values=own.values, moved=own.moved)


def _connected(links: np.ndarray) -> Iterator[np.ndarray]:
    """Yield which places belong together, by a symmetric matrix of those that are linked."""
    left = np.ones(len(links), dtype=bool)
    while left.any():
        part = np.zeros(len(links), dtype=bool)
        part[np.argmax(left)] = True
        added = part
        while added.any():
            added = links[added].any(axis=0) & ~part
            part = part | added
        left &= ~part
        yield part


class _Start:
    """The start of one model while it is sought; unknowns z are (x of a chart, v, a, λ and forces, parameters)."""

    def __init__(self, system: System, p: np.ndarray, given: StartValues, t: float, sought: tuple[int, ...]):
        self.system, self.p, self.given, self.t, self.sought = system, p, given, t, sought
        self.header = system.start
        constraints = Constraints(system, p, t)
        self.positions = constraints.positions
        self.sizes = constraints.characteristic_sizes(given.q)
        mass = constraints.mass(given.q)
        self.mass = mass if np.isfinite(mass).all() else np.eye(system.nv)
        self.chart = Chart(self.positions, given.q)
        nv, n_forces = system.nv, system.m + len(system.switches)
        self.parts = np.cumsum([0, nv, nv, nv, n_forces, len(sought)])
        self.rows = self._rows()
        self.moving = np.concatenate([self.rows["motion"], self.rows["held"]])
        self.n_moving = system.nq + 2 * nv + system.m
        self.z = np.concatenate([self.chart.start, given.v, np.zeros(nv + n_forces), p[list(sought)]])
        self._spread = np.zeros(len(self.z))
        self._spread[self._part(1)] = np.maximum(self.sizes, np.abs(given.v))
        self._forget_rates_at_rest()

    def _part(self, k: int) -> slice:
        return slice(self.parts[k], self.parts[k + 1])

    def _rows(self) -> dict[str, np.ndarray]:
        sizes = start_sizes(self.system.source.header)
        ends = np.cumsum([0, *sizes.values()])
        return {kind: np.arange(a, b) for kind, a, b in zip(sizes, ends, ends[1:])}

    def _steady(self) -> np.ndarray:
        """Which rates do not change."""
        steady = self.header["steady"]
        if steady is True:
            return ~self.given.v_enforced
        found = np.zeros(self.system.nv, dtype=bool)
        found[steady] = True
        return found

    def _forget_rates_at_rest(self) -> None:
        """Guesses of rates that are at rest are zero; states keep theirs."""
        resting = self._steady() & ~self.given.v_enforced
        resting[list(self.system.states)] = False
        self.z[self._part(1)][resting] = 0.0
        self.resting = resting

    # Conditions and their derivatives.

    def _y(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        p = self.p.copy()
        p[list(self.sought)] = z[self._part(4)]
        x, v, a, forces = (z[self._part(k)] for k in range(4))
        return np.concatenate([self.chart.q(x), v, a, forces]), p

    def conditions(self, z: np.ndarray) -> np.ndarray:
        """Return all conditions."""
        y, p = self._y(z)
        found = np.array(self.system.kernel("start_conditions")(self.t, y, p))
        if self.header["balance"]:
            found[self.moving] += self.system.kernel("residual")(self.t, y[: self.n_moving], p)
        return found

    def derivatives(self, z: np.ndarray) -> np.ndarray:
        """Return their derivatives by z."""
        y, p = self._y(z)
        nq, n_y = self.system.nq, len(y)
        full = np.array(self.system.kernel("start_jacobian")(self.t, y, p))
        full = full.reshape(-1, n_y + len(self.header["find"]))
        if self.header["balance"]:
            rows = self.system.kernel("residual_jacobian")(self.t, y[: self.n_moving], p)
            full[self.moving, : self.n_moving] += rows.reshape(-1, self.n_moving)
        by_rates = full[:, :nq] @ self._kinematics(y[:nq])
        by_chart = self.chart.by_unknowns(z[self._part(0)], by_rates)
        columns = [n_y + self.header["find"].index(k) for k in self.sought]
        return np.hstack([by_chart, full[:, nq:n_y], full[:, columns]])

    def _kinematics(self, q: np.ndarray) -> np.ndarray:
        s = self.system
        if not s.quaternions:
            return np.eye(s.nv)
        y = np.concatenate([q, np.zeros(s.nv)])
        return s.kernel("kinematics")(self.t, y, self.p)[: s.nq * s.nv].reshape(s.nq, s.nv)

    def _scales(self, z: np.ndarray, slowest: float = _SLOW) -> np.ndarray:
        """Return the sizes of the conditions' terms; rates count as no slower than a part of the fastest."""
        reach = np.abs(z)
        reach[self._part(0)] = np.maximum(self.sizes, reach[self._part(0)])
        for part, least in ((self._part(1), SLOWEST), (self._part(2), 0.0)):
            fastest = max(least, slowest * worst(reach[part] / self.sizes))
            reach[part] = np.maximum(reach[part], fastest * self.sizes)
        by_z = np.abs(self.derivatives(z))
        self._reach_of_forces(by_z, reach)
        scales = by_z @ reach
        speed = by_z[:, self._part(1)] @ self.sizes  # at rest nothing tells how fast is fast
        scales = np.where(scales > 0.0, scales, np.maximum(speed, np.abs(self.conditions(z))))
        return np.where(scales > _NO_SIZE, scales, 1.0)

    def _reach_of_forces(self, by_z: np.ndarray, reach: np.ndarray) -> None:
        """Let accelerations and forces that may vanish count as what balances the other terms of their equations."""
        if not self.moving.size:
            return
        followers = slice(self.parts[2], self.parts[4])
        rows = by_z[self.rows["motion"]]
        terms = rows @ reach
        with np.errstate(divide="ignore", invalid="ignore"):
            balancing = np.where(rows[:, followers] > 0.0, terms[:, None] / rows[:, followers], np.inf)
        least = balancing.min(axis=0, initial=np.inf)
        reach[followers] = np.maximum(reach[followers], np.where(np.isfinite(least), least, 0.0))

    # Solving.

    def met(self) -> Met:
        """Return the start."""
        self._check_finite()
        x, v, a, forces, parameters = self._free()
        everything = np.arange(sum(len(part) for part in self.rows.values()))
        for rows, columns in self._blocks(everything):
            self._meet(rows, *(part & columns for part in (x, v, a, forces, parameters)))
        if not self._holds(everything):
            raise self._contradiction(x | v | parameters)
        self._check_parameters(x | v | a | forces | parameters)
        return self._result()

    def _free(self) -> tuple[np.ndarray, ...]:
        """What may move of displacements, rates, accelerations, forces and parameters."""
        x, v, a, forces, parameters = (self._mask(k) for k in range(5))
        x[self._part(0)] = ~self.positions.held(self.given.q_enforced)
        v[self._part(1)] = ~self.given.v_enforced & ~self.resting
        a[self._part(2)] = ~self._steady()
        if not self.header["balance"]:
            a[:] = forces[:] = False
        forces &= self._acting()
        return x, v, a, forces, parameters

    def _blocks(self, everything: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return conditions that have to do with each other, and what is in them.

        What moves for one part of a model leaves those where they are that have nothing to do with it.
        """
        random = np.random.default_rng(20240229)
        reach = np.where(self.z != 0.0, np.abs(self.z), 1.0)
        reach[self._part(0)] = self.sizes
        some = [
            self.z,
            *(self.z + _SPREAD * reach * random.uniform(-1.0, 1.0, len(self.z)) for _ in range(2)),
        ]
        pattern = sum(np.abs(self.derivatives(z)) for z in some)
        mass = sum(np.abs(self._mass_at(z)) for z in some)
        if not (np.isfinite(pattern).all() and np.isfinite(mass).all()):
            return [(everything, np.ones(len(self.z), dtype=bool))]
        n, n_rows = len(self.z), len(everything)
        links = np.zeros((n + n_rows, n + n_rows), dtype=bool)
        links[n:, :n] = pattern != 0.0
        for k in (0, 1):  # a mass that one moves is one by which distances count
            links[self._part(k), self._part(k)] = mass != 0.0
            links[self._part(k), self._part(0)] |= np.eye(self.system.nv, dtype=bool)
        parts = [(part[n:], part[:n]) for part in _connected(links | links.T)]
        return [(everything[rows], columns) for rows, columns in parts if rows.any()]

    def _mass_at(self, z: np.ndarray) -> np.ndarray:
        """Return the mass matrix."""
        y, p = self._y(z)
        return Constraints(self.system, p, self.t).mass(self.positions.normalised(y[: self.system.nq]))

    def _meet(
        self,
        everything: np.ndarray,
        x: np.ndarray,
        v: np.ndarray,
        a: np.ndarray,
        forces: np.ndarray,
        parameters: np.ndarray,
    ) -> None:
        """Move what is free of a block until its conditions hold, as far as they can."""
        rows = self.rows
        levels = np.array(self.header["levels"], dtype=int)
        of_positions = np.concatenate([rows["position"], rows["equation"][levels < _RATES], rows["gap"]])
        of_rates = np.concatenate([rows["velocity"], rows["equation"][levels == _RATES], rows["closing"]])
        of_positions, of_rates = (
            np.intersect1d(of_positions, everything),
            np.intersect1d(of_rates, everything),
        )
        others = np.setdiff1d(everything, of_positions)
        if not self._solve(of_positions, x):
            self._solve(of_positions, x | parameters)
        rates = v | a | forces | parameters
        # Rates move for what is about rates; accelerations and forces follow, and are no reason to move any.
        guesses = self.z
        met = self._solve(of_rates, v)
        met = met and any(self._solve(others, free) for free in (a | forces, a | forces | parameters))
        if not met:
            self.z = guesses
            met = self._solve(others, rates)
        if not (met and self._holds(of_positions)):
            self._solve(everything, x | rates)

    def _mask(self, part: int) -> np.ndarray:
        found = np.zeros(self.parts[-1], dtype=bool)
        found[self._part(part)] = part >= 3
        return found

    def _acting(self) -> np.ndarray:
        """Which forces act: those of constraints, and of stops that are closed."""
        acting = np.ones(self.parts[-1], dtype=bool)
        closed = [switch["name"] in self.header["closed"] for switch in self.system.switches]
        acting[self.parts[3] + self.system.m : self.parts[4]] = closed
        return acting

    def _solve(self, rows: np.ndarray, free: np.ndarray) -> bool:
        """Move what is free until some of the conditions hold; says whether they do.

        Where they do not, positions are left where they come nearest to it, and all else as it was.
        """
        if not rows.size or self._holds(rows):
            return True
        if not free.any():
            return False
        z = self.z.copy()
        for _ in range(_PASSES):
            problem = self._problem(z, rows, free, self._scales(z, 1.0)[rows])
            spread = np.where(np.isfinite(problem.sizes), problem.sizes, self._spread[free])
            z[free] = solve_with_restarts(problem, z[free], spread)
            if self._holds(rows, z):
                break
        solved = self._holds(rows, z)
        if solved:
            z = self._nearer(z, rows, free)
        if solved or free[self._part(0)].any():
            self.z = z
        return solved

    def _nearer(self, z: np.ndarray, rows: np.ndarray, free: np.ndarray) -> np.ndarray:
        """Return a solution nearer to the guesses: accelerations and forces begin where they are, and weigh nothing."""
        followers = slice(self.parts[2], self.parts[4])
        if not (free[followers].any() and free[: self.parts[2]].any()):
            return z
        for _ in range(_PASSES):
            nearer = self.z.copy()
            nearer[followers] = z[followers]
            problem = self._problem(z, rows, free, self._scales(z, 1.0)[rows])
            nearer[free] = solve_with_restarts(problem, nearer[free])
            if not self._holds(rows, nearer):
                break
            z, last = nearer, z
            if np.array_equal(z, last):
                break
        return z

    def _holds(self, rows: np.ndarray, z: np.ndarray | None = None) -> bool:
        """Whether some of the conditions hold to round-off, at the start as it is or at another one."""
        z = self.z if z is None else z
        with np.errstate(invalid="ignore", over="ignore"):
            off = self.conditions(z)[rows] / self._scales(z)[rows]
        return worst(off) <= SOLVED

    def _problem(self, z: np.ndarray, rows: np.ndarray, free: np.ndarray, scales: np.ndarray) -> Problem:
        def at(u: np.ndarray) -> np.ndarray:
            full = z.copy()
            full[free] = u
            return full

        def residual(u: np.ndarray) -> np.ndarray:
            return self.conditions(at(u))[rows] / scales

        def jacobian(u: np.ndarray) -> np.ndarray:
            return self.derivatives(at(u))[np.ix_(rows, free)] / scales[:, None]

        factor, sizes = self._metric(z, free, jacobian(z[free]))
        return Problem(residual, jacobian, factor, sizes)

    def _metric(self, z: np.ndarray, free: np.ndarray, jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the factor of the metric, and the sizes of what is free: displacements count by the mass they move.

        Forces and accelerations have no size: what they are follows, and next to nothing is given up for small ones.
        """
        places = np.flatnonzero(free)
        part = np.searchsorted(self.parts, places, side="right") - 1
        largest = np.abs(jacobian).max(axis=0, initial=0.0)
        diagonal = np.where(largest > 0.0, largest, 1.0)
        diagonal[(part == 2) | (part == 3)] *= _FOLLOWS
        sizes = np.full(len(places), np.inf)
        of_displacements, of_parameters = part == 0, part == 4
        sizes[of_displacements] = self.sizes[places[of_displacements]]
        guesses = np.abs(self.p[list(self.sought)])[places[of_parameters] - self.parts[4]]
        sizes[of_parameters] = _REACH * np.where(guesses > 0.0, guesses, 1.0)
        factor = np.diag(diagonal)
        # Rates count at the positions that are found, as in an assembly.
        for k, mass in ((0, self.mass), (1, self._mass_at(z))):
            own, moved = np.flatnonzero(part == k), places[part == k] - self.parts[k]
            if own.size:
                block = metric(mass[np.ix_(moved, moved)])
                size = np.linalg.norm(block.T @ self.sizes[moved])
                factor[np.ix_(own, own)] = block / size
        return factor, sizes

    # What is said.

    def _check_finite(self) -> None:
        values, slopes = self.conditions(self.z), self.derivatives(self.z)
        bad = np.flatnonzero(~(np.isfinite(values) & np.isfinite(slopes).all(axis=1)))
        if bad.size:
            names = [record["name"] for record in self.system.coordinates]
            raise AssemblyError(
                f"{self._name(int(bad[0]))} is not finite at {listed(names, self.given.q)}: give other guesses"
            )

    def _name(self, row: int) -> str:
        """A condition in words."""
        s = self.system
        kind, own = next((kind, rows) for kind, rows in self.rows.items() if row in rows)
        k = row - int(own[0])
        if kind == "equation":
            return f"the equation {self.header['equations'][k]!r} of [start]"
        if kind in ("gap", "closing", "opening"):
            return f"the stop {self.header['closed'][k]!r}, which is closed in [start],"
        if kind == "motion":
            return f"the balance of {rate_labels(s.coordinates, s.rates)[k]!r}"
        return f"the constraint {s.constraints[k]['name']!r}"

    def _contradiction(self, free: np.ndarray) -> AssemblyError:
        off = self.conditions(self.z) / self._scales(self.z)
        wrong = np.flatnonzero(np.abs(off) > _TAKES_PART * worst(off))
        named = joined(list(dict.fromkeys(self._name(int(k)) for k in wrong)))
        labels = self._labels()
        movable = [labels[k] for k in np.flatnonzero(free) if labels[k]]
        what = f"by {joined(movable)}" if movable else "where nothing is a guess"
        held = [s for k, s in enumerate(labels) if s and not free[k]]
        given = f"; {joined(held)} {'are' if len(held) > 1 else 'is'} given" if held and movable else ""
        return AssemblyError(
            f"[start] cannot be met {what}{given}: {named} {'are' if len(wrong) > 1 else 'is'} off by up to "
            f"{worst(off):.2g} of its terms; give fewer equations or starts, or guesses nearer to a solution"
        )

    def _labels(self) -> list[str]:
        """Names of what may move; empty for what follows."""
        s = self.system
        labels = [""] * self.parts[-1]
        motions = [record["name"] for record in s.coordinates]
        for k, place in enumerate(self.positions.per_rate(np.arange(float(s.nq)), -1.0)):
            labels[k] = motions[int(place)] if place >= 0 and int(place) not in s.integrals else ""
        for place, k in self.positions.quaternions:  # its three turns move all of it
            labels[k] = f"{motions[place]}, …, {motions[place + 3]}"
        resting = self.resting
        for k, name in enumerate(rate_labels(s.coordinates, s.rates)):
            labels[self.parts[1] + k] = "" if resting[k] else name
        for k, place in enumerate(self.sought):
            labels[self.parts[4] + k] = s.parameters[place]["name"]
        return labels

    def _check_parameters(self, free: np.ndarray) -> None:
        """Refuse parameters that the conditions leave open."""
        if not self.sought:
            return
        scales = self._scales(self.z)
        slopes = self.derivatives(self.z)[:, free] / scales[:, None]
        largest = np.abs(slopes).max(axis=0, initial=0.0)
        moves_nothing = largest == 0.0
        _, basis = null_space(slopes / np.where(moves_nothing, 1.0, largest))
        places = np.flatnonzero(free)
        for k, place in enumerate(self.sought):
            row = int(np.flatnonzero(places == self.parts[4] + k)[0])
            if np.linalg.norm(basis[row]) > _UNDETERMINED:
                labels = self._labels()
                others = [labels[j] for j in places if labels[j]]
                name = self.system.parameters[place]["name"]
                raise AssemblyError(
                    f"[start] does not determine the parameter {name!r}, which it is to find: there are too few "
                    f"conditions for {joined(others)}; add an equation, or give a start in the place of a guess"
                )

    def _result(self) -> Met:
        s, given = self.system, self.given
        y, p = self._y(self.z)
        q = self.positions.normalised(y[: s.nq])
        v = self.z[self._part(1)].copy()
        values = StartValues(q, v, given.q_enforced, given.v_enforced, given.notes)
        moved = changes(
            [record["name"] for record in s.coordinates],
            given.q,
            q,
            self.positions.per_coordinate(self.sizes),
        )
        moved += changes(
            rate_labels(s.coordinates, s.rates), given.v, v, np.maximum(np.abs(given.v), np.abs(v))
        )
        found = []
        for k in self.sought:
            record = s.parameters[k]
            unit = f" {record['unit']}" if record["unit"] else ""
            found.append(f"start: found {record['name']} = {p[k]:.9g}{unit} (guess {self.p[k]:.9g})")
        return Met(p, values, moved, found)
