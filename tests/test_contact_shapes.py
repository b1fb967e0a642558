"""Contacts by shapes: gaps against distances that are searched for, motions against closed forms and SciPy."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, RectBivariateSpline
from scipy.optimize import lsq_linear, minimize
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from scipy.special import ellipk

import symgen
from symgen import Model
from symgen.errors import ModelError
from symgen.link import derive_text
from symgen.model.toml_reader import read_text
from symgen.runtime import load, solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.recording.resume import Resumed
from symgen.runtime.recording.verify import verify
from tests.falling_bodies import Fall, box_corners, rotation
from tests.recorded import assert_same_recording, record
from tests.stress.contact_shapes import KINDS, thrown, try_many
from tests.stress.hulls import write_hull
from tests.stress.scenario import RIGHT, WRONG
from tests.stress.thrown_bodies import objection

G = 9.81
EDGES = (0.3, 0.2, 0.1)


def free_body(model: Model, name: str, shape: dict, start=(0, 0, 1, 1, 0, 0, 0), rate=(0,) * 6) -> None:
    model.body(name, mass=1.0, inertia=[0.02, 0.03, 0.04], shape=shape)
    model.joint(f"{name}_free", type="free", child=name, start=start, rate=rate)


def planar_body(
    model: Model, name: str, shape: dict, start=(0.0, 1.0, 0.0), rate=(0.0, 0.0, 0.0), inertia=0.01
):
    q = [
        model.coordinate(f"{name}_{c}", unit=unit, start=x, rate=v)
        for c, unit, x, v in zip("xya", ("m", "m", "rad"), start, rate, strict=True)
    ]
    model.body(name, mass=1.0, com=q[:2], inertia=inertia, angle=q[2], shape=shape)


def gaps(system, y: np.ndarray) -> np.ndarray:
    """The gaps of all stops at a state."""
    n = [switch["kind"] for switch in system.switches].count("stop")
    return system.kernel("switches")(0.0, y, system.parameter_values())[: 2 * n : 2]


def random_pose(rng: np.random.Generator, size: float = 0.5) -> np.ndarray:
    turn = rng.normal(size=4)
    return np.concatenate([rng.uniform(-size, size, 3), turn / np.linalg.norm(turn)])


def matrix(pose: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(pose[[4, 5, 6, 3]]).as_matrix()


def test_corners_of_a_box_over_a_leaning_plane():
    m = Model("leaning", gravity=(0, 0, "-9.81 m/s^2"))
    free_body(m, "box", {"box": EDGES})
    m.frame("slope", body="world", at=(0.1, 0.2, 0.3), rpy=(0.4, -0.3, 0.2))
    m.contact("floor", body="box", plane="slope")
    system, rng = m.derive(), np.random.default_rng(1)
    normal = Rotation.from_euler("xyz", [0.4, -0.3, 0.2]).as_matrix()[:, 2]
    for _ in range(5):
        pose = random_pose(rng)
        places = pose[:3] + box_corners(EDGES) @ matrix(pose).T
        expected = (places - [0.1, 0.2, 0.3]) @ normal
        np.testing.assert_allclose(gaps(system, np.concatenate([pose, np.zeros(6)])), expected, atol=1e-14)


SHAPES = {
    "sphere": ({"sphere": [0.1]}, np.zeros((0, 3)), 0.1),
    "capsule": ({"capsule": [0.05, 0.4]}, np.array([[0, 0, 0.2]]), 0.05),
    "box": ({"box": EDGES}, np.diag(np.array(EDGES) / 2), 0.0),
}


@pytest.mark.parametrize(
    "one, two",
    [
        ("sphere", "sphere"),
        ("sphere", "capsule"),
        ("capsule", "sphere"),
        ("sphere", "box"),
        ("box", "sphere"),
        ("capsule", "box"),
        ("box", "capsule"),
        ("capsule", "capsule"),
    ],
)
def test_gaps_between_bodies_are_least_distances(one, two):
    """Found by bounded least squares over the cores of both shapes: what they are without their radius."""
    m = Model("pair")
    for name, kind in (("a", one), ("b", two)):
        free_body(m, name, SHAPES[kind][0])
    m.contact("hit", body="a", other="b", restitution=0.5)
    system, rng, n_apart = m.derive(), np.random.default_rng(2), 0
    for _ in range(12):
        poses = [random_pose(rng) for _ in range(2)]
        cores = [matrix(pose) @ SHAPES[kind][1].T for pose, kind in zip(poses, (one, two))]
        spanned = np.hstack([cores[0], -cores[1]])
        apart = poses[0][:3] - poses[1][:3]
        distance = (
            np.linalg.norm(apart + spanned @ lsq_linear(spanned, -apart, (-1.0, 1.0), tol=1e-14).x)
            if spanned.size
            else np.linalg.norm(apart)
        )
        if distance > 1e-3:
            n_apart += 1
            expected = distance - SHAPES[one][2] - SHAPES[two][2]
            found = gaps(system, np.concatenate([*poses, np.zeros(12)]))
            assert found.min() == pytest.approx(expected, abs=1e-7)
            assert len(found) == {"capsulecapsule": 5, "capsulebox": 6, "boxcapsule": 6}.get(one + two, 1)
    assert n_apart >= 8


def capsule_over_box(e: float | None, place: tuple, turn, spin=(0, 0, 0), **more) -> Model:
    """A capsule that falls on a box that does not move."""
    m = Model("log", gravity=(0, 0, "-9.81 m/s^2"))
    q = Rotation.from_rotvec(turn).as_quat()[[3, 0, 1, 2]]
    free_body(m, "log", {"capsule": [0.05, 0.6]}, (*place, *q), (0, 0, 0, *spin))
    m.body("block", mass=1, shape={"box": [0.2, 0.3, 0.1]})
    m.joint("held", type="fixed", child="block")
    m.contact("hit", body="log", other="block", restitution=e, **more)
    return m


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_capsule_on_an_edge_parts_as_newton_says(method):
    """The nearest places are found by bounded least squares, the impulse by the momentum that it takes."""
    m = capsule_over_box(0.6, (0.05, 0.02, 0.4), (0.2, 1.3, 0.1), (0.3, -1.0, 0.5))
    hit = m.derive().run(t_end=0.5, method=method, rtol=1e-10, atol=1e-12).events[0]
    assert hit.action == "impact" and hit.name in [f"hit_{k}" for k in (3, 4, 5, 6)]
    turn = matrix(hit.q_before)
    spanned = np.hstack([turn @ [[0], [0], [0.3]], -np.diag([0.1, 0.15, 0.05])])
    shares = lsq_linear(spanned, -hit.q_before[:3], (-1, 1), tol=1e-15).x
    apart = hit.q_before[:3] + spanned @ shares
    normal = apart / np.linalg.norm(apart)
    assert np.linalg.norm(apart) == pytest.approx(0.05, abs=1e-9)
    arm = spanned[:, 0] * shares[0] - 0.05 * normal
    inertia = turn @ np.diag([0.02, 0.03, 0.04]) @ turn.T
    lever = np.linalg.solve(inertia, np.cross(arm, normal))
    before = hit.v_before[:3] @ normal + (turn @ hit.v_before[3:6]) @ np.cross(arm, normal)
    impulse = -1.6 * before / (1 + np.cross(arm, normal) @ lever)
    np.testing.assert_allclose(hit.v_after[:3], hit.v_before[:3] + impulse * normal, atol=1e-7)
    np.testing.assert_allclose(hit.v_after[3:6], hit.v_before[3:6] + impulse * turn.T @ lever, atol=1e-7)


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_capsule_comes_to_rest_across_a_box(method):
    m = capsule_over_box(0.3, (0.03, 0.02, 0.2), (0, np.pi / 2, 0))
    run = m.derive().run(t_end=0.8, method=method)
    assert run.ok
    assert run["log_free_z"][-1] == pytest.approx(0.1, abs=1e-7)
    np.testing.assert_allclose(run.v[-1], 0.0, atol=1e-9)
    # The weight is shared by two edges at x = 0.1 and -0.1.
    forces = np.array([run[f"force(hit_{k})"][-1] for k in range(1, 7)])
    assert np.sum(forces) == pytest.approx(G, rel=1e-7) and np.sum(forces > 1e-3) == 2
    assert np.sort(forces)[-1] == pytest.approx(G * 0.13 / 0.2, rel=1e-5)


@pytest.mark.parametrize("method", ["dop853", pytest.param("radau5", marks=pytest.mark.slow)])
def test_a_capsule_that_gives_way_lies_on_two_edges(method):
    m = capsule_over_box(None, (0, 0, 0.2), (0, np.pi / 2, 0), stiffness="1e5 N/m^1.5", damping="0.2 s/m")
    run = m.derive().run(t_end=0.4, method=method, rtol=1e-10, atol=1e-12)

    def rates(_, s):
        depth = max(0.1 - s[0], 0.0)
        return [s[1], max(2e5 * depth**1.5 * (1 - 0.3 * s[1]), 0.0) - G]

    expected = solve_ivp(rates, (0, 0.4), [0.2, 0], "Radau", rtol=1e-11, atol=1e-13, max_step=1e-3).y[:, -1]
    assert run.ok
    np.testing.assert_allclose(
        [run["log_free_z"][-1], run["log_free_vz"][-1]], expected, rtol=1e-5, atol=1e-6
    )


def test_capsules_in_a_plane_touch_at_their_ends():
    m = Model("sticks")
    for name in "ab":
        planar_body(m, name, {"capsule": [0.05, 0.4]})
    m.contact("hit", body="a", other="b")
    system, rng = m.derive(), np.random.default_rng(3)
    for _ in range(8):
        poses = np.array([[0, 0, 0], [1.5, 0, 0]]) + rng.uniform(-1.0, 1.0, (2, 3))
        along = [0.2 * np.array([np.cos(a), np.sin(a)]) for _, _, a in poses]
        spanned = np.stack([along[0], -along[1]], axis=1)
        apart = poses[0, :2] - poses[1, :2]
        nearest = lsq_linear(spanned, -apart, (-1.0, 1.0), tol=1e-14).x
        expected = np.linalg.norm(apart + spanned @ nearest) - 0.1
        found = gaps(system, np.concatenate([poses.ravel(), np.zeros(6)]))
        assert found.min() == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("first", [True, False])
def test_capsules_and_boxes_in_a_plane_are_apart_by_their_least_distance(first):
    """Found by bounded least squares over the core of the capsule and the box."""
    m = Model("ledge")
    planar_body(m, "a", {"capsule": [0.05, 0.4]})
    planar_body(m, "b", {"box": [0.3, 0.2, 0.1]})
    m.contact("hit", body="ab"[not first], other="ab"[first])
    system, rng, n_apart = m.derive(), np.random.default_rng(4), 0
    for _ in range(30):
        poses = rng.uniform(-0.6, 0.6, (2, 3)) * [1, 1, 5]
        turns = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for _, _, a in poses]
        spanned = np.hstack([turns[0] @ [[0.2], [0]], -turns[1] @ np.diag([0.15, 0.1])])
        apart = poses[0, :2] - poses[1, :2]
        expected = np.linalg.norm(apart + spanned @ lsq_linear(spanned, -apart, (-1.0, 1.0), tol=1e-14).x)
        if expected > 1e-3:
            n_apart += 1
            found = gaps(system, np.concatenate([poses.ravel(), np.zeros(6)]))
            assert len(found) == 6 and found.min() == pytest.approx(expected - 0.05, abs=1e-7)
    assert n_apart >= 15


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_capsule_in_a_plane_comes_to_rest_on_a_box(method):
    """Across its upper side, over both of its corners, which share the weight by the levers."""
    m = Model("log", gravity=(0, "-9.81 m/s^2"))
    planar_body(m, "log", {"capsule": [0.05, 0.6]}, (0.03, 0.4, 0.1), (0, 0, 0.5))
    m.body("block", mass=1, com=(0, 0), shape={"box": [0.2, 0.1, 0.1]})
    m.contact("hit", body="log", other="block", restitution=0.3, friction=0.6)
    run = m.derive().run(t_end=1.5, method=method)
    assert run.ok, [check.says for check in run.objections]
    assert run["log_y"][-1] == pytest.approx(0.1, abs=1e-7)
    np.testing.assert_allclose(run.v[-1], 0.0, atol=1e-9)
    forces = np.sort([run[f"force(hit_{k})"][-1] for k in range(1, 7)])
    assert forces[-1] == pytest.approx(G * (0.1 + abs(run["log_x"][-1])) / 0.2, rel=1e-5)
    assert forces[-2:].sum() == pytest.approx(G, rel=1e-7)


def hills(x: float, y: float) -> float:
    return 0.1 * np.sin(3 * x) * np.cos(2 * y)


def test_a_sphere_over_hills_is_as_far_as_the_foot():
    m = Model("hills")
    free_body(m, "ball", {"sphere": [0.1]})
    m.contact("ground", body="ball", height="0.1*sin(3*here_x)*cos(2*here_y)")
    system, rng = m.derive(), np.random.default_rng(4)
    for _ in range(8):
        x, y = rng.uniform(-1, 1, 2)
        place = np.array([x, y, hills(x, y) + rng.uniform(0.08, 0.15)])
        least = minimize(
            lambda f, c=place: (f[0] - c[0]) ** 2 + (f[1] - c[1]) ** 2 + (hills(*f) - c[2]) ** 2,
            place[:2],
            tol=1e-14,
        )
        state = np.concatenate([place, [1, 0, 0, 0], np.zeros(6)])
        assert gaps(system, state)[0] == pytest.approx(np.sqrt(least.fun) - 0.1, abs=1e-10)


def test_a_sphere_slides_on_hills_as_its_middle_does_on_the_surface_beside_them():
    """Planar and frictionless: the middle is held on the parallel curve by a Lagrange multiplier, in arc parameters."""
    m = Model("slide", gravity=(0, "-9.81 m/s^2"))
    radius, at = 0.1, 0.3
    h, dh, ddh = lambda x: 0.2 * np.cos(2 * x), lambda x: -0.4 * np.sin(2 * x), lambda x: -0.8 * np.cos(2 * x)
    length = np.hypot(1.0, dh(at))
    start = (at - radius * dh(at) / length, h(at) + radius / length, 0.0)
    planar_body(m, "ball", {"sphere": [radius]}, start)
    m.contact("ground", body="ball", height="0.2*cos(2*here_x)")
    run = m.derive().run(t_end=0.6, rtol=1e-10, atol=1e-12)

    def middle(u: float) -> np.ndarray:
        n = np.hypot(1.0, dh(u))
        return np.array([u - radius * dh(u) / n, h(u) + radius / n])

    def speed(u: float) -> np.ndarray:
        bend = ddh(u) / np.hypot(1.0, dh(u)) ** 3
        return np.array([1.0, dh(u)]) * (1.0 - radius * bend)

    def rates(_, state: np.ndarray) -> list[float]:
        u, w = state
        e = 1e-5
        grown = (speed(u + e) - speed(u - e)) / (2 * e)
        s = speed(u)
        return [w, (-G * s[1] - (grown @ s) * w * w) / (s @ s)]

    expected = solve_ivp(rates, (0, 0.6), [at, 0.0], "DOP853", rtol=1e-11, atol=1e-12).y[0, -1]
    assert run.ok and not run.events
    np.testing.assert_allclose([run["ball_x"][-1], run["ball_y"][-1]], middle(expected), atol=1e-8)


def test_a_ball_bounces_off_a_bowl_along_the_normal_at_the_foot():
    hx, hy = sympy.symbols("here_x here_y")
    m = Model("bowl", gravity=(0, 0, "-9.81 m/s^2"))
    c = m.parameter("c", "1 1/m")
    free_body(m, "ball", {"sphere": [0.05]}, start=(0.2, 0.1, 0.4, 1, 0, 0, 0), rate=(0.1, 0, 0, 0, 0, 0))
    m.contact("ground", body="ball", height=c * (hx**2 + hy**2 / 2), restitution=0.7)
    hit = m.derive().run(t_end=0.5, rtol=1e-10, atol=1e-12).events[0]
    place, before = hit.q_before[:3], hit.v_before[:3]

    def away(f: np.ndarray) -> float:
        return np.sum((np.array([*f, f @ f - f[1] ** 2 / 2]) - place) ** 2)

    foot = minimize(away, place[:2], tol=1e-14).x
    normal = np.array([-2 * foot[0], -foot[1], 1.0]) / np.sqrt(1 + 4 * foot[0] ** 2 + foot[1] ** 2)
    np.testing.assert_allclose(place, [*foot, foot[0] ** 2 + foot[1] ** 2 / 2] + 0.05 * normal, atol=1e-7)
    np.testing.assert_allclose(hit.v_after[:3], before - 1.7 * (before @ normal) * normal, atol=1e-6)


@pytest.mark.slow
def test_a_sphere_over_tables_is_as_far_as_the_foot_on_splines_of_scipy():
    x = np.linspace(-2, 2, 30)
    m = Model("curve", gravity=(0, "-9.81 m/s^2"))
    m.table("land", columns=[x.tolist(), (0.1 * np.sin(3 * x)).tolist()], kind="cubic", outside="extend")
    planar_body(m, "ball", {"sphere": [0.1]})
    m.contact("ground", body="ball", height="land(here_x)")
    system, rng, curve = m.derive(), np.random.default_rng(5), CubicSpline(x, 0.1 * np.sin(3 * x))
    for _ in range(10):
        at = rng.uniform(-1.5, 1.5)
        y = curve(at) + rng.uniform(0.08, 0.15)
        least = minimize(lambda f, c=(at, y): (f[0] - c[0]) ** 2 + (curve(f[0]) - c[1]) ** 2, [at], tol=1e-15)
        found = gaps(system, np.array([at, y, 0, 0, 0, 0]))[0]
        assert found == pytest.approx(np.sqrt(least.fun) - 0.1, abs=1e-10)
    x = np.linspace(-1.5, 1.5, 6)
    heights = hills(*np.meshgrid(x, x, indexing="ij"))
    m, land = Model("map"), RectBivariateSpline(x, x, heights)
    columns = [*(a.ravel().tolist() for a in np.meshgrid(x, x, indexing="ij")), heights.ravel().tolist()]
    m.table("land", columns=columns, kind="cubic", outside="extend")
    free_body(m, "ball", {"sphere": [0.1]})
    m.contact("ground", body="ball", height="land(here_x, here_y)")
    system = m.derive()
    for _ in range(10):
        place = np.array([*rng.uniform(-1, 1, 2), 0])
        place[2] = land(*place[:2])[0, 0] + rng.uniform(0.08, 0.15)
        least = minimize(
            lambda f, c=place: np.sum((f - c[:2]) ** 2) + (land(*f)[0, 0] - c[2]) ** 2, place[:2], tol=1e-15
        )
        found = gaps(system, np.concatenate([place, [1, 0, 0, 0], np.zeros(6)]))[0]
        assert found == pytest.approx(np.sqrt(least.fun) - 0.1, abs=1e-10)


@pytest.mark.parametrize("method", ["dop853", "radau5"])
@pytest.mark.parametrize(
    "law",
    [
        {"restitution": 0.5, "friction": 0.3},
        {"stiffness": "1e5 N/m^1.5", "damping": "0.2 s/m", "friction": 0.3, "smooth": "1e-2 m/s"},
    ],
    ids=["rigid", "compliant"],
)
def test_a_ball_on_a_table_moves_as_on_the_formula(method, law):
    """A parabola: the cubic through its knots is the parabola."""
    found = []
    for height in ("valley(here_x)", "here_x^2/one"):
        options = (
            {"max_step": 0.02} if "stiffness" in law else {}
        )  # no event says where it begins to give way
        run = ball_in_a_valley(height, law).run(t_end=0.4, method=method, rtol=1e-10, atol=1e-12, **options)
        assert run.ok and (run.events or "stiffness" in law)
        found.append(run.states)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("method", ["dopri5", "bdf", "radau5", "dop853"])
@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_a_ball_that_steps_carry_through_a_valley_is_told_of(method, rtol):
    """Below its focus a parabola pushes no more: a step that ends there, and none of whose stages is on the way."""
    law = {"stiffness": "1e5 N/m^1.5", "damping": "0.2 s/m", "friction": 0.3, "smooth": "1e-2 m/s"}
    system = ball_in_a_valley("here_x^2/one", law)
    times = np.linspace(0.0, 0.6, 61)
    options = {"t_end": 0.6, "t_eval": times, "method": method, "rtol": rtol, "atol": 1e-2 * rtol}
    expected = system.run(**options | {"method": "radau9", "rtol": 1e-11, "atol": 1e-13}, max_step=0.005)
    assert expected.ok
    for n in (41, 61):
        run = system.run(**options | {"t_end": times[n - 1], "t_eval": times[:n]})
        right = np.abs(run.q - expected.q[:n]).max() < 1e-2
        assert right or not run.ok
        assert right or "max_step" in " ".join(entry.says for entry in run.objections)
    closely = system.run(**options, max_step=0.02)
    np.testing.assert_allclose(closely.q, expected.q, atol=1e-2 if rtol > 1e-8 else 1e-5)


def ball_in_a_valley(height: str, law: dict):
    knots = np.linspace(-1, 1, 9)
    m = Model("valley", gravity=(0, "-9.81 m/s^2"))
    m.parameter("one", "1 m")
    m.table(
        "valley",
        columns=[knots.tolist(), (knots**2).tolist()],
        kind="cubic",
        outside="extend",
        units=["m"] * 2,
    )
    planar_body(m, "body", {"sphere": [0.1]}, (0.4, 0.35, 0.2), (0.1, 0.0, 3.0))
    m.contact("ground", body="body", height=height, **law)
    return m.derive()


def test_a_compliant_point_on_a_table_gives_way_as_on_the_formula():
    """Where slopes of a table stand in a force, they stay slopes."""
    knots, found = np.linspace(-1, 1, 9), []
    for height in ("valley(here_x)", "here_x^2/one"):
        m = Model("valley", gravity=(0, "-9.81 m/s^2"))
        m.parameter("one", "1 m")
        m.table(
            "valley",
            columns=[knots.tolist(), (knots**2).tolist()],
            kind="cubic",
            outside="extend",
            units=["m"] * 2,
        )
        planar_body(m, "body", {"sphere": [0.1]}, (0.4, 0.3, 0.2), (0.1, 0.0, 0.0))
        m.contact("ground", body="body", shape={"sphere": [0]}, height=height, stiffness="1e4 N/m^1.5")
        run = m.derive().run(t_end=0.4, method="dop853", rtol=1e-10, atol=1e-12)
        assert run.ok
        found.append(run.states[-1])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6, atol=1e-7)


def test_a_surface_may_be_a_curve():
    """A parabola: the cubic through its knots is the parabola."""
    knots, found = np.linspace(-1, 1, 5), []
    for kind in ("table", "formula"):
        m = Model("valley", gravity=(0, "-9.81 m/s^2"))
        m.table("valley", columns=[knots.tolist(), (knots**2).tolist()], kind="cubic", outside="extend")
        planar_body(m, "body", {"box": [0.1, 0.08, 0.1]}, (0.3, 0.4, 0.2), (0.1, 0.0, 0.0))
        height = "valley(here_x)" if kind == "table" else sympy.Symbol("here_x") ** 2 * m.parameter("c", 1.0)
        m.contact("ground", body="body", height=height, restitution=0.5)
        run = m.derive().run(t_end=0.3, method="dop853")
        assert run.events and run.ok
        found.append(run.states[-1])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-7, atol=1e-8)


def test_a_point_bounces_off_a_map():
    """x^2 + x y/2 through knots, at rest above x = 0.3, y = 0.1: the first blow turns the speed about the normal."""
    knots = np.linspace(-1, 1, 4)
    x, y = (a.ravel() for a in np.meshgrid(knots, knots, indexing="ij"))
    m = Model("map", gravity=(0, 0, "-9.81 m/s^2"))
    m.table(
        "land",
        columns=[x.tolist(), y.tolist(), (x**2 + 0.5 * x * y).tolist()],
        kind="cubic",
        outside="extend",
    )
    free_body(m, "point", {"sphere": [0.01]}, (0.3, 0.1, 0.5, 1, 0, 0, 0))
    m.contact("floor", body="point", shape={"sphere": [0]}, height="land(here_x, here_y)", restitution=1.0)
    hit = m.derive().run(t_end=0.35, method="dop853").events[0]
    fallen = 0.5 - (0.09 + 0.015)
    assert hit.t == pytest.approx(np.sqrt(2 * fallen / G), rel=1e-8)
    normal = np.array([-0.65, -0.15, 1.0]) / np.sqrt(0.65**2 + 0.15**2 + 1)
    before = np.array([0, 0, -np.sqrt(2 * G * fallen)])
    np.testing.assert_allclose(hit.v_after[:3], before - 2 * (before @ normal) * normal, rtol=1e-7)


def test_a_box_tumbles_as_newton_and_euler_say():
    m = Model("tumbling", gravity=(0, 0, "-9.81 m/s^2"))
    start = np.concatenate(
        [[0, 0, 1], np.array([0.9, 0.3, -0.2, 0.1]) / np.linalg.norm([0.9, 0.3, -0.2, 0.1])]
    )
    rate = np.array([0.5, 0.2, 0.0, 3.0, 1.0, -2.0])
    free_body(m, "box", {"box": EDGES}, start.tolist(), rate.tolist())
    m.contact("floor", body="box", restitution=0.6)
    run = m.derive().run(t_end=1.6, rtol=1e-11, atol=1e-12, method="dop853")
    fall = Fall(1.0, np.array([0.02, 0.03, 0.04]), box_corners(EDGES), 0.6)
    state = np.concatenate([start, rate])
    found, after = fall.impacts(state, 7, 5.0)
    assert [e.name for e in run.events[:7]] == [f"floor_{k + 1}" for _, k in found]
    np.testing.assert_allclose([e.t for e in run.events[:7]], [t for t, _ in found], rtol=1e-8)
    np.testing.assert_allclose(run.events[6].v_after, after[7:], rtol=1e-5, atol=1e-6)
    energies = [e.energy_change for e in run.events]
    assert max(energies) <= 1e-12


def test_a_box_comes_to_rest_on_a_face():
    m = Model("resting", gravity=(0, 0, "-9.81 m/s^2"))
    free_body(m, "box", {"box": EDGES}, (0, 0, 0.4, 0.9, 0.3, -0.2, 0.245), (0.0, 0.0, 0.0, 3.0, 1.0, -2.0))
    m.contact("floor", body="box", restitution=0.3)
    run = m.derive().run(t_end=3.0)
    assert run.ok
    up = np.abs(rotation(run.states[-1]).as_matrix()[2])
    face = int(up.argmax())
    assert up[face] == pytest.approx(1.0, abs=1e-9)
    assert run.states[-1, 2] == pytest.approx(EDGES[face] / 2, abs=1e-9)


def slope(mu: float, degrees: float, shape: dict, height: float, inertia: float, **more) -> Model:
    m = Model("slope", gravity=(0, "-9.81 m/s^2"))
    lean = np.deg2rad(degrees)
    m.frame("slope", body="world", rpy=(0, 0, f"{-degrees} deg"))
    planar_body(m, "body", shape, (height * np.sin(lean), height * np.cos(lean), -lean), inertia=inertia)
    m.contact("floor", body="body", plane="slope", friction=mu, **more)
    return m


@pytest.mark.parametrize("mu", [0.1, 0.16, 0.17, 0.5])
def test_a_ball_on_a_slope_slips_or_rolls(mu):
    """It rolls where friction is above 2/7 of the slope."""
    run = slope(mu, 30, {"sphere": [0.1]}, 0.1, 0.004).derive().run(t_end=1.0)
    lean = np.pi / 6
    rolls = mu > 2 / 7 * np.tan(lean)
    a = 5 / 7 * G * np.sin(lean) if rolls else G * (np.sin(lean) - mu * np.cos(lean))
    spin = a / 0.1 if rolls else mu * G * np.cos(lean) / 0.04
    assert run.ok
    assert run["body_x"][-1] - run["body_x"][0] == pytest.approx(a / 2 * np.cos(lean), rel=1e-7)
    assert run["body_a"][-1] - run["body_a"][0] == pytest.approx(-spin / 2, rel=1e-7)


@pytest.mark.parametrize("method", ["taylor", "dop853", "radau5", "bdf"])
def test_a_ball_that_is_thrown_slides_then_rolls(method):
    """From slipping to rolling at 2 v/(7 mu g), with 5/7 of the speed (Coriolis, billiards)."""
    m = Model("bowling", gravity=(0, "-9.81 m/s^2"))
    planar_body(m, "ball", {"sphere": [0.1]}, (0.0, 0.1, 0.0), (3.0, 0.0, 0.0), inertia=0.004)
    m.contact("lane", body="ball", friction=0.2)
    run = m.derive().run(t_end=1.0, method=method)
    rolls = [e for e in run.events if e.action == "stick"]
    assert run.ok and len(rolls) == 1
    assert rolls[0].t == pytest.approx(6 / (7 * 0.2 * G), rel=1e-6)
    assert run["dot(ball_x)"][-1] == pytest.approx(15 / 7, rel=1e-6)
    assert run["dot(ball_a)"][-1] == pytest.approx(-150 / 7, rel=1e-6)


def test_a_spinning_ball_bounces_back():
    """With spin backwards it turns round: tangential impulse min(mu (1 + e) v, 2/7 of the slip) per mass."""
    m = Model("backspin", gravity=(0, "-9.81 m/s^2"))
    e, mu, v, spin = 0.8, 0.3, 1.0, 60.0
    planar_body(m, "ball", {"sphere": [0.1]}, (0.0, 0.6, 0.0), (v, 0.0, spin), inertia=0.004)
    m.contact("floor", body="ball", friction=mu, restitution=e)
    run = m.derive().run(t_end=0.4, method="dop853")
    down, slip = np.sqrt(2 * G * 0.5), v + 0.1 * spin
    jump = min(mu * (1 + e) * down, 2 / 7 * slip)
    after = run.events[0].v_after
    np.testing.assert_allclose(after, [v - jump, e * down, spin - jump * 0.1 / 0.004], rtol=1e-8)


def test_a_block_slides_or_tips():
    """A block that is 0.1 wide and 0.3 high tips on a slope of 30 degrees if it sticks, and slides if it does not."""
    shape = {"box": [0.1, 0.3, 0.1]}
    slides = slope(0.2, 30, shape, 0.15, 0.01).derive().run(t_end=0.05)
    lean = np.pi / 6
    a = G * (np.sin(lean) - 0.2 * np.cos(lean))
    assert slides["body_x"][-1] - slides["body_x"][0] == pytest.approx(
        a * 0.05**2 / 2 * np.cos(lean), rel=1e-6
    )
    assert np.ptp(slides["body_a"]) < 1e-12
    tips = slope(2.0, 30, shape, 0.15, 0.01).derive().run(t_end=0.1, rtol=1e-10)
    # About the lower corner, whose arm to the centre of mass leans by atan(1/3) against the slope's normal.
    arm, first = np.hypot(0.05, 0.15), lean - np.arctan2(0.05, 0.15)
    inertia = 0.01 + arm**2

    def rates(_, s):
        return [s[1], G * arm * np.sin(first + s[0]) / inertia]

    expected = solve_ivp(rates, (0, 0.1), [0, 0], rtol=1e-11, atol=1e-13).y[0, -1]
    assert tips["body_a"][0] - tips["body_a"][-1] == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_a_stack_stands():
    m = Model("stack", gravity=(0, "-9.81 m/s^2"))
    below = "world"
    for k in range(3):
        planar_body(m, f"b{k}", {"box": [0.4, 0.2, 0.1]}, (0.02 * k, 0.1 + 0.2 * k, 0.0))
        m.frame(f"top{k}", body=f"b{k}", at=(0, 0.1))
        m.contact(f"c{k}", body=f"b{k}", plane=below, restitution=0.1, friction=0.5)
        below = f"top{k}"
    run = m.derive().run(t_end=0.5, method="dop853")
    assert run.ok
    np.testing.assert_allclose(run.states[-1], run.states[0], atol=1e-10)
    # The forces between them bear what is above.
    forces = [run[f"force(c{k}_1)"][-1] + run[f"force(c{k}_3)"][-1] for k in range(3)]
    np.testing.assert_allclose(forces, [3 * G, 2 * G, G], rtol=1e-9)


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_a_compliant_ball_bounces_as_hunt_and_crossley_say(method):
    m = Model("rubber", gravity=(0, 0, "-9.81 m/s^2"))
    free_body(m, "ball", {"sphere": [0.1]}, (0, 0, 0.6, 1, 0, 0, 0))
    m.contact("floor", body="ball", stiffness="1e5 N/m^1.5", damping="0.2 s/m")
    run = m.derive().run(t_end=0.6, method=method, rtol=1e-10, atol=1e-12)

    def rates(_, s):
        depth = max(0.1 - s[0], 0.0)
        return [s[1], max(1e5 * depth**1.5 * (1 - 0.3 * s[1]), 0.0) - G]

    expected = solve_ivp(rates, (0, 0.6), [0.6, 0], "Radau", rtol=1e-11, atol=1e-13, max_step=1e-3).y[:, -1]
    assert run.ok
    np.testing.assert_allclose(
        [run["ball_free_z"][-1], run["ball_free_vz"][-1]], expected, rtol=1e-5, atol=1e-6
    )


def test_compliant_friction_acts_in_the_plane():
    """Thrown along a diagonal with no spin, it rolls at 5/7 of the speed in that direction."""
    m = Model("bowl3", gravity=(0, 0, "-9.81 m/s^2"))
    radius, depth = 0.1, (9.81 / 1e6) ** (1 / 1.5)
    m.body("ball", mass=1.0, inertia=[0.004] * 3, shape={"sphere": [radius]})
    m.joint(
        "free",
        type="free",
        child="ball",
        start=(0, 0, radius - depth, 1, 0, 0, 0),
        rate=(1.2, 1.6, 0, 0, 0, 0),
    )
    m.contact("lane", body="ball", stiffness=1e6, damping=0.5, friction=0.3, smooth="1e-4 m/s")
    run = m.derive().run(t_end=1.0, method="radau5")
    assert run.ok
    np.testing.assert_allclose(run.states[-1, 7:9], [1.2 * 5 / 7, 1.6 * 5 / 7], rtol=1e-3)


def test_billiard_balls_part_at_right_angles():
    m = Model("billiards")
    for name, start, rate in (("a", (0, 0, 0), (1.0, 0, 0)), ("b", (1.0, 0.1, 0), (0, 0, 0))):
        planar_body(m, name, {"sphere": [0.1]}, start, rate, inertia=0.004)
    m.contact("hit", body="a", other="b", restitution=1.0)
    run = m.derive().run(t_end=2.0, method="dop853")
    v = run.states[-1, 6:]
    along = np.array([np.sqrt(0.2**2 - 0.1**2), 0.1]) / 0.2
    assert v[:2] @ v[3:5] == pytest.approx(0.0, abs=1e-10)
    np.testing.assert_allclose(v[3:5], along[0] * along, rtol=1e-9)


def test_a_mesh_touches_with_the_corners_of_its_hull(tmp_path):
    write_hull(tmp_path / "box.stl", box_corners(EDGES))
    found = []
    for shape in ({"mesh": "box.stl"}, {"box": EDGES}):
        m = Model("meshed", gravity=(0, 0, "-9.81 m/s^2"), folder=tmp_path)
        free_body(m, "body", shape, (0, 0, 0.4, 0.9, 0.3, -0.2, 0.245), (0, 0, 0, 3.0, 1.0, -2.0))
        m.contact("floor", body="body", restitution=0.5)
        found.append(m.derive().run(t_end=0.5, method="dop853").states[-1])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9, atol=1e-9)


STONE = np.array(
    [[0.13, 0.02, -0.05], [-0.11, 0.07, -0.06], [-0.02, -0.12, -0.04], [0.03, 0.05, 0.14], [0.1, -0.08, 0.06]]
)
WEDGE = np.array([[x, y, z] for x in (-0.2, 0.2) for y, z in ((-0.1, -0.05), (0.15, -0.04), (0.0, 0.2))])


@pytest.mark.parametrize("other", ["mesh", "box"])
def test_corners_of_meshes_are_outside_by_the_largest_distance_from_a_side(other, tmp_path):
    """Planes of the sides are those of Qhull, at places that are turned by SciPy."""
    second = WEDGE if other == "mesh" else box_corners(EDGES)
    m = Model("stones", folder=tmp_path)
    for name, corners in (("a", STONE), ("b", second)):
        write_hull(tmp_path / f"{name}.stl", corners)
        free_body(
            m, name, {"box": EDGES} if corners is second and other == "box" else {"mesh": f"{name}.stl"}
        )
    m.contact("hit", body="a", other="b", restitution=0.5)
    system, rng = m.derive(), np.random.default_rng(6)
    for _ in range(8):
        poses = [random_pose(rng, 0.2) for _ in range(2)]
        (p, q), (turn_p, turn_q) = ([pose[:3] for pose in poses], [matrix(pose) for pose in poses])

        def away(corners, turn, place, of, back, origin):
            there = ((corners @ turn.T + place) - origin) @ back
            planes = ConvexHull(of).equations
            return (there @ planes[:, :3].T + planes[:, 3]).max(axis=1)

        expected = [*away(STONE, turn_p, p, second, turn_q, q), *away(second, turn_q, q, STONE, turn_p, p)]
        found = gaps(system, np.concatenate([*poses, np.zeros(12)]))
        np.testing.assert_allclose(sorted(found), sorted(expected), atol=1e-12)


@pytest.mark.parametrize(
    "table, first",
    [
        ("mesh", True),
        ("box", False),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in (("mesh", False), ("box", True))),
    ],
)
def test_a_mesh_tumbles_on_a_solid_as_newton_and_euler_say(first, table, tmp_path):
    """As over the plane of its upper side, by a rigid-body code of its own, with friction."""
    m = Model("stone", gravity=(0, 0, "-9.81 m/s^2"), folder=tmp_path)
    turn = np.array([0.9, 0.3, -0.2, 0.1]) / np.linalg.norm([0.9, 0.3, -0.2, 0.1])
    start, rate = np.array([0, 0, 1, *turn]), np.array([0.5, 0.2, 0.0, 3.0, 1.0, -2.0])
    write_hull(tmp_path / "stone.stl", STONE)
    write_hull(tmp_path / "table.stl", box_corners((8, 8, 0.4)))
    free_body(m, "stone", {"mesh": "stone.stl"}, start.tolist(), rate.tolist())
    m.body("table", mass=1, shape={"box": [8, 8, 0.4]} if table == "box" else {"mesh": "table.stl"})
    m.joint("held", type="fixed", child="table", origin={"xyz": [0, 0, -0.2]})
    names = ("stone", "table") if first else ("table", "stone")
    m.contact("hit", body=names[0], other=names[1], restitution=0.6, friction=0.3)
    run = m.derive().run(t_end=1.2, rtol=1e-11, atol=1e-12, method="dop853")
    fall = Fall(1.0, np.array([0.02, 0.03, 0.04]), STONE, 0.6, 0.3)
    found, after = fall.impacts(np.concatenate([start, rate]), 4, 5.0)
    own = [e for e in run.events if e.action == "impact"][:4]
    np.testing.assert_allclose([e.t for e in own], [t for t, _ in found], rtol=1e-8)
    np.testing.assert_allclose(own[-1].v_after, after[7:], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("stiffness", [None, 1e5])
@pytest.mark.parametrize(
    ("shape", "least"), [({"box": [0.4, 0.4, 0.1]}, 0.05), ({"capsule": [0.05, 0.4]}, 0.05)]
)
def test_where_a_surface_comes_up_between_corners_a_run_ends_with_that_reason(shape, least, stiffness):
    """A box came to rest on its corners, with the top of a hill through its bottom, and nothing was said."""
    lies = (np.cos(np.pi / 4), 0, np.sin(np.pi / 4), 0) if "capsule" in shape else (1, 0, 0, 0)
    m = Model("hill", gravity=(0, 0, "-9.81 m/s^2"))
    free_body(m, "body", shape, (0, 0, 0.2, *lies))
    m.contact("ground", body="body", height="-0.5*here_x**2 - 0.5*here_y**2", stiffness=stiffness)
    system = m.derive()
    run = system.run(t_end=1.0, method="dop853")
    share = 1e-3 if stiffness is None else 0.05
    assert run.status == "terminated" and "the surface comes up between" in run.message
    assert run.t[-1] == pytest.approx(np.sqrt(2 * (0.15 + share * least) / G), rel=1e-6)
    with pytest.raises(RuntimeModelError, match=r"comes up between .* begin with them apart"):
        system.run(t_end=0.1, start={"body_free_z": 0.04})


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("beam", ["mesh", "box"])
@pytest.mark.parametrize("stiffness", [None, 1e5])
def test_where_edges_of_meshes_cross_a_run_ends_with_that_reason(first, beam, stiffness, tmp_path):
    m = Model("cross", gravity=(0, 0, "-9.81 m/s^2"), folder=tmp_path)
    write_hull(tmp_path / "plank.stl", box_corners((1.0, 0.1, 0.1)))
    write_hull(tmp_path / "beam.stl", box_corners((0.1, 1.0, 0.1)))
    free_body(m, "plank", {"mesh": "plank.stl"}, (0, 0, 0.3, 1, 0, 0, 0))
    m.body("beam", mass=1, shape={"box": [0.1, 1.0, 0.1]} if beam == "box" else {"mesh": "beam.stl"})
    m.joint("held", type="fixed", child="beam")
    names = ("plank", "beam") if first else ("beam", "plank")
    m.contact("hit", body=names[0], other=names[1], stiffness=stiffness)
    run = m.derive().run(t_end=1.0, method="dop853")
    share = 1e-3 if stiffness is None else 0.05
    assert run.t[-1] == pytest.approx(np.sqrt(2 * (0.2 + share * 0.05) / G), rel=1e-6)
    assert run.events[-1].name == "hit_edges" and run.events[-1].action == "terminate"


@pytest.mark.parametrize("first", [True, False])
def test_a_sphere_is_as_far_from_a_mesh_as_a_search_finds(first, tmp_path):
    """Over sides, edges and corners, by weights of the corners; inside by the planes of Qhull."""
    m = Model("ball_and_stone", folder=tmp_path)
    write_hull(tmp_path / "stone.stl", STONE)
    free_body(m, "stone", {"mesh": "stone.stl"})
    free_body(m, "ball", {"sphere": [0.05]})
    names = ("ball", "stone") if first else ("stone", "ball")
    m.contact("hit", body=names[0], other=names[1], restitution=0.5)
    system, rng, planes = m.derive(), np.random.default_rng(8), ConvexHull(STONE).equations
    inside = []
    for k in range(60):
        stone, ball = random_pose(rng, 0.2), random_pose(rng, 0.2 if k % 4 else 0.02)
        if not k % 4:
            ball[:3] += stone[:3] + matrix(stone) @ STONE.mean(axis=0)
        there = matrix(stone).T @ (ball[:3] - stone[:3])
        depth = (planes[:, :3] @ there + planes[:, 3]).max()
        inside.append(depth <= 0.0)
        if depth > 0.0:  # weights that add up to one, all of them held by a heavy row
            rows, goal = np.vstack([STONE.T, np.full(len(STONE), 1e3)]), np.append(there, 1e3)
            weights = lsq_linear(rows, goal, (0, 1), tol=1e-15, method="bvls").x
            depth = np.linalg.norm(STONE.T @ (weights / weights.sum()) - there)
        (found,) = gaps(system, np.concatenate([stone, ball, np.zeros(12)]))
        assert found == pytest.approx(depth - 0.05, abs=1e-6 if depth > 0.0 else 1e-12)
    assert 5 < sum(inside) < 50


@pytest.mark.parametrize("stiffness", [None, "1e5 N/m^1.5"])
def test_a_ball_runs_over_a_mesh_as_over_a_box(stiffness, tmp_path):
    """It bounces on the upper side, rubs, and falls over the edge of it: a box is touched by clamping."""
    runs = []
    for shape in ({"mesh": "table.stl"}, {"box": [0.8, 8, 0.4]}):
        m = Model("table", gravity=(0, 0, "-9.81 m/s^2"), folder=tmp_path)
        write_hull(tmp_path / "table.stl", box_corners((0.8, 8, 0.4)))
        free_body(m, "ball", {"sphere": [0.1]}, (0.2, 0.1, 0.12, 1, 0, 0, 0), (0.4, 0.1, 0, 0, 2.0, 0))
        m.body("table", mass=1, shape=shape)
        m.joint("held", type="fixed", child="table", origin={"xyz": [0, 0, -0.2], "rpy": [0, 0, 0.1]})
        more = {"restitution": 0.3} if stiffness is None else {"stiffness": stiffness, "smooth": 1e-3}
        m.contact("hit", body="ball", other="table", friction=0.2, **more)
        runs.append(m.derive().run(t_end=1.0, rtol=1e-10, method="dop853", max_step=0.01))
    assert all(run.ok for run in runs) and runs[0]["ball_free_z"].min() < 0.05
    for name in ("ball_free_x", "ball_free_y", "ball_free_z"):
        assert runs[0][name][-1] == pytest.approx(runs[1][name][-1], abs=1e-7)


@pytest.mark.parametrize("first", [True, False])
def test_a_capsule_is_as_far_from_a_mesh_as_a_search_finds(first, tmp_path):
    """By weights of the corners of the hull and of both ends of the core; what lies on a side has two gaps there."""
    m = Model("log_and_stone", folder=tmp_path)
    write_hull(tmp_path / "stone.stl", STONE)
    free_body(m, "stone", {"mesh": "stone.stl"})
    free_body(m, "log", {"capsule": [0.05, 0.4]})
    names = ("log", "stone") if first else ("stone", "log")
    m.contact("hit", body=names[0], other=names[1], restitution=0.5)
    system, rng, n_apart = m.derive(), np.random.default_rng(9), 0
    for _ in range(60):
        stone, log = random_pose(rng, 0.2), random_pose(rng, 0.25)
        ends = log[:3] + np.outer((-0.2, 0.2), matrix(log)[:, 2])
        corners = stone[:3] + STONE @ matrix(stone).T
        n = len(corners)
        heavy = np.zeros((2, n + 2))
        heavy[0, :n] = heavy[1, n:] = 1e3
        rows = np.vstack([np.hstack([corners.T, -ends.T]), heavy])
        weights = lsq_linear(rows, [0, 0, 0, 1e3, 1e3], (0, 1), tol=1e-15, method="bvls").x
        own, other = weights[:n] / weights[:n].sum(), weights[n:] / weights[n:].sum()
        depth = np.linalg.norm(own @ corners - other @ ends)
        if depth > 1e-4:
            n_apart += 1
            found = gaps(system, np.concatenate([stone, log, np.zeros(12)]))
            assert found.min() == pytest.approx(depth - 0.05, abs=1e-6)
    assert n_apart > 25


@pytest.mark.parametrize("stiffness", [None, "1e5 N/m^1.5"])
@pytest.mark.slow
def test_a_capsule_falls_on_a_mesh_as_on_a_box(stiffness, tmp_path):
    """A box has gaps of its own, by clamping; it bounces on two edges and turns; where it gives way, it rubs."""
    runs = []
    for shape in ({"mesh": "beam.stl"}, {"box": [0.2, 8, 0.4]}):
        m = Model("beam", gravity=(0, 0, "-9.81 m/s^2"), folder=tmp_path)
        write_hull(tmp_path / "beam.stl", box_corners((0.2, 8, 0.4)))
        turn = Rotation.from_euler("xyz", [0.1, np.pi / 2 - 0.1, 0.2]).as_quat()[[3, 0, 1, 2]]
        free_body(m, "log", {"capsule": [0.05, 0.6]}, (0.02, 0.1, 0.2, *turn), (0.1, 0.2, 0, 0, 0, 1.0))
        m.body("beam", mass=1, shape=shape)
        m.joint("held", type="fixed", child="beam", origin={"xyz": [0, 0, -0.2]})
        rubs = {"stiffness": stiffness, "friction": 0.2, "smooth": 1e-3}
        m.contact("hit", body="log", other="beam", **(rubs if stiffness else {"restitution": 0.3}))
        runs.append(m.derive().run(t_end=0.5, rtol=1e-10, method="dop853", max_step=0.01))
    assert all(run.ok for run in runs)
    assert abs(runs[0]["log_free_x"][-1] - 0.07) > 0.005  # it was touched
    for name in ("log_free_x", "log_free_y", "log_free_z", "log_free_qw", "log_free_qz"):
        assert runs[0][name][-1] == pytest.approx(runs[1][name][-1], abs=1e-7)


def test_meshes_of_many_corners_are_refused_with_a_remedy(tmp_path):
    turns = np.random.default_rng(1).normal(size=(32, 3))
    write_hull(tmp_path / "ball.stl", turns / np.linalg.norm(turns, axis=1)[:, None])
    for other, says in (
        ({"mesh": "ball.stl"}, "the most are 1200"),
        ({"capsule": [0.1, 0.3]}, "the most are 160"),
    ):
        m = Model("balls", folder=tmp_path)
        free_body(m, "a", {"mesh": "ball.stl"})
        free_body(m, "b", other)
        m.contact("hit", body="a", other="b")
        with pytest.raises(ModelError, match=says):
            m.describe()


TEXT = """
[coordinates]
x = { unit = "m", start = 0 }
y = { unit = "m", start = 1 }
a = {}

[parameters]
mu = 0.3
r = "0.1 m"

[bodies.box]
mass = "1 kg"
inertia = "0.01 kg*m^2"
com = ["x", "y"]
angle = "a"
shape = { box = [0.4, 0.2, 0.1] }

[gravity]
y = "-9.81 m/s^2"

[tables.land]
columns = [[0, 1], [0, 0.1]]
kind = "cubic"
outside = "extend"

[tables.short]
columns = [[0, 1], [0, 0.1]]
kind = "pchip"

[contacts.floor]
body = "box"
"""


@pytest.mark.parametrize(
    "lines",
    [
        "restitution = 0.5\nfriction = \"mu\"\nstatic = 0.4",
        "shape = { sphere = [\"r\"], offset = [0.1, 0] }\nheight = \"0.1*sin(here_x/r)\"",
        "stiffness = \"1e5 N/m^1.5\"\ndamping = \"0.2 s/m\"\nfriction = 0.3\nsmooth = \"1 mm/s\"",
    ],
)  # fmt: skip
def test_text_and_builder_say_the_same(lines):
    model = read_text(TEXT + lines)
    again = read_text(model.to_toml())
    assert again.to_toml() == model.to_toml()
    assert again.describe() == model.describe()


@pytest.mark.parametrize(
    "lines, says",
    [
        ("gap = \"y\"", "'gap' follows from the shape"),
        ("plane = \"flor\"", "there is no frame 'flor'"),
        ("other = \"ball\"", "there is no body 'ball'"),
        ("other = \"world\"", "write plane = \"world\" in place of 'other'"),
        ("plane = \"box\"", "'box' would touch itself"),
        ("other = \"box\"", "'box' would touch itself"),
        ("damping = 0.2", "'damping' has no effect in a contact that has no 'stiffness'"),
        ("stiffness = 1e5\nrestitution = 0.5", "'restitution' has no effect in a contact that has a 'stiffness'"),
        ("stiffness = 1e5\nfriction = 0.5", "needs 'smooth'"),
        ("static = 0.5", "'static' goes with a coefficient of 'friction'"),
        ("restitution = 1.5", "the restitution is 1.5"),
        ("restitution = \"r\"", "units do not match"),
        ("stiffness = \"1e5 N/m\"", "units do not match"),
        ("shape = { cone = [0.1, 0.2] }", "a cone of 'box' is no shape that touches"),
        ("height = \"abs(here_x)\"", "is not known"),
        ("height = \"short(here_x)\"\nshape = { sphere = [0.1] }", "beyond the ends of 'short', which refuses"),
        ("height = \"x\"", "cannot depend on a coordinate"),
        ("height = \"here_z\"", "here_z"),
        ("bodies = \"box\"", "unknown key"),
    ],
)  # fmt: skip
def test_what_cannot_touch_is_refused(lines, says):
    with pytest.raises(ModelError, match="contacts") as error:
        read_text(TEXT + lines).describe()
    assert says in str(error.value)


def test_too_many_corners_are_refused():
    m = Model("bumpy")
    shapes = [{"sphere": [0.01], "offset": [0.01 * k, 0.0, 0.0]} for k in range(65)]
    free_body(m, "body", shapes)
    m.contact("floor", body="body")
    with pytest.raises(ModelError, match="65 points would touch"):
        m.describe()


def test_a_die_is_thrown_as_newton_and_coulomb_say():
    """The first impacts, and the rest on a face, with friction in both directions of the plane."""
    system = symgen.load("die")
    run = system.run(t_end=1.0, rtol=1e-10, atol=1e-12, method="dop853")
    a = 0.016
    mass = 1180 * a**3
    fall = Fall(mass, np.full(3, mass * a**2 / 6), box_corners((a, a, a)), 0.55, 0.25)
    found, _ = fall.impacts(run.states[0], 5, 1.0)
    assert [e.name for e in run.events[:5]] == [f"table_{k + 1}" for _, k in found]
    np.testing.assert_allclose([e.t for e in run.events[:5]], [t for t, _ in found], rtol=1e-6)
    assert max(e.energy_change for e in run.events) <= 1e-15
    up = np.abs(rotation(run.states[-1]).as_matrix()[2])
    assert up.max() == pytest.approx(1.0, abs=1e-9) and run.states[-1, 2] == pytest.approx(a / 2, abs=1e-9)
    assert np.abs(run.states[-1, 7:]).max() < 1e-9


def test_newtons_cradle_swings_as_pendulums_do():
    """Two balls come and two fly off, after a quarter of a pendulum's period and every half one from there on."""
    run = symgen.load("newtons_cradle").run(t_end=1.2)
    period = 4 * np.sqrt(0.15 / 9.81) * ellipk(np.sin(0.3) ** 2)
    assert run.ok
    times = sorted({round(e.t, 7) for e in run.events if e.name in ("hit23", "hit34")})
    np.testing.assert_allclose(times[:3], period * np.array([0.25, 0.75, 1.25]), rtol=1e-6)
    at = int(np.argmin(np.abs(run.t - period / 2)))
    np.testing.assert_allclose(run.q[at], [0, 0, 0, 0.6, 0.6], atol=2e-3)


def test_a_ball_rolls_over_hills_with_the_energy_that_it_has():
    """Without slipping, from rest: 7/10 m v^2 is what it has fallen (planar, I = 2/5 m r^2)."""
    m = Model("rolls", gravity=(0, "-9.81 m/s^2"))
    radius, at = 0.05, 0.3
    length = np.hypot(1.0, 0.4 * np.sin(0.6))
    start = (at + radius * 0.4 * np.sin(0.6) / length, 0.2 * np.cos(0.6) + radius / length, 0.0)
    planar_body(m, "ball", {"sphere": [radius]}, start, inertia=0.4 * radius**2)
    m.contact("ground", body="ball", height="0.2*cos(2*here_x)", friction=0.9)
    run = m.derive().run(t_end=0.5, method="dop853", rtol=1e-10, atol=1e-12)
    assert run.ok
    fallen = start[1] - run["ball_y"][-1]
    speed = run.v[-1, :2]
    assert fallen > 0.05 and 0.7 * speed @ speed == pytest.approx(G * fallen, rel=1e-7)


def test_a_ball_rubs_on_a_box():
    """Planar: on the upper side of a fixed box, as on a plane."""
    found = []
    for on_box in (True, False):
        m = Model("table", gravity=(0, "-9.81 m/s^2"))
        planar_body(m, "ball", {"sphere": [0.1]}, (0.0, 0.3, 0.0), (1.0, 0.0, 0.0), inertia=0.004)
        m.body(
            "table",
            mass=1.0,
            shape={"box": [4.0, 0.2, 0.1]},
            com=(m.coordinate("x", unit="m"), -0.1),
        )
        m.constraint("fixed", sympy.Symbol("x"))
        against = {"other": "table"} if on_box else {}
        m.contact("hit", body="ball", friction=0.2, restitution=0.3, **against)
        run = m.derive().run(t_end=0.8, method="dop853")
        assert run.ok and run["dot(ball_x)"][-1] == pytest.approx(5 / 7, rel=1e-9)  # it rolls
        found.append(run.states[-1])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-7, atol=1e-9)


def test_assemblies_have_contacts_of_their_own():
    def ball(m: Model) -> Model:
        r = m.parameter("r", "0.1 m")
        planar_body(m, "ball", {"sphere": [r]}, (0.0, 0.5, 0.0), (0.3, 0.0, 0.0), inertia=0.004)
        m.contact("floor", body="ball", height="0.1*cos(here_x/r/5)", restitution=0.5, friction=0.2)
        return m

    alone = ball(Model("alone", gravity=(0, "-9.81 m/s^2"))).derive().run(t_end=0.6, method="dop853")
    m = Model("both", gravity=(0, "-9.81 m/s^2"))
    ball(m.assembly("ball"))
    m.use("one", "ball")
    m.use("two", "ball", offset=(5.0, 1.0))
    run = m.derive().run(t_end=0.6, method="dop853")
    assert {e.name for e in run.events} == {"one.floor", "two.floor"}
    np.testing.assert_allclose(run.q[-1], [*alone.q[-1], *alone.q[-1]], rtol=1e-6, atol=1e-7)


_LONG = ("stones", "rods", "spun", "ledge")  # to derive: stones and rods most of a minute


@pytest.mark.parametrize(
    "kind",
    [pytest.param(kind, marks=[pytest.mark.slow] if kind in _LONG else []) for kind in KINDS],
)
def test_random_bodies_that_are_thrown(kind):
    """A part of `python -m tests.stress.contact_shapes`."""
    counts, said = try_many(kind, ["dop853"], range(2), seed=3)
    assert counts["dop853"][WRONG] == 0 and counts["dop853"][RIGHT] >= 1, said


@pytest.mark.parametrize(
    "changed",
    [{"friction": 0.25}, {"friction": 0.15}, {"restitution": 0.91}, {"restitution": 0.89}, {"lean": 1e-3}],
)
def test_the_judge_of_thrown_bodies_objects_to_other_laws(changed):
    m, about = thrown("planar", np.random.default_rng([7, 0, 0]))
    assert (about.friction, about.restitution, about.lean) == (0.2, 0.9, 0.0)
    run = m.derive().run(t_end=0.6, fps=250, method="dop853")
    assert objection(run, about, 1e-5) == ""
    assert objection(run, replace(about, **changed), 1e-5)


@pytest.mark.parametrize(
    "method", ["dop853", *(pytest.param(name, marks=pytest.mark.slow) for name in ("radau5", "rk4"))]
)
def test_a_run_that_is_cut_and_watched_is_the_same(method, tmp_path):
    """In flight, while it slides and at rest; frames and extra times change no bit of it, and no event."""
    more = {"method": method, **({"step": 1e-3} if method == "rk4" else {})}
    start = (0, 0, 0.25, 0.8, 0.42, 0.36, 0.23)
    m = Model("tumbling", gravity=(0, 0, "-9.81 m/s^2"))
    free_body(m, "box", {"box": EDGES}, start, (0.5, 0.2, 0.0, 3.0, 1.0, -2.0))
    m.contact("floor", body="box", restitution=0.4, friction=0.3)
    text = derive_text(m).text
    model = load(text)
    whole = record(tmp_path / "whole.rrd", text, lambda **log: solve(model, 0.9, fps=60, **more, **log))
    assert len(whole.events) > 8
    for part in (0.1, 0.5, 0.8):
        few = int(part * whole.stats["steps"])
        cut = functools.partial(solve, model, 0.9, fps=60, max_steps=few, **more)
        record(tmp_path / f"cut{few}.rrd", text, cut)
        rest = tmp_path / f"rest{few}.rrd"
        gone_on = record(rest, text, Resumed(tmp_path / f"cut{few}.rrd").run)
        assert_same_recording(tmp_path / "whole.rrd", rest)
        assert gone_on.stats == whole.stats
    for looked in ({"fps": 7}, {"fps": 1000}, {"fps": 60, "at": [0.05, 0.3, 0.3000001, 0.71]}):
        again = solve(model, 0.9, **looked, **more)
        np.testing.assert_array_equal(again.states[-1], whole.states[-1])
        assert [(e.t, e.name, e.action) for e in again.events] == [
            (e.t, e.name, e.action) for e in whole.events
        ]
    says = verify(tmp_path / "whole.rrd")
    assert says.ok, says


# Boxes on boxes.


def outside(edges, place: np.ndarray) -> float:
    return float((np.abs(place) - np.array(edges) / 2).max())


@pytest.mark.slow
def test_corners_of_boxes_are_outside_of_the_other_box_by_the_largest_of_three():
    other = (0.25, 0.4, 0.15)
    m = Model("boxes")
    free_body(m, "a", {"box": EDGES})
    free_body(m, "b", {"box": other})
    m.contact("hit", body="a", other="b", restitution=0.5)
    system, rng = m.derive(), np.random.default_rng(5)
    for _ in range(6):
        poses = [random_pose(rng, 0.2) for _ in range(2)]
        (p, q), (turn_p, turn_q) = ([pose[:3] for pose in poses], [matrix(pose) for pose in poses])
        expected = [outside(other, turn_q.T @ (p + turn_p @ c - q)) for c in box_corners(EDGES)]
        expected += [outside(EDGES, turn_p.T @ (q + turn_q @ c - p)) for c in box_corners(other)]
        found = gaps(system, np.concatenate([*poses, np.zeros(12)]))[:8]
        # Of each two that are opposite to each other one.
        apart = np.abs(found[:, None] - np.array(expected))
        assert apart.min(axis=1).max() < 1e-14 and len(set(apart.argmin(axis=1))) == 8


@pytest.mark.parametrize("first", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_box_tumbles_on_a_box_as_newton_and_euler_say(first):
    """As over the plane of its upper side, by the same oracle, whichever of the two is the `body`."""
    m = Model("tumbling", gravity=(0, 0, "-9.81 m/s^2"))
    start = np.concatenate(
        [[0, 0, 1], np.array([0.9, 0.3, -0.2, 0.1]) / np.linalg.norm([0.9, 0.3, -0.2, 0.1])]
    )
    rate = np.array([0.5, 0.2, 0.0, 3.0, 1.0, -2.0])
    free_body(m, "box", {"box": EDGES}, start.tolist(), rate.tolist())
    m.body("table", mass=1, shape={"box": [8, 8, 0.4]})
    m.joint("held", type="fixed", child="table", origin={"xyz": [0, 0, -0.2]})
    names = ("box", "table") if first else ("table", "box")
    m.contact("hit", body=names[0], other=names[1], restitution=0.6)
    run = m.derive().run(t_end=1.6, rtol=1e-11, atol=1e-12, method="dop853")
    fall = Fall(1.0, np.array([0.02, 0.03, 0.04]), box_corners(EDGES), 0.6)
    found, after = fall.impacts(np.concatenate([start, rate]), 7, 5.0)
    np.testing.assert_allclose([e.t for e in run.events[:7]], [t for t, _ in found], rtol=1e-8)
    np.testing.assert_allclose(run.events[6].v_after, after[7:], rtol=1e-5, atol=1e-6)


def falling_on_its_corner() -> Model:
    m = Model("two", gravity=(0, 0, "-9.81 m/s^2"))
    q = np.array([0.9, 0.3, -0.2, 0.1]) / np.linalg.norm([0.9, 0.3, -0.2, 0.1])
    free_body(m, "base", {"box": [0.5, 0.4, 0.2]}, (0, 0, 0.1, 1, 0, 0, 0))
    free_body(m, "top", {"box": [0.3, 0.2, 0.1]}, (0.05, 0.02, 0.5, *q), (0, 0, 0, 1.0, 0, 0))
    m.contact("floor", body="base", restitution=0.2)
    m.contact("hit", body="top", other="base", restitution=0.3)
    return m


@pytest.mark.slow
def test_a_box_that_falls_on_its_corner_comes_to_rest_on_a_box():
    """The two exchange an impulse by Newton's law, whose size is found again, and stand on each other in the end."""
    run = falling_on_its_corner().derive().run(t_end=1.5, method="dop853")
    assert run.ok, [check.says for check in run.objections]
    hit = next(e for e in run.events if e.name.startswith("hit"))
    # The floor bears the base: the box bounces off as from a body of no end of mass.
    turn = matrix(hit.q_before[7:])
    arms = box_corners((0.3, 0.2, 0.1)) @ turn.T
    arm = arms[arms[:, 2].argmin()]
    assert hit.q_before[9] + arm[2] == pytest.approx(0.2, abs=1e-9)
    inverse = np.linalg.inv(turn @ np.diag([0.02, 0.03, 0.04]) @ turn.T)
    up = np.array([0, 0, 1.0])
    speed = hit.v_before[8] + np.cross(turn @ hit.v_before[9:], arm)[2]
    size = -1.3 * speed / (1.0 + up @ np.cross(inverse @ np.cross(arm, up), arm))
    np.testing.assert_allclose(hit.v_after[6:9], hit.v_before[6:9] + size * up, atol=1e-9)
    spin = hit.v_before[9:] + turn.T @ inverse @ np.cross(arm, size * up)
    np.testing.assert_allclose(hit.v_after[9:], spin, atol=1e-8)
    np.testing.assert_allclose(run.q[-1, [2, 9]], [0.1, 0.25], atol=1e-9)
    assert np.abs(run.v[-1, :11]).max() < 1e-9  # without friction it goes on turning about the vertical


def test_a_block_tips_over_the_edge_of_another():
    """In a plane: its middle is beyond the edge, a corner of the lower one bears it, and it sticks until 0.189 s."""
    m = Model("ledge", gravity=(0, "-9.81 m/s^2"))
    planar_body(m, "block", {"box": [0.4, 0.1, 0.1]}, (0.05, 0.05, 0.0))
    m.body("table", mass=1, com=(-0.5, -0.1), shape={"box": [1.0, 0.2, 0.1]})
    m.contact("hit", body="block", other="table", friction=2.0)
    run = m.derive().run(t_end=0.18, rtol=1e-10, method="dop853")
    arm, first = np.hypot(0.05, 0.05), np.arctan2(0.05, 0.05)

    def rates(_, s):
        return [s[1], G * arm * np.sin(first + s[0]) / (0.01 + arm**2)]

    expected = solve_ivp(rates, (0, 0.18), [0, 0], rtol=1e-11, atol=1e-13).y[0, -1]
    assert run.ok and not run.events
    assert -run["block_a"][-1] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    "method, max_step", [("dop853", 1e-3), pytest.param("radau5", None, marks=pytest.mark.slow)]
)
def test_a_compliant_box_on_a_box_gives_way_at_four_corners(method, max_step):
    m = Model("soft", gravity=(0, 0, "-9.81 m/s^2"))
    free_body(m, "box", {"box": EDGES}, (0.1, 0.05, 0.1, 1, 0, 0, 0))
    m.body("table", mass=1, shape={"box": [1, 1, 0.4]})
    m.joint("held", type="fixed", child="table", origin={"xyz": [0, 0, -0.2]})
    m.contact("hit", body="box", other="table", stiffness=1e5, damping=0.5)
    system = m.derive()
    assert system.source.late == ("residual_jacobian",)  # few coordinates, and 9/10 of the derivation
    run = system.run(t_end=0.4, method=method, rtol=1e-10, atol=1e-12, max_step=max_step)

    def rates(_, s):
        depth = max(0.05 - s[0], 0.0)
        return [s[1], 4e5 * max(depth**1.5 * (1 - 0.75 * s[1]), 0.0) - G]

    expected = solve_ivp(rates, (0, 0.4), [0.1, 0], "Radau", rtol=1e-11, atol=1e-13, max_step=1e-3).y[0, -1]
    assert run.ok and run["box_free_z"][-1] == pytest.approx(expected, abs=1e-6)


# Edges of boxes that cross.


def planks(rate=(0,) * 6, place=(0, 0, 0.3), angle=0.3, **contact) -> Model:
    """One lies across the other, or falls on it: no corner is on a side."""
    m = Model("planks", gravity=(0, 0, "-9.81 m/s^2"))
    start = (*place, np.cos(angle / 2), 0, 0, np.sin(angle / 2))
    free_body(m, "plank", {"box": [1.0, 0.1, 0.1]}, start, rate)
    m.body("beam", mass=1, shape={"box": [0.1, 1.0, 0.1]})
    m.joint("held", type="fixed", child="beam")
    m.contact("hit", body="plank", other="beam", **contact)
    return m


def test_crossing_edges_are_apart_by_the_distance_of_the_boxes():
    """Against bounded least squares; where something else is nearest, no edge says that boxes touch."""
    edges, others = np.array(EDGES), np.array([0.25, 0.4, 0.15])
    m = Model("boxes")
    free_body(m, "a", {"box": edges.tolist()})
    free_body(m, "b", {"box": others.tolist()})
    m.contact("hit", body="a", other="b")
    system, rng, n = m.derive(), np.random.default_rng(1), 0
    bound = np.concatenate([edges, others]) / 2
    for _ in range(1000):
        poses = [random_pose(rng, 0.25) for _ in range(2)]
        (p, q), (turn_p, turn_q) = ([pose[:3] for pose in poses], [matrix(pose) for pose in poses])
        both = np.hstack([turn_p, -turn_q])
        x = lsq_linear(both, q - p, (-bound, bound), tol=1e-14, method="bvls").x
        distance = np.linalg.norm(both @ x - (q - p))
        if distance < 1e-6:
            continue
        found = gaps(system, np.concatenate([*poses, np.zeros(12)]))
        assert len(found) == 24 and found.min() > 0
        inside = np.abs(x) < bound - 1e-9
        if inside[:3].sum() == inside[3:].sum() == 1 and distance < 0.03:
            assert found[8:].min() == pytest.approx(distance, abs=1e-14)
            n += 1
    assert n > 30


@pytest.mark.parametrize("method", ["dop853", "radau5"])
@pytest.mark.slow
def test_planks_that_cross_bounce_and_come_to_rest(method):
    run = planks(restitution=0.5).derive().run(t_end=1.0, method=method)
    assert run.ok, [check.says for check in run.objections]
    first = np.sqrt(2 * 0.2 / G)
    hits = [first, 2 * first, 2.5 * first]  # half the speed, half the time in the air
    assert all(e.name in ("hit_9", "hit_11", "hit_17", "hit_19") for e in run.events)
    np.testing.assert_allclose([e.t for e in run.events[:12]], np.repeat(hits, 4), rtol=1e-7)
    assert run["plank_free_z"][-1] == pytest.approx(0.1, abs=1e-12)
    assert np.abs(run.v[-1]).max() < 1e-12 and run.energy.max_error < 1e-6
    assert run.contact_forces[-1, 8:24].sum() == pytest.approx(G, rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.4])
@pytest.mark.slow
def test_a_plank_that_slides_on_edges_is_slowed_down_by_friction(angle):
    along = np.array([np.cos(angle), np.sin(angle)])
    model = planks((*0.4 * along, 0, 0, 0, 0), (0, 0, 0.1), angle, friction=0.3)
    run = model.derive().run(t_end=0.1, method="dop853")
    assert run.ok and not run.events
    np.testing.assert_allclose(run.q[-1, :2], (0.04 - 0.3 * G * 0.1**2 / 2) * along, atol=1e-12)
    np.testing.assert_allclose(run.v[-1, :2], (0.4 - 0.3 * G * 0.1) * along, atol=1e-12)
    assert run["plank_free_z"][-1] == pytest.approx(0.1, abs=1e-12)


@pytest.mark.slow
def test_a_plank_that_spins_stands_on_the_places_where_edges_cross():
    run = planks((0, 0, 0, 0, 0, 2.0), (0, 0, 0.1), 0.4).derive().run(t_end=0.4, method="dop853")
    assert run.ok and run["plank_free_z"][-1] == pytest.approx(0.1, abs=1e-12)
    assert 2 * np.arctan2(run.q[-1, 6], run.q[-1, 3]) == pytest.approx(0.4 + 2 * 0.4, rel=1e-9)


@pytest.mark.slow
def test_a_plank_that_gives_way_stands_on_four_edges():
    model = planks(place=(0, 0, 0.12), stiffness=1e5, damping=0.5)
    run = model.derive().run(t_end=0.3, method="dop853", rtol=1e-10, atol=1e-12, max_step=1e-3)

    def rates(_, s):
        depth = max(0.1 - s[0], 0.0)
        return [s[1], 4e5 * max(depth**1.5 * (1 - 0.75 * s[1]), 0.0) - G]

    expected = solve_ivp(rates, (0, 0.3), [0.12, 0], "Radau", rtol=1e-11, atol=1e-13, max_step=1e-3).y[0, -1]
    assert run.ok and run["plank_free_z"][-1] == pytest.approx(expected, abs=1e-6)


@pytest.mark.slow
def test_an_edge_that_falls_on_an_edge_off_the_middle_exchanges_the_impulse_of_newton():
    """Two free boxes on edge: j = -(1 + e) (v n)/(n K n), with the inertias of both at the place where they meet."""
    m = Model("edges")
    on_edge = Rotation.from_euler("x", 40, degrees=True)
    across = Rotation.from_euler("z", 70, degrees=True) * Rotation.from_euler("x", 50, degrees=True)
    pose = lambda place, turn: (*place, *np.roll(turn.as_quat(), 1))  # noqa: E731
    free_body(m, "low", {"box": [1.0, 0.2, 0.2]}, pose((0, 0, 0), on_edge), (0, 0, 0.1, 0.2, 0, 0))
    free_body(m, "top", {"box": [0.8, 0.2, 0.2]}, pose((0.2, 0.1, 0.35), across), (0, 0.1, -1.0, 0, 0, 0.3))
    m.contact("hit", body="top", other="low", restitution=0.4)
    run = m.derive().run(t_end=0.2, method="dop853", rtol=1e-11, atol=1e-12)
    assert run.ok and len(run.events) == 1 and int(run.events[0].name[4:]) > 8
    q, v, after = run.events[0].q_before, run.events[0].v_before, run.events[0].v_after
    turns, middles = [matrix(q[:7]), matrix(q[7:])], [q[:3], q[7:10]]
    halves = [np.array([0.5, 0.1, 0.1]), np.array([0.4, 0.1, 0.1])]
    # The highest edge of the one and the lowest of the other, along the first axis of each.
    starts = []
    for k, (turn, half, sign) in enumerate(zip(turns, halves, (1, -1), strict=True)):
        sides = max(((b, c) for b in (-1, 1) for c in (-1, 1)), key=lambda s: sign * (turn[2, 1:] @ s))
        starts.append(middles[k] + turn[:, 1:] @ (half[1:] * sides))
    e, f = turns[0][:, 0], turns[1][:, 0]
    n = np.cross(e, f) / np.linalg.norm(np.cross(e, f))
    n *= np.sign(n[2])
    s, t, gap = np.linalg.solve(np.column_stack([e, -f, n]), starts[1] - starts[0])
    assert abs(gap) < 1e-9 and abs(s) < 0.5 and abs(t) < 0.4
    place = starts[0] + s * e
    arms = [place - middle for middle in middles]
    body = np.diag([0.02, 0.03, 0.04])
    inverse = [np.linalg.inv(turn @ body @ turn.T) for turn in turns]
    at = [v[6 * k : 6 * k + 3] + np.cross(turns[k] @ v[6 * k + 3 : 6 * k + 6], arms[k]) for k in range(2)]
    mobility = sum(1.0 + n @ np.cross(inv @ np.cross(arm, n), arm) for inv, arm in zip(inverse, arms))
    size = -1.4 * (at[1] - at[0]) @ n / mobility
    for k, sign in enumerate((-1, 1)):
        push = sign * size * n
        np.testing.assert_allclose(after[6 * k : 6 * k + 3], v[6 * k : 6 * k + 3] + push, atol=1e-8)
        spin = v[6 * k + 3 : 6 * k + 6] + turns[k].T @ inverse[k] @ np.cross(arms[k], push)
        np.testing.assert_allclose(after[6 * k + 3 : 6 * k + 6], spin, atol=1e-7)


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("first", [True, False])
@pytest.mark.slow
def test_a_plank_that_tips_over_an_edge_by_more_than_45_degrees_slides_off_it(first, friction):
    """Its edges went over to other gaps there, one of which was closed and the other hit nothing."""
    m, half = Model("tips", gravity=(0, 0, -G)), 0.02
    m.body("plank", mass=1.0, inertia=[0.0013, 0.03, 0.03], shape={"box": [0.6, 0.06, 2 * half]})
    m.joint("free", type="free", child="plank", start=[0.08, 0, 0.2 + half, 1, 0, 0, 0])
    m.body("low", mass=1.0, inertia=[1.0] * 3, shape={"box": [2 * half, 0.6, 0.2]})
    m.joint("held", type="fixed", child="low", origin={"xyz": [0, 0, 0.1]})
    names = {"body": "plank", "other": "low"} if first else {"body": "low", "other": "plank"}
    m.contact("hit", **names, **({"friction": friction} if friction else {}))
    run = m.derive().run(t_end=0.6, method="dop853", fps=200)
    assert run.ok, [check.says for check in run.objections]
    assert run["free_z"][-1] < 0.0 and not run.contact_forces[-1].any()
    if friction:
        return

    # Without friction: about the edge, s along the plank from its middle to the edge and the angle a.
    def rates(_, y):
        s, a, ds, da = y  # middle = edge - s e + half n, with e = (cos a, -sin a), n = (sin a, cos a)
        e, n = np.array([np.cos(a), -np.sin(a)]), np.array([np.sin(a), np.cos(a)])
        columns = np.column_stack(
            [-e, s * n + half * e]
        )  # of the middle's velocity by ds and da: e' = -n, n' = e
        mass = columns.T @ columns + np.diag([0.0, 0.03])
        bias = 2 * ds * da * n + da**2 * (s * e - half * n)
        return [ds, da, *np.linalg.solve(mass, columns.T @ (np.array([0.0, -G]) - bias))]

    fine = solve_ivp(rates, (0, 0.28), [-0.06, 0, 0, 0], "DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
    k = int(np.flatnonzero(run.t <= 0.28)[-1])
    s, a = fine.sol(run.t[k])[:2]
    middle = (
        np.array([half, 0.2])
        - s * np.array([np.cos(a), -np.sin(a)])
        + half * np.array([np.sin(a), np.cos(a)])
    )
    np.testing.assert_allclose([run["free_x"][k], run["free_z"][k]], middle, atol=1e-7)


@pytest.mark.parametrize("stiffness", [None, "1e6 N/m^1.5"])
@pytest.mark.parametrize("side", [(-1, 0), (1, 0), (0, -1), (0, 1)])
def test_a_ball_that_is_pressed_on_the_upright_side_of_a_box_rubs_there(side, stiffness):
    """The direction up had no part in the friction where a normal was level: it fell freely."""
    m, mu, pressed, r = Model("ball", gravity=(0, 0, -G)), 0.2, 6.0, 0.1
    deep = (pressed / 1e6) ** (2 / 3) if stiffness else 0.0
    free_body(m, "ball", {"sphere": [r]}, (*(-(0.5 + r - deep) * x for x in side), 0, 1, 0, 0, 0))
    m.body("box", mass=1, shape={"box": [1.0, 1.0, 1.0]})
    m.joint("held", type="fixed", child="box")
    m.load("push", point=m.point("middle", body="ball"), force=[*(pressed * x for x in side), 0])
    law = {"stiffness": stiffness, "smooth": 1e-6} if stiffness else {}
    m.contact("hit", body="ball", other="box", friction=mu, **law)
    run = m.derive().run(t_end=0.1, method="radau5" if stiffness else "dop853")
    assert run.ok, [check.says for check in run.objections]
    # It slides and spins up, as 2/5 m r² ω' = μ F r is less than rolling takes.
    assert run["ball_free_vz"][-1] == pytest.approx(
        -(G - mu * pressed) * 0.1, abs=1e-6 if stiffness else 1e-9
    )
