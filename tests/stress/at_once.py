"""Several processes at once on one cache folder, one output, one store: no torn files, nothing twice, no traceback.

Processes begin together and do the same, or one reads what another writes. Right is the same answer of each as of one
alone, or a refusal that names the other; of two that write one file, it is that of one of them, whole.
"""

from __future__ import annotations

import functools
import json
import os
import random
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from .hostile import bounded
from .scenario import CRASH, REFUSED, RIGHT, WRONG, Outcome, Scenario

_SHORT, _LONG = 1, 8
_LIMIT = 200.0
_PROCESSES = 3
_MAIN = "import sys; from symgen.entry import main; sys.exit(main())"
_READ = """
import sys, time
from symgen.runtime import load
until = time.monotonic() + 2.5
while time.monotonic() < until:
    load(sys.argv[1]).kernel("rhs")
"""
_MODELS = ("pendulum", "double_pendulum", "slider_crank", "stick_slip", "bouncing_ball", "pendulum_dae")
_SWEEP = (
    "sweep", "pendulum", "--vary", "L=normal(1, 0.1)", "-n", "40", "--method", "bdf", "--t-end", "5", "--threads", "1",
    "--quiet",
)  # fmt: skip


def scenarios() -> Iterator[Scenario]:
    """All of them; the first one of each kind that takes seconds belongs to the test suite."""
    kinds: dict[str, Callable[[random.Random], Outcome]] = {
        "one cache": cache,
        "one store": store,
        "one file of members": members,
        "derived while run": derived,
    }
    for kind, run in kinds.items():
        for seed in range(_LONG):
            yield Scenario(
                f"at once, {kind}", f"at once, {kind} {seed}", functools.partial(bounded, run, kind, seed),
                short=seed < _SHORT and run in (cache, derived), limit=_LIMIT,
            )  # fmt: skip


def together(*commands: tuple[str, ...], cache_folder: str = "cache") -> list[tuple[int, str]]:
    """Run commands at the same time; their exit status and what they say."""
    environment = {**os.environ, "SYMGEN_CACHE_DIR": str(Path(cache_folder).absolute())}
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", *((_MAIN, *command) if command[0] != _READ else command)],
            env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )
        for command in commands
    ]  # fmt: skip
    said = [process.communicate(timeout=_LIMIT)[0] for process in processes]
    return [(process.returncode, text) for process, text in zip(processes, said, strict=True)]


def crashed(done: list[tuple[int, str]]) -> Outcome | None:
    for status, said in done:
        if "Traceback" in said or "internal error" in said or "Exception ignored" in said or status < 0:
            return Outcome(CRASH, said[-1000:].replace("\n", " "))
        if status not in (0, 1, 3) or (status == 1 and "Error: " not in said):
            return Outcome(WRONG, f"status {status}: {said[-500:]}")
    return None


def cache(r: random.Random) -> Outcome:
    """A cold cache, and one that is damaged or emptied while it is used."""
    name, method = r.choice(_MODELS), r.choice(("auto", "dop853", "radau5", "rk4"))
    command = ("run", name, "--t-end", "0.2", "--method", method, "--no-log", "--quiet")
    done = together(*[(*command, "--json", f"{k}.json") for k in range(_PROCESSES)])
    if bad := crashed(done):
        return bad
    if any(status not in (0, 3) for status, _ in done):
        return Outcome(WRONG, str(done))
    states = [json.loads(Path(f"{k}.json").read_text())["coordinates"] for k in range(_PROCESSES)]
    left = [
        x.name
        for x in Path("cache").rglob("*")
        if x.is_file() and (x.name.startswith(".new") or "tmp" in x.name)
    ]
    if left:
        return Outcome(WRONG, f"left in the cache: {left}")
    files = [x for x in Path("cache").rglob("*") if x.is_file()]
    for file in r.sample(files, min(3, len(files))):  # torn by a machine that lost power
        file.write_bytes(file.read_bytes()[: r.randrange(max(1, file.stat().st_size))])
    again = together(*[(*command, "--json", f"{k}.json") for k in range(2)])
    if bad := crashed(again):
        return bad
    states += [json.loads(Path(f"{k}.json").read_text())["coordinates"] for k in range(2)]
    return Outcome(RIGHT if all(x == states[0] for x in states) else WRONG, str(states))


def store(r: random.Random) -> Outcome:
    """The same store is made, or gone on with, by several."""
    from symgen.runtime.ensemble.zarr_store import ZarrStore

    together((*_SWEEP, "--out", "alone.zarr"))
    resume = ("--resume",) if r.random() < 0.6 else ()
    if resume and r.random() < 0.7:
        together((*_SWEEP, "--out", "runs.zarr"))
        for k in r.sample(range(4), 3):
            (Path("runs.zarr/status/c") / str(k)).unlink()
    looks = [("sweep", "--show", "runs.zarr")] if Path("runs.zarr").exists() else []
    done = together(*[(*_SWEEP, *resume, "--out", "runs.zarr")] * _PROCESSES, *looks)
    if bad := crashed(done):
        return bad
    if not any(status == 0 for status, _ in done[:_PROCESSES]):
        return Outcome(WRONG, f"none has come to its end: {done}")
    alone, one = ZarrStore.open("alone.zarr"), ZarrStore.open("runs.zarr")
    wrong = [name for name in alone.names if alone.read(name).tobytes() != one.read(name).tobytes()]
    left = [x.name for x in Path.cwd().iterdir() if x.name.startswith(".new")]
    if wrong or left:
        return Outcome(WRONG, f"{wrong} are others; left: {left}")
    return Outcome(
        RIGHT if all(status == 0 for status, _ in done) else REFUSED, " ".join(said for _, said in done)
    )


def members(r: random.Random) -> Outcome:
    """The same file of NumPy is written by several, while it is shown."""
    seeds = [str(r.randrange(2)) for _ in range(_PROCESSES)]
    together((*_SWEEP, "--seed", "0", "--out", "0.npz"), (*_SWEEP, "--seed", "1", "--out", "1.npz"))
    Path("runs.npz").write_bytes(Path("0.npz").read_bytes())
    done = together(
        *[(*_SWEEP, "--seed", seed, "--out", "runs.npz") for seed in seeds], ("sweep", "--show", "runs.npz")
    )
    if bad := crashed(done):
        return bad
    with np.load("runs.npz") as found, np.load("0.npz") as first, np.load("1.npz") as second:
        whole = [
            all(found[x].tobytes() == one[x].tobytes() for x in one.files if x != "about")
            for one in (first, second)
        ]
    left = [x.name for x in Path.cwd().iterdir() if x.name.startswith(".new")]
    return Outcome(RIGHT if any(whole) and not left else WRONG, f"{whole}, {left}")


def derived(r: random.Random) -> Outcome:
    """A module is written by several while others read it; it is whole each time."""
    name = r.choice(_MODELS)
    together(("derive", name, "-o", "."))
    true = Path(f"{name}.py").read_bytes()
    derive, read = ("derive", name, "-o", "."), (_READ, f"{name}.py")
    done = together(derive, read, derive, read, derive)
    if bad := crashed(done):
        return bad
    left = [x.name for x in Path.cwd().iterdir() if x.name not in ("cache", f"{name}.py")]
    same = Path(f"{name}.py").read_bytes() == true
    return Outcome(
        RIGHT if same and not left and not any(s for s, _ in done) else WRONG, f"{same}, {left}, {done}"
    )
