"""The page of a report: what was modelled, how it was integrated, and how far the result can be trusted.

Which quantities of a run are plotted, and how: motion, phase portrait, energy, residuals, steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.convergence import tables
from symgen.runtime.checks.growth import running_maximum
from symgen.runtime.checks.health import health_of, objections_to
from symgen.runtime.names import motion_records, rate_indices, rate_labels
from symgen.runtime.report.drawing import drawing
from symgen.runtime.report.first_numbers import first_numbers
from symgen.runtime.report.html import (
    Markup,
    contents,
    figure,
    listing,
    markup,
    number,
    page,
    paragraph,
    section,
    table,
)
from symgen.runtime.report.svg import N_COLOURS, Curve, plot

if TYPE_CHECKING:
    from symgen.runtime.checks.advice import Advice
    from symgen.runtime.checks.convergence import Convergence
    from symgen.runtime.solution import Solution


_MOST_COORDINATES = 12
_MOST_PORTRAITS = 4
_TIME = "t [s]"


def motion(solution: Solution) -> Iterator[Markup]:
    """Yield plots of the coordinates and first-order states over time, those of a unit together."""
    system = solution.system
    coordinates, states = system.coordinates, solution.states
    shown = [
        (i, record["name"], record["unit"]) for i, record in motion_records(coordinates, system.integrals)
    ]
    shown += [(system.nq + i, system.rates[i]["name"], system.rates[i]["unit"]) for i in system.states]
    units: dict[str, list[Curve]] = {}
    for column, name, unit in shown[:_MOST_COORDINATES]:
        units.setdefault(unit, []).append(Curve(name, solution.t, states[:, column]))
    left_out = len(shown) - _MOST_COORDINATES
    for unit, all_curves in units.items():
        for first in range(0, len(all_curves), N_COLOURS):
            curves = all_curves[first : first + N_COLOURS]
            names = ", ".join(curve.name for curve in curves)
            yield figure(plot(curves, _TIME, _with_unit(names if len(curves) == 1 else "", unit)), names)
    if left_out > 0:
        yield Markup(f"<p>{left_out} more coordinates are not plotted.</p>")


def phase_portraits(solution: Solution) -> Iterator[Markup]:
    """Yield plots of rates over their coordinates."""
    system = solution.system
    labels = rate_labels(system.coordinates, system.rates)
    columns = rate_indices(system.coordinates, system.rates, system.quaternions)
    named = [(i, c) for i, c in motion_records(system.coordinates, system.integrals) if c["name"] in columns]
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


@dataclass(frozen=True)
class Equations:
    """Equations as the page shows them: rendered as HTML by the caller, who escapes what comes from a model.

    Attributes
    ----------
    motion, state_space : sequence of Markup
    note : str
        What is left out, and why.
    """

    motion: Sequence[Markup]
    state_space: Sequence[Markup]
    note: str = ""


def report_page(
    solution: Solution,
    equations: Equations,
    advice: Advice | None,
    convergence: Convergence | None,
    seconds: Mapping[str, float],
    origin: str = "",
) -> str:
    """Return the report of a run as HTML.

    Parameters
    ----------
    solution : Solution
    equations : Equations
    advice : Advice or None
    convergence : Convergence or None
    seconds : mapping of str to float [s]
        Wall times by stage.
    origin : str
        Where the run comes from, if that is not the model alone.
    """
    name = solution.system.name
    p, start = solution.p, solution.states[0]
    picture = drawing(solution.system, p, float(solution.t[0]), start)
    head = [
        Markup(
            f"<header><h1>{markup(name)}</h1>{paragraph(solution.system.description)}{paragraph(origin)}{_verdict(solution)}</header>"
        ),
        figure(picture, f"the mechanism at t = {solution.t[0]:.6g} s"),
    ]
    sections = [
        section("Quantities", *_quantities(solution)),
        section("Equations of motion", *equations.motion, paragraph(equations.note)),
        section("State-space form", *equations.state_space),
        section("Method and step", *_method(solution, advice)),
        section("First numbers", *first_numbers(solution, advice)),
        section("Convergence", *_convergence(convergence)),
        section("Motion", *motion(solution)),
        section("Phase portraits", *phase_portraits(solution)),
        section("Energy", *energy(solution)),
        section("Constraint residuals", *residuals(solution)),
        section("Step size", *steps(solution)),
        section("Health", *_health(solution)),
        section("State at the end", _state(solution, -1)),
        section("Timings", table(("stage", "wall time [s]"), [(k, f"{v:.3g}") for k, v in seconds.items()])),
    ]
    return page(f"{name}: report", [*head, contents(sections), *sections])


def _verdict(solution: Solution) -> Markup:
    objections = objections_to(solution)
    if solution.status in ("success", "terminated") and not objections:
        return paragraph(f"{solution.status} at t = {number(solution.t[-1])} s; every health check passed.")
    reasons = [entry.check for entry in objections] or [solution.status]
    return Markup(f'<p class="bad">Not to be trusted: {markup(", ".join(reasons))}</p>')


def _quantities(solution: Solution) -> list[Markup]:
    system = solution.system
    values = solution.p[: system.n_settable]
    known = (*system.parameters, *system.inputs)
    words = system.input_descriptions
    rows = [
        (r["name"], words.get(r["name"], number(value)), r["unit"], r.get("doc", ""))
        for r, value in zip(known, values)
    ]
    rows += [(r["name"], number(r["value"]), r["unit"], "constant") for r in system.constants]
    sizes = f"Coordinates: {system.nq}, rates: {system.nv}, constraints: {system.m}."
    return [
        paragraph(sizes),
        table(("name", "value", "unit", "meaning"), rows),
        paragraph("Start, consistent with constraints:"),
        _state(solution, 0),
    ]


def _state(solution: Solution, row: int) -> Markup:
    """Return coordinates and rates at a frame."""
    system = solution.system
    shown = motion_records(system.coordinates, system.integrals)
    rows = [(c["name"], number(solution.q[row, i]), c["unit"]) for i, c in shown]
    labels = rate_labels(system.coordinates, system.rates)
    rows += [(n, number(x), r["unit"]) for n, r, x in zip(labels, system.rates, solution.v[row])]
    return table((f"at t = {number(solution.t[row])} s", "value", "unit"), rows)


def _method(solution: Solution, advice: Advice | None) -> list[Markup]:
    how = (
        f"step {solution.step:.6g} s" if solution.step else f"rtol {solution.rtol:g}, atol {solution.atol:g}"
    )
    treatment = f"; constraints: {solution.constraints}" if solution.system.m else ""
    found = [paragraph(f"{solution.method}, {how}{treatment}."), listing(solution.notes)]
    if advice is not None:
        seen = f"Time scales at {advice.n_states} states up to t = {advice.t_seen:.4g} s:"
        found += [paragraph(seen), listing(advice.lines())]
    counts = [(name, str(value)) for name, value in solution.stats.items()]
    return [*found, table(("what was done", "times"), counts)]


def _convergence(convergence: Convergence | None) -> list[Markup]:
    if convergence is None:
        return []
    found = [
        part for title, (head, *rows) in tables(convergence) for part in (paragraph(title), table(head, rows))
    ]
    return [*found, *growth(convergence), paragraph(convergence.says)]


def _health(solution: Solution) -> list[Markup]:
    objection = Markup('<span class="bad">not ok</span>')
    rows = [
        (
            e.check,
            "note" if e.note else "ok" if e.ok else objection,
            f"{e.value:.3g}",
            f"{e.limit:.3g}",
            e.says,
        )
        for e in health_of(solution)
    ]
    events: dict[str, int] = {}
    for event in solution.events:
        events[event.name] = events.get(event.name, 0) + 1
    counts = [(name, str(count)) for name, count in events.items()]
    return [
        table(("check", "", "value", "limit", "meaning"), rows),
        table(("event", "times"), counts),
        paragraph(solution.message),
    ]
