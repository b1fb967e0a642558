"""Gravity: orbits against Kepler, bodies against Newton in NumPy, gradients against d'Alembert's formula."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from symgen import Model
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.toml_reader import read_text
from symgen.runtime.batches import evaluate

MU, R0 = 3.986e14, 7e6  # of the earth

SATELLITE = """
[parameters]
mu = "3.986e14 m^3/s^2"
[coordinates]
x = { unit = "m", start = 7e6, rate = 0 }
y = { unit = "m", start = 0, rate = 9000 }
[bodies.satellite]
mass = "500 kg"
com = ["x", "y"]
[gravity.attractors.earth]
at = [0, 0]
mu = "mu"
"""


def at_state(system, function: str, y, **parameters: float) -> np.ndarray:
    """What a function writes in a state."""
    p = system.parameter_values(parameters)
    return evaluate(system, function, p, np.zeros(1), np.array([y], dtype=float))[0]


def test_an_orbit_closes_after_keplers_period():
    energy = 9000**2 / 2 - MU / R0
    a = -MU / (2 * energy)
    period = 2 * np.pi * np.sqrt(a**3 / MU)
    run = derive(read_text(SATELLITE)).run(t_end=period, rtol=1e-12, atol=1e-6)
    assert run["x"][-1] == pytest.approx(R0, rel=1e-9)
    assert abs(run["y"][-1]) < 1.0
    far = 2 * a - R0
    assert run["x"].min() == pytest.approx(-far, rel=1e-4)
    assert all(check.ok for check in run.health)


def test_bodies_attract_each_other_and_centres_attract_all():
    m = Model("three")
    m.gravity(z=-2, constant="G")
    m.parameters(G=0.7, mu=1.3)
    masses, places = (2.0, 3.0, 0.5), []
    for k, mass in enumerate(masses):
        q = [m.coordinate(f"{c}{k}") for c in "xyz"]
        m.body(f"b{k}", mass=mass, com=q)
    m.body("sign", mass=0, com=(0, 0, 0))
    m.point("spot", "b1")
    m.attractor("sun", at=(0, 0, 5), mu="mu")
    m.attractor("own", at="spot", mu=0.4)
    with pytest.raises(ModelError, match="set already"):
        m.gravity(constant="G")
    places = np.array([[0.1, 0.2, 0.3], [1.0, -0.5, 0.7], [-0.4, 0.9, -1.1]])
    found = at_state(m.derive(), "rhs", [*places.ravel(), *np.zeros(9)])[9:18].reshape(3, 3)

    def pull(at, place):
        return (at - place) / np.linalg.norm(at - place) ** 3

    expected = np.tile([0, 0, -2.0], (3, 1))
    for i in range(3):
        expected[i] += 1.3 * pull(np.array([0, 0, 5.0]), places[i])
        for j in range(3):
            if i != j:
                expected[i] += 0.7 * masses[j] * pull(places[j], places[i])
        if i != 1:
            expected[i] += 0.4 * pull(places[1], places[i])
            expected[1] += 0.4 * masses[i] / masses[1] * pull(places[i], places[1])  # action and reaction
    assert found == pytest.approx(expected, rel=1e-12)


def test_a_field_acts_by_its_gradient_on_children_of_joints_too():
    """A field with J2's form, on a body that hangs off its joint, against differences of its energy."""
    m = Model("oblate")
    m.parameters(mu=2.0, J=0.1)
    r = "sqrt(here_x^2 + here_y^2 + here_z^2)"
    m.gravity(potential=f"-mu/{r}*(1 - J/{r}^2*(3*here_z^2/{r}^2 - 1)/2)")
    m.body("b", mass=3.0, com=(0.1, 0.2, -0.1), inertia=(0.2, 0.3, 0.4))
    m.joint("j", "free", "b")
    q = np.array([0.9, 0.3, -0.2, 0.4])
    q /= np.linalg.norm(q)
    turn, x, com = Rotation.from_quat(q[[1, 2, 3, 0]]), np.array([1.0, 0.5, 0.8]), np.array([0.1, 0.2, -0.1])

    def energy(x, turn):
        here = x + turn.apply(com)
        r = np.linalg.norm(here)
        return -3 * 2 / r * (1 - 0.1 / r**2 * (3 * here[2] ** 2 / r**2 - 1) / 2)

    force = -np.array([(energy(x + d, turn) - energy(x - d, turn)) / 2e-6 for d in 1e-6 * np.eye(3)])
    found = at_state(m.derive(), "forces", [*x, *q, *np.zeros(6)])
    assert found[:3] == pytest.approx(force, rel=1e-8)
    torque = [
        (energy(x, turn * Rotation.from_rotvec(-d)) - energy(x, turn * Rotation.from_rotvec(d))) / 2e-6
        for d in 1e-6 * np.eye(3)
    ]
    assert found[3:] == pytest.approx(torque, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("by_hand", [False, True])
def test_a_gradient_of_gravity_turns_bodies(by_hand):
    """Torque 3 mu/r^3 u x I u; in Euler's equations at rest."""
    inertia, place = np.array([4.0, 7.0, 9.0]), np.array([3.0, 4.0, 12.0])
    m = Model("boom")
    m.attractor("earth", at=(0, 0, 0), mu=50.0, gradient=True)
    if by_hand:
        angles = [m.coordinate(name) for name in "abc"]
        m.body("b", mass=2.0, com=list(place), inertia=list(inertia), rotation=list(zip("zyx", angles)))
        turn = Rotation.from_euler("ZYX", [0.3, 0.2, 0.5])
        found = at_state(m.derive(), "rhs", [0.3, 0.2, 0.5, 0, 0, 0])[3:6]
        h = 1e-6  # from second derivatives of the angles to angular acceleration, at rest
        columns = [
            ((turn.inv() * Rotation.from_euler("ZYX", np.array([0.3, 0.2, 0.5]) + d)).as_rotvec()) / h
            for d in h * np.eye(3)
        ]
        found = np.array(columns).T @ found
    else:
        m.body("b", mass=2.0, inertia=list(inertia))
        m.joint("j", "free", "b")
        turn = Rotation.from_euler("xyz", [0.3, 0.2, 0.5])
        q = turn.as_quat()[[3, 0, 1, 2]]
        found = at_state(m.derive(), "rhs", [*place, *q, *np.zeros(6)])
        r, rows = np.linalg.norm(place), turn.as_matrix()
        tensor = rows @ np.diag(inertia) @ rows.T
        u = place / r
        pull = -2 * 50 / r**2 * u - 1.5 * 50 / r**4 * (
            (inertia.sum() - 5 * u @ tensor @ u) * u + 2 * tensor @ u
        )  # the force of the second term, over r^4
        assert found[7:10] == pytest.approx(pull / 2, rel=1e-10)
        found = found[10:13]
    u = turn.inv().apply(place / 13)
    assert found == pytest.approx(3 * 50 / 13**3 * np.cross(u, inertia * u) / inertia, rel=2e-5)


def test_files_round_trip():
    text = SATELLITE.replace(
        'mu = "mu"', 'mu = "mu"\n[gravity]\nconstant = 1e-9\npotential = "0.1*here_x^2"\ny = -1'
    )
    first = read_text(text)
    again = read_text(first.to_toml())
    assert again.to_toml() == first.to_toml()
    rows = [at_state(derive(m), "rhs", [7e6, 1e5, 0, 1]) for m in (first, again)]
    assert rows[0].tolist() == rows[1].tolist()
    assert rows[0][2] == pytest.approx(-MU * 7e6 / (49e12 + 1e10) ** 1.5 - 1.4e6, rel=1e-12)


@pytest.mark.parametrize(
    "old, new, key, words",
    [
        ('mu = "mu"', 'mu = "mu"\ngradient = 1', "attractors.earth.gradient", "true or false"),
        ('mu = "mu"', 'mu = "2*mu*x"', "attractors.earth.mu", "cannot depend on a coordinate"),
        ('mu = "mu"', 'mu = "9.81 m/s^2"', "attractors.earth.mu", "units do not match"),
        ('mu = "mu"', "mass = 3", "attractors.earth.mass", "unknown key"),
        ("at = [0, 0]", "", "attractors.earth.at", "is missing"),
        ("at = [0, 0]", 'at = "satellite"', "attractors.earth.at", "which is a body; name a point of it"),
        ("at = [0, 0]", 'at = "center"', "attractors.earth.at", "no point 'center'"),
        ("[gravity.attr", "[gravity]\npotential = \"here_x\"\n[gravity.attr", "potential", "units do not match"),
        ("[gravity.attr", "[gravity]\npotential = \"dot(x)*here_x\"\n[gravity.attr", "potential", "on a rate"),
        ("[gravity.attr", "[gravity]\nconstant = \"mu\"\n[gravity.attr", "constant", "units do not match"),
        ('com = ["x", "y"]', 'com = ["x", "here_y"]', "com, element 2", "not declared"),
        ("[gravity.attractors.earth]", "[gravity]\nx = 1\n[gravity.attract.earth]", "attract",
         "did you mean 'attractors'"),
        ('mu = "mu"', 'mu = "mu"\ngradient = true\n[bodies.bar]\ninertia = 1\ncom = [1, 2]\nangle = "x/y"',
         "attractors.earth.gradient", "'bar' is planar"),
    ],
)  # fmt: skip
def test_wrong_fields(old, new, key, words):
    assert old in SATELLITE
    with pytest.raises(ModelError, match=words) as caught:
        read_text(SATELLITE.replace(old, new), file="orbit.toml").describe()
    assert caught.value.key == key
