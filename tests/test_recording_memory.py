"""A recorder keeps no more of a long run than of a short one."""

from __future__ import annotations

import gc
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from symgen.runtime import load
from symgen.runtime.recording import run_writer, schema
from symgen.runtime.recording.recorder import RunRecorder
from symgen.runtime.recording.run_writer import Seen

ROOT = Path(__file__).resolve().parents[1]


def rough_road(rng, n):
    """Times, middles of bodies that move on, and boxes around them."""
    t = np.arange(n) / 60.0
    middles = np.column_stack([10.0 * t, np.sin(t), np.zeros(n)])
    return t, middles, middles - rng.uniform(0.1, 1.0, (n, 3)), middles + rng.uniform(0.1, 1.0, (n, 3))


@pytest.mark.parametrize("chunk", [1, 77, 1000])
def test_of_long_runs_frames_are_left_out_and_boxes_joined(monkeypatch, chunk):
    monkeypatch.setattr(run_writer, "_MOST_KEPT", 100)
    n = 3 * chunk * (2000 // chunk // 3 + 1)
    t, middles, low, high = rough_road(np.random.default_rng(1), n)
    seen = Seen()
    for first in range(0, n, chunk):
        own = slice(first, first + chunk)
        seen.take(t[own], middles[own], low[own], high[own], slice(None))
    times, path = seen.path()
    assert 100 < len(times) <= 200 and seen.every & (seen.every - 1) == 0
    np.testing.assert_array_equal(times, t[:: seen.every])
    np.testing.assert_array_equal(path, middles[:: seen.every].astype(np.float32))
    lows, highs, frames = seen.boxes()
    assert len(lows) <= 200
    np.testing.assert_array_equal(lows.min(axis=0), low.min(axis=0))
    np.testing.assert_array_equal(highs.max(axis=0), high.max(axis=0))
    ends = [*frames[1:], n]
    for k, (begin, end) in enumerate(zip(frames, ends)):
        np.testing.assert_array_equal(lows[k], low[begin:end].min(axis=0))


def test_short_runs_are_kept_whole():
    t, middles, low, high = rough_road(np.random.default_rng(2), 3000)
    seen = Seen()
    for first in range(0, 3000, 700):
        own = slice(first, first + 700)
        seen.take(t[own], middles[own], low[own][::7], high[own][::7], slice(None, None, 7))
    times, path = seen.path()
    np.testing.assert_array_equal(times, t)
    np.testing.assert_array_equal(path, middles.astype(np.float32))
    _, _, frames = seen.boxes()
    np.testing.assert_array_equal(
        frames, np.concatenate([f + np.arange(0, min(700, 3000 - f), 7) for f in range(0, 3000, 700)])
    )


@pytest.mark.parametrize(
    "content",
    [pytest.param("all", marks=pytest.mark.slow), *(name for name in schema.CONTENTS if name != "all")],
)
def test_memory_does_not_grow_with_the_frames(tmp_path, monkeypatch, content):
    """Of 600 000 frames more no more stays than what chunks differ by, 1 MB; 20 bytes a frame, 12 MB, did."""
    monkeypatch.setattr(run_writer, "_MOST_KEPT", 2000)
    text = (ROOT / "generated" / "double_pendulum.py").read_text(encoding="utf-8")
    system = load(text)
    q, v, _, _ = system.initial_state()
    state = np.concatenate([q, v, np.zeros(system.nw)])
    recorder = RunRecorder(
        tmp_path / "run.rrd",
        system,
        system.parameter_values(),
        method="dop853",
        rtol=1e-8,
        atol=1e-10,
        constraints="projection",
        module_text=text,
        model_text="",
        content=content,
    )
    recorder.start(0.0, state)
    n = 1

    def record(frames):
        nonlocal n
        for _ in range(frames // 1000):
            t = (n + np.arange(1000)) / 60.0
            recorder.frames(t, np.tile(state, (1000, 1)))
            recorder.steps(np.column_stack([t, np.full(1000, 1 / 60.0)]))
            n += 1000
        recorder.flush()
        gc.collect()  # also what tests before this one have left
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        before = record(200_000)
        grown = record(600_000) - before
    finally:
        tracemalloc.stop()
        recorder.abort()
    assert grown < 3_000_000
