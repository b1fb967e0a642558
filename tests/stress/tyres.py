"""Tyres with relaxation: a spinning wheel that is set down, and cars that steer, beside equations written again.

Laws are linear, the brush model, the formula, and a table; loads, speeds, relaxations and steering are drawn, from
standing wheels to locked ones. References are SciPy's, at rtol 1e-10.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, judge_end
from .scenario import Outcome, Scenario

_CASES = 3  # of each kind with each method
_RTOLS = (1e-5, 1e-7, 1e-9)
_STEPS = (2e-4, 1e-3)  # s
_AT_REST = 1e-12  # of a slip squared, below which its direction means nothing
_LEAST = 1e-2  # of a magnitude, or of the unit, that counts as motion
_RIGHT = 3e-4
G = 9.81
Law = Callable[[float], float]


class Case(NamedTuple):
    """A model, its end [s], states by name with their truth at the end and what they go through."""

    model: Model
    t_end: float
    truth: dict[str, tuple[float, float]]


def law(r: np.random.Generator) -> tuple[dict[str, Any], Law]:
    """What a tyre is told, and force per load and slip."""
    c, most = float(r.uniform(4.0, 20.0)), float(r.uniform(0.3, 1.2))
    kind = str(r.choice(["linear", "brush", "magic", "table"]))
    if kind == "linear":
        return {"slip_stiffness": c}, lambda s: c
    if kind == "brush":

        def brush(s: float) -> float:
            z = c * s / (3.0 * most)
            return c * (1.0 - z + z * z / 3.0) if z < 1.0 else most / s

        return {"slip_stiffness": c, "friction": most}, brush
    if kind == "magic":
        shape, bend = float(r.uniform(1.1, 1.8)), float(r.uniform(-1.0, 0.9))

        def magic(s: float) -> float:
            x = c * s
            return most * np.sin(shape * np.arctan(x - bend * (x - np.arctan(x)))) / s

        return {"magic": [c, shape, bend], "friction": most}, magic
    knots = [0.0, float(r.uniform(0.05, 0.2)), float(r.uniform(0.3, 1.0)), 50.0]
    values = [0.0, 0.8 * most, most, 0.7 * most]
    return {"table": (knots, values)}, lambda s: float(np.interp(s, knots, values)) / s


def told(m: Model, name: str, known: dict[str, Any]) -> dict[str, Any]:
    """What a tyre is told, its table declared."""
    if "table" not in known:
        return known
    m.table(f"grip_{name}", columns=[list(column) for column in known["table"]], outside="hold")
    return {"table": f"grip_{name}({name}_slip)"}


def integrated(
    motion: Callable[..., list[float]], y0: list[float], t_end: float
) -> tuple[np.ndarray, np.ndarray]:
    """States at the end, and what each goes through."""
    from scipy.integrate import solve_ivp

    found = solve_ivp(motion, (0.0, t_end), y0, "LSODA", rtol=1e-10, atol=1e-12, max_step=t_end / 500.0)
    return found.y[:, -1], np.fmax(
        np.ptp(found.y, axis=1), _LEAST * np.fmax(np.abs(found.y).max(axis=1), 1.0)
    )


def set_down(r: np.random.Generator) -> Case:
    """A wheel of 10 kg that spins in the air or on the ground, rolls, slips, or is locked at first."""
    known, of_slip = law(r)
    k, c = float(10.0 ** r.uniform(4.0, 5.3)), float(r.choice([0.0, 100.0, 1000.0]))
    sigma, speed = float(10.0 ** r.uniform(-1.5, 0.0)), float(r.normal(0.0, 8.0))
    spin = float(r.choice([0.0, speed / 0.3, r.normal(0.0, 60.0)]))
    height = 0.3 + float(r.uniform(-0.02, 0.02))
    t_end = float(r.uniform(0.2, 1.5))
    m = Model("wheel", gravity=(0, 0, -G))
    more = told(m, "rim", known)
    m.body("wheel", mass=10, inertia=(0.3, 0.5, 0.3), com=(0, 0, 0))
    m.joint(
        "free", type="free", child="wheel", start=[0, 0, height, 1, 0, 0, 0], rate=[speed, 0, 0, 0, spin, 0]
    )
    m.tyre("rim", body="wheel", radius=0.3, stiffness=k, damping=c, relaxation=sigma, **more)

    def motion(t: float, y: np.ndarray) -> list[float]:
        _, z, vx, vz, turns, slip = y
        depth = 0.3 - z
        load = max(0.0, k * depth - c * vz) if depth > 0.0 else 0.0
        pull = load * of_slip(float(np.sqrt(slip**2 + _AT_REST))) * slip
        return [
            vx,
            vz,
            pull / 10,
            load / 10 - G,
            -0.3 * pull / 0.5,
            -(vx - 0.3 * turns + abs(vx) * slip) / sigma,
        ]

    end, sizes = integrated(motion, [0.0, height, speed, 0.0, spin, 0.0], t_end)
    names = {"free_x": 0, "free_z": 1, "free_wy": 4, "rim_kappa": 5}
    return Case(m, t_end, {name: (float(end[k]), float(sizes[k])) for name, k in names.items()})


def car(r: np.random.Generator) -> Case:
    """A car on two tyres whose front one is turned at once, at 1 to 50 m/s."""
    speed, lead, lag = (
        float(10.0 ** r.uniform(0.0, 1.7)),
        float(r.uniform(0.8, 1.6)),
        float(r.uniform(0.8, 1.8)),
    )
    turned = float(r.uniform(-0.1, 0.1))
    sigma, t_end = float(r.uniform(0.1, 1.0)), float(r.uniform(0.5, 4.0))
    m = Model("car")
    laws = [law(r), law(r)]
    front, rear = told(m, "front", laws[0][0]), told(m, "rear", laws[1][0])
    x, y, psi = m.coordinate("x", rate=speed), m.coordinate("y"), m.coordinate("psi")
    m.body("car", mass=1200, inertia=1800, com=(x, y), angle=psi)
    common = {"body": "car", "radius": 0.3, "relaxation": sigma}
    m.tyre("front", at=(lead, 0), axis=(-np.sin(turned), np.cos(turned)), load=6800, **front, **common)
    m.tyre("rear", at=(-lag, 0), axis=(0, 1), load=5000, **rear, **common)

    def motion(t: float, s: np.ndarray) -> list[float]:
        yaw, u, v, rate, *slips = s[2:]
        ahead = np.array([np.cos(yaw), np.sin(yaw)])
        force, torque, changes = np.zeros(2), 0.0, []
        for place, own, load, (_, of_slip), slip in zip(
            (lead, -lag), (turned, 0.0), (6800.0, 5000.0), laws, slips, strict=True
        ):
            way = np.array([np.cos(yaw + own), np.sin(yaw + own)])
            side = np.array([-way[1], way[0]])
            moves = np.array([u - rate * place * ahead[1], v + rate * place * ahead[0]])
            push = load * of_slip(float(np.sqrt(slip**2 + _AT_REST))) * slip * side
            force += push
            torque += place * (ahead[0] * push[1] - ahead[1] * push[0])
            changes.append(-(moves @ side + abs(moves @ way) * slip) / sigma)
        return [u, v, rate, *(force / 1200.0), torque / 1800.0, *changes]

    end, sizes = integrated(motion, [0, 0, 0, speed, 0, 0, 0, 0], t_end)
    names = {"x": 0, "y": 1, "psi": 2, "dot(y)": 4, "front_alpha": 6, "rear_alpha": 7}
    return Case(m, t_end, {name: (float(end[k]), float(sizes[k])) for name, k in names.items()})


KINDS = {"set down": set_down, "car": car}


def tyre(kind: str, number: int, method: str) -> Outcome:
    """Run a case and judge it."""
    r = np.random.default_rng([number, *kind.encode()])
    case = KINDS[kind](r)
    system = runtime.load(derive_text(case.model).text)
    given = (
        {"rtol": float(r.choice(_RTOLS))}
        if find_method(method).adaptive
        else {"step": float(r.choice(_STEPS))}
    )
    run = attempt(system, case.t_end, method=method, **given)
    if isinstance(run, Outcome):
        return run
    off = {name: abs(float(run[name][-1]) - value) / size for name, (value, size) in case.truth.items()}
    worst = max(off, key=off.get)
    return judge_end(run, off[worst], f"{worst}, {method}, {given}, to {case.t_end:.4g} s", right=_RIGHT)


def scenarios() -> Iterator[Scenario]:
    """Yield cases of each kind with each method."""
    for kind in KINDS:
        for k, method in enumerate(METHODS):
            for number in range(_CASES):
                run = functools.partial(tyre, kind, number * len(METHODS) + k, method)
                short = number == 0 and method in ("dop853", "radau5")
                yield Scenario(f"tyre: {kind}", f"tyre: {kind} {number}: {method}", run, method, short)
