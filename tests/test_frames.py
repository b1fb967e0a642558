"""Frames are states of the run: each against the end of a run of its own, which no frame has to do with.

Steps that events cut short, that are tried again on the other side of a jump, or that knots of a table end must leave
none of the frames that they had been about to write.
"""

from __future__ import annotations

import numpy as np
import pytest

from symgen import Model
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS

N_FRAMES = 24  # over the run; every one is looked at
STEPS = 400  # of fixed length


def rebounding() -> Model:
    """A ball that a stop throws back."""
    m = Model("rebounding")
    x = m.coordinate("x", start=0.8)
    m.body("ball", mass=1.0, com=(x, 0))
    m.force(x, "-9.81")
    m.stop("floor", gap=x, restitution=0.7)
    return m


def rubbing() -> Model:
    """A mass on a spring and a belt, which sticks and slips."""
    m = Model("rubbing")
    x = m.coordinate("x", start=0.0, rate=0.0)
    m.body("block", mass=1.0, com=(x, 0))
    m.force(x, "-30*x")
    m.friction("belt", speed="dot(x) - 0.5", force=3)
    return m


def jumping() -> Model:
    """A force that jumps, by way of a choice of the state."""
    m = Model("jumping")
    x = m.coordinate("x", start=0.3)
    m.body("b", mass=1.0, com=(x, 0))
    m.force(x, "-9*sign(x) - x")
    return m


def over_knots() -> Model:
    """A force by a table with straight pieces."""
    m = Model("over_knots")
    x = m.coordinate("x", start=0.9)
    m.body("b", mass=1.0, com=(x, 0))
    places = np.linspace(-1.0, 1.0, 9)
    m.table("spring", columns=[places.tolist(), (-20 * places**3).tolist()], outside="extend")
    m.force(x, "spring(x)")
    return m


MODELS = {model.__name__: model for model in (rebounding, rubbing, jumping, over_knots)}
T_END = 1.3
# What events and jumps of order 0 leave of a method of fixed steps is of order 1.
ADAPTIVE, FIXED = 1e-5, 5e-2


@pytest.fixture(scope="module")
def systems():
    return {name: model().derive() for name, model in MODELS.items()}


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("method", METHODS)
def test_each_frame_is_the_end_of_a_run_up_to_it(systems, method, name):
    system, adaptive = systems[name], METHODS[method].adaptive
    options = {"method": method, "rtol": 1e-7, "atol": 1e-9} if adaptive else {"method": method}
    if not adaptive:
        options["step"] = T_END / STEPS
    times = np.linspace(0.0, T_END, N_FRAMES + 1)
    try:
        run = system.run(t_end=T_END, t_eval=times, **options)
    except RuntimeModelError as refusal:
        assert "while a stop or a friction holds" in str(refusal) and system.switches
        assert method.startswith(("verlet", "rattle"))
        return
    assert run.status == "success" and len(run.t) == N_FRAMES + 1
    size = np.ptp(run.states, axis=0)[: system.nq + system.nv]
    hits = np.array([event.t for event in run.events])
    for t, frame in zip(run.t[1:], run.states[1:], strict=True):
        if hits.size and np.abs(hits - t).min() < 1e-3:  # rates jump there
            continue
        alone = system.run(t_end=t, t_eval=(t,), **options).states[-1]
        assert np.abs(frame - alone).max() <= (ADAPTIVE if adaptive else FIXED) * size.max(), t
