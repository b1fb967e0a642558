"""An ensemble as a Zarr store: a folder that grows chunk by chunk, written by whoever runs the members of a chunk.

A chunk of members is done once its `status` is there, which is written last; each file appears in one step, and ends
with a checksum. So whatever is killed, and whenever, a chunk is done and whole, or is run again.

A store is data from strangers: what it says of itself is checked, sizes are bounded, and no file is read that is not as
long as it has to be. Chunks are not compressed: numbers of members do not shrink, and nothing can unfold to more than
is expected.
"""

from __future__ import annotations

import functools
import json
import math
import os
import re
import secrets
import stat
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.ensemble.identity import identity, refuse_another
from symgen.runtime.ensemble.packing import unpack
from symgen.runtime.ensemble.sampling import named_beside
from symgen.runtime.ensemble.tally import MOST_NAMED
from symgen.runtime.ensemble.verdict import VERDICTS
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late
from symgen.runtime.tables import need

if TYPE_CHECKING:
    import zarr as zarr_types

    from symgen.runtime.ensemble.plan import Plan

zarr = Late("zarr")
codecs = Late("zarr.codecs")

SUFFIX = ".zarr"
FORMAT = 1
_ABOUT = "symgen"  # the group's attribute
_TYPES = {
    "status": "i1",
    "energy_error": "f8",
    "constraint_residual": "f8",
    "steps": "i4",
    "ok": "b1",
    "singly": "b1",
}
_TIMES, _MORE = "t", "more"
_LARGEST_ABOUT = 16 << 20  # bytes
_LARGEST_CHUNK = 1 << 30
_LARGEST_MORE = 1 << 28
_MOST_MEMBERS, _MOST_TIMES = 1 << 48, 1 << 24
_CHECKSUM = 4  # bytes behind each chunk
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_().]{0,199}\Z")


class StoreError(RuntimeModelError):
    """A store cannot be read or written; the message says which part, why, and what to do."""


class _Unfit(ValueError):
    """A part of a store is not what this module writes; the message says which."""


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
            self._expect(_TIMES, "c/0", self.about["n_times"] * 8)
            return np.asarray(self._group[_TIMES][:], dtype=float)

    @classmethod
    def create(cls, path: str | os.PathLike[str], plan: Plan, series: Sequence[str], chunk: int) -> ZarrStore:
        """Make a new store.

        Raises
        ------
        StoreError
            Something is there already, or it cannot be written.
        """
        need("zarr", "ensemble", "a Zarr store")
        path = Path(path)
        if os.path.lexists(path):
            raise StoreError(
                f"{path} is there already: go on with it by resume (--resume), or give another name"
            )
        single = plan.single
        varied = [*named_beside({c.name: None for c in plan.members.columns}, series)]
        taken = sorted({*series, *varied} & {*VERDICTS, _TIMES, _MORE})
        wrong = taken or [name for name in (*series, *varied) if not _NAME.match(name)]
        if wrong:
            raise StoreError(f"a store of members has names of its own: {', '.join(wrong)} cannot be kept")
        about = {
            "format": FORMAT, "token": secrets.token_hex(16), "model": plan.system.name, "method": plan.method,
            "n": plan.members.n, "chunk": chunk, "n_times": len(plan.frame_times), "shape": plan.members.shape,
            "series": list(series), "varied": varied, "t_end": single.t_end, "rtol": single.rtol,
            "atol": single.atol, "notes": plan.notes, "identity": identity(plan),
            "choice": plan.choice.to_json() if plan.choice else None,
        }  # fmt: skip
        try:
            group = zarr.create_group(path, zarr_format=3, attributes={_ABOUT: about})
            for name in dict.fromkeys([*varied, *series, *VERDICTS]):
                is_series = name in series and about["n_times"]
                shape = (about["n"], about["n_times"]) if is_series else (about["n"],)
                _make(group, name, shape, (chunk, *shape[1:]), _TYPES.get(name, "f8"))
            if about["n_times"]:
                times = _make(group, _TIMES, (about["n_times"],), (about["n_times"],), "f8", ("t",))
                times[:] = plan.frame_times
            group.create_group(_MORE)  # now: threads that write their first chunks at once would both make it
        except OSError as error:
            raise StoreError(f"{path}: the store could not be made: {error.strerror or error}") from None
        return cls(path, about, group)

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
            about = _read_about(path)
            store = cls(path, about, zarr.open_group(path, mode="r+" if os.access(path, os.W_OK) else "r"))
            for name in store.names:
                store._check_array(name)
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise StoreError(f"{path} is no ensemble: {_sentence(error)}") from None
        return store

    def _check_array(self, name: str) -> None:
        """Refuse an array that is not laid out as `create` does."""
        n_times = self.about["n_times"] if name in self.about["series"] else 0
        array, shape = self._arrays[name], (self.n, *((n_times,) if n_times else ()))
        own = array.metadata.to_dict()
        kinds = [codec["name"] if isinstance(codec, dict) else "" for codec in own["codecs"]]
        if (
            array.shape != shape
            or array.chunks != (self.chunk, *shape[1:])
            or array.dtype != np.dtype(_TYPES.get(name, "f8"))
            or kinds != ["bytes", "crc32c"]
            or own["chunk_key_encoding"]["name"] != "default"
        ):
            raise _Unfit(f"the array {name} is not as it should be")

    def refuse_another(self, plan: Plan) -> None:
        """Refuse to go on with another ensemble, see `identity.refuse_another`."""
        refuse_another(plan, self.about["identity"], str(self.path))

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
        try:
            if more:
                held = self._group.require_group(_MORE)
                blob = np.frombuffer(more, dtype=np.uint8)
                held.create_array(
                    str(k), data=blob, chunks=blob.shape, compressors=[codecs.Crc32cCodec()], overwrite=True
                )
            for name in self.names:
                if name != "status":
                    self._arrays[name][first:last] = columns[name]
            self._arrays["status"][first:last] = columns["status"]
        except OSError as error:
            raise StoreError(
                f"{self.path}: members {first} to {last - 1} could not be written: {error.strerror or error}; what was "
                "written before is whole: make room, and go on with resume (--resume)"
            ) from None

    def is_done(self, k: int) -> bool:
        """Whether a chunk was written, all of it: what is missing or too short makes it one to be run again."""
        return all(
            self._size(name, self._file(k, name)) == self._bytes(name) for name in reversed(self.names)
        )

    def done(self) -> Iterator[int]:
        """Yield the chunks that are done."""
        return (k for k in range(self.n_chunks) if self.is_done(k))

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
            raise _Unfit(f"{name}/{file} has {max(size, 0)} bytes in place of {n_bytes + _CHECKSUM}")

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
            return np.asarray(self._arrays[name][first:last])

    def read(self, name: str) -> np.ndarray:
        """Return what is kept of all members by name; not a number (status: 0) where a chunk is not done."""
        array = self._arrays[name]
        found = np.full(array.shape, np.nan if array.dtype.kind == "f" else 0, dtype=array.dtype)
        for k in self.done():
            first, last = self.rows(k)
            found[first:last] = self.chunk_of(name, k)
        return found

    def pieces(self, names: Sequence[str]) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
        """Yield the first member, and what is kept by name, of each chunk that is done."""
        for k in self.done():
            yield self.rows(k)[0], {name: self.chunk_of(name, k) for name in names}

    def more(self, k: int) -> bytes:
        """Return what else is known of a chunk; nothing where nothing was written."""
        if not (self.path / _MORE / str(k)).is_dir():
            return b""
        with self._reading(f"what is known of chunk {k}"):
            array = self._group[f"{_MORE}/{k}"]
            if (
                array.ndim != 1
                or array.dtype != np.uint8
                or array.nbytes > _LARGEST_MORE
                or array.chunks != array.shape
            ):
                raise _Unfit("it is not as it should be")
            if [c["name"] for c in array.metadata.to_dict()["codecs"]] != ["bytes", "crc32c"]:
                raise _Unfit("it is not as it should be")
            self._expect(f"{_MORE}/{k}", "c/0", array.nbytes)
            return np.asarray(array[:]).tobytes()

    def messages(self) -> dict[int, str]:
        """Return why members failed, of some of them."""
        found: dict[int, str] = {}
        for k in self.done():
            if len(found) >= MOST_NAMED:
                break
            found |= unpack(self.more(k))[0]
        return found

    def discard(self, k: int) -> None:
        """Make a chunk one that is to be run again."""
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
        if isinstance(error, (OSError, ValueError, KeyError, TypeError, AttributeError)):
            raise StoreError(
                f"{self._path}: {self._what} cannot be read: {_sentence(error)}; run them again with resume "
                "(--resume), which finds files that are too short, or remove their file of status first"
            ) from None


def _sentence(error: BaseException) -> str:
    """What is wrong, in words: those of Zarr show objects of Python, with whatever a stranger's file says in them."""
    if isinstance(error, _Unfit):
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


def _read_about(path: Path) -> dict[str, Any]:
    """Read what a store says of itself, and check it."""
    file = path / "zarr.json"
    found = os.stat(file)
    if not stat.S_ISREG(found.st_mode) or found.st_size > _LARGEST_ABOUT:
        raise _Unfit("its zarr.json is no file, or too large")
    whole = json.loads(file.read_text(encoding="utf-8"))
    about = whole.get("attributes", {}).get(_ABOUT) if isinstance(whole, dict) else None
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise _Unfit("it was not written by symgen, or by another version")
    sizes = {"n": _MOST_MEMBERS, "chunk": _MOST_MEMBERS, "n_times": _MOST_TIMES}
    for name, most in sizes.items():
        if type(about.get(name)) is not int or not (0 if name == "n_times" else 1) <= about[name] <= most:
            raise _Unfit(f"its {name} makes no sense")
    if about["chunk"] * max(about["n_times"], 1) * 8 > _LARGEST_CHUNK:
        raise _Unfit("its chunks are larger than any that are written")
    for name in ("series", "varied", "notes"):
        if not isinstance(about.get(name), list) or not all(isinstance(x, str) for x in about[name]):
            raise _Unfit(f"its list of {name} makes no sense")
    for name in (*about["series"], *about["varied"]):
        if not _NAME.match(name) or name in (*VERDICTS, _TIMES, _MORE):
            raise _Unfit(f"it has the name {name[:60]!r}")
        own = os.stat(path / name / "zarr.json")
        if not stat.S_ISREG(own.st_mode) or own.st_size > _LARGEST_ABOUT:
            raise _Unfit(f"the zarr.json of {name} is no file, or too large")
    for name in ("t_end", "rtol", "atol"):
        if type(about.get(name)) not in (int, float):
            raise _Unfit(f"its {name} makes no sense")
    texts = ("model", "method", "token")
    if not all(isinstance(about.get(name), str) for name in texts) or not isinstance(
        about.get("identity"), dict
    ):
        raise _Unfit("it does not say what it is of")
    if not isinstance(about.get("shape"), dict):
        raise _Unfit("it does not say how members are laid out")
    return about
