"""Stops and dry friction: the equations with all stops open, and those with each stop and friction on a switch.

A stop that is closed, or a friction that sticks, is a constraint w a = γ with a force λ; else λ = 0. With a switch s
the two are one equation, s (w a - γ) + (1 - s) λ = 0. So one set of functions serves whatever is closed at a time, and
integrators see a model with more constraints.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import sympy

from ..model.description import Constraint, Description, Event, Friction, Input, Stop
from .load import Loader

# The functions that differ while something is closed.
SWITCHED = (
    "rhs", "residual", "residual_jacobian", "constraint_residual", "constraint_jacobian", "gamma", "project", "events",
)  # fmt: skip
# A stop is closed (1) or open (0); friction sticks (1) or not, and slides forwards (1), backwards (-1) or not at all.
SETTINGS = {"stop": ("closed",), "friction": ("stuck", "sense")}


def has_switches(d: Description) -> bool:
    """Whether a description has stops, or friction that sticks and slips."""
    return bool(d.stops or d.frictions)


def _symbol(name: str, key: str) -> sympy.Symbol:
    return sympy.Symbol(f"{key} {name}")  # no name of a model has a space in it


@dataclass(frozen=True)
class Switches:
    """The stops and frictions of a description."""

    description: Description | None = None
    stops: tuple[Stop, ...] = ()
    frictions: tuple[Friction, ...] = ()

    @classmethod
    def of(cls, d: Description) -> Switches:
        """Those of a finished description."""
        return cls(d, d.stops, d.frictions)

    def records(self) -> list[dict[str, Any]]:
        """What the module's header says about them."""
        kinds = [(s.name, "stop") for s in self.stops] + [(f.name, "friction") for f in self.frictions]
        return [{"name": name, "kind": kind} for name, kind in kinds]

    def open_form(self) -> Description:
        """The description with all stops open, and sliding friction."""
        d = self.description
        settings = [
            Input(_symbol(r["name"], key).name) for r in self.records() for key in SETTINGS[r["kind"]]
        ]
        losses = [_symbol(f.name, "sense") * f.level * f.speed for f in self.frictions]
        dissipation = [*([] if d.dissipation is None else [d.dissipation]), *losses]
        return replace(
            d,
            inputs=(*d.inputs, *settings),
            dissipation=sympy.Add(*dissipation) if dissipation else None,
            events=(*d.events, *self._opening()),
        )

    def closed_form(self) -> Description:
        """The description with a constraint for each, multiplied by its switch."""
        d = self.open_form()
        held = [Constraint(s.name, _symbol(s.name, "closed") * s.gap) for s in self.stops]
        stuck = [Constraint(f.name, _symbol(f.name, "stuck") * f.speed, "velocity") for f in self.frictions]
        return replace(
            d,
            constraints=(*d.constraints, *held),
            velocity_constraints=(*d.velocity_constraints, *stuck),
            events=(*self.description.events, *self._switching()),
        )

    def _opening(self) -> Iterator[Event]:
        """A stop is hit, a sliding motion comes to its end."""
        for s in self.stops:
            yield Event(s.name, s.gap, "falling", "stop")
        for f in self.frictions:
            yield Event(f.name, _symbol(f.name, "sense") * f.speed, "falling", "friction")

    def _switching(self) -> Iterator[Event]:
        """The same, or: a closed stop would pull, a sticking friction would have to be larger than it can."""
        for event, s in zip(self._opening(), self.stops, strict=False):
            yield replace(
                event, when=_either(_symbol(s.name, "closed"), _symbol(s.name, "force"), event.when)
            )
        for event, f in zip([*self._opening()][len(self.stops) :], self.frictions, strict=True):
            margin = _most(f) - sympy.Abs(_symbol(f.name, "force"))
            yield replace(event, when=_either(_symbol(f.name, "stuck"), margin, event.when))

    def corner(self, loader: Loader, d: Description) -> dict[int, int]:
        """1 - s by the row of each switched constraint in the closed form `d`; empty for any other."""
        g = loader.g
        nh, nn = len(d.constraints), len(d.velocity_constraints)
        stops = {nh - len(self.stops) + k: _symbol(s.name, "closed") for k, s in enumerate(self.stops)}
        first = nh + nn - len(self.frictions)
        stuck = {first + k: _symbol(f.name, "stuck") for k, f in enumerate(self.frictions)}
        return {k: g.sub(g.one, loader.load(symbol)) for k, symbol in (stops | stuck).items()}

    def name_forces(self, loader: Loader, d: Description, multipliers: list[int]) -> None:
        """Let the events of the closed form use the forces."""
        names = [c.name for c in (*d.constraints, *d.velocity_constraints)]
        for x in (*self.stops, *self.frictions):
            loader.symbols[_symbol(x.name, "force").name] = multipliers[names.index(x.name)]

    def watched(self, loader: Loader) -> tuple[str, tuple[int, ...]]:
        """What the function `switches` writes: its docstring and its outputs."""
        groups = [(s.gap, s.restitution) for s in self.stops]
        groups += [(f.speed, f.level, _most(f)) for f in self.frictions]
        doc = "Gaps and restitutions of stops; speeds, levels and largest levels of frictions."
        return doc, tuple(loader.load(x) for group in groups for x in group)

    def closed_header(self, head: dict[str, Any]) -> dict[str, Any]:
        """The header with the sizes and constraints of the closed form."""
        stops = [{"name": s.name, "kind": "holonomic"} for s in self.stops]
        frictions = [{"name": f.name, "kind": "velocity"} for f in self.frictions]
        nh, constraints = head["nh"], head["constraints"]
        return head | {
            "nh": nh + len(stops),
            "nn": head["nn"] + len(frictions),
            "constraints": [*constraints[:nh], *stops, *constraints[nh:], *frictions],
        }


def _either(switch: sympy.Symbol, on: sympy.Expr, off: sympy.Expr) -> sympy.Expr:
    return switch * on + (1 - switch) * off


def _most(f: Friction) -> sympy.Expr:
    """What a friction can take while it sticks."""
    return f.level if f.static is None else f.static


NONE = Switches()
