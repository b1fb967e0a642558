"""Index tables of generated modules: what the text of a long one says is what Python and the run time read."""

import random
import time
from pathlib import Path

import pytest

from symgen.emit.index_text import SHORTEST, table_text
from symgen.runtime.errors import ModuleError
from symgen.runtime.index_tables import LARGEST, entries_of
from symgen.runtime.module import read_module

N = 3 * SHORTEST
TABLES = {
    "short": (3, 5, 4),
    "one": (7,),
    "upwards": tuple(range(3, N)),
    "downwards to zero": tuple(range(N, -1, -1)),
    "by sevens": tuple(range(5, 5 + 7 * N, 7)),
    "equal": (4,) * N,
    "in turns": (188, 188, 1577, 988) * N,
    "woven": tuple(x for k in range(N) for x in (1200 + 2 * k, 1000 + k, 200 + k, 500 - k)),
    "rows of a triangle": tuple(598 + 5 * j for k in range(40) for j in range(k)),
    "counts of a triangle": tuple(396 - k for k in range(40) for _ in range(k)),
    "with a beginning and an end": (604, *range(610, 610 + N), 2, 9, *range(N, 0, -2), 1),
    "a period that does not end": (*(1, 5, 8, 2, 6) * N, 1, 5, 8),
    "none": tuple(random.Random(3).randrange(1000) for _ in range(N)),
}


@pytest.mark.parametrize("entries", TABLES.values(), ids=TABLES)
def test_a_table_reads_back(entries):
    text = table_text(entries)
    assert entries_of(text[1:-1]) == entries
    value = eval(text)
    assert value == entries or entries == (value,)


def test_short_tables_are_written_out():
    entries = tuple(range(SHORTEST - 1))
    assert table_text(entries) == f"({', '.join(map(str, entries))})"


def test_what_repeats_is_said_once():
    assert table_text(TABLES["upwards"]) == f"(*range(3, {N}),)"
    assert table_text(TABLES["downwards to zero"]) == f"(*range({N}, -1, -1),)"
    assert table_text(TABLES["equal"]) == f"(*(4,)*{N},)"
    assert table_text(TABLES["in turns"]) == f"(*(188, 188, 1577, 988)*{N},)"
    woven = f"(*(a + b*k for k in range({N}) for a, b in ((1200, 2), (1000, 1), (200, 1), (500, -1))),)"
    assert table_text(TABLES["woven"]) == woven
    assert all(len(table_text(x)) < 5 * 40 * 12 for name, x in TABLES.items() if "triangle" in name)


def test_random_tables_of_stretches_read_back():
    chance = random.Random(11)
    for _ in range(60):
        entries: list[int] = []
        while len(entries) < 150:
            period = chance.randrange(1, 12)
            pairs = [(chance.randrange(2000, 4000), chance.choice((0, 1, 3, -7))) for _ in range(period)]
            entries += [a + b * k for k in range(chance.randrange(1, 30)) for a, b in pairs]
        text = table_text(tuple(entries))
        assert entries_of(text[1:-1]) == tuple(entries)
        assert len(text) <= 2 + sum(len(str(x)) + 2 for x in entries)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "-1",
        "1, x",
        "1,2",
        "1.0, 2",
        "*range(0, 4, 0),",
        "*range(4, 0),",
        "*range(3, -3, -1),",
        "*range(0, 4), -1",
        "*(1, 2)*0,",
        "*(a + b*k for k in range(0) for a, b in ((1, 2), (3, 4))),",
        "*(a + b*k for k in range(9) for a, b in ((1, -2), (3, 4))),",
        "*(a + b*k for k in range(9) for a, b in ((1, 2), (3, print()))),",
        "*open('/etc/passwd'),",
        "*range(0, 4)) or (1,",
        f"*range(0, {LARGEST + 1}),",
        "*range(0, 999999999999999),",
        "*(1, 2)*999999999999999,",
        "*(a + b*k for k in range(999999999999999) for a, b in ((1, 2), (3, 4))),",
    ],
)
def test_anything_else_is_refused_at_once(text):
    start = time.process_time()
    assert entries_of(text) is None
    assert time.process_time() - start < 2


def test_no_more_entries_than_there_is_room_for():
    for text in ("*(7,)*40, *(7,)*40, *(7,)*21", "*range(0, 101),", f"{'1, ' * 100}1"):
        assert entries_of(text, 101) is not None
        assert entries_of(text, 100) is None


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ("I0 = (1, x)", "'I0' is not of whole numbers"),
        ("I0 = (*range(0, 999999999),)", "more than"),
        ("I0 = (1, 2)\nI0 = (1, 2)", "'I0' stands there twice"),
    ],
)
def test_a_module_whose_tables_are_none_says_so(lines, says):
    text = (Path(__file__).parent / "fixtures" / "pendulum.py").read_text()
    with pytest.raises(ModuleError, match=says) as caught:
        read_module(text.replace("\n}\n", f"\n}}\n{lines}\n", 1))
    assert "line " in str(caught.value)
    assert read_module(text.replace("\n}\n", "\n}\nI0 = (*range(2, 5), 9)\n", 1)).tables == {
        "I0": (2, 3, 4, 9)
    }
