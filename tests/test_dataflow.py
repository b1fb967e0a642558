"""Modules whose functions leave a result out, write one twice or read what is not there: refused by name on loading."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from symgen import Model, cos, dot, link, runtime, sin
from symgen.derive import rolling
from symgen.derive.scenes.subsystems import derive
from symgen.derive.solve import choice
from symgen.emit import module as function_text
from symgen.emit.module import emit
from symgen.model.library import find, load
from symgen.runtime.code import facts
from symgen.runtime.code.dataflow import follow
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.errors import ModuleError
from symgen.runtime.module import read_module

GENERATED = Path(__file__).parent.parent / "generated"


def body(*lines, n=4, tables=None, sparse=False):
    text = "\n".join(["def f(t, y, p, out):", *(f"    {line}" for line in lines)]) + "\n"
    code = FunctionText("f", text, Lengths(4, 4, n), tables or {})
    return follow(code, lambda place: f"result {place}", sparse=sparse).tolist()


WRITE_ALL = "for k in range(4):", "    out[k] = y[k]"
FACTORED = "w0 = [0.0]*6", "w0[0] = 2.0", "w0[3] = 3.0", "factor_ldl(w0, 2, 2)"


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (["for k in range(3):", "    out[k] = y[k]"], "line 1, function 'f': out[3] (result 3) is never written"),
        ([*WRITE_ALL, "out[2] = 1.0"], "line 4, function 'f': out[2] (result 2) is written twice"),
        (["for k in range(4):", "    out[0] = y[k]"], "out[0] (result 0) is written twice"),
        (["for k in range(4):", "    out[I0[k]] = y[k]"], "out[1] (result 1) is written twice"),
        (["for k in range(5):", "    out[I0[k]] = y[0]"], "I0 has no entry for each of 5 passes"),
        (["for k in range(9):", "    out[k] = y[0]"], "out[8] is out of range"),
        (["for k in range(1000000000000):", "    out[k] = y[0]"], "runs 1000000000000 times, more than"),
        (["w0 = [0.0]*1000000000000", *WRITE_ALL], "more than"),
        (["x0 = x1 + y[0]", "x1 = 1.0", *WRITE_ALL], "line 2, function 'f': 'x1' is read before it is computed"),
        (["for k in range(4):", "    x1 = y[k]", "    out[k] = x1", "x2 = x1"], "'x1' is read before"),
        (["for k in range(4):", "    out[k] = x1", "    x1 = y[k]"], "'x1' is read before"),
        (["w0 = [0.0]*4", "x0 = w0[2]", *WRITE_ALL], "w0[2] is read before it is computed"),
        (["w0 = [0.0]*4", "w0[1] = 1.0", "for k in range(4):", "    out[k] = w0[k]"], "w0[0] is read before"),
        (["w0 = [0.0]*5", "w0[0] = 1.0", "for k in range(4):", "    out[k] = w0[1 + k]", "    w0[1 + k] = y[k]"],
         "w0[1] is read before"),
        ([*FACTORED[:3], "b0 = [0.0]*2", "b0[0] = 1.0", "solve_ldl(w0, b0, 2)", *WRITE_ALL], "which is not factored"),
        ([*FACTORED, "w0[1] = 1.0", *WRITE_ALL], "'w0' is written after it was factored"),
        ([*FACTORED, "b0 = [0.0]*2", "b0[0] = 1.0", "x0 = b0[1]", "solve_ldl(w0, b0, 2)", *WRITE_ALL],
         "b0[1] is read before it is computed"),
        (["out[0] = out[1]"], "out cannot be read"),
        (["v0[0] = 1.0"], "'v0' is no array"),
        (["sin = 1.0"], "'sin' cannot be assigned"),
        (["open(1)"], "the only statements that are calls are those of factor_ldl"),
    ],
)  # fmt: skip
def test_names_the_function_and_the_element(lines, says):
    with pytest.raises(ModuleError) as caught:
        body(*lines, tables={"I0": (0, 1, 1, 3)})
    assert says in str(caught.value)


def test_accepts_what_is_complete():
    every = [0, 1, 2, 3]
    assert body(*WRITE_ALL) == every
    assert body("for k in range(4):", "    out[I0[k]] = y[k]", tables={"I0": (3, 1, 0, 2)}) == every
    assert body("out[3] = 1.0", sparse=True) == [3]
    # A recurrence; a sum that a loop makes; a solve; a solve for each of two members.
    assert body("w0 = [0.0]*5", "w0[0] = 1.0", "for k in range(4):", "    w0[1 + k] = w0[k]*2.0",
                "    out[k] = w0[1 + k]") == every  # fmt: skip
    assert (
        body("e0 = 0.0", "for k in range(3):", "    out[k] = y[k]", "    e0 = e0 + y[k]", "out[3] = e0")
        == every
    )
    solve = [*FACTORED, "b0 = [0.0]*2", "b0[1] = y[0]", "solve_ldl(w0, b0, 2)"]
    assert body(*solve, "out[0] = b0[0]", "out[1] = b0[1]", n=2) == [0, 1]
    each = [f"    {line}" for line in [*solve, "out[2*k] = b0[0]", "out[1 + 2*k] = b0[1]"]]
    assert body("for k in range(2):", *each) == every


def test_reads_python_that_stands_in_other_lines():
    """Modules may be written by hand: what the generator's lines say may be said in others."""
    assert body('"""Two', 'lines."""', "out[0] = (y[0]", "          + 1.0)  # a note", n=1) == [0]
    with pytest.raises(ModuleError, match=r"out\[1\] \(result 1\) is never written"):
        body("out[0] = (y[0] +", "    1.0)", n=2)


def planted(text):
    """Copies of a module with one line of a function deleted or doubled, or an entry of a table changed."""
    lines = text.split("\n")
    first = next(k for k, line in enumerate(lines) if line.startswith("@njit"))
    for k in range(first, len(lines)):
        if re.match(r" +(out\[|w\d+\[.*\] = |x\d+ = |q_|c\d+ = |for )", lines[k]):
            yield "\n".join(lines[:k] + lines[k + 1 :]), lines[k]
        if re.match(r" +out\[", lines[k]):
            yield "\n".join([*lines[: k + 1], *lines[k:]]), lines[k]


@pytest.mark.parametrize("name", ["four_bar", "spinning_top", "door_stop", "pendulum_field"])
def test_any_line_that_is_lost_or_doubled_is_noticed(name):
    """But for entries of derivatives by the state, and of what pictures show: those may be zero and are left out."""
    text = (GENERATED / f"{name}.py").read_text(encoding="utf-8")
    counts, rng = Counter(), np.random.default_rng(3)
    cases = list(planted(text))
    for k in rng.permutation(len(cases))[:60]:
        changed, line = cases[k]
        try:
            read_module(changed)
        except ModuleError:
            counts["refused"] += 1
        else:
            assert "out[" in line, line
            counts["sparse"] += 1
    assert counts["refused"] > 2 * counts["sparse"]


@pytest.mark.parametrize(("name", "change", "says"), [
    ("four_bar", ("    out[3] = ", "    x999 = "), "out[3] (dot(dot("),
    ("heavy_top_absolute", ("def mass_matrix", "def mass_matrix"), None),
])  # fmt: skip
def test_words_for_the_element(name, change, says):
    text = (GENERATED / f"{name}.py").read_text(encoding="utf-8")
    if says is None:
        read_module(text)
        return
    at = text.index("def rhs(")
    with pytest.raises(ModuleError) as caught:
        read_module(text[:at] + text[at:].replace(*change, 1))
    assert says in str(caught.value) and "function 'rhs'" in str(caught.value)


def test_matrices_are_held_against_each_other():
    text = (GENERATED / "double_pendulum.py").read_text(encoding="utf-8")
    at = text.index("def mass_matrix(")
    with pytest.raises(ModuleError, match=r"'mass_matrix': out\[2\] \(row 1, column 0\) is never written"):
        read_module(text[:at] + re.sub(r"    out\[2\] = .*\n", "", text[at:], count=1))
    at = text.index("def residual_jacobian(")
    with pytest.raises(ModuleError, match=r"'residual_jacobian': out\[4\] .* 'mass_matrix' has it"):
        read_module(text[:at] + re.sub(r"    out\[4\] = .*\n", "", text[at:], count=1))


def test_emitting_refuses_loops_that_lose_a_result(monkeypatch):
    """As they did from 79 links on: elements of a solution that went straight to `out` belonged to no cluster."""
    monkeypatch.setattr(function_text, "SMALLEST_ROLLED", 0)
    monkeypatch.setattr(choice, "FEWEST_RATES", 100)  # the full matrix, which is solved by loops
    model = load(find("n_pendulum"), {"N": "30"}).describe()
    assert "rhs" in read_module(emit(derive(model))).functions
    find_clusters = rolling.find

    def forgetful(g, written):
        found = find_clusters(g, written)
        found.roots = [root for root in found.roots if g.op[root] != "element"]
        return found

    monkeypatch.setattr(function_text, "find", forgetful)
    with pytest.raises(RuntimeError, match=r"'rhs' in loops enters \('out', 30\) 0 times instead of 1"):
        emit(derive(model))


def test_long_chains_move():
    """A run of 100 links once stood still, and every check passed."""
    system = link.derive(load(find("n_pendulum"), {"N": "80"}))
    p, rng = system.parameter_values(), np.random.default_rng(1)
    y = rng.uniform(-1.0, 1.0, 160)
    M = system.kernel("mass_matrix")(0.0, y, p).reshape(80, 80)
    expected = np.linalg.solve(M, system.kernel("forces")(0.0, y, p))
    assert system.kernel("rhs")(0.0, y, p)[80:] == pytest.approx(expected, rel=1e-9)


def test_sums_of_hundreds_are_written_flat():
    """Python reads no more than 200 parentheses in each other; `derive` writes nothing that it cannot read."""
    model = Model("heap")
    masses = model.parameters(**{f"m{k}": 1.0 + k for k in range(600)})
    x = model.coordinate("x", start=0.1)
    model.kinetic(sum(masses) * dot(x) ** 2 / 2)
    model.potential(sum(sin(k * x + m) * m for k, m in enumerate(masses)) - sum(cos(m) for m in masses) * x)
    text = link.derive_text(model).text
    compile(text, "heap.py", "exec")
    system = read_module(text)
    assert system.header["hoisted"]["mass_matrix"] < 20
    out = runtime.load(text).kernel("mass_matrix")(0.0, [0.1, 0.0], np.arange(1.0, 601.0))
    assert out[0] == pytest.approx(600 * 601 / 2, rel=1e-14)
    with pytest.raises(ModuleError, match="more than 150 parentheses"):
        body(f"out[0] = {'(1.0 + ' * 160}y[0]{')' * 160}", n=1)


@pytest.mark.parametrize(
    ("force", "turns_back"),
    [
        ("3", True),
        ("sin(x)", True),
        ("dot(x)^2*y", True),
        ("sqrt(1 + (dot(x)*dot(y))^2)", True),
        ("-dot(x)", False),
        ("dot(x)*dot(y)*dot(y)", False),
        ("atan2(dot(x), 1 + x^2)", False),
        ("tanh(dot(x))*tanh(dot(y))", True),
    ],
)
def test_whether_a_motion_turned_back_goes_the_same_way(force, turns_back):
    """By what operations are, and by accelerations and the power at states with rates of both signs."""
    model = Model("forced")
    model.coordinate("x"), model.coordinate("y")
    model.kinetic("(2 + sin(y))*dot(x)^2/2 + dot(y)^2/2 + dot(x)*dot(y)/2")
    model.force("x", force)
    system = model.derive()
    assert system.source.facts("rhs").turns_back == turns_back
    q, v, p = np.array([0.3, 0.8]), np.array([0.7, -1.9]), system.parameter_values()
    forth, back = (system.kernel("rhs")(0.0, np.concatenate([q, sign * v]), p)[2:5] for sign in (1.0, -1.0))
    assert np.allclose(forth, back * [1.0, 1.0, -1.0], rtol=1e-14, atol=0.0) == turns_back


def test_facts_are_read_as_they_were_written():
    for name in ("andrews_squeezer", "double_pendulum"):
        source = link.derive(load(find(name))).source
        known = {name: source.facts(name) for name in ("rhs", "residual")}
        assert facts.from_text(facts.as_text(known)) == known
    assert known["rhs"].turns_back and known["residual"].is_smooth
