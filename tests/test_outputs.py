"""No output of a command is written over a file that it reads, or over a file of another kind."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from symgen.cli import main
from symgen.runtime import load
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.plain_text import plain, shortened
from symgen.runtime.report.html import page, paragraph

ROOT = Path(__file__).parents[1]
MODEL = """
name = "m"
[coordinates]
x = { start = 1.0 }
[inputs]
F = { table = "push.txt" }
[energy]
kinetic = "dot(x)^2/2"
potential = "x^2/2"
[forces]
x = "F"
[run]
t_end = 0.5
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("m.toml").write_text(MODEL)
    Path("push.txt").write_text("0 0\n1 1\n")
    Path("x.py").write_text(
        "from symgen import Model, dot\ndef build():\n    m = Model('x')\n    x = m.coordinate('x', start=1.0)\n"
        "    m.kinetic(dot(x)**2/2)\n    return m\n"
    )
    return tmp_path


def symgen(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def links(folder):
    """Other names of the model: a symbolic link, a hard link, a way round."""
    (folder / "soft").symlink_to("m.toml")
    os.link(folder / "m.toml", folder / "hard")
    os.link(folder / "push.txt", folder / "table")
    (folder / "below").mkdir()
    (folder / "m.rrd").symlink_to("m.toml")
    (folder / "m_report.html").symlink_to("push.txt")


COLLISIONS = [
    ("derive", "x.py", "-o", "."),
    ("run", "m.toml", "--log", "m.toml"),
    ("run", "m.toml", "--log", "soft"),
    ("run", "m.toml", "--log", "hard"),
    ("run", "m.toml"),
    ("run", "m.toml", "--no-log", "--json", "m.toml"),
    ("run", "m.toml", "--no-log", "--json", "below/../hard"),
    ("run", "m.toml", "--no-log", "--json", "push.txt"),
    ("run", "m.toml", "--no-log", "--json", "table"),
    ("run", "m.toml", "--no-log", "--input", "F=push.txt", "--json", "table"),
    ("run", "m.toml", "--log", "o", "--json", "o"),
    ("run", "m.toml", "--log", "o", "--json", "./o"),
    ("run", "m.toml", "--log", "o.csv"),
    ("report", "m.toml", "--quick", "--html", "m.toml"),
    ("report", "m.toml", "--quick"),
    ("check", "m.toml", "--json", "soft"),
    ("check", "m.toml", "--plot", "hard"),
    ("modes", "m.toml", "--json", "hard"),
    ("modes", "m.toml", "--log", "soft"),
    ("advise", "m.toml", "--json", "hard"),
    ("run", "pendulum", "--no-log", "--json", "hard"),
    ("run", "pendulum", "--no-log", "--json", "soft"),
    ("run", "pendulum", "--log", "table"),
]


@pytest.mark.parametrize("command", COLLISIONS, ids=" ".join)
def test_what_a_command_reads_is_never_written_over(folder, command):
    links(folder)
    before = contents(folder)
    done = symgen(*command)
    assert done.exit_code == 2, done.output
    assert "Error:" in done.output and "internal" not in done.output
    assert contents(folder) == before


def test_recordings_are_written_over_by_nothing_but_their_own_next_part(folder):
    assert symgen("run", "m.toml", "--log", "a.rrd", "--quiet").exit_code == 0
    before = contents(folder)
    os.link("a.rrd", "same")
    for command in (
        ("verify", "a.rrd", "--json", "same"),
        ("compare", "a.rrd", "a.rrd", "--json", "same"),
        ("run", "--resume", "a.rrd", "--t-end", "1", "--json", "same"),
        ("report", "a.rrd", "--quick", "--html", "same"),
        ("advise", "--at", "a.rrd@0.1", "--json", "same"),
    ):
        done = symgen(*command)
        assert done.exit_code == 2, (command, done.output)
        assert (folder / "a.rrd").read_bytes() == before["a.rrd"]
    (folder / "a.resumed.rrd").write_text("mine")
    done = symgen("run", "--resume", "a.rrd", "--t-end", "1", "--quiet")
    assert done.exit_code == 0, done.output
    assert (folder / "a.resumed.rrd").read_text() == "mine"


def test_a_module_takes_the_place_of_modules_only(folder):
    assert symgen("derive", "m.toml", "-o", ".", "--quiet").exit_code == 0
    assert symgen("derive", "m.toml", "-o", ".", "--quiet").exit_code == 0
    Path("m.py").write_text("precious = 1\n")
    done = symgen("derive", "m.toml", "-o", ".", "--quiet")
    assert done.exit_code == 2 and "no generated module" in done.output
    assert Path("m.py").read_text() == "precious = 1\n"


def test_read_only_files_and_full_disks_leave_what_was_there(folder):
    target = folder / "r.json"
    target.write_text("before")
    if Path("/dev/full").exists():
        done = symgen("run", "m.toml", "--no-log", "--json", "/dev/full", "--quiet")
        assert done.exit_code == 1 and "No space left" in done.output
        done = symgen("run", "m.toml", "--log", "/dev/full", "--quiet")
        assert done.exit_code == 1 and "internal" not in done.output and "/dev/full" in done.output
    if os.geteuid() != 0:
        target.chmod(0o400)
        assert symgen("run", "m.toml", "--no-log", "--json", target, "--quiet").exit_code == 1
        assert target.read_text() == "before"


@pytest.mark.parametrize("name", ["x.csv", "x.toml", "x.rrd.txt", "x.json"])
def test_a_solution_is_saved_as_a_recording_only(tmp_path, name):
    solution = load((ROOT / "generated" / "pendulum.py").read_text()).run(t_end=0.1)
    with pytest.raises(RuntimeModelError, match=r"a recording is an \.rrd file"):
        solution.save(tmp_path / name)
    assert not (tmp_path / name).exists()


# Text as it is shown

HOSTILE = "a\x1b[31mred\x07\x9b2J\u202eevil\u2066\u200bname\x00\x7f"


def test_nothing_that_is_shown_carries_escapes():
    shown = plain(HOSTILE)
    assert all(0x20 <= ord(x) < 0x7F for x in shown)
    assert r"\x1b[31mred\x07\x9b2J\u202eevil" in shown
    assert plain("µ ≤ ½ — naïve\tüñ\n") == "µ ≤ ½ — naïve\tüñ\n"
    assert "\x1b" not in page("x", [paragraph(HOSTILE)])
    assert len(shortened("x" * 10**6)) < 500 and shortened("a b") == "a b"


@pytest.mark.parametrize("command", ["show", "run", "list"])
def test_names_and_descriptions_reach_the_terminal_as_plain_text(folder, command):
    escaped = HOSTILE.replace("\x00", "").encode("unicode_escape").decode().replace("\\x", "\\u00")
    Path("d.toml").write_text(f'description = "{escaped}"\n{MODEL}')
    Path("e.toml").write_text(f'{MODEL}\n["{escaped}"]\n')
    for model in ("d.toml", "e.toml", HOSTILE.replace("\x00", "")):
        done = symgen(*([command] if command == "list" else [command, model]))
        assert not any((ord(x) < 0x20 and x not in "\n\t") or 0x7F <= ord(x) < 0xA0 for x in done.output)
        assert not any(x in done.output for x in "\u202e\u2066\u200b")


def test_long_arguments_are_cut(folder):
    done = symgen("run", "m.toml", "--no-log", "--set", "a" * 100_000 + "=1")
    assert done.exit_code == 2 and len(done.output) < 2000


# Input that has no end

REFUSED = {
    "a device as a table": ("run", "m.toml", "--no-log", "--input", "F=/dev/zero"),
    "a pipe as a table": ("run", "m.toml", "--no-log", "--input", "F=pipe"),
    "a pipe as a model": ("run", "pipe.toml"),
    "a device as a model": ("run", "zero.toml"),
    "a key of 20 000 parts": ("run", "deep.toml"),
    "a device as a recording": ("verify", "/dev/zero"),
    "a pipe as a recording": ("verify", "pipe"),
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes by name here")
@pytest.mark.parametrize("command", REFUSED.values(), ids=REFUSED)
def test_input_without_end_is_refused_in_time_by_name(folder, command):
    for name in ("pipe", "pipe.toml"):
        os.mkfifo(name)
    Path("zero.toml").symlink_to("/dev/zero")
    Path("deep.toml").write_text(MODEL + "[x]\n" + "a." * 20_000 + "b = 1\n")
    code = "import sys; from symgen.cli import main; main(sys.argv[1:])"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code, *command], capture_output=True, text=True, timeout=60, env=environment
    )
    name = command[-1].removeprefix("F=")
    assert done.returncode == 1 and "internal" not in done.stderr, done.stderr
    assert name in done.stderr
