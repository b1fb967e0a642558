"""Recordings are written beside the run: in order, and what goes wrong is not lost."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from symgen.runtime import System, load
from symgen.runtime import system as data
from symgen.runtime.code import bridge
from symgen.runtime.recording.recorder import BackgroundWork

GENERATED = Path(__file__).resolve().parents[1] / "generated"


def test_pieces_are_done_one_after_another():
    work, gate, done = BackgroundWork(), threading.Event(), []

    def slow(number: int) -> None:
        gate.wait(60)
        done.append(number)

    work.start(slow, 1)
    assert work.busy and not done
    gate.set()
    work.start(done.append, 2)
    work.wait()
    assert done == [1, 2] and not work.busy


def test_an_error_comes_out_once_where_it_is_waited_for():
    work = BackgroundWork()

    def fail() -> None:
        raise OSError("no space left")

    work.start(fail)
    while work.busy:
        pass
    assert work.failed
    with pytest.raises(OSError, match="no space left"):
        work.start(print, "never")
    work.wait()
    assert not work.failed


def test_a_run_and_its_recording_may_ask_for_the_same_kernels_at_once(monkeypatch):
    source = load(GENERATED / "seven_dof_arm.py").source
    assert source.header["hoisted"]
    made, compile_setup = [], data.compile_setup

    def slowly(sources):
        made.append(sources)
        time.sleep(0.02)
        return compile_setup(sources)

    monkeypatch.setattr(data, "compile_setup", slowly)
    system, gate = System(source), threading.Barrier(4)
    results, errors = [], []

    def work() -> None:
        gate.wait(60)
        try:
            precomputed = system.precomputed(system.parameter_values())
            y, out = np.linspace(0.1, 0.5, system.nq + system.nv), np.zeros(2)
            system.kernel("energy")(0.0, y, system.parameter_values(), out)
            results.append((precomputed.tobytes(), out.tobytes(), id(system.machine_code())))
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not errors and len(results) == 4 and len(set(results)) == 1
    assert len(made) == 1


def test_threads_that_evaluate_rows_at_once_have_code_that_lives(monkeypatch):
    system = load(GENERATED / "pendulum.py")
    kernel, p = system.kernel("energy"), system.parameter_values()
    states = np.linspace(0.1, 0.9, 8).reshape(4, 2)
    expected = np.array([kernel(0.0, y, p) for y in states])
    object_code = bridge.engine.object_code

    def slowly(*arguments, **options):
        code = object_code(*arguments, **options)
        time.sleep(0.05)  # all threads are between the place for the code and the code
        return code

    monkeypatch.setattr(bridge.engine, "object_code", slowly)
    bridge.rows_caller.cache_clear()
    gate, results, errors = threading.Barrier(4), [], []

    def work() -> None:
        gate.wait(60)
        try:
            for _ in range(3):
                out = np.zeros((4, expected.shape[1]))
                bridge.evaluate_rows(kernel.address, np.zeros(4), states, p, out)
                results.append(out)
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not errors
    np.testing.assert_array_equal(results, [expected] * 12)
