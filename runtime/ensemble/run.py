"""Run an ensemble: chunks of its members wherever they run; results in the order of members."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.ensemble.chunk import (
    Chunk,
    Wanted,
    block_size,
    part_size,
    read_reductions,
    reduced,
    stored_chunk,
)
from symgen.runtime.ensemble.dispatch import run_chunks
from symgen.runtime.ensemble.identity import refuse_another
from symgen.runtime.ensemble.method_choice import Choice
from symgen.runtime.ensemble.options import EnsembleOptions
from symgen.runtime.ensemble.plan import Plan, make_plan
from symgen.runtime.ensemble.result import Ensemble, StoredVerdicts
from symgen.runtime.ensemble.shipping import n_places
from symgen.runtime.ensemble.spot_check import forged_chunks, is_of_the_model
from symgen.runtime.ensemble.store import Stored
from symgen.runtime.ensemble.store_about import StoreError
from symgen.runtime.ensemble.tally import Tally
from symgen.runtime.ensemble.verdict import VERDICTS, Verdicts
from symgen.runtime.ensemble.work import check_names, run_part
from symgen.runtime.ensemble.zarr_store import ZarrStore
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.names import motion_records, rate_labels
from symgen.runtime.size import more_than_memory

if TYPE_CHECKING:
    from symgen.runtime.system import System

_SECONDS_OF_CHUNK = 1.0
_CHUNKS_A_SECOND = 400.0  # in all: the scheduler of a cluster spends a millisecond on each
_CHUNKS_PER_PLACE = 4
_CHUNK_NUMBERS = 1 << 23  # of a series in a chunk: 64 MB
_FIRST_LOOK = 8  # members


def run_ensemble(system: System, options: EnsembleOptions) -> Ensemble:
    """Run all members, and return what is kept of them.

    Where it is interrupted (Ctrl-C), what is done is returned, and `Ensemble.n_done` says how far it came.

    Raises
    ------
    RuntimeModelError
        An option does not fit the model, or the first member has no start on the constraints.
    """
    collected = Collector(plan_for(system, options))
    try:
        for chunk in collected.run():
            collected.take(chunk)
    except KeyboardInterrupt:
        collected.plan.notes.append(
            f"interrupted: {collected.n_done} of {collected.plan.members.n} members are done"
        )
    return collected.result()


def plan_for(system: System, options: EnsembleOptions, stored: Stored | None = None) -> Plan:
    """Return the plan of an ensemble, with the method and order that what it goes on with was made with.

    Parameters
    ----------
    stored : Stored, optional
        A file of NumPy to go on with; a store is that of the options.
    """
    about: Mapping[str, Any] = {}
    if stored is not None:
        about = stored.about
    elif options.resume and ZarrStore.is_there(options.out):
        about = ZarrStore.open(options.out).about
    return make_plan(system, options, Choice.from_json(about.get("choice")))


class Collector:
    """Takes chunks in the order of members, and keeps what is wanted of them.

    Parameters
    ----------
    plan : Plan
        With `out`, the store of its options is made, or opened where it is to be resumed.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan, options = plan, plan.options
        self.tally = Tally()
        self._kept = _kept_names(plan.system, options.keep)
        reductions, functions = read_reductions(options.reduce or {})
        plain = [r.name for r in reductions if r.name not in functions]
        check_names(plan.system, [*self._kept, *plain])
        everything = [*_all_names(plan.system)] if functions else []
        names = tuple(dict.fromkeys([*self._kept, *plain, *everything]))
        self.wanted = Wanted(tuple(self._kept), names, reductions, functions)
        if any(reduction.lacks_bins for reduction in reductions):
            self._lay_bins()
        self._reduced = self.wanted.empty()
        self.store = self._store()
        here = options.keep is not None and self.store is None
        n = plan.members.n if here else 0
        shape = (n, len(plan.frame_times)) if len(plan.frame_times) else (n,)
        _refuse_more_than_memory(math.prod(shape) * len(self._kept) * 8)
        self._arrays = {name: np.full(shape, np.nan) for name in self._kept} if here else {}
        self._verdicts = Verdicts.empty(n)
        self._gather = here

    @property
    def n_done(self) -> int:
        """Members that were taken."""
        return self.tally.n

    @property
    def n_failed(self) -> int:
        """Members without a result among them."""
        return self.tally.n_failed

    def _lay_bins(self) -> None:
        """Lay bins of histograms around what the first members do, whoever runs them later."""
        plan = self.plan
        part = run_part(plan, self.wanted.names, 0, min(part_size(plan), plan.members.n))
        first = reduced(plan, self.wanted, part)
        self.wanted = Wanted(
            self.wanted.kept, self.wanted.names, tuple(r.empty() for r in first), self.wanted.worked_out
        )

    def _store(self) -> ZarrStore | None:
        path, plan = self.plan.options.out, self.plan
        if path is None:
            return None
        if self.plan.options.resume and ZarrStore.is_there(path):
            store = ZarrStore.open(path)
            store.refuse_another(plan, self._kept)
            if store.chunk % block_size(plan):
                raise StoreError(f"{path} contradicts itself: its chunk is of another ensemble; begin anew")
            return store
        return ZarrStore.create(path, plan, self._kept, chunk_size(plan, self.wanted))

    def go_on_from(self, stored: Stored) -> None:
        """Take what an ensemble in a file of NumPy that was interrupted has come to.

        Raises
        ------
        RuntimeModelError
            It is another one.
        """
        refuse_another(self.plan, stored.about.get("identity"), "the file")
        done = stored.about["n_done"]
        self._refuse_forged(stored)
        for name, array in self._arrays.items():
            array[:done] = stored.arrays[name][:done]
        for name in VERDICTS:
            getattr(self._verdicts, name)[:done] = stored.arrays[name][:done]
        verdicts = Verdicts(**{name: getattr(self._verdicts, name)[:done] for name in VERDICTS})
        self.tally = Tally.of(0, verdicts, {int(k): said for k, said in stored.about["messages"].items()})

    def _refuse_forged(self, stored: Stored) -> None:
        """Refuse a file whose members are not those of the model."""
        held = {name: values for name, values in stored.arrays.items() if name in self._held_names(stored)}
        fits = stored.about["n"] == self.plan.members.n and all(
            name in held and held[name].shape == array.shape for name, array in self._arrays.items()
        )
        if not fits or not is_of_the_model(self.plan, self._kept, held, stored.about["n_done"]):
            raise RuntimeModelError(
                "the file holds numbers that are not those of this ensemble, although it says so: it was changed; "
                "begin anew with another file"
            )

    def _held_names(self, stored: Stored) -> set[str]:
        return {*stored.about["varied"], *self._arrays, *VERDICTS}

    def run(self) -> Iterator[Chunk]:
        """Run what is left, and yield it, together with what a store has already, in the order of members."""
        with contextlib.nullcontext() if self.store is None else self.store.held():
            yield from self._run()

    def _run(self) -> Iterator[Chunk]:
        plan, store = self.plan, self.store
        known = {}
        if store is not None:
            chunks = [store.rows(k) for k in range(store.n_chunks)]
            known = {store.rows(k)[0]: k for k in store.done()} if plan.options.resume else {}
        else:
            block, places = block_size(plan), n_places(plan.options)
            size = block if plan.options.executor is None else chunk_size(plan, self.wanted)
            chunks = chunks_between(self.n_done, plan.members.n, size, block, places)
        whole = {first for first, k in known.items() if self._is_whole(k)}
        forged = forged_chunks(plan, self._kept, store, [known[first] for first in whole]) if whole else []
        for k in forged:
            first, last = store.rows(k)
            plan.notes.append(
                f"members {first} to {last - 1} of the store were not those of the model, and run again"
            )
            store.discard(k)
            whole.discard(first)
        left = run_chunks(plan, self.wanted, [c for c in chunks if c[0] not in whole], store, self._gather)
        for first, _ in chunks:
            if first in whole:
                yield stored_chunk(self.wanted, store, known[first], block_size(plan))
            else:
                yield next(left)

    def _is_whole(self, k: int) -> bool:
        """Whether a chunk of the store can be read; if not, it is run again."""
        try:
            stored_chunk(self.wanted, self.store, k, block_size(self.plan))
        except RuntimeModelError:
            self.store.discard(k)
            return False
        return True

    def take(self, chunk: Chunk) -> None:
        """Take the next chunk."""
        for name in chunk.columns if self._gather else ():
            array = self._arrays.get(name)
            array = getattr(self._verdicts, name) if name in VERDICTS else array
            if array is not None:
                array[chunk.first : chunk.last] = chunk.columns[name]
        try:
            for block in chunk.blocks:
                for total, reduction in zip(self._reduced, block, strict=True):
                    total.merge(reduction)
        except (ValueError, IndexError, TypeError) as error:
            raise RuntimeModelError(
                f"statistics of members {chunk.first} to {chunk.last - 1} do not fit: {error}"
            ) from None
        self.tally.add(chunk.tally)
        if self.plan.options.progress is not None:
            self.plan.options.progress(self.n_done, self.plan.members.n, self.n_failed)

    def result(self) -> Ensemble:
        """Return the ensemble."""
        return Ensemble(
            plan=self.plan, tally=self.tally, series=self._arrays, store=self.store,
            verdicts=self._verdicts if self.store is None else StoredVerdicts(self.store),
            reduced={reduction.name: reduction.result() for reduction in self._reduced},
        )  # fmt: skip


def chunks_between(first: int, end: int, size: int, block: int, places: int) -> list[tuple[int, int]]:
    """Return chunks of so many members, shorter ones at the end, of whole blocks, so that all places end together.

    There each takes its share of half of what is left: guided self-scheduling (Polychronopoulos, Kuck, IEEE Trans.
    Comput. C-36 (1987) 1425).
    """
    chunks = []
    while first < end:
        share = -(-(end - first) // (2 * places * block)) * block
        last = min(first + max(min(size, share), block), end)
        chunks.append((first, last))
        first = last
    return chunks


def chunk_size(plan: Plan, wanted: Wanted) -> int:
    """Return members of a chunk: as many whole blocks as take a second, of which each place still gets several."""
    block, n = block_size(plan), plan.members.n
    if plan.options.device != "cpu":
        return block
    places = n_places(plan.options)
    wanted_seconds = max(_SECONDS_OF_CHUNK, places / _CHUNKS_A_SECOND)
    by_time = wanted_seconds / max(_seconds_of_members(plan, wanted.names), 1e-9)
    each = -(-n // (_CHUNKS_PER_PLACE * places))
    most = min(by_time, each, _CHUNK_NUMBERS / max(len(plan.frame_times), 1))
    return block * max(1, int(most / block))


def _seconds_of_members(plan: Plan, names: Sequence[str]) -> float:
    """Return how long a member takes, by running a few of them."""
    took = 0.0
    for length in (1, _FIRST_LOOK, part_size(plan)):
        length = min(length, plan.members.n)
        began = time.thread_time()
        run_part(plan, names, 0, length)
        took = (time.thread_time() - began) / length
        if took * part_size(plan) > _SECONDS_OF_CHUNK and length > 1:
            break
    return took


def _all_names(system: System) -> list[str]:
    coordinates = [record["name"] for _, record in motion_records(system.coordinates, system.integrals)]
    return [*coordinates, *rate_labels(system.coordinates, system.rates)]


def _refuse_more_than_memory(n_bytes: int) -> None:
    """Refuse series that this machine cannot hold: they are filled at once, and systems end who fills too much."""
    if needed := more_than_memory(n_bytes):
        raise RuntimeModelError(
            f"series of all members {needed}: keep "
            'fewer of them (keep, --keep), fewer frames, or a store on disk (out="runs.zarr", --out runs.zarr)'
        )


def _kept_names(system: System, keep: Any) -> list[str]:
    if keep is None:
        return []
    return _all_names(system) if keep == "end" else list(dict.fromkeys(keep))
