"""Rods between point bodies and what holds them: a bob whose distance from a place never changes hangs on a rod.

A model that places a bob by `com = [l*sin(theta), -l*cos(theta)]` does not say that there is a rod. Its distance from
a place in the world, or from another body, is one and the same at arbitrary coordinates, and that says it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import schema, symbols
from .geometry import split_poses
from .marks import GROUND_SIZE, between, hangs_from
from .recording import Quantities

if TYPE_CHECKING:
    from .rrd.write import MarkWriter

_STATES = 8  # arbitrary ones at which distances are compared
_SAME = 1e-9  # of a distance
_ROD = 0.006  # radius, of the scene's diagonal
_MOST_BODIES = 60


@dataclass(frozen=True)
class Tether:
    """A rod from a body to another one, or to a `place` in the world, shape (3,) [m]: `anchor` is -1 then."""

    body: int
    anchor: int
    place: np.ndarray


def tethers(of: Quantities, t: float, y: np.ndarray, taken: Sequence[str] = ()) -> list[Tether]:
    """Return the rods of bodies that are points or balls and do not turn.

    Parameters
    ----------
    of : Quantities
    t : float [s]
    y : ndarray, shape (ny,)
        A state, about which others are chosen.
    taken : sequence of str
        Bodies that are drawn as something else.
    """
    system, bodies = of.system, of.system.bodies
    points = [i for i, x in enumerate(bodies) if x["shape"] in ("", "sphere") and x["name"] not in taken]
    if not points or len(bodies) > _MOST_BODIES or system.quaternions:
        return []
    states = np.tile(y, (_STATES, 1))
    q = states[1:, : system.nq]
    q += np.random.default_rng(0).uniform(-1.0, 1.0, q.shape) * np.maximum(np.abs(q), 1.0)
    positions, rotations = split_poses(of.evaluate("poses", np.full(_STATES, t), states), len(bodies))
    if not np.isfinite(positions).all():
        return []
    rods = [k for k, body in enumerate(bodies) if body["shape"] in ("capsule", "cylinder")]
    found = []
    for i in points:
        if (rotations[:, i] != rotations[0, i]).any():
            continue
        for anchor in (-1, *range(i)):
            foot = positions[:, anchor] if anchor >= 0 else np.tile(_centre(positions[:, i]), (_STATES, 1))
            if _is_rod(positions[:, i] - foot):
                if not any(_lies_between(positions[:, k], foot, positions[:, i]) for k in rods):
                    found.append(Tether(i, anchor, foot[0]))
                break
    return found


def _centre(places: np.ndarray) -> np.ndarray:
    """Return what places, shape (n, 3), are equally far from, if anything is: of a circle's places its middle."""
    middle = places.mean(axis=0)
    away = places - middle
    squares = (away**2).sum(axis=1)
    # |p - c|² is the same for all; the least solution lies in the plane of the places.
    return middle + np.linalg.lstsq(2.0 * (away - away[0]), squares - squares[0], rcond=1e-9)[0]


def _lies_between(places: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether the middle of a body, shape (n, 3) [m], is between two places in all states: it is the rod."""
    along = b - a
    share = np.einsum("ni,ni->n", places - a, along) / np.einsum("ni,ni->n", along, along)
    off = np.linalg.norm(places - a - share[:, None] * along, axis=1)
    return bool(((share > 0.0) & (share < 1.0) & (off <= _SAME * np.linalg.norm(along, axis=1))).all())


def _is_rod(between: np.ndarray) -> bool:
    """Whether vectors, shape (n, 3), are equally long and point to different sides, of a circle about their foot.

    What turns about an axis in space is equally far from all places on it: only the one in its own plane holds it.
    """
    lengths = np.linalg.norm(between, axis=1)
    if not lengths[0] > 0.0 or np.ptp(lengths) > _SAME * lengths[0]:
        return False
    _, sizes, axes = np.linalg.svd(between - between.mean(axis=0))
    if sizes[0] < 0.01 * lengths[0]:
        return False
    in_plane = sizes[2] <= _SAME * sizes[0]
    return bool(not in_plane or np.abs(between @ axes[2]).max() <= _SAME * lengths[0])


def is_held(found: Sequence[Tether]) -> bool:
    """Whether a rod is held by the world."""
    return any(tether.anchor < 0 for tether in found)


class TetherWriter:
    """Draws rods of point bodies.

    Parameters
    ----------
    found : sequence of Tether
    names : sequence of str
        Of the bodies.
    planar : bool
    diagonal : float [m]
        Of the scene.
    """

    def __init__(self, found: Sequence[Tether], names: Sequence[str], planar: bool, diagonal: float):
        self._found, self._names, self._planar, self._diagonal = found, names, planar, diagonal

    def open(self, writer: MarkWriter, positions: np.ndarray) -> None:
        """Write rods, to be stretched, and the supports of those that hang on the world.

        Parameters
        ----------
        positions : ndarray, shape (bodies, 3) [m]
            At the start.
        """
        for tether in self._found:
            unit = np.array([0.0, 0.0, 1.0])
            colour = schema.MARK_COLOURS["link"]
            writer.rod(self._path(tether), np.zeros(3), unit, _ROD * self._diagonal, colour)
        for tether in self._found:
            if tether.anchor < 0:
                above = hangs_from(tether.place, positions.mean(axis=0), self._planar, self._diagonal)
                lines = symbols.support(tether.place, GROUND_SIZE * self._diagonal, self._planar, above)
                where = f"{schema.GROUND}/{self._names[tether.body]}"
                writer.lines(where, lines, schema.MARK_COLOURS["ground"])

    def frames(self, writer: MarkWriter, positions: np.ndarray) -> None:
        """Write where rods are: `positions` of the bodies have shape (n, bodies, 3) [m]."""
        for tether in self._found:
            foot = np.tile(tether.place, (len(positions), 1))
            foot = positions[:, tether.anchor] if tether.anchor >= 0 else foot
            writer.moves(self._path(tether), *between(foot, positions[:, tether.body]))

    def _path(self, tether: Tether) -> str:
        return f"{schema.LINKS}/{self._names[tether.body]}"
