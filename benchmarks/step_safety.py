"""What the step controller's safety factor does to explicit methods: evaluations at equal error, beside Hairer's 0.9.

    python benchmarks/step_safety.py [SCENE ...]

For each scene of `symgen bench`: evaluations of the right-hand side (a projection counts as 1.5) that errors from 1e-2
to 1e-12 take, in the geometric mean, in parts of what they take with 0.9; in brackets rejected steps for each accepted
one. The counts do not depend on the machine.
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from symgen.cli.settings import load_system
from symgen.model.library import bundled_folder, find
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from work_precision.case import FULL, Case, Row
from work_precision.reference import read_reference
from work_precision.scenes import find_scene
from work_precision.sweep import seconds_at
from work_precision.timing import TimedLoop

SCENES = (
    "slider_crank", "four_bar", "andrews", "car_axis", "heavy_top_absolute", "n_four_bar", "bricard",
    "double_pendulum", "chain_5", "chain_10", "heavy_top", "seven_dof_arm", "outer_solar_system", "pendulum",
    "humanoid_tree", "free_rigid_body", "stiff_spring",
)  # fmt: skip
HAIRER = 0.9
SAFETIES = (0.85, 0.8, 0.75, 0.7, 0.65)
TOLERANCES = 10.0 ** np.arange(-2.0, -13.1, -1.0 / 3.0)
LEVELS = 10.0 ** np.arange(-2.0, -12.1, -0.25)
PROJECTION = 1.5


def main() -> None:
    """Measure and print a table for each method."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=SCENES, metavar="SCENE")
    scenes = parser.parse_args().scenes
    for method in ("dop853", "dopri5"):
        print(f"\n| {method} | {' | '.join(f'{safety:g}' for safety in SAFETIES)} |")
        print(f"|---|{'---:|' * len(SAFETIES)}")
        factors = []
        for name in scenes:
            usual, _ = costs(case(name), method, HAIRER)
            row = [costs(case(name), method, safety) for safety in SAFETIES]
            factors.append([geometric_mean(found / usual) for found, _ in row])
            cells = (f"{f:.3f} ({rejected:.2f})" for f, (_, rejected) in zip(factors[-1], row, strict=True))
            print(f"| {name} | {' | '.join(cells)} |", flush=True)
        print(f"| all | {' | '.join(f'{x:.3f}' for x in map(geometric_mean, np.array(factors).T))} |")


@functools.cache
def case(name: str) -> Case:
    """A scene with its end state."""
    scene = find_scene(name)
    system, module = load_system(Path(find(scene.model)), dict(scene.options))
    return Case(scene, system, module.text, read_reference(bundled_folder() / "references", scene, system))


def costs(of: Case, name: str, safety: float) -> tuple[np.ndarray, float]:
    """Return evaluations at each level of error, nan where it is not reached, and rejected for each accepted step."""
    usual = METHODS[name]
    method = replace(usual, coefficients=lambda system: usual.coefficients(system)._replace(safety=safety))
    rows, rejected, accepted = [], 0, 0
    for rtol in map(float, TOLERANCES):
        loop = TimedLoop(
            of.system, method, of.reference.p, of.reference.start, of.scene.t_end, rtol, rtol * of.scene.atol_ratio,
            0.0,
        )  # fmt: skip
        status, _ = loop.run(FULL.longest_run)
        counted = loop.arrays.counters
        rejected, accepted = rejected + counted[at.REJECTED], accepted + counted[at.STEPS]
        if status == at.REACHED_STOP:
            cost = float(counted[at.RHS_CALLS] + PROJECTION * counted[at.PROJECTIONS])
            rows.append(Row(rtol, of.reference.error(loop.arrays.y), cost))
    found = [seconds_at(rows, float(level)) for level in LEVELS]
    return np.array([np.nan if x is None else x for x in found]), rejected / accepted


def geometric_mean(values: Sequence[float] | np.ndarray) -> float:
    """Return the geometric mean of what is known."""
    return float(np.exp(np.nanmean(np.log(values))))


if __name__ == "__main__":
    main()
