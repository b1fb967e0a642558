"""The tables of methods in README.md, made from the records of the methods."""

from __future__ import annotations

import re
from pathlib import Path

from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS, Method

README = Path(__file__).resolve().parent.parent / "README.md"
_HEAD = "| method | order | step | for |\n|---|---|---|---|\n"
_MOST_NAMED = 3


def with_tables(text: str) -> str:
    """Return the text of the README with its tables made anew."""
    text = re.sub(re.escape(_HEAD) + r"(\|.*\n)+", lambda _: _HEAD + methods_table(), text)
    for form, methods in FORMS.items():
        row = re.compile(rf"^\| `{form}` \| [^|]* \|", re.MULTILINE)
        text = row.sub(f"| `{form}` | {', '.join(methods)} |", text)
    return text


def methods_table() -> str:
    """Return the rows: adaptive methods first, those of one purpose together."""
    groups: dict[tuple[bool, str], list[Method]] = {}
    for method in METHODS.values():
        groups.setdefault((method.adaptive, method.purpose), []).append(method)
    rows = sorted(groups.items(), key=lambda group: not group[0][0])
    return "".join(
        f"| {_names(methods)} | {_orders(methods)} | {'adaptive' if adaptive else 'fixed'} | {purpose} |\n"
        for (adaptive, purpose), methods in rows
    )


def _names(methods: list[Method]) -> str:
    names = [" = ".join(f"`{name}`" for name in (m.name, *m.other_names)) for m in methods]
    if len(names) > _MOST_NAMED:
        return f"{names[0]}, {names[1]}, … {names[-1]}"
    return ", ".join(names)


def _orders(methods: list[Method]) -> str:
    if methods[0].orders is not None:
        return "{} to {}".format(*methods[0].orders)
    orders = list(dict.fromkeys(method.order for method in methods))
    return f"{orders[0]} to {orders[-1]}" if len(orders) > _MOST_NAMED else ", ".join(map(str, orders))
