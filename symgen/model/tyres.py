"""Tyres: what a wheel exerts that slips on the ground, with the slip that follows it by a relaxation length as states.

A tyre is put together from what models have: states, definitions, loads. Slips kappa along the way and alpha across it
obey sigma ds/dt = -v - |V| s, with the velocity v at which what touches slips and the speed V of the wheel's centre
along its way, so that s = -v / |V| where it lasts, and nothing is divided by a speed (Pacejka, Tyre and Vehicle
Dynamics, 3rd ed., 2012, chapter 7). Forces are those of the resultant slip, along it.

A wheel that leans by γ (camber) is pushed to the side that it leans to. Near no slip that is as if it slipped by
Cγ/Cα γ more (the same, ch. 4: similarity), so that a brush or the formula saturates. The formula may have terms of γ of
its own, those of MF-Tyre 5.2 (TNO, MF-Tyre user manual, 2001) for pure side slip at nominal load: D = μ (1 - pDy3 γ²),
B C D = K (1 - pKy3 |γ|), a shift pHy3 γ of the slip, and a force pVy3 γ per load.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from . import algebra
from .description import Description
from .evaluate import NotFinite, evaluate, normalised
from .functions import dot, less, maximum, sensor, where
from .names import reference_fault

TYRE_KEYS = (
    "body", "radius", "axis", "at", "spin", "stiffness", "damping", "load", "ground", "slip_stiffness", "friction",
    "magic", "table", "relaxation", "camber_stiffness", "magic_camber", "inclination",
)  # fmt: skip
_AXES = ("x", "y", "z")
_LEAST = algebra.Float(
    1e-12
)  # square of a slip: what it is divided by; and of a camber whose magnitude counts


@dataclass(frozen=True)
class Camber:
    """What leaning makes of a law: factors on the peak and on the slope at no slip, more slip, more force per load."""

    peak: algebra.Expr = algebra.ONE
    slope: algebra.Expr = algebra.ONE
    slip: algebra.Expr = algebra.ZERO
    push: algebra.Expr = algebra.ZERO


@dataclass(frozen=True)
class Tyre:
    """A tyre as it was `given`, by the keys of its table, and what it is made of.

    `made` are the names of its parts by the fields of a description; `pushes` is what it adds to the force on the
    coordinate by which its wheel turns.
    """

    name: str
    given: Mapping[str, Any]
    made: Mapping[str, frozenset[str]]
    pushes: tuple[str, algebra.Expr] | None


def without_made(d: Description, tyres: Iterable[Tyre]) -> Description:
    """The description without what tyres are made of."""
    for tyre in tyres:
        kept = {}
        for key, names in tyre.made.items():
            kept[key] = tuple(
                x for x in getattr(d, key) if (x[0] if isinstance(x, tuple) else x.name) not in names
            )
        d = replace(d, **kept)
    return d


def without_pushes(
    forces: Mapping[str, list[algebra.Expr]], tyres: Iterable[Tyre]
) -> dict[str, list[algebra.Expr]]:
    """Forces by coordinate, as lists of terms, without those of tyres."""
    left = {name: list(terms) for name, terms in forces.items()}
    for name, term in (tyre.pushes for tyre in tyres if tyre.pushes is not None):
        left[name] = [x for x in left[name] if x is not term]
    return {name: terms for name, terms in left.items() if terms}


def add_tyre(model: Any, name: str, given: Mapping[str, Any]) -> Tyre:
    """Add the states NAME_kappa and NAME_alpha, the definitions NAME_load, NAME_along, NAME_across, and the loads.

    Parameters
    ----------
    model : Model
        Whose methods put the parts together.
    name : str
    given : mapping
        By the keys of `TYRE_KEYS`.

    Returns
    -------
    Tyre
    """
    given = {key: value for key, value in given.items() if value is not None}
    before = _parts(model)
    pushes = _Maker(model, name, given).put_together()
    made = {key: frozenset(names - before[key]) for key, names in _parts(model).items()}
    return Tyre(name, given, made, pushes)


def _parts(model: Any) -> dict[str, set[str]]:
    """The names of a model's parts of the kinds that tyres are made of."""
    definitions = {name for name, _ in model._definitions}
    states = {state.name for state in model._states}
    return {
        "definitions": definitions,
        "states": states,
        "axes": set(model._axes),
        "points": set(model._points),
        "loads": set(model._loads),
    }


class _Maker:
    """What adds the parts of one tyre to a model.

    Attributes
    ----------
    planar : bool
        Whether its body moves in the ground's plane, as seen from above.
    axle, centre : sequence of Expr
        Direction and middle of the wheel, by world axes.
    reach : Expr
        How much of the axle lies in the ground's plane: the cosine of its camber.
    """

    def __init__(self, model: Any, name: str, given: Mapping[str, Any]) -> None:
        self.model, self.name, self.given, self.table = model, name, given, f"tyres.{name}"
        self._check()
        self.body, self.planar = given["body"], model._bodies[given["body"]].planar
        model._new_element(name, "tyres", model._loads)
        self.known = {x.name: x.value for x in (*model._parameters, *model._constants)}
        self.radius, self.relaxation = self._size("radius"), self._size("relaxation")

    def put_together(self) -> tuple[str, algebra.Expr] | None:
        """Add the parts; returns the force on the coordinate by which the wheel turns, if there is one."""
        self.axle = self._axle()
        place, self.centre = self._middle()
        velocity = [sensor("velocity", place, c) for c in _AXES]
        a = self.axle
        # A sum of squares, and atan2, have values everywhere, as what pieces of `taylor` choose by must.
        self.reach = algebra.sqrt(1 - a[2] ** 2 if self.planar else a[0] ** 2 + a[1] ** 2)
        along = (a[1] / self.reach, -a[0] / self.reach)
        across = (a[0] / self.reach, a[1] / self.reach)
        arm = [self.radius * x for x in ((a[2] * a[0]) / self.reach, (a[2] * a[1]) / self.reach, -self.reach)]
        spinning = self._spinning()
        turning = self._turning(spinning)
        slipping = velocity if turning is None else [v + w for v, w in zip(velocity, _cross(turning, arm))]
        load = self._load()
        speed = self.model.definition(f"{self.name}_speed", velocity[0] * along[0] + velocity[1] * along[1])
        ways = [("alpha", across)] if turning is None else [("kappa", along), ("alpha", across)]
        push = self._push(load, self._slips(ways, slipping, speed))
        self._act(push, load, arm)
        if spinning is None:
            return None
        torque = _cross(arm, [*push, algebra.ZERO][:3])
        self.model.force(spinning, sum(x * y for x, y in zip(torque, a)))
        return spinning.name, self.model._forces[spinning.name][-1]

    def _check(self) -> None:
        """Refuse what lacks a part, or has two for one."""
        given, body = self.given, self.given.get("body")
        if reference_fault(body) is not None or body not in self.model._bodies:
            message = f"there is no body {body!r:.60} above"
            raise self.error("body", message, "name a body that is declared before the tyre")
        for key in ("radius", "relaxation"):
            if key not in given:
                raise self.error(key, f"the key '{key}' is missing", "add it, in metres")
        if ("stiffness" in given) == ("load" in given):
            message = "the force on the ground is that of a 'stiffness', or a 'load'"
            raise self.error("load", message, "give one of the two")
        if self.model._bodies[body].planar and "load" not in given:
            raise self.error("stiffness", f"'{body}' is planar, and seen from above", "give a 'load'")

    def error(self, key: str, message: str, hint: str):
        return self.model._sources.error(self.table, key, message, hint=hint)

    def expression(self, key: str) -> algebra.Expr | None:
        given = self.given
        return self.model._sources.expression(given[key], self.table, key) if key in given else None

    def factors(self, key: str) -> list[algebra.Expr]:
        places = enumerate(self.given[key])
        return [self.model._sources.expression(x, self.table, f"{key}[{k}]") for k, x in places]

    def _size(self, key: str) -> algebra.Expr:
        size = self.expression(key)
        value = _value(size, self.known)
        if value is not None and not value > 0:
            message = f"the {key} is not positive at the parameters' values: {value:g} m"
            raise self.error(key, message, "look at the parameters in it")
        return size

    def _axle(self) -> Sequence[algebra.Expr]:
        components = self.model._components(self.given.get("axis", (0, 1, 0)), self.table, "axis")
        axle = _unit_vector(components, self.known)
        if axle is None:
            message = "the axle has no direction: all its components are zero"
            raise self.error("axis", message, "such as [0, 1, 0]")
        return self.model.axis(f"{self.name}_axle", self.body, axle)

    def _middle(self) -> tuple[str, list[algebra.Expr]]:
        """The point or body whose velocity is that of the wheel's middle, and where that is."""
        names = [f"{self.name}_centre_{c}" for c in _AXES]
        if "at" in self.given:
            self.model.point(f"{self.name}_centre", self.body, self.given["at"])
            return f"{self.name}_centre", [algebra.Symbol(name) for name in names]
        places = [sensor("position", self.body, c) for c in _AXES]
        return self.body, [self.model.definition(name, x) for name, x in zip(names, places)]

    def _spinning(self) -> algebra.Symbol | None:
        """The coordinate by which the wheel turns in its body."""
        if "spin" not in self.given:
            return None
        spinning = self.expression("spin")
        if not isinstance(spinning, algebra.Symbol):
            raise self.error(
                "spin", "the name of a coordinate is expected here", "that of a rotor or a joint"
            )
        return spinning

    def _turning(self, spinning: algebra.Symbol | None) -> list[algebra.Expr] | None:
        """The angular velocity of the wheel; None of one that is only steered."""
        if self.planar and spinning is None:
            return None
        turning = [sensor("angular_velocity", self.body, c) for c in _AXES]
        return turning if spinning is None else [w + dot(spinning) * x for w, x in zip(turning, self.axle)]

    def _load(self) -> algebra.Expr:
        """The force on the ground: as it is given, or that of how deep the tyre is pressed in."""
        name = f"{self.name}_load"
        if "load" in self.given:
            return self.model.definition(name, self.expression("load"))
        ground = self.expression("ground") if "ground" in self.given else algebra.ZERO
        deep = self.radius * self.reach - self.centre[2] + ground
        depth = self.model.definition(f"{self.name}_depth", deep)
        pressed = self.expression("stiffness") * depth
        if "damping" in self.given:
            pressed += self.expression("damping") * dot(depth)
        touches = less(algebra.ZERO, depth)
        return self.model.definition(name, where(touches, maximum(pressed, algebra.ZERO), algebra.ZERO))

    def _slips(self, ways, slipping: Sequence[algebra.Expr], speed: algebra.Symbol):
        """A state for each way in which the tyre may slip, with its direction."""
        slips = []
        for key, way in ways:
            of_ground = slipping[0] * way[0] + slipping[1] * way[1]
            slip = self.model.definition(f"{self.name}_{key}_speed", of_ground)
            state = algebra.Symbol(f"{self.name}_{key}")
            derivative = -(slip + algebra.Abs(speed) * state) / self.relaxation
            slips.append((self.model.state(f"{self.name}_{key}", derivative=derivative), way))
        return slips

    def _push(self, load: algebra.Expr, slips) -> list[algebra.Expr]:
        """What the ground pushes with, in its plane."""
        law, camber = _law_of(self.error, self.given), Camber()
        if _leans(self.error, self.given, law, self.planar):
            lean = self.expression("inclination")
            if lean is None:
                lean = -algebra.atan2(self.axle[2], self.reach)
            lean = self.model.definition(f"{self.name}_camber", lean)
            camber = _camber(self.expression, self.factors, self.given, law, lean)
            slips = [*slips[:-1], (slips[-1][0] + camber.slip, slips[-1][1])]
        size = algebra.sqrt(sum(s**2 for s, _ in slips) + _LEAST)
        slip = self.model.definition(f"{self.name}_slip", size)
        per_slip = load * _per_slip(self.expression, self.factors, law, camber, slip)
        pushes = [per_slip * s for s, _ in slips]
        if camber.push != 0:
            pushes[-1] += load * camber.push
        names = [f"{self.name}_along", f"{self.name}_across"][-len(slips) :]
        forces = [(self.model.definition(n, push), way) for n, push, (_, way) in zip(names, pushes, slips)]
        return [sum(f * way[k] for f, way in forces) for k in range(2)]

    def _act(self, push: list[algebra.Expr], load: algebra.Expr, arm: Sequence[algebra.Expr]) -> None:
        """Let the push, with the load where that is the tyre's own, act on the body."""
        if self.planar:
            self.model.load(self.name, point=self.centre[:2], force=push)
            return
        push.append(load if "load" not in self.given else algebra.ZERO)
        torque = _cross(arm, push)
        self.model.load(self.name, point=self.centre, force=push)
        self.model.load(f"{self.name}_turning", body=self.body, torque=torque)


def _law_of(error, given: Mapping[str, Any]) -> str:
    """Which law a tyre has, by the key that gives it."""
    laws = [key for key in ("magic", "table", "slip_stiffness") if key in given]
    if len(laws) != 1:
        hint = "a brush has slip_stiffness and friction"
        raise error("slip_stiffness", "a tyre has one law: 'slip_stiffness', 'magic' or a 'table'", hint)
    (law,) = laws
    if law == "table" and "friction" in given:
        raise error("friction", "a table has the friction in it", "leave 'friction' out")
    if law == "magic" and (not _has(given["magic"], 3) or "friction" not in given):
        message = "the formula has three factors, B, C and E, and 'friction' for D"
        raise error("magic", message, "such as [10, 1.6, 0.9]")
    return law


def _leans(error, given: Mapping[str, Any], law: str, planar: bool) -> bool:
    """Whether camber counts."""
    keys = [key for key in ("camber_stiffness", "magic_camber") if key in given]
    if len(keys) == 2:
        message = "the thrust of camber is that of 'camber_stiffness' or of 'magic_camber'"
        raise error("magic_camber", message, "leave one of the two out")
    if "magic_camber" in given:
        if law != "magic":
            hint = "others have a 'camber_stiffness'"
            raise error("magic_camber", "'magic_camber' goes with the formula that 'magic' gives", hint)
        if not _has(given["magic_camber"], 4):
            message = "the formula has four terms of camber: pDy3, pKy3, pHy3 and pVy3"
            raise error("magic_camber", message, "such as [4, 0.5, 0.01, -0.3], or zeros")
    if "inclination" in given and not keys:
        message = "an 'inclination' has no effect on a tyre without a thrust of camber"
        raise error("inclination", message, "give 'camber_stiffness' or 'magic_camber', too")
    if keys and planar and "inclination" not in given:
        message = "a planar body, seen from above, does not lean"
        raise error(
            keys[0], message, "give the 'inclination', positive towards the side that the axle points to"
        )
    return bool(keys)


def _camber(expression, factors, given: Mapping[str, Any], law: str, lean: algebra.Symbol) -> Camber:
    """What leaning makes of a law."""
    if "magic_camber" in given:
        peak, slope, slip, push = factors("magic_camber")
        size = algebra.sqrt(lean**2 + _LEAST)
        return Camber(1 - peak * lean**2, 1 - slope * size, slip * lean, push * lean)
    per_lean = expression("camber_stiffness")
    if law == "table":  # its slope is not known
        return Camber(push=per_lean * lean)
    if law == "magic":
        B, C, _ = factors("magic")
        return Camber(slip=per_lean / (expression("friction") * B * C) * lean)
    return Camber(slip=per_lean / expression("slip_stiffness") * lean)


def _per_slip(expression, factors, law: str, camber: Camber, slip: algebra.Symbol) -> algebra.Expr:
    """Force per load and slip."""
    if law == "table":
        return expression("table") / slip
    friction = expression("friction")
    if law == "magic":
        B, C, E = factors("magic")
        peak = friction * camber.peak
        x = B * camber.slope / camber.peak * slip
        return peak * algebra.sin(C * algebra.atan(x - E * (x - algebra.atan(x)))) / slip
    c = expression("slip_stiffness")
    if friction is None:
        return c
    z = c * slip / (3 * friction)
    return where(less(z, algebra.ONE), c * (1 - z + z**2 / 3), friction / slip)


def _has(value: Any, count: int) -> bool:
    return isinstance(value, (list, tuple)) and len(value) == count


def _value(expression: algebra.Expr, known: Mapping[str, float | None]) -> float | None:
    """The value that parameters and constants give it; what has none is refused where all values are checked."""
    try:
        return evaluate(expression, known)
    except NotFinite:
        return None


def _unit_vector(
    vector: Sequence[algebra.Expr], known: Mapping[str, float | None]
) -> Sequence[algebra.Expr] | None:
    """The direction of a vector, as it is where its length is 1; None of zeros."""
    values = [_value(x, known) for x in vector]
    if None in values:
        return vector
    unit = normalised(values)
    if unit is None or all(x.is_number for x in vector):
        return unit if unit is None or unit != tuple(values) else vector
    length = algebra.sqrt(algebra.by_pythagoras(sum(x**2 for x in vector)))
    return vector if length == 1 else [x / length for x in vector]


def _cross(a, b) -> list[algebra.Expr]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
