"""Heavy chain of N point masses on stiff, damped springs in the plane, one end held, falling from horizontal."""

from symgen import Model, dot, sqrt


def build(N=10) -> Model:
    """Describe the chain of `N` masses in Cartesian coordinates; the springs are slack at the start."""
    model = Model(
        "spring_chain", description=f"Heavy chain of {N} masses on stiff springs, falling from horizontal"
    )
    m, l, k, c, g = model.parameters(
        m={"value": 0.5, "unit": "kg", "doc": "each mass"},
        l={"value": 0.2, "unit": "m", "doc": "slack length of each spring"},
        k={"value": 1e5, "unit": "N/m", "doc": "stiffness of each spring"},
        c={"value": 20.0, "unit": "N*s/m", "doc": "damping of each spring"},
        g="9.81 m/s^2",
    )
    model.gravity(y=-g)
    x, y = 0, 0
    for i in range(1, N + 1):
        previous_x, previous_y = x, y
        x = model.coordinate(f"x{i}", unit="m", start=0.2 * i, rate=0.0)
        y = model.coordinate(f"y{i}", unit="m", start=0.0, rate=0.0)
        dx, dy = x - previous_x, y - previous_y
        length = model.definition(f"length{i}", sqrt(dx**2 + dy**2))
        model.potential(k / 2 * (length - l) ** 2)
        model.dissipation(c / 2 * dot(length) ** 2)
        model.body(f"mass{i}", mass=m, com=(x, y), shape={"sphere": ["0.04 m"]})
        model.draw(f"spring{i}", spring=[(previous_x, previous_y), (x, y)])
    model.draw("hook", ground=(0, 0))
    model.run(t_end=3.0, fps=60)
    return model
