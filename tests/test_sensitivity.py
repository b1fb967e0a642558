"""Derivatives of rhs by the state and by parameters, as generated functions, against complex steps of the module."""

from __future__ import annotations

import cmath
import re

import numpy as np
import pytest
from click.testing import CliRunner

import symgen
from symgen import Model, link, runtime
from symgen.cli import main
from symgen.errors import ModelError
from symgen.model.library import bundled, load

STEP = 1e-30


def module_text(name: str, **options: str) -> str:
    return link.derive_text(load(bundled()[name], options), jacobian=True).text


def with_jacobian(name: str, **options: str):
    return runtime.load(module_text(name, **options))


FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "asin", "acos", "atan")


def on_complex_numbers(text: str):
    """The module's rhs as Python on complex numbers: its text, with their functions in place of those of `math`."""
    names = {name: getattr(cmath, name) for name in FUNCTIONS}
    names |= {"njit": lambda **options: lambda f: f, "pow": pow, "fabs": lambda x: x if x.real >= 0 else -x}
    names["min"] = lambda *values: min(values, key=lambda x: x.real)
    exec(compile(re.sub(r"^(from|import) .*$", "", text, flags=re.MULTILINE), "module", "exec"), names)
    return names["rhs"]


MODELS = {
    "pendulum": {}, "double_pendulum": {}, "cart_pole": {}, "quarter_car": {}, "slider_crank": {}, "bricard": {},
    "rolling_disc": {}, "free_rigid_body": {}, "heavy_top_absolute": {}, "seven_dof_arm": {}, "n_pendulum": {"N": "5"},
}  # fmt: skip


@pytest.mark.parametrize("name", MODELS)
def test_derivatives_are_those_of_complex_steps(name):
    """Mechanisms, redundant constraints, quaternions, rolling, rheonomic and driven models; states on the way."""
    text = module_text(name, **MODELS[name])
    system, written = runtime.load(text), on_complex_numbers(text)
    run = system.run(0.05)
    n, p = system.nq + system.nv, system.parameter_values()
    n_p, y = len(system.parameters) + len(system.inputs), run.states[-1][: system.nq + system.nv].copy()

    def slope(dy, dp):
        out = np.zeros(system.ny + system.m + 1, dtype=complex)
        written(0.05, list(y + 1j * STEP * dy), list(p + 1j * STEP * dp), out)
        return out[:n].imag / STEP

    by_state = np.array([slope(unit, 0.0 * p) for unit in np.eye(n)]).T
    by_parameters = np.array([slope(0.0 * y, unit) for unit in np.eye(len(p))[:n_p]]).T
    for function, expected in (("rhs_by_state", by_state), ("rhs_by_parameters", by_parameters)):
        found = system.kernel(function)(0.05, y, p).reshape(expected.shape)
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-10 * np.abs(expected).max())


@pytest.mark.slow
def test_large_models_solve_in_loops():
    """Where M is factored by loops, central differences tell."""
    system = with_jacobian("n_pendulum", N="40")
    n, p = system.nq + system.nv, system.parameter_values()
    y = np.random.default_rng(0).uniform(-0.4, 0.4, n)
    found = system.kernel("rhs_by_state")(0.0, y, p).reshape(n, n)
    rhs = system.kernel("rhs")
    for k in (0, 17, 39, 40, 79):
        unit = 1e-6 * np.eye(n)[k]
        expected = (rhs(0.0, y + unit, p)[:n] - rhs(0.0, y - unit, p)[:n]) / 2e-6
        np.testing.assert_allclose(found[:, k], expected, rtol=1e-5, atol=1e-6 * np.abs(found).max())


def test_runs_are_the_same_and_other_modules_have_none():
    plain, more = symgen.load("slider_crank"), with_jacobian("slider_crank")
    np.testing.assert_array_equal(plain.run(0.5).q, more.run(0.5).q)
    assert not plain.has("rhs_by_state") and more.has("rhs_by_state")
    assert plain.source.functions["rhs"] == more.source.functions["rhs"]


def test_forces_that_jump_have_the_derivatives_of_their_branch():
    model = Model.from_toml(
        '[parameters]\nk = 3.0\n[coordinates]\nx = { start = 1.0 }\n[energy]\nkinetic = "dot(x)^2/2"\n'
        '[forces]\nx = "where(x < 0, -k*x, 2*k*x^2)"'
    )
    system = model.derive(jacobian=True)
    p = system.parameter_values()
    for x, by_x, by_k in ((-0.5, -3.0, 0.5), (0.5, 6.0, 0.5)):
        by_state = system.kernel("rhs_by_state")(0.0, [x, 0.0], p)
        np.testing.assert_allclose(by_state, [0.0, 1.0, by_x, 0.0], atol=1e-14)
        np.testing.assert_allclose(
            system.kernel("rhs_by_parameters")(0.0, [x, 0.0], p), [0.0, by_k], atol=1e-14
        )


def test_stops_and_friction_have_none():
    with pytest.raises(ModelError, match="no derivative where they switch"):
        with_jacobian("stick_slip")


def test_the_command_writes_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["derive", "pendulum", "--jacobian", "-o", "."])
    assert done.exit_code == 0, done.output
    text = (tmp_path / "pendulum.py").read_text()
    assert "def rhs_by_state(t, y, p, out):" in text and "def rhs_by_parameters(t, y, p, out):" in text
    refused = CliRunner().invoke(main, ["derive", "door_stop", "--jacobian", "-o", "."])
    assert refused.exit_code == 1 and "no derivative" in refused.output and "Traceback" not in refused.output
