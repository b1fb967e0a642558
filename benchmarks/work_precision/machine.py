"""On what the figures were measured."""

from __future__ import annotations

import platform
from importlib import metadata
from pathlib import Path
from typing import Any

_PACKAGES = ("symgen", "numpy", "numba", "llvmlite")


def machine() -> dict[str, Any]:
    """Return processor, Python and package versions."""
    return {
        "processor": _processor(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in _PACKAGES},
    }


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:  # sources that are run where they lie
        return None


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()
