"""The short part of the trust suite, and what its parts rest on."""

from __future__ import annotations

import pytest

from . import advised, broken, sound
from .case import judge

BROKEN, ADVISED, SOUND = (list(part.cases()) for part in (broken, advised, sound))


def test_there_are_enough_of_either_sort():
    assert len(BROKEN) >= 40 and len(SOUND) >= 40
    assert len(ADVISED) >= 12
    assert len({case.kind for case in [*BROKEN, *ADVISED]}) >= 12
    assert len({case.name for case in SOUND}) == len(SOUND)


@pytest.mark.parametrize(
    "case", [case for case in BROKEN if case.short], ids=lambda case: f"{case.kind}: {case.name}"
)
def test_what_is_broken_is_flagged_with_its_cause(case):
    verdict = judge(case)
    assert verdict.is_right(case), f"asked for {case.check} naming {case.word!r}, found {verdict}"


@pytest.mark.parametrize(
    "case", [case for case in ADVISED if case.short], ids=lambda case: f"{case.kind}: {case.name}"
)
def test_what_is_right_is_not_doubted_where_something_is_to_be_said(case):
    verdict = judge(case)
    assert verdict.is_right(case), f"asked for {case.check} naming {case.word!r}, found {verdict}"


@pytest.mark.parametrize("case", [case for case in SOUND if case.short], ids=lambda case: case.name)
def test_what_is_sound_is_left_alone(case):
    assert judge(case).flags == {}
