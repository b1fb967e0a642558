"""Files that a command reads and writes: nothing that it reads, and no file of another kind, is ever written over."""

from __future__ import annotations

import errno
import io
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from symgen.cli.terminal import put
from symgen.errors import ModelError
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.tables import Columns

library = Late("symgen.model.library")
tables = Late("symgen.runtime.tables")

# What files of these names are. A file that is to be written may have any other name, too.
_KINDS = {
    ".toml": "a model",
    ".py": "a Python file",
    ".rrd": "a recording",
    ".csv": "a table",
    ".parquet": "a table of columns",
    ".json": "a JSON file",
    ".npz": "a file of arrays",
    ".zarr": "a store of members",
    ".html": "a page",
    ".png": "a figure",
    ".gif": "a film",
    ".mp4": "a film",
    ".webm": "a film",
    ".stl": "a mesh",
    ".urdf": "a robot",
    ".xml": "an XML file",
}
# How files of a kind begin: what begins otherwise is something else, whatever it is called.
_BEGINNINGS = {
    ".json": (b"{", b"["),
    ".rrd": (b"RRF2",),
    ".html": (b"<!DOCTYPE html",),
    ".png": (b"\x89PNG",),
    ".parquet": (b"PAR1",),
    ".npz": (b"PK",),
    ".gif": (b"GIF8",),
    ".mp4": (b"\0\0\0",),
    ".webm": (b"\x1aE\xdf\xa3",),
}
STANDARD_OUTPUT = Path("-")
_TEXTS = (".json", ".csv")  # what may go to the standard output
_TEXT_IN_TOML = re.compile(r"""["']([^"'\n]{1,1000})["']""")
_LARGEST_MODEL = 4 << 20


class OutputFile(click.ParamType):
    """A file to write, in a folder that exists.

    Parameters
    ----------
    suffix : str
        Of files of its kind; names of files of another kind are refused.
    """

    name = "FILE"

    def __init__(self, suffix: str):
        self.suffix = suffix

    def convert(self, value: Any, param: Any, context: click.Context | None) -> Path:
        path = Path(value)
        if path == STANDARD_OUTPUT and self.suffix in _TEXTS:
            return path
        if path.is_dir():
            self.fail(f"{value!r} is a folder", param, context)
        if not path.absolute().parent.is_dir():
            self.fail(f"{value!r}: the folder {str(path.parent)!r} does not exist", param, context)
        kind = _KINDS.get(path.suffix.lower())
        if kind is not None and path.suffix.lower() != self.suffix:
            self.fail(f"{value!r} is the name of {kind}, this writes {_KINDS[self.suffix]}", param, context)
        return path


class MembersFile(OutputFile):
    """Where members of an ensemble go: a file of NumPy, or a folder that is a Zarr store."""

    def __init__(self) -> None:
        super().__init__(".npz")

    def convert(self, value: Any, param: Any, context: click.Context | None) -> Path:
        path = Path(value)
        if path.suffix.lower() != ".zarr":
            return super().convert(value, param, context)
        if not path.absolute().parent.is_dir():
            self.fail(f"{value!r}: the folder {str(path.parent)!r} does not exist", param, context)
        return path


class FilmFile(OutputFile):
    """A film to write; its name says of which kind."""

    def __init__(self) -> None:
        super().__init__("")

    def convert(self, value: Any, param: Any, context: click.Context | None) -> Path:
        path = Path(value)
        if _KINDS.get(path.suffix.lower()) != "a film":
            self.fail(f"{value!r}: a film is called .mp4, .webm or .gif", param, context)
        return OutputFile(path.suffix.lower()).convert(value, param, context)


class CarefulCommand(click.Command):
    """A command that knows which files its arguments name, and refuses to write over one that it reads."""

    def invoke(self, context: click.Context) -> Any:
        context.obj = FilesInUse(context)
        try:
            return super().invoke(context)
        except Exception as error:
            error.symgen_subject = subject_of(context)  # messages name the file
            raise


def subject_of(context: click.Context) -> str:
    """What a command is about: its model, as the user names it, or its recording."""
    named = (context.params.get(name) for name in ("model", "resume_file", "recording", "first"))
    return next((str(value) for value in named if value is not None), "")


class FilesInUse:
    """The files of one command.

    Parameters
    ----------
    context : click.Context
        Its arguments: those of type `OutputFile` are written, all others that name a file are read.
    """

    def __init__(self, context: click.Context):
        self._reads: list[Path] = []
        self._writes: list[tuple[str, Path]] = []
        resumed = context.params.get("resume_file")
        outputs: list[tuple[str, Path, str]] = []
        for parameter in context.command.params:
            value = context.params.get(parameter.name)
            if isinstance(parameter.type, OutputFile):
                outputs += [(parameter.opts[0], value, parameter.type.suffix)] if value is not None else []
            elif parameter.name == "model" and value is not None:
                self._reads += _model_files(value)
            else:
                self._reads += [path for text in _texts(value) for path in _named(text)]
        self.standard_output_taken = any(path == STANDARD_OUTPUT for _, path, _ in outputs)
        for label, path, suffix in outputs:
            self.claim(label, path, suffix=suffix, instead_of=resumed if label == "--log" else None)

    def claim(self, label: str, path: Path, *, suffix: str = "", instead_of: Path | None = None) -> Path:
        """Return `path`, a file that is going to be written, unless something is lost by that.

        Parameters
        ----------
        label : str
            What writes it, for messages.
        suffix : str
            Of files of its kind, by default that of its name.
        instead_of : Path, optional
            A file that was read and is meant to be replaced.

        Raises
        ------
        click.UsageError
        """
        for read in self._reads if path != STANDARD_OUTPUT else ():
            if same_file(path, read) and not (instead_of is not None and same_file(read, instead_of)):
                how = (
                    ""
                    if os.path.abspath(path) == os.path.abspath(read)
                    else f", which is the same file as {read}"
                )
                raise click.UsageError(f"{label} {path}{how}: this command reads it, and would write over it")
        for other, written in self._writes:
            if same_file(path, written) and {label, other} != {"--log", "the recording"}:
                raise click.UsageError(f"{label} {path} and {other} {written} are the same file")
        _refuse_other_kind(label, path, suffix or path.suffix)
        self._writes.append((label, path))
        return path


def _refuse_other_kind(label: str, path: Path, suffix: str) -> None:
    """A file takes the place of one of its kind only: what is there may be somebody's, under another name, too."""
    if path == STANDARD_OUTPUT:
        return
    beginnings = _BEGINNINGS.get(suffix)
    of_other_form = suffix == ".png" and path.suffix not in ("", ".png")  # a figure may be a .pdf, too
    if beginnings is None or of_other_form or not path.is_file():
        return
    with path.open("rb") as file:
        begin = file.read(64).lstrip()
    if begin and not begin.startswith(beginnings):
        raise click.UsageError(
            f"{label} {path}: what is there is not {_KINDS[suffix]}, so it is not written over"
        )


def claim(label: str, path: Path, *, instead_of: Path | None = None) -> Path:
    """Return `path` for the running command to write, see `FilesInUse.claim`."""
    return click.get_current_context().obj.claim(label, path, instead_of=instead_of)


def refuse_other_table(label: str, path: Path | None, names: Sequence[str]) -> None:
    """Refuse to write a table over one with other columns: what is there may be somebody's measurements.

    Raises
    ------
    click.UsageError
    """
    if path is None or path == STANDARD_OUTPUT or not path.is_file() or not path.stat().st_size:
        return
    if list(tables.columns_in(path)) != list(names):
        raise click.UsageError(
            f"{label} {path}: what is there is a table with other columns, or none, so it is not written over"
        )


def write_tables(columns: Columns, csv_file: Path | None, parquet_file: Path | None) -> None:
    """Write a run as tables, each file whole or not at all."""
    if csv_file is not None:
        text = io.StringIO()
        columns.write_text(text)
        write_text(csv_file, text.getvalue())
    if parquet_file is not None:
        partial = parquet_file.with_name(f".{parquet_file.name[:100]}.{os.getpid()}.part")
        try:
            columns.write_parquet(partial)
            os.replace(partial, parquet_file)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise


def same_file(a: Path, b: Path) -> bool:
    """Whether two names are those of one file, also through links, and where it is not there yet."""
    try:
        return os.path.samefile(a, b)
    except OSError:
        return os.path.realpath(a) == os.path.realpath(b)


def write_text(path: Path, text: str) -> None:
    """Write a file whole or not at all: what was there before stays if the disk is full.

    `-` is the standard output. What is no regular file, such as /dev/stdout, is written to as it is.
    """
    if path == STANDARD_OUTPUT:
        put(text)
        return
    content = text.encode("utf-8", errors="backslashreplace")
    target = Path(os.path.realpath(path))
    try:
        if path.exists() and not path.is_file():
            path.write_bytes(content)
            return
        if target.exists() and not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        partial = target.with_name(f".{target.name[:100]}.{os.getpid()}.part")
        try:
            with partial.open("xb") as file:
                file.write(content)
            os.replace(partial, target)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise
    except OSError as error:
        error.filename = str(path)
        raise


def _model_files(model: str) -> list[Path]:
    """The file of a model, and those that it names, as far as they are there."""
    try:
        path = Path(library.find(model))
    except (ModelError, OSError, ValueError):
        return []
    found = [path]
    try:
        if path.suffix.lower() == ".toml" and path.is_file() and path.stat().st_size <= _LARGEST_MODEL:
            text = path.read_text(encoding="utf-8", errors="replace")
            for name in dict.fromkeys(_TEXT_IN_TOML.findall(text)):
                if "." in name and (path.parent / name).is_file():
                    found.append(path.parent / name)
    except (OSError, ValueError):
        pass
    return found


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, (str, Path)):
        yield str(value)
    elif isinstance(value, (tuple, list)):
        for item in value:
            yield from _texts(item)


def _named(text: str) -> list[Path]:
    """The files that an argument names: `FILE`, `NAME=FILE`, `FILE@TIME`."""
    names = {text, text.partition("=")[2], text.rpartition("@")[0]} - {""}
    found = []
    for name in names:
        try:
            if os.path.isfile(name):
                found.append(Path(name))
        except ValueError:  # a null byte
            continue
    return found
