"""Ctrl-C, SIGTERM and SIGHUP: a run ends with its recording whole; machine code that does not return is left."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from symgen.cli.failures import answered_interrupts
from symgen.runtime.recording.reader import read_recording
from symgen.runtime.uninterrupted import uninterrupted

ROOT = Path(__file__).parents[1]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

# A C function that goes on for minutes and looks at no signal.
STUCK = """
import hashlib
from symgen.cli.failures import answered_interrupts
with answered_interrupts():
    print("ready", flush=True)
    hashlib.pbkdf2_hmac("sha256", b"x", b"y", 2_000_000_000)
"""


def usual_signals():
    # A shell starts its background jobs with Ctrl-C ignored, nohup with SIGHUP, and a process inherits that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


@contextlib.contextmanager
def started(*command):
    """A process that is not left behind, whatever becomes of the test."""
    process = subprocess.Popen(
        [sys.executable, *map(str, command)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT, preexec_fn=usual_signals,
    )  # fmt: skip
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_machine_code_that_does_not_return_is_left(name, status):
    with started("-c", STUCK) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(2.0)  # until it is in the C function
        sent = time.monotonic()
        process.send_signal(getattr(signal, name))
        _, said = process.communicate(timeout=60)
    assert process.returncode == status
    assert time.monotonic() - sent < 10.0  # 0.6 s on a machine that has nothing else to do
    assert "a recording keeps what was written to it" in said


@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_run_ends_with_its_recording_whole(tmp_path, name, status):
    log = tmp_path / "run.rrd"
    code = "import sys; from symgen.cli import main; main(sys.argv[1:])"
    command = ["run", "pendulum", "--t-end", "2000000", "--method", "dopri5", "--rtol", "1e-12", "--fps", "2"]
    with started("-c", code, *command, "--log", log, "--quiet") as process:
        end = time.monotonic() + 100.0
        while time.monotonic() < end and not (log.exists() and log.stat().st_size > 500_000):
            time.sleep(0.02)
        process.send_signal(getattr(signal, name))
        _, said = process.communicate(timeout=100)
    assert process.returncode == status, said
    assert "Interrupted at t = " in said
    recording = read_recording(log)
    assert recording.complete and recording.status == "interrupted" and not recording.lost


def test_signals_are_held_back_and_handed_on():
    seen = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: seen.append(number))
    try:
        with uninterrupted(), uninterrupted():
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.01)
            assert seen == []
        assert seen == [signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_check_ends_as_interrupted(name, status):
    """Runs that a command makes for itself, one after the other, are no failures of the model then."""
    code = (
        "import sys, symgen.runtime.checks.convergence as c; make = c.simulate\n"
        "def simulate(*a, **k): print('ready', flush=True); return make(*a, **k)\n"
        "c.simulate = simulate; from symgen.cli import main; main(sys.argv[1:])"
    )
    command = ["check", "double_pendulum", "--t-end", "100000", "--method", "dopri5"]
    with started("-c", code, *command) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(1.0)
        process.send_signal(getattr(signal, name))
        _, said = process.communicate(timeout=100)
    assert process.returncode == status, said
    assert said.endswith("interrupted\n") and "Error" not in said


@pytest.mark.parametrize("place", ["parse_args", "invoke"])
def test_ctrl_c_before_a_command_begins(place):
    """Ctrl-C while arguments are read, or signals are about to be answered, says the same as later."""
    code = (
        "import click, symgen.cli.failures as f\n"
        "def stop(*a, **k): raise KeyboardInterrupt\n"
        f"place = {place!r}\n"
        "if place == 'parse_args': f.FailuresAsSentences.parse_args = stop\n"
        "else: f.answered_interrupts = stop\n"
        "from symgen.cli import main; main(['list'])"
    )
    with started("-c", code) as process:
        out, said = process.communicate(timeout=100)
    assert (process.returncode, out, said.strip()) == (130, "", "interrupted")


def test_ctrl_c_while_modules_are_imported():
    code = (
        "import sys\n"
        "class Stop:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'symgen.cli': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Stop())\n"
        "from symgen.entry import main; main()"
    )
    with started("-c", code) as process:
        out, said = process.communicate(timeout=100)
    assert (process.returncode, out, said.strip()) == (130, "", "interrupted")


@pytest.mark.parametrize("closed", ["2>&-", ">&-", ">&- 2>&-"])
def test_standard_streams_that_are_closed(tmp_path, closed):
    run = f'"{sys.executable}" -c "from symgen.cli import main; main()" run pendulum --t-end 1 --no-log {closed}'
    done = subprocess.run(run, shell=True, env=ENVIRONMENT, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0
    assert ("success" in done.stdout) == (closed == "2>&-") and not done.stderr


def test_an_interrupt_that_python_lets_out_nowhere_comes_again():
    """Handlers act where the program is: at an object's end, or in a callback, what they raise is only printed."""

    class Ending:
        def __del__(self):
            signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt), answered_interrupts():
        Ending()
        time.sleep(5.0)


# A thread that waits for what nobody gives back, as the lock of an import that an interrupt has cut off.
WAITING = """
import threading, time
from symgen.cli.failures import answered_interrupts
threading.Thread(target=threading.Event().wait).start()
with answered_interrupts():
    print("ready", flush=True)
    time.sleep(60)
"""


def test_a_thread_that_waits_for_ever_keeps_no_program():
    with started("-c", WAITING) as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=40)
    assert process.returncode == 143
    assert "something did not come to its end" in said
