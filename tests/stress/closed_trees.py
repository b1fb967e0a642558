"""Two bodies in space, the second placed by a joint, and by a closure that holds it to the first one.

The joint has its motions for coordinates; of the closure they follow from constraints, and its angle or way has no
inertia. Springs, dampers, friction, stops, choices and inputs act on both alike. Here both are run, the tree tighter
and by another method: a run of the closure is judged by it.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from symgen.runtime import Solution
from symgen.runtime.inputs import Table
from symgen.runtime.integrate.methods import find_method

from .judging import attempt, judge_end
from .models import described
from .scenario import RIGHT, Outcome, Scenario

_METHODS = ("taylor", "dop853", "dopri5", "radau5", "radau9", "gauss8", "auto", "bdf", "generalized_alpha")
_CASES = 6  # with each method
_RTOLS = (1e-6, 1e-8, 1e-10)
_ONE_MOTION, _SEVERAL = ("revolute", "prismatic", "screw"), ("spherical", "universal")
_LAWS = (
    "0*b", "where(b > 0.2, -3*(b - 0.2), 0)", "-0.3*sign(b - 0.1)", "-2*b*abs(b)", "-max(-0.5, min(0.5, 4*b))",
)  # fmt: skip
_SEEN = ("a", "dot(a)", "at_x", "at_y", "at_z")


@dataclass(frozen=True)
class Case:
    """One mechanism in both forms.

    Attributes
    ----------
    tree, closed : str
        The model files.
    inputs : dict
    t_end : float [s]
    """

    tree: str
    closed: str
    inputs: dict[str, Table]
    t_end: float


def drawn(number: int) -> Case:
    """Draw a mechanism."""
    r = np.random.default_rng([number, *b"closed trees"])

    def one(low: float, high: float) -> float:
        return round(float(r.uniform(low, high)), 3)

    def some(low: float, high: float, n: int = 3) -> list[float]:
        return [one(low, high) for _ in range(n)]

    first, second = str(r.choice(_ONE_MOTION[:2])), str(r.choice([*_ONE_MOTION, *_ONE_MOTION, *_SEVERAL]))
    has_one = second in _ONE_MOTION
    moves = [0.4 if kind == "prismatic" else 1.0 for kind in (first, second)]
    a, b = (round(part * one(-0.5, 0.5), 4) for part in moves)
    # Rates of several motions are no single equation.
    rate_a, rate_b = (round(part * one(-1.5, 1.5), 4) if has_one else 0.0 for part in moves)
    axis_a, axis_b, at, rpy, pitch = some(-1, 1), some(-1, 1), some(-0.4, 0.4), some(-1, 1), one(0.1, 0.6)
    shared = f"""
name = "drawn"
[bodies.A]
mass = {one(0.5, 3)}
inertia = {some(0.02, 0.03)}
com = [0.1, 0.05, -0.1]
[bodies.B]
mass = {one(0.2, 2)}
inertia = {some(0.01, 0.016)}
com = {some(-0.3, 0.3)}
[joints.a]
type = "{first}"
child = "A"
axis = {axis_a}
start = {a}
rate = {rate_a}
stiffness = {one(10, 60)}
damping = {one(0, 0.5)}
[frames.hinge]
body = "A"
at = {at}
rpy = {rpy}
[points.tip]
body = "B"
at = {some(-0.3, 0.3)}
[outputs]
at_x = "tip_x"
at_y = "tip_y"
at_z = "tip_z"
[gravity]
z = "-9.81 m/s^2"
[inputs]
F = {{}}
"""
    shared += f'[forces]\na = "F"\n{"b = " + repr(str(r.choice(_LAWS))) if has_one else ""}\n'
    if r.random() < 0.5:
        shared += f'[friction.rubs_a]\ncoordinate = "a"\nforce = {one(0.2, 6)}\n'.replace(
            "force", "torque" if first == "revolute" else "force"
        )
    if r.random() < 0.4:
        shared += f'[stops.end_a]\ngap = "{one(0.5, 0.8)} - a"\nrestitution = {r.choice([0.0, 0.5, 0.9])}\n'
    if has_one and r.random() < 0.4:
        shared += f'[stops.end_b]\ngap = "b + {one(0.5, 0.8)}"\nrestitution = {r.choice([0.0, 0.5, 0.9])}\n'
    friction = one(0.05, 2) if has_one and r.random() < 0.6 else 0.0
    motion = f'type = "{second}"\n' + (f"axis = {axis_b}\n" if second != "spherical" else "")
    motion += f"pitch = {pitch}\n" if second == "screw" else ""
    spring = f"stiffness = {one(2, 20)}\ndamping = {one(0, 0.2)}\n" if has_one else ""
    tree = f'[joints.b]\n{motion}parent = "A"\nchild = "B"\norigin = "hinge"\n{spring}'
    tree += f"start = {b}\nrate = {rate_b}\n" if has_one else ""
    if friction:
        kind = "force" if second == "prismatic" else "torque"
        tree += f'[friction.rubs_b]\ncoordinate = "b"\n{kind} = {friction}\n'
    turned, place = _moved(first, axis_a, a, 0.0)
    place, turned = place + turned.apply(at), turned * Rotation.from_euler("xyz", rpy)
    if has_one:
        own, shift = _moved(second, axis_b, b, pitch)
        place, turned = place + turned.apply(shift), turned * own
    q = turned.as_quat()
    guess = [round(float(x), 9) for x in (*place, q[3], *q[:3])]
    closed = f'[joints.loose]\ntype = "free"\nchild = "B"\nguess = {guess}\n'
    closed += f'[closures.hold]\n{motion}frames = ["hinge", "B"]\n{spring}'
    if has_one:
        closed += f'coordinate = "b"\nguess = {b}\n'
        closed += f"friction = {friction}\n" if friction else ""
        closed += f'[start]\nequations = ["b = {b}", "dot(b) = {rate_b}"]\n'
    times = 0.6 * np.arange(5) + r.uniform(0.0, 0.5, 5)
    table = Table(times, 5.0 * r.normal(size=5), kind=str(r.choice(["linear", "cubic", "hold"])))
    return Case(shared + tree, shared + closed, {"F": table}, one(0.8, 2.5))


def _moved(kind: str, axis: list[float], q: float, pitch: float) -> tuple[Rotation, np.ndarray]:
    """How a joint turns and shifts its child."""
    along = np.array(axis) / np.linalg.norm(axis)
    turned = Rotation.identity() if kind == "prismatic" else Rotation.from_rotvec(q * along)
    return turned, along * {"prismatic": q, "screw": pitch * q / (2 * np.pi)}.get(kind, 0.0)


def closure(number: int, method: str) -> Outcome:
    """Run a closure, and judge its end by the tree."""
    case = drawn(number)
    r = np.random.default_rng(number)
    options = {"rtol": float(r.choice(_RTOLS))} if method == "auto" or find_method(method).adaptive else {}
    other = "dop853" if method == "taylor" else "taylor"
    known = attempt(described(case.tree), case.t_end, method=other, rtol=1e-11, inputs=case.inputs)
    if isinstance(known, Outcome) or known.status != "success":
        return Outcome(RIGHT, f"no reference: {known}")
    run = attempt(described(case.closed), case.t_end, method=method, inputs=case.inputs, **options)
    if isinstance(run, Outcome):
        return run
    ranges = np.ptp(_seen(known), axis=0)
    ranges[2:] = ranges[2:].max()
    off = float((np.abs(_seen(run)[-1] - _seen(known)[-1]) / ranges).max())
    return judge_end(run, off, f"{number}, {method}, {options}")


def _seen(run: Solution) -> np.ndarray:
    return np.array([run[name] for name in _SEEN]).T


def scenarios() -> Iterator[Scenario]:
    """Yield drawn closures with each method."""
    for k, method in enumerate(_METHODS):
        for case in range(_CASES):
            run = functools.partial(closure, case * len(_METHODS) + k, method)
            short = case == 0 and method in ("dop853", "radau5")
            yield Scenario("closed trees", f"closed trees {case}: {method}", run, method, short)
