"""Inputs over time: values, order, energy and events of runs with tables and polynomials, and recordings of them."""

from __future__ import annotations

import math
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
from driven_models import closed_crane, crane, exact_motion, oscillator
from scipy.interpolate import CubicSpline

import symgen
from symgen import Model, dot
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs import Controller, Polynomial, Table
from symgen.runtime.inputs.drive import drive
from symgen.runtime.inputs.function import sampled
from symgen.runtime.integrate.methods import METHODS

C0, C1, C2 = 0.7, -1.3, 0.9
POLYNOMIAL = Polynomial([C0, C1, C2], t0=0.25)
WRITTEN = f"{C0} + {C1}*(t - 0.25) + {C2}*(t - 0.25)^2"
T = np.array([0.0, 0.31, 0.8, 1.07, 1.6])
X = np.array([1.0, -2.0, 0.5, 0.5, 3.0])


def options(name, step=0.02):
    return {"method": name, **({"rtol": 1e-9, "atol": 1e-11} if METHODS[name].adaptive else {"step": step})}


def fresh(system):
    """The same model, of which nothing has been asked yet."""
    return pickle.loads(pickle.dumps(system))


def driven(system, **inputs):
    return drive(system, inputs, system.parameter_values(), 0.0, 10.0)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("model", [crane, closed_crane])
def test_a_polynomial_is_as_good_as_one_in_the_equations(model, name):
    given, written = model(), model(WRITTEN)
    if METHODS[name].refusal(given) or METHODS[name].refusal(written):
        pytest.skip("the method refuses the model")
    settings = {**options(name), "t_end": 0.6}
    a = given.run(inputs={"u": POLYNOMIAL}, **settings)
    b = written.run(**settings)
    assert a.status == b.status == "success"
    # Round-off in error estimates moves adaptive steps a little, and with them the errors of dense output.
    allowed = 1e-7 if METHODS[name].adaptive else 1e-11
    for series in ("q", "v", "w"):
        assert np.abs(getattr(a, series) - getattr(b, series)).max() < allowed
    np.testing.assert_allclose(a.accelerations, b.accelerations, rtol=0.0, atol=100.0 * allowed)


@pytest.mark.parametrize("function", ["rhs", "forces", "residual", "energy"])
def test_kernels_with_a_polynomial_are_those_of_the_equations(function):
    given, written = driven(closed_crane(), u=POLYNOMIAL), closed_crane(WRITTEN)
    random, p = np.random.default_rng(5), closed_crane().parameter_values()
    for t in random.uniform(-1.0, 2.0, 20):
        y = random.normal(size=6 + (4 if function == "residual" else 0))
        expected = written.kernel(function)(t, y, p)
        np.testing.assert_allclose(given.kernel(function)(t, y, p), expected, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("kind", ["linear", "cubic", "hold"])
def test_values_of_tables(kind):
    system = driven(oscillator(), u=Table(T, X, kind))
    t = np.sort(np.concatenate([np.random.default_rng(3).uniform(-0.5, 2.2, 200), T]))
    inside = np.clip(t, T[0], T[-1])
    if kind == "hold":
        expected = X[np.clip(np.searchsorted(T, t, side="right") - 1, 0, None)]
    else:
        expected = np.interp(t, T, X) if kind == "linear" else CubicSpline(T, X)(inside)
    kernel, p = system.kernel("inputs"), system.parameter_values()
    values = [kernel(time, [0.0, 0.0], p)[0] for time in t]
    np.testing.assert_allclose(values, expected, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_short_cubic_tables(n):
    pieces = Table(T[:n], X[:n], "cubic").pieces()
    for k in range(n - 1):
        t = np.linspace(T[k], T[k + 1], 5)
        expected = CubicSpline(T[:n], X[:n])(t)
        c = pieces.coefficients[pieces.piece_at(T[k])]
        np.testing.assert_allclose(np.polyval(c[::-1], t - T[k]), expected, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("kind", ["linear", "hold"])
@pytest.mark.parametrize("name", ["rk4", "verlet", "gauss6", "implicit_midpoint", "generalized_alpha"])
def test_order_is_kept_over_breaks(name, kind):
    slopes = np.append(np.diff(X) / np.diff(T), 0.0) if kind == "linear" else np.zeros(5)
    exact = exact_motion(T, X, slopes, 2.0)
    errors = []
    for step in (0.04, 0.02):
        run = oscillator().run(inputs={"u": Table(T, X, kind)}, t_end=2.0, method=name, step=step)
        errors.append(np.abs([run.q[-1, 0], run.v[-1, 0]] - exact).max())
    assert np.log2(errors[0] / errors[1]) > METHODS[name].order - 0.5


@pytest.mark.parametrize("kind", ["linear", "hold"])
@pytest.mark.parametrize("name", ["dopri5", "dop853", "radau5", "bdf", "taylor"])
def test_tolerances_are_met_over_breaks(name, kind):
    slopes = np.append(np.diff(X) / np.diff(T), 0.0) if kind == "linear" else np.zeros(5)
    exact = exact_motion(T, X, slopes, 2.0)
    for rtol in (1e-5, 1e-9):
        run = oscillator().run(
            inputs={"u": Table(T, X, kind)}, t_end=2.0, method=name, rtol=rtol, atol=0.1 * rtol
        )
        assert np.abs([run.q[-1, 0], run.v[-1, 0]] - exact).max() < 50.0 * rtol


def test_steps_go_over_smooth_breaks_where_errors_are_estimated():
    t = np.linspace(0.0, 2.0, 401)
    table = Table(t, np.sin(3.0 * t), "cubic")
    runs = {
        name: oscillator().run(inputs={"u": table}, t_end=2.0, method=name, rtol=1e-9, atol=1e-11)
        for name in ("dop853", "taylor")
    }
    assert runs["dop853"].stats["steps"] < 100
    assert runs["taylor"].stats["steps"] >= 400
    np.testing.assert_allclose(runs["dop853"].q[-1], runs["taylor"].q[-1], rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("name", ["dop853", "taylor", "radau5"])
def test_work_of_inputs_is_counted(name):
    run = crane().run(
        inputs={"u": (T, X), "torque": Table(T, 0.1 * X, "hold")}, t_end=2.0, fps=2000, **options(name)
    )
    assert run.energy.max_error < 1e-7
    power = run["u"] * run["dot(x)"] + run["torque"] * run["dot(theta)"] - 0.2 * run["dot(x)"] ** 2
    work = np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(run.t))
    assert run.w[-1] == pytest.approx(work, rel=2e-4)  # the trapezoidal rule over jumps has order 1
    assert run.ok, run.objections


def test_accelerations_multipliers_and_outputs_see_the_inputs_of_their_time():
    run = closed_crane().run(inputs={"u": Table(T, X, "hold")}, t_end=2.0, at=[0.31, 1.0], method="dop853")
    base, first = closed_crane(), len(closed_crane().parameters)
    for i in range(0, len(run.t), 17):
        p = run.p.copy()
        p[first] = X[max(0, np.searchsorted(T, run.t[i], side="right") - 1)]
        row = base.kernel("rhs")(run.t[i], run.states[i], p)
        np.testing.assert_allclose(run.accelerations[i], row[base.nq : base.nq + base.nv], rtol=1e-12)
        np.testing.assert_allclose(run.multipliers[i], row[base.ny : base.ny + base.m], rtol=1e-12)
    outputs = oscillator().run(inputs={"u": (T, X)}, t_end=2.0, method="dop853")
    np.testing.assert_allclose(outputs["push"], outputs["u"] - 18.0 * outputs["x"], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(outputs["u"], np.interp(outputs.t, T, X), rtol=0.0, atol=1e-13)


def test_events_and_frames_do_not_mind_breaks():
    few = crane().run(inputs={"u": (T, X)}, t_end=2.0, method="dop853", rtol=1e-11, atol=1e-13)
    many = crane().run(
        inputs={"u": (np.linspace(0.0, 1.6, 641), np.interp(np.linspace(0.0, 1.6, 641), T, X))},
        t_end=2.0, method="taylor", rtol=1e-11, atol=1e-13,
    )  # fmt: skip
    assert [e.name for e in few.events] == [e.name for e in many.events] != []
    np.testing.assert_allclose([e.t for e in few.events], [e.t for e in many.events], rtol=0.0, atol=2e-3)
    exact = crane().run(inputs={"u": (T, X)}, t_end=2.0, method="taylor", rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(few.q, exact.q, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose([e.t for e in few.events], [e.t for e in exact.events], rtol=0.0, atol=1e-9)


def test_stops_that_round_off_sets_apart_are_one():
    t = 0.1 * np.arange(21)
    run = oscillator().run(
        inputs={"u": (t, np.sin(t)), }, at=[0.3, 0.7, np.nextafter(1.1, 2.0)], t_end=2.0, method="dop853"
    )  # fmt: skip
    assert run.status == "success" and len(run.samples) == 3
    assert run.step_log[:, 1].min() > 1e-9


@pytest.mark.parametrize(
    ("given", "cause"),
    [
        ({"w": (T, X)}, "has no input 'w': did you mean|has no input 'w': it has: u"),
        ({"mass": (T, X)}, "'mass' is a parameter"),
        ({"u": (T[::-1], X)}, "input 'u': times of a table must ascend, but row 2 has 1.07 s after 1.6 s"),
        ({"u": (T, X[:3])}, "5 times and 3 values"),
        ({"u": (T, X * np.nan)}, "number 1 of values is nan"),
        ({"u": ([], [])}, "without rows"),
        ({"u": Table}, "give a number, a pair"),
        ({"u": "road.csv"}, "'road.csv' is neither a number nor a quantity"),
        ({("u", "u"): Controller(lambda t, x: (x[0], x[1]))}, "given twice"),
    ],
)
def test_what_is_no_input_is_refused(given, cause):
    with pytest.raises(RuntimeModelError, match=cause):
        oscillator().run(inputs=given, t_end=1.0)


def test_a_table_of_an_unknown_kind_is_refused():
    with pytest.raises(RuntimeModelError, match="did you mean 'linear'"):
        Table(T, X, "linaer")


def test_a_recording_of_a_table_is_verified_from_itself(tmp_path, monkeypatch):
    from symgen.runtime.recording import verify as module

    run = crane().run(inputs={"u": Table(T, X, "hold"), "torque": POLYNOMIAL}, t_end=2.0, method="dop853")
    run.save(tmp_path / "run.rrd")
    report = module.verify(tmp_path / "run.rrd", intervals=30)
    assert report.ok and {check.name: check.ok for check in report.checks}["motion"]
    recording = module.read_recording(tmp_path / "run.rrd")
    other = {**recording.inputs_over_time}
    other["u"] = {
        **other["u"],
        "coefficients": [[1.1 * x for x in row] for row in other["u"]["coefficients"]],
    }
    monkeypatch.setattr(module, "read_recording", lambda path: replace(recording, inputs_over_time=other))
    assert "motion" in module.verify(tmp_path / "run.rrd", intervals=30).summary
    broken = {"u": {"knots": [1.0, 0.0], "coefficients": [[1.0], [2.0]]}}
    monkeypatch.setattr(module, "read_recording", lambda path: replace(recording, inputs_over_time=broken))
    assert "failed: inputs" in module.verify(tmp_path / "run.rrd").summary


@pytest.mark.parametrize(
    "method, step", [("taylor", None), ("dop853", None), ("radau9", None), ("verlet", 1e-3)]
)
def test_a_function_of_time_is_taken_as_pieces(method, step):
    """A mass that is pushed by F0 sin(w t) from rest: m x = F0 (t/w - sin(w t)/w²)."""
    m = Model("pushed")
    x, push = m.coordinate("x"), m.input("push")
    m.kinetic(2.0 * dot(x) ** 2 / 2)
    m.force(x, push)
    run = m.derive().run(3.0, inputs={"push": lambda t: 5.0 * math.sin(3.0 * t)}, method=method, step=step)
    expected = 5.0 / 2.0 * (run.t / 3.0 - np.sin(3.0 * run.t) / 9.0)
    np.testing.assert_allclose(run["x"], expected, atol=1e-7 if step is None else 1e-5)
    np.testing.assert_allclose(run["push"], 5.0 * np.sin(3.0 * run.t), atol=1e-9)
    (note,) = [text for text in run.notes if text.startswith("input push")]
    assert float(re.search(r"off by (\S+) at most", note).group(1)) < 1e-9 and "jumps" not in note
    assert run.ok


@pytest.mark.parametrize(
    "function",
    [
        lambda t: math.exp(-(((t - 3.0) / 0.05) ** 2)), lambda t: math.sin(100.0 * t), lambda t: 0.0, lambda t: 7,
        lambda t: np.float64(t) ** 3 - t, lambda t: abs(t - 1.1), lambda t: math.sqrt(max(t, 0.0)),
    ],
)  # fmt: skip
def test_pieces_of_functions_are_as_good_as_they_say(function):
    pieces, off, _ = sampled(function, 0.0, 4.7)
    for t in np.random.default_rng(0).uniform(0.0, 4.7, 500):
        k = pieces.piece_at(t)
        found = np.polynomial.polynomial.polyval(t - pieces.knots[k], pieces.coefficients[k])
        assert found == pytest.approx(function(t), abs=max(2.0 * off, 1e-9))
    assert not pieces.jumps().any()
    longer, *_ = sampled(function, 0.0, 5.9)
    shared = [k for k, knot in enumerate(pieces.knots[:-2]) if knot in longer.knots]
    assert len(shared) >= len(pieces.knots) - 3 or len(pieces.knots) < 4


def test_a_function_that_jumps_is_said_to():
    _, off, when = sampled(lambda t: 5.0 if t > 1.1 else 0.0, 0.0, 2.0)
    assert off > 1.0 and when == pytest.approx(1.1, abs=1e-8)
    system = symgen.load("cart_pole")
    run = system.run(2.0, inputs={"F": lambda t: 5.0 if t > 1.1 else 0.0}, method="dop853")
    held = system.run(2.0, inputs={"F": Table([0.0, 1.1], [0.0, 5.0], kind="hold")}, method="dop853")
    assert any("near t = 1.1 s, where it jumps or bends" in note for note in run.notes)
    np.testing.assert_allclose(run.q[-1], held.q[-1], atol=1e-7)


@pytest.mark.parametrize(
    "function, says",
    [
        (lambda t: 1.0 / (t - 1.0), "fails at t = 1 s: ZeroDivisionError"),
        (lambda t: float("nan"), "gives nan at t = 0 s"),
        (lambda: 3.0, "fails at t = 0 s: TypeError"),
        (lambda t: math.sin(1e6 * t), "needs more than 20000 pieces"),
    ],
)
def test_functions_that_cannot_be_taken(function, says):
    with pytest.raises(RuntimeModelError, match=re.escape("input 'F': ") + ".*" + re.escape(says)):
        symgen.load("cart_pole").run(2.0, inputs={"F": function})


def pushed():
    m = Model("pushed")
    m.coordinate("x")
    m.input("F")
    m.kinetic("dot(x)^2/2")
    m.force("x", "F")
    return m.derive()


@pytest.mark.parametrize("name", ["dopri5", "radau5", "implicit_midpoint", "taylor"])
@pytest.mark.parametrize("steep", [1e-3, 1e-9, 1e-12])
def test_a_steep_ramp_hides_no_kinks_of_the_rest(name, steep):
    """A table that jumps within a moment, as users write it, and has pulses elsewhere."""
    t = np.array([0.0, 0.5, 0.5 + steep, 1.0, 1.9, 1.901, 1.902, 3.0])
    x = np.array([1e3, 1e3, 0.0, 0.0, 0.0, 500.0, 0.0, 0.0])
    run = pushed().run(t_end=3.0, method=name, inputs={"F": Table(t, x)})
    expected = np.trapezoid(x, t)
    if run.status == "success" and not run.objections:
        assert run["dot(x)"][-1] == pytest.approx(expected, rel=1e-5)
    assert name != "taylor" or run.status == "success"


def test_kinks_are_found_whatever_slopes_are_elsewhere():
    pieces = Table(
        [0.0, 1.0, 1.0 + 1e-12, 2.0, 3.0, 4.0, 5.0], [0.0, 0.0, 1e9, 1e9, 1e9 + 1.0, 1e9, 1e9]
    ).pieces()
    assert pieces.kinks().all()
    values = np.sin(np.linspace(0.0, 3.0, 50))
    assert (
        not Table(np.linspace(0.0, 3.0, 50), values, kind="cubic").pieces().kinks()[1:-1].any()
    )  # its ends are kinks
    line = np.linspace(0.1, 77.7, 1001)
    assert not Table(line, 3.3 * line - 100.0).pieces().kinks()[1:-1].any()


@pytest.mark.parametrize("kind", ["hold", "linear"])
def test_what_is_too_short_to_be_told_apart_is_refused(kind):
    """It was left out, and nothing said so."""
    width = 1.0 + 1e-14 - 1.0
    pulse = Table([0.0, 1.0, 1.0 + 1e-14, 2.0], [0.0, 1.0 / width, 0.0, 0.0], kind=kind)
    ramp = [0.0, 1.0, 1.0 + 1e-14, 2.0], [0.0, 0.0, 5.0, 5.0]  # a jump that counts for nothing by itself
    if kind == "hold":
        with pytest.raises(
            RuntimeModelError, match=r"input 'F': what it does at t = 1 s lasts 1e-14 s, .* spread it"
        ):
            pushed().run(t_end=3.0, inputs={"F": pulse})
    else:
        run = pushed().run(t_end=3.0, inputs={"F": ramp})
        assert run["dot(x)"][-1] == pytest.approx(10.0, rel=1e-9)


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
def test_numbers_without_a_square_are_named_where_a_run_fails(method):
    model = Model("pushed")
    model.coordinate("x", start=1.0)
    model.parameters(k=1)
    model.kinetic("dot(x)^2/2")
    model.potential("k*x^2/2")
    model.force("x", model.input("u"))
    system = model.derive()
    pushed = system.run(2.0, method=method, inputs={"u": Polynomial([0.0, 1e308])})
    stiff = system.run(2.0, method=method, parameters={"k": 1e308})
    assert "input 'u' is as large as 1e+308" in pushed.message
    assert "parameter 'k' is as large as 1e+308" in stiff.message


@pytest.mark.parametrize("name", ["taylor", "dop853", "radau5", "rk4"])
@pytest.mark.parametrize("model", [crane, closed_crane])
def test_what_runs_before_have_left_changes_no_bit(model, name):
    """Code and arrays of a driven model serve the next run with the same inputs."""
    used = fresh(model())
    for kind in ("linear", "cubic", "hold"):
        settings = {"inputs": {"u": Table(T, X, kind=kind)}, **options(name)}
        whole = fresh(model()).run(2.0, **settings)
        used.run(2.0)
        used.run(1.0, **settings)
        for run in (used.run(2.0, **settings), used.run(2.0, **settings)):
            assert run.states.tobytes() == whole.states.tobytes()
            assert run.step_log.tobytes() == whole.step_log.tobytes()
            assert run.energy.total.tobytes() == whole.energy.total.tobytes()
            assert run.notes == whole.notes


def test_one_system_serves_all_runs_of_the_same_inputs():
    system = crane()
    table = Table(T, X)
    first = driven(system, u=table)
    assert driven(system, u=Table(T.copy(), X.copy())) is first
    assert driven(system, u=Table(T, X, kind="cubic")) is not first
    assert driven(system, u=Table(T, 2.0 * X)) is not first
    said = Controller(lambda t, x: 0.0, period=0.1)
    assert driven(system, u=said) is not driven(system, u=said)


def test_driven_systems_are_kept_within_bounds():
    system = fresh(crane())
    for k in range(30):
        driven(system, u=Table(T, X + k))
    assert len(vars(system)["_driven"]) < 10
    last = driven(system, u=Table(T, X + 29))
    assert driven(system, u=Table(T, X + 29)) is last
    long = Table(np.arange(200_000.0), np.arange(200_000.0) ** 2)
    assert driven(system, u=long) is not driven(system, u=long)


def test_what_was_found_of_constant_inputs_does_not_hold_for_others():
    """Methods, sizes and limits of steps are asked for anew, whichever run came first."""
    system = fresh(closed_crane())
    assert system.run(1.0).health
    found = set(vars(system)) - system._of_model - {"_compiled_setup", "_values_of_runs"}
    assert found
    assert not found & set(vars(driven(system, u=Table(T, X))))
