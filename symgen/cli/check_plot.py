"""The plot of `symgen check`: error against step or tolerance, and energy balance and drift over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from runtime.checks.convergence import Convergence

_ROUND_OFF = 1e-17  # stands for zero on a logarithmic axis


def write_plot(result: Convergence, path: Path) -> None:
    """Write the plot as PNG."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    errors, drifts = figure.subplots(1, 2)
    settings = [level.setting for level in result.levels]
    compared = [level for level in result.levels if level.difference is not None]
    errors.loglog(
        [level.setting for level in compared],
        [max(level.difference, _ROUND_OFF) for level in compared],
        "o-",
        label="difference from the next finer run",
    )
    errors.loglog(
        settings, [max(x.energy_error, _ROUND_OFF) for x in result.levels], "s--", label="energy balance"
    )
    if result.constrained:
        residuals = [max(x.position_residual, _ROUND_OFF) for x in result.levels]
        errors.loglog(settings, residuals, "^:", label="constraint residual")
    errors.set_xlabel("step [s]" if result.quantity == "step" else result.quantity)
    errors.set_ylabel("relative error")
    errors.legend()
    errors.grid(alpha=0.3)
    for level in result.levels:
        drift = np.maximum(np.abs(level.energy_drift), _ROUND_OFF)
        drifts.semilogy(level.times, drift, label=f"{result.quantity} {level.setting:.2g}")
    drifts.set_xlabel("t [s]")
    drifts.set_ylabel("energy balance error, relative")
    drifts.legend()
    drifts.grid(alpha=0.3)
    figure.suptitle(f"{result.model}: {result.method}")
    figure.savefig(path, dpi=120)
