"""The planar chain that all tools derive: N uniform links, relative joint angles, gravity along -y."""

from __future__ import annotations

MASS, LENGTH, INERTIA, GRAVITY = 1.0, 0.5, 1.0 / 48, 9.81


def kinematics(angles, sin, cos):
    """Absolute angle and centre of mass of each link, for any kind of number or symbol."""
    x, y, angle = 0, 0, 0
    for q in angles:
        angle = angle + q
        dx, dy = LENGTH * sin(angle), -LENGTH * cos(angle)
        yield angle, x + 0.5 * dx, y + 0.5 * dy
        x, y = x + dx, y + dy
