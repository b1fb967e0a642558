"""Models of the cases: bundled ones, small ones made here, and modules that somebody has edited."""

from __future__ import annotations

import functools
import re
from pathlib import Path

from symgen import Model, cos, dot, runtime
from symgen.link import module_for
from symgen.model.library import find

FIXTURES = Path(__file__).parents[1] / "fixtures"


@functools.cache
def bundled(name: str, **options: str) -> runtime.System:
    """Return a bundled model."""
    return runtime.load(_text(name, **options))


@functools.cache
def fixture(name: str) -> runtime.System:
    """Return a module of tests/fixtures."""
    return runtime.load(FIXTURES / f"{name}.py")


@functools.cache
def point(force: str = "0", potential: str = "0", rest: str = "", **parameters: float) -> runtime.System:
    """Return a mass of 1 kg on the x axis, under a force and in a potential."""
    lines = "".join(f"{name} = {value}\n" for name, value in parameters.items())
    text = (
        f'name = "point"\n[parameters]\nm = 1.0\n{lines}[coordinates]\nx = {{ start = 0.1, rate = 0.0 }}\n'
        f'[bodies.bob]\nmass = "m"\ncom = ["x", 0]\n[energy]\npotential = "{potential}"\n'
        f'[forces]\nx = "{force}"\n{rest}\n'
    )
    return Model.from_toml(text).derive()


@functools.cache
def far() -> runtime.System:
    """Return a pendulum whose height is measured from 1 km away."""
    model = Model("far")
    a = model.coordinate("a", start=0.2)
    model.kinetic(dot(a) ** 2 / 2)
    model.potential(9.81 * (1000 - cos(a)))
    return model.derive()


@functools.cache
def pair(wall: float = 1.0, coupling: float = 1.0) -> runtime.System:
    """Return two masses of 1 kg, each on a spring to the wall and coupled by a third."""
    model = Model("pair")
    x, y = model.coordinate("x", start=0.1), model.coordinate("y", start=0.0)
    k_wall, k_coupling = model.parameters(k_wall=wall, k_coupling=coupling)
    model.kinetic((dot(x) ** 2 + dot(y) ** 2) / 2)
    model.potential(k_wall * (x**2 + y**2) / 2 + k_coupling * (x - y) ** 2 / 2)
    return model.derive()


@functools.cache
def rod(second: str = "") -> runtime.System:
    """Return a pendulum in x and y, with a second constraint."""
    text = (
        'name = "rod"\n[parameters]\nl = 1.0\n[coordinates]\nx = { start = 0.6 }\ny = { guess = -0.8 }\n'
        '[bodies.bob]\nmass = 1\ncom = ["x", "y"]\n[gravity]\ny = -9.81\n'
        f'[constraints]\nrod = "x^2 + y^2 - l^2"\n{second}\n'
    )
    return Model.from_toml(text).derive()


@functools.cache
def edited(name: str, function: str, index: int, to: str) -> runtime.System:
    """Return a bundled model with one result of one function changed: `to` has the old expression as {}."""
    before, marker, rest = _text(name).partition(f"\ndef {function}(")
    body, end, after = rest.partition("\n@njit")
    pattern = re.compile(rf"^(    out\[{index}\] = )(.*)$", re.MULTILINE)
    changed, n = pattern.subn(lambda found: found[1] + to.format(f"({found[2]})"), body)
    if n != 1:
        raise ValueError(f"{name}.{function} writes out[{index}] {n} times")
    return runtime.load(before + marker + changed + end + after)


def _text(name: str, **options: str) -> str:
    return module_for(Path(find(name)), options).text
