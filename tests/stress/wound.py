"""Bushings and springs over angles that are wound up, to less than where their torque jumps and by several turns.

A disc turns back and forth, undamped or damped, in a plane or about a hinge; the truth is a motion in closed form,
whose torque goes on in proportion to the angle. Springs over coordinates count turns; bushings, and springs over angles
of directions, forget them, and whoever winds one up so far has to be told. Some are members of ensembles.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import RIGHT_END, WRONG_END, attempt, judge_end, refusal
from .scenario import RIGHT, WRONG, Outcome, Scenario

_CASES = 4  # of each kind with each method
_NEAR = 0.02  # of where a torque jumps: nothing is said of a motion that turns back there
_MEMBERS = 16
KINDS = ("bushing", "hinge", "pair", "direction", "coil")


class Wound(NamedTuple):
    """A disc, and what it does: its amplitude without damping [rad], its frequency and damping [1/s]."""

    model: Model
    amplitude: float
    w: float
    c: float
    start: float
    rate: float
    jumps_at: float

    def truth(self, t: np.ndarray) -> np.ndarray:
        """Return the angle and its rate, shape (n, 2)."""
        root = -self.c + 1j * math.sqrt(self.w**2 - self.c**2)
        size = complex(self.start, (root.real * self.start - self.rate) / root.imag)
        turned = size * np.exp(root * t)
        return np.stack([turned.real, (root * turned).real], axis=1)


def draw(r: np.random.Generator, kind: str) -> Wound:
    """A disc of one kg m^2 on something that is wound up."""
    w = float(10.0 ** r.uniform(-0.5, 2.5))
    c = w * float(r.choice([0.0, 0.02, 0.2]))
    turns_at = math.pi
    amplitude = float(r.uniform(0.05, 0.97) if r.random() < 0.5 else r.uniform(1.03, 8.0)) * turns_at
    phase = float(r.uniform(0.0, 2.0 * math.pi))
    start, rate = amplitude * math.cos(phase), amplitude * w * math.sin(phase)
    if kind != "coil" and abs(start) > 0.9 * turns_at:  # it begins unwound
        start, rate = 0.0, amplitude * w
    m = Model("wound")
    k, d = w * w, 2.0 * c
    if kind in ("hinge", "direction"):
        m.body("disc", mass=1, inertia=[1.0, 1.0, 1.0])
        m.joint("hinge", "revolute", "disc", axis=[0, 0, 1], start=start, rate=rate, coordinate="turned")
    else:
        m.coordinate("turned", unit="rad", start=start, rate=rate)
        m.body("disc", mass=1, com=(0, 0), inertia=1.0, angle="turned")
    if (
        kind == "pair"
    ):  # of two discs that turn against each other: each of twice the inertia of their difference
        m = Model("wound")
        for name, sign in (("turned", 1.0), ("other", -1.0)):
            m.coordinate(name, unit="rad", start=0.5 * sign * start, rate=0.5 * sign * rate)
        m.body("disc", mass=1, com=(0, 0), inertia=2.0, angle="turned")
        m.body("hub", mass=1, com=(0, 0), inertia=2.0, angle="other")
        m.bushing("rubber", frames=["hub", "disc"], stiffness=[100, 100, k], damping=[1, 1, d])
    elif kind == "direction":
        m.definition("turned_by", "angle(world, disc, z)")
        m.spring("coil", angle="turned_by", stiffness=k)
        m.force("turned", f"-{d!r}*dot(turned)")
    elif kind == "coil":
        m.spring("coil", angle="turned", stiffness=k, damping=d)
    else:
        six = kind == "hinge"
        m.bushing(
            "rubber", frames=["world", "disc"], stiffness=[100, 100, 100, k, k, k] if six else [100, 100, k],
            damping=[1, 1, 1, d, d, d] if six else [1, 1, d],
        )  # fmt: skip
    return Wound(m, amplitude, w, c, start, rate, math.inf if kind == "coil" else turns_at)


def furthest(case: Wound, t_end: float) -> float:
    """How far it would turn."""
    return float(np.abs(case.truth(np.linspace(0.0, t_end, 20_001))[:, 0]).max())


def wound(kind: str, number: int, method: str) -> Outcome:
    """Run a case and judge it."""
    r = np.random.default_rng([number, *kind.encode()])
    case = draw(r, kind)
    t_end = float(r.uniform(0.5, 6.0)) * 2.0 * math.pi / case.w
    system = runtime.load(derive_text(case.model).text)
    options = {"rtol": float(10.0 ** r.uniform(-9.0, -5.0))} if find_method(method).adaptive else {}
    if not options:
        options = {"step": t_end / float(10.0 ** r.uniform(2.3, 3.5))}
    if r.random() < 0.5:
        options["fps"] = float(r.uniform(8.0, 60.0)) / t_end
    run = attempt(system, t_end, method=method, **options)
    if isinstance(run, Outcome):
        return run
    end = case.truth(run.t[-1:])[0] * (0.5 if kind == "pair" else 1.0)
    columns = [0, system.nq]
    size = (0.5 if kind == "pair" else 1.0) * case.amplitude * np.array([1.0, case.w])
    off = float((np.abs(run.states[-1, columns] - end) / size).max())
    far = furthest(case, t_end)
    beyond, said = far > case.jumps_at, f"{kind} to {far:.3f} rad, {method}, {options}, to {t_end:.4g} s"
    if abs(far / case.jumps_at - 1.0) < _NEAR:
        return Outcome(RIGHT, f"near to where it jumps: {said}")
    if beyond and not run.objections:
        return Outcome(WRONG, f"nothing says that it is wound up, error {off:.1e}: {said}")
    return judge_end(run, off, said)


def members(kind: str, number: int, method: str) -> Outcome:
    """Run discs with rates of their own as members, and judge each."""
    r = np.random.default_rng([number, *f"{kind} members".encode()])
    case = draw(r, kind)._replace(start=0.0)
    t_end = float(r.uniform(0.5, 3.0)) * 2.0 * math.pi / case.w
    system = runtime.load(derive_text(case.model).text)
    rates = np.sort(r.uniform(0.2, 2.5, _MEMBERS)) * math.pi * case.w
    options = {"rtol": 1e-8} if find_method(method).adaptive else {"step": t_end / 2000.0}
    try:
        e = system.ensemble(
            t_end, method=method, start={"turned": 0.0}, rate={"turned": rates}, keep=["turned"], **options
        )
    except RuntimeModelError as error:
        return refusal(error)
    for k, rate in enumerate(rates):
        one = case._replace(rate=rate)
        far, end = furthest(one, t_end), one.truth(np.array([t_end]))[0, 0]
        off = abs(float(e["turned"][k]) - end) * case.w / rate
        if abs(far / case.jumps_at - 1.0) < _NEAR or e.verdicts.status[k] != 1:
            continue
        said = f"{kind}, member {k} of {rates.tolist()}, w {case.w}, c {case.c}, {method}, to {t_end}: error {off:.1e}"
        if e.verdicts.ok[k] and (far > case.jumps_at or off > WRONG_END):
            return Outcome(WRONG, f"nothing says that it is wound up to {far:.3f} rad: {said}")
        if not e.verdicts.ok[k] and far < case.jumps_at and off < RIGHT_END:
            return Outcome(WRONG, f"doubted, wound up to {far:.3f} rad alone: {said}")
    return Outcome(RIGHT, f"{e.n_doubtful} of {_MEMBERS} doubtful")


def scenarios() -> Iterator[Scenario]:
    """Yield cases of each kind with each method, and ensembles."""
    for kind in KINDS:
        for k, method in enumerate(METHODS):
            for number in range(_CASES):
                run = functools.partial(wound, kind, number * len(METHODS) + k, method)
                short = number == 0 and method in ("taylor", "radau5")
                yield Scenario(f"wound: {kind}", f"wound: {kind} {number}: {method}", run, method, short)
            if kind != "pair":
                run = functools.partial(members, kind, k, method)
                name = f"wound: members of {kind}: {method}"
                yield Scenario("wound: members", name, run, method, method == "dop853")
