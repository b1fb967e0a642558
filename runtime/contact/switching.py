"""Which stops are closed and which frictions stick: found at the start and at each event, written into `p`.

What is held by forces that are allowed: stops that stay closed, frictions that stick.

Impacts: the impulses of all stops that touch, and of the frictions that follow them.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence

import numpy as np

from symgen.runtime.contact.coulomb import check_unique, coulomb_forces
from symgen.runtime.contact.instant import AHEAD, BALANCED, LIMIT_ROUNDED, ROUNDED, UNDECIDED
from symgen.runtime.contact.levels import Levels
from symgen.runtime.contact.local_dynamics import LocalDynamics, Normal, normal_forces
from symgen.runtime.contact.lone_friction import LoneFriction
from symgen.runtime.contact.onset import onset_directions
from symgen.runtime.contact.sharing import AT_LIMIT, evened
from symgen.runtime.errors import ContactError, RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.positions import Positions

_DEPENDENT = 1e-8  # of a row's compliance that is left once others are held: they hold it as well
_MOMENTS = (AHEAD, 1e-6, 1e-5)  # the same, until what is shared is beyond its limit
_MOMENTS_OF_STEP = (1e-8, 1e-7, 1e-6, 1e-5)  # of the last step, where those do not tell
_FINEST, _WIDEST = 1e-13, 0.02  # tolerance that an aim goes by, and angle [rad] that it lasts for at most
_PARALLEL, _APART = 1e-6, 1e-12  # of directions of sliding; of what moves each other
_GUIDED = 1e-12  # of the compliance along a direction: constraints hold the one across
_NEARLY = 100.0  # times the speed that is zero within the tolerances
_CHANGES = 1e-11  # of the largest acceleration, in a moment: more than round-off
_ROUNDED_LEVEL = 1e-6  # of the largest level of a friction: one that nothing presses
_FAR = 0.999  # of what a friction can take
_WITH_OTHERS = 1e-6  # of that, to its limit, where others are at theirs: a moment later tells
_ANY_ANGLE, _ANY_SPEED = 1e9, 1e150
_CLEARLY, _AT_BOUND = 2.0, 1e-6  # times the speed from which on fixed steps let a friction turn
_AT_THE_LIMIT = 1e-6  # of the accelerations that forces balance: as large as errors of the event that told so
_SAME_WAY = (
    0.9  # cosine of the angle between two answers to the same question, or two directions of one sliding
)
_ASTRAY = 2.0  # times the angle that an aim lasts for: the force across it is not that of an aim
_ALIKE = 9  # digits of forces that are the same but for round-off
_OFF_AIM = 1e-6  # of the speed along an aim: what goes across beyond that has another direction


class Holding(LoneFriction):
    """Finds what is held at the present state."""

    def _settle(self, touching: np.ndarray, struck: np.ndarray, still: np.ndarray) -> np.ndarray:
        """Find what is held by forces that are allowed, of `still` frictions those that stick.

        Gaps that are zero but for round-off (`struck`) stay closed without being pressed, too.
        What begins to slide takes its sliding force, and the rest is looked at again. Sets `senses`, `aimed` and
        `resting`.
        """
        if not self.has_frictions:
            return self._settle_stops(touching, struck)
        waiting, left = still, self._not_needed(touching)
        while True:
            here, levels = self._here(), self._levels(still)
            touching, forces, most, left = self._landed_on_few(here, touching, still, levels, left)
            bearing = touching & ~left
            acting = np.concatenate([bearing, still & (self._pressed(bearing) | ~left.any())])
            forces = _spread(here.compliance, acting[self.n_stops :] & ~self._in_circles, forces, most)
            few = self._borne_by_few(here, acting, levels, forces, same_motion=True)
            taking = self._taking_part(acting, (forces > 0.0) & ~(few > 0.0))
            forces, most, shared = self._evened(here, taking, touching, levels, few)
            accelerations = here.free + here.compliance @ forces
            sticks, onset = self._sticking(here, taking, still, levels, forces, most, shared)
            slipping = still & ~sticks
            if not (slipping & ~(acting & ~taking)[self.n_stops :]).any():
                break
            self.senses = np.where(slipping, onset, self.senses)
            self.aimed = self.aimed | (slipping & self._in_circles)
            still, left = sticks, left | (touching & ~taking[: self.n_stops])
        held = np.concatenate([touching & self._press(here, forces), sticks])
        weak = self._weak(here, touching & struck, forces, accelerations)
        pressing = self._about_to_press(here, np.concatenate([touching, sticks]), weak, forces)
        far = np.concatenate([held[: self.n_stops], self._far_from_limit(forces[self.n_stops :], most)])
        # What shares a load near its limit is held where little force does much.
        firmest = held & ~weak & shared
        order = self._in_order(most)
        groups = [held & ~weak & far & ~firmest, held & ~weak & ~far & ~firmest]
        kept = _independent(here.compliance, groups, order)
        kept = _firmest(here.compliance, kept, firmest, np.concatenate([np.ones(self.n_stops), most]))
        kept = _independent(here.compliance, [kept, *pressing], order)
        self._unpressed = (kept & weak)[: self.n_stops]
        self.resting = waiting & ~kept[self.n_stops :] & _follow(here.compliance, kept)[self.n_stops :]
        self._share(here, sticks & ~kept[self.n_stops :], forces)
        self.aimed = self.aimed & self._pressed(kept[: self.n_stops])  # a stop that takes off bears nothing
        in_touch = touching & (here.speeds[: self.n_stops] <= self._speed_tolerances(here)[: self.n_stops])
        self._check_unique(here, in_touch, kept[self.n_stops :], levels, forces)
        return self._with_aims(here, kept, levels, forces)

    def _settle_stops(self, touching: np.ndarray, struck: np.ndarray) -> np.ndarray:
        """Find which stops stay closed where there are no frictions, as `_settle` does."""
        here, levels, none = self._here(), self._levels(self.stuck), self.stuck
        touching, forces, _ = self._landed(here, touching, none, levels)
        if not touching.any():
            self._unpressed = np.zeros_like(touching)
            return touching
        accelerations = here.free + here.compliance @ forces
        forces = self._borne_by_few(here, touching, levels, forces, same_motion=True)
        held = touching & self._press(here, forces)
        weak = self._weak(here, touching & struck, forces, accelerations)
        pressing = self._about_to_press(here, touching, weak, forces)
        kept = _independent(here.compliance, [held & ~weak, *pressing], np.arange(self.n))
        self._unpressed = kept & weak
        return kept

    def _taking_part(self, acting: np.ndarray, spared: np.ndarray) -> np.ndarray:
        """Which of what acts takes a part of the load: not stops in whose place others bear it, and their frictions."""
        n_stops = self.n_stops
        stops = acting[:n_stops] & ~spared[:n_stops]
        lost = self._pressed(acting[:n_stops]) & ~self._pressed(stops)
        return np.concatenate([stops, acting[n_stops:] & ~lost])

    def _evened(
        self,
        here: LocalDynamics,
        acting: np.ndarray,
        touching: np.ndarray,
        levels: Levels,
        forces: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return forces that do the same, the levels, and whose load frictions in planes share near their limits."""
        none = np.zeros(self.n, dtype=bool)
        most = levels.at(here, forces)
        if not len(self.layout.circles):
            return forces, most, none
        given = forces
        small = UNDECIDED * here.sizes_of_free
        slides = (self._coupled & ~acting[self.n_stops :] & self._pressed(touching)).any()
        if not slides:  # whether what slides has stops that it follows depends on all
            forces = self._balanced(here, acting, forces, small)
        movable = acting & (np.abs(here.free + here.compliance @ forces) <= small)
        if slides:
            movable[: self.n_stops] = False
        found = evened(here, levels, forces, movable, self.layout.circles)
        if found is None or found[1] <= 0.0:
            return given, most, none
        movable[: self.n_stops] = False
        return found[0], levels.at(here, found[0]), movable

    def _balanced(
        self, here: LocalDynamics, acting: np.ndarray, forces: np.ndarray, small: np.ndarray
    ) -> np.ndarray:
        """Return forces that hold all that acts, however large frictions must be for that, if stops need not pull.

        Where reactions and frictions follow each other there can be two motions: one that is held, and one that slides.
        """
        pressed = acting & (np.arange(self.n) >= self.n_stops)
        pressed[: self.n_stops] = acting[: self.n_stops] & (forces[: self.n_stops] > 0.0)
        accelerations = here.free + here.compliance @ forces
        if not (np.abs(accelerations) > small)[pressed].any():
            return forces
        held, block = forces.copy(), here.compliance[np.ix_(pressed, pressed)]
        held[pressed] -= np.linalg.lstsq(block, accelerations[pressed], rcond=_DEPENDENT)[0]
        stays = (np.abs(here.free + here.compliance @ held) <= small)[acting].all()
        return held if stays and (held[: self.n_stops] >= 0.0).all() else forces

    def _in_order(self, most: np.ndarray) -> np.ndarray:
        """Return stops, then frictions, those that can bear something first: the order in which they hold."""
        idle = most <= _ROUNDED_LEVEL * most.max(initial=0.0)
        return np.concatenate([np.arange(self.n_stops), self.n_stops + np.argsort(idle, kind="stable")])

    def _far_from_limit(self, forces: np.ndarray, most: np.ndarray) -> np.ndarray:
        """Which frictions are to hold what several could: all, but those of two directions that can take no more."""
        return ~self._in_circles | (self.layout.together(np.abs(forces)) < _FAR * most)

    def _with_aims(
        self, here: LocalDynamics, kept: np.ndarray, levels: Levels, forces: np.ndarray
    ) -> np.ndarray:
        """What is held, and the speeds across aimed directions, as far as these do not follow; sets how long they are.

        An aim lasts until it would miss by what the tolerances allow: of a friction F whose direction turns at the rate
        w, sliding along a fixed one for φ/w makes an error of F φ³/(6 w) in the speed, where F/w is a speed of the
        motion. To fixed steps it is renewed until the friction no longer stops the sliding within one of them (or as
        many as the method's `aimed_steps`); and what comes to rest within one keeps its direction.
        """
        if not len(self.layout.circles):
            return kept
        rows = self.layout.circles[:, 0]
        aimed, turns = self.aimed[rows], self.turning[rows]
        turned = here.turned(self.layout.turned(self.senses, self.aimed | self.turning))
        across, own = self.n_stops + self.layout.circles[:, 1], turned.own
        guided = _follow(turned.compliance, kept)[across] | (
            own[across] <= _GUIDED * own[self.n_stops + rows]
        )
        guided &= aimed
        for k in np.flatnonzero(aimed & ~guided):
            j = across[k]
            if _follow(turned.compliance, kept)[j]:
                continue
            if self._leads(turned, kept, k):
                turned = here.turned(self.layout.turned(self.senses, self.aimed | self.turning))
                guided[k] = True
                continue
            more = kept | (np.arange(self.n) == j)
            if _follow(turned.compliance, more)[self.n_stops + rows[aimed]].any():
                raise self._without_direction(rows[aimed])
            kept = more
        step, along = self.arrays.fixed_step, self.n_stops + rows
        stopping = levels.at(here, forces)[rows] * turned.own[along]
        beginning = (turned.free + turned.compliance @ (turned.rotation @ forces))[along]
        tolerance = max(float(self.arrays.control[at.RTOL]), _FINEST)
        angles = np.full(len(rows), (6.0 * tolerance) ** (1.0 / 3.0))
        if self._begin_about_a_point(here, self.layout.circles[aimed]):
            # What begins at once is faster: the error is of second order, and the motions of others depend on it.
            faster = np.maximum(beginning, 1e-300) / np.maximum(stopping, 1e-300)
            angles = np.minimum(angles, np.sqrt(2.0 * tolerance / faster))
        angles = np.where(aimed, _WIDEST if step else np.minimum(angles, _WIDEST), 0.0)
        # What is guided needs no aim but while its speed is too low to have a direction.
        bounds = np.where(guided, _NEARLY * self._slow(here)[rows], np.where(aimed, _ANY_SPEED, 0.0))
        if step:
            stopped = stopping * step * self.arrays.aimed_steps
            angles = np.where(aimed & ~(beginning > 0.0), _ANY_ANGLE, angles)
            bounds = np.where(aimed & ~guided, _CLEARLY * stopped, np.where(turns, stopped, bounds))
        self._aims = np.column_stack([angles, bounds])
        return kept

    def _leads(self, turned: LocalDynamics, kept: np.ndarray, k: int) -> bool:
        """Whether what is held lets a friction slide in one direction only, which its aim is then.

        That of the force at the limit is known to the root of what is left to the limit.
        """
        first, second = self.layout.circles[k]
        only = _only_way(turned.compliance, kept, self.n_stops + np.array([first, second]))
        if only is None or abs(only[1]) > _WIDEST:
            return False
        along, across = only * np.sign(only[0])
        e1, e2 = self.senses[[first, second]]
        self.senses[[first, second]] = along * e1 - across * e2, along * e2 + across * e1
        return True

    def _begin_about_a_point(self, here: LocalDynamics, circles: np.ndarray) -> bool:
        """Whether frictions that move each other begin to slide in directions that are not parallel."""
        for k, one in enumerate(circles):
            for other in circles[:k]:
                across = abs(float(np.linalg.det(np.stack([self.senses[one], self.senses[other]]))))
                joint = here.compliance[np.ix_(self.n_stops + one, self.n_stops + other)]
                own = np.sqrt(
                    np.prod([here.compliance[self.n_stops + i, self.n_stops + i] for i in (one[0], other[0])])
                )
                if across > _PARALLEL and np.abs(joint).max() > _APART * own:
                    return True
        return False

    def _without_direction(self, rows: np.ndarray) -> ContactError:
        names = dict.fromkeys(self.names[self.n_stops + i] for i in rows)
        steps = "take a method that chooses its steps, as dop853, or " if self.arrays.fixed_step else ""
        return ContactError(
            f"friction in two directions ({', '.join(names)}) of one body begins to slide about a point at "
            f"t = {self.arrays.t:.9g} s, in directions that change faster than its steps follow: {steps}give these "
            "frictions 'smooth' or 'creep'"
        )

    def _aim_anew(self, fired: np.ndarray) -> np.ndarray:
        """Change how frictions with two directions slide whose events fired at speed; return whose aim is set.

        Where one turns with the motion from now on, those that began with it do.
        """
        step, bounds = self.arrays.fixed_step, self._aims[:, 1]
        set_ = np.zeros_like(self.aimed)
        here, across = self._here(), None
        for k, (i, j) in enumerate(self.layout.circles):
            if not fired[i]:
                continue
            s = here.speeds[self.n_stops + np.array([i, j])]
            if self.turning[i] and step and np.hypot(*s) <= bounds[k] * (1.0 + _AT_BOUND):
                self.senses[[i, j]], self.aimed[[i, j]], set_[[i, j]] = s / np.hypot(*s), True, True
            elif self.aimed[i] and step and self.senses[[i, j]] @ s < bounds[k] * (1.0 - _AT_BOUND):
                across = self._forces_across() if across is None else across
                e, f = self.senses[[i, j]], across[k]
                way = e - f * np.array([-e[1], e[0]])
                self.senses[[i, j]], set_[[i, j]] = way / np.hypot(*way), True
            elif self.aimed[i]:
                self.aimed[:] = set_
        return set_

    def _forces_across(self) -> np.ndarray:
        """The force that holds the speed across each aimed direction, in parts of the friction."""
        closed, arrays, layout = self.system.closed, self.arrays, self.layout
        y = arrays.y[: self.system.nq + self.system.nv]
        values = closed.kernel("rhs")(arrays.t, y, arrays.p)
        multipliers = values[len(values) - 1 - closed.m : -1]
        own = multipliers[list(closed.switched)]
        others = multipliers[[row for row in range(closed.m) if row not in closed.switched]]
        pressed = normal_forces(self.normals, own[None], others[None])[0]
        level = np.where(self._coupled, pressed, 1.0) * self._watched()[2]
        first, second = layout.circles.T
        return own[self.n_stops + second] / np.where(level[first] > 0.0, level[first], 1.0)

    def _press(self, here: LocalDynamics, forces: np.ndarray) -> np.ndarray:
        """Which stops bear a force that is more than round-off of the accelerations which it balances."""
        pull = (here.own * forces)[: self.n_stops]
        return (
            pull > ROUNDED * (here.row_sizes @ np.abs(here.accelerations(np.zeros(self.n))))[: self.n_stops]
        )

    def _landed(
        self, here: LocalDynamics, touching: np.ndarray, still: np.ndarray, levels: Levels
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return which of the stops stay in touch, the forces, and the levels of frictions.

        A gap that opens so slowly that its flight would stay below the tolerances of the run stays: there are no ever
        smaller rebounds. Points that rise at different speeds of one body that turns cannot all stick: where no forces
        hold all of them, the one that rises fastest does not stay.
        """
        touching, heights = touching.copy(), self._gap_tolerances(here)
        rising = here.speeds[: self.n_stops] > self._speed_tolerances(here)[: self.n_stops]
        while True:
            try:
                acting = touching
                if self.has_frictions:
                    acting = np.concatenate([touching, still & self._pressed(touching)])
                # Where there are such forces, they are found soon; where not, a search would take a second each time.
                forces, most = self._forces(here, acting, levels, briefly=bool((touching & rising).any()))
            except ContactError:
                if not (touching & rising).any():
                    raise
                speeds = np.where(touching & rising, here.speeds[: self.n_stops], -np.inf)
                touching[int(np.argmax(speeds))] = False
                continue
            # Left out alone, a gap that is pressed shut would fall with this acceleration.
            pull = here.own[: self.n_stops] * forces[: self.n_stops]
            flight = np.where(touching & (pull > 0.0), np.maximum(here.speeds[: self.n_stops], 0.0) ** 2, 0.0)
            excess = flight - 2.0 * pull * heights
            if not (touching & (excess > 0.0)).any():
                return touching, forces, most
            touching[int(np.argmax(np.where(touching, excess, -np.inf)))] = False

    def _sticking(
        self,
        here: LocalDynamics,
        acting: np.ndarray,
        still: np.ndarray,
        levels: Levels,
        forces: np.ndarray,
        most: np.ndarray,
        shared: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return which of the frictions that act stick, and in which direction others that are `still` begin to slide.

        One that is at its limit, but not accelerated, may be about to leave it on either side: it is judged a moment
        later. So is one that nothing presses yet. One that takes no part of the load goes where the body takes it.
        """
        together, able = self.layout.together, most
        own, pulled = forces[self.n_stops :], (here.free + here.compliance @ forces)[self.n_stops :]
        small = UNDECIDED * together(here.sizes_of_free[self.n_stops :])
        waiting, load = acting[self.n_stops :], here.free + here.compliance @ self._of_sliding(forces, still)
        # A friction that has just begun to slip is at its limit but for round-off.
        close, loads = np.where(shared[self.n_stops :], AT_LIMIT, 2.0 * LIMIT_ROUNDED), together(np.abs(own))
        bears = shared[self.n_stops :] & (most > _ROUNDED_LEVEL * most.max(initial=0.0))
        if (bears & (loads >= (1.0 - AT_LIMIT) * most)).any():
            # Those that share a load come to its limit at one instant, but for errors in parts of what each can take.
            close = np.where(shared[self.n_stops :], _WITH_OTHERS, close)
        # Beside forces that are far larger its limit is not known: what is accelerated all the same does not stick.
        terms = (np.abs(here.free) + np.abs(here.compliance) @ np.abs(forces))[self.n_stops :]
        terms += here.own[self.n_stops :] * most
        held = together(np.abs(pulled)) <= np.maximum(small, BALANCED * together(terms))
        sticks = waiting & held & (loads < (1.0 - close) * most)
        undecided = waiting & ~sticks & (together(np.abs(pulled)) <= small)
        if undecided.any():
            later, forces, most = self._soon(here, acting, forces, undecided, shared[self.n_stops :])
            soon = forces[self.n_stops :]
            sticks |= undecided & (together(np.abs(soon)) < (1.0 - 2.0 * LIMIT_ROUNDED) * most)
            if len(self.layout.circles):  # at its limit, but others hold on
                change = together(np.abs((later.free + later.compliance @ forces)[self.n_stops :]))
                sticks |= undecided & self._in_circles & (change <= small)
            own = np.where(undecided, soon, own)
        onset = np.where(own != 0.0, -np.sign(own), np.sign(pulled))
        begins = still & ~sticks & self._in_circles
        if begins.any():
            ways = self._onset_in_plane(here, acting, sticks, own, pulled, undecided)
            near = together(np.abs(pulled)) <= _AT_THE_LIMIT * together(here.sizes_of_free[self.n_stops :])
            able = np.where(waiting, np.where(near, able, -1.0), 0.0)
            # What is at the limit as well sticks only where the motion of all that are leaves it at rest.
            of_all = begins | (undecided & bears & self._in_circles)
            for which in [of_all, begins] if (of_all & sticks).any() else [begins]:
                held = np.concatenate([acting[: self.n_stops], sticks & ~which])
                if self._turn_together(here.compliance, load, held, which, able, ways):
                    break
            sticks, onset = sticks & ~which, np.where(which, ways, onset)
        return sticks, onset

    def _soon(
        self,
        here: LocalDynamics,
        acting: np.ndarray,
        forces: np.ndarray,
        undecided: np.ndarray,
        shared: np.ndarray,
    ) -> tuple[LocalDynamics, np.ndarray, np.ndarray]:
        """Return the equations a moment later, the forces and the levels there.

        Where several that share a load are close to its limit, the moment is one at which it is beyond the limit. Of a
        friction in a plane alone it is one at which its force is on one side: what moves, or nothing, does not tell how
        slowly the load changes, but the step does in which it came to the limit.
        """
        small = UNDECIDED * here.sizes_of_free[self.n_stops :]
        sharing, alone = undecided & shared, undecided & self._in_circles & ~shared
        moments = [(ahead, False) for ahead in _MOMENTS]
        moments += [(ahead, True) for ahead in _MOMENTS_OF_STEP] if alone.any() else []
        for ahead, of_step in moments:
            later, found, most = self._forces_later(here, acting, forces, ahead, of_step=of_step)
            change = np.abs((later.free + later.compliance @ found)[self.n_stops :]) > small
            loads = self.layout.together(np.abs(found[self.n_stops :]))
            told = (change & (sharing | alone)) | (alone & (loads < (1.0 - 2.0 * LIMIT_ROUNDED) * most))
            if told.any() or not (sharing | alone).any():
                break
        return later, found, most

    def _forces_later(
        self,
        here: LocalDynamics,
        acting: np.ndarray,
        forces: np.ndarray,
        ahead: float = AHEAD,
        *,
        of_step: bool = False,
    ) -> tuple[LocalDynamics, np.ndarray, np.ndarray]:
        """Return the equations a moment later, the forces and the levels there; those of now where there are none.

        Where points still rise, their speeds part in a moment, and no forces hold all of them there.
        """
        later, still = self._later(here, forces, ahead, of_step=of_step), acting[self.n_stops :]
        try:
            return later, *self._forces(later, acting, self._levels(still, later))
        except ContactError:
            return here, forces, self._levels(still).at(here, forces)

    def _onset_in_plane(
        self,
        here: LocalDynamics,
        acting: np.ndarray,
        sticks: np.ndarray,
        own: np.ndarray,
        pulled: np.ndarray,
        undecided: np.ndarray,
    ) -> np.ndarray:
        """The unit vectors along which frictions with two directions begin to slide.

        A sliding friction is less than one that sticks: its direction follows from what it is then.
        """
        sliding = own
        if (acting[self.n_stops :] & ~sticks).any():
            sliding = self._forces(here, acting, self._levels(sticks))[0][self.n_stops :]
        most = self._levels(sticks).linear(here, np.zeros(self.n), 1.0)[0]
        found = np.where(undecided | (sliding == 0.0), own, sliding) if most.any() else own
        sizes = self.layout.together(np.abs(found))
        ways = -found / np.where(sizes > 0.0, sizes, 1.0)
        speeds = self.layout.together(np.abs(pulled))
        return np.where(sizes > 0.0, ways, pulled / np.where(speeds > 0.0, speeds, 1.0))

    def _of_sliding(self, forces: np.ndarray, still: np.ndarray) -> np.ndarray:
        """Return what frictions that slide already have of some forces: only those that follow reactions have any."""
        found = forces.copy()
        found[: self.n_stops], found[self.n_stops :][still] = 0.0, 0.0
        return found

    def _turn_together(
        self,
        compliance: np.ndarray,
        load: np.ndarray,
        held: np.ndarray,
        begins: np.ndarray,
        able: np.ndarray,
        ways: np.ndarray,
    ) -> bool:
        """Change directions of sliding in planes to those that fit to each other, and to what sticks.

        Returns whether there are such; without, only those that what sticks leaves one direction are changed.

        Parameters
        ----------
        compliance : ndarray, shape (n, n)
        load : ndarray, shape (n,)
            Accelerations by all but the forces of stops and of frictions that are still at rest.
        held : ndarray of bool, shape (n,)
            Stops that bear, frictions that stick.
        begins : ndarray of bool, shape (number of frictions,)
            Which begin to slide.
        able : ndarray, shape (number of frictions,) [N]
            What frictions can take where forces are in balance but for round-off; negative elsewhere, 0 of those that
            take no part.
        ways : ndarray, shape (number of frictions,)
            The directions.
        """
        circles = self.layout.circles
        pairs = circles[begins[circles[:, 0]]]
        held = _independent(compliance, [held], np.arange(self.n))
        for pair in pairs:
            only = _only_way(compliance, held, self.n_stops + pair)
            if only is not None:  # as about a point of the body that sticks
                ways[pair] = only * np.sign(only @ ways[pair] or 1.0)
        able = able[pairs[:, 0]]
        if (able < 0.0).any() or not (able > 0.0).any():
            return False
        found = onset_directions(compliance, load, held, self.n_stops + pairs, able)
        # What takes nothing yet follows the motion of the others.
        if found is None or not (np.einsum("kr,kr->k", found, ways[pairs]) > _SAME_WAY)[able > 0.0].all():
            return False
        ways[pairs] = np.where(found.any(axis=1)[:, None], found, ways[pairs])
        return True

    def _weak(
        self, here: LocalDynamics, touching: np.ndarray, forces: np.ndarray, accelerations: np.ndarray
    ) -> np.ndarray:
        """Which stops neither press nor open now."""
        small = UNDECIDED * here.sizes_of_free
        weak = np.zeros(self.n, dtype=bool)
        weak[: self.n_stops] = touching & (np.abs(here.own * forces) <= small)[: self.n_stops]
        return weak & (np.abs(accelerations) <= small) & (np.abs(here.speeds) <= self._speed_tolerances(here))

    def _not_needed(self, touching: np.ndarray) -> np.ndarray:
        """Which stops that touch are open, and what is closed keeps from closing further."""
        closed = np.concatenate([touching & self.closed, np.zeros(self.n - self.n_stops, dtype=bool)])
        return touching & ~self.closed & _follow(self._here().compliance, closed)[: self.n_stops]

    def _landed_on_few(
        self, here: LocalDynamics, touching: np.ndarray, still: np.ndarray, levels: Levels, left: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return what `_landed` does, and which stops are left out because others bear the load.

        Where something slides, how a load is shared, which rigid bodies leave open, tells how much it rubs where, and
        so the motion. It is borne by the stops that bear it already, all but those `left`, as long as these can; then
        others take the place of those of them that bear nothing any more, so that forces do not jump.
        """
        if not (self._coupled & self._pressed(touching) & ~still).any():
            return *self._landed(here, touching, still, levels), np.zeros_like(touching)
        small, none = UNDECIDED * here.sizes_of_free, np.zeros_like(left)
        tries = [left, none] if left.any() else [none]
        while tries:
            out = tries.pop(0)
            try:
                landed, forces, _ = self._landed(here, touching & ~out, still, levels)
            except ContactError:
                if tries:
                    continue
                raise
            if not ((here.free + here.compliance @ forces < -small)[: self.n_stops] & out).any():
                break
            if out is left and (idle := landed & ~self._press(here, forces)).any():
                tries.insert(0, idle)
        few = self._borne_by_few(here, np.concatenate([landed, still]), levels, forces, same_motion=False)
        return landed | out, few, levels.at(here, few), out | ((forces > 0.0) & ~(few > 0.0))[: self.n_stops]

    def _borne_by_few(
        self,
        here: LocalDynamics,
        acting: np.ndarray,
        levels: Levels,
        forces: np.ndarray,
        *,
        same_motion: bool,
        bearing: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return forces by Coulomb's law with no more stops that press than determine the motion.

        Of stops that depend on each other only some can be closed, and not any: where the load is outside of these they
        would pull. One after another is left out, those that bear nothing so far first, then those that bear least, as
        long as what is left holds the load: with frictions far from their limits there always is one (Carathéodory's
        theorem).

        Parameters
        ----------
        same_motion : bool
            Whether the motion must be that of `forces`. Where something slides, how a load is shared, which rigid
            bodies leave open, tells how much it rubs where: any motion by the law is right then.
        bearing : ndarray of bool, optional
            Which stops bear the load so far; those that are closed if not given.
        """
        small = UNDECIDED * here.sizes_of_free
        bearing = self.closed if bearing is None else bearing
        while True:
            pressed = acting & (forces > 0.0) & (np.arange(self.n) < self.n_stops)
            if np.count_nonzero(pressed) < 2 and not (here.own[pressed] <= 0.0).any():
                return forces  # one alone does not follow from others
            if not (pressed & ~_independent(here.compliance, [pressed], np.arange(self.n))).any():
                return forces
            rows = np.flatnonzero(pressed)
            # What is alike but for round-off is left out in one order, whatever the units are.
            alike = np.round(forces[rows] / forces[rows].max(), _ALIKE)
            for i in rows[np.lexsort((-rows, alike, bearing[rows]))]:
                rest = acting & (pressed | (np.arange(self.n) >= self.n_stops)) & (np.arange(self.n) != i)
                rest[self.n_stops :] &= self._pressed(rest[: self.n_stops])
                found = self._holding(here, rest, acting, levels) if same_motion else None
                found = self._forces_of(here, rest, levels) if found is None else found
                if found is None:
                    continue
                after = here.free + here.compliance @ found
                falls = (after < -small)[: self.n_stops] & acting[: self.n_stops]
                stays = (np.abs(after - here.free - here.compliance @ forces) <= small).all()
                stays = stays or (np.abs(after) <= small)[acting].all()
                if stays if same_motion else not falls.any():
                    forces = found
                    break
            else:
                return forces

    def _forces_of(self, here: LocalDynamics, acting: np.ndarray, levels: Levels) -> np.ndarray | None:
        """Return the forces of what acts, None where there are none."""
        try:
            return self._forces(here, acting, levels)[0]
        except ContactError:
            return None

    def _holding(
        self, here: LocalDynamics, some: np.ndarray, acting: np.ndarray, levels: Levels
    ) -> np.ndarray | None:
        """Return forces of some that hold all that acts, up to the limit of frictions in planes; None without any.

        At the limit Newton's method for all forces at once goes astray, and where reactions and frictions follow each
        other, what slides by all stops may be held by few.
        """
        if not len(self.layout.circles) or not (self._in_circles & some[self.n_stops :]).any():
            return None
        forces = np.zeros(self.n)
        block = here.compliance[np.ix_(some, some)]
        forces[some] = -np.linalg.lstsq(block, here.free[some], rcond=_DEPENDENT)[0]
        small = UNDECIDED * here.sizes_of_free
        if (np.abs(here.free + here.compliance @ forces) > small)[acting].any():
            return None
        if (forces[: self.n_stops] < 0.0).any():
            return None
        found = evened(here, levels, forces, some, self.layout.circles)
        if found is not None:
            return found[0] if found[1] > -_AT_THE_LIMIT else None
        loads = self.layout.together(np.abs(forces[self.n_stops :]))
        return forces if (loads <= (1.0 + _AT_THE_LIMIT) * levels.at(here, forces)).all() else None

    def _about_to_press(
        self, here: LocalDynamics, acting: np.ndarray, weak: np.ndarray, forces: np.ndarray
    ) -> list[np.ndarray]:
        """Which of the `weak` stops press a moment later, and which neither press nor open clearly there."""
        if not weak.any():
            return []
        later, found, _ = self._forces_later(here, acting, forces)
        levels, bearing = self._levels(acting[self.n_stops :], later), self._press(here, forces)
        bearing &= ~weak[: self.n_stops]
        found = self._borne_by_few(later, acting, levels, found, same_motion=False, bearing=bearing)
        opening = later.free + later.compliance @ found - later.own * found
        opening -= here.free + here.compliance @ forces - here.own * forces
        clear = np.abs(opening) > _CHANGES * here.sizes_of_free
        return [weak & clear & (opening < 0.0), weak & ~clear & (later.free <= here.free)]

    def _share(self, here: LocalDynamics, others: np.ndarray, forces: np.ndarray) -> None:
        """Let frictions whose motion others hold already keep the part of the force that they have."""
        if not others.any():
            return
        sliding = self._levels(np.zeros_like(others)).at(here, forces)
        # What nothing presses but round-off takes no part of the load: it would be a large one of what presses later.
        bears = sliding > _ROUNDED_LEVEL * sliding.max(initial=0.0)
        shares = -forces[self.n_stops :] / np.where(bears, sliding, np.inf)
        self.senses = np.where(others, shares, self.senses)

    def _led_onward(self, here: LocalDynamics) -> np.ndarray:
        """In which direction frictions whose sliding is prescribed leave a place of rest."""
        accelerations = np.abs(here.accelerations(np.zeros(self.n)))
        small = UNDECIDED * np.where(here.reached, accelerations, 0.0).max(axis=1, initial=0.0)
        return np.where(np.abs(here.free) > small, np.sign(here.free), 0.0)[self.n_stops :]

    def _check_unique(
        self, here: LocalDynamics, touching: np.ndarray, stuck: np.ndarray, levels: Levels, forces: np.ndarray
    ) -> None:
        if not self._coupled.any():
            return
        directions = self._directions(here)
        self._solved(lambda: check_unique(here, touching, stuck, directions, levels, forces))


def _spread(compliance: np.ndarray, sharing: np.ndarray, forces: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Return forces that do the same, but that `sharing` frictions share in parts of what each can take.

    What the complementarity problem finds are corners: of two frictions that hold a body together one may be at its
    limit, and then seems to slide.
    """
    first = len(forces) - len(most)
    rows = first + np.flatnonzero(sharing & (most > 0.0))
    if len(rows) < 2:
        return forces
    able = most[rows - first]
    scale = np.sqrt(np.maximum(np.diag(compliance), 1e-300))
    effects = compliance[:, rows] * able / scale[:, None]
    parts = np.linalg.lstsq(effects, effects @ (forces[rows] / able), rcond=_DEPENDENT)[0]
    if np.abs(parts).max() >= 1.0:
        return forces
    spread = forces.copy()
    spread[rows] = able * parts
    return spread


def _independent(compliance: np.ndarray, groups: list[np.ndarray], order: np.ndarray) -> np.ndarray:
    """Return the rows of some groups, first ones first and each in some order, that do not follow from those before.

    A table on four feet stands on three of them; the fourth is taken up when one of these lets go.
    """
    kept = np.zeros(len(compliance), dtype=bool)
    for group in groups:
        for i in order[group[order]]:
            kept[i] = not _follow(compliance, kept)[i]
    return kept


def _firmest(compliance: np.ndarray, kept: np.ndarray, group: np.ndarray, able: np.ndarray) -> np.ndarray:
    """Return `kept` and the rows of a group that do not follow from it.

    Each is the one that follows least, times the square of the force that it is `able` to take.
    """
    kept = kept.copy()
    own = np.maximum(np.diag(compliance), 1e-300)
    while True:
        part = np.where(group & ~kept, _left(compliance, kept) / own, 0.0)
        best = int(np.argmax(part * np.where(part > _DEPENDENT, able, 0.0) ** 2))
        if part[best] <= _DEPENDENT:
            return kept
        kept[best] = True


def _follow(compliance: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return which rows do not move where those that are `kept` do not."""
    return _left(compliance, kept) <= _DEPENDENT * np.diag(compliance)


def _left(compliance: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return how easily each row still moves where those that are `kept` do not."""
    own, cross = np.diag(compliance), compliance[kept]
    if not kept.any():
        return own
    return own - (cross * np.linalg.solve(compliance[np.ix_(kept, kept)], cross)).sum(axis=0)


def _only_way(compliance: np.ndarray, kept: np.ndarray, pair: np.ndarray) -> np.ndarray | None:
    """Return the unit vector along which two rows still move where those that are `kept` do not; None if any way."""
    own, cross = compliance[np.ix_(pair, pair)], compliance[np.ix_(kept, pair)]
    left = own - cross.T @ np.linalg.solve(compliance[np.ix_(kept, kept)], cross) if kept.any() else own
    values, ways = np.linalg.eigh(left)
    moves = values[1] > _DEPENDENT * own.trace()
    return ways[:, 1] if moves and values[0] <= _DEPENDENT * values[1] else None


_HALVINGS = 40
_BLOWS_PER_STOP = 5000  # a mass between others ten million times as heavy strikes some thousand times
_SETTLED = 1e-12  # of the largest closing speed: what closes as slowly is at rest
_NO_SPEED = 1e-15  # of all that moves where it touches: what is left of gaps that were brought to rest before
_NO_GAIN = 1e-12  # of what the impulses do


def impulses(
    here: LocalDynamics,
    touching: np.ndarray,
    rubbing: np.ndarray,
    restitutions: np.ndarray,
    coefficients: np.ndarray,
    normals: Sequence[Normal],
    circles: np.ndarray,
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
    circles : ndarray of int, shape (n, 2)
        Frictions that are the directions of one.
    sequential : bool
    """
    n_stops, total, compliance = len(touching), np.zeros(len(here.rows)), here.compliance
    now = copy.copy(here)  # behind that: what is solved for one is solved for both
    rates = np.abs(here.state[-here.rows.shape[1] :])
    slow = _SETTLED * np.abs(here.speeds[:n_stops]).max(initial=0.0)
    slow += _NO_SPEED * (here.row_sizes @ rates).max(initial=0.0)
    for _ in range(_BLOWS_PER_STOP * n_stops):
        closing = np.where(touching, -now.speeds[:n_stops], 0.0)
        fastest = int(np.argmax(closing))
        if closing[fastest] <= slow:
            return total
        struck, rubbed = touching, rubbing
        if sequential:
            struck = np.arange(n_stops) == fastest
            rubbed = rubbing & np.array([stop is None or stop == fastest for stop, _ in normals], dtype=bool)
        total = total + _blow(now, struck, rubbed, restitutions, coefficients, normals, circles)
        now.speeds = here.speeds + compliance @ total
    return total + _blow(now, touching, rubbing, np.zeros(n_stops), coefficients, normals, circles)


def _blow(
    here: LocalDynamics,
    touching: np.ndarray,
    rubbing: np.ndarray,
    restitutions: np.ndarray,
    coefficients: np.ndarray,
    normals: Sequence[Normal],
    circles: np.ndarray,
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
    i = int(np.argmax(touching))
    if touching.sum() == 1 and not (rubbing.any() or here.led[i]):  # as machine code has it, to the last bit
        found = np.zeros(len(here.rows))
        found[i] = max(-(1.0 + restitutions[i]) * here.speeds[i] / here.compliance[i, i], 0.0)
        return found
    levels = Levels(np.zeros(len(rubbing)), np.where(rubbing, coefficients, 0.0), list(normals))
    acting, none = np.concatenate([touching, rubbing]), np.zeros(len(rubbing))

    def with_restitution(part: float) -> np.ndarray:
        free = here.speeds * np.concatenate([1.0 + part * restitutions, np.ones(len(rubbing))])
        return coulomb_forces(here, free, acting, none, levels, circles=circles, driven=False)[0]

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


# What a start, or what a reset leads to, may be inside a stop, as an error of coordinates in parts of their sizes.
_VIOLATED = 1e-6
_MOST_MOVES = 5  # of Newton's method out of stops
_WITHIN_STEPS = 2.0  # the pull may grow while a gap opens
_STEPS_BEFORE_REST = 1e3
_SHORTENED = 1e-2  # of the mean step so far: a step that a turning direction has shortened
_AT_REST = 1e-6  # of what a sliding speed changes by in a step: at its event it is zero but for round-off
_LEAST_PART = 1e-6  # of the largest force: as small a one may let go soon
_FAR_FROM_ZERO = 1e3  # times what is zero within the tolerances, as it was when that was asked last


class Switching(Holding):
    """Acts on the events of stops and frictions."""

    def start(self) -> None:
        """Find what holds at the start, and act on impacts there.

        Of stops that could share a load in many ways, those that `p` says to be closed bear it: where a run is taken up
        again in its middle, it goes on as it did.

        Raises
        ------
        RuntimeModelError
            A stop is violated.
        """
        self.closed = self.arrays.p[self._places_of_settings][self.layout.closed] != 0.0
        gaps = self._brought_out(
            lambda name, gap: RuntimeModelError(
                f"stop {name!r} is violated at the start: its gap is {gap:.6g}; give a start at which it is zero or "
                f"more, or guesses in place of starts, and closed = [{name!r}] in [start]"
            )
        )
        here = self._here()
        self._decide(gaps <= self._gap_tolerances(here), gaps <= self._round_off(here), self.stuck)

    def is_untouched(self, values: np.ndarray) -> bool:
        """Whether all that moves and all that is held is too far from where it changes for a jump of forces to matter.

        Where frictions do not follow reactions, there is one answer to what is held, and what presses and what can take
        more behind the jump is one.

        Parameters
        ----------
        values : ndarray, shape (n,)
            Of the events, behind the jump: gaps, and speeds at which frictions slide; forces of closed stops, and what
            frictions that stick can still take.
        """
        if self._zero is None or len(self.layout.circles) or self.any_resting:
            return False
        if not self.any_held:
            return self._moves_clearly(values.tolist())
        sizes = np.concatenate([values[: self.n_stops], np.abs(values[self.n_stops :])])
        smooth = np.concatenate([np.zeros(self.n_stops, dtype=bool), self._smooth])
        zero, held = _FAR_FROM_ZERO * self._zero, self.held
        if self._coupled.any() or (self._unpressed & self.closed).any() or not np.isfinite(values).all():
            return False
        sizes = np.where(held, values, sizes)
        least = np.maximum(_FAR_FROM_ZERO * self._weak_forces(), _LEAST_PART * sizes[held].max())
        zero = np.where(held, least, zero)
        return bool((smooth | (sizes > zero)).all())

    def _moves_clearly(self, values: list[float]) -> bool:
        """Whether all gaps are open and all frictions slide, where nothing is held; arrays of so few take longer."""
        zero, sliding = self._far_from_zero, values[self.n_stops :]
        for value, least in zip(values[: self.n_stops], zero):
            if not value > least:
                return False
        for speed, least, smooth in zip(sliding, zero[self.n_stops :], self._smooth):
            if not (abs(speed) > least or smooth):
                return False
        return True

    def _weak_forces(self) -> np.ndarray:
        """Which forces of stops and frictions do not tell whether these stay held, by what held now when last asked."""
        settings = self.settings.tobytes()
        if self._last_weak is None or self._last_weak[0] != settings:
            here = self._here()
            balanced = here.row_sizes @ np.abs(here.accelerations(np.zeros(self.n)))
            weak = np.maximum(UNDECIDED * here.sizes_of_free, ROUNDED * balanced)
            self._last_weak = settings, weak / np.maximum(here.own, 1e-300)
        return self._last_weak[1]

    def act(self, fired: np.ndarray, *, is_reset: bool = False) -> list[tuple[int, str]]:
        """Act on the stops and frictions whose events fired, and on all that they touch.

        Parameters
        ----------
        fired : ndarray of int
            Their indices among the switches. With none of them, forces have jumped: what is held by now follows anew.
        is_reset : bool
            Whether the state has just been reset, and may be anywhere: a closed stop may be open now.

        Returns
        -------
        list of (int, str)
            The indices of those that fired, or else of those that changed or were struck, and what became of each:
            impact, release, stick, slip or turn.
        """
        if len(fired) == 1 and (what := self._settle_alone(int(fired[0]))):
            return [(int(fired[0]), what)]
        is_fired = np.zeros(self.n, dtype=bool)
        is_fired[fired] = True
        were_held, ways = self._at_rest, self.senses.copy()
        self._end_unseen_flights(is_fired[: self.n_stops])
        gaps = self._brought_out(self._led_into) if is_reset else self._watched()[0]
        here = self._here()
        closed = self.closed
        if is_reset:
            closed = closed & (gaps <= self._gap_tolerances(here))
        struck = closed | is_fired[: self.n_stops] | (gaps <= self._round_off(here))
        near = struck | (gaps <= self._gap_tolerances(here))
        self._zero = np.concatenate([self._gap_tolerances(here), self._slow(here)])
        self._far_from_zero = (_FAR_FROM_ZERO * self._zero).tolist()
        blown = np.concatenate([struck & self._closing(here), np.zeros(self.n - self.n_stops, dtype=bool)])
        if self.has_frictions:
            fired_frictions = self._of_either(is_fired[self.n_stops :])
            came_to_rest = fired_frictions & self._came_to_rest(here) & ~self._aims_ended(is_fired)
            if came_to_rest.any():
                came_to_rest |= self._almost_at_rest(here)
            sticking = self.stuck & ~self.aimed
            aims = self._aim_anew(fired_frictions & ~came_to_rest)
            self._decide(near, struck, sticking | came_to_rest, aims)
        else:
            came_to_rest = self.stuck
            self._decide_on_stops(near, struck, np.zeros(self.n_stops, dtype=bool))
        with_others = np.concatenate([np.zeros(self.n_stops, dtype=bool), came_to_rest & self.stuck])
        changed = (were_held != self._at_rest) | blown
        told = np.flatnonzero(is_fired | with_others if len(fired) else changed)
        came_to_rest = came_to_rest & ~self._keep_their_way(ways)
        became = [(int(i), self._became(i, were_held[i], blown[i], came_to_rest)) for i in told]
        return [x for k, x in enumerate(became) if x[1] and self.names[x[0]] not in self._told(became[:k])]

    def _led_into(self, name: str, gap: float) -> ContactError:
        return ContactError(
            f"a reset at t = {self.arrays.t:.9g} s leads into stop {name!r}: its gap is {gap:.6g} behind it; reset "
            "coordinates to where it is zero or more"
        )

    def _brought_out(self, refused: Callable[[str, float], Exception]) -> np.ndarray:
        """Return gaps, once the state is out of stops that it is inside of by an error of numbers that people write.

        What is within the tolerances of the run stays. Else it moves as little as the masses allow, as in assembly, and
        `moved` names what did.

        Parameters
        ----------
        refused : callable
            The error of a stop, by its name and gap, that the state is farther inside of.
        """
        nq, arrays = self.system.nq, self.arrays
        gaps, here = self._watched()[0], self._here()
        coordinates = here.row_sums[: self.n_stops] * here.sizes[: self.n_stops]
        for i in np.flatnonzero(gaps < -_VIOLATED * coordinates):
            raise refused(self.names[i], float(gaps[i]))
        before, inside = arrays.y[:nq].copy(), np.zeros(self.n, dtype=bool)
        deep = gaps < -self._gap_tolerances(here)
        for _ in range(_MOST_MOVES):
            if not deep.any():
                break
            inside[: self.n_stops] |= deep
            behind = np.concatenate([gaps, np.zeros(self.n - self.n_stops)])
            arrays.y[:nq] = Positions(self.system).retract(arrays.y[:nq], here.holding(inside, behind))
            if self.system.m or self.system.quaternions:
                arrays.project()
            gaps, here = self._watched()[0], self._here()
            deep = gaps < -self._round_off(here)
        self.moved = [
            (self.system.coordinates[k]["name"], float(before[k]), float(arrays.y[k]))
            for k in np.flatnonzero(arrays.y[:nq] != before)
        ]
        return gaps

    def _keep_their_way(self, before: np.ndarray) -> np.ndarray:
        """Which frictions in planes slide in the direction of some time before."""
        found = np.zeros_like(self.stuck)
        for pair in self.layout.circles:
            found[pair] = before[pair] @ self.senses[pair] > _SAME_WAY
        return found

    def _told(self, became: list[tuple[int, str]]) -> set[str]:
        return {self.names[i] for i, what in became if what}

    def _of_either(self, which: np.ndarray) -> np.ndarray:
        """Whether it is true of a friction, or of the other direction of one that has two."""
        found = which.copy()
        found[self.layout.circles] = which[self.layout.circles].any(axis=1)[:, None]
        return found

    def _end_unseen_flights(self, fired: np.ndarray) -> None:
        """Take the speed from gaps that opened by their rates, but whose next step closes them from its start.

        To a method of order 1 whose step goes where its end moves, a rise that ends within the step is none: it would
        fall on the stop for ever.
        """
        here = self._here()
        rising = here.speeds[: self.n_stops]
        unseen = fired & ~self.closed & (rising > self._speed_tolerances(here)[: self.n_stops])
        if not unseen.any():
            return
        unseen &= rising < _WITHIN_STEPS * -here.free[: self.n_stops] * float(self.arrays.control[at.H])
        if unseen.any():
            nq, n = self.system.nq, self.system.nq + self.system.nv
            rows = np.concatenate([unseen, np.zeros(self.n - self.n_stops, dtype=bool)])
            self.arrays.y[nq:n] += here.holding(rows, here.speeds)

    def _became(self, i: int, was_held: bool, is_blown: bool, came_to_rest: np.ndarray) -> str:
        """What became of a stop or a friction.

        Nothing where friction goes on to follow a direction that has turned, or shares a load anew, and where the force
        of a closed stop is zero but does not yet tell that it opens.
        """
        if i < self.n_stops:
            if is_blown or not was_held:
                return "impact"
            return "" if self.closed[i] else "release"
        if was_held:
            shared_anew = self._in_circles[i - self.n_stops] and self._at_rest[i]
            return "" if shared_anew else "slip"
        if self._at_rest[i]:
            return "stick"
        on_its_way = self._in_circles[i - self.n_stops] and not came_to_rest[i - self.n_stops]
        return "" if on_its_way else "turn"

    def objection(self) -> str:
        """Why there is no going on from here: what `_paradox` says, or a direction that turns too fast."""
        return self._paradox() or self._turns_too_fast()

    def _turns_too_fast(self) -> str:
        """Which friction in a plane is so near to rest that its direction turns in the last steps."""
        if not self.turning.any():
            return ""
        here = self._here()
        try:
            pulled = self.layout.together(np.abs(here.free[self.n_stops :]))
        except np.linalg.LinAlgError:  # not a number: another reason to stop
            return ""
        rest = self._sliding(here) / np.maximum(pulled, 1e-300)  # [s]
        arrays = self.arrays
        mean = (arrays.t - arrays.control[at.T_START]) / max(int(arrays.counters[at.STEPS]), 1)
        near = self.turning & (rest <= _STEPS_BEFORE_REST * arrays.h_last)
        if not near.any() or arrays.h_last > _SHORTENED * mean:
            return ""
        k = int(np.flatnonzero(near)[0])
        name, t, speed = self.names[self.n_stops + k], self.arrays.t, self._sliding(here)[k]
        return (
            f"friction in two directions ({name}) is almost at rest at t = {t:.9g} s ({speed:.1e} in speed), "
            "where its direction turns faster than steps follow: use dop853 or radau5"
        )

    def _paradox(self) -> str:
        """Why reactions are not unique, or friction with them leaves no one motion."""
        if not self._coupled.any():
            return ""
        here = self._here()
        if here.has_dependent_constraints and self._directions(here)[self._coupled].any():
            return (
                f"friction in proportion to reactions ({', '.join(self._coupled_names)}) is not known at "
                f"t = {self.arrays.t:.9g} s: constraints of the model depend on each other there, and their forces are "
                "not unique; leave out the constraints that follow from others"
            )
        for place in (self._here, self._a_step_ahead):
            try:
                here = place()
                levels = self._levels(self.stuck, here)
                forces, _ = self._forces(here, self.held, levels)
                self._check_unique(here, self.closed, self.stuck, levels, forces)
            except ContactError as error:
                return str(error)
            except np.linalg.LinAlgError:  # not a number: another reason to stop
                return ""
        return ""

    def _aims_ended(self, fired: np.ndarray) -> np.ndarray:
        """Which frictions slide on, however slowly: of those aimed the second event fired, not that of their rest."""
        found = np.zeros_like(self.aimed)
        for i, j in self.layout.circles:
            found[[i, j]] = self.aimed[i] and not fired[self.n_stops + i]
        return found

    def _a_step_ahead(self) -> LocalDynamics:
        """Where the step that failed would have ended, but for accelerations."""
        arrays, nq, n = self.arrays, self.system.nq, self.system.nq + self.system.nv
        h = float(arrays.control[at.H_LAST])
        y = arrays.y[:n].copy()
        y = Positions(self.system).retract(y[:nq], h * y[nq:]), y[nq:]
        return self.equations.at(arrays.p, arrays.t + h, np.concatenate(y))

    def _came_to_rest(self, here: LocalDynamics) -> np.ndarray:
        """Which frictions have no speed if they fired; those that follow reactions may have come to a paradox."""
        last = self.layout.together(np.abs(here.free[self.n_stops :])) * self.arrays.h_last
        # A speed in a plane comes close to zero; friction takes what is left of it before it goes anywhere.
        slow = np.where(self._in_circles, _NEARLY, 1.0) * self._slow(here)
        small = np.maximum(slow, _AT_REST * last)
        return ~(self._coupled | self._in_circles) | (self._sliding(here) <= small)

    def _almost_at_rest(self, here: LocalDynamics) -> np.ndarray:
        """Which frictions in planes come to rest with others: slow enough to count as at rest at an event of theirs.

        Points of one body stop at one instant, but for errors: the last of them would turn ever faster about others.
        And what has hardly begun to slide along an aim may go another way about one that sticks.
        """
        near = self._sliding(here) <= _NEARLY * self._slow(here)
        return (self.turning | self.aimed) & self._pressed(self.closed) & near

    def _decide(
        self, near: np.ndarray, struck: np.ndarray, slow: np.ndarray, aims: np.ndarray | None = None
    ) -> None:
        """Settle impacts, then what stays closed or sticks, and in which direction the rest slides.

        Parameters
        ----------
        near : ndarray of bool
            Stops whose gaps are zero within the tolerances of the run: they may stay closed.
        struck : ndarray of bool
            Those whose gaps are zero but for round-off. Others have impacts of their own, however soon.
        slow : ndarray of bool
            Frictions that may stick.
        aims : ndarray of bool, optional
            Those that slide along `senses`, whatever their speed across is.
        A stop that stays closed does not rebound. Where friction follows its reaction it has no impulse of a rebound
        either, which would rub for nothing: a blow without restitution and what is pressed from there on are in sum
        what ever smaller rebounds are.
        """
        rates = slice(self.system.nq, self.system.nq + self.system.nv)
        before, settings = self.arrays.y[rates].copy(), self.settings
        rebounds = self._decide_once(near, struck, slow, aims, np.zeros(self.n_stops, dtype=bool))
        if rebounds.any() and self._coupled.any():
            self.arrays.y[rates], self.settings = before, settings
            self._decide_once(near, struck, slow, aims, rebounds)

    def _decide_once(
        self,
        near: np.ndarray,
        struck: np.ndarray,
        slow: np.ndarray,
        aims: np.ndarray | None,
        dead: np.ndarray,
    ) -> np.ndarray:
        """Do so with no restitution of the stops `dead`; returns which stops stay closed although they rebounded."""
        before = self._here().speeds[self.n_stops :]
        impacted = self._impact(struck, dead)
        here = self._here()
        touching = near & (struck | ~self._closing(here))
        speeds = here.speeds[self.n_stops :]
        still = self._sliding(here) <= self._slow(here)
        # Where rates have jumped, what stuck may slide.
        jumped = impacted & (self.layout.together(np.abs(speeds - before)) > self._slow(here))
        still = still | (slow & ~jumped)
        led = here.led[self.n_stops :]
        led = led & ~(self._in_circles & ~self._all_led(led))
        onward = np.where(led & still, self._led_onward(here), np.sign(speeds))
        still = still & ~self._smooth & ~led
        self._follow_motion(here, still | self._smooth, onward, aims)
        held = self._settle(touching, struck, still & self._pressed(touching))
        self.closed, self.stuck = held[: self.n_stops], held[self.n_stops :]
        rising = here.speeds[: self.n_stops] > self._speed_tolerances(here)[: self.n_stops]
        nq, n = self.system.nq, self.system.nq + self.system.nv
        here = here.turned(self.layout.turned(self.senses, self.aimed)) if self.aimed.any() else here
        self.arrays.y[nq:n] += here.holding(held, here.speeds)
        if self.aimed.any() and not self.arrays.fixed_step:
            self._turn_what_is_led_astray()
        return self.closed & rising & impacted

    def _turn_what_is_led_astray(self) -> None:
        """Let what slides along an aim turn with the motion where friction would not hold the speed across it.

        No event would tell: the force is beyond its limit already.
        """
        self.write()
        rows = self.layout.circles[:, 0]
        astray = self.aimed[rows] & (np.abs(self._forces_across()) > _ASTRAY * self._aims[:, 0])
        if not astray.any():
            return
        slides = self._sliding(self._here())[rows] > 0.0
        if not slides[astray].all():
            raise self._without_direction(rows[self.aimed[rows]])
        for i, j in self.layout.circles[astray]:
            self.aimed[[i, j]], self.turning[[i, j]], self.stuck[j] = False, True, False

    def _decide_on_stops(self, near: np.ndarray, struck: np.ndarray, dead: np.ndarray) -> None:
        """Do as `_decide_once` where there are no frictions."""
        self._impact(struck, dead)
        here = self._here()
        self.closed = self._settle(near & (struck | ~self._closing(here)), struck, self.stuck)
        if self.closed.any():
            nq, n = self.system.nq, self.system.nq + self.system.nv
            self.arrays.y[nq:n] += here.holding(self.closed, here.speeds)

    def _closing(self, here: LocalDynamics) -> np.ndarray:
        """Which gaps close, faster than the tolerances of the run."""
        return here.speeds[: self.n_stops] < -self._speed_tolerances(here)[: self.n_stops]

    def _all_led(self, led: np.ndarray) -> np.ndarray:
        found = led.copy()
        found[self.layout.circles] = led[self.layout.circles].all(axis=1)[:, None]
        return found

    def _follow_motion(
        self, here: LocalDynamics, none: np.ndarray, onward: np.ndarray, aims: np.ndarray | None
    ) -> None:
        """Let all that slides do so in the direction of its speed; an aim that the motion still has is kept."""
        speeds, sizes = here.speeds[self.n_stops :], self._sliding(here)
        circles = self._in_circles
        kept, along = self.aimed.copy(), speeds
        if kept.any():
            along = (self.layout.turned(self.senses, kept) @ here.speeds)[self.n_stops :]
        for i, j in self.layout.circles:
            is_set = aims is not None and aims[i]
            kept[[i, j]] &= is_set or (along[i] > 0.0 and abs(along[j]) <= _OFF_AIM * along[i])
        self.aimed = kept & ~none
        self.turning = circles & ~none & ~self.aimed
        ways = np.where(circles, speeds / np.where(sizes > 0.0, sizes, 1.0), onward)
        self.senses = np.where(self.aimed, self.senses, np.where(none, 0.0, ways))
        self.stuck = np.zeros_like(self.stuck)

    def _impact(self, touching: np.ndarray, dead: np.ndarray) -> bool:
        """Change the rates where touching gaps are closing, without restitution of the `dead`; returns whether."""
        here = self._here()
        if not (touching & (here.speeds[: self.n_stops] < 0.0)).any():
            return False
        _, restitutions, coefficients, _ = self._watched()
        rubbing = self._coupled & self._pressed(touching)
        law = {"sequential": self.system.sequential_impacts}
        given = (
            touching,
            rubbing,
            np.where(dead, 0.0, restitutions),
            coefficients,
            self.normals,
            self.layout.circles,
        )
        found = self._solved(lambda: impulses(here, *given, **law))
        nq, n = self.system.nq, self.system.nq + self.system.nv
        self.arrays.y[nq:n] += here.change(found)
        return True
