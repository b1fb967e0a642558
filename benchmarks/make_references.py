"""Make the end states of the scenes of `symgen bench`, in high precision: models/references/<scene>.json.

    python benchmarks/make_references.py [SCENE ...]

The functions of the generated module are run as plain Python on numbers of 40 digits (gmpy2 where it is installed,
else mpmath, several times slower), and integrated by the extrapolated midpoint rule of Gragg, Bulirsch and Stoer
(Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.9), which shares nothing with the integrators
of the run time. Each scene runs twice, at orders 24 and 28 with different tolerances; the difference is the claimed
error. Parameters and start values are the doubles that every run starts from. A start with constraints is first
projected onto them in the same precision; they are not enforced afterwards, for their drift is of the order of the
integration error. Constraints that follow from others are left out (`redundant_motion.py`).
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
from high_precision import DIGITS, REAL, TEXT, Motion
from redundant_motion import RedundantMotion, rank_at

from symgen.link import module_for
from symgen.model.library import bundled_folder, find
from symgen.runtime import System, load
from symgen.runtime.constraints.assembly import assemble
from work_precision.scenes import SCENES, Scene

RUNS = ((12, 1e-22), (14, 1e-24))  # columns of the tableau, tolerance of a step
SAFETY, SHRINK, GROW = 0.8, 0.2, 4.0


def extrapolated_step(motion: Motion, t, y, f, h, columns: int, scale):
    """Return the state after h, and the error of its second-best value in units of `scale`.

    The midpoint rule with 2, 4, 6, ... substeps, extrapolated in h^2; without Gragg's smoothing step.
    """
    row: list[np.ndarray] = []
    for j in range(columns):
        n = 2 * (j + 1)
        step = h / n
        before, now = y, y + step * f
        for i in range(1, n):
            before, now = now, before + 2 * step * motion.derivative(t + i * step, now)
        previous, row = row, [now]
        for k in range(1, j + 1):
            ratio = (REAL(n) / (2 * (j - k + 1))) ** 2
            row.append(row[k - 1] + (row[k - 1] - previous[k - 1]) / (ratio - 1))
    error = max(abs(a) / s for a, s in zip(row[-1] - row[-2], scale, strict=True))
    return row[-1], float(error)


def integrate(motion: Motion, y: np.ndarray, t_end: float, columns: int, tolerance: float, first: float):
    """Return the end state, and the largest |q|, |v| and multiplier that were seen."""
    nq, largest_multiplier = motion.system.nq, 0.0
    t, end, h = REAL(0), REAL(t_end), min(REAL(first), REAL(t_end))
    largest = np.array([abs(x) for x in y], dtype=object)
    f = motion.derivative(t, y)
    while t < end:
        h = min(h, end - t)
        size = [max(largest[:nq]), max(max(largest[nq:]), REAL(1e-30))]
        scale = [tolerance * max(size[i >= nq], REAL(1e-10)) for i in range(motion.n)]
        new, error = extrapolated_step(motion, t, y, f, h, columns, scale)
        if error <= 1.0:
            t, y = t + h, new
            largest = np.maximum(largest, np.abs(y))
            f = motion.derivative(t, y)
            if motion.system.m:
                largest_multiplier = max(largest_multiplier, *map(float, map(abs, motion.multipliers(t, y))))
        factor = SAFETY * max(error, 1e-30) ** (-1.0 / (2 * columns - 1))
        h = h * REAL(min(GROW, max(SHRINK, factor)))
    return y, (float(max(largest[:nq])), float(max(largest[nq:])), largest_multiplier)


def make_motion(system: System, text: str, p: np.ndarray, start: np.ndarray) -> Motion:
    """Return the equations of motion, with independent constraints only."""
    if system.m:
        rank = rank_at(system, p, start)
        if rank < system.m:
            return RedundantMotion(system, text, p, rank)
    return Motion(system, text, p)


def make(scene: Scene) -> dict:
    """Integrate a scene twice and return its reference."""
    began = time.process_time()
    text = module_for(Path(find(scene.model)), dict(scene.options)).text
    system = load(text)
    p = system.parameter_values(scene.parameters)
    assembly = assemble(system, p, scene.start, None, 0.0)
    start = np.concatenate([assembly.q, assembly.v])
    motion = make_motion(system, text, p, start)
    y0 = motion.projected(np.array([REAL(float(x)) for x in start], dtype=object))
    ends = []
    for columns, tolerance in RUNS:
        end, size = integrate(motion, y0, scene.t_end, columns, tolerance, scene.t_end * 1e-4)
        ends.append(end)
        print(
            f"  order {2 * columns}: {motion.calls} evaluations, {time.process_time() - began:.0f} s",
            flush=True,
        )
    nq = system.nq
    scale = [size[i >= nq] for i in range(motion.n)]
    difference = max(float(abs(a - b)) / s for a, b, s in zip(*ends, scale, strict=True))
    digits = [TEXT(x) for x in ends[1]]
    end, sizes = {"q": digits[:nq], "v": digits[nq:]}, {"q": size[0], "v": size[1]}
    if system.m:
        values = [motion.multipliers(REAL(scene.t_end), y) for y in ends]
        difference = max(difference, float(max(abs(values[0] - values[1]))) / size[2])
        end["multipliers"], sizes["multipliers"] = [TEXT(x) for x in values[1]], size[2]
    return {
        "scene": scene.name,
        "model": scene.model,
        "options": dict(scene.options),
        "t_end": scene.t_end,
        "parameters": {entry["name"]: float(x) for entry, x in zip((*system.parameters, *system.inputs), p)},
        "coordinates": [entry["name"] for entry in system.coordinates],
        "rates": [entry["name"] for entry in system.rates],
        "start": {"q": assembly.q.tolist(), "v": assembly.v.tolist()},
        "end": end,
        "size": sizes,
        "error": difference,
        "method": f"benchmarks/make_references.py: extrapolation of orders {2 * RUNS[0][0]} and {2 * RUNS[1][0]} "
        f"on {DIGITS}-digit numbers, error: largest difference in parts of size",
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", help="all by default")
    folder = bundled_folder() / "references"
    for name in parser.parse_args().scenes or SCENES:
        print(name, flush=True)
        reference = make(SCENES[name])
        print(f"  error {reference['error']:.1e}", flush=True)
        (folder / f"{name}.json").write_text(json.dumps(reference, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
