"""Bundled models of at most five freedoms against SymPy's own `LagrangesMethod`: `python -m pytest -m slow`.

SymPy takes seconds for each, minutes for some, so this is no part of the usual suite. Joints and quaternions, which
`LagrangesMethod` does not know, are held against Newton and Euler by test_bundled_models.py.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest
from lagrange import Reference

from symgen.link import derive
from symgen.model.library import bundled, find, load

pytestmark = pytest.mark.slow
FREEDOMS = 5


@functools.cache
def description(name: str):
    return load(find(name)).describe()


def freedoms(name: str) -> int:
    d = description(name)
    return len(d.rates) - len(d.constraints) - len(d.velocity_constraints)


NAMES = [name for name in sorted(bundled()) if freedoms(name) <= FREEDOMS and not description(name).joints]
NAMES = [name for name in NAMES if not description(name).states]  # which SymPy's mechanics has not


@pytest.mark.parametrize("name", NAMES)
def test_the_module_is_sympys(name):
    system, reference = derive(load(find(name))), Reference(description(name))
    p, (q, v, _, _) = system.parameter_values(), system.initial_state()
    nq, nv, m = system.nq, system.nv, system.m
    rng = np.random.default_rng(5)
    for _ in range(2):
        t, y = rng.uniform(0.1, 1.0), np.concatenate([q, v]) + 0.2 * rng.standard_normal(nq + nv)
        M, f = reference.equations(t, y)
        G = reference.G(t, y) if m else np.zeros((0, nv))
        gamma = reference.gamma(t, y) if m else np.zeros(0)
        assert system.kernel("energy")(t, y, p) == pytest.approx(reference.energy(t, y), rel=1e-10, abs=1e-10)
        near(system.kernel("mass_matrix")(t, y, p).reshape(nv, nv), M)
        near(system.kernel("forces")(t, y, p), f)
        if m:
            near(system.kernel("constraint_jacobian")(t, y, p).reshape(m, nv), G)
            near(system.kernel("gamma")(t, y, p), gamma)
        row = system.kernel("rhs")(t, y, p)
        a, lam = row[nq : nq + nv], row[system.ny : system.ny + m]
        assert row[:nq] == pytest.approx(y[nq:], rel=1e-15)
        terms = np.abs(M) @ np.abs(a) + np.abs(f) + np.abs(G.T) @ np.abs(lam)
        assert (np.abs(M @ a - f - G.T @ lam) <= 1e-9 * np.maximum(terms, 1e-3 * terms.max())).all()
        if m:
            rows = [k for k in range(m) if k not in system.dependent]
            terms = np.abs(G) @ np.abs(a) + np.abs(gamma)
            assert (np.abs(G @ a - gamma)[rows] <= 1e-9 * np.maximum(terms, 1e-3 * terms.max())[rows]).all()


def near(actual: np.ndarray, expected: np.ndarray) -> None:
    scale = np.abs(expected).max(initial=0.0)
    np.testing.assert_allclose(actual, expected, rtol=1e-9, atol=1e-10 * scale)
