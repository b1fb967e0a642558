"""Vibrations with a frame, or two, in each period: frames see nothing of them, and errors are measured all the same."""

import numpy as np
import pytest

from symgen import Model


def vibration(hertz, start="start"):
    m = Model("vibration")
    m.coordinate("x", start=0.01 if start == "start" else 0.0, rate=0.0 if start == "start" else 2.0)
    m.kinetic("dot(x)^2/2")
    m.potential(f"{(2.0 * np.pi * hertz) ** 2!r}*x^2/2")
    return m.derive()


@pytest.mark.parametrize("hertz", [30.0, 60.0, 120.0])
@pytest.mark.parametrize("start", ["start", "rate"])
@pytest.mark.parametrize("method", ["taylor", "dop853", "radau5", "rk4"])
def test_a_right_run_is_not_doubted_at_the_frequency_of_its_frames(hertz, start, method):
    """Sixty frames a second are the default: from the start on all of them, or each second, have one state."""
    run = vibration(hertz, start).run(4.0, method=method)
    size = 0.01 if start == "start" else 2.0 / (2.0 * np.pi * hertz)
    assert np.ptp(run["x"]) < 1e-2 * size or np.ptp(run["dot(x)"]) < 1e-2 * 2.0 * np.pi * hertz * size
    assert not run.objections, run.objections


@pytest.mark.parametrize("hertz", [60.0, 61.3])
def test_a_wrong_one_is_objected_to(hertz):
    """Steps that lose the phase, or amplitude, are found as they are with other frames."""
    system = vibration(hertz)
    assert any(entry.check == "accuracy" for entry in system.run(20.0, method="verlet").objections)
    lost = system.run(4.0, method="implicit_euler")
    assert abs(lost["x"][-1]) < 5e-3
    assert lost.objections
