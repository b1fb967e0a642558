"""The bundled models, each with other parameters, inputs, starts and rates: run by all methods as `error_growth` runs.

`python -m tests.stress.error_growth --perturbed --seed 1 --cases 112` goes through all models twice.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .drawn_motions import Draw
from .models import bundled

# Two methods of different kinds; where series know the motion at all they are slow beside events.
_KNOWN_BY = (("dop853", 1e-13), ("radau13", 1e-12))
_SPREADS = (0.0, 0.02, 0.1, 0.3)  # of a parameter, in parts of it
_OF_STARTS = (0.0, 0.01, 0.1)  # of a coordinate, in parts of it and of 0.1
_NAMES = (
    "achilles_leg", "active_suspension", "andrews_squeezer", "belt_drive", "bicycle", "block_on_plate", "bouncing_ball",
    "bricard", "car_axis", "cart_pole", "clutch", "crane", "damped_spring_pendulum", "die", "differential_car",
    "door_stop", "double_pendulum", "double_pendulum_level", "engine_mounts", "engine_v6", "four_bar",
    "free_rigid_body", "gripper_arm", "heavy_top_absolute", "humanoid_tree", "n_four_bar", "n_pendulum",
    "newtons_cradle", "outer_solar_system", "pendulum", "pendulum_dae", "pendulum_field", "pendulum_linear",
    "quadruped", "quarter_car", "rack_and_pinion", "rolling_disc", "rough_road", "satellite", "satellite_wheels",
    "seven_dof_arm", "slider_crank", "spinning_top", "spring_chain", "spring_pendulum", "stewart_platform",
    "stick_slip", "stiff_bushing_pendulum", "stiff_spring_pendulum", "turntable", "wheel_set",
)  # fmt: skip


def _perturbed(name: str) -> Callable[[np.random.Generator], Draw]:
    def draw(rng: np.random.Generator) -> Draw:
        system = bundled(name)
        spread, of_starts = float(rng.choice(_SPREADS)), float(rng.choice(_OF_STARTS))
        parameters = {
            record["name"]: record["value"] * float(np.exp(spread * rng.normal()))
            for record in system.parameters
            if spread and rng.random() < 0.7
        } | {record["name"]: float(rng.normal()) for record in system.inputs if rng.random() < 0.3}
        given = {"parameters": parameters}
        for key, records in (("start", system.coordinates), ("rate", system.rates)):
            given[key] = {
                record["name"]: record["value"]
                + float(rng.normal(0.0, of_starts * (abs(record["value"]) + 0.1)))
                for record in records
                if of_starts
                and record.get("enforced")
                and rng.random() < 0.7
                and not (key == "start" and _of_quaternion(system, record["name"]))
            }
        t_end = system.run_defaults["t_end"]
        return Draw(system, (0.1 * t_end, t_end, 2.0 * t_end), given, _KNOWN_BY)

    draw.__name__ = name
    return draw


def _of_quaternion(system, name: str) -> bool:
    names = [record["name"] for record in system.coordinates]
    return any(k <= names.index(name) < k + 4 for k in system.quaternions)


FAMILIES = tuple(_perturbed(name) for name in _NAMES)
