"""What goes into a recording of a run: settings at its beginning, frames, the result at its end.

The page about a run that a recording opens with: model, settings, result, health, as Markdown.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from symgen.runtime.exchange import Exchange
from symgen.runtime.lazy import Late

from . import schema
from .layout import plot_rows
from .quantities import Quantities, Settings
from .rrd.write import RERUN_VERSION, RrdWriter
from .scene import Scene

_MOST_PARAMETERS = 60


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


recorded = Late("symgen.runtime.inputs.recorded")

_OF_ONE_UNIT = ("q", "v", "outputs", "multipliers")  # plots of several quantities
_SMALLEST_SHOWN = 1e-16  # what stands for zero where the logarithm is plotted


class RunWriter:
    """Writes one run to one file, in chunks of frames.

    Parameters
    ----------
    path : Path
    of : Quantities
    settings : Settings
    t, y : ndarray
        The first frames: shapes are chosen by them, and the energy balance refers to the first.
    """

    def __init__(self, path: Path, of: Quantities, settings: Settings, t: np.ndarray, y: np.ndarray):
        header = of.system.source.header
        self._of, self._settings, self._header = of, settings, header
        self._plots = [curves for row in plot_rows(header) for curves in row]
        self._scene = Scene(header, of, settings.mesh_folder)
        self._sha256, self._file_digest = hashlib.sha256(), schema.FileDigest(path)
        self._exchange = Exchange()
        self._low: dict[str, np.ndarray] = {}
        self._high: dict[str, np.ndarray] = {}
        self._balance_at_start = float(of.balance(of.evaluate("energy", t[:1], y[:1]), y[:1])[0])
        self.n_frames = self._n_checkpoints = 0
        self._last_time = t[:1]
        self._inputs_at_frames: list[tuple[np.ndarray, np.ndarray]] = []
        # All that can go wrong with the model's shapes goes wrong before the file is made.
        self._scene.prepare(t, y)
        self._rrd = RrdWriter(path, settings.title, self._scene.planar)
        self._write_settings()
        self._document("not finished", [], {})
        self._scene.open(self._rrd)
        for curves in self._plots:
            self._rrd.curves(curves)
        # Settings come before the first states, wherever the file is cut off.
        self._rrd.flush()

    def frames(
        self, t: np.ndarray, y: np.ndarray, energy_of_resets: np.ndarray, settings: np.ndarray
    ) -> None:
        """Write frames.

        Parameters
        ----------
        t, y : ndarray
        energy_of_resets : ndarray, shape (n,) [J]
            What resets before each frame have added to T + V.
        settings : ndarray, shape (n, number of settings)
            Of stops and frictions.
        """
        of, system = self._of, self._of.system
        energies = of.evaluate("energy", t, y)
        multipliers = of.multipliers(t, y, settings)
        q, v, w = np.split(y, [system.nq, system.nq + system.nv], axis=1)
        state = {"t": t[:, None], "q": q, "v": v, "w": w, "lambda": multipliers, "settings": settings}
        self._sha256.update(schema.state_bytes(state))
        self._rrd.times(t, np.arange(self.n_frames, self.n_frames + len(t)))
        self._rrd.columns(schema.STATE, schema.STATE_ARCHETYPE, state)
        shown = {
            "q": q,
            "v": v,
            "outputs": of.evaluate("outputs", t, y),
            "energy": np.column_stack([energies, energies.sum(axis=1)]),
            "balance": _logarithm(self._balance_error(energies, y, energy_of_resets))[:, None],
            "residual": _logarithm(of.residuals(t, y)),
            "multipliers": multipliers,
        }
        self._widen(shown)
        for curves in self._plots:
            if curves.source in shown:
                self._rrd.scalars(curves.path, shown[curves.source][:, curves.columns])
        self._scene.frames(self._rrd, t, y, multipliers)
        if of.system.has_feedback:
            self._inputs_at_frames.append((t, of.evaluate("inputs", t, y)))
        if not self.n_frames:
            self._rrd.layout(self._scene.layout(self._low, self._high))
        self.n_frames += len(t)
        self._last_time = t[-1:]

    def _widen(self, shown: dict[str, np.ndarray]) -> None:
        """Note the smallest and largest values of what is plotted."""
        for source in _OF_ONE_UNIT:
            for ends, bound, pick in ((self._low, np.min, np.minimum), (self._high, np.max, np.maximum)):
                here = bound(shown[source], axis=0)
                ends[source] = pick(ends[source], here) if source in ends else here

    def events(self, events: list[tuple[int, float, str, float]]) -> None:
        """Write events: number of the first frame after it, time [s], name, change of T + V [J]."""
        frames, t, names, changes = (list(column) for column in zip(*events))
        columns = {"t": np.array(t)[:, None], "name": names, "energy_change": np.array(changes)[:, None]}
        self._rrd.times(np.array(t), np.array(frames))
        self._rrd.columns(schema.EVENTS, schema.EVENT_ARCHETYPE, columns)
        self._rrd.events(names)

    def steps(self, log: np.ndarray) -> None:
        """Write the plot of step sizes: rows of t and h."""
        # Equal steps differ in their last bits, which a plot would blow up to its full height.
        self._rrd.times(log[:, 0])
        self._rrd.scalars(schema.STEP_SIZE, log[:, 1:].astype(np.float32).astype(float))

    def checkpoint(self, content: bytes) -> None:
        """Write a checkpoint of the run after the frames so far."""
        self._rrd.times(self._last_time, np.array([self.n_frames]))
        self._n_checkpoints += 1
        columns = {
            "number": np.array([[float(self._n_checkpoints)]]),
            "content": np.frombuffer(content, dtype=np.uint8)[None],
        }
        self._rrd.columns(schema.CHECKPOINT, schema.CHECKPOINT_ARCHETYPE, columns)

    def flush(self) -> None:
        """Make all that was written survive the end of this process."""
        self._rrd.flush()
        # Now, beside the run, rather than at its end.
        self._file_digest.extend(self._rrd.path.stat().st_size)

    def result(self, status: str, health: Sequence[dict], stats: dict[str, Any]) -> None:
        """Write the closing record with the SHA-256 of all states, and the final layout."""
        self._document(status, health, stats)
        self._write_inputs_over_time(done=True)
        self._scene.close()
        self._rrd.layout(self._scene.layout(self._low, self._high))
        closing = {
            "status": status,
            "health": json.dumps([dict(check) for check in health]),
            "stats": json.dumps(dict(stats)),
            "n_frames": self.n_frames,
            "sha256": self._sha256.hexdigest(),
        }
        self.flush()
        written = self._file_digest.n_bytes
        closing |= {"file_bytes": written, "file_sha256": self._file_digest.extend(written)}
        self._rrd.property(schema.RESULT, closing)

    def close(self) -> None:
        """Close the file."""
        self._rrd.close()

    def discard(self) -> None:
        """Let go of a file that cannot be written any more."""
        with contextlib.suppress(Exception):
            self._rrd.close()

    def _write_settings(self) -> None:
        header, settings, n = self._header, self._settings, len(self._header["parameters"])
        texts = {"module_text": settings.module_text, "model_text": settings.model_text}
        names = {key: header[key] for key in ("name", "description", "source")}
        self._rrd.property(schema.MODEL, {**names, **texts})
        run = {key: getattr(settings, key) for key in ("title", "method", "constraints", "rtol", "atol")}
        options = json.dumps(settings.options, sort_keys=True)
        self._rrd.property(schema.RUN, {"format": schema.FORMAT, **run, "options": options})
        for name, quantities, values in (
            (schema.PARAMETERS, header["parameters"], self._of.p[:n]),
            (schema.INPUTS, header["inputs"], self._of.p[n : n + len(header["inputs"])]),
        ):
            if quantities:
                columns = {key + "s": [quantity[key] for quantity in quantities] for key in ("name", "unit")}
                self._rrd.property(name, {**columns, "values": values})
        self._write_inputs_over_time(done=False)
        versions = {
            "generator": header["generator"],
            "python": platform.python_version(),
            "numpy": np.__version__,
            "numba": version("numba"),
            "rerun": RERUN_VERSION,
            "machine": f"{platform.system()} {platform.machine()}",
        }
        self._rrd.property(schema.VERSIONS, versions)

    def _write_inputs_over_time(self, *, done: bool) -> None:
        if not self._of.system.input_words:
            return
        times, values = np.zeros(0), np.zeros((0, len(self._header["inputs"])))
        if self._inputs_at_frames:
            times, values = (np.concatenate(part) for part in zip(*self._inputs_at_frames))
        text = recorded.recorded_inputs(self._of.system, *((times, values) if done else ()))
        self._rrd.property(schema.INPUTS_OVER_TIME, {"pieces": text})

    def _document(self, status: str, health: Sequence[dict], stats: dict[str, Any]) -> None:
        over_time = self._of.system.input_words
        self._rrd.document(page(self._header, self._of.p, over_time, self._settings, status, health, stats))

    def _balance_error(self, energies: np.ndarray, y: np.ndarray, energy_of_resets: np.ndarray) -> np.ndarray:
        """Return |T + V − work − its start|, of what the motion exchanged up to the end of these frames, shape (n,)."""
        error = self._of.balance(energies, y) - energy_of_resets - self._balance_at_start
        return self._exchange.take(energies).relative(error)


def _logarithm(values: np.ndarray) -> np.ndarray:
    return np.log10(np.maximum(values, _SMALLEST_SHOWN))
