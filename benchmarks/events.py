"""What an event costs with all that follows it: `python benchmarks/events.py [--million]`.

Processor time of runs in which a ball bounces, for each flight with its event: resets and impacts, in `system.run` and
in prepared runs. Beside them SciPy's `solve_ivp` with an event that ends a flight, called again for each, on the same
compiled right-hand side.

Then that of changes of stick and slip, of impacts beside friction, and of forces that jump or have a kink, each with
the motion up to it: by how much a run takes longer that has more of them. Impacts, resets and jumps beside an input of
two pieces a second are among them, and those of a stop that stays closed for a while, of a constrained model, of two
stops at one instant, and of blows on a bar that rests on its other end. Last, what each further piece of an input costs
beside such events, with its step; at the ends of pieces that are held, forces jump.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp

from symgen import Model, load
from symgen.runtime.code import stand_ins
from symgen.runtime.inputs import Table

_BALL = """
name = "ball"
[parameters]
e = 1.0
g = "9.81"
[coordinates]
y = { start = 1.0 }
[energy]
kinetic = "dot(y)^2/2"
potential = "g*y"
"""
_FLOORS = {
    "reset": '[events.floor]\nwhen = "y"\ndirection = "falling"\nthen = { reset = { "dot(y)" = "-e*dot(y)" } }\n',
    "impact": '[stops.floor]\ngap = "y"\nrestitution = "e"\n',
}
_BESIDE_FRICTION = """
[parameters]
M = "1 kg"
g = "9.81 m/s^2"
rubs = "1e-4 N"
e = 0.9999
[coordinates]
y = { unit = "m", start = 1.0 }
[energy]
kinetic = "M*dot(y)^2/2"
potential = "M*g*y"
[friction.rod]
coordinate = "y"
force = "rubs"
[stops.floor]
gap = "y"
restitution = "e"
"""
_OSCILLATOR = """
[coordinates]
x = { start = 1.0, rate = 0.3 }
[energy]
kinetic = "dot(x)^2/2"
potential = "2*x^2"
[forces]
x = "FORCE"
"""
_INPUT = "[inputs]\nu = {}\n"
_RESTING = """
[parameters]
M = "1 kg"
[coordinates]
x = { unit = "m", start = 0.1 }
[energy]
kinetic = "M*dot(x)^2/2"
[forces]
x = "-1 + 1.5*cos(t)"
[stops.wall]
gap = "x"
"""
_ON_A_CIRCLE = """
[coordinates]
x = { start = 0.6 }
y = { start = -0.8 }
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2"
potential = "9.81*y"
[constraints]
length = "x^2 + y^2 - 1"
[stops.wall]
gap = "x + 0.1"
restitution = 1
"""
_ON_BOTH_ENDS = """
[coordinates]
y = { start = 1.0 }
a = {}
[energy]
kinetic = "dot(y)^2/2 + 0.15*dot(a)^2"
potential = "9.81*y"
[stops.left]
gap = "y - 0.5*a"
restitution = 1
[stops.right]
gap = "y + 0.5*a"
restitution = 1
"""
_LIFTED = """
[coordinates]
y = { start = 0.02 }
a = { start = 0.04 }
[energy]
kinetic = "dot(y)^2/2 + 0.03*dot(a)^2"
potential = "9.81*y"
[forces]
y = "3 + 4*cos(8*t)"
a = "0.5*(3 + 4*cos(8*t))"
[stops.left]
gap = "y - 0.5*a"
[stops.right]
gap = "y + 0.5*a"
"""
_ON_A_BELT = """
[coordinates]
x = {}
y = {}
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2"
potential = "9.81*y + 25*x^2"
[stops.floor]
gap = "y"
[friction.sole]
speed = "dot(x) - 0.3"
coefficient = 0.4
static = 0.6
normal = "floor"
"""
_WITH_SPIN = """
[coordinates]
x = {}
y = { start = 0.4 }
phi = { rate = 4.0 }
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2 + 0.15*dot(phi)^2"
potential = "9.81*y"
[forces]
phi = "6*sin(t)"
[stops.floor]
gap = "y"
restitution = 1
[friction.tread]
speed = "dot(x) - dot(phi)"
coefficient = 0.3
normal = "floor"
"""
_ROUGH_CIRCLE = (
    _ON_A_CIRCLE.split("[stops.wall]")[0]
    + """
[forces]
x = "8*sin(t)"
[friction.pin]
speed = "x*dot(y) - y*dot(x)"
force = 2.0
static = 2.5
"""
)
_SWITCHED = {  # and where a force goes over to another branch
    "stick and slip": (None, 0.0),
    "impact beside friction": (_BESIDE_FRICTION, 0.0),
    "jump": (_OSCILLATOR.replace("FORCE", "-sign(x)/2"), 0.0),
    "kink": (_OSCILLATOR.replace("FORCE", "-abs(x)/2"), 0.0),
    "where": (_OSCILLATOR.replace("FORCE", "-where(x > 0.1, 1, 0.3)/2"), 0.1),
    "impact, input": (_BALL + _FLOORS["impact"] + _INPUT + '[forces]\ny = "u"\n', 0.0),
    "reset, input": (_BALL + _FLOORS["reset"] + _INPUT + '[forces]\ny = "u"\n', 0.0),
    "jump, input": (_OSCILLATOR.replace("FORCE", "u - sign(x)/2") + _INPUT, 0.0),
    "stop that stays closed": (_RESTING, 0.0),
    "impact, constrained": (_ON_A_CIRCLE, 0.0),
    "reset, constrained": (
        _ON_A_CIRCLE[: _ON_A_CIRCLE.index("[stops")]
        + '[events.wall]\nwhen = "x + 0.1"\ndirection = "falling"\nthen = { reset = { "dot(x)" = "-dot(x)" } }\n',
        0.0,
    ),
    "two impacts at an instant": (_ON_BOTH_ENDS, 0.0),
    "blow shared by what rests": (_LIFTED, 0.0),
    "stick and slip by a stop": (_ON_A_BELT, 0.0),
    "impact that rubs": (_WITH_SPIN, 0.0),
    "stick, slip, constrained": (_ROUGH_CIRCLE, 0.0),
}
_BESIDE_PIECES = ("impact, input", "reset, input", "jump, input")
_BESIDE_JUMPS = {"stop": "", "stop and friction": '[friction.rub]\ncoordinate = "x"\nforce = 0.05\n'}
_PUSHED = """
name = "pushed"
[coordinates]
x = { start = 1.0 }
[inputs]
u = {}
[energy]
kinetic = "dot(x)^2/2"
potential = "2*x^2"
[forces]
x = "500*u"
[stops.wall]
gap = "x + 0.8"
restitution = 0.7
"""
_FEW_PIECES, _PIECES, _JUMPS = 10, (5_000, 40_000), 2_000
_PIECES_PER_SECOND = 100
_METHODS = ("taylor", "dop853", "radau5")
_FLIGHT = 2.0 * np.sqrt(2.0 / 9.81)  # [s]
_EVENTS, _PEER_EVENTS, _TURNS = 10_000, 50, 5
_SHORT, _LONG, _FRAMES_PER_SECOND = 50.0, 1000.0, 20  # [s]
_TIMES = np.linspace(0.0, _LONG, 2001)


def main() -> None:
    stand_ins.at_once = True  # what runs come to, however short they are here
    million = "--million" in sys.argv
    print(f"{'event':10}{'method':10}{'run':>10}{'prepared':>10}{'SciPy':>10}   [µs for each]")
    for kind, floor in _FLOORS.items():
        ball = Model.from_toml(_BALL + floor).derive()
        for method in ("taylor", "dop853"):
            t_end = _EVENTS * _FLIGHT
            ways = (partial(ball.run, t_end, method=method), ball.prepare(t_end, method=method))
            ours = [1e6 * least(way) / _EVENTS for way in ways]
            print(f"{kind:10}{method:10}{ours[0]:10.1f}{ours[1]:10.1f}{scipy_events(ball):10.1f}")
    print(f"{'with the motion up to it':26}" + "".join(f"{method:>10}" for method in _METHODS))
    for kind, (text, level) in _SWITCHED.items():
        system = (
            load("stick_slip")
            if text is None
            else Model.from_toml(text if "name" in text else 'name = "switched"' + text).derive()
        )
        print(
            f"{kind:26}" + "".join(f"{more_events(system, method, level):10.1f}" for method in _METHODS),
            flush=True,
        )
    print(f"{'piece of an input beside':26}" + "".join(f"{method:>10}" for method in _METHODS))
    for kind in _BESIDE_PIECES:
        text, _ = _SWITCHED[kind]
        driven = Model.from_toml(text if "name" in text else 'name = "switched"' + text).derive()
        for n in _PIECES:
            name = f"{kind.split(',')[0]}, {n} of them"
            row = "".join(f"{more_pieces(driven, method, n):10.1f}" for method in _METHODS)
            print(f"{name:26}{row}", flush=True)
    for kind, friction in _BESIDE_JUMPS.items():
        pushed = Model.from_toml(_PUSHED + friction).derive()
        row = "".join(f"{more_pieces(pushed, method, _JUMPS, 'hold'):10.1f}" for method in _METHODS)
        print(f"{kind + ', held':26}{row}", flush=True)
    if million:
        began = time.thread_time()
        solution = ball.run(1e6 * _FLIGHT, method="dop853")
        spent, off = time.thread_time() - began, solution.energy.max_error
        print(f"{len(solution.events)} impacts: {spent:.1f} s, energy off by {off:.1e}")


def least(way: Callable[[], object]) -> float:
    """Return the least processor time of a call [s]."""
    way()
    found = []
    for _ in range(_TURNS):
        began = time.thread_time()
        way()
        found.append(time.thread_time() - began)
    return min(found)


def more_events(system: object, method: str, level: float) -> float:
    """Return the processor time of an event with the motion up to it [µs]: of a long run, less that of a short one."""
    spent, events = [], []
    given = {"inputs": {"u": Table(_TIMES, 1e-3 * np.cos(_TIMES))}} if system.inputs else {}
    for t_end in (_SHORT, _LONG):
        spent.append(least(partial(system.run, t_end, method=method, **given)))
        counted = system.run(t_end, method=method, fps=_FRAMES_PER_SECOND, **given)
        events.append(len(counted.events) or crossings(counted.states[:, 0] - level))
    return 1e6 * (spent[1] - spent[0]) / (events[1] - events[0])


def more_pieces(system: object, method: str, n: int, kind: str = "linear") -> float:
    """Return the processor time of a piece of an input [µs]: of a run with `n`, less that of one with few."""
    t_end, spent = n / _PIECES_PER_SECOND, []
    for pieces in (_FEW_PIECES, n):
        times = np.linspace(0.0, t_end, pieces + 1)
        table = Table(times, 1e-3 * np.cos(40.0 * times), kind)
        spent.append(least(partial(system.run, t_end, method=method, rtol=1e-6, inputs={"u": table})))
    return 1e6 * (spent[1] - spent[0]) / (n - _FEW_PIECES)


def crossings(values: np.ndarray) -> int:
    """Return how often values change their sign: forces that jump are in no log."""
    return int(np.count_nonzero((values[1:] > 0.0) != (values[:-1] > 0.0)))


def scipy_events(system: object) -> float:
    """Return the processor time of a flight and its event in SciPy [µs]."""
    kernel, p = system.kernel("rhs"), system.parameter_values()

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        return kernel(t, y, p)[:2]

    def floor(t: float, y: np.ndarray) -> float:
        return y[0]

    floor.terminal, floor.direction = True, -1

    def bounces() -> None:
        t, y = 0.0, np.array([1.0, 0.0])
        for _ in range(_PEER_EVENTS):
            found = solve_ivp(slope, (t, t + 10.0), y, "DOP853", events=floor, rtol=1e-8, atol=1e-10)
            t, y = found.t[-1], found.y[:, -1] * [1.0, -1.0]

    return 1e6 * least(bounces) / _PEER_EVENTS


if __name__ == "__main__":
    main()
