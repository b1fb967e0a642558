"""The parts of one model's equations, each derived once and shared by the functions that use it."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

from ..model.description import Description, Friction
from ..model.sensors import acting, without_sensed
from .balances import balance_symbol
from .constraints import Constraints, constraints, dependent_constraints, rheonomic_power
from .contacts import NONE, Switches
from .dynamics import (
    Mechanics,
    cheapest_form,
    external_power,
    inverse_dynamics,
    mass_matrix,
    mechanics,
)
from .feedback import settle, with_margins
from .graph.graph import Graph
from .graph.hessian import hessian
from .graph.hoist import gather
from .graph.nodes import SparseRows, V
from .kinematics import Scene
from .load import make_loader
from .sensed import NOTHING, Sensed, Settled
from .solve import factorise as ldl
from .solve.choice import best_factors
from .solve.lifting import Lifted, lift
from .trees.articulated import solve_articulated
from .variables import Variables, variables, with_rates

LARGEST_GATHERED = 12  # rates; in larger mass matrices the search takes longer than it saves


class Derivation:
    """The parts of one model's equations on its graph, each derived once and shared by the functions that use it.

    `description` is in the form that is derived; `own` is as the user has it, without branches and switches.
    """

    def __init__(
        self,
        description: Description,
        switches: Switches = NONE,
        *,
        articulated: bool = True,
        own: Description | None = None,
    ) -> None:
        self.own = with_rates(description if own is None else own)
        self.switches = switches
        self.description = d = with_rates(description)
        self.g = g = Graph()
        self.x: Variables = variables(g, d)
        x, n = self.x, len(d.rates)
        self.loader = make_loader(g, d, x)
        self.levels = switches.levels(self.loader, d)
        self.scene = Scene(self.loader, without_sensed(d), x)
        self.bodies = self.scene.bodies
        self.mech: Mechanics = mechanics(self.loader, d, self.scene, x)
        self.mass_rows: SparseRows = _gathered(g, mass_matrix(self.loader, self.mech, x))
        self.form: Mechanics = cheapest_form(self.loader, self.mech, x, self.mass_rows)
        self.forces = [g.neg(h) for h in inverse_dynamics(self.loader, self.form, x, [g.zero] * n)]
        self._define_balances()
        self.constraints: Constraints = constraints(self.loader, d, x)
        self.jacobian_rows = self.constraints.jacobian
        names = [r.name for r in d.rates] + [c.name for c in (*d.constraints, *d.velocity_constraints)]
        self.corner = switches.corner(self.loader, d)
        opposite = {k: g.neg(node) for k, node in self.corner.items()}
        self.dependent = self._dependent() if switches is NONE else ()
        kept = self.kept
        names = names[:n] + [names[n + k] for k in kept]
        rows = [self.jacobian_rows[k] for k in kept]
        # What forces follow is differentiated, which solves by loops are not.
        self.factors = best_factors(
            g,
            self.mass_rows,
            rows,
            names,
            opposite,
            lambda: self._lifted(opposite),
            self.forces,
            by_loops=not acting(d),
        )
        gamma = [self.constraints.gamma[k] for k in kept]
        solution, self.margins = self.levels.solve(self.factors, self.forces, gamma)
        self.forces = self.levels.without(self.forces)
        if self.factors.n_nodes and not self.levels.reactions:
            solution = self._with_forces_along_velocities(solution, gamma)
        recursive = self._by_articulated_bodies() if articulated else None
        if recursive is not None and g.count([*recursive, *self.forces]) < g.count([*solution, *self.forces]):
            solution = recursive
        self.accelerations = solution[:n]
        self.multipliers = [g.zero] * len(x.lam)
        for k, value in zip(kept, solution[n:], strict=True):
            self.multipliers[k] = g.neg(value)
        self.settled: Settled = NOTHING
        if acting(d):
            self._settle()
        self.does_work = False
        power = g.add(
            external_power(self.loader, self.mech, x, self.mass_rows, self.accelerations),
            rheonomic_power(self.loader, self.constraints, x, self.multipliers),
        )
        self.power = self.levels.at([power], self.multipliers)[0]

    @cached_property
    def sensed(self) -> Sensed | None:
        """The sensors of the solved equations, if there are any."""
        return Sensed(self) if self.description.sensors else None

    def _settle(self) -> None:
        """Put what sensors tell in the place of the variables by which forces follow it."""
        self.settled = settle(self, self.sensed)
        values = self.settled.values

        def at(nodes: list[int]) -> list[int]:
            return self.g.substitute(nodes, values)

        def settled(mech: Mechanics) -> Mechanics:
            forces = at([force for _, force in mech.applied])
            applied = [(u, force) for (u, _), force in zip(mech.applied, forces, strict=True)]
            along = dict(zip(mech.generalised, at(list(mech.generalised.values())), strict=True))
            return replace(mech, applied=applied, generalised=along)

        changes = self.x.changes
        changes.update(zip(list(changes), at(list(changes.values())), strict=True))
        self.mech, self.form = settled(self.mech), settled(self.form)
        self.forces, self.margins = at(self.forces), at(self.margins)
        self.accelerations, self.multipliers = at(self.accelerations), at(self.multipliers)
        self.constraints = replace(self.constraints, gamma=at(self.constraints.gamma))
        self.description, names = with_margins(self.description, self.own, self.settled)
        for name, (_, margin) in zip(names, self.settled.margins, strict=True):
            self.loader.symbols[name] = margin

    def _define_balances(self) -> None:
        """Let the constraints of coordinates without inertia be what acts on them."""
        places = {r.coordinate: k for k, r in enumerate(self.description.rates)}
        for name in self.description.balanced:
            self.loader.symbols[balance_symbol(name).name] = self.forces[places[name]]

    @property
    def kept(self) -> list[int]:
        """The constraints that the accelerations are solved with."""
        return [k for k in range(len(self.x.lam)) if k not in self.dependent]

    def _dependent(self) -> tuple[int, ...]:
        return dependent_constraints(self.g, self.description, self.x, self.constraints, self.mass_rows)

    def rates_to_meet(self, targets: list[int]) -> list[int]:
        """The least change of rates, in the metric of M, that adds the targets to what G makes of them."""
        g, n = self.g, len(self.x.v)
        right = [*[g.zero] * n, *[targets[k] for k in self.kept]]
        return ldl.solve(g, self.factors, right)[:n]

    def _lifted(self, corner: dict[int, int]) -> Lifted | None:
        """The system behind M and G; None where M comes from trees on the world, which are gathered otherwise."""
        if any(tree.on_world for tree in self.mech.trees):
            return None
        g, v, states = self.g, self.x.v, self.x.states
        velocities = [self.constraints.velocity[k] for k in self.kept]
        reached = set(g.reachable([self.mech.kinetic, *velocities], V))
        if any(v[k] in reached for k in states):  # such a state is no velocity there
            return None
        n = len(v)
        diagonal = dict.fromkeys(states, g.one) | {n + k: node for k, node in corner.items()}
        return lift(g, self.mech.kinetic, velocities, v, diagonal)

    def _with_forces_along_velocities(self, solution: list[int], gamma: list[int]) -> list[int]:
        """The solution with forces where they act, along velocities, or as it is given, where that costs less."""
        g, states = self.g, {self.x.v[k] for k in self.x.states}
        apart = {u: g.zero for u in self.factors.velocities if u not in states}
        rest = inverse_dynamics(self.loader, self.form, self.x, [g.zero] * len(self.x.v), apart)
        right = [*(g.neg(h) for h in rest), *gamma]
        other = ldl.solve(g, self.factors, right, {u: g.neg(h) for u, h in apart.items()})
        return min(solution, other, key=g.count)

    def _by_articulated_bodies(self) -> list[int] | None:
        """Accelerations along the trees, where nothing but single joints' inertia adds to theirs."""
        g, x = self.g, self.x
        trees = self.form.trees
        if not trees or x.lam or not all(tree.on_world for tree in trees):
            return None
        rest = hessian(g, self.mech.kinetic, x.v)
        for k in x.states:
            rest[k][k] = g.one
        if any(entry != g.zero for i, row in enumerate(rest) for k, entry in enumerate(row) if i != k):
            return None
        return solve_articulated(g, trees, [row[i] for i, row in enumerate(rest)], self.forces)

    def sliding(self, friction: Friction) -> list[int]:
        """What a friction that slides exerts against each of its speeds, in this form."""
        nodes = [self.loader.load(force) for force in self.switches.sliding(friction)]
        return self.levels.at(nodes, self.multipliers)

    @property
    def conservative(self) -> bool:
        """Whether nothing but the gradient of V does work, with all stops open or closed; and there are no states."""
        return not self.does_work and self.power == self.g.zero and not self.x.states


def _gathered(g: Graph, rows: SparseRows) -> SparseRows:
    """The matrix with the parameters in its products gathered: some entries are seen to be zero only then."""
    if len(rows) > LARGEST_GATHERED:
        return rows
    entries = iter(gather(g, tuple(entry for row in rows for entry in row.values())))
    gathered = [{k: next(entries) for k in row} for row in rows]
    return [{k: entry for k, entry in row.items() if entry != g.zero} for row in gathered]
