"""What is kept of a start serves the same start only, and is nobody's to change."""

import numpy as np
import pytest

from symgen import runtime
from symgen.link import module_for
from symgen.model.library import find


@pytest.fixture(scope="module")
def source():
    return {name: module_for(find(name), {}).text for name in ("slider_crank", "double_pendulum")}


def test_a_repeated_run_is_the_first_to_the_last_bit(source):
    for name, text in source.items():
        system = runtime.load(text)
        first, again = system.run(t_end=1.0), system.run(t_end=1.0)
        fresh = runtime.load(text).run(t_end=1.0)
        for other in (again, fresh):
            assert np.array_equal(first.states, other.states), name
            assert (first.method, first.notes, first.redundant) == (
                other.method,
                other.notes,
                other.redundant,
            )


def test_what_a_start_depends_on_is_noticed(source):
    system = runtime.load(source["slider_crank"])
    q = system.run(t_end=0.1).q[0]
    crank = system.coordinates[0]["name"]
    moved = system.run(t_end=0.1, start={crank: q[0] + 0.3})
    assert abs(moved.q[0, 0] - q[0] - 0.3) < 1e-12
    length = next(record["name"] for record in system.parameters if record["unit"] == "m")
    k = [record["name"] for record in system.parameters].index(length)
    longer = system.run(t_end=0.1, parameters={length: 0.9 * system.parameter_values()[k]})
    assert not np.allclose(longer.q[0], q)
    # A refusal is not kept as consent.
    for _ in range(2):
        with pytest.raises(runtime.RuntimeModelError):
            system.run(t_end=0.1, parameters={system.parameters[-1]["name"]: np.nan})


def test_results_share_nothing_that_is_kept(source):
    system = runtime.load(source["slider_crank"])
    first = system.run(t_end=0.1)
    state, notes = first.states[0].copy(), list(first.notes)
    first.q[:], first.notes[:] = 7.0, ["changed"]
    first.redundant.append("changed")
    again = system.run(t_end=0.1)
    assert np.array_equal(again.states[0], state) and again.notes == notes
    assert again.redundant == []
