"""Rods of point bodies: where a distance never changes there is one, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from sympy import Symbol

from symgen import Model, cos, sin
from symgen.runtime.recording import schema
from symgen.runtime.recording.recording import Quantities
from symgen.runtime.recording.rrd.read import read_rrd
from symgen.runtime.recording.tethers import tethers
from symgen.runtime.report.drawing import drawing


def found(model):
    system = model.derive()
    y = np.zeros(system.ny)
    names = [body["name"] for body in system.bodies]
    rods = tethers(Quantities(system, system.parameter_values()), 0.0, y)
    return [
        (names[rod.body], names[rod.anchor] if rod.anchor >= 0 else tuple(np.round(rod.place, 9)))
        for rod in rods
    ]


def cart_and_chain():
    m = Model("chain", gravity=(0, "-9.81 m/s^2"))
    x, a, b = m.coordinate("x", unit="m"), m.coordinate("a", start=0.7), m.coordinate("b", start=-0.3)
    m.body("cart", mass=1, com=(x, 0), shape={"box": [0.2, 0.1, 0.1]})
    m.body("one", mass=1, com=(x + 0.5 * sin(a), -0.5 * cos(a)))
    m.body("two", mass=1, com=(x + 0.5 * sin(a) + 0.4 * sin(b), -0.5 * cos(a) - 0.4 * cos(b)))
    return m


def pendulum(shape=None):
    m = Model("pendulum", gravity=(0, "-9.81 m/s^2"))
    theta = m.coordinate("theta", start=0.2)
    m.body("bob", mass=1, com=(0.5 * sin(theta), -0.5 * cos(theta)), shape=shape)
    return m


def test_each_bob_hangs_on_the_body_before_it():
    assert found(cart_and_chain()) == [("one", "cart"), ("two", "one")]


@pytest.mark.parametrize("shape", [None, {"sphere": [0.05]}], ids=["point", "ball"])
def test_a_bob_hangs_on_its_pivot(shape):
    assert found(pendulum(shape)) == [("bob", (0.0, 0.0, 0.0))]


def test_what_slides_falls_or_is_drawn_has_no_rod():
    m = Model("free", gravity=(0, "-9.81 m/s^2"))
    x, y, s = (m.coordinate(name, unit="m", start=0.3) for name in "xys")
    m.body("ball", mass=1, com=(x, y))
    m.body("bead", mass=1, com=(s, 0.0))
    m.body("beside", mass=1, com=(s + 0.5, 0.0))  # the distance is constant, and so is the direction
    assert found(m) == []
    assert found(pendulum({"box": [0.1, 0.1, 0.1]})) == []


def test_a_rod_that_is_drawn_already_is_not_drawn_again():
    m = pendulum({"sphere": [0.05]})
    theta = Symbol("theta")
    m.body(
        "rod",
        mass=0,
        inertia=0.1,
        com=(0.25 * sin(theta), -0.25 * cos(theta)),
        angle=theta,
        shape={"capsule": [0.01, 0.5]},
    )
    assert found(m) == []


def test_what_turns_about_an_axis_hangs_on_its_own_place_there():
    m = Model("row", gravity=(0, 0, "-9.81 m/s^2"))
    for k in range(3):
        a = m.coordinate(f"a{k}", start=0.3)
        m.body(f"bob{k}", mass=1, com=(0.5 * sin(a), 1.0 * k, -0.5 * cos(a)))
    assert found(m) == [(f"bob{k}", (0.0, 1.0 * k, 0.0)) for k in range(3)]


def test_a_circular_orbit_is_no_rod():
    m = Model("orbit")
    x, y = m.coordinate("x", unit="m", start=1.0), m.coordinate("y", unit="m", rate=1.0)
    m.body("planet", mass=1, com=(x, y))
    m.potential(-m.parameters(mu=1.0) / (x**2 + y**2) ** 0.5)
    assert found(m) == []


def test_the_rod_is_drawn_from_the_origin_to_the_bob(tmp_path):
    solution = pendulum().derive().run(t_end=1.0, fps=20)
    solution.save(tmp_path / "run.rrd")
    path = f"{schema.LINKS}/bob"
    _, batches, _ = read_rrd(tmp_path / "run.rrd", [path, f"{schema.GROUND}/bob"])
    assert len(batches) > 1 and f"{schema.GROUND}/bob" in batches
    scales = [b.column("Transform3D:scale") for b in batches[path] if "Transform3D:scale" in b.schema.names]
    lengths = [row[0][2] for column in scales for row in column.to_pylist()]
    np.testing.assert_allclose(lengths, 0.5, rtol=1e-6)
    svg = drawing(solution.system, solution.p, 0.0, solution.states[0])
    assert 'class="mark"' in svg and svg.count("<circle") == 1


def test_one_ball_does_not_fill_a_report(tmp_path):
    m = Model("drop", gravity=(0, "-9.81 m/s^2"))
    y = m.coordinate("y", unit="m", start=1.0)
    m.body("ball", mass=1, com=(0, y), shape={"sphere": [0.05]})
    system = m.derive()
    svg = drawing(system, system.parameter_values(), 0.0, np.array([1.0, 0.0]))
    height = float(svg.partition('viewBox="0 0 640 ')[2].partition('"')[0])
    radius = float(svg.partition(' r="')[2].partition('"')[0])
    assert radius < 0.12 * height
