"""Consistent starts of many members.

Without constraints a start is what is given. With them it is assembled, which takes a millisecond a member; three
short ways give the same: what is on the constraints as given stays; where the enforced values leave nothing to choose,
Newton's method goes from the start of another member to that of this one, for all at once; what is left is assembled
one by one.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.constraints.contradictions import AssemblyError
from symgen.runtime.constraints.start_values import start_values
from symgen.runtime.ensemble.evaluate import evaluate_members
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.names import inside_dot
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.system import System

assembly = Late("symgen.runtime.constraints.assembly")
conditions = Late("symgen.runtime.constraints.start_conditions")
inertia = Late("symgen.runtime.checks.inertia")
levels = Late("symgen.runtime.constraints.levels")

_SATISFIED = 2e-14  # of a constraint's scale: as in `constraints/assembly.py`
_SOLVED = 1e-13
_NEWTON_STEPS = 12
_ROUND_OFF, _NONE, _LARGEST_WHOLE = 1e-10, 1e-14, 300  # as in `checks/inertia.py`
_NEAR = 0.3  # of the characteristic sizes: farther away there may be another way to assemble it


def not_numbers(system: System, parameters: np.ndarray) -> dict[int, str]:
    """Return of which members, by their row, a parameter or input is no finite number, and which."""
    names = [record["name"] for record in (*system.parameters, *system.inputs)]
    found: dict[int, str] = {}
    for k, j in zip(*np.nonzero(~np.isfinite(parameters[:, : len(names)])), strict=True):
        found.setdefault(int(k), f"{names[j]!r} is {parameters[k, j]}: give a finite number")
    return found


def no_models(system: System, parameters: np.ndarray) -> dict[int, str]:
    """Return which members, by their row, have parameters that the model does not allow, and why."""
    if system.values_of_runs is None:
        return system.beyond_limits(parameters)
    columns = {record["name"]: parameters[:, k] for k, record in enumerate(system.parameters)}
    return system.values_of_runs.of_members(
        {name: x if (x != x[0]).any() else x[0] for name, x in columns.items()}
    )


class Starts:
    """The starts of an ensemble's members.

    Attributes
    ----------
    of_one : dict of str to float
        Starts that vary, as one member has them that can begin.

    Parameters
    ----------
    system : System
    t : float [s]
    p : ndarray, shape (n_p,)
        The parameters that all members go from.
    start, rate : mapping of str to float or str
        Starts that all members have.
    varied : mapping of str to float
        Starts that vary, as one member has them; `dot(x)` for rates.
    given : collection of str
        Parameters that are given, so that no start looks for them.
    """

    def __init__(
        self,
        system: System,
        t: float,
        p: np.ndarray,
        start: Mapping[str, Any],
        rate: Mapping[str, Any],
        varied: Mapping[str, float],
        given: Collection[str] = (),
    ) -> None:
        self.system, self.t, self._start, self._rate = system, t, dict(start), dict(rate)
        self.of_one = dict(varied)
        own = self.given(varied)
        self.sought = _sought(system, given)
        p = self.with_found(p, varied)
        self._plain = start_values(system, p, *own)
        self._follow_p = bool(system.source.header.get("starts")) or system.start is not None
        self._places = self._places_of(varied)
        self.smallest_scale = 1.0  # of the constraints' positions
        if system.m:
            found = assembly.assemble(system, p, *own, t)
            self.redundant = found.redundant
            self._prepare_newton(p, found)
        else:
            self.redundant = []

    def given(self, varied: Mapping[str, float]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return starts and rates of a member, by the name of the coordinate."""
        rates = {inside_dot(name): float(x) for name, x in varied.items() if name.startswith("dot(")}
        starts = {name: float(x) for name, x in varied.items() if not name.startswith("dot(")}
        return self._start | starts, self._rate | rates

    def with_found(self, p: np.ndarray, varied: Mapping[str, float]) -> np.ndarray:
        """Return the parameters of a member with those that its start determines."""
        if not self.sought:
            return p
        others = {record["name"] for record in self.system.parameters} - self.sought
        return conditions.with_found(self.system, p, others, *self.given(varied), self.t)[0]

    def _places_of(self, varied: Mapping[str, float]) -> dict[str, int]:
        """Where in (q, v) what varies stands: where a value that is set shows up."""
        places = {}
        states = {self.system.rates[k]["name"]: k for k in self.system.states}
        for name in varied:
            if name in states:
                places[name] = self.system.nq + states[name]
                continue
            is_rate = name.startswith("dot(")
            records = self.system.rates if is_rate else self.system.coordinates
            one = start_values(
                self.system, np.array(self.system.parameter_values()), *self.given({name: 0.0})
            )
            enforced = one.v_enforced if is_rate else one.q_enforced
            other = start_values(
                self.system, np.array(self.system.parameter_values()), self._start, self._rate
            )
            before = other.v_enforced if is_rate else other.q_enforced
            changed = np.flatnonzero(enforced & ~before)
            index = next((k for k, r in enumerate(records) if r["name"] == inside_dot(name)), -1)
            index = int(changed[0]) if len(changed) == 1 else index
            places[name] = index + (self.system.nq if is_rate else 0)
        return places

    def of(
        self, parameters: np.ndarray, varied: Mapping[str, np.ndarray]
    ) -> tuple[np.ndarray, dict[int, str]]:
        """Return starts, shape (n, nq + nv), and why some members have none, by their row.

        Parameters
        ----------
        parameters : ndarray, shape (n, n_p)
            Those that starts look for are written into it.
        varied : mapping of str to ndarray, shape (n,)
        """
        system, n = self.system, len(parameters)
        states = np.tile(np.concatenate([self._plain.q, self._plain.v]), (n, 1))
        singly = np.zeros(n, dtype=bool)
        if self._follow_p or system.quaternions:
            singly[:] = True
        else:
            for name, values in varied.items():
                states[:, self._places[name]] = values
            if system.m:
                states, singly = self._on_constraints(parameters, states)
        failures = not_numbers(system, parameters)
        for k in np.flatnonzero(singly):
            if k in failures:
                continue
            here = {name: values[k] for name, values in varied.items()}
            try:
                parameters[k] = self.with_found(parameters[k], here)
                states[k] = self.one(parameters[k], here)
            except RuntimeModelError as error:
                failures[int(k)] = str(error)
        states[list(failures)] = np.nan
        return states, failures

    def one(self, p: np.ndarray, varied: Mapping[str, float]) -> np.ndarray:
        """Return the start of one member, assembled.

        Raises
        ------
        AssemblyError
            There is none.
        """
        start, rate = self.given(varied)
        if self.system.m or self.system.start is not None:
            found = assembly.assemble(self.system, p, start, rate, self.t)
        else:
            found = start_values(self.system, p, start, rate)
        state = np.concatenate([found.q, found.v])
        if not np.isfinite(state).all():
            raise AssemblyError("the start is not finite")
        return state

    def _prepare_newton(self, p: np.ndarray, found: Any) -> None:
        system, plain = self.system, self._plain
        constraints = levels.Constraints(system, p, self.t)
        self._reference = np.concatenate([found.q, found.v])
        self._newton = False
        if is_large(system) or system.quaternions:
            return
        self._sizes = constraints.characteristic_sizes(found.q)
        position = constraints.position_scales(found.q, self._sizes)
        self._position_scales = position
        self.smallest_scale = float(position.min(initial=1.0))
        self._velocity_scales = constraints.velocity_scales(found.q, found.v, self._sizes)
        self._free_q, self._free_v = ~plain.q_enforced, ~plain.v_enforced
        determined = int(self._free_q.sum()) == system.nh and int(self._free_v.sum()) == system.m
        self._newton = determined and not found.redundant
        self._rows = self._matrix(p[None], self._reference[None])[0]

    def _on_constraints(self, parameters: np.ndarray, given: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return starts, and which of them are still to be assembled one by one."""
        states, left = given.copy(), np.ones(len(given), dtype=bool)
        if not hasattr(self, "_sizes"):
            return states, left
        left = ~(self._residual(parameters, states) <= _SATISFIED).all(axis=1)
        if not left.any():
            return states, left
        rows = np.flatnonzero(left)
        if not self._newton:
            same = rows[self._starts_as_the_reference(parameters[rows], given[rows])]
            states[same], left[same] = self._reference, False
            return states, left
        found = self._solved(parameters[rows], given[rows])
        good = (self._residual(parameters[rows], found) <= _SOLVED).all(axis=1)
        q = slice(0, self.system.nq)
        moved = np.abs(found[:, q] - self._reference[q])[:, self._free_q] / self._sizes[self._free_q]
        good &= (moved <= _NEAR).all(axis=1)
        states[rows[good]] = found[good]
        left[rows[good]] = False
        return states, left

    def _starts_as_the_reference(self, parameters: np.ndarray, given: np.ndarray) -> np.ndarray:
        """Where the start of the member that all go from is the assembled one, too.

        It is where it is on the constraints, and these have the gradients that they have there for that member: then it
        is the nearest place to the same guesses.
        """
        plain = np.concatenate([self._plain.q, self._plain.v])
        found = np.tile(self._reference, (len(given), 1))
        apart = np.abs(self._matrix(parameters, found) - self._rows).max(axis=(1, 2), initial=0.0)
        on_constraints = (self._residual(parameters, found) <= _SATISFIED).all(axis=1)
        return (given == plain).all(axis=1) & on_constraints & (apart <= 1e-15 * np.abs(self._rows).max())

    def _solved(self, parameters: np.ndarray, given: np.ndarray) -> np.ndarray:
        """Newton's method on positions, then on rates, from the reference; what is enforced stays."""
        system, n = self.system, len(given)
        nq, nh = system.nq, system.nh
        states = given.copy()
        free_q = np.flatnonzero(self._free_q)
        free_v = nq + np.flatnonzero(self._free_v)
        states[:, free_q], states[:, free_v] = self._reference[free_q], self._reference[free_v]
        going = np.arange(n)
        for _ in range(_NEWTON_STEPS if nh else 0):
            residual = self._values("constraint_residual", parameters[going], states[going])[:, :nh]
            rows = self._matrix(parameters[going], states[going])[:, :nh, self._free_q]
            step = _solve(rows, residual)
            states[going[:, None], free_q] -= step
            small = (
                np.abs(step) <= 4e-16 * np.maximum(np.abs(states[going][:, free_q]), self._sizes[free_q])
            ).all(axis=1)
            going = going[~small & np.isfinite(step).all(axis=1)]
            if not len(going):
                break
        for _ in range(2):
            residual = self._values("constraint_residual", parameters, states)[:, nh:]
            rows = self._matrix(parameters, states)[:, :, self._free_v]
            states[:, free_v] -= _solve(rows, residual)
        return states

    def _residual(self, parameters: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Residuals in parts of the constraints' scales, shape (n, nh + m)."""
        values = np.abs(self._values("constraint_residual", parameters, states))
        return values / np.concatenate([self._position_scales, self._velocity_scales])

    def _matrix(self, parameters: np.ndarray, states: np.ndarray) -> np.ndarray:
        entries = self._values("constraint_jacobian", parameters, states)
        return entries.reshape(len(states), self.system.m, self.system.nv)

    def _values(self, function: str, parameters: np.ndarray, states: np.ndarray) -> np.ndarray:
        if len(states) and (parameters == parameters[0]).all():  # states of one member are evaluated faster
            times = np.full(len(states), self.t)
            return evaluate_members(self.system, function, parameters[:1], times, states[None])[0]
        return evaluate_members(self.system, function, parameters, np.array([self.t]), states[:, None])[:, 0]


def _sought(system: System, given: Collection[str]) -> frozenset[str]:
    places = (system.start or {}).get("find", ())
    return frozenset(system.parameters[k]["name"] for k in places) - frozenset(given)


def without_inertia(
    system: System, t: float, parameters: np.ndarray, states: np.ndarray, first: tuple[np.ndarray, np.ndarray]
) -> dict[int, str]:
    """Return which members have negative inertia, or none where something is free to move, and what that is.

    Parameters
    ----------
    parameters, states : ndarray, shape (n, n_p), (n, nq + nv)
    first : (ndarray, ndarray)
        Parameters and state of a member that is known to be sound: what has no inertia there is held.
    """
    if system.nv > _LARGEST_WHOLE:
        return {}
    lowest, still = _inertia(system, t, parameters, states)
    if lowest is None:
        return {}
    _, usual = _inertia(system, t, first[0][None], first[1][None])
    found = {}
    for k in np.flatnonzero((lowest < -_ROUND_OFF) | (still > (0 if usual is None else int(usual[0])))):
        try:
            inertia.refuse_negative_inertia(system, parameters[k], t, states[k])
        except RuntimeModelError as error:
            found[int(k)] = str(error)
    return found


def _inertia(
    system: System, t: float, parameters: np.ndarray, states: np.ndarray
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """The lowest eigenvalue of M, scaled to a unit diagonal, and how many vanish; None where all are positive."""
    n, nv = len(states), system.nv
    mass = evaluate_members(system, "mass_matrix", parameters, np.array([t]), states[:, None])
    mass = np.where(np.isfinite(mass).all(axis=2, keepdims=True), mass, np.eye(nv).reshape(-1)).reshape(
        n, nv, nv
    )
    scale = np.sqrt(np.abs(np.einsum("kii->ki", mass)))
    scale[scale == 0.0] = 1.0
    mass = mass / (scale[:, :, None] * scale[:, None])
    try:
        np.linalg.cholesky(mass - 2.0 * _NONE * np.eye(nv))
        return None, None
    except np.linalg.LinAlgError:
        values = np.linalg.eigvalsh(mass)
        return values[:, 0], (values <= _NONE).sum(axis=1)


def _solve(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve for each member; what is singular gives what is not a number."""
    n, m = right.shape
    try:
        return np.linalg.solve(matrices, right[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        found = np.full((n, m), np.nan)
        for k in range(n):
            try:
                found[k] = np.linalg.solve(matrices[k], right[k])
            except np.linalg.LinAlgError:
                continue
        return found
