"""`symgen new`: a commented model that runs."""

from __future__ import annotations

from pathlib import Path

import click

from symgen.cli.files import CarefulCommand, claim, write_text
from symgen.cli.terminal import say
from symgen.model.library import bundled
from symgen.model.names import model_name_fault

_TEMPLATE = """description = "Pendulum on a spring-held cart"   # what `symgen list` and reports show

# Numbers with units; `symgen run NAME --set l="80 cm"` changes them for one run. Deriving again is not needed.
[parameters]
M = "2 kg"
m = { value = 0.5, unit = "kg", doc = "the bob" }
l = "0.6 m"
k = "30 N/m"
d = "0.4 N*s/m"
g = "9.81 m/s^2"

# What moves. `start` and `rate` are kept; with `guess` instead, assembly may move a value.
[coordinates]
x = { unit = "m", start = 0.0 }
theta = { unit = "rad", start = "30 deg" }

# Bodies give kinetic energy, weight and picture: a mass, and where its centre is.
[bodies.cart]
mass = "M"
com = ["x", "0 m"]
shape = { box = ["0.3 m", "0.15 m", "0.15 m"] }

[bodies.bob]
mass = "m"
com = ["x + l*sin(theta)", "-l*cos(theta)"]
shape = { sphere = ["0.06 m"] }

[gravity]
y = "-g"

# Springs are potentials, linear dampers are dissipation functions.
[energy]
potential = "k/2*x^2"
dissipation = "d/2*dot(x)^2"

# What pushes from outside: a number here, a table or a controller in a run (docs/inputs.md).
[inputs]
push = { unit = "N", default = 0.0 }

[forces]
x = "push"

# What is computed along, recorded and plotted.
[outputs]
spring_force = "-k*x"

[run]
t_end = "5 s"

# Loops are closed by [constraints], joints of trees stand in [joints], what happens at a moment in [events]:
# docs/reference.md has every table and key.
"""


@click.command("new", cls=CarefulCommand)
@click.argument("name")
def command(name: str) -> None:
    """Write NAME.toml, a commented model that runs, in this folder."""
    stem = name.removesuffix(".toml")
    fault = model_name_fault(stem)
    if fault is not None:
        raise click.UsageError(f"{fault}: take another name")
    if stem in bundled():
        raise click.UsageError(f"{name!r} is a bundled model (`symgen show {stem}`): take another name")
    path = Path(f"{stem}.toml")
    if path.exists():
        raise click.UsageError(f"{path} is there already: take another name")
    write_text(claim("the model", path), _TEMPLATE.replace("NAME", stem))
    say(f"wrote {path}: symgen run {stem}, symgen play {stem}.rrd, symgen show {stem}")
