"""Read a recording back: exact states, parameters, texts, and how the run ended."""

from __future__ import annotations

import contextlib
import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.checkpoint_bytes import Checkpoint
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.recording import schema
from symgen.runtime.recording.recording import RecordedEvent, Recording
from symgen.runtime.recording.schema import RecordingError

if TYPE_CHECKING:
    import pyarrow as pa

    from symgen.runtime.system import System

read = Late("symgen.runtime.recording.rrd.read")
event_actions = Late("symgen.runtime.event_actions")


_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,199}", re.ASCII)
_LONGEST_WORD = 100
_ASKED = ("method", "constraints", "rtol", "atol", "step", "energy_scaling", "split", "max_step", "breaks")


@contextlib.contextmanager
def blamed_on(path: str | Path) -> Iterator[None]:
    """Tell what goes wrong with the content of a recording as its fault, by its file.

    Raises
    ------
    RecordingError
    """
    try:
        yield
    except RuntimeModelError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
        what = " ".join(str(error).split())[:300]
        raise RecordingError(
            f"{path}: its parts contradict each other ({type(error).__name__}: {what}); run the model again"
        ) from error


def check_settings(recording: Recording) -> None:
    """Refuse names that are none, and settings that no run has.

    Raises
    ------
    RecordingError
    """
    for what, value, (fits, expected) in (
        ("its model's name", recording.name, (_is_name, "a name: letters, digits and underscores")),
        ("its title", recording.title, _TEXT),
        ("its module", recording.module_text, _TEXT),
        ("its model's text", recording.model_text, _TEXT),
        ("its method", recording.method, (_is_word, "the name of a method")),
        ("its form of constraints", recording.constraints, (_is_word, "the name of a form")),
        ("its status", recording.status, _TEXT),
        ("its content", recording.content, _CONTENT),
        ("rtol", recording.rtol, _TOLERANCE),
        ("atol", recording.atol, _TOLERANCE),
        ("its options", recording.options, _TABLE),
        ("its statistics", recording.stats, _TABLE),
        ("its inputs over time", recording.inputs_over_time, _TABLE),
        ("its health", recording.health, (_is_list(lambda x: type(x) is dict), "a list of checks")),
    ):
        if not fits(value):
            raise RecordingError(
                f"{recording.path}: {what} is {value!r:.60}, not {expected}; run the model again"
            )
    for key, value in recording.options.items():
        fits, expected = _OPTIONS.get(key, (None, ""))
        if fits is not None and not (value is None or fits(value)):
            raise RecordingError(f"{recording.path}: its option {key!r} is {value!r:.60}, not {expected}")


def check_fits(recording: Recording, system: System) -> None:
    """Refuse a recording whose states or parameters are not those of the model in it.

    Raises
    ------
    RecordingError
    """
    for what, columns, width in (
        ("coordinates", recording.q, system.nq),
        ("rates", recording.v, system.nv),
        ("work", recording.w, system.nw),
        ("settings", recording.settings, system.n_settings_of_switches),
    ):
        if columns.shape[1] != width:
            raise RecordingError(
                f"{recording.path}: its states have {columns.shape[1]} columns of {what}, its model {width}"
            )
    for what, values, records in (
        ("parameters", recording.parameters, system.parameters),
        ("inputs", recording.inputs, system.inputs),
    ):
        if list(values) != [record["name"] for record in records]:
            raise RecordingError(f"{recording.path}: its {what} are not those of its model")


def _is_name(x: Any) -> bool:
    return type(x) is str and _NAME.fullmatch(x) is not None


def _is_word(x: Any) -> bool:
    return (
        type(x) is str
        and len(x) <= _LONGEST_WORD
        and x.replace(" ", "").replace("_", "").isalnum()
        and x.isascii()
    )


def _is_number(x: Any) -> bool:
    return type(x) in (int, float) and math.isfinite(x)


def _is_list(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda x: type(x) is list and all(map(fits, x))


_TEXT = (lambda x: type(x) is str, "text")
_CONTENT = (lambda x: x in schema.CONTENTS, " or ".join(schema.CONTENTS))
_TABLE = (lambda x: type(x) is dict and all(type(key) is str for key in x), "a table")
_TOLERANCE = (lambda x: _is_number(x) and x >= 0.0, "a number that is not negative")
_TIME = (_is_number, "a time")
_OPTIONS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "t_start": _TIME,
    "t_end": _TIME,
    "step": (lambda x: _is_number(x) and x > 0.0, "a number above zero"),
    "fps": (lambda x: _is_number(x) and x > 0.0, "a number above zero"),
    "at": (_is_list(_is_number), "a list of times"),
    "notes": (_is_list(_TEXT[0]), "a list of texts"),
    "redundant": (lambda x: type(x) is bool or _is_list(_TEXT[0])(x), "a list of names"),
    "asked": (lambda x: _TABLE[0](x) and set(x) <= set(_ASKED), f"a table of {', '.join(_ASKED)}"),
}


def read_recording(path: str | Path) -> Recording:
    """Read a recording that `symgen run` wrote, also one of a run that was cut short.

    Raises
    ------
    RecordingError
        If the file is missing, damaged, not a recording, or not one of symgen.
    """
    path = Path(path)
    try:
        recording = _recording(path, *read.read_rrd(path, [schema.STATE, schema.EVENTS, schema.ENERGY]))
        check_settings(recording)
        return recording
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise RecordingError(f"{path}: damaged: {error!r}; run the model again") from error


def _recording(
    path: Path, application: str, batches: dict[str, list[pa.RecordBatch]], lost: int
) -> Recording:
    if lost and not application:
        raise RecordingError(f"{path}: cut off before its first states were written; run the model again")
    if application != schema.APPLICATION_ID:
        raise RecordingError(f"{path}: a Rerun recording of {application!r}, not one of symgen")
    properties = {
        name: _property(batches, name) for name in (schema.MODEL, schema.RUN, schema.VERSIONS, schema.RESULT)
    }
    model, run, result = properties[schema.MODEL], properties[schema.RUN], properties[schema.RESULT]
    if _property_values(batches, schema.MEMBERS):
        raise RecordingError(
            f"{path}: a recording of members of an ensemble, which is to be looked at (symgen play); record one of "
            "them by itself: member(k).save(…)"
        )
    missing = [key for key in ("name", "module_text", "model_text") if key not in model]
    if schema.STATE not in batches and not result:
        raise RecordingError(f"{path}: cut off before its first states were written; run the model again")
    if missing or "format" not in run:
        raise RecordingError(
            f"{path}: a recording of symgen without {', '.join(missing) or 'settings'}; run the model again"
        )
    if run["format"] != schema.FORMAT:
        raise RecordingError(
            f"{path}: has format {run['format']}, this program reads format {schema.FORMAT}; "
            "use the version that wrote it"
        )
    if schema.STATE not in batches:
        raise RecordingError(f"{path}: holds no states; run the model again")
    try:
        columns = (_chunks if run.get("content") == schema.STATES else _states)(batches[schema.STATE])
        energy = _energies(batches)
    except ValueError as error:
        raise RecordingError(f"{path}: {error}; run the model again") from error
    return Recording(
        path=path,
        name=model["name"],
        title=run["title"],
        complete=bool(result),
        status=result.get("status", "incomplete"),
        module_text=model["module_text"],
        model_text=model["model_text"],
        method=run["method"],
        constraints=run["constraints"],
        rtol=run["rtol"],
        atol=run["atol"],
        options=json.loads(run["options"]),
        stats=json.loads(result.get("stats", "{}")),
        health=json.loads(result.get("health", "[]")),
        versions=properties[schema.VERSIONS],
        parameters=_named_values(batches, schema.PARAMETERS),
        inputs=_named_values(batches, schema.INPUTS),
        inputs_over_time=json.loads(_property(batches, schema.INPUTS_OVER_TIME).get("pieces", "{}")),
        content=run.get("content", schema.ALL),
        t=columns["t"][:, 0],
        q=columns["q"],
        v=columns["v"],
        w=columns["w"],
        multipliers=columns["lambda"],
        settings=columns["settings"],
        energy=energy,
        events=_events(batches, columns["q"].shape[1], columns["v"].shape[1]),
        sha256=result.get("sha256", ""),
        n_frames_written=result.get("n_frames", -1),
        file_bytes=result.get("file_bytes", 0),
        file_sha256=result.get("file_sha256", ""),
        lost=lost,
    )


def read_checkpoint(path: str | Path) -> tuple[Checkpoint | None, np.ndarray]:
    """Return the last checkpoint of a recording, None where there is none, and the step log that was plotted.

    Returns
    -------
    checkpoint : Checkpoint or None
    step_log : ndarray, shape (n, 2)
        Times and lengths of steps [s], as far as they were shown.

    Raises
    ------
    RecordingError, symgen.runtime.checkpoint.CheckpointError
        The file, or its last checkpoint, is damaged.
    """
    _, batches, _ = read.read_rrd(Path(path), [schema.CHECKPOINT, schema.STEP_SIZE])
    last, content = 0.0, b""
    for batch in batches.get(schema.CHECKPOINT, []):
        numbers, contents = (
            batch.column(f"{schema.CHECKPOINT_ARCHETYPE}:{name}") for name in ("number", "content")
        )
        for row in range(batch.num_rows):
            if numbers[row].is_valid and numbers[row].as_py()[0] > last:
                last = numbers[row].as_py()[0]
                content = contents[row].values.to_numpy(zero_copy_only=False).tobytes()
    return Checkpoint.from_bytes(content) if content else None, _step_log(batches)


def _step_log(batches: dict[str, list[pa.RecordBatch]]) -> np.ndarray:
    rows = [np.zeros((0, 2))]
    for batch in batches.get(schema.STEP_SIZE, []):
        if "Scalars:scalars" in batch.schema.names:
            t = batch.column(schema.SIM_TIME).to_numpy().astype(np.int64) * 1e-9
            rows.append(np.column_stack([t, _matrix(batch, "Scalars:scalars")]))
    return np.concatenate(rows)


def read_times(path: str | Path) -> np.ndarray:
    """Return the times [s] of the frames of a recording that can be looked at: of a run, or of members of an ensemble.

    Raises
    ------
    RecordingError
        It can not be read.
    """
    path = Path(path)
    application, batches, _ = read.read_rrd(path, [])
    values = _property_values(batches, schema.MEMBERS).get("times")
    if application != schema.APPLICATION_ID or not values:
        return read_recording(path).t
    times = np.array(values, dtype=float)
    if times.ndim != 1 or not np.isfinite(times).all():
        raise RecordingError(f"{path}: damaged: its times make no sense; record the members again")
    return times


def read_content(path: str | Path) -> str:
    """Return what a recording holds: all that is shown, or states alone.

    Raises
    ------
    RecordingError
        It can not be read.
    """
    _, batches, _ = read.read_rrd(Path(path), [])
    return _property(batches, schema.RUN).get("content", schema.ALL)


def _property_values(batches: dict[str, list[pa.RecordBatch]], name: str) -> dict[str, list]:
    """Return the last values of each component of a property, under names without the archetype's."""
    values: dict[str, list] = {}
    for batch in batches.get(f"property:{name}", []):
        for column, array in zip(batch.schema.names, batch.columns):
            if ":" in column and len(array) and array[-1].is_valid:
                values[column.rsplit(":", 1)[1]] = array[-1].as_py()
    return values


def _property(batches: dict[str, list[pa.RecordBatch]], name: str) -> dict[str, Any]:
    return {key: value[0] for key, value in _property_values(batches, name).items()}


def _named_values(batches: dict[str, list[pa.RecordBatch]], name: str) -> dict[str, float]:
    values = _property_values(batches, name)
    return dict(zip(values.get("names", []), values.get("values", [])))


def _series(batches: list[pa.RecordBatch], archetype: str, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Put a series' columns together, in the order of the frames: arrays of shape (n, width), read-only."""
    batches = [
        batch for batch in batches if any(f"{archetype}:{name}" in batch.schema.names for name in names)
    ]
    frames = np.concatenate([batch.column(schema.FRAME).to_numpy() for batch in batches])
    order = np.argsort(frames, kind="stable")
    if not np.array_equal(frames[order], np.arange(len(frames))):
        raise ValueError(
            f"frames are missing or double: {len(frames)} of them, numbered {frames.min()} to {frames.max()}"
        )
    columns = {}
    for name in names:
        parts = [_matrix(batch, f"{archetype}:{name}") for batch in batches]
        column = np.concatenate(parts)[order]
        column.flags.writeable = False
        columns[name] = column
    return columns


def _states(batches: list[pa.RecordBatch]) -> dict[str, np.ndarray]:
    return _series(batches, schema.STATE_ARCHETYPE, schema.STATE_COLUMNS)


def _chunks(batches: list[pa.RecordBatch]) -> dict[str, np.ndarray]:
    """Put the columns of states alone together, as `_states` does; a row holds all frames of a chunk, one by one."""
    prefix = f"{schema.CHUNK_ARCHETYPE}:"
    rows = sorted(
        (
            (first, batch, k)
            for batch in batches
            if f"{prefix}t" in batch.schema.names
            for k, first in enumerate(batch.column(schema.FRAME).to_pylist())
        ),
        key=lambda row: row[0],
    )
    if not rows:
        raise ValueError("it holds no states")
    parts: dict[str, list[np.ndarray]] = {name: [] for name in schema.STATE_COLUMNS}
    n_frames = 0
    for first, batch, k in rows:
        n = len(_row(batch, f"{prefix}t", k))
        if first != n_frames or not n:
            raise ValueError(f"frames are missing or double: {n_frames} before the one numbered {first}")
        n_frames += n
        for name, found in parts.items():
            flat = _row(batch, prefix + name, k)
            if len(flat) % n:
                raise ValueError(f"the column {name!r} has gaps")
            found.append(flat.reshape(n, -1))
    columns = {name: np.concatenate(found) for name, found in parts.items()}
    for column in columns.values():
        column.flags.writeable = False
    return columns


def _row(batch: pa.RecordBatch, column: str, k: int) -> np.ndarray:
    """The numbers in one row of a column of lists; none of a column that is not there."""
    if column not in batch.schema.names:
        return np.zeros(0)
    values = batch.column(column)[k].values
    if values is None or values.null_count:
        raise ValueError(f"the column {column!r} has gaps")
    return values.to_numpy(zero_copy_only=False).astype(float, copy=False)


def _matrix(batch: pa.RecordBatch, column: str) -> np.ndarray:
    if column not in batch.schema.names:
        return np.zeros((batch.num_rows, 0))
    array = batch.column(column)
    flat = array.flatten().to_numpy(zero_copy_only=False)
    if array.null_count or len(flat) % batch.num_rows:
        raise ValueError(f"the column {column!r} has gaps")
    return flat.reshape(batch.num_rows, -1)


def _energies(batches: dict[str, list[pa.RecordBatch]]) -> np.ndarray:
    """Return the energies, shape (n, 3); they come after the states of their chunk, and may be missing at the end."""
    written = [batch for batch in batches.get(schema.ENERGY, []) if "Scalars:scalars" in batch.schema.names]
    return _series(written, "Scalars", ("scalars",))["scalars"] if written else np.zeros((0, 3))


def _events(batches: dict[str, list[pa.RecordBatch]], nq: int, nv: int) -> tuple[RecordedEvent, ...]:
    events = []
    for batch in batches.get(schema.EVENTS, []):
        prefix = f"{schema.EVENT_ARCHETYPE}:"
        if f"{prefix}t" not in batch.schema.names:
            continue
        frames = batch.column(schema.FRAME).to_pylist()
        keys = ("name", "t", "energy_change", "action", "around")
        none = [None] * len(frames)
        parts = [
            batch.column(prefix + key).to_pylist() if prefix + key in batch.schema.names else none
            for key in keys
        ]
        for frame, name, t, change, action, numbers in zip(frames, *parts):
            if t is not None:
                whole = None
                if action and numbers and len(numbers) == 1 + 2 * (nq + nv):
                    states = np.split(np.array(numbers[1:]), [nq, nq + nv, 2 * nq + nv])
                    whole = event_actions.EventRecord(
                        name[0], action[0], t[0], *states, change[0], numbers[0]
                    )
                events.append(RecordedEvent(name[0], t[0], frame, change[0], whole))
    return tuple(sorted(events, key=lambda event: (event.frame, event.t)))
