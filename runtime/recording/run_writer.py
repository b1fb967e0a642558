"""What goes into a recording of a run: settings at its beginning, frames, the result at its end.

The page about a run that a recording opens with: model, settings, result, health, as Markdown.
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import json
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checkpoint_check import STATES_OF_EVENTS
from symgen.runtime.exchange import Exchange
from symgen.runtime.lazy import Late
from symgen.runtime.recording import geometry, layout, schema
from symgen.runtime.recording.layout import plot_rows
from symgen.runtime.recording.marks import GROUND_SIZE, Marks
from symgen.runtime.recording.recording import Quantities, Settings
from symgen.runtime.recording.rrd.write import RERUN_VERSION, RrdWriter
from symgen.runtime.recording.surroundings import Surroundings
from symgen.runtime.recording.tethers import TetherWriter, is_held, tethers

if TYPE_CHECKING:
    from symgen.runtime.event_actions import EventRecord
    from symgen.runtime.recording.rrd.write import MarkWriter

mark_writer = Late("symgen.runtime.recording.rrd.write")
recorded = Late("symgen.runtime.inputs.recorded")


_ROOM, _ROOM_OF_ONE = 0.15, 1.0  # around bodies that are followed, of their size: to see where they go
_MOST_LABELS = 60
_TRAIL_PART = 0.15  # of the run's time is what a trail shows, but
_FRAMES_FOR_BOX = 100  # of a chunk are enough to place the camera
_CROSS = 0.03  # arms of the mark at the origin, of the scene's diagonal
_LAYER, _MOST_LAYERS = (
    0.002,
    200,
)  # by how much a planar body is drawn above the one before, of the scene's diagonal
_TRAIL_LONGEST = 1.5  # seconds of playback at most


_MOST_KEPT = 20_000  # frames and boxes by which the camera is placed; between this and twice as many are kept


class Seen:
    """What the camera is placed by: of a run of any length, no more than `2 * _MOST_KEPT` frames and boxes.

    Of longer runs every second frame is kept, then every fourth and so on, and neighbouring boxes are joined.

    Attributes
    ----------
    every : int
        Of how many frames one is kept.
    """

    def __init__(self) -> None:
        self.every = 1
        self._n_frames = 0
        self._times: list[np.ndarray] = []
        self._middles: list[np.ndarray] = []  # of the bodies
        # Of some frames the boxes around all bodies, along the axes of the eye; where these frames are among all.
        self._boxes: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    def take(
        self, t: np.ndarray, middles: np.ndarray, low: np.ndarray, high: np.ndarray, some: slice
    ) -> None:
        """Take frames: their times, shape (n,) [s], middles of the bodies, (n, 3) [m]; of `some`, corners of boxes."""
        frames = self._n_frames + np.arange(len(t))
        kept = frames % self.every == 0
        self._times.append(t[kept])
        self._middles.append(middles[kept].astype(np.float32))
        self._boxes.append((low, high, frames[some].copy()))  # not all that they are a part of
        self._n_frames += len(t)
        while sum(map(len, self._times)) > 2 * _MOST_KEPT:
            self._times, self._middles = (
                [np.concatenate(part)[::2].copy()] for part in (self._times, self._middles)
            )
            self.every *= 2
        while sum(len(low) for low, _, _ in self._boxes) > 2 * _MOST_KEPT:
            lows, highs, numbers = self.boxes()
            pairs = np.arange(0, len(lows), 2)
            joined = np.minimum.reduceat(lows, pairs), np.maximum.reduceat(highs, pairs), numbers[::2].copy()
            self._boxes = [joined]

    def boxes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the corners of boxes, shape (n, 3) each [m], and the numbers of their frames."""
        return tuple(np.concatenate(part) for part in zip(*self._boxes))

    def path(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the times of the frames that are kept [s], and the middles of the bodies there [m]."""
        if not self._times:
            return np.zeros(0), np.zeros((0, 3))
        return np.concatenate(self._times), np.concatenate(self._middles).astype(float)


class Scene:
    """The bodies of one run.

    Parameters
    ----------
    header : dict
        `MODEL` of the generated module.
    of : Quantities
    mesh_folder : Path or None
    """

    def __init__(self, header: dict, of: Quantities, mesh_folder: Path | None):
        self._bodies = header["bodies"]
        self._of = of
        self._mesh_folder = mesh_folder
        self.planar = all(body["planar"] for body in self._bodies)
        self._axes = layout.eye_axes(self.planar)
        self._trails = layout.choose_trails(self._bodies)
        self._colours = layout.choose_colours(self._bodies)
        self._marks = Marks(header if self._bodies else {}, of, self.planar)
        self._primitives: list[geometry.Primitive] = []
        self._tethers: TetherWriter | None = None
        self._is_held = False
        self._diagonal = 1.0
        self._seen = Seen()
        self._t_first = self._t_last = 0.0
        self._last_position: np.ndarray | None = None
        self._mark_writer: MarkWriter | None = None
        self._stretching = [i for i, body in enumerate(self._bodies) if body.get("stretches")]
        self._sizes, self._lifts = np.zeros(0), [0.0] * len(self._bodies)

    def prepare(self, t: np.ndarray, y: np.ndarray) -> None:
        """Choose shapes by the first frames; nothing is written yet."""
        self._t_first = float(t[0])
        if not self._bodies:
            return
        positions, rotations = geometry.split_poses(self._of.evaluate("poses", t, y), len(self._bodies))
        self._sizes = sizes = self._of.shape_sizes(t[0], y[0])
        seen = positions @ self._axes.T
        low, high = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
        if self._marks:
            self._marks.prepare(t, y)
            low, high = np.minimum(low, self._marks.low), np.maximum(high, self._marks.high)
        rods = tethers(self._of, float(t[0]), y[0], tuple(self._marks.bars()))
        for rod in rods:
            self._marks.widen(rod.place, 0.0)
        low, high = np.minimum(low, self._marks.low), np.maximum(high, self._marks.high)
        diagonal = geometry.diagonal_of(*geometry.scene_box(low, high))
        self._diagonal = diagonal
        for rod in rods:
            self._marks.widen(rod.place, GROUND_SIZE * diagonal if rod.anchor < 0 else 0.0)
        self._primitives = geometry.primitives(
            self._bodies, sizes, rotations, diagonal, self._mesh_folder, self._marks.bars()
        )
        names = [body["name"] for body in self._bodies]
        self._tethers = TetherWriter(rods, names, self.planar, diagonal) if rods else None
        self._is_held = is_held(rods) or self._marks.held
        # Bodies of planar models lie on each other, and would flicker where they overlap.
        n_layers = _MOST_LAYERS if self.planar else 0
        lifts = [i * _LAYER * diagonal if i < n_layers else 0.0 for i in range(len(self._bodies))]
        drawn = (names, self._primitives, positions, rotations, diagonal, self.planar)
        self._lifts, self._around = lifts, Surroundings.of_bodies(*drawn, self._colours, lifts)
        self._last_position = positions[0]

    def open(self, writer: RrdWriter) -> None:
        """Write what does not move."""
        index = {body["name"]: i for i, body in enumerate(self._bodies)}
        for name, i in index.items():
            lift = 0.0 if i in self._stretching else self._lifts[i]
            writer.body(name, self._primitives[i], self._colours[i], lift)
            if len(index) <= _MOST_LABELS:
                writer.label(name, self._lifts[i] + self._primitives[i].half_thickness())
        for name, _ in self._trails:
            writer.trail_style(name, self._colours[index[name]])
        if self._marks or self._stretching or self._tethers:
            self._mark_writer = self._opened(writer)
        if self._bodies and not self._marks.grounded and not self._tethers:
            writer.origin(_CROSS * self._diagonal)

    def _opened(self, writer: RrdWriter) -> MarkWriter:
        marks = mark_writer.MarkWriter(writer)
        if self._marks:
            self._marks.open(marks, self._around)
        if self._tethers:
            self._tethers.open(marks, self._around.positions)
        return marks

    def frames(self, writer: RrdWriter, t: np.ndarray, y: np.ndarray, multipliers: np.ndarray) -> None:
        """Write poses, pieces of trails, and what moves besides."""
        self._t_last = float(t[-1])
        if not self._bodies:
            return
        positions, rotations = geometry.split_poses(self._of.evaluate("poses", t, y), len(self._bodies))
        some = slice(None, None, max(1, len(t) // _FRAMES_FOR_BOX))
        seen = positions[some] @ self._axes.T, self._axes @ rotations[some]
        boxes = geometry.drawn_boxes(self._primitives, *seen)
        self._seen.take(t, positions.mean(axis=1), *boxes, some)
        path = np.concatenate([self._last_position[None], positions]).astype(np.float32)
        self._last_position = positions[-1].copy()
        turned = geometry.quaternions(rotations).astype(np.float32)
        trailing = {name for name, _ in self._trails}
        for i, body in enumerate(self._bodies):
            writer.poses(body["name"], path[1:, i], turned[:, i])
            if body["name"] in trailing:
                writer.trail(body["name"], np.stack([path[:-1, i], path[1:, i]], axis=1))
        if self._stretching:
            self._stretch(t, y)
        if self._tethers:
            self._tethers.frames(self._mark_writer, positions)
        if self._marks:
            self._marks.frames(self._mark_writer, t, y, positions, rotations, multipliers)

    def _stretch(self, t: np.ndarray, y: np.ndarray) -> None:
        """Write how bodies change their sizes."""
        sizes = self._of.evaluate("shapes", t, y)
        ends = np.cumsum([0, *(body["sizes"] for body in self._bodies)])
        for i in self._stretching:
            own = slice(ends[i], ends[i + 1])
            grown = sizes[:, own] / np.where(self._sizes[own] != 0.0, self._sizes[own], 1.0)
            path = f"{schema.BODIES}/{self._bodies[i]['name']}/geometry"
            lift = np.broadcast_to([0.0, 0.0, self._lifts[i]], (len(t), 3))
            self._mark_writer.moves(path, lift, scales=self._primitives[i].scales(grown))

    def close(self) -> None:
        """Write what only the whole run tells."""
        if self._marks:
            self._marks.close(self._mark_writer)

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners, along the axes of the eye, of what holds all frames so far [m]."""
        low, high, _ = self._seen.boxes()
        low, high = geometry.scene_box(low.min(axis=0), high.max(axis=0))
        return np.minimum(low, self._marks.low), np.maximum(high, self._marks.high)

    def _camera(self, done: bool) -> tuple[layout.Camera | None, float]:
        """Return where all frames so far are seen from, and the diagonal of what is seen [m]."""
        if not self._bodies:
            return None, 1.0
        low, high, frames = self._seen.boxes()
        _, middles = self._seen.path()
        may_follow = done and not self._is_held and any(body["shape"] for body in self._bodies)
        path = layout.follow(middles, np.median(high - low, axis=0)) if may_follow else None
        if path is not None:
            moved = path[np.minimum(frames // self._seen.every, len(path) - 1)] @ self._axes.T
            low, high = (low - moved).min(axis=0), (high - moved).max(axis=0)
            room = (_ROOM if len(self._bodies) > 1 else _ROOM_OF_ONE) * (high - low)
            low, high = low - room, high + room
        else:
            low, high = self.box()
        return layout.choose_camera(low, high, self.planar, path), geometry.diagonal_of(low, high)

    def layout(self, rows: tuple[layout.Row, ...], *, done: bool) -> layout.Layout:
        """Return the screen for all frames so far, with these plots; scenes are followed when the run is done."""
        camera, diagonal = self._camera(done)
        seconds = self._t_last - self._t_first
        speed = layout.choose_speed(seconds)
        return layout.Layout(
            planar=self.planar,
            camera=camera,
            times=self._seen.path()[0],
            every=self._seen.every,
            grid=layout.round_down(diagonal / 8),
            trails=self._trails,
            folders=((schema.LABELS, False), *self._marks.folders.items()),
            trail_seconds=min(_TRAIL_PART * seconds, _TRAIL_LONGEST * speed),
            rows=rows,
            speed=speed,
            seconds=(self._t_first, max(self._t_last, self._t_first + 1e-9)),
        )


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


_EQUAL = 1e-6  # steps that differ less, of their length, are equal
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
        self._shows = settings.content == schema.ALL
        self._rows = plot_rows(header, of.system.input_descriptions) if self._shows else ()
        self._plots = [curves for row in self._rows for curves in row.plots]
        self._scene = Scene(header if self._shows else {"bodies": ()}, of, settings.mesh_folder)
        self._sha256, self._file_digest = hashlib.sha256(), schema.FileDigest(path)
        self._exchange = Exchange(holds=bool(of.system.switches))
        self._low: dict[str, np.ndarray] = {}
        self._high: dict[str, np.ndarray] = {}
        self._balance_at_start = float(of.balance(of.evaluate("energy", t[:1], y[:1]), y[:1])[0])
        self.n_frames = self._n_checkpoints = 0
        self._last_time = t[:1]
        self._last_step = np.zeros((0, 1))
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
        multipliers = of.multipliers(t, y, settings)
        q, v, w = np.split(y, [system.nq, system.nq + system.nv], axis=1)
        state = {"t": t[:, None], "q": q, "v": v, "w": w, "lambda": multipliers, "settings": settings}
        self._sha256.update(schema.state_bytes(state))
        if self._shows:
            self._rrd.times(t, np.arange(self.n_frames, self.n_frames + len(t)))
            self._rrd.columns(schema.STATE, schema.STATE_ARCHETYPE, state)
            self._show(t, y, multipliers, energy_of_resets, settings)
        else:  # a row of Rerun costs more than what it holds of a small model
            self._rrd.times(t[:1], np.array([self.n_frames]))
            chunk = {name: values.reshape(1, -1) for name, values in state.items()}
            self._rrd.columns(schema.STATE, schema.CHUNK_ARCHETYPE, chunk)
        if of.system.has_feedback:
            self._inputs_at_frames.append((t, of.evaluate("inputs", t, y)))
        if not self.n_frames:
            self._rrd.layout(self._scene.layout(self._rows, done=False))
        self.n_frames += len(t)
        self._last_time = t[-1:].copy()

    def _show(
        self,
        t: np.ndarray,
        y: np.ndarray,
        multipliers: np.ndarray,
        energy_of_resets: np.ndarray,
        settings: np.ndarray,
    ) -> None:
        """Write curves and poses."""
        of, system = self._of, self._of.system
        energies = of.evaluate("energy", t, y)
        shown = {
            "q": y[:, : system.nq],
            "v": y[:, system.nq : system.nq + system.nv],
            "inputs": of.evaluate("inputs", t, y),
            "outputs": of.outputs(t, y, settings),
            "energy": np.column_stack([energies, energies.sum(axis=1)]),
            "balance": _logarithm(self._balance_error(energies, y, energy_of_resets))[:, None],
            "residual": _logarithm(of.residuals(t, y)),
            "multipliers": multipliers,
        }
        self._widen(shown)
        for curves in self._plots:
            if curves.source != "step_size":
                self._rrd.scalars(curves.path, shown[curves.source][:, curves.columns])
        self._scene.frames(self._rrd, t, y, multipliers)

    def _widen(self, shown: dict[str, np.ndarray]) -> None:
        """Note the smallest and largest values of what is plotted."""
        for source, values in shown.items():
            for ends, bound, pick in ((self._low, np.min, np.minimum), (self._high, np.max, np.maximum)):
                here = bound(values, axis=0)
                ends[source] = pick(ends[source], here) if source in ends else here

    def events(self, events: list[tuple[int, float, str, float, EventRecord | None]]) -> None:
        """Write events: first frame after it, time [s], name, change of T + V [J], the record of the run."""
        for known, some in itertools.groupby(events, lambda event: event[4] is not None):
            self._events(list(some), known)

    def _events(self, events: list[tuple[int, float, str, float, EventRecord | None]], known: bool) -> None:
        frames, t, names, changes, whole = (list(column) for column in zip(*events))
        columns = {"t": np.array(t)[:, None], "name": names, "energy_change": np.array(changes)[:, None]}
        if known:
            numbers = [
                np.concatenate([[event.work], *(getattr(event, key) for key in STATES_OF_EVENTS)])
                for event in whole
            ]
            columns |= {"action": [event.action for event in whole], "around": np.array(numbers)}
        self._rrd.times(np.array(t), np.array(frames))
        self._rrd.columns(schema.EVENTS, schema.EVENT_ARCHETYPE, columns)
        self._rrd.events(names)

    def steps(self, log: np.ndarray) -> None:
        """Write the plot of step sizes: rows of t and h."""
        # Equal steps differ in their last bits, which a plot would blow up to its full height.
        lengths = log[:, 1:].astype(np.float32).astype(float)
        self._rrd.times(log[:, 0])
        self._rrd.scalars(schema.STEP_SIZE, lengths)
        # The last one ends where the run does.
        before_last = np.concatenate([self._last_step, lengths[:-1]])
        if len(before_last):
            self._widen({"step_size": before_last})
        self._last_step = lengths[-1:].copy()

    def _final_rows(self) -> tuple[layout.Row, ...]:
        """Return the plots as all values suggest: of equal steps the length stands in place of a flat line."""
        low, high = self._low.get("step_size"), self._high.get("step_size")
        if low is None or not high[0] - low[0] <= _EQUAL * high[0]:
            return layout.readable(self._rows, self._low, self._high)
        self._rrd.note(
            schema.EQUAL_STEPS, f"All steps are **h = {high[0]:.7g} s** long; the last one may be shorter."
        )
        return layout.readable(layout.with_equal_steps(self._rows), self._low, self._high)

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
        self._rrd.layout(self._scene.layout(self._final_rows(), done=True))
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
        run |= {} if self._shows else {"content": self._settings.content}
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
        if not self._of.system.input_descriptions:
            return
        times, values = np.zeros(0), np.zeros((0, len(self._header["inputs"])))
        if self._inputs_at_frames:
            times, values = (np.concatenate(part) for part in zip(*self._inputs_at_frames))
        text = recorded.recorded_inputs(self._of.system, *((times, values) if done else ()))
        self._rrd.property(schema.INPUTS_OVER_TIME, {"pieces": text})

    def _document(self, status: str, health: Sequence[dict], stats: dict[str, Any]) -> None:
        over_time = self._of.system.input_descriptions
        self._rrd.document(page(self._header, self._of.p, over_time, self._settings, status, health, stats))

    def _balance_error(self, energies: np.ndarray, y: np.ndarray, energy_of_resets: np.ndarray) -> np.ndarray:
        """Return |T + V − work − its start|, of what the motion exchanged up to the end of these frames, shape (n,)."""
        error = self._of.balance(energies, y) - energy_of_resets - self._balance_at_start
        return self._exchange.take(energies).relative(error)


def _logarithm(values: np.ndarray) -> np.ndarray:
    return np.log10(np.maximum(values, _SMALLEST_SHOWN))
