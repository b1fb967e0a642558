"""Runs of which no more frames are kept than checks look at: memory, and what is the same as with all frames."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import symgen
from symgen.runtime import RunOptions, frame_grid, frame_window
from symgen.runtime.checkpoint import _held_values
from symgen.runtime.checkpoint_bytes import Checkpoint
from symgen.runtime.errors import RuntimeModelError

_KEPT = 500


class Recorder:
    """Keeps all that a run hands on, and the checkpoint of its end."""

    def __init__(self):
        self.t, self.y, self.logs, self.events, self.checkpoint_at_end = [], [], [], [], None

    def start(self, t, y):
        self.frames(np.array([t]), y[None])

    def frames(self, t, y):
        self.t.append(t.copy())
        self.y.append(y.copy())

    def steps(self, log):
        self.logs.append(np.array(log))

    def event(self, name, t, *, energy_change=0.0):
        self.events.append((name, t, energy_change, sum(map(len, self.t))))

    def checkpoint(self, make, *, final=False):
        if final:
            self.checkpoint_at_end = Checkpoint.from_bytes(make())


class Nobody:
    """Takes what a run hands on, and forgets it."""

    def __getattr__(self, name):
        return lambda *given, **named: None


def _pieces(checkpoint, name):
    n = checkpoint.facts["n_frames"]
    return _held_values(checkpoint.arrays[f"{name}_from"], checkpoint.arrays[name], n)


@pytest.mark.parametrize(
    "name, options",
    [
        # Steps of a hundred frames, more than a window has room for at first.
        ("double_pendulum", {"t_end": 5.0003, "fps": 1000, "at": [1.0, 2.50001]}),
        ("slider_crank", {"t_end": 3.0, "fps": 1000, "method": "radau5"}),
        ("bouncing_ball", {"t_end": 2.0, "fps": 1500}),
        ("stick_slip", {"t_end": 9.0, "fps": 300, "method": "dop853"}),
        ("rough_road", {"t_end": 3.0, "fps": 1000, "method": "rk4"}),
    ],
)
def test_a_run_is_the_same_as_with_all_frames(monkeypatch, name, options):
    """Bit for bit: what is handed on, energies and residuals at their largest, and from where a run would go on."""
    monkeypatch.setattr(frame_grid, "MOST_KEPT", _KEPT)
    monkeypatch.setattr(frame_window, "_MOST", 64)
    system = symgen.load(name)
    (all_of, whole), (some, thinned) = (
        (recorder := Recorder(), system.run(recorder=recorder, keep=keep, **options))
        for keep in ("all", "checked")
    )
    for part in ("t", "y", "logs"):
        np.testing.assert_array_equal(*(np.concatenate(getattr(one, part)) for one in (all_of, some)))
    assert some.events == all_of.events and thinned.stats == whole.stats
    assert _KEPT / 2 < len(thinned.t) < _KEPT + 64 < len(whole.t)
    assert thinned.energy.max_error == whole.energy.max_error
    assert thinned.energy.exchange.size == whole.energy.exchange.size
    for level in ("max_position", "max_velocity"):
        assert getattr(thinned.constraint_residual, level) == getattr(whole.constraint_residual, level)
    rows = np.searchsorted(whole.t, thinned.t)
    for series in ("t", "q", "v", "w"):
        np.testing.assert_array_equal(getattr(thinned, series), getattr(whole, series)[rows])
    assert [s.t for s in thinned.samples] == [s.t for s in whole.samples]
    assert any(note.startswith(f"frames: of {len(whole.t)}") for note in thinned.notes)
    ends = all_of.checkpoint_at_end, some.checkpoint_at_end
    assert ends[0].facts == ends[1].facts
    for per_frame in ("resets", "forms"):
        np.testing.assert_array_equal(*(_pieces(end, per_frame) for end in ends))


def test_a_checkpoint_at_the_end_has_the_forms_of_the_last_frames():
    """Those behind the last change of stick and slip were said to be of the first form."""
    recorder = Recorder()
    solution = symgen.load("block_on_plate").run(1.0, fps=300, method="dop853", recorder=recorder)
    forms = _pieces(recorder.checkpoint_at_end, "forms")
    np.testing.assert_array_equal(forms, solution.forms.index[: len(forms)])
    assert forms[-1] > 0


def test_memory_does_not_grow_with_the_frames(monkeypatch):
    monkeypatch.setattr(frame_grid, "MOST_KEPT", 2000)
    system = symgen.load("double_pendulum")

    def peak(t_end):
        tracemalloc.start()
        try:
            system.run(t_end, fps=2000, method="dop853", recorder=Nobody(), keep="checked")
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(1.0)  # loads what is loaded once
    assert peak(60.0) < peak(6.0) + 500_000  # of 108 000 frames more, with 65 bytes each: 7 MB


@pytest.mark.parametrize("n", [7, 1000])
@pytest.mark.parametrize("fps", [30.0, 999.7])
def test_frames_a_few_at_a_time_are_those_all_at_once(monkeypatch, fps, n):
    monkeypatch.setattr(frame_grid, "MOST_KEPT", 300)
    options = RunOptions(t_start=0.1, t_end=11.3, fps=fps, keep="checked")
    more = np.array([0.21, 0.1 + 3 / fps, 7.7])  # the second one is a frame that was asked for
    grid = options.frame_grid(2).with_more(more)
    times, shown = grid.after(-np.inf, n)
    while len(new := grid.after(times[-1], n)[0]):
        times, shown = np.append(times, new), np.append(shown, grid.after(times[-1], n)[1])
    expected = RunOptions(t_start=0.1, t_end=11.3, fps=fps).frame_times(2)[0]
    np.testing.assert_array_equal(times[shown], expected)
    np.testing.assert_array_equal(times[~shown], [0.21, 7.7])


def test_what_is_kept_is_one_of_two():
    with pytest.raises(RuntimeModelError, match="keep is 'some': give one of all, checked"):
        RunOptions(keep="some")
