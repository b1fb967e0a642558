"""Frictions that would push, or slide along one direction twice, are refused by name."""

from __future__ import annotations

import pytest

from symgen import Model
from symgen.errors import ModelError
from symgen.runtime.errors import RuntimeModelError


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


@pytest.mark.parametrize("given", [{"force": 1}, {"coefficient": 0.1, "normal": "floor"}])
def test_friction_that_creeps_is_named_where_series_are_refused(given):
    m = Model("m")
    x, y = m.coordinate("x", unit="m", rate=1), m.coordinate("y", unit="m")
    m.body("b", mass=1, com=(x, y))
    m.constraint("floor", y)
    m.friction("rub", coordinate="x", creep=0.1, **given)
    with pytest.raises(
        RuntimeModelError, match=r"friction 'rub' creeps.* give it 'smooth' in the place of 'creep'"
    ):
        m.derive().run(t_end=0.1, method="taylor")
