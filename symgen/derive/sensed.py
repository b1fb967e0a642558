"""What only the solved equations tell: accelerations and reactions, for outputs, events, and forces that follow them.

Their nodes are functions of (q, v, a, λ) and of the forces of stops and frictions, which follow λ. Outputs read all
this (docs/abi.md); in events, which are functions of (q, v), the solution is put in its place. What forces follow are
variables on the graph until it is solved for (`feedback.py`).

The force in a joint follows from a model that is cut there: six massless joints before it, whose coordinates are zero.
What the inverse dynamics of that model ask of these is what the joint does to its child, along and about the axes of
the joint's frame. Only what the cut lets move takes part, so this holds for trees and closed chains alike.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

from ..model import algebra
from ..model.description import Body, Coordinate, Description, Friction, Joint, Rate, Sensor
from ..model.sensors import acting, late_definitions, without_sensed
from .constraints import constraint_forces, constraints
from .dynamics import inverse_dynamics, mechanics
from .graph.copying import copied
from .graph.differentiate import forward, reverse
from .graph.graph import Graph
from .graph.nodes import LAM, A, Q, V
from .kinematics import Scene
from .load import Loader, make_loader
from .variables import Variables, variables

_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_ZERO = (algebra.ZERO,) * 3


@dataclass(frozen=True)
class Settled:
    """What the variables of sensors that forces follow are.

    Parameters
    ----------
    values : dict of int to int
        As functions of (q, v).
    measured : dict of int to int
        As functions of (q, v, a, λ) and of the forces of stops and frictions.
    margins : list of (Sensor, int)
        A sensor of each loop, and what falls to zero where the loop comes to have no solution.
    """

    values: dict[int, int] = field(default_factory=dict)
    measured: dict[int, int] = field(default_factory=dict)
    margins: list[tuple[Sensor, int]] = field(default_factory=list)


NOTHING = Settled()


class Equations(Protocol):
    """What sensors look at: the equations of one form of a model, as far as they are derived (`derivation.py`).

    `own` is the model as the user has it, `description` in the form that is derived; `dependent` are the numbers of
    constraints that follow from others.
    """

    g: Graph
    own: Description
    description: Description
    loader: Loader
    x: Variables
    dependent: tuple[int, ...]
    accelerations: list[int]
    multipliers: list[int]
    settled: Settled

    def sliding(self, friction: Friction) -> list[int]:
        """What a friction that slides exerts against each of its speeds."""
        ...


class Sensed:
    """The sensors of a model on its graph.

    Parameters
    ----------
    derivation : Equations
        Its loader knows them afterwards, as functions of (q, v, a, λ, forces of stops and frictions).
    """

    def __init__(self, derivation: Equations) -> None:
        self.derivation, self.own = derivation, derivation.own
        d, own, loader = derivation, derivation.own, derivation.loader
        self.g: Graph = d.g
        names = [c.name for c in (*own.constraints, *own.velocity_constraints)]
        contacts = [*(s.name for s in own.stops), *(row for f in own.frictions for row in f.rows)]
        # The numbers that outputs read behind a, in their order.
        # Of a constraint and a friction of one name, as those of a gear with an efficiency, the constraint's is meant.
        self.variables = [self.g.var(LAM, k) for k in range(len(names) + len(contacts))]
        found = list(zip([*names, *contacts], self.variables, strict=True))
        self.forces = dict(reversed(found))
        # By the variables that stand for what forces follow.
        self.followed: dict[int, int] = {}
        follow, motion = acting(d.description), d.x.motion(d.x.a)
        for s in d.description.sensors:
            if s.derivative is not None:
                node = forward(self.g, [loader.load(s.derivative)], motion)[0]
            elif s.joint is not None:
                node = self._wrenches[s.joint][s.component]
            else:
                node = self._magnitude([self.forces[name] for name in s.rows])
            if s.name in follow:
                self.followed[loader.symbols[s.name]] = node
            else:
                loader.symbols[s.name] = node
        late = late_definitions(d.description, {s.name for s in d.description.sensors} - follow.keys())
        for name, expression in late.items():
            loader.define(name, expression)

    def _magnitude(self, forces: list[int]) -> int:
        return forces[0] if len(forces) == 1 else self.g.call("sqrt", self.g.dot(forces, forces))

    def observed(self, nodes: list[int]) -> list[int]:
        """Nodes as functions of (q, v, a, λ) and the forces of stops and frictions."""
        return self.g.substitute(nodes, self.derivation.settled.measured) if self.followed else nodes

    def event(self, expression: algebra.Expr) -> int:
        """An expression as a function of (q, v), with what the equations of this form give."""
        solution = self.solution() | self.derivation.settled.values
        return self.g.substitute([self.derivation.loader.load(expression)], solution)[0]

    def solution(self) -> dict[int, int]:
        """What the equations of this form give for the variables in which sensors are written."""
        d = self.derivation
        solution = dict(zip(d.x.a, d.accelerations, strict=True))
        form, own = d.description, self.own
        nh, n_own = len(form.constraints), len(own.constraints)
        nn_own = nh + len(own.velocity_constraints)
        held = [*d.multipliers[:n_own], *d.multipliers[nh:nn_own]]
        # In the open form there are no constraints of stops and frictions, whose forces are nothing then.
        stops = d.multipliers[n_own:nh] or [self.g.zero] * len(own.stops)
        sliding = [force for f in own.frictions for force in d.sliding(f)]
        sticking = d.multipliers[nn_own:] or [self.g.zero] * len(sliding)
        rubbing = map(self.g.sub, sticking, sliding)
        solution |= dict(zip(self.variables, [*held, *stops, *rubbing], strict=True))
        return solution

    @cached_property
    def _wrenches(self) -> dict[str, list[int]]:
        """Force and torque of each joint that is asked for, in the axes of its frame."""
        named = {s.joint for s in self.own.sensors}
        asked = [joint.name for joint in self.own.joints if joint.name in named]
        d = self.derivation.description
        # Forces that jump do so here as in the equations: a step that follows reactions goes on along one branch.
        branches = acting(d) and not (d.stops or d.frictions)
        cut = _cut(without_sensed(d if branches else self.own), asked)
        g = Graph()
        x = variables(g, cut)
        loader = make_loader(g, cut, x)
        mech = mechanics(loader, cut, Scene(loader, cut, x), x)
        needed = inverse_dynamics(loader, mech, x, x.a)
        held = constraint_forces(loader, constraints(loader, cut, x), x)
        contacts = self._contact_forces(loader, x)
        n = len(self.own.rates)
        wanted = [g.sub(g.sub(a, b), c) for a, b, c in zip(needed, held, contacts, strict=True)][n:]
        nodes = self._copied(g, wanted)
        return {name: nodes[6 * k : 6 * k + 6] for k, name in enumerate(asked)}

    def _contact_forces(self, loader: Loader, x: Variables) -> list[int]:
        """Generalised forces of stops and frictions."""
        g, m = x.g, len(x.lam)
        gaps = [loader.load(s.gap) for s in self.own.stops]
        sliding = [loader.load(speed) for f in self.own.frictions for speed in f.speeds]
        speeds = [*forward(g, gaps, loader.rates), *sliding]
        by_rate = reverse(g, [(u, g.var(LAM, m + k)) for k, u in enumerate(speeds)], V)
        return [by_rate.get(v, g.zero) for v in x.v]

    def _copied(self, own: Graph, wanted: list[int]) -> list[int]:
        """Nodes of the cut model on the model's graph, where the cut's coordinates are zero."""
        g = self.g
        counts = {Q: len(self.own.coordinates), V: len(self.own.rates), A: len(self.own.rates)}
        return copied(
            g, own, wanted, lambda kind, k: g.zero if k >= counts.get(kind, k + 1) else g.var(kind, k)
        )


def _cut(d: Description, asked: list[str]) -> Description:
    """The description with six massless joints before each of the joints that are asked for."""
    bodies, joints = list(d.bodies), list[Joint]()
    coordinates, rates = list(d.coordinates), list(d.rates)
    for joint in d.joints:
        if joint.name not in asked:
            joints.append(joint)
            continue
        parent, xyz, rpy = joint.parent, joint.xyz, joint.rpy
        for k in range(6):
            name = f"{joint.name} cut {k}"  # no name of a model has a space in it
            kind = "prismatic" if k < 3 else "revolute"
            joints.append(Joint(name, kind, parent, name, xyz, rpy, _AXES[k % 3], (), (name,), (name,)))
            bodies.append(Body(name, _ZERO))
            coordinates.append(Coordinate(name))
            rates.append(Rate(name, coordinate=name))
            parent, xyz, rpy = name, _ZERO, _ZERO
        joints.append(replace(joint, parent=parent, xyz=xyz, rpy=rpy))
    plain = replace(d, bodies=tuple(bodies), joints=tuple(joints))
    return replace(plain, coordinates=tuple(coordinates), rates=tuple(rates))
