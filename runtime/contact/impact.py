"""Impacts: the impulses of all stops that touch, and of the frictions that follow them."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from symgen.runtime.contact.coulomb import Levels, coulomb_forces
from symgen.runtime.contact.local_dynamics import LocalDynamics
from symgen.runtime.contact.normals import Normal

_HALVINGS = 40
_BLOWS_PER_STOP = 5000  # a mass between others ten million times as heavy strikes some thousand times
_SETTLED = 1e-12  # of the largest closing speed: what closes as slowly is at rest
_NO_GAIN = 1e-12  # of what the impulses do


def impulses(
    here: LocalDynamics,
    touching: np.ndarray,
    rubbing: np.ndarray,
    restitutions: np.ndarray,
    coefficients: np.ndarray,
    normals: Sequence[Normal],
    *,
    sequential: bool,
) -> np.ndarray:
    """Return the impulses of stops and frictions, shape (n,), after which no stop closes.

    A blow is that of all stops at once, or, where they are struck one after another, that of the one that closes
    fastest, by itself: what balls do that are not quite in touch (Newton's cradle). Either can make others close, which
    is the next blow of the same instant. Where blows become ever smaller without an end, as those one after another do
    with little restitution, what is left is one of all at once without restitution.

    Parameters
    ----------
    here : LocalDynamics
    touching : ndarray of bool
        Stops.
    rubbing : ndarray of bool
        Frictions that take part.
    restitutions, coefficients : ndarray
        Of stops, of frictions.
    normals : sequence of Normal
    sequential : bool
    """
    n_stops, total = len(touching), np.zeros(len(here.rows))
    now = copy.copy(here)
    slow = _SETTLED * np.abs(here.speeds[:n_stops]).max(initial=0.0)
    for _ in range(_BLOWS_PER_STOP * n_stops):
        closing = np.where(touching, -now.speeds[:n_stops], 0.0)
        fastest = int(np.argmax(closing))
        if closing[fastest] <= slow:
            return total
        struck, rubbed = touching, rubbing
        if sequential:
            struck = np.arange(n_stops) == fastest
            rubbed = rubbing & np.array([stop is None or stop == fastest for stop, _ in normals], dtype=bool)
        total = total + _blow(now, struck, rubbed, restitutions, coefficients, normals)
        now.speeds = here.speeds + here.compliance @ total
    return total + _blow(now, touching, rubbing, np.zeros(n_stops), coefficients, normals)


def _blow(
    here: LocalDynamics,
    touching: np.ndarray,
    rubbing: np.ndarray,
    restitutions: np.ndarray,
    coefficients: np.ndarray,
    normals: Sequence[Normal],
) -> np.ndarray:
    """Return the impulses of one blow on all that touches.

    Newton's law in Moreau's form: rates u of gaps change by impulses Λ >= 0 so that u' + e u >= 0, and is zero where
    Λ > 0 (Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; Glocker, Set-Valued Force Laws,
    2001, ch. 8). A gap that opened may close behind it. Frictions in proportion to reactions have impulses within
    Coulomb's law, which bring sliding to rest where they suffice; other frictions are bounded forces and take no part.
    With friction, Newton's law may add energy
    (Kane, Levinson, Dynamics, 1985); all restitutions are then lowered alike until it does not. Without restitution it
    never does: Λ·(u + u')/2 = Λ·u' - ΛᵀAΛ/2 and Λ·u' <= 0.
    """
    levels = Levels(np.zeros(len(rubbing)), np.where(rubbing, coefficients, 0.0), list(normals))
    acting, none = np.concatenate([touching, rubbing]), np.zeros(len(rubbing))

    def with_restitution(part: float) -> np.ndarray:
        free = here.speeds * np.concatenate([1.0 + part * restitutions, np.ones(len(rubbing))])
        return coulomb_forces(here, free, acting, none, levels, driven=False)[0]

    result = with_restitution(1.0)
    if not rubbing.any() or not _adds_energy(here, result):
        return result
    least, most, result = 0.0, 1.0, with_restitution(0.0)
    for _ in range(_HALVINGS):
        part = 0.5 * (least + most)
        tried = with_restitution(part)
        if _adds_energy(here, tried):
            most = part
        else:
            least, result = part, tried
    return result


def _adds_energy(here: LocalDynamics, x: np.ndarray) -> bool:
    change = x @ (here.speeds + 0.5 * here.compliance @ x)
    return change > _NO_GAIN * (np.abs(x) @ np.abs(here.speeds))
