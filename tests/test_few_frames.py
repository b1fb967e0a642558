"""The health report sees a run as a whole, however few frames were asked for, which are what there is."""

import numpy as np
import pytest

from symgen import Model, load
from symgen.runtime.options import RunOptions


@pytest.fixture(scope="module")
def double_pendulum():
    return load("double_pendulum")


@pytest.mark.parametrize("frames", [{"t_eval": [100.0]}, {"fps": 0.05}], ids=["t_eval", "fps"])
def test_a_chaotic_run_is_doubted_however_few_frames_it_has(double_pendulum, frames):
    run = double_pendulum.run(100.0, **frames)
    assert len(run.t) < 8
    assert [entry.check for entry in run.objections] == ["accuracy"]


def test_few_frames_of_a_regular_run_are_those_of_many(double_pendulum):
    few = double_pendulum.run(4.0, t_eval=[1.0, 3.0])
    many = double_pendulum.run(4.0, t_eval=np.linspace(0.0, 4.0, 401))
    rows = np.searchsorted(many.t, few.t)
    assert few.t.tolist() == [0.0, 1.0, 3.0, 4.0]
    assert few.ok and np.array_equal(few.states, many.states[rows])
    assert np.array_equal(few.energy.total, many.energy.total[rows])
    assert few.energy.max_error == few.whole.energy.max_error and len(few.whole.t) > 200


@pytest.mark.parametrize(
    ("n_numbers", "others"), [(0, 196), (2399, 196), (2400, 96), (6000, 36), (60_000, 36)]
)
def test_large_states_have_fewer_frames_beside_those_asked_for(n_numbers, others):
    """Each is a projection and a copy: of a chain of 10 000 bodies 200 of them were a quarter of a run."""
    times, shown = RunOptions(t_end=1.0, fps=4.0).frame_times(n_numbers)
    assert times[shown].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert np.count_nonzero(~shown) == others
    assert set(times) <= set(RunOptions(t_end=1.0, fps=4.0).frame_times()[0])
    assert np.diff(times).max() < 0.03


def test_prepared_runs_are_doubted_by_what_lies_between_their_times(double_pendulum):
    run = double_pendulum.prepare(100.0, output=[100.0], checks="full")
    with pytest.raises(Exception, match=r"accuracy: .* of its range"):
        run()


def test_a_run_that_ends_long_before_its_time_is_looked_at_closely():
    model = Model("early")
    model.coordinate("x", start=1.0)
    model.kinetic("dot(x)^2/2")
    model.potential("x^2/2")
    model.event("stop", "t - 40", then="terminate")
    run = model.derive().run(1e6, method="rk4", step=0.9)
    assert run.status == "terminated" and run.t.tolist() == [0.0, 40.0]
    assert abs(run["x"][-1] - np.cos(40.0)) > 0.1
    assert "accuracy" in [entry.check for entry in run.objections]
