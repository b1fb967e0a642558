"""What a recording must be before a run is made from it: it may come from anybody, and then says what it likes."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symgen.runtime.errors import RuntimeModelError

from .errors import RecordingError

if TYPE_CHECKING:
    from symgen.runtime.system import System

    from .recording import Recording

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,199}", re.ASCII)
_LONGEST_WORD = 100
_ASKED = ("method", "constraints", "rtol", "atol", "step", "energy_scaling", "split", "max_step", "breaks")


@contextlib.contextmanager
def blamed_on(path: str | Path) -> Iterator[None]:
    """Tell what goes wrong with the content of a recording as its fault, by its file.

    Raises
    ------
    RecordingError
    """
    try:
        yield
    except RuntimeModelError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
        what = " ".join(str(error).split())[:300]
        raise RecordingError(
            f"{path}: its parts contradict each other ({type(error).__name__}: {what}); run the model again"
        ) from error


def check_settings(recording: Recording) -> None:
    """Refuse names that are none, and settings that no run has.

    Raises
    ------
    RecordingError
    """
    for what, value, (fits, expected) in (
        ("its model's name", recording.name, (_is_name, "a name: letters, digits and underscores")),
        ("its title", recording.title, _TEXT),
        ("its module", recording.module_text, _TEXT),
        ("its model's text", recording.model_text, _TEXT),
        ("its method", recording.method, (_is_word, "the name of a method")),
        ("its form of constraints", recording.constraints, (_is_word, "the name of a form")),
        ("its status", recording.status, _TEXT),
        ("rtol", recording.rtol, _TOLERANCE),
        ("atol", recording.atol, _TOLERANCE),
        ("its options", recording.options, _TABLE),
        ("its statistics", recording.stats, _TABLE),
        ("its inputs over time", recording.inputs_over_time, _TABLE),
        ("its health", recording.health, (_is_list(lambda x: type(x) is dict), "a list of checks")),
    ):
        if not fits(value):
            raise RecordingError(
                f"{recording.path}: {what} is {value!r:.60}, not {expected}; run the model again"
            )
    for key, value in recording.options.items():
        fits, expected = _OPTIONS.get(key, (None, ""))
        if fits is not None and not (value is None or fits(value)):
            raise RecordingError(f"{recording.path}: its option {key!r} is {value!r:.60}, not {expected}")


def check_fits(recording: Recording, system: System) -> None:
    """Refuse a recording whose states or parameters are not those of the model in it.

    Raises
    ------
    RecordingError
    """
    for what, columns, width in (
        ("coordinates", recording.q, system.nq),
        ("rates", recording.v, system.nv),
        ("work", recording.w, system.nw),
        ("settings", recording.settings, system.n_settings_of_switches),
    ):
        if columns.shape[1] != width:
            raise RecordingError(
                f"{recording.path}: its states have {columns.shape[1]} columns of {what}, its model {width}"
            )
    for what, values, records in (
        ("parameters", recording.parameters, system.parameters),
        ("inputs", recording.inputs, system.inputs),
    ):
        if list(values) != [record["name"] for record in records]:
            raise RecordingError(f"{recording.path}: its {what} are not those of its model")


def _is_name(x: Any) -> bool:
    return type(x) is str and _NAME.fullmatch(x) is not None


def _is_word(x: Any) -> bool:
    return (
        type(x) is str
        and len(x) <= _LONGEST_WORD
        and x.replace(" ", "").replace("_", "").isalnum()
        and x.isascii()
    )


def _is_number(x: Any) -> bool:
    return type(x) in (int, float) and math.isfinite(x)


def _is_list(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda x: type(x) is list and all(map(fits, x))


_TEXT = (lambda x: type(x) is str, "text")
_TABLE = (lambda x: type(x) is dict and all(type(key) is str for key in x), "a table")
_TOLERANCE = (lambda x: _is_number(x) and x >= 0.0, "a number that is not negative")
_TIME = (_is_number, "a time")
_OPTIONS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "t_start": _TIME,
    "t_end": _TIME,
    "step": (lambda x: _is_number(x) and x > 0.0, "a number above zero"),
    "fps": (lambda x: _is_number(x) and x > 0.0, "a number above zero"),
    "at": (_is_list(_is_number), "a list of times"),
    "notes": (_is_list(_TEXT[0]), "a list of texts"),
    "redundant": (lambda x: type(x) is bool or _is_list(_TEXT[0])(x), "a list of names"),
    "asked": (lambda x: _TABLE[0](x) and set(x) <= set(_ASKED), f"a table of {', '.join(_ASKED)}"),
}
