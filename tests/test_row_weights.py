"""What tells a constraint's row that vanishes nearby, at a singular position, from one that is small everywhere."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model
from symgen.runtime.constraints.guard_code import NEAR_LIMIT
from symgen.runtime.constraints.row_weights import row_weights


def smallest(model, q):
    """The smallest row of G at `q`."""
    system = model.derive()
    p = np.array([float(record["value"]) for record in system.parameters])
    return row_weights(system, p, 0.0, np.array(q))[1]


@pytest.mark.parametrize("length", [0.5, 0.01, 1e-4])
def test_a_short_rod_on_a_long_one_is_no_singular_position(length):
    """Off the constraints, where the rod is longer, its row is larger, too: 20 times slower, for nothing."""
    m = Model("rods", gravity=(0, -9.81))
    x, y, u, v = (m.coordinate(name, unit="m") for name in "xyuv")
    long = m.parameter("L", "2 m")
    m.body("a", mass=1, com=(x, y))
    m.body("b", mass=0.5, com=(u, v))
    m.constraint("long", x * x + y * y - long**2)
    m.constraint("short", (u - x) ** 2 + (v - y) ** 2 - length**2)
    assert smallest(m, [2.0, 0.0, 2.0 + length, 0.0]) > 0.99


@pytest.mark.parametrize("residual", ["x^2 - y^2 + x^3/L", "x^2 + y^2 - 1e-14*L^2", "x^2"])
def test_rows_that_vanish_on_the_constraints_do(residual):
    m = Model("crossing")
    m.coordinate("x", unit="m")
    m.coordinate("y", unit="m")
    m.parameter("L", "2 m")
    m.parameter("m", "1 kg")
    m.kinetic("m*(dot(x)^2 + dot(y)^2)/2")
    m.constraint("curve", residual)
    assert smallest(m, [1e-7, 0.0]) < NEAR_LIMIT


def test_what_runs_away_from_its_constraints_is_not_told_of_them():
    """At 1e150 m two rods depend on each other as little as they hold."""
    m = Model("rods", gravity=(0, -9.81))
    x, y, u, v = (m.coordinate(name, start=start) for name, start in zip("xyuv", (1, 0, 1.8, 0), strict=True))
    m.body("a", mass=1, com=(x, y))
    m.body("b", mass=0.5, com=(u, v))
    m.constraint("long", x * x + y * y - 1)
    m.constraint("short", (u - x) ** 2 + (v - y) ** 2 - 0.64)
    run = m.derive().run(20.0, method="euler", constraints="baumgarte", step=0.1)
    assert run.status == "failed"
    assert "became infinite" in run.message and "depend on each other" not in run.message
