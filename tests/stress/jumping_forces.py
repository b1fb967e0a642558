"""Forces that jump or have a kink in the state, against closed forms: `python -m tests.stress.jumping_forces`.

A unit mass on a line; its force is a - k x between places at which it jumps or bends. In each region the motion is a
parabola or a sine; where it leaves the region follows by bisection on the closed form. Other settings have the same
motion: along a circle that constraints keep it on, in every form (`circle`), of a body that turns meanwhile (`body`),
with the force switched on by an input over time (`input`), and in a run that is cut and taken up again (`resumed`).
"""

from __future__ import annotations

import argparse
import functools
import math
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime import solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.recording.resume import Resumed

from .cuts import recorded
from .impacts import row
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

ADAPTIVE = tuple(name for name, method in METHODS.items() if method.adaptive)
RTOLS = (1e-3, 1e-5, 1e-8)
SETTINGS = ("line", "circle", "body", "input", "resumed")
IN_FORMS = tuple(
    f"{name}/{form}"
    for form in FORMS
    for name in FORMS[form]
    if METHODS[name].adaptive and form != "projection"
)
_WRONG = 0.05  # of the motion
_RADIUS = 10.0
_STEPS = 400  # of a staircase to either side


@dataclass(frozen=True)
class Kind:
    """A force as text, and as (places, [(a, k) of each region]) for its parameters."""

    force: str
    regions: Callable[[dict[str, float]], tuple[list[float], list[tuple[float, float]]]]
    in_energy: bool = False


KINDS = {
    "sign": Kind("-c*sign(x - b)", lambda p: ([p["b"]], [(p["c"], 0.0), (-p["c"], 0.0)])),
    "sign and spring": Kind("-k*x - c*sign(x - b)", lambda p: ([p["b"]], [(p["c"], p["k"]), (-p["c"], p["k"])])),
    "box": Kind(
        "-k*x + c*(sign(x - b) - sign(x - b - w))",
        lambda p: ([p["b"], p["b"] + p["w"]], [(0.0, p["k"]), (2.0 * p["c"], p["k"]), (0.0, p["k"])]),
    ),
    "max": Kind(
        "c*max(0, 10*(b - x)) - k",
        lambda p: ([p["b"]], [(10.0 * p["c"] * p["b"] - p["k"], 10.0 * p["c"]), (-p["k"], 0.0)]),
    ),
    "abs": Kind(
        "-k*x - c*abs(x - b)",
        lambda p: ([p["b"]], [(-p["c"] * p["b"], p["k"] - p["c"]), (p["c"] * p["b"], p["k"] + p["c"])]),
    ),
    "heaviside": Kind("-k*x - c*heaviside(x - b)", lambda p: ([p["b"]], [(0.0, p["k"]), (-p["c"], p["k"])])),
    "where": Kind("-where(x <= b, k, 2*k)*x", lambda p: ([p["b"]], [(0.0, p["k"]), (0.0, 2.0 * p["k"])])),
    "where of two": Kind(
        "-k*x + where(b < x and x < b + w, 2*c, 0)",
        lambda p: ([p["b"], p["b"] + p["w"]], [(0.0, p["k"]), (2.0 * p["c"], p["k"]), (0.0, p["k"])]),
    ),
    "where without value": Kind(
        "where(not x > b, c - k*x, -c - k*x*log(2 + x - b)/log(2 + x - b))",
        lambda p: ([p["b"]], [(p["c"], p["k"]), (-p["c"], p["k"])]),
    ),
    "floor": Kind(
        "-c*floor((x - b)/(10*w))",
        lambda p: (
            [p["b"] + 10.0 * p["w"] * j for j in range(-_STEPS, _STEPS + 1)],
            [(-p["c"] * j, 0.0) for j in range(-_STEPS - 1, _STEPS + 1)],
        ),
    ),
    "where of a potential": Kind(
        "k*x^2/2 + where(x < b, c*x, c*b)", lambda p: ([p["b"]], [(-p["c"], p["k"]), (0.0, p["k"])]), in_energy=True
    ),
    "min of a potential": Kind(
        "k*x^2/2 + min(c*x, c*b)", lambda p: ([p["b"]], [(-p["c"], p["k"]), (0.0, p["k"])]), in_energy=True
    ),
    "abs in a potential": Kind(
        "k*x^2/2 + c*abs(x - b)", lambda p: ([p["b"]], [(p["c"], p["k"]), (-p["c"], p["k"])]), in_energy=True
    ),
}  # fmt: skip


@functools.cache
def module(name: str, setting: str) -> str:
    """Return the module of the mass under a kind of force, in one of SETTINGS."""
    m = Model("jumping")
    force, along = KINDS[name].force, "x"
    if setting == "circle":
        x, y = m.coordinate("X", start=_RADIUS), m.coordinate("Y", start=0.0)
        m.body("bob", mass=1.0, com=(x, y))
        m.constraint("circle", x**2 + y**2 - _RADIUS**2)
        along = f"({_RADIUS}*atan2(Y, X))"
    elif setting == "body":
        m.body("bob", mass=1.0, inertia=[0.1, 0.1, 0.1])
        m.joint("fly", "free", child="bob")
        along = "fly_x"
    else:
        m.body("bob", mass=1.0, com=(m.coordinate("x", start=1.0), 0))
    force = re.sub(r"\bx\b", along, force)
    for key, value in (("b", 0.0), ("c", 1.0), ("k", 1.0), ("w", 0.1)):
        m.parameter(key, value)
    if KINDS[name].in_energy:
        m.potential(force)
        return derive_text(m).text
    if setting == "input":
        m.input("on")
        force = f"on*({force})"
    if setting == "circle":
        m.force("X", f"-Y/{_RADIUS}*({force})")
        m.force("Y", f"X/{_RADIUS}*({force})")
    else:
        m.force(along, force)
    return derive_text(m).text


@functools.cache
def model(name: str, setting: str = "line") -> runtime.System:
    """Return that model, loaded."""
    return runtime.load(module(name, setting))


def given(setting: str, x: float, v: float, t_end: float) -> dict[str, Any]:
    """Return how a run in a setting starts, and what drives it."""
    if setting == "circle":
        c, s = math.cos(x / _RADIUS), math.sin(x / _RADIUS)
        return {"start": {"X": _RADIUS * c, "Y": _RADIUS * s}, "rate": {"X": -v * s, "Y": v * c}}
    if setting == "body":
        return {"start": {"fly_x": x}, "rate": {"fly_vx": v, "fly_wx": 1.0, "fly_wy": -2.0, "fly_wz": 0.5}}
    driven = {"inputs": {"on": ([0.0, t_end], [1.0, 1.0])}} if setting == "input" else {}
    return {"start": {"x": x}, "rate": {"x": v}, **driven}


def seen(setting: str, run: Solution) -> np.ndarray:
    """Return x over a run."""
    if setting == "circle":
        return _RADIUS * np.arctan2(run["Y"], run["X"])
    return run["fly_x"] if setting == "body" else run["x"]


def draw(name: str, random: np.random.Generator) -> tuple[dict[str, float], float, float, float]:
    """Return parameters, start, rate and the end of a run."""
    p = {
        "b": float(random.choice([0.0, random.uniform(-0.5, 0.5)])),
        "c": float(10.0 ** random.uniform(-1.0, 0.5)),
        "k": float(10.0 ** random.uniform(-0.5, 1.0)),
        "w": float(10.0 ** random.uniform(-3.0, -0.3)),
    }
    if name == "floor":
        p["w"] = max(p["w"], 0.01)
    if name == "abs":
        p["c"] = 0.8 * p["k"] * float(random.uniform(0.1, 1.0))
    return (
        p,
        float(random.uniform(0.6, 2.0)),
        float(random.choice([0.0, random.normal()])),
        float(random.uniform(5.0, 60.0)),
    )


def position(a: float, k: float, x: float, v: float, t: float) -> tuple[float, float]:
    """Return x and v after t under the force a - k x."""
    if k == 0.0:
        return x + v * t + 0.5 * a * t * t, v + a * t
    w, centre = math.sqrt(k), a / k
    c, s = math.cos(w * t), math.sin(w * t)
    return centre + (x - centre) * c + v / w * s, v * c - (x - centre) * w * s


def exact(kind: Kind, p: dict[str, float], x: float, v: float, times: np.ndarray) -> tuple[np.ndarray, float]:
    """Return x at some times, and how far any turn was from a place: what touches one may go either way."""
    places, regions = kind.regions(p)
    result, t, margin = np.zeros(len(times)), 0.0, math.inf
    here = sum(x > place for place in places)
    done = 0
    while done < len(times):
        a, k = regions[here]
        left = places[here - 1] if here else -math.inf
        right = places[here] if here < len(places) else math.inf
        leave, side, near = exit_time(a, k, x, v, left, right, times[-1] - t)
        margin = min(margin, near)
        while done < len(times) and times[done] <= t + leave:
            result[done] = position(a, k, x, v, times[done] - t)[0]
            done += 1
        if math.isinf(leave):
            break
        x, v = position(a, k, x, v, leave)
        x = right if side > 0 else left
        t, here = t + leave, here + side
    return result, margin


def exit_time(
    a: float, k: float, x: float, v: float, left: float, right: float, until: float
) -> tuple[float, int, float]:
    """Return when and on which side (1: right) the motion leaves a region, and how near it turned to a border."""
    turns = turning_times(a, k, x, v, until)
    before, near = 0.0, math.inf
    for turn in [*turns, until]:
        y = position(a, k, x, v, turn)[0]
        near = min(near, abs(y - left), abs(y - right)) if turn < until else near
        for border, side in ((left, -1), (right, 1)):
            if side * (y - border) > 0.0:
                beyond = functools.partial(past_border, a, k, x, v, border, side)
                return bisect(beyond, before, turn), side, near
        before = turn
    return math.inf, 0, near


def past_border(a: float, k: float, x: float, v: float, border: float, side: int, t: float) -> float:
    """Return how far beyond a border the motion is after t."""
    return side * (position(a, k, x, v, t)[0] - border)


def turning_times(a: float, k: float, x: float, v: float, until: float) -> list[float]:
    """Return the times after 0 at which the motion turns."""
    if k == 0.0:
        return [-v / a] if a * v < 0.0 and -v / a < until else []
    w = math.sqrt(k)
    first = math.atan2(v / w, x - a / k) % math.pi
    n = int(until * w / math.pi) + 1
    return [s for s in ((first + j * math.pi) / w for j in range(n)) if 1e-12 < s < until]


def bisect(f: Callable[[float], float], before: float, past: float) -> float:
    """Return the root of a rising function."""
    for _ in range(100):
        middle = 0.5 * (before + past)
        before, past = (middle, past) if f(middle) < 0.0 else (before, middle)
    return past


def judge(
    name: str, method: str, rtol: float, random: np.random.Generator, setting: str = "line"
) -> tuple[str, str]:
    """Run a random case and return verdict and reason; a method may be followed by a form, as in radau5/ggl."""
    p, x, v, t_end = draw(name, random)
    if name in ("abs", "max", "floor"):
        t_end = min(t_end, 20.0)
    method, _, form = method.partition("/")
    options = {
        "method": method, "constraints": form or "auto", "rtol": rtol, "atol": rtol * 1e-2, "parameters": p,
        "max_steps": 200_000, **given(setting, x, v, t_end),
    }  # fmt: skip
    try:
        if setting == "resumed":
            run, broken = cut_and_resumed(name, options, t_end, t_end * float(random.uniform(0.02, 0.98)))
            if broken:
                return WRONG, broken
        else:
            run = solve(model(name, setting), t_end, **options)
    except RuntimeModelError as error:
        return REFUSED, str(error)
    expected, margin = exact(KINDS[name], p, x, v, run.t)
    error = float(np.abs(seen(setting, run) - expected).max() / (np.ptp(expected) or 1.0))
    if not run.ok:
        return FLAGGED, "; ".join(check.check for check in run.objections) or run.message
    if error > _WRONG and margin > 1e-3:
        return WRONG, f"off by {error:.2g}: {p}, x = {x}, v = {v}, to {t_end}"
    return RIGHT, f"{error:.1e}"


def cut_and_resumed(name: str, options: dict[str, Any], t_end: float, cut: float) -> tuple[Solution, str]:
    """Return a run, and in which way it is not the one that is cut and taken up again."""
    text = module(name, "resumed")
    whole = solve(model(name, "resumed"), t_end, **options)
    options = {**options, **({"step": whole.step} if whole.step else {})}
    with tempfile.TemporaryDirectory() as folder:
        first = Path(folder) / "first.rrd"
        recorded(first, text, functools.partial(solve, model(name, "resumed"), cut, **options))
        rest = recorded(Path(folder) / "rest.rrd", text, functools.partial(Resumed(first).run, t_end))
    same = rest.q[-1].tobytes() == whole.q[-1].tobytes() and rest.v[-1].tobytes() == whole.v[-1].tobytes()
    return whole, "" if same or not whole.ok else f"ends elsewhere when it is cut at {cut!r}"


def main() -> int:
    """Run as a command."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.stress.jumping_forces", description=__doc__.splitlines()[0]
    )
    parser.add_argument(
        "--count", type=int, default=100, help="cases of each force, for each method and tolerance (100)"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--settings", nargs="*", default=list(SETTINGS), choices=SETTINGS)
    parser.add_argument(
        "--methods", nargs="*", help="all that are adaptive; such as radau5, or radau5/ggl on the circle"
    )
    chosen = parser.parse_args()
    print("| setting, method | tried | right | refused | flagged | wrong |\n|---|---|---|---|---|---|")
    total: Counter[str] = Counter()
    for setting in chosen.settings:
        for method in chosen.methods or [*ADAPTIVE, *(IN_FORMS if setting == "circle" else ())]:
            counts: Counter[str] = Counter()
            for name in KINDS:
                counts += try_many(name, method, chosen.count, chosen.seed, setting)
            total += counts
            print(row(f"{setting}, {method}", counts), flush=True)
    print(row("all", total))
    return int(total[WRONG] > 0)


def try_many(name: str, method: str, count: int, seed: int, setting: str = "line") -> Counter[str]:
    """Try cases of one force at all tolerances; returns how many had each verdict."""
    counts: Counter[str] = Counter()
    if setting == "input" and KINDS[name].in_energy:
        return counts  # no force that an input could switch
    if "/" not in method and method != "auto" and METHODS[method].refusal(model(name, setting)):
        counts[REFUSED] = count * len(RTOLS)
        return counts
    for rtol in RTOLS:
        for number in range(count):
            verdict, why = judge(
                name, method, rtol, np.random.default_rng([seed, list(KINDS).index(name), number]), setting
            )
            counts[verdict] += 1
            if verdict in (WRONG, FLAGGED):
                print(f"{verdict} {setting} {name} {method} {rtol} number {number}: {why}", file=sys.stderr)
    return counts


if __name__ == "__main__":
    sys.exit(main())
