"""Progress of a run: what the line says, and that the energy error that it shows is that of the run."""

from __future__ import annotations

from pathlib import Path

import pytest

from symgen.cli.recorded import progress_line
from symgen.runtime import load, solve

FIXTURES = Path(__file__).parent / "fixtures"


class Watcher:
    def watch(self, run):
        self.run, self.errors = run, []

    def __call__(self, t, steps):
        self.errors.append((t, self.run.energy_error()))


@pytest.mark.parametrize("method", ["euler", "dop853"])
def test_energy_error_on_the_way_is_that_of_the_solution(method):
    watcher = Watcher()
    options = {"step": 0.01} if method == "euler" else {}
    run = solve(load(FIXTURES / "pendulum.py"), 3.0, method=method, progress=watcher, **options)
    t, error = watcher.errors[-1]
    balance = run.energy.balance
    assert t == run.t[-1]
    # Some of the frames tell what was exchanged on the way.
    exchanged = run.energy.exchange.size
    assert error == pytest.approx(abs(balance[-1] - balance[0]) / exchanged, rel=0.01, abs=1e-15)


def test_line():
    line = progress_line(3.0, 1.0, 5.0, 1200, 0.5, 2.5e-9)
    assert "50%" in line and "t = 3 of 5 s" in line and "4 x real time" in line
    assert "1200 steps" in line and "energy error 2.5e-09" in line and "##########.........." in line
    assert "energy" not in progress_line(3.0, 1.0, 5.0, 1, 0.5, None)
