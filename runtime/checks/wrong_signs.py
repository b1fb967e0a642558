"""Forces that may have the wrong sign: damping that feeds a motion, springs that push away.

The energy balance of such runs is in order: the work of a dissipation is counted, whatever its sign. So is their
result, if that is what was meant: all this is notes.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.entry import HealthCheck, noted
from symgen.runtime.checks.time_scales import motion_jacobian
from symgen.runtime.lazy import Late
from symgen.runtime.sampling import sample_rows

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

mode_origin = Late("symgen.runtime.checks.mode_origin")

_FRAMES = 200
_LARGEST_DAMPING = 100  # rates
_NEGATIVE = 1e-4  # of the largest damping
_ROUND_OFF = 1e-9
_BALANCE = 0.05  # error of the energy, in parts of the largest
_MOST_FEEDING = 0.9  # part of the frames at which damping feeds the motion
_SPEED_UP = 4.0  # T at the end over T at 3/4 of the run; falling bodies reach 1.8
_RUN_AWAY = 1e6  # T at the end over that of the first tenth
_LEAST_FOLDS = 3.0  # of e, by which the motion grows in the run
_STATES = 5
_PARAMETER_STEP = 1e-3
_LARGEST = 200  # rates


def wrong_signs(solution: Solution) -> Iterator[HealthCheck]:
    """Yield notes on damping or stiffness of an unusual sign; nothing where both are in order."""
    if solution.forms is not None or solution.system.has_feedback or len(solution.t) < 8:
        return
    if not solution.energy.max_error <= _BALANCE:
        return  # what the run shows is not the model's doing
    yield from _negative_damping(solution)
    yield from _negative_stiffness(solution)


def _negative_damping(solution: Solution) -> Iterator[HealthCheck]:
    """Take note where the part of the power that is even in the rates is an inflow nearly always.

    Damping does the same work if all rates are turned round; constant and driven forces do the opposite work.
    """
    system, energy = solution.system, solution.energy
    if not system.nw or system.states:
        return  # forces of actuators and controllers may well feed a motion
    if system.source.facts("rhs").turns_back:
        return  # none of its power is even in the rates
    if (name := _negative_damper(solution)) is not None:
        value = float(solution.p[[record["name"] for record in system.parameters].index(name)])
        says = f"parameter {name!r} = {value:g} makes a damping negative, which feeds the motion: is its sign meant?"
        yield noted("negative damping", value, 0.0, says)
        return
    if system.structure["time_dependent"]:
        return  # there, what moves by itself does work that is even in the rates, too
    even, size = _even_power(solution, solution.p)
    moving = np.abs(even) > _ROUND_OFF * size.max()
    if not moving.any() or np.mean(even[moving] > 0.0) < _MOST_FEEDING or even.sum() < 1e-3 * size.sum():
        return
    share = float(even.sum() / size.sum())
    name = _feeding_parameter(solution, even)
    says = (
        f"forces that depend on rates feed the motion instead of damping it, {energy.work[-1] - energy.work[0]:.3g} J "
        f"in all{name}: is the sign of the damping meant?"
    )
    yield noted("negative damping", share, 0.0, says)


def _even_power(solution: Solution, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of the power that is even in the rates, and the size of its parts, at some frames [W]."""
    system, column = solution.system, solution.system.nq + solution.system.nv
    rows = sample_rows(len(solution.t), _FRAMES)
    t, q, v = solution.t[rows], solution.q[rows], solution.v[rows]
    forth, back = (evaluate(system, "rhs", p, t, np.hstack([q, sign * v]))[:, column] for sign in (1.0, -1.0))
    return 0.5 * (forth + back), 0.5 * (np.abs(forth) + np.abs(back))


def _feeding_parameter(solution: Solution, even: np.ndarray) -> str:
    """Return which parameter the inflow grows with, in words."""
    best, share = None, 0.5
    for k, record in enumerate(solution.system.parameters):
        p = solution.p.copy()
        if p[k] == 0.0:
            continue
        p[k] *= 1.0 + _PARAMETER_STEP
        effect = (_even_power(solution, p)[0].sum() - even.sum()) / (_PARAMETER_STEP * even.sum())
        if effect > share:
            best, share = f"; it grows with parameter {record['name']!r} = {solution.p[k]:g}", effect
    return best or ""


def _negative_damper(solution: Solution) -> str | None:
    """Return the negative parameter without which no damping would be negative; None where there is none.

    The damping matrix is that at rest, -Z^T M (da/dv) Z with Z the motions that constraints allow.
    """
    system, n = solution.system, len(solution.system.parameters)
    negative = np.flatnonzero(solution.p[:n] < 0.0)
    if not negative.size or system.nv > _LARGEST_DAMPING:
        return None
    rows = [0, len(solution.t) // 2, len(solution.t) - 1]
    if not all(_is_fed(solution, solution.p, i) for i in rows):
        return None
    for k in negative:
        without = solution.p.copy()
        without[k] = 0.0
        if not any(_is_fed(solution, without, i) for i in rows):
            return system.parameters[k]["name"]
    return None


def _is_fed(solution: Solution, p: np.ndarray, frame: int) -> bool:
    system, t, q = solution.system, float(solution.t[frame]), solution.q[frame]
    nv, rest = system.nv, np.zeros(system.nv)
    mass = system.kernel("mass_matrix")(t, np.concatenate([q, rest]), p).reshape(nv, nv)
    damping = -mass @ motion_jacobian(system, p, t, q, rest)[nv:, nv:]
    if system.m:
        rows = system.kernel("constraint_jacobian")(t, np.concatenate([q, rest]), p).reshape(system.m, nv)
        _, values, directions = np.linalg.svd(rows)
        rank = np.count_nonzero(values > max(rows.shape) * np.finfo(float).eps * values.max(initial=0.0))
        allowed = directions[rank:].T
        damping = allowed.T @ damping @ allowed
    if not damping.size or not np.all(np.isfinite(damping)):
        return False
    values = np.linalg.eigvalsh(0.5 * (damping + damping.T))
    return bool(values[0] < -_NEGATIVE * np.abs(values).max() and values[0] < 0.0)


def _negative_stiffness(solution: Solution) -> Iterator[HealthCheck]:
    """Take note where a motion grows exponentially through the whole run, and is not fed from outside."""
    system, kinetic = solution.system, solution.energy.kinetic
    late = kinetic[int(0.75 * (len(kinetic) - 1))]
    if system.nv > _LARGEST or not kinetic[-1] > _SPEED_UP * late or kinetic[-1] < 0.999 * kinetic.max():
        return
    inflow = solution.energy.work[-1] - solution.energy.work[0]
    if inflow > 0.5 * kinetic[-1]:
        return
    if solution.status == "failed" and not kinetic[-1] > _RUN_AWAY * kinetic[: len(kinetic) // 10 + 1].max():
        return  # it failed for another reason while it was fast
    rows = sample_rows(len(solution.t), _STATES)
    origins = [
        mode_origin.fastest_growth(system, solution.p, solution.t[i], solution.q[i], solution.v[i])
        for i in rows
    ]
    if any(origin is None for origin in origins):
        return
    folds = float(min(origin.eigenvalue.real for origin in origins) * (solution.t[-1] - solution.t[0]))
    if folds < _LEAST_FOLDS or abs(origins[-1].eigenvalue.imag) > abs(origins[-1].eigenvalue.real):
        return
    values = dict(zip((record["name"] for record in system.parameters), solution.p))
    negative = [name for name, _, effect in origins[-1].parameters if effect > 0.0 and values[name] < 0.0]
    named = negative or [name for name, _, effect in origins[-1].parameters if effect > 0.0]
    by = f", with parameter {named[0]!r} = {values[named[0]]:g}" if named else ""
    says = (
        f"the motion runs away, by e^{folds:.3g} in the run{by}: forces push away where springs pull back: is the "
        "sign of the stiffness meant, or the start an unstable equilibrium without limit?"
    )
    yield noted("negative stiffness", folds, _LEAST_FOLDS, says)
