"""Read entities of a recording, with Rerun's own reader."""

from __future__ import annotations

import warnings
from pathlib import Path

import pyarrow as pa
from rerun.chunk import RrdReader

from ..errors import RecordingError


def read_rrd(path: Path, entities: list[str]) -> tuple[str, dict[str, list[pa.RecordBatch]]]:
    """Read some entities of a recording.

    Parameters
    ----------
    path : Path
    entities : list of str
        Entity paths; recording properties are read always, as `property:<name>`.

    Returns
    -------
    application_id : str
    batches : dict
        For each entity that the file has, its record batches in the order of the file.

    Raises
    ------
    RecordingError
        If the file is missing, is no recording, or ends in the middle of a record.
    """
    if path.is_dir():
        raise RecordingError(f"{path}: this is a folder, not a recording")
    if not path.is_file():
        raise RecordingError(f"{path}: there is no such file")
    batches: dict[str, list[pa.RecordBatch]] = {}
    with warnings.catch_warnings():
        # A recording of a run that was cut short has no index at its end; that is not worth a warning.
        warnings.simplefilter("ignore")
        try:
            reader = RrdReader(path)
            stores = reader.recordings()
            if not stores:
                raise RecordingError(f"{path}: holds no recording, only a layout of the viewer")
            wanted = [f"/{entity}" for entity in entities] + ["/__properties/**"]
            for chunk in reader.stream(store=stores[0]).filter(content=wanted):
                name = chunk.entity_path.lstrip("/").replace("__properties/", "property:")
                batches.setdefault(name, []).append(chunk.to_record_batch())
        except (RuntimeError, ValueError, OSError) as error:
            raise _refusal(path, str(error)) from error
    return stores[0].application_id, batches


def _refusal(path: Path, reason: str) -> RecordingError:
    if "Not an RRD" in reason or "too small to be" in reason:
        return RecordingError(f"{path}: not a Rerun recording (.rrd)")
    fixed = path.with_name(f"{path.stem}_recovered{path.suffix}")
    return RecordingError(
        f"{path}: damaged, or cut off in the middle of a record; "
        f"recover all whole records with `rerun rrd optimize {path} -o {fixed}` and read that file "
        f"(reader's words: {reason})"
    )
