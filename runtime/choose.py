"""Choose method, step and constraint treatment where the user left that open, and say why."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from runtime.checks.time_scales import TimeScales, time_scales
from runtime.errors import RuntimeModelError, nearest
from runtime.integrate import layout as at
from runtime.integrate.methods import METHODS, Method, find_method
from runtime.loop_arrays import LoopArrays

if TYPE_CHECKING:
    from runtime.system import System

CONSTRAINT_TREATMENTS = ("projection", "baumgarte", "ggl", "index3", "partition", "auto")
SERIES, EXPLICIT, STIFF, STIFF_TIGHT = "taylor", "dop853", "radau5", "radau9"
# Series are made of the residual, explicit stages call rhs, whose operations grow faster; steps of series also grow
# with the order, which tight tolerances pay for. In small models what a step costs besides is more than either.
_LARGEST_FOR_SERIES = 1000  # operations of the residual; series of larger models take many seconds to compile
_SMALL_FOR_SERIES = 200
_GAIN_OF_SERIES = 5.0  # operations of rhs for one of the residual, at rtol 1e-2
_GAIN_WITH_RTOL = (
    1.0 / 12.0
)  # exponent: the run time of order 8 grows as rtol^(-1/8), that of order 24 as rtol^(-1/24)
_INDEPENDENT = 1e-6  # ratio of pivots from which on constraints are independent
# An explicit step can follow about one radian of a motion at usual tolerances, and decay times step of about 6.
_STIFFNESS_RATIO = 100.0
_MIN_DECAYS = 2000.0  # fewer time constants than this in a run are quick to step through anyway
_MIN_DECAYS_OF_VIBRATION = 100.0  # a vibration that dies out is not worth following, one that lasts is
_EXPLICIT_BELOW = 1e-10  # at tighter tolerances the high order wins even on stiff models
_ORDER_9_BELOW = 1e-7  # rtol from which on the longer steps of radau9 repay their larger Newton systems
_SCOUT_STEPS = 400
_STIFF_SIGNS = 15


def choose_method(
    name: str,
    system: System,
    p: np.ndarray,
    t: float,
    state: np.ndarray,
    t_end: float,
    rtol: float,
    atol: float,
) -> tuple[Method, list[str]]:
    """Return the method to use, and notes on how it was chosen.

    Parameters
    ----------
    name : str
        A method's name, or "auto".
    state : ndarray, shape (nq + nv,)
        Consistent initial state.
    """
    if name != "auto":
        method = find_method(name)
        if method.needs_plain_rates and system.nq != system.nv:
            raise RuntimeModelError(
                f"method {name!r} needs rates that are the derivatives of the coordinates, but model {system.name!r} "
                f"has {system.nq} coordinates and {system.nv} rates (quaternions): use dop853 or rk4"
            )
        if refusal := method.refusal(system):
            raise RuntimeModelError(f"method {name!r} {refusal}")
        return method, []
    scales = time_scales(system, p, t, state[: system.nq], state[system.nq :])
    reason = stiff_at_start(scales, t_end - t, rtol)
    if not reason and rtol >= _EXPLICIT_BELOW:
        reason = scout(system, p, t, state, t_end, rtol, atol)
    if reason:
        stiff = STIFF_TIGHT if rtol < _ORDER_9_BELOW else STIFF
        return METHODS[stiff], [f"method auto: {stiff}, because {reason}"]
    objection = objection_to_series(system, p, t, state, rtol)
    if objection:
        return METHODS[EXPLICIT], [f"method auto: {EXPLICIT}, because {objection}"]
    return METHODS[SERIES], [
        f"method auto: {SERIES}, because no motion decays so fast that it would limit an explicit step"
    ]


def objection_to_series(system: System, p: np.ndarray, t: float, state: np.ndarray, rtol: float) -> str:
    """Return why Taylor series do not suit a model or its start; an empty string where they do."""
    operations = system.operations.get("residual", 0)
    if operations > _LARGEST_FOR_SERIES:
        return f"Taylor series of a model of {operations} operations take long to compile"
    gain = system.operations.get("rhs", 0) * (1e-2 / rtol) ** _GAIN_WITH_RTOL if rtol > 0.0 else np.inf
    if operations > _SMALL_FOR_SERIES and gain < _GAIN_OF_SERIES * operations:
        return f"Taylor series of a model of {operations} operations pay at tighter tolerances only"
    if system.m and not system.kernel("rhs")(t, state, p)[-1] >= _INDEPENDENT:
        return "constraints depend on each other at the start"
    refusal = METHODS[SERIES].refusal(system)
    return f"{SERIES} {refusal}" if refusal else ""


def stiff_at_start(scales: TimeScales, span: float, rtol: float) -> str:
    """Return why a run of length `span` [s] is stiff, judged by its start; an empty string where it is not."""
    slow = max(scales.motion, 1.0 / span)
    if rtol < _EXPLICIT_BELOW or scales.decay < _STIFFNESS_RATIO * slow or scales.decay * span < _MIN_DECAYS:
        return ""
    return (
        f"the fastest decay at the start, {scales.decay:.3g} 1/s, is {scales.decay / slow:.3g} times as fast "
        "as the motion"
    )


def scout(
    system: System, p: np.ndarray, t: float, state: np.ndarray, t_end: float, rtol: float, atol: float
) -> str:
    """Take a few hundred explicit steps; returns why the motion is stiff, an empty string where it is not."""
    arrays = LoopArrays(
        system, METHODS[EXPLICIT], p, t, state, frame_times=np.zeros(0), rtol=rtol, atol=atol, span=t_end - t,
        with_events=False, log_length=_SCOUT_STEPS,
    )  # fmt: skip
    status = arrays.advance(t_end, _SCOUT_STEPS)
    if arrays.counters[at.STIFF_COUNT] < _STIFF_SIGNS or status == at.REACHED_STOP:
        return ""
    scales = time_scales(
        system, p, arrays.t, arrays.y[: system.nq], arrays.y[system.nq : system.nq + system.nv]
    )
    if scales.damping * (t_end - arrays.t) < _MIN_DECAYS_OF_VIBRATION:
        return ""  # a vibration that goes on has to be followed by any method, and high order follows it best
    return f"stability limits the step of {EXPLICIT} to {arrays.h_last:.1e} s from t = {arrays.t:.3g} s on"


def choose_step(
    method: Method,
    step: float | None,
    system: System,
    p: np.ndarray,
    t: float,
    state: np.ndarray,
    t_end: float,
) -> tuple[float, list[str]]:
    """Return the step of a fixed-step method [s], 0 for an adaptive one, and notes.

    The default is a share of the fastest period of the linearised motion at the start.
    """
    if method.adaptive:
        if step is not None:
            raise RuntimeModelError(
                f"method {method.name!r} chooses its own steps: leave --step out and set --rtol, "
                "or use a fixed-step method such as rk4"
            )
        return 0.0, []
    span = t_end - t
    if step is None:
        scales = time_scales(system, p, t, state[: system.nq], state[system.nq :])
        step = min(scales.fastest_period, span) / method.steps_per_period
        return step, [
            f"step: {step:.3g} s, 1/{method.steps_per_period} of the fastest period at the start; "
            "set --step to change it"
        ]
    if not (np.isfinite(step) and step > 0.0):
        raise RuntimeModelError(f"step is {step}: give a positive number of seconds")
    return min(float(step), span), []


def choose_constraints(name: str, system: System) -> str:
    """Return the constraint treatment to use: projection, or none where the model has no constraints."""
    if name not in CONSTRAINT_TREATMENTS:
        raise RuntimeModelError(
            f"there is no constraint treatment {name!r}: {nearest(name, CONSTRAINT_TREATMENTS)}"
        )
    if name not in ("projection", "auto"):
        raise RuntimeModelError(
            f"constraints {name!r}: this version stabilises constraints by projection only; use 'projection' or 'auto'"
        )
    return "projection" if system.m else "none"
