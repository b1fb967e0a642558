"""How far an ensemble has come, on one line that is written over, or on lines that become rarer."""

from __future__ import annotations

import time

import click

_EVERY, _PLAIN_EVERY = 0.2, 5.0  # seconds
_BAR = 20  # letters


def duration(seconds: float) -> str:
    """Return a time as people say it."""
    if seconds < 100.0:
        return f"{seconds:.2g} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min"


class Progress:
    """One line: a bar, members done, how fast, time left, failures."""

    def __init__(self, in_place: bool) -> None:
        self._in_place, self._every = in_place, _EVERY if in_place else _PLAIN_EVERY
        self._began = self._shown = time.monotonic()
        self._first, self._any = 0, False

    def begin(self, done: int) -> None:
        self._first = done

    def show(self, done: int, n: int, failed: int) -> None:
        now = time.monotonic()
        if now - self._shown < self._every:
            return
        self._shown, self._any = now, self._in_place
        speed = max(done - self._first, 0) / (now - self._began)
        left = duration((n - done) / speed) if speed > 0.0 else "…"
        text = f"{done} of {n} members, {speed:.3g} a second, {left} left, {failed} failed"
        filled = int(_BAR * done / n)
        if self._in_place:
            click.echo(f"\r[{'#' * filled}{'.' * (_BAR - filled)}] {text}\x1b[K", err=True, nl=False)
            return
        click.echo(text, err=True)
        self._every *= 2.0

    def clear(self) -> None:
        if self._any:
            click.echo("\r\x1b[K", err=True, nl=False)
