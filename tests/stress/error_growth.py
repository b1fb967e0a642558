"""Random runs, right and wrong, against independent references: does the health report tell them apart?

`python -m tests.stress.error_growth --cases 300 --seed 1` draws models, starts, methods, forms of the constraints,
tolerances or steps, and times up to far beyond the horizon of chaotic ones. The reference is `taylor` at 1e-15, as
far as `dop853` at 1e-14 agrees with it (of stiff models `radau13`); beyond that no run can be right.
"""

from __future__ import annotations

import argparse
import functools
import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from symgen import Model, cos, dot, sin, sqrt, t
from symgen.runtime import System, solve
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS

from . import drawn_motions, perturbed
from .drawn_motions import PLAIN as _PLAIN
from .drawn_motions import WITH_EVENTS as _WITH_EVENTS
from .drawn_motions import Draw
from .judging import attempt
from .models import bundled, made
from .scenario import DOUBTED, FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario

N_CASES, N_DRAWN, N_PERTURBED = 600, 240, 102
_RTOLS = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
_STEPS = (0.5, 1.0, 2.0, 4.0)  # of the default
_STEPS_OF_LONG = (0.25, 0.5, 1.0, 2.0)
_WRONG, _RIGHT = 0.1, 0.01  # largest error of a coordinate or rate, in parts of its range
_AGREE = 3e-3  # up to there two references know the motion
_MOST_STEPS, _MOST_STEPS_OF_LONG = 150_000, 1_000_000
_LEAST_RANGE = 1e-8  # of the largest coordinate: what moves less is at rest
_UNDER, _TOO_SMALL_TO_COUNT = (
    20.0,
    1e-6,
)  # times an estimate that says too little; errors that nobody asks for
_REST = 1e-12  # what moves by no more is at rest
_LEAST_FRAMES = 3  # of references
FALSE, NO_REFERENCE = "right but flagged", "without a reference"
_STIFF = (("radau13", 1e-13), ("taylor", 1e-14))


@functools.cache
def saddle() -> System:
    model = Model("saddle")
    x = model.coordinate("x", start=1e-6)
    model.kinetic(dot(x) ** 2 / 2)
    model.potential(cos(x))
    return made(model)


@functools.cache
def kepler() -> System:
    model = Model("kepler")
    x, y = model.coordinate("x", start=1.0), model.coordinate("y", rate=1.0)
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential(-1 / sqrt(x**2 + y**2))
    return made(model)


@functools.cache
def henon_heiles() -> System:
    model = Model("henon_heiles")
    x, y = model.coordinate("x"), model.coordinate("y")
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential((x**2 + y**2) / 2 + x**2 * y - y**3 / 3)
    return made(model)


@functools.cache
def tiny_beside_large() -> System:
    """A light oscillation driven by a large one, scaled by a parameter."""
    model = Model("tiny_beside_large")
    s = model.parameters(s=1e-7)
    x, y = model.coordinate("x", start=1.0), model.coordinate("y")
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential(x**2 / 2 + 9 * y**2 / 2)
    model.force(y, s * x**2)
    return made(model)


@functools.cache
def duffing() -> System:
    model = Model("duffing")
    a = model.parameters(a=0.5)
    x = model.coordinate("x", start=0.5)
    model.kinetic(dot(x) ** 2 / 2)
    model.potential(x**4 / 4 - x**2 / 2)
    model.force(x, -dot(x) / 4 + a * cos(1.2 * t))
    return made(model)


@functools.cache
def cartesian_double_pendulum() -> System:
    model = Model("cartesian_double_pendulum", gravity=(0, -9.81))
    places = [model.coordinate(name) for name in ("x1", "y1", "x2", "y2")]
    x1, y1, x2, y2 = places
    model.body("one", mass=1, com=(x1, y1))
    model.body("two", mass=1, com=(x2, y2))
    model.constraint("rod1", (x1**2 + y1**2 - 1) / 2)
    model.constraint("rod2", ((x2 - x1) ** 2 + (y2 - y1) ** 2 - 1) / 2)
    return made(model)


@functools.cache
def damped_chain() -> System:
    """Three masses with springs and dampers, stiff in one of them."""
    model = Model("damped_chain")
    k, c = model.parameters(k=1e4, c=50.0)
    xs = [model.coordinate(f"x{i}") for i in range(3)]
    model.kinetic(sum(dot(x) ** 2 for x in xs) / 2)
    model.potential(xs[0] ** 2 / 2 + (xs[1] - xs[0]) ** 2 + k * (xs[2] - xs[1]) ** 2 / 2)
    model.dissipation(0.02 * dot(xs[0]) ** 2 + c * (dot(xs[2]) - dot(xs[1])) ** 2 / 2)
    return made(model)


@functools.cache
def two_scenes() -> System:
    """A chaotic and a regular pendulum that have nothing to do with each other."""
    model = Model("two_scenes", gravity=(0, -9.81))
    a, b, c = (model.coordinate(name) for name in "abc")
    model.body("one", mass=1, com=(sin(a), -cos(a)))
    model.body("two", mass=1, com=(sin(a) + sin(b), -cos(a) - cos(b)))
    model.body("alone", mass=1, com=(3 + sin(c) / 2, -cos(c) / 2))
    return made(model)


def _pendulum(rng):
    angle = rng.uniform(0.3, 3.0)
    return Draw(bundled("pendulum"), (10.0, 100.0, 1000.0), {"start": {"theta": angle}})


def _double_pendulum(rng):
    start = {"theta1": rng.uniform(0.2, 2.5), "theta2": rng.uniform(0.2, 2.5)}
    return Draw(bundled("double_pendulum"), (5.0, 20.0, 80.0), {"start": start})


def _saddle(rng):
    return Draw(saddle(), (20.0, 100.0, 300.0), {"start": {"x": 10.0 ** rng.uniform(-8, -1)}})


def _kepler(rng):
    e = rng.uniform(0.1, 0.93)
    given = {"start": {"x": 1.0 + e, "y": 0.0}, "rate": {"x": 0.0, "y": float(np.sqrt((1 - e) / (1 + e)))}}
    return Draw(kepler(), (20.0, 150.0, 1000.0), given)


def _henon_heiles(rng):
    energy, y = rng.uniform(0.05, 1 / 6), rng.uniform(-0.3, 0.3)
    rate = float(np.sqrt(max(2 * energy - y**2 + 2 * y**3 / 3, 0.0)))
    return Draw(
        henon_heiles(), (20.0, 150.0, 800.0), {"start": {"x": 0.0, "y": y}, "rate": {"x": rate, "y": 0.0}}
    )


def _tiny(rng):
    given = {"parameters": {"s": 10.0 ** rng.uniform(-8, 0)}, "start": {"x": 1.0, "y": 0.0}}
    return Draw(tiny_beside_large(), (10.0, 50.0, 200.0), given)


def _duffing(rng):
    return Draw(duffing(), (20.0, 100.0, 400.0), {"parameters": {"a": rng.uniform(0.1, 0.8)}})


def _free_body(rng):
    rates = {f"turn_w{axis}": rng.normal(0.0, 1.0) for axis in "xyz"}
    if rng.random() < 0.5:
        rates |= {"turn_wx": 10.0 ** rng.uniform(-8, -1), "turn_wz": 0.0}
    return Draw(bundled("free_rigid_body"), (10.0, 40.0, 300.0), {"rate": rates})


def _slider_crank(rng):
    return Draw(bundled("slider_crank"), (1.0, 5.0, 20.0), {"rate": {"theta": rng.uniform(-20.0, 20.0)}})


def _four_bar(rng):
    return Draw(bundled("four_bar"), (1.0, 5.0, 20.0), {"rate": {"crank": rng.uniform(-15.0, 15.0)}})


def _pendulum_dae(rng):
    a = rng.uniform(0.3, 3.0)
    start = {"x": float(np.sin(a)), "y": float(-np.cos(a))}
    return Draw(bundled("pendulum_dae"), (10.0, 100.0, 500.0), {"start": start})


def _cartesian(rng):
    a, b = rng.uniform(0.2, 2.5, 2)
    start = {"x1": np.sin(a), "y1": -np.cos(a), "x2": np.sin(a) + np.sin(b), "y2": -np.cos(a) - np.cos(b)}
    given = {"start": {name: float(value) for name, value in start.items()}}
    return Draw(cartesian_double_pendulum(), (5.0, 20.0, 80.0), given)


def _top(rng):
    return Draw(bundled("heavy_top_absolute"), (0.2, 1.0, 4.0), {})


def _spring_pendulum(rng):
    start = {"r": rng.uniform(0.9, 1.5), "theta": rng.uniform(0.05, 1.5)}
    return Draw(bundled("spring_pendulum"), (10.0, 60.0, 300.0), {"start": start})


def _rolling_disc(rng):
    return Draw(
        bundled("rolling_disc"),
        (2.0, 10.0, 60.0),
        {"rate": {"yaw": rng.uniform(-1, 1), "spin": rng.uniform(-6, 6)}},
    )


def _chain(rng):
    return Draw(
        damped_chain(), (2.0, 20.0, 100.0), {"start": {"x0": rng.normal(), "x1": rng.normal()}},
        (("radau13", 1e-13), ("dop853", 1e-13)),
    )  # fmt: skip


def _bounces(rng):
    given = {"start": {"y": rng.uniform(0.3, 2.0)}, "parameters": {"e": 1.0}}
    return Draw(bundled("bouncing_ball"), (2.0, 10.0, 60.0), given, _WITH_EVENTS)


def _stick_slip(rng):
    given = {"rate": {"x": rng.uniform(-0.5, 0.3)}}
    return Draw(bundled("stick_slip"), (3.0, 10.0, 40.0), given, _WITH_EVENTS)


def _two_scenes(rng):
    return Draw(two_scenes(), (5.0, 20.0, 80.0), {"start": {name: rng.uniform(0.2, 2.0) for name in "abc"}})


def _default(name: str, references=Draw.references, spread: float = 0.1) -> Callable[..., Draw]:
    """Return draws of a bundled model: its own times, half and three times as long; starts nearby."""

    def draw(rng):
        system = bundled(name)
        t_end = system.run_defaults["t_end"]
        free = [c for c in system.coordinates if c["enforced"] and not system.quaternions and not system.m]
        start = {
            c["name"]: c["value"] + float(rng.normal(0.0, spread * (abs(c["value"]) + 0.1))) for c in free
        }
        return Draw(system, (0.5 * t_end, t_end, 3.0 * t_end), {"start": start}, references)

    draw.__name__ = name
    return draw


def _solar_system(rng):
    return Draw(bundled("outer_solar_system"), (1e4, 1e5, 3e5))


FAMILY: tuple[Callable[[np.random.Generator], Draw], ...] = (
    _pendulum, _double_pendulum, _saddle, _kepler, _henon_heiles, _tiny, _duffing, _free_body, _slider_crank,
    _four_bar, _pendulum_dae, _cartesian, _top, _spring_pendulum, _rolling_disc, _chain, _bounces, _stick_slip,
    _two_scenes, _solar_system,
    *(_default(name) for name in ("spinning_top", "andrews_squeezer", "bricard", "stiff_spring_pendulum", "cart_pole")),
    *(_default(name) for name in ("pendulum_linear", "stewart_platform", "bicycle")),
    *(_default(name, _STIFF) for name in ("car_axis", "quarter_car", "damped_spring_pendulum", "rough_road")),
    _default("stiff_bushing_pendulum", _STIFF), _default("door_stop", _WITH_EVENTS),
    *(_default(name, _PLAIN) for name in ("seven_dof_arm", "n_pendulum", "spring_chain")),
)  # fmt: skip


# Models of few operations, whose long runs have references within seconds.
_LONG = (
    _spring_pendulum, _henon_heiles, _double_pendulum, _kepler, _duffing, _free_body, _pendulum, _saddle, _tiny,
    _two_scenes, _cartesian, _rolling_disc, _default("spinning_top"), _default("cart_pole"),
    _default("spring_chain", _PLAIN), _default("n_pendulum", _PLAIN), _default("damped_spring_pendulum", _STIFF),
    _chain, _four_bar, _slider_crank, _default("bicycle"), _top, _default("stiff_spring_pendulum"), _pendulum_dae,
)  # fmt: skip


def ways(system: System) -> list[tuple[str, str]]:
    """Return all methods with all forms that they have for a model."""
    found = [(name, "auto") for name in ("auto", *METHODS)]
    if system.m:
        found += [(name, form) for form, methods in FORMS.items() for name in methods]
    return found


def reference(draw: Draw, t_end: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool, bool]:
    """Return times, states, what measures them, whether they are known to the end, and whether they are lost."""
    options = {"t_end": t_end, **draw.given, "split": False}
    runs = [
        solve(draw.system, method=name, rtol=rtol, atol=1e-3 * rtol, max_steps=10 * _MOST_STEPS, **options)
        for name, rtol in draw.references
    ]
    n = min(len(run.t) for run in runs)
    n = max(n - int(runs[0].t[n - 1] != runs[1].t[n - 1]), 1)  # where one of them stopped
    one, other = (run.states[:n] for run in runs)
    size = sizes(one)
    off = (np.abs(one - other) / size).max(axis=1)
    if draw.system.switches or any(event["action"] == "reset" for event in draw.system.events):
        off = np.minimum(off, np.append(off[1:], off[-1]))  # a frame between two times of one reset
    bad = np.flatnonzero(~(off < _AGREE))
    known = int(bad[0]) if bad.size else n
    complete = known == n and all(run.status in ("success", "terminated") for run in runs)
    return runs[0].t[:known], one[:known], sizes(one[:known]), complete, bool(np.nanmax(off) > _WRONG)


def sizes(states: np.ndarray) -> np.ndarray:
    """Return the ranges of coordinates and rates; of what is at rest the largest of all."""
    size = np.ptp(states, axis=0)
    return np.maximum(np.where(size > _LEAST_RANGE * size.max(), size, size.max()), _REST)


def draw_case(seed: int, index: int) -> tuple[Draw, dict[str, Any], dict[str, Any]]:
    """Return a model with its start, the arguments of a run, and a factor of its default step."""
    return _drawn_case(np.random.default_rng([seed, index]), FAMILY[index % len(FAMILY)])


def draw_new(seed: int, index: int) -> tuple[Draw, dict[str, Any], dict[str, Any]]:
    """Return as `draw_case` does, of a model that is drawn as well."""
    families = drawn_motions.FAMILIES
    return _drawn_case(np.random.default_rng([seed, index, 13]), families[index % len(families)])


def draw_perturbed(seed: int, index: int) -> tuple[Draw, dict[str, Any], dict[str, Any]]:
    """Return as `draw_case` does, of a bundled model with other parameters, starts and inputs."""
    families = perturbed.FAMILIES
    return _drawn_case(np.random.default_rng([seed, index, 28]), families[index % len(families)])


def _drawn_case(rng, family) -> tuple[Draw, dict[str, Any], dict[str, Any]]:
    drawn = family(rng)
    possible = ways(drawn.system)
    method, form = possible[int(rng.integers(len(possible)))]
    t_end = drawn.times[int(rng.integers(3))] * rng.uniform(0.6, 1.0)
    how: dict[str, Any] = {"method": method, "constraints": form, "t_end": float(t_end)}
    factor = float(rng.choice(_STEPS))
    if method == "auto" or METHODS[method].adaptive:
        rtol = float(rng.choice(_RTOLS))
        how |= {"rtol": rtol, "atol": 0.01 * rtol}
        factor = 1.0
    return drawn, how, {"factor": factor}


def draw_long(seed: int, index: int) -> tuple[Draw, dict[str, Any], dict[str, Any]]:
    """Return as `draw_case` does, but runs of which companions see a part only: long, or with tight tolerances."""
    rng = np.random.default_rng([seed, index, 7])
    drawn = _LONG[index % len(_LONG)](rng)
    possible = ways(drawn.system)
    method, form = possible[int(rng.integers(len(possible)))]
    how: dict[str, Any] = {"method": method, "constraints": form}
    how["t_end"] = float(drawn.times[2] * 10 ** rng.uniform(-0.7, 1.0))
    factor = float(rng.choice(_STEPS_OF_LONG))
    if method == "auto" or METHODS[method].adaptive:
        rtol = float(rng.choice(_RTOLS[1:]))
        how |= {"rtol": rtol, "atol": 0.01 * rtol}
        factor = 1.0
    return drawn, how, {"factor": factor}


def run_case(seed: int, index: int, kind: str = "") -> dict[str, Any]:
    """Run a case, of `_KINDS`; returns what became of it, in numbers."""
    drawn, how, more = _KINDS[kind](seed, index)
    most = _MOST_STEPS_OF_LONG if kind == "long" else _MOST_STEPS
    row: dict[str, Any] = {"index": index, "model": drawn.system.name, **how}
    run = attempt(drawn.system, max_steps=most, **how, **drawn.given)
    if not isinstance(run, Outcome) and run.step and more["factor"] != 1.0:
        how["step"] = more["factor"] * run.step
        run = attempt(drawn.system, max_steps=most, **how, **drawn.given)
    if isinstance(run, Outcome):
        return row | {"verdict": REFUSED, "says": run.says}
    row |= {"step": run.step, "steps": run.stats["steps"], "used": run.method, "ms": 1e3 * run.seconds["run"]}
    if run.status not in ("success", "terminated"):
        return row | {"verdict": "failed", "says": run.message}
    began = time.thread_time()
    objections = {entry.check: entry.says for entry in run.objections}
    row["health_ms"] = 1e3 * (time.thread_time() - began)
    t, states, size, complete, lost = reference(drawn, how["t_end"])
    if len(t) < _LEAST_FRAMES:
        return row | {"verdict": NO_REFERENCE}
    n = min(len(t), len(run.t))
    off = np.abs(run.states[:n] - states[:n]) / size
    if drawn.system.switches or drawn.system.events:
        off = np.minimum(off, np.vstack([off[1:], off[-1:]]))
    error = float(off.max()) if n else 0.0
    row |= {"error": error, "known": complete, "end": float(off[-1].max()), "flags": objections}
    row["wrong"] = error > _WRONG or lost
    row["right"] = error < _RIGHT and complete
    estimate = next((entry.value for entry in run.health if entry.check == "accuracy"), None)
    row |= {"estimate": estimate, "verdict": _verdict(row)}
    # Only what references know to the end is held against an estimate.
    counts = complete and estimate is not None and not row["flags"]
    under = bool(counts and error > max(_UNDER * estimate, _TOO_SMALL_TO_COUNT))
    return row | {"under": under}


_KINDS = {"": draw_case, "long": draw_long, "drawn": draw_new, "perturbed": draw_perturbed}


def _verdict(row: dict[str, Any]) -> str:
    flags = set(row["flags"])
    if row["constraints"] == "none":  # which is for seeing drift, and says so
        flags -= {"constraint position", "constraint velocity"}
    if flags:
        return FALSE if row["right"] else FLAGGED
    if row["flags"]:
        return RIGHT if row["right"] else FLAGGED
    return WRONG if row["wrong"] else RIGHT


def case(seed: int, index: int, kind: str = "") -> Outcome:
    """Judge a case for the stress suite: wrong are silent errors, and right runs that the estimate flags."""
    row = run_case(seed, index, kind)
    says = ", ".join(
        f"{key} {row[key]}" for key in ("model", "used", "t_end", "error", "estimate") if key in row
    )
    verdict = row["verdict"]
    if verdict == FALSE:
        return Outcome(WRONG if "accuracy" in row["flags"] else DOUBTED, says)
    if verdict == NO_REFERENCE and kind in ("drawn", "perturbed"):
        return Outcome(RIGHT, f"{says}: nothing to compare with")
    if verdict == NO_REFERENCE:
        raise AssertionError(f"error growth {index}: references do not agree from the start")
    return Outcome(FLAGGED if verdict == "failed" else verdict, says)


_SHOWN = (44, 124, 159, 517)  # what was wrong and silent once
_SHOWN_OF_DRAWN = (
    (2611, 84),
    (2611, 61),
)  # seeds and indices: errors that grew late; a right one that was doubted


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for index in range(N_CASES):
        yield Scenario(
            "error growth", f"error growth {index}", functools.partial(case, 0, index),
            short=index < 20 or index in _SHOWN,
        )  # fmt: skip
    for index in range(N_DRAWN):
        yield Scenario(
            "drawn motion", f"drawn motion {index}", functools.partial(case, 0, index, "drawn"),
            short=index < len(drawn_motions.FAMILIES),
        )  # fmt: skip
    for index in range(N_PERTURBED):
        yield Scenario(
            "perturbed", f"perturbed {index}", functools.partial(case, 0, index, "perturbed"), short=index % 17 == 5
        )  # fmt: skip
    for seed, index in _SHOWN_OF_DRAWN:
        yield Scenario(
            "drawn motion", f"drawn motion {index} of {seed}", functools.partial(case, seed, index, "drawn"), short=True
        )  # fmt: skip


def main() -> int:
    """Run cases and count."""
    parser = argparse.ArgumentParser(prog="python -m tests.stress.error_growth", description=__doc__)
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument(
        "--long",
        dest="kind",
        action="store_const",
        const="long",
        help="runs of which companions see a part only",
    )
    kinds.add_argument(
        "--drawn", dest="kind", action="store_const", const="drawn", help="models that are drawn, too"
    )
    kinds.add_argument(
        "--perturbed",
        dest="kind",
        action="store_const",
        const="perturbed",
        help="bundled models with other parameters, starts and inputs",
    )
    parser.add_argument("--only", type=int, nargs="*", help="indices of cases")
    parser.add_argument("--json", type=Path, metavar="FILE")
    chosen = parser.parse_args()
    counts: Counter[str] = Counter()
    lines = chosen.json.open("w", encoding="utf-8") if chosen.json else None
    n_right = by_estimate = under = 0
    for index in chosen.only or range(chosen.first, chosen.first + chosen.cases):
        row = run_case(chosen.seed, index, chosen.kind or "")
        counts[row["verdict"]] += 1
        n_right += bool(row.get("right"))
        by_estimate += row["verdict"] == FALSE and "accuracy" in row["flags"]
        if lines:
            print(json.dumps(row), file=lines, flush=True)
        under += bool(row.get("under"))
        if row["verdict"] in (WRONG, FALSE) or row.get("under") or chosen.only:
            print({key: value for key, value in row.items()}, flush=True)
    print(
        f"{sum(counts.values())} tried, {n_right} right ones, {by_estimate} of them flagged by accuracy, "
        f"{under} estimates below a twentieth of the error: {dict(counts)}"
    )
    return int(counts[WRONG] > 0)


if __name__ == "__main__":
    sys.exit(main())
