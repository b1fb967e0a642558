"""Savings of a process: what it does not derive, compile or import."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Iterator

import numpy as np

from savings.measure import Row, bundled, by_turns, compared
from symgen.link import derive_text
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.runtime import System, load, solve
from symgen.runtime.code import cache, compiler, engine

PACKAGES = ("numba", "scipy.sparse.linalg", "sympy", "rerun")
STARTS = 9


def compile_anew(system: System, names: list[str]) -> list[bytes]:
    """The object code of functions, compiled without a cache."""
    return [
        compiler.compile_ir(system.kernel(name).source.lower_standalone(f"symgen_{name}")[0])
        for name in names
    ]


def cached(system: System, names: list[str]) -> list[bytes]:
    """The object code that the cache has for functions, under the keys with which kernels are looked up."""
    folder = cache.cache_folder("kernels")
    keys = [engine.cache_key(f"symgen_{name}\0{system.kernel(name).source.key_text()}") for name in names]
    return [cache.fetch(folder / f"{key}.o") for key in keys]


def kernels() -> Iterator[Row]:
    """Only the kernels in use, and those from the cache."""
    for name in ("humanoid_tree", "slider_crank"):
        system = bundled(name)
        options = {"t_end": 0.02, "method": "dop853"}
        before = solve(system, **options)
        used = list(system.compiled)
        every = [function for function in system.source.functions if system.has(function)]
        read, some, all_of_them = by_turns(
            lambda s=system, n=used: [System(s.source).kernel(x) for x in n],
            lambda s=system, n=used: compile_anew(s, n),
            lambda s=system, n=every: compile_anew(s, n),
            repeats=3,
        )
        # All kernels have been made by now: a run beside the unused ones must not differ.
        unused = System(system.source)
        for function in every:
            unused.kernel(function)
        same_run = compared(before, solve(unused, **options))
        same_code = "same bytes" if cached(system, used) == compile_anew(system, used) else "differs"
        yield Row(name, "only kernels in use are compiled", some, all_of_them, same_run)
        yield Row(name, "kernels kept in the cache", read, some, same_code)


def derivation() -> Iterator[Row]:
    """A generated module found in the cache."""
    for name in ("double_pendulum", "humanoid_tree"):
        text = derive_text(load_model(find(name), {})).text
        path = cache.cache_folder("modules") / f"skip-{name}"
        cache.store(path, text.encode())
        seconds = by_turns(
            lambda p=path: cache.fetch(p), lambda n=name: derive_text(load_model(find(n), {})), repeats=3
        )
        same = "same text" if cache.fetch(path) == text.encode() else "differs"
        path.unlink()
        yield Row(name, "module kept in the cache", *seconds, same)


def on_demand() -> Iterator[Row]:
    """The Jacobian of implicit methods of large models, derived when one asks for it."""
    for name, options in (
        ("humanoid_tree", {}),
        ("n_pendulum", {"N": "50"}),
        ("chain_absolute", {"N": "50"}),
    ):
        model = load_model(find(name), options)
        part, whole = (derive_text(model, "x", on_demand=left_out) for left_out in (True, False))
        seconds = by_turns(
            lambda m=model: derive_text(m, on_demand=True), lambda m=model: derive_text(m), repeats=3
        )
        solutions = [solve(load(made.text), t_end=0.02, method="dop853") for made in (part, whole)]
        scene = " ".join((name, *options.values()))
        yield Row(scene, "Jacobian derived on demand", *seconds, compared(*solutions))


def process_start() -> Iterator[Row]:
    """What a warm `symgen run` does not import or start."""
    run = (
        "import sys; from symgen.cli import main\n"
        "sys.argv = ['symgen', 'run', 'double_pendulum', '--no-log']\nmain()"
    )
    variants = {f"{package} not imported": (f"import {package}\n{run}", {}) for package in PACKAGES}
    variants["no threads of BLAS"] = (run, {"OPENBLAS_NUM_THREADS": str(os.cpu_count())})
    results, seconds = {}, {}
    for _ in range(STARTS):
        for name, (code, settings) in {"": (run, {}), **variants}.items():
            results[name], took = started(code, settings)
            seconds[name] = min(took, seconds.get(name, np.inf))
    for name in variants:
        same = "same text" if results[name] == results[""] else "differs"
        yield Row("start of double_pendulum", name, seconds[""], seconds[name], same)


def started(code: str, settings: dict[str, str]) -> tuple[list[bytes], float]:
    """What a process prints besides times, and its processor time [s]."""
    environment = {
        key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"
    } | settings
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-c", code], env=environment, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    lines = [line for line in done.stdout.splitlines() if not line.startswith(b"  time")]
    return lines, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


CASES = (kernels, derivation, on_demand, process_start)
