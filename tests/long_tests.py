"""Tests that the default run leaves out because of what they cost: `long_tests.txt`, by measurement.

`python -m pytest -n 2 -m "slow or not slow" --times times.jsonl` writes the processor seconds of each test,
`python -m tests.long_tests times.jsonl` makes the list from them. Of a test that has several cases the cheapest one
stays in the default run, unless it alone takes longer than `EVEN_ALONE`; what is marked `slow` where it is written
stays out of both. `python -m pytest -m slow` runs all that is left out.
"""

from __future__ import annotations

import json
import os
import resource
import sys
from collections import defaultdict
from pathlib import Path

LIST = Path(__file__).with_name("long_tests.txt")

#: Processor seconds above which a test is left out, and above which the only or cheapest case of a test is.
LONG, EVEN_ALONE = 1.0, 3.0

#: Files that stay whole: the borders between the parts, and the committed modules, are what any change may break.
WHOLE = ("tests/test_borders.py", "tests/test_generated.py")


def listed() -> set[str]:
    """Return the names of the tests that are left out, as pytest writes them."""
    return {line for line in LIST.read_text().splitlines() if line and not line.startswith("#")}


def processor_time() -> float:
    """Return the processor seconds of this process and of those of its children that have ended."""
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def note(path: str, test: str, seconds: float) -> None:
    """Append one test's time to a file of lines; several workers write to it, a line at a time."""
    line = json.dumps([test, round(seconds, 3)]) + "\n"
    descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    try:
        os.write(descriptor, line.encode())
    finally:
        os.close(descriptor)


def chosen(times: dict[str, float]) -> list[str]:
    """Return the tests to leave out, sorted, of processor seconds by test."""
    cases = defaultdict(list)
    for test in times:
        if not test.startswith(WHOLE):
            cases[test.partition("[")[0]].append(test)
    out = []
    for tests in cases.values():
        cheapest = min(tests, key=times.__getitem__)
        out += [test for test in tests if times[test] > (EVEN_ALONE if test == cheapest else LONG)]
    return sorted(out)


def main(path: str) -> None:
    times = dict(json.loads(line) for line in Path(path).read_text().splitlines())
    out = chosen(times)
    LIST.write_text(
        "# Made by `python -m tests.long_tests`, see there.\n" + "".join(f"{test}\n" for test in out)
    )
    rest = sum(times.values()) - sum(times[test] for test in out)
    print(f"{len(out)} of {len(times)} tests left out; {rest:.0f} of {sum(times.values()):.0f} s remain")


if __name__ == "__main__":
    main(sys.argv[1])
