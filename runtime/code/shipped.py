"""Step loops that travel with the package: LLVM bitcode for any machine, of which only machine code is made later.

Typing and lowering a step loop with Numba takes ten times as long as LLVM needs to emit machine code for what comes
out, which is the same for all models and machines. So it is done once, by `python -m tests.ship_loops`, and kept in
`loops/`, a file for each function and each signature. A file serves as long as the sources that it was made of
are those of the package; otherwise, and for functions that have none, Numba compiles.

To tell that, sources are parsed, as comments do not count. Where files of Python are still what they were when loops
were shipped, to the byte, that is known without.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import lzma
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from symgen.runtime.code.compile_jitted import Jitted

FOLDER = Path(__file__).with_name("loops")
_AS_WRITTEN = "as_written.txt"


def file_name(function: Jitted, layout: str) -> str:
    """Return the name of the file of a function compiled for arguments of a layout (`native.layout`)."""
    variant = hashlib.sha256(f"{name(function)} {layout}".encode()).hexdigest()[:12]
    return f"{function.py_func.__name__}-{variant}.xz"


def find(function: Jitted, layout: str) -> bytes | None:
    """Return the bitcode of a function for a layout, as `write` got it; None if there is none of these sources."""
    path = FOLDER / file_name(function, layout)
    if not path.exists():
        return None
    (_, _, made_of), content = read(path)
    is_current = _files_when_shipped().get(path.name) == as_written(function) or made_of == sources(function)
    return content if is_current else None


def read(path: Path) -> tuple[list[str], bytes]:
    """Return what a file is for (name of the function, layout, hash of its sources), and its bitcode."""
    head, _, content = lzma.decompress(path.read_bytes()).partition(b"\n")
    return head.decode().split(" "), content


def write(folder: Path, function: Jitted, layout: str, content: bytes) -> Path:
    """Keep the bitcode of a function for a layout, as `compile_jitted` returns it."""
    head = " ".join((name(function), layout, sources(function)))
    path = folder / file_name(function, layout)
    path.write_bytes(lzma.compress(head.encode() + b"\n" + content, preset=9))
    return path


def write_files(folder: Path, of: dict[str, str]) -> None:
    """Keep, for each file of bitcode by its name, what `as_written` says of its function."""
    lines = "".join(f"{name} {written}\n" for name, written in sorted(of.items()))
    (folder / _AS_WRITTEN).write_text(lines, encoding="ascii", newline="\n")


@functools.cache
def _files_when_shipped() -> dict[str, str]:
    path = FOLDER / _AS_WRITTEN
    return dict(line.split() for line in path.read_text("ascii").splitlines()) if path.exists() else {}


def as_written(function: Jitted) -> str:
    """Return a hash of the files that a function is written in, and of its constants: equal, so are its `sources`."""
    texts = set()
    for called in function.called():
        constants = sorted(f"{of}={value!r}" for of, value in called.constants())
        code = called.py_func.__code__
        place = _hash_of_file(code.co_filename), str(code.co_firstlineno)
        texts.add("\n".join((name(called), str(called.distinct_arrays), *place, *constants)))
    return hashlib.sha256("\0".join(sorted(texts)).encode()).hexdigest()


@functools.cache
def _hash_of_file(path: str) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def name(function: Jitted) -> str:
    """Return what a function is called: where it stands does not matter, it may move."""
    return function.py_func.__qualname__


def sources(function: Jitted) -> str:
    """Return a hash of what a function is made of, the same for each version of Python: texts and constants.

    Comments, docstrings and layout do not count.
    """
    texts = []
    for called in function.called():
        constants = sorted(f"{of}={value!r}" for of, value in called.constants())
        texts.append(
            "\n".join((name(called), str(called.distinct_arrays), _statements(called.py_func), *constants))
        )
    return hashlib.sha256("\0".join(sorted(texts)).encode()).hexdigest()


@functools.cache
def _statements(function: Any) -> str:
    """Return the text of a function without comments, docstrings and layout."""
    code = function.__code__
    node = _functions(code.co_filename)[code.co_firstlineno]
    for inner in ast.walk(node):
        if isinstance(inner, ast.FunctionDef) and ast.get_docstring(inner, clean=False) is not None:
            inner.body = inner.body[1:] or [ast.Pass()]
    return ast.unparse(node)


@functools.cache
def _functions(path: str) -> dict[int, ast.FunctionDef]:
    """Return the functions of a file by the line in which they begin, decorators included.

    To parse a file once takes a third of what finding the text of each of its functions takes.
    """
    blocks: list[ast.AST] = [ast.parse(Path(path).read_bytes())]
    for block in blocks:  # grows while it is walked
        blocks += (inner for inner in getattr(block, "body", ()) if hasattr(inner, "body"))
    functions = (block for block in blocks if isinstance(block, ast.FunctionDef))
    return {min(x.lineno for x in (node, *node.decorator_list)): node for node in functions}
