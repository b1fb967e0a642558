"""Frictions that would push, or slide along one direction twice, are refused by name."""

from __future__ import annotations

import pytest

from symgen import Model
from symgen.errors import ModelError


@pytest.mark.parametrize(
    "given, words",
    [
        ({"coordinate": "x", "force": -1}, "force: the friction is negative at the parameters' values: -1"),
        ({"coordinate": "x", "force": "F"}, "force: the friction is negative at the parameters' values: -2"),
        ({"coordinate": "x", "force": 1, "static": -1}, "static: the friction is negative"),
        (
            {"coordinates": ["x", "x"], "force": 1},
            "coordinates: both components of the sliding velocity are the same",
        ),
        ({"speeds": ["dot(x)", "dot(x)"], "force": 1}, "speeds: both components"),
    ],
)
def test_what_is_no_friction(given, words):
    m = Model("m")
    m.parameter("F", -2)
    x, y = m.coordinate("x"), m.coordinate("y")
    m.body("b", mass=1, com=(x, y))
    with pytest.raises(ModelError, match=words):
        m.friction("f", **given)
        m.describe()
