"""The command line: exit statuses, messages, files, and what the light path imports."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner, Result

from symgen.cli import main
from symgen.runtime.quantities import in_si

ROOT = Path(__file__).resolve().parents[1]
ROD = """
[parameters]
l = "0.5 m"
[constants]
g = "9.81 m/s^2"
[coordinates]
x = { unit = "m", start = 0.3 }
y = { unit = "m", guess = -0.3 }
[inputs]
push = { unit = "N", default = 0.0 }
[bodies.bob]
mass = "1 kg"
com = ["x", "y"]
[gravity]
y = "-g"
[forces]
x = "push"
[constraints]
rod = "x^2 + y^2 - l^2"
[events.low]
when = "y + 0.45"
direction = "falling"
then = "record"
[run]
t_end = 1.0
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rod.toml").write_text(ROD)
    return tmp_path


def symgen(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments), prog_name="symgen")


def assert_fails(result: Result, status: int, *texts: str) -> None:
    assert result.exit_code == status, result.output
    for text in texts:
        assert text in result.stderr
    assert "Traceback" not in result.output


def test_help_names_every_command():
    result = symgen("--help")
    assert result.exit_code == 0
    for name in ("list", "show", "derive", "run", "advise", "check", "play", "verify"):
        assert f"  {name}" in result.output
        assert symgen(name, "--help").exit_code == 0


def test_list_has_a_line_for_each_model():
    lines = symgen("list").output.splitlines()
    models = {path.stem for path in (ROOT / "models").glob("*.[tp][oy]*") if not path.name.startswith("_")}
    assert {line.split()[0] for line in lines} == models
    assert all(len(line.split()) > 2 for line in lines)


def test_run_writes_result(folder):
    result = symgen(
        "run", "rod.toml", "--no-log", "--json", "out.json", "--at", "0.25,0.5", "--set", "l=0.6 m"
    )
    assert result.exit_code == 0, result.output
    data = json.loads((folder / "out.json").read_text())
    assert (data["model"], data["status"], data["t"], data["constraints"]) == (
        "rod",
        "success",
        1.0,
        "projection",
    )
    assert [sample["t"] for sample in data["samples"]] == [0.25, 0.5]
    for state in (data, *data["samples"]):
        x, y = state["coordinates"]["x"], state["coordinates"]["y"]
        vx, vy = state["rates"]["x"], state["rates"]["y"]
        assert x * x + y * y == pytest.approx(0.36, abs=1e-13)
        # Along the rod: a = lambda grad(Phi)/m + g, and r.a = -v^2.
        assert 2 * 0.36 * state["multipliers"]["rod"] == pytest.approx(9.81 * y - vx**2 - vy**2, rel=1e-9)
    assert data["energy"]["initial"] == pytest.approx(-9.81 * (0.36 - 0.09) ** 0.5, rel=1e-12)
    assert data["events"] == [] or data["events"][0]["name"] == "low"
    assert not list(folder.glob("*.rrd"))
    for text in ("rod: success", "method   taylor", "assembly moved y", "health", "time     derive"):
        assert text in result.output


def test_quiet_prints_nothing():
    result = symgen("run", "rod.toml", "--no-log", "--quiet")
    assert (result.exit_code, result.output) == (0, "")


def test_fixed_step_that_is_too_long_exits_with_3(folder):
    result = symgen("run", "rod.toml", "--no-log", "--method", "rk4", "--step", "0.3", "--json", "out.json")
    assert_fails(result, 3, "Not to be trusted: energy", "It may be because of: resolution")
    health = json.loads((folder / "out.json").read_text())["health"]
    assert [(entry["ok"], entry["note"]) for entry in health if entry["check"] == "resolution"] == [
        (True, True)
    ]


@pytest.mark.parametrize("quiet", [(), ("--quiet",)])
def test_what_is_not_to_be_trusted_is_said_once(quiet):
    result = symgen("run", "rod.toml", "--no-log", "--method", "rk4", "--step", "0.3 s", *quiet)
    assert result.output.count("Not to be trusted") == 1 and result.output.count("It may be because of") == 1
    (said,) = re.findall(r"Not to be trusted: energy: (.*?)(?:;|\n)", result.stderr) if quiet else [None]
    assert ("energy balance is off" in said) if quiet else ("energy balance" not in result.stderr)
    assert result.output.count("the energy balance is off") == 1


def test_times_are_quantities_too(folder):
    result = symgen(
        "run", "rod.toml", "--no-log", "--json", "o.json", "--t-end", "500 ms", "--at", "0.1,200 ms, 0.3 s",
        "--method", "rk4", "--step", "1 ms",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    data = json.loads((folder / "o.json").read_text())
    assert (data["t"], data["stats"]["steps"]) == (0.5, 501)  # one of them ends at the event
    assert [sample["t"] for sample in data["samples"]] == [0.1, 0.2, 0.3]


def test_start_and_rate_take_quantities(folder):
    result = symgen(
        "run", "rod.toml", "--no-log", "--json", "o.json", "--start", "x=30 cm", "--rate", "dot(x)=100 mm/s",
        "--at", "0", "--set", "push=0.001 kN",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    first = json.loads((folder / "o.json").read_text())["samples"][0]
    assert (first["coordinates"]["x"], first["rates"]["x"]) == (0.3, 0.1)
    assert first["coordinates"]["y"] == pytest.approx(-0.4, rel=1e-14)
    assert first["rates"]["y"] == pytest.approx(0.3 * 0.1 / 0.4, rel=1e-13)


def test_contradictory_start_exits_with_1():
    result = symgen("run", "rod.toml", "--no-log", "--start", "x=0.3", "--start", "y=-0.45")
    assert_fails(result, 1, "'rod' cannot hold", "x = 0.3, y = -0.45")


def test_zeno_exits_with_1(folder):
    result = symgen("run", "bouncing_ball", "--t-end", "10", "--no-log", "--json", "o.json", "--set", "e=0.5")
    assert_fails(result, 1, "'bounce' repeats at ever shorter intervals")
    assert json.loads((folder / "o.json").read_text())["status"] == "zeno"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--set", "g=9.8"], "'g' is a constant"),
        (["--set", "g=9.8"], "not settable"),
        (["--set", "length=1"], "no parameter or input 'length'"),
        (["--set", "pusch=1"], "did you mean 'push'?"),
        (["--set", "x=1"], "use --start or --rate"),
        (["--start", "l=1"], "'l' is a parameter: use --set"),
        (["--start", "z=1"], "no coordinate 'z'"),
        (["--set", "l=5 N"], "--set l=5 N: the unit N does not fit m"),
        (["--set", "l=5 N"], "against m"),
        (["--set", "l=5 parsec"], "'parsec' is not a unit"),
        (["--set", "l=long"], "neither a number nor a quantity"),
        (["--set", "l"], "not of the form NAME=VALUE"),
        (["--set", "l=1", "--set", "l=2"], "gives 'l' twice"),
        (["--set", "l=1e999"], "outside the range"),
        (["--method", "dop835"], "did you mean 'dop853'?"),
        (["--method", "dop853", "--step", "0.1"], "chooses its own steps"),
        (["--rtol", "-1"], "not a finite number above zero"),
        (["--t-end", "soon"], "neither a number nor a quantity"),
        (["--t-end", "2 N"], "the unit N does not fit s"),
        (["--t-end", "-2 s"], "not a finite number above zero"),
        (["--at", "1 m"], "not a list of times"),
        (["--at", "0.5,2"], "2 s is outside the run"),
        (["--no-log", "--play"], "contradict each other"),
        (["--json", "nowhere/o.json"], "does not exist"),
        (["--colour"], "No such option"),
    ],
)
def test_wrong_usage_exits_with_2(arguments, text):
    assert_fails(symgen("run", "rod.toml", *arguments), 2, text)


@pytest.mark.parametrize("command", ["run", "show", "derive", "advise", "check"])
def test_unknown_model(command):
    assert_fails(
        symgen(command, "slider_cranc"), 1, "no bundled model 'slider_cranc'", "did you mean 'slider_crank'?"
    )
    assert_fails(symgen(command, "nothing.toml"), 1, "nothing.toml", "does not exist")


def test_broken_model_names_the_place(folder):
    (folder / "rod.toml").write_text(ROD.replace("x^2 + y^2", "x^2 + why^2"))
    assert_fails(symgen("run", "rod.toml", "--no-log"), 1, "rod.toml", "rod", "why", "column 7")


def test_unknown_command():
    assert_fails(symgen("rum"), 2, "No such command 'rum'")


def test_internal_error_is_a_sentence(monkeypatch):
    from symgen.cli import run

    def broken(*arguments, **options):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(run, "simulate", broken)
    result = symgen("run", "rod.toml", "--no-log")
    assert_fails(
        result, 1, "internal error: ZeroDivisionError: division by zero; please report", "SYMGEN_TRACEBACK=1"
    )
    monkeypatch.setenv("SYMGEN_TRACEBACK", "1")
    assert isinstance(symgen("run", "rod.toml", "--no-log").exception, ZeroDivisionError)


def test_derive_writes_module_and_figures(folder):
    result = symgen("derive", "rod.toml", "-o", "out", "--json", "figures.json")
    assert result.exit_code == 0, result.output
    assert "2 coordinates, 1 holonomic constraints" in result.output
    text = (folder / "out" / "rod.py").read_text()
    assert "def mass_matrix(t, y, p, out):" in text
    figures = json.loads((folder / "figures.json").read_text())
    assert set(figures) == {"operations", "once", "code", "seconds", "structure"}
    assert figures["operations"]["constraint_jacobian"] >= 2 and figures["structure"]["nh"] == 1
    again = symgen("derive", "rod.toml", "-o", "again", "--quiet")
    assert (again.exit_code, again.output) == (0, "")
    assert (folder / "again" / "rod.py").read_text() == text


def test_derive_passes_build_options(folder):
    assert symgen("derive", "n_pendulum", "--option", "N=3", "-o", ".").exit_code == 0
    assert '"nq": 3' in (folder / "n_pendulum.py").read_text()
    assert_fails(symgen("derive", "n_pendulum", "--option", "M=3"), 1, "no option 'M'")


def test_show():
    result = symgen("show", "rod.toml")
    assert result.exit_code == 0, result.output
    for text in ("rod  0 =  x^2 + y^2 - l^2", "G[rod, x]", "=  2*x", "l  0.5 m", "push  0 N", "start 0.3"):
        assert text.replace(" ", "") in result.output.replace(" ", "")
    latex = symgen("show", "double_pendulum", "--latex")
    assert latex.exit_code == 0, latex.output
    assert r"\dot{" in latex.output and r"\cos{\left(" in latex.output
    assert "too long to be read" in symgen("show", "n_pendulum", "--option", "N=20").output


@pytest.mark.parametrize("model", ["double_pendulum", "four_bar", "active_suspension"])
def test_documents_compile(folder, model):
    text = symgen("show", model, "--latex").output
    assert text.count("\\begin{") == text.count("\\end{") and text.count("{") == text.count("}")
    if shutil.which("pdflatex") is None:
        return  # what can be seen without is above
    Path("document.tex").write_text(text, encoding="utf-8")
    run = ["pdflatex", "-halt-on-error", "-interaction=nonstopmode", "document.tex"]
    found = subprocess.run(run, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)
    assert found.returncode == 0, found.stdout[-2000:]
    assert Path("document.pdf").read_bytes().startswith(b"%PDF")
    wide = [float(points) for points in re.findall(r"Overfull \\hbox \(([\d.]+)pt", found.stdout)]
    assert not wide or max(wide) < 5


def test_advise():
    result = symgen("advise", "pendulum", "--json", "advice.json")
    assert result.exit_code == 0, result.output
    for text in ("fastest time scale", "recommended method: taylor, because", "rk4: step", "stable up to"):
        assert text in result.output
    assert json.loads(Path("advice.json").read_text())["fastest"] > 0


def test_check():
    result = symgen(
        "check", "pendulum", "--method", "rk4", "--step", "0.01", "--t-end", "1", "--json", "c.json"
    )
    assert result.exit_code == 0, result.output
    levels = json.loads(Path("c.json").read_text())["levels"]
    assert levels[1]["order"] == pytest.approx(4, abs=0.2)
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        return
    assert Path("pendulum_check.png").read_bytes().startswith(b"\x89PNG")


def test_check_that_does_not_settle_exits_with_3():
    result = symgen("check", "pendulum", "--method", "euler", "--step", "0.05", "--t-end", "20")
    assert result.exit_code == 3 and "not to be trusted" in result.output


def test_recording_is_written_and_verified(folder):
    result = symgen("run", "rod.toml", "--fps", "50")
    assert result.exit_code == 0, result.output
    assert (folder / "rod.rrd").is_file() and "recorded rod.rrd" in result.output
    result = symgen("verify", "rod.rrd", "--json", "report.json")
    assert result.exit_code == 0, result.output
    report = json.loads((folder / "report.json").read_text())
    assert report["ok"] and report["complete"] and report["frames"] == 51
    assert_fails(symgen("verify", "nothing.rrd"), 1, "nothing.rrd")
    assert_fails(symgen("play", "rod.toml"), 1, "rod.toml")


def test_value_of_quantities():
    assert in_si("0.2", "rad", "") == 0.2
    assert in_si("0.2 rad", "rad", "") == 0.2
    assert in_si("180 deg", "rad", "") == pytest.approx(3.141592653589793, rel=1e-15)
    assert in_si("-1.5e1mm", "m", "") == -0.015
    assert in_si("5 N", "", "") == 5.0
    assert in_si("3 m/s^2", "m/s^2", "") == 3.0


def _process(*arguments: str, code: str = "", **options) -> subprocess.Popen:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    program = code or "from symgen.cli import main; main(prog_name='symgen')"
    return subprocess.Popen(
        [sys.executable, "-c", program, *arguments],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


def test_light_path_imports_only_what_it_uses():
    assert symgen("run", "pendulum", "--no-log", "--quiet").exit_code == 0  # derived and cached from here on
    code = (
        "import sys; from symgen.cli import main\n"
        "try: main(prog_name='symgen')\n"
        "finally: print(*{'sympy', 'rerun', 'pyarrow', 'matplotlib', 'rich'} & set(sys.modules))"
    )
    process = _process("run", "pendulum", "--no-log", "--quiet", code=code)
    output, errors = process.communicate(timeout=300)
    assert (process.returncode, output.strip()) == (0, ""), errors


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
def test_interrupt_keeps_the_recording(folder):
    from symgen.runtime.recording.reader import read_recording

    process = _process("run", "double_pendulum", "--t-end", "1e7", "--fps", "0.001", "--log", "cut.rrd")
    deadline = time.monotonic() + 300
    while not (folder / "cut.rrd").is_file() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.1)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "nterrupted" in errors and "Traceback" not in errors
    assert read_recording(folder / "cut.rrd").status == "interrupted"


def test_too_many_frames_are_refused(folder):
    result = symgen("run", "pendulum", "--t-end", "1", "--fps", "1e12")
    assert_fails(result, 1, "fps is 1e+12", "smaller fps")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a folder in which nobody can write")
def test_recording_that_cannot_be_written(monkeypatch):
    monkeypatch.chdir("/proc")
    assert_fails(symgen("run", "pendulum", "--t-end", "1"), 1, "pendulum.rrd")


def test_verify_of_a_folder(folder):
    assert_fails(symgen("verify", str(folder)), 1, "folder")


def test_new_writes_a_model_that_runs_and_is_found_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runner = CliRunner()
    assert runner.invoke(main, ["new", "first"]).exit_code == 0
    done = runner.invoke(main, ["run", "first", "--no-log"])
    assert done.exit_code == 0 and "first: success" in done.stdout
    text = (tmp_path / "first.toml").read_text(encoding="utf-8")
    for name, says in (
        ("first", "there already"),
        ("nul", "device"),
        ("pendulum", "bundled"),
        ("a b", "not a name"),
    ):
        refused = runner.invoke(main, ["new", name])
        assert refused.exit_code == 2 and says in refused.stderr
    assert (tmp_path / "first.toml").read_text(encoding="utf-8") == text


def test_a_name_of_two_models_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pendulum.toml").write_text("[coordinates]\nx = 1\n")
    done = CliRunner().invoke(main, ["show", "pendulum"])
    assert done.exit_code == 1 and "is a bundled model, and 'pendulum.toml' is a file here" in done.stderr


def test_a_python_model_is_not_executed_without_its_suffix(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text("raise SystemExit('executed')\n")
    done = CliRunner().invoke(main, ["show", "mine"])
    assert done.exit_code == 1 and "executed" not in done.stderr


def test_list_as_data():
    rows = json.loads(CliRunner().invoke(main, ["list", "--json", "-"]).stdout)
    assert {"name", "description", "file"} == set(rows[0]) and all(row["description"] for row in rows)


@pytest.mark.skipif(os.name == "nt", reason="pipes of a shell")
def test_a_reader_that_leaves_is_no_failure():
    program = f"{sys.executable} -c \"from symgen.cli import main; main(prog_name='symgen')\""
    command = f"set -o pipefail; {program} list | head -1 && {program} list --json - | head -1"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0 and "Traceback" not in done.stderr


def test_a_recording_that_cannot_be_compared_is_no_difference(tmp_path):
    (tmp_path / "a.rrd").write_text("nothing")
    done = CliRunner().invoke(main, ["compare", str(tmp_path / "a.rrd"), str(tmp_path / "a.rrd")])
    assert done.exit_code == 2 and done.stderr.startswith("Error: ")


@pytest.mark.parametrize(
    "words, begun, some",
    [
        ([], "ver", {"verify"}),
        (["run"], "double", {"double_pendulum", "double_pendulum_level"}),
        (["run"], "mi", {"mine.toml"}),
        (["run", "pendulum", "--method"], "dop", {"dopri5", "dop853"}),
        (["show"], "bri", {"bricard"}),
    ],
)
def test_the_shell_completes(tmp_path, monkeypatch, words, begun, some):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").touch()
    shell = ShellComplete(main, {}, "symgen", "_SYMGEN_COMPLETE")
    assert {item.value for item in shell.get_completions(words, begun)} == some


BEGIN = '[coordinates]\nx = { start = 1.0%s }\n[energy]\nkinetic = "dot(x)^2/2"\npotential = "%s"\n'


@pytest.mark.parametrize(
    "text, says",
    [
        (BEGIN % ("", "x^2 + 0.3 m"), "'0.3 m' is a number with a unit inside an expression"),
        (BEGIN % ("", "x^2") + "[inputs]\ntau = { value = 0.5 }\n", "did you mean 'default'"),
        (BEGIN % (", initial = 2", "x^2"), "did you mean 'start'"),
        (BEGIN % ("", "x^2") + '[parameters]\nk = "3 metre"\n', "did you mean 'm'"),
    ],
)
def test_hints_say_what_was_meant(tmp_path, monkeypatch, text, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    done = CliRunner().invoke(main, ["show", "own"])
    assert done.exit_code == 1 and says in done.stderr and "own.toml" in done.stderr


@pytest.mark.parametrize("library", ["numpy", "math"])
def test_functions_of_numbers_hint_at_those_of_expressions(tmp_path, library):
    program = (
        "from symgen import Model\nimport {0}\ndef build():\n    m = Model('q')\n    x = m.coordinate('x')\n"
        "    m.kinetic('dot(x)^2/2')\n    m.potential({0}.sin(x))\n    return m\n"
    )
    (tmp_path / "q.py").write_text(program.format(library), encoding="utf-8")
    done = CliRunner().invoke(main, ["show", str(tmp_path / "q.py")])
    assert done.exit_code == 1 and "line 7" in done.stderr and "as symgen.sin" in done.stderr


def test_a_start_that_contradicts_names_the_model_even_where_its_name_is_a_letter(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = BEGIN % ("", "x^2") + '[constraints]\nclosed = "x - 2"\n'
    (tmp_path / "c.toml").write_text(text, encoding="utf-8")
    done = CliRunner().invoke(main, ["run", "c", "--no-log", "--t-end", "1"])
    assert done.exit_code == 1 and "Error: c: constraint 'closed'" in done.stderr


def test_the_time_line_counts_the_compilation_of_step_loops(monkeypatch):
    from symgen.cli.run import _seconds

    run = SimpleNamespace(seconds={"prepare": 0.5, "compile": 2.0, "run": 1.0})
    assert _seconds(run, 0.25, None) == {"derive": 0.25, "compile": 2.5, "run": 1.0, "log": 0.0}


def test_a_plot_without_matplotlib_is_refused_before_the_work(tmp_path, monkeypatch):
    import importlib.util

    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "matplotlib" else find(name)
    )
    monkeypatch.setattr("symgen.cli.check.study", lambda *_: 1 / 0)
    done = CliRunner().invoke(main, ["check", "pendulum", "--plot", str(tmp_path / "a.png")])
    assert done.exit_code == 2 and "symgen[figures]" in done.stderr


def test_what_assembly_moved_has_digits_that_differ():
    from symgen.runtime.constraints.start_values import moved_notes

    assert moved_notes([("x", 1.0, 1.0 + 1e-11), ("y", 0.0, 0.5)]) == [
        "assembly moved x from 1 to 1.00000000001",
        "assembly moved y from 0 to 0.5",
    ]
