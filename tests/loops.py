"""Step loops for tests: the record of one, to call its functions; a process without machine code of any."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from symgen.runtime.code import stand_ins
from symgen.runtime.code.jitted import Jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import Loop


def bare_loop(sizes: np.ndarray, p: np.ndarray, addresses: np.ndarray, y: np.ndarray) -> Loop:
    """Return the record of a run at the state `y`, without frames and events."""
    none, rows = np.zeros(0), np.zeros((0, len(y)))
    control, counters = np.zeros(at.N_CONTROL), np.zeros(at.N_COUNTERS, dtype=np.int64)
    return Loop(
        addresses, sizes, p, control, counters, y, np.zeros(sizes[at.N_ROW]), none, none, rows, np.zeros((0, 2)),
        np.zeros((8, len(y))),
    )  # fmt: skip


def forget_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no jitted function have machine code in this process, as if it had met none before.

    What waits for better code meanwhile does not: its functions are forgotten.
    """
    monkeypatch.setattr(stand_ins, "_waiting", [])
    for module in list(sys.modules.values()):
        if getattr(module, "__name__", "").startswith("symgen.runtime."):
            for value in vars(module).values():
                if isinstance(value, Jitted):
                    monkeypatch.setattr(value, "_loaded", {})
                    monkeypatch.setattr(value, "_stand_ins", {})
