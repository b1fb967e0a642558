"""Run the stress suite: `python -m tests.stress`."""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
from collections import Counter
from pathlib import Path

from .pool import Result, run_all
from .scenario import BAD, all_scenarios
from .table import by_kind, by_method


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.stress", description=sys.modules[__package__].__doc__
    )
    parser.add_argument(
        "only", nargs="?", default="", help="a regular expression: scenarios whose kind: name match"
    )
    parser.add_argument(
        "--short", action="store_true", help="the part of which the test suite runs up to eight of a kind"
    )
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="processes (2)")
    parser.add_argument(
        "--json",
        type=Path,
        metavar="FILE",
        help="write every outcome to this file, a line of JSON each, as it comes",
    )
    parser.add_argument("--list", action="store_true", help="name the scenarios and stop")
    chosen = parser.parse_args()
    scenarios = [
        s for s in all_scenarios().values()
        if (s.short or not chosen.short) and re.search(chosen.only, f"{s.kind}: {s.name}")
    ]  # fmt: skip
    if chosen.list:
        print("\n".join(f"{s.kind}: {s.name}" for s in scenarios))
        return 0
    began = time.perf_counter()
    done = 0
    lines = chosen.json.open("w", encoding="utf-8") if chosen.json else None

    def tell(result: Result) -> None:
        nonlocal done
        done += 1
        if lines is not None:
            row = {
                "kind": result.scenario.kind,
                "name": result.scenario.name,
                "method": result.scenario.method,
            }
            print(
                json.dumps({**row, "seconds": result.seconds, **result.outcome.to_dict()}),
                file=lines,
                flush=True,
            )
        if result.outcome.verdict in BAD and not sys.stderr.isatty():
            print(
                f"{result.outcome.verdict} {result.scenario.name}: {result.outcome.says}",
                file=sys.stderr,
                flush=True,
            )
        if sys.stderr.isatty():
            print(f"\r{done}/{len(scenarios)} {result.scenario.name[:80]:80}", end="", file=sys.stderr)

    results = run_all(scenarios, chosen.workers, tell)
    bad = [result for result in results if result.outcome.verdict in BAD]
    print("\n".join([*by_method(results), "", *by_kind(results), ""]))
    for result in bad:
        print(
            f"{result.outcome.verdict} {result.scenario.kind}: {result.scenario.name}: {result.outcome.says}"
        )
    counts = Counter(result.outcome.verdict for result in results)
    print(
        ", ".join(f"{n} {verdict}" for verdict, n in counts.items()),
        f"in {time.perf_counter() - began:.0f} s",
    )
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
