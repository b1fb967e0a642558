"""What goes on beside a long run with a looser tolerance must be more accurate than the run itself."""

import numpy as np

from symgen import Model


def test_a_companion_of_the_rest_does_not_lose_the_phase_itself():
    """A hardening spring over a thousand periods: the step of this method loses a tenth of the range."""
    m = Model("hardening")
    m.coordinate("x", start=1.15)
    m.kinetic("dot(x)^2/2")
    m.potential("x^2/2 + x^4/4")
    system = m.derive()
    run = system.run(6283.185, method="generalized_alpha")
    exact = system.run(6283.185, method="taylor", rtol=1e-14, atol=1e-15)
    off = (np.abs(run.states - exact.states) / np.ptp(exact.states, axis=0)).max()
    assert off > 0.1
    (said,) = [entry.value for entry in run.health if entry.check == "accuracy"]
    assert 0.4 * off < said < 2.5 * off
    assert run.objections
