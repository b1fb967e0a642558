"""`System`: what the header says, kernels against oracles, messages that say what was expected."""

from __future__ import annotations

import inspect
import os
import pickle
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symgen import runtime
from symgen.runtime import System
from symgen.runtime import kernel as kernel_module
from symgen.runtime.code.angles import side_by_side
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.errors import ModuleError, RuntimeModelError
from symgen.runtime.module import read_module

ROOT = Path(__file__).parent.parent
FIXTURES = ROOT / "tests" / "fixtures"
NAMES = ["pendulum", "double_pendulum", "cartesian_pendulum", "oscillator"]
CONSTRAINED = ["cartesian_pendulum"]


@pytest.fixture(scope="module", params=NAMES)
def system(request):
    return runtime.load(FIXTURES / f"{request.param}.py")


def load(name: str):
    return runtime.load(FIXTURES / f"{name}.py")


def random_y(system, rng) -> np.ndarray:
    return rng.normal(size=system.nq + system.nv)


def with_forces(system, y, p, t):
    """Return the argument of `residual` at the motion that `rhs` gives."""
    row = system.kernel("rhs")(t, y, p)
    multipliers = row[system.ny : system.ny + system.m]
    return np.concatenate([y, row[system.nq : system.nq + system.nv], multipliers])


def test_kernels_are_the_python_text(system):
    rng = np.random.default_rng(1)
    p = system.parameter_values()
    for name in system.source.functions:
        kernel = system.kernel(name)
        y = rng.normal(size=kernel.source.lengths.y)
        expected = np.zeros(kernel.out_size)
        system.python_function(name)(0.3, y.tolist(), p.tolist(), expected)
        # Of several angles at once, sines are our own (test_angles.py), and off by one unit of the last digit.
        off = 1e-14 if side_by_side(kernel.source.code.form) else 0.0
        np.testing.assert_allclose(kernel(0.3, y, p), expected, rtol=off, atol=off * np.abs(expected).max())


def test_rhs_solves_the_residual(system):
    rng, p = np.random.default_rng(2), system.parameter_values()
    for _ in range(5):
        extended = with_forces(system, random_y(system, rng), p, 0.4)
        assert np.abs(system.kernel("residual")(0.4, extended, p)).max() < 1e-11


def test_residual_is_mass_forces_and_constraints(system):
    rng, p = np.random.default_rng(3), system.parameter_values()
    n, m = system.nv, system.m
    extended = rng.normal(size=system.nq + 2 * n + m)
    y, a, multipliers = (
        extended[: system.nq + n],
        extended[system.nq + n : system.nq + 2 * n],
        extended[-m:][:m],
    )
    mass = system.kernel("mass_matrix")(0.4, y, p).reshape(n, n)
    expected = mass @ a - system.kernel("forces")(0.4, y, p)
    if m:
        jacobian = system.kernel("constraint_jacobian")(0.4, y, p).reshape(m, n)
        expected -= jacobian.T @ multipliers
        expected = np.concatenate([expected, jacobian @ a - system.kernel("gamma")(0.4, y, p)])
    np.testing.assert_allclose(system.kernel("residual")(0.4, extended, p), expected, atol=1e-12)


def test_residual_jacobian_is_the_derivative(system):
    rng, p = np.random.default_rng(4), system.parameter_values()
    kernel = system.kernel("residual")
    x = rng.normal(size=kernel.source.lengths.y)
    columns = []
    for unit in np.eye(len(x)):
        f = [kernel(0.4, x + k * 1e-3 * unit, p) for k in (-2, -1, 1, 2)]
        columns.append((f[0] - 8 * f[1] + 8 * f[2] - f[3]) / 12e-3)
    jacobian = system.kernel("residual_jacobian")(0.4, x, p).reshape(kernel.out_size, len(x))
    np.testing.assert_allclose(jacobian, np.transpose(columns), atol=1e-8)


def test_power_is_the_change_of_energy(system):
    rng, p, t, h = np.random.default_rng(5), system.parameter_values(), 0.4, 1e-3
    if system.m:
        pytest.skip("a random state does not fulfil the constraints")
    y = random_y(system, rng)
    row = system.kernel("rhs")(t, y, p)
    energies = [
        system.kernel("energy")(t + k * h, y + k * h * row[: len(y)], p).sum() for k in (-2, -1, 1, 2)
    ]
    change = (energies[0] - 8 * energies[1] + 8 * energies[2] - energies[3]) / (12 * h)
    assert change == pytest.approx(row[len(y)] if system.nw else 0.0, abs=1e-8)


@pytest.mark.parametrize("name", CONSTRAINED)
def test_projection_converges_to_the_constraints(name):
    system = load(name)
    p, y = system.parameter_values(), np.array([0.33, -0.41, 0.5, 0.7])
    for _ in range(8):
        y = system.kernel("project")(0.0, y, p)[: system.nq + system.nv]
    assert np.abs(system.kernel("constraint_residual")(0.0, y, p)).max() < 1e-15
    np.testing.assert_allclose(system.kernel("project")(0.0, y, p)[:4], y, atol=1e-15)


def test_header_is_at_hand():
    system = load("oscillator")
    assert (system.nq, system.nv, system.m, system.nw, system.ny, system.n_row) == (1, 1, 0, 1, 3, 3)
    assert [event["name"] for event in system.events] == ["stop", "turn", "limit"]
    assert system.has("reset_stop") and not system.has("project") and not system.has("reset_turn")
    assert system.run_defaults["t_end"] == 10.0
    q, v, q_enforced, v_enforced = load("cartesian_pendulum").initial_state()
    assert q.tolist() == [0.3, -0.4] and v.tolist() == [0.0, 0.0]
    assert q_enforced.tolist() == [True, False] and v_enforced.tolist() == [False, False]
    assert load("cartesian_pendulum").n_row == 4 + 1 + 1


def test_system_is_constant():
    system = load("pendulum")
    with pytest.raises(AttributeError, match="constant"):
        system.nq = 3
    system.parameter_values()[0] = 7.0
    assert system.parameter_values()[0] == 1.0


def test_parameters_then_inputs():
    system = load("oscillator")
    p = system.parameter_values({"force": 2.5, "k": 9})
    assert p[-1] == 2.5 and p[2] == 9.0 and p[0] == 1.0 and len(p) == system.n_p


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("mm", "did you mean 'm'"),
        ("radius", "constant"),
        ("theta", "coordinate"),
        ("zzzzzz", "it has: m, l, g"),
    ],
)
def test_unknown_parameter_is_explained(name, says):
    with pytest.raises(RuntimeModelError, match=says):
        load("pendulum").parameter_values({name: 1.0})


def test_unknown_function_is_explained():
    with pytest.raises(RuntimeModelError, match="did you mean 'rhs'"):
        load("pendulum").kernel("rsh")
    with pytest.raises(RuntimeModelError, match="it has no constraints"):
        load("pendulum").kernel("project")


@pytest.mark.parametrize(
    ("y", "says"),
    [
        ([1.0], r"y has shape \(1,\), but rhs of model 'pendulum' reads 2 values: theta, dot\(theta\)"),
        ([[1.0, 2.0]], r"y has shape \(1, 2\)"),
        (["a", "b"], "float64"),
        ([1j, 2j], "float64"),
        (3.0, r"shape \(\)"),
    ],
)
def test_wrong_y_is_explained(y, says):
    system = load("pendulum")
    with pytest.raises((ValueError, TypeError), match=says):
        system.kernel("rhs")(0.0, y, system.parameter_values())


@pytest.mark.parametrize(
    "out", [np.zeros(3), np.zeros(2, np.float32), np.zeros(4)[::2], [0.0, 0.0], np.zeros((1, 2)), "read-only"]
)
def test_wrong_out_is_refused(out):
    system = load("pendulum")
    if isinstance(out, str):
        out = np.zeros(2)
        out.flags.writeable = False
    with pytest.raises(TypeError, match="out of rhs"):
        system.kernel("rhs")(0.0, [0.0, 1.0], system.parameter_values(), out)


def test_arrays_that_are_not_contiguous_are_copied():
    system = load("pendulum")
    p, y = system.parameter_values(), np.arange(8.0)
    np.testing.assert_array_equal(
        system.kernel("rhs")(0.0, y[::4], p), system.kernel("rhs")(0.0, [0.0, 4.0], p)
    )
    np.testing.assert_array_equal(system.kernel("rhs")(0, np.array([0, 4]), p), [4.0, 0.0])


def test_kernels_outlive_their_system():
    kernel, p = load("pendulum").kernel("rhs"), load("pendulum").parameter_values()
    assert kernel(0.0, [0.0, 1.0], p)[0] == 1.0


def test_threads_share_one_kernel():
    system, kernels = load("double_pendulum"), []
    threads = [threading.Thread(target=lambda: kernels.append(system.kernel("energy"))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(kernels) == 4 and len(set(map(id, kernels))) == 1


def test_pickles_without_its_code():
    system = load("pendulum")
    system.kernel("rhs")
    again = pickle.loads(pickle.dumps(system))
    assert again.kernel("rhs")(0.0, [0.0, 1.0], system.parameter_values())[0] == 1.0


def test_hostile_function_is_refused_by_every_way_in(tmp_path):
    mark = tmp_path / "mark"
    text = (FIXTURES / "pendulum.py").read_text()
    hostile = "    out[0] = y[1]\n", f"    out[0] = open({str(mark)!r}, 'w').write('x')\n"
    with pytest.raises(ModuleError, match=r"line 56, function 'rhs'.*only these functions"):
        runtime.load(text.replace(*hostile, 1))
    # Nor by those behind, had reading let it pass.
    source = read_module(text)
    functions = {**source.functions, "rhs": source.functions["rhs"].replace(*hostile, 1)}
    system = System(replace(source, functions=functions))
    for way in (system.kernel, system.python_function, system.njit_function, system.numba):
        with pytest.raises(ModuleError, match=r"line 56, function 'rhs'.*only these functions"):
            way("rhs")
    assert not mark.exists()
    assert system.kernel("energy").address


def test_index_beyond_the_header_sizes_is_refused():
    text = (FIXTURES / "pendulum.py").read_text().replace("    out[0] = y[1]\n", "    out[99999] = y[1]\n", 1)
    with pytest.raises(ModuleError, match="out of range"):
        runtime.load(text).kernel("rhs")


def test_numba_takes_over_loudly(monkeypatch):
    def fail(*arguments):
        raise RuntimeError("no such pass")

    monkeypatch.setattr("symgen.runtime.code.engine.object_code", fail)
    system = load("pendulum")
    with pytest.warns(kernel_module.SlowCompileWarning, match="no such pass"):
        kernel = system.kernel("rhs")
    y, p, expected = [0.3, 1.0], system.parameter_values(), np.zeros(2)
    system.python_function("rhs")(0.0, y, p, expected)
    np.testing.assert_array_equal(kernel(0.0, y, p), expected)


def test_njit_oracle_and_linked_function_agree():
    system = load("double_pendulum")
    p, y = system.parameter_values(), np.array([0.1, 0.2, 0.3, 0.4])
    linked, oracle = system.numba("rhs"), system.njit_function("rhs")

    @numba.njit
    def use(t, y, p, rows):
        for i in range(rows.shape[0]):
            linked(t, y, p, rows[i])

    rows, expected = np.zeros((3, 4)), np.zeros(4)
    use(0.0, y, p, rows)
    oracle(0.0, y, p, expected)
    np.testing.assert_array_equal(rows, [system.kernel("rhs")(0.0, y, p)] * 3)
    np.testing.assert_allclose(rows[0], expected, rtol=1e-13)  # sines of three angles are our own


def test_the_example_of_numba_runs_and_knows_its_sizes():
    system = load("pendulum")
    text = inspect.getdoc(type(system).numba)
    lines = [
        line.removeprefix(">>> ").removeprefix("... ")
        for line in text.splitlines()
        if line[:4] in (">>> ", "... ")
    ]
    names = {"system": system, "numba": numba, "np": np, "solve_ivp": solve_ivp}
    exec("\n".join(lines), names)
    f = names["f"]
    assert (f.n_y, f.n_p, f.n_out) == (2, len(system.parameters), names["n_out"])
    assert f.__doc__ == f"rhs(t, y, p, out): 2 values of y, {f.n_p} of p; {f.n_out} are written to out."
    # The same by the kernel, at SciPy's own last state.
    n, p = names["n"], system.parameter_values()
    end = names["found"].y[:, -1].copy()
    np.testing.assert_array_equal(names["derivatives"](1.0, end, p), system.kernel("rhs")(1.0, end, p)[:n])
    assert names["found"].success


@pytest.mark.parametrize("way", ["numba", "njit_function"])
@pytest.mark.parametrize("short", ["y", "p", "out"])
def test_functions_for_numba_refuse_short_arrays(way, short):
    system = load("double_pendulum")
    function = getattr(system, way)("rhs")
    arrays = {"y": np.array([0.1, 0.2, 0.3, 0.4]), "p": system.parameter_values(), "out": np.zeros(4)}
    arrays[short] = arrays[short][:-1].copy()

    @numba.njit
    def use(t, y, p, out):
        function(t, y, p, out)

    with pytest.raises(ValueError, match="rhs reads 4 values of y and 5 of p, and writes 4 to out"):
        use(0.0, **arrays)
    np.testing.assert_array_equal(arrays["out"], 0.0)


def test_package_has_no_part_in_the_start_of_other_programs():
    # An entry point by the name of `runtime` finds any file runtime.py that lies near, and Numba warns of it.
    assert "numba_extensions" not in (ROOT / "pyproject.toml").read_text()


AFTERWARDS = """
import sys
import numpy as np
from symgen.runtime import load
from symgen.runtime.code.bridge import call_kernel
system = load(sys.argv[1])
import numba
@numba.njit
def use(address, y, p, out):
    call_kernel(address, 0.5, y, p, out)
out = np.zeros(2)
assert "symgen.runtime.code.bridge_numba" not in sys.modules
use(np.uint64(system.kernel("rhs").address), np.array([0.3, 1.0]), system.parameter_values(), out)
assert out[0] == 1.0
"""


def test_numba_learns_of_kernels_when_it_meets_them():
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-W", "error", "-c", AFTERWARDS, str(FIXTURES / "pendulum.py")]
    subprocess.run(command, env=environment, check=True)


BRIDGE = """
import sys
import numpy as np
from symgen.runtime import load
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.numba_setup import jit, numba_cache_folder
system = load(sys.argv[1])
@jit
def rows(addresses, states, p, out):
    for i in range(states.shape[0]):
        call_kernel(addresses[0], 0.5, states[i], p, out[i])
addresses = np.array([system.kernel("rhs").address], dtype=np.uint64)
states, out = np.arange(6.0).reshape(3, 2), np.zeros((3, 2))
rows(addresses, states, system.parameter_values(), out)
hits = sum(rows.stats.cache_hits.values()) if hasattr(rows, "stats") else "plain"
print(out.tobytes().hex(), hits, numba_cache_folder())
"""


def test_bridge_is_cached_and_runs_without_jit(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(BRIDGE)
    environment = {**os.environ, "SYMGEN_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    environment.pop("NUMBA_CACHE_DIR", None)

    def run(**more):
        command = [sys.executable, str(script), str(FIXTURES / "pendulum.py")]
        done = subprocess.run(
            command, env={**environment, **more}, capture_output=True, text=True, check=True
        )
        return done.stdout.split()

    first, second, plain = run(), run(), run(NUMBA_DISABLE_JIT="1")
    assert first[1] == "0" and second[1] == "1" and plain[1] == "plain"
    assert first[0] == second[0] == plain[0]
    assert first[2] == second[2] != plain[2]
    own = run(NUMBA_CACHE_DIR=str(tmp_path / "own"))
    assert Path(own[2]).parent == tmp_path / "own"


def test_bridge_from_python_checks():
    system = load("pendulum")
    p, out = system.parameter_values(), np.zeros(2)
    address = system.kernel("rhs").address
    call_kernel(address, 0.0, np.array([0.3, 1.0]), p, out)
    assert out[0] == 1.0
    with pytest.raises(TypeError, match="y must be a contiguous"):
        call_kernel(address, 0.0, np.arange(4.0)[::2], p, out)
    with pytest.raises(ValueError, match="address is 0"):
        call_kernel(0, 0.0, np.zeros(2), p, out)


def test_bridge_in_jitted_code_checks_types():
    @numba.njit
    def use(address, y, p, out):
        call_kernel(address, 0.0, y, p, out)

    with pytest.raises(numba.core.errors.TypingError, match="C-contiguous 1-D float64"):
        use(np.uint64(1), np.arange(4.0)[::2], np.zeros(1), np.zeros(2))


def test_package_exports_lazily():
    heavy = "{'numba', 'llvmlite', 'rerun', 'sympy'}"
    script = f"import sys; from symgen.runtime import load; print(sorted({heavy} & set(sys.modules)))"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        runtime.nothing  # noqa: B018
