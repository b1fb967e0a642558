"""Members that choose their steps are doubted where errors have grown beyond what a single run may have."""

from __future__ import annotations

import numpy as np

import symgen
from symgen.runtime.ensemble.beside import GROUP


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
