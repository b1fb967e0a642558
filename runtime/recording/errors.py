"""The error that recordings raise."""

from __future__ import annotations

from symgen.runtime.errors import RuntimeModelError


class RecordingError(RuntimeModelError):
    """A file is not a recording that can be read; the text says why and what to do."""
