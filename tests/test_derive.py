"""Derived equations of motion against `LagrangesMethod` and against themselves."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from derived import Generated, describe
from lagrange import Reference
from mechanisms import CONSTRAINED, FREE

ALL = (*FREE, *CONSTRAINED)
RELATIVE = 1e-10


@pytest.fixture(scope="module")
def generated():
    made = {}

    def get(build) -> Generated:
        if build not in made:
            made[build] = Generated(build())
        return made[build]

    return get


def named(models):
    return pytest.mark.parametrize("build", models, ids=lambda f: f.__name__)


def close(actual, expected, tolerance=RELATIVE):
    expected = np.asarray(expected, dtype=float)
    scale = max(1.0, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(
        np.asarray(actual, dtype=float), expected, rtol=tolerance, atol=tolerance * scale
    )


@named(ALL)
def test_mass_forces_and_energy_are_those_of_lagranges_method(generated, build):
    system, reference = generated(build), Reference(build())
    rng = np.random.default_rng(1)
    for _ in range(2):
        t, y = system.random_state(rng)
        M, f = reference.equations(t, y)
        close(system.mass(t, y), M)
        close(system("forces", t, y), f)
        close(system("energy", t, y), reference.energy(t, y))


@named(ALL)
def test_mass_matrix_is_symmetric_and_positive(generated, build):
    system = generated(build)
    rng = np.random.default_rng(2)
    for _ in range(5):
        t, y = system.random_state(rng)
        M = system.mass(t, y)
        assert (M == M.T).all()
        moving = np.diag(M) != 0.0  # coordinates without inertia have no row
        assert (M[~moving] == 0.0).all()
        assert (np.linalg.eigvalsh(M[np.ix_(moving, moving)]) > 0.0).all()


@named(ALL)
def test_kinetic_energy_is_the_mass_matrix_form_where_nothing_is_prescribed(generated, build):
    system = generated(build)
    if build.__name__ in ("free_text", "relativistic", "driven_gyroscope", "moving_pivot"):
        pytest.skip("not a quadratic form in the rates")
    t, y = system.random_state(np.random.default_rng(3))
    v = y[system.n :]
    assert system("energy", t, y)[0] == pytest.approx(v @ system.mass(t, y) @ v / 2, rel=1e-12)


@named(FREE)
def test_accelerations_solve_the_equations(generated, build):
    system = generated(build)
    rng = np.random.default_rng(4)
    for _ in range(3):
        t, y = system.random_state(rng)
        parts = system.split(t, y)
        close(parts.qdot, y[system.n :], 0)
        close(parts.a, np.linalg.solve(system.mass(t, y), system("forces", t, y)), 1e-9)
        residual = system("residual", t, [*y, *parts.a])
        assert np.abs(residual).max() < 1e-10 * max(1.0, np.abs(system("forces", t, y)).max())


@named(ALL)
def test_residual_is_what_its_parts_say(generated, build):
    system = generated(build)
    n, m = system.n, system.m
    rng = np.random.default_rng(5)
    t, y = system.random_state(rng)
    a, lam = rng.uniform(-1, 1, n), rng.uniform(-1, 1, m)
    expected = system.mass(t, y) @ a - system("forces", t, y)
    if m:
        G = system.G(t, y)
        expected = np.concatenate([expected - G.T @ lam, G @ a - system("gamma", t, y)])
    close(system("residual", t, [*y, *a, *lam]), expected)


@named(ALL)
def test_residual_jacobian_is_the_derivative_of_the_residual(generated, build):
    system = generated(build)
    size = 3 * system.n + system.m
    rng = np.random.default_rng(6)
    t, z = 0.4, rng.uniform(-0.9, 0.9, size)
    J = system("residual_jacobian", t, z).reshape(-1, size)
    for k in range(size):
        close(J[:, k], system.slope("residual", t, z, np.eye(size)[k]))


@named([f for f in ALL if f.__name__ not in ("relativistic", "spring_pendulum", "free_text")])
def test_poses_are_rotations_at_the_centres_of_mass(generated, build):
    system, reference = generated(build), Reference(build())
    t, y = system.random_state(np.random.default_rng(7))
    for b, pose in zip(reference.d.bodies, system("poses", t, y).reshape(-1, 12), strict=True):
        R = pose[3:].reshape(3, 3)
        close(R @ R.T, np.eye(3), 1e-14)
        assert np.linalg.det(R) == pytest.approx(1.0)
        close(R, reference.number(reference.rotations[b.name], t, y))
        com = [*reference.of(b.com), *[sympy.Integer(0)] * (3 - len(b.com))]
        close(pose[:3], reference.number(com, t, y)[:, 0])


def spin_energy_from_poses(system: Generated, t, y, inertia) -> float:
    """Rotational energy with the angular velocity taken from the motion of the rotation matrix."""
    n = system.n
    direction = np.concatenate([y[n:], np.zeros(n)])
    R = system("poses", t, y)[3:].reshape(3, 3)
    W = R.T @ system.slope("poses", t, y, direction, 1.0)[3:].reshape(3, 3)
    close(W, -W.T, 1e-13)
    w = np.array([W[2, 1], W[0, 2], W[1, 0]])
    return w @ inertia @ w / 2


@pytest.mark.parametrize("axes", ["zxz", "xyz", "yxy", "zy", "x", "zxyz"])
def test_angular_velocity_is_that_of_the_rotation_matrix(axes):
    from symgen.model import algebra
    from symgen.model.description import Body
    from symgen.model.expressions import parse

    angles = [parse(f"q{k} + {k}*t/2 + q0*q{k}/3").expression for k in range(len(axes))]
    values = (0.3, 0.4, 0.5, 0.02, -0.03, 0.05)
    com = (algebra.ZERO,) * 3
    rotor = Body(
        "rotor",
        com,
        inertia=tuple(map(algebra.Float, values)),
        rotation=tuple(zip(axes, angles, strict=True)),
    )
    names = " ".join(f"q{k}" for k in range(max(len(axes), 1)))
    armature = " + ".join(f"dot({q})**2" for q in names.split())
    system = Generated(describe("rotor", names, bodies=(rotor,), kinetic=armature))
    t, y = system.random_state(np.random.default_rng(8))
    xx, yy, zz, xy, xz, yz = values
    expected = spin_energy_from_poses(system, t, y, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    rates = y[system.n :]
    assert system("energy", t, y)[0] - rates @ rates == pytest.approx(expected, rel=1e-12)


def test_observers_are_what_was_written():
    from derived import expr

    from symgen.model.description import Event, Reset

    d = describe(
        "observed",
        "x y",
        {"e": 0.6},
        kinetic="dot(x)**2 + dot(y)**2",
        outputs={"speed": "dot(x*y)", "clock": "2*t", "best": "minimum(x, y) + maximum(e, dot(x))"},
        events=(
            Event("stop", expr("x - 0.25"), "falling", "reset", (Reset("x", True, expr("-e*dot(x)")),)),
            Event(
                "swap",
                expr("y"),
                "both",
                "reset",
                (Reset("x", False, expr("y")), Reset("y", False, expr("x"))),
            ),
            Event("seen", expr("dot(y)")),
        ),
    )
    system = Generated(d)
    y = [0.1, 0.2, 0.3, 0.4]
    close(system("outputs", 0.7, y), [0.1 * 0.4 + 0.2 * 0.3, 1.4, 0.1 + 0.6])
    close(system("events", 0.7, y), [-0.15, 0.2, 0.4])
    close(system("reset_stop", 0.7, y), [0.1, 0.2, -0.18, 0.4])
    close(system("reset_swap", 0.7, y), [0.2, 0.1, 0.3, 0.4])
    assert "reset_seen" not in system
