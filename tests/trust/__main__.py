"""`python -m tests.trust [PATTERN]`: all runs, broken and sound, as a table."""

from __future__ import annotations

import re
import sys

from . import broken, sound
from .case import Case, judge


def main(pattern: str = "") -> int:
    """Print the table; returns 1 where more is wrong than the project allows itself: one run of either sort."""
    missed = {True: 0, False: 0}
    counts = {True: 0, False: 0}
    for case in (*broken.cases(), *sound.cases()):
        if not re.search(pattern, f"{case.kind}: {case.name}"):
            continue
        verdict = judge(case)
        right = verdict.is_right(case)
        counts[bool(case.check)] += 1
        missed[bool(case.check)] += not right
        print(f"{'right' if right else 'WRONG':6}{case.kind}: {case.name}")
        print(f"      {_found(case, verdict.flags | (verdict.told if case.check else {}))}", flush=True)
    print(f"broken: {counts[True] - missed[True]} of {counts[True]} flagged with their cause")
    print(f"sound:  {missed[False]} of {counts[False]} flagged")
    return int(missed[True] > 1 or missed[False] > 1)


def _found(case: Case, says: dict[str, str]) -> str:
    asked = f"asked for {case.check}{f' naming {case.word}' if case.word else ''}; " if case.check else ""
    return asked + ("; ".join(f"{check}: {text}" for check, text in says.items()) or "nothing flagged")


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))
