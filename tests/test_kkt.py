"""The guarded kernels: straight-line results where they are sound, else pivoted ones."""

from __future__ import annotations

import os
import pprint
import subprocess
import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest
from stress.random_models import loop

from symgen import runtime
from symgen.runtime.abi import array_sizes
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.constraints.guard_code import PIVOT_LIMIT, REFINED_BELOW
from symgen.runtime.constraints.kkt import robust_project_address, robust_rhs_address

ROOT = Path(__file__).parent.parent
FIXTURES = ROOT / "tests" / "fixtures"
Y = np.array([0.3, -0.4, 0.8, 0.6])


def load(name: str):
    return runtime.load(FIXTURES / f"{name}.py")


def evaluate(address_of, system, function, y, t=0.0, p=None) -> np.ndarray:
    address, keep = address_of(system)
    out = np.zeros(system.kernel(function).out_size)
    call_kernel(address, t, np.asarray(y, dtype=float), system.parameter_values() if p is None else p, out)
    del keep
    return out


def robust_rhs(system, y, **more):
    return evaluate(robust_rhs_address, system, "rhs", y, **more)


def robust_project(system, y, **more):
    return evaluate(robust_project_address, system, "project", y, **more)


BROKEN = "    n = t - t\n    z = n / n\n"


def model(*, q, mass, forces, jacobian, residual, gamma=(), energy="0.0", nw=0, m=2) -> str:
    """A module whose straight-line rhs and project divide zero by zero; expressions are given per row."""
    nq = len(q)
    fixture = load("redundant_pendulum").source.header
    header = {
        **fixture,
        "name": "made",
        "nq": nq,
        "nv": nq,
        "nh": m,
        "nw": nw,
        "coordinates": [{"name": name, "unit": "", "value": 0.0, "enforced": False} for name in q],
        "rates": [{"name": name, "unit": "", "value": 0.0, "enforced": False} for name in q],
        "constraints": [{"name": f"c{i}", "kind": "holonomic"} for i in range(m)],
        "structure": {**fixture["structure"], "conservative": not nw, "time_dependent": bool(nw)},
        "operations": {},
    }
    velocities = [f"y[{nq + i}]" for i in range(nq)]
    functions = {
        "rhs": [*velocities, *["z"] * (nq + nw + m + 1)],
        "mass_matrix": mass,
        "forces": forces,
        "energy": [energy, "0.0"],
        "residual": [],
        "residual_jacobian": [],
        "constraint_residual": residual,
        "constraint_jacobian": jacobian,
        "gamma": gamma,
        "project": ["z"] * (2 * nq + 2 * m),
    }
    text = f'"""Made for a test."""\n\nMODEL = {pprint.pformat(header, sort_dicts=False)}\n'
    for name, rows in functions.items():
        rows = list(rows)
        rows += ["0.0"] * (array_sizes(header, name)[1] - len(rows))
        body = BROKEN + "".join(f"    out[{i}] = {row}\n" for i, row in enumerate(rows))
        text += f'\n\n@njit(error_model="numpy")\ndef {name}(t, y, p, out):\n{body}'
    return text


def test_without_constraints_it_is_the_kernel_itself():
    system = load("pendulum")
    assert robust_rhs_address(system)[0] == system.kernel("rhs").address


def test_sound_rows_pass_unchanged():
    system, rng = load("cartesian_pendulum"), np.random.default_rng(0)
    p = system.parameter_values()
    for _ in range(20):
        y = rng.normal(size=4)
        np.testing.assert_array_equal(robust_rhs(system, y), system.kernel("rhs")(0.0, y, p))
        np.testing.assert_array_equal(robust_project(system, y), system.kernel("project")(0.0, y, p))


def test_addresses_are_made_once():
    system = load("cartesian_pendulum")
    assert robust_rhs_address(system)[0] == robust_rhs_address(system)[0]
    assert robust_rhs_address(system)[0] != robust_project_address(system)[0]


def test_duplicate_constraint_gives_the_pendulum():
    double, single = load("redundant_pendulum"), load("cartesian_pendulum")
    p = single.parameter_values()
    row, expected = robust_rhs(double, Y), single.kernel("rhs")(0.0, Y, p)
    np.testing.assert_allclose(row[:4], expected[:4], rtol=1e-14)
    # G2 = 3 G1: of all pairs with l1 + 3 l2 = l the shortest is l (1, 3) / 10.
    np.testing.assert_allclose(row[4:6], expected[4] * np.array([0.1, 0.3]), rtol=1e-13)
    assert row[6] == 0.0

    moved = Y + np.array([0.01, -0.02, 0.0, 0.1])
    projected, expected = robust_project(double, moved), moved
    for _ in range(6):
        expected = single.kernel("project")(0.0, np.append(expected[:2], moved[2:]), p)
    np.testing.assert_allclose(projected[:4], expected[:4], rtol=1e-13)
    first = single.kernel("constraint_residual")(0.0, moved, p)[0]
    np.testing.assert_allclose(projected[4:6], first * np.array([1.0, 3.0]), rtol=1e-12)
    np.testing.assert_allclose(projected[6:], expected[-1] * np.array([1.0, 3.0]), rtol=1e-11)
    assert not np.isfinite(double.kernel("rhs")(0.0, Y, p)).all()


def test_repeated_projection_reaches_both_constraints():
    system, y = load("redundant_pendulum"), Y + np.array([0.02, 0.03, -0.5, 0.2])
    for _ in range(8):
        y = robust_project(system, y)[:4]
    assert np.abs(system.kernel("constraint_residual")(0.0, y, system.parameter_values())).max() < 1e-14


def test_random_dependent_rows_agree_with_the_pseudo_inverse():
    rng = np.random.default_rng(7)
    n, m, rank = 5, 6, 3
    root = rng.normal(size=(n, n))
    mass, forces = root @ root.T + np.eye(n), rng.normal(size=n)
    jacobian = (
        np.diag([1.0, 100.0, 1e-3, 1.0, 7.0, 1.0]) @ rng.normal(size=(m, rank)) @ rng.normal(size=(rank, n))
    )
    gamma = jacobian @ rng.normal(size=n)
    text = model(
        q=[f"q{i}" for i in range(n)],
        m=m,
        mass=map(repr, mass.ravel().tolist()),
        forces=map(repr, forces.tolist()),
        jacobian=map(repr, jacobian.ravel().tolist()),
        gamma=map(repr, gamma.tolist()),
        residual=["0.0"],
    )
    row = robust_rhs(runtime.load(text), np.zeros(2 * n))
    inverse = np.linalg.inv(mass)
    multipliers = np.linalg.pinv(jacobian @ inverse @ jacobian.T, rcond=1e-12) @ (
        gamma - jacobian @ inverse @ forces
    )
    acceleration = inverse @ (forces + jacobian.T @ multipliers)
    np.testing.assert_allclose(row[n : 2 * n], acceleration, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(
        row[2 * n : 2 * n + m], multipliers, rtol=1e-8, atol=1e-8 * np.abs(multipliers).max()
    )


def test_massless_coordinate():
    # m a_x = 1 + l1 + 2 l2, 0 = 2 - l1 - 2 l2, a_x = a_y, stated twice.
    text = model(
        q=["x", "y"],
        mass=["p[0]"],
        forces=["1.0", "2.0"],
        jacobian=["1.0", "-1.0", "2.0", "-2.0"],
        gamma=["0.0", "0.0"],
        residual=["y[0] - y[1]", "2.0 * (y[0] - y[1])", "y[2] - y[3]", "2.0 * (y[2] - y[3])"],
    )
    system = runtime.load(text)
    row = robust_rhs(system, [0.0, 0.0, 1.0, 1.0], p=np.array([4.0, 0.0, 0.0]))
    np.testing.assert_allclose(row, [1.0, 1.0, 0.75, 0.75, 0.4, 0.8, 0.0], rtol=1e-14)
    projected = robust_project(system, [0.3, 0.1, 1.0, 0.5])
    assert projected[0] == pytest.approx(projected[1], rel=1e-14)
    assert projected[2] == pytest.approx(projected[3], rel=1e-14)


def test_undetermined_motion_is_not_a_number():
    text = model(
        q=["x", "y"],
        mass=["0.0"],
        forces=["0.0"],
        jacobian=["1.0", "0.0", "2.0"],
        gamma=["0.0"],
        residual=["0.0"],
    )
    assert np.isnan(robust_rhs(runtime.load(text), np.zeros(4))[2:4]).all()


def test_constraint_without_effect_gets_no_multiplier():
    text = model(
        q=["x", "y"], mass=["1.0", "0.0", "0.0", "1.0"], forces=["3.0", "4.0"], jacobian=["0.0", "1.0"],
        gamma=["0.0"], residual=["0.0"],
    )  # fmt: skip
    np.testing.assert_allclose(robust_rhs(runtime.load(text), np.zeros(4))[2:], [3.0, 0.0, -4.0, 0.0, 0.0])


def test_power_of_prescribed_motion_with_multipliers_not_unique():
    # x = sin(2 t), twice; a mass of 3 on a spring of 5: P = dE/dt.
    mass, spring, t = 3.0, 5.0, 0.7
    text = model(
        q=["x"],
        nw=1,
        mass=["3.0"],
        forces=["-5.0 * y[0]"],
        jacobian=["1.0", "2.0"],
        gamma=["-4.0 * sin(2.0 * t)", "-8.0 * sin(2.0 * t)"],
        energy="1.5 * y[1] * y[1] + 2.5 * y[0] * y[0]",
        residual=["y[0] - sin(2.0 * t)", "2.0 * (y[0] - sin(2.0 * t))"],
    )
    x, v, a = np.sin(2 * t), 2 * np.cos(2 * t), -4 * np.sin(2 * t)
    row = robust_rhs(runtime.load(text), [x, v], t=t)
    assert row[1] == pytest.approx(a, rel=1e-14)
    assert row[2] == pytest.approx((mass * a + spring * x) * v, rel=1e-11)
    assert row[3] + 2 * row[4] == pytest.approx(mass * a + spring * x, rel=1e-13)


def test_state_that_is_not_finite_ends_as_not_a_number():
    row = robust_rhs(load("redundant_pendulum"), [np.nan, -0.4, 0.0, 0.0])
    assert np.isnan(row[2:4]).all()


def test_works_without_jit():
    script = """
import sys, numpy as np
from symgen.runtime import load
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.constraints.kkt import robust_rhs_address
system = load(sys.argv[1])
address, keep = robust_rhs_address(system)
out = np.zeros(system.n_row)
call_kernel(address, 0.0, np.array([0.3, -0.4, 0.8, 0.6]), system.parameter_values(), out)
print(repr(out.tolist()))
"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-c", script, str(FIXTURES / "redundant_pendulum.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    np.testing.assert_allclose(eval(done.stdout), robust_rhs(load("redundant_pendulum"), Y), rtol=1e-14)


@pytest.mark.parametrize("bars", [3, 5])
@pytest.mark.parametrize("spread", [0.0, 3.0])
def test_nearly_flat_loops_are_solved_as_by_a_pivoted_factorisation(bars, spread):
    """Accelerations and multipliers against 40 digits: bars nearly in line, masses of 1e±3; LU is the measure."""
    system, rng = loop(bars, False), np.random.default_rng(6)
    names = [entry["name"] for entry in system.parameters]
    n, worst, seen = bars, 0.0, 0
    for _ in range(60):
        angles = (
            rng.uniform(-3, 3)
            + np.pi * rng.integers(0, 2, n)
            + 10 ** rng.uniform(-2.5, -1) * rng.normal(size=n)
        )
        lengths, p = rng.uniform(0.3, 1.0, n), system.parameter_values()
        values = {f"l{k}": x for k, x in enumerate(lengths)} | {
            f"m{k}": 10 ** rng.uniform(-spread, spread) for k in range(n)
        }
        values |= {"px": lengths @ np.cos(angles), "py": lengths @ np.sin(angles)}
        for name, value in values.items():
            p[names.index(name)] = value
        y = np.concatenate([angles, rng.normal(size=n)])
        row = robust_rhs(system, y, p=system.precomputed(p))
        if not PIVOT_LIMIT < row[-1] < REFINED_BELOW:
            continue
        seen += 1
        M, f = system.kernel("mass_matrix")(0.0, y, p).reshape(n, n), system.kernel("forces")(0.0, y, p)
        G, gamma = (
            system.kernel("constraint_jacobian")(0.0, y, p).reshape(2, n),
            system.kernel("gamma")(0.0, y, p),
        )
        whole, right = np.block([[M, -G.T], [G, np.zeros((2, 2))]]), np.concatenate([f, gamma])
        with mpmath.workdps(40):
            exact = mpmath.lu_solve(mpmath.matrix(whole.tolist()), mpmath.matrix(right.tolist()))
        exact = np.array([float(x) for x in exact])
        found = np.concatenate([row[n : 2 * n], row[system.ny : system.ny + 2]])

        def off(x, exact=exact):
            parts = slice(0, n), slice(n, n + 2)
            return max(np.abs(x - exact)[s].max() / np.abs(exact[s]).max() for s in parts)

        worst = max(worst, off(found) / max(off(np.linalg.solve(whole, right)), 1e-16))
    assert seen > 15 and worst < 100
