"""The bundled clutch against its phases: slipping, locked, slipping, integrated one after another by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from symgen import load

J1, J2, ARM, SLIDES, STICKS = 0.2, 0.6, 4 * 0.1, 0.3, 0.36


def press(t):
    return np.interp(t, [0.0, 0.5, 1.5, 5.5, 5.8, 8.0], [0.0, 0.0, 500.0, 500.0, 0.0, 0.0])


def torques(t, w1, w2):
    return 20.0 - 0.15 * w1, -0.15 * w2 - 320.0 * np.exp(-(((t - 4.0) / 0.06) ** 2))


def slipping(t, y):
    """It slips until both turn alike; the slip keeps its sign while this is called."""
    one, two = torques(t, y[0], y[1])
    rub = SLIDES * ARM * press(t) * slipping.sense
    return [(one - rub) / J1, (two + rub) / J2, y[0], y[1]]


def locked(t, y):
    one, two = torques(t, y[0], y[0])
    change = (one + two) / (J1 + J2)
    return [change, change, y[0], y[1]]


def held(t, w):
    """The torque that the locked clutch passes on."""
    one, two = torques(t, w, w)
    return one - J1 * (one + two) / (J1 + J2)


def phases(t_end):
    t, y, times, is_locked, breaks = 0.0, [100.0, 0.0, 0.0, 0.0], [], False, (0.5, 1.5, 5.5, 5.8, t_end)
    slipping.sense = 1.0
    while t < t_end:
        until = min(b for b in breaks if b > t)

        def alike(t, y):
            return y[0] - y[1]

        def too_much(t, y):
            return STICKS * ARM * press(t) - abs(held(t, y[0]))

        event = too_much if is_locked else alike
        event.terminal, event.direction = True, -1.0 if is_locked else -slipping.sense
        found = solve_ivp(
            locked if is_locked else slipping, (t, until), y, "DOP853", events=event, rtol=1e-12, atol=1e-12,
            max_step=0.01,
        )  # fmt: skip
        t, y = found.t[-1], found.y[:, -1]
        if found.status == 1:
            times.append(t)
            if is_locked:
                slipping.sense = np.sign(held(t, y[0]))
            y[1] = y[0] if not is_locked else y[1]
            is_locked = not is_locked
    return np.array(times), y


@pytest.fixture(scope="module")
def clutch():
    return load("clutch")


@pytest.mark.parametrize(
    ("method", "tolerance"), [("auto", 1e-7), ("dop853", 1e-7), ("radau5", 1e-6), ("bdf", 1e-4)]
)
def test_it_locks_and_lets_go_when_its_phases_say(clutch, method, tolerance):
    run = clutch.run(method=method)
    assert run.ok, [check.says for check in run.objections]
    times, end = phases(8.0)
    assert [event.action for event in run.events] == ["stick", "slip", "stick", "slip"]
    np.testing.assert_allclose([event.t for event in run.events], times, atol=tolerance)
    np.testing.assert_allclose(
        [run["dot(motor)"][-1], run["dot(machine)"][-1], run["motor"][-1], run["machine"][-1]],
        end,
        rtol=10 * tolerance,
    )


def test_while_it_slips_before_all_else_it_speeds_the_machine_up_by_a_formula(clutch):
    """From 0.5 s to 1.3 s the pressing force grows by 500 N/s: J2 w' = a s - drag w."""
    run = clutch.run(t_end=1.3)
    a, k, s = SLIDES * ARM * 500.0 / J2, 0.15 / J2, 0.8
    exact = a * (s / k - (1.0 - np.exp(-k * s)) / k**2)
    assert run["dot(machine)"][-1] == pytest.approx(exact, rel=1e-8)


def test_it_opens_when_the_press_no_longer_holds(clutch):
    """The last event, by the force that is needed there."""
    run = clutch.run()
    last = run.events[-1]
    needed = held(last.t, last.v_before[0])
    assert STICKS * ARM * press(last.t) == pytest.approx(abs(needed), rel=1e-8)
    assert brentq(lambda t: STICKS * ARM * press(t) - abs(needed), 5.5, 5.79) == pytest.approx(
        last.t, abs=1e-8
    )
