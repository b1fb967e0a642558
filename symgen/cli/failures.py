"""What a user sees when something goes wrong: one paragraph and an exit status, never a traceback."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.interrupts import answered_interrupts, interrupted_status

if TYPE_CHECKING:
    from runtime.solution import Solution

FAILED = 1
NOT_TRUSTED = 3
_TRACEBACK = "SYMGEN_TRACEBACK"


class FailuresAsSentences(click.Group):
    """A group whose commands' errors become a sentence on standard error and an exit status."""

    def invoke(self, context: click.Context) -> Any:
        with _short_warnings(), answered_interrupts():
            try:
                return super().invoke(context)
            except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
                raise
            except KeyboardInterrupt:
                click.echo("\ninterrupted", err=True)
                context.exit(interrupted_status())
            except Exception as error:
                if os.environ.get(_TRACEBACK):
                    raise
                click.echo(f"Error: {_sentence(error)}", err=True)
                context.exit(FAILED)


def _sentence(error: Exception) -> str:
    from runtime.errors import RuntimeModelError
    from symgen.errors import SymgenError

    if isinstance(error, SymgenError | RuntimeModelError):
        return str(error)
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror or error}"
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return (
        f"internal error: {type(error).__name__}: {error}; please report it, "
        f"with what `{_TRACEBACK}=1 {_command_line()}` prints"
    )


def _command_line() -> str:
    import shlex

    return " ".join(["symgen", *map(shlex.quote, sys.argv[1:])])


@contextmanager
def _short_warnings() -> Iterator[None]:
    """Show warnings as one line each, without file, line and code."""

    def show(message, category, filename, lineno, file=None, line=None) -> None:
        click.echo(f"Warning: {message}", err=True)

    before = warnings.showwarning
    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = before


def exit_status(solution: Solution) -> int:
    """Say on standard error what is wrong, and return the exit status."""
    if solution.status == "interrupted":
        click.echo(solution.message, err=True)
        return interrupted_status()
    if solution.status not in ("success", "terminated"):
        click.echo(f"Error: {solution.message}", err=True)
        return FAILED
    for entry in solution.objections:
        click.echo(f"Not to be trusted: {entry.check}: {entry.says}", err=True)
    if solution.objections:
        for entry in solution.advice:
            click.echo(f"It may be because of: {entry.check}: {entry.says}", err=True)
    return NOT_TRUSTED if solution.objections else 0
