"""Every URDF or MJCF file below a folder as a model, compared with Pinocchio or MuJoCo: the tables of docs/robots.md.

python benchmarks/robots.py FOLDER [--base free]
python benchmarks/robots.py FOLDER --mjcf
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

from symgen import link
from symgen.errors import SymgenError
from symgen.model.model import Model
from symgen.robots.agreement import compare_with_pinocchio
from symgen.robots.build import BASES, import_urdf
from symgen.robots.mjcf import import_mjcf
from symgen.robots.mjcf_agreement import compare_with_mujoco

if TYPE_CHECKING:
    from symgen.runtime import System

STATES = 5  # of each robot, at random
WANTED = 1e-10  # largest difference over the largest value


def judge(path: Path, base: str, within: Path | None) -> tuple[str, str]:
    """Return a verdict on one file, and what is behind it; `within` is the folder of MJCF files."""
    try:
        imported = import_urdf(path, base) if within is None else import_mjcf(path, within=within)
        system, seconds = derived(imported.model)
    except SymgenError as error:
        return "refused", str(error)
    compare = compare_with_pinocchio if within is None else compare_with_mujoco
    try:
        found = vars(compare(system, imported, STATES))
    except SymgenError as error:
        return "not comparable", str(error)
    del found["states"]
    worst = max((value, name) for name, value in found.items() if not math.isnan(value))
    verdict = "within" if worst[0] < WANTED else "beyond"
    said = f"{system.nv} rates, derived in {seconds:.1f} s, {worst[1]} {worst[0]:.1e}"
    left_out = "" if within is None else f" ({len(imported.notes)} notes)"
    return verdict, said + left_out


def derived(model: Model) -> tuple[System, float]:
    """A model's system, and how long it took."""
    began = time.perf_counter()
    return link.derive(model), time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--base", choices=BASES, default=BASES[0])
    parser.add_argument("--mjcf", action="store_true", help="files of MuJoCo instead of URDF")
    given = parser.parse_args()
    counts: dict[str, int] = {}
    for path in sorted(given.folder.rglob("*.xml" if given.mjcf else "*.urdf")):
        verdict, says = judge(path, given.base, given.folder if given.mjcf else None)
        counts[verdict] = counts.get(verdict, 0) + 1
        print(f"{verdict:<15} {path.relative_to(given.folder)}: {says}", flush=True)
    print(", ".join(f"{count} {verdict}" for verdict, count in sorted(counts.items())))


if __name__ == "__main__":
    main()
