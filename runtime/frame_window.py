"""The frames that lie ahead of a run, a window of them at a time: its memory does not grow with their number.

Step loops write frames into an array, and never ask for another one. So before a step that may pass the last frame of
the window, they are called back, as before a time at which a state is wanted, and the window moves on. Steps, and what
is written of them, are those of a run whose frames are all there.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.frame_grid import most_kept
from symgen.runtime.passed_frames import Frames, PassedFrames

if TYPE_CHECKING:
    from symgen.runtime.frame_grid import FrameGrid
    from symgen.runtime.system import System

_NUMBERS, _LEAST, _MOST = 1_000_000, 64, 4096  # of a window: numbers of its states, and frames


def first_of(grid: FrameGrid, ny: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the times of the first window of frames of `ny` numbers [s], and which of them were asked for."""
    return grid.after(-np.inf, int(np.clip(_NUMBERS // max(ny, 1), _LEAST, _MOST)))


class Pieces:
    """Values of one frame after another, as the frames where they change, and what they are from there on."""

    def __init__(self):
        self.n = 0
        self._begins: list[np.ndarray] = [np.zeros(0, dtype=int)]
        self._values: list[np.ndarray] = []

    def take(self, values: np.ndarray) -> None:
        """Take the values of the next frames."""
        begins, changed = pieces(values)
        if len(begins) and self._values and changed[0] == self._values[-1][-1]:
            begins, changed = begins[1:], changed[1:]
        if len(begins):
            self._begins.append(self.n + begins)
            self._values.append(changed)
        self.n += len(values)

    def with_more(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where pieces begin, and their values, with those of the next frames, which are not taken yet."""
        both = Pieces()
        both.n, both._begins, both._values = self.n, [*self._begins], [*self._values]
        both.take(values)
        if not both._values:
            return both._begins[0], values[:0]
        return np.concatenate(both._begins), np.concatenate(both._values)


def pieces(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where a value other than the one before begins, and these values."""
    begins = np.flatnonzero(np.append(True, values[1:] != values[:-1])) if len(values) else np.zeros(0, int)
    return begins, values[begins]


class FrameWindow:
    """The frames ahead of a run, in the arrays of its loop, and what is kept of those behind it.

    Parameters
    ----------
    system : System
    grid : FrameGrid
        All frames of the run.

    Attributes
    ----------
    end : float [s]
        The last frame of the window, which no step may pass before it moves on; inf where none comes after it.
    resets, forms : Pieces
        Of frames that were asked for, and that are behind the window: energies of resets, and numbers of settings.
    """

    def __init__(self, system: System, grid: FrameGrid):
        self._grid = grid
        self._set_end(first_of(grid, system.ny)[0])
        self._passed = PassedFrames(system, most_kept(system.ny))
        self._n_taken = 0  # of the window
        self._resets_at_start = 0.0
        self.resets, self.forms = Pieces(), Pieces()

    def _set_end(self, times: np.ndarray) -> None:
        self.end = np.inf if not len(times) or times[-1] >= self._grid.t_end else float(times[-1])

    def move(self, run: Any) -> None:
        """Move on to the frames behind those that were handed on; the last one of these stays, as the first.

        Where none has been passed since it moved last, the next step goes over more frames than there is room for: it
        is made larger.
        """
        arrays, last = run.arrays, run.handed - 1
        self._take(run)
        if last == 0:
            n = 2 * len(arrays.frame_times)
            arrays.make_room_for_frames(n)
            for name in ("reset_energy_at_frames", "form_at_frames", "shown"):
                values = getattr(run, name)
                setattr(run, name, np.append(values, np.zeros(n - len(values), dtype=values.dtype)))
        else:
            for values in (
                arrays.frame_times, arrays.frames, run.reset_energy_at_frames, run.form_at_frames, run.shown
            ):  # fmt: skip
                values[0] = values[last]
        times, shown = self._grid.after(float(arrays.frame_times[0]), len(arrays.frame_times) - 1)
        arrays.show_frames(times)
        run.shown[1:], run.reset_energy_at_frames[1:], run.form_at_frames[1:] = False, 0.0, 0
        run.shown[1 : 1 + len(times)] = shown
        run.handed = self._n_taken = 1
        self._set_end(times)

    def _take(self, run: Any) -> None:
        """Take the frames of the window that were handed on, and not taken before."""
        new = slice(self._n_taken, run.handed)
        shown = run.shown[new]
        frames = Frames(
            run.arrays.frame_times[new], run.arrays.frames[new], run.reset_energy_at_frames[new],
            run.form_at_frames[new], shown,
        )  # fmt: skip
        if self._n_taken == 0 and len(frames):
            self._resets_at_start = float(frames.resets[0])
        self._passed.take(frames, run.arrays.p)
        self.resets.take(frames.resets[shown])
        self.forms.take(frames.forms[shown])
        self._n_taken = run.handed

    def untaken(self, n: int) -> slice:
        """Return which rows of the window up to row n were not taken yet."""
        return slice(self._n_taken, n)

    def kept(self, run: Any) -> Frames:
        """Return what is kept of all frames that were handed on, and the last one of these as it is now."""
        self._take(run)
        kept, row = self._passed.kept(), slice(run.handed - 1, run.handed)
        arrays = run.arrays
        last = Frames(
            arrays.frame_times[row], arrays.frames[row], run.reset_energy_at_frames[row], run.form_at_frames[row],
            run.shown[row],
        )  # fmt: skip
        return Frames.joined([kept[kept.t < last.t[0]], last])

    def so_far(self, run: Any) -> tuple[SimpleNamespace, int, float]:
        """Return `p` and frames up to now as a loop's arrays have them, their number, and resets at the start [J]."""
        kept = self.kept(run)
        arrays = SimpleNamespace(p=run.arrays.p, frame_times=kept.t, frames=kept.y)
        return arrays, len(kept), self._resets_at_start

    def note(self, kept: int) -> list[str]:
        """Say how many of the frames there are, where these are not all."""
        passed = self._passed.n
        return [f"frames: of {passed}, {kept} are kept for the checks"] if kept < passed else []
