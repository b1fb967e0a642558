"""Noise at inputs of members: beside their motion by matrix exponentials, from value to value.

A chain of masses, linear in its states, takes noise of values that hold or are joined by lines, at one place or two;
periods are from far below a step to longer than the run. The values are the same ones whoever asks (their mean and
deviation are looked at as well); the motion that they make is worked out apart from any method.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.ensemble import noise, uniform
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import RIGHT_END, WRONG_END, refusal
from .scenario import RIGHT, WRONG, Outcome, Scenario

_CASES = 4  # of each kind with each method
_MEMBERS = 6
_SUREST = 6.0  # standard errors that mean and deviation of many values may be off by
_LEAST_VALUES = 200
KINDS = ("hold", "linear", "two", "frames")


class Driven(NamedTuple):
    """A chain y' = A y + B u, how it is run, and the noise of its inputs by name."""

    model: Model
    a: np.ndarray
    b: np.ndarray
    t_end: float
    noises: dict[str, Any]


def draw(r: np.random.Generator, kind: str) -> Driven:
    """One to three masses of 1 kg; the first spring of stiffness k, which differs from member to member."""
    n = int(r.integers(1, 4))
    m = Model("driven")
    m.parameter("k", 1.0)
    springs, dampers = 10.0 ** r.uniform(-0.5, 2.0, n), 10.0 ** r.uniform(-2.0, 0.5, n)
    m.potential("k*x0^2/2")
    for k in range(n):
        m.coordinate(f"x{k}", start=float(r.normal()))
        m.kinetic(f"dot(x{k})^2/2")
        m.force(f"x{k}", f"-{float(dampers[k])!r}*dot(x{k})")
        if k:
            m.potential(f"{float(springs[k])!r}*(x{k} - x{k - 1})^2/2")
    a = np.zeros((2 * n, 2 * n))
    a[:n, n:] = np.eye(n)
    a[n:, n:] = -np.diag(dampers)
    for k in range(1, n):
        a[n + k, k] -= springs[k]
        a[n + k, k - 1] += springs[k]
        a[n + k - 1, k - 1] -= springs[k]
        a[n + k - 1, k] += springs[k]
    t_end = float(10.0 ** r.uniform(-0.5, 1.2))
    names = ["F", "G"] if kind == "two" else ["F"]
    b, noises = np.zeros((2 * n, len(names))), {}
    for k, name in enumerate(names):
        m.input(name)
        at, gain = int(r.integers(0, n)), float(r.normal(0.0, 3.0))
        m.force(f"x{at}", f"{gain!r}*{name}")
        b[n + at, k] = gain
        period = t_end * float(10.0 ** r.uniform(-2.7, 0.3))
        how = "linear" if kind == "linear" or (kind == "two" and k) else "hold"
        noises[name] = noise(float(10.0 ** r.uniform(-1.0, 1.0)), period, mean=float(r.normal()), kind=how)
    return Driven(m, a, b, t_end, noises)


def motion(case: Driven, k: float, start: np.ndarray, tables: list[Any], times: np.ndarray) -> np.ndarray:
    """States at some times, shape (n, 2 masses): steps from knot to knot with u and its slope as states beside y."""
    from scipy.linalg import expm

    a = case.a.copy()
    n = len(a) // 2
    a[n, 0] -= k
    knots = np.unique(np.concatenate([[0.0], times, *[table.times for table in tables]]))
    knots = knots[knots <= times[-1]]
    n_inputs = len(tables)
    whole = np.zeros((2 * (n + n_inputs),) * 2)
    whole[: 2 * n, : 2 * n], whole[: 2 * n, 2 * n : 2 * n + n_inputs] = a, case.b
    whole[2 * n : 2 * n + n_inputs, 2 * n + n_inputs :] = np.eye(n_inputs)
    y, found = start.copy(), {0.0: start}
    for begin, end in itertools.pairwise(knots):
        u, slopes = np.zeros(n_inputs), np.zeros(n_inputs)
        for i, table in enumerate(tables):
            at = int(np.searchsorted(table.times, 0.5 * (begin + end))) - 1
            if table.kind == "hold":
                u[i] = table.values[at]
            else:
                width = table.times[at + 1] - table.times[at]
                slopes[i] = (table.values[at + 1] - table.values[at]) / width
                u[i] = table.values[at] + slopes[i] * (begin - table.times[at])
        y = (expm(whole * (end - begin)) @ np.concatenate([y, u, slopes]))[: 2 * n]
        found[float(end)] = y
    return np.array([found[float(t)] for t in times])


def noisy(kind: str, number: int, method: str) -> Outcome:
    """Run members and judge each."""
    r = np.random.default_rng([number, *kind.encode()])
    case = draw(r, kind)
    system = runtime.load(derive_text(case.model).text)
    seed, n = int(r.integers(0, 1 << 31)), len(case.a) // 2
    adaptive = method == "auto" or find_method(method).adaptive
    options = {"rtol": 1e-8} if adaptive else {"step": case.t_end / 4000.0}
    frames = np.unique(r.uniform(0.0, case.t_end, 7)).tolist() if kind == "frames" else None
    names = [f"x{k}" for k in range(n)]
    try:
        e = system.ensemble(
            case.t_end, seed=seed, method=method, n=_MEMBERS, parameters={"k": uniform(0.5, 40.0)}, frames=frames,
            inputs=case.noises, keep=[*names, *(f"dot({name})" for name in names)], **options,
        )  # fmt: skip
    except RuntimeModelError as error:
        return refusal(error)
    q, v, _, _ = system.initial_state(system.parameter_values({}))
    start = np.concatenate([q, v])
    worst = 0.0
    for k in range(_MEMBERS):
        tables = [source.table(name, seed, k, 0.0, case.t_end) for name, source in case.noises.items()]
        for table, source in zip(tables, case.noises.values(), strict=True):
            values = (np.array(table.values) - source.mean) / source.deviation
            surest = _SUREST / np.sqrt(len(values))
            if len(values) >= _LEAST_VALUES and max(abs(values.mean()), abs(values.std() - 1.0)) > surest:
                return Outcome(WRONG, f"noise has mean {values.mean():.3g}, deviation {values.std():.3g}")
        looked = np.unique(np.append(np.linspace(0.0, case.t_end, 60), e.t))
        truth = motion(case, float(e["k"][k]), start, tables, looked)
        at = np.searchsorted(looked, e.t)
        series = [e[name][k] for name in e.names]
        off = float(
            (np.abs(np.array(series).T.reshape(len(at), -1) - truth[at]) / np.ptp(truth, axis=0)).max()
        )
        said = f"member {k}, {method}, {case.noises}, to {case.t_end:.4g}: error {off:.1e}"
        if e.verdicts.status[k] != 1:
            continue
        if e.verdicts.ok[k] and not off <= WRONG_END:
            return Outcome(WRONG, said)
        if not e.verdicts.ok[k] and off < RIGHT_END:
            return Outcome(WRONG, f"doubted: {said}, energy {e.verdicts.energy_error[k]:.2g}")
        worst = max(worst, off if e.verdicts.ok[k] else 0.0)
    return Outcome(RIGHT, f"error {worst:.1e}, {e.n_failed} failed, {e.n_doubtful} doubtful, {method}")


def scenarios() -> Iterator[Scenario]:
    """Yield cases of each kind with each method."""
    for kind in KINDS:
        for k, method in enumerate(("auto", *METHODS)):
            for number in range(_CASES):
                run = functools.partial(noisy, kind, number * (len(METHODS) + 1) + k, method)
                short = number == 0 and method in ("auto", "rk4")
                yield Scenario(f"noise: {kind}", f"noise: {kind} {number}: {method}", run, method, short)
