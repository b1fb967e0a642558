"""Assemblies: against the same models written out by hand, and hostile ones."""

from __future__ import annotations

import dataclasses
import os

import numpy as np
import pytest
from assembled_models import pair

import symgen
from symgen import Model
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.model import assemblies, description
from symgen.runtime.batches import evaluate


def by_name(system, function: str, values: dict[str, float]) -> dict[str, float]:
    """What a function writes for states and parameters by names, dots and underscores being one."""
    names = [x["name"].replace(".", "_") for x in (*system.coordinates, *system.rates)]
    marked = names[: len(system.coordinates)] + [f"dot {x}" for x in names[len(system.coordinates) :]]
    y = np.array([[values[x] for x in marked]])
    p = system.parameter_values({})
    written = evaluate(system, function, p, np.array([0.3]), y)[0]
    if function == "rhs":
        return dict(zip(marked, written, strict=False))
    return dict(zip((x["name"].replace(".", "_") for x in system.outputs), written, strict=True))


def random_state(system, rng) -> dict[str, float]:
    """Values by names."""
    names = [x["name"].replace(".", "_") for x in system.coordinates]
    rates = [f"dot {x['name'].replace('.', '_')}" for x in system.rates]
    return {x: float(rng.normal()) for x in (*names, *rates)}


@pytest.mark.parametrize("seed", range(12))
def test_assemblies_are_the_models_written_out(seed):
    assembled, flat = pair(seed)
    made, again, plain = assembled.derive(), Model.from_toml(assembled.to_toml()).derive(), flat.derive()
    assert Model.from_toml(assembled.to_toml()).to_toml() == assembled.to_toml()
    rng = np.random.default_rng(seed)
    for _ in range(5):
        state = random_state(made, rng)
        for function in ("rhs", "outputs"):
            found, expected = by_name(made, function, state), by_name(plain, function, state)
            assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)
            assert by_name(again, function, state) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    ends = [x.run(t_end=0.5, rtol=1e-11, atol=1e-12) for x in (made, plain)]
    names = [x["name"] for x in plain.coordinates]
    for run in ends:
        assert run.status == "success"
    for x in made.coordinates:
        other = x["name"].replace(".", "_")
        assert other in names
        if not other.endswith("_integral"):
            assert ends[0][x["name"]][-1] == pytest.approx(ends[1][other][-1], rel=1e-8, abs=1e-8)
    assert [e.name.replace(".", "_") for e in ends[0].events] == [e.name for e in ends[1].events]
