"""Constraints that follow from the others are left out of straight-line code, and nothing else changes."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest

from symgen import Model, cos, sin, t
from symgen.link import derive_file, derive_text
from symgen.model.library import find
from symgen.runtime import load as load_module
from symgen.runtime.batches import accelerations_and_multipliers
from symgen.runtime.constraints.dependence import has_dependence
from symgen.runtime.errors import ModuleError, RuntimeModelError

# A planar four-bar whose joints are spatial: of the five constraints that close it, two do something.
SPATIAL = """
name = "spatial_four_bar"
[parameters]
m = 1.0
g = 9.81
[gravity]
y = "-g"
[bodies.crank]
mass = "m"
com = ["0.5", 0, 0]
inertia = ["m/600", "m/12", "m/12"]
[bodies.coupler]
mass = "2*m"
com = [1, 0, 0]
inertia = ["m/300", "m*2/3", "m*2/3"]
[bodies.rocker]
mass = "1.5*m"
com = ["0.75", 0, 0]
inertia = ["m/400", "m*1.5*2.25/12", "m*1.5*2.25/12"]
[joints.a]
type = "revolute"
child = "crank"
axis = [0, 0, 1]
start = 1.2
rate = -1.0
[joints.b]
type = "revolute"
parent = "crank"
child = "coupler"
origin = { xyz = [1, 0, 0] }
axis = [0, 0, 1]
guess = -0.8
[joints.c]
type = "revolute"
parent = "coupler"
child = "rocker"
origin = { xyz = [2, 0, 0] }
axis = [0, 0, 1]
guess = -1.5
[points.end]
body = "rocker"
at = ["1.5", 0, 0]
[points.post]
body = "world"
at = ["1.8", 0, 0]
[constraints.place]
coincident = ["end", "post"]
[constraints.axis]
parallel = { bodies = ["rocker", "world"], axes = [[0, 0, 1], [0, 0, 1]] }
"""


def three_rockers() -> Model:
    """One bar on three equal rockers: the third holds nothing, as long as it is like the others."""
    model = Model("three_rockers")
    m, one, g = model.parameters(m="1 kg", one="1 m", g="9.81 m/s^2")
    third, lower = model.parameters(third="1 m", lower="0 m")
    model.gravity(y=-g)
    coupler = model.coordinate("coupler", unit="rad", guess=0.0)
    angles = [model.coordinate("rocker0", unit="rad", guess=1.0, rate_guess=0.5)]
    angles += [model.coordinate(f"rocker{k}", unit="rad", guess=1.0) for k in (1, 2)]
    x, y = one * cos(angles[0]), one * sin(angles[0])
    for k, (angle, length, down) in enumerate(zip(angles, (one, one, third), (0, 0, lower))):
        centre = (k * one + length * cos(angle) / 2, length * sin(angle) / 2 - down)
        model.body(f"bar{k}", mass=m, inertia=m * one**2 / 12, com=centre, angle=angle)
        if k:
            model.constraint(f"loop{k}_x", x + k * one * (cos(coupler) - 1) - length * cos(angle))
            model.constraint(f"loop{k}_y", y + k * one * sin(coupler) - length * sin(angle) + down)
    centre = (x + one * cos(coupler), y + one * sin(coupler))
    model.body("beam", mass=3 * m, inertia=m * one**2, com=centre, angle=coupler)
    return model


@functools.cache
def spatial():
    return Model.from_toml(SPATIAL).derive()


@functools.cache
def rockers():
    return three_rockers().derive()


def solved_with_all(system, y):
    """Accelerations, and the multipliers of least norm, of all constraints at once (NumPy)."""
    p, n, m = system.parameter_values(), system.nv, system.m
    kernel = {name: system.kernel(name)(0.0, y, p) for name in ("mass_matrix", "forces", "gamma")}
    jacobian = system.kernel("constraint_jacobian")(0.0, y, p).reshape(m, n)
    mass = kernel["mass_matrix"].reshape(n, n)
    inverse = np.linalg.inv(mass)
    apart = jacobian @ inverse @ jacobian.T
    needed = kernel["gamma"] - jacobian @ inverse @ kernel["forces"]
    multipliers = np.linalg.lstsq(apart, needed, rcond=1e-9)[0]
    a = inverse @ (kernel["forces"] + jacobian.T @ multipliers)
    # Of least norm: nothing in what G^T does not see.
    blind = np.linalg.svd(jacobian)[0][:, np.linalg.matrix_rank(jacobian, tol=1e-7) :]
    return a, multipliers - blind @ (blind.T @ multipliers)


@pytest.mark.parametrize("system", [spatial, rockers], ids=["spatial four-bar", "three rockers"])
def test_motion_and_least_multipliers_are_those_of_all_constraints(system):
    system = system()
    assert len(system.dependent) == {"spatial_four_bar": 3, "three_rockers": 1}[system.name]
    run = system.run(t_end=0.3, method="dop853", rtol=1e-9, atol=1e-9, fps=60)
    assert run.status == "success" and run.min_pivot_ratio > 1e-2
    assert all(check.ok for check in run.health), run.health
    accelerations, _ = accelerations_and_multipliers(system, run.p, run.t, run.states)
    for y, a, multipliers in zip(run.states, accelerations, run.multipliers, strict=True):
        expected_a, expected = solved_with_all(system, y)
        np.testing.assert_allclose(a, expected_a, rtol=0, atol=1e-9 * np.abs(expected_a).max())
        np.testing.assert_allclose(multipliers, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
        row = system.kernel("rhs")(0.0, y, run.p)
        np.testing.assert_allclose(
            row[system.nq : system.nq + system.nv], expected_a, atol=1e-9 * np.abs(expected_a).max()
        )
        assert not row[system.ny :][list(system.dependent)].any()


@pytest.mark.parametrize("method", ["taylor", "radau5"])
def test_other_methods_agree(method):
    system = spatial()
    expected = system.run(t_end=1.0, method="dop853", rtol=1e-11, atol=1e-11)
    found = system.run(t_end=1.0, method=method, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(found.states[-1], expected.states[-1], rtol=0, atol=1e-8)
    np.testing.assert_allclose(found.multipliers[-1], expected.multipliers[-1], rtol=0, atol=1e-6)


def test_spatial_joints_move_like_planar_ones():
    """The same bars in absolute angles, with the two constraints that a planar loop has."""
    model = Model("planar_four_bar")
    kg, metre, g = model.parameters(kg="1 kg", metre="1 m", g="9.81 m/s^2")
    model.gravity(y=-g)
    angles = [
        model.coordinate("a", unit="rad", start=1.2, rate=-1.0),
        *(model.coordinate(name, unit="rad", guess=guess) for name, guess in (("b", 0.4), ("c", -1.1))),
    ]
    x, y = 0, 0
    for name, angle, size in zip("abc", angles, (1, 2, 1.5)):
        length, mass = size * metre, size * kg
        centre = (x + length * cos(angle) / 2, y + length * sin(angle) / 2)
        model.body(name, mass=mass, inertia=mass * length**2 / 12, com=centre, angle=angle)
        x, y = x + length * cos(angle), y + length * sin(angle)
    model.constraint("x", x - 1.8 * metre)
    model.constraint("y", y)
    planar = model.derive().run(t_end=2.0, method="dop853", rtol=1e-11, atol=1e-11)
    run = spatial().run(t_end=2.0, method="dop853", rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(np.cumsum(run.q, axis=1), planar.q, rtol=0, atol=1e-8)


def test_where_the_parameters_of_a_run_make_it_rigid_all_constraints_hold():
    """With a third rocker from elsewhere nothing can move: an equation left out would let it fall."""
    system, other = rockers(), {"third": 1.1, "lower": 0.3}
    assert has_dependence(system, system.parameter_values(), 0.0, system.run(t_end=0.1).q[0])
    run = system.run(t_end=0.5, method="dop853", parameters=other)
    assert not has_dependence(system, run.p, 0.0, run.q[0])
    np.testing.assert_allclose(run.q[-1], run.q[0], rtol=0, atol=1e-10)
    assert "redundant" not in " ".join(run.notes)
    with pytest.raises(
        RuntimeModelError, match=r"leave out loop1_y.*do not follow from the other constraints; use dop853"
    ):
        system.run(t_end=0.5, method="taylor", parameters=other)
    assert "leave out loop1_y" in " ".join(system.run(t_end=0.1, parameters=other).notes)


def test_two_of_them_are_left_out_of_each_by_itself():
    """Equal subsystems share their code; the constraints that they leave out are counted through all of them."""
    model = Model.from_toml(SPATIAL)
    twins = Model.from_toml(_twins())
    one, two = model.derive(), twins.derive()
    names = [two.constraints[k]["name"] for k in two.dependent]
    assert len(two.subsystems) == 1 and len(two.dependent) == 2 * len(one.dependent)
    assert sorted(name[:5] for name in names) == ["one_a"] * 2 + ["one_p"] + ["two_a"] * 2 + ["two_p"]
    single, both = (s.run(t_end=0.5, method="dop853", rtol=1e-10, atol=1e-10) for s in (one, two))
    np.testing.assert_allclose(both.q[-1][:3], single.q[-1], rtol=0, atol=1e-8)
    np.testing.assert_allclose(both.q[-1][3:], single.q[-1], rtol=0, atol=1e-8)


def _twins() -> str:
    head, first = SPATIAL.split("[bodies.crank]")
    text = head
    for name in ("one", "two"):
        own = "[bodies.crank]" + first
        for word in ("crank", "coupler", "rocker", "end", "post", "place", "axis"):
            own = own.replace(f".{word}]", f".{name}_{word}]").replace(f'"{word}"', f'"{name}_{word}"')
        for word in "abc":
            own = own.replace(f"[joints.{word}]", f"[joints.{name}_{word}]")
        text += own
    return text


def test_what_agrees_for_an_instant_only_is_not_left_out():
    """x = sin t and x = 0 agree at the start."""
    model = Model("driven")
    x, y = (model.coordinate(name, guess=0.0) for name in "xy")
    model.body("point", mass=1.0, com=(x, y))
    model.constraint("follows", x - sin(t))
    model.constraint("rests", x)
    assert derive_text(model).text.count('"dependent"') == 0


def test_derive_says_what_is_left_out():
    found = derive_file(find("bricard"))
    assert any("solved without: hinge6_" in finding for finding in found.findings)
    assert load_module(found.text).dependent


def test_a_module_must_name_constraints_that_it_has():
    text = derive_file(find("bricard")).text
    for wrong in ("[5]", "[1, 0]", "[True]", "[-1]"):
        broken, n = re.subn(r'("dependent": )\[[^]]*\]', rf"\g<1>{wrong}", text)
        assert n == 1
        with pytest.raises(ModuleError, match="'dependent' is"):
            load_module(broken)
