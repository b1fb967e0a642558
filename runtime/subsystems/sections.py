"""A generated function by kind of subsystem: what all share, and the section of each kind."""

from __future__ import annotations

from dataclasses import dataclass, field

from symgen.runtime.graph.form import HELD, OUT, Form, Loop, Name, Statement, Write


@dataclass(frozen=True)
class Sections:
    """A function that works on each kind of subsystem by itself.

    Attributes
    ----------
    form : Form
    head : list of statements
        What all sections share: parameters, values that follow from them, and the starts of totals.
    sections : list of list of statements
        Those of each kind; those of a loop's body without the loop.
    totals : dict of int to Write
        Numbers that all make together, by place in `out`.
    """

    form: Form
    head: list[Name]
    sections: list[list[Statement]]
    totals: dict[int, Write] = field(default_factory=dict)


def sectioned(form: Form) -> Sections | None:
    """Return the sections of a function; None where it has none, because it looks at all subsystems."""
    starts, body = form.sections, form.body
    if not starts:
        return None
    end, totals = len(body), {}
    while end > starts[-1] and is_total(form, body[end - 1]):
        end -= 1
        totals[body[end].place.first] = body[end]
    sections = [_inside(body[i:j]) for i, j in zip(starts, [*starts[1:], end], strict=True)]
    return Sections(form, body[: starts[0]], sections, totals)


def is_total(form: Form, statement: Statement) -> bool:
    """Whether a statement writes what subsystems have made together: a name that had other values before."""
    is_output = type(statement) is Write and statement.array == OUT
    return is_output and form.nodes.op[statement.node] == "var" and form.nodes.mask[statement.node] == HELD


def total_name(form: Form, write: Write) -> str:
    """Return the name of the number that a total is."""
    return form.nodes.args[write.node][1][0]


def _inside(statements: list[Statement]) -> list[Statement]:
    if statements and type(statements[0]) is Loop:
        return [*statements[0].body, *statements[1:]]
    return statements
