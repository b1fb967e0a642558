"""Chunks of an ensemble on the workers of a Dask cluster: what they need goes out once, with a plugin.

A plugin is what every worker of a cluster has, also those that take the place of others later; what is scattered, or
kept as the result of a task, is gone with the workers that hold it. Workers that die are replaced, and what they had to
do is run again, by the scheduler; members that end their workers are found here.
"""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from distributed import KilledWorker, WorkerPlugin

from symgen.runtime.ensemble.chunk import Chunk, Wanted, block_size
from symgen.runtime.ensemble.sampling import named_beside
from symgen.runtime.ensemble.shipping import AHEAD, in_order, n_places, packed, run_packed, what_remains
from symgen.runtime.ensemble.tally import Tally
from symgen.runtime.ensemble.verdict import CAUSES, VERDICTS, WORKER_LOST, Verdicts
from symgen.runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from symgen.runtime.ensemble.plan import Plan
    from symgen.runtime.ensemble.zarr_store import ZarrStore

_TRIES = 2  # of a block
_LOOK_EVERY, _PATIENCE = 5.0, 60.0  # [s]
_held: dict[str, bytes] = {}  # on a worker: what its plugins have brought


class Content(WorkerPlugin):
    """What members of an ensemble need to run on a worker.

    Parameters
    ----------
    content : bytes
        From `shipping.packed`.
    """

    def __init__(self, content: bytes) -> None:
        self._content = content
        self.name = f"symgen-{hashlib.sha256(content).hexdigest()[:32]}"

    def setup(self, worker: Any) -> None:
        """Begin to hold it; Dask calls this on each worker."""
        _held[self.name] = self._content

    def teardown(self, worker: Any) -> None:
        """Hold it no longer."""
        _held.pop(self.name, None)


def run(
    client: Any,
    plan: Plan,
    wanted: Wanted,
    chunks: Sequence[tuple[int, int]],
    store: ZarrStore | None,
    gather: bool,
) -> Iterator[Chunk]:
    """Run chunks of members on a cluster, and yield them in their order; see `dispatch.run_chunks`."""
    content = Content(packed(plan, wanted, store, gather, with_code=True))
    client.register_plugin(content)
    try:
        tasks = in_order(
            lambda *chunk: _Waiting(client.submit(_run, content.name, *chunk, pure=False), *chunk),
            chunks, AHEAD * n_places(plan.options),
        )  # fmt: skip
        for waiting in tasks:
            try:
                yield _result(client, waiting.task, waiting.first, plan)
            except KilledWorker:
                yield _rescued(client, content.name, plan, wanted, waiting.first, waiting.last)
    finally:
        with contextlib.suppress(
            Exception
        ):  # the cluster may be gone, which is no reason to lose what is done
            client.unregister_worker_plugin(content.name)


def _run(name: str, first: int, last: int, gather: bool = False) -> Chunk:
    """Run a chunk on a worker."""
    if name not in _held:
        raise RuntimeModelError(
            "a worker of the Dask cluster has not got what members need: start the cluster again"
        )
    return run_packed(_held[name], first, last, gather)


def _result(client: Any, task: Any, first: int, plan: Plan) -> Chunk:
    """Wait for a task as long as the cluster has workers, or may get new ones.

    Raises
    ------
    RuntimeModelError
        It has had none for a minute.
    """
    alone = 0.0
    while alone < _PATIENCE:
        try:
            return task.result(timeout=_LOOK_EVERY)
        except TimeoutError:
            alone = 0.0 if client.ncores() else alone + _LOOK_EVERY
    raise RuntimeModelError(
        f"the Dask cluster has had no workers for {_PATIENCE:g} s while members from {first} on were to be run; "
        f"{what_remains(plan.options)}"
    )


class _Waiting:
    """A task, and which members it is about; `result` is itself, so that what went wrong is seen by who asks."""

    def __init__(self, task: Any, first: int, last: int) -> None:
        self.task, self.first, self.last = task, first, last

    def result(self) -> _Waiting:
        return self

    def cancel(self) -> None:
        self.task.cancel()


def _rescued(client: Any, name: str, plan: Plan, wanted: Wanted, first: int, last: int) -> Chunk:
    """Run a chunk block by block that has ended several workers: members of a block that does so again have failed.

    It may be innocent: the scheduler suspects all that a worker had to do when it died. So each block has two tries.
    """
    length = block_size(plan)
    blocks = ((k, min(k + length, last)) for k in range(first, last, length))
    return joined([_tried(client, name, plan, *block) or _lost(plan, wanted, *block) for block in blocks])


def _tried(client: Any, name: str, plan: Plan, first: int, last: int) -> Chunk | None:
    for _ in range(_TRIES):
        with contextlib.suppress(KilledWorker):
            task = client.submit(_run, name, first, last, True, pure=False)
            return _result(client, task, first, plan)
    return None


def _lost(plan: Plan, wanted: Wanted, first: int, last: int) -> Chunk:
    """The chunk of members of which nothing came back."""
    n, shape = last - first, (last - first, *((len(plan.frame_times),) if len(plan.frame_times) else ()))
    verdicts = Verdicts.empty(n)
    verdicts.status[:] = WORKER_LOST
    columns = named_beside(plan.members.values(first, last), wanted.kept)
    columns |= {name: np.full(shape, np.nan) for name in wanted.kept}
    columns |= {name: getattr(verdicts, name) for name in VERDICTS}
    tally = Tally.of(first, verdicts, {first: CAUSES[WORKER_LOST]})
    return Chunk(first, last, tally, [wanted.empty()], columns)


def joined(chunks: Sequence[Chunk]) -> Chunk:
    """Return chunks that follow each other as one."""
    tally = Tally()
    for chunk in chunks:
        tally.add(chunk.tally)
    names = chunks[0].columns
    columns = {name: np.concatenate([chunk.columns[name] for chunk in chunks]) for name in names}
    return Chunk(
        chunks[0].first, chunks[-1].last, tally, [b for chunk in chunks for b in chunk.blocks], columns
    )
