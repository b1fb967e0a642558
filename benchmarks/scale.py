"""Scenes in absolute coordinates from 10 to 1000 bodies: seconds to derive and compile, time per evaluation and step.

    python benchmarks/scale.py [--json FILE] [--bodies 10 50 200 500 1000]

A chain of pinned rods, whose cost grows with its length, and a net of masses and bars, whose solve grows faster, as on
any grid in the plane. Nothing comes from a cache but the step loop, which all models share.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import numpy as np  # noqa: E402
from bundled import nanoseconds_per_call  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

import runtime  # noqa: E402
from runtime.code import engine  # noqa: E402
from symgen.link import derive_text  # noqa: E402
from symgen.model.library import find, load  # noqa: E402

BODIES = (10, 50, 200, 500, 1000)
COMPILED = ("rhs", "project", "energy", "constraint_residual", "poses")  # what a run needs
T_END = 0.05  # s


def measure(name: str, bodies: int) -> dict:
    """Figures of one scene; the net has the square number of bodies that is nearest."""
    n = bodies if name == "chain_absolute" else round(bodies**0.5)
    start = time.perf_counter()
    model = load(find(name), {"N": str(n)})
    described = time.perf_counter()
    derived = derive_text(model)
    done = time.perf_counter()
    system = runtime.load(derived.text)
    began = time.perf_counter()
    for function in COMPILED:
        source = system._kernel_source(function)
        engine.compile_ir(source.lower_apart(function)[0])
    compiled = time.perf_counter()
    bodies = len(system.bodies)
    state = np.concatenate(system.initial_state()[:2])
    ns = nanoseconds_per_call(system, state, system.parameter_values())
    best = min((system.run(t_end=T_END, method="dop853", fps=20.0) for _ in range(3)), key=_run_seconds)
    per_step = _run_seconds(best) / (best.stats["steps"] + best.stats["rejected"]) * 1e9
    return {
        "scene": name, "bodies": bodies, "model s": described - start, "derive s": done - described,
        "kB": len(derived.text) / 1e3, "compile s": compiled - began, "rhs ns": ns, "step ns": per_step,
        "rhs ns per body": ns / bodies, "step ns per body": per_step / bodies, "status": best.status,
        "residual": best.constraint_residual.max_position,
    }  # fmt: skip


def _run_seconds(solution) -> float:
    return solution.seconds["run"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--json", type=Path, help="write the figures to this file as well")
    parser.add_argument("--bodies", type=int, nargs="+", default=BODIES)
    arguments = parser.parse_args()
    rows = [measure(name, n) for name in ("chain_absolute", "lattice") for n in arguments.bodies]
    table = Table(*rows[0])
    for row in rows:
        table.add_row(*(f"{x:.3g}" if isinstance(x, float) else str(x) for x in row.values()))
    Console(width=170).print(table)
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
