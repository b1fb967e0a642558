"""Inputs over time: tables, polynomials and controllers in the place of constants; see docs/inputs.md."""

from importlib import import_module
from typing import Any

_EXPORTS = {
    "Controller": "runtime.inputs.controller",
    "Polynomial": "runtime.inputs.given",
    "Table": "runtime.inputs.given",
}

__all__ = sorted(_EXPORTS)


def __getattr__(name: str) -> Any:
    if name not in _EXPORTS:
        raise AttributeError(f"module 'runtime.inputs' has no attribute {name!r}")
    return getattr(import_module(_EXPORTS[name]), name)
