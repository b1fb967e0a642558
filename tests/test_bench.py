"""Work-precision benchmarks: references are right, curves are read as drawn, the command measures what it says."""

from __future__ import annotations

import functools
import json
import sys
from dataclasses import replace
from pathlib import Path

import mpmath
import numpy as np
import pytest
from click.testing import CliRunner
from references import load_reference, numbers

from symgen.cli import main
from symgen.link import derive_text
from symgen.model.library import bundled, bundled_folder, find, load
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate.methods import METHODS
from work_precision.auto import auto_result
from work_precision.case import QUICK, Case, Row, measure
from work_precision.peers import find_peers, run_peer
from work_precision.reference import read_reference
from work_precision.report import scene_table
from work_precision.scenes import SCENES, find_scene
from work_precision.sweep import (
    LEVELS,
    Curve,
    all_levels,
    best_at,
    label,
    lost_again,
    seconds_at,
    sweep,
    tolerances,
)

REFERENCES = bundled_folder() / "references"
CORNERS = replace(QUICK, longest_run=0.02, repeat=0.0)


@functools.cache
def case(name: str) -> Case:
    """A scene ready to run, derived once for all tests of this file."""
    from symgen import runtime

    scene = SCENES[name]
    text = derive_text(load(find(scene.model), scene.options)).text
    system = runtime.load(text)
    return Case(scene, system, text, read_reference(REFERENCES, scene, system))


def end(name: str) -> np.ndarray:
    """The end state (q, v) of a reference, read without the code under test."""
    data = json.loads((REFERENCES / f"{name}.json").read_text(encoding="utf-8"))
    return numbers([*data["end"]["q"], *data["end"]["v"]])


@pytest.mark.parametrize("name", SCENES)
def test_scene_has_a_model_and_a_reference_of_more_than_thirteen_digits(name):
    data = json.loads((REFERENCES / f"{name}.json").read_text(encoding="utf-8"))
    assert SCENES[name].model in bundled()
    assert data["error"] < 1e-15
    assert all(len(digits) > 20 for digits in (*data["end"]["q"], *data["end"]["v"]))


def test_every_reference_has_a_scene():
    assert {path.stem for path in REFERENCES.glob("*.json")} <= set(SCENES)


def test_pendulum_reference_is_the_elliptic_function():
    """sin(theta/2) = k cd(omega t, k^2), k = sin(1.5/2): a pendulum released at rest."""
    with mpmath.workdps(30):
        omega = mpmath.sqrt(mpmath.mpf(9.81) / mpmath.mpf(0.5))
        k = mpmath.sin(mpmath.mpf(1.5) / 2)
        cd = mpmath.ellipfun("cd", 100 * omega, m=k**2)
        theta = 2 * mpmath.asin(k * cd)
        data = json.loads((REFERENCES / "pendulum.json").read_text(encoding="utf-8"))
        assert abs(mpmath.mpf(data["end"]["q"][0]) - theta) < 1e-18


PUBLISHED = {
    "double_pendulum": (("double_pendulum", "reference_th_then_rates", "10"), 1e-12),
    "chain_5": (("n_link_pendulum", "reference_th_then_rates", "2.0"), 1e-13),
    "stiff_spring": (("stiff_spring_pendulum", "reference_q_p", "spring_osc_eps1e-3", "10.0"), 1e-11),
    "andrews": (("ivpts_andrews", "reference_tf", "recomputed"), 1e-12),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_reference_agrees_with_published_digits(name):
    """The published ones start from decimal numbers, these from the nearest doubles."""
    ((problem, *keys), limit), actual = PUBLISHED[name], end(name)
    published = numbers(functools.reduce(dict.__getitem__, keys, load_reference(problem)))[: len(actual)]
    assert np.max(np.abs(actual - published) / np.maximum(1.0, np.abs(published))) < limit


def test_free_rigid_body_agrees_with_published_digits():
    published = numbers(load_reference("free_rigid_body")["reference_w_then_quaternion"]["100"])
    np.testing.assert_allclose(end("free_rigid_body"), np.roll(published, 4), rtol=0, atol=1e-14)


def test_level_double_pendulum_is_the_double_pendulum_turned_by_a_right_angle():
    turned = end("double_pendulum_level") + np.array([np.pi / 2, np.pi / 2, 0.0, 0.0])
    np.testing.assert_allclose(turned, end("double_pendulum"), atol=1e-12)


def test_reference_of_other_parameters_is_refused(tmp_path):
    scene = SCENES["pendulum"]
    data = json.loads((REFERENCES / "pendulum.json").read_text(encoding="utf-8"))
    data["parameters"]["g"] = 9.8
    (tmp_path / "pendulum.json").write_text(json.dumps(data))
    with pytest.raises(RuntimeModelError, match="made for other parameters"):
        read_reference(tmp_path, scene, case("pendulum").system)
    with pytest.raises(RuntimeModelError, match="no readable reference"):
        read_reference(tmp_path / "nowhere", scene, case("pendulum").system)


def test_error_is_in_parts_of_the_motion():
    reference = case("pendulum").reference
    assert reference.error(reference.end) == 0.0
    assert reference.error(reference.end + np.array([0.0, 1e-3 * reference.size[1]])) == pytest.approx(1e-3)
    assert reference.error(np.array([np.nan, 0.0])) == np.inf


def rows(*pairs: tuple[float, float]) -> list[Row]:
    """Runs of given (error, seconds)."""
    return [Row(10.0**-k, error, seconds) for k, (error, seconds) in enumerate(pairs)]


def test_levels_lie_on_the_line_between_runs():
    """A method of order 4: the error falls with the fourth power of the run time."""
    curve = rows(*((1e-1 / 2 ** (4 * k), 1e-3 * 2**k) for k in range(6)))
    for level in (1e-2, 1e-3, 1e-6):
        assert seconds_at(curve, level) == pytest.approx(1e-3 * (0.1 / level) ** 0.25)


def test_levels_are_never_extrapolated():
    curve = rows((1e-4, 1.0), (1e-8, 3.0))
    assert seconds_at(curve, 1e-3) == 1.0
    assert seconds_at(curve, 1e-9) is None


def test_a_run_that_has_lost_the_motion_is_no_point_of_a_curve():
    assert seconds_at(rows((50.0, 1e-6), (1e-8, 3.0)), 1e-3) == 3.0
    assert lost_again(rows((2.0, 1.0), (1e-5, 1.0), (4e3, 1.0))) == [1e-2]


def test_best_of_a_level():
    times = {"slow": {"1e-3": 2.0}, "fast": {"1e-3": 1.0}, "never": {"1e-3": None}}
    assert best_at(times, "1e-3") == ("fast", 1.0)
    assert best_at({"never": {"1e-3": None}}, "1e-3") is None


def test_auto_is_timed_by_the_runs_of_what_it_chooses():
    curves = {
        "a": Curve("rtol", rows((1e-1, 1.0), (1e-4, 2.0), (1e-9, 3.0), (1e-12, 4.0))),
        "b": Curve("rtol", rows((1e-2, 5.0), (1e-5, 7.0), (1e-7, 9.0), (1e-10, 11.0))),
    }
    choices = [{"rtol": 10.0**-k, "method": "aabb"[k]} for k in range(4)]
    levels = auto_result(choices, curves)["levels"]
    assert levels["1e-3"] == pytest.approx(2.0 ** (2 / 3))
    # Between the last run of one method and the first of another there is nothing to interpolate.
    assert levels["1e-6"] == pytest.approx(9.0)
    assert levels["1e-9"] == pytest.approx(np.exp(np.interp(9, [7, 10], np.log([9.0, 11.0]))))
    assert levels["1e-12"] is None
    # Choices are made at more tolerances than were run: between two runs of one method, it is that method's time.
    found = auto_result([{"rtol": 10.0**-k, "method": "a"} for k in (0.0, 0.5)], curves)["levels"]["1e-3"]
    assert found is None
    choices = [{"rtol": 10.0**-k, "method": "a"} for k in (0.0, 0.75)]
    assert auto_result(choices, curves)["levels"]["1e-3"] == pytest.approx(2.0 ** (2 / 3))


def test_measured_run_is_that_of_solve():
    """Same end, same steps as the whole `solve` with the same tolerance."""
    pendulum, method = case("pendulum"), METHODS["dop853"]
    row = measure(pendulum, method, 1e-9, CORNERS)
    solution = pendulum.system.run(
        t_end=100.0, start={"theta": 1.5}, method="dop853", rtol=1e-9, atol=1e-9 * 1e-2, fps=1
    )
    end = np.concatenate([solution.q[-1], solution.v[-1]])
    # The state at the end is reached by a step beside the run's own.
    assert row.error == pytest.approx(pendulum.reference.error(end), rel=1e-6)
    assert (row.steps, row.rejected) == (solution.stats["steps"], solution.stats["rejected"])
    assert 1e-13 < row.error < 1e-5
    assert row.rhs >= 12 * row.steps
    assert row.seconds > 0


def test_repeated_runs_start_anew():
    few, many = (
        measure(case("double_pendulum"), METHODS["dop853"], 1e-6, replace(CORNERS, repeat=1.0, most_runs=n))
        for n in (1, 8)
    )
    assert (few.error, few.steps, few.rhs) == (many.error, many.steps, many.rhs)
    assert few.runs < many.runs == 8


def test_error_falls_along_a_sweep_of_tolerances():
    curve = sweep(case("double_pendulum"), "dop853", replace(CORNERS, longest_run=1.0))
    errors = [row.error for row in curve.rows]
    assert curve.quantity == "rtol"
    assert [row.setting for row in curve.rows] == list(tolerances(QUICK.per_decade)[: len(errors)])
    assert errors[-1] < 1e-10 < 1e-4 < max(errors)
    assert all(level is not None for level in list(all_levels(curve.usable()).values())[:3])


def test_sweep_of_steps_has_the_order_of_the_method():
    curve = sweep(case("rough_road"), "rk4", replace(CORNERS, longest_run=1.0))
    errors = np.array([row.error for row in curve.usable() if 1e-11 < row.error < 1e-3])
    assert curve.quantity == "step"
    assert len(errors) >= 4
    assert -np.diff(np.log2(errors)) == pytest.approx(np.full(len(errors) - 1, 4.0), abs=0.4)


def test_method_that_does_not_apply_says_why():
    curve = sweep(case("double_pendulum"), "verlet4", CORNERS)
    assert not curve.rows
    assert "velocit" in curve.says or "mass" in curve.says


def test_run_that_takes_too_long_is_given_up():
    curve = sweep(case("stiff_spring"), "euler", replace(CORNERS, longest_run=1e-4))
    assert "longer than" in curve.says or curve.rows[-1].seconds > 0.5e-4


PEER = """
import json, sys
job = json.load(sys.stdin)
print("a library says hello")
for k, rtol in enumerate(job["tolerances"][:3]):
    row = {"setting": rtol, "error": 10.0 ** (-3 * k - 3), "seconds": 1e-9 * (k + 1), "runs": 1, "rhs": 7}
    print(json.dumps({"method": "oracle", "version": "1.0", "row": row}))
"""


def test_peer_is_measured_in_its_own_process(tmp_path):
    (tmp_path / "oracle_peer.py").write_text(PEER)
    ((name, script),) = find_peers(tmp_path).items()
    ((method, result),) = run_peer(script, case("pendulum"), QUICK)
    assert (name, method, result["version"]) == ("oracle", "oracle", "1.0")
    assert [row["rhs"] for row in result["rows"]] == [7, 7, 7]
    assert result["levels"] == pytest.approx({"1e-3": 1e-9, "1e-6": 2e-9, "1e-9": 3e-9, "1e-12": None})


def test_peer_that_is_not_installed_gives_a_line(tmp_path):
    (tmp_path / "absent_peer.py").write_text("import a_package_that_nobody_has")
    ((method, result),) = run_peer(tmp_path / "absent_peer.py", case("pendulum"), QUICK)
    assert method == "absent"
    assert "a_package_that_nobody_has" in result["says"]
    assert not result["rows"]


def test_scipy_reaches_the_reference_from_the_generated_equations():
    """The peer's own way: the kernel inside Numba, SciPy's DOP853."""
    folder = Path(__file__).resolve().parents[1] / "benchmarks" / "peers"
    effort = replace(QUICK, longest_run=0.5, repeat=0.0, per_decade=1)
    results = dict(run_peer(find_peers(folder)["scipy"], case("chain_5"), effort))
    assert {"scipy DOP853", "scipy Radau", "scipy LSODA"} == set(results)
    assert results["scipy DOP853"]["levels"]["1e-9"] is not None, results["scipy DOP853"]["says"]


def bench(*arguments: str, folder: Path):
    files = ("--json", str(folder / "bench.json"), "--png", str(folder / "bench.png"))
    return CliRunner().invoke(main, ["bench", *arguments, *files])


def test_command_writes_table_json_and_diagram(tmp_path):
    result = bench("chain_5", "--methods", "dop853,verlet4", "--quick", folder=tmp_path)
    assert result.exit_code == 0, result.output
    (scene,) = json.loads((tmp_path / "bench.json").read_text())["scenes"]
    dop853 = scene["methods"]["dop853"]
    assert scene["best"]["1e-9"][0] == "dop853"
    assert all(seconds > 0 for seconds in (*dop853["levels"].values(), dop853["solve_seconds"]) if seconds)
    assert not scene["methods"]["verlet4"]["rows"]
    assert set(scene["auto"]["factors"]) == {label(level) for level in LEVELS}
    assert scene["rhs_seconds"] > 0
    assert "dop853" in scene["stage_overhead_seconds"]
    assert all(line in result.output for line in scene_table(scene))
    assert (tmp_path / "bench.png").read_bytes().startswith(b"\x89PNG")


def test_ctrl_c_keeps_what_was_measured(tmp_path, monkeypatch):
    from work_precision import scene_run

    def interrupted(case, name, effort):
        if name == "rk4":
            raise KeyboardInterrupt
        return sweep(case, name, effort)

    monkeypatch.setattr(scene_run, "sweep", interrupted)
    result = bench("chain_5", "double_pendulum", "--methods", "dop853,rk4", "--quick", folder=tmp_path)
    assert result.exit_code == 130
    (scene,) = json.loads((tmp_path / "bench.json").read_text())["scenes"]
    assert list(scene["methods"]) == ["dop853"]


def test_unknown_scene_and_method_are_refused_with_the_nearest(tmp_path):
    assert "did you mean 'pendulum'" in bench("pendulm", folder=tmp_path).output
    assert "did you mean 'dop853'" in bench("pendulum", "--methods", "dop835", folder=tmp_path).output
    with pytest.raises(RuntimeModelError, match="chain_5"):
        find_scene("chain_6")


def test_scenes_are_listed():
    result = CliRunner().invoke(main, ["bench", "--list"])
    assert all(name in result.output for name in SCENES)


def test_a_wheel_says_where_the_benchmarks_are(tmp_path, monkeypatch):
    monkeypatch.setattr("symgen.cli.bench.__file__", str(tmp_path / "symgen" / "cli" / "bench.py"))
    result = CliRunner().invoke(main, ["bench", "--list"])
    assert result.exit_code == 1
    assert "benchmarks/ of its repository" in result.output and len(result.output.splitlines()) == 1


def test_peers_are_scripts_that_parse():
    """They run in other environments; here only their text is looked at."""
    folder = Path(__file__).resolve().parents[1] / "benchmarks" / "peers"
    peers = find_peers(folder)
    assert {"diffrax", "exudyn", "heyoka", "numbalsoda", "scipy", "sundae"} <= set(peers)
    for script in peers.values():
        compile(script.read_text(encoding="utf-8"), str(script), "exec")
    assert sys.version_info >= (3, 11)
