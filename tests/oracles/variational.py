"""Equations of a TOML model from its text by central differences of the energies in 80-digit arithmetic.

Nothing is differentiated symbolically and nothing of the product is used. With a step of 1e-20 the truncation error is
1e-40, and rounding leaves 20 digits after three nested differences. The bundled models only: their text is evaluated
as Python, and their numbers are in SI units.
"""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mpmath import matrix, mp, mpf

DIGITS = 80
STEP = mpf(10) ** -20
FUNCTIONS = (
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "atan2",
    "sinh",
    "cosh",
    "tanh",
    "exp",
    "log",
    "sqrt",
)
AXES = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}


class _DotOfText(ast.NodeTransformer):
    """`dot(e)` becomes `dot('e')`: the derivative needs e at two points, not its value at one."""

    def visit_Call(self, node: ast.Call) -> ast.Call:
        if isinstance(node.func, ast.Name) and node.func.id == "dot":
            return ast.Call(node.func, [ast.Constant(ast.unparse(node.args[0]))], [])
        return self.generic_visit(node)


class Point(Mapping):
    """The names of a model at one state (t, q, v); definitions are evaluated when they are first asked for."""

    def __init__(self, model: VariationalModel, t: mpf, q: Sequence[mpf], v: Sequence[mpf]) -> None:
        self.model, self.t, self.q, self.v = model, t, list(q), list(v)
        self.values = {
            **model.numbers,
            **dict(zip(model.coordinates, self.q, strict=True)),
            "t": t,
            "dot": self.dot,
        }

    def __getitem__(self, name: str) -> Any:
        if name not in self.values:
            self.values[name] = self(self.model.definitions[name])
        return self.values[name]

    def __iter__(self):
        return iter(self.values)

    def __len__(self) -> int:
        return len(self.values)

    def __call__(self, expression: str | float) -> mpf:
        return eval(self.model.code(expression), {"__builtins__": {}}, self)

    def dot(self, expression: str) -> mpf:
        """Total time derivative."""
        return self.derivative(lambda point: point(expression))

    def derivative(self, quantity: Callable[[Point], mpf], a: Sequence[mpf] | None = None) -> Any:
        """Rate of a quantity along the motion with accelerations `a`."""
        return (quantity(self.after(STEP, a)) - quantity(self.after(-STEP, a))) / (2 * STEP)

    def after(self, s: mpf, a: Sequence[mpf] | None = None) -> Point:
        """The point a time s later on a path with accelerations `a` (none: the rates stay)."""
        a = a or [mpf(0)] * len(self.q)
        q = [x + w * s + c * s * s / 2 for x, w, c in zip(self.q, self.v, a, strict=True)]
        return Point(self.model, self.t + s, q, [w + c * s for w, c in zip(self.v, a, strict=True)])

    def moved(self, i: int, by: mpf) -> Point:
        """The point with coordinate i changed."""
        return Point(self.model, self.t, [x + by * (j == i) for j, x in enumerate(self.q)], self.v)

    def sped(self, i: int, by: mpf) -> Point:
        """The point with rate i changed."""
        return Point(self.model, self.t, self.q, [w + by * (j == i) for j, w in enumerate(self.v)])


class VariationalModel:
    """A TOML model whose equations are found by differences; arrays are returned as doubles."""

    def __init__(self, path: Path) -> None:
        mp.dps = DIGITS
        self.tables = tables = tomllib.loads(path.read_text(encoding="utf-8"))
        self.coordinates = list(tables["coordinates"])
        self.definitions = tables.get("definitions", {})
        self._code: dict[str | float, Any] = {}
        self.numbers: dict[str, Any] = {name: getattr(mp, name) for name in FUNCTIONS} | {
            "pi": +mp.pi,
            "mpf": mpf,
        }
        for name, entry in {**tables.get("parameters", {}), **tables.get("constants", {})}.items():
            self.numbers[name] = _number(entry["value"] if isinstance(entry, dict) else entry)
        for name, entry in tables.get("inputs", {}).items():
            self.numbers[name] = _number(entry.get("default", 0))

    def code(self, expression: str | float) -> Any:
        """The compiled expression; whole numbers become mpf, so that 1/2 is a half."""
        if expression not in self._code:
            text = str(expression).replace("^", "**")
            if text[:1] in "-0123456789" and " " in text and text.split()[1][0].isalpha():
                text = text.split()[0]  # a quantity
            self._code[expression] = compile(_exact(text), "<model>", "eval")
        return self._code[expression]

    def point(self, t: float, q: Sequence[float], v: Sequence[float]) -> Point:
        """The model at a state given in doubles."""
        return Point(self, mpf(t), [mpf(x) for x in q], [mpf(x) for x in v])

    def kinetic(self, at: Point) -> mpf:
        """Kinetic energy of the bodies, and the model's own."""
        total = at(self.tables.get("energy", {}).get("kinetic", 0))
        for body in self.tables.get("bodies", {}).values():
            mass = at(body.get("mass", 0))
            if mass != 0:
                total += mass / 2 * sum(at.dot(x) ** 2 for x in body["com"])
            inertia = body.get("inertia")
            if isinstance(inertia, list):
                total += (
                    sum(at(J) * w**2 for J, w in zip(inertia, _spin(at, body["rotation"]), strict=True)) / 2
                )
            elif inertia is not None:
                total += at(inertia) / 2 * at.dot(body["angle"]) ** 2
        return total

    def potential(self, at: Point) -> mpf:
        """Potential energy: the model's own, and gravity's."""
        total = at(self.tables.get("energy", {}).get("potential", 0))
        gravity = [at(self.tables.get("gravity", {}).get(axis, 0)) for axis in "xyz"]
        for body in self.tables.get("bodies", {}).values():
            mass = at(body.get("mass", 0))
            total -= mass * sum(g * at(x) for g, x in zip(gravity, body["com"], strict=False))
        return total

    def _dissipation(self, at: Point) -> mpf:
        return at(self.tables.get("energy", {}).get("dissipation", 0))

    def mass_matrix(self, at: Point) -> np.ndarray:
        """Columns of momenta of unit rates; momenta are affine in the rates."""
        zero = Point(self, at.t, at.q, [mpf(0)] * len(at.v))
        rest = self._momenta(zero)
        return np.array([_doubles(self._momenta(zero.sped(j, mpf(1))), rest) for j in range(len(at.q))]).T

    def forces(self, at: Point) -> np.ndarray:
        """f of M a = f + G^T lambda: the Euler-Lagrange equations at zero acceleration."""
        applied = self.tables.get("forces", {})
        ahead, behind = self._momenta(at.after(STEP)), self._momenta(at.after(-STEP))
        f = []
        for i, name in enumerate(self.coordinates):
            lagrangian = _difference(lambda p: self.kinetic(p) - self.potential(p), at.moved, i)
            drag = _difference(self._dissipation, at.sped, i)
            f.append(lagrangian - drag + at(applied.get(name, 0)) - (ahead[i] - behind[i]) / (2 * STEP))
        return np.array([float(x) for x in f])

    def constraints(self, at: Point) -> tuple[np.ndarray, np.ndarray]:
        """Jacobian G, shape (m, n), and gamma, shape (m,), with G a = gamma."""
        rows, gamma = [], []
        indices = range(len(at.q))
        for text in self.tables.get("constraints", {}).values():
            rows.append([_difference(lambda p, text=text: p(text), at.moved, i) for i in indices])
            gamma.append(-(at.after(STEP)(text) - 2 * at(text) + at.after(-STEP)(text)) / STEP**2)
        for text in self.tables.get("velocity_constraints", {}).values():
            rows.append([_difference(lambda p, text=text: p(text), at.sped, i) for i in indices])
            gamma.append(-at.derivative(lambda p, text=text: p(text)))
        return np.array(rows, dtype=float).reshape(len(rows), len(at.q)), np.array(gamma, dtype=float)

    def outputs(self, at: Point) -> np.ndarray:
        """The model's outputs."""
        return np.array([float(at(text)) for text in self.tables.get("outputs", {}).values()])

    def _momenta(self, at: Point) -> list[mpf]:
        return [_difference(self.kinetic, at.sped, i) for i in range(len(at.q))]


def _number(entry: str | float) -> mpf:
    """A number, or the number of a quantity, as the double that the product has."""
    return mpf(float(entry.split()[0]) if isinstance(entry, str) else float(entry))


def _exact(text: str) -> ast.Expression:
    class Exact(ast.NodeTransformer):
        def visit_Constant(self, node: ast.Constant) -> ast.AST:
            if not isinstance(node.value, (int, float)):
                return node
            return ast.Call(ast.Name("mpf", ast.Load()), [ast.Constant(node.value)], [])

    tree = Exact().visit(_DotOfText().visit(ast.parse(text, mode="eval")))
    return ast.fix_missing_locations(tree)


def _difference(quantity: Callable[[Point], mpf], change: Callable[[int, mpf], Point], i: int) -> mpf:
    return (quantity(change(i, STEP)) - quantity(change(i, -STEP))) / (2 * STEP)


def _doubles(values: list[mpf], less: list[mpf]) -> list[float]:
    return [float(a - b) for a, b in zip(values, less, strict=True)]


def _rotation(at: Point, steps: list[list[Any]]) -> matrix:
    R = mp.eye(3)
    for axis, angle in steps:
        i, j = AXES[axis]
        step, c, s = mp.eye(3), mp.cos(at(angle)), mp.sin(at(angle))
        step[i, i] = step[j, j] = c
        step[i, j], step[j, i] = -s, s
        R = R * step
    return R


def _spin(at: Point, steps: list[list[Any]]) -> list[mpf]:
    """Angular velocity in body axes, from R^T dR/dt."""
    W = _rotation(at, steps).T * at.derivative(lambda p: _rotation(p, steps))
    return [W[2, 1], W[0, 2], W[1, 0]]
