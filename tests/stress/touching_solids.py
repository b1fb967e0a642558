"""Solids in touch under loads that grow: `python -m tests.stress.touching_solids`.

Planks on a block and a ball, boxes on boxes, on stones (meshes), in corners, pushed against each other, and balls
between a box and a wall. Where they touch is found here from the corners of solids by separating axes; a run is right
if its frames are a motion by the laws: no solid is in another, and what momentum and spin of each change by, beside
weight and loads, is what forces at the places in touch could do, which press, within Coulomb's cone where nothing
slides and at its edge, against the sliding, where something does (non-negative least squares). Events take energy, and
give none.
"""

from __future__ import annotations

import functools
import itertools
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from symgen import Model, runtime, t
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

from .hulls import write_hull
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG, Outcome, Scenario
from .trying import try_cases

KINDS = ("planks", "wedged", "stacked", "stones", "corner", "pushed")
METHOD_NAMES = ("dop853", "radau5", "rk4", "gauss8", "generalized_alpha", "bdf")
G = 9.81
_SPAN, _FPS, _EVERY = 1.0, 1000, 4  # s; each such frame is judged
_STEP = 5e-4  # s, of fixed steps
_TOUCHES, _SUNK = 2e-6, 1e-5  # m
_LAW, _LAW_FIXED = 3e-4, 1e-2  # of the weight
_SLIDES, _PLAIN = 1e-4, 0.02  # m/s, from which on something slides, and from which on its direction is plain
_AIMED = 6e-3  # rad, by which it may miss it (docs/contact.md)
_RISES = 1e-4  # m/s
_SIDES = 24  # of the cone
_SEED, _N_ALL = 3, 2  # of the suite
_FOLDER = tempfile.TemporaryDirectory()
_MESHES = Path(_FOLDER.name)


@dataclass(frozen=True)
class Solid:
    """A sphere, a box or the hull of some places about its middle, which is held or free.

    Attributes
    ----------
    shape : dict
        As models have it.
    corners : ndarray, shape (k, 3) [m]
        One, the middle, of a sphere.
    axes, edges : ndarray, shape (k, 3)
        Normals of its sides, directions of its edges.
    place : ndarray, shape (3,) [m]
    turn : Rotation
    """

    name: str
    shape: dict
    corners: np.ndarray
    place: np.ndarray
    turn: Rotation = field(default_factory=Rotation.identity)
    radius: float = 0.0
    axes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    edges: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    mass: float = 1.0
    inertia: np.ndarray = field(default_factory=lambda: np.ones(3))
    held: bool = False


@dataclass(frozen=True)
class Plane:
    """What is on one side of it is outside."""

    name: str
    normal: np.ndarray
    rpy: tuple[float, float, float]


@dataclass(frozen=True)
class Touch:
    """Places at which two touch, and the direction from the second to the first."""

    places: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class Scene:
    """Solids, which of them meet which others or planes, and what pulls and turns one of them, growing with time."""

    solids: list[Solid]
    planes: list[Plane]
    pairs: list[tuple[str, str]]
    friction: float
    loaded: str
    pull: np.ndarray
    turn: np.ndarray

    @property
    def free(self) -> list[Solid]:
        return [solid for solid in self.solids if not solid.held]

    @property
    def weight(self) -> float:
        return G * sum(solid.mass for solid in self.free)

    def derive(self) -> runtime.System:
        """Return the model."""
        m = Model("touching", gravity=(0, 0, -G), folder=_MESHES)
        for plane in self.planes:
            m.frame(plane.name, body="world", rpy=plane.rpy)
        for solid in self.solids:
            if "mesh" in solid.shape:
                write_hull(_MESHES / solid.shape["mesh"], solid.corners)
            m.body(solid.name, mass=float(solid.mass), inertia=solid.inertia.tolist(), shape=solid.shape)
            if solid.held:
                origin = {"xyz": solid.place.tolist(), "rpy": solid.turn.as_euler("xyz").tolist()}
                m.joint(f"{solid.name}_held", type="fixed", child=solid.name, origin=origin)
            else:
                start = [*solid.place.tolist(), *np.roll(solid.turn.as_quat(), 1).tolist()]
                m.joint(f"{solid.name}_free", type="free", child=solid.name, start=start)
        names, law = (
            {plane.name for plane in self.planes},
            {"friction": self.friction} if self.friction else {},
        )
        for one, other in self.pairs:
            against = {"plane": other} if other in names else {"other": other}
            m.contact(f"{one}_{other}", body=one, **against, **law)
        m.load("pull", point=m.point("middle", body=self.loaded), force=[float(x) * t for x in self.pull])
        m.load("turn", body=self.loaded, torque=[float(x) * t for x in self.turn])
        return m.derive()


def _box(
    name: str, sizes: Sequence[float], place: Sequence[float], yaw: float = 0.0, mass: float = 1.0, **more
) -> Solid:
    sizes = np.asarray(sizes, dtype=float)
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * sizes
    inertia = mass / 12 * ((sizes**2).sum() - sizes**2)
    turn = Rotation.from_euler("z", yaw)
    shape = {"box": sizes.tolist()}
    return Solid(
        name, shape, corners, np.array(place, float), turn, 0.0, np.eye(3), np.eye(3), mass, inertia, **more
    )


def _stone(name: str, corners: np.ndarray, place: Sequence[float], mass: float = 1.0, **more) -> Solid:
    hull = ConvexHull(corners)
    axes = np.unique(np.round(hull.equations[:, :3], 12), axis=0)
    pairs = {tuple(sorted(p)) for s in hull.simplices for p in itertools.combinations(s, 2)}
    edges = np.array(
        [(corners[i] - corners[j]) / np.linalg.norm(corners[i] - corners[j]) for i, j in sorted(pairs)]
    )
    inertia = mass / 6 * np.ptp(corners, axis=0).max() ** 2 * np.array([1.0, 1.1, 1.2])
    shape = {"mesh": f"{name}.stl"}
    return Solid(
        name,
        shape,
        corners,
        np.array(place, float),
        Rotation.identity(),
        0.0,
        axes,
        edges,
        mass,
        inertia,
        **more,
    )


def draw(seed: int, kind: str, number: int) -> Scene:
    """Draw a scene."""
    rng = np.random.default_rng([seed, KINDS.index(kind), number])
    friction = float(rng.choice([0.0, 0.2, 0.4, 0.6]))
    floor, wall, side = (
        Plane(name, Rotation.from_euler("xyz", rpy).apply([0, 0, 1]), rpy)
        for name, rpy in (("floor", (0, 0, 0)), ("wall", (0, np.pi / 2, 0)), ("side", (-np.pi / 2, 0, 0)))
    )
    mass, angle = 10.0 ** rng.uniform(-1, 1), rng.uniform(0, 2 * np.pi)
    size = rng.uniform(0.3, 1.5) * mass * G * (friction or 0.05)
    pull = size * np.array([np.cos(angle), np.sin(angle), rng.uniform(-0.5, 0.5)])
    turn = size * rng.uniform(-0.05, 0.05) * np.array([0.0, 0.0, 1.0])
    planes: list[Plane] = []
    if kind == "planks":
        sizes = [rng.uniform(0.5, 1.0), rng.uniform(0.05, 0.15), rng.uniform(0.02, 0.06)]
        apart, yaw, high = rng.uniform(0.15, 0.4), float(rng.choice([0.0, rng.uniform(-0.3, 0.3)])), 0.1
        solids = [_box("plank", sizes, (rng.uniform(-0.1, 0.1), 0, high + sizes[2] / 2), yaw, mass)]
        wide, r = rng.uniform(0.02, 0.08), 0.05
        solids.append(_box("block", (wide, 0.4, high), (-apart / 2, 0, high / 2), held=True))
        solids.append(
            Solid(
                "ball",
                {"sphere": [r]},
                np.zeros((1, 3)),
                np.array([apart / 2, 0, high - r]),
                radius=r,
                held=True,
            )
        )
        pairs = [("plank", "block"), ("ball", "plank")]
    elif kind == "wedged":
        planes, r = [floor, wall], rng.uniform(0.05, 0.1)
        high, apart = rng.uniform(0.5, 1.0) * r, r + rng.uniform(0.3, 0.8) * r
        # The ball's middle is over the box's edge at the height at which it touches both.
        z = high + np.sqrt(r**2 - (apart - r) ** 2)
        ball = Solid("ball", {"sphere": [r]}, np.zeros((1, 3)), np.array([r, 0, z]), radius=r, mass=mass)
        ball = Solid(**{**ball.__dict__, "inertia": np.full(3, 0.4 * mass * r**2)})
        width = rng.uniform(0.1, 0.2)
        box = _box(
            "box", (width, rng.uniform(0.1, 0.2), high), (apart + width / 2, 0, high / 2), 0.0, 2 * mass
        )
        solids, pairs = [ball, box], [("ball", "wall"), ("ball", "box"), ("box", "floor")]
    elif kind in ("stacked", "stones"):
        low, top = rng.uniform(0.2, 0.3, 3), rng.uniform(0.05, 0.15, 3)
        place = (*rng.uniform(-0.05, 0.05, 2), low[2] / 2 + top[2] / 2)
        upper = _box("top", top, place, float(rng.choice([0.0, rng.uniform(-1, 1)])), mass)
        if kind == "stacked":
            lower = _box("low", low, (0, 0, 0), held=True)
        else:
            angles = 2 * np.pi * (np.arange(5) + rng.uniform(0, 0.5, 5)) / 5
            ring = lambda r, z: np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(5, z)])  # noqa: E731
            corners = np.vstack([ring(0.25, low[2] / 2), ring(0.3, -low[2] / 2)])
            lower = _stone("low", corners, (0, 0, 0), held=True)
        solids, pairs = [upper, lower], [("top", "low")]
    elif kind == "corner":
        planes = [floor, wall, side]
        sizes = rng.uniform(0.05, 0.2, 3)
        solids, pairs = [_box("die", sizes, sizes / 2, 0.0, mass)], [("die", p.name) for p in planes]
    else:
        planes, one, two = [floor], rng.uniform(0.05, 0.2, 3), rng.uniform(0.05, 0.2, 3)
        off = rng.uniform(-0.4, 0.4) * (one[1] + two[1]) / 2
        solids = [
            _box("one", one, (0, 0, one[2] / 2), 0.0, mass),
            _box("two", two, ((one[0] + two[0]) / 2, off, two[2] / 2), 0.0, mass * rng.uniform(0.5, 2)),
        ]
        pairs = [("one", "floor"), ("two", "floor"), ("one", "two")]
        pull[0] = 3 * abs(pull[0])
    return Scene(solids, planes, pairs, friction, solids[0].name, pull, turn)


@dataclass(frozen=True)
class Pose:
    """A solid at a frame: its corners in the world, and its motion."""

    solid: Solid
    place: np.ndarray
    turn: Rotation
    speed: np.ndarray
    spin: np.ndarray

    @functools.cached_property
    def corners(self) -> np.ndarray:
        return self.place + self.turn.apply(self.solid.corners)

    def velocity(self, at: np.ndarray) -> np.ndarray:
        return self.speed + np.cross(self.spin, at - self.place)


def _poses(scene: Scene, q: np.ndarray, v: np.ndarray) -> dict[str, Pose]:
    found, k = {}, 0
    for solid in scene.solids:
        if solid.held:
            found[solid.name] = Pose(solid, solid.place, solid.turn, np.zeros(3), np.zeros(3))
            continue
        turn = Rotation.from_quat(q[7 * k + 3 : 7 * k + 7][[1, 2, 3, 0]])
        rates = v[6 * k : 6 * k + 6]
        found[solid.name] = Pose(solid, q[7 * k : 7 * k + 3], turn, rates[:3], turn.apply(rates[3:]))
        k += 1
    return found


def _touch(a: Pose, b: Pose | Plane) -> tuple[float, Touch | None]:
    """How far a solid is from another, and where they touch."""
    if isinstance(b, Plane):
        heights = a.corners @ b.normal - a.solid.radius
        near = heights < _TOUCHES
        return heights.min(), Touch(
            a.corners[near] - a.solid.radius * b.normal, b.normal
        ) if near.any() else None
    if a.solid.radius:
        half = b.solid.corners.max(axis=0)
        here = b.turn.inv().apply(a.place - b.place)
        inside = np.clip(here, -half, half)
        away = np.linalg.norm(here - inside)
        gap = away - a.solid.radius
        place = b.place + b.turn.apply(inside)
        return gap, Touch(place[None], b.turn.apply((here - inside) / away)) if gap < _TOUCHES else None
    axes = [*a.turn.apply(a.solid.axes), *b.turn.apply(b.solid.axes)]
    for e, f in itertools.product(a.turn.apply(a.solid.edges), b.turn.apply(b.solid.edges)):
        n = np.cross(e, f)
        if np.linalg.norm(n) > 1e-4:
            axes.append(n / np.linalg.norm(n))
    best, normal = -np.inf, None
    for n in [*axes, *(-np.array(axes))]:
        apart = (a.corners @ n).min() - (b.corners @ n).max()
        if apart > best + 1e-12:
            best, normal = apart, n
    if best > _TOUCHES:
        return best, None
    one = a.corners[a.corners @ normal < (a.corners @ normal).min() + _TOUCHES]
    two = b.corners[b.corners @ normal > (b.corners @ normal).max() - _TOUCHES]
    return best, Touch(_common(one, two, normal), normal)


def _common(one: np.ndarray, two: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The corners of what two sides have in common: a place, or the ends of a line, or a polygon."""
    basis = np.linalg.svd(normal[None])[2][1:]
    flat = [_in_order(x @ basis.T) for x in (one, two)]
    found = [p for p in flat[0] if _is_in(p, flat[1])] + [p for p in flat[1] if _is_in(p, flat[0])]
    for p, r in _edges(flat[0]):
        for q, s in _edges(flat[1]):
            d = np.array([r - p, q - s]).T
            if abs(np.linalg.det(d)) > 1e-9 * np.linalg.norm(r - p) * np.linalg.norm(s - q):
                u, w = np.linalg.solve(d, q - p)
                if -1e-6 < u < 1 + 1e-6 and -1e-6 < w < 1 + 1e-6:
                    found.append(p + u * (r - p))
    height = (one @ normal).min()
    return np.array([p @ basis + height * normal for p in found]).reshape(-1, 3)


def _in_order(places: np.ndarray) -> np.ndarray:
    if len(places) < 3:
        return places
    middle = places - places.mean(axis=0)
    return places[np.argsort(np.arctan2(middle[:, 1], middle[:, 0]))]


def _edges(places: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    n = len(places)
    return [(places[k], places[(k + 1) % n]) for k in range(n if n > 2 else n - 1)]


def _is_in(p: np.ndarray, places: np.ndarray) -> bool:
    if len(places) == 1:
        return np.linalg.norm(p - places[0]) < _TOUCHES
    if len(places) == 2:
        along = places[1] - places[0]
        u = np.clip((p - places[0]) @ along / (along @ along), 0, 1)
        return np.linalg.norm(p - places[0] - u * along) < _TOUCHES
    for a, b in _edges(places):
        e = (b - a) / np.linalg.norm(b - a)
        if e[0] * (p - a)[1] - e[1] * (p - a)[0] < -_TOUCHES:
            return False
    return True


def _rays(scene: Scene, poses: dict[str, Pose], *, rising: bool) -> tuple[list[np.ndarray], float, str]:
    """What unit forces do at places in touch to all free solids; the least distance, and of which two."""
    index = {solid.name: k for k, solid in enumerate(scene.free)}
    planes = {plane.name: plane for plane in scene.planes}
    found, least, whose = [], np.inf, ""
    for one, other in scene.pairs:
        a, b = poses[one], planes.get(other) or poses[other]
        gap, touch = _touch(a, b)
        least, whose = (gap, f"{one} and {other}") if gap < least else (least, whose)
        if touch is None:
            continue
        n = touch.normal
        for place in touch.places:
            apart = a.velocity(place) - (0.0 if isinstance(b, Plane) else b.velocity(place))
            if rising and apart @ n > _RISES:
                continue
            slip = apart - (apart @ n) * n
            for ray in _forces(n, slip, scene.friction, along=rising):
                row = np.zeros(6 * len(index))
                for name, sign in ((one, 1.0), (other, -1.0)):
                    if name in index:
                        k = 6 * index[name]
                        row[k : k + 3] += sign * ray
                        row[k + 3 : k + 6] += sign * np.cross(place - poses[name].place, ray)
                found.append(row)
    return found, least, whose


def _forces(n: np.ndarray, slip: np.ndarray, friction: float, *, along: bool) -> list[np.ndarray]:
    if not friction:
        return [n]
    speed = np.linalg.norm(slip)
    if along and speed > _PLAIN:
        e = slip / speed
        f = np.cross(n, e)
        return [n - friction * (np.cos(w) * e + np.sin(w) * f) for w in (-_AIMED, 0.0, _AIMED)]
    e, f = np.linalg.svd(n[None])[2][1:]
    wide = friction / np.cos(np.pi / _SIDES)
    return [n + wide * (np.cos(w) * e + np.sin(w) * f) for w in 2 * np.pi * np.arange(_SIDES) / _SIDES] + [n]


def objection(run, scene: Scene, allowed: float) -> str:
    """What speaks against a run; '' if nothing does. `allowed` is a force in parts of the weight."""
    if not np.isfinite(run.states).all():
        return "numbers are not finite"
    free, times = scene.free, np.array([event.t for event in run.events])
    arms = np.array([max(np.ptp(s.corners, axis=0).max(), s.radius) for s in free])
    scale = np.repeat(np.column_stack([np.ones(len(free)), 1.0 / arms]).ravel(), 3)
    k_loaded = [solid.name for solid in free].index(scene.loaded)
    for k in range(_EVERY, len(run.t) - 1, _EVERY):
        before, now, after = (_poses(scene, run.q[i], run.v[i]) for i in (k - 1, k, k + 1))
        rays, least, whose = _rays(scene, now, rising=True)
        if least < -_SUNK:
            return f"{whose} are {-least:.2g} m in each other at {run.t[k]:.6g} s"
        span = run.t[k + 1] - run.t[k - 1]
        if abs(run.t[k + 1] + run.t[k - 1] - 2 * run.t[k]) > 1e-9 or np.any(
            np.abs(times - run.t[k]) < 2 / _FPS
        ):
            continue
        given = np.concatenate(
            [
                np.concatenate([_momentum(after[s.name]) - _momentum(before[s.name])]) / span
                - np.array([0, 0, -G * s.mass, 0, 0, 0])
                for s in free
            ]
        )
        given[6 * k_loaded : 6 * k_loaded + 6] -= run.t[k] * np.concatenate([scene.pull, scene.turn])
        off = _left(rays, given, scale) / scene.weight
        if off > allowed:
            return f"forces miss the motion by {off:.2g} of the weight at {run.t[k]:.6g} s"
    return _of_events(run, scene)


def _left(rays: list[np.ndarray], given: np.ndarray, scale: np.ndarray) -> float:
    """What is left of a load that forces along rays could bear at best."""
    if not rays:
        return float(np.linalg.norm(given * scale))
    return nnls(np.array(rays).T * scale[:, None], given * scale, maxiter=10000)[1]


def _momentum(pose: Pose) -> np.ndarray:
    own = pose.turn.apply(pose.solid.inertia * pose.turn.inv().apply(pose.spin))
    return np.concatenate([pose.solid.mass * pose.speed, own])


def _of_events(run, scene: Scene) -> str:
    size = scene.weight * max(np.ptp(s.corners, axis=0).max() + s.radius for s in scene.free)
    for event in run.events:
        energies = []
        for q, v in ((event.q_before, event.v_before), (event.q_after, event.v_after)):
            poses = _poses(scene, q, v)
            parts = [poses[s.name] for s in scene.free]
            energies.append(
                sum(
                    0.5 * _momentum(p) @ np.concatenate([p.speed, p.spin]) + G * p.solid.mass * p.place[2]
                    for p in parts
                )
            )
        if energies[1] - energies[0] > 1e-9 * size:
            return f"{event.name} gives {energies[1] - energies[0]:.2g} J at {event.t:.6g} s"
    return ""


def judge(scene: Scene, method: str, system: runtime.System | None = None) -> tuple[str, str]:
    """Run a scene and return verdict and reason."""
    fixed = not METHODS[method].adaptive
    try:
        run = (system or scene.derive()).run(
            t_end=_SPAN, fps=_FPS, method=method, **({"step": _STEP} if fixed else {})
        )
    except RuntimeModelError as error:
        return REFUSED, str(error)
    if run.status == "terminated":  # edges of meshes, which do not touch
        return REFUSED, run.message
    against = objection(run, scene, _LAW_FIXED if fixed else _LAW)
    if not run.ok:
        said = "; ".join([check.says for check in run.objections] or [run.message])
        return FLAGGED, f"{said} ({against or 'nothing found'}; {len(run.events)} events)"
    return (WRONG, against) if against else (RIGHT, f"{len(run.events)} events")


def _outcome(kind: str, number: int, method: str) -> Outcome:
    return Outcome(*judge(draw(_SEED, kind, number), method))


def scenarios() -> Iterator[Scenario]:
    """Yield some scenes of each kind for two methods."""
    for kind in KINDS:
        for number in range(_N_ALL):
            for method in ("dop853", "radau5"):
                short = number == 0 and method == "dop853" and kind == "wedged"
                run = functools.partial(_outcome, kind, number, method)
                yield Scenario("touching solids", f"solids {number}, {kind}: {method}", run, method, short)


def main(arguments: Sequence[str] | None = None) -> int:
    """Try scenes and print a table."""
    return try_cases(arguments, "touching_solids", __doc__, KINDS, draw, judge, 10)


if __name__ == "__main__":
    sys.exit(main())
