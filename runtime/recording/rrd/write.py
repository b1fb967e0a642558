"""Draws marks into a recording: lines and solids fixed to bodies, symbols that move, arrows."""

from __future__ import annotations

import contextlib
import functools
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb

from symgen.runtime.recording import schema
from symgen.runtime.recording.geometry import NOTHING, Primitive, quaternions
from symgen.runtime.recording.layout import Camera, Curves, Layout
from symgen.runtime.recording.schema import RecordingError
from symgen.runtime.recording.symbols import frames_along

# How a recording is shown: a layout as Rerun's blueprint.

GREY = (150, 155, 165)
_LEGEND_FITS = 12
_FOCUS = 1000.0  # pixels; only ratios count
_UNSEEN = 1e-9  # size of the camera itself [m]


def blueprint(layout: Layout) -> rrb.Blueprint:
    """Return Rerun's form of a layout."""
    boundary = rrb.TimeRangeBoundary.absolute
    whole = rr.TimeRange(start=boundary(seconds=layout.seconds[0]), end=boundary(seconds=layout.seconds[1]))
    rows = [_tabs([_plot(curves, whole) for curves in row.plots]) for row in layout.rows]
    about = rrb.TextDocumentView(origin=schema.ABOUT, name="About this run")
    scene = [] if layout.camera is None else [_scene(layout)]
    left = rrb.Tabs(*scene, about, rrb.TextLogView(origin=schema.EVENTS, name="Events"), active_tab=0)
    return rrb.Blueprint(
        rrb.Horizontal(
            left, rrb.Vertical(*rows, row_shares=[row.share for row in layout.rows]), column_shares=[3, 2]
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(
            state="collapsed",
            timeline=schema.SIM_TIME,
            playback_speed=layout.speed,
            loop_mode="all",
            play_state="playing",
        ),
        auto_views=False,
        auto_layout=False,
    )


def _tabs(views: list):
    return views[0] if len(views) == 1 else rrb.Tabs(*views, active_tab=0)


def _scene(layout: Layout) -> rrb.Spatial3DView:
    # A range of visible time counts for the entity that it names, not for those below it.
    past = rrb.VisibleTimeRange(
        schema.SIM_TIME,
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-layout.trail_seconds),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    overrides = {}
    for name, shown in layout.trails:
        behaviour = [] if shown else [rrb.EntityBehavior(visible=False)]
        overrides[f"{schema.TRAILS}/{name}"] = [rrb.VisibleTimeRanges([past]), *behaviour]
    overrides |= {folder: rrb.EntityBehavior(visible=False) for folder, shown in layout.folders if not shown}
    plane = rr.components.Plane3D.XY if layout.planar else rr.components.Plane3D([0.0, 0.0, 1.0])
    camera = layout.camera
    return rrb.Spatial3DView(
        origin=schema.WORLD,
        name="Scene",
        overrides=overrides,
        line_grid=rrb.LineGrid3D(visible=True, spacing=layout.grid, plane=plane, color=(*GREY, 40)),
        eye_controls=rrb.EyeControls3D(tracking_entity=f"/{_eye(camera)}"),
    )


def _eye(camera: Camera) -> str:
    return schema.EYE if camera.path is None else schema.FOLLOWING_EYE


def _plot(curves: Curves, whole: rr.TimeRange) -> rrb.TimeSeriesView | rrb.TextDocumentView:
    if curves.note:
        return rrb.TextDocumentView(origin=curves.path, name=curves.title)
    overrides = {curves.path: rr.SeriesLines(visible_series=list(curves.shown))} if curves.shown else {}
    return rrb.TimeSeriesView(
        origin=curves.path,
        overrides=overrides,
        name=curves.title,
        axis_y=None if curves.bounds is None else rrb.ScalarAxis(range=curves.bounds),
        axis_x=rrb.TimeAxis(view_range=whole),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=1 < len(curves.names) <= _LEGEND_FITS),
    )


RERUN_VERSION = rr.__version__
_PATIENCE = 5.0  # seconds without a byte written, after which a flush is given up
_TURN_Z_TO_X = rr.Quaternion(xyzw=[0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)])


@contextlib.contextmanager
def strict() -> Iterator[None]:
    """Make Rerun raise where it would warn and drop data; the user's own setting comes back afterwards."""
    before = rr.strict_mode()
    rr.set_strict_mode(True)
    try:
        yield
    finally:
        rr.set_strict_mode(before)


def _as_utf8(path: Path) -> str:
    """The path as Rerun takes it; in an ASCII locale Python keeps other letters as halves of surrogate pairs."""
    try:
        return os.fsencode(path).decode()
    except UnicodeDecodeError as error:
        raise RecordingError(f"{path}: a recording's path must be UTF-8; name another one") from error


class RrdWriter:
    """One file being written; nothing of it is global.

    Parameters
    ----------
    path : path-like
        The file; made here, so that errors of place and permission come at once.
    title : str
        Shown as the recording's name.
    planar : bool
        Which way is up in the scene: y in planar ones, z otherwise.

    Attributes
    ----------
    path : Path
    """

    def __init__(self, path: Path, title: str, planar: bool):
        self.path = path
        self._stream = rr.RecordingStream(schema.APPLICATION_ID)
        self._index: list[rr.TimeColumn] = []
        with strict():
            self._stream.save(_as_utf8(path))
            self._stream.send_recording_name(title)
            up = rr.ViewCoordinates.RIGHT_HAND_Y_UP if planar else rr.ViewCoordinates.RIGHT_HAND_Z_UP
            self.static(schema.WORLD, up)

    def static(self, path: str, *archetypes) -> None:
        """Write what holds at all times; the last one counts."""
        self._stream.log(path, *archetypes, static=True, strict=True)

    def property(self, name: str, values: dict[str, str | list | np.ndarray | int | float]) -> None:
        """Write a recording property: a name and typed values; empty lists are left out."""
        arrays = {key: pa.array(np.atleast_1d(value)) for key, value in values.items()}
        filled = {key: array for key, array in arrays.items() if len(array)}
        with strict():
            self._stream.send_property(
                name, rr.DynamicArchetype(f"symgen.{name.capitalize()}", components=filled)
            )

    def times(self, t: np.ndarray, frames: np.ndarray | None = None) -> None:
        """Take these times [s], and numbers of frames, for all columns written from now on."""
        # A float duration would be cut off, not rounded.
        nanoseconds = np.rint(t * 1e9).astype("timedelta64[ns]")
        self._index = [rr.TimeColumn(schema.SIM_TIME, duration=nanoseconds)]
        if frames is not None:
            self._index.append(rr.TimeColumn(schema.FRAME, sequence=frames))

    def send(self, path: str, columns: list[rr.ComponentColumn]) -> None:
        """Write columns for the times taken last."""
        self._stream.send_columns(path, self._index, columns, strict=True)

    def columns(self, path: str, archetype: str, arrays: dict[str, np.ndarray | list[str]]) -> None:
        """Write float64 arrays of shape (n, width) bit for bit, or lists of n strings."""
        with strict():
            parts = []
            for name, array in arrays.items():
                # NumPy arrays are taken apart number by number, Arrow's are not.
                if isinstance(array, list):
                    parts += rr.DynamicArchetype.columns(archetype, components={name: pa.array(array)})
                elif array.shape[1]:
                    flat = pa.array(np.ascontiguousarray(array).ravel())
                    part = rr.DynamicArchetype.columns(archetype, components={name: flat})
                    parts += part.partition(np.full(len(array), array.shape[1], dtype=np.int32))
            self.send(path, parts)

    def curves(self, curves: Curves, first_colour: int = 0) -> None:
        """Name and colour the curves of a plot."""
        colours = [schema.colour(first_colour + i) for i in range(len(curves.names))]
        with strict():
            self.static(curves.path, rr.SeriesLines(names=list(curves.names), colors=colours, widths=1.5))

    def scalars(self, path: str, values: np.ndarray) -> None:
        """Write curves, shape (n, width)."""
        n, width = values.shape
        with strict():
            batch = rr.components.ScalarBatch(pa.array(np.ascontiguousarray(values).ravel()))
            offsets = np.arange(0, (n + 1) * width, width, dtype=np.int32)
            self.send(path, [rr.ComponentColumn(rr.Scalars.descriptor_scalars(), batch, offsets=offsets)])

    def body(self, name: str, primitive: Primitive, colour: tuple[int, int, int], lift: float = 0.0) -> None:
        """Draw a body's shape, fixed to its pose, `lift` [m] above it along body z."""
        where = f"{schema.BODIES}/{name}/geometry"
        with strict():
            self.static(where, _archetype(primitive, colour))
            origin = primitive.sizes if primitive.kind == "mesh" and primitive.sizes else (0.0, 0.0, 0.0)
            if lift or any(origin):
                self.static(where, rr.Transform3D(translation=[*origin[:2], origin[2] + lift]))

    def label(self, name: str, height: float) -> None:
        """Write a body's name at its middle, `height` [m] above it along body z."""
        point = rr.Points3D(
            [[0.0, 0.0, height]], labels=[name], radii=rr.Radius.ui_points(0.5), show_labels=True
        )
        with strict():
            frame = rr.CoordinateFrame(f"tf#/{schema.BODIES}/{name}")
            self.static(f"{schema.LABELS}/{name}", point, frame)

    def poses(self, name: str, positions: np.ndarray, turned: np.ndarray) -> None:
        """Write a body's poses: positions (n, 3), quaternions (n, 4) as x, y, z, w."""
        with strict():
            translation = rows(rr.components.Translation3DBatch, positions)
            rotation = rows(rr.components.RotationQuatBatch, turned)
            columns = [
                rr.ComponentColumn(rr.Transform3D.descriptor_translation(), translation),
                rr.ComponentColumn(rr.Transform3D.descriptor_quaternion(), rotation),
            ]
            self.send(f"{schema.BODIES}/{name}", columns)

    def trail_style(self, name: str, colour: tuple[int, int, int]) -> None:
        """Colour a trail; its lines are two pixels wide at any distance."""
        with strict():
            radii = [rr.Radius.ui_points(1.0)]
            self.static(
                f"{schema.TRAILS}/{name}", rr.LineStrips3D.from_fields(colors=[(*colour, 150)], radii=radii)
            )

    def trail(self, name: str, segments: np.ndarray) -> None:
        """Write one piece of a path per frame: segments (n, 2, 3). The view shows those of the last while."""
        kind = rr.components.LineStrip3DBatch
        form = _arrow_type(kind)
        points = pa.FixedSizeListArray.from_arrays(_flat32(segments), type=form.value_type)
        offsets = pa.array(np.arange(0, 2 * len(segments) + 1, 2, dtype=np.int32))
        with strict():
            strips = kind(pa.ListArray.from_arrays(offsets, points, type=form))
            self.send(
                f"{schema.TRAILS}/{name}", [rr.ComponentColumn(rr.LineStrips3D.descriptor_strips(), strips)]
            )

    def origin(self, length: float) -> None:
        """Mark the world's origin by a small cross."""
        arms = [
            [[-length, 0, 0], [length, 0, 0]],
            [[0, -length, 0], [0, length, 0]],
            [[0, 0, -length], [0, 0, length]],
        ]
        with strict():
            self.static(schema.ORIGIN, rr.LineStrips3D(arms, colors=GREY, radii=rr.Radius.ui_points(1.0)))

    def events(self, names: list[str]) -> None:
        """Write events into the event log."""
        with strict():
            self.send(schema.EVENTS, rr.TextLog.columns(text=names))

    def document(self, text: str) -> None:
        """Write the page about the run (Markdown)."""
        self.note(schema.ABOUT, text)

    def note(self, path: str, text: str) -> None:
        """Write a text (Markdown)."""
        with strict():
            self.static(path, rr.TextDocument(text, media_type="text/markdown"))

    def _eye(self, layout: Layout) -> None:
        """Write the eye as a camera: the view looks through it, until someone turns the view."""
        camera, path = layout.camera, _eye(layout.camera)
        half = _FOCUS * camera.opening  # pixels
        lens = rr.Pinhole(
            focal_length=_FOCUS,
            width=2.0 * half,
            height=2.0 * half,
            camera_xyz=rr.ViewCoordinates.RUB,
            image_plane_distance=_UNSEEN,
        )
        if camera.path is None:
            return self.static(path, lens, rr.Transform3D(translation=camera.eye, mat3x3=camera.axes.T))
        self.static(path, lens)
        self.times(layout.times, layout.every * np.arange(len(layout.times)))
        turned = np.tile(quaternions(camera.axes.T), (len(camera.path), 1))
        columns = [
            rr.ComponentColumn(
                rr.Transform3D.descriptor_translation(), rows(rr.components.Translation3DBatch, camera.path)
            ),
            rr.ComponentColumn(
                rr.Transform3D.descriptor_quaternion(), rows(rr.components.RotationQuatBatch, turned)
            ),
        ]
        self.send(path, columns)

    def layout(self, layout: Layout) -> None:
        """Say how the recording is shown when it is opened; the last one written counts."""
        with strict():
            if layout.camera is not None:
                self._eye(layout)
            # What `RecordingStream.send_blueprint` does, which never ends the stream that it makes: two threads that
            # wake all the time, for each blueprint, as long as the process lives.
            stream = rr.RecordingStream._from_native(
                rr.bindings.new_blueprint(
                    schema.APPLICATION_ID,
                    make_default=False,
                    make_thread_default=False,
                    default_enabled=True,
                )
            )
            stream.set_time("blueprint", sequence=0)
            blueprint(layout)._log_to_stream(stream)
            in_memory = stream.memory_recording()
            rr.bindings.send_blueprint(in_memory.storage, True, True, recording=self._stream.to_native())
            stream.disconnect()

    def flush(self) -> None:
        """Hand all that was written to the operating system: it survives the end of this process."""
        written = -1
        while True:
            try:
                return self._stream.flush(timeout_sec=_PATIENCE)
            except RuntimeError as error:
                # Rerun's writer may have died with the flush in its queue, which nobody answers then. A slow disk
                # is another matter: what was written meanwhile tells the two apart.
                before, written = written, self.path.stat().st_size
                if written == before or "timed out" not in str(error):
                    raise RecordingError(
                        f"{self.path}: cannot be written any more ({error}); is the disk full? "
                        "Make room, record elsewhere, or run without a recording"
                    ) from error

    def close(self) -> None:
        """Flush, write the index at the end of the file, and close it."""
        try:
            self.flush()
        finally:
            self._stream.disconnect()
            del self._stream
        # Rerun keeps the threads of a stream that nobody refers to, six a recording, until it is told to look.
        rr.bindings.flush_and_cleanup_orphaned_recordings()


@functools.cache
def _arrow_type(batch: type) -> pa.DataType:
    return batch([]).as_arrow_array().type


def _flat32(values: np.ndarray) -> pa.Array:
    return pa.array(np.ascontiguousarray(values, dtype=np.float32).ravel())


def rows(batch: type, values: np.ndarray):
    """Return rows of numbers as the batch of a component that has a fixed number of them."""
    return batch(pa.FixedSizeListArray.from_arrays(_flat32(values), type=_arrow_type(batch)))


def _archetype(primitive: Primitive, colour: tuple[int, int, int]):
    kind, sizes, solid = primitive.kind, primitive.sizes, rr.components.FillMode.Solid
    turn = [_TURN_Z_TO_X] if primitive.along_x else None
    if kind == "box":
        return rr.Boxes3D(sizes=[sizes], colors=[colour], fill_mode=solid)
    if kind == "sphere":
        return rr.Ellipsoids3D(radii=[sizes[0]], colors=[colour], fill_mode=solid)
    if kind == "cylinder":
        return rr.Cylinders3D(
            radii=[sizes[0]], lengths=[sizes[1]], quaternions=turn, colors=[colour], fill_mode=solid
        )
    if kind == "bars":
        return _bars(primitive, colour)
    if kind == "capsule":
        # Rerun's capsule begins at the origin.
        start = [-sizes[1] / 2, 0, 0] if primitive.along_x else [0, 0, -sizes[1] / 2]
        return rr.Capsules3D(
            radii=[sizes[0]],
            lengths=[sizes[1]],
            translations=[start],
            quaternions=turn,
            colors=[colour],
            fill_mode=solid,
        )
    if kind == NOTHING:
        return rr.Points3D(np.zeros((0, 3)))
    if kind == "solids":
        return _triangles(primitive, colour)
    return rr.Asset3D(path=primitive.mesh, albedo_factor=None if primitive.painted else colour)


def _bars(primitive: Primitive, colour: tuple[int, int, int]) -> rr.Capsules3D:
    along = primitive.ends[:, 1] - primitive.ends[:, 0]
    return rr.Capsules3D(
        radii=np.full(len(along), primitive.sizes[0]),
        lengths=np.linalg.norm(along, axis=1),
        translations=primitive.ends[:, 0],
        quaternions=quaternions(frames_along(along)),
        colors=[colour],
        fill_mode=rr.components.FillMode.Solid,
    )


def _triangles(primitive: Primitive, colour: tuple[int, int, int]) -> rr.Mesh3D:
    """All solids as one mesh; each triangle has corners of its own, so that edges stay sharp."""
    corners = np.concatenate([s.vertices[s.triangles] for s in primitive.surfaces])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corners = corners[np.linalg.norm(normals, axis=1) > 0.0]
    normals = normals[np.linalg.norm(normals, axis=1) > 0.0]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return rr.Mesh3D(
        vertex_positions=corners.reshape(-1, 3),
        vertex_normals=np.repeat(normals, 3, axis=0),
        triangle_indices=np.arange(3 * len(corners)).reshape(-1, 3),
        albedo_factor=colour,
    )


_ARROW_WIDTH = 2.5  # points on the screen
Colour = tuple[int, int, int]


class MarkWriter:
    """Draws into a file that is being written.

    Parameters
    ----------
    file : RrdWriter
    """

    def __init__(self, file: RrdWriter):
        self._file = file

    def _fixed(self, path: str, body: str, *archetypes) -> None:
        """Draw something that is fixed to a body, whatever folder it lies in; to the world without one."""
        frame = [rr.CoordinateFrame(f"tf#/{schema.BODIES}/{body}")] if body else []
        with strict():
            self._file.static(path, *archetypes, *frame)

    def lines(
        self, path: str, lines: list[np.ndarray], colour: Colour, width: float = 1.4, body: str = ""
    ) -> None:
        """Draw lines, `width` points wide on the screen."""
        self._fixed(path, body, rr.LineStrips3D(lines, colors=colour, radii=rr.Radius.ui_points(width / 2)))

    def rod(
        self, path: str, a: np.ndarray, b: np.ndarray, radius: float, colour: Colour, body: str = ""
    ) -> None:
        """Draw a cylinder between two places [m]."""
        cylinder = rr.Cylinders3D(
            radii=[radius],
            lengths=[float(np.linalg.norm(b - a))],
            centers=[(a + b) / 2],
            quaternions=quaternions(frames_along((b - a)[None])),
            colors=[colour],
            fill_mode=rr.components.FillMode.Solid,
        )
        self._fixed(path, body, cylinder)

    def ball(self, path: str, place: np.ndarray, radius: float, colour: Colour, body: str = "") -> None:
        """Draw a sphere [m]."""
        solid = rr.components.FillMode.Solid
        self._fixed(
            path, body, rr.Ellipsoids3D(centers=[place], radii=[radius], colors=[colour], fill_mode=solid)
        )

    def place(self, path: str, position: np.ndarray, quaternion: np.ndarray, scale: np.ndarray) -> None:
        """Put what stands still in its place."""
        with strict():
            turn = rr.Quaternion(xyzw=quaternion)
            self._file.static(path, rr.Transform3D(translation=position, quaternion=turn, scale=scale))

    def moves(
        self,
        path: str,
        positions: np.ndarray,
        turned: np.ndarray | None = None,
        scales: np.ndarray | None = None,
    ) -> None:
        """Write how something moves: positions (n, 3) [m], quaternions (n, 4) as x, y, z, w, scales (n, 3)."""
        kinds = rr.Transform3D
        parts = [(kinds.descriptor_translation(), rr.components.Translation3DBatch, positions)]
        if turned is not None:
            parts.append((kinds.descriptor_quaternion(), rr.components.RotationQuatBatch, turned))
        if scales is not None:
            parts.append((kinds.descriptor_scale(), rr.components.Scale3DBatch, scales))
        with strict():
            self._file.send(
                path, [rr.ComponentColumn(what, rows(batch, values)) for what, batch, values in parts]
            )

    def arrow_style(self, path: str, colour: Colour) -> None:
        """Colour an arrow; it is equally wide at any distance."""
        with strict():
            style = rr.Arrows3D.from_fields(colors=[colour], radii=[rr.Radius.ui_points(_ARROW_WIDTH)])
            self._file.static(f"{path}/arrow", style)

    def arrows(self, path: str, places: np.ndarray, vectors: np.ndarray) -> None:
        """Write one arrow per frame: places (n, 3) [m], vectors (n, 3) in their own unit; see `scale`."""
        self.moves(path, places)
        with strict():
            batch = rows(rr.components.Vector3DBatch, vectors)
            self._file.send(f"{path}/arrow", [rr.ComponentColumn(rr.Arrows3D.descriptor_vectors(), batch)])

    def scale(self, path: str, factor: float) -> None:
        """Say how long a unit of an arrow's vector is drawn [m]; the last one counts, for all frames."""
        with strict():
            self._file.static(f"{path}/arrow", rr.Transform3D(scale=factor))
