"""Which subsystems have runs of their own, which go through lanes, and whether either pays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from symgen.runtime.choose import EXPLICIT, LARGEST_FOR_SERIES, SERIES
from symgen.runtime.options import SMALLEST_RTOL
from symgen.runtime.subsystems.in_lanes import METHODS_IN_LANES, InLanes, lanes_object_to, leg_of

if TYPE_CHECKING:
    from symgen.runtime.subsystems.subsystem import Settings, Subsystem
    from symgen.runtime.system import System

# Of what a step costs besides, half a microsecond: some ten evaluations of a nanosecond per operation, and the sums
# over stages that its results enter.
_PER_OPERATION = 0.025
STEPS_PER_RADIAN = 1.5
# The same of a method by its tolerance: at rtol 1e-8, and the root with which it grows.
_BY_METHOD = {SERIES: (1.1, 45.0), EXPLICIT: (1.7, 8.0)}
_PER_RUN = 300.0  # what it costs to prepare a run, in steps of a small model
_PER_MEMBER, _PER_GROUP = 20.0, 4000.0  # what it costs to have one in lanes, and to have lanes
_IN_LANES = 0.2  # of what a step costs
_PERIODS, _VISIBLE = 10.0, 1e-4  # of the slowest motion; of the fastest rate
_FEWEST = 8  # that fill the lanes of the widest vectors in use; the same on all machines, and so are results
# Steps of all members together that are worth a kernel of their own, for a member of no operations and for each of its
# operations, as it has to be compiled, once.
_WORTH, _WORTH_PER_OPERATION = 8_000, 100


def usual_time(found: Sequence[Subsystem]) -> float:
    """Return the time [s] for which costs are compared: some periods of the slowest that moves, however long a run is.

    What is integrated with what decides about the last digits, and these must not depend on where a run ends.
    """
    rates = [s.choice.rate for subsystem in found for s in _members(subsystem) if not s.is_asleep]
    fastest = max(rates, default=0.0)
    slowest = min((rate for rate in rates if rate > _VISIBLE * fastest), default=0.0)
    return 2.0 * math.pi * _PERIODS / slowest if slowest > 0.0 else 0.0


def pays(whole: System, found: Sequence[Subsystem], rtol: float) -> bool:
    """Return whether runs by themselves are estimated to cost less than one run of all.

    The step of one run of all suits the fastest; what a step costs besides evaluations is paid once for all. Where
    some are stiff and others not, no common method suits them. What rests takes no steps by itself. Series are too
    large to compile for a large whole.
    """
    methods = {subsystem.choice.method.name: subsystem.choice.method for subsystem in found}
    if len({method.stiff for method in methods.values()}) > 1:
        return True
    common = next(iter(methods))
    if whole.operations.get("residual", 0) > LARGEST_FOR_SERIES and SERIES in methods:
        common = EXPLICIT
    span, of_all, apart, most = usual_time(found), 0.0, 0.0, 0.0
    for subsystem in found:
        each = _members(subsystem)
        radians = [0.0 if s.is_asleep else s.choice.rate * span for s in each]
        cost = sum(radians) * _per_radian(subsystem.choice.method.name, rtol) * (1.0 + _work(subsystem))
        of_all += _work(subsystem) * sum(len(s.columns) for s in each)
        most = max(most, *radians)
        if isinstance(subsystem, InLanes):
            apart += _PER_GROUP + _PER_MEMBER * len(each) + _IN_LANES * cost
        else:
            apart += _PER_RUN + cost
    return apart < _PER_RUN + most * _per_radian(common, rtol) * (1.0 + of_all)


def _per_radian(method: str, rtol: float) -> float:
    """Steps that a method takes in a radian of the motion that limits them."""
    at_usual, root = _BY_METHOD.get(method, (STEPS_PER_RADIAN, 0.0))
    return at_usual * (1e-8 / max(rtol, SMALLEST_RTOL)) ** (1.0 / root) if root else at_usual


def _members(subsystem: Subsystem) -> Sequence[Subsystem]:
    return subsystem.members if isinstance(subsystem, InLanes) else [subsystem]


def _work(subsystem: Subsystem) -> float:
    """What a step costs for its operations, in parts of what it costs besides."""
    return _PER_OPERATION * subsystem.system.operations.get("rhs", 0)


def grouped(found: Sequence[Subsystem], settings: Settings) -> list[Subsystem]:
    """Join equal subsystems that lanes can integrate; the others stay as they are.

    Returns
    -------
    list of Subsystem
        In the order of their first members.
    """
    kinds: dict[tuple[int, str], list[Subsystem]] = {}
    for subsystem in found:
        if len(subsystem.columns) == 1 and not subsystem.is_asleep:
            key = id(subsystem.system), subsystem.choice.method.name
            kinds.setdefault(key, []).append(subsystem)
    group_of: dict[int, InLanes] = {}
    span = usual_time(found)
    for members in kinds.values():
        worth_it = len(members) >= _FEWEST and _are_worth_it(members, span)
        if worth_it and not lanes_object_to(members[0], settings):
            group_of |= dict.fromkeys(map(id, members), InLanes(members, leg_of(span)))
    return list(dict.fromkeys(group_of.get(id(subsystem), subsystem) for subsystem in found))


def _are_worth_it(members: Sequence[Subsystem], span: float) -> bool:
    """Whether members take so many steps that they are estimated to spare the time to compile their kernel."""
    operations = members[0].system.operations.get("rhs", 0)
    rates = sum(member.choice.rate for member in members)
    is_there = members[0].choice.method.name in METHODS_IN_LANES
    return is_there and STEPS_PER_RADIAN * rates * span >= _WORTH + _WORTH_PER_OPERATION * operations
