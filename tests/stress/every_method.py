"""Every method, with every form of constraints that it has, on every class of problems that it may meet."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from symgen.runtime import System
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, demand, end_error, flag, judge, judge_convergence
from .models import bundled, point
from .scenario import FLAGGED, REFUSED, RIGHT, Outcome, Scenario

RTOL, ALLOWED = 1e-7, 1e-3
_AGREE = 1e-7
_SHORT = ("smooth", "loop", "redundant", "pole", "bounce", "driven")
State = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Problem:
    """A class of problems.

    Attributes
    ----------
    system : callable
        () -> System.
    t_end : float [s]
    end : callable or None
        () -> (q, v) at the end, known without the method under test; None: two other methods have to agree on it.
    verdicts : tuple of str
        What may become of a run.
    pattern : str
        What a refusal or flag has to say.
    """

    system: Callable[[], System]
    t_end: float
    end: Callable[[], State] | None = None
    verdicts: tuple[str, ...] = (RIGHT, REFUSED, FLAGGED)
    pattern: str = ""


def _state(x: float, v: float) -> State:
    return np.array([x]), np.array([v])


def _forced() -> State:
    """x'' = -x + sin 2t from x = 1 at rest: x = cos t + 2/3 sin t - 1/3 sin 2t."""
    t = 3.0
    x = math.cos(t) + 2 / 3 * math.sin(t) - math.sin(2 * t) / 3
    return _state(x, -math.sin(t) + 2 / 3 * math.cos(t) - 2 / 3 * math.cos(2 * t))


def _damped() -> State:
    """x'' = -4x - 0.4 x' from x = 1 at rest."""
    t, decay = 3.0, 0.2
    w = math.sqrt(4.0 - decay**2)
    x = math.exp(-decay * t) * (math.cos(w * t) + decay / w * math.sin(w * t))
    return _state(x, -math.exp(-decay * t) * 4.0 / w * math.sin(w * t))


def _bounced() -> State:
    """A ball let go 1 m above the floor, restitution 0.9: time of n bounces and parabolas between them."""
    g, e, t, speed = 9.81, 0.9, 2.0, math.sqrt(2 * 9.81)
    t -= speed / g
    while t > 2 * e * speed / g:
        speed *= e
        t -= 2 * speed / g
    speed *= e
    return np.array([1.0, 0.1 + speed * t - g * t * t / 2]), np.array([0.5, speed - g * t])


def _windows() -> State:
    """The rockers of n equal windows turn as one body: one equation of one freedom, in dop853 of SciPy."""
    from scipy.integrate import solve_ivp

    n, g = 2, 9.81
    inertia, weight = (n + 1) / 3 + n, g * ((n + 1) / 2 + n)
    end = solve_ivp(
        lambda t, y: [y[1], -weight * math.cos(y[0]) / inertia], (0.0, 1.5), [math.pi / 2, -1.0], method="DOP853",
        rtol=1e-13, atol=1e-14,
    ).y[:, -1]  # fmt: skip
    turned = lambda x: np.array([x, *[x, 0.0] * n])  # noqa: E731
    return turned(end[0]), turned(end[1])


_STIFF = dict(k=1e8, c=2e4)
_STIFF_FORCE = "-k*(x - cos(t)) - c*(dot(x) + sin(t)) - cos(t)"
_BREAKS = r"infinite|undefined|finite|singular|jump|converge|overflow|small|steps|energy|resolution|series|positions"
PROBLEMS: dict[str, Problem] = {
    "smooth": Problem(lambda: bundled("double_pendulum"), 1.0),
    "separable": Problem(lambda: bundled("pendulum"), 2.0),
    "driven": Problem(lambda: point("driven", "-x + sin(2*t)"), 3.0, _forced),
    "damped": Problem(lambda: point("damped", "-4*x - 0.4*dot(x)"), 3.0, _damped),
    "stiff": Problem(
        lambda: point("stiff", _STIFF_FORCE, **_STIFF), 1.0, lambda: _state(math.cos(1.0), -math.sin(1.0))
    ),
    "loop": Problem(lambda: bundled("four_bar"), 0.5),
    "quaternion": Problem(lambda: bundled("free_rigid_body"), 4.0),
    "held body": Problem(lambda: bundled("heavy_top_absolute"), 0.1),
    "rolling": Problem(lambda: bundled("rolling_disc"), 1.0),
    "moved": Problem(lambda: bundled("car_axis"), 0.2),
    "redundant": Problem(lambda: bundled("bricard"), 0.5),
    "change point": Problem(lambda: bundled("n_four_bar", N="2"), 1.5, _windows),
    "bounce": Problem(lambda: bundled("bouncing_ball"), 2.0, _bounced),
    "pole": Problem(lambda: point("pole", "1/(0.5 - t)"), 1.0, verdicts=(REFUSED, FLAGGED), pattern=_BREAKS),
    "blow-up": Problem(
        lambda: point("blow_up", "6*x^2", rate=2.0), 2.0, verdicts=(REFUSED, FLAGGED), pattern=_BREAKS
    ),
}


@functools.cache
def reference(name: str) -> State | Outcome:
    """Return the end that two methods of different kind agree on."""
    problem = PROBLEMS[name]
    if problem.end is not None:
        return problem.end()
    system = problem.system()
    explicit = attempt(system, problem.t_end, method="dop853", rtol=1e-13, atol=1e-14)
    implicit = attempt(system, problem.t_end, method="radau13", rtol=1e-12, atol=1e-13)
    for run in (explicit, implicit):
        if flag(run) is not None:
            return flag(run)
    differ = end_error(explicit.q[-1], explicit.v[-1])(implicit)
    if differ > _AGREE:
        return Outcome("WRONG", f"dop853 and radau13 at tight tolerances differ by {differ:.1e}")
    return explicit.q[-1], explicit.v[-1]


def run_method(problem_name: str, method: str, form: str) -> Outcome:
    """Run one method on one problem."""
    problem = PROBLEMS[problem_name]
    system = problem.system()
    given = {"method": method} | ({"constraints": form} if form else {})
    if RIGHT not in problem.verdicts:
        outcome = judge(attempt(system, problem.t_end, **given), lambda run: math.nan, 0.0)
        return demand(outcome, problem.verdicts, problem.pattern)
    end = reference(problem_name)
    if isinstance(end, Outcome):
        return Outcome("WRONG", f"no reference: {end.says}")
    error = end_error(*end)
    if METHODS[method].adaptive:
        run = attempt(system, problem.t_end, rtol=RTOL, atol=1e-2 * RTOL, **given)
        return judge(run, error, ALLOWED)
    return judge_convergence(system, problem.t_end, error, METHODS[method].order, **given)


def scenarios() -> Iterator[Scenario]:
    """Yield all of them: forms other than projection where a problem has constraints."""
    for problem in PROBLEMS:
        for method in METHODS:
            run = functools.partial(run_method, problem, method, "")
            yield Scenario(problem, f"{problem}: {method}", run, method, short=problem in _SHORT)
        for form, methods in FORMS.items():
            if form == "projection" or problem not in _CONSTRAINED:
                continue
            for method in methods:
                run = functools.partial(run_method, problem, method, form)
                name = f"{problem}: {method}, {form}"
                yield Scenario(problem, name, run, f"{method}, {form}", short=False)


_CONSTRAINED = ("loop", "held body", "rolling", "moved", "redundant", "change point")
