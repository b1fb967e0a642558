"""A linear model: its matrices, with doors to what is done with them."""

from __future__ import annotations

from collections.abc import Sequence

from symgen.runtime.linear.frequency import FrequencyResponse, response
from symgen.runtime.linear.modes import Modes, modes_of
from symgen.runtime.linear.state_space import StateSpace


class LinearModel(StateSpace):
    __doc__ = StateSpace.__doc__

    def modes(self) -> Modes:
        """Return eigenvalues, frequencies, damping and shapes."""
        return modes_of(self)

    def frequency_response(self, input: str, output: str, frequencies: Sequence[float]) -> FrequencyResponse:
        """Return how an output answers to a sinusoidal input, in the steady state.

        Parameters
        ----------
        input : str
            One of `inputs`.
        output : str
            One of `outputs`.
        frequencies : sequence of float [Hz]
        """
        return response(self, input, output, frequencies)
