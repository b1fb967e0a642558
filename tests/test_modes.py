"""Modes against published values: pendulums, the benchmark bicycle, a rotating hoop, a turning body."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from driven_models import C, K, M, oscillator
from references import load_reference, numbers

from symgen import Model, cos, sin, t
from symgen.link import derive
from symgen.model.library import find, load
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.linear import find_equilibrium


@functools.cache
def bundled(name: str, **options):
    return derive(load(find(name), {key: str(value) for key, value in options.items()}))


def squares(modes) -> np.ndarray:
    return np.array([mode.natural_frequency**2 for mode in modes])


def test_a_hanging_double_pendulum_swings_as_in_textbooks():
    modes = bundled("double_pendulum").modes(stable=True)
    expected = numbers(load_reference("small_oscillations")["reference"]["double_pendulum_L1"])
    np.testing.assert_allclose(squares(modes), expected, rtol=1e-13)
    np.testing.assert_allclose(modes[0].shape, [np.sqrt(0.5), 1.0], atol=1e-12)
    np.testing.assert_allclose(modes[1].shape, [-np.sqrt(0.5), 1.0], atol=1e-12)
    assert [mode.damping_ratio for mode in modes] == [0.0, 0.0]
    assert modes.stable is None and "first order" in modes.says


def test_near_upright_the_upright_equilibrium_is_found_and_said_to_be_unstable():
    modes = bundled("double_pendulum").modes(start={"theta1": 3.0, "theta2": 3.2})
    np.testing.assert_allclose(modes.model.q, np.pi, rtol=1e-14)
    growing = [mode.eigenvalue.real for mode in modes if mode.kind == "growth"]
    np.testing.assert_allclose(
        np.square(sorted(growing)), 9.81 * (2 + np.array([-1, 1]) * np.sqrt(2)), rtol=1e-12
    )
    assert modes.stable is False and "unstable" in modes.says


@pytest.mark.parametrize("n", [3, 5])
def test_a_chain_has_the_roots_of_a_laguerre_polynomial(n):
    modes = bundled("n_pendulum", N=n).modes()
    roots = numbers(load_reference("small_oscillations")["reference"][f"laguerre_{n}"])
    np.testing.assert_allclose(squares(modes), 9.81 * roots, rtol=1e-12)


@pytest.fixture(scope="module")
def bicycle():
    return bundled("bicycle"), load_reference("bicycle_linear")


def motion_at(system, speed: float):
    return system.linearise("start", rate={"x": speed})


@pytest.mark.parametrize("speed, key", [(4.0, "v4"), (4.6, "v4p6"), (5.0, "v5"), (10.0, "v10")])
def test_eigenvalues_of_the_bicycle_are_the_published_ones(bicycle, speed, key):
    system, reference = bicycle
    modes = motion_at(system, speed).modes()
    assert modes.model.kind == "steady motion"
    found = sorted((mode.eigenvalue for mode in modes if mode.kind != "free"), key=lambda x: x.real)
    expected = sorted((eigenvalue(text) for text in reference["reference"][key]), key=lambda x: x.real)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert sum(value == 0.0 for value in modes.eigenvalues) == 6


def eigenvalue(text: str) -> complex:
    real, _, imaginary = text.partition(" +- ")
    return complex(float(real), float(imaginary.rstrip("i") or 0.0))


def test_matrices_of_the_bicycle_are_the_published_ones(bicycle):
    """M q'' + v C₁ q' + (g K₀ + v² K₂) q = f for roll and steer, out of ten states."""
    system, reference = bicycle
    speed, g = 4.6, 9.81
    M, C1, K0, K2 = (np.array(reference["matrices"][key], dtype=float) for key in ("M", "C1", "K0", "K2"))
    linear = motion_at(system, speed)
    rates = [linear.states.index(f"dot({name})") for name in ("roll", "steer")]
    angles = [linear.states.index(name) for name in ("roll", "steer")]
    inverse = np.linalg.inv(M)
    scale = np.abs(inverse @ (g * K0)).max()
    np.testing.assert_allclose(
        linear.A[np.ix_(rates, angles)], -inverse @ (g * K0 + speed**2 * K2), rtol=0.0, atol=1e-12 * scale
    )
    np.testing.assert_allclose(
        linear.A[np.ix_(rates, rates)], -speed * inverse @ C1, rtol=0.0, atol=1e-12 * scale
    )
    np.testing.assert_allclose(linear.B[rates, 0], inverse[:, 1], rtol=1e-12)


def test_shapes_of_the_bicycle_are_those_of_the_published_matrices(bicycle):
    """(λ² M + λ v C₁ + g K₀ + v² K₂) of roll and steer is zero."""
    system, reference = bicycle
    speed, g = 4.6, 9.81
    M, C1, K0, K2 = (np.array(reference["matrices"][key], dtype=float) for key in ("M", "C1", "K0", "K2"))
    modes = motion_at(system, speed).modes()
    moving = [mode for mode in modes if mode.kind != "free"]
    assert len(moving) == 3
    for mode in moving:
        shape = mode.shape[[modes.model.motions.index(name) for name in ("roll", "steer")]]
        terms = [mode.eigenvalue**2 * M, mode.eigenvalue * speed * C1, g * K0, speed**2 * K2]
        largest = max(np.abs(term @ shape).max() for term in terms)
        left = modes.model.A @ mode.state - mode.eigenvalue * mode.state
        assert np.abs(left).max() < 1e-9 * np.abs(mode.state).max()
        assert np.abs(shape).min() > 1e-3
        np.testing.assert_allclose(sum(terms) @ shape, 0.0, atol=1e-9 * largest)


@pytest.mark.parametrize("key", ["weave_speed", "capsize_speed"])
def test_the_bicycle_changes_stability_at_the_published_speeds(bicycle, key):
    system, reference = bicycle
    linear = motion_at(system, float(reference["reference"][key]))
    lateral = [linear.states.index(name) for name in ("roll", "steer", "dot(roll)", "dot(steer)")]
    values = np.linalg.eigvals(linear.A[np.ix_(lateral, lateral)])
    margin = values[np.argmin(np.abs(values.real))]
    assert abs(margin.real) < 1e-12 * np.abs(values).max()
    assert (margin.imag != 0.0) == (key == "weave_speed")


def hoop():
    """A bead on a hoop that turns about its vertical diameter."""
    m = Model("hoop", gravity=(0, 0, "-9.81 m/s^2"))
    theta = m.coordinate("theta", unit="rad", guess=1.0)
    R, W = m.parameters(R="0.5 m", W="6 rad/s")
    m.body(
        "bead", mass="0.1 kg", com=(R * sin(theta) * cos(W * t), R * sin(theta) * sin(W * t), -R * cos(theta))
    )
    return derive(m)


def test_a_bead_on_a_turning_hoop_rests_where_weight_and_turning_balance():
    """cos θ = g / (R W²), and ω = W sin θ about it: Goldstein, Classical Mechanics, chapter 2."""
    system = hoop()
    modes = system.modes()
    theta = np.arccos(9.81 / (0.5 * 36.0))
    assert modes.model.q[0] == pytest.approx(theta, rel=1e-12)
    assert modes[0].natural_frequency == pytest.approx(6.0 * np.sin(theta), rel=1e-12)
    slow = system.modes(parameters={"W": 4.0}, start={"theta": 0.2})
    assert abs(slow.model.q[0]) < 1e-12
    assert slow[0].natural_frequency == pytest.approx(np.sqrt(9.81 / 0.5 - 16.0), rel=1e-12)


def test_turning_about_the_middle_axis_is_a_steady_motion_that_flips():
    system = bundled("free_rigid_body")
    axes = ("turn_wx", "turn_wy", "turn_wz")
    modes = system.modes("start", rate=dict(zip(axes, (0.0, 1.0, 0.0))))
    assert modes.model.kind == "steady motion"
    fastest = max(mode.eigenvalue.real for mode in modes)
    assert fastest == pytest.approx(np.sqrt((2 - 1) * (3 - 2) / (1 * 3)), rel=1e-12)
    assert modes.model.states[:3] == [f"turn({axis})" for axis in axes]
    about_largest = system.modes("start", rate=dict(zip(axes, (0.0, 0.0, 1.0))))
    assert about_largest.stable is not False


def test_damping_ratio_and_decay_of_an_oscillator():
    mode = oscillator().modes()[0]
    natural, ratio = np.sqrt(K / M), C / (2.0 * np.sqrt(K * M))
    assert mode.natural_frequency == pytest.approx(natural, rel=1e-13)
    assert mode.damping_ratio == pytest.approx(ratio, rel=1e-13)
    assert mode.frequency == pytest.approx(natural * np.sqrt(1.0 - ratio**2) / (2.0 * np.pi), rel=1e-13)
    assert mode.time_constant == pytest.approx(2.0 * M / C, rel=1e-13)


def test_frequency_response_of_an_oscillator_is_its_textbook_formula():
    linear, f = (
        oscillator().linearise(outputs=["x", "push", "dot(dot(x))"]),
        np.array([0.0, 0.1, 0.4775, 3.0]),
    )
    s = 2j * np.pi * f
    compliance = 1.0 / (M * s**2 + C * s + K)
    for output, expected in (
        ("x", compliance),
        ("push", 1.0 - K * compliance),
        ("dot(dot(x))", s**2 * compliance),
    ):
        found = linear.frequency_response("u", output, f)
        np.testing.assert_allclose(found.values, expected, rtol=1e-12, atol=1e-14)
    phase = linear.frequency_response("u", "x", f).phase
    np.testing.assert_allclose(phase, np.degrees(np.angle(compliance)), atol=1e-10)
    with pytest.raises(RuntimeModelError, match="has no output 'y'"):
        linear.frequency_response("u", "y", f)


def test_where_nothing_holds_there_is_no_equilibrium_and_the_coordinate_is_named():
    m = Model("stone", gravity=(0, "-9.81 m/s^2"))
    x, y = m.coordinate("x", unit="m"), m.coordinate("y", unit="m")
    m.body("stone", mass="2 kg", com=(x, y))
    with pytest.raises(RuntimeModelError, match=r"'y' is left with a force of -19\.62"):
        derive(m).modes()


def test_constraints_that_move_have_no_static_equilibrium():
    m = Model("driven", gravity=(0, "-9.81 m/s^2"))
    x, y = m.coordinate("x", unit="m"), m.coordinate("y", unit="m", guess=-1.0)
    m.body("bob", mass="1 kg", com=(x, y))
    speed, k = m.parameters(speed="0.1 m/s", k="50 N/m")
    m.potential(k * y**2 / 2)
    m.constraint("drive", x - speed * t)
    with pytest.raises(RuntimeModelError, match="'drive' moves with time"):
        system = derive(m)
        find_equilibrium(system, system.parameter_values(), np.array([0.0, -1.0]))


def test_an_equilibrium_carries_the_forces_of_its_constraints():
    system = bundled("pendulum_dae")
    linear = system.linearise()
    weight = system.kernel("forces")(0.0, np.concatenate([linear.q, linear.v]), linear.p)
    rows = system.kernel("constraint_jacobian")(0.0, np.concatenate([linear.q, linear.v]), linear.p)
    np.testing.assert_allclose(weight + rows.reshape(1, 2).T @ linear.multipliers, 0.0, atol=1e-14)
    assert len(linear.states) == 2 and linear.kind == "equilibrium"


def test_large_models_are_refused(monkeypatch):
    monkeypatch.setattr("symgen.runtime.size.LARGEST_DENSE", 1)
    with pytest.raises(RuntimeModelError, match="too many for linear analysis"):
        bundled("double_pendulum").modes("start")


@functools.cache
def top():
    """A top on a ball joint, whose axis is z; it may spin upright, asleep."""
    m = Model("top", gravity=(0, 0, "-9.81 m/s^2"))
    mass, h, across, along = m.parameters(mass="0.5 kg", h="0.1 m", across="1e-3 kg*m^2", along="8e-4 kg*m^2")
    m.joint("ball", "spherical", parent="world", child="top")
    m.body("top", mass=mass, com=(0, 0, h), inertia=[across, across, along])
    return derive(m)


def test_a_top_sleeps_above_the_speed_of_textbooks():
    """C² n² > 4 A m g h, A about the fixed point; seen from the body, precession is -n + (C n ± √…) / 2 A.

    Goldstein, Classical Mechanics, chapter 5; here with a quaternion, in axes that turn along.
    """
    inertia_about_axis, A, weight = 8e-4, 1e-3 + 0.5 * 0.1**2, 0.5 * 9.81 * 0.1
    least = np.sqrt(4.0 * A * weight) / inertia_about_axis
    for n in (0.8 * least, 1.5 * least):
        modes = top().modes("start", rate={"ball_wz": n})
        assert modes.model.kind == "steady motion"
        root = np.sqrt(complex(inertia_about_axis**2 * n**2 - 4.0 * A * weight))
        expected = [1j * ((inertia_about_axis * n + sign * root) / (2.0 * A) - n) for sign in (-1, 1)]
        expected = np.sort_complex([*expected, *np.conj(expected), 0.0, 0.0])
        np.testing.assert_allclose(np.sort_complex(modes.eigenvalues), expected, rtol=0.0, atol=1e-10 * n)
        assert modes.stable is (False if n < least else None)
