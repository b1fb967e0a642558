"""A checkpoint, its arrays and facts, as bytes, and back: what is read may come from anybody."""

from __future__ import annotations

import functools
import hashlib
import hmac
import io
import json
import math
import os
import zipfile
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from symgen.runtime.code.cache import cache_folder, fetch, store
from symgen.runtime.errors import RuntimeModelError

# A checksum finds damage, but whoever changes bytes can compute it anew. The seal needs a key, which lies in the cache
# folder. Where that is lost, or a file comes from another machine, it is read as any stranger's.

SEAL_SIZE = 32  # bytes


def seal(content: bytes) -> bytes:
    """Return the seal of `content`."""
    return hmac.digest(_key(), content, "sha256")


def is_own(content: bytes, given: bytes) -> bool:
    """Whether `given` is the seal of `content`."""
    return hmac.compare_digest(seal(content), given)


@functools.lru_cache(maxsize=1)
def _key() -> bytes:
    path = cache_folder("keys") / "recordings"
    key = fetch(path)
    if key is None or len(key) != SEAL_SIZE:
        key = os.urandom(SEAL_SIZE)
        store(path, key)
    return key


FORMAT = 4
_DIGEST = hashlib.sha256().digest_size
_LARGEST_OWN = 1 << 32  # bytes of a checkpoint, unpacked
_LARGEST = 1 << 28  # of one from somebody else
_KINDS = ("<f8", "<i8", "|u1", "|b1")


class CheckpointError(RuntimeModelError):
    """A checkpoint is damaged, or of another program."""


@dataclass(frozen=True)
class Checkpoint:
    """The state of a run between two calls of its step loop.

    Attributes
    ----------
    arrays : dict of ndarray
        Those of the step loop by their names in `LoopArrays`, and what Python keeps beside them.
    facts : dict
        As JSON can say them: t, t_start, t_end [s]; method, fallback; n_frames, the frames that were shown up to here;
        controllers, the inputs of each, and what sampled ones carry on; events, zeno, notes, redundant.
    own : bool
        Whether a run of this user on this machine has written it, as its seal says. Machine code goes on with the
        arrays as they are then; of a stranger's, only what can be checked is used.
    """

    arrays: dict[str, np.ndarray]
    facts: dict[str, Any]
    own: bool = False

    def to_bytes(self, *, sealed: bool = False) -> bytes:
        """Return the checkpoint as bytes; only those of a run that is going on here may be `sealed`."""
        return pack(self.arrays, self.facts, sealed=sealed)

    @classmethod
    def from_bytes(cls, content: bytes) -> Checkpoint:
        """Read what `to_bytes` wrote.

        Raises
        ------
        CheckpointError
        """
        return cls(*unpack(content))


def pack(arrays: dict[str, np.ndarray], facts: dict[str, Any], *, sealed: bool) -> bytes:
    """Return bytes that begin with their own SHA-256 and, behind it, a seal or zeros."""
    plain = io.BytesIO()
    text = np.frombuffer(json.dumps({"format": FORMAT, **facts}).encode(), dtype=np.uint8)
    np.savez(plain, facts=text, **arrays)
    packed = zlib.compress(plain.getbuffer(), 1)
    inner = hashlib.sha256(packed).digest()
    mark = seal(inner) if sealed else bytes(SEAL_SIZE)
    return hashlib.sha256(mark + inner).digest() + mark + packed


def unpack(content: bytes) -> tuple[dict[str, np.ndarray], dict[str, Any], bool]:
    """Return arrays, facts, and whether this user's own run has sealed them.

    Raises
    ------
    CheckpointError
    """
    digest, mark, packed = (
        content[:_DIGEST],
        content[_DIGEST : _DIGEST + SEAL_SIZE],
        content[_DIGEST + SEAL_SIZE :],
    )
    inner = hashlib.sha256(packed).digest()
    if hashlib.sha256(mark + inner).digest() != digest:
        raise CheckpointError("the checkpoint is damaged: its bytes are not those that were written")
    own = is_own(inner, mark)
    try:
        arrays = _arrays(_inflated(packed, _LARGEST_OWN if own else _LARGEST))
        facts = json.loads(arrays.pop("facts").tobytes())
        if not isinstance(facts, dict):
            raise ValueError("its facts are no table")
    except (
        ValueError,
        KeyError,
        OSError,
        EOFError,
        SyntaxError,
        MemoryError,
        RecursionError,
        zlib.error,
        zipfile.BadZipFile,
    ) as error:
        raise CheckpointError(f"the checkpoint cannot be read: {error}") from error
    if facts.pop("format", None) != FORMAT:
        raise CheckpointError("the checkpoint is of another version of this program")
    return arrays, facts, own


def _inflated(packed: bytes, limit: int) -> bytes:
    inflater = zlib.decompressobj()
    plain = inflater.decompress(packed, limit)
    if not inflater.eof:
        raise ValueError(
            f"it unpacks to more than {limit >> 20} MiB" if len(plain) >= limit else "it is cut off"
        )
    return plain


def _arrays(plain: bytes) -> dict[str, np.ndarray]:
    """Read what `np.savez` wrote; sizes are held against the bytes that there are before anything is allocated."""
    arrays = {}
    with zipfile.ZipFile(io.BytesIO(plain)) as archive:
        for entry in archive.infolist():
            if entry.compress_type != zipfile.ZIP_STORED or entry.file_size > len(plain):
                raise ValueError(f"its part {entry.filename!r:.60} is packed once more")
            name, content = entry.filename.removesuffix(".npy"), archive.read(entry)
            if name in arrays:
                raise ValueError(f"it has {name!r:.60} twice")
            arrays[name] = _array(name, content)
    return arrays


def _array(name: str, content: bytes) -> np.ndarray:
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    if version != (1, 0):
        raise ValueError(f"its array {name!r:.60} has another form")
    shape, by_columns, kind = np.lib.format.read_array_header_1_0(stream)
    rest = len(content) - stream.tell()
    if kind.str not in _KINDS or min(shape, default=0) < 0 or math.prod(shape) * kind.itemsize != rest:
        raise ValueError(f"its array {name!r:.60} is {kind} of shape {shape}, in {rest} bytes")
    flat = np.frombuffer(content, dtype=kind, offset=stream.tell()).copy()
    return flat.reshape(shape, order="F" if by_columns else "C")
