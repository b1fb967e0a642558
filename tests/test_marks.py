"""Marks: which pins, supports, axes and forces a model shows, and where they are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from symgen import Model
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.model import library
from symgen.runtime import load
from symgen.runtime.batches import evaluate
from symgen.runtime.errors import ModuleError


def loaded(model):
    """The system of a bundled model's name, a `Model`, or TOML text."""
    if isinstance(model, str):
        model = Model.from_toml(model) if "\n" in model else library.load(library.bundled()[model])
    return load(derive_text(model).text)


def records(system, *kinds):
    """Names of marks, those of some kinds or all."""
    return [
        (m["kind"], m["name"])
        for m in system.source.header.get("marks", ())
        if not kinds or m["kind"] in kinds
    ]


def numbers(system, kind, name, y=None, t=0.0):
    """What the function `marks` writes of one mark."""
    if y is None:
        q, v, _, _ = system.initial_state()
        y = np.concatenate([q, v])
    row = evaluate(system, "marks", system.parameter_values(), np.array([t]), np.array([y]))[0]
    place = 0
    for mark in system.source.header["marks"]:
        if (mark["kind"], mark["name"]) == (kind, name):
            return row[place : place + mark["numbers"]]
        place += mark["numbers"]
    raise KeyError((kind, name))


def in_world(system, kind, name, y):
    """A place that is fixed in a body, in the world."""
    mark = next(m for m in system.source.header["marks"] if (m["kind"], m["name"]) == (kind, name))
    poses = evaluate(system, "poses", system.parameter_values(), np.zeros(1), np.array([y]))[0]
    index = [body["name"] for body in system.bodies].index(mark["body"])
    pose = poses[12 * index : 12 * index + 12]
    return pose[:3] + pose[3:].reshape(3, 3) @ numbers(system, kind, name, y)[:3]


# Rods that are placed by hand


def four_bar_state(crank, a=0.1, b=0.3, c=0.25, d=0.3):
    """Angles of a four-bar linkage by triangles, and where its moving pins are."""
    first = a * np.exp(1j * crank)
    diagonal = d - first
    inner = np.arccos((b**2 + abs(diagonal) ** 2 - c**2) / (2 * b * abs(diagonal)))
    second = first + b * np.exp(1j * (np.angle(diagonal) + inner))
    coupler, rocker = np.angle(second - first), np.angle(second - d)
    return np.array([crank, coupler, rocker, 0.0, 0.0, 0.0]), first, second


def test_the_pins_of_a_four_bar_linkage_are_where_triangles_say():
    system = loaded("four_bar")
    for crank in (0.4, 2.0, 4.5):
        y, first, second = four_bar_state(crank)
        for name, place in (
            ("crank_bar_1", 0),
            ("crank_bar_2", first),
            ("coupler_bar_2", second),
            ("rocker_bar_1", 0.3),
        ):
            expected = [np.real(place), np.imag(place), 0.0]
            np.testing.assert_allclose(in_world(system, "pin", name, y), expected, atol=1e-14)
            assert list(numbers(system, "pin", name, y)[3:]) == [0.0, 0.0, 1.0]
    np.testing.assert_allclose(numbers(system, "ground", "rocker_bar_1", y), [0.3, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(numbers(system, "ground", "crank_bar_1", y), 0.0, atol=1e-15)
    assert len(records(system, "pin")) == 4 and len(records(system, "ground")) == 2


def test_the_force_on_a_piston_is_its_mass_times_its_acceleration():
    system = loaded("slider_crank")
    mark = next(m for m in system.source.header["marks"] if m["kind"] == "reaction")
    theta, phi = 0.7, np.arcsin(-0.1 * np.sin(0.7) / 0.3)
    x = 0.1 * np.cos(theta) + 0.3 * np.cos(phi)
    rate = -0.1 * np.cos(theta) * 12.0 / (0.3 * np.cos(phi))
    speed = -0.1 * np.sin(theta) * 12.0 - 0.3 * np.sin(phi) * rate
    y = np.array([theta, phi, x, 12.0, rate, speed])
    row = system.kernel("rhs")(0.0, y, system.parameter_values())
    acceleration, multipliers = row[5], row[6:8]
    on_the_rod = [sign * multipliers[k] for k, sign in zip(mark["constraints"], mark["signs"])]
    assert mark["body"] == "rod" and mark["name"] == "rod_2"
    assert acceleration != 0.0
    assert -on_the_rod[0] == pytest.approx(0.8 * acceleration, rel=1e-12)


CHANCE = """
[parameters]
L = 1
R = 1
[coordinates]
a = { unit = "rad", start = 0.0 }
b = { unit = "rad", start = 3.141592653589793 }
[bodies.left]
mass = 1
com = ["L/2*cos(a)", "L/2*sin(a)"]
angle = "a"
shape = { capsule = [0.02, "L"] }
[bodies.right]
mass = 1
com = ["2*R + R/2*cos(b)", "R/2*sin(b)"]
angle = "b"
shape = { capsule = [0.02, "R"] }
[bodies.plate]
mass = 1
com = ["L*cos(a)", "L*sin(a)"]
angle = "a + 0.3"
shape = { box = [0.1, 0.1, 0.1] }
[bodies.spring]
mass = 0
com = ["L/2*cos(a)", "3*R + L/2*sin(a)"]
shape = { cylinder = [0.02, "L*cos(a)^2"] }
"""


def test_ends_that_meet_by_chance_or_are_welded_have_no_pin():
    system = loaded(CHANCE)
    y = np.array([0.0, np.pi, 0.0, 0.0])
    np.testing.assert_allclose(in_world(system, "pin", "left_1", y), 0.0, atol=1e-15)
    np.testing.assert_allclose(in_world(system, "pin", "right_1", y), [2.0, 0.0, 0.0], atol=1e-15)
    assert records(system, "pin") == [("pin", "left_1"), ("pin", "right_1")]
    assert records(system, "ground") == [("ground", "left_1"), ("ground", "right_1")]
    assert [body.get("stretches", False) for body in system.bodies] == [False, False, False, True]


def test_a_rod_held_at_the_world_by_constraints_stands_on_the_ground():
    system = loaded("chain_absolute")
    assert ("ground", "rod1_1") in records(system) and ("reaction", "rod1_1") in records(system)
    np.testing.assert_allclose(numbers(system, "ground", "rod1_1"), 0.0, atol=1e-14)
    assert len(records(system, "reaction")) == system.m // 2


# Joints


ARM = """
[parameters]
w = 1
L = "0.7 m"
[gravity]
z = "-9.81 m/s^2"
[bodies.upper]
mass = 2
com = [0.1, 0, "-L/2"]
inertia = [0.1, 0.1, 0.01]
[bodies.lower]
mass = 1
com = [0, 0, -0.2]
inertia = [0.1, 0.1, 0.01]
[joints.shoulder]
type = "revolute"
child = "upper"
origin = { xyz = [0, 0.5, 2], rpy = [0, 0, "90 deg"] }
axis = [0, 2, 0]
coordinate = "q1"
[joints.elbow]
type = "universal"
parent = "upper"
child = "lower"
origin = { xyz = [0, 0, "-L"] }
axis = [1, 0, 0]
axis2 = [0, 1, 0]
[points.tip]
body = "lower"
at = [0, 0, "-L"]
[points.hook]
body = "world"
at = [1, 0, 1]
[constraints.rope]
distance = { points = ["tip", "hook"], length = 1.5 }
[loads.wind]
point = ["tip_x", "tip_y", "tip_z"]
force = ["3*w*dot(q1)", 0, "w*t"]
[loads.twist]
body = "lower"
torque = [0, "2*w*q1", 0]
"""


def test_marks_of_a_tree_lie_in_its_bodies():
    system = loaded(ARM)
    np.testing.assert_allclose(numbers(system, "ground", "shoulder"), [0.0, 0.5, 2.0])
    np.testing.assert_allclose(
        numbers(system, "pin", "shoulder"), [0.0, 0.5, 2.0, -1.0, 0.0, 0.0], atol=1e-15
    )
    np.testing.assert_allclose(numbers(system, "pin", "elbow"), [-0.1, 0.0, -0.35, 1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(numbers(system, "pin", "elbow_2"), [0.0, 0.0, 0.2, 0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(
        numbers(system, "bar", "upper"), [-0.1, 0.0, 0.35, -0.1, 0.0, -0.35], atol=1e-15
    )
    np.testing.assert_allclose(numbers(system, "bar", "lower"), [0.0, 0.0, 0.2, 0.0, 0.0, -0.5], atol=1e-15)


def test_forces_and_links_are_those_of_the_motion():
    system = loaded(ARM)
    y, t = np.array([0.3, -0.4, 0.5, 2.0, 0.0, 0.0]), 0.7
    turned = Rotation.from_euler("z", 90, degrees=True) * Rotation.from_euler("y", 0.3)
    elbow = np.array([0, 0.5, 2]) + turned.apply([0, 0, -0.7])
    turned = turned * Rotation.from_euler("x", -0.4) * Rotation.from_euler("y", 0.5)
    tip = elbow + turned.apply([0, 0, -0.7])
    np.testing.assert_allclose(numbers(system, "force", "wind", y, t), [*tip, 6.0, 0.0, 0.7], rtol=1e-13)
    np.testing.assert_allclose(numbers(system, "torque", "twist", y, t), [0.0, 0.6, 0.0], rtol=1e-13)
    np.testing.assert_allclose(numbers(system, "link", "rope", y, t), [*tip, 1.0, 0.0, 1.0], rtol=1e-13)
    assert [m["moves"] for m in system.source.header["marks"] if m["kind"] == "force"] == [True]


def test_the_tension_of_a_link_accelerates_what_hangs_on_it():
    bob = """
[parameters]
m = 2
[bodies.bob]
mass = "m"
com = [0, 0, 0]
[joints.move]
type = "planar"
child = "bob"
[points.eye]
body = "bob"
at = [0, 0, 0]
[points.hook]
body = "world"
at = [0, 0, 0]
[constraints.rope]
distance = { points = ["eye", "hook"], length = 2 }
"""
    system = loaded(bob.replace("mass = ", "inertia = [1, 1, 1]\nmass = "))
    mark = next(m for m in system.source.header["marks"] if m["kind"] == "tension")
    q, v = np.array([1.2, 1.6, 0.0]), np.array([-1.6 * 1.5, 1.2 * 1.5, 0.0])
    y = np.concatenate([q, v])
    row = system.kernel("rhs")(0.0, y, system.parameter_values())
    ends = numbers(system, "tension", "rope", y)
    along = (ends[:3] - ends[3:]) / np.linalg.norm(ends[:3] - ends[3:])
    force = row[system.ny + mark["constraints"][0]] * mark["signs"][0] * along
    # Circular motion with 1.5 rad/s at 2 m: towards the hook, m r ω².
    assert np.linalg.norm(force) == pytest.approx(2 * 2.0 * 1.5**2, rel=1e-12)
    assert force @ ends[:3] < 0.0


def test_gears_touch_at_the_circles_on_which_they_are_equally_fast():
    wheels = """
[parameters]
ratio = -2.5
[bodies.wheel]
mass = 1
inertia = 0.01
com = [0.1, 0]
[bodies.pinion]
mass = 1
inertia = 0.01
com = [0, 0]
[joints.slow]
type = "revolute"
child = "wheel"
coordinate = "a"
origin = { xyz = [-0.1, 0.2, 0] }
[joints.fast]
type = "revolute"
child = "pinion"
coordinate = "b"
origin = { xyz = [0.2, 0.6, 0] }
[constraints.mesh]
gear = { coordinates = ["b", "a"], ratio = "ratio" }
"""
    outside = loaded(wheels)
    slow, fast = numbers(outside, "gear", "slow"), numbers(outside, "gear", "fast")
    assert slow[6] + fast[6] == pytest.approx(0.5) and slow[6] == pytest.approx(2.5 * fast[6])
    np.testing.assert_allclose(slow[:6], [-0.1, 0.0, 0.0, 0.0, 0.0, 1.0])
    inside = loaded(wheels.replace("-2.5", "2.5"))
    slow, fast = numbers(inside, "gear", "slow"), numbers(inside, "gear", "fast")
    assert slow[6] - fast[6] == pytest.approx(0.5) and slow[6] == pytest.approx(2.5 * fast[6])
    skew = loaded(wheels.replace("0.2, 0.6, 0] }", "0.2, 0.6, 0] }\naxis = [0, 0, -1]"))
    slow, fast = numbers(skew, "gear", "slow"), numbers(skew, "gear", "fast")
    assert slow[6] - fast[6] == pytest.approx(0.5)  # about opposite axes they turn the same way


# What a model says itself


DRAWN = """
[parameters]
k = "20 N/m"
[coordinates]
x = { unit = "m", start = 0.1 }
[bodies.block]
mass = "1 kg"
com = ["x", "0"]
[points.hook]
body = "world"
at = ["-1 m", 0]
[energy]
potential = "k/2*x^2"
[draw.coil]
spring = ["hook", ["x", "0"]]
[draw.pull]
force = [["x", "0"], ["-k*x", "0"]]
[draw.wall]
ground = "hook"
[draw.way]
rail = [["-1 m", "-0.1 m"], ["1 m", "-0.1 m"]]
"""


def test_drawings_survive_toml_and_are_evaluated():
    model = Model.from_toml(DRAWN)
    assert Model.from_toml(model.to_toml()).describe() == model.describe()
    built = Model("model")
    k, x = built.parameter("k", "20 N/m"), built.coordinate("x", unit="m", start=0.1)
    built.body("block", mass="1 kg", com=(x, "0"))
    hook = built.point("hook", "world", ("-1 m", 0))
    built.potential("k/2*x^2")
    built.draw("coil", spring=(hook, (x, "0")))
    built.draw("pull", force=[(x, "0"), (-k * x, "0")])
    built.draw("wall", ground="hook")
    built.draw("way", rail=[("-1 m", "-0.1 m"), ("1 m", "-0.1 m")])
    assert built.describe() == model.describe()
    system = loaded(model)
    y = np.array([0.4, 0.0])
    np.testing.assert_allclose(numbers(system, "spring", "coil", y), [-1.0, 0.0, 0.0, 0.4, 0.0, 0.0])
    np.testing.assert_allclose(numbers(system, "force", "pull", y), [0.4, 0.0, 0.0, -8.0, 0.0, 0.0])
    moves = {m["name"]: m.get("moves", False) for m in system.source.header["marks"]}
    assert moves == {"coil": True, "pull": True, "wall": False, "way": False}


@pytest.mark.parametrize(
    ("drawing", "message"),
    [
        ('sprin = ["hook", "hook"]', "unknown key 'sprin'; did you mean 'spring'?"),
        ('spring = ["hook"]', 'a spring takes a list of 2 places, such as ["hook", "hub"]'),
        ('spring = ["hok", "hook"]', "there is no point 'hok'; did you mean 'hook'?"),
        ('ground = ["k", "0"]', "units do not match"),
        ('ground = "h ook"', "a place is a point's name"),
        ("ground = 3", "a list of 2 or 3 components is expected here"),
        ('ground = "hook"\npin = "hook"', "2 are given"),
        ('force = [["x", "0"], ["x", "0"]]', "and N (m*kg/s^2) is expected"),
    ],
)
def test_wrong_drawings_are_refused_where_they_stand(drawing, message):
    with pytest.raises(ModelError) as caught:
        Model.from_toml(DRAWN[: DRAWN.index("[draw.coil]")] + f"[draw.one]\n{drawing}\n").describe()
    assert message in str(caught.value) and "[draw.one]" in str(caught.value)


# Models without marks, and scenes


def test_a_model_without_bodies_has_no_marks():
    text = """
[coordinates]
x = { start = 0.0 }
[energy]
kinetic = "dot(x)^2/2"
[loads.push]
point = ["x", 0]
force = [1, 0]
"""
    system = loaded(text)
    assert not system.has("marks") and not system.bodies


def test_a_model_that_shows_nothing_has_no_marks():
    system = loaded("free_rigid_body")
    assert not system.has("marks") and "marks" not in system.source.header


def test_each_member_of_a_scene_has_its_marks():
    text = (
        "[parameters]\nL = 1\n[gravity]\ny = -9.81\n[coordinates]\na = { start = 0.1 }\nb = { start = 0.2 }\n"
    )
    for name, base in (("a", 0), ("b", 3)):
        text += (
            f'[bodies.rod_{name}]\nmass = 1\ninertia = 0.1\ncom = ["{base} + L/2*sin({name})", "-L/2*cos({name})"]\n'
            f'angle = "{name} - pi/2"\nshape = {{ capsule = [0.02, "L"] }}\n'
            f'[loads.push_{name}]\npoint = ["{base} + L*sin({name})", "-L*cos({name})"]\nforce = ["dot({name})", "0"]\n'
        )
    system = loaded(text)
    assert sum(len(kind["coordinates"]) for kind in system.subsystems) == 2
    assert records(system, "ground") == [("ground", "rod_a_1"), ("ground", "rod_b_1")]
    y = np.array([0.1, 0.2, 0.3, 0.4])
    expected = [3 + np.sin(0.2), -np.cos(0.2), 0.0, 0.4, 0.0, 0.0]
    np.testing.assert_allclose(numbers(system, "force", "push_b", y), expected, rtol=1e-14)
    np.testing.assert_allclose(numbers(system, "ground", "rod_b_1", y), [3.0, 0.0, 0.0], atol=1e-15)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('"kind": "pin"', '"kind": "nail"', "of the kind 'nail'"),
        ('"kind": "ground"', '"kind": "pin"', "has 3 numbers"),
        ('"body": "rod"', '"body": "rid"', "there is no such body"),
        ('"constraints": [0, 1]', '"constraints": [0, 7]', "expected indices of holonomic constraints"),
        ('"signs": [1, 1]', '"signs": [1, 2]', "expected 1 or -1"),
    ],
)
def test_wrong_records_of_marks_are_refused(before, after, message):
    text = derive_text(library.load(library.bundled()["slider_crank"])).text
    head, marks, rest = text.partition('"marks": [')
    assert before in rest
    with pytest.raises(ModuleError, match=message.replace("[", r"\[")):
        load(head + marks + rest.replace(before, after, 1))
