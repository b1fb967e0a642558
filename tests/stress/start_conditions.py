"""Starts that are solved for: two mechanisms, of which conditions concern one.

Coordinates and rates are given or guesses; equations for places, rates and accelerations, parameters that are found,
rest. Conditions have to hold, as the motion's own accelerations say it; what is given stays; the other mechanism
begins as it does without any condition; and a run that is given what was found is the same run.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from symgen.runtime import Solution

from .judging import attempt
from .models import described
from .scenario import FLAGGED, RIGHT, WRONG, Outcome, Scenario

_CASES = 40
_NAMES = ("x", "phi", "y", "psi")
_PLACES = ("x = {}", "phi = {}", "x + 0.5*sin(phi) = {}")
_RATES = ("dot(x) = {}", "dot(x) + 0.5*cos(phi)*dot(phi) = {}")
_ACCELERATIONS = (
    "acceleration(x) = {}", "acceleration(phi) = {}", "acceleration(x) + acceleration(phi) = {}",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """One start.

    Attributes
    ----------
    model : str
        Without conditions.
    equations, find, steady : tuple of str
    given : dict of str to float
        What is no guess, by the names of series.
    """

    model: str
    equations: tuple[str, ...]
    find: tuple[str, ...]
    steady: tuple[str, ...]
    given: dict[str, float]

    @property
    def text(self) -> str:
        """The model with its conditions."""
        keys = {"equations": self.equations, "find": self.find, "steady": self.steady}
        said = "".join(f"{key} = {list(values)}\n" for key, values in keys.items() if values)
        return f"{self.model}[start]\n{said}".replace("'", '"')


def drawn(number: int) -> Case:
    """Draw a start."""
    r = np.random.default_rng([number, *b"start conditions"])

    def one(low: float, high: float) -> float:
        return round(float(r.uniform(low, high)), 3)

    def some(of: tuple[str, ...], most: int) -> list[str]:
        return r.choice(of, size=int(r.integers(0, most + 1)), replace=False).tolist()

    given, coordinates = {}, ""
    for name in _NAMES:
        place, rate = one(-0.4, 0.4), one(-1.0, 1.0)
        kinds = ["start" if r.random() < 0.3 else "guess", "rate" if r.random() < 0.3 else "rate_guess"]
        given |= {name: place} if kinds[0] == "start" else {}
        given |= {f"dot({name})": rate} if kinds[1] == "rate" else {}
        coordinates += f"{name} = {{ {kinds[0]} = {place}, {kinds[1]} = {rate} }}\n"
    masses = [one(0.3, 2.0) for _ in range(4)]
    model = f"""name = "two"
[parameters]
stiffness = {one(10, 60)}
push = {one(-2, 2)}
[coordinates]
{coordinates}c = {{ guess = {one(-0.4, 0.4)} }}
[states]
lag = {{ derivative = "(x - lag)/0.3", {r.choice(["start", "guess"])} = 0.2 }}
[bodies.cart]
mass = {masses[0]}
com = ["x", 0]
[bodies.bob]
mass = {masses[1]}
com = ["x + 0.5*sin(phi)", "-0.5*cos(phi)"]
[bodies.other_cart]
mass = {masses[2]}
com = ["y + 3", 0]
[bodies.other_bob]
mass = {masses[3]}
com = ["y + 3 + 0.4*sin(psi)", "-0.4*cos(psi)"]
[bodies.cam]
mass = 0.5
com = ["c", 2]
[constraints]
cam = "c - 0.3*y - 0.2*y^2"
[energy]
potential = "stiffness*x^2/2 + {one(10, 60)}*y^2/2"
dissipation = "0.1*dot(x)^2 + 0.05*dot(phi)^2 + 0.1*dot(y)^2 + 0.03*dot(psi)^2"
[forces]
x = "push + 0.5*lag"
y = "0.3*cos(t)"
[gravity]
y = "-9.81 m/s^2"
"""
    equations = [text.format(one(-0.4, 0.4)) for text in some(_PLACES, 2)]
    equations += [text.format(one(-1, 1)) for text in some(_RATES, 1)]
    equations += [text.format(one(-3, 3)) for text in some(_ACCELERATIONS, 1)]
    steady = (("lag",), ("x",), (), ())[int(r.integers(4))]
    find = some(("stiffness", "push"), 1) if any("acceleration" in text for text in equations) else []
    return Case(model, tuple(equations), tuple(find), steady, given)


def start(number: int) -> Outcome:
    """Run from a start that is solved for, and look at where it began."""
    case = drawn(number)
    if not (case.equations or case.steady):
        return Outcome(RIGHT, "no conditions")
    run = attempt(described(case.text), 0.02, method="dop853")
    if isinstance(run, Outcome):
        return run
    if run.status != "success":
        return Outcome(FLAGGED, run.message)
    without = attempt(described(case.model), 0.02, method="dop853")
    again = attempt(
        described(case.text), 0.02, method="dop853", parameters={k: run.parameters[k] for k in case.find}
    )
    says = [*_broken(case, run)]
    other = ("y", "psi", "c", "dot(y)", "dot(psi)", "dot(c)")
    says += [f"{name} moved" for name in other if abs(run[name][0] - without[name][0]) > 1e-12]
    if isinstance(again, Outcome) or np.abs(again.states - run.states).max() > 1e-12:
        says.append("another run with what was found")
    return Outcome(WRONG if says else RIGHT, f"{number}: {', '.join(says) or 'all holds'}")


def _broken(case: Case, run: Solution) -> Iterator[str]:
    """Yield what does not hold where a run began."""
    known = {name: run[name][0] for name in _NAMES} | {"sin": math.sin, "cos": math.cos}
    rates = {name: run[f"dot({name})"][0] for name in _NAMES}
    accelerations = {name: run[f"dot(dot({name}))"][0] for name in _NAMES}
    known |= {"dot": rates.get, "acceleration": accelerations.get}
    for text in case.equations:
        left, right = re.sub(r"(dot|acceleration)\((\w+)\)", r"\1('\2')", text).split(" = ")
        if abs(eval(left, known) - float(right)) > 1e-8:
            yield text
    for name in case.steady:
        if abs(run["dot(lag)"][0] if name == "lag" else accelerations[name]) > 1e-8:
            yield f"{name} is not at rest"
    for name, value in case.given.items():
        if run[name][0] != value:
            yield f"{name} was given"


def scenarios() -> Iterator[Scenario]:
    """Yield drawn starts."""
    for number in range(_CASES):
        run = functools.partial(start, number)
        yield Scenario("start conditions", f"start conditions {number}", run, short=number < 3)
