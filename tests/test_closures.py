"""Joints that close loops against the same joints in trees; gears, racks, belts against equations by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from symgen import Model, dot
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.closure_types import CLOSURES
from symgen.model.joint_types import TYPES
from symgen.model.toml_reader import read_text
from symgen.runtime.batches import evaluate

INERTIA = [0.02, 0.03, 0.04, 0.002, -0.001, 0.003]
PLACE = {"xyz": (0.1, -0.2, 0.3), "rpy": (0.3, -0.5, 1.1)}
TOL = {"rtol": 1e-10, "atol": 1e-12}
AXES = {
    "revolute": {"axis": [1, 2, -1]},
    "continuous": {},
    "prismatic": {"axis": [0.3, -1, 0.5]},
    "screw": {"axis": [1, 0, 1], "pitch": "0.4 m"},
    "universal": {"axis": [0, 1, 0], "axis2": [1, 0, 0.2]},
    "cylindrical": {"axis": [0, 1, 1]},
    "planar": {"axis": [1, 1, 1]},
    "spherical": {},
    "fixed": {},
}


def body(m: Model) -> None:
    m.body("block", mass=2, com=(0.1, 0.05, -0.08), inertia=INERTIA)
    m.point("corner", "block", (0.3, 0.2, 0.1))
    m.spring("rope", ["corner", (0.5, 0.5, 0.9)], stiffness=30, length=0.2, damping=0.5)


def tree(kind: str, **more) -> Model:
    """The block on a joint, that moves."""
    m = Model("tree", gravity=(0.5, 0, -9.81))
    body(m)
    nv, given = TYPES[kind].nv, AXES[kind]
    start = {"start": [0.1 * (k + 1) for k in range(nv)]} if nv and not TYPES[kind].quaternion else {}
    rate = {"rate": [0.7 - 0.4 * k for k in range(nv)]} if nv else {}
    m.joint("j", kind, "block", origin=PLACE, **given, **start, **rate, **more)
    m.point("foot", "block", (0, 0, 0))
    for name in "xyz":
        m.output(f"v{name}", f"velocity(foot, {name})")
        m.output(f"w{name}", f"angular_velocity(block, {name}, block)")
    return m


def last_pose(run):
    return evaluate(run.system, "poses", run.p, run.t[-1:], run.states[-1:])[0]


def closed(kind: str, start, **more) -> Model:
    """The block, free, held by a closure."""
    m = Model("closed", gravity=(0.5, 0, -9.81))
    body(m)
    m.frame("base", at=PLACE["xyz"], rpy=PLACE["rpy"])
    m.joint("f", "free", "block", guess=list(start[:7]), rate_guess=list(start[7:]))
    m.closure("c", kind, ["base", "block"], **AXES[kind], **more)
    return m


def compare(kind: str, tree_options: dict, closure_options: dict, friction: float | None = None) -> None:
    m = tree(kind, **tree_options)
    if friction is not None:
        m.friction("rub", coordinate="j", force=friction)
    one = m.derive().run(t_end=0.7, **TOL)
    pose = evaluate(one.system, "poses", one.p, one.t[:1], one.states[:1])[0]
    turn = Rotation.from_matrix(pose[3:].reshape(3, 3))
    at = pose[:3] - turn.apply([0.1, 0.05, -0.08])
    x, y, z, w = turn.as_quat()
    speeds = [one[f"{k}{a}"][0] for k in "vw" for a in "xyz"]
    other = closed(kind, [*at, w, x, y, z, *speeds], **closure_options).derive()
    extra = "c" in [record["name"] for record in other.coordinates]
    assert other.nh == 6 - TYPES[kind].nv + extra
    assert other.dependent == ()
    two = other.run(t_end=0.7, **TOL)
    assert not [check for check in two.health if not check.ok]
    assert last_pose(two) == pytest.approx(last_pose(one), abs=2e-8)


@pytest.mark.parametrize("kind", [kind for kind in CLOSURES if kind != "fixed"])
def test_a_closure_holds_what_the_joint_holds(kind):
    compare(kind, {}, {})


def test_a_weld_holds_all():
    turn = Rotation.from_euler("xyz", PLACE["rpy"])
    x, y, z, w = turn.as_quat()
    run = closed("fixed", [*PLACE["xyz"], w, x, y, z, *[0] * 6]).derive().run(t_end=0.5)
    assert run.system.m == 6
    assert last_pose(run)[:3] == pytest.approx(PLACE["xyz"] + turn.apply([0.1, 0.05, -0.08]), abs=1e-12)


@pytest.mark.parametrize(
    "kind", ["revolute", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("prismatic", "screw"))]
)
def test_springs_dampers_and_friction_of_closures(kind):
    elastic = {"stiffness": 5, "rest": 0.4, "damping": 0.3}
    compare(kind, elastic, {**elastic, "friction": 0.6}, friction=0.6)


def test_a_closure_counts_whole_turns():
    m = tree("revolute", stiffness=0.5)
    run = m.derive().run(t_end=2, rate={"j": 40.0}, **TOL)
    pose = evaluate(run.system, "poses", run.p, run.t[:1], run.states[:1])[0]
    turn = Rotation.from_matrix(pose[3:].reshape(3, 3))
    x, y, z, w = turn.as_quat()
    at = pose[:3] - turn.apply([0.1, 0.05, -0.08])
    speeds = [run[f"{k}{a}"][0] for k in "vw" for a in "xyz"]
    other = closed("revolute", [*at, w, x, y, z, *speeds], stiffness=0.5).derive().run(t_end=2, **TOL)
    assert np.abs(run["j"]).max() > 7
    assert other["c"] == pytest.approx(run["j"], abs=1e-6)


def four_bar(closure: str) -> Model:
    m = Model("four_bar", gravity=(0, -9.81))
    for name, length in (("crank", 0.2), ("rod", 0.6), ("rocker", 0.4)):
        m.body(name, mass=1, inertia=0.02, com=(length / 2, 0))
    m.joint("a", "revolute", "crank", start=1.0, rate=3)
    m.joint("b", "revolute", "rod", "crank", {"xyz": (0.2, 0, 0)}, guess=-0.8)
    m.joint("d", "revolute", "rocker", origin={"xyz": (0.5, 0, 0)}, guess=1.5)
    m.frame("c1", "rod", (0.6, 0))
    m.frame("c2", "rocker", (0.4, 0))
    if closure == "coincident":
        m.coincident("c", "c1", "c2")
    else:
        m.closure("c", "revolute", ["c2", "c1"])
    return m


def test_a_planar_hinge_is_a_coincidence():
    runs = [four_bar(kind).derive().run(t_end=1, **TOL) for kind in ("coincident", "revolute")]
    assert runs[1].system.m == 2
    assert runs[0]["d"] == pytest.approx(runs[1]["d"], abs=1e-9)


def test_a_planar_slide_and_a_weld():
    """A block on an inclined guide, and one that is glued to it, against a mass on a slope."""
    m = Model("guide", gravity=(0, -9.81))
    for name in "ab":
        m.body(name, mass=1, inertia=0.1)
        m.joint(f"free_{name}", "planar", name, guess=[0, 0, 0.5] if name == "a" else [0.3, 0.1, 0.5])
    m.frame("slope", rpy=(0, 0, 0.5))
    m.closure("guide", "prismatic", ["slope", "a"], axis=[1, 0], friction=2)
    m.closure("glue", "fixed", ["a", "b"])
    run = m.derive().run(t_end=1, **TOL)
    assert run.system.m == 2 + 3
    s = (-9.81 * np.sin(0.5) + 2 / 2) / 2
    assert run["free_a_x"][-1] - run["free_a_x"][0] == pytest.approx(s * np.cos(0.5), abs=1e-9)
    assert run["free_b_y"][-1] - run["free_a_y"][-1] == pytest.approx(0, abs=1e-9)


def test_a_friction_follows_the_force_of_a_closure():
    """A pendulum on a pin with a radius: the torque is mu r N, and N the force that reaction() tells."""
    m = Model("pin", gravity=(0, -9.81))
    m.body("rod", mass=1, inertia=0.1)
    m.joint("f", "planar", "rod", guess=[0.5, 0, 0], rate_guess=[0, 1, 2])
    m.point("end", "rod", (-0.5, 0))
    m.frame("eye", "rod", (-0.5, 0))
    m.closure("pin", "revolute", ["world", "eye"], coordinate="turn")
    m.friction("rub", coordinate="turn", coefficient=0.02, normal="pin")
    m.output("n", "reaction(pin)")
    m.output("rub_torque", "reaction(rub)")
    run = m.derive().run(t_end=0.5, **TOL)
    n = np.hypot(run["lambda(pin_x)"], run["lambda(pin_y)"])
    assert run["n"] == pytest.approx(n, abs=1e-9)
    sliding = np.abs(run["dot(turn)"]) > 1e-6
    expected = -0.02 * n * np.sign(run["dot(turn)"])
    assert run["rub_torque"][sliding] == pytest.approx(expected[sliding], abs=1e-8)


@pytest.mark.parametrize(
    "method", ["dop853", "radau5", "bdf", "taylor", "rk4", "generalized_alpha", "gauss8", "rattle"]
)
def test_closures_take_every_method(method):
    options = {"step": 2e-4} if method in ("rk4", "generalized_alpha", "gauss8", "rattle") else {"rtol": 1e-9}
    m = four_bar("revolute")
    exact = m.derive().run(t_end=0.5, rtol=1e-12, atol=1e-13)
    run = m.derive().run(t_end=0.5, method=method, **options)
    assert run["d"][-1] == pytest.approx(exact["d"][-1], abs=2e-6)


@pytest.mark.parametrize("form", ["projection", "ggl", "baumgarte", "partition"])
def test_closures_take_every_form(form):
    m = tree("universal")
    pose = last_pose(m.derive().run(t_end=1e-9))
    turn = Rotation.from_matrix(pose[3:].reshape(3, 3))
    x, y, z, w = turn.as_quat()
    at = pose[:3] - turn.apply([0.1, 0.05, -0.08])
    closing = closed("universal", [*at, w, x, y, z, *[0] * 6]).derive()
    method = "radau5" if form == "ggl" else "dop853"
    exact = last_pose(closing.run(t_end=0.5, **TOL))
    assert last_pose(closing.run(t_end=0.5, method=method, constraints=form, rtol=1e-9)) == pytest.approx(
        exact, abs=1e-5
    )


def test_closures_are_written_and_read_again():
    m = closed("screw", [0, 0, 0, 1, 0, 0, 0, *[0] * 6], guess=0.2, damping="0.1 N*m*s", coordinate="angle")
    m.rack("mesh", "angle", "f_x", "0.1 m", efficiency=0.9)
    m.planetary("set", "angle", "f_y", "f_z", [20, 60])
    m.differential("diff", "f_x", ["f_y", "f_z"], 3)
    m.belt("belt", "f_x", "f_y", ["0.1 m", 0.2], crossed=True)
    m.gear("gear", "f_x", "f_z", teeth=[20, -30], offset=0.1)
    again = read_text(m.to_toml())
    assert again.to_toml() == m.to_toml()
    assert again._description().closures == m._description().closures


def wheels(*names: str) -> tuple[Model, dict]:
    m = Model("wheels")
    q = {name: m.coordinate(name, rate_guess=1.0) for name in names}
    for k, name in enumerate(names, 1):
        m.kinetic(0.1 * k * dot(q[name]) ** 2 / 2)
        m.force(name, 0.3 * k - 0.5)
    return m, q


def accelerations(m: Model) -> np.ndarray:
    return m.derive().run(t_end=0.1, **TOL).accelerations[-1]


def expected(row, n: int) -> np.ndarray:
    """Accelerations of wheels with one constraint."""
    M, f, G = (
        np.diag(0.1 * np.arange(1, n + 1)),
        0.3 * np.arange(1, n + 1) - 0.5,
        np.array([row], dtype=float),
    )
    return np.linalg.solve(np.block([[M, -G.T], [G, np.zeros((1, 1))]]), [*f, 0.0])[:n]


def test_gears_in_closed_form():
    m, _ = wheels("a", "b")
    m.gear("mesh", "a", "b", teeth=[20, 50])
    assert accelerations(m) == pytest.approx(expected([1, 2.5], 2))
    m, _ = wheels("a", "b")
    m.gear("mesh", "a", "b", teeth=[20, -50])
    assert accelerations(m) == pytest.approx(expected([1, -2.5], 2))
    m, _ = wheels("pinion", "rack")
    m.rack("mesh", "pinion", "rack", 0.25)
    assert accelerations(m) == pytest.approx(expected([0.25, -1], 2))
    m, _ = wheels("a", "b")
    m.belt("belt", "a", "b", [0.1, 0.3])
    assert accelerations(m) == pytest.approx(expected([0.1, -0.3], 2))
    m, _ = wheels("a", "b")
    m.belt("belt", "a", "b", [0.1, 0.3], crossed=True)
    assert accelerations(m) == pytest.approx(expected([0.1, 0.3], 2))
    m, _ = wheels("sun", "ring", "carrier")
    m.planetary("set", "sun", "ring", "carrier", [20, 60])
    assert accelerations(m) == pytest.approx(expected([20, 60, -80], 3))
    m, _ = wheels("engine", "left", "right")
    m.differential("axle", "engine", ["left", "right"], 4)
    assert accelerations(m) == pytest.approx(expected([1, -2, -2], 3))


WORM = {"J": 0.01, "K": 0.5, "n": 5}


def worm(efficiency: float, drive: float, load: float, rate: float = 0.0, rack: bool = False) -> Model:
    m = Model("worm")
    a, b = m.coordinate("a", rate=rate * WORM["n"]), m.coordinate("b", rate=rate)
    m.kinetic(WORM["J"] * dot(a) ** 2 / 2 + WORM["K"] * dot(b) ** 2 / 2)
    if rack:
        m.rack("mesh", a, b, 1 / WORM["n"], efficiency=efficiency)
    else:
        m.gear("mesh", a, b, WORM["n"], efficiency=efficiency)
    m.force(a, drive)
    m.force(b, load)
    return m


def worm_acceleration(mu: float, drive: float, load: float) -> float:
    """J a = drive - M (1 + mu), K a/n = load + n M, where M > 0 is what the worm passes on."""
    J, K, n = WORM.values()
    M = (drive / J - load * n / K) / ((1 + mu) / J + n * n / K)
    assert M * (1 + mu) > 0 or mu < 0
    return (drive - M * (1 + mu)) / J


@pytest.mark.parametrize("rack", [False, True])
def test_the_efficiency_of_a_worm(rack):
    """Driving, driven backwards, and held by itself: Shigley, Mechanical Engineering Design, worm gearing."""
    driving = worm(0.8, 1.0, -1.0, rack=rack).derive().run(t_end=0.5, **TOL)
    assert driving.accelerations[-1, 0] == pytest.approx(worm_acceleration(1 / 0.8 - 1, 1.0, -1.0))
    driven = worm(0.7, 0.0, -1.0, rack=rack).derive().run(t_end=0.5, **TOL)
    J, K, n = WORM.values()
    mu = 1 / 0.7 - 1
    M = 1 / (n + K / n / J * (1 - mu))
    assert driven.accelerations[-1, 0] == pytest.approx(-M * (1 - mu) / J)
    held = worm(0.4, 0.0, -1.0, rack=rack).derive().run(t_end=0.5, **TOL)
    assert held["a"] == pytest.approx(0.0, abs=1e-15)
    assert held.energy.balance[-1] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("radius", ["-0.2", "-r"])
def test_a_rack_that_moves_the_other_way_loses_as_much(radius):
    m = Model("rack")
    m.parameter("r", 0.2)
    a, b = m.coordinate("a"), m.coordinate("b")
    m.kinetic(WORM["J"] * dot(a) ** 2 / 2 + WORM["K"] * dot(b) ** 2 / 2)
    m.rack("mesh", a, b, radius, efficiency=0.8)
    m.force(a, 1.0)
    m.force(b, 1.0)
    run = m.derive().run(t_end=0.5, **TOL)
    assert run.ok
    assert run.accelerations[-1, 0] == pytest.approx(worm_acceleration(1 / 0.8 - 1, 1.0, -1.0))


@pytest.mark.parametrize(
    ("method", "form"),
    [("dop853", "projection"), ("radau5", "ggl"), ("taylor", "projection")],
)
def test_a_worm_that_holds_its_load_lets_it_go_when_it_is_driven(method, form):
    """Held at rest until the drive is worth the load at the worm times 1 + mu, and moved by what is more than that."""
    mu, m = 1.25, worm(1 / 2.25, "2.5*t", -5.0)
    m.output("force", 'reaction("mesh")')
    J, K, n = WORM.values()
    run = derive(m).run(t_end=2.0, method=method, constraints=form, **TOL)
    begins, slope = (1 + mu) * 5 / n / 2.5, 2.5 / (J * n + (1 + mu) * K / n)
    moving = np.maximum(run.t - begins, 0.0)
    assert run.ok and [e.action for e in run.events] == ["slip"]
    assert run["dot(b)"] == pytest.approx(slope * moving**2 / 2, abs=1e-4)
    assert run["force"] == pytest.approx(-(5 + K * slope * moving) / n, rel=1e-4)


def test_the_power_that_a_worm_loses_is_in_the_balance():
    run = worm(0.6, 2.0, -1.0).derive().run(t_end=1, **TOL)
    checks = {check.check: check for check in run.health}
    assert checks["energy"].ok
    assert checks["energy"].value < 1e-9


def test_units_of_gears():
    m = Model("u")
    m.coordinate("phi", unit="rad")
    m.coordinate("x", unit="m")
    m.kinetic("dot(phi)^2 + dot(x)^2")
    m.rack("mesh", "phi", "x", "0.1 kg")
    with pytest.raises(ModelError, match="units do not match"):
        m.describe()


def refused(**given) -> str:
    m = Model("r", gravity=(0, 0, -9.81))
    m.body("a", mass=1, inertia=[1, 1, 1])
    m.body("flat", mass=1, inertia=1.0)
    m.body("flat2", mass=1, inertia=1.0)
    m.joint("ja", "free", "a")
    m.joint("jf", "planar", "flat")
    m.joint("jf2", "planar", "flat2")
    m.frame("f", "a")
    with pytest.raises(ModelError) as error:
        m.closure("c", **given)
        m.describe()
    return str(error.value)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"frames": ["a", "world"]}, "the type of the joint is missing"),
        ({"type": "free", "frames": ["a", "world"]}, "'free' is no joint that closes a loop"),
        ({"type": "revolut", "frames": ["a", "world"]}, "did you mean 'revolute'"),
        ({"type": "revolute"}, "'frames' is missing"),
        ({"type": "revolute", "frames": ["a", "f"]}, "both frames are fixed in 'a'"),
        ({"type": "revolute", "frames": ["a", "g"]}, "no frame or body 'g'"),
        ({"type": "revolute", "frames": ["a", "flat"]}, "one body is planar"),
        ({"type": "universal", "frames": ["flat2", "flat"]}, "leaves the x-y plane"),
        ({"type": "revolute", "frames": ["flat2", "flat"], "axis": [1, 0]}, "the axis of a revolute joint .* is z"),
        ({"type": "spherical", "frames": ["a", "world"], "axis": [1, 0, 0]}, "a spherical closure has no 'axis'"),
        ({"type": "fixed", "frames": ["a", "world"], "friction": 1}, "a fixed closure has no 'friction'"),
        ({"type": "screw", "frames": ["a", "world"]}, "a screw needs a 'pitch'"),
        ({"type": "revolute", "frames": ["a", "world"], "rest": 1}, "'rest' has no effect"),
        ({"type": "revolute", "frames": ["a", "world"], "guess": 1}, "a 'guess' is that of a coordinate"),
        ({"type": "revolute", "frames": ["a", "world"], "coordinate": "ja_x"}, "'ja_x', which is taken"),
        ({"type": "universal", "frames": ["a", "world"], "axis2": [1, 0, 0]}, "axes of a universal joint are parallel"),
        ({"type": "revolute", "frames": ["a", "world"], "axis": [1, 0]}, "three components"),
    ],
)  # fmt: skip
def test_what_a_closure_refuses(given, message):
    import re

    assert re.search(message, refused(**given))


def test_what_gears_refuse():
    m, _ = wheels("a", "b", "c")
    with pytest.raises(ModelError, match="'ratio', or 'teeth'"):
        m.gear("g", "a", "b")
    m.differential("d", "a", ["b", "b"])
    with pytest.raises(ModelError, match="two of the coordinates are the same"):
        m.describe()
    m, _ = wheels("a", "b", "c")
    m.planetary("p", "a", "b", "d", [1, 2])
    with pytest.raises(ModelError, match="no coordinate 'd'"):
        m.describe()


def test_a_model_of_closures_and_gears_as_a_file():
    text = """
[bodies.drum]
mass = "2 kg"
inertia = 0.05

[bodies.arm]
mass = "1 kg"
com = ["0.2 m", 0]
inertia = 0.02

[joints.drum]
type = "revolute"
child = "drum"
rate = 2

[joints.arm]
type = "revolute"
child = "arm"
origin = { xyz = [0.5, 0, 0] }
guess = 0.1

[constraints.belt]
belt = { coordinates = ["drum", "arm"], radii = ["0.1 m", "0.2 m"], offset = "0 m" }
"""
    run = derive(read_text(text)).run(t_end=1)
    assert run["arm"] == pytest.approx(run["drum"] / 2)
