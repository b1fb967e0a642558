"""Lattice of masses in the plane, joined by stiff, damped bushings and hung up along one edge: a large stiff model."""

from symgen import Model, dot, sqrt


def build(N=10) -> Model:
    """Describe the lattice, which is released without strain and sags.

    Parameters
    ----------
    N : int
        Masses along each edge; those of the first row do not move.
    """
    model = Model("bushing_lattice", description=f"Lattice of {N} x {N} masses on stiff bushings")
    m, L, k, c, g = model.parameters(m="0.5 kg", L="0.2 m", k="1e6 N/m", c="2000 N*s/m", g="9.81 m/s^2")
    model.gravity(y=-g)
    nodes = {(0, j): (L * j, 0) for j in range(N)}
    for i in range(1, N):
        for j in range(N):
            x = model.coordinate(f"x{i}_{j}", unit="m", start=0.2 * j, rate=0.0)
            y = model.coordinate(f"y{i}_{j}", unit="m", start=-0.2 * i, rate=0.0)
            model.body(f"mass{i}_{j}", mass=m, com=(x, y), shape={"sphere": ["0.02 m"]})
            nodes[i, j] = x, y
    for i, j in nodes:
        for direction, other in (("down", (i + 1, j)), ("right", (i, j + 1))):
            if other in nodes and other[0]:
                (x0, y0), (x1, y1) = nodes[i, j], nodes[other]
                length = model.definition(f"{direction}{i}_{j}", sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2))
                model.potential(k / 2 * (length - L) ** 2)
                model.dissipation(c / 2 * dot(length) ** 2)
    model.run(t_end=1.0, fps=60)
    return model
