"""Boxes at rest on a plane, alone or stacked, under loads that grow: `python -m tests.stress.loaded_boxes`.

What pulls at the middle of the highest box and what turns it grow with time from nothing, until corners slide, turn,
lift and strike. How corners share a load is one of many ways, and so may be the motion: a run is right if its frames
are a motion by the laws. By NumPy, from states and forces of frames alone: no corner is below its plane, and none
pulls or presses where it does not touch; friction is within Coulomb's circle, and against the sliding velocity where
that is not zero; what forces give between frames with no event in between is what momentum and spin of each box change
by; events take energy, and give none.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from symgen import Model, runtime, t
from symgen.link import derive_text
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

from .scenario import FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario
from .trying import try_cases

KINDS = ("turned", "pulled", "tall", "stack")
G = 9.81
_SPAN, _FPS = 2.0, 1000  # s
_STEP = 5e-4  # s, of fixed steps
_SUNK = 1e-6  # of the least size
_LAW, _LAW_FIXED = 1e-4, 5e-3  # of the weight
_SLIDES = 1e-4  # m/s, from which on the direction of sliding is plain
_TURNED = 0.05  # rad between frames, up to which forces have a mean
_AIMED = 6e-3  # rad, by which what begins to slide may miss its direction (docs/contact.md: 0.4 % for 1e-8)
_BEGINS, _SLOW = 0.2, 0.02  # s and m/s, in which it does, also where it turns back
_LEAVES = 1e-5  # of a size: a corner that is higher does not touch
_SEED, _N_ALL = 28, 3  # of the suite
_METHODS, _SHORT = ("dop853", "radau5", "rk4"), ("dop853",)


@dataclass(frozen=True)
class Loaded:
    """Boxes that lie on each other, the lowest first.

    Attributes
    ----------
    sizes : ndarray, shape (n, 3) [m]
    masses, yaws : ndarray, shape (n,)
    friction : float
    pull : ndarray, shape (2,) [N/s]
        What the horizontal force on the middle of the highest grows by.
    turn : float [Nm/s]
        What the torque about the vertical grows by.
    """

    sizes: np.ndarray
    masses: np.ndarray
    yaws: np.ndarray
    friction: float
    pull: np.ndarray
    turn: float

    @property
    def inertias(self) -> np.ndarray:
        """Principal moments, shape (n, 3)."""
        squares = self.sizes**2
        return self.masses[:, None] / 12 * (squares.sum(axis=1, keepdims=True) - squares)

    @property
    def weight(self) -> float:
        return G * float(self.masses.sum())

    def derive(self) -> runtime.System:
        """Return the model."""
        m, height = Model("loaded", gravity=(0, 0, -G)), 0.0
        m.frame("plane0", body="world")
        for k, (size, mass, yaw, inertia) in enumerate(
            zip(self.sizes.tolist(), self.masses.tolist(), self.yaws.tolist(), self.inertias, strict=True)
        ):
            m.body(f"box{k}", mass=mass, inertia=inertia.tolist(), shape={"box": size})
            start = [0, 0, height + size[2] / 2, np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
            m.joint(f"free{k}", type="free", child=f"box{k}", start=start)
            m.contact(f"on{k}", body=f"box{k}", plane=f"plane{k}", friction=self.friction)
            m.frame(f"plane{k + 1}", body=f"box{k}", at=(0, 0, size[2] / 2))
            height += size[2]
        top = f"box{len(self.sizes) - 1}"
        m.load("pull", point=m.point("middle", body=top), force=[*(float(x) * t for x in self.pull), 0])
        m.load("turn", body=top, torque=[0, 0, self.turn * t])
        return runtime.load(derive_text(m).text)


def draw(seed: int, kind: str, number: int) -> Loaded:
    """Draw a case."""
    rng = np.random.default_rng([seed, KINDS.index(kind), number])
    n = 2 if kind == "stack" else 1
    sizes = rng.uniform(0.05, 0.2, (n, 3))
    if kind == "tall":
        sizes[:, 2] = rng.uniform(0.2, 0.4, n)
    if kind == "stack":
        sizes[0, :2], sizes[1, :2] = rng.uniform(0.2, 0.3, 2), rng.uniform(0.05, 0.15, 2)
    masses, friction = 10.0 ** rng.uniform(-1, 1.5, n), float(rng.uniform(0.1, 0.6))
    least = friction * G * masses[-1]
    angle, size = rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 1.5) * least
    turn = rng.uniform(-1, 1) * least * np.hypot(*sizes[-1, :2]) / 2
    pull = size * np.array([np.cos(angle), np.sin(angle)])
    return Loaded(sizes, masses, rng.uniform(0, 3, n), friction, pull, 0.0 if kind == "pulled" else turn)


@dataclass(frozen=True)
class Motion:
    """The frames of a run: of each box arrays over them, vectors in the world.

    Attributes
    ----------
    places, speeds, spins, momenta : list of ndarray, shape (k, 3)
        Of middles; momenta are those of the spin.
    turns : list of Rotation
    """

    loaded: Loaded
    places: list[np.ndarray]
    speeds: list[np.ndarray]
    spins: list[np.ndarray]
    momenta: list[np.ndarray]
    turns: list[Rotation]

    @classmethod
    def of(cls, loaded: Loaded, q: np.ndarray, v: np.ndarray) -> Motion:
        """Of states, shape (k, 7 n) and (k, 6 n)."""
        n = len(loaded.sizes)
        turns = [Rotation.from_quat(q[:, 7 * i + 3 : 7 * i + 7][:, [1, 2, 3, 0]]) for i in range(n)]
        rates = [v[:, 6 * i + 3 : 6 * i + 6] for i in range(n)]
        return cls(
            loaded,
            [q[:, 7 * i : 7 * i + 3] for i in range(n)],
            [v[:, 6 * i : 6 * i + 3] for i in range(n)],
            [turn.apply(rate) for turn, rate in zip(turns, rates, strict=True)],
            [turn.apply(rate * own) for turn, rate, own in zip(turns, rates, loaded.inertias, strict=True)],
            turns,
        )

    def energy(self) -> np.ndarray:
        """T + V of all [J]."""
        parts = zip(self.loaded.masses, self.places, self.speeds, self.spins, self.momenta, strict=True)
        return sum(
            mass * (0.5 * (speed**2).sum(axis=1) + G * place[:, 2]) + 0.5 * (spin * own).sum(axis=1)
            for mass, place, speed, spin, own in parts
        )

    def corner(self, i: int, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return height above its plane, place, and sliding velocity of corner k of box i in the axes of the plane."""
        signs = np.array([k >> 2 & 1, k >> 1 & 1, k & 1]) - 0.5
        arm = self.turns[i].apply(signs * self.loaded.sizes[i])
        place, speed = self.places[i] + arm, self.speeds[i] + np.cross(self.spins[i], arm)
        if i == 0:
            return place[:, 2], place, speed
        below = place - self.places[i - 1]
        slip = speed - self.speeds[i - 1] - np.cross(self.spins[i - 1], below)
        back = self.turns[i - 1].inv()
        return back.apply(below)[:, 2] - self.loaded.sizes[i - 1, 2] / 2, place, back.apply(slip)


def objection(run, loaded: Loaded, allowed: float) -> str:
    """What speaks against a run; '' if nothing does. `allowed` is a force in parts of the weight."""
    if not np.isfinite(run.states).all():
        return "numbers are not finite"
    n, motion = len(loaded.sizes), Motion.of(loaded, run.q, run.v)
    quiet = _quiet(run.t, np.array([event.t for event in run.events]))
    small, steady = allowed * loaded.weight, quiet
    begins = [event.t for event in run.events if event.action in ("slip", "turn")]
    forces = [np.zeros((len(run.t), 3)) for _ in range(n)]
    torques = [np.zeros((len(run.t), 3)) for _ in range(n)]
    for i in range(n):
        forces[i][:, 2] -= G * loaded.masses[i]
    forces[-1][:, :2] += run.t[:, None] * loaded.pull
    torques[-1][:, 2] += run.t * loaded.turn
    for i in range(n):
        for k in range(8):
            height, place, slip = motion.corner(i, k)
            names = [f"on{i}_{k + 1}_friction_1", f"on{i}_{k + 1}_friction_2", f"on{i}_{k + 1}"]
            force = np.stack([run[f"force({name})"] for name in names], axis=1)
            against = _of_corner(
                run.t[quiet], height[quiet], slip[quiet], force[quiet], loaded, small, begins
            )
            steady &= (force[:, 2] <= small) | _turns_little(slip)
            if against or height.min() < -_SUNK:
                return f"corner {k + 1} of box {i} " + (
                    against or f"is {-height.min():.2g} m below its plane"
                )
            acts = force if i == 0 else motion.turns[i - 1].apply(force)
            for j, sign in ((i, 1.0), (i - 1, -1.0)) if i else ((i, 1.0),):
                forces[j] += sign * acts
                torques[j] += sign * np.cross(place - motion.places[j], acts)
    step = run.t[1:-1] - run.t[:-2]
    even = steady[:-2] & steady[1:-1] & steady[2:] & (np.abs(np.diff(run.t, 2)) < 1e-9)
    for i in range(n):
        arm = np.linalg.norm(loaded.sizes[i]) / 2
        pairs = (
            ("momentum", forces[i], loaded.masses[i] * motion.speeds[i], small),
            ("spin", torques[i], motion.momenta[i], small * arm),
        )
        for what, given, has, most in pairs:
            mean = (given[:-2] + 4.0 * given[1:-1] + given[2:]) / 6.0  # Simpson's rule
            off = np.abs(mean - (has[2:] - has[:-2]) / (2.0 * step[:, None])).max(axis=1) * even
            if off.max() > most:
                share, moment = off.max() / most * allowed, run.t[1 + off.argmax()]
                return f"{what} of box {i} by {share:.2g} of the weight beside forces at {moment:.6g} s"
    return _of_events(run, loaded)


def _quiet(times: np.ndarray, events: np.ndarray) -> np.ndarray:
    """Which frames have no event within one frame."""
    if not len(events):
        return np.ones(len(times), dtype=bool)
    apart = np.abs(times[:, None] - events).min(axis=1)
    return apart > 1.0 / _FPS


def _turns_little(slip: np.ndarray) -> np.ndarray:
    """At which frames a sliding velocity keeps its direction from one to the next, or is none."""
    speed = np.hypot(slip[:, 0], slip[:, 1])
    change = np.zeros(len(slip))
    change[1:] = np.linalg.norm(np.diff(slip[:, :2], axis=0), axis=1)
    return (change <= _TURNED * speed) | (speed < 1e-9)


def _of_corner(
    times: np.ndarray,
    height: np.ndarray,
    slip: np.ndarray,
    force: np.ndarray,
    loaded: Loaded,
    small: float,
    begins: list[float],
) -> str:
    """What speaks against the forces of a corner, whose third component presses."""
    pressed, along = force[:, 2], np.hypot(force[:, 0], force[:, 1])
    if pressed.min(initial=0.0) < -small:
        return f"pulls with {-pressed.min():.2g} N at {times[pressed.argmin()]:.6g} s"
    apart = (height > _LEAVES) & (pressed > small)
    if apart.any():
        return f"presses {height[apart][0]:.2g} m above its plane at {times[apart][0]:.6g} s"
    off = along - loaded.friction * pressed
    if off.max(initial=0.0) > small:
        return f"rubs with {off.max():.2g} N too much at {times[off.argmax()]:.6g} s"
    speed = np.hypot(slip[:, 0], slip[:, 1])
    slides = speed > _SLIDES
    law = -loaded.friction * pressed[:, None] * slip[:, :2] / np.maximum(speed, _SLIDES)[:, None]
    aimed = np.array([any(0.0 <= moment - begin <= _BEGINS for begin in begins) for moment in times])
    aimed = aimed | (speed < _SLOW)
    off = np.linalg.norm(force[:, :2] - law, axis=1) * slides - _AIMED * loaded.friction * pressed * aimed
    if off.max(initial=0.0) > small:
        return f"rubs {off.max():.2g} N beside its direction at {times[off.argmax()]:.6g} s"
    return ""


def _of_events(run, loaded: Loaded) -> str:
    for event in run.events:
        before, after = (
            Motion.of(loaded, q[None], v[None]).energy()[0]
            for q, v in ((event.q_before, event.v_before), (event.q_after, event.v_after))
        )
        scale = loaded.weight * loaded.sizes.max()
        if after - before > 1e-9 * scale:
            return f"{event.name} gives {after - before:.2g} J at {event.t:.6g} s"
    return ""


def judge(loaded: Loaded, method: str, system: runtime.System | None = None) -> tuple[str, str]:
    """Run a case and return verdict and reason."""
    fixed = not METHODS[method].adaptive
    try:
        run = (system or loaded.derive()).run(
            t_end=_SPAN, fps=_FPS, method=method, **({"step": _STEP} if fixed else {})
        )
    except RuntimeModelError as error:
        return REFUSED, str(error)
    against = objection(run, loaded, _LAW_FIXED if fixed else _LAW)
    if not run.ok:
        said = "; ".join([check.says for check in run.objections] or [run.message])
        return FLAGGED, f"{said} ({against or 'nothing found'}; {len(run.events)} events)"
    return (WRONG, against) if against else (RIGHT, f"{len(run.events)} events")


def _outcome(kind: str, number: int, method: str) -> Outcome:
    return Outcome(*judge(draw(_SEED, kind, number), method))


def scenarios() -> Iterator[Scenario]:
    """Yield some cases of each kind for some methods."""
    for kind in KINDS:
        for method in _METHODS:
            for number in range(_N_ALL):
                short = number == 0 and method in _SHORT
                run = functools.partial(_outcome, kind, number, method)
                yield Scenario("loaded box", f"box {number}, {kind}: {method}", run, method, short)


def main(arguments: Sequence[str] | None = None) -> int:
    """Try cases and print a table."""
    return try_cases(arguments, "loaded_boxes", __doc__, KINDS, draw, judge, 25)


if __name__ == "__main__":
    sys.exit(main())
