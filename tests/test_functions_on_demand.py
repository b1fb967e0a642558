"""Functions that few runs call are derived when a run asks for them, and nothing else about a run changes."""

from __future__ import annotations

import pickle
import re

import numpy as np
import pytest

import symgen
from symgen import link, runtime
from symgen.model import library
from symgen.runtime.errors import ModuleError
from symgen.runtime.explain import savings
from symgen.runtime.graph.layouts import LATE
from symgen.runtime.module import read_module
from symgen.runtime.recording.reader import read_recording

# Equations by lifting, with constraints, of springs alone, of a platform on six legs, and with corners that touch.
MODELS = {
    "n_pendulum": {"N": "20"},
    "chain_absolute": {"N": "7"},
    "spring_chain": {"N": "24"},
    "stewart_platform": {},
    "die": {},
}
LARGE = next(iter(MODELS.items()))


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    """Files are looked up in a cache in which no other test has derived them in full."""
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "cache"))


def _model(name: str, options: dict[str, str]) -> symgen.Model:
    return library.load(library.find(name), options)


@pytest.fixture(scope="module")
def pair():
    """A large model with functions left out, and with all of them."""
    part = _model(*LARGE).derive()
    assert part.source.late == LATE[:1]
    return part, runtime.load(link.derive_text(_model(*LARGE)).text)


@pytest.mark.parametrize("name", MODELS)
def test_the_functions_that_stay_are_the_same(name):
    found = [link.derive_text(_model(name, MODELS[name]), "x", on_demand=part) for part in (True, False)]
    assert found[0].is_part and not found[1].is_part
    part, whole = (read_module(made.text) for made in found)
    assert set(whole.functions) - set(part.functions) == set(LATE) & set(whole.functions) == set(part.late)
    for function in part.functions:
        assert _with_tables(part, function) == _with_tables(whole, function)


def test_a_start_in_balance_has_all_derived_at_once():
    """It is solved for with `residual_jacobian`, so that nothing would be gained by deriving that later."""
    for model, is_part in (
        (_model("spring_chain", {"N": "24"}), True),
        (_model("spring_chain", {"N": "24"}), False),
    ):
        if not is_part:
            model.start(steady=True)
        assert link.derive_text(model, on_demand=True).is_part == is_part


def _with_tables(source, function: str) -> str:
    """The text of a function with what its index tables hold in the place of their names."""
    return re.sub(r"\bI\d+\b", lambda found: repr(source.tables[found.group()]), source.functions[function])


def test_a_run_that_does_not_call_them_does_not_derive_them(pair):
    part, whole = _model(*LARGE).derive(), pair[1]
    solution, expected = (system.run(0.3, method="dop853") for system in (part, whole))
    assert all(check.ok for check in solution.health)
    assert not part.source.is_whole
    assert "functions not derived" in {saving.what for saving in savings(solution)}
    np.testing.assert_array_equal(solution.states, expected.states)
    assert [check.value for check in solution.health] == [check.value for check in expected.health]


@pytest.mark.parametrize("method", ["radau5", "bdf", "auto"])
def test_a_run_that_calls_them_is_the_same(pair, method):
    part, whole = pair
    solution, expected = (system.run(0.1, method=method) for system in (part, whole))
    np.testing.assert_array_equal(solution.states, expected.states)
    assert solution.stats == expected.stats
    assert [check.value for check in solution.health] == [check.value for check in expected.health]


def test_models_with_stops_leave_those_of_both_forms_out():
    model = _model("die", {})
    part, whole = link.derive(model), runtime.load(link.derive_text(model).text)
    assert part.source.late == LATE and part.closed.source.late == LATE[:1]
    solution, expected = (system.run(0.4, method="dop853") for system in (part, whole))
    assert solution.events and not part.source.is_whole and not part.closed.source.is_whole
    np.testing.assert_array_equal(solution.states, expected.states)
    solution, expected = (system.run(0.4, method="radau5") for system in (part, whole))
    assert solution.stats["jacobians"] and part.source.is_whole
    np.testing.assert_array_equal(solution.states, expected.states)
    assert pickle.loads(pickle.dumps(part.closed)).source.late == ()


def test_inputs_over_time_act_on_what_is_derived_late():
    model = _model(*LARGE)
    model.input("push", unit="N*m")
    model.force("theta1", "push*sin(theta1)")
    part, whole = model.derive(), runtime.load(link.derive_text(model).text)
    options = {"method": "radau5", "inputs": {"push": ([0.0, 0.1, 0.2], [0.0, 5.0, -3.0])}}
    assert part.source.late == LATE[:1]
    solution, expected = (system.run(0.2, **options) for system in (part, whole))
    np.testing.assert_array_equal(solution.states, expected.states)


def test_linear_analysis_asks_for_them(pair):
    part, whole = pair
    found, expected = (
        system.modes(start={f"theta{k}": 0.0 for k in range(1, 21)}) for system in (part, whole)
    )
    np.testing.assert_array_equal(found.eigenvalues, expected.eigenvalues)


def test_what_leaves_the_process_has_all(tmp_path):
    system = _model(*LARGE).derive()
    again = pickle.loads(pickle.dumps(system))
    assert again.source.late == () and again.has(*LATE[:1])
    solution = _model(*LARGE).derive().run(0.1, method="dop853")
    solution.save(tmp_path / "run.rrd")
    recorded = read_module(read_recording(tmp_path / "run.rrd").module_text + "\n")
    assert recorded.late == () and set(LATE[:1]) <= set(recorded.functions)


def test_small_models_and_methods_that_call_them_have_all():
    small = library.find("double_pendulum")
    assert not link.derive_file(small, on_demand=True).is_part
    model = _model(*LARGE)
    model.run(method="radau5")
    assert not link.derive_text(model, on_demand=True).is_part
    assert link.derive_text(_model(*LARGE), on_demand=True).is_part
    assert not link.derive_text(_model(*LARGE)).is_part


def test_a_file_is_found_in_the_cache_in_part_and_in_full():
    path, options = library.find("n_pendulum"), {"N": "21"}
    first = link.module_for(path, options, on_demand=True)
    second = link.module_for(path, options, on_demand=True)
    assert first.derived and not second.derived and first.text == second.text
    assert read_module(first.text).late == LATE[:1]
    whole = link.module_for(path, options)
    assert whole.derived and read_module(whole.text).late == ()
    assert link.module_for(path, options, on_demand=True).text == whole.text


def test_a_file_that_has_changed_is_refused(tmp_path):
    path = tmp_path / "chain.py"
    text = library.find("n_pendulum").read_text()
    path.write_text(text.replace("N=5", "N=20"))
    system = symgen.load(path)
    path.write_text(text.replace("N=5", "N=21"))
    with pytest.raises(ModuleError, match="has changed since it was loaded; load the model again"):
        system.run(0.1, method="radau5")


def test_a_file_is_found_from_another_working_folder(tmp_path, monkeypatch):
    (tmp_path / "chain.py").write_text(library.find("n_pendulum").read_text().replace("N=5", "N=20"))
    monkeypatch.chdir(tmp_path)
    system = symgen.load("chain.py")
    assert system.source.late
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert system.run(0.05, method="radau5").status == "success"


def test_what_was_run_is_not_lost_with_the_file(tmp_path):
    """Who asks for what cannot be had is told why; a result is kept, and goes on with methods that need no more."""
    path = tmp_path / "chain.py"
    path.write_text(library.find("n_pendulum").read_text().replace("N=5", "N=20"))
    system = symgen.load(path)
    run = system.run(0.05, method="dop853")
    path.unlink()
    says = "residual_jacobian .*cannot be: .*chain.py.*No such file.*put its file back"
    with pytest.raises(ModuleError, match=says):
        system.run(0.05, method="radau5")
    run.save(tmp_path / "run.rrd")
    text = read_recording(tmp_path / "run.rrd").module_text + "\n"
    for again in (runtime.load(text), pickle.loads(pickle.dumps(system))):
        np.testing.assert_array_equal(again.run(0.05, method="dop853").states, run.states)
        with pytest.raises(ModuleError, match="was written without residual_jacobian"):
            again.run(0.05, method="radau5")


def test_a_module_without_them_says_so(pair):
    text = link.derive_text(_model(*LARGE), on_demand=True).text
    alone = runtime.load(text)
    assert alone.run(0.1, method="dop853").status == "success"
    with pytest.raises(ModuleError, match="was written without residual_jacobian"):
        alone.run(0.1, method="radau5")
    with pytest.raises(ModuleError, match=r"'late' is .*, expected some of residual_jacobian"):
        runtime.load(text.replace('"late": [\n        "residual_jacobian"', '"late": [\n        "rhs"'))
