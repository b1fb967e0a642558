"""A run in a notebook: its mechanism, its numbers and its health at a glance, and its series as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from symgen.runtime.checks.health import health_of, objections_to
from symgen.runtime.plain_text import plain
from symgen.runtime.report.drawing import drawing
from symgen.runtime.report.html import drawing_style, figure, markup, number, paragraph, table
from symgen.runtime.tables import columns_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from symgen.runtime.solution import Solution

_MOST_ROWS = 12


def html(solution: Solution) -> str:
    """Return a run as a piece of HTML: drawing of its end, end state, health."""
    system, row = solution.system, -1
    columns = columns_of(solution)
    rows = [
        (name, number(value), unit)
        for name, value, unit in zip(columns.names, columns.values[row], columns.units)
    ]
    found = health_of(solution)
    objections = objections_to(solution)
    passed = sum(not entry.note for entry in found) - len(objections)
    verdict = f"{passed} of {passed + len(objections)} health checks passed"
    parts = [
        paragraph(f"{system.name}: {solution.status} at t = {number(solution.t[-1])} s by {solution.method}"),
        paragraph(solution.message),
        figure(
            drawing(system, solution.p, float(solution.t[row]), solution.states[row]), "the end of the run"
        ),
        table(("at the end", "", "unit"), rows[:_MOST_ROWS]),
        paragraph(f"… and {len(rows) - _MOST_ROWS} more series" if len(rows) > _MOST_ROWS else ""),
        paragraph(verdict),
        table(("not to be trusted", ""), [(entry.check, entry.says) for entry in objections]),
        table(("note", ""), [(entry.check, entry.says) for entry in found if entry.note]),
    ]
    return plain(
        f'<div class="symgen"><style>{drawing_style(".symgen")}</style>{"".join(map(markup, parts))}</div>'
    )


def plot(solution: Solution, names: Sequence[str] = ()) -> Figure:
    """Return series over time as a figure, those of a unit in one diagram."""
    from matplotlib.figure import Figure

    columns = columns_of(solution)
    units = dict(zip(columns.names, columns.units))
    chosen = list(names) or [record["name"] for record in solution.system.coordinates]
    groups: dict[str, list[str]] = {}
    series = {name: solution[name] for name in chosen}
    for name in chosen:
        groups.setdefault(units.get(name, ""), []).append(name)
    drawn = Figure(figsize=(8.0, 0.6 + 2.4 * len(groups)), layout="constrained")
    for axes, (unit, members) in zip(
        drawn.subplots(len(groups), sharex=True, squeeze=False)[:, 0], groups.items()
    ):
        for name in members:
            axes.plot(solution.t, series[name], label=name)
        axes.set_ylabel(f"{members[0] if len(members) == 1 else ''} [{unit or '1'}]".strip())
        axes.grid(alpha=0.3)
        if len(members) > 1:
            axes.legend(fontsize=8)
    axes.set_xlabel("t [s]")
    return drawn
