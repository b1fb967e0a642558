"""Choose method, step and constraint treatment where the user left that open, and say why."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime import step_costs
from symgen.runtime.batches import accelerations_and_multipliers
from symgen.runtime.checks.steps import MOST_IN_A_PERIOD, PERIODS, step_for_phases
from symgen.runtime.checks.time_scales import TimeScales, all_slower, change_rate, time_scales
from symgen.runtime.errors import RuntimeModelError, nearest
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.large_models import has_sparse_form, suited_to_size
from symgen.runtime.integrate.methods import METHODS, Method, find_method
from symgen.runtime.kept_arrays import borrow, give_back
from symgen.runtime.lazy import Late
from symgen.runtime.loop_arrays import LoopArrays
from symgen.runtime.options import RunOptions, time_resolution
from symgen.runtime.positions import Positions
from symgen.runtime.record import record
from symgen.runtime.size import is_large

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symgen.runtime.system import System

kkt = Late("symgen.runtime.constraints.kkt")
method_look = Late("symgen.runtime.method_look")
at_start = Late("symgen.runtime.contact.at_start")
dependence = Late("symgen.runtime.constraints.dependence")
forms = Late("symgen.runtime.integrate.forms")
taylor_kernel = Late("symgen.runtime.taylor.kernel")

CONSTRAINT_TREATMENTS = ("projection", "baumgarte", "ggl", "index3", "partition", "none", "auto")
SERIES, EXPLICIT, STIFF, STIFF_TIGHT = "taylor", "dop853", "radau5", "radau9"
# Operations of the residual: series of larger models take many seconds to compile, which tight tolerances repay sooner.
LARGEST_FOR_SERIES, _LARGEST_WHERE_TIGHT = 1500, 3000
_DEARER = "Taylor series of a model of {} operations pay at tighter tolerances only"
# How much longer series may take by a guess, or how much shorter, for it to be worth to make one and look; and by what
# the series is made of, for it to be worth to look at steps (`method_look.py`).
_CLEAR = 1.6
_LOOSEST_LOOKED_AT = 2e-4  # what is more accurate than asked for at looser tolerances repays nobody
# Series with friction in proportion to reactions begin with what `rhs` computes; operations of it that take as long to
# compile as one of the residual, which every order needs.
_RHS_FOR_RESIDUAL = 6
_FULL_MATRICES = ("residual_jacobian", "mass_matrix", "constraint_jacobian")
_INDEPENDENT = 1e-6  # ratio of pivots from which on constraints are independent
# An explicit step can follow about one radian of a motion at usual tolerances, and decay times step of about 6.
STIFFNESS_RATIO = 100.0
_MIN_DECAYS_OF_VIBRATION = 100.0  # a vibration that dies out is not worth following, one that lasts is
EXPLICIT_BELOW = 3e-11  # at tighter tolerances the high order wins even on stiff models
_ORDER_9_BELOW = 3e-5  # rtol from which on the longer steps of radau9 repay their larger Newton systems
_FIRST_STAGE, _LATER_STAGES = 20, (80, 300)  # explicit steps that are looked at
_SCOUT_STEPS = 400
_SETTLED = 4.0  # times the mean step of the first stage: a longer last one is still growing
_STEPS_TO_GROW, _COMPARED_STEPS = 20, 20
# A choice is made as for a long run, of so many radians of the fastest motion: a run does not depend on where it ends.
_AHEAD = 1e7
_VISIBLE = 1e-4  # of the fastest rate: slower ones may be round-off of the differences
FOLLOWED = 0.25  # radians of the fastest motion in an explicit step that it may be what limits
LIMITS = 1.0  # decay times in an explicit step from which on stability may be what limits it
_COME_TO_REST = (
    1e-4  # of the fastest change met: what is left of the motion is nothing to choose a method for
)
_GRID = 2.0 ** np.arange(
    -30, 21
)  # [s] behind the start: where something may begin to act that does nothing at first
_ACTS = 0.1  # of the largest acceleration there
_INVISIBLE = 1e3  # times as long as the motion shows: a period that is made of round-off
# Steps of the explicit method in the time of one of the implicit one: where stability shows, and where it is not seen.
_WORTH_IMPLICIT, _WORTH_UNSEEN = 5.0, 20.0
_HARD = 1e3  # decay times in the time in which a motion changes: methods for stiff motion are what it needs
_LEAST_TICKS = 16  # of floating-point time in a step
_STIFF_SIGNS = 15
_WHY_PROJECTION = (
    "constraints auto: projection, which keeps positions and velocities on the constraints at the least cost"
)


def choose_method(
    system: System, p: np.ndarray, state: np.ndarray, options: RunOptions
) -> tuple[Method, list[str]]:
    """Return the method to use, and notes on how it was chosen.

    The choice is the same for runs of any length: a run does not depend on where it ends.

    Parameters
    ----------
    state : ndarray, shape (nq + nv,)
        Consistent initial state.
    options : RunOptions
        Their method is a name, or "auto".
    """
    t, rtol, atol = options.t_start, options.rtol, options.atol
    if options.method != "auto":
        method = find_method(options.method)
        refuse_unsuitable(method, system)
        if method.name == SERIES and (reason := _left_out(system, p, t, state)):
            raise RuntimeModelError(f"method {SERIES!r} does not fit this run: {reason}; use {EXPLICIT}")
        return method, _other_name(options.method, method)
    if is_large(system) and not has_sparse_form(system):
        why = f"methods for stiff motion work with full matrices here, too large for {system.nv} rates"
        return METHODS[EXPLICIT], [f"method auto: {EXPLICIT}, because {why}"]
    begins = system, p, state
    if system.switches:
        begins = at_start.form_at_start(system, METHODS[EXPLICIT], p, t, state, rtol, atol)
    form, held, first = begins
    reason = why_stiff(form, held, t, first, rtol, atol)
    if reason:
        stiff = stiff_method(rtol)
        return METHODS[stiff], [f"method auto: {stiff}, because {reason}"]
    objection = objection_to_series(system, p, t, state, rtol)
    if objection:
        return METHODS[EXPLICIT], [f"method auto: {EXPLICIT}, because {objection}"]
    return METHODS[SERIES], [
        f"method auto: {SERIES}, because no motion decays so fast that it would limit an explicit step"
    ]


def _other_name(name: str, method: Method) -> list[str]:
    return [f"method {name}: the same as {method.name}"] if name != method.name else []


def objection_to_series(system: System, p: np.ndarray, t: float, state: np.ndarray, rtol: float) -> str:
    """Return why Taylor series do not suit a model or its start; an empty string where they do."""
    if reason := _too_large_for_series(system, rtol):
        return reason
    operations = _size_for_series(system)
    guess = step_costs.time_ratio(system, rtol)
    if guess > _CLEAR:
        return _DEARER.format(operations)
    if reason := _misfit(system, p, t, state):
        return reason
    if guess > 1.0 / _CLEAR**2 and _are_dearer(system, rtol):
        return _DEARER.format(operations)
    return _left_out(system, p, t, state)  # last, as it takes longest to say


def _are_dearer(system: System, rtol: float) -> bool:
    """Whether series take longer than an explicit method, as what they are made of says, and some steps of both."""
    ratio = step_costs.time_ratio(system, rtol, _costs_of_series(system))
    if 1.0 / _CLEAR < ratio < _CLEAR and rtol < _LOOSEST_LOOKED_AT:
        ratio *= method_look.time_factor(system, rtol)
    return ratio > 1.0


def has_weighed_series(notes: Sequence[str], system: System, rtol: float) -> bool:
    """Whether a run's method was chosen in place of series by what these are made of: so they are there.

    Parameters
    ----------
    notes : sequence of str
        Of the run, those of `choose_method` among them.
    """
    why = f"method auto: {EXPLICIT}, because {_DEARER.format(_size_for_series(system))}"
    return why in notes and step_costs.time_ratio(system, rtol) <= _CLEAR


def _costs_of_series(system: System) -> step_costs.Costs:
    return taylor_kernel.taylor_addresses(system)[2:5]


def misfit_of_series(system: System, p: np.ndarray, t: float, state: np.ndarray, rtol: float) -> str:
    """Return why Taylor series cannot be had, or not in time, whatever their steps cost; else an empty string."""
    return (
        _too_large_for_series(system, rtol) or _misfit(system, p, t, state) or _left_out(system, p, t, state)
    )


def _misfit(system: System, p: np.ndarray, t: float, state: np.ndarray) -> str:
    """Return why Taylor series cannot be had, whatever their size, as far as that is said in short time."""
    if system.m and not system.kernel("rhs")(t, state, p)[-1] >= _INDEPENDENT:
        return "constraints depend on each other at the start"
    if system.m and _is_ill_conditioned(system, p, t, state):
        return "an inertia is tiny beside what constraints tie it to"
    if refusal := METHODS[SERIES].refusal(system):
        return f"{SERIES} {refusal}"
    if taylor_kernel.has_unheld_choices(system):
        return "its forces have kinks at which no step ends, and series have to look for them"
    return ""


def _size_for_series(system: System) -> int:
    """Return the operations that tell how long series take to compile."""
    operations = system.operations.get("residual", 0)
    if any(switch.get("normal") for switch in system.switches):
        operations += system.operations.get("rhs", 0) // _RHS_FOR_RESIDUAL
    return operations


def _too_large_for_series(system: System, rtol: float) -> str:
    operations = _size_for_series(system)
    if operations > (LARGEST_FOR_SERIES if rtol >= EXPLICIT_BELOW else _LARGEST_WHERE_TIGHT):
        return f"Taylor series of a model of {operations} operations take long to compile"
    return ""


def _left_out(system: System, p: np.ndarray, t: float, state: np.ndarray) -> str:
    """Return why the equations that leave constraints out do not hold for this run; an empty string where they do."""
    if not system.dependent or _depends_as_derived(system, p, t, state[: system.nq]):
        return ""
    names = ", ".join(system.constraints[k]["name"] for k in system.dependent)
    return (
        f"its series leave out {names}, which with these parameters do not follow from the other constraints"
    )


def _depends_as_derived(system: System, p: np.ndarray, t: float, q: np.ndarray) -> bool:
    if _is_expected(system):
        return kkt.expectation(system, p, t, q).depends_as_derived
    return dependence.has_dependence(system, p, t, q)


def _is_ill_conditioned(system: System, p: np.ndarray, t: float, state: np.ndarray) -> bool:
    q = state[: system.nq]
    if _is_expected(system):
        return kkt.expectation(system, p, t, q).is_ill_conditioned
    return kkt.is_ill_conditioned(system, p, t, q)


def _is_expected(system: System) -> bool:
    """Whether loops ask the same of the state at which they begin: then the answer is kept."""
    return not (is_large(system) or system.switched)


def why_stiff(system: System, p: np.ndarray, t: float, state: np.ndarray, rtol: float, atol: float) -> str:
    """Return why the motion is stiff, by its start and by explicit steps; an empty string where it is not.

    Those steps come in stages. Where no energy is lost, and the end of the first one shows nothing fast, that is all:
    choosing takes as long as a short run.
    """
    if rtol < EXPLICIT_BELOW:
        return ""
    scouting = _scouting(system, METHODS[EXPLICIT], p, t, state, rtol, atol)
    try:
        return _look_ahead(system, p, t, state, scouting)
    finally:
        give_back(scouting)


def _scouting(
    system: System, method: Method, p: np.ndarray, t: float, state: np.ndarray, rtol: float, atol: float
) -> LoopArrays:
    """Return arrays for steps that are looked at and forgotten."""
    return borrow(
        system, method, p, t, state, frame_times=np.zeros(0), rtol=rtol, atol=atol, with_events=False,
        log_length=_SCOUT_STEPS,
    )  # fmt: skip


def _why_stiff_at_start(scales: TimeScales) -> str:
    """Return why a run is stiff, judged by its start; an empty string where it is not, or only decays are seen."""
    if not scales.decay > 0.0 or scales.motion < _VISIBLE * scales.decay:
        return ""
    ratio = scales.decay / scales.motion
    if ratio < STIFFNESS_RATIO:
        return ""
    return (
        f"the fastest decay at the start, {scales.decay:.3g} 1/s, is {ratio:.3g} times as fast as the motion"
    )


@record(eq=False)
class _Look:
    """What a state shows that explicit steps came to.

    Attributes
    ----------
    h : float [s]
        The last step.
    slow : float [1/s]
        How fast the state changes, or what is left of the time in question.
    fastest, damping : float [1/s]
        Of the linearised motion, see `TimeScales`.
    decays : bool
        Whether the fastest motion dies out in that time.
    """

    h: float
    slow: float
    fastest: float
    damping: float
    decays: bool

    def is_calm(self) -> bool:
        """Whether nothing fast is there that explicit steps would have to follow, or be held by."""
        vibrates_fast = self.fastest >= max(STIFFNESS_RATIO * self.slow, FOLLOWED / self.h)
        return not vibrates_fast and not (self.decays and self.damping * self.h >= LIMITS)


def _look_at(scales: TimeScales, slow: float, rest: float, h: float) -> _Look:
    # What falls off a hilltop has a decay that its growth hides.
    hidden = 2.0 * scales.eigenvalues.real.max(initial=0.0)
    least = max(_MIN_DECAYS_OF_VIBRATION / rest, _VISIBLE * scales.fastest, hidden)
    return _Look(h, max(slow, 1.0 / rest), scales.fastest, scales.damping, scales.damping > least)


def _look_ahead(system: System, p: np.ndarray, t: float, state: np.ndarray, scouting: LoopArrays) -> str:
    """Take explicit steps, in stages; returns why the motion is stiff, an empty string where it is not."""
    nq, y = system.nq, scouting.y[: system.nq + system.nv]
    scouting.advance(np.inf, _FIRST_STAGE // 2)
    halfway = float(change_rate(system, y[:nq], y[nq:]))
    scouting.advance(np.inf, _FIRST_STAGE - _FIRST_STAGE // 2, keep_log=True)
    went = scouting.h_last > 0.0 and bool(np.isfinite(y).all())  # else the run will say why
    if went and _loses_nothing(system) and _stays_calm(system, p, t, scouting, halfway):
        return ""
    start = time_scales(system, p, t, state[:nq], state[nq:])
    if reason := _why_stiff_at_start(start):
        return reason
    if not went or not start.fastest > 0.0:
        return ""
    # The time up to which stiffness matters; the run may end before, or go on for longer.
    until = t + _AHEAD / start.fastest
    if scouting.t >= until:
        return ""
    changes = [float(change_rate(system, state[:nq], state[nq:]))]
    for n_steps in _LATER_STAGES:
        status = scouting.advance(until, n_steps, keep_log=True)
        if status == at.REACHED_STOP or not np.isfinite(y).all():
            return ""
        scales = time_scales(system, p, scouting.t, y[:nq], y[nq:])
        changes.append(float(change_rate(system, y[:nq], y[nq:])))
        look = _look_at(scales, changes[-1], until - scouting.t, scouting.h_last)
        if look.is_calm():
            return ""
    limited = scouting.counters[at.STIFF_COUNT] >= _STIFF_SIGNS
    if not limited and changes[-1] < _COME_TO_REST * max(changes):
        return ""
    return _why_implicit(system, p, scouting, look, limited and look.decays, until)


def _loses_nothing(system: System) -> bool:
    """Whether nothing dies out, so that what is fast shows soon: velocity constraints calm motions without a loss.

    A motion that goes the same way back, as one under a constant torque, has no decays that were not growth then.
    """
    if system.nn:
        return False
    if system.structure["conservative"]:
        return True
    acts = system.structure["time_dependent"] or system.input_descriptions or system.has_feedback
    return not (acts or system.events or system.switches) and system.source.facts("rhs").turns_back


def _stays_calm(system: System, p: np.ndarray, t: float, scouting: LoopArrays, halfway: float) -> bool:
    """Whether the first steps from `t` on, no longer growing, came to nothing that is fast beside the motion.

    Decays do not count: the motion linearised at one instant may have some where none lasts.

    Parameters
    ----------
    halfway : float [1/s]
        How fast the state changed halfway through the steps: at their end a swing may be turning back.
    """
    q, v = scouting.y[: system.nq], scouting.y[system.nq : system.nq + system.nv]
    if scouting.h_last > _SETTLED * (scouting.t - t) / _FIRST_STAGE:
        return False
    slow = max(halfway, float(change_rate(system, q, v)))
    return all_slower(system, p, scouting.t, q, v, STIFFNESS_RATIO * slow)


def _why_implicit(
    system: System, p: np.ndarray, there: LoopArrays, look: _Look, limited: bool, until: float
) -> str:
    """Return why a method for stiff motion takes less time from a state on; an empty string where it does not.

    A vibration that goes on has to be followed by any method, and high order follows it best; unless it is so weak that
    nobody would miss it. One that has died out may limit explicit steps long before stability does, as derivatives of
    what stiff springs carry are large. And what stability limits may be slower still to follow: the step of a method
    for stiff motion shows all that.

    Parameters
    ----------
    limited : bool
        Whether stability limits explicit steps.
    """
    h, rtol = look.h, float(there.control[at.RTOL])
    stiff = METHODS[stiff_method(rtol)]
    says = f"stability limits the step of {EXPLICIT} to {h:.1e} s from t = {there.t:.3g} s on"
    if limited and look.damping >= _HARD * look.slow:
        return says  # whatever steps are just there: it is stiffer than what changes in a motion by far
    longer = _usual_step(system, stiff, p, there, until)
    if longer < (_WORTH_IMPLICIT if limited else _WORTH_UNSEEN) * h:
        return ""
    if limited:
        return says
    return (
        f"{EXPLICIT} takes steps of {h:.1e} s at t = {there.t:.3g} s where {stiff.name} takes {longer:.1e} s"
    )


def _usual_step(system: System, method: Method, p: np.ndarray, there: LoopArrays, until: float) -> float:
    """Return how long steps of a method are from a state on, once they have grown [s]."""
    rtol, atol = (float(there.control[k]) for k in (at.RTOL, at.ATOL))
    arrays = _scouting(system, method, p, there.t, there.y[: system.nq + system.nv], rtol, atol)
    began, n_steps = there.t, 0
    if arrays.advance(until, _STEPS_TO_GROW) != at.REACHED_STOP:
        began, n_steps = arrays.t, int(arrays.counters[at.STEPS])
        arrays.advance(until, _COMPARED_STEPS)
    step = (arrays.t - began) / max(int(arrays.counters[at.STEPS]) - n_steps, 1)
    give_back(arrays)
    return step


def stiff_method(rtol: float) -> str:
    """Return the name of the method for stiff motion at a tolerance."""
    return STIFF_TIGHT if rtol < _ORDER_9_BELOW else STIFF


def choose_step(
    method: Method, system: System, p: np.ndarray, state: np.ndarray, options: RunOptions
) -> tuple[float, list[str]]:
    """Return the step of a fixed-step method [s], 0 for an adaptive one, and notes.

    The default is a share of the fastest period of the linearised motion at the start, and the same for runs of any
    length.
    """
    t, t_end, step = options.t_start, options.t_end, options.step
    if method.adaptive:
        if step is not None:
            raise RuntimeModelError(
                f"method {method.name!r} chooses its own steps: leave --step out and set --rtol, "
                "or use a fixed-step method such as rk4"
            )
        return 0.0, []
    notes = []
    if step is None:
        q, v = state[: system.nq], state[system.nq :]
        scales = time_scales(system, p, t, q, v)
        # Where constraints depend on each other the motion linearised about the start is that of no other place.
        singular = bool(system.m) and dependence.rank_is_lost(system, p, t, q)
        motion = scales.motion
        if singular:
            motion = float((np.abs(v) / Positions(system).per_rate(np.maximum(1.0, np.abs(q)), 1.0)).max())
        period, what = _period_at_start(system, p, t, state, motion)
        if scales.fastest_period < _INVISIBLE * period and not singular:
            step = default_step(method, system, scales)
            what = "the fastest period at the start"
            part = scales.fastest_period / step
        else:
            part = method.steps_per_period
            step = period / part
        notes = [f"step: {step:.3g} s, 1/{part:.3g} of {what}; set --step to change it"]
    if not (np.isfinite(step) and step > 0.0):
        raise RuntimeModelError(f"step is {step}: give a positive number of seconds")
    least = _LEAST_TICKS * time_resolution(t, t_end)
    if step < least:
        raise RuntimeModelError(
            f"step is {step:.3g} s: times up to {t_end:g} s are numbers that cannot tell steps below {least:.1g} s "
            "apart; give a longer --step, or a shorter run"
        )
    return float(step), notes


def _period_at_start(
    system: System, p: np.ndarray, t: float, state: np.ndarray, motion: float
) -> tuple[float, str]:
    """Return a time [s] that tells how long steps may be where nothing swings, and what it is in words.

    `motion` is how fast the state changes [1/s]. Where nothing moves or is accelerated at the start, what time alone
    brings is looked for behind it.
    """
    times = np.append(t, t + _GRID)
    a, _ = accelerations_and_multipliers(system, p, times, np.repeat(state[None], len(times), axis=0))
    sizes = Positions(system).per_rate(np.maximum(1.0, np.abs(state[: system.nq])), 1.0)
    acts = np.nan_to_num(np.max(np.abs(a) / sizes, axis=1, initial=0.0), posinf=0.0)
    rate = max(motion, float(np.sqrt(acts[0])))
    if rate > 0.0:
        # The fastest of the modes that such a motion meets may be twice as fast as the motion begins.
        return np.pi / rate, "half the time in which the motion at the start goes around"
    if not acts.any():
        # Whatever the step, all stays where it is, unless an input or a reset moves it: a second is an arbitrary unit.
        return 1.0, "a second, as nothing moves at the start"
    begins = np.argmax(acts[1:] >= _ACTS * acts.max())
    moves = np.argmax(acts[1:] * _GRID**2 >= 1.0) if (acts[1:] * _GRID**2 >= 1.0).any() else begins
    return float(_GRID[min(begins, moves)]), "the time after which something begins to move"


def default_step(method: Method, system: System, scales: TimeScales) -> float:
    """Return the step [s] with which motions are followed for a fixed number of their periods, if not too long."""
    step = scales.fastest_period / method.steps_per_period
    eigenvalues = scales.eigenvalues[np.abs(scales.eigenvalues) > _VISIBLE * scales.fastest]
    return min(step, step_for_phases(method, system, eigenvalues, np.inf, MOST_IN_A_PERIOD, PERIODS))


def choose_constraints(name: str, system: System, method_name: str) -> tuple[str, Method | None, list[str]]:
    """Return the form in which constraints are treated, the method that has it, and notes.

    Parameters
    ----------
    name : str
        One of `CONSTRAINT_TREATMENTS`.
    method_name : str
        A method's name, or "auto": then the one that suits the form.

    Returns
    -------
    tuple
        "projection", or "none" where the model has no constraints: the method is then None, and left to
        `choose_method`. Else the form and its method.

    Raises
    ------
    RuntimeModelError
        There is no such form, or the method does not have it, or cannot integrate the model.
    """
    if name not in CONSTRAINT_TREATMENTS:
        raise RuntimeModelError(
            f"there is no constraint treatment {name!r}: {nearest(name, CONSTRAINT_TREATMENTS)}"
        )
    if not system.m:
        if name not in ("projection", "none", "auto"):
            raise RuntimeModelError(
                f"constraints {name!r}: model {system.name!r} has no constraints; leave that out"
            )
        return "none", None, []
    own = find_method(method_name).form if method_name != "auto" else "projection"
    if name in ("auto", own):
        why = (
            _WHY_PROJECTION
            if own == "projection"
            else f"constraints auto: {own}, the form that {method_name} has"
        )
        return own, None, [why] if name == "auto" else []
    if name == "projection" and method_name != "auto":
        raise RuntimeModelError(
            f"constraints 'projection': method {method_name!r} solves constraints in the form {own!r} as it is; "
            "leave constraints to 'auto', or name another method, such as gauss8"
        )
    if method_name != "auto":
        method = forms.find_form(name, find_method(method_name).name)
        notes = _other_name(method_name, method)
    else:
        method = forms.find_form(name, forms.SUITED[name])
        notes = [f"method auto: {method.name}, which suits constraints in the form {name}"]
    refuse_unsuitable(method, system)
    return name, method, notes


def _small_matrices(system: System) -> str:
    explicit = "an explicit method such as dop853"
    return f"radau5, whose matrices are sparse, or {explicit}" if has_sparse_form(system) else explicit


def refuse_unsuitable(method: Method, system: System) -> None:
    """Raise RuntimeModelError where a method cannot integrate a model."""
    method = suited_to_size(method, system)
    if method.needs_plain_rates and system.nq != system.nv:
        raise RuntimeModelError(
            f"method {method.name!r} needs rates that are the derivatives of the coordinates, but model "
            f"{system.name!r} has {system.nq} coordinates and {system.nv} rates (quaternions): use gauss8, rattle4 or "
            "dop853"
        )
    if is_large(system) and (full := [name for name in method.kernels if name in _FULL_MATRICES]):
        raise RuntimeModelError(
            f"method {method.name!r} works with full matrices ({', '.join(full)}), too large for the {system.nv} rates "
            f"and {system.m} constraints of model {system.name!r}: use {_small_matrices(system)}"
        )
    if refusal := method.refusal(system):
        raise RuntimeModelError(f"method {method.name!r} {refusal}")
    if system.switches and (refusal := method.refusal(system.closed)):
        raise RuntimeModelError(f"method {method.name!r}, while a stop or a friction holds: {refusal}")
