"""Forward dynamics of joint trees beside Pinocchio: operations, derive and compile seconds, ns per call, agreement.

    python benchmarks/forward_dynamics.py [--json FILE]

Models: the bundled arm and diver, and random trees. Pinocchio (`pip install 'symgen[bench]'`) runs `aba`, called from
Python; what such a call costs for a model without joints is subtracted, so that its C++ is what is compared.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "tests")]

from bundled import cold_compile, nanoseconds_per_call  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from symgen import runtime  # noqa: E402
from symgen.link import derive_text  # noqa: E402
from symgen.runtime.code import stand_ins  # noqa: E402

CALLS, REPEATS = 2000, 20


def _models() -> dict:
    """A 7-joint arm, a humanoid with a free base, and a chain and a tree of 30 joints at random."""
    from trees import humanoid, random_tree, seven_dof_arm

    return {
        "arm, 7 joints": seven_dof_arm(),
        "humanoid, 30 freedoms": humanoid(),
        "random tree, 30 joints": random_tree(30, seed=3),
        "random chain, 30 joints": random_tree(30, seed=4, branching=1.0),
    }


def measure(model) -> dict[str, float]:
    """All figures of one model without forces beyond gravity, joints and bodies alone."""
    description = model.describe()
    derived = min((derive_text(model) for _ in range(3)), key=lambda d: sum(d.seconds.values()))
    system = runtime.load(derived.text)
    p = system.parameter_values({})
    state = _random_state(system)
    figures = {
        "coordinates": system.nv,
        "derive s": derived.seconds["derive"],
        "all s": sum(derived.seconds.values()),
        "M+f": system.operations["mass_matrix"] + system.operations["forces"],
        "rhs": system.operations["rhs"],
        "implicit": system.operations["residual"] + system.operations["residual_jacobian"],
        "compile s": cold_compile(system),
        "load ms": _load_from_cache(system) * 1e3,
        "ns": nanoseconds_per_call(system, state, p),
    }
    try:
        figures |= _pinocchio(description, system, p, state)
    except ImportError:
        print("Pinocchio is not installed", file=sys.stderr)
    return figures


def _random_state(system) -> np.ndarray:
    rng = np.random.default_rng(1)
    state = rng.uniform(-1, 1, system.nq + system.nv)
    for first in system.source.header.get("quaternions", []):
        state[first : first + 4] /= np.linalg.norm(state[first : first + 4])
    return state


def _load_from_cache(system) -> float:
    """Seconds to load the object code of `rhs` when it is in the cache."""
    from symgen.runtime.code import engine

    source = system.kernel("rhs").source
    with tempfile.TemporaryDirectory() as folder:
        best = np.inf
        for k in range(4):
            start = time.perf_counter()
            code = engine.object_code("again", "rhs", f"symgen_{source.name}", source.lower, Path(folder))
            engine.MachineCode().add(code, f"symgen_{source.name}")
            best = min(best, time.perf_counter() - start) if k else best
    return best


def _pinocchio(description, system, p, state) -> dict[str, float]:
    import pinocchio as pin
    from pinocchio_model import pinocchio_tree

    values = {q["name"]: value for q, value in zip(system.parameters, p, strict=False)}
    values |= {c.name: c.value for c in description.constants}
    tree = pinocchio_tree(description, values)
    model, data = tree.model, tree.model.createData()
    q, v = tree.state(state)
    tau = np.zeros(model.nv)
    ours = system.kernel("rhs")(0.0, state, p)[system.nq : system.nq + system.nv]
    theirs = tree.accelerations(state)
    empty = pin.Model()
    nothing, no_data = np.zeros(0), empty.createData()
    spent = _best(lambda: pin.aba(model, data, q, v, tau))
    overhead = _best(lambda: pin.aba(empty, no_data, nothing, nothing, nothing))
    return {
        "aba ns": (spent - overhead) * 1e9,
        "difference": float(np.max(np.abs(ours - theirs)) / max(1.0, np.max(np.abs(theirs)))),
    }


def _best(call) -> float:
    best = np.inf
    for _ in range(REPEATS):
        start = time.perf_counter()
        for _ in range(CALLS):
            call()
        best = min(best, time.perf_counter() - start)
    return best / CALLS


def main() -> None:
    stand_ins.at_once = True  # what runs come to, however short they are here
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", type=Path, help="write the figures to this file too")
    chosen = parser.parse_args()
    results = {name: measure(model) for name, model in _models().items()}
    columns = list(next(iter(results.values())))
    table = Table("model", *columns)
    for name, figures in results.items():
        table.add_row(
            name,
            *(f"{figures[c]:.3g}" if isinstance(figures[c], float) else str(figures[c]) for c in columns),
        )
    Console(width=150).print(table)
    if chosen.json:
        chosen.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
