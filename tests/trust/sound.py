"""Forty runs that are right: no check may object."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from .case import Case
from .models import bundled

# As they come.
_DEFAULTS = (
    "andrews_squeezer", "bouncing_ball", "bricard", "car_axis", "cart_pole", "damped_spring_pendulum",
    "double_pendulum", "four_bar", "free_rigid_body", "heavy_top_absolute", "n_pendulum", "outer_solar_system",
    "pendulum", "pendulum_dae", "pendulum_linear", "quarter_car", "rolling_disc", "seven_dof_arm",
    "slider_crank", "spinning_top", "spring_chain", "spring_pendulum", "stewart_platform",
    "stiff_bushing_pendulum", "stiff_spring_pendulum", "stick_slip",
)  # fmt: skip
_OTHERS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("pendulum", {"method": "rk4"}),
    ("pendulum", {"method": "verlet", "step": 0.01}),
    ("pendulum", {"method": "gauss8"}),
    ("double_pendulum", {"method": "dopri5", "rtol": 1e-6, "t_end": 5.0}),
    ("double_pendulum", {"method": "rk4", "step": 0.002, "t_end": 5.0}),
    ("double_pendulum", {"method": "radau5", "rtol": 1e-7, "t_end": 5.0}),
    ("spring_pendulum", {"method": "bdf", "rtol": 1e-7}),
    ("spring_pendulum", {"method": "verlet", "step": 0.01}),
    ("slider_crank", {"method": "dop853", "rtol": 1e-5, "t_end": 2.0}),
    ("slider_crank", {"method": "rk4", "t_end": 2.0}),
    ("four_bar", {"method": "dop853", "rtol": 1e-10, "t_end": 2.0}),
    ("seven_dof_arm", {"method": "dop853", "rtol": 1e-4, "t_end": 2.0}),
    ("pendulum_dae", {"method": "implicit_midpoint", "step": 0.01}),
    ("bouncing_ball", {"method": "rk4", "step": 0.01}),
)


def cases() -> Iterator[Case]:
    """Yield all."""
    for name in _DEFAULTS:
        yield _case(name, {})
    for name, options in _OTHERS:
        yield _case(name, options)


def _case(name: str, options: dict[str, Any]) -> Case:
    text = (
        ", ".join(str(value) if key == "method" else f"{key} {value:g}" for key, value in options.items())
        or "as it comes"
    )
    short = options.get("method") in ("rk4", "dop853") or (
        not options and name in ("pendulum", "bouncing_ball")
    )
    return Case("sound", f"{name}, {text}", lambda: bundled(name).run(**options), short=short)
