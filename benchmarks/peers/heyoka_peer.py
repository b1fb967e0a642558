"""heyoka's Taylor integrator, its expressions made by running the generated right-hand side on symbols."""

import ast
import re
import time

import heyoka  # before anything that loads LLVM
from job import read_job, sweep

COMPACT_FROM = 1500  # operations; larger systems are compiled as loops, or it takes minutes
COMPILE_SECONDS = 60.0  # for all tolerances together
NAMES = (
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "atan2",
    "sinh",
    "cosh",
    "tanh",
    "exp",
    "log",
    "sqrt",
    "pow",
)


def symbolic(function):
    """Return a function of symbols that also takes numbers."""
    return lambda *values: function(*(heyoka.expression(value) for value in values))


class Selections(ast.NodeTransformer):
    """Write `a if b < c else d` as a function of symbols."""

    def visit_IfExp(self, node):
        self.generic_visit(node)
        compare = "lt" if isinstance(node.test.ops[0], ast.Lt) else "lte"
        test = ast.Call(ast.Name(compare, ast.Load()), [node.test.left, node.test.comparators[0]], [])
        return ast.Call(ast.Name("select", ast.Load()), [test, node.body, node.orelse], [])


def equations(job):
    """Return the pairs (variable, derivative)."""
    n = job.n
    text = re.sub(r"^(@njit|from math|from numba).*\n", "", job.text, flags=re.MULTILINE)
    namespace = {name: getattr(heyoka, name) for name in NAMES if hasattr(heyoka, name)}
    namespace |= {name: symbolic(getattr(heyoka, name)) for name in ("select", "lt", "lte")}
    tree = ast.fix_missing_locations(Selections().visit(ast.parse(text)))
    exec(
        compile(tree, "module", "exec"), namespace
    )  # what symgen has generated; loops come out as the operations that they do
    variables = heyoka.make_vars(*(f"y{i}" for i in range(n)))
    variables = [variables] if n == 1 else list(variables)
    row = [0.0] * job.system.n_row
    namespace["rhs"](heyoka.time, [*variables, 0.0], [float(x) for x in job.p], row)
    return [(variable, heyoka.expression(value)) for variable, value in zip(variables, row[:n], strict=True)]


def main() -> None:
    job = read_job()
    pairs = equations(job)
    compact = job.system.operations["rhs"] > COMPACT_FROM
    compiled = {"seconds": 0.0}

    def prepare(rtol, atol):
        if compiled["seconds"] > COMPILE_SECONDS:
            raise TimeoutError(f"compiling took {compiled['seconds']:.0f} s for the tolerances before")
        began = time.perf_counter()
        integrator = heyoka.taylor_adaptive(pairs, job.start.copy(), tol=rtol, compact_mode=compact)
        compiled["seconds"] += time.perf_counter() - began

        def run(t_end=job.t_end):
            integrator.state[:] = job.start
            integrator.time = 0.0
            outcome = integrator.propagate_until(t_end)[0]
            if outcome != heyoka.taylor_outcome.time_limit:
                raise RuntimeError(str(outcome))
            return integrator.state.copy(), 0

        return run, lambda: run(0.0)

    sweep(job, "heyoka", heyoka.__version__, prepare)


if __name__ == "__main__":
    main()
