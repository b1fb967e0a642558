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


def _same(one, other):
    """Whether two runs and their reports are the same to the last bit."""
    return (
        np.array_equal(one.states, other.states)
        and np.array_equal(one.step_log, other.step_log)
        and (one.stats, one.status, one.notes) == (other.stats, other.status, other.notes)
        and [vars(entry) for entry in one.health] == [vars(entry) for entry in other.health]
    )


def test_runs_between_others_are_those_of_a_model_that_made_no_other(source):
    """Arrays are handed on from run to run, and to companions, with other tolerances, methods, frames and starts."""
    for name, text in source.items():
        system = runtime.load(text)
        asked = [
            {"method": "dop853", "rtol": 1e-6},
            {"method": "dop853", "rtol": 1e-6, "atol": 1e-12},
            {"method": "dop853", "rtol": 1e-8},
            {"method": "taylor"},
            {"method": "dop853", "rtol": 1e-6, "max_steps": 7},
            {"method": "rk4", "step": 1e-3, "at": [0.25]},
            {"fps": 31.0, "energy_scaling": False},
            {"t_eval": [0.1, 0.2]},
            {},
        ]
        asked += asked[::-1]
        for options in asked:
            assert _same(system.run(0.5, **options), runtime.load(text).run(0.5, **options)), (name, options)


def test_what_is_equal_but_not_the_same_is_told_apart(source):
    system = runtime.load(source["double_pendulum"])
    angle = system.coordinates[0]["name"]
    for value in (0.0, -0.0):
        assert np.signbit(system.run(0.1, start={angle: value}).q[0, 0]) == np.signbit(value)
    # What a caller holds may change between runs.
    start = {angle: 0.5}
    first = system.run(0.1, start=start)
    start[angle] = 0.7
    assert (first.q[0, 0], system.run(0.1, start=start).q[0, 0]) == (0.5, 0.7)
    wanted = np.array([0.02, 0.05])
    system.run(0.1, t_eval=wanted)
    wanted[:] = 0.03, 0.04
    assert set(wanted) <= set(system.run(0.1, t_eval=wanted).t)
