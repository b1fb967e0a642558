"""The integration methods by name. A file here declares a family: coefficients, where these are a table, and records.

Whatever file is put here takes part: its `RECORDS`, a tuple of `Method`, are a method, once for each form of
constraints that it has.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Collection

from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.integrate.method import Method

_FAMILIES = sorted(
    name.removesuffix(".py")
    for name in os.listdir(os.path.dirname(__file__))
    if name.endswith(".py") and name != "__init__.py"
)
# Explicit ones first, then those with steps of one length, then by order.
RECORDS: tuple[Method, ...] = tuple(
    sorted(
        (
            record
            for family in _FAMILIES
            for record in importlib.import_module(f"{__name__}.{family}").RECORDS
        ),
        key=lambda record: (record.stiff, record.adaptive, record.order),
    )
)

# By name, in the form that a method has by itself.
METHODS: dict[str, Method] = {}
for _record in RECORDS:
    if _record.form == "projection" or _record.name not in METHODS:
        METHODS[_record.name] = _record
OTHER_NAMES = {other: name for name, method in METHODS.items() for other in method.other_names}


def calls(name: str, functions: Collection[str]) -> bool:
    """Whether the method of a name, its own or another, calls one of some functions of a model; no of `auto`."""
    method = METHODS.get(OTHER_NAMES.get(name, name))
    return method is not None and not set(functions).isdisjoint(method.kernels)


def find_method(name: str) -> Method:
    """Return the method called `name`, by its own or another name.

    Raises
    ------
    RuntimeModelError
        There is none; the message names the nearest.
    """
    own = OTHER_NAMES.get(name, name)
    if own not in METHODS:
        raise RuntimeModelError(
            f"there is no integration method {name!r}: {nearest(name, ['auto', *METHODS, *OTHER_NAMES])}"
        )
    return METHODS[own]
