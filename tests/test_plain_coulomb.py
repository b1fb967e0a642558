"""Frictions by reactions, and of constrained models, that machine code acts on: what Python makes of them."""

from __future__ import annotations

import numpy as np
import pytest
from stress.pressed import draw

from symgen import Model
from symgen.runtime import frictions_in_code
from symgen.runtime.driver import Run

ON_BELT = """
name = "on_belt"
[parameters]
g = 9.81
k = 50.0
[coordinates]
x = { start = 0.0 }
y = { start = 0.0 }
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2"
potential = "g*y + k*x^2/2"
[stops.floor]
gap = "y"
[friction.sole]
speed = "dot(x) - 0.3"
coefficient = 0.4
static = 0.6
normal = "floor"
"""
WHEEL = """
name = "wheel"
[parameters]
J = 0.3
g = 9.81
[coordinates]
x = { start = 0.0 }
y = { start = 0.4 }
phi = { start = 0.0, rate = 4.0 }
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2 + J*dot(phi)^2/2"
potential = "g*y"
[forces]
phi = "6*sin(t)"
[stops.floor]
gap = "y + 0.05*sin(x)"
restitution = 0.5
[friction.tread]
speed = "dot(x) - dot(phi)"
coefficient = 0.3
normal = "floor"
"""
BEAD = """
name = "bead"
[parameters]
g = 9.81
k = 20.0
[coordinates]
x = { start = 0.3 }
y = { guess = 0.0 }
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2"
potential = "g*y + k*x^2/2"
[forces]
x = "9*sin(1.3*t)"
[constraints]
guide = "y - x^2/10"
[friction.bead]
speed = "dot(x)"
coefficient = 0.3
normal = "guide"
"""
GIVEN = BEAD.replace('coefficient = 0.3\nnormal = "guide"', "force = 2.0\nstatic = 2.5")
MODELS = {"belt": ON_BELT, "wheel": WHEEL, "bead": BEAD, "given": GIVEN}
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def both(monkeypatch, model, t_end, **options):
    """The run by Python alone, and the run with machine code, and when Python acted in that."""
    with monkeypatch.context() as patch:
        patch.setattr(frictions_in_code, "has_plain_frictions", lambda *_: False)
        by_python = model.run(t_end, **options)
    acted, act = [], Run._on_event
    monkeypatch.setattr(Run, "_on_event", lambda self: acted.append(self.arrays.t) or act(self))
    return by_python, model.run(t_end, **options), acted


def told(run):
    return [(event.name, event.action) for event in run.events]


@pytest.mark.parametrize("method", ("dop853", "taylor", "radau5", "dopri5"))
@pytest.mark.parametrize("name", MODELS)
def test_events_are_those_of_python(monkeypatch, name, method):
    model = Model.from_toml(MODELS[name]).derive()
    by_python, in_code, acted = both(monkeypatch, model, 20.0, method=method, **TIGHT)
    assert told(in_code) == told(by_python) and len(told(in_code)) > 8
    assert {"stick", "slip"} <= {action for _, action in told(in_code)}
    assert len(acted) <= 7
    times = [[event.t for event in run.events] for run in (in_code, by_python)]
    np.testing.assert_allclose(*times, rtol=0, atol=1e-8)
    np.testing.assert_allclose(in_code.states, by_python.states, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(in_code.forms.index, by_python.forms.index)
    np.testing.assert_array_equal(in_code.forms.settings, by_python.forms.settings)
    assert in_code.ok and by_python.ok


def test_rows_smaller_than_nearby_are_no_dependent_constraints():
    """Where the wire is flatter than elsewhere its row is small, and friction by its force is known all the same."""
    runs = [
        Model.from_toml(BEAD).derive().run(3.0, method=method, **TIGHT) for method in ("dop853", "taylor")
    ]
    assert all(run.ok for run in runs)
    np.testing.assert_allclose(runs[0].states, runs[1].states, rtol=0, atol=1e-8)


def test_stick_and_slip_on_a_belt_are_those_of_the_closed_form():
    """As on the belt of `stick_slip`: weight presses, and each slip is a cosine between two places of rest."""
    run = Model.from_toml(ON_BELT).derive().run(20.0, method="taylor", rtol=1e-13)
    slips = [event for event in run.events if event.action == "slip"]
    sticks = [event for event in run.events if event.action == "stick"]
    weight, k, speed = 9.81, 50.0, 0.3
    most, sliding, rate = 0.6 * weight / k, 0.4 * weight / k, np.sqrt(k)
    lasts = (np.pi + 2.0 * np.arctan2(speed / rate, most - sliding)) / rate
    assert len(slips) > 15
    np.testing.assert_allclose([event.q_before[0] for event in slips], most, rtol=1e-10)
    first = next(k for k, event in enumerate(sticks) if event.t > slips[0].t)
    n = min(len(slips), len(sticks) - first)
    lasted = [b.t - a.t for a, b in zip(slips[:n], sticks[first:])]
    np.testing.assert_allclose(lasted, lasts, rtol=1e-9)


def test_impacts_that_rub_are_those_of_the_closed_form(monkeypatch):
    """A ball with spin strikes the floor: friction of μ times the blow, or what stops the sliding if that is less."""
    text = (
        WHEEL.replace("y + 0.05*sin(x)", "y")
        .replace('phi = "6*sin(t)"', 'phi = "0"')
        .replace("0.5\n[f", "1\n[f")
    )
    _, run, acted = both(monkeypatch, Model.from_toml(text).derive(), 6.0, method="dop853", **TIGHT)
    assert len(run.events) >= 8 and len(acted) <= 3
    for event in run.events:
        vx, vy, spin = event.v_before
        most, stopping = 0.3 * 2.0 * abs(vy), abs(vx - spin) / (1.0 + 1.0 / 0.3)
        blow = min(most, stopping) * -np.sign(vx - spin)
        np.testing.assert_allclose(event.v_after, [vx + blow, -vy, spin - blow / 0.3], rtol=0, atol=1e-12)


@pytest.mark.parametrize("number", range(8))
def test_drawn_models_move_as_by_python(monkeypatch, number):
    r = np.random.default_rng([number, 20261128])
    model = draw(r, tied=number % 2 == 1).derive()
    method = ("dop853", "taylor", "radau5", "dopri5")[number // 2]
    by_python, in_code, _ = both(monkeypatch, model, 4.0, method=method, **TIGHT)
    assert in_code.status == by_python.status
    assert told(in_code) == told(by_python)
    np.testing.assert_allclose(in_code.states[:-1], by_python.states[:-1], rtol=0, atol=1e-6)
