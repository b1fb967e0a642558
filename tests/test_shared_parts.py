"""Expressions of one model share equal parts, so that walks over long flat sums meet each part once."""

import copy
from unittest import mock

import pytest
import sympy

from symgen import Model, cos, dot, sin
from symgen.errors import ModelError
from symgen.model import algebra, expression_tree
from symgen.model.algebra import postorder
from symgen.model.evaluate import evaluate
from symgen.model.expression_tree import WIDE, uses
from symgen.model.from_sympy import Foreign, Taken, taken_over

q = sympy.symbols(f"q:{3 * WIDE}")


def chain(n: int) -> Model:
    """Links by relative angles, whose places are flat sums of flat sums."""
    model = Model("chain", gravity=(0, "-9.81"))
    x, y, turn = 0, 0, 0
    for k in range(n):
        turn = turn + model.coordinate(f"q{k}")
        x, y = x + 0.5 * sin(turn), y - 0.5 * cos(turn)
        model.body(f"link{k}", mass=1, inertia=0.1, com=(x, y), angle=turn)
    return model


def test_reading_and_checking_a_chain_takes_time_with_the_square_of_its_links():
    def visited(n):
        count = 0

        def counted(roots, *args, **options):
            nonlocal count
            order = postorder(roots, *args, **options)
            count += sum(1 + len(x.args) for x in order)
            return order

        with (
            mock.patch("symgen.model.from_sympy.postorder", counted),
            mock.patch("symgen.model.evaluate.postorder", counted),
        ):
            chain(n).describe()
        return count

    assert visited(32) < 4 * visited(16)  # 5.2 where each place is walked to its depth


def test_equal_parts_are_one_object_and_whole_expressions_are_their_own():
    memory = Taken()
    first, second = memory.over(0.5 * sin(q[0]) + q[1]), memory.over(0.5 * sin(q[0]) + q[1] + q[2])
    shared = {id(x) for x in first.args if x.args} & {id(x) for x in second.args}
    assert len(shared) == 1
    assert second == taken_over(0.5 * sin(q[0]) + q[1] + q[2])
    again = 0.5 * sin(q[0])
    assert memory.over(again) == memory.over(again)
    assert memory.over(again) is not memory.over(again)
    assert memory.over(q[0]) is not memory.over(q[0])


def test_what_was_refused_leaves_nothing_behind():
    memory = Taken()
    with pytest.raises(ModelError, match="at zero"):
        memory.over(sympy.Max(q[1], 2) + sympy.Heaviside(q[0], 1))
    assert memory._rewritten <= memory._done.keys()
    assert len(memory._alive) == len(memory._done)
    assert memory.over(sympy.Max(q[1], 2) + q[0]) == taken_over(sympy.Max(q[1], 2) + q[0])


def test_a_copied_model_does_not_go_by_the_identities_of_the_first():
    memory = Taken()
    memory.over(q[0] + q[1])
    assert not copy.deepcopy(memory)._done


def plain_uses(root: algebra.Expr) -> expression_tree.Uses:
    """Every part walked, nothing kept."""
    order = postorder([root])
    inside = postorder([a for x in order if isinstance(x, expression_tree.dot) for a in x.args])

    def names(nodes):
        return frozenset(x.name for x in nodes if isinstance(x, algebra.Symbol))

    return expression_tree.Uses(
        names(order),
        names(inside),
        any(isinstance(x, expression_tree.dot) for x in order),
        any(isinstance(x, expression_tree.dot) for x in inside),
        next((x for x in order if expression_tree.kind(x) is None), None),
        frozenset((x.func.table, len(x.args)) for x in order if isinstance(x, expression_tree.Tabulated)),
    )


wide = sum(q[:WIDE])
EXPRESSIONS = [
    q[0],
    wide,
    sin(wide) * sum(q[WIDE:]),
    dot(wide) + sum(q[WIDE:]),
    sum(dot(x) for x in q),
    dot(sin(wide) + sum(dot(x) for x in q[WIDE:])),
    sin(sum(dot(x) for x in q[: 2 * WIDE]) + cos(wide)) + q[-1],
    sum(q) * sympy.gamma(wide) + sum(dot(cos(wide + x)) for x in q[WIDE:]),
    sum(sympy.gamma(x) for x in q) + dot(q[0]),
]


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_what_an_expression_uses_is_that_of_all_its_parts(expression):
    memory = Taken()
    for _ in range(2):  # the second time with parts that keep theirs
        found = memory.over(expression)
        assert uses(found) == plain_uses(found)
        assert uses(found) == plain_uses(found)
    assert isinstance(uses(found).foreign, Foreign) == expression.has(sympy.gamma)


def test_values_of_parts_are_found_once_and_are_the_same():
    memory, known = Taken(), {}
    values = {x.name: 0.1 * k for k, x in enumerate(q)} | {"q3": None}
    made = [memory.over(x) for x in (sum(q[4:]), sin(sum(q[4:])) / q[1], sin(sum(q[4:])) + q[3])]
    for x in made:
        assert evaluate(x, values, known) == evaluate(x, values)
    assert len(known) < len(postorder(made[:1])) + 12
