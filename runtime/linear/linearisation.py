"""Linearisation of a model about a state, with exact derivatives, reduced to independent coordinates and rates.

Small motions about a state: displacements, rates and accelerations from independent ones and inputs.

What is seen of small motions: coordinates, rates, accelerations and outputs.

Which coordinates and rates are independent, and how the others follow from them, to first order.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symgen.runtime.code import dense_ldl, front_ldl
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.constraints.start_conditions import with_found
from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.graph.carry_out import carry_out
from symgen.runtime.graph.functions import IN_CODE, sign, slopes
from symgen.runtime.inputs.given import from_record
from symgen.runtime.linear.equilibrium import MotionEquations, find_equilibrium
from symgen.runtime.linear.model import LinearModel
from symgen.runtime.names import acceleration_labels, inside_dot, motion_records, rate_indices, rate_labels
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from collections.abc import Callable

    from symgen.runtime.graph.form import Form
    from symgen.runtime.options import Quantity
    from symgen.runtime.system import System


# Forward mode: Griewank, Walther, Evaluating Derivatives, 2nd ed. (2008), chapter 3.


class Dual:
    """A number and its derivatives along some directions."""

    __slots__ = ("slope", "value")

    def __init__(self, value: float, slope: np.ndarray):
        self.value, self.slope = value, slope

    def __add__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.slope + other.slope)
        return Dual(self.value + other, self.slope)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Number) -> Dual:
        return self + (-other)

    def __rsub__(self, other: float) -> Dual:
        return Dual(other - self.value, -self.slope)

    def __mul__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value * other.value, _share(other, self.slope) + _share(self, other.slope))
        return Dual(self.value * other, _share(other, self.slope))

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            value = self.value / other.value
            return Dual(value, (self.slope - value * other.slope) / other.value)
        return Dual(self.value / other, self.slope / other)

    def __rtruediv__(self, other: float) -> Dual:
        value = other / self.value
        return Dual(value, -value / self.value * self.slope)

    def __lt__(self, other: Number) -> bool:
        return self.value < _value(other)

    def __le__(self, other: Number) -> bool:
        return self.value <= _value(other)

    def __gt__(self, other: Number) -> bool:
        return self.value > _value(other)

    def __ge__(self, other: Number) -> bool:
        return self.value >= _value(other)


Number = Dual | float


def _share(factor: Number, slope: np.ndarray) -> np.ndarray:
    """Return a factor times the slope of the other one: 0 where the factor is 0 and differentiable.

    The slope may be infinite, that of a root at 0; the product x sqrt(x) has one all the same.
    """
    value = _value(factor)
    if value == 0.0 and not (isinstance(factor, Dual) and np.isinf(factor.slope).any()):
        return np.zeros_like(slope)
    return slope * value


def derivatives(
    system: System,
    function: str,
    t: float,
    y: np.ndarray,
    p: np.ndarray,
    along_y: np.ndarray,
    along_p: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return a function of the model and its derivatives along directions, exact but for round-off.

    Parameters
    ----------
    function : str
        See docs/abi.md.
    t : float [s]
    y, p : ndarray
        Where to evaluate it.
    along_y, along_p : ndarray, shape (len(y), k) and (len(p), k)
        The directions.

    Returns
    -------
    values : ndarray, shape (n,)
    slopes : ndarray, shape (n, k)

    Raises
    ------
    RuntimeModelError
        It has no value or no derivative there.
    """
    form = system.form(function)
    with np.errstate(all="ignore"):
        try:
            out = carried_out(form, float(t), _seeded(y, along_y), _seeded(p, along_p))
        except (ArithmeticError, ValueError):
            out = [math.nan]
    values = np.array([_value(x) for x in out])
    none = np.zeros(along_y.shape[1])
    slopes = np.array([x.slope if isinstance(x, Dual) else none for x in out]).reshape(len(out), len(none))
    if not (np.isfinite(values).all() and np.isfinite(slopes).all()):
        raise RuntimeModelError(
            f"the function {function!r} of model {system.name!r} has no finite value or derivative at this state: "
            "choose another start, or another state to linearise about"
        )
    return values, slopes


def carried_out(form: Form, t: float, y: list[Number], p: list[Number]) -> list[Number]:
    """Return what a function writes for numbers of either kind."""
    out: list[Number] = [0.0] * form.lengths.out
    for place, value in carry_out(form, _Duals(t), y.__getitem__, p.__getitem__, solvers=_SOLVERS):
        out[place] = value
    return out


def _seeded(values: np.ndarray, along: np.ndarray) -> list[Number]:
    """Plain numbers stay plain where nothing moves them: work on these costs little."""
    return [Dual(x, row) if row.any() else x for x, row in zip(values.tolist(), along)]


def _value(x: Number) -> float:
    return x.value if isinstance(x, Dual) else x


class _Numbers:
    """The arithmetic of plain numbers, for derivatives of the table."""

    const = staticmethod(float)
    neg = staticmethod(operator.neg)
    add = staticmethod(operator.add)
    sub = staticmethod(operator.sub)
    mul = staticmethod(operator.mul)
    sign = staticmethod(sign)

    @staticmethod
    def call(name: str, *args: float) -> float:
        return IN_CODE[name].value(*args)


def _lifted(name: str) -> Callable[..., Number]:
    """Return a function of the table for both kinds of numbers."""
    function = IN_CODE[name].value

    def lifted(*args: Number) -> Number:
        values = [_value(x) for x in args]
        value = function(*values)
        found: Number = value
        if any(isinstance(x, Dual) and x.slope.any() for x in args):
            for x, (above, below) in zip(args, slopes(_Numbers, name, values, value), strict=True):
                if isinstance(x, Dual):
                    found = found + Dual(0.0, (above if below is None else above / below) * x.slope)
            return found
        return next((Dual(value, x.slope) for x in args if isinstance(x, Dual)), value)

    return lifted


class _RootOfZero(Dual):
    """A root at 0: its slope is infinite along what moves what is below it, that of its square is not."""

    __slots__ = ("below",)

    def __init__(self, below: np.ndarray):
        super().__init__(0.0, _infinite(below))
        self.below = below

    def __mul__(self, other: Number) -> Dual:
        return Dual(0.0, self.below) if other is self else super().__mul__(other)


def _infinite(along: np.ndarray) -> np.ndarray:
    return np.where(along == 0.0, 0.0, math.inf)


def _sqrt(x: Number) -> Number:
    return _RootOfZero(x.slope) if isinstance(x, Dual) and x.value == 0.0 else _smooth_sqrt(x)


def _pow(base: Number, exponent: Number) -> Number:
    x, n = _value(base), _value(exponent)
    value = math.pow(x, n)
    result: Number = value
    if isinstance(base, Dual):
        if x == 0.0 and 0.0 < n < 1.0:
            result = Dual(value, _infinite(base.slope))
        else:
            result = Dual(value, (n * math.pow(x, n - 1.0) if n else 0.0) * base.slope)
    if isinstance(exponent, Dual):
        result = result + Dual(0.0, (value * math.log(x) if value else 0.0) * exponent.slope)
    return result


def _copysign(size: Number, sign: Number) -> Number:
    value = math.copysign(_value(size), _value(sign))
    if not isinstance(size, Dual):
        return value
    return Dual(
        value, size.slope if math.copysign(1.0, size.value) == math.copysign(1.0, value) else -size.slope
    )


class _Duals:
    """The operations of a form on numbers of both kinds."""

    neg = staticmethod(operator.neg)
    add = staticmethod(operator.add)
    sub = staticmethod(operator.sub)
    mul = staticmethod(operator.mul)
    div = staticmethod(operator.truediv)

    def __init__(self, t: float):
        self.time = lambda: t

    @staticmethod
    def call(name: str, *args: Number) -> Number:
        return _MATHEMATICS[name](*args)

    @staticmethod
    def decide(is_strict: bool, a: Number, b: Number) -> bool:
        return a < b if is_strict else a <= b


# Roots and powers at 0, and `copysign` of a sign that stays, have derivatives where those of the table have none.
_smooth_sqrt = _lifted("sqrt")
_MATHEMATICS = {name: _lifted(name) for name in IN_CODE} | {"pow": _pow, "sqrt": _sqrt, "copysign": _copysign}
_SOLVERS = {name: getattr(solvers, name) for solvers in (dense_ldl, front_ldl) for name in solvers.SOLVERS}


_RANK_TOLERANCE = 1e-9  # of a row of unit length
_PREFERENCE = 8.0  # by how much a guess is rather made dependent than a value that the user gave


class Independent(NamedTuple):
    """Independent small motions.

    Attributes
    ----------
    positions, rates : ndarray of int
        Which of what rates move, and which rates, are independent.
    position_basis : ndarray, shape (nv, number of positions)
        All small displacements, from the independent ones.
    rates_by_positions, rates_by_rates : ndarray, shape (nv, …)
        All small changes of rates, from independent displacements and rates.
    """

    positions: np.ndarray
    rates: np.ndarray
    position_basis: np.ndarray
    rates_by_positions: np.ndarray
    rates_by_rates: np.ndarray


def independent_motions(
    jacobian: np.ndarray,
    by_positions: np.ndarray,
    n_holonomic: int,
    sizes: np.ndarray,
    given: tuple[np.ndarray, np.ndarray],
    states: tuple[int, ...] = (),
) -> Independent:
    """Choose independent coordinates by pivots, so that each keeps its name, and solve for the others.

    Small motions (δ, ν) satisfy G₁ δ = 0 for the holonomic rows G₁ of G, and G ν + H δ = 0: velocity constraints
    bind rates alone, so there may be more independent positions than rates.

    Parameters
    ----------
    jacobian, by_positions : ndarray, shape (m, nv)
        G and H; holonomic rows first.
    n_holonomic : int
    sizes : ndarray, shape (nv,)
        What counts as large for each coordinate.
    given : pair of ndarray of bool, shape (nv,)
        Positions and rates that the user gave rather than guessed: these stay independent where the choice is free.
    states : tuple of int
        Rates that are first-order states: nothing binds them, and what they are the rates of is no position.
    """
    nv = jacobian.shape[1]
    scaled = jacobian * sizes
    scaled[:, list(states)] = 0.0
    bound, rows = _pivots(scaled * np.where(given[0], 1.0, _PREFERENCE), n_holonomic)
    bound_rates, all_rows = _pivots(scaled * np.where(given[1], 1.0, _PREFERENCE), len(scaled))
    positions = np.setdiff1d(np.arange(nv), [*bound, *states])
    rates = np.setdiff1d(np.arange(nv), bound_rates)
    basis = np.zeros((nv, len(positions)))
    basis[positions] = np.eye(len(positions))
    basis[bound] = _follow(jacobian[rows], bound, -jacobian[rows][:, positions])
    by_rates, by_places = np.zeros((nv, len(rates))), np.zeros((nv, len(positions)))
    by_rates[rates] = np.eye(len(rates))
    by_rates[bound_rates] = _follow(jacobian[all_rows], bound_rates, -jacobian[all_rows][:, rates])
    by_places[bound_rates] = _follow(jacobian[all_rows], bound_rates, -by_positions[all_rows] @ basis)
    return Independent(positions, rates, basis, by_places, by_rates)


def _pivots(matrix: np.ndarray, n_rows: int) -> tuple[list[int], list[int]]:
    """Return columns and rows of a largest regular block in the first rows.

    Gaussian elimination with complete pivoting; of equal candidates the last column becomes dependent.
    """
    work = matrix[:n_rows].copy()
    norms = np.linalg.norm(work, axis=1, keepdims=True)
    work = np.divide(work, norms, out=np.zeros_like(work), where=norms > 0.0)
    columns: list[int] = []
    rows: list[int] = []
    while work.size:
        left = np.abs(work[:, ::-1])
        left[rows] = 0.0
        row, back = np.unravel_index(np.argmax(left >= left.max() * (1.0 - 1e-12)), left.shape)
        if left[row, back] <= _RANK_TOLERANCE:
            break
        rows.append(int(row))
        columns.append(int(work.shape[1] - 1 - back))
        _eliminate(work, rows[-1], columns[-1])
    return columns, rows


def _eliminate(work: np.ndarray, row: int, column: int) -> None:
    factors = work[:, column] / work[row, column]
    factors[row] = 0.0
    work -= np.outer(factors, work[row])
    work[factors != 0.0, column] = 0.0


def _follow(rows: np.ndarray, bound: list[int], right: np.ndarray) -> np.ndarray:
    return np.linalg.solve(rows[:, bound], right) if bound else right


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
    reactions: np.ndarray
    reactions_by_inputs: np.ndarray
    A: np.ndarray
    B: np.ndarray

    def states(self, system: System) -> list[str]:
        """Return the names of x."""
        positions, rates = motion_names(system), rate_labels(system.coordinates, system.rates)
        chosen = self.independent
        return [positions[i] for i in chosen.positions] + [rates[i] for i in chosen.rates]

    def shape(self, system: System) -> np.ndarray:
        """Return what x brings with it: displacements, and the values of first-order states."""
        found, states = self.displacements.copy(), list(system.states)
        found[states] = self.rates[states]
        return found


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
    response = -equations.solve(by_unknowns, np.hstack([by_positions, by_rates, by_inputs]))
    independent = _independent(system, equations, q, v, given)
    n_positions = len(independent.positions)
    displacements = np.hstack([independent.position_basis, np.zeros((nv, len(independent.rates)))])
    rates = np.hstack([independent.rates_by_positions, independent.rates_by_rates])
    solved = response[:, :nv] @ displacements + response[:, nv : 2 * nv] @ rates
    accelerations, reactions = solved[:nv], solved[nv:]
    velocities = rates + equations.turning(v) @ displacements
    A = np.vstack([velocities[independent.positions], accelerations[independent.rates]])
    by_u, reactions_by_u = response[:nv, 2 * nv :], response[nv:, 2 * nv :]
    B = np.vstack([np.zeros((n_positions, by_u.shape[1])), by_u[independent.rates]])
    return Tangent(
        equations, q, v, a, multipliers, independent, displacements, rates, accelerations, by_u, reactions,
        reactions_by_u, A, B,
    )  # fmt: skip


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
        return independent_motions(np.zeros((0, nv)), np.zeros((0, nv)), 0, np.ones(nv), given, system.states)
    along = np.zeros((system.nq + nv, 2 * nv))
    along[: system.nq, :nv], along[system.nq :, nv:] = equations.kinematics(q), np.eye(nv)
    y, still = np.concatenate([q, v]), np.zeros((len(equations.p), 2 * nv))
    _, slopes = derivatives(system, "constraint_residual", equations.t, y, equations.p, along, still)
    by_positions, jacobian = slopes[nh:, :nv], slopes[nh:, nv:]
    sizes = Constraints(system, equations.p, equations.t).characteristic_sizes(q)
    return independent_motions(jacobian, by_positions, nh, sizes, given, system.states)


def motion_names(system: System) -> list[str]:
    """Return what rates move: coordinates, small rotations of quaternions by their rates; and states by their names."""
    names = {record["name"] for record in system.coordinates} | {
        system.rates[k]["name"] for k in system.states
    }
    return [r["name"] if r["name"] in names else _moved(system, k) for k, r in enumerate(system.rates)]


def _moved(system: System, k: int) -> str:
    """What a rate with a name of its own moves: a coordinate of another name, or it turns a quaternion."""
    turns = [place - number for number, place in enumerate(system.quaternions)]
    if any(j <= k < j + 3 for j in turns):
        return f"turn({system.rates[k]['name']})"
    return system.coordinates[k + sum(j + 3 <= k for j in turns)]["name"]


def observation(
    system: System, p: np.ndarray, tangent: Tangent, names: Sequence[str] | None
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return C, D and the names of y: those given, or all coordinates and outputs of the model.

    Raises
    ------
    RuntimeModelError
        There is no such coordinate, rate, acceleration or output.
    """
    equations, n_u = tangent.equations, tangent.B.shape[1]
    kinematics = equations.kinematics(tangent.q)
    known = dict(zip((record["name"] for record in system.coordinates), kinematics @ tangent.displacements))
    coordinates = [record["name"] for _, record in motion_records(system.coordinates, system.integrals)]
    coordinates += [system.rates[k]["name"] for k in system.states]
    own: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    if system.has("outputs"):
        own = _model_outputs(system, p, tangent, kinematics)
    labels = rate_labels(system.coordinates, system.rates)
    wanted = list(names) if names is not None else [*coordinates, *own]
    moving = {name: known[name] for name in coordinates if name in known} | dict(zip(labels, tangent.rates))
    steered = dict(zip(acceleration_labels(system.coordinates, system.rates), range(system.nv)))
    rows = []
    for name in wanted:
        if name in own:
            rows.append(own[name])
        elif name in moving:
            rows.append((moving[name], np.zeros(n_u)))
        elif name in steered:
            k = steered[name]
            rows.append((tangent.accelerations[k], tangent.accelerations_by_inputs[k]))
        else:
            everything = [*own, *moving, *steered]
            raise RuntimeModelError(
                f"model {system.name!r} has no output {name!r}: {nearest(name, everything)}"
            )
    n = len(tangent.A)
    C, D = (np.array([row[k] for row in rows]).reshape(len(rows), width) for k, width in ((0, n), (1, n_u)))
    return C, D, wanted


def _model_outputs(
    system: System, p: np.ndarray, tangent: Tangent, kinematics: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    n, n_u = len(tangent.A), tangent.B.shape[1]
    along = np.zeros((system.nq + system.nv, n + n_u))
    along[: system.nq, :n], along[system.nq :, :n] = kinematics @ tangent.displacements, tangent.rates
    along_p = np.zeros((len(p), n + n_u))
    along_p[len(system.parameters) + np.arange(n_u), n + np.arange(n_u)] = 1.0
    y = np.concatenate([tangent.q, tangent.v])
    if system.sensed:
        if system.switches:
            raise RuntimeModelError(
                f"outputs of model {system.name!r} need reactions, which stops and friction switch: name other outputs"
            )
        y = np.concatenate([y, tangent.a, tangent.multipliers])
        solved = np.hstack([tangent.accelerations, tangent.accelerations_by_inputs])
        reactions = np.hstack([tangent.reactions, tangent.reactions_by_inputs])
        along = np.vstack([along, solved, reactions])
    _, slopes = derivatives(system, "outputs", tangent.equations.t, y, p, along, along_p)
    return {record["name"]: (row[:n], row[n:]) for record, row in zip(system.outputs, slopes)}


_STILL = 1e-9  # of characteristic sizes per second: rates and accelerations that are none
_STEADY = 1e-6  # change of A over a step along the motion, of its size
_CLOSED = 1e-6  # of a constraint's scale: what a state may be off
_FLOW_STEP = 1e-3  # of the time in which the state moves by its size


def linearise(
    system: System,
    at: str | tuple[Sequence[float], Sequence[float]] = "equilibrium",
    *,
    parameters: Mapping[str, Quantity] | None = None,
    start: Mapping[str, Quantity] | None = None,
    rate: Mapping[str, Quantity] | None = None,
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
    parameters : mapping of str to float or str, optional
        Values of parameters and inputs. An input over time has its value at `t`.
    start, rate : mapping of str to float or str, optional
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
    p, found = with_found(system, p, {*(parameters or {})}, start, rate, t)
    q, v, notes = _state(system, p, at, start, rate, t, stable)
    notes = [*found, *notes]
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
        tangent.shape(system), _sizes(system, p, t, q), notes,
    )  # fmt: skip


def _sizes(system: System, p: np.ndarray, t: float, q: np.ndarray) -> np.ndarray:
    """What counts as large for each motion; first-order states have no size beside them."""
    sizes = Constraints(system, p, t).characteristic_sizes(q)
    sizes[list(system.states)] = np.inf
    return sizes


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
    found = find_equilibrium(system, p, assembled.q, t, stable, assembled.v)
    return found.q, found.v, list(assembled.notes)


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
    system: System, start: Mapping[str, Quantity], rate: Mapping[str, Quantity]
) -> tuple[np.ndarray, np.ndarray]:
    """Return which displacements and rates the model or the user gives, rather than guesses."""
    _, _, enforced, rates = system.initial_state()
    enforced = enforced | np.array([record["name"] in start for record in system.coordinates], dtype=bool)
    places = rate_indices(system.coordinates, system.rates, system.quaternions)
    rates[[places[inside_dot(name)] for name in rate]] = True
    return Positions(system).held(enforced), rates


def _inputs_at(system: System, t: float, said: Mapping[str, Quantity]) -> dict[str, float]:
    """Return the values at `t` of the model's own inputs over time."""
    moving = [r for r in system.inputs if ("table" in r or "polynomial" in r) and r["name"] not in said]
    if not moving:
        return {}
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
    moving = np.where(np.isin(np.arange(system.nv), system.states), 0.0, v)
    speed, change = (float(np.abs(x / sizes).max(initial=0.0)) for x in (moving, tangent.a))
    if speed <= _STILL and change <= _STILL * max(1.0, np.abs(tangent.A).max(initial=0.0)):
        return "equilibrium"
    h = _FLOW_STEP / max(speed, np.sqrt(change))
    later_q = tangent.equations.positions.retract(q, h * v + 0.5 * h * h * tangent.a)
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
