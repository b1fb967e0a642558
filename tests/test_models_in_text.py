"""Models whose expressions are all text: their methods return names, and nothing needs SymPy."""

from __future__ import annotations

import subprocess
import sys

import pytest

from symgen import Model
from symgen.link import derive_text


def pendulum(model: Model) -> Model:
    theta = model.coordinate("theta", start=0.1)
    m, l = model.parameters(m="1 kg", l="0.5 m")
    model.body("bob", mass=m, com=(f"{l}*sin({theta})", f"-{l}*cos({theta})"))
    return model


def test_methods_return_names():
    model = Model("pendulum", gravity=(0, "-9.81 m/s^2")).in_text()
    assert (model.coordinate("x"), model.parameter("k", 1.0)) == ("x", "k")
    assert model.point("tip") == ("tip_x", "tip_y", "tip_z")
    assert model.joint("hinge", "revolute", "world", "arm") == "hinge"


def test_the_module_is_that_of_symbols():
    texts = [derive_text(pendulum(made)).text for made in (Model("pendulum").in_text(), Model("pendulum"))]
    assert texts[0] == texts[1]


def test_names_stay_text_behind_what_reads_a_file():
    model = Model("two").in_text()
    with model._reading():
        assert model.coordinate("x") != "x"
    assert model.coordinate("y") == "y"


@pytest.mark.parametrize("name", ["chain_absolute", "quadruped", "stewart_on_bushings"])
def test_bundled_models_in_text_leave_sympy_alone(name):
    statement = (
        "import sys; from symgen.model.library import find, load; load(find(sys.argv[1])).describe(); "
        "assert 'sympy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", statement, name], check=True)
