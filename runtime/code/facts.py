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
    is_smooth : bool
        Whether what depends on the state are sums, products, sines and cosines: it bends nowhere all of a sudden.
    latency : int
        Of `rhs`: processor cycles of the longest chain of operations that wait for each other, about; else 0.
    work : int
        Of `rhs`: operations, each of the elementary functions as many as take the same time; else 0.
    smooth_where : str
        A recipe (`recipe.py`) of what it divides by or takes roots of: it is smooth where these stay away from
        zero. Empty where it is smooth everywhere, or for other reasons not.
    turns_back : bool
        Of `rhs`: whether rates of the opposite sign give the same accelerations, and the opposite power.
    """

    inputs: tuple[int, ...]
    is_sharp: bool
    is_smooth: bool = False
    latency: int = 0
    work: int = 0
    smooth_where: str = ""
    turns_back: bool = False


def as_text(facts: dict[str, Facts]) -> str:
    """Return facts as lines: the function, and all that is known of it."""
    return "\n".join(
        f"{name} {int(x.is_sharp)} {int(x.is_smooth)} {x.latency} {x.work} {int(x.turns_back)} {x.smooth_where} "
        f"{','.join(map(str, x.inputs))}"
        for name, x in facts.items()
    )


def from_text(text: str) -> dict[str, Facts]:
    """Return facts from such lines."""
    found = {}
    for line in text.splitlines():
        name, is_sharp, is_smooth, latency, work, turns_back, smooth_where, inputs = line.split(" ")
        places = tuple(int(x) for x in inputs.split(",") if x)
        found[name] = Facts(
            places,
            is_sharp == "1",
            is_smooth == "1",
            int(latency),
            int(work),
            smooth_where,
            turns_back == "1",
        )
    return found
