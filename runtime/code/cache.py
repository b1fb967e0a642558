"""The user's cache folder: where it is, whether it can be trusted; files in it are checked when read."""

from __future__ import annotations

import atexit
import collections
import contextlib
import functools
import hashlib
import os
import sys
import warnings
from pathlib import Path

from symgen.runtime.code.ownership import distrust, make_private, read_own

_MAGIC = b"symgen-cache-1\n"
_DIGEST_SIZE = hashlib.sha256().digest_size

found: collections.Counter[str] = collections.Counter()  # by the name of the folder, since the process began
missed: collections.Counter[str] = collections.Counter()


class CacheWarning(UserWarning):
    """The cache folder, or a file in it, cannot be used; the work is done again."""


def cache_folder(*parts: str) -> Path:
    """Return the cache folder, or a folder below it; it exists, and only the user can write there.

    `SYMGEN_CACHE_DIR` names it; otherwise it is `symgen` in the platform's place for caches. Where it cannot be
    written, or somebody else could have put code there (see `ownership.distrust`), a temporary folder of this process
    serves instead, with a `CacheWarning`.

    Parameters
    ----------
    *parts : str
        Names of folders below it.

    Returns
    -------
    folder : Path
    """
    folder = trusted_folder(os.environ.get("SYMGEN_CACHE_DIR") or str(_platform_folder()))
    return trusted_folder(os.path.join(folder, *parts)) if parts else folder


def _platform_folder() -> Path:
    home = Path(os.path.expanduser("~"))
    xdg = os.environ.get("XDG_CACHE_HOME", "")
    if os.path.isabs(xdg):
        return Path(xdg) / "symgen"
    if sys.platform == "darwin":
        return home / "Library" / "Caches" / "symgen"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local") / "symgen" / "Cache"
    return home / ".cache" / "symgen"


@functools.lru_cache(maxsize=64)
def trusted_folder(path: str) -> Path:
    """Return the folder at `path`, made if it is missing; a temporary one, with a warning, if it cannot be trusted."""
    folder = Path(path).expanduser().absolute()
    try:
        make_private(folder)
        cause = distrust(folder) or ("" if os.access(folder, os.W_OK | os.X_OK) else "is not writable")
    except OSError as error:
        cause = f"cannot be made ({error.strerror or error})"
    if not cause:
        return folder
    private = _temporary_folder() / folder.name
    private.mkdir(mode=0o700, exist_ok=True)
    warnings.warn(
        f"the cache folder {folder} {cause}: compiled code is not taken from there, nor kept; "
        "set SYMGEN_CACHE_DIR to a folder that only you can write to",
        CacheWarning,
        stacklevel=3,
    )
    return private


@functools.lru_cache(maxsize=1)
def _temporary_folder() -> Path:
    import shutil
    import tempfile

    places = [tempfile.gettempdir(), "/tmp", "/var/tmp", str(Path.home())]
    # Whoever can write to the folder above could put another one in its place.
    safe = (x for x in places if os.path.isdir(x) and not distrust(Path(x), on_the_way=True))
    above = next(safe, None)
    if above is None:
        raise OSError(
            "no folder for temporary files is safe from other users: set TMPDIR to one that is yours"
        )
    folder = tempfile.mkdtemp(prefix="symgen-", dir=above)
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def store(path: Path, content: bytes) -> bool:
    """Write `content` with its SHA-256 to `path` in one step, so that no reader ever sees a part of it."""
    import tempfile

    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(prefix=".new-", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(_MAGIC + hashlib.sha256(content).digest() + content)
        os.replace(temporary, path)
        return True
    except OSError as error:
        if temporary is not None:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
        warnings.warn(f"{path} could not be written ({error.strerror or error})", CacheWarning, stacklevel=2)
        return False


def fetch(path: Path) -> bytes | None:
    """Return what `store` wrote to `path`; None when it is missing, torn, altered or not the user's own.

    What cannot be used is removed. The folder must be one of `cache_folder`.
    """
    data, fault = read_own(path)
    if fault:
        warnings.warn(f"{path} {fault}: it is not used, but made anew", CacheWarning, stacklevel=2)
    if data is None and not fault:
        missed[path.parent.name] += 1
        return None
    data = data or b""
    head = len(_MAGIC) + _DIGEST_SIZE
    content = data[head:]
    if data[: len(_MAGIC)] == _MAGIC and data[len(_MAGIC) : head] == hashlib.sha256(content).digest():
        with contextlib.suppress(OSError):
            os.utime(path)  # the age by which `prune` chooses
        found[path.parent.name] += 1
        return content
    missed[path.parent.name] += 1
    with contextlib.suppress(OSError):
        path.unlink()
    return None


def prune(folder: Path, keep: int, pattern: str = "*") -> None:
    """Remove all but the `keep` newest files or folders in `folder` that match `pattern`."""
    import shutil

    aged = []
    for entry in folder.glob(pattern):
        with contextlib.suppress(OSError):
            aged.append((entry.stat().st_mtime, entry))
    for _, entry in sorted(aged, reverse=True)[keep:]:
        with contextlib.suppress(OSError):
            if entry.is_dir():
                shutil.rmtree(entry, ignore_errors=True)
            else:
                entry.unlink()
