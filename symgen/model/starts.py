"""What holds where a run begins: equations for guesses, parameters that are sought, rest, stops that are closed."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..errors import nearest
from .description import Description, StartConditions
from .given import given_name, is_listed, is_symbol
from .sources import Sources

if TYPE_CHECKING:
    from .declared import Declared

START_KEYS = ("equations", "find", "steady", "closed")
MOST_EQUATIONS = 1000  # the largest models whose starts are solved for have as many coordinates and rates


def make_start(model: Declared, before: StartConditions | None, given: dict[str, Any]) -> StartConditions:
    """Add what is said of the start to what has been said `before`."""
    start, sources = before or StartConditions(), model._sources
    first = len(start.equations)
    texts = given["equations"]
    if not is_listed(texts):
        message = "a list of expressions that are zero at the start is expected here"
        raise sources.error("start", "equations", message, hint='for example ["tip_x - 0.3"]')
    if first + len(texts) > MOST_EQUATIONS:
        message = f"a start has {MOST_EQUATIONS} equations at most, and {first + len(texts)} are given"
        raise sources.error("start", "equations", message, hint="leave out those that follow from others")
    equations = [sources.equation(x, "start", f"equations[{first + k}]") for k, x in enumerate(texts)]
    steady, everything = given["steady"], start.everything
    if isinstance(steady, bool):
        everything, steady = everything or steady, ()
    return replace(
        start,
        equations=(*start.equations, *equations),
        find=(*start.find, *_names(sources, "find", given["find"], "parameters")),
        steady=(*start.steady, *_names(sources, "steady", steady, "coordinates, or true")),
        everything=everything,
        closed=(*start.closed, *_names(sources, "closed", given["closed"], "stops")),
    )


def together(own: StartConditions | None, used: Sequence[StartConditions]) -> StartConditions | None:
    """What a model says of its start, with what uses of assemblies say."""
    parts = [*([] if own is None else [own]), *used]
    if len(parts) < 2:
        return parts[0] if parts else None
    return StartConditions(
        tuple(x for part in parts for x in part.equations),
        tuple(dict.fromkeys(x for part in parts for x in part.find)),
        ()
        if own is not None and own.everything
        else tuple(dict.fromkeys(x for p in parts for x in p.steady)),
        own is not None and own.everything,
        tuple(dict.fromkeys(x for part in parts for x in part.closed)),
    )


def _names(sources: Sources, key: str, given: Any, of: str) -> tuple[str, ...]:
    values = (given,) if isinstance(given, str) or is_symbol(given) else given
    if not isinstance(values, (list, tuple)):
        raise sources.error("start", key, f"the names of {of} are expected here, not {given!r:.60}")
    names = tuple(map(given_name, values))
    seen: set[str] = set()
    for k, name in enumerate(names):
        if not isinstance(name, str):
            raise sources.error("start", f"{key}[{k}]", f"a name is text, not {name!r:.60}")
        if name in seen:
            raise sources.error("start", f"{key}[{k}]", f"'{name:.60}' is named twice", hint="once is enough")
        seen.add(name)
    return names


def check_start(d: Description, sources: Sources) -> None:
    """Whether the parameters and coordinates that the start names are there, and there is something to do."""
    start = d.start
    if start is None:
        return
    if start.find and not start.equations and not start.is_steady:
        message = f"nothing says what '{start.find[0]}' must be"
        raise sources.error("start", "find", message, hint="add equations, or steady = true")
    moving = {c.name for c in d.coordinates if not c.integral and c.quaternion is None}
    moving |= {r.name for r in d.rates}
    _check_names(sources, "find", start.find, {p.name for p in d.parameters}, "parameter")
    _check_names(sources, "steady", start.steady, moving, "coordinate or state")
    if start.steady and start.everything:
        raise sources.error("start", "steady", "steady is both true and a list", hint="give one of them")


def check_closed(d: Description, sources: Sources) -> None:
    """Whether the stops that the start closes are there, those that limits of joints and contacts make among them."""
    if d.start is not None:
        _check_names(sources, "closed", d.start.closed, {s.name for s in d.stops}, "stop")


def _check_names(
    sources: Sources, key: str, names: tuple[str, ...], known: Collection[str], what: str
) -> None:
    for k, name in enumerate(names):
        if name not in known:
            hint = nearest(name[:60], sorted(known), f"{what}s")
            raise sources.error("start", f"{key}[{k}]", f"there is no {what} '{name:.60}'", hint=hint)
