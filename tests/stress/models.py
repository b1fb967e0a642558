"""Models of the scenarios, derived once in a process (and once on a machine, where they are bundled)."""

from __future__ import annotations

import functools
from pathlib import Path

from symgen import Model, runtime
from symgen.link import derive_text, module_for
from symgen.model.library import find
from symgen.model.toml_reader import read_text

POINT = """
name = "{name}"
[parameters]
m = 1.0
{parameters}
[coordinates]
x = {{ start = {start}, rate = {rate} }}
[bodies.bob]
mass = "m"
com = ["x", 0]
[forces]
x = "{force}"
{rest}
[run]
t_end = 1.0
"""


@functools.cache
def bundled_text(name: str, **options: str) -> str:
    """Return the module of a bundled model."""
    return module_for(Path(find(name)), options).text


@functools.cache
def described_text(text: str) -> str:
    """Return the module of a TOML text."""
    return derive_text(read_text(text, file="stress.toml")).text


@functools.cache
def bundled(name: str, **options: str) -> runtime.System:
    """Return a bundled model."""
    return runtime.load(bundled_text(name, **options))


@functools.cache
def described(text: str) -> runtime.System:
    """Return the model of a TOML text."""
    return runtime.load(described_text(text))


def made(model: Model) -> runtime.System:
    """Return a model as something that runs."""
    return runtime.load(derive_text(model).text)


def point(
    name: str, force: str, start: float = 1.0, rate: float = 0.0, rest: str = "", **parameters: float
) -> runtime.System:
    """Return a unit mass on a line under a force that is an expression of x, dot(x) and t."""
    values = "\n".join(f"{key} = {value!r}" for key, value in parameters.items())
    return described(
        POINT.format(name=name, parameters=values, start=start, rate=rate, force=force, rest=rest)
    )
