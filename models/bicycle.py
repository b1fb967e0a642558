"""Bicycle that rolls without slipping: the benchmark of Meijaard, Papadopoulos, Ruina and Schwab."""

from math import pi

from symgen import Model, cos, dot, sin, sqrt


def build(speed=5.0) -> Model:
    """Describe the bicycle: x points ahead, y to the left, z up; it leans and steers to the right.

    Values are those of Proc. R. Soc. A 463 (2007) 1955, table 1: a rear frame with a rider, a fork, and two wheels with
    knife edges. Its motion straight ahead is stable between 4.29 and 6.02 m/s.

    Parameters
    ----------
    speed : float
        At the start [m/s].
    """
    model = Model("bicycle", description="Bicycle that rolls without slipping: a benchmark of its stability")
    w, c, rR, rF, g = model.parameters(
        w={"value": 1.02, "unit": "m", "doc": "wheel base"},
        c={"value": 0.08, "unit": "m", "doc": "trail"},
        rR={"value": 0.3, "unit": "m", "doc": "radius of the rear wheel"},
        rF={"value": 0.35, "unit": "m", "doc": "radius of the front wheel"},
        g="9.81 m/s^2",
    )
    tilt = model.parameter("tilt", pi / 10, unit="rad", doc="of the steer axis, backwards")
    model.gravity(z=-g)

    x = model.coordinate("x", unit="m", start=0.0, rate=speed)  # the rear wheel's centre
    y = model.coordinate("y", unit="m", start=0.0)
    z = model.coordinate("z", unit="m", guess=0.3)
    yaw = model.coordinate("yaw", unit="rad", start=0.0)
    roll = model.coordinate("roll", unit="rad", start=0.0, rate=0.0)
    pitch = model.coordinate("pitch", unit="rad")
    steer = model.coordinate("steer", unit="rad", start=0.0, rate=0.0)
    spin_rear = model.coordinate("spin_rear", unit="rad", start=0.0, rate_guess=speed / 0.3)
    spin_front = model.coordinate("spin_front", unit="rad", start=0.0, rate_guess=speed / 0.35)
    torque = model.input("steer_torque", unit="N*m")
    model.force(steer, torque)

    leaning = [("z", yaw), ("x", roll)]
    in_fork = [("y", pitch - tilt), ("z", -steer), ("y", tilt)]
    frame = _named(model, "frame", _product([*leaning, ("y", pitch)]))
    fork = _named(model, "fork", _product([*leaning, *in_fork]))
    rear = (x, y, z)
    head = _moved(rear, frame, (w + c, 0, -rR))  # where the steer axis meets the ground
    front = tuple(
        model.definition(f"front_{axis}", place)
        for axis, place in zip("xyz", _moved(head, fork, (-c, 0, rF)))
    )

    model.body(
        "rider",
        mass=85,
        com=_moved(rear, frame, (0.3, 0, 0.9 - rR)),
        rotation=[*leaning, ("y", pitch)],
        inertia=[9.2, 11, 2.8, 0, -2.4, 0],
        shape={"box": ["0.5 m", "0.3 m", "0.9 m"]},
    )
    model.body(
        "handlebar",
        mass=4,
        com=_moved(head, fork, (0.9 - w - c, 0, 0.7)),
        rotation=[*leaning, *in_fork],
        inertia=[0.05892, 0.06, 0.00708, 0, 0.00756, 0],
        shape={"box": ["0.06 m", "0.5 m", "0.7 m"]},
    )
    wheels = (
        ("rear", rear, [*leaning, ("y", pitch + spin_rear)], 2, [0.0603, 0.12], rR),
        ("front", front, [*leaning, *in_fork, ("y", spin_front)], 3, [0.1405, 0.28], rF),
    )
    for name, centre, rotation, mass, (across, axial), radius in wheels:
        model.body(
            f"{name}_wheel", mass=mass, com=centre, rotation=rotation, inertia=[across, axial, across],
            shape={"box": [1.9 * radius, "0.03 m", "0.05 m"]},
        )  # fmt: skip
        model.body(
            f"{name}_rim",
            mass=0,
            com=centre,
            rotation=[*rotation, ("x", pi / 2)],
            shape={"cylinder": [radius, "0.02 m"]},
        )

    turning = _turning(yaw, roll, pitch)
    steer_axis = [
        fork[i][0] * sin(tilt) - fork[i][2] * cos(tilt) for i in range(3)
    ]  # downwards, as in the fork
    turning_fork = [a + dot(steer) * b for a, b in zip(turning, steer_axis)]
    _roll_on_ground(model, "rear", rear, frame, turning, dot(spin_rear), rR)
    _roll_on_ground(model, "front", front, fork, turning_fork, dot(spin_front), rF)
    model.output("speed", dot(x) * cos(yaw) + dot(y) * sin(yaw))
    model.run(t_end=5.0, fps=60)
    return model


def _roll_on_ground(model, name, centre, carrier, turning, spin, radius) -> None:
    """Hold the lowest point of a wheel's edge on the ground, and let the wheel's point there be at rest."""
    axle = [carrier[i][1] for i in range(3)]
    across = model.definition(f"{name}_across", sqrt(1 - axle[2] ** 2))
    to_ground = [radius * (axle[i] * axle[2] - (1 if i == 2 else 0)) / across for i in range(3)]
    model.constraint(f"{name}_on_ground", centre[2] - radius * across)
    turns = [turning[i] + spin * axle[i] for i in range(3)]
    slip_x = dot(centre[0]) + turns[1] * to_ground[2] - turns[2] * to_ground[1]
    slip_y = dot(centre[1]) + turns[2] * to_ground[0] - turns[0] * to_ground[2]
    model.velocity_constraint(f"{name}_rolls_x", slip_x)
    model.velocity_constraint(f"{name}_rolls_y", slip_y)


def _turning(yaw, roll, pitch) -> list:
    """The angular velocity of the frame in world axes."""
    return [
        dot(roll) * cos(yaw) - dot(pitch) * sin(yaw) * cos(roll),
        dot(roll) * sin(yaw) + dot(pitch) * cos(yaw) * cos(roll),
        dot(yaw) + dot(pitch) * sin(roll),
    ]


def _product(rotations) -> list:
    """The matrix of successive rotations about axes that turn along."""
    matrix = [[int(i == j) for j in range(3)] for i in range(3)]
    for axis, angle in rotations:
        i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
        for row in matrix:
            row[i], row[j] = (
                row[i] * cos(angle) + row[j] * sin(angle),
                row[j] * cos(angle) - row[i] * sin(angle),
            )
    return matrix


def _named(model, name, matrix) -> list:
    """Give the entries of a matrix names, so that they are worked out once."""
    return [[model.definition(f"{name}_{i}{j}", matrix[i][j]) for j in range(3)] for i in range(3)]


def _moved(place, matrix, offset) -> tuple:
    return tuple(place[i] + sum(matrix[i][j] * offset[j] for j in range(3)) for i in range(3))
