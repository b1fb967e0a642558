"""Frozen data classes that are made quickly: a process makes two dozen of them before its first run.

`dataclasses.dataclass` writes up to six functions of each class as text and compiles them, which is a tenth of the time
that a run of the command line takes to start. Here they are written once, for all classes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, FrozenInstanceError, dataclass
from typing import Any, dataclass_transform


@dataclass_transform(frozen_default=True)
def record(
    cls: type | None = None, *, kw_only: bool = False, eq: bool = True
) -> type | Callable[[type], type]:
    """Make a class a frozen data class, as `dataclasses.dataclass(frozen=True)` does; `replace` and `fields` know it.

    Parameters
    ----------
    cls : type
    kw_only : bool
        Values are given by name only.
    eq : bool
        Instances with equal values are equal, and have one hash.
    """
    if cls is None:
        return lambda one: record(one, kw_only=kw_only, eq=eq)
    made = dataclass(init=False, repr=False, eq=False, kw_only=kw_only)(cls)
    made.__init__, made.__setattr__, made.__delattr__ = _init, _set, _delete
    if "__repr__" not in vars(made):
        made.__repr__ = _repr
    if eq:
        made.__eq__, made.__hash__ = _equal, _hash
    return made


def _init(self: Any, *values: Any, **named: Any) -> None:
    fields, own = self.__dataclass_fields__, vars(self)
    if len(values) > len(self.__match_args__):
        most = len(self.__match_args__)
        raise TypeError(f"{type(self).__name__} takes {most} values at most, and {len(values)} are given")
    own.update(zip(self.__match_args__, values))
    if not named.keys() <= fields.keys():
        name = next(name for name in named if name not in fields)
        raise TypeError(f"{type(self).__name__}.__init__() got an unexpected keyword argument {name!r}")
    if not own.keys().isdisjoint(named):
        name = next(name for name in named if name in own)
        raise TypeError(f"{type(self).__name__}.__init__() got multiple values for argument {name!r}")
    own.update(named)
    if len(own) < len(fields):
        for name, field in fields.items():
            if name not in own:
                own[name] = _default(self, field)
    if hasattr(self, "__post_init__"):
        self.__post_init__()


def _default(self: Any, field: Any) -> Any:
    if field.default is not MISSING:
        return field.default
    if field.default_factory is not MISSING:
        return field.default_factory()
    raise TypeError(f"{type(self).__name__}.__init__() missing the required argument {field.name!r}")


def _set(self: Any, name: str, value: Any) -> None:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _delete(self: Any, name: str) -> None:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


def _repr(self: Any) -> str:
    shown = (name for name, field in self.__dataclass_fields__.items() if field.repr)
    return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in shown)})"


def _values(self: Any) -> tuple:
    return tuple(getattr(self, name) for name, field in self.__dataclass_fields__.items() if field.compare)


def _equal(self: Any, other: object) -> bool:
    return _values(self) == _values(other) if other.__class__ is self.__class__ else NotImplemented


def _hash(self: Any) -> int:
    return hash(_values(self))
