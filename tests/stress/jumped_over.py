"""Pulses, jumps and barriers far shorter than the run: what steps go over must be found or flagged.

Forces, stiffness and moved supports with pulses in time of widths from a millionth to a tenth of the run, and barriers
and wells in the coordinate; all adaptive methods, rtol from 1e-3 to 1e-10, and methods of fixed step with the step that
they take by themselves. References are SciPy's, of equations written here a second time and integrated from break to
break with steps held to the width of the pulse. SYMGEN_STRESS_SEED=1 and so on are other cases.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp

from symgen import Model
from symgen.runtime import System
from symgen.runtime.integrate.methods import METHODS

from .judging import attempt, flag
from .models import made
from .scenario import DOUBTED, FLAGGED, RIGHT, WRONG, Outcome, Scenario

if TYPE_CHECKING:
    from symgen.runtime import Solution

N_ALL = int(os.environ.get("SYMGEN_STRESS_JUMPED_OVER", "400"))
SEED = int(os.environ.get("SYMGEN_STRESS_SEED", "0"))
N_SHORT = 8
_RIGHT, _WRONG = 0.01, 0.05  # of what a coordinate or rate goes through
_RTOLS = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
_ADAPTIVE = sorted(name for name, method in METHODS.items() if method.adaptive)
_FIXED = sorted(name for name, method in METHODS.items() if not method.adaptive and method.order > 1)
_PART_FIXED = 0.2
_LOOKS = 20.0  # times the longest step of the reference: a step that sees something of what is narrow
_AROUND = 12.0  # widths: what a smooth pulse is made of

# In the model's words, in Python's, and where it is not smooth, in widths.
SHAPES: dict[str, tuple[str, Callable[[float], float], tuple[float, ...]]] = {
    "gauss": ("exp(-({u})^2)", lambda u: np.exp(-u * u), ()),
    "box": ("(sign({u} + 1) - sign({u} - 1))/2", lambda u: 1.0 if abs(u) < 1.0 else 0.0, (-1.0, 1.0)),
    "triangle": ("max(1 - abs({u}), 0)", lambda u: max(1.0 - abs(u), 0.0), (-1.0, 0.0, 1.0)),
    "tanh": ("(1 + tanh({u}))/2", lambda u: 0.5 + 0.5 * np.tanh(u), ()),
    "sign": ("sign({u})", lambda u: -1.0 if u < 0.0 else 1.0, (0.0,)),
    "burst": ("exp(-({u})^2)*sin(3*({u}) + 1)", lambda u: np.exp(-u * u) * np.sin(3.0 * u + 1.0), ()),
}
STEPS = ("tanh", "sign")  # of which the integral does not shrink with the width


@dataclass(frozen=True)
class Drawn:
    """A model, how it starts, its equations (t, y) -> dy/dt, and times between which these are smooth.

    `longest` is the longest step for the reference between the second and the last but one of these times.
    """

    system: System
    parameters: dict[str, float]
    rate: dict[str, float]
    start: np.ndarray
    t_end: float
    equations: Callable[[float, np.ndarray], np.ndarray]
    breaks: tuple[float, ...]
    longest: float


# What a pulse of time, or a wall in x, does; PULSE is one of SHAPES.
MODELS = {
    "force": """
[parameters]
a = 1.0
k = 1.0
c = 0.0
tp = 5.0
w = 1.0
[coordinates]
x = {}
[energy]
kinetic = "dot(x)^2/2"
potential = "k*(1 - cos(x))"
dissipation = "c*dot(x)^2/2"
[forces]
x = "a*PULSE"
""",
    "stiffness": """
[parameters]
a = 1.0
k = 1.0
tp = 5.0
w = 1.0
[coordinates]
x = { start = 0.5 }
y = {}
[energy]
kinetic = "(dot(x)^2 + dot(y)^2)/2"
potential = "k*x^2/2 + (y - x)^2/2"
[forces]
x = "-a*x*PULSE"
""",
    "support": """
[parameters]
a = 1.0
tp = 5.0
w = 1.0
[coordinates]
x = {}
theta = { start = 0.3 }
[energy]
kinetic = "(dot(x)^2 + (dot(x) + dot(theta)*cos(theta))^2 + (dot(theta)*sin(theta))^2)/2"
potential = "-9.81*cos(theta)"
[constraints]
support = "x - a*PULSE"
""",
    "wall as force": """
[parameters]
h = 0.1
b = 2.0
w = 1.0
[coordinates]
x = {}
[energy]
kinetic = "dot(x)^2/2"
[forces]
x = "h*2*(x - b)/w^2*exp(-((x - b)/w)^2)"
""",
    "wall as potential": """
[parameters]
h = 0.1
b = 2.0
w = 1.0
[coordinates]
x = {}
[energy]
kinetic = "dot(x)^2/2"
potential = "h*exp(-((x - b)/w)^2)"
""",
}


@functools.cache
def model(kind: str, shape: str = "") -> System:
    """Return one of MODELS, with a pulse of some shape."""
    pulse = SHAPES[shape][0].format(u="((t - tp)/w)") if shape else ""
    name = f"{kind} {shape}".strip().replace(" ", "_")
    return made(Model.from_toml(f'name = "{name}"' + MODELS[kind].replace("PULSE", pulse)))


def draw(seed: int, index: int) -> tuple[Drawn, str, str, float]:
    """Return a model with its start, what it is in words, a method and rtol."""
    rng = np.random.default_rng([seed, index])
    kind = ("force", "force", "stiffness", "support", "barrier")[index % 5]
    t_end = float(10.0 ** rng.uniform(0.5, 1.5))
    w = float(10.0 ** rng.uniform(-6.0, -1.0)) * t_end
    drawn, says = {"force": _force, "stiffness": _stiffness, "support": _support, "barrier": _wall}[kind](
        rng, t_end, w
    )
    method, rtol = str(rng.choice([*_ADAPTIVE, "auto"])), float(rng.choice(_RTOLS))
    if rng.random() < _PART_FIXED:
        method = str(rng.choice(_FIXED))
    return drawn, f"{says}, width {w / t_end:.1e} of the run", method, rtol


def _place(rng: np.random.Generator, t_end: float, w: float, shape: str) -> tuple[float, tuple[float, ...]]:
    """Return when a pulse is, and times between which it is smooth."""
    tp = float(rng.uniform(0.2, 0.8)) * t_end
    around = [tp - _AROUND * w, *(tp + u * w for u in SHAPES[shape][2]), tp + _AROUND * w]
    return tp, (0.0, *(t for t in around if 0.0 < t < t_end), t_end)


def _height(rng: np.random.Generator, w: float, shape: str) -> float:
    """A pulse that changes the velocity by about one, a step of about one."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.0)) / (1.0 if shape in STEPS else min(w, 1.0))


def _force(rng: np.random.Generator, t_end: float, w: float) -> tuple[Drawn, str]:
    shape = str(rng.choice(list(SHAPES)))
    tp, breaks = _place(rng, t_end, w, shape)
    a, k, c = _height(rng, w, shape), float(rng.choice([0.0, 1.0])), float(rng.choice([0.0, 0.1]))
    pulse = SHAPES[shape][1]

    def equations(t: float, y: np.ndarray) -> np.ndarray:
        return np.array([y[1], a * pulse((t - tp) / w) - k * np.sin(y[0]) - c * y[1]])

    values = {"a": a, "k": k, "c": c, "tp": tp, "w": w}
    return Drawn(
        model("force", shape), values, {}, np.zeros(2), t_end, equations, breaks, 0.25 * w
    ), f"{shape} as force"


def _stiffness(rng: np.random.Generator, t_end: float, w: float) -> tuple[Drawn, str]:
    shape = str(rng.choice(list(SHAPES)))
    tp, breaks = _place(rng, t_end, w, shape)
    a, k, pulse = _height(rng, w, shape), float(rng.uniform(1.5, 3.0)), SHAPES[shape][1]

    def equations(t: float, y: np.ndarray) -> np.ndarray:
        x, z, vx, vz = y
        return np.array([vx, vz, -k * x + (z - x) - a * x * pulse((t - tp) / w), x - z])

    start = np.array([0.5, 0.0, 0.0, 0.0])
    values = {"a": a, "k": k, "tp": tp, "w": w}
    return Drawn(
        model("stiffness", shape), values, {}, start, t_end, equations, breaks, 0.25 * w
    ), f"{shape} as stiffness"


def _support(rng: np.random.Generator, t_end: float, w: float) -> tuple[Drawn, str]:
    """A pendulum on a support that is moved smoothly: by a step, or there and back."""
    shape = str(rng.choice(["tanh", "gauss"]))
    tp, breaks = _place(rng, t_end, w, shape)
    # The velocity that the jerk leaves is of the order of the shift.
    a = float(rng.uniform(0.05, 0.2))

    def moved(t: float) -> tuple[float, float, float]:
        u = (t - tp) / w
        if shape == "tanh":
            s = np.tanh(u)
            slope = 1.0 - s * s
            return 0.5 * a * (1.0 + s), 0.5 * a * slope / w, -a * s * slope / w**2
        bell = np.exp(-u * u)
        return a * bell, -2.0 * a * u * bell / w, a * (4.0 * u * u - 2.0) * bell / w**2

    def equations(t: float, y: np.ndarray) -> np.ndarray:
        _, _, acceleration = moved(t)
        _, position, _, rate = y
        return np.array(
            [y[2], rate, acceleration, -9.81 * np.sin(position) - acceleration * np.cos(position)]
        )

    x0, v0, _ = moved(0.0)
    start = np.array([x0, 0.3, v0, 0.0])
    values = {"a": a, "tp": tp, "w": w}
    return Drawn(
        model("support", shape), values, {}, start, t_end, equations, breaks, 0.1 * w
    ), f"{shape} moves the support"


def _wall(rng: np.random.Generator, t_end: float, w: float) -> tuple[Drawn, str]:
    """A free body that meets a thin wall or well: it passes it, or is thrown back."""
    written = str(rng.choice(["force", "potential"]))
    v = float(rng.uniform(0.5, 2.0))
    b, width = float(rng.uniform(0.2, 0.8)) * v * t_end, v * w
    # The top of the wall is left alone: the fate there hangs on the last digits.
    h = float(rng.choice([-1.0, 0.5, 0.8, 1.5, 3.0])) * 0.5 * v * v

    def equations(_: float, y: np.ndarray) -> np.ndarray:
        u = (y[0] - b) / width
        return np.array([y[1], 2.0 * h * u / width * np.exp(-u * u)])

    reach = (b - _AROUND * width) / v
    breaks = (
        (0.0, reach, min(reach + 60.0 * w, t_end), t_end)
        if reach > 0.0
        else (0.0, min(60.0 * w, t_end), t_end)
    )
    start = np.array([0.0, v])
    values = {"h": h, "b": b, "w": width}
    drawn = Drawn(model(f"wall as {written}"), values, {"x": v}, start, t_end, equations, breaks, 0.1 * w)
    return drawn, f"{'well' if h < 0.0 else 'wall'} of {h / (0.5 * v * v):.2g} times T as {written}"


def reference(drawn: Drawn) -> tuple[np.ndarray, np.ndarray]:
    """Return the end by SciPy, from break to break, and the ranges of what it goes through."""
    y, seen = drawn.start, [drawn.start]
    places = [t for k, t in enumerate(drawn.breaks) if k == 0 or t > drawn.breaks[k - 1]]
    for k, (t0, t1) in enumerate(pairwise(places)):
        inside = 0 < k < len(places) - 2
        # The ends of a piece belong to what holds inside of it.
        a, b = np.nextafter(t0, t1), np.nextafter(t1, t0)
        done = solve_ivp(
            drawn.equations, (a, b), y, method="DOP853", rtol=1e-11, atol=1e-13,
            max_step=drawn.longest if inside else np.inf,
        )  # fmt: skip
        y = done.y[:, -1]
        seen += list(done.y.T)
    return y, np.ptp(np.array(seen), axis=0)


def case(seed: int, index: int) -> Outcome:
    """Judge a case."""
    drawn, says, method, rtol = draw(seed, index)
    says = f"{says}, {method} at {rtol:g}"
    run = attempt(
        drawn.system, drawn.t_end, method=method, rtol=rtol, atol=1e-2 * rtol, parameters=drawn.parameters,
        rate=drawn.rate,
    )  # fmt: skip
    flagged = flag(run)
    if flagged is not None and (isinstance(run, Outcome) or run.status not in ("success", "terminated")):
        return Outcome(flagged.verdict, f"{says}: {flagged.says}")
    end, size = reference(drawn)
    size = np.maximum(size, 1e-3 * np.abs(end))
    error = float((np.abs(run.states[-1] - end) / size).max())
    says = f"{says}: error {error:.1e}"
    if flagged is not None:
        right = error < _RIGHT and not _went_over(drawn, run)
        return Outcome(DOUBTED if right else FLAGGED, f"{says}; {flagged.says}")
    return Outcome(WRONG if not error <= _WRONG else RIGHT, says)


def _went_over(drawn: Drawn, run: Solution) -> bool:
    """Whether no step looked into what is narrow; the end may be right all the same, as behind a wall."""
    first, last = drawn.breaks[1], drawn.breaks[-2]
    ends, lengths = run.step_log.T
    return not np.any((ends > first) & (ends - lengths < last) & (lengths < _LOOKS * drawn.longest))


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for index in range(N_ALL):
        _, says, method, rtol = draw(SEED, index)
        name = f"{index}: {says}, {method} at {rtol:g}"
        yield Scenario(
            "jumped over", name, functools.partial(case, SEED, index), method, short=index < N_SHORT
        )
