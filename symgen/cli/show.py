"""`symgen show`: a model and its equations, as text or as a LaTeX document."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import click
import sympy

from symgen import runtime
from symgen.cli import latex
from symgen.cli.arguments import as_dict, find_model, model_argument
from symgen.cli.terminal import say
from symgen.equations import (
    Choices,
    Element,
    accelerations_if_diagonal,
    equations_by_elements,
    rates_of_coordinates,
    shortened,
    symbolic,
)
from symgen.errors import ModelError
from symgen.link import module_for
from symgen.model import algebra
from symgen.model.from_sympy import taken_over, to_sympy
from symgen.model.functions import dot
from symgen.model.library import load
from symgen.model.printing import to_text
from symgen.runtime.names import acceleration_labels, motion_records, rate_labels

if TYPE_CHECKING:
    from collections.abc import Iterator

    from symgen.model.description import Body, Coordinate, Description, Friction, Joint, Rate
    from symgen.runtime.system import System


_MOST_OPERATIONS = 400  # longer equations are not read by people
_MOST_CHOICES = 8
_LONGEST_TEXT = 2000
_TOO_LONG = "… (too long to be read)"


class Notation(Protocol):
    """How expressions and names are written; an expression is given by calling it.

    Attributes
    ----------
    spin : str
        The kinetic energy of turning.
    """

    spin: str

    def __call__(self, expression: algebra.Expr | sympy.Expr) -> str: ...

    def name(self, name: str) -> str: ...

    def element(self, element: Element) -> str: ...


class Text:
    """As model files have it."""

    spin = "1/2*omega.I.omega"

    def __call__(self, expression: algebra.Expr | sympy.Expr) -> str:
        try:
            return to_text(taken_over(expression), _LONGEST_TEXT)
        except ModelError:
            return _TOO_LONG

    def name(self, name: str) -> str:
        return name

    def element(self, element: Element) -> str:
        text = f"{element.matrix}[{', '.join(element.names)}]"
        return f"{text}*{element.times}" if element.times else text


class Latex:
    """As LaTeX, with mathematics between dollar signs."""

    spin = r"$\tfrac{1}{2} \omega^{T} I\, \omega$"

    def __call__(self, expression: algebra.Expr | sympy.Expr) -> str:
        written = to_sympy(taken_over(expression))
        return _TOO_LONG if written.count_ops() > _MOST_OPERATIONS else latex.to_latex(written)

    def name(self, name: str) -> str:
        return f"${latex.name(name)}$"

    def element(self, element: Element) -> str:
        times = rf"\, {latex.name(element.times)}" if element.times else ""
        return f"${latex.entry(element.matrix, *element.names)}{times}$"


@dataclass(frozen=True)
class Section:
    """Rows under a title: equations (two sides), or a table.

    Attributes
    ----------
    title : str
    rows : list of tuple of str
        Cells; of equations left and right side.
    equations, aligned : bool
        Whether rows are equations, and whether text has them in columns.
    """

    title: str
    rows: list[tuple[str, ...]]
    equations: bool = False
    aligned: bool = True

    def lines(self) -> list[str]:
        """Return the section as lines of text."""
        rows = [(left, "=", right) for left, right in self.rows] if self.equations else self.rows
        if not self.aligned:
            return [f"  {' '.join(row)}" for row in rows]
        widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
        return ["  " + "  ".join(cell.ljust(n) for cell, n in zip(row, widths)).rstrip() for row in rows]

    def latex(self) -> str:
        """Return the body of the section as LaTeX."""
        if self.equations:
            return "\n".join(latex.formula(*map(latex.escaped, row)) for row in self.rows)
        return latex.table(self.rows)


def section(title: str, rows: list[tuple[str, ...]], *, equations: bool = False) -> list[Section]:
    """Return a section; none where it has no rows."""
    return [Section(title, rows, equations)] if rows else []


def mechanism(d: Description, show: Notation) -> list[Section]:
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


def _places(vectors: tuple[tuple[algebra.Expr, ...], ...], show: Notation) -> str:
    return ", ".join(f"({', '.join(map(show, vector))})" for vector in vectors)


def _joint(j: Joint, show: Notation) -> str:
    parts = (
        [f"coordinate{'s' * (len(j.coordinates) > 1)} {', '.join(j.coordinates)}"] if j.coordinates else []
    )
    if any(x != 0 for x in j.xyz):
        parts.append(f"at ({', '.join(map(show, j.xyz))})")
    if any(x != 0 for x in j.rpy):
        parts.append(f"rpy ({', '.join(map(show, j.rpy))})")
    parts += [f"axis ({', '.join(f'{x:.10g}' for x in axis)})" for axis in (j.axis, j.axis2) if axis]
    parts += [f"about {', '.join(j.sequence)}"] if j.sequence else []
    for key in ("stiffness", "rest", "damping", "armature", "limits"):
        if getattr(j, key):
            parts.append(f"{key} {', '.join(map(show, getattr(j, key)))}")
    return ", ".join(parts)


def _arguments(arguments: tuple[tuple[str, Any], ...], show: Notation) -> str:
    def text(value: Any) -> str:
        if isinstance(value, tuple):
            return f"({', '.join(map(text, value))})"
        if isinstance(value, float):
            return f"{value:.10g}"
        return value if isinstance(value, str) else show(value)

    return ", ".join(f"{key} {text(value)}" for key, value in arguments)


@click.command("show")
@model_argument
@click.option("--latex", "as_latex", is_flag=True, help="Print a LaTeX document of them.")
def command(model: str, options: tuple[tuple[str, str], ...], as_latex: bool) -> None:
    """Show MODEL as it was written, and its equations of motion."""
    path, build_options = find_model(model), as_dict(options, "--option")
    description = load(path, build_options).describe()
    system = runtime.load(module_for(path, build_options).text)
    show: Notation = Latex() if as_latex else Text()
    sections = _tables(description) + _bodies(description, show) + mechanism(description, show)
    sections += _terms(description, show)
    sections += _equations(system, show)
    if as_latex:
        found = ((part.title, part.latex()) for part in sections)
        say(latex.document(description.name, description.description, found))
        return
    lines = [f"{description.name}: {description.description}".rstrip(": ")]
    for part in sections:
        lines += ["", part.title] * (part.title != "") + part.lines()
    say("\n".join(lines))


def _tables(d: Description) -> list[Section]:
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


def _bodies(d: Description, show: Notation) -> list[Section]:
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


def _orientation(body: Body, show: Notation) -> str:
    if body.angle is not None:
        return f", angle {show(body.angle)}"
    turns = [f"about {axis} by {show(angle)}" for axis, angle in body.rotation]
    return f", turned {', then '.join(turns)}" if turns else ""


def _terms(d: Description, show: Notation) -> list[Section]:
    def point(name: str, parts: tuple[algebra.Expr, ...]) -> str:
        return f"{name} ({', '.join(map(show, parts))})"

    children, states = {j.child for j in d.joints}, {s.name for s in d.states}
    kinetic = [
        (b.name, _jointed_kinetic(b, show) if b.name in children else _kinetic_energy(b, show))
        for b in d.bodies
        if b.mass is not None or b.inertia
    ]
    kinetic += [("other", show(d.kinetic))] if d.kinetic is not None else []
    gravity = d.gravity or ()
    potential = [
        (b.name, _weight(b, gravity, b.name in children, show))
        for b in d.bodies
        if b.mass is not None and any(gravity)
    ]
    potential += [("other", show(d.potential))] if d.potential is not None else []
    dissipation = [("R", show(d.dissipation))] if d.dissipation is not None else []
    loads = [
        (load.name, point("force", load.force) + point(" at", load.point))
        if load.force
        else (load.name, point("torque", load.torque) + f" on {load.body}")
        for load in d.loads
    ]
    forces = [(show.name(name), show(e)) for name, e in d.forces if name not in states]
    return [
        *section("definitions", [(show.name(name), show(e)) for name, e in d.definitions], equations=True),
        *section("kinetic energy", kinetic, equations=True),
        *section("potential energy", potential, equations=True),
        *section("dissipation", dissipation, equations=True),
        *section("forces on coordinates", forces, equations=True),
        *section(
            "states", [(show.name(f"dot({s.name})"), show(s.derivative)) for s in d.states], equations=True
        ),
        *section("loads", loads),
        *section(
            "stops", [(s.name, "0 <=", show(s.gap), f"restitution {show(s.restitution)}") for s in d.stops]
        ),
        *section("friction", [(f.name, _level(f, show), "against", _sliding(f, show)) for f in d.frictions]),
        *section("bristles", [(b.made[1], "against", show(b.speed)) for b in d.bristles]),
        *section("constraints", [(c.name, "0 =", show(c.expression)) for c in d.constraints]),
        *section(
            "velocity constraints", [(c.name, "0 =", show(c.expression)) for c in d.velocity_constraints]
        ),
        *section("outputs", [(show.name(name), show(e)) for name, e in d.outputs], equations=True),
        *section("events", [(e.name, f"when {show(e.when)} = 0, {e.direction}", e.action) for e in d.events]),
    ]


def _level(f: Friction, show: Notation) -> str:
    return f"{show(f.level)} times the force of {', '.join(f.normal)}" if f.normal else show(f.level)


def _sliding(f: Friction, show: Notation) -> str:
    speeds = show(f.speed) if f.across is None else f"({show(f.speed)}, {show(f.across)})"
    return speeds + ("" if f.smooth is None else f", less below {show(f.smooth)}")


def _kinetic_energy(body: Body, show: Notation) -> str:
    energy = algebra.ZERO
    if body.mass is not None:
        energy += body.mass * sum(dot(x) ** 2 for x in body.com if not x.is_number) / 2
    if body.planar and body.inertia and body.angle is not None:
        energy += body.inertia[0] * dot(body.angle) ** 2 / 2
    return show(energy) + (f" + {show.spin}" if body.inertia and not body.planar else "")


def _jointed_kinetic(body: Body, show: Notation) -> str:
    """In short where joints place the body: written out, it is too long to be read."""
    moving = [show(body.mass * algebra.Symbol("v.v") / 2)] if body.mass is not None else []
    turning = [show.spin] if body.inertia else []
    return " + ".join(moving + turning)


def _weight(body: Body, gravity: tuple[algebra.Expr, ...], is_child: bool, show: Notation) -> str:
    if is_child:
        return f"{show(-body.mass * algebra.Symbol('gravity.r'))}, gravity ({', '.join(map(show, gravity))})"
    return show(-body.mass * sum(g * x for g, x in zip(gravity, body.com)))


def _equations(system: System, show: Notation) -> list[Section]:
    head = "equations of motion: M a = f" + (" + G^T lambda, G a = gamma" if system.m else "")
    operations = sum(
        system.operations.get(name, 0) for name in ("mass_matrix", "forces", "constraint_jacobian")
    )
    if operations > _MOST_OPERATIONS:
        says = f"{operations} operations: too long to be read; `symgen derive` writes them to a file"
        return [Section(head, [(says,)])]
    choices = Choices(system)
    rows = [(show.element(element), show(value)) for element, value in _elements(system, choices)]
    first_order = _first_order(system, show, choices)
    chosen = [(show.name(str(name)), show(value)) for name, value in choices.named]
    if len(chosen) > _MOST_CHOICES:
        names = f"{chosen[0][0]} to {chosen[-1][0]}"
        says = f"{names}, of curves and switches: too long to be read; `symgen derive` writes them to a file"
        return [*section(head, rows, equations=True), Section("with", [(says,)]), *first_order]
    return [*section(head, rows, equations=True), *section("with", chosen, equations=True), *first_order]


def _elements(system: System, choices: Choices) -> Iterator[tuple[Element, sympy.Expr]]:
    """Yield what is not zero: of the symmetric M on and above the diagonal, f, G and gamma."""

    def written(function: str) -> list[tuple[int, sympy.Expr]]:
        return sorted(shortened(symbolic(system, function, choices)).items())

    names = [record["name"] for record in system.rates]
    for index, value in written("mass_matrix"):
        i, j = divmod(index, system.nv)
        if j >= i:
            yield Element("M", (names[i], names[j])), value
    for i, value in written("forces"):
        yield Element("f", (names[i],)), value
    if system.m:
        constraints = [record["name"] for record in system.constraints]
        for index, value in written("constraint_jacobian"):
            i, j = divmod(index, system.nv)
            yield Element("G", (constraints[i], names[j])), value
        for i, value in written("gamma"):
            yield Element("gamma", (constraints[i],)), value


def _first_order(system: System, show: Notation, choices: Choices) -> list[Section]:
    """The equations of x' that are not of the form dot(q) = dot(q), by the names of their elements."""
    shown, moving = motion_records(system.coordinates, system.integrals), rates_of_coordinates(system)
    states = [*(c["name"] for _, c in shown), *rate_labels(system.coordinates, system.rates)]
    rates = [(f"dot({c['name']})", moving[i]) for i, c in shown]
    rows = [(show.name(left), show(right)) for left, right in rates if left != str(right)]
    solved, elements = accelerations_if_diagonal(system, choices), []
    if solved is None:
        elements = equations_by_elements(system)
    else:
        names = acceleration_labels(system.coordinates, system.rates)
        values = shortened(dict(enumerate(solved))).values()
        rows += [(show.name(name), show(value)) for name, value in zip(names, values)]
    sums = [tuple(" + ".join(map(show.element, side)) or "0" for side in sides) for sides in elements]
    title = f"first-order form, of x = ({', '.join(map(show.name, states))})"
    found = section(title, rows, equations=True)
    if sums:
        found.append(Section("" if found else title, sums, equations=True, aligned=False))
    return found
