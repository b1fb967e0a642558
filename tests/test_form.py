"""Forms of generated functions: what a text says, said again; passes over them agree with Python's own reading."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from symgen.runtime import load
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.modules import lower_function
from symgen.runtime.code.printing import text_of
from symgen.runtime.errors import ModuleError
from symgen.runtime.graph.carry_out import NoArrays, carry_out
from symgen.runtime.graph.form import P, Y
from symgen.runtime.linear.linearisation import carried_out
from symgen.runtime.subsystems.decomposition import divide

ROOT = Path(__file__).parent.parent
LENGTHS = Lengths(6, 4, 6)
HELD = """def rhs(t, y, p, out):
    p_m = p[0]
    c0 = p_m*2.0
    e0 = 0.5
    first = y[0]
    first = first*c0 - -y[1]
    w0 = [0.0]*4
    w0[1] = first
    for k in range(3):
        a = w0[1 + k]*y[I0[k]]
        e0 = e0 + (a if a < 1.0 else -(a + t))
        w0[1] = a
        x = a
        x = x/(p[1 + k] + 2.5e-07)
        out[2*k] = pow(x, 2.0) - (e0 - a)
        out[1 + 2*k] = e0*(first if x <= a else y[k])
"""
TABLES = {"I0": (5, 1, 3)}


def form_of(text, tables=None):
    return FunctionText("rhs", text, LENGTHS, tables or {}).form


def generated():
    return sorted(path.stem for path in (ROOT / "generated").glob("*.py"))


@pytest.mark.parametrize("name", generated())
def test_a_form_says_what_its_text_says(name):
    """Nothing is lost, folded, or put in another order: printed, it is the text again, but for its comments."""
    system = load(ROOT / "generated" / f"{name}.py")
    for function in system.source.functions:
        if system.has(function):
            lines = system.source.functions[function].split("\n")
            kept = [line for line in lines[1:] if not re.match(r' +(#|""")', line)]
            assert text_of(system.form(function)).split("\n")[1:] == kept


def test_what_changes_while_a_function_runs_is_told_apart():
    """Names with other values, elements that are written again, and a name that a loop gives two values."""
    text = text_of(form_of(HELD, TABLES))
    assert text == HELD
    code = FunctionText("rhs", HELD, LENGTHS, TABLES)
    rng = np.random.default_rng(5)
    for _ in range(5):
        y, p = rng.normal(size=6).tolist(), rng.normal(size=4).tolist()
        expected = [0.0] * 6
        code.python_function()(0.3, y, p, expected)
        assert carried_out(code.form, 0.3, y, p) == expected


def test_a_form_names_what_it_reads():
    form = form_of(HELD, TABLES)
    assert form.places_read(P) == {0, 1, 2, 3}
    assert form.places_read(Y) == {0, 1, 2, 3, 5}
    assert form.n_hoisted == 1
    assert [place.place.in_passes(count, form.tables) for place, count in form.writes()] == [
        [0, 2, 4],
        [1, 3, 5],
    ]


def test_only_what_is_wanted_is_carried_out():
    """Not the logarithm of a negative number, and no array where there are none."""
    text = (
        "def rhs(t, y, p, out):\n    x0 = log(y[0])\n    w0 = [0.0]*2\n    w0[0] = x0\n    out[0] = w0[0]\n"
    )
    text += "    for k in range(3):\n        out[1 + k] = y[k]*2.0\n"
    form = form_of(text)
    found = carry_out(form, _Numbers(), [-1.0, 2.0, 3.0].__getitem__, None, wanted={1, 3})
    assert list(found) == [(1, -2.0), (3, 6.0)]
    with pytest.raises(NoArrays):
        list(carry_out(form, _Numbers(), [1.0, 2.0, 3.0].__getitem__, None))
    (write, _), *_ = form.writes()
    assert list(carry_out(form, _Numbers(), None, None, wanted={0}, given={write.node: 7.0})) == [(0, 7.0)]


class _Numbers:
    def time(self):
        return 0.0

    def mul(self, x, y):
        return x * y

    def call(self, name, *args):
        return float(getattr(np, name)(*args))


@pytest.mark.parametrize("name", ["pendulum_field"])
def test_functions_that_passes_make_are_those_of_their_texts(name):
    """Members of subsystems, entries of matrices: the text says what the form does."""
    system = load(ROOT / "generated" / f"{name}.py")
    kinds, _ = divide(system)
    members = [kind.system for kind in kinds]
    codes = [one.function_text(f) for one in members for f in one.source.functions]
    codes.append(system.function_text("residual_jacobian_entries"))
    assert len(codes) > 6
    for code in codes:
        again = FunctionText(code.name, code.text, code.lengths, code.tables)
        assert lower_function(again, "f").ir == lower_function(code, "f").ir


def test_python_in_other_lines_has_the_same_form():
    text = (
        'def rhs(t, y, p, out):\n    """Two\n    lines."""\n    x0 = (y[0]  # a note\n          + 1_0*p[1])\n'
    )
    text += "    for k in range(2): out[k] = x0 if t < 1 else -x0;\n"
    expected = "def rhs(t, y, p, out):\n    x0 = y[0] + 10.0*p[1]\n"
    expected += "    for k in range(2):\n        out[k] = (x0 if t < 1.0 else -x0)\n"
    assert text_of(form_of(text)) == expected
    with pytest.raises(ModuleError, match="line 3, function 'rhs': the operator Pow"):
        form_of("def rhs(t, y, p, out):\n    x0 = t\n    out[0] = x0**2\n")


def test_text_of_functions_is_read_in_one_place():
    """All else works on forms."""
    readers = {"code/parse.py", "code/shipped.py"}  # the latter reads the package's own sources
    for path in (ROOT / "runtime").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        name = path.relative_to(ROOT / "runtime").as_posix()
        if name not in readers:
            assert "ast.parse" not in text and "ast.walk" not in text, name
        if re.search(r"\.functions\[|\.functions\.(values|items|get)\(", text):
            # They take texts whole: for the reader, for keys of caches, to keep them.
            assert name in (
                "module_source.py", "module_check.py", "taylor/kernel.py", "recording/save.py",
                "ensemble/gpu/choose.py",
            ), name  # fmt: skip
