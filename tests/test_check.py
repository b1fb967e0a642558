"""`symgen check`: errors of coordinates, momenta and horizons, against digits and formulas from elsewhere."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from references import load_reference

from symgen import Model, dot, runtime
from symgen.cli import main
from symgen.link import module_for
from symgen.model.library import bundled_folder, find
from symgen.runtime import RunOptions
from symgen.runtime.checks.convergence import study, tables
from symgen.runtime.checks.growth import is_exponential, power_of_growth

AUTO = {"method": "auto", "rtol": 1e-8, "atol": 1e-10}


def bundled(name: str) -> runtime.System:
    return runtime.load(module_for(Path(find(name)), {}).text)


@pytest.fixture(scope="module")
def double() -> runtime.System:
    return bundled("double_pendulum")


def runaway(k: float) -> runtime.System:
    """A mass that is pushed away from x = 0: x'' = k² x."""
    model = Model("runaway")
    x = model.coordinate("x", start=1.0)
    model.kinetic(dot(x) ** 2 / 2)
    model.potential(-(k**2) * x**2 / 2)
    return model.derive()


@pytest.mark.parametrize("scene", ["outer_solar_system", "double_pendulum", "free_rigid_body"])
@pytest.mark.parametrize("options", [{**AUTO, "method": "dop853"}, {"method": "rk4"}], ids=["dop853", "rk4"])
def test_errors_are_those_against_forty_digits(scene, options):
    reference = json.loads((bundled_folder() / "references" / f"{scene}.json").read_text(encoding="utf-8"))
    system = bundled(reference["model"])
    options = {**options, "t_end": reference["t_end"]}
    if options["method"] == "rk4":
        options["step"] = reference["t_end"] / 2000
    table = study(system, RunOptions(**options))
    run = system.run(**options)
    expected = np.array([float(x) for x in (*reference["end"]["q"], *reference["end"]["v"])])
    true = np.abs(run.states[-1] - expected)
    size = table.compared.size
    estimated = np.array([entry.at_end for entry in table.errors])
    largest = np.array([entry.error for entry in table.errors])
    assert [entry.name for entry in table.errors][: system.nq] == [c["name"] for c in system.coordinates]
    # No error is far above its estimate; those that matter are met within a factor of two.
    assert np.all(true <= 3.0 * largest + 1e-15 * size)
    counts = true / size > 0.05 * (true / size).max()
    assert estimated[counts] / true[counts] == pytest.approx(1.0, rel=0.5)


def test_order_of_each_coordinate(double):
    table = study(double, RunOptions(**{"t_end": 1.0, "method": "rk4", "step": 0.01}))
    assert [entry.order for entry in table.errors] == pytest.approx([4.0] * 4, abs=0.3)


@pytest.mark.parametrize(
    "options",
    [{"rtol": 1e-15, "atol": 1e-17}, {"method": "dop853"}, {"method": "rk4", "step": 1e-3}],
    ids=["taylor, all digits", "dop853", "rk4"],
)
def test_horizon_is_where_digits_are_lost(double, options):
    """Against 80 digits: up to the horizon they are there, and soon after it they are not."""
    reference = load_reference("double_pendulum_60")
    options = {**AUTO, "t_end": 40.0, **options}
    table = study(double, RunOptions(**options))
    times = np.array([t for t in reference["t"] if t <= 40.0])
    right = np.array([[float(x) for x in state] for state in reference["states"][: len(times)]])
    samples = double.run(**options, at=times).samples
    found = np.array([[*sample.q, *sample.v] for sample in samples])
    error = np.maximum.accumulate((np.abs(found - right) / table.compared.size).max(axis=1))
    for digits in (3, 6):
        t = table.horizon.of(digits)
        assert 5.0 < t < 36.0
        # Errors grow e-fold in a second, and chance decides by what: claims come up to 6.4 s early.
        before, after = times <= t, times > t + 7.0
        assert error[before].max() < 3.0 * 10.0**-digits
        assert error[after].min() > 10.0**-digits
    assert not table.ok and "digits up to t" in table.says and "chaotic" in table.says
    assert 0.5 < table.horizon.rate < 1.5
    short = study(double, RunOptions(**{**options, "t_end": 0.6 * table.horizon.of(3)}))
    assert short.ok, short.says


def test_exponent_of_a_saddle():
    """Off the branch that leads into the saddle, exp(-k t), errors grow with exp(k t): the exponent is k."""
    k = 3.0
    table = study(runaway(k), RunOptions(**{**AUTO, "t_end": 11.0, "rate": {"x": -k}, "method": "dop853"}))
    assert table.horizon.rate == pytest.approx(k, rel=0.02)
    assert not table.ok
    # The solution stays below its start: the errors are those of the run itself less exp(-k t).
    run = runaway(k).run(**{**AUTO, "t_end": 11.0, "rate": {"x": -k}, "method": "dop853"})
    true = np.abs(run["x"] - np.exp(-k * run.t))
    for digits in (3, 6):
        first = run.t[np.flatnonzero(true > 10.0**-digits)[0]]
        # The method is exact on exp(-k t), and finer runs have as much round-off: chance decides, by up to 30 times.
        assert abs(table.horizon.of(digits) - first) < np.log(30.0) / k


def test_regular_motion_has_no_exponent(double):
    swing = study(
        double,
        RunOptions(**{**AUTO, "t_end": 30.0, "start": {"theta1": 0.1, "theta2": 0.1}, "method": "dop853"}),
    )
    assert swing.horizon.rate is None
    assert swing.ok


@pytest.mark.parametrize("power", [1, 2, 3])
def test_powers_are_not_taken_for_exponentials(power):
    t = np.linspace(0.0, 10.0, 400)
    assert not is_exponential(t, 1e-9 * t**power)
    assert power_of_growth(t, 1e-9 * t**power) == pytest.approx(power, rel=0.02)
    assert is_exponential(t, 1e-9 * np.exp(1.2 * t))


def test_momenta_of_the_solar_system():
    """Sums over masses, positions and velocities, by hand; and their drift."""
    system = bundled("outer_solar_system")
    options = {**AUTO, "t_end": 3000.0, "method": "dop853"}
    table = study(system, RunOptions(**options))
    named = dict(zip((r["name"] for r in system.parameters), system.parameter_values()))
    # The steps of the finest run of a study are bounded, too.
    h = system.run(**options).step_log[:, 1]
    longest = 0.2718281828 * (h @ h) / h.sum()
    run = system.run(**{**options, "rtol": 1e-9, "atol": 1e-11, "max_step": longest})
    bodies = ("sun", "jupiter", "saturn", "uranus", "neptune", "pluto")
    m = np.array([named[f"m_{b}"] for b in bodies])
    r, v = run.q.reshape(len(run.t), 6, 3), run.v.reshape(len(run.t), 6, 3)
    linear = np.einsum("b,tbx->tx", m, v)
    angular = np.einsum("b,tbx->tx", m, np.cross(r, v))
    start = np.concatenate([linear[0], angular[0]])
    assert len(table.momenta) == 6
    assert [entry.start for entry in table.momenta] == pytest.approx(start, rel=1e-9, abs=1e-15)
    assert all(max(entry.drift) < 1e-13 for entry in table.momenta[:3])
    # In the same parts: the bound by Cauchy and Schwarz is 2 T m r² about the axis.
    z = table.momenta[5]
    kinetic = np.einsum("b,tbx->t", m, v**2) / 2
    bound = np.sqrt(2 * kinetic * np.einsum("b,tbx->t", m, r[..., :2] ** 2)).max()
    assert z.drift[-1] == pytest.approx(np.abs(angular[:, 2] - angular[0, 2]).max() / bound, rel=0.3)


def test_momenta_depend_on_parameters(double):
    """Without gravity the angular momentum about the pivot stays, with it nothing does."""
    options = {**AUTO, "t_end": 2.0, "method": "dop853", "rate": {"theta1": 2.0, "theta2": -0.5}}
    assert study(double, RunOptions(**options)).momenta == ()
    (found,) = study(double, RunOptions(**{**options, "parameters": {"g": 0.0}})).momenta
    # Both rods horizontal, of 1 m, with 1 kg: v1 = 2, v2 = 2 - 0.5 up; r1 = 1, r2 = 2.
    assert found.name == "angular momentum about z"
    assert found.start == pytest.approx(1.0 * 2.0 + 2.0 * 1.5, rel=1e-12)
    assert found.drift[0] > found.drift[-1]


def test_momenta_of_a_free_body():
    """In space: the rotated inertia times the angular velocity; a symmetric top keeps its spin besides."""
    table = study(bundled("free_rigid_body"), RunOptions(**{**AUTO, "t_end": 2.0, "method": "dop853"}))
    assert [entry.name for entry in table.momenta] == [f"angular momentum about {axis}" for axis in "xyz"]
    top = study(bundled("spinning_top"), RunOptions(**{**AUTO, "t_end": 0.5, "method": "dop853"}))
    assert [entry.name for entry in top.momenta] == ["momentum of spin"]


def test_command(tmp_path):
    arguments = ["check", "double_pendulum", "--method", "dop853", "--t-end", "30"]
    files = ["--json", str(tmp_path / "c.json"), "--plot", str(tmp_path / "c.png")]
    result = CliRunner().invoke(main, arguments + files)
    assert result.exit_code == 3, result.output
    assert "digits up to t = " in result.output and "up to t [s]" in result.output
    table = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    assert [entry["name"] for entry in table["errors"]] == ["theta1", "theta2", "dot(theta1)", "dot(theta2)"]
    assert table["growth"]["horizon"]["6"] < table["growth"]["horizon"]["3"] < 30.0
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")


def test_only_the_worst_coordinates_are_shown():
    table = study(bundled("outer_solar_system"), RunOptions(**{**AUTO, "t_end": 100.0, "method": "dop853"}))
    ((title, (_, *rows)),) = (part for part in tables(table) if part[0].startswith("estimated errors"))
    assert title.endswith("the worst 8 of 36")
    parts = [float(row[4]) for row in rows]
    assert len(parts) == 8
    assert parts == sorted(parts, reverse=True)
    assert len(table.to_dict()["errors"]) == 36
