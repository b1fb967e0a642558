"""Constraint forms: which method has which, index-2 equations (ggl), Baumgarte's stabilisation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen.runtime import load, solve
from symgen.runtime.choose import choose_constraints
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.forms import FORMS, SUITED
from symgen.runtime.integrate.ggl import Blocks, set_shifted, solve_shifted
from symgen.runtime.integrate.linear import lu_factor
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays
from tests.stress import constrained_models

ROOT = Path(__file__).parents[1]
SPANS = {
    "pendulum_dae": 5.0,
    "slider_crank": 1.0,
    "andrews_squeezer": 0.03,
    "car_axis": 1.0,
    "rolling_disc": 1.0,
}


def model(name):
    return load(ROOT / "generated" / f"{name}.py")


@pytest.fixture(scope="module")
def references():
    """End states by another algorithm at round-off tolerance: explicit steps on index-1 equations."""
    kept = {}

    def reference(name):
        if name not in kept:
            t_end = SPANS[name]
            kept[name] = model(name).run(
                t_end=t_end, method="dop853", rtol=1e-13, atol=1e-14, at=[t_end], constraints="projection"
            )
        return kept[name].samples[0]

    return reference


def errors(name, reference, **options):
    """A run and its errors: of positions, and of multipliers in parts of the largest."""
    t_end = SPANS[name]
    solution = model(name).run(t_end=t_end, at=[t_end], **options)
    assert solution.status == "success", solution.message
    sample, expected = solution.samples[0], reference(name)
    of_multipliers = (
        np.abs(sample.multipliers - expected.multipliers).max() / np.abs(expected.multipliers).max()
    )
    return solution, np.abs(sample.q - expected.q).max(), of_multipliers


@pytest.mark.parametrize("form", FORMS)
def test_auto_takes_a_method_that_has_the_form(form):
    chosen, method, notes = choose_constraints(form, model("slider_crank"), "auto")
    assert (chosen, method.name) == (form, SUITED[form]) and method.name in notes[0]
    assert method is FORMS[form][method.name]


@pytest.mark.parametrize(("form", "method"), [("ggl", "dop853"), ("baumgarte", "radau5"), ("index3", "rk4")])
def test_a_pair_that_does_not_exist_names_those_that_do(form, method):
    with pytest.raises(RuntimeModelError) as refusal:
        choose_constraints(form, model("slider_crank"), method)
    assert all(name in str(refusal.value) for name in (form, method, *FORMS[form]))


def test_projection_is_what_auto_takes_and_says():
    form, method, notes = choose_constraints("auto", model("slider_crank"), "dop853")
    assert (form, method) == ("projection", None) and "projection" in notes[0]
    assert choose_constraints("auto", model("pendulum"), "dop853") == ("none", None, [])


@pytest.mark.parametrize("g", [0.7, 37.0, 1e4])
def test_the_reduced_system_has_the_solution_of_the_whole(g):
    """Of g Δq = Δv + C Δμ and the three equations with residuals, written out and solved by NumPy.

    Friction in proportion to reactions turns their forces away from Gᵀ.
    """
    random = np.random.default_rng(5)
    nv, m, nh = 6, 3, 2
    root = random.normal(size=(nv, nv))
    mass = root @ root.T + np.eye(nv)
    by_v, by_q, gradients, turning = (random.normal(size=(n, nv)) for n in (nv, nv, m, m))
    reactions = 0.3 * random.normal(size=(nv, m)) - gradients.T
    saddle = np.block([[mass, reactions], [gradients, np.zeros((m, m))]])
    columns = np.linalg.solve(saddle, np.eye(nv + m)[:, nv : nv + nh])
    steer, lift = columns[:nv].copy(), columns[nv:].copy()
    blocks = Blocks(
        mass, by_v, by_q - by_v @ steer @ turning[:nh], gradients, reactions, turning, steer, by_v @ steer,
        lift, np.zeros(nv), np.zeros(m + 1),
    )  # fmt: skip
    sizes = np.zeros(at.N_SIZES, dtype=np.int64)
    sizes[[at.NQ, at.NV, at.NH, at.NM]] = nv, nv, nh, m
    x = random.normal(size=nv + m + nh)
    matrix = np.zeros((nv + m, nv + m))
    pivots = np.zeros(nv + m, dtype=np.int64)
    whole = np.block([
        [g * np.eye(nv), -np.eye(nv), np.zeros((nv, m)), -steer],
        [by_q, g * mass + by_v, reactions, np.zeros((nv, nh))],
        [turning, gradients, np.zeros((m, m + nh))],
        [gradients[:nh], np.zeros((nh, nv + m + nh))],
    ])  # fmt: skip
    expected = np.linalg.solve(whole, np.concatenate([np.zeros(nv), -x]))[nv:]
    set_shifted(g, nh, blocks, matrix)
    assert lu_factor(matrix, pivots) == 0
    solve_shifted(g, sizes, blocks, matrix, pivots, x)
    assert np.allclose(x, expected, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("name", SPANS)
def test_index_2_radau_finds_positions_and_multipliers(name, references):
    _, position, multiplier = errors(
        name, references, method="radau5", constraints="ggl", rtol=1e-11, atol=1e-12
    )
    assert position < 1e-8 and multiplier < 1e-8


@pytest.mark.parametrize("name", SPANS)
def test_index_2_bdf_finds_positions_and_multipliers(name, references):
    _, position, multiplier = errors(name, references, method="bdf", constraints="ggl", rtol=1e-9, atol=1e-10)
    assert position < 2e-6 and multiplier < 1e-5


def test_index_2_radau_has_order_5(references):
    """With steps of one length, and Newton far below the error."""
    system, t_end = model("pendulum_dae"), SPANS["pendulum_dae"]
    q, v, _, _ = system.initial_state()
    found = []
    for n in (80, 160):
        arrays = LoopArrays(
            system, FORMS["ggl"]["radau5"], system.parameter_values(), 0.0, np.concatenate([q, v]),
            frame_times=np.zeros(0), rtol=1e-3, atol=1e-3, with_events=False,
        )  # fmt: skip
        arrays.control[at.H] = arrays.control[at.H_MAX] = t_end / n
        arrays.control[at.NEWTON_TOL] = 1e-9
        assert arrays.advance(t_end, 1000) == at.REACHED_STOP and arrays.counters[at.STEPS] == n
        found.append(np.abs(arrays.y[:2] - references("pendulum_dae").q).max())
    assert np.log2(found[0] / found[1]) == pytest.approx(5.0, abs=0.8)


@pytest.mark.parametrize(("method", "rtol", "limit"), [("radau5", 1e-8, 1e-8), ("bdf", 1e-8, 5e-7)])
def test_redundant_constraints_are_left_idle(method, rtol, limit):
    """Bricard's mechanism has one more constraint than rank; its reactions are those of least norm."""
    system, t_end = model("bricard"), 1.0
    expected = system.run(t_end=t_end, method="dop853", rtol=1e-12, at=[t_end], constraints="projection")
    solution = system.run(t_end=t_end, method=method, rtol=rtol, at=[t_end], constraints="ggl")
    assert solution.status == "success" and any("redundant: hinge6" in note for note in solution.notes)
    sample, sought = solution.samples[0], expected.samples[0]
    for name in ("q", "v", "multipliers"):
        assert np.abs(getattr(sample, name) - getattr(sought, name)).max() < limit * max(
            1.0, np.abs(getattr(sought, name)).max()
        )
    assert solution.constraint_residual.max_position < 1e-12


@pytest.mark.parametrize("method", ["radau5", "bdf"])
def test_index_2_states_are_on_the_constraints(method):
    solution = model("car_axis").run(t_end=0.5, method=method, constraints="ggl", rtol=1e-6)
    assert solution.constraints == "ggl" and solution.stats["factorisations"] > 0
    assert solution.constraint_residual.max_position < 1e-12
    assert solution.constraint_residual.max_velocity < 1e-12


@pytest.mark.parametrize(
    ("method", "order"), [(name, m.order) for name, m in FORMS["baumgarte"].items() if not m.adaptive]
)
def test_baumgarte_keeps_the_order_of_the_method(method, order, references):
    steps = {1: (2e-3, 5e-4), 2: (4e-3, 1e-3), 4: (2e-2, 5e-3)}[order]
    coarse, fine = (
        errors("pendulum_dae", references, method=method, constraints="baumgarte", step=step)[1]
        for step in steps
    )
    assert np.log(coarse / fine) / np.log(4.0) > order - 0.25


@pytest.mark.parametrize("method", ["rk4", "bs32", "dop853", "euler", "verlet"])
def test_without_projection_it_is_the_method_on_the_accelerations(method):
    """States are those of SciPy's or a hand-written step on the same right-hand side; nothing is brought back."""
    system = model("pendulum_dae")
    p = system.parameter_values()
    options = {"step": 0.01} if method in ("rk4", "euler", "verlet") else {"rtol": 1e-10, "atol": 1e-12}
    solution = system.run(2.0, method=method, constraints="none", **options)
    kernel, n = system.kernel("rhs"), system.nq + system.nv

    def slope(t, x):
        return kernel(t, np.append(x, 0.0)[: system.ny] if system.ny > n else x, p)[:n]

    x = solution.states[0][:n].copy()
    if method == "euler":
        for k in range(200):
            x = x + 0.01 * slope(0.01 * k, x)
        np.testing.assert_allclose(solution.states[-1][:n], x, rtol=1e-9, atol=1e-11)
    else:
        wanted = solve_ivp(slope, (0.0, 2.0), x, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        tolerance = {"rk4": 1e-6, "verlet": 1e-2}.get(method, 1e-8)
        np.testing.assert_allclose(solution.states[-1][:n], wanted, atol=tolerance)
    held = system.run(2.0, method=method, **options)
    assert solution.constraint_residual.max_position > 100.0 * held.constraint_residual.max_position
    assert "constraints not held" in [entry.check for entry in solution.health if entry.note]
    assert "constraints not held" not in [entry.check for entry in held.health]


def test_drift_grows_with_the_square_of_time_or_faster_and_is_objected_to():
    system = model("pendulum_dae")
    short, long = (
        system.run(t, method="rk4", step=0.1, constraints="none").constraint_residual.max_position
        for t in (10.0, 40.0)
    )
    assert long > 8.0 * short
    loud = system.run(10.0, method="rk4", step=0.1, constraints="none")
    assert "constraint position" in [entry.check for entry in loud.health if not entry.ok]


@pytest.mark.parametrize("method", [name for name, m in FORMS["baumgarte"].items() if m.adaptive])
def test_baumgarte_with_adaptive_steps_follows_the_tolerance(method, references):
    for rtol in (1e-6, 1e-8, 1e-10):
        solution, position, _ = errors(
            "slider_crank", references, method=method, constraints="baumgarte", rtol=rtol, atol=rtol
        )
        assert position < 100.0 * rtol
        assert 0.0 < solution.constraint_residual.max_position < 100.0 * rtol


def test_baumgarte_keeps_round_off_from_the_motion():
    """34 000 steps of 5e-6 s and more: the last digits of coordinates over such a step are more than the tolerance."""
    _, drawn = constrained_models.draw(4)
    run, exact = (
        solve(drawn.system, drawn.t_end, **drawn.given, **options)
        for options in (
            {"method": "bs32", "constraints": "baumgarte", "rtol": 1e-12, "atol": 1e-13},
            {"method": "dop853", "rtol": 1e-13, "atol": 1e-14},
        )
    )
    for found, sought in ((run.q[-1], exact.q[-1]), (run.v[-1], exact.v[-1])):
        np.testing.assert_allclose(found, sought, rtol=0, atol=100e-12 * np.abs(sought).max())


@pytest.mark.parametrize(
    ("method", "step"), [("rk4", 0.05), ("semi_implicit_euler", 0.01), ("verlet", 0.02), ("euler", 1e-3)]
)
def test_baumgarte_bounds_the_drift(method, step):
    system = model("pendulum_dae")
    early, late = (
        system.run(t_end=t_end, method=method, step=step, constraints="baumgarte").constraint_residual
        for t_end in (10.0, 60.0)
    )
    growth = 1.5 if method != "euler" else 15.0  # whose energy grows
    assert 0.0 < late.max_position < growth * early.max_position
    assert 0.0 < late.max_velocity < growth * early.max_velocity


def test_methods_of_forms_are_not_those_that_project():
    for form in ("baumgarte", "ggl"):
        for name, method in FORMS[form].items():
            assert method.name == name and method is not METHODS[name]
