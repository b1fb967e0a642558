"""Step loops that travel with the package: LLVM bitcode for any machine, of which only machine code is made later.

Typing and lowering a step loop with Numba takes ten times as long as LLVM needs to emit machine code for what comes
out, which is the same for all models and machines. So it is done once, by `python -m tests.ship_loops`, and kept in
`loops/`, a file for each function and each signature. A file serves as long as the sources that it was made of
are those of the package; otherwise, and for functions that have none, Numba compiles.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import lzma
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from symgen.runtime.code.compile_jitted import Jitted

FOLDER = Path(__file__).with_name("loops")


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
    return content if made_of == sources(function) else None


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


def _statements(function: Any) -> str:
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return ast.unparse(tree)
