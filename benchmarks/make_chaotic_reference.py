"""Make states of the chaotic double pendulum up to 60 s in high precision: tests/reference/double_pendulum_60.json.

    python benchmarks/make_chaotic_reference.py

As `make_references.py`, with gmpy2 and numbers of 80 digits: errors grow by about 1e28 in this time. Two runs, at
orders 36 and 40 with different tolerances; the difference is the claimed error.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

import gmpy2
import numpy as np
from high_precision import REAL, TEXT, Motion
from make_references import integrate

from symgen.link import module_for
from symgen.model.library import find
from symgen.runtime import load

DIGITS = 80
RUNS = ((18, 1e-50), (20, 1e-53))  # columns of the tableau, tolerance of a step
EVERY, T_END = 1.0, 60.0  # [s]
FILE = Path(__file__).parents[1] / "tests" / "reference" / "double_pendulum_60.json"


def states(motion: Motion, y: np.ndarray, columns: int, tolerance: float) -> list[np.ndarray]:
    """Return the states every second."""
    found, began = [y], time.process_time()
    for _ in range(round(T_END / EVERY)):
        found.append(integrate(motion, found[-1], EVERY, columns, tolerance, 0.05)[0])
    print(f"order {2 * columns}: {motion.calls} evaluations, {time.process_time() - began:.0f} s", flush=True)
    return found


def main() -> None:
    """Integrate twice and write the file."""
    text = module_for(Path(find("double_pendulum")), {}).text
    system = load(text)
    gmpy2.get_context().precision = int(DIGITS * 3.33)
    motion = Motion(system, text, system.parameter_values())
    q, v, *_ = system.initial_state()
    start = np.array([REAL(float(x)) for x in (*q, *v)], dtype=object)
    runs = [states(motion, start, *settings) for settings in RUNS]
    error = max(float(abs(a - b).max()) for a, b in zip(*runs, strict=True))
    print(f"error {error:.1e}")
    reference = {
        "model": "double_pendulum",
        "method": f"benchmarks/make_chaotic_reference.py: extrapolation of orders {2 * RUNS[0][0]} and "
        f"{2 * RUNS[1][0]} on {DIGITS}-digit numbers; error: largest difference of the two",
        "error": error,
        "t": [k * EVERY for k in range(len(runs[1]))],
        "states": [[TEXT(x) for x in y] for y in runs[1]],
    }
    FILE.write_text(json.dumps(reference, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
