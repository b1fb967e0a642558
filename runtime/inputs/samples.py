"""Sampled controllers during a run: when they are called, what they see, and what they said so far."""

from __future__ import annotations

from typing import Any

import numpy as np

from symgen.runtime.inputs.controller import Controller, Signals, deviations, said_by
from symgen.runtime.inputs.given import InputFault, Pieces


class Sampler:
    """One sampled controller in one run.

    Parameters
    ----------
    controller : Controller
    signals : Signals
    inputs : tuple of int
        Numbers of the inputs that it gives.
    names : tuple of str
        Their names.
    t_start : float [s]
    values : ndarray
        Of the inputs before the first call.
    """

    def __init__(
        self,
        controller: Controller,
        signals: Signals,
        inputs: tuple[int, ...],
        names: tuple[str, ...],
        t_start: float,
        values: np.ndarray,
    ):
        self.signals, self.inputs, self._names = signals, inputs, names
        self._controller, self._t_start, self._before = controller, t_start, values
        self._deviations = deviations(controller, signals)
        self._random = np.random.default_rng(controller.seed)
        self._memory = None if controller.memory is None else np.array(controller.memory, dtype=float)
        self._n_calls = 0
        self.times: list[float] = [t_start]
        self.values: list[np.ndarray] = [np.array(values, dtype=float)]

    def anew(self) -> Sampler:
        """Return the same as it was before its first call: `memory` and noise begin again."""
        return Sampler(self._controller, self.signals, self.inputs, self._names, self._t_start, self._before)

    @property
    def next_time(self) -> float:
        """When the controller is to be called next [s]."""
        return self._t_start + self._n_calls * self._controller.period

    @property
    def memory(self) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """What it carries from call to call, as JSON can say it, and arrays; set it to go on from there."""
        kept = np.zeros(0) if self._memory is None else self._memory
        facts = {"n_calls": self._n_calls, "random": self._random.bit_generator.state}
        return facts, {"times": np.array(self.times), "values": np.array(self.values), "kept": kept.copy()}

    @memory.setter
    def memory(self, stored: tuple[dict[str, Any], dict[str, np.ndarray]]) -> None:
        facts, arrays = stored
        kept = np.zeros(0) if self._memory is None else self._memory
        times, values = arrays["times"], arrays["values"]
        if arrays["kept"].shape != kept.shape:
            raise InputFault(f"the controller of {self._what()} keeps other numbers than in the run before")
        try:
            self._random.bit_generator.state = facts["random"]
        except (TypeError, ValueError, KeyError, OverflowError):
            raise InputFault(f"the noise of the controller of {self._what()} cannot go on: damaged") from None
        self._n_calls = facts["n_calls"]
        self.times, self.values = times.tolist(), list(values.copy())
        if self._memory is not None:
            self._memory[...] = arrays["kept"]

    def fits(self, n_calls: int, t: float) -> bool:
        """Whether so many calls belong to the time `t` [s]."""
        period = self._controller.period
        return abs(t - self._t_start - (n_calls - 0.5) * period) <= (0.5 + 1e-6) * period

    def call(self, t: float, x: np.ndarray) -> None:
        """Let the controller see the signals `x` at `t`; its result holds from now on."""
        if self._deviations is not None:
            x = x + self._deviations * self._random.standard_normal(len(x))
        arguments = (t, x) if self._memory is None else (t, x, self._memory)
        try:
            result = self._controller.function(*arguments)
        except Exception as error:
            raise InputFault(f"the controller of {self._what()} {said_by(error)} at t = {t:.9g} s") from error
        values = self._checked(result, t)
        self._n_calls += 1
        if self._n_calls == 1:
            self.values[0] = values
            return
        self.times.append(t)
        self.values.append(values)

    def _checked(self, result: Any, t: float) -> np.ndarray:
        try:
            values = np.array(result, dtype=float).reshape(-1)
        except (TypeError, ValueError):
            values = np.zeros(0)
        if len(values) != len(self.inputs):
            wanted = "one number" if len(self.inputs) == 1 else f"{len(self.inputs)} numbers"
            raise InputFault(
                f"the controller of {self._what()} returned {result!r:.60} at t = {t:.9g} s: it must return {wanted}"
            )
        if not np.isfinite(values).all():
            raise InputFault(f"the controller of {self._what()} returned {result!r:.60} at t = {t:.9g} s")
        return values

    def _what(self) -> str:
        return ", ".join(map(repr, self._names))

    def pieces(self, place: int) -> Pieces:
        """Return what was said so far about one of the inputs."""
        return Pieces(np.array(self.times), np.array([values[place] for values in self.values])[:, None])
