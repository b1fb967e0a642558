"""What the health report of a run costs beside the run itself: `python benchmarks/health_cost.py`.

Processor time of runs that take about 1 ms, 10 ms, 0.1 s and 1 s; of each the run is repeated and the least time
counts, and so for its health report, which is computed when it is asked for. Reports are made of fresh solutions:
nothing is kept from one to the next.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from symgen import runtime
from symgen.link import module_for
from symgen.model.library import find
from symgen.runtime.system import System

_REPEATS, _MOST_SECONDS = 5, 2.0  # of all repeats of one run
_LENGTHS = (0.001, 0.01, 0.1, 1.0)  # [s] of processor time
_REACHED = 1.6  # times a length, or a part of it, counts as that
_COUNTS, _ALLOWED = 0.7, 0.05  # from which length [s] on a report may take how much of it
_MOST_LONGER, _NEAR, _TRIALS = 10.0, 1.3, 8  # times the last run, on the way to a length
# model, options, what makes a run longer: its end, or a shorter step where motion ends by itself.
_RUNS = (
    ("pendulum", {"method": "dop853", "t_end": 2000.0}, "t_end"),
    ("pendulum", {"method": "verlet", "step": 0.001, "t_end": 400.0}, "t_end"),
    ("double_pendulum", {"method": "taylor", "t_end": 100.0}, "t_end"),
    ("double_pendulum", {"method": "rk4", "step": 1e-3, "t_end": 100.0}, "t_end"),
    ("slider_crank", {"method": "dop853", "t_end": 100.0}, "t_end"),
    ("slider_crank", {"method": "radau5", "t_end": 10.0}, "t_end"),
    ("four_bar", {"method": "taylor", "t_end": 10.0}, "t_end"),
    ("four_bar", {"method": "gauss8", "step": 1e-3, "t_end": 4.0}, "t_end"),
    ("andrews_squeezer", {"method": "dop853", "rtol": 1e-8, "t_end": 0.1}, "t_end"),
    ("seven_dof_arm", {"method": "dop853", "t_end": 50.0}, "t_end"),
    ("quarter_car", {"method": "radau5", "t_end": 100.0}, "t_end"),
    ("heavy_top_absolute", {"method": "dop853", "t_end": 10.0}, "t_end"),
    ("bouncing_ball", {"method": "rk4", "step": 1e-4, "t_end": 8.5}, "step"),
)


def main() -> int:
    """Print the table; returns 1 where the report of a run of a second takes more than 5 % of it."""
    worst = 0.0
    print(f"{'model':20}{'method':10}" + "".join(f"{f'run of {x:g} s':>22}" for x in _LENGTHS))
    for name, options, longer in _RUNS:
        system = runtime.load(module_for(Path(find(name)), {}).text)
        print(f"{name:20}{options['method']:10}", end="", flush=True)
        for length in _LENGTHS:
            options = _of_length(system, options, longer, length)
            run, report = measure(system, options)
            if run >= _COUNTS:
                worst = max(worst, report / run)
            reached = 1.0 / _REACHED < run / length < _REACHED
            print(
                f"{report * 1e3:12.1f} ms {report / run:6.1%}" if reached else f"{'–':>22}",
                end="",
                flush=True,
            )
        print()
    print(f"largest share of runs of {_LENGTHS[-1]:g} s: {worst:.1%}, allowed {_ALLOWED:.0%}")
    return int(worst > _ALLOWED)


def _of_length(system: System, options: dict, longer: str, length: float) -> dict:
    """Return options with which a run takes about so long [s]."""
    for _ in range(_TRIALS):
        system.run(**options)
        began = time.thread_time()
        system.run(**options)
        factor = float(np.clip(length / (time.thread_time() - began), 1.0 / _MOST_LONGER, _MOST_LONGER))
        if 1.0 / _NEAR < factor < _NEAR:
            break
        options = {**options, longer: options[longer] * (factor if longer == "t_end" else 1.0 / factor)}
    return options


def measure(system: System, options: dict) -> tuple[float, float]:
    """Return the least seconds of processor time of a run and of its health report."""
    runs, reports = [], []
    while len(runs) < 2 or (len(runs) < _REPEATS and sum(runs) < _MOST_SECONDS):
        began = time.thread_time()
        solution = system.run(**options)
        runs.append(time.thread_time() - began)
        for _ in range(_REPEATS):
            fresh = replace(solution)  # without what is kept of another report
            began = time.thread_time()
            found = fresh.health
            reports.append(time.thread_time() - began)
            if not found:
                raise ValueError(f"{system.name}: no report")
    return min(runs), min(reports)


if __name__ == "__main__":
    sys.exit(main())
