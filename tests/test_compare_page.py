"""docs/compare.md: what it says of this program is run, row by row."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

import symgen
from symgen.cli import main

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "compare.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.split("|")[1:-1]] for line in PAGE.splitlines() if line.startswith("| ")
]
# Shown in a window, of a file that a user has, or on a device: tests/test_viewer.py, test_urdf.py, test_gpu.py.
ELSEWHERE = ("symgen play p.rrd", "symgen import", "symgen sweep MODEL --device cuda")
NEEDS = {"to_dataframe": "pandas", "plot": "matplotlib"}


def test_every_cell_is_filled():
    assert len(ROWS) > 20
    assert all(len(row) == len(ROWS[0]) == 8 and all(row) for row in ROWS)


@pytest.mark.parametrize("row", ROWS[1:], ids=[row[0] for row in ROWS[1:]])
def test_what_is_here_runs(row, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = re.findall(r"`([^`]+)`(?: \((\d)\))?", row[1])
    assert bool(found) == (not row[1].startswith(("no", "MIT")))
    for command, status in found:
        if command.startswith(ELSEWHERE):
            continue
        if command.startswith("symgen "):
            done = CliRunner().invoke(main, shlex.split(command.removeprefix("symgen ")))
            assert done.exit_code == int(status or 0), done.output
            continue
        for name, package in NEEDS.items():
            if name in command:
                pytest.importorskip(package)
        system = symgen.load("pendulum")
        names = {"symgen": symgen, "system": system, "solution": system.run("1 s")}
        assert eval(command, names) is not None
