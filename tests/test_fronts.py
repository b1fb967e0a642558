"""Sparse solves by fronts: against NumPy, in both forms of the code to the bit; tables that describe no elimination."""

from __future__ import annotations

import ctypes
import inspect
import itertools

import numpy as np
import pytest

from symgen import runtime
from symgen.derive.solve import fronts
from symgen.runtime.code import compiler, engine, front_ldl
from symgen.runtime.code.llvm_text import table as table_ir
from symgen.runtime.errors import ModuleError
from symgen.runtime.graph.form import Loop, Name, Place, Solve, Write
from symgen.runtime.index_tables import entries_of

PATTERNS = ["band", "grid", "star", "random", "full", "parts"]


def matrix(pattern, seed=0):
    """A negative definite matrix of a sparsity pattern."""
    rng = np.random.default_rng(seed)
    n = {"full": 23, "grid": 49}.get(pattern, 30)
    root = np.zeros((n, n))
    for i in range(n):
        near = {
            "band": [i + 1, i + 2],
            "grid": [i + 1 if (i + 1) % 7 else i, i + 7],
            "star": [n - 1],
            "random": rng.integers(0, n, 2),
            "full": range(n),
            "parts": [i + 1 if (i + 1) % 5 else i],
        }[pattern]
        for j in near:
            if i != j < n:
                root[i, j] = root[j, i] = rng.normal()
    return root - np.diag(np.abs(root).sum(axis=1) + 1.0)


SOLVERS = {
    "factor_fronts": "ptr %a", "solve_fronts": "ptr %a, ptr %b",
    front_ldl.FACTOR_FORWARD: "ptr %a, ptr %b", front_ldl.BACKWARD: "ptr %a, ptr %b",
}  # fmt: skip


def planned(K):
    """The plan of a matrix, and its numbers in the fronts' array."""
    plan = fronts.plan([{int(j) for j in np.flatnonzero(row)} - {i} for i, row in enumerate(K)])
    a = np.zeros(plan.n_values)
    a[list(plan.places)] = [K[entry] for entry in plan.entries]
    return plan, a


def compiled(plan):
    """Both solvers as machine code, and what does the work of both in one pass and half a one."""
    definitions = {name: front_ldl.definition(name, plan.table, plan.n_fronts) for name in SOLVERS}
    calls = [
        f"define void @{name}({arrays}) {{\ncall void @{definitions[name][0]}({arrays}, ptr @I0)\nret void\n}}\n"
        for name, arrays in SOLVERS.items()
    ]
    parts = dict(definitions.values())
    ir = table_ir("I0", plan.table) + "".join(parts.values()) + "".join(calls)
    keep = engine.MachineCode()
    keep.add(compiler.compile_ir(ir), "factor_fronts")
    return keep, *(
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * arrays.count("ptr"))(keep.address(name))
        for name, arrays in SOLVERS.items()
    )


def test_chain_is_eliminated_from_both_ends():
    """No front waits for the one right before it, up to where both sides meet."""
    plan = fronts.plan([{j for j in (i - 2, i - 1, i + 1, i + 2) if 0 <= j < 60} for i in range(60)])
    records = [plan.table[r : r + front_ldl.RECORD] for r in plan.table[: plan.n_fronts]]
    waits = [before[3] == after[0] for before, after in itertools.pairwise(records)]
    assert len(waits) > 8
    assert not any(waits[:-2])


@pytest.mark.parametrize("pattern", PATTERNS)
def test_solution_of_both_forms(pattern):
    K = matrix(pattern)
    plan, a = planned(K)
    right = np.random.default_rng(1).normal(size=len(K))
    by_python, solved, b = a.tolist(), right.tolist(), right.copy()
    front_ldl.factor_fronts(by_python, plan.table, plan.n_fronts)
    front_ldl.solve_fronts(by_python, solved, plan.table, plan.n_fronts)
    early, c = a.copy(), right.copy()
    _keep, factor, solve, factor_and_forward, backward = compiled(plan)
    factor(a.ctypes.data)
    solve(a.ctypes.data, b.ctypes.data)
    factor_and_forward(early.ctypes.data, c.ctypes.data)
    backward(early.ctypes.data, c.ctypes.data)
    assert b == pytest.approx(np.linalg.solve(K, right), rel=1e-11, abs=1e-12)
    assert solved == b.tolist() == c.tolist()
    assert by_python[-1] == a[-1]
    assert np.array_equal(early, a)


FACTOR, SOLVE = (
    Solve("factor_fronts", ("a",), "I0", (9,), 1),
    Solve("solve_fronts", ("a", "b"), "I0", (9,), 5),
)


@pytest.mark.parametrize(
    ("between", "early"),
    [
        ([Name("x", 0, 2, reads=(("a", Place(8)),)), Write("out", Place(3), 0, 3)], True),
        ([Name("x", 0, 2, reads=(("b", Place(0)),))], False),
        ([Write("b", Place(0), 0, 2)], False),
        ([Loop(4, (Write("b", Place(0, 1), 0, 3),), 2)], False),
        ([SOLVE._replace(arrays=("a", "c"))], False),  # the other right-hand side is taken
        ([FACTOR], True),  # the second one's
    ],
)
def test_right_hand_sides_that_are_there(between, early):
    """They are eliminated with the matrix only where nothing is done to them in between."""
    made = front_ldl.with_early_solves([FACTOR, *between, SOLVE])
    assert (made[-1].solver == front_ldl.BACKWARD) == early
    n_early = [s.solver for s in made if isinstance(s, Solve)].count(front_ldl.FACTOR_FORWARD)
    n_backward = [s.solver for s in made if isinstance(s, Solve)].count(front_ldl.BACKWARD)
    assert n_early == n_backward


@pytest.mark.parametrize("pattern", PATTERNS)
def test_ratio_is_the_smallest_relative_pivot(pattern):
    """In the order of elimination that the table says: D of LDLᵀ over the diagonal, as often as it counts."""
    K = matrix(pattern, seed=2)
    plan, a = planned(K)
    order, times = [], []
    for r in plan.table[: plan.n_fronts]:
        order += plan.table[r + front_ldl.RECORD : r + front_ldl.RECORD + plan.table[r + 2]]
        times += [plan.table[r + 5]] * plan.table[r + 2]
    assert sorted(order) == list(range(len(K)))
    lower = np.linalg.cholesky(-K[np.ix_(order, order)])
    a = a.tolist()
    front_ldl.factor_fronts(a, plan.table, plan.n_fronts)
    assert a[-1] == pytest.approx(min(1.0, *(times * np.diag(lower) ** 2 / -np.diag(K)[order])), rel=1e-10)


def pins_in_line(n, ends):
    """Of n bodies in line and of one mass, pinned to each other: what pins give way by along the line.

    Entries are G M⁻¹ Gᵀ for the forces in the pins: two bodies move at a pin, one at the first pin, which is to the
    ground; of two `ends`, the last body is pinned to the ground as well.
    """
    m = n + ends - 1
    K = np.diag(np.full(m, -2.0)) + np.diag(np.ones(m - 1), 1) + np.diag(np.ones(m - 1), -1)
    K[0, 0] = -1.0
    if ends == 2:
        K[-1, -1] = -1.0
    return K


def ratio_of(K):
    plan, a = planned(K)
    a = a.tolist()
    front_ldl.factor_fronts(a, plan.table, plan.n_fronts)
    return a[-1]


@pytest.mark.parametrize("n", [60, 500])
def test_ratio_tells_a_dead_point_from_a_long_chain(n):
    """A pivot where both sides of a chain meet is 1/n of what it was at first, and nothing is held twice."""
    assert ratio_of(pins_in_line(n, ends=1)) > 0.1
    for part, limit in ((1e-6, 1e-3), (1e-12, 1e-9)):
        held = pins_in_line(n, ends=2)
        held[n // 3, n // 3] *= 1.0 + part  # not quite in line
        assert ratio_of(held) < limit


def test_ratio_of_a_singular_matrix_is_zero_or_no_number():
    K = np.array([[-2.0, 2.0, 0.0], [2.0, -2.0, 0.0], [0.0, 0.0, -1.0]])
    plan, a = planned(K)
    _keep, factor, *_ = compiled(plan)
    factor(a.ctypes.data)
    assert not a[-1] > 0.0


@pytest.mark.parametrize("n", [50, 200])
def test_a_chain_costs_the_same_per_link(n):
    """Pins of two rows each: no fill beyond the next pin, whatever the length."""
    rows = [
        {j for j in range(2 * (i // 2) - 2, 2 * (i // 2) + 4) if 0 <= j < 2 * n and j != i}
        for i in range(2 * n)
    ]
    plan = fronts.plan(rows)
    assert plan.operations[0] <= 75 * n
    assert plan.operations[1] <= 45 * n


@pytest.mark.parametrize("name", fronts.TEXT)
def test_both_texts_are_one(name):
    assert fronts.TEXT[name] == inspect.getsource(getattr(front_ldl, name))


def test_tables_that_would_leave_the_arrays_are_refused():
    plan, a = planned(matrix("grid"))
    assert front_ldl.check(plan.table, plan.n_fronts, len(a), 49) == ""
    record = plan.table[3]
    for place, value in (
        (3, len(plan.table)),
        (record, len(a)),
        (record + 1, 40),
        (record + 2, 0),
        (record + 4, 0),
        (record + 5, 0),
    ):
        wrong = list(plan.table)
        wrong[place] = value
        assert front_ldl.check(wrong, plan.n_fronts, len(a), 49)
    assert "right-hand side" in front_ldl.check(plan.table, plan.n_fronts, len(a), 20)
    assert front_ldl.check(plan.table, 10**6, len(a))


def test_a_module_with_a_wrong_table_is_refused(large_chain_text):
    """Text of a stranger cannot make machine code write beyond its arrays."""
    system = runtime.load(large_chain_text)
    call = next(line for line in system.source.functions["rhs"].split("\n") if "factor_fronts(" in line)
    name = call.split(", ")[1]
    table = next(line for line in large_chain_text.split("\n") if line.startswith(f"{name} = ("))
    entries = list(entries_of(table.split(" = (")[1][:-1]))
    entries[entries[0]] = 999999
    text = large_chain_text.replace(table, f"{name} = {tuple(entries)}")
    with pytest.raises(ModuleError, match="does not lie in the array"):
        runtime.load(text).kernel("rhs")


@pytest.fixture(scope="module")
def large_chain_text():
    from symgen.link import derive_text
    from symgen.model.library import find, load

    return derive_text(load(find("chain_absolute"), {"N": "125"})).text
