"""Bundled models made of shapes, springs, bushings, fields and rolling: against Newton and Euler in NumPy, by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from symgen import load
from symgen.model.from_sympy import to_sympy
from symgen.model.library import find
from symgen.model.library import load as read


def properties(name: str, body: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and tensor of a body; tests/test_solids.py holds them against volume integrals."""
    d = read(find(name)).describe()
    values = {p.name: p.value for p in (*d.parameters, *d.constants)}
    b = next(b for b in d.bodies if b.name == body)
    mass, *centre = (float(to_sympy(x).subs(values)) for x in (b.mass, *b.com))
    xx, yy, zz, xy, xz, yz = ([float(to_sympy(x).subs(values)) for x in b.inertia] + [0.0] * 3)[:6]
    return mass, np.array(centre), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def turned(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(q[[1, 2, 3, 0]])


def quaternion_rate(q: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Of an angular velocity in the body's axes."""
    return 0.5 * np.array([
        -q[1] * w[0] - q[2] * w[1] - q[3] * w[2], q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
        q[0] * w[1] - q[1] * w[2] + q[3] * w[0], q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
    ])  # fmt: skip


def test_the_crane_swings_as_newton_says():
    run = load("crane").run(t_end=4.0, rtol=1e-10)
    m_t, m_l = 1000.0, 2304.0
    inertia = m_l * (3.0**2 + 0.4**2) / 12
    corners = np.array([[-1.5, 0.2], [1.5, 0.2]])

    def motion(t, s):
        (x, lx, ly, phi), (u, vx, vy, w) = s[:4], s[4:]
        c, n = np.cos(phi), np.sin(phi)
        force, torque, on_trolley = np.array([0.0, -9.81 * m_l]), 0.0, -300.0 * u
        on_trolley += 1000 * np.interp(t, [0, 1, 1.01, 3, 3.01, 6], [4, 4, -4, -4, 0, 0])
        hook = np.array([x, -0.25])
        for corner in corners:
            arm = np.array([[c, -n], [n, c]]) @ corner
            apart = hook - np.array([lx, ly]) - arm
            length = np.hypot(*apart)
            if length > 5.0:
                along = apart / length
                rate = along @ (np.array([u, 0]) - [vx, vy] - w * np.array([-arm[1], arm[0]]))
                pull = max(400e3 * (length - 5.0) + 2e3 * rate, 0.0) * along
                force, torque = force + pull, torque + arm[0] * pull[1] - arm[1] * pull[0]
                on_trolley -= pull[0]
        gap = 3.1 - (x + 1.0)
        if gap < 0.5:
            on_trolley += min(200e3 * (gap - 0.5) - 5e3 * u, 0.0)
        return [u, vx, vy, w, on_trolley / m_t, *(force / m_l), torque / inertia]

    start = [0, 0.2, -4.3, np.radians(5), 0, 0, 0, 0]
    found = solve_ivp(
        motion, (0, 4), start, method="DOP853", rtol=1e-9, atol=1e-10, max_step=2e-3, t_eval=run.t
    )
    names = ("travel", "load_x", "load_y", "load_angle")
    for k, name in enumerate(names):
        assert run[name] == pytest.approx(found.y[k], abs=2e-5)
    assert run["travel"].max() > 1.65  # it meets the stop
    assert (run["tension_left"] == 0).mean() > 0.1 and run["tension_left"].max() > 3e4


def test_the_satellite_turns_as_euler_says():
    run = load("satellite").run(t_end=6000.0, rtol=1e-11)
    mu = 3.986004e14
    mass, com, tensor = properties("satellite", "satellite")

    def motion(t, s):
        x, q, v, w = s[:3], s[3:7], s[7:10], s[10:]
        turn, r = turned(q), np.linalg.norm(x)
        u = turn.inv().apply(x / r)
        pull = -mu / r**2 * u
        pull -= 1.5 * mu / r**4 / mass * ((np.trace(tensor) - 5 * u @ tensor @ u) * u + 2 * tensor @ u)
        spin = np.linalg.solve(tensor, 3 * mu / r**3 * np.cross(u, tensor @ u) - np.cross(w, tensor @ w))
        return np.concatenate([v, quaternion_rate(q, w), turn.apply(pull), spin])

    def of_centre(q, v):
        turn = turned(q[3:7])
        return np.concatenate(
            [q[:3] + turn.apply(com), q[3:7], v[:3] + turn.apply(np.cross(v[3:], com)), v[3:]]
        )

    start = of_centre(run.q[0], run.v[0])
    found = solve_ivp(motion, (0, 6000), start, method="DOP853", rtol=1e-12, atol=1e-12)
    expected, end = found.y[:, -1], of_centre(run.q[-1], run.v[-1])
    assert end[:3] == pytest.approx(expected[:3], abs=0.1)
    assert end[3:7] == pytest.approx(expected[3:7], abs=1e-7)
    assert end[10:] == pytest.approx(expected[10:], abs=1e-10)
    assert 0.1 < run["lean"].max() < 0.5  # it swings, and is held


def test_the_engine_shakes_as_the_energy_of_its_mounts_says():
    run = load("engine_mounts").run(t_end=0.15, rtol=1e-10)
    mass, com, tensor = properties("engine_mounts", "engine")
    k, c = 150e3 * np.array([1, 1, 3]), 250 * np.array([1, 1, 3])
    stiffness, damping = np.array([*k, 60, 60, 60]), np.array([*c, 0.3, 0.3, 0.3])
    feet = [([0.1, 0.2, -0.1], np.pi / 6), ([0.1, -0.2, -0.1], -np.pi / 6), ([-0.7, 0, -0.1], 0.0)]
    speed = 900 * np.pi / 30

    def measured(x, turn):
        """Displacements and Cardan angles of the three mounts; x is the origin of the engine's frame."""
        result = []
        for at, lean in feet:
            mount = Rotation.from_rotvec([lean, 0, 0])
            result.append(mount.inv().apply(x + turn.apply(at) - at))
            result.append((mount.inv() * turn * mount).as_euler("XYZ"))
        return np.concatenate(result)

    def motion(t, s):
        x, q, v, w = s[:3], s[3:7] / np.linalg.norm(s[3:7]), s[7:10], s[10:]  # of the centre of mass
        turn, h = turned(q), 1e-6

        def moved(d):
            other = turn * Rotation.from_rotvec(d[3:])
            return measured(x + d[:3] - other.apply(com), other)

        columns = np.array([(moved(d) - moved(-d)) / (2 * h) for d in h * np.eye(6)])
        exerted = -columns @ (
            np.tile(stiffness, 3) * moved(np.zeros(6))
            + np.tile(damping, 3) * (columns.T @ np.concatenate([v, w]))
        )
        push = 0.015 * 0.04 * speed**2 * np.array([0, np.cos(speed * t), np.sin(speed * t)])
        force = exerted[:3] + turn.apply(push) + [0, 0, -9.81 * mass]
        torque = exerted[3:] + np.cross(np.array([0.25, 0, -0.05]) - com, push)
        spin = np.linalg.solve(tensor, torque - np.cross(w, tensor @ w))
        return np.concatenate([v, quaternion_rate(q, w), force / mass, spin])

    start = np.concatenate([com, [1, 0, 0, 0], np.zeros(6)])
    found = solve_ivp(motion, (0, 0.15), start, method="DOP853", rtol=1e-7, atol=1e-10)
    x = run.q[-1, :3] + turned(run.q[-1, 3:7]).apply(com)
    assert x == pytest.approx(found.y[:3, -1], abs=1e-8)
    assert run.q[-1, 3:7] == pytest.approx(found.y[3:7, -1], abs=1e-8)
    assert np.abs(x - com).max() > 5e-4


def test_the_ball_on_the_turntable_runs_in_circles():
    """At 2/7 of the table's rate, about where its starting velocity says (Earnshaw, Dynamics, 1844)."""
    run = load("turntable").run(rtol=1e-10)
    turn = 2 / 7 * 20 * np.pi / 30
    x, v = run.q[0, 1:3], np.array([run["float_vx"][0], run["float_vy"][0]])
    middle = x + np.array([-v[1], v[0]]) / turn
    away = x - middle
    angle = turn * run.t
    assert np.hypot(*v) > 0.1
    assert run["float_x"] == pytest.approx(
        middle[0] + away[0] * np.cos(angle) - away[1] * np.sin(angle), abs=1e-8
    )
    assert run["float_y"] == pytest.approx(
        middle[1] + away[0] * np.sin(angle) + away[1] * np.cos(angle), abs=1e-8
    )


def test_the_wheel_set_runs_in_cycloids():
    """A skate on a slope whose wheels' spin counts as mass: u' = -g' sin(w t) (Neimark & Fufaev, 1972)."""
    run = load("wheel_set").run(rtol=1e-11)
    alpha, t = np.radians(15), run.t
    axle, wheel = (properties("wheel_set", name)[0] for name in ("axle", "left"))
    g = 9.81 * np.sin(alpha) * (axle + 2 * wheel) / (axle + 3 * wheel)  # a disc's spin is half its mass
    w = -run["axle_wy"][0]
    assert w == pytest.approx(1.5, rel=1e-9)
    assert run["axle_wx"] ** 2 + run["axle_wy"] ** 2 == pytest.approx(np.full(len(t), w**2), rel=1e-9)
    assert run["axle_x"] == pytest.approx(
        g / w**2 * (w * t / 2 + np.sin(2 * w * t) / 4 - np.sin(w * t)), abs=1e-8
    )
    uphill = run["axle_y"] * np.cos(alpha) + run["axle_z"] * np.sin(alpha)
    assert uphill == pytest.approx(g / w**2 * (np.sin(w * t) ** 2 / 2 - 1 + np.cos(w * t)), abs=1e-8)
    assert all(check.ok for check in run.health), run.health
