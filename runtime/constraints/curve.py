"""The positions of a mechanism of one freedom as a curve through a singular configuration, and how it bends there.

It is a polynomial through places on both sides, along the tangents there (Hermite's), in Newton's form, which is found
once a passage. The way x along it is 0 at its centre, and about 1 from one place to the next.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted

PLACES = 6  # -3 to 3 without 0; the inner ones first
INNER_PLACES = 4
FARTHEST = 2.0  # as far along it as it is followed


class Curve(NamedTuple):
    """Parts of an array of `curve_size` numbers, which the guard carries from call to call.

    Attributes
    ----------
    known : ndarray, shape (1,)
        Whether the rest says anything: 1 or 0.
    root : ndarray, shape (2,)
        The root of the pivot ratio at x = 0, negative before the singular configuration, and by how much it rises
        with x.
    functional : ndarray, shape (nq,)
        Its product with q - `centre` is x.
    centre : ndarray, shape (nq,)
    nodes : ndarray, shape (2 PLACES,)
        x at the places, each of them twice.
    coefficients : ndarray, shape (2 PLACES, nq)
        Of q - `centre`. Before `fit`, q - `centre` and dq/dx at each place, one below the other.
    """

    known: np.ndarray
    root: np.ndarray
    functional: np.ndarray
    centre: np.ndarray
    nodes: np.ndarray
    coefficients: np.ndarray


def curve_size(nq: int) -> int:
    """Return the length of the array of a curve."""
    return 3 + 2 * nq + 2 * PLACES * (1 + nq)


@jitted
def curve_in(array, nq):
    """An array in its parts."""
    known, root, array = array[:1], array[1:3], array[3:]
    functional, centre, rest = array[:nq], array[nq : 2 * nq], array[2 * nq :]
    nodes, coefficients = rest[: 2 * PLACES], rest[2 * PLACES :][: 2 * PLACES * nq]
    return Curve(known, root, functional, centre, nodes, coefficients.reshape((2 * PLACES, nq)))


@jitted
def fit(curve):
    """Replace places and tangents by divided differences, where two places that are one have the tangent for theirs."""
    c, x, n, nq = curve.coefficients, curve.nodes, 2 * PLACES, curve.centre.shape[0]
    for j in range(n - 2, 0, -2):  # what is odd is a tangent already
        for i in range(nq):
            c[j, i] = (c[j, i] - c[j - 2, i]) / (x[j] - x[j - 2])
    for order in range(2, n):
        for j in range(n - 1, order - 1, -1):
            for i in range(nq):
                c[j, i] = (c[j, i] - c[j - 1, i]) / (x[j] - x[j - order])


@jitted
def follow(curve, n_places, x, q, tangent, bend):
    """Write q, dq/dx and d²q/dx² at x, as some of the places tell, the first ones."""
    c, nodes, n, nq = curve.coefficients, curve.nodes, 2 * n_places, curve.centre.shape[0]
    for i in range(nq):
        q[i], tangent[i], bend[i] = c[n - 1, i], 0.0, 0.0
    for j in range(n - 2, -1, -1):
        way = x - nodes[j]
        for i in range(nq):
            bend[i] = bend[i] * way + 2.0 * tangent[i]
            tangent[i] = tangent[i] * way + q[i]
            q[i] = q[i] * way + c[j, i]
    for i in range(nq):
        q[i] += curve.centre[i]
