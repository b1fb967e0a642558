"""Energy scaling of constrained conservative motion: what it gains, when it is on, and that checks stay honest."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from symgen.link import derive
from symgen.model.toml_reader import read_text
from symgen.runtime import load
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

ROOT = Path(__file__).parents[1]
PENDULUM = """
name = "swing"
[parameters]
m = 1.0
c = 0.0
torque = 0.0
[coordinates]
x = { start = 1.0 }
y = { guess = 0.0 }
angle = { guess = 0.3 }
[bodies.bob]
mass = "m"
com = ["x", "y"]
[bodies.wheel]
inertia = 0.2
mass = 0
com = ["0", "0"]
angle = "angle"
[gravity]
y = -9.81
[constraints]
rod = "x^2 + y^2 - 1"
gear = "angle - 0.3*x"
"""


def model(name):
    return load(ROOT / "generated" / f"{name}.py")


def swing(more=""):
    return derive(read_text(PENDULUM + more))


def end_error(solution, reference):
    assert solution.status == "success", solution.message
    return np.abs(solution.q[-1] - reference.q[-1]).max()


@pytest.mark.parametrize(
    ("name", "t_end"), [("slider_crank", 10.0), ("four_bar", 10.0), ("andrews_squeezer", 0.03)]
)
@pytest.mark.parametrize("method", [name for name, method in METHODS.items() if method.scales_energy])
def test_errors_are_smaller_by_far(name, t_end, method):
    system = model(name)
    reference = system.run(t_end=t_end, method="dop853", rtol=1e-13, atol=1e-14, energy_scaling=False)
    scaled, plain = (
        system.run(t_end=t_end, method=method, rtol=1e-8, atol=1e-8, energy_scaling=wanted)
        for wanted in (None, False)
    )
    low = METHODS[method].order <= 5
    gain = (1.5 if name == "andrews_squeezer" else 4.0) if low else 8.0
    assert gain * end_error(scaled, reference) < end_error(plain, reference)
    assert scaled.stats["steps"] < 1.05 * plain.stats["steps"]


@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_what_was_taken_away_is_the_error_that_the_run_would_have(method):
    options = {"t_end": 10.0, "method": method, "rtol": 1e-6, "atol": 1e-6}
    scaled = model("slider_crank").run(**options)
    plain = model("slider_crank").run(**options, energy_scaling=False)
    assert plain.energy.taken == 0.0 and not any("energy scaling" in note for note in plain.notes)
    assert any(note.startswith("energy scaling: on") for note in scaled.notes)
    assert plain.energy.max_error / 8.0 < scaled.energy.taken < 8.0 * plain.energy.max_error
    assert scaled.energy.max_error < scaled.energy.taken
    says = next(check for check in scaled.health if check.check == "energy")
    assert says.value == scaled.energy.unscaled_error == scaled.energy.taken
    assert "without energy scaling" in says.says


def test_a_run_that_is_too_coarse_still_fails_its_energy_check():
    solution = model("slider_crank").run(t_end=10.0, method="dop853", rtol=1e-2, atol=1e-2)
    plain = model("slider_crank").run(t_end=10.0, method="dop853", rtol=1e-2, atol=1e-2, energy_scaling=False)
    verdicts = [
        next(check.ok for check in run.health if check.check == "energy") for run in (solution, plain)
    ]
    assert verdicts == [False, False]


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ('[forces]\nangle = "-0.1*dot(angle)"\n', "not by constant forces only"),
        ('[forces]\nangle = "0.1*sin(3*t)"\n', "depends on time"),
        ('[energy]\ndissipation = "dot(x)^2"\n', "not by constant forces only"),
    ],
)
def test_models_that_it_does_not_suit_are_left_alone(more, reason):
    system = swing(more)
    assert system.run(t_end=0.2, method="dop853").energy.taken == 0.0
    with pytest.raises(RuntimeModelError, match=reason):
        system.run(t_end=0.2, method="dop853", energy_scaling=True)


@pytest.mark.parametrize(
    ("name", "options", "reason"),
    [
        ("pendulum", {"method": "dop853"}, "has no constraints"),
        (
            "slider_crank",
            {"method": "rk4"},
            "only bs32, dopri5, dop853, taylor, radau5, radau9, radau13 have it",
        ),
        ("slider_crank", {"method": "dop853", "constraints": "baumgarte"}, "with constraints 'projection'"),
        ("car_axis", {"method": "dop853"}, "depends on time"),
    ],
)
def test_what_cannot_be_scaled_is_refused_with_the_reason(name, options, reason):
    with pytest.raises(RuntimeModelError, match=reason):
        model(name).run(t_end=0.01, energy_scaling=True, **options)


def test_the_work_of_constant_forces_counts():
    system = swing('[forces]\nangle = "0.7"\n')
    solution = system.run(t_end=3.0, method="dop853", rtol=1e-7, atol=1e-7)
    assert solution.energy.taken > 0.0 and solution.energy.max_error < 1e-6
    assert np.ptp(solution.energy.total) > 0.1


def test_after_a_reset_the_new_energy_is_kept():
    """A bob that loses energy where it passes the lowest point; its energy between is that after the reset."""
    system = swing(
        '[events.bottom]\nwhen = "x"\ndirection = "falling"\nthen = { reset = { "dot(x)" = "0.6*dot(x)" } }\n'
    )
    solution = system.run(t_end=3.0, method="dop853", rtol=1e-7, atol=1e-7, fps=100)
    assert [event.name for event in solution.events] and solution.status == "success"
    assert solution.energy.taken > 0.0
    for event, end in zip(solution.events, [*[e.t for e in solution.events[1:]], 3.0], strict=True):
        between = (solution.t > event.t) & (solution.t < end)
        assert np.ptp(solution.energy.total[between]) < 1e-5
    assert solution.energy.total[-1] < solution.energy.total[0] - 0.5
    assert solution.energy.max_error < 1e-6


def test_the_command_line_switches_it_off(tmp_path):
    from click.testing import CliRunner

    from symgen.cli import main

    found = []
    for more in ([], ["--no-energy-scaling"]):
        file = tmp_path / "result.json"
        result = CliRunner().invoke(
            main, ["run", "pendulum_dae", "--t-end", "2", "--no-log", "--json", str(file), *more]
        )
        assert result.exit_code == 0, result.output
        found.append(any("energy scaling" in note for note in json.loads(file.read_text())["notes"]))
    assert found == [True, False]
