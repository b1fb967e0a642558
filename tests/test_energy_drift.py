"""Long runs: what the drift of their energy makes of the motion, beside motions in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import symgen
from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.checks import health

_MOST_STEPS = 10**8


def swing(
    method: str, rtol: float, periods: float, start: float, **options
) -> tuple[runtime.Solution, float]:
    """A pendulum over so many periods, and how far it is off, in parts of its ranges."""
    system = symgen.load("pendulum")
    given = {record["name"]: record["value"] for record in system.parameters}
    k, w = np.sin(start / 2.0), np.sqrt(given["g"] / given["L"])
    quarter = ellipk(k * k)
    run = system.run(
        t_end=periods * 4.0 * quarter / w, method=method, rtol=rtol, atol=0.01 * rtol, start={"theta": start},
        max_steps=_MOST_STEPS, **options,
    )  # fmt: skip
    sn, cn, _, _ = ellipj(quarter - w * run.t, k * k)
    angle, rate = 2.0 * np.arcsin(k * sn), -2.0 * k * w * cn
    pairs = ((run.q[:, 0], angle), (run.v[:, 0], rate))
    return run, max(float(np.abs(found - true).max() / np.ptp(true)) for found, true in pairs)


def entry(run: runtime.Solution, name: str):
    """An entry of a health report."""
    return next(check for check in run.health if check.check == name)


@pytest.mark.parametrize(
    ("method", "rtol", "periods", "start"),
    [
        ("radau9", 1.4e-5, 20_618.37, 0.11), ("radau13", 1e-6, 9_871.37, 1.5), ("radau13", 1e-7, 9_871.37, 1.5),
        ("dop853", 1e-8, 9_871.37, 1.5), ("taylor", 1e-9, 8_977.37, 2.78), ("dopri5", 1.3e-7, 1796.37, 2.33),
        ("radau5", 8e-9, 1696.37, 2.6), ("bdf", 1e-9, 1500.37, 0.5),
    ],
)  # fmt: skip
def test_errors_of_thousands_of_periods_are_told(method, rtol, periods, start):
    run, off = swing(method, rtol, periods, start)
    assert 1e-3 < off < 0.6
    assert entry(run, "accuracy").value == pytest.approx(off, rel=0.5)
    assert bool(run.objections) == (off > 0.05)


def oscillator() -> runtime.System:
    """x = cos t: its frequency does not depend on its energy, its amplitude does."""
    m = Model("oscillator")
    x = m.coordinate("x", start=1.0)
    m.body("mass", mass=1, com=(x, 0))
    m.potential(x**2 / 2)
    return runtime.load(derive_text(m).text)


def test_a_drift_that_does_no_harm_is_a_note():
    run = oscillator().run(t_end=38_000.0, method="bdf", rtol=1e-8, atol=1e-10, max_steps=_MOST_STEPS)
    x, v = np.cos(run.t), -np.sin(run.t)
    off = max(float(np.abs(run.q[:, 0] - x).max()), float(np.abs(run.v[:, 0] - v).max())) / 2.0
    energy = entry(run, "energy")
    assert off < 5e-3 and energy.value > energy.limit
    assert entry(run, "accuracy").value == pytest.approx(off, rel=0.2)
    assert not run.objections and energy.note and "by and by" in energy.says


def test_a_balance_that_is_off_at_once_is_an_objection():
    run = oscillator().run(t_end=38_000.0, method="bdf", rtol=1e-8, atol=1e-10, max_steps=_MOST_STEPS)
    kinetic, potential = run.energy.kinetic.copy(), run.energy.potential.copy()
    potential[len(potential) // 2 :] += 3e-3 * run.energy.exchange.size
    jumped = replace(run.energy, kinetic=kinetic, potential=potential)
    assert any(check.check == "energy" for check in health.check(replace(run, energy=jumped)) if not check.ok)
