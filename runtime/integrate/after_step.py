"""What every method does after an accepted step: events, frames, the step log."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.events import event_scratch_size, find_event
from symgen.runtime.integrate.frames import frame_is_due, write_frames
from symgen.runtime.integrate.layout import (
    ASIDE,
    EVENT,
    F_VALID,
    H_LAST,
    N_LOGGED_STEPS,
    NE,
    NEXT_FRAME,
    NY,
    REACHED_STOP,
    RUNNING,
    STEPS,
    T_EVENT,
    T_STOP,
    T,
)
from symgen.runtime.integrate.projection import projection_size


@jitted
def finish_scratch_size(sizes):
    """Length of the scratch array that `finish_step` needs."""
    return projection_size(sizes) + sizes[NY] + event_scratch_size(sizes)


@jitted
def needs_dense(sizes, counters, frame_times, t1):
    """Whether `finish_step` for a step that ends at `t1` will read the dense output."""
    if sizes[NE] > 0:
        return True
    return counters[NEXT_FRAME] < frame_times.shape[0] and frame_times[counters[NEXT_FRAME]] < t1


@jitted
def finish_step(
    addresses, sizes, p, control, counters, t0, t1, y, dense, n_terms, scratch, frame_times, frames, step_log
):
    """Record an accepted step from `t0` to `t1`; stop it short at the first event in it.

    Parameters
    ----------
    t0, t1 : float [s]
    y : ndarray, shape (NY,)
        The state at `t1`, already on the constraints. At an event it becomes the state just past it, and
        `control[T]` its time.
    dense : ndarray, shape (8, NY)
        Dense output of the step, `n_terms` rows of it; read only if `needs_dense`.
    scratch : ndarray, shape (finish_scratch_size(sizes),)

    Returns
    -------
    int
        RUNNING, REACHED_STOP or EVENT. After EVENT the derivative row is no longer valid.
    """
    h = t1 - t0
    buffer = scratch[: projection_size(sizes)]
    status = RUNNING
    end = t1
    if sizes[NE] > 0 and control[ASIDE] == 0.0:
        rest = scratch[projection_size(sizes) :]
        model = (addresses, sizes, p, control, counters)
        theta = find_event(model, (t0, h, dense, n_terms), y, buffer, rest)
        if theta >= 0.0:
            status = EVENT
            end = t1 if theta == 1.0 else t0 + theta * h
            copy(rest[: sizes[NY]], y)
            control[T_EVENT] = end
            counters[F_VALID] = 0
    if frame_is_due(counters, frame_times, end):
        write_frames(
            addresses, sizes, p, control, counters, t0, h, end, y, dense, n_terms, buffer, frame_times, frames
        )
    counters[STEPS] += 1
    row = counters[N_LOGGED_STEPS]
    step_log[row, 0] = end
    step_log[row, 1] = end - t0
    counters[N_LOGGED_STEPS] = row + 1
    control[T] = end
    control[H_LAST] = end - t0
    if status == RUNNING and end >= control[T_STOP]:
        status = REACHED_STOP
    return status
