"""Blocks on plates that shake in three directions, with friction in a plane: `python -m tests.stress.plates`.

Accelerations of the plate are two sines in each direction along it and one across; amplitudes, frequencies, masses and
both coefficients are drawn, so that blocks slide for ever, stick for ever, or stick, slip and turn, from rest or not.
The friction is of a given size, or in proportion to what a stop carries. Each case is compared with an integration
phase by phase in polar coordinates (plate_phases.py).
"""

from __future__ import annotations

import argparse
import functools
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime import solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

from .impacts import row, said
from .plate_phases import Course, Plate, course
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario, admits

KINDS = ("given", "stop")
G = 9.81
ADAPTIVE = tuple(name for name, method in METHODS.items() if method.adaptive)
FIXED = ("rk4", "implicit_midpoint", "gauss4", "gauss8", "generalized_alpha", "implicit_euler")
_STEPS = 4000  # of a fixed step in a case
_ALLOWED = 1e-5  # of the extent; of the time for events
# Fixed steps come to rest, and begin to slide, within one of them.
_ALLOWED_FIXED = 1e-2
_CLOSE = 1e-3  # decisions that are closer go either way
_WAVES = 2
_SEED, _N_ALL, _SHORT = 1, 3, ("dop853", "rk4")  # of the suite


@functools.cache
def model(kind: str) -> runtime.System:
    """Return a block in the plate's frame; the plate accelerates by sines."""
    m = Model(f"plate_{kind}")
    x, y = m.coordinate("x", start=0.0), m.coordinate("y", start=0.0)
    mass, mu, mu_s = m.parameters(mass=1.0, mu=0.3, mu_s=0.3)
    sums = {}
    for axis, count in (("x", _WAVES), ("y", _WAVES), ("z", 1)):
        for k in range(count):
            m.parameters(**{f"a{axis}{k}": 1.0, f"w{axis}{k}": 1.0, f"p{axis}{k}": 0.0})
        sums[axis] = " + ".join(f"a{axis}{k}*sin(w{axis}{k}*t + p{axis}{k})" for k in range(count))
    for axis in "xy":
        m.force(axis, f"-mass*({sums[axis]})")
    if kind == "given":
        m.body("block", mass=mass, com=(x, y))
        weight = f"mass*({G} + {sums['z']})"
        m.friction("sole", coordinates=(x, y), force=f"mu*{weight}", static=f"mu_s*{weight}")
    else:
        z = m.coordinate("z", start=0.0)
        m.body("block", mass=mass, com=(x, y, z))
        m.force(z, f"-mass*({G} + {sums['z']})")
        m.stop("plate", z)
        m.friction("sole", coordinates=(x, y), coefficient=mu, static=mu_s, normal="plate")
    return runtime.load(derive_text(m).text)


@dataclass
class Case:
    """A block on a plate, and what becomes of it."""

    parameters: dict[str, float]
    velocity: tuple[float, float]
    t_end: float
    course: Course


@functools.lru_cache(maxsize=4096)
def draw(seed: int, number: int) -> Case:
    """Draw a case, and follow it."""
    random = np.random.default_rng([seed, number])
    mu = float(random.uniform(0.1, 0.6))
    mu_s = mu * float(random.choice([1.0, 1.0, random.uniform(1.01, 1.6)]))
    p = {"mass": float(10.0 ** random.uniform(-1, 2)), "mu": mu, "mu_s": mu_s}
    size = mu_s * G * float(random.uniform(0.6, 2.0))
    slow = float(random.uniform(2.0, 8.0))
    for axis, count in (("x", _WAVES), ("y", _WAVES), ("z", 1)):
        for k in range(count):
            p[f"a{axis}{k}"] = size * float(random.uniform(0.2, 1.0)) * (0.5 if k else 1.0)
            p[f"w{axis}{k}"] = slow * float(random.uniform(0.7, 2.0)) * (1 + k)
            p[f"p{axis}{k}"] = float(random.uniform(0.0, 2.0 * np.pi))
    p["az0"] = float(random.choice([0.0, random.uniform(0.0, 0.6) * G]))
    velocity = (0.0, 0.0) if random.random() < 0.5 else tuple(float(v) for v in random.normal(size=2))
    t_end = 15.0 / slow * float(random.uniform(0.7, 1.3))

    def wave(axis: str, t: float) -> float:
        count = 1 if axis == "z" else _WAVES
        return sum(p[f"a{axis}{k}"] * np.sin(p[f"w{axis}{k}"] * t + p[f"p{axis}{k}"]) for k in range(count))

    plate = Plate(lambda t: np.array([-wave("x", t), -wave("y", t)]), lambda t: G + wave("z", t), mu, mu_s)
    return Case(p, velocity, t_end, course(plate, t_end, velocity))


def judge(case: Case, kind: str, method: str) -> tuple[str, str]:
    """Run a case and return verdict and reason."""
    fixed = not METHODS[method].adaptive
    try:
        run = solve(
            model(kind), case.t_end, method=method, step=case.t_end / _STEPS if fixed else None,
            parameters=case.parameters, rate=dict(zip("xy", case.velocity)), max_steps=400_000,
        )  # fmt: skip
    except RuntimeModelError as error:
        return REFUSED, str(error)
    if not run.ok:
        return FLAGGED, said(run)
    why = differs(case, method, run)
    return (WRONG, why) if why else (RIGHT, "")


def differs(case: Case, method: str, run) -> str:
    """Return in which way a run is not what its phases say, '' if in none."""
    expected = case.course
    if expected.margin < _CLOSE:
        return ""
    adaptive = METHODS[method].adaptive
    extent = max(expected.extent, 1e-3)
    error = float(np.hypot(*(run.q[-1, :2] - expected.place))) / extent
    if error > (_ALLOWED if adaptive else _ALLOWED_FIXED) and not admits(run, error):
        return f"ends {error:.3g} of the way off"
    if not adaptive:
        return ""
    events = [(e.action, e.t) for e in run.events if e.name == "sole" and e.t > 1e-9]
    if [what for what, _ in events] != [what for what, t in expected.events if t > 1e-9]:
        return f"{events[:6]}, not {expected.events[:6]}"
    late = max((abs(a[1] - b[1]) for a, b in zip(events, expected.events)), default=0.0)
    return f"an event is {late:.3g} s off" if late > _ALLOWED * case.t_end else ""


def try_many(kind: str, method: str, count: int, seed: int, show: int = 0) -> Counter[str]:
    """Try cases of one kind with one method; returns how many had each verdict."""
    counts: Counter[str] = Counter()
    for number in range(count):
        verdict, why = judge(draw(seed, number), kind, method)
        counts[verdict] += 1
        if (verdict == WRONG and counts[WRONG] <= show) or (
            verdict == FLAGGED and counts[FLAGGED] <= show - 3
        ):
            print(f"{verdict} {kind} {method} number {number}: {why}", file=sys.stderr)
    return counts


def scenarios() -> Iterator[Scenario]:
    """Yield some cases of each kind for each method."""
    for kind in KINDS:
        for method in (*ADAPTIVE, *FIXED):
            for number in range(_N_ALL):
                short = number == 0 and method in _SHORT
                run = functools.partial(_outcome, number, kind, method)
                yield Scenario("friction in a plane", f"plate {number}, {kind}: {method}", run, method, short)


def _outcome(number: int, kind: str, method: str) -> Outcome:
    return Outcome(*judge(draw(_SEED, number), kind, method))


def main() -> int:
    """Run as a command."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.stress.plates", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--count", type=int, default=100, help="cases of each kind for each method (100)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--methods", nargs="*", default=[*ADAPTIVE, *FIXED])
    parser.add_argument("--kinds", nargs="*", default=list(KINDS))
    parser.add_argument("--show", type=int, default=3, help="wrong cases to show of each method and kind")
    chosen = parser.parse_args()
    print("| method | tried | right | refused | flagged | wrong |\n|---|---|---|---|---|---|")
    total: Counter[str] = Counter()
    for method in chosen.methods:
        counts: Counter[str] = Counter()
        for kind in chosen.kinds:
            counts += try_many(kind, method, chosen.count, chosen.seed, chosen.show)
        total += counts
        print(row(method, counts), flush=True)
    print(row("all", total))
    return int(total[WRONG] > 0)


if __name__ == "__main__":
    sys.exit(main())
