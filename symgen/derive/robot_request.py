"""Which functions for robot programs are asked for: known without SymPy, so that what is cached needs none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from symgen.runtime.graph.layouts import ROBOT_FUNCTIONS

from ..errors import ModelError, nearest

USUAL = (
    "inverse_dynamics", "forward_dynamics", "mass_matrix", "coriolis_matrix", "gravity", "energy", "centre_of_mass",
    "momentum",
)  # fmt: skip
GROUP = "robot"  # a name that stands for the usual ones


@dataclass(frozen=True)
class RobotRequest:
    """What is asked for.

    Attributes
    ----------
    functions : tuple of str
        Of `ROBOT_FUNCTIONS`.
    frames : tuple of str
        Bodies and frames of the model, of which pose, Jacobian and its change are functions.
    actuators : tuple of str
        Inputs that hold the robot in `equilibrium_torques`; all of the model's where there are none.
    """

    functions: tuple[str, ...] = ()
    frames: tuple[str, ...] = ()
    actuators: tuple[str, ...] = ()


def requested(
    functions: str | Sequence[str], frames: Sequence[str] = (), actuators: Sequence[str] = ()
) -> RobotRequest:
    """Return what a user asks for, names of functions in the order of the table.

    Raises
    ------
    ModelError
        There is no such function.
    """
    names = [functions] if isinstance(functions, str) else list(functions)
    asked = {name for given in names for name in (USUAL if given == GROUP else (given,))}
    for name in asked:
        if name not in ROBOT_FUNCTIONS:
            raise ModelError(
                f"there is no function {str(name)[:60]!r} for robots",
                hint=nearest(str(name)[:60], (*ROBOT_FUNCTIONS, GROUP)),
            )
    if actuators:
        asked.add("equilibrium_torques")
    ordered = tuple(name for name in ROBOT_FUNCTIONS if name in asked)
    frames, actuators = ([x] if isinstance(x, str) else x for x in (frames, actuators))
    return RobotRequest(ordered, tuple(dict.fromkeys(frames)), tuple(dict.fromkeys(actuators)))
