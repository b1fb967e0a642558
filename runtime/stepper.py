"""Steps for loops that live in Python: co-simulation, learning, a controller of one's own."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.errors import RuntimeModelError, UnknownNameError, nearest
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import LoopArrays

if TYPE_CHECKING:
    from symgen.runtime.options import Quantity
    from symgen.runtime.system import System

failures = Late("symgen.runtime.failures")
start_conditions = Late("symgen.runtime.constraints.start_conditions")

_STEPS_PER_CALL = 4096  # of the method; between calls Python acts on Ctrl-C


class Stepper:
    """Moves a state on by a given time, again and again, in arrays that are made once.

    Parameters
    ----------
    system : System
        Without stops, frictions that stick, and events that reset the state.
    method : str
        One that chooses its own steps.
    rtol, atol : float
    parameters : mapping of str to float or str, optional
    t : float [s]

    Attributes
    ----------
    state : ndarray, shape (nq + nv,)
        (q, v); written in place by `step`, and may be written by anyone between steps.
    inputs : ndarray, shape (number of inputs,)
        Held during a step; likewise.

    Raises
    ------
    RuntimeModelError
        The model has what needs a run, or the method has steps that are all alike.
    """

    def __init__(
        self,
        system: System,
        method: str = "dop853",
        *,
        rtol: float = 1e-8,
        atol: float = 1e-10,
        parameters: Mapping[str, Quantity] | None = None,
        t: float = 0.0,
    ):
        chosen = find_method(method)
        if not chosen.adaptive:
            raise RuntimeModelError(
                f"method {method!r} has steps of one length: name one that chooses them, as dop853"
            )
        acting = [event["name"] for event in system.events if event["action"] == "reset"]
        acting += [switch["name"] for switch in system.switches]
        if acting:
            raise RuntimeModelError(
                f"steps know no events, but model {system.name!r} has {acting[0]!r}: use run"
            )
        p = system.parameter_values(parameters)
        p, _ = start_conditions.with_found(system, p, {*(parameters or {})}, t=t)
        start = assemble(system, p, None, None, t)
        self._system, self._method, self._n = system, chosen, system.nq + system.nv
        self._arrays = LoopArrays(
            system, chosen, p, t, np.concatenate([start.q, start.v]), frame_times=np.zeros(0),
            rtol=rtol, atol=atol, with_events=False,
        )  # fmt: skip
        self.state = self._arrays.y[: self._n]
        first = len(system.parameters)
        self.inputs = self._arrays.precomputed[first : first + len(system.inputs)]
        self._names = [record["name"] for record in system.inputs]
        self._last_inputs = self.inputs.copy()

    @property
    def t(self) -> float:
        """Where the state is [s]."""
        return self._arrays.t

    @t.setter
    def t(self, t: float) -> None:
        self._arrays.control[at.T] = t

    def step(self, dt: float, inputs: Mapping[str, float] | Sequence[float] | None = None) -> np.ndarray:
        """Move the state on by `dt`.

        Parameters
        ----------
        dt : float [s]
        inputs : sequence of float in the order of the model, or mapping by name, optional
            Held during the step; those before it otherwise.

        Returns
        -------
        ndarray, shape (nq + nv,)
            `state` itself.

        Raises
        ------
        RuntimeModelError
            The method cannot go on; says why.
        """
        if isinstance(inputs, Mapping):
            for name, value in inputs.items():
                if name not in self._names:
                    raise UnknownNameError(
                        f"model {self._system.name!r} has no input {name!r}: {nearest(name, self._names)}"
                    )
                self.inputs[self._names.index(name)] = value
        elif inputs is not None:
            self.inputs[:] = inputs
        arrays = self._arrays
        stop = arrays.t + dt
        if not math.isfinite(stop):
            raise RuntimeModelError(f"a step of {dt} s from t = {arrays.t} s: give finite numbers")
        if not np.array_equal(self.inputs, self._last_inputs):
            self._last_inputs[:] = self.inputs
            self._system.update_precomputed(arrays.precomputed)
        arrays.restart(state_changed=False)
        status = at.RUNNING
        while status == at.RUNNING:
            status = arrays.advance(stop, _STEPS_PER_CALL)
        if status != at.REACHED_STOP:
            raise RuntimeModelError(failures.failure_message(status, self._system, self._method, arrays))
        return self.state
