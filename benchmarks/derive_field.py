"""What a field of equal pendulums costs to read, check, derive, write, load and compile, beside one pendulum.

    python benchmarks/derive_field.py [pendulums]

Processor time, the least of several. The process is `symgen derive`, SymPy's import taken off; stages are those of one
process in which SymPy has been used before. Compiled are the kernels that a run by subsystems calls.
"""

from __future__ import annotations

import argparse
import gc
import itertools
import resource
import subprocess
import sys
import tempfile
import time

from symgen.derive.scenes.subsystems import derive
from symgen.emit.module import emit
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.runtime import System, load
from symgen.runtime.code import compiler
from symgen.runtime.subsystems.decomposition import divide

REPEATS = 5
KERNELS = ("rhs", "energy", "mass_matrix", "residual", "residual_jacobian", "forces")
_COMMAND = "from symgen.cli import main; main()"
STAGES = ("read", "check", "derive", "write", "load", "compile")


def process(arguments: list[str]) -> float:
    """Processor time of a Python process [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def stages(model: str, options: dict[str, str]) -> list[float]:
    """Processor time of each stage [s]."""
    marks = [time.process_time()]

    def mark(result):
        marks.append(time.process_time())
        return result

    built = mark(load_model(find(model), options))
    description = mark(built.describe())
    program = mark(derive(description, "sha256:" + 64 * "0"))
    text = mark(emit(program))
    system = mark(load(text))
    compile_for_run(system)
    mark(None)
    return [after - before for before, after in itertools.pairwise(marks)]


def compile_for_run(system: System) -> None:
    """Compile what a run calls, past the cache: of one subsystem, and what looks at the whole."""
    kinds, _ = divide(system)
    own = [(kind.system, KERNELS) for kind in kinds] or [(system, KERNELS)]
    for owner, names in [*own, (system, ("energy",))] if kinds else own:
        for name in names:
            compiler.compile_ir(owner.kernel(name).source.lower_standalone(f"symgen_{name}")[0])


def main(n: int) -> None:
    """Print both tables."""
    gc.set_threshold(200_000)  # as the command line does
    scenes = {"pendulum": {}, "pendulum_field": {"n": str(n)}}
    with tempfile.TemporaryDirectory() as folder:
        commands = {
            model: ["-c", _COMMAND, "derive", model, "-o", folder, "--quiet"]
            + [word for key, value in options.items() for word in ("--option", f"{key}={value}")]
            for model, options in scenes.items()
        }
        commands["import sympy"] = ["-c", "import sympy"]
        least = {key: min(process(command) for _ in range(REPEATS)) for key, command in commands.items()}
    sympy = least.pop("import sympy")
    print(f"| model | symgen derive, SymPy's import of {sympy:.2f} s taken off | {' | '.join(STAGES)} |")
    print("|---|" + "---:|" * (1 + len(STAGES)))
    for model, options in scenes.items():
        found = [stages(model, options) for _ in range(REPEATS)]
        times = [min(column) for column in zip(*found, strict=True)]
        print(f"| {model} | {least[model] - sympy:.3f} | " + " | ".join(f"{x:.4f}" for x in times) + " |")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pendulums", nargs="?", type=int, default=1000)
    main(parser.parse_args().pendulums)
