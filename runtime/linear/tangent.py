"""Small motions about a state: displacements, rates and accelerations from independent ones and inputs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.linear.duals import derivatives
from symgen.runtime.linear.independent import Independent, independent_motions
from symgen.runtime.linear.motion_equations import MotionEquations
from symgen.runtime.names import rate_labels

if TYPE_CHECKING:
    from symgen.runtime.system import System


class Tangent(NamedTuple):
    """Small motions about a state: from x and u to displacements, rates and accelerations, nv rows each."""

    equations: MotionEquations
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    multipliers: np.ndarray
    independent: Independent
    displacements: np.ndarray
    rates: np.ndarray
    accelerations: np.ndarray
    accelerations_by_inputs: np.ndarray
    A: np.ndarray
    B: np.ndarray

    def states(self, system: System) -> list[str]:
        """Return the names of x."""
        positions, rates = motion_names(system), rate_labels(system.coordinates, system.rates)
        chosen = self.independent
        return [positions[i] for i in chosen.positions] + [rates[i] for i in chosen.rates]


def tangent_at(
    system: System,
    p: np.ndarray,
    t: float,
    q: np.ndarray,
    v: np.ndarray,
    given: tuple[np.ndarray, np.ndarray],
) -> Tangent:
    """Linearise at a state; `given` says which displacements and rates are rather kept independent."""
    equations = MotionEquations(system, p, t)
    nv = system.nv
    a, multipliers = equations.accelerations_and_multipliers(q, v)
    by_positions, by_rates, by_unknowns = equations.jacobian(q, v, a, multipliers)
    by_inputs = _residual_by_inputs(system, equations, q, v, a, multipliers)
    response = -equations.solve(by_unknowns, np.hstack([by_positions, by_rates, by_inputs]))[:nv]
    independent = _independent(system, equations, q, v, given)
    n_positions = len(independent.positions)
    displacements = np.hstack([independent.position_basis, np.zeros((nv, len(independent.rates)))])
    rates = np.hstack([independent.rates_by_positions, independent.rates_by_rates])
    accelerations = response[:, :nv] @ displacements + response[:, nv : 2 * nv] @ rates
    velocities = rates + equations.turning(v) @ displacements
    A = np.vstack([velocities[independent.positions], accelerations[independent.rates]])
    by_u = response[:, 2 * nv :]
    B = np.vstack([np.zeros((n_positions, by_u.shape[1])), by_u[independent.rates]])
    return Tangent(
        equations, q, v, a, multipliers, independent, displacements, rates, accelerations, by_u, A, B
    )


def _residual_by_inputs(system: System, equations: MotionEquations, q, v, a, multipliers) -> np.ndarray:
    y, p = np.concatenate([q, v, a, multipliers]), equations.p
    directions = np.zeros((len(p), len(system.inputs)))
    directions[len(system.parameters) + np.arange(len(system.inputs)), np.arange(len(system.inputs))] = 1.0
    if not directions.size:
        return np.zeros((system.nv + system.m, 0))
    return derivatives(
        system, "residual", equations.t, y, p, np.zeros((len(y), directions.shape[1])), directions
    )[1]


def _independent(
    system: System,
    equations: MotionEquations,
    q: np.ndarray,
    v: np.ndarray,
    given: tuple[np.ndarray, np.ndarray],
) -> Independent:
    nv, nh = system.nv, system.nh
    if not system.m:
        return independent_motions(np.zeros((0, nv)), np.zeros((0, nv)), 0, np.ones(nv), given)
    along = np.zeros((system.nq + nv, 2 * nv))
    along[: system.nq, :nv], along[system.nq :, nv:] = equations.kinematics(q), np.eye(nv)
    y, still = np.concatenate([q, v]), np.zeros((len(equations.p), 2 * nv))
    _, slopes = derivatives(system, "constraint_residual", equations.t, y, equations.p, along, still)
    by_positions, jacobian = slopes[nh:, :nv], slopes[nh:, nv:]
    sizes = Constraints(system, equations.p, equations.t).characteristic_sizes(q)
    return independent_motions(jacobian, by_positions, nh, sizes, given)


def motion_names(system: System) -> list[str]:
    """Return what rates move: coordinates by their names, small rotations of quaternions by those of their rates."""
    names = {record["name"] for record in system.coordinates}
    return [r["name"] if r["name"] in names else _moved(system, k) for k, r in enumerate(system.rates)]


def _moved(system: System, k: int) -> str:
    """What a rate with a name of its own moves: a coordinate of another name, or it turns a quaternion."""
    turns = [place - number for number, place in enumerate(system.quaternions)]
    if any(j <= k < j + 3 for j in turns):
        return f"turn({system.rates[k]['name']})"
    return system.coordinates[k + sum(j + 3 <= k for j in turns)]["name"]
