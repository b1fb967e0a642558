"""Definitions in any order."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model
from symgen.errors import ModelError
from symgen.runtime.batches import evaluate

PENDULUM = """
[coordinates]
phi = { start = 0.3 }
[energy]
kinetic = "0.5*speed_squared"
potential = "9.81*tip_y"
[definitions]
"""
LINES = [
    'speed_squared = "dot(tip_x)^2 + dot(tip_y)^2"',
    'tip_x = "l*sin(phi)"',
    'tip_y = "-l*cos(phi)"',
    "l = 0.4",
]


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 0, 3, 2)])
def test_a_definition_may_use_those_further_down(order):
    system = Model.from_toml(PENDULUM + "\n".join(LINES[k] for k in order)).derive()
    found = evaluate(system, "rhs", np.zeros(0), np.zeros(1), np.array([[0.3, 0.5]]))[0]
    assert found[:2] == pytest.approx([0.5, -9.81 / 0.4 * np.sin(0.3)], rel=1e-14)


def test_definitions_that_are_in_order_stay_so():
    order = [name for name, _ in Model.from_toml(PENDULUM + "\n".join(LINES[::-1])).describe().definitions]
    assert order == ["l", "tip_y", "tip_x", "speed_squared"]


def test_circles_are_refused_with_their_members():
    text = PENDULUM + "\n".join(LINES[:3]) + '\nl = "a"\na = "2*b"\nb = "l"'
    with pytest.raises(ModelError, match="'l' refers to itself, through 'a', 'b'"):
        Model.from_toml(text).describe()
