"""Scenes in absolute coordinates from 10 to 1000 bodies: seconds to derive and compile, time per evaluation and step.

    python benchmarks/scale.py [--json FILE] [--bodies 10 50 200 500 1000] [--scenes chain_absolute lattice bushings]
        [--method radau5 | generalized_alpha]

A chain of pinned rods, whose cost grows with its length; a net of masses and bars, whose solve grows faster, as on any
grid in the plane; and the same grid on stiff bushings, which `radau5` integrates with sparse matrices. Nothing comes
from a cache but the step loops, which all models share. Each scene runs in a process of its own, for its peak memory.
Seconds are those of the processor. Works on Linux.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import numpy as np  # noqa: E402
from bundled import nanoseconds_per_call  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from symgen import runtime  # noqa: E402
from symgen.link import derive_text  # noqa: E402
from symgen.model.library import find, load  # noqa: E402
from symgen.runtime.code import compiler, stand_ins  # noqa: E402
from symgen.runtime.constraints.assembly import assemble  # noqa: E402

BODIES = (10, 50, 200, 500, 1000)
COMPILED = ("rhs", "project", "energy", "constraint_residual", "poses")  # what a run needs
EXPLICIT, STIFF, FIXED = "dop853", "radau5", "generalized_alpha"
SCENES = {"chain_absolute": EXPLICIT, "lattice": EXPLICIT, "bushings": STIFF}
RUNS = 8
T_END = {EXPLICIT: 0.05, STIFF: 0.2, FIXED: 0.05}  # s
TOLERANCES = {
    EXPLICIT: {}, STIFF: {"rtol": 1e-5, "atol": 1e-7},
    FIXED: {"rtol": 1e-5, "atol": 1e-7, "step": 1e-3, "constraints": "index3"},
}  # fmt: skip


def derive(scene: str, bodies: int, method: str) -> tuple[str, dict]:
    """The module of one scene with nearly so many bodies, and figures of its derivation."""
    n = {"chain_absolute": bodies, "lattice": round(bodies**0.5)}.get(
        scene, round(0.5 + (bodies + 0.25) ** 0.5)
    )
    start = time.process_time()
    model = load(HERE / "bushing_lattice.py" if scene == "bushings" else find(scene), {"N": str(n)})
    described = time.process_time()
    derived = derive_text(model, on_demand=method == EXPLICIT)  # as `symgen.load` does
    done = time.process_time()
    return derived.text, {
        "model s": described - start, "derive s": done - described, "kB": len(derived.text) / 1e3
    }  # fmt: skip


def run(text: str, method: str) -> dict:
    """Figures of one module: compilation, start, evaluation, steps, peak memory."""
    system = runtime.load(text)
    names = [name for name in COMPILED if system.has(name)]
    names += ["residual_jacobian_entries"] if method != EXPLICIT else []
    began = time.process_time()
    for name in names:
        compiler.compile_ir(system._kernel_source(name).lower_standalone(name)[0])
    compiled = time.process_time() - began
    assemble(system, system.parameter_values())  # compiles what it needs
    began = time.process_time()
    start = assemble(system, system.parameter_values())
    assembled = time.process_time() - began
    options = {"t_end": T_END[method], "method": method, "fps": 20.0, **TOLERANCES[method]}
    runs = [system.run(**options) for _ in range(RUNS)]
    peak = _peak_megabytes()
    best = min(runs, key=lambda found: found.seconds["run"])
    steps = best.stats["steps"] + best.stats["rejected"]
    ns = nanoseconds_per_call(system, np.concatenate([start.q, start.v]), system.parameter_values())
    n, per_step = len(system.bodies), best.seconds["run"] / steps * 1e9
    return {
        "bodies": n, "unknowns": system.nv + system.m, "compile s": compiled, "start s": assembled,
        "rhs ns per body": ns / n, "steps": steps, "step ns per body": per_step / n, "peak MB": peak,
        "status": best.status,
    }  # fmt: skip


def _peak_megabytes() -> float:
    """Peak memory of this process; what `getrusage` says may be that of the one which started it."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1e3


def measure(scene: str, bodies: int, method: str) -> dict:
    """Figures of one scene; its run is a process of its own."""
    text, derivation = derive(scene, bodies, method)
    with tempfile.TemporaryDirectory() as folder:
        module = Path(folder) / "scene.py"
        module.write_text(text)
        command = [sys.executable, __file__, "--module", str(module), method]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    return {"scene": scene, "method": method, **derivation, **json.loads(done.stdout)}


def main() -> None:
    stand_ins.at_once = True  # what runs come to, however short they are here
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--json", type=Path, help="write the figures to this file as well")
    parser.add_argument("--bodies", type=int, nargs="+", default=BODIES)
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--method", choices=[EXPLICIT, STIFF, FIXED], help="another than the scene's own")
    parser.add_argument("--module", nargs=2, metavar=("FILE", "METHOD"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.module:
        file, method = arguments.module
        print(json.dumps(run(Path(file).read_text(), method)))
        return
    rows = []
    for scene in arguments.scenes:
        for n in arguments.bodies:
            rows.append(measure(scene, n, arguments.method or SCENES[scene]))
            if arguments.json:  # by now: long ones take minutes
                arguments.json.write_text(json.dumps(rows, indent=1))
    table = Table(*rows[0])
    for row in rows:
        table.add_row(*(f"{x:.3g}" if isinstance(x, float) else str(x) for x in row.values()))
    Console(width=170).print(table)


if __name__ == "__main__":
    main()
