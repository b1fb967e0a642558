"""Explicit methods of fixed step just inside and just outside their limit of stability, undamped and damped.

The limit is computed here from how each method is defined, as the step where the matrix of one step of
x'' = -x - 2 d x' gets a spectral radius of 1.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from symgen.runtime.integrate.composition import composition

from .judging import attempt, flag
from .models import point
from .scenario import FLAGGED, RIGHT, WRONG, Outcome, Scenario

DAMPINGS = {"undamped": 0.0, "damped": 0.1, "strongly damped": 0.7}
_STEPS, _MOST_STEPS = 2000, 100_000
_GROWN = 1e3
_ROUNDING = 1e-9


def _polynomial(degree: int):
    def step(h: float, d: float) -> np.ndarray:
        a, term, total = h * np.array([[0.0, 1.0], [-1.0, -2.0 * d]]), np.eye(2), np.eye(2)
        for k in range(1, degree + 1):
            term = term @ a / k
            total = total + term
        return total

    return step


def _semi_implicit(h: float, d: float) -> np.ndarray:
    v = np.array([-h, 1.0 - 2.0 * d * h])
    return np.array([[1.0, 0.0] + h * v, v])


def _verlet(h: float, d: float) -> np.ndarray:
    """Velocity Verlet; where the force depends on v, the new one is taken at v + h a."""
    x, v = np.eye(2)
    a = -x - 2.0 * d * v
    x_new = x + h * v + 0.5 * h * h * a
    a_new = -x_new - 2.0 * d * (v + h * a)
    return np.array([x_new, v + 0.5 * h * (a + a_new)])


def _composed(order: int):
    def step(h: float, d: float) -> np.ndarray:
        total = np.eye(2)
        for part in _parts(order):
            total = _verlet(part * h, d) @ total
        return total

    return step


@functools.cache
def _parts(order: int) -> tuple[float, ...]:
    return tuple(np.asarray(composition(order)[0], dtype=float))


STEP_MATRICES = {
    "euler": _polynomial(1),
    "semi_implicit_euler": _semi_implicit,
    "verlet": _verlet,
    "rk4": _polynomial(4),
    **{f"verlet{order}": _composed(order) for order in (4, 6, 8)},
}


def limit(method: str, damping: float) -> float:
    """Return the step at which the spectral radius first exceeds 1; 0 where every step is unstable."""
    radius = lambda h: np.abs(np.linalg.eigvals(STEP_MATRICES[method](h, damping))).max()  # noqa: E731
    low, high = 0.0, 1e-3
    while radius(high) <= 1.0 + _ROUNDING:
        low, high = high, high + 1e-3
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if radius(middle) <= 1.0 + _ROUNDING else (low, middle)
    return low


def run_at(method: str, damping: float, part: float) -> Outcome:
    """Run many steps of a part of the limit, and hold growth and end against the powers of the step's matrix."""
    h = part * limit(method, damping)
    system = point("oscillator", f"-x - {2 * damping!r}*dot(x)" if damping else "-x")
    growth = np.abs(np.linalg.eigvals(STEP_MATRICES[method](h, damping))).max()
    n_steps = _STEPS if part < 1.0 else int(min(_MOST_STEPS, max(50, 2 * np.log(_GROWN) / np.log(growth))))
    run = attempt(system, h * n_steps, method=method, step=h)
    if isinstance(run, Outcome):
        return run
    size = np.hypot(run.q[:, 0], run.v[:, 0])
    says = f"grows by {size.max():.1e} in {n_steps} steps, by {growth:.9f} in each according to theory"
    if part < 1.0:
        return Outcome(RIGHT if run.status == "success" and size.max() < _GROWN else WRONG, says)
    flagged = flag(run)
    grew = size.max() > 10.0 or not np.isfinite(size.max())
    return (
        Outcome(FLAGGED, f"{says}; {flagged.says}") if grew and flagged is not None else Outcome(WRONG, says)
    )


def scenarios() -> Iterator[Scenario]:
    """Yield all: methods without a region of stability on undamped motion have no such limit there."""
    for method, matrix in STEP_MATRICES.items():
        for name, damping in DAMPINGS.items():
            if damping and method.startswith("verlet") and method != "verlet":
                continue  # they refuse damping
            if np.abs(np.linalg.eigvals(matrix(1e-3, damping))).max() > 1.0 + _ROUNDING:
                continue
            for part in (0.99, 1.01):
                run = functools.partial(run_at, method, damping, part)
                yield Scenario("stability limit", f"{method} at {part} of its limit, {name}", run, method)
