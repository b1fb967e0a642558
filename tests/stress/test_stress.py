"""Some of the short part of the stress suite: nothing hangs, crashes, or is wrong without a word."""

from __future__ import annotations

from .pool import run_all
from .scenario import BAD, all_scenarios

_MOST_OF_A_KIND = 1


def part_of(scenarios):
    """Some scenarios of each kind, evenly spread over those of the short part."""
    kinds = {}
    for scenario in scenarios:
        kinds.setdefault(scenario.kind, []).append(scenario)
    for kind in kinds.values():
        step = max(1, -(-len(kind) // _MOST_OF_A_KIND))
        yield from kind[::step]


def test_no_scenario_is_wrong_hangs_or_crashes():
    short = list(part_of(scenario for scenario in all_scenarios().values() if scenario.short))
    results = run_all(short, 2)
    assert len(results) == len(short)
    bad = [
        f"{r.outcome.verdict} {r.scenario.kind}: {r.scenario.name}: {r.outcome.says}"
        for r in results
        if r.outcome.verdict in BAD
    ]
    assert not bad, "\n".join(bad)
