"""Test support: small models with inputs, derived once, and exact motions of the linear one."""

from __future__ import annotations

import functools

import numpy as np
from scipy.linalg import expm

from symgen import Model, dot, sin
from symgen.runtime import System

M, C, K = 2.0, 0.6, 18.0  # mass, damper, spring of the oscillator


@functools.cache
def oscillator(force: str = "") -> System:
    """m x'' + c x' + k x = u; `force` in the place of u makes it part of the equations."""
    m = Model("oscillator")
    x = m.coordinate("x", unit="m", start=0.3, rate=-0.2)
    mass, c, k = m.parameters(mass=f"{M} kg", c=f"{C} N*s/m", k=f"{K} N/m")
    u = m.input("u", unit="N")
    m.kinetic(mass * dot(x) ** 2 / 2)
    m.potential(k * x**2 / 2)
    m.force(x, force or u)
    m.force(x, -c * dot(x))
    m.output("stretch", 2 * x)
    m.output("push", u - k * x)
    return m.derive()


@functools.cache
def crane(force: str = "") -> System:
    """A trolley with a pendulum, and two inputs: a force on the one, a torque on the other."""
    m = Model("crane", gravity=(0, "-9.81 m/s^2"))
    x = m.coordinate("x", unit="m")
    theta = m.coordinate("theta", start=0.4)
    mass, bob, length = m.parameters(mass="1.5 kg", bob="0.4 kg", length="0.8 m")
    u, torque = m.input("u", unit="N"), m.input("torque", unit="N*m")
    m.body("trolley", mass=mass, com=(x, 0))
    m.body("load", mass=bob, com=(x + length * sin(theta), "-length*cos(theta)"))
    m.force(x, force or u)
    m.force(x, -0.2 * dot(x))
    m.force(theta, torque)
    m.event("passes", when="theta", then="record")
    return m.derive()


@functools.cache
def closed_crane(force: str = "") -> System:
    """The crane's load in Cartesian coordinates, on a rope that is a constraint."""
    m = Model("closed_crane", gravity=(0, "-9.81 m/s^2"))
    x = m.coordinate("x", unit="m", start=0.0)
    a = m.coordinate("a", unit="m", start=0.4)
    b = m.coordinate("b", unit="m", guess=-0.7)
    mass, bob, length = m.parameters(mass="1.5 kg", bob="0.4 kg", length="0.8 m")
    u = m.input("u", unit="N")
    m.body("trolley", mass=mass, com=(x, 0))
    m.body("load", mass=bob, com=(a, b))
    m.force(x, force or u)
    m.constraint("rope", (a - x) ** 2 + b**2 - length**2)
    return m.derive()


def exact_motion(times: np.ndarray, values: np.ndarray, slopes: np.ndarray, end: float) -> np.ndarray:
    """Return (x, x') of the oscillator at `end`, for a force that is linear between `times`.

    By matrix exponentials of the state extended by the force and its slope.
    """
    a = np.zeros((4, 4))
    a[0, 1], a[2, 3] = 1.0, 1.0
    a[1, :3] = -K / M, -C / M, 1.0 / M
    state = np.array([0.3, -0.2])
    for k, (begin, value, slope) in enumerate(zip(times, values, slopes)):
        until = min(end, times[k + 1]) if k + 1 < len(times) else end
        if until > begin:
            state = (expm(a * (until - begin)) @ [*state, value, slope])[:2]
    return state
