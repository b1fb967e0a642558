"""Events of all kinds on motions with closed forms, in random cases: `python -m tests.stress.impacts`.

A parabola or a sine meets a stop, two limits, dry friction, or an event that records, resets or terminates; levels and
times are drawn so that roots fall on starts and ends of steps, on stop times, close together, and where the motion
turns. What fires is compared with the formulas, and gaps with zero. Methods of order 1 are held to their own motion.
"""

from __future__ import annotations

import argparse
import functools
import math
import sys
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime import solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

from .scenario import FLAGGED, REFUSED, RIGHT, WRONG, admits

KINDS = ("stop", "limit", "friction", "terminate", "record", "reset")
MOTIONS = ("parabola", "sine")
RESTITUTIONS = (1.0, 0.999, 0.5, 0.0)
_MOST_IMPACTS = 12  # that are compared, one by one
_STEPS = 60  # of a fixed step, in the time of the motion


@functools.cache
def model(kind: str, motion: str) -> runtime.System:
    """Return a unit mass under a constant force -a or a spring -a x."""
    m = Model(f"{kind}_{motion}")
    x = m.coordinate("x", start=1.0)
    m.body("bob", mass=1.0, com=(x, 0))
    a = m.parameter("a", 1.0)
    level = m.parameter("level", 0.0)
    if kind != "friction":
        e = m.parameter("e", 1.0)
    m.force(x, -a if motion == "parabola" else -a * x)
    if kind == "stop":
        m.stop("s", x - level, e)
    elif kind == "limit":
        m.limit("s", x, level, m.parameter("upper", 2.0), e)
    elif kind == "friction":
        m.friction("s", coordinate="x", force=level)
    elif kind == "reset":
        m.event("s", x - level, direction="falling", then={"reset": {"dot(x)": "-e*dot(x)"}})
    else:
        m.event("s", x - level, direction="both", then=kind)
    return runtime.load(derive_text(m).text)


@dataclass
class Motion:
    """x(t) from a state, until the next event changes it."""

    motion: str
    a: float
    x: float
    v: float
    force: float = 0.0  # of friction

    def at(self, t: float) -> tuple[float, float]:
        """Return x and v after t."""
        if self.motion == "parabola":
            a = self.a - self.force
            return self.x + self.v * t - 0.5 * a * t * t, self.v - a * t
        w, centre = math.sqrt(self.a), self.force / self.a
        c, s = math.cos(w * t), math.sin(w * t)
        return centre + (self.x - centre) * c + self.v / w * s, -(self.x - centre) * w * s + self.v * c

    def crossings(self, level: float, until: float) -> list[float]:
        """Return the times after 0 at which x is at `level`, without those where it only touches."""
        if self.motion == "parabola":
            under = self.v**2 + 2.0 * self.a * (self.x - level)
            if under <= 0.0:
                return []
            # The two roots without cancellation.
            big = self.v + math.copysign(math.sqrt(under), self.v if self.v else 1.0)
            roots = {big / self.a, -2.0 * (self.x - level) / big if big else 0.0}
        else:
            w = math.sqrt(self.a)
            size = math.hypot(self.x, self.v / w)
            if not abs(level) < size:
                return []
            phase = math.atan2(self.v / w, self.x)
            turn = math.atan2(math.sqrt((size - level) * (size + level)), level)
            n = int(until * w / (2.0 * math.pi)) + 3
            roots = {(phase + s * turn + 2.0 * math.pi * k) / w for s in (-1, 1) for k in range(-2, n)}
        return sorted(t for t in roots if 0.0 < t <= until)

    def turns(self) -> float:
        """The time scale."""
        return math.pi / math.sqrt(self.a) if self.motion == "sine" else max(1.0, abs(self.v) / self.a)


@dataclass
class Case:
    """One situation and what happens in it.

    Attributes
    ----------
    times : list of float [s]
        Of the events, in order.
    end : tuple of float
        x and v at the end.
    margin : float
        How far x would have to be off for something else to happen.
    """

    kind: str
    motion: str
    parameters: dict[str, float]
    x: float
    v: float
    t_end: float
    step: float = 0.0
    at: tuple[float, ...] = ()
    times: list[float] = field(default_factory=list)
    end: tuple[float, float] | None = None
    margin: float = math.inf
    speeds: list[float] = field(default_factory=list)  # of impacts
    slant: float = 1.0  # at crossings, in parts of the fastest motion: how well places tell times


def draw(kind: str, random: np.random.Generator) -> Case:
    """Draw a case."""
    motion = str(random.choice(MOTIONS))
    a = float(10.0 ** random.uniform(-0.5, 1.2))
    x, v = (float(random.uniform(0.2, 2.0)), float(random.choice([0.0, random.normal()])))
    e = float(random.choice(RESTITUTIONS))
    path = Motion(motion, a, x, v)
    size = math.hypot(x, v / math.sqrt(a)) if motion == "sine" else x + v * v / (2 * a)
    level = float(random.choice([0.0, random.uniform(-0.9, 0.9) * min(size, x)]))
    if kind in ("record", "terminate") and random.random() < 0.3:
        # Where the motion turns: missed, touched or crossed twice in a short time.
        near = float(random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-9, -2))
        level = size * (1.0 + near) if motion == "parabola" or random.random() < 0.5 else -size * (1.0 + near)
    if kind == "stop" and motion == "sine" and random.random() < 0.1:
        level = -size * (1.0 + float(random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-6, -2)))
    parameters = {"a": a, "level": level, "e": e}
    case = Case(kind, motion, parameters, x, v, t_end=path.turns() * float(random.uniform(1.0, 6.0)))
    if kind == "limit":
        parameters["upper"] = x + float(random.uniform(0.1, 1.5))
    if kind == "friction":
        parameters.pop("e")
        parameters["level"] = a * float(
            random.uniform(0.01, 0.6) if motion == "parabola" else random.uniform(0.005, 0.3)
        )
        case.v = v if motion == "sine" else abs(v) + 0.1
    {"friction": rub, "record": note, "terminate": note}.get(kind, strike)(case)
    if case.times and random.random() < 0.5:
        place(case, float(random.choice(case.times[:3])), random)
    else:
        case.step = path.turns() / _STEPS
    return case


def place(case: Case, root: float, random: np.random.Generator) -> None:
    """Let a root be where a step of a fixed grid, a stop time or the run ends, but for round-off or not at all."""
    root *= 1.0 + float(random.choice([0.0, 1.0, -1.0, 4.0, -4.0, 1e4, -1e4])) * 2.0**-52
    n = max(1, round(_STEPS * root / Motion(case.motion, case.parameters["a"], case.x, case.v).turns()))
    case.step = root / n
    how = random.integers(4)
    if how == 1:
        case.at = (root,)
    elif how == 2:
        case.at = (root * 0.999, root)
    elif how == 3 and case.kind in ("record", "stop", "reset"):
        # Whether what is at the very end has happened is a matter of rounding.
        case.t_end, case.end = root, None
        case.times = [t for t in case.times if t < root * (1.0 - 1e-9)]


def note(case: Case) -> None:
    """Find what is recorded, or what ends the run."""
    path, level = Motion(case.motion, case.parameters["a"], case.x, case.v), case.parameters["level"]
    case.times = path.crossings(level, case.t_end)
    case.slant = min(
        [1.0, *(abs(path.at(t)[1]) / (math.sqrt(path.a) * max(1.0, case.x)) for t in case.times)]
    )
    top = (
        math.hypot(case.x, case.v / math.sqrt(path.a))
        if case.motion == "sine"
        else case.x + case.v**2 / (2 * path.a)
    )
    extremes = (top, -top) if case.motion == "sine" else (top,)
    case.margin = min(abs(level - place) for place in (*extremes, case.x)) / max(1.0, top)
    if case.kind == "terminate" and case.times:
        case.times = case.times[:1]
        case.end = path.at(case.times[0])
    else:
        case.end = path.at(case.t_end)


def strike(case: Case) -> None:
    """Find the impacts of a stop, of limits, or the resets."""
    p, t, path = case.parameters, 0.0, Motion(case.motion, case.parameters["a"], case.x, case.v)
    walls = [p["level"], p["upper"]] if case.kind == "limit" else [p["level"]]
    while len(case.times) < _MOST_IMPACTS:
        hits = [
            (s, wall)
            for wall in walls
            for s in path.crossings(wall, case.t_end - t)
            if into(path, s, wall, p)
        ]
        hits = [hit for hit in hits if hit[0] > 1e-12 * max(t, 1.0)]
        if not hits:
            break
        s, wall = min(hits)
        _, v = path.at(s)
        t += s
        case.speeds.append(abs(v))
        case.times.append(t)
        path = Motion(case.motion, p["a"], wall, -p["e"] * v)
        if abs(path.v) < 1e-3:  # as good as at rest, or about to fall through a reset
            case.margin = 0.0 if case.kind == "reset" else case.margin
            stays = case.kind == "stop" and (case.motion == "parabola" or wall > 0.0)
            case.end = (wall, 0.0) if stays and p["e"] == 0.0 else None
            case.t_end = case.t_end if stays and p["e"] == 0.0 else t + 1e-3 * path.turns()
            return
    if len(case.times) == _MOST_IMPACTS:
        case.t_end = t + 1e-3 * path.turns()
        case.end = None
        return
    case.end = path.at(case.t_end - t)
    if case.motion == "sine":
        size = math.hypot(path.x, path.v / math.sqrt(path.a))
        case.margin = min([case.margin, *(abs(size - abs(wall)) for wall in walls)])


def into(path: Motion, s: float, wall: float, p: dict[str, float]) -> bool:
    """Whether the motion goes through a wall from inside at time s."""
    v = path.at(s)[1]
    return v > 0.0 if wall == p.get("upper") else v < 0.0


def rub(case: Case) -> None:
    """Find where dry friction brings the motion to rest."""
    a, level, t = case.parameters["a"], case.parameters["level"], 0.0
    x, v = case.x, case.v
    while len(case.times) < _MOST_IMPACTS:
        pull = -a if case.motion == "parabola" else -a * x
        if abs(v) < 1e-12 and abs(pull) <= level:
            case.end = (x, 0.0)
            return
        sense = math.copysign(1.0, v if abs(v) >= 1e-12 else pull)
        path = Motion(case.motion, a, x, v, -sense * level)
        if case.motion == "parabola":
            stop = v / (a + sense * level)
            s = stop if stop > 1e-12 else math.inf
        else:
            w, centre = math.sqrt(a), -sense * level / a
            s = (math.atan2(v / w, x - centre) % math.pi) / w
            s = s if s > 1e-9 / w else s + math.pi / w
        if t + s > case.t_end:
            case.end = path.at(case.t_end - t)
            return
        t += s
        x, v = path.at(s)[0], 0.0
        case.times.append(t)
        still = abs(abs(a if case.motion == "parabola" else a * x) - level)
        case.margin = min(case.margin, 0.1 * still / level)
    case.t_end, case.end = t + 1e-3, None


def allowed(method: str, case: Case) -> float:
    """Return how far times and states may be off."""
    found = METHODS[method]
    if found.adaptive:
        return 1e-5
    # Each slow impact, and each turn, multiplies errors.
    order = found.order if case.motion == "sine" or found.order < 2 else max(found.order, 2)
    return max(1e-5, 10.0 * (math.pi / _STEPS) ** order * (1 + len(case.times)))


def judge(case: Case, method: str) -> tuple[str, str]:
    """Run a case and return verdict and reason."""
    fixed = not METHODS[method].adaptive
    system = model(case.kind, case.motion)
    try:
        run = solve(
            system, case.t_end, method=method, step=case.step if fixed else None, at=case.at,
            parameters=case.parameters, start={"x": case.x}, rate={"x": case.v}, max_steps=100_000,
        )  # fmt: skip
    except RuntimeModelError as error:
        return REFUSED, str(error)
    why = differs(case, method, run)
    if not why:
        return (RIGHT, "") if run.ok or run.status == "zeno" else (FLAGGED, said(run))
    return (FLAGGED, said(run)) if not run.ok else (WRONG, why)


def said(run) -> str:
    """Return why a run is not to be trusted."""
    return "; ".join(check.check for check in run.objections) or run.message


def differs(case: Case, method: str, run) -> str:
    """Return in which way a run is not what the formulas say, '' if in none."""
    off, p = allowed(method, case), case.parameters
    if case.kind in ("stop", "limit", "reset"):
        depth = p["level"] - float(run.q.min())
        if case.kind == "reset" and run.status == "zeno":
            return "" if depth <= 1e-6 else f"is {depth:.3g} below the level"
        falls = case.kind == "reset" and (p["e"] == 0.0 or case.margin == 0.0)
        if depth > 1e-6 and not falls:
            return f"is {depth:.3g} below the level"
        if case.kind == "limit" and float(run.q.max()) - p["upper"] > 1e-6:
            return "is above the upper limit"
    if METHODS[method].order < 2 or case.margin < off:
        return ""
    names = ("impact",) if case.kind in ("stop", "limit") else ()
    times = [event.t for event in run.events if not names or event.action in names]
    if case.kind == "friction":
        times = [t for t in times if t > 1e-9]
    for k, t in enumerate(case.times):
        if k >= 6 and min(case.speeds, default=1.0) < 1e-3:
            break
        if k >= len(times):
            if t > case.t_end - off:
                break  # it may be due behind the end
            return f"{len(times)} events, the one at {t:.9g} is missing"
        late = abs(times[k] - t)
        slant = case.speeds[k] / max(case.speeds) if case.speeds else case.slant
        if late > off * max(1.0, t) / max(slant, 1e-3):
            if not case.speeds or not admits(run, late * case.speeds[k] / np.ptp(run.q)):
                return f"event {k} at {times[k]:.9g}, not at {t:.9g}"
    last = max([case.t_end * (1.0 - 1e-9), *case.times])
    surplus = [t for t in times[len(case.times) :] if t < last - off / max(case.slant, 1e-3)]
    if surplus and case.end is not None and not (case.kind in ("stop", "limit") and p["e"] < 1.0):
        return f"an event too many at {surplus[0]:.9g}"
    if case.end is not None and case.kind != "terminate":
        x, v = case.end
        error = abs(run.q[-1, 0] - x)
        if error > 10.0 * off * max(1.0, abs(x), abs(v)) and not admits(run, error / np.ptp(run.q)):
            return f"ends at {run.q[-1, 0]:.9g}, not at {x:.9g}"
    return ""


def main() -> int:
    """Run as a command."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.stress.impacts", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--count", type=int, default=1000, help="cases of each kind for each method (1000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--methods", nargs="*", default=list(METHODS))
    parser.add_argument("--kinds", nargs="*", default=list(KINDS))
    parser.add_argument("--show", type=int, default=3, help="wrong cases to show of each method and kind")
    chosen = parser.parse_args()
    print("| method | tried | right | refused | flagged | wrong |\n|---|---|---|---|---|---|")
    total: Counter[str] = Counter()
    for method in chosen.methods:
        counts: Counter[str] = Counter()
        for kind in chosen.kinds:
            found = try_many(kind, method, chosen.count, chosen.seed, chosen.show)
            counts += found
        total += counts
        print(row(method, counts), flush=True)
    print(row("all", total))
    return int(total[WRONG] > 0)


def row(name: str, counts: Counter[str]) -> str:
    """Return a row of the table."""
    cells = [sum(counts.values()), *(counts[verdict] for verdict in (RIGHT, REFUSED, FLAGGED, WRONG))]
    return f"| {name} | " + " | ".join(map(str, cells)) + " |"


def try_many(kind: str, method: str, count: int, seed: int, show: int = 0) -> Counter[str]:
    """Try cases of one kind with one method; returns how many had each verdict."""
    counts: Counter[str] = Counter()
    for number in range(count):
        case = draw(kind, np.random.default_rng([seed, KINDS.index(kind), number]))
        verdict, why = judge(case, method)
        counts[verdict] += 1
        if verdict == REFUSED and number == 0 and METHODS[method].refusal(model(kind, case.motion)):
            return counts
        if verdict == WRONG and counts[WRONG] <= show:
            print(f"WRONG {kind} {method} number {number}: {why}", file=sys.stderr)
        if verdict == FLAGGED and show > 5 and counts[FLAGGED] <= show:
            print(f"flagged {kind} {method} number {number}: {why}", file=sys.stderr)
    return counts


if __name__ == "__main__":
    sys.exit(main())
