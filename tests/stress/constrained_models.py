"""Random models whose constraints take turns at determining coordinates: rolling, pinned, closed, driven, redundant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from symgen import Model, cos, sin
from symgen.runtime import System

from .models import bundled, made
from .random_models import loop

G = 9.81


@dataclass(frozen=True)
class Drawn:
    """A model and the arguments of its run.

    Attributes
    ----------
    system : System
    t_end : float [s]
    given : dict
        Parameters and starts.
    exact : callable or None
        (first q, first v) -> {place in the last (q, v): value}, where part of the motion is known in closed form.
    """

    system: System
    t_end: float
    given: dict[str, Any] = field(default_factory=dict)
    exact: Callable[[np.ndarray, np.ndarray], dict[int, float]] | None = None


def _solid(rng: np.random.Generator, size: float) -> dict[str, Any]:
    """Return mass, centre and inertias of a random solid body: six point masses."""
    masses, places = rng.uniform(0.1, 1.0, 6), rng.uniform(-size, size, (6, 3))
    com = masses @ places / masses.sum()
    r = places - com
    tensor = np.einsum(
        "k,kij->ij", masses, (r * r).sum(1)[:, None, None] * np.eye(3) - r[:, :, None] * r[:, None]
    )
    inertia = [float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return {"mass": float(masses.sum()), "com": com.tolist(), "inertia": inertia}


def _turn(rng: np.random.Generator) -> tuple[list[float], np.ndarray]:
    """Return a random quaternion, and its matrix."""
    q = rng.normal(size=4)
    w, x, y, z = q = q / np.linalg.norm(q)
    return q.tolist(), np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def _free(model: Model, body: str, place: Any, turn: Any, speed: Any, spin: Any) -> dict[str, str]:
    """Let a body move freely from about this state; returns the world components of its spin as expressions."""
    model.joint(
        f"{body}_j", "free", body, guess=[*map(float, place), *turn], rate_guess=[*map(float, speed), *map(float, spin)]
    )  # fmt: skip
    for k, axis in enumerate("xyz"):
        model.axis(f"{body}_e{axis}", body, [float(i == k) for i in range(3)])
    return {c: "(" + " + ".join(f"{body}_e{a}_{c}*{body}_j_w{a}" for a in "xyz") + ")" for c in "xyz"}


def turntable(rng: np.random.Generator) -> Drawn:
    """A ball on a turntable: its centre moves on a circle, at k / (1 + k) of the table's rate, k = I / (m r²)."""
    model = Model("turntable", gravity=(0, 0, -G))
    r, k, m, rate = (
        float(rng.uniform(*each)) for each in ((0.05, 0.5), (0.2, 0.66), (0.1, 10.0), (-4.0, 4.0))
    )
    model.body("ball", mass=m, com=(0, 0, 0), inertia=[k * m * r * r] * 3)
    turn, matrix = _turn(rng)
    (x, y), (u, v) = rng.normal(size=2), rng.normal(size=2)
    spin = matrix.T @ [(rate * x - v) / r, (u + rate * y) / r, rng.normal(0, 3)]
    w = _free(model, "ball", (x, y, r), turn, (u, v, 0), spin)
    if rng.random() < 0.5:
        model.constraint("height", f"ball_j_z - {r}")
    else:
        model.velocity_constraint("height", "ball_j_vz")
    model.velocity_constraint("slip_x", f"ball_j_vx - {r}*{w['y']} + {rate}*ball_j_y")
    model.velocity_constraint("slip_y", f"ball_j_vy + {r}*{w['x']} - {rate}*ball_j_x")
    t_end, turns = 20.0, rate * k / (1 + k)

    def exact(q: np.ndarray, start: np.ndarray) -> dict[int, float]:
        speed = complex(*start[:2])
        end = speed * np.exp(1j * turns * t_end)
        place = complex(*q[:2]) + (end - speed) / (1j * turns)
        return {0: place.real, 1: place.imag, 7: end.real, 8: end.imag}

    return Drawn(made(model), t_end, exact=exact)


def unbalanced_ball(rng: np.random.Generator) -> Drawn:
    """A ball with any inertia about any centre that rolls on a level or tilted plane."""
    tilt = float(rng.choice([0.0, rng.uniform(-0.3, 0.3)]))
    model = Model("unbalanced_ball", gravity=(G * np.sin(tilt), 0, -G * np.cos(tilt)))
    r = float(rng.uniform(0.3, 0.6))
    model.body("ball", **_solid(rng, 0.5 * r))
    w = _free(model, "ball", (0, 0, r), _turn(rng)[0], (0, 0, 0), rng.normal(0, 3, 3))
    model.constraint("height", f"ball_j_z - {r}")
    model.velocity_constraint("slip_x", f"ball_j_vx - {r}*{w['y']}")
    model.velocity_constraint("slip_y", f"ball_j_vy + {r}*{w['x']}")
    return Drawn(made(model), 3.0)


def disc(rng: np.random.Generator) -> Drawn:
    """A disc as a free body that rolls on a plane: one position and two rates are held."""
    model = Model("disc", gravity=(0, 0, -G))
    r, m = float(rng.uniform(0.2, 0.6)), float(rng.uniform(0.5, 3))
    model.body("disc", mass=m, com=(0, 0, 0), inertia=[m * r * r / 4, m * r * r / 2, m * r * r / 4])
    lean, spin = rng.uniform(-0.3, 0.3), rng.uniform(6, 12)
    turn = [np.cos(lean / 2), np.sin(lean / 2), 0.0, 0.0]
    w = _free(
        model,
        "disc",
        (0, 0, r * np.cos(lean)),
        turn,
        (r * spin, 0, 0),
        (rng.normal(0, 0.3), spin, rng.normal(0, 0.5)),
    )
    model.definition("flat", "sqrt(1 - disc_ey_z^2)")
    # From the centre to the point that touches the plane: -r (z - (z.e) e) / |...|.
    arm = [f"({r}*disc_ey_z*disc_ey_x/flat)", f"({r}*disc_ey_z*disc_ey_y/flat)", f"(-{r}*flat)"]
    model.constraint("height", f"disc_j_z - {r}*flat")
    model.velocity_constraint("slip_x", f"disc_j_vx + {w['y']}*{arm[2]} - {w['z']}*{arm[1]}")
    model.velocity_constraint("slip_y", f"disc_j_vy + {w['z']}*{arm[0]} - {w['x']}*{arm[2]}")
    return Drawn(made(model), 2.0)


def disc_in_angles(rng: np.random.Generator) -> Drawn:
    """The bundled disc in three angles: which rates determine the others changes with the heading."""
    lean = float(rng.uniform(-0.4, 0.4))
    rates = {
        "yaw": float(rng.normal(0, 1)),
        "lean": float(rng.normal(0, 0.3)),
        "spin": float(rng.uniform(4, 9)),
    }
    return Drawn(
        bundled("rolling_disc"), 3.0, {"start": {"lean": lean, "z": float(np.cos(lean))}, "rate": rates}
    )


def pinned(rng: np.random.Generator) -> Drawn:
    """One to three free bodies of any inertia, each pinned at a point to the one before, the first to the world."""
    model = Model("pinned", gravity=(0, 0, -G))
    place, before = np.zeros(3), "world"
    for k in range(int(rng.integers(1, 4))):
        name, (turn, matrix) = f"b{k}", _turn(rng)
        arm, tip = rng.normal(0, 0.3, 3), rng.normal(0, 0.3, 3)
        model.body(name, **_solid(rng, 0.4))
        _free(model, name, place - matrix @ arm, turn, (0, 0, 0), rng.normal(0, 3, 3))
        model.point(f"{name}_pin", name, arm.tolist())
        model.point(f"{name}_hook", before, [0.0, 0.0, 0.0] if k == 0 else tip_before.tolist())  # noqa: F821
        model.coincident(f"{name}_hangs", f"{name}_pin", f"{name}_hook")
        place, before, tip_before = place + matrix @ (tip - arm), name, tip  # noqa: F841
    return Drawn(made(model), 1.5)


def spatial_loop(rng: np.random.Generator) -> Drawn:
    """Two or three bodies on ball joints (one on a hinge at times) whose end is held at a point."""
    model = Model("spatial_loop", gravity=(0, 0, -G))
    before, place, matrix, n = "world", np.zeros(3), np.eye(3), int(rng.integers(2, 4))
    for k in range(n):
        tip = rng.normal(0, 0.4, 3)
        model.body(f"b{k}", **_solid(rng, 0.3))
        origin = {"xyz": [0.0] * 3 if k == 0 else last.tolist()}  # noqa: F821
        if k == 2 and rng.random() < 0.5:
            model.joint(
                f"j{k}", "revolute", f"b{k}", before, origin, axis=rng.normal(size=3).tolist(), guess=0.0
            )
            own = matrix
        else:
            turn, own = _turn(rng)
            model.joint(
                f"j{k}",
                "spherical",
                f"b{k}",
                before,
                origin,
                guess=turn,
                rate_guess=rng.normal(0, 2, 3).tolist(),
            )
            own = matrix @ own
        place, matrix, last, before = place + own @ tip, own, tip, f"b{k}"
    model.point("end", before, last.tolist())
    model.point("held", "world", place.tolist())
    model.coincident("closed", "end", "held")
    return Drawn(made(model), 1.5)


def bars(rng: np.random.Generator) -> Drawn:
    """A plane chain of three to five bars between two points, thrown hard enough to turn over."""
    n = int(rng.integers(3, 6))
    lengths, angles = rng.uniform(0.3, 1.0, n), rng.uniform(-np.pi, np.pi, n)
    end = lengths @ np.exp(1j * angles)
    values = {"px": float(end.real), "py": float(end.imag), "c": 0.0}
    for k in range(n):
        values |= {f"m{k}": float(10.0 ** rng.uniform(-1, 1)), f"l{k}": float(lengths[k])}
    start = {f"a{k}": float(angles[k]) for k in range(n)}
    return Drawn(
        loop(n, False), 2.0, {"parameters": values, "start": start, "rate": {"a0": float(rng.normal(0, 6))}}
    )


def swinging_points(rng: np.random.Generator) -> Drawn:
    """A chain of points in x and y on rods, some rods given twice, the first hung from a point that shakes at times."""
    model = Model("swinging_points", gravity=(0, -G))
    shake = "0.2*sin(3*t)" if rng.random() < 0.5 else "0"
    before, place, rate = (shake, "0"), np.zeros(2), np.zeros(2)
    for k in range(int(rng.integers(1, 4))):
        l, angle, spin = rng.uniform(0.3, 1.0), rng.uniform(-np.pi, np.pi), rng.normal(0, 6)
        place = place + l * np.array([np.cos(angle), np.sin(angle)])
        rate = rate + l * spin * np.array([-np.sin(angle), np.cos(angle)])
        for c in range(2):
            model.coordinate(f"{'xy'[c]}{k}", guess=float(place[c]), rate_guess=float(rate[c]))
        model.body(f"p{k}", mass=float(rng.uniform(0.2, 2)), com=(f"x{k}", f"y{k}"))
        square = f"(x{k} - {before[0]})^2 + (y{k} - {before[1]})^2"
        model.constraint(f"rod{k}", f"{square} - {l**2}")
        if rng.random() < 0.3:
            model.constraint(f"again{k}", f"sqrt({square}) - {l}")
        before = (f"x{k}", f"y{k}")
    return Drawn(made(model), 2.0)


def growing_rod(rng: np.random.Generator) -> Drawn:
    """A point in three coordinates on a rod whose length changes over time, in a plane that turns at times."""
    model = Model("growing_rod", gravity=(0, 0, -G))
    place, rate = rng.normal(size=3), rng.normal(0, 2, 3)
    turning = rng.random() < 0.5
    if turning:
        place[1] = 0.0
    for c in range(3):
        model.coordinate("xyz"[c], guess=float(place[c]), rate_guess=float(rate[c]))
    model.body("bob", mass=1.0, com=("x", "y", "z"))
    length, part = np.linalg.norm(place), rng.uniform(0.1, 0.5)
    model.constraint("rod", f"x^2 + y^2 + z^2 - ({length}*(1 + {part}*sin({rng.uniform(1, 4)}*t)))^2")
    if turning:
        turns = rng.uniform(-3, 3)
        model.constraint("plane", f"y*cos({turns}*t) - x*sin({turns}*t)")
    return Drawn(made(model), 3.0)


def skate(rng: np.random.Generator) -> Drawn:
    """A sleigh on one or two edges on a slope: which rate follows from the others changes with the heading."""
    model = Model("skate", gravity=(float(rng.uniform(-3, 3)), 0, -G))
    angle, speed, spin = rng.uniform(-3, 3), rng.normal(0, 2), rng.normal(0, 4)
    ahead, arm = float(rng.choice([0.0, rng.uniform(-0.5, 0.5)])), float(rng.uniform(0.3, 0.8))
    heading = (np.cos(angle), np.sin(angle))
    x, y = (
        model.coordinate(c, start=0.0, rate_guess=float(speed * h))
        for c, h in zip("xy", heading, strict=True)
    )
    a = model.coordinate("a", start=float(angle), rate=float(spin))
    com = (x + ahead * cos(a), y + ahead * sin(a), 0)
    model.body("sleigh", mass=1.0, inertia=[0.1, 0.1, 0.1], com=com, rotation=[("z", a)])
    model.velocity_constraint("edge", "-dot(x)*sin(a) + dot(y)*cos(a)")
    if rng.random() < 0.5:
        b = model.coordinate("b", start=float(rng.uniform(-1, 1)), rate_guess=0.0)
        back = (x - arm * cos(a) - arm * cos(a + b), y - arm * sin(a) - arm * sin(a + b), 0)
        model.body("trailer", mass=0.5, inertia=[0.05, 0.05, 0.05], com=back, rotation=[("z", a), ("z", b)])
        model.velocity_constraint(
            "wheels",
            f"-(dot(x) + {arm}*sin(a)*dot(a))*sin(a + b) + (dot(y) - {arm}*cos(a)*dot(a))*cos(a + b)"
            f" - {arm}*(dot(a) + dot(b))",
        )  # fmt: skip
    return Drawn(made(model), 3.0)


def tied_ball(rng: np.random.Generator) -> Drawn:
    """A ball that rolls while a rod ties a point of it, or its centre, to a pole: positions and rates are held."""
    model = Model("tied_ball", gravity=(0, 0, -G))
    r = float(rng.uniform(0.2, 0.4))
    model.body("ball", **_solid(rng, 0.5 * r))
    turn, matrix = _turn(rng)
    place, spot = np.array([1.0, 0.0, r]), rng.choice([0.0, 1.0]) * rng.normal(0, 0.1, 3)
    w = _free(model, "ball", place, turn, (0, 0, 0), rng.normal(0, 3, 3))
    model.point("spot", "ball", spot.tolist())
    top = np.array([0.0, 0.0, rng.uniform(0, 1)])
    model.point("top", "world", top.tolist())
    model.distance("rod", "spot", "top", float(np.linalg.norm(place + matrix @ spot - top)))
    model.constraint("height", f"ball_j_z - {r}")
    model.velocity_constraint("slip_x", f"ball_j_vx - {r}*{w['y']}")
    model.velocity_constraint("slip_y", f"ball_j_vy + {r}*{w['x']}")
    return Drawn(made(model), 2.0)


def driven_bars(rng: np.random.Generator) -> Drawn:
    """Two bars behind a crank that is driven at a rate, or swings over time; the last slides or hangs on a spring."""
    model = Model("driven_bars", gravity=(0, -G))
    a, b, c = (model.coordinate(n, guess=g) for n, g in (("a", 0.3), ("b", 0.2), ("c", 0.1)))
    l = rng.uniform(0.3, 0.8, 3)
    x, y = 0, 0
    for name, angle, length in zip("abc", (a, b, c), l, strict=True):
        model.body(
            f"bar_{name}", mass=1.0, inertia=float(length**2) / 12, angle=angle,
            com=(x + length / 2 * cos(angle), y + length / 2 * sin(angle)),
        )  # fmt: skip
        x, y = x + length * cos(angle), y + length * sin(angle)
    rate = float(rng.uniform(1, 5))
    model.constraint("drive", f"a - 0.3 - {rate}*t" if rng.random() < 0.5 else f"a - 0.3 - sin({rate}*t)")
    model.constraint("guide", y - float(l @ np.sin([0.3, 0.2, 0.1]))) if rng.random() < 0.5 else None
    return Drawn(made(model), 2.0)


FAMILIES: dict[str, Callable[[np.random.Generator], Drawn]] = {
    f.__name__: f
    for f in (
        turntable, unbalanced_ball, disc, disc_in_angles, pinned, spatial_loop, bars, swinging_points, growing_rod,
        skate, tied_ball, driven_bars,
    )
}  # fmt: skip


def draw(index: int) -> tuple[str, Drawn]:
    """Return the family and the model of an index."""
    name = list(FAMILIES)[index % len(FAMILIES)]
    return name, FAMILIES[name](np.random.default_rng([index, 13]))
