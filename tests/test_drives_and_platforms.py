"""Bundled steering, belt drive, satellite with wheels and platform on bushings: against equations written again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from symgen import load
from symgen.model.library import find, run_function
from symgen.runtime.checks.health import health_of


def passed(run) -> bool:
    return all(entry.ok for entry in health_of(run))


class Steering:
    """Everything as a function of the pinion's angle: circles meet at the ends of the tie rods."""

    r, half, arm, toe, behind, end = 8e-3, 0.68, 0.16, np.deg2rad(18.0), 0.13, 0.35

    def __init__(self) -> None:
        tip = np.array([-self.half + self.arm * np.sin(self.toe), -self.arm * np.cos(self.toe)])
        self.rod = float(np.linalg.norm(tip - [-self.end, -self.behind]))

    def knuckles(self, pinion: float) -> tuple[float, float]:
        """Angles of the left and right one, by the law of cosines about the kingpins."""
        found = []
        for side in (-1.0, 1.0):
            joint = np.array([self.r * pinion + side * self.end - side * self.half, -self.behind])
            reach = np.hypot(*joint)
            inside = np.arccos((self.arm**2 + reach**2 - self.rod**2) / (2 * self.arm * reach))
            tip = np.arctan2(joint[1], joint[0]) + side * inside
            found.append((tip + np.pi / 2 + side * self.toe + np.pi) % (2 * np.pi) - np.pi)
        return found[0], found[1]


def test_the_rack_turns_the_wheels():
    run = load("rack_and_pinion").run(t_end=3.0, rtol=1e-9)
    s = Steering()
    assert run.parameters["rod"] == pytest.approx(s.rod, rel=1e-13)
    assert s.knuckles(0.0) == pytest.approx((0.0, 0.0), abs=1e-12)
    h = 1e-3

    def slopes(pinion):
        """First derivatives of the knuckles' angles, and the angles, by differences of high order."""
        at = [np.array(s.knuckles(pinion + k * h)) for k in (-2, -1, 1, 2)]
        return (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * h), np.array(s.knuckles(pinion))

    hands = lambda t: np.interp(t, [0, 0.5, 1.5, 2, 3, 3.5], [0, 4, 4, -4, -4, 0])  # noqa: E731

    def inertia(pinion):
        return 2e-4 + 2.5 * s.r**2 + 0.9 * (slopes(pinion)[0] ** 2).sum()

    def motion(t, y):
        wheel, pinion, vw, vp = y
        bar = 90 * (wheel - pinion) + 0.4 * (vw - vp)
        by_pinion, angles = slopes(pinion)
        slope = (inertia(pinion + h) - inertia(pinion - h)) / (2 * h)
        force = bar - 250 * by_pinion @ angles - (12 * by_pinion @ by_pinion + 150 * s.r**2) * vp
        return [vw, vp, (hands(t) - bar) / 0.04, (force - 0.5 * slope * vp**2) / inertia(pinion)]

    y = np.zeros(4)
    for a, b in ((0, 0.5), (0.5, 1.5), (1.5, 2.0), (2.0, 3.0)):
        y = solve_ivp(motion, (a, b), y, rtol=1e-9, atol=1e-11).y[:, -1]
    assert [run["wheel"][-1], run["pinion"][-1]] == pytest.approx(y[:2], rel=1e-6)
    assert [run["left"][-1], run["right"][-1]] == pytest.approx(s.knuckles(y[1]), abs=1e-6)
    assert run["felt"][-1] == pytest.approx(90 * (y[0] - y[1]) + 0.4 * (y[2] - y[3]), rel=1e-5)
    assert passed(run)


def test_the_belt_drives_fan_and_pump():
    run = load("belt_drive").run(rtol=1e-10)

    def motion(t, y):
        motor, fan, i, vm, vf = y
        pull = 25e3 * (0.04 * motor - 0.12 * fan) + 20 * (0.04 * vm - 0.12 * vf)
        ratio = 0.06 / 0.05
        torque = 0.12 * pull - 2.2e-3 * vf * abs(vf) - ratio * 0.6 * np.tanh(ratio * vf / 2)
        return [
            vm, vf, (48 - 0.5 * i - 0.15 * vm) / 4e-3,
            (0.15 * i - 0.04 * pull) / 2e-3, torque / (0.12 + ratio**2 * 0.01),
        ]  # fmt: skip

    y = solve_ivp(motion, (0, 3), np.zeros(5), method="LSODA", rtol=1e-11, atol=1e-12).y[:, -1]
    assert [run["dot(motor)"][-1], run["dot(fan)"][-1]] == pytest.approx(y[3:], rel=1e-7)
    assert run["current"][-1] == pytest.approx(y[2], rel=1e-6)
    pull = 25e3 * (0.04 * y[0] - 0.12 * y[1]) + 20 * (0.04 * y[3] - 0.12 * y[4])
    assert [run["tight"][-1], run["slack"][-1]] == pytest.approx([250 + pull / 2, 250 - pull / 2], rel=1e-5)
    # At a steady speed the second belt carries the pump's load.
    assert abs(run["second_belt"][-1]) * 0.05 == pytest.approx(0.6, rel=1e-3)
    assert not run.events
    assert passed(run)


def test_wheels_turn_the_satellite():
    """Euler's equations of a gyrostat, and the angular momentum, which stays in space."""
    system = load("satellite_wheels")
    run = system.run(rtol=1e-11)
    mass = system.kernel("mass_matrix")(
        0.0, np.r_[1.0, np.zeros(system.nq + system.nv - 1)], system.parameter_values()
    )
    J = 2.5e-3
    body = mass.reshape(6, 6)[:3, :3] - J * np.eye(3)  # without the wheels

    def motion(t, y):
        q, w, relative = y[:4], y[4:7], y[7:]
        sense = 1.0 if t < 30 else -1.0 if t < 60 else 0.0
        torque = np.array([-1e-3 if t < 6 else 0.0, 0.0, -8.3e-3 * sense])
        h = J * (relative + w)
        change = np.linalg.solve(body, -np.cross(w, body @ w + h) - torque)
        rate = 0.5 * np.array([
            -q[1:] @ w, q[0] * w[0] + q[2] * w[2] - q[3] * w[1], q[0] * w[1] - q[1] * w[2] + q[3] * w[0],
            q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
        ])  # fmt: skip
        return [*rate, *change, *(torque / J - change)]

    y = np.array([1.0, 0, 0, 0, 0, 0, 0, 0, 0, 120.0])
    for a, b in ((0, 6), (6, 30), (30, 60), (60, 90)):
        y = solve_ivp(lambda t, y, end=b: motion(min(t, end - 1e-9), y), (a, b), y, rtol=1e-11, atol=1e-13).y[
            :, -1
        ]
    assert run.states[-1][:4] == pytest.approx(y[:4], abs=1e-7)
    assert [run[f"attitude_w{c}"][-1] for c in "xyz"] == pytest.approx(y[4:7], abs=1e-9)
    assert run["turned"][-1] == pytest.approx(np.pi / 2, abs=0.02)
    spins = np.column_stack([run[f"dot({wheel})"] for wheel in ("roll", "pitch", "yaw")])
    w = np.column_stack([run[f"attitude_w{c}"] for c in "xyz"])
    own = w @ body.T + J * (spins + w)
    turned = Rotation.from_quat(np.column_stack([run[f"attitude_q{c}"] for c in "xyzw"]))
    assert turned.apply(own) == pytest.approx(np.tile([0, 0, J * 120], (len(run.t), 1)), abs=1e-9)
    assert passed(run)


class Platform:
    """The potential and the mass matrix of the platform, from places of its points by NumPy."""

    def __init__(self, legs: int) -> None:
        self.legs = legs
        self.places = [run_function(find("stewart_on_bushings"), "places", leg, legs) for leg in range(legs)]
        self.mass = np.pi * 0.35**2 * 0.012 * 2700
        self.tensor = self.mass * np.diag([(3 * 0.35**2 + 0.012**2) / 12] * 2 + [0.35**2 / 2])

    def bodies(self, y):
        """Frames and centres: plate by a rotation vector y[:3] and place y[3:6], legs by two angles and a slide."""
        plate = Rotation.from_rotvec(y[:3])
        found = [(self.mass, self.tensor, y[3:6], plate)]
        stretched = []
        for k, (foot, head) in enumerate(self.places):
            reach = np.subtract(head, foot)
            lean = Rotation.from_euler(
                "ZY", [np.arctan2(reach[1], reach[0]), np.arctan2(np.hypot(*reach[:2]), reach[2])]
            )
            a, b, slide = y[6 + 3 * k : 9 + 3 * k]
            turn = lean * Rotation.from_euler("XY", [a, b])
            tip = foot + turn.apply([0, 0, np.linalg.norm(reach) + slide])
            found.append((1.5, np.diag([0.032, 0.032, 0.001]), foot + turn.apply([0, 0, 0.25]), turn))
            found.append((0.6, np.diag([0.01, 0.01, 2e-4]), tip - turn.apply([0, 0, 0.22]), turn))
            socket = y[3:6] + plate.apply([head[0], head[1], 0])
            moved = turn.inv().apply(socket - tip)
            angles = (turn.inv() * plate * lean).as_euler("XYZ")
            wanted = 0.03 * np.sin(k * 2 * np.pi / self.legs)
            stretched.append((moved, angles, slide - wanted))
        return found, stretched

    def potential(self, y, k=8e4):
        bodies, stretched = self.bodies(y)
        weight = sum(9.81 * m * at[2] for m, _, at, _ in bodies)
        return weight + sum(2e5 * u @ u + 30 * e @ e + k / 2 * s**2 for u, e, s in stretched)

    def inertia(self, y, h=1e-6):
        matrix = np.zeros((len(y), len(y)))
        moved = [(self.bodies(y + step)[0], self.bodies(y - step)[0]) for step in np.diag(np.full(len(y), h))]
        for k, (m, tensor, _, turn) in enumerate(self.bodies(y)[0]):
            speeds = np.array([(a[k][2] - b[k][2]) / (2 * h) for a, b in moved])
            spins = np.array(
                [(turn.inv() * a[k][3]).as_rotvec() - (turn.inv() * b[k][3]).as_rotvec() for a, b in moved]
            )
            spins /= 2 * h
            matrix += m * speeds @ speeds.T + spins @ tensor @ spins.T
        return matrix


@pytest.mark.parametrize("legs", [3, pytest.param(6, marks=pytest.mark.slow)])
def test_the_platform_rests_and_rings_on_its_bushings(legs):
    """Its place where the potential is stationary, and the frequencies of small motions there."""
    system, own = load("stewart_on_bushings", legs=legs), Platform(legs)
    run = system.run(t_end=1e-3)
    names = [record["name"] for record in system.coordinates]
    q = dict(zip(names, run.q[0]))
    rotation = Rotation.from_quat([q[f"plate_q{c}"] for c in "xyzw"])
    y = [*rotation.as_rotvec(), *(q[f"plate_{c}"] for c in "xyz")]
    for k in range(legs):
        y += [q[f"foot{k}_1"], q[f"foot{k}_2"], q[f"slide{k}"]]
    y, n = np.array(y), len(y)
    h = 1e-4
    step = np.diag(np.full(n, h))
    hessian = np.array([
        [
            own.potential(y + a + b) - own.potential(y + a - b) - own.potential(y - a + b) + own.potential(y - a - b)
            for b in step
        ]
        for a in step
    ]) / (4 * h * h)  # fmt: skip
    gradient = np.array([own.potential(y + a) - own.potential(y - a) for a in step]) / (2 * h)
    assert np.abs(np.linalg.solve(hessian, gradient)).max() < 2e-6
    expected = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(own.inertia(y), hessian)).real))
    linear = system.linearise("start", parameters={"c": 0.0, "omega": 1e-12})
    stiffness = -linear.A[system.nv :, : system.nv]
    found = np.sqrt(np.sort(np.linalg.eigvals(stiffness).real))
    assert found == pytest.approx(expected, rel=2e-4)
    assert passed(system.run(t_end=0.3))
