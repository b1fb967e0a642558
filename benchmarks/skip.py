"""What each saving gains: every one switched off by turns, the same work timed with and without it.

    python benchmarks/skip.py [--json FILE] [--only WORD]

Each row states a scene, a saving, the time with and without it, the factor gained, and whether the results are the
same: bit for bit, or the largest difference in parts of the largest value. Times are processor time, the least of
several taken by turns; those of a start are of the whole process.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np

from runtime.batches import accelerations_and_multipliers, evaluate, evaluate_rows
from runtime.code import cache, engine
from runtime.solution import Solution
from runtime.solve import solve
from runtime.system import System, load
from symgen.derive import pipeline
from symgen.derive.scenes import subsystems
from symgen.emit.module import emit
from symgen.link import derive as system_of
from symgen.link import derive_text
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.model.model import Model

PACKAGES = ("numba", "scipy.sparse.linalg", "sympy", "rerun")
REPEATS = 7
STARTS = 9
CALLS = 2000


@dataclass(frozen=True)
class Row:
    """One saving in one scene; seconds with it and without, and what became of the results."""

    scene: str
    saving: str
    with_it: float
    without: float
    results: str

    @property
    def factor(self) -> float:
        """How many times longer the work takes without the saving."""
        return self.without / self.with_it


def bundled(name: str, **options: str) -> System:
    """The system of a bundled model."""
    return load(derive_text(load_model(find(name), options)).text)


def by_turns(*works: Callable[[], object], repeats: int = REPEATS) -> list[float]:
    """The least processor time of each work [s], done by turns, so that a busy machine treats all alike."""
    least = [np.inf] * len(works)
    for _ in range(repeats):
        for k, work in enumerate(works):
            began = time.thread_time()
            work()
            least[k] = min(least[k], time.thread_time() - began)
    return least


def runs(*given: tuple[System, dict], repeats: int = REPEATS) -> tuple[list[Solution], list[float]]:
    """Solutions of systems with options for `solve`, and the processor time of each whole run [s]."""
    works = [lambda system=system, options=options: solve(system, **options) for system, options in given]
    return [work() for work in works], by_turns(*works, repeats=repeats)


def calls(*systems: System) -> tuple[list[np.ndarray], list[float]]:
    """Values of `rhs` at states around the start, and the processor time of a call [s]."""
    q, v, _, _ = systems[0].initial_state()
    states = np.random.default_rng(7).normal(np.concatenate([q, v]), 0.1, (CALLS, len(q) + len(v)))
    times, rows, works = np.zeros(CALLS), [], []
    for system in systems:
        p = system.prepared(system.parameter_values())
        address, out = np.uint64(system.kernel("rhs").prepared_address), np.zeros((CALLS, system.n_row))
        works.append(lambda a=address, p=p, out=out: evaluate_rows(a, times, states, p, out))
        works[-1]()
        rows.append(out)
    return rows, [seconds / CALLS for seconds in by_turns(*works, repeats=30 * REPEATS)]


def compared(a: Solution, b: Solution) -> str:
    """Whether two solutions have the same frames."""
    return difference(np.hstack([a.q, a.v]), np.hstack([b.q, b.v]))


def difference(a: np.ndarray, b: np.ndarray) -> str:
    """Whether two arrays are the same, or how far they are from it."""
    if np.array_equal(a, b, equal_nan=True):
        return "same bits"
    return f"{np.abs(a - b).max() / max(np.abs(a).max(), np.finfo(float).tiny):.1e}"


def without_hoisting(system: System) -> System:
    """The same model with its work on parameters done in every call."""
    header = {key: value for key, value in system.source.header.items() if key != "hoisted"}
    return System(replace(system.source, header=header))


def tied_masses(n: int) -> System:
    """Masses on a line, tied by springs and by inertia: M is constant and tridiagonal."""
    model = Model("tied_masses")
    model.parameters(m=0.5, k=100.0, c=0.1)
    x = [model.coordinate(f"x{i}", start=0.01 * (i % 5)) for i in range(n)]
    for before, after in zip([0, *x], x, strict=False):
        model.potential(f"k/2*(({after})-({before}))**2")
    for before, after in itertools.pairwise(x):
        model.kinetic(f"m/2*dot({before})**2 + c/4*(dot({before})+dot({after}))**2")
    model.kinetic(f"m/2*dot({x[-1]})**2")
    return system_of(model)


def hoisting() -> Iterator[Row]:
    """Work on parameters, the factors of a constant mass matrix among it."""
    scenes = {
        "double_pendulum": ("work on parameters once", bundled("double_pendulum")),
        "spinning_top": ("work on parameters once", bundled("spinning_top")),
        "seven_dof_arm": ("work on parameters once", bundled("seven_dof_arm")),
        "tied masses, 30": ("constant M factored once", tied_masses(30)),
        "tied masses, 200": ("constant M factored once", tied_masses(200)),
    }
    for scene, (saving, system) in scenes.items():
        values, seconds = calls(system, without_hoisting(system))
        yield Row(f"{scene}, rhs", saving, *seconds, difference(*values))


def prepared() -> Iterator[Row]:
    """Prepared parameters kept from one call to the next."""
    system = tied_masses(200)
    p, other = system.parameter_values(), system.parameter_values({"m": 0.6})
    first = system.prepared(p)

    def kept() -> None:
        for _ in range(2 * CALLS):
            system.prepared(p)

    def anew() -> None:
        for _ in range(CALLS):
            system.prepared(other)
            system.prepared(p)

    seconds = [total / (2 * CALLS) for total in by_turns(kept, anew)]
    yield Row("tied masses, 200", "prepared p kept", *seconds, difference(first, system.prepared(p)))


def no_power() -> Iterator[Row]:
    """No integral of the power where all forces have a potential."""
    for name, rates in (("double_pendulum", ("theta1", "theta2")), ("pendulum", ("theta",))):
        lossy = load_model(find(name), {})
        lossy.parameter("no_loss", 0.0)
        lossy.dissipation(" + ".join(f"no_loss/2*dot({rate})**2" for rate in rates))
        (values, more), seconds = calls(bundled(name), system_of(lossy))
        yield Row(
            f"{name}, rhs", "no power worked out", *seconds, difference(values, more[:, : values.shape[1]])
        )


def derived_otherwise() -> Iterator[Row]:
    """Parameters collected in products; trees solved body by body."""
    scenes = {
        "gathered": ("parameters gathered in products", ("spinning_top", "slider_crank", "andrews_squeezer")),
        "articulated": ("M⁻¹f body by body", ("humanoid_tree",)),
    }
    for switch, (saving, names) in scenes.items():
        for name in names:
            description, source = load_model(find(name), {}).describe(), "sha256:" + 64 * "0"
            programs = (
                pipeline.derive(description, source),
                pipeline.derive(description, source, **{switch: False}),
            )
            values, seconds = calls(*(load(emit(program)) for program in programs))
            yield Row(f"{name}, rhs", saving, *seconds, difference(*values))


def equal_subsystems() -> Iterator[Row]:
    """Equal subsystems derived once, their functions written as loops."""
    description = load_model(find("pendulum_field"), {"n": "100"}).describe()
    ways = subsystems.derive, pipeline.derive
    texts = [lambda way=way: emit(way(description, "sha256:" + 64 * "0")) for way in ways]
    systems = [load(text()) for text in texts]
    values, seconds = calls(*systems)
    same = difference(*values)
    yield Row("pendulum_field, 100", "equal subsystems derived once", *by_turns(*texts, repeats=3), same)
    compiled = by_turns(*(lambda s=s: compile_anew(s, ["rhs", "energy"]) for s in systems), repeats=3)
    yield Row("pendulum_field, 100", "equal subsystems compiled once", *compiled, same)
    yield Row("pendulum_field, 100, rhs", "equal subsystems as loops", *seconds, same)


def own_steps() -> Iterator[Row]:
    """Independent subsystems integrated by themselves."""
    system = bundled("pendulum_field", n="1000", stiff="true")
    options = {"t_end": 0.05}
    solutions, seconds = runs((system, options), (system, {**options, "split": False}), repeats=3)
    yield Row(
        "pendulum_field, 1000, one stiff",
        "subsystems with steps of their own",
        *seconds,
        compared(*solutions),
    )


def compile_anew(system: System, names: list[str]) -> list[bytes]:
    """The object code of functions, compiled without a cache."""
    return [engine.compile_ir(system.kernel(name).source.lower_apart(f"symgen_{name}")[0]) for name in names]


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


def frames() -> Iterator[Row]:
    """Frames read off the dense output, not landed on."""
    system, times = bundled("double_pendulum"), list(np.linspace(0.0, 10.0, 2001))
    for method in ("dop853", "taylor"):
        options = {"method": method, "rtol": 1e-10, "atol": 1e-12, "t_end": 10.0}
        read_off, landed_on = {"fps": 200.0, **options}, {"at": times, "fps": 1.0, **options}
        (fast, slow), seconds = runs((system, read_off), (system, landed_on), repeats=3)
        landed = np.array([[*sample.q, *sample.v] for sample in slow.samples])
        same = difference(np.hstack([fast.q, fast.v]), landed)
        yield Row(f"double_pendulum, {method}", "2000 frames interpolated", *seconds, same)


def observed() -> Iterator[Row]:
    """Multipliers, outputs and energies where somebody looks, not at each step."""
    system, options = bundled("slider_crank"), {"method": "dop853", "t_end": 10.0}
    solution = solve(system, **options)
    many = np.resize(solution.states, (solution.stats["steps"], solution.states.shape[1]))
    times = np.resize(solution.t, len(many))

    def look() -> Solution:
        looked = solve(system, **options)
        accelerations_and_multipliers(system, looked.p, times, many)
        for function in ("outputs", "energy", "constraint_residual"):
            evaluate(system, function, looked.p, times, many)
        return looked

    seconds = by_turns(lambda: solve(system, **options), look)
    yield Row(
        "slider_crank", "multipliers, outputs, energies not in steps", *seconds, compared(solution, look())
    )


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


def in_words(seconds: float) -> str:
    """A time with a unit that suits it."""
    factor, unit = next(
        (f, u) for f, u in ((1.0, "s"), (1e3, "ms"), (1e6, "µs"), (1e9, "ns")) if seconds * f >= 1.0
    )
    return f"{seconds * factor:.3g} {unit}"


CASES = (
    hoisting, prepared, no_power, derived_otherwise, equal_subsystems, own_steps, kernels, derivation, frames, observed,
    process_start,
)  # fmt: skip


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", help="write the figures to a file")
    parser.add_argument("--only", default="", help="cases whose names contain this word")
    given = parser.parse_args()
    print("| scene | saving | with | without | factor | results |\n|---|---|---:|---:|---:|---|")
    rows = []
    for case in CASES:
        if given.only in case.__name__:
            for row in case():
                rows.append(row)
                print(
                    f"| {row.scene} | {row.saving} | {in_words(row.with_it)} | {in_words(row.without)} "
                    f"| {row.factor:.3g} | {row.results} |",
                    flush=True,
                )
    if given.json:
        with open(given.json, "w", encoding="utf-8") as file:
            json.dump([asdict(row) | {"factor": row.factor} for row in rows], file, indent=1)


if __name__ == "__main__":
    main()
