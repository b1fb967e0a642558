"""Stops: impacts, several at once, rest and release, against formulas and against minimal coordinates."""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model, cos, dot, sin, sqrt, t
from symgen.runtime.contact import coulomb, instant
from symgen.runtime.contact.levels import NoSolution
from symgen.runtime.errors import RuntimeModelError

G = 9.81


def ball(restitution=0.8, **options) -> Model:
    m = Model("ball", gravity=(0, "-9.81 m/s^2"))
    x = m.coordinate("x", unit="m", start=1.0, **options)
    m.body("ball", mass=2.0, com=(0, x))
    m.stop("floor", x, m.parameter("e", restitution))
    return m


@pytest.fixture(scope="module")
def ball_system():
    return ball().derive()


@pytest.mark.parametrize("method", ["dop853", "dopri5", "radau5", "taylor"])
def test_a_ball_bounces_by_the_formula_and_comes_to_rest(ball_system, method):
    solution = ball_system.run(t_end=6.0, method=method)
    assert solution.status == "success" and solution.ok
    e, first = 0.8, np.sqrt(2.0 / G)
    times = [event.t for event in solution.events]
    expected = first * (1.0 + 2.0 * np.cumsum([0.0, *e ** np.arange(1, len(times))]))
    # Each flight's relative error grows with the number of bounces before it.
    np.testing.assert_allclose(times, expected, rtol=1e-7)
    rest = first * (1.0 + e) / (1.0 - e)
    assert rest - times[-1] < 1e-3
    assert solution.q[-1] == pytest.approx(0.0, abs=1e-14)
    assert solution.v[-1] == pytest.approx(0.0, abs=1e-14)
    assert solution["force(floor)"][-1] == pytest.approx(2.0 * G, rel=1e-12)
    assert solution.w[-1] == pytest.approx(-2.0 * G, rel=1e-9)
    flights = solution["force(floor)"][solution.t < times[0]]
    assert np.all(flights == 0.0)


def test_a_perfect_rebound_never_comes_to_rest(ball_system):
    solution = ball_system.run(t_end=20.0, method="dop853", parameters={"e": 1.0})
    assert solution.ok
    assert len(solution.events) == int(20.0 / np.sqrt(2.0 / G) / 2.0 + 0.5)
    assert solution.energy.final == pytest.approx(2.0 * G, rel=1e-9)


@pytest.mark.parametrize("with_friction", [False, True])
def test_a_reset_takes_a_body_off_the_stop_that_it_rests_on(with_friction):
    m = Model("lifted")
    x, z = m.coordinate("x"), m.coordinate("z", rate=1.0)
    m.kinetic(dot(x) ** 2 / 2 + dot(z) ** 2 / 2)
    m.potential(G * x)
    m.stop("floor", x)
    if with_friction:
        m.friction("rub", z, force=1e-9)
    lift = m.parameter("lift", 1.0)
    m.event("lifts", z - 1, direction="rising", then={"reset": {"x": lift}})
    solution = m.derive().run(1.2, method="dop853")
    assert [(event.name, event.action) for event in solution.events] == [
        ("lifts", "reset"),
        ("floor", "release"),
    ]
    assert solution["x"][-1] == pytest.approx(1.0 - G / 2 * 0.2**2, rel=1e-7)
    assert solution.ok
    solution = m.derive().run(1.2, method="dop853", parameters={"lift": -0.1})
    assert solution.status == "failed"
    assert "leads into stop 'floor': its gap is -0.1" in solution.message


def test_fixed_steps_keep_their_length_through_impacts(ball_system):
    solution = ball_system.run(t_end=3.0, method="rk4", step=1e-2, parameters={"e": 0.0})
    assert [event.action for event in solution.events] == ["impact"]
    assert np.quantile(solution.step_log[:, 1], 0.9) == pytest.approx(1e-2)
    assert solution.q[-1, 0] == pytest.approx(0.0, abs=1e-14)


def test_methods_that_cannot_are_refused_by_name(ball_system):
    with pytest.raises(RuntimeModelError, match="constraints"):
        ball_system.run(t_end=1.0, method="verlet4")


def test_auto_takes_a_method_that_can(ball_system):
    solution = ball_system.run(t_end=1.0)
    assert solution.ok and solution.method == "taylor"


def test_a_start_below_a_stop_is_refused(ball_system):
    with pytest.raises(RuntimeModelError, match="'floor' is violated at the start"):
        ball_system.run(t_end=1.0, method="dop853", start={"x": -0.1})


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
def test_a_start_a_hair_inside_a_stop_is_moved_out_of_it(ball_system, method):
    """As by numbers with eight digits: an error of the coordinate, so that it is measured in its parts."""
    lying = ball_system.run(t_end=1.0, method=method, start={"x": -2e-8}, rtol=1e-10)
    assert lying.ok and lying.q[-1, 0] == 0.0 and not lying.objections
    assert [note for note in lying.notes if "stops" in note] == [
        "assembly, out of stops, moved x from -2e-08 to 0"
    ]
    tilted = Model("tilted", gravity=(0, "-9.81 m/s^2"))
    phi, x = tilted.coordinate("phi", start=0.4), tilted.coordinate("x", start=0.02)
    tilted.body("rod", mass=1, inertia=0.01, com=(x, 0), angle=phi)
    tilted.stop("rest", 0.005 * (phi - 0.4 - 1e-7))
    system = tilted.derive()
    held = system.run(t_end=0.5, method=method)
    assert held.ok and not held.objections
    assert abs(held.q[0, 0] - 0.4 - 1e-7) < 1e-13 and held.q[0, 1] == 0.02
    with pytest.raises(
        RuntimeModelError, match=r"'rest' is violated at the start: .* closed = \['rest'\] in"
    ):
        system.run(t_end=0.5, method=method, start={"phi": 0.4 - 1e-4})  # 5e-7 of the gap, 1e-4 of the angle


def test_a_reset_a_hair_into_a_stop_is_moved_out_of_it():
    model = Model("dropped")
    x = model.coordinate("x", start=0.3)
    model.kinetic("dot(x)^2/2")
    model.potential("9.81*x")
    model.stop("floor", x)
    model.event("down", "t - 0.1", then={"reset": {x: "-1e-8", dot(x): 0}})
    run = model.derive().run(t_end=0.5, method="dop853", rtol=1e-11)
    assert run.ok and not run.objections and run.q[-1, 0] == 0.0


def test_rest_and_impact_at_the_start(ball_system):
    lying = ball_system.run(t_end=1.0, method="dop853", start={"x": 0.0})
    assert lying.ok and not lying.events and lying.q[-1, 0] == 0.0
    thrown = ball_system.run(
        t_end=0.1, method="dop853", start={"x": 0.0}, rate={"x": -1.0}, parameters={"e": 0.5}
    )
    assert thrown.ok and thrown.v[0, 0] == pytest.approx(0.5)
    assert thrown.w[-1] == pytest.approx(-0.75)


def cradle(spacing: float) -> Model:
    m = Model("cradle")
    x = [m.coordinate(f"x{k}", start=k * (1.0 + spacing), rate=1.0 if k == 0 else 0.0) for k in range(3)]
    for k in range(3):
        m.body(f"b{k}", mass=1.0, com=(x[k], 0))
    for k in range(2):
        m.stop(f"s{k}", x[k + 1] - x[k] - 1.0, 1.0)
    return m


@pytest.mark.parametrize(
    ("spacing", "expected"),
    [
        (1e-6, [0.0, 0.0, 1.0]),  # one impact after the other
        (0.0, [-1 / 3, 2 / 3, 2 / 3]),  # all at once: Newton's law in Moreau's form
    ],
)
def test_three_balls_in_a_row(spacing, expected):
    solution = cradle(spacing).derive().run(t_end=1.0, method="dop853")
    assert solution.ok
    np.testing.assert_allclose(solution.v[-1], expected, atol=1e-12)
    assert solution.energy.final == pytest.approx(0.5)


def spring_crank(minimal: bool) -> Model:
    """A slider-crank with a spring, its slider against a stop: in one coordinate, or three and two constraints."""
    m = Model("crank_" + ("minimal" if minimal else "redundant"))
    r, l = 0.1, 0.3
    theta = m.coordinate("theta", start=1.2, rate=-3.0)
    if minimal:
        x, phi = r * cos(theta) + sqrt(l**2 - r**2 * sin(theta) ** 2), None
    else:
        x, phi = m.coordinate("x", guess=0.3), m.coordinate("phi", guess=-0.3)
        m.constraint("closes_x", r * cos(theta) + l * cos(phi) - x)
        m.constraint("closes_y", r * sin(theta) + l * sin(phi))
    m.kinetic("0.002*dot(theta)^2")
    m.body("slider", mass=0.4, com=(x, 0))
    m.potential(20.0 * (x - 0.45) ** 2)
    m.stop("wall", 0.385 - x, 0.6)
    return m


def test_a_stop_in_a_loop_strikes_as_in_minimal_coordinates():
    one, many = (
        spring_crank(minimal).derive().run(t_end=1.5, method="dop853", rtol=1e-10)
        for minimal in (True, False)
    )
    assert one.ok and many.ok
    assert len(one.events) > 5
    # Resting begins below a tolerance on gaps, which the two need not meet at the same bounce.
    early = [event.t for event in one.events if event.t < 0.5]
    np.testing.assert_allclose([event.t for event in many.events][: len(early)], early, rtol=1e-7)
    np.testing.assert_allclose(many["theta"], one["theta"], atol=1e-7)
    assert many["force(wall)"][-1] == pytest.approx(one["force(wall)"][-1], rel=1e-6)
    assert many["force(wall)"][-1] > 0.1
    assert many.constraint_residual.max_position < 1e-11


def pressed_mass() -> Model:
    """A mass pressed on a stop by a spring whose end goes to and fro."""
    m = Model("pressed")
    x = m.coordinate("x", start=0.0, rate=0.0)
    m.body("b", mass=1.0, com=(x, 0))
    m.potential("50*(x + 0.2*cos(3*t))^2")
    m.stop("wall", x)
    return m


@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor"])
def test_a_stop_lets_go_when_it_would_pull(method):
    solution = pressed_mass().derive().run(t_end=0.9, method=method, rtol=1e-9, atol=1e-11)
    assert solution.ok
    assert [event.action for event in solution.events] == ["release"]
    free = np.pi / 6.0
    assert solution.events[0].t == pytest.approx(free, rel=1e-9)
    # x'' = -100 (x + 0.2 cos 3t) from rest at t = pi/6
    w, a = 10.0, -20.0 / (100.0 - 9.0)
    s = solution.t[solution.t > free] - free
    exact = -a * (np.sin(3 * s) - 3 / w * np.sin(w * s))
    np.testing.assert_allclose(solution["x"][solution.t > free], exact, atol=1e-8)
    pressing = solution.t < free
    np.testing.assert_allclose(
        solution["force(wall)"][pressing], 20.0 * np.cos(3 * solution.t[pressing]), atol=1e-9
    )


def test_a_stop_that_was_hit_lets_go_again():
    m = Model("hit")
    x = m.coordinate("x", start=0.5, rate=0.0)
    m.body("b", mass=1.0, com=(x, 0))
    m.force(x, "4*t - 6")
    m.stop("wall", x)
    solution = m.derive().run(t_end=3.0, method="dop853")
    assert solution.ok
    assert [event.action for event in solution.events] == ["impact", "release"]
    assert solution.events[1].t == pytest.approx(1.5, rel=1e-10)
    assert solution.q[-1, 0] == pytest.approx(4.0 * 1.5**3 / 6.0, rel=1e-9)


def test_a_moving_stop_carries_and_throws():
    m = Model("table", gravity=(0, -10.0))
    x = m.coordinate("x", start=0.0, rate=2.0)
    m.body("b", mass=1.0, com=(0, x))
    m.stop("table", x - 0.1 * sin(20 * t))
    solution = m.derive().run(t_end=0.1, method="dop853", rtol=1e-10, atol=1e-12)
    assert solution.ok and solution.system.nw == 1
    assert solution.events[0].action == "release"
    leaving = np.arcsin(10.0 / (0.1 * 400.0)) / 20.0  # where the table falls away faster than the mass
    assert solution.events[0].t == pytest.approx(leaving, rel=1e-8)
    rise = solution.t[-1] - leaving
    expected = 0.1 * np.sin(20 * leaving) + 2.0 * np.cos(20 * leaving) * rise - 5.0 * rise**2
    assert solution.q[-1, 0] == pytest.approx(expected, rel=1e-8)


def block(tilt: float, points) -> Model:
    m = Model("block", gravity=(0, -G))
    b, h = 0.5, 1.0
    height = 0.5 * (b * abs(np.sin(tilt)) + h * np.cos(tilt))
    y, a = m.coordinate("y", start=height), m.coordinate("a", start=tilt)
    m.body("block", mass=3.0, inertia=3.0 / 12.0 * (b**2 + h**2), com=(0, y), angle=a)
    for k, s in enumerate(points):
        m.stop(f"foot{k}", y + s * b * sin(a) - h / 2 * cos(a), 0.0)
    return m


def test_a_rocking_block_calms_down_between_its_corners():
    solution = block(0.1, (-0.5, 0.5)).derive().run(t_end=6.0, method="dop853")
    assert solution.ok
    assert {event.name for event in solution.events} == {"foot0", "foot1"}
    np.testing.assert_allclose(solution.q[-1], [0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(solution.contact_forces[-1], [1.5 * G, 1.5 * G], rtol=1e-9)


def test_the_first_rock_loses_the_angular_velocity_that_angular_momentum_says():
    """About the new corner: for x-guided blocks the corner slides, and only the normal impulse acts."""
    solution = block(0.1, (-0.5, 0.5)).derive().run(t_end=3.0, method="dop853", rtol=1e-10)
    impacts = [e for e in solution.events if abs(e.q_before[1]) < 1e-9]
    first = impacts[0]
    J, mass, arm = 3.0 / 12.0 * 1.25, 3.0, 0.25
    # y' and a' before: the old corner stays on the ground; afterwards the new one does, or both do.
    ratio = (J - mass * arm**2) / (J + mass * arm**2)
    assert ratio > 0.0
    assert first.v_after[1] == pytest.approx(ratio * first.v_before[1], rel=1e-8)


def test_more_feet_than_are_needed_share_the_weight():
    solution = block(0.0, (-0.5, 0.0, 0.5)).derive().run(t_end=0.5, method="dop853")
    assert solution.ok and not solution.events
    assert solution.contact_forces[-1].sum() == pytest.approx(3.0 * G, rel=1e-9)
    assert np.all(solution.contact_forces >= -1e-9)


def test_a_ball_with_a_quaternion_lands():
    m = Model("landing", gravity=(0, 0, -G))
    m.body("ball", mass=1.0, com=(0, 0, 0), inertia=(0.1, 0.1, 0.1))
    m.joint("fly", "free", child="ball", start=(0, 0, 1.0, 1, 0, 0, 0), rate=(0.3, 0, 0, 1, 2, 3))
    m.stop("floor", "fly_z - 0.2", 0.5)
    solution = m.derive().run(t_end=3.0, method="dop853")
    assert solution.ok
    assert solution["fly_z"][-1] == pytest.approx(0.2, abs=1e-12)
    assert solution["fly_x"][-1] == pytest.approx(0.9, rel=1e-9)
    assert solution["force(floor)"][-1] == pytest.approx(G, rel=1e-9)


def test_joint_limits_with_restitution_are_stops():
    m = Model("arm", gravity=(0, -G))
    m.body("link", mass=1.0, com=(0.5, 0), inertia=0.1)
    m.joint("hinge", "revolute", child="link", start=0.3, limits=(-0.5, 0.5), restitution=0.4)
    system = m.derive()
    assert [switch["name"] for switch in system.switches] == ["hinge_lower", "hinge_upper"]
    solution = system.run(t_end=4.0, method="dop853")
    assert solution.ok
    assert solution["hinge"].min() > -0.5 - 1e-9
    assert solution["hinge"][-1] == pytest.approx(-0.5, abs=1e-12)
    assert solution["force(hinge_lower)"][-1] == pytest.approx(0.5 * G * np.cos(0.5), rel=1e-9)


@pytest.mark.parametrize("method", ["rk4", "dop853"])
def test_a_stop_that_is_driven_into_is_refused(method):
    """No impulse changes what a constraint prescribes."""
    m = Model("driven")
    x = m.coordinate("x", start=1.0)
    m.body("b", mass=1.0, com=(x, 0))
    m.constraint("drive", x - 1 + 0.2 * sin(3 * t))
    m.stop("wall", x - 0.9, restitution=0.5)
    solution = m.derive().run(t_end=1.0, method=method, step=None if method == "dop853" else 1e-3)
    assert solution.status == "failed"
    assert "the stops wall cannot all be kept at t = " in solution.message


def on_a_ring() -> Model:
    """A bead on a ring between two walls, of which one is soft, and pushed to and fro."""
    m = Model("bead")
    x, y = m.coordinate("x", start=0.6), m.coordinate("y", guess=-0.8)
    m.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    m.potential(9.81 * y)
    m.force(x, 12 * cos(t))
    m.constraint("ring", x**2 + y**2 - 1)
    m.stop("hard", x + 0.1, 0.9)
    m.stop("soft", 0.7 - x, 0.0)
    return m


def rod() -> Model:
    m = Model("rod", gravity=(0, -G))
    y, phi = m.coordinate("y", start=1.0), m.coordinate("phi", start=0.3)
    m.body("rod", mass=1.0, inertia=1.0 / 12.0, com=(0, y), angle=phi)
    m.stop("left", y - sin(phi) / 2, 0.4)
    m.stop("right", y + sin(phi) / 2, 0.4)
    return m


@pytest.mark.parametrize("model", [on_a_ring, rod])
def test_stops_without_frictions_take_the_short_way_to_the_same_bits(model, monkeypatch):
    system = model().derive()
    short = system.run(t_end=3.0, method="dop853")
    made = instant.Instant.__init__

    def as_if_there_were_frictions(self, *args):
        made(self, *args)
        self.has_frictions = True

    monkeypatch.setattr(instant.Instant, "__init__", as_if_there_were_frictions)
    whole = system.run(t_end=3.0, method="dop853")
    actions = {event.action for event in short.events}
    assert "impact" in actions and ("release" in actions or model is rod)
    assert [repr(event) for event in short.events] == [repr(event) for event in whole.events]
    np.testing.assert_array_equal(short.states, whole.states)


def test_forces_of_stops_alone_are_those_of_the_whole_problem_to_the_bit():
    random, nothing = np.random.default_rng(5), np.zeros(0)
    for n in (1, 2, 3):
        for _ in range(30):
            root = random.normal(size=(n, n)) * 10.0 ** random.uniform(-3.0, 3.0)
            compliance, free = root @ root.T, random.normal(size=n)
            acting = random.uniform(size=n) < 0.8
            whole = coulomb._linear_forces(compliance, free, acting, nothing, nothing, np.zeros((0, n)))
            np.testing.assert_array_equal(coulomb.stop_forces(compliance, free, acting), whole)
    for own, free in ((0.0, -1.0), (1.0, np.nan), (np.nan, -1.0), (1.0, -np.inf)):
        for find in (coulomb.stop_forces, lambda *a: coulomb.lemke(a[0], a[1])):
            with pytest.raises(NoSolution):
                find(np.array([[own]]), np.array([free]), np.array([True]))


AT_A_WALL = """
name = "at_a_wall"
[parameters]
m = 1.0
e = 0.0
[coordinates]
x1 = { start = 0.6 }
y1 = { start = -0.8 }
x2 = { start = 2.0 }
y2 = { guess = -2.0 }
[energy]
kinetic = "dot(x1)^2/2 + dot(y1)^2/2 + m/2*(dot(x2)^2 + dot(y2)^2)"
potential = "9.81*y1 + 9.81*m*y2"
[constraints]
first = "x1^2 + y1^2 - 1"
second = "(x2 - x1)^2 + (y2 - y1)^2 - 2.25"
[stops.wall]
gap = "x1 + 0.1"
restitution = "e"
"""


def test_a_force_that_is_round_off_where_it_falls_through_zero_does_not_keep_a_stop_closed_for_good():
    """On the constraints again, the force had the other sign at the event, which then never came again."""
    model = Model.from_toml(AT_A_WALL).derive()
    cases = [
        ("taylor", 0.0, 1.7),
        ("radau5", 0.5, 1.6),
        ("radau5", 0.5, 2.0),
        ("bdf", 0.5, 1.7),
        ("bdf", 0.5, 1.8),
    ]
    for method, e, m in cases:
        options = {"rtol": 1e-10, "atol": 1e-12, "parameters": {"m": m, "e": e}}
        run = model.run(3.4, method=method, **options)
        assert run.ok
        reference = model.run(3.4, method="dop853", **options)
        np.testing.assert_allclose(run.states[-1], reference.states[-1], rtol=0, atol=1e-5)
        assert {round(x.t, 6) for x in run.events if x.action == "release"} == {
            round(x.t, 6) for x in reference.events if x.action == "release"
        }


def test_a_stop_is_let_go_once():
    """Where its force fell through zero, by round-off, it was told that it opened, and once more when it did."""
    m = Model("pendulum_at_a_wall", gravity=(0, -G))
    length, mass, rate, angle = 1.1250954666046669, 1.8458207014543633, 8.429799831716355, 0.21260359499529594
    x0, y0 = length * np.sin(angle), -length * np.cos(angle)
    x, y = m.coordinate("x", start=x0), m.coordinate("y", start=y0)
    m.body("bob", mass=mass, com=(x, y))
    m.constraint("rod", x**2 + y**2 - length**2)
    m.stop("wall", gap=x - x0)
    m.load("pull", point=(x, y), force=[rate * t, 0])
    release = mass * G * np.tan(angle) / rate
    run = m.derive().run(1.1 * release, method="dop853")
    assert run.ok
    assert [(e.name, e.action) for e in run.events] == [("wall", "release")]
    assert run.events[0].t == pytest.approx(release, rel=1e-12)
