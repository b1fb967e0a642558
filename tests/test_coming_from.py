"""docs/coming-from.md: mechanisms here, in SymPy, PyDy and MuJoCo have the same accelerations and motions."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from symgen import Model

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "coming-from.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", PAGE, re.DOTALL | re.MULTILINE))
NAMES = ("Pendulum", "Slider-crank", "Arm")


def programs(section: str, language: str) -> dict[str, str]:
    """The blocks of a section by their headings; what stands before the first heading is called ""."""
    parts = re.split(r"^### (.+)$", SECTIONS[section], flags=re.MULTILINE)
    pairs = zip(["", *parts[1::2]], parts[::2])
    return {name: "\n".join(re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)) for name, text in pairs}


MODELS = {name: text for name, text in programs("Here", "toml").items() if name}


def run_programs(*sections: str) -> dict:
    names: dict = {}
    for section in sections:
        for program in programs(section, "python").values():
            exec(compile(program, "coming-from.md", "exec"), names)
    return names


def test_each_program_shows_all_three():
    assert tuple(MODELS) == NAMES
    for section, language in (("SymPy mechanics", "python"), ("MuJoCo", "xml"), ("Modelica", "modelica")):
        found = programs(section, language)
        assert all(found[name].strip() for name in NAMES), section


@pytest.mark.parametrize("name", NAMES)
def test_models_run(name):
    solution = Model.from_toml(MODELS[name]).derive().run(0.5)
    assert solution.ok, [entry.says for entry in solution.objections]


@pytest.mark.parametrize("name", NAMES)
def test_sympy_has_the_same_accelerations(name):
    """Of states on the way, which satisfy the constraints."""
    names = run_programs("SymPy mechanics")
    key = name.lower().replace("-", "_")
    theirs = names["right_hand_side"](names[key], names[f"{key}_constants"])
    system = Model.from_toml(MODELS[name]).derive()
    run = system.run(0.3, rtol=1e-11)
    for y in run.states[:: len(run.t) // 7]:
        mine = system.kernel("rhs")(0.0, y, run.p)[: 2 * system.nv]
        np.testing.assert_allclose(
            theirs(y[: 2 * system.nv]), mine, rtol=1e-9, atol=1e-9 * np.abs(mine).max()
        )
    taken_over = Model.from_sympy(key, names[key], parameters=names[f"{key}_constants"]).derive()
    found = taken_over.kernel("rhs")(0.0, run.states[-1], taken_over.parameter_values())[: 2 * system.nv]
    mine = system.kernel("rhs")(0.0, run.states[-1], run.p)[: 2 * system.nv]
    np.testing.assert_allclose(found, mine, rtol=1e-9, atol=1e-9)


def test_pydy_has_the_same_motion(tmp_path, monkeypatch):
    pytest.importorskip("pydy")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slider_crank.toml").write_text(MODELS["Slider-crank"], encoding="utf-8")
    names = run_programs("SymPy mechanics", "PyDy")
    for name, motion in zip(NAMES, names["motions"]):
        system = Model.from_toml(MODELS[name]).derive()
        run = system.run("0.5 s", t_eval=names["times"])
        error = np.abs(motion[-1, : system.nq] - run.q[-1]).max()
        assert error < 1e-4, (name, error)  # odeint at its own tolerances, and a loop that drifts
        assert np.abs(motion[-1, : system.nq] - motion[0, : system.nq]).max() > 0.01


def test_scipy_integrates_the_equations(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.toml").write_text(MODELS["Arm"], encoding="utf-8")
    found = run_programs("SciPy")["found"]
    ours = Model.from_toml(MODELS["Arm"]).derive().run(1.0, inputs={"tau": 0.2}, rtol=1e-11)
    np.testing.assert_allclose(found.y[:, -1], ours.states[-1][:4], atol=1e-6)
    assert found.njev > 0


@pytest.mark.parametrize("name", ["Pendulum", "Arm"])
def test_mujoco_has_the_same_accelerations(name):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(programs("MuJoCo", "xml")[name])
    data, system = mujoco.MjData(model), Model.from_toml(MODELS[name]).derive()
    given = {"tau": 0.7} if name == "Arm" else {}
    p = system.parameter_values(given)
    for y in np.random.default_rng(1).uniform(-1, 1, (5, 2 * system.nv)):
        data.qpos[:], data.qvel[:], data.ctrl[:] = y[: system.nv], y[system.nv :], list(given.values())
        mujoco.mj_forward(model, data)
        mine = system.kernel("rhs")(0.0, y, p)[system.nv : 2 * system.nv]
        np.testing.assert_allclose(data.qacc, mine, rtol=1e-9, atol=1e-9)


def test_mujoco_closes_the_loop_softly():
    """From rest, with a torque on the crank: a soft constraint gives the same to a thousandth."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(programs("MuJoCo", "xml")["Slider-crank"])
    data, system = mujoco.MjData(model), Model.from_toml(MODELS["Slider-crank"]).derive()
    start = system.run(0.01, rate={"theta": 0.0}).states[0]
    theta, phi, x = start[:3]
    data.qpos[:], data.qvel[:] = (theta, phi - theta, x - 0.4), 0.0
    data.qfrc_applied[:] = (1.0, 0.0, 0.0)
    mujoco.mj_forward(model, data)
    p = system.parameter_values()
    rest = np.concatenate([start[:3], np.zeros(3)])
    M, G = (system.kernel(f)(0.0, rest, p) for f in ("mass_matrix", "constraint_jacobian"))
    kkt = np.block([[M.reshape(3, 3), G.reshape(2, 3).T], [G.reshape(2, 3), np.zeros((2, 2))]])
    a = np.linalg.solve(kkt, [1.0, 0.0, 0.0, 0.0, 0.0])[:3]
    np.testing.assert_allclose(data.qacc, [a[0], a[1] - a[0], a[2]], rtol=1e-3)
