"""Forces that become NaN or infinite, at once or on the way: never a result without a word."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator

from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, demand, judge
from .models import point
from .scenario import FLAGGED, REFUSED, Outcome, Scenario

# name -> force, start, rate; all break down before t = 2.
FORCES = {
    "root of a negative number": ("-1 + 0.001*sqrt(x)", 0.5, 0.0),
    "logarithm of a negative number": ("-2 + 0.001*log(x)", 0.5, 0.0),
    "division by zero at a time": ("1/(t - 0.7)", 1.0, 0.0),
    "division by zero at the start": ("1/x", 0.0, 0.0),
    "nan at the start": ("sqrt(-1 - x^2)", 1.0, 0.0),
    "overflow at the start": ("exp(1000 + x^2)", 1.0, 0.0),
    "overflow on the way": ("exp(exp(4*x))", 1.0, 1.0),
    "attraction to a point": ("-1/x^2", 1.0, 0.0),
    "condition without value": ("where(log(x) < -1, 1, -2)", 1.0, 0.0),
    "chosen without value": ("where(x < 0.5, sqrt(x - 0.6), -1)", 1.0, 0.0),
    "floor without value": ("-1 - floor(sqrt(x))", 0.5, 0.0),
    "blow-up in finite time": ("6*x^2", 1.0, 2.0),
    "arc sine beyond 1": ("1 + 0.01*asin(x)", 0.5, 0.5),
    "tangent across its pole": ("tan(x)", 1.0, 1.0),
    "power of a negative number": ("-1 + 0.001*x^0.3", 0.3, 0.0),
}  # fmt: skip
_REASON = "infinite|undefined|finite|converge|small|energy|resolution|step|singular|series|mass|steps"


def broken(name: str, method: str) -> Outcome:
    """Run over the place where the force breaks down."""
    force, start, rate = FORCES[name]
    system = point("broken", force, start, rate)
    run = attempt(system, 2.0, method=method, max_steps=50_000)
    return demand(judge(run, lambda solution: math.nan, 0.0), (REFUSED, FLAGGED), _REASON)


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for name in FORCES:
        for method in ("auto", *METHODS):
            run = functools.partial(broken, name, method)
            short = method in ("auto", "rk4", "dopri5", "taylor", "radau5", "bdf")
            yield Scenario("broken force", f"{name}: {method}", run, method, short=short)
