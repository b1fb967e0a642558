"""Projection in explicit methods: fully where a state is seen, no further than the tolerance asks in between."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from symgen import runtime
from symgen.link import derive_text
from symgen.model.library import find, load
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays

ADAPTIVE = [name for name, method in METHODS.items() if method.adaptive and method.growth is not None]
ON_CONSTRAINTS = 1e-12
SPAN, MOST_STEPS = 1.0, 100_000


@functools.cache
def system(name: str) -> runtime.System:
    return runtime.load(derive_text(load(find(name))).text)


@functools.cache
def start(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Parameters and a state on the constraints."""
    run = system(name).run(t_end=1e-9)
    return run.p, np.concatenate([run.q[0], run.v[0]])


def advanced(name: str, method: str, rtol: float, frame_times: np.ndarray) -> LoopArrays:
    p, state = start(name)
    arrays = LoopArrays(
        system(name), METHODS[method], p, 0.0, state, frame_times=frame_times, rtol=rtol, atol=1e-2 * rtol,
        with_events=False, log_length=MOST_STEPS,
    )  # fmt: skip
    assert arrays.advance(SPAN, MOST_STEPS) == at.REACHED_STOP
    return arrays


def residual(name: str, t: float, y: np.ndarray) -> float:
    """The largest residual of the constraints, positions and velocities."""
    p, state = start(name)
    return float(np.max(np.abs(system(name).kernel("constraint_residual")(t, y[: len(state)], p))))


@pytest.mark.parametrize("rtol", [1e-2, 1e-4, 1e-8])
@pytest.mark.parametrize("method", ADAPTIVE)
@pytest.mark.parametrize("name", ["slider_crank", "car_axis", "heavy_top_absolute"])
def test_states_that_are_seen_are_on_the_constraints(name, method, rtol):
    """Within steps, at the end of one, and where the run stops; a residual is as large as the error where none is."""
    alone = advanced(name, method, rtol, np.zeros(0))
    ends = alone.new_steps[:, 0]
    # A frame at its end leaves a step as it is, but may change the digits of those after it.
    seen = np.array([0.31 * ends[0], 0.7 * ends[0] + 0.3 * ends[1], ends[len(ends) // 2], SPAN])
    arrays = advanced(name, method, rtol, seen)
    assert seen[2] in arrays.new_steps[:, 0]
    for t, y in [*zip(seen, arrays.frames, strict=True), (SPAN, alone.y)]:
        assert residual(name, t, y) <= ON_CONSTRAINTS * max(1.0, float(np.max(np.abs(y))))
    assert np.array_equal(arrays.frames[-1], arrays.y)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
@pytest.mark.parametrize("name", ["slider_crank", "car_axis", "heavy_top_absolute"])
def test_one_gauss_step_is_enough_in_between(name, rtol):
    counters = advanced(name, "dop853", rtol, np.zeros(0)).counters
    assert counters[at.PROJECTIONS] <= 1.05 * counters[at.STEPS] + 3


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("method", ADAPTIVE)
def test_few_steps_are_rejected_where_the_error_comes_and_goes(method, rtol):
    counters = advanced("car_axis", method, rtol, np.zeros(0)).counters
    assert counters[at.REJECTED] <= 0.15 * counters[at.STEPS]
