"""Plots as inline SVG: axes with round numbers, curves by style classes, so that a page can turn light or dark."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

import numpy as np

N_COLOURS = 6
MARGIN = 0.04  # of the range, on either side: a curve along the frame is not seen
_WIDTH, _HEIGHT = 640, 300
_LEFT, _RIGHT, _TOP, _BOTTOM = 84, 14, 14, 44
_LEGEND = 18  # height of a row of the legend
_LETTER = 7.0  # width of a letter, roughly
_BUCKETS = 300  # of a curve; each keeps its lowest and its highest point
_TICKS = 6
_SMALLEST = 1e-18  # what a logarithmic axis shows for zero
_LARGEST = 1e150  # differences of larger numbers may overflow


@dataclass(frozen=True)
class Curve:
    """One curve: its name for the legend, and its points, shape (n,) each."""

    name: str
    x: np.ndarray
    y: np.ndarray


def plot(
    curves: Sequence[Curve], x_label: str, y_label: str, *, log: bool = False, ordered: bool = True
) -> str:
    """Return a plot as an SVG element.

    Parameters
    ----------
    curves : sequence of Curve
        Points that are not finite, or beyond 1e150, are left out, and interrupt their curve.
    x_label, y_label : str
        Plain text; it is escaped here, as the names of curves are.
    log : bool
        A logarithmic axis for y; values below 1e-18 are drawn there.
    ordered : bool
        Points follow each other along x, as over time; not so in a phase portrait.
    """
    curves = [Curve(c.name, _drawable(c.x), _drawable(c.y)) for c in curves]
    if log:
        curves = [Curve(c.name, c.x, np.log10(np.maximum(np.abs(c.y), _SMALLEST))) for c in curves]
    curves = [_thinned(curve, ordered) for curve in curves]
    x_low, x_high = _range([c.x for c in curves], 0.0 if ordered else MARGIN)
    y_low, y_high = _range([c.y for c in curves], MARGIN)
    legend, rows = _legend([c.name for c in curves]) if len(curves) > 1 else ("", 0)
    frame = _Frame(x_low, x_high, y_low, y_high, _TOP + rows * _LEGEND)
    parts = [_axes(frame, x_label, y_label, log), legend]
    for index, curve in enumerate(curves):
        path = _path(*frame.place(curve.x, curve.y))
        parts.append(f'<path class="curve c{index % N_COLOURS}" d="{path}"/>')
    title = escape(f"{y_label} over {x_label}")
    return (
        f'<svg class="plot" viewBox="0 0 {_WIDTH} {frame.bottom + _BOTTOM:g}" role="img" aria-label="{title}">'
        f"{''.join(parts)}</svg>"
    )


def ticks(low: float, high: float, n: int = _TICKS) -> np.ndarray:
    """Return round numbers between two bounds: multiples of 1, 2 or 5 times a power of ten, about `n` of them.

    Parameters
    ----------
    low, high : float
        low < high.
    """
    raw = (high - low) / n
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * next(factor for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= raw * (1.0 - 1e-9))
    return np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1.0) * step


@dataclass(frozen=True)
class _Frame:
    """Maps data to the plot's units."""

    x_low: float
    x_high: float
    y_low: float
    y_high: float
    top: float

    @property
    def bottom(self) -> float:
        return self.top + _HEIGHT - _TOP - _BOTTOM

    def place(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        across = _LEFT + (x - self.x_low) / (self.x_high - self.x_low) * (_WIDTH - _LEFT - _RIGHT)
        return across, self.bottom - (y - self.y_low) / (self.y_high - self.y_low) * (self.bottom - self.top)


def _drawable(values: np.ndarray) -> np.ndarray:
    return np.where(np.abs(values) < _LARGEST, values, np.nan)


def _range(arrays: Sequence[np.ndarray], margin: float) -> tuple[float, float]:
    """Return the bounds of what is to be seen and a margin, wider than a point and than its round-off."""
    values = np.concatenate([a[np.isfinite(a)] for a in arrays]) if arrays else np.zeros(0)
    if not len(values):
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    least = 1e-9 * max(abs(low), abs(high)) or 1.0
    if high - low < least:
        middle = (low + high) / 2
        return middle - max(least, 0.1 * abs(middle)), middle + max(least, 0.1 * abs(middle))
    return low - margin * (high - low), high + margin * (high - low)


def _thinned(curve: Curve, ordered: bool) -> Curve:
    """Return fewer points that look the same: of each stretch the lowest and the highest, or all in equal strides."""
    n = len(curve.x)
    if n <= 2 * _BUCKETS:
        return curve
    if not ordered:
        # A closed orbit has its lowest points anywhere; strides keep its shape.
        rows = np.unique(np.linspace(0, n - 1, 4 * _BUCKETS).astype(int))
        return Curve(curve.name, curve.x[rows], curve.y[rows])
    y = np.where(np.isfinite(curve.y), curve.y, 0.0)
    edges = np.linspace(0, n, _BUCKETS + 1).astype(int)
    kept = {0, n - 1}
    for first, last in pairwise(edges):
        kept |= {first + int(y[first:last].argmin()), first + int(y[first:last].argmax())}
    rows = np.array(sorted(kept))
    return Curve(curve.name, curve.x[rows], curve.y[rows])


def _path(x: np.ndarray, y: np.ndarray) -> str:
    """Return the points as the text of a path; a point that is not finite lifts the pen."""
    words, pen = [], "M"
    for a, b in zip(x.tolist(), y.tolist()):
        if not (np.isfinite(a) and np.isfinite(b)):
            pen = "M"
            continue
        words.append(f"{pen}{a:.1f} {b:.1f}")
        pen = "L"
    return "".join(words)


def _axes(frame: _Frame, x_label: str, y_label: str, log: bool) -> str:
    right = _WIDTH - _RIGHT
    parts = [
        f'<rect class="frame" x="{_LEFT}" y="{frame.top:g}" width="{right - _LEFT}" '
        f'height="{frame.bottom - frame.top:g}"/>'
    ]
    for value in ticks(frame.x_low, frame.x_high):
        x = float(frame.place(np.array(value), np.array(frame.y_low))[0])
        parts.append(f'<path class="grid" d="M{x:.1f} {frame.top:g}V{frame.bottom:g}"/>')
        parts.append(
            f'<text x="{x:.1f}" y="{frame.bottom + 16:g}" text-anchor="middle">{_label(value)}</text>'
        )
    for value in _decades(frame) if log else ticks(frame.y_low, frame.y_high):
        y = float(frame.place(np.array(frame.x_low), np.array(value))[1])
        text = f"1e{value:.0f}" if log and value == round(value) else _label(10.0**value if log else value)
        parts.append(f'<path class="grid" d="M{_LEFT} {y:.1f}H{right}"/>')
        parts.append(f'<text x="{_LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{text}</text>')
    middle = (frame.top + frame.bottom) / 2
    parts.append(
        f'<text x="{(_LEFT + right) / 2:g}" y="{frame.bottom + 36:g}" text-anchor="middle">{escape(x_label)}</text>'
    )
    parts.append(
        f'<text transform="translate(14 {middle:g}) rotate(-90)" text-anchor="middle">{escape(y_label)}</text>'
    )
    return "".join(parts)


def _decades(frame: _Frame) -> np.ndarray:
    """Return powers of ten between the bounds; round numbers where these are closer than two powers."""
    whole = np.arange(np.ceil(frame.y_low), np.floor(frame.y_high) + 1.0)
    if len(whole) < 2:
        return np.log10([v for v in ticks(10.0**frame.y_low, 10.0**frame.y_high) if v > 0.0])
    return whole[:: max(1, len(whole) // _TICKS)]


def _label(value: float) -> str:
    return f"{value:.6g}" if abs(value) > 0.0 else "0"


def _legend(names: Sequence[str]) -> tuple[str, int]:
    """Return the names of curves beside pieces of them, and how many rows they take."""
    parts, x, row = [], float(_LEFT), 0
    for index, name in enumerate(names):
        width = 30 + _LETTER * len(name) + 14
        if x > _LEFT and x + width > _WIDTH - _RIGHT:
            x, row = float(_LEFT), row + 1
        y = 12 + row * _LEGEND
        parts.append(f'<path class="curve c{index % N_COLOURS}" d="M{x:.1f} {y}h22"/>')
        parts.append(f'<text x="{x + 28:.1f}" y="{y + 4}">{escape(name)}</text>')
        x += width
    return "".join(parts), row + 1
