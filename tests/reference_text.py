"""docs/api.md and docs/cli.md, made from docstrings and from the commands themselves."""

from __future__ import annotations

import importlib
import inspect
import signal
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType

import click

import symgen
from symgen import equations, front, link, runtime
from symgen.cli import failures, main
from symgen.runtime import ensemble, inputs, linear
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.result import EnsembleHealth
from symgen.runtime.ensemble.verdict import Verdicts
from symgen.runtime.linear.modes import Mode, Modes
from symgen.runtime.prepared.prepared import PreparedRun
from symgen.runtime.prepared.runs import Runs
from symgen.runtime.robot import Robot
from symgen.runtime.stepper import Stepper

DOCS = Path(__file__).resolve().parent.parent / "docs"
EXIT_STATUSES = {
    0: "success",
    failures.FAILED: "the model or the run failed: standard error says why; `compare`: the recordings differ",
    2: "wrong usage; `compare`: a recording cannot be read",
    failures.NOT_TRUSTED: "finished, but a health check objects: not to be trusted; `advise`: not suited",
    128 + signal.SIGINT: "interrupted by Ctrl-C; what was recorded stays readable",
    128 + signal.SIGTERM: "the same by SIGTERM",
}
# What users hold, in the order of the page; `symgen` also hands on functions of SymPy for expressions.
CLASSES = (
    front.Model, equations.Equations, runtime.System, runtime.RunOptions, runtime.Solution, PreparedRun, Runs, Stepper,
    Robot, runtime.Kernel, inputs.Controller, inputs.Table, inputs.Polynomial, inputs.Trajectory, linear.LinearModel,
    Modes, Mode, linear.FrequencyResponse, linear.Equilibrium, ensemble.Ensemble, EnsembleOptions, EnsembleHealth,
    Verdicts,
)  # fmt: skip
FUNCTIONS = (
    link.load, link.robot, equations.equations_of, runtime.load, runtime.load_robot, runtime.solve,
    runtime.read_module, linear.linearise, inputs.computed_torque, inputs.gravity_compensation, inputs.impedance,
    inputs.regulator,
    linear.find_equilibrium, ensemble.normal, ensemble.uniform, ensemble.lognormal, ensemble.triangular,
    ensemble.choice, ensemble.linspace, ensemble.grid, ensemble.quantiles, ensemble.histogram,
)  # fmt: skip
ERRORS = (runtime.RuntimeModelError, runtime.ModuleError)


def api_page() -> str:
    """Return docs/api.md."""
    handed_on = [name for name in symgen.__all__ if name not in ("Model", "load", "robot")]
    parts = [
        "# Python\n",
        "Made from the docstrings by `pytest tests/test_reference_text.py --update-golden`.\n",
        "`from symgen import Model, load` for models, `symgen.runtime` for what was derived, "
        "`symgen.runtime.inputs` and `symgen.runtime.linear` for inputs over time and linear analysis. "
        "For expressions `symgen` has " + ", ".join(f"`{name}`" for name in handed_on) + ".\n",
        *(part for kind in CLASSES for part in _class(kind)),
        "## Functions\n",
        *(_entry(f"{_home(f)}.{f.__name__}", f) for f in FUNCTIONS),
        "## Errors\n",
        *(_entry(f"{_home(e)}.{e.__name__}", e, with_signature=False) for e in ERRORS),
    ]
    return "\n".join(parts)


def _home(thing) -> str:
    """Where users import a thing from."""
    for name in ("symgen.runtime", "symgen.runtime.inputs", "symgen.runtime.linear", "symgen"):
        if getattr(importlib.import_module(name), thing.__name__, None) is thing:
            return name
    return thing.__module__


def _class(kind: type) -> Iterator[str]:
    yield f"## {kind.__name__}\n"
    yield _entry(f"{_home(kind)}.{kind.__name__}", kind)
    for name in public_members(kind):
        member = inspect.getattr_static(kind, name)
        yield _entry(f"{kind.__name__}.{name}", member, in_class=True)


def public_members(kind: type) -> list[str]:
    """Return the names of a class's own public methods and properties, those of its parents of ours included."""
    found = {}
    for base in reversed(kind.__mro__):
        if base.__module__.startswith("symgen"):
            found |= {
                name: None
                for name, member in vars(base).items()
                if (not name.startswith("_") or name in ("__call__", "__getitem__")) and _documented(member)
            }
    return list(found)


def _documented(member) -> bool:
    return (
        isinstance(member, FunctionType | property | classmethod)
        or type(member).__name__ == "cached_property"
    )


def _entry(title: str, member, with_signature: bool = True, in_class: bool = False) -> str:
    function = getattr(member, "__func__", member)
    called = isinstance(function, FunctionType | type) and with_signature
    text = _signature(function, in_class) if called else ""
    document = inspect.cleandoc(inspect.getdoc(function) or "").strip()
    assert document, f"{title} has no docstring"
    return f"### `{title}`\n\n```text\n{title}{text}\n\n{document}\n```\n"


def _signature(function, in_class: bool) -> str:
    shown = [str(x) for x in inspect.signature(function).parameters.values()]
    shown = shown[1:] if in_class else shown  # without the object or class that it is called of
    if len(", ".join(shown)) < 80:
        return f"({', '.join(shown)})"
    return "(\n" + "".join(f"    {x},\n" for x in shown) + ")"


def cli_page() -> str:
    """Return docs/cli.md."""
    context = click.Context(main, info_name="symgen")
    parts = [
        "# Commands\n",
        "Made from the commands by `pytest tests/test_reference_text.py --update-golden`; `symgen COMMAND --help` "
        "says the same. MODEL is a `.toml` or `.py` file, the name of a `.toml` file beside you without its suffix, "
        "or the name of a bundled model.\n",
        "## Exit statuses\n",
        "| status | meaning |\n|---|---|",
        *(f"| {status} | {meaning} |" for status, meaning in EXIT_STATUSES.items()),
        "",
        _COMPLETION,
    ]
    for name in main.list_commands(context):
        command = main.get_command(context, name)
        parts += [f"## symgen {name}\n", *_command(command, click.Context(command, context, name))]
    return "\n".join(parts) + "\n"


_COMPLETION = """## Completion

The shell completes commands and options once it has been told to, in its start-up file:

```sh
eval "$(_SYMGEN_COMPLETE=bash_source symgen)"       # bash: ~/.bashrc
eval "$(_SYMGEN_COMPLETE=zsh_source symgen)"        # zsh: ~/.zshrc
_SYMGEN_COMPLETE=fish_source symgen | source        # fish: ~/.config/fish/completions/symgen.fish
```

MODEL completes names of bundled models and model files, `--method` the methods.
"""


def _command(command: click.Command, context: click.Context) -> Iterator[str]:
    usage = " ".join(command.collect_usage_pieces(context))
    yield f"```sh\nsymgen {command.name} {usage}\n```\n"
    yield inspect.cleandoc(command.help or "") + "\n"
    records = [x.get_help_record(context) for x in command.params if isinstance(x, click.Option)]
    records = [record for record in records if record is not None]
    if records:
        yield "| option | what it does |\n|---|---|"
        for option, text in records:
            cells = (" ".join(part.split()).replace("|", "\\|") for part in (option, text))
            yield "| `{}` | {} |".format(*cells)
        yield ""
