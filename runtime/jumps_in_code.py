"""Jumps and kinks of forces in a run that machine code acts on: its arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.call_block import call_block
from symgen.runtime.events_in_code import EventsInCode, has_plain_events, make_after
from symgen.runtime.integrate import plain_jumps as here
from symgen.runtime.integrate.plain_events import N_LOG

if TYPE_CHECKING:
    from symgen.runtime.code.call_block import CallBlock
    from symgen.runtime.event_actions import EventActions
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.system import System

_FEW = 2  # jumps that cost as much as the arrays


def has_plain_jumps(system: System, arrays: LoopArrays) -> bool:
    """Whether machine code can act on jumps of forces in a run: there are some, and the model has one form."""
    return bool(arrays.jumps) and not system.switches


def has_events_beside_jumps(system: System, arrays: LoopArrays) -> bool:
    """Whether machine code can act on events of a model that are not jumps, beside these."""
    return bool(arrays.jumps) and has_plain_events(system, beside_jumps=True)


def make_jumps(
    form: System, method: Method, arrays: LoopArrays, block: CallBlock, precomputed: np.ndarray
) -> tuple[here.Jumps, list]:
    """Return the arrays of `plain_jumps`, and what keeps their code alive.

    Parameters
    ----------
    form : System
        With stops and frictions held or not.
    block : CallBlock
        The call of its step loop.
    precomputed : ndarray
        What it has worked out of `p`.
    """
    kernels = [form.kernel("events"), form.kernel("rhs")]
    ne, n, n_jumps = len(form.events), form.nq + form.nv, len(arrays.jumps)
    holds_all = bool(precomputed[arrays.branches].all())
    # Views: kernels read the pieces of inputs behind them, which nobody copies at each event.
    p, branched = (precomputed.copy()[: form.n_rewritten] for _ in range(2))
    return here.Jumps(
        addresses=np.array(
            [block.address, *(kernel.precomputed_address for kernel in kernels)], dtype=np.uint64
        ),
        block=block.block, result=np.zeros(1),
        counts=np.array(
            [0, arrays.branches.start, method.multistep, arrays.looks_for_choices, holds_all, 0], dtype=np.int64
        ),
        events=np.array(arrays.jumps, dtype=np.int64), p=p, branched=branched,
        before=np.zeros(n_jumps), after=np.zeros(n_jumps),
        values=np.zeros(ne), first=np.zeros(ne), last=np.zeros(ne), row=np.zeros(form.n_row), ahead=np.zeros(n),
    ), kernels  # fmt: skip


class JumpsInCode:
    """Moves a run on over jumps and kinks of forces.

    Parameters
    ----------
    system : System
        `has_plain_jumps` of it.
    method : Method
    arrays : LoopArrays
    """

    in_both_forms = False
    changes = ()  # nothing of which frames or records have to know

    def __init__(self, system: System, method: Method, arrays: LoopArrays):
        self._system, self._method, self._arrays = system, method, arrays
        self._generation, self._coefficients = -1, None

    def _bind(self) -> None:
        self._own = self._make()
        self._call = call_block(here.advance_over_jumps, self._arrays.loop(), self._own)

    def _make(self) -> here.Jumps:
        """Return the arrays of `plain_jumps`; keeps their code alive."""
        arrays, block = self._arrays, self._arrays.block()
        self._generation, self._coefficients = arrays.generation, arrays.coefficients
        own, kernels = make_jumps(self._system, self._method, arrays, block, arrays.precomputed)
        self._keep = block, kernels
        return own

    def advance(
        self, actions: EventActions, stop: float, max_steps: int, watch: float, *, keep_log: bool
    ) -> int:
        """Run the loop, and change branches, until something is for Python to do; see `LoopArrays.advance`."""
        arrays = self._arrays
        if actions.n_jumps < _FEW:
            return arrays.advance(stop, max_steps, watch=watch, keep_log=keep_log)
        self._prepare(stop, max_steps, watch, keep_log=keep_log)
        status = self._call()
        actions.n_jumps += int(self._own.counts[here.N_JUMPS])
        return status

    def _prepare(self, stop: float, max_steps: int, watch: float, *, keep_log: bool) -> None:
        """Let machine code know what has changed since the last call, and how far to go."""
        arrays = self._arrays
        arrays.set_limits(stop, max_steps, watch, keep_log=keep_log)
        arrays.look_for_choices()
        if self._generation != arrays.generation or self._coefficients is not arrays.coefficients:
            self._bind()
        self._own.counts[here.N_JUMPS] = self._own.counts[here.IS_UNDECIDED] = 0
        self._own.p[:] = arrays.precomputed[: self._system.n_rewritten]  # inputs have gone on
        self._own.p[arrays.branches] = arrays.p[arrays.branches]


class EventsBesideJumps(JumpsInCode, EventsInCode):
    """Moves a run on over jumps of forces and plain events.

    Parameters
    ----------
    system : System
        `has_events_beside_jumps` of it.
    method : Method
    arrays : LoopArrays
    """

    def __init__(self, system: System, method: Method, arrays: LoopArrays):
        EventsInCode.__init__(self, system, method, arrays)
        self._coefficients = None

    def _bind(self) -> None:
        loop, self._own, jumps = self._arrays.loop(), self._make(), self._keep
        self._after, events = make_after(self._system, self._method, self._arrays, jumps[0])
        self._keep, self._handed = (jumps, events), None
        plain = loop._replace(p=self._own.p)
        self._call = call_block(here.advance_over_jumps_and_events, loop, plain, self._own, self._after)

    def advance(
        self, actions: EventActions, stop: float, max_steps: int, watch: float, *, keep_log: bool
    ) -> int:
        """Run the loop, and act on jumps and events, until something is for Python to do."""
        if actions.n_jumps + len(actions.log) < _FEW:
            return self._arrays.advance(stop, max_steps, watch=watch, keep_log=keep_log)
        self._prepare(stop, max_steps, watch, keep_log=keep_log)
        self._hand_over(actions)
        status = self._call()
        actions.n_jumps += int(self._own.counts[here.N_JUMPS])
        n = int(self._after.counts[N_LOG])
        if n:
            self._take_over(actions, n)
        if self._own.counts[here.IS_UNDECIDED]:
            actions.choose_branches()
        return status
