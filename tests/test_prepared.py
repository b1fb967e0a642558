"""Prepared runs: the bits of `System.run`, in machine code where it can, with a status for each row."""

from __future__ import annotations

import concurrent.futures
import copy
import pickle
import re
import threading
import time
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import symgen
from symgen.runtime import Solution
from symgen.runtime.checks import health
from symgen.runtime.constraints import plain_assembly
from symgen.runtime.errors import RunFailed, RuntimeModelError, UnknownNameError
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.prepared import layout as here

# Open and closed, with quaternions, sizes that only Python finds, inputs, events, stops, terms of time, constraints
# that follow from others, independent subsystems.
IN_MACHINE_CODE = (
    "double_pendulum",
    "slider_crank",
    "heavy_top_absolute",
    "pendulum_dae",
    "cart_pole_lqr",
    "rolling_disc",
)
IN_PYTHON = ("stick_slip", "rough_road", "bricard", "pendulum_field")
T_END = 0.03


PAGE = Path(__file__).resolve().parents[1] / "docs" / "prepared.md"


@cache
def system(name):
    return symgen.load(name)


def asked(run, p, y0):
    """What `System.run` is asked for with values of a prepared run."""
    coordinates = {record["name"] for record in run.system.coordinates}
    values = dict(zip(run.start, map(float, y0)))
    return {
        "parameters": dict(zip(run.parameters, map(float, p))),
        "start": {name: value for name, value in values.items() if name in coordinates},
        "rate": {name: value for name, value in values.items() if name not in coordinates},
        "step": run.step,
    }


def nominal(run):
    """Values that a call takes without any."""
    values = {record["name"]: record["value"] for record in (*run.system.parameters, *run.system.inputs)}
    return np.array([values[name] for name in run.parameters]), run.assemble()[: len(run.start)]


def forms_of(model):
    return ("projection", *FORMS) if system(model).m else ("auto",)


def moved(model, p, y0):
    """Another row: with other parameters, where the start stays on the constraints with any."""
    if system(model).m == 0:
        return p * 1.01, y0 + 1e-3
    return p, y0


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("model", IN_MACHINE_CODE)
def test_calls_are_runs_bit_for_bit(model, method):
    tried = 0
    for form in forms_of(model):
        try:
            run = system(model).prepare(T_END, method=method, constraints=form)
        except RuntimeModelError:
            continue  # the method does not have the form
        p, y0 = moved(model, *nominal(run))
        solution = system(model).run(T_END, method=method, constraints=form, **asked(run, p, y0))
        if solution.status != "success":
            with pytest.raises(RunFailed, match=solution.message[:20]):
                run(p, y0)
            continue
        found = run(p, y0)
        assert run.why_python == ""
        assert run._machine.rows.status[0] == here.SUCCESS, "Python made this run"
        np.testing.assert_array_equal(found, solution.states[-1])
        assert run.steps == solution.stats["steps"]
        np.testing.assert_array_equal(run(p, y0), found)  # nothing is left of the call before
        tried += 1
    if not tried:
        pytest.skip("the method does not integrate the model")


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5", "bdf", "gauss8"])
@pytest.mark.parametrize("model", IN_PYTHON)
def test_what_machine_code_cannot_make_python_makes(model, method):
    if model in ("bricard", "pendulum_field") and method == "taylor":
        method = "bs32"
    run = system(model).prepare(
        1.2, method=method, parameters=[system(model).parameters[0]["name"]], start=()
    )
    p = np.array([system(model).parameters[0]["value"]])
    solution = system(model).run(1.2, method=method, **asked(run, p, ()))
    runs = run.many(p[None])
    assert run.why_python
    assert runs.words == [solution.status]
    if runs.ok[0]:
        np.testing.assert_array_equal(run(p), solution.states[-1])
        np.testing.assert_array_equal(runs.y[0], solution.states[-1])


def test_starts_with_many_constraints_are_looked_at_by_python():
    """Rows of G have no weights beyond 4096 entries; machine code that writes them would write beyond their array."""
    large = symgen.load("chain_absolute", N=28)
    assert 4096 < large.m * large.nv < 5000
    run = large.prepare(0.05, method="dopri5", output="end")
    assert "large" in run.why_python
    np.testing.assert_array_equal(run(), large.run(0.05, method="dopri5").states[-1])


@pytest.mark.parametrize("model", ["double_pendulum", "slider_crank", "cart_pole_lqr"])
def test_states_at_times_are_frames_of_runs(model):
    times = [0.5, 0.1, "200 ms", 0.7]
    run = system(model).prepare(0.7, output=times, method="dop853")
    solution = system(model).run(0.7, t_eval=sorted([0.5, 0.1, 0.2, 0.7]), method="dop853")
    found = run()
    assert found.shape == (4, run.n_state)
    np.testing.assert_array_equal(found, solution.states[np.searchsorted(solution.t, [0.5, 0.1, 0.2, 0.7])])
    np.testing.assert_array_equal(run.many(np.tile(nominal(run)[0], (3, 1))).y, np.tile(found, (3, 1, 1)))


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5", "rk4"])
def test_events_in_machine_code(method):
    model = system("bouncing_ball")
    run = model.prepare(9.0, method=method, parameters=["e"])
    runs = run.many([[0.9], [0.99], [1.0]])
    assert run.why_python == ""
    assert set(runs.status) <= {here.ZENO, here.SUCCESS}
    assert runs.words[0] == "zeno"
    for e, y, word, t, steps in zip((0.9, 0.99, 1.0), runs.y, runs.words, runs.t, runs.steps):
        solution = model.run(9.0, method=method, parameters={"e": e}, step=run.step)
        assert (word, t, steps) == (solution.status, solution.t[-1], solution.stats["steps"])
        if word == "success":
            np.testing.assert_array_equal(y, solution.states[-1])
    assert "pile up" in runs.message(0)
    times = model.prepare(2.0, method=method, output=[0.3, 1.0, 1.7])
    solution = model.run(2.0, method=method, t_eval=[0.3, 1.0, 1.7], step=times.step)
    np.testing.assert_array_equal(times(), solution.states[1:4])


def test_whole_solutions():
    run = system("double_pendulum").prepare(1.0, output="solution", parameters=["L1"])
    solution = run([1.1])
    assert isinstance(solution, Solution)
    assert solution.ok
    again = system("double_pendulum").run(1.0, parameters={"L1": 1.1}, method=run.method)
    np.testing.assert_array_equal(solution.states, again.states)
    np.testing.assert_array_equal(solution(0.3), again(0.3))
    with pytest.raises(RuntimeModelError, match="many gives arrays"):
        run.many([[1.0]])


def test_rows_are_calls_and_threads_change_nothing():
    run = system("double_pendulum").prepare(2.0, parameters=["L1", "m2"], start=["theta1"])
    random = np.random.default_rng(4)
    P, Y0 = random.uniform(0.5, 2.0, (700, 2)), random.uniform(-2.0, 2.0, (700, 1))
    runs = run.many(P, Y0)
    assert runs.ok.all()
    assert np.all(runs.t == 2.0)
    for row in (0, 255, 256, 699):
        np.testing.assert_array_equal(runs.y[row], run(P[row], Y0[row]))
    in_threads = run.many(P, Y0, threads=3)
    np.testing.assert_array_equal(in_threads.y, runs.y)
    np.testing.assert_array_equal(in_threads.steps, runs.steps)


def test_clones_run_side_by_side():
    run = system("slider_crank").prepare(0.3)
    found, expected = {}, run()

    def call(own, k):
        found[k] = own()

    threads = [threading.Thread(target=call, args=(run.clone(), k)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4
    for state in found.values():
        np.testing.assert_array_equal(state, expected)


def test_one_prepared_run_serves_threads_one_after_another():
    run = system("double_pendulum").prepare(1.0, start=["theta1"])
    starts = np.linspace(0.5, 1.5, 40)
    expected = [run(y0=[start]) for start in starts]

    def calls(first):
        rows = [(first + 7 * k) % len(starts) for k in range(200)]
        return all(np.array_equal(run(y0=[starts[row]]), expected[row]) for row in rows)

    with concurrent.futures.ThreadPoolExecutor(4) as executor:
        assert all(executor.map(calls, range(4)))


def test_copies_are_clones_and_pickles_are_refused():
    run = system("double_pendulum").prepare(1.0, start=["theta1"])
    expected = run(y0=[1.0])
    for other in (copy.copy(run), copy.deepcopy(run)):
        other(y0=[0.2])
        assert np.array_equal(other(y0=[1.0]), expected)
    with pytest.raises(TypeError, match="prepare the run anew"):
        pickle.dumps(run)


def test_starts_are_assembled_where_they_do_not_fit():
    model = system("slider_crank")
    run = model.prepare(0.2, start=["theta"], method="dop853")
    for theta in (0.5, 1.7):
        solution = model.run(0.2, start={"theta": theta}, method="dop853")
        np.testing.assert_array_equal(run(y0=[theta]), solution.states[-1])
    start = run.assemble([1.7])
    assert start[0] == 1.7
    np.testing.assert_array_equal(start, solution.states[0])
    whole = model.prepare(0.2, method="dop853")
    assert whole.consistent(start)
    assert not whole.consistent(start + 1e-6)
    off = start.copy()
    off[1] += 0.3
    runs = whole.many(None, [start, off])
    assert runs.status.tolist() == [here.SUCCESS, here.REFUSED_START]
    assert "cannot hold with the enforced values" in runs.message(1)
    with pytest.raises(RunFailed, match="cannot hold"):
        whole(None, off)


# Without units: how far its coordinates go tells their sizes, and so how fast is at rest.
SKATE = """
name = "skate"
[parameters]
J = 1.0
[coordinates]
x = { start = 3.3 }
y = { start = 100.0 }
phi = { start = 0.5, rate = 0.2 }
[energy]
kinetic = "(dot(x)^2 + dot(y)^2 + J*dot(phi)^2)/2"
[velocity_constraints]
edge = "sin(phi)*dot(x) - cos(phi)*dot(y)"
"""


@pytest.mark.parametrize(
    "model, start, parameters",
    [
        ("slider_crank", ["theta", "dot(theta)"], ["r", "l", "m"]),  # a coordinate without mass
        ("rolling_disc", ["dot(yaw)", "dot(spin)"], ["m"]),
        (SKATE, ["phi", "y", "dot(x)"], ["J"]),
    ],
    ids=("slider_crank", "rolling_disc", "skate"),
)
def test_starts_of_rows_are_assembled_at_once_to_the_bits_of_one(model, start, parameters, monkeypatch):
    model = symgen.Model.from_toml(model).derive() if model is SKATE else system(model)
    run = model.prepare(0.01, start=start, parameters=parameters, method="dop853")
    random = np.random.default_rng(3)
    p, y0 = np.array(run._nominal_p), run.nominal_start
    P = p * random.uniform(0.9, 1.1, (6, len(p)))
    Y0 = y0 + 0.1 * random.uniform(-1.0, 1.0, (6, len(y0)))
    starts = plain_assembly.assemble_plain
    made = []
    monkeypatch.setattr(
        plain_assembly, "assemble_plain", lambda *args: made.append(starts(*args)) or made[-1]
    )
    runs = run.many(P, Y0)
    assert runs.ok.all()
    ((states, done),) = made
    assert done.all()
    for state, y, row, own in zip(states, runs.y, P, Y0, strict=True):
        np.testing.assert_array_equal(state, run.assemble(own, row))
        solution = model.run(0.01, method="dop853", **asked(run, row, own))
        np.testing.assert_array_equal(y, solution.states[-1])


def test_rows_that_cannot_be_assembled_leave_the_others_as_they_are():
    run = system("slider_crank").prepare(0.01, start=["theta"], parameters=["r", "l"], method="dop853")
    P = run._nominal_p * np.ones((4, 1))
    P[1, 1] = 0.2 * P[1, 0]  # a rod that is shorter than its end is high
    P[2, 1] = np.nan
    Y0 = np.full((4, 1), 1.3)
    runs = run.many(P, Y0)
    assert runs.status.tolist() == [here.SUCCESS, here.REFUSED_START, here.NOT_FINITE_INPUT, here.SUCCESS]
    with pytest.raises(RuntimeModelError) as refused:
        run.assemble(Y0[1], P[1])
    assert runs.message(1) == str(refused.value)
    np.testing.assert_array_equal(runs.y[[0, 3]], np.tile(run(P[0], Y0[0]), (2, 1)))


def test_parameters_that_move_the_assembly_or_the_scale_of_energy():
    model = system("slider_crank")
    run = model.prepare(0.2, parameters=["r", "l", "m"], start=(), method="taylor")
    random = np.random.default_rng(1)
    P = np.array(
        [model.parameter_values()[model.place_of_parameter(name)] for name in ("r", "l", "m")]
    ) * random.uniform(0.9, 1.1, (5, 3))
    runs = run.many(P)
    assert runs.ok.all()
    for p, y in zip(P, runs.y):
        solution = model.run(0.2, parameters=dict(zip(("r", "l", "m"), p)), method="taylor")
        np.testing.assert_array_equal(y, solution.states[-1])


def test_failures_are_statuses_with_reasons():
    run = system("double_pendulum").prepare(5.0, max_steps=10, method="dop853")
    p, y0 = nominal(run)
    runs = run.many(np.array([p, p]), np.array([y0, np.zeros(4)]))
    assert runs.status.tolist() == [here.STEPS_USED_UP, here.SUCCESS]  # at rest few steps do
    assert runs.words == ["failed", "success"]
    assert "All 10 steps allowed were used up" in runs.message(0)
    assert runs.message(1) == ""
    assert np.isnan(runs.y[0]).all()
    with pytest.raises(RunFailed, match="All 10 steps allowed") as raised:
        run(p, y0)
    assert raised.value.status == "failed"
    assert run.status == "failed"
    assert "All 10" in run.message


def test_motions_that_end_are_failures_of_their_rows(tmp_path):
    model = symgen.Model("blow_up")
    x = model.coordinate("x", start=1.0, rate=0.0)
    model.parameter("k", 1.0)
    model.kinetic("dot(x)^2/2")
    model.potential("-k*x^4")
    run = model.derive().prepare(3.0, parameters=["k"], method="dop853", start=["x"])
    runs = run.many([[1.0], [-1.0], [np.nan], [-1.0]], [[1.0], [1.0], [1.0], [np.inf]])
    assert runs.status[0] < 0
    assert runs.status[1] == here.SUCCESS
    assert runs.status[2:].tolist() == [here.NOT_FINITE_INPUT] * 2
    assert runs.message(0)
    assert runs.message(2) == "p: 'k' is nan: give a finite number"
    assert runs.message(3) == "y0: 'x' is inf: give a finite number"
    assert x.name == "x"


def test_inertia_that_is_negative_is_refused():
    run = system("pendulum").prepare(1.0, parameters=["m"])
    runs = run.many([[1.0], [-1.0]])
    assert runs.status.tolist() == [here.SUCCESS, here.REFUSED_START]
    assert "[bodies.bob] mass: the mass is negative" in runs.message(1)


def test_checks_at_the_end_object_to_what_the_report_objects_to():
    model = system("double_pendulum")
    coarse = {"method": "rk4", "step": 0.15}
    assert not model.run(10.0, **coarse).ok
    run = model.prepare(10.0, checks="end", **coarse)
    with pytest.raises(RunFailed, match="energy") as raised:
        run()
    assert raised.value.status == "doubtful"
    fine = model.prepare(10.0, checks="end", method="rk4", step=0.002)
    fine()
    assert fine._machine.rows.status[0] == here.SUCCESS
    assert fine.status == "success"
    unchecked = model.prepare(10.0, **coarse)
    np.testing.assert_array_equal(unchecked(), model.run(10.0, **coarse).states[-1])


@pytest.mark.parametrize("model, t_end", [("clutch", 1.0), ("stick_slip", 2.0)])
def test_end_checks_of_what_switches_need_no_other_run(model, t_end, monkeypatch):
    """Entries that need no companion: a right run has none made; one whose energy is off is objected to in full."""
    followed = []
    whole = health.accuracy
    monkeypatch.setattr(health, "accuracy", lambda solution: followed.append(1) or whole(solution))
    run = system(model).prepare(t_end, checks="end")
    run()
    assert run.why_python and run.status == "success" and not followed
    coarse = system(model).prepare(t_end, checks="end", method="bs32", rtol=0.05)
    with pytest.raises(RunFailed, match=r"energy: the energy balance is off.*accuracy: "):
        coarse()
    assert coarse.status == "doubtful" and followed


@pytest.mark.parametrize(
    "model, options",
    [("die", {"method": "rk4", "step": 0.01}), ("die", {"method": "dop853", "rtol": 2e-4})],
)
def test_end_checks_of_coarse_steps_object_to_what_only_another_run_tells(model, options):
    """Energy, equations and stops are right, and the motion is not: impacts are at other times than they should be."""
    whole = system(model).run(1.0, **options).health
    assert [entry.check for entry in whole if not entry.ok] == ["accuracy"]
    with pytest.raises(RunFailed, match=r"accuracy: "):
        system(model).prepare(1.0, checks="end", **options)()


@pytest.mark.parametrize(
    "model", [*IN_MACHINE_CODE, "andrews_squeezer", "seven_dof_arm", "four_bar", "turntable"]
)
def test_checks_at_the_end_are_quiet_on_good_runs(model):
    run = system(model).prepare(0.03 if model == "andrews_squeezer" else 2.0, checks="end")
    run()
    assert run.status == "success"
    if run._machine is not None:
        assert run._machine.rows.status[0] == here.SUCCESS, "Python had to look"


def test_all_checks():
    model = system("double_pendulum")
    assert model.prepare(1.0, checks="full")().shape == (4,)
    with pytest.raises(RunFailed, match="energy"):
        model.prepare(10.0, checks="full", method="rk4", step=0.15)()


def test_an_event_that_ends_runs_leaves_no_state_behind_it():
    model = symgen.Model("falling")
    model.coordinate("x", start=1.0)
    model.parameter("g", 10.0)
    model.kinetic("dot(x)^2/2")
    model.potential("g*x")
    model.event("ground", when="x", direction="falling", then="terminate")
    run = model.derive().prepare(2.0, parameters=["g"], start=["x"], output=[0.1, 1.0], method="dop853")
    found = run([10.0], [1.0])
    assert run.status == "terminated"
    assert run.t == pytest.approx(np.sqrt(0.2))
    assert found[0, 0] == pytest.approx(1.0 - 0.05)
    assert np.isnan(found[1]).all()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"parameters": ["L3"]}, "has no parameter or input 'L3'"),
        ({"parameters": ["L1", "L1"]}, "named twice"),
        ({"parameters": [3]}, "is no name"),
        ({"start": ["phi"]}, "no coordinate or rate 'phi'"),
        ({"output": "all"}, "output is 'all'"),
        ({"output": []}, "names no times"),
        ({"output": [20.0]}, "outside the run"),
        ({"checks": "some"}, "no checks 'some'"),
        ({"method": "rk5"}, "rk5"),
        ({"parameters": {"L1": "1 kg"}}, "L1"),
    ],
)
def test_bad_preparations_are_refused(options, says):
    with pytest.raises(RuntimeModelError, match=says):
        system("double_pendulum").prepare(10.0, **options)


def test_bad_values_are_refused():
    run = system("double_pendulum").prepare(1.0, parameters=["L1", "L2"])
    with pytest.raises(RuntimeModelError, match=r"p has shape \(3,\), but 2 values are expected: L1, L2"):
        run([1.0, 2.0, 3.0])
    with pytest.raises(RuntimeModelError, match="y0 cannot be read as numbers"):
        run(None, ["a"] * 4)
    with pytest.raises(RuntimeModelError, match=r"P has shape \(2,\)"):
        run.many([1.0, 2.0])
    with pytest.raises(RuntimeModelError, match="P has 2 rows, but the other table has 3"):
        run.many(np.ones((2, 2)), np.ones((3, 4)))
    with pytest.raises(RuntimeModelError, match="threads is 0"):
        run.many(np.ones((2, 2)), threads=0)
    with pytest.raises(RunFailed, match="p: 'L2' is nan"):
        run([1.0, np.nan])
    with pytest.raises(UnknownNameError):
        system("double_pendulum").prepare(1.0, start=["theta3"])


def test_values_of_the_preparation_are_those_of_calls_without_any():
    run = system("double_pendulum").prepare(
        1.0, parameters={"L1": "150 cm"}, start={"theta1": 0.3, "dot(theta2)": 1.0}
    )
    solution = system("double_pendulum").run(
        1.0, parameters={"L1": 1.5}, start={"theta1": 0.3}, rate={"theta2": 1.0}, method=run.method
    )
    np.testing.assert_array_equal(run(), solution.states[-1])
    assert run.many().y.shape == (1, 4)


def test_inputs_over_time_and_constant_ones():
    model = system("cart_pole")
    table = ([0.0, 0.5, 1.0], [0.0, 2.0, -1.0])
    name = model.inputs[0]["name"]
    run = model.prepare(1.0, inputs={name: table}, method="dop853", start=[model.coordinates[0]["name"]])
    assert name not in run.parameters
    np.testing.assert_array_equal(run(), model.run(1.0, inputs={name: table}, method="dop853").states[-1])
    constant = model.prepare(1.0, inputs={name: 2.0}, method="dop853")
    assert constant.why_python == ""
    np.testing.assert_array_equal(constant(), model.run(1.0, inputs={name: 2.0}, method="dop853").states[-1])
    with pytest.raises(RuntimeModelError, match="input over time"):
        model.prepare(1.0, inputs={name: table}, parameters=[name])


def test_the_lock_of_the_interpreter_is_free_meanwhile():
    run = system("double_pendulum").prepare(200.0, parameters=["L1"], method="dop853")
    P, ticks, done = np.linspace(0.9, 1.1, 100)[:, None], [], threading.Event()

    def tick():
        while not done.wait(1e-4):
            ticks.append(time.perf_counter())

    other = threading.Thread(target=tick)
    other.start()
    began = time.perf_counter()
    runs = run.many(P)
    took = time.perf_counter() - began
    done.set()
    other.join()
    assert runs.ok.all()
    # One call of machine code: whoever holds the lock in it lets the other thread tick before and behind it only.
    assert sum(began < t < began + took for t in ticks) > 20


def test_the_page_runs():
    for program in re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL):
        exec(compile(program, "prepared.md", "exec"), {})
