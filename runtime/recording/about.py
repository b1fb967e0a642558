"""The page about a run that a recording opens with: model, settings, result, health, as Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

_MOST_PARAMETERS = 60


@dataclass(frozen=True)
class Settings:
    """What is known of a run before it begins; see `RunRecorder`."""

    title: str
    method: str
    constraints: str
    rtol: float
    atol: float
    module_text: str
    model_text: str
    options: dict[str, Any]
    mesh_folder: Path | None


def page(
    header: dict,
    p: np.ndarray,
    over_time: Mapping[str, str],
    settings: Settings,
    status: str,
    health: Sequence[dict],
    stats: dict[str, Any],
) -> str:
    """Return the page.

    Parameters
    ----------
    header : dict
        `MODEL` of the generated module.
    p : ndarray
        Parameters, then inputs.
    over_time : mapping of str to str
        What inputs over time are, by name.
    settings : Settings
    status : str
    health : sequence of dict
        Empty while the run goes on.
    stats : dict
    """
    m = header["nh"] + header["nn"]
    lines = [f"# {settings.title}", "", header["description"], ""]
    facts = {
        "Status": status,
        "Size": f"{header['nq']} coordinates, {header['nv']} rates, {m} constraints",
        "Method": settings.method,
        **({"Constraints": settings.constraints} if m else {}),
        "Tolerances": f"relative {settings.rtol:g}, absolute {settings.atol:g}",
        "Generator": header["generator"],
    }
    lines += _table(("", ""), facts.items())
    if health:
        rows = [(check["check"], _mark(check), check["says"]) for check in health]
        lines += ["", "## Health", "", *_table(("Check", "", ""), rows)]
    if stats:
        lines += ["", "## Work", "", *_table(("", ""), stats.items())]
    quantities = [*header["parameters"], *header["inputs"]]
    if quantities:
        rows = [
            (q["name"], over_time.get(q["name"], f"{value:.12g} {q['unit']}"), q.get("doc", ""))
            for q, value in zip(quantities, p)
        ]
        lines += ["", "## Parameters and inputs", "", *_table(("Name", "Value", ""), rows[:_MOST_PARAMETERS])]
        if len(rows) > _MOST_PARAMETERS:
            lines += ["", f"… and {len(rows) - _MOST_PARAMETERS} more, in the recording's properties."]
    return "\n".join(lines) + "\n"


def _mark(check: dict) -> str:
    if not check["ok"]:
        return "**not ok**"
    return "note" if check.get("note") else "ok"


def _table(head: tuple[str, ...], rows) -> list[str]:
    cells = [tuple(str(cell).replace("|", "\\|").replace("\n", " ") for cell in row) for row in rows]
    return ["| " + " | ".join(row) + " |" for row in (head, ("---",) * len(head), *cells)]
