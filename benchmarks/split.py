"""What it saves to integrate independent subsystems by themselves: the field of pendulums, one of them stiff.

As one system, the stiff pendulum sets the method or the step of all: an implicit one for all, or explicit steps that
stability limits from the first millisecond on. Run time is proportional to simulated time then, and a short piece of it
tells that of the whole.

    python benchmarks/split.py [pendulums]
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from symgen import runtime
from symgen.cli.arguments import find_model
from symgen.link import module_for
from symgen.runtime import solve

_REPEATS = 3
PIECES = {"auto": 0.5, "dop853": 0.005}  # seconds simulated as one system, by method


def main(n: int) -> None:
    """Print run times and their ratios.

    Parameters
    ----------
    n : int
        Number of pendulums.
    """
    module = module_for(find_model("pendulum_field"), {"n": str(n), "stiff": "true"}, None)
    system = runtime.load(module.text)
    t_end = system.run_defaults["t_end"]

    def seconds(*given, **options):
        least = np.inf
        for _ in range(_REPEATS):
            began = time.thread_time()
            run = solve(system, *given, **options)
            least = min(least, time.thread_time() - began)
        return least, run

    took, run = seconds()
    print(f"{n} pendulums, one of them stiff, {t_end:g} s: processor time with preparations")
    print(
        f"  each by itself       {took:9.3f} s, {run.stats['steps']} steps, energy error {run.energy.max_error:.1e}"
    )
    for method, piece in PIECES.items():
        # What a run costs besides its steps cancels in the difference of two pieces.
        (short, before), (long, after) = (
            seconds(t, method=method, split=False) for t in (piece, 2.0 * piece)
        )
        as_one = (long - short) * t_end / piece
        steps = after.stats["steps"] - before.stats["steps"]
        print(
            f"  as one, {after.method:8}     {as_one:9.3f} s, {as_one / took:.0f} times, from {steps} steps of all"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pendulums", nargs="?", type=int, default=1000)
    main(parser.parse_args().pendulums)
