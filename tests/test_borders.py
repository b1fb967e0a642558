"""Who may import whom: runtime never symgen or SymPy, symgen runtime by few doors, Rerun in one folder."""

from __future__ import annotations

import ast
import functools
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import import_graph
import pytest

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted(
    p.relative_to(ROOT).as_posix() for top in ("runtime", "symgen") for p in (ROOT / top).rglob("*.py")
)
RUNTIME = [f for f in FILES if f.startswith("runtime/")]
SYMGEN = [f for f in FILES if f.startswith("symgen/")]
# To run what was derived, and to read it as equations.
DOORS = {"symgen/link.py", "symgen/equations.py"}
RECORDING_DOOR = "runtime/recording/rrd/"
# Knows neither SymPy nor text; its own imports are tested below.
SHARED = ("symgen.runtime.graph", "symgen.runtime.lazy")
NEEDED = {
    re.match(r"[\w-]+", requirement)[0].removesuffix("-sdk")
    for requirement in tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
        "dependencies"
    ]
}
DECLARED = {
    *NEEDED,
    "matplotlib",
    "pandas",
    "xarray",
    "zarr",
    "distributed",
    "cloudpickle",  # comes with distributed
    "SALib",
    "control",
    "pinocchio",
    "mujoco",
    "trimesh",
    "collada",
    "cuda",
}  # these are extras
# A model's author's own .py file; generated functions that passed the grammar, as Python for debugging.
EXECUTES = {"symgen/model/library.py", "runtime/code/function_text.py"}
# Own modules that functions import: which library keeps them from the top of the file.
INSIDE_FUNCTIONS = {
    ("symgen.front", "symgen.model.from_sympy"): "sympy",
    ("symgen.model.surfaces", "symgen.model.slopes"): "sympy",
    ("symgen.model.curves", "symgen.model.from_sympy"): "sympy",
    ("symgen.model.given", "symgen.model.from_sympy"): "sympy",
    ("symgen.runtime.code.bridge", "symgen.runtime.code.bridge_numba"): "numba",
    ("symgen.runtime.inputs.controller", "symgen.runtime.inputs.memory"): "numba",
}
HEAVY = ("sympy", "numba", "rerun", "scipy", "matplotlib", "llvmlite")


@functools.cache
def imports(file: str) -> set[str]:
    """Packages that a file imports anywhere, also in functions and by name; not for types alone."""
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    found: set[str] = set()
    pending: list[ast.AST] = [tree]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING"):
            pending.extend(node.orelse)
            continue
        pending.extend(ast.iter_child_nodes(node))
        if isinstance(node, ast.Import):
            found |= {half(alias.name) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            if node.module and node.module.startswith(SHARED):
                continue
            found |= absolute(file, node)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2] in (
            "import_module",
            "__import__",
        ):
            found |= named_packages(tree)
    return found


def named_packages(tree: ast.AST) -> set[str]:
    """Packages that a file with imports by name can mean: those that any of its texts names."""
    texts = (n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str))
    return {half(text) for text in texts} & {*DECLARED, "symgen", "runtime"}


def half(module: str) -> str:
    """The package of a module; of this one, which half: the folder `runtime` is imported as `symgen.runtime`."""
    return "runtime" if f"{module}.".startswith("symgen.runtime.") else module.split(".")[0]


def absolute(file: str, node: ast.ImportFrom) -> set[str]:
    if not node.level:
        return {half(f"{node.module}.{alias.name}") for alias in node.names}
    parts = Path(file).parent.parts
    assert node.level <= len(parts), f"{file}: relative import beyond the package"
    return {parts[0]}


@pytest.mark.parametrize("file", RUNTIME)
def test_runtime_imports_neither_sympy_nor_symgen(file):
    assert not imports(file) & {"sympy", "symgen", "mpmath"}


@pytest.mark.parametrize("file", SYMGEN)
def test_symgen_reaches_runtime_only_by_its_doors_and_the_commands(file):
    if file not in DOORS and not file.startswith("symgen/cli/"):
        assert "runtime" not in imports(file)


@pytest.mark.parametrize("file", [f for f in RUNTIME if f.startswith("runtime/graph/")])
def test_what_both_halves_import_needs_neither(file):
    assert not imports(file) & {"runtime", "symgen", "numpy", *HEAVY}


@pytest.mark.parametrize("file", FILES)
def test_rerun_stands_in_one_folder(file):
    if not file.startswith(RECORDING_DOOR):
        assert not imports(file) & {"rerun", "rerun_sdk", "rerun_bindings"}


@pytest.mark.parametrize("file", FILES)
def test_only_declared_dependencies_are_imported(file):
    foreign = imports(file) - set(sys.stdlib_module_names) - {"symgen", "runtime", "work_precision"}
    assert foreign <= DECLARED


def test_every_declared_dependency_is_imported():
    assert set().union(*map(imports, FILES)) >= NEEDED


@pytest.mark.parametrize("file", FILES)
def test_no_code_is_executed_from_text(file):
    """No eval, exec, sympify or parse_expr: model files are data."""
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    called = {ast.unparse(n.func).rpartition(".")[2] for n in ast.walk(tree) if isinstance(n, ast.Call)}
    assert not called & {
        "eval",
        "sympify",
        "parse_expr",
        "lambdify",
        *(() if file in EXECUTES else ("exec",)),
    }


def test_no_circle_of_imports():
    """Over all imports: those inside functions, for types alone, and by name as well."""
    assert import_graph.circles() == []


def test_imports_inside_functions_have_a_library_behind_them():
    """Our own modules that most processes do without are `Late`; here a library's own functions are needed."""
    ours = import_graph.modules()
    found = {
        (module.name, i.imported)
        for module in ours.values()
        for i in module.imports
        if i.level == "function" and i.imported in ours
    }
    assert found == set(INSIDE_FUNCTIONS)
    for (_, imported), library in INSIDE_FUNCTIONS.items():
        assert library in loaded_by(f"import {imported}")


def test_what_is_imported_from_our_modules_is_there():
    assert import_graph.dangling(("symgen", "runtime", "tests", "benchmarks")) == []


def loaded_by(statement: str) -> set[str]:
    """Packages, and modules of this one, in `sys.modules` after a statement in a fresh process."""
    code = f"import sys; {statement}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    return {name if name.startswith("symgen.") else name.split(".")[0] for name in run.stdout.split()}


def test_importing_symgen_is_light():
    assert not loaded_by("import symgen") & {"sympy", "symgen.runtime", *HEAVY}


def test_importing_runtime_brings_neither_sympy_nor_the_compile_time_half_nor_rerun():
    loaded = loaded_by("from symgen.runtime import load")
    assert not loaded & {"sympy", "rerun", "scipy", "matplotlib"}
    assert all(name.startswith("symgen.runtime") for name in loaded if name.startswith("symgen."))


def test_the_command_starts_without_heavy_imports():
    assert not loaded_by("import symgen.cli") & {"sympy", "rerun", "scipy", "matplotlib"}


CODE_OF_KERNELS = ("symgen.runtime.code.modules", "symgen.runtime.code.compiler")
NOTHING_TO_DECIDE = {  # what they do leaves no trace in what is kept
    "symgen.runtime.errors", "symgen.runtime.lazy", "symgen.runtime.code.cache",
}  # fmt: skip


@pytest.mark.parametrize(
    "keyed_by, starts",
    [
        ("runtime/code/engine.py", CODE_OF_KERNELS),
        ("runtime/module_check.py", ("symgen.runtime.module_check",)),
    ],
)
def test_what_is_kept_is_keyed_by_all_files_that_decide_it(keyed_by, starts):
    """An edit of a file that is left out would go on with the machine code, or the verdict, of before."""
    tree = ast.parse((ROOT / keyed_by).read_text(encoding="utf-8"))
    names = next(
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and node.targets[0].id == "_SOURCES"
    )
    folder = (ROOT / keyed_by).parent
    listed = {(folder / name).with_suffix(".py").resolve() for name in names}
    known = import_graph.modules()
    needed, pending = set(), list(starts)
    while pending:
        module = known.get(pending.pop())
        if module is None or module.name in needed | NOTHING_TO_DECIDE:
            continue
        needed.add(module.name)
        pending += [i.imported for i in module.imports if i.level in ("module", "function", "name")]
    assert listed == {known[name].file for name in needed}
