"""docs/tutorial.md and docs/coming-from.md: commands run and print what is there, models and programs run."""

from __future__ import annotations

import re
import shlex
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from symgen import Model
from symgen.cli import main

DOCS = Path(__file__).resolve().parents[1] / "docs"
TUTORIAL = (DOCS / "tutorial.md").read_text(encoding="utf-8")
COMING = (DOCS / "coming-from.md").read_text(encoding="utf-8")


def matches(printed: list[str], expected: list[str]) -> bool:
    """Whether lines are those expected; a line of … stands for any number of lines."""
    if not expected:
        return not printed
    if expected[0].strip() == "…":
        return any(matches(printed[k:], expected[1:]) for k in range(len(printed) + 1))
    pattern = re.sub(r"([\[\]*?])", r"[\1]", expected[0]).replace("…", "*")
    return bool(printed) and fnmatchcase(printed[0], pattern) and matches(printed[1:], expected[1:])


def test_commands_of_the_tutorial(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```console\n\$ symgen (.*?)\n(.*?)```", TUTORIAL, re.DOTALL)
    assert len(blocks) >= 7
    for command, output in blocks:
        done = CliRunner().invoke(main, shlex.split(command))
        expected = output.rstrip("\n").split("\n")
        if re.fullmatch(r"\d", expected[0]):
            assert done.exit_code == int(expected[0]), command
            continue
        assert done.exit_code == 0, done.output
        assert matches(done.stdout.rstrip("\n").split("\n"), expected), (command, done.stdout)
    (program,) = re.findall(r"```python\n(.*?)```", TUTORIAL, re.DOTALL)
    exec(compile(program, "tutorial.md", "exec"), {})
    assert "<Solution of 'swing': success" in capsys.readouterr().out
    assert (tmp_path / "swing_80.csv").is_file()


def models() -> dict[str, str]:
    sections = re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", COMING, re.DOTALL | re.MULTILINE)
    return {
        f"{title}-{k}": text
        for title, section in sections
        for k, text in enumerate(re.findall(r"```toml\n(.*?)```", section, re.DOTALL))
    }


@pytest.mark.parametrize("name", models())
def test_models_of_the_page_for_newcomers_run(name):
    solution = Model.from_toml(models()[name]).derive().run(0.5)
    assert solution.ok, [entry.says for entry in solution.objections]


def test_the_same_pendulum_in_sympy_mechanics_has_the_same_accelerations():
    """The program of the page, which SymPy runs, against the model beside it."""
    (program,) = [x for x in re.findall(r"```python\n(.*?)```", COMING, re.DOTALL) if "KanesMethod" in x]
    names: dict = {}
    exec(compile(program, "coming-from.md", "exec"), names)
    system = Model.from_toml(next(iter(models().values()))).derive()
    p, values = system.parameter_values(), np.random.default_rng(0).normal(size=(5, 2))
    by_name = {record["name"]: record["value"] for record in system.parameters}
    for theta, omega in values:
        mine = system.kernel("rhs")(0.0, [theta, omega], p)[1]
        assert names["acceleration"](theta, omega, by_name) == pytest.approx(mine, rel=1e-12)
