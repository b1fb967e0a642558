"""RATTLE and its compositions: the textbook step, orders, symmetry, symplecticity, energy of long runs, refusals."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from symgen import Model, dot, sqrt
from symgen.link import derive
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.runtime import load
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.loop_arrays import LoopArrays

FIXTURES = Path(__file__).parent / "fixtures"
ORDERS = {"rattle": 2, "rattle4": 4, "rattle6": 6}


@functools.cache
def bundled(name):
    return derive(load_model(find(name)))


@functools.cache
def reference(name, t_end):
    solution = bundled(name).run(t_end=t_end, method="dop853", rtol=1e-13, atol=1e-14, at=[t_end], fps=1)
    return np.concatenate([solution.samples[0].q, solution.samples[0].v])


def start(system):
    assembly = assemble(system, system.parameter_values(), {}, {}, 0.0)
    return np.concatenate([assembly.q, assembly.v])


def loop(system, name, h, t_end, *, state=None, frame_times=()):
    return LoopArrays(
        system, METHODS[name], system.parameter_values(), 0.0, start(system) if state is None else state,
        frame_times=np.asarray(frame_times, dtype=float), rtol=1e-8, atol=1e-10, step=h,
        with_events=False, log_length=1 << 16,
    )  # fmt: skip


def finished(arrays, t_end):
    assert arrays.advance(t_end, 1 << 16) == at.REACHED_STOP
    return arrays


def residual(system, t, y):
    n = system.nq + system.nv
    return np.abs(system.kernel("constraint_residual")(t, y[:n], system.parameter_values())).max()


def test_step_is_the_textbook_one_where_the_mass_matrix_is_constant():
    """Andersen's equations for a pendulum of unit mass and length, solved by MINPACK."""
    system, h = bundled("pendulum_dae"), 0.1
    y = start(system)
    force = np.array([0.0, -1.0])

    def textbook(unknown, q, v):
        q1, v1, (lam, mu) = unknown[:2], unknown[2:4], unknown[4:]
        half = v + 0.5 * h * (force - lam * q)
        return [
            *(q1 - q - h * half),
            *(v1 - half - 0.5 * h * (force - mu * q1)),
            q1 @ q1 - 1.0,
            q1 @ v1,
        ]

    expected = y
    for _ in range(5):
        guess = [*expected, 0.0, 0.0]
        expected = fsolve(textbook, guess, args=(expected[:2], expected[2:]), xtol=1e-13)[:4]
    arrays = finished(loop(system, "rattle", h, 0.5), 0.5)
    assert np.abs(arrays.y - expected).max() < 1e-12


@pytest.mark.parametrize(
    "name, steps, model, t_end",
    [
        ("rattle", (100, 200), "four_bar", 0.1),
        ("rattle4", (50, 100), "four_bar", 0.1),
        ("rattle6", (30, 60), "four_bar", 0.1),
        ("rattle6", (75, 150), "car_axis", 0.3),
        ("rattle4", (100, 200), "slider_crank", 0.1),
    ],
)
def test_observed_order_of_steps_and_frames(name, steps, model, t_end):
    """A mass matrix that changes, constraints that move, a coordinate without mass."""
    system, order = bundled(model), ORDERS[name]
    place = 0.37 * t_end
    errors, between = [], []
    for n in steps:
        arrays = finished(loop(system, name, t_end / n, t_end, frame_times=[place]), t_end)
        k = system.nq + system.nv
        errors.append(np.abs(arrays.y[:k] - reference(model, t_end)).max())
        between.append(np.abs(arrays.frames[0, :k] - reference(model, place)).max())
        assert max(residual(system, t_end, arrays.y), residual(system, place, arrays.frames[0])) < 1e-13
    assert order - 0.3 < np.log2(errors[0] / errors[1]) < order + 0.5
    assert between[1] < errors[1] * 20.0


@pytest.mark.parametrize("name", ORDERS)
def test_forth_and_back_is_the_start(name):
    system = bundled("four_bar")
    y0, nq = start(system), system.nq
    there = finished(loop(system, name, 2e-3, 0.1), 0.1).y.copy()
    there[nq:] *= -1.0
    back = finished(loop(system, name, 2e-3, 0.1, state=there), 0.1).y
    back[nq:] *= -1.0
    assert np.abs(back - y0).max() < 1e-12


def test_step_is_symplectic_though_the_mass_matrix_changes():
    """The derivative D of the step in q and p = M v: Dᵀ J D = J; Verlet's for the same model is far from that."""
    system = load(FIXTURES / "double_pendulum.py")
    n, p = system.nq, system.parameter_values()

    def mass(q):
        return system.kernel("mass_matrix")(0.0, np.concatenate([q, np.zeros(n)]), p).reshape(n, n)

    def step(name, z):
        state = np.concatenate([z[:n], np.linalg.solve(mass(z[:n]), z[n:])])
        y = finished(loop(system, name, 0.05, 0.05, state=state), 0.05).y
        return np.concatenate([y[:n], mass(y[:n]) @ y[n : 2 * n]])

    def defect(name):
        z, eps = np.array([0.8, -0.5, 0.3, 0.2]), 1e-5
        columns = []
        for unit in np.eye(2 * n):
            far, near = ([step(name, z + s * k * eps * unit) for s in (1, -1)] for k in (2, 1))
            columns.append((8.0 * (near[0] - near[1]) - (far[0] - far[1])) / (12.0 * eps))
        d = np.array(columns).T
        form = np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])
        return np.abs(d.T @ form @ d - form).max()

    assert defect("rattle") < 1e-9
    assert defect("rattle4") < 1e-9
    assert defect("verlet") > 1e-5


def test_energy_of_a_four_bar_does_not_drift():
    """The same, projected after each step, drifts: its step is not symmetric."""
    system = bundled("four_bar")
    t_end, energy = 60.0, system.kernel("energy")
    times = np.linspace(0.0, t_end, 601)[1:]

    def drift_and_spread(name, h):
        arrays = loop(system, name, h, t_end)
        values = []
        for t in times:
            finished(arrays, t)
            values.append(energy(t, arrays.y[:6], arrays.p).sum())
        slope, height = np.polyfit(times, values, 1)
        return abs(slope) * t_end, np.std(np.array(values) - slope * times - height)

    drift, spread = drift_and_spread("rattle4", 0.01)
    assert spread < 1e-4 and drift < 0.5 * spread
    drift, spread = drift_and_spread("gauss4", 0.01)
    assert drift > 3.0 * spread


def test_redundant_constraints():
    system = load(FIXTURES / "redundant_pendulum.py")
    twice = finished(loop(system, "rattle6", 0.02, 0.5), 0.5)
    once = finished(loop(load(FIXTURES / "cartesian_pendulum.py"), "rattle6", 0.02, 0.5), 0.5)
    assert np.abs(twice.y[:4] - once.y[:4]).max() < 1e-12
    assert residual(system, 0.5, twice.y) < 1e-13


def test_work_of_a_damped_drive_is_balanced():
    def exact(t, y):
        force = 0.5 * np.sin(3.0 * t) - 0.2 * y[1]
        return [y[1], force - 25.0 * y[0], force * y[1]]

    expected = solve_ivp(exact, (0.0, 0.8), [0.1, 0.0, 0.0], "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    errors = [
        np.abs(finished(loop(load(FIXTURES / "oscillator.py"), "rattle4", h, 0.8), 0.8).y - expected)
        for h in (0.02, 0.01)
    ]
    assert (np.log2(errors[0] / errors[1]) > 3.7).all()


def test_run_is_the_same_call_by_call_and_with_frames():
    system = bundled("four_bar")
    whole = finished(loop(system, "rattle4", 2e-3, 0.1), 0.1)
    parts = loop(system, "rattle4", 2e-3, 0.1, frame_times=np.linspace(0.0, 0.1, 34)[1:-1])
    while parts.advance(0.1, 1) == at.RUNNING:
        pass
    assert np.array_equal(parts.y, whole.y)


def test_form_is_named_and_others_are_refused():
    system = bundled("four_bar")
    solution = system.run(t_end=0.05, method="rattle6", step=1e-3)
    assert solution.constraints == "index3" and all(check.ok for check in solution.health)
    with pytest.raises(RuntimeModelError, match="'rattle6' solves constraints in the form 'index3'"):
        system.run(t_end=0.1, method="rattle6", constraints="projection")
    with pytest.raises(RuntimeModelError, match="use rattle4, rattle6, gauss8 or dop853"):
        system.run(t_end=0.1, method="verlet6")


def test_models_without_momenta_along_positions_are_refused():
    with pytest.raises(RuntimeModelError, match="'contact_x' holds velocities: use implicit_midpoint"):
        bundled("rolling_disc").run(t_end=0.1, method="rattle")
    model = Model("relativistic")
    x = model.coordinate("x", rate=0.5)
    model.kinetic(-sqrt(1 - dot(x) ** 2))
    with pytest.raises(RuntimeModelError, match="kinetic energy that is quadratic"):
        derive(model).run(t_end=0.1, method="rattle4")
