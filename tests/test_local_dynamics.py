"""The equations at one instant of stops and frictions: how they are solved, and what an event looks at."""

import numpy as np
import pytest

from symgen import Model
from symgen.link import load
from symgen.runtime.contact import coulomb, local_dynamics
from symgen.runtime.contact.levels import Levels
from symgen.runtime.contact.local_dynamics import LocalDynamics, Place


def saddle_point(random, n, m, rank):
    root = random.normal(size=(n, n))
    jacobian = random.normal(size=(m, rank)) @ random.normal(size=(rank, n))
    scale = 10.0 ** random.uniform(-3, 3, n)
    return (root @ root.T + n * np.eye(n)) * np.outer(scale, scale), jacobian


@pytest.mark.parametrize("n, m, rank", [(1, 0, 0), (5, 0, 0), (6, 2, 2), (6, 3, 2), (9, 9, 4), (130, 20, 20)])
def test_accelerations_and_multipliers_solve_the_equations(n, m, rank):
    random = np.random.default_rng([n, m])
    mass, jacobian = saddle_point(random, n, m, rank)
    right = np.concatenate([random.normal(size=(n, 3)), jacobian @ random.normal(size=(n, 3))])
    solved = Place(mass, jacobian, np.zeros((0, n))).solve(right)
    matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((m, m))]])
    sizes = np.abs(matrix) @ np.abs(solved) + np.abs(right)
    assert np.abs(matrix @ solved - right).max() <= 1e-9 * sizes.max()
    assert (np.abs(matrix @ solved - right) <= 1e-8 * sizes).all()


def test_mass_that_only_constraints_determine_is_solved_with_them():
    """A coordinate without inertia that a constraint ties to one that has it."""
    place = Place(np.diag([2.0, 0.0]), np.array([[1.0, -1.0]]), np.eye(2))
    np.testing.assert_allclose(place.solve(np.array([[3.0], [1.0], [0.0]]))[:2, 0], [2.0, 2.0], rtol=1e-12)


def balls(n, friction=0.0):
    """Of them the first falls on the floor, the others fly; each could touch each."""
    m = Model("balls_in_flight", gravity=(0, 0, "-9.81 m/s^2"))
    m.frame("floor", body="world", at=(0, 0, 0))
    law = {"restitution": 0.5, **({"friction": friction} if friction else {})}
    for k in range(n):
        m.body(f"ball{k}", mass=1.0, inertia=[0.004] * 3, shape={"sphere": [0.1]})
        start = [0.5 * k, 0.0, 0.3 if k == 0 else 2.0, 1, 0, 0, 0]
        m.joint(f"free{k}", type="free", child=f"ball{k}", start=start)
        m.contact(f"floor{k}", body=f"ball{k}", plane="floor", **law)
        for j in range(k):
            m.contact(f"pair{k}_{j}", body=f"ball{k}", other=f"ball{j}", **law)
    return m.derive()


@pytest.mark.parametrize("friction, rows", [(0.0, 1), (0.3, 3)])
def test_an_event_looks_at_the_stops_that_touch_alone(monkeypatch, friction, rows):
    system, asked = balls(4, friction), []
    found = Place._found
    monkeypatch.setattr(
        Place, "_found", lambda self, attended: (asked.append(len(attended)), found(self, attended))[1]
    )
    run = system.run(t_end=0.4, method="dop853")
    assert [(e.name, e.action) for e in run.events] == [("floor0", "impact")]
    # Nothing touches at the start.
    assert asked and max(asked) == rows, asked
    lift = np.sqrt(2 * 9.81 * 0.2)
    flown = 0.4 - run.events[0].t
    np.testing.assert_allclose(run.q[-1, 2], 0.1 + 0.5 * lift * flown - 0.5 * 9.81 * flown**2, rtol=1e-9)


def test_without_friction_in_a_plane_nothing_is_turned(monkeypatch):
    def refused(*_):
        raise AssertionError("no row has another axis")

    monkeypatch.setattr(LocalDynamics, "turned", refused)
    run = load("stick_slip").run()
    assert run.ok and len(run.events) == 17


def test_frictions_without_forces_change_nothing(monkeypatch):
    """Forces of some touching stops, with and without the rows of all the others."""
    random = np.random.default_rng(5)
    n_stops, nv = 14, 40
    mass, jacobian = saddle_point(random, nv, 3, 3)
    place = Place(mass, jacobian, random.normal(size=(2 * n_stops, nv)) * 10.0 ** random.uniform(-1, 1, nv))
    normals = [(k, np.zeros(0, dtype=int)) for k in range(n_stops)]
    levels = Levels(np.zeros(n_stops), random.uniform(0.1, 0.3, n_stops), normals)
    equations = local_dynamics.ContactEquations.__new__(local_dynamics.ContactEquations)
    equations.attended = np.ones(2 * n_stops, dtype=bool)
    none, forces = np.zeros(2 * n_stops), random.normal(size=nv)
    here = LocalDynamics(place, equations, 0.0, np.zeros(nv), none, forces, none, np.zeros(3))
    acting, senses = np.zeros(2 * n_stops, dtype=bool), random.choice([-1.0, 1.0], n_stops)
    acting[[1, 4, 6, n_stops + 4]] = True
    free = np.where(acting, -np.abs(here.free), here.free)
    few = coulomb.coulomb_forces(here, free, acting, senses, levels)
    monkeypatch.setattr(coulomb, "_MANY_IDLE", 10**6)
    all_ = coulomb.coulomb_forces(here, free, acting, senses, levels)
    assert np.abs(all_[0]).max() > 0.0
    for some, every in zip(few, all_):
        np.testing.assert_allclose(some, every, rtol=1e-9, atol=1e-12 * np.abs(every).max())


def test_corners_that_lift_off_do_not_leave_the_others_without_forces():
    """A box that rocks about an edge: the accelerations of its turning cannot all be taken away by forces."""
    corners = np.array([[0.05, 0.05], [0.05, -0.05], [-0.05, -0.05], [-0.05, 0.05]])
    rows = np.zeros((12, 6))
    for k, (cx, cy) in enumerate(corners):
        r = np.array([cx, cy, -0.05])
        for row, axis in ((k, 2), (4 + 2 * k, 0), (5 + 2 * k, 1)):
            e = np.eye(3)[axis]
            rows[row] = [*e, *np.cross(r, e)]
    place = Place(np.diag([1.0] * 3 + [0.0017] * 3), np.zeros((0, 6)), rows)
    equations = local_dynamics.ContactEquations.__new__(local_dynamics.ContactEquations)
    equations.attended = np.ones(12, dtype=bool)
    turning = np.zeros(12)
    turning[4:] = 1e-7 * np.tile(np.array([1.0, 0.5]), 4) * np.sign(corners).ravel()
    here = LocalDynamics(
        place,
        equations,
        0.0,
        np.zeros(6),
        np.zeros(12),
        np.array([0.3, 0.0, -9.81, 0, 0, 0]),
        turning,
        np.zeros(0),
    )
    levels = Levels(np.zeros(8), np.full(8, 0.5), [(k // 2, np.zeros(0, dtype=int)) for k in range(8)])
    circles = np.array([(2 * k, 2 * k + 1) for k in range(4)])
    forces, _ = coulomb.coulomb_forces(
        here, here.free, np.ones(12, dtype=bool), np.zeros(8), levels, circles=circles
    )
    np.testing.assert_allclose(rows.T @ forces, [-0.3, 0.0, 9.81, 0.0, 0.0, 0.0], atol=1e-6)
