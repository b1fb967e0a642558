"""Joints whose attitude is three angles by any sequence, beside Euler's equations, and sensors of such angles."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from symgen import Model
from symgen.errors import ModelError
from symgen.runtime.errors import RuntimeModelError

MASS, CENTRE, GRAVITY = 2.0, np.array([0.1, -0.05, 0.3]), np.array([0.0, 0.0, -9.81])
INERTIA = np.array([[0.3, 0.01, 0.02], [0.01, 0.2, -0.03], [0.02, -0.03, 0.25]])
SEQUENCES = ["".join(x) for x in itertools.product("xyz", repeat=3) if x[0] != x[1] != x[2]]
ANGLES, RATES = np.array([0.3, 0.9, -0.4]), np.array([0.5, -0.3, 0.8])


def attitude(sequence, angles):
    return Rotation.from_euler(sequence.upper(), angles).as_matrix()


def body_rates(sequence, angles, rates):
    """The angular velocity in body axes, by Rᵀ dR/dt with a complex step in each rotation."""
    matrices = []
    for k, letter in enumerate(sequence):
        axis = "xyz".index(letter)
        skew = np.zeros((3, 3))
        skew[(axis + 2) % 3, (axis + 1) % 3], skew[(axis + 1) % 3, (axis + 2) % 3] = 1.0, -1.0
        matrices.append((attitude(letter, angles[k]), skew))
    (a, sa), (b, sb), (c, sc) = matrices
    turning = rates[0] * sa @ a @ b @ c + rates[1] * a @ sb @ b @ c + rates[2] * a @ b @ sc @ c
    w = attitude(sequence, angles).T @ turning
    return np.array([w[2, 1], w[0, 2], w[1, 0]])


def heavy_body(inertia, pull, start, w, t_end):
    """Euler's equations of a body about a fixed point or its centre, with a torque of its weight at `pull`."""

    def f(t, y):
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        torque = np.cross(pull, MASS * Rotation.from_quat(q).inv().apply(GRAVITY))
        turned = 0.5 * np.append(q[3] * w + np.cross(q[:3], w), -q[:3] @ w)
        return np.append(turned, np.linalg.solve(inertia, torque - np.cross(w, inertia @ w)))

    y = np.append(Rotation.from_matrix(start).as_quat(), w)
    end = solve_ivp(f, (0.0, t_end), y, method="DOP853", rtol=1e-12, atol=1e-13).y[:4, -1]
    return Rotation.from_quat(end).as_matrix()


def body(model):
    i = INERTIA
    elements = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]
    model.body("body", mass=MASS, com=list(CENTRE), inertia=elements)


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_a_heavy_body_on_a_gimbal(sequence):
    m = Model("gimbal", gravity=tuple(GRAVITY))
    body(m)
    m.joint("j", "gimbal", "body", sequence=sequence, start=ANGLES, rate=RATES)
    m.frame("of_body", body="body")
    for k in (1, 2, 3):
        m.output(f"seen_{k}", f"angle(world, of_body, {sequence}{k})")
    run = m.derive().run(t_end=0.4, method="dop853", rtol=1e-11, atol=1e-13)
    about = INERTIA + MASS * (CENTRE @ CENTRE * np.eye(3) - np.outer(CENTRE, CENTRE))
    w = body_rates(sequence, ANGLES, RATES)
    expected = heavy_body(about, CENTRE, attitude(sequence, ANGLES), w, 0.4)
    found = np.stack([run[f"j_{k}"] for k in (1, 2, 3)], axis=1)
    np.testing.assert_allclose(attitude(sequence, found[-1]), expected, atol=1e-9)
    seen = np.stack([run[f"seen_{k}"] for k in (1, 2, 3)], axis=1)
    for a, b in zip(seen, found, strict=True):
        np.testing.assert_allclose(attitude(sequence, a), attitude(sequence, b), atol=1e-9)
    middle = seen[:, 1]
    low, high = (0.0, np.pi) if sequence[0] == sequence[2] else (-np.pi / 2, np.pi / 2)
    assert (low <= middle).all() and (middle <= high).all()


@pytest.mark.parametrize("method", ["taylor", "radau5", "rk4"])
def test_a_body_that_floats(method):
    m = Model("thrown", gravity=tuple(GRAVITY))
    body(m)
    m.joint("j", "floating", "body", sequence="zyx", start=[0, 0, 1, *ANGLES], rate=[1, 0, 2, *RATES])
    options = {"step": 1e-3} if method == "rk4" else {"rtol": 1e-11, "atol": 1e-13}
    run = m.derive().run(t_end=0.5, method=method, **options)
    start, w = attitude("zyx", ANGLES), body_rates("zyx", ANGLES, RATES)
    turned = heavy_body(INERTIA, np.zeros(3), start, w, 0.5)
    centre = (
        [0, 0, 1]
        + start @ CENTRE
        + (np.array([1, 0, 2]) + start @ np.cross(w, CENTRE)) * 0.5
        + GRAVITY * 0.125
    )
    np.testing.assert_allclose([run[f"j_{c}"][-1] for c in "xyz"], centre - turned @ CENTRE, atol=1e-9)
    np.testing.assert_allclose(attitude("zyx", [run[f"j_{k}"][-1] for k in (1, 2, 3)]), turned, atol=1e-9)


def test_equal_bodies_with_other_sequences_are_no_copies_of_each_other():
    m = Model("two", gravity=tuple(GRAVITY))
    ends = {}
    for name, sequence in (("a", "zxz"), ("b", "xyz")):
        m.body(name, mass=MASS, com=list(CENTRE), inertia=[0.3, 0.2, 0.25])
        m.joint(f"j{name}", "gimbal", name, sequence=sequence, start=ANGLES, rate=RATES)
    run = m.derive().run(t_end=0.3, method="dop853", rtol=1e-11, atol=1e-13)
    about = np.diag([0.3, 0.2, 0.25]) + MASS * (CENTRE @ CENTRE * np.eye(3) - np.outer(CENTRE, CENTRE))
    for name, sequence in (("a", "zxz"), ("b", "xyz")):
        w = body_rates(sequence, ANGLES, RATES)
        ends[name] = heavy_body(about, CENTRE, attitude(sequence, ANGLES), w, 0.3)
        found = attitude(sequence, [run[f"j{name}_{k}"][-1] for k in (1, 2, 3)])
        np.testing.assert_allclose(found, ends[name], atol=1e-9)


def test_files_round_trip():
    m = Model("m")
    m.body("b", mass=1, inertia=[1, 1, 1])
    m.joint("j", "gimbal", "b", sequence="yxz", stiffness=[1, 2, 3], start=[0.1, 0.2, 0.3])
    text = m.to_toml()
    again = Model.from_toml(text)
    assert 'sequence = "yxz"' in text and again.to_toml() == text
    assert again.describe().joints == m.describe().joints


@pytest.mark.parametrize("bad", ["xx", "xxy", "abc", 3])
def test_what_is_no_sequence(bad):
    m = Model("m")
    m.body("b", mass=1, inertia=[1, 2, 3])
    with pytest.raises(ModelError, match="three letters x, y, z, of which neighbours differ"):
        m.joint("j", "gimbal", "b", sequence=bad)


def test_sequences_belong_to_gimbals():
    m = Model("m")
    m.body("b", mass=1, inertia=[1, 2, 3])
    with pytest.raises(ModelError, match="a gimbal joint needs a 'sequence'"):
        m.joint("i", "gimbal", "b")
    with pytest.raises(ModelError, match="a revolute joint has no 'sequence'"):
        m.joint("j", "revolute", "b", sequence="xyz")


def test_folded_axes_are_refused():
    m = Model("m")
    m.body("b", mass=1, inertia=[1, 2, 3])
    m.joint("j", "gimbal", "b", sequence="zxz", rate=[1, 0.5, 0])
    with pytest.raises(
        RuntimeModelError, match=r"'j_1' and 'j_3' can move together without moving.* axes fold"
    ):
        m.derive().run(t_end=0.1)
