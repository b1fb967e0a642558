"""Derivatives of long residuals: of boxes that give way where they touch, by elimination."""

from __future__ import annotations

import numpy as np
import pytest
from test_contact_shapes import free_body

from symgen import Model
from symgen.derive import pipeline
from symgen.derive.graph.evaluate import evaluate
from symgen.derive.graph.nodes import PARAM, A, Q, V

BOX = {"box": [0.3, 0.2, 0.1]}
LAW = {"stiffness": "1e5 N/m^1.5", "damping": "0.2 s/m", "friction": 0.3, "smooth": "1e-2 m/s"}
ON_EACH_OTHER = np.array([0, 0, 0.05, 1, 0, 0, 0, 0.02, 0.03, 0.149, 1, 0, 0, 0])


@pytest.fixture(scope="module")
def boxes():
    model = Model("boxes")
    free_body(model, "lower", BOX)
    free_body(model, "upper", BOX)
    model.contact("hit", body="lower", other="upper", **LAW)
    return pipeline.derive(model.describe())


def test_derivatives_of_two_boxes_cost_a_few_operations_for_each_of_the_residual(boxes):
    """By rows and columns there were 16 for each, and 240 nodes on the way."""
    operations = boxes.operations()
    assert operations["residual_jacobian"] < 12 * operations["residual"]
    assert len(boxes.graph.op) < 20 * operations["residual"]


@pytest.mark.parametrize("seed", [None, 1])
def test_derivatives_of_two_boxes_are_those_of_differences(boxes, seed):
    """At rest with faces in each other, where many choices are on their edges, and moving."""
    g, head = boxes.graph, boxes.header
    rng, nq, nv = np.random.default_rng(seed), head["nq"], head["nv"]
    drawn = 0.0 if seed is None else 1.0
    y = np.concatenate([ON_EACH_OTHER + 0.003 * drawn * rng.normal(size=nq), drawn * rng.normal(size=nv)])
    a = drawn * rng.normal(size=nv)
    functions = {f.name: f for f in boxes.functions}

    def values(name: str, y: np.ndarray) -> list[np.ndarray]:
        at = {g.var(Q, k): x for k, x in enumerate(y[:nq])} | {g.var(V, k): x for k, x in enumerate(y[nq:])}
        at |= {g.var(A, k): x for k, x in enumerate(a)}
        at |= {g.var(PARAM, k): p["value"] for k, p in enumerate(head["parameters"])}
        return evaluate(g, list(functions[name].outputs), at)

    found = np.zeros((nv, nq + 2 * nv))
    found.flat[list(functions["residual_jacobian"].places)] = values("residual_jacobian", y)
    h = 1e-6 * np.eye(nq + nv)
    both = np.hstack([y[:, None] + h, y[:, None] - h])
    up, down = np.hsplit(np.array(np.broadcast_arrays(*values("residual", both))), 2)
    expected = (up - down) / 2e-6
    np.testing.assert_allclose(found[:, : nq + nv], expected, atol=1e-5 * np.abs(expected).max())
