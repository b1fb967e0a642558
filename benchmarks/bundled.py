"""For each bundled model: seconds to derive, operations, seconds to compile, ns per right-hand side, ns per step.

    python benchmarks/bundled.py [MODEL …] [--json FILE]

Derivation is timed without reading the file; compilation of `rhs` with an empty cache; a step is one accepted step of
dop853 at rtol 1e-8 over the model's own run, everything counted (rejected steps, projection, saving of frames).
The last column divides it by the evaluations of the right-hand side per step: what a stage costs beyond the model.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from symgen import runtime
from symgen.link import derive_text
from symgen.model import library
from symgen.runtime import solve
from symgen.runtime.code import stand_ins
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.kernel import KernelSource

COLUMNS = ("derive s", "operations", "M+f", "compile s", "ns/rhs", "ns/step", "ns/stage - rhs")


@jitted
def repeat(address, t, y, p, out, n):
    """Call a kernel n times."""
    for _ in range(n):
        call_kernel(address, t, y, p, out)


def measure(path: Path) -> dict[str, float]:
    """All figures of one model."""
    model = library.load(path, {})
    derived = min((derive_text(model) for _ in range(3)), key=lambda d: d.seconds["derive"])
    system = runtime.load(derived.text)
    operations = system.operations
    compile_seconds = cold_compile(system)
    p = system.parameter_values({})
    solution = solve(system, method="dop853", rtol=1e-8, atol=1e-10)
    state = np.concatenate([solution.q[0], solution.v[0]])
    rhs = nanoseconds_per_call(system, state, p)
    runs = [solve(system, method="dop853", rtol=1e-8, atol=1e-10) for _ in range(5)]
    steps = solution.stats["steps"]
    step = min(run.seconds["run"] for run in runs) / steps * 1e9
    stages = solution.stats["rhs"] / steps
    return {
        "derive s": derived.seconds["derive"],
        "operations": operations["rhs"],
        "M+f": operations["mass_matrix"] + operations["forces"],
        "compile s": compile_seconds,
        "ns/rhs": rhs,
        "ns/step": step,
        "ns/stage - rhs": step / stages - rhs,
    }


def cold_compile(system: runtime.System) -> float:
    """Seconds from the text of `rhs` to its object code, nothing cached."""
    from symgen.runtime.code import engine

    source: KernelSource = system.kernel("rhs").source
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        engine.object_code("cold", "rhs", "cold", source.lower, Path(folder))
        return time.perf_counter() - start


def nanoseconds_per_call(system: runtime.System, state: np.ndarray, p: np.ndarray) -> float:
    """Best of five batches of calls from compiled code."""
    kernel = system.kernel("rhs")
    out = np.zeros(system.n_row)
    n = 20_000
    repeat(np.uint64(kernel.address), 0.0, state, p, out, 1)
    best = np.inf
    for _ in range(5):
        start = time.perf_counter()
        repeat(np.uint64(kernel.address), 0.0, state, p, out, n)
        best = min(best, time.perf_counter() - start)
    return best / n * 1e9


def main() -> None:
    stand_ins.at_once = True  # what runs come to, however short they are here
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="*", help="names of bundled models; all by default")
    parser.add_argument("--json", type=Path, help="write the figures to this file too")
    chosen = parser.parse_args()
    table = Table("model", *COLUMNS)
    results = {}
    for name, _, path in library.list_models():
        if chosen.models and name not in chosen.models:
            continue
        results[name] = measure(Path(path))
        table.add_row(name, *(f"{results[name][c]:.4g}" for c in COLUMNS))
    Console(width=120).print(table)
    if chosen.json:
        chosen.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
