"""What marks are drawn among: the bodies of the first frame, as they are drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import schema
from .geometry import Primitive


@dataclass(frozen=True)
class Surroundings:
    """What marks are drawn among, as it is at the start.

    Attributes
    ----------
    planar : bool
    index : dict of str to int
        Of each body in the lists.
    primitives, colours, lifts : list
        Of the bodies; by how much each is drawn above the plane [m].
    positions, rotations : ndarray, shape (bodies, 3) [m], (bodies, 3, 3)
    middle : ndarray, shape (3,) [m]
        Of the bodies at the start.
    diagonal : float [m]
        Of the scene.
    """

    planar: bool
    index: dict[str, int]
    primitives: list[Primitive]
    colours: list[tuple[int, int, int]]
    lifts: list[float]
    positions: np.ndarray
    rotations: np.ndarray
    middle: np.ndarray
    diagonal: float

    @classmethod
    def of_bodies(
        cls,
        names: list[str],
        primitives: list[Primitive],
        positions: np.ndarray,
        rotations: np.ndarray,
        diagonal: float,
        planar: bool,
        colours: list[tuple[int, int, int]] | None = None,
        lifts: list[float] | None = None,
    ) -> Surroundings:
        """Return those of the first of some frames: positions, shape (n, bodies, 3), rotations (n, bodies, 3, 3)."""
        n, index = len(names), {name: i for i, name in enumerate(names)}
        colours, lifts = colours or [schema.MARK_COLOURS["gear"]] * n, lifts or [0.0] * n
        middle = positions[0].mean(axis=0)
        return cls(planar, index, primitives, colours, lifts, positions[0], rotations[0], middle, diagonal)

    @property
    def top(self) -> float:
        """How far what is drawn of the bodies stands out of the plane [m]."""
        drawn = zip(self.primitives, self.lifts)
        return max((primitive.half_thickness() + lift for primitive, lift in drawn), default=0.0)

    def in_world(self, body: str, place: np.ndarray) -> np.ndarray:
        """Return a place in a body's axes, or in the world where there is no body, in the world."""
        if not body:
            return place
        return self.positions[self.index[body]] + self.rotations[self.index[body]] @ place

    def rod(self, body: str) -> Primitive | None:
        """Return the primitive of a body that is drawn as a rod."""
        primitive = self.primitives[self.index[body]] if body else None
        return primitive if primitive is not None and primitive.is_rod else None

    def width_at(self, place: np.ndarray) -> float:
        """Return the radius of the rods that a place in space is in [m]."""
        found = 0.0
        for primitive, position, rotation in zip(self.primitives, self.positions, self.rotations):
            core, thickness = primitive.half_box()
            away = np.abs(rotation.T @ (place - position))
            if primitive.is_rod and (away <= core + 1.001 * thickness).all():
                found = max(found, thickness)
        return found

    def thickness_at(self, place: np.ndarray) -> float:
        """Return how far the rods at a place of a planar mechanism stand out of the plane [m].

        Pins in other bodies stay inside: what is far above the plane looks displaced from where it is.
        """
        found = 0.0
        for primitive, position, rotation, lift in zip(
            self.primitives, self.positions, self.rotations, self.lifts
        ):
            if not primitive.is_rod:
                continue
            core, thickness = primitive.half_box()
            away = np.abs(rotation.T @ (place - position))[:2]
            if (away <= core[:2] + 1.001 * thickness).all():
                found = max(found, float(core[2]) + thickness + lift)
        return found
