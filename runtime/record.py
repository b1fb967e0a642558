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
    made._layout = _Layout(made)
    if "__repr__" not in vars(made):
        made.__repr__ = _repr
    if eq:
        made.__eq__, made.__hash__ = _equal, _hash
    return made


def _init(self: Any, *values: Any, **named: Any) -> None:
    own, layout = self.__dict__, self._layout
    own.update(layout.defaults)
    if values:
        own.update(zip(layout.names, values))
    own.update(named)
    for name, factory in layout.factories:
        if name not in own:
            own[name] = factory()
    if own.keys() != layout.fields or (values and not layout.is_free(values, named)):
        _refuse(self, values, named)
    if layout.has_post_init:
        self.__post_init__()


class _Layout:
    """What making an instance of a class needs: found once."""

    def __init__(self, cls: Any):
        fields = cls.__dataclass_fields__
        self.names, self.fields = cls.__match_args__, fields.keys()
        self.defaults = {name: f.default for name, f in fields.items() if f.default is not MISSING}
        self.factories = [
            (name, f.default_factory) for name, f in fields.items() if f.default_factory is not MISSING
        ]
        self.has_post_init = hasattr(cls, "__post_init__")

    def is_free(self, values: tuple, named: dict[str, Any]) -> bool:
        """Whether each value has a name of its own."""
        n = len(values)
        return n <= len(self.names) and (not named or named.keys().isdisjoint(self.names[:n]))


def _refuse(self: Any, values: tuple, named: dict[str, Any]) -> None:
    kind, fields, names = type(self).__name__, self.__dataclass_fields__, self.__match_args__
    if len(values) > len(names):
        raise TypeError(f"{kind} takes {len(names)} values at most, and {len(values)} are given")
    for name in named:
        if name not in fields:
            raise TypeError(f"{kind}.__init__() got an unexpected keyword argument {name!r}")
        if name in names[: len(values)]:
            raise TypeError(f"{kind}.__init__() got multiple values for argument {name!r}")
    missing = next(name for name in fields if name not in vars(self))
    raise TypeError(f"{kind}.__init__() missing the required argument {missing!r}")


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
