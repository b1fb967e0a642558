"""Wrong model files: each is refused with the file, the place, the cause and the remedy."""

import pickle

import pytest

from symgen import Model
from symgen.errors import ModelError, SymgenError
from symgen.model.toml_reader import read_text

GOOD = """
name = "crane"
description = "A crab on a rail with a hanging load"

[parameters]
m = "2 kg"
J = "1e-3 kg*m^2"
l = "0.3 m"
c = { value = 0.1, unit = "N*s/m", doc = "friction" }
g = "9.81 m/s^2"
e = 0.6

[constants]
x0 = "0.35 m"

[coordinates]
x = { unit = "m", start = 0.1 }
phi = { unit = "rad", guess = -0.2 }

[inputs]
F = { unit = "N" }

[definitions]
px = "x + l*sin(phi)"
vx = "dot(px)"

[bodies.crab]
mass = "m"
com = ["x", "0"]

[bodies.hook]
mass = "m"
inertia = "J"
com = ["px", "-l*cos(phi)"]
angle = "phi"
shape = { capsule = ["0.01 m", "l"] }

[gravity]
y = "-g"

[energy]
potential = "m*g*x0"
dissipation = "c/2*dot(x)^2"

[forces]
x = "F"

[loads.gust]
point = ["x", "0"]
force = ["-5 N", "0"]

[loads.twist]
body = "hook"
torque = "0.1 N*m"

[constraints]
rail = "x - x0*cos(phi)"

[outputs]
speed = "vx"

[events.stop]
when = "x - 0.25"
direction = "falling"
then = { reset = { "dot(x)" = "-e*dot(x)" } }

[run]
t_end = 5.0
method = "auto"
"""

# name: (what is replaced, by what, table, key, column, words of the message or hint)
WRONG = {
    "misspelt table": ("[forces]", "[force]", None, "force", None, "did you mean 'forces'"),
    "unknown top key": ('name = "crane"', 'title = "crane"', None, "title", None, "unknown key 'title'"),
    "unknown body key": (
        'mass = "m"\ncom = ["x"',
        'masss = "m"\ncom = ["x"',
        "bodies.crab",
        "masss",
        None,
        "'mass'",
    ),
    "unknown coordinate key": ("guess = -0.2", "gues = -0.2", "coordinates", "phi.gues", None, "'guess'"),
    "unknown parameter key": (
        "value = 0.1",
        "val = 0.1",
        "parameters",
        "c.val",
        None,
        "did you mean 'value'",
    ),
    "unknown event key": ("direction =", "dir =", "events.stop", "dir", None, "unknown key 'dir'"),
    "unknown energy": ("potential =", "potentiel =", "energy", "potentiel", None, "did you mean 'potential'"),
    "unknown axis": ('y = "-g"', 'up = "-g"', "gravity", "up", None, "unknown key 'up'"),
    "unknown run key": ("t_end =", "tend =", "run", "tend", None, "did you mean 't_end'"),
    "negative t_end": ("t_end = 5.0", "t_end = -5.0", "run", "t_end", None, "positive"),
    "text for t_end": ("t_end = 5.0", 't_end = "5 m"', "run", "t_end", None, "unit"),
    "undeclared name": (
        "c/2*dot(x)",
        "c/2*dot(thta)",
        "energy",
        "dissipation",
        9,
        "'thta' is not declared",
    ),
    "nearest name": (
        '"px", "-l*cos(phi)"',
        '"px", "-l*cos(phj)"',
        "bodies.hook",
        "com, element 2",
        8,
        "'phi'",
    ),
    "definitions in a circle": (
        '"x + l*sin(phi)"',
        '"x + vx"',
        "definitions",
        "px",
        5,
        "itself, through 'vx'",
    ),
    "refers to itself": ('"x + l*sin(phi)"', '"x + px"', "definitions", "px", 5, "refers to itself"),
    "output in expression": ('x = "F"', 'x = "F + speed"', "forces", "x", 5, "is an output"),
    "duplicate across tables": (
        "[constants]\nx0",
        "[constants]\nm",
        "constants",
        "m",
        None,
        "a parameter already",
    ),
    "name t": ("[constants]\nx0", "[constants]\nt", "constants", "t", None, "the time"),
    "name pi": ("[constants]\nx0", "[constants]\npi", "constants", "pi", None, "number pi"),
    "name of a function": ("[constants]\nx0", "[constants]\nsin", "constants", "sin", None, "is a function"),
    "keyword": ("[constants]\nx0", "[constants]\nlambda", "constants", "lambda", None, "reserved word"),
    "underscore first": ("[constants]\nx0", "[constants]\n_x0", "constants", "_x0", None, "not a name"),
    "name with a dash": ("[constants]\nx0", "[constants]\nx-0", "constants", "x-0", None, "not a name"),
    "name not ASCII": ("[constants]\nx0", '[constants]\n"größe"', "constants", "größe", None, "ASCII"),
    "syntax in expression": ("x - x0*cos(phi)", "x - x0*(cos(phi)", "constraints", "rail", 8, "never closed"),
    "unknown function": (
        "x - x0*cos(phi)",
        "x - x0*cso(phi)",
        "constraints",
        "rail",
        8,
        "did you mean 'cos'",
    ),
    "code": ("x - x0*cos(phi)", "__import__('os')", "constraints", "rail", 1, "no place"),
    "attribute": ("x - x0*cos(phi)", "x.real", "constraints", "rail", 1, "not declared"),
    "huge power": ("x - x0*cos(phi)", "x - 9**9**9", "constraints", "rail", 8, "range"),
    "second derivative": (
        'speed = "vx"',
        'speed = "dot(dot(x))"',
        "outputs",
        "speed",
        1,
        "second derivative",
    ),
    "second derivative, hidden": (
        'speed = "vx"',
        'speed = "1 + dot(vx)"',
        "outputs",
        "speed",
        5,
        "'vx' contains a dot",
    ),
    "derivative of an input": ('speed = "vx"', 'speed = "dot(F)"', "outputs", "speed", 1, "input 'F'"),
    "rate in a constraint": (
        "x - x0*cos(phi)",
        "x - dot(x)",
        "constraints",
        "rail",
        5,
        "velocity_constraints",
    ),
    "rate in a constraint, hidden": ("x - x0*cos(phi)", "x - vx", "constraints", "rail", 5, "through 'vx'"),
    "input in a constraint": (
        "x - x0*cos(phi)",
        "x - F",
        "constraints",
        "rail",
        5,
        "cannot depend on an input",
    ),
    "rate in the potential": (
        '"m*g*x0"',
        '"m*dot(x)^2"',
        "energy",
        "potential",
        3,
        "cannot depend on a rate",
    ),
    "mass that moves": (
        'mass = "m"\ninertia',
        'mass = "m*x"\ninertia',
        "bodies.hook",
        "mass",
        3,
        "a coordinate, 'x'",
    ),
    "no rate in a velocity constraint": (
        "[outputs]",
        '[velocity_constraints]\nroll = "x"\n[outputs]',
        "velocity_constraints",
        "roll",
        None,
        "without a rate",
    ),
    "constraint name twice": (
        "[outputs]",
        '[velocity_constraints]\nrail = "dot(x)"\n[outputs]',
        "velocity_constraints",
        "rail",
        None,
        "is taken",
    ),
    "force on nothing": ('x = "F"', 'y = "F"', "forces", "y", None, "no coordinate 'y'"),
    "reset of nothing": (
        '"dot(x)" = "-e',
        '"dot(y)" = "-e',
        "events.stop",
        "then.reset.dot(y)",
        None,
        "no coordinate 'y'",
    ),
    "bad direction": ('"falling"', '"down"', "events.stop", "direction", None, "rising, falling, both"),
    "bad action": (
        'then = { reset = { "dot(x)" = "-e*dot(x)" } }',
        'then = "stop"',
        "events.stop",
        "then",
        None,
        "record",
    ),
    "event without when": ('when = "x - 0.25"', "", "events.stop", "when", None, "missing"),
    "torque on nothing": (
        'body = "hook"',
        'body = "hok"',
        "loads.twist",
        "body",
        None,
        "did you mean 'hook'",
    ),
    "torque on a point": ('body = "hook"', 'body = "crab"', "loads.twist", "body", None, "does not turn"),
    "force without point": ('point = ["x", "0"]\n', "", "loads.gust", "point", None, "missing"),
    "force of other length": (
        '["-5 N", "0"]',
        '["-5 N"]',
        "loads.gust",
        "force",
        None,
        "2 components are expected",
    ),
    "com of one component": (
        'com = ["x", "0"]',
        'com = ["x"]',
        "bodies.crab",
        "com",
        None,
        "2 or 3 components",
    ),
    "com as text": ('com = ["x", "0"]', 'com = "x"', "bodies.crab", "com", None, "a list of 2 or 3"),
    "no com": ('com = ["x", "0"]', "", "bodies.crab", "com", None, "missing"),
    "no mass": (
        'mass = "m"\ncom = ["x"',
        'com = ["x"',
        "bodies.crab",
        None,
        None,
        "mass, an inertia or both",
    ),
    "inertia without angle": ('angle = "phi"\n', "", "bodies.hook", "angle", None, "needs the angle"),
    "rotation by a number": (
        'angle = "phi"',
        "rotation = 1",
        "bodies.hook",
        "rotation",
        None,
        "a list of axes and angles",
    ),
    "rotation in the plane": (
        'angle = "phi"',
        'rotation = [["z", "phi"]]',
        "bodies.hook",
        "rotation",
        None,
        "planar",
    ),
    "angle in space": (
        'com = ["px", "-l*cos(phi)"]',
        'com = ["px", "-l*cos(phi)", 0]',
        "bodies.hook",
        "angle",
        None,
        "takes 'rotation'",
    ),
    "two inertias in the plane": (
        'inertia = "J"',
        'inertia = ["J", "J"]',
        "bodies.hook",
        "inertia",
        None,
        "one inertia",
    ),
    "negative mass": ('m = "2 kg"', 'm = "-2 kg"', "bodies.crab", "mass", None, "-2 kg"),
    "negative inertia": ('J = "1e-3 kg', 'J = "-1e-3 kg', "bodies.hook", "inertia", None, "negative"),
    "unknown shape": ("capsule", "capsul", "bodies.hook", "shape.capsul", None, "did you mean 'capsule'"),
    "sizes of a shape": (
        '["0.01 m", "l"]',
        '["0.01 m"]',
        "bodies.hook",
        "shape.capsule",
        None,
        "[radius, length]",
    ),
    "mesh above": (
        'capsule = ["0.01 m", "l"]',
        'mesh = "../a.stl"',
        "bodies.hook",
        "shape.mesh",
        None,
        "not below",
    ),
    "absolute mesh": (
        'capsule = ["0.01 m", "l"]',
        'mesh = "/a.stl"',
        "bodies.hook",
        "shape.mesh",
        None,
        "not below",
    ),
    "mesh elsewhere": (
        'capsule = ["0.01 m", "l"]',
        "mesh = 'C:\\a.stl'",
        "bodies.hook",
        "shape.mesh",
        None,
        "not below",
    ),
    "gravity out of the plane": ('y = "-g"', 'z = "-g"', "gravity", "z", None, "planar body 'crab'"),
    "sum of units": ("x - x0*cos(phi)", "x - m", "constraints", "rail", None, "kg"),
    "sum of units, both shown": (
        'speed = "vx"',
        'speed = "x + dot(x)"',
        "outputs",
        "speed",
        None,
        "'dot(x)' in m/s",
    ),
    "energy of another unit": (
        '"m*g*x0"',
        '"m*g"',
        "energy",
        "potential",
        None,
        "J (m^2*kg/s^2) is expected",
    ),
    "force of another unit": ('x = "F"', 'x = "F*x"', "forces", "x", None, "N ("),
    "lone quantity of another unit": (
        '"-5 N"',
        '"-5 kg"',
        "loads.gust",
        "force, element 1",
        None,
        "is in kg",
    ),
    "mass of another unit": ('m = "2 kg"', 'm = "2 m"', "bodies.crab", "mass", None, "is in m"),
    "start of another unit": (
        "start = 0.1",
        'start = "0.1 s"',
        "coordinates",
        "x.start",
        None,
        "does not fit",
    ),
    "unknown unit": ('l = "0.3 m"', 'l = "0.3 metre"', "parameters", "l", 5, "'metre' is not a unit"),
    "unit run together": (
        'J = "1e-3 kg*m^2"',
        'J = "1e-3 kgm^2"',
        "parameters",
        "J",
        6,
        "did you mean 'kg*m'",
    ),
    "function of a length": (
        'speed = "vx"',
        'speed = "sin(x)"',
        "outputs",
        "speed",
        None,
        "pure number or an angle",
    ),
    "infinite at load": ("e = 0.6", "e = 0.0\ninv = 1.0", None, None, None, None),
    "nan": ("e = 0.6", "e = nan", "parameters", "e", None, "finite"),
    "infinity": ("start = 0.1", "start = inf", "coordinates", "x.start", None, "finite"),
    "true": ("e = 0.6", "e = true", "parameters", "e", None, "not true"),
    "list for a number": ("e = 0.6", "e = [1]", "parameters", "e", None, "not a list"),
    "expression for a parameter": ("e = 0.6", 'e = "2*m"', "parameters", "e", None, "not a number"),
    "date": ("e = 0.6", "e = 1979-05-27", "parameters", "e", None, "date"),
    "number for a coordinate": (
        'x = { unit = "m", start = 0.1 }',
        "x = 0.1",
        "coordinates",
        "x",
        None,
        "a table",
    ),
    "both start and guess": (
        "start = 0.1",
        "start = 0.1, guess = 0.2",
        "coordinates",
        "x.guess",
        None,
        "both given",
    ),
    "unused coordinate": ("[inputs]", 'z = { unit = "m" }\n[inputs]', "coordinates", "z", None, "mentions"),
    "table as a list": ("[forces]\n", "[[forces]]\n", None, "forces", None, "is a table"),
}
WRONG["infinite at load"] = ('x = "F"', 'x = "F/(e - 0.6)"', "forces", "x", None, "no finite value")


def test_the_right_model_is_right():
    read_text(GOOD, file="crane.toml").describe()


@pytest.mark.parametrize("case", WRONG, ids=list(WRONG))
def test_wrong_model(case):
    old, new, table, key, column, words = WRONG[case]
    assert GOOD.count(old) >= 1
    with pytest.raises(ModelError) as caught:
        read_text(GOOD.replace(old, new, 1), file="crane.toml").describe()
    error = caught.value
    assert (error.file, error.table, error.key) == ("crane.toml", table, key)
    assert column is None or error.column == column
    assert words in str(error)
    assert str(error).startswith("crane.toml")
    assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("[parameters]\nm = \n", 2, "TOML syntax"),
        ("[parameters]\nm = 1\nm = 2\n", 3, "TOML syntax"),
        ("[parameters\n", 1, "TOML syntax"),
        ("x = " + "[" * 100_000, None, "TOML syntax"),
        ("x = " + "9" * 100_000, None, "TOML syntax"),
        ("", None, "no coordinates"),
        ("coordinates.x = {}", None, "kinetic energy"),
        ("name = 5", None, "name must be text"),
        ('name = "../../etc/passwd"', None, "not a name"),
        ("description = 5", None, "description is text"),
    ],
)
def test_wrong_file(text, line, words):
    with pytest.raises(ModelError) as caught:
        read_text(text, file="a.toml").describe()
    assert words in str(caught.value)
    assert line is None or caught.value.line == line


def test_negative_principal_moment():
    model = Model("top")
    a = model.coordinate("a")
    model.body("b", com=(0, 0, 0), rotation=[("z", a)], inertia=[1, 1, 1, 2, 0, 0])
    with pytest.raises(ModelError, match="negative principal moment"):
        model.describe()


def test_inertia_without_rotation():
    model = Model("top")
    x = model.coordinate("x")
    model.body("b", mass=1, com=(x, 0, 0), inertia=[1, 1, 1])
    with pytest.raises(ModelError, match="does not turn"):
        model.describe()


def test_python_errors_name_the_call():
    model = Model("cart")
    x = model.coordinate("x", unit="m")
    with pytest.raises(ModelError) as caught:
        model.body("box", mass="1 kgg", com=(x, 0))
    assert caught.value.table == "body('box')"
    assert caught.value.key == "mass"
    assert str(caught.value).startswith("model 'cart', body('box') mass, column 3: 'kgg' is not a unit")
    with pytest.raises(ModelError, match=r"model 'cart', coordinate\('x'\): the name 'x' is taken"):
        model.coordinate("x")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda s, x: s.Function("f")(s.Symbol("t")), "declare a coordinate|applied function"),
        (lambda s, x: s.I * x, "real"),
        (lambda s, x: s.Integral(x, x), "no place in a model"),
        (lambda s, x: x / 0, "no place in a model"),
        (lambda s, x: s.Symbol("y"), "'y' is not declared"),
    ],
)
def test_foreign_sympy_objects(make, words):
    import sympy

    model = Model("cart")
    x = model.coordinate("x")
    model.body("box", mass=1, com=(x, 0))
    model.force(x, make(sympy, x))
    with pytest.raises(ModelError, match=words):
        model.describe()


def test_error_survives_pickling():
    error = ModelError("no", file="a.toml", table="bodies.b", key="com", column=3, hint="yes")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "a.toml, [bodies.b] com, column 3: no; yes"
    assert isinstance(again, SymgenError)
