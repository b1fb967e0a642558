"""What time alone does to a model: found before a run, landed on, and kept to by the steps of every method."""

from __future__ import annotations

import math

import numpy as np
import pytest
from click.testing import CliRunner
from recorded import assert_same_recording, record

from symgen import Model, runtime
from symgen.cli import main
from symgen.link import derive_text
from symgen.runtime import solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.recording.resume import Resumed
from symgen.runtime.recording.verify import verify
from symgen.runtime.timing.search import find_step_limits

MODEL = """
name = "hit"
[parameters]
a = 1000.0
tp = 5.0
w = 1e-3
b = 0.0
d = 0.02
c = 0.0
[coordinates]
x = {}
[energy]
kinetic = "dot(x)^2/2"
[forces]
x = "a*exp(-((t - tp)/w)^2) + b*(sign(t - tp) - sign(t - tp - d)) + c*abs(t - tp)"
[run]
t_end = 10.0
"""
ADAPTIVE = sorted(name for name, method in METHODS.items() if method.adaptive)
FIXED = sorted(name for name, method in METHODS.items() if not method.adaptive and method.order > 1)
BOX = {"a": 0.0, "b": 25.0}
KINK = {"a": 0.0, "c": 1.0}


@pytest.fixture(scope="module")
def text():
    return derive_text(Model.from_toml(MODEL)).text


@pytest.fixture(scope="module")
def hit(text):
    return runtime.load(text)


def at_end(p, t_end=10.0):
    """The closed form of x at the end of a run from rest."""
    rest = t_end - p["tp"]
    z = rest / p["w"]
    pulse = p["a"] * p["w"] * math.sqrt(math.pi) * (0.5 * (1.0 + math.erf(z))) * rest
    box = 2.0 * p["b"] * p["d"] * (rest - 0.5 * p["d"])
    kink = p["c"] * (p["tp"] ** 3 / 3.0 + p["tp"] ** 2 / 2.0 * rest + rest**3 / 6.0)
    return pulse + box + kink


def values(**changed):
    return {"a": 1000.0, "tp": 5.0, "w": 1e-3, "b": 0.0, "d": 0.02, "c": 0.0} | changed


def step_limits(system, t_end=10.0, **changed):
    return find_step_limits(system, system.parameter_values(changed), 0.0, t_end)


@pytest.mark.parametrize("w", [1e-1, 1e-3, 1e-6, 1e-10])
def test_a_pulse_is_found_however_narrow(hit, w):
    found = step_limits(hit, t_end=1000.0, w=w, tp=777.77)
    assert np.isinf(found.longest[[0, -1]]).all() and (found.longest[1:-1] <= 2.0 * w).all()
    assert 777.77 - 20.0 * w < found.begin[1] < 777.77 - 5.0 * w < 777.77 + 5.0 * w < found.begin[-1]


def test_jumps_are_found_to_the_last_bit(hit):
    found = step_limits(hit, **BOX, tp=math.pi)
    inside = find_step_limits(hit, hit.parameter_values({**BOX, "tp": math.pi, "d": 1e-9}), 0.0, 10.0)
    assert found.before[0] < math.pi < found.after[0]
    assert found.after[0] == np.nextafter(math.pi, 4.0) and found.before[0] == np.nextafter(math.pi, 3.0)
    assert len(found.before) == len(inside.before) == 2


@pytest.mark.parametrize("period", [0.13, 0.0314, 1.7])
@pytest.mark.parametrize(
    ("force", "switches"),
    [
        ("where(mod(t, T) < T/2, a, -a)", (0.5,)),
        ("where(mod(t, T) < T/3, a, where(mod(t, T) < 5*T/6, -a, 2*a))", (1 / 3, 5 / 6)),
        ("a*sign(t/T - floor(t/T) - 0.25)", (0.25,)),
    ],
)
def test_a_choice_may_change_where_what_it_compares_jumps_and_in_between(force, switches, period):
    """A sawtooth jumps, and crosses what it is compared with: both are found where one cell of time has both."""
    m = Model("wave")
    x = m.coordinate("x")
    m.parameters(T=period, a=2.0)
    m.body("b", mass=1, com=(x, 0))
    m.force(x, force)
    system = runtime.load(derive_text(m).text)
    found = find_step_limits(system, system.parameter_values(), 0.0, 20 * period).before
    expected = np.sort(np.add.outer(np.arange(20), (0.0, *switches)).ravel())[1:] * period
    found = found[found < 19.99 * period]
    np.testing.assert_allclose(found, expected[expected < 19.99 * period], rtol=1e-14)


def test_what_is_found_does_not_depend_on_the_end(hit):
    shorter, longer = step_limits(hit, t_end=7.3, **BOX), step_limits(hit, t_end=5000.0, **BOX)
    assert np.array_equal(shorter.before, longer.before) and np.array_equal(shorter.after, longer.after)


@pytest.mark.parametrize("changed", [{}, BOX, KINK], ids=["pulse", "box", "kink"])
@pytest.mark.parametrize("method", ADAPTIVE)
def test_adaptive_methods_step_onto_it(hit, method, changed):
    solution = solve(hit, method=method, parameters=changed)
    exact = at_end(values(**changed))
    assert solution.q[-1, 0] == pytest.approx(exact, rel=2e-5 if method.startswith("bdf") else 1e-6)
    assert "time terms" not in {entry.check for entry in solution.objections}


@pytest.mark.parametrize("method", FIXED)
def test_fixed_steps_land_on_jumps_and_say_what_they_miss(hit, method):
    box = solve(hit, method=method, parameters=BOX, step=0.3)
    assert box.q[-1, 0] == pytest.approx(at_end(values(**BOX)), rel=1e-9)
    over = solve(hit, method=method, step=0.3)
    assert "time terms" in {entry.check for entry in over.objections}
    wide = solve(hit, method=method, step=0.01, parameters={"w": 0.1, "a": 1.0})
    assert wide.q[-1, 0] == pytest.approx(at_end(values(w=0.1, a=1.0)), rel=1e-2)
    assert "time terms" not in {entry.check for entry in wide.objections}


@pytest.mark.parametrize("method", ADAPTIVE)
def test_steps_keep_to_max_step_and_land_on_breaks(hit, method):
    solution = solve(hit, method=method, parameters={"a": 0.0}, max_step=0.25, breaks=[1.3, math.pi])
    ends = solution.step_log[:, 0]
    assert solution.step_log[:, 1].max() <= 0.25 * (1.0 + 1e-12)
    assert {1.3, math.pi} <= set(ends)


def test_limits_that_make_no_sense_are_refused(hit):
    with pytest.raises(RuntimeModelError, match="steps of method 'rk4' are all alike"):
        solve(hit, method="rk4", max_step=0.1)
    with pytest.raises(RuntimeModelError, match="max_step is 0"):
        solve(hit, max_step=0.0)
    with pytest.raises(RuntimeModelError, match="cannot tell steps below"):
        solve(hit, max_step=1e-15)
    with pytest.raises(RuntimeModelError, match="breaks: nan"):
        solve(hit, breaks=[float("nan")])


@pytest.mark.parametrize("method", ["taylor", "dop853", "bdf", "gauss8"])
def test_a_run_cut_inside_goes_on_bit_for_bit(text, hit, tmp_path, method):
    settings = {"method": method, "parameters": {"b": 3.0, "c": 1.0}, "breaks": [2.5, 7.0]}
    settings |= {} if method == "gauss8" else {"max_step": 0.7}
    whole, first, rest = (tmp_path / f"{name}.rrd" for name in ("whole", "first", "rest"))
    record(whole, text, lambda **more: solve(hit, 10.0, fps=20.0, max_steps=100_000, **settings, **more))
    record(first, text, lambda **more: solve(hit, 10.0, fps=20.0, max_steps=20, **settings, **more))
    record(rest, text, Resumed(first).run)
    assert_same_recording(whole, rest)
    if method != "bdf":  # whose work is not held to the tolerance
        assert verify(whole).ok


def test_the_command_line_and_the_run_table_say_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hit.toml").write_text(MODEL + 'max_step = "0.5 s"\nbreaks = [1.5, "2 s"]\n')
    runner = CliRunner()
    done = runner.invoke(main, ["run", "hit.toml", "--no-log", "--method", "dop853", "--breaks", "3,4"])
    assert done.exit_code == 0, done.output
    assert "steps are at most" in done.output
    refused = runner.invoke(main, ["run", "hit.toml", "--no-log", "--method", "rk4", "--max-step", "1"])
    assert refused.exit_code == 2 and "set --step" in refused.output
    again = Model.from_toml(Model.from_toml(MODEL + "max_step = 0.5\nbreaks = [1.5]\n").to_toml())
    assert "breaks = [1.5]" in again.to_toml() and "max_step = 0.5" in again.to_toml()
