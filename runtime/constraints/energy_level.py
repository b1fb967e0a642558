"""Whether a run keeps the energy of its start by scaling the rates (`integrate/projection.py`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.system import System

_EQUAL = 1e-12  # relative round-off


def choose_energy_level(
    wanted: bool | None, system: System, method: Method, p: np.ndarray, t: float, state: np.ndarray
) -> float:
    """Return the energy [J] that the run is to keep; nan where energy scaling is off.

    Parameters
    ----------
    wanted : bool or None
        None: where it suits.
    method : Method
        In the form in which constraints are treated.
    state : ndarray, shape (nq + nv,)
        Consistent initial state.

    Raises
    ------
    RuntimeModelError
        It is wanted, but does not suit; the message says why.
    """
    if wanted is False:
        return np.nan
    objection = _objection(system, method, p, t, state)
    if objection and wanted:
        raise RuntimeModelError(f"energy_scaling: {objection}; leave it out")
    return np.nan if objection else energy(system, p, t, state)


def energy(system: System, p: np.ndarray, t: float, state: np.ndarray) -> float:
    """Return T + V [J]."""
    return float(system.kernel("energy")(t, state, p).sum())


def may_be_kept(system: System, method: Method) -> bool:
    """Whether energy scaling suits model and method, as far as parameters and state have no say in it."""
    return not _objection_to_model(system, method)


def _objection(system: System, method: Method, p: np.ndarray, t: float, state: np.ndarray) -> str:
    name = f"model {system.name!r}"
    if objection := _objection_to_model(system, method):
        return objection
    if system.nw and not _constant_forces(system, p, t, state):
        return f"{name} exchanges energy with the outside, not by constant forces only"
    if not _quadratic(system, p, t, state):
        return f"the kinetic energy of {name} is not quadratic in the rates"
    return ""


def _objection_to_model(system: System, method: Method) -> str:
    name = f"model {system.name!r}"
    if not system.m:
        return f"{name} has no constraints, and the methods keep its energy as well as its motion"
    if not method.scales_energy:
        return f"only {', '.join(_those_that_scale())} have it, with constraints 'projection' or 'partition'"
    if system.structure["time_dependent"] or system.m > system.nh:
        return f"{name} depends on time, or has velocity constraints"
    if system.switches:
        return f"{name} has stops or frictions that act at times"
    if sum(len(kind["coordinates"]) for kind in system.subsystems) > 1:
        return f"{name} has parts that exchange no energy, each with its own"
    return ""


def _those_that_scale() -> list[str]:
    return [name for name, method in METHODS.items() if method.scales_energy]


def _constant_forces(system: System, p: np.ndarray, t: float, state: np.ndarray) -> bool:
    """Whether the power of what has no potential is that of constant forces: linear in v, and the same at all q.

    With other forces the error of the work, which the scaling would pass on to the rates, can be larger than theirs.
    """
    positions, q, v = Positions(system), state[: system.nq], state[system.nq :]
    size = float(np.abs(v).max(initial=0.0)) or 1.0
    one, two = (size * np.cos(k * np.arange(1, system.nv + 1)) for k in (1, 2))
    places = [
        q,
        *(positions.normalised(q + 0.1 * np.sin(k * np.arange(1, system.nq + 1))) for k in (1, 2, 3)),
    ]
    rates = (one, two, one + two, 2.0 * one)
    powers = [
        float(system.kernel("rhs")(t, np.concatenate([place, rate]), p)[system.nq + system.nv])
        for place, rate in zip(places, rates, strict=True)
    ]
    largest = max(map(abs, powers))
    off = max(abs(powers[0] + powers[1] - powers[2]), abs(2.0 * powers[0] - powers[3]))
    return bool(off <= _EQUAL * largest)


def _quadratic(system: System, p: np.ndarray, t: float, state: np.ndarray) -> bool:
    """Whether T grows with the square of the rates, at the start and with other rates there."""
    q, v = state[: system.nq], state[system.nq :]
    size = float(np.abs(v).max(initial=0.0)) or 1.0
    for rates in (v, size * np.cos(np.arange(system.nv))):
        once, twice = (
            float(system.kernel("energy")(t, np.concatenate([q, factor * rates]), p)[0])
            for factor in (1.0, 2.0)
        )
        if not abs(twice - 4.0 * once) <= _EQUAL * abs(twice):
            return False
    return True
