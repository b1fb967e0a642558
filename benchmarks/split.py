"""What it saves to integrate independent subsystems by themselves: the field of pendulums, one of them stiff.

As one system, the stiff pendulum sets the step of all: stability limits it from the first millisecond on, so run time
is proportional to simulated time, and a short piece of it tells that of the whole.

    python benchmarks/split.py [pendulums] [seconds of the piece]
"""

from __future__ import annotations

import sys

import runtime
from runtime.solve import solve
from symgen.cli.arguments import find_model
from symgen.link import module_for

_REPEATS = 3


def main(n: int = 1000, piece: float = 0.2) -> None:
    """Print run times and their ratio.

    Parameters
    ----------
    n : int
        Number of pendulums.
    piece : float [s]
        Simulated time of the run as one system.
    """
    module = module_for(find_model("pendulum_field"), {"n": str(n), "stiff": "true"}, None)
    system = runtime.load(module.text)
    t_end = system.run_defaults["t_end"]
    apart = min((solve(system) for _ in range(_REPEATS)), key=lambda run: run.seconds["run"])
    one = solve(system, piece, split=False)
    as_one = one.seconds["run"] * t_end / piece
    print(f"{n} pendulums, one of them stiff, {t_end:g} s")
    print(f"  each by itself  {apart.seconds['run']:9.3f} s, {apart.stats['steps']} steps of one pendulum")
    print(
        f"  as one system   {as_one:9.3f} s, from {piece:g} s with {one.stats['steps']} steps of all by {one.method}"
    )
    print(f"  factor          {as_one / apart.seconds['run']:9.1f}")
    print(f"  energy error    {apart.energy.max_error:.1e} and {one.energy.max_error:.1e}")


if __name__ == "__main__":
    main(*(kind(text) for kind, text in zip((int, float), sys.argv[1:])))
