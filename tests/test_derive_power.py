"""The power in `rhs` is dE/dt: along exact motions, for every way in which energy enters or leaves."""

from __future__ import annotations

import numpy as np
import pytest
from derived import Generated, describe
from mechanisms import CONSERVATIVE, CONSTRAINED, FREE
from scipy.integrate import solve_ivp

ALL = (*FREE, *CONSTRAINED)
models = pytest.mark.parametrize("build", ALL, ids=lambda f: f.__name__)

# One way for energy to enter or leave each; `x` and `y` are free masses otherwise.
SOURCES = {
    "dissipation": {"dissipation": "c/2*dot(x)**2 + c*dot(x)*dot(y)*x**2"},
    "dissipation with t": {"dissipation": "c/2*(dot(x) - sin(t))**2"},
    "force": {"forces": {"x": "u - c*dot(y)"}},
    "potential with t": {"potential": "x**2*cos(t) + x*y"},
    "mass with t": {"kinetic": "(1 + t**2)*dot(x)**2 + dot(y)**2"},
    "linear in the rates": {"kinetic": "dot(x)**2 + dot(y)**2 + x*dot(y)"},
    "linear in the rates, with t": {"kinetic": "dot(x)**2 + dot(y)**2 + t*x*dot(y)"},
    "quartic": {"kinetic": "dot(x)**2 + dot(y)**2 + dot(x)**4*(1 + y**2)"},
    "quartic alone": {"kinetic": "dot(x)**2 + dot(y)**2 + dot(x)**2*dot(y)**2", "potential": "x**2"},
    "potential of kinetic form": {"kinetic": "dot(x)**2 + dot(y)**2 + x**2*y"},
    "prescribed frame": {
        "kinetic": "dot(x*cos(t) - y*sin(t))**2 + dot(x*sin(t) + y*cos(t))**2",
        "potential": "x**2",
    },
}
NONE = {
    "coefficient of q": {"kinetic": "dot(x)**2*(1 + y**2) + dot(y)**2 + dot(x)*dot(y)*sin(x)"},
    "coriolis": {"kinetic": "dot(x*cos(y))**2 + dot(x*sin(y))**2", "potential": "x**2 + sin(y)"},
}


def box(kinetic="dot(x)**2 + dot(y)**2", **parts):
    return describe("box", "x y", {"c": 0.4}, inputs={"u": 0.7}, kinetic=kinetic, **parts)


def energy_slope(system: Generated, t, y) -> float:
    return float(system.slope("energy", t, y, [*y[system.n :], *system.split(t, y).a], 1.0).sum())


def check_power(system: Generated, t, y):
    parts = system.split(t, y)
    assert parts.power == pytest.approx(energy_slope(system, t, y), rel=1e-9, abs=1e-9)


@models
def test_power_is_the_slope_of_the_energy(build):
    system = Generated(build())
    rng = np.random.default_rng(21)
    for _ in range(3):
        t, y = (
            system.consistent_state(rng, CONSTRAINED[build])
            if build in CONSTRAINED
            else system.random_state(rng)
        )
        check_power(system, t, y)


@pytest.mark.parametrize("name", SOURCES)
def test_each_source_of_power(name):
    system = Generated(box(**SOURCES[name]))
    assert not system.model["structure"]["conservative"]
    assert system.nw == 1
    rng = np.random.default_rng(22)
    powers = []
    for _ in range(3):
        t, y = system.random_state(rng)
        check_power(system, t, y)
        powers.append(abs(system.split(t, y).power))
    assert max(powers) > 1e-3


@pytest.mark.parametrize("name", NONE)
def test_conservative_energies_have_no_power(name):
    system = Generated(box(**NONE[name]))
    assert system.model["structure"]["conservative"]
    assert system.nw == 0
    t, y = system.random_state(np.random.default_rng(23))
    assert energy_slope(system, t, y) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("build", CONSERVATIVE, ids=lambda f: f.__name__)
def test_conservative_mechanisms_have_no_power(build):
    assert Generated(build()).nw == 0


@pytest.mark.parametrize("build", ALL, ids=lambda f: f.__name__)
def test_energy_balance_closes_along_the_motion(build):
    """T + V - w stays, with w integrated beside the motion as the run time does."""
    system = Generated(build())
    rng = np.random.default_rng(24)
    t0, y0 = (
        system.consistent_state(rng, CONSTRAINED[build]) if build in CONSTRAINED else system.random_state(rng)
    )
    n, nw = 2 * system.n, system.nw
    motion = solve_ivp(
        lambda t, Y: system("rhs", t, Y[:n])[: n + nw],
        (t0, t0 + 0.3),
        [*y0, *[0.0] * nw],
        "DOP853",
        rtol=1e-11,
        atol=1e-12,
    )
    assert motion.success
    balance = [
        system("energy", t, Y[:n]).sum() - Y[n:].sum() for t, Y in zip(motion.t, motion.y.T, strict=True)
    ]
    energies = [system("energy", t, Y) for t, Y in zip(motion.t, motion.y.T, strict=True)]
    assert np.ptp(balance) < 1e-8 * np.abs(energies).max()
