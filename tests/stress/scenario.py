"""What a scenario is, what becomes of it, and the list of all of them."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

RIGHT, REFUSED, FLAGGED, DOUBTED = "right", "refused", "flagged", "doubted"
WRONG, HANG, CRASH = "WRONG", "HANG", "CRASH"
BAD = (WRONG, HANG, CRASH)
MODULES = (
    "every_method", "stability_limit", "stiffness", "extremes", "tolerances", "singular", "near_singular",
    "broken_forces", "spans", "events", "cuts", "random_models", "long_runs", "energy", "partition",
    "error_growth", "sizes", "jumped_over", "hostile", "messages", "plates", "ensembles", "saturated", "weak_friction",
    "company", "hostile_stores", "at_once", "elements", "kinks", "curves", "drifts", "wound",
    "noises", "tyres", "lagrangians", "turning_springs", "mixtures", "rescaled", "controlled", "rollers",
    "loaded_boxes", "touching_solids", "closed_trees", "free_bodies", "gear_trains", "event_functions",
    "pressed", "sliding", "two_forms", "start_conditions",
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What became of a scenario.

    Attributes
    ----------
    verdict : str
        right: the result agrees with an independent reference; refused: an error said why before anything ran;
        flagged: the run failed, or a health check failed, and says why; doubted: flagged, although it is right, where a
        scenario looks for that; WRONG: none of these, or not for the reason
        that holds; HANG: over its time limit; CRASH: its process died, or an error reached the user as a traceback.
    says : str
        Errors found, or the message that the user gets.
    """

    verdict: str
    says: str

    def to_dict(self) -> dict[str, str]:
        """Return the outcome for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class Scenario:
    """One situation.

    Attributes
    ----------
    kind : str
        The class of situations that it belongs to: a row of the table.
    name : str
        Unique among all.
    run : callable
        () -> Outcome.
    method : str
        What it runs with; empty where that is not the point.
    short : bool
        Whether it belongs to the short part, which the test suite runs.
    limit : float [s]
        How long it may take before it counts as a hang: enough to compile a step loop on a busy machine.
    """

    kind: str
    name: str
    run: Callable[[], Outcome]
    method: str = ""
    short: bool = True
    limit: float = 300.0


def all_scenarios() -> dict[str, Scenario]:
    """Return all scenarios by name, in a fixed order."""
    found: dict[str, Scenario] = {}
    for module in MODULES:
        for scenario in importlib.import_module(f"{__package__}.{module}").scenarios():
            if scenario.name in found:
                raise ValueError(f"two scenarios are called {scenario.name!r}")
            found[scenario.name] = scenario
    return found


_ADMITS = 3.0  # times what a run says of its error: its scale is the range, that of errors may be another


def admits(run: Solution, error: float) -> bool:
    """Return whether a run that misses its tolerance, or order, says by how much: it is not believed in vain."""
    said = next((entry.value for entry in run.health if entry.check == "accuracy"), None)
    return said is not None and said >= error / _ADMITS
