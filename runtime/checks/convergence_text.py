"""The tables of a convergence study: rows of cells, and lines of text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from symgen.runtime.checks.horizon import DIGITS

if TYPE_CHECKING:
    from symgen.runtime.checks.convergence import Convergence

_MOST_ERRORS = 8

Table = list[list[str]]


def tables(study: Convergence) -> Iterator[tuple[str, Table]]:
    """Yield the title and the rows of each table, its head first; those that have nothing to say are left out."""
    change = "step halved" if study.quantity == "step" else "tolerances tightened"
    yield f"{study.model}: {study.method}, {change}", _levels(study)
    if study.errors:
        asked = f"{study.quantity} {study.levels[study.asked].setting:.3g}{' s' if study.quantity == 'step' else ''}"
        shown, n = min(_MOST_ERRORS, len(study.errors)), len(study.errors)
        which = "" if shown == n else f", the worst {shown} of {n}"
        yield f"estimated errors with {asked}{which}", _errors(study)
    if study.momenta:
        yield f"conserved momenta, their drift with each {study.quantity}", _momenta(study)
    growth = study.horizon
    if growth is not None and (growth.rate is not None or growth.of(DIGITS[0]) < growth.t_end):
        yield "trusted digits", _digits(study)


def lines(study: Convergence) -> Iterator[str]:
    """Yield all tables as text."""
    for title, rows in tables(study):
        yield title
        widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
        for row in rows:
            yield "  " + "  ".join(cell.rjust(width) for cell, width in zip(row, widths)).rstrip()


def _levels(study: Convergence) -> Table:
    head = [study.quantity, "steps", "difference"]
    head += ["order"] if study.quantity == "step" else []
    head += ["energy error"]
    head += ["positions", "velocities"] if study.constrained else []
    rows = [head]
    for level in study.levels:
        row = [
            f"{level.setting:.3g}",
            str(level.steps),
            "finest" if level.difference is None else f"{level.difference:.2e}",
        ]
        if study.quantity == "step":
            row.append("" if level.order is None else f"{level.order:.2f}")
        row.append(f"{level.energy_error:.2e}")
        if study.constrained:
            row += [f"{level.position_residual:.2e}", f"{level.velocity_residual:.2e}"]
        rows.append(row)
    return rows


def _errors(study: Convergence) -> Table:
    order = "order" if study.quantity == "step" else "power of rtol"
    rows = [["", "largest", "at the end", "unit", "of its size", order]]
    worst = sorted(study.errors, key=lambda entry: -entry.relative)[:_MOST_ERRORS]
    for entry in worst:
        power = "" if entry.order is None else f"{entry.order:.2f}"
        rows.append(
            [
                entry.name,
                f"{entry.error:.2e}",
                f"{entry.at_end:.2e}",
                entry.unit,
                f"{entry.relative:.2e}",
                power,
            ]
        )
    return rows


def _momenta(study: Convergence) -> Table:
    rows = [["", "at the start", *(f"{level.setting:.3g}" for level in study.levels)]]
    for entry in study.momenta:
        rows.append([entry.name, f"{entry.start:.6g}", *(f"{drift:.2e}" for drift in entry.drift)])
    return rows


def _digits(study: Convergence) -> Table:
    rows = [["up to t [s]", "error of size", "digits"]]
    for t, error, digits in study.horizon.rows():
        rows.append([f"{t:.4g}", f"{error:.1e}", f"{digits:.1f}"])
    return rows
