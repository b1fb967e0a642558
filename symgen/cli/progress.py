"""How far a run or an ensemble has come, on one line that is written over, or on lines that become rarer."""

from __future__ import annotations

import time

import click

EVERY, PLAIN_EVERY = 0.2, 5.0  # seconds
_BAR = 20  # letters


def duration(seconds: float) -> str:
    """Return a time as people say it."""
    if seconds < 100.0:
        return f"{seconds:.2g} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min"


def bar(share: float) -> str:
    """Return how much is done as a bar."""
    return "[" + ("#" * round(_BAR * min(1.0, max(0.0, share)))).ljust(_BAR, ".") + "]"


class StatusLine:
    """One line on standard error.

    Parameters
    ----------
    in_place : bool
        Whether to write over the line, as terminals can; else a line now and then, ever more rarely.
    after : float [s]
        Nothing is said before.
    """

    def __init__(self, in_place: bool, after: float = 0.0):
        self._in_place, self._after = in_place, after
        self._every = EVERY if in_place else PLAIN_EVERY
        self._any = False
        self.begin()

    def begin(self) -> None:
        """Count time from now on."""
        self._began = self._shown = time.monotonic()

    @property
    def seconds(self) -> float:
        """Wall time since it began."""
        return time.monotonic() - self._began

    @property
    def is_due(self) -> bool:
        """Whether it is time to say something."""
        return self.seconds >= self._after and time.monotonic() - self._shown >= self._every

    def say(self, text: str) -> None:
        """Write over what was said."""
        self._shown, self._any = time.monotonic(), self._in_place
        if self._in_place:
            click.echo(f"\r{text}\x1b[K", err=True, nl=False)
            return
        click.echo(text, err=True)
        self._every *= 2.0

    def clear(self) -> None:
        """Take the line away."""
        if self._any:
            click.echo("\r\x1b[K", err=True, nl=False)


class Progress(StatusLine):
    """A bar, members done, how fast, time left, failures."""

    def __init__(self, in_place: bool) -> None:
        super().__init__(in_place)
        self._first = 0

    def begin_at(self, done: int) -> None:
        """Begin with members that are done already."""
        self._first = done

    def show(self, done: int, n: int, failed: int) -> None:
        """Say how far the ensemble is, if it is time to."""
        if not self.is_due:
            return
        speed = max(done - self._first, 0) / self.seconds
        left = duration((n - done) / speed) if speed > 0.0 else "…"
        self.say(f"{bar(done / n)} {done} of {n} members, {speed:.3g} a second, {left} left, {failed} failed")
