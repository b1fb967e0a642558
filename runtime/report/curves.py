"""Which quantities of a run are plotted, and how: motion, phase portrait, energy, residuals, steps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.growth import running_maximum
from symgen.runtime.names import rate_indices, rate_labels
from symgen.runtime.report.html import Markup, figure
from symgen.runtime.report.svg import N_COLOURS, Curve, plot

if TYPE_CHECKING:
    from symgen.runtime.checks.convergence import Convergence
    from symgen.runtime.solution import Solution

_MOST_COORDINATES = 12
_MOST_PORTRAITS = 4
_TIME = "t [s]"


def motion(solution: Solution) -> Iterator[Markup]:
    """Yield plots of the coordinates over time, those of a unit together."""
    coordinates = solution.system.coordinates
    units: dict[str, list[int]] = {}
    for index, record in enumerate(coordinates[:_MOST_COORDINATES]):
        units.setdefault(record["unit"], []).append(index)
    left_out = len(coordinates) - _MOST_COORDINATES
    for unit, indices in units.items():
        for first in range(0, len(indices), N_COLOURS):
            some = indices[first : first + N_COLOURS]
            curves = [Curve(coordinates[i]["name"], solution.t, solution.q[:, i]) for i in some]
            names = ", ".join(curve.name for curve in curves)
            yield figure(plot(curves, _TIME, _with_unit(names if len(some) == 1 else "", unit)), names)
    if left_out > 0:
        yield Markup(f"<p>{left_out} more coordinates are not plotted.</p>")


def phase_portraits(solution: Solution) -> Iterator[Markup]:
    """Yield plots of rates over their coordinates."""
    system = solution.system
    labels = rate_labels(system.coordinates, system.rates)
    columns = rate_indices(system.coordinates, system.rates, system.quaternions)
    named = [(i, c) for i, c in enumerate(system.coordinates) if c["name"] in columns]
    for index, record in named[:_MOST_PORTRAITS]:
        column = columns[record["name"]]
        curve = Curve(record["name"], solution.q[:, index], solution.v[:, column])
        axes = (
            _with_unit(record["name"], record["unit"]),
            _with_unit(labels[column], system.rates[column]["unit"]),
        )
        caption = f"phase portrait: {labels[column]} over {record['name']}"
        yield figure(plot([curve], *axes, ordered=False), caption)


def growth(study: Convergence) -> Iterator[Markup]:
    """Yield a plot of how the differences of a convergence study grow over the run."""
    if study.compared is None:
        return
    levels, t = study.levels, study.compared.t
    curves = [
        Curve(f"{study.quantity} {level.setting:.3g} and the next finer", t, running_maximum(pair))
        for level, pair in zip(levels, study.compared.relative)
    ]
    asked = f"estimated error, {study.quantity} {levels[study.asked].setting:.3g}"
    curves.append(Curve(asked, study.horizon.t, study.horizon.error))
    label = "largest so far, of the size"
    yield figure(plot(curves, _TIME, label, log=True), "differences between the runs")


def energy(solution: Solution) -> Iterator[Markup]:
    """Yield a plot of the energies and one of the error of their balance."""
    t, e = solution.t, solution.energy
    curves = [
        Curve("kinetic", t, e.kinetic),
        Curve("potential", t, e.potential),
        Curve("total", t, e.total),
    ]
    if np.any(e.work != 0.0):
        curves.append(Curve("work from outside", t, e.work))
    yield figure(plot(curves, _TIME, "energy [J]"), "energies")
    error = e.balance - e.balance[0]
    yield figure(
        plot([Curve("error", t, error)], _TIME, "T + V - work, change [J]"), "error of the energy balance"
    )


def residuals(solution: Solution) -> Iterator[Markup]:
    """Yield a plot of the constraints' residuals; nothing without constraints."""
    if not solution.system.m:
        return
    found = solution.constraint_residual
    curves = [Curve("velocities", solution.t, found.velocity)]
    if solution.system.nh:
        curves.insert(0, Curve("positions", solution.t, found.position))
    yield figure(
        plot(curves, _TIME, "largest residual", log=True),
        "residuals of the constraints; zero is drawn at 1e-18",
    )


def steps(solution: Solution) -> Iterator[Markup]:
    """Yield a plot of the lengths of steps."""
    log = solution.step_log
    if len(log) > 1:
        curve = Curve("step", log[:, 0], log[:, 1])
        yield figure(plot([curve], _TIME, "step [s]", log=True), "lengths of accepted steps")


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]".strip() if unit else name or "without unit"
