"""Jumps and kinks of forces in a run that machine code acts on: its arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.call_block import call_block
from symgen.runtime.integrate import plain_jumps as here

if TYPE_CHECKING:
    from symgen.runtime.event_actions import EventActions
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.system import System

_FEW = 2  # jumps that cost as much as the arrays


def has_plain_jumps(system: System, arrays: LoopArrays) -> bool:
    """Whether machine code can act on jumps of forces in a run: there are some, and the model has one form."""
    return bool(arrays.jumps) and not system.switches


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
        system, arrays = self._system, self._arrays
        self._generation, self._coefficients = arrays.generation, arrays.coefficients
        block, kernels = arrays.block(), [system.kernel("events"), system.kernel("rhs")]
        ne, n, n_jumps = len(system.events), system.nq + system.nv, len(arrays.jumps)
        holds_all = bool(arrays.precomputed[arrays.branches].all())
        # Views: kernels read the pieces of inputs behind them, which nobody copies at each event.
        p, branched = (arrays.precomputed.copy()[: system.n_rewritten] for _ in range(2))
        self._own = here.Jumps(
            addresses=np.array(
                [block.address, *(kernel.precomputed_address for kernel in kernels)], dtype=np.uint64
            ),
            block=block.block, result=np.zeros(1),
            counts=np.array(
                [0, arrays.branches.start, self._method.multistep, arrays.looks_for_choices, holds_all], dtype=np.int64
            ),
            events=np.array(arrays.jumps, dtype=np.int64), p=p, branched=branched,
            before=np.zeros(n_jumps), after=np.zeros(n_jumps),
            values=np.zeros(ne), first=np.zeros(ne), last=np.zeros(ne), row=np.zeros(system.n_row), ahead=np.zeros(n),
        )  # fmt: skip
        self._keep = block, kernels
        self._call = call_block(here.advance_over_jumps, arrays.loop(), self._own)

    def advance(
        self, actions: EventActions, stop: float, max_steps: int, watch: float, *, keep_log: bool
    ) -> int:
        """Run the loop, and change branches, until something is for Python to do; see `LoopArrays.advance`."""
        arrays = self._arrays
        if actions.n_jumps < _FEW:
            return arrays.advance(stop, max_steps, watch=watch, keep_log=keep_log)
        arrays.set_limits(stop, max_steps, watch, keep_log=keep_log)
        arrays.look_for_choices()
        if self._generation != arrays.generation or self._coefficients is not arrays.coefficients:
            self._bind()
        self._own.counts[here.N_JUMPS] = 0
        self._own.p[:] = arrays.precomputed[: self._system.n_rewritten]  # inputs have gone on
        self._own.p[arrays.branches] = arrays.p[arrays.branches]
        status = self._call()
        actions.n_jumps += int(self._own.counts[here.N_JUMPS])
        return status
