"""Ready controllers of robots: computed torque, gravity compensation, impedance at a frame, linear-quadratic.

Each returns what `system.run(inputs=…)` takes: one `Controller` for all inputs that drive the robot. Without `period`
they act at every instant, as machine code with the model's own functions in it; with one they are sampled.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import nearest
from symgen.runtime.inputs.controller import Controller
from symgen.runtime.inputs.given import InputFault
from symgen.runtime.inputs.trajectory import Trajectory
from symgen.runtime.lazy import Late
from symgen.runtime.names import rate_labels

if TYPE_CHECKING:
    from symgen.runtime.options import Quantity
    from symgen.runtime.system import System

numba = Late("numba")
linalg = Late("scipy.linalg")

Inputs = dict[tuple[str, ...], Controller]
_SAME = 1e-9  # of the largest effect of an input: what differs by less is round-off


def computed_torque(
    system: System,
    path: Trajectory | Sequence[float],
    stiffness: Any,
    damping: Any,
    *,
    parameters: Mapping[str, Quantity] | None = None,
    period: float | None = None,
) -> Inputs:
    """Let errors e of all coordinates obey e'' + damping e' + stiffness e = 0, whatever the robot's inertia.

    u = B⁺ inverse_dynamics(q, v, a_wanted + damping (v_wanted - v) + stiffness (q_wanted - q)): Siciliano, Sciavicco,
    Villani, Oriolo, Robotics (2009), section 8.5.2.

    Parameters
    ----------
    system : System
        With robot functions, `inverse_dynamics` among them: `symgen.load(file, functions="robot")`.
    path : Trajectory or sequence of float
        A coordinate for each of the model's, in its order; or one position.
    stiffness : float or array_like, shape (nv,) [1/s²]
    damping : float or array_like, shape (nv,) [1/s]
        2 sqrt(stiffness) is critical.
    parameters : mapping of str to float or str, optional
        What the controller takes for the robot's parameters; give the run's, or others to see what errors do.
    period : float, optional [s]

    Raises
    ------
    InputFault
        The inputs do not drive every rate, or the robot has loops or quaternions.
    """
    drive, law = _drive(system, parameters), _function(system, "inverse_dynamics")
    wanted, p, n = _reference(system, path), system.parameter_values(parameters), system.nv
    kp, kd, gains = _gains("stiffness", stiffness, n), _gains("damping", damping, n), drive.gains

    def control(t, x):
        q, v = x[:n], x[n:]
        q_wanted, v_wanted, a_wanted = wanted(t)
        y, out = np.empty(3 * n), np.zeros(n)
        y[: 2 * n] = x
        y[2 * n :] = a_wanted + kd * (v_wanted - v) + kp * (q_wanted - q)
        law(t, y, p, out)
        return gains @ out

    return drive.inputs(control, period)


def gravity_compensation(
    system: System,
    path: Trajectory | Sequence[float],
    stiffness: Any,
    damping: Any,
    *,
    parameters: Mapping[str, Quantity] | None = None,
    period: float | None = None,
) -> Inputs:
    """Carry the robot's weight and springs, and pull it to where it is wanted by springs and dampers.

    u = B⁺ (gravity(q) + damping (v_wanted - v) + stiffness (q_wanted - q)): Siciliano et al. (2009), section 8.5.1.

    Parameters
    ----------
    system, path, parameters, period
        As for `computed_torque`; `gravity` is what it calls.
    stiffness : float or array_like, shape (nv,) [N/m, N m/rad]
    damping : float or array_like, shape (nv,) [N s/m, N m s/rad]

    Raises
    ------
    InputFault
        As `computed_torque`.
    """
    drive, weight = _drive(system, parameters), _function(system, "gravity")
    wanted, p, n = _reference(system, path), system.parameter_values(parameters), system.nv
    kp, kd, gains = _gains("stiffness", stiffness, n), _gains("damping", damping, n), drive.gains

    def control(t, x):
        q_wanted, v_wanted, _ = wanted(t)
        out = np.zeros(n)
        weight(t, x, p, out)
        return gains @ (out + kd * (v_wanted - x[n:]) + kp * (q_wanted - x[:n]))

    return drive.inputs(control, period)


def impedance(
    system: System,
    frame: str,
    position: Sequence[float],
    stiffness: Any,
    damping: Any,
    *,
    rotation: Any = None,
    turning_stiffness: Any = 0.0,
    turning_damping: Any = 0.0,
    joint_damping: Any = 0.0,
    parameters: Mapping[str, Quantity] | None = None,
    period: float | None = None,
) -> Inputs:
    """Let a frame behave as if springs and dampers held it in space, with the robot's weight carried.

    u = B⁺ (gravity(q) + Jᵀ w - joint_damping v), w = (stiffness (x_wanted - x) - damping x', turning_stiffness r -
    turning_damping ω), r the rotation vector from the frame to what is wanted: Hogan, Impedance Control (1985), II.

    Parameters
    ----------
    system, parameters, period
        As for `computed_torque`; `gravity` and the functions of `frame` are what it calls.
    frame : str
        One that the robot functions were derived with (`frames=[…]`).
    position : sequence of 3 floats [m]
    stiffness, damping : float or array_like, shape (3,) [N/m, N s/m]
        Along the world's axes.
    rotation : array_like, shape (3, 3), optional
        From the frame's axes to the world's, as `forward_kinematics` gives it.
    turning_stiffness, turning_damping : float or array_like, shape (3,) [N m/rad, N m s/rad]
    joint_damping : float or array_like, shape (nv,) [N s/m, N m s/rad]
        Of all rates: a robot with more joints than the frame has directions moves freely without.

    Raises
    ------
    InputFault
        As `computed_torque`, or the frame was not derived, or `rotation` is none.
    """
    robot = system.robot
    if frame not in robot.frames:
        raise InputFault(
            f"robot {robot.name!r} was derived without the frame {frame!r:.60}: {nearest(frame, robot.frames)}; "
            "name it among `frames`"
        )
    drive = _drive(system, parameters)
    weight, pose, jacobian = (
        _function(system, name) for name in ("gravity", f"pose_{frame}", f"jacobian_{frame}")
    )
    p, n, gains = system.parameter_values(parameters), system.nv, drive.gains
    place, target = _gains("position", position, 3, signed=True), _rotation(rotation)
    spring = np.concatenate(
        [_gains("stiffness", stiffness, 3), _gains("turning_stiffness", turning_stiffness, 3)]
    )
    damper = np.concatenate([_gains("damping", damping, 3), _gains("turning_damping", turning_damping, 3)])
    brake = _gains("joint_damping", joint_damping, n)

    def control(t, x):
        out, at, rows, error = np.zeros(n), np.zeros(12), np.zeros(6 * n), np.zeros(6)
        weight(t, x, p, out)
        pose(t, x, p, at)
        jacobian(t, x, p, rows)
        J = rows.reshape((6, n))
        error[:3] = place - at[:3]
        R = target @ at[3:].copy().reshape((3, 3)).T
        half = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        sine = np.sqrt((half * half).sum())
        angle = np.arctan2(sine, 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0))
        error[3:] = half * (angle / sine) if sine > 1e-9 else half
        push = spring * error - damper * (J @ x[n:])
        return gains @ (out + J.T @ push - brake * x[n:])

    return drive.inputs(control, period)


def regulator(
    system: System,
    state_weights: Any,
    input_weights: Any,
    *,
    at: Mapping[str, float] | None = None,
    parameters: Mapping[str, Quantity] | None = None,
    period: float | None = None,
) -> Inputs:
    """Hold a state of rest by u = u₀ - K (x - x₀), which minimises the integral of xᵀ Q x + uᵀ R u near it.

    K = R⁻¹ Bᵀ P with P from the algebraic Riccati equation: Anderson and Moore, Optimal Control (1990), section 3.1.
    u₀ are the least inputs that hold it there. Not every rate needs an input.

    Parameters
    ----------
    system : System
        Robot functions are not needed.
    state_weights : array_like, shape (2 nv,) or (2 nv, 2 nv)
        Q, or its diagonal: coordinates, then rates.
    input_weights : float or array_like, shape (n_u,) or (n_u, n_u)
        R, or its diagonal, of the inputs that drive the robot, in the order of the model.
    at : mapping of str to float, optional
        The coordinates' values; the model's start for all that are left out.
    parameters, period
        As for `computed_torque`.

    Raises
    ------
    InputFault
        No inputs hold it there, they cannot stabilise it, or weights do not fit.
    """
    drive, n = _drive(system, parameters, every=False), system.nv
    q0 = np.array(system.initial_state()[0], dtype=float)
    names = [record["name"] for record in system.coordinates]
    for name, value in (at or {}).items():
        if name not in names:
            raise InputFault(f"{name!r} is no coordinate of model {system.name!r}: {nearest(name, names)}")
        q0[names.index(name)] = value
    held, x0 = drive.at_rest(q0), np.concatenate([q0, np.zeros(n)])
    given = {**(parameters or {}), **dict(zip(drive.names, map(float, held), strict=True))}
    linear = system.linearise(at=(q0, np.zeros(n)), parameters=given)
    columns = [record["name"] for record in system.inputs]
    B = linear.B[:, [columns.index(name) for name in drive.names]]
    Q, R = (
        _weights("state_weights", state_weights, 2 * n),
        _weights("input_weights", input_weights, B.shape[1]),
    )
    try:
        riccati = linalg.solve_continuous_are(linear.A, B, Q, R)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InputFault(f"no linear-quadratic regulator there: {error}") from None
    gains = np.linalg.solve(R, B.T @ riccati)

    def control(t, x):
        return held - gains @ (x - x0)

    return drive.inputs(control, period)


class _Drive:
    """How inputs drive the rates: forces along them are B u, `gains` is B⁺, shape (n_u, nv)."""

    def __init__(self, system: System, p: np.ndarray, names: tuple[str, ...], matrix: np.ndarray):
        self.system, self.p, self.names, self.matrix = system, p, names, matrix
        self.gains = np.ascontiguousarray(np.linalg.pinv(matrix))

    def at_rest(self, q: np.ndarray) -> np.ndarray:
        """Return the least inputs that hold a position."""
        pull = self.system.kernel("forces")(0.0, np.concatenate([q, np.zeros(self.system.nv)]), self.p)
        held = -self.gains @ pull
        left = pull + self.matrix @ held
        if np.abs(left).max() > 1e-6 * max(np.abs(pull).max(), 1e-6):
            rate = self.system.rates[int(np.abs(left).argmax())]["name"]
            raise InputFault(
                f"the inputs {', '.join(self.names)} cannot hold it at rest there: {rate!r} is pulled by "
                f"{np.abs(left).max():.4g}"
            )
        return held

    def inputs(self, control: Callable, period: float | None) -> Inputs:
        """Return the controller as an argument of runs."""
        system = self.system
        reads = [record["name"] for record in system.coordinates] + rate_labels(
            system.coordinates, system.rates
        )
        one = len(self.names) == 1
        law = numba.njit(control)
        number = numba.njit(lambda t, x: law(t, x)[0]) if one else law
        return {self.names: Controller(number, period=period, reads=reads)}


def _drive(system: System, parameters: Mapping[str, Quantity] | None, *, every: bool = True) -> _Drive:
    """Find how inputs drive the rates: by constants, or it is refused."""
    if system.m or system.nq != system.nv or system.integrals:
        what = (
            "constraints" if system.m else "quaternions" if system.nq != system.nv else "first-order states"
        )
        raise InputFault(f"model {system.name!r} has {what}: ready controllers are for robots without")
    p, n = system.parameter_values(parameters), system.nv
    first = len(system.parameters)
    q0, rng = np.array(system.initial_state()[0], dtype=float), np.random.default_rng(0)
    states = [
        np.concatenate([q0, np.zeros(n)]),
        *(np.append(q0, np.zeros(n)) + 0.3 * rng.normal(size=2 * n) for _ in "ab"),
    ]
    forces = system.kernel("forces")
    found = []
    for y in states:
        columns = []
        for k in range(len(system.inputs)):
            ends = []
            for u in (0.0, 1.0):
                moved = p.copy()
                moved[first : first + len(system.inputs)] = 0.0
                moved[first + k] = u
                ends.append(forces(0.0, y, moved))
            columns.append(ends[1] - ends[0])
        found.append(np.array(columns).reshape(-1, n).T)
    matrix = found[0]
    for k, record in enumerate(system.inputs):
        if any(
            np.abs(other[:, k] - matrix[:, k]).max() > 1e-6 * np.abs(matrix[:, k]).max() for other in found
        ):
            raise InputFault(
                f"what the input {record['name']!r} does depends on the state: ready controllers need constants"
            )
    kept = [k for k in range(matrix.shape[1]) if matrix[:, k].any()]
    names = tuple(system.inputs[k]["name"] for k in kept)
    matrix = matrix[:, kept]
    if not kept or (every and np.linalg.matrix_rank(matrix) < n):
        idle = [r["name"] for r, row in zip(system.rates, matrix) if not row.any()]
        which = f": nothing drives {', '.join(idle[:5])}" if idle else ""
        raise InputFault(f"the inputs of model {system.name!r} do not drive every rate{which}")
    return _Drive(system, np.where(np.arange(len(p)) < first, p, 0.0), names, matrix)


def _function(system: System, name: str) -> Callable:
    return system.robot.numba(name)


def _reference(system: System, path: Trajectory | Sequence[float]) -> Callable:
    """Return jitted t -> positions, rates, accelerations that are wanted."""
    n = system.nv
    if not isinstance(path, Trajectory):
        place, still = _gains("the position that is wanted", path, n, signed=True), np.zeros(n)
        return numba.njit(lambda t: (place, still, still))
    if path.coefficients.shape[2] != n:
        raise InputFault(
            f"a path of {path.coefficients.shape[2]} coordinates for {n} of model {system.name!r}"
        )
    knots, coefficients = path.knots, path.coefficients

    def wanted(t):
        inside = min(max(t, knots[0]), knots[-1])
        piece = min(np.searchsorted(knots, inside, side="right"), len(knots) - 1) - 1
        since, found = inside - knots[piece], np.zeros((3, n))
        for j in range(5, -1, -1):
            found[2] = found[2] * since + found[1]
            found[1] = found[1] * since + found[0]
            found[0] = found[0] * since + coefficients[piece, j]
        if inside != t:
            found[1:] = 0.0
        return found[0], found[1], 2.0 * found[2]

    return numba.njit(wanted)


def _gains(what: str, values: Any, n: int, *, signed: bool = False) -> np.ndarray:
    try:
        found = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputFault(f"{what}: give a number, or {n}") from None
    if found.shape not in ((n,), *(() if signed else ((),))) or not np.isfinite(found).all():
        raise InputFault(f"{what}: give {'' if signed else 'a number, or '}{n} finite numbers")
    if not signed and (found < 0.0).any():
        raise InputFault(f"{what} is negative: it would drive the robot away")
    return np.ascontiguousarray(np.broadcast_to(found, (n,)))


def _weights(what: str, values: Any, n: int) -> np.ndarray:
    found = np.array(values, dtype=float)
    if found.shape == (n, n):
        return found
    return np.diag(_gains(what, found, n))


def _rotation(given: Any) -> np.ndarray:
    if given is None:
        return np.eye(3)
    found = np.array(given, dtype=float)
    if (
        found.shape != (3, 3)
        or not np.abs(found @ found.T - np.eye(3)).max() < 1e-6
        or np.linalg.det(found) < 0.0
    ):
        raise InputFault("rotation is no rotation matrix of shape (3, 3)")
    return np.ascontiguousarray(found)
