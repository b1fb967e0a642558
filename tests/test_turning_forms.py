"""Quaternions in all that is not projection: index-3 and index-2 equations, RATTLE, independent coordinates."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from loops import bare_loop
from quaternion_models import module_text
from references import load_reference, numbers
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from symgen.runtime import load
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.constrained_alpha import START, constrained_alpha_work
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.gauss.stages import STIFF
from symgen.runtime.integrate.ggl import blocks_size, divide_blocks, set_blocks, set_shifted, solve_shifted
from symgen.runtime.integrate.jacobian import jacobian_work_size
from symgen.runtime.integrate.linear import lu_factor
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.integrate.partition import SWITCHES
from symgen.runtime.integrate.radau.ggl import rotate_blocks
from symgen.runtime.loop_arrays import LoopArrays, kernel_addresses, loop_sizes
from symgen.runtime.positions import Positions

ROOT = Path(__file__).resolve().parents[1]
UNIT = 1e-14


@cache
def model(name):
    return load(module_text(name))


def start_of(system):
    q, v, _, _ = system.initial_state()
    return np.concatenate([q, v])


@cache
def oracle(name, t_end):
    """The state (q, v) and the multipliers at `t_end` by SciPy, to about 1e-12."""
    system = model(name)
    rhs, p, n = system.kernel("rhs"), system.parameter_values(), system.nq + system.nv
    solution = solve_ivp(
        lambda t, y: rhs(t, y, p)[:n], (0.0, t_end), start_of(system), "DOP853", rtol=3e-14, atol=1e-14
    )
    end = solution.y[:, -1]
    return end, rhs(t_end, end, p)[system.ny : system.ny + system.m]


def fixed_steps(system, method, h, t_end, rtol=1e-8, newton=0.0, state=None):
    arrays = LoopArrays(
        system, method, system.parameter_values(), 0.0, start_of(system) if state is None else state,
        frame_times=np.zeros(0), rtol=rtol, atol=rtol, step=h, with_events=False, log_length=50_000,
    )  # fmt: skip
    arrays.control[at.NEWTON_TOL] = newton
    return arrays


def finished(arrays, t_end):
    assert arrays.advance(t_end, 50_000) == at.REACHED_STOP
    return arrays


def as_written(function):
    """The Python function, for those that return arrays."""
    return getattr(function, "py_func", function)


# The generalised-α method


@pytest.mark.parametrize("which", ["swing", "pinned_top"])
@pytest.mark.parametrize("form", ["index3", "ggl"])
def test_generalised_alpha_has_order_2_in_positions_rates_and_multipliers(form, which):
    system, t_end = model(which), 0.2
    end, multipliers = oracle(which, t_end)
    errors = []
    for h in (1e-3, 5e-4):
        arrays = finished(fixed_steps(system, FORMS[form]["generalized_alpha"], h, t_end, newton=1e-6), t_end)
        divide = as_written(constrained_alpha_work)
        own = divide(arrays.coefficients, arrays.sizes, arrays.work).multipliers[START]
        q, v = np.split(np.abs(arrays.y - end), [system.nq])
        errors.append([q.max(), v.max(), np.abs(own - multipliers).max()])
        assert q.max() < 2e-3
    assert (np.abs(np.log2(errors[0]) - np.log2(errors[1]) - 2.0) < 0.25).all()


# Index-2 equations


@pytest.mark.parametrize("axes", ["body", "start"])
@pytest.mark.parametrize("which", ["swing", "pinned_top"])
def test_reduced_newton_systems_are_the_derivatives_of_the_equations(which, axes):
    """Corrections, put into the equations by differences, take away the residuals that they were made from.

    With angular velocities and moments in the axes of the body, or in those that it has at the start of the step.
    """
    system = model(which)
    p, nq, nv, m, nh = system.parameter_values(), system.nq, system.nv, system.m, system.nh
    found = assemble(system, p, {}, {"top_wx": 3.0, "top_wy": 10.0})
    q, v, positions = found.q, found.v, Positions(system)
    sizes, row = loop_sizes(system, with_events=False), system.kernel("rhs")(0.0, np.append(q, v), p)
    addresses, _keep = kernel_addresses(system, FORMS["ggl"]["radau5"], with_events=False)
    b = as_written(divide_blocks)(sizes, np.zeros(blocks_size(sizes)))
    bare, scratch = (
        bare_loop(sizes, system.precomputed(p), addresses, np.append(q, v)),
        np.zeros(jacobian_work_size(sizes)),
    )
    assert set_blocks(bare, 0.0, bare.y, row, scratch, b) == 0
    sense = 1.0
    if axes == "start":
        as_written(rotate_blocks)(sizes, np.append(q, v), row, b)
        sense = -1.0
    g, n = 50.0, nv + m
    matrix, pivots, x = (
        np.zeros((n, n)),
        np.zeros(n, dtype=np.int64),
        np.random.default_rng(3).normal(size=n + nh),
    )
    residuals = x.copy()
    set_shifted(g, nh, b, matrix)
    assert lu_factor(matrix, pivots) == 0
    solve_shifted(g, sizes, b, matrix, pivots, x)
    turning = np.zeros((nv, nv))
    for _, j in positions.quaternions:
        turning[j : j + 3, j : j + 3] = 0.5 * sense * np.cross(v[j : j + 3], np.eye(3)).T
    move = np.linalg.solve(g * np.eye(nv) + turning, x[:nv] + b.steer @ x[n:])
    a, lam = row[nq : nq + nv], row[system.ny : system.ny + m]

    def turned_by(step, vector):
        out = vector.copy()
        for _, j in positions.quaternions if axes == "start" else ():
            out[j : j + 3] = Rotation.from_rotvec(step * move[j : j + 3]).apply(vector[j : j + 3])
        return out

    def equations(step):
        state = np.append(positions.retract(q, step * move), turned_by(-step, v + step * x[:nv]))
        rates = turned_by(-step, a + step * g * x[:nv])
        arguments = np.concatenate([state, rates, lam + step * x[nv:n]])
        drift = system.kernel("constraint_residual")(0.0, state, p)
        moments = turned_by(step, system.kernel("residual")(0.0, arguments, p)[:nv])
        return np.concatenate([moments, drift[nh:], drift[:nh]])

    h = 1e-5
    assert np.abs((equations(h) - equations(-h)) / (2.0 * h) + residuals).max() < 1e-6


@pytest.mark.parametrize("which", ["swing", "pinned_top"])
@pytest.mark.parametrize(("name", "limit"), [("radau5", 20.0), ("bdf", 500.0)])
def test_index_2_errors_follow_the_tolerance(name, limit, which):
    system, t_end = model(which), 0.1
    end, multipliers = oracle(which, t_end)
    for rtol in (1e-5, 1e-8):
        run = system.run(t_end=t_end, method=name, constraints="ggl", rtol=rtol, atol=rtol, at=[t_end])
        assert run.status == "success"
        sample = run.samples[0]
        assert np.abs(np.append(sample.q, sample.v) - end).max() < limit * rtol
        assert (
            np.abs(sample.multipliers - multipliers).max() < 10.0 * limit * rtol * np.abs(multipliers).max()
        )
        assert np.abs(np.linalg.norm(run.q[:, system.quaternions[0] :], axis=1) - 1.0).max() < UNIT
        assert run.constraint_residual.max_position < 1e-12


# As plain Python, since a compilation of each would take longer than the runs.
RUNS = """
import json, sys
from symgen.runtime import load
found = []
for which, text in json.load(sys.stdin).items():
    system = load(text)
    for method in ("radau9", "radau13"):
        for rtol in (1e-5, 1e-8):
            run = system.run(t_end=0.1, method=method, constraints="ggl", rtol=rtol, atol=rtol, at=[0.1])
            end = [*run.q[-1], *run.v[-1]]
            found.append([which, method, rtol, end, run.samples[0].multipliers.tolist(), run.stats["steps"],
                          run.constraint_residual.max_position])
print(json.dumps(found))
"""


def test_index_2_radau_of_higher_order_follows_the_tolerance():
    texts = json.dumps({which: module_text(which) for which in ("swing", "pinned_top")})
    done = subprocess.run(
        [sys.executable, "-c", RUNS], input=texts, text=True, capture_output=True, check=True, cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
    )  # fmt: skip
    found = json.loads(done.stdout)
    assert len(found) == 8
    for which, method, rtol, state, own, steps, off in found:
        end, multipliers = oracle(which, 0.1)
        assert np.abs(np.array(state) - end).max() < 100.0 * rtol, (which, method, rtol)
        assert np.abs(np.array(own) - multipliers).max() < 1000.0 * rtol * np.abs(multipliers).max()
        assert steps <= 20 and off < 1e-12


def test_index_2_steps_are_as_long_as_those_of_index_1():
    """A top at 150 rad/s, whose constraints' gradients turn with it in its own axes."""
    system = model("pinned_top")
    for rtol in (1e-4, 1e-6, 1e-8):
        steps = {
            form: system.run(t_end=0.2, method="radau5", rtol=rtol, atol=rtol, constraints=form).stats[
                "steps"
            ]
            for form in ("ggl", "projection")
        }
        assert steps["ggl"] <= steps["projection"]


def test_frames_within_steps_that_turn_far_are_as_good_as_ends():
    """A step turns the top by up to 80 degrees: its quaternion is no polynomial of the stages' degree."""
    system, t_end = model("pinned_top"), 0.1
    exact = system.run(t_end=t_end, method="dop853", rtol=1e-13, atol=1e-13, fps=2000)
    run = system.run(t_end=t_end, method="radau5", constraints="ggl", rtol=1e-6, atol=1e-6, fps=2000)
    assert len(run.t) > 8 * run.stats["steps"]
    assert np.abs(run.q - exact.q).max() < 1e-6
    assert np.abs(run.v - exact.v).max() < 1e-6 * 150.0


# RATTLE


def turned(y):
    """Rotation, body to world, of the free body's state."""
    return Rotation.from_quat(np.roll(y[:4], -1)).as_matrix()


def test_rattle_keeps_angular_momentum_and_lets_energy_swing():
    """Over 3000 turns: momentum in space is an invariant of the method, energy is one of a neighbouring motion's."""
    inertia, h = np.array([1.0, 2.0, 3.0]), 0.05
    system = model("free_body")
    state = np.array([1.0, 0.0, 0.0, 0.0, 0.3, 1.0, 0.2])
    spread = []
    for n in (2_000, 40_000):
        arrays = fixed_steps(system, METHODS["rattle"], h, n * h, state=state)
        energies = []
        for k in range(1, 101):
            finished(arrays, k * n * h / 100)
            energies.append(0.5 * inertia @ arrays.y[4:7] ** 2)
        drift = turned(arrays.y) @ (inertia * arrays.y[4:7]) - inertia * state[4:]
        assert np.abs(drift).max() < 1e-12
        assert abs(np.linalg.norm(arrays.y[:4]) - 1.0) < 1e-15
        spread.append(np.ptp(energies))
    assert spread[1] < 1.1 * spread[0] < 1e-3


@pytest.mark.parametrize("name", ["rattle", "rattle4"])
def test_rattle_goes_back_to_where_it_came_from(name):
    system, t_end, h = model("swing"), 0.3, 5e-3
    there = finished(fixed_steps(system, METHODS[name], h, t_end), t_end).y
    back = np.append(there[:4], -there[4:])
    again = finished(fixed_steps(system, METHODS[name], h, t_end, state=back), t_end).y
    assert np.abs(np.append(again[:4], -again[4:]) - start_of(system)).max() < 1e-11


# Gauss


@pytest.mark.parametrize("order", [4, 6, 8])
def test_gauss_comes_to_the_verified_digits_of_a_free_body_with_its_order(order):
    digits = numbers(load_reference("free_rigid_body")["reference_w_then_quaternion"]["10"])
    system, errors = model("free_body"), []
    for h in (1.0, 0.5):
        y = finished(fixed_steps(system, METHODS[f"gauss{order}"], h, 10.0), 10.0).y
        errors.append(np.abs(np.concatenate([y[4:], y[:4]]) - digits).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


def test_gauss_keeps_all_invariants_of_a_free_body_to_round_off():
    inertia, system, n, h = np.array([1.0, 2.0, 3.0]), model("free_body"), 20_000, 0.05
    state = np.array([1.0, 0.0, 0.0, 0.0, 0.3, 1.0, 0.2])
    arrays = finished(fixed_steps(system, METHODS["gauss8"], h, n * h, state=state), n * h)
    energy = 0.5 * inertia @ (arrays.y[4:7] ** 2 - state[4:] ** 2)
    assert abs(energy) < 3e-14 and abs(np.linalg.norm(arrays.y[:4]) - 1.0) < 1e-15
    assert np.abs(turned(arrays.y) @ (inertia * arrays.y[4:7]) - inertia * state[4:]).max() < 1e-9


@pytest.mark.parametrize("which", ["swing", "top_on_cart"])
def test_newton_finds_the_stages_that_substitution_finds(which):
    system, t_end = model(which), 0.1
    ends, per_step = [], []
    for stiff in (0, 1):
        arrays = fixed_steps(system, METHODS["gauss6"], 0.01, t_end)
        arrays.counters[STIFF] = stiff
        ends.append(finished(arrays, t_end).y)
        per_step.append(arrays.counters[at.NEWTON_ITERATIONS] / arrays.counters[at.STEPS])
    assert np.abs(ends[1] - ends[0]).max() < 1e-12
    assert per_step[1] <= 1.5 * per_step[0]


def test_gauss_says_where_a_step_turns_too_far():
    """Half a turn in a step can be solved for; twenty cannot."""
    system = model("free_body")
    for rate, status in ((3.0, at.REACHED_STOP), (120.0, at.NEWTON_FAILED)):
        state = np.array([1.0, 0.0, 0.0, 0.0, 0.0, rate, 0.0])
        arrays = fixed_steps(system, METHODS["gauss6"], 1.0, 2.0, state=state)
        assert arrays.advance(2.0, 100) == status


# Independent coordinates


@pytest.mark.parametrize("which", ["swing", "pinned_top"])
def test_partition_agrees_with_the_oracle_without_switching(which):
    """Turns about axes in space depend on others, or do not, for as long as these axes serve: the body spins on."""
    system, t_end = model(which), 0.5
    end, _ = oracle(which, t_end)
    run = system.run(
        t_end=t_end, method="dop853", constraints="partition", rtol=1e-10, atol=1e-12, at=[t_end]
    )
    sample = run.samples[0]
    assert np.abs(np.append(sample.q, sample.v) - end).max() < 3e-8
    assert np.abs(np.linalg.norm(run.q[:, system.quaternions[0] :], axis=1) - 1.0).max() < UNIT
    arrays = fixed_steps(system, FORMS["partition"]["dop853"], 0.0, t_end)
    assert finished(arrays, t_end).counters[SWITCHES] <= 1


def test_partition_has_the_order_of_the_method():
    system, t_end = model("pinned_top"), 0.2
    end, _ = oracle("pinned_top", t_end)
    errors = [
        np.abs(finished(fixed_steps(system, FORMS["partition"]["rk4"], h, t_end), t_end).y - end).max()
        for h in (1e-3, 5e-4)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.2)
