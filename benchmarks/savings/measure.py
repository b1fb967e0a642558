"""Rows of the table, times taken by turns, and whether results are the same."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from symgen.derive import pipeline
from symgen.emit.module import emit
from symgen.link import derive_text
from symgen.model.library import find
from symgen.model.library import load as load_model
from symgen.model.model import Model
from symgen.runtime import Solution, System, load, solve
from symgen.runtime.code.bridge import evaluate_rows

REPEATS = 7
CALLS = 2000
_NUMBERS = 4_000_000  # of all results of a function's calls
SOURCE = "sha256:" + 64 * "0"


@dataclass(frozen=True)
class Row:
    """One saving in one scene; seconds with it and without, and what became of the results."""

    scene: str
    saving: str
    with_it: float
    without: float
    results: str

    @property
    def factor(self) -> float:
        """How many times longer the work takes without the saving."""
        return self.without / self.with_it


@contextmanager
def replaced(owner: Any, **values: Any) -> Iterator[None]:
    """Attributes of a module or class that have other values for a while."""
    before = {name: getattr(owner, name) for name in values}
    for name, value in values.items():
        setattr(owner, name, value)
    try:
        yield
    finally:
        for name, value in before.items():
            setattr(owner, name, value)


def bundled(name: str, **options: str) -> System:
    """The system of a bundled model."""
    return load(derive_text(load_model(find(name), options)).text)


def derived(model: Model | str, **options: Any) -> System:
    """The system of a model, or of a bundled one, as one system; options are those of `pipeline.derive`."""
    model = load_model(find(model), {}) if isinstance(model, str) else model
    return load(emit(pipeline.derive(model.describe(), SOURCE, **options)))


def by_turns(*works: Callable[[], object], repeats: int = REPEATS) -> list[float]:
    """The least processor time of each work [s], done by turns, so that a busy machine treats all alike."""
    least = [np.inf] * len(works)
    for _ in range(repeats):
        for k, work in enumerate(works):
            began = time.thread_time()
            work()
            least[k] = min(least[k], time.thread_time() - began)
    return least


def runs(*given: tuple[System, dict], repeats: int = REPEATS) -> tuple[list[Solution], list[float]]:
    """Solutions of systems with options for `solve`, and the processor time of each whole run [s]."""
    works = [lambda system=system, options=options: solve(system, **options) for system, options in given]
    return [work() for work in works], by_turns(*works, repeats=repeats)


def calls(*systems: System, function: str = "rhs") -> tuple[list[np.ndarray], list[float]]:
    """Values of a function at states around the start, and the processor time of a call [s]."""
    first = systems[0]
    q, v, _, _ = first.initial_state()
    n_rows, n_extended = first.nv + first.m, first.nq + 2 * first.nv + first.m
    lengths = {"rhs": first.n_row, "residual": n_rows, "residual_jacobian": n_rows * n_extended}
    n_calls = max(20, min(CALLS, _NUMBERS // lengths[function]))
    more = np.zeros(n_extended - len(q) - len(v) if function.startswith("residual") else 0)
    center = np.concatenate([q, v, more])
    states = np.random.default_rng(7).normal(center, 0.1, (n_calls, len(center)))
    times, rows, works = np.zeros(n_calls), [], []
    for system in systems:
        p = system.precomputed(system.parameter_values())
        address = system.kernel(function).precomputed_address
        out = np.zeros((n_calls, system.n_row if function == "rhs" else lengths[function]))
        works.append(lambda a=address, p=p, out=out: evaluate_rows(a, times, states, p, out))
        works[-1]()
        rows.append(out)
    return rows, [seconds / n_calls for seconds in by_turns(*works, repeats=20 * REPEATS)]


def without_hoisting(system: System) -> System:
    """The same model with its work on parameters done in every call."""
    header = {key: value for key, value in system.source.header.items() if key != "hoisted"}
    return System(replace(system.source, header=header))


def compared(a: Solution, b: Solution) -> str:
    """Whether two solutions have the same frames."""
    return difference(np.hstack([a.q, a.v]), np.hstack([b.q, b.v]))


def difference(a: np.ndarray, b: np.ndarray) -> str:
    """Whether two arrays are the same, or how far they are from it."""
    if np.array_equal(a, b, equal_nan=True):
        return "same bits"
    return f"{np.abs(a - b).max() / max(np.abs(a).max(), np.finfo(float).tiny):.1e}"


def words(seconds: float) -> str:
    """A time with a unit that suits it."""
    factor, unit = next(
        (f, u) for f, u in ((1.0, "s"), (1e3, "ms"), (1e6, "µs"), (1e9, "ns")) if seconds * f >= 1.0
    )
    return f"{seconds * factor:.3g} {unit}"


def line(cells: Sequence[str]) -> str:
    """A row of a table in Markdown."""
    return f"| {' | '.join(cells)} |"
