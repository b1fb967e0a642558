"""Models with unit quaternions: orders, invariants, published digits, assembly, events, recordings."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from loops import bare_loop
from quaternion_models import MODELS, module_text
from references import load_reference, numbers
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from symgen import Model, link
from symgen.link import module_for
from symgen.model.library import find
from symgen.runtime import RunOptions, load
from symgen.runtime.batches import evaluate
from symgen.runtime.checks.advice import advise
from symgen.runtime.checks.convergence import study
from symgen.runtime.checks.time_scales import time_scales, time_scales_at
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.constraints.contradictions import AssemblyError
from symgen.runtime.constraints.kkt import robust_project_address
from symgen.runtime.errors import ModuleError, RuntimeModelError, UnknownNameError
from symgen.runtime.integrate import large_models
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.jacobian import acceleration_jacobian, jacobian_work_size
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.integrate.methods.taylor import taylor
from symgen.runtime.loop_arrays import LoopArrays, loop_sizes
from symgen.runtime.positions import Chart, Positions
from symgen.runtime.recording.reader import read_recording
from symgen.runtime.recording.recorder import RunRecorder
from symgen.runtime.recording.verify import verify
from symgen.runtime.result_json import result

TURNING = [name for name, method in METHODS.items() if not method.needs_plain_rates]
ONE_ORDER = [name for name in TURNING if name != "bdf"]  # whose orders are tried one by one in test_bdf.py
UNIT = 1e-14
ARM = np.array([0.0, 1.0, 0.0])


@cache
def model(name):
    """A system of `quaternion_models`, one for all tests: its kernels are read from the cache once."""
    return load(module_text(name))


def start_of(system):
    q, v, _, _ = system.initial_state()
    return np.concatenate([q, v])


def random_state(system, seed):
    random = np.random.default_rng(seed)
    q = random.normal(size=system.nq)
    return Positions(system).normalised(q), random.normal(size=system.nv)


def rotations(q):
    """Rotation matrices, body to world, of quaternions w, x, y, z."""
    return Rotation.from_quat(np.roll(q, -1, axis=-1)).as_matrix()


def fixed_steps(system, name, h, t_end, state, frame_times=()):
    """Steps of h with any method: an adaptive one is given no reason to take others."""
    method = METHODS[name]
    if name == "taylor":  # which chooses its order by the tolerance
        method = taylor(method.order)
    arrays = LoopArrays(
        system, method, system.parameter_values(), 0.0, state,
        frame_times=np.asarray(frame_times, dtype=float), rtol=1e6, atol=1e6, step=h, with_events=False,
        log_length=50_000,
    )  # fmt: skip
    arrays.control[at.NEWTON_TOL] = 1e-15
    arrays.control[at.H_MAX] = h
    assert arrays.advance(t_end, 50_000) == at.REACHED_STOP
    return arrays


@cache
def oracle(name, state, times):
    """States (q, v) of a model by SciPy, to about 1e-12; start and times are tuples."""
    system = model(name)
    rhs, p, n = system.kernel("rhs"), system.parameter_values(), system.nq + system.nv
    solution = solve_ivp(
        lambda t, y: rhs(t, y, p)[:n], (0.0, times[-1]), state, "DOP853", times, rtol=3e-14, atol=1e-14
    )
    return solution.y.T


# Kinematics


@pytest.mark.parametrize("name", MODELS)
def test_kinematics_is_how_positions_are_moved(name):
    system = model(name)
    (q, v), positions = random_state(system, 1), Positions(system)
    out = system.kernel("kinematics")(0.0, np.concatenate([q, v]), system.parameter_values())
    n = out[: system.nq * system.nv].reshape(system.nq, system.nv)
    h = 1e-5
    for i, e in enumerate(np.eye(system.nv)):
        assert np.allclose(
            (positions.retract(q, h * e) - positions.retract(q, -h * e)) / (2 * h), n[:, i], atol=1e-10
        )
    rhs = system.kernel("rhs")(0.0, np.concatenate([q, v]), system.parameter_values())
    assert np.allclose(rhs[: system.nq], n @ v, atol=1e-14)


@pytest.mark.parametrize("name", MODELS)
def test_many_small_moves_at_once_are_those_made_one_by_one(name):
    system = model(name)
    positions, places = Positions(system), np.stack([random_state(system, k)[0] for k in (1, 2)])
    steps = 1e-3 * np.random.default_rng(4).normal(size=(2, 5, system.nv))
    steps[:, 0] = 0.0
    one_by_one = [[positions.retract(q, step) for step in own] for q, own in zip(places, steps)]
    assert np.allclose(positions.retractions(places, steps), one_by_one, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("size", [1e-5, 0.5, 3.0])
def test_chart_turns_by_rotation_vectors_and_knows_its_derivative(size):
    system = model("top_on_cart")
    q, _ = random_state(system, 2)
    chart = Chart(Positions(system), q)
    random = np.random.default_rng(3)
    x = chart.start + size * np.array([0.0, *random.normal(size=3) / 2.0, 0.0])
    turned = rotations(q[1:5]) @ Rotation.from_rotvec(x[1:4]).as_matrix()
    assert np.allclose(rotations(chart.q(x)[1:5]), turned, atol=1e-14)
    gradient = random.normal(size=system.nq)  # of a function of q
    by_rates = gradient @ np.column_stack(
        [(Positions(system).retract(chart.q(x), 1e-5 * e) - chart.q(x)) / 1e-5 for e in np.eye(system.nv)]
    )
    by_x = [(gradient @ (chart.q(x + 1e-5 * e) - chart.q(x))) / 1e-5 for e in np.eye(system.nv)]
    assert np.allclose(chart.by_unknowns(x, by_rates), by_x, atol=2e-4)


@pytest.mark.parametrize("name", ["top_on_cart", "pinned_top", "swing"])
def test_jacobian_agrees_with_differences_of_the_accelerations(name):
    system = model(name)
    p, (q, v), nv = system.parameter_values(), random_state(system, 4), system.nv
    if system.m:
        assembly = assemble(system, p)
        q, v = assembly.q, assembly.v
    rhs, positions, sizes = system.kernel("rhs"), Positions(system), loop_sizes(system, with_events=False)
    state = np.concatenate([q, v])
    addresses = np.zeros(at.N_KERNELS, dtype=np.uint64)
    addresses[at.RESIDUAL_JACOBIAN] = system.kernel("residual_jacobian").precomputed_address
    work, out = np.zeros(jacobian_work_size(sizes)), np.zeros((nv, 2 * nv))
    bare = bare_loop(sizes, system.precomputed(p), addresses, np.concatenate([state, np.zeros(system.nw)]))
    status = acceleration_jacobian(bare, 0.0, bare.y, rhs(0.0, state, p), work, out)
    assert status == at.RUNNING

    def acceleration(step):
        moved = np.concatenate([positions.retract(q, step[:nv]), v + step[nv:]])
        return rhs(0.0, moved, p)[system.nq : system.nq + nv]

    h = 1e-5
    expected = np.array([(acceleration(h * e) - acceleration(-h * e)) / (2 * h) for e in np.eye(2 * nv)]).T
    assert np.abs(out - expected).max() < 1e-7 * np.abs(expected).max()


# Methods


@pytest.mark.parametrize("name", ONE_ORDER)
@pytest.mark.parametrize("which", ["top_on_cart", "swing"])
def test_every_method_has_its_order(name, which):
    system, method, t_end = model(which), METHODS[name], 0.24
    state, h = start_of(system), {1: 5e-4, 2: 4e-3, 4: 4e-3}.get(method.order, 0.02)
    expected = oracle(which, tuple(state), (t_end,))[-1]
    n = len(expected)
    errors = [np.abs(fixed_steps(system, name, h / k, t_end, state).y[:n] - expected).max() for k in (1, 2)]
    assert errors[0] < 0.1
    # The highest orders reach round-off before they can show themselves.
    assert np.log2(errors[0] / errors[1]) > method.order - 0.35 or errors[1] < 3e-11


@pytest.mark.parametrize("name", ONE_ORDER)
def test_frames_are_unit_quaternions_of_the_order_of_dense_output(name):
    system, state, t_end = model("free_body"), np.array([1.0, 0.0, 0.0, 0.0, 0.7, 1.0, -0.5]), 0.8
    times = np.linspace(0.0, t_end, 33)
    expected = oracle("free_body", tuple(state), tuple(times))
    errors = []
    for h in (0.1, 0.05):
        frames = fixed_steps(system, name, h, t_end, state, times).frames[1:]
        assert np.abs(np.linalg.norm(frames[:, :4], axis=1) - 1.0).max() < UNIT
        errors.append(np.abs(frames - expected[1:]).max())
    order = min(METHODS[name].order, METHODS[name].dense_order)
    assert np.log2(errors[0] / errors[1]) > order - 0.35 or errors[1] < 1e-11


@pytest.mark.parametrize("name", TURNING)
def test_quaternions_keep_their_length_over_long_runs(name):
    system = model("free_body")
    step = None if METHODS[name].adaptive else 0.02
    run = system.run(t_end=100.0, method=name, step=step, rtol=1e-6, atol=1e-8)
    assert run.status == "success"
    assert np.abs(np.linalg.norm(run.q, axis=1) - 1.0).max() < UNIT
    assert {check.check: check.ok for check in run.health}["quaternions"]


@pytest.mark.parametrize("name", ["dop853", "radau5"])
def test_free_body_against_verified_digits_and_its_invariants(name):
    reference, system = load_reference("free_rigid_body"), model("free_body")
    # The flips of the intermediate axis let errors grow by 1e3 or more.
    run = system.run(t_end=100.0, method=name, rtol=1e-13, atol=1e-15, at=[10.0, 100.0])
    for sample, digits in zip(run.samples, reference["reference_w_then_quaternion"].values()):
        assert np.abs(np.concatenate([sample.v, sample.q]) - numbers(digits)).max() < 2e-9
    momentum = np.einsum("tij,j,tj->ti", rotations(run.q), np.array([1.0, 2.0, 3.0]), run.v)
    assert np.abs(momentum - numbers(reference["invariants"]["L_inertial"])).max() < 1e-9
    assert np.abs(run.energy.total - run.energy.initial).max() < 1e-9


@cache
def spinning(held):
    """A ball that nothing acts upon, its centre held by constraints at times; an event marks each half turn."""
    model = Model("spinning")
    model.body("ball", mass=1.0, inertia=[0.1] * 3)
    model.joint("fly", "free", "ball")
    for c in "xyz" if held else "":
        model.constraint(f"held_{c}", f"fly_{c}")
    model.event("half_turn", when="fly_qw", then="record")
    return link.derive(model)


@pytest.mark.parametrize(
    ("name", "form"),
    [(name, "auto") for name, method in METHODS.items() if method.adaptive]
    + [(name, "ggl") for name, method in FORMS["ggl"].items() if method.adaptive]
    + [(name, "sparse") for name, method in METHODS.items() if method.adaptive and method.sparse is not None],
)
@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_a_body_that_spins_evenly_is_seen_at_every_time(name, form, rtol, monkeypatch):
    """Rates and rotation vectors are straight lines then, which let `taylor` and `radau*` take steps of many turns."""
    if form == "sparse":
        monkeypatch.setattr(large_models, "SMALLEST_SPARSE", 1)
        monkeypatch.setattr(large_models, "MOST_FULL", 1.0)
        assert large_models.suited_to_size(METHODS[name], spinning(False)) is METHODS[name].sparse
    constraints = "ggl" if form == "ggl" else "auto"
    rates = {"fly_wx": 1.0, "fly_wy": -2.0, "fly_wz": 0.5}
    run = spinning(form == "ggl").run(
        t_end=27.5, method=name, constraints=constraints, rtol=rtol, atol=1e-2 * rtol, rate=rates
    )
    spin = np.array(list(rates.values()))
    fast = np.linalg.norm(spin)
    half = 0.5 * fast * run.t
    exact = np.column_stack([np.cos(half), np.sin(half)[:, None] * spin / fast])
    first = run.system.quaternions[0]
    assert run.ok
    # Between the stages of radau* errors have the order of the estimate.
    assert np.abs(run.q[:, first : first + 4] - exact).max() < 100.0 * rtol ** (
        0.6 if "radau" in name else 1.0
    )
    times = np.arange(1.0, fast * 27.5 / np.pi, 2.0) * np.pi / fast
    np.testing.assert_allclose([event.t for event in run.events], times, atol=300.0 * rtol**0.6)


@pytest.mark.parametrize("which", ["heavy_top", "pinned_top"])
@pytest.mark.parametrize(("name", "limit"), [("dop853", 1e-9), ("radau5", 1e-8)])
def test_heavy_top_against_verified_digits(which, name, limit):
    digits = load_reference("heavy_top")["reference_w_then_quaternion"]["fast"]
    run = model(which).run(t_end=1.0, method=name, rtol=1e-11, atol=1e-13, at=[0.2, 1.0])
    for sample, key in zip(run.samples, ("0.2", "1")):
        got = np.concatenate([sample.v[-3:], sample.q[-4:]])
        assert np.abs(got - numbers(digits[key])).max() < limit * 150.0
    assert run.ok
    assert run.constraint_residual.max_position < 1e-14


def test_multipliers_are_the_forces_of_the_pin():
    run = model("pinned_top").run(t_end=0.1, rtol=1e-11, atol=1e-13)
    w, turn = run.v[:, 3:], rotations(run.q[:, 3:])
    spin = run.accelerations[:, 3:]
    a = np.einsum("tij,tj->ti", turn, np.cross(spin, ARM) + np.cross(w, np.cross(w, ARM)))
    force = 15.0 * (a + np.array([0.0, 0.0, 9.81]))
    assert np.abs(run.multipliers - force).max() < 1e-8 * np.abs(force).max()


def test_constrained_quaternion_moves_as_the_planar_pendulum_does():
    run = model("swing").run(t_end=2.0, rtol=1e-11, atol=1e-13)
    inertia = 0.234375 + 15.0
    planar = solve_ivp(
        lambda t, y: [y[1], -15.0 * 9.81 * np.cos(y[0]) / inertia], (0.0, 2.0), [0.0, 1.0], "DOP853", run.t,
        rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    arm = rotations(run.q) @ ARM
    assert np.abs(arm - np.column_stack([0.0 * run.t, np.cos(planar.y[0]), np.sin(planar.y[0])])).max() < 1e-8
    assert np.allclose(run["top_wy"], 20.0, rtol=1e-9)


def test_dependent_constraints_path_is_the_same_with_quaternions():
    text = module_text("pinned_top")
    # The pivot ratio: below what is trusted.
    doubtful = text.replace("    out[16] = 1.0", "    out[16] = 0.0")
    assert doubtful != text
    sound, robust = (load(t).run(t_end=0.05, rtol=1e-10) for t in (text, doubtful))
    for name in ("q", "v", "multipliers"):
        a, b = getattr(sound, name)[-1], getattr(robust, name)[-1]
        assert np.abs(a - b).max() < 1e-8 * max(1.0, np.abs(a).max())
    system = load(doubtful)
    q, v = random_state(system, 5)
    p, out = system.parameter_values(), np.zeros(system.nq + system.nv + 6)
    near = np.concatenate([rotations(q[3:]) @ ARM + 0.01, q[3:], v])
    address, _keep = robust_project_address(system)
    call_kernel(address, 0.0, near, system.precomputed(p), out)
    assert np.abs(np.linalg.norm(out[3:7]) - 1.0) < UNIT
    expected = near
    for _ in range(6):  # the robust path goes all the way, and then turns to the velocities
        expected = system.kernel("project")(0.0, np.append(expected[:7], v), p)
    assert np.allclose(out[:13], expected[:13], atol=1e-12)
    residual = system.kernel("constraint_residual")
    assert np.allclose(out[13:16], residual(0.0, near, p)[:3], atol=1e-14)
    assert np.allclose(out[16:], residual(0.0, np.append(out[:7], v), p)[3:], atol=1e-12)


def test_methods_that_need_plain_rates_are_refused_by_name_with_a_remedy():
    for name in sorted(METHODS.keys() - set(TURNING)):
        with pytest.raises(RuntimeModelError, match=rf"{name}.*quaternions.*use gauss8"):
            model("heavy_top").run(t_end=0.1, method=name)


# Starts


def test_assembly_turns_quaternions_that_are_guesses():
    system = model("pinned_top")
    p = system.parameter_values()
    found = assemble(system, p, {"x": 0.6, "y": 0.1}, {"top_wy": 10.0})
    assert np.allclose(rotations(found.q[3:]) @ ARM, found.q[:3], atol=1e-14)
    assert (found.q[0], found.q[1], found.v[4]) == (0.6, 0.1, 10.0)
    assert abs(np.linalg.norm(found.q[3:]) - 1.0) < UNIT
    residual = system.kernel("constraint_residual")(0.0, np.concatenate([found.q, found.v]), p)
    assert np.abs(residual).max() < 1e-12
    assert {"top_qx", "top_vy", "top_wx"} <= {name for name, _, _ in found.moved}


def test_assembly_finds_the_nearest_orientation():
    """Of all turns that bring the arm to a direction the shortest: the one about their common normal."""
    system = model("pinned_top")
    target = np.array([np.sin(0.4), np.cos(0.4), 0.0])
    found = assemble(system, system.parameter_values(), dict(zip("xyz", target)))
    turned = Rotation.from_matrix(rotations(found.q[3:])).as_rotvec()
    assert np.allclose(turned, [0.0, 0.0, -0.4], atol=1e-9)


def test_a_quaternion_is_enforced_as_a_whole_and_scaled():
    system = model("pinned_top")
    p = system.parameter_values()
    found = assemble(system, p, {"top_qw": 0.9, "top_qx": 0.5})
    expected = np.array([0.9, 0.5, 0.0, 0.0]) / np.hypot(0.9, 0.5)
    assert np.allclose(found.q[3:], expected, atol=1e-15)
    assert np.allclose(found.q[:3], rotations(expected) @ ARM, atol=1e-12)
    assert any("top_qw" in note and "1.0295" in note for note in found.notes)
    with pytest.raises(AssemblyError, match=r"pin_x.*top_qw.*off by"):
        assemble(system, p, {"x": 1.0, "top_qw": 0.5})
    with pytest.raises(AssemblyError, match="no orientation"):
        assemble(system, p, {"top_qw": 0.0})


def test_starts_without_constraints_are_scaled_and_notes_reach_the_user():
    run = model("heavy_top").run(t_end=0.01, start={"top_qw": 2.0})
    assert np.allclose(run.q[0], [1.0, 0.0, 0.0, 0.0], atol=0.0)
    assert any("length 2" in note for note in run.notes)
    assert not model("heavy_top").run(t_end=0.01, start={"top_qw": 1.0}).notes[1:]


def test_rates_are_set_and_read_by_their_names():
    system = model("pinned_top")
    run = system.run(t_end=0.01, rate={"dot(y)": 0.0, "top_wy": 3.0})
    assert run["top_wy"][0] == 3.0
    assert np.array_equal(run["dot(x)"], run["top_vx"])
    assert np.array_equal(run["dot(top_wx)"], run.accelerations[:, 3])
    assert set(result(run)["rates"]) == {"top_vx", "top_vy", "top_vz", "top_wx", "top_wy", "top_wz"}
    with pytest.raises(UnknownNameError, match="top_wz"):
        system.run(t_end=0.01, rate={"top_wq": 1.0})


def test_command_line_names_coordinates_and_rates():
    import click

    from symgen.cli.quantities import start_values

    system = model("pinned_top")
    assert start_values(system, "--start", [("top_qw", "0.5")]) == {"top_qw": 0.5}
    given = [("top_wx", "1"), ("dot(x)", "2"), ("y", "3")]
    assert start_values(system, "--rate", given) == {"top_wx": 1.0, "x": 2.0, "y": 3.0}
    with pytest.raises(click.UsageError, match="angular velocity top_wx, top_wy, top_wz"):
        start_values(system, "--rate", [("top_qw", "1")])
    with pytest.raises(click.UsageError, match="'top_wx' is a rate: use --rate"):
        start_values(system, "--start", [("top_wx", "1")])


# Events, checks, recordings


def test_events_and_resets_of_a_turning_body():
    """Steady spin, qw = cos(angle / 2); the reset writes a quaternion of length 2 and adds to the spin."""
    spin = 1.5
    run = model("kicked_body").run(
        t_end=3.0, rate={"body_wx": 0.0, "body_wy": spin, "body_wz": 0.0}, rtol=1e-12, atol=1e-14
    )
    kick, half = run.events
    t_kick = 2.0 * np.pi / 3.0 / spin
    assert (kick.name, half.name) == ("kick", "half_turn")
    assert abs(kick.t - t_kick) < 1e-11
    assert abs(half.t - (t_kick + np.pi / 3.0 / (spin + 1.0))) < 1e-11
    assert abs(np.linalg.norm(kick.q_after) - 1.0) < UNIT
    assert kick.energy_change == pytest.approx((spin + 1.0) ** 2 - spin**2, rel=1e-9)
    assert run.energy.max_error < 1e-10


def test_time_scales_are_those_of_turns_not_of_quaternion_components():
    system, spin = model("free_body"), 7.0
    scales = time_scales(
        system, system.parameter_values(), 0.0, np.array([0.6, 0.0, 0.8, 0.0]), np.array([0.0, 0.0, spin])
    )
    # Attitude: spin; wobble: spin * sqrt((I3 - I1)(I3 - I2) / (I1 I2)), here the same.
    assert scales.fastest == pytest.approx(spin, rel=1e-4)
    assert scales.motion == pytest.approx(spin, rel=1e-4)


def test_a_place_far_off_is_as_slow_as_its_direction_changes():
    system = load(module_for(find("satellite")).text)
    orbit = np.sqrt(3.986004e14 / 6.878e6**3)  # 1/s
    scales = time_scales(system, system.parameter_values(), 0.0, *system.initial_state()[:2])
    assert scales.motion < 5.0 * orbit
    run = system.run(method="gauss8", t_end=5700.0)
    finer = system.run(method="gauss8", t_end=5700.0, step=0.25 * run.step)
    assert run.step > 1.0
    assert np.abs(run.q[-1] - finer.q[-1]).max() < 1e-4  # of 1.4e7 m


def test_overflow_of_a_body_without_constraints_has_its_true_reason():
    system = load(module_for(find("satellite")).text)
    run = system.run(method="rk4", step=200.0, t_end=11400.0)
    assert run.status == "failed"
    assert "became infinite" in run.message
    assert "--step" in run.message


def test_advice_and_convergence_study_take_quaternions():
    system = model("top_on_cart")
    arguments = {"t_end": 0.5, "method": "auto", "rtol": 1e-8, "atol": 1e-10}
    advice = advise(system, RunOptions(**arguments))
    assert not METHODS[advice.method].stiff
    assert {"verlet", "rk4", "implicit_midpoint"} <= {entry.method for entry in advice.fixed_steps}
    table = study(system, RunOptions(**{**arguments, "method": "implicit_midpoint", "step": 2e-3}))
    assert table.ok
    assert table.levels[1].order == pytest.approx(2.0, abs=0.1)


def test_health_objects_to_quaternions_that_are_not_of_unit_length():
    run = model("heavy_top").run(t_end=0.01)
    stretched = replace(run, q=run.q * (1.0 + 1e-9))
    check = {entry.check: entry for entry in stretched.health}["quaternions"]
    assert not check.ok
    assert "top_qw" in check.says


@pytest.mark.parametrize("name", ["heavy_top", "pinned_top", "top_on_cart"])
def test_recording_round_trip_and_verification(name, tmp_path):
    path, made = tmp_path / "run.rrd", []

    def recorder(**settings):
        made.append(RunRecorder(path, module_text=module_text(name), model_text="", **settings))
        return made[0]

    run = model(name).run(t_end=0.2, rtol=1e-10, recorder=recorder)
    made[0].finish(run.status, [check.to_dict() for check in run.health], run.stats)
    recording = read_recording(path)
    assert np.array_equal(recording.q, run.q)
    assert np.array_equal(recording.v, run.v)
    report = verify(path)
    assert report.ok, report.to_dict()
    assert "quaternions" in {check.name for check in report.checks}


def test_a_run_goes_on_from_a_state_of_another():
    system = model("top_on_cart")
    whole = system.run(t_end=0.4, method="rk4", step=0.01, at=[0.2])
    half = whole.samples[0]
    names = [[record["name"] for record in records] for records in (system.coordinates, system.rates)]
    start, rate = (dict(zip(names[i], values.tolist())) for i, values in enumerate((half.q, half.v)))
    rest = system.run(t_start=0.2, t_end=0.4, method="rk4", step=0.01, start=start, rate=rate)
    assert np.allclose(rest.q[-1], whole.q[-1], rtol=0.0, atol=1e-14)
    assert np.array_equal(rest.q[0], half.q)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("'quaternions': [3]", "'quaternions': [4]", "ascending indices"),
        ("'quaternions': [3]", "'quaternions': []", "nq - nv is 1"),
        ("'quaternions': [3]", "'quaternions': [3.0]", "a list of indices"),
        ("def kinematics", "def kinematic", "'kinematics' is missing"),
        ("def project", "def projects", "'project' is missing"),
    ],
)
def test_modules_whose_quaternions_do_not_fit_are_refused(old, new, says):
    text = module_text("pinned_top")
    assert old in text
    with pytest.raises(ModuleError, match=says):
        load(text.replace(old, new, 1))


def test_energy_balance_counts_friction():
    run = model("top_on_cart").run(t_end=1.0, rtol=1e-10, method="radau5")
    power = -5.0 * run["dot(s)"] ** 2
    assert run.energy.max_error < 1e-8
    assert np.abs(np.gradient(run.w, run.t)[2:-2] - power[2:-2]).max() < 1e-3 * np.abs(power).max()
    assert evaluate(run.system, "energy", run.p, run.t, run.states).shape == (len(run.t), 2)


@pytest.mark.parametrize("name", ["free_rigid_body", "four_bar", "double_pendulum"])
def test_time_scales_at_several_states_are_those_at_each(name):
    system = load(module_for(Path(find(name)), {}).text)
    run = system.run(1.0, method="dop853")
    rows = [0, 50, len(run.t) - 1]
    together = time_scales_at(system, run.p, run.t[rows], run.q[rows], run.v[rows])
    for i, scale in zip(rows, together, strict=True):
        alone = time_scales(system, run.p, run.t[i], run.q[i], run.v[i])
        np.testing.assert_allclose(scale.eigenvalues, alone.eigenvalues, rtol=1e-12, atol=1e-12)
        assert scale.motion == pytest.approx(alone.motion, rel=1e-12)
        assert scale.turning == alone.turning
