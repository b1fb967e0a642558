"""Verified digits of reference problems: loading tests/reference/*.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

FOLDER = Path(__file__).parent / "reference"


def load_reference(name: str) -> dict[str, Any]:
    """The reference problem of `tests/reference/<name>.json`, its numbers as text."""
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def numbers(values: list[str]) -> np.ndarray:
    """Decimal strings as doubles."""
    return np.array([float(value) for value in values])


def error(actual: np.ndarray, expected: np.ndarray, floor: float = 1.0) -> float:
    """Largest error of an array, relative where the expected value is larger than `floor`, else in parts of `floor`."""
    return float(np.max(np.abs(actual - expected) / np.maximum(np.abs(expected), floor)))
