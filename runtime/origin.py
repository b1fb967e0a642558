"""Whose bytes are they: a seal that only this user's runs on this machine can make.

A checksum finds damage, but whoever changes bytes can compute it anew. The seal needs a key, which lies in the cache
folder. Where that is lost, or a file comes from another machine, it is read as any stranger's.
"""

from __future__ import annotations

import functools
import hmac
import os

from symgen.runtime.code.cache import cache_folder, fetch, store

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
