"""Whether frictions in proportion to reactions leave one motion, with few stops and with many."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from symgen import Model, cos, dot, sin
from symgen.runtime.contact.coulomb import check_unique
from symgen.runtime.contact.levels import Levels, Paradox

G = 9.81


def rubbing_stops(random, n, freedoms, coefficient):
    """Stops with a friction on each, on a system of as many freedoms."""
    rows = random.normal(size=(2 * n, freedoms))
    rows[n:] = 0.5 * rows[n:] + coefficient * random.normal(size=(n, freedoms))
    levels = Levels(np.zeros(n), np.full(n, coefficient), [(k, np.zeros(0, dtype=int)) for k in range(n)])
    here = SimpleNamespace(compliance=rows @ rows.T, multiplier_responses=np.zeros((0, 2 * n)))
    return here, levels


def is_unique_by_definition(here, levels, senses):
    """By all principal minors that are not zero without friction, one after another."""
    n = len(senses)
    normal, across = here.compliance[:n, :n], here.compliance[:n, n:]
    with_friction = normal - across * (senses * levels.coefficients)
    scale = 1.0 / np.sqrt(np.diag(normal))
    for size in range(1, n + 1):
        for chosen in itertools.combinations(range(n), size):
            part = np.ix_(chosen, chosen)
            own = np.outer(scale, scale)[part]
            plain = np.linalg.det(normal[part] * own)
            if plain > 1e-10 and np.linalg.det(with_friction[part] * own) <= 1e-9 * plain:
                return False
    return True


@pytest.mark.parametrize("n, freedoms", [(4, 6), (10, 6), (12, 3), (12, 5), (13, 2)])
def test_motions_are_unique_where_all_minors_say_so(n, freedoms):
    random, found = np.random.default_rng([n, freedoms]), []
    for k in range(14):
        here, levels = rubbing_stops(random, n, freedoms, 1e-6 * 4.0**k)
        senses = random.choice([-1.0, 1.0], n)
        try:
            # Frictions are against their senses: what acts is -senses L.
            check_unique(
                here, np.ones(n, dtype=bool), np.zeros(n, dtype=bool), senses, levels, np.ones(2 * n)
            )
            found.append(True)
        except Paradox:
            found.append(False)
        assert found[-1] == is_unique_by_definition(here, levels, senses), k
    assert True in found and False in found


def test_of_very_many_stops_a_paradox_of_one_or_two_is_seen():
    random = np.random.default_rng(3)
    here, levels = rubbing_stops(random, 30, 40, 1e-3)
    given = (np.ones(30, dtype=bool), np.zeros(30, dtype=bool), np.ones(30), levels, np.ones(60))
    check_unique(here, *given)
    here.compliance[4, 34] = here.compliance[34, 4] = 2e3 * here.compliance[4, 4]
    with pytest.raises(Paradox):
        check_unique(here, *given)


def test_a_table_that_slides_on_twelve_feet_is_no_paradox():
    m = Model("twelve")
    x, y, z = (
        m.coordinate(name, start=0.0, rate=rate) for name, rate in (("x", 0.8), ("y", 0.6), ("z", 0.0))
    )
    a, b = m.coordinate("a", start=0.0), m.coordinate("b", start=0.0)
    m.body("table", mass=2.0, inertia=[0.02, 0.03, 0.04], com=(x, y, z + 0.05), rotation=[["x", a], ["y", b]])
    m.force(z, -2.0 * G)
    for k in range(12):
        px, py = 0.1 * np.cos(0.5 * k), 0.1 * np.sin(0.5 * k)
        m.stop(f"foot{k}", z + 0.05 - 0.05 * cos(a) * cos(b) + py * sin(a) - px * sin(b) * cos(a))
        m.friction(f"rub{k}", speeds=(dot(x), dot(y)), coefficient=0.3, normal=f"foot{k}")
    run = m.derive().run(t_end=1.0, method="dop853")
    assert run.status == "success", run.message
    way = 1.0 / (2.0 * 0.3 * G)
    np.testing.assert_allclose(run.q[-1], [0.8 * way, 0.6 * way, 0.0, 0.0, 0.0], atol=1e-7)
