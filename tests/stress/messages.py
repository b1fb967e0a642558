"""What is said about files that are wrong: each message names the file, the place in it, the cause, and what to do.

Every part of every bundled model, of a model that has all tables, of recordings, tables and arguments is replaced by
something else, one at a time. What is refused must say so in a sentence that has all four.
"""

from __future__ import annotations

import copy
import functools
import json
import random
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from .hostile import ROOT, RUNS, bounded, invoke, recorded, worst
from .scenario import REFUSED, WRONG, Outcome, Scenario

_SHORT, _LONG = 1, 40  # batches of each kind
_BATCH = 12  # changes in one scenario
_LIMIT = 400.0
MODELS = sorted(path.stem for path in (ROOT / "models").glob("*.toml"))
EVERYTHING = """
name = "everything"
description = "All tables"

[parameters]
m = "2 kg"
J = "1e-3 kg*m^2"
l = "0.3 m"
c = { value = 0.1, unit = "N*s/m", doc = "friction" }
g = "9.81 m/s^2"
k = "20 N/m"
e = 0.6
mu = 0.3

[constants]
x0 = "0.35 m"

[coordinates]
x = { unit = "m", start = 0.1, rate = 0.2 }
phi = { unit = "rad", guess = -0.2 }
turn = { unit = "rad", guess = 0.1, rate_guess = 0.0 }
s = { unit = "m", start = 0.5 }

[inputs]
F = { unit = "N", default = 0.0 }
G = { unit = "N", polynomial = [0.1, 0.2] }

[definitions]
px = "x + l*sin(phi)"
vx = "dot(px)"

[bodies.crab]
mass = "m"
com = ["x", "0"]

[bodies.hook]
mass = "m"
inertia = "J"
com = ["px", "-l*cos(phi)"]
angle = "phi"
shape = { capsule = ["0.01 m", "l"] }

[bodies.arm]
mass = "0.4 kg"
com = [0.0, "-l/2", 0.0]
inertia = [0.02, 0.02, 0.002]
shape = { box = ["0.1 m", "0.1 m", "l"] }

[joints.shoulder]
type = "revolute"
parent = "world"
child = "arm"
origin = { xyz = [0, 0, 1], rpy = [0, 0, 0.1] }
axis = [0, 0, 1]
coordinate = "turn"
stiffness = 2.0
damping = "0.1 N*m*s"
limits = [-2.0, 2.0]
restitution = 0.4

[points.tip]
body = "arm"
at = [0, "-l", 0]

[points.hand]
body = "hook"
at = [0, "l/3"]

[axes.up]
body = "arm"
direction = [0, 1, 0]

[gravity]
y = "-g"

[energy]
kinetic = "m*dot(s)^2/2"
potential = "k/2*(s - x0)^2 + m*g*x0"
dissipation = "c/2*dot(x)^2"

[forces]
x = "F"
s = "G"

[loads.gust]
point = ["x", "0"]
force = ["-5 N", "0"]

[loads.twist]
body = "hook"
torque = "0.1 N*m"

[constraints]
rail = "phi + 0.2*cos(s/x0)"

[constraints.tooth]
gear = { coordinates = ["phi", "turn"], ratio = 2.0, offset = 0.3 }

[stops.wall]
gap = "4 - x/x0"
restitution = "e"

[friction.track]
coordinate = "x"
force = "0.3 N"

[contacts.floor]
gap = "s - 0.1*x0"
stiffness = "1000 N/m"
damping = "0.1 s/m"

[outputs]
speed = "vx"

[events.stop]
when = "x - 3*x0"
direction = "falling"
then = { reset = { "dot(x)" = "-e*dot(x)" } }

[draw.line]
bar = [["x", "0"], ["px", "-l*cos(phi)"]]

[run]
t_end = 0.01
method = "dop853"
rtol = 1e-7
fps = 60
"""
VALUES = (
    -1, 0, 1.5, True, "", "x", "nonsense", "1 parsec", "1/0", "sin(", "dot(dot(x))", "2 kg", "5 s", float("nan"),
    float("inf"), 1e300, [], [1], [0, 0, 0], ["a", "b"], {}, {"a": 1}, "t", "../../x", "é", "m**1e9", "sqrt(-1)",
    "a b", "world", "'", ["m", "m"], [[1, 2], [3, 4]], "log(0)", "asin(7)", "dot(m)", "1e999", "x - x",
)  # fmt: skip
NAMES = (
    "q",
    "t",
    "pi",
    "dot",
    "sin",
    "lambda",
    "1a",
    "a b",
    "é",
    "",
    "x" * 300,
    "m",
    "x",
    "com_x",
    "__class__",
)


def to_toml(document: dict[str, Any]) -> str:
    """Return the text of a document; all tables are inline, since only their content matters."""
    return "\n".join(f"{_key(key)} = {_inline(value)}" for key, value in document.items()) + "\n"


def _key(key: str) -> str:
    return json.dumps(key)


def _inline(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, str)):
        return json.dumps(value)
    if isinstance(value, float):
        return (
            "nan"
            if value != value
            else ("-inf" if value < 0 else "inf")
            if abs(value) == float("inf")
            else repr(value)
        )
    if isinstance(value, list):
        return f"[{', '.join(map(_inline, value))}]"
    return "{ " + ", ".join(f"{_key(k)} = {_inline(v)}" for k, v in value.items()) + " }"


def places(value: Any, path: tuple = ()) -> Iterator[tuple]:
    """Yield where something stands in a document: keys and indices."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, each in inside:
        yield (*path, key)
        yield from places(each, (*path, key))


def change(r: random.Random, document: dict[str, Any]) -> str:
    """Change one thing in a document; returns what."""
    path = r.choice([*places(document)])
    holder = functools.reduce(lambda at, key: at[key], path[:-1], document)
    kind, last = r.randrange(8), path[-1]
    if kind == 0:
        del holder[last]
        return f"without {path}"
    if kind == 1 and isinstance(holder, dict):
        name = r.choice((*NAMES, f"{last}x"))
        pairs = [(name if key == last else key, value) for key, value in holder.items()]
        holder.clear()
        holder.update(pairs)
        return f"{path} is called {name!r}"
    if kind == 2 and isinstance(holder, dict):
        name = r.choice(NAMES)
        holder[name] = r.choice(VALUES)
        return f"{path[:-1]} has {name!r} = {holder[name]!r}"
    if kind == 3 and isinstance(holder[last], str) and holder[last]:
        text = holder[last]
        k = r.randrange(len(text))
        odd = r.choice(
            ("+", "(", ")", "**", "é", "zz", " ", ".", "/0", "$", "'", "dot(", "1e400", ",", "_", "\x1b")
        )
        holder[last] = text[:k] + odd + text[k + r.randrange(2) :]
    elif kind == 4 and isinstance(holder, list):
        holder.append(holder[last])
    elif kind == 5:
        other = r.choice([*places(document)])
        holder[last] = copy.deepcopy(functools.reduce(lambda at, key: at[key], other, document))
        return f"{path} is what {other} is"
    else:
        holder[last] = r.choice(VALUES)
    return f"{path} = {holder[last]!r:.60}"


_PLACE = re.compile(r"\[[\w.]+\]|line \d+|'[^']+'|column \d+|\b(t|at) = |, [\w.]+:|unknown key")
_REMEDY = re.compile(
    r"; |: (give|write|add|try|check|name|did you|remove|choose)"
    r"|\b(expected here|did you mean|instead|has to be|must be|try|check|give|look for|look at)\b"
)


def judge(done: Outcome, file: str) -> Outcome:
    """What was refused must say so with the file, the place in it, and what to do."""
    if done.verdict != REFUSED:
        return done
    said = done.says.partition("rror: ")[2]
    missing = [
        what
        for what, there in (
            ("the file", file in said),
            ("the place", _PLACE.search(said.replace(file, ""))),
            ("what to do", _REMEDY.search(said)),
        )
        if not there
    ]
    return Outcome(WRONG, f"without {' and '.join(missing)}: {said}") if missing else done


def models(r: random.Random) -> Outcome:
    """Change one thing in a model, and run it."""
    text = EVERYTHING if r.random() < 0.5 else (ROOT / "models" / f"{r.choice(MODELS)}.toml").read_text()
    document = tomllib.loads(text)
    what = change(r, document)
    Path("odd.toml").write_text(to_toml(document), encoding="utf-8")
    done = invoke("run", "odd.toml", "--t-end", "0.01", "--no-log", "--quiet", "--method", "dop853")
    done = judge(done, "odd.toml")
    return Outcome(done.verdict, f"{what}: {done.says}")


def arguments(r: random.Random) -> Outcome:
    """Run a model of one's own with an odd value of one option."""
    Path("odd.toml").write_text(EVERYTHING, encoding="utf-8")
    value = str(r.choice(VALUES))
    name = r.choice(
        ("--set", "--start", "--rate", "--input", "--t-end", "--method", "--constraints", "--rtol", "--step", "--fps",
         "--max-step", "--breaks", "--at", "--option", "--atol")
    )  # fmt: skip
    if name in ("--set", "--start", "--rate", "--input", "--option"):
        value = f"{r.choice(('m', 'x', 'F', 'turn', 'dot(x)', 'x0', 'speed', 'nothing'))}={value}"
    done = invoke(
        "run", "odd.toml", "--t-end", "0.01", "--no-log", "--quiet", "--method", "dop853", name, value
    )
    known = [name, value.partition("=")[0], "odd.toml"]
    if done.verdict == REFUSED and not any(part and part in done.says for part in known):
        return Outcome(WRONG, f"{name} {value}: {done.says}")
    return Outcome(done.verdict, f"{name} {value}: {done.says}")


def tables(r: random.Random) -> Outcome:
    """Change one row of a table that a model names."""
    document = tomllib.loads(EVERYTHING)
    document["inputs"]["F"] = {"unit": "N", "table": "odd.csv", "kind": r.choice(("linear", "cubic", "hold"))}
    rows = [f"{0.1 * k:.2f}, {r.random():.3f}" for k in range(20)]
    rows[r.randrange(20)] = r.choice(
        (
            "nan, 1",
            "1",
            "1,2,3",
            "a, b",
            "1e999, 0",
            "0, 0",
            "é, ü",
            "9" * 5000,
            "0.1;0.2",
            "-1,0",
            "\x00",
            "t, F",
        )
    )
    Path("odd.csv").write_text("\n".join(rows), encoding="utf-8")
    Path("odd.toml").write_text(to_toml(document), encoding="utf-8")
    done = invoke("run", "odd.toml", "--t-end", "0.01", "--no-log", "--quiet", "--method", "dop853")
    return judge(done, "odd.csv")


def recordings(r: random.Random) -> Outcome:
    """Damage a recording, or call something else one."""
    recorded(Path("odd.rrd"), *r.choice(RUNS[:5]))
    content = Path("odd.rrd").read_bytes()
    place = r.randrange(len(content))
    content = r.choice(
        (
            content[:place],
            content[:place] + b"\xff" * 9 + content[place + 9 :],
            b"",
            b"RRF2",
            b"{}",
            b"\x00" * 5000,
        )
    )
    Path("odd.rrd").write_bytes(content)
    name = r.choice(
        (("verify", "odd.rrd"), ("compare", "odd.rrd", "odd.rrd"), ("report", "odd.rrd", "--quick"),
         ("run", "--resume", "odd.rrd", "--t-end", "6", "--no-log", "--quiet"), ("advise", "--at", "odd.rrd@0.0"))
    )  # fmt: skip
    done = invoke(*name)
    return done if done.verdict != REFUSED or "odd.rrd" in done.says else Outcome(WRONG, done.says)


def several(run: Callable[[random.Random], Outcome], r: random.Random) -> Outcome:
    """The worst of a batch."""
    outcomes = [run(r) for _ in range(_BATCH)]
    shown = worst(outcomes)
    counts = Counter(outcome.verdict for outcome in outcomes)
    return Outcome(shown.verdict, f"{', '.join(f'{n} {v}' for v, n in counts.items())}; {shown.says}")


def scenarios() -> Iterator[Scenario]:
    """Batches of changes; the first few of each kind belong to the test suite."""
    for run in (models, arguments, tables, recordings):
        kind = f"messages of {run.__name__}"
        for seed in range(_LONG):
            yield Scenario(
                kind, f"{kind} {seed}", functools.partial(bounded, functools.partial(several, run), kind, seed),
                short=seed < _SHORT, limit=_LIMIT,
            )  # fmt: skip
