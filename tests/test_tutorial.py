"""docs/tutorial.md and docs/course.md: commands and programs run, and print what is there."""

from __future__ import annotations

import re
import shlex
from fnmatch import fnmatchcase
from pathlib import Path

from click.testing import CliRunner

from symgen.cli import main

DOCS = Path(__file__).resolve().parents[1] / "docs"


def matches(printed: list[str], expected: list[str]) -> bool:
    """Whether lines are those expected; a line of … stands for any number of lines."""
    if not expected:
        return not printed
    if expected[0].strip() == "…":
        return any(matches(printed[k:], expected[1:]) for k in range(len(printed) + 1))
    pattern = re.sub(r"([\[\]*?])", r"[\1]", expected[0]).replace("…", "*")
    return bool(printed) and fnmatchcase(printed[0], pattern) and matches(printed[1:], expected[1:])


def run_page(name: str, capsys) -> list[tuple[str, str]]:
    """Run commands and programs in their order, and return what each printed; all programs share their names."""
    text, names, done = (DOCS / name).read_text(encoding="utf-8"), {}, []
    blocks = re.findall(r"^```(console|python|text)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    for (kind, body), (after, expected) in zip(blocks, [*blocks[1:], ("", "")]):
        if kind == "console":
            command, _, output = body.removeprefix("$ symgen ").partition("\n")
            done.append((command, run_command(command, output.rstrip("\n").split("\n"))))
        elif kind == "python":
            capsys.readouterr()
            exec(compile(body, name, "exec"), names)
            done.append((body, capsys.readouterr().out))
            if after == "text":
                assert done[-1][1] == expected
        elif all(line.startswith("not ok: ") for line in expected_lines(body)):
            # A part of what the command before it prints.
            assert [line for line in expected_lines(body) if line not in done[-1][1]] == []
    return done


def expected_lines(text: str) -> list[str]:
    return text.rstrip("\n").split("\n")


def run_command(command: str, expected: list[str]) -> str:
    done = CliRunner().invoke(main, shlex.split(command))
    if re.fullmatch(r"\d", expected[0]):
        assert done.exit_code == int(expected[0]), (command, done.output)
    else:
        assert done.exit_code == 0, done.output
        assert matches(expected_lines(done.stdout), expected), (command, done.stdout)
    return done.stdout


def test_commands_of_the_tutorial(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    *commands, (_, printed) = run_page("tutorial.md", capsys)
    assert len(commands) >= 7
    assert "<Solution of 'swing': success" in printed
    assert (tmp_path / "swing_80.csv").is_file()


def test_the_course(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    done = run_page("course.md", capsys)
    assert len(done) >= 18
    assert (tmp_path / "euler.html").is_file()
    explained = next(printed for command, printed in done if "rk4 --step 0.001" in command)
    assert "not ok: blow-up: dot(z_mount)" in explained
