"""What `method = "auto"` chooses, and how a run goes on where its choice cannot."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from symgen import Model, dot, sqrt
from symgen.link import derive
from symgen.model.library import find, load
from symgen.runtime import choose, step_costs
from symgen.runtime.checks import time_scales
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate import taylor
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.options import RunOptions
from symgen.runtime.positions import Positions
from symgen.runtime.taylor.kernel import N_ROWS


@functools.cache
def derived(name: str):
    """The system of a bundled model, derived once for all tests of this file."""
    return derive(load(find(name)))


def chosen_note(solution) -> str:
    return next(note for note in solution.notes if note.startswith("method auto"))


def valley():
    """A point mass in the potential |x|, whose force jumps at the bottom; no term of its text says so to a series."""
    model = Model("valley")
    x = model.coordinate("x", start=1.0, rate=0.0)
    model.body("ball", mass=1, com=(x, 0))
    model.potential(sqrt(x**2))
    return derive(model)


def doubly_held_pendulum():
    """A pendulum whose rod is said twice."""
    model = Model("doubly_held")
    x = model.coordinate("x", start=1.0, rate=0.0)
    y = model.coordinate("y", start=0.0, rate=0.0)
    model.body("bob", mass=1, com=(x, y))
    model.gravity(y=-1)
    model.constraint("rod", x**2 + y**2 - 1)
    model.constraint("rod_again", 2 * x**2 + 2 * y**2 - 2)
    return derive(model)


def damped_oscillator():
    """A stiff, overdamped spring beside a slow motion."""
    model = Model("damper")
    x = model.coordinate("x", start=1.0, rate=0.0)
    model.body("mass", mass=1, com=(x, 0))
    model.potential(50 * x**2)
    model.dissipation(5e4 * dot(x) ** 2)
    return derive(model)


@pytest.mark.parametrize("name", ["pendulum", "double_pendulum", "spring_pendulum", "slider_crank"])
def test_smooth_motion_is_for_taylor_series(name):
    solution = derived(name).run(t_end=0.5)
    assert solution.method == "taylor"
    assert chosen_note(solution).startswith("method auto: taylor, because")


def test_stiff_motion_is_for_an_implicit_method():
    solution = damped_oscillator().run(t_end=5.0)
    assert METHODS[solution.method].stiff
    assert solution.q[-1, 0] == pytest.approx(np.exp(-5e-3), rel=1e-4)  # x' = -(k/c) x, k/c = 1e-3 1/s


def test_dependent_constraints_are_for_the_explicit_method(monkeypatch):
    assert doubly_held_pendulum().run(t_end=1.0).method == "taylor"  # leaves out what repeats others
    monkeypatch.setattr("symgen.derive.constraints.LARGEST", 0)
    solution = doubly_held_pendulum().run(t_end=1.0)
    assert solution.method == "dop853"
    assert "constraints depend on each other" in chosen_note(solution)


# Of a system that has run before, the choice is kept.
def test_large_models_are_for_the_explicit_method(monkeypatch):
    monkeypatch.setattr(choose, "LARGEST_FOR_SERIES", 20)
    solution = derived.__wrapped__("double_pendulum").run(t_end=0.5)
    assert solution.method == "dop853"
    assert "take long to compile" in chosen_note(solution)


def test_model_without_series_is_for_the_explicit_method(monkeypatch):
    refusing = METHODS["taylor"].__class__(
        **{**vars(METHODS["taylor"]), "refusal": lambda system: "cannot do it"}
    )
    monkeypatch.setitem(METHODS, "taylor", refusing)
    solution = derived.__wrapped__("pendulum").run(t_end=0.5)
    assert chosen_note(solution) == "method auto: dop853, because taylor cannot do it"


def test_a_force_that_jumps_is_followed():
    """The motion is made of parabolas: from rest at 1 it is back after 4 sqrt(2) s."""
    solution = valley().run(t_end=4 * np.sqrt(2))
    assert solution.q[-1, 0] == pytest.approx(1.0, abs=1e-5)
    assert solution.energy.max_error < 1e-5


def test_run_goes_on_where_the_choice_cannot(monkeypatch):
    advance = LoopArrays.advance

    def stuck(arrays, stop, max_steps, **more):
        """The loop, one step at a time; series fail after 0.3 s."""
        if type(arrays.coefficients).__name__ == "TaylorSeries" and arrays.t > 0.3:
            return at.SINGULAR_MATRIX
        return advance(arrays, stop, min(max_steps, 1), **more)

    monkeypatch.setattr(LoopArrays, "advance", stuck)
    system = derived("slider_crank")
    solution = system.run(t_end=1.0, at=[0.2, 0.7], fps=100)
    expected = system.run(t_end=1.0, at=[0.2, 0.7], fps=100, method="dop853", rtol=1e-11, atol=1e-13)
    assert solution.status == "success"
    assert any("dop853 from t = 0.3" in note and "taylor cannot go on" in note for note in solution.notes)
    np.testing.assert_allclose(solution.t, expected.t)
    np.testing.assert_allclose(solution.q, expected.q, atol=1e-6)
    assert solution.energy.max_error < 1e-7
    assert solution.constraint_residual.max_position < 1e-11


def test_a_method_that_was_named_stays(monkeypatch):
    monkeypatch.setattr(LoopArrays, "advance", lambda arrays, stop, max_steps, **more: at.SINGULAR_MATRIX)
    solution = derived("pendulum").run(t_end=1.0, method="taylor")
    assert (solution.status, solution.method) == ("failed", "taylor")


def test_vibration_that_has_died_out_is_not_followed_at_tight_tolerances_either():
    # dop853 does not come near its stability limit here: derivatives of the stiff spring's force limit its step.
    solution = derived("damped_spring_pendulum").run(t_end=1.0, rtol=1e-9, atol=1e-11)
    assert solution.method == "radau9"
    assert "steps" in chosen_note(solution)


def test_weak_vibration_that_lasts_is_stepped_over_where_nobody_would_miss_it():
    model = Model("tense")
    x = model.coordinate("x", start=1.0, rate=0.0)
    y = model.coordinate("y", start=0.01, rate=0.0)
    model.body("slow", mass=1, com=(x, 0))
    model.body("fast", mass=1, com=(0, y))
    model.potential(x**2 / 2 + 5e9 * (y - 0.01 * x) ** 2)  # y rests in its spring, which no damper calms
    solution = derive(model).run(t_end=10.0, rtol=1e-6, atol=1e-8)
    assert METHODS[solution.method].stiff
    assert solution.q[-1, 0] == pytest.approx(np.cos(10.0 / np.sqrt(1.0001)), abs=1e-4)


@pytest.mark.parametrize(
    ("name", "rtol", "method"),
    [
        ("seven_dof_arm", 1e-2, "dop853"),  # it slows down, and stability limits steps that are long enough
        ("rough_road", 1e-3, "taylor"),  # radau5 takes steps three times as short, to follow the road
        ("quarter_car", 1e-3, "radau5"),
        ("quarter_car", 1e-6, "radau9"),  # accuracy limits dop853 there, to steps 30 times as short
        ("free_rigid_body", 1e-4, "dop853"),
        ("free_rigid_body", 1e-8, "taylor"),
        ("bricard", 1e-6, "dop853"),
    ],
)
def test_what_takes_less_time_is_chosen(name, rtol, method):
    """Measured in the scenes of the benchmark and beside them (docs/benchmarks.md)."""
    assert derived(name).run(t_end=0.1, rtol=rtol, atol=1e-2 * rtol).method == method


def test_order_is_that_of_the_step_loop():
    for costs in ((0.0, 26.0, 0.5), (0.0, 2622.0, 44.0), (-320.0, 159.0, 0.6)):
        method = taylor.TaylorSeries(np.uint64(0), np.uint64(0), *costs, 0, N_ROWS, 0)
        order_for = getattr(taylor.order_for, "py_func", taylor.order_for)
        for rtol in 10.0 ** -np.arange(1.0, 16.0):
            assert step_costs.order_of(costs, rtol) == order_for(method, rtol)


def test_series_pay_at_tight_tolerances():
    system = derived("seven_dof_arm")
    ratios = [step_costs.time_ratio(system, rtol) for rtol in (1e-4, 1e-7, 1e-10, 1e-13)]
    assert ratios == sorted(ratios, reverse=True) and ratios[0] > 1.0 > ratios[-1]


def test_chains_of_operations_are_told_from_much_work():
    """-(g / L) sin(theta) waits for a sine, a product and a sign; a chain of links waits for all links before it."""
    pendulum = derived("pendulum").source.facts("rhs")
    assert (pendulum.latency, derived("pendulum").source.facts("energy").latency) == (40 + 4 + 1, 0)
    chains = [derive(load(find("n_pendulum"), {"N": n})).source.facts("rhs") for n in ("20", "40")]
    arm = derived("seven_dof_arm").source.facts("rhs")
    assert chains[1].latency == pytest.approx(2 * chains[0].latency, rel=0.1)
    assert chains[1].work == pytest.approx(2 * chains[0].work, rel=0.1)
    assert chains[0].latency / chains[0].work > 1.5 * arm.latency / arm.work


def stages_of_scout(monkeypatch, system, rtol=1e-8):
    """How many steps `auto` asks for at a time before it chooses."""
    asked, advance = [], LoopArrays.advance

    def counted(arrays, stop, max_steps, **more):
        asked.append(max_steps)
        return advance(arrays, stop, max_steps, **more)

    start = system.initial_state()
    monkeypatch.setattr(LoopArrays, "advance", counted)
    options = RunOptions(t_end=1.0, rtol=rtol, atol=1e-2 * rtol)
    method, _ = choose.choose_method(system, system.parameter_values(), np.concatenate(start[:2]), options)
    return method.name, asked


def test_a_look_at_a_few_steps_is_enough_where_nothing_is_near_stiffness(monkeypatch):
    assert stages_of_scout(monkeypatch, derived("double_pendulum")) == ("taylor", [10, 10])
    assert stages_of_scout(monkeypatch, derived("free_rigid_body")) == ("taylor", [10, 10])


@pytest.mark.parametrize(
    ("torque", "stages"), [("3", 2), ("3*sin(a)", 2), ("3 - dot(a)/10", 3), ("3*cos(t)", 3)]
)
def test_a_motor_without_losses_needs_no_further_look(torque, stages, monkeypatch):
    """What goes the same way back has no decays that would leave something slow behind."""
    model = Model("driven")
    a = model.coordinate("a", start=1.0, rate=0.5)
    model.kinetic(dot(a) ** 2 / 2)
    model.potential("-cos(a)")
    model.force("a", torque)
    name, asked = stages_of_scout(monkeypatch, derive(model))
    assert name == "taylor" and len(asked) == stages


def test_what_is_stiff_or_dies_out_is_looked_at_further(monkeypatch):
    name, asked = stages_of_scout(monkeypatch, derived("damped_spring_pendulum"))
    assert name == "radau9" and asked[:3] == [10, 10, 80]
    name, asked = stages_of_scout(monkeypatch, derived("seven_dof_arm"), rtol=1e-2)  # damped joints
    assert name == "dop853" and asked[:3] == [10, 10, 80]


@pytest.mark.parametrize("name", ["n_pendulum", "humanoid_tree", "spring_chain", "car_axis", "bicycle"])
def test_what_bounds_eigenvalues_is_above_them(name):
    """From many rates on it says that a motion is calm; where it does not, eigenvalues do, and both agree."""
    system = derived(name)
    state, p = np.hstack(system.initial_state()[:2]), system.parameter_values()
    rng = np.random.default_rng(3)
    for size in (0.0, 0.1, 1.0):
        y = state + size * rng.normal(size=len(state))
        for i, _ in Positions(system).quaternions:
            y[i : i + 4] /= np.linalg.norm(y[i : i + 4])
        q, v = y[: system.nq], y[system.nq :]
        jacobian = time_scales.motion_jacobian(system, p, 0.0, q, v)
        true, bound = np.abs(np.linalg.eigvals(jacobian)).max(), time_scales._bound(jacobian, system.nv)
        assert true <= bound * (1.0 + 1e-9)
        for rate in (0.9 * true, 1.1 * true, 1.1 * bound):
            assert time_scales.all_slower(system, p, 0.0, q, v, rate) == (rate > true)


def test_tight_tolerances_need_no_look(monkeypatch):
    assert stages_of_scout(monkeypatch, derived("double_pendulum"), rtol=1e-11) == ("taylor", [])


def test_arrays_of_a_scout_serve_the_next_choice():
    """Whoever chose before with other starts, the choice and the reason are those of a model that is new."""
    rtol, choices = 1e-9, []
    options = RunOptions(t_end=1.0, rtol=rtol, atol=1e-2 * rtol)
    system, other = derived("damped_spring_pendulum"), derived.__wrapped__("damped_spring_pendulum")
    p, (q, v, *_) = system.parameter_values(), system.initial_state()
    moved = np.concatenate([q + 0.01, v - 0.3])
    choose.choose_method(system, p, np.concatenate([q, v]), options)
    for one in (system, other):
        method, why = choose.choose_method(one, p, moved, options)
        choices.append((method.name, why))
    assert choices[0] == choices[1]


def test_a_prepared_run_chooses_once(monkeypatch):
    """Then it takes what it chose, wherever it begins."""
    run = derived("double_pendulum").prepare(
        t_end=1.0, rtol=1e-7, parameters=["g"], start=["theta1"], output="end"
    )
    asked = []
    monkeypatch.setattr("symgen.runtime.simulate.choose_method", lambda *given: asked.append(given))
    ends = [run([9.81], [angle]).copy() for angle in (0.5, 1.0)]
    runs = run.many([[9.81], [9.81]], [[0.5], [1.0]])
    assert not asked and run.method == "taylor"
    assert np.array_equal(runs.y, ends)
