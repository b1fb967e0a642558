"""Write the frames that an accepted step has passed."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.dense import evaluate_dense
from symgen.runtime.integrate.projection import project_state


@jitted
def frame_is_due(loop, t1):
    """Whether the next frame lies at or before `t1` [s]."""
    return (
        loop.counters[at.NEXT_FRAME] < loop.frame_times.shape[0]
        and loop.frame_times[loop.counters[at.NEXT_FRAME]] <= t1
    )


@jitted
def write_frames(loop, t0, h, t1, y1, dense, n_terms, buffer):
    """Write every frame up to `t1` by dense output of the step from `t0` of length `h`, on the constraints.

    Frames are written from row `counters[NEXT_FRAME]` on.

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
    """
    ny = loop.sizes[at.NY]
    while frame_is_due(loop, t1):
        row = loop.counters[at.NEXT_FRAME]
        t = loop.frame_times[row]
        if t == t1:
            copy(y1, loop.frames[row])
        else:
            evaluate_dense((t - t0) / h, dense, n_terms, ny, loop.frames[row])
            project_state(loop, t, loop.frames[row], buffer)
        loop.counters[at.NEXT_FRAME] = row + 1
