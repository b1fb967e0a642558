"""The page of a report: what was modelled, how it was integrated, and how far the result can be trusted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.names import acceleration_labels, rate_labels
from symgen.runtime.report import curves
from symgen.runtime.report.drawing import drawing
from symgen.runtime.report.first_steps import semi_implicit_euler, start_values
from symgen.runtime.report.html import (
    Markup,
    figure,
    listing,
    markup,
    number,
    page,
    paragraph,
    section,
    table,
)

if TYPE_CHECKING:
    from symgen.runtime.checks.advice import Advice
    from symgen.runtime.checks.convergence import Convergence
    from symgen.runtime.report.first_steps import Start
    from symgen.runtime.solution import Solution

_LARGEST_MATRIX = 8  # rates; larger ones are not checked by hand
_STEPS_WITHOUT_RULE = 1000


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
    body = [
        Markup(
            f"<header><h1>{markup(name)}</h1>{paragraph(solution.system.description)}{paragraph(origin)}{_verdict(solution)}</header>"
        ),
        figure(picture, f"the mechanism at t = {solution.t[0]:.6g} s"),
        section("Quantities", *_quantities(solution)),
        section("Equations of motion", *equations.motion, paragraph(equations.note)),
        section("State-space form", *equations.state_space),
        section("Method and step", *_method(solution, advice)),
        section("First numbers", *_first_numbers(solution, advice)),
        section("Convergence", *_convergence(convergence)),
        section("Motion", *curves.motion(solution)),
        section("Phase portraits", *curves.phase_portraits(solution)),
        section("Energy", *curves.energy(solution)),
        section("Constraint residuals", *curves.residuals(solution)),
        section("Step size", *curves.steps(solution)),
        section("Health", *_health(solution)),
        section("State at the end", _state(solution, -1)),
        section("Timings", table(("stage", "wall time [s]"), [(k, f"{v:.3g}") for k, v in seconds.items()])),
    ]
    return page(f"{name}: report", body)


def _verdict(solution: Solution) -> Markup:
    if solution.ok:
        return paragraph(f"{solution.status} at t = {number(solution.t[-1])} s; every health check passed.")
    reasons = [entry.check for entry in solution.objections] or [solution.status]
    return Markup(f'<p class="bad">Not to be trusted: {markup(", ".join(reasons))}</p>')


def _quantities(solution: Solution) -> list[Markup]:
    system = solution.system
    values = solution.p[: system.n_settable]
    known = (*system.parameters, *system.inputs)
    words = system.input_words
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
    rows = [(c["name"], number(x), c["unit"]) for c, x in zip(system.coordinates, solution.q[row])]
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


def _first_numbers(solution: Solution, advice: Advice | None) -> list[Markup]:
    system = solution.system
    if system.nv > _LARGEST_MATRIX or system.switches:
        why = (
            f"{system.nv} rates" if system.nv > _LARGEST_MATRIX else "stops or friction, whose forces switch"
        )
        return [paragraph(f"Left out: the model has {why}, too much to be checked by hand.")]
    t, q, v = float(solution.t[0]), solution.q[0], solution.v[0]
    start = start_values(system, solution.p, t, q, v)
    return [*_start(solution, start), *_two_steps(solution, advice)]


def _start(solution: Solution, start: Start) -> list[Markup]:
    system = solution.system
    labels = acceleration_labels(system.coordinates, system.rates)
    rates = [record["name"] for record in system.rates]
    mass = [(name, *map(number, row)) for name, row in zip(rates, start.mass_matrix)]
    motion = [(label, number(f), number(a)) for label, f, a in zip(labels, start.f, start.a)]
    names = [record["name"] for record in system.constraints]
    rows = zip(names, start.jacobian, start.gamma, start.multipliers)
    pulls = [(name, *map(number, g), number(c), number(x)) for name, g, c, x in rows]
    return [
        paragraph(f"At t = {number(start.t)} s, in the start state above:"),
        table(("M", *rates), mass),
        table(("", "f", "a"), motion),
        table(("G", *rates, "gamma", "lambda"), pulls),
        paragraph(f"What M a = f {'+ Gᵀ λ, G a = γ ' if system.m else ''}leaves over: {start.imbalance:.2g}"),
    ]


def _two_steps(solution: Solution, advice: Advice | None) -> list[Markup]:
    h = solution.step or (advice.rule_step if advice is not None else np.inf)
    if not np.isfinite(h):
        h = (solution.t_end - solution.t_start) / _STEPS_WITHOUT_RULE
    system, t = solution.system, float(solution.t[0])
    steps = semi_implicit_euler(system, solution.p, t, solution.q[0], solution.v[0], h)
    if not steps:
        return []
    rows = [
        (
            number(s.t),
            c["name"],
            number(s.q[i]),
            number(s.v[i]),
            number(s.a[i]),
            number(s.v_next[i]),
            number(s.q_next[i]),
        )
        for s in steps
        for i, c in enumerate(system.coordinates)
    ]
    formula = (
        f"Two steps of semi-implicit Euler, v' = v + h a(t, q, v), q' = q + h v', with h = {number(h)} s:"
    )
    return [paragraph(formula), table(("t [s]", "", "q", "v", "a", "v'", "q'"), rows)]


def _convergence(convergence: Convergence | None) -> list[Markup]:
    if convergence is None:
        return []
    from symgen.runtime.checks.convergence_text import tables

    found = [
        part for title, (head, *rows) in tables(convergence) for part in (paragraph(title), table(head, rows))
    ]
    return [*found, *curves.growth(convergence), paragraph(convergence.says)]


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
        for e in solution.health
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
