"""Whose files are they: what is executed comes only from where nobody but the user or root could have put it."""

from __future__ import annotations

import os
import stat
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
