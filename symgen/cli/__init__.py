"""The command line: one group, whose commands are imported when they are called."""

from __future__ import annotations

import atexit
import functools
import gc
import importlib
import os
from keyword import iskeyword

import click

from symgen.cli.failures import FailuresAsSentences
from symgen.version import __version__

_COLLECT_EVERY = (
    20_000  # new objects; what modules make while they load is kept, so looking through it is in vain
)
_COMMANDS = {
    "list": "the bundled models, one line each",
    "new": "a commented model that runs, to begin with",
    "show": "a model and its equations",
    "import": "a robot's file (URDF) as a model file",
    "derive": "write a model's equations of motion as a Python module",
    "run": "integrate a model, check the result, record it",
    "sweep": "a model many times, with values that vary",
    "gpu-report": "what a model's programs need of a graphics processor, without one",
    "advise": "which step and method suit a model, and why",
    "modes": "equilibrium, eigenfrequencies, mode shapes and frequency response of a model",
    "bench": "run time against error of every method, on scenes with known end states",
    "check": "how far a result can be trusted: convergence, energy, constraints",
    "report": "a model, its equations and a checked run as one HTML file",
    "play": "show a recording in the Rerun viewer",
    "export": "a recording as a table, CSV or Parquet",
    "verify": "re-read a recording and check it again",
    "compare": "where and by how much two recordings differ",
}


class LazyCommands(FailuresAsSentences, click.Group):
    """A group that imports a command's module when the command is asked for.

    `symgen run` must not pay for what other commands need.
    """

    def list_commands(self, context: click.Context) -> list[str]:
        return [*_COMMANDS]  # `list` is a module of this package, once that command was asked for

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        if name not in _COMMANDS:
            return None
        _prepare()
        return importlib.import_module(f"symgen.cli.{name.replace('-', '_')}{'_' * iskeyword(name)}").command

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([*_COMMANDS.items()])


@functools.cache
def _prepare() -> None:
    """Set what must be set before a command's modules are loaded; click asks for the command before it calls `main`."""
    # NumPy's BLAS would start a thread for each processor, which takes longer than the products of small matrices.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # What Rerun has to say comes out as an error, or not at all.
    os.environ.setdefault("RUST_LOG", "off")
    gc.set_threshold(_COLLECT_EVERY)
    # The process ends without looking once more through all that modules made.
    atexit.register(gc.freeze)


@click.group(cls=LazyCommands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="symgen")
def main() -> None:
    """Multibody models become equations of motion, compiled code, checked runs and recordings.

    MODEL is a .toml or .py description, or the name of a bundled model (see `symgen list`).
    """
