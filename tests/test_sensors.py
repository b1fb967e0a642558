"""Sensors against closed forms, other formulations of the same mechanism, and balances of momentum in NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from symgen import Model, sensor
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.toml_reader import read_text
from symgen.runtime.batches import evaluate
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs import Controller

G = 9.81


def pendulum(**options) -> Model:
    m = Model("p", gravity=(0, -G))
    m.body("rod", mass=1, inertia=0.1, com=(0.5, 0))
    m.joint("pin", "revolute", "rod", start=0.3, damping=0.1, **options)
    m.point("tip", "rod", (1, 0))
    return m


def test_sensors_of_a_pendulum_in_closed_form():
    m = pendulum(stiffness=2, rest=0.1)
    said = {
        "w": "rod.wz", "v": "velocity('tip', 'x')", "own": "velocity(tip, x, rod)", "alpha": 'acceleration("pin")',
        "turn": "angular_acceleration(rod, z)", "a": "tip.ax", "inward": "acceleration(tip, x, rod)",
        "fx": "reaction(pin, fx)", "fy": "reaction(pin, fy)", "tz": "reaction(pin, tz)", "power": "power(pin)",
        "along": "reaction(pin, fx, rod)", "d": "distance(tip, rod)", "angle": "angle(world, rod)", "x": "rod.x",
        "seen": "position(tip, x, rod)",
    }  # fmt: skip
    for name, text in said.items():
        m.output(name, text)
    run = m.derive().run(t_end=1)
    q, w, alpha = run["pin"], run["dot(pin)"], run.accelerations[:, 0]
    c, s = np.cos(q), np.sin(q)
    a = np.array([-0.5 * (c * w**2 + s * alpha), 0.5 * (c * alpha - s * w**2)])  # of the centre of mass
    force = a + np.array([[0], [G]])
    torque = -2 * (q - 0.1) - 0.1 * w
    expected = {
        "w": w, "v": -s * w, "own": 0 * q, "alpha": alpha, "turn": alpha, "a": 2 * a[0], "inward": -(w**2),
        "fx": force[0], "fy": force[1], "tz": torque, "power": torque * w, "along": c * force[0] + s * force[1],
        "d": 0 * q + 0.5, "angle": q, "x": 0.5 * c, "seen": 0 * q + 1,
    }  # fmt: skip
    for name, value in expected.items():
        assert run[name] == pytest.approx(value, abs=1e-12), name


def arm() -> Model:
    """An arm in space, on a moving platform, with a closed loop, a spring, loads and an input."""
    m = Model("arm", gravity=(0.3, -0.2, -G))
    m.input("u", default=1.5)
    m.body("base", mass=3, inertia=[0.2, 0.3, 0.25])
    m.body("upper", mass=2, com=(0.2, 0.01, 0.02), inertia=[0.02, 0.05, 0.06, 0.001, 0.002, -0.001])
    m.body("lower", mass=1, com=(0.15, 0, -0.03), inertia=[0.01, 0.03, 0.02])
    m.body("weld", mass=0.5, com=(0.02, 0.03, 0.04), inertia=[0.001, 0.002, 0.0015])
    m.joint("slide", "prismatic", "base", axis=(1, 0, 0), rate=0.4)
    m.joint(
        "hip", "universal", "upper", "base", {"xyz": (0.1, 0.2, 0.3), "rpy": (0.3, -0.2, 0.5)}, axis=(0, 0, 1),
        start=[0.4, -0.3], rate=[1.0, -0.5], stiffness=3,
    )  # fmt: skip
    m.joint("knee", "revolute", "lower", "upper", {"xyz": (0.4, 0, 0), "rpy": (0.1, 0.2, 0)}, axis=(0, 1, 0),
            start=0.7, rate=2.0, damping=0.05)  # fmt: skip
    m.joint("glue", "fixed", "weld", "lower", {"xyz": (0.3, 0, 0), "rpy": (0, 0.4, 0)})
    m.point("tip", "lower", (0.3, 0.02, 0))
    m.spring("rope", ["tip", (1.0, 0.3, 0.5)], stiffness=20, length=0.3, damping=1)
    m.load("push", point="tip", force=(1, "2*u", -0.5), frame="lower")
    m.force("knee", "u")
    return m


FRAMES = {"hip": "base", "knee": "upper", "glue": "lower", "slide": None}
PARTS = ("fx", "fy", "fz", "tx", "ty", "tz")


def test_forces_in_joints_balance_the_momentum_behind_them():
    """dp/dt and dL/dt of all bodies behind a joint, from poses by differences; and what else acts on these."""
    m = arm()
    for joint in FRAMES:
        for part in PARTS:
            m.output(f"{joint}_{part}", sensor("reaction", joint, part, "world"))
    m.output("tension", "rope_force")
    system = m.derive()
    p, y = system.parameter_values(), initial(system)
    nq, nv = system.nq, system.nv
    a = evaluate(system, "rhs", p, np.zeros(1), y[None])[0, nq : nq + nv]
    found = evaluate(system, "outputs", p, np.zeros(1), np.concatenate([y, a])[None])[0]
    names = [record["name"] for record in system.outputs]
    value = dict(zip(names, found))

    def poses(t):
        q = y[:nq] + t * y[nq:] + t**2 / 2 * a
        return evaluate(system, "poses", p, np.zeros(1), np.concatenate([q, y[nq:]])[None])[0].reshape(-1, 12)

    bodies = [record["name"] for record in system.bodies]
    data = {b.name: b for b in m.describe().bodies}
    here, h = poses(0), 2e-4

    def rate_of_momenta(k: int, about):
        x = [poses(s * h)[k] for s in (-2, -1, 0, 1, 2)]
        mass = float(data[bodies[k]].mass)
        xx = [float(e) for e in data[bodies[k]].inertia] + [0.0] * (6 - len(data[bodies[k]].inertia))
        tensor = np.array([[xx[0], xx[3], xx[4]], [xx[3], xx[1], xx[5]], [xx[4], xx[5], xx[2]]])
        centre = [row[:3] for row in x]
        turn = [row[3:].reshape(3, 3) for row in x]
        acceleration = (centre[3] - 2 * centre[2] + centre[1]) / h**2
        spins = [Rotation.from_matrix(turn[i + 1] @ turn[i - 1].T).as_rotvec() / (2 * h) for i in (1, 2, 3)]
        L = [turn[i] @ tensor @ turn[i].T @ spins[i - 1] for i in (1, 2, 3)]
        dp = mass * (acceleration - np.array([0.3, -0.2, -G]))
        return dp, (L[2] - L[0]) / (2 * h) + np.cross(centre[2] - about, dp)

    lower = here[bodies.index("lower")]
    R = lower[3:].reshape(3, 3)
    tip = lower[:3] + R @ (np.array([0.3, 0.02, 0]) - np.array([0.15, 0, -0.03]))
    along = np.array([1.0, 0.3, 0.5]) - tip
    applied = value["tension"] * along / np.linalg.norm(along) + R @ np.array([1, 3, -0.5])
    upper, base = here[bodies.index("upper")], here[bodies.index("base")]
    upper_origin = upper[:3] - upper[3:].reshape(3, 3) @ np.array([0.2, 0.01, 0.02])
    origins = {
        "slide": np.zeros(3),
        "hip": base[:3] + np.array([0.1, 0.2, 0.3]),
        "knee": upper_origin + upper[3:].reshape(3, 3) @ np.array([0.4, 0, 0]),
        "glue": lower[:3] + R @ (np.array([0.3, 0, 0]) - np.array([0.15, 0, -0.03])),
    }
    behind = {
        "slide": ("base", "upper", "lower", "weld"), "hip": ("upper", "lower", "weld"),
        "knee": ("lower", "weld"), "glue": ("weld",),
    }  # fmt: skip
    for joint, names in behind.items():
        about = origins[joint]
        force, torque = np.zeros(3), np.zeros(3)
        for name in names:
            dp, dL = rate_of_momenta(bodies.index(name), about)
            force, torque = force + dp, torque + dL
        if joint != "glue":
            force, torque = force - applied, torque - np.cross(tip - about, applied)
        assert [value[f"{joint}_{k}"] for k in PARTS] == pytest.approx([*force, *torque], abs=2e-5), joint


def initial(system) -> np.ndarray:
    return np.array([r["value"] for r in (*system.coordinates, *system.rates)])


def test_angular_velocities_in_space():
    """Of a tree and of a body placed by hand, in world axes, its own and those of another body."""
    m = arm()
    m.coordinate("a", start=0.3, rate=0.7)
    m.coordinate("b", start=-0.4, rate=1.1)
    m.body("gimbal", mass=1, com=("a", 0, 0), inertia=[1, 2, 3], rotation=[("z", "a*b"), ("x", "b")])
    for body in ("lower", "gimbal"):
        for axis in "xyz":
            m.output(f"{body}_{axis}", f"{body}.w{axis}")
            m.output(f"own_{body}_{axis}", f"angular_velocity({body}, {axis}, {body})")
            m.output(f"seen_{body}_{axis}", f"angular_velocity({body}, {axis}, upper)")
            m.output(f"change_{body}_{axis}", f"angular_acceleration({body}, {axis})")
    m.output("angle_x", "angle(lower, gimbal, x)")
    m.output("angle_y", "angle(lower, gimbal, y)")
    m.output("angle_z", "angle(lower, gimbal, z)")
    system = m.derive()
    p, y = system.parameter_values(), initial(system)
    nq, nv, h = system.nq, system.nv, 1e-4
    a = evaluate(system, "rhs", p, np.zeros(1), y[None])[0, nq : nq + nv]
    found = evaluate(system, "outputs", p, np.zeros(1), np.concatenate([y, a])[None])[0]
    value = dict(zip([record["name"] for record in system.outputs], found))
    bodies = [record["name"] for record in system.bodies]

    def turn(t, body):
        q = y[:nq] + t * y[nq:] + t**2 / 2 * a
        rows = evaluate(system, "poses", p, np.zeros(1), np.concatenate([q, y[nq:]])[None])[0].reshape(-1, 12)
        return rows[bodies.index(body), 3:].reshape(3, 3)

    for body in ("lower", "gimbal"):
        w = Rotation.from_matrix(turn(h, body) @ turn(-h, body).T).as_rotvec() / (2 * h)
        change = [
            Rotation.from_matrix(turn(t + h, body) @ turn(t - h, body).T).as_rotvec() / (2 * h)
            for t in (h, -h)
        ]
        assert [value[f"{body}_{k}"] for k in "xyz"] == pytest.approx(w, abs=1e-6)
        assert [value[f"own_{body}_{k}"] for k in "xyz"] == pytest.approx(turn(0, body).T @ w, abs=1e-6)
        assert [value[f"seen_{body}_{k}"] for k in "xyz"] == pytest.approx(turn(0, "upper").T @ w, abs=1e-6)
        alpha = (change[0] - change[1]) / (2 * h)
        assert [value[f"change_{body}_{k}"] for k in "xyz"] == pytest.approx(alpha, abs=1e-4)
    relative = Rotation.from_matrix(turn(0, "lower").T @ turn(0, "gimbal")).as_euler("XYZ")
    assert [value[f"angle_{k}"] for k in "xyz"] == pytest.approx(relative, abs=1e-12)


def four_bar() -> Model:
    m = Model("four_bar", gravity=(0, -G))
    for name, length in (("crank", 0.2), ("rod", 0.6), ("rocker", 0.4)):
        m.body(name, mass=1, inertia=0.02, com=(length / 2, 0))
    m.joint("a", "revolute", "crank", start=1.0, rate=3)
    m.joint("b", "revolute", "rod", "crank", {"xyz": (0.2, 0, 0)}, guess=-0.8)
    m.joint("d", "revolute", "rocker", origin={"xyz": (0.5, 0, 0)}, guess=1.5)
    m.point("c1", "rod", (0.6, 0))
    m.point("c2", "rocker", (0.4, 0))
    m.coincident("c", "c1", "c2")
    return m


def test_reactions_of_constraints_and_of_joints_are_those_of_a_chain_that_is_closed_elsewhere():
    one = four_bar()
    one.output("cx", "reaction(c_x)")
    one.output("c", "reaction('c')")
    one.output("bx", "reaction(b, fx, world)")
    one.output("by", "reaction(b, fy, world)")
    run = one.derive().run(t_end=1, rtol=1e-10, atol=1e-12)
    assert run["cx"] == pytest.approx(run["lambda(c_x)"], abs=1e-9)
    assert run["c"] == pytest.approx(np.hypot(run["lambda(c_x)"], run["lambda(c_y)"]), abs=1e-9)
    other = Model("other", gravity=(0, -G))  # cut at b instead
    for name, length in (("crank", 0.2), ("rod", 0.6), ("rocker", 0.4)):
        other.body(name, mass=1, inertia=0.02, com=(length / 2, 0))
    other.joint("a", "revolute", "crank", start=1.0, rate=3)
    other.joint("d", "revolute", "rocker", origin={"xyz": (0.5, 0, 0)}, guess=1.5)
    other.joint("c", "revolute", "rod", "rocker", {"xyz": (0.4, 0, 0)}, guess=-1.3)
    other.point("b1", "crank", (0.2, 0))
    other.point("b2", "rod", (-0.6, 0))
    other.coincident("b", "b2", "b1")
    text = other.to_toml().replace("com = [0.3, 0]", "com = [-0.3, 0]")  # its frame is at the other end
    check = derive(read_text(text)).run(t_end=1, rtol=1e-10, atol=1e-12)
    scale = np.abs(check["lambda(b_x)"]).max()
    assert run["bx"] == pytest.approx(check["lambda(b_x)"], abs=1e-6 * scale)
    assert run["by"] == pytest.approx(check["lambda(b_y)"], abs=1e-6 * scale)


def test_an_event_looks_at_a_reaction():
    """A bead that slides down a sphere of radius 1 leaves it where cos(theta) = 2/3."""
    m = Model("sphere", gravity=(0, -G))
    x, y = m.coordinate("x", start=0.0, rate=1e-4), m.coordinate("y", start=1.0)
    m.body("bead", mass=2, com=(x, y))
    m.constraint("surface", x**2 / 2 + y**2 / 2 - 0.5)
    m.definition("pressed", 'reaction("surface")')
    m.event("leaves", "pressed", "falling", "terminate")
    for method in ("dop853", "radau5", "taylor", "rk4"):
        options = {"step": 1e-3} if method == "rk4" else {}
        run = m.derive().run(t_end=10, method=method, **options)
        assert run.events, method
        assert run["y"][-1] == pytest.approx(2 / 3, abs=1e-6), method


def block() -> Model:
    m = Model("block", gravity=(0, -G))
    m.body("block", mass=2, com=("x", "y"))
    m.coordinate("x", unit="m", start=0.0, rate=1.0)
    m.coordinate("y", unit="m", start=0.2)
    m.stop("ground", "y")
    m.friction("sole", coordinate="x", coefficient=0.4, normal="ground")
    m.output("pressed", "reaction(ground)")
    m.output("rubs", "reaction(sole)")
    m.output("ay", "acceleration(y)")
    m.output("ax", "acceleration(block, x)")
    return m


def test_an_element_that_is_called_as_a_function_is():
    m = Model("m", gravity=(0, -G))
    y = m.coordinate("y", unit="m")
    m.body("b", mass=2, com=(0, y))
    m.stop("floor", y)
    m.output("pressed", "reaction(floor) + 0")
    assert m.derive().run(t_end=0.1)["pressed"][-1] == pytest.approx(2 * G)
    with pytest.raises(ModelError, match="'floor' is a function"):
        m.output("wrong", "floor + 1")


def test_reactions_of_stops_and_friction_follow_what_is_closed():
    run = block().derive().run(t_end=2)
    flying = run["y"] > 1e-9
    assert flying.any() and not flying.all()
    sliding = ~flying & (run["dot(x)"] > 1e-9)
    stuck = ~flying & ~sliding
    assert sliding.any() and stuck.any()
    assert run["pressed"] == pytest.approx(np.where(flying, 0, 2 * G), abs=1e-9)
    assert run["rubs"] == pytest.approx(np.where(sliding, -0.8 * G, 0), abs=1e-9)
    assert run["ay"] == pytest.approx(np.where(flying, -G, 0), abs=1e-9)
    assert run["ax"] == pytest.approx(np.where(sliding, -0.4 * G, 0), abs=1e-9)
    assert run["force(sole)"] == pytest.approx(run["rubs"], abs=1e-9)


def test_events_see_the_reactions_of_the_form_that_holds():
    """A block that stands is pushed harder and harder, and pressed down."""
    m = block()
    m.load("push", point=("x", "y"), force=("1.0*t", "-0.5*t"))
    m.event("half", "reaction(sole) + 0.5", "falling")
    m.event("pressed_down", "reaction(ground) - 0.3 - 19.62", "rising")
    run = m.derive().run(t_end=1.2, start={"y": 0.0}, rate={"x": 0.0}, rtol=1e-9)
    events = {e.name: e.t for e in run.events}
    assert events["half"] == pytest.approx(0.5, abs=1e-9)
    assert events["pressed_down"] == pytest.approx(0.6, abs=1e-9)


def test_forces_in_joints_of_a_model_with_stops_and_friction():
    """A hinge on a carriage that hits a buffer and rubs: the joint feels the stop's force and the friction's."""
    m = Model("carriage", gravity=(0, -G))
    m.body("sledge", mass=2, inertia=0.1)
    m.body("bob", mass=1, com=(0, -0.5), inertia=0.1)
    m.joint("rail", "prismatic", "sledge", axis=(1, 0), rate=1.0)
    m.joint("pin", "revolute", "bob", "sledge", start=0.2)
    m.friction("pad", coordinate="rail", force=1.5)
    m.stop("wall", "0.3 - rail")
    for name in ("fx", "fy"):
        m.output(name, f"reaction(rail, {name})")
    for axis in "xy":
        m.output(f"a_{axis}", f"acceleration(bob, {axis})")
    m.output("a_s", "acceleration(rail)")
    run = m.derive().run(t_end=1)
    assert {e.name for e in run.events} >= {"wall"}
    assert run["fx"] == pytest.approx(2 * run["a_s"] + run["a_x"], abs=1e-9)
    assert run["fy"] == pytest.approx(3 * G + run["a_y"], abs=1e-9)


def test_power_of_elements_is_what_the_energy_changes_by():
    m = Model("powers", gravity=(0, 0, -G))
    m.body("a", mass=2, inertia=[0.02, 0.03, 0.04])
    m.joint("j", "free", "a", rate=[0.3, 0, 0.1, 1, -0.4, 0.2])
    m.point("p", "a", (0.1, 0.1, 0))
    m.frame("mount", at=(0, 0.01, 0))
    m.bushing("rubber", ["mount", "a"], [100, 120, 90, 5, 4, 3], [1, 2, 3, 0.1, 0.2, 0.3])
    m.spring("s", ["p", (0.5, 0, 0.4)], stiffness=50, length=0.2, damping=2, preload=1)
    m.load("push", point="p", force=(1, 2, "3*t"), frame="a")
    m.load("twist", body="a", torque=(0.1, 0, 0.2), frame="a", reaction="world")
    for name in ("rubber", "s", "push", "twist"):
        m.output(name, f'power("{name}")')
    m.output("fall", f"-{2 * G}*a.vz")
    run = m.derive().run(t_end=0.5, rtol=1e-11, atol=1e-12, fps=8000)
    kinetic = evaluate(run.system, "energy", run.p, run.t, run.states)[:, 0]
    total = sum(run[name] for name in ("rubber", "s", "push", "twist", "fall"))
    work = np.concatenate([[0], np.cumsum((total[1:] + total[:-1]) / 2 * np.diff(run.t))])
    assert kinetic - kinetic[0] == pytest.approx(work, abs=2e-5 * np.abs(work).max())


def test_a_sampled_controller_reads_a_reaction():
    m = pendulum()
    m.input("u")
    m.force("pin", "u")
    m.output("fx", "reaction(pin, fx)")
    system = m.derive()
    seen = []
    act = Controller(lambda t, x: seen.append(x[0]) or 0.0, reads=["fx"], period=0.1)
    run = system.run(t_end=0.55, inputs={"u": act}, fps=100)
    assert seen == pytest.approx(np.interp([0.1 * k for k in range(len(seen))], run.t, run["fx"]), abs=2e-3)
    with pytest.raises(RuntimeModelError, match="give the controller a period"):
        system.run(t_end=0.5, inputs={"u": Controller(lambda t, x: 0.0 * x[0], reads=["fx"])})


def test_small_motions_of_accelerations_and_reactions():
    """C and D against differences of outputs at neighbouring states."""
    m = pendulum()
    m.input("u", default=0.2)
    m.force("pin", "u")
    m.output("fx", "reaction(pin, fx)")
    m.output("a", "acceleration(tip, y)")
    system = m.derive()
    linear = system.linearise(at="start", outputs=["fx", "a"])

    def outputs(q, v, u):
        run = system.run(t_end=1e-9, start={"pin": q}, rate={"pin": v}, parameters={"u": u})
        return np.array([run["fx"][0], run["a"][0]])

    h = 1e-5
    for k, (dq, dv, du) in enumerate(np.eye(3) * h):
        slope = (outputs(0.3 + dq, dv, 0.2 + du) - outputs(0.3 - dq, -dv, 0.2 - du)) / (2 * h)
        assert np.hstack([linear.C, linear.D])[:, k] == pytest.approx(slope, abs=1e-6)


def test_sensors_stand_in_forces_where_the_state_tells_them():
    """A thruster along a body's own velocity, and a drag by its angular velocity, against the same by hand."""
    m = pendulum()
    m.force("pin", "-0.2*rod.wz - 0.1*velocity(tip, y, rod)*distance(tip, rod)")
    by_hand = pendulum()
    by_hand.force("pin", "-0.2*dot(pin) - 0.1*dot(pin)*0.5")
    runs = [x.derive().run(t_end=2, rtol=1e-11, atol=1e-12) for x in (m, by_hand)]
    assert runs[0]["pin"] == pytest.approx(runs[1]["pin"], abs=1e-9)


def test_a_sensor_is_written_and_read_again():
    m = arm()
    m.output("f", sensor("reaction", "hip", "tx"))
    m.output("w", "lower.wx + angular_velocity('lower', 'x')")
    again = read_text(m.to_toml())
    assert again.to_toml() == m.to_toml()
    assert [e for _, e in again.describe().outputs] == [e for _, e in m.describe().outputs]


def test_units_of_sensors():
    m = Model("u")
    m.parameter("force", "1 N")
    m.coordinate("x", unit="m")
    m.body("b", mass="1 kg", com=("x", 0))
    m.output("wrong", "acceleration(x) + force")
    with pytest.raises(ModelError, match="units do not match"):
        m.describe()


@pytest.mark.parametrize(
    ("text", "where", "message"),
    [
        (
            "reaction(pin, fx)",
            "potential",
            "cannot depend on a reaction or an acceleration.*it would determine itself",
        ),
        ("acceleration(pin)", "potential", "it would determine itself"),
        ("reaction(pin)", "output", "components: fx, fy, tz"),
        ("reaction(pin, fz)", "output", "'fz' is not one of fx, fy, tz"),
        ("reaction(nothing)", "output", "no constraint, joint, stop or friction 'nothing'"),
        ("velocity(tip)", "output", "takes 2 to 3 names"),
        ("velocity(tip, u)", "output", "'u' is not one of x, y, z"),
        ("velocity(tap, x)", "output", "no point, frame or body 'tap'"),
        ("velocity(tip, x, tap)", "output", "no frame or body 'tap'"),
        ("velocity(2*x, y)", "output", "a sensor takes names"),
        ("velocity(tip + tip, x)", "output", "has no place among the names"),
        ("power(rod)", "output", "no spring, bushing, load or joint 'rod'"),
        ("acceleration(tip)", "output", "has an axis"),
        ("dot(acceleration(pin))", "output", "dot.*inside a dot"),
        ("dot(rod.wz)", "output", "dot.*inside a dot"),
        ("rod.wq", "output", "'rod.wq' is not declared"),
        ("sin('rod')", "output", "has no place in an expression"),
        ("distance(tip)", "output", "takes 2 arguments"),
    ],
)
def test_what_a_sensor_refuses(text, where, message):
    m = pendulum()
    with pytest.raises(ModelError, match=message):
        m.potential(text) if where == "potential" else m.output("o", text)
        m.describe()


def test_names_of_sensors_are_free_for_other_things():
    m = Model("free")
    m.coordinate("angle", start=0.1)
    m.parameter("distance", 2.0)
    m.body("b", mass=1, com=("distance*sin(angle)", 0))
    m.output("power", "distance*angle")
    assert m.derive().run(t_end=0.1)["power"][0] == pytest.approx(0.2)


def test_an_ensemble_keeps_reactions():
    m = four_bar()
    m.output("bx", "reaction(b, fx, world)")
    system = m.derive()
    kept = system.ensemble(0.2, rate={"a": np.array([2.0, 3.0, 4.0])}, frames=[0.1, 0.2], keep=["bx"])
    for k, rate in enumerate([2.0, 3.0, 4.0]):
        alone = system.run(t_end=0.2, rate={"a": rate}, t_eval=[0.1, 0.2])
        assert kept["bx"][k] == pytest.approx(alone["bx"][1:], rel=1e-6)
