"""`symgen derive`: write a model's equations of motion as a Python module, and say what was found."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from symgen.cli.arguments import OutputFile, as_dict, find_model, model_argument

if TYPE_CHECKING:
    from symgen.link import DerivedModel


@click.command("derive")
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
    type=OutputFile(),
    help="Write the figures to a file.",
)
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
def command(
    model: str, options: tuple[tuple[str, str], ...], output: Path, json_file: Path | None, quiet: bool
) -> None:
    """Derive MODEL and write DIR/<name>.py."""
    from symgen.link import derive_file

    derived = derive_file(find_model(model), as_dict(options, "--option"))
    output.mkdir(parents=True, exist_ok=True)
    path = output / f"{derived.name}.py"
    path.write_text(derived.text, encoding="utf-8", newline="\n")
    if json_file is not None:
        figures = {
            "operations": derived.operations,
            "once": derived.once,
            "code": derived.code,
            "seconds": derived.seconds,
            "structure": derived.structure,
        }
        json_file.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    if not quiet:
        for line in _report(derived, path):
            click.echo(line)


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
