"""Generalised-α and HHT with constraints on positions: second order in positions, rates and multipliers."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from symgen.link import derive
from symgen.model.library import find, load
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.constrained_alpha import START, constrained_alpha_work
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.loop_arrays import LoopArrays

SCHEMES = [(form, name) for form in ("index3", "ggl") for name in ("generalized_alpha", "hht")]
schemes = pytest.mark.parametrize("form, name", SCHEMES)


@functools.cache
def bundled(name):
    return derive(load(find(name)))


@functools.cache
def reference(model, t_end):
    solution = bundled(model).run(t_end=t_end, method="dop853", rtol=1e-13, atol=1e-15, at=[t_end], fps=1)
    return np.concatenate([solution.samples[0].q, solution.samples[0].v])


def multipliers(system, t, y):
    first = system.nq + system.nv + system.nw
    row = system.kernel("rhs")(t, y[: system.nq + system.nv], system.parameter_values())
    return row[first : first + system.m]


def loop(system, form, name, h, t_end, rtol=1e-8):
    assembly = assemble(system, system.parameter_values(), {}, {}, 0.0)
    return LoopArrays(
        system, FORMS[form][name], system.parameter_values(), 0.0, np.concatenate([assembly.q, assembly.v]),
        frame_times=np.zeros(0), rtol=rtol, atol=1e-2 * rtol, step=h, with_events=False,
        log_length=1 << 16,
    )  # fmt: skip


def own_multipliers(arrays):
    divide = getattr(constrained_alpha_work, "py_func", constrained_alpha_work)
    return divide(arrays.coefficients, arrays.sizes, arrays.work).multipliers[START]


def finished(arrays, t_end):
    assert arrays.advance(t_end, 1 << 16) == at.REACHED_STOP
    return arrays


@schemes
@pytest.mark.parametrize("model, t_end, h", [("pendulum_dae", 1.0, 0.01), ("slider_crank", 0.2, 1e-3)])
def test_order_of_positions_rates_and_multipliers(model, t_end, h, form, name):
    system = bundled(model)
    nq, n = system.nq, system.nq + system.nv
    exact, errors = reference(model, t_end), []
    for step in (h, h / 2, h / 4):
        arrays = finished(loop(system, form, name, step, t_end), t_end)
        off = np.abs(arrays.y[:n] - exact)
        in_multipliers = np.abs(own_multipliers(arrays) - multipliers(system, t_end, exact))
        errors.append([off[:nq].max(), off[nq:].max(), in_multipliers.max()])
        assert np.abs(system.kernel("constraint_residual")(t_end, arrays.y[:n], arrays.p)).max() < 1e-13
    orders = np.log2(np.array(errors[0]) / errors[2]) / 2.0
    assert (1.8 < orders).all() and (orders < 2.3).all()


@schemes
def test_no_order_is_lost_in_the_first_steps(form, name):
    """Started from a and v as they are, index-3 form shakes the multipliers by O(h) for many steps."""
    system, errors = bundled("slider_crank"), []
    for h in (4e-4, 1e-4):
        arrays, worst = loop(system, form, name, h, 1.0), 0.0
        for _ in range(8):
            assert arrays.advance(1.0, 1) == at.RUNNING
            worst = max(
                worst, np.abs(own_multipliers(arrays) - multipliers(system, arrays.t, arrays.y)).max()
            )
        errors.append(worst)
    assert 1.8 < np.log2(errors[0] / errors[1]) / 2.0


@pytest.mark.parametrize("form", ["index3", "ggl"])
@pytest.mark.parametrize("model, t_end, h", [("rolling_disc", 0.5, 0.01), ("car_axis", 0.3, 2e-3)])
def test_velocity_constraints_and_constraints_that_move(model, t_end, h, form):
    system = bundled(model)
    n, errors = system.nq + system.nv, []
    for step in (h, h / 2):
        arrays = finished(loop(system, form, "generalized_alpha", step, t_end), t_end)
        errors.append(np.abs(arrays.y[:n] - reference(model, t_end)).max())
        assert np.abs(system.kernel("constraint_residual")(t_end, arrays.y[:n], arrays.p)).max() < 1e-13
    assert 1.8 < np.log2(errors[0] / errors[1]) < 2.2


@schemes
def test_tolerances_at_round_off_do_not_stall_newton(form, name):
    finished(loop(bundled("four_bar"), form, name, 1e-4, 0.02, rtol=1e-13), 0.02)


def test_step_that_is_cut_starts_the_recursion_anew():
    system = bundled("slider_crank")
    arrays = loop(system, "index3", "generalized_alpha", 1e-3, 0.2)
    for stop in (0.0503, 0.1207, 0.2):
        finished(arrays, stop)
    whole = finished(loop(system, "index3", "generalized_alpha", 1e-3, 0.2), 0.2)
    exact = multipliers(system, 0.2, reference("slider_crank", 0.2))
    error, expected = (np.abs(own_multipliers(a) - exact).max() for a in (arrays, whole))
    assert error < 30.0 * expected


def test_run_names_its_form():
    solution = bundled("four_bar").run(t_end=0.1, constraints="index3", step=1e-3)
    assert (solution.method, solution.constraints) == ("generalized_alpha", "index3")
    assert all(check.ok for check in solution.health), [check.says for check in solution.health]


def test_loop_carries_its_state_from_call_to_call():
    system = bundled("four_bar")
    whole = finished(loop(system, "ggl", "hht", 1e-3, 0.05), 0.05)
    parts = loop(system, "ggl", "hht", 1e-3, 0.05)
    while parts.advance(0.05, 1) == at.RUNNING:
        pass
    assert np.array_equal(parts.y, whole.y)
