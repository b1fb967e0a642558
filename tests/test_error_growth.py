"""How fast errors grow along a run, against exponents known otherwise, and what the check of accuracy makes of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from references import load_reference

import runtime
from runtime.checks.accuracy import accuracy
from runtime.checks.error_growth import error_growth
from runtime.integrate.methods import find_method
from symgen import Model, dot
from symgen.link import module_for
from symgen.model.library import find


@pytest.fixture(scope="module")
def double() -> runtime.System:
    return runtime.load(module_for(Path(find("double_pendulum")), {}).text)


def henon_heiles(energy: float) -> runtime.System:
    """Two coupled oscillators (Hénon and Heiles 1964), on the section x = 0, y = -0.25 with dot(y) = 0."""
    model = Model("henon_heiles")
    rate = float(np.sqrt(2.0 * energy - 0.25**2 - 2.0 * 0.25**3 / 3.0))
    x, y = model.coordinate("x", start=0.0, rate=rate), model.coordinate("y", start=-0.25)
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential((x**2 + y**2) / 2 + x**2 * y - y**3 / 3)
    return model.derive()


def growth(solution: runtime.Solution) -> float:
    scale = np.ptp(solution.states, axis=0)
    return error_growth(solution, find_method(solution.method), scale, 0.0)


@pytest.mark.parametrize("method", ["dop853", "rk4"])
def test_exponent_of_henon_heiles(method):
    """At the energy 1/6 the largest exponent of the chaotic sea is 0.13 (Benettin, Galgani, Strelcyn 1976)."""
    options = {"step": 0.05} if method == "rk4" else {"rtol": 1e-8}
    run = henon_heiles(1.0 / 6.0 - 1e-4).run(t_end=600.0, method=method, **options)
    assert growth(run) == pytest.approx(0.13, abs=0.06)


def test_regular_motion_of_henon_heiles():
    run = henon_heiles(1.0 / 24.0).run(t_end=600.0, method="dop853", rtol=1e-8)
    assert growth(run) == 0.0


def test_exponent_of_a_saddle():
    """Beside the plane that leads into it, errors grow with the root of the stiffness."""
    model = Model("saddle")
    x, y = model.coordinate("x", start=1.0, rate=-2.0), model.coordinate("y", start=0.5)
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential(-2.0 * x**2 + 0.5 * y**2)
    run = model.derive().run(t_end=8.0, method="dop853", rtol=1e-9)
    assert growth(run) == pytest.approx(2.0, rel=0.1)


def entry_of(run: runtime.Solution):
    found = [entry for entry in run.health if entry.check == "accuracy"]
    return found[0] if found else None


def test_lost_digits_are_flagged(double):
    for options in ({"method": "dopri5", "rtol": 1e-4, "t_end": 20.0}, {"method": "dop853", "t_end": 60.0}):
        entry = entry_of(double.run(**options))
        assert not entry.ok
        assert "tenfold" in entry.says and "symgen check" in entry.says


def test_digits_that_are_left_are_not(double):
    assert double.run(t_end=10.0, method="dop853").ok
    assert double.run(t_end=20.0, method="dop853", rtol=1e-11, atol=1e-13).ok
    swing = double.run(t_end=60.0, method="dop853", start={"theta1": 0.2, "theta2": 0.2})
    assert swing.ok and entry_of(swing) is None


def test_estimate_follows_the_growth(double):
    """Against 80 digits, where the plain sum of errors would be some orders too small."""
    reference = load_reference("double_pendulum_60")
    run = double.run(t_end=16.0, method="dop853", rtol=1e-7, atol=1e-9)
    right = np.array([float(x) for x in reference["states"][16]])
    true = (np.abs(run.states[-1] - right) / np.ptp(run.states, axis=0)).max()
    (entry,) = accuracy(run, find_method("dop853"))
    assert 0.03 < entry.value / true < 100.0
