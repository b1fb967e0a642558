"""The bundled models of assemblies against SciPy with their equations written a second time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

import symgen

R, L, BORE, GAP, M_PISTON, M_ROD, J_ROD = 0.04, 0.13, 0.09, 8.5e-3, 0.35, 0.5, 1e-3
P0, BOOST, LOAD, BANK, G = 1e5, 3.5, 0.012, np.pi / 6, 9.81
FLYWHEEL = 7850 * np.pi * 0.11**2 * 0.03 * 0.11**2 / 2
FIRES = np.deg2rad(120.0 * np.arange(6))
SIDES = np.array([1, -1, 1, -1, 1, -1]) * BANK  # by which a cylinder leans from the vertical


def crank(a):
    """Of a slider-crank: lean of the rod, height of the piston, and place of the rod's centre across and along."""
    lean = np.arcsin(R * np.sin(a) / L)
    return (
        lean,
        R * np.cos(a) + L * np.cos(lean),
        -2 / 3 * R * np.sin(a),
        R * np.cos(a) + L / 3 * np.cos(lean),
    )


def crank_rates(a):
    """Derivatives of these by the angle of the crank."""
    lean = np.arcsin(R * np.sin(a) / L)
    turn = R * np.cos(a) / (L * np.cos(lean))
    piston = -R * np.sin(a) - L * np.sin(lean) * turn
    return turn, piston, -2 / 3 * R * np.cos(a), -R * np.sin(a) - L / 3 * np.sin(lean) * turn


def inertia(theta):
    """The engine's moment of inertia at its crank: the function J(theta) of a mechanism of one freedom."""
    turn, piston, across, along = crank_rates(theta - FIRES)
    return FLYWHEEL + np.sum(M_PISTON * piston**2 + M_ROD * (across**2 + along**2) + J_ROD * turn**2)


def torque(theta, middle, speed):
    """At the crank; `middle` is an angle of the same strokes."""
    a = theta - FIRES
    _, piston, across, along = crank_rates(a)
    stroke = np.floor(((middle - FIRES) % (4 * np.pi)) / np.pi)
    squeeze = ((2 * R + GAP) / (R + L - crank(a)[1] + GAP)) ** 1.3
    pressure = P0 * np.select([stroke == 0, stroke < 3], [BOOST * squeeze, 1.0], squeeze)
    up = np.cos(SIDES)
    weight = M_PISTON * piston * up + M_ROD * (along * up - across * np.sin(SIDES))
    gas = (pressure - P0) * np.pi * BORE**2 / 4
    return -np.sum(gas * piston) - G * np.sum(weight) - LOAD * speed * abs(speed)


def engine(t_end: float) -> tuple[float, float]:
    """Angle and speed at a time, of dE/dtheta = torque from stroke to stroke, with E = J(theta) speed^2/2."""
    theta, t, energy = np.deg2rad(20), 0.0, inertia(np.deg2rad(20)) * 100**2 / 2
    while True:
        end = (np.floor(theta / (np.pi / 3) + 1e-9) + 1) * np.pi / 3
        middle = (theta + end) / 2

        def slope(x, y, middle=middle):
            speed = np.sqrt(2 * y[0] / inertia(x))
            return [torque(x, middle, speed), 1 / speed]

        def over(x, y):
            return y[1] - t_end

        over.terminal = True
        found = solve_ivp(slope, (theta, end), [energy, t], "DOP853", rtol=1e-12, atol=1e-12, events=over)
        if found.status == 1:
            theta, (energy, _) = found.t_events[0][0], found.y_events[0][0]
            return theta, np.sqrt(2 * energy / inertia(theta))
        theta, (energy, t) = end, found.y[:, -1]


def test_engine_is_that_of_one_freedom():
    system = symgen.load("engine_v6")
    run = system.run(t_end=0.2, rtol=1e-10, atol=1e-12)
    assert run.status == "success"
    theta, speed = engine(0.2)
    assert run["theta"][-1] == pytest.approx(theta, rel=1e-8)
    assert run["dot(theta)"][-1] == pytest.approx(speed, rel=1e-7)


def test_cylinders_of_the_engine_act_one_after_another():
    """Shifted by how far they fire apart, all of them do the same."""
    system = symgen.load("engine_v6")
    names = [f"c{k}.fire" for k in range(1, 7)]
    assert [x["name"] for x in system.parameters][-6:] == names
    late = system.run(t_end=0.05, parameters={x: 0.0 for x in names})
    assert late.status == "success"
    assert late["dot(theta)"].min() < system.run(t_end=0.05)["dot(theta)"].min()


M, J, A, B, W, RADIUS, J_WHEEL, J_ENGINE, RATIO = 1200, 1800, 1.2, 1.4, 0.75, 0.3, 1.2, 0.25, 4.1
SLIP = np.array([-5, -1, -0.4, -0.2, -0.1, -0.05, 0, 0.05, 0.1, 0.2, 0.4, 1, 5])
GRIP = PchipInterpolator(SLIP, [-0.7, -0.75, -0.88, -0.95, -0.9, -0.6, 0, 0.6, 0.9, 0.95, 0.88, 0.75, 0.7])
TURN = np.deg2rad(1)
WHEELS = [(A, W, 3170, TURN, 1), (A, -W, 3170, TURN, 1), (-B, W, 2716, 0, 1), (-B, -W, 2716, 0, 0.2)]


def car(t, y):
    """Newton and Euler of the car in its own axes, and the wheels; the differential has been eliminated."""
    psi, u, v, r, *spins = y[2:]
    force, moment, push = np.zeros(2), 0.0, []
    for (x, yw, load, steer, ground), spin in zip(WHEELS, spins, strict=True):
        vx, vy = u - r * yw, v + r * x
        along = np.cos(steer) * vx + np.sin(steer) * vy
        across = np.cos(steer) * vy - np.sin(steer) * vx
        sx, sy = (RADIUS * spin - along) / abs(along), -across / abs(along)
        slip = np.sqrt(sx**2 + sy**2 + 1e-6)
        fx, fy = ground * load * GRIP(slip) * np.array([sx, sy]) / slip
        push.append(fx)
        fx, fy = np.cos(steer) * fx - np.sin(steer) * fy, np.sin(steer) * fx + np.cos(steer) * fy
        force += [fx, fy]
        moment += x * fy - yw * fx
    drive = np.interp(t, [0, 0.5, 1], [0, 0, 80])
    share = J_ENGINE * RATIO**2 / 4
    rear = np.linalg.solve(
        np.array([[J_WHEEL + share, share], [share, J_WHEEL + share]]),
        RATIO / 2 * drive - RADIUS * np.array(push[2:]),
    )
    front = -RADIUS * np.array(push[:2]) / J_WHEEL
    return [
        np.cos(psi) * u - np.sin(psi) * v, np.sin(psi) * u + np.cos(psi) * v, r,
        force[0] / M + r * v, force[1] / M - r * u, moment / J, *front, *rear,
    ]  # fmt: skip


def test_car_with_a_differential_drives_as_newton_and_euler_say():
    system = symgen.load("differential_car")
    run = system.run(t_end=2.5, rtol=1e-10, atol=1e-12)
    assert run.status == "success"
    names = [f"{x}.spin" for x in ("front_left", "front_right", "rear_left", "rear_right")]
    spins = [run[f"dot({x})"][0] for x in names]
    assert run["dot(engine)"][0] == pytest.approx(RATIO * (spins[2] + spins[3]) / 2, rel=1e-12)
    y, t = np.array([0, 0, 0, 12.0, 0, 0, *spins]), 0.0
    for end in (0.5, 1.0, 2.5):  # where the torque has kinks
        y = solve_ivp(car, (t, end), y, "LSODA", rtol=1e-11, atol=1e-11).y[:, -1]
        t = end
    psi = y[2]
    u, v = y[3:5]
    expected = {"x": y[0], "y": y[1], "psi": psi}
    for name, value in expected.items():
        assert run[name][-1] == pytest.approx(value, rel=1e-7), name
    rates = {"x": np.cos(psi) * u - np.sin(psi) * v, "y": np.sin(psi) * u + np.cos(psi) * v, "psi": y[5]}
    for name, value in (rates | dict(zip(names, y[6:], strict=True))).items():
        assert run[f"dot({name})"][-1] == pytest.approx(value, rel=1e-7), name
    assert run["dot(rear_right.spin)"][-1] > 1.15 * run["dot(rear_left.spin)"][-1]  # it stands on ice
