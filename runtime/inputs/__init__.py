"""Inputs over time: tables, polynomials and controllers in the place of constants; see docs/inputs.md."""

from runtime.lazy import lazy_exports

_EXPORTS = {
    "Controller": "runtime.inputs.controller",
    "Polynomial": "runtime.inputs.given",
    "Table": "runtime.inputs.given",
}

__all__ = sorted(_EXPORTS)
__getattr__, __dir__ = lazy_exports(__name__, _EXPORTS)
