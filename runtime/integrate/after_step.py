"""What every method does after an accepted step: events, frames, the step log."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.events import event_scratch_size, find_event
from symgen.runtime.integrate.frames import frame_is_due, write_frames
from symgen.runtime.integrate.projection import projection_size


@jitted
def finish_scratch_size(sizes):
    """Length of the scratch array that `finish_step` needs."""
    return projection_size(sizes) + sizes[at.NY] + event_scratch_size(sizes)


@jitted
def needs_dense(loop, t1):
    """Whether `finish_step` for a step that ends at `t1` will read the dense output."""
    if loop.sizes[at.NE] > 0:
        return True
    return (
        loop.counters[at.NEXT_FRAME] < loop.frame_times.shape[0]
        and loop.frame_times[loop.counters[at.NEXT_FRAME]] < t1
    )


@jitted
def finish_step(loop, t0, t1, dense, n_terms, scratch):
    """Record an accepted step from `t0` to `t1`; stop it short at the first event in it.

    `loop.y` is the state at `t1`, already on the constraints. At an event it becomes the state just past it, and
    `control[T]` its time.

    Parameters
    ----------
    t0, t1 : float [s]
    dense : ndarray, shape (8, NY)
        Dense output of the step, `n_terms` rows of it; read only if `needs_dense`.
    scratch : ndarray, shape (finish_scratch_size(sizes),)

    Returns
    -------
    int
        RUNNING, REACHED_STOP or EVENT. After EVENT the derivative row is no longer valid.
    """
    h = t1 - t0
    buffer = scratch[: projection_size(loop.sizes)]
    status = at.RUNNING
    end = t1
    if loop.sizes[at.NE] > 0 and loop.control[at.ASIDE] == 0.0:
        rest = scratch[projection_size(loop.sizes) :]
        theta = find_event(loop, t0, h, dense, n_terms, loop.y, buffer, rest)
        if theta >= 0.0:
            status = at.EVENT
            end = t1 if theta == 1.0 else t0 + theta * h
            copy(rest[: loop.sizes[at.NY]], loop.y)
            loop.control[at.T_EVENT] = end
            loop.counters[at.F_VALID] = 0
    if frame_is_due(loop, end):
        write_frames(loop, t0, h, end, loop.y, dense, n_terms, buffer)
    loop.counters[at.STEPS] += 1
    row = loop.counters[at.N_LOGGED_STEPS]
    loop.step_log[row, 0] = end
    loop.step_log[row, 1] = end - t0
    loop.counters[at.N_LOGGED_STEPS] = row + 1
    loop.control[at.T] = end
    loop.control[at.H_LAST] = end - t0
    if status == at.RUNNING and end >= loop.control[at.T_STOP]:
        status = at.REACHED_STOP
    return status
