"""Reactions and accelerations in states and forces: against SciPy with equations that are written a second time."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from recorded import assert_same_recording, record
from scipy.integrate import cumulative_simpson, solve_ivp

from symgen import Model
from symgen.errors import ModelError
from symgen.link import derive, derive_text
from symgen.model.toml_reader import read_text
from symgen.runtime import load, solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.recording.resume import Resumed
from symgen.runtime.recording.verify import verify

G = 9.81
ALLOWED = {1: 5e-2, 2: 2e-4, 3: 1e-6, 4: 1e-8}
EVERY_FORM = [("projection", name) for name, m in METHODS.items() if m.form == "projection"]
EVERY_FORM += [(form, name) for form, methods in FORMS.items() for name in methods]


def reference(derivative, start, t):
    """The end of a motion whose equations are written by hand."""
    return solve_ivp(derivative, (0.0, t), start, rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]


def run(system, method, t_end, **more):
    adaptive = METHODS[method].adaptive
    how = {"rtol": 1e-9, "atol": 1e-11} if adaptive else {"step": 1e-3}
    return system.run(t_end=t_end, method=method, **how, **more)


def ends(solution, names):
    return [solution[name][-1] for name in names]


@functools.cache
def weighed():
    """A pendulum: a load cell at its pin and an accelerometer, both with a lag, and a controller that uses them."""
    m = Model("weighed", gravity=(0, -G))
    m.parameters(tau=0.05, k=0.05)
    m.body("rod", mass=1, inertia=0.1, com=(0.5, 0))
    m.joint("pin", "revolute", "rod", start=0.3, damping=0.1)
    m.state("cell", "(reaction(pin, fy) - cell)/tau", start=1.0)
    m.state("lagging", "(acceleration(pin) - lagging)/tau")
    m.force("pin", "k*cell - 0.03*lagging")
    m.output("fy", "reaction(pin, fy)")
    m.event("heavy", "cell - 12", "rising")
    return m


@functools.cache
def weighing():
    return weighed().derive()


def weighed_by_hand(t, y, k=0.05):
    angle, w, cell, lagging = y
    a = (k * cell - 0.03 * lagging - 0.1 * w - G * 0.5 * np.cos(angle)) / 0.35
    fy = 0.5 * (np.cos(angle) * a - np.sin(angle) * w**2) + G
    return [w, a, (fy - cell) / 0.05, (a - lagging) / 0.05]


WEIGHED = ("pin", "dot(pin)", "cell", "lagging")


@pytest.mark.parametrize("method", METHODS)
def test_a_load_cell_and_an_accelerometer_by_every_method(method):
    if method in ("verlet4", "verlet6", "verlet8"):
        with pytest.raises(RuntimeModelError, match="has first-order states"):
            run(weighing(), method, 2.0)
        return
    solution = run(weighing(), method, 2.0)
    allowed = 3e-7 if METHODS[method].adaptive else ALLOWED.get(METHODS[method].order, 1e-8)
    expected = reference(weighed_by_hand, [0.3, 0.0, 1.0, 0.0], 2.0)
    np.testing.assert_allclose(ends(solution, WEIGHED), expected, rtol=0, atol=2 * allowed)
    assert not solution.objections
    assert solution.energy.max_error < max(1e-7, allowed)


@functools.cache
def bead():
    """A bead on a wire, a constraint, that rubs in proportion to what a sensor that lags says of the wire's force."""
    m = Model("bead", gravity=(0, -G))
    m.parameters(tau=0.1, mu=0.2)
    m.body("bead", mass=2, com=("x", "y"))
    m.coordinate("x", start=0.6, rate=0.8)
    m.coordinate("y", start=-0.8, rate=0.6)
    m.constraint("wire", "x^2/2 + y^2/2 - 1/2")
    m.state("N", "(reaction(wire) - N)/tau", start=1.0)
    m.state("ax", "(acceleration(bead, x) - ax)/(2*tau)")
    m.force("x", "-mu*sqrt(N^2 + 1)*tanh(dot(x)) - 0.3*ax")
    m.force("y", "-mu*sqrt(N^2 + 1)*tanh(dot(y))")
    m.output("wire_force", "reaction(wire)")
    return m.derive()


def bead_by_hand(t, s):
    x, y, u, v, N, lag = s
    rub = 0.2 * np.sqrt(N**2 + 1)
    fx, fy = -rub * np.tanh(u) - 0.3 * lag, -rub * np.tanh(v) - 2 * G
    force = -(2 * (u * u + v * v) + x * fx + y * fy) / (x * x + y * y)
    ax, ay = (fx + x * force) / 2, (fy + y * force) / 2
    return [u, v, ax, ay, (force - N) / 0.1, (ax - lag) / 0.2]


@functools.cache
def bead_end():
    return reference(bead_by_hand, [0.6, -0.8, 0.8, 0.6, 1.0, 0.0], 1.0)


@pytest.mark.parametrize("form, method", EVERY_FORM)
def test_reactions_of_constraints_in_every_form(form, method):
    if method.startswith("verlet") and method != "verlet":
        return  # as of all models with states
    if form == "projection" and method.startswith("rattle"):
        return  # as of all models with constraints
    solution = run(bead(), method, 1.0, constraints=form)
    record = METHODS[method] if form == "projection" else FORMS[form][method]
    allowed = 1e-6 if record.adaptive else 20 * ALLOWED.get(record.order, 1e-7)
    found = ends(solution, ("x", "y", "dot(x)", "dot(y)", "N", "ax"))
    if form == "baumgarte" or (form == "none" and record.order < 4 and not record.adaptive):
        allowed = max(allowed, 0.2 if record.order == 1 else 5e-2)  # whose drift is no matter of sensors
    np.testing.assert_allclose(found, bead_end(), rtol=0, atol=allowed)


@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor"])
def test_what_is_recorded_of_a_sensor_is_what_states_follow(method):
    """In space: joints' forces and torques, and a point's acceleration, filtered a second time from the outputs."""
    m = Model("arm", gravity=(0.3, -0.2, -G))
    m.body("upper", mass=2, com=(0.2, 0.01, 0.02), inertia=[0.02, 0.05, 0.06, 0.001, 0.002, -0.001])
    m.body("lower", mass=1, com=(0.15, 0, -0.03), inertia=[0.01, 0.03, 0.02])
    m.joint("hip", "spherical", "upper", damping=0.02)
    m.joint("knee", "revolute", "lower", "upper", {"xyz": (0.4, 0, 0)}, axis=(0, 1, 0), start=0.7, rate=2.0)
    m.point("tip", "lower", (0.3, 0, 0))
    for part in ("fx", "fz", "ty"):
        m.state(f"lag_{part}", f"(reaction(knee, {part}) - lag_{part})/0.1")
        m.output(part, f"reaction(knee, {part})")
    m.state("lag_a", "(acceleration(tip, x, upper) - lag_a)/0.1")
    m.output("a", "acceleration(tip, x, upper)")
    m.force("knee", "-0.02*lag_fx - 0.01*lag_a")
    solution = run(m.derive(), method, 1.0, fps=2000)
    for name in ("fx", "fz", "ty", "a"):
        grown = np.exp(solution.t / 0.1)
        filtered = cumulative_simpson(solution[name] * grown / 0.1, x=solution.t, initial=0) / grown
        np.testing.assert_allclose(solution[f"lag_{name}"], filtered, rtol=0, atol=1e-6)
    assert solution.energy.max_error < 1e-7


def test_forces_follow_accelerations_of_what_they_push():
    """Added mass: a linear loop, which is solved."""
    m = Model("added")
    m.parameter("added", "3 kg")
    m.parameters(k="5 N/m", mass="2 kg")
    m.coordinate("x", unit="m", start=1.0)
    m.body("b", mass="mass", com=("x", 0))
    m.force("x", "-k*x - added*acceleration(x)")
    system = m.derive()
    for method in ("dop853", "radau5", "taylor", "verlet8"):
        solution = run(system, method, 3.0)
        np.testing.assert_allclose(solution["x"], np.cos(solution.t), rtol=0, atol=1e-7)
        assert solution.energy.max_error < 1e-6
    with pytest.raises(
        RuntimeModelError, match=r'acceleration\("x"\) and the force that follows it make each'
    ):
        system.run(t_end=1.0, parameters={"added": -2.5})


def test_loops_of_several_sensors_are_solved_together():
    """Two carts whose forces follow each other's accelerations and the force in the coupling between them."""
    m = Model("coupled", gravity=(0, -G))
    m.body("first", mass=2, com=(0, 0), inertia=0.1)
    m.body("second", mass=1, com=(0.3, -0.4), inertia=0.05)
    m.joint("rail", "prismatic", "first", axis=(1, 0))
    m.joint("pin", "revolute", "second", "first", start=0.4)
    m.force("rail", "1 - 0.2*acceleration(second, x) + 0.3*reaction(pin, fy)*dot(rail)")
    m.force("pin", "0.05*acceleration(rail) - 0.1*reaction(pin, fx)")
    system = m.derive()

    def by_hand(t, s):
        _, angle, u, w = s
        c, s_ = np.cos(angle), np.sin(angle)
        rx, ry = 0.3 * c + 0.4 * s_, 0.3 * s_ - 0.4 * c
        # Unknowns: ax, alpha, acceleration of the centre, the pin's force.
        A, b = np.zeros((6, 6)), np.zeros(6)
        A[0, :] = [2, 0, 0, 0, 1, 0]  # 2 ax = F - fx
        A[0, 2] += 0.2
        A[0, 5] -= 0.3 * u
        b[0] = 1
        A[1, :] = [0, 0, 1, 0, -1, 0]
        A[2, :] = [0, 0, 0, 1, 0, -1]
        b[2] = -G
        A[3, :] = [-1, ry, 1, 0, 0, 0]  # acx = ax - alpha ry - w^2 rx
        b[3] = -(w**2) * rx
        A[4, :] = [0, -rx, 0, 1, 0, 0]
        b[4] = -(w**2) * ry
        # 0.05 alpha = T + moment of the pin's force about the centre, at -r
        A[5, :] = [-0.05, 0.05, 0, 0, 0.1 - ry, rx]
        ax, alpha = np.linalg.solve(A, b)[:2]
        return [u, w, ax, alpha]

    expected = reference(by_hand, [0.0, 0.4, 0.0, 0.0], 1.5)
    for method in ("dop853", "radau5", "taylor"):
        solution = run(system, method, 1.5)
        found = ends(solution, ("rail", "pin", "dot(rail)", "dot(pin)"))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)


def test_forces_follow_reactions_of_what_they_do_not_touch():
    """No loop: any expression will do. One force follows another's."""
    m = Model("apart", gravity=(0, -G))
    m.body("rod", mass=1, inertia=0.1, com=(0.5, 0))
    m.joint("pin", "revolute", "rod", start=0.3)
    m.body("cart", mass=2, com=("x", 0))
    m.coordinate("x")
    m.body("other", mass=1, com=("z", 1))
    m.coordinate("z")
    m.definition("pressed", "sqrt(reaction(pin, fx)^2 + reaction(pin, fy)^2)")
    m.force("x", "-0.1*pressed*tanh(dot(x) - 1)")
    m.load("push", point=("z", 1), force=("0.3*acceleration(x)^2", 0))

    def by_hand(t, y):
        angle, w, _, u, _, v = y
        a = -G * 0.5 * np.cos(angle) / 0.35
        fx = 0.5 * (-np.cos(angle) * w * w - np.sin(angle) * a)
        fy = 0.5 * (np.cos(angle) * a - np.sin(angle) * w * w) + G
        ax = -0.1 * np.hypot(fx, fy) * np.tanh(u - 1) / 2
        return [w, a, u, ax, v, 0.3 * ax**2]

    system = m.derive()
    assert not system.events
    expected = reference(by_hand, [0.3, 0, 0, 0, 0, 0], 2.0)
    for method in ("dop853", "radau5", "taylor"):
        solution = run(system, method, 2.0)
        found = ends(solution, ("pin", "dot(pin)", "x", "dot(x)", "z", "dot(z)"))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)
        assert solution.energy.max_error < 1e-6


def test_a_run_ends_where_a_loop_comes_to_have_no_solution():
    """(2 - x) a = 0: it goes on at its speed until x = 2."""
    m = Model("ends")
    m.coordinate("x", start=1.0, rate=1.0)
    m.body("b", mass=2, com=("x", 0))
    m.force("x", "x*acceleration(x)")
    solution = m.derive().run(t_end=3)
    assert [e.name for e in solution.events] == ["loop_0"]
    assert solution.t[-1] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor", "bdf"])
def test_states_follow_stops_and_dry_friction(method):
    """A block that falls, stays, and rubs to rest: what the ground says is 0, then the weight."""
    m = Model("block", gravity=(0, -G))
    m.body("block", mass=2, com=("x", "y"))
    m.coordinate("x", start=0.0, rate=1.0)
    m.coordinate("y", start=0.2)
    m.stop("ground", "y")
    m.friction("sole", coordinate="x", coefficient=0.4, normal="ground")
    m.state("N", "(reaction(ground) - N)/0.05")
    m.state("impulse", "reaction(sole)")
    solution = m.derive().run(t_end=1.0, method=method)
    landed = np.sqrt(0.4 / G)
    since = np.maximum(solution.t - landed, 0.0)
    np.testing.assert_allclose(solution["N"], 2 * G * (1 - np.exp(-since / 0.05)), rtol=0, atol=1e-5)
    # What takes the momentum that the blow leaves, mu times that of the fall less.
    left = 2 * (1.0 - 0.4 * G * landed)
    assert solution["impulse"][-1] == pytest.approx(-left, abs=1e-5)


def test_reactions_over_kinks_end_steps():
    m = Model("kinks", gravity=(0, -G))
    m.body("rod", mass=1, inertia=0.1, com=(0.5, 0))
    m.joint("pin", "revolute", "rod", start=0.3)
    m.state("N", "abs(reaction(pin, fy) - 9)")
    m.force("pin", "where(N > 3, -1, 0)")
    system = m.derive()
    solutions = [run(system, method, 2.0) for method in ("dop853", "taylor", "radau5")]

    def by_hand(t, y):
        angle, w, N = y
        a = ((-1 if N > 3 else 0) - G * 0.5 * np.cos(angle)) / 0.35
        return [w, a, abs(0.5 * (np.cos(angle) * a - np.sin(angle) * w * w) + G - 9)]

    expected = solve_ivp(by_hand, (0, 2), [0.3, 0, 0], rtol=1e-10, atol=1e-12, max_step=5e-4).y[:, -1]
    for solution in solutions:
        found = ends(solution, ("pin", "dot(pin)", "N"))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor", "gauss8", "generalized_alpha"])
def test_a_drive_that_gives_way_to_its_load(method):
    """A velocity constraint whose speed is a state that the constraint's force slows down: a loop by way of gamma."""
    m = Model("drive")
    m.coordinate("x", rate_guess=0.2)
    m.coordinate("y")
    m.body("b", mass=1, com=("x", "y"))
    m.force("y", "1 - dot(y)")
    m.state("u", "0.5 - 0.3*reaction(drive) - u", start=0.2)
    m.velocity_constraint("drive", "dot(x) - u - 0.1*y")

    def by_hand(t, s):
        _, y, vy, u = s
        force = (0.5 - u + 0.1 * vy) / 1.3
        return [u + 0.1 * y, vy, 1 - vy, 0.5 - 0.3 * force - u]

    solution = run(m.derive(), method, 2.0)
    expected = reference(by_hand, [0, 0, 0, 0.2], 2.0)
    allowed = 1e-5 if method == "generalized_alpha" else 1e-7
    np.testing.assert_allclose(ends(solution, ("x", "y", "dot(y)", "u")), expected, rtol=0, atol=allowed)
    assert solution.energy.max_error < 1e-5


def bristled(guide: str) -> Model:
    m = Model("bristles", gravity=(0, -G))
    m.body("block", mass=1, com=("x", "y"))
    m.coordinate("x")
    m.coordinate("y")
    m.constraint("guide", guide)
    m.load("push", point=("x", "y"), force=("6*sin(3*t)", "-4*sin(2*t)"))
    m.bristle(
        "z", coordinate="x", stiffness=500, damping=5, viscous=0.4, coulomb="0.3*reaction(guide)",
        static="0.4*reaction(guide)", stribeck=0.1,
    )  # fmt: skip
    return m


@pytest.mark.parametrize("method", ["dop853", "radau5", "bdf"])
def test_bristles_are_pressed_by_a_reaction(method):
    """LuGre on a guide; a bent one feels the friction, whose level is under a fraction: a loop that is refused."""

    def by_hand(t, s):
        _, v, z = s
        normal = G + 4 * np.sin(2 * t)
        dz = v - 500 * abs(v) / (normal * (0.3 + 0.1 * np.exp(-((v / 0.1) ** 2)))) * z
        return [v, 6 * np.sin(3 * t) - 500 * z - 5 * dz - 0.4 * v, dz]

    expected = solve_ivp(by_hand, (0, 2), [0, 0, 0], rtol=1e-11, atol=1e-13, method="LSODA").y[:, -1]
    solution = run(bristled("y").derive(), method, 2.0)
    np.testing.assert_allclose(ends(solution, ("x", "dot(x)", "z")), expected, rtol=0, atol=1e-6)
    with pytest.raises(ModelError, match="determine each other, and that is not linear"):
        bristled("y - x^2/10").derive()


def test_derivatives_linear_models_and_advice():
    m = Model("linear", gravity=(0, -G))
    m.parameters(k=0.05, tau=0.05)
    m.body("rod", mass=1, inertia=0.1, com=(0.5, 0))
    m.joint("pin", "revolute", "rod", start=0.3, damping=0.1)
    m.state("N", "(reaction(pin, fy) - N)/tau", start=1.0)
    m.force("pin", "k*N - 0.03*acceleration(pin) + 0.01*reaction(pin, fx)")
    system = m.derive(jacobian=True)
    p, y = system.parameter_values(), np.array([0.4, 0.0, -0.7, 0.9])

    def rhs(y, p):
        return system.kernel("rhs")(0.0, y, p)[:4]

    by_state = np.array([(rhs(y + h, p) - rhs(y - h, p)) / 2e-6 for h in 1e-6 * np.eye(4)]).T
    by_parameters = np.array([(rhs(y, p + h) - rhs(y, p - h)) / 2e-6 for h in 1e-6 * np.eye(2)]).T
    found = system.kernel("rhs_by_state")(0.0, y, p).reshape(4, 4)
    np.testing.assert_allclose(found, by_state, atol=1e-7)
    found = system.kernel("rhs_by_parameters")(0.0, y, p).reshape(4, 2)
    np.testing.assert_allclose(found, by_parameters, atol=1e-5)
    linear = system.linearise(at=(y[:2], y[2:]))
    assert linear.states == ["pin", "dot(pin)", "N"]
    np.testing.assert_allclose(linear.A, by_state[np.ix_([0, 2, 3], [0, 2, 3])], atol=1e-7)


def test_starts_in_balance_know_what_states_follow():
    m = Model("rest", gravity=(0, -G))
    m.body("rod", mass=1, inertia=0.1, com=(0.5, 0))
    m.joint("pin", "revolute", "rod", guess=-1.3, damping=0.1)
    m.state("N", "(reaction(pin, fy) - N)/0.05", guess=1.0)
    m.force("pin", "0.05*N")
    m.start(steady=True)
    solution = m.derive().run(t_end=1.0)
    assert solution["pin"] == pytest.approx(np.full(len(solution.t), -np.arccos(0.1)), abs=1e-9)
    assert solution["N"] == pytest.approx(np.full(len(solution.t), G), abs=1e-9)


def test_ensembles_events_and_stepping():
    system, gains = weighing(), np.array([0.01, 0.05, 0.2])
    for method in ("dop853", "radau5", "taylor"):
        members = system.ensemble(1.0, n=3, parameters={"k": gains}, method=method, keep=["pin", "cell"])
        for row, k in enumerate(gains):
            expected = reference(functools.partial(weighed_by_hand, k=k), [0.3, 0, 1, 0], 1.0)
            found = [np.array(members[name]).ravel()[row] for name in ("pin", "cell")]
            np.testing.assert_allclose(found, expected[[0, 2]], rtol=0, atol=1e-5)

    def heavy(t, y):
        return y[2] - 12

    heavy.direction = 1
    crossing = solve_ivp(weighed_by_hand, (0, 2), [0.3, 0, 1, 0], rtol=1e-11, atol=1e-12, events=heavy)
    solution = run(system, "dop853", 2.0)
    np.testing.assert_allclose([e.t for e in solution.events], crossing.t_events[0], rtol=0, atol=1e-8)


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_recordings_go_on_bit_for_bit(tmp_path, method):
    text = derive_text(weighed()).text
    system = load(text)
    whole, first, rest = (tmp_path / f"{name}.rrd" for name in ("whole", "first", "rest"))
    record(whole, text, lambda **more: solve(system, 2.0, method=method, fps=50, **more))
    record(first, text, lambda **more: solve(system, 1.0, method=method, fps=50, **more))
    record(rest, text, lambda **more: Resumed(first).run(2.0, **more))
    assert_same_recording(whole, rest)
    assert verify(rest).ok


def test_files_say_the_same():
    text = weighed().to_toml()
    assert 'derivative = "(reaction(\\"pin\\", \\"fy\\") - cell)/tau"' in text or "reaction(pin, fy)" in text
    again = derive(read_text(text))
    first, second = (run(system, "dop853", 1.0) for system in (weighing(), again))
    assert np.array_equal(first.q, second.q)


def cart(m: Model) -> None:
    m.coordinate("x", start=1.0)
    m.body("b", mass=2, com=("x", 0))


def refused_square(m):
    cart(m)
    m.force("x", "-0.1*acceleration(x)^2")


def refused_growth(m):
    cart(m)
    m.force("x", "3*acceleration(x)")


def refused_contact(m):
    cart(m)
    m.coordinate("y", start=0.2)
    m.body("c", mass=1, com=("x", "y"))
    m.stop("ground", "y")
    m.force("x", "-0.3*reaction(ground)*tanh(dot(x))")


def refused_redundance(m):
    cart(m)
    m.coordinate("y")
    m.body("c", mass=1, com=("x", "y"))
    m.constraint("one", "y")
    m.constraint("two", "2*y")
    m.state("N", "reaction(one) - N")


def refused_massless(m):
    cart(m)
    m.coordinate("n")
    m.potential("(x - n)^2/2 + n^2/2")
    m.force("n", "0.1*acceleration(x)")


def refused_start(m):
    m.coordinate("y", guess=0.2)
    m.body("c", mass=1, com=(0, "y"))
    m.stop("ground", "y")
    m.state("N", "reaction(ground) - N")
    m.start(steady=True, closed="ground")


def refused_potential(m):
    cart(m)
    m.potential("x*acceleration(x)")


REFUSALS = {
    "square": (
        refused_square,
        r"\[forces\] x: acceleration.*determine each other, and that is not linear.*state",
    ),
    "growth": (refused_growth, "each makes the other grow"),
    "contact": (refused_contact, "the model has stops or dry friction.*filter it through a state"),
    "redundance": (refused_redundance, r'reaction\("one"\) is not unique, as \'two\' follow'),
    "massless": (refused_massless, "the force on 'n', which has no inertia, follows"),
    "start": (refused_start, "at a start in balance, stops and dry friction decide"),
    "potential": (refused_potential, "the potential energy cannot depend on a reaction or an acceleration"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_what_has_no_answer_is_refused_by_name(case):
    m = Model("refused", gravity=(0, -G))
    change, says = REFUSALS[case]
    with pytest.raises(ModelError, match=says):
        change(m)
        m.derive()


LANDING = """
[parameters]
g = "9.81 m/s^2"
m = "1 kg"
c = "0.01 s/kg"
[coordinates]
a = { unit = "rad", start = 0.5 }
n = { unit = "m", start = 0 }
[bodies.b]
mass = "m"
com = [0, "-1 m", 0]
inertia = [0.1, 0.1, 0.1]
[joints.pin]
type = "revolute"
child = "b"
axis = [0, 0, 1]
coordinate = "a"
[energy]
kinetic = "m*dot(n)^2/2"
[gravity]
y = "-g"
[events.look]
when = "a"
direction = "falling"
then = { reset = { "dot(n)" = "c*reaction(pin, fy)" } }
"""


@pytest.mark.parametrize("method", ["taylor", "dop853", "radau5", "bdf", "generalized_alpha"])
def test_resets_read_reactions_of_the_moment_before(method):
    solution = run(derive(read_text(LANDING)), method, 1.0)
    (event,) = solution.events
    # At the lowest place the pin holds m (g + l w^2), with w from the energy of a compound pendulum.
    spin = 2 * G * (1 - np.cos(0.5)) / 1.1
    assert event.v_after[1] == pytest.approx(
        0.01 * (G + spin), rel=1e-4 if method == "generalized_alpha" else 1e-8
    )
    assert solution.ok


def test_resets_read_no_reactions_beside_stops():
    text = (
        LANDING.replace("[coord", 'wall = "1 m"\n[coord')
        + '[stops.wall]\ngap = "wall - n"\nrestitution = 0.5\n'
    )
    with pytest.raises(
        ModelError, match=r"then.reset.dot\(n\).*with stops, contacts or friction.*\[states\]"
    ):
        derive(read_text(text))
