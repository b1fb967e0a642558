"""Springs over angles that jump: those that sensors tell from directions, which forget whole turns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from . import algebra
from .description import Description, Winding

_JUMPING = (algebra.atan2, algebra.asin, algebra.acos)


def windings_of_springs(d: Description) -> Iterator[Winding]:
    """Yield the springs that push back over angles that jump or turn back where they are wound up too far.

    A coordinate counts its turns. An angle that is made of directions does not: a relative angle of bodies or axes, or
    one that the model writes with `atan2`.
    """
    definitions = dict(d.definitions)
    for spring in d.springs:
        if spring.angle is None or (spring.stiffness is None and spring.curve is None):
            continue
        angles = tuple(dict.fromkeys(_jumping(spring.angle, definitions)))
        if angles:
            yield Winding(spring.name, "spring", angles)


def _jumping(angle: algebra.Expr, definitions: Mapping[str, algebra.Expr]) -> Iterator[algebra.Expr]:
    """Yield the terms of a sum that jump, through definitions too; sines and cosines of such do not."""
    stack = [angle]
    while stack:
        e = stack.pop()
        if isinstance(e, _JUMPING):
            yield e
        elif isinstance(e, algebra.Symbol):
            stack += [definitions[e.name]] if e.name in definitions else []
        elif isinstance(e, (algebra.Add, algebra.Mul)):
            stack += e.args
