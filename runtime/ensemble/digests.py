"""Digests of what a store of members holds: of what it says of itself, and of each chunk of each array.

A checksum behind a chunk finds bits that have changed. It does not find a whole chunk that stands where another was, or
that comes from another store: a digest is also of the name, the place and all that the store says of itself, a random
token among it. Digests do not prove who wrote a store: whoever reads this file can make them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

DIGEST = "digest"  # the entry of what a store says of itself
LENGTH = 16  # bytes


def of_about(about: Mapping[str, Any]) -> str:
    """Return the digest of all that a store says of itself but this one."""
    said = json.dumps({name: value for name, value in about.items() if name != DIGEST}, sort_keys=True)
    return hashlib.blake2b(said.encode(), digest_size=LENGTH).hexdigest()


def of_chunk(about_digest: str, name: str, k: int, content: np.ndarray | bytes) -> np.ndarray:
    """Return the digest of the content of a chunk, shape (LENGTH,): its numbers, wherever their bytes lie."""
    place = f"{about_digest} {name} {k} ".encode()
    if isinstance(content, np.ndarray):
        place += f"{content.dtype.str} {content.shape} ".encode()
        content = content.tobytes()
    return np.frombuffer(hashlib.blake2b(place + content, digest_size=LENGTH).digest(), dtype=np.uint8)
