"""Bodies of random shapes that are thrown on planes and on each other: `python -m tests.stress.contact_shapes`.

Boxes, capsules, spheres and sets of them, planar and in space, with restitutions from 0 to 0.9, with and without
friction, on level and leaning planes; and spheres and capsules that fall on capsules and boxes on a
hinge, in a plane capsules on boxes, and meshes on a mesh; boxes that lie flat, and slide and spin. Each run is
judged by `thrown_bodies.py`, frame by frame and impact by impact, and against another method at a small tolerance, for
as long as that method agrees with itself at a larger one. Boxes in space with one corner that touches at a time follow
`tests/falling_bodies.py` as well. A run that is flagged though nothing speaks against it, and though the other method
tells its end, is doubted.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from symgen import Model
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

from ..falling_bodies import Fall, box_corners
from .hulls import write_hull
from .scenario import DOUBTED, FLAGGED, REFUSED, RIGHT, WRONG
from .thrown_bodies import FLOOR, TARGET_DAMPING, TARGET_INERTIA, Thrown, n_near, objection

KINDS = ("planar", "space", "pair", "reference", "rods", "ledge", "stones", "spun")
_PAIRS = ("pair", "rods", "ledge")  # a body on one on a hinge
METHOD_NAMES = ("dop853", "taylor", "radau5", "rk4", "gauss8", "bdf")
_SPAN, _FPS = 0.6, 500  # s; between frames a direction of sliding is taken for its mean
_STEP = 2e-4  # s, of fixed steps: a direction of sliding that begins is of second order in it
_ALLOWED = {"rk4": 1e-5, "gauss8": 1e-5, "bdf": 1e-4}  # of the energy, and in place [m, rad]
_ALLOWED_ELSE = 1e-5
_FOLDER = tempfile.TemporaryDirectory()
_MESHES = Path(_FOLDER.name)
_TELLS = 1e-2  # allowed error, above which the other method does not tell


def thrown(kind: str, rng: np.random.Generator) -> tuple[Model, Thrown]:
    """Return a model, and what its judge has to know."""
    planar = kind in ("planar", "ledge")
    e, mu = rng.choice([0.0, 0.3, 0.6, 0.9]), rng.choice([0.0, 0.2, 0.6])
    e, mu = (rng.choice([0.3, 0.6]), rng.choice([0.0, 0.3])) if kind == "reference" else (e, mu)
    law = {"restitution": float(e), **({"friction": float(mu)} if mu else {})}
    down = (0, "-9.81 m/s^2") if planar else (0, 0, "-9.81 m/s^2")
    m = Model(f"thrown_{kind}", gravity=down, folder=_MESHES)
    sizes = rng.uniform(0.05, 0.2, 3)
    shapes = {
        "box": {"box": sizes.tolist()},
        "capsule": {"capsule": [sizes[0] / 2, sizes[1]]},
        "sphere": {"sphere": [sizes[0] / 2]},
        "two": [
            {"sphere": [0.03], "offset": [0.06, 0.0] + [0.0] * (not planar)},
            {"box": (sizes / 2).tolist()},
        ],
    }
    name = "box" if kind in ("reference", "spun") else rng.choice(list(shapes))
    name = {"pair": "sphere", "rods": "capsule", "ledge": "capsule"}.get(kind, name)
    inertia = rng.uniform(0.5, 1.0, 3) * (sizes @ sizes) / 12
    turn, spin = rng.normal(size=4), rng.normal(size=3) * 5
    turn /= np.linalg.norm(turn)
    height, speed = rng.uniform(0.25, 0.5), rng.normal(size=3) * 0.5
    own = shapes[name] if isinstance(shapes[name], list) else [shapes[name]]
    about = Thrown(own, inertia, float(e), float(mu), planar)
    if planar:
        q = [
            m.coordinate(c, unit=u, start=s, rate=v)
            for c, u, s, v in (
                ("x", "m", 0.0, speed[0]),
                ("y", "m", height, speed[1]),
                ("a", "rad", rng.uniform(-3, 3), spin[0]),
            )
        ]
        m.body("body", mass=1.0, com=q[:2], inertia=inertia[0], angle=q[2], shape=shapes[name])
    else:
        m.body("body", mass=1.0, inertia=inertia.tolist(), shape=shapes[name])
        start, rate = [0, 0, height, *turn], [*speed, *spin]
        if kind == "spun":
            half = rng.uniform(0.0, np.pi)
            start = [0, 0, sizes[2] / 2, np.cos(half), 0, 0, np.sin(half)]
            rate = [*(speed[:2] * rng.choice([0.0, 1.0])), 0, 0, 0, spin[2]]
        m.joint("free", type="free", child="body", start=start, rate=rate)
    if kind == "stones":
        corners = rng.normal(size=(rng.integers(4, 8), 3)) * sizes
        corners = corners[ConvexHull(corners).vertices]
        corners -= corners.mean(axis=0)
        return _stone_on_table(m, corners, law), replace(about, shapes=[{"corners": corners}])
    if kind in _PAIRS:
        # On what is fixed but for a hinge, off its middle.
        target = shapes["box" if planar else rng.choice(["box", "capsule"])]
        if planar:
            swing = m.coordinate("swing", unit="rad")
            m.body("target", mass=2.0, com=(0, 0), inertia=TARGET_INERTIA, angle=swing, shape=target)
            m.dissipation(f"{TARGET_DAMPING / 2}*dot(swing)**2")
        else:
            m.body("target", mass=2.0, inertia=[TARGET_INERTIA] * 3, shape=target)
            m.joint("hinge", type="revolute", child="target", axis=[0, 1, 0], damping=TARGET_DAMPING)
        m.contact("hit", body="body", other="target", **law)
        m.contact("floor", body="body", plane="floor", **law)
        m.frame("floor", body="world", at=(0, FLOOR) if planar else (0, 0, FLOOR))
        return m, replace(about, target=target)
    lean = float(rng.choice([0.0, 0.2])) if kind not in ("reference", "spun") else 0.0
    m.frame("plane", body="world", rpy=(0, 0, lean) if planar else (lean, 0, 0))
    m.contact("floor", body="body", plane="plane", **law)
    return m, replace(about, lean=lean)


def _stone_on_table(m: Model, corners: np.ndarray, law: dict) -> Model:
    """The model with a mesh as the shape of its body, over a wide box or mesh whose upper side is level."""
    of = {"stone": corners, "table": box_corners((20, 20, 1))}
    for name, places in of.items():
        write_hull(_MESHES / f"{name}.stl", places)
    m.body("table", mass=1.0, shape={"mesh": "table.stl"})
    m.joint("held", type="fixed", child="table", origin={"xyz": [0, 0, -0.5]})
    shape = {"mesh": "stone.stl"}
    m.contact("floor", body="body", shape=shape, other="table", **law)
    return m


def _first_impacts(run, about: Thrown) -> str:
    """What speaks against the first impacts, by a rigid-body code of its own."""
    (shape,) = about.shapes
    fall = Fall(1.0, about.inertia, box_corners(shape["box"]), about.restitution, about.friction)
    found, _ = fall.impacts(run.states[0], 3, _SPAN)
    own = [(e.t, int(e.name.split("_")[1]) - 1) for e in run.events if e.action == "impact"][: len(found)]
    for (t, k), (own_t, own_k) in zip(found, own, strict=False):
        if k != own_k or abs(t - own_t) > 1e-5:
            return f"corner {k} hits at {t:.7g} s, not corner {own_k} at {own_t:.7g} s"
    return "" if len(own) == len(found) or found[-1][0] > run.t[-1] else "impacts are missing"


@dataclass(frozen=True)
class Course:
    """Where a body is at the frames, and by how much it may be off there, which grows along the motion."""

    places: np.ndarray
    doubt: np.ndarray

    @classmethod
    def of(cls, system, about: Thrown, method: str) -> Course:
        """By a method at a small and a usual tolerance: how far they are apart is what a tolerance does.

        Where several points strike at once and rub, their impulses are one of many ways, which round-off chooses: it
        tells nothing from there on.
        """
        fine = system.run(t_end=_SPAN, fps=_FPS, method=method, rtol=1e-11, atol=1e-13)
        usual = system.run(t_end=_SPAN, fps=_FPS, method=method)
        n = min(len(fine.t), len(usual.t))
        apart = np.abs(fine.q[:n] - usual.q[:n]).max(axis=1)
        doubt = 100.0 * np.maximum.accumulate(apart)
        if about.friction > 0.0:
            many = [
                e.t for e in fine.events if e.action == "impact" and n_near(e.q_before, e.v_before, about) > 1
            ]
            doubt[fine.t[:n] > min(many, default=np.inf)] = np.inf
        return cls(fine.q[:n], doubt)

    @property
    def n_told(self) -> int:
        """How many frames it tells."""
        return int(np.sum(self.doubt < _TELLS))

    def objection(self, run, allowed: float) -> str:
        """What speaks against a run."""
        n = min(self.n_told, len(run.t))
        off = np.abs(run.q[:n] - self.places[:n]).max(axis=1)
        beyond = np.flatnonzero(off > allowed + self.doubt[:n])
        return f"{off[beyond[0]]:.2g} off at {run.t[beyond[0]]:.4g} s" if len(beyond) else ""

    def tells_end_of(self, run) -> bool:
        """Whether it tells all of a run that came to its end."""
        return run.t[-1] >= _SPAN * (1 - 1e-9) and self.n_told >= len(run.t)


def try_one(system, about: Thrown, course: Course, kind: str, method: str) -> tuple[str, str]:
    """Return the verdict on one case, and what speaks against it."""
    step = {} if METHODS[method].adaptive else {"step": _STEP}
    try:
        run = system.run(t_end=_SPAN, fps=_FPS, method=method, **step)
    except RuntimeModelError as error:
        return REFUSED, str(error)
    allowed = _ALLOWED.get(method, _ALLOWED_ELSE)
    against = objection(run, about, allowed) or course.objection(run, 10 * allowed)
    if not against and kind == "reference":
        against = _first_impacts(run, about)
    if not run.ok:
        says = next((h.says for h in run.health if not h.ok), run.status)
        doubted = not against and course.tells_end_of(run)
        return (DOUBTED if doubted else FLAGGED), f"{says} ({against or 'nothing found'})"
    return (WRONG, against) if against else (RIGHT, "")


def try_many(
    kind: str, methods: Sequence[str], numbers: Iterable[int], seed: int
) -> tuple[dict[str, Counter], list[str]]:
    """Try random cases; returns how many had which verdict by each method, and what was said of all but right ones."""
    counts: dict[str, Counter] = {method: Counter() for method in methods}
    said = []
    for k in numbers:
        m, about = thrown(kind, np.random.default_rng([seed, KINDS.index(kind), k]))
        system = m.derive()
        courses: dict[str, Course] = {}
        for method in methods:
            other = "radau5" if method == "dop853" else "dop853"
            if other not in courses:
                courses[other] = Course.of(system, about, other)
            verdict, against = try_one(system, about, courses[other], kind, method)
            counts[method][verdict] += 1
            if against:
                said.append(f"{kind} {k} {method}: {verdict}: {against}")
                print(f"    {said[-1]:.300}", file=sys.stderr, flush=True)
    return counts, said


def main(arguments: list[str] | None = None) -> int:
    """Try cases and print a table."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.stress.contact_shapes", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first case (0)")
    parser.add_argument("--methods", nargs="+", default=list(METHOD_NAMES))
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    given = parser.parse_args(arguments)
    wrong = 0
    for kind in given.kinds:
        numbers = range(given.first, given.first + given.count)
        counts, _ = try_many(kind, given.methods, numbers, given.seed)
        for method, by in counts.items():
            print(
                f"{kind:10} {method:10} " + "  ".join(f"{k} {n}" for k, n in sorted(by.items())), flush=True
            )
            wrong += by[WRONG]
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
