"""Every URDF below a folder as a model, compared with Pinocchio: what docs/robots.md says of example-robot-data.

python benchmarks/robots.py FOLDER [--base free]
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path

from symgen import link
from symgen.errors import SymgenError
from symgen.robots.agreement import compare_with_pinocchio
from symgen.robots.build import BASES, import_urdf

STATES = 5  # of each robot, at random
WANTED = 1e-10  # largest difference over the largest value


def judge(path: Path, base: str) -> tuple[str, str]:
    """Return a verdict on one file, and what is behind it."""
    try:
        imported = import_urdf(path, base)
    except SymgenError as error:
        return "refused", str(error)
    began = time.perf_counter()
    system = link.derive(imported.model)
    seconds = time.perf_counter() - began
    try:
        found = vars(compare_with_pinocchio(system, imported, STATES))
    except SymgenError as error:
        return "not comparable", str(error)
    del found["states"]
    worst = max((value, name) for name, value in found.items() if not math.isnan(value))
    verdict = "within" if worst[0] < WANTED else "beyond"
    return verdict, f"{system.nv} rates, derived in {seconds:.1f} s, {worst[1]} {worst[0]:.1e}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--base", choices=BASES, default=BASES[0])
    given = parser.parse_args()
    counts: dict[str, int] = {}
    for path in sorted(given.folder.rglob("*.urdf")):
        verdict, says = judge(path, given.base)
        counts[verdict] = counts.get(verdict, 0) + 1
        print(f"{verdict:<15} {path.relative_to(given.folder)}: {says}", flush=True)
    print(", ".join(f"{count} {verdict}" for verdict, count in sorted(counts.items())))


if __name__ == "__main__":
    main()
