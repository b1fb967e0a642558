"""An ensemble as a file of NumPy's `.npz`, whole or as far as it came, and going on with one."""

from __future__ import annotations

import json
import os
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.ensemble.identity import identity
from symgen.runtime.ensemble.sampling import named_beside
from symgen.runtime.ensemble.store_about import check_common
from symgen.runtime.ensemble.verdict import CAUSES, VERDICTS
from symgen.runtime.ensemble.zarr_store import ZarrStore
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.ensemble.result import Ensemble

_ABOUT = "about"  # the name of what is not numbers
_FORMAT = 1
# Names in the file beside those of series and of what varies.
_KINDS = {"status": "i", "steps": "i", "ok": "b", "singly": "b"}
_DAMAGED = (
    OSError, ValueError, KeyError, TypeError, AttributeError, EOFError, RecursionError, NotImplementedError,
    MemoryError, zlib.error, zipfile.BadZipFile,
)  # fmt: skip
_OWN = ("t", "status", "ok", "steps", "energy_error", "constraint_residual", "singly", _ABOUT)


@record(eq=False)
class Stored:
    """What a file holds.

    Attributes
    ----------
    about : dict
        Model, method, what was asked for, `n`, `n_done`, `identity`, which tells whether another ensemble is the same.
    arrays : dict of str to ndarray
        By name, a row for each member; `t`, the times of series.
    """

    about: dict[str, Any]
    arrays: Mapping[str, np.ndarray]

    @property
    def n(self) -> int:
        """The number of members."""
        return self.about["n"]

    @property
    def t(self) -> np.ndarray:
        """The times of series [s]."""
        return self.arrays["t"]

    def n_done(self) -> int:
        """The number of members that are done."""
        return self.about["n_done"]

    def messages(self) -> dict[int, str]:
        """Why members failed, of some of them."""
        return {int(k): str(said) for k, said in self.about["messages"].items()}

    def pieces(self, names: Sequence[str]) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
        """Yield the first member, and what is kept by name: here, of all that are done at once."""
        if done := self.about["n_done"]:
            yield 0, {name: self.arrays[name][:done] for name in names}


def write_ensemble(e: Ensemble, path: str | os.PathLike[str]) -> None:
    """Write an ensemble, in one step: a file that is there before is whole until then."""
    path, v = Path(path), e.verdicts
    varied = named_beside(e.varied, e.names)
    about = {
        "symgen": _FORMAT, "model": e.plan.system.name, "method": e.method, "n": e.n, "n_done": e.n_done,
        "shape": e.shape, "series": e.names, "varied": list(varied), "t_end": e.plan.single.t_end,
        "rtol": e.plan.single.rtol, "atol": e.plan.single.atol, "notes": e.notes, "identity": identity(e.plan),
        "choice": e.plan.choice.to_json() if e.plan.choice else None,
        "messages": {str(k): said for k, said in e.messages.items()},
    }  # fmt: skip
    taken = {name for name in (*e.series, *varied) if name in _OWN}
    if taken:
        raise RuntimeModelError(
            f"a file of members has names of its own: {', '.join(sorted(taken))} cannot be kept"
        )
    arrays = {
        **varied, **e.series, "t": e.t, "status": v.status, "ok": v.ok, "steps": v.steps,
        "energy_error": v.energy_error, "constraint_residual": v.constraint_residual, "singly": v.singly,
        _ABOUT: np.array(json.dumps(about)),
    }  # fmt: skip
    handle, temporary = tempfile.mkstemp(prefix=".new-", suffix=".npz", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, **arrays)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def open_members(path: str | os.PathLike[str]) -> Stored | ZarrStore:
    """Open what `symgen sweep` has written: a Zarr store, or a file of NumPy.

    Raises
    ------
    RuntimeModelError
        It is something else, or damaged.
    """
    return ZarrStore.open(path) if Path(path).is_dir() else read_ensemble(path)


def _refuse_what_is_no_file(path: str | os.PathLike[str]) -> None:
    """A pipe would wait for somebody who writes to it, and a device may go on for ever."""
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise ValueError("it is a device, a pipe or a folder; name a plain file")


def _refuse_compressed(path: str | os.PathLike[str]) -> None:
    """What is not compressed is no longer than its file."""
    with zipfile.ZipFile(path) as file:
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in file.infolist()):
            raise ValueError("its arrays are compressed, which those of symgen are not")


def read_ensemble(path: str | os.PathLike[str]) -> Stored:
    """Read a file that `write_ensemble` has written.

    Raises
    ------
    RuntimeModelError
        It is something else, or damaged.
    """
    try:
        _refuse_what_is_no_file(path)
        _refuse_compressed(path)
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        about = json.loads(str(arrays.pop(_ABOUT)))
        _check_about(about)
        _check_arrays(about, arrays)
    except FileNotFoundError:
        raise RuntimeModelError(f"{path}: there is no such file") from None
    except zipfile.BadZipFile as error:
        raise RuntimeModelError(
            f"{path} is no ensemble: it is no .npz file, or a damaged one ({error}); name what `symgen sweep --out` "
            "has written"
        ) from None
    except _DAMAGED as error:
        raise RuntimeModelError(f"{path} is no ensemble: {error or type(error).__name__}") from None
    return Stored(about, arrays)


def _check_about(about: Any) -> None:
    """Refuse what a file says of itself where that makes no sense."""
    if not isinstance(about, dict) or about.get("symgen") != _FORMAT:
        raise ValueError("it was not written by symgen sweep, or by another version")
    check_common(about, _OWN)
    n, done, messages = (about.get(name) for name in ("n", "n_done", "messages"))
    if not (type(n) is int and type(done) is int and 0 <= done <= n > 0):
        raise ValueError("what it says of its members contradicts itself")
    if not isinstance(messages, dict) or not all(k.isdecimal() and k.isascii() for k in messages):
        raise ValueError("its list of messages makes no sense")


def _check_arrays(about: dict[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
    """Refuse arrays that are not those of so many members, or verdicts that there are not."""
    t, n, done = arrays["t"], about["n"], about["n_done"]
    if t.ndim != 1 or not len(t) or t.dtype != float or not np.isfinite(t).all():
        raise ValueError("its times make no sense")
    shapes = {name: {(n,), (n, len(t))} for name in about["series"]}
    shapes |= {name: {(n,)} for name in (*about["varied"], *VERDICTS)}
    for name, fitting in shapes.items():
        kind = _KINDS.get(name, "f")
        if arrays[name].shape not in fitting or arrays[name].dtype.kind != kind:
            raise ValueError(f"{name} is not an array of {n} members, or not of numbers as they have them")
    status, ok = arrays["status"][:done], arrays["ok"][:done]
    if not np.isin(status, (at.REACHED_STOP, *CAUSES)).all() or (ok & (status != at.REACHED_STOP)).any():
        raise ValueError("its verdicts contradict themselves")
