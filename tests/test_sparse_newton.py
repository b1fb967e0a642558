"""Sparse Newton systems of large models: entries of matrices, factors, steps, time scales."""

from __future__ import annotations

import numpy as np
import pytest
from loops import bare_loop
from scipy.sparse import csc_matrix
from scipy.sparse import random as sparse_random

from symgen import Model, dot, runtime, sqrt
from symgen.link import derive_text
from symgen.model.library import find, load
from symgen.runtime.checks.extreme_rates import extreme_eigenvalues
from symgen.runtime.checks.time_scales import motion_jacobian
from symgen.runtime.code.compact import compact
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints.assembly import assemble
from symgen.runtime.errors import ModuleError
from symgen.runtime.integrate import large_models
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.layout import RUNNING, SINGULAR_MATRIX
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.integrate.sparse import (
    N_TABLES,
    SparseLU,
    differentiate_sparse,
    factor_shifted,
    newton_pattern,
    solve_shifted,
    sparse_factor,
    sparse_solve,
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


@jitted
def factor_for_complex(pattern, real, imag, sizes, y, entries, values, lu):
    return factor_shifted(pattern, complex(real, imag), sizes, y, entries, values, lu)


@pytest.mark.parametrize("g", [1e3, 1e3 * (2 - 3j)], ids=["real", "complex"])
@pytest.mark.parametrize("model", ["net", "chain"])
def test_newton_systems_are_those_of_full_matrices(model, g, request):
    """(g - B - A/g) Δv = r, with [A B] by inverting the derivatives of the whole residual."""
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
    lu = factors(n, pattern.room, kind)
    rest = (sizes, y, entries, np.zeros(len(pattern.rows), kind), lu)
    if kind is complex:
        assert factor_for_complex(pattern, g.real, g.imag, *rest) == RUNNING
    else:
        assert factor_shifted(pattern, g, *rest) == RUNNING
    r = np.random.default_rng(3).normal(size=nv).astype(kind)
    found = r.copy()
    solve_shifted(pattern, entries, np.zeros(nv, kind), found, np.zeros(n, kind), lu)
    expected = np.linalg.solve(g * np.eye(nv) - by_state[:, nq:] - by_state[:, :nq] / g, r)
    assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()


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


@pytest.mark.parametrize("model", ["net", "chain", "rods"])
def test_steps_are_those_of_full_matrices(model, request, monkeypatch):
    text = request.getfixturevalue(model)
    y, h, frame, kind = steps_of(text, 6, 1, monkeypatch)
    expected = steps_of(text, 6, 10**9, monkeypatch)
    assert (kind, expected[3]) == ("SparseRadauIIA", "RadauIIA")
    assert h == pytest.approx(expected[1], rel=1e-9)
    assert np.abs(y - expected[0]).max() < 1e-9 * np.abs(expected[0]).max()
    assert np.abs(frame - expected[2]).max() < 1e-9 * np.abs(expected[2]).max()


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

    def test_a_net_of_bars_runs_as_an_explicit_method_says(self, lattice):
        """It found no room for its factors, at the first step and at however short ones."""
        stiff = runtime.load(lattice).run(t_end=0.1, method="radau5", rtol=1e-6, atol=1e-8, fps=10.0)
        explicit = runtime.load(lattice).run(t_end=0.1, method="dop853", rtol=1e-9, atol=1e-11, fps=10.0)
        assert stiff.status == explicit.status == "success"
        assert np.abs(stiff.q[-1] - explicit.q[-1]).max() < 1e-7
        assert np.abs(stiff.v[-1] - explicit.v[-1]).max() < 1e-6
