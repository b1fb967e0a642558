"""Elements of models beside integrations by hand: lags, pulses, ropes, bristles at stops, moments that coincide, sizes.

Each case draws what it is made of, a method and a tolerance. References are closed forms, or SciPy's integration of
equations that are written down here, from one instant at which something changes to the next.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from symgen import Model, runtime
from symgen.link import derive_text
from symgen.runtime.inputs import Controller, Table
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, flag, judge_end
from .scenario import WRONG, Outcome, Scenario

_CASES = 3  # of each kind with each method
_RTOLS = (1e-4, 1e-7, 1e-10)


class Case(NamedTuple):
    """A model, how it is run, and what its quantities are at the end, with the size of what each does."""

    model: Model
    t_end: float
    options: dict[str, Any]
    truth: dict[str, tuple[float, float]]


# Lags


def lags(r: np.random.Generator) -> Case:
    """A chain of first-order lags, time constants many decades apart, behind a constant or a sine."""
    import mpmath

    n = int(r.integers(1, 5))
    taus = 10.0 ** r.uniform(-9.0, 9.0, n)
    omega = float(10.0 ** r.uniform(-1.0, 1.5)) if r.random() < 0.5 else 0.0
    t_end = float(10.0 ** r.uniform(-1.0, 1.0))
    m = Model("lags")
    before = f"cos({omega!r}*t)" if omega else "1"
    for k, tau in enumerate(taus):
        p = m.parameter(f"tau{k}", float(tau))
        m.state(f"s{k}", derivative=f"({before} - s{k})/{p}")
        before = f"s{k}"
    # Of e^{i omega t}: s_k = sum over earlier eigenvalues; in 60 digits, by partial fractions of the transfer function.
    mpmath.mp.dps = 60
    poles = [-1 / mpmath.mpf(float(tau)) for tau in taus]
    truth = {}
    for k in range(n):
        value = mpmath.mpf(0)
        for drive in (mpmath.mpc(0, omega), mpmath.mpc(0, -omega)):
            roots = [drive, *poles[: k + 1]]
            gain = mpmath.mpf(1)
            for pole in poles[: k + 1]:
                gain *= -pole
            for i, root in enumerate(roots):
                below = mpmath.mpf(1)
                for j, other in enumerate(roots):
                    if j != i:
                        below *= root - other
                value += mpmath.re(gain * mpmath.exp(root * t_end) / below) / 2
        truth[f"s{k}"] = (float(value), max(abs(float(value)), 1e-12))
    return Case(m, t_end, {}, truth)


def beyond(r: np.random.Generator) -> Case:
    """A lag with a fixed step near the limit of explicit methods, over some hundred steps."""
    tau = float(10.0 ** r.uniform(-6.0, 6.0))
    m = Model("lag")
    m.parameter("tau", tau)
    m.state("s", derivative="(1 - s)/tau", start=1.5)
    step = tau * float(r.choice([0.9, 1.1, 1.9, 2.01, 2.1, 2.7, 2.8, 3.0, 8.0]))
    return Case(m, 200 * step, {"step": step}, {"s": (1.0 + 0.5 * math.exp(-200 * step / tau), 0.5)})


# Inputs


def pulses(r: np.random.Generator) -> Case:
    """A mass that is hit by pulses of an input, down to 1e-12 s long, with steps or ramps as short."""
    n = int(r.integers(1, 5))
    starts = np.sort(r.uniform(0.1, 2.8, n))
    lengths = 10.0 ** r.uniform(-12.0, -2.0, n)
    impulses = r.normal(0.0, 1.0, n)
    hold = r.random() < 0.5
    times, values, velocity, position, t_end = [0.0], [0.0], 0.0, 0.0, 3.0
    for begin, length, impulse in zip(starts, lengths, impulses, strict=True):
        if begin <= times[-1] + 1e-6:
            continue
        end = begin + length
        width = end - begin  # as doubles have it
        if hold:
            times += [begin, end]
            values += [impulse / width, 0.0]
        else:
            middle = begin + width / 2
            times += [begin, middle, end]
            values += [0.0, 2.0 * impulse / width, 0.0]
        velocity += impulse
        position += impulse * (t_end - (begin + end) / 2)
    m = Model("pulses")
    m.coordinate("x")
    m.input("F")
    m.kinetic("dot(x)^2/2")
    m.force("x", "F")
    table = Table(np.array(times), np.array(values), kind="hold" if hold else "linear")
    size = float(np.abs(impulses).sum())
    return Case(m, t_end, {"inputs": {"F": table}}, {"x": (position, size), "dot(x)": (velocity, size)})


def not_a_number(r: np.random.Generator) -> Case:
    """An input, a force or a command that is no number from half of the time on: there is no end to come to."""
    m = Model("lost")
    m.coordinate("x", start=1.0)
    m.input("F")
    m.kinetic("dot(x)^2/2")
    m.potential("x^2/2")
    way, bad = int(r.integers(0, 4)), float(r.choice([math.nan, math.inf, -math.inf]))
    options: dict[str, Any] = {}
    m.force("x", "F + log(1 - t/2)" if way == 0 else "F")
    if way == 1:
        options["inputs"] = {"F": lambda t: 0.1 if t < 2.0 else bad}
    elif way == 2:
        options["inputs"] = {"F": Controller(lambda t, x: -0.1 * x[1] if t < 2.0 else bad, period=0.1)}
    elif way == 3:
        values = np.where(np.arange(9) < 4, 0.1, bad)
        options["inputs"] = {"F": (list(np.arange(9) / 2), list(values))}
    return Case(m, 4.0, options, {"x": (math.nan, 1.0)})


# Ropes, bristles


def _integrated(
    f: Callable[..., Any], y0: Any, t_end: float, events: list[Callable[..., float]], hit: Callable[..., Any]
) -> np.ndarray:
    """Integrate from event to event; `hit(k, y)` is the state after event k."""
    from scipy.integrate import solve_ivp

    t, y = 0.0, np.array(y0, dtype=float)
    for event in events:
        event.terminal, event.direction = True, -1.0
    for _ in range(10_000):
        found = solve_ivp(
            f, (t, t_end), y, "Radau" if len(y) > 2 else "DOP853", rtol=1e-11, atol=1e-13, events=events
        )
        t, y = float(found.t[-1]), found.y[:, -1]
        if found.status != 1:
            return y
        which = next(k for k, times in enumerate(found.t_events) if len(times))
        y = np.array(hit(which, y), dtype=float)
    raise ArithmeticError("events without an end")


def rope(r: np.random.Generator) -> Case:
    """A mass that falls into a rope with damping, and is thrown up again."""
    mass, k = float(10.0 ** r.uniform(-1, 1)), float(10.0 ** r.uniform(1.5, 5))
    c = float(r.choice([0.0, 0.02, 0.5])) * 2.0 * math.sqrt(k * mass)
    start, t_end = -float(r.uniform(0.1, 0.9)), float(r.uniform(1.0, 4.0))
    m = Model("rope", gravity=(0, "-9.81 m/s^2"))
    y = m.coordinate("y", start=start)
    m.body("weight", mass=mass, com=(0, y))
    m.spring("line", points=[(0, 0), (0, y)], stiffness=k, length=1.0, damping=c, acts="pull")

    def force(s: np.ndarray) -> float:
        return max(0.0, k * (-s[0] - 1.0) - c * s[1]) if s[0] < -1.0 else 0.0

    from scipy.integrate import solve_ivp

    found = solve_ivp(
        lambda t, s: (s[1], -9.81 + force(s) / mass), (0.0, t_end), (start, 0.0), "DOP853", rtol=1e-12, atol=1e-13,
        max_step=min(0.01, 0.05 * math.sqrt(mass / k)),
    )  # fmt: skip
    end = found.y[:, -1]
    return Case(m, t_end, {}, {"y": (end[0], 1.0), "dot(y)": (end[1], 4.0)})


def curve(r: np.random.Generator) -> Case:
    """A mass on a line with a spring whose force is a curve, both ways, as a rope or as a buffer, with damping."""
    from scipy.integrate import solve_ivp
    from scipy.interpolate import PchipInterpolator, make_interp_spline

    acts, kind = str(r.choice(["both", "pull", "push"])), str(r.choice(["linear", "pchip"]))
    n, rest = int(r.integers(1, 5)), 1.0
    knots = np.concatenate(
        [-np.cumsum(r.uniform(0.05, 0.15, n))[::-1], [0.0], np.cumsum(r.uniform(0.05, 0.3, n))]
    )
    rising = np.cumsum(10.0 ** r.uniform(-1, 2.5, (2, n)), axis=1) * 0.1
    forces = np.concatenate([-rising[0][::-1], [0.0], rising[1]])
    c, start, speed = float(r.choice([0.0, 0.3, 3.0])), float(r.uniform(0.6, 1.5)), float(r.normal(0.0, 1.0))
    t_end = float(r.uniform(1.0, 3.0))
    m = Model("curve")
    x = m.coordinate("x", start=start, rate=speed)
    m.kinetic("dot(x)^2/2")
    m.potential("2*(x - 1)^2")  # it comes back from where nothing pulls
    m.table("law", columns=[knots.tolist(), forces.tolist()], kind=kind, outside="extend")
    m.spring("band", points=[(x, 0), (-2.0, 0)], curve="law", length=2.0 + rest, damping=c, acts=acts)
    within = PchipInterpolator(knots, forces) if kind == "pchip" else make_interp_spline(knots, forces, k=1)
    slopes = [float(within(knots[k], 1)) for k in (0, -1)]

    def law(s: float) -> float:
        if knots[0] <= s <= knots[-1]:
            return float(within(s))
        k = 0 if s < knots[0] else -1
        return float(forces[k] + slopes[k] * (s - knots[k]))

    def motion(_: float, s: np.ndarray) -> tuple[float, float]:
        stretch = s[0] - rest
        force = law(stretch) + c * s[1]
        if acts == "pull":
            force = max(force, 0.0) if stretch > 0.0 else 0.0
        elif acts == "push":
            force = min(force, 0.0) if stretch < 0.0 else 0.0
        return s[1], -4.0 * (s[0] - 1.0) - force

    found = solve_ivp(motion, (0.0, t_end), (start, speed), "DOP853", rtol=1e-11, atol=1e-13, max_step=2e-3)
    end = found.y[:, -1]
    return Case(m, t_end, {}, {"x": (end[0], 0.3), "dot(x)": (end[1], 1.0)})


def kink(r: np.random.Generator) -> Case:
    """An oscillator with forces that have kinks, and are smooth: cut off and raised to powers, smooth steps."""
    from scipy.integrate import solve_ivp

    m, q0, v0 = Model("kink"), float(r.uniform(-1.0, 1.0)), float(r.normal(0.0, 1.0))
    x = m.coordinate("x", start=q0, rate=v0)
    m.kinetic("dot(x)^2/2")
    m.potential("2*x^2")
    terms: list[str] = []
    parts: list[Callable[[float, float], float]] = []
    for _ in range(int(r.integers(1, 4))):
        a, k = float(r.normal(0.0, 0.4)), float(10.0 ** r.uniform(-0.5, 1.5))
        way, n, width = int(r.integers(0, 4)), int(r.integers(2, 5)), float(10.0 ** r.uniform(-3.0, 0.0))
        if way == 0:
            terms.append(f"-{k!r}*max(x - {a!r}, 0)^{n}")
            parts.append(lambda q, v, a=a, k=k, n=n: -k * max(q - a, 0.0) ** n)
        elif way == 1:
            terms.append(f"-{k!r}*smoothstep({a!r}, {a + width!r}, x)")
            parts.append(lambda q, v, a=a, k=k, b=a + width: -k * _smooth((q - a) / (b - a)))
        elif way == 2:
            terms.append(f"{k / 10!r}*min(dot(x) - {a!r}, 0)^2")
            parts.append(lambda q, v, a=a, k=k: k / 10 * min(v - a, 0.0) ** 2)
        else:
            terms.append(f"-{k!r}*abs(x - {a!r})^3*{n!r}")
            parts.append(lambda q, v, a=a, k=k, n=n: -k * abs(q - a) ** 3 * n)
    m.potential("20*x^4")  # it stays near
    m.force(x, " + ".join(terms))
    t_end = float(r.uniform(1.0, 4.0))
    found = solve_ivp(
        lambda t, s: (s[1], -4.0 * s[0] - 80.0 * s[0] ** 3 + sum(f(*s) for f in parts)),
        (0.0, t_end), (q0, v0), "DOP853", rtol=1e-11, atol=1e-13, max_step=1e-3,
    )  # fmt: skip
    (x_end, v_end), (x_range, v_range) = found.y[:, -1], np.ptp(found.y, axis=1)
    return Case(m, t_end, {}, {"x": (x_end, x_range), "dot(x)": (v_end, v_range)})


def _smooth(s: float) -> float:
    s = min(max(s, 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


def bristle(r: np.random.Generator) -> Case:
    """A block that rubs by bristles, pulled by a spring whose end moves on, between two stops."""
    mass, stiffness = float(10.0 ** r.uniform(-1, 1)), float(10.0 ** r.uniform(3, 5))
    damping = float(r.uniform(0.1, 0.9)) * 2.0 * math.sqrt(stiffness * mass)
    coulomb = float(10.0 ** r.uniform(-1, 1))
    static = coulomb * float(r.uniform(1.0, 1.6))
    vs, viscous = float(10.0 ** r.uniform(-2, -0.5)), float(r.choice([0.0, 0.1, 0.4]))
    k, pace, wall = float(10.0 ** r.uniform(0.5, 2)), float(r.uniform(0.1, 1.0)), float(r.uniform(0.05, 0.6))
    e = float(r.choice([0.0, 0.3, 0.8]))
    t_end = float(r.uniform(1.0, 3.0))
    speed = float(r.choice([0.0, 0.5, -0.5]))
    m = Model("bristle")
    x = m.coordinate("x", rate=speed)
    m.kinetic(f"{mass!r}*dot(x)^2/2")
    m.potential(f"{k!r}*(x - {pace!r}*t)^2/2")
    m.bristle(
        "rub",
        coordinate=x,
        stiffness=stiffness,
        damping=damping,
        viscous=viscous,
        coulomb=coulomb,
        static=static,
        stribeck=vs,
    )
    m.stop("wall", gap=wall - x, restitution=e)

    def f(t: float, s: np.ndarray, held: bool = False) -> tuple[float, float, float]:
        v = 0.0 if held else s[1]
        g = coulomb + (static - coulomb) * math.exp(-((v / vs) ** 2))
        dz = v - stiffness * abs(v) * s[2] / g
        friction = stiffness * s[2] + damping * dz + viscous * v
        a = (k * (pace * t - s[0]) - friction) / mass
        return v, (0.0 if held else a), dz

    from scipy.integrate import solve_ivp

    t, s, held = 0.0, np.array([0.0, speed, 0.0]), False
    for _ in range(1000):

        def gap(t: float, s: np.ndarray) -> float:
            return wall - s[0]

        def pulled(t: float, s: np.ndarray) -> float:
            return k * (pace * t - s[0]) - stiffness * s[2]

        event = pulled if held else gap
        event.terminal, event.direction = True, -1.0
        found = solve_ivp(
            functools.partial(f, held=held), (t, t_end), s, "Radau", rtol=1e-11, atol=1e-13, events=[event]
        )
        t, s = float(found.t[-1]), found.y[:, -1]
        if found.status != 1:
            break
        if held:
            held = False
        else:
            s = np.array([wall, -e * s[1], s[2]])
            if abs(s[1]) < 1e-9:
                s[1], held = 0.0, f(t, s)[1] > 0.0
    else:
        raise ArithmeticError("impacts without an end")
    return Case(
        m,
        t_end,
        {},
        {"x": (s[0], max(wall, 0.1)), "dot(x)": (s[1], max(pace, 0.5)), "rub": (s[2], static / stiffness)},
    )


# Moments


def moments(r: np.random.Generator) -> Case:
    """Events at the start, at the end, and two at one instant, of motions that are lines between."""
    a, b = (float(x) for x in r.choice([0.25, 0.5, 1.0, 2.0], 2))
    at = float(r.choice([0.5, 1.0, 2.0]))
    order = bool(r.random() < 0.5)
    m = Model("moments")
    m.coordinate("x", rate=a)
    m.coordinate("y", rate=b)
    m.kinetic("(dot(x)^2 + dot(y)^2)/2")
    # Both when x has come to a*at: the first one in the file acts first, and the second sees what it has done.
    first, second = {"dot(x)": "-dot(x)/2"}, {"dot(y)": "dot(y) + dot(x)"}
    given = [("one", first), ("two", second)] if order else [("two", second), ("one", first)]
    for name, then in given:
        m.event(name, f"x - {a * at!r}" if name == "one" else f"y - {b * at!r}", "rising", {"reset": then})
    m.event("begin", "x", "both")  # at the start
    t_end = 2.0 * at
    vx = -a / 2
    vy = b + (vx if order else a)
    x, y = a * at + vx * at, b * at + vy * at
    return Case(m, t_end, {}, {"x": (x, a * at), "y": (y, b * at), "dot(x)": (vx, a), "dot(y)": (vy, b)})


def at_the_end(r: np.random.Generator) -> Case:
    """A run that ends in the very instant of a reset, and one that begins in it, a little earlier or later."""
    speed, at = float(r.choice([0.5, 1.0, 3.0])), float(r.choice([0.5, 1.0, 1.5]))
    t_end = at * (1.0 + float(r.choice([0.0, 1e-15, -1e-15, 1e-9, -1e-9])))
    m = Model("end")
    m.coordinate("x", rate=speed)
    m.kinetic("dot(x)^2/2")
    m.event("turn", f"x - {speed * at!r}", "rising", {"reset": {"dot(x)": "-dot(x)"}})
    return Case(m, t_end, {}, {"x": (speed * at, speed * at)})


# Sizes


def sizes(r: np.random.Generator) -> Case:
    """An oscillator whose mass, stiffness and swing have any size, damped or not."""
    mass, k = float(10.0 ** r.uniform(-15, 15)), float(10.0 ** r.uniform(-20, 20))
    swing = float(10.0 ** r.uniform(-12, 12))
    zeta = float(r.choice([0.0, 0.01, 0.5]))
    omega = math.sqrt(k / mass)
    t_end = float(r.uniform(0.5, 8.0)) * 2 * math.pi / omega
    m = Model("sizes")
    for name, value in {"mass": mass, "k": k, "c": 2 * zeta * math.sqrt(k * mass)}.items():
        m.parameter(name, value)
    m.coordinate("x", start=swing)
    m.kinetic("mass*dot(x)^2/2")
    m.potential("k*x^2/2")
    if zeta:
        m.force("x", "-c*dot(x)")
    decay, damped = zeta * omega, omega * math.sqrt(1 - zeta**2)
    x = (
        swing
        * math.exp(-decay * t_end)
        * (math.cos(damped * t_end) + decay / damped * math.sin(damped * t_end))
    )
    v = -swing * math.exp(-decay * t_end) * omega**2 / damped * math.sin(damped * t_end)
    # Below the absolute tolerance nothing is promised but what a user sets it to.
    options = {"atol": 1e-10 * min(1.0, swing, swing * omega)}
    return Case(
        m,
        t_end,
        options,
        {"x": (x, swing), "dot(x)": (v, swing * omega)},
    )


KINDS: dict[str, Callable[[np.random.Generator], Case]] = {
    "lags": lags, "lag and step": beyond, "pulses": pulses, "no number": not_a_number, "rope": rope,
    "curve": curve, "kink": kink,
    "bristle at stop": bristle, "moments": moments, "at the end": at_the_end, "sizes": sizes,
}  # fmt: skip


def element(kind: str, number: int, method: str) -> Outcome:
    """Run a case and judge it."""
    r = np.random.default_rng([number, *kind.encode()])
    case = KINDS[kind](r)
    system = runtime.load(derive_text(case.model).text)
    options = dict(case.options)
    if find_method(method).adaptive:
        options.pop("step", None)
        options["rtol"] = float(r.choice(_RTOLS))
    run = attempt(system, case.t_end, method=method, **options)
    lost = any(math.isnan(value) for value, _ in case.truth.values())
    if lost:
        return flag(run) or Outcome(WRONG, f"it has an end: {run['x'][-1]}")
    if isinstance(run, Outcome):
        return run
    off = max(abs(float(run[name][-1]) - value) / size for name, (value, size) in case.truth.items())
    return judge_end(run, off, f"{method}, {options}, to {case.t_end}")


def scenarios() -> Iterator[Scenario]:
    """Yield some cases of each kind with each method."""
    for kind in KINDS:
        for k, method in enumerate(METHODS):
            for number in range(_CASES):
                run = functools.partial(element, kind, number * len(METHODS) + k, method)
                short = number == 0 and method in ("dop853", "radau5")
                yield Scenario(f"element: {kind}", f"element: {kind} {number}: {method}", run, method, short)
