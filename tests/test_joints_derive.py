"""Trees of joints: derived equations against Newton-Euler in NumPy, and against themselves."""

from __future__ import annotations

import numpy as np
import pytest
from derived import Generated
from newton_euler import NewtonEuler
from trees import ALL, SCALAR, humanoid, random_tree, seven_dof_arm

from symgen import Model

ARM, HUMANOID = "seven_dof_arm", "humanoid"
BUILDERS = {ARM: seven_dof_arm, HUMANOID: humanoid, "humanoid_fixed": lambda: humanoid(False)}
BUILDERS |= {f"revolute_{seed}": lambda seed=seed: random_tree(6, seed) for seed in range(2)}
BUILDERS |= {f"scalar_{seed}": lambda seed=seed: random_tree(7, seed, SCALAR) for seed in range(4)}
BUILDERS |= {f"any_{seed}": lambda seed=seed: random_tree(6, seed, ALL) for seed in range(12)}
BUILDERS |= {
    f"balls_{seed}": lambda seed=seed: random_tree(4, seed, ("spherical", "free"), 1.0) for seed in range(2)
}
SMALL = [name for name in BUILDERS if not name.startswith(HUMANOID)]


@pytest.fixture(scope="module")
def made():
    cache = {}

    def get(name):
        if name not in cache:
            description = BUILDERS[name]().describe()
            cache[name] = description, Generated(description)
        return cache[name]

    return get


def close(actual, expected, tolerance=1e-11):
    expected = np.asarray(expected, dtype=float)
    scale = max(1.0, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(np.asarray(actual, dtype=float), expected, rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize("name", BUILDERS)
def test_mass_forces_and_energy_are_those_of_newton_euler(made, name):
    description, system = made(name)
    rng = np.random.default_rng(1)
    for _ in range(2):
        t, y = system.random_state(rng, -2.0, 2.0)
        oracle = NewtonEuler(description, y)
        M, h = oracle.equations()
        close(system.mass(t, y), M)
        close(system("forces", t, y), -h)
        T, V = system("energy", t, y)
        close([T, V], oracle.energy())
        close(system.split(t, y).a, np.linalg.solve(M, -h), 1e-8)


@pytest.mark.parametrize("name", BUILDERS)
def test_residual_is_inverse_dynamics(made, name):
    _, system = made(name)
    rng = np.random.default_rng(2)
    t, y = system.random_state(rng)
    M, f = system.mass(t, y), system("forces", t, y)
    a = rng.uniform(-1, 1, system.n)
    close(system("residual", t, [*y, *a]), M @ a - f)


@pytest.mark.parametrize("name", SMALL)
def test_residual_jacobian_is_the_derivative_of_the_residual(made, name):
    _, system = made(name)
    nq, n = system.nq, system.n
    rng = np.random.default_rng(3)
    t, y = system.random_state(rng)
    z = np.array([*y, *rng.uniform(-1, 1, n)])
    J = system("residual_jacobian", t, z).reshape(n, nq + 2 * n)
    N = system.N(t, y)
    for k in range(n):
        direction = np.concatenate([N[:, k], np.zeros(2 * n)])
        close(J[:, :nq] @ N[:, k], system.slope("residual", t, z, direction), 1e-10)
    for k in range(nq, nq + 2 * n):
        close(J[:, k], system.slope("residual", t, z, np.eye(nq + 2 * n)[k]), 1e-10)


@pytest.mark.parametrize("name", [name for name in BUILDERS if name.startswith(("any", "balls", HUMANOID))])
def test_bodies_are_where_their_joints_put_them(made, name):
    description, system = made(name)
    t, y = system.random_state(np.random.default_rng(4))
    oracle = NewtonEuler(description, y)
    poses = system("poses", t, y).reshape(-1, 12)
    for pose, (_, _, at_com), body in zip(poses, oracle.bodies(), description.bodies, strict=True):
        close(pose[:3], at_com.p)
        close(pose[3:].reshape(3, 3), oracle.frames[body.name].R)


@pytest.mark.parametrize("name", [name for name in BUILDERS if name.startswith(("any", "balls"))])
def test_energy_stays(made, name):
    _, system = made(name)
    t, y = system.random_state(np.random.default_rng(5))
    parts = system.split(t, y)
    direction = np.concatenate([parts.qdot, parts.a])
    rate = system.slope("energy", t, y, direction)
    assert system.nw == 0
    assert rate.sum() == pytest.approx(0.0, abs=1e-10 * np.abs(rate).max())


def test_a_nut_on_a_screw_falls_as_its_inertia_lets_it():
    """m h² + J resists, m g h drives: a = -m g h/(J + m h²) by the angle, h the slide of a radian."""
    model = Model("nut", gravity=(0, 0, "-9.81 m/s^2"))
    pitch, m, J = model.parameters(pitch="20 mm", m="2 kg", J="1e-3 kg*m^2")
    model.body("nut", mass=m, com=(0, 0, 0), inertia=(J, J, J))
    model.joint("turn", "screw", "nut", axis=(0, 0, 1), pitch=pitch)
    solution = model.derive().run(t_end=0.5, method="dop853", rtol=1e-12)
    h = 0.02 / (2 * np.pi)
    expected = -2 * 9.81 * h / (1e-3 + 2 * h**2) * 0.5**2 / 2
    assert solution["turn"][-1] == pytest.approx(expected, rel=1e-12)
    slower = model.derive().run(t_end=0.5, method="radau5", rtol=1e-10, parameters={"pitch": -0.04})
    h = -0.04 / (2 * np.pi)
    assert slower["turn"][-1] == pytest.approx(-2 * 9.81 * h / (1e-3 + 2 * h**2) * 0.5**2 / 2, rel=1e-8)
