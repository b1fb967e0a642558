"""What bodies roll on or touch is drawn: planes, surfaces and curves, as far as a run takes the bodies."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_recording_marks import column, frame_of

from symgen import Model
from symgen.runtime.errors import ModuleError
from symgen.runtime.recording import schema
from symgen.runtime.report.drawing import drawing

BOWL = """
[parameters]
r = "0.1 m"
c = "0.5 1/m"
[bodies.marble]
mass = "1 kg"
inertia = [0.004, 0.004, 0.004]
[joints.marble]
type = "free"
child = "marble"
guess = [0.5, 0.2, 0.3, 1, 0, 0, 0]
rate_guess = [0, 1.0, 0, 0, 0, 0]
[frames.dish]
at = [0.1, 0.2, 0.3]
rpy = ["10 deg", "-5 deg", "40 deg"]
[rolling.ball]
body = "marble"
ball = "r"
plane = "dish"
height = "c*(here_x^2 + here_y^2) + 0.05*sin(4*here_x)"
[gravity]
z = "-9.81 m/s^2"
"""
HILL = """
[parameters]
r = "0.1 m"
[bodies.hoop]
mass = "1 kg"
inertia = 0.01
com = ["x", "y"]
angle = "phi"
[coordinates]
x = { start = 0.5 }
y = { guess = 0.4 }
phi = { start = 0.0 }
[rolling.rim]
body = "hoop"
wheel = "r"
height = "0.3*cos(2*here_x)"
[gravity]
y = "-9.81 m/s^2"
"""
RAMP = """
[bodies.slide]
mass = 2
inertia = [1, 1, 1]
com = [0.3, 0, 0.1]
[joints.slide]
type = "prismatic"
child = "slide"
axis = [1, 0, 0]
rate = 0.4
[bodies.ball]
density = "1000 kg/m^3"
shape = { sphere = ["0.1 m"] }
[joints.ball]
type = "free"
child = "ball"
guess = [0.2, 0, 0.5, 1, 0, 0, 0]
[frames.ramp]
body = "slide"
at = [0, 0, 0.2]
rpy = [0, "20 deg", 0]
[rolling.ball]
body = "ball"
ball = "0.1 m"
plane = "ramp"
[gravity]
z = "-9.81 m/s^2"
"""


def run_of(text, tmp_path, t_end=1.0, **options):
    run = Model.from_toml(text).derive().run(t_end=t_end, **options)
    run.save(tmp_path / "run.rrd")
    return run, tmp_path / "run.rrd"


def test_a_surface_is_drawn_where_it_is_and_as_far_as_the_ball_goes(tmp_path):
    run, path = run_of(BOWL, tmp_path, 2.0, parameters={"c": 0.7})
    points = column(path, f"{schema.GROUND}/ball", "LineStrips3D:strips", 3)
    turned = Rotation.from_euler("xyz", [10, -5, 40], degrees=True)
    x, y, z = turned.inv().apply(points - [0.1, 0.2, 0.3]).T
    np.testing.assert_allclose(z, 0.7 * (x**2 + y**2) + 0.05 * np.sin(4 * x), atol=1e-6)
    way = np.stack([run[f"marble_{c}"] for c in "xyz"], axis=1)
    here = turned.inv().apply(way - [0.1, 0.2, 0.3])
    for own, drawn in ((here[:, 0], x), (here[:, 1], y)):
        assert drawn.min() < own.min() - 0.1 and own.max() + 0.1 < drawn.max()
        assert np.ptp(drawn) < np.ptp(own) + 0.6  # and not much farther


def test_a_curve_has_hatching_below(tmp_path):
    run, path = run_of(HILL, tmp_path)
    points = column(path, f"{schema.GROUND}/rim", "LineStrips3D:strips", 3)
    above = points[:, 1] - 0.3 * np.cos(2 * points[:, 0])
    curve = np.abs(above) < 1e-4
    assert curve.sum() > 200 and (above[~curve] < 0.0).all() and not points[:, 2].any()
    assert points[:, 0].min() < run["x"].min() and run["x"].max() < points[:, 0].max()


def test_a_plane_moves_with_its_body(tmp_path):
    run, path = run_of(RAMP, tmp_path)
    entity = f"{schema.GROUND}/ball"
    assert frame_of(path, entity)[-1] == f"tf#/{schema.BODIES}/slide"
    points = column(path, entity, "LineStrips3D:strips", 3)
    points += np.array([0.3, 0, 0.1])  # they are from the centre of mass
    x, _, z = Rotation.from_euler("y", 20, degrees=True).inv().apply(points - [0, 0, 0.2]).T
    np.testing.assert_allclose(z, 0.0, atol=1e-6)
    apart = np.stack([run["ball_x"] - run["slide"], run["ball_y"], run["ball_z"] - 0.2], axis=1)
    here = Rotation.from_euler("y", 20, degrees=True).inv().apply(apart)
    np.testing.assert_allclose(here[:, 2], 0.1, atol=1e-8)
    assert x.min() < here[:, 0].min() - 0.1 and here[:, 0].max() + 0.1 < x.max()


def test_a_plane_of_a_body_with_a_shape_is_drawn_by_the_shape():
    shaped = RAMP.replace("com = [0.3, 0, 0.1]", "com = [0.3, 0, 0.1]\nshape = { box = [2, 1, 0.1] }")
    assert "plane" not in kinds(shaped) and "plane" in kinds(RAMP)


def test_wheels_on_one_road_have_one_plane_and_contacts_have_theirs():
    m = Model("car", gravity=(0, 0, -9.81))
    for name in ("a", "b"):
        m.body(name, density=1000, shape={"sphere": [0.1]})
        m.joint(name, "free", name, start=[0, 0, 0.1, 1, 0, 0, 0])
    m.rolling("roll", "a", ball=0.1)
    m.contact("fall", body="b")
    marks = m.derive().source.header["marks"]
    (plane,) = [mark for mark in marks if mark["kind"] == "plane"]
    assert plane["carries"] == ["a", "b"] and plane["name"] == "roll"


def test_a_blade_seen_from_above_has_no_plane():
    m = Model("sled")
    x, y, phi = (m.coordinate(name) for name in ("x", "y", "phi"))
    m.body("sled", mass=1, inertia=1, com=(x, y), angle=phi)
    m.rolling("edge", "sled", knife=[1, 0])
    assert not any(mark["kind"] == "plane" for mark in m.derive().source.header.get("marks", ()))


@pytest.mark.parametrize("text", [BOWL, HILL, RAMP], ids=["bowl", "hill", "ramp"])
def test_pages_show_floors(text):
    system = Model.from_toml(text).derive()
    q, v, _, _ = system.initial_state()
    picture = drawing(system, system.parameter_values(), 0.0, np.concatenate([q, v]))
    assert picture.count("M") > 20


def test_a_module_that_carries_what_is_not_there_is_refused():
    from symgen.link import derive_text
    from symgen.runtime import load

    text = derive_text(Model.from_toml(HILL)).text
    broken = text.replace("'carries': ['hoop']", "'carries': ['hoops']").replace(
        '"carries": ["hoop"]', '"carries": ["hoops"]'
    )
    assert broken != text
    with pytest.raises(ModuleError, match="names of bodies"):
        load(broken)


def kinds(text):
    return [mark["kind"] for mark in Model.from_toml(text).derive().source.header.get("marks", ())]
