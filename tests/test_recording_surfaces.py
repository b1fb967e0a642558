"""Surfaces that something rolls on or touches in recordings: where their lines are, and which there are."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model
from symgen.link import derive_text
from symgen.runtime import load
from symgen.runtime.recording.rrd.read import read_rrd

BALL = """
[parameters]
r = "5 cm"
a = "0.1 m"
k = "2 1/m"
tilt = "10 deg"
[frames.tray]
body = "BODY"
at = [0.1, 0, 0.3]
rpy = ["tilt", 0, 0]
[bodies.ball]
density = "1200 kg/m^3"
shape = { sphere = ["r"] }
[bodies.table]
mass = 1.0
inertia = [1, 1, 1]
[joints.turn]
type = "revolute"
child = "table"
axis = [0, 0, 1]
rate = 1.0
[joints.float]
type = "free"
child = "ball"
guess = [0.2, 0.1, 0.5, 1, 0, 0, 0]
rate_guess = [0.5, 0.2, 0, 0, 0, 0]
[rolling.ball]
body = "ball"
ball = "r"
plane = "tray"
HEIGHT
[gravity]
z = "-9.81 m/s^2"
"""
WAVES = 'height = "a*cos(k*here_x)*cos(k*here_y)"'
WHEEL = """
[parameters]
r = "5 cm"
[coordinates]
x = { guess = 0.3, unit = "m" }
y = { guess = 0.2, unit = "m" }
phi = { unit = "rad" }
[bodies.wheel]
density = "1200 kg/m^3"
shape = { cylinder = ["r", "1 cm"], axis = [0, 0, 1] }
com = ["x", "y"]
angle = "phi"
[rolling.wheel]
body = "wheel"
ball = "r"
HEIGHT
[gravity]
y = "-9.81 m/s^2"
"""


def of_text(text):
    return load(derive_text(Model.from_toml(text)).text)


def lines_of(path, entity):
    """The lines of an entity, shape (places, 3) each, and the frame that they are in."""
    _, batches, _ = read_rrd(path, [entity])
    found = [b for b in batches.get(entity, ()) if "LineStrips3D:strips" in b.schema.names]
    strips = (
        [np.array(strip) for strip in found[-1].column("LineStrips3D:strips")[0].as_py()] if found else []
    )
    frame = [b.column("CoordinateFrame:frame")[0].as_py()[0] for b in batches.get(entity, ())
             if "CoordinateFrame:frame" in b.schema.names]  # fmt: skip
    return strips, frame


def turned(tilt):
    c, s = np.cos(tilt), np.sin(tilt)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


@pytest.mark.parametrize(
    ("body", "height"), [("world", WAVES), ("table", WAVES), ("world", ""), ("table", "")]
)
def test_nets_lie_on_surfaces_and_reach_beyond_what_rolls(tmp_path, body, height):
    """In the axes of the body that the surface belongs to, by the formula of the model's text."""
    system = of_text(BALL.replace("BODY", body).replace("HEIGHT", height))
    run = system.run(1.0)
    run.save(tmp_path / "a.rrd")
    lines, frame = lines_of(tmp_path / "a.rrd", "world/ground/tray")
    assert len(lines) == 26 and bool(frame and frame[-1].endswith("table")) is (body == "table")
    local = (np.concatenate(lines) - [0.1, 0, 0.3]) @ turned(np.radians(10.0))
    wanted = 0.1 * np.cos(2 * local[:, 0]) * np.cos(2 * local[:, 1]) if height else 0.0
    assert np.abs(local[:, 2] - wanted).max() < 1e-6
    ball = np.stack([run[f"float_{c}"] for c in "xyz"], axis=1)
    if body == "table":
        angle = run["turn"]
        c, s = np.cos(angle), np.sin(angle)
        ball = np.stack(
            [c * ball[:, 0] + s * ball[:, 1], c * ball[:, 1] - s * ball[:, 0], ball[:, 2]], axis=1
        )
    way = (ball - [0.1, 0, 0.3]) @ turned(np.radians(10.0))
    assert (local[:, :2].min(axis=0) < way[:, :2].min(axis=0)).all()
    assert (local[:, :2].max(axis=0) > way[:, :2].max(axis=0)).all()


@pytest.mark.parametrize("height", ['height = "0.2*here_x^2/r"', ""])
def test_planar_models_have_a_curve(tmp_path, height):
    system = of_text(WHEEL.replace("HEIGHT", height))
    run = system.run(0.5)
    run.save(tmp_path / "a.rrd")
    (line,), _ = lines_of(tmp_path / "a.rrd", "world/ground/world")
    assert np.abs(line[:, 1] - (0.2 * line[:, 0] ** 2 / 0.05 if height else 0.0)).max() < 1e-6
    assert line[0, 0] < run["x"].min() and line[-1, 0] > run["x"].max()


def test_what_is_seen_anyway_is_not_drawn_again():
    """Not the ground of models in space, nor bodies with shapes; one net for all on one surface, contacts too."""
    ground = BALL.replace('plane = "tray"', "").replace("HEIGHT", "").replace("BODY", "world")
    assert "surface" not in {m["kind"] for m in of_text(ground).source.header.get("marks", ())}
    second = (
        BALL.replace("BODY", "world").replace("HEIGHT", WAVES)
        + """
[bodies.other]
density = "1200 kg/m^3"
shape = { sphere = ["r"] }
[joints.fall]
type = "free"
child = "other"
start = [0.6, 0.1, 0.9, 1, 0, 0, 0]
[contacts.other]
body = "other"
plane = "tray"
height = "a*cos(k*here_x)*cos(k*here_y)"
stiffness = 1e4
"""
    )
    marks = [m for m in of_text(second).source.header["marks"] if m["kind"] == "surface"]
    assert [m["carries"] for m in marks] == [["ball", "other"]]
    shaped = BALL.replace("BODY", "world").replace("HEIGHT", "").replace('plane = "tray"', 'plane = "table"')
    shaped = shaped.replace("inertia = [1, 1, 1]", "inertia = [1, 1, 1]\nshape = { box = [1, 1, 0.1] }")
    assert "surface" not in {m["kind"] for m in of_text(shaped).source.header.get("marks", ())}
