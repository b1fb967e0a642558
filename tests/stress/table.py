"""Outcomes as tables: method by kind of problem, and counts by kind."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence

from .every_method import PROBLEMS
from .pool import Result
from .scenario import BAD, DOUBTED, FLAGGED, REFUSED, RIGHT

_VERDICTS = (RIGHT, REFUSED, FLAGGED, DOUBTED, *BAD)


def by_method(results: Sequence[Result]) -> list[str]:
    """Return a table of every method on every problem of `every_method`."""
    cells: dict[str, dict[str, str]] = defaultdict(dict)
    for result in results:
        if result.scenario.kind in PROBLEMS:
            cells[result.scenario.method][result.scenario.kind] = result.outcome.verdict
    if not cells:
        return []
    problems = [name for name in PROBLEMS if any(name in row for row in cells.values())]
    lines = ["".join(["method".ljust(24), *(name.rjust(max(len(name), 7) + 2) for name in problems)])]
    for method, row in cells.items():
        shown = (row.get(name, "-").rjust(max(len(name), 7) + 2) for name in problems)
        lines.append("".join([method.ljust(24), *shown]))
    return lines


def by_kind(results: Sequence[Result]) -> list[str]:
    """Return how many outcomes of each verdict every kind has."""
    counts: dict[str, Counter] = defaultdict(Counter)
    for result in results:
        counts[result.scenario.kind][result.outcome.verdict] += 1
    lines = ["".join(["kind".ljust(24), *(verdict.rjust(9) for verdict in _VERDICTS)])]
    for kind, counter in counts.items():
        lines.append(
            "".join([kind.ljust(24), *(str(counter[verdict] or "-").rjust(9) for verdict in _VERDICTS)])
        )
    return lines
