"""Every adaptive method at tolerances from 1e-2 to 1e-15 on scenes whose end is known to 18 digits."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator

import numpy as np

from symgen.model.library import bundled_folder
from symgen.runtime.integrate.methods import METHODS
from work_precision.scenes import SCENES

from .judging import attempt, end_error, judge
from .models import bundled
from .scenario import Outcome, Scenario

TOLERANCES = tuple(10.0**-n for n in range(2, 16))
_SCENES = ("heavy_top", "pendulum", "andrews", "heavy_top_absolute", "car_axis", "four_bar", "slider_crank")
_SHORT = ("heavy_top", "car_axis")
_AMPLIFIED = 1e6  # errors of a step grow that much in these scenes at most
_ROUNDED = 1e-9


def run_scene(name: str, method: str, rtol: float) -> Outcome:
    """Run a scene at a tolerance; its error may be as large as the tolerance times what the motion makes of it."""
    scene = SCENES[name]
    data = json.loads((bundled_folder() / "references" / f"{name}.json").read_text(encoding="utf-8"))
    end = (np.array([float(x) for x in data["end"][key]]) for key in "qv")
    run = attempt(
        bundled(scene.model, **scene.options), scene.t_end, method=method, rtol=rtol, atol=rtol * scene.atol_ratio,
        parameters=dict(scene.parameters), start=dict(scene.start),
    )  # fmt: skip
    return judge(run, end_error(*end), min(0.5, max(_ROUNDED, _AMPLIFIED * rtol)))


def scenarios() -> Iterator[Scenario]:
    """Yield all."""
    for name in _SCENES:
        for method in ["auto", *(name for name, method in METHODS.items() if method.adaptive)]:
            for rtol in TOLERANCES:
                run = functools.partial(run_scene, name, method, rtol)
                short = name in _SHORT and rtol in (1e-2, 1e-6, 1e-15)
                yield Scenario("tolerance", f"{name} at {rtol:.0e}: {method}", run, method, short=short)
