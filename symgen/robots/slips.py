"""What a URDF file says in words that are read over, and that look like a slip: a letter wrong, angles in degrees.

Parsers of URDF, ours too, pass over elements and attributes that they do not know, since programs add their own. So a
mistyped `xyz` leaves a joint at the origin, and nobody says so.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator

from ..errors import nearest
from .xml_tree import Element

# The elements inside each; those of other programs stand beside them.
_INSIDE = {
    "robot": ("link", "joint", "material", "transmission", "gazebo"),
    "link": ("inertial", "visual", "collision"),
    "inertial": ("origin", "mass", "inertia"),
    "joint": (
        "origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration", "safety_controller",
    ),
}  # fmt: skip
# The attributes of those that hold numbers.
_ATTRIBUTES = {
    "origin": ("xyz", "rpy"),
    "axis": ("xyz",),
    "mass": ("value",),
    "inertia": ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"),
    "limit": ("lower", "upper", "effort", "velocity"),
    "dynamics": ("damping", "friction"),
    "mimic": ("joint", "multiplier", "offset"),
}
_ALIKE = 0.75  # of two names, by difflib
_TURN = 2.0 * math.pi


def slips(root: Element) -> Iterator[str]:
    """Yield a sentence for each word of a `<robot>` element that is read over and looks like a slip."""
    for place in (root, *root.all("link"), *root.all("joint")):
        yield from _elements(place)
        inertial = place.all("inertial") if place.tag == "link" else []
        for inside in inertial:
            yield from _elements(inside)
        for element in (*place.children, *(child for inside in inertial for child in inside.children)):
            yield from _attributes(element)


def _elements(place: Element) -> Iterator[str]:
    known = _INSIDE[place.tag]
    for child in place.children:
        close = difflib.get_close_matches(child.tag.lower(), known, n=1, cutoff=_ALIKE)
        if child.tag not in known and close:
            yield f"line {child.line}: <{child.tag[:40]}> is read over: did you mean <{close[0]}>?"


def _attributes(element: Element) -> Iterator[str]:
    known = _ATTRIBUTES.get(element.tag)
    if known is None:
        return
    for name in element.attributes:
        if name not in known:
            hint = nearest(name[:40], known)
            yield f"line {element.line}: {name[:40]!r} of <{element.tag}> is read over: {hint}"
    if element.tag == "origin":
        angles = element.numbers("rpy", 3, (0.0, 0.0, 0.0))
        if max(map(abs, angles)) > _TURN:
            said = element.attributes["rpy"][:60]
            yield f"line {element.line}: rpy = {said!r} is more than a turn: are these degrees? They are taken as rad"
