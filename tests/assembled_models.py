"""Random models of nested assemblies, and the same models written out by hand: names with underscores, places in text.

Each assembly has a swinging body that is placed by hand, an arm on a joint, springs, a load, a state, a curve, a
switch, events, outputs by choice; nested ones hang on what the outer one gives them.
"""

from __future__ import annotations

import random
import re
from dataclasses import dataclass, field
from typing import Any

from symgen import Model

CURVE = {"columns": [[-2.0, -1.0, 0.5, 2.0], [-1.0, -0.2, 0.3, 2.0]], "kind": "cubic", "outside": "extend"}


@dataclass
class Plan:
    """What is drawn of an assembly; `uses` are those inside: a name, a plan, and what they are given."""

    name: str
    spring: bool
    load: bool
    state: bool
    table: bool
    switch: bool
    event: bool
    number: float
    uses: list[tuple[str, Plan, dict[str, Any]]] = field(default_factory=list)


def planned(rng: random.Random, name: str, depth: int) -> Plan:
    """Draw an assembly, with others inside."""
    flags = [rng.random() < 0.6 for _ in range(6)]
    plan = Plan(name, *flags, round(rng.uniform(0.2, 1.5), 3))
    if depth:
        inner = planned(rng, f"{name}i", depth - 1)
        plan.uses = [(f"u{k}", inner, given(rng, "l*sin(th)", "th")) for k in range(rng.choice((1, 2)))]
    return plan


def given(rng: random.Random, hinge: str, driven: str) -> dict[str, Any]:
    """Draw what a use gives: ports, parameters by number or formula or not at all, a place."""
    said: dict[str, Any] = {"hinge": f"0.5*{hinge}", "driven": driven}
    if rng.random() < 0.6:
        said["l"] = rng.choice([0.7, "2*b", "b + 0.1"])
    if rng.random() < 0.7:
        said["offset"] = [round(rng.uniform(-1, 1), 3), "b"]
    if rng.random() < 0.7:
        said["angle"] = rng.choice([0.4, "a/3", "pi/2", 1.1])
    return said


def say(m: Model, plan: Plan) -> None:
    """Describe an assembly as its author does."""
    m.port("hinge", "value", unit="m")
    m.port("driven", "coordinate")
    m.parameter("k", "50 N/m")  # of the model that uses it
    m.parameter("l", "0.6 m")
    m.parameter("b", "0.25 m")
    m.parameter("a", 0.2)
    m.parameter("own", plan.number)
    m.coordinate("th", start=f"own + {plan.number}")
    m.definition("height", "-l*cos(th)")
    m.body("bob", mass=1.2, com=["hinge + l*sin(th)", "height"], inertia=0.05, angle="th")
    m.body("arm", mass=0.8, inertia=0.03, com=["l/2", 0.05])
    m.joint("pin", "revolute", "arm", origin={"xyz": ["0.1", "b", 0], "rpy": [0, 0, 0.2]}, stiffness=3.0, rest=0.1,
            damping=0.05, rate=0.3)  # fmt: skip
    m.point("tip", "arm", ("l", 0))
    m.point("wall", "world", ("b", -0.2))
    m.force("driven", "-own*dot(th) + 0.1*pin")
    m.dissipation("0.05*(dot(th) - dot(driven))^2")
    m.potential("own*(tip_x - b)^2/2")
    if plan.spring:
        m.spring("bow", points=["tip", "wall"], stiffness="k", length="l/2", damping=0.3)
        m.spring("cord", points=[["hinge", 0], "tip"], stiffness="k/4", length=0)
    if plan.load:
        m.load("push", point="tip", force=["own", "-0.3*tip_y"])
        m.load("twist", body="arm", torque="-0.2*dot(pin)")
    if plan.state:
        m.state("lag", "(tip_x - lag)/0.3", start="l/3", unit="m")
        m.force("th", "-own*lag")
    if plan.table:
        curve = m.table("curve", **CURVE)
        m.force("pin", -curve("pin"))
    if plan.switch:
        m.force("pin", "where(tip_y > height, -0.4*own, 0.2)")
    if plan.event:
        m.event("low", "tip_y - height", "falling", {"reset": {"dot(th)": "-0.5*dot(th) + 0.1*dot(driven)"}})
    m.output("seen", "tip_x + 2*tip_y")
    m.output("speed", "velocity(tip, y) + b*arm.wz")
    for name, inner, said in plan.uses:
        part = m._shelf.names().get(inner.name)
        if part is None:
            part = m.assembly(inner.name)
            say(part, inner)
        m.use(name, inner.name, **said)


@dataclass
class Place:
    """Where the world of an assembly is: texts of its origin and its angle."""

    x: str = "0"
    y: str = "0"
    a: str = "0"

    def point(self, x: Any, y: Any) -> tuple[str, str]:
        return (f"({self.x}) + cos({self.a})*({x}) - sin({self.a})*({y})",
                f"({self.y}) + sin({self.a})*({x}) + cos({self.a})*({y})")  # fmt: skip

    def vector(self, x: Any, y: Any) -> tuple[str, str]:
        return (f"cos({self.a})*({x}) - sin({self.a})*({y})", f"sin({self.a})*({x}) + cos({self.a})*({y})")

    def back(self, x: str, y: str) -> tuple[str, str]:
        dx, dy = f"({x} - ({self.x}))", f"({y} - ({self.y}))"
        return f"(cos({self.a})*{dx} + sin({self.a})*{dy})", f"(cos({self.a})*{dy} - sin({self.a})*{dx})"


def write_out(
    m: Model, plan: Plan, p: str, said: dict[str, Any], outer: dict[str, str], place: Place
) -> None:
    """Describe the same by hand; `outer` are the names that the outer model has, by what the use calls them."""

    def seen(text: Any) -> str:
        """A text of the outer model, with its names written out."""
        words = str(text)
        for name, full in outer.items():
            words = _replaced(words, name, full)
        return f"({words})"

    ox, oy = (seen(x) for x in said.get("offset", (0, 0)))
    x, y = place.point(ox, oy)
    here = Place(x, y, f"({place.a}) + {seen(said.get('angle', 0))}")
    hinge, driven, k, b = seen(said["hinge"]), outer[said["driven"]], outer["k"], outer["b"]
    own = outer.get("own") or m.parameter(f"{p}own", plan.number).name
    given_l = said.get("l")
    if isinstance(given_l, str):
        l = seen(given_l)
    else:
        l = outer["l"] if given_l is None else m.parameter(f"{p}l", given_l).name
    th, pin = f"{p}th", f"{p}pin"
    m.coordinate(th, start=f"{own} + {plan.number}")
    height = f"(-{l}*cos({th}))"
    tip_x, tip_y = here.back(f"{p}tip_x", f"{p}tip_y")
    m.body(
        f"{p}bob",
        mass=1.2,
        com=here.point(f"{hinge} + {l}*sin({th})", height),
        inertia=0.05,
        angle=f"{here.a} + {th}",
    )
    m.body(f"{p}arm", mass=0.8, inertia=0.03, com=[f"{l}/2", 0.05])
    at = here.point("0.1", b)
    m.joint(pin, "revolute", f"{p}arm", origin={"xyz": [*at, 0], "rpy": [0, 0, f"{here.a} + 0.2"]}, stiffness=3.0,
            rest=0.1, damping=0.05, rate=0.3)  # fmt: skip
    m.point(f"{p}tip", f"{p}arm", (l, 0))
    wall = here.point(b, -0.2)
    m.force(driven, f"-{own}*dot({th}) + 0.1*{pin}")
    m.dissipation(f"0.05*(dot({th}) - dot({driven}))^2")
    m.potential(f"{own}*({tip_x} - {b})^2/2")
    if plan.spring:
        m.spring(f"{p}bow", points=[f"{p}tip", wall], stiffness=k, length=f"{l}/2", damping=0.3)
        m.spring(f"{p}cord", points=[here.point(hinge, 0), f"{p}tip"], stiffness=f"{k}/4", length=0)
    if plan.load:
        force = here.vector(own, f"-0.3*{tip_y}")
        m.load(f"{p}push", point=[f"{p}tip_x", f"{p}tip_y"], force=force)
        m.load(f"{p}twist", body=f"{p}arm", torque=f"-0.2*dot({pin})")
    if plan.state:
        m.state(f"{p}lag", f"({tip_x} - {p}lag)/0.3", start=f"{l}/3", unit="m")
        m.force(th, f"-{own}*{p}lag")
    if plan.table:
        curve = m.table(f"{p}curve", **CURVE)
        m.force(pin, -curve(pin))
    if plan.switch:
        m.force(pin, f"where({tip_y} > {height}, -0.4*{own}, 0.2)")
    if plan.event:
        then = {"reset": {f"dot({th})": f"-0.5*dot({th}) + 0.1*dot({driven})"}}
        m.event(f"{p}low", f"{tip_y} - {height}", "falling", then)
    m.output(f"{p}seen", f"{tip_x} + 2*{tip_y}")
    speed = f"cos({here.a})*dot({p}tip_y) - sin({here.a})*dot({p}tip_x)"
    m.output(f"{p}speed", f"{speed} + {b}*dot({pin})")
    names = {"tip_x": tip_x, "th": th, "k": k, "b": b, "l": l, "a": outer["a"], "own": own}
    for name, inner, more in plan.uses:
        write_out(m, inner, f"{p}{name}_", more, names, here)


def _replaced(text: str, name: str, full: str) -> str:
    return re.sub(rf"(?<![A-Za-z0-9_]){name}(?![A-Za-z0-9_])", lambda _: full, text)


def outermost(name: str) -> Model:
    """The model that uses them: a slider, and what all share."""
    m = Model(name, gravity=(0, "-9.81 m/s^2"))
    m.parameter("k", "60 N/m")
    m.parameter("b", "0.3 m")
    m.parameter("l", "0.55 m")
    m.parameter("a", 0.9)
    m.coordinate("x", unit="m", start=0.2)
    m.body("cart", mass="3 kg", com=("x", 0))
    return m


def pair(seed: int) -> tuple[Model, Model]:
    """A random model of assemblies, and the same written out."""
    rng = random.Random(seed)
    plan = planned(rng, "part", rng.choice((0, 1, 2)))
    uses = [(f"c{k}", given(rng, "x", "x")) for k in range(rng.choice((1, 2)))]
    made, flat = outermost("assembled"), outermost("assembled")
    say(made.assembly("part"), plan)
    for name, said in uses:
        made.use(name, "part", **said)
        shared = {x: x for x in ("x", "k", "b", "l", "a")}
        write_out(flat, plan, f"{name}_", said, shared, Place())
    return made, flat
