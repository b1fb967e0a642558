"""Large models at run time: starts by sparse matrices, and refusals of what works with full ones."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from symgen import Model, dot, runtime
from symgen.derive import constraints
from symgen.link import derive_text
from symgen.model.library import find, load
from symgen.runtime import RunOptions, size
from symgen.runtime.checks import inertia
from symgen.runtime.checks.advice import advise
from symgen.runtime.checks.inertia import refuse_negative_inertia
from symgen.runtime.choose import choose_method
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.constraints.contradictions import AssemblyError
from symgen.runtime.constraints.dependence import _stand_apart, dependent_constraints, rank_is_lost
from symgen.runtime.contact import local_dynamics
from symgen.runtime.errors import RuntimeModelError


@pytest.fixture(scope="module")
def chain():
    return runtime.load(derive_text(load(find("chain_absolute"), {"N": "125"})).text)


def residuals(system, q, v):
    return system.kernel("constraint_residual")(0.0, np.concatenate([q, v]), system.parameter_values())


def test_a_start_that_fits_stays(chain):
    found = assemble(chain, chain.parameter_values())
    assert size.is_large(chain)
    assert not found.moved
    assert found.rank == chain.m


def test_guesses_give_way_to_enforced_values(chain):
    """Angles are enforced; positions follow them to round-off."""
    angles = {f"theta{k}": 0.3 + 0.004 * k for k in range(1, 126)}
    found = assemble(chain, chain.parameter_values(), start=angles)
    assert found.q[2::3] == pytest.approx(list(angles.values()), abs=0.0)
    assert np.abs(residuals(chain, found.q, found.v)).max() < 1e-12
    along = np.cumsum(0.2 * np.sin(list(angles.values())))
    assert found.q[3::3] == pytest.approx(along[:-1] + 0.1 * np.sin(found.q[5::3]), abs=1e-12)


def beads():
    """Three masses in space on rigid bars, all of them guesses."""
    model = Model("beads")
    before = (0, 0, 0)
    for k, m in enumerate((1.0, 2.0, 0.5)):
        bead = [model.coordinate(f"{axis}{k}", guess=k + 1.0 if axis == "x" else 0.1) for axis in "xyz"]
        model.body(f"b{k}", mass=model.parameter(f"m{k}", m), com=bead)
        model.constraint(f"bar{k}", sum((a - b) ** 2 for a, b in zip(bead, before, strict=True)) - 1)
        before = bead
    return runtime.load(derive_text(model).text)


def test_small_and_large_ways_agree_on_rates(monkeypatch):
    """A linear problem with one least motion, whichever way it is solved."""
    system = beads()
    p, rate = system.parameter_values(), {"y1": 1.5, "x2": -0.3}
    start = dict(zip([c["name"] for c in system.coordinates], assemble(system, p).q.tolist(), strict=True))
    expected = assemble(system, p, start=start, rate=rate)
    monkeypatch.setattr(size, "LARGEST_DENSE", 1)
    found = assemble(system, p, start=start, rate=rate)
    assert found.v == pytest.approx(expected.v, abs=1e-10)
    assert np.abs(residuals(system, found.q, found.v)).max() < 1e-10


def test_a_start_off_all_solutions_names_a_constraint(chain):
    with pytest.raises(AssemblyError, match="'pin1_x' is the worst"):
        assemble(chain, chain.parameter_values(), start={"theta1": 0.5, "x1": 7.0})


def test_dependent_constraints_are_refused(monkeypatch):
    """In a model of more constraints than derivation looks at."""
    n = constraints.LARGEST
    model = Model("repeated")
    m = model.parameter("m", 1.0)
    x = [model.coordinate(f"x{k}") for k in range(n + 1)]
    for a, b in pairwise(x):
        model.kinetic(m / 2 * dot(a) ** 2)
        model.constraint(f"{a}_follows", a - b)
    model.kinetic(m / 2 * dot(x[-1]) ** 2)
    model.constraint("again", x[0] - x[-1])
    system = runtime.load(derive_text(model).text)
    monkeypatch.setattr(size, "LARGEST_DENSE", 1)
    with pytest.raises(AssemblyError, match="depend on each other at the start"):
        assemble(system, system.parameter_values())


def test_methods_with_full_matrices_are_refused(chain):
    state = np.concatenate(chain.initial_state()[:2])
    arguments = (chain, chain.parameter_values(), state)
    assert choose_method(*arguments, RunOptions(t_end=1.0, method="radau5"))[0].name == "radau5"
    for name in ("bdf",):
        with pytest.raises(
            RuntimeModelError, match="use radau5, whose matrices are sparse, or an explicit method"
        ):
            choose_method(*arguments, RunOptions(t_end=1.0, method=name))


def test_continuous_controllers_have_no_sparse_matrices(monkeypatch):
    """What a controller of all coordinates adds to the derivatives is full."""
    monkeypatch.setattr(size, "LARGEST_DENSE", 1)
    system = runtime.load(derive_text(load(find("quarter_car"))).text)
    monkeypatch.setattr(type(system), "has_feedback", True)
    state = np.concatenate(system.initial_state()[:2])
    arguments = (system, system.parameter_values(), state)
    method, notes = choose_method(*arguments, RunOptions(t_end=1.0))
    assert method.name == "dop853"
    assert "full matrices" in notes[0]
    with pytest.raises(RuntimeModelError, match="use an explicit method such as dop853"):
        choose_method(*arguments, RunOptions(t_end=1.0, method="radau5"))


def test_negative_inertia_of_one_body_is_found_among_many(chain):
    state = np.concatenate(chain.initial_state()[:2])
    refuse_negative_inertia(chain, chain.parameter_values(), 0.0, state)
    with pytest.raises(RuntimeModelError, match="negative"):
        refuse_negative_inertia(chain, chain.parameter_values({"m": -1.0}), 0.0, state)


def test_only_doubtful_blocks_are_looked_at_by_themselves():
    """Those that are negative or singular, whatever their units; numbers that are none are for the run to tell."""
    sound = np.array([[4e8, 1.0], [1.0, 1e-6]])
    singular, negative = np.array([[4.0, 2e-4], [2e-4, 1e-8]]), np.array([[1.0, 2.0], [2.0, 1.0]])
    blocks = np.array([sound, singular, negative, np.full((2, 2), np.nan), np.zeros((2, 2))])
    assert inertia._doubtful(blocks).tolist() == [False, True, True, False, True]
    assert inertia._doubtful(np.array([1e-30, 0.0, -1.0, np.inf])[:, None, None]).tolist() == [
        False, True, True, False
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["n_pendulum", "humanoid_tree"])
def test_blocks_of_the_mass_matrix_are_those_that_rates_couple(monkeypatch, name):
    system = runtime.load(derive_text(load(find(name))).text)
    state, p = np.concatenate(system.initial_state()[:2]), system.parameter_values()
    whole = system.kernel("mass_matrix")(0.0, state, p).reshape(system.nv, system.nv)
    monkeypatch.setattr(inertia, "_LARGEST_WHOLE", 1)
    monkeypatch.setattr(inertia, "_DOUBTFUL", np.inf)
    found = np.zeros_like(whole)
    for rates, block in inertia._blocks(system, p, 0.0, state):
        found[np.ix_(rates, rates)] = block
    assert np.array_equal(found, whole)


def test_advice_for_large_models_names_methods_that_they_have(monkeypatch):
    system = runtime.load(derive_text(load(find("spring_chain"), {"N": "3"})).text)
    monkeypatch.setattr(size, "LARGEST_DENSE", 1)
    advice = advise(system, RunOptions(**{"t_end": 0.5}))
    names = {step.method for step in advice.fixed_steps}
    assert "verlet" in names
    assert not names & {"implicit_euler", "implicit_midpoint", "generalized_alpha"}
    assert not any("stiffness ratio" in line for line in advice.lines())


@pytest.mark.parametrize("repeated", [False, True], ids=["independent", "dependent"])
def test_stops_of_large_models_are_solved_as_those_of_small_ones(monkeypatch, repeated):
    """By sparse factors where constraints are independent, with multipliers of least norm where they are not."""
    rng = np.random.default_rng(5)
    mass, jacobian, right = (
        np.diag(10.0 ** rng.uniform(-3, 3, 9)),
        rng.normal(size=(4, 9)),
        rng.normal(size=(13, 2)),
    )
    if repeated:
        jacobian[3], right[12] = jacobian[0] - 2.0 * jacobian[1], right[9] - 2.0 * right[10]
    expected = local_dynamics._saddle_point_solver(mass, jacobian)(right)
    monkeypatch.setattr(local_dynamics, "_FEW", 1)
    found = local_dynamics._saddle_point_solver(mass, jacobian)(right)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert mass @ found[:9] + jacobian.T @ found[9:] == pytest.approx(right[:9], abs=1e-9)
    assert jacobian @ found[:9] == pytest.approx(right[9:], abs=1e-9)


@pytest.fixture(scope="module")
def long_chain():
    return runtime.load(derive_text(load(find("chain_absolute"), {"N": "240"})).text)


@pytest.mark.slow
def test_round_off_that_adds_up_along_a_chain_does_not_stop_steps_of_index_3(long_chain):
    """Newton's corrections stall at the round-off of 480 constraints; steps are of second order all the same."""
    tight = {"t_end": 0.02, "rtol": 1e-9, "atol": 1e-11}
    exact = long_chain.run(**{**tight, "method": "dop853", "rtol": 1e-11, "atol": 1e-13})
    off = []
    for step in (2e-4, 1e-4):
        run = long_chain.run(**tight, method="generalized_alpha", constraints="index3", step=step)
        assert run.status == "success", run.message
        off.append([np.abs(run.q[-1] - exact.q[-1]).max(), np.abs(run.v[-1] - exact.v[-1]).max()])
    assert np.divide(*off) == pytest.approx([4.0, 4.0], rel=0.02)


def test_singular_values_that_fall_evenly_are_no_lost_rank(long_chain):
    """As those of a long chain, which no configuration makes singular; one that falls far is."""
    p, q = long_chain.parameter_values(), assemble(long_chain, long_chain.parameter_values()).q
    assert dependent_constraints(long_chain, p, 0.0, q, 1e-2)
    assert not rank_is_lost(long_chain, p, 0.0, q, 1e-2)
    values = np.array([3.0, 1.0, 0.5, 1e-4])
    assert _stand_apart(values, values <= 0.03) and not _stand_apart(values[:3], values[:3] <= 0.6)
