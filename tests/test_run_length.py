"""What is left open, method, step, what is integrated by itself, does not depend on how long a run is."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from symgen import Model, dot, sin, t
from symgen.link import derive
from symgen.model.library import find, load
from symgen.runtime import solve


@functools.cache
def bundled(name: str):
    return derive(load(find(name)))


@functools.cache
def begins_late():
    """A mass that nothing moves at the start: its force grows from zero."""
    model = Model("begins_late")
    x = model.coordinate("x")
    model.kinetic(dot(x) ** 2 / 2)
    model.force(x, sin(40 * t))
    return derive(model)


SYSTEMS = {
    **{name: functools.partial(bundled, name) for name in (
        "double_pendulum", "four_bar", "stick_slip", "free_rigid_body", "rough_road", "pendulum_field",
    )},
    "begins_late": begins_late,
}  # fmt: skip
# Times at which runs end, and ten of them; methods of each kind whose step is left open, and what chooses one.
CASES = [
    ("double_pendulum", 0.4, ("auto", "verlet", "rk4", "gauss8", "generalized_alpha", "rattle4")),
    ("four_bar", 0.1, ("auto", "implicit_midpoint", "rk4", "rattle")),
    ("stick_slip", 0.5, ("auto", "rk4", "bdf")),
    ("free_rigid_body", 0.5, ("auto", "verlet", "hht")),
    ("rough_road", 0.2, ("auto", "implicit_euler")),
    ("pendulum_field", 0.1, ("auto",)),
    ("begins_late", 0.2, ("auto", "euler", "verlet8")),
]


@pytest.mark.parametrize(("name", "t1", "method"), [(n, t1, m) for n, t1, methods in CASES for m in methods])
def test_a_run_is_the_beginning_of_a_longer_one(name, t1, method):
    system = SYSTEMS[name]()
    short, twice, long = (
        solve(system, factor * t1, method=method, fps=300.0 / t1, at=[t1]) for factor in (1.0, 2.0, 10.0)
    )
    before = int(np.searchsorted(short.t, t1 * (1.0 - 1e-9)))
    assert before >= 200
    for run in (twice, long):
        assert run.method == short.method and run.step == short.step
        np.testing.assert_array_equal(run.t[:before], short.t[:before])
        np.testing.assert_array_equal(run.states[:before], short.states[:before])
        np.testing.assert_array_equal(run.samples[0].q, short.q[-1])
        np.testing.assert_array_equal(run.samples[0].v, short.v[-1])


def test_a_default_step_sees_what_time_brings():
    """At the start nothing moves, and no length of the run tells how long steps may be."""
    run = solve(begins_late(), 2.0, method="rk4")
    exact = run.t / 40 - np.sin(40 * run.t) / 1600
    np.testing.assert_allclose(run.q[:, 0], exact, atol=1e-4)
    assert run.step < 0.01
