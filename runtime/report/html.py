"""Pieces of a page: tables, paragraphs and sections, with every text escaped."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape, unescape

from symgen.runtime.plain_text import plain

_MOST_ROWS = 60


class Markup(str):
    """Text that is HTML already, and is not escaped again."""


def markup(text: str) -> Markup:
    """Return a text as HTML; Markup stays as it is."""
    return text if isinstance(text, Markup) else Markup(escape(text))


def number(value: float) -> str:
    """Return a number with the digits that a reader compares: twelve."""
    return f"{value + 0.0:.12g}"  # without the sign of -0


def paragraph(text: str) -> Markup:
    """Return a paragraph; nothing for an empty text."""
    return Markup(f"<p>{markup(text)}</p>" if text else "")


def listing(lines: Iterable[str]) -> Markup:
    """Return lines as they stand, indentation included; nothing where there are none."""
    text = "\n".join(map(markup, lines))
    return Markup(f"<pre>{text}</pre>" if text else "")


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Markup:
    """Return a table, of long ones the beginning and how much is left out; nothing where it has no rows."""
    if not rows:
        return Markup("")
    top = "".join(f"<th>{markup(cell)}</th>" for cell in head)
    body = "".join(
        f"<tr>{''.join(f'<td>{markup(cell)}</td>' for cell in row)}</tr>" for row in rows[:_MOST_ROWS]
    )
    more = paragraph(f"… and {len(rows) - _MOST_ROWS} more") if len(rows) > _MOST_ROWS else ""
    inside = f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
    return Markup(f'<div class="wide">{inside}</div>{more}')


def figure(svg: str, caption: str) -> Markup:
    """Return a picture with what it shows; nothing where there is no picture."""
    return Markup(f"<figure>{svg}<figcaption>{markup(caption)}</figcaption></figure>" if svg else "")


def section(title: str, *parts: str) -> Markup:
    """Return a titled section; nothing where all parts are empty."""
    inside = "".join(map(markup, parts))
    return Markup(
        f'<section id="{_anchor(title)}"><h2>{markup(title)}</h2>{inside}</section>' if inside else ""
    )


def _anchor(title: str) -> str:
    return "-".join(re.findall(r"[a-z0-9]+", title.lower()))


def contents(sections: Iterable[str]) -> Markup:
    """Return the list of sections that are there, with links to them."""
    titles = [
        found[1] for part in sections if (found := re.match(r'<section id="[^"]*"><h2>(.*?)</h2>', part))
    ]
    links = "".join(f'<li><a href="#{_anchor(unescape(title))}">{title}</a></li>' for title in titles)
    return Markup(f'<nav aria-label="contents"><ol>{links}</ol></nav>' if links else "")


def page(title: str, body: Iterable[str]) -> str:
    """Return a whole page; it names nothing outside itself."""
    parts = "\n".join(map(markup, body))
    return plain(
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{markup(title)}</title><style>{_STYLE}</style></head>\n"
        f"<body><main>{parts}</main></body></html>\n"
    )


_LIGHT = (
    "--paper:#fff;--ink:#1b1b1b;--faint:#d9d9d9;--soft:#5c5c5c;--bad:#b3261e;"
    "--c0:#0b62c4;--c1:#c2410c;--c2:#157a3c;--c3:#8b2fb0;--c4:#8a6d00;--c5:#0f7c86;"
)
_DARK = (
    "--paper:#16181c;--ink:#e8e8e8;--faint:#3a3d44;--soft:#a7abb3;--bad:#ff8a80;"
    "--c0:#6cb0ff;--c1:#ff9b66;--c2:#6fd08f;--c3:#d79bf0;--c4:#e3c75a;--c5:#6ad2dc;"
)
# Pictures of mechanisms: `drawing` needs these rules wherever it stands, below an element with these colours.
_SHAPES = (
    (".origin", "fill:none;stroke:var(--soft)"),
    (".bar", "fill:none;stroke-linecap:round;stroke-opacity:.55"),
    (".body", "fill-opacity:.35;stroke-width:1.5"),
    *((f".c{i}", f"stroke:var(--c{i})") for i in range(6)),
    *((f".body.c{i}", f"fill:var(--c{i})") for i in range(6)),
)


def drawing_style(scope: str = "") -> str:
    """Return the rules of drawings, of those alone that stand below elements that a selector names; of a file without.

    With a scope the colours are those for light paper, which the picture brings along.
    """
    below = f"{scope} svg " if scope else ""
    rules = "".join(f"{below}{name}{{{rule}}}" for name, rule in _SHAPES)
    letters = f"{below}text{{font:12px system-ui,sans-serif;fill:var(--ink)}}"
    if scope:
        return f"{scope} svg{{{_LIGHT}background:var(--paper);max-width:24rem}}{letters}{rules}"
    return f":root{{{_LIGHT}}}@media (prefers-color-scheme:dark){{:root{{{_DARK}}}}}{letters}{rules}"


_STYLE = (
    f":root{{color-scheme:light dark;{_LIGHT}}}"
    f"@media (prefers-color-scheme:dark){{:root{{{_DARK}}}}}"
    "body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,sans-serif}"
    "main{max-width:60rem;margin:0 auto;padding:1.5rem}"
    "h1{margin:0 0 .2rem}h2{margin:2rem 0 .6rem;border-bottom:1px solid var(--faint);break-after:avoid}"
    # What is wider than a narrow screen is scrolled by itself; only text, in the last column, is broken.
    ".wide,figure{overflow-x:auto;overflow-y:hidden}"
    "table{border-collapse:collapse;margin:.6rem 0;font-size:.92em;font-variant-numeric:tabular-nums}"
    "th,td{padding:.15rem .7rem .15rem 0;text-align:left;vertical-align:top;border-bottom:1px solid var(--faint);"
    "white-space:nowrap}td:last-child{white-space:normal;min-width:6rem}"
    "tr,figure{break-inside:avoid}pre{white-space:pre-wrap;overflow-wrap:anywhere;font-size:.85em}"
    "nav ol{columns:3 12rem;margin:1rem 0;padding-left:1.6rem;font-size:.92em}a{color:var(--c0)}"
    "figure{margin:1rem 0}figcaption{color:var(--soft)}"
    "svg{display:block;width:100%;height:auto;min-width:28rem;max-width:46rem}"
    # Layout of formulas is lost where `math` is a plain block.
    "math{display:block math;margin:.6rem 0;text-align:left}"
    # Long ones are rows of pieces, which are broken as text is.
    ".formula{margin:.6rem 0;line-height:2.1}.formula div{padding-left:3rem;text-indent:-3rem}"
    ".formula div+div{margin-left:1.5rem}"
    ".formula math{display:inline math;margin:0;text-indent:0}.bad{color:var(--bad);font-weight:600}"
    # Paper is white, whatever the screen is, and does not scroll.
    f"@media print{{:root{{{_LIGHT}}}body{{font-size:10pt}}main{{padding:0}}.wide,figure{{overflow:visible}}"
    "table{font-size:8pt}math{font-size:9pt}}"
    "svg text{font:12px system-ui,sans-serif;fill:var(--ink)}"
    ".frame{fill:none;stroke:var(--soft)}.grid{fill:none;stroke:var(--faint)}"
    ".curve{fill:none;stroke-width:1.6;stroke-linejoin:round}"
    + "".join(f"{name}{{{rule}}}" for name, rule in _SHAPES)
)
