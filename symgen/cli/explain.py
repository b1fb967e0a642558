"""`symgen run --explain`: what a run skipped, as lines of text."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution


def explanation(solution: Solution, recorded: bool) -> list[str]:
    """Return what a run skipped and why, one line each.

    Parameters
    ----------
    solution : Solution
    recorded : bool
        Whether a recording was written.
    """
    from symgen.runtime.explain import savings

    found = savings(solution, recorded)
    width = max(len(saving.what) for saving in found)
    lines = [f"    {saving.what:<{width}}  {saving.gain}; {saving.why}" for saving in found]
    return ["  skipped", *lines]
