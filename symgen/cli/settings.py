"""Options of a run: what the command line gives, what the model's [run] table says, and the defaults.

`--input`: what inputs do over time, from tables in files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.arguments import Duration, Positive, Times, value_options
from symgen.cli.quantities import parameter_values, start_values
from symgen.cli.terminal import complain
from symgen.link import load_module, module_for
from symgen.runtime.code.engine import set_compile_listener
from symgen.runtime.errors import nearest
from symgen.runtime.integrate.methods import METHODS, OTHER_NAMES, find_method
from symgen.runtime.lazy import Late
from symgen.runtime.options import RunOptions

if TYPE_CHECKING:
    from symgen.link import ModuleText
    from symgen.model.table_file import TableFile
    from symgen.model.units import Unit
    from symgen.runtime.inputs.given import Table
    from symgen.runtime.system import System

table_file = Late("symgen.model.table_file")
model_units = Late("symgen.model.units")
inputs_given = Late("symgen.runtime.inputs.given")

KINDS = ("linear", "cubic", "hold")


def input_tables(
    system: System, texts: Iterable[str], kind: str, constant: Iterable[str]
) -> dict[str, Table]:
    """Return the tables of `--input`, by the names of inputs.

    Parameters
    ----------
    system : System
    texts : iterable of str
        `NAME=FILE`, a file of two columns or with a column of that name; or `FILE`, whose columns name inputs.
    kind : str
        Of all tables.
    constant : iterable of str
        Names that `--set` gives.
    """
    sizes = {record["name"]: record.get("unit") for record in system.inputs}
    names = list(sizes)
    found: dict[str, Table] = {}
    for text in texts:
        name, equals, file = text.partition("=")
        tables = _columns(*((Path(file), name.strip()) if equals else (Path(text), "")), kind, sizes)
        for column, table in tables.items():
            if column not in names:
                raise click.UsageError(
                    f"--input: model {system.name!r} has no input {column!r}: {nearest(column, names)}"
                )
            if column in found or column in constant:
                raise click.UsageError(f"--input gives {column!r}, which is given already")
            found[column] = table
    return found


def _columns(path: Path, name: str, kind: str, sizes: dict[str, str | None]) -> dict[str, Table]:
    """The tables of a file, by input; `sizes` has the unit of each input of the model."""
    content = table_file.read_table_file(path)
    if content.names and content.names[0] in sizes:
        raise click.UsageError(
            f"--input: the first column of {path} is {content.names[0]!r}, an input; times come first"
        )
    if name:
        wanted = {name: _column(path, name, content, sizes)}
    elif content.names:
        wanted = {column: k for k, column in enumerate(content.names[1:])}
    else:
        raise click.UsageError(
            f"--input {path}: its first line names no inputs; give NAME={path}, or name the columns"
        )
    return {
        column: inputs_given.Table(content.times, content.in_si(k, _unit(sizes.get(column))), kind)
        for column, k in wanted.items()
    }


def _unit(text: str | None) -> Unit | None:
    return model_units.parse_unit(text) if text else None


def _column(path: Path, name: str, content: TableFile, sizes: dict[str, str | None]) -> int:
    """The number of the further column that is meant for an input."""
    names = content.names[1:]
    if len(content.columns) == 1:
        if names and names[0] != name and names[0] in sizes and name in sizes:
            raise click.UsageError(
                f"--input: the column of {path} is {names[0]!r}, another input than {name!r}; rename the column, or "
                f"give --input {names[0]}={path}"
            )
        return 0
    if name not in names:
        raise click.UsageError(
            f"--input: {path} has {len(content.columns)} columns of values, none of them {name!r}"
        )
    return names.index(name)


_TREATMENTS = ("projection", "baumgarte", "ggl", "index3", "partition", "none", "auto")


def _methods(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    """Complete the name of a method."""
    return [name for name in ("auto", *METHODS, *OTHER_NAMES) if name.startswith(begun)]


def run_options(command: Callable) -> Callable:
    """Give a command the options that say how to integrate: time, method, tolerances, values."""
    options = (
        click.option("--t-end", type=Duration(), help="Time at which the run ends [s]."),
        click.option("--method", help="Integration method, or auto (default).", shell_complete=_methods),
        click.option(
            "--constraints",
            type=click.Choice(_TREATMENTS),
            help="How constraints are treated, as far as the method has it (default auto: projection).",
        ),
        click.option("--rtol", type=Positive(), help="Relative tolerance (default 1e-8)."),
        click.option("--atol", type=Positive(or_zero=True), help="Absolute tolerance (default 1e-10)."),
        click.option("--step", type=Duration(), help="Step of a fixed-step method [s]."),
        click.option("--max-step", type=Duration(), help="Longest step of an adaptive method [s]."),
        click.option("--breaks", type=Times(), help="Times that steps land on [s]."),
        click.option(
            "--input",
            "input_values",
            multiple=True,
            metavar="[NAME=]FILE",
            help="An input over time [SI]: a file with columns of times and values; may be repeated.",
        ),
        click.option(
            "--input-kind",
            "input_kind_values",
            type=click.Choice(KINDS),
            default="linear",
            help="Between the times of --input: straight lines (default), a cubic spline, or the value before.",
        ),
    )
    command = value_options(command)
    for option in reversed(options):
        command = option(command)
    return command


def load_system(
    path: Path, build_options: dict[str, str], quiet: bool = False, on_demand: bool = False
) -> tuple[System, ModuleText]:
    """Return the system of a model file, derived now or found in the cache.

    With `on_demand`, what few runs call may be left out of a large model until one does; a recording wants all.
    """
    if not quiet:
        set_compile_listener(_announce_compilation)
    notify = None if quiet else _announce
    module = module_for(path, build_options, notify, on_demand)
    return load_module(module.text, path, build_options, notify), module


def _announce(text: str) -> None:
    complain(text)


def _announce_compilation(name: str, operations: int, seconds: float) -> None:
    size = f"{operations} operations, " if operations else ""
    complain(f"compiling {name}: {size}about {seconds:.0f} s …")


def options_of(system: System, given: dict[str, Any]) -> RunOptions:
    """Return the options of a run.

    Parameters
    ----------
    system : System
    given : dict
        t_end, method, constraints, rtol, atol, step, max_step, breaks, and if there are such: fps, at; None where the
        user said nothing. set_values, start_values, rate_values: pairs of texts; input_values, input_kind_values: of
        `--input`.
    """
    said = {key: value for key, value in given.items() if value is not None and not key.endswith("_values")}
    defaults = {key: value for key, value in system.run_defaults.items() if key in given}
    settings = {"method": RunOptions.method, **defaults, **said}
    _check_method(settings["method"])
    if "step" in said and not _takes_steps(settings["method"]):
        raise click.UsageError(
            f"--step: method {settings['method']} chooses its own steps; leave --step out and set --rtol, "
            "or name a fixed-step method such as rk4"
        )
    if "max_step" in said and _takes_steps(settings["method"]):
        raise click.UsageError(
            f"--max-step: the steps of method {settings['method']} are all alike; set --step, or leave --max-step out"
        )
    if _takes_steps(settings["method"]):
        settings.pop("max_step", None)  # of the model: it is for methods that choose their steps
    else:
        # The model's own step is for the method that its [run] table names.
        settings.pop("step", None)
    if settings.get("t_end") is None:
        raise click.UsageError(f"model {system.name!r} does not say how long to run: give --t-end")
    _check_times(settings)
    settings["parameters"] = parameter_values(system, given["set_values"])
    if given["input_values"]:
        given_inputs = given["input_values"], given["input_kind_values"]
        settings["inputs"] = input_tables(system, *given_inputs, settings["parameters"])
    settings["start"] = start_values(system, "--start", given["start_values"])
    settings["rate"] = start_values(system, "--rate", given["rate_values"])
    return RunOptions(**settings)


def _check_method(name: str) -> None:
    names = ["auto", *METHODS, *OTHER_NAMES]
    if name not in names:
        raise click.UsageError(
            f"--method: there is no method {name!r}: {nearest(name, names)}; all: {', '.join(names)}"
        )


def _takes_steps(name: str) -> bool:
    return name != "auto" and not find_method(name).adaptive


def _check_times(settings: dict[str, Any]) -> None:
    outside = [t for t in settings.get("at") or () if not 0.0 <= t <= settings["t_end"]]
    if outside:
        raise click.UsageError(
            f"--at: {outside[0]:g} s is outside the run, which is from 0 to {settings['t_end']:g} s"
        )
