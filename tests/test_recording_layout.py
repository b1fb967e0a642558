"""The screen of a recording: which plots there are, what their axes span, and where a scene is seen from."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symgen
from symgen import Model, cos, dot, sin
from symgen.runtime.inputs import Controller
from symgen.runtime.recording import layout, schema
from symgen.runtime.recording.rrd.read import read_rrd


def numbers(path, entity, column):
    """All numbers of a column of an entity, one after the other."""
    _, batches, _ = read_rrd(path, [entity])
    found = [b.column(column).flatten() for b in batches[entity] if column in b.schema.names]
    while found and found[0].type.num_fields:
        found = [part.flatten() for part in found]
    return np.concatenate([part.to_numpy(zero_copy_only=False) for part in found])


# Axes


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e6), st.integers(0, 30))
def test_three_labels_stand_at_every_axis(low, extent, room):
    bottom, top = layout.labelled(low, low + extent, room)
    assert bottom <= low and low + extent <= top
    spans = 10.0 ** np.arange(-12, 10)
    # The viewer labels the finest power of ten whose multiples it has room for.
    unit = next(unit for unit in spans if top - bottom <= max(room, 6) * unit)
    assert np.floor(top / unit) - np.ceil(bottom / unit) + 1 >= 3
    assert top - bottom <= 5.0 * max(extent, 1e-4 * max(abs(low), abs(low + extent)))


def test_plots_say_their_units_and_multipliers_are_grouped_by_theirs():
    header = {
        "coordinates": [{"name": "x", "unit": "m"}], "rates": [{"name": "x", "unit": "m/s"}],
        "inputs": [{"name": "idle", "unit": "N"}, {"name": "push", "unit": "N"}],
        "outputs": [{"name": "speed", "unit": "m/s"}],
        "constraints": [
            {"name": "a", "kind": "holonomic", "multiplier": "N"},
            {"name": "b", "kind": "holonomic", "multiplier": "N*m"},
        ],
    }  # fmt: skip
    rows = layout.plot_rows(header, ["push"])
    titles = [[curves.title for curves in row.plots] for row in rows]
    assert titles == [
        ["Coordinates [m]: x", "Rates [m/s]: dot(x)"],
        ["Inputs [N]: push"],
        ["Outputs [m/s]: speed"],
        ["Energy [J]", "Multipliers [N]: a", "Multipliers [N*m]: b"],
        ["Energy error, log10 of [1]", "Constraint residual, log10 of SI units", "Step size [s]"],
    ]
    assert rows[1].plots[0].columns == (1,)
    assert [curves.columns for curves in rows[3].plots] == [(0, 1, 2), (0,), (1,)]


# What is recorded


@pytest.fixture(scope="module")
def model():
    m = Model("driven", gravity=(0, "-9.81 m/s^2"))
    theta = m.coordinate("theta", unit="rad", start=0.3)
    l = m.parameters(l="0.5 m")
    m.body("bob", mass="1 kg", com=(l * sin(theta), -l * cos(theta)))
    m.force(theta, m.input("tau", unit="N*m"))
    m.output("height", l - l * cos(theta))
    m.output("swing", l * dot(theta))
    return m


def test_outputs_and_multipliers_have_the_units_that_follow(model):
    system = model.derive()
    assert [(o["name"], o["unit"]) for o in system.outputs] == [("height", "m"), ("swing", "m/s")]
    four_bar = symgen.load("four_bar")
    assert {c["multiplier"] for c in four_bar.constraints} == {"N"}


def test_what_a_controller_says_is_drawn(model, tmp_path):
    path = tmp_path / "run.rrd"
    solution = model.derive().run(
        t_end=1.0, inputs={"tau": Controller(lambda t, x: -2.0 * x[1], period=0.05)}, fps=40
    )
    solution.save(path)
    drawn = numbers(path, f"{schema.PLOTS}/inputs", "Scalars:scalars")
    np.testing.assert_array_equal(drawn, solution["tau"])
    assert np.ptp(drawn) > 0.1


def test_equal_steps_are_a_number(model, tmp_path):
    fixed, adaptive = tmp_path / "fixed.rrd", tmp_path / "adaptive.rrd"
    model.derive().run(t_end=1.0, method="rk4", step=0.015).save(fixed)
    model.derive().run(t_end=1.0, method="dop853").save(adaptive)
    _, found, _ = read_rrd(fixed, [schema.EQUAL_STEPS])
    assert "h = 0.015 s" in str(found[schema.EQUAL_STEPS][0].to_pydict())
    assert schema.EQUAL_STEPS not in read_rrd(adaptive, [schema.EQUAL_STEPS])[1]


# The eye


def test_a_car_is_followed_along_its_road_and_heaves():
    t = np.linspace(0.0, 10.0, 200)
    middles = np.stack([10.0 * t, 0.5 + 0.05 * np.sin(20 * t), 0.0 * t], axis=1)
    path = layout.follow(middles, np.array([4.0, 1.5, 2.0]))
    np.testing.assert_allclose(path[:, 0], 10.0 * t)
    np.testing.assert_array_equal(path[:, 1:], 0.0)
    camera = layout.choose_camera(np.zeros(3), np.ones(3), True, path)
    np.testing.assert_allclose(camera.path - camera.eye, path)


def test_what_swings_is_not_followed():
    t = np.linspace(0.0, 10.0, 200)
    assert layout.follow(np.stack([np.sin(t), -np.cos(t), 0 * t], axis=1), np.array([0.8, 0.8, 0.1])) is None


def test_the_recorded_eye_moves_with_a_body_that_travels(tmp_path):
    m = Model("sledge")
    x = m.coordinate("x", unit="m", start=0.0, rate=10.0)
    m.body("block", mass="1 kg", com=(x, 0), shape={"box": ["1 m", "0.5 m", "0.5 m"]})
    path = tmp_path / "run.rrd"
    solution = m.derive().run(t_end=10.0, fps=10)
    solution.save(path)
    places = numbers(path, schema.FOLLOWING_EYE, "Transform3D:translation").reshape(-1, 3)
    np.testing.assert_allclose(np.diff(places[:, 0]), np.diff(solution["x"]), atol=1e-4)
    np.testing.assert_allclose(places[:, 1:], places[:1, 1:].repeat(len(places), axis=0), atol=1e-4)
