"""The user's cache folder: where it is, whether it can be trusted; files in it are checked when read."""

from __future__ import annotations

import atexit
import collections
import contextlib
import fnmatch
import functools
import hashlib
import os
import stat
import sys
import warnings
from pathlib import Path

_MOST_LINKS = 40  # as many as Linux follows in one path
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH  # also where an access list lets single users write


def distrust(folder: Path, *, on_the_way: bool = False) -> str:
    """Say why what stands in `folder` may be from someone else, "" where it cannot.

    Every folder and symbolic link on the way there must belong to the user or to root, and nobody else may write to
    it. In a folder with the sticky bit, such as /tmp, others cannot move what is not theirs, so one may lie on the way;
    `on_the_way` says that `folder` itself is no more than that.
    """
    if os.name != "posix":
        return ""
    place, ahead, links = Path("/"), [*reversed(folder.absolute().parts[1:])], 0
    fault = _fault(place.lstat(), is_end=not (ahead or on_the_way))
    while ahead and not fault:
        name = ahead.pop()
        if name == "..":
            place = place.parent
            continue
        status = (place / name).lstat()
        if stat.S_ISLNK(status.st_mode):
            links += 1
            fault = _foreign(status) or ("has too many symbolic links" if links > _MOST_LINKS else "")
            target = Path(os.readlink(place / name))
            ahead += reversed(target.parts)
            if target.is_absolute():
                place = Path("/")
                ahead.pop()
        else:
            place = place / name
            fault = _fault(status, is_end=not (ahead or on_the_way))
    if not fault or place == folder:
        return fault
    return f"is reached through {place}, which {fault}"


def _fault(status: os.stat_result, *, is_end: bool) -> str:
    """What is wrong with a folder that lies on the way, or at its end."""
    if not stat.S_ISDIR(status.st_mode):
        return "is no folder"
    if foreign := _foreign(status):
        return foreign
    if status.st_mode & stat.S_ISVTX and not is_end:
        return ""
    return _open_to(status)


def _foreign(status: os.stat_result) -> str:
    return "" if status.st_uid in (os.geteuid(), 0) else "belongs to another user"


def _open_to(status: os.stat_result) -> str:
    if status.st_mode & stat.S_IWOTH:
        return "can be written by everybody"
    return "can be written by its group" if status.st_mode & _OTHERS_WRITE else ""


def make_private(folder: Path) -> None:
    """Make a folder, and those above it that are missing, such that only the user gets in."""
    if not folder.is_dir():
        if folder.parent != folder:
            make_private(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)


def read_own(path: Path) -> tuple[bytes | None, str]:
    """Return the content of a file in a folder that is to be trusted, and why it is not to be used.

    Both are empty (None and "") where there is no such file. Looked at is the file that was opened, not its name.
    """
    flags = os.O_RDONLY | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
    flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)  # a FIFO would wait for a writer
    try:
        handle = os.open(path, flags)
    except FileNotFoundError:
        return None, ""
    except OSError as error:
        return None, f"cannot be opened ({error.strerror or error})"
    with os.fdopen(handle, "rb") as file:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            return None, "is no regular file"
        fault = (_foreign(status) or _open_to(status)) if os.name == "posix" else ""
        return (None, fault) if fault else (file.read(), "")


def foreign_below(folder: Path) -> str:
    """Name something below `folder` that belongs to another user, or is no file or folder; "" where there is none."""
    if os.name != "posix":
        return ""
    for place, _, names in os.walk(folder):
        for path in (Path(place), *(Path(place, name) for name in names)):
            status = path.lstat()
            if _foreign(status) or not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
                return str(path)
    return ""


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
    """Remove the oldest files or folders in `folder` that match `pattern`, if these are more than `keep`.

    A tenth more than is needed, so that a full folder is not looked at in full behind every file that is put there.
    """
    import shutil

    try:
        entries = fnmatch.filter(os.listdir(folder), pattern)
    except OSError:
        return
    if len(entries) <= keep:
        return
    aged = []
    for name in entries:
        with contextlib.suppress(OSError):
            aged.append(((folder / name).stat().st_mtime, folder / name))
    for _, entry in sorted(aged, reverse=True)[keep - keep // 10 :]:
        with contextlib.suppress(OSError):
            if entry.is_dir():
                shutil.rmtree(entry, ignore_errors=True)
            else:
                entry.unlink()
