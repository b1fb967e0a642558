"""Controllers that a .py model brings along: its function `control(system, parameters)`."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from symgen.errors import ModelError
from symgen.model.files import read_plain
from symgen.model.library import run_function

if TYPE_CHECKING:
    from symgen.runtime.options import RunOptions
    from symgen.runtime.system import System


def with_control(path: Path, system: System, options: RunOptions) -> RunOptions:
    """Return options with the inputs that the model's file says, but for those of which the user says something.

    The file is executed only if it defines `control`.

    Parameters
    ----------
    path : Path
        The model's file.
    system : System
    options : RunOptions
        Their `parameters` are handed on to `control`.

    Raises
    ------
    ModelError
        `control` fails, or does not return a dictionary.
    """
    if path.suffix.lower() != ".py" or not _defines_control(path):
        return options
    parameters = dict(options.parameters or {})
    found = run_function(path, "control", system, parameters)
    if not isinstance(found, dict):
        raise ModelError(
            f"'control' returned {type(found).__name__}, not a dictionary",
            file=str(path),
            hint='def control(system, parameters): return {"F": Controller(…)}',
        )
    given = options.inputs or {}
    said = {*parameters, *given}
    free = {
        key: value
        for key, value in found.items()
        if not said & set(key if isinstance(key, tuple) else (key,))
    }
    return replace(options, inputs={**free, **given})


def _defines_control(path: Path) -> bool:
    text = read_plain(path).decode("utf-8")
    if "def control(" not in text:
        return False
    return any(isinstance(node, ast.FunctionDef) and node.name == "control" for node in ast.parse(text).body)
