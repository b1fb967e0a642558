"""Controllers: sampled ones as discrete-time systems, continuous ones as part of the equations, noise by seed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from driven_models import C, K, M, closed_crane, crane, oscillator
from scipy.linalg import expm

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs import Controller, Table
from symgen.runtime.inputs.drive import drive

GAIN = np.array([12.0, 3.5])


def discrete_motion(period, n, feedback):
    """The oscillator under a force that is held between samples: x' = A x + B u, exactly."""
    extended = np.zeros((3, 3))
    extended[0, 1], extended[1] = 1.0, [-K / M, -C / M, 1.0 / M]
    transition = expm(period * extended)[:2]
    states, forces = [np.array([0.3, -0.2])], []
    for k in range(n):
        forces.append(feedback(k * period, states[-1]))
        states.append(transition @ [*states[-1], forces[-1]])
    return np.array(states), np.array(forces)


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5", "bdf", "gauss8"])
def test_a_sampled_controller_is_its_discrete_time_system(method):
    period, n = 0.05, 30
    law = Controller(lambda t, x: -GAIN @ x + math.sin(t), period=period)
    times = [k * period for k in range(1, n + 1)]
    settings = {"step": 0.025} if method == "gauss8" else {"rtol": 1e-11, "atol": 1e-13}
    run = oscillator().run(inputs={"u": law}, t_end=n * period, at=times, method=method, **settings)
    states, forces = discrete_motion(period, n, lambda t, x: -GAIN @ x + math.sin(t))
    seen = np.array([[sample.q[0], sample.v[0]] for sample in run.samples])
    assert np.abs(seen - states[1:]).max() < (1e-6 if method == "bdf" else 1e-9)
    held = run["u"][np.searchsorted(run.t, times[:-1], side="right")]
    np.testing.assert_allclose(held, forces[1:], rtol=0.0, atol=1e-5)
    assert run.ok, run.objections


def test_memory_is_kept_within_a_run_and_not_beyond():
    def integral(t, x, memory):
        memory[0] += 0.05 * (0.2 - x[0])
        return 30.0 * memory[0]

    law = Controller(integral, period=0.05, reads=["x"], memory=[0.0])
    runs = [oscillator().run(inputs={"u": law}, t_end=1.0, method="dop853") for _ in range(2)]
    assert np.array_equal(runs[0].q, runs[1].q)
    state, total = [], 0.0

    def feedback(t, x):
        nonlocal total
        total += 0.05 * (0.2 - x[0])
        return 30.0 * total

    state, _ = discrete_motion(0.05, 20, feedback)
    np.testing.assert_allclose([runs[0].q[-1, 0], runs[0].v[-1, 0]], state[-1], rtol=0.0, atol=1e-7)


def test_noise_follows_the_seed_alone():
    def heard(method, seed, **noise):
        seen = []
        law = Controller(lambda t, x: seen.append(x.copy()) or 0.0, period=0.01, seed=seed, **noise)
        run = oscillator().run(
            inputs={"u": law}, t_end=5.0, at=np.arange(500) * 0.01, method=method, rtol=1e-10
        )
        true = np.array([[sample.q[0], sample.v[0]] for sample in run.samples])
        return np.array(seen[:500]), true

    first, true = heard("dop853", 7, noise={"x": 0.1})
    noise = first - true
    assert np.abs(noise[:, 1]).max() < 1e-12
    assert noise[:, 0].std() == pytest.approx(0.1, rel=0.1) and abs(noise[:, 0].mean()) < 0.02
    again, _ = heard("dop853", 7, noise={"x": 0.1})
    assert np.array_equal(first, again)
    by_other_steps, _ = heard("dopri5", 7, noise=[0.1, 0.0])
    np.testing.assert_allclose(first, by_other_steps, rtol=0.0, atol=1e-7)
    other, _ = heard("dop853", 8, noise={"x": 0.1})
    assert np.abs(other - first)[:, 0].max() > 0.1


@pytest.mark.parametrize("method", ["dop853", "rk4", "radau5", "gauss6", "generalized_alpha", "auto"])
def test_a_continuous_controller_is_as_good_as_one_in_the_equations(method):
    fixed = {"rk4": 0.005, "gauss6": 0.02, "generalized_alpha": 0.01}
    settings = {"step": fixed[method]} if method in fixed else {"rtol": 1e-9, "atol": 1e-11}
    law = Controller(lambda t, x: -12.0 * x[0] - 3.5 * x[1] + 2.0 * math.sin(3.0 * t))
    given = oscillator().run(inputs={"u": law}, t_end=1.0, method=method, **settings)
    written = oscillator("-12*x - 3.5*dot(x) + 2*sin(3*t)").run(
        t_end=1.0, method="dop853" if method == "auto" else method, **settings
    )
    assert given.method == written.method
    assert np.abs(given.q - written.q).max() < (1e-7 if method not in fixed else 1e-9)
    assert given.ok, given.objections


def test_the_jacobian_knows_what_controllers_do():
    law = Controller(lambda t, x: math.sin(3.0 * x[1]) - x[0] * x[3] + t)
    system = drive(closed_crane(), {"u": law}, closed_crane().parameter_values(), 0.0, 10.0)
    p, random = closed_crane().parameter_values(), np.random.default_rng(2)
    rows, width = system.nv + system.m, 3 * system.nv + system.m
    for _ in range(5):
        y = random.normal(size=width)
        jacobian = system.kernel("residual_jacobian")(0.3, y, p).reshape(rows, width)
        for j in range(width):
            moved = np.zeros(width)
            moved[j] = 1e-5
            difference = system.kernel("residual")(0.3, y + moved, p) - system.kernel("residual")(
                0.3, y - moved, p
            )
            np.testing.assert_allclose(jacobian[:, j], difference / 2e-5, rtol=0.0, atol=1e-7)


def test_stiff_feedback_takes_the_steps_of_stiff_equations():
    law = Controller(lambda t, x: -4e4 * x[1])
    runs = [
        oscillator().run(inputs={"u": law}, t_end=2.0, method="radau5"),
        oscillator("-40000*dot(x)").run(t_end=2.0, method="radau5"),
    ]
    assert abs(runs[0].stats["steps"] - runs[1].stats["steps"]) <= 3
    assert runs[0].stats["newton"] <= 1.2 * runs[1].stats["newton"] + 10
    np.testing.assert_allclose(runs[0].q[-1], runs[1].q[-1], rtol=0.0, atol=1e-8)


def test_controllers_read_what_they_name_and_may_give_several_inputs():
    law = Controller(lambda t, x: (2.0 * x[0], np.array([x[1]])[0]), reads=["dot(theta)", "theta"])
    run = crane().run(inputs={("torque", "u"): law}, t_end=0.5, method="dop853")
    np.testing.assert_allclose(run["torque"], 2.0 * run["dot(theta)"], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(run["u"], run["theta"], rtol=0.0, atol=1e-14)
    sampled = Controller(lambda t, x: x, period=0.1, reads=["dot(theta)", "theta"])
    run = crane().run(inputs={("torque", "u"): sampled}, t_end=0.5, method="dop853")
    assert run["u"][0] == 0.4 and run["torque"][0] == 0.0


def test_outputs_are_sensors():
    continuous = oscillator().run(
        inputs={"u": Controller(lambda t, x: -5.0 * x[0], reads=["stretch"])}, t_end=0.5, method="dop853"
    )
    np.testing.assert_allclose(continuous["u"], -5.0 * continuous["stretch"], rtol=0.0, atol=1e-13)
    seen = []
    law = Controller(lambda t, x: seen.append(x[0]) or 1.0 + t, period=0.1, reads=["push"])
    run = oscillator().run(inputs={"u": law}, t_end=0.5, at=[0.1, 0.2], method="dop853")
    held = [0.0, 1.0, 1.1]  # before the first call, and as the calls before left it
    expected = [h - K * x for h, x in zip(held, [0.3, run.samples[0].q[0], run.samples[1].q[0]])]
    np.testing.assert_allclose(seen[:3], expected, rtol=0.0, atol=1e-12)


def test_a_controller_beside_a_table():
    table = Table([0.0, 0.25, 1.0], [0.0, 1.0, -1.0], "hold")
    run = crane().run(
        inputs={"u": table, "torque": Controller(lambda t, x: -x[1], period=0.1)}, t_end=1.0, method="taylor"
    )
    assert run.ok, run.objections
    assert run["u"][np.searchsorted(run.t, 0.25)] == 1.0
    assert run.energy.max_error < 1e-7


def test_recordings_of_controllers_are_verified(tmp_path):
    from symgen.runtime.recording.verify import verify

    sampled = Controller(lambda t, x: -2.0 * x[0], period=0.05, noise=0.01)
    continuous = Controller(lambda t, x: -2.0 * x[0])
    for name, law in (("sampled", sampled), ("continuous", continuous)):
        closed_crane().run(inputs={"u": law}, t_end=1.0, method="dop853").save(tmp_path / f"{name}.rrd")
        report = verify(tmp_path / f"{name}.rrd", intervals=20)
        assert report.ok, report.summary
        checks = {check.name: check.ok for check in report.checks}
        assert checks["equations"] and checks["multipliers"]
        assert checks["motion"] is (True if name == "sampled" else None)


@pytest.mark.parametrize(
    ("law", "cause"),
    [
        (lambda: Controller(3.0), "give a function"),
        (lambda: Controller(abs, period=0.0), "period of a controller is 0.0"),
        (lambda: Controller(abs, noise=0.1), "must be sampled"),
        (lambda: Controller(abs, memory=[0.0]), "must be sampled"),
        (lambda: Controller(lambda t, x: 1.0, reads=["y"]), "reads 'y', which is no coordinate"),
        (lambda: Controller(lambda t, x: 1.0, period=0.1, noise={"z": 1.0}), "noise on 'z'"),
        (lambda: Controller(lambda t, x: 1.0, period=0.1, noise=[1.0]), "or 2 of them"),
        (lambda: Controller(lambda t, x: 1.0, period=0.1, noise=-1.0), "not negative"),
        (lambda: Controller(lambda t, x: 1.0, reads=["push"]), "reads 'push', which reads this input"),
        (lambda: Controller(lambda t, x: (1.0, 2.0), period=0.1), "must return one number"),
        (lambda: Controller(lambda t, x: math.nan, period=0.1), "returned nan at t = 0 s"),
        (lambda: Controller(lambda t, x: "no", period=0.1), "must return one number"),
    ],
)
def test_what_is_no_controller_is_refused(law, cause):
    with pytest.raises(RuntimeModelError, match=cause):
        oscillator().run(inputs={"u": law()}, t_end=1.0, method="dop853")


def test_what_numba_cannot_compile_is_refused():
    from symgen.runtime.code import numba_setup

    if numba_setup.DISABLE_JIT:
        pytest.skip("nothing is compiled")
    with pytest.raises(
        RuntimeModelError, match=r"Numba cannot compile the controller 'law'.*give it a period"
    ):

        def law(t, x):
            return open("file").read()

        oscillator().run(inputs={"u": Controller(law)}, t_end=1.0, method="dop853")


def test_series_are_refused_to_continuous_controllers():
    with pytest.raises(RuntimeModelError, match="acts at every instant"):
        oscillator().run(inputs={"u": Controller(lambda t, x: -x[0])}, t_end=1.0, method="taylor")


def _late(t, x):
    if t > 0.3:
        raise ValueError("too late")
    return 0.0


@pytest.mark.parametrize("method", ["dop853", "radau5", "bdf", "rk4"])
@pytest.mark.parametrize(
    ("law", "cause"),
    [
        (Controller(lambda t, x: -2.0 * x[2]), r"'u' raised IndexError .*; its x holds 2 values: x, dot\(x\)"),
        (Controller(lambda t, x: x[10**7]), "raised IndexError"),
        (Controller(lambda t, x: x[-9]), "raised IndexError"),
        (Controller(_late), r"raised ValueError \(too late\) at t = 0\.3"),
        (Controller(_late, period=0.05), r"raised ValueError \(too late\) at t = 0\.3"),
    ],
)  # fmt: skip
def test_what_a_controller_raises_ends_the_run(method, law, cause, capfd):
    step = {"step": 0.01} if method == "rk4" else {}
    with pytest.raises(RuntimeModelError, match=cause):
        oscillator().run(inputs={"u": law}, t_end=1.0, method=method, **step)
    assert "Exception ignored" not in capfd.readouterr().err


@pytest.mark.parametrize("period", [1e-12, 1e-300, 5e-324])
def test_tiny_periods_are_refused_as_tiny_steps_are(period):
    law = Controller(lambda t, x: 0.0, period=period)
    with pytest.raises(RuntimeModelError, match="the period of the controller is"):
        oscillator().run(inputs={"u": law}, t_end=1.0)
