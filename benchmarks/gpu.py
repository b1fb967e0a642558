"""Ensembles on a graphics processor: are the bits those of this machine's processors, and how many members a second.

    python benchmarks/gpu.py --out gpu.json

needs the extra `gpu`, a graphics processor of NVIDIA and its driver; it takes some minutes. All programs are compiled
first, on all processors. For each model and method it compares 512 members with lanes to the bit, and times the launch
alone (`kernel`), for arrays in registers and in memory and for several sizes of blocks, and with its copies (`batch`);
the ensemble as users
run it (`ensemble`), with starts, verdicts and series, and without a device (`processors`: all of this machine's); and
eight lanes of one thread of this machine (`lanes`). The JSON has the names of both processors.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import platform
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from symgen import load
from symgen.runtime.code.nvptx import ptx_of
from symgen.runtime.ensemble import normal, uniform
from symgen.runtime.ensemble.batch import LaneBatch
from symgen.runtime.ensemble.gpu import cuda
from symgen.runtime.ensemble.gpu.assembler import Assembled, assemble, assembler_version
from symgen.runtime.ensemble.gpu.batch import DeviceBatch
from symgen.runtime.ensemble.gpu.choose import LARGEST_STACK, program_of
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import Plan, make_plan
from symgen.runtime.errors import RuntimeModelError

# Model, end [s], what varies.
MODELS: dict[str, tuple[float, dict[str, Any]]] = {
    "double_pendulum": (10.0, {"parameters": {"L2": normal(1.0, 0.01)}, "start": {"theta1": uniform(-1, 1)}}),
    "four_bar": (2.0, {"parameters": {"g": uniform(9.0, 10.0)}}),
    "slider_crank": (2.0, {"parameters": {"r": uniform("0.095 m", "0.105 m")}}),
    "n_pendulum": (5.0, {"parameters": {"g": uniform(9.0, 10.0)}}),
    "outer_solar_system": (20_000.0, {"rate": {"x_sun": normal(0.0, 1e-8)}}),
    "seven_dof_arm": (5.0, {"start": {"q1": uniform(-1, 1)}}),
    "andrews_squeezer": (0.03, {"parameters": {"mom": uniform(0.03, 0.035)}}),
}
METHODS = {"rk4": {}, "verlet": {}, "dop853": {"rtol": 1e-8}, "taylor": {"rtol": 1e-8}}
_COMPARED, _IN_LANES, _REPEATS = 512, 1024, 3
_LONG = 1.0  # seconds; what takes that long is timed once
Case = tuple[str, str, bool]  # model, method, whether arrays are in registers


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--models", default=",".join(MODELS), help="names with commas")
    parser.add_argument("--methods", default=",".join(METHODS), help="names with commas")
    parser.add_argument("--members", type=int, default=1 << 17)
    parser.add_argument("--blocks", default="32,64,128,256", help="threads of a block, with commas")
    parser.add_argument("--out", type=Path, default=Path("gpu.json"))
    asked = parser.parse_args()
    facts = cuda.device_facts()
    blocks = [*map(int, asked.blocks.split(","))]
    found: dict[str, Any] = {
        "device": facts.name, "arch": facts.arch, "assembler": assembler_version(),
        "processor": platform.processor() or platform.machine(), "processors": os.cpu_count(),
        "members": asked.members, "results": [],
    }  # fmt: skip
    print(f"{facts.name} ({facts.arch})", flush=True)
    pairs = [(name, method) for name in asked.models.split(",") for method in asked.methods.split(",")]
    made = compile_all(pairs, facts.arch)
    for name, method in pairs:
        programs = {flat: made[name, method, flat] for flat in (True, False) if (name, method, flat) in made}
        result = measure(name, method, programs, asked.members, blocks)
        found["results"].append(result)
        print(json.dumps(result), flush=True)
        asked.out.write_text(json.dumps(found, indent=1))  # what is known so far is kept


def compile_all(pairs: list[tuple[str, str]], arch: str) -> dict[Case, Assembled | str]:
    """Return the program of each case, or why there is none."""
    for name in {name for name, _ in pairs}:
        load(name)  # derived once, not by each process
    cases = [
        (name, method, flat)
        for name, method in pairs
        for flat in ((False,) if method == "taylor" else (True, False))
    ]
    # Children that start anew: a fork would take the driver's state with it.
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        return dict(zip(cases, pool.map(compile_case, cases, [arch] * len(cases))))


def compile_case(case: Case, arch: str) -> Assembled | str:
    name, method, flat = case
    try:
        plan = plan_of(name, method, _COMPARED)
        program = program_of(
            plan.system, method, scale_energy=plan.settings.scale_energy, with_frames=False, flat=flat
        )
        return assemble(ptx_of(program.whole(device=True), arch), arch)
    except RuntimeModelError as error:
        return str(error)


def measure(
    name: str, method: str, programs: dict[bool, Assembled | str], n: int, blocks: list[int]
) -> dict[str, Any]:
    """Return what is known of a model and method: bits, members a second."""
    result: dict[str, Any] = {"model": name, "method": method}
    t_end, varied = MODELS[name]
    try:
        plan = plan_of(name, method, n)
        parameters, values = plan.members.arrays(plan.p, 0, n)
        starts, _ = plan.starts.of(parameters, values)
        few = slice(0, min(n, _IN_LANES))
        lanes = LaneBatch(plan.system, plan.settings)
        lanes.run(parameters[:8], starts[:8])
        seconds, here = timed(lambda: lanes.run(parameters[few], starts[few]), 1)
        result["lanes"] = len(here.end) / seconds
        result["programs"] = [
            measured_program(plan, flat, made, parameters, starts, here, blocks)
            for flat, made in programs.items()
        ]
        asked = dict(t_end=t_end, n=n, seed=1, method=method, **METHODS[method], **varied)
        plan.system.ensemble(**{**asked, "n": 64})
        seconds, on_processors = timed(lambda: plan.system.ensemble(**asked), 1)
        result["processors"] = n / seconds
        plan.system.ensemble(**{**asked, "n": 64}, device="cuda")
        seconds, ensemble = timed(lambda: plan.system.ensemble(**asked, device="cuda"), 1)
        result |= {
            "ensemble": n / seconds,
            "same_ensemble": all(
                np.array_equal(ensemble[key], on_processors[key], equal_nan=True) for key in ensemble.names
            ),
            "failed": int(ensemble.n_failed),
            "doubtful": int(ensemble.n_doubtful),
        }
    except RuntimeModelError as error:
        result["refused"] = str(error)
    return result


def plan_of(name: str, method: str, n: int) -> Plan:
    t_end, varied = MODELS[name]
    return make_plan(
        load(name), EnsembleOptions(t_end=t_end, n=n, seed=1, method=method, **METHODS[method], **varied)
    )


def measured_program(
    plan: Plan,
    flat: bool,
    made: Assembled | str,
    parameters: np.ndarray,
    starts: np.ndarray,
    here: Any,
    blocks: list[int],
) -> dict[str, Any]:
    """Return registers, bits and members a second of a program with arrays in registers or in memory."""
    if isinstance(made, str):
        return {"flat": flat, "refused": made}
    result: dict[str, Any] = {
        "flat": flat, "registers": made.registers, "spilled": made.spill_stores, "stack": made.stack,
        "assembling": made.seconds,
    }  # fmt: skip
    if made.stack > 4 * LARGEST_STACK:
        return result
    batch = DeviceBatch(plan.system, replace(plan.settings), cuda.CudaKernel(made.code))
    few = batch.run(parameters[:_COMPARED], starts[:_COMPARED])
    result["same_bits"] = bool(
        np.array_equal(few.end, here.end[: len(few.end)], equal_nan=True)
        and np.array_equal(few.column("status"), here.column("status")[: len(few.end)])
        and np.array_equal(few.column("steps"), here.column("steps")[: len(few.end)])
    )
    seconds, _ = timed(lambda: batch.run(parameters, starts), _REPEATS)
    result["batch"] = len(starts) / seconds
    result["kernel"] = {
        block: len(starts) / seconds_alone(batch, parameters, starts, block) for block in blocks
    }
    return result


def seconds_alone(batch: DeviceBatch, parameters: np.ndarray, starts: np.ndarray, block: int) -> float:
    """How long a launch takes whose arrays are on the device."""
    kernel, sent, usual = batch._kernel, {}, cuda._BLOCK

    def watched(given: Any, written: Any) -> list[Any]:
        sent["arguments"] = type(kernel)._sent(kernel, given, written)
        return sent["arguments"]

    def again() -> None:
        kernel._start(sent["arguments"], len(starts))
        kernel._stream.sync()

    cuda._BLOCK, kernel._sent = block, watched
    try:
        batch.run(parameters, starts)
        return timed(again, _REPEATS)[0]
    finally:
        cuda._BLOCK = usual
        del kernel._sent


def timed(work: Any, repeats: int) -> tuple[float, Any]:
    """The least time of some repetitions, and the result of the last one."""
    least = float("inf")
    for _ in range(repeats):
        began = time.perf_counter()
        found = work()
        least = min(least, time.perf_counter() - began)
        if least > _LONG:
            break
    return least, found


if __name__ == "__main__":
    try:
        main()
    except RuntimeModelError as error:
        sys.exit(f"Error: {error}")
