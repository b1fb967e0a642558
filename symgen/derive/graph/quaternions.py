"""Unit quaternions (w, x, y, z) on the operation graph: rotation matrices, rates and normalisation."""

from __future__ import annotations

from .graph import Graph
from .vectors import Matrix, Vector


def rotation_matrix(g: Graph, q: Vector) -> Matrix:
    """The rotation of a quaternion, taken as a unit quaternion: from body axes to those of the joint frame."""
    w, x, y, z = q
    x2, y2, z2 = (g.add(u, u) for u in (x, y, z))
    xx, yy, zz = g.mul(x2, x), g.mul(y2, y), g.mul(z2, z)
    xy, xz, yz = g.mul(x2, y), g.mul(x2, z), g.mul(y2, z)
    wx, wy, wz = g.mul(x2, w), g.mul(y2, w), g.mul(z2, w)
    return [
        [g.sub(g.one, g.add(yy, zz)), g.sub(xy, wz), g.add(xz, wy)],
        [g.add(xy, wz), g.sub(g.one, g.add(xx, zz)), g.sub(yz, wx)],
        [g.sub(xz, wy), g.add(yz, wx), g.sub(g.one, g.add(xx, yy))],
    ]


def doubled_rates(g: Graph, q: Vector) -> Matrix:
    """E, 4 x 3, with dq/dt = E ω / 2 for the angular velocity ω in body axes; EᵀE = |q|²."""
    w, x, y, z = q
    return [
        [g.neg(x), g.neg(y), g.neg(z)],
        [w, g.neg(z), y],
        [z, w, g.neg(x)],
        [g.neg(y), x, w],
    ]


def rate(g: Graph, q: Vector, omega: Vector) -> Vector:
    """dq/dt = q ⊗ (0, ω) / 2."""
    half = [g.mul(g.const(0.5), w) for w in omega]
    return [g.dot(row, half) for row in doubled_rates(g, q)]


def normalised(g: Graph, q: Vector) -> Vector:
    """q / |q|."""
    factor = g.div(g.one, g.call("sqrt", g.dot(q, q)))
    return [g.mul(factor, x) for x in q]
