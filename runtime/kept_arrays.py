"""Arrays of step loops that serve one run after another: making them takes longer than many runs do."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.loop_arrays import LoopArrays

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.system import System

_MOST_KINDS, _LARGEST = 8, 200_000  # that a model keeps; numbers in their frames


def borrow(
    system: System,
    method: Method,
    p: np.ndarray,
    t: float,
    state: np.ndarray,
    *,
    frame_times: np.ndarray,
    rtol: float,
    atol: float,
    step: float = 0.0,
    energy_level: float = np.nan,
    with_events: bool = True,
    log_length: int = 4096,
    opening: object = None,
) -> LoopArrays:
    """Return arrays for a run, as `LoopArrays` are made of these arguments; those of a run before, if there are any.

    Frames are left as they were. Whoever has read all that is needed may `give_back` the arrays.

    Parameters
    ----------
    opening : object, optional
        Stands for all other arguments: where the run before was loaded with the same one, the arrays are as `load`
        left them then.
    """
    given = p, t, state
    kept = None
    if system.is_repeatable and not system.events and frame_times.size * system.ny <= _LARGEST:
        kinds = vars(system).setdefault("_kept_arrays", {})
        kind = id(method), frame_times.tobytes(), rtol, step, bool(np.isfinite(energy_level)), log_length
        if len(kinds) >= _MOST_KINDS and kind not in kinds:
            kinds.clear()
        kept = kinds.setdefault(kind, deque(maxlen=1))
        try:
            arrays = kept.pop()
        except IndexError:
            pass
        else:
            if opening is None or arrays.opening is not opening:
                arrays.opening = None
                arrays.begin_again(system, method, *given, atol=atol, energy_level=energy_level)
            else:
                arrays.restore(arrays.first_state)
            return arrays
    arrays = LoopArrays(
        system,
        method,
        *given,
        frame_times=frame_times,
        rtol=rtol,
        atol=atol,
        step=step,
        energy_level=energy_level,
        with_events=with_events,
        log_length=log_length,
    )
    arrays.home = kept
    return arrays


def load(arrays: LoopArrays, opening: object) -> None:
    """Load the step loop, which chooses the first step, unless that was done of this opening before."""
    if arrays.opening is opening:
        return
    arrays.load()
    if arrays.home is not None:
        arrays.opening, arrays.first_state = opening, arrays.state()


def give_back(arrays: LoopArrays) -> None:
    """Leave arrays to the next run of their kind, unless another method or form has taken them over."""
    if arrays.home is not None and arrays.generation == 0:
        arrays.home.append(arrays)


@contextlib.contextmanager
def lent(system: System, kind: type, n_precomputed: int) -> Iterator[Any]:
    """Lend what a look at runs of a model takes, `kind(system, n_precomputed)`: that of a look before, if it fits.

    Nobody else has it meanwhile: reports may be made in several threads.
    """
    kept = vars(system).setdefault(f"_kept_{kind.__qualname__}", deque(maxlen=1))
    try:
        look = kept.pop()
    except IndexError:
        look = None
    if look is None or not look.fits(n_precomputed):
        look = kind(system, n_precomputed)
    yield look
    kept.append(look)
