"""Springs, ropes, bushings, loads with an opposite, frames: against Newton and Euler written out in NumPy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PchipInterpolator, make_interp_spline
from scipy.spatial.transform import Rotation

from symgen import Model, cos, sin
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.toml_reader import read_text
from symgen.runtime.batches import evaluate

WAYS = {
    "rpy": ({"rpy": [0.3, -0.5, 1.1]}, Rotation.from_euler("xyz", [0.3, -0.5, 1.1])),
    "about z": ({"axis": [0, 0, -2], "angle": "a"}, Rotation.from_rotvec([0, 0, -0.4])),
    "about any": ({"axis": [1, 2, 3], "angle": 0.7}, Rotation.from_rotvec(0.7 * np.array([1, 2, 3]) / 14**0.5)),
    "quaternion": ({"quaternion": [0.5, -0.5, 0.5, 0.5]}, Rotation.from_quat([-0.5, 0.5, 0.5, 0.5])),
    "directions": ({"x": "p", "y": [0, 0, 1]}, Rotation.from_matrix([[0.6, 0, 0.8], [0.8, 0, -0.6], [0, 1, 0]])),
    "straight up": ({"x": [0, 0, -1], "y": [1, 0, 0]}, Rotation.from_matrix([[0, 1, 0], [0, 0, -1], [-1, 0, 0]])),
    "none": ({}, Rotation.identity()),
}  # fmt: skip


def at_state(system, function: str, y, **parameters: float) -> np.ndarray:
    """What a function writes in a state."""
    p = system.parameter_values(parameters)
    return evaluate(system, function, p, np.zeros(1), np.array([y], dtype=float))[0]


def rates(model: Model, y) -> np.ndarray:
    """What `rhs` writes in a state."""
    return at_state(model.derive(), "rhs", y)


def free_block(name="block", **more) -> Model:
    m = Model("free", gravity=(0, 0, "-9.81 m/s^2"))
    m.parameter("a", 0.4)
    m.body(name, mass="2 kg", inertia=[0.02, 0.03, 0.04], **more)
    m.joint("j", "free", name)
    return m


def accelerations(force, torque, w) -> np.ndarray:
    """Of the block: force in world axes at its centre, torque in its own."""
    inertia = np.diag([0.02, 0.03, 0.04])
    spin = np.linalg.solve(inertia, torque - np.cross(w, inertia @ w))
    return np.concatenate([np.asarray(force) / 2 - [0, 0, 9.81], spin])


STATE = np.array([0.02, -0.01, 0.03, 0.9, 0.1, -0.3, 0.3, 0.5, -0.4, 0.3, 1.0, -2.0, 0.7])  # x, q, v, w
STATE[3:7] /= np.linalg.norm(STATE[3:7])
X, V, W = STATE[:3], STATE[7:10], STATE[10:]
R = Rotation.from_quat(STATE[[4, 5, 6, 3]])


@pytest.mark.parametrize("way", WAYS)
def test_a_frame_turns_as_it_is_told(way):
    given, expected = WAYS[way]
    m = free_block()
    m.point("p", "block", at=[0.7, 0.8, 0])
    m.frame("f", "block", at=[0.1, 0, 0], **given)
    m.load("push", point="f", force=["5 N", "-2 N", "1 N"], frame="f")
    force = R.apply(expected.apply([5, -2, 1]))
    torque = np.cross([0.1, 0, 0], R.inv().apply(force))
    assert rates(m, STATE)[7:13] == pytest.approx(accelerations(force, torque, W), abs=1e-12)


def test_joints_stand_at_frames():
    given = {"xyz": [0.1, 0.2, 0.3], "rpy": [0.4, 0.5, 0.6]}
    found = []
    for origin in (given, "hip"):
        m = free_block()
        m.frame("hip", "block", at=given["xyz"], rpy=given["rpy"])
        m.body("leg", mass="1 kg", com=(0, 0, -0.2), inertia=[0.01, 0.01, 0.001])
        m.joint("knee", "revolute", "leg", "block" if origin is given else "world", origin, axis=(0, 1, 0))
        found.append(rates(m, [*STATE[:7], 0.3, *STATE[7:], 0.2]))
    assert found[0] == pytest.approx(found[1], abs=1e-13)


def test_a_spring_pulls_its_points_together():
    m = free_block()
    m.parameters(k="300 N/m", l="0.25 m", c="4 N*s/m")
    m.point("eye", "block", at=[0.1, -0.1, 0.05])
    length, force = m.spring(
        "strut", ["eye", ("0.3 m", 0, "0.5 m")], stiffness="k", length="l", damping="c", preload="7 N"
    )
    m.output("length", length)
    m.output("force", force)
    arm = R.apply([0.1, -0.1, 0.05])
    apart = np.array([0.3, 0, 0.5]) - X - arm
    speed = V + np.cross(R.apply(W), arm)
    along = apart / np.linalg.norm(apart)
    size = 300 * (np.linalg.norm(apart) - 0.25) - 4 * speed @ along + 7
    expected = accelerations(size * along, R.inv().apply(np.cross(arm, size * along)), W)
    assert rates(m, STATE)[7:13] == pytest.approx(expected, rel=1e-12)
    shown = at_state(m.derive(), "outputs", STATE)
    assert shown == pytest.approx([np.linalg.norm(apart), size], rel=1e-13)


def test_a_spring_without_length_has_no_singular_place():
    m = Model("bound")
    x, y = m.coordinate("x", start=0.0), m.coordinate("y", start=0.0)
    m.body("b", mass="2 kg", com=(x, y))
    m.spring("s", [(x, y), (0, 0)], stiffness="8 N/m", length=0)
    assert rates(m, [0.0, 0.0, 1.0, 0.0])[2:4].tolist() == [0.0, 0.0]
    run = m.derive().run(t_end=1.0, start={"x": 0.0, "y": 0.3}, rate={"x": 0.4}, rtol=1e-10)
    assert run["x"][-1] == pytest.approx(0.2 * np.sin(2.0), abs=1e-9)
    assert run["y"][-1] == pytest.approx(0.3 * np.cos(2.0), abs=1e-9)


def test_a_third_of_a_springs_mass_swings_and_half_of_it_weighs():
    m = Model("heavy", gravity=(0, "-9.81 m/s^2"))
    y = m.coordinate("y", unit="m", start=-0.5)
    m.body("b", mass="1 kg", com=(0, y))
    m.spring("s", [(0, y), (0, 0)], stiffness="100 N/m", length="0.4 m", mass="0.6 kg")
    sag = 9.81 * 1.3 / 100
    run = m.derive().run(t_end=2.0, rtol=1e-10)
    w = np.sqrt(100 / (1 + 0.6 / 3))
    assert run["y"] == pytest.approx(-0.4 - sag + (sag - 0.1) * np.cos(w * run.t), abs=1e-8)


def test_the_kinetic_energy_of_a_springs_mass_is_that_of_its_pieces():
    m = Model("thrown")
    x, y = m.coordinate("x"), m.coordinate("y")
    m.body("b", mass=0, com=(x, y))
    m.spring("s", [(x, y), (1, 2 * x)], mass="0.6 kg")
    v, u = np.array([0.3, -0.7]), np.array([0.0, 0.6])  # of the ends, as 2 x moves the second
    nodes, weights = np.polynomial.legendre.leggauss(5)
    share = (1 + nodes) / 2
    pieces = (1 - share)[:, None] * v + share[:, None] * u
    kinetic = 0.6 / 2 * (weights / 2) @ (pieces**2).sum(axis=1)
    found = at_state(m.derive(), "energy", [0.2, 0.3, *v])[0]
    assert found == pytest.approx(kinetic, rel=1e-14)


@pytest.mark.parametrize("method", ["dop853", "taylor"])
@pytest.mark.parametrize("acts, side", [("pull", 1.0), ("push", -1.0)])
def test_what_acts_one_way_lets_go(acts, side, method):
    """A mass on a damped rope above it, or on a buffer below: against SciPy, stopped where the rope goes slack."""
    k, c, l, m_, g = 400.0, 6.0, 0.5, 1.0, 9.81
    m = Model("bungee", gravity=(0, "-9.81 m/s^2"))
    y = m.coordinate("y", unit="m", start=0.0 if side > 0 else 1.5)
    m.body("b", mass="1 kg", com=(0, y))
    m.spring("s", [(0, y), (0, 0 if side > 0 else 1)], stiffness=k, damping=c, length=l, acts=acts)
    if side < 0:  # a buffer that stands on the floor at -1
        m = Model("buffer", gravity=(0, "-9.81 m/s^2"))
        y = m.coordinate("y", unit="m", start=0.5)
        m.body("b", mass="1 kg", com=(0, y))
        m.spring("s", [(0, y), (0, -1)], stiffness=k, damping=c, length=l, acts=acts)
    m.output("force", "s_force")
    end = 0.0 if side > 0 else -1.0

    def tension(y, v):
        """Upwards on the mass, without its sign."""
        stretch = abs(y - end) - l
        pull = k * stretch + c * (v if y > end else -v)
        return side * max(side * pull, 0.0) if side * stretch > 0 else 0.0

    def motion(t, s):
        return [s[1], -g - tension(*s) * (1 if s[0] > end else -1) / m_]

    run = m.derive().run(t_end=2.5, rtol=1e-10, method=method)
    assert run.ok, run.message
    reference = solve_ivp(
        motion, (0, 2.5), [run["y"][0], 0.0], rtol=1e-10, atol=1e-12, max_step=1e-3, t_eval=run.t
    )
    assert run["y"] == pytest.approx(reference.y[0], abs=2e-6)
    assert (side * run["force"] >= 0).all() and (run["force"] == 0).any() and (side * run["force"] > 1).any()
    assert all(check.ok for check in run.health), run.health


RUBBER = np.array([[-0.2, -0.05, 0.0, 0.1, 0.3], [-60.0, -8.0, 0.0, 12.0, 90.0]])


def rubber(kind: str) -> Callable[[float], float]:
    """Its force by SciPy, straight on beyond its ends."""
    x, f = RUBBER
    within = {"pchip": PchipInterpolator, "cubic": CubicSpline}.get(kind)
    within = within(x, f) if within else make_interp_spline(x, f, k=1)
    ends = {side: float(within(x[side], 1)) for side in (0, -1)}

    def force(s: float) -> float:
        side = 0 if s < x[0] else -1 if s > x[-1] else None
        return float(within(s)) if side is None else f[side] + ends[side] * (s - x[side])

    return force


@pytest.mark.parametrize(
    "kind, acts, method",
    [
        ("linear", "both", "dop853"), ("linear", "pull", "dop853"), ("pchip", "push", "dop853"),
        ("linear", "pull", "taylor"), ("pchip", "push", "taylor"), ("cubic", "both", "taylor"),
        ("pchip", "both", "radau5"),
    ],
)  # fmt: skip
def test_a_spring_with_a_curve(kind, acts, method):
    """A mass in the plane on rubber that stretches and squeezes, with damping: against SciPy in short steps."""
    m = Model("band", gravity=(0, "-9.81 m/s^2"))
    x, y = m.coordinate("x", unit="m", start=0.9, rate=0.3), m.coordinate("y", unit="m", start=0.1, rate=-0.4)
    table = m.table("rubber", columns=RUBBER.tolist(), kind=kind, outside="extend", units=["m", "N"])
    m.body("block", mass="1.2 kg", com=(x, y))
    m.spring("band", [(x, y), (0, 0.4)], curve=table, length="0.8 m", damping="0.7 N*s/m", acts=acts)
    m.output("pull", "band_force")
    curve = rubber(kind)

    def motion(_, u):
        apart = np.array([u[0], u[1] - 0.4])
        length = np.hypot(*apart)
        stretch = length - 0.8
        force = curve(stretch) + 0.7 * (apart @ u[2:]) / length
        force = {
            "both": force,
            "pull": max(force, 0.0) if stretch > 0 else 0.0,
            "push": min(force, 0.0) if stretch < 0 else 0.0,
        }[acts]
        return [*u[2:], *(-force * apart / length / 1.2 - [0, 9.81])]

    start = [0.1, 0.9, 0.3, -0.4] if acts == "push" else [0.9, 0.1, 0.3, -0.4]
    given = {"x": start[0], "y": start[1]}
    run = m.derive().run(t_end=1.5, rtol=1e-9, method=method, start=given)
    reference = solve_ivp(
        motion, (0, 1.5), start, method="DOP853", rtol=1e-10, atol=1e-12, max_step=1e-3, t_eval=run.t
    )
    assert run.ok and all(check.ok for check in run.health), run.health
    assert np.stack([run["x"], run["y"]]) == pytest.approx(reference.y[:2], abs=1e-6)
    assert np.ptp(run["pull"]) > 5


def test_a_curve_over_an_angle_and_its_file():
    """A coil with play against SciPy; what is written is what was read."""
    m = Model("wind", gravity=(0, "-9.81 m/s^2"))
    phi = m.coordinate("phi", unit="rad", start=0.3)
    m.table("stop", columns=[[-1, -0.2, 0.2, 1], [-9, 0, 0, 9]], outside="extend", units=["rad", "N*m"])
    m.body("bar", mass="1 kg", com=(0.3 * sin(phi), -0.3 * cos(phi)), inertia="0.02 kg*m^2", angle=phi)
    m.spring("coil", angle=phi, curve="stop")
    text = m.to_toml()
    assert 'curve = "stop"' in text and read_text(text).to_toml() == text
    run = m.derive().run(t_end=2, rtol=1e-10, method="dop853")

    def motion(_, u):
        torque = np.sign(u[0]) * max(abs(u[0]) - 0.2, 0.0) * 9 / 0.8
        return [u[1], (-0.3 * 9.81 * np.sin(u[0]) - torque) / 0.11]

    reference = solve_ivp(motion, (0, 2), [0.3, 0], method="DOP853", rtol=1e-11, atol=1e-12, max_step=1e-3)
    assert run["phi"][-1] == pytest.approx(reference.y[0, -1], abs=1e-8)


def test_a_spring_of_an_angle():
    m = Model("shaft")
    a, b = m.coordinate("a"), m.coordinate("b")
    for name, q in (("first", a), ("second", b)):
        m.body(name, inertia="0.5 kg*m^2", com=(0, 0), angle=q)
    m.spring("bar", angle=b - a, stiffness="20 N*m", damping="0.3 N*m*s", rest="0.1", preload="2 N*m")
    torque = 20 * (0.7 - 0.2 - 0.1) + 0.3 * (3.0 - 1.0) + 2
    assert rates(m, [0.2, 0.7, 1.0, 3.0])[2:4] == pytest.approx([torque / 0.5, -torque / 0.5], rel=1e-13)


def test_a_bushing_acts_on_the_gradient_of_its_energy():
    """Its energy from SciPy's rotations; force and torque are differences of it; angles are Cardan's."""
    k, c = np.array([1000, 2000, 3000, 10, 20, 30.0]), np.array([1, 2, 3, 0.1, 0.2, 0.3])
    m = free_block()
    m.frame("mount", at=(0, 0, 0.1), rpy=(0.1, 0.2, 0.3))
    m.frame("foot", "block", at=(0.02, 0.01, 0.08), rpy=(0.2, 0.1, -0.1))
    m.bushing("rubber", ["mount", "foot"], stiffness=list(k), damping=list(c))
    mount, foot = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]), Rotation.from_euler("xyz", [0.2, 0.1, -0.1])

    def measured(x, turn):
        apart = x + turn.apply([0.02, 0.01, 0.08]) - [0, 0, 0.1]
        return np.concatenate([mount.inv().apply(apart), (mount.inv() * turn * foot).as_euler("XYZ")])

    moves = [(h * np.eye(3)[i], np.zeros(3)) for i in range(3) for h in (1e-6,)]
    moves += [(np.zeros(3), 1e-6 * np.eye(3)[i]) for i in range(3)]
    by_rates = np.array([
        (measured(X + dx, R * Rotation.from_rotvec(dw)) - measured(X - dx, R * Rotation.from_rotvec(-dw))) / 2e-6
        for dx, dw in moves
    ])  # fmt: skip
    exerted = -by_rates @ (k * measured(X, R) + c * (by_rates.T @ np.concatenate([V, W])))
    assert rates(m, STATE)[7:13] == pytest.approx(accelerations(exerted[:3], exerted[3:], W), rel=1e-6)
    run = m.derive().run(t_end=0.5)
    assert all(check.ok for check in run.health)


def test_a_planar_bushing():
    m = Model("flat")
    q = [m.coordinate(name) for name in ("x", "y", "phi", "psi")]
    x, y, phi, psi = q
    m.body("arm", mass="1 kg", inertia="0.1 kg*m^2", com=(x, y), angle=phi)
    m.body("base", inertia="1 kg*m^2", com=(0, 0), angle=psi)
    m.bushing("b", ["base", "arm"], stiffness=["50 N/m", "80 N/m", "3 N*m"])
    at = np.array([0.3, 0.2, 0.9, 0.4])

    def energy(s):
        c, n = np.cos(s[3]), np.sin(s[3])
        u, w = c * s[0] + n * s[1], -n * s[0] + c * s[1]
        return 25 * u**2 + 40 * w**2 + 1.5 * (s[2] - s[3]) ** 2

    gradient = [(energy(at + d) - energy(at - d)) / 2e-6 for d in 1e-6 * np.eye(4)]
    found = rates(m, [*at, 0, 0, 0, 0])[4:8]
    assert found == pytest.approx(-np.array(gradient) / [1, 1, 0.1, 1], rel=1e-7)


@pytest.mark.parametrize("torque", [False, True])
def test_a_load_and_its_opposite_keep_the_momenta(torque):
    m = free_block()
    m.body("other", mass="3 kg", inertia=[0.05, 0.02, 0.03], com=(0.1, 0, 0.2))
    m.joint("k", "free", "other", start=[1, 0, 0, 1, 0, 0, 0])
    m.point("tip", "block", at=(0.2, 0.1, 0))
    if torque:
        m.load("drive", body="block", torque=["0.3 N*m", 0, "0.1 N*m"], frame="block", reaction="other")
    else:
        m.load("drive", point="tip", force=["3 N", "-1 N", "2 N"], frame="other", reaction="other")
    y = np.array([*STATE[:7], 1, 0.2, -0.1, 0.8, 0, 0.6, 0, *STATE[7:], 0.1, 0.2, -0.3, 0.5, -1.0, 0.4])
    system = m.derive()

    def momenta(y):
        """Linear and angular momentum about the origin; the second body's centre is off its joint's origin."""
        total, spin = np.zeros(3), np.zeros(3)
        for k, (mass, inertia, com) in enumerate(
            [(2, [0.02, 0.03, 0.04], np.zeros(3)), (3, [0.05, 0.02, 0.03], np.array([0.1, 0, 0.2]))]
        ):
            x, q = y[7 * k : 7 * k + 3], y[7 * k + 3 : 7 * k + 7]
            v, w = y[14 + 6 * k : 17 + 6 * k], y[17 + 6 * k : 20 + 6 * k]
            turn = Rotation.from_quat(q[[1, 2, 3, 0]])
            centre, speed = x + turn.apply(com), v + turn.apply(np.cross(w, com))
            total, spin = (
                total + mass * speed,
                spin + turn.apply(inertia * w) + mass * np.cross(centre, speed),
            )
        return np.concatenate([total, spin])

    slope = at_state(system, "rhs", y)[: len(y)]
    change = (momenta(y + 1e-6 * slope) - momenta(y - 1e-6 * slope)) / 2e-6
    weight = np.array([0, 0, -9.81])
    turn = Rotation.from_quat(y[[11, 12, 13, 10]])
    centres = 2 * y[:3] + 3 * (y[7:10] + turn.apply([0.1, 0, 0.2]))
    assert change == pytest.approx(np.concatenate([5 * weight, np.cross(centres, weight)]), abs=1e-6)
    without = free_block()
    without.derive()
    alone = rates(without, STATE)[7:13]
    assert np.abs(slope[14:20] - alone).max() > 0.5  # the load does act


def test_a_planar_load_and_its_opposite():
    m = Model("flat")
    x, y, phi, psi = (m.coordinate(name) for name in ("x", "y", "phi", "psi"))
    m.body("arm", mass="1 kg", inertia="0.1 kg*m^2", com=(x, y), angle=phi)
    m.body("wheel", inertia="1 kg*m^2", com=(0.3, 0.1), angle=psi)
    r = 1.0  # a bare number fits
    m.load(
        "push",
        point=(x + r * cos(phi), y + r * sin(phi)),
        force=("2 N", "1 N"),
        frame="arm",
        reaction="wheel",
    )
    at = np.array([0.3, 0.2, 0.9, 0.4])
    c, s = np.cos(0.9), np.sin(0.9)
    force = np.array([2 * c - s, 2 * s + c])
    arm = np.array([0.3 + c, 0.2 + s]) - [0.3, 0.1]
    expected = [*force, 1.0 / 0.1, -(arm[0] * force[1] - arm[1] * force[0])]
    assert rates(m, [*at, 0, 0, 0, 0])[4:8] == pytest.approx(expected, rel=1e-13)


CAR = """
[parameters]
k = "300 N/m"
l = "0.4 m"
[coordinates]
x = { unit = "m", start = 0.5 }
[bodies.car]
mass = "1 kg"
com = ["x", 0]
[points.hook]
body = "car"
[frames.wall]
at = [0, 0]
[springs.strut]
points = ["wall", "hook"]
stiffness = "k"
length = "l"
damping = "3 N*s/m"
[springs.rope]
points = ["hook", [1, 0]]
stiffness = 100
length = "0.6 m"
acts = "pull"
[loads.push]
point = "hook"
force = ["k*strut_length", 0]
[outputs]
pull = "strut_force"
"""


def test_files_round_trip():
    text = read_text(CAR).to_toml()
    assert read_text(text).to_toml() == text
    first, again = derive(read_text(CAR)), derive(read_text(text))
    rows = [at_state(s, "rhs", [0.3, 0.4]) for s in (first, again)]
    assert rows[0].tolist() == rows[1].tolist()
    assert rows[0][1] == pytest.approx(-300 * -0.1 - 1.2 + 100 * 0.1 + 300 * 0.3, rel=1e-12)


def test_springs_and_ropes_are_drawn():
    marks = derive(read_text(CAR)).source.header["marks"]
    assert {m["name"]: m["kind"] for m in marks if m["kind"] in ("spring", "link")} == {
        "strut": "spring",
        "rope": "link",
    }


@pytest.mark.parametrize(
    "old, new, place, words",
    [
        ('length = "l"', "", "springs.strut length", "is missing"),
        ('length = "l"', 'length = "k"', "springs.strut length", "units do not match"),
        ('length = "l"', 'length = "dot(x)"', "springs.strut length", "cannot depend on a rate"),
        ('stiffness = "k"', 'stiffness = "l"', "springs.strut stiffness", "units do not match"),
        ('stiffness = "k"', 'stiffness = "k*x"', "springs.strut stiffness", "cannot depend on a coordinate"),
        ('"wall", "hook"', '"wall", "hok"', "springs.strut points, element 2", "did you mean 'hook'"),
        ('"wall", "hook"', '"wall"', "springs.strut points", "2 components"),
        ('length = "l"', 'length = "l"\nangle = "x"', "springs.strut points", "give one of the two"),
        ('"pull"', '"pul"', "springs.rope acts", "did you mean 'pull'"),
        ('"pull"', '"pull"\npreload = 1', "springs.rope preload", "acts one way"),
        ("stiffness = 100", "damping = 1", "springs.rope acts", "needs a stiffness"),
        ("stiffness = 100", 'curve = "belt"', "springs.rope curve", "no table 'belt' of 1 argument"),
        ("stiffness = 100", 'stiffness = 100\ncurve = "belt"', "springs.rope curve", "not both"),
        ("stiffness = 100", "curve = 100", "springs.rope curve", "must be text"),
        ("[frames.wall]", "[frames.wall]\nrpy = [0, 0, 1]\nquaternion = [1, 0, 0, 0]", "frames.wall quaternion",
         "in one way"),
        ("[frames.wall]", "[frames.wall]\nangle = 1", "frames.wall angle", "needs 'axis'"),
        ("[frames.wall]", '[frames.wall]\nx = "hook"\ny = [0, 1]', "frames.wall x", "not of the world"),
        ("[frames.wall]", "[frames.wall]\nx = [1, 0]\ny = [2, 0]", "frames.wall y", "parallel"),
        ("[frames.wall]", "[frames.wall]\nquaternion = [1, 1, 0, 0]", "frames.wall quaternion", "length 1"),
        ("[frames.wall]", '[frames.wall]\naxis = [1, 1, 0]\nangle = "k"', "frames.wall angle", "constants declared"),
        ("[frames.wall]", '[frames.wall]\nbody = "van"', "frames.wall body", "no body 'van'"),
        ('"wall", "hook"]', '"wall", "hook"]\nrest = 1', "springs.strut rest", "called 'length'"),
        ('force = ["k*strut_length", 0]', 'force = ["1 N", 0]\nframe = "car2"', "loads.push frame", "no frame or body"),
        ('force = ["k*strut_length", 0]', 'force = ["1 N", 0]\nreaction = "wall"', "loads.push reaction",
         "no body 'wall'"),
        ('length = "0.6 m"', 'length = "-0.6 m"', "springs.rope length", "negative"),
        ("[outputs]", "[bushings.b]\n[outputs]", "bushings.b frames", "is missing"),
        ("[outputs]", '[bushings.b]\nframes = ["wall", "cart"]\nstiffness = [1, 2, 3]\n[outputs]',
         "bushings.b frames, element 2", "did you mean 'car'"),
        ("[outputs]", '[bushings.b]\nframes = ["wall", "car"]\nstiffness = [1, 2, 3, 4, 5, 6]\n[outputs]',
         "bushings.b stiffness", "three"),
        ("[outputs]", '[bushings.b]\nframes = ["wall", "world"]\nstiffness = [1, 2, 3]\n[outputs]',
         "bushings.b frames", "fixed in the world"),
        ("[outputs]", '[bushings.b]\nframes = ["wall", "car"]\nstiffness = ["1 N/m", 2, "3 N/m"]\n[outputs]',
         "bushings.b stiffness, element 3", "units do not match"),
        ("[outputs]", "[definitions]\nstrut_length = 1\n[outputs]", "springs.strut ", "which is taken"),
        ("[outputs]", "[springs.more]\n[outputs]", "springs.more points", "'points' or"),
    ],
)  # fmt: skip
def test_wrong_elements(old, new, place, words):
    assert old in CAR
    with pytest.raises(ModelError, match=words) as caught:
        read_text(CAR.replace(old, new), file="car.toml").describe()
    assert f"{caught.value.table} {caught.value.key or ''}" == place


@pytest.mark.parametrize(
    "table, words",
    [
        ('columns = [[0, 1], [0, 1]]\nunits = ["N", "N"]', "units do not match.*the table 'c' takes N"),
        ('columns = [[0, 1], [0, 1]]\nunits = ["m", "m"]', "units do not match.*and N .* is expected"),
        ("columns = [[-1, 1], [0, 1]]", "no point at 0"),
        ("columns = [[0, 1], [2, 3]]", "is 2 at 0"),
        ("columns = [[1, 2], [1, 2]]\noutside = 'hold'", "is 1 at 0"),
        ("columns = [[0, 1, 2], [0, 1, -1]]", "turns round: it is -1 at 2"),
        ("columns = [[0, 1, 2], [0, 2, 1]]\noutside = 'extend'", "turns round beyond its end"),
        ("columns = [[0, 1], [0, 1]]\nkind = 'cubic'", "is a spline"),
    ],
)
def test_curves_that_no_rope_has(table, words):
    text = CAR.replace("stiffness = 100", 'curve = "c"').replace(
        "[outputs]", f"[tables.c]\n{table}\n[outputs]"
    )
    with pytest.raises(ModelError, match=words) as caught:
        read_text(text).describe()
    assert (caught.value.table, caught.value.key) == ("springs.rope", "curve")


def test_joint_origins_that_are_no_frames():
    m = free_block()
    m.body("leg", mass=1)
    with pytest.raises(ModelError, match="there is no frame 'hip'; declare it"):
        m.joint("a", "revolute", "leg", origin="hip")
    m.frame("hip")
    with pytest.raises(ModelError, match="fixed in 'world', not in the parent 'block'"):
        m.joint("b", "revolute", "leg", "block", origin="hip")


def test_springs_may_stand_in_definitions_before_them():
    m = Model("named")
    x = m.coordinate("x", start=0.5)
    m.definition("power", "s_force*dot(s_length)")
    m.body("b", mass=1, com=(sin(x), 0))
    m.spring("s", [(sin(x), 0), (0, 0)], stiffness=3, length=0.1)
    m.output("p", "power")
    found = at_state(m.derive(), "outputs", [0.5, 2.0])
    assert found == pytest.approx([3 * (np.sin(0.5) - 0.1) * 2 * np.cos(0.5)], rel=1e-12)


@pytest.mark.parametrize("method", ["dop853", "radau5", "bdf", "bs32", "taylor", "rk4"])
def test_a_rope_with_damping_is_let_go(method):
    """Where it grows slack, its damping is a switch within a switch: it was crossed again and again at one instant."""
    from scipy.integrate import solve_ivp

    mass, k, c = 0.114, 420.3, 6.92
    m = Model("rope", gravity=(0, "-9.81 m/s^2"))
    y = m.coordinate("y", start=-0.77)
    m.body("weight", mass=mass, com=(0, y))
    m.spring("line", points=[(0, 0), (0, y)], stiffness=k, length=1.0, damping=c, acts="pull")

    def fall(t, s):
        pull = max(0.0, k * (-s[0] - 1.0) - c * s[1]) if s[0] < -1.0 else 0.0
        return s[1], -9.81 + pull / mass

    expected = solve_ivp(fall, (0.0, 2.0), (-0.77, 0.0), "DOP853", rtol=1e-12, atol=1e-13, max_step=1e-3).y[
        :, -1
    ]
    settings = {"step": 2e-4} if method == "rk4" else {"rtol": 1e-8}
    run = m.derive().run(t_end=2.0, method=method, **settings)
    assert run.status == "success"
    assert [run["y"][-1], run["dot(y)"][-1]] == pytest.approx(expected, abs=2e-5)


def test_a_body_hangs_on_turned_frames_as_newton_and_euler_say():
    """A bushing between two turned frames, a spring between points, a torque in a frame; by hand, as vectors."""
    at_world, at_body = np.array([0.05, 0.02, 0.1]), np.array([0.02, -0.03, 0.12])
    rpy_world, rpy_body = (0.3, -0.2, 0.5), (0.1, 0.4, -0.3)
    stiff, damp = np.array([900.0, 700, 1100, 20, 25, 15]), np.array([3.0, 2, 4, 0.1, 0.2, 0.15])
    m = Model("hung", gravity=(0, 0, "-9.81 m/s^2"))
    m.body("b", shape={"cylinder": [0.05, 0.3]}, density=2000.0)
    m.joint("f", "free", "b", start=[0.1, 0, 0, 1, 0, 0, 0], rate=[0, 0.2, 0, 0.3, -0.2, 0.5])
    m.frame("fw", body="world", at=at_world.tolist(), rpy=rpy_world)
    m.frame("fb", body="b", at=at_body.tolist(), rpy=rpy_body)
    m.bushing("mount", frames=["fw", "fb"], stiffness=stiff.tolist(), damping=damp.tolist())
    m.point("hook", "world", at=[0.5, 0.1, 0.2])
    m.point("eye", "b", at=[0, 0.05, -0.1])
    m.spring("spring", points=["hook", "eye"], stiffness=150, length=0.4, damping=2, preload=1.5)
    m.load("motor", body="b", torque=[0.1, 0.2, -0.3], frame="fb")
    run = m.derive().run(t_end=0.6, method="dop853", rtol=1e-11, atol=1e-13)

    mass = 2000 * np.pi * 0.05**2 * 0.3
    inertia = mass * np.array([(3 * 0.05**2 + 0.3**2) / 12] * 2 + [0.05**2 / 2])
    world, own = (Rotation.from_euler("xyz", rpy).as_matrix() for rpy in (rpy_world, rpy_body))

    def rates(_, y):
        place, turn, v, w = y[:3], y[3:7], y[7:10], y[10:]  # w in the body's axes
        body = Rotation.from_quat(turn).as_matrix()
        omega, frame = body @ w, body @ own
        relative = world.T @ frame
        angles = Rotation.from_matrix(relative).as_euler("XYZ")
        axes = np.column_stack(
            [[1, 0, 0], Rotation.from_euler("x", angles[0]).apply([0, 1, 0]), relative[:, 2]]
        )
        angle_rates = np.linalg.solve(axes, world.T @ omega)
        bound = np.linalg.solve(axes.T, -stiff[3:] * angles - damp[3:] * angle_rates)
        arm, hold = body @ at_body, body @ np.array([0, 0.05, -0.1])
        away = world.T @ (place + arm - at_world)
        mount = -world @ (stiff[:3] * away + damp[:3] * (world.T @ (v + np.cross(omega, arm))))
        line = place + hold - [0.5, 0.1, 0.2]
        length = np.linalg.norm(line)
        line /= length
        pull = -line * (150 * (length - 0.4) + 2 * line @ (v + np.cross(omega, hold)) + 1.5)
        torque = np.cross(arm, mount) + np.cross(hold, pull) + world @ bound + frame @ [0.1, 0.2, -0.3]
        x, y, z, s = turn
        turning = 0.5 * np.array([[s, -z, y], [z, s, -x], [-y, x, s], [-x, -y, -z]]) @ w
        force = np.array([0, 0, -9.81 * mass]) + mount + pull
        return [*v, *turning, *(force / mass), *((body.T @ torque - np.cross(w, inertia * w)) / inertia)]

    start = [0.1, 0, 0, 0, 0, 0, 1, 0, 0.2, 0, 0.3, -0.2, 0.5]
    end = solve_ivp(rates, (0, 0.6), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:7, -1]
    np.testing.assert_allclose(run.states[-1][:7], end[[0, 1, 2, 6, 3, 4, 5]], atol=1e-10)
    assert run.ok


def test_the_origin_of_the_world_is_a_place():
    """By its name, as of frames; in an assembly that of its own world, which the use has put somewhere."""
    text = """
    [assemblies.swing.coordinates]
    x = { unit = "m", start = 0.3 }
    [assemblies.swing.bodies.block]
    mass = "2 kg"
    com = ["x", "0.4"]
    [assemblies.swing.points.eye]
    body = "block"
    [assemblies.swing.springs.coil]
    points = [PLACE, "eye"]
    stiffness = "50 N/m"
    length = "0.4 m"
    [use.one]
    assembly = "swing"
    offset = [1, 2]
    [outputs]
    place = "one.block.x"
    """
    runs = [derive(read_text(text.replace("PLACE", x))).run(t_end=0.5) for x in ('"world"', "[0, 0]")]
    assert runs[0]["place"][0] == pytest.approx(1.3, rel=1e-15)
    np.testing.assert_array_equal(runs[0].states, runs[1].states)
    with pytest.raises(
        ModelError, match=r"\[assemblies.swing.springs.coil\] points.*there is no point 'wrld'"
    ):
        read_text(text.replace("PLACE", '"wrld"')).describe()
