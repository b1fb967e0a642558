"""Scenarios run in processes of their own, under a time limit: one that hangs or dies takes nothing else along."""

from __future__ import annotations

import json
import os
import queue
import selectors
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from .scenario import CRASH, HANG, Outcome, Scenario

ROOT = Path(__file__).parents[2]
_SECONDS_TO_START = 60.0


@dataclass(frozen=True)
class Result:
    """A scenario and what became of it."""

    scenario: Scenario
    outcome: Outcome
    seconds: float


class Worker:
    """One process; it is started anew after a hang or a crash."""

    def __init__(self):
        self._process: subprocess.Popen | None = None
        self._fresh = True

    def run(self, scenario: Scenario) -> Result:
        """Run a scenario to its end or its time limit."""
        process = self._started()
        limit = scenario.limit + (_SECONDS_TO_START if self._fresh else 0.0)
        self._fresh = False
        process.stdin.write(scenario.name + "\n")
        process.stdin.flush()
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            ready = selector.select(limit)
        if not ready:
            self.stop()
            return Result(scenario, Outcome(HANG, f"no end within {scenario.limit:g} s"), limit)
        line = process.stdout.readline()
        if not line:
            code = process.wait()
            self.stop()
            why = signal.Signals(-code).name if code < 0 else f"exit status {code}"
            return Result(scenario, Outcome(CRASH, f"the process ended with {why}"), 0.0)
        answer = json.loads(line)
        return Result(scenario, Outcome(answer["verdict"], answer["says"]), answer["seconds"])

    def stop(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process.stdin.close()
            self._process.stdout.close()
        self._process = None

    def _started(self) -> subprocess.Popen:
        if self._process is None:
            command = [sys.executable, "-m", "tests.stress.worker"]
            self._process = subprocess.Popen(
                command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            )  # fmt: skip
            self._fresh = True
        return self._process


def run_all(
    scenarios: Sequence[Scenario], n_workers: int, tell: Callable[[Result], None] = lambda result: None
) -> list[Result]:
    """Run scenarios in a number of processes; returns their results in the scenarios' order."""
    waiting: queue.SimpleQueue[tuple[int, Scenario]] = queue.SimpleQueue()
    for entry in enumerate(scenarios):
        waiting.put(entry)
    results: list[Result | None] = [None] * len(scenarios)

    def serve() -> None:
        worker = Worker()
        try:
            while True:
                index, scenario = waiting.get_nowait()
                results[index] = worker.run(scenario)
                tell(results[index])
        except queue.Empty:
            pass
        finally:
            worker.stop()

    threads = [threading.Thread(target=serve) for _ in range(n_workers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return [result for result in results if result is not None]
