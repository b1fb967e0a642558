"""`symgen modes`, recordings of modes, and models that bring their controller along."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner, Result

from symgen.cli import main
from symgen.link import derive, derive_text, module_for
from symgen.model.library import find, load
from symgen.runtime.linear.animation import record_mode
from symgen.runtime.recording.reader import read_recording

CONTROLLED = """
from symgen import Model

def build():
    m = Model("block")
    x = m.coordinate("x", unit="m", start=0.0, rate=0.0)
    m.body("block", mass="2 kg", com=(x, 0))
    m.force(x, m.input("F", unit="N"))
    m.run(t_end=1.0)
    return m

def control(system, parameters):
    return RETURNED
"""


def symgen(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments))


def test_report_of_modes(tmp_path):
    file, figure = tmp_path / "modes.json", tmp_path / "response.png"
    result = symgen(
        "modes", "cart_pole", "--from", "F", "--to", "dot(theta)", "--frequencies", "0.1,10", "--json", str(file),
        "--png", str(figure),
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "the equilibrium is unstable: mode 3 grows e-fold in 0.2155 s" in result.output
    assert "frequency response from F to dot(theta)" in result.output
    found = json.loads(file.read_text())
    A, B, C, D = (np.array(found[key]) for key in "ABCD")
    row = found["outputs"].index("dot(theta)")
    response = found["frequency_response"]
    for f, gain in zip(response["frequencies"], response["gain"]):
        inverse = np.linalg.inv(2j * np.pi * f * np.eye(4) - A)
        assert gain == pytest.approx(abs(C[row] @ inverse @ B[:, 0] + D[row, 0]), rel=1e-12)
    assert len(response["gain"]) > 20
    values = [complex(x["eigenvalue"]["real"], x["eigenvalue"]["imaginary"]) for x in found["modes"]]
    np.testing.assert_allclose(np.sort_complex(values), np.sort_complex(np.linalg.eigvals(A)), atol=1e-12)
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "arguments, status, words",
    [
        (("cart_pole", "--from", "F"), 2, "needs --from INPUT and --to OUTPUT"),
        (("cart_pole", "--png", "x.png"), 2, "--png needs --from INPUT"),
        (("cart_pole", "--at", "later"), 2, "none of equilibrium, start and RUN.rrd@TIME"),
        (("cart_pole", "--from", "G", "--to", "x"), 1, "has no input 'G'"),
        (("cart_pole", "--from", "F", "--to", "x", "--frequencies", "a"), 2, "is not a list of frequencies"),
        (("outer_solar_system",), 1, "found no static equilibrium"),
        (("double_pendulum", "--stable", "--mode", "3", "--log", "mode.rrd"), 2, "has 2 modes"),
    ],
)
def test_what_is_wrong_is_said(arguments, status, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = symgen("modes", *arguments)
    assert result.exit_code == status and words in result.output
    assert not list(tmp_path.iterdir())


def test_a_recorded_mode_swings_once_on_the_constraints(tmp_path):
    from symgen.runtime import load as load_module

    file = tmp_path / "mode.rrd"
    text = derive_text(load(find("pendulum_dae"))).text
    system = load_module(text)
    modes = system.modes()
    record_mode(modes.model, modes[0], file, module_text=text, amplitude=0.3)
    recording = read_recording(file)
    assert recording.complete and "0.159155 Hz" in recording.title
    np.testing.assert_allclose(recording.q[0], recording.q[-1], atol=1e-12)
    assert np.abs(np.hypot(*recording.q.T) - 1.0).max() < 1e-12
    assert np.ptp(recording.q[:, 0]) == pytest.approx(0.6, rel=0.1)
    along = np.einsum("ij,ij->i", recording.q, recording.v)
    assert np.abs(along).max() < 1e-12 < np.abs(recording.v).max()


def test_about_a_state_of_a_recording(tmp_path):
    file, found = tmp_path / "run.rrd", tmp_path / "modes.json"
    run = symgen(
        "run", "cart_pole", "--set", "l=0.8", "--set", "F=0.3", "--t-end", "1", "--log", str(file), "--quiet"
    )
    assert run.exit_code == 0, run.output
    result = symgen("modes", "cart_pole", "--at", f"{file}@0.5", "--json", str(found))
    assert result.exit_code == 0 and "moving state at t = 0.5" in result.output
    recording, linear = read_recording(file), json.loads(found.read_text())
    row = int(np.argmin(np.abs(recording.t - linear["t"])))
    assert list(linear["coordinates"].values()) == recording.q[row].tolist()
    assert linear["B"][2] != [1.0]  # of a pole that leans
    assert symgen("modes", "cart_pole", "--at", f"{file}@2").exit_code == 2


def test_a_recorded_state_has_its_inputs(tmp_path):
    push, file, found = tmp_path / "push.csv", tmp_path / "run.rrd", tmp_path / "modes.json"
    push.write_text("0, 0\n1, 8\n")
    run = symgen("run", "cart_pole", "--input", f"F={push}", "--t-end", "1", "--log", str(file), "--quiet")
    assert run.exit_code == 0, run.output
    result = symgen("modes", "cart_pole", "--at", f"{file}@0.5", "--json", str(found))
    assert result.exit_code == 0, result.output
    linear = json.loads(found.read_text())
    system = derive(load(find("cart_pole")))
    state = list(linear["coordinates"].values()), list(linear["rates"].values())
    pushed, free = (system.linearise(state, parameters={"F": F}).A for F in (8.0 * linear["t"], 0.0))
    np.testing.assert_allclose(linear["A"], pushed, rtol=1e-12)
    assert np.abs(pushed - free).max() > 0.1


def test_the_regulator_stands_the_pole_up_from_ten_degrees(tmp_path):
    file = tmp_path / "run.json"
    result = symgen("run", "cart_pole_lqr", "--no-log", "--json", str(file))
    assert result.exit_code == 0, result.output
    end = json.loads(file.read_text())
    assert end["t"] == 8.0
    largest = max(abs(x) for key in ("coordinates", "rates") for x in end[key].values())
    assert largest < 1e-3
    fallen = symgen("run", "cart_pole_lqr", "--no-log", "--set", "F=0", "--t-end", "1", "--json", str(file))
    assert fallen.exit_code == 0 and abs(json.loads(file.read_text())["coordinates"]["theta"]) > 2.0


def test_the_regulator_is_optimal_for_its_weights():
    """The closed loop's Riccati residual is zero, and its eigenvalues are stable."""
    from symgen import runtime
    from symgen.model.library import run_function

    path = find("cart_pole_lqr")
    system = runtime.load(module_for(path).text)
    gains = run_function(path, "regulator", system, {"l": 0.8})
    linear = system.linearise(start={"theta": 0.0}, parameters={"l": 0.8})
    assert linear.A[3, 1] == pytest.approx(1.1 * 9.81 / 0.8)
    closed = linear.A - linear.B @ gains[None]
    assert np.linalg.eigvals(closed).real.max() < -0.5

    def cost(k):
        """Of the worst start, by the Lyapunov equation."""
        from scipy.linalg import solve_continuous_lyapunov

        loop = linear.A - linear.B @ k[None]
        weights = np.diag([1.0, 10.0, 1.0, 1.0]) + 0.1 * np.outer(k, k)
        return np.trace(solve_continuous_lyapunov(loop.T, -weights))

    best = cost(gains)
    for direction in np.eye(4):
        assert min(cost(gains + 0.01 * direction), cost(gains - 0.01 * direction)) > best


@pytest.mark.parametrize(
    "returned, status, words",
    [("{'F': 4.0}", 0, ""), ("7", 1, "'control' returned int"), ("1/0", 1, "ZeroDivisionError")],
)
def test_control_of_a_model_file(returned, status, words, tmp_path):
    path, file = tmp_path / "block.py", tmp_path / "run.json"
    path.write_text(CONTROLLED.replace("RETURNED", returned))
    result = symgen("run", str(path), "--no-log", "--quiet", "--json", str(file))
    assert result.exit_code == status and words in result.output
    if not status:
        assert json.loads(file.read_text())["coordinates"]["x"] == pytest.approx(1.0, rel=1e-9)
        result = symgen("run", str(path), "--no-log", "--quiet", "--set", "F=0", "--json", str(file))
        assert json.loads(file.read_text())["coordinates"]["x"] == 0.0
