"""Work integrated once more, along the frames of a run, where the one beside the motion leaves the energy unbalanced.

Steps are as long as the motion allows. One that goes evenly, as a crank that is driven at constant speed or a block
that sticks to a plate which shakes, allows any step, while the power of what drives it changes: no step size control
looks at that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.batches import right_hand_sides
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symgen.runtime.contact.forms import Forms
    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.system import System

contact_forms = Late("symgen.runtime.contact.forms")

_NODES, _WEIGHTS = (
    np.array([-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526]),
    np.array([0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538]),
)  # of Gauss, order 8
_MOST_PARTS = 64  # of an interval between frames
_SETTLED = 1e-10  # change of the work from one refinement to the next, in parts of its size
_MOST_NUMBERS = 4_000_000
_BETTER = 0.1


def work_that_balances(
    system: System,
    p: np.ndarray,
    t: np.ndarray,
    states: np.ndarray,
    energies: np.ndarray,
    work: np.ndarray,
    forms: Forms | None = None,
    jumps: Sequence[EventRecord] = (),
) -> np.ndarray | None:
    """Return the work along the frames [J] where the energy is balanced far better with it than with `work`, else None.

    Parameters
    ----------
    t, states : ndarray
        Frames of a run.
    energies : ndarray, shape (n, 2) [J]
    work : ndarray, shape (n,) [J]
    forms : Forms, optional
        What is held of stops and frictions, by frame.
    jumps : sequence of EventRecord
        Those that changed the state, or what is held. Between frames with several, `work` stays.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        again = work_by_quadrature(system, p, t, states, work, forms, jumps)
    if again is None:
        return None
    off = [np.abs(np.ptp(energies.sum(axis=1) - done)) for done in (work, again)]
    return again if off[1] < _BETTER * off[0] else None


def work_by_quadrature(
    system: System,
    p: np.ndarray,
    t: np.ndarray,
    states: np.ndarray,
    work: np.ndarray,
    forms: Forms | None = None,
    jumps: Sequence[EventRecord] = (),
) -> np.ndarray | None:
    """Return the work done on the system up to each frame [J], shape (n,); None where that cannot be told.

    Between frames, and an instant between them at which stops and frictions switch, the motion is the polynomial
    through coordinates, rates and accelerations on both sides. Where frictions in a plane switch, only what is held
    goes evenly: while all slide, and after a slip, directions turn, which steps follow, and `work` stays. Parameters
    are those of `work_that_balances`.
    """
    h = np.diff(t)
    if len(t) < 2 or not np.all(h > 0.0) or not np.all(np.isfinite(states)):
        return None
    own, by_jumps = _pieces(system, t, states, work, forms, jumps)
    stretches = _stretches(system, p, own, forms)
    before, parts = None, 1
    while parts <= _MOST_PARTS and parts * len(_NODES) * states.size <= _MOST_NUMBERS:
        places = ((np.arange(parts)[:, None] + 0.5 * (1.0 + _NODES)) / parts).ravel()
        weights = np.tile(_WEIGHTS, parts) / (2.0 * parts)
        done = by_jumps.copy()
        for stretch in stretches:
            np.add.at(done, stretch.pieces.interval, _work_within(stretch, system, places, weights))
        along = np.append(0.0, np.cumsum(done))
        size = np.abs(done).sum()
        if before is not None and np.abs(along - before).max() <= _SETTLED * size:
            return along
        before, parts = along, 2 * parts
    return before


class _Pieces(NamedTuple):
    """Pieces of the motion without jumps: times and states on both sides, the interval between frames, the form."""

    t: np.ndarray
    t_end: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    interval: np.ndarray
    form: np.ndarray

    def of(self, chosen: np.ndarray) -> _Pieces:
        """Return some of them."""
        return _Pieces(*(values[chosen] for values in self))


class _Stretch(NamedTuple):
    """Pieces in which one form of the model holds, and how coordinates and rates change on both sides."""

    form: System
    p: np.ndarray
    pieces: _Pieces
    changes: np.ndarray
    changes_at_end: np.ndarray


def _pieces(
    system: System,
    t: np.ndarray,
    states: np.ndarray,
    work: np.ndarray,
    forms: Forms | None,
    jumps: Sequence[EventRecord],
) -> tuple[_Pieces, np.ndarray]:
    """Return the pieces, and what is done in each interval beside them: by jumps, or all where `work` stays."""
    index = np.zeros(len(t), dtype=int) if forms is None else forms.index
    times = np.array([event.t for event in jumps])
    first, last = np.searchsorted(times, t[:-1], side="left"), np.searchsorted(times, t[1:], side="right")
    even = _even(system, index, forms)
    # A run that was resumed lists the form in which it goes on once more.
    settings = np.zeros((1, 0)) if forms is None else forms.settings
    same = (settings[index[1:]] == settings[index[:-1]]).all(axis=1)
    smooth = even[:-1] & (first == last) & same
    whole = np.flatnonzero(smooth)
    found = [_Pieces(t[whole], t[whole + 1], states[whole], states[whole + 1], whole, index[whole])]
    done = np.where(smooth, 0.0, np.diff(work))
    for i in np.flatnonzero((last > first) & (even[:-1] | even[1:])):
        there = jumps[first[i] : last[i]]
        instant, work_there = there[0].t, there[0].work
        if there[-1].t > instant or not t[i] < instant < t[i + 1] or not np.isfinite(work_there):
            continue
        after = np.concatenate([there[-1].q_after, there[-1].v_after])
        if even[i]:
            before = np.concatenate([there[0].q_before, there[0].v_before])
            found.append(_one_piece(t[i], instant, states[i], before, i, index[i]))
            done[i] -= work_there - work[i]
        if even[i + 1] and not (_turns(system) and any(event.action == "slip" for event in there)):
            found.append(_one_piece(instant, t[i + 1], after, states[i + 1], i, index[i + 1]))
            done[i] -= work[i + 1] - work_there - sum(event.energy_change for event in there)
    return _Pieces(*(np.concatenate(values) for values in zip(*found, strict=True))), done


def _one_piece(
    t: float, t_end: float, begin: np.ndarray, end: np.ndarray, interval: int, form: int
) -> _Pieces:
    return _Pieces(
        np.array([t]), np.array([t_end]), begin[None], end[None], np.array([interval]), np.array([form])
    )


def _even(system: System, index: np.ndarray, forms: Forms | None) -> np.ndarray:
    """Whether the motion may go evenly about each frame: where frictions in a plane switch, some are held."""
    if forms is None:
        return np.ones(len(index), dtype=bool)
    if not _turns(system):
        return index >= 0
    held = [contact_forms.form_of(system, settings) is system.closed for settings in forms.settings]
    return (index >= 0) & np.array(held)[index]


def _turns(system: System) -> bool:
    """Whether there is a friction in a plane, whose direction turns while it slides."""
    return any("axis" in switch for switch in system.switches)


def _stretches(system: System, p: np.ndarray, pieces: _Pieces, forms: Forms | None) -> list[_Stretch]:
    """Return the pieces by what is held in them."""
    found = []
    for k in np.unique(pieces.form):
        own = pieces.of(np.flatnonzero(pieces.form == k))
        form, here = _in_form(system, p, forms, k)
        changes, at_end = (
            right_hand_sides(form, here, times, states)[:, : system.nq + system.nv]
            for times, states in ((own.t, own.begin), (own.t_end, own.end))
        )
        found.append(_Stretch(form, here, own, changes, at_end))
    return found


def _in_form(system: System, p: np.ndarray, forms: Forms | None, k: int) -> tuple[System, np.ndarray]:
    """Return the model and its parameters with what is held in one form."""
    if forms is None:
        return system, p
    here = p.copy()
    here[system.settings_of_switches] = forms.settings[k]
    return contact_forms.form_of(system, forms.settings[k]), here


def _work_within(stretch: _Stretch, system: System, places: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the work done within each piece of a stretch [J], by a quadrature on (0, 1)."""
    power, pieces = system.nq + system.nv, stretch.pieces
    h, done = pieces.t_end - pieces.t, np.zeros(len(pieces.t))
    for place, weight in zip(places, weights, strict=True):
        time, state = _between(system, stretch, place)
        done += weight * h * right_hand_sides(stretch.form, stretch.p, time, state)[:, power]
    return done


def _between(system: System, stretch: _Stretch, place: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and states at one place, from 0 to 1, of all pieces: of order 6 in q, and its derivative in v.

    Where rates are not the derivatives of coordinates, both are of order 4.
    """
    nq, n, s, pieces = system.nq, system.nq + system.nv, place, stretch.pieces
    h = (pieces.t_end - pieces.t)[:, None]
    if system.quaternions:
        return pieces.t + place * h[:, 0], _hermite(stretch, n, h, s)
    accelerations, at_end = stretch.changes[:, nq:], stretch.changes_at_end[:, nq:]
    q, v, q1, v1 = pieces.begin[:, :nq], pieces.begin[:, nq:n], pieces.end[:, :nq], pieces.end[:, nq:n]
    q0, v0, a0, rise = q, h * v, 0.5 * h * h * accelerations, q1 - q
    # What is left of q, v and a at the end, by powers 3, 4 and 5 of s.
    left = rise - v0 - a0
    slope = h * v1 - v0 - 2.0 * a0
    bend = 0.5 * h * h * at_end - a0
    c3, c4, c5 = (
        10.0 * left - 4.0 * slope + bend,
        7.0 * slope - 15.0 * left - 2.0 * bend,
        6.0 * left - 3.0 * slope + bend,
    )
    places = q0 + s * (v0 + s * (a0 + s * (c3 + s * (c4 + s * c5))))
    rates = (v0 + s * (2.0 * a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / h
    return pieces.t + place * h[:, 0], np.hstack([places, rates])


def _hermite(stretch: _Stretch, n: int, h: np.ndarray, s: float) -> np.ndarray:
    """The cubics through states and their derivatives on both sides, at one place of all pieces."""
    begin, rise = stretch.pieces.begin[:, :n], stretch.pieces.end[:, :n] - stretch.pieces.begin[:, :n]
    first, last = h * stretch.changes, h * stretch.changes_at_end
    return begin + s * (first + s * (3.0 * rise - 2.0 * first - last + s * (first + last - 2.0 * rise)))
