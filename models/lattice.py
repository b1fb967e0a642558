"""Net of N x N masses joined by rigid bars, pinned along one edge: many closed loops in absolute coordinates."""

from symgen import Model


def build(N=10) -> Model:
    """Describe the net, which is released from horizontal and swings down.

    Parameters
    ----------
    N : int
        Masses along each edge.
    """
    model = Model(
        "lattice",
        description=f"Net of {N} x {N} masses and rigid bars, pinned along one edge, released from horizontal",
    )
    m, L, g = model.parameters(m="0.1 kg", L="0.1 m", g="9.81 m/s^2")
    model.gravity(z=-g)
    nodes = {}
    for i in range(N):
        nodes[i, 0] = (L * i, 0, 0)
        for j in range(1, N + 1):
            nodes[i, j] = tuple(
                model.coordinate(f"{axis}{i}_{j}", unit="m", guess=value, rate=0.0)
                for axis, value in zip("xyz", (0.1 * i, 0.1 * j, 0.0), strict=True)
            )
            model.body(f"mass{i}_{j}", mass=m, com=nodes[i, j], shape={"sphere": ["0.02 m"]})
            model.constraint(f"along{i}_{j}", _stretch(nodes[i, j - 1], nodes[i, j], L))
            if i:
                model.constraint(f"across{i}_{j}", _stretch(nodes[i - 1, j], nodes[i, j], L))
    model.run(t_end=2.0, fps=60)
    return model


def _stretch(a, b, length):
    """How much longer than `length` a bar from `a` to `b` is, near that length [m]."""
    squared = sum((end - start) ** 2 for start, end in zip(a, b, strict=True))
    return (squared - length**2) / (2 * length)
