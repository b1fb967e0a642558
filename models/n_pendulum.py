"""Chain of N point masses on massless rods, released from horizontal; absolute angles from straight down."""

from math import pi

from symgen import Model, cos, sin


def build(N=5, rods=True) -> Model:
    """Describe the chain.

    Parameters
    ----------
    N : int
        Number of links.
    rods : bool
        Whether to draw the rods. They have no mass and do not change the motion.
    """
    model = Model(
        "n_pendulum", description=f"Chain of {N} point masses on massless rods, released from horizontal"
    )
    m, L, g = model.parameters(m="1 kg", L="1 m", g="9.81 m/s^2")
    model.gravity(y=-g)
    x, y = 0, 0
    for i in range(1, N + 1):
        theta = model.coordinate(f"theta{i}", unit="rad", start=pi / 2, rate=0.0)
        previous_x, previous_y = x, y
        x = model.definition(f"x{i}", previous_x + L * sin(theta))
        y = model.definition(f"y{i}", previous_y - L * cos(theta))
        model.body(f"bob{i}", mass=m, com=(x, y), shape={"sphere": ["0.08 m"]})
        if rods:
            centre = ((previous_x + x) / 2, (previous_y + y) / 2)
            model.body(f"rod{i}", mass=0, com=centre, angle=theta - pi / 2, shape={"capsule": ["0.02 m", L]})
    model.run(t_end=5.0, fps=60)
    return model
