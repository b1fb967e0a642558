"""Stops and friction of models whose inputs follow time or a controller, against formulas."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.contact.switching import Switching
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs import Controller, Polynomial, Table


@pytest.fixture(scope="module")
def pressed():
    """A mass of 2 kg against a wall, and a force on it."""
    m = Model("pressed")
    x = m.coordinate("x", start=0.0, rate=0.0)
    u = m.input("u", unit="N")
    m.body("b", mass=2.0, com=(x, 0))
    m.force(x, u)
    m.stop("wall", x)
    return m.derive()


@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor"])
def test_a_force_that_grows_pulls_a_mass_off_its_stop_at_the_known_time(pressed, method):
    solution = pressed.run(t_end=2.0, method=method, inputs={"u": Polynomial((-3.0, 4.0))})
    assert solution.status == "success"
    assert [(e.name, e.action) for e in solution.events] == [("wall", "release")]
    assert solution.events[0].t == pytest.approx(0.75, rel=1e-12)
    assert solution["x"][-1] == pytest.approx(4.0 * 1.25**3 / 12.0, rel=1e-9)
    held = solution.t < 0.75
    np.testing.assert_allclose(solution["force(wall)"][held], 3.0 - 4.0 * solution.t[held], atol=1e-12)


def test_a_force_that_jumps_lets_go_at_once_and_presses_shut_again(pressed):
    course = Table([0.0, 1.0, 2.0], [-3.0, 1.0, -3.0], "hold")
    solution = pressed.run(t_end=4.0, method="dop853", inputs={"u": course})
    assert solution.ok
    assert [(e.action, e.t) for e in solution.events[:1]] == [("release", 1.0)]
    # 0.25 m and 0.5 m/s at t = 2, then -1.5 m/s^2 until it strikes
    strikes = 2.0 + (0.5 + np.sqrt(0.25 + 2.0 * 1.5 * 0.25)) / 1.5
    assert solution.events[1].action == "impact"
    assert solution.events[1].t == pytest.approx(strikes, rel=1e-9)
    assert solution["force(wall)"][-1] == pytest.approx(3.0, rel=1e-12)


def test_a_sampled_controller_pulls_a_mass_off_its_stop(pressed):
    pull = Controller(lambda t, x: -3.0 if t < 0.95 else 1.0, reads=("x",), period=0.1)
    solution = pressed.run(t_end=2.0, method="dop853", inputs={"u": pull})
    assert solution.ok
    assert [(e.name, e.action) for e in solution.events] == [("wall", "release")]
    assert solution.events[0].t == pytest.approx(1.0, rel=1e-12)
    assert solution["x"][-1] == pytest.approx(0.25, rel=1e-9)


def test_a_table_pushes_a_block_past_its_friction():
    m = Model("pushed")
    x = m.coordinate("x", start=0.0, rate=0.0)
    u = m.input("u", unit="N")
    m.body("b", mass=1.0, com=(x, 0))
    m.force(x, u)
    m.friction("floor", coordinate=x, force=2.0)
    solution = m.derive().run(t_end=3.0, method="dop853", inputs={"u": Table([0.0, 4.0], [0.0, 4.0])})
    assert solution.ok
    assert [(e.name, e.action) for e in solution.events] == [("floor", "slip")]
    assert solution.events[0].t == pytest.approx(2.0, rel=1e-10)
    assert solution["x"][-1] == pytest.approx(1.0 / 6.0, rel=1e-9)


def test_a_push_that_jumps_moves_a_block_at_once():
    m = Model("kicked")
    x = m.coordinate("x", start=0.0, rate=0.0)
    u = m.input("u", unit="N")
    m.body("b", mass=1.0, com=(x, 0))
    m.force(x, u)
    m.friction("floor", coordinate=x, force=2.0)
    course = Table([0.0, 1.0, 2.0], [1.0, 3.0, 0.0], "hold")
    solution = m.derive().run(t_end=3.0, method="dop853", inputs={"u": course})
    assert solution.ok
    assert [e.action for e in solution.events] == ["slip", "stick"]
    np.testing.assert_allclose([e.t for e in solution.events], [1.0, 2.5], rtol=1e-10)
    assert solution["x"][-1] == pytest.approx(0.5 + 0.25, rel=1e-9)


def test_a_module_whose_gap_reads_an_input_over_time_is_refused():
    """No model file makes one: gaps are without inputs, whose rates nobody knows."""
    m = Model("gate")
    x = m.coordinate("x", start=1.0, rate=0.0)
    u = m.input("u", unit="N")
    m.body("b", mass=1.0, com=(x, 0))
    m.force(x, u)
    m.stop("wall", x)
    lines = derive_text(m).text.split("\n")
    begin = next(k for k, line in enumerate(lines) if line.startswith("def closed_constraint_residual"))
    place = next(k for k in range(begin, len(lines)) if lines[k].strip().startswith("out[0]"))
    lines[place] += " - p[0]"
    system = runtime.load("\n".join(lines))
    assert system.run(t_end=0.1, method="dop853").ok
    with pytest.raises(RuntimeModelError, match="gap or a sliding speed"):
        system.run(t_end=1.0, method="dop853", inputs={"u": Polynomial((0.0, 1.0))})


def test_forces_that_jump_far_from_stops_and_rest_are_not_settled_in_full(monkeypatch):
    """With the bits of runs that settle each of them."""
    m = Model("pushed")
    x = m.coordinate("x", start=1.0)
    m.body("b", mass=1.0, com=(x, 0))
    m.force(x, m.input("F") - 4.0 * x)
    m.stop("wall", x + 0.8, restitution=0.7)
    m.friction("rub", coordinate=x, force=0.05)
    system, act, calls = m.derive(), Switching.act, []

    def counted(self, fired, **how):
        calls.append(len(fired))
        return act(self, fired, **how)

    monkeypatch.setattr(Switching, "act", counted)
    random = np.random.default_rng(1)
    course = Table(np.linspace(0.0, 4.0, 201), 0.5 * random.normal(size=201), "hold")
    found = system.run(t_end=4.0, method="dop853", inputs={"F": course})
    few = calls.count(0)
    monkeypatch.setattr(Switching, "is_untouched", lambda self, values: False)
    exact = system.run(t_end=4.0, method="dop853", inputs={"F": course})
    assert len(exact.events) == len(found.events) > 1 and found.ok
    np.testing.assert_array_equal(found.states, exact.states)
    assert few < 10 and calls.count(0) - few > 190
