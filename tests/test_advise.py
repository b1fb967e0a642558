"""Advice: the course's figures, limits of stability, what a motion belongs to, the user's own choice, recordings."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from symgen import Model, dot
from symgen.cli import main
from symgen.runtime import RunOptions
from symgen.runtime.checks.advice import advise, whole_step
from symgen.runtime.checks.mode_origin import fastest_origin
from symgen.runtime.checks.stability import stable_radius, stable_step
from symgen.runtime.integrate.methods import METHODS
from tests.trust.models import bundled

ARGUMENTS = {"t_end": 5.0, "method": "auto", "rtol": 1e-8, "atol": 1e-10}


def oscillator(omega: float, damping: float = 0.0):
    """x'' = -omega^2 x - 2 damping omega x'."""
    model = Model("oscillator")
    x = model.coordinate("x", start=0.1)
    k, m, c = model.parameters(k=omega**2, m=1.0, c=2.0 * damping * omega)
    model.kinetic(m * dot(x) ** 2 / 2)
    model.potential(k * x**2 / 2)
    if damping:
        model.dissipation(c * dot(x) ** 2 / 2)
    return model.derive()


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def symgen(*arguments: str):
    return CliRunner().invoke(main, list(arguments))


def test_a_period_of_1_42_s_at_50_steps():
    advice = advise(oscillator(2.0 * np.pi / 1.42), RunOptions(**ARGUMENTS))
    assert advice.rule_step == pytest.approx(0.0284, rel=1e-6)
    verlet = next(entry for entry in advice.fixed_steps if entry.method == "verlet")
    assert verlet.step == 0.02841 and verlet.cost.steps == 176
    limits = {limit.method: limit for limit in advice.limits}
    for method in ("verlet", "semi_implicit_euler"):
        assert limits[method].undamped == pytest.approx(1.42 / np.pi, rel=1e-6)  # 2 / omega = 0.45 s
    assert limits["euler"].undamped == 0.0
    assert any("a step of 0.0284 s: 176 steps of 0.02841 s for 5 s" in line for line in advice.lines())


@pytest.mark.parametrize(
    ("rate", "t_end", "n"),
    [(2.0 * np.pi / 1.42, 5.0, None), (4.0 * np.pi, 2.0, 100), (3.0, 7.3, 37), (50.0, 0.03, None)],
)
def test_advised_steps_are_as_many_as_the_run_takes(rate, t_end, n):
    system = oscillator(rate)
    entries = advise(system, RunOptions(**{**ARGUMENTS, "t_end": t_end}), steps_per_period=n).fixed_steps
    for entry in entries:
        run = system.run(t_end=t_end, method=entry.method, step=float(f"{entry.step:.10g}"))
        assert run.stats["steps"] == entry.cost.steps, entry


def test_whole_steps_are_whole_and_short_numbers():
    random = np.random.default_rng(2)
    for span, asked in zip(10.0 ** random.uniform(-3, 4, 2000), 10.0 ** random.uniform(-0.5, 5.5, 2000)):
        step = whole_step(span, span / asked)
        n = math.ceil(span / step)
        assert n == max(1, round(asked) if asked >= 100 else math.ceil(asked))
        assert n * step >= span * (1 - 1e-15)
        digits = repr(step).partition("e")[0].replace(".", "").strip("0")
        assert len(digits) <= max(4, len(str(n)) + 1), (span, asked, step)


@pytest.mark.parametrize(
    ("span", "step"),
    [
        (1.0, 1e-310),
        (1.0, 1e-200),
        (1e9, 1e-9),
        (1e-300, 1e-302),
        (1e300, 1e-300),
        (1e308, 3e305),
        (5e-324, 1.0),
    ],
)
def test_whole_steps_of_any_size(span, step):
    """A forged recording had rates that no number of steps fits."""
    assert 0.0 < whole_step(span, step) <= max(step * 1.01, span * 1.01) < np.inf


@pytest.mark.parametrize(
    ("rate", "asked", "rule", "limit"),
    [
        ("100", ("--steps-per-period", "50", "--t-end", "5"), "3979 steps of 0.0012566 s for 5 s", "0.02 s"),
        ("4.4294 rad/s", ("--t-end", "5"), "a step of 0.0284 s: 176 steps of 0.02841 s for 5 s", "0.452 s"),
        ("2 Hz", ("--steps-per-period", "100", "--t-end", "2"), "400 steps of 0.005 s for 2 s", "0.159 s"),
    ],
)
def test_a_frequency_needs_no_model(rate, asked, rule, limit):
    result = symgen("advise", "--frequency", rate, *asked)
    assert result.exit_code == 0 and rule in result.output, result.output
    assert f"    verlet: {limit}, {limit}\n" in result.output and "evaluation" not in result.output


def test_a_frequency_and_a_choice():
    choice = "advise", "--frequency", "100", "--t-end", "1", "--method", "central_difference", "--step"
    assert symgen(*choice, "0.001").exit_code == 0
    bad = symgen(*choice, "0.021")
    assert bad.exit_code == 3 and "not suited" in bad.output
    for wrong in (["pendulum"], ["--set", "m=1"], ["--at", "a.rrd@1"]):
        assert symgen("advise", "--frequency", "100", "--t-end", "1", *wrong).exit_code == 2
    for rate in ("16 N", "-3", "fast"):
        assert symgen("advise", "--frequency", rate, "--t-end", "1").exit_code == 2


@pytest.mark.parametrize("constraints", ["projection", "baumgarte"])
def test_central_difference_is_verlet(constraints):
    system = bundled("pendulum_dae" if constraints == "baumgarte" else "pendulum")
    asked = {
        "t_end": 1.0,
        "step": 0.01,
        "constraints": "auto" if constraints == "projection" else constraints,
    }
    run, same = (system.run(method=name, **asked) for name in ("central_difference", "verlet"))
    assert run.method == "verlet" and "method central_difference: the same as verlet" in run.notes
    np.testing.assert_array_equal(run.q, same.q)


def test_verlet_is_central_differences():
    """q' = 2 q - q_before + h² a(q), with q_before = q - h v + h² a / 2 at the start; v = (q' - q_before) / (2 h)."""
    h, q, v = 0.05, 1.2, 0.4
    run = bundled("pendulum").run(
        method="central_difference",
        step=h,
        t_end=2.0,
        start={"theta": q},
        rate={"theta": v},
        t_eval=h * np.arange(41),
    )
    a = lambda q: -9.81 / 0.5 * np.sin(q)  # noqa: E731
    before = q - h * v + h**2 / 2 * a(q)
    for k in range(41):
        after = 2 * q - before + h**2 * a(q)
        assert run.q[k, 0] == pytest.approx(q, abs=1e-13)
        assert run.v[k, 0] == pytest.approx((after - before) / (2 * h), abs=1e-12)
        before, q = q, after


def test_100_radians_per_second_allow_0_02_s():
    limits = {
        limit.method: limit
        for limit in advise(oscillator(100.0), RunOptions(**{**ARGUMENTS, "t_end": 0.5})).limits
    }
    assert limits["verlet"].undamped == pytest.approx(0.02, rel=1e-5)


def test_a_period_of_half_a_second_at_100_steps():
    advice = advise(oscillator(4.0 * np.pi), RunOptions(**{**ARGUMENTS, "t_end": 2.0}), steps_per_period=100)
    assert advice.rule_step == pytest.approx(0.005, rel=1e-6)
    assert {entry.cost.steps for entry in advice.fixed_steps if not METHODS[entry.method].stiff} == {400}


def _one_step(method: str, z: float, damping: float) -> np.ndarray:
    """Step x'' = -x - 2 d x' once, by how each method is defined in the textbooks."""
    a = np.array([[0.0, 1.0], [-1.0, -2.0 * damping]])
    if method == "semi_implicit_euler":
        kick = np.eye(2) + z * np.array([[0.0, 0.0], a[1]])
        return (np.eye(2) + z * np.array([[0.0, 1.0], [0.0, 0.0]])) @ kick
    if method == "euler":
        return np.eye(2) + z * a
    k1 = a
    k2 = a @ (np.eye(2) + z / 2 * k1)
    k3 = a @ (np.eye(2) + z / 2 * k2)
    k4 = a @ (np.eye(2) + z * k3)
    return np.eye(2) + z / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.5, 0.9])
@pytest.mark.parametrize("method", ["euler", "semi_implicit_euler", "rk4"])
def test_limits_are_where_a_step_begins_to_grow(method, damping):
    radius = stable_radius(METHODS[method], damping)
    grows = lambda z: np.abs(np.linalg.eigvals(_one_step(method, z, damping))).max()  # noqa: E731
    if method == "euler":
        assert radius == pytest.approx(2.0 * damping, abs=1e-3)
        assert grows(1.01 * radius + 1e-2) > 1.0
        return
    assert grows(0.999 * radius) <= 1.0 + 1e-9 < grows(1.001 * radius)


def test_published_limits():
    assert stable_radius(METHODS["rk4"]) == pytest.approx(2.0 * np.sqrt(2.0), rel=1e-6)
    assert stable_radius(METHODS["rk4"], 1.0) == pytest.approx(2.785293563, rel=1e-6)  # Hairer, Wanner, IV.2
    assert stable_radius(METHODS["dopri5"], 1.0) == pytest.approx(3.3066, abs=1e-3)
    assert stable_radius(METHODS["verlet"]) == pytest.approx(2.0, rel=1e-6)
    assert stable_radius(METHODS["radau5"]) is None
    # The faster of two motions need not be the one that limits the step: explicit Euler never follows an undamped one.
    assert stable_step(METHODS["euler"], np.array([-2.0, 1j, -1j])) == 0.0
    assert stable_step(METHODS["rk4"], np.array([])) == np.inf


def test_a_motion_belongs_to_its_spring():
    model = Model("two_masses")
    x, y = model.coordinate("x", start=0.1), model.coordinate("y", start=0.0)
    soft, bushing, m = model.parameters(soft=5.0, bushing=4e4, m=2.0)
    model.kinetic(m * dot(x) ** 2 / 2 + m / 100 * dot(y) ** 2 / 2)
    model.potential(soft * x**2 / 2 + bushing * (x - y) ** 2 / 2)
    system = model.derive()
    origin = fastest_origin(system, system.parameter_values(), 0.0, np.zeros(2), np.zeros(2))
    # Reduced mass m / 101: y has 100 / 101 of the kinetic energy.
    assert origin.eigenvalue.imag == pytest.approx(np.sqrt(4e4 * 101 / 2.0), rel=1e-4)
    assert origin.coordinates[0] == ("y", pytest.approx(100 / 101, rel=1e-3))
    effects = {name: effect for name, _, effect in origin.parameters}
    assert effects == {"bushing": pytest.approx(0.5, abs=1e-3), "m": pytest.approx(-0.5, abs=1e-3)}
    assert "bushing" in origin.spring


def test_what_is_at_rest_has_no_time_scale():
    model = Model("free")
    x = model.coordinate("x", rate=1.0)
    model.kinetic(dot(x) ** 2 / 2)
    advice = advise(model.derive(), RunOptions(**ARGUMENTS))
    assert advice.origin is None and advice.fastest == 0.0
    assert any("nothing moves by itself" in line for line in advice.lines())


@pytest.mark.parametrize(
    ("method", "step", "word"),
    [
        ("rk4", 0.01, None),
        ("verlet", 0.5, "stable up to"),
        ("rk4", 0.2, "steps in the fastest period"),
        ("euler", 0.001, "every step"),
        ("gauss4", 0.9, "steps in the fastest period"),
        ("dop853", None, None),
    ],
)
def test_choice(method, step, word):
    choice = advise(oscillator(2.0 * np.pi / 1.42), RunOptions(**ARGUMENTS), chosen=(method, step)).choice
    assert choice.ok == (word is None)
    assert word is None or word in " ".join(choice.reasons)


def test_command_checks_a_choice():
    assert symgen("advise", "pendulum", "--step", "0.01", "--method", "rk4").exit_code == 0
    bad = symgen("advise", "stiff_bushing_pendulum", "--step", "0.01", "--method", "rk4")
    assert bad.exit_code == 3 and "'k', stiffness of the bushing" in bad.output
    loose = symgen("advise", "pendulum", "--step", "0.03", "--method", "rk4", "--steps-per-period", "60")
    assert loose.exit_code == 3 and "at least 60" in loose.output


def test_at_a_time_of_a_recording():
    assert symgen("run", "pendulum", "--quiet", "--t-end", "2", "--set", "L=0.25").exit_code == 0
    result = symgen("advise", "--at", "pendulum.rrd@1.5", "--t-end", "0.1", "--json", "a.json")
    assert result.exit_code == 0, result.output
    data = json.loads(Path("a.json").read_text())
    assert data["t_first"] == pytest.approx(1.5, abs=0.02)
    assert data["fastest"] == pytest.approx(np.sqrt(9.81 / 0.25), rel=0.02)
    assert symgen("advise", "pendulum", "--at", "pendulum.rrd@1.5").exit_code == 0
    assert "outside the recording" in symgen("advise", "--at", "pendulum.rrd@9").output
    assert symgen("advise", "--at", "pendulum.rrd").exit_code == 2
    assert symgen("advise").exit_code == 2
    other = symgen("advise", "double_pendulum", "--at", "pendulum.rrd@1")
    assert other.exit_code == 1 and "coordinates" in other.output


@pytest.mark.parametrize("name", ["pendulum_linear", "pendulum", "spring_pendulum", "quarter_car"])
def test_recommended_steps_are_those_of_runs_that_nothing_is_said_against(name):
    system = bundled(name)
    arguments = {**ARGUMENTS, "t_end": system.run_defaults["t_end"]}
    for entry in advise(system, RunOptions(**arguments)).fixed_steps:
        if entry.cost.steps < 20_000:
            run = system.run(method=entry.method, step=entry.step, t_end=arguments["t_end"])
            assert run.ok, f"{entry.method}: {[check.says for check in run.objections]}"


@pytest.mark.parametrize(
    ("method", "step"),
    [
        ("semi_implicit_euler", 0.0284),
        ("semi_implicit_euler", 0.005),
        ("verlet", 0.0284),
        ("implicit_euler", 0.0284),
        ("gauss8", 0.2),
    ],
)
def test_a_choice_is_judged_as_its_run_is(method, step):
    system = bundled("pendulum_linear")
    choice = advise(system, RunOptions(**{**ARGUMENTS, "t_end": 10.0}), chosen=(method, step)).choice
    run = system.run(t_end=10.0, method=method, step=step)
    assert choice.ok == run.ok
    assert all(check.says in choice.reasons for check in run.objections)


def test_errors_on_an_oscillation_are_as_methods_say():
    system = oscillator(1.0)
    for method in METHODS.values():
        if method.adaptive or method.order > 8:
            continue
        step = {1: 0.005, 2: 0.02, 4: 0.1, 6: 0.3, 8: 0.5}[method.order]
        run = system.run(t_end=round(40.0 / step) * step, method=method.name, step=step)
        amplitude = run.q[:, 0] - 1j * run.v[:, 0]
        slopes = [
            np.polyfit(run.t, y, 1)[0] for y in (np.unwrap(np.angle(amplitude)), np.log(np.abs(amplitude)))
        ]
        off = max(abs(slopes[0] - 1.0), abs(slopes[1])) / step**method.order
        if method.name == "semi_implicit_euler":
            assert off < 0.01  # of order 2: its amplitude wavers, but nothing adds up
        else:
            assert off == pytest.approx(method.oscillation_error, rel=0.05), method.name


def test_a_model_without_an_end_is_seen_for_ten_periods(tmp_path):
    """Of the slowest motion: of two oscillators in one model that of 4 rad/s; what stands still has no period."""
    assert oscillator(4.0).advise().t_end == pytest.approx(20 * math.pi / 4, rel=1e-9)
    assert oscillator(4.0).advise(t_end=3.0).t_end == 3.0
    model = Model("two")
    for name, k in (("a", 16.0), ("b", 900.0), ("c", 0.0)):
        q = model.coordinate(name, start=0.1)
        model.body(name, mass=1, com=(q, 0))
        model.potential(k * q**2 / 2)
    assert model.derive().advise().t_end == pytest.approx(20 * math.pi / 4, rel=1e-6)
    free = Model("free")
    free.body("b", mass=1, com=(free.coordinate("x", rate=1.0), 0))
    assert free.derive().advise().t_end == 10.0
    (tmp_path / "two.toml").write_text(model.to_toml(), encoding="utf-8")
    told = symgen("advise", "two.toml")
    assert told.exit_code == 0
    assert "no end is given: ten periods of the slowest motion are 15.71 s" in told.output
    assert "no end" not in symgen("advise", "two.toml", "--t-end", "3").output
