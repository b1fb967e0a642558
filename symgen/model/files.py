"""Reading files of strangers: plain files only, and no more of them than a model can have."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from ..errors import ModelError

LARGEST_FILE = 4 << 20  # bytes of a model
LARGEST_TABLE = 32 << 20


def read_plain(path: Path, largest: int = LARGEST_FILE, what: str = "file") -> bytes:
    """Return the content of a regular file.

    Raises
    ------
    ModelError
        It is a folder, a device or a pipe, is larger than `largest` bytes, or cannot be read.
    """
    try:
        # A pipe would wait for somebody who writes to it.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with os.fdopen(handle, "rb") as file:
            if not stat.S_ISREG(os.fstat(handle).st_mode):
                raise ModelError(
                    f"this is no {what}: a device, a pipe or a folder",
                    file=str(path),
                    hint="name a plain file",
                )
            content = file.read(largest + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ModelError(
            f"the {what} cannot be read: {reason}", file=str(path), hint="look at its name and permissions"
        ) from error
    if len(content) > largest:
        raise ModelError(
            f"the {what} is larger than {largest >> 20} MiB",
            file=str(path),
            hint="leave out what the model does not need",
        )
    return content
