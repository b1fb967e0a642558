"""Members of an ensemble in one recording: their bodies over each other, each member in a colour of its own."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.recording import geometry, layout, schema
from symgen.runtime.recording.recorder import writable
from symgen.runtime.recording.recording import Quantities
from symgen.runtime.recording.rrd.write import RrdWriter
from symgen.runtime.recording.run_writer import Scene

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_MARKS = "marks"  # of joints, springs and forces: too many to be seen
_MOST_CURVES = 60
_MOST_PLOTS = 4


def record_members(
    runs: Mapping[int, Solution], path: str | os.PathLike[str], title: str, mesh_folder: Path | None = None
) -> None:
    """Write a recording of runs of one model over the same times.

    Parameters
    ----------
    runs : mapping of int to Solution
        By the number of the member; all have the same frames.
    path : path-like
    title : str

    Raises
    ------
    RecordingError
        The file cannot be written.
    """
    header = next(iter(runs.values())).system.source.header
    scenes = {
        k: Scene(_of_member(header, k, place), Quantities(run.system, run.p), mesh_folder)
        for place, (k, run) in enumerate(runs.items())
    }
    for k, run in runs.items():
        scenes[k].prepare(run.t, run.states)
    first = next(iter(scenes.values()))
    longest = max(runs.values(), key=lambda run: run.t[-1])
    rows = _plots(header, list(runs))
    writer = RrdWriter(writable(Path(path)), title, first.planar)
    try:
        for curves in (curves for row in rows for curves in row.plots):
            writer.curves(curves)
        for k, run in runs.items():
            scenes[k].open(writer)
            writer.times(run.t, np.arange(len(run.t)))
            scenes[k].frames(writer, run.t, run.states, np.zeros((len(run.t), 0)))
        _write_curves(writer, rows, runs)
        boxes = [scene.box() for scene in scenes.values() if header["bodies"]]
        writer.layout(_layout(first, boxes, longest, rows))
        writer.document(_page(title, runs))
        writer.property(schema.MEMBERS, {"numbers": np.array(list(runs)), "times": longest.t})
    finally:
        writer.close()


def _of_member(header: dict, number: int, place: int) -> dict:
    """Return the header of a model whose bodies have the names and the colour of a member."""
    colour = "#" + "".join(f"{x:02x}" for x in schema.colour(place))
    bodies = [{**body, "name": f"{body['name']}_{number}", "color": colour} for body in header["bodies"]]
    return {**{key: value for key, value in header.items() if key != _MARKS}, "bodies": bodies}


def _plots(header: dict, numbers: list[int]) -> tuple[layout.Row, ...]:
    """A plot for each of the first coordinates, with a curve for each member."""
    names = tuple(f"member {k}" for k in numbers[:_MOST_CURVES])
    columns = tuple(range(len(names)))
    plots = [
        layout.Curves(record["name"], f"plots/members/{record['name']}", record["name"], columns, names)
        for record in header["coordinates"][:_MOST_PLOTS]
    ]
    return tuple(layout.Row((curves,), 1.0) for curves in plots)


def _write_curves(writer: RrdWriter, rows: tuple[layout.Row, ...], runs: Mapping[int, Solution]) -> None:
    times = max((run.t for run in runs.values()), key=len)
    shown = list(runs.values())[:_MOST_CURVES]
    for curves in (curves for row in rows for curves in row.plots):
        values = np.full((len(times), len(shown)), np.nan)
        for k, run in enumerate(shown):
            values[: len(run.t), k] = run[curves.source]
        writer.times(times, np.arange(len(times)))
        writer.scalars(curves.path, values)


def _layout(
    scene: Scene, boxes: list[tuple[np.ndarray, np.ndarray]], run: Solution, rows: tuple[layout.Row, ...]
) -> layout.Layout:
    camera, grid = None, 0.125
    if boxes:
        low = np.min([box[0] for box in boxes], axis=0)
        high = np.max([box[1] for box in boxes], axis=0)
        camera = layout.choose_camera(low, high, scene.planar)
        grid = layout.round_down(geometry.diagonal_of(low, high) / 8)
    seconds = float(run.t[-1] - run.t[0])
    return layout.Layout(
        planar=scene.planar, camera=camera, times=run.t, grid=grid, trails=(), folders=((schema.LABELS, False),),
        trail_seconds=0.0, rows=rows, speed=layout.choose_speed(seconds),
        seconds=(float(run.t[0]), float(run.t[0]) + max(seconds, 1e-9)),
    )  # fmt: skip


def _page(title: str, runs: Mapping[int, Solution]) -> str:
    lines = [f"# {title}", "", "| member | | |", "| --- | --- | --- |"]
    lines += [f"| {k} | {run.status} | {run.message} |" for k, run in runs.items()]
    return "\n".join(lines)
