"""Large models begin in scalar code of the step loops and go over to vector code: when, and to the same bits."""

from __future__ import annotations

import numpy as np
import pytest
from loops import forget_machine_code

from symgen import Model, dot
from symgen.link import derive
from symgen.runtime.code import compiler, jitted, stand_ins


@pytest.fixture
def emitted(tmp_path, monkeypatch):
    """A machine that has no machine code yet; the list of what is made of long loops: True for vector code."""
    (tmp_path / "cache").mkdir(mode=0o700)
    monkeypatch.setenv("SYMGEN_CACHE_DIR", str(tmp_path / "cache"))
    forget_machine_code(monkeypatch)
    made, emit = [], compiler.emit

    def noted(bitcode, *, vectorised):
        if len(bitcode) > jitted._LONG:
            made.append(vectorised)
        return emit(bitcode, vectorised=vectorised)

    monkeypatch.setattr(compiler, "emit", noted)
    monkeypatch.setattr(stand_ins, "_spent", 0.0)
    return made


def row_of_masses(n=12):
    """n masses between springs: 2 n states."""
    model = Model("row")
    places = [model.coordinate(f"x{k}", start=0.1 * k * (k % 3)) for k in range(n)]
    for left, right in zip([0, *places], [*places, 0]):
        model.potential(50 * (right - left) ** 2)
    for x in places:
        model.kinetic(dot(x) ** 2 / 2)
    return derive(model)


def end(system):
    return system.run(0.5, method="dop853", rtol=1e-9).states[-1]


def test_a_short_run_makes_no_vector_code_and_a_long_one_goes_over_to_the_same_bits(emitted, monkeypatch):
    system = row_of_masses()
    scalar = end(system)
    assert emitted == [False]
    monkeypatch.setattr(stand_ins, "_PATIENCE", 0.0)
    going_over = end(system)  # its first call ends in scalar code
    assert emitted == [False, True]
    vector = end(system)
    assert emitted == [False, True]
    np.testing.assert_array_equal(going_over, scalar)
    np.testing.assert_array_equal(vector, scalar)


def test_vector_code_that_is_there_is_taken_at_once(emitted, monkeypatch):
    system = row_of_masses()
    with stand_ins.none():
        end(system)
    assert emitted == [True]
    forget_machine_code(monkeypatch)
    end(row_of_masses())
    assert emitted == [True]
    assert not stand_ins.any_waits()


def test_prepared_runs_go_over_between_calls(emitted, monkeypatch):
    run = row_of_masses().prepare(0.5, method="dop853", rtol=1e-9, output="end")
    scalar = run()
    assert True not in emitted
    monkeypatch.setattr(stand_ins, "_PATIENCE", 0.0)
    np.testing.assert_array_equal(run(), scalar)
    assert True in emitted
    np.testing.assert_array_equal(run(), scalar)
