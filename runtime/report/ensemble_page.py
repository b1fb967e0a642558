"""The page of an ensemble: how members came out, what failed and why, distributions, members as lines across axes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from symgen.runtime.ensemble.reduction import Reduction, histogram, quantiles
from symgen.runtime.ensemble.verdict import CAUSES
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
from symgen.runtime.report.parallel import parallel_axes
from symgen.runtime.report.svg import Curve, plot

_BINS = 48
_MOST_QUANTITIES = 24
_MOST_AXES = 9
_LINES = 400  # members across the axes
_SHARES = (0.05, 0.5, 0.95)
_MOST_NAMED, _MOST_MESSAGES = 20, 10


def ensemble_page(stored: Any) -> str:
    """Return the page of what `symgen sweep` has written, as HTML.

    Parameters
    ----------
    stored : Stored or ZarrStore
    """
    about = stored.about
    names = list(dict.fromkeys([*about["varied"], *about["series"]]))[:_MOST_QUANTITIES]
    ends, verdicts = _Ends(names), _Verdicts()
    for first, piece in stored.pieces([*names, "status", "ok", "energy_error"]):
        verdicts.take(first, piece)
        ends.take(piece)
    for _, piece in stored.pieces(names):
        ends.count(piece)
    lines = _Lines(stored, names[:_MOST_AXES], verdicts.n)
    head = [
        Markup(f"<header><h1>{markup(about['model'])}</h1>{_verdict(verdicts, stored.n)}</header>"),
        paragraph(
            f"{verdicts.n} of {stored.n} members by {about['method']}, to t = {number(about['t_end'])} s, "
            f"rtol {about['rtol']:g}, atol {about['atol']:g}."
        ),
    ]
    sections = [
        section("Members", *_layout(about), listing(about["notes"])),
        section("Failures", *_failures(verdicts, stored.messages())),
        section("Statistics at the end", ends.table()),
        section("Distributions", *ends.figures(set(about["varied"]))),
        section("Members across their values", *lines.figures()),
        section("Over time", *_over_time(stored, about["series"])),
    ]
    return page(f"{about['model']}: ensemble", [*head, contents(sections), *sections])


def _verdict(verdicts: _Verdicts, n: int) -> Markup:
    bad = verdicts.n_failed + verdicts.n_doubtful
    if not bad and verdicts.n == n:
        return paragraph("Every member reached its end, and every check passed.")
    said = [f"{count} {what} ({count / max(verdicts.n, 1):.2%})" for count, what in (
        (verdicts.n_failed, "failed"), (verdicts.n_doubtful, "are doubtful")) if count]  # fmt: skip
    said += [f"{n - verdicts.n} were not run"] if verdicts.n < n else []
    return Markup(f'<p class="bad">{markup("; ".join(said))}</p>')


def _layout(about: dict[str, Any]) -> list[Markup]:
    rows = [(str(name), str(count)) for name, count in about["shape"].items()]
    return [
        paragraph(f"What varies: {', '.join(about['varied']) or 'nothing'}."),
        table(("members", "number"), rows),
    ]


class _Verdicts:
    """How members came out, piece by piece."""

    def __init__(self) -> None:
        self.n = self.n_failed = self.n_doubtful = 0
        self.causes: Counter[int] = Counter()
        self.named: list[tuple[int, str]] = []

    def take(self, first: int, piece: dict[str, np.ndarray]) -> None:
        status, ok = piece["status"], piece["ok"]
        failed = status != 1
        self.n += len(status)
        self.n_failed += int(failed.sum())
        self.n_doubtful += int((~ok & ~failed).sum())
        self.causes.update(status[failed].tolist())
        for k in np.flatnonzero(~ok)[: _MOST_NAMED - len(self.named)]:
            why = (
                CAUSES.get(int(status[k]), "unknown")
                if failed[k]
                else f"energy off by {piece['energy_error'][k]:.2g}"
            )
            self.named.append((first + int(k), why))


def _failures(verdicts: _Verdicts, messages: dict[int, str]) -> list[Markup]:
    rows = [
        (CAUSES.get(s, "unknown"), str(n), f"{n / verdicts.n:.3%}") for s, n in verdicts.causes.most_common()
    ]
    if verdicts.n_doubtful:
        rows.append(
            ("doubtful: a check objects", str(verdicts.n_doubtful), f"{verdicts.n_doubtful / verdicts.n:.3%}")
        )
    said = [f"member {k}: {text}" for k, text in list(messages.items())[:_MOST_MESSAGES]]
    return [
        table(("cause", "members", "share"), rows),
        table(("member", "what"), [(str(k), why) for k, why in verdicts.named]),
        listing(said),
    ]


class _Ends:
    """Statistics and histograms of quantities at the end, in two passes over what may not fit into memory."""

    def __init__(self, names: Sequence[str]) -> None:
        self._moments = {
            name: Reduction(name, ["mean", "std", "min", "max", quantiles(*_SHARES)]) for name in names
        }
        self._counts: dict[str, Reduction] = {}

    def take(self, piece: dict[str, np.ndarray]) -> None:
        for name, reduction in self._moments.items():
            reduction.take(_end(piece[name]))

    def count(self, piece: dict[str, np.ndarray]) -> None:
        if not self._counts:
            self._known = {name: reduction.result() for name, reduction in self._moments.items()}
            for name, known in self._known.items():
                if np.isfinite(known["min"]) and known["min"] < known["max"]:
                    self._counts[name] = Reduction(name, [histogram(_BINS, known["min"], known["max"])])
        for name, reduction in self._counts.items():
            reduction.take(_end(piece[name]))

    def table(self) -> Markup:
        head = ("quantity", "mean", "deviation", "least", "5 %", "median", "95 %", "most")
        rows = []
        for name, known in getattr(self, "_known", {}).items():
            if np.isfinite(known["min"]):
                q = known["quantiles"]
                values = (known["mean"], known["std"], known["min"], *(q[x] for x in _SHARES), known["max"])
                rows.append((name, *(f"{value:.6g}" for value in values)))
        return table(head, rows)

    def figures(self, varied: set[str]) -> Iterator[Markup]:
        for name, reduction in sorted(self._counts.items(), key=lambda item: item[0] in varied):
            found = reduction.result()["histogram"]
            x, y = np.repeat(found["edges"], 2), np.concatenate([[0], np.repeat(found["counts"], 2), [0]])
            what = "what varies" if name in varied else "at the end"
            yield figure(
                plot([Curve(name, x, y.astype(float))], name, "members", ordered=False), f"{name}: {what}"
            )


def _end(values: np.ndarray) -> np.ndarray:
    return values if values.ndim == 1 else values[:, -1]


class _Lines:
    """Some members, spread evenly, as lines across an axis for each quantity; what is not ok is drawn above."""

    def __init__(self, stored: Any, names: Sequence[str], n: int) -> None:
        self._names, rows, ok, seen = list(names), [], [], 0
        step = max(1, n // _LINES)
        for _, piece in stored.pieces([*names, "ok"]):
            here = np.arange(-seen % step, len(piece["ok"]), step)
            seen += len(piece["ok"])
            rows.append(np.column_stack([_end(piece[name])[here].astype(float) for name in names]))
            ok.append(piece["ok"][here])
        self._rows = np.concatenate(rows) if rows else np.zeros((0, len(names)))
        self._ok = np.concatenate(ok) if ok else np.zeros(0, dtype=bool)

    def figures(self) -> Iterator[Markup]:
        if len(self._names) > 1 and len(self._rows):
            said = (
                f"{len(self._rows)} members, each a line across its values; doubtful and failed ones in red"
            )
            yield figure(parallel_axes(self._names, self._rows, self._ok), said)


def _over_time(stored: Any, names: Sequence[str]) -> Iterator[Markup]:
    """Quantiles of series over time."""
    if len(stored.t) < 2:
        return
    for name in names[:_MOST_QUANTITIES]:
        reduction = Reduction(name, [quantiles(*_SHARES)])
        for _, piece in stored.pieces([name]):
            if piece[name].ndim > 1:
                reduction.take(piece[name])
        found = reduction.result()["quantiles"]
        if all(np.size(values) == len(stored.t) for values in found.values()):
            curves = [Curve(f"{share:.0%}", stored.t, values) for share, values in found.items()]
            yield figure(
                plot(curves, "t [s]", name),
                f"{name}: median, and what lies between 5 and 95 % of the members",
            )
