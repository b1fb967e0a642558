"""What a first result costs: processor time and memory of whole processes.

    python benchmarks/start.py [--turns N] [--json FILE]

`symgen run double_pendulum --no-log` on an empty cache, with one method of each family of step loops; the same with
everything derived and compiled; and what other programs need for the first end state of that pendulum, from its
Lagrangian: heyoka and SymPy with SciPy, each by the shortest program that its documents suggest. Everything runs by
turns, each in a process of its own, whose user and system time count. Python keeps its byte code there, as it does
for users.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

FAMILIES = (
    "auto", "dop853", "rk4", "verlet", "rattle", "gauss8", "implicit_midpoint", "generalized_alpha",
    "bdf", "radau5", "radau13",
)  # fmt: skip
T_END = "10"
LAGRANGIAN = """
def lagrangian(sin, cos, a1, a2, w1, w2, m1=1.0, m2=1.0, L1=1.0, L2=1.0, g=9.81):
    T = m1*(L1*w1)**2/2 + m2*((L1*w1)**2 + (L2*w2)**2 + 2*L1*L2*w1*w2*cos(a1 - a2))/2
    return T + (m1 + m2)*g*L1*cos(a1) + m2*g*L2*cos(a2)
"""
HEYOKA = """
import heyoka
a1, a2, w1, w2 = heyoka.make_vars("a1", "a2", "w1", "w2")
L = lagrangian(heyoka.sin, heyoka.cos, a1, a2, w1, w2)
equations = heyoka.lagrangian(L, [a1, a2], [w1, w2])
run = heyoka.taylor_adaptive(equations, [1.5, 1.5, 0.0, 0.0], tol=1e-8)
run.propagate_until(10.0)
print(run.state)
"""
SCIPY = """
import numpy, sympy
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols
t = dynamicsymbols._t
a = dynamicsymbols("a1 a2")
L = lagrangian(sympy.sin, sympy.cos, *a, *(x.diff(t) for x in a))
method = LagrangesMethod(L, a)
method.form_lagranges_equations()
values = [*a, *(x.diff(t) for x in a)]
M, f = (sympy.lambdify(values, part) for part in (method.mass_matrix_full, method.forcing_full))
rhs = lambda t, y: numpy.linalg.solve(M(*y), f(*y)).ravel()
print(solve_ivp(rhs, (0, 10), [1.5, 1.5, 0, 0], method="DOP853", rtol=1e-8, atol=1e-10).y[:, -1])
"""
PEERS = {"heyoka": HEYOKA, "SymPy and SciPy": SCIPY}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--turns", type=int, default=3, metavar="N", help="of which the least counts (3)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    asked = parser.parse_args()
    rows: dict[str, list[tuple[float, float]]] = {}
    failed = set()
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(asked.turns):
            for family in FAMILIES:
                cache = Path(folder) / f"{turn}-{family}"
                for what in ("empty cache", "warm"):
                    took = measured(symgen_run(family), {"SYMGEN_CACHE_DIR": str(cache)}, folder)
                    rows.setdefault(f"symgen, {family}, {what}", []).append(took)
            for name, program in PEERS.items():
                try:
                    took = measured([sys.executable, "-c", LAGRANGIAN + program], {}, folder)
                    rows.setdefault(name, []).append(took)
                except subprocess.CalledProcessError:
                    failed.add(name)
    least = {name: np.min(times, axis=0).round(3).tolist() for name, times in rows.items()}
    print(f"{'process':40}{'seconds':>9}{'MB':>7}")
    for name, (seconds, megabytes) in least.items():
        print(f"{name:40}{seconds:9.2f}{megabytes:7.0f}")
    for name in sorted(failed):
        print(f"{name}: not installed, or it failed")
    if asked.json is not None:
        asked.json.write_text(json.dumps(least, indent=1) + "\n", encoding="utf-8")
    return 0


def symgen_run(method: str) -> list[str]:
    """The command of a run without a recording."""
    options = ["--t-end", T_END, "--method", method, "--no-log", "--quiet"]
    return [sys.executable, "-c", "from symgen.cli import main; main()", "run", "double_pendulum", *options]


def measured(command: list[str], environment: Mapping[str, str], folder: str) -> tuple[float, float]:
    """Return processor time [s] and the largest memory [MB] of a process.

    Raises
    ------
    subprocess.CalledProcessError
        It failed. A run that its health report doubts has not: status 3.
    """
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    process = subprocess.Popen(
        command,
        cwd=folder,
        env={**kept, **environment},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 3):
        raise subprocess.CalledProcessError(process.returncode, command)
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0


if __name__ == "__main__":
    sys.exit(main())
