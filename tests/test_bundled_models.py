"""Bundled models: all derive, and their equations agree with ones found by hand and by differences of energies."""

from __future__ import annotations

import functools
import itertools
from dataclasses import replace

import numpy as np
import pytest
from newton_euler import NewtonEuler
from oracles.planar_mechanisms import MECHANISMS
from oracles.variational import VariationalModel
from sympy import symbols

from symgen.link import derive
from symgen.model.algebra import Expr
from symgen.model.from_sympy import taken_over, to_sympy
from symgen.model.library import bundled, find, load
from symgen.runtime.abi import SOLIDS
from symgen.runtime.errors import RuntimeModelError

TOML_MODELS = sorted(name for name, path in bundled().items() if path.suffix == ".toml")
# Those with springs, bushings and fields of gravity are held against others by tests/test_element_models.py.
OF_ELEMENTS = ("crane", "engine_mounts", "satellite")
# And those with rotors and belts by tests/test_drives_and_platforms.py.
OF_DRIVES = ("belt_drive", "rack_and_pinion", "satellite_wheels")
OF_ASSEMBLIES = ("differential_car", "engine_v6")  # by tests/test_assembly_models.py
OF_STATES = ("active_suspension",)  # by tests/test_states.py
OF_SHAPES = ("die",)  # by tests/test_contact_shapes.py
OF_FRICTION = ("block_on_plate",)  # by tests/test_friction_planes.py
OF_OTHERS = (*OF_FRICTION, *OF_ELEMENTS, *OF_DRIVES, *OF_ASSEMBLIES, *OF_STATES, *OF_SHAPES)
OF_JOINTS = [
    name
    for name in TOML_MODELS
    if "[joints." in find(name).read_text(encoding="utf-8") and name not in OF_OTHERS
]
BY_HAND = [name for name in TOML_MODELS if name not in (*OF_JOINTS, *OF_OTHERS)]
TOLERANCE = 1e-11  # of the largest entry


@functools.cache
def derived(name: str):
    """The system of a bundled model, derived once for all tests of this file."""
    return derive(load(find(name)))


def parameters(system) -> dict[str, float]:
    return {entry["name"]: entry["value"] for entry in (*system.parameters, *system.inputs)}


def evaluate(system, function: str, t: float, *state: np.ndarray) -> np.ndarray:
    kernel = system.kernel(function)
    out = np.zeros(kernel.out_size)
    kernel(t, np.concatenate(state), system.parameter_values(), out)
    return out


def states(name: str, system, count: int):
    """Random states about the start, with rates of a few per second."""
    random = np.random.default_rng(sum(name.encode()))
    start = system.initial_state()[0]
    for _ in range(count):
        scale = 0.3 * np.maximum(np.abs(start), 0.3)
        yield (
            random.uniform(0.1, 3.0),
            start + scale * random.uniform(-1, 1, system.nq),
            random.uniform(-3, 3, system.nv),
        )


def assert_agree(actual: np.ndarray, expected: np.ndarray, what: str) -> None:
    scale = np.max(np.abs(expected), initial=1e-12)
    np.testing.assert_allclose(
        actual.reshape(expected.shape), expected, rtol=0, atol=TOLERANCE * scale, err_msg=what
    )


@pytest.mark.parametrize("name", MECHANISMS)
def test_equations_agree_with_those_found_by_hand(name):
    system = derived(name)
    for t, q, v in states(name, system, 5):
        expected = MECHANISMS[name](q, v, parameters(system))
        assert_agree(evaluate(system, "mass_matrix", t, q, v), expected.M, "mass matrix")
        assert_agree(evaluate(system, "forces", t, q, v), expected.f, "forces")
        if system.m:
            assert_agree(evaluate(system, "constraint_jacobian", t, q, v), expected.G, "constraint Jacobian")
            assert_agree(evaluate(system, "gamma", t, q, v), expected.gamma, "gamma")


@pytest.mark.parametrize("name", BY_HAND)
def test_equations_agree_with_differences_of_energies(name):
    system, oracle = derived(name), VariationalModel(find(name))
    (t, q, v), *_ = states(name, system, 1)
    at = oracle.point(t, q, v)
    assert_agree(evaluate(system, "mass_matrix", t, q, v), oracle.mass_matrix(at), "mass matrix")
    assert_agree(evaluate(system, "forces", t, q, v), oracle.forces(at), "forces")
    energies = np.array([float(oracle.kinetic(at)), float(oracle.potential(at))])
    assert_agree(evaluate(system, "energy", t, q, v), energies, "energy")
    if system.m:
        G, gamma = oracle.constraints(at)
        assert_agree(evaluate(system, "constraint_jacobian", t, q, v), G, "constraint Jacobian")
        assert_agree(evaluate(system, "gamma", t, q, v), gamma, "gamma")
    if system.outputs:
        assert_agree(evaluate(system, "outputs", t, q, v), oracle.outputs(at), "outputs")


def in_numbers(description):
    """The description with the values of its parameters, constants and definitions in bodies and joints."""
    values = {symbols(x.name): x.value for x in (*description.parameters, *description.constants)}
    for name, expression in description.definitions:
        values[symbols(name)] = to_sympy(expression).subs(values)

    def number(expression):
        return taken_over(to_sympy(expression).subs(values)) if isinstance(expression, Expr) else expression

    def numbers(item, *fields):
        return replace(item, **{f: tuple(map(number, getattr(item, f))) for f in fields})

    bodies = [replace(numbers(b, "com", "inertia"), mass=number(b.mass or 0.0)) for b in description.bodies]
    fields = ("xyz", "rpy", "stiffness", "damping", "armature", "rest")
    gravity = tuple(map(number, description.gravity or (0.0, 0.0, 0.0)))
    joints = tuple(numbers(j, *fields) for j in description.joints)
    return replace(description, bodies=tuple(bodies), joints=joints, gravity=gravity)


@pytest.mark.parametrize("name", OF_JOINTS)
def test_equations_of_joints_agree_with_newton_and_euler(name):
    system, description = derived(name), in_numbers(load(find(name)).describe())
    places = {record["name"]: k for k, record in enumerate(system.coordinates)}
    for t, q, v in states(name, system, 2):
        for first in system.quaternions:
            q[first : first + 4] /= np.linalg.norm(q[first : first + 4])
        oracle = NewtonEuler(description, np.concatenate([q, v]))
        M, h = oracle.equations()
        for joint in description.joints:
            for k, (coordinate, rate) in enumerate(zip(joint.coordinates, joint.rates, strict=False)):
                i, row = places[coordinate], oracle.column[rate]
                stiffness, damping, armature, rest = (
                    float((*x, *x, 0.0)[k if len(x) > 1 else 0])
                    for x in (joint.stiffness, joint.damping, joint.armature, joint.rest)
                )
                M[row, row] += armature
                h[row] += stiffness * (q[i] - rest) + damping * v[row]
        assert_agree(evaluate(system, "mass_matrix", t, q, v), M, "mass matrix")
        assert_agree(evaluate(system, "forces", t, q, v), -h, "forces")


@pytest.mark.parametrize("name", bundled())
def test_rhs_solves_the_equations_of_motion(name):
    system = derived(name)
    n, m, free = system.nv, system.m, system.nq + system.nv
    for t, q, v in states(name, system, 3):
        row = evaluate(system, "rhs", t, q, v)
        acceleration = row[system.nq : free]
        multipliers = row[free + system.nw : free + system.nw + m]
        M = evaluate(system, "mass_matrix", t, q, v).reshape(n, n)
        forces = evaluate(system, "forces", t, q, v)
        reactions = np.zeros(n)
        if m:
            G = evaluate(system, "constraint_jacobian", t, q, v).reshape(m, n)
            reactions = G.T @ multipliers
            gamma = evaluate(system, "gamma", t, q, v)
            scale = max(1.0, np.max(np.abs(G) @ np.abs(acceleration)))
            kept = [
                k for k in range(m) if k not in system.dependent
            ]  # the others follow on the constraints only
            np.testing.assert_allclose((G @ acceleration)[kept], gamma[kept], rtol=0, atol=1e-9 * scale)
        scale = max(1.0, np.max(np.abs(M) @ np.abs(acceleration)), np.max(np.abs(forces)))
        np.testing.assert_allclose(M @ acceleration, forces + reactions, rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize("name", bundled())
def test_model_has_what_a_viewer_and_a_run_need(name):
    system = derived(name)
    assert system.name == name
    assert system.description
    assert system.run_defaults["t_end"] > 0
    assert system.run_defaults["fps"] * system.run_defaults["t_end"] >= 100
    assert all(body["shape"] for body in system.bodies)
    q, v, *_ = system.initial_state()
    poses = evaluate(system, "poses", 0.0, q, v).reshape(-1, 12)
    assert len(poses) == len(system.bodies)
    for pose in poses:
        R = pose[3:].reshape(3, 3)
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) == pytest.approx(1.0)
    sizes = iter(evaluate(system, "shapes", 0.0, q, v))
    for body in system.bodies:
        for n, more in [(SOLIDS[kind] - 9, 9) for kind in body.get("parts", ())] or [(body["sizes"], 0)]:
            assert all(size > 0 for size in itertools.islice(sizes, n))
            list(itertools.islice(sizes, more))  # where a solid is


@pytest.mark.parametrize("name", bundled())
def test_model_runs_as_it_says_and_is_healthy(name):
    system = derived(name)
    solution = system.run(**system.run_defaults)
    assert solution.status == "success", solution.message
    assert solution.ok, [entry.says for entry in solution.health if not entry.ok]


def test_ball_bounces_to_the_height_that_restitution_leaves():
    solution = derived("bouncing_ball").run(t_end=5.0, rtol=1e-10)
    fall = np.sqrt(2 / 9.81)  # [s], from 1 m to the floor
    gaps = 2 * fall * 0.9 ** np.arange(1, len(solution.events))
    expected = fall + np.concatenate([[0.0], np.cumsum(gaps)])
    np.testing.assert_allclose([event.t for event in solution.events], expected, rtol=1e-9)


def test_slider_crank_turns_for_a_thousand_seconds_without_losing_energy():
    solution = derived("slider_crank").run(t_end=1000.0, fps=10)
    assert solution.status == "success", solution.message
    assert solution.energy.max_error < 2e-5
    assert solution.constraint_residual.max_position < 1e-11


@pytest.mark.parametrize("N", [1, 2, 5, 12])
def test_chain_of_any_length(N):
    system = derive(load(find("n_pendulum"), {"N": str(N), "rods": "false"}))
    assert (system.nq, len(system.bodies)) == (N, N)
    for t, q, v in states(f"chain {N}", system, 2):
        expected = MECHANISMS["n_pendulum"](q, v, parameters(system))
        assert_agree(evaluate(system, "mass_matrix", t, q, v), expected.M, "mass matrix")
        assert_agree(evaluate(system, "forces", t, q, v), expected.f, "forces")


def test_auto_follows_a_stiff_vibration_that_lasts_with_an_explicit_method():
    assert derived("stiff_spring_pendulum").run(t_end=1.0, method="auto").method == "taylor"


@pytest.mark.parametrize(("name", "mass"), [("double_pendulum", "m1"), ("slider_crank", "m")])
def test_negative_mass_at_run_time_is_refused_by_name(name, mass):
    with pytest.raises(RuntimeModelError, match=r"\[bodies\.\w+\] mass: the mass is negative"):
        derived(name).run(t_end=1.0, parameters={mass: -10.0})
