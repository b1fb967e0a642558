"""Tyres: slips with relaxation, their laws, and vehicles on them, against equations written again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen import Model
from symgen.errors import ModelError
from symgen.link import derive
from symgen.model.toml_reader import read_text
from symgen.runtime.checks.health import health_of


def brush(s: float, c: float = 12.0, friction: float = 0.8) -> float:
    z = c * s / (3 * friction)
    return c * (1 - z + z * z / 3) if z < 1 else friction / s


def passed(run) -> bool:
    return run.status == "success" and all(entry.ok for entry in health_of(run))


def wheel(before=lambda m: None, **more) -> Model:
    m = Model("wheel", gravity=(0, 0, "-9.81 m/s^2"))
    before(m)
    m.body("wheel", mass="10 kg", inertia=("0.3 kg*m^2", "0.5 kg*m^2", "0.3 kg*m^2"), com=(0, 0, 0))
    m.joint("free", type="free", child="wheel", start=[0, 0, 0.295, 1, 0, 0, 0], rate=[2.0, 0, 0, 0, 20.0, 0])
    law = more or {"slip_stiffness": 12.0, "friction": 0.8}
    m.tyre(
        "rim",
        body="wheel",
        radius="0.3 m",
        stiffness="50 kN/m",
        damping="100 N*s/m",
        relaxation="0.2 m",
        **law,
    )
    m.run(t_end=1.0)
    return m


def rolled(law) -> np.ndarray:
    """x, z, spin and slip of a wheel that is set down spinning, after a second."""

    def motion(t, y):
        _, z, vx, vz, spin, slip = y
        depth = 0.3 - z
        load = max(0.0, 5e4 * depth - 100 * vz) if depth > 0 else 0.0
        pull = load * law(np.sqrt(slip**2 + 1e-12)) * slip
        return [
            vx,
            vz,
            pull / 10,
            load / 10 - 9.81,
            -0.3 * pull / 0.5,
            -(vx - 0.3 * spin + abs(vx) * slip) / 0.2,
        ]

    y = solve_ivp(motion, (0, 1), [0, 0.295, 2, 0, 20, 0], rtol=1e-10, atol=1e-12).y[:, -1]
    return y[[0, 1, 4, 5]]


def ends(run) -> list[float]:
    return [run[name][-1] for name in ("free_x", "free_z", "free_wy", "rim_kappa")]


@pytest.mark.parametrize("method", ["dop853", "radau5", "bdf"])
def test_a_spinning_wheel_is_set_down(method):
    run = derive(wheel()).run(rtol=1e-9, method=method)
    assert ends(run) == pytest.approx(rolled(brush), abs=2e-6)
    assert passed(run)


GRIP = np.array(
    [[0.0, 0.05, 0.1, 0.2, 0.5, 2.0], [0.0, 0.29, 0.52, 0.8, 0.86, 0.8]]
)  # force per load by slip
BY_LOAD = np.array([[0.0, 400.0, 4000.0], [1.05, 1.0, 0.7]])
LAWS_IN_SPACE = {
    "brush": ({"slip_stiffness": 12.0, "friction": 0.8}, lambda s, load: brush(s) * s),
    "formula": (
        {"magic": [8, 1.5, 0.4], "friction": 0.9},
        lambda s, load: 0.9 * np.sin(1.5 * np.arctan(8 * s - 0.4 * (8 * s - np.arctan(8 * s)))),
    ),
    "table": (
        {"table": "grip(rim_slip, rim_load)"},
        lambda s, load: np.interp(s, *GRIP) * np.interp(load, *BY_LOAD),
    ),
}


def thrown(m, law, inertia, start, rate, t_end):
    """The state of a wheel that leans, spins and steers, by Newton and Euler for its centre and in its own axes."""
    radius, spring, damper, relaxation = 0.3, 5e4, 100.0, 0.2

    def motion(t, y):
        p, (w, x, y_, z), v, spin, kappa, alpha = y[:3], y[3:7], y[7:10], y[10:13], y[13], y[14]
        turn = np.array(
            [
                [1 - 2 * (y_ * y_ + z * z), 2 * (x * y_ - w * z), 2 * (x * z + w * y_)],
                [2 * (x * y_ + w * z), 1 - 2 * (x * x + z * z), 2 * (y_ * z - w * x)],
                [2 * (x * z - w * y_), 2 * (y_ * z + w * x), 1 - 2 * (x * x + y_ * y_)],
            ]
        )
        axle, omega, up = turn[:, 1], turn @ spin, np.array([0.0, 0.0, 1.0])
        along = np.cross(axle, up)
        reach = np.linalg.norm(along)
        along /= reach
        across = np.cross(up, along)
        arm = radius * (axle * axle[2] - up) / reach
        slipping = v + np.cross(omega, arm)
        reach_rate = -axle[2] * np.cross(omega, axle)[2] / reach
        depth = radius * reach - p[2]
        load = max(0.0, spring * depth + damper * (radius * reach_rate - v[2])) if depth > 0 else 0.0
        slip = np.sqrt(kappa**2 + alpha**2 + 1e-12)
        force = load * (law(slip, load) / slip * (kappa * along + alpha * across) + up)
        torque = turn.T @ np.cross(arm, force)
        turned = [-x * spin[0] - y_ * spin[1] - z * spin[2], w * spin[0] + y_ * spin[2] - z * spin[1],
                  w * spin[1] - x * spin[2] + z * spin[0], w * spin[2] + x * spin[1] - y_ * spin[0]]  # fmt: skip
        slips = [-(slipping @ way) - abs(v @ along) * s for way, s in ((along, kappa), (across, alpha))]
        return [
            *v,
            *(0.5 * np.array(turned)),
            *(force / m - 9.81 * up),
            *((torque - np.cross(spin, inertia * spin)) / inertia),
            *(np.array(slips) / relaxation),
        ]

    begin = [*start, *rate, 0.0, 0.0]
    return solve_ivp(motion, (0, t_end), begin, "DOP853", rtol=1e-10, atol=1e-12, max_step=5e-3).y[:, -1]


@pytest.mark.parametrize("law", LAWS_IN_SPACE)
def test_a_wheel_that_leans_and_steers_in_space(law):
    """Loads and slips along the way and across it at once, with the gyroscopic moments; `taylor` goes by pieces."""
    given, formula = LAWS_IN_SPACE[law]
    turn = np.array([0.99, 0.05, 0.0, 0.1])
    start, rate = [0, 0, 0.299, *(turn / np.linalg.norm(turn))], [5, 0.3, -0.2, 0.1, 12, 0.4]
    m = Model("wheel", gravity=(0, 0, "-9.81 m/s^2"))
    if law == "table":
        slips, loads = (x.ravel() for x in np.meshgrid(GRIP[0], BY_LOAD[0], indexing="ij"))
        values = np.interp(slips, *GRIP) * np.interp(loads, *BY_LOAD)
        m.table("grip", columns=[slips, loads, values], outside="hold")
    m.body("wheel", mass="12 kg", inertia=(0.35, 0.6, 0.35), com=(0, 0, 0))
    m.joint("free", type="free", child="wheel", start=start, rate=rate)
    m.tyre(
        "rim",
        body="wheel",
        radius="0.3 m",
        stiffness="50 kN/m",
        damping="100 N*s/m",
        relaxation="0.2 m",
        **given,
    )
    system = derive(m)
    parts = "x y z qw qx qy qz vx vy vz wx wy wz"
    names = [*(f"free_{part}" for part in parts.split()), "rim_kappa", "rim_alpha"]
    exact = thrown(12.0, formula, np.array([0.35, 0.6, 0.35]), start, rate, 0.6)
    for method, off in (("dop853", 5e-8), ("taylor", 5e-8), ("radau5", 3e-7)):
        run = system.run(t_end=0.6, rtol=1e-9, atol=1e-11, method=method)
        assert passed(run), method
        found = [run[name][-1] for name in names]
        assert found == pytest.approx(exact, abs=off), method


def test_the_formula_and_a_table_are_laws():
    def magic(s):
        x = 9.0 * s
        return 0.9 * np.sin(1.5 * np.arctan(x - 0.4 * (x - np.arctan(x)))) / s

    run = derive(wheel(magic=[9.0, 1.5, 0.4], friction=0.9)).run(rtol=1e-9)
    assert ends(run) == pytest.approx(rolled(magic), abs=2e-6)
    columns = [[0, 0.1, 0.3, 20], [0, 0.7, 0.9, 0.8]]
    m = wheel(lambda m: m.table("grip", columns=columns, outside="hold"), table="grip(rim_slip)")
    grip = rolled(lambda s: np.interp(s, [0, 0.1, 0.3, 20], [0, 0.7, 0.9, 0.8]) / s)
    assert ends(derive(m).run(rtol=1e-9)) == pytest.approx(grip, abs=5e-6)


def test_a_bicycle_corners_as_its_understeer_says():
    """Yaw rate V delta / (L + K V^2) of the linear one, and the transient by SciPy."""
    m = Model("bicycle")
    x, y, psi = m.coordinate("x", rate=20.0), m.coordinate("y"), m.coordinate("psi")
    m.body("car", mass=1200, inertia=1800, com=(x, y), angle=psi)
    delta = 0.01
    steered, common = (-np.sin(delta), np.cos(delta)), {"body": "car", "radius": 0.3, "relaxation": 0.4}
    m.tyre("front", at=(1.2, 0), axis=steered, load=6800, slip_stiffness=9, **common)
    m.tyre("rear", at=(-1.5, 0), axis=(0, 1), load=5000, slip_stiffness=14, **common)
    m.run(t_end=4.0)
    run = derive(m).run(rtol=1e-9)

    def motion(t, s):
        angle, u, w, r, front, rear = s[2:]
        c, n = np.cos(angle), np.sin(angle)
        force, torque = np.zeros(2), 0.0
        changes = []
        for place, turned, stiff, slip in ((1.2, delta, 6800 * 9, front), (-1.5, 0.0, 5000 * 14, rear)):
            way = np.array([np.cos(angle + turned), np.sin(angle + turned)])
            side = np.array([-way[1], way[0]])
            speed = np.array([u - r * place * n, w + r * place * c])
            push = stiff * slip * side
            force += push
            torque += place * (c * push[1] - n * push[0])
            changes.append(-(speed @ side + abs(speed @ way) * slip) / 0.4)
        return [u, w, r, *(force / 1200), torque / 1800, *changes]

    s = solve_ivp(motion, (0, 4), [0, 0, 0, 20, 0, 0, 0, 0], rtol=1e-10, atol=1e-12).y[:, -1]
    assert [run["x"][-1], run["y"][-1], run["psi"][-1]] == pytest.approx(s[:3], rel=1e-7)
    speed = np.hypot(run["dot(x)"][-1], run["dot(y)"][-1])
    understeer = 1200 / 2.7 * (1.5 / (6800 * 9) - 1.2 / (5000 * 14))
    assert run["dot(psi)"][-1] == pytest.approx(speed * delta / (2.7 + understeer * speed**2), rel=2e-3)
    assert passed(run)


@pytest.mark.parametrize(
    "axis", [(-0.6, 12), (-5e-3, 0.1), ("-toe/l", "width/l"), ("-sin(turn)", "cos(turn)")]
)
def test_an_axle_may_be_of_any_length(axis):
    def end(axis):
        m = Model("car")
        x, y, psi = m.coordinate("x", rate=20.0), m.coordinate("y"), m.coordinate("psi")
        for name, value in (("toe", 0.05), ("width", 1.0), ("l", 0.5), ("turn", np.arctan(0.05))):
            m.parameter(name, value)
        m.body("car", mass=1200, inertia=1800, com=(x, y), angle=psi)
        common = {"body": "car", "radius": 0.3, "relaxation": 0.4, "slip_stiffness": 9}
        m.tyre("front", at=(1.2, 0), axis=axis, load=6800, **common)
        m.tyre("rear", at=(-1.5, 0), load=5000, **common)
        return derive(m).run(1.0, rtol=1e-10).q[-1, :3]

    unit = np.array([-0.05, 1.0]) / np.hypot(0.05, 1.0)
    assert end(axis) == pytest.approx(end(tuple(unit)), rel=1e-8)


def test_a_rotor_on_a_hub_drives_it():
    """A quarter car without a body of the wheel: torque on the rotor, slip, and the hub that it pulls."""
    m = Model("driven", gravity=(0, 0, "-9.81 m/s^2"))
    m.body("hub", mass=300)
    m.joint("way", type="prismatic", child="hub", axis=(1, 0, 0))
    m.rotor("wheel", inertia=1.2, body="hub", axis=(0, 1, 0))
    torque = m.input("torque", unit="N*m", default=500)
    m.force("wheel", torque)
    m.tyre(
        "drive",
        body="hub",
        radius=0.3,
        spin="wheel",
        load="300*9.81",
        slip_stiffness=12,
        friction=0.8,
        relaxation=0.3,
    )
    m.run(t_end=2.0)
    run = derive(m).run(rtol=1e-9)

    def motion(t, y):
        v, spin, slip = y
        pull = 300 * 9.81 * brush(np.sqrt(slip**2 + 1e-12)) * slip
        return [pull / 300, (500 - 0.3 * pull) / 1.2, -(v - 0.3 * spin + abs(v) * slip) / 0.3]

    y = solve_ivp(motion, (0, 2), [0, 0, 0], rtol=1e-10, atol=1e-12).y[:, -1]
    assert [run["dot(way)"][-1], run["dot(wheel)"][-1], run["drive_kappa"][-1]] == pytest.approx(y, rel=1e-6)
    assert passed(run)


def test_the_ground_may_be_uneven():
    m = Model("road", gravity=(0, 0, -10))
    m.body("wheel", mass=10, inertia=(0.3, 0.5, 0.3))
    m.joint("free", type="free", child="wheel", guess=[0.5, 0, 0.35, 1, 0, 0, 0])
    m.tyre(
        "rim",
        body="wheel",
        radius=0.3,
        stiffness=5e4,
        slip_stiffness=10,
        relaxation=0.2,
        ground="0.1*cos(rim_centre_x)",
    )
    system = derive(m)
    y = np.zeros(system.nq + system.nv)
    y[:4] = [0.2, 0.0, 0.39, 1.0]
    rhs = system.kernel("rhs")(0.0, y, system.parameter_values())
    load = 5e4 * (0.3 - 0.39 + 0.1 * np.cos(0.2))
    assert rhs[system.nq + 2] == pytest.approx(load / 10 - 10, rel=1e-12)


LOAD = 3000.0


def leaning(lean: float, side: float, slip: float = 0.0, **law) -> tuple[float, float]:
    """Forces along and across of a tyre under a given load, whose axle leans, at given slips; x is the way."""
    m = Model("lean")
    m.body("wheel", mass=10, inertia=(0.3, 0.5, 0.3))
    m.joint("free", type="free", child="wheel", start=[0, 0, 0.3, np.cos(lean / 2), np.sin(lean / 2), 0, 0])
    m.table("grip", columns=[[0, 0.1, 0.3, 20], [0, 0.7, 0.9, 0.8]], outside="hold")
    m.tyre("rim", body="wheel", radius=0.3, load=LOAD, relaxation=0.2, **law)
    m.output("along", "rim_along")
    m.output("across", "rim_across")
    m.output("camber", "rim_camber")
    system = m.derive()
    run = system.run(t_end=1e-9, start={"rim_alpha": side, "rim_kappa": slip}, method="rk4", step=1e-9)
    assert run["camber"][0] == pytest.approx(-lean, abs=1e-15)
    return run["along"][0], run["across"][0]


CAMBERS = [0.0, 0.08, -0.2]


@pytest.mark.parametrize("lean", CAMBERS)
@pytest.mark.parametrize(("side", "slip"), [(0.0, 0.0), (0.03, 0.0), (-0.2, 0.05), (0.5, -0.3)])
def test_a_wheel_that_leans_is_pushed_to_that_side(lean, side, slip):
    """The thrust by each law, written again; turned about x by `lean` > 0 the wheel leans to -y (ISO)."""
    gamma = -lean
    linear = leaning(lean, side, slip, slip_stiffness=12.0, camber_stiffness=0.9)
    assert linear == pytest.approx((12 * slip * LOAD, (12 * side + 0.9 * gamma) * LOAD), rel=1e-12, abs=1e-9)

    alpha = side + 0.9 / 12 * gamma
    s = np.sqrt(alpha**2 + slip**2 + 1e-12)
    found = leaning(lean, side, slip, slip_stiffness=12.0, friction=0.8, camber_stiffness=0.9)
    assert found == pytest.approx((brush(s) * slip * LOAD, brush(s) * alpha * LOAD), rel=1e-12, abs=1e-9)
    assert np.hypot(*found) <= 0.8 * LOAD * (1 + 1e-12)

    grip = np.interp(np.hypot(side, slip), [0, 0.1, 0.3, 20], [0, 0.7, 0.9, 0.8]) * LOAD
    way = np.array([slip, side]) / max(np.hypot(side, slip), 1e-300)
    found = leaning(lean, side, slip, table="grip(rim_slip)", camber_stiffness=0.9)
    assert found == pytest.approx(grip * way + [0, 0.9 * gamma * LOAD], rel=1e-5, abs=1e-5 * LOAD)


@pytest.mark.parametrize("lean", CAMBERS)
@pytest.mark.parametrize("side", [0.0, 0.02, -0.15])
def test_the_formula_with_camber(lean, side):
    """MF-Tyre 5.2, Fy = Dy sin(Cy atan(By αy - Ey (By αy - atan(By αy)))) + SVy, at nominal load."""
    gamma, B, C, E, mu = -lean, 9.0, 1.4, -0.6, 0.95
    pDy3, pKy3, pHy3, pVy3 = 3.0, 0.6, 0.04, -0.4
    Dy = mu * (1 - pDy3 * gamma**2) * LOAD
    Ky = mu * B * C * LOAD * (1 - pKy3 * abs(gamma))
    By, ay = Ky / (C * Dy), side + pHy3 * gamma
    expected = Dy * np.sin(C * np.arctan(By * ay - E * (By * ay - np.arctan(By * ay)))) + pVy3 * gamma * LOAD
    law = {"magic": [B, C, E], "friction": mu}
    found = leaning(lean, side, **law, magic_camber=[pDy3, pKy3, pHy3, pVy3])
    assert found == pytest.approx((0.0, expected), abs=1e-5 * LOAD)
    ay = side + 0.7 / (mu * B * C) * gamma
    expected = mu * LOAD * np.sin(C * np.arctan(B * ay - E * (B * ay - np.arctan(B * ay))))
    assert leaning(lean, side, **law, camber_stiffness=0.7)[1] == pytest.approx(expected, abs=1e-5 * LOAD)


@pytest.mark.parametrize("method", ["dop853", "radau5", "bdf"])
def test_a_car_that_rolls_runs_aside_by_the_thrust_of_camber(method):
    """Seen from above, with an inclination that is given; both slips against SciPy, and the steady drift."""
    m = Model("drift")
    x, y, psi = m.coordinate("x", rate=15.0), m.coordinate("y"), m.coordinate("psi")
    m.body("car", mass=1000, inertia=1500, com=(x, y), angle=psi)
    common = {"body": "car", "radius": 0.3, "relaxation": 0.4, "load": 5000, "slip_stiffness": 10}
    for place, lean in ((1.2, 0.06), (-1.2, "0.03 + 0.01*sin(t)")):
        name = "front" if place > 0 else "rear"
        m.tyre(
            name, at=(place, 0), axis=(0, 1), friction=0.9, camber_stiffness=0.8, inclination=lean, **common
        )
    run = m.derive().run(t_end=2.0, rtol=1e-9, method=method)

    def motion(t, s):
        angle, u, w, r = s[2:6]
        c, n = np.cos(angle), np.sin(angle)
        force, torque, changes = np.zeros(2), 0.0, []
        for place, lean, slip in ((1.2, 0.06, s[6]), (-1.2, 0.03 + 0.01 * np.sin(t), s[7])):
            alpha = slip + 0.08 * lean
            push = 5000 * brush(np.sqrt(alpha**2 + 1e-12), 10.0, 0.9) * alpha
            side, way = np.array([-n, c]), np.array([c, n])
            speed = np.array([u - r * place * n, w + r * place * c])
            force, torque = force + push * side, torque + place * push
            changes.append(-(speed @ side + abs(speed @ way) * slip) / 0.4)
        return [u, w, r, *(force / 1000), torque / 1500, *changes]

    s = solve_ivp(motion, (0, 2), [0, 0, 0, 15, 0, 0, 0, 0], rtol=1e-10, atol=1e-12).y[:, -1]
    assert [run["x"][-1], run["y"][-1], run["psi"][-1]] == pytest.approx(s[:3], rel=1e-6)
    assert run["y"][-1] > 0.3 and passed(run)


def test_what_is_written_is_read_again():
    m = wheel()
    again = read_text(m.to_toml(), name="wheel")
    assert derive(again).run(rtol=1e-9).states[-1] == pytest.approx(
        derive(m).run(rtol=1e-9).states[-1], abs=1e-6
    )


BASE = {"body": "wheel", "radius": 0.3, "relaxation": 0.2, "load": 100, "slip_stiffness": 10}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"body": "hub"}, "there is no body 'hub' above"),
        ({"radius": None}, "the key 'radius' is missing"),
        ({"load": None}, "a 'stiffness', or a 'load'"),
        ({"slip_stiffness": None}, "a tyre has one law"),
        ({"magic": [1, 2, 3]}, "a tyre has one law"),
        ({"magic": [1, 2], "slip_stiffness": None, "friction": 1}, "three factors"),
        ({"table": "1.0", "slip_stiffness": None, "friction": 1}, "leave 'friction' out"),
        ({"spin": "2*q"}, "the name of a coordinate"),
        ({"radius": 0}, "radius: the radius is not positive at the parameters' values: 0 m"),
        ({"relaxation": 0}, "relaxation: the relaxation is not positive"),
        ({"relaxation": "-0.1 m"}, "the relaxation is not positive at the parameters' values: -0.1 m"),
        ({"axis": (0, 0, 0)}, "axis: the axle has no direction"),
    ],
)
def test_what_makes_no_tyre_is_refused(change, says):
    m = Model("bad")
    m.body("wheel", mass=1, inertia=(1, 1, 1))
    m.joint("free", type="free", child="wheel")
    with pytest.raises(ModelError, match=says) as caught:
        m.tyre("rim", **{**BASE, **change})
    assert "tyre('rim')" in str(caught.value)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"slip_stiffness": 9, "magic_camber": [1, 0, 0, 0]}, "goes with the formula that 'magic' gives"),
        ({"magic": [9, 1, 0], "friction": 1, "magic_camber": [1, 0]}, "four terms of camber"),
        ({"slip_stiffness": 9, "inclination": 0.1}, "without a thrust of camber"),
        ({"slip_stiffness": 9, "camber_stiffness": 1}, "does not lean"),
        (
            {"magic": [9, 1, 0], "friction": 1, "magic_camber": [1, 0, 0, 0], "camber_stiffness": 1},
            "of the two",
        ),
    ],
)
def test_what_camber_has_not(more, says):
    m = Model("car")
    x, y, psi = m.coordinate("x", rate=20.0), m.coordinate("y"), m.coordinate("psi")
    m.body("car", mass=1200, inertia=1800, com=(x, y), angle=psi)
    with pytest.raises(ModelError) as error:
        m.tyre("front", body="car", radius=0.3, relaxation=0.4, load=5000, **more)
    assert says in str(error.value) + str(error.value.hint)


SKIDDING = """
[coordinates]
x = { unit = "m", rate = 20.0 }
y = { unit = "m", rate = 14.0 }
psi = { start = 0.1, rate = 0.8 }
[bodies.car]
mass = "1200 kg"
inertia = "1800 kg*m^2"
com = ["x", "y"]
angle = "psi"
[tyres.front]
body = "car"
radius = "0.3 m"
at = ["1.2 m", 0]
axis = [-0.01, 1]
load = "6800 N"
LAW
relaxation = "0.3 m"
[outputs]
slip = "front_slip"
[tables.grip]
columns = [[0, 0.05, 0.1, 0.2, 1.0], [0, 0.45, 0.8, 0.9, 0.8]]
outside = "hold"
kind = "pchip"
"""


@pytest.mark.parametrize("law", ["slip_stiffness = 9.0\nfriction = 0.9", 'table = "grip(front_slip)"'])
def test_taylor_goes_piece_by_piece_over_the_limit_of_a_tyre(law):
    """A brush slides all over from a slip of 0.3 on; what it compares is a root of a sum of squares."""
    system = derive(read_text(SKIDDING.replace("LAW", law)))
    exact = system.run(method="dop853", rtol=1e-11, atol=1e-13, t_end=1.0)
    run = system.run(method="taylor", rtol=1e-9, t_end=1.0)
    slips = exact.outputs[:, 0]
    assert slips.max() > 0.3 > slips[0]
    assert run.ok and exact.ok
    np.testing.assert_allclose(run.q[-1], exact.q[-1], rtol=0, atol=3e-8)
    np.testing.assert_allclose(run.v[-1], exact.v[-1], rtol=0, atol=3e-8)


@pytest.mark.parametrize("factors", [[1e308, 1.6, 0.3], [1e308, 1e308, 1e308]])
def test_factors_that_overflow_in_the_equations_are_refused_in_words(factors):
    with pytest.raises(ModelError, match=r"has the value -?inf; numbers of the model are too large"):
        derive(wheel(magic=factors, friction=0.9))
