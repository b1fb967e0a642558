"""Models written as TOML and read again: the tables that were given, and the same equations to the letter."""

from __future__ import annotations

import random
import re
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest

from symgen.link import derive_text
from symgen.model.toml_reader import READERS, read_text

# What is there for the tables to be about.
BASE = """
[parameters]
k = "20 N/m"
l = { value = 0.5, unit = "m", doc = "a length" }
mu = 0.3

[constants]
c0 = "2 N*s/m"
c1 = { value = 0.1, unit = "N*m*s" }

[coordinates]
x = { unit = "m", start = 0.3, rate = -0.2 }
y = { unit = "m", guess = 0.1 }
phi = { start = "10 deg", rate_guess = 0.5 }

[inputs]
push = { unit = "N", table = [[0, 1, 2], [0, 3, 1]], kind = "cubic" }
pull = { unit = "N", default = 0.5 }

[bodies.cart]
mass = "2 kg"
com = ["x", "y", 0]
inertia = [0.3, 0.2, "0.3 kg*m^2"]
rotation = [["z", "phi"], ["x", 0.1]]

[bodies.wheel]
mass = "1 kg"
inertia = [0.02, 0.04, 0.02]
shape = { cylinder = [0.3, 0.1] }

[bodies.arm]
density = "7850 kg/m^3"
shape = [{ box = ["l", 0.02, 0.01], offset = ["l/2", 0, 0] }, { cylinder = [0.005, 0.02], cut = true }]

[joints.float]
type = "free"
child = "wheel"
origin = { xyz = [0, 3, 0.31], rpy = [0.1, 0, 0] }
rate = [1.0, 0, 0, 0, -3.0, 0.1]

[joints.pin]
type = "revolute"
parent = "world"
child = "arm"
origin = { xyz = [0, "l", 2] }
axis = [0, 1, 0]
start = 0.2
damping = 0.1
stiffness = "3 N*m"
rest = 0.1
limits = [-2, "1 + mu"]

[points.tip]
body = "arm"
at = ["l", 0, 0]

[frames.corner]
body = "cart"
at = [0.1, 0.2, 0]
rpy = [0, 0, 0.4]

[frames.mount]
at = [0, 4, 1]
axis = [0, 0, 1]
angle = "20 deg"

[axes.along]
body = "arm"
direction = [1, 0, 0]

[gravity]
z = "-9.81 m/s^2"
"""


def number(r: random.Random, low: float = 0.1, high: float = 2.0) -> float:
    return round(r.uniform(low, high), r.randint(1, 6))


def some(r: random.Random, **keys: str) -> str:
    """Some of the lines."""
    return "".join(f"{key} = {value}\n" for key, value in keys.items() if r.random() < 0.6)


def states(r):
    start = r.choice(['start = "0.1 N"', 'guess = 0.2, unit = "N"', 'start = "0.2*k*l"', 'unit = "N"'])
    yield "states", f'force = {{ derivative = "(push - force)/(0.1 + {number(r)})", {start} }}\n'


def tables(r):
    kind = r.choice(["linear", "pchip", "cubic"])
    outside = r.choice(["hold", "extend", "refuse"])
    columns = f"[[-3, 0, {number(r)}, 4], [0.1, 2, {number(r, 3, 4)}, 5]]"
    body = f'columns = {columns}\nkind = "{kind}"\noutside = "{outside}"\n' + some(r, units='["m", "N"]')
    yield "tables.curve", body
    yield "forces", 'x = "-curve(x) + push"\ny = "-3*dot(y)"\n'


def energies(r):
    potential = r.choice(["k*(x - l)^2/2", "k*x^2/2 + 0.1*phi^2"])
    yield "energy", f'potential = "{potential}"\ndissipation = "c0*dot(x)^2/2"\n'


def loads(r):
    more = r.choice(["", 'frame = "corner"\n', 'reaction = "world"\n'])
    yield "loads.gust", f'point = ["x", "y", 0]\nforce = ["{number(r)} N", "pull", 0]\n{more}'
    yield "loads.torque", f'body = "arm"\ntorque = [0, "{number(r)} N*m", "0.1*sin(t)"]\n'


def springs(r):
    rest = 'length = "l"\n' + r.choice([some(r, damping='"c0"', preload='"0.1 N"'), 'acts = "pull"\n'])
    place = r.choice(['["tip", "corner"]', '["tip", [0, "l", 0]]'])
    yield "springs.strut", f'points = {place}\nstiffness = "{number(r)}*k"\n{rest}'
    yield "springs.coil", f'angle = "phi"\nstiffness = {number(r)}\nrest = 0.2\n' + some(r, damping="0.1")


def bushings(r):
    yield (
        "bushings.soft",
        f'frames = ["mount", "arm"]\nstiffness = [10, 20, {number(r)}, 1, 2, 3]\n'
        + some(r, damping="[1, 1, 1, 0.1, 0.1, 0.1]"),
    )


def stops(r):
    yield "stops.floor", f'gap = "y + {number(r, 1, 2)}"\n' + some(r, restitution='"mu"')


def friction(r):
    along = r.choice(['coordinate = "phi"', 'speed = "2*dot(phi)"'])
    size = r.choice(['torque = "0.1 N*m"', "force = 0.2", f'force = 0.2\nsmooth = "{number(r)} 1/s"'])
    size += "\nstatic = 0.5" if "smooth" not in size and r.random() < 0.5 else ""
    yield "friction.hinge", f"{along}\n{size}\n"
    if r.random() < 0.5:
        yield "friction.sole", 'coordinates = ["x", "y"]\nforce = "2 N"\n'


def bristles(r):
    along = r.choice(['coordinate = "x"', 'speed = "dot(x) - dot(y)"'])
    level = r.choice(['coulomb = "mu*k*l"', f'coulomb = 2\nstatic = {number(r, 2, 3)}\nstribeck = "0.1 m/s"'])
    rest = some(r, damping='"3 N*s/m"', viscous='"c0"', start=r.choice(["0.001", '"0.01*l"']), unit='"m"')
    yield "bristles.rub", f'{along}\nstiffness = "{number(r, 50, 90)} N/m"\n{level}\n{rest}'


def contacts(r):
    law = r.choice(
        [
            some(r, restitution="0.5", friction='"mu"'),
            f"stiffness = 1e5\nexponent = 1.5\ndamping = {number(r)}\n",
        ]
    )
    shape = r.choice(
        [
            "",
            "shape = { sphere = [0.2] }\n",
            "shape = [{ sphere = [0.2] }, { sphere = [0.1], offset = [0, 0, 0.2] }]\n",
        ]
    )
    yield "contacts.ground", f'body = "wheel"\n{shape or "shape = { sphere = [0.3] }"}\n{law}'
    if r.random() < 0.5:
        yield "contacts.wall", f'gap = "3 - x"\nstiffness = "{number(r, 100, 200)}"\nexponent = 1.5\n'


def constraints(r):
    yield "constraints", r.choice(['level = "y - 0.1*x"\n', 'level = "y - 0.1 - l*0"\n'])
    kind = r.choice(
        [
            f'gear = {{ coordinates = ["pin", "phi"], ratio = {number(r)} }}',
            'gear = { coordinates = ["pin", "phi"], teeth = [20, 31], efficiency = 0.9 }',
            'rack = { coordinates = ["phi", "x"], radius = "l", offset = "0.2 m" }',
            f'belt = {{ coordinates = ["pin", "phi"], radii = [{number(r)}, "l"], crossed = true }}',
            'couple = { expression = "pin - 2*phi" }',
            'motion = { coordinate = "phi", follows = "0.2 + 0.3*t" }',
        ]
    )
    yield "constraints.gears", f"{kind}\n"


def loops(r):
    yield "points.top", 'body = "wheel"\nat = [0, 0, 0.1]\n'
    yield "points.hook", "at = [0, 3, 3]\n"
    kind = r.choice(
        [
            'coincident = ["top", "hook"]',
            'distance = { points = ["top", "hook"], length = "3 m" }',
            'point_in_plane = { point = "top", plane = "hook", normal = [0, 0, 1] }',
            'point_on_line = { point = "top", line = "hook", direction = [0, 1, 1] }',
            'parallel = { bodies = ["wheel", "world"], axes = [[0, 0, 1], [0, 0, 1]] }',
        ]
    )
    yield "constraints.held", f"{kind}\n"


def closures(r):
    kind = r.choice(["revolute", "spherical", "universal", "prismatic", "screw", "fixed"])
    lines = f'type = "{kind}"\nframes = ["mount", "wheel"]\n'
    if kind in ("revolute", "prismatic"):
        lines += 'coordinate = "turned"\nguess = 0.1\n' if r.random() < 0.5 else ""
        lines += some(r, axis="[0, 1, 0]", damping="0.3") if "turned" in lines else some(r, axis="[0, 1, 0]")
    yield "closures.hinge", lines + ("pitch = 0.01\n" if kind == "screw" else "")


def rotors(r):
    yield (
        "rotors.spin",
        f'body = "cart"\ninertia = "{number(r)} kg*m^2"\n'
        + some(r, at="[0.1, 0, 0]", axis="[0, 1, 0]", rate="3", gyroscopic="false"),
    )


def rolling(r):
    kind = r.choice(
        [
            "ball = 0.3\n",
            'disc = "0.3 m"\naxis = [0, 1, 0]\n',
            "wheel = 0.3\naxis = [0, 1, 0]\n",
            "knife = [1, 0, 0]\n",
        ]
    )
    yield "frames.table", "at = [0, 0, 0]\nrpy = [0.1, 0, 0]\n"
    holds = 'holds = "across"\n' if "wheel" in kind and r.random() < 0.3 else ""
    yield "rolling.roll", f'body = "wheel"\n{kind}' + some(r, plane='"table"') + holds


def tyres(r):
    law = r.choice(
        [
            f'slip_stiffness = {number(r, 5, 9)}\nfriction = "mu"\n',
            f'magic = [10, "{number(r, 1, 2)}", 0.9]\nfriction = 0.8\n',
            "slip_stiffness = 8.5\n",
        ]
    )
    down = r.choice(
        ['load = "20 N"\n', 'stiffness = "100*k"\ndamping = "c0"\n' + some(r, ground='"0.01*wheel.x"')]
    )
    yield (
        "tyres.rear",
        f'body = "wheel"\nradius = "0.3 m"\n{law}{down}relaxation = "l"\n'
        + some(r, axis="[0, 1, 0.1]", at='[0, "l/10", 0]'),
    )
    yield "forces", 'phi = "-2*phi"\n'


def spun_tyres(r):
    yield "rotors.spun", f'body = "wheel"\naxis = [0, 1, 0]\ninertia = {number(r)}\nrate = 10\n'
    yield (
        "tyres.front",
        'body = "wheel"\nradius = 0.3\nspin = "spun"\nload = 30\nslip_stiffness = 10\nfriction = 1\nrelaxation = 0.2\n',
    )
    if r.random() < 0.5:
        yield "forces", 'spun = "-c1*dot(spun)"\n'


def events(r):
    action = r.choice(['"terminate"', '"record"', '{ reset = { "dot(x)" = "-mu*dot(x)", y = "y + 0.1" } }'])
    yield (
        "events.wall",
        f'when = "x - {number(r)}"\ndirection = "{r.choice(["rising", "falling", "both"])}"\nthen = {action}\n',
    )


def starts(r):
    yield (
        "start",
        'equations = ["y = 0.2 m", "dot(y) - 0.1*dot(x)"]\n'
        if r.random() < 0.5
        else 'equations = ["y - l"]\n',
    )


def drawings(r):
    yield (
        "draw.strut",
        r.choice(
            [
                'spring = [[0, 0, 0], ["x", "y", 0]]\n',
                'pin = ["x", 0, 0]\n',
                'force = [["x", "y", 0], ["push", 0, 0]]\n',
            ]
        ),
    )


def velocities(r):
    yield "velocity_constraints", f'skate = "dot(x)*sin(phi) - {number(r)}*dot(y)"\n'


def outputs(r):
    yield "definitions", 'speed = "sqrt(dot(x)^2 + dot(y)^2)"\n'
    yield "outputs", 'fast = "speed*2"\nheight = "tip_z"\nfelt = "reaction(pin, fz)"\n'
    yield "states", 'felt_slowly = { derivative = "(reaction(pin, fz) - felt_slowly)/0.1" }\n'


def runs(r):
    yield "run", f't_end = {number(r)}\nmethod = "dop853"\n'


def uses(r):
    angle = r.choice(["", f"angle = {number(r)}\n", 'angle = "mu"\n'])
    yield "assemblies.bob.parameters", 'm = "1 kg"\n'
    yield "assemblies.bob.ports", 'at = "coordinate"\nsize = { kind = "value", unit = "m" }\n'
    yield "assemblies.bob.coordinates", "th = { guess = 0.2 }\n"
    yield "assemblies.bob.bodies.ball", 'mass = "m"\ncom = ["at + size*sin(th)", "-size*cos(th)", 0]\n'
    yield "assemblies.bob.start", 'equations = ["th - 0.1"]\n'
    yield "use.one", f'assembly = "bob"\nat = "x"\nsize = "l/2"\n{angle}'
    yield (
        "use.two",
        f'assembly = "bob"\nat = "y"\nsize = 0.4\nm = "{number(r)} kg"\noffset = [0, {number(r)}]\n',
    )


PARTS = (
    states, tables, energies, loads, springs, bushings, stops, friction, bristles, contacts, constraints, loops,
    closures, rotors, rolling, tyres, spun_tyres, events, starts, drawings, velocities, outputs, runs, uses,
)  # fmt: skip


def written(r: random.Random, parts) -> str:
    """A model file with the base and the parts."""
    tables: dict[str, list[str]] = {}
    for part in parts:
        for heading, body in part(r):
            tables.setdefault(heading, []).append(body)
    blocks = [f"[{heading}]\n{''.join(dict.fromkeys(bodies))}" for heading, bodies in tables.items()]
    return 'name = "any"\n' + BASE + "\n" + "\n".join(blocks)


def names(tables: dict[str, Any], within: str = "") -> Iterator[str]:
    """The tables of a file and what is named in them."""
    for key, value in tables.items():
        here = f"{within}{key}"
        yield here
        if isinstance(value, dict) and within.count(".") < (1 if not here.startswith("assemblies") else 4):
            yield from names(value, f"{here}.")


# Keys that say the same as others, of which one is written.
SAME = re.compile(
    r"frames\.\w+\.(axis|angle|at|body|rpy)|.*\.(parent|direction|then|exponent|default|body|kind)"
)


def check(text: str) -> None:
    model = read_text(text)
    found = derive_text(model)
    again = model.to_toml()
    first, second = (set(names(tomllib.loads(x))) for x in (text, again))
    assert {x for x in first ^ second if not SAME.fullmatch(x) and x.count(".") < 2} == set()
    assert {
        x for x in first - second if not SAME.fullmatch(x) and not x.endswith((".start", ".guess"))
    } == set()
    read = read_text(again)
    assert read.to_toml() == again
    source = re.compile(r'"source": "[^"]*"')
    assert source.sub("", derive_text(read).text) == source.sub("", found.text)


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.__name__)
@pytest.mark.parametrize("seed", range(4))
def test_each_table_comes_back(part, seed):
    check(written(random.Random(f"{part.__name__} {seed}"), [part]))


@pytest.mark.parametrize("seed", range(12))
def test_tables_come_back_together(seed):
    """Few at a time: constraints at random contradict each other."""
    r = random.Random(seed)
    free = [x for x in PARTS if x not in (constraints, loops, closures, rolling, velocities, contacts)]
    held = [r.choice((constraints, loops, closures, rolling, velocities))]
    check(written(r, [*r.sample(free, 6), *held]))


def test_no_table_is_left_out():
    r = random.Random(0)
    texts = [tomllib.loads(written(r, [part])) for part in PARTS]
    assert {key for text in texts for key in text} >= READERS.keys() - {"ports"}
