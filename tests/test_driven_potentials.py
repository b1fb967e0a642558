"""Inputs in the potential energy: their forces against those written out, their work in the energy balance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen import Model
from symgen.errors import ModelError
from symgen.runtime.batches import evaluate


def ended(potential: str, **more) -> Model:
    """A mass on a spring whose other end is an input."""
    m = Model("ended")
    x = m.coordinate("x", unit="m", start=0.1)
    m.parameter("k", "50 N/m")
    m.input("u", unit="m", table=[[0, 1, 2], [0, 0.2, 0.1]])
    m.body("b", mass="2 kg", com=(x, 0))
    m.definition("s", "x - u")
    m.potential(potential)
    return m


@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor", "gauss4"])
def test_the_end_of_a_spring_is_driven_by_an_input(method):
    steps = {"step": 1e-3} if method == "gauss4" else {"rtol": 1e-9}
    run = ended("k*s^2/2 + 20*k*x^2").derive().run(t_end=2.0, method=method, **steps)

    def motion(t, y):
        u = np.interp(t, [0, 1, 2], [0, 0.2, 0.1])
        return [y[1], (-50 * (y[0] - u) - 2000 * y[0]) / 2]

    halves = [solve_ivp(motion, (0, 1), [0.1, 0.0], rtol=1e-11, atol=1e-13)]
    halves.append(solve_ivp(motion, (1, 2), halves[0].y[:, -1], rtol=1e-11, atol=1e-13))
    far = 2e-5 if method == "gauss4" else 1e-7
    assert run["x"][-1] == pytest.approx(halves[1].y[0, -1], abs=far)
    assert all(check.ok for check in run.health), run.health


def test_terms_without_inputs_stay_energy():
    system = ended("k*s^2/2 + 20*k*x^2").derive()
    p = system.parameter_values()
    found = evaluate(system, "energy", p, np.zeros(1), np.array([[0.3, 0.0]]))[0]
    assert found.tolist() == pytest.approx([0.0, 20 * 50 * 0.09])
    assert not system.structure["conservative"]


def test_an_input_turns_a_ball_as_the_gradient_says():
    """A field along an axis of a body on a spherical joint: torque e x u, by the input's strength."""
    m = Model("compass")
    m.input("u", unit="N*m", default=0.7)
    m.body("needle", mass=1, inertia=(0.2, 0.3, 0.4))
    m.joint("ball", "spherical", "needle")
    m.axis("north", "needle", (1, 0, 0))
    m.potential("-u*north_y")
    q = np.array([0.8, 0.2, -0.4, 0.4])
    q /= np.linalg.norm(q)
    system = m.derive()
    found = evaluate(system, "forces", system.parameter_values(), np.zeros(1), np.array([[*q, 0, 0, 0]]))[0]
    w, x, y, z = q
    to_world = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    assert found == pytest.approx(0.7 * np.cross([1, 0, 0], to_world.T @ [0, 1, 0]), rel=1e-12)


def test_rates_have_no_place_in_it():
    with pytest.raises(ModelError, match="the potential energy cannot depend on a rate"):
        ended("k*s*dot(x)").describe()
