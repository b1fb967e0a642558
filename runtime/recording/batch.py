"""What waits to be written at once: frames, events and steps, and a checkpoint of the moment after them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .run_writer import RunWriter

_ROWS = 16_000  # of a chunk at most: what is worked out for its frames takes many times their memory


@dataclass
class Batch:
    """Parts of a recording in the order in which they came.

    Attributes
    ----------
    frames : list of (ndarray, ndarray, float, ndarray)
        Times, states, energy of resets, settings.
    events, steps : list
        As `RunWriter` takes them.
    checkpoint : bytes
        Of the moment after these frames, if there is one.
    """

    frames: list[tuple[np.ndarray, np.ndarray, float, np.ndarray]] = field(default_factory=list)
    events: list[tuple[int, float, str, float]] = field(default_factory=list)
    steps: list[np.ndarray] = field(default_factory=list)
    checkpoint: bytes = b""

    def states(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the times, shape (n,) [s], and states, shape (n, ny), of all frames."""
        return tuple(np.concatenate([chunk[part] for chunk in self.frames]) for part in (0, 1))

    def write(self, writer: RunWriter) -> None:
        """Write all of it, in an order in which a file that is cut off still makes sense."""
        if self.frames:
            lengths = [len(chunk[0]) for chunk in self.frames]
            resets, settings = (
                np.repeat(np.array([chunk[part] for chunk in self.frames]), lengths, axis=0)
                for part in (2, 3)
            )
            t, y = self.states()
            for first in range(0, len(t), _ROWS):
                rows = slice(first, first + _ROWS)
                writer.frames(t[rows], y[rows], resets[rows], settings[rows])
        if self.events:
            writer.events(self.events)
        if self.steps:
            writer.steps(np.concatenate(self.steps))
        if self.checkpoint:
            writer.checkpoint(self.checkpoint)
