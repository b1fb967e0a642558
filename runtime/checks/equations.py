"""Whether the functions that a run used are those of one model: each against `residual`, at states along the run.

`rhs` solves M a = f + Gᵀλ and G a = γ by code of its own, in a form that depends on the
model's size. What it gets wrong in the same way each time need not show in steps, energies or constraints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import projected, right_hand_sides, solved_rows
from symgen.runtime.checks.entry import HealthCheck, limited
from symgen.runtime.checks.equations_code import (
    CHANGE,
    CHANGES,
    FUNCTIONS,
    LEAST_RATIO,
    MASS,
    MOVES,
    hold_equations,
    make_held,
)
from symgen.runtime.code.call_block import call_block
from symgen.runtime.kept_arrays import lent
from symgen.runtime.lazy import Late
from symgen.runtime.names import rate_labels
from symgen.runtime.positions import Positions
from symgen.runtime.record import record
from symgen.runtime.sampling import quasi_random, sample_rows

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

forms = Late("symgen.runtime.contact.forms")

_STATES = 5
_LIMIT = 1e-8  # of the size of an equation's terms
_LARGEST_MATRIX = 200  # rates


def equations(solution: Solution) -> Iterator[HealthCheck]:
    """Yield one entry: the largest that is left of any equation, in parts of its terms, and where."""
    rows = sample_rows(len(solution.t), _STATES)
    rows = rows[np.isfinite(solution.states[rows]).all(axis=1)]
    worst = _Left()
    for system, p, of in _forms(solution, rows):
        t, states = solution.t[of], solution.states[of, : system.nq + system.nv]
        precomputed = system.precomputed(p)
        with lent(system, LookAtEquations, len(precomputed)) as look:
            worst = max(worst, look.worst(system, p, precomputed, t, states), key=lambda left: left.value)
    if solution.parts is not None and len(rows):
        worst = max(worst, *_parts(solution, rows), key=lambda left: left.value)
    found = f"what is left of the equations of motion is {worst.value:.2g} of their terms, at most"
    objection = "" if worst.value <= _LIMIT else _objection(worst)
    yield limited("equations", worst.value, _LIMIT, found, objection)


def _objection(worst: _Left) -> str:
    where = f"{worst.name()} at t = {worst.t:.6g} s" if worst.name is not None else "all states"
    return (
        f"the equations of motion do not hold: `{worst.function}` and `residual` disagree by {worst.value:.2g} of the "
        f"terms in {where}; derive the module again, do not edit it, and report it if that does not help"
    )


@record
class _Left:
    """The largest that is left of the equations of a function.

    Attributes
    ----------
    value : float
        In parts of an equation's terms.
    name : callable or None
        What says which equation that is.
    t : float [s]
    function : str
    """

    value: float = 0.0
    name: Callable[[], str] | None = None
    t: float = 0.0
    function: str = ""


def _forms(solution: Solution, rows: np.ndarray) -> Iterator[tuple[System, np.ndarray, np.ndarray]]:
    """Yield the systems that held at frames, with their parameters and those frames: stops and friction switch."""
    if solution.forms is None:
        yield solution.system, solution.p, rows
        return
    index = solution.forms.index[rows]
    for k in sorted(set(index.tolist())):
        p = solution.p.copy()
        p[solution.system.settings_of_switches] = solution.forms.settings[k]
        yield forms.form_of(solution.system, solution.forms.settings[k]), p, rows[index == k]


def _parts(solution: Solution, rows: np.ndarray) -> Iterator[_Left]:
    """Yield how far the accelerations of subsystems that ran by themselves are from those of the whole model."""
    system, t = solution.system, solution.t[rows]
    whole = right_hand_sides(system, solution.p, t, solution.states[rows])[:, : system.nq + system.nv]
    met: set[int] = set()
    for subsystem in solution.parts.found:
        own = subsystem.run.system
        if id(own) in met:
            continue
        met.add(id(own))
        columns = subsystem.columns[0][: own.nq + own.nv]
        apart = right_hand_sides(own, subsystem.run.arrays.p, t, solution.states[rows][:, columns])
        off = np.abs(apart[:, : len(columns)] - whole[:, columns])
        scale = np.maximum(np.abs(whole[:, columns]), 1e-3 * np.abs(whole[:, columns]).max(initial=0.0))
        relative = np.where(off > 0.0, off / np.where(scale > 0.0, scale, 1.0), 0.0)
        if np.isfinite(relative).all() and relative.size:
            i, _ = np.unravel_index(np.argmax(relative), relative.shape)
            name = f"the subsystem of {subsystem.name}"
            yield _Left(float(relative.max()), lambda name=name: name, float(t[i]), "rhs")


class LookAtEquations:
    """The equations of one form of a model at some states, held against `residual` in machine code.

    Each call from Python takes longer than what it is called for, and so does arithmetic of a few numbers.

    Attributes
    ----------
    held : Held
    """

    def __init__(self, system: System, n_precomputed: int):
        self.held = make_held(system, _STATES, n_precomputed, _LARGEST_MATRIX)
        n_set, width = system.n_settable, system.nq + system.nv
        numbers = [quasi_random(k * (width + n_set))[-(width + n_set) :] for k in range(1, CHANGES + 1)]
        self._of_states = [1.0 + CHANGE * of[:width] for of in numbers]
        self._of_p = [1.0 + CHANGE * of[width:] for of in numbers]
        self._positions, self._call = Positions(system), call_block(hold_equations, self.held)

    def fits(self, n_precomputed: int) -> bool:
        """Whether it can look at runs of such parameters."""
        return len(self.held.p) == n_precomputed

    def worst(
        self, system: System, p: np.ndarray, precomputed: np.ndarray, t: np.ndarray, states: np.ndarray
    ) -> _Left:
        """Return what is left of the equation that least holds at some states."""
        held, n = self.held, len(t)
        held.p[:] = precomputed
        rows = solved_rows(system, held.p, t, states)
        if system.m and (system.dependent or not (rows[:, -1] >= LEAST_RATIO).all()):
            # Off the constraints, accelerations that dependent ones ask for contradict each other: none fits them all.
            states = projected(system, p, t, states)
            rows = solved_rows(system, held.p, t, states)
        held.sizes[-1], held.times[:n], held.states[:n], held.rows[0, :n] = n, t, states, rows
        held.moves[:n] = self._positions.derivatives(states[:, : system.nq], states[:, system.nq :])
        for k in range(CHANGES):
            changed_p, changed = p.copy(), states * self._of_states[k]
            changed_p[: system.n_settable] *= self._of_p[k]
            held.changed[k, :n], held.changed_p[k] = changed, system.precomputed(changed_p)
            held.rows[1 + k, :n] = solved_rows(system, held.changed_p[k], t, changed)
        held.addresses[:] = _addresses(system)
        self._call()
        function, equation, state = held.where.tolist()
        if function < 0:
            return _Left()
        name = _coordinate if function == MOVES else _equation
        return _Left(
            float(held.worst[0]), lambda: name(system, equation), float(t[state]), FUNCTIONS[function]
        )


def _addresses(system: System) -> list[int]:
    """Return the addresses of what is looked at: `residual`, and other functions that a run has compiled."""
    known, left_out = system.compiled, set()
    if system.nv > _LARGEST_MATRIX:
        left_out |= {"mass_matrix", "constraint_jacobian"}
    if any(switch.get("normal") for switch in system.switches):
        left_out.add("forces")
    others = FUNCTIONS[MASS:]
    asked = [name if name in known and name not in left_out else None for name in others]
    of = [system.kernel(name).precomputed_address if name else 0 for name in asked]
    return [system.kernel("residual").precomputed_address, 0, *of]


def _coordinate(system: System, k: int) -> str:
    """Say what it is that moves coordinate `k`."""
    return f"the rate of {system.coordinates[k]['name']}"


def _equation(system: System, k: int) -> str:
    """Return the name of an equation."""
    names = [f"the equation of {name}" for name in rate_labels(system.coordinates, system.rates)]
    return [*names, *(f"constraint {record['name']!r}" for record in system.constraints)][k]
