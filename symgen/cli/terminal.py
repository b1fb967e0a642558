"""The one way to the terminal: what names, descriptions and arguments say is shown as plain text."""

from __future__ import annotations

import contextlib
import os
import sys

import click

from symgen.runtime.plain_text import plain, shortened

_LONGEST_MESSAGE = 4000


def say(text: str, *, err: bool = False) -> None:
    """Print a line, or several; on standard error where the result itself goes to standard output."""
    context = click.get_current_context(silent=True)
    taken = context is not None and getattr(context.obj, "standard_output_taken", False)
    put(f"{plain(text)}\n", err=err or taken)


def put(text: str, *, err: bool = False) -> None:
    """Write a text as it is; where nobody reads any more, as behind `| head`, the rest goes nowhere."""
    try:
        click.echo(text, err=err, nl=False)
    except BrokenPipeError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, (sys.stderr if err else sys.stdout).fileno())
        os.close(nowhere)


def complain(text: str) -> None:
    """Print on standard error what is wrong; long arguments in it are cut."""
    click.echo(message(text), err=True)


def message(text: str) -> str:
    """Return a message as it is shown."""
    cut = shortened(plain(text))
    return cut if len(cut) <= _LONGEST_MESSAGE else f"{cut[:_LONGEST_MESSAGE]} …"


def replace_closed_streams() -> None:
    """Let what is said to a standard stream that is closed (`2>&-`) go nowhere; no file gets its number."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))


def accept_all_letters() -> None:
    """Let the standard streams write out letters that they cannot encode, instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="backslashreplace")
