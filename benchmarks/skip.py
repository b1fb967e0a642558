"""What each saving gains: every one switched off by turns, the same work timed with and without it.

    python benchmarks/skip.py [--json FILE] [--only WORD]

Each row states a scene, a saving, the time with and without it, the factor gained, and whether the results are the
same: bit for bit, or the largest difference in parts of the largest value. Times are processor time, the least of
several taken by turns; those of a start are of the whole process.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from savings import equations, process, steps, subsystems
from savings.measure import line, words

CASES = (*equations.CASES, *subsystems.CASES, *steps.CASES, *process.CASES)
HEAD = ("scene", "saving", "with", "without", "factor", "results")


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", help="write the figures to a file")
    parser.add_argument("--only", default="", help="cases whose names contain this word")
    given = parser.parse_args()
    print(line(HEAD))
    print("|---|---|---:|---:|---:|---|")
    rows = []
    for case in CASES:
        if given.only in case.__name__:
            for row in case():
                rows.append(row)
                times = words(row.with_it), words(row.without)
                print(line((row.scene, row.saving, *times, f"{row.factor:.3g}", row.results)), flush=True)
    if given.json:
        with open(given.json, "w", encoding="utf-8") as file:
            json.dump([asdict(row) | {"factor": row.factor} for row in rows], file, indent=1)


if __name__ == "__main__":
    main()
