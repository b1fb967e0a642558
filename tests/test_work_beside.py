"""A balance that is off by the work alone is a note where the motion, integrated beside the run, is balanced."""

import re

import pytest

from symgen import Model
from symgen.link import derive_text
from symgen.runtime import load

LAW = [
    [-0.64505, -0.492206, -0.356756, -0.179288, 0.0, 0.0693887, 0.122557, 0.24455, 0.528424],
    [-3.60878, -3.55117, -3.19508, -2.33318, 0.0, 0.0403636, 0.0751816, 11.3568, 14.2893],
]


def rope() -> Model:
    """Behind the wall its damping takes all of a rope's force: its potential sinks, and nothing pulls."""
    m = Model("rope")
    x = m.coordinate("x", start=-0.416605, rate=3.278127)
    m.body("box", mass=1, com=(x, 0))
    m.table("law", columns=LAW, kind="pchip", outside="extend")
    m.spring("band", points=[(x, 0), (-2.0, 0)], curve="law", length=2.0, damping=3.0, acts="pull")
    m.potential("2*x^2")
    m.event("wall", "x - 0.2", direction="rising", then={"reset": {"dot(x)": "-0.894956*dot(x)"}})
    return m


def energy_entry(run):
    (found,) = [check for check in run.health if check.check == "energy"]
    return found


@pytest.mark.parametrize("method", ["radau5", "radau9"])
def test_a_right_motion_is_not_doubted_for_its_work(method):
    system = rope().derive()
    run = system.run(1.78, method=method, rtol=1e-10)
    reference = system.run(1.78, method="dop853", rtol=1e-13, atol=1e-14)
    assert run.states[-1] == pytest.approx(reference.states[-1], abs=1e-6)
    entry = energy_entry(run)
    assert entry.value > 1e-5
    assert entry.ok and entry.note and "by the work alone" in entry.says
    assert not run.objections


@pytest.mark.parametrize("method", ["radau5", "dop853"])
def test_energies_that_do_not_belong_to_the_forces_stay_an_objection(method):
    """The motion is right, and a balance beside it is off as well."""
    text = derive_text(rope()).text
    begin = text.index("def energy(")
    changed = re.sub(r"out\[1\] = (.*)", r"out[1] = 1.001*(\1)", text[begin:], count=1)
    run = load(text[:begin] + changed).run(1.78, method=method, rtol=1e-10)
    assert not energy_entry(run).ok
