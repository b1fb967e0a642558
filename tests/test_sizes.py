"""Every form of a function's text, forced on small models; at their own sizes: `python -m tests.stress size`."""

from __future__ import annotations

import pytest
from stress.scenario import RIGHT
from stress.sizes import FORMS, MODELS, check

SIZES = (1, 2, 3, 5)
# One size of each model in each form: which one goes round.
CASES = [
    (name, 3 if name == "lattice" else SIZES[(i + k) % len(SIZES)], how)
    for i, name in enumerate(MODELS)
    for k, how in enumerate(FORMS[1:])
]


@pytest.mark.parametrize(
    ("name", "n", "how"),
    [pytest.param(*case, marks=[pytest.mark.slow] if k % 2 else []) for k, case in enumerate(CASES)],
    ids=lambda x: str(x),
)
def test_functions_agree_in_every_form(name, n, how):
    outcome = check(name, n, how, series=False)
    assert outcome.verdict == RIGHT, outcome.says
