"""An ensemble as a Zarr store: a folder that grows chunk by chunk, written by whoever runs the members of a chunk.

A chunk of members is done once its `status` is there, which is written last; each file appears in one step, and ends
with a checksum. So whatever is killed, and whenever, a chunk is done and whole, or is run again. Digests of all that
belongs to a chunk (`digests`) tell whether it stands where it was written.

A store is data from strangers: what it says of itself is checked, sizes are bounded, and no file is read that is not as
long as it has to be. Chunks are not compressed: numbers of members do not shrink, and nothing can unfold to more than
is expected.
"""

from __future__ import annotations

import contextlib
import functools
import json
import math
import os
import shutil
import stat
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.ensemble import digests
from symgen.runtime.ensemble.packing import unpack
from symgen.runtime.ensemble.store_about import (
    ABOUT,
    MORE,
    TIMES,
    StoreError,
    Unfit,
    make_about,
    read_about,
    read_description,
    refuse_another_store,
)
from symgen.runtime.ensemble.tally import MOST_NAMED
from symgen.runtime.ensemble.verdict import CAUSES, VERDICTS
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.lazy import Late
from symgen.runtime.size import more_than_memory
from symgen.runtime.tables import need

if TYPE_CHECKING:
    import zarr as zarr_types

    from symgen.runtime.ensemble.plan import Plan

fcntl = Late("fcntl")
zarr = Late("zarr")
codecs = Late("zarr.codecs")

SUFFIX = ".zarr"
_TYPES = {
    "status": "i1",
    "energy_error": "f8",
    "constraint_residual": "f8",
    "steps": "i4",
    "ok": "b1",
    "singly": "b1",
}
_DIGESTS = f"{MORE}/digests"  # in the group below: it is no variable of what other programs open
_LARGEST_MORE = 1 << 28  # bytes
_CHECKSUM = 4  # bytes behind each chunk
_KNOWN_STATUS = (at.REACHED_STOP, *CAUSES)


class ZarrStore:
    """An ensemble in a folder; make one with `create` or `open`.

    Attributes
    ----------
    path : Path
    about : dict
        Model, method, what was asked for; `identity`, which tells whether another ensemble is the same.
    n, chunk, n_chunks : int
        Members, members of a chunk, chunks.
    """

    def __init__(self, path: Path, about: dict[str, Any], group: zarr_types.Group) -> None:
        self.path, self.about, self._group = path, about, group
        self.n, self.chunk = about["n"], about["chunk"]
        self.n_chunks = -(-self.n // self.chunk)
        # What is not there is not done, so a chunk of zeros is written, too.
        self._arrays = {name: group[name].with_config({"write_empty_chunks": True}) for name in self.names}
        self._digests = group[_DIGESTS]
        self._digests_of: tuple[int, np.ndarray] | None = None  # of the chunk that was read last

    @property
    def names(self) -> list[str]:
        """All that is kept of each member: what varies, series, verdicts."""
        return list(dict.fromkeys([*self.about["varied"], *self.about["series"], *VERDICTS]))

    @property
    def t(self) -> np.ndarray:
        """The times of series [s]; the end alone where they have none."""
        return self._times if self.about["n_times"] else np.array([self.about["t_end"]])

    @functools.cached_property
    def _times(self) -> np.ndarray:
        with self._reading("the times"):
            self._expect(TIMES, "c/0", self.about["n_times"] * 8)
            return np.asarray(self._group[TIMES][:], dtype=float)

    @classmethod
    def create(cls, path: str | os.PathLike[str], plan: Plan, series: Sequence[str], chunk: int) -> ZarrStore:
        """Make a new store.

        Raises
        ------
        StoreError
            Something is there already, or it cannot be written.
        """
        need("zarr", "ensemble", "a Zarr store")
        path, about = Path(path), make_about(plan, series, chunk)
        if os.path.lexists(path):
            raise StoreError(_there_already(path))
        # It appears in one step: whoever is killed leaves a whole store or none, and of two that make it at once one
        # is refused.
        new = path.with_name(f".new-{about['token'][:8]}{SUFFIX}")
        try:
            new.mkdir()
            _lay_out(
                zarr.create_group(new, zarr_format=3, attributes={ABOUT: about}), about, plan.frame_times
            )
            new.rename(path)
        except OSError as error:
            shutil.rmtree(new, ignore_errors=True)
            if os.path.lexists(path):
                raise StoreError(_there_already(path)) from None
            raise StoreError(f"{path}: the store could not be made: {error.strerror or error}") from None
        return cls(path, about, zarr.open_group(path, mode="r+", use_consolidated=False))

    @staticmethod
    def is_there(path: str | os.PathLike[str]) -> bool:
        """Whether something has the name."""
        return os.path.lexists(path)

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> ZarrStore:
        """Open a store that is there.

        Raises
        ------
        StoreError
            It is something else, or damaged.
        """
        need("zarr", "ensemble", "a Zarr store")
        path = Path(path)
        if not path.exists():
            raise StoreError(f"{path}: there is no such store")
        try:
            about = read_about(path)
            times = (TIMES,) if about["n_times"] else ()
            for name in (*about["varied"], *about["series"], *VERDICTS, *times, MORE, _DIGESTS):
                read_description(path, f"{name}/zarr.json")  # before Zarr does: it would wait for a pipe
            mode = "r+" if os.access(path, os.W_OK) else "r"
            store = cls(path, about, zarr.open_group(path, mode=mode, use_consolidated=False))
            for name in store.names:
                store._check_array(name)
            _check_layout(
                _DIGESTS,
                store._digests,
                (store.n_chunks, *_digest_shape(about)),
                (1, *_digest_shape(about)),
                "u1",
            )
            if times:
                _check_layout(TIMES, store._group[TIMES], (about["n_times"],), (about["n_times"],), "f8")
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise StoreError(f"{path} is no ensemble: {_sentence(error)}") from None
        return store

    def _check_array(self, name: str) -> None:
        """Refuse an array that is not laid out as `create` does."""
        n_times = self.about["n_times"] if name in self.about["series"] else 0
        shape = (self.n, *((n_times,) if n_times else ()))
        _check_layout(name, self._arrays[name], shape, (self.chunk, *shape[1:]), _TYPES.get(name, "f8"))

    def refuse_another(self, plan: Plan, series: Sequence[str]) -> None:
        """Refuse to go on with another ensemble, see `refuse_another_store`."""
        refuse_another_store(self.about, plan, series, str(self.path))
        if not np.array_equal(self.t, plan.frame_times if len(plan.frame_times) else [plan.single.t_end]):
            raise StoreError(f"{self.path} contradicts itself: its times are of another ensemble; begin anew")

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Keep others from writing while members are run: two would do the same work, and remove each other's files.

        Raises
        ------
        StoreError
            Somebody else writes.
        """
        with contextlib.ExitStack() as stack:
            try:
                file = stack.enter_context((self.path / "zarr.json").open("rb"))
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise StoreError(
                    f"{self.path}: another process is writing to it; wait for its end, or give another name"
                ) from None
            except (OSError, ImportError):  # a file system or a machine without locks
                pass
            yield

    def rows(self, k: int) -> tuple[int, int]:
        """The members of chunk k: from the first up to, not including, the second."""
        return k * self.chunk, min((k + 1) * self.chunk, self.n)

    def write(self, first: int, columns: Mapping[str, np.ndarray], more: bytes = b"") -> None:
        """Write a chunk: what is kept of its members by name, and what else is known of it.

        Raises
        ------
        StoreError
            There is no room, or no right to write.
        """
        k, last = first // self.chunk, first + len(columns["status"])
        self._digests_of = None
        try:
            if not more:
                shutil.rmtree(self.path / MORE / str(k), ignore_errors=True)
            else:
                held = self._group.require_group(MORE)
                blob = np.frombuffer(more, dtype=np.uint8)
                held.create_array(
                    str(k), data=blob, chunks=blob.shape, compressors=[codecs.Crc32cCodec()], overwrite=True
                )
            for name in self.names:
                if name != "status":
                    self._arrays[name][first:last] = columns[name]
            held_as = {name: np.asarray(columns[name], dtype=self._arrays[name].dtype) for name in self.names}
            self._digests[k] = np.array(
                [self._digest(name, k, held_as[name]) for name in self.names] + [self._digest(MORE, k, more)]
            )
            self._arrays["status"][first:last] = columns["status"]
        except OSError as error:
            raise StoreError(
                f"{self.path}: members {first} to {last - 1} could not be written: {error.strerror or error}; what was "
                "written before is whole: make room, and go on with resume (--resume)"
            ) from None

    def is_done(self, k: int) -> bool:
        """Whether a chunk was written, all of it: what is missing or too short makes it one to be run again."""
        return self._size(_DIGESTS, f"c/{k}/0/0") == math.prod(self._digests.chunks) + _CHECKSUM and all(
            self._size(name, self._file(k, name)) == self._bytes(name) for name in reversed(self.names)
        )

    def done(self) -> Iterator[int]:
        """Yield the chunks that are done, in their order."""
        try:  # whatever a store says of its number of chunks, it has no more than files
            there = [int(x) for x in os.listdir(self.path / "status" / "c") if x.isdecimal() and len(x) < 16]
        except OSError:
            there = []
        return (k for k in sorted(there) if k < self.n_chunks and self.is_done(k))

    def _digest(self, name: str, k: int, content: np.ndarray | bytes) -> np.ndarray:
        return digests.of_chunk(self.about[digests.DIGEST], name, k, content)

    def _hold_against_digest(self, name: str, k: int, content: np.ndarray | bytes) -> None:
        """Refuse what is not what was written in this place of this store."""
        if self._digests_of is None or self._digests_of[0] != k:
            self._expect(_DIGESTS, f"c/{k}/0/0", math.prod(self._digests.chunks))
            self._digests_of = k, np.asarray(self._digests[k])
        row = self.names.index(name) if name != MORE else len(self.names)
        if not np.array_equal(self._digests_of[1][row], self._digest(name, k, content)):
            raise Unfit("it is not what was written there, as its digest says")

    def n_done(self) -> int:
        """The number of members that are done."""
        return sum(last - first for first, last in map(self.rows, self.done()))

    def _file(self, k: int, name: str) -> str:
        return f"c/{k}/0" if self._arrays[name].ndim > 1 else f"c/{k}"

    def _bytes(self, name: str) -> int:
        array = self._arrays[name]
        return math.prod(array.chunks) * array.dtype.itemsize + _CHECKSUM

    def _size(self, name: str, file: str) -> int:
        """The length of a file of an array; -1 where there is none, or it is no plain file."""
        try:
            found = os.stat(self.path / name / file)
        except OSError:
            return -1
        return found.st_size if stat.S_ISREG(found.st_mode) else -1

    def _expect(self, name: str, file: str, n_bytes: int) -> None:
        size = self._size(name, file)
        if size != n_bytes + _CHECKSUM:
            raise Unfit(f"{name}/{file} has {max(size, 0)} bytes in place of {n_bytes + _CHECKSUM}")

    def _reading(self, what: str) -> _Reading:
        return _Reading(self.path, what)

    def chunk_of(self, name: str, k: int) -> np.ndarray:
        """Return what is kept of the members of a chunk that is done.

        Raises
        ------
        StoreError
            It is damaged.
        """
        first, last = self.rows(k)
        with self._reading(f"{name} of members {first} to {last - 1}"):
            self._expect(name, self._file(k, name), self._bytes(name) - _CHECKSUM)
            found = np.asarray(self._arrays[name][first:last])
            self._hold_against_digest(name, k, found)
            if name == "status" and not np.isin(found, _KNOWN_STATUS).all():
                raise Unfit("it has verdicts that there are not")
            return found

    def read(self, name: str) -> np.ndarray:
        """Return what is kept of all members by name; not a number (status: 0) where a chunk is not done."""
        array = self._arrays[name]
        if needed := more_than_memory(array.nbytes):
            raise StoreError(
                f"{self.path}: {name} of {self.n} members {needed}: read it piece by piece (pieces)"
            )
        found = np.full(array.shape, np.nan if array.dtype.kind == "f" else 0, dtype=array.dtype)
        for k in self.done():
            first, last = self.rows(k)
            found[first:last] = self.chunk_of(name, k)
        return found

    def pieces(self, names: Sequence[str]) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
        """Yield the first member, and what is kept by name, of each chunk that is done."""
        for k in self.done():
            first, last = self.rows(k)
            piece = {name: self.chunk_of(name, k) for name in names}
            if (
                "status" in piece
                and "ok" in piece
                and (piece["ok"] & (piece["status"] != at.REACHED_STOP)).any()
            ):
                raise StoreError(
                    f"{self.path}: members {first} to {last - 1} contradict themselves: some have failed and are ok"
                )
            yield first, piece

    def known(self, k: int) -> tuple[dict[int, str], list[list[list[np.ndarray]]]]:
        """Return what else is known of a chunk: messages of members, numbers of its statistics.

        Raises
        ------
        StoreError
            It is damaged.
        """
        with self._reading(f"what is known of members {self.rows(k)[0]} to {self.rows(k)[1] - 1}"):
            content = self._more(k)
            self._hold_against_digest(MORE, k, content)
            try:
                return unpack(content)
            except RuntimeModelError as error:
                raise Unfit(str(error)) from None

    def _more(self, k: int) -> bytes:
        if not os.path.lexists(self.path / MORE / str(k)):
            return b""
        name = f"{MORE}/{k}"
        read_description(self.path, f"{name}/zarr.json")
        array = self._group[name]
        size = array.shape[0] if array.ndim == 1 else 0
        if not 0 < size <= _LARGEST_MORE:
            raise Unfit("it is not as it should be")
        _check_layout(name, array, (size,), (size,), "u1")
        self._expect(name, "c/0", size)
        return np.asarray(array[:]).tobytes()

    def messages(self) -> dict[int, str]:
        """Return why members failed, of some of them."""
        found: dict[int, str] = {}
        for k in self.done():
            if len(found) >= MOST_NAMED:
                break
            found |= self.known(k)[0]
        return found

    def discard(self, k: int) -> None:
        """Make a chunk one that is to be run again."""
        self._digests_of = None
        try:
            (self.path / "status" / self._file(k, "status")).unlink(missing_ok=True)
        except OSError as error:
            raise StoreError(f"{self.path}: {error.strerror or error}") from None


class _Reading:
    """What goes wrong while a part of a store is read becomes a sentence."""

    def __init__(self, path: Path, what: str) -> None:
        self._path, self._what = path, what

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if isinstance(error, (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError)):
            raise StoreError(
                f"{self._path}: {self._what} cannot be read: {_sentence(error)}; run them again with resume "
                "(--resume)"
            ) from None


def _sentence(error: BaseException) -> str:
    """What is wrong, in words: those of Zarr show objects of Python, with whatever a stranger's file says in them."""
    if isinstance(error, Unfit):
        return str(error)
    if isinstance(error, json.JSONDecodeError):
        return f"a zarr.json is no JSON ({error.msg}, line {error.lineno})"
    if isinstance(error, OSError) and error.strerror:
        return (
            f"{Path(os.fsdecode(error.filename)).name}: {error.strerror}"
            if error.filename
            else error.strerror
        )
    if "checksum" in str(error):
        return "its bytes are not those that were written, as their checksum says"
    return "a zarr.json of it is not as this program writes it"


def _make(
    group: zarr_types.Group, name: str, shape: tuple[int, ...], chunks: tuple[int, ...], kind: str,
    dimensions: tuple[str, ...] = (),
) -> Any:  # fmt: skip
    return group.create_array(
        name, shape=shape, chunks=chunks, dtype=kind, fill_value=np.nan if kind == "f8" else 0,
        compressors=[codecs.Crc32cCodec()],
        dimension_names=dimensions or ("member", "t")[: len(shape)],
    )  # fmt: skip


def _lay_out(group: zarr_types.Group, about: Mapping[str, Any], frame_times: np.ndarray) -> None:
    """Make the arrays of a new store."""
    n, n_times, chunk = about["n"], about["n_times"], about["chunk"]
    for name in dict.fromkeys([*about["varied"], *about["series"], *VERDICTS]):
        shape = (n, n_times) if name in about["series"] and n_times else (n,)
        _make(group, name, shape, (chunk, *shape[1:]), _TYPES.get(name, "f8"))
    if n_times:
        _make(group, TIMES, (n_times,), (n_times,), "f8", ("t",))[:] = frame_times
    group.create_group(MORE)
    each = _digest_shape(about)
    _make(group, _DIGESTS, (-(-n // chunk), *each), (1, *each), "u1", ("chunk", "part", "byte"))


def _digest_shape(about: Mapping[str, Any]) -> tuple[int, int]:
    """Digests of a chunk: of each name, and of what else is known of it."""
    return len({*about["varied"], *about["series"], *VERDICTS}) + 1, digests.LENGTH


def _check_layout(name: str, array: Any, shape: tuple[int, ...], chunks: tuple[int, ...], kind: str) -> None:
    """Refuse an array that is not laid out as `_make` does: sizes of files would be others, or their numbers."""
    own = array.metadata.to_dict()
    said = [codec if isinstance(codec, dict) else {} for codec in own["codecs"]]
    keys = own["chunk_key_encoding"]
    if (
        array.shape != shape
        or array.chunks != chunks
        or array.dtype != np.dtype(kind)
        or [codec.get("name") for codec in said] != ["bytes", "crc32c"]
        or said[0].get("configuration", {}).get("endian", "little") != "little"
        or keys["name"] != "default"
        or keys.get("configuration", {}).get("separator", "/") != "/"
        or own.get("storage_transformers")
    ):
        raise Unfit(f"the array {name} is not as it should be")


def _there_already(path: Path) -> str:
    return f"{path} is there already: go on with it by resume (--resume), or give another name"
