"""Springs with a curve beside everything else: ropes, buffers, inputs, resets, assemblies, subsystems, cuts, members.

Some masses stand on lines of their own or are coupled, each with a spring whose force is a table; they may be uses of
one assembly. References are SciPy's, in short steps, with the tables as SciPy interpolates them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from symgen import Model, runtime
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.runtime.inputs import Table
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, flag, judge_end, refusal
from .kinks import Motion, reference
from .scenario import WRONG, Outcome, Scenario

_CASES = 2  # of each way with each method
_RTOLS = (1e-4, 1e-7, 1e-10)
WAYS = ("alone", "coupled", "assembly", "input", "resets", "turning")


def table(r: np.random.Generator) -> tuple[list[float], list[float], str, str, Callable[[float], float]]:
    """Knots, values, how they are joined and continued, and the same as SciPy has it."""
    from scipy.interpolate import CubicSpline, PchipInterpolator

    n = int(r.integers(1, 5))
    knots = np.concatenate(
        [-np.cumsum(r.uniform(0.05, 0.3, n))[::-1], [0.0], np.cumsum(r.uniform(0.05, 0.3, n))]
    )
    sizes = np.cumsum(10.0 ** r.uniform(-1, 2, (2, n)), axis=1) * 0.2
    values = np.concatenate([-sizes[0][::-1], [0.0], sizes[1]])
    kind, outside = str(r.choice(["linear", "pchip", "cubic"])), str(r.choice(["extend", "hold"]))
    if kind == "linear":

        def within(z: float, order: int = 0) -> float:
            k = int(np.clip(np.searchsorted(knots, z, side="right") - 1, 0, len(knots) - 2))
            slope = (values[k + 1] - values[k]) / (knots[k + 1] - knots[k])
            return slope if order else values[k] + slope * (z - knots[k])

    else:
        within = (PchipInterpolator if kind == "pchip" else CubicSpline)(knots, values)
    slopes = [float(within(knots[0], 1)), float(within(knots[-1], 1))] if outside == "extend" else [0.0, 0.0]

    def law(z: float) -> float:
        if z < knots[0]:
            return float(values[0] + slopes[0] * (z - knots[0]))
        if z > knots[-1]:
            return float(values[-1] + slopes[1] * (z - knots[-1]))
        return float(within(z))

    return knots.tolist(), values.tolist(), kind, outside, law


def pulled(law: Callable[[float], float], acts: str, c: float, stretch: float, rate: float) -> float:
    """What a spring with a curve pulls with: one way only, where it acts one way."""
    force = law(stretch) + c * rate
    if acts == "pull":
        return max(force, 0.0) if stretch > 0.0 else 0.0
    if acts == "push":
        return min(force, 0.0) if stretch < 0.0 else 0.0
    return force


def along(pull: Callable[[float, float], float], length: float, apart: float, rate: float) -> float:
    """The force along a line of a spring between two places of it, which may go through each other."""
    side = -1.0 if apart < 0.0 else 1.0
    return side * pull(abs(apart) - length, side * rate)


def draw(r: np.random.Generator, way: str) -> Motion:
    """Some masses with such springs."""
    n = int(r.integers(1, 4)) if way in ("alone", "coupled", "assembly") else 1
    n = max(n, 2) if way == "coupled" else n
    m, options, names = Model("curves"), {}, []
    start = [float(r.uniform(-0.5, 0.5)) for _ in range(n)] + [float(r.normal(0.0, 1.5)) for _ in range(n)]
    knots, values, kind, outside, law = table(r)
    m.table("law", columns=[knots, values], kind=kind, outside=outside)
    acts = [str(r.choice(["both", "pull", "push"])) for _ in range(n)]
    c = [float(r.choice([0.0, 0.3, 3.0])) for _ in range(n)]
    signal = None
    if way == "assembly":
        part = m.assembly("cart")
        x = part.coordinate("x")
        part.body("box", mass=1, com=(x, 0))
        part.potential("2*x^2")
        part.table("own", columns=[knots, values], kind=kind, outside=outside)
        damping = part.parameter("c", 0.0)
        part.spring(
            "band", points=[(x, 0), (-2.0, 0)], curve="own", length=2.0, damping=damping, acts=acts[0]
        )
        acts = [acts[0]] * n
        for k in range(n):
            m.use(f"u{k}", "cart", c=c[k], offset=(0, k))
            names.append(f"u{k}.x")
        options["start"] = {name: start[k] for k, name in enumerate(names)}
        options["rate"] = {name: start[n + k] for k, name in enumerate(names)}
    for k in range(n if way != "assembly" else 0):
        name = f"x{k}"
        names.append(name)
        if way == "turning":
            angle = m.coordinate(name, unit="rad", start=start[k], rate=start[n + k])
            m.body("disc", mass=1, com=(0, 0), inertia=1.0, angle=angle)
            m.spring("band", angle=angle, rest=0.0, curve="law", damping=c[k], acts=acts[k])
        else:
            x = m.coordinate(name, start=start[k], rate=start[n + k])
            m.body(f"box{k}", mass=1, com=(x, 0))
            anchor: Any = -2.0
            if way == "input":
                m.input("u")
                times = np.unique(np.concatenate([[0.0], r.uniform(0.0, 4.0, 4).round(2), [5.0]]))
                signal = (times, r.uniform(-0.3, 0.3, len(times)).round(2))
                options["inputs"] = {"u": Table(*signal, kind="linear")}
                m.force(name, "3*u")
                anchor = "-2.0 + sin(2*t)/10"
            m.spring(
                f"band{k}", points=[(x, 0), (anchor, 0)], curve="law", length=2.0, damping=c[k], acts=acts[k]
            )
        m.potential(f"2*{name}^2")
    if way == "coupled":
        m.spring("between", points=[("x0", 0), ("x1 + 3", 0)], curve="law", length=3.0, damping=0.2)
    resets = []
    if way == "resets":
        at, keep = round(float(r.uniform(0.1, 0.4)), 1), float(r.uniform(0.4, 1.0))
        m.event("wall", f"x0 - {at!r}", direction="rising", then={"reset": {"dot(x0)": f"-{keep!r}*dot(x0)"}})
        resets.append((at, 1.0, keep))

    def force(t: float, y: np.ndarray) -> tuple[float, ...]:
        total = [-4.0 * y[k] for k in range(n)]
        for k in range(n):
            at, moves = (0.1 * np.sin(2 * t), 0.2 * np.cos(2 * t)) if way == "input" else (0.0, 0.0)
            pull = functools.partial(pulled, law, acts[k], c[k])
            if way == "turning":
                total[k] -= pull(y[k], y[n + k])
            else:
                total[k] -= along(pull, 2.0, y[k] + 2.0 - at, y[n + k] - moves)
        if signal is not None:
            total[0] += 3.0 * float(np.interp(t, *signal))
        if way == "coupled":
            pull = functools.partial(pulled, law, "both", 0.2)
            tension = along(pull, 3.0, y[1] + 3.0 - y[0], y[n + 1] - y[n])
            total[0] += tension
            total[1] -= tension
        return tuple(total)

    return Motion(m, round(float(r.uniform(1.0, 3.0)), 2), options, start, force, resets, tuple(names))


def curve(way: str, number: int, method: str) -> Outcome:
    """Run a case and judge it."""
    r = np.random.default_rng([number, *way.encode()])
    try:
        motion = draw(r, way)
        system = runtime.load(derive_text(motion.model).text)
    except ModelError as error:
        return refusal(error)
    options = dict(motion.options)
    if find_method(method).adaptive:
        options["rtol"] = float(r.choice(_RTOLS))
    run = attempt(system, motion.t_end, method=method, **options)
    if isinstance(run, Outcome):
        return run
    truth = reference(motion)
    if truth is None:
        return flag(run) or Outcome(WRONG, f"it has an end, {run.states[-1]}, where the reference has none")
    end, ranges = truth
    off = float((np.abs(run.states[-1] - end) / np.maximum(ranges, 1e-9)).max())
    return judge_end(run, off, f"{method}, {options.get('rtol')}, to {motion.t_end}")


def scenarios() -> Iterator[Scenario]:
    """Yield cases of each way with each method."""
    for way in WAYS:
        for k, method in enumerate(METHODS):
            for number in range(_CASES):
                run = functools.partial(curve, way, number * len(METHODS) + k, method)
                short = number == 0 and method in ("dop853", "radau5")
                yield Scenario(f"curves: {way}", f"curves: {way} {number}: {method}", run, method, short)
