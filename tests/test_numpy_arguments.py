"""What comes from NumPy, names and arrays, is taken as the same text, numbers and lists are."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model


def test_names_and_arrays_of_numpy():
    found = []
    for text, listed in ((str, list), (np.str_, np.array)):
        m = Model("m", gravity=(0, -9.81))
        x = m.coordinate(text("x"), unit=text("m"), start=0.5)
        m.body(text("cart"), mass=2, com=(x, 0))
        m.body(
            text("arm"),
            density=1000,
            shape={text("box"): listed([0.4, 0.05, 0.05]), "offset": listed([0.2, 0])},
        )
        m.joint(text("j"), text("revolute"), text("arm"), stiffness=listed([3.0]), start=listed([0.2]))
        m.load("push", body="arm", torque=listed([0.1]))
        m.force(x, "-5*x")
        m.input("u", table=listed([[0.0, 1.0], [0.0, 2.0]]))
        m.output(text("height"), x)
        run = m.derive().run(t_end=0.5, method=text("dop853"))
        found.append((run["x"][-1], run["j"][-1]))
    assert found[0] == found[1]


def test_sizes_that_are_too_many_are_still_counted():
    m = Model("m")
    with pytest.raises(Exception, match="sizes of a box"):
        m.body("b", density=1, shape={"box": np.ones(4)})
