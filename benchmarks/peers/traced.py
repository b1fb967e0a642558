"""The generated right-hand side run on a peer's own symbols: what it does to them are the peer's equations."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from job import Job

FUNCTIONS = (
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "pow",
)  # fmt: skip


class _Selections(ast.NodeTransformer):
    """Write `a if b < c else d` as a function of symbols."""

    def visit_IfExp(self, node):
        self.generic_visit(node)
        compare = "lt" if isinstance(node.test.ops[0], ast.Lt) else "lte"
        test = ast.Call(ast.Name(compare, ast.Load()), [node.test.left, node.test.comparators[0]], [])
        return ast.Call(ast.Name("select", ast.Load()), [test, node.body, node.orelse], [])


def derivative(job: Job, functions: Mapping[str, Callable]) -> Callable[[Any, Sequence], list]:
    """Return `f(t, y)`, the list of the derivatives of the symbols `y`.

    Parameters
    ----------
    functions : mapping of str to callable
        Of symbols and numbers, by their names in `math`; and `select(condition, a, b)`, `lt(a, b)`, `lte(a, b)`.
    """
    rhs = _function(job, "rhs", functions)
    parameters = [float(x) for x in job.p]

    def f(t, y):
        row = [0.0] * job.system.n_row
        rhs(t, [*y, 0.0], parameters, row)
        return row[: job.n]

    return f


def called(job: Job, name: str, functions: Mapping[str, Callable], t: Any, y: Sequence, size: int) -> list:
    """Return what one of the model's functions writes for symbols; `functions` as for `derivative`."""
    out = [0.0] * size
    _function(job, name, functions)(t, list(y), [float(x) for x in job.p], out)
    return out


def _function(job: Job, name: str, functions: Mapping[str, Callable]) -> Callable:
    text = re.sub(r"^(@njit|from math|from numba).*\n", "", job.text, flags=re.MULTILINE)
    namespace = dict(functions)
    tree = ast.fix_missing_locations(_Selections().visit(ast.parse(text)))
    exec(compile(tree, "module", "exec"), namespace)  # what symgen has generated; its loops are unrolled
    return namespace[name]
