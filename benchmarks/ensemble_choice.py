"""Whether "auto" is near the best method of an ensemble: processor time of a member at equal error, a dozen models.

    python benchmarks/ensemble_choice.py [double_pendulum] [arm] … [--members 256] [--quick] [--json FILE]

For each model, members differ in one number. Every method that has lanes runs them at tolerances a factor of ten apart,
and what "auto" takes for the ensemble at three. The time of a method at the error of "auto" is read between its own
runs, straight between logarithms; "auto" is held against the best of these. Errors are those of the ends against the
same members by the most exact method at its smallest tolerance, medians over the members. Time is that of members
alone: their starts, their runs in lanes or by themselves, and verdicts; choosing and compiling are left out. Methods
take turns, processor time counts, the least of some turns.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from ensembles import at_level, least_time

from symgen import load
from symgen.runtime.ensemble import uniform
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import Plan, make_plan
from symgen.runtime.ensemble.work import run_members
from symgen.runtime.errors import RuntimeModelError

WITHIN = 1.2
ASKED = (1e-4, 1e-7, 1e-10)
EXPLICIT = {
    "dop853": tuple(10.0**-k for k in range(3, 14)), "taylor": tuple(10.0**-k for k in range(3, 15)),
}  # fmt: skip
STIFF = {**EXPLICIT, **{f"radau{n}": tuple(10.0**-k for k in range(2, 12)) for n in (5, 9, 13)}}
_LOST = 0.1  # of the largest number at the ends: an error that says nothing of a method


@dataclass(frozen=True)
class Scene:
    """A model of which members differ in one number."""

    t_end: float
    place: str  # "parameters", "start" or "rate"
    name: str
    bounds: tuple[float, float]
    methods: dict[str, tuple[float, ...]]


SCENES = {
    "double_pendulum": Scene(10.0, "start", "theta1", (1.37, 1.77), EXPLICIT),
    "slider_crank": Scene(2.0, "start", "theta", (0.4, 0.6), EXPLICIT),
    "four_bar": Scene(2.0, "parameters", "g", (9.0, 10.0), EXPLICIT),
    "seven_dof_arm": Scene(5.0, "start", "q1", (-0.1, 0.1), EXPLICIT),
    "outer_solar_system": Scene(20_000.0, "rate", "x_sun", (-1e-8, 1e-8), EXPLICIT),
    "spring_pendulum": Scene(10.0, "parameters", "m", (0.5, 1.5), EXPLICIT),
    "rolling_disc": Scene(10.0, "parameters", "g", (9.0, 10.0), EXPLICIT),
    "spinning_top": Scene(2.0, "parameters", "g", (9.0, 10.0), EXPLICIT),
    "bricard": Scene(2.0, "parameters", "g", (9.0, 10.0), EXPLICIT),
    "bouncing_ball": Scene(5.0, "start", "y", (1.0, 1.2), EXPLICIT),
    "stick_slip": Scene(8.0, "rate", "x", (0.2, 0.25), EXPLICIT),
    "door_stop": Scene(12.0, "rate", "angle", (2.0, 3.0), EXPLICIT),
    "quarter_car": Scene(5.0, "parameters", "bump", (0.06, 0.1), STIFF),
    "stiff_bushing_pendulum": Scene(2.0, "parameters", "g", (9.0, 10.0), STIFF),
}


@dataclass(frozen=True)
class Found:
    """What "auto" took at a tolerance: its error, time of a member [s], and that of the best method at this error."""

    rtol: float
    method: str
    error: float
    seconds: float
    best: str
    best_seconds: float

    @property
    def ratio(self) -> float:
        return self.seconds / self.best_seconds


def plan_of(system: Any, scene: Scene, members: int, method: str, rtol: float) -> Plan:
    """The plan of an ensemble of the scene."""
    return make_plan(
        system,
        EnsembleOptions(
            t_end=scene.t_end, n=members, seed=1, method=method, rtol=rtol, atol=rtol * 1e-2,
            **{scene.place: {scene.name: uniform(*scene.bounds)}},
        ),
    )  # fmt: skip


def ends_of(plan: Plan) -> np.ndarray:
    """Where members come to, shape (n, nq + nv); not a number where one failed."""
    states, _, verdicts, _ = run_members(plan, 0, plan.members.n)
    n = plan.system.nq + plan.system.nv
    return np.where((verdicts.status == 1)[:, None], states[:, -1, :n], np.nan)


def measure(name: str, members: int, quick: bool) -> list[Found]:
    """Return what "auto" took at each tolerance, beside the best."""
    scene, system = SCENES[name], load(name)
    labels, plans = [], []
    for method, tolerances in scene.methods.items():
        for rtol in tolerances[:: 2 if quick else 1]:
            try:
                plan = plan_of(system, scene, members, method, rtol)
            except RuntimeModelError as refused:
                print(f"{name}: {method}: {refused}")
                break
            if plan.settings is None:
                print(f"{name}: {method} has no lanes: {plan.notes[-1]}")
                break
            labels.append((method, rtol))
            plans.append(plan)
    chosen = [plan_of(system, scene, members, "auto", rtol) for rtol in ASKED]
    exact = ends_of(plan_of(system, scene, members, next(reversed(scene.methods)), 1e-14))
    scale = np.nanmax(np.abs(exact), axis=0) + 1e-300
    everyone = [*plans, *chosen]
    errors = [float(np.nanmedian(np.abs((ends_of(plan) - exact) / scale).max(axis=1))) for plan in everyone]
    times = least_time([lambda plan=plan: ends_of(plan) for plan in everyone])
    points: dict[str, list[tuple[float, float]]] = {}
    for (method, _), error, seconds in zip(labels, errors, times, strict=False):
        if math.isfinite(error) and error < _LOST:
            points.setdefault(method, []).append((error, seconds / members))
    found = []
    for rtol, plan, error, seconds in zip(
        ASKED, chosen, errors[len(plans) :], times[len(plans) :], strict=True
    ):
        at_error = {method: at_level(own, error) for method, own in points.items()}
        at_error = {method: own for method, own in at_error.items() if math.isfinite(own)}
        at_error["auto"] = seconds / members
        best = min(at_error, key=at_error.get)
        method = (
            f"{plan.method} {plan.settings.order}" if plan.settings and plan.settings.order else plan.method
        )
        found.append(Found(rtol, method, error, seconds / members, best, at_error[best]))
    return found


def main() -> None:
    """Print, model by model, what was chosen, and how near it is to the best."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(SCENES)} (default: all)")
    parser.add_argument("--members", type=int, default=256)
    parser.add_argument("--quick", action="store_true", help="every other tolerance")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    if unknown := [name for name in given.scenes if name not in SCENES]:
        parser.error(f"there is no scene {unknown[0]!r}; there are {', '.join(SCENES)}")
    results: dict[str, list[Found]] = {}
    print("auto / best: processor time of a member at equal error")
    for name in given.scenes or SCENES:
        results[name] = measure(name, given.members, given.quick)
        for one in results[name]:
            print(
                f"{name:<24}rtol {one.rtol:.0e}  {one.method:<11} error {one.error:.1e}  {one.seconds * 1e6:>9.1f} us  "
                f"best: {one.best:<8} {one.best_seconds * 1e6:>9.1f} us  {one.ratio:.2f}",
                flush=True,
            )
    ratios = [one.ratio for own in results.values() for one in own]
    print(
        f"{sum(r <= WITHIN for r in ratios)} of {len(ratios)} within {WITHIN}; the largest is {max(ratios):.2f}"
    )
    if given.json:
        told = {name: [{**vars(one), "ratio": one.ratio} for one in own] for name, own in results.items()}
        given.json.write_text(json.dumps(told, indent=1) + "\n")


if __name__ == "__main__":
    main()
