"""Members that choose their steps are doubted where errors have grown beyond what a single run may have."""

from __future__ import annotations

import numpy as np
import pytest

import symgen
from symgen.runtime.ensemble.beside import GROUP
from symgen.runtime.inputs import Controller


def off_by(e, exact) -> np.ndarray:
    """How far ends are from those at a tolerance a million times as tight, in parts of what coordinates do, at most."""
    return np.max([abs(e[name] - exact[name]) for name in ("theta1", "theta2")], axis=0) / (2.0 * np.pi)


def test_chaotic_members_are_doubted_and_regular_ones_are_not():
    """Small swings stay regular; from the upper half on a double pendulum forgets its start within twenty periods."""
    system, n = symgen.load("double_pendulum"), 3 * GROUP
    starts = np.concatenate([np.linspace(0.05, 0.3, GROUP), np.linspace(2.0, 2.8, 2 * GROUP)])
    options = {"start": {"theta1": starts}, "keep": ["theta1", "theta2"]}
    for method in ("taylor", "dop853"):
        e = system.ensemble(60.0, method=method, **options)
        exact = system.ensemble(60.0, method="taylor", rtol=1e-14, atol=1e-15, **options)
        off = off_by(e, exact)
        assert e.n == n and not e.failed.size
        assert e.verdicts.ok[:GROUP].all() and off[:GROUP].max() < 1e-3
        assert (~e.verdicts.ok[off > 0.2]).all() and (off > 0.2).sum() > GROUP // 2
    brief = system.ensemble(2.0, **options)
    assert brief.verdicts.ok.all()


def test_loose_tolerances_over_many_periods():
    """One in each group is looked at, then all of a group whose one is off."""
    system = symgen.load("pendulum")
    starts = np.linspace(0.5, 2.0, 2 * GROUP)
    options = {"start": {"theta": starts}, "keep": ["theta"]}
    exact = system.ensemble(400.0, rtol=1e-11, **options)
    for rtol, wrong in ((1e-2, True), (1e-7, False)):
        e = system.ensemble(400.0, method="dop853", rtol=rtol, **options)
        off = abs(e["theta"] - exact["theta"]) / (2.0 * starts)
        assert (off > 0.07).any() == wrong
        assert not (e.verdicts.ok & (off > 0.07)).any()


def folded(with_event: bool = False, also: str = ""):
    """A double pendulum that falls from any height; or one that tells when it passes below, or that more acts on."""
    model = symgen.Model("folded", gravity=(0, "-9.81 m/s^2"))
    length = model.parameter("L", "1 m")
    a, b = model.coordinate("a", start=2.0), model.coordinate("b", start=0.5)
    x, y = length * symgen.sin(a), -length * symgen.cos(a)
    model.body("upper", mass="1 kg", com=(x, y))
    model.body("lower", mass="1 kg", com=(x + length * symgen.sin(b), y - length * symgen.cos(b)))
    if with_event:
        model.event("below", "sin(a)")
    if also == "stop":
        model.stop("turns", 50.0 - a, restitution=0.5)
    if also == "friction":
        model.friction("hinge", coordinate=a, force=0.02)
    if also == "controller":
        model.force(a, model.input("u"))
    return model.derive()


@pytest.mark.parametrize(
    ("with_event", "method", "n"),
    [(False, "radau5", GROUP), (False, "bdf", 12), (True, "dop853", GROUP), (True, "radau9", 16)],
)
def test_implicit_methods_and_models_with_events_are_doubted_as_others_are(with_event, method, n):
    system = folded(with_event)
    options = {"start": {"a": np.linspace(0.5, 2.5, n)}, "keep": ["a", "b"], "threads": 1}
    exact = system.ensemble(20.0, method="taylor", rtol=1e-14, atol=1e-15, **options)
    e = system.ensemble(20.0, method=method, rtol=1e-5, **options)
    off = np.max([abs(e[name] - exact[name]) for name in ("a", "b")], axis=0)
    assert not e.failed.size
    assert (off > 1.0).sum() >= 2 and (~e.verdicts.ok[off > 1.0]).all()
    assert e.verdicts.ok[off < 1e-3].all()
    assert system.ensemble(1.0, method=method, rtol=1e-6, **options).verdicts.ok.all()


def test_members_that_jump_at_events_are_not_doubted_for_when_they_do():
    """Where an end falls between a member's bounce and its companion's, the report of the member has the last word."""
    model = symgen.Model("bounces", gravity=(0, "-9.81 m/s^2"))
    y = model.coordinate("y", start=1.0)
    model.body("ball", mass=1, com=(0, y))
    model.event("hit", "y", direction="falling", then={"reset": {"dot(y)": "-0.8*dot(y)"}})
    system, heights = model.derive(), np.linspace(0.5, 2.0, 2 * GROUP)
    hit = 2.6 * np.sqrt(2.0 * heights[0] / 9.81)  # the second bounce of the first one
    for t_end in (hit, 1.7):
        e = system.ensemble(float(t_end), start={"y": heights}, method="dop853", rtol=1e-7)
        assert e.verdicts.ok.all()


def law(t: float, x: np.ndarray) -> float:
    return -1e-3 * x[0]


@pytest.mark.parametrize("also, n", [("stop", GROUP), ("friction", GROUP), ("controller", 6)])
def test_members_that_stops_friction_or_controllers_act_on_are_doubted_as_others_are(also, n):
    system = folded(also=also)
    inputs = {"u": Controller(law, period=0.05)} if also == "controller" else {}
    options = {"start": {"a": np.linspace(0.2, 2.5, n)}, "keep": ["a", "b"], "threads": 1, "inputs": inputs}
    exact = system.ensemble(20.0, method="dop853", rtol=1e-13, atol=1e-14, **options)
    e = system.ensemble(20.0, method="dop853", rtol=1e-5, **options)
    off = np.max([abs(e[name] - exact[name]) for name in ("a", "b")], axis=0)
    assert not e.failed.size
    assert (off > 1.0).sum() >= 2 and (~e.verdicts.ok[off > 1.0]).all()
    assert e.verdicts.ok[off < 1e-3].all()
    assert system.ensemble(1.0, method="dop853", rtol=1e-6, **options).verdicts.ok.all()


def test_members_with_the_tolerance_of_the_first_companion_are_not_held_against_themselves():
    """Ends are off by a quarter; `dop853` at rtol 1e-6 and atol 1e-9 acquitted the same at rtol 1e-6 and atol 1e-8."""
    system = symgen.load("spring_pendulum")
    e = system.ensemble(
        3000.0, method="dop853", rtol=1e-6, atol=1e-8, start={"theta": np.linspace(0.1, 0.12, 3)}
    )
    assert not e.verdicts.ok.any()
