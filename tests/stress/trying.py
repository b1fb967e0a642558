"""Many cases of one kind of situation, tried from a command line and counted in a table."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from .scenario import RIGHT, WRONG


def try_cases(
    arguments: Sequence[str] | None,
    name: str,
    doc: str,
    kinds: Sequence[str],
    draw: Callable[[int, str, int], Any],
    judge: Callable[[Any, str, Any], tuple[str, str]],
    count: int,
) -> int:
    """Draw cases of each kind, judge them by some methods, and print how many are what; returns an exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the command line if not given.
    name, doc : str
        Of the module whose cases they are.
    kinds : sequence of str
    draw : callable
        seed, kind, number -> a case, which has `derive`.
    judge : callable
        case, method, system -> verdict and why.
    count : int
        Cases of each kind if nothing else is asked for.
    """
    parser = argparse.ArgumentParser(prog=f"python -m tests.stress.{name}", description=doc.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=count, help=f"cases of each kind ({count})")
    parser.add_argument("--first", type=int, default=0, help="number of the first case (0)")
    parser.add_argument("--methods", nargs="+", default=["dop853"])
    parser.add_argument("--kinds", nargs="+", default=list(kinds), choices=kinds)
    chosen = parser.parse_args(arguments)
    wrong = 0
    for kind in chosen.kinds:
        counts = {method: Counter() for method in chosen.methods}
        for number in range(chosen.first, chosen.first + chosen.count):
            case = draw(chosen.seed, kind, number)
            system = case.derive()
            for method, by in counts.items():
                verdict, why = judge(case, method, system)
                by[verdict] += 1
                wrong += verdict == WRONG
                if verdict != RIGHT:
                    print(f"    {kind} {number} {method}: {verdict}: {why:.400}", file=sys.stderr, flush=True)
        for method, by in counts.items():
            said = "  ".join(f"{verdict} {n}" for verdict, n in sorted(by.items()))
            print(f"{kind:8} {method:8} {said}", flush=True)
    return int(wrong > 0)
