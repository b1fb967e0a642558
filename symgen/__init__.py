"""symgen: multibody models become equations of motion, compiled code, checked runs and recordings."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sympy import acos, asin, atan, atan2, cos, cosh, erf, exp, log, pi, sign, sin, sinh, sqrt, tan, tanh

    from .front import Model
    from .link import load, robot
    from .model.from_sympy import mod, smoothstep, where
    from .model.sympy_functions import dot, floor, heaviside, maximum, minimum, sensor, t
    from .version import __version__ as __version__

__all__ = [
    "Model",
    "acos",
    "asin",
    "atan",
    "atan2",
    "cos",
    "cosh",
    "dot",
    "erf",
    "exp",
    "floor",
    "heaviside",
    "load",
    "log",
    "maximum",
    "minimum",
    "mod",
    "pi",
    "robot",
    "sensor",
    "sign",
    "sin",
    "sinh",
    "smoothstep",
    "sqrt",
    "t",
    "tan",
    "tanh",
    "where",
]
_OWN = {
    "Model": ".front",
    "load": ".link",
    "robot": ".link",
    "__version__": ".version",
    **dict.fromkeys(
        ("dot", "floor", "heaviside", "minimum", "maximum", "sensor", "t"),
        ".model.sympy_functions",
    ),
    **dict.fromkeys(("mod", "smoothstep", "where"), ".model.from_sympy"),
}


def __getattr__(name: str) -> Any:
    # SymPy takes a second to import, and most commands do without it.
    if name == "equations":
        return importlib.import_module(".equations", __name__)
    if name not in __all__ and name not in _OWN:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = (
        importlib.import_module(_OWN[name], __name__) if name in _OWN else importlib.import_module("sympy")
    )
    value = getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
