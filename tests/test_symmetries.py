"""Ignorable coordinates and conserved momenta of systems where they are known."""

from __future__ import annotations

import numpy as np
import pytest
from derived import Generated
from trees import GRAVITY, random_body

from symgen import Model
from symgen.derive.derivation import Derivation
from symgen.derive.structure import conserved_momenta, ignorable_coordinates
from symgen.model.description import Description


def top(inertia=("A", "A", "C"), **joint) -> Description:
    """A heavy top in Euler angles zxz."""
    model = Model("top", gravity=GRAVITY)
    model.parameters(m=1.3, l=0.4, A=0.2, B=0.25, C=0.1)
    for name in ("phi", "theta", "psi"):
        model.coordinate(name)
    com = ("l*sin(theta)*sin(phi)", "-l*sin(theta)*cos(phi)", "l*cos(theta)")
    rotation = [("z", "phi"), ("x", "theta"), ("z", "psi")]
    model.body("rotor", mass="m", com=com, inertia=inertia, rotation=rotation)
    if joint.get("damped"):
        model.dissipation("B*dot(phi)**2/2")
    return model.describe()


def floating() -> Description:
    model = Model("floating", gravity=GRAVITY)
    model.body("b", **random_body(np.random.default_rng(1)))
    model.joint("j", "free", "b")
    return model.describe()


CASES = {
    "symmetric top": (top(), ["phi", "psi"], ["phi", "psi"]),
    "asymmetric top": (top(("A", "B", "C")), ["phi"], ["phi"]),
    "damped top": (top(damped=True), ["phi", "psi"], ["psi"]),
    "floating body": (floating(), ["j_x", "j_y"], ["j_vx", "j_vy"]),
}


@pytest.mark.parametrize("name", CASES)
def test_known_symmetries_are_found(name):
    description, ignorable, conserved = CASES[name]
    d = Derivation(description)
    assert [description.coordinates[k].name for k in ignorable_coordinates(d)] == ignorable
    assert [d.description.rates[i].name for i in conserved_momenta(d)] == conserved


def test_conserved_momenta_stay():
    """The derivative of each reported momentum along the motion, by the complex step."""
    system = Generated(top())
    t, y = system.random_state(np.random.default_rng(2))
    parts = system.split(t, y)
    moved = y + 1e-20j * np.concatenate([parts.qdot, parts.a])
    momentum = system("mass_matrix", t, moved).reshape(3, 3) @ moved[3:]
    assert np.abs(momentum.imag[[0, 2]]).max() < 1e-13 * 1e-20 * 100
    assert abs(momentum.imag[1]) > 1e-3 * 1e-20
