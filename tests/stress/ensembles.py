"""Ensembles of models with stops, loops, starts that are solved for, states, or no inertia, with hostile members.

Parameters, starts and inputs differ from member to member, by arrays in which some values are none (not a number,
infinite, zero, far too large or small), by noise, by tables. Each member is then run by itself, as `system.run` does
it. Wrong is a member that has a result where the single run has none, or none where the single run has one and its
checks pass, or another one; and one that ends the others.
"""

from __future__ import annotations

import functools
import math
import random
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime import load
from symgen.runtime.ensemble import noise
from symgen.runtime.ensemble.noises import is_noise
from symgen.runtime.ensemble.verdict import CAUSES, NO_START
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS

from .judging import refusal
from .models import described_text
from .scenario import RIGHT, WRONG, Outcome, Scenario

if TYPE_CHECKING:
    from symgen.runtime import System

_SHORT, _LONG = 6, 400
_LIMIT = 300.0
_N, _T_END, _MOST_STEPS = 8, 1.0, 20_000
_TOLERANCE = 3e-3  # of what a coordinate does
_HOSTILE = (math.nan, math.inf, -math.inf, 0.0, -1.0, 1e300, -1e300, 1e-300, 1e-8, 1e8)
_METHODS = ("auto", "taylor", "dop853", "rk4", "verlet", "radau5", "dopri5", "bdf", "gauss8")
# What parameters, starts and inputs of each may vary.
MODELS = {
    "stops": (
        """
[parameters]
m = 1.0
k = 100.0
g = 9.81
e = 0.5
mu = 0.3
[coordinates]
x = { guess = 0.5 }
y = { start = 0.3, rate = -0.2 }
[inputs]
F = { default = 0.0 }
[bodies.a]
mass = "m"
com = ["y", "x"]
[gravity]
y = "-g"
[energy]
potential = "k*x^2/2 + k*y^2/20"
dissipation = "0.3*dot(x)^2"
[forces]
x = "F"
y = "0.5*F"
[stops.s]
gap = "0.5 - x"
restitution = "e"
[friction.f]
coordinate = "y"
force = "mu*m*g"
[start]
equations = ["k*x = -1.1*m*g"]
""",
        ("m", "k", "g", "e", "mu"), ("y",), ("F",),
    ),
    "loop": (
        """
[parameters]
l = 1.0
r = 0.4
m = 1.0
g = 9.81
c = 0.1
[coordinates]
a = { guess = 0.3 }
b = { guess = -0.2 }
[inputs]
T = { default = 0.0 }
[bodies.p]
mass = "m"
inertia = "m/12"
com = ["r*cos(a)/2", "r*sin(a)/2"]
angle = "a"
[bodies.q]
mass = "m"
inertia = "m/12"
com = ["r*cos(a) + l*cos(b)/2", "r*sin(a) + l*sin(b)/2"]
angle = "b"
[gravity]
y = "-g"
[energy]
dissipation = "c*dot(a)^2/2"
[forces]
a = "T"
[constraints]
close = "r*sin(a) + l*sin(b)"
[start]
equations = ["r*cos(a) + l*cos(b) = 1.2", "dot(a) = 1"]
""",
        ("l", "r", "m", "g", "c"), (), ("T",),
    ),
    "states": (
        """
[parameters]
m = 1.0
k = 10.0
tau = 0.1
[coordinates]
x = { start = 0.1 }
[states]
z = { derivative = "(x - z)/tau", start = 0.2 }
[inputs]
u = { default = 0.0 }
[bodies.a]
mass = "m"
com = ["x", "0"]
[forces]
x = "-k*z + u"
[events.top]
when = "x - 0.05"
then = "record"
""",
        ("m", "k", "tau"), ("x", "z"), ("u",),
    ),
    "no inertia": (
        """
[parameters]
w = 2.0
r = 0.5
[coordinates]
a = { guess = 0.3 }
b = { guess = 0.4 }
[constraints]
drive = "a - 0.3 - w*t"
link = "r*sin(a) - 2*sin(b)"
""",
        ("w", "r"), (), (),
    ),
}  # fmt: skip


@functools.cache
def _system(name: str) -> System:
    return load(described_text(f'name = "{name.replace(" ", "_")}"\n{MODELS[name][0]}'))


def _values(r: random.Random, around: float, share: float) -> np.ndarray:
    values = np.array([around * r.uniform(0.8, 1.25) for _ in range(_N)])
    if r.random() < share:
        values[r.sample(range(_N), 2)] = r.choice(_HOSTILE), r.choice(_HOSTILE)
    return values


def _input(r: random.Random) -> Any:
    kind = r.randrange(6)
    if kind == 0:
        return [0, 0.2, 0.5, 1.5], [0, 1, -1, 0.5]
    if kind == 1:
        return noise(0.5, 0.05)
    if kind == 2:
        return noise(0.5, 0.03, kind="cubic")
    return _values(r, 1.0, 0.4) if kind == 3 else None


def draw(r: random.Random) -> tuple[str, dict[str, Any]]:
    """Draw a model, and what varies, as arguments of `system.ensemble`."""
    name = r.choice(list(MODELS))
    _, parameters, starts, inputs = MODELS[name]
    nominal = {record["name"]: record["value"] for record in _system(name).parameters}
    chosen = r.sample(parameters, r.randint(1, len(parameters)))
    asked: dict[str, Any] = {
        "parameters": {p: _values(r, nominal[p], 0.4) for p in chosen},
        "start": {c: _values(r, 0.25, 0.3) for c in starts if r.random() < 0.4},
        "inputs": {c: given for c in inputs if (given := _input(r)) is not None},
        "method": r.choice(_METHODS), "max_steps": _MOST_STEPS, "seed": 1,
    }  # fmt: skip
    if r.random() < 0.3:
        asked["rtol"] = r.choice([1e-4, 1e-10])
    return name, asked


def _single(system: System, asked: dict[str, Any], method: str, step: float | None, k: int) -> Any:
    """Run a member by itself; why it cannot begin, where it cannot."""
    inputs = {}
    for name, given in asked["inputs"].items():
        if is_noise(given):
            inputs[name] = given.in_si(name, "").table(name, 1, k, 0.0, _T_END)
        else:
            inputs[name] = given[k] if isinstance(given, np.ndarray) else given
    one = {
        place: {name: float(x[k]) for name, x in asked[place].items()} for place in ("parameters", "start")
    }
    more = {key: asked[key] for key in ("max_steps", "rtol") if key in asked}
    if not METHODS[method].adaptive:
        more["step"] = step  # one for all, which is that of the first member that can begin
    return system.run(_T_END, inputs=inputs, method=method, **one, **more)


def _said(e: Any, k: int) -> str:
    """Return why a member failed."""
    return e.messages.get(k) or CAUSES.get(int(e.verdicts.status[k]), "")


def _objection(system: System, asked: dict[str, Any], e: Any, k: int) -> str:
    """Return what is wrong with a member."""
    status, failed = int(e.verdicts.status[k]), int(e.verdicts.status[k]) != at.REACHED_STOP
    try:
        run = _single(system, asked, e.method, e.plan.single.step, k)
    except RuntimeModelError as error:
        return "" if failed else f"a single run is refused: {error}"
    if run.status not in ("success", "terminated"):
        return "" if failed else f"a single run ends: {run.message}"
    if failed:
        if not METHODS[e.method].adaptive and "step" in _said(e, k):
            return ""  # one step for all, which is that of the first member that can begin
        if status == NO_START or all(entry.ok for entry in run.health):
            return f"failed with status {status}, {e.messages.get(k)}; a single run does not"
        return ""
    if not e.verdicts.ok[k]:
        return ""
    for name in e.names:
        expected = run[name]
        scale = max(abs(expected[-1]), float(np.ptp(expected)), 1e-9)
        if not abs(e[name][k] - expected[-1]) <= _TOLERANCE * scale:
            return f"{name} is {e[name][k]:.9g}, of a single run {expected[-1]:.9g}"
    return ""


def run(seed: int) -> Outcome:
    """Draw an ensemble, run it, and hold each member against a run of its own."""
    name, asked = draw(random.Random(f"ensembles {seed}"))
    system = _system(name)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            e = system.ensemble(_T_END, **asked)
        except RuntimeModelError as error:
            return refusal(error)
        wrong = [(k, said) for k in range(_N) if (said := _objection(system, asked, e, k))]
    if wrong:
        shown = {key: str(value)[:200] for key, value in asked.items()}
        return Outcome(WRONG, f"{name}, {shown}: member {wrong[0][0]} of {len(wrong)}: {wrong[0][1]}")
    return Outcome(RIGHT, f"{name}: {_N - e.n_failed} members as single runs, {e.n_failed} failed as they do")


def scenarios() -> Iterator[Scenario]:
    """All of them; the first few belong to the test suite."""
    for seed in range(_LONG):
        run_it = functools.partial(run, seed)
        yield Scenario("ensembles", f"ensembles {seed}", run_it, short=seed < _SHORT, limit=_LIMIT)
