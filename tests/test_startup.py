"""What a run imports, compiles and does again: nothing that it has no use for."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from symgen import Model, link
from symgen.derive.scenes.subsystems import derive
from symgen.link import derive as system_of
from symgen.link import derive_text
from symgen.model import library
from symgen.runtime import RunOptions, System, load, module, solve
from symgen.runtime.code import dense_ldl, front_ldl
from symgen.runtime.explain import savings
from symgen.runtime.sampling import sample_rows
from symgen.runtime.taylor.kernel import taylor_refusal

ROOT = Path(__file__).resolve().parent.parent
# What only some runs need: other packages, the compiler's front end, forms and features that this model does not have.
UNUSED = (
    "sympy", "numba", "llvmlite", "scipy", "rerun", "pyarrow", "matplotlib", "tomllib", "importlib.metadata",
    "numpy.ma", "numpy.random", "numpy.polynomial", "numpy.ctypeslib", "tempfile", "shutil", "json", "difflib",
    "symgen.derive", "symgen.emit", "symgen.model.model",
    *(f"symgen.runtime.{name}" for name in (
        "code.modules", "code.lower", "code.dense_ldl", "code.front_ldl",
        "code.compile_jitted", "code.compiler", "taylor.graph", "taylor.motion", "taylor.loops",
        "contact", "inputs", "recording", "explain", "constraints.kkt", "constraints.branch",
        "constraints.assembly", "constraints.drift", "constraints.levels", "constraints.nearest_point",
        "constraints.dependence", "checks.branches", "checks.extreme_rates",
        "constraints.baumgarte", "integrate.ggl", "integrate.forms", "integrate.growth", "integrate.radau",
        "integrate.bdf", "integrate.rattle", "integrate.partition", "integrate.generalized_alpha",
    )),
)  # fmt: skip


def in_new_process(statement: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", statement],
        capture_output=True,
        text=True,
        env=environment,
        check=True,
        cwd=ROOT,
    )
    return done.stdout


def test_a_warm_run_imports_nothing_that_it_does_not_use():
    """The first run may derive and compile; the second finds all that in the cache."""
    run = (
        "import sys; from symgen.cli import main\n"
        "try: main(['run', 'double_pendulum', '--no-log', '--quiet', '--t-end', '1'])\n"
        "except SystemExit as end: assert not end.code\n"
        "from symgen.runtime.code import cache\n"
        "modules = sorted(sys.modules)\n"
        "import json; print(json.dumps([modules, dict(cache.missed), dict(cache.found)]))"
    )
    in_new_process(run)
    modules, missed, found = json.loads(in_new_process(run))
    assert not missed
    assert found["modules"] == 1
    assert found["loops"] >= 3  # the scout's loop, the method's, evaluation of kernels
    assert "symgen.runtime.simulate" in modules
    assert not [name for name in UNUSED if name in modules]


def test_a_builder_that_hands_out_no_symbols_imports_no_sympy():
    build = (
        "import sys, symgen; symgen.Model.from_toml('models/pendulum.toml').describe(); print('sympy' in sys.modules, "
        "symgen.equations.equations_of.__name__, 'sympy' in sys.modules)"
    )
    assert in_new_process(build).split() == ["False", "equations_of", "True"]


def test_deriving_model_files_imports_no_sympy():
    """But slopes of surfaces, which no bundled file has."""
    derive_all = (
        "import sys; from pathlib import Path; from symgen.link import derive_file\n"
        "for name in ('double_pendulum', 'engine_v6', 'differential_car', 'satellite_wheels', 'clutch'):\n"
        "    derive_file(Path('models') / f'{name}.toml')\n"
        "print(*sys.modules)"
    )
    assert "sympy" not in in_new_process(derive_all).split()


def test_the_second_process_compiles_nothing_again(tmp_path, monkeypatch):
    """A kernel's key is the same for a model that was just derived and for one that was found in the cache."""
    (tmp_path / "cache").mkdir(mode=0o700)
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "cache"))
    run = (
        "from symgen.cli import main\n"
        "try: main(['run', 'double_pendulum', '--no-log', '--quiet', '--t-end', '1', '--method', 'dop853'])\n"
        "except SystemExit as end: assert not end.code\n"
        "from symgen.runtime.code import cache; import json; print(json.dumps(dict(cache.missed)))"
    )
    assert json.loads(in_new_process(run))["kernels"] >= 3
    assert not json.loads(in_new_process(run))


def test_a_warm_run_with_a_log_loads_rerun_but_neither_numba_nor_llvm(tmp_path):
    run = (
        "import sys; from symgen.cli import main\n"
        f"try: main(['run', 'double_pendulum', '--log', {str(tmp_path / 'run.rrd')!r}, '--quiet', '--t-end', '1'])\n"
        "except SystemExit as end: assert not end.code\n"
        "print(*sys.modules)"
    )
    in_new_process(run)
    modules = in_new_process(run).split()
    assert "rerun" in modules
    unused = ("sympy", "numba", "llvmlite", "scipy", "matplotlib", "pyarrow.compute")
    assert not [name for name in unused if name in modules]


def test_a_model_without_a_taylor_series_is_refused_once(monkeypatch):
    model = Model("steps")
    model.coordinate("x", start=1.0)
    model.kinetic("dot(x)**2/2")
    model.potential("abs(x - 0.123456)**2.5")
    text = derive_text(model).text
    said = taylor_refusal(load(text))
    assert "a choice" in said and "has no Taylor series" in said

    def work(*arguments):
        raise AssertionError("worked out again")

    monkeypatch.setattr("symgen.runtime.taylor.kernel._lower", work)
    assert taylor_refusal(load(text)) == said


def test_the_generators_hash_is_remembered_while_its_sources_stay(tmp_path, monkeypatch):
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(link, "__file__", str(tmp_path / "link.py"))
    for part in ("model", "derive/trees", "emit"):
        (tmp_path / part).mkdir(parents=True)
        (tmp_path / part / "some.py").write_text(f"# {part}\n")
    read, plain = [], Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: (read.append(path.name), plain(path))[1])
    first = link.generator_hash.__wrapped__()
    assert read.count("some.py") == 3
    assert link.generator_hash.__wrapped__() == first and read.count("some.py") == 3
    (tmp_path / "derive" / "trees" / "some.py").write_text("# other\n")
    assert link.generator_hash.__wrapped__() != first and read.count("some.py") == 6
    (tmp_path / "derive" / "trees" / "some.py").write_text("# derive/trees\n")
    assert link.generator_hash.__wrapped__() == first  # of their contents, not of their times


@pytest.mark.parametrize("n", [1, 2, 3, 10, 101])
@pytest.mark.parametrize("most", [1, 2, 5, 50, 200])
def test_spread_rows_are_those_of_a_plain_formula(n, most):
    rows = sample_rows(n, most)
    assert rows.tolist() == np.unique(np.linspace(0, n - 1, most).astype(int)).tolist()


@pytest.mark.parametrize(("t_end", "fps"), [(1.0, 60.0), (0.3, 7.0), (10.0, 2.0), (2.0, 50.0), (1e-3, 1.0)])
def test_few_frames_are_filled_up_and_those_asked_for_are_marked(t_end, fps):
    times, shown = RunOptions(t_end=t_end, fps=fps).frame_times()
    wanted = np.array([k / fps for k in range(100_000) if k / fps < t_end * (1 - 1e-9)] + [t_end])
    np.testing.assert_array_equal(times[shown], wanted)
    np.testing.assert_array_equal(times, np.union1d(wanted, np.linspace(0.0, t_end, 201)))


def test_explain_prints_what_a_run_skipped():
    run = (
        "import sys; from symgen.cli import main\n"
        "main(['run', 'double_pendulum', '--no-log', '--explain', '--t-end', '1'])"
    )
    in_new_process(run)  # this one derives and compiles
    text = in_new_process(run)
    skipped = text[text.index("  skipped\n") :]
    for what in ("imports", "derivation", "kernels not made", "work on parameters", "steps to frames"):
        assert f"\n    {what} " in skipped
    assert "residual_jacobian" in skipped  # a kernel that neither method nor checks call
    assert "sympy" in skipped


@pytest.mark.parametrize("statement", ["from symgen import runtime", "from symgen.cli import main"])
def test_importing_the_package_or_asking_for_help_imports_no_numpy(statement):
    assert "numpy" not in in_new_process(f"import sys; {statement}; print(*sys.modules)").split()


def test_the_solvers_that_modules_may_define_are_those_of_their_files():
    found = {name: place.__name__ for place in (dense_ldl, front_ldl) for name in place.SOLVERS}
    assert module.SOLVERS == found


def test_an_explicit_run_of_the_tree_of_30_freedoms_compiles_no_jacobian():
    system = system_of(library.load(library.find("humanoid_tree")))
    solve(system, 0.05, method="dop853")
    assert "rhs" in system.compiled
    assert not {"residual_jacobian", "residual", "forces", "poses"} & set(system.compiled)


def chain(n: int) -> System:
    """Masses on a line, tied by linear springs, coupled by a constant mass matrix."""
    model = Model("line")
    model.parameters(m=0.5, k=100.0, c=0.1)
    x = [model.coordinate(f"x{i}", start=0.1 * i) for i in range(n)]
    for a, b in zip([0, *x], x, strict=False):
        model.potential(f"k/2*(({b})-({a}))**2")
    for k, a in enumerate(x):
        after = f"dot({x[k + 1]})" if k + 1 < n else "0"
        model.kinetic(f"m/2*dot({a})**2 + c/4*(dot({a})+{after})**2")
    return system_of(model)


def test_a_constant_mass_matrix_is_factored_once():
    system = chain(8)
    solution = solve(system, 1.0, method="dop853", at=[0.5])
    assert solution.stats["rhs"] > 100
    assert system.n_precomputations == 1
    (line,) = [saving for saving in savings(solution) if saving.what == "factors of the mass matrix"]
    assert line.gain == f"factored 1 time for {solution.stats['rhs']} evaluations"
    # Other parameters, other factors; and those of before are not what is handed out.
    heavier = system.parameter_values({"m": 2.0})
    precomputed = system.precomputed(heavier)
    assert system.n_precomputations == 2
    precomputed[:] = 0.0
    np.testing.assert_array_equal(system.precomputed(heavier)[: system.n_p], heavier)
    assert system.n_precomputations == 2


def test_savings_count_what_a_run_left_out():
    system = chain(3)
    solution = solve(system, 1.0, method="radau5")
    said = {saving.what: saving for saving in savings(solution)}
    assert "residual 0" not in said["kernels not made"].gain
    assert {"residual_jacobian", "rhs"} <= set(system.compiled)
    assert "energy" not in system.compiled  # of a run whose energies nobody has read
    left = [name for name in system.source.functions if name not in system.compiled]
    assert said["kernels not made"].gain.startswith(f"{len(left)} functions, ")
    stats = solution.stats
    assert said["factorisations"].gain == f"{stats['factorisations']} for {stats['newton']} iterations"
    assert said["steps to frames"].gain == f"{len(solution.t) - 2} interpolated in {stats['steps']} steps"
    assert "search for events" in said["parts of the step"].gain
    assert said["integral of the power"]


def findings(model: Model) -> str:
    return "\n".join(derive(model.describe()).findings)


def cart_pole(**more) -> Model:
    model = Model("cart_pole", gravity=(0, -9.81, 0))
    model.parameters(m=0.4, l=0.7, c=0.2)
    model.coordinate("x")
    model.coordinate("theta", start=1.0)
    model.body("cart", mass=1.5, com=("x", 0))
    model.body("bob", mass="m", com=("x + l*sin(theta)", "-l*cos(theta)"))
    if more.get("damped"):
        model.dissipation("c/2*dot(x)**2")
    if more.get("watched"):
        model.event("wall", when="x - 1", direction="rising")
    if more.get("held"):
        model.constraint("held", "x - 0.1*theta")
    return model


def test_a_coordinate_that_influences_nothing_is_found():
    assert "influence nothing else" in findings(cart_pole())
    assert findings(cart_pole()).splitlines()[-1].endswith(": x")
    for reason in ("damped", "watched", "held"):
        assert "influence nothing else" not in findings(cart_pole(**{reason: True}))


def test_structural_zeros_and_absent_functions_are_counted():
    text = findings(cart_pole(held=True))
    assert "no code for inputs, events, outputs, quaternions: there are none" in text
    assert "constraints are linear in the coordinates: their Jacobian is constant" in text
    program = derive(cart_pole(held=True).describe())
    jacobian = program.own["residual_jacobian"]
    assert f"residual_jacobian {21 - len(jacobian.outputs)} of 21" in text


def test_blas_is_told_of_one_thread_before_numpy_is_loaded():
    """click asks for a command, whose module loads NumPy, before it calls the group."""
    statement = (
        "import os, sys; from symgen.cli import main\n"
        "class Finder:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'numpy': print('told', os.environ.get('OPENBLAS_NUM_THREADS'))\n"
        "os.environ.pop('OPENBLAS_NUM_THREADS', None)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "main(['run', '--help'], standalone_mode=False)"
    )
    assert "told 1" in in_new_process(statement)
