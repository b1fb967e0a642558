"""Functions for robot programs against Pinocchio's C++, by turns: ns of processor time per call, and what is derived.

    python benchmarks/robot_speed.py FOLDER [--pinocchio PROGRAM] [--turns 3]

FOLDER holds the package example-robot-data. PROGRAM is `pinocchio_speed.cpp`, compiled with -O3 -march=native, Eigen
and the headers and libraries of the package pin (-std=c++17 -DNDEBUG -DBOOST_FUSION_INVOKE_MAX_ARITY=10
-DFUSION_MAX_VECTOR_SIZE=10 -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_LIMIT_VECTOR_SIZE=30
-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS); without it only this project's times are given.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from symgen import link
from symgen.robots.build import import_urdf
from symgen.runtime.code import bridge
from symgen.runtime.robot import Robot

ROBOTS = (
    ("UR5", "ur5_robot.urdf", "fixed"),
    ("Panda", "panda.urdf", "fixed"),
    ("ANYmal", "anymal.urdf", "free"),
    ("Talos, reduced", "talos_reduced.urdf", "free"),
    ("Talos", "talos_full_v2.urdf", "free"),
)
FUNCTIONS = (
    "forward_dynamics",
    "inverse_dynamics",
    "mass_matrix",
    "inverse_dynamics_derivatives",
    "forward_dynamics_derivatives",
)
STATES, REPEATS, RUNS = 64, 20, 7


def nanoseconds(robot: Robot, function: str) -> float:
    """The least of some runs over random states, on parameters that are precomputed once.

    All results go to one place, as in Pinocchio's `Data`: rows of their own would measure the memory.
    """
    rng = np.random.default_rng(0)
    kernel = robot.kernel(function)
    states = rng.uniform(-1, 1, (STATES, kernel.source.lengths.y))
    if robot.nq > robot.nv:
        states[:, 3:7] /= np.linalg.norm(states[:, 3:7], axis=1)[:, None]
    states = np.tile(states, (REPEATS, 1))
    times, out = np.zeros(len(states)), np.zeros(kernel.out_size)
    p = robot.precomputed()
    arrays = (times.ctypes.data, states.ctypes.data, states.shape[1], p.ctypes.data, 0, out.ctypes.data, 0)
    call, best = bridge.rows_caller(), np.inf
    for _ in range(RUNS):
        began = time.process_time_ns()
        call(kernel.precomputed_address, len(states), *arrays)
        best = min(best, (time.process_time_ns() - began) / len(states))
    return best


def of_pinocchio(program: Path, path: Path, base: str) -> dict[str, float]:
    """What the compiled program says of one robot."""
    import pinocchio

    joint = (pinocchio.JointModelFreeFlyer(),) if base == "free" else ()
    with tempfile.NamedTemporaryFile(suffix=".txt") as file:
        pinocchio.buildModelFromUrdf(str(path), *joint).saveToText(file.name)
        said = subprocess.run([program, file.name], capture_output=True, text=True, check=True).stdout
    return {name: float(value) for name, value in (line.split() for line in said.splitlines())}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--pinocchio", type=Path)
    parser.add_argument("--turns", type=int, default=3)
    given = parser.parse_args()
    for name, file, base in ROBOTS:
        path = next(given.folder.rglob(file))
        model = import_urdf(without_mimics(path), base).model
        made = {}
        for function in FUNCTIONS:
            began = time.perf_counter()
            robot = made[function] = link.robot(model, function)
            derived = time.perf_counter()
            robot.kernel(function), robot.precomputed()
            seconds = derived - began, time.perf_counter() - derived
            print(
                f"{name}: {function}: derived in {seconds[0]:.2f} s, compiled in {seconds[1]:.2f} s",
                flush=True,
            )
        ours, theirs = dict.fromkeys(FUNCTIONS, np.inf), dict.fromkeys(FUNCTIONS, np.inf)
        for _ in range(given.turns):
            for function, robot in made.items():
                ours[function] = min(ours[function], nanoseconds(robot, function))
            if given.pinocchio:
                for function, value in of_pinocchio(given.pinocchio, path, base).items():
                    theirs[function] = min(theirs[function], value)
        nv = next(iter(made.values())).nv
        for function in FUNCTIONS:
            a, b = theirs[function], ours[function]
            print(f"| {name} ({nv}) | {function} | {a:.0f} | {b:.0f} | {a / b:.1f} |", flush=True)


def without_mimics(path: Path) -> Path:
    """The robot with joints that mimic others free, as Pinocchio takes them."""
    text = re.sub(r"<mimic[^>]*/>", "", path.read_text(encoding="utf-8"))
    file = Path(tempfile.mkdtemp()) / path.name
    file.write_text(text, encoding="utf-8")
    return file


if __name__ == "__main__":
    main()
