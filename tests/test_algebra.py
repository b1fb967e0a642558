"""Expressions of models against SymPy, whose simplifications and order of arguments they have."""

import functools
import random
from pathlib import Path

import pytest
import sympy

from symgen import Model
from symgen.errors import ModelError
from symgen.model import algebra
from symgen.model.evaluate import NotFinite, evaluate
from symgen.model.from_sympy import taken_over, to_sympy
from symgen.model.library import load

NAMES = sympy.symbols("a b x y z x1 x10 Z")
NUMBERS = (
    *map(sympy.Integer, (-3, -1, 0, 1, 2, 4)), sympy.Rational(1, 2), sympy.Rational(-2, 3), sympy.Rational(8, 9),
    sympy.Float(0.5), sympy.Float(-1.5), sympy.Float(9.81), sympy.pi,
)  # fmt: skip
BINARY = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
}
POWERS = (2, 3, -1, -2, sympy.Rational(3, 2))


FUNCTIONS = ("sin", "cos", "tan", "tanh", "atan", "exp", "Abs", "sign", "sqrt")


def steps(rng, functions=FUNCTIONS):
    """Random expressions of SymPy and of models, built side by side by the same operations."""
    pool = [(x, taken_over(x)) for x in rng.choices(NAMES + NUMBERS, k=rng.randint(2, 7))]
    while len(pool) > 1:
        a = pool.pop(rng.randrange(len(pool)))
        choice = rng.choice((*BINARY, "**", "f"))
        if choice in BINARY:
            b = pool.pop(rng.randrange(len(pool)))
            if choice == "/" and b[0].is_zero:
                choice = "*"
            made = tuple(BINARY[choice](*pair) for pair in zip(a, b, strict=True))
        elif a[0].is_number:
            pool.append(a)
            continue
        elif choice == "**":
            exponent = rng.choice(POWERS)
            made = a[0] ** exponent, a[1] ** taken_over(sympy.S(exponent))
        else:
            name = rng.choice(functions)
            made = getattr(sympy, name)(a[0]), getattr(algebra, name)(a[1])
        if made[0].has(sympy.zoo, sympy.nan, sympy.I):
            return
        pool.append(made)
        yield made


@pytest.mark.parametrize("seed", range(4))
def test_arithmetic_is_that_of_sympy(seed):
    """The same trees, arguments in the same order."""
    rng, tried = random.Random(seed), 0
    for _ in range(250):
        for theirs, ours in steps(rng, ("asin",)):  # which nothing is made shorter of
            if theirs.has(sympy.pi) and theirs.has(sympy.asin, sympy.Rational(1, 2), sympy.Rational(3, 2)):
                break  # SymPy finds out which sums with pi are above zero
            expected = taken_over(theirs)
            assert ours == expected
            assert repr(ours) == repr(expected)
            tried += 1
    assert tried > 500


@pytest.mark.parametrize("seed", range(4))
def test_values_are_those_of_sympy(seed):
    """Whatever is made shorter: the values are the same."""
    rng, tried = random.Random(seed), 0
    for _ in range(250):
        values = {x.name: rng.uniform(0.2, 1.5) for x in NAMES}
        for theirs, ours in steps(rng):
            try:
                expected, found = evaluate(taken_over(theirs), values), evaluate(ours, values)
            except NotFinite:
                break
            if not 1e-9 < abs(expected) < 1e9:
                break
            assert found == pytest.approx(expected, rel=1e-6)
            tried += 1
    assert tried > 500


def test_order_of_arguments_is_that_of_sympy():
    rng = random.Random(3)
    parts = [*NAMES, *NUMBERS, *(f(x) for f in (sympy.sin, sympy.exp, sympy.Abs) for x in NAMES[:3])]
    parts += [
        NAMES[0] * NAMES[1],
        NAMES[0] + 1,
        NAMES[2] ** 2,
        sympy.sqrt(NAMES[3]),
        NAMES[0] * NAMES[1] * NAMES[2],
    ]
    by_sympy = functools.cmp_to_key(sympy.Basic.compare)
    for _ in range(500):
        chosen = rng.sample(parts, 6)
        assert list(map(taken_over, sorted(chosen, key=by_sympy))) == sorted(
            map(taken_over, chosen), key=algebra.sort_key
        )


def test_there_and_back():
    """Every expression of every bundled model is the same again after a way through SymPy."""
    from symgen.model.items import definition_items, items

    count = 0
    for path in (Path(__file__).parent.parent / "models").glob("*.toml"):
        d = load(path).describe()
        for item in (*definition_items(d), *items(d)):
            assert taken_over(to_sympy(item.expression)) == item.expression
            count += 1
    assert count > 1000


def test_sympy_takes_expressions_of_models():
    x, theirs = algebra.Symbol("x"), sympy.Symbol("x")
    assert theirs * x == theirs**2
    assert x == theirs
    assert sympy.sin(x + 1) == sympy.sin(theirs + 1)


def test_lengths_of_directions_by_angles_are_one():
    a, b = algebra.Symbol("a"), algebra.Symbol("b")
    sin, cos = algebra.sin, algebra.cos
    vector = cos(a) * cos(b), cos(a) * sin(b), sin(a)
    assert algebra.by_pythagoras(sum(x**2 for x in vector)) == 1
    left = algebra.by_pythagoras(sin(a) ** 2 + 2 * cos(a) ** 2)
    assert left == sin(a) ** 2 + 2 * cos(a) ** 2


def test_products_of_sums_are_expanded():
    a, b, x = map(algebra.Symbol, "abx")
    expression = (a + b) ** 2 * (x - a) - x * b**2
    assert algebra.expand(expression) == taken_over(sympy.expand(to_sympy(expression)))


def test_what_no_model_can_have_is_named_beside_other_terms():
    m = Model("mixed")
    x = m.coordinate("x")
    m.body("b", mass=1, com=(x, 0))
    for term in (sympy.Function("q")(sympy.Symbol("t")), x**2, sympy.Function("r")(sympy.Symbol("t"))):
        m.potential(term)
    with pytest.raises(ModelError, match=r"'q' \(SymPy's q\) has no place in a model"):
        m.describe()
