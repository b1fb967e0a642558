"""A linear model: its matrices, with doors to what is done with them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from symgen.runtime.linear.frequency import FrequencyResponse, response
from symgen.runtime.linear.modes import Modes, modes_of
from symgen.runtime.linear.state_space import StateSpace
from symgen.runtime.tables import need

if TYPE_CHECKING:
    import control


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

    def to_control(self) -> control.StateSpace:
        """Return the same for python-control: A, B, C, D with the names of states, inputs and outputs.

        Raises
        ------
        symgen.runtime.tables.MissingPackage
            control is not installed.
        """
        need("control", "control", "to_control")
        import control  # takes a second, and is an extra

        return control.ss(
            self.A, self.B, self.C, self.D, states=self.states, inputs=self.inputs, outputs=self.outputs,
            name=self.system.name,
        )  # fmt: skip
