"""The work-precision diagram: error against run time, and against evaluations of the right-hand side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

_ROUND_OFF = 1e-17  # stands for zero on a logarithmic axis
_MARKERS = "osD^v<>Ph*Xd"


def write_figure(results: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write one row of two diagrams per scene as PNG."""
    figure = Figure(figsize=(12, 4.2 * len(results)), layout="constrained")
    axes = figure.subplots(len(results), 2, squeeze=False)
    for (by_time, by_calls), result in zip(axes, results, strict=True):
        for name, (rows, style) in _curves(result).items():
            errors = [max(row["error"], _ROUND_OFF) for row in rows]
            by_time.loglog([row["seconds"] for row in rows], errors, label=name, **style)
            if all(row.get("rhs") for row in rows):
                by_calls.loglog([row["rhs"] for row in rows], errors, label=name, **style)
        by_time.set_title(f"{result['scene']}: {result['says']}", loc="left", fontsize="medium")
        by_time.set_xlabel("run time [s]")
        by_calls.set_xlabel("evaluations of the right-hand side")
        for axis in (by_time, by_calls):
            axis.set_ylabel("error at the end, relative")
            axis.grid(alpha=0.3)
        # Beside both diagrams: curves are everywhere in them.
        by_calls.legend(
            *by_time.get_legend_handles_labels(),
            fontsize="x-small",
            loc="upper left",
            bbox_to_anchor=(1.02, 1.0),
        )
    figure.savefig(path, dpi=100)


def _curves(result: Mapping[str, Any]) -> dict[str, tuple[list, dict[str, Any]]]:
    """Return the usable runs and the style of each method (solid) and each peer (dashed, grey)."""
    colours = matplotlib.colormaps["tab20"].colors
    curves = {}
    for kind, line in (("methods", "-"), ("peers", "--")):
        for k, (name, method) in enumerate(result[kind].items()):
            rows = [row for row in method.get("rows", ()) if row["error"] is not None and row["error"] < 10.0]
            colour = colours[k % len(colours)] if kind == "methods" else str(0.1 + 0.12 * (k % 6))
            style = {
                "color": colour,
                "marker": _MARKERS[k % len(_MARKERS)],
                "markersize": 3,
                "linestyle": line,
            }
            if rows:
                curves[name] = (rows, {**style, "linewidth": 1})
    return curves
