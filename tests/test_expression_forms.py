"""Expressions that differ in names alone are looked at once; what is wrong with one is still said of that one."""

import pytest

from symgen import Model
from symgen.errors import ModelError
from symgen.model import algebra, dimensions, evaluate
from symgen.model.expression_tree import names_in, uses
from symgen.model.forms import form_of
from symgen.model.functions import dot

a, b, c, d = (algebra.Symbol(name) for name in "abcd")


def of_form(x, y):
    return 2 * x * algebra.sin(y) + x**2 / 3 + dot(y) * x


def test_names_alone_make_no_other_form():
    first, names = form_of(of_form(a, b))
    second, others = form_of(of_form(c, d))
    assert first is second and (names, others) == (("a", "b"), ("c", "d"))
    assert form_of(of_form(a, a))[0] is not first
    assert form_of(of_form(a, b) + 1)[0] is not first
    assert form_of(3 * a)[0] is not form_of(2 * a)[0]


def test_large_sums_have_none():
    assert form_of(algebra.Add(*(algebra.Symbol(f"x{k}") for k in range(9)))) is None


def test_what_is_mentioned_is_each_ones_own():
    for x, y in ((a, b), (c, d)):
        found = uses(of_form(x, y))
        assert found.names == names_in(of_form(x, y)) == {x.name, y.name}
        assert found.dotted == {y.name} and found.has_dot and not found.nested


def test_values_are_of_what_names_stand_for():
    values = {"a": 2.0, "b": 3.0, "c": 5.0, "d": None, "z": 0.0}
    pairs = [(a, b), (b, a), (c, b), (a, b)]
    found = [evaluate.evaluate(x / y, values) for x, y in pairs]
    assert found == pytest.approx([2.0 / 3.0, 1.5, 5.0 / 3.0, 2.0 / 3.0], rel=1e-15)
    assert evaluate.evaluate(a / d, values) is None
    for _ in range(2):
        with pytest.raises(evaluate.NotFinite):
            evaluate.evaluate(a / algebra.Symbol("z"), values)


def test_dimensions_are_of_what_names_stand_for():
    names = {"a": dimensions.LENGTH, "b": dimensions.LENGTH, "c": dimensions.TIME, "d": None}
    assert dimensions.infer(a + b, names) == dimensions.infer(c * a / c, names) == dimensions.LENGTH
    assert dimensions.infer(a + d, names) == dimensions.LENGTH
    for _ in range(2):
        with pytest.raises(ModelError, match="added"):
            dimensions.infer(a + c, names)


def test_a_mistake_is_told_of_the_one_that_has_it():
    model = Model("two")
    for name in "xy":
        model.coordinate(name)
        model.kinetic(f"dot({name})^2/2")
    model.potential("x^2/2")
    model.potential("z^2/2")
    with pytest.raises(ModelError, match="'z' is not declared"):
        model.describe()
