"""Texts that differ in names alone are read once; what others become is what reading them in full gives."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from symgen.errors import ModelError
from symgen.model import alike_texts
from symgen.model.expressions import parse

MODELS = Path(__file__).parent.parent / "models"
OTHER_NAMES = ("zeta", "a1", "Q_7", "b.c", "m", "x10", "x9", "alpha", "t", "Z")


def texts_in(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, (dict, list)):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from texts_in(inner)


def in_full(text: str):
    alike_texts._SEEN.clear()
    parse.cache_clear()
    return parse(text)


def of_a_kind(text: str) -> list[str]:
    """The same text with other names, which stand in another order."""
    form, names = alike_texts.form(text)
    found = []
    for turn in range(3):
        others = [OTHER_NAMES[(3 * k + turn) % len(OTHER_NAMES)] for k in range(len(names))]
        made = form
        for k in reversed(range(len(names))):
            made = made.replace(f"${k}", others[k])
        found.append(made)
    return found


def bundled_texts() -> list[str]:
    found = []
    for path in sorted(MODELS.glob("*.toml")):
        for text in texts_in(tomllib.loads(path.read_text(encoding="utf-8"))):
            try:
                if parse(text).unit is not None:  # a quantity
                    continue
            except ModelError:
                continue
            if (of := alike_texts.form(text)) is not None and len(of[1]) <= len(OTHER_NAMES):
                found.append(text)
    return sorted(set(found))


def test_is_what_reading_in_full_gives():
    used = 0
    for text in [
        *bundled_texts(),
        "-x^2/2*sin(y - 1.0) + 3*(z + x)/dot(y) - abs(u)*2^x",
        "b - a - 2*(c - b)",
    ]:
        alike = of_a_kind(text)
        expected = [in_full(one) for one in alike]
        alike_texts._SEEN.clear()
        parse.cache_clear()
        for one in (text, *alike):  # the third follows from the first two
            parse(one)
        parse.cache_clear()
        for one, full in zip(alike, expected, strict=True):
            found = parse(one)
            assert found.expression == full.expression and repr(found.expression) == repr(full.expression)
            assert (found.decimals, found.text) == (full.decimals, one)
        used += any(template is not None for template in alike_texts._SEEN.values())
    assert used > 50


@pytest.mark.parametrize(
    ("known", "wrong"),
    [
        ("x + y", "lambda + y"),
        ("x + y", "sin + y"),
        ("x + y", "min + y"),
        ("x + y", f"{'x' * 101} + y"),
        ("x + y", "$0 + $1"),
        ("x + y", "x. + y"),
        ("x + y", "x. + .y"),
        ("2*x", "2 x"),
    ],
)
def test_refuses_what_reading_in_full_refuses(known, wrong):
    with pytest.raises(ModelError) as first:
        in_full(wrong)
    alike_texts._SEEN.clear()
    parse.cache_clear()
    for name in ("x", "u", "w"):
        parse(known.replace("x", name))
    with pytest.raises(ModelError) as second:
        parse(wrong)
    assert str(second.value) == str(first.value)


def test_a_name_that_means_more_stays_what_it_is():
    for name in ("u", "w", "z"):
        parse(f"2*{name} + 1")
    assert not parse("2*pi + 1").expression.free_symbols
    assert in_full("2*pi + 1").expression == parse("2*pi + 1").expression
