"""N four-bar windows in a row: parallel rockers of equal length, joined by couplers, turn together."""

from math import pi

from symgen import Model, cos, sin


def build(N=10, angle=pi / 2, rate=-1.0) -> Model:
    """Describe the mechanism, problem A02 of the IFToMM benchmark.

    It has one freedom and 2 N constraints, which depend on each other wherever all bars lie on the base: each of the N
    loops could leave the parallelogram there. Started upright it passes there twice in a turn; let go at a negative
    angle it swings below the base.

    Parameters
    ----------
    N : int
        Number of windows.
    angle : float [rad]
        Of the rockers at the start, from the base.
    rate : float [rad/s]
        Of the rockers at the start.
    """
    model = Model(
        "n_four_bar", description=f"{N} four-bar windows in a row, parallel rockers that turn together"
    )
    m, L, g = model.parameters(m="1 kg", L="1 m", g="9.81 m/s^2")
    model.gravity(y=-g)
    inertia, shape = m * L**2 / 12, {"capsule": ["0.02 m", L]}
    previous_x, previous_y = None, None
    for k in range(N + 1):
        guided = {"start": angle, "rate": rate} if k == 0 else {"guess": angle, "rate_guess": rate}
        rocker = model.coordinate(f"rocker{k}", unit="rad", **guided)
        x, y = k * L + L * cos(rocker), L * sin(rocker)
        centre = (k * L + L / 2 * cos(rocker), L / 2 * sin(rocker))
        model.body(f"rocker_bar{k}", mass=m, inertia=inertia, com=centre, angle=rocker, shape=shape)
        if k > 0:
            coupler = model.coordinate(f"coupler{k}", unit="rad", guess=0.0)
            centre = (previous_x + L / 2 * cos(coupler), previous_y + L / 2 * sin(coupler))
            model.body(f"coupler_bar{k}", mass=m, inertia=inertia, com=centre, angle=coupler, shape=shape)
            model.constraint(f"loop{k}_x", previous_x + L * cos(coupler) - x)
            model.constraint(f"loop{k}_y", previous_y + L * sin(coupler) - y)
        previous_x, previous_y = x, y
    model.run(t_end=10.0, fps=60)
    return model
