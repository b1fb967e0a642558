"""Linear analysis: equilibria, linearisation on independent coordinates, modes, frequency response; docs/linear.md."""

from importlib import import_module
from typing import Any

_EXPORTS = {
    "Equilibrium": "runtime.linear.equilibrium",
    "FrequencyResponse": "runtime.linear.frequency",
    "LinearModel": "runtime.linear.model",
    "Mode": "runtime.linear.modes",
    "Modes": "runtime.linear.modes",
    "find_equilibrium": "runtime.linear.equilibrium",
    "linearise": "runtime.linear.linearisation",
}

__all__ = sorted(_EXPORTS)


def __getattr__(name: str) -> Any:
    if name not in _EXPORTS:
        raise AttributeError(f"module 'runtime.linear' has no attribute {name!r}")
    return getattr(import_module(_EXPORTS[name]), name)
