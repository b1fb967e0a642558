"""Rotors against bodies that spin on joints, and drives against their equations by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen import Model, dot
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.toml_reader import read_text
from symgen.runtime.batches import evaluate

TOL = {"rtol": 1e-11, "atol": 1e-13}
J, K = 0.02, 0.011  # of the rotors about and across their axes
TURN = {"x": (0, np.pi / 2, 0), "z": (0, 0, 0)}  # a joint frame whose z axis is so


def satellite(kind: str) -> Model:
    """A body that tumbles with two wheels in it, whose mass is in their places."""
    m = Model("satellite", gravity=(0, 0, -9.81))
    places = {"x": (0.3, 0, 0.1), "z": (-0.1, 0.2, 0)}
    mass, com, inertia = 5.0, np.zeros(3), np.diag([0.4, 0.5, 0.6])
    across = {"x": np.diag([0, K, K]), "z": np.diag([K, K, 0])}
    if kind == "rotors":
        total = mass + 2 * 0.7
        com = sum(0.7 * np.array(x) for x in places.values()) / total
        inertia = inertia + mass * (com @ com * np.eye(3) - np.outer(com, com))
        for axis, place in places.items():
            arm = np.array(place) - com
            inertia = inertia + across[axis] + 0.7 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        mass = total
    entries = [inertia[i, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    m.body("bus", mass=mass, com=list(com), inertia=entries)
    m.joint("f", "free", "bus", rate=[0, 0, 0, 0.3, 1.0, -0.4])
    for axis, place in places.items():
        if kind == "rotors":
            m.rotor(
                f"wheel_{axis}", J, "bus", [float(axis == "x"), 0, float(axis == "z")], at=place, rate=30.0
            )
        else:
            m.body(f"wheel_{axis}", mass=0.7, inertia=[K, K, J])
            origin = {"xyz": place, "rpy": TURN[axis]}
            m.joint(f"wheel_{axis}", "continuous", f"wheel_{axis}", "bus", origin, axis=[0, 0, 1], rate=30.0)
        m.force(f"wheel_{axis}", f"0.05*sin(3*t) - 0.001*dot(wheel_{axis})")
    return m


def pose(run, body: int = 0) -> np.ndarray:
    return evaluate(run.system, "poses", run.p, run.t, run.states)[:, 12 * body : 12 * body + 12]


def test_a_satellite_with_rotors_is_one_with_wheels_on_joints():
    one, two = (satellite(kind).derive().run(t_end=3, **TOL) for kind in ("rotors", "wheels"))
    for name in ("f_qx", "f_qw", "f_wy", "wheel_x", "dot(wheel_z)", "f_x"):
        scale = np.abs(two[name]).max()
        if name == "f_x":  # the frame's origin, not the centre of mass
            continue
        assert one[name] == pytest.approx(two[name], abs=1e-8 * scale), name
    assert len(one.q[0]) == len(two.q[0])
    checks = {check.check: check for check in one.health}
    assert checks["energy"].value < 1e-9


@pytest.mark.parametrize(
    "method", ["dop853", "radau5", "taylor", "bdf", "rk4", "gauss8", "generalized_alpha"]
)
def test_rotors_take_every_method(method):
    options = {"step": 2e-4} if method in ("rk4", "gauss8", "generalized_alpha") else {"rtol": 1e-9}
    system = satellite("rotors").derive()
    exact, run = system.run(t_end=0.5, **TOL), system.run(t_end=0.5, method=method, **options)
    assert run["f_qx"][-1] == pytest.approx(exact["f_qx"][-1], abs=1e-5)


def test_a_gyrostat_in_closed_form():
    """Euler's equations of a body with a wheel along its first axis (Wittenburg, Dynamics of Multibody Systems)."""
    inertia, h = np.array([0.4, 0.5, 0.6]), 0.02 * 50.0
    m = Model("gyrostat")
    m.body("bus", mass=1, inertia=list(inertia))
    m.joint("f", "spherical", "bus", rate=[0.1, 0.4, -0.3])
    m.rotor("wheel", J, "bus", [1, 0, 0], angle="50*t - f_angle_lost")
    m.definition("f_angle_lost", "0*t")
    run = m.derive().run(t_end=4, **TOL)

    def euler(t, w):
        momentum = inertia * w + np.array([J * w[0] + h, 0, 0])
        return np.linalg.solve(np.diag(inertia + np.array([J, 0, 0])), -np.cross(w, momentum))

    exact = solve_ivp(
        euler, (0, 4), [0.1, 0.4, -0.3], t_eval=run.t, rtol=1e-11, atol=1e-12, method="DOP853"
    ).y
    assert run.v.T == pytest.approx(exact, abs=1e-8)


def test_without_gyroscopic_effects_only_the_drive_is_felt():
    m = Model("plain")
    m.body("bus", mass=1, inertia=[0.4, 0.5, 0.6])
    m.joint("f", "spherical", "bus", rate=[0.1, 0.4, -0.3])
    m.rotor("wheel", J, "bus", [1, 0, 0], gyroscopic=False, rate=50.0)
    m.force("wheel", 0.3)
    bare = Model("bare")
    bare.body("bus", mass=1, inertia=[0.4, 0.5, 0.6])
    bare.joint("f", "spherical", "bus", rate=[0.1, 0.4, -0.3])
    run, other = m.derive().run(t_end=1, **TOL), bare.derive().run(t_end=1, **TOL)
    assert run["f_wx"] == pytest.approx(other["f_wx"], abs=1e-10)
    assert run["dot(wheel)"] == pytest.approx(50 + 0.3 / J * run.t)


def test_a_planar_body_and_a_geared_motor_feel_their_rotors():
    """A motor with a gear at a pendulum's root, and one at its tip: J (n q')^2/2, and J (q' + n q')^2/2."""
    for body, factor in (("world", 20.0), ("rod", 21.0)):
        m = Model("arm", gravity=(0, -9.81))
        m.body("rod", mass=1, inertia=0.1, com=(0.5, 0))
        m.joint("q", "revolute", "rod")
        m.rotor("motor", 0.001, body, angle="20*q")
        inertia = 0.1 + 0.25 + 0.001 * factor**2
        a = m.derive().run(t_end=1e-6).accelerations[0, 0]
        assert a == pytest.approx(-9.81 * 0.5 / inertia)


def test_a_body_placed_by_hand_carries_a_rotor():
    """A cart that yaws by hand, with a wheel across: the torque is that of the change of momentum."""
    m = Model("hand")
    m.coordinate("psi", rate=2.0)
    m.coordinate("tilt", rate=0.3)
    m.body("bus", mass=1, com=(0, 0, 0), inertia=[0.4, 0.5, 0.6], rotation=[("z", "psi"), ("x", "tilt")])
    m.rotor("wheel", J, "bus", [0, 1, 0], rate=40.0)
    again = Model("again")
    again.coordinate("psi", rate=2.0)
    again.coordinate("tilt", rate=0.3)
    again.coordinate("wheel", rate=40.0)
    again.body("bus", mass=1, com=(0, 0, 0), inertia=[0.4, 0.5, 0.6], rotation=[("z", "psi"), ("x", "tilt")])
    again.kinetic(f"{J}/2*(dot(wheel) + dot(psi)*sin(tilt))^2")
    one, two = (x.derive().run(t_end=2, **TOL) for x in (m, again))
    assert one["tilt"] == pytest.approx(two["tilt"], abs=1e-9)
    assert one["wheel"] == pytest.approx(two["wheel"], abs=1e-8)


DRIVE = """
[parameters]
k = "200 N*m/rad"
c = "0.5 N*m*s/rad"

[inputs]
motor = { unit = "N*m", default = 5.0 }
pressed = { unit = "N*m", polynomial = [0, 40] }

[rotors.engine]
inertia = "0.1 kg*m^2"

[rotors.plate]
inertia = "0.05 kg*m^2"

[rotors.wheel]
inertia = "2 kg*m^2"

[forces]
engine = "motor"
wheel = "-0.4*dot(wheel)"

[friction.clutch]
speed = "dot(engine) - dot(plate)"
torque = "pressed"

[springs.shaft]
angle = "plate - 3*wheel"
stiffness = "k"
damping = "c"
"""


def test_a_drive_of_rotors_a_clutch_and_an_elastic_shaft():
    """Against its equations in SciPy, which slide until the speeds are one and then stick."""
    system = derive(read_text(DRIVE))
    run = system.run(t_end=1, **TOL)
    locked = [e.t for e in run.events if e.name == "clutch"]

    def shaft(y):
        return 200 * (y[1] - 3 * y[2]) + 0.5 * (y[4] - 3 * y[5])

    def slides(t, y):
        M = 40 * t
        T = shaft(y)
        return [*y[3:], (5 - M) / 0.1, (M - T) / 0.05, (3 * T - 0.4 * y[5]) / 2]

    def sticks(t, y):
        T = shaft(y)
        a = (5 - T) / 0.15
        return [*y[3:], a, a, (3 * T - 0.4 * y[5]) / 2]

    def equal(t, y):
        return y[3] - y[4] if t > 1e-3 else 1.0

    equal.terminal = True
    options = {"rtol": 1e-11, "atol": 1e-12, "method": "DOP853"}
    first = solve_ivp(slides, (0, 1), np.zeros(6), events=equal, **options)
    assert locked[-1] == pytest.approx(first.t[-1], abs=1e-6)
    second = solve_ivp(sticks, (first.t[-1], 1), first.y[:, -1], **options)
    assert run["wheel"][-1] == pytest.approx(second.y[2, -1], abs=1e-7)
    assert run["dot(engine)"][-1] == pytest.approx(second.y[3, -1], abs=1e-6)


def test_rotors_are_written_and_read_again():
    m = satellite("rotors")
    m.rotor("third", "0.1", angle="2*wheel_x", gyroscopic=False)
    m.rotor("fourth", 0.2, "bus", unit="deg", start=30, rate_guess=1)
    again = read_text(m.to_toml())
    assert again.to_toml() == m.to_toml()
    assert again._description().rotors == m._description().rotors
    assert [c.start for c in again.describe().coordinates] == pytest.approx(
        [c.start for c in m.describe().coordinates]
    )


def test_a_picture_has_the_shafts():
    marks = [
        record
        for record in satellite("rotors").derive().source.header["marks"]
        if record["name"] == "wheel_x"
    ]
    assert [(x["kind"], x["body"]) for x in marks] == [("pin", "bus")]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "'inertia' is missing"),
        ({"inertia": 1, "body": "bos"}, "no body 'bos'"),
        ({"inertia": 1, "body": "flat", "axis": [1, 0, 0]}, "turns about z"),
        ({"inertia": 1, "angle": "t", "rate": 3}, "this rotor has an 'angle'"),
        ({"inertia": 1, "gyroscopic": "yes"}, "true or false"),
        ({"inertia": "dot(f)"}, "cannot depend on a rate"),
        ({"inertia": 1, "angle": "dot(f)"}, "cannot depend on a rate"),
        ({"inertia": 1, "body": "bus", "axis": [1, 0]}, "three components"),
    ],
)
def test_what_a_rotor_refuses(given, message):
    m = Model("r")
    m.body("flat", mass=1, inertia=1.0)
    m.joint("f", "revolute", "flat")
    m.body("bus", mass=1, inertia=[1, 1, 1])
    m.joint("s", "spherical", "bus")
    with pytest.raises(ModelError, match=message):
        m.rotor("r", **given)
        m.describe()


def test_a_drive_needs_no_body():
    m = Model("shafts")
    a, b = (m.rotor(name, 0.5, rate=2.0) for name in "ab")
    m.force(a, -0.1 * dot(a))
    m.force(b, 1)
    run = m.derive().run(t_end=1)
    assert run["dot(b)"][-1] == pytest.approx(4.0)
