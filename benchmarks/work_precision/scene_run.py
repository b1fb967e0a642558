"""All measurements of one scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symgen.runtime.integrate.methods import METHODS
from symgen.runtime.options import RunOptions
from symgen.runtime.simulate import simulate

from .auto import auto_choices, auto_result
from .case import Case, Effort
from .reference import read_reference
from .sweep import LEVELS, Curve, all_levels, best_at, label, lost_again, sweep
from .timing import best_seconds, rhs_seconds, stage_overhead

if TYPE_CHECKING:
    from symgen.runtime.system import System

    from .scenes import Scene

_SOLVE_LEVEL = 1e-6  # the whole `solve` is timed at the first setting that is as accurate
_SOLVE_RUNS = 3


class SceneRun:
    """Measures a scene method by method; what is there when it is interrupted is kept.

    Parameters
    ----------
    scene : Scene
    system : System
    text : str
        Of its module, for peers.
    references : Path
        The folder with the end states.
    effort : Effort
    """

    def __init__(self, scene: Scene, system: System, text: str, references: Path, effort: Effort):
        self.case = Case(scene, system, text, read_reference(references, scene, system))
        self.effort = effort
        self.curves: dict[str, Curve] = {}
        self.solve_seconds: dict[str, float] = {}
        self.peers: dict[str, dict[str, Any]] = {}
        self.choices: list[dict[str, Any]] = []
        self.rhs_seconds: float | None = None

    def measure(self, methods: Sequence[str] | None, tell: Callable[[str], None]) -> None:
        """Measure methods (all by default), and what `auto` makes of the scene.

        Parameters
        ----------
        tell : callable
            Is told which method comes next.
        """
        self.rhs_seconds = rhs_seconds(self.case)
        for name in methods or METHODS:
            tell(name)
            try:
                self.curves[name] = sweep(self.case, name, self.effort)
                self._time_solve(name)
            except Exception as error:  # one method's fault must not cost the others' results
                says = f"internal error: {type(error).__name__}: {str(error).partition(chr(10))[0]}"
                self.curves[name] = Curve("rtol", says=says)
        tell("auto")
        self.choices = auto_choices(self.case)

    def _time_solve(self, name: str) -> None:
        """Time one whole call of `solve`: assembly, choices, frames and checks counted."""
        accurate = [row for row in self.curves[name].usable() if row.error <= _SOLVE_LEVEL]
        if not accurate:
            return
        row, scene = accurate[0], self.case.scene
        given: dict[str, Any] = {"t_end": scene.t_end, "method": name}
        given |= {"parameters": dict(scene.parameters), "start": dict(scene.start)}
        if self.curves[name].quantity == "step":
            given["step"] = row.setting
        else:
            given |= {"rtol": row.setting, "atol": row.setting * scene.atol_ratio}
        self.solve_seconds[name] = best_seconds(
            lambda: simulate(self.case.system, RunOptions(**given)), _SOLVE_RUNS, 0.0
        )

    def to_dict(self) -> dict[str, Any]:
        """Return all that was measured, for JSON."""
        scene, reference = self.case.scene, self.case.reference
        times = {name: all_levels(curve.usable()) for name, curve in self.curves.items()}
        auto = auto_result(self.choices, self.curves)
        factors = {}
        for level, seconds in auto["levels"].items():
            best = best_at(times, level)
            factors[level] = seconds / best[1] if seconds is not None and best is not None else None
        return {
            "scene": scene.name,
            "says": scene.says,
            "t_end": scene.t_end,
            "reference": {"error": reference.claimed, "method": reference.method},
            "rhs_seconds": self.rhs_seconds,
            "methods": {
                name: {
                    "quantity": curve.quantity, "levels": times[name], "says": curve.says,
                    "lost": lost_again(curve.usable()), "solve_seconds": self.solve_seconds.get(name),
                    "rows": [row.to_dict() for row in curve.rows],
                }
                for name, curve in self.curves.items()
            },
            "best": {level: best_at(times, level) for level in map(label, LEVELS)},
            "auto": {**auto, "factors": factors},
            "stage_overhead_seconds": stage_overhead(self.curves, self.rhs_seconds or 0.0),
            "peers": self.peers,
        }  # fmt: skip
