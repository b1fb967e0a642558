"""Reading TOML model files, which are data from strangers: tables and keys onto the methods of `Model`."""

from __future__ import annotations

import functools
import keyword
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import ModelError, nearest
from .assemblies import PLACE_KEYS, PORT_KEYS
from .closures import CLOSURE_KEYS
from .contact_pairs import PAIR_KEYS
from .curves import TABLE_KEYS
from .elements import BUSHING_KEYS, SPRING_KEYS
from .files import LARGEST_FILE, read_plain
from .gravity import ATTRACTOR_KEYS
from .items import DRAWINGS
from .model import Model
from .names import LONGEST_NAME
from .over_time import table_path
from .rolling import ROLLING_KEYS
from .rotors import ROTOR_KEYS
from .shelf import Shelf
from .starts import START_KEYS
from .toml_text import parse
from .tyres import TYRE_KEYS

COORDINATE_KEYS = ("unit", "start", "rate", "guess", "rate_guess")
STATE_KEYS = ("derivative", "start", "guess", "unit")
INPUT_KEYS = ("unit", "default", "table", "kind", "polynomial")
BODY_KEYS = ("mass", "com", "inertia", "angle", "rotation", "shape", "density")
JOINT_KEYS = (
    "type", "parent", "child", "origin", "axis", "axis2", "coordinate", "start", "rate", "guess", "rate_guess",
    "unit", "stiffness", "damping", "rest", "armature", "limits", "restitution", "pitch",
    "sequence",
)  # fmt: skip
READY_MADE = {  # arguments in the order of the methods; those of the second list may be left out
    "distance": (("points", "length"), ()),
    "point_on_line": (("point", "line", "direction"), ("body",)),
    "point_in_plane": (("point", "plane", "normal"), ("body",)),
    "parallel": (("bodies", "axes"), ()),
    "gear": (("coordinates",), ("ratio", "teeth", "offset", "efficiency")),
    "rack": (("coordinates", "radius"), ("offset", "efficiency")),
    "belt": (("coordinates", "radii"), ("crossed", "offset")),
    "planetary": (("sun", "ring", "carrier", "teeth"), ()),
    "differential": (("input", "outputs"), ("ratio",)),
    "couple": (("expression",), ()),
    "motion": (("coordinate", "follows"), ()),
}
PAIRS = ("distance", "gear", "rack", "belt")  # whose first argument is a list, and two in the method
FRAME_KEYS = ("body", "at", "rpy", "axis", "angle", "quaternion", "x", "y")
GRAVITY_KEYS = ("x", "y", "z", "potential", "constant", "attractors")
LOAD_KEYS = ("point", "force", "body", "torque", "frame", "reaction")
STOP_KEYS = ("gap", "restitution")
FRICTION_KEYS = (
    "coordinate", "speed", "coordinates", "speeds", "torque", "force", "smooth", "creep", "static", "coefficient",
    "normal",
)  # fmt: skip
BRISTLE_KEYS = (
    "coordinate", "speed", "stiffness", "damping", "viscous", "coulomb", "static", "stribeck", "start", "unit"
)  # fmt: skip
CONTACT_KEYS = tuple(
    dict.fromkeys(("gap", "stiffness", "exponent", "damping", "friction", "slip", "smooth", *PAIR_KEYS))
)
EVENT_KEYS = ("when", "direction", "then")
ENERGY_KEYS = ("kinetic", "potential", "dissipation")
TOP_KEYS = ("name", "description", "impacts")
USE_KEYS = ("assembly", *PLACE_KEYS)
ASSEMBLY_KEYS = ("file",)  # or what a model file has


def read_file(path: Path, make: type[Model] = Model, said: str | None = None) -> Model:
    """Read a model file, which errors call `said`; meshes, tables and assemblies are looked for below its folder."""
    return read_text(
        _content(path), file=said or str(path), folder=path.parent, name=_name_of(path.stem), make=make
    )


def _content(path: Path) -> str:
    try:
        return read_plain(path).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise ModelError(
            f"the file is not UTF-8 text: byte {error.start} does not fit",
            file=str(path),
            hint="save it as UTF-8",
        ) from None


def read_text(
    text: str,
    file: str = "TOML text",
    folder: Path | None = None,
    name: str = "model",
    make: type[Model] = Model,
) -> Model:
    """Read a model from TOML text.

    Parameters
    ----------
    text : str
    file : str
        What errors call it.
    folder : Path, optional
        Where its meshes are.
    name : str
        The model's name where the text gives none.
    make : type
        The kind of builder.

    Returns
    -------
    Model
        Every value is read; what holds between the parts is checked by `Model.describe`.
    """
    return _read(text, file, folder, name, make, Shelf())


def _read(
    text: str,
    file: str,
    folder: Path | None,
    name: str,
    make: type[Model],
    shelf: Shelf,
    assembly: bool = False,
) -> Model:
    """Read a model, or an assembly of a file of its own, that finds assemblies on a shelf."""
    if len(text) > LARGEST_FILE:
        raise ModelError(
            f"the text is longer than {LARGEST_FILE >> 20} MiB",
            file=file,
            hint="leave out what the model does not need",
        )
    document = parse(text, file)
    impacts = document.get("impacts", "simultaneous")
    model = make(
        document.get("name", name), document.get("description", ""), folder=folder, impacts=impacts, _file=file
    )  # fmt: skip
    model._shelf = shelf
    place = folder / Path(file).name if folder is not None else None
    with model._reading():
        if place is None or assembly:
            _fill(model, document, TOP_KEYS)
        else:  # a file that names itself is one too many
            shelf.opened(
                place.resolve(),
                f"the file '{place.name}'",
                lambda: _fill(model, document, TOP_KEYS),
                ModelError,
            )
    return model


def _fill(model: Model, document: dict[str, Any], more: tuple[str, ...]) -> None:
    """Read the tables of a document into a model; `more` are keys that are read already."""
    error = model._sources.error
    for key in document:
        if key not in READERS and key not in more:
            hint = nearest(key[:60], [*READERS, *more], "tables")
            raise error("", key[:60], f"unknown key '{key:.60}'", hint=hint)
    for table, reader in READERS.items():
        content = document.get(table, {})
        if not isinstance(content, dict):
            hint = "write it as a heading with keys below it"
            raise error("", table, f"'{table}' is a table, [{table}]", hint=hint)
        if table in document:
            reader(model, content)


def _name_of(stem: str) -> str:
    """A model name from a file's stem."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", stem)[: LONGEST_NAME - 10]
    return name if name[:1].isalpha() and not keyword.iskeyword(name) else f"model_{name}"


# What people write for a key that has another name here.
_MEANT = {
    "value": ("default", "start"),
    "initial": ("start", "default"),
    "description": ("doc",),
    "units": ("unit",),
}


def _nearest_key(name: str, known: tuple[str, ...]) -> str | None:
    meant = next((key for key in _MEANT.get(name, ()) if key in known), None)
    return nearest(name, known, "keys") if meant is None else f"did you mean '{meant}'?"


def _keys(model: Model, table: str, key: str, content: Any, known: tuple[str, ...]) -> dict[str, Any]:
    """A table with known keys only; `key` is its prefix within `table`."""
    if not isinstance(content, dict):
        example = "{ " + ", ".join(f"{k} = …" for k in known[:2]) + " }"
        raise model._sources.error(
            table,
            key,
            f"a table is expected here, such as {example}, not {content!r:.60}",
            hint="look at the reference page for its keys",
        )
    for name in content:
        if name not in known:
            place = f"{key}.{name}" if key else name
            raise model._sources.error(
                table, place[:120], f"unknown key '{name:.60}'", hint=_nearest_key(name[:60], known)
            )
    return content


def _each(method: str) -> Callable[[Model, dict[str, Any]], None]:
    """A reader of a table whose entries are a name and a value."""

    def read(model: Model, content: dict[str, Any]) -> None:
        for name, value in content.items():
            getattr(model, method)(name, value)

    return read


def _each_table(
    method: str, table: str, known: tuple[str, ...], inline: bool
) -> Callable[[Model, dict[str, Any]], None]:
    """A reader of a table whose entries are tables, either inline or with a heading each."""

    def read(model: Model, content: dict[str, Any]) -> None:
        for name, value in content.items():
            if inline:
                _keys(model, table, name, value, known)
            else:
                _keys(model, f"{table}.{name}"[:120], "", value, known)
            getattr(model, method)(name, **value)

    return read


def _event(model: Model, content: dict[str, Any]) -> None:
    for name, value in content.items():
        table = f"events.{name}"[:120]
        _keys(model, table, "", value, EVENT_KEYS)
        if "when" not in value:
            raise model._sources.error(
                table, "when", "the key 'when' is missing", hint='for example when = "x - 0.25"'
            )
        model.event(name, **value)


def _constraints(model: Model, content: dict[str, Any]) -> None:
    for name, value in content.items():
        if isinstance(value, dict):
            _ready_made(model, name, value)
        else:
            model.constraint(name, value)


def _ready_made(model: Model, name: str, value: dict[str, Any]) -> None:
    """A constraint that is given as a table: its kind, and the arguments of that kind."""
    table, kinds = f"constraints.{name}"[:120], ("coincident", *READY_MADE)
    _keys(model, table, "", value, kinds)
    if len(value) != 1:
        message = f"a ready-made constraint is one of {', '.join(kinds)}; {len(value)} are given"
        raise model._sources.error(table, "", message, hint='for example coincident = ["a", "b"]')
    ((kind, arguments),) = value.items()
    if kind == "coincident":
        model.coincident(name, *model._vector(arguments, table, kind, (2,)))
        return
    needed, optional = READY_MADE[kind]
    _keys(model, table, kind, arguments, (*needed, *optional))
    for key in needed:
        if key not in arguments:
            raise model._sources.error(table, f"{kind}.{key}", f"the key '{key}' is missing", hint="add it")
    first, *rest = (arguments[key] for key in needed)
    place = f"{kind}.{needed[0]}"
    leading = model._vector(first, table, place, (2,)) if kind in PAIRS else [first]
    getattr(model, kind)(name, *leading, *rest, **{k: arguments[k] for k in optional if k in arguments})


def _gravity(model: Model, content: dict[str, Any]) -> None:
    given = dict(_keys(model, "gravity", "", content, GRAVITY_KEYS))
    attractors = given.pop("attractors", {})
    if not isinstance(attractors, dict):
        message = f"'attractors' is a table of tables, not {attractors!r:.60}"
        raise model._sources.error("gravity", "attractors", message, hint="write [gravity.attractors.NAME]")
    for name, value in attractors.items():
        _keys(model, "gravity", f"attractors.{name}"[:120], value, ATTRACTOR_KEYS)
        model.attractor(name, **value)
    if given or not attractors:
        model.gravity(**given)


def _energy(model: Model, content: dict[str, Any]) -> None:
    for key, value in _keys(model, "energy", "", content, ENERGY_KEYS).items():
        getattr(model, key)(value)


def _start(model: Model, content: dict[str, Any]) -> None:
    given = _keys(model, "start", "", content, START_KEYS)
    model._begin(**given)


def _run(model: Model, content: dict[str, Any]) -> None:
    for key, value in content.items():
        model.run(**{key: value})


def _ports(model: Model, content: dict[str, Any]) -> None:
    for name, value in content.items():
        given = value if isinstance(value, str) else _keys(model, "ports", name, value, PORT_KEYS)
        model.port(name, **({"kind": given} if isinstance(given, str) else given))


def _assemblies(model: Model, content: dict[str, Any]) -> None:
    """Announce all of them, as they may use each other; then read them."""
    shelf = model._shelf
    for name, value in content.items():
        table = f"assemblies.{name}"[:120]
        model._new_element(name, "assemblies", shelf.names())
        if not isinstance(value, dict):
            message = f"an assembly is a table, [{table}], not {value!r:.60}"
            raise model._sources.error(
                "assemblies", name, message, hint="write it as a heading with keys below it"
            )
        shelf.announce(name, functools.partial(_assembly, model, name, table, value))
    for name in content:
        shelf.find(name, functools.partial(model._sources.error, f"assemblies.{name}"[:120], ""))


def _assembly(model: Model, name: str, table: str, content: dict[str, Any]) -> Model:
    """An assembly that stands in a model file, or in a file of its own."""
    if "file" not in content:
        made = model._part_of(name, content.get("description", ""))
        _fill(made, content, ("description", *ASSEMBLY_KEYS))
        return made
    _keys(model, table, "", content, ASSEMBLY_KEYS)
    file = content["file"]
    fail = functools.partial(model._sources.error, table, "file")
    if not isinstance(file, str):
        raise fail(f"a file is named by text, not {file!r:.60}", hint='for example file = "cylinder.toml"')
    path = table_path(model, "file", file, table, "assembly")
    shelf = model._shelf

    def read() -> Model:
        own = Shelf(root=shelf)
        named = _name_of(path.stem)
        return _read(_content(path), _shown(model, path), path.parent, named, type(model), own, assembly=True)

    return shelf.of_file(path, read, fail)


def _shown(model: Model, path: Path) -> str:
    """A file as errors call it: as the model's own file is called, beside it."""
    own = Path(model._sources.name).parent
    return str(own / path.relative_to(model.folder.resolve()))


def _use(model: Model, content: dict[str, Any]) -> None:
    for name, value in content.items():
        if not isinstance(value, dict):
            message = f"a use is a table, [use.{name:.60}], not {value!r:.60}"
            raise model._sources.error("use", name, message, hint='with the key assembly = "NAME"')
        given = dict(value)
        model.use(name, given.pop("assembly", None), **given)


READERS: dict[str, Callable[[Model, dict[str, Any]], None]] = {
    "ports": _ports,
    "tables": _each_table("table", "tables", TABLE_KEYS, inline=False),
    "assemblies": _assemblies,  # which may call the tables
    "parameters": _each("parameter"),
    "constants": _each("constant"),
    "use": _use,
    "coordinates": _each_table("coordinate", "coordinates", COORDINATE_KEYS, inline=True),
    "states": _each_table("state", "states", STATE_KEYS, inline=True),
    "inputs": _each_table("input", "inputs", INPUT_KEYS, inline=True),
    "definitions": _each("definition"),
    "bodies": _each_table("body", "bodies", BODY_KEYS, inline=False),
    "points": _each_table("point", "points", ("body", "at"), inline=False),
    "axes": _each_table("axis", "axes", ("body", "direction"), inline=False),
    "frames": _each_table("frame", "frames", FRAME_KEYS, inline=False),
    "joints": _each_table("joint", "joints", JOINT_KEYS, inline=False),
    "rotors": _each_table("rotor", "rotors", ROTOR_KEYS, inline=False),
    "springs": _each_table("spring", "springs", SPRING_KEYS, inline=False),
    "bushings": _each_table("bushing", "bushings", BUSHING_KEYS, inline=False),
    "gravity": _gravity,
    "energy": _energy,
    "forces": _each("force"),
    "loads": _each_table("load", "loads", LOAD_KEYS, inline=False),
    "stops": _each_table("stop", "stops", STOP_KEYS, inline=False),
    "friction": _each_table("friction", "friction", FRICTION_KEYS, inline=False),
    "bristles": _each_table("bristle", "bristles", BRISTLE_KEYS, inline=False),
    "contacts": _each_table("contact", "contacts", CONTACT_KEYS, inline=False),
    "constraints": _constraints,
    "closures": _each_table("closure", "closures", CLOSURE_KEYS, inline=False),
    "rolling": _each_table("rolling", "rolling", ROLLING_KEYS, inline=False),
    "tyres": _each_table("tyre", "tyres", TYRE_KEYS, inline=False),
    "velocity_constraints": _each("velocity_constraint"),
    "outputs": _each("output"),
    "events": _event,
    "start": _start,
    "draw": _each_table("draw", "draw", tuple(DRAWINGS), inline=False),
    "run": _run,
}
