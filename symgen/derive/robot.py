"""What robot programs call, derived on demand: a program of its own, with the functions that were asked for only.

Forces of inputs are left out everywhere: what inverse dynamics gives is what motors have to do. Dry friction and stops
are left out, too, since nothing at a state says which of their branches holds. Loops are open in all functions but
`forward_dynamics` and `equilibrium_torques`.

Derivatives by positions are by displacements δq = N w along the rates, so that they have as many columns as there are
rates. Vectors are in world axes, linear components before angular ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..errors import ModelError, nearest
from ..model.description import Description, Frame
from ..model.sensors import acting
from .constraints import Constraints, constraints, dependent_constraints
from .dynamics import (
    LARGEST_QUADRATIC_FORM,
    Mechanics,
    cheapest_form,
    inverse_dynamics,
    mass_matrix,
    mechanics,
    residual_by_state,
)
from .graph.differentiate import forward, sparse_jacobian
from .graph.evaluate import evaluate
from .graph.graph import Graph
from .graph.hessian import hessian
from .graph.hoist import gather
from .graph.nodes import INPUT, PARAM, VIRTUAL, Q, SparseRows
from .graph.vectors import Inertia, Matrix, Vector, cross, minus, plus, product, scaled, times, zeros
from .header import robot_header
from .kinematics import Scene
from .load import make_loader
from .program import Function, Program
from .robot_request import RobotRequest
from .solve import factorise as ldl
from .solve.columns import solve_columns
from .trees.articulated import solve_articulated
from .trees.derivatives import derivatives_along_rates
from .trees.links import Link, roll_pitch_yaw, unmoved
from .trees.recursive import Tree
from .variables import Variables, variables, with_rates

WORLD = "world"
LARGEST_WRITTEN = (
    96  # rows of a matrix whose factors are written out, zeros left out, to solve for many columns
)
_NO_CONSTRAINTS = Constraints([], [], [], [])
_SAMPLES = 3  # times as many numbers as columns, of a regressor that is looked through for dependent ones
_DEPENDENT = 1e-9  # of the largest column: what is left of a column that follows from others
_ROUND_OFF = 1e-12  # of a column's coefficient


def derive_robot(description: Description, request: RobotRequest, source: str = "") -> Program:
    """Derive the functions that are asked for, and nothing else.

    Parameters
    ----------
    description : Description
        A checked description.
    request : RobotRequest
    source : str
        Hash of the model's text, kept in the header.

    Raises
    ------
    ModelError
        An unknown frame or actuator, or a function that this model cannot have, with the reason.
    """
    robot = _Robot(description, request)
    functions = [replace(f, outputs=gather(robot.g, f.outputs)) for f in robot.functions()]
    program = Program(robot.g, tuple(functions), {})
    made = {
        "functions": [f.name for f in functions],
        "frames": list(request.frames),
        "base_parameters": robot.base_names if "regressor" in request.functions else [],
        "actuators": robot.actuators if "equilibrium_torques" in request.functions else [],
    }
    head = robot_header(robot.d, robot.x, source, program.operations(), made)
    return replace(program, header=head)


class _Robot:
    """The parts of a robot's equations, each derived when a function first needs it."""

    def __init__(self, description: Description, request: RobotRequest) -> None:
        self.d = d = with_rates(replace(description, stops=(), frictions=()))
        self.request = request
        self.g = g = Graph()
        self.x: Variables = variables(g, d)
        if self.x.states:
            raise ModelError(
                "functions for robot programs know no first-order states",
                hint="leave the actuators' dynamics to a model of their own",
            )
        for name in acting(d):
            raise ModelError(
                f"functions for robot programs know no forces that follow what is measured, as {name}",
                hint="leave the controller to a model of its own",
            )
        self.loader = make_loader(g, d, self.x)
        self.scene = Scene(self.loader, d, self.x)
        self.torque = [g.var(VIRTUAL, k) for k in range(len(d.rates))]
        self.inputs = {u.name: g.var(INPUT, k) for k, u in enumerate(d.inputs)}
        self.driven: Mechanics = mechanics(self.loader, d, self.scene, self.x)
        self.mech: Mechanics = self._without_inputs(self.driven)

    def functions(self) -> Iterator[Function]:
        """The functions asked for, in the order of the table, then those of frames."""
        made: dict[str, Callable[[], Iterator[Function]]] = {
            "inverse_dynamics": self._inverse_dynamics,
            "inverse_dynamics_derivatives": self._inverse_derivatives,
            "forward_dynamics": self._forward_dynamics,
            "forward_dynamics_derivatives": self._forward_derivatives,
            "mass_matrix": self._mass_matrix,
            "coriolis_matrix": self._coriolis_matrix,
            "gravity": self._gravity,
            "energy": self._energy,
            "centre_of_mass": self._centre_of_mass,
            "momentum": self._momentum,
            "momentum_matrix": self._momentum_matrix,
            "regressor": self._regressor,
            "equilibrium_torques": self._equilibrium,
        }
        for name, make in made.items():
            if name in self.request.functions:
                yield from make()
        for frame in self.request.frames:
            yield from self._frame(frame)

    # Dynamics

    @cached_property
    def trees(self) -> list[Tree]:
        """The trees on the world, whose algorithms are recursive."""
        return [tree for tree in self.form.trees if tree.on_world]

    @cached_property
    def mass_rows(self) -> SparseRows:
        return mass_matrix(self.loader, self.mech, self.x)

    @cached_property
    def form(self) -> Mechanics:
        if len(self.x.v) > LARGEST_QUADRATIC_FORM:
            return self.mech
        return cheapest_form(self.loader, self.mech, self.x, self.mass_rows)

    def _without_inputs(self, mech: Mechanics) -> Mechanics:
        """The mechanics with all inputs at zero where they make forces."""
        g, none = self.g, dict.fromkeys(self.inputs.values(), self.g.zero)
        applied = g.substitute([force for _, force in mech.applied], none)
        generalised = g.substitute(list(mech.generalised.values()), none)
        potential, dissipation, V = g.substitute([mech.potential, mech.dissipation, mech.energy[1]], none)
        return replace(
            mech,
            applied=[(u, force) for (u, _), force in zip(mech.applied, applied, strict=True)],
            generalised=dict(zip(mech.generalised, generalised, strict=True)),
            potential=potential,
            dissipation=dissipation,
            energy=(mech.energy[0], V),
        )

    def forces_for(self, accelerations: list[int]) -> list[int]:
        """M a + h of given accelerations, without inputs."""
        return inverse_dynamics(self.loader, self.form, self.x, accelerations)

    @cached_property
    def bias(self) -> list[int]:
        return self.forces_for([self.g.zero] * len(self.x.v))

    @cached_property
    def at_rest(self) -> list[int]:
        """The forces that hold the robot still."""
        return self.g.substitute(self.bias, dict.fromkeys(self.x.v, self.g.zero))

    @cached_property
    def constraints(self) -> Constraints:
        return constraints(self.loader, self.d, self.x)

    @cached_property
    def kept(self) -> list[int]:
        """The constraints that do not follow from others."""
        if not self.x.lam:
            return []
        left_out = dependent_constraints(self.g, self.d, self.x, self.constraints, self.mass_rows)
        return [k for k in range(len(self.x.lam)) if k not in left_out]

    @cached_property
    def names(self) -> list[str]:
        held = (*self.d.constraints, *self.d.velocity_constraints)
        return [r.name for r in self.d.rates] + [held[k].name for k in self.kept]

    @cached_property
    def factors(self) -> ldl.Factors:
        return self._factorised()

    def _factorised(self, by_loops: bool = True) -> ldl.Factors:
        rows = [self.constraints.jacobian[k] for k in self.kept] if self.x.lam else []
        return ldl.factorise(self.g, self.mass_rows, rows, self.names, by_loops=by_loops)

    @cached_property
    def motion(self) -> tuple[list[int], list[int]]:
        """Accelerations for the torques, in whichever way costs less, and multipliers."""
        g, n = self.g, len(self.x.v)
        right = [g.sub(u, h) for u, h in zip(self.torque, self.bias, strict=True)]
        gamma = [self.constraints.gamma[k] for k in self.kept] if self.x.lam else []
        solution = ldl.solve(g, self.factors, [*right, *gamma])
        recursive = self._by_articulated_bodies(right)
        if recursive is not None and g.count([*recursive, *right]) < g.count([*solution, *right]):
            return recursive, []
        multipliers = [g.zero] * len(self.x.lam)
        for k, value in zip(self.kept, solution[n:], strict=True):
            multipliers[k] = g.neg(value)
        return solution[:n], multipliers

    def _by_articulated_bodies(self, right: list[int]) -> list[int] | None:
        if not self.trees or self.x.lam or len(self.trees) < len(self.form.trees):
            return None
        rest = hessian(self.g, self.mech.kinetic, self.x.v)
        if any(entry != self.g.zero for i, row in enumerate(rest) for k, entry in enumerate(row) if i != k):
            return None
        return solve_articulated(self.g, self.trees, [row[i] for i, row in enumerate(rest)], right)

    def _inverse_dynamics(self) -> Iterator[Function]:
        doc = "Forces along the rates for accelerations a."
        yield Function("inverse_dynamics", doc, tuple(self.forces_for(self.x.a)))

    def _inverse_derivatives(self) -> Iterator[Function]:
        doc = "Derivatives of inverse_dynamics by displacements along the rates, then by rates, row by row."
        rows = self._by_displacements(self.x.a)
        yield Function.matrix("inverse_dynamics_derivatives", doc, rows, 2 * len(self.x.v))

    def _by_displacements(self, accelerations: list[int], multipliers: list[int] | None = None) -> SparseRows:
        """Derivatives of M a + h by δq = N w and by v, with `a` held.

        With multipliers those of M a + h - Gᵀ λ and, in rows behind, of G a - γ.
        """
        g, x, n = self.g, self.x, len(self.x.v)
        rest = replace(self.form, trees=[tree for tree in self.form.trees if not tree.on_world])
        if multipliers:
            by_state = residual_by_state(self.loader, rest, self.constraints, x)
        else:
            by_state = residual_by_state(self.loader, rest, _NO_CONSTRAINTS, replace(x, lam=[]))
        moved = [x.displacement([g.one if k == i else g.zero for k in range(n)]) for i in range(n)]
        steps = [{k: along[q] for k, q in enumerate(x.q) if along[q] != g.zero} for along in moved]
        rows: SparseRows = []
        for entries in by_state:
            row = {n + k - len(x.q): node for k, node in entries.items() if k >= len(x.q)}
            for i, step in enumerate(steps):
                row[i] = g.sum(g.mul(entries[k], by) for k, by in step.items() if k in entries)
            rows.append(row)
        flat = [(i, k) for i, row in enumerate(rows) for k in row]
        known = dict(zip(x.a, accelerations, strict=True)) | dict(
            zip(x.lam, multipliers or x.lam, strict=True)
        )
        values = g.substitute([rows[i][k] for i, k in flat], known)
        for (i, k), node in zip(flat, values, strict=True):
            rows[i][k] = node
        for tree in self.trees:
            for i, (by_q, by_v) in derivatives_along_rates(tree, accelerations).items():
                for first, found in ((0, by_q), (n, by_v)):
                    for k, node in found.items():
                        rows[i][first + k] = g.add(rows[i].get(first + k, g.zero), node)
        return [{k: row[k] for k in sorted(row) if row[k] != g.zero} for row in rows]

    def _forward_dynamics(self) -> Iterator[Function]:
        held = ", with its loops closed" if self.x.lam else ""
        yield Function(
            "forward_dynamics", f"Accelerations for forces tau along the rates{held}.", tuple(self.motion[0])
        )

    def _forward_derivatives(self) -> Iterator[Function]:
        g, n = self.g, len(self.x.v)
        by_state = self._by_displacements(*self.motion)
        solved = [*by_state[:n], *(by_state[n + k] for k in self.kept)]
        right = [{j: g.neg(node) for j, node in row.items()} for row in solved]
        for i in range(n):
            right[i][2 * n + i] = g.one
        name = "forward_dynamics_derivatives"
        doc = "Derivatives of forward_dynamics by displacements, by rates, and by forces (the inverse of M)."
        if len(right) <= LARGEST_WRITTEN:
            found = solve_columns(self._factorised(by_loops=False), right, 3 * n, n)
            if found is not None:
                columns, written = found
                yield Function(name, doc, tuple(written.values()), tuple(written), columns=columns)
                return
        rows: SparseRows = [{} for _ in range(n)]
        for j in range(3 * n):
            column = [row.get(j, g.zero) for row in right]
            if any(node != g.zero for node in column):
                for i, node in enumerate(ldl.solve(g, self.factors, column)[:n]):
                    if node != g.zero:
                        rows[i][j] = node
        yield Function.matrix(name, doc, rows, 3 * n)

    def _mass_matrix(self) -> Iterator[Function]:
        yield Function.matrix("mass_matrix", "Mass matrix M, row by row.", self.mass_rows, len(self.x.v))

    def _coriolis_matrix(self) -> Iterator[Function]:
        """C with C v = h and dM/dt = C + Cᵀ: that of the metric's own (Levi-Civita) connection.

        The forces h are quadratic in the rates, and symmetric coefficients of theirs are half their derivatives by v.
        What the angular velocities of quaternions, which do not commute, add is M [ω]× / 2 (Koszul's formula).
        """
        g, x, n = self.g, self.x, len(self.x.v)
        if any(g.mask[entry] & ~(PARAM | Q) for row in self.mass_rows for entry in row.values()):
            raise ModelError("coriolis_matrix: the kinetic energy depends on time or inputs")
        inertial = replace(
            self.form,
            applied=[], generalised={}, dissipation=g.zero, potential=g.zero,
            trees=[tree for tree in self.form.trees if not tree.on_world],
        )  # fmt: skip
        rest = inverse_dynamics(self.loader, inertial, x, [g.zero] * n)
        rows = [dict(row) for row in sparse_jacobian(g, rest, x.v)]
        for tree in self.trees:
            for i, (_, by_v) in derivatives_along_rates(tree, [g.zero] * n).items():
                for k, node in by_v.items():
                    rows[i][k] = g.add(rows[i].get(k, g.zero), node)
        for _, first in x.quaternions:
            omega = x.v[first : first + 3]
            for row, inertia in zip(rows, self.mass_rows, strict=True):
                turning = [inertia.get(first + k, g.zero) for k in range(3)]
                # The row times [ω]× is (ω × rowᵀ)ᵀ with the other sign.
                for k, node in enumerate(cross(g, turning, omega)):
                    row[first + k] = g.add(row.get(first + k, g.zero), node)
        half = g.const(0.5)
        rows = [{k: g.mul(half, row[k]) for k in sorted(row) if row[k] != g.zero} for row in rows]
        yield Function.matrix(
            "coriolis_matrix", "C of the forces C v, with dM/dt = C + C^T, row by row.", rows, n
        )

    def _gravity(self) -> Iterator[Function]:
        yield Function("gravity", "Forces along the rates that hold it at rest.", tuple(self.at_rest))

    def _energy(self) -> Iterator[Function]:
        yield Function("energy", "Kinetic and potential energy.", self.mech.energy)

    # The robot as a whole

    @cached_property
    def _centre(self) -> tuple[int, Vector]:
        """Mass of the bodies that move, and their centre."""
        g = self.g
        total, moment = g.zero, zeros(g)
        for b in self.scene.bodies:
            pose = [*b.position, *(entry for row in b.rotation for entry in row)]
            if b.body.mass is None or not any(g.mask[node] & ~PARAM for node in pose):
                continue
            mass = self.loader.load(b.body.mass)
            total, moment = g.add(total, mass), plus(g, moment, scaled(g, mass, b.position))
        if total == g.zero:
            raise ModelError("the robot's centre: no body that moves has mass")
        return total, scaled(g, g.div(g.one, total), moment)

    def _centre_of_mass(self) -> Iterator[Function]:
        doc = "Centre of mass of the bodies that move."
        yield Function("centre_of_mass", doc, tuple(self._centre[1]))

    def _about_centre(self, linear: Vector, angular: Vector) -> Vector:
        """Momentum, and angular momentum about the centre of mass instead of the world's origin."""
        return [*linear, *minus(self.g, angular, cross(self.g, self._centre[1], linear))]

    def _momentum(self) -> Iterator[Function]:
        """Momentum of all bodies, those of trees gathered from the last links to the base."""
        g = self.g
        linear, angular = zeros(g), zeros(g)
        for b in self.mech.bodies:
            own = scaled(g, b.mass, b.velocity)
            linear, angular = plus(g, linear, own), plus(g, angular, cross(g, b.position, own))
            if b.omega is not None and b.inertia is not None:
                angular = plus(g, angular, times(g, b.rotation, times(g, b.inertia, b.omega)))
        for tree in self.scene.trees:
            of_tree = self._tree_momentum(tree)
            linear, angular = plus(g, linear, of_tree[0]), plus(g, angular, of_tree[1])
        doc = "Momentum, and angular momentum about the centre of mass, in world axes."
        yield Function("momentum", doc, tuple(self._about_centre(linear, angular)))

    def _tree_momentum(self, tree: Tree) -> tuple[Vector, Vector]:
        g = self.g
        carried = [
            link.inertia.momentum_of(g, spin, velocity)
            for link, spin, velocity in zip(tree.links, tree.spin, tree.velocities, strict=True)
        ]
        for k in reversed(tree.moving()):
            p, up = tree.links[k].parent, tree.to_parent(k, carried[k])
            carried[p] = (plus(g, carried[p][0], up[0]), plus(g, carried[p][1], up[1]))
        linear, angular = (times(g, tree.base.rotation, part) for part in carried[0])
        return linear, plus(g, angular, cross(g, tree.base.position, linear))

    def _momentum_matrix(self) -> Iterator[Function]:
        """The centroidal momentum matrix (Orin, Goswami and Lee 2013), by the composite body behind each joint."""
        g, n = self.g, len(self.x.v)
        if not self.scene.trees or self.mech.bodies or not all(t.on_world for t in self.scene.trees):
            raise ModelError("momentum_matrix is that of trees of joints that stand on the world")
        columns: dict[int, Vector] = {}
        for tree in self.scene.trees:
            for k in tree.moving():
                for rate, wrench in zip(tree.links[k].rates, tree.unit_wrenches(k), strict=True):
                    j = k
                    while j:
                        wrench, j = tree.to_parent(j, wrench), tree.links[j].parent
                    columns[rate] = self._about_centre(*wrench)
        rows: SparseRows = [{} for _ in range(6)]
        for rate in sorted(columns):
            for i, node in enumerate(columns[rate]):
                if node != g.zero:
                    rows[i][rate] = node
        doc = "Momentum and angular momentum about the centre of mass per unit of each rate, row by row."
        yield Function.matrix("momentum_matrix", doc, rows, n)

    # Inertial parameters

    @cached_property
    def _standard(self) -> tuple[list[str], list[dict[int, int]], list[int]]:
        """Names, columns of the regressor (forces by rates) and values of the links' parameters that matter.

        Links hand what their joints do not move to their parents first, so most of what no motion tells apart is
        gone. Values of zero count: the body of somebody else's robot may have others.
        """
        g = self.g
        if not self.scene.trees or self.mech.bodies or not all(tree.on_world for tree in self.scene.trees):
            raise ModelError("regressor is that of trees of joints that stand on the world")
        names: list[str] = []
        columns: list[dict[int, int]] = []
        values: list[int] = []
        for tree in self.scene.trees:
            motion = tree.motion(self.x.a)
            with_body = {place.link for place in tree.places.values()}
            for k in tree.moving():
                link = tree.links[k]
                for key, unit, value in _units(g, link, k in with_body):
                    wrench = unit.wrench(
                        g, tree.spin[k], motion.gradient[k], motion.alpha[k], motion.acceleration[k]
                    )
                    column, j = {}, k
                    while j:
                        along = tree.along_joint(j, wrench)
                        column |= {
                            r: f for r, f in zip(tree.links[j].rates, along, strict=True) if f != g.zero
                        }
                        wrench, j = tree.to_parent(j, wrench), tree.links[j].parent
                    if column:
                        names.append(f"{self.d.rates[link.rates[-1]].name}.{key}")
                        columns.append(column)
                        values.append(value)
        return names, columns, values

    @cached_property
    def _base(self) -> tuple[list[int], dict[int, dict[int, float]]]:
        """Columns that are kept, and what those that follow from them add to their parameters (Gautier 1991).

        Coefficients are found by numbers, so only where the columns know no parameters.
        """
        _, columns, _ = self._standard
        g, n = self.g, len(self.x.v)
        nodes = [node for column in columns for node in column.values()]
        if any(g.mask[node] & PARAM for node in nodes):
            return list(range(len(columns))), {}
        rng = np.random.default_rng(20131)
        W = np.zeros((0, len(columns)))
        while len(W) < _SAMPLES * len(columns) + n:
            given = {node: rng.uniform(-2, 2) for node in (*self.x.q, *self.x.v, *self.x.a, self.x.t)}
            for k, _ in self.x.quaternions:
                turn = rng.normal(size=4)
                given |= dict(zip(self.x.q[k : k + 4], (turn / np.linalg.norm(turn)).tolist(), strict=True))
            given |= dict.fromkeys(self.inputs.values(), 0.0)
            found = iter(evaluate(g, nodes, given))
            block = np.zeros((n, len(columns)))
            for j, column in enumerate(columns):
                for i in column:
                    block[i, j] = next(found)
            W = np.vstack([W, block])
        return _independent(W)

    @cached_property
    def base_names(self) -> list[str]:
        """Names of the base parameters: of the one of each group that leads it."""
        names = self._standard[0]
        return [names[k] for k in self._base[0]]

    def _regressor(self) -> Iterator[Function]:
        g = self.g
        _, columns, values = self._standard
        kept, adds = self._base
        rows: SparseRows = [{} for _ in self.x.v]
        for j, k in enumerate(kept):
            for i, node in columns[k].items():
                rows[i][j] = node
        doc = "Forces of inertia and gravity per unit of each base parameter, row by row."
        yield Function.matrix("regressor", doc, rows, len(kept))
        base = [
            g.add(
                values[k],
                g.sum(g.mul(g.const(factor), values[other]) for other, factor in adds.get(k, {}).items()),
            )
            for k in kept
        ]
        yield Function(
            "base_parameters", "The base parameters: sums of the links' inertial parameters.", tuple(base)
        )

    # Loops at rest

    @cached_property
    def actuators(self) -> list[str]:
        names = list(self.request.actuators) or list(self.inputs)
        for name in names:
            if name not in self.inputs:
                raise ModelError(f"there is no input {name!r:.60}", hint=nearest(name[:60], self.inputs))
        if not names:
            raise ModelError("equilibrium_torques needs inputs, and the model has none")
        return names

    def _equilibrium(self) -> Iterator[Function]:
        """The least u with B u + Gᵀ λ = g(q): B Bᵀ w + Gᵀ λ = g with G w = 0, and u = Bᵀ w.

        As G w = 0, Gᵀ G may be added to B Bᵀ, which makes it positive definite where actuators and loops hold all.
        """
        g, n = self.g, len(self.x.v)
        forces = [g.neg(h) for h in inverse_dynamics(self.loader, self.driven, self.x, [g.zero] * n)]
        forces = g.substitute(forces, dict.fromkeys(self.x.v, g.zero))
        by_input = sparse_jacobian(g, forces, [self.inputs[name] for name in self.actuators])
        if any(g.mask[node] & INPUT for row in by_input for node in row.values()):
            raise ModelError("equilibrium_torques: a force is no linear function of the inputs")
        G = [self.constraints.jacobian[k] for k in self.kept] if self.x.lam else []
        weights: SparseRows = [{} for _ in range(n)]
        for row in (*_columns(by_input, len(self.actuators)), *G):
            for i, a in row.items():
                for j, b in row.items():
                    weights[i][j] = g.add(weights[i].get(j, g.zero), g.mul(a, b))
        for name, row in zip(self.names, weights, strict=False):
            if not row:
                raise ModelError(
                    f"equilibrium_torques: neither an actuator nor a loop holds {name!r}",
                    hint="name more actuators, or fix the base",
                )
        factors = ldl.factorise(g, weights, G, self.names)
        w = ldl.solve(g, factors, [*self.at_rest, *[g.zero] * len(G)])[:n]
        held = [
            g.sum(g.mul(node, w[i]) for i, row in enumerate(by_input) if (node := row.get(j)) is not None)
            for j in range(len(self.actuators))
        ]
        doc = "Least values of the actuators' inputs that hold it at rest."
        yield Function("equilibrium_torques", doc, tuple(held))

    # Frames

    def _frame(self, name: str) -> Iterator[Function]:
        n = len(self.x.v)
        frame = self._frame_named(name)
        pose = [*frame.position, *(entry for row in frame.rotation for entry in row)]
        yield Function(f"pose_{name}", f"Origin and rotation matrix of {name} (to world axes).", tuple(pose))
        doc = f"Velocity of the origin and angular velocity of {name} per unit of each rate, row by row."
        yield Function.matrix(f"jacobian_{name}", doc, frame.jacobian, n)
        doc = f"Time derivative of jacobian_{name}, row by row."
        yield Function.matrix(f"jacobian_rate_{name}", doc, frame.rate, n)
        doc = f"Acceleration and angular acceleration of {name} while no rate changes: dJ/dt v."
        yield Function(f"drift_{name}", doc, tuple(frame.drift))

    def _frame_named(self, name: str) -> _MovingFrame:
        bodies = {b.name: b for b in self.d.bodies}
        frames = {f.name: f for f in self.d.frames}
        if name in bodies:
            found = Frame(name, name, (0, 0, 0), (0, 0, 0))
        elif name in frames:
            found = frames[name]
        else:
            known = [*bodies, *frames]
            raise ModelError(f"there is no body or frame {name!r:.60}", hint=nearest(name[:60], known))
        g = self.g
        at = [self.loader.load(e) if e else g.zero for e in found.at]
        at += [g.zero] * (3 - len(at))
        turn = roll_pitch_yaw(g, [self.loader.load(e) if e else g.zero for e in found.rpy])
        tree = next((t for t in self.scene.trees if found.body in t.places and t.on_world), None)
        if tree is not None and found.body != WORLD:
            return _of_tree(self.x, tree, found.body, at, turn)
        return self._by_hand(found.body, at, turn)

    def _by_hand(self, body: str, at: Vector, turn: Matrix) -> _MovingFrame:
        """A frame in a body that no tree on the world has: by derivatives."""
        g, x = self.g, self.x
        b = next((b for b in self.scene.bodies if b.body.name == body), None)
        if b is None:
            raise ModelError(f"frame in {body!r}: the world does not move")
        if b.velocity is None:
            raise ModelError(f"frame in {body!r}: its tree stands on a body that is placed by hand")
        arm = times(g, b.rotation, at)
        spin = times(g, b.rotation, b.omega) if b.omega is not None else zeros(g)
        twist = [*plus(g, b.velocity, cross(g, spin, arm)), *spin]
        jacobian = sparse_jacobian(g, twist, x.v)
        motion = x.variable_motion([g.zero] * len(x.v))
        places = [(i, k) for i, row in enumerate(jacobian) for k in row]
        rate: SparseRows = [{} for _ in range(6)]
        for (i, k), node in zip(places, forward(g, [jacobian[i][k] for i, k in places], motion), strict=True):
            if node != g.zero:
                rate[i][k] = node
        return _MovingFrame(
            plus(g, b.position, arm), product(g, b.rotation, turn), jacobian, rate, forward(g, twist, motion)
        )


@dataclass(frozen=True)
class _MovingFrame:
    """A frame's pose, its Jacobian (linear rows first) with its time derivative, and dJ/dt v."""

    position: Vector
    rotation: Matrix
    jacobian: SparseRows
    rate: SparseRows
    drift: Vector


def _of_tree(x: Variables, tree: Tree, body: str, at: Vector, turn: Matrix) -> _MovingFrame:
    """A frame in a tree that stands on the world, by the axes of the joints below it."""
    g, place = x.g, tree.places[body]
    rotations, positions = tree.poses
    arm = plus(g, place.origin, times(g, place.rotation, at))
    own = rotations[place.link]
    origin = plus(g, positions[place.link], times(g, own, arm))
    local = plus(g, tree.velocities[place.link], cross(g, tree.spin[place.link], arm))
    velocity = times(g, own, local)
    jacobian: SparseRows = [{} for _ in range(6)]
    rate: SparseRows = [{} for _ in range(6)]
    k = place.link
    while k:
        link, R = tree.links[k], rotations[k]
        reach = minus(g, origin, positions[k])
        opening = minus(g, velocity, times(g, R, tree.velocities[k]))
        spin = times(g, R, tree.spin[k])
        for i, (turning, sliding) in zip(link.rates, link.subspace, strict=True):
            axis, slide = times(g, R, turning), times(g, R, sliding)
            turned, slid = cross(g, spin, axis), cross(g, spin, slide)
            column = [*plus(g, slide, cross(g, axis, reach)), *axis]
            change = plus(g, plus(g, slid, cross(g, turned, reach)), cross(g, axis, opening))
            for rows, entries in ((jacobian, column), (rate, [*change, *turned])):
                for row, node in zip(rows, entries, strict=True):
                    if node != g.zero:
                        row[i] = node
        k = link.parent
    motion = tree.motion([g.zero] * len(x.v))
    swept = plus(g, motion.acceleration[place.link], times(g, motion.gradient[place.link], arm))
    drift = [*plus(g, times(g, own, swept), tree.gravity), *times(g, own, motion.alpha[place.link])]
    jacobian, rate = ([dict(sorted(row.items())) for row in rows] for rows in (jacobian, rate))
    return _MovingFrame(origin, product(g, product(g, own, place.rotation), turn), jacobian, rate, drift)


def _units(g: Graph, link: Link, has_body: bool) -> Iterator[tuple[str, Inertia, int]]:
    """The parameters of a link that its joint moves: their names, a body with a unit of each alone, their values.

    Of a link without a body of its own, which stands between the axes of one joint, only what was handed to it.
    """
    inertia, nothing = link.inertia, Inertia.nothing(g)
    handed_on = unmoved(g, Link(0, link.turn, zeros(g), g.zero, link.subspace, [], _everything(g)))
    moved = _everything(g).minus(g, handed_on)
    if (has_body and moved.mass != g.zero) or inertia.mass != g.zero:
        yield "m", replace(nothing, mass=g.one), inertia.mass
    for k, letter in enumerate("xyz"):
        if (has_body and moved.first[k] != g.zero) or inertia.first[k] != g.zero:
            unit = [g.one if i == k else g.zero for i in range(3)]
            yield f"m{letter}", replace(nothing, first=unit), inertia.first[k]
    for i in range(3):
        for j in range(i, 3):
            if (has_body and moved.tensor[i][j] != g.zero) or inertia.tensor[i][j] != g.zero:
                unit = [zeros(g) for _ in range(3)]
                unit[i][j] = unit[j][i] = g.one
                yield f"I{'xyz'[i]}{'xyz'[j]}", replace(nothing, tensor=unit), inertia.tensor[i][j]


def _everything(g: Graph) -> Inertia:
    """Ten parameters of which none is another."""
    numbers = iter([g.const(float(k)) for k in range(2, 12)])
    tensor = [[g.zero] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(i, 3):
            tensor[i][j] = tensor[j][i] = next(numbers)
    return Inertia(next(numbers), [next(numbers) for _ in range(3)], tensor)


def _independent(W: np.ndarray) -> tuple[list[int], dict[int, dict[int, float]]]:
    """Columns of a matrix that are independent of those before, and what the others add to these."""
    kept: list[int] = []
    left = W.copy()
    sizes = np.linalg.norm(W, axis=0)
    for k in range(W.shape[1]):
        length = float(np.linalg.norm(left[:, k]))
        if length <= _DEPENDENT * (sizes[k] or 1.0):
            continue
        kept.append(k)
        along = left[:, k] / length
        left[:, k + 1 :] -= np.outer(along, along @ left[:, k + 1 :])
    others = [k for k in range(W.shape[1]) if k not in kept and sizes[k] > 0.0]
    adds: dict[int, dict[int, float]] = {}
    if others:
        coefficients = np.linalg.lstsq(W[:, kept], W[:, others], rcond=None)[0]
        for i, k in enumerate(kept):
            found = {
                other: float(coefficients[i, j])
                for j, other in enumerate(others)
                if abs(coefficients[i, j]) > _ROUND_OFF
            }
            if found:
                adds[k] = found
    return kept, adds


def _columns(rows: SparseRows, count: int) -> list[Mapping[int, int]]:
    """The columns of a matrix that is given by rows."""
    return [{i: row[j] for i, row in enumerate(rows) if j in row} for j in range(count)]
