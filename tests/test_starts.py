"""Starts that are expressions of parameters: evaluated again where a run sets them."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model, sin
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.toml_reader import read_text

HANGING = """
[parameters]
a = "30 deg"
l = "0.5 m"
v0 = "2 m/s"
[definitions]
half = "l/2"
[coordinates]
x = { unit = "m", start = "sin(a)*half", rate = "v0" }
y = { unit = "m", guess = "-l" }
[bodies.bob]
mass = "1 kg"
com = ["x", "y"]
[bodies.arm]
mass = "2 kg"
inertia = [0.1, 0.1, 0.1]
[joints.arm]
type = "free"
child = "arm"
start = ["l", 0, 0, 1, 0, 0, 0]
rate_guess = [0, 0, "v0", 0, 0, "v0/l"]
[joints.slide]
type = "prismatic"
child = "block"
guess = "l/4"
rate = "2*v0"
[bodies.block]
mass = "1 kg"
[gravity]
y = "-9.81 m/s^2"
"""


def starts(run) -> dict[str, float]:
    """The first values of a run by name."""
    names = ["x", "y", "arm_x", "slide", "dot(x)", "arm_vz", "arm_wz", "dot(slide)"]
    return {name: float(run[name][0]) for name in names}


def expected(a: float, l: float, v0: float) -> dict[str, float]:
    return {
        "x": np.sin(a) * l / 2, "y": -l, "arm_x": l, "slide": l / 4, "dot(x)": v0, "arm_vz": v0, "arm_wz": v0 / l,
        "dot(slide)": 2 * v0,
    }  # fmt: skip


def test_starts_follow_the_parameters_of_a_run():
    system = derive(read_text(HANGING))
    assert starts(system.run(t_end=0.01)) == pytest.approx(expected(np.pi / 6, 0.5, 2.0), rel=1e-15)
    run = system.run(t_end=0.01, parameters={"a": 1.0, "l": 0.3})
    assert starts(run) == pytest.approx(expected(1.0, 0.3, 2.0), rel=1e-15)
    run = system.run(t_end=0.01, parameters={"l": 0.3}, start={"x": 0.7}, rate={"slide": 0.1})
    assert starts(run) == pytest.approx(
        {**expected(np.pi / 6, 0.3, 2.0), "x": 0.7, "dot(slide)": 0.1}, rel=1e-15
    )


def test_a_header_has_their_values():
    system = derive(read_text(HANGING))
    assert system.coordinates[0]["value"] == pytest.approx(0.125)
    assert [c["enforced"] for c in system.coordinates[:2]] == [True, False]
    assert system.rates[0]["value"] == 2.0


@pytest.mark.parametrize("l", [0.5, 0.4])
def test_constraints_move_guesses_and_keep_starts(l):
    m = Model("pendulum", gravity=(0, -9.81))
    a, length = m.parameters(a=0.3, l=0.5)
    x = m.coordinate("x", start=length * sin(a))
    y = m.coordinate("y", guess=-length)
    m.body("bob", mass=1, com=(x, y))
    m.constraint("rod", x**2 + y**2 - length**2)
    run = m.derive().run(t_end=0.01, parameters={"l": l})
    assert (run["x"][0], run["y"][0]) == pytest.approx((l * np.sin(0.3), -l * np.cos(0.3)), rel=1e-12)


def test_files_round_trip():
    text = read_text(HANGING).to_toml()
    assert read_text(text).to_toml() == text
    assert starts(derive(read_text(text)).run(t_end=0.01, parameters={"l": 0.3})) == pytest.approx(
        expected(np.pi / 6, 0.3, 2.0), rel=1e-15
    )


def test_models_with_numbers_have_no_new_function():
    system = derive(read_text('[coordinates]\nx = { start = 0.1 }\n[bodies.b]\nmass = 1\ncom = ["x", 0]'))
    assert "starts" not in system.source.header and "starts" not in system.source.functions


@pytest.mark.parametrize(
    "old, new, place, words",
    [
        ('"sin(a)*half"', '"sin(y)*half"', "coordinates x.start", "a start cannot depend on a coordinate, 'y'"),
        ('"sin(a)*half"', '"sin(a)*t"', "coordinates x.start", "cannot depend on the time"),
        ('"sin(a)*half"', '"sin(a)*v0"', "coordinates x.start", "units do not match"),
        ('"sin(a)*half"', '"sin(a)*hlf"', "coordinates x.start", "did you mean 'half'"),
        ('"sin(a)*half"', '"half/(v0 - 2)"', "coordinates x.start", "has no finite value"),
        ('rate = "v0"', 'rate = "l"', "coordinates x.rate", "units do not match"),
        ('guess = "-l"', 'guess = "-l", start = "l"', "coordinates y.guess", "both given"),
        ('start = ["l", 0, 0, 1', 'start = ["l", 0, 0, "l"', "joints.arm start, element 4", "is not a number"),
        ('start = ["l", 0', 'start = ["v0", 0', "joints.arm start, element 1", "units do not match"),
    ],
)  # fmt: skip
def test_wrong_starts(old, new, place, words):
    assert old in HANGING
    with pytest.raises(ModelError, match=words) as caught:
        read_text(HANGING.replace(old, new), file="a.toml").describe()
    assert f"{caught.value.table} {caught.value.key}" == place
