"""Health reports: good runs pass, and each kind of bad run is caught by its check."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from symgen import Model, cos, dot, exp, sin, t
from symgen.link import derive_text, module_for
from symgen.model.library import find
from symgen.runtime import RunOptions, Solution, System, load, solve
from symgen.runtime.checks.advice import advise
from symgen.runtime.checks.convergence import lines, study
from symgen.runtime.checks.health import check
from symgen.runtime.checks.work_error import work_of_errors
from symgen.runtime.exchange import Exchange, energy_limit, largest_leak
from symgen.runtime.integrate.methods import METHODS, find_method
from symgen.runtime.recording.verify import verify
from symgen.runtime.result_json import result, to_json

FIXTURES = Path(__file__).parent / "fixtures"
GENERATED = Path(__file__).parent.parent / "generated"
ARGUMENTS = {"t_end": 3.0, "method": "auto", "rtol": 1e-8, "atol": 1e-10}


@pytest.fixture(scope="module")
def pendulum() -> System:
    return load(FIXTURES / "pendulum.py")


@pytest.fixture(scope="module")
def cartesian() -> System:
    return load(FIXTURES / "cartesian_pendulum.py")


@pytest.fixture(scope="module")
def swing(cartesian: System) -> Solution:
    return solve(cartesian, 2.0, start={"x": 0.3}, method="dop853")


def objections(solution: Solution) -> list[str]:
    return [entry.check for entry in check(solution) if not entry.ok]


def test_good_runs_pass(pendulum, swing):
    assert objections(solve(pendulum, 3.0, method="dop853")) == []
    assert objections(solve(pendulum, 3.0, method="rk4", step=0.01)) == []
    assert objections(swing) == []
    assert swing.ok and swing.objections == []


def test_checks_are_plain_values(swing):
    for entry in check(swing):
        assert type(entry.ok) is bool and type(entry.value) is float and type(entry.limit) is float
        assert entry.says and set(entry.to_dict()) == {"check", "ok", "value", "limit", "says", "note"}
        assert type(entry.note) is bool


def test_coarse_fixed_step_is_not_trusted(pendulum):
    run = solve(pendulum, 3.0, method="rk4", step=0.2)
    found = {entry.check: entry for entry in check(run)}
    # g/l = 19.62 at rest below: the fastest rate is at most its root.
    assert found["resolution"].value == pytest.approx(2 * np.pi / np.sqrt(19.62) / 0.2, rel=0.2)
    assert found["resolution"].note and "step of at most" in found["resolution"].says
    assert found["stability"].ok and not found["stability"].note
    # The step is a cause that is noted; what it did to the energy is the evidence.
    assert not run.ok and "energy" in objections(run)
    assert [entry.check for entry in run.objections] == objections(run)
    assert [entry.check for entry in run.advice] == ["resolution"]


def test_a_coarse_step_is_an_objection_where_nothing_else_judges_it(pendulum):
    run = replace(solve(pendulum, 3.0, method="rk4", step=0.1), step_log=np.zeros((0, 2)))
    assert "accuracy" not in {entry.check for entry in check(run)}
    assert "resolution" in objections(run)


def test_unstable_step_is_named():
    oscillator = load(FIXTURES / "oscillator.py")
    fastest = max(np.abs(np.linalg.eigvals(_linear(oscillator))))
    run = solve(oscillator, 400.0 / fastest, method="verlet", step=2.2 / fastest)
    assert "stability" in objections(run)


def test_what_is_unstable_but_did_not_grow_is_a_note(pendulum):
    run = solve(pendulum, 1.0, method="euler", step=1e-4, start={"theta": 0.5})
    found = {entry.check: entry for entry in check(run)}
    assert found["energy"].ok and "unstable on undamped motion at every step" in found["stability"].says


def test_what_would_be_unstable_if_it_moved_is_a_note():
    """A valley that is narrow in one place is crossed along its floor: there is nothing that could grow."""
    m = Model("floor")
    x, y = m.coordinate("x"), m.coordinate("y", start=1.0)
    m.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    m.potential(y**2 / 2 + (1 + 4e4 * exp(-((y / 0.02) ** 2))) * x**2 / 2)
    run = m.derive().run(t_end=np.pi, method="rk4", step=0.05, t_eval=np.linspace(0.0, np.pi, 41))
    found = {entry.check: entry for entry in run.health}
    assert run.ok and found["stability"].note and "e^75" in found["stability"].says


def _linear(system: System) -> np.ndarray:
    p = system.parameter_values()
    rows = [
        system.kernel("rhs")(0.0, y, p)[:2] - system.kernel("rhs")(0.0, [0.0, 0.0], p)[:2] for y in np.eye(2)
    ]
    return np.array(rows).T


def test_euler_gains_energy(pendulum):
    run = solve(pendulum, 3.0, method="euler", step=0.01)
    assert "energy" in objections(run)


@pytest.mark.parametrize(
    ("rtol", "limit"), [(1e-3, 2e-2), (1e-8, 1e-3), (1e-12, 1e-6)], ids=["loose", "default", "tight"]
)
def test_energy_limit_follows_the_tolerance(rtol, limit):
    assert energy_limit(find_method("dop853"), rtol) == pytest.approx(limit)


def test_energy_limit_of_fixed_steps():
    assert energy_limit(find_method("implicit_euler"), 1e-8) == 5e-2
    assert energy_limit(find_method("verlet"), 1e-8) == energy_limit(find_method("rk4"), 1e-8) == 2e-2


def _lifted(height: float) -> System:
    """A pendulum whose potential is measured from far away."""
    model = Model("lifted")
    a = model.coordinate("a", start=0.2)
    model.kinetic(dot(a) ** 2 / 2)
    model.potential(9.81 * (height - cos(a)))
    return load(derive_text(model).text)


def test_work_of_stiff_forces_is_off_by_more_than_the_motion():
    """x follows cos t by a spring of 1e8 N/m with critical damping: the exact solution, by Prothero and Robinson."""
    model = Model("driven_stiffly")
    x = model.coordinate("x", start=1.0)
    model.kinetic(dot(x) ** 2 / 2)
    model.force(x, -1e8 * (x - cos(t)) - 2e4 * (dot(x) + sin(t)) - cos(t))
    run = solve(model.derive(), 3.0, method="bdf", rtol=1e-7, atol=1e-9, max_steps=100_000)
    assert run.q[-1, 0] == pytest.approx(np.cos(3.0), abs=1e-7)
    assert run.energy.max_error > energy_limit(find_method("bdf"), 1e-7)
    (found,) = [entry for entry in run.health if entry.check == "energy"]
    assert found.ok and found.note and "forces are so stiff" in found.says
    assert run.ok
    # Of a soft drive such errors explain next to nothing.
    soft = solve(model_of_a_soft_drive(), 3.0, method="bdf", rtol=1e-7, atol=1e-9)
    assert work_of_errors(soft) < 1e-5 < work_of_errors(run)


def model_of_a_soft_drive() -> System:
    model = Model("driven_softly")
    x = model.coordinate("x", start=1.0)
    model.kinetic(dot(x) ** 2 / 2)
    model.force(x, -(x - cos(t)) - 2 * (dot(x) + sin(t)) - cos(t))
    return model.derive()


@pytest.mark.parametrize("height", [0.0, 1.0, 1e3, 1e6, 1e9])
def test_the_energy_error_does_not_depend_on_the_zero_of_the_potential(height):
    system, here = _lifted(height), _lifted(0.0)
    lossy = {"method": "implicit_euler", "step": 0.02}
    lost, expected = system.run(t_end=20.0, **lossy), here.run(t_end=20.0, **lossy)
    assert lost.energy.max_error == pytest.approx(expected.energy.max_error, rel=1e-3)
    assert "energy" in objections(lost) and lost.energy.exchange.size == pytest.approx(0.1955, rel=0.01)
    # What round-off of V leaves of the balance is no objection.
    assert objections(system.run(t_end=20.0, method="dop853", rtol=1e-12, atol=1e-14)) == []


@pytest.mark.parametrize(
    "method", ["taylor", "dop853", "radau5", "bdf", "verlet", "implicit_euler", "gauss8"]
)
def test_rest_exchanges_nothing_and_is_right(method):
    system = _lifted(1e6)
    run = system.run(t_end=5.0, method=method, start={"a": 0.0})
    assert objections(run) == [] and run.energy.max_error < 1e-12
    assert run.energy.exchange.size == 0.0
    # Nearly at rest: the motion exchanges less than V is rounded to.
    run = system.run(
        t_end=5.0, method=method, start={"a": 1e-6}, **({} if run.step is None else {"step": 0.005})
    )
    assert "energy" not in objections(run)


def _driven_crank(drag: float = 0.0) -> System:
    """A bob on a crank that turns at constant speed: even motion, while the power of the drive goes up and down."""
    model = Model("driven_crank", gravity=(0, "-9.81"))
    a = model.coordinate("a", start=0.0, rate=3.0)
    model.body("bob", mass=1, com=(sin(a), -cos(a)))
    model.force(a, -drag * dot(a))
    model.constraint("driven", a - 3 * t)
    return load(derive_text(model).text)


@pytest.mark.parametrize("method", [name for name, method in METHODS.items() if method.adaptive])
def test_steps_longer_than_the_power_changes_are_no_imbalance(method, tmp_path):
    run = _driven_crank(0.5).run(t_end=20.0, method=method)
    assert run.ok and run.energy.max_error < 1e-6
    assert run.energy.work[-1] == pytest.approx(
        9.81 * (1.0 - np.cos(60.0)), rel=1e-9
    )  # the drag's is made good
    assert run.energy.exchange.size == pytest.approx(2 * 9.81, rel=1e-3)
    run.save(tmp_path / "crank.rrd")
    assert {check.name: check.ok for check in verify(tmp_path / "crank.rrd").checks}["energy"]


def test_work_along_the_frames_hides_no_loss():
    """Equations with a drag that does no work in the module, on a crank that is driven by a torque."""
    from tests.trust.models import edited

    run = edited("damped_spring_pendulum", "rhs", 2, "{} - 0.05*y[2]").run(t_end=5.0, method="dop853")
    assert "energy" in objections(run) and not any("work:" in note for note in run.notes)


@pytest.mark.parametrize(
    ("method", "step", "is_ok"),
    [("implicit_euler", 3.6e-4, True), ("verlet", 1.7e-3, True), ("euler", 3e-3, False)],
)
def test_work_that_passes_through_is_part_of_the_scale(method, step, is_ok, tmp_path):
    """Driven and damped, a motion is right to 1 % while its balance drifts by as much as it exchanges."""
    system = load(GENERATED / "rough_road.py")
    run = system.run(t_end=8.0, method=method, step=step)
    right = system.run(t_end=8.0, method="dop853", rtol=1e-10)
    off = (np.abs(run.states - right.states) / np.ptp(right.states, axis=0)).max()
    assert run.energy.max_error > energy_limit(find_method(method), run.rtol) and (off < 0.01) == is_ok
    assert ("energy" not in objections(run)) == is_ok
    run.save(tmp_path / "road.rrd")
    assert {check.name: check.ok for check in verify(tmp_path / "road.rrd").checks}["energy"] == is_ok


def test_a_balance_leaks_in_parts_of_what_passes():
    work = np.linspace(0.0, 1000.0, 101)
    assert largest_leak(0.03 * work, work, 1.0) == pytest.approx(30.0 / 1001.0)
    assert largest_leak(np.where(work < 500.0, 0.0, 3.0), work, 20.0) == pytest.approx(3.0 / 30.0)
    assert largest_leak(0.0 * work, work, 1.0) == 0.0


def test_exchange_takes_the_largest_t_or_the_range_of_v():
    exchange = Exchange(np.array([[1.0, 100.0], [3.0, 98.0]]))
    assert exchange.size == 3.0
    assert exchange.take(np.array([[0.0, 93.0]]), np.array([1e3])).size == 7.0
    assert exchange.relative(0.7) == pytest.approx(0.1)
    assert exchange.relative(1e-13) < 1e-15  # of what energies are rounded to
    assert np.isnan(exchange.relative(np.nan))
    assert Exchange().relative(0.0) == 0.0


@pytest.mark.parametrize("scale", [1e-40, 1e-20, 1.0, 1e20])
def test_an_energy_error_does_not_depend_on_the_size_of_a_motion(scale):
    """Only what stops and frictions hold is at rest where round-off moves it."""
    m = Model("small")
    m.coordinate("x", start=scale)
    m.kinetic("dot(x)^2/2")
    m.potential("2*x^2")
    run = m.derive().run(t_end=10.0, method="implicit_euler", step=0.3, atol=0.0)
    assert not run.ok and any(entry.check == "energy" for entry in run.objections)
    tiny = np.array([[1e-70, 0.0], [3e-70, 0.0]])
    assert Exchange(tiny).relative(2e-70) == pytest.approx(2 / 3)
    assert Exchange(tiny, holds=True).relative(2e-70) < 1e-13


def _altered(solution: Solution, **changes) -> Solution:
    return replace(solution, **changes)


def test_numbers_that_are_not_finite(swing):
    q = swing.q.copy()
    q[5, 1] = np.nan
    found = check(_altered(swing, q=q))
    assert [entry.ok for entry in found] == [True, False]
    assert f"y is not finite from t = {swing.t[5]:.9g} s" in found[1].says


def test_energy_that_is_not_a_number_is_not_trusted(swing):
    assert "energy" in objections(_altered(swing, energy=replace(swing.energy, max_error=np.nan)))


def test_drift_from_a_constraint_is_seen(swing):
    q = swing.q.copy()
    q[7] *= 1.0 + 1e-4
    found = {entry.check: entry for entry in check(_altered(swing, q=q))}
    assert not found["constraint position"].ok
    assert "'rod'" in found["constraint position"].says
    v = swing.v.copy()
    v[7] += 1e-3 * q[7]
    found = {entry.check: entry for entry in check(_altered(swing, v=v))}
    assert found["constraint position"].ok and not found["constraint velocity"].ok


def test_scale_of_the_drift_does_not_depend_on_the_constraints_scale():
    run = solve(load(FIXTURES / "redundant_pendulum.py"), 1.0, start={"x": 0.3}, method="dop853")
    found = {entry.check: entry for entry in check(run)}
    assert all(entry.ok for entry in found.values())
    assert "rod_again" in found["redundant constraints"].says


def test_rejected_and_tiny_steps(swing):
    stats = {**swing.stats, "steps": 10, "rejected": 90}
    assert _notes(_altered(swing, stats=stats)) == ["rejected steps"]
    log = swing.step_log.copy()
    log[:, 1] = 1e-16
    assert _notes(_altered(swing, step_log=log)) == ["step size"]


def test_steps_from_one_side_of_a_choice_to_the_other_are_none_that_are_too_small():
    model = Model("hung", gravity=(0, "-9.81 m/s^2"))
    y = model.coordinate("y", start=0, unit="m")
    model.body("ball", mass="1 kg", com=(0, y))
    rope = {"stiffness": "40 N/m", "damping": "0.2 N*s/m", "acts": "pull"}
    for name, length in (("long", 1.4), ("short", 1.2)):
        ends = model.point(name, "ball", (0, 0)), model.point(f"{name}_top", at=(0, 1))
        model.spring(f"{name}_rope", points=ends, length=length, **rope)
    run = model.derive().run(5.0, method="taylor", rtol=1e-4)
    assert np.mean(run.step_log[:, 1] < 1e-14) > 0.05
    assert _notes(run) == []
    log = run.step_log.copy()
    log[: len(log) // 3, 1] = 1e-16
    assert _notes(_altered(run, step_log=log)) == ["step size"]


def _notes(solution: Solution) -> list[str]:
    """Return what is noted of a run that nothing is said against."""
    assert solution.ok
    return [entry.check for entry in solution.advice]


def test_constraints_that_nearly_depend_on_each_other_are_told(swing):
    found = {entry.check: entry for entry in check(_altered(swing, min_pivot_ratio=1e-5))}
    assert found["rank"].note and "'rod'" in found["rank"].says
    assert "rank" not in {entry.check for entry in check(swing)}


def test_blow_up_says_when_and_what(swing):
    v = swing.v.copy()
    v[80:, 1] *= 1e4
    v[120:, 0] = np.inf
    energy = replace(swing.energy, max_error=np.nan)
    run = _altered(swing, v=v, energy=energy, status="failed", message="It stopped.", method="rk4", step=0.01)
    entry = next(entry for entry in check(run) if entry.check == "blow-up")
    assert "dot(y) outgrew its size at the start of the run" in entry.says
    assert f"t = {swing.t[80]:.6g} s" in entry.says and "below the limit of stability" in entry.says


def test_events_that_were_passed_by():
    run = solve(load(FIXTURES / "oscillator.py"), 3.0, method="dop853")
    assert run.events and "missed events" not in objections(run)
    first = next(event for event in run.events if event.action == "record")
    forgotten = _altered(run, events=[event for event in run.events if event is not first])
    found = {entry.check: entry for entry in check(forgotten)}["missed events"]
    assert not found.ok and found.value == 1.0 and repr(first.name) in found.says


def test_poles_that_fixed_steps_went_across():
    from tests.stress.models import point

    run = solve(point("pole", "1/(0.47 - t)"), 1.0, method="gauss4")
    found = {entry.check: entry for entry in run.health}["poles"]
    assert run.status == "success" and not found.ok
    assert "dot(x) becomes infinite at t = 0.47 s" in found.says
    # Rates get across one whose integral is finite.
    run = solve(point("weak_pole", "(0.4712 - t)/sqrt(sqrt((0.4712 - t)^2))^3"), 1.0, method="gauss4")
    assert {entry.check: entry for entry in run.health}["poles"].note
    # Signs that change otherwise: by way of zero, and at once.
    for force in ("-x", "-x/sqrt(x^2)"):
        run = solve(point("no_pole", force, 1.0), 4.0, method="gauss4")
        assert "poles" not in objections(run)


def test_stability_names_what_is_stiff():
    from tests.trust.models import bundled

    run = bundled("stiff_bushing_pendulum").run(t_end=0.1, method="rk4", step=1e-3)
    found = {entry.check: entry for entry in run.health}
    assert "stiffness of the bushing" in found["stability"].says
    assert found["stability"].value == pytest.approx(1e-3 / (2.95 / 2e4), rel=0.3)  # rk4, damping ratio 0.1


@pytest.mark.parametrize("status", ["failed", "zeno", "interrupted"])
def test_irregular_end(swing, status):
    found = check(_altered(swing, status=status, message="It stopped."))
    assert (found[0].check, found[0].ok, found[0].says) == ("status", False, "It stopped.")


def test_result_reads_back_bit_for_bit(cartesian):
    run = solve(cartesian, 1.0, start={"x": 0.3}, method="dop853", at=(0.25, 1.0))
    data = json.loads(to_json(result(run, {"derive": 0.125})))
    assert data["coordinates"] == {"x": run.q[-1, 0], "y": run.q[-1, 1]}
    assert data["rates"]["x"] == run.v[-1, 0]
    assert data["accelerations"]["y"] == run.accelerations[-1, 1]
    assert data["multipliers"] == {"rod": run.multipliers[-1, 0]}
    assert [sample["t"] for sample in data["samples"]] == [0.25, 1.0]
    assert data["samples"][0]["coordinates"]["x"] == run.samples[0].q[0]
    assert data["samples"][1]["coordinates"] == data["coordinates"]
    assert set(data["seconds"]) == {"derive", "compile", "run", "log"} and data["seconds"]["derive"] == 0.125
    assert {"steps", "rejected", "rhs", "jacobians", "factorisations"} <= set(data["stats"])
    assert [entry["check"] for entry in data["health"]] == [entry.check for entry in run.health]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1, "0.10000000000000001"),
        (2.0, "2.0"),
        (-1e-300, "-1.0000000000000000e-300"),
        (float("inf"), "null"),
        (float("nan"), "null"),
        (np.float64(1.5), "1.5"),
        (np.int64(3), "3"),
        (True, "true"),
        ([np.bool_(False), None], "[false, null]"),
        ({"ω": {"a": ()}}, '{"\\u03c9": {"a": []}}'),
    ],
)
def test_json_text(value, text):
    assert json.loads(to_json(value)) == json.loads(text)
    if isinstance(value, float) and np.isfinite(value):
        assert json.loads(to_json(value)) == value


@pytest.mark.parametrize(
    "force, words, rule",
    [
        (
            "-50*dot(x)",
            "0.02 s, in which a motion falls by a factor of e (rate 50 1/s",
            "in 2 pi time constants",
        ),
        ("25*x", "0.2 s, in which a motion grows by a factor of e (rate 5 1/s", "in 2 pi time constants"),
        ("-25*x - 9.9*dot(x)", "0.2 s, a period of 1.26 s (rate 5 1/s", "a period"),
    ],
)
def test_advice_calls_a_period_what_turns_back(force, words, rule):
    """A decay and a growth have a time constant; a spring that is damped nearly critically still swings."""
    m = Model("block")
    x = m.coordinate("x", start=0.01, rate=0.1)
    m.body("b", mass="1 kg", com=(x, 0))
    m.force("x", force)
    lines = advise(m.derive(), RunOptions(t_end=1.0)).lines()
    assert any(line.startswith(f"fastest time scale: {words}") for line in lines), lines
    assert any(line.startswith(f"rule: 50 steps {rule}, ") for line in lines), lines


def test_advice_for_a_pendulum(pendulum):
    advice = advise(pendulum, RunOptions(**ARGUMENTS))
    omega = np.sqrt(9.81 / 0.5)
    assert advice.fastest == pytest.approx(omega, rel=0.05)
    assert advice.method == "taylor" and advice.reason
    steps = {entry.method: entry for entry in advice.fixed_steps}
    assert steps["verlet"].stable == pytest.approx(2.0 / advice.fastest)
    assert 20 <= 2 * np.pi / advice.fastest / steps["rk4"].step <= 100
    assert steps["rk4"].step < steps["rk4"].stable
    assert any("fastest time scale" in line for line in advice.lines())
    json.loads(to_json(advice.to_dict()))


@pytest.mark.parametrize(("method", "order"), [("rk4", 4), ("verlet", 2)])
def test_step_halving_shows_the_order(pendulum, method, order):
    table = study(pendulum, RunOptions(**{**ARGUMENTS, "t_end": 1.0, "method": method, "step": 0.02}))
    assert [level.steps for level in table.levels] == [50, 100, 200, 400]
    assert table.levels[1].order == pytest.approx(order, abs=0.15)
    assert table.ok and not table.failed
    assert len(list(lines(table))) >= 6


def test_tolerances_tighten(cartesian):
    table = study(cartesian, RunOptions(**{**ARGUMENTS, "t_end": 1.0, "start": {"x": 0.3}}))
    assert [level.setting for level in table.levels] == pytest.approx([1e-6, 1e-7, 1e-8, 1e-9])
    assert table.ok and table.constrained
    assert table.levels[-1].difference is None and table.levels[-2].difference < 1e-6


def test_study_takes_the_steps_that_runs_take(pendulum):
    """Levels must differ even where steps are long beside the times of comparison; the finest has bounds on its own."""
    arguments = {**ARGUMENTS, "t_end": 1.0, "method": "dop853", "rtol": 1e-6, "atol": 1e-8}
    table = study(pendulum, RunOptions(**arguments))
    steps = [
        pendulum.run(**{**arguments, "rtol": 1e-6 * f, "atol": 1e-8 * f}).stats["steps"]
        for f in (100.0, 10.0, 1.0, 0.1)
    ]
    assert [level.steps for level in table.levels[:3]] == steps[:3]
    assert table.levels[3].steps > steps[3]
    assert table.levels[0].steps < table.levels[-1].steps
    assert table.levels[0].difference > 0.0


def test_a_step_that_is_too_long_does_not_settle(pendulum):
    table = study(pendulum, RunOptions(**{**ARGUMENTS, "t_end": 20.0, "method": "euler", "step": 0.05}))
    assert not table.ok and "not to be trusted" in table.says


def _hanging_body(edit=lambda text: text) -> System:
    """A body on a ball joint, its orientation a unit quaternion; `edit` changes the module's text."""
    model = Model("hanging_body", gravity=(0, 0, -9.81))
    model.body("bob", mass=1.0, com=(0.1, 0.0, -0.4), inertia=(0.03, 0.02, 0.01))
    model.joint("ball", "spherical", "bob", "world", damping=0.1)
    return load(edit(derive_text(model).text))


def _with_wrong_entry(text: str) -> str:
    before, marker, rest = text.partition("\ndef residual_jacobian(")
    return before + marker + rest.replace("    out[1] = ", "    out[1] = 1.5*", 1)


def test_the_jacobian_by_a_quaternion_is_judged_along_what_rates_do_to_it():
    given = {"method": "radau5", "rate": {"ball_wx": 1.0, "ball_wz": 2.0}}
    assert "jacobian" not in objections(solve(_hanging_body(), 0.5, **given))
    assert "jacobian" in _notes(solve(_hanging_body(_with_wrong_entry), 0.5, **given))


@pytest.mark.parametrize("name", ["verlet", "rk4", "gauss6", "dop853", "radau5"])
def test_a_jump_in_the_instant_of_the_end_is_no_error(name):
    """One run meets it just in time, and the one beside it does not: neither is wrong."""
    m = Model("end")
    m.parameters(speed=1.0, there=1.0)
    x = m.coordinate("x", rate="speed")
    m.kinetic(dot(x) ** 2 / 2)
    m.event("turn", "x - there", "rising", {"reset": {"dot(x)": "-dot(x)"}})
    system = m.derive()
    for v in (0.5, 1.0, 3.0):
        for at in (1.0, 1.5):
            for off in (0.0, 1e-15, -1e-15):
                run = system.run(t_end=at * (1 + off), method=name, parameters={"speed": v, "there": v * at})
                assert run["x"][-1] == pytest.approx(v * at, abs=1e-12)
                assert not run.objections


def test_an_integral_that_nobody_sees_is_not_judged():
    """That of a state over time is hidden: however small it is beside atol, the state is right."""
    m = Model("lag")
    m.state("s", derivative="(1 - s)/1e9")
    run = m.derive().run(t_end=0.4, method="bdf", rtol=1e-7)
    assert run["s"][-1] == pytest.approx(4e-10, rel=1e-3)
    assert not any("integral" in objection.says for objection in run.objections)


def test_a_step_longer_than_the_run_is_judged_by_the_run():
    m = Model("slow")
    m.state("s", derivative="(cos(3*t) - s)/1e3")
    run = m.derive().run(t_end=0.5, method="gauss8", step=100.0)
    assert run["s"][-1] == pytest.approx(np.sin(1.5) / 3e3, rel=1e-3)
    assert not any(objection.check == "time terms" for objection in run.objections)


@pytest.mark.parametrize("fps", [2.0, 7.0, 1000.0])
def test_poles_are_found_between_frames_far_apart_and_only_where_they_are(fps):
    from tests.stress.models import point

    run = solve(point("pole", "1/(0.47 - t)"), 1.0, method="gauss4", step=0.01, fps=fps)
    assert not {entry.check: entry for entry in run.health}["poles"].ok
    # A planet's distance, from 0.2 to 1.8 and back, some periods between frames: cubics through these pass zero.
    radial = point("radial", "0.36/x^3 - 1/x^2", 0.2)
    run = solve(radial, 2000.0, method="gauss8", step=0.05, fps=fps / 100.0)
    assert "poles" not in {entry.check for entry in run.health}


@pytest.mark.parametrize("direction", ["rising", "falling", "both"])
@pytest.mark.parametrize("method", ["gauss16", "dop853"])
def test_events_that_come_in_crowds_are_missed_only_where_that_is_said(method, direction):
    """x = cos t passes through 1200 places where sin(k x) is zero: long steps see some of them, short ones all."""
    m = Model("crowd")
    m.coordinate("x", start=1.0)
    m.kinetic("dot(x)^2/2")
    m.potential("x^2/2")
    m.event("seen", "sin(942.3*x) - 0.1", direction=direction, then="record")
    t = np.linspace(0.0, 6.2, 4_000_001)
    side = np.sign(np.sin(942.3 * np.cos(t)) - 0.1)
    wanted = {1: ["rising", "both"], -1: ["falling", "both"]}
    expected = sum(int(np.count_nonzero(np.diff(side) == 2 * s)) for s in wanted if direction in wanted[s])
    for options in (
        ({"step": 0.3}, {"step": 2e-4}) if method == "gauss16" else ({"rtol": 1e-4}, {"max_step": 2e-4})
    ):
        run = m.derive().run(t_end=6.2, method=method, **options)
        found = {entry.check: entry for entry in run.health}["missed events"]
        assert found.ok == (len(run.events) == expected), (len(run.events), expected)
    assert found.ok


def test_a_friction_that_bears_less_at_rest_than_while_it_slides_is_told_so():
    """Where levels follow the motion no check of parameters sees it: it comes to rest under 1.3 N and bears 1 N."""
    m = Model("weak")
    x = m.coordinate("x", rate=1.0)
    m.body("block", mass=1, com=(x, 0))
    m.force(x, "1.5*sin(2*t)")
    m.friction("sole", coordinate="x", force="1.2 + 0.1*x", static="1 + 0*x")
    (entry,) = [check for check in m.derive().run(t_end=5.0).health if not check.ok]
    assert (
        entry.check == "held"
        and "bears less while it sticks ('static'), 1, than while it slides, 1.3" in entry.says
    )


def test_energy_of_what_is_small_in_its_units_is_told_of_atol():
    model = """
        [coordinates]
        x = { unit = "m", start = "1 nm" }
        [parameters]
        k = "1 N/m"
        [bodies.b]
        mass = "1 kg"
        com = ["x", 0]
        [energy]
        potential = "k*x^2/2"
    """
    system = Model.from_toml(model).derive()
    (energy,) = (c for c in system.run(t_end=20.0, method="dop853").health if c.check == "energy")
    assert not energy.ok and "try a smaller atol than 1e-10" in energy.says
    assert all(check.ok for check in system.run(t_end=20.0, method="dop853", atol=1e-19).health)


def test_rates_beyond_the_digits_of_atol_are_no_matter_of_the_step():
    """A pendulum in microseconds, from rest: Newton's iteration cannot leave less than numbers of its rates tell."""
    system = load(module_for(Path(find("double_pendulum")), {}).text)
    fast = {"method": "implicit_midpoint", "parameters": {"g": 9.81e12}}
    run = system.run(t_end=5e-7, **fast)
    assert run.status == "failed"
    assert "last digits are above what atol 1e-10 asks for: give a larger --atol" in run.message
    assert system.run(t_end=5e-7, atol=1e-6, **fast).ok
