"""Motions of models that are drawn, too: no two cases of `error growth --drawn` have the same equations.

Chains, lattices, fields, bodies that attract each other, first-order states that are chaotic by themselves, forces that
switch, stops and friction under a drive, curves, trees and loops of bodies, and bundled models with other numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from symgen import Model, cos, dot, exp, sin, sqrt, t
from symgen.runtime import System

from . import constrained_models, random_models
from .models import bundled, made

G = 9.81
PLAIN = (("radau13", 1e-13), ("dop853", 1e-14))
WITH_EVENTS = (("radau13", 1e-13), ("dop853", 1e-13))
# Collocation is accurate at the ends of steps; where forces have kinks, it finds these on its polynomial, to 1e-9.
SWITCHING = (("dop853", 2e-14), ("taylor", 1e-14))
SMOOTH = (("taylor", 1e-15), ("dop853", 1e-14))


@dataclass(frozen=True)
class Draw:
    """A model with a start, times to run to, and what knows its motion."""

    system: System
    times: tuple[float, float, float]
    given: dict[str, Any] = field(default_factory=dict)
    references: tuple[tuple[str, float], tuple[str, float]] = SMOOTH


def chain(rng: np.random.Generator) -> Draw:
    """Two to four bars in angles, with springs and dampers between some, the first driven at times."""
    n = int(rng.integers(2, 5))
    model = Model("drawn_chain", gravity=(0, -G))
    x, y, before, relative = 0, 0, 0, rng.random() < 0.5
    for k in range(n):
        given = model.coordinate(f"a{k}", start=float(rng.normal(0, 1.2)), rate=float(rng.normal(0, 1.0)))
        angle = before + given if relative else given
        l, m = float(rng.uniform(0.2, 1.5)), float(10 ** rng.uniform(-1, 0.7))
        model.body(f"b{k}", mass=m, inertia=m * l * l / 12 * float(rng.choice([0.0, 1.0])),
                   com=(x + l / 2 * sin(angle), y - l / 2 * cos(angle)), angle=angle)  # fmt: skip
        if rng.random() < 0.3:
            model.force(given, -float(rng.uniform(0, 20)) * given)
        if rng.random() < 0.3:
            model.force(given, -float(10 ** rng.uniform(-3, 0)) * dot(given))
        x, y, before = x + l * sin(angle), y - l * cos(angle), angle
    if rng.random() < 0.3:
        model.force("a0", float(rng.uniform(0, 10)) * cos(float(rng.uniform(0.5, 8)) * t))
    return Draw(made(model), (4.0, 15.0, 60.0))


def lattice(rng: np.random.Generator) -> Draw:
    """Masses in a row on springs that harden or soften, between walls or not, one of them stiff at times."""
    n = int(rng.integers(2, 6))
    model = Model("drawn_lattice")
    xs = [
        model.coordinate(f"x{k}", start=float(rng.normal(0, 0.7)), rate=float(rng.normal(0, 0.5)))
        for k in range(n)
    ]
    cubic, quartic = float(rng.normal(0, 0.3)), float(rng.uniform(0.05, 2))
    stiff, stiffness = (int(rng.integers(n)) if rng.random() < 0.3 else None), float(10 ** rng.uniform(2, 5))
    model.kinetic(sum(float(rng.uniform(0.3, 3)) * dot(x) ** 2 for x in xs) / 2)
    potential = quartic * xs[0] ** 4 / 4 + xs[0] ** 2 / 2
    for k in range(1, n):
        d = xs[k] - xs[k - 1]
        potential += (stiffness if k == stiff else 1.0) * d**2 / 2 + cubic * d**3 / 3 + quartic * d**4 / 4
    model.potential(potential)
    if rng.random() < 0.4:
        model.dissipation(float(10 ** rng.uniform(-3, -0.5)) * sum(dot(x) ** 2 for x in xs))
    if rng.random() < 0.4:
        model.force(xs[-1], float(rng.uniform(0.1, 5)) * cos(float(rng.uniform(0.3, 3)) * t))
    return Draw(made(model), (20.0, 100.0, 400.0), references=PLAIN)


def potential_field(rng: np.random.Generator) -> Draw:
    """A point in a confining field of two or three coordinates with hills, cubic terms and turning at times."""
    names = "xyz"[: int(rng.integers(1, 4))]
    model = Model("drawn_field")
    q = [model.coordinate(c, start=float(rng.normal(0, 1)), rate=float(rng.normal(0, 0.8))) for c in names]
    m = rng.uniform(0.5, 2, len(q))
    model.kinetic(sum(float(a) * dot(x) ** 2 for a, x in zip(m, q, strict=True)) / 2)
    r2 = sum(x**2 for x in q)
    potential = float(rng.uniform(0.05, 0.5)) * r2**2 + sum(float(rng.normal(0, 1)) * x**2 for x in q)
    for _ in range(int(rng.integers(0, 4))):
        place = rng.normal(0, 1, len(q))
        off = sum((x - float(p)) ** 2 for x, p in zip(q, place, strict=True))
        potential += float(rng.normal(0, 3)) * exp(-off * float(rng.uniform(0.5, 8)))
    model.potential(potential)
    if len(q) > 1 and rng.random() < 0.4:  # a magnetic field: no work
        b = float(rng.normal(0, 1))
        model.force(q[0], b * dot(q[1]))
        model.force(q[1], -b * dot(q[0]))
    if rng.random() < 0.3:
        model.force(q[0], float(rng.uniform(0.1, 2)) * sin(float(rng.uniform(0.3, 3)) * t))
    return Draw(made(model), (20.0, 100.0, 500.0))


def attracted(rng: np.random.Generator) -> Draw:
    """Two to four masses that attract each other in a plane, softened."""
    n = int(rng.integers(2, 5))
    model = Model("drawn_masses")
    places = [
        (model.coordinate(f"x{k}", start=float(rng.normal(0, 1)), rate=float(rng.normal(0, 0.3))),
         model.coordinate(f"y{k}", start=float(rng.normal(0, 1)), rate=float(rng.normal(0, 0.3))))
        for k in range(n)
    ]  # fmt: skip
    masses, soft = rng.uniform(0.3, 1.5, n), float(10 ** rng.uniform(-2, -0.5))
    model.kinetic(
        sum(float(m) * (dot(x) ** 2 + dot(y) ** 2) for m, (x, y) in zip(masses, places, strict=True)) / 2
    )
    potential = 0
    for i in range(n):
        for k in range(i):
            (a, b), (c, d) = places[i], places[k]
            potential -= float(masses[i] * masses[k]) / sqrt((a - c) ** 2 + (b - d) ** 2 + soft)
    model.potential(potential)
    return Draw(made(model), (3.0, 15.0, 60.0))


def chaotic_states(rng: np.random.Generator) -> Draw:
    """A mass that is driven by first-order states: Lorenz's, Rössler's, or a filter behind a noise of sines."""
    model = Model("drawn_states")
    x = model.coordinate("x", start=float(rng.normal(0, 0.5)))
    kind = int(rng.integers(3))
    start = [float(each) for each in rng.normal(1, 1, 3)]
    if kind == 0:
        rho = float(rng.choice([14.0, rng.uniform(24.5, 60)]))
        for name, rate, at in zip(
            "uvw", ("10*(v - u)", f"u*({rho} - w) - v", "u*v - 8/3*w"), start, strict=True
        ):
            model.state(name, rate, start=at)
    elif kind == 1:
        c = float(rng.uniform(2.5, 8))
        for name, rate, at in zip("uvw", ("-v - w", "u + 0.2*v", f"0.2 + w*(u - {c})"), start, strict=True):
            model.state(name, rate, start=at)
    else:
        model.state(
            "u", f"(sin(3*t)*cos({float(rng.uniform(1, 9))}*t) + x - u)/{float(10 ** rng.uniform(-3, 0))}"
        )
    model.kinetic(float(rng.uniform(0.5, 4)) * dot(x) ** 2 / 2)
    model.force(x, f"{float(10 ** rng.uniform(-2, 0.5))}*u - {float(rng.uniform(1, 20))}*x - 0.2*dot(x)")
    return Draw(made(model), (5.0, 20.0, 80.0), references=PLAIN)


def switching(rng: np.random.Generator) -> Draw:
    """An oscillator under a drive whose force switches: a sign, a dead band, a bilinear spring, a relay."""
    model = Model("drawn_switches")
    x = model.coordinate("x", start=float(rng.normal(0, 1)), rate=float(rng.normal(0, 1)))
    model.kinetic(dot(x) ** 2 / 2)
    gap, k = float(rng.uniform(0.05, 0.8)), float(10 ** rng.uniform(0, 2.5))
    force = (
        "-sign(x)",
        f"-{k}*(max(x - {gap}, 0) + min(x + {gap}, 0))",
        f"-x - where(x > {gap}, {k}*(x - {gap}), 0)",
        f"-abs(x)*x - where(mod(t, {float(rng.uniform(1, 4))}) < 0.7, {gap}, -{gap})",
    )[int(rng.integers(4))]
    drive = f"{float(rng.uniform(0, 3))}*cos({float(rng.uniform(0.4, 4))}*t)"
    model.force(x, f"{force} + {drive} - {float(10 ** rng.uniform(-3, -0.7))}*dot(x)")
    return Draw(made(model), (10.0, 50.0, 200.0), references=SWITCHING)


def hitting(rng: np.random.Generator) -> Draw:
    """A driven oscillator between stops, a ball on a table that shakes, or a block on a belt under a drive."""
    model = Model("drawn_hits")
    x = model.coordinate("x", start=float(rng.uniform(0.1, 0.6)), rate=float(rng.normal(0, 0.5)))
    model.kinetic(dot(x) ** 2 / 2)
    w, a = float(rng.uniform(0.8, 6)), float(rng.uniform(0.05, 1))
    kind = int(rng.integers(3))
    if kind == 0:
        model.force(x, f"-{float(rng.uniform(0.5, 9))}*x - 0.05*dot(x) + {4 * a}*cos({w}*t)")
        model.stop("right", "0.7 - x", restitution=float(rng.uniform(0.2, 1)))
    elif kind == 1:
        model.force(x, f"-{G}")
        model.stop("table", f"x - {0.2 * a}*sin({w}*t)", restitution=float(rng.uniform(0.2, 0.95)))
    else:
        model.force(x, f"-{float(rng.uniform(2, 50))}*x + {4 * a}*cos({w}*t)")
        model.friction(
            "belt", speed=f"dot(x) - {float(rng.normal(0, 0.5))}", force=float(rng.uniform(0.1, 4))
        )
    return Draw(made(model), (3.0, 15.0, 60.0), references=WITH_EVENTS)


def curved(rng: np.random.Generator) -> Draw:
    """An oscillator under a drive on a spring that is a curve through points."""
    model = Model("drawn_curve")
    at = np.sort(np.r_[-6.0, rng.uniform(-3, 3, 6), 6.0])
    forces = np.cumsum(rng.uniform(-0.5, 2.0, 8)) + at
    forces -= forces.mean()
    kind = str(rng.choice(["linear", "pchip", "cubic"]))
    spring = model.table("spring", columns=[at.tolist(), forces.tolist()], kind=kind, outside="extend")
    x = model.coordinate("x", start=float(rng.normal(0, 1)), rate=float(rng.normal(0, 1)))
    model.kinetic(dot(x) ** 2 / 2)
    c = float(10 ** rng.uniform(-3, -0.5))
    model.force(x, -spring(x) - c * dot(x) + float(rng.uniform(0, 3)) * cos(float(rng.uniform(0.4, 4)) * t))
    return Draw(made(model), (10.0, 50.0, 200.0), references=WITH_EVENTS)


def tree(rng: np.random.Generator) -> Draw:
    """A tree of bodies on joints in space."""
    index = 2 * int(rng.integers(1_000_000))
    system, given = random_models.draw(index)
    return Draw(system, (1.0, 4.0, 12.0), given)


def loop(rng: np.random.Generator) -> Draw:
    """A plane chain of bars between two points."""
    system, given = random_models.draw(2 * int(rng.integers(1_000_000)) + 1)
    return Draw(system, (1.0, 4.0, 12.0), given)


def constrained(rng: np.random.Generator) -> Draw:
    """Rolling, pinned, closed, driven, redundant: what the tests of forms draw."""
    _, drawn = constrained_models.draw(int(rng.integers(1_000_000)))
    return Draw(drawn.system, (0.5 * drawn.t_end, drawn.t_end, 4 * drawn.t_end), drawn.given)


_BUNDLED: dict[str, tuple[tuple[str, float], tuple[str, float]]] = {
    **dict.fromkeys(
        ("pendulum", "double_pendulum", "spring_pendulum", "spinning_top", "cart_pole", "four_bar", "slider_crank",
         "andrews_squeezer", "rolling_disc", "wheel_set", "turntable", "free_rigid_body", "heavy_top_absolute",
         "outer_solar_system", "bricard"), SMOOTH),
    **dict.fromkeys(("quarter_car", "car_axis", "damped_spring_pendulum", "stiff_bushing_pendulum",
                     "stiff_spring_pendulum", "rough_road", "engine_mounts"), (("radau13", 1e-13), ("taylor", 1e-14))),
    **dict.fromkeys(("bouncing_ball", "stick_slip", "door_stop", "crane"), WITH_EVENTS),
}  # fmt: skip


def other_numbers(rng: np.random.Generator) -> Draw:
    """A bundled model with some of its parameters changed, and other starts where these are free."""
    name = list(_BUNDLED)[int(rng.integers(len(_BUNDLED)))]
    system = bundled(name)
    t_end = float(system.run_defaults["t_end"])
    parameters = {
        each["name"]: float(each["value"] * np.exp(rng.normal(0, 0.25)))
        for each in system.parameters
        if rng.random() < 0.5 and each["value"] != 1.0
    }
    start = {
        c["name"]: c["value"] + float(rng.normal(0.0, 0.2 * (abs(c["value"]) + 0.1)))
        for c in system.coordinates
        if c["enforced"] and not system.quaternions and not system.m
    }
    return Draw(
        system, (0.5 * t_end, t_end, 4.0 * t_end), {"parameters": parameters, "start": start}, _BUNDLED[name]
    )


FAMILIES: tuple[Callable[[np.random.Generator], Draw], ...] = (
    chain, lattice, potential_field, attracted, chaotic_states, switching, hitting, curved, tree, loop, constrained,
    other_numbers,
)  # fmt: skip
