"""What a store of members says of itself: made from a plan, read from a stranger's file, and held against a plan."""

from __future__ import annotations

import json
import os
import re
import secrets
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symgen.runtime.ensemble import digests
from symgen.runtime.ensemble.identity import identity, refuse_another
from symgen.runtime.ensemble.sampling import named_beside
from symgen.runtime.ensemble.verdict import VERDICTS
from symgen.runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from symgen.runtime.ensemble.plan import Plan

FORMAT = 2
ABOUT = "symgen"  # the group's attribute
TIMES, MORE = "t", "more"
_LARGEST_FILE = 16 << 20  # bytes
_LARGEST_CHUNK = 1 << 30
_MOST_MEMBERS, _MOST_TIMES = 1 << 48, 1 << 24
_LARGEST_NUMBER = 1e300  # JSON has whole numbers that no float holds
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_().]{0,199}\Z")
# Entries that follow from the plan; `choice` is where the plan has its own from.
_OF_PLAN = ("model", "method", "n", "n_times", "shape", "series", "varied", "t_end", "rtol", "atol")


class StoreError(RuntimeModelError):
    """A store cannot be read or written; the message says which part, why, and what to do."""


class Unfit(ValueError):
    """A part of a store is not what this program writes; the message says which."""


def make_about(plan: Plan, series: Sequence[str], chunk: int) -> dict[str, Any]:
    """Return what a new store says of itself.

    Raises
    ------
    StoreError
        Something that is kept has a name that a store has for itself.
    """
    varied = [*named_beside({c.name: None for c in plan.members.columns}, series)]
    taken = sorted({*series, *varied} & {*VERDICTS, TIMES, MORE})
    wrong = taken or [name for name in (*series, *varied) if not _NAME.match(name)]
    if wrong:
        raise StoreError(f"a store of members has names of its own: {', '.join(wrong)} cannot be kept")
    about = {
        "format": FORMAT, "token": secrets.token_hex(16), **_of_plan(plan, series), "chunk": chunk,
        "notes": plan.notes, "identity": identity(plan), "choice": plan.choice.to_json() if plan.choice else None,
    }  # fmt: skip
    return {**about, digests.DIGEST: digests.of_about(about)}


def _of_plan(plan: Plan, series: Sequence[str]) -> dict[str, Any]:
    single = plan.single
    varied = named_beside({c.name: None for c in plan.members.columns}, series)
    values = (
        plan.system.name, plan.method, plan.members.n, len(plan.frame_times), plan.members.shape, list(series),
        list(varied), single.t_end, single.rtol, single.atol,
    )  # fmt: skip
    return dict(zip(_OF_PLAN, values, strict=True))


def refuse_another_store(about: dict[str, Any], plan: Plan, series: Sequence[str], where: str) -> None:
    """Refuse to go on with another ensemble, see `identity.refuse_another`, and with a store that contradicts its own.

    Raises
    ------
    RuntimeModelError
        Names what differs.
    """
    refuse_another(plan, about["identity"], where)
    differs = [name for name, value in _of_plan(plan, series).items() if about[name] != value]
    if differs:
        raise StoreError(
            f"{where} contradicts itself: it is of this ensemble, but its {', '.join(differs)} "
            f"{'is' if len(differs) == 1 else 'are'} of another: begin anew with another file"
        )


def read_about(path: Path) -> dict[str, Any]:
    """Read what a store says of itself, and check it.

    Raises
    ------
    Unfit, OSError, ValueError
        It is not what this program writes.
    """
    whole = read_description(path, "zarr.json")
    attributes = whole.get("attributes") if isinstance(whole, dict) else None
    about = attributes.get(ABOUT) if isinstance(attributes, dict) else None
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise Unfit("it was not written by symgen, or by another version")
    sizes = {"n": _MOST_MEMBERS, "chunk": _MOST_MEMBERS, "n_times": _MOST_TIMES}
    for name, most in sizes.items():
        if type(about.get(name)) is not int or not (0 if name == "n_times" else 1) <= about[name] <= most:
            raise Unfit(f"its {name} makes no sense")
    if about["chunk"] * max(about["n_times"], 1) * 8 > _LARGEST_CHUNK:
        raise Unfit("its chunks are larger than any that are written")
    check_common(about, (*VERDICTS, TIMES, MORE))
    if about.get(digests.DIGEST) != digests.of_about(about):
        raise Unfit("what its zarr.json says was changed after it was written")
    return about


def check_common(about: dict[str, Any], own_names: Sequence[str]) -> None:
    """Check what stores and files of members both say of themselves.

    Parameters
    ----------
    own_names : sequence of str
        That what is kept cannot have.

    Raises
    ------
    Unfit
        Something makes no sense.
    """
    for name in ("series", "varied", "notes"):
        if not isinstance(about.get(name), list) or not all(isinstance(x, str) for x in about[name]):
            raise Unfit(f"its list of {name} makes no sense")
    names = (*about["series"], *about["varied"])
    for name in names:
        if not _NAME.match(name) or name in own_names:
            raise Unfit(f"it has the name {name[:60]!r}")
    if len(set(names)) < len(names):
        raise Unfit("it has a name twice")
    for name in ("t_end", "rtol", "atol"):
        if type(about.get(name)) not in (int, float) or not abs(about[name]) < _LARGEST_NUMBER:
            raise Unfit(f"its {name} makes no sense")
    texts = all(isinstance(about.get(name), str) for name in ("model", "method"))
    if not texts or not isinstance(about.get("identity"), dict):
        raise Unfit("it does not say what it is of")
    shape = about.get("shape")
    if not isinstance(shape, dict) or not all(type(count) is int for count in shape.values()):
        raise Unfit("it does not say how members are laid out")


def read_description(path: Path, name: str) -> Any:
    """Read a `zarr.json`: a plain file, of some size at most.

    Raises
    ------
    Unfit, OSError, ValueError
        It is something else.
    """
    file = path / name
    found = os.stat(file)
    if not stat.S_ISREG(found.st_mode) or found.st_size > _LARGEST_FILE:
        raise Unfit(f"{name} is no plain file, or too large")
    return json.loads(file.read_text(encoding="utf-8"))
