"""What became of many runs, a row for each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from symgen.runtime.prepared import layout as here


class Runs:
    """What became of many runs, a row for each.

    Attributes
    ----------
    y : ndarray, shape (n, nq + nv) or (n, n_times, nq + nv)
        (q, v) at the end, or at the times asked for; nan where there is none.
    t : ndarray, shape (n,) [s]
        Where the runs ended.
    status : ndarray of int, shape (n,)
        0 success, 1 terminated by an event, 2 zeno, 3 doubtful, below 0 failed or interrupted.
    steps : ndarray of int, shape (n,)
    """

    def __init__(self, shape: tuple[int, ...], t_start: float, explain: Callable[[int], str]):
        self.y, self.t = np.full(shape, np.nan), np.full(shape[0], t_start)
        self.status = np.full(shape[0], here.INTERRUPTED, dtype=np.int64)
        self.steps = np.zeros(shape[0], dtype=np.int64)
        self._explain = explain
        self._messages: dict[int, str] = {}

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        return f"<Runs: {int(self.ok.sum())} of {len(self)} ok>"

    @property
    def ok(self) -> np.ndarray:
        """Which runs came to a regular end without an objection, shape (n,)."""
        return (self.status == here.SUCCESS) | (self.status == here.TERMINATED)

    @property
    def words(self) -> list[str]:
        """The status of each run as `Solution.status` says it, or doubtful."""
        return [here.WORDS.get(int(code), "failed") for code in self.status]

    def message(self, row: int) -> str:
        """Return why a run is no success, an empty string where it is one.

        What has failed in machine code is run again for it, in Python.
        """
        if row not in self._messages and self.status[row] not in (here.SUCCESS, here.INTERRUPTED):
            self._messages[row] = self._explain(row)
        return self._messages.get(row, "")

    def note(self, row: int, status: int, message: str = "") -> None:
        """Note what became of a run."""
        self.status[row] = status
        if message:
            self._messages[row] = message
