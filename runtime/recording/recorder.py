"""Record a run while it goes on: chunks of frames are written beside it, and what is written survives a kill.

What waits to be written at once: frames, events and steps, and a checkpoint of the moment after them.

Work in a thread beside the caller's: what encodes and writes a recording lets the run go on meanwhile.
"""

from __future__ import annotations

import functools
import os
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.recording import schema
from symgen.runtime.recording.recording import Quantities, Settings
from symgen.runtime.size import more_than_disk
from symgen.runtime.uninterrupted import uninterrupted

if TYPE_CHECKING:
    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.system import System

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
    events: list[tuple[int, float, str, float, EventRecord | None]] = field(default_factory=list)
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
                if first + _ROWS < len(t):
                    writer.flush()  # else all that is encoded of them waits at once
        if self.events:
            writer.events(self.events)
        if self.steps:
            writer.steps(np.concatenate([_thinned(log) for log in self.steps]))
        if self.checkpoint:
            writer.checkpoint(self.checkpoint)


class BackgroundWork:
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


run_writer = Late("symgen.runtime.recording.run_writer")

_CHUNK = 4000  # frames; a chunk costs as much as some hundred of its frames
_CHUNK_OF_STATES = 16_000  # of states alone, whose frames cost less
_EARLY_CHUNK = 50
_MOST_WAITING = 1 << 23  # bytes of frames that wait for the chunk before them
_MAX_WAIT = 0.5  # seconds of wall time between chunks, while frames come, and between checkpoints
_FREE_CHECKPOINTS = (
    1 << 20
)  # bytes of checkpoints that are written in any case; later, at most as many as of states
_LARGEST_CHECKPOINT = 1 << 28  # a larger one is not written
_LEAST_OF_NUMBER = 4.0  # bytes of a number of a state, packed
_MOST_LOGS = 256  # pieces of it that wait as they are
_MOST_STEPS = 500  # a longer piece of the step log is shown by as many pairs of smallest and largest step


class RunRecorder:
    """Writes one recording of one run.

    Call `start`, then `frames`, `steps`, `event`, `settings` and `checkpoint` as the run goes on, and `finish` or
    `abort` at its end. As a context manager it aborts when its block ends early. No file is made before there is
    something to write.

    Parameters
    ----------
    path : path-like
        The recording; an older one at this place is replaced.
    system : System
    p : ndarray
        Parameters, then inputs; constant over the run.
    method, constraints : str
        What was used, not what was asked for (`auto`).
    rtol, atol : float
    module_text, model_text : str
        The generated module and the model as its author wrote it: a recording is checked from itself alone.
    title : str, optional
        The model's name otherwise.
    options : dict, optional
        Other settings of the run, as JSON can say them; `step` [s] for methods of fixed step size.
    mesh_folder : path-like, optional
        The model's folder, below which its meshes lie.
    content : {"all", "states"}, optional
        Whether to write all that is shown, or states alone: poses and curves are then worked out when somebody looks.

    Raises
    ------
    RuntimeModelError
        If nothing can be written at `path`.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        system: System,
        p: np.ndarray,
        *,
        method: str,
        rtol: float,
        atol: float,
        constraints: str,
        module_text: str,
        model_text: str,
        title: str = "",
        options: dict[str, Any] | None = None,
        mesh_folder: str | os.PathLike[str] | None = None,
        content: str = schema.ALL,
    ):
        self.path = writable(Path(path))
        _refuse_more_than_disk(self.path, system.ny, options or {})
        self._of = Quantities(system, p)
        if self._of.p.shape != (system.n_p,):
            raise ValueError(
                f"p has shape {self._of.p.shape}, but model {system.name!r} has {system.n_p} "
                "parameters and inputs"
            )
        if content not in schema.CONTENTS:
            raise ValueError(f"content is {content!r}, not one of {', '.join(schema.CONTENTS)}")
        self._settings: dict[str, Any] = {
            "title": title or system.name,
            "method": method,
            "constraints": constraints,
            "rtol": float(rtol),
            "atol": float(atol),
            "module_text": module_text,
            "model_text": model_text,
            "options": dict(options or {}),
            "mesh_folder": None if mesh_folder is None else Path(mesh_folder),
            "content": content,
        }
        self._writer: RunWriter | None = None
        self._background = BackgroundWork()
        # Controllers may look at what the run is changing.
        self._in_step = system.has_feedback or bool(system.input_descriptions)
        self._closed = False
        self._first: tuple[float, np.ndarray] | None = None
        self._batches = [Batch()]
        self._begun = False
        self._settings_now = self._of.p[system.settings_of_switches].copy()
        self._next_checkpoint = -np.inf  # wall time; the first one comes with the first chunk
        self._checkpoint_bytes = self._last_checkpoint = 0
        self._energy_of_resets = 0.0
        self._next_event: EventRecord | None = None
        self._n_taken = self._n_waiting = 0
        self._last_flush = time.monotonic()

    def __enter__(self) -> RunRecorder:
        return self

    def __exit__(self, kind, value, trace) -> None:
        self.abort()

    def start(self, t0: float, state: np.ndarray) -> None:
        """Take the initial state Y = (q, v, w) as the first frame; the energy balance refers to it."""
        t, y = self._checked(np.array([t0]), np.array(state)[None])
        self._first = (float(t[0]), y[0])
        self._last_flush = time.monotonic()
        self._take(t, y)

    def frames(self, times: np.ndarray, states: np.ndarray) -> None:
        """Record frames (the arrays are copied); a first one that repeats the start is left out.

        Parameters
        ----------
        times : ndarray, shape (n,) [s]
        states : ndarray, shape (n, nq + nv + nw)
        """
        if self._first is None:
            raise RuntimeError("call start() before frames()")
        t, y = self._checked(times, states)
        if len(t) and self._n_taken == 1 and t[0] == self._first[0] and np.array_equal(y[0], self._first[1]):
            t, y = t[1:], y[1:]
        if len(t):
            self._take(t, y)
        whole = _CHUNK if self._settings["content"] == schema.ALL else _CHUNK_OF_STATES
        enough = whole if self._begun else _EARLY_CHUNK
        due = self._n_waiting >= enough or time.monotonic() - self._last_flush >= _MAX_WAIT
        may_wait = self._background.busy and 8 * self._of.system.ny * self._n_waiting < _MOST_WAITING
        if ((due or len(self._batches) > 1) and not may_wait) or self._background.failed:
            self._write_whole(wait=self._in_step)

    def steps(self, step_log: np.ndarray) -> None:
        """Record accepted steps: rows of t and h [s]. For the plot only: a long log is thinned."""
        log, waiting = np.array(step_log, dtype=float).reshape(-1, 2), self._batches[-1].steps
        if len(log):
            # Thinned where it is written, beside the run, but for long logs between frames that are far apart.
            waiting.append(log if len(waiting) < _MOST_LOGS else _thinned(log))

    def event(self, name: str, t: float, *, energy_change: float = 0.0) -> None:
        """Record an event that comes after all frames given so far.

        Parameters
        ----------
        name : str
        t : float [s]
        energy_change : float [J]
            T + V after a reset less T + V before it. The energy balance of later frames allows for it.
        """
        whole, self._next_event = self._next_event, None
        self._batches[-1].events.append((self._n_taken, float(t), str(name), float(energy_change), whole))
        self._energy_of_resets += float(energy_change)

    def next_event(self, event: EventRecord) -> None:
        """Take the event that is recorded next as the run has it, with the motion on both sides and the work."""
        self._next_event = event

    def settings(self, values: np.ndarray) -> None:
        """Take the settings of stops and frictions that hold for the frames from now on."""
        self._settings_now = np.array(values, dtype=float)

    def checkpoint(self, make: Callable[[], bytes], *, final: bool = False) -> None:
        """Write a checkpoint of the run, from which it can go on, if it is time for one.

        Parameters
        ----------
        make : callable
            Returns the checkpoint (`symgen.runtime.checkpoint`) for the moment after all frames given so far.
        final : bool
            The run ends here.
        """
        allowed = max(_FREE_CHECKPOINTS, 8 * self._of.system.ny * self._n_taken) - self._last_checkpoint
        due = self._begun and time.monotonic() >= self._next_checkpoint
        if self._closed or not (final or (due and self._checkpoint_bytes <= allowed)):
            return
        content = make()
        self._next_checkpoint, self._last_checkpoint = time.monotonic() + _MAX_WAIT, len(content)
        if len(content) <= _LARGEST_CHECKPOINT:
            self._checkpoint_bytes += len(content)
            self._batches[-1].checkpoint = content
            self._batches.append(Batch())
            if not self._background.busy:
                self._write_whole(wait=self._in_step)

    def finish(self, status: str, health: Sequence[dict], stats: dict[str, Any]) -> None:
        """Write what waits, the closing record with the SHA-256 of all states, and the final layout; close.

        Parameters
        ----------
        status : str
            How the run ended.
        health : sequence of dict
            The health report: `check`, `ok`, `value`, `limit`, `says`.
        stats : dict
        """
        self.flush()
        if self._writer is not None and not self._closed:
            self._writer.result(status, health, stats)
        self._close()

    def abort(self) -> None:
        """Write what waits and close without a closing record: the recording counts as incomplete."""
        self.flush()
        self._close()

    def flush(self) -> None:
        """Write all that waits, and hand it to the operating system. Ctrl-C takes effect afterwards."""
        self._write_whole()

    def _write_whole(self, *, wait: bool = True) -> None:
        """Begin to write all that waits; with `wait`, return when it is written."""
        if self._closed:
            return
        with uninterrupted(writing=True):  # half a chunk on file would make the recording unreadable
            try:
                self._background.wait()
                if self._n_taken:
                    # Rerun takes a while to load, which a run that fails at its start should not wait for. Imports are
                    # done here and not beside the run, which may be importing too.
                    batches, self._batches, self._n_waiting = self._batches, [Batch()], 0
                    self._begun, self._last_flush = True, time.monotonic()
                    make = functools.partial(
                        run_writer.RunWriter, self.path, self._of, Settings(**self._settings)
                    )
                    self._background.start(self._write, make, batches)
                if wait:
                    self._background.wait()
            except RuntimeError as error:  # of Rerun, which writes the file
                self._give_up()
                raise RuntimeModelError(
                    f"{self.path}: the recording cannot be written ({error}); make room there, or name another place"
                ) from error
            except BaseException:
                self._give_up()
                raise

    def _give_up(self) -> None:
        """What cannot be written now is not tried again when the run is wound up."""
        self._closed = True
        if self._writer is not None:
            self._writer.discard()

    def _write(self, make: Callable[..., RunWriter], batches: list[Batch]) -> None:
        """Write batches; this is what is done beside the run, and all that it shares with it."""
        if self._writer is None:
            self._writer = make(*batches[0].states())
        for batch in batches:
            batch.write(self._writer)
        self._writer.flush()

    def _checked(self, times: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self._closed:
            raise RuntimeError(f"{self.path}: the recording is closed already")
        t, y, system = np.array(times, dtype=float), np.array(states, dtype=float, order="C"), self._of.system
        if t.ndim != 1 or y.shape != (len(t), system.ny):
            raise ValueError(
                f"frames have shapes {t.shape} and {y.shape}, but model {system.name!r} "
                f"takes (n,) and (n, {system.ny}): q, v and work"
            )
        return t, y

    def _take(self, t: np.ndarray, y: np.ndarray) -> None:
        self._batches[-1].frames.append((t, y, self._energy_of_resets, self._settings_now))
        self._n_taken += len(t)
        self._n_waiting += len(t)

    def _close(self) -> None:
        if self._writer is not None and not self._closed:
            self._writer.close()
        self._closed = True


def writable(path: Path) -> Path:
    """Return where a recording is to be written, if it can be."""
    folder = path.parent
    if path.suffix not in ("", ".rrd"):
        raise RuntimeModelError(
            f"{path}: a recording is an .rrd file: call it {path.with_suffix('.rrd').name}, or "
            "write tables of numbers with numpy.savetxt"
        )
    if path.is_dir():
        raise RuntimeModelError(f"{path}: is a folder; name a file in it, such as {path / 'run.rrd'}")
    if not folder.is_dir():
        raise RuntimeModelError(f"{path}: the folder {folder} does not exist; make it, or write elsewhere")
    existed = path.exists()
    try:
        path.open("ab").close()
    except OSError as error:
        raise RuntimeModelError(
            f"{path}: cannot be written ({error.strerror or error}); change its permissions, or write elsewhere"
        ) from error
    if not existed:
        path.unlink()  # a run that fails at its start leaves no empty file
    return path


def _refuse_more_than_disk(path: Path, ny: int, options: dict[str, Any]) -> None:
    """Refuse frames of which not even the states would find room: who asks for these has made a slip."""
    fps = options.get("fps")
    if not fps:
        return
    span = options["t_end"] - options["t_start"]
    if needed := more_than_disk(_LEAST_OF_NUMBER * ny * span * fps, path.parent):
        raise RuntimeModelError(
            f"{path}: fps is {fps:g}: {span:g} s make {span * fps:.1e} frames, which {needed}: give a smaller fps, or "
            "a shorter run"
        )


def _thinned(log: np.ndarray) -> np.ndarray:
    if len(log) <= 2 * _MOST_STEPS:
        return log
    starts = np.linspace(0, len(log), _MOST_STEPS, endpoint=False).astype(int)
    times = np.repeat(log[starts, 0], 2)
    extremes = (np.minimum.reduceat(log[:, 1], starts), np.maximum.reduceat(log[:, 1], starts))
    return np.column_stack([times, np.column_stack(extremes).ravel()])
