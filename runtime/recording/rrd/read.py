"""Read entities of a recording.

The records of an .rrd file, read without Rerun: its own reader ends the process on some damaged files.

A file is a header of 12 bytes and then records: kind and length as little-endian 64-bit integers, and a message of
Protocol Buffers. Messages of kind 2 (`ArrowMsg` in Rerun's re_protos) hold one chunk as a stream of Arrow IPC, which
may be packed by LZ4. The last record, of kind 0, is an index, which readers can do without. A file that was cut off
has whole records up to there.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa

from symgen.runtime.recording.schema import RecordingError

_MAGIC = b"RRF2"
_HEADER = 12
_RECORD = struct.Struct("<QQ")
_END, _STORE, _ARROW, _LAST_KIND = 0, 1, 2, 3
_STORE_ID, _COMPRESSION, _PLAIN_SIZE, _PAYLOAD = 1, 2, 3, 5  # fields of ArrowMsg
_KIND, _NAME, _APPLICATION = 1, 2, 3  # fields of StoreId
_IS_RECORDING = 1
_LZ4 = 2
_LARGEST_GAIN = 255  # of LZ4


class DamagedFileError(Exception):
    """The bytes are not those of an .rrd file; the text says what is wrong."""


@dataclass(frozen=True)
class Store:
    """What a chunk belongs to: a recording, or a layout of the viewer."""

    is_recording: bool
    name: str
    application: str


def chunks(path: Path, lost: list[int]) -> Iterator[tuple[Store, pa.RecordBatchReader]]:
    """Yield all chunks of a file, and the store that each belongs to.

    Parameters
    ----------
    path : Path
    lost : list of int
        Gets one entry: how many bytes at the end were left out, since they are no whole record.

    Raises
    ------
    DamagedFileError
    """
    size = path.stat().st_size
    if size < _HEADER:
        raise DamagedFileError("it is too short to be an .rrd file")
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        if content[: len(_MAGIC)] != _MAGIC:
            raise DamagedFileError("it does not begin as an .rrd file")
        place = _HEADER
        while place + _RECORD.size <= size:
            kind, length = _RECORD.unpack_from(content, place)
            end = place + _RECORD.size + length
            if kind > _LAST_KIND:
                raise DamagedFileError(f"at byte {place} there is no record")
            if kind == _END or end > size:
                break
            if kind == _ARROW:
                yield _chunk(content[place + _RECORD.size : end], place)
            place = end
        whole = kind == _END and end <= size if place + _RECORD.size <= size else place == size
        lost.append(0 if whole else size - place)


def _chunk(message: bytes, place: int) -> tuple[Store, pa.RecordBatchReader]:
    try:
        fields = dict(_fields(message))
        store = dict(_fields(fields[_STORE_ID]))
        application = dict(_fields(store[_APPLICATION]))[1].decode()
        payload = pa.py_buffer(fields[_PAYLOAD])
        if fields.get(_COMPRESSION) == _LZ4:
            plain = fields[_PLAIN_SIZE]
            if plain > _LARGEST_GAIN * (len(fields[_PAYLOAD]) + 1):
                raise DamagedFileError(f"the record at byte {place} gives a wrong size")
            payload = pa.Codec("lz4_raw").decompress(payload, plain)
        reader = pa.ipc.open_stream(payload)
        return Store(store[_KIND] == _IS_RECORDING, store[_NAME].decode(), application), reader
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OSError, pa.ArrowException) as error:
        raise DamagedFileError(f"the record at byte {place} cannot be read: {error}") from error


def _fields(message: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Yield numbers and values of the fields of a message: integers, or bytes."""
    place = 0
    while place < len(message):
        tag, place = _varint(message, place)
        number, form = tag >> 3, tag & 7
        if form == 0:
            value, place = _varint(message, place)
        else:
            if form == 2:
                length, place = _varint(message, place)
            elif form in (1, 5):
                length = 8 if form == 1 else 4
            else:
                raise ValueError(f"a field has the unknown form {form}")
            value, place = message[place : place + length], place + length
        yield number, value


def _varint(message: bytes, place: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = message[place]
        value |= (byte & 0x7F) << shift
        place, shift = place + 1, shift + 7
        if byte < 0x80:
            return value, place


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
