"""The first numbers of a run, to be checked by hand: the state, M, f, a, G, γ, λ at the start, and two steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, evaluate, projected
from symgen.runtime.names import acceleration_labels
from symgen.runtime.report.html import Markup, number, paragraph, table

if TYPE_CHECKING:
    from symgen.runtime.checks.advice import Advice
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System


@dataclass(frozen=True)
class Start:
    """The equations of motion M a = f + Gᵀ λ, G a = γ in one state.

    Attributes
    ----------
    t : float [s]
    q, v, a, f : ndarray, shapes (nq,), (nv,), (nv,), (nv,)
    multipliers, gamma : ndarray, shape (m,)
    mass_matrix : ndarray, shape (nv, nv)
    jacobian : ndarray, shape (m, nv)
    """

    t: float
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    f: np.ndarray
    multipliers: np.ndarray
    gamma: np.ndarray
    mass_matrix: np.ndarray
    jacobian: np.ndarray

    @property
    def imbalance(self) -> float:
        """Largest component of M a - f - Gᵀ λ and G a - γ."""
        motion = self.mass_matrix @ self.a - self.f - self.jacobian.T @ self.multipliers
        constraints = self.jacobian @ self.a - self.gamma
        return float(np.abs(np.concatenate([motion, constraints])).max(initial=0.0))


def start_values(system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray) -> Start:
    """Return the equations of motion in numbers.

    Parameters
    ----------
    p : ndarray, shape (n_p,)
    t : float [s]
    q, v : ndarray, shapes (nq,) and (nv,)
    """
    times, states = np.array([t]), np.concatenate([q, v])[None]
    m, nv = system.m, system.nv
    a, multipliers = (rows[0] for rows in accelerations_and_multipliers(system, p, times, states))

    def row(function: str) -> np.ndarray:
        return evaluate(system, function, p, times, states)[0]

    return Start(
        t=t, q=q, v=v, a=a, f=row("forces"), multipliers=multipliers,
        gamma=row("gamma") if m else np.zeros(0),
        mass_matrix=row("mass_matrix").reshape(nv, nv),
        jacobian=row("constraint_jacobian").reshape(m, nv) if m else np.zeros((0, nv)),
    )  # fmt: skip


# (t, q, v) -> the acceleration there.
Accelerations = Callable[[float, np.ndarray, np.ndarray], np.ndarray]
# What a formula gives: the accelerations that it takes, one after the other, and the new q and v.
Taken = tuple[list[np.ndarray], np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Formula:
    """A method that can be followed by hand.

    Attributes
    ----------
    says : str
        The formula.
    stages : tuple of str
        What the accelerations are called that it takes.
    step : callable
        (accelerations, t, q, v, h) -> what it gives.
    """

    says: str
    stages: tuple[str, ...]
    step: Callable[[Accelerations, float, np.ndarray, np.ndarray, float], Taken]


def _euler(a: Accelerations, t: float, q: np.ndarray, v: np.ndarray, h: float) -> Taken:
    a1 = a(t, q, v)
    return [a1], q + h * v, v + h * a1


def _semi_implicit_euler(a: Accelerations, t: float, q: np.ndarray, v: np.ndarray, h: float) -> Taken:
    a1 = a(t, q, v)
    return [a1], q + h * (v + h * a1), v + h * a1


def _verlet(a: Accelerations, t: float, q: np.ndarray, v: np.ndarray, h: float) -> Taken:
    a1 = a(t, q, v)
    q_next = q + h * v + h**2 / 2.0 * a1
    a2 = a(t + h, q_next, v + h * a1)
    return [a1, a2], q_next, v + h / 2.0 * (a1 + a2)


def _rk4(a: Accelerations, t: float, q: np.ndarray, v: np.ndarray, h: float) -> Taken:
    a1 = a(t, q, v)
    v2 = v + h / 2.0 * a1
    a2 = a(t + h / 2.0, q + h / 2.0 * v, v2)
    v3 = v + h / 2.0 * a2
    a3 = a(t + h / 2.0, q + h / 2.0 * v2, v3)
    v4 = v + h * a3
    a4 = a(t + h, q + h * v3, v4)
    stages = [a1, a2, a3, a4]
    return stages, q + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


# By the name of the method; of the others the second one shows what a step is.
FORMULAS = {
    "euler": Formula("v' = v + h a(t, q, v), q' = q + h v", ("a",), _euler),
    "semi_implicit_euler": Formula("v' = v + h a(t, q, v), q' = q + h v'", ("a",), _semi_implicit_euler),
    "verlet": Formula(
        "q' = q + h v + h²/2 a1, v' = v + h/2 (a1 + a2), a1 = a(t, q, v), a2 = a(t + h, q', v + h a1)",
        ("a1", "a2"),
        _verlet,
    ),
    "rk4": Formula(
        "q' = q + h/6 (v1 + 2 v2 + 2 v3 + v4), v' = v + h/6 (a1 + 2 a2 + 2 a3 + a4), v1 = v, a1 = a(t, q, v), "
        "v2 = v + h/2 a1, a2 = a(t + h/2, q + h/2 v1, v2), v3 = v + h/2 a2, a3 = a(t + h/2, q + h/2 v2, v3), "
        "v4 = v + h a3, a4 = a(t + h, q + h v3, v4)",
        ("a1", "a2", "a3", "a4"),
        _rk4,
    ),
}
SHOWN_OTHERWISE = "semi_implicit_euler"


@dataclass(frozen=True)
class Step:
    """A step by a formula.

    Attributes
    ----------
    t : float [s]
    q, v : ndarray
        Where it begins.
    stages : list of ndarray
        The accelerations that it takes.
    q_formula, v_formula : ndarray
        What the formula gives.
    q_next, v_next : ndarray
        The same, brought onto the constraints.
    """

    t: float
    q: np.ndarray
    v: np.ndarray
    stages: list[np.ndarray]
    q_formula: np.ndarray
    v_formula: np.ndarray
    q_next: np.ndarray
    v_next: np.ndarray


def steps_by_formula(
    system: System, p: np.ndarray, t: float, q: np.ndarray, v: np.ndarray, h: float, name: str, n: int = 2
) -> list[Step]:
    """Return steps of a method by its formula, with projection; none where rates are not dq/dt.

    Parameters
    ----------
    h : float [s]
    name : str
        One of `FORMULAS`.
    n : int
        How many steps.
    """
    if system.nq != system.nv:
        return []

    def a(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        state = np.concatenate([q, v])[None]
        return accelerations_and_multipliers(system, p, np.array([t]), state)[0][0]

    steps = []
    for _ in range(n):
        stages, q_formula, v_formula = FORMULAS[name].step(a, t, q, v, h)
        found = np.concatenate([q_formula, v_formula])[None]
        if system.m:
            found = projected(system, p, np.array([t + h]), found)
        q_next, v_next = found[0, : system.nq], found[0, system.nq :]
        steps.append(Step(t, q, v, stages, q_formula, v_formula, q_next, v_next))
        t, q, v = t + h, q_next, v_next
    return steps


_LARGEST_MATRIX = 8  # rates; larger ones are not checked by hand
_STEPS_WITHOUT_RULE = 1000


def first_numbers(solution: Solution, advice: Advice | None) -> list[Markup]:
    """Return the tables of a run's first numbers, or why they are left out."""
    system = solution.system
    if system.nv > _LARGEST_MATRIX or system.switches:
        why = (
            f"{system.nv} rates" if system.nv > _LARGEST_MATRIX else "stops or friction, whose forces switch"
        )
        return [paragraph(f"Left out: the model has {why}, too much to be checked by hand.")]
    t, q, v = float(solution.t[0]), solution.q[0], solution.v[0]
    start = start_values(system, solution.p, t, q, v)
    return [*_start(solution, start), *_two_steps(solution, advice)]


def _start(solution: Solution, start: Start) -> list[Markup]:
    system = solution.system
    labels = acceleration_labels(system.coordinates, system.rates)
    rates = [record["name"] for record in system.rates]
    mass = [(name, *map(number, row)) for name, row in zip(rates, start.mass_matrix)]
    motion = [(label, number(f), number(a)) for label, f, a in zip(labels, start.f, start.a)]
    names = [record["name"] for record in system.constraints]
    rows = zip(names, start.jacobian, start.gamma, start.multipliers)
    pulls = [(name, *map(number, g), number(c), number(x)) for name, g, c, x in rows]
    return [
        paragraph(f"At t = {number(start.t)} s, in the start state above:"),
        table(("M", *rates), mass),
        table(("", "f", "a"), motion),
        table(("G", *rates, "gamma", "lambda"), pulls),
        paragraph(f"What M a = f {'+ Gᵀ λ, G a = γ ' if system.m else ''}leaves over: {start.imbalance:.2g}"),
    ]


def _two_steps(solution: Solution, advice: Advice | None) -> list[Markup]:
    h = solution.step or (advice.rule_step if advice is not None else np.inf)
    if not np.isfinite(h):
        h = (solution.t_end - solution.t_start) / _STEPS_WITHOUT_RULE
    system, t = solution.system, float(solution.t[0])
    follows = solution.method in FORMULAS and solution.constraints in ("none", "projection")
    name = solution.method if follows else SHOWN_OTHERWISE
    steps = steps_by_formula(system, solution.p, t, solution.q[0], solution.v[0], h, name)
    if not steps:
        return []
    formula, held = FORMULAS[name], system.m > 0
    rows = [
        (
            number(s.t),
            c["name"],
            *(number(x[i]) for x in (s.q, s.v, *s.stages, s.v_formula, s.q_formula)),
            *((number(s.v_next[i]), number(s.q_next[i])) if held else ()),
        )
        for s in steps
        for i, c in enumerate(system.coordinates)
    ]
    heads = ("t [s]", "", "q", "v", *formula.stages, "v'", "q'", *(("v' held", "q' held") if held else ()))
    own = "" if follows else f" ({solution.method} is not done by hand)"
    held_text = "; held: brought onto the constraints, where the next step begins" if held else ""
    says = f"Two steps of {name}{own}, {formula.says}, with h = {number(h)} s{held_text}:"
    return [paragraph(says), table(heads, rows)]
