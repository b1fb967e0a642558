"""Sparse Newton systems of large models: entries of matrices, factors, steps, time scales."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from loops import bare_loop
from scipy.sparse import csc_matrix
from scipy.sparse import random as sparse_random

from symgen import Model, cos, dot, runtime, sin, sqrt
from symgen.link import derive_text
from symgen.model.library import find, load
from symgen.runtime.checks.extreme_rates import extreme_eigenvalues
from symgen.runtime.checks.time_scales import motion_jacobian
from symgen.runtime.code.compact import compact
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.errors import ModuleError
from symgen.runtime.integrate import large_models, sparse
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.front_plan import front_plan
from symgen.runtime.integrate.fronts import SOURCES, FrontLU, eliminate_fronts, solve_fronts
from symgen.runtime.integrate.layout import REACHED_STOP, RUNNING, SINGULAR_MATRIX
from symgen.runtime.integrate.left_looking import (
    N_TABLES,
    SparseLU,
    eliminate_again,
    sparse_factor,
    sparse_solve,
)
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.integrate.newton_lu import (
    BY_FRONTS,
    BY_SIZE,
    REFINED,
    complex_newton_lu,
    factor_newton,
    new_spare,
    newton_lu,
    newton_lu_size,
    solve_newton,
)
from symgen.runtime.integrate.sparse import (
    N_KINDS,
    NewtonPattern,
    differentiate_sparse,
    factor_shifted,
    newton_pattern,
    solve_shifted,
)
from symgen.runtime.loop_arrays import LoopArrays, loop_sizes


def spring_net(n, k=1e6, c=200.0):
    """Masses in the plane on stiff springs, the first row fixed, one of them pushed by an input."""
    model = Model("spring_net")
    m, length, k, c = model.parameters(m=0.5, length=0.2, k=k, c=c)
    push = model.input("push")
    model.gravity(y=-9.81)
    nodes = {(0, j): (0.2 * j, 0.0) for j in range(n)}
    for i in range(1, n):
        for j in range(n):
            x = model.coordinate(f"x{i}_{j}", start=0.2 * j, rate=0.0)
            y = model.coordinate(f"y{i}_{j}", start=-0.2 * i, rate=0.0)
            model.body(f"mass{i}_{j}", mass=m, com=(x, y))
            nodes[i, j] = x, y
    for i, j in nodes:
        for name, other in ((f"d{i}_{j}", (i + 1, j)), (f"r{i}_{j}", (i, j + 1))):
            if other in nodes and other[0]:
                (x0, y0), (x1, y1) = nodes[i, j], nodes[other]
                stretch = model.definition(name, sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2) - length)
                model.potential(k / 2 * stretch**2)
                model.dissipation(c / 2 * dot(stretch) ** 2)
    model.force(f"x{n - 1}_{n - 1}", push)
    return derive_text(model).text


@pytest.fixture(scope="module")
def net():
    return spring_net(4)


@pytest.fixture(scope="module")
def chain():
    return derive_text(load(find("chain_absolute"), {"N": "4"})).text


@pytest.fixture(scope="module")
def rods():
    """Three bodies in space with quaternions: a ball joint to the ground, then stiff damped springs at two points."""
    model = Model("rods", gravity=(0, 0, -9.81))
    model.parameters(k=1e6, c=300.0)
    model.point("hook", at=(0, 0, 0))
    for n in range(1, 4):
        model.body(f"rod{n}", mass=0.5, inertia=(0.02, 0.03, 0.005))
        model.joint(f"fly{n}", "free", f"rod{n}", start=(0.4 * n - 0.2, 0, 0, 1, 0, 0, 0))
        for end, x in (("a", -0.2), ("b", 0.2)):
            model.point(f"{end}{n}", f"rod{n}", (x, 0, 0))
    model.coincident("pin", "hook", "a1")
    for n in (2, 3):
        for axis in "xyz":
            stretch = f"(a{n}_{axis} - b{n - 1}_{axis})"
            model.potential(f"k/2*{stretch}**2")
            model.dissipation(f"c/2*(dot(a{n}_{axis}) - dot(b{n - 1}_{axis}))**2")
    return derive_text(model).text


def moving_state(system, seed=2):
    """A state near the start, with its accelerations and multipliers: what `residual_jacobian` reads."""
    rng = np.random.default_rng(seed)
    q, v, _, _ = system.initial_state()
    q, v = q + 0.01 * rng.normal(size=q.size), v + rng.normal(size=v.size)
    row = system.kernel("rhs")(0.0, np.concatenate([q, v]), system.parameter_values())
    y = np.concatenate([q, v, np.zeros(system.nw)])
    return y, row


@pytest.fixture(scope="module")
def lattice():
    return derive_text(load(find("lattice"), {"N": "9"})).text


class TestEntries:
    @pytest.mark.parametrize("function", ["residual_jacobian", "mass_matrix", "constraint_jacobian"])
    @pytest.mark.parametrize("model", ["chain", "lattice"])
    def test_entries_are_those_of_the_matrix(self, model, function, request):
        """The chain is written out, the lattice has loops over tables."""
        system = runtime.load(request.getfixturevalue(model))
        whole, entries = system.kernel(function), system.kernel(f"{function}_entries")
        y = np.random.default_rng(1).normal(size=whole.source.lengths.y)
        p = system.parameter_values()
        found, expected = np.zeros(whole.out_size), whole(0.5, y, p)
        found[system.entry_places(function)] = entries(0.5, y, p)
        assert np.array_equal(found, expected)
        precomputed = np.zeros(entries.out_size)
        runtime.code.bridge.call_kernel(
            entries.precomputed_address, 0.5, y, system.precomputed(p), precomputed
        )
        assert np.array_equal(precomputed, entries(0.5, y, p))

    def test_places_that_are_written_twice_or_in_no_progression_go_through_a_table(self):
        text = (
            "def f(t, y, p, out):\n    out[7] = t\n    for k in range(3):\n        out[I0[k]] = t + y[k]\n"
            "    for k in range(2):\n        out[1 + 4*k] = y[k]\n"
        )
        function = FunctionText("f", text, Lengths(3, 0, 9), {"I0": (5, 7, 2)})
        shorter, places = compact(function)
        assert places.tolist() == [7, 5, 2, 1]
        out, expected, y = np.zeros(4), np.zeros(9), np.array([1.0, 2.0, 3.0])
        shorter.python_function()(0.5, y, [], out)
        function.python_function()(0.5, y, [], expected)
        found = np.zeros(9)
        found[places] = out
        assert np.array_equal(found, expected)

    def test_an_index_outside_of_the_grammar_is_refused(self):
        function = FunctionText("f", "def f(t, y, p, out):\n    out[y[0]] = t\n", Lengths(1, 0, 1))
        with pytest.raises(ModuleError, match="the index of out"):
            compact(function)


def factors(n, room, kind):
    """Room for factors of n rows, whose rows count alike."""
    starts = [np.zeros(n + 1, np.int64) for _ in range(2)]
    rows = [np.zeros(room, np.int64) for _ in range(2)]
    values = [np.zeros(room, kind) for _ in range(2)]
    return SparseLU(*starts, *rows, *values, np.zeros((N_TABLES, n), np.int64), np.ones(n), np.zeros(n, kind))


def arrays(matrix):
    return matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64), matrix.data.copy()


class TestFactors:
    @pytest.mark.parametrize("kind", [float, complex])
    @pytest.mark.parametrize("n", [1, 12, 80])
    def test_solution_agrees_with_numpy(self, n, kind):
        """Matrices with zeros on the diagonal, regular by a permutation, in any order of columns."""
        rng = np.random.default_rng(n)
        whole = sparse_random(n, n, min(1.0, 4.0 / n), random_state=n).toarray()
        whole[rng.permutation(n), np.arange(n)] += 2.0 + rng.random(n)
        whole = whole * np.exp(1j * rng.random((n, n))) if kind is complex else whole
        matrix, order = csc_matrix(whole), rng.permutation(n).astype(np.int64)
        lu = factors(n, n * n + n, kind)
        lu.scale[:] = 10.0 ** rng.uniform(-3, 3, n)
        assert sparse_factor(*arrays(matrix), order, lu) == RUNNING
        b = rng.normal(size=n).astype(kind)
        x = b.copy()
        sparse_solve(order, lu, x)
        assert x == pytest.approx(np.linalg.solve(whole, b), rel=1e-9, abs=1e-11)

    @pytest.mark.parametrize("kind", [float, complex])
    @pytest.mark.parametrize("change, again", [(1e-6, True), (3.0, False)])
    def test_what_was_factored_before_leaves_no_trace(self, kind, change, again):
        """Pivots and patterns are taken over where they are those of another matrix of this pattern, and only there."""
        rng, n = np.random.default_rng(7), 60
        matrix = sparse_random(n, n, 4.0 / n, random_state=3).tolil()
        matrix[rng.permutation(n), np.arange(n)] = 2.0 + rng.random(n)
        matrix, order = csc_matrix(matrix), rng.permutation(n).astype(np.int64)
        start, rows, values = arrays(matrix)
        values = values * np.exp(1j * rng.random(len(values))) if kind is complex else values
        used, fresh = factors(n, n * n + n, kind), factors(n, n * n + n, kind)
        assert sparse_factor(start, rows, values, order, used) == RUNNING
        values = values * np.exp(change * rng.normal(size=len(values)))
        taken_over = copy.deepcopy(used)
        assert eliminate_again(start, rows, values, order, taken_over) == again
        for lu in (used, fresh):
            assert sparse_factor(start, rows, values, order, lu) == RUNNING
        for lu in (used, taken_over) if again else (used,):
            b = rng.normal(size=n).astype(kind)
            x, expected = b.copy(), b.copy()
            sparse_solve(order, lu, x)
            sparse_solve(order, fresh, expected)
            np.testing.assert_array_equal(x, expected)
            np.testing.assert_array_equal(lu.lower_row, fresh.lower_row)

    def test_equal_rivals_of_a_pivot_are_left_to_the_search(self):
        """Off the diagonal, the first of the largest is taken, which only the search knows."""
        start, rows = np.array([0, 2, 4, 6]), np.array([1, 2, 0, 2, 0, 1])
        order = np.arange(3)
        used, fresh = factors(3, 12, float), factors(3, 12, float)
        assert sparse_factor(start, rows, np.array([1.0, 2.0, 1.0, 1.0, 1.0, 1.0]), order, used) == RUNNING
        equal = np.array([2.0, 2.0, 1.0, 1.0, 1.0, 1.0])
        for lu in (used, fresh):
            assert sparse_factor(start, rows, equal, order, lu) == RUNNING
        np.testing.assert_array_equal(used.tables[0], fresh.tables[0])

    def test_diagonal_pivots_keep_an_arrow_sparse(self):
        n = 30
        whole = np.diag(np.full(n, 4.0))
        whole[-1], whole[:, -1] = 1.0, 1.0
        whole[-1, -1] = 4.0 * n
        lu = factors(n, 4 * n, float)
        assert sparse_factor(*arrays(csc_matrix(whole)), np.arange(n), lu) == RUNNING
        assert lu.lower_start[n] == n - 1

    def test_singular_matrices_and_too_little_room_are_said(self):
        whole = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0], [0.0, 1.0, 1.0]])
        lu = factors(3, 12, float)
        assert sparse_factor(*arrays(csc_matrix(whole)), np.arange(3), lu) == SINGULAR_MATRIX
        full = np.random.default_rng(0).normal(size=(8, 8))
        lu = factors(8, 20, float)
        assert sparse_factor(*arrays(csc_matrix(full)), np.arange(8), lu) == SINGULAR_MATRIX


def front_lu(plan, kind):
    n = len(plan.order)
    values, front, waiting = (
        np.zeros(k, kind) for k in (plan.value_start[-1], plan.largest**2, plan.n_waiting)
    )
    pivots, held = (np.zeros(n, np.int64) for _ in range(2))
    return FrontLU(values, front, waiting, pivots, held, np.zeros(SOURCES * plan.largest, kind))


class TestFronts:
    @pytest.mark.parametrize("kind", [float, complex])
    @pytest.mark.parametrize("n", [1, 12, 80])
    def test_solution_agrees_with_numpy(self, n, kind):
        """In any order, whatever the pattern: forests, full roots, one row."""
        rng = np.random.default_rng(n)
        whole = sparse_random(n, n, min(1.0, 3.0 / n), random_state=n).toarray() + np.diag(
            2.0 + rng.random(n)
        )
        whole = whole * np.exp(1j * rng.random((n, n))) if kind is complex else whole
        matrix = csc_matrix(whole)
        column = np.repeat(np.arange(n), np.diff(matrix.indptr))
        plan = front_plan(matrix.indices, column, rng.permutation(n))
        assert np.array_equal(np.sort(plan.order), np.arange(n))
        lu = front_lu(plan, kind)
        assert eliminate_fronts(plan, matrix.data.copy(), lu) == RUNNING
        b = rng.normal(size=n).astype(kind)
        x = b[plan.order]
        solve_fronts(plan, lu, x)
        assert x == pytest.approx(np.linalg.solve(whole, b)[plan.order], rel=1e-9, abs=1e-11)

    def test_products_are_those_of_an_elimination(self):
        """Of an arrow, each column leaves one product; columns that join fronts a few more."""
        n = 40
        whole = np.eye(n)
        whole[-1], whole[:, -1] = 1.0, 1.0
        i, j = np.nonzero(whole)
        assert n - 1 <= front_plan(i, j, np.arange(n)).products < n + 100
        assert front_plan(i, j, np.arange(n)[::-1]).products > n**3 / 4

    def test_a_front_without_a_pivot_is_singular(self):
        plan = front_plan(np.array([0, 1]), np.array([0, 1]), np.arange(2))
        assert eliminate_fronts(plan, np.array([1.0, 0.0]), front_lu(plan, float)) == SINGULAR_MATRIX


@jitted
def factor_and_solve(pattern, nv, values, b, work, spare):
    lu = newton_lu(pattern, nv, work, spare)
    for i in range(b.shape[0]):
        lu.scale[i] = 1.0
    status = factor_newton(pattern, nv, values, lu)
    if status == RUNNING:
        solve_newton(pattern, lu, b)
    return lu.kind[0] if status == RUNNING else -1


@pytest.mark.parametrize("first, kind", [(1.0, BY_FRONTS), (0.0, BY_SIZE), (1e-14, BY_SIZE)])
def test_where_fronts_have_no_good_pivot_rows_become_pivots_by_size(first, kind):
    n = 30
    whole = np.diag(np.full(n, 4.0))
    whole[-1], whole[:, -1] = 1.0, 1.0
    whole[-1, -1] = 4.0 * n
    matrix = csc_matrix(whole)
    whole[0, 0] = matrix.data[0] = first  # stands there even where it is zero
    column = np.repeat(np.arange(n), np.diff(matrix.indptr))
    nothing, order = np.zeros(0, np.int64), np.arange(n)
    plan = front_plan(matrix.indices, column, order)
    start, rows, values = arrays(matrix)
    pattern = NewtonPattern(
        nothing, nothing, nothing, nothing, nothing, np.zeros(N_KINDS + 1, np.int64), nothing.reshape(0, 6), start,
        rows, order, n, n * n + n, plan, nothing.reshape(0, 4),
    )  # fmt: skip
    b = np.random.default_rng(5).normal(size=n)
    x = b.copy()
    assert (
        factor_and_solve(
            pattern, n, values, x, np.zeros(newton_lu_size(pattern, n, 1)), new_spare(pattern, 0)
        )
        == kind
    )
    assert x == pytest.approx(np.linalg.solve(whole, b), rel=1e-11)


@jitted
def real_change(pattern, g, imag, sizes, y, entries, values, r, right, turned, work, spare, refined):
    lu = newton_lu(pattern, sizes[at.NV], work, spare)
    status = factor_shifted(pattern, g, sizes, y, entries, values, lu)
    kind = lu.kind[0]
    if refined and kind == BY_FRONTS:
        lu.kind[0] = REFINED
    solve_shifted(pattern, entries, turned, r, right, lu)
    return 10 * status + kind


@jitted
def complex_change(pattern, g, imag, sizes, y, entries, values, r, right, turned, work, spare, refined):
    lu = complex_newton_lu(pattern, sizes[at.NV], 0, work, spare)
    status = factor_shifted(pattern, complex(g, imag), sizes, y, entries, values, lu)
    kind = lu.kind[0]
    if refined and kind == BY_FRONTS:
        lu.kind[0] = REFINED
    solve_shifted(pattern, entries, turned, r, right, lu)
    return 10 * status + kind


@pytest.mark.parametrize("g", [1e3, 1e3 * (2 - 3j)], ids=["real", "complex"])
@pytest.mark.parametrize("kind_of_factors", [BY_FRONTS, BY_SIZE])
@pytest.mark.parametrize(
    "model, within, refined",
    [("net", 1e-11, False), ("chain", 1e-11, False), ("lattice", 1e-6, False), ("lattice", 1e-8, True)],
)
def test_newton_systems_are_those_of_full_matrices(
    model, within, refined, kind_of_factors, g, request, monkeypatch
):
    """(g - B - A/g) Δv = r, with [A B] by inverting the derivatives of the whole residual."""
    monkeypatch.setattr(sparse, "FEWEST_PRODUCTS", 0 if kind_of_factors == BY_FRONTS else 10**9)
    system = runtime.load(request.getfixturevalue(model))
    n, nq, nv = system.nv + system.m, system.nq, system.nv
    y, row = moving_state(system)
    pattern, sizes, p = (
        newton_pattern(system),
        loop_sizes(system, with_events=False),
        system.parameter_values(),
    )
    addresses = np.zeros(at.N_KERNELS, dtype=np.uint64)
    kernel = system.kernel("residual_jacobian_entries")
    addresses[at.RESIDUAL_JACOBIAN] = kernel.precomputed_address
    arguments, entries = np.zeros(nq + nv + n), np.zeros(len(pattern.kind))
    loop = bare_loop(sizes, system.precomputed(p), addresses, y)
    status = differentiate_sparse(pattern, loop, 0.0, row, arguments, entries)
    assert status == RUNNING
    whole = system.kernel("residual_jacobian")(0.0, arguments, p).reshape(n, -1)
    by_state = -np.linalg.solve(whole[:, nq + nv :], whole[:, : nq + nv])[:nv]
    kind = type(g)
    r = np.random.default_rng(3).normal(size=nv).astype(kind)
    found = r.copy()
    change, width = (complex_change, 2) if kind is complex else (real_change, 1)
    status = change(
        pattern, g.real, g.imag, sizes, y, entries, np.zeros(len(pattern.rows), kind), found, np.zeros(n, kind),
        np.zeros(nv, kind), np.zeros(newton_lu_size(pattern, nv, width)), new_spare(pattern, 1), refined,
    )  # fmt: skip
    assert status == 10 * RUNNING + kind_of_factors
    expected = np.linalg.solve(g * np.eye(nv) - by_state[:, nq:] - by_state[:, :nq] / g, r)
    assert np.abs(found - expected).max() < within * np.abs(expected).max()


def steps_of(text, n_steps, smallest, monkeypatch):
    """The state after some steps of radau5 of one length, by full or sparse matrices, and a frame on the way.

    Lengths that it chooses itself hang on how fast Newton contracts, which in the end is round-off.
    """
    monkeypatch.setattr(large_models, "SMALLEST_SPARSE", smallest)
    monkeypatch.setattr(large_models, "MOST_FULL", 1.0)
    system = runtime.load(text)
    spin = {
        r["name"]: 0.1 * k for k, r in enumerate(system.rates) if r["name"].endswith(("_wx", "_wy", "_wz"))
    }
    start = assemble(system, system.parameter_values(), rate=spin)
    run = LoopArrays(
        system, METHODS["radau5"], system.parameter_values(), 0.0, np.concatenate([start.q, start.v]),
        frame_times=np.array([0.00037]), rtol=1e-4, atol=1e-6, step=1e-4,
    )  # fmt: skip
    run.control[at.H_MAX] = 1e-4
    assert run.advance(1.0, n_steps) == RUNNING
    return run.y, run.new_steps[:, 1], run.frames[0], type(run.coefficients).__name__


@pytest.mark.parametrize("fewest_products", [0, 10**9], ids=["fronts", "by size"])
@pytest.mark.parametrize("model", ["net", "chain", "rods"])
def test_steps_are_those_of_full_matrices(model, fewest_products, request, monkeypatch):
    monkeypatch.setattr(sparse, "FEWEST_PRODUCTS", fewest_products)
    text = request.getfixturevalue(model)
    y, h, frame, kind = steps_of(text, 6, 1, monkeypatch)
    expected = steps_of(text, 6, 10**9, monkeypatch)
    assert (kind, expected[3]) == ("SparseRadauIIA", "RadauIIA")
    assert h == pytest.approx(expected[1], rel=1e-9)
    assert np.abs(y - expected[0]).max() < 1e-9 * np.abs(expected[0]).max()
    assert np.abs(frame - expected[2]).max() < 1e-9 * np.abs(expected[2]).max()


@pytest.mark.parametrize("method", ["radau5", "generalized_alpha"])
def test_factors_by_size_are_made_again_where_a_run_goes_back(method, chain, monkeypatch):
    """They are no part of what a run carries: from a state, its arrays and others' go on with the same bits."""
    monkeypatch.setattr(large_models, "SMALLEST_SPARSE", 1)
    monkeypatch.setattr(large_models, "MOST_FULL", 1.0)
    monkeypatch.setattr(sparse, "FEWEST_PRODUCTS", 10**9)
    system = runtime.load(chain)
    start = assemble(system, system.parameter_values())
    record = METHODS["radau5"] if method == "radau5" else FORMS["index3"][method]

    def arrays():
        return LoopArrays(
            system, record, system.parameter_values(), 0.0, np.concatenate([start.q, start.v]),
            frame_times=np.zeros(0), rtol=1e-4, atol=1e-6, step=1e-3,
        )  # fmt: skip

    run, other = arrays(), arrays()
    assert "pattern" in run.coefficients._fields
    run.control[at.H_MAX] = 1e-3
    assert run.advance(10.0, 8) == RUNNING
    held = run.state()
    assert run.advance(10.0, 30) == RUNNING and run.coefficients.spare.any()
    expected = run.y.copy()
    for again in (run, other):
        again.restore(held)
        before = again.counters[at.FACTORISATIONS]
        assert again.advance(10.0, 1) == RUNNING
        assert again.counters[at.FACTORISATIONS] == before  # those of before serve this step
        assert again.advance(10.0, 29) == RUNNING
        assert np.array_equal(again.y, expected)


def test_inputs_over_time_act_in_sparse_systems(net, monkeypatch):
    monkeypatch.setattr(large_models, "SMALLEST_SPARSE", 1)
    monkeypatch.setattr(large_models, "MOST_FULL", 1.0)
    options = {
        "t_end": 0.02,
        "rtol": 1e-9,
        "atol": 1e-11,
        "inputs": {"push": ([0.0, 0.01, 0.02], [0.0, 900.0, 0.0])},
    }
    run = runtime.load(net).run(method="radau5", **options)
    expected = runtime.load(net).run(method="dop853", **options)
    assert run.status == "success"
    assert run.q[-1] == pytest.approx(expected.q[-1], abs=1e-9)
    assert np.abs(run.v[-1]).max() > 0.1


def test_models_of_full_matrices_keep_them(monkeypatch):
    monkeypatch.setattr(large_models, "SMALLEST_SPARSE", 1)
    system = runtime.load(derive_text(load(find("n_pendulum"), {"N": "12"})).text)
    assert large_models.suited_to_size(METHODS["radau5"], system) is METHODS["radau5"]
    assert large_models.suited_to_size(METHODS["bdf"], system) is METHODS["bdf"]


@pytest.mark.parametrize("damping", [200.0, 3e4], ids=["vibrating", "creeping"])
def test_extreme_eigenvalues_are_those_of_the_whole_jacobian(damping):
    system = runtime.load(spring_net(5, c=damping))
    p = system.parameter_values()
    q, v, _, _ = system.initial_state()
    v = v + 0.3 * np.random.default_rng(1).normal(size=v.size)
    found = extreme_eigenvalues(system, p, 0.0, q, v)
    expected = np.linalg.eigvals(motion_jacobian(system, p, 0.0, q, v))
    assert np.abs(found).max() == pytest.approx(np.abs(expected).max(), rel=0.02)
    assert found.real.min() == pytest.approx(expected.real.min(), rel=0.02)
    if damping < 1e3:
        assert np.abs(found.imag).max() == pytest.approx(np.abs(expected.imag).max(), rel=0.02)


class TestNets:
    """Multipliers have no diagonal until the coordinates of their constraints are eliminated."""

    @pytest.mark.parametrize("model", ["chain", "lattice"])
    def test_multipliers_come_after_their_coordinates(self, model, request):
        system = runtime.load(request.getfixturevalue(model))
        pattern, nv = newton_pattern(system), system.nv
        place = np.argsort(pattern.order)
        assert np.array_equal(np.sort(pattern.order), np.arange(nv + system.m))
        column = np.repeat(np.arange(nv + system.m), np.diff(pattern.start))
        own = (pattern.rows >= nv) & (column < nv)
        assert own.any() and (place[pattern.rows[own]] > place[column[own]]).all()

    def test_a_diagonal_spares_a_net_most_of_its_products(self, lattice, chain):
        """Where multipliers stand anyway, as in a chain, they get none."""
        assert len(newton_pattern(runtime.load(chain)).pairs) == 0
        system = runtime.load(lattice)
        pattern = newton_pattern(system)
        column = np.repeat(np.arange(len(pattern.order)), np.diff(pattern.start))
        assert len(pattern.pairs) > system.m
        assert pattern.plan.products < 0.5 * front_plan(pattern.rows, column, pattern.order).products

    def test_a_net_of_bars_runs_as_an_explicit_method_says(self, lattice):
        """It found no room for its factors, at the first step and at however short ones; now they serve several."""
        stiff = runtime.load(lattice).run(t_end=0.1, method="radau5", rtol=1e-6, atol=1e-8, fps=10.0)
        explicit = runtime.load(lattice).run(t_end=0.1, method="dop853", rtol=1e-9, atol=1e-11, fps=10.0)
        assert stiff.status == explicit.status == "success"
        assert np.abs(stiff.q[-1] - explicit.q[-1]).max() < 1e-7
        assert np.abs(stiff.v[-1] - explicit.v[-1]).max() < 1e-6
        assert stiff.stats["jacobians"] < stiff.stats["steps"] / 4  # they serve others
        assert stiff.stats["factorisations"] < stiff.stats["steps"]


def steps_of_alpha(system, sparse, monkeypatch):
    """The state after 20 steps of index 3, by full or sparse matrices."""
    monkeypatch.setattr(large_models, "SMALLEST_SPARSE", 1 if sparse else 10**9)
    monkeypatch.setattr(large_models, "MOST_FULL", 1.0)
    start = assemble(system, system.parameter_values(), {}, {}, 0.0)
    method = large_models.suited_to_size(FORMS["index3"]["generalized_alpha"], system)
    run = LoopArrays(
        system, method, system.parameter_values(), 0.0, np.concatenate([start.q, start.v]),
        frame_times=np.zeros(0), rtol=1e-8, atol=1e-10, step=2e-3, with_events=False,
    )  # fmt: skip
    assert run.advance(0.04, 100) == REACHED_STOP
    return run.y, type(run.coefficients).__name__


@pytest.mark.parametrize("model", ["chain", "lattice", "stick"])
def test_steps_of_index_3_are_those_of_full_matrices(model, request, monkeypatch):
    system = runtime.load(stick()) if model == "stick" else runtime.load(request.getfixturevalue(model))
    y, kind = steps_of_alpha(system, True, monkeypatch)
    expected, full = steps_of_alpha(system, False, monkeypatch)
    assert (kind, full) == ("SparseAlpha", "ConstrainedAlpha")
    assert np.abs(expected[system.nq :]).max() > 0.1
    assert np.abs(y - expected).max() < 1e-9 * np.abs(expected).max()


def stick():
    """A skate on an incline, whose speed across is zero, with a mass that a bar holds on to it."""
    model = Model("skate", gravity=(0, -9.81))
    x, y, a, u, w = (model.coordinate(n, start=s, rate=r) for n, s, r in (
        ("x", 0.0, 0.0), ("y", 0.0, 0.0), ("a", 0.3, 2.0), ("u", 1.0, 0.0), ("w", 0.0, 0.0)
    ))  # fmt: skip
    model.body("skate", mass=1.0, inertia=0.2, com=(x, y), angle=a)
    model.body("mass", mass=0.5, com=(u, w))
    model.constraint("bar", (x - u) ** 2 + (y - w) ** 2 - 1.0)
    model.velocity_constraint("edge", dot(y) * cos(a) - dot(x) * sin(a))
    return derive_text(model).text
