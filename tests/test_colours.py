"""Colours of bodies: from a model file to what is drawn."""

from __future__ import annotations

import json

import numpy as np
import pytest

from symgen import Model
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.runtime import load
from symgen.runtime.errors import ModuleError, RuntimeModelError
from symgen.runtime.recording import layout
from symgen.runtime.recording.geometry import primitives
from symgen.runtime.report.drawing import drawing


def cart(shape):
    m = Model("cart")
    x = m.coordinate("x", unit="m")
    m.body("cart", mass=1, com=(x, 0), shape=shape)
    m.body("other", mass=1, com=(x + 1, 0), shape={"sphere": [0.1]})
    return m


@pytest.mark.parametrize(
    "shape",
    [
        {"box": [0.2, 0.1, 0.1], "color": "red"},
        {"cylinder": [0.1, 0.2], "axis": [0, 1], "offset": [0, 0.1], "color": "#d04040"},
        [{"box": [0.2, 0.1, 0.1]}, {"sphere": [0.1], "offset": [0, 0.1], "color": "red"}],
    ],
    ids=["name", "placed", "one of several"],
)
def test_a_colour_reaches_the_picture_and_comes_back_from_toml(shape):
    model = cart(shape)
    again = Model.from_toml(model.to_toml())
    for one in (model, again):
        text = derive_text(one).text
        system = load(text)
        assert system.bodies[0]["color"] == "#d04040" and "color" not in system.bodies[1]
    colours = layout.choose_colours(list(system.bodies))
    assert colours[0] == (0xD0, 0x40, 0x40) and colours[1] == layout.schema.colour(1)
    svg = drawing(system, system.parameter_values(), 0.0, np.zeros(2))
    assert "fill:#d04040" in svg


@pytest.mark.parametrize(
    ("shape", "says"),
    [
        ({"box": [1, 1, 1], "color": "rad"}, "did you mean 'red'"),
        ({"box": [1, 1, 1], "color": 'red"/><script>'}, "is no colour"),
        ({"box": [1, 1, 1], "color": [1, 0, 0]}, "is no colour"),
        ({"color": "red"}, "a shape is one of"),
        ([{"box": [1, 1, 1], "color": "red"}, {"box": [1, 1, 1], "color": "blue"}], "one colour"),
    ],
)
def test_what_is_no_colour_is_refused(shape, says):
    with pytest.raises(ModelError, match=says):
        cart(shape)


def test_a_module_with_what_is_no_colour_is_refused():
    text = derive_text(cart({"box": [1, 1, 1], "color": "red"})).text
    with pytest.raises(ModuleError, match="expected '#rrggbb'"):
        load(text.replace("#d04040", '\\" onload'))


@pytest.mark.parametrize("name", ["a.stl", "a.obj", "a.glb", "a.gltf"])
def test_meshes_have_the_bodys_colour_or_their_own(tmp_path, name):
    (tmp_path / name).write_text(json.dumps({"asset": {"version": "2.0"}}))
    body = {"name": "b", "shape": "mesh", "sizes": 0, "mesh": name, "planar": False}
    turned = np.eye(3)[None, None]
    (plain,) = primitives([body], np.zeros(0), turned, 1.0, tmp_path)
    (coloured,) = primitives([{**body, "color": "#ff0000"}], np.zeros(0), turned, 1.0, tmp_path)
    assert plain.painted == name.endswith(("glb", "gltf")) and not coloured.painted


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ('{"buffers": [{"uri": "../secret.bin"}]}', "names other files"),
        ('{"images": [{"uri": "http://example.org/a.png"}]}', "names other files"),
        ("[" * 100_000, "is no glTF file"),
        ("[]", "is no glTF file"),
    ],
)
def test_gltf_that_reaches_out_is_refused(tmp_path, content, says):
    (tmp_path / "a.gltf").write_text(content)
    body = {"name": "b", "shape": "mesh", "sizes": 0, "mesh": "a.gltf", "planar": False}
    with pytest.raises(RuntimeModelError, match=says):
        primitives([body], np.zeros(0), np.eye(3)[None, None], 1.0, tmp_path)


def test_a_mesh_that_is_too_large_is_refused(tmp_path):
    with (tmp_path / "a.stl").open("wb") as file:
        file.truncate((64 << 20) + 1)
    body = {"name": "b", "shape": "mesh", "sizes": 0, "mesh": "a.stl", "planar": False}
    with pytest.raises(RuntimeModelError, match="the most are 64"):
        primitives([body], np.zeros(0), np.eye(3)[None, None], 1.0, tmp_path)
