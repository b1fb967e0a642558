"""Finding model files by path or bundled name, listing them without SymPy, and loading them."""

from __future__ import annotations

import ast
import inspect
import types
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symgen.runtime.lazy import Late

from ..errors import ModelError, SymgenError, nearest
from .files import read_plain

if TYPE_CHECKING:
    from .model import Model

builder = Late("symgen.model.model")
toml_reader = Late("symgen.model.toml_reader")

SUFFIXES = (".toml", ".py")


def bundled_folder() -> Path:
    """Where the bundled models are: inside an installed package, beside it in a source checkout."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "bundled"
    return installed if installed.is_dir() else package.parent / "models"


def bundled() -> dict[str, Path]:
    """The bundled models' files by name."""
    files = sorted(
        p for p in bundled_folder().glob("*") if p.suffix in SUFFIXES and not p.name.startswith("_")
    )
    return {path.stem: path for path in files}


def said(path: Path) -> str:
    """Return what errors call a model's file: of a bundled model its name, as nobody has typed where it lies."""
    return path.name if path.parent == bundled_folder() else str(path)


def find(model: str | Path) -> Path:
    """The file of a model, given by its path, by its name without suffix, or by the name of a bundled one.

    Only a `.toml` file is found without its suffix: a `.py` file is executed, so its author's file must be named.

    Raises
    ------
    ModelError
        If there is none, with the nearest name; or if the name is that of a bundled model and of a file here.
    """
    path = Path(model)
    suffix = path.suffix.lower()
    if suffix in SUFFIXES or len(path.parts) > 1:
        if not path.is_file():
            if path.is_dir():
                what = "is a folder"
            elif path.exists():
                what = "is no plain file, but a device or a pipe"
            else:
                what = "does not exist"
            raise ModelError(
                f"the model file '{path}' {what}", hint=_near_file(path) or "name a .toml or a .py file"
            )
        if suffix not in SUFFIXES:
            raise ModelError(f"'{path}' is not a model file", hint="a model is a .toml or a .py file")
        return path
    if suffix and path.is_file():
        of_recordings = "; `symgen verify`, `report`, `play` and `run --resume` take recordings"
        raise ModelError(
            f"'{path}' is not a model file",
            hint=f"a model is a .toml or a .py file{of_recordings if suffix == '.rrd' else ''}",
        )
    models = bundled()
    beside = path.with_name(f"{path.name}.toml") if path.name else path
    if beside.is_file():
        if path.name in models and not beside.samefile(models[path.name]):
            raise ModelError(
                f"'{path}' is a bundled model, and '{beside}' is a file here",
                hint=f"name the file, '{beside}', or rename it",
            )
        return beside
    if str(model) not in models:
        hint = nearest(str(model), models, "bundled models")
        raise ModelError(
            f"there is no bundled model '{model}'", hint=f"{hint or 'name a file'} (`symgen list` shows all)"
        )
    return models[str(model)]


def _near_file(path: Path) -> str | None:
    beside = (
        [p.name for p in path.parent.glob("*") if p.suffix.lower() in SUFFIXES and p.is_file()]
        if path.parent.is_dir()
        else []
    )
    names = [*beside, *bundled()]
    hint = nearest(path.name, names)
    return hint if hint and hint.startswith("did") else None


def list_models() -> list[tuple[str, str, Path]]:
    """Name, description and file of every bundled model; no model is executed and SymPy is not imported."""
    return [(name, _description(path), path) for name, path in bundled().items()]


def _description(path: Path) -> str:
    try:
        text = read_plain(path).decode("utf-8")
        if path.suffix == ".toml":
            import tomllib  # compiles regular expressions, which a run does not need

            return str(tomllib.loads(text).get("description", ""))
        return (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]
    except (ModelError, ValueError, SyntaxError, RecursionError):
        return "(cannot be read)"


def load(path: str | Path, options: Mapping[str, str] | None = None) -> Model:
    """Load a model file.

    Parameters
    ----------
    path : path
        A `.toml` file, which is read; or a `.py` file, which is executed and defines `build(**options)`.
    options : mapping of str to str, optional
        Arguments of `build`; text that reads as a number, `true` or `false` is converted.

    Returns
    -------
    Model
    """
    path = Path(path)
    if path.suffix.lower() == ".py":
        return _build(path, dict(options or {}))
    if path.suffix.lower() != ".toml":
        raise ModelError(
            "a model is a .toml or a .py file",
            file=str(path),
            hint="name one of these",
        )
    if options:
        raise ModelError(
            f"a TOML model has no build options ({', '.join(options)})",
            file=str(path),
            hint="parameters are set with --set NAME=VALUE",
        )
    return toml_reader.read_file(path, said=said(path))


def run_function(path: Path, name: str, *arguments: Any) -> Any:
    """Execute a `.py` model file and call a function of it; what goes wrong there is told with its line."""
    function = getattr(_execute(path), name)
    try:
        return function(*arguments)
    except (Exception, SystemExit) as error:
        raise _author_error(path, error) from error


def option_value(text: str) -> Any:
    """The value of a build option: int, float or bool where the text reads as one."""
    for convert in (int, float):
        try:
            return convert(text)
        except ValueError:
            pass
    return {"true": True, "false": False}.get(text.lower(), text)


def _build(path: Path, options: dict[str, str]) -> Model:
    module = _execute(path)
    build = getattr(module, "build", None)
    if not callable(build):
        raise ModelError(
            "the file defines no function 'build'", file=str(path), hint="def build(**options) -> Model"
        )
    arguments = {name: option_value(text) for name, text in options.items()}
    _check_options(path, build, arguments)
    try:
        model = build(**arguments)
    except (Exception, SystemExit) as error:
        raise _author_error(path, error) from error
    if not isinstance(model, builder.Model):
        raise ModelError(
            f"'build' returned {type(model).__name__}, not a Model",
            file=str(path),
            hint="end it with `return model`",
        )
    if model.folder is None:
        model.folder = path.parent
    return model


def _execute(path: Path) -> types.ModuleType:
    """Run the author's file in a module of its own; nothing is written beside it, nothing registered."""
    module = types.ModuleType(f"_symgen_model_{path.stem}")
    module.__file__ = str(path)
    try:
        code = compile(read_plain(path), str(path), "exec", dont_inherit=True)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, "lineno", None)
        raise ModelError(
            f"Python syntax: {getattr(error, 'msg', error)}", file=str(path), line=line, hint="mend that line"
        ) from None
    try:
        exec(code, module.__dict__)
    except (Exception, SystemExit) as error:
        raise _author_error(path, error) from error
    return module


# What math and NumPy say of a symbol.
_NUMBERS_ONLY = ("loop of ufunc does not support", "Cannot convert expression to float")


def _author_error(path: Path, error: BaseException) -> SymgenError:
    """What went wrong in the author's file, with the line of that file that was running."""
    import traceback

    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    line = lines[-1] if lines else None
    if isinstance(error, ModelError):
        if error.file is not None and error.file.startswith("model '"):
            error.file = str(path)
        return error.located(file=str(path), line=line if error.file == str(path) else None)
    hint = None
    if isinstance(error, TypeError) and any(sign in str(error) for sign in _NUMBERS_ONLY):
        hint = "functions of math and numpy take numbers only: for expressions take those of symgen, as symgen.sin"
    return ModelError(f"{type(error).__name__}: {error}", file=str(path), line=line, hint=hint)


def _check_options(path: Path, build: Any, arguments: dict[str, Any]) -> None:
    parameters = inspect.signature(build).parameters
    by_name = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    valid = {name: p for name, p in parameters.items() if p.kind in by_name}
    open_ended = any(p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters.values())
    for name in arguments:
        if name not in valid and not open_ended:
            listed = f"options: {', '.join(valid)}" if valid else "it has none"
            hint = nearest(name, valid) if valid else None
            hint = f"{hint} ({listed})" if hint and hint.startswith("did") else listed
            raise ModelError(f"the model has no option '{name}'", file=str(path), hint=hint)
    missing = [n for n, p in valid.items() if p.default is inspect.Parameter.empty and n not in arguments]
    if missing:
        raise ModelError(
            f"the model needs the option '{missing[0]}'", file=str(path), hint=f"--option {missing[0]}=VALUE"
        )
