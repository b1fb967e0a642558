"""Singular configurations, redundant and contradictory constraints, coordinates without mass."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator

import numpy as np
from scipy.integrate import solve_ivp

from symgen.errors import ModelError
from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, demand, end_error, judge, refusal
from .models import bundled, described
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

_PENDULUM = """
name = "pendulum_xy"
[parameters]
g = 9.81
[coordinates]
x = {{ start = 1.0, rate = 0.0 }}
y = {{ start = 0.0, rate = 0.0 }}
{coordinates}
[bodies.bob]
mass = 1.0
com = ["x", "y"]
[gravity]
y = "-g"
[constraints]
{constraints}
[run]
t_end = 1.0
"""
_ROD = 'rod = "x^2 + y^2 - 1"'
# name -> constraints, more coordinates, verdicts, reason
PENDULA = {
    "one constraint twice": (f'{_ROD}\nagain = "x^2 + y^2 - 1"', "", (RIGHT,), ""),
    "one constraint three times in other words": (
        f'{_ROD}\nroot = "sqrt(x^2 + y^2) - 1"\nscaled = "1e3*(x^2 + y^2 - 1)"', "", (RIGHT,), "",
    ),
    "contradictory lengths": (f'{_ROD}\nother = "x^2 + y^2 - 1.1"', "", (REFUSED,), "rod|other"),
    "contradictory motions": (
        f'{_ROD}\nhold = "x^2 + y^2 - 1 - 1e-3*t"', "", (REFUSED, FLAGGED), "rod|hold",
    ),
    "more constraints than freedoms": (
        f'{_ROD}\nfix_x = "x - 1"\nfix_y = "y"', "", (RIGHT, REFUSED, FLAGGED), "rod|fix|constraint",
    ),
    "constraint without a gradient": ('point = "x^2 + y^2 - 2*x + 1"', "", (REFUSED, FLAGGED), "point|constraint"),
    "coordinate without mass, held": (f'{_ROD}\nz_is_x = "z - 2*x"', "z = { guess = 2.0 }", (RIGHT,), ""),
    "coordinate without mass, free": (
        f'{_ROD}\nsum = "z + u - x"', "z = { guess = 0.5 }\nu = { guess = 0.5 }", (RIGHT, REFUSED, FLAGGED), "mass|z|u",
    ),
}  # fmt: skip

# What a run that does not pass a change point has to say, and how many steps one that does may take.
_LOST_RANK = (
    "depend|restrict|independent coordinates|does not converge|energy|branch|resol|accura|residual|horizon"
)
_MANY_STEPS = 3000
_FORMS_THAT_STOP = (
    *((method, form) for method in ("radau5", "radau9", "radau13", "bdf") for form in ("projection", "ggl")),
    ("dop853", "partition"), ("dopri5", "partition"), ("dop853", "baumgarte"),
    *(("generalized_alpha", form) for form in ("projection", "index3", "ggl")), ("rattle", "index3"),
)  # fmt: skip

_TOP = """
name = "euler_angles"
[coordinates]
psi = {{ start = 0.0, rate = {psi} }}
theta = {{ start = {theta}, rate = {rate} }}
phi = {{ start = 0.0, rate = 1.0 }}
[bodies.body]
mass = 1.0
com = [0, 0, 0]
rotation = [["z", "psi"], ["x", "theta"], ["z", "phi"]]
inertia = [1.0, 2.0, 3.0]
[run]
t_end = 3.0
"""


def pendulum(name: str, method: str) -> Outcome:
    """A pendulum let go level in x and y, under constraints that are too many, too few, or odd."""
    constraints, coordinates, verdicts, reason = PENDULA[name]
    try:
        system = described(_PENDULUM.format(constraints=constraints, coordinates=coordinates))
    except ModelError as error:
        return demand(refusal(error), verdicts, reason)
    run = attempt(system, 1.0, method=method, rtol=1e-8, atol=1e-10)
    angle, rate = solve_ivp(
        lambda t, y: [y[1], -9.81 * math.sin(y[0])], (0, 1), [math.pi / 2, 0], method="DOP853", rtol=1e-13, atol=1e-13
    ).y[:, -1]  # fmt: skip
    x, y = math.sin(angle), -math.cos(angle)

    def error(solution):
        if name == "more constraints than freedoms":
            return np.abs(solution.q[-1] - [1.0, 0.0]).max()
        return max(
            np.abs(solution.q[-1, :2] - [x, y]).max(),
            np.abs(solution.v[-1, :2] - [-rate * y, rate * x]).max(),
        )

    if method == "taylor":  # has no series there, and says so
        verdicts, reason = (*verdicts, REFUSED, FLAGGED), f"{reason}|depend"
    return demand(judge(run, error, 1e-5), verdicts, reason)


def change_points(
    n: int,
    rate: float,
    method: str,
    rtol: float,
    form: str = "auto",
    angle: float = math.pi / 2,
    t_end: float = 3.0,
) -> Outcome:
    """n windows turn through the change points of their parallelograms, where every loop loses a rank."""
    system = bundled("n_four_bar", N=str(n), rate=str(rate), angle=str(angle))
    inertia, weight = (n + 1) / 3 + n, 9.81 * ((n + 1) / 2 + n)
    exact = solve_ivp(
        lambda t, y: [y[1], -weight * math.cos(y[0]) / inertia], (0, t_end), [angle, rate], method="DOP853",
        rtol=1e-13, atol=1e-13,
    ).y[:, -1]  # fmt: skip
    adaptive = method == "auto" or METHODS[method].adaptive
    given = {"rtol": rtol, "atol": 1e-2 * rtol} if adaptive else {}
    run = attempt(system, t_end, method=method, constraints=form, **given)
    q, v = (np.array([x, *[x, 0.0] * n]) for x in exact)
    outcome = demand(judge(run, end_error(q, v), 1e-2), (RIGHT, REFUSED, FLAGGED), _LOST_RANK)
    if outcome.verdict != RIGHT or not adaptive or run.stats["steps"] <= _MANY_STEPS:
        return outcome
    return Outcome(WRONG, f"{run.stats['steps']} steps for {t_end:g} s; {outcome.says}")


def gimbal(theta: float, rate: float, psi: float, method: str) -> Outcome:
    """A free body in Euler angles at, near, or on its way through gimbal lock; its momentum stays."""
    system = described(_TOP.format(theta=theta, rate=rate, psi=psi))
    run = attempt(system, 3.0, method=method)
    coarse = method != "auto" and not METHODS[method].adaptive and METHODS[method].order <= 2

    def error(solution):
        momenta = np.array([_momentum(*row) for row in np.hstack([solution.q, solution.v])])
        return np.abs(momenta - momenta[0]).max() / np.abs(momenta[0]).max()

    return demand(
        judge(run, error, 3e-2 if coarse else 1e-4),
        (RIGHT, REFUSED, FLAGGED),
        "mass|unique|singular|small|infinite|resol|energy|inert|converge|step",
    )


def _momentum(psi, theta, phi, psi_rate, theta_rate, phi_rate) -> np.ndarray:
    """Return the angular momentum in world axes."""
    s, c = math.sin(phi), math.cos(phi)
    w = np.array([
        psi_rate * math.sin(theta) * s + theta_rate * c,
        psi_rate * math.sin(theta) * c - theta_rate * s,
        psi_rate * math.cos(theta) + phi_rate,
    ])  # fmt: skip
    rz = lambda a: np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])  # noqa: E731
    rx = np.array([[1, 0, 0], [0, math.cos(theta), -math.sin(theta)], [0, math.sin(theta), math.cos(theta)]])
    return rz(psi) @ rx @ rz(phi) @ (np.array([1.0, 2.0, 3.0]) * w)


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for name in PENDULA:
        for method in ("auto", *METHODS):
            run = functools.partial(pendulum, name, method)
            if method == "auto" or METHODS[method].adaptive:
                short = method in ("auto", "radau5")
                yield Scenario("constraints", f"{name}: {method}", run, method, short)
    for n in (1, 2, 5, 10):
        for rate in (-1.0, -0.1, -3.0):
            for rtol in (1e-4, 1e-6, 1e-9, 1e-12):
                for method in ("auto", "dop853", "dopri5", "radau5"):
                    name = f"{n} windows at {rate} rad/s, {rtol:.0e}: {method}"
                    run = functools.partial(change_points, n, rate, method, rtol)
                    short = n <= 2 and rate == -1.0 and rtol in (1e-6, 1e-9) and method == "auto"
                    yield Scenario("change point", name, run, method, short)
    for method, form in _FORMS_THAT_STOP:
        for n, rate, angle in (
            (1, -1.0, math.pi / 2),
            (1, 3.0, 0.0),
            (2, -8.0, 1.0),
            (2, -3.0, 0.0),
            (5, -1.0, math.pi / 2),
        ):
            for rtol in (1e-5, 1e-8, 1e-11):
                name = f"{n} windows from {angle:.3g} at {rate} rad/s, {rtol:.0e}: {method}, {form}"
                run = functools.partial(change_points, n, rate, method, rtol, form, angle)
                yield Scenario("change point", name, run, f"{method}, {form}", short=False)
    for method in ("auto", *METHODS):
        for theta, rate, psi in ((0.0, 0.0, 1.0), (0.5, -0.25, 0.0), (1e-3, 0.0, 1.0), (1e-9, 0.0, 0.0)):
            name = f"gimbal from {theta} at {rate}, {psi} rad/s: {method}"
            run = functools.partial(gimbal, theta, rate, psi, method)
            yield Scenario("gimbal lock", name, run, method, short=method in ("auto", "dop853", "radau5"))
