"""Independent coordinates: which are chosen, accuracy through switching, redundancy, and where none serve."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest

from symgen import Model, cos, sin
from symgen.link import derive
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.runtime import load
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.partition import FIRST_RANK, N_POSITIONS, N_RATES, SWITCHES
from symgen.runtime.loop_arrays import LoopArrays

FIXTURES = Path(__file__).parent / "fixtures"
METHODS_HERE = FORMS["partition"]
ADAPTIVE = [name for name, method in METHODS_HERE.items() if method.adaptive]


def within_reach(*tolerances):
    """Pairs of method and tolerance: tighter ones take a method of low order millions of steps."""
    return [
        (name, rtol)
        for name in ADAPTIVE
        for rtol in tolerances
        if rtol >= 10.0 ** (-3 - 2 * METHODS_HERE[name].order)
    ]


@functools.cache
def bundled(name):
    return derive(load_model(find(name)))


def loop(system, name, t_end, *, step=0.0, rtol=1e-11, frame_times=()):
    assembly = assemble(system, system.parameter_values(), {}, {}, 0.0)
    return LoopArrays(
        system, METHODS_HERE[name], system.parameter_values(), 0.0, np.concatenate([assembly.q, assembly.v]),
        frame_times=np.asarray(frame_times, dtype=float), rtol=rtol, atol=1e-2 * rtol, step=step,
        with_events=False, log_length=1 << 16,
    )  # fmt: skip


def finished(arrays, t_end):
    assert arrays.advance(t_end, 1 << 16) == at.REACHED_STOP
    return arrays


def projected(system, t_end):
    solution = system.run(t_end=t_end, method="dop853", rtol=1e-13, atol=1e-15, at=[t_end], fps=1)
    return np.concatenate([solution.samples[0].q, solution.samples[0].v])


@pytest.mark.parametrize("name", ADAPTIVE)
@pytest.mark.parametrize("model, t_end, switches", [("pendulum_dae", 6.0, 3), ("andrews_squeezer", 0.02, 0)])
def test_agrees_with_projection_through_switching(model, name, t_end, switches):
    """The pendulum's x and y take turns at determining each other."""
    system = bundled(model)
    arrays = finished(loop(system, name, t_end), t_end)
    n = system.nq + system.nv
    expected = projected(system, t_end)
    assert (np.abs(arrays.y[:n] - expected) < 1e-9 * (1.0 + np.abs(expected))).all()
    assert arrays.counters[SWITCHES] >= switches
    assert np.abs(system.kernel("constraint_residual")(t_end, arrays.y[:n], arrays.p)).max() < 1e-14


@pytest.mark.parametrize("model, t_end", [("rolling_disc", 0.5), ("car_axis", 0.3), ("slider_crank", 0.1)])
def test_rk4_has_its_order(model, t_end):
    """Velocity constraints, constraints that move, a coordinate without mass."""
    system = bundled(model)
    n, expected = system.nq + system.nv, projected(system, t_end)
    errors = [
        np.abs(finished(loop(system, "rk4", t_end, step=t_end / k), t_end).y[:n] - expected).max()
        for k in (50, 100)
    ]
    assert 3.7 < np.log2(errors[0] / errors[1]) < 4.5


def test_velocity_constraints_take_further_rates():
    system = bundled("rolling_disc")
    arrays = finished(loop(system, "dop853", 0.1), 0.1)
    assert arrays.counters[N_POSITIONS] == system.nh
    assert arrays.counters[N_RATES] == system.m > system.nh


def test_redundant_constraints_are_left_out():
    twice, once = (load(FIXTURES / f"{name}.py") for name in ("redundant_pendulum", "cartesian_pendulum"))
    arrays = finished(loop(twice, "dop853", 0.8), 0.8)
    assert arrays.counters[FIRST_RANK] == 1 < twice.m
    assert np.abs(arrays.y[:4] - finished(loop(once, "dop853", 0.8), 0.8).y[:4]).max() < 1e-10


def test_frames_are_on_the_constraints():
    system = bundled("pendulum_dae")
    times = np.linspace(0.0, 2.0, 14)[1:-1]
    arrays = finished(loop(system, "dop853", 2.0, frame_times=times), 2.0)
    for t, frame in zip(times, arrays.frames, strict=True):
        assert np.abs(system.kernel("constraint_residual")(t, frame[:4], arrays.p)).max() < 1e-12


@functools.cache
def parallelogram():
    """Two equal cranks and a coupler as long as the base: all bars lie on one line where the cranks point along it."""
    model = Model("parallelogram")
    a, b, c = (
        model.coordinate("a", start=1.0, rate=-3.0),
        model.coordinate("b"),
        model.coordinate("c", guess=1.0),
    )
    for name, angle, mass, x, y in (
        ("left", a, 1, 0, 0),
        ("coupler", b, 2, cos(a), sin(a)),
        ("right", c, 1, 2, 0),
    ):
        length = 2 if name == "coupler" else 1
        com = (x + length * cos(angle) / 2, y + length * sin(angle) / 2)
        model.body(name, mass=mass, inertia=mass * length**2 / 12, com=com, angle=angle)
    model.constraint("close_x", cos(a) + 2 * cos(b) - cos(c) - 2)
    model.constraint("close_y", sin(a) + 2 * sin(b) - sin(c))
    return derive(model)


@pytest.mark.parametrize(("name", "rtol"), within_reach(1e-6, 1e-8, 1e-11))
def test_change_point_is_passed_or_ends_the_run(name, rtol):
    """Steps from one side to the other pass it on the branch that they were on; what comes too close says so."""
    solution = parallelogram().run(t_end=2.0, method=name, constraints="partition", rtol=rtol, atol=rtol)
    if solution.status == "success":
        assert np.abs(solution.q - np.outer(1.0 - 3.0 * solution.t, [1.0, 0.0, 1.0])).max() < 1e-6
    else:
        assert "Every choice of independent coordinates fails" in solution.message


def test_change_point_itself_ends_the_run_with_the_true_reason():
    solution = parallelogram().run(t_end=2.0, method="dop853", constraints="partition", at=[1.0 / 3.0])
    assert solution.status == "failed" and solution.constraints == "partition"
    assert "Every choice of independent coordinates fails" in solution.message
    assert solution.t[-1] == pytest.approx(1.0 / 3.0, abs=1e-3)


def test_methods_without_the_form_are_refused():
    with pytest.raises(
        RuntimeModelError, match=f"does not have this form, which is that of: {', '.join(METHODS_HERE)}"
    ):
        bundled("pendulum_dae").run(t_end=0.1, method="gauss8", constraints="partition")


TABLE, RADIUS = 2.0, 0.1


@functools.cache
def ball_on_a_turntable():
    """A solid ball that rolls on a turntable: a free body with a quaternion, one position and two rates held."""
    model = Model("turntable")
    model.body("ball", mass=1.0, com=(0, 0, 0), inertia=[0.4 * RADIUS**2] * 3)
    spin = [TABLE / RADIUS - 5.0, 0.0, 0.3]
    model.joint("j", "free", "ball", start=[1, 0, RADIUS, 1, 0, 0, 0], rate_guess=[0, 0.5, 0, *spin])
    for k, axis in enumerate("xyz"):
        model.axis(f"e{axis}", "ball", [float(i == k) for i in range(3)])
    turn = {c: " + ".join(f"e{a}_{c}*j_w{a}" for a in "xyz") for c in "xyz"}
    model.constraint("height", f"j_z - {RADIUS}")
    model.velocity_constraint("slip_x", f"j_vx - {RADIUS}*({turn['y']}) + {TABLE}*j_y")
    model.velocity_constraint("slip_y", f"j_vy + {RADIUS}*({turn['x']}) - {TABLE}*j_x")
    model.output("upright_spin", turn["z"])
    return derive(model)


@pytest.mark.parametrize(("name", "rtol"), within_reach(1e-4, 1e-6, 1e-9, 1e-12))
def test_ball_on_a_turntable_goes_round_at_two_sevenths_of_its_rate(name, rtol):
    """Its spin about the vertical stays; in body axes, which turn with it, the choice wore out twice a turn."""
    run = ball_on_a_turntable().run(
        t_end=20.0, method=name, constraints="partition", rtol=rtol, atol=0.1 * rtol
    )
    assert run.ok, run.objections
    turns, first = 2.0 / 7.0 * TABLE, complex(run.v[0, 0], run.v[0, 1])
    speed = first * np.exp(1j * turns * run.t)
    place = complex(run.q[0, 0], run.q[0, 1]) + (speed - first) / (1j * turns)
    assert np.abs(run.q[:, 0] + 1j * run.q[:, 1] - place).max() < 30.0 * rtol + 1e-11
    assert np.abs(run.v[:, 0] + 1j * run.v[:, 1] - speed).max() < 30.0 * rtol + 1e-11
    spin = run["upright_spin"]
    assert np.abs(spin - spin[0]).max() < (30.0 * rtol + 1e-11) * np.abs(run.v[:, 3:]).max()
    assert run.energy.unscaled_error < 30.0 * rtol + 1e-12


def test_rk4_rolls_with_its_order():
    errors = []
    for step in (0.02, 0.01):
        run = ball_on_a_turntable().run(t_end=5.0, method="rk4", constraints="partition", step=step)
        errors.append(np.abs(run["upright_spin"] - run["upright_spin"][0]).max())
    assert 3.7 < np.log2(errors[0] / errors[1]) < 5.5


@pytest.mark.parametrize("size", [1e-4, 1e6])
def test_accuracy_does_not_depend_on_the_unit_of_length(size):
    """What Newton's iterations leave, and where they stop, goes by the size of the mechanism."""
    model = Model("pendulum", gravity=(0, -9.81 * size))
    for name, place in (("x", 0.6), ("y", 0.8)):
        model.coordinate(name, start=place * size, rate=0.0)
    model.body("bob", mass=1.0, com=("x", "y"))
    model.constraint("rod", f"(x^2 + y^2)/{size!r} - {size!r}")
    given = {"t_end": 5.0, "method": "dop853", "rtol": 1e-9, "atol": 1e-10 * size}
    system = derive(model)
    run, other = (system.run(constraints=form, **given) for form in ("partition", "projection"))
    assert run.ok and np.abs(run.q - other.q).max() < 1e-6 * size
