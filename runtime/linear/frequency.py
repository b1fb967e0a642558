"""Frequency response of a linear model: C (iω - A)⁻¹ B + D."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.linear.modes import modes_of

if TYPE_CHECKING:
    from symgen.runtime.linear.state_space import StateSpace

_POINTS = 61
_MARGIN = 10.0


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """How an output answers to a sinusoidal input in the steady state.

    Attributes
    ----------
    input, output : str
    frequencies : ndarray, shape (k,) [Hz]
    values : ndarray of complex, shape (k,)
        Amplitude of the output over that of the input, in SI units, with its phase.
    """

    input: str
    output: str
    frequencies: np.ndarray
    values: np.ndarray

    @property
    def gain(self) -> np.ndarray:
        """|H|, in SI units of the output over the input."""
        return np.abs(self.values)

    @property
    def phase(self) -> np.ndarray:
        """Phase of H [deg], without jumps by 360; negative where the output comes after the input."""
        return np.degrees(np.unwrap(np.angle(self.values)))

    def table(self, most: int = 16) -> list[str]:
        """Return frequency, gain and phase as lines of text, of not many more than `most` frequencies."""
        lines = ["    f [Hz]         gain    gain [dB]   phase [deg]"]
        with np.errstate(divide="ignore"):
            decibels = 20.0 * np.log10(self.gain)
        rows = list(zip(self.frequencies, self.gain, decibels, self.phase))
        for row in rows[:: -(-len(rows) // most)]:
            lines.append("{:10.4g} {:12.6g} {:12.4f} {:13.3f}".format(*row))
        return lines

    def to_dict(self) -> dict[str, Any]:
        """Return the response as JSON can say it."""
        return {
            "input": self.input,
            "output": self.output,
            "frequencies": self.frequencies,
            "gain": self.gain,
            "phase": self.phase,
        }


def spaced(first: float, last: float) -> np.ndarray:
    """Return frequencies from `first` to `last` [Hz], evenly spaced on a logarithmic scale."""
    return np.geomspace(first, last, _POINTS)


def around_modes(model: StateSpace) -> np.ndarray:
    """Return frequencies [Hz] from well below the slowest mode to well above the fastest."""
    known = [
        mode.natural_frequency / (2.0 * np.pi) for mode in modes_of(model) if mode.natural_frequency > 0.0
    ]
    return spaced(min(known, default=1.0) / _MARGIN, max(known, default=1.0) * _MARGIN)


def response(model: StateSpace, input: str, output: str, frequencies: Sequence[float]) -> FrequencyResponse:
    """Return the frequency response of a linear model; see `LinearModel.frequency_response`.

    Raises
    ------
    RuntimeModelError
        A name is unknown, a frequency is negative, or it is that of an undamped mode.
    """
    for name, names, what in ((input, model.inputs, "input"), (output, model.outputs, "output")):
        if name not in names:
            raise RuntimeModelError(
                f"the linear model of {model.system.name!r} has no {what} {name!r}: {nearest(name, names)}"
            )
    f = np.atleast_1d(np.asarray(frequencies, dtype=float))
    if not (np.isfinite(f).all() and (f >= 0.0).all()):
        raise RuntimeModelError("frequencies must be finite and not negative [Hz]")
    u, y, n = model.inputs.index(input), model.outputs.index(output), len(model.A)
    values = np.full(len(f), model.D[y, u], dtype=complex)
    for k, x in enumerate(f):
        try:
            values[k] += model.C[y] @ np.linalg.solve(2j * np.pi * x * np.eye(n) - model.A, model.B[:, u])
        except np.linalg.LinAlgError:
            raise RuntimeModelError(
                f"{x:g} Hz is the frequency of an undamped mode, at which the response has no bound: choose others"
            ) from None
    return FrequencyResponse(input, output, f, values)
