"""Field of independent pendulums side by side, each with its own length: one set of equations serves them all."""

from math import ceil, sqrt

from symgen import Model, cos, dot, sin


def build(n=25, equal=False, stiff=False) -> Model:
    """Describe the field.

    Parameters
    ----------
    n : int
        Number of pendulums.
    equal : bool
        Whether all have the same length; otherwise each makes one swing more in the time of the longest's 20.
    stiff : bool
        Whether the last one hangs in a fluid so viscous that rates of its angle die out within a microsecond.
    """
    model = Model(
        "pendulum_field", description=f"{n} independent pendulums side by side, each with its own length"
    )
    m, g = model.parameters(m="0.1 kg", g="9.81 m/s^2")
    model.gravity(y=-g)
    columns = ceil(sqrt(n))
    for k in range(n):
        length = 0.5 if equal else 0.5 / (1 + k / 20) ** 2
        l = model.parameter(f"l{k + 1}", length, unit="m", doc="length")
        x = model.parameter(f"x{k + 1}", 0.3 * (k % columns), unit="m", doc="place of the pivot")
        z = model.parameter(f"z{k + 1}", -0.3 * (k // columns), unit="m")
        theta = model.coordinate(f"theta{k + 1}", unit="rad", start=0.3, rate=0.0)
        bob = (x + l * sin(theta), -l * cos(theta), z)
        if stiff and k == n - 1:
            model.dissipation(model.parameter("rate", "1e6 1/s") * m * l**2 * dot(theta) ** 2 / 2)
        model.body(f"bob{k + 1}", mass=m, com=bob, shape={"sphere": ["0.04 m"]})
    model.run(t_end=28.4, fps=60)
    return model
