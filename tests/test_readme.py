"""README is true: its commands are CI's, its model gives the printed output, its Python runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from symgen.cli import main

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_test_command_is_what_ci_runs():
    _, tests = blocks("sh")
    assert tests.strip() in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


def test_model_gives_the_printed_output(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (model,) = blocks("toml")
    (tmp_path / "swing.toml").write_text(model, encoding="utf-8")
    (console,) = blocks("console")
    commands = re.split(r"^\$ symgen ", console, flags=re.MULTILINE)[1:]
    for text in commands:
        command, *expected = text.strip("\n").split("\n")
        result = CliRunner().invoke(main, command.split())
        assert result.exit_code == 0, result.output
        printed = result.stdout.strip("\n").split("\n")
        assert len(printed) == len(expected)
        for got, wanted in zip(printed, expected, strict=True):
            if "…" in wanted:
                assert got.startswith(wanted.split("…")[0].rstrip())
            else:
                assert got == wanted
    function = blocks("python")[0]
    assert function in (tmp_path / "swing.py").read_text(encoding="utf-8")


def test_python_face_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(blocks("python")[1], "README.md", "exec"), {})
    theta, error = map(float, capsys.readouterr().out.split())
    assert theta == pytest.approx(1.00417, abs=1e-4)
    assert error < 1e-8
    assert (tmp_path / "cart_pole.rrd").stat().st_size > 10_000
