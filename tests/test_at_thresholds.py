"""Choices of what comes to their threshold by a step, or with an input, and stays there to the last bit.

There `u > 1` and `u >= 1` are not the same, and `sign(u - 1)` is on neither side.
"""

import numpy as np
import pytest

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime import solve
from symgen.runtime.inputs import Table

METHODS = ["dop853", "radau5"]
ZONE = "max(x - 0.5, 0) + min(x + 0.5, 0)"
CHOSEN = {  # with the integral over x
    f"sign({ZONE})": lambda x: np.maximum(np.abs(x) - 0.5, 0.0),
    f"where({ZONE} >= 0, 1, -1)": lambda x: np.abs(x + 0.5),
    f"where({ZONE} > 0, 1, -1)": lambda x: np.abs(x - 0.5),
    "heaviside(max(x - 1, 0))": lambda x: (x + np.maximum(x - 1, 0.0)) / 2,
    "floor(max(2*x, 2))": lambda x: 2 * x + np.maximum(x - 1.5, 0.0),
    "sign(smoothstep(0.3, 1, x))": lambda x: np.maximum(x - 0.3, 0.0),
}
CELL = 0.5
STEPPED = {  # of the number of a cell
    "where(floor(x/0.5) > 3, 1, 0)": lambda n: np.where(n > 3, 1.0, 0.0),
    "where(floor(x/0.5) <= 3, 1, 2)": lambda n: np.where(n <= 3, 1.0, 2.0),
    "mod(floor(x/0.5), 2)": lambda n: n % 2,
    "floor(floor(x/0.5)/2)": lambda n: np.floor(n / 2),
    "heaviside(floor(x/0.5) - 3)": lambda n: np.heaviside(n - 3, 0.5),
    "stairs(floor(x/0.5))": lambda n: np.interp(n, [0, 2, 4], [0.0, 0.0, 3.0]),
}
GIVEN = {  # of an input
    "where(u > 1, 1, 0)": lambda u: np.where(u > 1, 1.0, 0.0),
    "where(u >= 1, 1, 0)": lambda u: np.where(u >= 1, 1.0, 0.0),
    "sign(u - 1)": lambda u: np.sign(u - 1),
    "floor(u)": np.floor,
    "mod(u, 2)": lambda u: np.mod(u, 2),
}
LEVELS = [0.0, 1.0, 4.0, 1.0, 2.0, 1.0, 3.0]


def mass(name, force):
    m = Model(name)
    x, _ = m.coordinate("x", start=0.1, rate=2.0), m.input("u")
    m.kinetic("dot(x)^2/2")
    m.table("stairs", columns=[[0, 2, 4], [0, 0, 3]], outside="hold")
    m.force(x, force)
    return runtime.load(derive_text(m).text)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("force", STEPPED)
def test_what_steps_is_not_held_at_its_steps(force, method):
    """v^2/2 is what the force has done over each cell."""
    run = mass("stepping", force).run(1.2, method=method, rtol=1e-9)
    x, v = run["x"][-1], run["dot(x)"][-1]
    edges = np.concatenate([[0.1], np.arange(CELL, x, CELL), [x]])
    work = STEPPED[force](np.floor((edges[1:] + edges[:-1]) / 2 / CELL)) @ np.diff(edges)
    assert run.ok and x > 2.2
    assert v**2 / 2 == pytest.approx(2.0 + work, rel=1e-8)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", ["hold", "linear"])
@pytest.mark.parametrize("force", GIVEN)
def test_an_input_that_stays_at_a_threshold(force, kind, method):
    """It jumps there, or ramps."""
    starts = np.arange(float(len(LEVELS)))
    times, values = starts, np.array(LEVELS)
    if kind == "linear":
        times, values = np.ravel([starts, starts + 0.5], order="F"), np.repeat(values, 2)
    t_end = float(len(LEVELS))
    run = solve(
        mass("given", force), t_end, method=method, inputs={"u": Table(times, values, kind=kind)}, rtol=1e-9
    )
    t = (np.arange(700_000) + 0.5) * (t_end / 700_000)
    u = np.interp(t, times, values) if kind == "linear" else values[np.searchsorted(times, t) - 1]
    assert run.ok
    assert run["dot(x)"][-1] - 2.0 == pytest.approx(GIVEN[force](u).mean() * t_end, abs=2e-5)


@pytest.mark.parametrize("method", ["dop853", "taylor"])
@pytest.mark.parametrize("force", CHOSEN)
def test_what_another_choice_holds_at_a_threshold(force, method):
    """A swing there and back keeps its energy."""
    m = Model("swing")
    x = m.coordinate("x", start=1.9)
    m.kinetic("dot(x)^2/2")
    m.potential("x^2/2")
    m.force(x, f"0.3*({force})")
    run = runtime.load(derive_text(m).text).run(10.0, method=method, rtol=1e-10)
    energy = run["dot(x)"] ** 2 / 2 + run["x"] ** 2 / 2 - 0.3 * CHOSEN[force](run["x"])
    assert run.ok and run["x"].min() < -0.55
    np.testing.assert_allclose(energy, energy[0], atol=1e-7)


@pytest.mark.parametrize("method", ["bs32", "dopri5", "dop853"])
def test_a_quantiser_that_begins_at_a_step(method):
    """At rest at x = 0 the round-off of x turns the command by 2.5, which says nothing of how near its limit it is.

    Steps of low order lead x to -1e-41 on its way up: that is on no side of the step of the quantiser, nor is it one.
    """
    m = Model("quantised")
    x, _ = m.coordinate("x"), m.input("u")
    m.kinetic("dot(x)^2/2")
    m.potential("2*x^2")
    m.definition("command", "min(max(10*(u - 0.25*floor(4*x)) - 0.5*dot(x), -2), 2)")
    a = m.state("a", "(command - a)/0.1")
    m.force(x, a)
    ramp = Table([0.0, 1.0], [0.0, 1.0], kind="linear")
    run = solve(runtime.load(derive_text(m).text), 0.5, method=method, inputs={"u": ramp}, rtol=1e-9)
    # Up to t = 0.5 x stays below a step, and the command at its limit from about 0.2 on.
    held = run.t > 0.22
    a_end = 2 + (run["a"][held][0] - 2) * np.exp(-(run.t[-1] - run.t[held][0]) / 0.1)
    assert run.ok and run["x"][-1] < 0.25
    assert run["a"][-1] == pytest.approx(a_end, abs=1e-7)
