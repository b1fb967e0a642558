"""Linearisation of a model about a state, with exact derivatives, reduced to independent coordinates and rates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.linear.equilibrium import find_equilibrium
from symgen.runtime.linear.model import LinearModel
from symgen.runtime.linear.observation import observation
from symgen.runtime.linear.tangent import Tangent, motion_names, tangent_at
from symgen.runtime.names import inside_dot, rate_indices
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.system import System

_STILL = 1e-9  # of characteristic sizes per second: rates and accelerations that are none
_STEADY = 1e-6  # change of A over a step along the motion, of its size
_CLOSED = 1e-6  # of a constraint's scale: what a state may be off
_FLOW_STEP = 1e-3  # of the time in which the state moves by its size


def linearise(
    system: System,
    at: str | tuple[Sequence[float], Sequence[float]] = "equilibrium",
    *,
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    rate: Mapping[str, float] | None = None,
    t: float = 0.0,
    stable: bool = False,
    outputs: Sequence[str] | None = None,
) -> LinearModel:
    """Linearise a model about an equilibrium, its start, or any state.

    Derivatives are exact: of the equations of motion by the generated Jacobian, of the rest by numbers that carry
    their derivatives. Small motions satisfy the constraints and their derivatives; of the coordinates those are kept as
    states that pivots choose. Where there are velocity constraints, more positions than rates are independent.

    Parameters
    ----------
    system : System
    at : {"equilibrium", "start"} or (q, v)
        Where: a state of rest near the start, see `find_equilibrium`; the start itself, moving or not; or a state.
    parameters : mapping of str to float, optional
        Values of parameters and inputs. An input over time has its value at `t`.
    start, rate : mapping of str to float, optional
        Start values of coordinates and rates.
    t : float [s]
    stable : bool
        Whether an equilibrium must be a stable one.
    outputs : sequence of str, optional
        What y is: names of coordinates and outputs, `dot(x)`, `dot(dot(x))`. All coordinates and outputs by default.

    Returns
    -------
    LinearModel

    Raises
    ------
    RuntimeModelError
        There is no equilibrium, derivatives are not finite there, or a name is unknown.
    """
    p = system.parameter_values({**_inputs_at(system, t, parameters or {}), **(parameters or {})})
    q, v, notes = _state(system, p, at, start, rate, t, stable)
    given = _given(system, start or {}, rate or {})
    tangent = tangent_at(system, p, t, q, v, given)
    at_rest = isinstance(at, str) and at == "equilibrium"
    kind = "equilibrium" if at_rest else _kind(system, p, t, q, v, given, tangent)
    if system.structure["time_dependent"]:
        notes.append(f"the equations depend on time; they are taken at t = {t:g} s")
    C, D, names = observation(system, p, tangent, outputs)
    notes += _notes(system, tangent)
    return LinearModel(
        system, p, float(t), q, v, tangent.a, tangent.multipliers, kind, tangent.A, tangent.B, C, D,
        tangent.states(system), [record["name"] for record in system.inputs], names, motion_names(system),
        tangent.displacements, Constraints(system, p, t).characteristic_sizes(q), notes,
    )  # fmt: skip


def _state(
    system: System, p: np.ndarray, at: Any, start: Any, rate: Any, t: float, stable: bool
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    if not isinstance(at, str):
        q, v = (np.array(part, dtype=float) for part in at)
        if q.shape != (system.nq,) or v.shape != (system.nv,):
            raise RuntimeModelError(
                f"the state has {q.size} coordinates and {v.size} rates, but model {system.name!r} has {system.nq} and "
                f"{system.nv}"
            )
        _check_closed(system, p, t, q, v)
        return Positions(system).normalised(q), v, []
    if at not in ("equilibrium", "start"):
        raise RuntimeModelError(f"at is {at!r}: give 'equilibrium', 'start', or a state (q, v)")
    assembled = assemble(system, p, start, rate, t)
    if at == "start":
        return assembled.q, assembled.v, list(assembled.notes)
    found = find_equilibrium(system, p, assembled.q, t, stable)
    return found.q, np.zeros(system.nv), list(assembled.notes)


def _check_closed(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> None:
    """Refuse a state that does not satisfy the constraints."""
    if not system.m:
        return
    constraints = Constraints(system, p, t)
    sizes = constraints.characteristic_sizes(q)
    scales = [constraints.position_scales(q, sizes), constraints.velocity_scales(q, v, sizes)]
    off = np.abs(
        np.concatenate([constraints.position(q), constraints.velocity(q, v)]) / np.concatenate(scales)
    )
    worst = int(np.argmax(np.where(np.isfinite(off), off, np.inf)))
    if not off[worst] <= _CLOSED:
        name = [*constraints.names[: system.nh], *constraints.names][worst]
        raise RuntimeModelError(
            f"the state does not satisfy the constraint {name!r}: its residual is {off[worst]:.2g} of its scale; take "
            "one from a run, or linearise about the start, which is assembled"
        )


def _given(
    system: System, start: Mapping[str, float], rate: Mapping[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return which displacements and rates the model or the user gives, rather than guesses."""
    _, _, enforced, rates = system.initial_state()
    enforced = enforced | np.array([record["name"] in start for record in system.coordinates], dtype=bool)
    places = rate_indices(system.coordinates, system.rates, system.quaternions)
    rates[[places[inside_dot(name)] for name in rate]] = True
    return Positions(system).held(enforced), rates


def _inputs_at(system: System, t: float, said: Mapping[str, float]) -> dict[str, float]:
    """Return the values at `t` of the model's own inputs over time."""
    moving = [r for r in system.inputs if ("table" in r or "polynomial" in r) and r["name"] not in said]
    if not moving:
        return {}
    from symgen.runtime.inputs.given import from_record

    values = {}
    for record in moving:
        pieces = from_record(record).pieces()
        k = pieces.piece_at(t)
        values[record["name"]] = float(
            np.polynomial.polynomial.polyval(t - pieces.knots[k], pieces.coefficients[k])
        )
    return values


def _kind(
    system: System,
    p: np.ndarray,
    t: float,
    q: np.ndarray,
    v: np.ndarray,
    given: tuple[np.ndarray, np.ndarray],
    tangent: Tangent,
) -> str:
    """Say whether the state rests, moves steadily, or neither.

    A motion is steady where accelerations, and with them A, stay the same along it.
    """
    sizes = Constraints(system, p, t).characteristic_sizes(q)
    speed, change = (float(np.abs(x / sizes).max(initial=0.0)) for x in (v, tangent.a))
    if speed <= _STILL and change <= _STILL * max(1.0, np.abs(tangent.A).max(initial=0.0)):
        return "equilibrium"
    h = _FLOW_STEP / max(speed, np.sqrt(change))
    later_q = tangent.equations.positions.move(q, h * v + 0.5 * h * h * tangent.a)
    later = tangent_at(system, p, t + h, later_q, v + h * tangent.a, given)
    same = np.array_equal(later.independent.positions, tangent.independent.positions)
    if not same or change > _STILL * max(1.0, speed**2):
        return "moving state"
    drift = np.abs(later.A - tangent.A).max(initial=0.0)
    return "steady motion" if drift <= _STEADY * np.abs(tangent.A).max(initial=1.0) else "moving state"


def _notes(system: System, tangent: Tangent) -> list[str]:
    rank = system.nv - len(tangent.independent.rates)
    notes = []
    if rank < system.m:
        notes.append(f"{system.m - rank} of {system.m} constraints follow from the others at this state")
    held = {record["name"] for record in system.constraints}
    if not all(s.get("smooth") and held & set(s["normal"]) for s in system.switches):
        notes.append("stops and dry friction are taken as open: they do not act on the linear model")
    return notes
