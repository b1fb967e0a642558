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


_OF_BRISTLES = {
    "stiffness": "1e5 N/m", "damping": "300 N*s/m", "viscous": "0.4 N*s/m", "coulomb": "1 N", "static": "1.5 N",
    "stribeck": "1 mm/s", "unit": "m",
}  # fmt: skip


@pytest.mark.parametrize(
    "given, expected",
    [
        ({"force": "2 kg"}, "force: .* N "),
        ({"force": "2 N", "static": "3 kg"}, "static: .* N "),
        ({"force": "2 N", "smooth": "1 kg"}, "smooth: .* m/s "),
        ({"force": "2 N", "creep": "1 m"}, "creep: .* m/s "),
        ({"coefficient": 0.3, "normal": "floor", "smooth": "1 N"}, "smooth: .* m/s "),
        ({"coulomb": "1 kg"}, "coulomb: .* N "),
        ({"stribeck": "1 m"}, "stribeck: .* m/s "),
        ({"viscous": "1 N"}, "viscous: .* kg/s "),
    ],
)
def test_units_fit_the_speed_that_is_rubbed_against(given, expected):
    """None of them was looked at: a width in kg was taken for one in m/s."""
    m = Model("m")
    x, y = m.coordinate("x", unit="m", rate=1), m.coordinate("y", unit="m")
    m.body("b", mass="1 kg", com=(x, y))
    m.stop("floor", y)
    if given.keys() & {"force", "coefficient"}:
        m.friction("rub", coordinate=x, **given)
    else:
        m.bristle("rub", coordinate=x, **_OF_BRISTLES | given)
    with pytest.raises(ModelError, match=f"{expected}.*is expected"):
        m.describe()


def test_units_that_fit_are_taken():
    m = Model("m")
    x, phi = m.coordinate("x", unit="m", rate=1), m.coordinate("phi", rate=1)
    m.body("b", mass="1 kg", inertia="0.1 kg*m^2", com=(x, 0), angle=phi)
    m.friction("rub", coordinate=x, force="2 N", static="3 N")
    m.friction("hub", coordinate=phi, torque="2 N*m", smooth="1 rpm")
    m.bristle("hairs", coordinate=x, **_OF_BRISTLES)
    m.describe()
