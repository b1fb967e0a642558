"""Runs as tables and pictures: files that read back bit for bit, extras that are named, states at any time."""

from __future__ import annotations

import csv
import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from pyarrow import parquet

from symgen import runtime
from symgen.cli import main
from symgen.runtime import tables
from symgen.runtime.errors import RuntimeModelError

FIXTURES = Path(__file__).parent / "fixtures"


def load(name: str):
    return runtime.load(FIXTURES / f"{name}.py")


@pytest.fixture(scope="module")
def solution():
    return load("cartesian_pendulum").run(1.0, method="dop853")


def invoke(*arguments: str):
    return CliRunner().invoke(main, [str(x) for x in arguments])


def read_csv(path) -> tuple[list[str], np.ndarray]:
    with open(path, encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    return head, np.array(rows, dtype=float)


def test_a_solution_is_a_mapping_of_its_series(solution):
    assert list(solution) == solution.names() and "x" in solution and "nothing" not in solution
    assert {name: series.tolist() for name, series in dict(solution).items()} == {
        name: solution[name].tolist() for name in solution
    }
    np.testing.assert_array_equal(solution.y, np.hstack([solution.q, solution.v]))


def test_csv_reads_back_bit_for_bit(solution, tmp_path):
    solution.to_csv(tmp_path / "run.csv")
    names, rows = read_csv(tmp_path / "run.csv")
    assert names == ["t", *solution.names(), "kinetic_energy", "potential_energy", "work"]
    assert rows[:, 0].tolist() == solution.t.tolist()
    for name in solution:
        assert rows[:, names.index(name)].tolist() == solution[name].tolist()
    assert rows[:, -3].tolist() == solution.energy.kinetic.tolist()


def test_parquet_has_the_same_numbers_and_units(solution, tmp_path):
    solution.to_parquet(tmp_path / "run.parquet")
    read = parquet.read_table(tmp_path / "run.parquet")
    assert read["dot(x)"].to_pylist() == solution["dot(x)"].tolist()
    units = {field.name: field.metadata[b"unit"].decode() for field in read.schema}
    given = {record["name"]: record["unit"] for record in solution.system.coordinates}
    assert units["t"] == "s" and units["kinetic_energy"] == "J"
    assert {name: units[name] for name in given} == given


@pytest.mark.parametrize(
    "unit, derived", [("m/s", "m/s^2"), ("rad/s", "rad/s^2"), ("", ""), ("N/(m/s)", "(N/(m/s))/s")]
)
def test_units_of_accelerations(unit, derived):
    assert tables._per_second(unit) == derived


@pytest.mark.parametrize(
    "method, package, extra",
    [
        ("to_dataframe", "pandas", "tables"),
        ("to_xarray", "xarray", "tables"),
        ("plot", "matplotlib", "figures"),
    ],
)
def test_what_is_missing_is_named_with_its_command(solution, monkeypatch, method, package, extra):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == package else find(name))
    monkeypatch.setattr(tables, "columns_of", lambda _: 1 / 0)  # not before that
    with pytest.raises(
        ImportError, match=rf"needs {package}, which is not installed: pip install 'symgen\[{extra}\]'"
    ):
        getattr(solution, method)()


def test_data_frame_and_dataset(solution):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    frame, dataset = solution.to_dataframe(), solution.to_xarray()
    assert frame["x"].tolist() == dataset["x"].values.tolist() == solution["x"].tolist()
    assert frame.index.name == "t" and dataset["t"].attrs["units"] == "s" and frame.attrs["units"]["t"] == "s"


def test_plot_has_a_diagram_for_each_unit_and_all_of_the_series(solution):
    pytest.importorskip("matplotlib")
    figure = solution.plot("x", "y", "dot(x)")
    lines = {line.get_label(): line for axes in figure.axes for line in axes.lines}
    for name in ("x", "y", "dot(x)"):
        assert lines[name].get_ydata().tolist() == solution[name].tolist()
    with pytest.raises(KeyError, match="did you mean"):
        solution.plot("xx")


def test_a_notebook_shows_drawing_state_and_health(solution):
    text = solution._repr_html_()
    assert "<svg" in text and "health checks passed" in text and "dot(x)" in text
    assert f"{solution['x'][-1]:.12g}" in text and len(repr(solution)) < 120


@pytest.mark.parametrize("method", ["taylor", "dop853", "radau5", "rk4"])
@pytest.mark.parametrize("name", ["pendulum", "oscillator"])
def test_states_at_any_time_are_those_of_frames_there(name, method):
    system = load(name)
    step = {"step": 0.01} if method == "rk4" else {}
    run = system.run(1.0, method=method, **step)
    times = np.random.default_rng(1).uniform(0.0, 1.0, (2, 3))
    states = run(times)
    frames = system.run(1.0, method=method, t_eval=times.ravel(), **step)
    for t, state in zip(times.ravel(), states.reshape(-1, states.shape[-1])):
        assert state.tolist() == frames.states[frames.t.tolist().index(t)].tolist()
    assert run(0.5).shape == (system.nq + system.nv,)
    assert run(run.t[-1]).tolist() == run.states[-1].tolist()


def test_states_between_frames_are_as_exact_as_the_method(tmp_path):
    """Against a run with steps of a hundredth of the tolerance: not an interpolation between few frames."""
    system = load("pendulum")
    coarse, times = system.run(10.0, method="dop853", fps=1.0), np.linspace(0.05, 9.95, 41)
    exact = system.run(10.0, method="dop853", rtol=1e-13, atol=1e-15, t_eval=times)
    np.testing.assert_allclose(coarse(times), exact.states[1:-1], atol=2e-7)


def test_states_outside_the_run_are_refused(solution):
    with pytest.raises(RuntimeModelError, match="from 0 s to 1 s"):
        solution(1.5)


MODEL = """
[parameters]
m = "1 kg"
k = "4 N/m"
[coordinates]
x = { unit = "m", start = 1.0 }
[energy]
kinetic = "m/2*dot(x)^2"
potential = "k/2*x^2"
[run]
t_end = 1.0
"""


@pytest.fixture
def model(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spring.toml").write_text(MODEL, encoding="utf-8")
    return tmp_path


def test_commands_write_tables(model):
    done = invoke("run", "spring.toml", "--csv", "run.csv", "--parquet", "run.parquet", "--quiet")
    assert done.exit_code == 0, done.output
    names, rows = read_csv("run.csv")
    assert parquet.read_table("run.parquet").column_names == names
    x = rows[:, names.index("x")]
    np.testing.assert_allclose(x, np.cos(2.0 * rows[:, 0]), atol=1e-7)
    done = invoke("export", "spring.rrd", "--csv", "again.csv", "--parquet", "again.parquet")
    assert done.exit_code == 0 and "again.csv" in done.output
    exported, again = read_csv("again.csv")
    assert exported == ["t", "x", "dot(x)", "kinetic_energy", "potential_energy"]
    for name in exported[:3]:
        assert again[:, exported.index(name)].tolist() == rows[:, names.index(name)].tolist()
    np.testing.assert_allclose(again[:, 3:].sum(axis=1), 2.0, rtol=1e-7)


def test_tables_of_others_are_not_written_over(model):
    (model / "road.csv").write_text("t,road\n0,1\n1,2\n")
    done = invoke("run", "spring.toml", "--no-log", "--csv", "road.csv")
    assert done.exit_code == 2 and "not written over" in done.output
    assert (model / "road.csv").read_text() == "t,road\n0,1\n1,2\n"
    for _ in range(2):  # its own table may be written again
        assert invoke("run", "spring.toml", "--no-log", "--quiet", "--csv", "own.csv").exit_code == 0
    (model / "notes.parquet").write_text("mine")
    assert invoke("run", "spring.toml", "--no-log", "--parquet", "notes.parquet").exit_code == 2
    assert invoke("run", "spring.toml", "--no-log", "--csv", "spring.toml").exit_code == 2


def test_json_and_csv_go_to_standard_output(model):
    done = invoke("run", "spring.toml", "--no-log", "--json", "-")
    assert json.loads(done.stdout)["status"] == "success"
    assert "health" in done.stderr and not Path("-").exists()
    done = invoke("run", "spring.toml", "--no-log", "--quiet", "--csv", "-")
    assert done.stdout.splitlines()[0].startswith("t,x,dot(x)")
    assert invoke("run", "spring.toml", "--json", "-", "--csv", "-").exit_code == 2


def test_export_says_what_it_needs(model):
    done = invoke("export", "spring.toml")
    assert done.exit_code == 2 and "--csv FILE" in done.output
    assert invoke("export", "spring.toml", "--csv", "a.csv").exit_code == 1
