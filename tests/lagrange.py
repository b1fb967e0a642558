"""Test support: the mechanics of a description by textbook SymPy, as the oracle of what is derived."""

from __future__ import annotations

from functools import cached_property

import mpmath
import numpy as np
import sympy
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

from symgen.model.description import Description
from symgen.model.sympy_functions import dot, maximum, minimum


class Reference:
    """Equations of a description by `LagrangesMethod` and by differentiating SymPy expressions of time."""

    def __init__(self, d: Description) -> None:
        self.d = d
        self.t = dynamicsymbols._t
        self.q = [sympy.Function(f"{c.name}_")(self.t) for c in d.coordinates]
        self.v = [x.diff(self.t) for x in self.q]
        self.names = {sympy.Symbol("t"): self.t}
        self.names |= {sympy.Symbol(c.name): x for c, x in zip(d.coordinates, self.q, strict=True)}
        self.names |= {sympy.Symbol(c.name): sympy.Float(c.value) for c in d.constants}
        for name, expression in d.definitions:
            self.names[sympy.Symbol(name)] = self.of(expression)
        zero = sympy.Integer(0)
        T = self.of(d.kinetic) if d.kinetic is not None else zero
        V = self.of(d.potential) if d.potential is not None else zero
        gravity = sympy.Matrix(self.of(d.gravity or (0, 0, 0)))
        self.rotations = {}
        for b in d.bodies:
            r = sympy.Matrix([*self.of(b.com), *[0] * (3 - len(b.com))])
            mass = self.of(b.mass) if b.mass is not None else zero
            velocity = r.diff(self.t)
            T += mass * velocity.dot(velocity) / 2
            V -= mass * gravity.dot(r)
            T += self._spin(b)
        self.T, self.V = T, V
        self.Q = self._forces()

    def of(self, e):
        """An expression with the coordinates as functions of time and `dot` carried out."""
        if isinstance(e, (tuple, sympy.Tuple)):
            return tuple(self.of(x) for x in e)
        e = sympy.sympify(e).xreplace(self.names)
        e = e.replace(dot, lambda x: x.diff(self.t))
        e = e.replace(minimum, lambda a, b: sympy.Piecewise((b, b < a), (a, True)))
        return e.replace(maximum, lambda a, b: sympy.Piecewise((b, a < b), (a, True)))

    def _rotation(self, b) -> sympy.Matrix:
        steps = b.rotation or ((("z", b.angle),) if b.angle is not None else ())
        R = sympy.eye(3)
        for axis, angle in steps:
            c, s = sympy.cos(self.of(angle)), sympy.sin(self.of(angle))
            R = (
                R
                * {
                    "x": sympy.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]]),
                    "y": sympy.Matrix([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
                    "z": sympy.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
                }[axis]
            )
        return R

    def _spin(self, b):
        R = self._rotation(b)
        self.rotations[b.name] = R
        if not b.inertia:
            return sympy.Integer(0)
        W = R.T * R.diff(self.t)
        w = sympy.Matrix([W[2, 1], W[0, 2], W[1, 0]])
        values = list(self.of(b.inertia))
        if len(values) == 1:
            return values[0] * w[2] ** 2 / 2
        xx, yy, zz, xy, xz, yz = values + [0] * (6 - len(values))
        return (w.T * sympy.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) * w)[0] / 2

    def _forces(self) -> sympy.Matrix:
        """Generalised forces of everything but V."""
        Q = sympy.zeros(len(self.q), 1)
        index = {c.name: k for k, c in enumerate(self.d.coordinates)}
        for name, force in self.d.forces:
            Q[index[name]] += self.of(force)
        if self.d.dissipation is not None:
            Q -= sympy.Matrix([self.of(self.d.dissipation).diff(v) for v in self.v])
        for load in self.d.loads:
            if load.force:
                r = sympy.Matrix(self.of(load.point))
                Q += r.jacobian(self.q).T * sympy.Matrix(self.of(load.force))
            else:
                R = self.rotations[load.body]
                W = R.diff(self.t) * R.T  # world axes
                w = sympy.Matrix([W[2, 1], W[0, 2], W[1, 0]])
                torque = list(self.of(load.torque))
                torque = [0, 0, *torque] if len(torque) == 1 else torque
                Q += w.jacobian(self.v).T * sympy.Matrix(torque)
        return Q

    @cached_property
    def method(self) -> LagrangesMethod:
        method = LagrangesMethod(self.T - self.V, self.q)
        method.form_lagranges_equations()
        return method

    def equations(self, t, y) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrix and forces, by `LagrangesMethod`, or by differences where that takes minutes."""
        Q = self.number(self.Q, t, y)[:, 0]
        if all(b.planar for b in self.d.bodies):
            return self.number(self.method.mass_matrix, t, y), self.number(self.method.forcing, t, y)[
                :, 0
            ] + Q
        with mpmath.workdps(60):
            M, f = self._by_differences([mpmath.mpf(float(x)) for x in (t, *y)])
        return np.array(M.tolist(), dtype=float), np.array(f, dtype=float) + Q

    def _by_differences(self, z):
        """Lagrange's equations by differences in 60 digits; z = (t, q, v)."""
        n = len(self.q)
        T, V = self.function(self.T, "mpmath"), self.function(self.V, "mpmath")
        h = mpmath.mpf(10) ** -15

        def by(f, k):
            return lambda z: (
                (f([*z[:k], z[k] + h, *z[k + 1 :]]) - f([*z[:k], z[k] - h, *z[k + 1 :]])) / (2 * h)
            )

        momenta = [by(T, 1 + n + k) for k in range(n)]
        M = mpmath.matrix(n, n)
        f = []
        for i, p in enumerate(momenta):
            for j in range(n):
                M[i, j] = by(p, 1 + n + j)(z)
            change = by(p, 0)(z) + sum(by(p, 1 + j)(z) * z[1 + n + j] for j in range(n))
            f.append(by(T, 1 + i)(z) - by(V, 1 + i)(z) - change)
        return M, f

    def plain(self, e):
        """An expression with q and its rates as plain symbols x_0, x_1, …"""
        n = len(self.q)
        x = sympy.symbols(f"x_0:{2 * n}")
        return e.xreplace(dict(zip(self.v, x[n:], strict=True))).xreplace(
            dict(zip(self.q, x[:n], strict=True))
        )

    def function(self, e, modules):
        """An expression as a function of the list (t, q, v), at the values of parameters and inputs."""
        values = {sympy.Symbol(x.name): sympy.Float(x.value, 60) for x in self.d.parameters}
        values |= {sympy.Symbol(x.name): sympy.Float(x.default, 60) for x in self.d.inputs}
        arguments = [self.t, *sympy.symbols(f"x_0:{2 * len(self.q)}")]
        f = sympy.lambdify(arguments, self.plain(e).xreplace(values), modules=modules, cse=True)
        return lambda z: f(*z)

    def number(self, e, t, y) -> np.ndarray:
        """Values of a matrix of expressions in the state y = (q, v)."""
        e = sympy.Matrix(e)
        f = self.function(e, [{"ImmutableDenseMatrix": list, "MutableDenseMatrix": list}, "math"])
        return np.array(f([float(t), *map(float, y)]), dtype=float).reshape(e.shape)

    def energy(self, t, y) -> np.ndarray:
        return self.number([self.T, self.V], t, y)[:, 0]

    @cached_property
    def position(self) -> sympy.Matrix:
        return sympy.Matrix([self.of(c.expression) for c in self.d.constraints] or sympy.zeros(0, 1))

    @cached_property
    def velocity(self) -> sympy.Matrix:
        return sympy.Matrix(
            [*self.position.diff(self.t), *(self.of(c.expression) for c in self.d.velocity_constraints)]
        )

    def G(self, t, y) -> np.ndarray:
        return self.number(self.velocity.jacobian(self.v), t, y)

    def gamma(self, t, y) -> np.ndarray:
        rest = {x.diff(self.t): 0 for x in self.v}
        return -self.number(self.velocity.diff(self.t).xreplace(rest), t, y)[:, 0]
