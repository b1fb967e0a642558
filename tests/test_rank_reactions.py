"""Reactions and their signs by textbook statics, and the power of prescribed motion, from model files."""

from __future__ import annotations

import math

import numpy as np
import pytest

from symgen import Model, cos, dot, sin, t
from symgen.runtime.batches import accelerations_and_multipliers
from symgen.runtime.errors import RuntimeModelError

BEAM = """
name = "beam"
[parameters]
L = "4 m"
a = "1 m"                        # from the left support to the load
W = "50 kg"
P = "300 N"
g = "9.81 m/s^2"
[coordinates]
x = { unit = "m", start = 2.0 }
y = { unit = "m", start = 0.0 }
tilt = { unit = "rad", start = 0.0 }
[bodies.beam]
mass = "W"
inertia = "W*L^2/12"
com = ["x", "y"]
angle = "tilt"
[gravity]
y = "-g"
[loads.weight]
point = ["x + (a - L/2)*cos(tilt)", "y + (a - L/2)*sin(tilt)"]
force = ["-40 N", "-P"]
[constraints]
pin_x = "x - L/2*cos(tilt)"
pin_y = "y - L/2*sin(tilt)"
roller = "y + L/2*sin(tilt)"
"""

LADDER = """
name = "ladder"
[parameters]
L = "5 m"
m = "12 kg"
slope = "60 deg"
g = "9.81 m/s^2"
[coordinates]
x = { unit = "m", guess = 1.25 }
y = { unit = "m", guess = 2.17 }
lean = { unit = "rad", start = 1.0471975511965976 }
[bodies.ladder]
mass = "m"
inertia = "m*L^2/12"
com = ["x", "y"]
angle = "lean"
[gravity]
y = "-g"
[constraints]
floor = "y - L/2*sin(lean)"
peg = "x - L/2*cos(lean)"
wall = "L*cos(slope) - (x + L/2*cos(lean))"
"""

# Two bars from the wall, one horizontal, one from below, carry a weight at their common pin.
CRANE = """
name = "crane"
[parameters]
m = "100 kg"
g = "9.81 m/s^2"
[coordinates]
x = { unit = "m", start = 3.0 }
y = { unit = "m", start = 0.0 }
[bodies.pin]
mass = "m"
com = ["x", "y"]
[gravity]
y = "-g"
[constraints]
tie = "sqrt(x^2 + y^2) - 3"
strut = "sqrt(x^2 + (y + 4)^2) - 5"
"""


def reactions(text: str) -> dict[str, float]:
    """Multipliers at rest, by constraint."""
    system = Model.from_toml(text).derive()
    run = system.run(t_end=1e-3, method="dop853", at=[1e-3])
    assert run.status == "success", run.message
    np.testing.assert_allclose(run.samples[0].acceleration, 0.0, atol=1e-9)
    return dict(
        zip((record["name"] for record in system.constraints), run.samples[0].multipliers, strict=True)
    )


def test_simply_supported_beam():
    """Meriam, Kraige, Statics: moments about one support give the other; forces on the beam, upwards positive."""
    found, weight = reactions(BEAM), 50 * 9.81
    assert found["roller"] == pytest.approx(300 * 1 / 4 + weight / 2, rel=1e-12)
    assert found["pin_y"] == pytest.approx(300 * 3 / 4 + weight / 2, rel=1e-12)
    assert found["pin_x"] == pytest.approx(40.0, rel=1e-12)  # holds against the load to the left


def test_ladder_against_a_smooth_wall():
    found, weight = reactions(LADDER), 12 * 9.81
    push = weight / (2 * math.tan(math.radians(60)))
    assert found["floor"] == pytest.approx(weight, rel=1e-12)
    assert found["wall"] == pytest.approx(
        push, rel=1e-11
    )  # on the ladder to the left: the gap closes to the right
    assert found["peg"] == pytest.approx(push, rel=1e-11)


def test_bars_of_a_wall_crane():
    """A multiplier of a length is the force that lengthens it: negative where the bar pulls."""
    found, weight = reactions(CRANE), 100 * 9.81
    assert found["strut"] == pytest.approx(weight * 5 / 4, rel=1e-12)
    assert found["tie"] == pytest.approx(-weight * 3 / 4, rel=1e-12)


def test_beam_on_three_supports_has_the_shortest_reactions():
    """One equation too few: all reactions R with ΣR = W and Σ x R = 0 fit, the least-norm ones are given."""
    text = BEAM.replace(
        'roller = "y + L/2*sin(tilt)"', 'roller = "y + L/2*sin(tilt)"\nmiddle = "y + 0.5*sin(tilt)"'
    )
    system = Model.from_toml(text).derive()
    run = system.run(t_end=1e-3, method="dop853", at=[1e-3])
    assert run.redundant == ["middle"]
    assert any("not unique" in note for note in run.notes)
    _, left, roller, middle = run.samples[0].multipliers
    lever = np.array([[1.0, 1.0, 1.0], [-2.0, 2.0, 0.5]])
    expected = np.linalg.lstsq(lever, np.array([300 + 50 * 9.81, -300.0]), rcond=None)[0]
    np.testing.assert_allclose([left, roller, middle], expected, rtol=1e-10)


def test_driven_crank_takes_the_work_that_its_torque_does():
    """The multiplier of the drive is its torque; the work in the balance is the integral of torque times speed."""
    m = Model("driven")
    theta = m.coordinate("theta", guess=0.3)
    phi, x = m.coordinate("phi", guess=-0.1), m.coordinate("x", guess=0.4)
    r, l, M, J, g, w = m.parameters(r=0.1, l=0.3, M=2.0, J=0.01, g=9.81, w=7.0)
    m.gravity(y=-g)
    m.body(
        "rod",
        mass=M,
        inertia=J,
        com=(r * cos(theta) + l / 2 * cos(phi), r * sin(theta) + l / 2 * sin(phi)),
        angle=phi,
    )
    m.body("piston", mass=M, com=(x, 0))
    m.constraint("drive", theta - 0.3 - w * t)
    m.constraint("closes_x", r * cos(theta) + l * cos(phi) - x)
    m.constraint("closes_y", r * sin(theta) + l * sin(phi))
    run = m.derive().run(t_end=1.3, method="dop853", rtol=1e-11, atol=1e-13, fps=2000)
    _, multipliers = accelerations_and_multipliers(run.system, run.p, run.t, run.states)
    power = multipliers[:, 0] * 7.0
    n = len(run.t) // 2 * 2 - 1
    h = run.t[1] - run.t[0]
    work = h / 3 * (power[0] + power[n - 1] + 4 * power[1:n:2].sum() + 2 * power[2 : n - 1 : 2].sum())
    assert run.energy.work[n - 1] - run.energy.work[0] == pytest.approx(work, abs=1e-8)
    total = run.energy.kinetic + run.energy.potential
    assert np.ptp(total) > 1.0
    np.testing.assert_allclose(total - total[0], run.energy.work, rtol=0, atol=1e-8)


def test_driven_pendulum_by_hand():
    """T is constant: the work is what lifts the mass, m g l (cos θ0 - cos θ)."""
    m = Model("driven_pendulum")
    theta = m.coordinate("theta")
    M, l, g, w = m.parameters(M=1.5, l=0.8, g=9.81, w=2.0)
    m.gravity(y=-g)
    m.body("bob", mass=M, com=(l * sin(theta), -l * cos(theta)))
    m.constraint("drive", theta - w * t)
    # Work has no part in the choice of steps, and here all else is known in advance: times to land on keep them short.
    run = m.derive().run(t_end=2.0, method="dop853", at=np.linspace(0.05, 2.0, 40))
    assert run.energy.work[-1] == pytest.approx(1.5 * 9.81 * 0.8 * (1 - math.cos(4.0)), rel=1e-11)
    assert run.samples[-1].multipliers[0] == pytest.approx(1.5 * 9.81 * 0.8 * math.sin(4.0), rel=1e-11)


def test_freedom_without_inertia_is_refused_by_name():
    """The mass is a product of parameters, which only their values show to be zero."""
    m = Model("spring_end")
    x, y, z = m.coordinate("x", start=0.1), m.coordinate("y"), m.coordinate("z")
    M, k, a, b = m.parameters(M=1.0, k=10.0, a=0.0, b=2.0)
    m.body("mass", mass=M, com=(x, z))
    m.kinetic(a * b * dot(y) ** 2 / 2)
    m.potential(k * (x - y) ** 2 / 2)
    m.constraint("level", z - x)
    system = m.derive()
    with pytest.raises(RuntimeModelError, match="nothing determines how coordinate 'y' accelerates"):
        system.run(t_end=1.0)
    assert system.run(t_end=0.1, parameters={"a": 1.0}).status == "success"
