"""Runs that must not be trusted, forty at least, and the check that has to say so, or why."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from .case import REFUSED, Case
from .models import bundled, edited, far, pair, point, rod

if TYPE_CHECKING:
    from symgen.runtime import Solution, System


def _run(system: Callable[[], System], t_end: float, **options: Any) -> Callable[[], Solution]:
    return lambda: system().run(t_end=t_end, max_steps=2_000_000, **options)


def cases() -> Iterator[Case]:
    """Yield all, by kind."""
    for kind, group in _KINDS.items():
        for name, run, check, word, *short in group():
            yield Case(kind, name, run, check, word, bool(short))


def _step_too_large():
    linear, double = (lambda: bundled("pendulum_linear")), (lambda: bundled("double_pendulum"))
    yield "linear pendulum, verlet", _run(linear, 20.0, method="verlet", step=0.46), "stability", "", True
    yield (
        "linear pendulum, semi_implicit_euler",
        _run(linear, 20.0, method="semi_implicit_euler", step=0.46),
        "stability",
        "",
    )
    yield "linear pendulum, rk4", _run(linear, 200.0, method="rk4", step=0.66), "stability", "", True
    yield "double pendulum, rk4", _run(double, 5.0, method="rk4", step=0.25), "resolution", "", True
    yield (
        "slider-crank, verlet",
        _run(lambda: bundled("slider_crank"), 5.0, method="verlet", step=0.02),
        "resolution",
        "",
    )
    yield (
        "pendulum, gauss8",
        _run(lambda: bundled("pendulum"), 20.0, method="gauss8", step=1.3),
        "resolution",
        "",
    )
    yield (
        "pendulum, generalized_alpha",
        (_run(lambda: bundled("pendulum"), 20.0, method="generalized_alpha", step=0.2)),
        "resolution",
        "",
    )


def _no_step_is_stable():
    yield (
        "linear pendulum, euler",
        (_run(lambda: bundled("pendulum_linear"), 20.0, method="euler", step=1e-3)),
        "stability",
        "every step",
        True,
    )
    yield "pair, euler", _run(pair, 10.0, method="euler", step=0.02), "stability", "every step"


def _stiff_spring_on_an_explicit_method():
    bushing, car = (lambda: bundled("stiff_bushing_pendulum")), (lambda: bundled("quarter_car"))
    yield "bushing, rk4", _run(bushing, 0.2, method="rk4", step=1e-3), "stability", "", True
    yield "quarter car, verlet", _run(car, 1.0, method="verlet", step=2e-3), "stability", ""


def _damping_that_feeds_until_nothing_holds():
    yield (
        "arm",
        (_run(lambda: bundled("seven_dof_arm"), 2.0, parameters={"c": -0.4}, method="dop853")),
        "negative damping",
        "'c'",
    )


def _inconsistent_start():
    yield (
        "pendulum off its circle",
        (_run(lambda: bundled("pendulum_dae"), 1.0, start={"x": 1.5, "y": 1.5})),
        REFUSED,
        "",
        True,
    )
    yield (
        "slider-crank with a rod too short",
        (_run(lambda: bundled("slider_crank"), 1.0, start={"theta": 0.5, "x": 0.9})),
        REFUSED,
        "pin_x",
    )
    yield (
        "rates against a constraint",
        _run(rod, 1.0, start={"y": -0.8}, rate={"x": 1.0, "y": 1.0}),
        REFUSED,
        "rod",
    )


def _contradiction():
    yield "contradicting rods", _run(lambda: rod('longer = "x^2 + y^2 - 4*l^2"'), 1.0), REFUSED, ""


def _lost_energy():
    for method, step in (
        ("implicit_euler", 0.02),
        ("implicit_euler", 0.002),
        ("euler", 0.002),
        ("semi_implicit_euler", 0.1),
        ("hht", 0.1),
    ):
        for name, system in (
            ("pendulum", lambda: bundled("pendulum")),
            ("pendulum, its zero 1 km away", far),
        ):
            short = step == 0.02
            options = {"method": method, "step": step}
            yield f"{name}, {method} {step}", _run(system, 20.0, **options), "energy", "", short
    yield (
        "spring pendulum, implicit_euler",
        (_run(lambda: bundled("spring_pendulum"), 10.0, method="implicit_euler", step=0.005)),
        "energy",
        "",
    )
    yield (
        "spinning top, euler",
        (_run(lambda: bundled("spinning_top"), 5.0, method="euler", step=1e-3)),
        "accuracy",
        "",
    )
    for name, step in (("double_pendulum", 0.01), ("four_bar", 0.002), ("quarter_car", 0.02)):
        system = functools.partial(bundled, name)
        yield f"{name}, implicit_euler", _run(system, 2.0, method="implicit_euler", step=step), "energy", ""
    yield (
        "equations with a hidden drag",
        (_run(lambda: edited("double_pendulum", "rhs", 2, "{} - 0.05*y[2]"), 5.0, method="dop853")),
        "energy",
        "",
    )
    yield (
        "a potential that is not that of the forces",
        (_run(lambda: edited("double_pendulum", "energy", 1, "1.02*{}"), 5.0, method="dop853")),
        "energy",
        "",
    )


def _missed_event():
    dip = '[events.dip]\nwhen = "cos(3000*x) - 0.3"\ndirection = "falling"'
    yield (
        "ripples between long steps of gauss12",
        (_run(lambda: point("0", "x^2/2", dip), 10.0, method="gauss12", start={"x": 1.0}, step=0.4)),
        "missed events",
        "'dip'",
        True,
    )


def _loosened_tolerance():
    loose = {"method": "dopri5", "rtol": 1e-2, "atol": 1e-2}
    yield "double pendulum", _run(lambda: bundled("double_pendulum"), 10.0, **loose), "accuracy", "", True
    yield "spring pendulum", _run(lambda: bundled("spring_pendulum"), 20.0, **loose), "accuracy", ""
    yield (
        "driven mass, a coarse step",
        (_run(lambda: point("5*sin(60*t)", "x^2/2"), 30.0, method="verlet", step=0.1)),
        "accuracy",
        "",
    )


def _singular_forces():
    yield (
        "a pole on the way",
        _run(lambda: point("1/(0.5 - t)^2"), 1.0, method="dop853"),
        "status",
        "t = 0.5",
        True,
    )
    yield "blow-up in finite time", _run(lambda: point("60*x^2 + 10"), 3.0, method="radau5"), "status", "x"


def _events_without_end():
    yield (
        "bounces that pile up",
        _run(lambda: bundled("bouncing_ball"), 12.0, method="dop853"),
        "status",
        "'bounce'",
        True,
    )


_KINDS = {
    "step too large": _step_too_large,
    "no step is stable": _no_step_is_stable,
    "stiff spring on an explicit method": _stiff_spring_on_an_explicit_method,
    "damping that feeds until nothing holds": _damping_that_feeds_until_nothing_holds,
    "inconsistent start": _inconsistent_start,
    "contradiction": _contradiction,
    "lost energy": _lost_energy,
    "missed event": _missed_event,
    "loosened tolerance, coarse step": _loosened_tolerance,
    "singular forces": _singular_forces,
    "events without end": _events_without_end,
}
