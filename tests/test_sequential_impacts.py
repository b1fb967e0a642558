"""Impacts one after another: Newton's cradle, and what becomes of it with less restitution."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model
from symgen.errors import ModelError


def row(
    n: int, struck_by: int = 1, restitution: float = 1.0, masses=None, impacts: str = "sequential"
) -> Model:
    """Balls of unit size that touch, the first ones coming with unit speed."""
    m = Model("row", impacts=impacts)
    starts = [k - 0.5 * (k < struck_by) for k in range(n)]
    x = [m.coordinate(f"x{k}", start=starts[k], rate=float(k < struck_by)) for k in range(n)]
    for k in range(n):
        m.body(f"b{k}", mass=1.0 if masses is None else masses[k], com=(x[k], 0))
    for k in range(n - 1):
        m.stop(f"s{k}", x[k + 1] - x[k] - 1.0, restitution)
    return m


@pytest.mark.parametrize("struck_by", [1, 2, 3])
def test_as_many_balls_fly_off_as_come(struck_by):
    run = row(5, struck_by).derive().run(t_end=1.0, method="dop853")
    assert run.ok
    np.testing.assert_allclose(run.v[-1], np.arange(5) >= 5 - struck_by, atol=1e-12)
    assert run.energy.final == pytest.approx(0.5 * struck_by)


def test_unequal_balls_are_struck_in_order():
    """1, 3, 1: two blows by the formula of two balls each, and what follows from them."""
    run = row(3, masses=(1.0, 3.0, 1.0)).derive().run(t_end=1.0, method="dop853")
    v = np.array([1.0, 0.0, 0.0])
    masses = (1.0, 3.0, 1.0)
    while (closing := v[:-1] - v[1:]).max() > 1e-12:
        k = int(np.argmax(closing))
        impulse = 2.0 * closing[k] * masses[k] * masses[k + 1] / (masses[k] + masses[k + 1])
        v[k] -= impulse / masses[k]
        v[k + 1] += impulse / masses[k + 1]
    np.testing.assert_allclose(run.v[-1], v, atol=1e-12)


def test_little_restitution_comes_to_an_end():
    """Blows without an end: momentum stays, nothing closes, and energy is lost."""
    run = row(5, restitution=0.1).derive().run(t_end=0.6, method="dop853")
    assert run.status == "success"
    assert run.v[-1].sum() == pytest.approx(1.0)
    assert np.diff(run.v[-1]).min() > -1e-9
    assert run.energy.final < 0.5


def test_the_law_is_part_of_the_model():
    text = row(3).to_toml()
    assert 'impacts = "sequential"' in text
    assert Model.from_toml(text).derive().sequential_impacts
    assert "impacts" not in row(3, impacts="simultaneous").to_toml()
    with pytest.raises(ModelError, match="impacts are not 'sequentiel'"):
        Model.from_toml(text.replace("sequential", "sequentiel"))
