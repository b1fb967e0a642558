"""One motion written in two ways: by the tables that say it in short, and with all that these mean written out.

A cart with a pendulum, and what hangs on both: joints, springs, curves and maps, rotors, gears, uses of an assembly,
states that follow reactions, attractors, starts that are solved for and parameters that are found; beside places,
potentials, choices and accelerations by hand. Coordinates that constraints tie, some without inertia, some of which
move one mass together; beside a model in which what is tied is a definition. The form by hand runs tighter and by
another method: a run of the other one is judged by it, at its end.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from symgen.runtime.inputs import Table
from symgen.runtime.integrate.methods import find_method

from .judging import attempt, judge_end
from .models import described
from .scenario import RIGHT, Outcome, Scenario

_METHODS = (
    "taylor", "dop853", "dopri5", "radau5", "radau9", "gauss8", "auto", "bdf", "generalized_alpha", "rk4",
)  # fmt: skip
_CASES = 8  # of each kind with each method
_RTOLS = (1e-6, 1e-8, 1e-10)
_G = 9.81


@dataclass
class Text:
    """A model file while it is written."""

    coordinates: list[str] = field(default_factory=list)
    definitions: list[str] = field(default_factory=list)
    outputs: list[str] = field(default_factory=list)
    constraints: list[str] = field(default_factory=list)
    potential: list[str] = field(default_factory=list)
    dissipation: list[str] = field(default_factory=list)
    kinetic: list[str] = field(default_factory=list)
    forces: dict[str, list[str]] = field(default_factory=dict)
    parameters: list[str] = field(default_factory=list)
    equations: list[str] = field(default_factory=list)
    tables: str = ""
    gravity: str = ""

    def force(self, coordinate: str, term: str) -> None:
        """Add to the force on a coordinate."""
        self.forces.setdefault(coordinate, []).append(term)

    def __str__(self) -> str:
        parts = ['name = "drawn"']
        for name in ("parameters", "coordinates", "definitions", "outputs", "constraints"):
            parts += [f"[{name}]", *getattr(self, name)]
        parts += ["[energy]"]
        for name in ("potential", "dissipation", "kinetic"):
            terms = " + ".join(getattr(self, name))
            parts += [f'{name} = "{terms}"'] if terms else []
        parts += ["[forces]", *(f'{name} = "{" + ".join(terms)}"' for name, terms in self.forces.items())]
        parts += ["[gravity]", self.gravity, self.tables]
        if self.equations:
            parts += ["[start]", f"equations = {self.equations}".replace("'", '"')]
            parts += ['find = ["found"]'] if self.parameters else []
        return "\n".join(parts) + "\n"


@dataclass(frozen=True)
class Case:
    """One motion in both forms."""

    short: str
    by_hand: str
    inputs: dict[str, Table]
    t_end: float


class _Drawing:
    def __init__(self, number: int, kind: str):
        self.random = np.random.default_rng([number, *kind.encode()])
        self.short, self.by_hand = Text(), Text()
        self.both = (self.short, self.by_hand)

    def one(self, low: float, high: float) -> float:
        return round(float(self.random.uniform(low, high)), 3)

    def maybe(self, part: float) -> bool:
        return bool(self.random.random() < part)

    def seen(self, name: str, expression: str, by_hand: str = "") -> None:
        self.short.outputs.append(f'seen_{name} = "{expression}"')
        self.by_hand.outputs.append(f'seen_{name} = "{by_hand or expression}"')


def plane(number: int) -> Case:
    """Draw a cart with a pendulum."""
    d = _Drawing(number, "plane")
    short, by_hand, one, maybe = d.short, d.by_hand, d.one, d.maybe
    M, m, l, J, k = one(1, 4), one(0.3, 2), one(0.3, 0.9), one(0.01, 0.1), one(20, 200)
    x, v, phi, w = one(-0.2, 0.2), one(-1, 1), one(-1, 1), one(-2, 2)
    has_joint, falls, pulls = maybe(0.5), maybe(0.6), maybe(0.3)
    for form in d.both:
        form.coordinates.append(f"x = {{ start = {x}, rate = {v} }}")
        form.definitions += [f'bob_x = "x + {l}*sin(phi)"', f'bob_y = "-{l}*cos(phi)"']
        form.potential.append(f"{k}*x^2/2")
        form.tables += f'[bodies.cart]\nmass = {M}\ncom = ["x", 0]\n[bodies.bob]\nmass = {m}\ninertia = {J}\n'
    d.seen("x", "bob_x")
    d.seen("y", "bob_y")
    placed = 'com = ["bob_x", "bob_y"]\nangle = "phi"\n'
    by_hand.tables += placed
    hung = f'com = [0, -{l}]\n[joints.pin]\ntype = "revolute"\nparent = "cart"\nchild = "bob"\ncoordinate = "phi"\n'
    short.tables += hung if has_joint else placed
    by_hand.coordinates.append(f"phi = {{ start = {phi}, rate = {w} }}")
    if maybe(0.4):
        short.coordinates.append(f"phi = {{ guess = {round(phi + one(-0.1, 0.1), 3)} }}")
        short.equations += [
            f"bob_x = {x + l * math.sin(phi)!r}",
            f"dot(bob_x) = {v + l * math.cos(phi) * w!r}",
        ]
    else:
        short.coordinates.append(by_hand.coordinates[-1])
    if falls:
        short.gravity = f"y = -{_G}\n"
        by_hand.potential.append(f"{m * _G!r}*bob_y")
    if pulls:
        mu, a, b = one(0.2, 3), one(2, 3), one(-1, 1)
        short.gravity += f"[gravity.attractors.sun]\nat = [{a}, {b}]\nmu = {mu}\n"
        by_hand.potential += [
            f"-{m * mu!r}/sqrt((bob_x - {a})^2 + (bob_y - ({b}))^2)", f"-{M * mu!r}/sqrt((x - {a})^2 + ({b})^2)",
        ]  # fmt: skip
    if has_joint and not pulls and maybe(0.6):
        tau = one(0.02, 0.3)
        force = f"{m}*({l}*sin(phi)*acceleration(phi) + {l}*cos(phi)*dot(phi)^2 + {_G * falls})"
        short.tables += f'[states]\ncell = {{ derivative = "(reaction(pin, fy) - cell)/{tau}" }}\n'
        by_hand.tables += f'[states]\ncell = {{ derivative = "({force} - cell)/{tau}" }}\n'
        share = one(-3, 3)
        for form in d.both:
            form.force("x", f"{share}*cell")
        d.seen("reaction", "reaction(pin, fy)", force)
    else:
        _spring(d, l if has_joint else 0.0)
    for piece, part in ((_curve, 0.5), (_map, 0.5), (_rotor, 0.4)):
        if maybe(part):
            piece(d)
    if not pulls:
        for piece in (_found, _uses):
            if maybe(0.5):
                piece(d, falls)
    inputs = {}
    if maybe(0.5):
        times = 0.5 * np.arange(6) + d.random.uniform(0, 0.4, 6)
        inputs["F"] = Table(
            times, 3 * d.random.normal(size=6), kind=str(d.random.choice(["linear", "cubic", "hold"]))
        )
        for form in d.both:
            form.tables += "[inputs]\nF = {}\n"
            form.force("x", "F")
    return Case(str(short), str(by_hand), inputs, one(0.5, 2.5))


def _spring(d: _Drawing, below: float) -> None:
    k, c, rest, a, b = d.one(5, 100), d.one(0, 2), d.one(0.1, 0.8), d.one(0.5, 1.5), d.one(-1, 1)
    d.short.tables += (
        f'[points.tip]\nbody = "bob"\nat = [0, -{below}]\n[springs.strut]\npoints = ["tip", [{a}, {b}]]\n'
    )
    d.short.tables += f"stiffness = {k}\ndamping = {c}\nlength = {rest}\n"
    d.by_hand.definitions.append(f'span = "sqrt((bob_x - {a})^2 + (bob_y - ({b}))^2)"')
    d.by_hand.potential.append(f"{k}*(span - {rest})^2/2")
    d.by_hand.dissipation.append(f"{c}*dot(span)^2/2")
    d.seen("pull", "strut_force", f"{k}*(span - {rest}) + {c}*dot(span)")


def _curve(d: _Drawing) -> None:
    """A curve of straight lines beside choices."""
    n = int(d.random.integers(2, 6))
    xs = np.round(np.linspace(-0.35, 0.35, n) + d.random.uniform(-0.04, 0.04, n), 3).tolist()
    ys = np.round(d.random.uniform(-5, 5, n), 2).tolist()
    outside = str(d.random.choice(["hold", "extend"]))
    d.short.tables += f'[tables.curve]\ncolumns = [{xs}, {ys}]\noutside = "{outside}"\n'
    d.short.force("x", "curve(x)")
    lines = [f"{ys[i]} + {(ys[i + 1] - ys[i]) / (xs[i + 1] - xs[i])!r}*(x - ({xs[i]}))" for i in range(n - 1)]
    chosen = lines[-1]
    for i in range(n - 2, 0, -1):
        chosen = f"where(x < {xs[i]}, {lines[i - 1]}, {chosen})"
    if outside == "hold":
        chosen = f"where(x < {xs[0]}, {ys[0]}, where(x > {xs[-1]}, {ys[-1]}, {chosen}))"
    d.by_hand.force("x", f"({chosen})")


def _map(d: _Drawing) -> None:
    """A map of 3 by 2 values, held outside, beside its bilinear cells."""
    xs, ys = [-0.25, d.one(-0.1, 0.1), 0.2], [d.one(-0.8, -0.3), d.one(0.2, 0.9)]
    values = np.round(d.random.uniform(-4, 4, (3, 2)), 2).tolist()
    of = str(d.random.choice(["phi", "dot(phi)"]))
    columns = [[a for a in xs for _ in ys], [b for _ in xs for b in ys], [c for row in values for c in row]]
    d.short.tables += f'[tables.map]\ncolumns = {columns}\noutside = "hold"\n'
    d.short.force("phi", f"map(x, {of})")
    u, w = f"max({xs[0]}, min({xs[-1]}, x))", f"max({ys[0]}, min({ys[-1]}, {of}))"

    def cell(i: int) -> str:
        (a, b), (e, f) = values[i], values[i + 1]
        along, across = f"({u} - ({xs[i]}))/{xs[i + 1] - xs[i]!r}", f"({w} - ({ys[0]}))/{ys[1] - ys[0]!r}"
        return f"({a} + {along}*({e - a!r}) + {across}*({b - a!r}) + {along}*{across}*({f - e - b + a!r}))"

    d.by_hand.force("phi", f"where(x < {xs[1]}, {cell(0)}, {cell(1)})")


def _rotor(d: _Drawing) -> None:
    """A rotor in the pendulum, perhaps with another one on a gear, beside their energies."""
    J, turns, torque = d.one(0.005, 0.05), d.one(-20, 20), d.one(-0.5, 0.5)
    d.short.tables += f'[rotors.fly]\nbody = "bob"\ninertia = {J}\nstart = 0\nrate = {turns}\n'
    d.by_hand.coordinates.append(f"fly = {{ start = 0, rate = {turns} }}")
    d.by_hand.kinetic.append(f"{J}*(dot(fly) + dot(phi))^2/2")
    for form in d.both:
        form.force("fly", f"{torque}*cos(3*t) - 0.01*dot(fly)")
    d.seen("spin", "fly")
    if d.maybe(0.5):
        ratio, J = d.one(2, 8), d.one(0.001, 0.01)
        d.short.tables += f"[rotors.gear]\ninertia = {J}\nrate_guess = {turns * ratio}\n"
        d.short.constraints.append(
            f'mesh = {{ gear = {{ coordinates = ["gear", "fly"], ratio = {ratio} }} }}'
        )
        d.by_hand.kinetic.append(f"{J}*({ratio}*dot(fly))^2/2")


def _found(d: _Drawing, falls: bool) -> None:
    """A stiffness that is found from an acceleration, beside the number that it has."""
    m, z, a = d.one(0.5, 3), d.one(0.1, 0.5), d.one(-3, 3)
    stiffness = (m * _G * falls - 2 * m * a) / z
    for form in d.both:
        form.coordinates.append(f"z = {{ start = {z} }}")
        form.tables += f'[bodies.block]\nmass = {m}\ncom = ["z + 5", "-z"]\n'
    if falls:
        d.by_hand.potential.append(f"(-{m * _G!r}*z)")
    d.short.parameters.append(f"found = {round(1.1 * stiffness + 0.3, 3)}")
    d.short.equations.append(f"acceleration(z) = {a}")
    d.short.potential.append("found*z^2/2")
    d.by_hand.potential.append(f"({stiffness!r})*z^2/2")
    d.seen("z", "z")


def _uses(d: _Drawing, falls: bool) -> None:
    """Pendulums on the cart, as uses of an assembly."""
    l = d.one(0.2, 0.6)
    d.short.tables += f"""
[assemblies.bell.ports]
base = "coordinate"
[assemblies.bell.parameters]
mass = 1.0
[assemblies.bell.coordinates]
turn = {{ start = 0.3 }}
[assemblies.bell.bodies.ball]
mass = "mass"
com = ["base + {l}*sin(turn)", "-{l}*cos(turn)"]
[assemblies.bell.forces]
turn = "-0.05*dot(turn)"
base = "-0.1*dot(turn)"
"""
    for k in range(int(d.random.integers(1, 4))):
        m = d.one(0.2, 1)
        d.short.tables += f'[use.u{k}]\nassembly = "bell"\nbase = "x"\nmass = {m}\n'
        d.by_hand.coordinates.append(f"turn{k} = {{ start = 0.3 }}")
        d.by_hand.tables += (
            f'[bodies.ball{k}]\nmass = {m}\ncom = ["x + {l}*sin(turn{k})", "-{l}*cos(turn{k})"]\n'
        )
        if falls:
            d.by_hand.potential.append(f"(-{m * _G * l!r}*cos(turn{k}))")
        d.by_hand.force(f"turn{k}", f"-0.05*dot(turn{k})")
        d.by_hand.force("x", f"-0.1*dot(turn{k})")
        d.seen(f"turn{k}", f"u{k}.turn", f"turn{k}")


# What one mass hangs on: all of M may be singular, or w may have no inertia.
_MOVED = {
    "sum": '["u + w", 0]', "massless": '["u", 0]', "rod": '["0.5*sin(u) + w", "-0.5*cos(u)"]', "both": '["u", "w"]',
    "shared": '["u", "w"]', "shared sum": '["u + w", 0]',
}  # fmt: skip


def tied(number: int) -> Case:
    """Draw coordinates that constraints tie to one."""
    d = _Drawing(number, "tied")
    short, by_hand, one, maybe = d.short, d.by_hand, d.one, d.maybe
    kind = str(d.random.choice(list(_MOVED)))
    u, v, c = one(-0.5, 0.5), one(-1.5, 1.5), [one(-0.3, 0.3), one(-2, 2), one(-0.3, 0.3)]
    begins = {"u": u, "w": c[0] + c[1] * u + c[2] * math.sin(2 * u)}
    follows = f"({c[0]} + {c[1]}*u + {c[2]}*sin(2*u))"
    m, k1, k2, d1, d2 = one(0.3, 3), one(5, 60), one(0, 30), one(0, 0.4), one(0, 0.4)
    for form in d.both:
        form.coordinates.append(f"u = {{ start = {u}, rate = {v} }}")
        form.tables += f"[bodies.weight]\nmass = {m}\ncom = {_MOVED[kind]}\n"
        form.potential += [f"{k1}*u^2/2", f"{k2}*(w - 0.2)^2/2"]
        form.dissipation += [f"{d1}*dot(u)^2/2", f"{d2}*dot(w)^2/2"]
        form.force("u", "0.3*cos(2*t)")
    short.coordinates.append(f"w = {{ guess = {begins['w']!r} }}")
    by_hand.definitions.append(f'w = "{follows}"')
    if kind.startswith("shared"):
        # A coordinate without inertia stands in both constraints.
        begins["c"], between = 0.7 * u + 0.2 * u**2, "(0.7*u + 0.2*u^2)"
        short.coordinates.append(f"c = {{ guess = {begins['c']!r} }}")
        by_hand.definitions.append(f'c = "{between}"')
        short.constraints += [
            f'first = "c - {between}"',
            f'tie = "w - {follows} + 0.8*(c - {between}) + 0.3*sin(c) - 0.3*sin{between}"',
        ]
        for form in d.both:
            form.potential.append("2*c^2")
            form.dissipation.append("0.1*dot(c)^2/2")
    else:
        short.constraints.append(f'tie = "w - {follows}"')
    if maybe(0.4):
        further, has_mass = f"({one(-0.3, 0.3)} + {one(-1.5, 1.5)}*w*w + 0.3*u)", maybe(0.5)
        short.coordinates.append("s = {}")
        by_hand.definitions.append(f's = "{further}"')
        short.constraints.append(f'further = "s - {further}"')
        for form in d.both:
            form.potential.append("1.5*s^2")
            form.tables += '[bodies.extra]\nmass = 0.4\ncom = ["s", 3]\n' if has_mass else ""
    if maybe(0.5):
        for form in d.both:
            form.coordinates.append("z = { start = 0.3 }")
            form.tables += '[bodies.other]\nmass = 1.5\ncom = ["z", 1]\n'
            form.potential.append("2*(z - w)^2")
        d.seen("z", "z")
    for name in begins:
        d.seen(name, name)
    names = list(begins)
    if maybe(0.4):
        name, force = str(d.random.choice(names)), one(0.05, 2)
        for form in d.both:
            form.tables += f'[friction.rub]\nspeed = "dot({name})"\nforce = {force}\n'
    if maybe(0.4):
        name, restitution = str(d.random.choice(names)), d.random.choice([0.0, 0.5, 0.9])
        gap = f"{begins[name] + one(0.3, 0.8)!r} - {name}"
        for form in d.both:
            form.tables += f'[stops.end]\ngap = "{gap}"\nrestitution = {restitution}\n'
    return Case(str(short), str(by_hand), {}, one(0.5, 3))


_KINDS: dict[str, Callable[[int], Case]] = {"plane": plane, "tied": tied}


def compare(kind: str, number: int, method: str) -> Outcome:
    """Run the short form, and judge its end by the form that is written out."""
    case, random = _KINDS[kind](number), np.random.default_rng(number)
    adaptive = method == "auto" or find_method(method).adaptive
    options = {"rtol": float(random.choice(_RTOLS))} if adaptive else {}
    for other in ("taylor", "dop853") if method != "taylor" else ("dop853",):
        known = attempt(described(case.by_hand), case.t_end, method=other, rtol=1e-11, inputs=case.inputs)
        if not isinstance(known, Outcome) and known.status == "success":
            break
    else:
        return Outcome(RIGHT, f"no reference: {known}")
    run = attempt(described(case.short), case.t_end, method=method, inputs=case.inputs, **options)
    if isinstance(run, Outcome):
        return run
    places = [[record["name"] for record in one.system.outputs] for one in (run, known)]
    found = run.outputs[:, [places[0].index(name) for name in places[1]]]
    ranges = np.maximum(np.ptp(known.outputs, axis=0), 1e-6)
    off = float((np.abs(found[-1] - known.outputs[-1]) / ranges).max())
    return judge_end(run, off, f"{kind} {number}, {method}, {options}")


def scenarios() -> Iterator[Scenario]:
    """Yield drawn motions of each kind with each method."""
    for kind in _KINDS:
        for k, method in enumerate(_METHODS):
            for case in range(_CASES):
                run = functools.partial(compare, kind, case * len(_METHODS) + k, method)
                short = case == 0 and method in ("taylor", "dop853")
                yield Scenario("two forms", f"two forms: {kind} {case}: {method}", run, method, short)
