"""Whether what is held is held by forces that there are: frictions that stick within their limit, stops that press.

The equations of a form hold whatever it holds. That a friction sticks beyond its limit, or a stop pulls, no other check
sees: neither energy nor constraints nor a companion that holds the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.entry import HealthCheck, limited
from symgen.runtime.contact.forms import Forms
from symgen.runtime.contact.local_dynamics import given, normal_forces, normals_of, smooth_frictions
from symgen.runtime.contact.settings import Layout
from symgen.runtime.sampling import quasi_random, sample_rows

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_FRAMES = 100
_LIMIT = 0.02  # of the forces that there can be
_TOLERANCES = 10.0  # of the run, in a force
# Of the largest force that is solved for, in the others: a corner that nothing presses may pull by 1e-13 of it.
_ROUND_OFF = 1e4 * np.finfo(float).eps


def held(solution: Solution) -> HealthCheck:
    """Return an entry on the force that is furthest beyond what its friction or stop can bear, in parts of that."""
    forms, system = solution.forms, solution.system
    layout = Layout(system)
    settings = forms.settings[forms.index]
    holds = (settings[:, layout.closed] != 0.0).any(axis=1) | (settings[:, layout.stuck] != 0.0).any(axis=1)
    # Where forces jump a frame may have what is held until then.
    holds[:-1] &= forms.index[1:] == forms.index[:-1]
    rows = np.flatnonzero(holds)
    rows = rows[sample_rows(len(rows), _FRAMES)]
    if not len(rows):
        return limited(
            "held", 0.0, _LIMIT, "no frame has a stop that is closed or a friction that sticks", ""
        )
    t, states = solution.t[rows], solution.states[rows]
    # How well forces are known: what they are where states are off by what the tolerances of the run allow.
    n = system.nq + system.nv
    moved = states.copy()
    sizes = np.abs(states[:, :n]).max(axis=0)
    moved[:, :n] += quasi_random(len(rows) * n).reshape(-1, n) * (solution.atol + solution.rtol * sizes)
    both = _beyond(solution, np.tile(rows, 2), np.vstack([states, moved]))
    (beyond, there), (able, _), (largest, _) = (np.split(part, 2) for part in both)
    excess = beyond - _TOLERANCES * np.abs(there - beyond) - _ROUND_OFF * largest
    parts = np.where(excess > 0.0, excess / np.where(able > 0.0, able, 1.0), 0.0)
    i, j = np.unravel_index(np.argmax(parts), parts.shape)
    switch = system.switches[j]
    what = f"the force of {switch['kind']} {switch.get('circle', switch['name'])!r}"
    objection = (
        f"{what} at t = {t[i]:.6g} s is beyond what it can bear by {beyond[i, j]:.3g}: it is held by nothing; take "
        "another method, and please report this model"
    )
    if parts[i, j] > 0.0 and switch["kind"] == "friction":
        k = j - layout.n_stops
        bears, slides = (
            levels[0, k]
            for levels in _levels(solution, rows[i : i + 1], states[i : i + 1], 2 * layout.n_stops)
        )
        if bears < slides:
            objection = (
                f"{what} at t = {t[i]:.6g} s bears less while it sticks ('static'), {bears:.4g}, than while it slides, "
                f"{slides:.4g}: what comes to rest there would slip at once; give 'static' no less, or leave it out"
            )
    return limited(
        "held", float(parts[i, j]), _LIMIT, "what is held is held by forces that there are", objection
    )


def _beyond(
    solution: Solution, rows: np.ndarray, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how far each force is beyond what there can be, what there can be, and the largest force of each frame.

    The first two are by frame and switch. Of a stop, that is how hard it pulls, in parts of the largest force of a
    stop or friction there.
    """
    system, p, t = solution.system, solution.p, solution.t[rows]
    layout, settings = Layout(system), solution.forms.settings[solution.forms.index[rows]]
    forms = Forms(solution.forms.settings, solution.forms.index[rows])
    _, multipliers, forces = forms.evaluate(system, p, t, states)
    n_stops, largest = layout.n_stops, np.abs(forces).max(axis=1, keepdims=True)
    able, beyond = np.zeros_like(forces), np.zeros_like(forces)
    pulls = np.where(settings[:, layout.closed] != 0.0, -forces[:, :n_stops], 0.0)
    able[:, :n_stops] = largest
    beyond[:, :n_stops] = np.maximum(pulls, 0.0)
    sticks = (settings[:, layout.stuck] != 0.0) & ~layout.aiming(settings) & ~smooth_frictions(system)
    normals = normals_of(system)
    static = np.maximum(_levels(solution, rows, states, 2 * n_stops)[0], 0.0)
    pressed = normal_forces(normals, forces, multipliers)
    most = np.where([given(normal) for normal in normals], static, static * pressed)
    able[:, n_stops:] = most
    beyond[:, n_stops:] = np.where(sticks, layout.together(np.abs(forces[:, n_stops:])) - most, 0.0)
    return np.maximum(beyond, 0.0), able, largest


def _levels(
    solution: Solution, rows: np.ndarray, states: np.ndarray, first: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the levels of frictions (or their coefficients) while they stick and while they slide, by frame."""
    system, index = solution.system, solution.forms.index[rows]
    found = None
    for k in np.unique(index):
        own, p = index == k, solution.p.copy()
        p[system.settings_of_switches] = solution.forms.settings[k]
        levels = evaluate(system, "switches", p, solution.t[rows[own]], states[own])
        found = np.zeros((len(rows), levels.shape[1])) if found is None else found
        found[own] = levels
    return found[:, first + 2 :: 3], found[:, first + 1 :: 3]
