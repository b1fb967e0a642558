"""Which run time this is: members are the same to the last bit where it is the same one."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
from pathlib import Path


@functools.lru_cache(maxsize=1)
def fingerprint() -> str:
    """Return the version of the package, and a hash of the run time's sources: of two builds of one version, too."""
    digest, folder = hashlib.sha256(), Path(__file__).parents[1]
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes())
    try:
        version = importlib.metadata.version("symgen")
    except importlib.metadata.PackageNotFoundError:
        version = "of a folder"
    return f"{version} ({digest.hexdigest()[:12]})"
