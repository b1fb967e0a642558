"""The driver: options, frames, samples, energy, notes, failures, interruption, recorder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from symgen import Model
from symgen.runtime import RunOptions, load, solve
from symgen.runtime.checks.time_scales import time_scales
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.event_actions import ZenoDetector
from symgen.runtime.run_state import StepLog

FIXTURES = Path(__file__).parent / "fixtures"


@pytest.fixture(scope="module")
def pendulum():
    return load(FIXTURES / "pendulum.py")


@pytest.fixture(scope="module")
def cartesian():
    return load(FIXTURES / "cartesian_pendulum.py")


@pytest.fixture(scope="module")
def oscillator():
    return load(FIXTURES / "oscillator.py")


class Recorder:
    def __init__(self):
        self.times, self.rows, self.log, self.started, self.largest = [], [], 0, None, 0

    def start(self, t, y):
        self.started = (t, y)

    def frames(self, times, states):
        self.largest = max(self.largest, len(times))
        self.times.extend(times)
        self.rows.extend(states.copy())

    def steps(self, log):
        self.log += len(log)

    def event(self, name, t, *, energy_change=0.0):
        pass


def test_frames_are_exact(pendulum):
    solution = solve(pendulum, 5.0, method="dop853", fps=100)
    assert len(solution.t) == 501
    np.testing.assert_allclose(solution.t, np.arange(501) / 100, rtol=0, atol=1e-15)
    assert solution.t[-1] == 5.0
    assert solution.energy.max_error < 1e-7
    energy = 0.5 * 0.25 * solution["dot(theta)"] ** 2 - 9.81 * 0.5 * np.cos(solution["theta"])
    np.testing.assert_allclose(solution.energy.total, energy, atol=1e-13)


def test_number_of_frames():
    times, shown = RunOptions(t_end=1.0, fps=None).frame_times()
    assert len(times) == 201 and shown.all()
    assert len(RunOptions(t_end=10.0, fps=None).frame_times()[0]) == 601
    assert len(RunOptions(t_end=1e5, fps=None).frame_times()[0]) == 20_001
    times, shown = RunOptions(t_end=2.0, fps=10).frame_times()
    assert len(times) >= 201 and shown.sum() == 21
    np.testing.assert_allclose(times[shown], np.arange(21) / 10)
    # An end between frames is a frame too.
    times, shown = RunOptions(t_end=1.05, fps=10).frame_times()
    np.testing.assert_allclose(times[shown], [*np.arange(11) / 10, 1.05])
    with pytest.raises(RuntimeModelError, match="fps is 0"):
        RunOptions(t_end=1.0, fps=0).frame_times()


def test_frames_that_memory_cannot_hold_are_refused(pendulum, monkeypatch):
    with pytest.raises(
        RuntimeModelError, match=r"fps is 1e\+12: 1 s make 1.0e\+12 frames, which need .* GiB"
    ):
        solve(pendulum, 1.0, fps=1e12)
    # A large state counts, and a machine that does not say what it has refuses nothing by this.
    options = RunOptions(t_end=1.0, fps=1000.0)
    with pytest.raises(RuntimeModelError, match="a smaller fps"):
        options.frame_times(10**12)
    monkeypatch.delattr("os.sysconf")
    assert len(options.frame_times(10**12)[0]) == 1001


@pytest.mark.parametrize("method", ["dop853", "rk4"])
def test_samples_are_landed_on(pendulum, method):
    times = [0.0, 0.1, 1.0 / 3.0, 2.0]
    solution = solve(pendulum, 2.0, method=method, at=times, step=0.01 if method == "rk4" else None)
    assert [sample.t for sample in solution.samples] == times
    for sample in solution.samples:
        assert sample.acceleration[0] == pytest.approx(-9.81 / 0.5 * np.sin(sample.q[0]), rel=1e-14)
        assert sample.outputs[0] == pytest.approx(-0.5 * np.cos(sample.q[0]), rel=1e-14)
        assert sample.energy == pytest.approx(solution.energy.initial, abs=1e-6)
    np.testing.assert_array_equal(solution.samples[-1].q, solution.q[-1])
    with pytest.raises(RuntimeModelError, match="outside the run"):
        solve(pendulum, 2.0, at=[3.0])


def test_samples_do_not_change_the_motion_beyond_the_tolerance(pendulum):
    plain = solve(pendulum, 3.0, method="dop853", rtol=1e-10)
    many = solve(pendulum, 3.0, method="dop853", rtol=1e-10, at=np.linspace(0.01, 2.99, 150))
    np.testing.assert_allclose(many.q[-1], plain.q[-1], atol=1e-8)
    # A step cut at a stop does not make the ones after it small.
    assert many.stats["steps"] < plain.stats["steps"] + 2 * 150


def test_energy_balance_with_damping_and_input_closes(oscillator):
    solution = solve(oscillator, 20.0, inputs={"force": 0.3}, rtol=1e-10, atol=1e-12)
    assert solution.energy.max_error < 1e-8
    assert abs(solution.w[-1]) > 1e-2
    assert any(event.energy_change < 0.0 for event in solution.events)
    np.testing.assert_allclose(solution.energy.balance, solution.energy.initial, atol=1e-8)


@pytest.mark.parametrize("method", ["dop853", "dopri5", "rk4", "verlet", "semi_implicit_euler", "euler"])
def test_constraints_hold_at_round_off(cartesian, method):
    step = None if method.startswith("dop") else 1e-3
    solution = solve(cartesian, 2.0, method=method, step=step, at=[1.0])
    assert solution.constraint_residual.max_position < 1e-12
    assert solution.constraint_residual.max_velocity < 1e-12
    assert solution.constraints == "projection"
    assert solution.min_pivot_ratio == pytest.approx(1.0)
    sample = solution.samples[0]
    q, v, m, l, g = sample.q, sample.v, 1.0, 0.5, 9.81
    # From the tension of the string: m |v|^2 / l + m g (-y) / l along the rod; Phi_q has length 2 l.
    tension = m * (v @ v) / l - m * g * q[1] / l
    assert sample.multipliers[0] == pytest.approx(-tension / (2 * l), rel=1e-10)
    np.testing.assert_allclose(solution["lambda(rod)"], solution.multipliers[:, 0])


def test_series_by_name(pendulum):
    solution = solve(pendulum, 1.0, method="dop853")
    np.testing.assert_array_equal(solution["theta"], solution.q[:, 0])
    np.testing.assert_allclose(
        solution["dot(dot(theta))"], -9.81 / 0.5 * np.sin(solution["theta"]), rtol=1e-14
    )
    np.testing.assert_allclose(solution["height"], -0.5 * np.cos(solution["theta"]), rtol=1e-14)
    assert set(solution.names()) == {"theta", "dot(theta)", "dot(dot(theta))", "height"}
    with pytest.raises(KeyError, match="did you mean 'theta'"):
        solution["thetta"]


def test_start_rate_and_parameters(pendulum):
    solution = solve(
        pendulum, 0.1, method="dop853", start={"theta": 0.0}, rate={"theta": 3.0}, parameters={"l": 2.0}
    )
    assert solution.q[0, 0] == 0.0 and solution.v[0, 0] == 3.0
    assert solution.energy.initial == pytest.approx(0.5 * 4.0 * 9.0 - 9.81 * 2.0)


def test_auto_says_what_and_why(pendulum):
    solution = solve(pendulum, 1.0)
    assert solution.method == "taylor"
    assert any(note.startswith("method auto: taylor, because") for note in solution.notes)


def test_time_scales(oscillator):
    # Eigenvalues of x'' = -k x - c x': overdamped with k = 1, c = 1000.
    scales = time_scales(
        oscillator, oscillator.parameter_values({"c": 1000.0, "k": 1.0}), 0.0, np.zeros(1), np.zeros(1)
    )
    assert scales.decay == pytest.approx(1000.0, rel=1e-3)
    scales = time_scales(oscillator, oscillator.parameter_values({"c": 0.0}), 0.0, np.zeros(1), np.zeros(1))
    assert scales.fastest == pytest.approx(5.0, rel=1e-6)
    assert scales.decay == pytest.approx(0.0, abs=1e-6)
    assert scales.fastest_period == pytest.approx(2 * np.pi / 5.0, rel=1e-6)


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e6])
def test_time_scales_are_those_of_motions_of_any_size(size):
    model = Model("well")
    model.coordinate("x", start=0.3 * size)
    model.coordinate("y")  # of ordinary size, at rest
    model.kinetic("dot(x)^2/2 + dot(y)^2/2")
    model.potential(f"{size!r}^2*(exp(-2*(x/{size!r})) - 2*exp(-x/{size!r})) + 8*(1 - cos(y))")  # Morse's
    system = model.derive()
    q, v, _, _ = system.initial_state()
    found = time_scales(system, system.parameter_values(), 0.0, q, v).eigenvalues
    curvature = 4.0 * np.exp(-0.6) - 2.0 * np.exp(-0.3)
    expected = np.sqrt(np.array([-curvature, -8.0], dtype=complex))
    np.testing.assert_allclose(np.sort(np.abs(found.imag)), np.sort(np.repeat(expected.imag, 2)), rtol=1e-4)


def test_stiff_models_are_noticed(oscillator):
    stiff = {"c": 1e6, "k": 1.0, "amplitude": 1e3}
    solution = solve(oscillator, 1.0, parameters=stiff)
    assert "radau9, because stability" in solution.notes[0] and solution.energy.max_error < 1e-4
    explicit = solve(oscillator, 0.01, method="dop853", parameters=stiff)
    assert any("radau5" in note for note in explicit.notes)


def test_default_step_is_a_fiftieth_of_the_fastest_period(pendulum):
    solution = solve(pendulum, 10.0, method="rk4", start={"theta": 0.0}, rate={"theta": 0.1})
    period = 2 * np.pi / np.sqrt(9.81 / 0.5)
    assert solution.step == pytest.approx(period / 50, rel=1e-4)
    assert any(note.startswith("step:") for note in solution.notes)


def test_recorder_gets_every_frame_once(pendulum):
    recorder = Recorder()
    solution = solve(pendulum, 50.0, method="dop853", fps=100, recorder=recorder)
    assert recorder.started[0] == 0.0
    np.testing.assert_array_equal(recorder.times, solution.t[1:])
    np.testing.assert_array_equal(np.vstack(recorder.rows), np.hstack([solution.q, solution.v])[1:])
    assert recorder.largest <= 1000
    assert recorder.log == solution.stats["steps"]


def test_recorder_may_be_made_once_settings_are_known(pendulum):
    made = {}

    def make(**facts):
        made.update(facts, recorder=Recorder())
        return made["recorder"]

    solve(pendulum, 1.0, recorder=make)
    assert made["method"] == "taylor" and made["constraints"] == "none" and len(made["p"]) == 3
    assert len(made["recorder"].times) == 200


def test_ctrl_c_keeps_what_was_done(pendulum):
    def progress(t, steps):
        if t > 20.0:
            raise KeyboardInterrupt

    solution = solve(pendulum, 1e5, method="dop853", progress=progress)
    assert solution.status == "interrupted"
    assert 20.0 < solution.t[-1] < 1e5
    assert np.isfinite(solution.q).all() and len(solution.step_log) == solution.stats["steps"]


def test_too_many_steps(pendulum):
    solution = solve(pendulum, 1000.0, method="dop853", max_steps=50)
    assert solution.status == "failed" and solution.stats["steps"] == 50
    assert "50 steps" in solution.message


def test_failures_name_cause_time_coordinate_and_remedy(pendulum, oscillator):
    with pytest.raises(RuntimeModelError, match=r"how coordinate 'theta' accelerates .* give it a mass"):
        solve(pendulum, 1.0, method="dop853", parameters={"l": 0.0})
    solution = solve(oscillator, 1000.0, method="rk4", step=5.0)
    assert solution.status == "failed" and "smaller --step" in solution.message
    assert np.isfinite(solution.q).all()


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"method": "dop835"}, "did you mean 'dop853'"),
        ({"constraints": "ggl"}, "has no constraints"),
        ({"constraints": "projecton"}, "did you mean 'projection'"),
        ({"method": "dop853", "step": 0.1}, "chooses its own steps"),
        ({"method": "rk4", "step": -0.1}, "step is -0.1"),
        ({"t_end": -1.0}, "must lie after"),
        ({"rtol": np.nan}, "rtol is nan"),
        ({"parameters": {"mass": 1.0}}, "no parameter or input 'mass'"),
    ],
)
def test_wrong_options_are_refused(pendulum, options, text):
    with pytest.raises((RuntimeModelError, KeyError), match=text):
        solve(pendulum, **{"t_end": 1.0, **options})


def test_rtol_below_round_off_is_raised_with_a_note(pendulum):
    solution = solve(pendulum, 1.0, rtol=1e-18, atol=0.0)
    assert solution.rtol == 1e-15 and any(note.startswith("rtol:") for note in solution.notes)
    assert solution.status == "success"


def test_long_step_logs_are_thinned_evenly():
    log = StepLog()
    for k in range(900):
        log.add(np.column_stack([np.arange(1000) + 1000.0 * k, np.ones(1000)]))
    rows = log.array()
    assert len(rows) <= 200_000
    assert len(set(np.diff(rows[:, 0]))) == 1


def test_zeno_detector_tolerates_regular_and_slowing_events():
    detector = ZenoDetector()
    assert all(detector.look(t) is None for t in np.cumsum(np.full(200, 1e-3)))
    detector = ZenoDetector()
    assert all(detector.look(t) is None for t in np.cumsum(0.99 ** np.arange(200)))
    detector = ZenoDetector()
    found = [detector.look(t) for t in np.cumsum(0.5 ** np.arange(40))]
    assert next(t for t in found if t is not None) == pytest.approx(2.0, abs=1e-12)


@pytest.mark.parametrize("method", ["dop853", "rk4", "verlet"])
def test_nothing_is_allocated_per_step(pendulum, method):
    """Thousands of further steps keep less than a pointer each; `jitted` refuses what would allocate anyway."""
    import tracemalloc

    from symgen.runtime.integrate import layout as at
    from symgen.runtime.integrate.methods import METHODS
    from symgen.runtime.loop_arrays import LoopArrays

    def steps_and_peak(t_end):
        arrays = LoopArrays(
            pendulum, METHODS[method], pendulum.parameter_values(), 0.0, np.array([1.5, 0.0]),
            frame_times=np.linspace(0.01, 19.9, 100), rtol=1e-13, atol=1e-15,
            log_length=1 << 17, step=0.0 if METHODS[method].adaptive else 0.005,
        )  # fmt: skip
        arrays.advance(0.1, 10)
        tracemalloc.start()
        arrays.advance(t_end, 1_000_000)
        taken = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return arrays.counters[at.STEPS], taken

    few_steps, small = steps_and_peak(8.0)
    # Faster code may come in the middle of one of them; what steps keep is kept in all.
    many_steps, large = min((steps_and_peak(400.0) for _ in range(3)), key=lambda found: found[1])
    assert many_steps - few_steps > 2000
    assert large - small < 8 * (many_steps - few_steps)
