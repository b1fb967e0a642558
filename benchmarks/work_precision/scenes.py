"""The scenes: which model, built and started how, runs how long. A new scene is one entry in `SCENES`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from symgen.runtime.errors import RuntimeModelError, nearest


@dataclass(frozen=True)
class Scene:
    """A run of a bundled model whose end state is known (`<name>.json` among the references).

    Attributes
    ----------
    name : str
    model : str
        A bundled model.
    t_end : float [s]
    says : str
        One line for people.
    options : mapping of str to str
        Build options of the model.
    parameters, start : mapping of str to float
        Values other than the model's.
    atol_ratio : float
        Absolute tolerance in parts of the relative one: what is small in this scene's units.
    """

    name: str
    model: str
    t_end: float
    says: str
    options: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    atol_ratio: float = 1e-2


def _chain(n: int, t_end: float) -> Scene:
    options = {"N": str(n), "rods": "false"}
    return Scene(f"chain_{n}", "n_pendulum", t_end, f"chain of {n} links released level", options=options)


_WINDOWS = {"N": "10", "angle": "-0.6", "rate": "0"}
SCENES: dict[str, Scene] = {
    scene.name: scene
    for scene in (
        Scene("pendulum", "pendulum", 100.0, "pendulum released at 1.5 rad", start={"theta": 1.5}),
        Scene("double_pendulum", "double_pendulum", 10.0, "double pendulum released from pi/2, pi/2"),
        Scene("double_pendulum_level", "double_pendulum_level", 10.0, "the same, level to the last bit"),
        _chain(5, 2.0),
        _chain(10, 1.0),
        _chain(20, 1.0),
        _chain(50, 1.0),
        Scene("stiff_spring", "stiff_spring_pendulum", 10.0, "pendulum on a spring, k = 1e6, undamped"),
        Scene("damped_spring", "damped_spring_pendulum", 2.0, "pendulum on a spring, k = 1e9, damped"),
        Scene("outer_solar_system", "outer_solar_system", 2e5, "sun and five planets, 200 000 d", atol_ratio=1e-5),
        Scene("heavy_top", "spinning_top", 2.0, "fast heavy top"),
        Scene("free_rigid_body", "free_rigid_body", 100.0, "free body flipping about its middle axis, quaternion"),
        Scene("slider_crank", "slider_crank", 10.0, "slider-crank, a loop with two constraints"),
        Scene("andrews", "andrews_squeezer", 0.03, "seven bodies in three loops with a motor"),
        Scene("four_bar", "four_bar", 10.0, "four-bar linkage, its crank turning under gravity"),
        Scene("car_axis", "car_axis", 3.0, "axle on stiff springs over a moving road"),
        Scene("heavy_top_absolute", "heavy_top_absolute", 2.0, "the heavy top as a free body held at a point"),
        Scene("n_four_bar", "n_four_bar", 10.0, "ten four-bar windows swinging, 20 constraints", options=_WINDOWS),
        Scene("bricard", "bricard", 10.0, "Bricard's linkage, a loop with a redundant constraint"),
        Scene("rough_road", "rough_road", 10.0, "quarter of a car on a rough road"),
        Scene("seven_dof_arm", "seven_dof_arm", 1.0, "robot arm of seven joints, let go"),
        Scene("humanoid_tree", "humanoid_tree", 1.0, "tumbling diver, a tree of 30 freedoms"),
    )
}  # fmt: skip


def find_scene(name: str) -> Scene:
    """Return the scene called `name`.

    Raises
    ------
    RuntimeModelError
        There is none; the message names the nearest.
    """
    if name not in SCENES:
        raise RuntimeModelError(f"there is no scene {name!r}: {nearest(name, SCENES)}")
    return SCENES[name]
