"""The results as a table of text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from .sweep import LEVELS, label

_LABELS = tuple(map(label, LEVELS))
_SHORTEST_REASON = 100


def scene_table(result: Mapping[str, Any]) -> list[str]:
    """Return the lines for one scene: run time [ms] at each error level, by method and by peer.

    The fastest of this project's methods at a level is marked with `*`, a peer that is faster with `!`.
    """
    lines = [
        f"{result['scene']}: {result['says']}; reference good to {result['reference']['error']:.0e}",
        _row("  method, ms at error", *_LABELS, "solve", "least error"),
    ]
    best = {level: name_and_seconds for level, name_and_seconds in result["best"].items() if name_and_seconds}
    notes: list[str] = []
    for name, method in result["methods"].items():
        marks = {level: "*" for level, (winner, _) in best.items() if winner == name}
        lines.append(_row(f"  {name}", *_times(method["levels"], marks), *_whole(method)))
        notes += _notes(name, method)
    lines += [*_multipliers(result["methods"]), *_auto(result["auto"])]
    for name, peer in result["peers"].items():
        faster = {
            level: "!" for level, seconds in peer["levels"].items()
            if seconds is not None and (level not in best or seconds < best[level][1])
        }  # fmt: skip
        if peer["rows"]:
            lines.append(_row(f"  {name}", *_times(peer["levels"], faster), "", _least(peer)))
        notes += _notes(name, peer)
    return [*lines, *notes]


def _notes(name: str, method: Mapping[str, Any]) -> Iterator[str]:
    """Say why a level was not reached, and which runs went wrong without saying so."""
    if method["says"] and any(seconds is None for seconds in method["levels"].values()):
        yield f"  {name}: {_short(method['says'])}"
    if method["lost"]:
        settings = ", ".join(f"{setting:.1g}" for setting in method["lost"])
        yield f"  {name}: wrong by more than the motion itself, without a word, at {settings}"


def _multipliers(methods: Mapping[str, Any]) -> Iterator[str]:
    """Say how good the multipliers are at best, and with which method."""
    found = [
        (row["multiplier_error"], name)
        for name, method in methods.items()
        for row in method["rows"]
        if row.get("multiplier_error") is not None
    ]
    if found:
        yield f"  multipliers: least error {min(found)[0]:.1e}, of {min(found)[1]}"


def _auto(auto: Mapping[str, Any]) -> Iterator[str]:
    chosen = list(dict.fromkeys(choice["method"] for choice in auto["choices"]))
    if not chosen:
        return
    yield _row("  auto", *_times(auto["levels"], {}), "", f"takes {', '.join(chosen)}")
    factors = (auto["factors"][level] for level in _LABELS)
    yield _row("  auto / best", *("-" if factor is None else f"{factor:.2f} " for factor in factors), "", "")


def _times(levels: Mapping[str, float | None], marks: Mapping[str, str]) -> list[str]:
    return [
        "- " if levels[level] is None else f"{1e3 * levels[level]:.3g}{marks.get(level, ' ')}"
        for level in _LABELS
    ]


def _whole(method: Mapping[str, Any]) -> tuple[str, str]:
    seconds = method["solve_seconds"]
    return "" if seconds is None else f"{1e3 * seconds:.3g}", _least(method)


def _least(method: Mapping[str, Any]) -> str:
    errors = [row["error"] for row in method["rows"] if row["error"] is not None]
    return f"{min(errors):.1e}" if errors else "none"


def _row(first: str, *cells: str) -> str:
    return (first.ljust(24) + "".join(cell.rjust(11) for cell in cells[:-1]) + "  " + cells[-1]).rstrip()


def _short(text: str) -> str:
    return text if len(text) <= _SHORTEST_REASON else text[: _SHORTEST_REASON - 1] + "…"
