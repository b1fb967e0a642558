"""Parallel coordinates: an axis for each quantity side by side, and a line across them for each member."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

_WIDTH, _HEIGHT = 736.0, 340.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 40.0, 40.0, 34.0, 30.0
_LARGEST = 1e150  # beyond that nothing is drawn


def parallel_axes(names: Sequence[str], rows: np.ndarray, ok: np.ndarray) -> str:
    """Return the picture as an SVG element.

    Parameters
    ----------
    names : sequence of str
        Plain text; it is escaped here.
    rows : ndarray, shape (n, axes)
        What is not finite interrupts its line.
    ok : ndarray of bool, shape (n,)
        Lines of the others are red, and lie above.
    """
    x = np.linspace(_LEFT, _WIDTH - _RIGHT, len(names))
    drawn = np.where(np.abs(rows) < _LARGEST, rows, np.nan)
    low, high = _bounds(drawn)
    heights = _HEIGHT - _BOTTOM - (drawn - low) / (high - low) * (_HEIGHT - _TOP - _BOTTOM)
    parts = []
    for good, style in (
        (True, "stroke:var(--c0);stroke-opacity:.22"),
        (False, "stroke:var(--bad);stroke-opacity:.8"),
    ):
        path = "".join(_line(x, line) for line in heights[ok == good])
        if path:
            parts.append(f'<path style="fill:none;stroke-width:1;{style}" d="{path}"/>')
    for k, name in enumerate(names):
        parts.append(f'<path class="frame" d="M{x[k]:.1f} {_TOP:g}V{_HEIGHT - _BOTTOM:g}"/>')
        anchor = "start" if k == 0 else "end" if k == len(names) - 1 else "middle"
        place = x[k] - _LEFT * (k == 0) + _RIGHT * (k == len(names) - 1)
        for y, text in (
            (14.0, name),
            (_TOP - 6.0, f"{high[k]:.4g}"),
            (_HEIGHT - _BOTTOM + 16.0, f"{low[k]:.4g}"),
        ):
            parts.append(f'<text x="{place:.1f}" y="{y:g}" text-anchor="{anchor}">{escape(text)}</text>')
    title = escape(f"members across {', '.join(names)}")
    box = f'viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="{title}"'
    return f'<svg class="plot" {box}>{"".join(parts)}</svg>'


def _bounds(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least and the largest value on each axis, apart from each other."""
    there = np.isfinite(rows)
    low = np.where(there, rows, np.inf).min(axis=0, initial=np.inf)
    high = np.where(there, rows, -np.inf).max(axis=0, initial=-np.inf)
    low, high = np.where(np.isfinite(low), low, 0.0), np.where(np.isfinite(high), high, 1.0)
    same = high - low <= 1e-12 * np.maximum(np.abs(low), np.abs(high))
    margin = np.where(same, np.maximum(0.1 * np.abs(low), 1e-9), 0.0)
    return low - margin, high + margin


def _line(x: np.ndarray, heights: np.ndarray) -> str:
    words, pen = [], "M"
    for a, b in zip(x.tolist(), heights.tolist()):
        if not np.isfinite(b):
            pen = "M"
            continue
        words.append(f"{pen}{a:.0f} {b:.1f}")
        pen = "L"
    return "".join(words)
