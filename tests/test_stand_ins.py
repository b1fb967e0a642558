"""Runs begin in code that is made in a hurry, and go over to better code: when, and to the same bits."""

from __future__ import annotations

import gc
import threading
import weakref

import numpy as np
import pytest
from loops import forget_machine_code

from symgen import Model, dot
from symgen.link import derive
from symgen.runtime.code import compiler, drafts, jitted, stand_ins
from symgen.runtime.code.bridge import evaluate_rows


@pytest.fixture
def made(tmp_path, monkeypatch):
    """A machine that has no machine code yet; the list of what is made of long loops and long functions."""
    (tmp_path / "cache").mkdir(mode=0o700)
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "cache"))
    forget_machine_code(monkeypatch)
    made, emit = [], compiler.emit

    def emitted(bitcode, quality):
        if len(bitcode) > jitted._LONG:
            made.append(quality)
        return emit(bitcode, quality)

    def compiled(name):
        function = getattr(compiler, name)

        def noted(ir):
            if "@symgen_rhs" in ir:
                made.append(name)
            return function(ir)

        monkeypatch.setattr(compiler, name, noted)

    monkeypatch.setattr(compiler, "emit", emitted)
    compiled("compile_ir")
    compiled("compile_draft")
    monkeypatch.setattr(drafts, "_WORTH", 0.0)
    monkeypatch.setattr(drafts, "_SECONDS_PER_CHARACTER", 1.0)  # nothing goes over before a test wants it to
    monkeypatch.setattr(stand_ins, "_waiting", [])
    return made


def pay(monkeypatch):
    """Let all that waits go over behind the next call."""
    monkeypatch.setattr(stand_ins, "_spent", stand_ins._spent + 1e9)


def row_of_masses(n=12):
    """n masses between springs: 2 n states, from 17 on in vector code."""
    model = Model("row")
    places = [model.coordinate(f"x{k}", start=0.1 * k * (k % 3)) for k in range(n)]
    stiffness = model.parameter("k", 50.0)
    for left, right in zip([0, *places], [*places, 0]):
        model.potential(stiffness * (right - left) ** 2)
    for x in places:
        model.kinetic(dot(x) ** 2 / 2)
    return derive(model)


def end(system):
    return system.run(0.5, method="dop853", rtol=1e-9).states[-1]


def test_a_short_run_is_in_drafts_and_a_long_one_goes_over_step_by_step_to_the_same_bits(made, monkeypatch):
    system = row_of_masses()
    draft = end(system)
    assert made == ["compile_draft", "draft"]
    pay(monkeypatch)
    scalar = end(system)  # its first call ends in drafts
    assert made[2:] == ["compile_ir", "scalar"]
    pay(monkeypatch)
    vector = end(system)
    assert made[4:] == ["vector"]
    assert not stand_ins.any_waits()
    np.testing.assert_array_equal(scalar, draft)
    np.testing.assert_array_equal(vector, draft)


def test_the_best_code_that_is_there_is_taken_at_once(made, monkeypatch):
    with stand_ins.none():
        best = end(row_of_masses())
    assert made == ["compile_ir", "vector"]
    forget_machine_code(monkeypatch)
    np.testing.assert_array_equal(end(row_of_masses()), best)
    assert made == ["compile_ir", "vector"]
    assert not stand_ins.any_waits()


def test_a_draft_that_is_there_is_not_made_again(made, monkeypatch):
    end(row_of_masses(4))
    forget_machine_code(monkeypatch)
    end(row_of_masses(4))
    assert made == ["compile_draft", "draft"]


def test_asking_for_the_best_code_replaces_what_stands_in(made):
    system = row_of_masses(4)
    draft = end(system)
    with stand_ins.none():
        np.testing.assert_array_equal(end(system), draft)
    assert made == ["compile_draft", "draft", "compile_ir", "scalar"]
    assert not stand_ins.any_waits()


def test_prepared_runs_go_over_between_calls(made, monkeypatch):
    run = row_of_masses().prepare(0.5, method="dop853", rtol=1e-9, output="end")
    first = run()
    assert "scalar" not in made
    pay(monkeypatch)
    np.testing.assert_array_equal(run(), first)
    assert "scalar" in made
    np.testing.assert_array_equal(run(), first)


def test_callers_that_know_the_address_of_a_draft_come_to_the_better_code(made):
    system = row_of_masses(4)
    kernel = system.kernel("rhs")
    y, p = np.linspace(0.1, 0.8, 8), system.parameter_values()
    entry = kernel.precomputed_address
    hoisted = system.precomputed(p)
    before, after = np.zeros((1, kernel.out_size)), np.zeros((1, kernel.out_size))
    evaluate_rows(entry, np.zeros(1), y[None], hoisted, before)
    drafted = kernel(0.0, y, p)
    assert made == ["compile_draft"]
    assert kernel.address  # whoever takes it calls from machine code, and nobody counts that
    assert made == ["compile_draft", "compile_ir"]
    evaluate_rows(entry, np.zeros(1), y[None], hoisted, after)
    np.testing.assert_array_equal(before, after)
    np.testing.assert_array_equal(kernel(0.0, y, p), drafted)
    np.testing.assert_array_equal(before[0], drafted)


def test_calls_from_python_count(made, monkeypatch):
    system = row_of_masses(4)
    kernel = system.kernel("rhs")
    y, p = np.linspace(0.1, 0.8, 8), system.parameter_values()
    first = kernel(0.0, y, p)
    pay(monkeypatch)
    np.testing.assert_array_equal(kernel(0.0, y, p), first)
    assert made == ["compile_draft", "compile_ir"]


def test_a_run_goes_on_in_a_draft_where_better_code_cannot_be_made(made, monkeypatch):
    system = row_of_masses(4)
    first = end(system)

    def fail(*_):
        raise RuntimeError("no such pass")

    monkeypatch.setattr(compiler, "compile_ir", fail)
    monkeypatch.setattr(compiler, "emit", fail)
    pay(monkeypatch)
    with pytest.warns(RuntimeWarning, match="no such pass"):
        np.testing.assert_array_equal(end(system), first)
    np.testing.assert_array_equal(end(system), first)


def test_threads_that_go_over_at_once_make_the_code_once(made):
    kernel = row_of_masses(4).kernel("rhs")
    threads = [threading.Thread(target=kernel.settle) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert made == ["compile_draft", "compile_ir"]


def test_what_waits_does_not_keep_a_model_alive(made):
    system = row_of_masses(4)
    kernel = system.kernel("rhs")
    held = weakref.ref(kernel)
    del system, kernel
    gc.collect()
    assert held() is None
