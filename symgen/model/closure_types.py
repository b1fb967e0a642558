"""What kinds of joints close loops, and what each of them holds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ClosureType:
    """What a closure of a type holds.

    Attributes
    ----------
    place : str
        Of the second frame's origin: "one" with the first, on the "line" along its axis, or in the "plane" across it.
    turn : str
        "axis": the axes stay parallel; "all": the frames do not turn against each other; "cross": the axis of the first
        and the second axis in the second stay at right angles; or nothing.
    moves : str
        What is left where that is one motion: "turn" about the axis or "slide" along it; "screw": both.
    axes : int
        How many axes it has.
    in_plane : bool
        Whether it may join planar bodies.
    """

    place: str
    turn: str
    moves: str = ""
    axes: int = 1
    in_plane: bool = False


_HINGE = ClosureType("one", "axis", "turn", in_plane=True)
CLOSURES = {
    "revolute": _HINGE,
    "continuous": _HINGE,
    "prismatic": ClosureType("line", "all", "slide", in_plane=True),
    "screw": ClosureType("line", "axis", "screw"),
    "universal": ClosureType("one", "cross", axes=2),
    "cylindrical": ClosureType("line", "axis"),
    "planar": ClosureType("plane", "axis"),
    "spherical": ClosureType("one", "", axes=0),
    "fixed": ClosureType("one", "all", axes=0, in_plane=True),
}
