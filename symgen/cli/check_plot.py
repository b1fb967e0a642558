"""The plot of `symgen check`: errors against step or tolerance, balances over time, and how differences grow."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from symgen.runtime.checks.growth import running_maximum
from symgen.runtime.checks.horizon import DIGITS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from symgen.runtime.checks.convergence import Convergence

_ROUND_OFF = 1e-17  # stands for zero on a logarithmic axis
_MOST_VARIABLES = 4


def write_plot(result: Convergence, path: Path) -> None:
    """Write the plot as PNG."""
    figure = Figure(figsize=(15, 4.4), layout="constrained")
    errors, drifts, growth = figure.subplots(1, 3)
    _errors(errors, result)
    _drifts(drifts, result)
    if result.compared is not None:
        _growth(growth, result)
    for axes in (errors, drifts, growth):
        axes.grid(alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=7, framealpha=0.6)
    figure.suptitle(f"{result.model}: {result.method}")
    figure.savefig(path, dpi=120)


def _errors(axes: Axes, result: Convergence) -> None:
    """Draw what shrinks with the step or tolerance: differences of the worst variables, balances, residuals."""
    settings = [level.setting for level in result.levels]
    if result.compared is not None:
        relative = result.compared.largest / result.compared.size
        worst = sorted(range(len(result.errors)), key=lambda j: -result.errors[j].relative)[:_MOST_VARIABLES]
        for j in worst:
            label = f"{result.errors[j].name}, from the next finer"
            axes.loglog(settings[:-1], np.maximum(relative[:, j], _ROUND_OFF), "o-", ms=4, label=label)
    energy = [max(level.energy_error, _ROUND_OFF) for level in result.levels]
    axes.loglog(settings, energy, "s--", color="0.4", label="energy balance")
    if result.constrained:
        residuals = [max(level.position_residual, _ROUND_OFF) for level in result.levels]
        axes.loglog(settings, residuals, "^:", color="0.6", label="constraint residual")
    for entry in result.momenta:
        axes.loglog(settings, np.maximum(entry.drift, _ROUND_OFF), "x:", ms=4, label=entry.name)
    axes.set_xticks(settings, [f"{setting:.3g}" for setting in settings])
    axes.minorticks_off()
    axes.set_xlabel("step [s]" if result.quantity == "step" else result.quantity)
    axes.set_ylabel("in parts of the size")


def _drifts(axes: Axes, result: Convergence) -> None:
    for level in result.levels:
        drift = np.maximum(level.energy_drift, _ROUND_OFF)
        axes.semilogy(level.times, drift, lw=1, label=f"{result.quantity} {level.setting:.2g}")
    axes.set_xlabel("t [s]")
    axes.set_ylabel("energy balance error, relative")


def _growth(axes: Axes, result: Convergence) -> None:
    """Draw the largest differences up to each time, and where digits are lost."""
    compared, growth = result.compared, result.horizon
    for level, pair in zip(result.levels, compared.relative):
        label = f"{result.quantity} {level.setting:.2g} and the next finer"
        axes.semilogy(compared.t, np.maximum(running_maximum(pair), _ROUND_OFF), lw=1, label=label)
    asked = result.levels[result.asked].setting
    axes.semilogy(
        growth.t, growth.error, "k", lw=1.6, label=f"estimated error, {result.quantity} {asked:.2g}"
    )
    for digits in DIGITS:
        t = growth.of(digits)
        if t < growth.t_end:
            axes.axhline(10.0**-digits, color="0.5", lw=0.8, ls=":")
            axes.axvline(t, color="0.5", lw=0.8, ls="--")
            axes.text(
                t, 0.98, f"{digits} digits: {t:.3g} s", transform=axes.get_xaxis_transform(), rotation=90,
                fontsize=8, ha="right", va="top",
            )  # fmt: skip
    axes.set_xlabel("t [s]")
    axes.set_ylabel("largest so far, in parts of the size")
