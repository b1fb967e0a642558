"""Write the frames that an accepted step has passed."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.dense import evaluate_dense
from symgen.runtime.integrate.layout import NEXT_FRAME, NY
from symgen.runtime.integrate.projection import project_state


@jitted
def frame_is_due(counters, frame_times, t1):
    """Whether the next frame lies at or before `t1` [s]."""
    return counters[NEXT_FRAME] < frame_times.shape[0] and frame_times[counters[NEXT_FRAME]] <= t1


@jitted
def write_frames(
    addresses, sizes, p, control, counters, t0, h, t1, y1, dense, n_terms, buffer, frame_times, frames
):
    """Write every frame up to `t1` by dense output of the step from `t0` of length `h`, on the constraints.

    Parameters
    ----------
    t0, h : float [s]
        Start and length of the step that `dense` describes.
    t1 : float [s]
        Last time to write; frames exactly at `t1` are `y1` itself.
    y1 : ndarray, shape (NY,)
        State at `t1`.
    dense : ndarray, shape (8, NY)
    buffer : ndarray
        See `projection.projection_size`.
    frame_times, frames : ndarray, shapes (F,), (F, NY)
        Written from row `counters[NEXT_FRAME]` on.
    """
    ny = sizes[NY]
    while frame_is_due(counters, frame_times, t1):
        row = counters[NEXT_FRAME]
        t = frame_times[row]
        if t == t1:
            copy(y1, frames[row])
        else:
            evaluate_dense((t - t0) / h, dense, n_terms, ny, frames[row])
            project_state(addresses, sizes, p, t, frames[row], control, counters, buffer)
        counters[NEXT_FRAME] = row + 1
