"""Stops and dry friction: the equations with all stops open, and those with each stop and friction on a switch.

A stop that is closed, or a friction that sticks, is a constraint w a = γ with a force λ; else λ = 0. With a switch s
the two are one equation, s (w a - γ) + (1 - s) λ = 0. So one set of functions serves whatever is closed at a time, and
integrators see a model with more constraints.

Smooth friction in proportion to a reaction never sticks, and its switch stays off. It is among the others since what is
closed depends on it, and since it, too, can come to have no solution.

Dry friction in proportion to reactions: its levels and the multipliers determine each other.

M a = f - Σ s_j ℓ_j t_j + Gᵀ λ, G a = γ and ℓ_j = μ_j N_j(λ), with N the multiplier of a stop, or the magnitude of some
constraints' multipliers, and s the sense of sliding; u / sqrt(u² + w²), with the sliding speed u, where friction is
smooth. The matrix of a and λ stays symmetric if the levels ℓ are taken as given: then a and λ are affine in them, and
what is left are as many equations as there are such frictions,

    ℓ = μ N(λ_0 + Λ ℓ),

which Newton's method solves. It ends at once where all N are multipliers. Pivots of 1 - μ ∂N/∂ℓ that are not positive
are Painlevé's paradox: no solution, or several (Génot, Brogliato: New results on Painlevé paradoxes, Eur. J. Mech. A 18
(1999)). A magnitude gives a function that is convex in ℓ, so that Newton's method comes from below and cannot miss.

Friction with two directions: two rows in fixed axes while it sticks. Where it slides, its force is against the
direction d of the sliding velocity s, and the senses in `p` are the direction e of some time before. Once s has turned
by more than 45°, e is renewed. Beyond s = 0, on the other side of e, d goes on as it was: stages of a step that comes
to rest look there, and the event that ends the sliding is a clean crossing.

Where sliding begins, d follows from almost no speed, and the equations are stiff without bound: a velocity across d
dies out at a rate of force / speed. So it is aimed at first, along the reaction that it could not take: the force is
along -e, and a constraint holds the speed across, whose force is small while the direction of the motion is. Once that
exceeds an angle, the friction turns with the motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from symgen.runtime.graph.layouts import settings_of

from ..model import algebra
from ..model.contact_laws import changes_with_rates, smooth_friction, soft_direction
from ..model.description import Constraint, Description, Event, Friction, Input, Stop
from ..model.functions import minimum
from .graph.differentiate import forward, jacobian
from .graph.graph import Graph
from .graph.nodes import LAM, SparseRows
from .load import Loader
from .solve import factorise as ldl
from .variables import Variables

_PASSES = 8  # of Newton's method where a normal force is a magnitude
_NO_FORCE = 1e-200  # squared: keeps the derivative of a magnitude finite at zero


@dataclass(frozen=True)
class Reaction:
    """One friction: the variable that stands for its level, its coefficient μ, the numbers of the multipliers in N."""

    level: int
    coefficient: int
    rows: tuple[int, ...]
    is_magnitude: bool

    def normal(self, g: Graph, multipliers: list[int]) -> int:
        """N(λ)."""
        own = [multipliers[k] for k in self.rows]
        return g.call("sqrt", g.add(g.dot(own, own), g.const(_NO_FORCE))) if self.is_magnitude else own[0]

    def weights(self, g: Graph, multipliers: list[int]) -> dict[int, int]:
        """∂N/∂λ, by the numbers of the multipliers."""
        if not self.is_magnitude:
            return {self.rows[0]: g.one}
        normal = self.normal(g, multipliers)
        return {k: g.div(multipliers[k], normal) for k in self.rows}


@dataclass(frozen=True)
class Levels:
    """All such frictions of one form of a model; there may be none."""

    g: Graph
    reactions: tuple[Reaction, ...]

    def without(self, nodes: list[int]) -> list[int]:
        """Nodes without the forces of these frictions."""
        return self.g.substitute(nodes, {r.level: self.g.zero for r in self.reactions})

    def at(self, nodes: list[int], multipliers: list[int]) -> list[int]:
        """Nodes with the levels that follow from some multipliers."""
        g = self.g
        levels = {r.level: g.mul(r.coefficient, r.normal(g, multipliers)) for r in self.reactions}
        return g.substitute(nodes, levels)

    def solve(self, factors: ldl.Factors, forces: list[int], gamma: list[int]) -> tuple[list[int], list[int]]:
        """Accelerations and minus the multipliers, and of each level how far it is from a paradox (1)."""
        g, n = self.g, len(forces)
        if not self.reactions:
            return ldl.solve(g, factors, [*forces, *gamma]), []
        solution = ldl.solve(g, factors, [*self.without(forces), *gamma])
        columns = []
        for r in self.reactions:
            along = forward(g, forces, {r.level: g.one})
            columns.append(ldl.solve(g, factors, [*along, *[g.zero] * len(gamma)]))
        levels = [g.zero] * len(columns)
        margins = [g.one] * len(columns)
        passes = _PASSES if any(r.is_magnitude for r in self.reactions) else 1
        for _ in range(passes):
            levels, margins = self._newton(solution, columns, n, levels)
        for column, level in zip(columns, levels, strict=True):
            solution = [g.add(x, g.mul(level, y)) for x, y in zip(solution, column, strict=True)]
        return solution, margins

    def _newton(
        self, solution: list[int], columns: list[list[int]], n: int, levels: list[int]
    ) -> tuple[list[int], list[int]]:
        """One step for ℓ - μ N(λ(ℓ)) = 0, and how regular it is."""
        g, k = self.g, len(columns)
        multipliers = []
        for i in range(n, len(solution)):
            moved = g.dot(levels, [column[i] for column in columns])
            multipliers.append(g.neg(g.add(solution[i], moved)))
        rows, right, widest = [], [], []
        for j, r in enumerate(self.reactions):
            weights = r.weights(g, multipliers)
            # Minus the multipliers stand in the columns.
            slopes = [g.dot(weights.values(), [column[n + i] for i in weights]) for column in columns]
            row = [g.mul(r.coefficient, slope) for slope in slopes]
            row[j] = g.add(g.one, row[j])
            rows.append(row)
            right.append(g.sub(g.mul(r.coefficient, r.normal(g, multipliers)), levels[j]))
            own = [columns[j][n + i] for i in r.rows]
            steepest = g.mul(r.coefficient, g.call("sqrt", g.dot(own, own))) if r.is_magnitude else g.zero
            widest.append(g.sub(g.one, steepest))
        pivots = eliminate(g, rows, right)
        change = [g.zero] * k
        for i in reversed(range(k)):
            rest = g.sub(right[i], g.dot(rows[i][i + 1 :], change[i + 1 :]))
            change[i] = g.div(rest, pivots[i])
        margins = [g.minimum(p, w) if w != g.one else p for p, w in zip(pivots, widest, strict=True)]
        return [g.add(x, y) for x, y in zip(levels, change, strict=True)], margins

    def differentiate(self, rows: SparseRows, residual: list[int], state: list[int], x: Variables) -> None:
        """Add to the residual's derivatives what they owe to the levels, and put the levels in."""
        g, first = self.g, len(state) + len(x.v)
        for r in self.reactions:
            along = forward(g, residual, {r.level: g.one})
            normal = r.normal(g, x.lam)
            slopes = dict(enumerate(g.mul(normal, s) for s in jacobian(g, [r.coefficient], state)[0]))
            for i, weight in r.weights(g, x.lam).items():
                slopes[first + i] = g.mul(r.coefficient, weight)
            for i, factor in enumerate(along):
                for column, slope in slopes.items():
                    if g.zero not in (factor, slope):
                        rows[i][column] = g.add(rows[i].get(column, g.zero), g.mul(factor, slope))
        for i, row in enumerate(rows):
            rows[i] = dict(zip(row, self.at(list(row.values()), x.lam), strict=True))


def eliminate(g: Graph, rows: list[list[int]], right: list[int]) -> list[int]:
    """Gaussian elimination in place, without exchanges: the pivots tell whether the solution is the only one."""
    for i, row in enumerate(rows):
        for j in range(i + 1, len(rows)):
            factor = g.div(rows[j][i], row[i])
            if factor == g.zero:
                continue
            rows[j] = [g.sub(a, g.mul(factor, b)) for a, b in zip(rows[j], row, strict=True)]
            right[j] = g.sub(right[j], g.mul(factor, right[i]))
    return [row[i] for i, row in enumerate(rows)]


# The functions that differ while something is closed.
SWITCHED = (
    "rhs", "residual", "residual_jacobian", "constraint_residual", "constraint_jacobian", "gamma", "project", "events",
)  # fmt: skip
_NOTHING = algebra.Float(1e-150)
_NO_SPEED = algebra.Float(1e-140)  # in the direction of an expected motion: keeps directions finite at rest
_OPPOSITE = algebra.Float(0.57)  # cosine of the angle about -e in which sliding goes on as it was


def has_switches(d: Description) -> bool:
    """Whether a description has stops, or friction that sticks and slips or follows reactions."""
    return bool(d.stops or d.frictions)


def n_switches(d: Description) -> int:
    """How many rows stops and frictions add to the equations of the form with switches."""
    return len(d.stops) + sum(len(f.rows) for f in d.frictions)


def _symbol(name: str, key: str) -> algebra.Symbol:
    return algebra.Symbol(f"{key} {name}")  # no name of a model has a space in it


@dataclass(frozen=True)
class Switches:
    """The stops and frictions of a description, in the form with all stops open or in that with switches (`held`)."""

    description: Description | None = None
    stops: tuple[Stop, ...] = ()
    frictions: tuple[Friction, ...] = ()
    held: bool = False

    @classmethod
    def of(cls, d: Description) -> Switches:
        """Those of a finished description."""
        return cls(d, d.stops, d.frictions)

    @property
    def closed(self) -> Switches:
        """The same in the form with switches."""
        return replace(self, held=True)

    def records(self) -> list[dict[str, Any]]:
        """What the module's header says about them."""
        stops = [{"name": s.name, "kind": "stop"} for s in self.stops]
        frictions = []
        for f in self.frictions:
            for axis, name in enumerate(f.rows, start=1):
                record: dict[str, Any] = {"name": name, "kind": "friction"}
                if f.across is not None:
                    record |= {"circle": f.name, "axis": axis}
                if f.normal:
                    record["normal"] = list(f.normal)
                if f.smooth is not None:
                    record["smooth"] = True
                if f.creeps:
                    record["creeps"] = True
                frictions.append(record)
        return stops + frictions

    def _is_by_power(self, f: Friction) -> bool:
        """Whether the force of a friction is given with the speed that it works on, not by a Rayleigh function."""
        by_speed = not f.normal and changes_with_rates(f.level, self.description)
        return f.across is not None or f.creeps or by_speed

    def form(self) -> Description:
        """The description in this form."""
        return self._closed_form() if self.held else self._open_form()

    def _on_stop(self, f: Friction) -> bool:
        return any(s.name in f.normal for s in self.stops)

    def _acting(self) -> list[Friction]:
        """Those whose normal force there is in this form."""
        return [f for f in self.frictions if self.held or not self._on_stop(f)]

    def _open_form(self) -> Description:
        """With all stops open, and sliding friction."""
        d = self.description
        settings = [Input(_symbol(r["name"], key).name) for r in self.records() for key in settings_of(r)]
        # The derivative of a Rayleigh function is its force only where the level knows no rates.
        losses = [_loss(f) for f in self._acting() if not self._is_by_power(f)]
        dissipation = [*([] if d.dissipation is None else [d.dissipation]), *losses]
        return replace(
            d,
            inputs=(*d.inputs, *settings),
            dissipation=algebra.Add(*dissipation) if dissipation else None,
            rubbing=(
                *d.rubbing,
                *(
                    (speed, -force)
                    for f in self._acting()
                    if self._is_by_power(f)
                    for speed, force in zip(f.speeds, self.sliding(f), strict=True)
                ),
            ),
            events=(*d.events, *self._opening()),
        )

    def _closed_form(self) -> Description:
        """With a constraint for each, multiplied by its switch."""
        d = self._open_form()
        held = [Constraint(s.name, _symbol(s.name, "closed") * s.gap) for s in self.stops]
        stuck = [
            Constraint(name, _symbol(name, "stuck") * speed, "velocity")
            for f in self.frictions
            for name, speed in zip(f.rows, _held(f), strict=True)
        ]
        return replace(
            d,
            constraints=(*d.constraints, *held),
            velocity_constraints=(*d.velocity_constraints, *stuck),
            events=(*self.description.events, *self._switching()),
        )

    def _opening(self) -> Iterator[Event]:
        """A stop is hit, a sliding motion comes to its end or has no solution."""
        for s in self.stops:
            yield Event(s.name, s.gap, "falling", "stop")
        for f in self.frictions:
            for name, when in zip(f.rows, self._going_on(f), strict=True):
                yield Event(name, when, "falling", "friction")

    def _going_on(self, f: Friction) -> tuple[algebra.Expr, ...]:
        """What falls to zero where sliding ends, or where it comes to have no solution."""
        others = () if f.across is None else (algebra.ONE,)
        if f.across is not None and f.smooth is None:
            turns, aimed, bound = (_setting(f, key) for key in ("turns", "aimed", "bound"))
            aims = _either(
                aimed, bound - _in_axes_of(f)[0], algebra.ONE
            )  # what is guided has nothing that is held
            others = (_either(turns, _norm(f.speeds) - bound, aims),)
        if f.normal and f not in self._acting():
            return (algebra.ONE, *others)
        sliding, margin = _onward(f), _symbol(f.name, "margin")
        if f.normal:
            sliding = minimum(sliding, margin) if f.smooth is None else margin
        return (sliding, *others)

    def _switching(self) -> Iterator[Event]:
        """The same, or: a closed stop would pull, a sticking friction would have to be larger than it can."""
        for event, s in zip(self._opening(), self.stops, strict=False):
            yield replace(
                event, when=_either(_symbol(s.name, "closed"), _symbol(s.name, "force"), event.when)
            )
        rest = iter([*self._opening()][len(self.stops) :])
        for f in self.frictions:
            for event, when in zip([next(rest) for _ in f.rows], self._holding(f), strict=True):
                if self._on_stop(f):  # nothing happens to it while that is open
                    when = _either(_symbol(f.normal[0], "closed"), when, algebra.ONE)
                yield replace(event, when=when)

    def _holding(self, f: Friction) -> tuple[algebra.Expr, ...]:
        """What falls to zero where sliding ends, or where what sticks would have to be larger than it can."""
        sliding = self._going_on(f)
        if f.smooth is not None:
            return sliding
        if f.across is None:
            margin = self._most(f) - algebra.Abs(_symbol(f.name, "force"))
            return (_either(_symbol(f.name, "stuck"), margin, sliding[0]),)
        turns, aimed, angle = (_setting(f, key) for key in ("turns", "aimed", "angle"))
        moves = turns + aimed
        # What others hold already keeps its share, which senses say.
        shares = [(1 - moves) * sense * self._normal(f) * f.level for sense in _senses(f)]
        forces = [_symbol(name, "force") - share for name, share in zip(f.rows, shares, strict=True)]
        margin = self._most(f) - _norm(forces)
        across = angle * f.level * self._normal(f) - algebra.Abs(_symbol(f.rows[1], "force"))
        bound = _setting(f, "bound")
        aims = minimum(across, bound - _in_axes_of(f)[0])
        slowing = _norm(f.speeds) - bound
        return _either(moves, sliding[0], margin), aimed * aims + (1 - aimed) * _either(
            turns, slowing, margin
        )

    def _normal(self, f: Friction) -> algebra.Expr:
        """The force that a coefficient of friction multiplies; 1 where there is none."""
        forces = [_symbol(name, "reaction") for name in f.normal]
        if not f.normal:
            return algebra.ONE
        return forces[0] if self._on_stop(f) else algebra.sqrt(algebra.Add(*(x**2 for x in forces)))

    def _most(self, f: Friction) -> algebra.Expr:
        """What a friction can take while it sticks."""
        return _static(f) * self._normal(f)

    def levels(self, loader: Loader, d: Description) -> Levels:
        """The frictions in proportion to reactions, whose levels become variables."""
        n_rows, reactions = len(d.constraints) + len(d.velocity_constraints), []
        for f in self._acting():
            if f.normal:
                level = loader.g.var(LAM, n_rows + len(reactions))
                loader.symbols[_symbol(f.name, "level").name] = level
                rows = tuple(self._rows_of_normal(f, d))
                reactions.append(Reaction(level, loader.load(f.level), rows, not self._on_stop(f)))
        return Levels(loader.g, tuple(reactions))

    def sliding(self, f: Friction) -> tuple[algebra.Expr, ...]:
        """What a friction that slides exerts against each of its speeds."""
        if f not in self._acting():
            return (algebra.ZERO,) * len(f.rows)
        return tuple(_sliding(f) * x for x in _direction(f))

    def corner(self, loader: Loader, d: Description) -> dict[int, int]:
        """1 - s by the row of each switched constraint; empty in the open form."""
        if not self.held:
            return {}
        g, stops = loader.g, {s.name for s in self.stops}
        switches = {
            k: _symbol(name, "closed" if name in stops else "stuck") for name, k in self._own_rows(d).items()
        }
        return {k: g.sub(g.one, loader.load(symbol)) for k, symbol in switches.items()}

    def _own_rows(self, d: Description) -> dict[str, int]:
        """Which constraints of this form stops and frictions are; gears are called as the friction in them is."""
        if not self.held:
            return {}
        nh, rubbing = len(d.constraints), [name for f in self.frictions for name in f.rows]
        first = nh + len(d.velocity_constraints) - len(rubbing)
        stops = {s.name: nh - len(self.stops) + k for k, s in enumerate(self.stops)}
        return stops | {name: first + k for k, name in enumerate(rubbing)}

    def _rows_of_normal(self, f: Friction, d: Description) -> list[int]:
        """The constraints of this form whose forces a friction is in proportion to: a stop, or some of the model's."""
        if self._on_stop(f):
            return [self._own_rows(d)[name] for name in f.normal]
        names = [c.name for c in (*d.constraints, *d.velocity_constraints)]
        return [names.index(name) for name in f.normal]

    def name_forces(self, loader: Loader, d: Description, multipliers: list[int], margins: list[int]) -> None:
        """Let the events use the forces, and how far frictions in proportion to them are from having no solution."""
        for name, k in self._own_rows(d).items():
            loader.symbols[_symbol(name, "force").name] = multipliers[k]
        for f in self._acting():
            for name, k in zip(f.normal, self._rows_of_normal(f, d), strict=True):
                loader.symbols[_symbol(name, "reaction").name] = multipliers[k]
        coupled = [f for f in self._acting() if f.normal]
        for f, margin in zip(coupled, margins, strict=True):
            loader.symbols[_symbol(f.name, "margin").name] = margin

    def watched(self, loader: Loader) -> tuple[str, tuple[int, ...]]:
        """What the function `switches` writes: its docstring and its outputs."""
        groups = [(s.gap, s.restitution) for s in self.stops]
        groups += [
            (speed, f.level, _static(f) if f.smooth is None else f.smooth)
            for f in self.frictions
            for speed in f.speeds
        ]
        doc = "Gaps and restitutions of stops; speeds, levels and largest levels of frictions."
        if any(f.smooth is not None for f in self.frictions):
            doc = doc.replace("largest levels", "largest levels, or widths,")
        return doc, tuple(loader.load(x) for group in groups for x in group)

    def closed_header(self, head: dict[str, Any]) -> dict[str, Any]:
        """The header with the sizes and constraints of the closed form."""
        stops = [{"name": s.name, "kind": "holonomic"} for s in self.stops]
        frictions = [{"name": name, "kind": "velocity"} for f in self.frictions for name in f.rows]
        nh, constraints = head["nh"], head["constraints"]
        return head | {
            "nh": nh + len(stops),
            "nn": head["nn"] + len(frictions),
            "constraints": [*constraints[:nh], *stops, *constraints[nh:], *frictions],
        }


def _either(switch: algebra.Symbol, on: algebra.Expr, off: algebra.Expr) -> algebra.Expr:
    return switch * on + (1 - switch) * off


def _setting(f: Friction, key: str) -> algebra.Symbol:
    """One of the settings of a friction with two directions, which are some of its first, some of its second row."""
    return _symbol(f.rows[key != "turns"], key)


def _senses(f: Friction) -> list[algebra.Symbol]:
    return [_symbol(name, "sense") for name in f.rows]


def _norm(vector: Sequence[algebra.Expr]) -> algebra.Expr:
    return algebra.sqrt(algebra.Add(*(x**2 for x in vector)) + _NO_SPEED**2)


def _in_axes_of(f: Friction) -> tuple[algebra.Expr, algebra.Expr]:
    """The sliding speed along the direction that the senses give, and across."""
    (s1, s2), (e1, e2) = f.speeds, _senses(f)
    return e1 * s1 + e2 * s2, e1 * s2 - e2 * s1


def _held(f: Friction) -> tuple[algebra.Expr, ...]:
    """What is held at zero where the rows of a friction are switched on: its speeds, or the one across its aim."""
    if f.across is None:
        return f.speeds
    return f.speed, _either(_setting(f, "aimed"), _in_axes_of(f)[1], f.across)


def _onward(f: Friction) -> algebra.Expr:
    """What falls to zero where a sliding motion ends; of two speeds also where it has turned by 45°."""
    if f.across is None:
        return _symbol(f.name, "sense") * f.speed
    along, across = _in_axes_of(f)
    return along - _setting(f, "turns") * algebra.Abs(across)


def _direction(f: Friction) -> tuple[algebra.Expr, ...]:
    """How much of the size of a friction acts against each of its speeds."""
    if f.smooth is not None:
        return soft_direction(f)
    senses = _senses(f)
    if f.across is None:
        return (senses[0],)
    turns = _setting(f, "turns")
    # What does not turn has no speed here: the series of a direction would grow without bound at rest.
    moved = [turns * s + (1 - turns + _NO_SPEED) * e for s, e in zip(f.speeds, senses, strict=True)]
    size = _norm(moved)
    side = algebra.Add(*(e * s for e, s in zip(senses, moved, strict=True))) + _OPPOSITE * size
    onward = side / algebra.sqrt(side**2 + _NOTHING**2)  # 1 or -1: a choice would have no series
    return tuple(_either(turns, onward * s / size, e) for s, e in zip(moved, senses, strict=True))


def _loss(f: Friction) -> algebra.Expr:
    """The Rayleigh function of a friction that does not stick."""
    if f.smooth is None:
        return _symbol(f.name, "sense") * _sliding(f) * f.speed
    return smooth_friction(_sliding(f), f.speeds, f.smooth)


def _sliding(f: Friction) -> algebra.Expr:
    """How large a friction is while it slides."""
    return _symbol(f.name, "level") if f.normal else f.level


def _static(f: Friction) -> algebra.Expr:
    """The level, or coefficient, while a friction sticks."""
    return f.level if f.static is None else f.static


NONE = Switches()
