"""Arguments and options that commands share: the model, its build options, values of named quantities."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

from symgen.model.library import SUFFIXES, bundled, find
from symgen.runtime.quantities import QuantityError, in_si


class NameValue(click.ParamType):
    """`NAME=VALUE`, converted to the pair of texts."""

    name = "NAME=VALUE"

    def convert(
        self, value: Any, param: click.Parameter | None, context: click.Context | None
    ) -> tuple[str, str]:
        if isinstance(value, tuple):
            return value
        name, equals, text = value.partition("=")
        if not equals or not name.strip() or not text.strip():
            self.fail(f"{value!r} is not of the form NAME=VALUE", param, context)
        return name.strip(), text.strip()


class Times(click.ParamType):
    """`T1,T2,…`, numbers or quantities, converted to a tuple of numbers [s]."""

    name = "T1,T2,…"

    def convert(
        self, value: Any, param: click.Parameter | None, context: click.Context | None
    ) -> tuple[float, ...]:
        if isinstance(value, tuple):
            return value
        try:
            times = tuple(in_si(part, "s", part.strip()) for part in value.split(",") if part.strip())
        except QuantityError as error:
            self.fail(
                f"{value!r} is not a list of times in seconds, such as 0.5,1,2.25 or '500 ms, 1 s': {error}",
                param,
                context,
            )
        if not all(map(math.isfinite, times)):
            self.fail(f"{value!r} holds a time that is not finite", param, context)
        return times


class Positive(click.ParamType):
    """A finite number above zero, or also zero itself."""

    name = "NUMBER"

    def __init__(self, or_zero: bool = False):
        self._or_zero = or_zero

    def convert(self, value: Any, param: Any, context: click.Context | None) -> float:
        number = self._read(value, param, context)
        if not (math.isfinite(number) and (number > 0.0 or (self._or_zero and number == 0.0))):
            self.fail(f"{value!r} is not a finite number above zero", param, context)
        return number

    def _read(self, value: Any, param: Any, context: click.Context | None) -> float:
        try:
            return float(value)
        except ValueError:
            self.fail(f"{value!r} is not a number", param, context)


class Duration(Positive):
    """A time above zero: a number of seconds, or a quantity such as '10 s' or '5 ms'."""

    name = "TIME"

    def _read(self, value: Any, param: Any, context: click.Context | None) -> float:
        try:
            return in_si(value, "s", repr(value))
        except QuantityError as error:
            self.fail(str(error), param, context)


def model_argument(command: Callable, *, required: bool = True) -> Callable:
    """Give a command its MODEL argument and `--option`."""
    option = click.option(
        "--option",
        "options",
        multiple=True,
        type=NameValue(),
        help="A build option of a .py model; may be repeated.",
    )
    return click.argument("model", required=required, shell_complete=_models)(option(command))


def _models(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    """Complete MODEL: bundled models, files and folders."""
    path = Path(begun)
    folder = path if begun.endswith("/") else path.parent
    beside = sorted(folder.glob("*")) if folder.is_dir() else []
    files = [f"{x}/" if x.is_dir() else str(x) for x in beside if x.is_dir() or x.suffix.lower() in SUFFIXES]
    return [name for name in (*bundled(), *files) if name.startswith(begun)]


def value_options(command: Callable) -> Callable:
    """Give a command `--set`, `--start` and `--rate`."""
    texts = (
        ("rate", "Start value of a rate: a number (SI) or a quantity."),
        ("start", "Start value of a coordinate: a number (SI) or a quantity, such as theta='10 deg'."),
        ("set", "Value of a parameter or input: a number (SI) or a quantity, such as k='5 N/m'."),
    )
    for name, text in texts:
        command = click.option(f"--{name}", f"{name}_values", multiple=True, type=NameValue(), help=text)(
            command
        )
    return command


def find_model(model: str) -> Path:
    """Return the file of MODEL."""
    return Path(find(model))


def as_dict(pairs: Iterable[tuple[str, str]], option: str) -> dict[str, str]:
    """Return pairs as a dictionary; a name given twice is wrong usage."""
    values: dict[str, str] = {}
    for name, text in pairs:
        if name in values:
            raise click.UsageError(f"{option} gives {name!r} twice")
        values[name] = text
    return values
