"""Run an ensemble: parts of the queue in threads, or wherever an executor works; results in the order of members."""

from __future__ import annotations

import collections
import functools
import os
import pickle
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import Plan, make_plan
from symgen.runtime.ensemble.reduction import Reduction
from symgen.runtime.ensemble.result import Ensemble
from symgen.runtime.ensemble.store import Stored, key_of
from symgen.runtime.ensemble.verdict import VERDICTS, Verdicts
from symgen.runtime.ensemble.work import Part, check_names, run_part, stop_all
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.names import motion_records, rate_labels

if TYPE_CHECKING:
    from symgen.runtime.system import System

_PART, _SMALLEST_PART = 1024, 64  # members
_PART_NUMBERS = 1 << 21  # of frames in a part
# A device is full with some hundred thousand threads; while it works on one part, another one is made ready.
_DEVICE_PART, _DEVICE_PART_NUMBERS, _DEVICE_THREADS = 1 << 17, 1 << 25, 2
_ONE_BY_ONE = 64  # members of a part that run by themselves
_AHEAD = 2  # parts under way for each thread
_DEFAULT_STATISTICS = ("mean", "std", "min", "max")
_MOST_NAMED = 1000  # members that are named where nothing is kept


def run_ensemble(system: System, options: EnsembleOptions) -> Ensemble:
    """Run all members, and return what is kept of them.

    Where it is interrupted (Ctrl-C), what is done is returned, and `Ensemble.n_done` says how far it came.

    Raises
    ------
    RuntimeModelError
        An option does not fit the model, or the first member has no start on the constraints.
    """
    plan = make_plan(system, options)
    collected = Collector(plan)
    try:
        for part in run_parts(plan, collected.names, 0):
            collected.take(part)
    except KeyboardInterrupt:
        plan.notes.append(f"interrupted: {collected.n_done} of {plan.members.n} members are done")
    return collected.result()


class Collector:
    """Takes parts in the order of members, and keeps what is wanted of them."""

    def __init__(self, plan: Plan) -> None:
        self.plan, options = plan, plan.options
        self.n_done, self.n_failed, self.n_doubtful = 0, 0, 0
        self._kept = _kept_names(plan.system, options.keep)
        self._reductions, self._functions = _reductions(options.reduce or {})
        plain = [name for name in self._reductions if name not in self._functions]
        check_names(plan.system, [*self._kept, *plain])
        everything = [*_all_names(plan.system)] if self._functions else []
        self.names = list(dict.fromkeys([*self._kept, *plain, *everything]))
        n = plan.members.n if options.keep is not None else 0
        shape = (n, len(plan.frame_times)) if len(plan.frame_times) else (n,)
        self._arrays = {name: np.full(shape, np.nan) for name in self._kept}
        self._verdicts = Verdicts.empty(n)
        self._named: list[int] = []
        self._failed: list[int] = []
        self._causes: collections.Counter[int] = collections.Counter()
        self._messages: dict[int, str] = {}

    def go_on_from(self, stored: Stored) -> None:
        """Take what an ensemble that was interrupted has come to.

        Raises
        ------
        RuntimeModelError
            It is another one.
        """
        if stored.about.get("key") != key_of(self.plan):
            raise RuntimeModelError(
                "what the file holds is another ensemble, of another model, other settings or other members: give the "
                "same, or begin anew without --resume"
            )
        done = stored.about["n_done"]
        for name, array in self._arrays.items():
            array[:done] = stored.arrays[name][:done]
        for name in VERDICTS:
            getattr(self._verdicts, name)[:done] = stored.arrays[name][:done]
        failed = self._verdicts.status[:done] != 1
        self.n_done, self.n_failed = done, int(failed.sum())
        self.n_doubtful = int((~self._verdicts.ok[:done] & ~failed).sum())
        self._causes.update(self._verdicts.status[:done][failed].tolist())
        self._failed = np.flatnonzero(failed)[:_MOST_NAMED].tolist()
        self._named = np.flatnonzero(~self._verdicts.ok[:done])[:_MOST_NAMED].tolist()
        self._messages = {int(k): said for k, said in stored.about["messages"].items()}

    def take(self, part: Part) -> None:
        """Take the next part."""
        n, verdicts = len(part.verdicts.status), part.verdicts
        if self.plan.options.keep is not None:
            self._verdicts.put(part.first, verdicts)
            for name, array in self._arrays.items():
                array[part.first : part.first + n] = part.series[name]
        for name, reduction in self._reductions.items():
            function = self._functions.get(name)
            reduction.take(part.series[name] if function is None else self._worked_out(name, function, part))
        failed = verdicts.status != 1
        self._causes.update(verdicts.status[failed].tolist())
        self._failed += (
            part.first + np.flatnonzero(failed)[: max(_MOST_NAMED - len(self._failed), 0)]
        ).tolist()
        self.n_failed += int(failed.sum())
        self.n_doubtful += int((~verdicts.ok & ~failed).sum())
        left = _MOST_NAMED - len(self._named)
        self._named += (part.first + np.flatnonzero(~verdicts.ok)[: max(left, 0)]).tolist()
        if len(self._messages) < _MOST_NAMED:
            self._messages |= part.messages
        self.n_done = part.first + n
        if self.plan.options.progress is not None:
            self.plan.options.progress(self.n_done, self.plan.members.n, self.n_failed)

    def _worked_out(self, name: str, function: Any, part: Part) -> np.ndarray:
        given = {
            **part.series,
            **self.plan.members.values(part.first, part.first + len(part.verdicts.status)),
        }
        values = np.asarray(function(given), dtype=float)
        n = len(part.verdicts.status)
        if values.ndim < 1 or len(values) != n:
            raise RuntimeModelError(
                f"reduce: {name}: the function gave an array of shape {values.shape} for {n} members; the first axis "
                "must be that of the members"
            )
        return np.where((part.verdicts.status == 1).reshape(n, *[1] * (values.ndim - 1)), values, np.nan)

    def result(self) -> Ensemble:
        """Return the ensemble."""
        return Ensemble(
            plan=self.plan, n_done=self.n_done, series=self._arrays, verdicts=self._verdicts,
            reduced={name: reduction.result() for name, reduction in self._reductions.items()},
            n_failed=self.n_failed, n_doubtful=self.n_doubtful, named=self._named, messages=self._messages,
            first_failed=self._failed, causes=dict(self._causes),
        )  # fmt: skip


def run_parts(plan: Plan, names: Sequence[str], first: int) -> Iterator[Part]:
    """Run members from `first` on, and yield parts in their order."""
    size = part_size(plan)
    parts = ((k, min(k + size, plan.members.n)) for k in range(first, plan.members.n, size))
    options = plan.options
    threads = options.threads or len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else [0])
    if options.device != "cpu":
        threads = min(threads, _DEVICE_THREADS)
    if options.executor is not None:
        work = functools.partial(run_packed, packed(plan), tuple(names))
        yield from _in_order(options.executor, work, parts, 2 * _AHEAD * (os.cpu_count() or 1))
        return
    # The main thread waits beside them, so that Ctrl-C has an answer at once.
    with ThreadPoolExecutor(threads) as executor:
        try:
            yield from _in_order(executor, functools.partial(run_part, plan, names), parts, _AHEAD * threads)
        except BaseException:
            stop_all()
            raise


def part_size(plan: Plan) -> int:
    """Members of a part: what they are does not depend on it."""
    if plan.settings is None:
        return _ONE_BY_ONE
    numbers = max(len(plan.frame_times), 1) * plan.system.ny + plan.system.n_precomputed + plan.system.n_row
    if plan.options.device != "cpu":
        return max(_SMALLEST_PART, min(_DEVICE_PART, _DEVICE_PART_NUMBERS // max(numbers, 1)))
    return max(_SMALLEST_PART, min(_PART, _PART_NUMBERS // max(numbers, 1)))


def _in_order(executor: Executor, work: Any, parts: Iterator[tuple[int, int]], ahead: int) -> Iterator[Part]:
    waiting: collections.deque[Future] = collections.deque()
    try:
        for part in parts:
            waiting.append(executor.submit(work, *part))
            if len(waiting) >= ahead:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()


def packed(plan: Plan) -> bytes:
    """Return what another process needs to run members of the ensemble."""
    options = EnsembleOptions(
        **{
            name: getattr(plan.options, name)
            for name in plan.options.__dataclass_fields__
            if name not in ("executor", "progress", "reduce")
        }
    )
    return pickle.dumps((plan.system, options))


def run_packed(content: bytes, names: Sequence[str], first: int, last: int) -> Part:
    """Run members in another process."""
    return run_part(_unpacked(content), names, first, last)


@functools.lru_cache(maxsize=2)
def _unpacked(content: bytes) -> Plan:
    return make_plan(*pickle.loads(content))


def _all_names(system: System) -> list[str]:
    coordinates = [record["name"] for _, record in motion_records(system.coordinates, system.integrals)]
    return [*coordinates, *rate_labels(system.coordinates, system.rates)]


def _kept_names(system: System, keep: str | Sequence[str] | None) -> list[str]:
    if keep is None:
        return []
    return _all_names(system) if keep == "end" else list(keep)


def _reductions(given: Any) -> tuple[dict[str, Reduction], dict[str, Any]]:
    """Return reductions by name, and functions of those that are worked out."""
    found, functions = {}, {}
    for name, wanted in given.items():
        statistics = wanted
        if callable(wanted):
            functions[name], statistics = wanted, _DEFAULT_STATISTICS
        elif isinstance(wanted, tuple) and len(wanted) == 2 and callable(wanted[0]):
            functions[name], statistics = wanted
        if isinstance(statistics, str) or not isinstance(statistics, (list, tuple)):
            statistics = [statistics]
        found[name] = Reduction(name, statistics)
    return found, functions
