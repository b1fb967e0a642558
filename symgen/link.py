"""From models to running systems: derivation with a cache of generated modules, the one door from symgen to runtime."""

from __future__ import annotations

import contextlib
import functools
import gc
import hashlib
import os
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symgen import runtime
from symgen.model import library
from symgen.model.files import LARGEST_TABLE, read_plain
from symgen.runtime.code.cache import cache_folder, fetch, prune, store
from symgen.runtime.errors import ModuleError
from symgen.runtime.graph.layouts import LATE
from symgen.runtime.graph.nodes import FoldingError
from symgen.runtime.lazy import Late
from symgen.runtime.module import read_module
from symgen.runtime.record import record

from .errors import TOO_LARGE, ModelError, SymgenError
from .version import __version__

if TYPE_CHECKING:
    from symgen.runtime import System
    from symgen.runtime.robot import Robot

    from .derive.program import Program
    from .emit.stretched import Stretched
    from .model.description import Description
    from .model.model import Model

robots = Late("symgen.derive.robot")
requests = Late("symgen.derive.robot_request")
running = Late("symgen.runtime.robot")
starts = Late("symgen.derive.starts")
methods = Late("symgen.runtime.integrate.methods")
subsystems = Late("symgen.derive.scenes.subsystems")
module = Late("symgen.emit.module")
stretched = Late("symgen.emit.stretched")
toml_text = Late("symgen.model.toml_text")

_GENERATOR = ("model", "derive", "emit")  # folders whose sources decide what a generated module says,
_SHARED = Path(runtime.__file__).parent / "graph"  # with what both halves know: functions, units
_KEPT_GENERATORS = 20


@record
class ModuleText:
    """A generated module for a model file.

    `derived` tells whether it was derived now (in `seconds`) or found in the cache at `path`.
    """

    text: str
    derived: bool
    seconds: float
    path: Path | None


@record
class DerivedModel:
    """A freshly derived model with what was found on the way; `seconds` by stage.

    `operations` counts all that a call of each function does, `once` those of them that depend on parameters only,
    `code` those that stand in its text, where loops over equal subsystems count once. `is_part` tells whether functions
    are left out.
    """

    text: str
    name: str
    operations: dict[str, int]
    once: dict[str, int]
    code: dict[str, int]
    seconds: dict[str, float]
    structure: dict[str, Any]
    findings: tuple[str, ...]
    is_part: bool = False


_MANY_COORDINATES = 600  # from which on a model may be one that shorter ones say all of
_LARGE_TEXT = 1_000_000  # characters of a module whose derivation is worth a search for what it left behind


def _uncollected(function: Callable[..., Any]) -> Callable[..., Any]:
    """Pause Python's collector meanwhile: its searches take a third of the time, and nodes are no cycles."""

    @functools.wraps(function)
    def paused(*args: Any, **options: Any) -> Any:
        collecting = gc.isenabled()
        gc.disable()
        try:
            return function(*args, **options)
        finally:
            if collecting:
                gc.enable()

    return paused


@_uncollected
def derive(model: Model, jacobian: bool = False) -> System:
    """Derive a model and load the result.

    Parameters
    ----------
    model : Model
    jacobian : bool
        Whether the derivatives of `rhs` are functions of its module, too.

    Returns
    -------
    symgen.runtime.System
    """
    description = model.describe()
    vet = model.values_of_runs()
    if jacobian:
        return runtime.load(_derived_text(description, jacobian=True).text).vetted_by(vet)
    text = _derived_text(description, on_demand=not _wants_all(description)).text
    return runtime.load(text, _uncollected(lambda: _derived_text(description).text)).vetted_by(vet)


def load(
    model: str | Path,
    *,
    functions: str | Sequence[str] = (),
    frames: Sequence[str] = (),
    actuators: Sequence[str] = (),
    **options: Any,
) -> System:
    """Load a model, ready to run: derived now, or found in the cache.

    Parameters
    ----------
    model : path or str
        A `.toml` or `.py` file, or the name of a bundled model.
    functions, frames, actuators
        As of `robot`: with one of them the system has what robot programs call, `system.robot`.
    **options
        Build options of a `.py` model, which is executed.

    Returns
    -------
    symgen.runtime.System

    Raises
    ------
    ModelError
        There is no such model, or it is wrong.

    Examples
    --------
    >>> symgen.load("four_bar").run("2 s")
    >>> symgen.load("n_pendulum", N=5).run("2 s")
    """
    path = library.find(model)
    given = {name: str(value) for name, value in options.items()}
    try:
        text = module_for(path, given, on_demand=True).text
    except ModelError as error:
        raise error.located(file=library.said(path)) from None
    system = load_module(text, path, given)
    if functions or frames or actuators:
        return system.with_robot(robot(path, functions, frames, actuators, **options))
    return system


def load_module(
    text: str, path: Path, options: dict[str, str], notify: Callable[[str], None] | None = None
) -> System:
    """Load the module of a model file, with ways to what it leaves out and to the checks of its description.

    Parameters
    ----------
    text : str
    path : Path
    options : dict of str to str
        Build options of a `.py` description.
    notify : callable, optional
        As of `module_for`.
    """
    here = path.absolute()  # the working folder may be another one when these are asked for
    system = runtime.load(text, lambda: module_for(here, options, notify).text)
    return system.vetted_by(lambda: library.load(here, options).values_of_runs(library.said(path))())


def robot(
    model: str | Path | Model,
    functions: str | Sequence[str] = "robot",
    frames: Sequence[str] = (),
    actuators: Sequence[str] = (),
    **options: Any,
) -> Robot:
    """Return what robot programs call of a model: derived now, or found in the cache; nothing else is derived.

    Parameters
    ----------
    model : path, str or Model
        A `.toml` or `.py` file, or the name of a bundled model.
    functions : str or sequence of str
        Names as in docs/robots.md; "robot" stands for the usual ones: inverse and forward dynamics, mass and Coriolis
        matrix, gravity, energy, centre of mass and momentum.
    frames : sequence of str
        Bodies and frames whose pose and Jacobian are wanted.
    actuators : sequence of str
        Inputs that hold the robot in `equilibrium_torques`; all by default.
    **options
        Build options of a `.py` model, which is executed.

    Returns
    -------
    symgen.runtime.robot.Robot

    Raises
    ------
    ModelError
        There is no such model, function, frame or actuator, or the model cannot have the function.
    """
    request = requests.requested(functions, frames, actuators)
    if not isinstance(model, (str, Path)):
        return running.load_robot(robot_text(model, request))
    path = library.find(model)
    given = {name: str(value) for name, value in options.items()}
    cached = _cached_module(path, given, repr(request))
    content = fetch(cached)
    if content is not None:
        return running.load_robot(content.decode())
    try:
        text = robot_file_text(path, given, request)
    except ModelError as error:
        raise error.located(file=library.said(path)) from None
    store(cached, text.encode())
    return running.load_robot(text)


def robot_file_text(path: Path, options: dict[str, str], request: requests.RobotRequest) -> str:
    """Derive the functions for robot programs of a model file, without looking into the cache."""
    return robot_text(library.load(path, options), request, _source_hash(_read(path), options))


@_uncollected
def robot_text(model: Model, request: requests.RobotRequest, source: str = "") -> str:
    """Derive the functions for robot programs into the text of a module of their own."""
    description = model.describe()
    try:
        text = module.emit(robots.derive_robot(description, request, source))
    except ModelError as error:
        raise error.located(file=f"model '{description.name}'") from None
    _check_readable(text, description.name)
    return text


@_uncollected
def derive_text(
    model: Model, source: str | None = None, jacobian: bool = False, on_demand: bool = False
) -> DerivedModel:
    """Derive a model into the text of its generated module.

    Parameters
    ----------
    model : Model
    source : str, optional
        Hash of the file that the model came from; made of the equations themselves where there is none.
    jacobian : bool
        Whether the derivatives of `rhs` are functions of the module, too.
    on_demand : bool
        Whether what few runs call may be left out of a large model.

    Returns
    -------
    DerivedModel
    """
    start = time.perf_counter()
    description = model.describe()
    checked = time.perf_counter() - start
    on_demand = on_demand and not _wants_all(description)
    made = _derived_text(description, source, jacobian, on_demand)
    made.seconds["check"] = checked
    return made


def _wants_all(description: Description) -> bool:
    """Whether the method that a model's file names, or its start, calls functions that are left out otherwise."""
    if description.start is not None and starts.needs_balance(description):
        return True
    return "method" in description.run and methods.calls(description.run["method"], LATE)


def _derived_text(
    description: Description, source: str | None = None, jacobian: bool = False, on_demand: bool = False
) -> DerivedModel:
    checked = time.perf_counter()
    long = None
    if not jacobian and len(description.coordinates) >= _MANY_COORDINATES:
        long = stretched.long_model(description, source or "", LATE if on_demand else ())
    try:
        program = long or subsystems.derive(description, source or "", jacobian, on_demand)
    except ModelError as error:
        raise error.located(file=f"model '{description.name}'") from None
    except FoldingError as error:
        raise ModelError(str(error), file=f"model '{description.name}'", hint=TOO_LARGE) from None
    derived = time.perf_counter()
    text = module.emit(program) if long is None else long.text
    if source is None:
        source = program.header["source"] = _hash(text.encode())
        text = text.replace('"source": ""', f'"source": "{source}"', 1)
    made = _derived_model(program, text, {"check": 0.0, "derive": derived - checked, "emit": 0.0})
    # Of large models the graph takes more memory than anything else, and reading the text needs much, too.
    leaves_much = len(text) > _LARGE_TEXT and long is None
    del program, long
    if leaves_much:
        gc.collect()  # the collector is paused meanwhile, and derivations refer to themselves
    _check_readable(text, made.name)
    made.seconds["emit"] = time.perf_counter() - derived
    return made


def _check_readable(text: str, name: str) -> None:
    """Refuse to hand out a module that the run time would not take: nobody can mend that in the model."""
    try:
        read_module(text)
    except ModuleError as error:
        raise SymgenError(
            f"model '{name}': its module is not right at {error.place}: {error.cause}; this is an error in symgen, not "
            "in the model: please report it, with the model"
        ) from None


def _derived_model(program: Program | Stretched, text: str, seconds: dict[str, float]) -> DerivedModel:
    head = program.header
    sizes = {key: head[key] for key in ("nq", "nv", "nh", "nn", "nw")}
    return DerivedModel(
        text=text,
        name=head["name"],
        operations=dict(head["operations"]),
        once={name: counts[0] for name, counts in program.all_counts().items()},
        code=program.written_operations(),
        seconds=seconds,
        structure={
            **sizes,
            **head["structure"],
            "subsystems": [len(part.members) for part in program.parts] or [1],
        },
        findings=program.findings,
        is_part="late" in head,
    )


@_uncollected
def derive_file(
    path: Path, options: dict[str, str] | None = None, jacobian: bool = False, on_demand: bool = False
) -> DerivedModel:
    """Read a model file and derive it, without looking into the cache.

    Parameters
    ----------
    path : Path
        A `.toml` or `.py` description.
    options : dict of str to str
        Build options of a `.py` description.
    jacobian, on_demand : bool
        As of `derive_text`.

    Returns
    -------
    DerivedModel
    """
    start = time.perf_counter()
    content = _read(path)
    model = library.load(path, options or {})
    read = time.perf_counter() - start
    result = derive_text(model, _source_hash(content, options or {}), jacobian, on_demand)
    result.seconds["read"] = read
    return result


def module_for(
    path: Path,
    options: dict[str, str] | None = None,
    notify: Callable[[str], None] | None = None,
    on_demand: bool = False,
) -> ModuleText:
    """The generated module of a model file, from the user's cache or derived now.

    A module is found by the content of the model file, its options and the generator's own sources, so it is
    never stale.

    Parameters
    ----------
    path : Path
    options : dict of str to str
    notify : callable, optional
        Gets a line of text when a derivation starts.
    on_demand : bool
        Whether what few runs call may be left out of a large model.

    Returns
    -------
    ModuleText
    """
    options = options or {}
    cached = _cached_module(path, options)
    content = fetch(cached)
    if content is None and on_demand:
        part = _cached_module(path, options, "on demand")
        content = fetch(part)
    if content is not None:
        return ModuleText(content.decode(), False, 0.0, cached)
    if notify is not None:
        notify(f"deriving {path.stem} …")
    start = time.perf_counter()
    derived = derive_file(path, options, on_demand=on_demand)
    text = derived.text
    seconds = time.perf_counter() - start
    if derived.is_part:
        cached = part
    stored = store(cached, text.encode())
    return ModuleText(text, True, seconds, cached if stored else None)


def _cached_module(path: Path, options: dict[str, str], request: str = "") -> Path:
    """Where a module of a model file is kept; `request` says what it has beyond or instead of the usual functions."""
    key = hashlib.sha256()
    for part in (
        os.fsencode(path.name),
        _source_hash(_read(path), options).encode(),
        generator_hash().encode(),
        *([request.encode()] if request else []),
    ):
        key.update(part + b"\0")
    for content in _files_beside(path):
        key.update(hashlib.sha256(content).digest())
    stem = "".join(x if x.isascii() and x.isalnum() else "_" for x in path.stem)[:60]
    return cache_folder("modules") / f"{stem}-{key.hexdigest()[:32]}"


@functools.lru_cache(maxsize=1)
def generator_hash() -> str:
    """Hash of the sources that decide what a generated module says.

    It is remembered for as long as they have the sizes and times that they had, as Python does with its bytecode.
    """
    folder = str(Path(__file__).parent)
    sources = sorted(_sources(folder, _GENERATOR))
    shared = sorted(_sources(str(_SHARED.parent), (_SHARED.name,)))
    stamp = hashlib.sha256(repr((__version__, folder, sources, shared)).encode()).hexdigest()[:40]
    remembered = cache_folder("generators") / stamp
    known = fetch(remembered)
    if known is not None:
        return known.decode()
    digest = hashlib.sha256(__version__.encode())
    for place, files in ((folder, sources), (_SHARED.parent, shared)):
        for name, _, _ in files:
            digest.update(name.encode() + b"\0")
            digest.update(Path(place, name).read_bytes())
    if store(remembered, digest.hexdigest().encode()):
        prune(remembered.parent, _KEPT_GENERATORS)
    return digest.hexdigest()


def _sources(folder: str, parts: tuple[str, ...]) -> Iterator[tuple[str, int, int]]:
    """Names, sizes and times of the Python files below some folders in `folder`."""
    for part in parts:
        with os.scandir(f"{folder}/{part}") as entries:
            for entry in entries:
                name = f"{part}/{entry.name}"
                if entry.is_dir():
                    yield from _sources(folder, (name,))
                elif name.endswith(".py"):
                    status = entry.stat()
                    yield name, status.st_size, status.st_mtime_ns


def _files_beside(path: Path) -> Iterator[bytes]:
    """The contents of the files that a TOML model names: tables, and assemblies with what these name.

    What is wrong with them is found when they are read.
    """
    waiting = [path] if path.suffix.lower() == ".toml" else []
    seen: set[Path] = set()
    while waiting:
        file = waiting.pop()
        if file in seen:
            continue
        seen.add(file)
        try:
            content = read_plain(file)
            if file != path:
                yield content
            if b"table" not in content and b"assemblies" not in content:
                continue
            tables, assemblies = _named_files(toml_text.parse(content.decode("utf-8-sig"), str(file)))
        except (ModelError, ValueError, AttributeError):
            continue
        for name in tables:
            with contextlib.suppress(ModelError):
                yield read_plain(file.parent / name, LARGEST_TABLE)
        waiting += [file.parent / name for name in assemblies]


def _named_files(document: dict[str, Any]) -> tuple[list[str], list[str]]:
    """The names of tables' and assemblies' files in a model, and in the assemblies inside it."""
    tables: list[str] = []
    assemblies: list[str] = []
    waiting = [document]
    while waiting:
        here = waiting.pop()
        inside = [x for x in here.get("assemblies", {}).values() if type(x) is dict]
        waiting += inside
        for found, entries, key in (
            (tables, here.get("inputs", {}).values(), "table"),
            (tables, here.get("tables", {}).values(), "file"),
            (assemblies, inside, "file"),
        ):
            named = [x[key] for x in entries if type(x) is dict and key in x]
            found += [x for x in named if type(x) is str and ".." not in Path(x).parts]
    return tables, assemblies


def _read(path: Path) -> bytes:
    return read_plain(path)


def _source_hash(content: bytes, options: dict[str, str]) -> str:
    """Hash of a model's text (with unified line ends) and options."""
    text = content.replace(b"\r\n", b"\n")
    return _hash(text + repr(sorted(options.items())).encode() if options else text)


def _hash(content: bytes) -> str:
    return f"sha256:{hashlib.sha256(content).hexdigest()}"
