"""A model's functions for robot programs: at one state or at many, and as kernels for a user's own compiled code."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from symgen.runtime.code import stand_ins
from symgen.runtime.code.bridge import evaluate_rows
from symgen.runtime.errors import ModuleError, RuntimeModelError, UnknownNameError, nearest
from symgen.runtime.graph.layouts import BASE_PARAMETERS
from symgen.runtime.kernel import Kernel
from symgen.runtime.module import read_module
from symgen.runtime.module_source import ModuleSource
from symgen.runtime.options import Quantity
from symgen.runtime.system import System

Parameters = Mapping[str, Quantity] | np.ndarray | None


def load_robot(path_or_text: str | os.PathLike[str]) -> Robot:
    """Load a module with functions for robot programs from a file or its text.

    Raises
    ------
    symgen.runtime.errors.ModuleError
        It is not a module of this ABI, or has no such functions.
    """
    source = read_module(path_or_text)
    if "robot" not in source.header:
        raise ModuleError(
            source.file, "", "it has no functions for robot programs", "derive it with --functions robot"
        )
    return Robot(source)


class Robot:
    """Inverse and forward dynamics, frames, momenta and equilibria of a model, each a generated function.

    Positions q have `nq` numbers, rates v, accelerations a and forces tau `nv`, in the order of the model; angular
    rates of free and spherical joints are in body axes, velocities of free joints in world axes. All arguments may have
    leading axes, which results keep: arrays of shape (n, nq) give arrays of n results. Forces of the model's inputs, of
    dry friction and of stops are left out; springs and damping belong to the model. Derivatives by positions are by
    displacements along the rates. Vectors are in world axes, linear components before angular ones.

    Each method takes `parameters`: values by name, or an array `p` as `System.parameter_values` gives it; the model's
    own by default.

    Attributes
    ----------
    nq, nv : int
    coordinates, rates : tuple of str
        Names, in order.
    functions : tuple of str
        What was derived: names for `kernel` and `numba`.
    frames, actuators : tuple of str
    base_parameters : tuple of str
        Names of the regressor's columns: rate and leading inertial parameter.
    """

    def __init__(self, source: ModuleSource) -> None:
        system, made = System(source), source.header["robot"]
        self._system = system
        self.name, self.nq, self.nv = system.name, system.nq, system.nv
        self.coordinates = tuple(record["name"] for record in system.coordinates)
        self.rates = tuple(record["name"] for record in system.rates)
        self.functions = tuple(made["functions"])
        self.frames, self.actuators = tuple(made["frames"]), tuple(made["actuators"])
        self.base_parameters = tuple(made["base_parameters"])

    def __reduce__(self):
        return Robot, (self._system.source,)

    def __repr__(self) -> str:
        return f"<Robot {self.name!r}: {self.nv} rates, {len(self.functions)} functions>"

    def kernel(self, function: str) -> Kernel:
        """Return a function as machine code, `f(t, y, p)`: y is q, v, and for dynamics a or tau behind."""
        self._known(function)
        return self._kernel(function)

    def _kernel(self, function: str) -> Kernel:
        """Return a function as machine code that stays what it is: a control loop must not wait for LLVM."""
        with stand_ins.avoided():
            return self._system.kernel(function)

    def numba(self, function: str) -> Callable:
        """Return `f(t, y, p, out)` for calls from your own `numba.njit` code; lengths are checked.

        Matrices do not write their structural zeros: make `out` with `numpy.zeros`.
        """
        self._known(function)
        return self._system.numba(function)

    def parameter_values(self, overrides: Mapping[str, Quantity] | None = None) -> np.ndarray:
        """Return `p`: the model's parameters and inputs, some of them with other values."""
        return self._system.parameter_values(overrides)

    def precomputed(self, parameters: Parameters = None) -> np.ndarray:
        """Return `p` with all that depends on it alone behind it, for the kernels' `precomputed_address`."""
        return self._system.precomputed(self._values(parameters))

    # Dynamics

    def inverse_dynamics(self, q: Any, v: Any, a: Any, parameters: Parameters = None) -> np.ndarray:
        """Return the forces along the rates [N, N m] that accelerations a take: M a + h.

        Loops are open: forces of constraints are part of what is returned.
        """
        return self._evaluate("inverse_dynamics", (q, v, a), parameters)

    def inverse_dynamics_derivatives(
        self, q: Any, v: Any, a: Any, parameters: Parameters = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of `inverse_dynamics` by displacements and by rates; that by a is M."""
        rows = self._evaluate("inverse_dynamics_derivatives", (q, v, a), parameters)
        rows = rows.reshape(*rows.shape[:-1], self.nv, 2, self.nv)
        return rows[..., 0, :], rows[..., 1, :]

    def forward_dynamics(self, q: Any, v: Any, tau: Any, parameters: Parameters = None) -> np.ndarray:
        """Return the accelerations that forces tau along the rates give, with all constraints."""
        return self._evaluate("forward_dynamics", (q, v, tau), parameters)

    def forward_dynamics_derivatives(
        self, q: Any, v: Any, tau: Any, parameters: Parameters = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the derivatives of `forward_dynamics` by displacements, by rates and by tau (the inverse of M)."""
        rows = self._evaluate("forward_dynamics_derivatives", (q, v, tau), parameters)
        rows = rows.reshape(*rows.shape[:-1], self.nv, 3, self.nv)
        return rows[..., 0, :], rows[..., 1, :], rows[..., 2, :]

    def mass_matrix(self, q: Any, parameters: Parameters = None) -> np.ndarray:
        """Return M, shape (..., nv, nv)."""
        return self._matrix("mass_matrix", self.nv, (q,), parameters)

    def coriolis(self, q: Any, v: Any, parameters: Parameters = None) -> np.ndarray:
        """Return C, shape (..., nv, nv), with centrifugal and Coriolis forces C v, and dM/dt = C + Cᵀ."""
        return self._matrix("coriolis_matrix", self.nv, (q, v), parameters)

    def gravity(self, q: Any, parameters: Parameters = None) -> np.ndarray:
        """Return the forces along the rates that hold the robot at rest: of weight and springs."""
        return self._evaluate("gravity", (q,), parameters)

    def energy(self, q: Any, v: Any, parameters: Parameters = None) -> tuple[np.ndarray, np.ndarray]:
        """Return kinetic and potential energy [J]."""
        rows = self._evaluate("energy", (q, v), parameters)
        return rows[..., 0], rows[..., 1]

    # The robot as a whole

    def centre_of_mass(self, q: Any, parameters: Parameters = None) -> np.ndarray:
        """Return the centre of mass of the bodies that move [m], shape (..., 3)."""
        return self._evaluate("centre_of_mass", (q,), parameters)

    def momentum(self, q: Any, v: Any, parameters: Parameters = None) -> np.ndarray:
        """Return the momentum, and the angular momentum about the centre of mass, shape (..., 6)."""
        return self._evaluate("momentum", (q, v), parameters)

    def momentum_matrix(self, q: Any, parameters: Parameters = None) -> np.ndarray:
        """Return the centroidal momentum matrix, shape (..., 6, nv): `momentum` is it times v."""
        return self._matrix("momentum_matrix", 6, (q,), parameters)

    # Identification

    def regressor(self, q: Any, v: Any, a: Any, parameters: Parameters = None) -> np.ndarray:
        """Return Y, shape (..., nv, n): forces of inertia and gravity are Y times `base_parameter_values`."""
        return self._matrix("regressor", self.nv, (q, v, a), parameters)

    def base_parameter_values(self, parameters: Parameters = None) -> np.ndarray:
        """Return the least set of inertial parameters that motions can tell apart, shape (n,)."""
        return self._evaluate(BASE_PARAMETERS, (np.zeros(self.nq),), parameters)

    # Equilibria

    def equilibrium_torques(self, q: Any, parameters: Parameters = None) -> np.ndarray:
        """Return the least inputs, in the order of `actuators`, that hold it at rest; loops carry what they can.

        Raises
        ------
        RuntimeModelError
            The actuators cannot hold it at one of the positions.
        """
        found = self._evaluate("equilibrium_torques", (q,), parameters)
        if not np.isfinite(found).all():
            raise RuntimeModelError(
                f"the actuators {', '.join(self.actuators)} of {self.name!r} cannot hold it at rest there"
            )
        return found

    # Frames

    def forward_kinematics(
        self, frame: str, q: Any, parameters: Parameters = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return a frame's origin [m], shape (..., 3), and its rotation matrix to world axes, (..., 3, 3)."""
        rows = self._evaluate(self._of_frame("pose_", frame), (q,), parameters)
        return rows[..., :3], rows[..., 3:].reshape(*rows.shape[:-1], 3, 3)

    def jacobian(self, frame: str, q: Any, parameters: Parameters = None) -> np.ndarray:
        """Return J, shape (..., 6, nv): velocity of the frame's origin, then angular velocity, in world axes."""
        return self._matrix(self._of_frame("jacobian_", frame), 6, (q,), parameters)

    def jacobian_rate(self, frame: str, q: Any, v: Any, parameters: Parameters = None) -> np.ndarray:
        """Return dJ/dt, shape (..., 6, nv)."""
        return self._matrix(self._of_frame("jacobian_rate_", frame), 6, (q, v), parameters)

    def drift(self, frame: str, q: Any, v: Any, parameters: Parameters = None) -> np.ndarray:
        """Return dJ/dt v, shape (..., 6): accelerations of a frame are J a and this."""
        return self._evaluate(self._of_frame("drift_", frame), (q, v), parameters)

    # Inside

    def _known(self, function: str) -> None:
        if function not in self.functions:
            raise UnknownNameError(
                f"robot {self.name!r} was derived without {function!r}: {nearest(function, self.functions)}; "
                "derive it with this function, or with functions='robot'"
            )

    def _of_frame(self, prefix: str, frame: str) -> str:
        if frame not in self.frames:
            raise UnknownNameError(
                f"robot {self.name!r} was derived without the frame {frame!r:.60}: {nearest(frame, self.frames)}; "
                f"name it among `frames`"
            )
        return prefix + frame

    def _matrix(
        self, function: str, n_rows: int, arguments: Sequence[Any], parameters: Parameters
    ) -> np.ndarray:
        rows = self._evaluate(function, arguments, parameters)
        return rows.reshape(*rows.shape[:-1], n_rows, -1)

    def _evaluate(self, function: str, arguments: Sequence[Any], parameters: Parameters) -> np.ndarray:
        """Results, one along the last axis for each state of the leading axes."""
        self._known(function)
        kernel = self._kernel(function)
        n_y = kernel.source.lengths.y
        parts = [
            self._checked(function, letter, value, size)
            for letter, value, size in zip("qva", arguments, (self.nq, self.nv, self.nv), strict=False)
        ]
        try:
            shape = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
        except ValueError:
            shapes = ", ".join(str(part.shape) for part in parts)
            raise ValueError(f"{function}: arrays of shapes {shapes} do not go together") from None
        states = np.zeros((*shape, n_y))
        first = 0
        for part in parts:
            states[..., first : first + part.shape[-1]] = part
            first += part.shape[-1]
        states = states.reshape(-1, n_y)
        out = np.zeros((len(states), kernel.out_size))
        if out.size:
            times, p = np.zeros(len(states)), self.precomputed(parameters)
            evaluate_rows(kernel.precomputed_address, times, states, p, out)
        return out.reshape(*shape, kernel.out_size)

    def _values(self, parameters: Parameters) -> np.ndarray:
        if parameters is None or isinstance(parameters, Mapping):
            return self._system.parameter_values(parameters)
        p = np.ascontiguousarray(parameters, dtype=float)
        if p.shape != (self._system.n_p,):
            raise ValueError(
                f"p has shape {p.shape}, but {self.name!r} has {self._system.n_p} parameters and inputs"
            )
        return p

    def _checked(self, function: str, letter: str, value: Any, size: int) -> np.ndarray:
        try:
            array = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            raise TypeError(f"{function}: an argument cannot be read as numbers") from None
        if array.ndim == 0 or array.shape[-1] != size:
            what = "coordinates" if letter == "q" else "rates"
            raise ValueError(
                f"{function}: an array has shape {array.shape}, but {self.name!r} has {size} {what}: "
                f"its last axis must have this length"
            )
        return array
