"""Models from SymPy's `KanesMethod` and `System`: bodies, loads and constraints in generalised speeds."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import sympy
from sympy.core.function import AppliedUndef

from ..errors import ModelError


@dataclass(frozen=True)
class Mechanics:
    """What a problem of `sympy.physics.mechanics` is made of.

    Attributes
    ----------
    frame : sympy.physics.mechanics.ReferenceFrame
        At rest.
    q, u : sequence of sympy.Expr
        Coordinates and generalised speeds, as functions of time.
    kinematics : sequence of sympy.Expr
        What is zero: equations between u and dq/dt, linear in both.
    auxiliary : sequence of sympy.Expr
        Speeds that are zero, and are there for what forces do.
    bodies, loads : sequence
    holonomic, velocity : sequence of sympy.Expr
        Constraints; those of velocities may have the derivatives of the holonomic ones among them.
    """

    frame: Any
    q: Sequence[sympy.Expr]
    u: Sequence[sympy.Expr]
    kinematics: Sequence[sympy.Expr]
    auxiliary: Sequence[sympy.Expr]
    bodies: Sequence[Any]
    loads: Sequence[Any]
    holonomic: Sequence[sympy.Expr]
    velocity: Sequence[sympy.Expr]

    @classmethod
    def of_kane(cls, method: Any) -> Mechanics:
        """Those of a `KanesMethod` that has its bodies."""
        if not method.bodies:
            raise ModelError(
                "the KanesMethod has no bodies yet",
                hint="call its kanes_equations(bodies, loads), or give it bodies and forcelist, before",
            )
        q, u = list(method.q), list(method.u)
        rates = sympy.Matrix([x.diff(_time(q)) for x in q])
        kinematics = (
            method._k_kqdot_implicit * rates + method._k_ku_implicit * method.u + method._f_k_implicit
        )
        velocity = method._k_nh * method.u + method._f_nh if method._f_nh else []
        return cls(
            method._inertial, q, u, list(kinematics), list(method._uaux), method.bodies, method.loads or (),
            list(method._f_h), list(velocity),
        )  # fmt: skip

    @classmethod
    def of_system(cls, system: Any) -> Mechanics:
        """Those of a `sympy.physics.mechanics.System`, its actuators' loads included."""
        loads = [*system.loads, *(load for actuator in system.actuators for load in actuator.to_loads())]
        return cls(
            system.frame, list(system.q), list(system.u), list(system.kdes), list(system.u_aux), system.bodies, loads,
            list(system.holonomic_constraints), list(system.velocity_constraints),
        )  # fmt: skip

    def in_rates(self) -> tuple[sympy.Expr, dict[sympy.Expr, sympy.Expr], list[sympy.Expr]]:
        """T, the generalised forces by coordinate, and the velocity constraints, of q and dq/dt.

        Raises
        ------
        ModelError
            Speeds and rates of coordinates do not follow from each other.
        """
        from sympy.physics.mechanics import (  # a second; who comes here has them
            kinetic_energy,
            partial_velocity,
        )

        rates = [x.diff(_time(self.q)) for x in self.q]
        known = self._speeds(rates)
        turned = sympy.Matrix([known[x] for x in self.u]).jacobian(rates)
        kinetic = kinetic_energy(self.frame, *self.bodies).xreplace(known)
        forces = sympy.zeros(len(self.q), 1)
        for target, vector in ((load[0], load[1]) for load in self.loads):
            moves = target.vel(self.frame) if hasattr(target, "vel") else target.ang_vel_in(self.frame)
            (partial,) = partial_velocity([moves], [*self.u, *rates], self.frame)
            along = [part.dot(vector) for part in partial]
            n = len(self.u)
            forces += turned.T * sympy.Matrix(along[:n]) + sympy.Matrix(along[n:])
        forces = forces.xreplace(known) + self._of_rolling(known, rates)
        by_coordinate = {q: force for q, force in zip(self.q, forces) if force != 0}
        return kinetic, by_coordinate, [x.xreplace(known) for x in self.velocity]

    def _of_rolling(self, known: dict[sympy.Expr, sympy.Expr], rates: list[sympy.Expr]) -> sympy.Matrix:
        """What Lagrange's equations of T miss where velocities are no derivatives of places: m v.(d/dt dv/dq' - dv/dq).

        So it is of a disc whose rolling is put into its velocity (Chaplygin; Neimark, Fufaev, Dynamics of Nonholonomic
        Systems, 1972, III.1).
        """
        missing = sympy.zeros(len(self.q), 1)
        for body in self.bodies:
            v = body.masscenter.vel(self.frame).to_matrix(self.frame).xreplace(known)
            rest = v.jacobian(rates).diff(_time(self.q)) - v.jacobian(self.q)
            if not all(map(_is_zero, _with_numbers(rest, rates))):
                missing += body.mass * rest.T * v
        return missing

    def _speeds(self, rates: list[sympy.Expr]) -> dict[sympy.Expr, sympy.Expr]:
        if len(self.u) != len(self.q):
            raise ModelError(
                f"there are {len(self.u)} generalised speeds for {len(self.q)} coordinates",
                hint="a model is made of as many; leave none out, and hold what does not move by constraints",
            )
        zero = dict.fromkeys(self.auxiliary, sympy.S.Zero)
        equations = sympy.Matrix(self.kinematics).xreplace(zero)
        of_speeds = equations.jacobian(self.u)
        rest = equations.xreplace(dict.fromkeys(self.u, sympy.S.Zero))
        if of_speeds.is_diagonal() and all(of_speeds.diagonal()):
            solved = [-x / of_speeds[i, i] for i, x in enumerate(rest)]
        else:
            try:
                solved = list(of_speeds.LUsolve(-rest))
            except (ValueError, ZeroDivisionError):
                raise ModelError(
                    "the generalised speeds do not follow from the rates of the coordinates",
                    hint="kinematic equations must be as many as coordinates, linear in both and independent",
                ) from None
        return zero | dict(zip(self.u, solved))

    def independent(self, velocity: list[sympy.Expr]) -> list[sympy.Expr]:
        """Those velocity constraints that the holonomic ones do not imply, by their rank at a random place."""
        if not self.holonomic or not velocity:
            return velocity
        rates = [x.diff(_time(self.q)) for x in self.q]
        rows = sympy.Matrix(list(self.holonomic)).jacobian(list(self.q))
        rows = _with_numbers(rows.col_join(sympy.Matrix(velocity).jacobian(rates)))
        n, kept = len(self.holonomic), []
        basis = rows[:n, :]
        for k, constraint in enumerate(velocity):
            longer = basis.col_join(rows[n + k, :])
            if longer.rank(iszerofunc=_is_zero) == longer.rows:
                basis = longer
                kept.append(constraint)
        return kept


def _time(q: Iterable[sympy.Expr]) -> sympy.Symbol:
    return next(iter(q)).args[0]


def _is_zero(x: sympy.Expr) -> bool:
    return bool(abs(x) < 1e-15)  # of 30 digits


def _with_numbers(rows: sympy.Matrix, rates: Sequence[sympy.Expr] = ()) -> sympy.Matrix:
    """Random numbers for all that a matrix is made of."""
    chosen = random.Random(0)
    rows = rows.xreplace({x: sympy.Float(chosen.uniform(0.3, 1.2), 30) for x in rates})
    functions = sorted(rows.atoms(AppliedUndef), key=str)
    symbols = sorted(rows.free_symbols, key=str)
    numbers = {x: sympy.Float(chosen.uniform(0.3, 1.2), 30) for x in (*functions, *symbols)}
    # The time last: functions of it are known by it.
    return rows.xreplace({x: numbers[x] for x in functions}).xreplace(numbers).evalf(30)
