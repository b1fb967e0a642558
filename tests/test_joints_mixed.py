"""Trees of joints together with what is written by hand: other bodies, points, constraints, loads, energies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from derived import Generated
from trees import GRAVITY, random_body, random_tree

from symgen import Model
from symgen.derive.pipeline import derive
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.model import algebra


def close(actual, expected, tolerance=1e-11):
    expected = np.asarray(expected, dtype=float)
    scale = max(1.0, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(np.asarray(actual, dtype=float), expected, rtol=0, atol=tolerance * scale)


def loaded_tree() -> Model:
    """Points of a tree in a spring, a load and outputs; forces on angular velocities; a kinetic energy by hand."""
    model = random_tree(4, 3, ("spherical", "revolute", "free"), 1.0)
    model.parameters(k=30, c=0.4)
    model.input("push")
    model.point("tip", "b3", (0.1, -0.2, 0.3))
    model.point("hook", at=(1.0, 0.5, 0.2))
    model.axis("pointer", "b3", (0.0, 0.6, 0.8))
    model.potential("k*((tip_x - hook_x)**2 + (tip_y - hook_y)**2 + (tip_z - hook_z)**2)/2")
    model.load("wind", point=("tip_x", "tip_y", "tip_z"), force=("push", "c*tip_y", "c*sin(t)"))
    model.load("twist", body="b2", torque=("c", "push", "-c*tip_x"))
    rate = next(r.name for r in model.describe().rates if r.coordinate is None)
    model.force(rate, f"-c*{rate}")
    model.kinetic(f"(1 + j3**2)*(dot(tip_x)**2 + {rate}**2)/2")
    model.output("speed", "dot(tip_z) + pointer_x*tip_y")
    return model


def closed_loop() -> Model:
    """A spatial loop of a tree, closed at a point and with one direction; and a gear."""
    model = random_tree(7, 5, ("revolute", "spherical"), 1.0)
    model.point("end", "b6", (0.2, 0.1, -0.1))
    model.point("anchor", "b0", (0.3, 0.0, 0.4))
    model.axis("finger", "b5", (0, 0, 1))
    model.coincident("closed", "end", "anchor")
    model.constraint("level", "finger_z - 0.3*sin(t)")
    return model


def rolling() -> Model:
    """A ball on a plane: a free body with velocity constraints in its quaternion's rates."""
    model = Model("ball", gravity=GRAVITY)
    model.body("ball", mass=2.0, inertia=(0.1, 0.1, 0.1), com=(0, 0, 0.02))
    model.joint("j", "free", "ball")
    model.axis("ex", "ball", (1, 0, 0))
    model.axis("ey", "ball", (0, 1, 0))
    model.axis("ez", "ball", (0, 0, 1))
    spin_x, spin_y = (f"(ex_{c}*j_wx + ey_{c}*j_wy + ez_{c}*j_wz)" for c in "xy")
    model.constraint("height", "j_z - 0.3")
    model.velocity_constraint("slip_x", f"j_vx - 0.3*{spin_y}")
    model.velocity_constraint("slip_y", f"dot(j_y) + 0.3*{spin_x}")
    return model


def carried_tree(middle: str = "spherical") -> Model:
    """An arm on a body that is placed by hand and shaken, and a second body that a spring ties to the arm."""
    rng = np.random.default_rng(7)
    model = Model("carried", gravity=GRAVITY)
    model.coordinate("s")
    model.coordinate("phi")
    model.definition("hung", "tip_x + 0.2")
    model.body(
        "cart",
        mass=1.5,
        com=("s + 0.1*sin(t)", 0, "0.2*s**2"),
        inertia=(0.2, 0.3, 0.4),
        rotation=[("z", "phi"), ("x", "s")],
    )
    for k, kind in enumerate(("revolute", middle, "prismatic")):
        parent = f"b{k - 1}" if k else "cart"
        model.body(f"b{k}", **random_body(rng))
        placed = {"xyz": rng.normal(0, 0.4, 3).tolist(), "rpy": rng.uniform(-3, 3, 3).tolist()}
        model.joint(
            f"j{k}", kind, f"b{k}", parent, placed, **({} if kind == "spherical" else {"axis": (1, 2, -1)})
        )
    model.point("tip", "b2", (0, 0.1, 0.2))
    model.coordinate("z")
    model.body("lamp", mass=0.3, com=("s", 0, "z"))
    model.potential("(z - hung)**2")
    return model


BUILDERS = {f.__name__: f for f in (loaded_tree, closed_loop, rolling, carried_tree)}


@pytest.fixture(scope="module", params=BUILDERS)
def system(request):
    return Generated(BUILDERS[request.param]().describe())


def state(system: Generated, seed: int):
    rng = np.random.default_rng(seed)
    t, y = system.random_state(rng)
    return t, y, rng.uniform(-1, 1, system.n), rng.uniform(-1, 1, system.m)


def moving(system: Generated, t, y, a) -> np.ndarray:
    """Direction of (q, v) when the system moves with accelerations a."""
    return np.concatenate([system.N(t, y) @ y[system.nq :], a])


def test_residual_is_what_its_parts_say(system):
    t, y, a, lam = state(system, 1)
    G = system.G(t, y)
    gamma = system("gamma", t, y) if system.m else []
    expected = np.concatenate([system.mass(t, y) @ a - system("forces", t, y) - G.T @ lam, G @ a - gamma])
    close(system("residual", t, [*y, *a, *lam]), expected)


def test_residual_jacobian_is_the_derivative_of_the_residual(system):
    nq, n, m = system.nq, system.n, system.m
    t, y, a, lam = state(system, 2)
    z = np.array([*y, *a, *lam])
    J, N = system("residual_jacobian", t, z).reshape(n + m, -1), system.N(t, y)
    directions = np.zeros((len(z), 3 * n + m))
    directions[:nq, :n] = N
    directions[nq:, n:] = np.eye(2 * n + m)
    for direction in directions.T:
        close(J @ direction, system.slope("residual", t, z, direction), 1e-10)


def test_constraint_levels_are_derivatives_of_each_other(system):
    if not system.m:
        pytest.skip("no constraints")
    nh, n = system.nh, system.n
    t, y, a, _ = state(system, 3)
    motion = moving(system, t, y, a)
    slope = system.slope("constraint_residual", t, y, motion, 1.0)
    close(slope[:nh], system("constraint_residual", t, y)[nh : 2 * nh])
    close(slope[nh:], system.G(t, y) @ a - system("gamma", t, y))
    for k in range(n):
        rate = np.concatenate([np.zeros(system.nq), np.eye(n)[k]])
        close(system.G(t, y)[:, k], system.slope("constraint_residual", t, y, rate)[nh:])


def test_energy_changes_by_the_power(system):
    t, y, _, _ = state(system, 4)
    if system.m:
        q, v, nq, nh = y[: system.nq], y[system.nq :], system.nq, system.nh
        for _ in range(40):  # onto the constraints by the module's own step, which the residual judges
            out = system("project", t, [*q, *v])
            q, v = out[:nq], out[nq : nq + system.n]
        y = np.array([*q, *v])
        assert np.abs(system("constraint_residual", t, y)).max() < 1e-10
        for k in system.model["quaternions"]:
            assert np.linalg.norm(q[k : k + 4]) == pytest.approx(1.0, abs=1e-15)
        assert nh
    p = np.array(
        [*system.p[: len(system.p) - len(system.model["inputs"])], *[0.7] * len(system.model["inputs"])]
    )
    parts = system.split(t, y, p)
    close(parts.qdot, system.N(t, y) @ y[system.nq :])
    step = 1e-20
    direction = np.concatenate([parts.qdot, parts.a])
    energy = system("energy", complex(t, step), y + 1j * step * direction, p).imag / step
    assert energy.sum() == pytest.approx(parts.power, abs=1e-9 * max(1.0, np.abs(energy).max()))


def test_mass_matrix_is_the_second_derivative_of_the_kinetic_energy(system):
    t, y, _, _ = state(system, 5)
    n, nq = system.n, system.nq
    M = system.mass(t, y)
    close(M, M.T, 0.0)

    def T(v):
        return system("energy", t, [*y[:nq], *v])[0]

    basis = 0.5 * np.eye(n)
    for i in range(n):
        for j in range(i + 1):
            second = T(basis[i] + basis[j]) - T(basis[i]) - T(basis[j]) + T(np.zeros(n))
            assert 4 * second == pytest.approx(
                M[i, j] * (1 if i != j else 2) / (1 if i != j else 2), abs=1e-10
            )


def test_a_tree_on_a_shaken_body_moves_as_lagrange_says():
    """Joints without quaternions: d/dt(∂T/∂v) - ∂T/∂q + ∂V/∂q from the values of T and V alone."""
    model = carried_tree("universal")
    system = Generated(model.describe())
    t, y = system.random_state(np.random.default_rng(9))
    n, step = system.n, 1e-20
    q, v = y[:n], y[n:]

    def T(q, v, t):
        return system("energy", t, [*q, *v])[0]

    expected = np.zeros(n)
    for i, e in enumerate(np.eye(n)):
        # T is quadratic in v, so that central differences with any step are exact
        before, after = (T(q + 1j * step * v, v + s * e, complex(t, step)) for s in (-1, 1))
        momentum_rate = (after - before).imag / 2 / step
        by_q = system.slope("energy", t, y, [*e, *np.zeros(n)])
        expected[i] = momentum_rate - by_q[0] + by_q[1]
    close(system("forces", t, y), -expected, 1e-10)


def swinging(by_hand: bool) -> Model:
    """A pendulum of a rod and a bob on a cart."""
    model = Model("swinging", gravity=(0, -9.81, 0))
    model.parameters(l="0.7 m", m="0.4 kg")
    if by_hand:
        model.coordinate("x")
        model.coordinate("theta")
        model.body("cart", mass=2.0, com=("x", 0))
        model.body(
            "rod", mass="m", com=("x + l*sin(theta)/2", "-l*cos(theta)/2"), inertia="m*l**2/12", angle="theta"
        )
        model.body("bob", mass=0.3, com=("x + l*sin(theta)", "-l*cos(theta)"))
    else:
        model.body("cart", mass=2.0, inertia=0.1, com=(0, 0))
        model.joint("x", "prismatic", "cart", axis=(1, 0, 0))
        model.body("rod", mass="m", com=(0, "-l/2"), inertia="m*l**2/12")
        model.joint("theta", "revolute", "rod", "cart", axis=(0, 0, 1))
        model.body("bob", mass=0.3, inertia=0.0, com=(0, 0))
        model.joint("weld", "fixed", "bob", "rod", {"xyz": (0, "-l", 0)})
    return model


def planar(by_hand: bool) -> Model:
    """An arm on a plate that moves in a vertical plane."""
    model = Model("plate", gravity=(0, -9.81, 0))
    if by_hand:
        for name in ("x", "y", "phi"):
            model.coordinate(name)
        model.body("plate", mass=2.0, com=("x", "y"), inertia=0.1, angle="phi")
    else:
        model.body("plate", mass=2.0, com=(0, 0), inertia=0.1)
        model.joint("p", "planar", "plate", axis=(0, 0, 1), coordinate=("x", "y", "phi"))
    model.body("arm", mass=0.5, com=(0.4, 0), inertia=0.02)
    model.joint("theta", "revolute", "arm", "plate", {"xyz": (0.1, 0.2, 0)}, axis=(0, 0, 1))
    return model


@pytest.mark.parametrize("build", [swinging, planar], ids=lambda f: f.__name__)
def test_joints_and_hand_give_the_same_equations(build):
    a, b = Generated(build(True).describe()), Generated(build(False).describe())
    assert [x["name"] for x in a.model["coordinates"]] == [x["name"] for x in b.model["coordinates"]]
    rng = np.random.default_rng(6)
    t, y = a.random_state(rng)
    for name in ("mass_matrix", "forces", "energy", "rhs"):
        close(a(name, t, y), b(name, t, y))
    z = [*y, *rng.uniform(-1, 1, a.n)]
    close(a("residual_jacobian", t, z), b("residual_jacobian", t, z))
    close(a("poses", t, y)[:12], b("poses", t, y)[:12])


def test_a_free_body_keeps_momentum_and_angular_momentum():
    rng = np.random.default_rng(8)
    body = random_body(rng)
    model = Model("tumbling")
    model.body("b", **body)
    model.joint("j", "free", "b")
    system = Generated(model.describe())
    t, y = system.random_state(rng)
    parts = system.split(t, y)
    xx, yy, zz, xy, xz, yz = body["inertia"]
    I, com, m = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), np.array(body["com"]), body["mass"]

    def momenta(y):
        x, (w, *u), v, omega = y[:3], y[3:7], y[7:10], y[10:]
        K = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        R = np.eye(3) + 2 * w * K + 2 * K @ K
        linear = m * (v + R @ np.cross(omega, com))
        return np.array([*linear, *(R @ I @ omega + np.cross(x + R @ com, linear))])

    h = 1e-20
    slope = momenta(y + 1j * h * np.concatenate([parts.qdot, parts.a])).imag / h
    assert np.abs(slope).max() < 1e-13 * np.abs(momenta(y)).max() * 10
    assert "project" in system
    stretched = np.array(y)
    stretched[3:7] *= 1.1
    close(system("project", t, stretched), y)


def test_definitions_that_go_round_in_a_circle_are_an_error():
    model = Model("circle")
    model.coordinate("x")
    model.definition("far", "hook_x + 1")
    model.body("b", mass=1.0, com=("x", 0, 0))
    model.point("hook", "b", (0, 0, 1))
    description = model.describe()
    far = algebra.Symbol("far")
    round_about = replace(description, bodies=(replace(description.bodies[0], com=(far, far, far)),))
    with pytest.raises(ModelError, match="circle: far, b"):
        derive(round_about)


def test_rates_that_nothing_heavy_follows_are_named_with_the_model():
    """A point mass on a ball joint may spin about its arm as it likes."""
    model = Model("bob")
    model.body("ball", mass=1.0, com=(0.5, 0, 0))
    model.joint("k", "spherical", "ball")
    with pytest.raises(ModelError, match=r"model 'bob': the accelerations of k_wx are not determined"):
        derive_text(model)
