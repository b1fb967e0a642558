"""Forces and events of commands that jump: saturations, dead zones, thresholds, one in the other.

A unit mass is pushed by an expression of held inputs whose values are drawn, far over several thresholds at once or
back by less than they came. What it is pushed with is constant from jump to jump, so its speed at each is a sum; events
are the jumps at which what they look at changes its sign. A reference in Python knows no sides and no branches.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.inputs import Table
from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, flag
from .scenario import RIGHT, WRONG, Outcome, Scenario

_CASES, _JUMPS, _DEPTH = 4, 12, 3  # cases of each method
_SEEN = "1e-9*x"  # what a force has of the state: it takes a branch only where it depends on it
_ALLOWED = 1e-5
Law = Callable[[float, float], float]


def _drawn(r: np.random.Generator, depth: int) -> tuple[str, Law]:
    """An expression of u and w, and its value."""
    if depth == 0:
        name, sign = str(r.choice(["u", "w"])), str(r.choice(["+", "-"]))
        scale = 1.0 if sign == "+" else -1.0
        return f"({sign}{name} + {_SEEN})", lambda u, w: scale * (u if name == "u" else w)
    (a, f), (b, g) = _drawn(r, depth - 1), _drawn(r, depth - 1)
    at = float(np.round(r.uniform(-3.0, 3.0), 3))
    texts: tuple[tuple[str, Law], ...] = (
        (f"max({a}, {at})", lambda u, w: max(f(u, w), at)),
        (f"min({a}, {b})", lambda u, w: min(f(u, w), g(u, w))),
        (f"max(-{abs(at)}, min({abs(at)}, {a}))", lambda u, w: max(-abs(at), min(abs(at), f(u, w)))),
        (f"abs({a} - ({at}))", lambda u, w: abs(f(u, w) - at)),
        (f"where({a} > {at}, {b}, -{b}/2)", lambda u, w: g(u, w) if f(u, w) > at else -g(u, w) / 2),
        (f"heaviside({a} - ({at}))*{b}", lambda u, w: g(u, w) if f(u, w) > at else 0.0),
        (f"floor({a})", lambda u, w: float(np.floor(f(u, w)))),
        (f"mod({a}, 2.5)", lambda u, w: float(np.mod(f(u, w), 2.5))),
    )
    return texts[int(r.integers(len(texts)))]


def saturated(number: int, method: str) -> Outcome:
    """Run one case."""
    r = np.random.default_rng([number, 31])
    text, law = _drawn(r, int(r.integers(1, _DEPTH + 1)))
    at = (
        float(np.round(r.uniform(-1.0, 1.0), 3)) + 0.00029
    )  # what the halves leave of a difference is none of these
    m = Model("saturated")
    x = m.coordinate("x")
    u, w = m.input("u"), m.input("w")
    m.kinetic("dot(x)^2/2")
    m.force(x, text)
    m.event("seen", u - w - at)
    system = runtime.load(derive_text(m).text)
    # Halves of thousandths: never on a threshold, nor on a whole number.
    values = np.round(r.normal(0.0, 10.0 ** r.uniform(-1.0, 1.5, (2, _JUMPS))), 3) + 0.00053
    times = np.arange(float(_JUMPS))
    ends = np.append(times, float(_JUMPS))
    run = attempt(
        system,
        float(_JUMPS),
        method=method,
        t_eval=ends,
        inputs={name: Table(times, row, kind="hold") for name, row in zip("uw", values, strict=True)},
    )
    flagged = flag(run)
    if flagged is not None:
        return flagged
    pushed = np.array([law(*column) for column in values.T])
    speeds = np.append(0.0, np.cumsum(pushed))
    scale = max(1e-3, float(np.abs(speeds).max()))
    off = float(np.abs(run["dot(x)"][np.searchsorted(run.t, ends)] - speeds).max()) / scale
    above = values[0] - values[1] > at
    expected = times[1:][above[1:] != above[:-1]]
    found = np.array([event.t for event in run.events])
    if len(found) != len(expected) or not np.allclose(found, expected, rtol=0.0, atol=1e-9):
        return Outcome(WRONG, f"events at {found}, not at {expected}")
    return Outcome(RIGHT if off <= _ALLOWED else WRONG, f"error {off:.1e} of {text}")


def scenarios() -> Iterator[Scenario]:
    """Yield some cases of each method."""
    for k, method in enumerate(METHODS):
        for number in range(_CASES):
            run = functools.partial(saturated, number * len(METHODS) + k, method)
            short = number == 0 and method in ("dop853", "taylor", "bdf", "rk4")
            yield Scenario("saturated", f"saturated command {number}: {method}", run, method, short)
