"""Method and step of each subsystem; those whose time scales are much the same share a choice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.time_scales import time_scales
from symgen.runtime.choose import choose_constraints, choose_method, choose_step
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from symgen.runtime.checks.time_scales import TimeScales
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.subsystems.member_model import Kind
    from symgen.runtime.subsystems.settings import Settings

_LEAST_RATE = 1e-30  # [1/s]: rates are compared by their ratio


@dataclass(frozen=True)
class Choice:
    """How one subsystem is integrated.

    Attributes
    ----------
    method : Method
    step : float [s]
        0: it chooses its own.
    treatment : str
        How its constraints are treated.
    rate : float [1/s]
        Of the motion that sets its steps.
    notes : tuple of str
        Why.
    """

    method: Method
    step: float
    treatment: str
    rate: float
    notes: tuple[str, ...]


class Chooser:
    """Chooses for all members of one kind.

    Parameters
    ----------
    kind : Kind
    settings : symgen.runtime.subsystems.settings.Settings
    """

    def __init__(self, kind: Kind, settings: Settings):
        self._system, self._settings = kind.system, settings
        wanted = settings.options.constraints if kind.system.m else "auto"
        self._treatment, self._formed, _ = choose_constraints(wanted, kind.system, settings.options.method)
        self._made: dict[tuple[int, ...], tuple[Method, tuple[str, ...]]] = {}

    def choose(self, p: np.ndarray, state: np.ndarray) -> Choice:
        """Return the choice for the member with these parameters and this start."""
        settings, system = self._settings, self._system
        start = settings.options.t_start
        scales = (
            None
            if is_large(system)
            else time_scales(system, p, start, state[: system.nq], state[system.nq :])
        )
        method, notes = self._method(p, state, scales)
        step, more = choose_step(method, system, p, state, settings.options)
        rate = 1.0 / step if step else 0.0
        if scales is not None and not step:
            rate = scales.motion if method.stiff else scales.fastest
        return Choice(method, step, self._treatment, max(rate, _LEAST_RATE), (*notes, *more))

    def _method(
        self, p: np.ndarray, state: np.ndarray, scales: TimeScales | None
    ) -> tuple[Method, tuple[str, ...]]:
        """The method; members whose time scales agree within a factor of two share it."""
        if self._formed:
            return self._formed, ()
        settings, key = self._settings, ()
        if scales is not None and settings.options.method == "auto":
            rates = np.abs([scales.fastest, scales.decay, scales.motion, scales.damping])
            key = tuple(int(k) for k in np.floor(np.log2(np.maximum(rates, 1e-30))))
        if key not in self._made:
            found, why = choose_method(self._system, p, state, settings.options)
            self._made[key] = found, tuple(why)
        return self._made[key]
