"""Surfaces of solids as triangles, for bodies that are made of several, or of ones that viewers do not have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symgen.runtime.abi import SOLIDS

_PLACE = 9  # numbers: middle, first and third axis
_ROUND = 32  # corners of a circle
_ARC = 8  # parts of a quarter of one, from pole to equator


@dataclass(frozen=True)
class Surface:
    """A closed surface: `vertices`, shape (n, 3) [m], and `triangles`, shape (m, 3), seen counterclockwise."""

    vertices: np.ndarray
    triangles: np.ndarray


def surfaces(kinds: list[str], numbers: np.ndarray) -> list[Surface]:
    """Return the surfaces of a body's solids in body axes.

    Parameters
    ----------
    kinds : list of str
    numbers : ndarray
        Of each its sizes, middle, first and third axis.
    """
    result, start = [], 0
    for kind in kinds:
        own, start = numbers[start : start + SOLIDS[kind]], start + SOLIDS[kind]
        sizes, place = own[:-_PLACE], own[-_PLACE:]
        middle, first, third = place.reshape(3, 3)
        axes = np.stack([first, np.cross(third, first), third])
        about = surface(kind, sizes)
        result.append(Surface(middle + about.vertices @ axes, about.triangles))
    return result


def surface(kind: str, sizes: np.ndarray) -> Surface:
    """Return the surface of one solid about its middle, in its own axes; what is round turns about z."""
    if kind == "box":
        corners = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3, indexing="ij")).reshape(3, -1).T * sizes
        sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
        return Surface(corners, np.concatenate([sides[:, :3], sides[:, [0, 2, 3]]]))
    angle = 0.5 * np.pi * np.arange(-_ARC, _ARC + 1) / _ARC
    ball = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if kind == "sphere":
        return _turned(ball * sizes[0])
    if kind == "ellipsoid":
        round_ = _turned(ball)
        return Surface(round_.vertices * sizes, round_.triangles)
    if kind == "capsule":
        radius, length = sizes
        lower, upper, apart = ball[: _ARC + 1] * radius, ball[_ARC:] * radius, np.array([0.0, length / 2])
        return _turned(np.concatenate([lower - apart, upper + apart]))
    half = sizes[-1] / 2
    if kind == "tube":
        outer, inner = sizes[:2]
        ring = [[inner, -half], [outer, -half], [outer, half], [inner, half], [inner, -half]]
        return _turned(np.array(ring))
    top = sizes[0] if kind == "cylinder" else 0.0
    return _turned(np.array([[0.0, -half], [sizes[0], -half], [top, half], [0.0, half]]))


def _turned(profile: np.ndarray) -> Surface:
    """The surface that a line of points (distance from the axis, height), shape (k, 2), makes when it turns about z."""
    angle = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    rings = [
        np.stack([r * np.cos(angle), r * np.sin(angle), np.full(_ROUND, height)], axis=1)
        for r, height in profile
    ]
    here, after = np.arange(_ROUND), (np.arange(_ROUND) + 1) % _ROUND
    triangles = []
    for k in range(len(profile) - 1):
        low, high = k * _ROUND, (k + 1) * _ROUND
        triangles.append(np.stack([low + here, low + after, high + after], axis=1))
        triangles.append(np.stack([low + here, high + after, high + here], axis=1))
    return Surface(np.concatenate(rings), np.concatenate(triangles))
