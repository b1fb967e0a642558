"""Units: sizes, dimensions, and which expressions of a model fit together."""

import math
import subprocess
import sys
from fractions import Fraction

import pytest
import sympy

from symgen import Model
from symgen.errors import ModelError
from symgen.model.dimensions import NUMBER, infer
from symgen.model.expressions import parse
from symgen.model.from_sympy import taken_over
from symgen.model.sympy_functions import dot
from symgen.model.units import DIMENSIONLESS, dimension, dimension_text, parse_unit


@pytest.mark.parametrize(
    ("text", "si", "size", "coherent"),
    [
        ("m", 1.0, dimension(m=1), "m"),
        ("mm", 1e-3, dimension(m=1), "m"),
        ("cm^2", 1e-4, dimension(m=2), "m^2"),
        ("g", 1e-3, dimension(kg=1), "kg"),
        ("kg*m^2", 1.0, dimension(kg=1, m=2), "kg*m^2"),
        ("kg m^2", 1.0, dimension(kg=1, m=2), "kg m^2"),
        ("N*s/m", 1.0, dimension(kg=1, s=-1), "N*s/m"),
        ("kN/mm", 1e6, dimension(kg=1, s=-2), "N/m"),
        ("J/(kg*K)", 1.0, dimension(m=2, s=-2, K=-1), "J/(kg*K)"),
        ("m/s/s", 1.0, dimension(m=1, s=-2), "m/s/s"),
        ("m s^-2", 1.0, dimension(m=1, s=-2), "m s^-2"),
        ("km/h", 1 / 3.6, dimension(m=1, s=-1), "m/s"),
        ("GPa", 1e9, dimension(kg=1, m=-1, s=-2), "Pa"),
        ("bar", 1e5, dimension(kg=1, m=-1, s=-2), "Pa"),
        ("Hz", 1.0, dimension(s=-1), "Hz"),
        ("1/s", 1.0, dimension(s=-1), "1/s"),
        ("min", 60.0, dimension(s=1), "s"),
        ("ms", 1e-3, dimension(s=1), "s"),
        ("rad/s", 1.0, dimension(s=-1), "rad/s"),
        ("deg", math.pi / 180, DIMENSIONLESS, "rad"),
        ("deg/s", math.pi / 180, dimension(s=-1), "rad/s"),
        ("rpm", math.pi / 30, dimension(s=-1), "rad/s"),
        ("N*m/deg", 180 / math.pi, dimension(kg=1, m=2, s=-2), "N*m/rad"),
        ("V*A*s", 1.0, dimension(kg=1, m=2, s=-2), "V*A*s"),
        ("N*m/A", 1.0, dimension(kg=1, m=2, s=-2, A=-1), "N*m/A"),
        ("ohm*F", 1.0, dimension(s=1), "ohm*F"),
        ("H/ohm", 1.0, dimension(s=1), "H/ohm"),
        ("Wb/T", 1.0, dimension(m=2), "Wb/T"),
        ("N/m**1.5", 1.0, dimension(kg=1, s=-2)[:0] or (Fraction(-1, 2), 1, -2, 0, 0, 0, 0), "N/m**1.5"),
        ("m^(1/2)", 1.0, (Fraction(1, 2), 0, 0, 0, 0, 0, 0), "m^(1/2)"),
    ],
)
def test_unit(text, si, size, coherent):
    unit = parse_unit(text)
    assert unit.to_si(1) == pytest.approx(si, rel=1e-15)
    assert unit.dimension == size
    assert unit.coherent == coherent
    again = parse_unit(coherent)
    assert again.to_si(1) == 1.0
    assert again.dimension == size


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("metre", 1),
        ("m*", 3),
        ("m/s^x", 5),
        ("m^99", 3),
        ("(m", 3),
        ("m)", 2),
        ("5", 1),
        ("m+s", 2),
        ("t", 1),
        ("%", 1),
    ],
)
def test_wrong_unit(text, column):
    with pytest.raises(ModelError) as caught:
        parse_unit(text)
    assert caught.value.column == column


def test_units_and_errors_need_no_sympy():
    code = (
        "import sys, symgen.errors, symgen.model.units, symgen.model.names; assert 'sympy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_dimension_text():
    assert dimension_text(dimension(kg=1, m=1, s=-2)) == "N (m*kg/s^2)"
    assert dimension_text(dimension(m=1, s=-1)) == "m/s"
    assert dimension_text(dimension(s=-1)) == "1/s"
    assert dimension_text(DIMENSIONLESS).startswith("1")


NAMES = {
    "x": dimension(m=1),
    "m": dimension(kg=1),
    "k": dimension(kg=1, s=-2),
    "c": dimension(kg=1, s=-1),
    "phi": DIMENSIONLESS,
    "t": dimension(s=1),
    "u": None,
}
N, J = dimension(kg=1, m=1, s=-2), dimension(kg=1, m=2, s=-2)


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("k*x", N),
        ("1/2*k*x^2", J),
        ("k*x^2/2 + 2/3*m*dot(x)^2", J),
        ("k*(x - 0.35)^2/2", J),
        ("k*(x - 1)^2/2", J),
        ("-k*x - c*dot(x)", N),
        ("-k*x - 0.1*dot(x)", N),
        ("-k*x - 0.5*dot(x)", N),
        ("-k*x - 2*dot(x)", N),
        ("-k*x - 1.0*dot(x)", N),
        ("-k*x + 1.0*dot(x)", N),
        ("dot(x)*1.0*phi - k*x", N),
        ("u*x", None),
        ("u*x + k*x", N),
        ("u + x", NAMES["x"]),
        ("5", NUMBER),
        ("2*pi", NUMBER),
        ("pi*x", NAMES["x"]),
        ("phi + pi/2", DIMENSIONLESS),
        ("sin(phi)*x", NAMES["x"]),
        ("(1 - cos(phi))*x", NAMES["x"]),
        ("sqrt(x^2)", NAMES["x"]),
        ("sqrt(k/m)", dimension(s=-1)),
        ("sqrt(k/m)*t", DIMENSIONLESS),
        ("x^u", None),
        ("phi^u", DIMENSIONLESS),
        ("abs(x)", NAMES["x"]),
        ("sign(x)", DIMENSIONLESS),
        ("max(x, 0)", NAMES["x"]),
        ("atan2(x, 2*x)", DIMENSIONLESS),
        ("dot(x)", dimension(m=1, s=-1)),
        ("sin(t)", DIMENSIONLESS),
        ("exp(-t/2)", DIMENSIONLESS),
        ("x/x", DIMENSIONLESS),
    ],
)
def test_dimension_of_expression(text, size):
    parsed = parse(text)
    assert infer(parsed.expression, NAMES, parsed.decimals) == size


@pytest.mark.parametrize(
    "text",
    [
        "x + m",
        "x + dot(x)",
        "k*x + c*x",
        "x + t",
        "1/2*k*x^2 + k*x",
        "k*x - x/2",
        "k*x - dot(x)",
        "k*x - 1*dot(x)",
        "sin(x)",
        "exp(k/m)",
        "log(m)",
        "x^x",
        "2^m",
        "min(x, m)",
        "atan2(x, m)",
        "x + phi",
        "sqrt(x) + x",
    ],
)
def test_mismatch(text):
    parsed = parse(text)
    with pytest.raises(ModelError):
        infer(parsed.expression, NAMES, parsed.decimals)


def test_floats_of_python_fit_like_decimals():
    x, k = sympy.symbols("x k")
    assert infer(taken_over(k * x - 0.5 * dot(x)), NAMES) == N


def test_model_without_units_is_not_checked():
    model = Model("free")
    x = model.coordinate("x")
    model.body("b", mass=2, com=(x, 0))
    model.force(x, "sin(t + 1) + t - x^2*dot(x)")
    model.describe()


def test_bare_numbers_fit_in_a_model_with_units():
    model = Model("cart", gravity=(0, -9.81))
    x = model.coordinate("x", unit="m")
    model.body("b", mass=2, com=(x, 1))
    model.force(x, "-20*x - 0.5*dot(x)")
    model.potential("10*x^2")
    model.describe()


def _cart():
    model = Model("cart")
    model.coordinate("x", unit="m")
    model.coordinate("phi", unit="rad")
    model.parameters(m="1 kg", J="1 kg*m^2", F="1 N", M="1 N*m", P="1 W", a="1 m/s^2", l="1 m")
    model.body("b", mass="m", com=("x", 0, 0), rotation=[("z", "phi")], inertia=["J", "J", "J"])
    return model


WANTED = [
    (lambda m, e: m.kinetic(e), "F*l"),
    (lambda m, e: m.potential(e), "M"),
    (lambda m, e: m.dissipation(e), "P"),
    (lambda m, e: m.force("x", e), "F"),
    (lambda m, e: m.force("phi", e), "M"),
    (lambda m, e: m.load("w", point=(0, 0), force=(e, 0)), "F"),
    (lambda m, e: m.load("w", point=(e, 0), force=(0, 0)), "l"),
    (lambda m, e: m.load("w", body="b", torque=(0, 0, e)), "M"),
    (lambda m, e: m.gravity(y=e), "a"),
    (lambda m, e: m.body("c", mass=e, com=("x", 0)), "m"),
    (lambda m, e: m.body("c", mass="m", com=(e, "x")), "l"),
    (lambda m, e: m.body("c", mass="m", com=("x", 0), angle="phi", inertia=e), "J"),
    (lambda m, e: m.body("c", mass="m", com=("x", 0), angle=e), "phi"),
    (lambda m, e: m.body("c", mass="m", com=("x", 0), shape={"sphere": [e]}), "l"),
    (lambda m, e: m.event("c", when="x", then={"reset": {"x": e}}), "l"),
    (lambda m, e: m.event("c", when="x", then={"reset": {"dot(x)": e}}), "dot(x)"),
]


@pytest.mark.parametrize("case", range(len(WANTED)))
def test_what_must_have_which_unit(case):
    add, right = WANTED[case]
    model = _cart()
    add(model, right)
    model.describe()
    for wrong in ({"F", "P", "l", "m"} - {right}) | {f"{right}*m", "3 mol"}:
        model = _cart()
        add(model, wrong)
        with pytest.raises(ModelError, match="units do not match"):
            model.describe()


@pytest.mark.parametrize("force", ["5*x/2", "F - x/3"])
def test_a_fraction_that_was_meant_as_a_measured_number_is_pointed_out(force):
    """5 x²/2 has a pure number in it, where 4 x²/2 and 2.5 x² have one that fits any unit."""
    model = _cart()
    model.force("x", force)
    with pytest.raises(ModelError, match=r"(5/2|1/3) is a pure number, and a decimal would fit any unit"):
        model.describe()


def test_values_are_converted_to_si():
    model = Model("units")
    model.coordinate(
        "a",
        unit="deg",
        start=90,
        rate=180,
    )
    model.coordinate("b", start="20 mm", rate="1 km/h")
    model.parameter("k", "2 kN/mm")
    model.parameter("v", 3, unit="cm/s", doc="speed")
    model.input("p", unit="bar", default=2)
    model.body("c", mass="500 g", com=("b", 0), angle="a", inertia="1e6 g*mm^2")
    d = model.describe()
    a, b = d.coordinates
    assert (a.unit, a.start, a.rate) == ("rad", math.pi / 2, math.pi)
    assert (b.unit, b.start, b.rate) == ("m", 0.02, pytest.approx(1 / 3.6, rel=1e-15))
    assert [(p.value, p.unit) for p in d.parameters] == [(2e6, "N/m"), (0.03, "m/s")]
    assert (d.inputs[0].default, d.inputs[0].unit) == (2e5, "Pa")
    assert (float(d.bodies[0].mass), float(d.bodies[0].inertia[0])) == (0.5, 1e-3)
