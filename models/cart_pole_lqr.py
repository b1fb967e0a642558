"""Pole on a cart that a linear-quadratic regulator balances: it stands up from 10 degrees."""

import numpy as np

from symgen import Model, cos, dot, sin

WEIGHTS = (1.0, 10.0, 1.0, 1.0)  # of x [m], theta [rad] and their rates, squared
FORCE_WEIGHT = 0.1
PERIOD = 0.01  # of the controller [s]


def build() -> Model:
    """Describe the cart and the pole; the force on the cart is an input."""
    model = Model("cart_pole_lqr", description="Pole on a cart, balanced by a linear-quadratic regulator")
    M, mp, l, b, g = model.parameters(M="1 kg", mp="0.1 kg", l="0.5 m", b="0.1 N*s/m", g="9.81 m/s^2")
    model.gravity(y=-g)
    x = model.coordinate("x", unit="m", start=0.0, rate=0.0)
    theta = model.coordinate("theta", unit="rad", start="10 deg", rate=0.0)  # from upright, clockwise
    F = model.input("F", unit="N")
    model.force(x, F - b * dot(x))
    bob = (x + l * sin(theta), l * cos(theta))
    model.body("cart", mass=M, com=(x, 0), shape={"box": ["0.4 m", "0.15 m", "0.2 m"]})
    model.body("bob", mass=mp, com=bob, shape={"sphere": ["0.05 m"]})
    rod = {"capsule": ["0.012 m", l]}
    model.body("pole", mass=0, com=((x + bob[0]) / 2, bob[1] / 2), angle=np.pi / 2 - theta, shape=rod)
    model.draw("rail", rail=[("-0.8 m", "-0.075 m"), ("0.8 m", "-0.075 m")])
    model.draw("push", force=[(x, 0), (F, 0)])
    model.output("tip_height", l * cos(theta))
    model.run(t_end=8.0, fps=60)
    return model


def control(system, parameters):
    """Return the controller of F: feedback of the state about the upright equilibrium.

    Parameters
    ----------
    system : symgen.runtime.System
    parameters : dict of str to float
        Those that are not as the model has them.
    """
    from symgen.runtime.inputs import Controller

    gains = regulator(system, parameters)
    return {"F": Controller(lambda t, state: -gains @ state, period=PERIOD)}


def regulator(system, parameters):
    """Return the gains that minimise the integral of weighted squares of state and force.

    K = R⁻¹ Bᵀ P, with P from the algebraic Riccati equation: Anderson and Moore, Optimal Control (1990), section 3.1.
    """
    from scipy.linalg import solve_continuous_are

    linear = system.linearise(start={"theta": 0.0}, parameters=parameters)
    riccati = solve_continuous_are(linear.A, linear.B, np.diag(WEIGHTS), np.diag([FORCE_WEIGHT]))
    return (linear.B.T @ riccati)[0] / FORCE_WEIGHT
