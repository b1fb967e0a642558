"""Other integrators on the same equations, each in a process of its own, for comparison."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .case import Row
from .sweep import all_levels, lost_again, tolerances

if TYPE_CHECKING:
    from .case import Case, Effort

_COMPILE_TIMEOUT = 300.0  # [s], beyond the time for measuring


def find_peers(folder: Path) -> dict[str, Path]:
    """Return the peers' scripts by name."""
    return {path.stem.removesuffix("_peer"): path for path in sorted(folder.glob("*_peer.py"))}


def run_peer(script: Path, case: Case, effort: Effort) -> Iterator[tuple[str, dict[str, Any]]]:
    """Measure a peer on a scene; yields the name and the result of each of its methods.

    A peer that is not installed, or fails, gives one result without runs that says why.
    """
    reference = case.reference
    job = {
        "p": reference.p.tolist(),
        "start": reference.start.tolist(),
        "end": reference.end.tolist(),
        "size": reference.size.tolist(),
        "t_end": case.scene.t_end,
        "atol_ratio": case.scene.atol_ratio,
        "tolerances": tolerances(effort.per_decade).tolist(),
        "effort": asdict(effort),
    }
    name = script.stem.removesuffix("_peer")
    with tempfile.TemporaryDirectory() as folder:
        module = Path(folder) / f"{case.system.name}.py"
        module.write_text(case.text, encoding="utf-8")
        yield from _results(name, _talk(script, json.dumps({**job, "module": str(module)}), effort))


def _talk(script: Path, job: str, effort: Effort) -> tuple[list[dict[str, Any]], str]:
    """Run a peer's process; returns the messages that it sent, and how it failed."""
    # One thread each, as the loops here have.
    threads = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")}
    limit = _COMPILE_TIMEOUT + 400.0 * effort.longest_run
    try:
        done = subprocess.run(
            [sys.executable, str(script)], input=job, capture_output=True, text=True, timeout=limit,
            env={**os.environ, **threads}, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        sent = error.stdout or b""
        return _messages(sent.decode() if isinstance(sent, bytes) else sent), f"given up after {limit:.0f} s"
    failure = ""
    if done.returncode:
        last = [line for line in done.stderr.splitlines() if line.strip()][-1:]
        failure = last[0] if last else f"ended with status {done.returncode}"
    return _messages(done.stdout), failure


def _messages(text: str) -> list[dict[str, Any]]:
    """Return what a peer sent: one JSON object a line; libraries may print other lines."""
    return [json.loads(line) for line in text.splitlines() if line.startswith("{") and line.endswith("}")]


def _results(name: str, talk: tuple[list[dict[str, Any]], str]) -> Iterator[tuple[str, dict[str, Any]]]:
    messages, failure = talk
    methods: dict[str, dict[str, Any]] = {}
    for message in messages:
        entry = methods.setdefault(message["method"], {"version": message["version"], "says": "", "rows": []})
        entry["says"] = message.get("says", entry["says"])
        if "row" in message:
            entry["rows"].append(Row(**message["row"]))
    if failure and not methods:
        methods[name] = {"version": None, "says": failure, "rows": []}
    for method, entry in methods.items():
        usable = [row for row in entry["rows"] if row.error is not None]
        says = entry["says"] or (failure if method == list(methods)[-1] else "")
        rows = [row.to_dict() for row in entry["rows"]]
        yield (
            method,
            {**entry, "says": says, "rows": rows, "levels": all_levels(usable), "lost": lost_again(usable)},
        )
