"""The marks that a module's header lists: what each is, and where in a recording it lies."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass

from . import schema

_MOST_REACTIONS = 12  # arrows that are written

FOLDERS = {
    "pin": schema.JOINTS, "slide": schema.JOINTS, "ball": schema.JOINTS, "point": schema.POINTS,
    "gear": schema.GEARS, "ground": schema.GROUND, "rail": schema.GROUND, "spring": schema.SPRINGS,
    "damper": schema.SPRINGS, "link": schema.LINKS, "bar": schema.LINKS, "force": schema.FORCES,
    "torque": schema.FORCES, "reaction": schema.REACTIONS, "tension": schema.REACTIONS,
    "plane": schema.GROUND, "surface": schema.GROUND,
}  # fmt: skip
STRETCHED = ("spring", "damper", "link", "rail")  # between two places
ARROWS = ("force", "torque", "reaction", "tension")
HINGES = ("pin", "slide")


@dataclass(frozen=True)
class Mark:
    """A record of the header: `columns` are its numbers in what the function `marks` writes."""

    kind: str
    name: str
    body: str
    columns: slice
    moves: bool
    constraints: tuple[int, ...]
    signs: tuple[int, ...]
    carries: tuple[str, ...] = ()

    @property
    def path(self) -> str:
        """Where it lies in a recording."""
        return f"{FOLDERS[self.kind]}/{self.name}"

    @property
    def peers(self) -> str:
        """What an arrow is drawn in proportion to: forces on the mechanism, torques, forces of constraints."""
        return "torque" if self.kind == "torque" else FOLDERS[self.kind]


def read_marks(records: list[dict]) -> list[Mark]:
    """The records with their columns; of marks that would lie at one path, later ones get a number."""
    ends = [0, *itertools.accumulate(record["numbers"] for record in records)]
    met: Counter[tuple[str, str]] = Counter()
    result = []
    for record, place in zip(records, itertools.pairwise(ends)):
        kind, name = record["kind"], record["name"]
        met[FOLDERS[kind], name] += 1
        count = met[FOLDERS[kind], name]
        held = (tuple(record.get(key, ())) for key in ("constraints", "signs", "carries"))
        name = name if count == 1 else f"{name}_{count}"
        result.append(Mark(kind, name, record["body"], slice(*place), record.get("moves", False), *held))
    reactions = [mark for mark in result if FOLDERS[mark.kind] == schema.REACTIONS]
    return [mark for mark in result if mark not in reactions[_MOST_REACTIONS:]]
