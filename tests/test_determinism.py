"""The same model gives the same bytes in every process, whatever the hash seed is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = """
import hashlib, sys
sys.path.insert(0, sys.argv[1])
from symgen.derive.pipeline import derive
from symgen.emit.module import emit
from symgen.model.library import find, load
from symgen.derive.solve import choice
small = ("chain_absolute", {"N": "5"}), ("n_pendulum", {"N": "25"}), ("andrews_squeezer", None)
for name, options in (*small, ("n_pendulum", {"N": "26"})):
    if options == {"N": "26"}:
        choice.FEWEST_RATES = 10**9  # by its matrix, in loops
    text = emit(derive(load(find(name), options).describe()))
    print(name, "factor_ldl" in text, hashlib.sha256(text.encode()).hexdigest())
"""


def run(seed: str) -> str:
    return subprocess.run(
        [sys.executable, "-c", SCRIPT, str(ROOT)],
        env={**os.environ, "PYTHONHASHSEED": seed},
        capture_output=True,
        text=True,
        check=True,
    ).stdout


def test_hash_seed_does_not_matter():
    first = run("0")
    assert "n_pendulum False" in first and "n_pendulum True" in first
    assert run("1") == first
    assert run("random") == first
