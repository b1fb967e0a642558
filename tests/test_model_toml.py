"""TOML model files: DESIGN's example reads as it says, and what is written reads back."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import sympy

from symgen import Model, atan2, cos, dot, maximum, minimum, pi, sin, sqrt, t
from symgen.errors import ModelError
from symgen.model import algebra, functions
from symgen.model.evaluate import evaluate
from symgen.model.library import bundled
from symgen.model.toml_reader import read_file, read_text

SLIDER_CRANK = """
name = "slider_crank"            # optional, the file's stem otherwise
description = "Slider-crank with a return spring and a stop"

[parameters]                     # run-time values: changing one never derives or compiles again
r = "0.1 m"       # a number, "number unit", or { value = 0.1, unit = "m", doc = "crank radius" }
l = "0.3 m"
m = "1 kg"
J = "1e-3 kg*m^2"
c = "0.1 N*m*s"
k = "20 N/m"
e = 0.6
g = "9.81 m/s^2"

[constants]                      # folded into the code at derive time; not settable at run time
x0 = "0.35 m"

[coordinates]                    # the order here is the order of q
theta = { unit = "rad", start = 0.5, rate = 20.0 }   # start, rate: enforced
phi   = { unit = "rad", guess = -0.2 }               # guess, rate_guess: assembly may move it
x     = { unit = "m", guess = 0.4 }                  # nothing given: a guess of 0

[definitions]                    # named expressions; each may use those above it
pin_x = "r*cos(theta) + l*cos(phi)"

[bodies.rod]                     # kinetic energy, gravity and the picture follow from these
mass = "m"
inertia = "J"                    # planar: about the centre of mass
com = ["r*cos(theta) + l/2*cos(phi)", "r*sin(theta) + l/2*sin(phi)"]      # 2 (the x-y plane) or 3 components
angle = "phi"                    # planar, about z
shape = { capsule = ["0.01 m", "l"] }

[gravity]
y = "-g"                         # a vector: x, y, z; none when absent

[energy]                         # extra terms, or the whole Lagrangian when there are no bodies
kinetic = "1/2*J*dot(theta)^2"
potential = "k*(x - x0)^2/2"
dissipation = "c/2*dot(theta)^2" # Rayleigh function: generalised force = -d(dissipation)/d(rate)

[forces]                         # generalised force on a coordinate
theta = "torque"

[loads.gust]                     # a force at a point, or a torque on a body (`body`, `torque`), in world axes
point = ["x", "0"]
force = ["-5 N", "0"]

[inputs]                         # control inputs: constant, table, or compiled controller at run time
torque = { unit = "N*m", default = 0.0 }

[constraints]                    # each expression is held at zero; may contain t (rheonomic)
pin_x_closes = "pin_x - x"
pin_y_closes = "r*sin(theta) + l*sin(phi)"

[velocity_constraints]           # nonholonomic: linear in the rates, held at zero
# no_slip = "dot(s) - R*dot(psi)"

[outputs]                        # sensors: computed, logged, plotted
piston_speed = "dot(x)"

[events.stop]                    # located by root finding on dense output
when = "x - 0.25"                # crossing zero
direction = "falling"            # rising, falling, both
then = { reset = { "dot(x)" = "-e*dot(x)" } }   # or "terminate", "record"

[run]                            # defaults for `symgen run`
t_end = 5.0
method = "auto"
"""


def test_design_example():
    d = read_text(SLIDER_CRANK).describe()
    r, l, m, J, c, k, e, g, x0, torque, pin_x = sympy.symbols("r l m J c k e g x0 torque pin_x")
    theta, phi, x = sympy.symbols("theta phi x")
    assert d.name == "slider_crank"
    assert [(p.name, p.value, p.unit) for p in d.parameters] == [
        ("r", 0.1, "m"),
        ("l", 0.3, "m"),
        ("m", 1.0, "kg"),
        ("J", 1e-3, "kg*m^2"),
        ("c", 0.1, "N*m*s"),
        ("k", 20.0, "N/m"),
        ("e", 0.6, None),
        ("g", 9.81, "m/s^2"),
    ]
    assert [(q.name, q.unit, q.start, q.rate, q.guess, q.rate_guess) for q in d.coordinates] == [
        ("theta", "rad", 0.5, 20.0, 0.0, 0.0),
        ("phi", "rad", None, None, -0.2, 0.0),
        ("x", "m", None, None, 0.4, 0.0),
    ]
    assert [(q.name, q.value, q.unit) for q in d.constants] == [("x0", 0.35, "m")]
    assert [(u.name, u.unit, u.default) for u in d.inputs] == [("torque", "N*m", 0.0)]
    assert d.definitions == (("pin_x", r * cos(theta) + l * cos(phi)),)
    (rod,) = d.bodies
    assert (rod.mass, rod.inertia, rod.angle, rod.planar) == (m, (J,), phi, True)
    assert rod.com == (r * cos(theta) + l / 2 * cos(phi), r * sin(theta) + l / 2 * sin(phi))
    assert (rod.shape.kind, rod.shape.sizes) == ("capsule", (sympy.Rational(1, 100), l))
    assert d.gravity == (0, -g, 0)
    assert d.kinetic == J * dot(theta) ** 2 / 2
    assert d.potential == k * (x - x0) ** 2 / 2
    assert d.dissipation == c * dot(theta) ** 2 / 2
    assert d.forces == (("theta", torque),)
    (gust,) = d.loads
    assert (gust.point, gust.force, gust.body) == ((x, 0), (-5, 0), None)
    assert [(q.name, q.expression, q.kind) for q in d.constraints] == [
        ("pin_x_closes", pin_x - x, "holonomic"),
        ("pin_y_closes", r * sin(theta) + l * sin(phi), "holonomic"),
    ]
    assert d.velocity_constraints == ()
    assert d.outputs == (("piston_speed", dot(x)),)
    (stop,) = d.events
    assert (stop.direction, stop.action, stop.when) == ("falling", "reset", x - sympy.Rational(1, 4))
    (reset,) = stop.resets
    assert (reset.target, reset.is_rate, reset.value) == ("x", True, -e * dot(x))
    assert dict(d.run) == {"t_end": 5.0, "method": "auto"}


def test_description_is_frozen():
    d = read_text(SLIDER_CRANK).describe()
    with pytest.raises(dataclasses.FrozenInstanceError):
        d.name = "other"
    with pytest.raises(TypeError):
        d.run["t_end"] = 1.0


@pytest.mark.parametrize("name", sorted(n for n, p in bundled().items() if p.suffix == ".toml"))
def test_bundled_models_round_trip(name):
    path = bundled()[name]
    model = read_file(path)
    text = model.to_toml()
    again = Model.from_toml(text, folder=path.parent)
    assert again.describe() == model.describe()
    assert again.to_toml() == text


def test_design_example_round_trips():
    model = read_text(SLIDER_CRANK)
    assert Model.from_toml(model.to_toml()).describe() == model.describe()


def _python_model():
    m = Model("tool", 'Say "no" \\ to\nstrange \x7f text', gravity=(0, 0, "-9.81 m/s^2"))
    x = m.coordinate("x", unit="m", start=0.1, rate_guess=-2)
    a, b = m.coordinate("a"), m.coordinate("b", guess="30 deg")
    k, l = m.parameters(k={"value": 2e-7, "unit": "N/m", "doc": "soft"}, l="1e30 m")
    q = m.constant("q", 1 / 3)
    F = m.input("F", unit="N", default=1e-3)
    s = m.definition("s", sqrt(x**2 + q**2) / l - (a - b) / (2 * q) + sin(-a) ** -2 - 0.5 / sqrt(x + 7))
    m.body(
        "ring",
        mass=1,
        com=(x, 0.25, s * l),
        rotation=[("z", a), ("x", b - pi / 2)],
        inertia=(1, 2, 2, 0.1, 0, 0),
    )
    m.body("bar", mass=0, com=[x, 0], angle=atan2(x, l), shape={"box": [1, 0.5, l]})
    m.kinetic(2 * dot(x) ** 2)
    m.kinetic(0.5 * dot(s * x) ** 2 * q)
    m.force(x, -abs(x) * k + F)
    m.force("x", "-1e-3*dot(x)")
    m.load("wind", point=(x, 0), force=(maximum(F, 0.5), minimum(k * x, F)))
    m.load("turn", body="ring", torque=(0, 0, "2 N*m"))
    m.velocity_constraint("roll", dot(x) - 0.5 * l * dot(a) * cos(b) + 0.1 * t)
    m.output("far", -((x**2) ** (sympy.Rational(1, 3))) * 2 ** (a / 3))
    m.event("up", when=x - 1, direction="rising", then={"reset": {dot(x): -dot(x) / 2, "a": "a - 2*pi"}})
    m.event("end", when="t - 3", then="terminate")
    m.run(t_end="2 min", at=[0.1, 1, "1 ms"], method="radau5", fps=50, rtol=1e-6)
    return m


def test_python_model_round_trips():
    model = _python_model()
    d, again = model.describe(), Model.from_toml(model.to_toml())
    e = again.describe()
    assert again.to_toml() == Model.from_toml(again.to_toml()).to_toml()
    for name in ("name", "description", "coordinates", "parameters", "constants", "inputs", "run"):
        assert getattr(d, name) == getattr(e, name)
    assert d.run["t_end"] == 120.0
    assert d.run["at"] == (0.1, 1.0, 1e-3)
    values = {"x": 0.3, "a": 0.7, "b": -0.4, "k": 2.0, "l": 1.5, "q": 0.25, "F": 3.0, "t": 2.0, "s": 0.9}
    pairs = list(zip(_values(d, values), _values(e, values), strict=True))
    assert len(pairs) == 38
    for left, right in pairs:
        assert left == pytest.approx(right, rel=1e-14)


def _values(d, values):
    """Every expression of a description as a number; rates are given values of their own."""
    from symgen.model.items import definition_items, items

    for item in (*definition_items(d), *items(d)):
        x, a = algebra.Symbol("x"), algebra.Symbol("a")
        rates = {node: x * 3 + a for node in item.expression.atoms(functions.dot)}
        yield evaluate(item.expression.xreplace(rates), values)


def test_name_defaults_to_the_stem(tmp_path):
    text = SLIDER_CRANK.replace('name = "slider_crank"', "")
    for stem, name in (
        ("crank", "crank"),
        ("my-crank 2", "my_crank_2"),
        ("2crank", "model_2crank"),
        ("class", "model_class"),
    ):
        path = tmp_path / f"{stem}.toml"
        path.write_text(text)
        assert read_file(path).describe().name == name
        assert Model.from_toml(path).describe().folder == tmp_path
        assert Model.from_toml(str(path)).name == name


def test_files_that_cannot_be_read(tmp_path):
    path = tmp_path / "a.toml"
    with pytest.raises(ModelError, match="cannot be read"):
        read_file(path)
    path.write_bytes(b"name = '\xff'")
    with pytest.raises(ModelError, match="UTF-8"):
        read_file(path)
    path.write_bytes(b"#" * (5 << 20))
    with pytest.raises(ModelError, match="larger than 4 MiB"):
        read_file(path)
    with pytest.raises(ModelError, match="cannot be read"):
        read_file(tmp_path)


def test_windows_line_ends_and_byte_order_mark(tmp_path):
    path = tmp_path / "crank.toml"
    path.write_bytes(b"\xef\xbb\xbf" + SLIDER_CRANK.replace("\n", "\r\n").encode())
    assert read_file(path).describe().bodies == read_text(SLIDER_CRANK).describe().bodies


MESH = SLIDER_CRANK.replace('capsule = ["0.01 m", "l"]', 'mesh = "parts/rod.stl"')


def test_mesh_below_the_folder(tmp_path):
    path = tmp_path / "crank.toml"
    path.write_text(MESH)
    with pytest.raises(ModelError, match="is not there"):
        read_file(path)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "rod.stl").write_text("solid")
    d = read_file(path).describe()
    assert (d.bodies[0].shape.mesh, d.folder) == ("parts/rod.stl", tmp_path)
    assert 'mesh = "parts/rod.stl"' in read_file(path).to_toml()


def test_mesh_that_leads_away(tmp_path):
    folder, outside = tmp_path / "model", tmp_path / "secret.stl"
    (folder / "parts").mkdir(parents=True)
    outside.write_text("solid")
    (folder / "parts" / "rod.stl").symlink_to(outside)
    path: Path = folder / "crank.toml"
    path.write_text(MESH)
    with pytest.raises(ModelError, match="leads out"):
        read_file(path)


def test_frames_are_written_as_they_were_given():
    m = Model("frames")
    a = m.parameter("a", "0.3 rad")
    m.constant("c", 0.5)
    m.body("b", mass=1, inertia=[1, 1, 1])
    m.joint("j", "free", "b")
    m.point("tip", "b", (0, 0.1, 0))
    m.frame("tilted", "b", axis=("c", 1, 0), angle="20 deg")
    m.frame("turned", "b", axis=np.array([0.0, 0.0, 1.0]), angle=2 * a)
    m.frame("halved", "b", quaternion=(0.6, 0.8, 0, 0))
    m.frame("aimed", "b", x="tip", y=(1, 0, 0))
    m.frame("rolled", "b", rpy=(0.1, 0, 0))
    text = m.to_toml()
    for line in (
        'axis = ["c", 1, 0]\nangle = "20 deg"', 'axis = [0.0, 0.0, 1.0]\nangle = "2*a"',
        "quaternion = [0.6, 0.8, 0, 0]", 'x = "tip"\ny = [1, 0, 0]', "rpy = [0.1, 0, 0]",
    ):  # fmt: skip
        assert line in text
    again = Model.from_toml(text)
    assert again.to_toml() == text and again.describe() == m.describe()
