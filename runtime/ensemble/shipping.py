"""What another process needs to run members of an ensemble, as bytes, and what it does with them.

They say first which run time made them, then the model's text, the options, and what is wanted. A process whose run
time is another one refuses, since its members might differ in their last bits.
"""

from __future__ import annotations

import collections
import contextlib
import functools
import importlib.util
import os
import pickle
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from symgen.runtime.code import cache, engine, stand_ins
from symgen.runtime.ensemble.chunk import Chunk, Wanted, run_chunk
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import Plan, make_plan
from symgen.runtime.ensemble.sampling import named_beside
from symgen.runtime.ensemble.store_about import StoreError
from symgen.runtime.ensemble.version import fingerprint
from symgen.runtime.ensemble.work import run_part
from symgen.runtime.ensemble.zarr_store import ZarrStore
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late

machine = Late("symgen.runtime.ensemble.machine")

AHEAD = 2  # chunks under way for each thread or worker
_FOR_A_DEVICE = 3  # threads that make members ready while the device works; more get in each other's way
_NOT_SENT = ("executor", "progress", "reduce", "out", "resume", "threads")
_lock = threading.Lock()


def n_places(options: EnsembleOptions) -> int:
    """Return how many chunks run at the same time."""
    if options.executor is None:
        n = options.threads or len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else [0])
        return n if options.device == "cpu" else min(n, _FOR_A_DEVICE)
    if is_dask(options.executor):
        return max(1, sum(options.executor.ncores().values()))
    return getattr(options.executor, "_max_workers", None) or os.cpu_count() or 1


def is_dask(executor: Any) -> bool:
    """Whether it is the client of a Dask cluster."""
    return hasattr(executor, "scatter") and hasattr(executor, "ncores")


def in_order(
    submit: Callable[[int, int], Any], chunks: Sequence[tuple[int, int]], ahead: int
) -> Iterator[Any]:
    """Submit chunks, so many ahead, and yield what comes of them in their order."""
    waiting: collections.deque[Any] = collections.deque()
    try:
        for chunk in chunks:
            waiting.append(submit(*chunk))
            if len(waiting) >= ahead:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            with contextlib.suppress(
                Exception
            ):  # of an executor that is closed already: there is nothing to cancel
                future.cancel()


def packed(
    plan: Plan, wanted: Wanted, store: ZarrStore | None, gather: bool, *, with_code: bool = False
) -> bytes:
    """Return what another process needs to run members of the ensemble.

    Parameters
    ----------
    with_code : bool
        Whether machine code goes with it, for processors like this one; others compile the text.
    """
    fields = plan.options.__dataclass_fields__
    given = {name: getattr(plan.options, name) for name in fields if name not in _NOT_SENT}
    given |= {"step": plan.single.step}
    place = None if store is None else (os.path.abspath(store.path), store.about["token"])
    code = _machine_code(plan, wanted) if with_code else {}
    # What was chosen for the ensemble is not chosen again.
    content = plan.system, given, plan.choice, wanted, place, gather or store is not None, code
    return pickle.dumps((fingerprint(), _pickled(content)))


def _pickled(content: Any) -> bytes:
    try:
        return pickle.dumps(content)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        if importlib.util.find_spec("cloudpickle") is None:
            raise RuntimeModelError(
                f"a function of reduce or inputs cannot be sent to other processes ({first_line(error)}): define it in "
                "a module, or install cloudpickle"
            ) from None
    import cloudpickle

    return cloudpickle.dumps(content)


def _machine_code(plan: Plan, wanted: Wanted) -> dict[str, bytes]:
    """Return the object code that members of this plan run through, by its key: a few of them run on a copy of it."""
    fresh = pickle.loads(pickle.dumps(plan.system))
    options = replace(plan.options, executor=None, progress=None, step=plan.single.step)
    for known in (machine.lane_loop, machine.lane_map):
        known.cache_clear()  # what is held already would not be asked for
    with stand_ins.avoided(), engine.noted() as keys:
        other = make_plan(fresh, options, plan.choice)
        run_part(other, wanted.names, 0, 1)
    found = {key: cache.fetch(folder / f"{key}.o") for key, folder in keys.items()}
    return {key: code for key, code in found.items() if code is not None}


def run_packed(content: bytes, first: int, last: int, gather: bool = False) -> Chunk:
    """Run members in another process.

    Parameters
    ----------
    content : bytes
        From `packed`.
    gather : bool
        Whether what is kept goes back in any case.
    """
    with _lock:
        plan, wanted, store, needed = _unpacked(content)
    chunk = run_chunk(
        plan, wanted, first, last, None if gather else store, gather or (needed and store is None)
    )
    if chunk.columns:
        chunk = replace(
            chunk, columns={**named_beside(plan.members.values(first, last), wanted.kept), **chunk.columns}
        )
    return chunk


@functools.lru_cache(maxsize=2)
def _unpacked(content: bytes) -> tuple[Plan, Wanted, ZarrStore | None, bool]:
    made_by, inner = pickle.loads(content)
    if made_by != fingerprint():
        raise RuntimeModelError(
            f"the worker on {socket.gethostname()} has symgen {fingerprint()}, but the ensemble comes from symgen "
            f"{made_by}: members would not be the same; install one version everywhere"
        )
    system, given, choice, wanted, place, needed, code = pickle.loads(inner)
    folder = cache.cache_folder("kernels")
    for key, content_of in code.items():
        if not (folder / f"{key}.o").exists():
            cache.store(folder / f"{key}.o", content_of)
    plan = make_plan(system, EnsembleOptions(**given), choice)
    return plan, wanted, None if place is None else _store_at(*place), needed


def _store_at(path: str, token: str) -> ZarrStore | None:
    """Return the client's store where it can be reached from here: a folder of another machine may have its name."""
    with contextlib.suppress(StoreError):
        store = ZarrStore.open(path)
        if store.about["token"] == token and os.access(path, os.W_OK):
            return store
    return None


def what_remains(options: EnsembleOptions) -> str:
    """Say what is left of an ensemble whose workers are gone, and how to get the rest."""
    if options.out is None:
        return 'there is no store, so what is not in a file is lost: out="runs.zarr" keeps members as they come in'
    return f"what is done before is kept in {options.out}: run the rest with new ones, by out and resume (--resume)"


def first_line(error: BaseException) -> str:
    """Return what an error says, in one line."""
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
