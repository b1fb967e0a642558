"""Compliant contacts and smooth friction of a given size, written out as energies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from ..errors import nearest
from . import algebra
from .description import Bristle, Contact, Description, Friction, Stop
from .expression_tree import uses
from .functions import dot, maximum, minimum, smooth_minimum
from .ready_made import HALF
from .sources import Sources
from .unevaluated import difference, inverted, negated, product, squared, total

# Of a contact that is open [m]: derivatives of δ^1.5 divide by δ. What it makes of a force is nothing.
NO_DEPTH = algebra.Float(1e-60)


def with_contact_laws(d: Description, sources: Sources) -> Description:
    """The description with the forces of its contacts, and joint limits that stop among its stops."""
    potential, dissipation = [d.potential], [d.dissipation]
    for c in d.contacts:
        potential.append(_elastic_energy(c))
        dissipation += _contact_losses(c)
    smooth = [f for f in d.frictions if f.smooth is not None and not f.normal]
    # The derivative of a Rayleigh function is its force only where the level knows no rates.
    by_force = [f for f in smooth if f.creeps or changes_with_rates(f.level, d)]
    dissipation += [smooth_friction(f.level, f.speeds, f.smooth) for f in smooth if f not in by_force]
    giving_way = [
        (s, negated(product([f.level, part])))
        for f in by_force
        for s, part in zip(f.speeds, soft_direction(f))
    ]
    return replace(
        d,
        potential=_sum(potential),
        dissipation=_sum(dissipation),
        rubbing=(
            *d.rubbing,
            *giving_way,
            *((b.speed, negated(algebra.Symbol(b.made[1]))) for b in d.bristles),
        ),
        contacts=(),
        frictions=tuple(f for f in d.frictions if f not in smooth),
        stops=(*d.stops, *_limit_stops(d, sources)),
    )


def with_normals(d: Description, parts: Mapping[str, tuple[str, ...]], sources: Sources) -> Description:
    """The description with the scalar constraints that each friction's `normal` names.

    Parameters
    ----------
    parts : mapping of str to tuple of str
        The constraints that each ready-made one has become.
    """
    stops = {s.name for s in d.stops}
    held = {c.name for c in (*d.constraints, *d.velocity_constraints)}
    known = {**{name: (name,) for name in (*sorted(stops), *sorted(held))}, **parts}
    frictions = []
    for f in d.frictions:
        table = f"friction.{f.name}"
        for name in f.normal:
            if name not in known:
                message = f"there is no stop and no constraint named '{name:.60}'"
                hint = nearest(name[:60], known, "stops and constraints")
                raise sources.error(table, "normal", message, hint=hint)
        names = tuple(dict.fromkeys(part for name in f.normal for part in known[name]))
        if len(names) > 1 and not stops.isdisjoint(names):
            message = "a 'normal' force is that of one stop, or the magnitude of constraint forces"
            raise sources.error(table, "normal", message, hint="give each stop a friction of its own")
        frictions.append(replace(f, normal=names))
    return replace(d, frictions=tuple(frictions))


def smooth_friction(level: algebra.Expr, speeds: Sequence[algebra.Expr], width: algebra.Expr) -> algebra.Expr:
    """Rayleigh function of the friction level*s/sqrt(s^2 + width^2): no overflow, and no exponentials as with tanh."""
    squares = [squared(s) for s in (*speeds, width)]
    return product([level, algebra.sqrt(total(squares), evaluate=False)])


def creep_share(speeds: Sequence[algebra.Expr], width: algebra.Expr) -> algebra.Expr:
    """What makes of speeds the part of a friction that acts against each: (1 - (1 - s/w)³)/s, and 1/s from w on.

    The force begins in proportion to the speed s and is whole, on Coulomb's circle, at w: Vermeulen, Johnson, Contact
    of nonspherical elastic bodies transmitting tangential forces, J. Appl. Mech. 31 (1964), with Kalker's coefficient
    for the slope 3/w at the beginning (Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990, ch. 2).
    """
    size = algebra.sqrt(algebra.Add(*(s**2 for s in speeds)) + NO_DEPTH**2)
    part = minimum(size / width, algebra.ONE)
    # (1 - (1 - x)³)/x, of which the limit at 0 is 3.
    return (3 - 3 * part + part**2) / maximum(size, width)


def soft_direction(f: Friction) -> tuple[algebra.Expr, ...]:
    """How much of the size of a friction that gives way acts against each of its speeds."""
    if f.creeps:
        share = creep_share(f.speeds, f.smooth)
        return tuple(share * s for s in f.speeds)
    width = algebra.sqrt(algebra.Add(*(s**2 for s in f.speeds)) + f.smooth**2)
    return tuple(s / width for s in f.speeds)


def changes_with_rates(expression: algebra.Expr, d: Description) -> bool:
    """Whether an expression has rates, by itself or through definitions."""
    rates = {r.name for r in d.rates if not r.state}
    definitions, waiting, seen = dict(d.definitions), [expression], set()
    while waiting:
        found = uses(waiting.pop())
        if found.has_dot or found.names & rates:
            return True
        waiting += [definitions[name] for name in found.names & definitions.keys() - seen]
        seen |= found.names
    return False


def bristle_laws(b: Bristle) -> tuple[algebra.Expr, algebra.Expr]:
    """The rate of the deflection of bristles, and the force.

    dz/dt = v - σ0 |v| z/g, F = σ0 z + σ1 dz/dt + σ2 v with g = Fc + (Fs - Fc) exp(-(v/vs)²): Canudas de Wit, Olsson,
    Åström, Lischinsky, A new model for control of systems with friction, IEEE Trans. Automat. Contr. 40 (1995), eqs.
    2, 3 and 5.
    """
    z, (rate, _) = algebra.Symbol(b.name), b.made
    level = b.coulomb
    if b.static is not None:
        bump = algebra.exp(negated(squared(product([b.speed, inverted(b.stribeck)]))), evaluate=False)
        level = total([level, product([difference(b.static, b.coulomb), bump])])
    slipping = product([b.stiffness, algebra.Abs(b.speed), z, inverted(level)])
    force = [
        product([b.stiffness, z]),
        product([b.damping, algebra.Symbol(rate)]),
        product([b.viscous, b.speed]),
    ]
    return difference(b.speed, slipping), total(force)


def _depth(c: Contact) -> algebra.Expr:
    return maximum(negated(c.gap), NO_DEPTH)


def _elastic_force(c: Contact) -> algebra.Expr:
    return product([c.stiffness, algebra.Pow(_depth(c), c.exponent, evaluate=False)])


def _elastic_energy(c: Contact) -> algebra.Expr:
    """The integral of k δ^n: k δ^(n+1)/(n+1)."""
    power = c.exponent + 1
    return product([c.stiffness, algebra.Pow(_depth(c), power, evaluate=False), inverted(power)])


def _contact_losses(c: Contact) -> Iterator[algebra.Expr]:
    """Rayleigh functions of the hysteresis, 3/2 c k δ^n dδ/dt as far as the whole does not pull, and of friction.

    Hunt, Crossley: Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975),
    eq. 11. With r the rate of the gap and β = 3/2 c, the derivative of β y (r - y/2), y = min(r, 1/β), by r is
    min(β r, 1): at most the elastic force is taken away.
    """
    elastic = _elastic_force(c)
    if c.damping is not None and c.damping != 0:
        beta, rate = product([algebra.Rational(3, 2), c.damping]), dot(c.gap)
        y = smooth_minimum(rate, inverted(beta))
        yield product([elastic, beta, y, difference(rate, product([HALF, y]))])
    if c.friction is not None:
        yield smooth_friction(product([c.friction, elastic]), c.slips, c.smooth)


def _limit_stops(d: Description, sources: Sources) -> Iterator[Stop]:
    taken = {x.name for x in (*d.stops, *d.frictions, *d.events)}
    for j in d.joints:
        if j.restitution is None:
            continue
        q = algebra.Symbol(j.coordinates[0])
        for side, gap in (("lower", difference(q, j.limits[0])), ("upper", difference(j.limits[1], q))):
            name = f"{j.name}_{side}"
            if name in taken:
                message = f"the limits of the joint make the stop '{name}', which is taken"
                raise sources.error(f"joints.{j.name}", "limits", message, hint="choose another name")
            yield Stop(name, gap, j.restitution)


def _sum(terms: list[algebra.Expr | None]) -> algebra.Expr | None:
    given = [x for x in terms if x is not None]
    return total(given) if given else None
