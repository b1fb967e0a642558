"""The figure of `symgen modes`: gain and phase over frequency."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

if TYPE_CHECKING:
    from symgen.runtime.linear.frequency import FrequencyResponse


def write_plot(model: str, response: FrequencyResponse, path: Path) -> None:
    """Write gain and phase as PNG."""
    figure = Figure(figsize=(7, 6), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    gain.loglog(response.frequencies, response.gain)
    gain.set_ylabel(f"|{response.output} / {response.input}|  [SI]")
    phase.semilogx(response.frequencies, response.phase)
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel("frequency [Hz]")
    for axes in (gain, phase):
        axes.grid(alpha=0.3, which="both")
    figure.suptitle(f"{model}: from {response.input} to {response.output}")
    figure.savefig(path, dpi=120)
