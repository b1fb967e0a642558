"""Whether the functions of a module can be those of a model: complete, each result once, nothing read uncomputed.

What has passed is remembered in the cache folder, with what is asked of its functions at every start (`code/facts.py`),
so that only its first reading pays.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from symgen.runtime.abi import CLOSED, closed_header, is_sparse
from symgen.runtime.code.cache import cache_folder, fetch, prune, store
from symgen.runtime.code.facts import as_text
from symgen.runtime.lazy import Late
from symgen.runtime.names import result_label

if TYPE_CHECKING:
    import numpy as np

    from symgen.runtime.module_source import ModuleSource

# Read only where a module has not passed before; by this import a test follows what decides it.
dataflow = Late("symgen.runtime.code.dataflow")

# The files that decide what passes; a test holds the list against their imports.
_SOURCES = (
    "module_check.py", "abi.py", "names.py", "code/dataflow.py", "code/parse.py", "code/function_text.py",
    "code/angles.py", "code/facts.py", "code/recipe.py", "code/printing.py", "code/dense_ldl.py", "code/front_ldl.py",
    "graph/form.py", "graph/functions.py", "graph/layouts.py", "graph/nodes.py", "graph/spelling.py",
)  # fmt: skip
_KEPT = 1000
_passed: dict[str, str] = {}  # and what its functions are like, as text
_last: list = [None, None]  # of the module that was read last: a model is derived, checked, and loaded


def verified(source: ModuleSource) -> ModuleSource:
    """Return a module whose functions have been followed through, each result of each.

    Raises
    ------
    symgen.runtime.errors.ModuleError
        Names the function and the element or name that is missing, written twice or read too early.
    """
    key = _key(source)
    if key not in _passed:
        path = cache_folder("checked") / key
        known = fetch(path)
        _passed[key] = _follow(source) if known is None else known.decode()
        if known is None and store(path, _passed[key].encode()):
            prune(path.parent, _KEPT)
    found = replace(source, facts_text=_passed[key])
    found.__dict__.update(source.__dict__ | found.__dict__)  # with the forms that were read
    if "_functions" in found.__dict__:
        _last[:] = [(key, source.file), found.__dict__["_functions"]]
    elif _last[0] == (key, source.file):
        found.__dict__["_functions"] = _last[1]
    return found


def _key(source: ModuleSource) -> str:
    digest = hashlib.sha256(source.text_hash.encode())
    sizes = [source.header[key] for key in ("nq", "nv", "nh", "nn", "nw")]
    sizes += [source.header["robot"]] if "robot" in source.header else []
    digest.update("\0".join((repr(sizes), *source.functions.values())).encode())
    folder = Path(__file__).parent
    for name in _SOURCES:
        digest.update((folder / name).read_bytes())
    return digest.hexdigest()[:40]


def _follow(source: ModuleSource) -> str:
    header = source.header
    written, texts = {}, {}
    for name in source.functions:
        text = source.function(name)
        if text is not None:
            texts[name] = text
            written[name] = dataflow.follow(
                text,
                lambda place, name=name: result_label(header, name, place),
                sparse=is_sparse(header, name),
            )
    if "robot" not in header:
        _compare(header, written, texts, "")
    if header.get("switches"):
        _compare(closed_header(header), written, texts, CLOSED)
    n_parameters = len(header["parameters"])
    return as_text({name: dataflow.facts_of(text.form, n_parameters, header) for name, text in texts.items()})


def _compare(header: dict, written: dict[str, np.ndarray], texts: dict, prefix: str) -> None:
    """Hold the zeros that matrices leave out against each other: M is symmetric, and the Jacobian has M and G in it."""
    import numpy as np

    nq, nv, m = header["nq"], header["nv"], header["nh"] + header["nn"]

    # A pattern is an array of pairs (row, column): of a thousand bodies a matrix has millions of zeros.
    def pattern(name: str, columns: int) -> np.ndarray:
        return np.stack(np.divmod(written[name], columns))

    def part(whole: np.ndarray, rows: slice, columns: slice) -> np.ndarray:
        i, j = whole
        inside = (rows.start <= i) & (i < rows.stop) & (columns.start <= j) & (j < columns.stop)
        return np.stack((i[inside] - rows.start, j[inside] - columns.start))

    def agree(
        name: str, here: np.ndarray, there: np.ndarray, other: str, first: tuple[int, int], width: int
    ) -> None:
        wanted, own = there[0] * width + there[1], np.sort(here[0] * width + here[1])
        lacks = np.searchsorted(own, wanted, "right") == np.searchsorted(own, wanted, "left")
        if lacks.any():
            i, j = divmod(int(wanted[lacks].min()), width)
            place = (first[0] + i) * width + first[1] + j
            meaning = result_label(header, name.removeprefix(CLOSED), place)
            texts[name].refuse(1, f"out[{place}] ({meaning}) is never written, but {other} has it")

    mass = pattern("mass_matrix", nv)
    if not prefix:
        agree("mass_matrix", mass, mass[::-1], "its mirror image", (0, 0), nv)
    jacobian = prefix + "residual_jacobian"
    if jacobian not in written:  # it is held against these when it comes
        return
    width = nq + 2 * nv + m
    whole = pattern(jacobian, width)
    above, below = slice(0, nv), slice(nv, nv + m)
    by_a, by_lam = slice(nq + nv, nq + 2 * nv), slice(nq + 2 * nv, width)
    if not prefix:
        agree("mass_matrix", mass, part(whole, above, by_a), f"{jacobian!r}", (0, 0), nv)
    agree(jacobian, part(whole, above, by_a), mass, "'mass_matrix'", (0, nq + nv), width)
    if m:
        name = prefix + "constraint_jacobian"
        G = pattern(name, nv)
        agree(name, G, part(whole, below, by_a), f"{jacobian!r}", (0, 0), nv)
        agree(jacobian, part(whole, below, by_a), G, f"{name!r}", (nv, nq + nv), width)
        agree(jacobian, part(whole, above, by_lam), G[::-1], f"{name!r}", (0, nq + 2 * nv), width)
