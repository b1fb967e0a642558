"""Bodies of random shapes that are thrown on planes and on each other: `python -m tests.stress.contact_shapes`.

Boxes, capsules, spheres and sets of them, planar and in space, with restitutions from 0 to 0.9, with and without
friction, on level and leaning planes; and spheres that fall on capsules and boxes. What is judged holds whatever the
law of impacts is: all numbers are finite, no point is below its plane, computed from the poses by NumPy, by more than
the tolerance; no impact adds energy, and without friction T + V is what the impacts leave; where nothing rubs, momentum
along the plane is kept. Bodies in space with one corner that touches at a time follow `tests/falling_bodies.py`.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

import numpy as np
from scipy.spatial.transform import Rotation

from symgen import Model
from symgen.runtime.errors import RuntimeModelError

from ..falling_bodies import Fall, box_corners
from .scenario import FLAGGED, REFUSED, RIGHT, WRONG

KINDS = ("planar", "space", "pair", "reference")
G = 9.81
_STEP = 2e-4  # of fixed steps
_SUNK = 1e-6  # m
_GAINED = 1e-9  # of the energy at the start


def thrown(kind: str, rng: np.random.Generator) -> tuple[Model, dict]:
    """Return a model, and what its judge has to know."""
    planar = kind == "planar"
    e, mu = rng.choice([0.0, 0.3, 0.6, 0.9]), rng.choice([0.0, 0.2, 0.6])
    e, mu = (rng.choice([0.3, 0.6]), rng.choice([0.0, 0.3])) if kind == "reference" else (e, mu)
    law = {"restitution": float(e), **({"friction": float(mu)} if mu else {})}
    m = Model(f"thrown_{kind}", gravity=(0, "-9.81 m/s^2") if planar else (0, 0, "-9.81 m/s^2"))
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
    name = "box" if kind == "reference" else rng.choice(list(shapes))
    name = "sphere" if kind == "pair" else name
    inertia = rng.uniform(0.5, 1.0, 3) * (sizes @ sizes) / 12
    turn, spin = rng.normal(size=4), rng.normal(size=3) * 5
    turn /= np.linalg.norm(turn)
    height, speed = rng.uniform(0.25, 0.5), rng.normal(size=3) * 0.5
    about = {"shape": shapes[name], "e": e, "mu": mu, "inertia": inertia, "planar": planar, "kind": kind}
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
        m.joint("free", type="free", child="body", start=start, rate=rate)
    if kind == "pair":
        # On what is fixed but for a hinge, off its middle.
        m.body("target", mass=2.0, inertia=[0.01] * 3, shape=shapes[rng.choice(["box", "capsule"])])
        m.joint("hinge", type="revolute", child="target", axis=[0, 1, 0], damping=0.02)
        m.contact("hit", body="body", other="target", **law)
        m.contact("floor", body="body", plane="floor", **law)
        m.frame("floor", body="world", at=(0, 0, -0.4))
        return m, about
    lean = float(rng.choice([0.0, 0.2])) if kind != "reference" else 0.0
    about["lean"] = lean
    m.frame("plane", body="world", rpy=(0, 0, lean) if planar else (lean, 0, 0))
    m.contact("floor", body="body", plane="plane", **law)
    return m, about


def judge(run, about: dict) -> str:
    """Return what speaks against a run; empty where nothing does."""
    if not np.isfinite(run.states).all():
        return "numbers are not finite"
    depth = -np.min(_heights(run, about)) if about["kind"] != "pair" else 0.0
    if depth > _SUNK:
        return f"{depth:.2g} m below the plane"
    first = abs(run.energy.total[0]) + 1.0
    gained = max((e.energy_change for e in run.events), default=0.0)
    if gained > _GAINED * first:
        return f"an event added {gained:.2g} J"
    if about["mu"] == 0.0 and about["kind"] != "pair":
        left = run.energy.total - run.energy.total[0]
        left -= [sum(e.energy_change for e in run.events if e.t <= t) for t in run.t]
        if np.min(np.abs([left[-1]])) > 1e-4 * first:
            return f"energy is off by {left[-1]:.2g} J"
    if about["mu"] == 0.0 and about.get("lean") == 0.0:
        along = run.v[:, 0]
        if np.ptp(along) > 1e-6:
            return f"speed along the plane changes by {np.ptp(along):.2g} m/s"
    return _against_reference(run, about) if about["kind"] == "reference" else ""


def _heights(run, about: dict) -> np.ndarray:
    """Return how high the points that touch are over the plane, shape (frames, points)."""
    shapes = about["shape"] if isinstance(about["shape"], list) else [about["shape"]]
    places, radii = [], []
    for shape in shapes:
        offset = np.array([*shape.get("offset", (0.0, 0.0)), 0.0])[:3]
        if "box" in shape:
            corners = box_corners(shape["box"])
            places += list(
                corners[np.abs(corners[:, 2]) > 0] * ([1, 1, 0] if about["planar"] else 1) + offset
            )
            radii += [0.0] * 8
        elif "sphere" in shape:
            places.append(offset)
            radii.append(shape["sphere"][0])
        else:
            radius, length = shape["capsule"]
            axis = np.array([1, 0, 0] if about["planar"] else [0, 0, 1]) * length / 2
            places += [axis, -axis]
            radii += [radius] * 2
    lean = about["lean"]
    if about["planar"]:
        x, y, a = run.q.T
        turned = np.stack([np.cos(a), -np.sin(a), np.sin(a), np.cos(a)], axis=1).reshape(-1, 2, 2)
        world = np.stack([x, y], axis=1)[:, None] + np.einsum("tij,pj->tpi", turned, np.array(places)[:, :2])
        normal = np.array([-np.sin(lean), np.cos(lean)])
    else:
        turns = Rotation.from_quat(run.q[:, [4, 5, 6, 3]]).as_matrix()
        world = run.q[:, None, :3] + np.einsum("tij,pj->tpi", turns, np.array(places))
        normal = np.array([0.0, -np.sin(lean), np.cos(lean)])
    return world @ normal - np.array(radii)


def _against_reference(run, about: dict) -> str:
    edges = about["shape"]["box"]
    fall = Fall(1.0, about["inertia"], box_corners(edges), about["e"], about["mu"])
    found, _ = fall.impacts(run.states[0], 3, 0.6)
    own = [(e.t, int(e.name.split("_")[1]) - 1) for e in run.events if e.action == "impact"][: len(found)]
    for (t, k), (own_t, own_k) in zip(found, own, strict=False):
        if k != own_k or abs(t - own_t) > 1e-5:
            return f"corner {k} hits at {t:.7g} s, not corner {own_k} at {own_t:.7g} s"
    return "" if len(own) == len(found) or found[-1][0] > run.t[-1] else "impacts are missing"


def try_one(kind: str, method: str, rng: np.random.Generator) -> tuple[str, str]:
    """Return the verdict on one random case, and what speaks against it."""
    m, about = thrown(kind, rng)
    system = m.derive()
    step = {"step": _STEP} if method in ("rk4", "semi_implicit_euler") else {}
    try:
        run = system.run(t_end=0.6, method=method, **step)
    except RuntimeModelError as error:
        return REFUSED, str(error)
    against = judge(run, about)
    if not run.ok:
        return FLAGGED, next((h.says for h in run.health if not h.ok), run.status)
    return (WRONG, against) if against else (RIGHT, "")


def try_many(kind: str, method: str, count: int, seed: int) -> tuple[Counter, list[str]]:
    """Try random cases; returns how many had which verdict, and what was said of those that are not right."""
    counts: Counter[str] = Counter()
    said = []
    for k in range(count):
        verdict, against = try_one(kind, method, np.random.default_rng([seed, KINDS.index(kind), k]))
        counts[verdict] += 1
        if against:
            said.append(f"{kind} {k} {method}: {verdict}: {against}")
    return counts, said


def main(arguments: list[str] | None = None) -> int:
    """Try cases and print a table."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.stress.contact_shapes", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--methods", nargs="+", default=["dop853", "taylor", "radau5", "rk4"])
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    given = parser.parse_args(arguments)
    wrong = 0
    for kind in given.kinds:
        for method in given.methods:
            counts, said = try_many(kind, method, given.count, given.seed)
            print(
                f"{kind:10} {method:10} " + "  ".join(f"{k} {n}" for k, n in sorted(counts.items())),
                flush=True,
            )
            for line in said:
                print(f"    {line:.300}", flush=True)
            wrong += counts[WRONG]
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
