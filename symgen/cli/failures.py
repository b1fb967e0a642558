"""What a user sees when something goes wrong: one paragraph and an exit status, never a traceback.

Ctrl-C, and what else asks a program to end: answered within a second, whatever machine code is running.

Python acts on a signal between two of its own instructions, so a step loop that does not return would keep it waiting.
A thread beside it reads the signals' numbers from a pipe; where the main thread has not acted in time, it ends the
process. What a run has recorded until then stays readable.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import signal
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.files import subject_of
from symgen.cli.terminal import accept_all_letters, complain, message, replace_closed_streams
from symgen.errors import SymgenError
from symgen.runtime.lazy import Late
from symgen.runtime.uninterrupted import ENDING, is_writing

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution


_PATIENCE = 0.6  # seconds until a signal must have been acted on
_PATIENCE_WRITING = 30.0
_PATIENCE_ENDING = 5.0  # seconds until threads must have come to their end after the main one
_LOOK_EVERY = 0.02
_UNANSWERED = b"\ninterrupted: the machine code did not answer; a recording keeps what was written to it\n"
_NO_END = b"\ninterrupted: something did not come to its end; a recording keeps what was written to it\n"
_EXIT = 128  # a shell's exit status of a program that a signal ended, less the signal's number


class _Answers:
    """Which signal came, and when the main thread acted on one."""

    def __init__(self) -> None:
        self.number = int(signal.SIGINT)
        self._acted_at = -math.inf

    def act(self, number: int, frame: FrameType | None) -> None:
        self.number, self._acted_at = number, time.monotonic()
        threading.Thread(target=self._see_to_the_end, name="interrupted", daemon=True).start()
        raise KeyboardInterrupt

    def _see_to_the_end(self) -> None:
        """End the process if its main thread has ended and it has not: others may wait for what an import left."""
        main = threading.main_thread()
        while main.is_alive():
            time.sleep(_PATIENCE)
        time.sleep(_PATIENCE_ENDING)
        with contextlib.suppress(OSError):
            os.write(2, _NO_END)
        os._exit(interrupted_status())

    def swallowed(self, error: Any) -> None:
        """Ask again after an interrupt that came while Python let nothing out: in a callback, or at an object's end."""
        if issubclass(error.exc_type, KeyboardInterrupt):
            threading.Timer(_LOOK_EVERY, os.kill, (os.getpid(), self.number)).start()
        else:
            sys.__unraisablehook__(error)

    def watch(self, pipe: int) -> None:
        """Read numbers of signals from a pipe until it is closed."""
        while numbers := os.read(pipe, 64):
            last = numbers[-1]
            if last in ENDING and not self._acts_in_time():
                with contextlib.suppress(OSError):  # nobody may be there to read it
                    os.write(2, _UNANSWERED)
                os._exit(_EXIT + last)
        os.close(pipe)

    def _acts_in_time(self) -> bool:
        # Several signals may be acted on as one, before all of them are read here.
        began = time.monotonic()
        while self._acted_at < began - _PATIENCE:
            time.sleep(_LOOK_EVERY)
            if time.monotonic() - began > (_PATIENCE_WRITING if is_writing() else _PATIENCE):
                return False
        return True


_answers = _Answers()


def interrupted_status() -> int:
    """Return the exit status after the signal that came: 130 after Ctrl-C, 143 after SIGTERM."""
    return _EXIT + _answers.number


@contextlib.contextmanager
def answered_interrupts() -> Iterator[None]:
    """Turn signals that end the program into `KeyboardInterrupt` within the block, and see that it comes soon.

    Signals that somebody else handles, or that are ignored, are left alone.
    """
    usual = (signal.SIG_DFL, signal.default_int_handler)
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _answers.number = int(signal.SIGINT)  # not that of a block before
    before = {number: handler for number in ENDING if (handler := signal.getsignal(number)) in usual}
    read, write = os.pipe()
    os.set_blocking(write, False)
    wakeup = signal.set_wakeup_fd(write, warn_on_full_buffer=False)
    for number in before:
        signal.signal(number, _answers.act)
    hook, sys.unraisablehook = sys.unraisablehook, _answers.swallowed
    threading.Thread(target=_answers.watch, args=(read,), name="interrupts", daemon=True).start()
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(wakeup)
        os.close(write)


errors = Late("symgen.runtime.errors")

FAILED = 1
NOT_TRUSTED = 3
_TRACEBACK = "SYMGEN_TRACEBACK"
_BEGINS_WITH_FILE = re.compile(r"[^:,;]*\.[A-Za-z]\w{1,5}[:,]")


class FailuresAsSentences(click.Group):
    """A group whose commands' errors become a sentence on standard error and an exit status."""

    def make_context(self, *args: Any, **given: Any) -> click.Context:
        try:
            return super().make_context(*args, **given)
        except KeyboardInterrupt:
            complain("\ninterrupted")
            sys.exit(interrupted_status())

    def invoke(self, context: click.Context) -> Any:
        try:
            with _short_warnings(), answered_interrupts():
                return self._invoke(context)
        except KeyboardInterrupt:  # while signals come to be answered, too, or no longer are
            complain("\ninterrupted")
            context.exit(interrupted_status())

    def _invoke(self, context: click.Context) -> Any:
        try:
            replace_closed_streams()
            accept_all_letters()
            return super().invoke(context)
        except click.ClickException as error:
            error.message = message(error.message)
            raise
        except (click.exceptions.Exit, click.Abort, BrokenPipeError):
            raise
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
        said = str(error) or "no more is said"
        return f"{subject or 'symgen'}: there is not enough memory for it ({said}); ask for less at once"
    if isinstance(error, RecursionError):
        return f"{subject or 'symgen'}: it is nested too deeply; nest it less"
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
    name = Path(subject).name
    named = (
        not subject
        or re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.]*\w)", text)
        or _BEGINS_WITH_FILE.match(text)
    )
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


def exit_status(solution: Solution, is_told: bool = False) -> int:
    """Say on standard error what is wrong, in short where standard output has told it, and return the exit status."""
    if solution.status == "interrupted":
        complain(solution.message)
        return interrupted_status()
    if solution.status not in ("success", "terminated"):
        context = click.get_current_context(silent=True)
        complain(f"Error: {_about(subject_of(context) if context else '', solution.message)}")
        return FAILED
    if not solution.objections:
        return 0
    kinds = {"Not to be trusted": solution.objections, "It may be because of": solution.advice}
    for head, entries in kinds.items():
        if entries and is_told:
            complain(f"{head}: {', '.join(entry.check for entry in entries)}")
        elif entries:
            complain(f"{head}: " + "; ".join(f"{entry.check}: {entry.says}" for entry in entries))
    return NOT_TRUSTED
