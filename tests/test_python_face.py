"""What users hold in Python: signatures, quantities as text, models by name."""

from __future__ import annotations

import inspect
import math
import os
import typing
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest

import symgen
from symgen import runtime
from symgen.errors import ModelError
from symgen.runtime import RunOptions, System, linear, solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.quantities import in_si

FIXTURES = Path(__file__).parent / "fixtures"


@pytest.fixture(scope="module")
def pendulum() -> System:
    return runtime.load(FIXTURES / "pendulum.py")


def parameters(function, n_first: int) -> list[tuple]:
    found = list(inspect.signature(function).parameters.values())[n_first:]
    return [(x.name, x.default, x.annotation) for x in found]


@pytest.mark.parametrize("function", [System.run, solve])
def test_signatures_are_those_of_the_record_of_options(function):
    asked = [(x.name, x.default, x.type) for x in fields(RunOptions)]
    assert all(default is not MISSING for _, default, _ in asked)
    assert parameters(function, 1) == asked


def test_every_option_arrives(monkeypatch, pendulum):
    arrived = []
    monkeypatch.setattr(
        "symgen.runtime.simulate.simulate", lambda system, asked: arrived.append(asked) or 1 / 0
    )
    values = {x.name: object() for x in fields(RunOptions)}
    monkeypatch.setattr(RunOptions, "__post_init__", lambda self: None)
    with pytest.raises(ZeroDivisionError):
        pendulum.run(**values)
    assert {name: getattr(arrived[0], name) for name in values} == values


@pytest.mark.parametrize("method", [System.linearise, System.modes])
def test_signatures_of_linear_analysis_are_those_of_linearise(method):
    assert parameters(method, 1) == parameters(linear.linearise, 1)


def test_no_public_method_hides_its_options():
    for kind in (System, runtime.Solution):
        for name, member in vars(kind).items():
            if not name.startswith("_") and inspect.isfunction(member):
                kinds = {x.kind for x in inspect.signature(member).parameters.values()}
                assert inspect.Parameter.VAR_KEYWORD not in kinds, name


def test_types_are_there_for_checkers():
    assert (Path(symgen.__file__).parent / "py.typed").is_file()
    assert "return" in typing.get_type_hints(RunOptions.for_model, vars(runtime) | {"System": System})


@pytest.mark.parametrize(
    "text, unit, value",
    [
        ("0.2", "rad", 0.2),
        ("-1.5e1mm", "m", -0.015),
        (" 180 deg ", "rad", math.pi),
        ("3*m/s^2", "m/s^2", 3.0),
        ("60 rpm", "rad/s", 2 * math.pi),
        ("5 N", "", 5.0),
        (7, "m", 7.0),
    ],
)
def test_quantities(text, unit, value):
    assert in_si(text, unit, "x") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    "text, says",
    [
        ("5 N", "does not fit m"),
        ("long", "neither a number nor a quantity such as '0.2 m'"),
        ("5 metres", "did you mean 'm'?"),
        ("3 Newton", "did you mean 'N'?"),
        ("1e999", "outside the range"),
        ([1.0], "a list is neither"),
    ],
)
def test_wrong_quantities_are_explained(text, says):
    with pytest.raises(RuntimeModelError, match=f"^l: .*{says}") as caught:
        in_si(text, "m", "l")
    assert isinstance(caught.value, ValueError)


def test_a_run_takes_quantities_where_a_model_file_does(pendulum):
    texts = pendulum.run(
        "0.5 s", parameters={"l": "50 cm"}, start={"theta": "20 deg"}, rate={"theta": "6 rpm"}, method="rk4",
        step="10 ms", at=["250 ms"],
    )  # fmt: skip
    numbers = pendulum.run(
        0.5, parameters={"l": 0.5}, start={"theta": math.radians(20.0)}, rate={"theta": math.pi / 5}, method="rk4",
        step=0.01, at=[0.25],
    )  # fmt: skip
    np.testing.assert_allclose(texts.states, numbers.states, rtol=1e-14)
    assert texts.samples[0].t == 0.25 and texts.p.tolist() == numbers.p.tolist()


def test_inputs_take_quantities():
    system = runtime.load(FIXTURES / "oscillator.py")
    (force,) = (record for record in system.inputs)
    unit = force["unit"] or "N"
    assert system.parameter_values({force["name"]: f"2500 m{unit}"})[-1] == 2.5
    run = system.run(0.1, inputs={force["name"]: f"2500 m{unit}"})
    assert run["force"].tolist() == [2.5] * len(run.t)


def test_an_option_of_the_wrong_dimension_is_named(pendulum):
    with pytest.raises(RuntimeModelError, match="t_end: the unit m does not fit s"):
        pendulum.run("3 m")
    with pytest.raises(RuntimeModelError, match="rate theta: the unit deg does not fit rad/s"):
        pendulum.run(1.0, rate={"theta": "3 deg"})


def test_frames_at_given_times_change_no_step(pendulum):
    times = [0.3, 0.1, "0.7 s"]
    chosen = pendulum.run(1.0, method="dop853", t_eval=times)
    usual = pendulum.run(1.0, method="dop853", fps=10.0)
    assert chosen.t.tolist() == [0.0, 0.1, 0.3, 0.7, 1.0]
    assert chosen.stats == usual.stats
    places = np.searchsorted(usual.t, chosen.t - 1e-12)
    np.testing.assert_allclose(chosen.states, usual.states[places], rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize(
    "options, says",
    [({"t_eval": [2.0]}, "outside the run"), ({"t_eval": [0.1], "fps": 3.0}, "give one of them")],
)
def test_wrong_frames_are_refused(pendulum, options, says):
    with pytest.raises(RuntimeModelError, match=says):
        pendulum.run(1.0, **options)


def test_models_are_loaded_by_name_and_by_file(tmp_path):
    bundled = symgen.load("pendulum")
    path = tmp_path / "own.toml"
    path.write_text(
        '[coordinates]\nx = { start = 1.0 }\n[energy]\nkinetic = "dot(x)^2/2"\npotential = "x^2/2"\n'
    )
    own = symgen.load(path)
    assert (bundled.name, own.name) == ("pendulum", "own")
    assert isinstance(own, System) and symgen.load(os.fspath(path)).name == "own"
    assert symgen.load("n_pendulum", N=3).nv == 3
    with pytest.raises(ModelError, match=r"did you mean 'pendulum'"):
        symgen.load("pendulun")
    with pytest.raises(ModelError, match="no option 'M'"):
        symgen.load("n_pendulum", M=3)
