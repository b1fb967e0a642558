"""Step loops travel with the package as bitcode of its own sources; all ways from there give the same bits."""

from __future__ import annotations

import dis
import os
import subprocess
import sys
import types
from pathlib import Path

import llvmlite.binding as llvm
import numpy as np
import pytest
from loops import forget_machine_code
from ship_loops import is_current, loops

from symgen.runtime import load
from symgen.runtime.code import compiler, jitted, native, shipped, stand_ins
from symgen.runtime.code.jitted import DISABLE_JIT, Jitted
from symgen.runtime.integrate.methods import METHODS

pytestmark = pytest.mark.skipif(DISABLE_JIT, reason="nothing is compiled")
ROOT = Path(__file__).resolve().parents[1]
FILES = sorted(shipped.FOLDER.glob("*.xz"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_file_is_of_the_sources_of_the_package(path):
    assert is_current(path), "python -m tests.ship_loops makes it anew"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_file_knows_no_machine(path):
    _, content = shipped.read(path)
    head, bitcode = native.unpack(content)
    module = llvm.parse_bitcode(bitcode)
    assert not module.triple and not module.data_layout and "target-cpu" not in str(module)
    assert not [name for name in head["needs"] if name.startswith("llvm.x86")]
    assert os.fsencode(ROOT) not in bitcode and b".py" not in bitcode


def test_files_that_have_not_changed_have_the_sources_that_were_shipped():
    for name, written in shipped._files_when_shipped().items():
        (title, _, made_of), _ = shipped.read(shipped.FOLDER / name)
        for loop in loops()[title]:
            assert shipped.as_written(loop) != written or shipped.sources(loop) == made_of


def test_they_are_small():
    assert sum(path.stat().st_size for path in FILES) < 4e6


def test_every_method_has_its_loop():
    """A first run of any method needs no compiler of Python."""
    for method in METHODS.values():
        loop = method.advance()
        assert isinstance(loop, Jitted)
        assert [path for path in FILES if shipped.read(path)[0][0] == shipped.name(loop)], method.name


def test_what_python_calls_travels_with_the_package():
    """Otherwise a first run that comes there waits for Numba."""
    of_python, packed = set(), {shipped.read(path)[0][0] for path in FILES}
    loops()  # imports every module
    for name, module in list(sys.modules.items()):
        if not name.startswith("symgen.runtime."):
            continue
        holders = [module, *(value for value in vars(module).values() if isinstance(value, type))]
        for function in (value for holder in holders for value in vars(holder).values()):
            if isinstance(function, types.FunctionType) and function.__module__ == name:
                named = [
                    part.argval for part in dis.get_instructions(function) if part.opname == "LOAD_GLOBAL"
                ]
                if "py_func" not in function.__code__.co_consts:
                    values = map(vars(module).get, named)
                    of_python |= {shipped.name(value) for value in values if isinstance(value, Jitted)}
    assert {"fill_row_weights", "project_state"} <= of_python and not sorted(of_python - packed)


def double_pendulum_end(method: str) -> list[bytes]:
    solution = load(ROOT / "generated" / "double_pendulum.py").run(t_end=2.0, method=method, rtol=1e-9)
    return [solution.q.tobytes(), solution.v.tobytes()]


@pytest.fixture
def nothing_loaded(monkeypatch, tmp_path):
    """As if this process, and this machine, had met no step loop before."""
    (tmp_path / "cache").mkdir(mode=0o700)
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "cache"))

    def forget() -> None:
        forget_machine_code(monkeypatch)

    forget()
    return forget


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5"])
def test_vector_code_has_the_same_bits(method, nothing_loaded, monkeypatch):
    scalar = double_pendulum_end(method)
    nothing_loaded()
    monkeypatch.setattr(jitted, "_FEW_STATES", 0)
    made, emit = [], compiler.emit

    def noted(bitcode, quality):
        made.append(quality)
        return emit(bitcode, quality)

    monkeypatch.setattr(compiler, "emit", noted)
    with stand_ins.none():
        assert double_pendulum_end(method) == scalar
    assert "vector" in made


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dop853", "taylor", "radau5", "bdf", "gauss8", "generalized_alpha"])
def test_numba_makes_the_same_bits_here(method, nothing_loaded, monkeypatch):
    of_the_package = double_pendulum_end(method)
    nothing_loaded()
    monkeypatch.setattr(jitted, "with_shipped", False)
    assert double_pendulum_end(method) == of_the_package


def test_the_interpreter_computes_the_same_bits(nothing_loaded):
    script = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "from test_shipped_loops import double_pendulum_end\n"
        "print(*(part.hex() for part in double_pendulum_end('dop853')))"
    )
    interpreted = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert interpreted == [part.hex() for part in double_pendulum_end("dop853")]


@pytest.mark.parametrize("method", ["auto", "radau5", "generalized_alpha"])
def test_a_first_run_on_a_machine_does_not_import_numba(method, tmp_path):
    script = (
        "import sys; from symgen.runtime import load\n"
        f"load({str(ROOT / 'generated' / 'slider_crank.py')!r}).run(t_end=0.1, method={method!r}).health\n"
        "print('numba' in sys.modules)"
    )
    (tmp_path / "cache").mkdir(mode=0o700)
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "SYMGEN_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["False"], done.stderr


def test_what_does_not_fit_the_sources_is_left_to_numba(nothing_loaded, monkeypatch, tmp_path):
    def doubled(x, out):
        out[0] = 2.0 * x

    def tripled(x, out):
        out[0] = 3.0 * x

    out = np.zeros(1)
    layout = native.layout((1.0, out))
    function = Jitted(doubled)
    monkeypatch.setattr(shipped, "FOLDER", tmp_path)
    monkeypatch.setattr(
        jitted, "watcher", lambda made, fits, content: shipped.write(tmp_path, made, fits, content)
    )
    function(1.0, out)
    assert shipped.find(function, layout) is not None
    tripled.__qualname__ = doubled.__qualname__
    tripled.__name__ = doubled.__name__
    other = Jitted(tripled)
    assert shipped.file_name(other, layout) == shipped.file_name(function, layout)
    assert shipped.find(other, layout) is None
    # As files of Python that have not changed, in which both stand.
    shipped.write_files(tmp_path, {shipped.file_name(function, layout): shipped.as_written(function)})
    shipped._files_when_shipped.cache_clear()
    monkeypatch.setattr(shipped, "sources", lambda function: "unknown")
    assert shipped.find(function, layout) is not None
    assert shipped.find(other, layout) is None
    shipped._files_when_shipped.cache_clear()
    other(1.0, out)
    assert out[0] == 3.0


def test_comments_and_docstrings_do_not_count():
    def plain(x, out):
        out[0] = 2.0 * x

    def commented(x, out):
        """Say what it does."""
        # and why
        out[0] = 2.0 * x

    commented.__qualname__ = plain.__qualname__
    commented.__name__ = plain.__name__
    text = shipped._statements(plain)
    assert "2.0 * x" in text and shipped._statements(commented) == text.replace("plain", "commented")
