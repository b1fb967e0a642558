"""`symgen list`: the bundled models, one line each."""

from __future__ import annotations

import json
from pathlib import Path

import click

from symgen.cli.files import CarefulCommand, OutputFile, write_text
from symgen.cli.terminal import say
from symgen.model.library import list_models


@click.command("list", cls=CarefulCommand)
@click.option(
    "--json",
    "json_file",
    type=OutputFile(".json"),
    help="Write names, descriptions and files; - is standard output.",
)
def command(json_file: Path | None) -> None:
    """List the bundled models, one line each: what each is, and what it is good for."""
    models = [*list_models()]
    if json_file is not None:
        rows = [{"name": name, "description": text, "file": str(path)} for name, text, path in models]
        write_text(json_file, json.dumps(rows, indent=1, ensure_ascii=False) + "\n")
        return
    width = max((len(name) for name, _, _ in models), default=0)
    for name, description, _ in models:
        say(f"{name:<{width}}  {description}".rstrip())
