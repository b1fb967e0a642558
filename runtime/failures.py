"""Sentences for runs that fail: cause, time, coordinate or constraint, and one thing to do next."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.integrate import layout as at
from symgen.runtime.lazy import Late
from symgen.runtime.names import rate_labels
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from collections.abc import Iterator

    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.system import System

dependence = Late("symgen.runtime.constraints.dependence")
levels = Late("symgen.runtime.constraints.levels")

_ROUND_OFF_RTOL = 1e-12
_NO_GRADIENT = 1e-12
_NO_SQUARE, _OVERFLOWS_SOON = 1e150, 1e100
_FAR_OFF = 0.1  # of what constraints change by over the coordinates' sizes: no mechanism is so far from them
# Where a run may stop for constraints that come to depend on each other; the latter have reasons of other kinds too.
_MAY_BE_DEPENDENT = (
    at.PROJECTION_FAILED,
    at.NEWTON_FAILED,
    at.STEP_TOO_SMALL,
    at.SINGULAR_MATRIX,
    at.NOT_FINITE,
)
NEARLY_DEPENDENT = 1e-2  # methods that do not pass such a configuration may stop well before it
_MOST_NAMES = 12  # of constraints in a sentence
_ROUND_OFF_RULES = 0.1  # steps that fall to nothing in front of one do so farther off, where round-off shows
_OF_TOLERANCE = 1e-3  # that Newton's iteration leaves
_STEPS_AHEAD = 3  # Newton's iteration fails before constraints depend on each other
_FEWEST_PLACES, _MOST_PLACES = 60, 1500
_BETWEEN_PLACES = NEARLY_DEPENDENT / 3  # of the coordinates' sizes: what is nearly dependent is wider
_BY_ITSELF = (at.STEP_TOO_SMALL, at.SINGULAR_MATRIX, at.NOT_FINITE, at.NEWTON_FAILED)


def failure_message(status: int, system: System, method: Method, arrays: LoopArrays) -> str:
    """Return the sentence for a negative `status` of a step loop.

    Parameters
    ----------
    status : int
        See `symgen.runtime.integrate.layout`.
    """
    when = f"t = {arrays.t:.9g} s"
    if status == at.SINGULAR_MATRIX and method.series and system.m:
        return (
            f"Constraints depend on each other at {when}, where series of the accelerations cannot be solved for: "
            "use --method dop853, which lets go of what is redundant."
        )
    too_large = _too_large(system, arrays) if status in _BY_ITSELF else ""
    if too_large:
        return (
            f"The motion became infinite or undefined at {when}: {too_large}, and what follows from it overflows; "
            "choose larger units, or a smaller number."
        )
    undefined = status == at.NOT_FINITE and not np.isfinite(_row(system, arrays)).all()
    # A projection that failed began on the constraints: what they are there does tell.
    blown_up = status != at.PROJECTION_FAILED and _left_constraints(system, arrays)
    if status in _MAY_BE_DEPENDENT and not undefined and not blown_up:
        dependent = _dependent(status, system, method, arrays, when)
        if dependent:
            return dependent
    if status == at.STEP_TOO_SMALL:
        return _step_too_small(system, method, arrays, when)
    # Without constraints a projection only scales quaternions, and fails where the step before it overflowed.
    if status == at.NOT_FINITE or (status == at.PROJECTION_FAILED and not system.m):
        return _not_finite(system, method, arrays, when)
    if status == at.PROJECTION_FAILED:
        name = worst_constraint(system, arrays)
        remark = system.remark(name)
        cause = (
            f"{remark}; if it does there, end the run before"
            if remark
            else "the mechanism may be locked there; check its geometry"
        )
        return (
            f"The state cannot be brought back onto constraint {name!r} after {when}: "
            f"{cause if method.adaptive else 'try a smaller --step'}."
        )
    if status == at.NEWTON_FAILED:
        remedy = "try a smaller --step" if not method.adaptive else "try --method dop853"
        if large := _beyond_digits(system, arrays):
            atol = float(arrays.control[at.ATOL])
            remedy = f"rates reach {large:.2g}, whose last digits are above what atol {atol:g} asks for: give a larger "
            remedy += "--atol, or choose larger units"
        return (
            f"Newton's iteration of {method.name} does not converge at {when}: {fastest(system, arrays)} "
            f"changes fastest; {remedy}."
        )
    if status == at.PARTITION_LOST:
        return (
            f"Every choice of independent coordinates fails at {when}: constraints come to depend on each other there, "
            "as at a dead point, and no coordinates determine the rest. Use constraints = projection, which passes it."
        )
    if status == at.SINGULAR_MATRIX:
        return (
            f"The equations of motion have no unique solution at {when}: {fastest(system, arrays)} has no mass or too "
            "many constraints there; give it a mass, or remove a constraint."
        )
    return f"{method.name} stopped at {when} with status {status}."


def _too_large(system: System, arrays: LoopArrays) -> str:
    """Return what says that an input or a parameter has no square, "" where none is so large, or where it acts not."""
    inputs = dict(getattr(system, "largest_inputs", {}))
    row = np.append(_row(system, arrays)[: system.nq + system.nv], arrays.y)
    if not (np.abs(row) <= _OVERFLOWS_SOON).all():  # a limit may be as good as none
        named = zip((*system.parameters, *system.inputs), arrays.p)
        inputs |= {
            record["name"]: abs(float(value)) for record, value in named if record["name"] not in inputs
        }
    for name, value in inputs.items():
        if value > _NO_SQUARE:
            what = "parameter" if name in {record["name"] for record in system.parameters} else "input"
            return f"{what} {name!r} is as large as {value:.3g}"
    return ""


def _left_constraints(system: System, arrays: LoopArrays) -> bool:
    """Whether a run is so far off its constraints that what they are there says nothing of the mechanism."""
    if not system.nh:
        return False
    constraints, q = levels.Constraints(system, arrays.p, arrays.t), arrays.y[: system.nq]
    with np.errstate(all="ignore"):
        off, scales = (
            constraints.position(q),
            constraints.position_scales(q, constraints.characteristic_sizes(q)),
        )
        return not (np.abs(off) <= _FAR_OFF * scales).all()


def _dependent(status: int, system: System, method: Method, arrays: LoopArrays, when: str) -> str:
    """Return the sentence for constraints that depend on each other where the run stopped, "" where none do."""
    if not system.m:
        return ""
    passes = method.passes_dependence
    parts = [dependence.DEPENDENT if passes else NEARLY_DEPENDENT]
    if status == at.STEP_TOO_SMALL:
        parts.append(_ROUND_OFF_RULES)
    for part in parts:
        for q in _on_the_way(system, method, arrays):
            place = system, arrays.p, arrays.t, q
            names = dependence.dependent_constraints(*place, part)
            # Those that depend on each other everywhere are no reason to stop, unless they ask for different motions.
            if names and not (status in _BY_ITSELF and not dependence.rank_is_lost(*place, part)):
                return _of_dependent(method, names, place, when)
    return ""


def _of_dependent(method: Method, names: list[str], place: tuple, when: str) -> str:
    """Return the sentence for these constraints, which depend on each other, or nearly so, at a place."""
    nearly = "" if dependence.dependent_constraints(*place) else "nearly "
    subject = ", ".join(repr(name) for name in names[:_MOST_NAMES])
    if len(names) > _MOST_NAMES:
        subject += f" and {len(names) - _MOST_NAMES} others"
    one = len(names) == 1
    verdict = f"restricts {nearly}nothing" if one else f"{nearly}depend on each other"
    what = f"Constraint{'' if one else 's'} {subject} {verdict} at {when}"
    if not method.passes_dependence:
        return (
            f"{what}, and {method.name} with constraints = {method.form} does not get past that. Use --method dop853 "
            "with --constraints projection, which passes such configurations where a motion leads on from them."
        )
    if nearly:
        return (
            f"{what}, and {method.name} cannot tell the accelerations there as well as the tolerance asks for, for "
            "round-off: use --method dop853, or loosen --rtol."
        )
    return (
        f"{what}, and no motion leads on from there: the mechanism is locked or out of reach, or what these "
        "constraints ask for later contradicts; check its geometry and what is prescribed over time."
    )


def _on_the_way(system: System, method: Method, arrays: LoopArrays) -> Iterator[np.ndarray]:
    """Yield where the run stopped, and for a fixed step, whose stages may reach across, where it goes from there."""
    q, v = arrays.y[: system.nq], arrays.y[system.nq : system.nq + system.nv]
    yield q
    h = arrays.control[at.H]
    if method.adaptive or not np.isfinite(h * v).all():
        return
    a = np.nan_to_num(_row(system, arrays)[system.nq : system.nq + system.nv], posinf=0.0, neginf=0.0)
    positions = Positions(system)
    for part in np.linspace(0.0, _STEPS_AHEAD, _places_ahead(system, arrays, q, h * v) + 1)[1:] * h:
        with np.errstate(over="ignore", invalid="ignore"):  # a run may fail for running away
            there = positions.retract(q, part * v + 0.5 * part**2 * a)
        if not np.isfinite(there).all():
            return
        yield there


def _places_ahead(system: System, arrays: LoopArrays, q: np.ndarray, change: np.ndarray) -> int:
    """Return at how many places of the way ahead constraints are looked at; a step changes coordinates by so much."""
    sizes = levels.Constraints(system, arrays.p, arrays.t).characteristic_sizes(q)
    places = _STEPS_AHEAD * np.max(np.abs(change) / sizes) / _BETWEEN_PLACES
    return int(np.clip(np.ceil(places), _FEWEST_PLACES, _MOST_PLACES))


def _step_too_small(system: System, method: Method, arrays: LoopArrays, when: str) -> str:
    h = arrays.control[at.H]
    if arrays.counters[at.STIFF_COUNT] > 0:
        remedy = "the motion is stiff; try --method radau5"
    elif method.series and system.m:
        remedy = "there may be a change point, which series do not reach across; try --method dop853"
    elif arrays.control[at.RTOL] < _ROUND_OFF_RTOL:
        remedy = "the tolerance is at the limit of round-off; loosen --rtol and --atol"
    else:
        remedy = "look for a singularity or a jump in the forces there, or loosen --rtol"
    return f"Step size fell to {h:.1e} s at {when}: {fastest(system, arrays)} changes fastest; {remedy}."


def _not_finite(system: System, method: Method, arrays: LoopArrays, when: str) -> str:
    row = _row(system, arrays)
    names = state_names(system)
    broken = [names[i] for i in np.flatnonzero(~np.isfinite(row[: len(names)]))]
    flat = _constraint_without_gradient(system, arrays) if broken else None
    if flat is not None:
        what = f"constraint {flat!r} has no gradient there, so no force can hold it"
        remedy = "write it in such a way that its derivative is not zero where it holds"
    elif broken:
        what = f"the derivative of {broken[0]} is not finite"
        remedy = "check the expressions that act on it for a division by zero or a root of a negative number"
    elif method.series and any(switch.get("normal") for switch in system.switches):
        what = "no series leads on"
        remedy = "where a force is zero that friction is in proportion to, its magnitude has none: try --method dop853"
    elif method.series:
        what = "no series leads on"
        remedy = "a root or a power of what is zero has none: try --method dop853"
    elif method.adaptive:
        what = f"no step leads on, however small; {fastest(system, arrays)} changes fastest"
        remedy = "look for a singularity of the model there"
    else:
        what = f"the next step overflows; {fastest(system, arrays)} changes fastest"
        remedy = f"try a smaller --step than {arrays.control[at.H]:.3g} s, or --method auto"
    return f"The motion became infinite or undefined at {when}: {what}; {remedy}."


def _constraint_without_gradient(system: System, arrays: LoopArrays) -> str | None:
    if not system.m:
        return None
    jacobian = system.kernel("constraint_jacobian")(arrays.t, arrays.y[: system.nq + system.nv], arrays.p)
    sizes = np.abs(jacobian.reshape(system.m, system.nv)).max(axis=1)
    flat = np.flatnonzero(sizes < _NO_GRADIENT)
    return system.constraints[flat[0]]["name"] if flat.size else None


def state_names(system: System) -> list[str]:
    """Return the names of (q, v)."""
    names = [r["name"] for r in system.coordinates]
    for i in system.integrals:
        names[i] = f"the integral of {names[i].removesuffix('_integral')}"
    return names + rate_labels(system.coordinates, system.rates)


def fastest(system: System, arrays: LoopArrays) -> str:
    """Return the coordinate or rate that changes fastest for its size, quoted."""
    names = state_names(system)
    y, f = arrays.y[: len(names)], _row(system, arrays)[: len(names)]
    with np.errstate(invalid="ignore", over="ignore"):
        speed = np.abs(f) / (arrays.control[at.ATOL] + arrays.control[at.RTOL] * np.abs(y) + 1e-300)
    speed = np.where(np.isnan(speed), np.inf, speed)
    return repr(names[int(np.argmax(speed))])


def worst_constraint(system: System, arrays: LoopArrays) -> str:
    """Return the name of the constraint with the largest residual."""
    residual = np.abs(
        system.kernel("constraint_residual")(arrays.t, arrays.y[: system.nq + system.nv], arrays.p)
    )
    index = int(np.argmax(np.where(np.isnan(residual), np.inf, residual)))
    index = index if index < system.nh else index - system.nh
    return system.constraints[index]["name"]


def _beyond_digits(system: System, arrays: LoopArrays) -> float:
    """Return how large rates become in the step that failed, 0 where the tolerances leave them enough digits."""
    control, nq, n = arrays.control, system.nq, system.nq + system.nv
    rates, changes = np.abs(arrays.y[nq:n]), np.abs(_row(system, arrays)[nq:n])
    large = float((rates + float(control[at.H]) * changes).max(initial=0.0))
    asked = _OF_TOLERANCE * (
        float(control[at.ATOL]) + float(control[at.RTOL]) * float(rates.max(initial=0.0))
    )
    return large if np.isfinite(large) and asked < np.finfo(float).eps * large else 0.0


def _row(system: System, arrays: LoopArrays) -> np.ndarray:
    return system.kernel("rhs")(arrays.t, arrays.y[: system.nq + system.nv], arrays.p)
