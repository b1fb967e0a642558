"""Scenes with constraints: multipliers of the references, and the equations that solvers of DAEs get."""

from __future__ import annotations

import functools
import importlib
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from symgen import runtime
from symgen.link import derive_text
from symgen.model.library import bundled_folder, find, load
from symgen.runtime.integrate.methods import METHODS
from work_precision.case import QUICK, Case, measure
from work_precision.peers import find_peers, run_peer
from work_precision.reference import read_reference
from work_precision.scenes import SCENES

CONSTRAINED = (
    "slider_crank",
    "andrews",
    "four_bar",
    "car_axis",
    "heavy_top_absolute",
    "n_four_bar",
    "bricard",
)
PEERS = Path(__file__).resolve().parents[1] / "benchmarks" / "peers"


@functools.cache
def case(name: str) -> Case:
    """A scene ready to run."""
    scene = SCENES[name]
    text = derive_text(load(find(scene.model), scene.options)).text
    system = runtime.load(text)
    return Case(scene, system, text, read_reference(bundled_folder() / "references", scene, system))


def kernels(name: str) -> SimpleNamespace:
    """The matrices of a scene at its end, from kernels that the references of multipliers do not need."""
    scene = case(name)
    system, end, p, t = scene.system, scene.reference.end, scene.reference.p, scene.scene.t_end
    return SimpleNamespace(
        mass=system.kernel("mass_matrix")(t, end, p).reshape(system.nv, system.nv),
        forces=system.kernel("forces")(t, end, p),
        gradients=system.kernel("constraint_jacobian")(t, end, p).reshape(system.m, system.nv),
        gamma=system.kernel("gamma")(t, end, p),
        residual=system.kernel("constraint_residual")(t, end, p),
    )


@pytest.mark.parametrize("name", CONSTRAINED)
def test_reference_is_on_the_constraints_and_its_multipliers_balance_the_forces(name):
    k, reference = kernels(name), case(name).reference
    np.testing.assert_allclose(k.residual, 0.0, atol=1e-13 * reference.size.max())
    # Accelerations that the constraints allow, and the multipliers of least norm: least squares by singular values.
    n = len(k.mass)
    kkt = np.block([[k.mass, -k.gradients.T], [k.gradients, np.zeros((len(k.gamma), len(k.gamma)))]])
    solution = np.linalg.lstsq(kkt, np.concatenate([k.forces, k.gamma]), rcond=1e-9)[0]
    np.testing.assert_allclose(
        reference.multipliers, solution[n:], rtol=0, atol=1e-9 * reference.largest_multiplier
    )


def test_equal_windows_turn_as_one_body():
    """The rockers are parallel, and energy gives their rate: (n + 1) rods about their ends, n couplers."""
    end, n, g = case("n_four_bar").reference.end, 10, 9.81
    angles, rates = end[: 2 * n + 1], end[2 * n + 1 :]
    rocker = [0, *range(1, 2 * n + 1, 2)]
    np.testing.assert_allclose(angles[rocker], angles[0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(angles[2::2], 0.0, atol=1e-15)
    weight = g * ((n + 1) / 2 + n)
    rate = math.sqrt(2 * weight * (math.sin(-0.6) - math.sin(angles[0])) / ((n + 1) / 3 + n))
    np.testing.assert_allclose(np.abs(rates[rocker]), rate, rtol=1e-13)


def test_measured_runs_compare_their_multipliers():
    row = measure(case("car_axis"), METHODS["dop853"], 1e-10, QUICK)
    assert row.error < 1e-8
    assert row.multiplier_error < 1e-7
    coarse = measure(case("car_axis"), METHODS["dop853"], 1e-3, QUICK)
    assert coarse.multiplier_error > 1e3 * row.multiplier_error


def test_traced_residual_is_that_of_the_compiled_kernel(monkeypatch):
    monkeypatch.syspath_prepend(PEERS)
    traced = importlib.import_module("traced")
    scene = case("slider_crank")
    system = scene.system
    state = np.random.default_rng(1).normal(size=system.nq + 2 * system.nv + system.m)
    job = SimpleNamespace(text=scene.text, p=scene.reference.p, system=system)
    functions = {name: getattr(math, name) for name in traced.FUNCTIONS}
    found = traced.called(job, "residual", functions, 0.0, state, system.nv + system.m)
    np.testing.assert_allclose(found, system.kernel("residual")(0.0, state, scene.reference.p), rtol=1e-13)


@pytest.mark.parametrize(
    ("peer", "package", "scene"),
    [
        pytest.param("ida", "sksundae", "heavy_top_absolute", marks=pytest.mark.slow),
        ("casadi", "casadi", "heavy_top_absolute"),
        pytest.param("scipy_dae", "scipy_dae", "car_axis", marks=pytest.mark.slow),
    ],
)
def test_solver_of_daes_integrates_the_same_motion(peer, package, scene):
    pytest.importorskip(package)
    effort = replace(QUICK, longest_run=1.0, repeat=0.0)
    results = dict(run_peer(find_peers(PEERS)[peer], case(scene), effort))
    assert results
    for result in results.values():
        errors = [row["error"] for row in result["rows"] if row["error"] is not None]
        assert min(errors) < 0.5 and errors[-1] <= errors[0]
