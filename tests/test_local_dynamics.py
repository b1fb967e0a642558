"""The equations at one instant of stops and frictions: how they are solved, and how often."""

import numpy as np
import pytest

from symgen import Model
from symgen.link import load
from symgen.runtime.contact import local_dynamics
from symgen.runtime.contact.local_dynamics import LocalDynamics, Place


def saddle_point(random, n, m, rank):
    root = random.normal(size=(n, n))
    jacobian = random.normal(size=(m, rank)) @ random.normal(size=(rank, n))
    scale = 10.0 ** random.uniform(-3, 3, n)
    return (root @ root.T + n * np.eye(n)) * np.outer(scale, scale), jacobian


@pytest.mark.parametrize(
    "n, m, rank",
    [(1, 0, 0), (6, 2, 2), (6, 3, 2), (9, 9, 4), (60, 4, 4), (60, 5, 5), (130, 20, 20), (130, 20, 12)],
)
def test_accelerations_multipliers_and_responses_solve_the_equations(n, m, rank):
    random = np.random.default_rng([n, m, rank])
    mass, jacobian = saddle_point(random, n, m, rank)
    rows = random.normal(size=(3, n))
    forces, gamma = random.normal(size=n), jacobian @ random.normal(size=n)
    found = Place(mass, jacobian, rows).solve(forces, gamma, np.zeros(3))
    right = np.column_stack([np.concatenate([forces, gamma]), np.vstack([rows.T, np.zeros((m, 3))])])
    rates = np.column_stack([found.free_rates, found.responses])
    multipliers = np.column_stack([found.free_multipliers, found.multiplier_responses])
    solved = np.vstack([rates, -multipliers])
    matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((m, m))]])
    sizes = np.abs(matrix) @ np.abs(solved) + np.abs(right)
    assert (np.abs(matrix @ solved - right) <= 1e-8 * sizes).all()
    np.testing.assert_allclose(found.free, rows @ found.free_rates, rtol=1e-12)
    np.testing.assert_allclose(found.compliance, rows @ found.responses, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("others", [0, 80])
def test_mass_that_only_constraints_determine_is_solved_with_them(others):
    """A coordinate without inertia that a constraint ties to one that has it."""
    mass = np.diag([2.0, 0.0, *np.ones(others)])
    place = Place(mass, np.array([[1.0, -1.0, *np.zeros(others)]]), np.zeros((0, 2 + others)))
    found = place.solve(np.array([3.0, 1.0, *np.zeros(others)]), np.zeros(1), np.zeros(0))
    np.testing.assert_allclose(found.free_rates[:2], [2.0, 2.0], rtol=1e-12)


def falling_balls(n):
    """Of them one after another falls on the floor; each could touch each."""
    m = Model("falling_balls", gravity=(0, 0, "-9.81 m/s^2"))
    m.frame("floor", body="world", at=(0, 0, 0))
    for k in range(n):
        m.body(f"ball{k}", mass=1.0, inertia=[0.004] * 3, shape={"sphere": [0.1]})
        start = [0.5 * k, 0.0, 0.3 + 0.1 * k, 1, 0, 0, 0]
        m.joint(f"free{k}", type="free", child=f"ball{k}", start=start)
        m.contact(f"floor{k}", body=f"ball{k}", plane="floor", restitution=0.5)
        for j in range(k):
            m.contact(f"pair{k}_{j}", body=f"ball{k}", other=f"ball{j}", restitution=0.5)
    return m.derive()


def test_a_large_model_is_factored_once_at_an_event(monkeypatch):
    """Factors, and what forces do, hang on the place alone, which an event does not change."""
    system, made = falling_balls(11), []
    assert system.nv > local_dynamics._FEW
    solver = local_dynamics._saddle_point_solver
    monkeypatch.setattr(
        local_dynamics, "_saddle_point_solver", lambda *given: made.append(1) or solver(*given)
    )
    run = system.run(t_end=0.3, method="dop853")
    assert [e.name for e in run.events] == ["floor0", "floor1", "floor2"]
    assert len(made) == 1 + len(run.events), "one at the start, one at each"
    # 0.2 m down, and what is left of the time at half the speed upwards.
    fall, flown = np.sqrt(2 * 0.2 / 9.81), 0.3 - run.events[0].t
    assert run.events[0].t == pytest.approx(fall, rel=1e-9)
    np.testing.assert_allclose(
        run.q[-1, 2], 0.1 + 0.5 * 9.81 * fall * flown - 0.5 * 9.81 * flown**2, rtol=1e-8
    )


def test_nothing_is_turned_without_friction_in_a_plane(monkeypatch):
    def refused(*_):
        raise AssertionError("no row has another axis")

    monkeypatch.setattr(LocalDynamics, "turned", refused)
    run = load("stick_slip").run()
    assert run.ok and len(run.events) == 17
