"""From what the user said to the finished description: joints' springs, stops and defaults, ready-made constraints."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from . import algebra, elements
from .algebra import postorder
from .closures import write_closures
from .contact_geometry import write_pairs
from .contact_laws import with_contact_laws, with_normals
from .description import Axis, Body, Constraint, Description, Drawing, Event, Friction, Joint, Reset, Shape
from .expression_tree import names_in
from .functions import Tabulated, dot, minimum
from .gravity import write_gravity
from .joint_tree import parents_first, with_axes
from .joint_types import TYPES
from .parts import DRAWN
from .printing import shortened
from .ready_made import HALF, Writer, loss_of
from .rolling import drawn, write_rolling
from .rotors import write_rotor
from .sensors import resolve
from .solids import picture, together
from .sources import Sources
from .starts import check_closed
from .surfaces import Definitions
from .unevaluated import difference, negated, product, squared, total
from .windings import windings_of_springs


def expand(d: Description, sources: Sources, kinds: Mapping[str, str]) -> Description:
    """Write out what a checked description says in short.

    Parameters
    ----------
    d : Description
    sources : Sources
    kinds : mapping of str to str
        What each declared name is; the names that are made here must not be among them.
    """
    children = {j.child for j in d.joints}
    bodies = {
        b.name: _with_shape(_with_com(b) if b.name in children else b, b.name in children) for b in d.bodies
    }
    joints = tuple(with_axes(j, bodies[j.child]) for j in parents_first(d.joints))
    d, closed = _with_elements(replace(d, bodies=tuple(bodies.values()), joints=joints), sources, kinds)
    d = replace(d, **_energies(d, joints))
    constraints, axes, parts = _constraints(d, sources, kinds)
    rate_of = {r.coordinate: r.name for r in d.rates if r.coordinate is not None}
    losses = [loss for loop in d.loops if (loss := loss_of(loop)) is not None]
    _check_losses(losses, d, sources)
    d = with_contact_laws(replace(d, frictions=(*d.frictions, *losses)), sources)
    check_closed(d, sources)
    parts = closed | parts
    d = with_normals(replace(d, constraints=constraints), parts, sources)
    rubbing = {f.name: f.rows for f in d.frictions}
    d = replace(d, sensors=resolve(d.sensors, d, parts | rubbing, sources)) if d.sensors else d
    return replace(
        d,
        axes=(*d.axes, *axes),
        forces=(
            *((rate_of.get(name, name), value) for name, value in d.forces),
            *((s.name, s.derivative) for s in d.states),
        ),
        events=(
            *(_with_rates(e, d, rate_of) for e in d.events),
            *_limits(d, sources),
            *_ends_of_tables(d, sources),
        ),
    )


def _ends_of_tables(d: Description, sources: Sources) -> Iterator[Event]:
    """Where arguments leave tables that refuse that, a run ends."""
    refusing = {table.name: table for table in d.tables if table.outside == "refuse"}
    if not refusing:
        return
    taken = {e.name for e in d.events} | {s.name for s in d.stops} | {f.name for f in d.frictions}
    watched: set[tuple[str, int, algebra.Expr]] = set()
    for e in postorder(_acting(d)):
        if not isinstance(e, Tabulated) or e.func.table not in refusing:
            continue
        name = e.func.table
        for k, (argument, knots) in enumerate(zip(e.args, refusing[name].axes, strict=True)):
            if (name, k, argument) in watched:
                continue
            watched.add((name, k, argument))
            event = f"{name}_outside"
            while event in taken:
                event += "_"
            taken.add(event)
            inside = (
                difference(argument, algebra.Float(knots[0])),
                difference(algebra.Float(knots[-1]), argument),
            )
            says = f"{shortened(argument)} leaves the table {name}"
            yield Event(event, minimum(*inside, evaluate=False), "falling", "terminate", says=says)


def _acting(d: Description) -> list[algebra.Expr]:
    """The expressions that the motion depends on."""
    found = [x for x in (d.kinetic, d.potential, d.dissipation) if x is not None]
    found += [x for _, x in d.forces] + [s.derivative for s in d.states]
    found += [x for load in d.loads for x in (*load.force, *load.torque)]
    found += [c.expression for c in (*d.constraints, *d.velocity_constraints)]
    found += [x for body in d.bodies for x in (*body.com, *([] if body.angle is None else [body.angle]))]
    definitions, known, waiting = dict(d.definitions), set(), list(found)
    while waiting:
        for name in names_in(waiting.pop()) & definitions.keys() - known:
            known.add(name)
            found.append(definitions[name])
            waiting.append(definitions[name])
    return found


def _with_com(body: Body) -> Body:
    return body if body.com else replace(body, com=(algebra.ZERO,) * (2 if body.planar else 3))


def _with_shape(body: Body, is_child: bool) -> Body:
    """A body with the picture of its solids; they lie about its centre of mass, or about the origin of its frame."""
    if not body.solids:
        return body
    first, made = body.solids[0], together(body.solids)
    unmoved = not (first.offset or first.axis or first.rpy or first.cut or first.mesh)
    if len(body.solids) == 1 and unmoved and first.kind in DRAWN:
        return replace(body, shape=Shape(first.kind, first.sizes))
    origin: tuple[algebra.Expr, ...] = (algebra.ZERO,) * 3
    if made is not None:
        origin = tuple(negated(x) for x in made.centre)
    elif is_child and any(solid.offset for solid in body.solids):
        origin = tuple(negated(x) for x in (*body.com, algebra.ZERO)[:3])
    return replace(body, shape=picture(body.solids, origin))


def _with_elements(
    d: Description, sources: Sources, kinds: Mapping[str, str]
) -> tuple[Description, dict[str, tuple[str, ...]]]:
    """The description with its force elements, rolling and closures written out, and the forces of each closure."""
    writer = elements.Writer(d, set(kinds))
    for spring in d.springs:
        writer.spring(spring)
    for bushing in d.bushings:
        writer.bushing(bushing)
    writer.terms["potential"] += write_gravity(writer)
    for attractor in d.attractors:
        writer.drawings.append(Drawing(attractor.name, "pin", (attractor.at,)))
    surfaces = Definitions()
    rolling = [(r, c) for r in d.rolling for c in write_rolling(writer, r, sources, surfaces, d.tables)]
    writer.terms["kinetic"] += [write_rotor(writer, r) for r in d.rotors]
    closed = write_closures(writer, d, sources)
    touching = write_pairs(writer, d, sources)
    taken = {c.name for c in (*d.constraints, *d.velocity_constraints, *closed.constraints)}
    for r, c in rolling:
        if c.name in taken:
            message = f"the rolling '{r.name}' makes the constraint '{c.name}', which is taken"
            raise sources.error(f"rolling.{r.name}", "", message, hint="choose another name")
        taken.add(c.name)
    held = [*closed.constraints, *(c for _, c in rolling if c.kind == "holonomic")]
    full = replace(
        d,
        bodies=drawn(d),
        constraints=(*d.constraints, *held),
        definitions=(*d.definitions, *surfaces, *touching.definitions),
        stops=(*d.stops, *touching.stops),
        frictions=(*d.frictions, *closed.frictions, *touching.frictions),
        contacts=(*d.contacts, *touching.contacts),
        events=(*d.events, *touching.events),
        velocity_constraints=(*d.velocity_constraints, *(c for _, c in rolling if c.kind == "velocity")),
        loads=tuple(plain for load in d.loads for plain in writer.load(load)),
        points=(*d.points, *writer.points),
        axes=(*d.axes, *writer.axes),
        drawings=(*d.drawings, *writer.drawings),
        windings=(*writer.windings, *windings_of_springs(d)),
        **{key: _added(getattr(d, key), terms) for key, terms in writer.terms.items()},
    )
    return full, closed.parts


def _energies(d: Description, joints: Iterable[Joint]) -> dict[str, algebra.Expr | None]:
    """The energies with those of the joints' springs, dampers and rotors."""
    energies = {"kinetic": d.kinetic, "potential": d.potential, "dissipation": d.dissipation}
    terms: dict[str, list[algebra.Expr]] = {key: [] for key in energies}
    for j in joints:
        names = map(algebra.Symbol, j.coordinates)
        if TYPES[j.type].quaternion:
            rates = list(map(algebra.Symbol, j.rates))
        else:
            coordinates = list(names)
            rates = list(map(dot, coordinates))
            rests = _to_length(j.rest or (algebra.ZERO,), len(coordinates))
            stretched = [difference(q, rest) for q, rest in zip(coordinates, rests, strict=True)]
            terms["potential"] += _quadratic(j.stiffness, stretched)
            terms["kinetic"] += _quadratic(j.armature, rates)
        terms["dissipation"] += _quadratic(j.damping, rates)
    stored, worked = _without_inputs(d)
    energies["potential"], terms["dissipation"] = stored, terms["dissipation"] + worked
    return {key: _added(energies[key], terms[key]) for key in energies}


def _without_inputs(d: Description) -> tuple[algebra.Expr | None, list[algebra.Expr]]:
    """The terms of the potential that are energy, and those with inputs, whose forces do work instead.

    What an input does over time is not known, so that such a term is no stored energy. The rate of a term is linear in
    the rates, with the term's gradient for coefficients: as dissipation it makes the same forces.
    """
    given = {u.name for u in d.inputs}
    for name, expression in d.definitions if given else ():
        if not given.isdisjoint(names_in(expression)):
            given.add(name)
    parts = () if d.potential is None else algebra.Add.make_args(d.potential)
    driven = [x for x in parts if not given.isdisjoint(names_in(x))]
    if not driven:
        return d.potential, []
    stored = [x for x in parts if x not in driven]
    return total(stored) if stored else None, [dot(x) for x in driven]


def _quadratic(factors: tuple[algebra.Expr, ...], values: list[algebra.Expr]) -> list[algebra.Expr]:
    if not factors:
        return []
    pairs = zip(_to_length(factors, len(values)), values, strict=True)
    return [product([HALF, factor, squared(value)]) for factor, value in pairs]


def _to_length(values: tuple[algebra.Expr, ...], count: int) -> tuple[algebra.Expr, ...]:
    return values * count if len(values) == 1 else values


def _added(energy: algebra.Expr | None, terms: list[algebra.Expr]) -> algebra.Expr | None:
    terms = [x for x in terms if not x.is_zero]
    if not terms:
        return energy
    return total([*([] if energy is None else [energy]), *terms])


def _constraints(
    d: Description, sources: Sources, kinds: Mapping[str, str]
) -> tuple[tuple[Constraint, ...], list[Axis], dict[str, tuple[str, ...]]]:
    """All holonomic constraints, plain ones first, the axes that the others need, and the names that each one made."""
    constraints, writer, parts = list(d.constraints), Writer(d), {}
    taken = {c.name for c in (*d.constraints, *d.velocity_constraints)}
    for loop in d.loops:
        known = len(writer.axes)
        for suffix, expression in writer.write(loop):
            name = loop.name + suffix
            if name in taken:
                raise _clash(sources, loop.name, f"constraint '{name}'")
            taken.add(name)
            parts[loop.name] = (*parts.get(loop.name, ()), name)
            constraints.append(Constraint(name, expression))
        for axis in writer.axes[known:]:
            for component in "xyz":
                if f"{axis.name}_{component}" in kinds:
                    raise _clash(sources, loop.name, f"name '{axis.name}_{component}'")
    return tuple(constraints), writer.axes, parts


def _check_losses(losses: list[Friction], d: Description, sources: Sources) -> None:
    """Whether the names of frictions in gears are free."""
    taken = {x.name for x in (*d.stops, *d.frictions, *d.contacts)}
    for loss in losses:
        if loss.name in taken:
            raise _clash(sources, loss.name, f"friction '{loss.name}'")


def _clash(sources: Sources, loop: str, what: str):
    message = f"the ready-made constraint '{loop}' makes the {what}, which is taken"
    return sources.error(f"constraints.{loop}", "", message, hint="choose another name")


def _with_rates(event: Event, d: Description, rate_of: Mapping[str, str]) -> Event:
    """An event whose resets name rates by their own names."""
    own = {r.name for r in d.rates if r.coordinate != r.name}

    def renamed(reset: Reset) -> Reset:
        if reset.is_rate:
            return replace(reset, target=rate_of.get(reset.target, reset.target))
        return replace(reset, is_rate=reset.target in own)

    return replace(event, resets=tuple(map(renamed, event.resets))) if event.resets else event


def _limits(d: Description, sources: Sources) -> Iterator[Event]:
    taken = {e.name for e in d.events}
    for j in d.joints:
        if j.restitution is not None:
            continue
        for side, direction, limit in zip(("lower", "upper"), ("falling", "rising"), j.limits):
            name = f"{j.name}_{side}"
            if name in taken:
                message = f"the limits of the joint make the event '{name}', which is taken"
                raise sources.error(
                    f"joints.{j.name}", "limits", message, hint="choose another name for the event"
                )
            taken.add(name)
            yield Event(name, difference(algebra.Symbol(j.coordinates[0]), limit), direction)
