"""`symgen show`: a model and its equations, as text or LaTeX.

Model expressions as LaTeX.

What `symgen show` prints of joints, points, axes, ready-made constraints and drawings.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import click
import sympy
from sympy.printing.latex import LatexPrinter, translate

from symgen import runtime
from symgen.cli.arguments import as_dict, find_model, model_argument
from symgen.cli.terminal import say
from symgen.equations import (
    Element,
    accelerations_if_diagonal,
    equations_by_elements,
    rates_of_coordinates,
    symbolic,
)
from symgen.errors import ModelError
from symgen.link import module_for
from symgen.model.from_sympy import as_piecewise
from symgen.model.functions import dot
from symgen.model.library import load
from symgen.model.printing import to_text
from symgen.runtime.names import acceleration_labels, motion_records, rate_labels

if TYPE_CHECKING:
    from collections.abc import Callable

    from symgen.model.description import Body, Coordinate, Description, Friction, Joint, Rate
    from symgen.runtime.system import System


if TYPE_CHECKING:
    Show = Callable[[sympy.Expr], str]


def section(title: str, rows: list[tuple[str, ...]]) -> list[str]:
    """A titled table; nothing where it has no rows."""
    if not rows:
        return []
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows]
    return [title, *lines, ""]


def mechanism(d: Description, show: Show) -> list[str]:
    """The sections of joints, points, axes, ready-made constraints and drawings."""

    def fixed(elements: Any, vector: str, at: str) -> list[tuple[str, ...]]:
        return [
            (x.name, f"in {x.body}", f"{at} ({', '.join(map(show, getattr(x, vector)))})") for x in elements
        ]

    joints = [(j.name, j.type, f"{j.parent} -> {j.child}", _joint(j, show)) for j in d.joints]
    loops = [(x.name, x.kind, _arguments(x.arguments, show)) for x in d.loops]
    drawn = [(x.name, x.kind, _places(x.vectors, show)) for x in d.drawings]
    return [
        *section("joints", joints),
        *section("points", fixed(d.points, "at", "at")),
        *section("axes", fixed(d.axes, "direction", "along")),
        *section("ready-made constraints (their equations are among the constraints)", loops),
        *section("drawn", drawn),
    ]


def _places(vectors: tuple[tuple[sympy.Expr, ...], ...], show: Show) -> str:
    return ", ".join(f"({', '.join(map(show, vector))})" for vector in vectors)


def _joint(j: Joint, show: Show) -> str:
    parts = (
        [f"coordinate{'s' * (len(j.coordinates) > 1)} {', '.join(j.coordinates)}"] if j.coordinates else []
    )
    if any(x != 0 for x in j.xyz):
        parts.append(f"at ({', '.join(map(show, j.xyz))})")
    if any(x != 0 for x in j.rpy):
        parts.append(f"rpy ({', '.join(map(show, j.rpy))})")
    parts += [f"axis ({', '.join(f'{x:.10g}' for x in axis)})" for axis in (j.axis, j.axis2) if axis]
    for key in ("stiffness", "rest", "damping", "armature", "limits"):
        if getattr(j, key):
            parts.append(f"{key} {', '.join(map(show, getattr(j, key)))}")
    return ", ".join(parts)


def _arguments(arguments: tuple[tuple[str, Any], ...], show: Show) -> str:
    def text(value: Any) -> str:
        if isinstance(value, tuple):
            return f"({', '.join(map(text, value))})"
        if isinstance(value, float):
            return f"{value:.10g}"
        return value if isinstance(value, str) else show(value)

    return ", ".join(f"{key} {text(value)}" for key, value in arguments)


_MOST_OPERATIONS = 400  # longer equations are not read by people
_LONGEST_TEXT = 2000


@click.command("show")
@model_argument
@click.option("--latex", is_flag=True, help="Print the equations as LaTeX.")
def command(model: str, options: tuple[tuple[str, str], ...], latex: bool) -> None:
    """Show MODEL as it was written, and its equations of motion."""
    path, build_options = find_model(model), as_dict(options, "--option")
    description = load(path, build_options).describe()
    system = runtime.load(module_for(path, build_options).text)
    printer = _latex if latex else _text
    lines = [f"{description.name}: {description.description}".rstrip(": "), ""]
    lines += _tables(description) + _bodies(description, printer) + mechanism(description, printer)
    lines += _terms(description, printer)
    lines += _equations(system, printer)
    say("\n".join(lines))


def _text(expression: sympy.Expr) -> str:
    try:
        return to_text(expression, _LONGEST_TEXT)
    except ModelError:
        return "… (too long to be read)"


def _latex(expression: sympy.Expr) -> str:

    return to_latex(expression)


def _tables(d: Description) -> list[str]:
    def quantity(value: float, unit: str | None) -> str:
        return f"{value:.10g} {unit or ''}".strip()

    return [
        *section("coordinates", [(c.name, c.unit or "", _start(c)) for c in d.coordinates if not c.integral]),
        *section("rates", [(r.name, r.unit or "", _rate(r)) for r in d.rates if _is_named_rate(r)]),
        *section("states", [(r.name, r.unit or "", f"start {r.start:.10g}") for r in d.rates if r.state]),
        *section("parameters", [(p.name, quantity(p.value, p.unit), p.doc) for p in d.parameters]),
        *section("constants", [(c.name, quantity(c.value, c.unit)) for c in d.constants]),
        *section("inputs", [(u.name, quantity(u.default, u.unit)) for u in d.inputs]),
    ]


def _start(c: Coordinate) -> str:
    position = f"guess {c.guess:.10g}" if c.start is None else f"start {c.start:.10g}"
    if c.quaternion is not None:
        return position
    rate = f"rate guess {c.rate_guess:.10g}" if c.rate is None else f"rate {c.rate:.10g}"
    return f"{position}, {rate}"


def _is_named_rate(r: Rate) -> bool:
    return r.coordinate != r.name and not r.state


def _rate(r: Rate) -> str:
    return f"rate guess {r.guess:.10g}" if r.start is None else f"rate {r.start:.10g}"


def _bodies(d: Description, show: Callable[[sympy.Expr], str]) -> list[str]:
    rows = []
    children = {j.child for j in d.joints}
    for body in d.bodies:
        at = f"centre of mass ({', '.join(map(show, body.com))})" + " in its own frame" * (
            body.name in children
        )
        mass = f"mass {show(body.mass)}" if body.mass is not None else "no mass"
        inertia = f"inertia {', '.join(map(show, body.inertia))}" if body.inertia else ""
        rows.append((body.name, mass, inertia, f"{at}{_orientation(body, show)}"))
    return section("bodies", rows)


def _orientation(body: Body, show: Callable[[sympy.Expr], str]) -> str:
    if body.angle is not None:
        return f", angle {show(body.angle)}"
    turns = [f"about {axis} by {show(angle)}" for axis, angle in body.rotation]
    return f", turned {', then '.join(turns)}" if turns else ""


def _terms(d: Description, show: Callable[[sympy.Expr], str]) -> list[str]:
    def point(name: str, parts: tuple[sympy.Expr, ...]) -> str:
        return f"{name} ({', '.join(map(show, parts))})"

    children, states = {j.child for j in d.joints}, {s.name for s in d.states}
    kinetic = [
        (
            b.name,
            "=",
            _jointed_kinetic(b, show) if b.name in children else show(_kinetic(b, dot)) + _spinning(b),
        )
        for b in d.bodies
        if b.mass is not None or b.inertia
    ]
    kinetic += [("other", "=", show(d.kinetic))] if d.kinetic is not None else []
    gravity = d.gravity or ()
    potential = [
        (b.name, "=", _weight(b, gravity, b.name in children, show))
        for b in d.bodies
        if b.mass is not None and any(gravity)
    ]
    potential += [("other", "=", show(d.potential))] if d.potential is not None else []
    dissipation = [("R", "=", show(d.dissipation))] if d.dissipation is not None else []
    loads = [
        (load.name, point("force", load.force) + point(" at", load.point))
        if load.force
        else (load.name, point("torque", load.torque) + f" on {load.body}")
        for load in d.loads
    ]
    return [
        *section("definitions", [(name, "=", show(e)) for name, e in d.definitions]),
        *section("kinetic energy", kinetic),
        *section("potential energy", potential),
        *section("dissipation", dissipation),
        *section(
            "forces on coordinates", [(name, "=", show(e)) for name, e in d.forces if name not in states]
        ),
        *section("states", [(f"dot({s.name})", "=", show(s.derivative)) for s in d.states]),
        *section("loads", loads),
        *section(
            "stops", [(s.name, "0 <=", show(s.gap), f"restitution {show(s.restitution)}") for s in d.stops]
        ),
        *section("friction", [(f.name, _level(f, show), "against", _sliding(f, show)) for f in d.frictions]),
        *section("constraints", [(c.name, "0 =", show(c.expression)) for c in d.constraints]),
        *section(
            "velocity constraints", [(c.name, "0 =", show(c.expression)) for c in d.velocity_constraints]
        ),
        *section("outputs", [(name, "=", show(e)) for name, e in d.outputs]),
        *section("events", [(e.name, f"when {show(e.when)} = 0, {e.direction}", e.action) for e in d.events]),
    ]


def _level(f: Friction, show: Callable[[sympy.Expr], str]) -> str:
    return f"{show(f.level)} times the force of {', '.join(f.normal)}" if f.normal else show(f.level)


def _sliding(f: Friction, show: Callable[[sympy.Expr], str]) -> str:
    return show(f.speed) + ("" if f.smooth is None else f", less below {show(f.smooth)}")


def _kinetic(body: Body, dot) -> sympy.Expr:
    import sympy

    energy = sympy.Integer(0)
    if body.mass is not None:
        energy += body.mass * sum(dot(x) ** 2 for x in body.com if not x.is_number) / 2
    if body.planar and body.inertia and body.angle is not None:
        energy += body.inertia[0] * dot(body.angle) ** 2 / 2
    return energy


def _jointed_kinetic(body: Body, show: Callable[[sympy.Expr], str]) -> str:
    """In short where joints place the body: written out, it is too long to be read."""
    import sympy

    moving = [show(body.mass * sympy.Symbol("v.v") / 2)] if body.mass is not None else []
    turning = ["1/2*omega.I.omega"] if body.inertia else []
    return " + ".join(moving + turning)


def _weight(
    body: Body, gravity: tuple[sympy.Expr, ...], is_child: bool, show: Callable[[sympy.Expr], str]
) -> str:
    import sympy

    if is_child:
        return f"{show(-body.mass * sympy.Symbol('gravity.r'))}, gravity ({', '.join(map(show, gravity))})"
    return show(-body.mass * sum(g * x for g, x in zip(gravity, body.com)))


def _spinning(body: Body) -> str:
    return " + 1/2*omega.I.omega" if body.inertia and not body.planar else ""


def _equations(system: System, show: Callable[[sympy.Expr], str]) -> list[str]:
    names = [record["name"] for record in system.rates]
    head = "equations of motion: M a = f" + (" + G^T lambda, G a = gamma" if system.m else "")
    operations = sum(
        system.operations.get(name, 0) for name in ("mass_matrix", "forces", "constraint_jacobian")
    )
    if operations > _MOST_OPERATIONS:
        return [
            head,
            f"  {operations} operations: too long to be read; `symgen derive` writes them to a file",
        ]
    rows = []
    for index, value in sorted(symbolic(system, "mass_matrix").items()):
        i, j = divmod(index, system.nv)
        if j >= i:
            rows.append((f"M[{names[i]}, {names[j]}]", "=", show(value)))
    rows += [(f"f[{names[i]}]", "=", show(value)) for i, value in sorted(symbolic(system, "forces").items())]
    if system.m:
        constraints = [record["name"] for record in system.constraints]
        for index, value in sorted(symbolic(system, "constraint_jacobian").items()):
            i, j = divmod(index, system.nv)
            rows.append((f"G[{constraints[i]}, {names[j]}]", "=", show(value)))
        gamma = sorted(symbolic(system, "gamma").items())
        rows += [(f"gamma[{constraints[i]}]", "=", show(value)) for i, value in gamma]
    return [*section(head, rows), *_first_order(system, show)]


def _first_order(system: System, show: Callable[[sympy.Expr], str]) -> list[str]:
    """The equations of x' that are not of the form dot(q) = dot(q), by the names of their elements."""
    shown, moving = motion_records(system.coordinates, system.integrals), rates_of_coordinates(system)
    states = [*(c["name"] for _, c in shown), *rate_labels(system.coordinates, system.rates)]
    rates = [(f"dot({c['name']})", show(moving[i])) for i, c in shown]
    rows = [(left, "=", right) for left, right in rates if left != right.strip("$")]
    solved, elements = accelerations_if_diagonal(system), []
    if solved is None:
        elements = equations_by_elements(system)
    else:
        names = acceleration_labels(system.coordinates, system.rates)
        rows += [(name, "=", show(value)) for name, value in zip(names, solved)]
    sums = [[" + ".join(map(_term, side)) or "0" for side in sides] for sides in elements]
    return [
        f"first-order form, of x = ({', '.join(states)})",
        *section("", rows)[1:-1],
        *(f"  {left} = {right}" for left, right in sums),
    ]


def _term(element: Element) -> str:
    names = ", ".join(element.names)
    return f"{element.matrix}[{names}]" + f"*{element.times}" * bool(element.times)


_RATE = re.compile(r"dot\((\w+)\)\Z")


class _Printer(LatexPrinter):
    """Prints rates with a dot above, also where they are symbols named `dot(x)`."""

    def _print_Symbol(self, symbol: sympy.Symbol, **options) -> str:
        rate = _RATE.match(symbol.name)
        if rate:
            return rf"\dot{{{self._print(sympy.Symbol(rate.group(1)))}}}"
        name, underscore, index = symbol.name.partition("_")
        if underscore:
            return rf"{translate(name)}_{{\mathrm{{{index}}}}}".replace("_{\\mathrm{}}", "")
        return super()._print_Symbol(symbol, **options)

    def _print_dot(self, rate: sympy.Function, exp: str | None = None) -> str:
        inside = rate.args[0]
        if isinstance(inside, sympy.Symbol):
            return _raised(rf"\dot{{{self._print(inside)}}}", exp)
        text = rf"\frac{{d}}{{dt}}\left({self._print(inside)}\right)"
        return _raised(rf"\left({text}\right)" if exp else text, exp)

    def _print_where(self, choice: sympy.Function, exp: str | None = None) -> str:
        text = self._print(as_piecewise(choice))
        return _raised(rf"\left({text}\right)" if exp else text, exp)

    def _print_heaviside(self, function: sympy.Function, exp: str | None = None) -> str:
        return self._print_Heaviside(sympy.Heaviside(function.args[0], evaluate=False), exp)

    def _print_minimum(self, function: sympy.Function, exp: str | None = None) -> str:
        return _raised(rf"\min\left({', '.join(map(self._print, function.args))}\right)", exp)

    def _print_maximum(self, function: sympy.Function, exp: str | None = None) -> str:
        return _raised(rf"\max\left({', '.join(map(self._print, function.args))}\right)", exp)


def _raised(text: str, exp: str | None) -> str:
    return f"{text}^{{{exp}}}" if exp else text


def to_latex(expression: sympy.Expr) -> str:
    """Return an expression as LaTeX, between dollar signs."""
    return f"${_Printer({'mul_symbol': None}).doprint(expression)}$"
