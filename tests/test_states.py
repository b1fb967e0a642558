"""First-order states against closed forms and SciPy's integration of equations written by hand; what takes part."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from recorded import assert_same_recording, record
from scipy.integrate import cumulative_simpson, solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.linalg import expm

from symgen import Model
from symgen.errors import ModelError
from symgen.link import derive, derive_text
from symgen.model import library
from symgen.runtime import load, solve
from symgen.runtime.errors import RuntimeModelError, UnknownNameError
from symgen.runtime.inputs import Controller
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.recording.resume import Resumed
from symgen.runtime.recording.verify import verify

G = 9.81
T_END = 2.0
STEP = 1e-3
# What fixed steps of 1e-3 s leave of these motions, by order; adaptive methods have rtol 1e-9.
ALLOWED = {1: 2e-2, 2: 1e-4, 3: 1e-6, 4: 1e-8}
EVERY_FORM = [("projection", name) for name, m in METHODS.items() if m.form == "projection"]
EVERY_FORM += [(form, name) for form, methods in FORMS.items() for name in methods]
REFUSED = ("verlet4", "verlet6", "verlet8")  # need forces of positions alone


def reference(derivative, start, t=T_END):
    """The end of a motion whose equations are written by hand."""
    return solve_ivp(derivative, (0.0, t), start, rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]


def run(system, method, constraints="auto", t_end=T_END):
    record = METHODS[method] if constraints in ("auto", "projection") else FORMS[constraints][method]
    how = {"rtol": 1e-9, "atol": 1e-11} if record.adaptive else {"step": STEP}
    return system.run(t_end=t_end, method=method, constraints=constraints, **how), record


def check(solution, record, found, expected):
    assert solution.status == "success"
    allowed = 3e-7 if record.adaptive else ALLOWED.get(record.order, 1e-8)
    np.testing.assert_allclose(found, expected, rtol=0, atol=allowed)
    assert not [entry.says for entry in solution.health if not entry.ok]


@functools.cache
def motor():
    """A pendulum on the shaft of a DC motor with inductance."""
    m = Model("motor", gravity=(0, f"-{G} m/s^2"))
    m.coordinate("phi", unit="rad", start=0.3)
    m.parameters(R="2 ohm", L="5e-2 H", k="0.3 N*m/A", c="0.02 N*m*s", l="0.3 m")
    m.input("U", unit="V", default=6.0)
    m.state("current", "(U - R*current - k*dot(phi))/L", start="0.1 A", unit="A")
    m.body("rotor", mass="0.5 kg", com=("l*sin(phi)", "-l*cos(phi)"), inertia="0.01 kg*m^2", angle="phi")
    m.force("phi", "k*current - c*dot(phi)")
    m.output("torque", "k*current")
    return m


@functools.cache
def motor_system():
    return motor().derive()


def motor_by_hand(t, y, U=6.0):
    phi, w, i = y
    torque = 0.3 * i - 0.02 * w - 0.5 * G * 0.3 * np.sin(phi)
    return [w, torque / (0.01 + 0.5 * 0.09), (U - 2.0 * i - 0.3 * w) / 5e-2]


@functools.cache
def motor_end():
    return reference(motor_by_hand, [0.3, 0.0, 0.1])


@pytest.mark.parametrize("method", METHODS)
def test_a_motor_with_inductance_by_every_method(method):
    if method in REFUSED:
        with pytest.raises(RuntimeModelError, match="has first-order states"):
            run(motor_system(), method)
        return
    solution, record = run(motor_system(), method)
    found = [solution[name][-1] for name in ("phi", "dot(phi)", "current")]
    check(solution, record, found, motor_end())


@functools.cache
def on_a_circle():
    """A bob on a rod, as a constraint, pushed by an actuator that lags behind and feels the speed."""
    m = Model("circle", gravity=(0, f"-{G} m/s^2"))
    m.coordinate("x", unit="m", start=0.3)
    m.coordinate("y", unit="m", guess=-0.4)
    m.parameters(l="0.5 m", tau="0.1 s", k="3 N*s/m", u="4 N")
    m.state("f", "(u - f - k*dot(x))/tau", start="1 N", unit="N")
    m.body("bob", mass="1 kg", com=("x", "y"))
    m.force("x", "f")
    m.constraint("rod", "x^2 + y^2 - l^2")
    return m.derive()


@functools.cache
def circle_end():
    def by_hand(t, s):
        phi, w, force = s
        speed = 0.5 * np.cos(phi) * w
        return [w, (force * np.cos(phi) - G * np.sin(phi)) / 0.5, (4.0 - force - 3.0 * speed) / 0.1]

    phi, w, force = reference(by_hand, [np.arcsin(0.6), 0.0, 1.0])
    place = [0.5 * np.sin(phi), -0.5 * np.cos(phi)]
    return [*place, 0.5 * np.cos(phi) * w, 0.5 * np.sin(phi) * w, force]


@functools.cache
def driven():
    """A carriage whose speed is a state, and a mass on a spring behind it, which acts on the drive."""
    m = Model("driven")
    m.coordinate("x", unit="m", start=0.1)
    m.coordinate("y", unit="m", start=0.0)
    m.parameters(tau="0.2 s", k="50 N/m", c="2 N*s/m", w="1 m", slip="3 1/s^2", u="0.5 m/s")
    m.state("speed", "(u - speed)/tau - slip*(y - x)", start="0.2 m/s", unit="m/s")
    m.body("carriage", mass="1 kg", com=("x", 0))
    m.body("mass", mass="2 kg", com=("y", 0))
    m.potential("k/2*(x - y)^2")
    m.force("y", "-c*dot(y)")
    m.velocity_constraint("drive", "dot(x) - speed*cos(x/w)")
    return m.derive()


def driven_by_hand(t, s):
    x, y, w, z = s
    return [z * np.cos(x), w, (50.0 * (x - y) - 2.0 * w) / 2.0, (0.5 - z) / 0.2 - 3.0 * (y - x)]


@functools.cache
def driven_end():
    x, y, w, z = s = reference(driven_by_hand, [0.1, 0.0, 0.0, 0.2])
    rates = driven_by_hand(0.0, s)
    force = rates[3] * np.cos(x) - z * np.sin(x) * rates[0] + 50.0 * (x - y)
    return [x, y, z * np.cos(x), w, z], force


@pytest.mark.parametrize("form, method", EVERY_FORM)
def test_constraints_in_every_form(form, method):
    if method in REFUSED or (form == "projection" and method.startswith("rattle")):
        return  # as of all models with constraints
    solution, record = run(on_a_circle(), method, form)
    states = ("x", "y", "dot(x)", "dot(y)", "f")
    if form == "baumgarte":  # whose drift is no matter of states
        np.testing.assert_allclose([solution[x][-1] for x in states], circle_end(), rtol=0, atol=2e-2)
        return
    if form == "none":  # which is there to show drift: health says so where a method of low order makes any
        allowed = 3e-7 if record.adaptive else ALLOWED.get(record.order, 1e-8)
        np.testing.assert_allclose([solution[x][-1] for x in states], circle_end(), rtol=0, atol=allowed)
        assert {entry.check for entry in solution.objections} <= {
            "constraint position",
            "constraint velocity",
        }
        return
    check(solution, record, [solution[x][-1] for x in states], circle_end())


@pytest.mark.parametrize("form, method", EVERY_FORM)
def test_velocity_constraints_with_states_in_every_form(form, method):
    if method in REFUSED or method.startswith("rattle"):
        return  # as of all models with velocity constraints
    if form in ("ggl", "index3") and method in ("generalized_alpha", "hht"):
        with pytest.raises(RuntimeModelError, match="'drive' changes with a first-order state"):
            run(driven(), method, form)
        return
    solution, record = run(driven(), method, form)
    expected, force = driven_end()
    found = [solution[x][-1] for x in ("x", "y", "dot(x)", "dot(y)", "speed")]
    allowed = 3e-7 if record.adaptive else ALLOWED.get(record.order, 1e-8)
    np.testing.assert_allclose(found, expected, rtol=0, atol=allowed)
    np.testing.assert_allclose(solution["lambda(drive)"][-1], force, rtol=0, atol=20 * allowed)
    assert solution.energy.max_error < (1e-5 if record.adaptive else ALLOWED.get(record.order, 1e-8))


def test_a_lag_without_any_coordinate_follows_its_step():
    m = Model("lag")
    m.parameter("tau", "0.5 s")
    m.state("y", "(5 - y)/tau", start=1.0)
    solution = m.derive().run(t_end=2.0, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(solution["y"], 5.0 - 4.0 * np.exp(-solution.t / 0.5), rtol=0, atol=1e-9)
    assert solution.names() == ["y", "dot(y)"]


@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor", "gauss8"])
def test_a_controller_with_an_integral_is_the_matrix_exponential(method):
    """A mass under PI control of its speed: three linear equations."""
    m = Model("cruise")
    m.coordinate("x", unit="m", start=0.0)
    m.parameters(mass="1.5 kg", P="4 N*s/m", I="7 N/m", wanted="2 m/s", c="0.8 N*s/m")
    m.state("error", "wanted - dot(x)", unit="m")
    m.body("car", mass="mass", com=("x", 0))
    m.force("x", "P*(wanted - dot(x)) + I*error - c*dot(x)")
    solution, _ = run(m.derive(), method)
    A = np.array([[-(4.0 + 0.8) / 1.5, 7.0 / 1.5, 4.0 * 2.0 / 1.5], [-1.0, 0.0, 2.0], [0.0, 0.0, 0.0]])
    v, error, _ = expm(A * T_END) @ [0.0, 0.0, 1.0]
    found = [solution["dot(x)"][-1], solution["error"][-1]]
    np.testing.assert_allclose(found, [v, error], rtol=0, atol=1e-8)


def lugre(v, z):
    """How fast the bristles bend, and the friction."""
    s0, s1, s2, level = 1e4, 100.0, 0.4, 1.0 + 0.5 * np.exp(-((v / 0.05) ** 2))
    dz = v - s0 * abs(v) / level * z
    return dz, s0 * z + s1 * dz + s2 * v


@pytest.mark.parametrize("method", ["dop853", "radau5", "bdf", "dopri5"])
def test_friction_with_a_bristle(method):
    """LuGre: a block that a spring pulls along; it sticks and slips."""
    m = Model("bristle")
    m.coordinate("x", unit="m", start=0.0)
    m.parameters(s0="1e4 N/m", s1="100 N*s/m", s2="0.4 N*s/m", Fc="1 N", Fs="1.5 N", vs="0.05 m/s")
    m.parameters(k="20 N/m", drawn="0.1 m/s")
    m.definition("level", "Fc + (Fs - Fc)*exp(-(dot(x)/vs)^2)")
    m.definition("bending", "dot(x) - s0*abs(dot(x))/level*z")
    m.state("z", "bending", unit="m")
    m.body("block", mass="1 kg", com=("x", 0))
    m.force("x", "k*(drawn*t - x) - s0*z - s1*bending - s2*dot(x)")
    solution = m.derive().run(t_end=1.5, method=method, rtol=1e-9, atol=1e-11)

    def by_hand(t, s):
        x, v, z = s
        dz, friction = lugre(v, z)
        return [v, 20.0 * (0.1 * t - x) - friction, dz]

    exact = solve_ivp(by_hand, (0.0, 1.5), [0.0, 0.0, 0.0], rtol=1e-11, atol=1e-13, method="LSODA").y[:, -1]
    found = [solution[name][-1] for name in ("x", "dot(x)", "z")]
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-6)
    assert solution.energy.max_error < 1e-5


@functools.cache
def tumbling():
    """A free body that a wheel's torque, which lags and depends on the spin, turns about its own axis."""
    m = Model("tumbling")
    m.body("box", mass=2, com=(0, 0, 0), inertia=[0.02, 0.05, 0.04])
    m.joint("box", "free", "box", rate=[0.1, 0, 0, 1.0, 2.0, -0.5])
    m.axis("thrust", "box", (1, 0, 0))
    m.state("torque", "(0.3*sin(3*t) - 0.05*box_wx - torque)/0.2", start=0.1)
    m.load("jet", body="box", torque=["torque*thrust_x", "torque*thrust_y", "torque*thrust_z"])
    return m.derive()


def tumbling_by_hand(t, s):
    q, w, z = s[:4], s[4:7], s[7]
    J = np.array([0.02, 0.05, 0.04])
    dw = (np.array([z, 0.0, 0.0]) - np.cross(w, J * w)) / J
    turned = [-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]
    return [*(0.5 * np.array(turned)), *dw, (0.3 * np.sin(3 * t) - 0.05 * w[0] - z) / 0.2]


@pytest.mark.parametrize("method", ["dop853", "radau5", "bdf", "taylor", "gauss8", "rattle4", "rk4", "hht"])
def test_a_body_in_space(method):
    expected = reference(tumbling_by_hand, [1.0, 0.0, 0.0, 0.0, 1.0, 2.0, -0.5, 0.1])
    solution, record = run(tumbling(), method)
    found = [solution[f"box_{x}"][-1] for x in ("qw", "qx", "qy", "qz", "wx", "wy", "wz")]
    check(solution, record, [*found, solution["torque"][-1]], expected)


def test_a_potential_with_a_state_does_work():
    """A Maxwell element, a spring whose end creeps: the energy that the dashpot takes is counted."""
    m = Model("maxwell")
    m.coordinate("x", unit="m", start=0.2)
    m.parameters(k="30 N/m", c="12 N*s/m")
    m.state("creep", "k*(x - creep)/c", unit="m")
    m.body("block", mass="1 kg", com=("x", 0))
    m.potential("k/2*(x - creep)^2")
    solution = m.derive().run(t_end=3.0, fps=500, rtol=1e-10, atol=1e-12)
    A = np.array([[0.0, 1.0, 0.0], [-30.0, 0.0, 30.0], [2.5, 0.0, -2.5]])
    np.testing.assert_allclose(
        [solution[name][-1] for name in ("x", "dot(x)", "creep")], expm(3.0 * A) @ [0.2, 0.0, 0.0], atol=1e-8
    )
    loss = -12.0 * solution["dot(creep)"] ** 2
    lost = cumulative_simpson(loss, x=solution.t, initial=0.0)
    np.testing.assert_allclose(solution.energy.work, lost, rtol=0, atol=1e-7)
    assert solution.energy.max_error < 1e-7


def test_equal_mechanisms_with_states_are_one_kind():
    m = Model("many")
    for i in range(4):
        m.coordinate(f"x{i}", start=0.1 * i)
        m.parameter(f"k{i}", 10.0 + i)
        m.state(f"f{i}", f"10*(5 - k{i}*x{i} - f{i})", start=0.1)
        m.body(f"b{i}", mass=1, com=(f"x{i}", 0))
        m.force(f"x{i}", f"f{i} - dot(x{i})")
    system = m.derive()
    (kind,) = system.subsystems
    assert kind["rates"] == [[i, 4 + i] for i in range(4)]
    solution = system.run(t_end=3.0, rtol=1e-9, atol=1e-11)
    for i in range(4):
        A = np.array(
            [[0.0, 1.0, 0.0, 0.0], [0.0, -1.0, 1.0, 0.0], [-10.0 * (10.0 + i), 0.0, -10.0, 50.0], [0.0] * 4]
        )
        expected = (expm(3.0 * A) @ [0.1 * i, 0.0, 0.1, 1.0])[:3]
        found = [solution[name][-1] for name in (f"x{i}", f"dot(x{i})", f"f{i}")]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)


def test_a_state_is_watched_reset_and_read_by_controllers():
    m = Model("charge")
    m.coordinate("x")
    m.body("b", mass=1, com=("x", 0))
    m.force("x", "i - x")
    m.input("pull", default=0.0)
    m.state("i", "120 - 40*i + pull")
    m.event("full", "i - 1.5", "rising", {"reset": {"i": "0.5*i"}})
    system = m.derive()
    solution = system.run(t_end=0.2, method="dop853", rtol=1e-11, atol=1e-13)
    first, again = np.log(2.0) / 40.0, np.log(1.5) / 40.0
    expected = np.arange(first, 0.2, again)
    np.testing.assert_allclose([event.t for event in solution.events], expected, rtol=0, atol=1e-9)


def test_controllers_read_states():
    """A feedback of the current is a larger resistance."""
    law = Controller(lambda t, x: 6.0 - 3.0 * x[0], reads=["current"])
    solution = motor_system().run(t_end=1.0, inputs={"U": law}, rtol=1e-10, atol=1e-12)
    expected = reference(lambda t, y: motor_by_hand(t, y, 6.0 - 3.0 * y[2]), [0.3, 0.0, 0.1], 1.0)
    found = [solution[name][-1] for name in ("phi", "dot(phi)", "current")]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8)


def test_linear_models_have_states_and_no_integrals():
    linear = motor_system().linearise(start={"phi": -1.0})
    rest = np.arcsin(0.9 / (0.5 * G * 0.3))
    assert linear.states == ["phi", "dot(phi)", "current"]
    assert linear.outputs == ["phi", "current", "torque"]
    np.testing.assert_allclose([linear.q[0], linear.v[1]], [rest, 3.0], rtol=1e-12)
    J = 0.055
    A = [[0, 1, 0], [-0.5 * G * 0.3 * np.cos(rest) / J, -0.02 / J, 0.3 / J], [0, -0.3 / 0.05, -2.0 / 0.05]]
    np.testing.assert_allclose(linear.A, A, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(linear.B, [[0.0], [0.0], [20.0]], atol=1e-13)
    np.testing.assert_allclose(linear.C, [[1, 0, 0], [0, 0, 1], [0, 0, 0.3]], atol=1e-13)
    modes = linear.modes()
    assert sorted(np.round(modes.eigenvalues, 6)) == sorted(np.round(np.linalg.eigvals(A), 6))
    assert modes.stable


def test_linear_models_with_constraints_keep_states_independent():
    """Of the carriage on its course, against differences of the equations by hand."""
    system = driven()
    x, y, w, z = s = np.array([0.1, 0.05, -0.2, 0.4])
    q, v = np.array([x, y, 0.0]), np.array([z * np.cos(x), w, z])
    linear = system.linearise(at=(q, v))
    order = ["x", "y", "dot(y)", "speed"]
    assert sorted(linear.states) == sorted(order)
    places = [linear.states.index(name) for name in order]
    A = np.array([
        (np.array(driven_by_hand(0.0, s + h)) - driven_by_hand(0.0, s - h)) / 2e-6 for h in 1e-6 * np.eye(4)
    ]).T  # fmt: skip
    np.testing.assert_allclose(linear.A[np.ix_(places, places)], A, atol=1e-7)


def test_derivatives_of_the_motion_have_states_in_them():
    system = motor().derive(jacobian=True)
    p = system.parameter_values()
    y, n = np.array([0.4, 0.0, -0.7, 0.9]), 4

    def rhs(y, p):
        return system.kernel("rhs")(0.0, y, p)[:n]

    found = system.kernel("rhs_by_state")(0.0, y, p).reshape(n, n)
    differences = np.array([(rhs(y + h, p) - rhs(y - h, p)) / 2e-6 for h in 1e-6 * np.eye(n)]).T
    np.testing.assert_allclose(found, differences, atol=1e-7)
    found = system.kernel("rhs_by_parameters")(0.0, y, p).reshape(n, -1)
    steps = [1e-6 * max(1.0, abs(x)) * row for x, row in zip(p, np.eye(len(p)), strict=True)]
    differences = np.array([(rhs(y, p + h) - rhs(y, p - h)) / (2 * h.sum()) for h in steps]).T
    np.testing.assert_allclose(found, differences, atol=1e-6, rtol=1e-6)


def test_files_say_the_same_and_starts_are_set(tmp_path):
    text = motor().to_toml()
    assert 'current = { derivative = "(U - R*current - k*dot(phi))/L", start = 0.1, unit = "A" }' in text
    path = tmp_path / "motor.toml"
    path.write_text(text, encoding="utf-8")
    again = Model.from_toml(path).derive()
    a, b = (system.run(t_end=1.0, method="dop853") for system in (motor_system(), again))
    assert np.array_equal(a.q, b.q) and np.array_equal(a.v, b.v)
    moved = again.run(t_end=1.0, method="dop853", start={"current": "500 mA"})
    assert moved["current"][0] == 0.5
    with pytest.raises(UnknownNameError, match="current"):
        again.run(t_end=1.0, start={"curent": 1.0})


def test_recordings_have_states_and_go_on_bit_for_bit(tmp_path):
    text = derive_text(motor()).text
    system = load(text)
    whole, first, rest = (tmp_path / f"{name}.rrd" for name in ("whole", "first", "rest"))
    solution = record(whole, text, lambda **more: solve(system, 2.0, method="radau5", fps=50, **more))
    record(first, text, lambda **more: solve(system, 1.0, method="radau5", fps=50, **more))
    record(rest, text, lambda **more: Resumed(first).run(2.0, **more))
    assert_same_recording(whole, rest)
    assert verify(rest).ok
    csv = tmp_path / "whole.csv"
    solution.to_csv(csv)
    names = csv.read_text(encoding="utf-8").splitlines()[0].split(",")
    assert "current" in names and not any("integral" in name for name in names)


REFUSALS = {
    "place": (lambda m: m.body("b", mass=1, com=("z", 0)), "cannot depend on a state, 'z'"),
    "constraint": (lambda m: m.constraint("c", "x - z"), "a constraint cannot depend on a state"),
    "kinetic": (lambda m: m.kinetic("z*dot(x)^2"), "the kinetic energy cannot depend on a state"),
    "mass": (lambda m: m.body("b", mass="z", com=("x", 0)), "a mass or inertia cannot depend on a state"),
    "dot": (lambda m: m.force("x", "dot(z)"), "its derivative is an expression"),
    "force": (lambda m: m.force("z", "1"), "'z' is a state, which no force acts on"),
    "integral": (lambda m: m.force("x", "z_integral"), "is the integral of a state"),
    "taken": (lambda m: m.parameter("z", 1.0), "it is a state already"),
    "rates": (lambda m: m.velocity_constraint("c", "z - 1"), "a velocity constraint without a rate"),
    "unit": (lambda m: m.state("w", "z", unit="kg"), "units do not match"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_what_states_cannot_do_is_refused_by_name(case):
    m = Model("refused")
    m.coordinate("x", unit="m")
    m.parameter("rate", "1 1/s")
    m.body("a", mass="1 kg", com=("x", 0))
    m.state("z", "-rate*z", start="1 N", unit="N")
    change, says = REFUSALS[case]
    with pytest.raises(ModelError, match=says):
        change(m)
        m.describe()


def test_steps_in_python_carry_states():
    system = motor_system()
    stepper = system.stepper(rtol=1e-11, atol=1e-13)
    for _ in range(20):
        state = stepper.step(0.1, {"U": 6.0})
    np.testing.assert_allclose(state[[0, 2, 3]], motor_end(), rtol=0, atol=1e-9)


def test_ensembles_and_prepared_runs_have_states():
    system = motor_system()
    resistances = np.array([1.5, 2.0, 2.5])
    members = system.ensemble(1.0, n=3, parameters={"R": resistances}, method="dop853", frames=[0.5, 1.0])
    ends = [system.run(t_end=1.0, method="dop853", parameters={"R": R})["current"][-1] for R in resistances]
    np.testing.assert_allclose(np.array(members["current"])[:, -1], ends, rtol=0, atol=1e-6)
    starts = np.array([0.0, 0.5, 1.0])
    members = system.ensemble(1.0, n=3, start={"current": starts}, method="dop853", keep=["phi", "current"])
    ends = [system.run(t_end=1.0, method="dop853", start={"current": x})["phi"][-1] for x in starts]
    np.testing.assert_allclose(np.array(members["phi"]).ravel(), ends, rtol=0, atol=1e-6)
    prepared = system.prepare(t_end=1.0, method="dop853")
    assert prepared.start == ("phi", "dot(phi)", "current")
    found = prepared(system.parameter_values(), np.array([0.3, 0.0, 0.5]))
    np.testing.assert_allclose(found[0], ends[1], rtol=0, atol=1e-12)


def test_the_bundled_suspension_is_that_of_equations_by_hand():
    """Quarter car with a first-order actuator, an observer, and a damper of a curve that goes on straight."""
    rates, pulls = [-1.0, -0.3, -0.1, 0.0, 0.1, 0.3, 1.0], [-1250, -900, -600, 0, 300, 450, 620]
    curve = PchipInterpolator(rates, pulls)
    ends, slopes = curve([-1.0, 1.0]), curve([-1.0, 1.0], 1)

    def damper(v):
        if abs(v) <= 1.0:
            return curve(v)
        k = int(v > 0.0)
        return ends[k] + slopes[k] * (v - [-1.0, 1.0][k])

    def by_hand(t, y):
        body, wheel, v_body, v_wheel, force, speed = y
        s = (t - 0.5) / 0.12
        road = 0.03 * (1.0 - np.cos(2.0 * np.pi * s)) if 0.0 <= s <= 1.0 else 0.0
        pull = damper(v_wheel - v_body)
        a = (16e3 * (wheel - body) + pull + force) / 300.0
        b = (-16e3 * (wheel - body) - pull - force - 200e3 * (wheel - road)) / 40.0
        wanted = np.clip(-2500.0 * speed, -1800.0, 1800.0)
        return [v_body, v_wheel, a, b, (wanted - force) / 0.015, a - 0.5 * speed]

    exact = solve_ivp(
        by_hand, (0.0, 1.5), [0.0] * 6, rtol=1e-10, atol=1e-12, method="DOP853", max_step=2e-3
    ).y
    names = ("z_body", "z_wheel", "dot(z_body)", "dot(z_wheel)", "force", "speed")
    system = derive(library.load(library.find("active_suspension")))
    for method in ("auto", "dop853", "radau5"):
        solution = system.run(t_end=1.5, method=method, rtol=1e-9, atol=1e-11)
        found = np.array([solution[name][-1] for name in names])
        np.testing.assert_allclose(
            found / np.ptp(exact, axis=1), exact[:, -1] / np.ptp(exact, axis=1), atol=1e-8
        )
        assert not [entry.says for entry in solution.health if not entry.ok]
    free = system.run(t_end=1.5, parameters={"c_sky": 0.0})
    assert np.abs(solution["z_body"]).max() < 0.7 * np.abs(free["z_body"]).max()
