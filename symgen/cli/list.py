"""`symgen list`: the bundled models, one line each."""

from __future__ import annotations

import click

from symgen.cli.terminal import say
from symgen.model.library import list_models


@click.command("list")
def command() -> None:
    """List the bundled models, one line each."""
    models = list(list_models())
    width = max((len(name) for name, _, _ in models), default=0)
    for name, description, _ in models:
        say(f"{name:<{width}}  {description}".rstrip())
