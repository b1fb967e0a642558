"""Runs that are cut anywhere, taken up again, and watched at any time: bit for bit the run that nobody touched."""

from __future__ import annotations

import functools
import math
import tempfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime import load, solve
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs import Controller, Polynomial, Table
from symgen.runtime.integrate.forms import FORMS
from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.recording.recorder import RunRecorder
from symgen.runtime.recording.resume import Resumed

from .judging import flag, refusal
from .models import bundled_text, described_text
from .scenario import RIGHT, WRONG, Outcome, Scenario

if TYPE_CHECKING:
    from symgen.runtime import Solution, System

DRAWS, DRAWS_IN_SHORT = 5, 1
_MOST_STEPS = 20_000
_LIMIT = 900.0  # seconds; every method's loop may have to be compiled
_SHORT = {
    "plain": ("auto", "euler", "dop853", "gauss8", "bdf"), "bounce": ("taylor", "dop853"), "friction": ("radau5",),
    "sampled controller": ("dopri5",), "closed loop": ("dop853", "rattle"), "quaternions": ("rk4",),
    "plate": ("auto",), "bristles": ("radau5",), "tyre": ("dop853",), "kinematic": ("taylor", "bdf"),
}  # fmt: skip
_TROLLEY = """
name = "trolley"
[parameters]
m = 1.5
k = 12.0
[coordinates]
x = { start = 0.3, rate = -0.2 }
y = { start = 0.0, rate = 0.4 }
[energy]
kinetic = "m*dot(x)^2/2 + m*dot(y)^2/2"
potential = "k*x^2/2 + k*(x - y)^2/2 + 3*y^4"
[inputs]
u = { default = 0.0 }
[forces]
x = "u - 0.2*dot(x)"
[events.passes]
when = "y"
then = "record"
"""
_PULSED = """
name = "pulsed"
[parameters]
a = 30.0
[coordinates]
x = { start = 0.3, rate = -0.2 }
[energy]
kinetic = "dot(x)^2/2"
potential = "2*x^2 + x^4"
[forces]
x = "a*exp(-((t - 0.7)/0.01)^2) + 5*(sign(t - 1.1) - sign(t - 1.203)) + 2*sin(40*t) + abs(t - 1.6)"
"""
_SERVO = """
name = "servo"
[parameters]
tau = 0.08
[coordinates]
x = { start = 0.3, rate = -0.2 }
[states]
force = { derivative = "(-4*x - error - force)/tau", start = 0.5 }
error = { derivative = "x - 0.1*sin(5*t)" }
[energy]
kinetic = "dot(x)^2/2"
potential = "2*x^2"
[forces]
x = "force - spring(x)"
[tables.spring]
columns = [[-0.4, -0.1, 0.0, 0.2, 0.5], [-3, -0.4, 0, 0.5, 4]]
kind = "linear"
outside = "extend"
"""
_RELAY = """
name = "relay"
[coordinates]
x = { start = 0.3, rate = -0.2 }
y = { start = -0.1, rate = 0.5 }
[energy]
kinetic = "dot(x)^2/2 + dot(y)^2/2"
potential = "2*x^2 + 3*(x - y)^2"
[forces]
x = "where(y > 0.05, -0.7, 0.4) - 0.1*dot(x)"
y = "-3*max(y - 0.1, 0) + abs(x)"
"""
_PLATE = """
name = "plate"
[parameters]
mu = 0.3
[coordinates]
x = {}
y = {}
z = { start = 0.02 }
[bodies.block]
mass = 2
com = ["x", "y", "z"]
[gravity]
z = -9.81
[forces]
x = "8*sin(5*t)"
y = "6*cos(7*t)"
[stops.floor]
gap = "z"
restitution = 0.3
[friction.sole]
speeds = ["dot(x)", "dot(y)"]
coefficient = "mu"
static = "1.2*mu"
normal = "floor"
"""
_BRISTLES = """
name = "bristles"
[coordinates]
x = { start = 0.3, rate = -0.2 }
[energy]
kinetic = "dot(x)^2/2"
potential = "10*x^2"
[inputs]
push = { table = [[0, 0.5, 1, 3], [0.1, 2.4, -1.2, 0.3]], kind = "linear" }
[forces]
x = "push"
[bristles.sole]
speed = "dot(x) - 0.2*cos(3*t)"
stiffness = 1e3
damping = 20
viscous = 0.2
coulomb = 1.0
static = 1.5
stribeck = 0.05
"""
_TYRE = """
name = "tyre"
[bodies.wheel]
mass = 10
inertia = [0.3, 0.5, 0.3]
com = [0, 0, 0]
[joints.free]
type = "free"
child = "wheel"
start = [0, 0, 0.295, 1, 0, 0, 0]
rate = [2.0, 0.1, 0, 0, 20.0, 0.3]
[gravity]
z = -9.81
[tyres.rim]
body = "wheel"
radius = 0.3
stiffness = 5e4
damping = 100
relaxation = 0.2
slip_stiffness = 12
friction = 0.8
"""
_SENSED = """
name = "sensed"
[coordinates]
a = { start = 0.3, rate = 1.0 }
s = { start = 0.5 }
y = { guess = 0 }
[bodies.rod]
mass = 1
inertia = 0.1
com = ["cos(a)", "sin(a)"]
angle = "a"
[bodies.slide]
mass = 2
com = ["s", "y"]
[gravity]
y = -9.81
[energy]
potential = "5*(s - cos(a))^2"
[constraints]
rail = "y - 0.1*s"
[friction.rub]
speed = "dot(s)"
coefficient = 0.1
normal = "rail"
[outputs]
pull = "reaction(rail)"
jolt = "acceleration(s)"
[events.slack]
when = "reaction(rail) - 19"
then = "record"
"""
_KINEMATIC = """
name = "kinematic"
[parameters]
w = 2.0
[coordinates]
a = { guess = 0.3 }
b = { guess = 0.4 }
[states]
z = { derivative = "sin(b) - 3*z", start = 0.1 }
[constraints]
drive = "a - 0.3 - w*t - 0.2*sin(3*t)"
link = "0.5*sin(a) - 2*sin(b)"
[events.passes]
when = "b"
then = "record"
"""
_BEGUN = """
name = "begun"
[parameters]
k = 100.0
c = 2.0
[coordinates]
x = { guess = 0.1 }
y = { start = 0.0 }
[bodies.a]
mass = 1
com = ["y", "x"]
[gravity]
y = -9.81
[energy]
potential = "k*(x - 0.2)^2/2 + 20*y^2"
dissipation = "c*dot(x)^2/2"
[forces]
y = "3*sin(4*t)"
x = "9*sin(3*t)^2"
[stops.floor]
gap = "x"
restitution = 0.4
[start]
closed = ["floor"]
find = ["k"]
equations = ["k = 30"]
"""


@dataclass(frozen=True)
class Situation:
    """What is integrated.

    Attributes
    ----------
    text : callable
        () -> the text of its module.
    t_end : float [s]
    inputs : callable
        () -> the inputs over time; made anew for each run, as a process of its own would.
    options : mapping
        More of `solve`.
    """

    text: Callable[[], str]
    t_end: float
    inputs: Callable[[], dict[str, Any] | None] = lambda: None
    options: Mapping[str, Any] = field(default_factory=dict)


def _feedback(t, x):
    return 0.3 * math.cos(5.0 * t) - 2.0 * x[0] - 0.5 * x[2]


def _sampled(t: float, x: np.ndarray, memory: np.ndarray) -> float:
    memory[0] += 0.01 * x[0]
    return -3.0 * x[0] - 4.0 * memory[0] + 0.5 * math.sin(3.0 * t)


def _knots() -> np.ndarray:
    return np.linspace(0.0, 1.7, 18)


def _controller() -> dict[str, Any]:
    return {"u": Controller(_sampled, period=0.07, noise={"x": 1e-2}, seed=3, memory=[0.0])}


SITUATIONS: dict[str, Situation] = {
    "plain": Situation(lambda: bundled_text("double_pendulum"), 1.5),
    "separable": Situation(lambda: bundled_text("pendulum"), 3.0),
    "bounce": Situation(lambda: bundled_text("bouncing_ball"), 2.0),
    "stop": Situation(lambda: bundled_text("door_stop"), 2.0),
    "friction": Situation(lambda: bundled_text("stick_slip"), 3.0),
    "linear table": Situation(
        lambda: described_text(_TROLLEY), 2.0, lambda: {"u": (_knots(), np.sin(7.0 * _knots()))}
    ),
    "held table": Situation(
        lambda: described_text(_TROLLEY), 2.0, lambda: {"u": Table(_knots(), np.cos(5.0 * _knots()), "hold")}
    ),
    "smooth table": Situation(
        lambda: described_text(_TROLLEY), 2.0, lambda: {"u": Table(_knots(), np.cos(5.0 * _knots()), "cubic")}
    ),
    "polynomial": Situation(
        lambda: described_text(_TROLLEY), 2.0, lambda: {"u": Polynomial([0.1, -1.0, 2.0])}
    ),
    "sampled controller": Situation(lambda: described_text(_TROLLEY), 2.0, _controller),
    "continuous controller": Situation(
        lambda: described_text(_TROLLEY), 2.0, lambda: {"u": Controller(_feedback)}
    ),
    "quaternions": Situation(lambda: bundled_text("free_rigid_body"), 3.0),
    "held body": Situation(lambda: bundled_text("heavy_top_absolute"), 0.1),
    "closed loop": Situation(lambda: bundled_text("four_bar"), 0.4),
    "rolling": Situation(lambda: bundled_text("rolling_disc"), 1.0),
    "moved": Situation(lambda: bundled_text("car_axis"), 0.2),
    "pulses": Situation(lambda: described_text(_PULSED), 2.0),
    "breaks": Situation(lambda: described_text(_PULSED), 2.0, options={"breaks": [0.33, 0.9, 1.91, 2.4]}),
    "states": Situation(lambda: described_text(_SERVO), 2.0),
    "switches": Situation(lambda: described_text(_RELAY), 2.0),
    "plate": Situation(lambda: described_text(_PLATE), 1.0),
    "bristles": Situation(lambda: described_text(_BRISTLES), 2.0),
    "tyre": Situation(lambda: described_text(_TYRE), 0.3),
    "sensed": Situation(lambda: described_text(_SENSED), 1.0),
    "kinematic": Situation(lambda: described_text(_KINEMATIC), 1.5),
    "begun": Situation(lambda: described_text(_BEGUN), 1.5),
    "in turn": Situation(lambda: bundled_text("newtons_cradle"), 0.8),
    "split": Situation(lambda: bundled_text("pendulum_field"), 1.0, options={"split": True}),
}
_CONSTRAINED = ("held body", "closed loop", "rolling", "moved", "sensed", "kinematic")


@functools.cache
def _system(text: str) -> System:
    return load(text)


@dataclass(frozen=True)
class Draw:
    """Where a run is cut, and when it is looked at.

    Attributes
    ----------
    t_end, cut : float [s]
    at : list of float [s]
        The cut among them.
    fps : float
    """

    t_end: float
    cut: float
    at: list[float]
    fps: float


def draw(whole: Solution, random: np.random.Generator) -> Draw:
    """Draw a cut: anywhere, at the end of a step or next to one, at an event, or at a round number."""
    t_end = float(whole.t[-1])
    kind, log = random.integers(6), whole.step_log
    cut = float(random.uniform(0.02, 0.98)) * t_end
    if kind == 1 and len(log) > 3:
        cut = float(log[random.integers(1, len(log) - 1), 0])
    elif kind == 2 and len(log) > 3:
        cut = float(
            np.nextafter(log[random.integers(1, len(log) - 1), 0], random.choice([-1.0, 1.0]) * np.inf)
        )
    elif kind == 3 and whole.events:
        cut = whole.events[random.integers(len(whole.events))].t
    elif kind == 4:
        cut = round(cut, 1)
    if not 1e-3 * t_end < cut < 0.999 * t_end:
        cut = 0.5 * t_end
    at = sorted({cut, *random.uniform(0.0, t_end, random.integers(0, 6)).tolist()})
    return Draw(t_end, cut, at, float(random.choice([7.0, 50.0, float(random.uniform(5.0, 300.0))])))


def _run(situation: Situation, t_end: float, options: dict[str, Any], **more: Any) -> Solution:
    given = {**situation.options, **options, **more}
    return solve(_system(situation.text()), t_end, inputs=situation.inputs(), max_steps=_MOST_STEPS, **given)


def recorded(path: Path, text: str, begin: Callable[..., Solution]) -> Solution:
    """Begin a run that writes a recording; returns it once it is over."""
    made = []

    def recorder(**settings: Any) -> RunRecorder:
        made.append(RunRecorder(path, module_text=text, model_text="", **settings))
        return made[0]

    solution = begin(recorder=recorder)
    made[0].finish(solution.status, [check.to_dict() for check in solution.health], solution.stats)
    return solution


def _bits(run: Solution) -> bytes:
    return run.q[-1].tobytes() + run.v[-1].tobytes()


def _events(run: Solution, until: float = math.inf) -> list[tuple]:
    return [
        (e.name, e.action, e.t, e.q_before.tobytes(), e.v_before.tobytes(), e.q_after.tobytes(), e.v_after.tobytes())
        for e in run.events
        if e.t <= until
    ]  # fmt: skip


def differences(
    situation: Situation, options: dict[str, Any], whole: Solution, where: Draw, folder: Path
) -> list[str]:
    """Return what differs between a run, and the same one watched, cut, and taken up again."""
    found = []
    watched = _run(situation, where.t_end, options, at=where.at, fps=where.fps)
    if _bits(watched) != _bits(whole):
        found.append("the end of a run that is watched")
    if watched.step_log.tobytes() != whole.step_log.tobytes():
        found.append("the steps of a run that is watched")
    if _events(watched) != _events(whole):
        found.append("the events of a run that is watched")
    first, rest = folder / "first.rrd", folder / "rest.rrd"
    text = situation.text()
    cut = recorded(first, text, functools.partial(_run, situation, where.cut, options, fps=where.fps))
    sample = next(s for s in watched.samples if s.t == where.cut)
    if cut.q[-1].tobytes() + cut.v[-1].tobytes() != sample.q.tobytes() + sample.v.tobytes():
        found.append("the state at the cut")
    if _events(cut) != _events(whole, where.cut):
        found.append("the events before the cut")
    n = int(
        np.count_nonzero(watched.t < where.cut * (1.0 - 2e-9))
    )  # a frame that is nearer gives way to the end
    if cut.q[:n].tobytes() != watched.q[:n].tobytes() or cut.t[:n].tobytes() != watched.t[:n].tobytes():
        found.append("the frames before the cut")
    resumed = recorded(rest, text, functools.partial(Resumed(first, situation.inputs()).run, where.t_end))
    if _bits(resumed) != _bits(whole):
        found.append("the end of a run that was taken up")
    if _events(resumed) != _events(whole):
        found.append("the events of a run that was taken up")
    log = resumed.step_log
    if log.tobytes() != whole.step_log[len(whole.step_log) - len(log) :].tobytes():
        found.append("the steps of a run that was taken up")
    return found


def run_cuts(name: str, method: str, form: str, draws: int) -> Outcome:
    """Cut and watch one run at random times."""
    situation = SITUATIONS[name]
    options = {"method": method} | ({"constraints": form} if form else {})
    try:
        whole = _run(situation, situation.t_end, options)
    except RuntimeModelError as error:
        return refusal(error)
    if whole.status != "success":
        return flag(whole)
    random = np.random.default_rng(zlib.crc32(f"{name} {method} {form}".encode()))
    with tempfile.TemporaryDirectory() as folder:
        for number in range(draws):
            where = draw(whole, random)
            if found := differences(situation, options, whole, where, Path(folder)):
                return Outcome(WRONG, f"draw {number}, {where}: differ: {'; '.join(found)}")
    return Outcome(RIGHT, f"{draws} cuts, bit for bit")


def scenarios() -> Iterator[Scenario]:
    """Yield all: every method, with every form of constraints that it has."""
    for name in SITUATIONS:
        for method in ("auto", *METHODS):
            short = method in _SHORT.get(name, ())
            run = functools.partial(run_cuts, name, method, "", DRAWS_IN_SHORT if short else DRAWS)
            yield Scenario("cuts", f"cuts, {name}: {method}", run, method, short=short, limit=_LIMIT)
        for form, methods in FORMS.items():
            if form == "projection" or name not in _CONSTRAINED:
                continue
            for method in methods:
                run = functools.partial(run_cuts, name, method, form, DRAWS)
                yield Scenario(
                    "cuts",
                    f"cuts, {name}: {method}, {form}",
                    run,
                    f"{method}, {form}",
                    short=False,
                    limit=_LIMIT,
                )
