"""Forces with kinks and jumps of every kind, several in one motion, beside SciPy in short steps.

Terms are drawn as text; the text is what the model has, and what Python evaluates for the reference. Ropes and buffers
with damping, curves, inputs over time inside kinks, resets and records at the very places of kinks stand beside them.
Some runs are cut at a random time and taken up again, to the last bit; members of ensembles are held against runs.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from symgen import Model, runtime
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.runtime.inputs import Table
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, flag, judge_end, refusal
from .scenario import WRONG, Outcome, Scenario

_CASES = 6  # of each kind with `taylor`, and one with each other method
_RTOLS = (1e-3, 1e-5, 1e-8, 1e-11)
_STEP = 1e-3  # of the reference


class Motion(NamedTuple):
    """A model, how it is run, its forces in Python, and its resets: where x crosses, which way, and what is kept."""

    model: Model
    t_end: float
    options: dict[str, Any]
    start: list[float]
    force: Callable[[float, np.ndarray], tuple[float, ...]]
    resets: list[tuple[float, float, float]]
    names: tuple[str, ...]


def smoothstep(a: float, b: float, x: float) -> float:
    """A step from 0 to 1 with slopes of zero at both ends."""
    s = min(max((x - a) / (b - a), 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


_PYTHON = {
    "max": max, "min": min, "abs": abs, "sqrt": math.sqrt, "smoothstep": smoothstep, "sin": math.sin, "cos": math.cos,
    "floor": math.floor, "exp": math.exp, "atan2": math.atan2, "mod": lambda a, b: a - b * math.floor(a / b),
    "where": lambda c, a, b: a if c else b,
    "sign": lambda x: math.copysign(1.0, x) if x else 0.0,
    "heaviside": lambda x: 1.0 if x > 0 else 0.0 if x < 0 else 0.5,
}  # fmt: skip


def compiled(text: str, names: tuple[str, ...]) -> Callable[..., float]:
    """A term as a function of these names and their rates."""
    own = text.replace("^", "**")
    for name in names:
        own = own.replace(f"dot({name})", f"v_{name}")
    arguments = ", ".join(["t", "u", *names, *(f"v_{name}" for name in names)])
    return eval(f"lambda {arguments}: {own}", {"__builtins__": {}, **_PYTHON})


def term(r: np.random.Generator, names: tuple[str, ...], with_input: bool) -> str:
    """A force with a kink or a jump, or a kink that leaves it smooth."""

    def number(low: float = -1.5, high: float = 1.5) -> str:
        return f"({round(float(r.uniform(low, high)), int(r.integers(0, 4)))!r})"

    def size() -> str:
        return repr(round(float(10.0 ** r.uniform(-1.0, 1.3)), 3))

    def along() -> str:
        places = [
            *names,
            *names,
            f"sin(2*{names[0]})",
            f"({names[0]} + 0.3*t)",
            f"({names[-1]} - 0.5*sin(3*t))",
        ]
        if len(names) == 2:
            places += ["(x + y)", "(x - y)", "sqrt(x^2 + y^2 + 0.05)", "x*y", "x^2"]
        if with_input:
            places += [f"({names[0]} - u)", f"(u*{names[0]})"]
        return str(r.choice(places))

    def measured() -> str:
        return along() if r.random() < 0.75 else f"0.3*dot({names[int(r.integers(0, len(names)))]})"

    k, a, n = size(), number(), int(r.integers(1, 5))
    width = repr(float(f"{10.0 ** r.uniform(-3.0, 0.0):.2g}"))
    q, p = measured(), along()
    choices = [
        f"-{k}*max({q} - {a}, 0)^{n}",
        f"{k}*min({q} - {a}, 0)^{2 * n}",
        f"-{k}*abs({q} - {a})^{2 * n - 1}/10",
        f"-{k}*abs({q})*{q}",
        f"-{k}*smoothstep({a}, {a} + {width}, {p})",
        f"-{k}*smoothstep({a}, {a} + {width}, {p})*max({q}, 0)^2",
        f"-{k}*max(-0.5, min(0.5, {q} - {a}))",
        f"-{k}*max({q}, {p})^2",
        f"{k}*min({q}, {p}, {a})",
        f"-{k}*sqrt(max({p} - {a}, 0)^3)",
        f"-{k}*max({p} - {a}, 0)^1.5",
        f"-{k}*sign({p} - {a})",
        f"-{k}*heaviside({p} - {a})*{q}",
        f"-{k}*where({p} > {a}, {q}, 0.2)",
        f"-{k}*where({p} > {a} and {q} > 0, {q}^2, 0.1*{p})",
        f"-{k}*floor(2*{p})/2",
        f"-{k}*max(max({q} - {a}, 0)^2 - 0.1, 0)^2",
        f"-{k}*max(abs({p} - {a}) - 0.2, 0)^{n}",
        f"-{k}*abs(max({q} - {a}, 0)^2 - {width})",
        f"-{k}*exp(-abs({p} - {a}))",
        f"-{k}*max({q} - {a}, 0)*max({p}, 0)",
    ]
    return str(r.choice(choices))


def nest(r: np.random.Generator, names: tuple[str, ...], depth: int) -> str:
    """Choices within choices, bounded: of places, the time and what is smooth of these and of rates."""

    def number(low: float, high: float) -> str:
        return f"({round(float(r.uniform(low, high)), 2)!r})"

    if depth == 0:
        x = str(r.choice(names))
        leaves = [
            x, x, f"({x} + {number(-1, 1)})", f"{number(0.5, 3)}*{x}", f"sin({number(1, 4)}*t)", f"0.3*dot({x})",
            f"({x} - {number(-0.5, 0.5)}*t)", number(-1, 1), f"cos({number(1, 3)}*{x} + t)",
        ]  # fmt: skip
        return str(r.choice(leaves))

    def below() -> str:
        return nest(r, names, depth - 1)

    def place() -> str:  # without rates, which a jump of forces would hold where it is
        x = str(r.choice(names))
        return str(
            r.choice([x, f"sin({number(1, 3)}*{x})", f"({x} + {number(-0.6, 0.6)}*t)", f"{x}^2", "sin(3*t)"])
        )

    def condition() -> str:
        simple = f"{place()} {r.choice(['<', '>', '<=', '>='])} {number(-0.5, 0.5)}"
        if r.random() < 0.6:
            return simple
        other = f"{place()} > {number(-0.5, 0.5)}"
        return str(r.choice([f"({simple}) and ({other})", f"({simple}) or ({other})", f"not ({simple})"]))

    kinds = [
        f"min({below()}, {below()})", f"max({below()}, {below()})", f"abs({below()})",
        f"max({number(-1, -0.2)}, min({number(0.2, 1)}, {below()}))", f"where({condition()}, {below()}, {below()})",
        f"sign({place()} - {number(-0.5, 0.5)})*abs({below()})", f"floor({number(1, 3)}*{place()})/3",
        f"mod({place()}, {number(0.3, 1.2)})", f"heaviside({place()})*{below()}", f"({below()} - {below()})",
        f"smoothstep({number(-1, -0.1)}, {number(0.1, 1)}, {below()})", f"sin({below()})", f"max({below()}, 0)^2/3",
        f"abs({below()} - abs({below()}))", f"where({condition()}, floor(2*{place()}), {below()})",
    ]  # fmt: skip
    return str(r.choice(kinds))


def draw(r: np.random.Generator, *, events: bool, inputs: bool, nests: bool = False) -> Motion:
    """One or two freedoms with some terms, elements, events and inputs."""
    names = ("x",) if r.random() < 0.5 else ("x", "y")
    m = Model("kinks")
    start = [float(r.uniform(-1.0, 1.0)) for _ in names] + [float(r.normal(0.0, 1.5)) for _ in names]
    for k, name in enumerate(names):
        m.coordinate(name, start=start[k], rate=start[len(names) + k])
        m.kinetic(f"dot({name})^2/2")
        m.potential(f"2*{name}^2 + 20*{name}^4")  # it stays near
    if len(names) == 2:
        m.potential("3*(x - y)^2")
    with_input, options, values = inputs and r.random() < 0.7, {}, None
    if with_input:
        m.input("u")
        times = np.sort(r.uniform(0.0, 4.0, 5)).round(2)
        times = np.unique(np.concatenate([[0.0], times, [5.0]]))
        values = (times, r.uniform(-0.8, 0.8, len(times)).round(2))
        options["inputs"] = {"u": Table(*values, kind="linear")}
    found: list[tuple[int, Callable[..., float]]] = []
    for _ in range(int(r.integers(1, 5))):
        k = int(r.integers(0, len(names)))
        text = f"3*({nest(r, names, int(r.integers(2, 5)))})" if nests else term(r, names, with_input)
        m.force(names[k], text)
        found.append((k, compiled(text, names)))
    if r.random() < 0.4:
        acts, stiff, c = (
            str(r.choice(["pull", "push"])),
            float(10.0 ** r.uniform(0, 3)),
            float(r.choice([0.0, 0.5, 5.0])),
        )
        length = float(r.uniform(1.0, 3.0))
        m.spring("band", points=[(-2.0, 0), ("x", 0)], stiffness=stiff, length=length, damping=c, acts=acts)

        def band(t: float, u: float, *y: float) -> float:
            side = -1.0 if y[0] < -2.0 else 1.0
            stretch = side * (y[0] + 2.0) - length
            force = stiff * stretch + c * side * y[len(names)]
            if acts == "pull":
                return -side * max(force, 0.0) if stretch > 0.0 else 0.0
            return -side * min(force, 0.0) if stretch < 0.0 else 0.0

        found.append((0, band))
    resets = []
    if events:
        for k in range(int(r.integers(1, 3))):
            at, keep = (
                round(float(r.uniform(0.1, 0.9)) * (1 if k else -1), int(r.integers(1, 3))),
                float(r.uniform(0.3, 1)),
            )
            way = 1.0 if k else -1.0
            m.event(
                f"wall{k}", f"x - ({at!r})", direction="rising" if k else "falling",
                then={"reset": {"dot(x)": f"-{keep!r}*dot(x)"}},
            )  # fmt: skip
            resets.append((at, way, keep))
            if r.random() < 0.5:
                text = f"-3*max(x - ({at!r}), 0)^2"
                m.force("x", text)
                found.append((0, compiled(text, names)))
        m.event("seen", "x - 0.05", then="record")
    n = len(names)

    def force(t: float, y: np.ndarray) -> tuple[float, ...]:
        u = 0.0 if values is None else float(np.interp(t, *values))
        total = [-4.0 * y[k] - 80.0 * y[k] ** 3 for k in range(n)]
        if n == 2:
            total[0] -= 6.0 * (y[0] - y[1])
            total[1] += 6.0 * (y[0] - y[1])
        for k, part in found:
            total[k] += part(t, u, *y)
        return tuple(total)

    return Motion(m, round(float(r.uniform(1.0, 4.0)), 2), options, start, force, resets, names)


def reference(motion: Motion) -> np.ndarray | None:
    """The states at the end and, below, the range of each, by SciPy in short steps from reset to reset.

    None where it comes to a pole on the way, or resets pile up.
    """
    from scipy.integrate import solve_ivp

    n = len(motion.names)

    def f(t: float, y: np.ndarray) -> list[float]:
        return [*y[n:], *motion.force(t, y)]

    events = []
    for at, way, _ in motion.resets:
        event = functools.partial(lambda at, t, y: y[0] - at, at)
        event = _with(event, way)
        events.append(event)
    t, y, rows = 0.0, np.array(motion.start), []
    for _ in range(500):
        found = solve_ivp(
            f, (t, motion.t_end), y, "DOP853", rtol=1e-10, atol=1e-12, max_step=_STEP, events=events or None
        )
        rows.append(found.y)
        t, y = float(found.t[-1]), found.y[:, -1].copy()
        if found.status < 0:
            return None
        if found.status == 0:
            break
        for k, times in enumerate(found.t_events):
            if len(times):
                y[0], y[n] = motion.resets[k][0], -motion.resets[k][2] * y[n]
    else:
        return None
    ranges = np.ptp(np.concatenate(rows, axis=1), axis=1)
    return np.stack([y, ranges])


def _with(event: Callable[..., float], way: float) -> Callable[..., float]:
    def own(t: float, y: np.ndarray) -> float:
        return event(t, y)

    own.terminal, own.direction = True, way
    return own


def kinks(kind: str, number: int, method: str) -> Outcome:
    """Run a case and judge it."""
    r = np.random.default_rng([number, *kind.encode()])
    motion = draw(r, events=kind == "events", inputs=kind in ("inputs", "events"), nests=kind == "nests")
    try:
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
    """Yield cases of each kind, most of them with `taylor`."""
    for kind in ("forces", "inputs", "events", "nests"):
        for k, method in enumerate(METHODS):
            for number in range(_CASES if method == "taylor" else 1):
                run = functools.partial(kinks, kind, number * len(METHODS) + k, method)
                short = number == 0 and method in ("taylor", "radau5")
                yield Scenario(f"kinks: {kind}", f"kinks: {kind} {number}: {method}", run, method, short)
