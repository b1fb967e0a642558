"""M a = f solved along a tree, by articulated bodies (Featherstone 1983; 2008, chapter 7) at rest.

The forces f hold all velocity terms already, so that this is a factorisation of M: O(n) operations where an LDLᵀ of M
takes O(n d²) for trees of depth d. It pays for long chains, and not for arms.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..graph.graph import Graph
from ..graph.vectors import Inertia, Matrix, Vector, cross, cross_z, dot, plus, scaled, transposed, zeros
from .links import Link, along
from .recursive import Tree


@dataclass(frozen=True)
class Articulated:
    """Wrench per acceleration of a link whose descendants' joints are free: moment = A α + B a, force = Bᵀ α + C a."""

    A: Matrix
    B: Matrix
    C: Matrix

    def rows(self) -> Matrix:
        """The 6 x 6 matrix, angular rows first."""
        upper = [[*a, *b] for a, b in zip(self.A, self.B, strict=True)]
        return upper + [[*b, *c] for b, c in zip(transposed(self.B), self.C, strict=True)]


@dataclass(frozen=True)
class Step:
    """Elimination of a link's joint: unit wrenches U per rate, and L = U D⁻¹ with D⁻¹."""

    U: Matrix
    L: Matrix
    inverse: Matrix


def solve_articulated(g: Graph, trees: list[Tree], diagonal: list[int], right: list[int]) -> list[int] | None:
    """Solution of (M + diagonal) a = right for trees on the world; None where a joint's inertia vanishes.

    Parameters
    ----------
    g : Graph
    trees : list of Tree
    diagonal : list of int
        What is added to the diagonal of M: inertia along single rates. Rates in no tree have nothing else.
    right : list of int

    Returns
    -------
    list of int or None
    """
    result: list[int | None] = [None] * len(right)
    for tree in trees:
        steps = _eliminate(tree, diagonal)
        if steps is None:
            return None
        _substitute(tree, steps, right, result)
    for k, value in enumerate(result):
        if value is None:
            if diagonal[k] == g.zero:
                return None
            result[k] = g.div(right[k], diagonal[k])
    return result


def _eliminate(tree: Tree, diagonal: list[int]) -> list[Step] | None:
    g = tree.g
    bodies = [_rigid(g, link.inertia) for link in tree.links]
    steps: list[Step | None] = [None] * len(tree.links)
    for k in reversed(tree.moving()):
        link = tree.links[k]
        step = _step(g, link, bodies[k], [diagonal[i] for i in link.rates])
        if step is None:
            return None
        steps[k] = step
        carried = _to_parent(g, link, _without_joint(g, link, bodies[k], step))
        p = link.parent
        bodies[p] = Articulated(
            *(_sum(g, a, b) for a, b in zip(_parts(bodies[p]), _parts(carried), strict=True))
        )
    return steps


def _substitute(tree: Tree, steps: list[Step], right: list[int], result: list[int | None]) -> None:
    """Wrenches towards the base, then accelerations outwards."""
    g, n = tree.g, len(tree.links)
    wrenches = [(zeros(g), zeros(g)) for _ in range(n)]
    driving: list[Vector] = [[] for _ in range(n)]
    for k in reversed(tree.moving()):
        link, step, (force, moment) = tree.links[k], steps[k], wrenches[k]
        resisted = tree.along_joint(k, wrenches[k])
        driving[k] = [g.sub(right[i], x) for i, x in zip(link.rates, resisted, strict=True)]
        pushed = [dot(g, column, driving[k]) for column in transposed(step.L)]
        force, moment = tree.to_parent(k, (plus(g, force, pushed[3:]), plus(g, moment, pushed[:3])))
        p = link.parent
        wrenches[p] = (plus(g, wrenches[p][0], force), plus(g, wrenches[p][1], moment))
    alphas, accelerations = [zeros(g)], [zeros(g)]
    for k, link in enumerate(tree.links[1:], 1):
        step, before = steps[k], alphas[link.parent]
        alpha = link.turn.down(before)
        acc = link.turn.down(plus(g, accelerations[link.parent], cross(g, before, link.offset)))
        if link.slide != g.zero:
            acc = plus(g, acc, scaled(g, link.slide, cross_z(g, alpha)))
        solved = [
            g.sub(dot(g, row, driving[k]), dot(g, lower, [*alpha, *acc]))
            for row, lower in zip(step.inverse, step.L, strict=True)
        ]
        for i, value in zip(link.rates, solved, strict=True):
            result[i] = value
        turning, sliding = along(g, link.subspace, solved)
        alphas.append(plus(g, alpha, turning))
        accelerations.append(plus(g, acc, sliding))


def _columns(link: Link) -> Matrix:
    """The motion subspace as columns of six, angular components first."""
    return [[*turning, *sliding] for turning, sliding in link.subspace]


def _axes(g: Graph, link: Link) -> dict[int, int]:
    """Rows of the 6 x 6 matrix that belong to one rate alone, and to no other component of it."""
    found = {}
    for a, column in enumerate(_columns(link)):
        filled = [i for i, x in enumerate(column) if x != g.zero]
        if len(filled) == 1 and column[filled[0]] == g.one:
            found[filled[0]] = a
    return found


def _rigid(g: Graph, inertia: Inertia) -> Articulated:
    x, y, z = inertia.first
    B = [[g.zero, g.neg(z), y], [z, g.zero, g.neg(x)], [g.neg(y), x, g.zero]]
    C = [[inertia.mass if i == j else g.zero for j in range(3)] for i in range(3)]
    return Articulated(inertia.tensor, B, C)


def _parts(body: Articulated) -> tuple[Matrix, Matrix, Matrix]:
    return body.A, body.B, body.C


def _sum(g: Graph, a: Matrix, b: Matrix) -> Matrix:
    return [plus(g, x, y) for x, y in zip(a, b, strict=True)]


def _step(g: Graph, link: Link, body: Articulated, diagonal: list[int]) -> Step | None:
    S, rows, axes = _columns(link), body.rows(), _axes(g, link)
    n = len(S)
    U = [[dot(g, row, column) for row in rows] for column in S]
    D = [[dot(g, column, u) for column in S] for u in U]
    for a, extra in enumerate(diagonal):
        D[a][a] = g.add(D[a][a], extra)
    if any(D[a][a] == g.zero for a in range(n)):
        return None
    inverse = [[g.div(g.one, D[0][0])]] if n == 1 else _inverse(g, D)
    columns = transposed(U)
    unit = [[g.one if a == b else g.zero for b in range(n)] for a in range(n)]
    free = all(extra == g.zero for extra in diagonal)
    lower = [
        unit[axes[k]] if free and k in axes else [dot(g, row, column) for row in inverse]
        for k, column in enumerate(columns)
    ]
    return Step(U, transposed(lower), inverse)


def _inverse(g: Graph, D: Matrix) -> Matrix:
    """Inverse of a symmetric 3 x 3 matrix, by its cofactors."""
    cofactors = [[g.zero] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(i, 3):
            (a, b), (c, d) = ((i + 1) % 3, (i + 2) % 3), ((j + 1) % 3, (j + 2) % 3)
            minor = g.sub(g.mul(D[a][c], D[b][d]), g.mul(D[a][d], D[b][c]))
            cofactors[i][j] = cofactors[j][i] = minor
    factor = g.div(g.one, dot(g, D[0], cofactors[0]))
    return [[g.mul(factor, x) for x in row] for row in cofactors]


def _without_joint(g: Graph, link: Link, body: Articulated, step: Step) -> Articulated:
    """The wrench that is left when the joint yields: I - U D⁻¹ Uᵀ."""
    axes, rows = _axes(g, link), body.rows()
    L, U = transposed(step.L), transposed(step.U)
    for i in range(6):
        for j in range(i, 6):
            # the row of the joint itself vanishes exactly if L has a unit there
            first, second = (j, i) if j in axes else (i, j)
            rows[i][j] = rows[j][i] = g.sub(rows[i][j], dot(g, L[first], U[second]))
    return Articulated([r[:3] for r in rows[:3]], [r[3:] for r in rows[:3]], [r[3:] for r in rows[3:]])


def _to_parent(g: Graph, link: Link, body: Articulated) -> Articulated:
    """In the axes of the parent and about its origin."""
    if link.slide != g.zero:
        body = _shifted(g, body, [g.zero, g.zero, link.slide])
    turn = link.turn
    turned = Articulated(turn.up_symmetric(body.A), turn.up_matrix(body.B), turn.up_symmetric(body.C))
    return _shifted(g, turned, link.offset)


def _shifted(g: Graph, body: Articulated, r: Vector) -> Articulated:
    """About an origin from which the present one is at `r`: B' = B + [r]× C, A' = A - B' [r]× + [r]× Bᵀ."""
    columns = [cross(g, r, column) for column in transposed(body.C)]
    B = _sum(g, body.B, transposed(columns))
    old, new = ([cross(g, r, row) for row in matrix] for matrix in (body.B, B))
    A = [[g.zero] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(i, 3):
            A[i][j] = A[j][i] = g.sum([body.A[i][j], new[i][j], old[j][i]])
    return Articulated(A, B, body.C)
