"""`runtime/record.py` makes what `dataclasses.dataclass(frozen=True)` makes."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import pytest

from symgen.runtime.record import record


def _body(decorate):
    class Entry:
        """An entry."""

        name: str
        value: float = 1.0
        parts: list = dataclasses.field(default_factory=list)
        hidden: object = dataclasses.field(default=None, repr=False, compare=False)

        def __post_init__(self):
            if self.value < 0.0:
                raise ValueError("negative")

    Entry.__qualname__ = "Entry"
    return decorate(Entry)


Plain, Made = _body(dataclasses.dataclass(frozen=True)), _body(record)
Entry = Made  # where pickle looks for it
CALLS = (
    ((), {}), (("a",), {}), (("a", 2.0), {}), (("a", 2.0, [1]), {"hidden": 3}), ((), {"value": 2.0, "name": "a"}),
    (("a",), {"name": "b"}), (("a",), {"other": 1}), (("a", 1.0, [], 2, 3), {}), (("a", -1.0), {}),
)  # fmt: skip


def outcome(cls, args, named):
    try:
        made = cls(*args, **named)
    except (TypeError, ValueError) as error:
        return type(error)
    return repr(made), dataclasses.asdict(made), [field.name for field in dataclasses.fields(made)]


@pytest.mark.parametrize(("args", "named"), CALLS)
def test_it_takes_and_refuses_what_a_dataclass_does(args, named):
    assert outcome(Made, args, named) == outcome(Plain, args, named)


def test_it_is_frozen_compared_by_values_and_varied():
    one, same, other = Made("a", 2.0, hidden=1), Made("a", 2.0, hidden=2), Made("a", 3.0)
    assert one == same and one != other and one != "a"
    with pytest.raises(dataclasses.FrozenInstanceError):
        one.name = "b"
    with pytest.raises(dataclasses.FrozenInstanceError):
        del one.name
    assert one.name == "a"
    varied = dataclasses.replace(one, value=5.0)
    assert (varied.name, varied.value, varied.hidden) == ("a", 5.0, 1)
    assert one.parts is not Made("a").parts
    assert copy.copy(one) == pickle.loads(pickle.dumps(one)) == one


def test_hashes_and_keywords():
    @record(kw_only=True)
    class Pair:
        """Two numbers."""

        a: int
        b: int = 2

    assert hash(Pair(a=1)) == hash(Pair(a=1, b=2)) and len({Pair(a=1), Pair(b=2, a=1), Pair(a=2)}) == 2
    with pytest.raises(TypeError):
        Pair(1)

    @record(eq=False)
    class Place:
        """Something that there is once."""

        a: int

    assert Place(1) != Place(1) and len({Place(1), Place(1)}) == 2


def test_a_wrong_name_does_not_stand_in_for_a_missing_one():
    with pytest.raises(TypeError, match="unexpected keyword argument 'w'"):
        Made(value=1.0, parts=[], hidden=None, w=2)
