"""Steps across a gap between branches of positions are told from change points, and from motions that turn there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from symgen import Model, cos, runtime, sin
from symgen.link import derive_text
from symgen.runtime.checks.branches import branches


@pytest.fixture(scope="module")
def four_bar():
    """A parallelogram on two points, its bars 0.5, 0.8 and 0.5 m long; `longer` is what the second has besides."""
    model = Model("parallelogram", gravity=(0, "-9.81 m/s^2"))
    longer, x, y = model.parameters(longer=0.0), 0, 0
    for k, (length, start) in enumerate(((0.5, 1.2), (0.8, 0.0), (0.5, 1.2 - np.pi))):
        length = length + (longer if k == 1 else 0)
        a = model.coordinate(f"a{k}", **({"start": start, "rate": -8.0} if k == 0 else {"guess": start}))
        centre = (x + length / 2 * cos(a), y + length / 2 * sin(a))
        model.body(f"bar{k}", mass=1.0, inertia=0.02, com=centre, angle=a)
        x, y = x + length * cos(a), y + length * sin(a)
    model.constraint("end_x", x - 0.8)
    model.constraint("end_y", y)
    return runtime.load(derive_text(model).text)


def straight_through(system, t_end=0.4):
    """Return the run through the change point that stays a parallelogram."""
    solution = system.run(t_end=t_end, method="dop853", rtol=1e-9, atol=1e-11)
    assert solution.status == "success"
    np.testing.assert_allclose(solution.q[:, 1], 0.0, rtol=0, atol=1e-6)
    assert solution.q[0, 0] > 0.0 > solution.q[-1, 0]
    return solution


def test_a_change_point_is_passed(four_bar):
    solution = straight_through(four_bar)
    assert list(branches(solution)) == []
    assert all(check.ok for check in solution.health)


def test_a_gap_is_told_and_grows_with_the_root_of_what_opens_it(four_bar):
    """The same states, under lengths with which branches are hyperbolas about where they met."""
    solution = straight_through(four_bar)
    crossing = solution.t[np.argmax(solution.q[:, 0] < 0.0)]
    for longer in (1e-8, 1e-6, 1e-4):
        p = solution.p.copy()
        p[[record["name"] for record in four_bar.parameters].index("longer")] = longer
        (check,) = branches(replace(solution, p=p))
        assert not check.ok and check.check == "branch" and "'end_" in check.says
        assert 0.1 < check.value / np.sqrt(longer) < 10.0
        assert float(check.says.split("t = ")[1].split(" s")[0]) == pytest.approx(crossing, abs=0.01)


@pytest.mark.parametrize(("longer", "tight"), [(1e-7, "auto"), (1e-5, "taylor"), (1e-3, "taylor")])
def test_series_follow_the_motion_round_the_bend(four_bar, longer, tight):
    """Where branches do not meet, the loop comes out crossed; all tolerances agree on it.

    Series do not pass where round-off rules the accelerations that a tolerance asks for; `auto` goes on with dop853.
    """
    runs = [
        four_bar.run(t_end=0.4, method=method, rtol=r, atol=0.01 * r, parameters={"longer": longer})
        for method, r in (("taylor", 1e-6), (tight, 1e-11))
    ]
    for run in runs:
        assert run.status == "success" and all(check.ok for check in run.health), run.health
    assert abs(runs[0].q[-1, 1]) > 0.1
    sizes = np.abs(runs[1].states).max(axis=0)
    assert np.abs((runs[0].states[-1] - runs[1].states[-1]) / sizes).max() < 1e-5


@pytest.mark.parametrize("foot", [[0.09, -0.26, -0.21], [-0.55, -0.36, -0.39]])
def test_a_coordinate_that_moves_the_whole_loop_along_says_nothing_of_branches(foot):
    """A loop on a screw: derivatives of its constraints by the screw's angle are round-off."""
    m = Model("carried", gravity=(0, 0, "-9.81"))
    for name, com in (("base", (0.1, 0.2, 0)), ("arm", (0.2, 0, 0.1)), ("rod", (0.1, 0.1, 0))):
        m.body(name, mass=1, com=com, inertia=(0.1, 0.12, 0.09))
    told = {"axis": [0.6, 0.48, 0.64], "pitch": 0.3, "guess": 0.3}
    m.joint("base", "screw", "base", origin={"xyz": [0.1, 0.2, 0.3], "rpy": [0.4, -0.7, 1.1]}, **told)
    origin = {"xyz": [0.3, 0.1, 0], "rpy": [1.2, 0.3, -0.5]}
    m.joint("arm", "universal", "arm", "base", origin=origin, axis=[0.6, 0, 0.8], guess=[0.5, -0.3])
    origin = {"xyz": [0.4, 0, 0.1], "rpy": [0.3, 0.8, 0.2]}
    m.joint("rod", "planar", "rod", "arm", origin=origin, axis=[0, 0, 1], guess=[0.05, 0.1, 0.4])
    m.frame("tip", "rod", at=[0.3, 0.2, 0.1])
    m.frame("foot", "base", at=foot, rpy=[0.2, 0.3, 0.4])
    m.closure("loop", "spherical", frames=["foot", "tip"])
    run = m.derive().run(t_end=2.0, method="dop853", fps=200)
    assert run.status == "success"
    assert not list(branches(run))
