"""What the health report of a run costs beside the run itself: `python benchmarks/health_cost.py`.

Processor time of runs of at least 50 ms; of each the run is repeated and the least time counts, and so for its health
report, which is computed when it is asked for. Reports are made of fresh solutions: nothing is kept from one to the
next.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

from symgen import runtime
from symgen.link import module_for
from symgen.model.library import find

_REPEATS = 5
_LEAST_SECONDS = 0.05
_ALLOWED = 0.05
# model, options: long enough for 50 ms and more on a machine of today.
_RUNS = (
    ("pendulum", {"method": "dop853", "t_end": 20000.0}),
    ("pendulum", {"method": "verlet", "step": 0.001, "t_end": 4000.0}),
    ("double_pendulum", {"method": "taylor", "t_end": 10000.0}),
    ("double_pendulum", {"method": "rk4", "step": 1e-4, "t_end": 100.0}),
    ("spring_pendulum", {"method": "radau5", "t_end": 400.0}),
    ("slider_crank", {"method": "dop853", "t_end": 100.0}),
    ("slider_crank", {"method": "dopri5", "t_end": 100.0}),
    ("four_bar", {"method": "gauss8", "step": 1e-3, "t_end": 20.0}),
    ("bouncing_ball", {"method": "rk4", "step": 2e-5, "t_end": 8.5}),
    ("andrews_squeezer", {"method": "dop853", "rtol": 1e-8, "t_end": 1.0}),
    ("seven_dof_arm", {"method": "dop853", "rtol": 1e-6, "t_end": 300.0}),
    ("quarter_car", {"method": "radau5", "t_end": 300.0}),
)


def measure(name: str, options: dict) -> tuple[float, float]:
    """Return the least seconds of processor time of a run and of its health report."""
    system = runtime.load(module_for(Path(find(name)), {}).text)
    runs, reports = [], []
    for _ in range(_REPEATS):
        began = time.thread_time()
        solution = system.run(**options)
        runs.append(time.thread_time() - began)
        for _ in range(_REPEATS):
            fresh = replace(solution)  # without what is kept of another report
            began = time.thread_time()
            found = fresh.health
            reports.append(time.thread_time() - began)
            if not found:
                raise ValueError(f"{name}: no report")
    return min(runs), min(reports)


def main() -> int:
    """Print the table; returns 1 where a report of a run of 50 ms or more takes more than 5 % of it."""
    worst = 0.0
    print(f"{'model':18}{'method':10}{'run':>10}{'health':>10}{'share':>9}")
    for name, options in _RUNS:
        run, report = measure(name, options)
        counted = run >= _LEAST_SECONDS
        worst = max(worst, report / run if counted else 0.0)
        note = "" if counted else "  (too short to count)"
        print(
            f"{name:18}{options['method']:10}{run:8.4f} s{report:8.4f} s{report / run:9.1%}{note}", flush=True
        )
    print(f"largest share: {worst:.1%}, allowed {_ALLOWED:.0%}")
    return int(worst > _ALLOWED)


if __name__ == "__main__":
    sys.exit(main())
