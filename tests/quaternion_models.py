"""Modules of ABI 1 with unit quaternions, written from SymPy by Boltzmann and Hamel's equations, for tests.

Nothing of symgen has a part in them. A model is its kinetic and potential energy in coordinates q and rates v, where
q' = N(q) v and the only rates that are no derivatives are angular velocities in body axes.
"""

from __future__ import annotations

import functools
import pprint
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import sympy as sp
from sympy.printing.str import StrPrinter


class _Printer(StrPrinter):
    """Prints what the grammar of generated functions allows."""

    def _print_Integer(self, e):
        return f"{int(e)}.0"

    def _print_Rational(self, e):
        return f"({e.p}.0 / {e.q}.0)"

    def _print_Float(self, e):
        return repr(float(e))

    def _print_Pow(self, e):
        base = f"({self._print(e.base)})"
        if abs(e.exp) == sp.Rational(1, 2):
            text = f"sqrt{base}"
        else:
            text = "(" + " * ".join([base] * abs(int(e.exp))) + ")"
        return text if e.exp > 0 else f"(1.0 / {text})"


class Body:
    """Statements of one function: straight-line assignments."""

    def __init__(self, prefix: str = "w"):
        self.lines: list[str] = []
        self._prefix, self._n = prefix, 0

    def name(self, expression) -> sp.Expr:
        """Assign an expression to a new name; numbers and names stay as they are."""
        expression = sp.sympify(expression)
        if expression.is_Atom:
            return expression
        symbol = sp.Symbol(f"{self._prefix}{self._n}")
        self._n += 1
        self.lines.append(f"{symbol} = {_Printer().doprint(expression)}")
        return symbol

    def names(self, expressions: Sequence) -> list[sp.Expr]:
        """Assign expressions to names, common parts once."""
        expressions = [sp.sympify(e) for e in expressions]
        fresh = (sp.Symbol(f"_{i}") for i in range(10**6))
        parts, results = sp.cse(expressions, symbols=fresh, order="none")
        known: dict = {}
        for symbol, part in parts:
            known[symbol] = self.name(part.xreplace(known))
        return [self.name(result.xreplace(known)) for result in results]

    def out(self, expressions: Sequence, first: int = 0, zeros: bool = True) -> None:
        """Write expressions to `out`; structural zeros only if `zeros`."""
        for i, value in enumerate(self.names(expressions), first):
            if zeros or value != 0:
                self.lines.append(f"out[{i}] = {_Printer().doprint(value)}")

    def matrix(self, m: sp.Matrix) -> sp.Matrix:
        return sp.Matrix(m.rows, m.cols, self.names(list(m)))

    def solve(self, a: sp.Matrix, b: sp.Matrix) -> sp.Matrix:
        """Return a⁻¹ b by elimination without pivoting; the entries of both are names or numbers."""
        a, b = a.copy(), b.copy()
        n = a.rows
        for k in range(n):
            for i in range(k + 1, n):
                if a[i, k] == 0:
                    continue
                factor = self.name(a[i, k] / a[k, k])
                for j in range(k + 1, n):
                    a[i, j] = self.name(a[i, j] - factor * a[k, j])
                for j in range(b.cols):
                    b[i, j] = self.name(b[i, j] - factor * b[k, j])
        for k in reversed(range(n)):
            for j in range(b.cols):
                rest = b[k, j] - sum((a[k, i] * b[i, j] for i in range(k + 1, n)), sp.Integer(0))
                b[k, j] = self.name(rest / a[k, k])
        return b


def rotation(quaternion: Sequence) -> sp.Matrix:
    """The rotation matrix, body to world, of a quaternion that is taken to be of unit length."""
    w, x, y, z = quaternion
    return sp.Matrix(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _turning(quaternion: Sequence) -> sp.Matrix:
    w, x, y, z = quaternion
    return sp.Matrix([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]) / 2


@dataclass(frozen=True)
class Energies:
    """What a model is made of.

    Attributes
    ----------
    coordinates, rates : sequence of (name, value)
        A coordinate whose name ends in _qw begins a quaternion.
    parameters : dict
    lagrangian : callable
        (q, v, p) -> T, V, as p has the parameters as symbols by name.
    constraints : callable
        (q, p) -> the position constraints.
    friction : callable
        (q, v, p) -> Q, generalised forces; None for a conservative model.
    """

    name: str
    coordinates: Sequence[tuple[str, float]]
    rates: Sequence[tuple[str, float]]
    parameters: dict[str, float]
    lagrangian: Callable
    constraints: Callable = lambda q, p: []
    names_of_constraints: Sequence[str] = ()
    friction: Callable | None = None
    events: Sequence[tuple[str, str, str, Callable]] = ()
    resets: dict[str, Callable] = field(default_factory=dict)
    enforced: bool = True


class _Equations:
    """The symbols and matrices of a model."""

    def __init__(self, model: Energies):
        nq, nv, nh = len(model.coordinates), len(model.rates), len(model.names_of_constraints)
        y = sp.symbols([f"y[{i}]" for i in range(nq + 2 * nv + nh)], real=True)
        self.q, self.v = sp.Matrix(y[:nq]), sp.Matrix(y[nq : nq + nv])
        self.a, self.lam = sp.Matrix(y[nq + nv : nq + 2 * nv]), sp.Matrix(nh, 1, y[nq + 2 * nv :])
        self.p = {name: sp.Symbol(f"p[{i}]", real=True) for i, name in enumerate(model.parameters)}
        self.places = [i for i, (name, _) in enumerate(model.coordinates) if name.endswith("_qw")]
        q, v = self.q, self.v
        self.N = sp.zeros(nq, nv)
        i = j = 0
        while i < nq:
            if i in self.places:
                self.N[i : i + 4, j : j + 3] = _turning(q[i : i + 4])
                i, j = i + 4, j + 3
            else:
                self.N[i, j] = 1
                i, j = i + 1, j + 1
        self.qdot = self.N * v
        self.T, self.V = (sp.sympify(e) for e in model.lagrangian(q, v, self.p))
        momentum = sp.Matrix([self.T]).jacobian(v).T
        self.M = momentum.jacobian(v)
        force = self.N.T * sp.Matrix([self.T - self.V]).jacobian(q).T - momentum.jacobian(q) * self.qdot
        for k, i in enumerate(self.places):
            turn = slice(i - k, i - k + 3)
            force[turn, 0] = force[turn, 0] - sp.Matrix(v[turn]).cross(sp.Matrix(momentum[turn]))
        self.Q = sp.Matrix(model.friction(q, v, self.p)) if model.friction else sp.zeros(nv, 1)
        self.f = force + self.Q
        self.phi = sp.Matrix(nh, 1, list(model.constraints(q, self.p)))
        self.G = self.phi.jacobian(q) * self.N if nh else sp.zeros(0, nv)
        self.Gv = self.G * v
        self.gamma = -(self.Gv.jacobian(q) * self.qdot) if nh else sp.zeros(0, 1)


def _kkt(body: Body, e: _Equations, right_v: sp.Matrix, right_m: sp.Matrix) -> tuple[sp.Matrix, sp.Matrix]:
    """Solve M x = right_v + Gᵀ y, G x = right_m; returns x, y."""
    m = e.G.rows
    mass, g = body.matrix(e.M), body.matrix(e.G)
    right = body.matrix(right_v.row_join(g.T) if m else right_v)
    solved = body.solve(mass, right)
    free, by = solved[:, 0], solved[:, 1:]
    if not m:
        return free, sp.zeros(0, 1)
    s = body.matrix(g * by)
    multipliers = body.solve(s, body.matrix(sp.Matrix(right_m) - g * free))
    return body.matrix(free + by * multipliers), multipliers


def _normalised(body: Body, places: Sequence[int], q: list) -> list:
    for i in places:
        norm = body.name(sp.sqrt(sum((x * x for x in q[i : i + 4]), sp.Integer(0))))
        q[i : i + 4] = [body.name(x / norm) for x in q[i : i + 4]]
    return q


def _project(e: _Equations) -> Body:
    body, nv = Body(), e.v.rows
    if not e.G.rows:
        q = _normalised(body, e.places, list(e.q))
        body.out([*q, *e.v])
        return body
    step, _ = _kkt(body, e, sp.zeros(nv, 1), -e.phi)
    moved = _normalised(body, e.places, body.names(list(e.q + e.N * step)))
    there = dict(zip(e.q, moved))
    off = body.matrix(e.Gv.xreplace(there))
    change, _ = _kkt(body, e, sp.zeros(nv, 1), -off)
    body.out([*moved, *(e.v + change), *e.phi, *off])
    return body


@functools.cache
def module_text(model: str) -> str:
    """Return the text of a module of `MODELS`."""
    return write_module(MODELS[model])


def write_module(model: Energies) -> str:
    """Return the text of a model's module."""
    e = _Equations(model)
    nh = e.G.rows
    state = [*e.q, *e.v]
    bodies: dict[str, Body] = {}

    def simple(name: str, expressions: Sequence, zeros: bool = True) -> None:
        bodies[name] = Body()
        bodies[name].out(list(expressions), zeros=zeros)

    rhs = Body()
    a, lam = _kkt(rhs, e, e.f, e.gamma)
    power = [(e.Q.T * e.v)[0]] if model.friction else []
    rhs.out([*e.qdot, *a, *power, *lam, *([sp.Float(1.0)] if nh else [])])
    bodies["rhs"] = rhs
    simple("mass_matrix", e.M, zeros=False)
    simple("forces", e.f)
    simple("energy", [e.T, e.V])
    residual = (e.M * e.a - e.f - e.G.T * e.lam).col_join(e.G * e.a - e.gamma)
    simple("residual", residual)
    simple("residual_jacobian", residual.jacobian([*state, *e.a, *e.lam]), zeros=False)
    simple("kinematics", [*e.N, *e.qdot.jacobian(e.q)], zeros=False)
    bodies["project"] = _project(e)
    if nh:
        simple("constraint_residual", [*e.phi, *e.Gv])
        simple("constraint_jacobian", e.G, zeros=False)
        simple("gamma", e.gamma)
    if model.events:
        simple("events", [event[3](e.q, e.v, e.p) for event in model.events])
    for name, reset in model.resets.items():
        simple(f"reset_{name}", reset(list(e.q), list(e.v), e.p))
    simple("poses", [0, 0, 0, *rotation(e.q[e.places[0] : e.places[0] + 4])])
    simple("shapes", [sp.Rational(1, 10)])
    functions = "".join(
        f'\n\n@njit(error_model="numpy")\ndef {name}(t, y, p, out):\n'
        + "".join(f"    {line}\n" for line in body.lines)
        for name, body in bodies.items()
    )
    header = pprint.pformat(_header(model, e, bodies), sort_dicts=False, width=110)
    return f"from math import sqrt\n\nfrom numba import njit\n\nMODEL = {{\n {header[1:-1]}\n}}\n{functions}"


def _header(model: Energies, e: _Equations, bodies: dict[str, Body]) -> dict:
    def records(pairs):
        return [{"name": n, "unit": "", "value": float(x), "enforced": model.enforced} for n, x in pairs]

    return {
        "abi": 1,
        "generator": "by SymPy",
        "source": "sha256:" + "0" * 64,
        "name": model.name,
        "description": "",
        "nq": e.q.rows, "nv": e.v.rows, "nh": e.G.rows, "nn": 0, "nw": int(model.friction is not None),
        "quaternions": e.places,
        "coordinates": records(model.coordinates),
        "rates": records(model.rates),
        "parameters": [{"name": n, "unit": "", "value": float(x), "doc": ""} for n, x in model.parameters.items()],
        "inputs": [], "constants": [],
        "constraints": [{"name": name, "kind": "holonomic"} for name in model.names_of_constraints],
        "outputs": [],
        "events": [{"name": n, "direction": d, "action": a} for n, d, a, _ in model.events],
        "bodies": [{"name": "body", "planar": False, "shape": "sphere", "sizes": 1, "mesh": ""}],
        "structure": {
            "conservative": model.friction is None, "time_dependent": False, "constant_mass": False,
            "diagonal_mass": False, "velocity_dependent": True, "separable": False,
        },
        "operations": {name: len(body.lines) for name, body in bodies.items()},
        "run": {"t_end": 1.0},
    }  # fmt: skip


def _half_square(inertia: Sequence, w: sp.Matrix) -> sp.Expr:
    return sum((i * x * x for i, x in zip(inertia, w)), sp.Integer(0)) / 2


def _free_body(q, v, p):
    return _half_square([p["I1"], p["I2"], p["I3"]], v), 0


_ARM = sp.Matrix([0, 1, 0])  # from the pivot to the centre of mass, in body axes
_INERTIA = (0.234375, 0.46875, 0.234375)  # about the centre of mass


def _heavy_top(q, v, p):
    about_pivot = [_INERTIA[0] + p["m"], _INERTIA[1], _INERTIA[2] + p["m"]]
    return _half_square(about_pivot, v), p["m"] * p["g"] * (rotation(q) * _ARM)[2]


def _pinned_top(q, v, p):
    kinetic = p["m"] * sum(x * x for x in v[:3]) / 2 + _half_square(_INERTIA, sp.Matrix(v[3:]))
    return kinetic, p["m"] * p["g"] * q[2]


def _top_on_cart(q, v, p):
    turn, w = rotation(q[1:5]), sp.Matrix(v[1:4])
    velocity = turn * w.cross(_ARM) + sp.Matrix([v[0], 0, 0])
    kinetic = p["m"] * velocity.dot(velocity) / 2 + _half_square(_INERTIA, w)
    kinetic += (p["cart"] * v[0] ** 2 + v[4] ** 2) / 2
    potential = p["m"] * p["g"] * (turn * _ARM)[2] + p["k"] * (q[0] ** 2 + (q[5] - q[0]) ** 2) / 2
    return kinetic, potential


_FREE = (
    [("body_qw", 1.0), ("body_qx", 0.0), ("body_qy", 0.0), ("body_qz", 0.0)],
    [("body_wx", 0.001), ("body_wy", 1.0), ("body_wz", 0.001)],
    {"I1": 1.0, "I2": 2.0, "I3": 3.0},
)
_QUATERNION = [("top_qw", 1.0), ("top_qx", 0.0), ("top_qy", 0.0), ("top_qz", 0.0)]
_FAST = [("top_wx", 0.0), ("top_wy", 150.0), ("top_wz", -4.61538)]
_TOP = {"m": 15.0, "g": 9.81}

MODELS = {
    model.name: model
    for model in (
        Energies("free_body", *_FREE, _free_body),
        Energies(
            "kicked_body",
            *_FREE,
            _free_body,
            events=[
                ("half_turn", "falling", "record", lambda q, v, p: q[0]),
                ("kick", "falling", "reset", lambda q, v, p: q[0] - sp.Rational(1, 2)),
            ],
            resets={"kick": lambda q, v, p: [*(2 * x for x in q), v[0], v[1] + 1, v[2]]},
        ),
        Energies(
            "heavy_top", _QUATERNION, _FAST, _TOP, _heavy_top
        ),
        Energies(
            "pinned_top",
            [("x", 0.0), ("y", 1.0), ("z", 0.0), *_QUATERNION],
            [("top_vx", 4.61538), ("top_vy", 0.0), ("top_vz", 0.0), *_FAST],
            _TOP,
            _pinned_top,
            constraints=lambda q, p: list(sp.Matrix(q[:3]) - rotation(q[3:]) * _ARM),
            names_of_constraints=["pin_x", "pin_y", "pin_z"],
            enforced=False,
        ),
        Energies(
            "swing",
            _QUATERNION,
            [("top_wx", 1.0), ("top_wy", 20.0), ("top_wz", 0.0)],
            _TOP,
            _heavy_top,
            constraints=lambda q, p: [(rotation(q) * _ARM)[0]],
            names_of_constraints=["in_plane"],
            enforced=False,
        ),
        Energies(
            "top_on_cart",
            [("s", 0.1), *_QUATERNION, ("u", 0.0)],
            [("s", 0.0), ("top_wx", 0.3), ("top_wy", 6.0), ("top_wz", -0.2), ("u", 0.2)],
            {**_TOP, "cart": 20.0, "k": 400.0, "c": 5.0},
            _top_on_cart,
            friction=lambda q, v, p: [-p["c"] * v[0], 0, 0, 0, 0],
        ),
    )
}  # fmt: skip
