"""How exactly constrained models are solved: against references of 40 digits, and at default settings.

First table: errors at the end of each constrained scene of `symgen bench`, at tight tolerances: coordinates and rates
in parts of the largest of the run, multipliers likewise. Second table: what a run without any options leaves of the
constraints at its worst frame, each in parts of its own scale.

    python benchmarks/constrained.py
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from symgen.link import derive
from symgen.model.library import bundled, find, load
from symgen.runtime.constraints.drift import constraint_drift
from symgen.runtime.solution import Solution
from work_precision.reference import read_reference
from work_precision.scenes import SCENES, Scene

TIGHT = (("taylor", 1e-15), ("dop853", 1e-14), ("radau13", 1e-14), ("gauss16", None))
STEPS = 4000  # of the method of fixed step


def main() -> None:
    argparse.ArgumentParser(description=__doc__.split("\n")[0]).parse_args()
    print("| scene | method | coordinates and rates | multipliers |\n|---|---|---:|---:|")
    for scene in SCENES.values():
        for line in _against_reference(scene):
            print(line, flush=True)
    print("\n| model | method | frames | positions | velocities |\n|---|---|---:|---:|---:|")
    for name in sorted(bundled()):
        system = derive(load(find(name)))
        if system.m:
            print(_residuals(name, system.run()), flush=True)


def _against_reference(scene: Scene) -> Iterator[str]:
    system = derive(load(find(scene.model), dict(scene.options)))
    if not system.m:
        return
    reference = read_reference(find(scene.model).parent / "references", scene, system)
    q = dict(zip((c["name"] for c in system.coordinates), reference.start[: system.nq], strict=True))
    v = dict(zip((r["name"] for r in system.rates), reference.start[system.nq :], strict=True))
    for method, rtol in TIGHT:
        accuracy = (
            {"step": scene.t_end / STEPS} if rtol is None else {"rtol": rtol, "atol": rtol * scene.atol_ratio}
        )
        run = system.run(
            t_end=scene.t_end,
            at=[scene.t_end],
            method=method,
            start=q,
            rate=v,
            parameters=scene.parameters,
            **accuracy,
        )
        if run.status != "success":
            yield f"| {scene.name} | {method} | {run.message} | |"
            continue
        (end,) = run.samples
        error = reference.error([*end.q, *end.v])
        yield f"| {scene.name} | {method} | {error:.1e} | {reference.multiplier_error(end.multipliers):.1e} |"


def _residuals(name: str, run: Solution) -> str:
    drift = constraint_drift(run)
    levels = [f"{drift[level].relative:.1e}" if level in drift else "" for level in ("position", "velocity")]
    return f"| {name} | {run.method} | {len(run.t)} | {' | '.join(levels)} |"


if __name__ == "__main__":
    main()
