"""Velocity constraints that are not linear in the rates, and such with inputs, against equations written again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen import Model, dot
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.toml_reader import read_text
from symgen.runtime.checks.health import health_of
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs import Controller, Table
from symgen.runtime.integrate.methods import METHODS

FORMS = [
    ("dop853", "projection"), ("dop853", "baumgarte"), ("dop853", "partition"), ("taylor", "projection"),
    ("radau5", "projection"), ("radau5", "ggl"), ("bdf", "ggl"), ("gauss6", "projection"), ("rk4", "projection"),
    ("generalized_alpha", "ggl"), ("generalized_alpha", "index3"), ("hht", "projection"),
]  # fmt: skip

CONSTANT_SPEED = """
[parameters]
s = { value = 1.0, unit = "m/s" }
[coordinates]
x = { unit = "m", start = 0, rate_guess = 0.9 }
y = { unit = "m", start = 0, rate_guess = 0.3 }
[bodies.point]
mass = "1 kg"
com = ["x", "y"]
[gravity]
y = "-9.81 m/s^2"
[velocity_constraints]
speed = "dot(x)^2 + dot(y)^2 - s^2*(1 + faster*t)"
[constants]
faster = "FASTER 1/s"
[run]
t_end = 0.5
"""


def at_speed(faster: float) -> np.ndarray:
    """x and y at 0.5 s, by the angle of the velocity: only gravity across it turns it."""

    def motion(t, y):
        speed = np.sqrt(1 + faster * t)
        return [-9.81 * np.cos(y[0]) / speed, speed * np.cos(y[0]), speed * np.sin(y[0])]

    start = [np.arctan2(0.3, 0.9), 0, 0]
    return solve_ivp(motion, (0, 0.5), start, rtol=1e-12, atol=1e-13).y[1:, -1]


@pytest.mark.parametrize(("method", "form"), FORMS, ids=["-".join(pair) for pair in FORMS])
@pytest.mark.parametrize("faster", [0.0, 3.0], ids=["constant", "faster"])
def test_a_speed_is_held(method, form, faster):
    system = derive(read_text(CONSTANT_SPEED.replace("FASTER", str(faster))))
    steps = {} if METHODS[method].adaptive else {"step": 1e-3}
    run = system.run(method=method, constraints=form, **steps)
    assert run.status == "success"
    limit = 2e-5 if "alpha" in method or method == "hht" else 2e-7
    assert [run["x"][-1], run["y"][-1]] == pytest.approx(at_speed(faster), abs=limit)
    assert run.constraint_residual.max_velocity < 1e-7
    assert run.energy.max_error < 1e-4
    assert not [entry for entry in health_of(run) if not entry.ok]


def test_rates_move_onto_the_curve_by_the_least():
    run = derive(read_text(CONSTANT_SPEED.replace("FASTER", "0.0"))).run()
    assert [run["dot(x)"][0], run["dot(y)"][0]] == pytest.approx(
        np.array([0.9, 0.3]) / np.hypot(0.9, 0.3), abs=1e-9
    )
    with pytest.raises(RuntimeModelError, match="'speed'"):
        derive(read_text(CONSTANT_SPEED.replace("FASTER", "0.0"))).run(rate={"x": 1.5})


def test_a_constraint_without_rates_is_refused():
    with pytest.raises(ModelError, match="without a rate"):
        read_text(CONSTANT_SPEED.replace("FASTER", "0").replace("dot(x)^2 + dot(y)^2", "x*1.0")).describe()


@pytest.fixture(scope="module")
def driven():
    m = Model("driven")
    x, y = m.coordinate("x", start=0.1), m.coordinate("y", start=0.1, rate=0.5)
    u = m.input("u", polynomial=(0.2, 1, 0.5))
    m.body("point", mass=2, com=(x, y))
    m.force(y, -3 * y)
    m.velocity_constraint("pace", dot(x) - u * (1 + y))
    m.run(t_end=1.0)
    return derive(m)


@pytest.mark.parametrize(("method", "form"), FORMS, ids=["-".join(pair) for pair in FORMS])
def test_an_input_sets_the_pace(driven, method, form):
    """The course of y is an oscillation of its own; x follows, and the multiplier has the input's rate."""

    def motion(t, z):
        return [z[1], -1.5 * z[0], (0.2 + t + 0.5 * t * t) * (1 + z[0])]

    y, speed, x = solve_ivp(motion, (0, 1), [0.1, 0.5, 0.1], rtol=1e-12, atol=1e-13).y[:, -1]
    steps = {} if METHODS[method].adaptive else {"step": 1e-3}
    run = driven.run(method=method, constraints=form, **steps)
    limit = 2e-6 if "alpha" in method or method == "hht" else 1e-7
    assert run["x"][-1] == pytest.approx(x, abs=limit)
    assert run["lambda(pace)"][-1] == pytest.approx(2 * (2 * (1 + y) + 1.7 * speed), abs=10 * limit)
    assert run.energy.max_error < 1e-5
    assert not [entry for entry in health_of(run) if not entry.ok]


def test_inputs_of_every_kind_have_their_rates(driven):
    for given in (
        Table([0, 0.5, 1], [0.2, 0.4, 0.1]),
        Table([0, 0.4, 1], [0, 1, 0], "cubic"),
        lambda t: np.sin(3 * t),
        0.7,
    ):
        run = driven.run(inputs={"u": given})
        assert run.status == "success"
        assert run.constraint_residual.max_velocity < 1e-12
        assert np.trapezoid(run["u"] * (1 + run["y"]), run.t) == pytest.approx(run["x"][-1] - 0.1, abs=1e-4)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"u": Table([0, 0.5], [0.0, 1.0], "hold")}, "jumps: velocities cannot"),
        (
            {"u": Controller(lambda t, reads: 1.0, reads=["y"], period=0.1)},
            "how fast a controller's input changes",
        ),
        ({"u_rate": Table([0, 1], [0.0, 1.0])}, "is the rate of 'u' and follows from it"),
        ({"u_rate": 1.0}, "is the rate of the input 'u' and follows from it"),
    ],
    ids=["held table", "controller", "rate over time", "rate"],
)
def test_inputs_whose_rates_are_not_known_are_refused(driven, given, says):
    with pytest.raises(RuntimeModelError, match=says):
        driven.run(inputs=given)


def test_two_that_are_not_linear_in_one_mechanism():
    """At rest their rows of G vanish, which is no dependence: both were left out of the equations of motion."""
    m = Model("two", gravity=(0, "-9.81 m/s^2"))
    m.parameter("stiff", "3 N/m")
    for k in (1, 2):
        x = m.coordinate(f"x{k}", unit="m", start=0, rate_guess=0.8)
        y = m.coordinate(f"y{k}", unit="m", start=0, rate_guess=0.5)
        m.body(f"b{k}", mass=1, com=(x, y))
        m.velocity_constraint(f"v{k}", f"dot(x{k})^2 + dot(y{k})^2 - 1")
    m.potential("stiff*(x1 - x2)^2/2")
    run = m.derive().run(1.5, rtol=1e-10)
    s = solve_ivp(
        lambda t, z: [np.cos(z[2]), np.sin(z[2]), -9.81 * np.cos(z[2])],
        (0, 1.5), [0, 0, np.arctan2(0.5, 0.8)], rtol=1e-11, atol=1e-12,
    ).y[:2, -1]  # fmt: skip
    assert run.q[-1] == pytest.approx([*s, *s], abs=1e-7)
    assert all(check.ok for check in run.health), run.health
