"""Positions, rotations and velocities of the bodies on the graph."""

from __future__ import annotations

from dataclasses import dataclass

from ..model.description import Body, Description
from .differentiate import forward
from .graph import Graph
from .load import Loader

Vector = list[int]
Matrix = list[list[int]]
AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class BodyKinematics:
    """A body's motion; all vectors have three components.

    `rotation` turns body axes into world axes. `omega` is the angular velocity in body axes, None for a point mass.
    `inertia` is the 3 x 3 tensor about the centre of mass in body axes.
    """

    body: Body
    position: Vector
    velocity: Vector
    rotation: Matrix
    omega: Vector | None
    mass: int
    inertia: Matrix | None


def body_kinematics(loader: Loader, description: Description) -> list[BodyKinematics]:
    """Kinematics of all bodies in the order of the description."""
    return [_of_body(loader, body) for body in description.bodies]


def _of_body(loader: Loader, body: Body) -> BodyKinematics:
    g = loader.g
    position = [loader.load(x) for x in body.com]
    position += [g.zero] * (3 - len(position))
    velocity = time_derivative(loader, position)
    steps = [(axis, loader.load(angle)) for axis, angle in body.rotation]
    if body.angle is not None:
        steps = [("z", loader.load(body.angle))]
    rotation, omega = _rotation(loader, steps)
    inertia = _inertia(loader, body)
    return BodyKinematics(
        body=body,
        position=position,
        velocity=velocity,
        rotation=rotation,
        omega=omega if steps else None,
        mass=loader.load(body.mass) if body.mass is not None else g.zero,
        inertia=inertia,
    )


def time_derivative(loader: Loader, nodes: list[int]) -> list[int]:
    """Total time derivatives of functions of q and t; they are remembered as exact derivatives."""
    result = forward(loader.g, nodes, loader.rates)
    loader.exact.update(result)
    return result


def _rotation(loader: Loader, steps: list[tuple[str, int]]) -> tuple[Matrix, Vector]:
    """Rotation matrix of successive body-fixed rotations, and the angular velocity in the last frame.

    With R = R1 R2 … the body-axes velocity obeys w_k = R_kᵀ w_(k-1) + e_k dα_k/dt, which needs far fewer
    operations than the elements of Rᵀ dR/dt.
    """
    g = loader.g
    matrix = [[g.one if i == j else g.zero for j in range(3)] for i in range(3)]
    omega = [g.zero] * 3
    for axis, angle in steps:
        k = AXES[axis]
        i, j = (k + 1) % 3, (k + 2) % 3
        c, s = g.unary("cos", angle), g.unary("sin", angle)
        for row in matrix:
            row[i], row[j] = (
                g.add(g.mul(row[i], c), g.mul(row[j], s)),
                g.sub(g.mul(row[j], c), g.mul(row[i], s)),
            )
        omega[i], omega[j] = (
            g.add(g.mul(omega[i], c), g.mul(omega[j], s)),
            g.sub(g.mul(omega[j], c), g.mul(omega[i], s)),
        )
        omega[k] = g.add(omega[k], time_derivative(loader, [angle])[0])
    return matrix, omega


def _inertia(loader: Loader, body: Body) -> Matrix | None:
    g = loader.g
    values = [loader.load(x) for x in body.inertia]
    if not values:
        return None
    if len(values) == 1:  # planar: only the rotation about z matters
        return [[g.zero] * 3, [g.zero] * 3, [g.zero, g.zero, values[0]]]
    xx, yy, zz, xy, xz, yz = values + [g.zero] * (6 - len(values))
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


def cross(g: Graph, a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return [
        g.sub(g.mul(a[1], b[2]), g.mul(a[2], b[1])),
        g.sub(g.mul(a[2], b[0]), g.mul(a[0], b[2])),
        g.sub(g.mul(a[0], b[1]), g.mul(a[1], b[0])),
    ]


def times(g: Graph, matrix: Matrix, vector: Vector) -> Vector:
    """Matrix times vector."""
    return [g.dot(row, vector) for row in matrix]


def transposed_times(g: Graph, matrix: Matrix, vector: Vector) -> Vector:
    """Transposed matrix times vector."""
    return [g.dot([row[k] for row in matrix], vector) for k in range(3)]
