"""What a user sees when something goes wrong: one paragraph and an exit status, never a traceback."""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.files import subject_of
from symgen.cli.interrupts import answered_interrupts, interrupted_status
from symgen.cli.terminal import accept_all_letters, complain, message
from symgen.errors import SymgenError
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

errors = Late("symgen.runtime.errors")

FAILED = 1
NOT_TRUSTED = 3
_TRACEBACK = "SYMGEN_TRACEBACK"
_BEGINS_WITH_FILE = re.compile(r"[^:,;]*\.[A-Za-z]\w{1,5}[:,]")


class FailuresAsSentences(click.Group):
    """A group whose commands' errors become a sentence on standard error and an exit status."""

    def invoke(self, context: click.Context) -> Any:
        with _short_warnings(), answered_interrupts():
            try:
                accept_all_letters()
                return super().invoke(context)
            except click.ClickException as error:
                error.message = message(error.message)
                raise
            except (click.exceptions.Exit, click.Abort, BrokenPipeError):
                raise
            except KeyboardInterrupt:
                complain("\ninterrupted")
                context.exit(interrupted_status())
            except Exception as error:
                if os.environ.get(_TRACEBACK):
                    raise
                complain(f"Error: {_sentence(error)}")
                context.exit(FAILED)


def _sentence(error: Exception) -> str:
    subject = getattr(error, "symgen_subject", "")
    if isinstance(error, SymgenError | errors.RuntimeModelError):
        return _about(subject, str(error))
    if isinstance(error, MemoryError):
        return f"{subject or 'symgen'}: there is not enough memory for it ({error or 'no more is given'})"
    if isinstance(error, RecursionError):
        return f"{subject or 'symgen'}: it is nested too deeply"
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror or error}"
    if isinstance(error, OSError):
        return f"{subject}: {error.strerror or error}" if subject else error.strerror or str(error)
    return (
        f"internal error: {type(error).__name__}: {error}; please report it, "
        f"with what `{_TRACEBACK}=1 {_command_line()}` prints"
    )


def _about(subject: str, text: str) -> str:
    """The text behind the name of the file that it is about, unless it begins with that of another, or has it."""
    named = not subject or Path(subject).name in text or _BEGINS_WITH_FILE.match(text)
    return text if named else f"{subject}: {text}"


def _command_line() -> str:
    import shlex

    return " ".join(["symgen", *map(shlex.quote, sys.argv[1:])])


@contextmanager
def _short_warnings() -> Iterator[None]:
    """Show warnings as one line each, without file, line and code."""

    def show(text, category, filename, lineno, file=None, line=None) -> None:
        # What NumPy says of single operations is no news for the user: results that are not finite are told as such.
        if not issubclass(category, RuntimeWarning):
            complain(f"Warning: {text}")

    before = warnings.showwarning
    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = before


def exit_status(solution: Solution) -> int:
    """Say on standard error what is wrong, and return the exit status."""
    if solution.status == "interrupted":
        complain(solution.message)
        return interrupted_status()
    if solution.status not in ("success", "terminated"):
        context = click.get_current_context(silent=True)
        complain(f"Error: {_about(subject_of(context) if context else '', solution.message)}")
        return FAILED
    for entry in solution.objections:
        complain(f"Not to be trusted: {entry.check}: {entry.says}")
    if solution.objections:
        for entry in solution.advice:
            complain(f"It may be because of: {entry.check}: {entry.says}")
    return NOT_TRUSTED if solution.objections else 0
