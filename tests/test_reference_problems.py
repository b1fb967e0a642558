"""The product, from model file to end of run, against verified digits of reference problems."""

from __future__ import annotations

import functools
import math

import mpmath
import numpy as np
import pytest
from oracles.planar_mechanisms import MECHANISMS
from references import error, load_reference, numbers
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

from symgen.link import derive
from symgen.model.library import find, load

TIGHT = {"method": "dop853", "rtol": 1e-12, "atol": 1e-14}


@functools.cache
def derived(name: str):
    """The system of a bundled model, derived once for all tests of this file."""
    return derive(load(find(name)))


def run(name: str, at: list[float], **options):
    """Samples of a bundled model at the times `at`."""
    solution = derived(name).run(t_end=max(at), at=at, fps=10, **{**TIGHT, **options})
    assert solution.status == "success", solution.message
    return solution.samples


def times(expected: dict) -> list[float]:
    return [float(t) for t in expected]


def state(sample) -> np.ndarray:
    return np.concatenate([sample.q, sample.v])


TIGHTEST = [
    {"method": "dop853", "rtol": 1e-13, "atol": 1e-15},
    {"method": "taylor", "rtol": 1e-14, "atol": 1e-16},
    {"method": "radau13", "rtol": 1e-13, "atol": 1e-15},
]


@pytest.mark.parametrize("options", TIGHTEST, ids=lambda options: options["method"])
def test_car_axis(options):
    expected = numbers(load_reference("ivpts_car_axis")["reference_tf"]["recomputed"])
    (sample,) = run("car_axis", [3.0], **options)
    assert error(sample.q, expected[:4], floor=0.01) < 1e-12
    assert error(sample.v, expected[4:8], floor=0.01) < 1e-10
    assert error(sample.multipliers, expected[8:], floor=1e-3) < 1e-11


def test_car_axis_start_is_consistent():
    initial = load_reference("ivpts_car_axis")["ic"]
    (sample,) = run("car_axis", [1e-12])
    assert error(sample.acceleration, numbers(initial["a0"])) < 1e-8
    assert error(sample.multipliers, numbers(initial["lam0"])) < 1e-8


@pytest.mark.parametrize("options", TIGHTEST, ids=lambda options: options["method"])
def test_andrews_squeezer(options):
    expected = numbers(load_reference("ivpts_andrews")["reference_tf"]["recomputed"])
    later = load_reference("iftomm_a03_andrews")["reference"]
    first, second = run("andrews_squeezer", [0.03, float(later["t"])], **options)
    assert error(first.q, expected[:7], floor=0.01) < 1e-12
    assert error(first.v, expected[7:14]) < 1e-10
    assert error(first.acceleration, expected[14:21], floor=1e4) < 1e-10
    assert error(first.multipliers, expected[21:]) < 1e-11
    assert error(state(second), numbers(later["q_qt"])) < 1e-8


def test_andrews_squeezer_starts_as_published():
    initial = load_reference("ivpts_andrews")["ic"]
    (sample,) = run("andrews_squeezer", [1e-12])
    assert error(sample.q, numbers(initial["q0"])) < 1e-14
    assert error(sample.acceleration, numbers(initial["qtt0"])) < 1e-8
    assert error(sample.multipliers, numbers(initial["lam0"])) < 1e-8


@pytest.mark.parametrize("variant, factor, limit", [("fast", 1.0, 1e-8), ("slow", 0.01, 1e-9)])
def test_spinning_top(variant, factor, limit):
    expected = load_reference("heavy_top")["reference_w_then_quaternion"][variant]
    system = derived("spinning_top")
    rates = {entry["name"]: entry["value"] * factor for entry in system.rates}
    for sample, digits in zip(
        run("spinning_top", times(expected), rate=rates), expected.values(), strict=True
    ):
        poses = np.zeros(12 * len(system.bodies))
        system.kernel("poses")(sample.t, state(sample), system.parameter_values(), poses)
        assert np.max(np.abs(poses[3:12].reshape(3, 3) - rotation_matrix(numbers(digits[3:])))) < limit


def rotation_matrix(quaternion: np.ndarray) -> np.ndarray:
    """Body to world, of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_rolling_disc():
    expected = load_reference("rolling_disk")["reference_q_v"]
    for sample, digits in zip(run("rolling_disc", times(expected)), expected.values(), strict=True):
        assert error(state(sample), numbers(digits)) < 1e-9


def test_rolling_disc_does_not_sink():
    *_, last = run("rolling_disc", [10.0])
    assert last.q[2] == pytest.approx(math.cos(last.q[4]), abs=1e-10)


def test_chain_of_five():
    expected = load_reference("n_link_pendulum")["reference_th_then_rates"]
    for sample, digits in zip(run("n_pendulum", times(expected)), expected.values(), strict=True):
        assert error(state(sample), numbers(digits)) < 1e-8


def test_double_pendulum():
    expected = load_reference("double_pendulum")["reference_th_then_rates"]
    for sample, digits in zip(run("double_pendulum", times(expected)), expected.values(), strict=True):
        assert error(state(sample), numbers(digits)) < 1e-8


def test_double_pendulum_reference_is_what_scipy_finds():
    p = {"m1": 1.0, "m2": 1.0, "L1": 1.0, "L2": 1.0, "g": 9.81}

    def rhs(t, y):
        equations = MECHANISMS["double_pendulum"](y[:2], y[2:], p)
        return np.concatenate([y[2:], np.linalg.solve(equations.M, equations.f)])

    start = [math.pi / 2, math.pi / 2, 0.0, 0.0]
    expected = load_reference("double_pendulum")["reference_th_then_rates"]["2"]
    end = solve_ivp(rhs, (0.0, 2.0), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert error(end, numbers(expected)) < 1e-10


def test_rod_on_stiff_bushing():
    expected = load_reference("stiff_bushing_pendulum")["reference_q_v"]
    samples = run("stiff_bushing_pendulum", times(expected), method="radau5", rtol=1e-10, atol=1e-12)
    for sample, digits in zip(samples, expected.values(), strict=True):
        assert error(state(sample), numbers(digits)) < 1e-7


SPRING_STARTS = {
    "spring_osc_eps1e-1": (0.1, 0.9),
    "spring_osc_eps1e-3": (1e-3, 0.999),
    "spring_slow_eps1e-3": (1e-3, 1.0),
}


@pytest.mark.parametrize("variant", SPRING_STARTS)
def test_pendulum_on_stiff_spring(variant):
    expected = load_reference("stiff_spring_pendulum")["reference_q_p"][variant]
    eps, x = SPRING_STARTS[variant]
    samples = run("stiff_spring_pendulum", times(expected), parameters={"eps": eps}, start={"x": x})
    for sample, digits in zip(samples, expected.values(), strict=True):
        assert error(state(sample), numbers(digits)) < 2e-8


def test_cartesian_pendulum():
    expected = load_reference("pendulum_dae")["reference"]
    samples = run("pendulum_dae", [float(entry["t"]) for entry in expected])
    for sample, entry, limit in zip(samples, expected, (1e-11, 1e-10, 1e-9), strict=True):
        assert error(state(sample), numbers([entry[key] for key in ("x", "y", "xt", "yt")])) < limit
        assert error(sample.multipliers, numbers([entry["lam"]])) < 10 * limit


def test_cartesian_pendulum_of_the_multibody_benchmark_library():
    expected = load_reference("iftomm_a01_simple_pendulum")["reference"]
    at = [float(entry["t"]) for entry in expected]
    for sample, entry in zip(
        run("pendulum_dae", at, parameters={"g": 9.81}, start={"x": -1.0}), expected, strict=True
    ):
        assert error(sample.q, numbers([entry["x"], entry["y"]])) < 1e-10
        if "xt" in entry:
            assert error(sample.v, numbers([entry["xt"], entry["yt"]])) < 1e-10
            # The file's tension_lam contradicts its own state from the 8th digit on; released at y = 0 it is -3*g*y.
            assert error(sample.multipliers, -3 * 9.81 * numbers([entry["y"]])) < 1e-10


def test_pendulum_period_is_that_of_the_elliptic_integral():
    theta, L, g = 0.2, 0.5, 9.81
    period = float(4 * mpmath.sqrt(L / mpmath.mpf(g)) * mpmath.ellipk(mpmath.sin(mpmath.mpf(theta) / 2) ** 2))
    (sample,) = run("pendulum", [5 * period])
    assert error(state(sample), np.array([theta, 0.0])) < 1e-10


def small_oscillations(name: str, **options) -> np.ndarray:
    """Squared frequencies [1/s^2] about hanging at rest, from the mass matrix and the residual's Jacobian."""
    system = derive(load(find(name), options))
    n = system.nv
    p, rest = system.parameter_values(), np.zeros(3 * n)
    mass, slopes = np.zeros(n * n), np.zeros(3 * n * n)
    system.kernel("mass_matrix")(0.0, rest[: 2 * n], p, mass)
    system.kernel("residual_jacobian")(0.0, rest, p, slopes)
    by_state = slopes.reshape(n, 3 * n)
    np.testing.assert_allclose(by_state[:, 2 * n :], mass.reshape(n, n), atol=1e-14)
    return eigh(by_state[:, :n], mass.reshape(n, n), eigvals_only=True)


def test_small_oscillations():
    reference = load_reference("small_oscillations")["reference"]
    g = 9.81
    for name in ("pendulum", "pendulum_linear"):
        assert small_oscillations(name) == pytest.approx([float(reference["point_pendulum_L0p5"])], rel=1e-14)
    assert small_oscillations("double_pendulum") == pytest.approx(
        numbers(reference["double_pendulum_L1"]), rel=1e-13
    )
    for n in (3, 5):
        expected = g * numbers(reference[f"laguerre_{n}"])
        assert small_oscillations("n_pendulum", N=str(n)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("step, rate", [(0.01, -0.03924), (0.02, -0.07848)])
def test_one_explicit_euler_step_of_the_linear_pendulum(step, rate):
    """The course's hand calculation: from (0.2 rad, 0), omega^2 = 19.62 1/s^2."""
    (sample,) = run("pendulum_linear", [step], method="euler", step=step)
    assert sample.q == pytest.approx([0.2], abs=1e-16)
    assert sample.v == pytest.approx([rate], rel=1e-13)
