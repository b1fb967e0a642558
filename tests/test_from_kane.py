"""Models from SymPy's KanesMethod and System: accelerations against those that SymPy solves for, at random states.

The problems are those of SymPy's own tests (test_kane*.py, test_system*.py) and of PyDy's examples, in our own words.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from sympy import cos, sin, symbols
from sympy.physics.mechanics import (
    Force,
    KanesMethod,
    Particle,
    PinJoint,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    System,
    TorqueActuator,
    dot,
    dynamicsymbols,
    inertia,
)

from symgen import Model
from symgen.errors import ModelError

m, l, g, r, k, c = symbols("m l g r k c")
a, b = symbols("a b")
VALUES = {m: 1.3, l: 0.7, g: 9.81, r: 0.4, k: 30.0, c: 0.2, a: 0.5, b: 0.3}
T = dynamicsymbols._t


def spring_and_damper() -> KanesMethod:
    """One mass; the speed is the rate of its coordinate."""
    q, u = dynamicsymbols("q u")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, u * N.x)
    method = KanesMethod(N, [q], [u], [q.diff() - u])
    method.kanes_equations([Particle("bob", P, m)], [(P, (-k * q - c * u) * N.x)])
    return method


def pendulum_with_another_speed() -> KanesMethod:
    """Its speed is the velocity of the bob, with a sign of its own."""
    q, u = dynamicsymbols("q u")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, -u * (sin(2 * q) * N.x - cos(2 * q) * N.y))
    method = KanesMethod(N, [q], [u], [q.diff() * 2 * l + u])
    method.kanes_equations([Particle("bob", P, m)], [(P, m * g * N.x)])
    return method


def rolling_disc() -> KanesMethod:
    """Its speeds are the body's angular velocity; the contact does no work and has no place in the equations."""
    q1, q2, q3, u1, u2, u3 = dynamicsymbols("q1 q2 q3 u1 u2 u3")
    N = ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [q1, N.z])
    L = Y.orientnew("L", "Axis", [q2, Y.x])
    R = L.orientnew("R", "Axis", [q3, L.y])
    omega = u1 * L.x + u2 * L.y + u3 * L.z
    turned = R.ang_vel_in(N)
    R.set_ang_vel(N, omega)
    contact = Point("C")
    contact.set_vel(N, 0)
    centre = contact.locatenew("Dmc", r * L.z)
    centre.v2pt_theory(contact, N, R)
    disc = RigidBody("BodyD", centre, R, m, (inertia(L, m / 4 * r**2, m / 2 * r**2, m / 4 * r**2), centre))
    kinematics = [dot(turned - omega, axis) for axis in L]
    method = KanesMethod(N, [q1, q2, q3], [u1, u2, u3], kinematics)
    method.kanes_equations([disc], [(centre, -m * g * Y.z)])
    return method


def rolling_disc_with_reaction_speeds() -> KanesMethod:
    """The same with speeds of the contact that are zero, and forces there that do no work."""
    q1, q2, q3, u1, u2, u3, u4, u5 = dynamicsymbols("q1 q2 q3 u1 u2 u3 u4 u5")
    N = ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [q1, N.z])
    L = Y.orientnew("L", "Axis", [q2, Y.x])
    R = L.orientnew("R", "Axis", [q3, L.y])
    turned, omega = R.ang_vel_in(N), u1 * L.x + u2 * L.y + u3 * L.z
    R.set_ang_vel(N, omega)
    contact = Point("C")
    contact.set_vel(N, u4 * L.x + u5 * (Y.z ^ L.x))
    centre = contact.locatenew("Dmc", r * L.z)
    centre.v2pt_theory(contact, N, R)
    disc = RigidBody("BodyD", centre, R, m, (inertia(L, m / 4 * r**2, m / 2 * r**2, m / 4 * r**2), centre))
    method = KanesMethod(
        N, [q1, q2, q3], [u1, u2, u3], [dot(turned - omega, axis) for axis in L], u_auxiliary=[u4, u5]
    )
    method.kanes_equations([disc], [(centre, -m * g * Y.z), (contact, 2 * L.x + 3 * (Y.z ^ L.x))])
    return method


def cart_with_two_links() -> KanesMethod:
    """PyDy's n-link pendulum on a cart, pushed by a force that is an input."""
    q, u, F = dynamicsymbols("q:3"), dynamicsymbols("u:3"), dynamicsymbols("F")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    cart = O.locatenew("P0", q[0] * N.x)
    cart.set_vel(N, u[0] * N.x)
    bodies, loads = [Particle("Pa0", cart, m)], [(cart, F * N.x - m * g * N.y)]
    last = cart
    for j in (1, 2):
        B = N.orientnew(f"B{j}", "Axis", [q[j], N.z])
        B.set_ang_vel(N, u[j] * N.z)
        point = last.locatenew(f"P{j}", l * B.x)
        point.v2pt_theory(last, N, B)
        bodies.append(Particle(f"Pa{j}", point, m / j))
        loads += [(point, -m / j * g * N.y), (B, -c * u[j] * N.z)]
        last = point
    method = KanesMethod(N, q_ind=q, u_ind=u, kd_eqs=[x.diff() - y for x, y in zip(q, u)])
    method.kanes_equations(bodies, loads)
    return method


def chaos_pendulum() -> KanesMethod:
    """PyDy's rod with a plate that turns about it."""
    theta, phi, omega, alpha = dynamicsymbols("theta phi omega alpha")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    A = N.orientnew("A", "Axis", (theta, N.y))
    B = A.orientnew("B", "Axis", (phi, A.z))
    A.set_ang_vel(N, omega * N.y)
    B.set_ang_vel(A, alpha * A.z)
    rod_centre, plate_centre = O.locatenew("Ao", a / 2 * A.z), O.locatenew("Bo", l * A.z)
    rod_centre.v2pt_theory(O, N, A)
    plate_centre.v2pt_theory(O, N, A)
    rod = RigidBody("rod", rod_centre, A, m, (inertia(A, m * r**2, m * r**2, 0), rod_centre))
    plate = RigidBody(
        "plate", plate_centre, B, 2 * m, (inertia(B, m * a**2, m * b**2, m * (a**2 + b**2)), plate_centre)
    )
    method = KanesMethod(N, [theta, phi], [omega, alpha], [omega - theta.diff(), alpha - phi.diff()])
    method.kanes_equations([rod, plate], [(rod_centre, m * g * N.z), (plate_centre, 2 * m * g * N.z)])
    return method


def four_bar() -> KanesMethod:
    """Three bars that are closed by two constraints; those of velocities are their derivatives."""
    q, u = dynamicsymbols("q1:4"), dynamicsymbols("u1:4")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    last, bodies, loads = O, [], []
    for j, (angle, speed) in enumerate(zip(q, u)):
        A = N.orientnew(f"A{j}", "Axis", [angle, N.z])
        A.set_ang_vel(N, speed * N.z)
        end = last.locatenew(f"E{j}", (1 + j / sympy.Integer(4)) * l * A.x)
        end.v2pt_theory(last, N, A)
        bodies.append(Particle(f"B{j}", end, m))
        loads.append((end, -m * g * N.y))
        last = end
    closed = last.pos_from(O) - l * N.x
    held = [closed.dot(N.x), closed.dot(N.y)]
    method = KanesMethod(
        N, [q[0]], [u[0]], [x.diff() - y for x, y in zip(q, u)], q_dependent=q[1:], u_dependent=u[1:],
        configuration_constraints=held, velocity_constraints=[x.diff(T) for x in held],
    )  # fmt: skip
    method.kanes_equations(bodies, loads)
    return method


def skate() -> KanesMethod:
    """A knife edge on a slope, which does not slide across; the speeds are along and across it."""
    x, y, phi, along, across, turn = dynamicsymbols("x y phi along across turn")
    N, O = ReferenceFrame("N"), Point("O")
    O.set_vel(N, 0)
    B = N.orientnew("B", "Axis", [phi, N.z])
    B.set_ang_vel(N, turn * N.z)
    P = O.locatenew("P", x * N.x + y * N.y)
    P.set_vel(N, along * B.x + across * B.y)
    body = RigidBody("skate", P, B, m, (inertia(B, 0, 0, m * r**2), P))
    kinematics = [
        x.diff() - along * cos(phi) + across * sin(phi),
        y.diff() - along * sin(phi) - across * cos(phi),
        phi.diff() - turn,
    ]
    method = KanesMethod(
        N, [x, y, phi], [along, turn], kinematics, u_dependent=[across], velocity_constraints=[across]
    )
    method.kanes_equations([body], [(P, m * g / 3 * N.x - c * along * B.x)])
    return method


def jointed_arm() -> System:
    """Two links with joints, motors, dampers and weight."""
    ground = RigidBody("ground")
    system = System.from_newtonian(ground)
    q, u, motor = dynamicsymbols("q1:3"), dynamicsymbols("u1:3"), dynamicsymbols("motor")
    last, where = ground, 0 * ground.x
    for j in range(2):
        link = RigidBody(f"link{j}", mass=m)
        link.central_inertia = inertia(link.frame, m * r**2, m * r**2 / 5, m * r**2)
        axis = last.z if j == 0 else last.x
        joint = PinJoint(
            f"J{j}", last, link, q[j], u[j], parent_point=where, child_point=l / 2 * link.y, joint_axis=axis
        )
        system.add_joints(joint)
        drive = TorqueActuator(motor if j == 0 else -c * u[j], axis, link.frame, last.frame)
        system.add_actuators(drive)
        last, where = link, -l / 2 * link.y
    system.apply_uniform_gravity(-g * ground.y)
    system.form_eoms()
    return system


def sliding_block_held_by_a_rod() -> System:
    """A block on a rail and a bob on a table, tied by a holonomic constraint."""
    ground = RigidBody("ground")
    system = System.from_newtonian(ground)
    q, u = dynamicsymbols("q1:3"), dynamicsymbols("u1:3")
    block, bob = Particle("block", mass=m), Particle("bob", mass=2 * m)
    system.add_joints(
        PrismaticJoint("rail", ground, block, q[0], u[0], joint_axis=ground.x),
        PrismaticJoint("table", ground, bob, q[1], u[1], joint_axis=ground.y),
    )
    system.add_holonomic_constraints(q[0] ** 2 + q[1] ** 2 - 4 * l**2)
    system.q_ind, system.q_dep = q[:1], q[1:]
    system.u_ind, system.u_dep = u[:1], u[1:]
    system.add_loads(Force(block, -k * q[0] * ground.x))
    system.apply_uniform_gravity(-g * ground.y)
    system.form_eoms()
    return system


PROBLEMS = (
    spring_and_damper, pendulum_with_another_speed, rolling_disc, rolling_disc_with_reaction_speeds,
    cart_with_two_links, chaos_pendulum, four_bar, skate, jointed_arm, sliding_block_held_by_a_rod,
)  # fmt: skip
INPUTS = {"cart_with_two_links": {dynamicsymbols("F"): 1.7}, "jointed_arm": {dynamicsymbols("motor"): 0.6}}


def consistent(method: KanesMethod, random: np.random.Generator, given: dict) -> tuple[dict, dict]:
    """Random coordinates and speeds that satisfy the constraints, as SymPy has them: the dependent ones follow."""
    n_dependent = len(method._qdep)
    q, u = list(method.q), list(method.u)
    at = dict(zip(q, random.uniform(0.3, 1.1, len(q))))
    if n_dependent:
        dependent = list(method._qdep)
        free = {x: y for x, y in at.items() if x not in dependent}
        found = sympy.nsolve(
            method._f_h.xreplace(given).xreplace(free), dependent, [at[x] for x in dependent], tol=1e-14
        )
        at |= dict(zip(dependent, map(float, found)))
    speeds = dict(zip(u, random.uniform(-1.0, 1.0, len(u))))
    if len(method._udep):
        p = len(u) - len(method._udep)
        row = np.array(method._k_nh.xreplace(given | at).evalf(), dtype=float)
        rest = np.array(method._f_nh.xreplace(given | at).evalf(), dtype=float).ravel()
        independent = np.array([speeds[x] for x in u[:p]])
        speeds |= dict(zip(u[p:], np.linalg.solve(row[:, p:], -row[:, :p] @ independent - rest)))
    return at, speeds


@pytest.mark.parametrize("make", PROBLEMS, ids=[f.__name__ for f in PROBLEMS])
def test_accelerations_are_those_of_sympy(make):
    problem = make()
    method = problem.eom_method if isinstance(problem, System) else problem
    inputs = INPUTS.get(make.__name__, {})
    used = method.mass_matrix_full.free_symbols | method.forcing_full.free_symbols
    used |= method._f_h.free_symbols if method._f_h else set()
    parameters = {x: VALUES[x] for x in VALUES if x in used}
    model = Model.from_sympy(make.__name__, problem, parameters=parameters, inputs=inputs)
    system = model.derive()
    q, u = list(method.q), list(method.u)
    rates = [x.diff(T) for x in q]
    n, given = len(q), VALUES | inputs | dict.fromkeys(method._uaux, 0.0)
    turned = [method.kindiffdict()[x] for x in rates]
    random = np.random.default_rng(4)
    for _ in range(3):
        at, speeds = consistent(method, random, given)
        numbers = given | at | speeds
        matrix, right = (
            np.array(x.xreplace(numbers).evalf(), dtype=float)
            for x in (method.mass_matrix_full, method.forcing_full)
        )
        state = np.linalg.solve(matrix, right).ravel()
        du = dict(zip(u, state[n:]))
        velocity = np.array([float(x.xreplace(numbers)) for x in turned])
        # d/dt of dq/dt = Y(q) u, by the rules of SymPy.
        expected = [
            float(sum(x.diff(y).xreplace(numbers) * z for y, z in [*du.items(), *zip(q, velocity)]))
            for x in turned
        ]
        y = np.array([at[x] for x in q]), velocity
        found = system.kernel("rhs")(0.0, np.concatenate(y), system.parameter_values())[n : 2 * n]
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_derivatives_of_holonomic_constraints_are_left_out():
    model = Model.from_sympy("bar", four_bar(), parameters={m: 1.3, l: 0.7, g: 9.81})
    system = model.derive()
    assert (system.nh, system.nn) == (2, 0)
    assert Model.from_sympy("skate", skate(), parameters={m: 1.3, g: 9.81, c: 0.2, r: 0.4}).derive().nn == 1


def test_a_run_keeps_its_constraints_and_takes_its_input():
    cart = Model.from_sympy(
        "cart", cart_with_two_links(), parameters={m: 1.3, l: 0.7, g: 9.81, c: 0.2}, inputs={dynamicsymbols("F"): 0.0},
        start={dynamicsymbols("q1"): "10 deg"},
    ).derive()  # fmt: skip
    pushed, left = cart.run(1.0, inputs={"F": 2.0}), cart.run(1.0)
    assert pushed.ok and left.ok and pushed["q0"][-1] > left["q0"][-1] + 0.1


def test_what_cannot_be_taken_over_is_said():
    q, u = dynamicsymbols("q u")
    N = ReferenceFrame("N")
    with pytest.raises(ModelError, match="no bodies yet"):
        Model.from_sympy("a", KanesMethod(N, [q], [u], [q.diff() - u]))
    with pytest.raises(ModelError, match="not of a Particle"):
        Model.from_sympy("a", Particle("P"))
    with pytest.raises(ModelError, match=r"F\(t\).*neither a coordinate"):
        Model.from_sympy("a", cart_with_two_links(), parameters=VALUES)
    with pytest.raises(ModelError, match="the input 'k' is no function of time"):
        Model.from_sympy("a", cart_with_two_links(), parameters=VALUES, inputs={k: 1.0})
