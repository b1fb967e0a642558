"""Balls, wheels and knife edges by `[rolling]`: against closed forms, and against constraints written by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk

from symgen import Model, load
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.toml_reader import read_text
from symgen.runtime.errors import RuntimeModelError

TURNTABLE = """
[parameters]
R = "0.1 m"
w = "2 rad/s"

[bodies.table]
mass = 1
inertia = [1, 1, 1]

[bodies.ball]
density = "1000 kg/m^3"
shape = { sphere = ["R"] }

[joints.pivot]
type = "revolute"
child = "table"
axis = [0, 0, 1]
rate = "w"

[joints.float]
type = "free"
child = "ball"
start = [0.5, 0, "R", 1, 0, 0, 0]
rate = [0, 0.3, 0, 0, 0, 0]

[constraints.drive]
motion = { coordinate = "pivot", follows = "w*t" }

[rolling.ball]
body = "ball"
ball = "R"
plane = "table"

[gravity]
z = "-9.81 m/s^2"
"""


def test_a_ball_on_a_turntable_runs_in_circles():
    """A solid ball's centre turns with 2/7 of the table's rate, whatever its size (Earnshaw, Dynamics, 1844)."""
    text = TURNTABLE.replace("rate = [0, 0.3, 0, 0, 0, 0]", "rate_guess = [0, 0, 0, 0, 0, 0]")
    run = derive(read_text(text)).run(t_end=6.0, rtol=1e-10)
    x, v = run.q[0, [1, 2]], np.array([run["float_vx"][0], run["float_vy"][0]])
    turn = 2 / 7 * 2.0
    middle = x + np.array([-v[1], v[0]]) / turn
    angle, away = turn * run.t, x - middle
    assert np.hypot(*v) > 0.1
    expected = middle[0] + away[0] * np.cos(angle) - away[1] * np.sin(angle)
    assert run["float_x"] == pytest.approx(expected, abs=1e-8)
    expected = middle[1] + away[0] * np.sin(angle) + away[1] * np.cos(angle)
    assert run["float_y"] == pytest.approx(expected, abs=1e-8)
    assert run["float_z"] == pytest.approx(np.full(len(run.t), 0.1), abs=1e-12)
    assert all(check.ok for check in run.health), run.health


@pytest.mark.parametrize("planar", [False, True])
def test_down_a_slope(planar):
    """A ball, and a wheel in the plane, at 5/7 and 2/3 of g sin: on a frame that is tilted."""
    m = Model("slope", gravity=(0, "-9.81 m/s^2") if planar else (0, 0, "-9.81 m/s^2"))
    if planar:
        m.frame("slope", at=(0.1, 0.2), axis=(0, 0, 1), angle=-0.3)
        x, y, phi = (m.coordinate(name) for name in ("x", "y", "phi"))
        m.body("b", density=500, shape={"cylinder": [0.2, 0.1], "axis": [0, 0, 1]}, com=(x, y), angle=phi)
        m.rolling("b", "b", wheel=0.2, plane="slope")
    else:
        m.frame("slope", at=(0.1, 0, 0.2), axis=(0, 1, 0), angle=0.3)
        m.body("b", density=500, shape={"sphere": [0.2]})
        m.joint("j", "free", "b")
        m.rolling("b", "b", ball=0.2, plane="slope")
    run = m.derive().run(t_end=1.0, rtol=1e-10)
    share = 2 / 3 if planar else 5 / 7
    away = share * 9.81 * np.sin(0.3) / 2
    start, end = run.q[0], run.q[-1]
    fallen = end[:2] - start[:2] if planar else end[[0, 2]] - start[[0, 2]]
    assert fallen == pytest.approx(away * np.array([np.cos(0.3), -np.sin(0.3)]), abs=1e-9)
    assert all(check.ok for check in run.health), run.health


@pytest.mark.parametrize("case", range(4))
def test_a_wheel_that_starts_at_the_origin(case):
    """No length but numbers, and a start that is zero but for round-off: this tells nothing of what is large."""
    angle, along = [(0.7, 0.0), (0.7, 0.5), (-1.2, -2.0), (0.3, 1.3)][case]
    c, s = np.cos(angle), np.sin(angle)
    m = Model("slope", gravity=(0, "-9.81 m/s^2"))
    m.frame("slope", at=(0.2 * s + along * c, -0.2 * c + along * s), axis=(0, 0, 1), angle=angle)
    m.body("wheel", mass=1, inertia=0.02)
    m.joint("wheel", "planar", "wheel", guess=[0.4 * s, -0.4 * c, 0])
    m.rolling("wheel", "wheel", wheel=0.2, plane="slope")
    system = m.derive()
    for start in ({}, {"wheel_x": 0.0}, {"wheel_y": 0.0}):
        run = system.run(t_end=1.0, start=start, rtol=1e-10)
        assert run.q[0, :2] == pytest.approx(0, abs=1e-15)
        assert run.q[-1, :2] == pytest.approx(-9.81 * s / 3 * np.array([c, s]), abs=1e-9)
        assert all(check.ok for check in run.health), run.health


@pytest.mark.parametrize("free", [False, True])
def test_a_disc_rolls_as_the_bundled_one_does(free):
    """models/rolling_disc.toml holds the touching point by constraints in Euler's angles, written by hand."""
    reference = load("rolling_disc").run(t_end=3.0, rtol=1e-11, atol=1e-13)
    m = Model("disc", gravity=(0, 0, -9.81))
    inertia = [0.25, 0.5, 0.25]
    if free:
        m.body("disc", mass=1, inertia=inertia)
        turn = Rotation.from_euler("ZXY", [0.0, 0.3, 0.0])
        q = turn.as_quat()[[3, 0, 1, 2]]
        spin = turn.inv().apply([0, 0, 0.5]) + np.array([0, 5.0, 0])
        rates = [reference["dot(x)"][0], reference["dot(y)"][0], reference["dot(z)"][0], *spin]
        m.joint("d", "free", "disc", start=[0, 0, np.cos(0.3), *q], rate=[float(x) for x in rates])
    else:
        for name, value in (("x", 0), ("y", 0), ("z", np.cos(0.3))):
            m.coordinate(name, start=value)
        angles = [m.coordinate("yaw", start=0, rate=0.5), m.coordinate("lean", start=0.3, rate=0),
                  m.coordinate("spin", start=0, rate=5.0)]  # fmt: skip
        m.body("disc", mass=1, com=("x", "y", "z"), rotation=list(zip("zxy", angles)), inertia=inertia)
    m.rolling("wheel", "disc", wheel=1.0, axis=(0, 1, 0))
    run = m.derive().run(t_end=3.0, rtol=1e-11, atol=1e-13, t_eval=reference.t)
    names = ["d_x", "d_y", "d_z"] if free else ["x", "y", "z"]
    for name, other in zip(names, ["x", "y", "z"]):
        assert run[name] == pytest.approx(reference[other], abs=1e-7)
    assert run.energy.max_error < 1e-8


@pytest.mark.parametrize("planar", [True, False])
def test_a_skate_on_a_slope_does_not_run_away(planar):
    """u' = -g sin(w t) along the blade, which turns evenly (Neimark & Fufaev, Dynamics of nonholonomic systems)."""
    g, w = 3.0, 1.7
    m = Model("skate", gravity=(0, -g))
    if planar:
        x, y, phi = (
            m.coordinate("x", start=0),
            m.coordinate("y", start=0),
            m.coordinate("phi", start=0, rate=w),
        )
        m.body("skate", mass=2, inertia=0.3, com=(x, y), angle=phi)
        m.rolling("edge", "skate", knife=(1, 0))
    else:
        m = Model("skate")
        m.gravity(y=-g, z=-9.81)
        m.body("skate", mass=2, inertia=[0.1, 0.2, 0.3])
        m.joint("s", "free", "skate", start=[0, 0, 0, 1, 0, 0, 0], rate=[0, 0, 0, 0, 0, w])
        m.point("heel", "skate", (0, 0, 1))
        m.axis("up", "skate", (0, 0, 1))
        m.constraint("upright_x", "up_x")
        m.constraint("upright_y", "up_y")
        m.rolling("edge", "skate", knife=(1, 0, 0))
    run = m.derive().run(t_end=6.0, rtol=1e-10)
    t = run.t
    x = g / w**2 * (w * t / 2 + np.sin(2 * w * t) / 4 - np.sin(w * t))
    y = g / w**2 * (np.sin(w * t) ** 2 / 2 - (1 - np.cos(w * t)))
    names = ("x", "y") if planar else ("s_x", "s_y")
    assert run[names[0]] == pytest.approx(x, abs=1e-7)
    assert run[names[1]] == pytest.approx(y, abs=1e-7)


def test_two_wheels_of_an_axle_hold_it_with_five_constraints():
    m = Model("axle", gravity=(0, 0, -9.81))
    m.body("axle", density=7850, shape=[
        {"cylinder": [0.02, 1.4]}, {"cylinder": [0.4, 0.05], "offset": [0, 0, 0.7]},
        {"cylinder": [0.4, 0.05], "offset": [0, 0, -0.7]},
    ])  # fmt: skip
    m.joint(
        "j",
        "free",
        "axle",
        start=[0, 0, 0.4, np.sqrt(0.5), -np.sqrt(0.5), 0, 0],
        rate_guess=[2, 0, 0, 0, 0, 5.0],
    )
    m.rolling("left", "axle", wheel=0.4, at=(0, 0, 0.7))
    m.rolling("right", "axle", wheel=0.4, at=(0, 0, -0.7), holds=["gap", "along"])
    system = m.derive()
    assert [c["name"] for c in system.source.header["constraints"]] == [
        "left_gap", "right_gap", "left_along", "left_across", "right_along",
    ]  # fmt: skip
    run = system.run(t_end=2.0)
    assert not any("redundant" in note for note in run.notes)
    speed = run["j_vx"][0]
    assert speed > 1 and run["j_wz"] == pytest.approx(np.full(len(run.t), speed / 0.4), rel=1e-9)
    assert run["j_x"] == pytest.approx(speed * run.t, abs=1e-8)
    assert all(check.ok for check in run.health), run.health


def test_files_round_trip():
    text = TURNTABLE.replace('plane = "table"', 'plane = "table"\nholds = ["gap", "along"]').replace(
        "[gravity]",
        '[frames.f]\n[rolling.edge]\nbody = "table"\nknife = [1, 0, 0]\nat = [0.1, 0, 0]\n[gravity]',
    )
    first = read_text(text)
    again = read_text(first.to_toml())
    assert again.to_toml() == first.to_toml()
    assert again.describe().constraints == first.describe().constraints
    assert again.describe().velocity_constraints == first.describe().velocity_constraints


def test_what_rolls_is_drawn_without_a_shape():
    m = Model("drawn")
    for name in ("ball", "wheel"):
        m.body(name, mass=1, inertia=[1, 1, 1])
        m.joint(name, "free", name)
        m.rolling(name, name, **{name: 0.3})
    bodies = m.derive().bodies
    assert [(b["shape"], b.get("parts")) for b in bodies] == [("sphere", None), ("solids", ["cylinder"])]


@pytest.mark.parametrize(
    "old, new, place, words",
    [
        ('ball = "R"', "", "", "one of ball, wheel, knife; 0 are given"),
        ('ball = "R"', 'ball = "R"\nwheel = 1', "", "2 are given"),
        ('ball = "R"', 'ball = "w"', "ball", "units do not match"),
        ('ball = "R"', 'ball = "-R"', "ball", "not positive"),
        ('ball = "R"', 'ball = "R"\naxis = [1, 0, 0]', "axis", "a ball has no 'axis'"),
        ('ball = "R"', 'ball = "R"\nholds = ["up"]', "holds, element 1", "one of gap, along, across"),
        ('body = "ball"\nball', 'body = "bal"\nball', "body", "did you mean 'ball'"),
        ('plane = "table"', 'plane = "tabel"', "plane", "did you mean 'table'"),
        ('plane = "table"', 'plane = "ball"', "plane", "fixed in 'ball', which rolls"),
        ("[gravity]", '[constraints]\nball_gap = "pivot"\n[gravity]', "", "which is taken"),
        ('ball = "R"', "knife = [0, 0, 0]", "knife", "zero length"),
    ],
)  # fmt: skip
def test_wrong_rolling(old, new, place, words):
    if words is None:
        return
    with pytest.raises(ModelError, match=words) as caught:
        read_text(TURNTABLE.replace(old, new), file="a.toml").describe()
    assert (caught.value.table, caught.value.key or "") == ("rolling.ball", place)


# Surfaces: the equations again, by hand, with the contact's place as a coordinate.


def test_a_ball_in_a_trough_swings_as_the_closed_form_says():
    """(7/5) (R - r) θ'' = -g sin θ: the period by an elliptic integral, and 2π sqrt(7 (R - r)/(5 g)) of small ones."""
    R, r, first = 1.0, 0.1, 0.8
    m = Model("trough", gravity=(0, -9.81))
    start = ((R - r) * np.sin(first), R - (R - r) * np.cos(first))
    x, y, phi = (m.coordinate("x", start=start[0]), m.coordinate("y", guess=start[1]), m.coordinate("phi"))
    m.body("ball", mass=2, inertia=0.4 * 2 * r * r, com=(x, y), angle=phi)
    m.rolling("roll", "ball", ball=r, height=f"{R} - sqrt({R}^2 - here_x^2)")
    w = np.sqrt(5 / 7 * 9.81 / (R - r))
    modulus = np.sin(first / 2) ** 2
    system = m.derive()
    for method, step in (
        ("dop853", None),
        ("taylor", None),
        ("radau5", None),
        ("bdf", None),
        ("gauss8", 2e-3),
    ):
        run = system.run(t_end=4.0, rtol=1e-10, method=method, step=step)
        sn, *_ = ellipj(ellipk(modulus) - w * run.t, modulus)
        angle = 2 * np.arcsin(np.sqrt(modulus) * sn)
        off = 1e-6 if method == "bdf" else 2e-8
        assert run["x"] == pytest.approx((R - r) * np.sin(angle), abs=off), method
        assert run["y"] == pytest.approx(R - (R - r) * np.cos(angle), abs=off), method
        # It turns by what the way is over its radius.
        assert run["phi"] == pytest.approx((R - r) / r * (first - angle), abs=off / r), method
        assert all(check.ok for check in run.health), run.health
    # The force on the ground: weight and centripetal force.
    rate = w * np.sqrt(2 * (np.cos(angle) - np.cos(first)))
    force = 2 * (9.81 * np.cos(angle) + (R - r) * rate**2)
    run = system.run(t_end=4.0, rtol=1e-10, t_eval=run.t)
    assert run["lambda(roll_gap)"] == pytest.approx(force, rel=1e-6)


def in_a_bowl(a, b, mass, r, start, t_end):
    """A ball on z = (a u² + b w²)/2, by hand: states are the foot (u, w), the centre's velocity, the spin.

    Newton and Euler with the contact's force F as the unknown that keeps v + Ω × (-r n) = 0, differentiated:
    m v' = F + m g, I Ω' = -r n × F, v' = (r Ω × n)'.
    """
    inertia, down = 0.4 * mass * r * r, np.array([0, 0, -9.81])

    def normal(u, w):
        n = np.array([-a * u, -b * w, 1.0])
        return n / np.linalg.norm(n)

    def by_foot(u, w):
        """The derivatives of the centre p + r n, and of n, by u and w."""
        N, h = np.array([-a * u, -b * w, 1.0]), np.linalg.norm([-a * u, -b * w, 1.0])
        turned = []
        for dN in (np.array([-a, 0, 0]), np.array([0, -b, 0])):
            turned.append(dN / h - N * (N @ dN) / h**3)
        tangents = [np.array([1, 0, a * u]), np.array([0, 1, b * w])]
        return [t + r * n for t, n in zip(tangents, turned)], turned

    def motion(_, s):
        u, w, spin = s[0], s[1], s[2:5]
        n = normal(u, w)
        v = r * np.cross(spin, n)
        centre, turned = by_foot(u, w)
        rates = np.linalg.lstsq(np.stack(centre, axis=1), v, rcond=None)[0]
        n_rate = rates[0] * turned[0] + rates[1] * turned[1]
        # m r (Ω' × n + Ω × n') = F + m g and I Ω' = -r n × F, so Ω' from F, and F from one linear equation.
        cross = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
        left = np.eye(3) - mass * r * r / inertia * cross @ cross
        force = np.linalg.solve(left, mass * (r * np.cross(spin, n_rate) - down))
        return [*rates, *(-r * np.cross(n, force) / inertia), *v]

    u, w = start[:2]
    y = solve_ivp(motion, (0, t_end), [*start, *(np.array([u, w, (a * u * u + b * w * w) / 2]) + r * normal(u, w))],
                  "DOP853", rtol=1e-11, atol=1e-13)  # fmt: skip
    return y.y[:, -1]


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
def test_a_ball_in_a_bowl(method):
    a, b, mass, r = 0.8, 1.3, 0.7, 0.15
    spin = np.array([1.0, -2.0, 5.0])
    n = np.array([-a * 0.4, -b * 0.1, 1.0])
    n /= np.linalg.norm(n)
    place = np.array([0.4, 0.1, (a * 0.16 + b * 0.01) / 2]) + r * n
    m = Model("bowl", gravity=(0, 0, -9.81))
    m.parameters(a=a, b=b)
    m.body("ball", mass=mass, inertia=[0.4 * mass * r * r] * 3)
    velocity = r * np.cross(spin, n)
    m.joint("free", "free", "ball", start=[*place, 1, 0, 0, 0], rate=[float(x) for x in (*velocity, *spin)])
    m.rolling("roll", "ball", ball=r, height="a*here_x^2/2 + b*here_y^2/2")
    run = derive(read_text(m.to_toml(), name="bowl")).run(t_end=2.0, rtol=1e-10, method=method)
    expected = in_a_bowl(a, b, mass, r, [0.4, 0.1, *spin], 2.0)
    found = [run[f"free_{c}"][-1] for c in "xyz"]
    assert found == pytest.approx(expected[5:], abs=1e-7)
    turned = Rotation.from_quat(run.q[-1, [4, 5, 6, 3]]).apply([run[f"free_w{c}"][-1] for c in "xyz"])
    assert turned == pytest.approx(expected[2:5], abs=1e-6)
    assert run.energy.max_error < 1e-6
    assert all(check.ok for check in run.health), run.health


def test_a_disc_on_a_surface_that_is_a_plane_rolls_as_on_that_plane():
    """A leaning disc on z = 0.3 x - 0.2 y, and on a frame whose x-y plane that is: gravity, lean and spin the same."""
    normal = np.array([-0.3, 0.2, 1.0]) / np.sqrt(1.13)
    turn = Rotation.align_vectors([normal], [[0, 0, 1]])[0]
    lean = turn * Rotation.from_euler("ZXY", [0.4, 0.3, 0.0])
    places = []
    for surface in (False, True):
        m = Model("disc", gravity=(0, 0, -9.81))
        m.frame("slope", rpy=tuple(turn.as_euler("xyz")))
        m.body("disc", mass=1, inertia=[0.25, 0.5, 0.25])
        centre = turn.apply([0, 0, 0.5 * np.cos(0.3)])
        spin = [0.2, 6.0, 0.1]
        rim = lean.apply([0, 0, -0.5])
        velocity = -np.cross(lean.apply(spin), rim)
        m.joint("j", "free", "disc", start=[*centre, *lean.as_quat()[[3, 0, 1, 2]]],
                rate=[float(x) for x in (*velocity, *spin)])  # fmt: skip
        given = {"height": "0.3*here_x - 0.2*here_y"} if surface else {"plane": "slope"}
        m.rolling("wheel", "disc", wheel=0.5, axis=(0, 1, 0), **given)
        run = m.derive().run(t_end=1.0, rtol=1e-10, method="dop853")
        assert all(check.ok for check in run.health), run.health
        places.append([*run.q[-1], *run.v[-1]])
    assert places[0] == pytest.approx(places[1], abs=1e-7)


def test_an_upright_disc_in_a_trough_swings_as_its_closed_form_says():
    """(3/2) (R - r) θ'' = -g sin θ in space, the disc in the plane across the trough."""
    R, r, first = 1.2, 0.2, 0.5
    m = Model("trough", gravity=(0, 0, -9.81))
    m.body("disc", mass=1, inertia=[r * r / 4, r * r / 2, r * r / 4])
    m.joint("j", "free", "disc", start=[(R - r) * np.sin(first), 0, R - (R - r) * np.cos(first), 1, 0, 0, 0])
    m.rolling("wheel", "disc", wheel=r, axis=(0, 1, 0), height=f"{R} - sqrt({R}^2 - here_x^2)")
    run = m.derive().run(t_end=2.0, rtol=1e-10, method="dop853")

    def swing(_, s):
        return [s[1], -2 / 3 * 9.81 / (R - r) * np.sin(s[0])]

    angle = solve_ivp(swing, (0, 2), [first, 0], rtol=1e-11, atol=1e-12).y[0, -1]
    assert run["j_x"][-1] == pytest.approx((R - r) * np.sin(angle), abs=1e-7)
    assert run["j_z"][-1] == pytest.approx(R - (R - r) * np.cos(angle), abs=1e-7)
    assert all(check.ok for check in run.health), run.health


@pytest.mark.parametrize("kind", ["cubic", "pchip"])
def test_a_ball_on_a_road_that_is_a_table(kind):
    """The centre's path is parallel to the road: with the foot's place u its speed w has 7/5 w' = -g sin(slope)."""
    r, knots = 0.08, np.linspace(-1.0, 1.0, 11)
    heights = 0.35 * knots**2 + 0.02 * np.sin(6 * knots)
    road = (CubicSpline if kind == "cubic" else PchipInterpolator)(knots, heights)
    slope, bend = road.derivative(), road.derivative(2)

    def motion(_, s):
        length = np.sqrt(1 + slope(s[0]) ** 2)
        return [s[1] / (length - r * bend(s[0]) / length**2), -9.81 / 1.4 * slope(s[0]) / length]

    u, speed = solve_ivp(motion, (0, 1.2), [-0.55, 0.2], "DOP853", rtol=1e-11, atol=1e-12, max_step=1e-3).y[
        :, -1
    ]
    length = np.sqrt(1 + slope(u) ** 2)
    m = Model("road", gravity=(0, "-9.81 m/s^2"))
    m.table("road", columns=[knots, heights], kind=kind, outside="extend", units=["m", "m"])
    first = np.sqrt(1 + slope(-0.55) ** 2)
    begin = (-0.55 - r * slope(-0.55) / first, road(-0.55) + r / first)
    x = m.coordinate("x", unit="m", start=float(begin[0]), rate=0.2 / float(first))
    y, phi = m.coordinate("y", unit="m", guess=float(begin[1])), m.coordinate("phi")
    m.body("ball", mass="2 kg", inertia=0.4 * 2 * r * r, com=(x, y), angle=phi)
    m.rolling("roll", "ball", ball=f"{r} m", height="road(here_x)")
    system = m.derive()
    for method, off in (("dop853", 1e-6), ("radau5", 1e-6), ("bdf", 1e-5)):
        run = system.run(t_end=1.2, rtol=1e-9, atol=1e-11, method=method)
        assert all(check.ok for check in run.health), (method, run.health)
        found = [run[name][-1] for name in ("x", "y", "dot(phi)")]
        expected = [u - r * slope(u) / length, road(u) + r / length, -speed / r]
        assert found == pytest.approx(expected, abs=off), method


@pytest.mark.parametrize("rolls", ["ball", "wheel"])
@pytest.mark.slow
def test_a_map_of_a_surface_is_rolled_on_as_the_surface_is(rolls):
    """Products of splines through z = (a x² + b y²)/2 + c x y are that; `radau5` has their derivatives."""
    knots = np.linspace(-1.5, 1.5, 6)
    x, y = (a.ravel() for a in np.meshgrid(knots, knots, indexing="ij"))
    turn = Rotation.from_euler("ZXY", [0.3, 0.2, 0.1]).as_quat()[[3, 0, 1, 2]]
    ends = {}
    for height in ("land(here_x, here_y)", "0.2*here_x^2 + 0.1*here_x*here_y + 0.15*here_y^2"):
        m = Model("map", gravity=(0, 0, "-9.81 m/s^2"))
        m.table(
            "land", columns=[x, y, 0.2 * x**2 + 0.1 * x * y + 0.15 * y**2], kind="cubic", outside="extend"
        )
        m.body("body", mass=1, inertia=[0.25 * 0.04, 0.5 * 0.04, 0.25 * 0.04])
        m.joint("j", "free", "body", guess=[0.3, 0.1, 0.25, *turn], rate_guess=[0.5, 0.2, 0, 0, 4, 0.3])
        m.rolling(
            "roll", "body", **{rolls: 0.2}, **({"axis": (0, 1, 0)} if rolls == "wheel" else {}), height=height
        )
        system = m.derive()
        for method in ("dop853", "radau5"):
            run = system.run(t_end=0.3, rtol=1e-10, atol=1e-12, method=method)
            assert all(check.ok for check in run.health), (method, run.health)
            ends[height[:4], method] = [*run.q[-1], *run.v[-1]]
    exact = ends.pop(("0.2*", "dop853"))
    for which, found in ends.items():
        assert found == pytest.approx(exact, abs=2e-8), which


def test_what_surfaces_have_not():
    def model(**given):
        m = Model("m")
        m.body("b", mass=1, inertia=[1, 1, 1])
        m.joint("j", "free", "b")
        x, y = np.meshgrid(range(3), range(3))
        m.table("land", columns=[y.ravel(), x.ravel(), np.zeros(9)], kind="cubic")
        m.table("steps", columns=[[0, 1, 2], [0, 1, 0]], kind="linear", outside="extend")
        m.rolling("r", "b", **given)
        return m.describe()

    for given, says in (
        ({"knife": (1, 0, 0), "height": "here_x"}, "a blade glides on a plane"),
        ({"ball": 0.1, "height": "here_x + here_z"}, "does not depend on 'here_z'"),
        ({"ball": 0.1, "height": "land(here_x, here_y)"}, 'give the table outside = "extend"'),
        ({"wheel": 0.1, "height": "land(here_x, here_y)"}, 'give the table outside = "extend"'),
        ({"ball": 0.1, "height": "steps(here_x)"}, "kinks"),
        ({"ball": 0.1, "height": "abs(here_x)"}, "height"),
        ({"ball": 0.1, "height": "here_x + t"}, "'t'"),
    ):
        with pytest.raises(ModelError) as error:
            model(**given)
        assert says in str(error.value) + str(error.value.hint), str(error.value)


def test_a_wheel_that_lies_flat_is_told_so():
    m = Model("flat", gravity=(0, 0, "-9.81 m/s^2"))
    m.body("rim", mass=1, inertia=[0.02, 0.02, 0.04])
    m.joint("free", "free", "rim", guess=[0, 0, 0.3, 1, 0, 0, 0])
    m.rolling("edge", "rim", wheel=0.3)
    system = m.derive()
    with pytest.raises(
        RuntimeModelError, match="wheel 'edge' touches with all of its rim where it lies flat"
    ):
        system.run(t_end=0.1)
    lean = Rotation.from_euler("x", 0.7).as_quat()[[3, 0, 1, 2]]  # without spin it falls
    start = dict(zip(("free_qw", "free_qx", "free_qy", "free_qz"), lean))
    assert "lies flat" in system.run(t_end=1.0, start=start).message


def test_a_knife_edge_glides_along_itself_on_a_turning_table():
    """Newton and Euler by hand: the table feels the blade, whose speed against it is along the blade."""
    mass, turn, table, ahead = 1.5, 0.2, 0.5, 0.15
    m = Model("skate", gravity=(0, 0, "-9.81 m/s^2"))
    m.body("table", mass=3, inertia=[0.1, 0.1, table])
    m.joint("spin", type="revolute", child="table", axis=[0, 0, 1], rate=0.7)
    m.body("skate", mass=mass, inertia=[0.1, 0.1, turn])
    start, rates = [0.3, 0.1, 0.4], [1.0, 0.2, 0.9]
    m.joint("s", type="planar", child="skate", axis=[0, 0, 1], start=start, rate_guess=rates)
    m.rolling("edge", "skate", knife=[1, 0, 0], at=[ahead, 0, 0], plane="table", holds=["across"])
    run = m.derive().run(t_end=2.0, method="dop853", rtol=1e-11, atol=1e-12)

    def rates_of(_, y):
        place, angle, velocity, omega, spin = y[:2], y[2], y[4:6], y[6], y[7]
        along = np.array([np.cos(angle), np.sin(angle)])
        side = np.array([-along[1], along[0]])
        blade, moving = place + ahead * along, velocity + ahead * omega * side
        under, under_rate = np.array([-blade[1], blade[0]]), np.array([-moving[1], moving[0]])
        row = np.array([*side, ahead, -side @ under])
        gamma = omega * along @ velocity + spin * (-omega * along @ under + side @ under_rate)
        whole = np.zeros((5, 5))
        whole[:4, :4], whole[4, :4], whole[:4, 4] = np.diag([mass, mass, turn, table]), row, -row
        return [*velocity, omega, spin, *np.linalg.solve(whole, [0, 0, 0, 0, gamma])[:4]]

    order = [1, 2, 3, 0]
    y0 = run.states[0]
    y = solve_ivp(rates_of, (0, 2), [*y0[order], *y0[4:8][order]], method="DOP853", rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(run.states[-1][order], y.y[:4, -1], atol=1e-10)
    assert run.ok
