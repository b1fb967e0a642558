"""Arm of six axes with a gripper, from its URDF file: it reaches down, closes its jaws and lifts, by PD control."""

from pathlib import Path

import numpy as np

from symgen import Model

URDF = Path(__file__).parent / "robots" / "gripper_arm.urdf"
JOINTS = ("waist", "shoulder", "elbow", "roll", "pitch", "turn", "left_finger")
MOTORS = (*(f"{joint}_torque" for joint in JOINTS[:-1]), "left_finger_force")
# Way-points: rows of the joints' places [rad], the finger's last [m]
PATH = (
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.035),
    (0.8, 0.9, 1.2, 0.0, 1.0, 0.8, 0.035),
    (0.8, 0.95, 1.25, 0.0, 0.94, 0.8, 0.015),
    (-0.6, 0.3, 1.2, 0.4, 0.9, 0.0, 0.015),
)
TIMES = (0.0, 2.0, 3.0, 5.0)  # [s]
STIFFNESS = (3000.0, 4000.0, 3000.0, 120.0, 120.0, 60.0, 2000.0)  # N m/rad; the finger's N/m
DAMPING = (110.0, 150.0, 90.0, 5.0, 6.0, 3.0, 30.0)  # N m s; N s/m
PERIOD = 0.002  # of the controller [s]


def build() -> Model:
    """Read the arm, and watch where its tool is."""
    model = Model.from_urdf(URDF, start={"left_finger": PATH[0][-1]})
    for axis in "xyz":
        model.output(f"tool_{axis}_place", f"tool.{axis}")
    model.run(t_end=5.5, fps=60)
    return model


def control(system, parameters):
    """Return the controller of all motors: springs and dampers towards a path through the way-points.

    Parameters
    ----------
    system : symgen.runtime.System
    parameters : dict of str to float
        Not used: gains are those of a controller that knows no masses.
    """
    from symgen.runtime.inputs import Controller, Trajectory

    path = Trajectory(PATH, TIMES, stops=True)
    stiffness, damping = np.array(STIFFNESS), np.array(DAMPING)

    def motors(t, x):
        places, speeds, _ = path(t)
        return stiffness * (places - x[: len(JOINTS)]) + damping * (speeds - x[len(JOINTS) :])

    reads = (*JOINTS, *(f"dot({joint})" for joint in JOINTS))
    return {MOTORS: Controller(motors, period=PERIOD, reads=reads)}
