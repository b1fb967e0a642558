"""The stress suite: hard and odd situations, each judged right, refused, flagged, or wrong (docs/stress.md)."""

import sys
from pathlib import Path

_ROOT = Path(__file__).parents[2]
# What pytest finds by itself: scenes of the benchmark, and modules beside the tests.
sys.path += [str(folder) for folder in (_ROOT / "benchmarks", _ROOT / "tests") if str(folder) not in sys.path]
