"""Members held against the same members integrated again: whether they are where their motion is.

A fixed step keeps the energy of a motion, and its constraints, long after its phase is lost: no number of its own steps
tells. So the motion is integrated again in lanes, by a method of high order that chooses its steps, which takes less
time than most fixed steps; where stability holds that back, by the method itself with half the step, as single runs do
it (`checks/companion.py`). A member is held to what is kept of it: its end, or its frames.

Members that choose their steps are off where errors grow: in chaotic motion, and by loose tolerances. The first and the
last one of each group are integrated again, and all of a group where one of these is off; where stability holds the
other method back, and where stops or friction switch, by their own with smaller tolerances. Jumps at events that come
a little sooner or later look like errors at a time between: where there are events, stops or friction, the health
report of some has the last word. Members that run one after another are run so again, with smaller tolerances.
"""

from __future__ import annotations

import contextlib
import threading
import weakref
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.companion import apart
from symgen.runtime.checks.error_estimate import LARGEST_ERROR, Extent
from symgen.runtime.choose import choose_step
from symgen.runtime.ensemble.plan import make_plan
from symgen.runtime.ensemble.switched import make_batch
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.methods import find_method
from symgen.runtime.lazy import Late
from symgen.runtime.sampling import quasi_random

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symgen.runtime.ensemble.batch import LaneBatch
    from symgen.runtime.ensemble.gpu.batch import DeviceBatch
    from symgen.runtime.ensemble.plan import Plan

device = Late("symgen.runtime.ensemble.gpu.device")

_BESIDE = "dop853"
# The first is cheap, and right enough to acquit; the second has the last word.
_TOLERANCES = ((1e-4, 1e-7), (1e-10, 1e-14))
# For members that choose their steps. The second is a part of their own, but not less than a number; with less than
# another number of theirs nothing is more accurate.
_OF_ADAPTIVE, _TIGHTER, _TIGHTEST, _LEAST_RTOL = (1e-6, 1e-9), 0.01, 2e-14, 1e-12
GROUP = 64  # members that choose their steps, of which the first and the last one are integrated again
_ACQUITS = 0.5  # times the limit
# Allowed; more than those of a member of fixed step are a sign that stability holds it back. A series takes long steps.
_LEAST_STEPS, _MORE_STEPS = 500, 20
_EVEN, _EARLY = 24, 8  # times at which it is looked how far coordinates go; motion may die out soon
_FIRST = 1e-4  # of the run
_NUMBERS = 1 << 20  # of states of members at once: 8 MB
_CONFIRMED = 4  # members of a part with events, whose report is asked
_PASSES = ("0", "1")  # by `_TOLERANCES`
_HALF, _OWN = "half", "own"  # companions by the method itself: with half the step, with smaller tolerances
_lock = threading.Lock()
_plans: weakref.WeakKeyDictionary[Plan, dict[str, Plan]] = weakref.WeakKeyDictionary()
_own = threading.local()

Rerun = Callable[["Plan", int, int], tuple[np.ndarray, np.ndarray]]
Objects = Callable[["Plan", int], bool]


def has_companion(plan: Plan) -> bool:
    """Whether members can be integrated again; those of fixed steps in lanes only, where nothing switches or resets.

    Of members that choose their steps, not those with tolerances that nothing is more accurate than.
    """
    if find_method(plan.method).adaptive:
        return plan.single.rtol >= _LEAST_RTOL
    return not (plan.system.switches or plan.system.events) and _in_lanes(plan)


def _in_lanes(plan: Plan) -> bool:
    """Whether there are lanes for companions."""
    # Stops and frictions are where a method's own steps land.
    return _companion(plan, _OWN if plan.system.switches else _PASSES[0]).settings is not None


def _sampled(first: int, sound: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the group of each sound member, and which of these are the first or last one of theirs."""
    groups = (first + sound) // GROUP
    begins = np.flatnonzero(np.diff(groups, prepend=-1))
    return groups, np.union1d(begins, np.append(begins[1:], len(sound)) - 1) if len(sound) else begins


def judged_alone(plan: Plan) -> bool:
    """Whether members have fixed steps, and only the health report of each tells whether they are right."""
    return not find_method(plan.method).adaptive and not has_companion(plan)


def wrong_members(
    plan: Plan, first: int, parameters: np.ndarray, varied: dict[str, np.ndarray], states: np.ndarray,
    steps: np.ndarray, sound: np.ndarray, rerun: Rerun, objects: Objects,
) -> np.ndarray:  # fmt: skip
    """Return the members, counted from `first`, that are found to be off by more than a single run may be.

    Parameters
    ----------
    parameters : ndarray, shape (k, n_p)
    varied : dict of str to ndarray, shape (k,)
        Starts that vary.
    states : ndarray, shape (k, F, ny)
        What is kept of the members: frames, or their ends.
    steps : ndarray of int, shape (k,)
        That they took.
    sound : ndarray of int
        Which of them nothing else objects to, counted from `first`.
    rerun : callable
        Runs members of a plan, from a number up to another one, and returns states and whether these reached the end.
    objects : callable
        Whether the health report of a member of a plan, by its number, says that it is off.
    """

    def off(chosen: np.ndarray, passes: Sequence[str]) -> np.ndarray:
        wrong, held_back = chosen[:0], chosen
        if _in_lanes(plan):
            wrong, held_back = _off(plan, first, parameters, varied, states, steps, chosen, passes)
        return np.sort(np.concatenate([wrong, *_off_by_own(plan, first, states, held_back, rerun)]))

    method, everything = find_method(plan.method), _PASSES
    if not method.adaptive:
        return off(sound, everything)
    if plan.system.switches:
        everything = (_OWN,)
    elif method.stiff and _companion(plan, _OWN).settings is not None:
        # Where motions are stiff, the other method takes long to be held back.
        everything = (_OWN, _PASSES[1])
    groups, sample = _sampled(first, sound)
    wrong = _confirmed(plan, first, off(sound[sample], everything), objects)
    suspects = sound[np.isin(groups, (first + wrong) // GROUP)]
    passes = everything if everything[0] == _OWN else everything[-1:]
    return _confirmed(plan, first, off(suspects, passes), objects)


def _confirmed(plan: Plan, first: int, wrong: np.ndarray, objects: Objects) -> np.ndarray:
    """Return the wrong members without those that the health report acquits; all are, where it acquits all it sees."""
    if not len(wrong) or not (plan.system.events or plan.system.switches):
        return wrong
    seen = wrong[np.unique(np.linspace(0, len(wrong) - 1, _CONFIRMED).astype(int))]
    acquitted = [k for k in seen if not objects(plan, first + int(k))]
    return wrong[:0] if len(acquitted) == len(seen) else np.setdiff1d(wrong, acquitted)


def _off(
    plan: Plan, first: int, parameters: np.ndarray, varied: dict[str, np.ndarray], states: np.ndarray,
    steps: np.ndarray, chosen: np.ndarray, passes: Sequence[str],
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return which of the chosen members are off, and for which stability holds the companion back."""
    wrong, held_back = chosen, np.zeros(0, dtype=int)
    more = _MORE_STEPS if find_method(plan.method).adaptive else 1
    for which in passes:
        if not len(wrong):
            break
        companion = _companion(plan, which)
        batch = _batch(companion, max(_LEAST_STEPS, more * int(steps.max(initial=0))), plan.options.device)
        again, reached = _integrated(companion, batch, first, parameters, varied, wrong)
        held_back = np.append(held_back, wrong[~reached])
        limit = LARGEST_ERROR * (1.0 if which == _PASSES[1] else _ACQUITS)
        wrong = wrong[reached][~(_errors(companion, plan, again[reached], states[wrong[reached]]) <= limit)]
    return wrong, held_back


def _off_by_own(
    plan: Plan, first: int, states: np.ndarray, held_back: np.ndarray, rerun: Rerun
) -> list[np.ndarray]:
    """Return which members are off from themselves with half the step, by Richardson's extrapolation, or tighter."""
    if not len(held_back):
        return []
    method = find_method(plan.method)
    companion, numbers = _companion(plan, _OWN if method.adaptive else _HALF), np.sort(held_back)
    remains, found = 1.0 if method.adaptive else 2.0**method.order / (2.0**method.order - 1.0), []
    for part in np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1):
        again, reached = rerun(companion, first + int(part[0]), first + int(part[-1]) + 1)
        off = remains * _errors(companion, plan, again, states[part])
        found.append(part[reached & ~(off <= LARGEST_ERROR)])
    return found


def _companion(plan: Plan, which: str) -> Plan:
    """Return the plan of the same members by another method, or by their own more exactly, which is made once."""
    with _lock:
        known = _plans.setdefault(plan, {})
        if which not in known:
            known[which] = _made(plan, which)
        return known[which]


def _made(plan: Plan, which: str) -> Plan:
    options = replace(
        plan.options, frames=_times(plan), keep="end", reduce=None, executor=None, out=None, resume=False,
        progress=None, max_steps=None, device="cpu",
    )  # fmt: skip
    if which == _HALF:
        method, chosen = find_method(plan.method), plan.single.step
        if chosen is None:
            chosen, _ = choose_step(method, plan.system, plan.first_parameters, plan.first_state, plan.single)
        return make_plan(plan.system, replace(options, method=plan.method, step=0.5 * chosen))
    part = max(_TIGHTER * plan.single.rtol, _TIGHTEST) / plan.single.rtol
    if which == _OWN:
        tight = {"rtol": part * plan.single.rtol, "atol": part * plan.single.atol}
        return make_plan(plan.system, replace(options, method=plan.method, **tight))
    rtol, atol = _TOLERANCES[int(which)]
    if find_method(plan.method).adaptive:
        tight = min(rtol, part * plan.single.rtol), min(atol, part * plan.single.atol)
        rtol, atol = _OF_ADAPTIVE if which == _PASSES[0] else tight
        if plan.method == _BESIDE:  # with the members' own tolerance it would be the members
            atol *= apart(rtol, plan.single.rtol) / rtol
            rtol = apart(rtol, plan.single.rtol)
    return make_plan(plan.system, replace(options, method=_BESIDE, step=None, rtol=rtol, atol=atol))


def _times(plan: Plan) -> np.ndarray:
    """Return the times of what is kept, and others that show how far coordinates and rates go [s]."""
    begin, end = plan.single.t_start, plan.single.t_end
    even = (np.arange(_EVEN) + 0.5 + 0.5 * quasi_random(_EVEN)) / _EVEN
    parts = np.concatenate([[0.0], np.geomspace(_FIRST, 0.5, _EARLY), even])
    return np.unique(np.concatenate([begin + parts * (end - begin), [end], plan.frame_times]))


def _integrated(
    companion: Plan, batch: LaneBatch | DeviceBatch, first: int, parameters: np.ndarray,
    varied: dict[str, np.ndarray], chosen: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return states of members over the companion's times, shape (k, T, ny), and which of them came to the end."""
    at_once = max(1, _NUMBERS // (len(companion.frame_times) * companion.system.ny))
    if companion.settings.breaks is not None:
        at_once = min(at_once, companion.settings.breaks.most_at_once)
    frames, reached = (
        [np.zeros((0, len(companion.frame_times), companion.system.ny))],
        [np.zeros(0, dtype=bool)],
    )
    for k in range(0, len(chosen), at_once):
        rows = chosen[k : k + at_once]
        starts, _ = companion.starts.of(
            parameters[rows], {name: values[rows] for name, values in varied.items()}
        )
        numbers = () if companion.settings.breaks is None else (first + rows,)
        result = batch.run(parameters[rows], starts, *numbers)
        frames.append(result.frames)
        reached.append(result.column("status") == at.REACHED_STOP)
    return np.concatenate(frames), np.concatenate(reached)


def _batch(companion: Plan, most_steps: int, where: str) -> LaneBatch | DeviceBatch:
    """Return the thread's own lanes of a companion, or threads of a device that can hold it: of the last few."""
    held = _own.__dict__.setdefault("batches", [])
    for known, most, batch in held:
        if known() is companion and most == most_steps:
            return batch
    settings, batch = replace(companion.settings, max_steps=most_steps), None
    if where != "cpu":
        with contextlib.suppress(RuntimeModelError):  # it is too large
            batch = device.make_batch(companion.system, settings)
    batch = batch or make_batch(companion.system, settings)
    held.insert(0, (weakref.ref(companion), most_steps, batch))
    del held[len(_TOLERANCES) :]
    return batch


def _errors(companion: Plan, plan: Plan, again: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return how far members are off at what is kept of them, in parts of what coordinates and rates do, shape (k,).

    Parameters
    ----------
    again : ndarray, shape (k, T, ny)
        At the companion's times.
    states : ndarray, shape (k, F, ny)
    """
    system = plan.system
    n = system.nq + system.nv
    kept = plan.frame_times if len(plan.frame_times) else companion.frame_times[-1:]
    rows = np.searchsorted(companion.frame_times, kept)
    with np.errstate(over="ignore", invalid="ignore"):
        sizes = Extent(again[:, :, :n]).sizes(system, np.zeros(n, dtype=bool))
        off = np.abs(again[:, rows, :n] - states[:, :, :n]) / sizes[:, None, :]
    off[:, :, list(system.integrals)] = 0.0
    return off.max(axis=(1, 2), initial=0.0)
