"""What machine code finds of constraints at frames, some hundred at a time, is what NumPy finds at all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from symgen.runtime import load
from symgen.runtime.batches import evaluate
from symgen.runtime.constraints.drift import constraint_drift
from symgen.runtime.constraints.frames_code import DRIFT, TURNS, WEIGHTS, LookAtFrames

GENERATED = Path(__file__).parent.parent / "generated"


@pytest.fixture(scope="module", params=["slider_crank", "andrews_squeezer"])
def run(request):
    """700 frames: two calls and a part of a third."""
    t_end = {"slider_crank": 2.0, "andrews_squeezer": 0.03}[request.param]
    return load(GENERATED / f"{request.param}.py").run(t_end=t_end, fps=700.0 / t_end)


def look_at(run) -> LookAtFrames:
    p = run.system.precomputed(run.p)
    look = LookAtFrames(run.system, len(p))
    look.begin(run.system, p)
    return look


def test_largest_residuals_and_their_frames(run):
    look = look_at(run)
    rows = np.abs(evaluate(run.system, "constraint_residual", run.p, run.t, run.states))
    for _ in range(2):  # a look begins anew
        look.see(DRIFT, run.t, run.states)
        assert look.of.largest.tolist() == rows.max(axis=0).tolist()
        assert look.of.at.tolist() == rows.argmax(axis=0).tolist()


def test_a_residual_that_is_no_number_is_larger_than_all(run):
    states = run.states.copy()
    states[400, 0] = np.nan
    look = look_at(run)
    look.see(DRIFT, run.t, states)
    lost = np.isnan(evaluate(run.system, "constraint_residual", run.p, run.t, states)[400])
    assert lost.any() and np.isnan(look.of.largest).tolist() == lost.tolist()
    assert (look.of.at[lost] == 400).all()


def test_rows_turn_where_determinants_say_so(run):
    """At states that jump about the constraints, of which half turn; next to none of a run does."""
    system = run.system
    rng = np.random.default_rng(7)
    states = run.states.copy()
    states[:, : system.nq] += rng.uniform(-2.0, 2.0, (len(states), system.nq))
    look = look_at(run)
    look.see(WEIGHTS, run.t, states)
    found = [look.of.turned[: end - first].copy() for first, end in look.look(TURNS, run.t, states)]
    rows = evaluate(system, "constraint_jacobian", run.p, run.t, states)
    rows = rows.reshape(len(states), system.m, system.nv)[:, : system.nh]
    weights = 1.0 / (rows**2).sum(axis=1).max(axis=0)
    turned = np.linalg.det((rows[:-1] * weights) @ np.swapaxes(rows[1:], 1, 2)) < 0.0
    assert np.concatenate(found).astype(bool).tolist() == [False, *turned.tolist()]
    assert 0.2 < turned.mean() < 0.8


def test_velocities_count_by_their_largest_term(run):
    """Held against a formula of its own: |G_ij| times the rate, over all frames that are looked at."""
    system, t, states = run.system, run.t, run.states
    drift = constraint_drift(run)["velocity"]
    frames = np.linspace(0, len(t) - 1, 16).astype(int)
    rows = evaluate(system, "constraint_jacobian", run.p, t[frames], states[frames])
    terms = np.abs(rows.reshape(16, system.m, system.nv) * states[frames][:, None, system.nq :]).max(
        axis=(0, 2)
    )
    largest = np.abs(evaluate(system, "constraint_residual", run.p, t, states)).max(axis=0)[system.nh :]
    assert drift.relative <= (largest / terms).max() * (1.0 + 1e-12)
    assert drift.relative == pytest.approx((largest / terms).max(), rel=1e-6)


def test_constraints_of_velocities_alone():
    """There are no rows that could turn, and G is looked at for terms of velocities only."""
    run = load(GENERATED / "rolling_disc.py").run(t_end=0.5, method="dop853")
    found = constraint_drift(run)
    rows = np.abs(evaluate(run.system, "constraint_residual", run.p, run.t, run.states))
    assert found.keys() == {"velocity"} and 0.0 < found["velocity"].relative < 1e-10 and rows.max() < 1e-10
