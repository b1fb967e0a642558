"""Motions of the modules of `fixtures` from equations written by hand, and kernels written in Python."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from symgen.runtime.code.bridge import KERNEL_PROTOTYPE

T_END = 0.8
_GRAVITY, _LENGTH = 9.81, 0.5
_STARTS = {
    "oscillator": (0.1, 0.0, 0.0),
    "pendulum": (1.5, 0.0),
    "cartesian_pendulum": (np.arctan2(0.3, 0.4), 0.0),
}
MODELS = tuple(_STARTS)


def reference(name: str, times) -> np.ndarray:
    """Return the states at times up to `T_END`: SciPy at round-off tolerance, from the physics, not from the module."""
    f = _oscillator if name == "oscillator" else _pendulum
    run = solve_ivp(f, (0, T_END), _STARTS[name], "DOP853", rtol=3e-14, atol=1e-16, dense_output=True)
    y = run.sol(np.asarray(times, dtype=float)).T
    if name == "cartesian_pendulum":
        s, c, w = np.sin(y[:, 0]), np.cos(y[:, 0]), y[:, 1]
        y = np.column_stack([_LENGTH * s, -_LENGTH * c, _LENGTH * c * w, _LENGTH * s * w])
    return y


def _oscillator(t, y):
    force = 0.5 * np.sin(3.0 * t) - 0.2 * y[1]
    return [y[1], force - 25.0 * y[0], force * y[1]]  # the last is the work of what is not a potential


def _pendulum(t, y):
    return [y[1], -_GRAVITY / _LENGTH * np.sin(y[0])]


def python_kernel(function: Callable) -> tuple[int, object]:
    """Return the address of a kernel written in Python, and what keeps it alive."""
    callback = KERNEL_PROTOTYPE(function)
    return ctypes.cast(callback, ctypes.c_void_p).value, callback


def doubles(address: int):
    """Return the numbers at an address."""
    return ctypes.cast(address, ctypes.POINTER(ctypes.c_double))
