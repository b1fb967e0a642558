"""The Python face of models: what methods return and add up, deep and shared expressions, lazy imports."""

import subprocess
import sys
import time

import numpy as np
import pytest
import sympy

import symgen
from symgen import Model, cos, dot, sin
from symgen.errors import ModelError
from symgen.model.algebra import postorder
from symgen.model.check_values import rate_degree
from symgen.model.expression_tree import uses
from symgen.model.from_sympy import taken_over
from symgen.model.printing import to_text


def test_importing_symgen_imports_no_sympy():
    code = (
        "import sys, symgen, symgen.errors\n"
        "from symgen.model import library\n"
        "assert len(library.list_models()) > 5\n"
        "assert 'sympy' not in sys.modules and 'numpy' not in sys.modules\n"
        "from symgen import Model, pi, t\n"
        "assert 'sympy' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("name", symgen.__all__)
def test_public_names(name):
    assert getattr(symgen, name) is not None
    assert name in dir(symgen)


def test_unknown_public_name():
    with pytest.raises(AttributeError, match="no attribute 'modle'"):
        _ = symgen.modle


def _cart_pole():
    m = Model("cart_pole", gravity=(0, "-9.81 m/s^2"))
    x = m.coordinate("x", unit="m")
    theta = m.coordinate("theta", start=0.1)
    M, mp, l = m.parameters(M="1 kg", mp="0.1 kg", l="0.5 m")
    F = m.input("F", unit="N")
    m.body("cart", mass=M, com=(x, 0))
    m.body("bob", mass=mp, com=(x + l * sin(theta), l * cos(theta)))
    m.force(x, F - 0.1 * dot(x))
    return m


def test_design_example():
    d = _cart_pole().describe()
    assert [c.name for c in d.coordinates] == ["x", "theta"]
    assert d.gravity == (0, sympy.Rational(-981, 100), 0)
    assert d.forces == (("x", sympy.Symbol("F") - 0.1 * dot(sympy.Symbol("x"))),)
    assert d == _cart_pole().describe()


def test_symbols_come_back():
    m = Model("m")
    assert m.parameters(a=1) == sympy.Symbol("a")
    assert m.constants(b=1, c="2 m") == sympy.symbols("b c")
    assert m.input("F") == sympy.Symbol("F")
    assert m.definition("d", "a + b") == sympy.Symbol("d")
    assert m.parameter("e", sympy.pi / 2, doc="quarter") == sympy.Symbol("e")
    assert m.parameter("f", np.float64(2.5)) == sympy.Symbol("f")
    assert m.parameter("h", np.int64(2)) == sympy.Symbol("h")


def test_energies_and_forces_add_up():
    m = Model("m")
    x = m.coordinate("x")
    for _ in range(2):
        m.kinetic(dot(x) ** 2)
        m.potential("x^2")
        m.dissipation(dot(x) ** 2 / 2)
        m.force(x, 3 * x)
    m.force("x", 1)
    d = m.describe()
    assert d.kinetic == 2 * dot(x) ** 2
    assert d.potential == 2 * x**2
    assert d.dissipation == dot(x) ** 2
    assert d.forces == (("x", 6 * x + 1),)


def test_each_addend_is_checked_for_units():
    m = _cart_pole()
    m.force("x", "3 N")
    m.describe()
    m.force("x", "3 kg")
    with pytest.raises(ModelError, match=r"force\('x'\).*kg"):
        m.describe()


def test_text_may_use_names_declared_later():
    m = Model("m")
    m.body("b", mass="mass", com=("l*x", 0))
    m.coordinate("x")
    m.parameters(mass=1, l=2)
    assert m.describe().bodies[0].mass == sympy.Symbol("mass")


def test_mass_must_be_constant_but_kinetic_energy_need_not():
    m = Model("m")
    x = m.coordinate("x")
    m.body("b", mass=1 + x**2, com=(x, 0))
    with pytest.raises(ModelError, match="mass or inertia cannot depend on a coordinate, 'x'"):
        m.describe()
    m = Model("m")
    x = m.coordinate("x")
    m.kinetic((1 + x**2) * dot(x) ** 2 / 2)
    m.describe()


def test_massless_bodies_do_not_count_as_motion():
    m = Model("m")
    x, y = m.coordinate("x"), m.coordinate("y")
    m.body("b", mass=1, com=(x, 0))
    m.body("drawn", mass=0, com=(x, y))
    with pytest.raises(ModelError, match="mentions the coordinate 'y'"):
        m.describe()


@pytest.mark.parametrize(
    ("text", "degree"),
    [
        ("x + t", 0),
        ("dot(x)", 1),
        ("dot(x^2*sin(x))*cos(x) - t", 1),
        ("(dot(x) + 1)/x + w", 1),
        ("dot(x)*dot(x)", 2),
        ("dot(x)^2", 2),
        ("dot(x)^1", 1),
        ("1/dot(x)", 2),
        ("sin(dot(x))", 2),
        ("abs(dot(x))", 2),
        ("max(dot(x), 0)", 2),
        ("w*dot(x)", 2),
    ],
)
def test_degree_in_the_rates(text, degree):
    from symgen.model.expressions import parse

    assert rate_degree(parse(text).expression, {"w": 1}) == degree


def test_velocity_constraint_through_a_definition():
    m = Model("m")
    x = m.coordinate("x")
    m.body("b", mass=1, com=(x, 0))
    v = m.definition("v", dot(x) - 3)
    m.velocity_constraint("steady", v)
    m.describe()
    m.velocity_constraint("odd", x**2)
    with pytest.raises(ModelError, match=r"velocity_constraint\('odd'\).*without a rate"):
        m.describe()


def test_deep_sum_of_unlike_units():
    m = Model("deep")
    x = m.coordinate("x", unit="m")
    m.body("b", mass="1 kg", com=(x, 0))
    deep = x
    for _ in range(4_000):
        deep = sympy.Mul(sympy.S.Half, sympy.Add(deep, x, evaluate=False), evaluate=False)
    assert len(postorder([deep])) > 8_000
    m.output("deep", deep)
    m.describe()
    m.output("unlike", sympy.Add(deep, dot(x), evaluate=False))
    with pytest.raises(ModelError, match="units do not match: 'a product' in m and 'dot"):
        m.describe()


def test_very_deep_chain_without_recursion():
    m = Model("deep")
    x = m.coordinate("x")
    m.body("b", mass=1, com=(x, 0))
    deep = x
    for _ in range(30_000):
        deep = sympy.Pow(deep, 2, evaluate=False)
    m.output("deep", deep)
    m.describe()
    with pytest.raises(ModelError, match="longer than"):
        to_text(taken_over(deep))


def test_shared_parts_are_visited_once():
    m = Model("shared")
    x = m.coordinate("x", unit="m")
    m.body("b", mass=1, com=(x, 0))
    shared = x
    for _ in range(200):  # as a tree: 2^200 nodes
        shared = sympy.Mul(
            sympy.S.Half, sympy.Add(shared, sympy.Abs(shared, evaluate=False), evaluate=False), evaluate=False
        )
    m.output("shared", shared)
    start = time.process_time()
    m.describe()
    assert time.process_time() - start < 5
    assert uses(taken_over(shared)).names == {"x"}


def test_derives():
    from symgen.link import derive_text

    assert derive_text(_cart_pole()).name == "cart_pole"
