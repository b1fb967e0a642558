"""The woodpecker toy: a sleeve that slips, sticks and strikes on a pole, against a time-stepping scheme.

Model and data: C. Glocker, Dynamik von Starrkörpersystemen mit Reibung und Stößen, VDI 1995, section 8.2; also
F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996, section 6.
"""

from __future__ import annotations

import numba
import numpy as np
import pytest

from symgen import Model, dot

MASS, OF_SLEEVE, INERTIA, OF_SLEEVES_INERTIA, RATE = 0.0045, 0.0003, 7e-7, 5e-9, 0.0056
HOLE, RADIUS, HALF, ARM, TO_MASS, BEAK, TO_BEAK = 0.0025, 0.0031, 0.0058, 0.010, 0.015, 0.02, 0.0201
BOUNCES, RUBS, G = 0.5, 0.3, 9.81

START = (
    -(RADIUS - HOLE) / HALF,
    -0.2788,
    -0.3411,
    -7.4583,
)  # the sleeve's angle, the bird's, rates of place and bird


def woodpecker():
    m = Model("woodpecker")
    y = m.coordinate("y", rate=START[2])
    sleeve, bird = m.coordinate("sleeve", guess=START[0]), m.coordinate("bird", start=START[1], rate=START[3])
    rates = [dot(y), dot(sleeve), dot(bird)]
    m.kinetic(sum(MATRIX[i, j] / 2 * rates[i] * rates[j] for i in range(3) for j in range(3)))
    weight = OF_SLEEVE * G * y + MASS * G * (y + ARM * sleeve + TO_MASS * bird)
    m.potential(RATE * (sleeve - bird) ** 2 / 2 + weight)
    gaps = {
        "beak": (ARM + TO_MASS - TO_BEAK - HOLE - BEAK * bird, BOUNCES),
        "lower": (RADIUS - HOLE + HALF * sleeve, 0),
        "upper": (RADIUS - HOLE - HALF * sleeve, 0),
    }
    along = dot(y) + RADIUS * dot(sleeve)
    speeds = {
        "beak": dot(y) + ARM * dot(sleeve) + (TO_MASS - TO_BEAK) * dot(bird),
        "lower": along,
        "upper": along,
    }
    for name, (gap, restitution) in gaps.items():
        m.stop(name, gap, restitution)
        m.friction(f"rub_{name}", speed=speeds[name], coefficient=RUBS, normal=name)
    m.start(closed=["lower"])
    return m.derive()


MATRIX = np.array(
    [
        [MASS + OF_SLEEVE, MASS * ARM, MASS * TO_MASS],
        [MASS * ARM, OF_SLEEVES_INERTIA + MASS * ARM**2, MASS * ARM * TO_MASS],
        [MASS * TO_MASS, MASS * ARM * TO_MASS, INERTIA + MASS * TO_MASS**2],
    ]
)


@numba.njit
def moreau(q, u, step, steps, inverse, rows, offsets):
    """Moreau's midpoint scheme (1999), with Newton's and Coulomb's laws for impulses by projected Gauss-Seidel."""
    compliance, impulses = rows @ inverse @ rows.T, np.zeros(6)
    for _ in range(steps):
        middle = q + 0.5 * step * u
        twist = RATE * (middle[1] - middle[2])
        force = np.array([-(MASS + OF_SLEEVE) * G, -twist - MASS * G * ARM, twist - MASS * G * TO_MASS])
        free = u + step * (inverse @ force)
        touches = offsets + rows[:3] @ middle <= 0.0
        impulses[:] = 0.0
        if touches.any():
            before, ahead = rows @ u, rows @ free
            for _ in range(400):
                change = 0.0
                for i in range(3):
                    if touches[i]:
                        bounce = BOUNCES * min(before[i], 0.0) if i == 0 else 0.0
                        for j, least in ((i, bounce), (i + 3, 0.0)):
                            new = (
                                impulses[j] - (ahead[j] + compliance[j] @ impulses + least) / compliance[j, j]
                            )
                            new = (
                                max(0.0, new)
                                if j == i
                                else min(RUBS * impulses[i], max(-RUBS * impulses[i], new))
                            )
                            change = max(change, abs(new - impulses[j]))
                            impulses[j] = new
                if change < 1e-16:
                    break
        u = free + inverse @ (rows.T @ impulses)
        q = middle + 0.5 * step * u
    return q, u


@pytest.mark.slow
@pytest.mark.parametrize("method", ["taylor", "dop853", "radau5"])
def test_the_woodpecker_comes_down_as_time_stepping_says(method):
    run = woodpecker().run(t_end=0.6, method=method, rtol=1e-10)
    assert run.ok and not run.objections and len(run.events) == 36
    normal = [[0, 0, -BEAK], [0, HALF, 0], [0, -HALF, 0]]
    along = [[1, ARM, TO_MASS - TO_BEAK], [1, RADIUS, 0], [1, RADIUS, 0]]
    offsets = np.array([ARM + TO_MASS - TO_BEAK - HOLE, RADIUS - HOLE, RADIUS - HOLE])
    q, u = run.q[0].copy(), run.v[0].copy()
    ends = [
        moreau(
            q,
            u,
            step,
            round(0.6 / step),
            np.linalg.inv(MATRIX),
            np.array(normal + along, dtype=float),
            offsets,
        )[0]
        for step in (4e-6, 1e-6)
    ]
    sizes = np.array([0.08, 0.1, 0.4])
    coarse, fine = (np.abs(end - run.q[-1]) / sizes for end in ends)
    assert fine.max() < 1e-3 and coarse.max() < 4e-3 and fine.max() < 0.5 * coarse.max()
