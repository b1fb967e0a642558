"""What `symgen show` prints of joints, points, axes, ready-made constraints and drawings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    import sympy

    from symgen.model.description import Description, Joint

    Show = Callable[[sympy.Expr], str]


def section(title: str, rows: list[tuple[str, ...]]) -> list[str]:
    """A titled table; nothing where it has no rows."""
    if not rows:
        return []
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows]
    return [title, *lines, ""]


def mechanism(d: Description, show: Show) -> list[str]:
    """The sections of joints, points, axes, ready-made constraints and drawings."""

    def fixed(elements: Any, vector: str, at: str) -> list[tuple[str, ...]]:
        return [
            (x.name, f"in {x.body}", f"{at} ({', '.join(map(show, getattr(x, vector)))})") for x in elements
        ]

    joints = [(j.name, j.type, f"{j.parent} -> {j.child}", _joint(j, show)) for j in d.joints]
    loops = [(x.name, x.kind, _arguments(x.arguments, show)) for x in d.loops]
    drawn = [(x.name, x.kind, _places(x.vectors, show)) for x in d.drawings]
    return [
        *section("joints", joints),
        *section("points", fixed(d.points, "at", "at")),
        *section("axes", fixed(d.axes, "direction", "along")),
        *section("ready-made constraints (their equations are among the constraints)", loops),
        *section("drawn", drawn),
    ]


def _places(vectors: tuple[tuple[sympy.Expr, ...], ...], show: Show) -> str:
    return ", ".join(f"({', '.join(map(show, vector))})" for vector in vectors)


def _joint(j: Joint, show: Show) -> str:
    parts = (
        [f"coordinate{'s' * (len(j.coordinates) > 1)} {', '.join(j.coordinates)}"] if j.coordinates else []
    )
    if any(x != 0 for x in j.xyz):
        parts.append(f"at ({', '.join(map(show, j.xyz))})")
    if any(x != 0 for x in j.rpy):
        parts.append(f"rpy ({', '.join(map(show, j.rpy))})")
    parts += [f"axis ({', '.join(f'{x:.10g}' for x in axis)})" for axis in (j.axis, j.axis2) if axis]
    for key in ("stiffness", "rest", "damping", "armature", "limits"):
        if getattr(j, key):
            parts.append(f"{key} {', '.join(map(show, getattr(j, key)))}")
    return ", ".join(parts)


def _arguments(arguments: tuple[tuple[str, Any], ...], show: Show) -> str:
    def text(value: Any) -> str:
        if isinstance(value, tuple):
            return f"({', '.join(map(text, value))})"
        if isinstance(value, float):
            return f"{value:.10g}"
        return value if isinstance(value, str) else show(value)

    return ", ".join(f"{key} {text(value)}" for key, value in arguments)
