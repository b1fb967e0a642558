"""The equations of motion and the state-space form of a report, in MathML."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from symgen.cli.mathml import dotted, entry, equation, equation_of, name

if TYPE_CHECKING:
    import sympy

    from symgen.runtime.report.page import Equations
    from symgen.runtime.system import System

_MOST_OPERATIONS = 400  # longer equations are not read by people
_MOST_STATES = 12
_ACCELERATION, _LAMBDA = "<mi>a</mi>", "<mi>λ</mi>"


def report_equations(system: System) -> Equations:
    """Return the equations of a model as a report shows them; of long ones their form alone, with a note."""
    from symgen.runtime.report.html import Markup
    from symgen.runtime.report.page import Equations

    functions = ("mass_matrix", "forces", "constraint_jacobian", "gamma")
    operations = sum(system.operations.get(function, 0) for function in functions)
    if operations > _MOST_OPERATIONS:
        note = f"{operations} operations: too long to be read; `symgen derive` writes them to a file."
        return Equations([*map(Markup, _form(system))], [*map(Markup, _general(system))], note)
    from symgen.cli.equations import symbolic

    found = {f: symbolic(system, f) for f in functions if system.has(f)}
    motion = [*_form(system), *_entries(system, found)]
    states = _written_out(system, found) or list(_general(system))
    return Equations([*map(Markup, motion)], [*map(Markup, states)])


def _form(system: System) -> Iterator[str]:
    pull = f"<mo>+</mo><msup><mi>G</mi><mi>T</mi></msup>{_LAMBDA}" if system.m else ""
    yield equation(f"<mi>M</mi>{_ACCELERATION}", f"<mi>f</mi>{pull}")
    if system.m:
        yield equation(f"<mi>G</mi>{_ACCELERATION}", "<mi>γ</mi>")


def _entries(system: System, found: dict[str, dict[int, sympy.Expr]]) -> Iterator[str]:
    """Yield the elements that are not zero, of the symmetric M those on and above its diagonal."""
    rates = [record["name"] for record in system.rates]
    constraints = [record["name"] for record in system.constraints]
    for index, value in sorted(found["mass_matrix"].items()):
        i, j = divmod(index, system.nv)
        if j >= i:
            yield equation_of(entry("M", rates[i], rates[j]), value)
    for i, value in sorted(found["forces"].items()):
        yield equation_of(entry("f", rates[i]), value)
    for index, value in sorted(found.get("constraint_jacobian", {}).items()):
        i, j = divmod(index, system.nv)
        yield equation_of(entry("G", constraints[i], rates[j]), value)
    for i, value in sorted(found.get("gamma", {}).items()):
        yield equation_of(entry("γ", constraints[i]), value)


def _general(system: System) -> Iterator[str]:
    """Yield x' = F(t, x) of x = (q, v), in matrices."""
    plain = system.nq == system.nv
    yield equation("<mi>x</mi>", "<mrow><mo>(</mo><mi>q</mi><mo>,</mo><mi>v</mi><mo>)</mo></mrow>")
    turned = "<mi>v</mi>" if plain else "<mi>S</mi><mo>(</mo><mi>q</mi><mo>)</mo><mi>v</mi>"
    yield equation(dotted("<mi>q</mi>"), f"<mrow>{turned}</mrow>")
    if not system.m:
        inverse = "<msup><mi>M</mi><mrow><mo>−</mo><mn>1</mn></mrow></msup>"
        yield equation(dotted("<mi>v</mi>"), f"<mrow>{inverse}<mi>f</mi></mrow>")
        return
    transposed = "<mrow><mo>−</mo><msup><mi>G</mi><mi>T</mi></msup></mrow>"
    unknown = _column(dotted("<mi>v</mi>"), "<mi>λ</mi>")
    known = _column("<mi>f</mi>", "<mi>γ</mi>")
    matrix = _rows(("<mi>M</mi>", transposed), ("<mi>G</mi>", "<mn>0</mn>"))
    yield equation(f"<mrow>{matrix}{unknown}</mrow>", known)


def _written_out(system: System, found: dict[str, dict[int, sympy.Expr]]) -> list[str]:
    """Return x' state by state where M is diagonal and nothing is constrained; otherwise nothing."""
    diagonal = all(index % (system.nv + 1) == 0 for index in found["mass_matrix"])
    if system.m or not diagonal or system.nq != system.nv or system.nq > _MOST_STATES:
        return []
    rates = [record["name"] for record in system.rates]
    coordinates = [record["name"] for record in system.coordinates]
    v = [f"dot({rate})" if rate in coordinates else rate for rate in rates]
    lines = [equation(dotted(name(q)), name(rate)) for q, rate in zip(coordinates, v) if rate != f"dot({q})"]
    for i, rate in enumerate(v):
        force, mass = found["forces"].get(i, 0), found["mass_matrix"][i * (system.nv + 1)]
        left = dotted(name(rate)) if rate == rates[i] else dotted(name(rates[i]), "¨")
        lines.append(equation_of(left, force / mass) if force != 0 else equation(left, "<mn>0</mn>"))
    states = "<mo>,</mo>".join(name(x) for x in (*coordinates, *v))
    return [equation("<mi>x</mi>", f"<mrow><mo>(</mo>{states}<mo>)</mo></mrow>"), *lines]


def _rows(*rows: tuple[str, ...]) -> str:
    inside = "".join(f"<mtr>{''.join(f'<mtd>{x}</mtd>' for x in row)}</mtr>" for row in rows)
    return f"<mrow><mo>[</mo><mtable>{inside}</mtable><mo>]</mo></mrow>"


def _column(*entries: str) -> str:
    return _rows(*((x,) for x in entries))
