"""Read entities of a recording."""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa

from ..errors import RecordingError
from .records import DamagedFileError, chunks

_PROPERTIES = "__properties/"


def read_rrd(path: Path, entities: list[str]) -> tuple[str, dict[str, list[pa.RecordBatch]], int]:
    """Read some entities of a recording; of one that ends in the middle of a record, all whole ones before that.

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
    lost : int
        How many bytes at the end of the file were left out, since they are no whole record.

    Raises
    ------
    RecordingError
        If the file is missing, is no recording, or is damaged.
    """
    if path.is_dir():
        raise RecordingError(f"{path}: this is a folder, not a recording")
    if not path.is_file():
        raise RecordingError(f"{path}: there is no such file")
    batches: dict[str, list[pa.RecordBatch]] = {}
    application, lost, found = "", [], False
    try:
        for store, reader in chunks(path, lost):
            if not store.is_recording:
                continue
            application, found = application or store.application, True
            name = _entity(reader.schema)
            if name in entities or name.startswith("property:"):
                batches.setdefault(name, []).extend(_batches(reader))
    except (DamagedFileError, ValueError, OSError, MemoryError, pa.ArrowException) as error:
        if "begin as" in str(error) or "too short" in str(error):
            raise RecordingError(f"{path}: not a Rerun recording (.rrd)") from error
        raise RecordingError(f"{path}: damaged: {error}; run the model again") from error
    if not found and not lost[0]:
        raise RecordingError(f"{path}: holds no recording, only a layout of the viewer")
    return application, batches, lost[0]


def _entity(schema: pa.Schema) -> str:
    path = (schema.metadata or {}).get(b"rerun:entity_path", b"").decode().lstrip("/")
    return f"property:{path.removeprefix(_PROPERTIES)}" if path.startswith(_PROPERTIES) else path


def _batches(reader: pa.RecordBatchReader) -> list[pa.RecordBatch]:
    batches = list(reader)
    for batch in batches:
        # Lengths that point outside would be read as they are.
        batch.validate(full=True)
    return batches
