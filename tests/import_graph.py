"""Who imports whom among our own modules, at all levels: when loaded, inside functions, for types, by name in a text.

`python -m tests.import_graph` counts circles by level and lists their modules.
"""

from __future__ import annotations

import ast
import functools
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# As an installed package has them.
PLACES = {"symgen": "symgen", "runtime": "symgen.runtime"}
_OURS = ("symgen", "runtime")
LEVELS = ("module", "function", "typing", "name")


@dataclass(frozen=True)
class Import:
    """One import.

    Attributes
    ----------
    importer, imported : str
        Modules; `imported` may be one of others, by its full name.
    level : str
        "module": when the importer is loaded; "function": when a function is called; "typing": for annotations
        alone; "name": by a text that names a module, as tables of what is imported late do.
    line : int
    names : tuple of str
        What is taken from the module; empty for the module itself.
    """

    importer: str
    imported: str
    level: str
    line: int
    names: tuple[str, ...] = ()


@dataclass
class Module:
    """One file: what it imports, and the names that others may import from it."""

    name: str
    file: Path
    is_package: bool
    tree: ast.Module
    imports: list[Import] = field(default_factory=list)

    @functools.cached_property
    def defined(self) -> set[str]:
        """Names at its top level, those of late tables included."""
        found: set[str] = set()
        for node in _top_level(self.tree.body):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                found.add(node.name)
            elif isinstance(node, ast.Import | ast.ImportFrom):
                found |= {(alias.asname or alias.name).split(".")[0] for alias in node.names}
            else:
                found |= {
                    n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
                }
        if "__getattr__" in found:
            found |= {
                n.value for n in ast.walk(self.tree) if isinstance(n, ast.Constant) and type(n.value) is str
            }
        return found


def _top_level(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    for node in body:
        yield node
        for part in ("body", "orelse", "handlers", "finalbody"):
            if isinstance(node, ast.If | ast.Try | ast.With | ast.For | ast.ExceptHandler):
                yield from _top_level(getattr(node, part, []))


def module_name(file: Path) -> str:
    """Return what a file of this tree is imported as."""
    top, *rest = file.relative_to(ROOT).with_suffix("").parts
    parts = [PLACES.get(top, top), *rest]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@functools.cache
def modules(tops: tuple[str, ...] = _OURS) -> Mapping[str, Module]:
    """Return all modules below some folders, with their imports."""
    ours = dict(modules()) if tops != _OURS else {}
    found: dict[str, Module] = {}
    for top in tops:
        if ours and top in _OURS:
            continue  # read before
        for file in sorted((ROOT / top).rglob("*.py")):
            tree = ast.parse(file.read_text(encoding="utf-8"))
            name = module_name(file)
            found[name] = Module(name, file, file.name == "__init__.py", tree)
    known = {*ours, *found}
    for module in found.values():
        module.imports += _imports(module, known)
    return ours | found


def _imports(module: Module, known: set[str]) -> Iterator[Import]:
    pending: list[tuple[ast.AST, str]] = [(module.tree, "module")]
    while pending:
        node, level = pending.pop()
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            pending += [(part, "typing") for part in node.body]
            pending += [(part, level) for part in node.orelse]
            continue
        if isinstance(node, ast.FunctionDef | ast.Lambda) and level == "module":
            level = "function"
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(module.name, alias.name, level, node.lineno)
        elif isinstance(node, ast.ImportFrom):
            yield from _imports_from(module, node, level, known)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value.partition(":")[0]
            named = _package(module, 1) + text if text.startswith(".") else text
            if "." in named and named in known and named != module.name:
                yield Import(module.name, named, "name", node.lineno)
        pending += [(part, level) for part in ast.iter_child_nodes(node)]


def _imports_from(module: Module, node: ast.ImportFrom, level: str, known: set[str]) -> Iterator[Import]:
    base = node.module or ""
    if node.level:
        base = ".".join(filter(None, (_package(module, node.level), node.module)))
    plain = []
    for alias in node.names:
        if f"{base}.{alias.name}" in known:
            yield Import(module.name, f"{base}.{alias.name}", level, node.lineno)
        else:
            plain.append(alias.name)
    if plain:
        yield Import(module.name, base, level, node.lineno, tuple(plain))


def _package(module: Module, level: int) -> str:
    parts = module.name.split(".")
    return ".".join(parts[: len(parts) - level + module.is_package])


def circles(levels: tuple[str, ...] = LEVELS) -> list[list[str]]:
    """Return the strongly connected components of more than one module, the largest first.

    Importing a module loads the packages above it, too; that is no import of theirs.
    """
    found = modules()
    graph = {
        name: {i.imported for i in module.imports if i.level in levels and i.imported in found} - {name}
        for name, module in found.items()
    }
    return sorted((part for part in _components(graph) if len(part) > 1), key=len, reverse=True)


def _components(graph: Mapping[str, set[str]]) -> Iterator[list[str]]:
    """Tarjan's algorithm (SIAM J. Comput. 1 (1972) 146), without recursion."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    for root in graph:
        if root in number:
            continue
        number[root] = lowest[root] = len(number)
        stack.append(root)
        path = [(root, iter(sorted(graph[root])))]
        while path:
            node, rest = path[-1]
            for other in rest:
                if other not in number:
                    number[other] = lowest[other] = len(number)
                    stack.append(other)
                    path.append((other, iter(sorted(graph[other]))))
                    break
                if other in stack:
                    lowest[node] = min(lowest[node], number[other])
            else:
                path.pop()
                if path:
                    lowest[path[-1][0]] = min(lowest[path[-1][0]], lowest[node])
                if lowest[node] == number[node]:
                    k = stack.index(node)
                    yield sorted(stack[k:])
                    del stack[k:]


def dangling(tops: tuple[str, ...]) -> list[str]:
    """Return imports of names that our modules do not have, as 'file:line: from module import name'."""
    ours = modules()
    found = []
    for module in modules(tops).values():
        for i in module.imports:
            if i.imported.partition(".")[0] != "symgen" or i.level == "name":
                continue
            place = f"{module.file.relative_to(ROOT)}:{i.line}"
            if i.imported.startswith("symgen.bundled"):
                continue
            if i.imported not in ours:
                found.append(f"{place}: import {i.imported}")
                continue
            found += [
                f"{place}: from {i.imported} import {name}"
                for name in i.names
                if name != "*" and name not in ours[i.imported].defined
            ]
    return found


if __name__ == "__main__":
    print(f"{len(modules())} modules")
    for chosen in (("module",), ("module", "function"), ("module", "typing"), LEVELS):
        sizes = [len(part) for part in circles(chosen)]
        print(f"circles over {', '.join(chosen)}: {len(sizes)}, of {sum(sizes)} modules {sizes or ''}")
    for part in circles():
        print(*part, sep="\n  ")
    inside = [
        i for m in modules().values() for i in m.imports if i.level == "function" and i.imported in modules()
    ]
    print(f"imports of our own modules inside functions: {len(inside)}")
    sys.exit(bool(circles()))
