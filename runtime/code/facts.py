"""What is asked of a function at every start, so that nothing need be read for it: found once, with the check."""

from __future__ import annotations

from typing import NamedTuple


class Facts(NamedTuple):
    """What a function is like.

    Attributes
    ----------
    inputs : tuple of int
        The places in `p`, behind the parameters, that it reads: inputs, then settings of switches.
    is_sharp : bool
        Whether it can change much while what it depends on changes little.
    """

    inputs: tuple[int, ...]
    is_sharp: bool


def as_text(facts: dict[str, Facts]) -> str:
    """Return facts as lines: function, whether it is sharp, and inputs."""
    return "\n".join(f"{name} {int(x.is_sharp)} {','.join(map(str, x.inputs))}" for name, x in facts.items())


def from_text(text: str) -> dict[str, Facts]:
    """Return facts from such lines."""
    found = {}
    for line in text.splitlines():
        name, is_sharp, inputs = line.split(" ")
        found[name] = Facts(tuple(int(x) for x in inputs.split(",") if x), is_sharp == "1")
    return found
