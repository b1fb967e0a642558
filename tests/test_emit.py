"""The emitted text: same numbers to the bit, same bytes everywhere, and a model's texts stay data."""

from __future__ import annotations

import ast
import dataclasses
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from derived import Generated, describe, execute, expr
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mechanisms import CONSTRAINED, FREE
from random_expressions import VARIABLES, evaluate, on_graph, points, recipes

from symgen.derive.pipeline import derive
from symgen.derive.program import Function, Program
from symgen.emit.module import emit
from symgen.model.description import Constant, Event, Parameter
from symgen.runtime.graph.functions import IN_CODE

ROOT = Path(__file__).resolve().parents[1]
ALL = (*FREE, *CONSTRAINED)
HEADER = {
    "generator": "test", "name": "random", "description": "", "nq": 2, "nv": 2,
    "coordinates": [{"name": "a"}, {"name": "b"}], "rates": [{"name": "a"}, {"name": "b"}],
    "parameters": [{"name": "k"}], "inputs": [], "constraints": [],
}  # fmt: skip


@given(recipes, points)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_text_evaluates_to_the_same_bits(recipe, point):
    g, variables, nodes = on_graph(recipe)
    outputs = tuple(nodes[len(VARIABLES) :])
    space = execute(emit(Program(g, (Function("f", "Test.", outputs),), HEADER)))
    direct = evaluate(g, list(outputs), dict(zip(variables, point, strict=True)))
    assume(all(math.isfinite(x) for x in direct))
    out = [None] * len(outputs)
    space["f"](0.0, point[:4], point[4:], out)
    assert out == direct


def names_called(tree: ast.AST) -> set[str]:
    return {
        node.func.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }


@pytest.mark.parametrize("build", ALL, ids=lambda f: f.__name__)
def test_module_keeps_to_the_grammar(build):
    system = Generated(build())
    tree = ast.parse(system.text)
    docstring, *body = tree.body
    assert isinstance(docstring, ast.Expr) and isinstance(docstring.value.value, str)
    imports = [x for x in body if isinstance(x, ast.ImportFrom)]
    assert {x.module for x in imports} <= {"math", "numba"}
    assignments = [x for x in body if isinstance(x, ast.Assign)]
    assert [x.targets[0].id for x in assignments] == ["MODEL"]
    assert ast.literal_eval(assignments[0].value) == system.model
    functions = [x for x in body if isinstance(x, ast.FunctionDef)]
    assert len(body) == len(imports) + 1 + len(functions)
    assert [f.name for f in functions] == list(system.model["operations"])
    for function in functions:
        check_function(function)


def check_function(function: ast.FunctionDef):
    assert [a.arg for a in function.args.args] == ["t", "y", "p", "out"]
    assert names_called(ast.Module(function.body, [])) <= set(IN_CODE)
    defined = {"t"}
    for statement in function.body[1:]:
        assert isinstance(statement, ast.Assign) and len(statement.targets) == 1
        used = {x.id for x in ast.walk(statement.value) if isinstance(x, ast.Name)}
        assert used <= defined | {"y", "p", *IN_CODE}, "used before it is assigned"
        target = statement.targets[0]
        if isinstance(target, ast.Name):
            assert target.id not in defined | {"y", "p", "out"}, "assigned twice"
            defined.add(target.id)
        else:
            assert target.value.id == "out" and isinstance(target.slice.value, int)
        allowed = (
            ast.BinOp,
            ast.UnaryOp,
            ast.Name,
            ast.Constant,
            ast.Call,
            ast.IfExp,
            ast.Compare,
            ast.Subscript,
        )
        operators = (ast.operator, ast.unaryop, ast.cmpop, ast.expr_context)
        assert all(isinstance(x, (*allowed, *operators)) for x in ast.walk(statement.value))
        assert not any(isinstance(x, (ast.Pow, ast.Mod, ast.FloorDiv)) for x in ast.walk(statement.value))


@pytest.mark.parametrize("build", ALL, ids=lambda f: f.__name__)
def test_operations_are_counted_as_printed(build):
    system = Generated(build())
    for function in ast.parse(system.text).body:
        if isinstance(function, ast.FunctionDef):
            nodes = list(ast.walk(function))
            printed = sum(isinstance(x, (ast.BinOp, ast.IfExp)) for x in nodes)
            printed += sum(isinstance(x, ast.Call) for b in function.body for x in ast.walk(b))
            printed += sum(
                isinstance(x, ast.UnaryOp) and not isinstance(x.operand, ast.Constant) for x in nodes
            )
            assert printed == system.model["operations"][function.name]


SCRIPT = """
import sys
sys.path[:0] = sys.argv[1:3]
import hashlib
from mechanisms import CONSTRAINED, FREE
from symgen.derive.pipeline import derive
from symgen.emit.module import emit
wanted = ("free_text", "driven_gyroscope", "slider_crank", "cart_pole")
builds = [f for f in (*FREE, *CONSTRAINED) if f.__name__ in wanted]
if sys.argv[3] == "reversed":  # another history in SymPy's caches
    builds.reverse()
texts = {f.__name__: emit(derive(f())) for f in builds}
for name in sorted(texts):
    print(name, hashlib.sha256(texts[name].encode()).hexdigest())
"""


def test_same_bytes_in_every_process():
    def run(seed: str, order: str) -> str:
        return subprocess.run(
            [sys.executable, "-c", SCRIPT, str(ROOT), str(ROOT / "tests"), order],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout

    first = run("1", "forward")
    assert first.count("\n") == 4
    assert run("2", "reversed") == first


def small(**changes):
    d = describe("small", "x", {"m": 1.0}, kinetic="m/2*dot(x)**2", potential="x**2")
    return dataclasses.replace(d, **changes)


HOSTILE = (
    '"""',
    '"""\nimport os\n"""',
    "'''",
    '\\"""',
    "\\",
    "end\\",
    "\\N{BULLET} \\x41 \\u0000",
    "two\nlines\r\nand\u2028more\x0c\x85",
    "nul\0byte",
    "bell\x07 \x1b[31m \x1a",
    "\ud800 lone surrogate",
    "\u202e right to left",
    "{t} %s {{",
    "Grüße 你好",
    "'\"'\"",
    '\\"; import os; "',
    "#",
)


def check_smuggled(text: str, value: str, place):
    """The text is ASCII or UTF-8, parses to the same statements as ever, and holds the value as data."""
    encoded = text.encode("utf-8")
    tree = ast.parse(encoded)
    kinds = [type(x).__name__ for x in tree.body]
    assert kinds[:3] in (["Expr", "ImportFrom", "Assign"], ["Expr", "ImportFrom", "ImportFrom"])
    assert set(kinds) <= {"Expr", "ImportFrom", "Assign", "FunctionDef"} and kinds.count("Expr") == 1
    model = next(ast.literal_eval(x.value) for x in tree.body if isinstance(x, ast.Assign))
    assert place(model) == value
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f\u202a-\u202e\u2066-\u2069]", text)


@pytest.mark.parametrize("value", HOSTILE, ids=ascii)
def test_hostile_text_stays_data(value):
    check_smuggled(emit(derive(small(description=value))), value, lambda m: m["description"])
    check_smuggled(emit(derive(small(name=value))), value, lambda m: m["name"])
    parameter = Parameter("m", 1.0, unit=value, doc=value)
    check_smuggled(emit(derive(small(parameters=(parameter,)))), value, lambda m: m["parameters"][0]["doc"])
    check_smuggled(emit(derive(small(parameters=(parameter,)))), value, lambda m: m["parameters"][0]["unit"])
    check_smuggled(emit(derive(small(run={"method": value}))), value, lambda m: m["run"]["method"])


@given(st.text(max_size=40))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_any_text_stays_data(value):
    program = derive(small())
    program.header["description"] = value
    check_smuggled(emit(program), value, lambda m: m["description"])


def test_names_of_the_language_and_of_the_module_are_no_danger():
    """A model's names are prefixed in the functions: no clash with y, p, out, temporaries."""
    names = "y p out x0 x1 sin MODEL njit q v rhs"
    kinetic = " + ".join(f"dot({n})**2" for n in names.split() if n != "sin") + " + dot(S)**2"
    d = describe(
        "clash", names.replace("sin", "S"), {"lam": 2.0, "a": 3.0}, kinetic=kinetic, potential="sin(x0)*lam*a"
    )
    system = Generated(d)
    y = [0.1 * k for k in range(2 * system.n)]
    x0 = y[3]
    assert system.split(0.0, y).a[3] == pytest.approx(-math.cos(x0) * 6.0 / 2.0)


def test_header_says_what_the_model_says():
    d = small(
        constants=(Constant("c", 2.5, "m"),),
        events=(Event("stop", expr("x - c"), "falling", "terminate"),),
        run={"t_end": 5.0, "method": "auto"},
    )
    program = derive(d, "sha256:1234")
    model = execute(emit(program))["MODEL"]
    assert model["abi"] == 1 and model["source"] == "sha256:1234"
    assert model["constants"] == [{"name": "c", "unit": "m", "value": 2.5}]
    assert model["events"] == [{"name": "stop", "direction": "falling", "action": "terminate"}]
    assert model["run"] == {"t_end": 5.0, "method": "auto"}
    assert model["nq"] == model["nv"] == 1 and model["nh"] == model["nn"] == model["nw"] == 0
    assert " ".join(model) == (
        "abi generator source name description nq nv nh nn nw coordinates quaternions rates parameters inputs "
        "constants constraints outputs events bodies structure operations hoisted run subsystems"
    )


def test_only_the_functions_that_a_model_needs_exist():
    system = Generated(small())
    assert list(system.model["operations"]) == [
        "rhs", "mass_matrix", "forces", "energy", "residual", "residual_jacobian",
    ]  # fmt: skip


def test_structural_zeros_of_matrices_are_not_written():
    system = Generated(describe("two", "x y", kinetic="dot(x)**2 + dot(y)**2"))
    assert "out[0] = 2.0" in system.text and "out[3] = 2.0" in system.text
    mass = system.text.split("def mass_matrix")[1].split("def ")[0]
    assert "out[1]" not in mass and "out[2]" not in mass
