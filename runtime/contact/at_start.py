"""The form in which a run of a model with stops and friction begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import ContactError, RuntimeModelError
from symgen.runtime.event_actions import EventActions, ResetError
from symgen.runtime.loop_arrays import LoopArrays

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.system import System


def form_at_start(
    system: System, method: Method, p: np.ndarray, t: float, state: np.ndarray, rtol: float, atol: float
) -> tuple[System, np.ndarray, np.ndarray]:
    """Return a model with what is held at a start, where nothing speaks against going on from there.

    Parameters
    ----------
    method : Method
        Any that the model suits.
    p : ndarray, shape (n_p,)
    state : ndarray, shape (nq + nv,)

    Returns
    -------
    system : System
        The model, or its closed form.
    p : ndarray, shape (n_p,)
        With the settings of stops and frictions.
    state : ndarray, shape (nq + nv,)
        After impacts.
    """
    arrays = LoopArrays(
        system, method, p, t, state, frame_times=np.zeros(0), rtol=rtol, atol=atol, log_length=1
    )
    actions = EventActions(system, arrays)
    try:
        actions.begin()
    except (ContactError, ResetError, RuntimeModelError):  # the run will say so
        return system, p, state
    return actions.form, arrays.p, arrays.y[: system.nq + system.nv].copy()
