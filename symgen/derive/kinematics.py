"""Positions, rotations and velocities of the bodies on the graph, and the names that points and axes give to them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ..errors import ModelError
from ..model import algebra
from ..model.description import Axis, Body, Description, Point
from .graph.nodes import Q, V
from .graph.vectors import Matrix, Vector, cross, plus, product, times, transposed_times, zeros
from .load import Loader
from .trees.links import build_links, inertia_tensor, joints_by_base
from .trees.recursive import BaseMotion, Tree
from .variables import Mark, Variables

AXES = {"x": 0, "y": 1, "z": 2}
WORLD = "world"


@dataclass(frozen=True)
class BodyKinematics:
    """A body's motion; all vectors have three components.

    `position` is of the centre of mass; `rotation` turns body axes into world axes. `omega` is the angular velocity in
    body axes, None for a point mass. `velocity`, `mass` and `inertia`, the 3 x 3 tensor about the centre of mass in
    body axes, are those of a body that is placed by hand; one in a tree of joints has its dynamics there, and None
    for a velocity.
    """

    body: Body
    position: Vector
    velocity: Vector | None
    rotation: Matrix
    omega: Vector | None
    mass: int
    inertia: Matrix | None


class Scene:
    """The bodies of a description, in its order, and their trees of joints.

    Definitions, bodies placed by hand, and points and axes in these may each use the names of others: they are taken up
    as what they use becomes known.
    """

    def __init__(self, loader: Loader, description: Description, x: Variables) -> None:
        self.loader, self.g, self.d, self.x = loader, loader.g, description, x
        self.by_hand: dict[str, BodyKinematics] = {}
        self.trees: list[Tree] = []
        self._tree_of: dict[str, Tree] = {}
        self._body = {b.name: b for b in description.bodies}
        self._joints = joints_by_base(description)
        self._base_of = {j.child: base for base, joints in self._joints.items() for j in joints}
        self._take_up_names()
        self.bodies = [self._kinematics(b) for b in description.bodies]
        gravity = [loader.load(e) for e in description.gravity] if description.gravity else zeros(self.g)
        self.gravity = gravity
        self.uniform_gravity = not any(self.g.mask[e] & (Q | V) for e in gravity)
        for tree in self.trees:
            tree.gravity = gravity if self.uniform_gravity else zeros(self.g)

    def _take_up_names(self) -> None:
        """Define names, and place what carries joints, points or axes, in an order in which each knows what it uses."""
        d, known = self.d, self.loader.symbols
        vectors = (*d.points, *d.axes)
        bases = dict.fromkeys([*self._joints, *(self._base_of.get(p.body, p.body) for p in vectors)])
        if not bases:
            for name, expression in d.definitions:
                self.loader.define(name, expression)
            return
        waiting = [(name, None, _names([expression])) for name, expression in d.definitions]
        waiting += [(None, base, _names(self._placing(base))) for base in bases]
        expressions = dict(d.definitions)
        later = {name for name, _ in d.definitions} | {f"{p.name}_{c}" for p in vectors for c in AXES}
        while waiting:
            unknown = later - known.keys()
            ready = [item for item in waiting if unknown.isdisjoint(item[2])]
            if not ready:
                stuck = ", ".join(name or base for name, base, _ in waiting)
                raise ModelError(
                    f"definitions, points and the bodies that carry them go round in a circle: {stuck}",
                    hint="write one of them without the others",
                )
            for item in ready:
                name, base, _ = item
                if name is None:
                    self._place_base(base)
                else:
                    self.loader.define(name, expressions[name])
            waiting = [item for item in waiting if not unknown.isdisjoint(item[2])]

    def _placing(self, base: str) -> list[algebra.Expr]:
        """The expressions that place a base, the tree on it, and the points and axes there."""
        result = [e for p in self.d.points if self._base_of.get(p.body, p.body) == base for e in p.at]
        result += [e for a in self.d.axes if self._base_of.get(a.body, a.body) == base for e in a.direction]
        if base != WORLD:
            result += _placing_by_hand(self._body[base])
        for joint in self._joints.get(base, ()):
            child = self._body[joint.child]
            result += [*joint.xyz, *joint.rpy, *child.com, *child.inertia]
            result += [child.mass] if child.mass is not None else []
        return result

    def _place_base(self, base: str) -> None:
        motion = None
        if base != WORLD:
            b = self.by_hand[base] = self._placed_by_hand(self._body[base])
            motion = BaseMotion(b.position, b.rotation, b.velocity, b.omega or zeros(self.g))
        if base in self._joints:
            links = build_links(self.loader, self.d, self.x.q, base, self._joints[base])
            tree = Tree(self.g, self.x, links, motion)
            self.trees.append(tree)
            self._tree_of |= {name: tree for name in links.places if name != base}
        self._name_vectors(base)

    def _name_vectors(self, base: str) -> None:
        """Names for the points and axes on a base and on the tree that it carries."""
        for point in self.d.points:
            if self._base_of.get(point.body, point.body) == base:
                self._name(point.name, point, point.at)
        for axis in self.d.axes:
            if self._base_of.get(axis.body, axis.body) == base:
                self._name(axis.name, axis, axis.direction)

    def _name(self, name: str, what: Point | Axis, components: Iterable[algebra.Expr]) -> None:
        local = [self.loader.load(e) for e in components]
        local += [self.g.zero] * (3 - len(local))
        tree = self._tree_of.get(what.body)
        if tree is not None:
            mark = _mark(tree, what.body, local, isinstance(what, Point))
            self._add_mark(mark)
            local = mark.components
        elif what.body != WORLD:
            b = self.by_hand[what.body]
            local = times(self.g, b.rotation, local)
            if isinstance(what, Point):
                local = plus(self.g, b.position, local)
        self.loader.symbols |= {f"{name}_{c}": node for c, node in zip(AXES, local, strict=True)}

    def _add_mark(self, mark: Mark) -> None:
        self.x.marks.append(mark)
        for node, rate in zip(mark.components, mark.velocity, strict=True):
            if self.g.mask[node] & Q:
                self.loader.rates.setdefault(node, rate)
        self.loader.exact.update(mark.velocity)

    def _kinematics(self, body: Body) -> BodyKinematics:
        tree = self._tree_of.get(body.name)
        if tree is None:
            return self.by_hand.get(body.name) or self._placed_by_hand(body)
        g, place = self.g, tree.places[body.name]
        rotations, positions = tree.poses
        com = [self.loader.load(e) for e in body.com]
        com += [g.zero] * (3 - len(com))
        com = plus(g, place.origin, times(g, place.rotation, com))
        return BodyKinematics(
            body=body,
            position=plus(g, positions[place.link], times(g, rotations[place.link], com)),
            velocity=None,
            rotation=product(g, rotations[place.link], place.rotation),
            omega=transposed_times(g, place.rotation, tree.spin[place.link]),
            mass=g.zero,
            inertia=None,
        )

    def _placed_by_hand(self, body: Body) -> BodyKinematics:
        g, loader = self.g, self.loader
        position = [loader.load(x) for x in body.com]
        position += [g.zero] * (3 - len(position))
        steps = [(axis, loader.load(angle)) for axis, angle in body.rotation]
        if body.angle is not None:
            steps = [("z", loader.load(body.angle))]
        rotation, omega = _rotation(loader, steps)
        return BodyKinematics(
            body=body,
            position=position,
            velocity=time_derivative(loader, position),
            rotation=rotation,
            omega=omega if steps else None,
            mass=loader.load(body.mass) if body.mass is not None else g.zero,
            inertia=inertia_tensor(loader, body),
        )


def _mark(tree: Tree, body: str, local: Vector, is_point: bool) -> Mark:
    """A point, or a direction, that is fixed in a body of a tree."""
    g, place = tree.g, tree.places[body]
    arm = times(g, place.rotation, local)
    if is_point:
        arm = plus(g, place.origin, arm)
    rotations, positions = tree.poses
    rotation = rotations[place.link]
    components = times(g, rotation, arm)
    velocity = cross(g, tree.spin[place.link], arm)
    if is_point:
        components = plus(g, positions[place.link], components)
        velocity = plus(g, tree.velocities[place.link], velocity)

    def acceleration(dv: list[int]) -> Vector:
        motion = tree.motion(dv)
        swept = times(g, motion.gradient[place.link], arm)
        if not is_point:
            return times(g, rotation, swept)
        return plus(g, times(g, rotation, plus(g, motion.acceleration[place.link], swept)), tree.gravity)

    return Mark(components, times(g, rotation, velocity), acceleration)


def _placing_by_hand(body: Body) -> list[algebra.Expr]:
    """The expressions that place a body by hand."""
    angles = [angle for _, angle in body.rotation]
    return [*body.com, *angles, *([body.angle] if body.angle is not None else [])]


def _names(expressions: Iterable[algebra.Expr]) -> set[str]:
    """Names of the symbols in expressions, each shared part visited once."""
    seen: set[algebra.Expr] = set()
    stack = list(expressions)
    while stack:
        e = stack.pop()
        if e not in seen:
            seen.add(e)
            stack.extend(e.args)
    return {e.name for e in seen if isinstance(e, algebra.Symbol)}


def time_derivative(loader: Loader, nodes: list[int]) -> list[int]:
    """Total time derivatives of functions of q and t; they are remembered as exact derivatives."""
    result = loader.derivatives(nodes)
    loader.exact.update(result)
    return result


def _rotation(loader: Loader, steps: list[tuple[str, int]]) -> tuple[Matrix, Vector]:
    """Rotation matrix of successive body-fixed rotations, and the angular velocity in the last frame.

    With R = R1 R2 … the body-axes velocity obeys w_k = R_kᵀ w_(k-1) + e_k dα_k/dt, which needs far fewer
    operations than the elements of Rᵀ dR/dt.
    """
    g = loader.g
    matrix = [[g.one if i == j else g.zero for j in range(3)] for i in range(3)]
    omega = [g.zero] * 3
    for axis, angle in steps:
        k = AXES[axis]
        i, j = (k + 1) % 3, (k + 2) % 3
        c, s = g.call("cos", angle), g.call("sin", angle)
        for row in matrix:
            row[i], row[j] = (
                g.add(g.mul(row[i], c), g.mul(row[j], s)),
                g.sub(g.mul(row[j], c), g.mul(row[i], s)),
            )
        omega[i], omega[j] = (
            g.add(g.mul(omega[i], c), g.mul(omega[j], s)),
            g.sub(g.mul(omega[j], c), g.mul(omega[i], s)),
        )
        omega[k] = g.add(omega[k], time_derivative(loader, [angle])[0])
    return matrix, omega
