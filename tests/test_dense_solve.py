"""Dense solves by loops: against NumPy, in all forms of the code to the bit, and in a long chain's equations."""

from __future__ import annotations

import ctypes
import inspect
from unittest import mock

import numpy as np
import pytest
from mechanisms import GRAVITY, body, describe

from symgen import Model, cos, link, runtime, sin
from symgen.derive.graph.graph import Graph
from symgen.derive.pipeline import derive
from symgen.derive.solve import choice, dense_solve
from symgen.emit.module import emit
from symgen.runtime.code import compiler, dense_ldl, engine
from symgen.runtime.errors import ModuleError

SIZES = [(1, 1), (2, 1), (3, 2), (4, 4), (6, 5), (9, 6), (13, 13), (30, 22), (41, 41)]


def saddle_point(n, nc, seed=0):
    """A random matrix [M Gᵀ; G 0] with M positive definite, nc x nc, and G of full rank."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(nc, nc))
    G = rng.normal(size=(n - nc, nc))
    return np.block([[root @ root.T + nc * np.eye(nc), G.T], [G, np.zeros((n - nc, n - nc))]])


def stored(matrix):
    return np.concatenate([np.triu(matrix).ravel(), np.zeros(len(matrix))])


def compiled(name, sizes, n_arrays):
    """A solver's machine code as a function of arrays; `keep` holds the code."""
    symbol, text = dense_ldl.definition(name, sizes)
    arguments = ", ".join(f"ptr %a{k}" for k in range(n_arrays))
    ir = f"{text}define void @entry({arguments}) {{\ncall void @{symbol}({arguments})\nret void\n}}\n"
    keep = engine.MachineCode()
    address = keep.add(compiler.compile_ir(ir), "entry")
    call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * n_arrays)(address)
    return keep, lambda *arrays: call(*(a.ctypes.data for a in arrays))


@pytest.mark.parametrize(("n", "nc"), SIZES)
def test_solution_of_both_forms(n, nc):
    """Right by NumPy, and Python and machine code agree in every bit that is read again."""
    K = saddle_point(n, nc)
    right = np.random.default_rng(1).normal(size=n)
    a, b = stored(K), right.copy()
    by_python, solved = list(a), list(b)
    dense_ldl.factor_ldl(by_python, n, nc)
    dense_ldl.solve_ldl(by_python, solved, n)
    _keep, factor = compiled("factor_ldl", [n, nc], 1)
    _keep2, solve = compiled("solve_ldl", [n], 2)
    factor(a)
    solve(a, b)
    assert b == pytest.approx(np.linalg.solve(K, right), rel=1e-9, abs=1e-9)
    upper = np.triu_indices(n)
    assert np.array_equal(np.reshape(by_python[: n * n], (n, n))[upper], a[: n * n].reshape(n, n)[upper])
    assert by_python[n * n :] == list(a[n * n :])
    assert solved == list(b)


def test_conditions_are_schur_complements():
    """The references of constraints: -diag(G M⁻¹ Gᵀ); a pivot is that of the rows before it, eliminated."""
    n, nc = 7, 4
    K = saddle_point(n, nc, seed=3)
    schur = -K[nc:, :nc] @ np.linalg.solve(K[:nc, :nc], K[:nc, nc:])
    a = list(stored(K))
    dense_ldl.factor_ldl(a, n, nc)
    assert a[n * n + nc :] == pytest.approx(np.diag(schur))
    pivots = [1.0 / a[i * n + i] for i in range(nc, n)]
    minors = [np.linalg.det(schur[:k, :k]) for k in range(n - nc + 1)]
    assert pivots == pytest.approx([b / c for b, c in zip(minors[1:], minors[:-1], strict=True)])


def test_both_packages_hold_the_same_text():
    for name, text in dense_solve.TEXT.items():
        assert text == inspect.getsource(getattr(dense_ldl, name))
        assert dense_ldl.is_known(text)
        assert not dense_ldl.is_known(text.replace("range(n)", "range(n + 1)"))


@pytest.mark.parametrize("sizes", [[5, 3], [6, 6]])
def test_operations_are_counted_alike(sizes):
    """The graph's and the run time's counts, and what Python's own operators see."""
    n, nc = sizes
    g = Graph()
    K = saddle_point(n, nc)
    rows = [{j: g.const(x) for j, x in enumerate(row) if x} for row in K]
    factors = dense_solve.factor(g, rows, nc, [g.zero] * n)
    solution = dense_solve.solve(g, factors, [g.one] * n)
    assert g.cost(factors) == dense_ldl.operations("factor_ldl", sizes)
    assert g.count(solution) == dense_ldl.operations("factor_ldl", sizes) + dense_ldl.operations(
        "solve_ldl", sizes
    )

    count = 0

    class Counted(float):
        def _counting(operation):
            def method(self, other):
                nonlocal count
                count += 1
                return Counted(getattr(float, operation)(float(self), float(other)))

            return method

        __add__, __sub__, __mul__ = _counting("__add__"), _counting("__sub__"), _counting("__mul__")
        __rtruediv__ = _counting("__rtruediv__")
        __radd__ = _counting("__radd__")

    dense_ldl.factor_ldl([Counted(x) for x in stored(K)], n, nc)
    assert count == dense_ldl.operations("factor_ldl", sizes)


def chain(n, closed=False):
    """n rods in the plane with relative angles, each with its centre of mass at its middle."""
    angles, positions = [], ["0", "0"]
    definitions, bodies = {}, []
    for k in range(n):
        definitions[f"phi{k}"] = f"phi{k - 1} + q{k}" if k else "q0"
        x, y = positions
        bodies.append(
            body(f"rod{k}", (f"{x} + l/2*sin(phi{k})", f"{y} - l/2*cos(phi{k})"), "m", ("J",), f"phi{k}")
        )
        definitions[f"x{k}"], definitions[f"y{k}"] = f"{x} + l*sin(phi{k})", f"{y} - l*cos(phi{k})"
        positions = [f"x{k}", f"y{k}"]
        angles.append(f"q{k}")
    parts = (
        {"constraints": {"end_x": f"{positions[0]} - 1", "end_y": f"{positions[1]} + 0.8*l"}}
        if closed
        else {}
    )
    return describe(
        "chain",
        " ".join(angles),
        {"m": 1.1, "J": 0.09, "l": 0.8, "g": 9.81},
        definitions=definitions,
        bodies=tuple(bodies),
        gravity=GRAVITY,
        **parts,
    )


def by_matrix(description):
    """The module of a model that is solved by its matrix, not as this is made of velocities."""
    with mock.patch.object(choice, "FEWEST_RATES", 10**9):
        return emit(derive(description))


@pytest.fixture(scope="module", params=[False, True], ids=["open", "closed"])
def long_chain(request):
    return runtime.load(by_matrix(chain(28, request.param)))


def test_a_long_chain_is_solved_by_loops(long_chain):
    """Accelerations and multipliers leave no residual of the inverse dynamics, which no factorisation enters."""
    rng = np.random.default_rng(4)
    n, m = long_chain.nv, long_chain.nh
    y = np.concatenate([rng.uniform(-0.4, 0.4, n), rng.uniform(-1, 1, n)])
    p = long_chain.parameter_values()
    out = long_chain.kernel("rhs")(0.0, y, p)
    multipliers = out[2 * n : 2 * n + m]
    residual = long_chain.kernel("residual")(0.0, [*y, *out[n : 2 * n], *multipliers], p)
    forces = long_chain.kernel("forces")(0.0, y, p)
    assert np.abs(residual).max() < 1e-11 * np.abs(forces).max()
    assert "factor_ldl" in long_chain._kernel_source("rhs").code.text
    if m:
        M = long_chain.kernel("mass_matrix")(0.0, y, p).reshape(n, n)
        G = long_chain.kernel("constraint_jacobian")(0.0, y, p).reshape(m, n)
        schur = G @ np.linalg.solve(M, G.T)
        sine = 1.0 - schur[0, 1] ** 2 / (schur[0, 0] * schur[1, 1])
        assert out[-1] == pytest.approx(sine, rel=1e-8)


def test_taylor_series_do_not_need_what_loops_solve(long_chain):
    """The series come from the residual; stages of dop853 come from the loops."""
    ends = [
        long_chain.run(
            t_end=0.3, method=method, rtol=1e-12, atol=1e-13, start={f"q{k}": 0.1 for k in range(3)}
        )
        for method in ("taylor", "dop853")
    ]
    np.testing.assert_allclose(ends[0].q[-1], ends[1].q[-1], rtol=0, atol=1e-9)
    assert ends[0].stats["steps"] < ends[1].stats["steps"]


def test_every_form_of_the_code_agrees(long_chain):
    n, p = long_chain.nv, long_chain.parameter_values()
    y = np.random.default_rng(5).uniform(-0.5, 0.5, 2 * n)
    for name in ("rhs", "project") if long_chain.nh else ("rhs",):
        kernel = long_chain.kernel(name)
        expected = kernel(0.2, y, p)
        plain = np.zeros(kernel.out_size)
        long_chain.python_function(name)(0.2, y, p, plain)
        assert np.array_equal(plain, expected)


def test_numba_agrees(monkeypatch):
    monkeypatch.setattr(dense_solve, "SMALLEST", 3)
    system = runtime.load(emit(derive(chain(3))))
    y, p = np.array([0.3, -0.5, 0.4, 1.0, -0.2, 0.7]), system.parameter_values()
    assert "solve_ldl" in system._kernel_source("rhs").code.text
    jitted = np.zeros(system.kernel("rhs").out_size)
    system.njit_function("rhs")(0.2, y, p, jitted)
    assert np.array_equal(jitted, system.kernel("rhs")(0.2, y, p))


def test_projection_is_the_gauss_step_in_the_mass_metric():
    system = runtime.load(by_matrix(chain(28, closed=True)))
    n, p = system.nv, system.parameter_values()
    y = np.random.default_rng(6).uniform(-0.3, 0.3, 2 * n)
    q, v = y[:n], y[n:]
    M = system.kernel("mass_matrix")(0.0, y, p).reshape(n, n)
    G = system.kernel("constraint_jacobian")(0.0, y, p).reshape(-1, n)
    back = np.linalg.solve(M, G.T) @ np.linalg.inv(G @ np.linalg.solve(M, G.T))
    moved = q - back @ system.kernel("constraint_residual")(0.0, y, p)[:2]
    drift = system.kernel("constraint_jacobian")(0.0, [*moved, *v], p).reshape(-1, n) @ v
    expected = [*moved, *(v - back @ drift)]
    assert system.kernel("project")(0.0, y, p)[: 2 * n] == pytest.approx(expected, rel=1e-8, abs=1e-8)


def refused(text, message):
    with pytest.raises(ModuleError, match=message):
        runtime.load(text).kernel("rhs")


def test_what_does_not_fit_is_refused():
    text = by_matrix(chain(26))
    refused(text.replace("factor_ldl(w0, 26, 26)", "factor_ldl(w0, 27, 26)"), "do not fit")
    refused(text.replace("solve_ldl(w0, b0, 26)", "solve_ldl(w0, w0, 26)"), "do not fit")
    refused(text.replace("solve_ldl(w0, b0, 26)", f"solve_ldl(w0, b0, {'2' * 5000})"), "do not fit")
    refused(text.replace("w0[1] = ", "w0[702] = "), "702 values")
    with pytest.raises(ModuleError, match="is not the one that this run time knows"):
        runtime.load(text.replace("s = s + a[k * n + i] * b[i]", "s = s - a[k * n + i] * b[i]"))


def test_equal_subsystems_are_solved_in_a_loop(monkeypatch):
    monkeypatch.setattr(dense_solve, "SMALLEST", 3)
    model = Model("two_chains")
    m, l, g = model.parameters(m=1.0, l=0.5, g=9.81)
    model.gravity(y=-g)
    for chain_name in "ab":
        x = y = 0
        for k in range(4):
            q = model.coordinate(f"{chain_name}{k}", start=0.1, rate=0.0)
            x, y = x + l * sin(q), y - l * cos(q)
            model.body(f"{chain_name}_bob{k}", mass=m, com=(x, y))
    system = link.derive(model)
    text = system._kernel_source("rhs").code.text
    assert text.count("factor_ldl") == text.count("for k in range(2):") == 1
    state, p = np.random.default_rng(8).uniform(-1, 1, 16), system.parameter_values()
    out, plain = system.kernel("rhs")(0.0, state, p), np.zeros(16)
    system.python_function("rhs")(0.0, state, p, plain)
    assert np.array_equal(out, plain)
    M = system.kernel("mass_matrix")(0.0, state, p).reshape(8, 8)
    assert out[8:] == pytest.approx(np.linalg.solve(M, system.kernel("forces")(0.0, state, p)), rel=1e-10)
