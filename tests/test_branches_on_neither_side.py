"""What decides a branch may be zero for a while: whether an undamped buffer that nothing touches pushes or pulls.

A series makes each choice at the start of its step: there, on neither side, it says nothing of what follows.
"""

import pytest

from symgen import Model
from symgen.runtime.loop_arrays import LoopArrays

LAW = [[-0.45, -0.165, 0.0, 0.264, 0.43], [-0.53, -0.47, 0.0, 17.3, 18.2]]
MIRRORED = [[-x for x in reversed(column)] for column in LAW]
WAYS = {
    "a buffer with a curve": {"curve": LAW, "acts": "push"},
    "a rope with a curve": {"curve": MIRRORED, "acts": "pull"},
    "a buffer": {"stiffness": 3.0, "acts": "push"},
    "a rope": {"stiffness": 3.0, "acts": "pull"},
}


def touching(given):
    """A mass that comes to a buffer, or to the end of a rope, at its full speed."""
    given, side = dict(given), 1.0 if given["acts"] == "push" else -1.0
    m = Model("touching")
    x = m.coordinate("x", start=0.34 * side, rate=-4.0 * side)
    m.body("box", mass=1, com=(x, 0))
    m.potential("2*x^2")
    if "curve" in given:
        m.table("law", columns=given.pop("curve"), kind="pchip", outside="hold")
        given["curve"] = "law"
    m.spring("band", points=[(x, 0), (-2.0, 0)], length=2.0, damping=m.parameter("c", 0.0), **given)
    return m.derive()


@pytest.mark.parametrize("way", WAYS)
def test_series_see_what_no_branch_holds(way, monkeypatch):
    system = touching(WAYS[way])
    exact = system.run(0.3, method="dop853", rtol=1e-13, atol=1e-14).states[-1]
    run = system.run(0.3, method="taylor", rtol=1e-10)
    assert run.states[-1] == pytest.approx(exact, abs=3e-8)
    assert all(check.ok for check in run.health)
    if way != "a buffer with a curve":
        return
    monkeypatch.setattr(LoopArrays, "look_for_choices", lambda self: None)
    blind = touching(WAYS[way]).run(0.3, method="taylor", rtol=1e-10)
    assert abs(blind.states[-1] - exact).max() > 5 * abs(run.states[-1] - exact).max()
