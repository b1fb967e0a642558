"""Random trees of joints, of every type, in Pinocchio (optional): an implementation of other authors."""

from __future__ import annotations

import numpy as np
import pytest
from derived import Generated
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from trees import ALL, ANGLES, GRAVITY, humanoid, random_body, seven_dof_arm

from symgen import Model

pytest.importorskip("pinocchio")

from pinocchio_model import pinocchio_tree

number = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
vectors = st.tuples(number, number, number)
AXES = st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1)]) | vectors.filter(
    lambda a: np.linalg.norm(a) > 0.1
)


@st.composite
def trees(draw):
    """Trees of up to seven bodies: types, axes, places and parents at random, all bodies with mass and inertia."""
    model = Model("tree", gravity=GRAVITY)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(1, 7))
    for k in range(n):
        # A tree that is fixed altogether has nothing to move.
        kind = draw(st.sampled_from(ALL[:-1] if k == n - 1 else ALL))
        parent = draw(st.sampled_from(["world", *(f"b{j}" for j in range(k))]))
        model.body(f"b{k}", **random_body(rng))
        placed = {"xyz": draw(vectors), "rpy": draw(vectors.map(lambda a: tuple(3 * x for x in a)))}
        axis = {} if kind in (*ANGLES, "spherical", "free", "fixed") else {"axis": draw(AXES)}
        if kind in ANGLES:
            axis["sequence"] = draw(st.sampled_from(["xyz", "zxz", "zyx", "yzy"]))
        if kind == "screw":
            axis["pitch"] = draw(st.floats(-2, 2))
        model.joint(f"j{k}", kind, f"b{k}", parent, placed, **axis)
    return model


def agree(actual, expected):
    scale = max(1.0, np.abs(expected).max())
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-10 * scale)


def compare(model, seed):
    description = model.describe()
    ours, theirs = Generated(description), pinocchio_tree(description, {})
    rng = np.random.default_rng(seed)
    t, y = ours.random_state(rng, -2.0, 2.0)
    M = ours.mass(t, y)
    agree(M, theirs.mass_matrix(y))
    a = rng.uniform(-1, 1, ours.n)
    agree(ours("residual", t, [*y, *a]), theirs.inverse_dynamics(y, a))
    # The error that rounding of M makes grows with its condition.
    expected = theirs.accelerations(y)
    error = np.abs(ours.split(t, y).a - expected).max()
    assert error < (1e-10 + 1e-15 * np.linalg.cond(M)) * max(1.0, np.abs(expected).max())


@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(trees(), st.integers(0, 1000))
def test_random_trees(model, seed):
    compare(model, seed)


@pytest.mark.parametrize("build", [seven_dof_arm, humanoid])
def test_robots(build):
    compare(build(), 1)
