"""Planar chain of N rods in absolute coordinates: position and angle of each rod, a pin at each joint."""

from math import pi

from symgen import Model


def build(N=20) -> Model:
    """Describe the chain, which hangs from a fixed point and is released from horizontal.

    It is written in text: of 10 000 rods, SymPy's expressions would take longer than all that follows.

    Three coordinates and two constraints a rod are many more unknowns than N relative angles, but the cost of an
    evaluation grows with N, not with its cube.

    Parameters
    ----------
    N : int
        Number of rods.
    """
    model = Model(
        "chain_absolute",
        description=f"Chain of {N} pinned rods in absolute coordinates, released from horizontal",
    ).in_text()
    model.parameters(m="1 kg", L="0.2 m", g="9.81 m/s^2")
    model.gravity(y="-g")
    end_x, end_y = "", ""
    for k in range(1, N + 1):
        x = model.coordinate(f"x{k}", unit="m", guess=0.2 * (k - 0.5), rate=0.0)
        y = model.coordinate(f"y{k}", unit="m", guess=0.0, rate=0.0)
        theta = model.coordinate(f"theta{k}", unit="rad", start=pi / 2, rate=0.0)
        half_x, half_y = f"L/2*sin({theta})", f"L/2*cos({theta})"
        model.body(
            f"rod{k}",
            mass="m",
            inertia="m*L^2/12",
            com=(x, y),
            angle=f"{theta} - {pi / 2}",
            shape={"capsule": ["0.02 m", "L"]},
        )
        model.constraint(f"pin{k}_x", f"{x} - {half_x}{end_x}")
        model.constraint(f"pin{k}_y", f"{y} + {half_y}{end_y}")
        end_x, end_y = f" - {x} - {half_x}", f" - {y} + {half_y}"
    model.run(t_end=2.0, fps=60)
    return model
