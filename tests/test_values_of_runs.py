"""Parameters of runs that the model's description would not allow: refused by name, in one run and in many."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from click.testing import CliRunner

import symgen
from symgen import Model, link, runtime
from symgen.cli import main
from symgen.runtime.errors import ModuleError, RuntimeModelError

TUBE = """
[parameters]
R = "0.1 m"
r = "0.08 m"
f = "3 N"
s = "4 N"
k = "10 N/m"

[coordinates]
x = { unit = "m", rate = 1 }

[bodies.b]
shape = { tube = ["R", "r", "0.3 m"] }
density = "7850 kg/m^3"
com = ["x", 0]
angle = 0

[springs.s]
points = [["x", 0], [0, 0]]
stiffness = "k"
length = 0

[friction.rub]
coordinate = "x"
force = "f"
static = "s"
"""


@pytest.fixture
def tube(tmp_path):
    file = tmp_path / "tube.toml"
    file.write_text(TUBE)
    return file


@pytest.mark.parametrize(
    "given, words",
    [
        (
            "r=0.2",
            "[bodies.b] shape.tube, element 2: the inner radius 0.2 m is not below the outer one, 0.1 m",
        ),
        ("R=-1", "[bodies.b] shape.tube, element 1: the size is not positive"),
        ("s=2", "[friction.rub] static: it is 2 at the parameters' values, less than while it slides, 3"),
        ("f=-1", "[friction.rub] force: the friction is negative"),
        ("k=-1", "[springs.s] stiffness: the stiffness is negative"),
    ],
)
def test_a_run_is_refused_as_the_file_would_be(given, words, tube):
    result = CliRunner().invoke(main, ["run", str(tube), "--t-end", "0.1", "--no-log", "--set", given])
    assert result.exit_code == 1
    assert f"{tube}, {words}" in result.output
    name, value = given.split("=")
    with pytest.raises(RuntimeModelError) as error:
        symgen.load(tube).run(t_end=0.1, parameters={name: float(value)})
    assert words in str(error.value)
    assert (
        CliRunner()
        .invoke(main, ["run", str(tube), "--t-end", "0.1", "--no-log", "--set", "r=0.09"])
        .exit_code
        == 0
    )


WRONG = {
    "r": (0.2, "bodies.b.shape.tube[1]: it is 0.2 at the parameters' values, and has to be below 0.1"),
    "R": (-1.0, "bodies.b.shape.tube[0]: it is -1 at the parameters' values, and has to be positive"),
    "s": (2.0, "friction.rub.static: it is 2 at the parameters' values, and has to be at least 3"),
    "f": (-1.0, "friction.rub.force: it is -1 at the parameters' values, and has to be zero or more"),
    "k": (-1.0, "springs.s.stiffness: it is -1 at the parameters' values, and has to be zero or more"),
}


def test_a_module_without_its_description_refuses_the_same():
    whole = Model.from_toml(TUBE).derive()
    bare = runtime.load(link.derive_text(Model.from_toml(TUBE)).text)
    for system in (bare, pickle.loads(pickle.dumps(whole))):
        for name, (value, words) in WRONG.items():
            with pytest.raises(RuntimeModelError) as error:
                system.run(t_end=0.1, parameters={name: value})
            assert words in str(error.value)
        assert system.run(t_end=0.1, parameters={"r": 0.09, "k": 0.0}).ok
    values = np.array([0.05, 0.12, 0.09, 0.3])
    many = bare.ensemble(t_end=0.1, parameters={"r": values}, method="dop853")
    np.testing.assert_array_equal(many.failed, [1, 3])


LIMITED = """
[parameters]
m = 1.0
xy = 0.06
low = -1.0
high = 1.0
e = 0.5
radius = 0.2
c = 1.0

[constants]
two = 2.0

[definitions]
moment = "two*m*radius^2"

[coordinates]
q = { unit = "rad", start = 0.1 }
x = { start = 0.1 }

[bodies.arm]
mass = "m"
com = [0, 0, 0.1]
inertia = ["moment", "moment", 0.5, "xy", 0, 0]

[bodies.block]
mass = "c - 0.5*m"
com = ["x", 0, 0]
shape = { sphere = ["radius"] }

[joints.hinge]
type = "revolute"
parent = "world"
child = "arm"
axis = [0, 1, 0]
coordinate = "q"
limits = ["low", "high"]
restitution = "e"
damping = "c"
"""


def test_limits_of_a_module_are_what_its_description_is_checked_by():
    """Of random parameters, those that the description refuses are those that the module does."""
    model = Model.from_toml(LIMITED)
    bare = runtime.load(link.derive_text(model).text)
    rng, names = np.random.default_rng(0), [p["name"] for p in bare.parameters]
    rows = bare.parameter_values()[: len(names)] * rng.uniform(-0.3, 2.5, (300, len(names)))
    padded = np.hstack([rows, np.tile(bare.parameter_values()[len(names) :], (len(rows), 1))])
    vet = model.values_of_runs()()
    told = [bool(vet.fault(dict(zip(names, row.tolist(), strict=True)))) for row in rows]
    found = bare.beyond_limits(padded)
    assert sorted(found) == np.flatnonzero(told).tolist()
    assert len({fault.split(":")[0] for fault in found.values()}) >= 5  # places that come first


@pytest.mark.parametrize("record", ['"name": "a b", "bound": "zero"', '"name": "a", "bound": "big"'])
def test_a_wrong_limit_of_a_module_is_refused(record):
    text = link.derive_text(Model.from_toml(TUBE)).text
    first = text[text.index('"limits": [') :].split("{")[1].split("}")[0]
    with pytest.raises(ModuleError, match=r"limits\[0\]"):
        runtime.load(text.replace(first, record))


@pytest.mark.parametrize("method", ["dop853", "auto"])  # in lanes, and as `auto` has it
def test_members_are_refused_one_by_one(method):
    m = Model("tube")
    m.parameters(R="0.1 m", r="0.08 m")
    x = m.coordinate("x", unit="m", rate=1.0)
    m.body("b", mass=1, inertia=1, com=(x, 0), angle=0, shape={"tube": ["R", "r", 0.3]})
    outer, inner = np.random.default_rng(1).uniform(0.05, 0.2, (2, 200))
    found = m.derive().ensemble(t_end=0.1, parameters={"R": outer, "r": inner}, method=method)
    np.testing.assert_array_equal(found.failed, np.flatnonzero(inner >= outer))
    refused = found.messages[int(np.argmax(inner >= outer))]
    assert "model 'tube', body('b') shape.tube, element 2: the inner radius" in refused


def test_friction_that_becomes_negative_on_the_way_is_told():
    m = Model("m")
    x = m.coordinate("x", unit="m", rate=1.0)
    m.body("b", mass=1, com=(x, 0))
    m.friction("rub", coordinate="x", force="0.5 - 1.0*t")
    run = m.derive().run(t_end=1.0, method="dop853")
    entry = next(entry for entry in run.health if entry.check == "friction")
    assert not entry.ok and entry.value == pytest.approx(-0.5)
    assert "rub" in entry.says
    assert all(e.check != "friction" for e in m.derive().run(t_end=0.4, method="dop853").health)


def test_sines_and_magnitudes_go_together_in_lanes():
    m = Model("m")
    x = m.coordinate("x", unit="m", start=0.3)
    m.parameter("k", 3.0)
    m.body("b", mass=1, com=(x, 0))
    m.force(x, "-k*sin(3*x)*abs(x + 2)")
    system, values = m.derive(), [3.0, 3.5, 4.0]
    for method in ("dop853", "taylor"):
        many = system.ensemble(t_end=1.0, parameters={"k": values}, method=method, rtol=1e-10)
        for value, x in zip(values, many["x"], strict=True):
            alone = system.run(t_end=1.0, parameters={"k": value}, method="radau5", rtol=1e-10)
            assert np.ravel(x)[-1] == pytest.approx(alone["x"][-1], abs=1e-8)
