"""`python -m tests.trust [PATTERN]`: all runs, broken and sound, as a table."""

from __future__ import annotations

import re
import sys
from collections import Counter

from . import advised, broken, sound
from .case import Case, judge


def main(pattern: str = "") -> int:
    """Print the table; returns 1 where anything in it is wrong."""
    missed, counts = Counter(), Counter()
    for case in (*broken.cases(), *advised.cases(), *sound.cases()):
        if not re.search(pattern, f"{case.kind}: {case.name}"):
            continue
        verdict = judge(case)
        right = verdict.is_right(case)
        sort = "sound" if not case.check else "broken" if case.reference is None else "advised"
        counts[sort] += 1
        missed[sort] += not right
        print(f"{'right' if right else 'WRONG':6}{case.kind}: {case.name}")
        print(f"      {_found(case, verdict.flags | (verdict.told if case.check else {}))}", flush=True)
    print(f"broken:  {counts['broken'] - missed['broken']} of {counts['broken']} flagged with their cause")
    print(
        f"advised: {counts['advised'] - missed['advised']} of {counts['advised']} right, not flagged, and told why"
    )
    print(f"sound:   {missed['sound']} of {counts['sound']} flagged")
    return int(missed.total() > 0)


def _found(case: Case, says: dict[str, str]) -> str:
    asked = f"asked for {case.check}{f' naming {case.word}' if case.word else ''}; " if case.check else ""
    return asked + ("; ".join(f"{check}: {text}" for check, text in says.items()) or "nothing flagged")


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))
