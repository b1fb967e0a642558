"""Bundled mechanisms of joints: balances, closed forms, reductions to one freedom, the same in other coordinates."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from symgen import Model
from symgen.link import derive
from symgen.model.library import find, load
from symgen.runtime.batches import evaluate

G = 9.81


def parameter(run, name: str) -> float:
    """A parameter's value in a run."""
    return run.p[[entry["name"] for entry in run.system.parameters].index(name)]


@functools.cache
def derived(name: str, **options):
    return derive(load(find(name), {key: str(value) for key, value in options.items()}))


def test_arm_loses_what_its_joints_rub_away():
    system = derived("seven_dof_arm")
    run = system.run(t_end=2.0, method="dop853", rtol=1e-10, atol=1e-12, fps=240)
    friction = parameter(run, "c") * np.sum(run.v**2, axis=1)
    lost = CubicSpline(run.t, friction).antiderivative()(run.t)
    energies = evaluate(system, "energy", run.p, run.t, run.states).sum(axis=1)
    assert lost[-1] > 10.0
    np.testing.assert_allclose(energies[0] - energies, lost, rtol=0, atol=1e-6 * lost[-1])


def test_arm_moves_alike_with_all_methods():
    explicit, implicit = (
        derived("seven_dof_arm").run(t_end=2.0, method=name, rtol=1e-10, atol=1e-12, **step)
        for name, step in (("dop853", {}), ("gauss6", {"step": 5e-3}))
    )
    np.testing.assert_allclose(implicit.q[-1], explicit.q[-1], rtol=0, atol=1e-8)


def test_diver_falls_and_turns_as_nothing_pushes_him():
    """Momentum from the mass matrix: the base is free, so that its rows are the whole body's."""
    system = derived("humanoid_tree")
    run = system.run(method="dop853", t_end=1.0, rtol=1e-10, atol=1e-12, fps=20)
    M = evaluate(system, "mass_matrix", run.p, run.t, run.states).reshape(-1, system.nv, system.nv)
    momentum = np.einsum("tij,tj->ti", M, run.v)[:, :6]
    mass = M[0, 0, 0]
    com = _centres_of_mass(system, run)
    fall = momentum[0, :3] / mass * run.t[:, None] + np.array([0, 0, -G / 2]) * run.t[:, None] ** 2
    np.testing.assert_allclose(com - com[0], fall, rtol=0, atol=1e-8)
    poses = evaluate(system, "poses", run.p, run.t, run.states).reshape(len(run.t), -1, 12)
    base = poses[:, [body["name"] for body in system.bodies].index("pelvis"), 3:].reshape(-1, 3, 3)
    about_base = np.einsum("tij,tj->ti", base, momentum[:, 3:])
    spin = about_base - np.cross(com - run.q[:, :3], momentum[:, :3])
    assert np.linalg.norm(spin[0]) > 10.0
    np.testing.assert_allclose(spin, np.tile(spin[0], (len(spin), 1)), rtol=0, atol=1e-7)


def _centres_of_mass(system, run):
    """Of all bodies together, from their poses and the description's masses."""
    poses = evaluate(system, "poses", run.p, run.t, run.states).reshape(len(run.t), -1, 12)
    masses = {body.name: float(body.mass) for body in load(find("humanoid_tree")).describe().bodies}
    weights = np.array([masses[body["name"]] for body in system.bodies])
    return np.einsum("b,tbx->tx", weights, poses[:, :, :3]) / weights.sum()


@pytest.fixture(scope="module")
def bricard():
    return derived("bricard").run(t_end=6.0, method="dop853", rtol=1e-11, atol=1e-12)


def test_bricard_has_one_freedom_that_counting_does_not_see(bricard):
    system = bricard.system
    assert any("hinge6_axis_2" in note and "redundant" in note for note in bricard.notes)
    jacobian = evaluate(system, "constraint_jacobian", bricard.p, bricard.t, bricard.states)
    for G_ in jacobian[5::40].reshape(-1, system.m, system.nv):
        assert np.linalg.matrix_rank(G_, tol=1e-9) == 4
    # Bricard's relation of neighbouring angles, here from the corners of the cube; every second one is the same.
    a, b = np.sin(bricard.q[:, :2].T)
    np.testing.assert_allclose(a + b + a * b, 0.0, atol=1e-9)
    np.testing.assert_allclose(bricard.q[:, 2:], bricard.q[:, [0, 1, 0]], atol=1e-9)


def test_bricard_moves_as_its_reduction_to_one_freedom(bricard):
    """Energy and inertia along Bricard's curve, by the energies of the open chain alone."""
    system, p = bricard.system, bricard.p

    def along(a):
        """All angles, and how they change with the first."""
        s, c = np.sin(a), np.cos(a)
        b = -np.arcsin(s / (1 + s))
        slope = -c / (1 + s) ** 2 / np.cos(b)
        return np.array([a, b, a, b, a]), np.array([1, slope, 1, slope, 1])

    def energies(a):
        """Twice T at a unit rate, and V."""
        q, direction = along(a)
        T, V = evaluate(system, "energy", p, np.zeros(1), np.concatenate([q, direction])[None])[0]
        return np.array([2 * T, V])

    def motion(t, y):
        step = 1e-5
        (inertia, _), (inertia_slope, force) = (
            energies(y[0]),
            (energies(y[0] + step) - energies(y[0] - step)) / (2 * step),
        )
        return [y[1], -(force + inertia_slope * y[1] ** 2 / 2) / inertia]

    start = [bricard.q[0, 0], bricard.v[0, 0]]
    expected = solve_ivp(motion, (0, 6), start, "DOP853", bricard.t, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(bricard.q[:, 0], expected.y[0], rtol=0, atol=1e-6)
    assert bricard.q[:, 0].max() > 3.1  # past the fold, and back
    assert bricard.energy.max_error < 1e-8


def test_bricard_is_as_accurate_as_its_tolerance(bricard):
    """Which constraints count as independent may not change between the stages of a step."""
    run = bricard.system.run(t_end=2.0, method="dop853", rtol=1e-8, atol=1e-10)
    finest = bricard.q[np.isclose(bricard.t, 2.0, atol=1e-9)][0]
    np.testing.assert_allclose(run.q[-1], finest, rtol=0, atol=1e-7)


def test_platform_comes_to_rest_where_its_springs_carry_it():
    system = derived("stewart_platform")
    run = system.run(t_end=10.0, method="radau5", rtol=1e-9, parameters={"amplitude": 0.0, "c": 3000.0})
    assert run.constraint_residual.max_position < 1e-13
    np.testing.assert_allclose(run.v[-1], 0.0, atol=1e-8)
    k = parameter(run, "k")
    height, feet = 0.7, np.hypot(*_leg_reach())
    middle = np.hypot(feet, height)

    def slope(z):
        """Of the potential energy by height: plate, springs, and six cylinders and rods that lean with the legs."""

        def potential(z):
            leg = np.hypot(feet, z)
            heights = 12 * z + 6 * (1.5 * 0.25 + 0.6 * (leg - 0.22)) * z / leg
            return G * heights + 6 * k * (leg - middle) ** 2 / 2

        return (potential(z + 1e-5) - potential(z - 1e-5)) / 2e-5

    rest = brentq(slope, 0.5, 0.7, xtol=1e-13)
    assert run["height"][-1] == pytest.approx(rest, abs=1e-8)
    plate = [run[f"base_{name}"][-1] for name in ("x", "y", "z", "qw", "qx", "qy", "qz")]
    np.testing.assert_allclose(plate, [0, 0, rest, 1, 0, 0, 0], atol=1e-8)


def _leg_reach():
    """Horizontal reach of a leg: feet 0.25 rad, heads 0.85 rad from the middle of their side of the triangle."""
    foot, head = (r * np.exp(1j * angle) for r, angle in ((0.6, 0.25), (0.35, 0.85)))
    return (head - foot).real, (head - foot).imag


def chain_of_joints(n: int) -> Model:
    """The chain of rods with an angle at each pin instead of absolute coordinates."""
    model = Model("chain", gravity=(0, -G))
    parent, origin, start = "world", (0, 0), 0.0
    for k in range(1, n + 1):
        model.body(f"rod{k}", mass=1.0, inertia=0.2**2 / 12, com=(0.1, 0))
        model.joint(f"j{k}", "revolute", f"rod{k}", parent, {"xyz": origin}, start=start)
        parent, origin = f"rod{k}", (0.2, 0)
    return model


def test_chain_in_absolute_coordinates_moves_as_with_relative_angles():
    absolute = derived("chain_absolute", N=5).run(t_end=1.0, method="dop853", rtol=1e-11, atol=1e-12)
    relative = derive(chain_of_joints(5)).run(t_end=1.0, method="dop853", rtol=1e-11, atol=1e-12)
    angles = absolute.q[:, 2::3] - np.pi / 2
    np.testing.assert_allclose(np.cumsum(relative.q, axis=1), angles, rtol=0, atol=1e-6)
    assert absolute.constraint_residual.max_position < 1e-13


def test_pendulums_of_a_field_swing_as_elliptic_functions_say():
    run = derived("pendulum_field", n=7).run(t_end=5.0, method="dop853", rtol=1e-11, atol=1e-12)
    m = np.sin(0.15) ** 2
    for k in range(7):
        omega = np.sqrt(G / parameter(run, f"l{k + 1}"))
        sn, _, dn, _ = ellipj(ellipk(m) - omega * run.t, m)
        np.testing.assert_allclose(run[f"theta{k + 1}"], 2 * np.arctan2(np.sqrt(m) * sn, dn), atol=1e-9)
