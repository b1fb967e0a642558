"""Linear models against the nonlinear equations: small motions, inputs, outputs; numbers that carry derivatives."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from driven_models import closed_crane, crane
from scipy.optimize import root

from symgen import Model
from symgen.link import derive
from symgen.model.library import find, load
from symgen.runtime.batches import accelerations_and_multipliers
from symgen.runtime.code.function_text import FunctionText, Lengths
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.linear import LinearModel, linearise
from symgen.runtime.linear.linearisation import Dual, carried_out
from symgen.runtime.names import rate_labels
from symgen.runtime.positions import Positions

STEP = 1e-5


@functools.cache
def bundled(name: str):
    return derive(load(find(name)))


class Motion:
    """The nonlinear motion near the state of a linear model, by the same independent coordinates and rates."""

    def __init__(self, linear: LinearModel):
        self.linear, self.system = linear, linear.system
        self.positions = Positions(self.system)
        labels = rate_labels(self.system.coordinates, self.system.rates)
        self.free_q = [linear.motions.index(name) for name in linear.states if name in linear.motions]
        self.free_v = [labels.index(name) for name in linear.states if name in labels]

    def state(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return q and v with all constraints satisfied, from deviations of the independent ones."""
        linear, system = self.linear, self.system
        move, bound_q = np.zeros(system.nv), np.setdiff1d(np.arange(system.nv), self.free_q)
        move[self.free_q] = x[: len(self.free_q)]
        if len(bound_q):
            rows = self.regular_rows(system.nh)

            def closed(y: np.ndarray) -> np.ndarray:
                trial = move.copy()
                trial[bound_q] = y
                return self.residual(self.positions.retract(linear.q, trial), linear.v)[rows]

            move[bound_q] = root(closed, np.zeros(len(bound_q)), tol=1e-14).x
        q, v = self.positions.retract(linear.q, move), linear.v.copy()
        v[self.free_v] += x[len(self.free_q) :]
        if system.m:
            matrix = system.kernel("constraint_jacobian")(linear.t, np.concatenate([q, v]), linear.p)
            matrix = matrix.reshape(system.m, system.nv)
            bound_v = np.setdiff1d(np.arange(system.nv), self.free_v)
            left = self.residual(q, v)[system.nh :]
            v[bound_v] -= np.linalg.lstsq(matrix[:, bound_v], left, rcond=1e-9)[0]
        return q, v

    def residual(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self.system.kernel("constraint_residual")(self.linear.t, np.concatenate([q, v]), self.linear.p)

    def regular_rows(self, n: int) -> list[int]:
        """Constraints that do not follow from those before them."""
        y = np.concatenate([self.linear.q, self.linear.v])
        matrix = self.system.kernel("constraint_jacobian")(self.linear.t, y, self.linear.p).reshape(
            -1, self.system.nv
        )
        rows: list[int] = []
        for k in range(n):
            if np.linalg.matrix_rank(matrix[[*rows, k]], tol=1e-8) > len(rows):
                rows.append(k)
        return rows

    def derivative(self, x: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return x', as rates and accelerations of the independent ones."""
        q, v = self.state(x)
        a, _ = accelerations_and_multipliers(
            self.system, p, np.array([self.linear.t]), np.concatenate([q, v])[None]
        )
        return np.concatenate([v[self.free_q], a[0][self.free_v]])


CASES = {
    "slider_crank": ("start", {}),
    "rolling_disc": ("start", {}),
    "heavy_top_absolute": ("start", {}),
    "bricard": ("start", {}),
    "seven_dof_arm": ("start", {}),
    "spinning_top": ("start", {}),
    "four_bar": ("equilibrium", {}),
}


@pytest.mark.parametrize("name", CASES)
def test_small_motions_follow_the_linear_model(name):
    at, rate = CASES[name]
    linear = bundled(name).linearise(at, rate=rate)
    motion, n = Motion(linear), len(linear.states)
    columns = [
        (motion.derivative(h, linear.p) - motion.derivative(-h, linear.p)) / (2.0 * STEP)
        for h in STEP * np.eye(n)
    ]
    turned = [k for k, name in enumerate(linear.states) if name.startswith("turn(")]
    expected, found = np.array(columns).T, linear.A.copy()
    # Small rotations in axes that turn along: δ' = δω - ω × δ, where the difference above has δω alone.
    for k in turned:
        expected[k] += turning(linear)[motion.free_q[k]] @ linear.shape
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=2e-8 * max(1.0, scale))


def turning(linear: LinearModel) -> np.ndarray:
    matrix = np.zeros((linear.system.nv, linear.system.nv))
    for _, j in Positions(linear.system).quaternions:
        for k in range(3):
            matrix[j : j + 3, j + k] = -np.cross(linear.v[j : j + 3], np.eye(3)[k])
    return matrix


@pytest.mark.parametrize("system", [crane, closed_crane])
def test_inputs_act_as_in_the_nonlinear_equations(system):
    linear = linearise(system(), "start", parameters={"u": 1.5})
    motion, origin = Motion(linear), np.zeros(len(linear.states))
    for k, name in enumerate(linear.inputs):
        sides = []
        for step in (STEP, -STEP):
            p = linear.p.copy()
            p[len(linear.system.parameters) + k] += step
            sides.append(motion.derivative(origin, p))
        expected = (sides[0] - sides[1]) / (2.0 * STEP)
        np.testing.assert_allclose(linear.B[:, k], expected, rtol=0.0, atol=1e-8, err_msg=name)


def test_the_cart_and_pole_has_its_textbook_matrices():
    linear = bundled("cart_pole").linearise(start={"theta": 0.2})
    M, mp, l, b, g = 1.0, 0.1, 0.5, 0.1, 9.81
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2:] = [[0.0, -mp * g / M, -b / M, 0.0], [0.0, (M + mp) * g / (M * l), b / (M * l), 0.0]]
    np.testing.assert_allclose(linear.A, A, rtol=0.0, atol=1e-14 * np.abs(A).max())
    np.testing.assert_allclose(linear.B[:, 0], [0.0, 0.0, 1.0 / M, -1.0 / (M * l)], rtol=1e-14, atol=1e-15)
    assert linear.states == ["x", "theta", "dot(x)", "dot(theta)"]


def test_outputs_and_dependent_coordinates_follow_the_states():
    linear = bundled("rolling_disc").linearise(
        "start", outputs=["z", "contact_point_x", "dot(spin)", "contact_point_y"]
    )
    motion, system = Motion(linear), linear.system
    for k, column in enumerate(np.eye(len(linear.states))):
        sides = []
        for step in (STEP, -STEP):
            q, v = motion.state(step * column)
            outputs = system.kernel("outputs")(0.0, np.concatenate([q, v]), linear.p)
            sides.append([q[2], outputs[0], v[5], outputs[1]])
        expected = np.subtract(*sides) / (2.0 * STEP)
        np.testing.assert_allclose(linear.C[:, k], expected, rtol=0.0, atol=1e-8)


def test_velocity_constraints_leave_positions_free():
    linear = bundled("rolling_disc").linearise("start")
    assert len(linear.states) == 9
    assert [name for name in linear.states if name.startswith("dot(")] == [
        "dot(yaw)",
        "dot(lean)",
        "dot(spin)",
    ]


def test_redundant_constraints_are_noted():
    linear = bundled("bricard").linearise("start")
    assert len(linear.states) == 2 and any("1 of 5 constraints" in note for note in linear.notes)


def test_what_cannot_be_linearised_is_refused():
    system = bundled("cart_pole")
    with pytest.raises(RuntimeModelError, match="at is 'middle'"):
        system.linearise("middle")
    with pytest.raises(RuntimeModelError, match="1 coordinates and 2 rates"):
        system.linearise(([0.0], [0.0, 0.0]))
    with pytest.raises(RuntimeModelError, match="did you mean 'theta'"):
        system.linearise("start", outputs=["thta"])


def test_a_state_off_the_constraints_is_refused():
    system = bundled("slider_crank")
    with pytest.raises(RuntimeModelError, match="does not satisfy the constraint"):
        system.linearise((system.initial_state()[0] + 0.1, np.zeros(3)))


def test_inputs_over_time_have_their_value_at_the_time():
    m = Model("pushed")
    x = m.coordinate("x", unit="m", guess=0.0)
    m.body("block", mass="1 kg", com=(x, 0))
    k, F = m.parameter("k", "10 N/m"), m.input("F", unit="N", polynomial=[1.0, 2.0])
    m.potential(k * x**2 / 2)
    m.force(x, F)
    system = m.derive()
    assert system.linearise(t=2.0).q[0] == pytest.approx(0.5, rel=1e-12)
    assert system.linearise(t=2.0, parameters={"F": 3.0}).q[0] == pytest.approx(0.3, rel=1e-12)


def test_derivatives_go_through_loops_choices_and_arrays():
    text = """def outputs(t, y, p, out):
    w0 = [0.0]*3
    w0[1] = y[0]*y[0]
    s = pow(y[0], p[0])
    for k in range(2):
        s = s + atan2(y[k], 1.0 + y[1 + k]) / (2.0 - y[k])
    h = (s if y[0] < 1.0 else -s)
    out[0] = h - w0[1] + copysign(y[1], -2.0)
    out[1] = 3.0 / y[0]
"""
    code = FunctionText("outputs", text, Lengths(3, 1, 2))

    def real(y):
        out = [0.0, 0.0]
        code.python_function()(0.0, list(y), [1.7], out)
        return np.array(out)

    y = np.array([0.7, 0.3, 0.2])
    out = carried_out(code.form, 0.0, [Dual(x, row) for x, row in zip(y, np.eye(3))], [1.7])
    for k, direction in enumerate(np.eye(3)):
        h = 1e-3 * direction
        expected = (8 * (real(y + h) - real(y - h)) - real(y + 2 * h) + real(y - 2 * h)) / 12e-3
        np.testing.assert_allclose([x.slope[k] for x in out], expected, rtol=0.0, atol=1e-9)
