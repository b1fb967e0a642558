"""Bundled models in other units: lengths, masses and times times powers of two give the same run and the same verdict.

Such factors round nothing, so whatever differs is a size that is written down in the code where it should be the
model's own: in a step, an event, an assembly, or a check.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from symgen.runtime.graph.units import parse_unit
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt
from .models import bundled
from .scenario import REFUSED, RIGHT, WRONG, Outcome, Scenario

# Models whose numbers all have units, without guesses of lengths or rates, which a run cannot give.
_NAMES = (
    "block_on_plate", "bouncing_ball", "bricard", "cart_pole", "damped_spring_pendulum", "die",
    "door_stop", "double_pendulum", "four_bar", "free_rigid_body", "heavy_top_absolute", "n_pendulum",
    "newtons_cradle", "pendulum", "pendulum_field", "quarter_car", "rough_road",
    "spinning_top", "spring_chain", "spring_pendulum", "stick_slip", "stiff_bushing_pendulum", "turntable",
)  # fmt: skip
_CASES = 2
_EXPONENTS = (-10, -5, 0, 0, 5, 10)  # 1e-3 to 1e3: beyond, tolerances in all units at once are none for rates
_MOST_STEPS = 20_000
_FIXED, _OF_RTOL, _AT_REST = (
    1e-5,
    1e3,
    1e-8,
)  # how far states may be apart: in parts of the largest, and of the tolerance; rest


def factor(unit: str, units: Sequence[float]) -> float:
    """Return the factor of a value with this unit where length, mass and time have these factors."""
    return (
        math.prod(u**k for u, k in zip(units, parse_unit(unit).dimension[:3], strict=True)) if unit else 1.0
    )


def rescaled(name: str, number: int, method: str) -> Outcome:
    """Run a model as it is and in other units."""
    r = np.random.default_rng([number, *name.encode(), *method.encode()])
    units = [2.0 ** int(r.choice(_EXPONENTS)) for _ in range(3)]
    return compared(name, method, units, float(r.choice([0.05, 0.3])), float(10.0 ** -r.integers(3, 10)))


def compared(name: str, method: str, units: Sequence[float], share: float, rtol: float) -> Outcome:
    """Run a part of a model's own time as it is and with lengths, masses and times that many times as large."""
    system, adaptive = bundled(name), find_method(method).adaptive
    per_coordinate = {u["name"]: factor(u["unit"], units) for u in system.coordinates}
    # A rate is called as its coordinate, or a part of a turn.
    per_rate = {u["name"]: per_coordinate.get(u["name"], factor(u["unit"], (units[0], units[1], 1.0))) / units[2]
                for u in system.rates}  # fmt: skip
    size = np.array([*per_coordinate.values(), *per_rate.values()])
    runs = []
    for scaled in (False, True):
        given: dict[str, Any] = {"rtol": rtol, "atol": 1e-3 * rtol * (size.min() if scaled else 1.0)}
        for key, records, factors in (
            (
                "parameters",
                system.parameters,
                {u["name"]: factor(u["unit"], units) for u in system.parameters},
            ),
            ("start", system.coordinates, per_coordinate),
            ("rate", system.rates, per_rate),
        ):
            given[key] = {
                u["name"]: u["value"] * (factors[u["name"]] if scaled else 1.0)
                for u in records
                if u.get("enforced", True) and factors[u["name"]] != 1.0 and u["value"]
            }
        given["t_end"] = share * system.run_defaults["t_end"] * (units[2] if scaled else 1.0)
        given["fps"] = 40.0 / given["t_end"]
        runs.append(attempt(system, method=method, max_steps=_MOST_STEPS, **given))
    says = f"{name}, {method}, rtol {rtol:g}, {units[0]:g} m, {units[1]:g} kg, {units[2]:g} s"
    one, other = runs
    if isinstance(one, Outcome) and isinstance(other, Outcome):
        return Outcome(REFUSED, one.says)
    if isinstance(one, Outcome) or isinstance(other, Outcome):
        return Outcome(WRONG, f"{says}: refused in one of them: {one}; {other}")
    told = [sorted({entry.check for entry in run.objections}) for run in runs]
    if bool(told[0]) != bool(told[1]):
        why = [f"{run.status} {[entry.says for entry in run.objections]}" for run in runs]
        return Outcome(WRONG, f"{says}: {told[0]} and {told[1]}: {'; '.join(why)}")
    n = min(len(one.t), len(other.t))
    largest = np.abs(one.states[:n]).max(axis=0)
    largest = np.where(largest > _AT_REST * largest.max(), largest, max(largest.max(), 1e-300))
    off = np.abs(one.states[:n] - other.states[:n] / size) / largest
    part = float(np.nan_to_num(off.max(), nan=np.inf))
    says += f": {one.status}, {one.stats['steps']} and {other.stats['steps']} steps, states off by {part:.1e}"
    same = part <= (_OF_RTOL * rtol if adaptive else _FIXED) or bool(told[0])
    return Outcome(RIGHT if same else WRONG, says)


def scenarios() -> Iterator[Scenario]:
    """Yield cases of each model, with methods in turn."""
    methods = list(METHODS)
    for k, name in enumerate(_NAMES):
        for number in range(_CASES):
            method = methods[(k * _CASES + number) % len(methods)]
            run = functools.partial(rescaled, name, number, method)
            yield Scenario("rescaled", f"rescaled {name} {number}: {method}", run, method, number == 0)
