"""Accelerations, multipliers and contact forces of a run in which stops and frictions have switched."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, evaluate
from symgen.runtime.contact.local_dynamics import (
    creeping_frictions,
    given,
    normal_forces,
    normals_of,
    smooth_frictions,
    smooth_sense,
)
from symgen.runtime.contact.settings import Layout

if TYPE_CHECKING:
    from symgen.runtime.system import System


def form_of(system: System, settings: np.ndarray) -> System:
    """Return the form of a model that applies with some settings of its stops and frictions."""
    layout = Layout(system)
    held = settings[layout.closed].any() or settings[layout.stuck].any()
    return system.closed if held else system


@dataclass(frozen=True)
class Forms:
    """Which settings of stops and frictions held at each of some states.

    Attributes
    ----------
    settings : ndarray, shape (k, number of settings)
        All that occurred, in their order.
    index : ndarray of int, shape (n,)
        Which of them holds at each state.
    """

    settings: np.ndarray
    index: np.ndarray

    def evaluate(
        self, system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return accelerations, multipliers, and the forces of stops and frictions.

        Parameters
        ----------
        times : ndarray, shape (n,) [s]
        states : ndarray, shape (n, at least nq + nv)

        Returns
        -------
        accelerations : ndarray, shape (n, nv)
        multipliers : ndarray, shape (n, m)
        forces : ndarray, shape (n, number of switches)
            Along the gap, and against the sliding speed's direction where negative.
        """
        n, kinds = len(times), [switch["kind"] for switch in system.switches]
        n_stops, closed = kinds.count("stop"), system.closed
        accelerations, multipliers = np.zeros((n, system.nv)), np.zeros((n, system.m))
        forces = np.zeros((n, len(kinds)))
        own = list(closed.switched)
        others = [row for row in range(closed.m) if row not in closed.switched]
        normals, smooth, creeps = normals_of(system), smooth_frictions(system), creeping_frictions(system)
        layout = Layout(system)
        for k in np.unique(self.index):
            rows, here = np.flatnonzero(self.index == k), p.copy()
            here[system.settings_of_switches] = settings = self.settings[k]
            senses, turning = settings[layout.sense], layout.turning(settings)
            held = settings[layout.closed].any() or settings[layout.stuck].any()
            a, lam = accelerations_and_multipliers(
                closed if held else system, here, times[rows], states[rows]
            )
            accelerations[rows] = a
            multipliers[rows] = lam[:, others] if held else lam
            if held:
                # What holds the speed across an aimed direction is a force along both speeds.
                forces[rows] = lam[:, own] @ layout.turned(senses, layout.aiming(settings))
            watched = evaluate(system, "switches", here, times[rows], states[rows])[:, 2 * n_stops :]
            speeds, levels, widths = watched[:, ::3], watched[:, 1::3], watched[:, 2::3]
            senses = layout.directions(speeds, senses, turning)
            if smooth.any():
                by_speed = (speeds, layout.together(speeds), np.where(smooth, widths, 1.0), creeps)
                senses = np.where(smooth, smooth_sense(*by_speed), senses)
            pressed = normal_forces(normals, forces[rows], multipliers[rows])
            levels = np.where([given(normal) for normal in normals], levels, levels * pressed)
            forces[np.ix_(rows, np.arange(n_stops, len(kinds)))] -= senses * levels
        return accelerations, multipliers, forces
