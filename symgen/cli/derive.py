"""`symgen derive`: write a model's equations of motion as a Python module, and say what was found."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from symgen.cli.arguments import as_dict, find_model, model_argument
from symgen.cli.files import CarefulCommand, OutputFile, claim, write_text
from symgen.cli.terminal import say
from symgen.link import derive_file, robot_file_text
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.link import DerivedModel

requests = Late("symgen.derive.robot_request")

_READ = 1 << 20  # bytes in which a module's header begins


@click.command("derive", cls=CarefulCommand)
@model_argument
@click.option(
    "-o",
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("generated"),
    show_default=True,
    help="The folder to write to.",
)
@click.option(
    "--json",
    "json_file",
    type=OutputFile(".json"),
    help="Write the figures to a file.",
)
@click.option(
    "--jacobian",
    is_flag=True,
    help="Functions for the derivatives of rhs by the state and by parameters, too.",
)
@click.option(
    "--functions",
    metavar="NAMES",
    default="",
    help="Functions for robot programs, too, in DIR/<name>_robot.py: names with commas between; 'robot' are the usual "
    "ones (docs/robots.md).",
)
@click.option(
    "--frame",
    "frames",
    multiple=True,
    metavar="NAME",
    help="A body or frame whose pose and Jacobian are among them (may be repeated).",
)
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
def command(
    model: str,
    options: tuple[tuple[str, str], ...],
    output: Path,
    json_file: Path | None,
    jacobian: bool,
    functions: str,
    frames: tuple[str, ...],
    quiet: bool,
) -> None:
    """Derive MODEL and write DIR/<name>.py."""
    file, given = find_model(model), as_dict(options, "--option")
    derived = derive_file(file, given, jacobian)
    output.mkdir(parents=True, exist_ok=True)
    path = claim("the module", output / f"{derived.name}.py")
    _refuse_other_python(path)
    write_text(path, derived.text)
    if functions or frames:
        request = requests.requested([name.strip() for name in functions.split(",") if name.strip()], frames)
        of_robot = claim("the functions for robots", output / f"{derived.name}_robot.py")
        _refuse_other_python(of_robot)
        write_text(of_robot, robot_file_text(file, given, request))
    if json_file is not None:
        figures = {
            "operations": derived.operations,
            "once": derived.once,
            "code": derived.code,
            "seconds": derived.seconds,
            "structure": derived.structure,
        }
        write_text(json_file, json.dumps(figures, indent=1) + "\n")
    if not quiet:
        for line in _report(derived, path):
            say(line)
        if functions or frames:
            say(f"wrote {of_robot} ({', '.join((*request.functions, *request.frames))})")


def _refuse_other_python(path: Path) -> None:
    """A module may take the place of a module, not of a file that somebody wrote."""
    if not path.is_file():
        return
    with path.open("rb") as file:
        begin = file.read(_READ)
    if begin.strip() and b"\nMODEL = {" not in begin:
        raise click.UsageError(
            f"{path} is there and is no generated module: give another folder with -o, or another name to the model"
        )


def _report(derived: DerivedModel, path: Path) -> list[str]:
    structure = derived.structure
    constraints = f", {structure['nh']} holonomic" if structure["nh"] else ""
    constraints += f", {structure['nn']} velocity" if structure["nn"] else ""
    sizes = (
        f"{structure['nq']} coordinates{constraints}{' constraints' if constraints else ', no constraints'}"
    )
    found = [name.replace("_", " ") for name, value in structure.items() if value is True]
    lines = [f"{derived.name}: {sizes}", f"  structure: {', '.join(found) or 'nothing to make use of'}"]
    lines += [f"  {finding}" for finding in derived.findings]
    lines += _operations(derived)
    seconds = ", ".join(f"{stage} {value:.3f} s" for stage, value in derived.seconds.items())
    return [*lines, f"  time: {seconds}", f"wrote {path} ({len(derived.text.encode()) / 1000:.1f} kB)"]


def _operations(derived: DerivedModel) -> list[str]:
    """A table: what a call of each function does, what of it once per set of parameters, what stands in the text."""
    operations = derived.operations
    with_loops = any(derived.code[name] < count for name, count in operations.items())
    width = max(map(len, operations), default=0)
    lines = [f"  operations:{'':{width - 8}}   in all     once" + ("  in code" if with_loops else "")]
    for name, count in operations.items():
        code = f" {derived.code[name]:>8}" if with_loops else ""
        lines.append(f"    {name:<{width}} {count:>8} {derived.once[name] or '-':>8}{code}")
    return lines
