"""Peers of `symgen bench`: they integrate the same motion, and an absent one costs a line."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from symgen.link import derive_text
from symgen.model.library import bundled_folder, find, load
from symgen.runtime import load as load_system
from work_precision.case import QUICK, Case, Effort
from work_precision.peers import find_peers, run_peer
from work_precision.reference import read_reference
from work_precision.scenes import SCENES

FOLDER = Path(__file__).resolve().parents[1] / "benchmarks" / "peers"
EFFORT = replace(QUICK, repeat=0.0)
LONGER = replace(EFFORT, longest_run=1.0)
PACKAGES = {"exudyn": "exudyn", "diffrax": "diffrax"}


@functools.cache
def case(name: str) -> Case:
    """A scene ready to run."""
    scene = SCENES[name]
    text = derive_text(load(find(scene.model), scene.options)).text
    system = load_system(text)
    return Case(scene, system, text, read_reference(bundled_folder() / "references", scene, system))


@functools.cache
def measured(peer: str, scene: str, effort: Effort = EFFORT) -> dict:
    """What a peer sends about a scene, by method."""
    pytest.importorskip(PACKAGES[peer])
    return dict(run_peer(find_peers(FOLDER)[peer], case(scene), effort))


def errors(result: dict) -> np.ndarray:
    return np.array([row["error"] for row in result["rows"] if row["error"] is not None])


@pytest.fixture
def traced(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    return importlib.import_module("traced")


@pytest.fixture
def scripts(monkeypatch):
    """Import a script of the peers; what it compiles with Numba stays plain Python, which is quicker here."""
    monkeypatch.setattr(
        "symgen.runtime.code.numba_setup.DISABLE_JIT", True
    )  # first: it reads the other when imported
    monkeypatch.setattr("numba.config.DISABLE_JIT", True)
    monkeypatch.syspath_prepend(FOLDER)
    return importlib.import_module


def job_of(name: str) -> SimpleNamespace:
    """What a peer knows of a scene."""
    scene = case(name)
    known = scene.reference
    return SimpleNamespace(
        system=scene.system,
        p=known.p,
        start=known.start,
        end=known.end,
        n=len(known.start),
        t_end=scene.scene.t_end,
    )


@pytest.mark.parametrize("name", ["slider_crank", "chain_5"])
def test_traced_equations_are_those_of_the_compiled_kernel(traced, name):
    scene = case(name)
    p, y, n = scene.reference.p, scene.reference.start, len(scene.reference.start)
    row = np.empty(scene.system.n_row)
    scene.system.numba("rhs")(0.3, np.append(y, 0.0), p, row)
    functions = {name: getattr(math, name) for name in ("sin", "cos")}
    functions |= {"select": lambda c, a, b: a if c else b, "lt": lambda a, b: a < b}
    job = SimpleNamespace(text=scene.text, p=p, n=n, system=scene.system)
    actual = traced.derivative(job, functions)(0.3, y.tolist())
    np.testing.assert_allclose(actual, row[:n], rtol=1e-12, atol=1e-12)


def test_a_selection_becomes_a_function_of_symbols(traced):
    """A symbol has no truth value, so Python may not choose."""
    text = "\n".join(
        (
            "from numba import njit",
            "@njit",
            "def rhs(t, y, p, out):",
            "    out[0] = (y[0] if y[0] < 1.0 else p[0])",
            "    out[1] = (t if y[1] <= p[0] else (y[0] if t < y[1] else 0.0))",
        )
    )
    functions = {name: functools.partial(lambda *parts: parts, name) for name in ("select", "lt", "lte")}
    job = SimpleNamespace(text=text, p=[2.0], n=2, system=SimpleNamespace(n_row=3))
    first, second = traced.derivative(job, functions)("t", ["a", "b"])
    assert first == ("select", ("lt", "a", 1.0), "a", 2.0)
    assert second == ("select", ("lte", "b", 2.0), "t", ("select", ("lt", "t", "b"), "a", 0.0))


@pytest.mark.parametrize("peer", PACKAGES)
def test_absent_peer_is_a_line(peer):
    if importlib.util.find_spec(PACKAGES[peer]) is not None:
        pytest.skip("installed")
    ((method, result),) = run_peer(find_peers(FOLDER)[peer], case("chain_5"), EFFORT)
    assert (method, result["rows"]) == (peer, [])
    assert PACKAGES[peer] in result["says"]


@pytest.mark.parametrize("scene", ["double_pendulum", "double_pendulum_level", "chain_5", "heavy_top"])
def test_exudyn_has_the_same_motion_in_minimal_coordinates(scene):
    results = measured("exudyn", scene)
    assert {"exudyn DOPRI5", "exudyn RK67", "exudyn GeneralizedAlpha"} == set(results)
    for method in ("exudyn DOPRI5", "exudyn RK67"):
        assert errors(results[method]).min() < 1e-6, results[method]["says"]


@pytest.mark.parametrize(
    ("scene", "method"),
    [
        ("slider_crank", "GeneralizedAlpha"),
        ("slider_crank", "TrapezoidalIndex2"),
        ("damped_spring", "GeneralizedAlpha"),
    ],
)
def test_exudyn_converges_to_the_reference_with_the_order_of_its_method(scene, method):
    """Twice as many steps, a quarter of the error: only where both have the same limit."""
    found = errors(measured("exudyn", scene, LONGER)[f"exudyn {method}"])
    found = found[(found < 0.2) & (found > 1e-6)]
    assert len(found) >= 2
    assert found[-2] / found[-1] == pytest.approx(4.0, rel=0.3)


@pytest.mark.parametrize(
    ("scene", "steps", "methods"),
    [
        ("four_bar", 6000, ("TrapezoidalIndex2", "GeneralizedAlpha")),
        ("n_four_bar", 300, ("TrapezoidalIndex2", "GeneralizedAlpha")),
        ("heavy_top_absolute", 4000, ("TrapezoidalIndex2", "GeneralizedAlpha")),
        ("andrews", 700, ("TrapezoidalIndex2", "GeneralizedAlpha")),
        ("car_axis", 2000, ("TrapezoidalIndex2", "GeneralizedAlpha")),
        ("bricard", 500, ("GeneralizedAlpha",)),
    ],
)
def test_exudyn_has_the_same_mechanism(scripts, scene, steps, methods):
    """The end states of steps h and h/2, without their errors in h², are that of the reference."""
    pytest.importorskip("exudyn")
    peer, job = scripts("exudyn_peer"), job_of(scene)
    model = scripts("exudyn_models").build(job)
    for method in methods:
        coarse, fine = (
            peer.integrate(model, method, peer.settings(model, job.t_end, count))[0]
            for count in (steps, 2 * steps)
        )
        error = case(scene).reference.error
        assert error(coarse) / error(fine) == pytest.approx(4.0, rel=0.1)
        assert error((4.0 * fine - coarse) / 3.0) < 3e-4


def test_exudyn_says_which_scenes_it_has_no_model_of():
    ((_, result),) = measured("exudyn", "rough_road").items()
    assert not result["rows"]
    assert "no model" in result["says"]


def test_diffrax_reaches_the_reference_from_the_generated_equations():
    results = measured("diffrax", "double_pendulum")
    assert {"diffrax Dopri8", "diffrax Tsit5"} == set(results)
    assert errors(results["diffrax Dopri8"]).min() < 1e-7, results["diffrax Dopri8"]["says"]
    assert errors(results["diffrax Tsit5"]).min() < 1e-4, results["diffrax Tsit5"]["says"]


def test_implicit_form_has_the_derivatives_of_its_residual(scripts):
    implicit = scripts("implicit")
    equations = implicit.index_1(job_of("four_bar"))
    n = len(equations.start)
    rng = np.random.default_rng(3)
    y, slope = equations.start + 0.1 * rng.normal(size=n), equations.slope + rng.normal(size=n)
    exact, by_differences = np.empty((n, n)), np.empty((n, n))
    equations.jacobian(0.0, y, slope, 3.0, exact)
    implicit._differences(equations.residual)(0.0, y, slope, 3.0, by_differences)
    np.testing.assert_allclose(by_differences, exact, rtol=1e-5, atol=1e-5 * np.abs(exact).max())
    tolerances = equations.tolerances(1e-8)
    assert np.all(tolerances[:6] == 1e-8) and np.all(tolerances[6:] > 1.0)  # multipliers are not tested


def test_redundant_constraint_is_left_out_of_the_implicit_forms(scripts):
    """What is left has full rank along the whole motion, which two other choices of four rows have not."""
    implicit, job = scripts("implicit"), job_of("bricard")
    equations = implicit.ggl(job)
    out = np.empty(len(equations.start))
    equations.residual(0.0, equations.start, equations.slope, out)
    np.testing.assert_allclose(out, 0.0, atol=1e-12)
    rows, _, multipliers = implicit.start_of(job)
    assert len(rows) == len(multipliers) == job.system.m - 1
    assert set(range(job.system.m)) - set(rows.tolist()) <= {0, 3, 4}
    assert len(out) == job.n + 2 * len(rows)


def test_sweep_ends_where_a_run_takes_too_long_after_one_that_did_not(scripts, capsys):
    job = scripts("job")
    tried, settings = [], [1e-2, 1e-3, 1e-4, 1e-5, 1e-6]

    def prepare(rtol, atol):
        tried.append(rtol)
        if rtol in (settings[0], settings[3]):
            raise job.TooLong(2.0)
        if rtol == settings[1]:
            raise RuntimeError("no step")
        return lambda: (None, 0), lambda: None

    effort = {"longest_run": 2.0, "repeat": 0.0, "most_runs": 1}
    given = SimpleNamespace(tolerances=np.array(settings), atol_ratio=0.1, effort=effort, error=lambda _: 0.1)
    job.sweep(given, "method", "1.0", prepare)
    assert tried == settings[:4]
    assert "takes longer than 2 s" in capsys.readouterr().out.splitlines()[-1]


def test_peers_may_run_longer_than_what_they_are_compared_with():
    from symgen.cli.bench import _Bench

    assert _Bench(QUICK, None, True, 2.0).peer_effort == replace(QUICK, longest_run=2.0)
    assert _Bench(QUICK, None, True, None).peer_effort == QUICK
