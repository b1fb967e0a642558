"""Why a model has no Taylor series that this method can compute."""

from __future__ import annotations

from symgen.runtime.errors import RuntimeModelError


class Refusal(RuntimeModelError):
    """An operation that has no Taylor series everywhere; the message says which."""
