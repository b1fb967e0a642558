"""Work in a thread beside the caller's: what encodes and writes a recording lets the run go on meanwhile."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any


class Beside:
    """One piece of work at a time; what it raises comes out where the caller waits for it, once."""

    def __init__(self) -> None:
        self._thread: threading.Thread | None = None
        self._error: BaseException | None = None

    @property
    def busy(self) -> bool:
        """Whether the last piece of work is not done yet."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def failed(self) -> bool:
        """Whether something was raised that has not come out yet."""
        return self._error is not None

    def start(self, work: Callable[..., None], *arguments: Any) -> None:
        """Begin `work(*arguments)`, when the piece before it is done.

        The interpreter does not end before it is: a chunk that was begun is written whole.
        """
        self.wait()
        self._thread = threading.Thread(target=self._run, args=(work, arguments), name="recording")
        self._thread.start()

    def _run(self, work: Callable[..., None], arguments: tuple) -> None:
        try:
            work(*arguments)
        except BaseException as error:
            self._error = error

    def wait(self) -> None:
        """Return when nothing is left to do; raise what the last piece of work has raised."""
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        error, self._error = self._error, None
        if error is not None:
            raise error
