"""How long a step explicit methods of fixed step may take: eigenvalues against the region of stability."""

from __future__ import annotations

import numpy as np

from runtime.integrate.methods import Method

# |h lambda| below these is stable for damped and undamped motions alike (rk4: the largest half disc in its
# region, but for a sliver at the imaginary axis). Hairer, Wanner, Solving ODEs II (1996), IV.2; symplectic
# methods: h omega < 2, Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), I.1; their compositions: the
# trace of the step of an oscillator stays within 2.
_RADIUS = {
    "semi_implicit_euler": 2.0,
    "verlet": 2.0,
    "verlet4": 2.72,
    "verlet6": 2.53,
    "verlet8": 3.09,
    "rk4": 2.6,
}


def stable_radius(method: Method) -> float | None:
    """Return the largest h |lambda| that is stable; None where there is no limit, or no stability."""
    return None if method.stiff else _RADIUS.get(method.name)


def stable_step(method: Method, fastest: float) -> float:
    """Return the longest stable step [s] for rates up to `fastest` [1/s]; infinite if unlimited."""
    radius = stable_radius(method)
    return radius / fastest if radius is not None and fastest > 0.0 else np.inf
